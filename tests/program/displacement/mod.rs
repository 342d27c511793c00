//! Thermal displacement as its users meet it: solve, simulate, sweep, fit, query and export; measured displacements; and another
//! program's solution of the same structure.

mod calculix;
mod figures;
mod measured;
mod pipeline;

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::common::coldplate_in;

/// A post that a heater warms on one side, with an arm on it: it bends and grows.
pub const POST: &str = r#"
name = "Post with an arm"
[variables]
coolant_flow = "2 L/min"
coolant_temperature = "20 degC"
motor_speed = { default = "1000 rpm", range = ["0 rpm", "3000 rpm"] }
ambient_temperature = { default = "20 degC", range = ["15 degC", "30 degC"] }
[surfaces]
emissivity = 0.9
[part.post]
material = "steel"
box = ["60 mm", "60 mm", "400 mm"]
at = ["0 mm", "0 mm", "0 mm"]
[part.arm]
material = "aluminium 6061"
box = ["300 mm", "60 mm", "50 mm"]
at = ["60 mm", "0 mm", "350 mm"]
[node.floor]
temperature = "ambient_temperature"
[contact.flange]
between = ["post", "arm"]
conductance = "1500 W/(m2 K)"
[contact.foot]
between = ["post.-z", "floor"]
conductance = "800 W/(m2 K)"
area = "36 cm2"
[source.heater]
in = ["arm"]
power = "0.02 * motor_speed_rpm"
[support.floor]
faces = ["post.-z"]
[sensor.post]
part = "post"
[sensor.arm]
part = "arm"
[displacement."tip x"]
point = ["300 mm", "30 mm", "25 mm"]
in = "arm"
direction = "x"
[displacement."tip z"]
point = ["300 mm", "30 mm", "25 mm"]
in = "arm"
direction = "z"
[limit.arm]
sensor = "arm"
maximum = "60 degC"
[limit."tip x"]
sensor = "tip x"
maximum = "120 um"
[mesh]
cells = 700
"#;

/// What a command prints as JSON, whatever its verdict.
#[track_caller]
pub fn json(folder: &Path, args: &[&str]) -> Value {
    let output = coldplate_in(folder, &[args, &["--json"]].concat());
    let text = String::from_utf8_lossy(&output.stdout);
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{args:?}: {e}\n{text}{}", String::from_utf8_lossy(&output.stderr)))
}

/// An empty folder with the machine in it.
pub fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("displacement-{name}"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("post.toml"), POST).unwrap();
    folder
}
