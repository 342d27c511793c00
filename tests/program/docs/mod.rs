//! What the pages show is what the program prints and draws.
//!
//! A block behind `<!-- prints: coldplate ... -->` is held against what that command prints, one behind
//! `<!-- prints part of: coldplate ... -->` against a part of it; `solve` and `check` in a `console` block against what
//! stands below them, and every command of a page that says so. A line `...` leaves lines out. Numbers agree to the digits shown, give or take one in the last; times
//! are not compared. Pictures in `docs/images` named as a chart definition are held against what that draws.

mod blocks;
mod compare;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use blocks::Block;

/// The sweep whose results the pages show.
const MAIN_JOB: &str = "coldplate run sweeps/five_axis.toml";

fn project() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn pages() -> Vec<PathBuf> {
    fn below(folder: &Path) -> Vec<PathBuf> {
        let entries: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()).collect();
        entries.into_iter().flat_map(|path| if path.is_dir() { below(&path) } else { vec![path] }).collect()
    }
    let mut pages: Vec<PathBuf> = below(&project().join("docs")).into_iter().filter(|f| f.extension().is_some_and(|e| e == "md")).collect();
    pages.push(project().join("README.md"));
    pages.sort();
    pages
}

/// A folder that looks like the project but for its results, where the main job has been done; with what that printed.
fn workplace() -> &'static (PathBuf, String) {
    static PLACE: OnceLock<(PathBuf, String)> = OnceLock::new();
    PLACE.get_or_init(|| {
        let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("docs");
        let _ = std::fs::remove_dir_all(&place);
        std::fs::create_dir_all(&place).unwrap();
        for name in ["machines", "sweeps", "charts", "data", "schedules", "examples"] {
            std::os::unix::fs::symlink(project().join(name), place.join(name)).unwrap();
        }
        let printed = printed(&place, MAIN_JOB);
        (place, printed)
    })
}

fn printed(place: &Path, command: &str) -> String {
    let words = blocks::words(command);
    assert_eq!(words.first().map(String::as_str), Some("coldplate"), "{command}");
    let output = Command::new(env!("CARGO_BIN_EXE_coldplate")).args(&words[1..]).arg("--quiet").current_dir(place).output().unwrap();
    let [out, err] = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    if out.is_empty() { err } else { out }
}

#[test]
fn blocks_show_what_the_program_prints() {
    let (place, main_job) = workplace();
    let mut known: BTreeMap<String, String> = BTreeMap::from([(MAIN_JOB.to_string(), main_job.clone())]);
    let (mut stale, mut count) = (Vec::new(), 0);
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        for Block { line, command, shown, is_part } in blocks::of(&text) {
            let found = known.entry(command.clone()).or_insert_with(|| printed(place, &command));
            count += 1;
            if let Err(difference) = compare::texts(&shown, found, is_part) {
                stale.push(format!("{}:{line}: `{command}`\n{difference}", page.display()));
            }
        }
    }
    assert!(count >= 8, "only {count} blocks name the command that printed them");
    assert!(stale.is_empty(), "these blocks are not what the program prints now:\n\n{}", stale.join("\n\n"));
}

#[test]
fn pictures_show_what_their_definitions_draw() {
    let (place, _) = workplace();
    let images = project().join("docs/images");
    let definitions = std::fs::read_dir(project().join("charts")).unwrap().map(|f| f.unwrap().path());
    let mut drawn: Vec<String> = definitions
        .filter_map(|f| Some(f.file_stem()?.to_str()?.to_string()))
        .filter(|name| images.join(format!("{name}.svg")).exists())
        .collect();
    drawn.sort();
    assert!(drawn.len() >= 8, "only {drawn:?} come from chart definitions");
    let files: Vec<String> = drawn.iter().map(|name| format!("charts/{name}.toml")).collect();
    printed(place, &format!("coldplate chart {} --out images", files.join(" ")));
    let mut stale = Vec::new();
    for name in &drawn {
        let [old, new] = [images.join(format!("{name}.svg")), place.join(format!("images/{name}.svg"))]
            .map(|path| std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display())));
        if let Err(difference) = compare::pictures(&old, &new) {
            stale.push(format!("docs/images/{name}.svg: {difference}"));
        }
    }
    assert!(stale.is_empty(), "run scripts/docs: these pictures are not what their definitions draw now:\n{}", stale.join("\n"));
}

#[test]
fn every_picture_a_page_shows_exists() {
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()).filter(|link| link.ends_with(".svg")) {
            assert!(page.parent().unwrap().join(link).exists(), "{}: {link}", page.display());
        }
    }
}
