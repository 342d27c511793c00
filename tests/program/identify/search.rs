//! The search from far off: numbers that are place holders, a truth of zero, many numbers together, a misfit that none of them mends.
//! Readings come from the formulas of the networks, not from the program.

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};

use coldplate_base::random::Random;
use serde_json::Value;

use super::scratch;
use crate::common::{coldplate, json, message, root, write};

const M: &str = "contact.m.total_conductance";
const G: &str = "contact.g.total_conductance";
const C: &str = "contact.c.total_conductance";
/// Heats of motor and gear, W, which are columns of the table.
const HEATS: [[f64; 2]; 6] = [[50.0, 5.0], [80.0, 0.0], [20.0, 30.0], [0.0, 40.0], [60.0, 20.0], [10.0, 10.0]];

/// A motor and a gear, each joined to the room and to the other.
fn pair(to_room: [f64; 2], coupling: f64) -> String {
    let [m, g] = to_room;
    format!(
        "name = \"a pair\"\n[variables.motor]\nunit = \"W\"\ndefault = \"50 W\"\n[variables.gear]\nunit = \"W\"\ndefault = \"5 W\"\n\
         [node.room]\ntemperature = \"ambient_temperature\"\n[node.m]\ncapacity = \"500 J/K\"\n[node.g]\ncapacity = \"700 J/K\"\n\
         [contact.m]\nbetween = [\"m\", \"room\"]\ntotal_conductance = \"{m} W/K\"\n\
         [contact.g]\nbetween = [\"g\", \"room\"]\ntotal_conductance = \"{g} W/K\"\n\
         [contact.c]\nbetween = [\"m\", \"g\"]\ntotal_conductance = \"{coupling} W/K\"\n\
         [source.m]\nin = \"m\"\npower = \"motor\"\n[source.g]\nin = \"g\"\npower = \"gear\"\n[sensor.m]\nnode = \"m\"\n[sensor.g]\nnode = \"g\"\n"
    )
}

/// Steady readings with 2 and 1 W/K to the room, by Cramer's rule; `further` K are added to the motor's.
fn readings(coupling: f64, share: f64, further: impl Fn(usize) -> f64) -> String {
    let mut noise = Random::new(5);
    let row = |(i, [motor, gear]): (usize, &[f64; 2])| {
        let (a, b, d) = (2.0 + coupling, -coupling, 1.0 + coupling);
        let (m, g) = (share * motor, *gear);
        let at = [(d * m - b * g) / (a * d - b * b), (a * g - b * m) / (a * d - b * b)];
        let [m, g] = at.map(|rise| 22.0 + rise + 0.05 * noise.normal());
        format!("t{i},22,{motor},{gear},{:.3},{g:.3}\n", m + further(i))
    };
    let rows: String = HEATS.iter().enumerate().map(row).collect();
    format!("test,ambient_temperature [degC],motor [W],gear [W],m [degC],g [degC]\n{rows}")
}

const STATED: &str =
    "kind = \"standard deviations\"\nnoise = \"0.05 K\"\nbias = \"0.02 K\"\n[condition]\nambient_temperature = \"0.05 K\"\n";

fn found(name: &str, machine: &str, data: &str, stated: &str, free: &[&str]) -> (Value, Vec<String>) {
    let folder = scratch(name);
    let (machine, data) = (write(&folder, "pair.toml", machine), write(&folder, "data.csv", data));
    write(&folder, "data.toml", stated);
    let free = free.iter().flat_map(|key| ["--free", key]);
    let args: Vec<String> = ["identify", &machine, &data, "--brief"].into_iter().chain(free).map(String::from).collect();
    let all: Vec<&str> = args.iter().map(String::as_str).chain(["--json"]).collect();
    (json(&coldplate(&all)), args)
}

fn number(of: &Value, key: &str) -> f64 {
    of[key].as_f64().unwrap_or_else(|| panic!("{key} of {of}"))
}

/// A coupling that was never more than a place holder, everything a thousand times too large, and a thousand times too small.
#[test]
fn numbers_are_found_from_far_off() {
    for (name, to_room, coupling) in
        [("tiny", [2.0, 1.0], 1e-6), ("large", [2e3, 1e3], 500.0), ("small", [2e-3, 1e-3], 1e-6), ("near", [2.1, 0.9], 0.4)]
    {
        let (found, _) = found(&format!("search-{name}"), &pair(to_room, coupling), &readings(0.5, 1.0, |_| 0.0), STATED, &[M, G, C]);
        for (key, planted) in [(M, 2.0), (G, 1.0), (C, 0.5)] {
            let p = &found["parameters"][key];
            assert!(number(p, "low") * 0.99 < planted && planted < number(p, "high") * 1.01 && p["status"] == "found", "{name} {key}: {p}");
            assert!((number(p, "value") / planted - 1.0).abs() < 0.02, "{name} {key}: {p}");
        }
        assert!(number(&found["misfit"], "p") > 1e-3 && found["search"]["ended"] == "at_rest", "{name}: {}", found["misfit"]);
        assert!(found["search"]["wider"].is_null() && number(&found, "evaluations") < 120.0, "{name}: {}", found["evaluations"]);
    }
}

/// Heats from a thousandth and from a thousand times the truth: one step of a linear model.
#[test]
fn heats_are_found_by_a_linear_step() {
    for (name, power) in [("low", "0.05 W"), ("high", "50000 W")] {
        let machine = pair([2.0, 1.0], 0.5).replace("power = \"motor\"", &format!("power = \"{power}\""));
        let rows: String = readings(0.5, 1.0, |_| 0.0).lines().enumerate().filter(|(i, _)| *i < 2).map(|(_, l)| format!("{l}\n")).collect();
        let (found, _) = found(&format!("search-heat-{name}"), &machine, &rows, STATED, &["source.m.power"]);
        let p = &found["parameters"]["source.m.power"];
        assert!((number(p, "value") / 50.0 - 1.0).abs() < 0.01, "{name}: {p}");
        assert!(number(&found, "evaluations") < 30.0, "{name}: {}", found["evaluations"]);
    }
}

/// A coupling that there is not: the data say that it is small, on a linear scale, from wherever the search began.
#[test]
fn a_number_whose_truth_is_zero_has_an_upper_end() {
    for (name, coupling) in [("half", 0.5), ("tiny", 1e-6)] {
        let (found, args) =
            found(&format!("search-zero-{name}"), &pair([2.0, 1.0], coupling), &readings(0.0, 1.0, |_| 0.0), STATED, &[M, G, C]);
        let p = &found["parameters"][C];
        assert!(p["status"] == "like_zero" && p["kept"] == false, "{p}");
        assert!(number(p, "low") == 0.0 && number(p, "value") < 0.01 && (5e-4..0.01).contains(&number(p, "high")), "{p}");
        let shown = coldplate(&args.iter().map(String::as_str).collect::<Vec<_>>());
        assert!(String::from_utf8_lossy(&shown.stdout).contains("not told from zero"), "{}", String::from_utf8_lossy(&shown.stdout));
    }
}

/// A steady table does not show a capacity; that is no failure of the search.
#[test]
fn a_number_that_the_data_do_not_show_is_told_from_a_search_that_failed() {
    let free = [M, G, C, "node.m.capacity"];
    let (found, _) = found("search-open", &pair([2.0, 1.0], 1e-6), &readings(0.5, 1.0, |_| 0.0), STATED, &free);
    let p = &found["parameters"]["node.m.capacity"];
    assert!(p["status"] == "not_determined" && p["kept"] == true && p["value"] == p["before"], "{p}");
    assert!(found["search"]["ended"] == "at_rest" && found["parameters"][C]["status"] == "found", "{found}");
}

/// Readings of the motor that alternate by 5 K: no number mends that, and the search looks further before it says so.
#[test]
fn a_misfit_that_nothing_mends_starts_a_wider_search() {
    let jumps = |i: usize| if i.is_multiple_of(2) { 5.0 } else { -5.0 };
    let (found, args) = found("search-wider", &pair([2.0, 1.0], 0.4), &readings(0.5, 1.0, jumps), STATED, &[M, G, C]);
    assert!(number(&found["misfit"], "p") < 1e-6, "{}", found["misfit"]);
    let wider = &found["search"]["wider"];
    assert!(number(wider, "points") >= 1.0 && number(wider, "after") <= number(wider, "before"), "{wider}");
    assert_eq!(found["search"]["ended"], "at_rest", "{}", found["search"]);
    let shown = coldplate(&args.iter().map(String::as_str).collect::<Vec<_>>());
    let shown = String::from_utf8_lossy(&shown.stdout).into_owned();
    assert!(shown.contains("a wider search looked at"), "{shown}");
}

/// The motor gives 7 % more than its column says. Whether the fit may say so is stated of the column.
#[test]
fn a_heat_that_is_a_column_is_as_certain_as_the_column() {
    let data = readings(0.5, 1.07, |_| 0.0);
    let run = |name: &str, entry: &str, free: &[&str]| {
        let stated = format!("{STATED}{entry}");
        let (found, args) = found(&format!("search-column-{name}"), &pair([2.0, 1.0], 0.5), &data, &stated, free);
        (found["parameters"]["source.m.power"].clone(), found["misfit"].clone(), args)
    };
    // Nothing is stated: the factor is free.
    let (open, ..) = run("open", "", &[M, "source.m.power"]);
    // Three of its standard deviations, 0.012.
    assert!((number(&open, "value") - 1.07).abs() < 0.036, "{open}");
    // As sure as the factor is off: the column's error is the factor, and no further error of every row beside it.
    let (wide, _, args) = run("wide", "motor = \"5 %\"\n", &[M, "source.m.power"]);
    let width = |p: &Value| number(p, "high") - number(p, "low");
    assert!((number(&wide, "value") - 1.07).abs() < 0.036 && width(&wide) < 1.2 * width(&open), "{wide} {open}");
    let shown = coldplate(&args.iter().map(String::as_str).collect::<Vec<_>>());
    let shown = String::from_utf8_lossy(&shown.stdout).into_owned();
    assert!(shown.contains("source.m.power is measured") && shown.contains("5 %"), "{shown}");
    // Far surer: the factor stays within three deviations, and the misfit says that something else is wrong.
    let (narrow, misfit, _) = run("narrow", "motor = \"0.2 %\"\n", &["source.m.power"]);
    assert!((number(&narrow, "value") - 1.0).abs() <= 0.006 + 1e-9 && number(&narrow, "high") <= 1.006 + 1e-9, "{narrow}");
    assert!(number(&misfit, "p") < 1e-3, "{misfit}");
}

const NODES: [(&str, f64); 5] = [("winding", 400.0), ("rotor", 900.0), ("housing", 2500.0), ("flange", 1200.0), ("gear", 3000.0)];
/// Conductances between nodes, W/K; number 5 is the room.
const PATHS: [(usize, usize, f64); 7] = [(0, 2, 6.0), (0, 1, 0.8), (2, 3, 9.0), (3, 4, 4.0), (2, 5, 1.4), (4, 5, 2.2), (3, 5, 0.5)];

fn path_name(k: usize) -> String {
    let name = |n: usize| NODES.get(n).map_or("room", |(name, _)| name);
    format!("{}_{}", name(PATHS[k].0), name(PATHS[k].1))
}

/// A motor of five nodes, all of whose capacities and conductances are alike.
fn motor(capacity: f64, conductance: f64) -> String {
    let mut text =
        "name = \"motor\"\n[variables.motor]\nunit = \"W\"\ndefault = \"100 W\"\n[variables.load]\nunit = \"W\"\ndefault = \"10 W\"\n\
                    [node.room]\ntemperature = \"ambient_temperature\"\n"
            .to_string();
    NODES.iter().for_each(|(name, _)| text += &format!("[node.{name}]\ncapacity = \"{capacity} J/K\"\n"));
    for k in 0..PATHS.len() {
        let name = path_name(k);
        let (a, b) = name.split_once('_').unwrap();
        text += &format!("[contact.{name}]\nbetween = [\"{a}\", \"{b}\"]\ntotal_conductance = \"{conductance} W/K\"\n");
    }
    for (name, power) in [("winding", "0.6 * motor_W"), ("rotor", "0.25 * motor_W"), ("gear", "load")] {
        text += &format!("[source.{name}]\nin = \"{name}\"\npower = \"{power}\"\n");
    }
    [0, 2, 3, 4].map(|n| NODES[n].0).into_iter().for_each(|name| text += &format!("[sensor.{name}]\nnode = \"{name}\"\n"));
    text
}

/// Two logs of four hours, a row every four minutes, by Runge and Kutta's method in steps of two seconds.
fn motor_log() -> String {
    let mut noise = Random::new(3);
    let mut text =
        "test,time [s],ambient_temperature [degC],motor [W],load [W],winding [degC],housing [degC],flange [degC],gear [degC]\n".to_string();
    for test in ["a", "b"] {
        let heats = |t: usize| match (test, t) {
            ("a", _) => [if t < 7200 { 150.0 } else { 20.0 }, if t < 3600 { 30.0 } else { 80.0 }],
            _ => [if t < 4800 { 60.0 } else { 200.0 }, 10.0],
        };
        let mut now = [0.0; 5];
        for t in (0..=14400).step_by(2) {
            let [motor, gear] = heats(t);
            if t % 240 == 0 {
                let read = [0, 2, 3, 4].map(|n| format!("{:.3}", 22.0 + now[n] + 0.05 * noise.normal()));
                text += &format!("{test},{t},22,{motor},{gear},{}\n", read.join(","));
            }
            let rate = |x: [f64; 5]| {
                let mut heat = [0.6 * motor, 0.25 * motor, 0.0, 0.0, gear];
                for (a, b, conductance) in PATHS {
                    let flow = conductance * (x[a] - x.get(b).copied().unwrap_or(0.0));
                    heat[a] -= flow;
                    if let Some(into) = heat.get_mut(b) {
                        *into += flow;
                    }
                }
                [0, 1, 2, 3, 4].map(|n| heat[n] / NODES[n].1)
            };
            let after = |k: [f64; 5], h: f64| [0, 1, 2, 3, 4].map(|n| now[n] + h * k[n]);
            let a = rate(now);
            let b = rate(after(a, 1.0));
            let c = rate(after(b, 1.0));
            let d = rate(after(c, 2.0));
            now = [0, 1, 2, 3, 4].map(|n| now[n] + (a[n] + 2.0 * b[n] + 2.0 * c[n] + d[n]) / 3.0);
        }
    }
    text
}

/// Arguments of `identify` with the twelve numbers of the motor.
fn twelve(name: &str, machine: &str) -> Vec<String> {
    let folder = scratch(name);
    let (machine, data) = (write(&folder, "motor.toml", machine), write(&folder, "data.csv", motor_log()));
    write(&folder, "data.toml", STATED.replace("[condition]", "held = [\"motor\", \"load\"]\n[condition]"));
    let keys = (0..PATHS.len()).map(|k| format!("contact.{}.total_conductance", path_name(k)));
    let keys = keys.chain(NODES.map(|(name, _)| format!("node.{name}.capacity")));
    let free = keys.flat_map(|key| ["--free".to_string(), key]);
    ["identify", &machine, &data, "--from", "22 degC", "--brief"].into_iter().map(String::from).chain(free).collect()
}

/// Twelve numbers whose effects go together, all conductances as one place holder, a twentieth of W/K, and all capacities as another.
#[test]
fn twelve_numbers_are_found_together() {
    for (name, capacity, conductance) in [("alike", 1000.0, 1.0), ("far", 100.0, 0.05)] {
        let mut args = twelve(&format!("search-twelve-{name}"), &motor(capacity, conductance));
        args.push("--json".into());
        let found = json(&coldplate(&args.iter().map(String::as_str).collect::<Vec<_>>()));
        println!("{name}: {} {}", found["misfit"], found["evaluations"]);
        assert!(number(&found["misfit"], "after") < 1.3 * number(&found["misfit"], "dof"), "{name}: {}", found["misfit"]);
        for (k, (.., planted)) in PATHS.iter().enumerate() {
            let p = &found["parameters"][format!("contact.{}.total_conductance", path_name(k))];
            assert!((number(p, "value") / planted - 1.0).abs() < 0.1, "{name} {}: {p}", path_name(k));
        }
        for (node, planted) in NODES {
            let p = &found["parameters"][format!("node.{node}.capacity")];
            assert!((number(p, "value") / planted - 1.0).abs() < 0.1, "{name} {node}: {p}");
        }
        assert!(number(&found, "evaluations") < 400.0, "{name}: {}", found["evaluations"]);
    }
}

/// A search of ten thousand starts says how far it is; the first signal ends it with the values that it has, and nothing is written.
#[test]
fn a_signal_ends_the_search_with_a_word_on_the_values_so_far() {
    let mut args = twelve("search-stopped", &motor(1000.0, 1.0));
    args.extend(["--starts", "10000", "--json", "--out"].map(String::from));
    let out = std::path::Path::new(&args[1]).with_file_name("found.toml");
    args.push(out.display().to_string());
    let mut child = Command::new(env!("CARGO_BIN_EXE_coldplate"))
        .args(&args)
        .current_dir(root())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = String::new();
    let mut errors = BufReader::new(child.stderr.take().unwrap());
    while !said.contains("start 2 of 10000") {
        assert!(errors.read_line(&mut said).unwrap() > 0, "{said}");
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    errors.read_to_string(&mut said).unwrap();
    let mut printed = String::new();
    child.stdout.take().unwrap().read_to_string(&mut printed).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(2), "{said}");
    for word in ["stopped by a signal", "nothing was written", "contact.winding_housing.total_conductance = ", "misfit of"] {
        assert!(said.contains(word), "no '{word}' in {said}");
    }
    assert!(printed.is_empty() && !out.exists(), "{printed}");
}

/// Progress goes to standard error, in lines where these are asked for; a quiet run says nothing there.
#[test]
fn progress_goes_to_standard_error() {
    let (_, args) = found("search-progress", &pair([2.0, 1.0], 1e-6), &readings(0.5, 1.0, |_| 0.0), STATED, &[M, G, C]);
    let run = |more: &[&str]| coldplate(&args.iter().map(String::as_str).chain(more.iter().copied()).collect::<Vec<_>>());
    let (told, quiet) = (run(&["--progress", "--json"]), run(&["--quiet", "--json"]));
    for word in ["start 1 of 3", "prediction 3: misfit", "faulty readings"] {
        assert!(message(&told).contains(word), "no '{word}' in {}", message(&told));
    }
    assert!(quiet.stderr.is_empty(), "{}", message(&quiet));
    let [mut a, mut b] = [json(&told), json(&quiet)];
    (a["seconds"], b["seconds"]) = (Value::Null, Value::Null);
    assert_eq!(a, b);
}
