//! `export --to html --machine`: the page with the machine in three dimensions, its field beside the solver's.

use std::path::Path;
use std::process::Command;

use crate::common::{coldplate_in, json, message, root, scratch};

/// Takes the data and the arithmetic out of a page, and tells the field of each vertex that is nearest to a sensor.
const DRIVER: &str = r#"
const page = require("fs").readFileSync(process.argv[2], "utf8");
const scripts = [...page.matchAll(/<script[^>]*>([^]*?)<\/script>/g)].map((found) => found[1]);
const [surrogate, machine] = scripts.slice(0, 2).map(JSON.parse);
const core = scripts[2].slice(0, scripts[2].indexOf("\n(() => {"));
const make = new Function("s", "m", core + "; return [coldplate(s), coldplateScene(m), coldplateField(m, s)];");
const [answers, scene, { field: fieldAt, selfTest }] = make(surrogate, machine);
const x = surrogate.variables.map((v) => v.low + 0.3 * (v.high - v.low));
const field = fieldAt(x, answers.evaluate(x));
const is_shown = machine.parts.map(() => true);
const first = machine.parts[0].first;
const corners = [0, 1, 2].map((k) => scene.triangles[3 * first + k]).map((i) => [...scene.positions.slice(3 * i, 3 * i + 3)]);
const middle = [0, 1, 2].map((d) => corners.reduce((sum, own) => sum + own[d] / 3, 0));
const normal = [...scene.normals.slice(3 * scene.triangles[3 * first], 3 * scene.triangles[3 * first] + 3)];
const from = middle.map((c, d) => c + 0.001 * normal[d]);
console.log(JSON.stringify({
  test: selfTest(answers.evaluate), x, names: surrogate.variables.map((v) => `${v.name}|${v.unit}`),
  parts: machine.parts.map((own) => own.name), channels: machine.channels.map((own) => own.name), count: scene.count,
  warmest: Math.max(...field.slice(0, scene.count)), leaving: field[field.length - 1], error: machine.field.largest_error,
  met: scene.met(from, normal.map((n) => -n), is_shown, null, field), notes: machine.notes,
}));
"#;

/// Ranges of the sweep of the rig.
const RANGES: [(&str, &str, &str); 4] = [
    ("coolant_flow", "3.0e-5 m3/s", "7.0e-5 m3/s"),
    ("coolant_temperature", "18 degC", "30 degC"),
    ("motor_speed", "250 rpm", "2500 rpm"),
    ("ambient_temperature", "18 degC", "30 degC"),
];

/// The rig swept on a coarse mesh, its surrogate in `out`; comes to the machine file.
fn swept(folder: &Path) -> String {
    let machine = root().join("machines/rig.toml").to_str().unwrap().to_string();
    let ranges: String = RANGES.iter().map(|(name, low, high)| format!("{name} = [\"{low}\", \"{high}\"]\n")).collect();
    let sweep =
        format!("name = \"rig\"\nmachine = \"{machine}\"\n[range]\n{ranges}[design]\nkind = \"latin_hypercube\"\nruns = 60\nseed = 1\n");
    std::fs::write(folder.join("sweep.toml"), sweep).unwrap();
    json(&coldplate_in(folder, &["run", "sweep.toml", "--out", "out", "--cells", "1500", "--json"]));
    machine
}

/// Result of a driver in Node on a page; `None` where there is no Node.
fn driven(folder: &Path, driver: &str, page: &str) -> Option<serde_json::Value> {
    if Command::new("node").arg("--version").output().is_err() {
        println!("skipped: node is not on this machine");
        return None;
    }
    std::fs::write(folder.join("driver.js"), driver).unwrap();
    let ran = Command::new("node").current_dir(folder).args(["driver.js", page]).output().unwrap();
    assert!(ran.status.success(), "{}", message(&ran));
    Some(serde_json::from_slice(&ran.stdout).unwrap())
}

#[test]
fn the_machine_of_a_page_is_the_solver_s() {
    let folder = scratch("scene");
    let machine = swept(&folder);
    let machine = machine.as_str();
    let export = ["export", "out/surrogate.cps", "--to", "html", "--machine", machine, "--cells", "1500", "--json"];
    let told = json(&coldplate_in(&folder, &export));
    assert!(told["written"][0]["bytes"].as_u64().unwrap() < 5_000_000, "{told}");
    let Some(found) = driven(&folder, DRIVER, "out/surrogate.html") else { return };
    assert_eq!((&found["test"], &found["notes"]), (&true.into(), &serde_json::json!([])), "{found}");
    // A ray from just outside a face meets that face.
    assert!((found["met"]["distance"].as_f64().unwrap() - 0.001).abs() < 1e-5 && found["met"]["which"] == 0, "{found}");
    // The hottest surface and the water that leaves, as the solver has them at a condition that was not among those of the page.
    let error = found["error"].as_f64().unwrap();
    assert!(error < 0.3, "{found}");
    let value = |k: usize| format!("{} {}", found["x"][k], found["names"][k].as_str().unwrap().split_once('|').unwrap().1);
    let at = |k: usize| found["names"][k].as_str().unwrap().split_once('|').unwrap().0.to_string();
    let options = |k: usize| [format!("--{}", at(k).replace('_', "-")), value(k)];
    let mut solve: Vec<String> = ["solve", machine, "--cells", "1500", "--json"].map(String::from).to_vec();
    solve.extend((0..found["names"].as_array().unwrap().len()).flat_map(options));
    let solved = json(&coldplate_in(&folder, &solve));
    let shell = solved["sensors"]["motor shell"].as_f64().unwrap();
    let warmest = found["warmest"].as_f64().unwrap();
    assert!(warmest > shell - error && warmest < shell + 0.3, "{shell} {warmest}");
    let leaving = solved["coolant"]["reducer_plate"]["outlet_degC"].as_f64().unwrap();
    assert!((found["leaving"].as_f64().unwrap() - leaving).abs() < 2.0 * error, "{leaving} {found}");
}

/// Steps the surrogate of a page from 20 degC, ten minutes at the middle of its ranges; tells the warmest place of the surface, the value
/// of the first point, and the condition.
const COURSE: &str = r#"
const page = require("fs").readFileSync(process.argv[2], "utf8");
const scripts = [...page.matchAll(/<script[^>]*>([^]*?)<\/script>/g)].map((found) => found[1]);
const [s, m] = scripts.slice(0, 2).map(JSON.parse);
const core = scripts[2].slice(0, scripts[2].indexOf("\n(() => {"));
const make = new Function("s", "m", core + "; const own = coldplate(s); return [own, coldplateInTime(s, own), coldplateField(m, s), coldplateScene(m).count];");
const [answers, motion, { field, selfTest }, count] = make(s, m);
const x = s.variables.map((v) => 0.5 * (v.low + v.high));
const at = motion.here(x);
const state = motion.step(motion.atTemperature(20), 600, at);
const away = at.steady.map((steady, k) => state[k] - steady);
const warmest = (all) => Math.max(...all.slice(0, count));
console.log(JSON.stringify({
  test: selfTest(answers.evaluate), header: s.variables.map((v) => `${v.name} [${v.unit}]`).join(), row: x.join(),
  warmest: warmest(field(x, at.values, away)), steady: warmest(field(x, at.values)), still: warmest(field(x, at.values, away.map(() => 0))),
  bound: m.field.bound, error: m.field.largest_error, moving: m.field.moving.largest_error, conditions: m.field.conditions,
}));
"#;

#[test]
fn a_reduced_model_gives_the_field_and_its_course() {
    let folder = scratch("scene_reduced");
    let machine = swept(&folder);
    let ranges: Vec<String> = RANGES.iter().flat_map(|(name, low, high)| ["--range".into(), format!("{name}={low} .. {high}")]).collect();
    let mut reduce: Vec<String> =
        ["reduce", &machine, "--cells", "1500", "--histories", "2", "--field", "--out", "rig.cpr", "--json"].map(String::from).to_vec();
    reduce.extend(ranges);
    json(&coldplate_in(&folder, &reduce));
    let fit = ["fit", "out/sweep.csv", "--machine", &machine, "--dynamics", "rig.cpr", "--out", "rig.cps", "--json"];
    json(&coldplate_in(&folder, &fit));
    let export = ["export", "rig.cps", "--to", "html", "--machine", &machine, "--field", "rig.cpr", "--json"];
    json(&coldplate_in(&folder, &export));
    let Some(found) = driven(&folder, COURSE, "rig.html") else { return };
    assert_eq!((&found["test"], &found["conditions"], &found["still"]), (&true.into(), &200.into(), &found["steady"]), "{found}");
    let number = |key: &str| found[key].as_f64().unwrap();
    assert!(number("bound") < 0.001 && number("error") < 0.3, "{found}");
    // The hottest surface after ten minutes, as the reduced model runs it, is the motor's.
    let [header, row] = ["header", "row"].map(|key| found[key].as_str().unwrap());
    std::fs::write(folder.join("schedule.csv"), format!("time [s],{header}\n0,{row}\n600,{row}\n")).unwrap();
    let run = ["simulate", "rig.cpr", "schedule.csv", "--from", "20 degC", "--every", "600 s", "--out", "run.csv", "--json"];
    json(&coldplate_in(&folder, &run));
    let table = std::fs::read_to_string(folder.join("run.csv")).unwrap();
    let mut lines = table.lines().filter(|line| !line.starts_with('#'));
    let column = lines.next().unwrap().split(',').position(|head| head == "motor shell [degC]").unwrap();
    let shell: f64 = lines.next_back().unwrap().split(',').nth(column).unwrap().parse().unwrap();
    assert!(number("warmest") > shell - number("moving") && number("warmest") < shell + 0.3 + number("moving"), "{shell} {found}");
    assert!((number("warmest") - number("steady")).abs() > 1.0, "it is on its way: {found}");
    // Options that do not go together are refused, with a remedy.
    let refused = |args: &[&str], word: &str| {
        let output = coldplate_in(&folder, &[&["export", "rig.cps", "--to", "html"][..], args].concat());
        assert_eq!(output.status.code(), Some(2), "{}", message(&output));
        assert!(message(&output).contains(word), "{}", message(&output));
    };
    refused(&["--field", "rig.cpr"], "--machine MACHINE");
    refused(&["--machine", &machine, "--field", "rig.cpr", "--cells", "100"], "on the mesh that it was made on");
    refused(&["--machine", &machine, "--field", "rig.cpr", "--set", "contact.motor.conductance=560 W/(m2 K)"], "another machine file");
}

#[test]
fn a_page_with_a_machine_takes_no_condition_and_other_targets_take_no_machine() {
    let folder = scratch("scene_refused");
    let surrogate = super::fixture("uncertain.cps");
    let machine = root().join("machines/rig.toml");
    let (surrogate, machine) = (surrogate.to_str().unwrap(), machine.to_str().unwrap());
    let refused = |args: &[&str], word: &str| {
        let output = coldplate_in(&folder, &[&["export", surrogate][..], args].concat());
        assert_eq!(output.status.code(), Some(2), "{}", message(&output));
        assert!(message(&output).contains(word), "{}", message(&output));
    };
    refused(&["--to", "html", "--machine", machine, "--motor-speed", "100 rpm"], "--motor-speed");
    refused(&["--to", "c99", "--machine", machine], "--machine");
    refused(&["--to", "html", "--cells", "100"], "--cells");
}
