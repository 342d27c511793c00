//! The exit status of `query`.

use std::path::PathBuf;
use std::process::Command;

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("coldplate-query-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        std::fs::copy(super::fixture("polynomial.cps"), path.join("small.cps")).unwrap();
        Self(path)
    }

    /// Exit status and messages of `coldplate query`.
    fn query(&self, options: &[&str]) -> (i32, String) {
        let file = self.0.join("small.cps");
        let output = Command::new(env!("CARGO_BIN_EXE_coldplate")).arg("query").arg(file).args(options).arg("--json").output().unwrap();
        (output.status.code().unwrap(), String::from_utf8_lossy(&output.stderr).into_owned())
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn the_exit_status_is_the_verdict() {
    let folder = Folder::new("status");
    let at = |flow, coolant, ambient| {
        folder.query(&["--coolant-flow", flow, "--coolant-temperature", coolant, "--ambient-temperature", ambient])
    };
    assert_eq!(at("8 L/min", "20 degC", "21 degC").0, 0);
    assert_eq!(at("8 L/min", "25 degC", "21 degC").0, 1); // the motor is well over 28 degC
    assert_eq!(at("13 L/min", "20 degC", "21 degC").0, 3); // outside
    assert_eq!(at("8", "20 degC", "21 degC").0, 2);
    let free = ["--free", "coolant-flow", "--coolant-temperature", "20 degC", "--ambient-temperature", "21 degC"];
    assert_eq!(folder.query(&free).0, 0);
    assert!(folder.query(&["--free", "flow"]).1.contains("coolant_flow"));

    let csv = folder.0.join("many.csv");
    let batch = |rows: &str| {
        std::fs::write(&csv, format!("coolant_flow [L/min],coolant_temperature [degC],ambient_temperature [degC]\n{rows}")).unwrap();
        folder.query(&["--csv", csv.to_str().unwrap()])
    };
    assert_eq!(batch("8,20,21\n").0, 0);
    assert_eq!(batch("8,20,21\n13,20,21\n").0, 3);
    assert_eq!(batch("8,20,21\n13,20,21\n8,25,21\n").0, 1);
    let (status, message) = batch("8,20,21\n8,20,x\n");
    assert!(status == 2 && message.contains("many.csv:3"), "{message}");
}

#[test]
fn a_damaged_file_is_named() {
    let folder = Folder::new("damage");
    let path = folder.0.join("small.cps");
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[60] ^= 1;
    std::fs::write(&path, bytes).unwrap();
    let message = folder.query(&[]).1;
    assert!(message.contains("checksum") && message.contains("small.cps"), "{message}");
}

/// A variable that is left out takes the default of the machine file, as in `solve`; the answer shows it.
#[test]
fn defaults_of_the_machine_file_are_carried() {
    let folder = crate::common::scratch("query-defaults");
    let table: String = (0..12).map(|i| format!("{},{}\n", 2.0 + 0.5 * f64::from(i), 40.0 - f64::from(i))).collect();
    std::fs::write(folder.join("t.csv"), format!("coolant_flow [L/min],motor [degC]\n{table}")).unwrap();
    let [table, file] = ["t.csv", "t.cps"].map(|name| folder.join(name).to_str().unwrap().to_string());
    let fitted = crate::common::coldplate(&["fit", &table, "--machine", "examples/tutorial/machine.toml", "--out", &file]);
    assert_eq!(fitted.status.code(), Some(0), "{}", crate::common::message(&fitted));
    let output = crate::common::coldplate(&["query", &file]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.code() == Some(0) && text.starts_with("coolant_flow 4 L/min\n"), "{text}{}", crate::common::message(&output));
    let answer = crate::common::json(&crate::common::coldplate(&["query", &file, "--json"]));
    assert!((answer["temperatures"]["motor"]["degC"].as_f64().unwrap() - 36.0).abs() < 0.01, "{answer}");
    // Rows of a table that lack a column take the default too, and show it.
    let rows = folder.join("rows.csv");
    std::fs::write(&rows, "test\nfirst\nsecond\n").unwrap();
    let output = crate::common::coldplate(&["query", &file, "--csv", rows.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(0), "{}", crate::common::message(&output));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let lines: Vec<&str> = text.lines().collect();
    let flow = lines[0].split(',').position(|cell| cell.starts_with("coolant_flow")).unwrap_or_else(|| panic!("{text}"));
    assert!(lines.len() == 3 && lines[1..].iter().all(|line| line.split(',').nth(flow) == Some("4")), "{text}");
}

/// Outside the fitted range no probability is known, and none is shown; inside it is.
#[test]
fn limits_outside_the_range_are_kept_with_unknown_probability() {
    let file = super::fixture("uncertain.cps").to_str().unwrap().to_string();
    let at = |flow: &str| {
        let options = ["query", &file, "--coolant-flow", flow, "--coolant-temperature", "20 degC", "--ambient-temperature", "21 degC"];
        let output = crate::common::coldplate(&options);
        (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let limits = |text: &str| text.lines().filter(|line| line.contains("unknown")).count();
    let (status, outside) = at("13 L/min");
    assert!(status == Some(3) && limits(&outside) == 4 && outside.contains("outside the fitted range"), "{outside}");
    let (status, inside) = at("8 L/min");
    assert!(status == Some(0) && limits(&inside) == 0 && inside.contains('%'), "{inside}");
}
