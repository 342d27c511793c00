//! The error of the mesh in answers: from a sweep on coarse cells to the verdict.

use std::path::PathBuf;
use std::process::Command;

use serde_json::Value;

/// A bar of 0.1 m on three cells, heated as exp(-x / 25 mm) along it and held at the coolant's temperature at one end. Nothing else is
/// uncertain, so that the bands are those of fit and mesh.
const BAR: &str = r#"
name = "Bar"
[variables]
coolant_flow = "5 L/min"
ambient_temperature = "20 degC"
[material.steel]
conductivity = "20 W/(m K)"
density = "7800 kg/m3"
specific_heat = "500 J/(kg K)"
[part.rod]
material = "steel"
surface = "none"
box = ["100 mm", "10 mm", "10 mm"]
cells = [12, 1, 1]
[boundary.held]
faces = ["rod.-x"]
temperature = "coolant_temperature"
[source.heat]
in = "rod"
power = "0.008 * motor_speed_rpm"
distribution = "exp(-x_mm / 25)"
[sensor.end]
face = "rod.+x"
[limit.end]
sensor = "end"
maximum = "MAXIMUM degC"
"#;

const SWEEP: &str = r#"
name = "Bar"
machine = "bar.toml"
uncertainty = "none"
[range]
coolant_temperature = ["18 degC", "24 degC"]
motor_speed = ["100 rpm", "1000 rpm"]
[design]
kind = "latin_hypercube"
runs = 12
seed = 1
corners = true
[validation]
runs = 6
seed = 2
"#;

/// Exact temperature of the free end at a coolant of 20 degC and 1000 rpm, degC.
fn exact() -> f64 {
    let e = (-4.0f64).exp();
    20.0 + 8.0 / (20.0 * 1e-4) * (0.025 * (1.0 - e) - 0.1 * e) / (1.0 - e)
}

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str, maximum: f64) -> Self {
        let path = std::env::temp_dir().join(format!("coldplate-mesh-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        std::fs::write(path.join("bar.toml"), BAR.replace("MAXIMUM", &maximum.to_string())).unwrap();
        std::fs::write(path.join("sweep.toml"), SWEEP).unwrap();
        Self(path)
    }

    /// Answer of the program as JSON, its exit status, and standard error.
    fn run(&self, words: &[&str]) -> (Value, Option<i32>, String) {
        let output = Command::new(env!("CARGO_BIN_EXE_coldplate")).args(words).arg("--json").current_dir(&self.0).output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        (serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{told}")), output.status.code(), told)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// On twelve cells the end is off by more than the fit says, and inside the band that holds the mesh; a limit between the two is
/// uncertain. The report and the summary say the mesh's part, and what less would cost.
#[test]
fn answers_hold_the_error_of_the_mesh() {
    let folder = Folder::new("coarse", exact() + 0.05);
    let (summary, status, told) = folder.run(&["run", "sweep.toml", "--out", "out"]);
    assert_eq!(status, Some(0), "{told}");
    let point = &summary["points"][0];
    let (fit, mesh) = (point["half_width_K"].as_f64().unwrap(), point["mesh_K"].as_f64().unwrap());
    assert!(fit < 0.01 && mesh > 0.1, "{point}");
    assert!(told.contains("the mesh of 12 cells leaves up to") && told.contains("mesh.accuracy"), "{told}");
    assert_eq!(summary["known"], Value::Null);
    let at = ["query", "out/surrogate.cps", "--coolant-temperature", "20 degC", "--motor-speed", "1000 rpm"];
    let (answer, status, _) = folder.run(&at);
    let end = &answer["temperatures"]["end"];
    let [value, low, high] = ["degC", "low", "high"].map(|key| end[key].as_f64().unwrap());
    assert!((value - exact()).abs() > fit, "the mesh's error does not show: {value}");
    assert!(low <= exact() && exact() <= high, "{low} {} {high}", exact());
    assert!((0.5 * (high - low) - fit.hypot(mesh)).abs() < 1e-6, "{low} {high} {fit} {mesh}");
    assert_eq!((answer["verdict"].as_str(), status), (Some("uncertain"), Some(3)));
    // Bands of exports hold it with the fit; the facts on their points state it by itself.
    assert_eq!(folder.run(&["export", "out/surrogate.cps", "--to", "json", "--out", "out"]).1, Some(0));
    let exported: Value = serde_json::from_slice(&std::fs::read(folder.0.join("out/surrogate.json")).unwrap()).unwrap();
    let own = &exported["points"][0];
    assert!((own["mesh"].as_f64().unwrap() - mesh).abs() < 1e-12, "{own}");
    assert!((own["half_width"].as_f64().unwrap() - fit.hypot(mesh)).abs() < 1e-9, "{own}");
    let report = std::fs::read_to_string(folder.0.join("out/report.html")).unwrap();
    let first = &report[report.find("<main>").unwrap()..];
    let place = |words: &str| first.find(words).unwrap_or_else(|| panic!("{words}"));
    assert!(
        place("measured readings") < place("error of the mesh at most")
            && place("error of the mesh at most") < place("by which the fit misses")
    );
}
