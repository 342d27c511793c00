//! What answers and figures say of variables that were held while a surrogate was made.

use std::path::PathBuf;
use std::process::{Command, Output};

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("coldplate-held-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        std::fs::copy(super::fixture("held.cps"), path.join("held.cps")).unwrap();
        Self(path)
    }

    fn run(&self, words: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_coldplate")).args(words).current_dir(&self.0).output().unwrap()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

const CONDITION: [&str; 6] = ["--coolant-flow", "8 L/min", "--coolant-temperature", "20 degC", "--ambient-temperature", "21 degC"];

#[test]
fn every_answer_names_what_was_held() {
    let folder = Folder::new("answers");
    let query = |more: &[&str]| folder.run(&[&["query", "held.cps"], &CONDITION[..], more].concat());
    let text = |output: &Output| String::from_utf8(output.stdout.clone()).unwrap();
    let plain = query(&[]);
    assert_eq!(plain.status.code(), Some(0));
    assert!(text(&plain).contains("held when the surrogate was made: motor_speed 2500 rpm"), "{}", text(&plain));
    assert_eq!(query(&["--motor-speed", "2500 rpm"]).status.code(), Some(0));
    let other = query(&["--motor-speed", "1000 rpm"]);
    assert_eq!(other.status.code(), Some(3));
    assert!(text(&other).contains("motor_speed = 1000 rpm is not the 2500 rpm"), "{}", text(&other));
    let json: serde_json::Value = serde_json::from_slice(&query(&["--json"]).stdout).unwrap();
    assert_eq!(json["held"]["motor_speed"], serde_json::json!({ "value": 2500.0, "unit": "rpm" }));

    std::fs::write(
        folder.0.join("many.csv"),
        "coolant_flow [L/min],coolant_temperature [degC],ambient_temperature [degC],motor_speed [rpm]\n8,20,21,2500\n8,20,21,1000\n",
    )
    .unwrap();
    let many = folder.run(&["query", "held.cps", "--csv", "many.csv"]);
    let lines: Vec<String> = text(&many).lines().map(String::from).collect();
    assert!(lines[0].contains("ambient_temperature [degC],motor_speed [rpm],"), "{}", lines[0]);
    assert!(lines[1].starts_with("8,20,21,2500,") && lines[1].contains(",acceptable,"), "{}", lines[1]);
    assert!(lines[2].starts_with("8,20,21,1000,") && lines[2].contains(",uncertain,"), "{}", lines[2]);
    assert_eq!(many.status.code(), Some(3));
}

#[test]
fn every_figure_names_what_was_held() {
    let folder = Folder::new("figures");
    let drawn = folder.run(&["chart", "held.cps"]);
    assert_eq!(drawn.status.code(), Some(0), "{}", String::from_utf8_lossy(&drawn.stderr));
    let mut figures = 0;
    for entry in std::fs::read_dir(folder.0.join("charts")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "svg") {
            let svg = std::fs::read_to_string(&path).unwrap();
            assert!(svg.contains("motor speed 2500"), "{}", path.display());
            figures += 1;
        }
    }
    assert!(figures >= 4, "{figures}");
    let map = ["chart", "held.cps", "--map", "coolant_flow,ambient_temperature", "--motor-speed"];
    assert_eq!(folder.run(&[&map[..], &["2500 rpm"]].concat()).status.code(), Some(0));
    let other = folder.run(&[&map[..], &["1000 rpm"]].concat());
    assert_eq!(other.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&other.stderr).contains("was held at 2500 rpm"));
}
