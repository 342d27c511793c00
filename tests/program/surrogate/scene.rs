//! `export --to html --machine`: the page with the machine in three dimensions, its field beside the solver's.

use std::process::Command;

use crate::common::{coldplate_in, json, message, root, scratch};

/// Takes the data and the arithmetic out of a page, and tells the field of each vertex that is nearest to a sensor.
const DRIVER: &str = r#"
const page = require("fs").readFileSync(process.argv[2], "utf8");
const scripts = [...page.matchAll(/<script[^>]*>([^]*?)<\/script>/g)].map((found) => found[1]);
const [surrogate, machine] = scripts.slice(0, 2).map(JSON.parse);
const core = scripts[2].slice(0, scripts[2].indexOf("\n(() => {"));
const [answers, scene] = new Function("s", "m", core + "; return [coldplate(s), coldplateScene(m, s)];")(surrogate, machine);
const x = surrogate.variables.map((v) => v.low + 0.3 * (v.high - v.low));
const field = scene.field(x, answers.evaluate(x));
const is_shown = machine.parts.map(() => true);
const first = machine.parts[0].first;
const corners = [0, 1, 2].map((k) => scene.triangles[3 * first + k]).map((i) => [...scene.positions.slice(3 * i, 3 * i + 3)]);
const middle = [0, 1, 2].map((d) => corners.reduce((sum, own) => sum + own[d] / 3, 0));
const normal = [...scene.normals.slice(3 * scene.triangles[3 * first], 3 * scene.triangles[3 * first] + 3)];
const from = middle.map((c, d) => c + 0.001 * normal[d]);
console.log(JSON.stringify({
  test: scene.selfTest(answers.evaluate), x, names: surrogate.variables.map((v) => `${v.name}|${v.unit}`),
  parts: machine.parts.map((own) => own.name), channels: machine.channels.map((own) => own.name), count: scene.count,
  warmest: Math.max(...field.slice(0, scene.count)), leaving: field[field.length - 1], error: machine.field.largest_error,
  met: scene.met(from, normal.map((n) => -n), is_shown, null, field), notes: machine.notes,
}));
"#;

#[test]
fn the_machine_of_a_page_is_the_solver_s() {
    let folder = scratch("scene");
    let machine = root().join("machines/rig.toml");
    let machine = machine.to_str().unwrap();
    let sweep = format!(
        "name = \"rig\"\nmachine = \"{machine}\"\n[range]\ncoolant_flow = [\"3.0e-5 m3/s\", \"7.0e-5 m3/s\"]\n\
         coolant_temperature = [\"18 degC\", \"30 degC\"]\nmotor_speed = [\"250 rpm\", \"2500 rpm\"]\n\
         ambient_temperature = [\"18 degC\", \"30 degC\"]\n[design]\nkind = \"latin_hypercube\"\nruns = 60\nseed = 1\n"
    );
    std::fs::write(folder.join("sweep.toml"), sweep).unwrap();
    json(&coldplate_in(&folder, &["run", "sweep.toml", "--out", "out", "--cells", "1500", "--json"]));
    let export = ["export", "out/surrogate.cps", "--to", "html", "--machine", machine, "--cells", "1500", "--json"];
    let told = json(&coldplate_in(&folder, &export));
    assert!(told["written"][0]["bytes"].as_u64().unwrap() < 5_000_000, "{told}");
    if Command::new("node").arg("--version").output().is_err() {
        println!("skipped: node is not on this machine");
        return;
    }
    std::fs::write(folder.join("driver.js"), DRIVER).unwrap();
    let ran = Command::new("node").current_dir(&folder).args(["driver.js", "out/surrogate.html"]).output().unwrap();
    assert!(ran.status.success(), "{}", message(&ran));
    let found: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap();
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
