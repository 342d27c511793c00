//! The report of a job: the answer first, statistics of the solver last, and a PDF of few pages.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::{scratch, status};
use crate::common::{coldplate, message, root};

/// Most pages of the PDF of the main job.
const PAGES: usize = 8;

/// Whether a browser that could print is in the PATH.
pub fn can_print() -> bool {
    let found = ["chromium", "google-chrome"].iter().any(|name| Command::new(name).arg("--version").output().is_ok());
    if !found {
        eprintln!("skipped: no Chromium that could print a report as PDF");
    }
    found
}

/// The report of the main job, whose surrogate is asked whether its answer holds.
pub fn leads_with_the_answer(folder: &Path, ran: &Value) {
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    let place = |words: &str| page.find(words).unwrap_or_else(|| panic!("{words}"));
    let answer = &ran["answer"];
    let words = answer["text"].as_str().unwrap();
    assert!(words.starts_with("Acceptable up to") && words.contains("First limit: "), "{words}");
    let order = [
        "<p class=\"lead good\">",
        "measured readings inside their band",
        "The machine at the worst acceptable condition</title>",
        "Which conditions are acceptable</title>",
        "The ways of the heat at the worst acceptable condition</title>",
        "by which the fit misses the solver",
    ];
    assert!(order.windows(2).all(|pair| place(pair[0]) < place(pair[1])), "{order:?}");
    // The end of the answer is acceptable, and a little beyond it is not.
    let asked = |beyond: f64| {
        let surrogate = folder.join("surrogate.cps");
        let mut words = vec!["query".to_string(), surrogate.to_str().unwrap().into()];
        for (name, value) in answer["condition"].as_object().unwrap() {
            let (number, unit) = value.as_str().unwrap().split_once(' ').unwrap();
            let number = number.parse::<f64>().unwrap() * if name == "motor_speed" { beyond } else { 1.0 };
            words.extend([format!("--{}", name.replace('_', "-")), format!("{number} {unit}")]);
        }
        status(&coldplate(&words.iter().map(String::as_str).collect::<Vec<_>>()))
    };
    assert_eq!((asked(1.0), asked(1.01)), (0, 3));
}

/// The PDF is short, tagged, and its text can be selected.
pub fn is_printed_well(folder: &Path) {
    let pdf = std::fs::read(folder.join("report.pdf")).unwrap();
    let count = |words: &[u8]| pdf.windows(words.len()).filter(|own| *own == words).count();
    let pages = count(b"/Type /Page\n");
    assert!((3..=PAGES).contains(&pages), "{pages} pages");
    assert!(count(b"/StructTreeRoot") > 0 && count(b"/ToUnicode") > 0, "neither tags nor text that can be selected");
}

#[test]
fn a_browser_that_is_missing_shows_before_the_sweep() {
    let folder = scratch("no-browser");
    let ran = Command::new(env!("CARGO_BIN_EXE_coldplate"))
        .args(["run", "examples/tutorial/sweep.toml", "--pdf", "--out", folder.to_str().unwrap()])
        .env("COLDPLATE_CHROMIUM", "/nowhere/chromium")
        .current_dir(root())
        .output()
        .unwrap();
    let said = message(&ran);
    assert_eq!(status(&ran), 2, "{said}");
    assert!(said.contains("/nowhere/chromium") && said.contains("install Chromium") && said.contains("report.html"), "{said}");
    assert!(!folder.exists(), "the sweep has begun");
}

#[test]
fn a_browser_that_prints_nothing_is_a_failure_with_a_remedy() {
    let folder = scratch("bad-browser");
    let ran = Command::new(env!("CARGO_BIN_EXE_coldplate"))
        .args(["run", "examples/tutorial/sweep.toml", "--cells", "300", "--pdf", "--quiet", "--out", folder.to_str().unwrap()])
        .env("COLDPLATE_CHROMIUM", "true")
        .current_dir(root())
        .output()
        .unwrap();
    let said = message(&ran);
    assert_eq!(status(&ran), 4, "{said}");
    assert!(said.contains("wrote no PDF") && said.contains("print it there"), "{said}");
    assert!(folder.join("report.html").exists() && !folder.join("report.pdf").exists());
}
