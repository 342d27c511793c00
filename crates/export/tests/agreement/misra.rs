//! The C99 that is exported, looked through by cppcheck and its addon for MISRA C:2012.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use coldplate_export::{Target, export};
use coldplate_runtime::Surrogate;

use crate::{fixtures, folder, is_there, skipped};

/// Rules that are deviated from, and warnings of cppcheck that are not heeded; docs/reference/export-targets.md says why.
const DEVIATIONS: [&str; 5] = ["misra-c2012-2.5", "misra-c2012-8.7", "misra-c2012-8.9", "misra-c2012-14.1", "variableScope"];

/// What is said of the files of a folder: rule or warning, and where.
fn said(folder: &Path, files: &[&str]) -> Vec<(String, String)> {
    let found = Command::new("cppcheck")
        .current_dir(folder)
        .args(["--std=c99", "--addon=misra", "--enable=style,warning,performance,portability", "--inconclusive", "--quiet"])
        .args(["--suppress=missingIncludeSystem", "--template={id} {file}:{line}"])
        .args(files)
        .output()
        .expect("cppcheck starts");
    assert!(found.status.success(), "{}", String::from_utf8_lossy(&found.stderr));
    let lines = String::from_utf8_lossy(&found.stderr).into_owned();
    lines.lines().filter_map(|line| line.split_once(' ')).map(|(id, place)| (id.into(), place.into())).collect()
}

#[test]
fn the_c_keeps_the_rules_of_misra_but_for_what_the_page_says() {
    if !is_there("cppcheck") {
        skipped("cppcheck is not on this machine");
        return;
    }
    let folder = folder("misra");
    // What is looked for is found where it is.
    std::fs::write(
        folder.join("wrong.c"),
        "int first(int x);\nint first(int x)\n{\n    if (x > 0) goto end;\n    x = 2;\nend:\n    return x;\n}\n",
    )
    .expect("the folder can be written to");
    let found = said(&folder, &["wrong.c"]);
    assert!(found.iter().any(|(id, _)| id == "misra-c2012-15.1"), "{found:?}");

    let mut seen = BTreeSet::new();
    // These have every part of the source between them but three kernels; more files take the tool minutes.
    let parts = ["bare", "known", "moving", "polynomial"];
    for (name, bytes) in fixtures().into_iter().filter(|(name, _)| parts.contains(&name.as_str())) {
        let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
        for file in export(&surrogate, Target::C99, "surrogate").expect("the name is one") {
            std::fs::write(folder.join(&file.name), &file.content).expect("the folder can be written to");
        }
        for (id, place) in said(&folder, &["surrogate.c"]) {
            // Macros that nobody uses are those of the header.
            let is_known = DEVIATIONS.contains(&id.as_str()) && (id != "misra-c2012-2.5" || place.starts_with("surrogate.h"));
            assert!(is_known, "{name}: {id} at {place}");
            seen.insert(id);
        }
    }
    assert_eq!(seen.len(), DEVIATIONS.len(), "deviations that are none: {seen:?}");
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/export-targets.md"))
        .expect("the page is there");
    for rule in DEVIATIONS.iter().filter_map(|own| own.strip_prefix("misra-c2012-")) {
        assert!(page.contains(&format!("| {rule} |")), "the page does not say why {rule} is deviated from");
    }
    let _ = std::fs::remove_dir_all(&folder);
}
