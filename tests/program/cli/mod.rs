//! The program as its users meet it: every shipped file through the binary, statuses, JSON, kill -9.

mod export;
mod glb;
mod help;
mod limits;
mod mesh;
mod pieces;
mod progress;
mod reading;
mod start;

mod info;
mod refused;
mod report;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Duration;

use serde_json::Value;

use crate::common::{coldplate, message, root};

const CONDITION: [&str; 8] =
    ["--coolant-flow", "6 L/min", "--coolant-temperature", "20 degC", "--motor-speed", "1000 rpm", "--ambient-temperature", "22 degC"];

fn status(output: &Output) -> i32 {
    output.status.code().expect("the program ended by itself")
}

fn json(output: &Output) -> Value {
    let text = String::from_utf8_lossy(&output.stdout);
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}\n{text}\n{}", String::from_utf8_lossy(&output.stderr)))
}

fn files(folder: &str) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = std::fs::read_dir(root().join(folder)).unwrap().map(|e| e.unwrap().path()).collect();
    found.retain(|p| p.extension().is_some_and(|e| e == "toml"));
    found.sort();
    assert!(found.len() >= 3, "{folder} should not be empty");
    found
}

fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    folder
}

#[test]
fn every_machine_is_checked_and_solved() {
    for machine in files("machines") {
        let machine = machine.to_str().unwrap();
        let checked = coldplate(&["check", machine, "--cells", "2000", "--json"]);
        assert_eq!(status(&checked), 0, "{machine}: {}", message(&checked));
        let checked = json(&checked);
        assert!(checked["unknowns"].as_u64().unwrap() > 0 && !checked["sensors"].as_array().unwrap().is_empty(), "{machine}");

        let solved = coldplate(&[&["solve", machine, "--cells", "2000", "--json"], &CONDITION[..]].concat());
        assert_eq!(status(&solved), 0, "{machine}: {}", message(&solved));
        let solved = json(&solved);
        for key in ["sensors", "coolant", "contacts", "heat_balance", "unknowns", "newton_iterations", "krylov_iterations", "seconds"] {
            assert!(!solved[key].is_null(), "{machine}: no {key}");
        }
        assert!(solved["heat_balance"]["relative"].as_f64().unwrap() < 1e-8, "{machine}");
        for (name, reading) in solved["sensors"].as_object().unwrap() {
            let is_length = !solved["mesh"]["errors_um"][name].is_null();
            let usual = if is_length { -1000.0..1000.0 } else { 15.0..120.0 };
            assert!(usual.contains(&reading.as_f64().unwrap()), "{machine}: {name} reads {reading}");
        }
    }
}

/// Equation 6 of the study: the flow that takes up a heat with a given rise. 4.176e6 J/(m3 K) is water of 20.5 degC (IAPWS).
#[test]
fn flow_for_a_rise() {
    let found = coldplate(&[&["check", "machines/rig.toml", "--rise", "1 K", "--json"], &CONDITION[..]].concat());
    assert_eq!(status(&found), 0, "{}", message(&found));
    let found = &json(&found)["flow_for_rise"];
    let (heat, flow) = (found["heat_W"].as_f64().unwrap(), found["flow_m3_s"].as_f64().unwrap());
    assert!(heat > 10.0, "{heat} W");
    let water = heat / (flow * 1.0);
    assert!((water / 4.176e6 - 1.0).abs() < 2e-3, "{water} J/(m3 K)");
    for wrong in ["0 K", "-1 K", "1 L/min", "nan K"] {
        let refused = coldplate(&[&["check", "machines/rig.toml", "--rise", wrong], &CONDITION[..]].concat());
        assert!(status(&refused) == 2 && message(&refused).contains("--rise"), "{wrong}: {}", message(&refused));
    }
}

/// One sweep after the other through the whole job, coarse; the results of the main one are then used
/// by every command that takes them.
#[test]
fn every_sweep_runs_to_a_report_and_its_surrogate_answers() {
    for sweep in files("sweeps") {
        let name = sweep.file_stem().unwrap().to_str().unwrap().to_string();
        let folder = scratch(&format!("run-{name}"));
        let folder_text = folder.to_str().unwrap();
        let is_main = name == "five_axis";
        let mut words = vec!["run", sweep.to_str().unwrap(), "--cells", "1500", "--out", folder_text, "--json", "--quiet"];
        let printed = is_main && report::can_print();
        words.extend(printed.then_some("--pdf"));
        let ran = coldplate(&words);
        assert_eq!(status(&ran), 0, "{name}: {}", message(&ran));
        let ran = json(&ran);
        assert_eq!(ran["failed"], 0, "{name}");
        for file in ran["files"].as_array().unwrap() {
            let size = std::fs::metadata(root().join(file.as_str().unwrap())).unwrap().len();
            assert!(size > 200, "{file} is empty");
        }
        let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
        assert!(page.contains("<svg") && !page.contains("src=\"http"), "{name}: the report is not self-contained");
        if printed {
            report::is_printed_well(&folder);
        }
        if is_main {
            report::leads_with_the_answer(&folder, &ran);
            main_surrogate_answers(&folder);
        }
    }
}

fn main_surrogate_answers(folder: &Path) {
    let surrogate = folder.join("surrogate.cps");
    let surrogate = surrogate.to_str().unwrap();
    let easy =
        ["--coolant-flow", "12 L/min", "--coolant-temperature", "20 degC", "--motor-speed", "500 rpm", "--ambient-temperature", "20 degC"];
    let asked = coldplate(&[&["query", surrogate, "--json"], &easy[..]].concat());
    assert_eq!(status(&asked), 0, "{}", message(&asked));
    let answer = json(&asked);
    assert_eq!(answer["verdict"], "acceptable");
    assert_eq!(answer["in_domain"], true);
    // The surrogate against the full solver, at a condition no design holds.
    let solved = coldplate(&[&["solve", "machines/five_axis.toml", "--cells", "1500", "--json"], &easy[..]].concat());
    for (point, full) in json(&solved)["sensors"].as_object().unwrap() {
        let predicted = answer["temperatures"][point]["degC"].as_f64().unwrap();
        assert!((predicted - full.as_f64().unwrap()).abs() < 0.02, "{point}: {predicted} against {full}");
    }
    let hard =
        ["--coolant-flow", "3 L/min", "--coolant-temperature", "24 degC", "--motor-speed", "2500 rpm", "--ambient-temperature", "24 degC"];
    assert_eq!(status(&coldplate(&[&["query", surrogate], &hard[..]].concat())), 1);
    let outside =
        ["--coolant-flow", "60 L/min", "--coolant-temperature", "20 degC", "--motor-speed", "500 rpm", "--ambient-temperature", "20 degC"];
    let outside = coldplate(&[&["query", surrogate], &outside[..]].concat());
    assert_eq!(status(&outside), 3);
    assert!(String::from_utf8_lossy(&outside.stdout).contains("coolant_flow"), "it must say which variable is outside");
    let free =
        ["--coolant-temperature", "20 degC", "--motor-speed", "1200 rpm", "--ambient-temperature", "22 degC", "--free", "coolant_flow"];
    assert_eq!(status(&coldplate(&[&["query", surrogate], &free[..]].concat())), 0);

    let refit = folder.join("refit.cps");
    let table = folder.join("validation.csv");
    let fitted =
        coldplate(&["fit", table.to_str().unwrap(), "--out", refit.to_str().unwrap(), "--machine", "machines/five_axis.toml", "--json"]);
    assert_eq!(status(&fitted), 0, "{}", message(&fitted));
    assert!(json(&fitted)["bytes"].as_u64().unwrap() < 100_000);
    let charts = folder.join("again");
    let drawn =
        coldplate(&["chart", refit.to_str().unwrap(), "--out", charts.to_str().unwrap(), "--map", "motor_speed,coolant_flow", "--json"]);
    assert_eq!(status(&drawn), 0, "{}", message(&drawn));
    assert_eq!(json(&drawn)["files"].as_array().unwrap().len(), 2);
}

#[test]
fn bad_input_ends_with_two_and_says_where() {
    let cases: [(&[&str], &[&str]); 7] = [
        (&["solve", "machines/none.toml"], &["machines/none.toml"]),
        (&["solve", "machines/slab.toml", "--coolant-flow", "6"], &["coolant_flow", "L/min"]),
        (&["solve", "machines/slab.toml", "--at", "nonsense=3"], &["nonsense"]),
        (&["check", "machines/slab.toml", "--set", "part.blok.material=copper"], &["blok", "did you mean"]),
        (&["run", "sweeps/none.toml"], &["sweeps/none.toml"]),
        (&["query", "README.md"], &["README.md"]),
        (&["fit", "machines/slab.toml"], &["machines/slab.toml"]),
    ];
    for (args, needles) in cases {
        let output = coldplate(args);
        assert_eq!(status(&output), 2, "{args:?}: {}", message(&output));
        assert!(output.stdout.is_empty(), "{args:?} printed a result");
        for needle in needles {
            assert!(message(&output).contains(needle), "{args:?}: '{needle}' is not in: {}", message(&output));
        }
    }
    assert_eq!(status(&coldplate(&["solve", "--nonsense"])), 2);
}

#[test]
fn an_impossible_machine_ends_with_four() {
    let folder = scratch("impossible");
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("island.toml");
    // Heat goes in and no way leads out: there is no steady state.
    let text = "name = \"island\"\n[part.block]\nmaterial = \"aluminium 6061\"\nbox = [\"10 cm\", \"10 cm\", \"10 cm\"]\n\
                at = [\"0 m\", \"0 m\", \"0 m\"]\n[source.heater]\nin = [\"block\"]\npower = \"10 W\"\n[sensor.block]\npart = \"block\"\n";
    std::fs::write(&file, text).unwrap();
    let output = coldplate(&[&["solve", file.to_str().unwrap()], &CONDITION[..]].concat());
    assert_eq!(status(&output), 4, "{}", message(&output));
    assert!(output.stdout.is_empty());
    let checked = coldplate(&["check", file.to_str().unwrap()]);
    assert!(String::from_utf8_lossy(&checked.stdout).contains("no path for heat"), "{}", message(&checked));
}

#[test]
fn a_killed_sweep_resumes_to_the_same_bytes() {
    let (whole, killed) = (scratch("whole"), scratch("killed"));
    let sweep = |folder: &Path, threads: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_coldplate"));
        let args = ["sweep", "sweeps/rig.toml", "--cells", "4000", "--quiet", "--threads", threads, "--out"];
        command.args(args).arg(folder).current_dir(root());
        command
    };
    assert!(sweep(&whole, "2").output().unwrap().status.success());
    let mut kills = 0;
    for _ in 0..40 {
        let mut child = sweep(&killed, "1").stdout(std::process::Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(400));
        if child.try_wait().unwrap().is_some_and(|s| s.success()) {
            break;
        }
        child.kill().unwrap();
        child.wait().unwrap();
        kills += 1;
    }
    assert!(kills >= 1, "the sweep was too quick to be killed");
    assert!(sweep(&killed, "1").output().unwrap().status.success());
    for name in ["sweep.csv", "validation.csv"] {
        let (a, b) = (std::fs::read(whole.join(name)).unwrap(), std::fs::read(killed.join(name)).unwrap());
        assert!(a == b, "{name} differs after {kills} kills, or between one and two threads");
    }
}

/// Status 0 says that all is well: not where nobody could read the result.
#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_output_is_an_error() {
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    let arguments = ["check", "machines/rig.toml"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_coldplate"));
    let output = command.args(arguments).current_dir(root()).stdout(full).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("cannot be written to standard output"));
}
