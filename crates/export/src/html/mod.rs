//! A page that answers while its sliders move: one file, which asks for nothing and needs no server.

use coldplate_runtime::Surrogate;

use crate::content::Content;
use crate::template::Filling;
use crate::{File, json};

const PAGE: &str = include_str!("page.html");
/// The arithmetic, which tests run by itself.
const CORE: &str = include_str!("surrogate.js");

pub(crate) fn write(surrogate: &Surrogate<'_>, content: &Content, name: &str) -> Vec<File> {
    let mut filling = Filling::default();
    // Names stay text, whatever they hold: no tag begins in the page's data.
    filling.block("surrogate", json::write(surrogate, content).replace('<', "\\u003c"));
    filling.block("core", CORE.to_owned());
    vec![File { name: format!("{name}.html"), text: filling.fill(PAGE, name) }]
}
