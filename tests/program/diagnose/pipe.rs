//! The measured hot-water pipe from a machine file whose wall stores and loses nothing: first the wall, then the loss.

use std::path::{Path, PathBuf};
use std::process::Command;

use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, whiten};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;
use coldplate_testing::measured::hot_water_pipe;
use serde_json::Value;

/// What the documented wall stores: 6.93e-4 m2 of steel, 39 m, 7800 to 8000 kg/m3, 480 to 500 J/(kg K): 101 to 108 kJ/K.
const DOCUMENTED: f64 = 104e3;
/// 0.04 W/(m K) from 60.3 to 86.3 mm, referred to the pipe: k / (r ln(R/r)), W/(m2 K).
const DOCUMENTED_FILM: f64 = 3.701;

fn diagnosed(machine: &str, data: &Path, out: &Path) -> Value {
    let args = ["diagnose", machine, data.to_str().unwrap(), "--from", "readings", "--out", out.to_str().unwrap(), "--json", "--quiet"];
    let output =
        Command::new(env!("CARGO_BIN_EXE_coldplate")).args(args).current_dir(env!("CARGO_MANIFEST_DIR")).output().expect("it starts");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    println!("{}\n  misfit {}\n  gain {}\n  {} s", report["headline"], report["misfit"], report["gain"], report["seconds"]);
    report
}

/// Root mean square error (K) of a machine file on a table, from a time on.
fn error(machine: &Path, table: &Path, from: f64) -> f64 {
    let study = Study::read(machine, &[], None).unwrap();
    let data = Data::read(table, &study.model.machine).unwrap();
    let predicted = identify::values(&study, &data, Start::Readings).unwrap();
    let places = whiten::places(&data);
    let late = |i: &usize| data.rows[places[*i].0].time.unwrap() >= from;
    let squares: Vec<f64> = (0..predicted.len()).filter(late).map(|i| (predicted[i] - whiten::readings(&data)[i]).powi(2)).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn a_pipe_whose_wall_was_forgotten() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/measured/hot_water_pipe");
    if !folder.is_dir() {
        println!("SKIPPED: the measurements are not at {}", folder.display());
        return;
    }
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("diagnose-pipe");
    let _ = std::fs::remove_dir_all(&out);
    std::fs::create_dir_all(&out).unwrap();
    let table = |name: &str, tests: &[&str]| -> PathBuf {
        let path = out.join(format!("{name}.csv"));
        std::fs::write(&path, hot_water_pipe::table(&folder, tests).unwrap()).unwrap();
        std::fs::write(path.with_extension("toml"), hot_water_pipe::UNCERTAINTY).unwrap();
        path
    };
    let bare = Path::new(env!("CARGO_MANIFEST_DIR")).join("machines/hot_water_pipe_bare.toml");
    let (wall, both) = (out.join("wall.toml"), out.join("both.toml"));

    let report = diagnosed(bare.to_str().unwrap(), &table("fast", &["150801", "151202", "151204_2"]), &wall);
    assert_eq!(report["verdict"], "explained");
    let cause = &report["causes"][0];
    assert_eq!((&cause["kind"], &cause["place"]), (&"heat capacity".into(), &"pipe".into()));
    let stored = cause["parameters"]["heat_capacity"]["value"].as_f64().unwrap() + 0.027_02 * 7850.0 * 25.0;
    println!("the wall stores {stored:.0} J/K, documented {DOCUMENTED}");
    assert!((stored / DOCUMENTED - 1.0).abs() < 0.25, "{stored} J/K");
    let unseen = table("unseen", &["151204_1"]);
    let (before, after) = (error(&bare, &unseen, 0.0), error(&wall, &unseen, 0.0));
    println!("a test that was not used: {before:.3} K before, {after:.3} K after");
    // With nothing fitted the documented wall leaves 0.36 to 0.71 K in the fast tests, and no wall 2.0 to 6.2 K.
    assert!(after < 0.75 && after < 0.3 * before, "{before} K, {after} K");

    // The slow test beside them shows the loss too: one run names both, one on top of the other.
    let data = table("slow", &["150801", "151202", "151204_2", "160104_2:6000"]);
    let report = diagnosed(bare.to_str().unwrap(), &data, &both);
    assert_eq!(report["verdict"], "explained");
    let named = |kind: &str| {
        let causes = report["rungs"].as_array().unwrap().iter().flat_map(|rung| rung["causes"].as_array().unwrap());
        let found: Vec<&Value> = causes.filter(|c| c["kind"] == kind && c["place"] == "pipe").collect();
        assert_eq!(found.len(), 1, "{kind}");
        ["low", "value", "high"].map(|k| found[0]["amplitude"][k].as_f64().unwrap())
    };
    let [_, stored, _] = named("heat capacity");
    let stored = stored + 0.027_02 * 7850.0 * 25.0;
    assert!((stored / DOCUMENTED - 1.0).abs() < 0.25, "{stored} J/K");
    let [low, film, high] = named("loss to the surroundings");
    println!("the loss {film:.2} W/(m2 K) ({low:.2} to {high:.2}), documented {DOCUMENTED_FILM}");
    assert!((low..high).contains(&DOCUMENTED_FILM) && (film / DOCUMENTED_FILM - 1.0).abs() < 0.3, "{film} W/(m2 K)");
    let rest = table("rest", &["160104_2"]);
    let (before, after) = (error(&bare, &rest, 6000.0), error(&both, &rest, 6000.0));
    println!("the part of the slow test that was not used: {before:.3} K before, {after:.3} K after");
    assert!(after < before, "{before} K, {after} K");
    let after = error(&both, &unseen, 0.0);
    println!("the test that was not used: {after:.3} K after");
    assert!(after < 0.4, "{after} K");
}
