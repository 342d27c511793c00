//! The arrows between the rooms of `src/`: who may use whom. Every path in every file counts, also in `use`
//! declarations broken over lines. Files of one room must not use each other in a circle, and crates depend on
//! nothing but what is listed.

mod paths;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use paths::{SourceFile, sources};

/// What each room may use; `x::*` stands for every room of the group `x`. A file outside all rooms fails the test.
const ALLOWED: &[(&str, &[&str])] = &[
    ("error", &[]),
    ("units", &["error"]),
    ("foundation::atomic_file", &["error"]),
    ("foundation::random", &[]),
    ("foundation::numbers", &[]),
    ("foundation::vector", &[]),
    ("foundation::progress", &[]),
    ("foundation::input", &["error"]),
    ("foundation::memory", &[]),
    ("foundation::document", &["error", "units", "foundation::input"]),
    ("foundation::formula", &["error", "units", "foundation::document"]),
    ("foundation::table", &["error", "units", "foundation::atomic_file", "foundation::input"]),
    ("foundation::vtu", &["error", "foundation::input", "foundation::vector"]),
    ("physics", &["error", "units"]),
    // The names of an imported mesh are checked with the machine file, so its reader lies below the machine.
    ("describe::gmsh", &["error", "foundation::input"]),
    ("describe::schema", &["error", "units", "foundation::document"]),
    ("describe::machine", &["error", "units", "foundation::*", "physics", "describe::gmsh", "describe::schema"]),
    ("discretise::mesh", &["error", "units", "foundation::atomic_file", "foundation::vector", "describe::*"]),
    ("discretise::elastic", &["error", "describe::machine", "discretise::mesh"]),
    (
        "discretise::network",
        &["error", "units", "foundation::formula", "describe::machine", "discretise::mesh", "discretise::elastic", "physics"],
    ),
    ("solve", &["error", "units", "foundation::progress", "discretise::network", "physics"]),
    (
        "solve::meshed",
        &[
            "error",
            "units",
            "foundation::memory",
            "foundation::numbers",
            "foundation::progress",
            "describe::machine",
            "discretise::*",
            "physics",
            "solve",
        ],
    ),
    ("solve::calculix", &["error", "units", "describe::machine", "discretise::*", "physics", "solve::meshed"]),
    (
        "solve::sensitivity",
        &[
            "error",
            "units",
            "foundation::document",
            "foundation::progress",
            "describe::*",
            "discretise::*",
            "solve",
            "solve::meshed",
            "physics",
        ],
    ),
    (
        "reduce",
        &[
            "error",
            "foundation::document",
            "foundation::progress",
            "foundation::random",
            "describe::machine",
            "discretise::*",
            "physics",
            "solve",
            "solve::sensitivity",
        ],
    ),
    ("explore::schedule", &["error", "units", "foundation::table", "describe::machine"]),
    (
        "explore::simulate",
        &[
            "error",
            "units",
            "foundation::*",
            "describe::machine",
            "discretise::network",
            "solve",
            "solve::meshed",
            "reduce",
            "explore::schedule",
        ],
    ),
    ("explore::cluster", &["error", "foundation::*", "explore::sweep"]),
    ("explore::external", &["error", "units", "foundation::*", "describe::machine"]),
    (
        "explore::sweep",
        &[
            "error",
            "units",
            "foundation::*",
            "describe::machine",
            "discretise::network",
            "solve",
            "solve::*",
            "reduce",
            "explore::external",
        ],
    ),
    ("surrogate::fit", &["error", "units", "foundation::*"]),
    ("surrogate::verdict", &["error", "units", "foundation::*", "surrogate::fit"]),
    ("figures::chart", &["error", "units", "foundation::atomic_file"]),
    ("figures::report", &["error", "units", "foundation::atomic_file", "figures::chart"]),
    ("evidence::measurement", &["error", "units", "foundation::*", "describe::machine"]),
    ("evidence::discrepancy", &["foundation::numbers", "units", "describe::machine", "evidence::measurement"]),
    ("evidence::sandwich", &["evidence::measurement", "evidence::discrepancy"]),
    (
        "evidence::identify",
        &[
            "error",
            "units",
            "foundation::*",
            "describe::machine",
            "discretise::network",
            "solve",
            "solve::*",
            "explore::schedule",
            "explore::simulate",
            "evidence::measurement",
            "evidence::discrepancy",
            "evidence::sandwich",
        ],
    ),
    (
        "evidence::faulty",
        &["error", "describe::machine", "explore::simulate", "solve::sensitivity", "evidence::measurement", "evidence::identify"],
    ),
    (
        "evidence::residuals",
        &[
            "error",
            "units",
            "foundation::*",
            "describe::machine",
            "explore::simulate",
            "solve::sensitivity",
            "evidence::measurement",
            "evidence::identify",
        ],
    ),
    (
        "evidence::diagnose",
        &[
            "error",
            "units",
            "foundation::*",
            "physics",
            "describe::machine",
            "discretise::network",
            "solve::sensitivity",
            "explore::simulate",
            "evidence::measurement",
            "evidence::identify",
            "evidence::faulty",
            "evidence::discrepancy",
            "evidence::sandwich",
        ],
    ),
    (
        "pipeline",
        &[
            "error",
            "units",
            "foundation::*",
            "describe::machine",
            "solve",
            "solve::*",
            "reduce",
            "explore::*",
            "surrogate::*",
            "figures::*",
        ],
    ),
    (
        "pipeline::diagnosis",
        &[
            "error",
            "units",
            "foundation::*",
            "describe::machine",
            "solve::meshed",
            "solve::sensitivity",
            "surrogate::*",
            "figures::*",
            "evidence::*",
            "pipeline",
        ],
    ),
    (
        "cli",
        &[
            "error",
            "units",
            "foundation::*",
            "describe::*",
            "physics",
            "discretise::*",
            "solve",
            "solve::*",
            "reduce",
            "explore::*",
            "surrogate::*",
            "figures::*",
            "evidence::*",
            "pipeline",
            "pipeline::*",
        ],
    ),
];

/// What the leaf crates may depend on.
const CRATES: &[(&str, &[&str])] = &[
    ("capi", &["coldplate-runtime"]),
    ("export", &["coldplate-runtime", "prost", "zip"]),
    ("runtime", &[]),
    ("serve", &["axum", "hyper", "hyper-util", "prometheus-client", "serde_json", "subtle", "tokio", "tokio-io-timeout"]),
    ("tables", &["polars-core", "polars-io"]),
];

/// The room of a module path: the longest name in the plan that it begins with.
fn room(path: &str) -> Option<&'static str> {
    let names = ALLOWED.iter().map(|(name, _)| *name);
    names.filter(|name| path == *name || path.starts_with(&format!("{name}::"))).max_by_key(|name| name.len())
}

fn may_use(allowed: &[&str], used: &str) -> bool {
    let covers = |a: &&str| *a == used || a.strip_suffix('*').is_some_and(|group| used.starts_with(group));
    allowed.iter().any(covers)
}

fn library() -> Vec<SourceFile> {
    let files = sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"));
    let groups: BTreeSet<&str> = ALLOWED.iter().filter_map(|(name, _)| name.split_once("::").map(|(group, _)| group)).collect();
    // The crate's own page and the pages of groups only list what is in them.
    let only_lists = |f: &SourceFile| matches!(f.module.as_str(), "lib" | "main") || f.is_folder && room(&f.module).is_none();
    assert!(files.iter().filter(|f| only_lists(f) && f.is_folder).all(|f| groups.contains(f.module.as_str())));
    files.into_iter().filter(|f| !only_lists(f)).collect()
}

#[test]
fn arrows_point_one_way() {
    let mut wrong = BTreeSet::new();
    let mut seen = BTreeSet::new();
    for file in library() {
        let Some(own) = room(&file.module) else {
            wrong.insert(format!("'{}' is in no room of the plan", file.module));
            continue;
        };
        seen.insert(own);
        let allowed = ALLOWED.iter().find(|(name, _)| *name == own).map_or(&[][..], |(_, allowed)| allowed);
        for used in &file.uses {
            match room(used) {
                Some(other) if other == own || may_use(allowed, other) => {}
                Some(other) => {
                    wrong.insert(format!("'{}' uses '{other}' ({used})", file.module));
                }
                None => {}
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert_eq!(seen.len(), ALLOWED.len(), "rooms in the plan that are not in src/: {:?}", {
        ALLOWED.iter().map(|(name, _)| *name).filter(|name| !seen.contains(name)).collect::<Vec<_>>()
    });
}

#[test]
fn files_of_a_room_do_not_use_each_other_in_a_circle() {
    let files = library();
    // What a folder's own page says is vocabulary that its files share; files beside each other must have an order.
    let leaves: Vec<&str> = files.iter().filter(|f| !f.is_folder).map(|f| f.module.as_str()).collect();
    let target = |used: &str| {
        let begins = |m: &&&str| used == **m || used.starts_with(&format!("{m}::"));
        leaves.iter().filter(begins).max_by_key(|m| m.len()).copied()
    };
    let arrows: BTreeMap<&str, BTreeSet<&str>> = files
        .iter()
        .filter(|f| !f.is_folder)
        .map(|f| (f.module.as_str(), f.uses.iter().filter_map(|u| target(u)).filter(|t| *t != f.module).collect()))
        .collect();
    let reach = |from: &str| {
        let (mut found, mut open) = (BTreeSet::new(), vec![from]);
        while let Some(module) = open.pop() {
            for next in arrows.get(module).into_iter().flatten() {
                if found.insert(*next) {
                    open.push(next);
                }
            }
        }
        found
    };
    let circles: Vec<&str> = leaves.iter().copied().filter(|m| reach(m).contains(m)).collect();
    assert!(circles.is_empty(), "files that use each other in a circle: {circles:#?}");
    assert!(arrows.values().map(BTreeSet::len).sum::<usize>() > 100, "the arrows between files were not found");
}

#[test]
fn only_the_command_line_knows_the_web() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let place = |file: &SourceFile| {
        let folder = file.module.replace("::", "/");
        root.join(if file.is_folder { format!("{folder}/mod.rs") } else { format!("{folder}.rs") })
    };
    let knows = |file: &SourceFile| std::fs::read_to_string(place(file)).unwrap().contains("coldplate_serve::");
    let found: Vec<String> = sources(&root).into_iter().filter(knows).map(|file| file.module).collect();
    assert_eq!(found, ["cli::serve"]);
}

#[test]
fn crates_depend_on_nothing_else() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (name, allowed) in CRATES {
        let text = std::fs::read_to_string(root.join("crates").join(name).join("Cargo.toml")).unwrap();
        let manifest: toml::Table = text.parse().unwrap();
        let found: Vec<&str> =
            manifest.get("dependencies").and_then(|d| d.as_table()).into_iter().flatten().map(|(k, _)| k.as_str()).collect();
        assert_eq!(&found, allowed, "dependencies of crates/{name}");
        let files = sources(&root.join("crates").join(name).join("src"));
        assert!(!files.is_empty());
    }
}
