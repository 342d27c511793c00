//! Machines, conditions and solves shared by the tests.

use std::path::PathBuf;

use coldplate_base::document::Document;
use coldplate_describe::machine::{Condition, Machine};
use coldplate_solve::meshed::MeshedMachine;
use coldplate_solve::study::Study;

/// The path of a machine of the repository.
pub fn path(name: &str) -> PathBuf {
    coldplate_testing::root().join("machines").join(format!("{name}.toml"))
}

/// The shipped machines, with a number of cells that keeps the tests short, and conditions in
/// (coolant flow L/min, coolant degC, motor rpm, chamber degC).
pub const SHIPPED: [(&str, usize, [[f64; 4]; 3]); 5] = [
    ("slab", 1500, [[2.0, 20.0, 1000.0, 23.0], [0.5, 15.0, 3000.0, 30.0], [6.0, 25.0, 500.0, 18.0]]),
    ("spindle", 2500, [[3.0, 20.0, 2000.0, 22.0], [1.0, 24.0, 3000.0, 20.0], [8.0, 16.0, 500.0, 26.0]]),
    ("rig", 2500, [[1.998, 26.0, 2500.0, 28.5], [3.6, 20.0, 1000.0, 24.0], [4.2, 28.0, 2000.0, 19.0]]),
    ("five_axis", 4000, [[6.834, 20.5, 250.0, 23.5], [3.0, 18.0, 2500.0, 24.0], [18.0, 24.0, 1500.0, 18.0]]),
    ("enclosure", 3000, [[4.0, 20.0, 2000.0, 22.0], [1.0, 28.0, 3000.0, 18.0], [8.0, 15.0, 500.0, 30.0]]),
];

/// A condition from L/min, degC, rpm, degC.
pub fn condition(machine: &Machine, [flow, coolant, speed, ambient]: [f64; 4]) -> Condition {
    let values = [format!("{flow} L/min"), format!("{coolant} degC"), format!("{speed} rpm"), format!("{ambient} degC")];
    let names = ["coolant_flow", "coolant_temperature", "motor_speed", "ambient_temperature"];
    let pairs: Vec<(&str, &str)> = names.into_iter().zip(values.iter().map(String::as_str)).collect();
    machine.condition(&pairs).unwrap()
}

/// Few rays are enough: the derivatives are those of whatever view factors they find. The conductivity of stainless 304
/// has a corner at 300 K, in the midst of the hood's temperatures, where differences are no derivative.
fn sets(name: &str) -> Vec<(String, String)> {
    let pairs: &[(&str, &str)] = match name {
        "enclosure" => &[("enclosure.hood.rays", "2000"), ("enclosure.hood.cache", "false"), ("part.hood.material", "\"stainless 316\"")],
        _ => &[],
    };
    pairs.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect()
}

/// A shipped machine on about `cells` cells.
pub fn model(name: &str, cells: usize) -> MeshedMachine {
    MeshedMachine::new(Machine::read(path(name), &sets(name)).unwrap(), Some(cells)).unwrap()
}

/// A machine file that holds every law whose coefficients follow the temperature: k(T) in all places, a rough
/// contact with gas and radiation in its gap, contact and film tables, a rough pair of channels in parallel.
pub const EVERYTHING: &str = r#"
name = "everything that follows the temperature"
[material.steep]
conductivity = [["-50 degC", "10 W/(m K)"], ["150 degC", "30 W/(m K)"]]
density = "7900 kg/m3"
specific_heat = "500 J/(kg K)"
[material.plain]
conductivity = "120 W/(m K)"
density = "2700 kg/m3"
specific_heat = "900 J/(kg K)"
[chamber]
pressure = "2 Pa"
wall_emissivity = 0.4
wall_area = "2 m2"
[surfaces]
emissivity = 0.7
[part.plate]
material = "steep"
box = ["200 mm", "120 mm", "24 mm"]
[part.block]
material = "steep"
box = ["80 mm", "80 mm", "40 mm"]
at = ["20 mm", "20 mm", "24 mm"]
[part.lid]
material = "plain"
box = ["80 mm", "80 mm", "20 mm"]
at = ["20 mm", "20 mm", "64 mm"]
[part.side]
material = "plain"
box = ["60 mm", "80 mm", "30 mm"]
at = ["120 mm", "20 mm", "24 mm"]
[part.screen]
material = "plain"
box = ["80 mm", "80 mm", "4 mm"]
at = ["20 mm", "20 mm", "100 mm"]
[node.motor]
capacity = "100 J/K"
emissivity = 0.8
area = "0.02 m2"
[node.held]
temperature = "ambient_temperature"
[contact.foot]
between = ["block", "plate"]
rough = { roughness = "2.3 um", slope = 0.15, hardness = "1.3 GPa", pressure = "1 MPa", gas = { pressure = "2000 Pa" }, emissivity = [0.3, 0.4] }
[contact.lid]
between = ["lid", "block"]
temperature_table = [["-20 degC", "200 W/(m2 K)"], ["150 degC", "900 W/(m2 K)"]]
factor = "0.5 + coolant_temperature_degC / 60"
[contact.side]
between = ["side", "plate"]
pressure_table = [["0.1 MPa", "300 W/(m2 K)"], ["1 MPa", "900 W/(m2 K)"]]
pressure = "0.4 MPa"
[contact.motor]
between = ["motor", "side.+z"]
conductance = "400 W/(m2 K)"
area = "30 cm2"
[contact.held]
between = ["held", "plate.-x"]
total_conductance = "0.3 W/K"
[contact.far]
between = ["lid.+y", "side.+y"]
conductance = "800 W/(m2 K)"
area = "2 cm2"
[boundary.bottom]
faces = ["plate.-z"]
film = "12 W/(m2 K)"
fluid_temperature = "ambient_temperature"
[boundary.end]
faces = ["plate.-y"]
temperature = "ambient_temperature"
[boundary.lamp]
faces = ["side.-y"]
heat_flux = "300 W/m2"
[boundary.wall]
faces = ["block.-x"]
emissivity = 0.5
[radiation_link.gap]
between = ["lid.+z", "screen.-z"]
view_factor = 0.7
emissivity = [0.7, 0.5]
[channel.a]
in = "plate"
diameter = "8 mm"
path = [["0 mm", "30 mm", "12 mm"], ["200 mm", "30 mm", "12 mm"]]
roughness = "20 um"
[channel.b]
in = "plate"
diameter = "6 mm"
path = [["0 mm", "60 mm", "12 mm"], ["200 mm", "60 mm", "12 mm"]]
minor_loss = 2.0
bend_factor = 1.2
[channel.c]
in = "plate"
diameter = "8 mm"
path = [["200 mm", "95 mm", "12 mm"], ["0 mm", "95 mm", "12 mm"]]
wall = "temperature"
[circuit.water]
layout = [["a", "b"], "c"]
[source.motor]
in = "motor"
power = "5 + 0.01 * motor_speed_rpm"
[source.block]
in = "block"
power = "40 W"
[sensor.motor]
node = "motor"
[sensor.block]
part = "block"
[sensor.lid]
face = "lid.+z"
[sensor.screen]
part = "screen"
[sensor.in]
inlet = "a"
[sensor.out]
outlet = "c"
[sensor.branch]
outlet = "b"
[sensor.point]
in = "plate"
point = ["70 mm", "40 mm", "20 mm"]
[limit.motor]
sensor = "motor"
rise = "20 K"
[limit.water]
between = ["out", "in"]
difference = "3 K"
[limit.spread]
sensors = ["motor", "block", "out"]
spread = "30 K"
"#;

/// A machine file whose faces see each other, one of them held at a temperature, one under a film of gas; the grids of
/// block and floor do not match.
pub const ENCLOSED: &str = r#"
name = "faces that see each other"
[material.steep]
conductivity = [["-50 degC", "10 W/(m K)"], ["150 degC", "30 W/(m K)"]]
density = "7900 kg/m3"
specific_heat = "500 J/(kg K)"
[material.plain]
conductivity = "20 W/(m K)"
density = "2700 kg/m3"
specific_heat = "900 J/(kg K)"
[chamber]
pressure = "1 Pa"
wall_emissivity = 0.4
wall_area = "2 m2"
[surfaces]
emissivity = 0.7
[part.floor]
material = "steep"
box = ["200 mm", "120 mm", "20 mm"]
[part.block]
material = "steep"
box = ["50 mm", "50 mm", "30 mm"]
at = ["41 mm", "33 mm", "20 mm"]
[part.roof]
material = "plain"
box = ["200 mm", "120 mm", "5 mm"]
at = ["0 mm", "0 mm", "80 mm"]
[contact.foot]
between = ["block", "floor"]
conductance = "500 W/(m2 K)"
[boundary.held]
faces = ["block.+x"]
temperature = "ambient_temperature"
[boundary.film]
faces = ["floor.+z"]
film = "5 W/(m2 K)"
fluid_temperature = "ambient_temperature"
[enclosure.gap]
surfaces = [
    { face = "floor.+z", emissivity = 0.3 },
    { face = "roof.-z", emissivity = 0.8 },
    { part = "block", emissivity = 0.6 },
]
view_factors = [[0, 0.5, 0.2], ["?", 0, 0.1], ["?", "?", 0]]
[source.block]
in = "block"
power = "30 + 0.02 * motor_speed_rpm"
[sensor.block]
part = "block"
[sensor.floor]
in = "floor"
point = ["150 mm", "40 mm", "8 mm"]
[sensor.roof]
face = "roof.+z"
"#;

/// A machine whose water goes from circuits into others: a pair of rough branches and a given one, mixed with cold water; a part
/// of that goes on.
pub const FED: &str = r#"
name = "circuits that feed others"
[part.plate]
material = "aluminium"
box = ["200 mm", "240 mm", "20 mm"]
[channel.a]
in = "plate"
diameter = "8 mm"
path = [["0 mm", "20 mm", "10 mm"], ["200 mm", "20 mm", "10 mm"]]
roughness = "20 um"
[channel.b]
in = "plate"
diameter = "6 mm"
path = [["0 mm", "60 mm", "10 mm"], ["200 mm", "60 mm", "10 mm"]]
[channel.c]
in = "plate"
diameter = "8 mm"
path = [["0 mm", "100 mm", "10 mm"], ["200 mm", "100 mm", "10 mm"]]
[channel.d]
in = "plate"
diameter = "8 mm"
path = [["200 mm", "140 mm", "10 mm"], ["0 mm", "140 mm", "10 mm"]]
[channel.e]
in = "plate"
diameter = "8 mm"
path = [["200 mm", "180 mm", "10 mm"], ["0 mm", "180 mm", "10 mm"]]
[channel.f]
in = "plate"
diameter = "8 mm"
path = [["200 mm", "220 mm", "10 mm"], ["0 mm", "220 mm", "10 mm"]]
[circuit.hot]
layout = [["a", "b", "c"]]
branches = { c = 0.4 }
[circuit.cold]
flow = "1 L/min"
inlet_temperature = "ambient_temperature"
layout = ["d"]
[circuit.mixed]
from = ["hot", "cold"]
layout = ["e"]
[circuit.last]
from = "mixed"
flow = { formula = "0.4 * coolant_flow_L_min", unit = "L/min" }
layout = ["f"]
[source.plate]
in = "plate"
power = "0.2 * motor_speed_rpm"
[sensor.plate]
part = "plate"
[sensor.a]
outlet = "a"
[sensor.b]
outlet = "b"
[sensor.e]
outlet = "e"
[sensor.inlet]
inlet = "f"
[sensor.f]
outlet = "f"
"#;

/// A study of a shipped machine.
pub fn study(name: &str, cells: usize) -> Study {
    Study::read(path(name), &sets(name), Some(cells)).unwrap()
}

/// A study of a text.
pub fn study_of(text: &str, cells: usize) -> Study {
    Study::new(Document::parse(text, "test.toml").unwrap(), Some(cells)).unwrap()
}

/// Readings, K, at a condition, converged to rounding.
pub fn readings(study: &Study, condition: &Condition) -> Vec<f64> {
    let at = study.at(condition).unwrap();
    let mut temperatures = at.state.solution.temperatures.clone();
    let moved = at.tangent.correct(&at.state.load, &mut temperatures).unwrap();
    assert!(moved < 1e-7, "the solution still moves by {moved:e} K");
    study.model.network.sensors.iter().map(|s| s.read(&temperatures, &at.state.load)).collect()
}
