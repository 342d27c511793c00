//! Reduced models over time where something stores no heat, beside the machine in full; and a unit of a lumped machine.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use super::{coldplate, json, numbers, scratch, write};

/// A motor of two bodies with a terminal and a shield that store nothing, painted black.
const MOTOR: &str = r#"name = "motor"
[variables]
current = { unit = "A", default = "5 A", range = ["0 A", "10 A"] }
ambient_temperature = { default = "25 degC", range = ["15 degC", "40 degC"] }
[node.winding]
capacity = "40 J/K"
[node.stator]
capacity = "300 J/K"
[node.terminal]
[node.shield]
[node.housing]
temperature = "ambient_temperature"
[contact]
slot = { between = ["winding", "stator"], total_conductance = "1.2 W/K" }
terminal = { between = ["winding", "terminal"], total_conductance = "0.3 W/K" }
plug = { between = ["terminal", "stator"], total_conductance = "0.1 W/K" }
housing = { between = ["stator", "housing"], total_conductance = "0.5 W/K" }
[radiation_link]
inner = { between = ["stator", "shield"], area = "0.05 m2", emissivity = [0.9, 0.9], view_factor = 1.0 }
outer = { between = ["shield", "housing"], area = "0.05 m2", emissivity = [0.9, 0.9], view_factor = 1.0 }
[source]
copper = { in = "winding", power = "0.5 * current_A^2" }
plug = { in = "terminal", power = "0.05 * current_A^2" }
[sensor]
winding = { node = "winding" }
stator = { node = "stator" }
terminal = { node = "terminal" }
shield = { node = "shield" }
"#;
const CYCLE: &str = "time [s],current [A],ambient_temperature [degC]\n0,8,25\n900,8,25\n900,2,35\n1800,2,35\n";
const SENSORS: [&str; 4] = ["winding", "stator", "terminal", "shield"];

fn run(file: &str, schedule: &str, more: &[&str]) -> serde_json::Value {
    json(&coldplate(&[&["simulate", file, schedule, "--json"], more].concat()))
}

/// Largest difference of a reading from the full model's, beyond its bound, and the largest bound, K.
fn beyond(found: &serde_json::Value, full: &serde_json::Value, sensors: &[&str]) -> (f64, f64) {
    let mut most = (f64::NEG_INFINITY, 0.0);
    for sensor in sensors {
        let bounds = numbers(&found["bounds_K"][sensor]);
        for ((own, truth), bound) in numbers(&found["series"][sensor]).iter().zip(numbers(&full["series"][sensor])).zip(bounds) {
            most = (f64::max(most.0, (own - truth).abs() - bound), f64::max(most.1, bound));
        }
    }
    most
}

/// The modes of few nodes are the nodes: 24 conditions are enough for the usual accuracy, and what stores no heat follows the rest from
/// the first instant on.
#[test]
fn lumped_machines_with_massless_nodes_are_reduced_over_time() {
    let folder = scratch("massless-reduced");
    let (machine, cycle) = (write(&folder, "motor.toml", MOTOR), write(&folder, "cycle.csv", CYCLE));
    let file = folder.join("motor.cpr").to_str().unwrap().to_string();
    let exact = ["--from", "25 degC", "--every", "60 s", "--tolerance", "0.0005 K"];
    let full = run(&machine, &cycle, &exact);
    // At the beginning the terminal is 0.3 : 0.1 between two bodies of 25 degC, and takes 3.2 W.
    assert!((numbers(&full["series"]["terminal"])[0] - 33.0).abs() < 1e-6, "{}", full["series"]["terminal"]);
    for seed in ["1", "2", "3"] {
        let made = json(&coldplate(&["reduce", &machine, "--histories", "4", "--seed", seed, "--out", &file, "--json", "--vary", "all"]));
        let in_time = &made["in_time"];
        assert!(made["reached"] == true && made["solved"] == 24, "{made}");
        assert!(in_time["largest_error_K"].as_f64().unwrap() < 0.01 && in_time["largest_bound_K"].as_f64().unwrap() < 0.05, "{made}");
        let found = run(&file, &cycle, &exact[..4]);
        let (beyond, bound) = beyond(&found, &full, &SENSORS);
        println!("seed {seed}: {beyond:.4} K beyond the bound, which is {bound:.4} K at most");
        assert!(beyond <= 0.0 && bound < 0.05, "{seed}: {beyond} {bound}");
    }
}

/// Faces of an enclosure exchange radiation and store no heat.
#[test]
fn enclosures_are_reduced_over_time() {
    let folder = scratch("enclosure-reduced");
    let file = folder.join("enclosure.cpr").to_str().unwrap().to_string();
    let schedule = "time [s],motor_speed [rpm],coolant_flow [L/min],coolant_temperature [degC],ambient_temperature [degC]\n\
                    0,500,2,20,20\n3600,500,2,20,20\n3600,2500,2,20,24\n10800,2500,2,20,24\n";
    let schedule = write(&folder, "s.csv", schedule);
    let black = ["machines/enclosure.toml", "--cells", "500", "--set", "surfaces.emissivity=0.9"];
    let made = json(&coldplate(&[&["reduce"], &black[..], &["--histories", "4", "--out", &file, "--json"]].concat()));
    assert!(made["in_time"]["largest_error_K"].as_f64().is_some_and(|error| error < 0.1), "{made}");
    let exact = ["--from", "20 degC", "--every", "300 s", "--tolerance", "0.0005 K"];
    let full = run(black[0], &schedule, &[&exact, &black[1..]].concat());
    let found = run(&file, &schedule, &exact[..4]);
    let sensors: Vec<&str> = found["bounds_K"].as_object().unwrap().keys().map(String::as_str).collect();
    let (beyond, bound) = beyond(&found, &full, &sensors);
    println!("{beyond:.4} K beyond the bound, which is {bound:.4} K at most");
    assert!(beyond <= 0.0 && bound < 0.1, "{beyond} {bound}");
}

/// The points of a unit in its own C source, one row for each of `steps`: seconds and inputs in the unit's order.
fn unit(folder: &Path, steps: &str) -> Option<Vec<Vec<f64>>> {
    let start = |program: &str, arguments: &[&str]| Command::new(program).current_dir(folder).args(arguments).output();
    if start("cc", &["--version"]).is_err() || start("python3", &["--version"]).is_err() {
        println!("left out: cc or python3 is not on this machine");
        return None;
    }
    for (program, arguments) in [
        ("python3", &["-m", "zipfile", "-e", "motor.fmu", "."][..]),
        ("cc", &["-std=c99", "-Isources", "-o", "unit", "unit.c", "sources/motor.c", "-lm"]),
    ] {
        let output = start(program, arguments).expect("the program starts");
        assert!(output.status.success(), "{program}: {}", String::from_utf8_lossy(&output.stderr));
    }
    let mut child = Command::new(folder.join("unit")).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("the unit starts");
    child.stdin.take().expect("a pipe").write_all(steps.as_bytes()).expect("it reads");
    let output = child.wait_with_output().expect("it ends");
    assert!(output.status.success(), "{:?}", output.status);
    let row = |line: &str| line.split_whitespace().map(|v| v.parse().expect("a number")).collect();
    Some(String::from_utf8_lossy(&output.stdout).lines().map(row).collect())
}

/// From the machine file to a unit that runs: sweep, reduced model, fit with dynamics, export, and both against `simulate` of the
/// machine.
#[test]
fn units_of_lumped_machines_follow_the_machine() {
    let folder = scratch("lumped-unit");
    let (machine, cycle) = (write(&folder, "motor.toml", MOTOR), write(&folder, "cycle.csv", CYCLE));
    let sweep = "name = \"motor\"\nmachine = \"motor.toml\"\n[design]\nkind = \"latin_hypercube\"\nruns = 100\nseed = 1\n\
                 [range]\ncurrent = [\"0 A\", \"10 A\"]\nambient_temperature = [\"15 degC\", \"40 degC\"]\n";
    let sweep = write(&folder, "sweep.toml", sweep);
    let at = |name: &str| folder.join(name).to_str().unwrap().to_string();
    let (model, table, surrogate) = (at("motor.cpr"), at("out/sweep.csv"), at("motor.cps"));
    json(&coldplate(&["reduce", &machine, "--histories", "4", "--vary", "all", "--out", &model, "--json"]));
    json(&coldplate(&["sweep", &sweep, "--out", &at("out"), "--json"]));
    json(&coldplate(&["fit", &table, "--machine", &machine, "--dynamics", &model, "--out", &surrogate, "--json"]));
    json(&coldplate(&["export", &surrogate, "--to", "fmu2", "--out", folder.to_str().unwrap(), "--json"]));
    let full = run(&machine, &cycle, &["--from", "25 degC", "--every", "60 s"]);
    let stepped = run(&surrogate, &cycle, &["--from", "25 degC", "--every", "60 s"]);
    // The unit steps by minutes; its inputs are in the order of the names.
    let step = |k: usize| if k < 15 { "60 25 8\n" } else { "60 35 2\n" };
    let steps: String = std::iter::once("25\n").chain((0..30).map(step)).collect();
    std::fs::write(folder.join("unit.c"), include_str!("unit.c")).unwrap();
    let Some(points) = unit(&folder, &steps) else { return };
    let times = numbers(&full["series"]["time_s"]);
    for (i, sensor) in SENSORS[..3].iter().enumerate() {
        let (truth, own) = (numbers(&full["series"][sensor]), numbers(&stepped["series"][sensor]));
        let bound = numbers(&stepped["bounds_K"][sensor])[0];
        for (k, row) in points.iter().enumerate() {
            let place = times.iter().position(|time| *time == 60.0 * (k + 1) as f64).unwrap();
            assert!((row[i] - own[place]).abs() < 1e-6, "{sensor} after {} min: {} {}", k + 1, row[i], own[place]);
            assert!((row[i] - truth[place]).abs() < bound.min(1.5), "{sensor} after {} min: {} {}", k + 1, row[i], truth[place]);
        }
    }
}
