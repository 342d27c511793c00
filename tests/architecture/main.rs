//! The arrows between the rooms of `src/`: who may use whom. Reads the `crate::` paths of every file.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// What each room may use. A room that is not listed fails the test.
const ALLOWED: &[(&str, &[&str])] = &[
    ("error", &[]),
    ("files", &["error"]),
    ("random", &[]),
    ("units", &["error"]),
    ("reader", &["error", "units"]),
    ("formula", &["error", "units", "reader"]),
    ("physics", &["error", "units"]),
    // The names of an imported mesh are checked with the machine file, so its reader lies below the machine.
    ("gmsh", &["error"]),
    ("machine", &["error", "units", "reader", "formula", "physics", "gmsh"]),
    ("mesh", &["error", "files", "units", "machine", "gmsh"]),
    ("network", &["error", "units", "machine", "mesh", "physics"]),
    ("solve", &["error", "units", "network", "physics"]),
    ("model", &["error", "units", "machine", "mesh", "network", "physics", "solve"]),
    ("sensitivity", &["error", "units", "reader", "machine", "mesh", "network", "solve", "model", "physics"]),
    ("table", &["error", "files", "units"]),
    ("schedule", &["error", "units", "machine", "table"]),
    ("simulate", &["error", "files", "units", "machine", "table", "model", "network", "solve", "schedule"]),
    ("measure", &["error", "units", "reader", "machine", "table"]),
    ("identify", &["error", "units", "random", "reader", "machine", "measure", "network", "schedule", "simulate", "solve", "sensitivity"]),
    (
        "diagnose",
        &["error", "units", "random", "reader", "machine", "measure", "identify", "sensitivity", "simulate", "network", "physics"],
    ),
    ("sweep", &["error", "units", "random", "reader", "machine", "table", "model", "network", "solve"]),
    ("fit", &["error", "files", "random", "units", "table"]),
    ("accept", &["error", "units", "fit"]),
    ("chart", &["error", "files", "units"]),
    ("report", &["error", "files", "units", "chart"]),
    ("job", &["error", "units", "reader", "machine", "model", "solve", "table", "sweep", "fit", "accept", "chart", "report"]),
];

fn rooms_used(path: &Path, found: &mut BTreeSet<String>) {
    if path.is_dir() {
        for entry in std::fs::read_dir(path).unwrap() {
            rooms_used(&entry.unwrap().path(), found);
        }
        return;
    }
    let text = std::fs::read_to_string(path).unwrap();
    // Unit tests may reach further than the code they test.
    let code = text.split("#[cfg(test)]").next().unwrap_or("");
    for line in code.lines().filter(|l| !l.trim_start().starts_with("//")) {
        for piece in line.split("crate::").skip(1) {
            if let Some(group) = piece.strip_prefix('{') {
                let names = group.split(&[',', '}'][..]).map(|n| n.trim().split("::").next().unwrap_or("").to_string());
                found.extend(names.filter(|n| !n.is_empty() && n.chars().all(|c| c.is_lowercase() || c == '_')));
            } else {
                let name: String = piece.chars().take_while(|c| c.is_lowercase() || *c == '_').collect();
                found.insert(name);
            }
        }
    }
}

#[test]
fn arrows_point_one_way() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut used: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for entry in std::fs::read_dir(&src).unwrap() {
        let path = entry.unwrap().path();
        let room = path.file_stem().unwrap().to_string_lossy().into_owned();
        if matches!(room.as_str(), "lib" | "main" | "cli") {
            continue;
        }
        rooms_used(&path, used.entry(room).or_default());
    }
    let mut wrong = Vec::new();
    for (room, uses) in &used {
        let Some((_, allowed)) = ALLOWED.iter().find(|(name, _)| name == room) else {
            wrong.push(format!("'{room}' is not in the plan"));
            continue;
        };
        for name in uses {
            if name != room && !allowed.contains(&name.as_str()) {
                wrong.push(format!("'{room}' uses '{name}'"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(used.len() > 10, "the rooms were not found");
}

#[test]
fn nothing_but_the_program_sees_the_command_line() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for entry in std::fs::read_dir(&src).unwrap() {
        let path = entry.unwrap().path();
        let mut found = BTreeSet::new();
        if !matches!(path.file_stem().unwrap().to_string_lossy().as_ref(), "cli" | "main") {
            rooms_used(&path, &mut found);
        }
        assert!(!found.contains("cli"), "{} uses cli", path.display());
    }
}
