//! Pages in one file each, which load nothing else and need no server: of a surrogate with immediate answers to its sliders, and of a
//! machine at conditions that were solved.

use coldplate_runtime::Surrogate;

use crate::content::Content;
use crate::template::Filling;
use crate::{Beside, File, json};

/// The page of a surrogate.
const PAGE: &str = include_str!("page.html");
/// The page of a machine at conditions that were solved.
const STATES_PAGE: &str = include_str!("states.html");
/// Pieces of both pages, by the names of their blocks; tests run the arithmetic alone.
const PIECES: [(&str, &str); 20] = [
    // Colours, letters and tables; and those of the picture of the machine.
    ("style", include_str!("style.css")),
    ("stage_style", include_str!("stage.css")),
    // The picture of the machine, and what it is turned and cut with.
    ("stage", include_str!("stage.html")),
    ("controls", include_str!("controls.html")),
    // Arithmetic of the surrogate, at other values of held variables, and over time.
    ("core", include_str!("surrogate.js")),
    ("followed", include_str!("followed.js")),
    ("in_time", include_str!("in_time.js")),
    // How names and numbers are written, and in which units.
    ("written", include_str!("written.js")),
    ("units", include_str!("units.js")),
    // State of the page in its address, and steps back.
    ("linked", include_str!("linked.js")),
    // Conditions side by side, and map of verdicts.
    ("compared", include_str!("compared.js")),
    ("map", include_str!("map.js")),
    // Pictures of the points over every variable, and over time.
    ("predictions", include_str!("predictions.js")),
    ("course", include_str!("course.js")),
    // Shape and field of the machine, its picture, the picture of a surrogate's machine, and the one along its course.
    ("scene", include_str!("scene.js")),
    ("picture", include_str!("picture.js")),
    ("pictured", include_str!("pictured.js")),
    ("along", include_str!("along.js")),
    // Measured tables beside the answers.
    ("readings", include_str!("readings.js")),
    // The machine at conditions that were solved.
    ("states", include_str!("states.js")),
];

/// Pieces of both pages with the data of the picture; `scene` is the machine as JSON.
fn filling(scene: Option<&str>) -> Filling {
    let mut filling = Filling::default();
    PIECES.into_iter().for_each(|(name, text)| filling.block(name, text.to_owned()));
    filling.block("scene_data", without_tags(scene.unwrap_or_default()));
    filling
}

pub(crate) fn write(surrogate: &Surrogate<'_>, content: &Content, beside: &Beside<'_>, name: &str) -> Vec<File> {
    let mut filling = filling(beside.scene);
    filling.flag("scene", beside.scene.is_some());
    filling.flag("moving", content.in_time.is_some());
    filling.flag("moved", beside.scene.is_some() && content.in_time.is_some());
    filling.block("surrogate", without_tags(&json::write(surrogate, content, beside.followed)));
    vec![File::new(format!("{name}.html"), filling.fill(PAGE, name).into_bytes())]
}

/// The page of a machine at conditions that were solved: `scene` is the machine and its temperatures as JSON.
pub(crate) fn states(scene: &str) -> String {
    filling(Some(scene)).fill(STATES_PAGE, "states")
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
