//! Output for readers: tables that fit the window, colours on a terminal alone, the main job in a few lines; and mistakes
//! named all at once, files of the wrong kind by the command that takes them.

use std::path::Path;
use std::process::{Command, Output};

use coldplate_base::document::Document;
use coldplate_describe::machine::SCHEMA;

use super::{coldplate, files, json, message, scratch, status};
use crate::common::root;

fn widest(text: &str) -> usize {
    text.lines().map(|line| line.chars().count()).max().unwrap_or(0)
}

/// A run in a window of so many columns.
fn in_window(columns: &str, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_coldplate")).args(words).current_dir(root()).env("COLUMNS", columns).output().unwrap()
}

fn printed(output: &Output) -> String {
    assert_eq!(status(output), 0, "{}", message(output));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn an_inventory_fits_the_window() {
    for machine in files("machines") {
        let words = ["check", machine.to_str().unwrap(), "--cells", "500"];
        for columns in ["60", "80", "100", "200"] {
            let text = printed(&in_window(columns, &words));
            assert!(widest(&text) <= columns.parse().unwrap(), "{columns}: {text}");
        }
        // Without a window, tables are as wide as a page; sentences stay on their line.
        let text = printed(&coldplate(&words));
        let wide = text.lines().filter(|line| line.starts_with("  ") && line.chars().count() > 120).count();
        assert_eq!(wide, 0, "{text}");
        // Numbers and words are the same in all of them, in JSON to the letter.
        let record = |columns| printed(&in_window(columns, &[&words[..], &["--json"]].concat()));
        assert_eq!(record("60"), record("200"));
    }
}

/// The value of an assumption is data: whole, however long.
#[test]
fn no_value_is_cut_in_json() {
    let found = json(&coldplate(&["check", "machines/rig.toml", "--cells", "500", "--json"]));
    let assumed: Vec<&str> = found["assumptions"].as_array().unwrap().iter().map(|a| a["value"].as_str().unwrap()).collect();
    assert!(assumed.iter().any(|value| value.len() > 123) && assumed.iter().all(|value| !value.ends_with("...")), "{assumed:?}");
}

#[test]
fn the_main_job_answers_in_a_few_lines() {
    let folder = scratch("few-lines");
    let words = ["run", "examples/tutorial/sweep.toml", "--cells", "300", "--quiet", "--out", folder.to_str().unwrap()];
    let text = printed(&coldplate(&words));
    assert!(text.lines().count() <= 12, "{text}");
    // The answer, and how far it can be trusted, first.
    assert!(text.starts_with("Acceptable up to "), "{text}");
    assert!(text.lines().nth(1).is_some_and(|line| line.starts_with("largest held-out error ")), "{text}");
    // Every file is named, or stands in a folder that is.
    let again = json(&coldplate(&[&words[..], &["--json"]].concat()));
    let file_names = again["files"].as_array().unwrap().iter().map(|file| Path::new(file.as_str().unwrap()));
    let (figures, others): (Vec<&Path>, Vec<&Path>) = file_names.partition(|file| file.parent().unwrap().ends_with("charts"));
    assert!(text.contains(&format!("{} figures", figures.len())), "{text}");
    for file in others {
        assert!(text.contains(file.file_name().unwrap().to_str().unwrap()), "{file:?}: {text}");
    }
    // The largest error of the table is the one that is stated.
    let of = |point: &serde_json::Value| point["held_out"]["max_K"].as_f64().unwrap();
    let worst = again["points"].as_array().unwrap().iter().max_by(|a, b| of(a).total_cmp(&of(b))).unwrap();
    assert!(text.contains(&format!("({})", worst["name"].as_str().unwrap())), "{worst}: {text}");
}

#[test]
fn a_file_of_another_kind_is_named_with_the_command_that_takes_it() {
    let surrogate = "crates/runtime/fixtures/polynomial.cps";
    let cases: &[(&[&str], &[&str])] = &[
        (&["run", "machines/rig.toml"], &["this is a machine file", "takes a sweep file", "`check`, `solve`", "machine = \"FILE\""]),
        (&["solve", "sweeps/rig.toml"], &["this is a sweep file", "takes a machine file or a reduced model", "`run`, `sweep`"]),
        (&["check", "data/rig.csv"], &["this is a table", "takes a machine file", "`predict`"]),
        (&["query", "machines/rig.toml"], &["this is a machine file", "takes a surrogate"]),
        (&["check", surrogate], &["this is a surrogate", "takes a machine file", "`query`"]),
        (&["predict", "machines/rig.toml", "sweeps/rig.toml"], &["this is a sweep file", "takes a table"]),
        (&["fit", "machines/rig.toml"], &["this is a machine file", "takes a table"]),
        (&["export", "machines/rig.toml", "--to", "c99"], &["this is a machine file", "takes a surrogate"]),
        (&["check", "charts/errors.toml"], &["this is a chart definition", "`chart` takes"]),
    ];
    for (words, needles) in cases {
        let output = coldplate(words);
        assert_eq!(status(&output), 2, "{words:?}: {}", message(&output));
        for needle in *needles {
            assert!(message(&output).contains(needle), "{words:?} lacks '{needle}': {}", message(&output));
        }
    }
    // Files of the right kind with a mistake keep their own message.
    let output = coldplate(&["check", "machines/rig.toml", "--set", "contact.motor.conductence=1"]);
    assert!(message(&output).contains("unknown key 'conductence'"), "{}", message(&output));
}

#[test]
fn all_mistakes_of_a_file_are_named_at_once() {
    let folder = scratch("mistakes");
    std::fs::create_dir_all(&folder).unwrap();
    let at = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_string()
    };
    let machine = "name = \"block\"\n[part.block]\nmaterial = \"steel\"\nbox = [\"10 mm\", \"10 mm\", \"50 s\"]\n[boundary.cold]\n\
                   faces = [\"block.-z\"]\ntemprature = \"20 degC\"\n[source.heat]\nin = [\"block\"]\npower = \"1 K\"\n\
                   [sensor.top]\nface = \"block.+z\"\n[mesh]\ncells = \"many\"\n[limit.top]\nsensor = \"top\"\nmaximum = \"60\"\n";
    let output = coldplate(&["check", &at("machine.toml", machine)]);
    let said = message(&output);
    assert_eq!(status(&output), 2, "{said}");
    let lines =
        ["machine.toml:7, boundary.cold.temprature", "machine.toml:4", "machine.toml:10, source.heat.power", "machine.toml:14, mesh.cells"];
    for needle in lines.iter().chain(&["machine.toml:17, limit.top.maximum", "did you mean 'temperature'"]) {
        assert!(said.contains(needle), "{needle}: {said}");
    }
    assert_eq!((said.matches("error: ").count(), said.matches(" help: ").count()), (5, 5), "{said}");
    let sweep = format!(
        "name = 3\nmachine = {:?}\ncells = 0\n[design]\nkind = \"sobol\"\nruns = 16\n[fit]\nmax_degree = 99\nfold = 3\n",
        root().join("machines/slab.toml")
    );
    let said = message(&coldplate(&["sweep", &at("sweep.toml", &sweep)]));
    for needle in ["sweep.toml:1, name", "sweep.toml:3, cells", "sweep.toml:8, fit.max_degree"] {
        assert!(said.contains(needle), "{needle}: {said}");
    }
    let ranges = "[range]\ncoolant_flow = [\"1 L/min\", \"3 m\"]\nmotor_sped = [\"1 rpm\", \"2 rpm\"]\nmotor_speed = [\"3 rpm\", \"2 rpm\"]\n\
                  [hold]\ncoolant_temperature = \"20\"\nambient_temperature = \"20 degC\"\n[validaton]\nruns = 3\n";
    let sweep = sweep.split("[fit]").next().unwrap().replace("name = 3", "name = \"slab\"").replace("cells = 0", "cells = 300") + ranges;
    let said = message(&coldplate(&["sweep", &at("sweep.toml", &sweep)]));
    for needle in ["hold.coolant_temperature", "motor_sped", "'validaton'", "did you mean 'validation'"] {
        assert!(said.contains(needle), "{needle}: {said}");
    }
    let toml = "name = \"x\"\na = 1 L/min\nb = [1, 2\nc = 2 K\n";
    let said = message(&coldplate(&["check", &at("syntax.toml", toml)]));
    assert!(said.contains("syntax.toml:2") && said.matches("error: ").count() > 1, "{said}");
}

/// Shipped files are read without an error, so that they have no mistake.
#[test]
fn shipped_machines_have_no_mistakes() {
    for machine in files("machines").iter().chain(&files("crates/describe/data/starters")) {
        let text = std::fs::read_to_string(machine).unwrap();
        let Ok(document) = Document::parse(&text, machine) else { continue };
        let found = SCHEMA.mistakes(&document.root());
        assert!(found.is_empty(), "{machine:?}: {found:?}");
    }
}

/// On a terminal, as `script` makes one: colours, and lines of its width.
#[cfg(target_os = "linux")]
#[test]
fn colours_are_for_terminals() {
    let on_terminal = |before: &str, words: &str| {
        let line = format!("stty cols 70; {before} {} {words}", env!("CARGO_BIN_EXE_coldplate"));
        let mut script = Command::new("script");
        script.args(["-qec", &line, "/dev/null"]).current_dir(root()).env("TERM", "xterm");
        let made = script.env_remove("NO_COLOR").env_remove("COLUMNS").output();
        made.ok().map(|output| String::from_utf8_lossy(&output.stdout).replace('\r', ""))
    };
    let Some(shown) = on_terminal("", "check machines/none.toml") else {
        eprintln!("skipped: `script` is not installed");
        return;
    };
    assert!(shown.contains("\u{1b}[1m\u{1b}[31merror:\u{1b}[0m") || shown.contains("\u{1b}[1;31merror:\u{1b}[0m"), "{shown:?}");
    let plain = on_terminal("NO_COLOR=1", "check machines/none.toml").unwrap();
    assert!(plain.contains("error:") && !plain.contains('\u{1b}'), "{plain:?}");
    let text = on_terminal("NO_COLOR=1", "check machines/slab.toml --quiet").unwrap();
    assert!(text.contains("part") && widest(&text) <= 70, "{text}");
    // Into a pipe: none.
    let output = coldplate(&["check", "machines/none.toml"]);
    assert!(!message(&output).contains('\u{1b}'));
}
