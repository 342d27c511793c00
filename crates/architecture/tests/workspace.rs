//! The shape of the workspace: which crate may use which, in which order the modules of a crate stand, no circles among files,
//! every permission used, the hash of the numerics complete, and comments that name their subject.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use coldplate_architecture::{SourceFile, sources};

/// Every crate of the workspace with the crates of the project that it uses. A crate may use only crates above it.
const CRATES: &[(&str, &[&str])] = &[
    ("runtime", &[]),
    ("source-hash", &[]),
    ("batch", &["runtime"]),
    ("capi", &["batch", "runtime"]),
    ("export", &["runtime"]),
    ("serve", &[]),
    ("base", &["runtime"]),
    ("tables", &["base"]),
    ("physics", &["base"]),
    ("figures", &["base"]),
    ("describe", &["base", "physics"]),
    ("network", &["base", "describe", "physics"]),
    ("solve", &["base", "describe", "network", "physics"]),
    ("reduce", &["base", "describe", "network", "physics", "solve"]),
    ("explore", &["base", "describe", "network", "physics", "reduce", "solve", "tables"]),
    // Fits and verdicts work on any table, measured ones too: they never see the solver.
    ("surrogate", &["base", "batch", "runtime", "tables"]),
    ("evidence", &["base", "describe", "explore", "network", "solve", "tables"]),
    ("diagnose", &["base", "describe", "evidence", "explore", "network", "physics", "solve"]),
    ("jobs", &["base", "describe", "explore", "export", "figures", "network", "reduce", "runtime", "solve", "surrogate", "tables"]),
    ("findings", &["base", "describe", "diagnose", "evidence", "figures", "jobs", "runtime", "solve", "surrogate"]),
    ("interchange", &["base", "describe", "network", "physics", "solve", "tables"]),
];

/// Crates in which the modules at the top have an order: a module may use only modules before it. Modules that are not named
/// here stand between the last named module and the page of the crate.
const MODULES: &[(&str, &[&str])] = &[
    // The names of an imported mesh are checked with the machine file, so its reader lies below the machine.
    ("describe", &["gmsh", "schema", "machine"]),
    ("figures", &["chart", "report"]),
    ("surrogate", &["fit", "verdict"]),
    ("evidence", &["measurement", "discrepancy", "sandwich", "identify", "faulty_readings", "command_input", "record", "residuals"]),
];

/// Third-party crates that one crate alone may know.
const ALONE: &[(&str, &str)] =
    &[("parquet", "tables"), ("plotters", "figures"), ("axum", "serve"), ("pyo3", "python"), ("prost", "export"), ("zip", "export")];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn manifest(folder: &Path) -> toml::Table {
    std::fs::read_to_string(folder.join("Cargo.toml")).unwrap().parse().unwrap()
}

/// Names below `[dependencies]` and `[target.*.dependencies]`.
fn dependencies(manifest: &toml::Table) -> BTreeSet<String> {
    let own = manifest.get("dependencies").and_then(toml::Value::as_table).into_iter();
    let targets = manifest.get("target").and_then(toml::Value::as_table).into_iter().flat_map(|targets| targets.values());
    let of_targets = targets.filter_map(|target| target.get("dependencies").and_then(toml::Value::as_table));
    own.chain(of_targets).flat_map(|table| table.keys().cloned()).collect()
}

/// Folder, name and source files of every crate, the root package last under the name `coldplate`.
fn packages() -> Vec<(PathBuf, String)> {
    let mut found: Vec<(PathBuf, String)> = std::fs::read_dir(root().join("crates"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|folder| folder.join("Cargo.toml").is_file())
        .map(|folder| (folder.clone(), folder.file_name().unwrap().to_string_lossy().into_owned()))
        .collect();
    found.sort();
    found.push((root(), "coldplate".into()));
    found
}

/// Text of a source file without its comments.
fn code(file: &Path) -> String {
    let text = std::fs::read_to_string(file).unwrap();
    text.lines().filter(|line| !line.trim_start().starts_with("//")).map(|line| format!("{line}\n")).collect()
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(rust_files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

#[test]
fn crates_use_what_the_table_says() {
    let mut wrong = Vec::new();
    for (k, (name, allowed)) in CRATES.iter().enumerate() {
        let manifest = manifest(&root().join("crates").join(name));
        let found: BTreeSet<String> =
            dependencies(&manifest).iter().filter_map(|d| d.strip_prefix("coldplate-").map(String::from)).collect();
        let stated: BTreeSet<String> = allowed.iter().map(ToString::to_string).collect();
        wrong.extend((found != stated).then(|| format!("{name} depends on {found:?}, the table says {stated:?}")));
        let above: BTreeSet<&str> = CRATES[..k].iter().map(|(name, _)| *name).collect();
        wrong.extend(allowed.iter().filter(|d| !above.contains(*d)).map(|d| format!("{name} uses {d}, which does not stand above it")));
    }
    let listed: BTreeSet<&str> = CRATES.iter().map(|(name, _)| *name).collect();
    // These two see everything, as the program does.
    let outside = ["architecture", "python", "testing", "coldplate"];
    let all = packages();
    wrong.extend(
        all.iter()
            .filter(|(_, n)| !listed.contains(n.as_str()) && !outside.contains(&n.as_str()))
            .map(|(_, n)| format!("{n} is not in the table")),
    );
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn every_dependency_is_used() {
    let mut idle = Vec::new();
    for (folder, name) in packages() {
        let text: String = rust_files(&folder.join("src")).iter().map(|file| code(file)).collect();
        for dependency in dependencies(&manifest(&folder)) {
            // Features of these are switched on for the wheel; its macros name the others.
            let for_features = ["matrixmultiply", "num-complex", "either", "num-integer", "pulp"].contains(&dependency.as_str());
            let word = dependency.replace('-', "_");
            let used = text.contains(&format!("{word}::")) || text.contains(&format!("use {word}"));
            idle.extend((!used && !for_features).then(|| format!("{name}: {dependency}")));
        }
    }
    assert!(idle.is_empty(), "dependencies that nothing uses: {idle:#?}");
}

#[test]
fn some_libraries_are_known_to_one_crate_alone() {
    for (folder, name) in packages() {
        let known = dependencies(&manifest(&folder));
        for (library, owner) in ALONE {
            assert!(name == *owner || !known.contains(*library), "{name} depends on {library}, which is for {owner} alone");
        }
    }
}

#[test]
fn modules_stand_in_order() {
    let mut wrong = Vec::new();
    for (name, order) in MODULES {
        let files = sources(&root().join("crates").join(name).join("src"));
        let rank = |path: &str| order.iter().position(|m| path == *m || path.starts_with(&format!("{m}::")));
        for file in &files {
            let Some(own) = rank(&file.module) else { continue };
            let later = file.uses.iter().filter(|used| rank(used).is_some_and(|r| r > own));
            wrong.extend(later.map(|used| format!("{name}: '{}' uses '{used}'", file.module)));
        }
        let seen: BTreeSet<usize> = files.iter().filter_map(|f| rank(&f.module)).collect();
        assert_eq!(seen.len(), order.len(), "{name}: a module of the table is not there");
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Files of one crate that use each other in a circle. The page of a folder is vocabulary that its files share; files beside
/// each other must have an order.
fn circles(files: &[SourceFile]) -> Vec<String> {
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
    leaves.iter().filter(|m| reach(m).contains(*m)).map(ToString::to_string).collect()
}

#[test]
fn files_of_a_crate_do_not_use_each_other_in_a_circle() {
    let found: Vec<String> = packages()
        .iter()
        .flat_map(|(folder, name)| circles(&sources(&folder.join("src"))).into_iter().map(move |module| format!("{name}: {module}")))
        .collect();
    assert!(found.is_empty(), "files that use each other in a circle: {found:#?}");
}

#[test]
fn circles_are_found() {
    let file = |module: &str, uses: &[&str]| SourceFile {
        module: module.into(),
        is_folder: false,
        uses: uses.iter().map(ToString::to_string).collect(),
    };
    assert_eq!(circles(&[file("a", &["b::X"]), file("b", &["c"]), file("c", &["a::y"]), file("d", &["a"])]), ["a", "b", "c"]);
}

#[test]
fn only_the_command_line_knows_the_web() {
    for (folder, name) in packages() {
        let knows = |file: &PathBuf| code(file).contains("coldplate_serve::");
        let found: Vec<PathBuf> = rust_files(&folder.join("src")).into_iter().filter(knows).collect();
        let allowed = name == "coldplate" && found == [root().join("src/cli/serve.rs")];
        assert!(found.is_empty() || allowed, "{found:?}");
    }
}

/// A journal is refused by a build with other numerics, so the hash must cover every crate that a sweep uses.
#[test]
fn the_hash_of_the_numerics_covers_all_that_sweeps_use() {
    let mut closure = BTreeSet::from(["explore"]);
    for (name, uses) in CRATES.iter().rev() {
        if closure.contains(name) {
            closure.extend(uses.iter());
        }
    }
    // Nothing is computed by the runtime there: names and limits of length are taken from it.
    closure.remove("runtime");
    let page = code(&root().join("crates/explore/src/lib.rs"));
    for name in closure {
        let hashed = if name == "explore" { "        SOURCES,".to_string() } else { format!("coldplate_{name}::SOURCES") };
        assert!(page.contains(&hashed), "numerics() leaves out {name}");
        let script = root().join("crates").join(name).join("build.rs");
        assert!(script.is_file() && code(&script).contains("coldplate_source_hash::emit()"), "{name} does not hash its sources");
    }
}

/// First words of a comment that leave its subject to the reader.
const RIDDLES: [&str; 8] = ["The same", "Its", "Of", "Those", "It", "As", "What", "Where"];

#[test]
fn doc_comments_name_their_subject() {
    let mut found = Vec::new();
    for (folder, name) in packages() {
        // Comments of the diagnosis are left for the engine that replaces most of it.
        if name == "diagnose" {
            continue;
        }
        for file in rust_files(&folder.join("src")) {
            for (k, line) in std::fs::read_to_string(&file).unwrap().lines().enumerate() {
                let Some(text) = line.trim_start().strip_prefix("///") else { continue };
                let begins = |word: &&&str| text.trim_start().strip_prefix(**word).is_some_and(|rest| rest.starts_with([' ', ',', ':']));
                if RIDDLES.iter().find(begins).is_some() {
                    found.push(format!("{}:{}:{text}", file.display(), k + 1));
                }
            }
        }
    }
    assert!(found.is_empty(), "comments that do not name their subject: {found:#?}");
}

/// Lines of `cargo tree`, each a dependency with its features, of a selection of the workspace's crates.
fn selection(arguments: &[&str]) -> BTreeSet<String> {
    let tree = std::process::Command::new(env!("CARGO"))
        .args(["tree", "--locked", "--prefix", "none", "--format", "{p} {f}"])
        .args(arguments)
        .current_dir(root())
        .output()
        .unwrap();
    assert!(tree.status.success(), "{}", String::from_utf8_lossy(&tree.stderr));
    String::from_utf8(tree.stdout)
        .unwrap()
        .lines()
        .map(|line| line.replace(" (proc-macro)", "").replace(" (*)", "").trim().to_owned())
        .collect()
}

#[test]
fn dependencies_compile_once() {
    let tested = selection(&["--workspace", "--edges", "normal,build,dev"]);
    for (what, arguments) in
        [("program", vec!["--edges", "normal,build"]), ("wheel", vec!["-p", "coldplate-python", "--edges", "normal,build"])]
    {
        let own: Vec<String> = selection(&arguments).difference(&tested).cloned().collect();
        assert!(own.is_empty(), "the {what} builds with features that the tests do not have: {own:#?}\nstate them in Cargo.toml");
    }
}
