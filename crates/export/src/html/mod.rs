//! A page with immediate answers to its sliders: one file, which loads nothing else and needs no server.

use coldplate_runtime::Surrogate;

use crate::content::Content;
use crate::template::Filling;
use crate::{Beside, File, json};

/// The page.
const PAGE: &str = include_str!("page.html");
/// Arithmetic of the surrogate; tests run it alone.
const CORE: &str = include_str!("surrogate.js");
/// Answers at other values of held variables; tests run it alone.
const FOLLOWED: &str = include_str!("followed.js");
/// Units in which numbers are shown.
const UNITS: &str = include_str!("units.js");
/// State of the page in its address, and steps back.
const LINKED: &str = include_str!("linked.js");
/// Conditions side by side.
const COMPARED: &str = include_str!("compared.js");
/// Map of verdicts.
const MAP: &str = include_str!("map.js");
/// Pictures of the points over every variable.
const PREDICTIONS: &str = include_str!("predictions.js");
/// Arithmetic of the machine over time; tests run it alone.
const IN_TIME: &str = include_str!("in_time.js");
/// Picture of the readings over time.
const COURSE: &str = include_str!("course.js");
/// Shape and field of the machine; tests run it alone.
const SCENE: &str = include_str!("scene.js");
/// Picture of the machine in three dimensions.
const PICTURE: &str = include_str!("picture.js");
/// Measured tables beside the picture.
const READINGS: &str = include_str!("readings.js");

pub(crate) fn write(surrogate: &Surrogate<'_>, content: &Content, beside: &Beside<'_>, name: &str) -> Vec<File> {
    let mut filling = Filling::default();
    filling.flag("scene", beside.scene.is_some());
    filling.block("scene_data", without_tags(beside.scene.unwrap_or_default()));
    filling.block("followed", FOLLOWED.to_owned());
    filling.block("scene", SCENE.to_owned());
    filling.block("picture", PICTURE.to_owned());
    filling.block("surrogate", without_tags(&json::write(surrogate, content, beside.followed)));
    filling.block("core", CORE.to_owned());
    for (name, text) in [("units", UNITS), ("linked", LINKED), ("compared", COMPARED), ("map", MAP), ("predictions", PREDICTIONS)] {
        filling.block(name, text.to_owned());
    }
    filling.flag("moving", content.in_time.is_some());
    filling.block("in_time", IN_TIME.to_owned());
    filling.block("course", COURSE.to_owned());
    filling.block("readings", READINGS.to_owned());
    vec![File::new(format!("{name}.html"), filling.fill(PAGE, name).into_bytes())]
}

/// JSON in which no tag begins: names stay text, whatever characters they contain.
fn without_tags(json: &str) -> String {
    json.replace('<', "\\u003c")
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_name_ends_no_script() {
        assert_eq!(super::without_tags("{\"name\": \"</script><b>\"}"), "{\"name\": \"\\u003c/script>\\u003cb>\"}");
    }
}
