//! Derivatives that are known in closed form.

use coldplate_describe::machine::Condition;
use coldplate_physics::radiation::SIGMA;
use coldplate_solve::sensitivity::DerivativeTarget;
use coldplate_solve::study::Study;

use crate::sensitivity::common::{condition, study_of};

fn slope(study: &Study, at: &Condition, sensor: usize, name: &str) -> f64 {
    let derivatives = study.at(at).unwrap();
    derivatives.jacobian(&[DerivativeTarget::Sensor(sensor)], &[study.parameter(name).unwrap()]).unwrap().slopes[0][0]
}

fn assert_close(found: f64, exact: f64, what: &str) {
    println!("{what:>40}: {found:.12e}, exact {exact:.12e}, {:.1e}", (found / exact - 1.0).abs());
    assert!((found - exact).abs() < 1e-9 * exact.abs(), "{what}: {found:e} instead of {exact:e}");
}

/// Flux q into the far face of two slabs in contact, a film H to a fluid at T_f on the near face:
/// T = T_f + q (1/H + L/k + 1/h + L/k) on the far face.
#[test]
fn two_slabs_with_contact_and_film() {
    let study = study_of(
        r#"
name = "two slabs"
[material.m]
conductivity = "20 W/(m K)"
density = "1 kg/m3"
specific_heat = "1 J/(kg K)"
[part.near]
material = "m"
box = ["50 mm", "40 mm", "40 mm"]
[part.far]
material = "m"
box = ["50 mm", "40 mm", "40 mm"]
at = ["50 mm", "0 mm", "0 mm"]
[contact.joint]
between = ["near", "far"]
conductance = "500 W/(m2 K)"
[boundary.film]
faces = ["near.-x"]
film = "200 W/(m2 K)"
fluid_temperature = "coolant_temperature"
[boundary.flux]
faces = ["far.+x"]
heat_flux = "3 kW/m2"
[sensor.far]
face = "far.+x"
"#,
        300,
    );
    let at = condition(&study.model.machine, [1.0, 20.0, 0.0, 20.0]);
    let (q, big_h, h, k, length): (f64, f64, f64, f64, f64) = (3000.0, 200.0, 500.0, 20.0, 0.05);
    assert_close(slope(&study, &at, 0, "contact.joint.conductance"), -q / (h * h), "dT/dh of the contact");
    assert_close(slope(&study, &at, 0, "boundary.film.film"), -q / (big_h * big_h), "dT/dH of the film");
    assert_close(slope(&study, &at, 0, "material.m.conductivity"), -2.0 * q * length / (k * k), "dT/dk");
    assert_close(slope(&study, &at, 0, "boundary.flux.heat_flux"), 1.0 / big_h + 2.0 * length / k + 1.0 / h, "dT/dq");
    assert_close(slope(&study, &at, 0, "coolant_temperature"), 1.0, "dT/dT_f");
    // The slab that carries the flux grows: dT/dL = q/k, wherever the mesh is cut.
    assert_close(slope(&study, &at, 0, "part.far.box[1]"), q / k, "dT/dL");
}

/// The same slabs with a joint of h f, f = T_f / 40 degC: T = T_f + q (1/H + L/k + 1/(h f) + L/k).
#[test]
fn a_contact_that_follows_the_coolant() {
    let text = r#"
name = "two slabs"
[material.m]
conductivity = "20 W/(m K)"
density = "1 kg/m3"
specific_heat = "1 J/(kg K)"
[part.near]
material = "m"
box = ["50 mm", "40 mm", "40 mm"]
[part.far]
material = "m"
box = ["50 mm", "40 mm", "40 mm"]
at = ["50 mm", "0 mm", "0 mm"]
[contact.joint]
between = ["near", "far"]
conductance = "500 W/(m2 K)"
factor = "coolant_temperature_degC / 40"
[boundary.film]
faces = ["near.-x"]
film = "200 W/(m2 K)"
fluid_temperature = "coolant_temperature"
[boundary.flux]
faces = ["far.+x"]
heat_flux = "3 kW/m2"
[sensor.far]
face = "far.+x"
"#;
    let study = study_of(text, 300);
    let at = condition(&study.model.machine, [1.0, 30.0, 0.0, 20.0]);
    let (q, h, f): (f64, f64, f64) = (3000.0, 500.0, 0.75);
    assert_close(slope(&study, &at, 0, "contact.joint.conductance"), -q / (h * h * f), "dT/dh of the contact");
    assert_close(slope(&study, &at, 0, "contact.joint.factor"), -q / (h * f), "dT/d factor of its formula");
    assert_close(slope(&study, &at, 0, "coolant_temperature"), 1.0 - q / (h * f * f) / 40.0, "dT/dT_f");
    // Forward as backward.
    let derivatives = study.at(&at).unwrap();
    let partial = derivatives.partial(&study.parameter("coolant_temperature").unwrap()).unwrap();
    let forward = derivatives.along(DerivativeTarget::Sensor(0), &partial, &derivatives.field(&partial).unwrap());
    assert_close(forward, 1.0 - q / (h * f * f) / 40.0, "dT/dT_f forward");
    // A factor that is not written is a parameter all the same.
    let plain = study_of(&text.replace("factor = \"coolant_temperature_degC / 40\"\n", ""), 300);
    assert_close(slope(&plain, &at, 0, "contact.joint.factor"), -q / h, "dT/d factor where none is written");
}

/// A node of area A that radiates a power P to a chamber at T_0: T^4 = T_0^4 + P/(sigma eps A).
#[test]
fn a_radiating_node() {
    let study = study_of(
        r#"
name = "a radiating node"
[node.lamp]
effective_emissivity = 0.6
area = "0.02 m2"
[source.lamp]
in = "lamp"
power = "10 W"
[sensor.lamp]
node = "lamp"
"#,
        1,
    );
    let at = condition(&study.model.machine, [1.0, 20.0, 0.0, 26.85]);
    let (p, e, a, t0): (f64, f64, f64, f64) = (10.0, 0.6, 0.02, 300.0);
    let t = (t0.powi(4) + p / (SIGMA * e * a)).powf(0.25);
    let cube = 4.0 * SIGMA * t.powi(3);
    assert_close(slope(&study, &at, 0, "node.lamp.effective_emissivity"), -p / (e * e * a * cube), "dT/deps");
    assert_close(slope(&study, &at, 0, "node.lamp.area"), -p / (e * a * a * cube), "dT/dA");
    assert_close(slope(&study, &at, 0, "source.lamp.power"), 1.0 / (e * a * cube), "dT/dP");
    assert_close(slope(&study, &at, 0, "ambient_temperature"), (t0 / t).powi(3), "dT/dT_0");
}

/// All heat leaves with the water: T_out = T_in + P/(rho q c).
#[test]
fn the_rise_of_the_coolant() {
    let study = study_of(
        r#"
name = "all heat into the water"
[part.plate]
material = "aluminium"
box = ["200 mm", "50 mm", "20 mm"]
[channel.hole]
in = "plate"
diameter = "8 mm"
path = [["0 mm", "25 mm", "10 mm"], ["200 mm", "25 mm", "10 mm"]]
[circuit.water]
layout = ["hole"]
dissipation = false
liquid = { density = "1000 kg/m3", specific_heat = "4000 J/(kg K)", viscosity = "1 mPa s", conductivity = "0.6 W/(m K)" }
[source.heater]
in = "plate"
power = "0.1 * motor_speed_rpm"
[sensor.outlet]
outlet = "hole"
[sensor.inlet]
inlet = "hole"
[limit.rise]
between = ["outlet", "inlet"]
difference = "5 K"
"#,
        500,
    );
    let at = condition(&study.model.machine, [3.0, 20.0, 1000.0, 20.0]);
    let (p, rate, flow) = (100.0, 1000.0 * 4000.0, 3e-3 / 60.0);
    assert_close(slope(&study, &at, 0, "coolant_flow"), -p / (rate * flow * flow), "dT_out/dq");
    assert_close(slope(&study, &at, 0, "coolant_temperature"), 1.0, "dT_out/dT_in");
    assert_close(slope(&study, &at, 1, "coolant_temperature"), 1.0, "dT_in/dT_in");
    assert_close(slope(&study, &at, 0, "source.heater.power"), p / (rate * flow), "dT_out/d factor of the power");
    assert_close(slope(&study, &at, 0, "motor_speed"), p / (rate * flow) / (1000.0 * std::f64::consts::PI / 30.0), "dT_out/d speed");
    assert_close(slope(&study, &at, 0, "circuit.water.liquid.density"), -p / (rate * flow) / 1000.0, "dT_out/d density");
    // Limits and outlets by the same rules.
    let derivatives = study.at(&at).unwrap();
    let flow_only = [study.parameter("coolant_flow").unwrap(), study.parameter("coolant_temperature").unwrap()];
    let table = derivatives.jacobian(&[DerivativeTarget::Limit(0), DerivativeTarget::Outlet(0)], &flow_only).unwrap();
    assert_close(table.slopes[0][0], -p / (rate * flow * flow), "d(rise)/dq");
    assert!(table.slopes[0][1].abs() < 1e-11, "the rise follows the inlet: {:e}", table.slopes[0][1]);
    assert_close(table.slopes[1][1], 1.0, "dT_out/dT_in of the channel");
    // A watt into the water anywhere warms the outlet by 1/(rho q c); into the plate likewise.
    let adjoint = derivatives.adjoint(DerivativeTarget::Outlet(0)).unwrap();
    for node in [0, study.model.network.solids - 1, study.model.network.nodes - 1] {
        assert_close(adjoint.field[node], 1.0 / (rate * flow), "K/W");
    }
}

/// In a linear machine, all prescribed temperatures one kelvin higher make every reading one kelvin higher.
#[test]
fn a_shift_of_all_prescribed_temperatures() {
    let study = study_of(
        r#"
name = "linear"
[part.plate]
material = "aluminium"
box = ["100 mm", "60 mm", "20 mm"]
[part.block]
material = "steel"
box = ["40 mm", "40 mm", "40 mm"]
on = "plate.+z"
[contact.joint]
between = ["block", "plate"]
conductance = "800 W/(m2 K)"
[node.wall]
temperature = "ambient_temperature"
[contact.wall]
between = ["wall", "block.+z"]
total_conductance = "0.4 W/K"
[channel.hole]
in = "plate"
diameter = "8 mm"
film = "2000 W/(m2 K)"
path = [["0 mm", "30 mm", "10 mm"], ["100 mm", "30 mm", "10 mm"]]
[circuit.water]
layout = ["hole"]
liquid = { density = "1000 kg/m3", specific_heat = "4000 J/(kg K)", viscosity = "1 mPa s", conductivity = "0.6 W/(m K)" }
[source.block]
in = "block"
power = "30 W"
[sensor.block]
part = "block"
[sensor.wall]
node = "wall"
[sensor.out]
outlet = "hole"
[sensor.plate]
face = "plate.-z"
"#,
        600,
    );
    let at = condition(&study.model.machine, [1.0, 20.0, 0.0, 30.0]);
    let both = [study.parameter("coolant_temperature").unwrap(), study.parameter("ambient_temperature").unwrap()];
    let table = study.at(&at).unwrap().jacobian(&study.sensors(), &both).unwrap();
    for (name, row) in study.model.network.sensor_names.iter().zip(&table.slopes) {
        assert!((row[0] + row[1] - 1.0).abs() < 1e-10, "{name}: {row:?}");
    }
    assert!(table.slopes[1][0] == 0.0 && (table.slopes[1][1] - 1.0).abs() < 1e-11, "the held node follows what holds it");
}
