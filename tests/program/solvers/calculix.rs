//! Input decks for CalculiX: what it makes of them, and what they cannot say.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::{folder, json, output, root, said};

/// Digits that `ccx` prints leave this open in a temperature, K.
const PRINTED: f64 = 5e-5;

fn has_ccx() -> bool {
    let there = Command::new("ccx").arg("-v").output().is_ok();
    if !there {
        println!("skipped: there is no ccx (scripts/clients installs it)");
    }
    there
}

/// What CalculiX finds for each sensor of a machine, degC.
fn by_calculix(folder: &Path, machine: &str, options: &[&str]) -> BTreeMap<String, f64> {
    let told = json(folder, &[&["export", machine, "--to", "calculix", "--out", ".", "--name", "deck"], options].concat());
    let ran = Command::new("ccx").arg("deck").current_dir(folder).output().unwrap();
    assert!(ran.status.success(), "{}", said(&ran));
    let results = std::fs::read_to_string(folder.join("deck.dat")).unwrap();
    let value = |node: &Value| {
        let of_node = |line: &&str| line.split_whitespace().next() == Some(&node.to_string());
        let line = results.lines().find(of_node).unwrap_or_else(|| panic!("no node {node} in:\n{results}"));
        line.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap()
    };
    told["points"].as_array().unwrap().iter().map(|p| (p["sensor"].as_str().unwrap().to_string(), value(&p["node"]))).collect()
}

/// Readings and mesh errors of our own solver.
fn by_coldplate(folder: &Path, machine: &str, options: &[&str]) -> (Value, Value) {
    let own = json(folder, &[&["solve", machine], options].concat());
    (own["sensors"].clone(), own["mesh"]["errors_K"].clone())
}

#[test]
fn the_rig_agrees_within_what_the_mesh_leaves_open() {
    if !has_ccx() {
        return;
    }
    let folder = folder("deck-rig");
    let machine = root().join("machines/rig.toml");
    for condition in [
        &["--motor-speed", "2500 rpm"][..],
        &[
            "--motor-speed",
            "400 rpm",
            "--coolant-flow",
            "7e-5 m3/s",
            "--coolant-temperature",
            "18 degC",
            "--ambient-temperature",
            "30 degC",
        ],
    ] {
        let theirs = by_calculix(&folder, machine.to_str().unwrap(), condition);
        let (own, mesh) = by_coldplate(&folder, machine.to_str().unwrap(), condition);
        assert_eq!(theirs.len(), 6);
        for (sensor, degrees) in &theirs {
            let (ours, open) = (own[sensor].as_f64().unwrap(), mesh[sensor].as_f64().unwrap());
            assert!((degrees - ours).abs() <= open + PRINTED, "{sensor}: {degrees} by CalculiX, {ours} +- {open}");
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A long tube of exactly known temperatures: heat from its held bore through a contact to the film around a second tube.
const TUBES: &str = r#"
name = "Two tubes"
[variables]
coolant_flow = "1 L/min"
coolant_temperature = "20 degC"
motor_speed = "0 rpm"
ambient_temperature = "20 degC"
[mesh]
cells = 9000
[surfaces]
emissivity = 1e-9
[material.cross]
conductivity = ["8 W/(m K)", "3 W/(m K)", "50 W/(m K)"]
density = "5000 kg/m3"
specific_heat = "450 J/(kg K)"
source = "made up"
[part.inner]
material = "cross"
blocks = [{ cylinder = { axis = "x", inner = "20 mm", outer = "40 mm", length = "30 mm" }, cells = [12, 48, 2] }]
at = ["0 mm", "0 mm", "0 mm"]
[part.outer]
material = "cross"
blocks = [{ cylinder = { axis = "x", inner = "40 mm", outer = "60 mm", length = "30 mm" }, cells = [10, 60, 3] }]
at = ["0 mm", "0 mm", "0 mm"]
[contact.joint]
between = ["inner", "outer"]
conductance = "400 W/(m2 K)"
[boundary.bore]
faces = ["inner.inner"]
temperature = "80 degC"
[boundary.film]
faces = ["outer.outer"]
film = "150 W/(m2 K)"
fluid_temperature = "20 degC"
[sensor.middle]
point = ["15 mm", "30 mm", "0 mm"]
in = "inner"
[sensor.near]
face = "inner.outer"
[sensor.far]
face = "outer.inner"
[sensor.around]
face = "outer.outer"
"#;

#[test]
fn tubes_meet_their_exact_temperatures() {
    if !has_ccx() {
        return;
    }
    let folder = folder("deck-tubes");
    std::fs::write(folder.join("tubes.toml"), TUBES).unwrap();
    let found = by_calculix(&folder, "tubes.toml", &[]);
    // Resistances of one metre: ln(r2/r1) / (2 pi k), 1 / (h 2 pi r).
    let tau = std::f64::consts::TAU;
    let half = |r1: f64, r2: f64| (r2 / r1).ln() / (tau * 8.0);
    let (joint, film) = (1.0 / (400.0 * tau * 0.04), 1.0 / (150.0 * tau * 0.06));
    let watts = 60.0 / (half(0.02, 0.04) + joint + half(0.04, 0.06) + film);
    let near = 80.0 - watts * half(0.02, 0.04);
    let exact =
        [("middle", 80.0 - watts * half(0.02, 0.03)), ("near", near), ("far", near - watts * joint), ("around", 20.0 + watts * film)];
    for (sensor, degrees) in exact {
        // Chords of a 48th of a turn conduct (2 tan x) / 2x - 1 = 0.14 % more than arcs, of a drop of 60 K.
        assert!((found[sensor] - degrees).abs() < 0.02, "{sensor}: {} by CalculiX, {degrees} exactly", found[sensor]);
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Solid and hollow cylinders, a half turn, materials that follow direction and temperature, two blocks in one piece, branches of
/// water, films, fluxes and radiation on faces, lumped nodes, contacts between places that do not touch.
#[test]
fn a_machine_of_everything_agrees() {
    if !has_ccx() {
        return;
    }
    let folder = folder("deck-everything");
    let machine = root().join("tests/program/solvers/deck.toml");
    let machine = machine.to_str().unwrap();
    let (coarse, cells) = (["--cells", "1500"], ["--cells", "6000"]);
    let (before, theirs) = (by_calculix(&folder, machine, &coarse), by_calculix(&folder, machine, &cells));
    let (own, mesh) = by_coldplate(&folder, machine, &cells);
    assert_eq!(theirs.len(), 10);
    for (sensor, degrees) in &theirs {
        // Both have an error of their mesh: coldplate says its own, that of CalculiX shows on the coarser mesh.
        let (ours, open) = (own[sensor].as_f64().unwrap(), mesh[sensor].as_f64().unwrap() + (degrees - before[sensor]).abs());
        assert!((degrees - ours).abs() <= open + PRINTED, "{sensor}: {degrees} by CalculiX, {ours} +- {open}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn what_a_deck_cannot_say_is_refused() {
    let folder = folder("deck-refused");
    let plain = std::fs::read_to_string(root().join("tests/program/solvers/deck.toml")).unwrap();
    let with = |more: &str| format!("{plain}\n{more}\n");
    let coarse = plain.replace("[part.shaft]\nmaterial = \"hot\"\ncylinder = { axis = \"z\", outer = \"20 mm\", length = \"120 mm\" }", "[part.shaft]\nmaterial = \"hot\"\nblocks = [{ cylinder = { axis = \"z\", outer = \"20 mm\", length = \"120 mm\" }, cells = [2, 2, 4] }]");
    assert_ne!(coarse, plain);
    let ball = "[part.ball]\nmaterial = \"steel\"\nsphere = { outer = \"10 mm\" }\nat = [\"1 m\", \"0 m\", \"0 m\"]\n";
    let cases = [
        (with(ball), "part.ball", "as a box or a cylinder"),
        (
            with("[radiation_link.gap]\nbetween = [\"plate.+x\", \"shell.outer\"]\nview_factor = 0.1\nemissivity = [0.5, 0.5]"),
            "radiation_link.gap",
            "leave it out",
        ),
        (
            with("[boundary.spot]\nfaces = [\"plate.+y\"]\nwithin = { x = [\"3 mm\", \"50 mm\"] }\ntemperature = \"20 degC\""),
            "boundary.spot",
            "cut the part into blocks",
        ),
        (coarse, "part.shaft.cells", "three or more"),
        (
            plain.replace("coolant_flow = \"6 L/min\"", "coolant_flow = \"0 L/min\"").replace("0.2 * motor_speed_rpm", "0 W"),
            "channel.first",
            "a condition with flow",
        ),
    ];
    for (text, place, remedy) in cases {
        std::fs::write(folder.join("machine.toml"), text).unwrap();
        let refused = output(&folder, &["export", "machine.toml", "--to", "calculix"]);
        assert_eq!(refused.status.code(), Some(2), "{place}: {}", said(&refused));
        assert!(said(&refused).contains(place) && said(&refused).contains(remedy), "{place}, {remedy}: {}", said(&refused));
        assert!(said(&refused).contains("machine.toml"), "{}", said(&refused));
        assert!(!folder.join("machine.inp").exists());
    }
    std::fs::remove_dir_all(&folder).unwrap();
}
