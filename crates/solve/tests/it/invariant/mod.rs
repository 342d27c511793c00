//! What must hold for every machine and mesh, whatever the numbers: conservation, bounds, symmetry, and
//! independence of everything that is only a choice (order of parts, threads, cuts between blocks).

mod choice;
mod conservation;
mod geometry;
mod picture;

/// Asserts that two numbers agree to `tolerance` relative to `span`.
#[track_caller]
fn close(found: f64, expected: f64, span: f64, tolerance: f64) {
    let error = ((found - expected) / span).abs();
    assert!(error <= tolerance, "found {found:.12e}, expected {expected:.12e}: {error:.2e} of {span:.3e}");
}

/// A small machine with one of everything: two plates in series and two in parallel on a bed that radiates, a
/// motor as a lumped node, contacts, a film, conductivity that depends on temperature, a cylinder.
/// `order` names the tables in the order in which they are written.
fn everything(order: &[&str]) -> String {
    let mut text = String::from(
        r#"
[chamber]
temperature = "23.5 degC"
wall_emissivity = 0.3
wall_area = "24 m2"
[material.steel]
conductivity = [["0 degC", "14.6 W/(m K)"], ["200 degC", "17.1 W/(m K)"]]
[material.aluminium]
conductivity = "167 W/(m K)"
[contacts]
default = { conductance = "600 W/(m2 K)" }
"#,
    );
    for name in order {
        text += match *name {
            "bed" => {
                r#"
[part.bed]
material = "steel"
box = ["300 mm", "200 mm", "60 mm"]
at = ["0 m", "0 m", "0 m"]
surface = { emissivity = 0.55, excluded = ["-z"] }
"#
            }
            "plate" => {
                r#"
[part.plate]
material = "aluminium"
box = ["120 mm", "100 mm", "25 mm"]
at = ["20 mm", "30 mm", "60 mm"]
surface = { emissivity = 0.1 }
"#
            }
            "other" => {
                r#"
[part.other]
material = "aluminium"
box = ["100 mm", "110 mm", "25 mm"]
at = ["180 mm", "50 mm", "60 mm"]
surface = { emissivity = 0.1 }
"#
            }
            "bearing" => {
                r#"
[part.bearing]
material = "steel"
cylinder = { axis = "z", inner = "15 mm", outer = "35 mm", length = "40 mm" }
at = ["80 mm", "80 mm", "85 mm"]
surface = { emissivity = 0.4 }
"#
            }
            name => panic!("{name}"),
        };
    }
    text += r#"
[contact.seat]
between = ["plate.+z", "bearing"]
conductance = "1500 W/(m2 K)"
[node.motor]
capacity = "4000 J/K"
emissivity = 0.6
area = "0.08 m2"
[contact.flange]
between = ["motor", "bearing.end"]
total_conductance = "9 W/K"
[source.copper]
in = ["motor"]
power = "80 W"
[source.friction]
in = ["bearing"]
power = "25 W"
[source.screw]
in = ["bed.+x"]
power = "12 W"
[channel.first]
in = "plate"
diameter = "8 mm"
path = [["0 mm", "20 mm", "12 mm"], ["100 mm", "20 mm", "12 mm"], ["100 mm", "80 mm", "12 mm"], ["0 mm", "80 mm", "12 mm"]]
[channel.second]
in = "other"
diameter = "8 mm"
path = [["10 mm", "0 mm", "12 mm"], ["10 mm", "100 mm", "12 mm"]]
[channel.third]
in = "other"
diameter = "6 mm"
minor_loss = 2.0
path = [["60 mm", "0 mm", "12 mm"], ["60 mm", "100 mm", "12 mm"], ["90 mm", "100 mm", "12 mm"]]
[circuit.main]
flow = "2 L/min"
inlet_temperature = "20 degC"
layout = ["first", ["second", "third"]]
dissipation = true
[sensor.bed]
part = "bed"
[sensor.plate]
face = "plate.+z"
[sensor.bearing]
point = ["20 mm", "0 mm", "15 mm"]
in = "bearing"
[sensor.motor]
node = "motor"
[sensor.out2]
outlet = "second"
[sensor.out3]
outlet = "third"
"#;
    text
}
