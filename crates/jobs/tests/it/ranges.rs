//! A surrogate of a machine's own ranges reaches to their very ends.

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_jobs::refit::refit;
use coldplate_surrogate::fit::file;

/// Ends that do not survive the way through kelvin and m3/s digit by digit.
const RANGES: &str = r#"
name = "plate"
[variables]
coolant_flow = { unit = "L/min", range = ["2.3 L/min", "6.7 L/min"] }
coolant_temperature = { unit = "degC", range = ["18.3 degC", "23.7 degC"] }
motor_speed = "1000 rpm"
ambient_temperature = "20 degC"
[part.plate]
material = "aluminium 6061"
box = ["0.2 m", "0.1 m", "20 mm"]
[channel.pass]
in = "plate"
diameter = "8 mm"
path = [["0 mm", "50 mm", "10 mm"], ["200 mm", "50 mm", "10 mm"]]
[circuit.loop]
layout = ["pass"]
flow = "coolant_flow"
inlet_temperature = "coolant_temperature"
[source.heat]
in = "plate"
power = "100 W"
[sensor.plate]
part = "plate"
"#;

#[test]
fn a_refitted_surrogate_ends_where_the_machine_file_says() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("surrogate-ranges");
    let _ = std::fs::remove_dir_all(&folder);
    let made = refit(&Document::parse(RANGES, "m.toml").unwrap(), 100, "plate", &folder, &Silent).unwrap();
    let opened = file::open(&made.bytes).unwrap();
    let ends: Vec<(String, f64, f64)> = opened.variables().map(|v| (v.name.to_string(), v.low, v.high)).collect();
    let wanted = [("coolant_flow", 2.3, 6.7), ("coolant_temperature", 18.3, 23.7)].map(|(n, low, high)| (n.to_string(), low, high));
    assert_eq!(ends, wanted);
}
