//! Chart definitions: those shipped can be read, mistakes are shown where they stand, the command draws them.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use coldplate_jobs::charts::{Chart, KINDS};

fn project() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn shipped() -> Vec<PathBuf> {
    let files = std::fs::read_dir(project().join("charts")).unwrap().map(|f| f.unwrap().path());
    let mut files: Vec<PathBuf> = files.filter(|f| f.extension().is_some_and(|e| e == "toml")).collect();
    files.sort();
    files
}

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn chart(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_coldplate")).arg("chart").args(arguments).current_dir(project()).output().unwrap()
}

/// The message for a definition of this text.
fn refused(name: &str, text: &str) -> String {
    let path = folder(name).join("wrong.toml");
    std::fs::write(&path, text).unwrap();
    Chart::read(&path).unwrap_err().to_string()
}

#[test]
fn shipped_definitions_can_be_read_and_cover_every_kind() {
    let charts: Vec<Chart> = shipped().iter().map(|path| Chart::read(path).unwrap()).collect();
    for kind in KINDS {
        assert!(charts.iter().any(|c| c.figure() == *kind), "no shipped definition draws '{kind}'");
    }
}

#[test]
fn mistakes_are_shown_where_they_stand() {
    let figure = refused("chart-figure", "figure = \"acceptabilty\"\n");
    assert!(figure.contains("wrong.toml:1") && figure.contains("did you mean 'acceptability'"), "{figure}");
    let key = refused("chart-key", "figure = \"errors\"\nsweep = \"x.toml\"\ntitel = \"a\"\n");
    assert!(key.contains(":3") && key.contains("did you mean 'title'"), "{key}");
    let source = refused("chart-source", "figure = \"errors\"\n");
    assert!(source.contains("sweep = ") && source.contains("surrogate = "), "{source}");
    let both = refused("chart-both", "figure = \"errors\"\nsweep = \"x.toml\"\nsurrogate = \"x.cps\"\n");
    assert!(both.contains("exclude each other"), "{both}");
    let model = refused("chart-model", "figure = \"model\"\nmachine = \"x.toml\"\nwidth = 400\n");
    assert!(model.contains(":3") && model.contains("a model has no width"), "{model}");
}

#[test]
fn the_command_draws_definitions() {
    let out = folder("chart-command");
    let definitions = ["heat_rig", "sankey_rig", "measured_rig", "model_rig"].map(|name| format!("charts/{name}.toml"));
    let drawn = chart(&[&definitions.each_ref().map(String::as_str)[..], &["--out", out.to_str().unwrap()]].concat());
    assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
    for name in ["heat_rig", "sankey_rig", "measured_rig"] {
        let svg = std::fs::read_to_string(out.join(format!("{name}.svg"))).unwrap();
        assert!(svg.contains("working condition 1"), "{name}");
        assert!(out.join(format!("{name}.png")).exists(), "{name}");
    }
    let model = std::fs::read(out.join("model_rig.glb")).unwrap();
    assert!(model.starts_with(b"glTF") && String::from_utf8_lossy(&drawn.stdout).contains("model_rig.glb"));
}

#[test]
fn a_name_the_machine_does_not_know_is_shown_with_its_line() {
    let path = folder("chart-name").join("wrong.toml");
    let machine = project().join("machines/rig.toml");
    let text = format!("figure = \"heat\"\nmachine = '{}'\nmeasurement = \"working condition 3\"\n", machine.display());
    std::fs::write(&path, text).unwrap();
    let drawn = chart(&[path.to_str().unwrap()]);
    let message = String::from_utf8_lossy(&drawn.stderr).into_owned();
    assert_eq!(drawn.status.code(), Some(2));
    assert!(message.contains(":3") && message.contains("did you mean 'working condition"), "{message}");
}

#[test]
fn a_surrogate_alone_is_drawn() {
    let out = folder("chart-surrogate");
    let mut rows = String::from("coolant_flow [L/min],motor_speed [rpm],motor [degC]\n");
    for i in 0..36 {
        let (q, n) = (2.0 + f64::from(i % 6), 500.0 * f64::from(1 + i / 6));
        rows += &format!("{q},{n},{}\n", 20.0 + n / 100.0 / q);
    }
    let (table, surrogate) = (out.join("table.csv"), out.join("motor.cps"));
    std::fs::write(&table, rows).unwrap();
    let program = env!("CARGO_BIN_EXE_coldplate");
    let fitted = Command::new(program).arg("fit").arg(&table).arg("--out").arg(&surrogate).output().unwrap();
    assert!(fitted.status.success(), "{}", String::from_utf8_lossy(&fitted.stderr));
    let drawn = chart(&[surrogate.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
    assert!(out.join("charts/against_coolant_flow_1.svg").exists());
}

#[test]
fn definitions_and_surrogates_do_not_mix() {
    let mixed = chart(&["charts/heat_rig.toml", "motor.cps"]);
    assert_eq!(mixed.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&mixed.stderr).contains("no chart definition"));
}
