//! Machines, noise and the binary, shared by the tests.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use coldplate_base::document::Document;
use coldplate_describe::machine::Condition;
use coldplate_evidence::identify::{Free, Problem};
use coldplate_evidence::measurement::{Data, Row, Uncertainty};
use coldplate_explore::simulate::Start;
use coldplate_solve::sensitivity::Study;
use serde_json::Value;
use statrs::distribution::{Binomial, DiscreteCDF};

/// Two blocks that make heat, each joined to a water-cooled plate, in a radiating chamber.
pub const BLOCKS: &str = r#"
name = "two blocks on a plate"
# Nearly one temperature in each part, so that two meshes agree to a few millikelvin.
[material.even]
conductivity = "20000 W/(m K)"
density = "2700 kg/m3"
specific_heat = "900 J/(kg K)"
[part.plate]
material = "even"
box = ["200 mm", "120 mm", "20 mm"]
surface = { emissivity = 0.1 }
[part.motor]
material = "even"
box = ["80 mm", "60 mm", "40 mm"]
at = ["10 mm", "30 mm", "20 mm"]
surface = { emissivity = 0.8 }
[part.reducer]
material = "even"
box = ["60 mm", "60 mm", "40 mm"]
at = ["120 mm", "30 mm", "20 mm"]
surface = { emissivity = 0.6 }
[contact.motor]
between = ["motor", "plate"]
conductance = "700 W/(m2 K)"
[contact.reducer]
between = ["reducer", "plate"]
conductance = "500 W/(m2 K)"
[source.motor]
in = "motor"
power = "0.05 * motor_speed_rpm"
[source.reducer]
in = "reducer"
power = "0.02 * motor_speed_rpm"
[channel.hole]
in = "plate"
diameter = "8 mm"
path = [["0 mm", "60 mm", "10 mm"], ["200 mm", "60 mm", "10 mm"]]
[circuit.water]
flow = "coolant_flow"
inlet_temperature = "coolant_temperature"
layout = ["hole"]
[chamber]
temperature = "ambient_temperature"
[sensor.motor]
part = "motor"
[sensor.reducer]
part = "reducer"
[sensor.plate]
part = "plate"
[sensor.outlet]
outlet = "hole"
"#;

/// A source behind two conductances in series: motor = ambient + Q/G1 + Q/G2, middle = ambient + Q/G1.
pub const SERIES: &str = r#"# two nodes in a row
name = "two nodes in a row"
[node.base]
temperature = "ambient_temperature"
[node.middle]
capacity = "200 J/K"
[node.motor] # keep this remark
capacity = "1000 J/K"
[contact.first]
between = ["base", "middle"]
total_conductance = "2 W/K" # a guess
[contact.second]
between = ["middle", "motor"]
conductance = "400 W/(m2 K)" # 4 W/K over the area
area = "100 cm2"
[source.motor]
in = "motor"
power = "30 W"
[sensor.motor]
node = "motor"
[sensor.middle]
node = "middle"
"#;

/// A machine from text on about `cells` cells.
pub fn study(text: &str, cells: Option<usize>) -> Study {
    Study::new(Document::parse(text, "twin.toml").unwrap(), cells).unwrap()
}

/// A condition in L/min, degC, rpm, degC.
pub fn condition(study: &Study, [flow, coolant, speed, ambient]: [f64; 4]) -> Condition {
    let values = [format!("{flow} L/min"), format!("{coolant} degC"), format!("{speed} rpm"), format!("{ambient} degC")];
    let names = ["coolant_flow", "coolant_temperature", "motor_speed", "ambient_temperature"];
    let pairs: Vec<(&str, &str)> = names.into_iter().zip(values.iter().map(String::as_str)).collect();
    study.model.machine.condition(&pairs).unwrap()
}

/// Steady readings (K) of some sensors.
pub fn table(study: &Study, sensors: &[&str], rows: &[(Condition, Vec<Option<f64>>)]) -> Data {
    let of = |(n, (condition, readings)): (usize, &(Condition, Vec<Option<f64>>))| Row {
        test: format!("test {}", n + 1),
        time: None,
        condition: condition.clone(),
        readings: readings.clone(),
        line: None,
    };
    let place = |name: &&str| study.model.machine.sensors.iter().position(|s| s.name == *name).unwrap();
    Data {
        source: "twin".into(),
        sensors: sensors.iter().map(place).collect(),
        names: sensors.iter().map(ToString::to_string).collect(),
        rows: rows.iter().enumerate().map(of).collect(),
        notes: Vec::new(),
    }
}

pub fn problem(study: Study, data: Data, uncertainty: Uncertainty, free: &[&str]) -> Problem {
    let free = free.iter().map(|text| Free::parse(text, &study).unwrap()).collect();
    Problem { study, data, uncertainty, free, start: Start::Steady }
}

/// Normal numbers (SplitMix64, Steele et al. 2014; Box and Muller 1958).
pub struct Normal(pub u64);

impl Normal {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (((z ^ (z >> 31)) >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    pub fn next(&mut self) -> f64 {
        let (a, b) = (self.uniform(), self.uniform());
        (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    }
}

/// Whether `hits` of `trials` is what a chance of `rate` may well give: neither tail below 0.0005.
pub fn is_likely(hits: usize, trials: usize, rate: f64) -> bool {
    let all = Binomial::new(rate, trials as u64).unwrap();
    let (below, above) = (all.cdf(hits as u64), if hits == 0 { 1.0 } else { all.sf(hits as u64 - 1) });
    below > 5e-4 && above > 5e-4
}

pub fn coldplate(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_coldplate")).args(args).current_dir(env!("CARGO_MANIFEST_DIR")).output().expect("the program starts")
}

pub fn json(output: &Output) -> Value {
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{}", message(output));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

pub fn message(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

pub fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("identify-{name}"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

pub fn write(folder: &Path, name: &str, text: impl AsRef<[u8]>) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_string()
}
