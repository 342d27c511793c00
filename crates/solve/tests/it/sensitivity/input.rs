//! Names that do not exist, things that do not vary, ends of ranges, and values written back.

use coldplate_solve::sensitivity::DerivativeTarget;
use coldplate_solve::study::ParameterKind;

use crate::sensitivity::common::{EVERYTHING, condition, readings, study, study_of};

#[test]
fn refusals_say_what_to_do() {
    let study = study("spindle", 800);
    for (name, needles) in [
        ("contact.clamp.conductanse", &["neither", "did you mean 'contact.clamp.conductance'"][..]),
        ("coolant_flw", &["did you mean 'coolant_flow'"]),
        ("mesh.cells", &["counts something", "--set"]),
        ("contact.tool.bonded", &["does not vary continuously"]),
        ("part.shaft.material", &["is a word"]),
        ("contact.foot.rough", &["is a table", "contact.foot.rough.KEY"]),
        ("channel.long.path", &["is a list of lists", "channel.long.path[1][2]"]),
        ("circuit.water.layout", &["is a list of lists"]),
        ("contact.tool.between", &["is a list of names"]),
        ("contact..x", &["not a key"]),
    ] {
        let message = study.parameter(name).unwrap_err().to_string();
        assert!(needles.iter().all(|n| message.contains(n)), "{name}: {message}");
    }
    let at = study.at(&condition(&study.model.machine, [3.0, 20.0, 2000.0, 22.0])).unwrap();
    let message = at.target("moto").unwrap_err().to_string();
    assert!(message.contains("did you mean 'motor'"), "{message}");
    assert_eq!(at.target("long").unwrap(), DerivativeTarget::Outlet(1));
    assert_eq!(at.target("bearing over pedestal").unwrap(), DerivativeTarget::Limit(2));
}

#[test]
fn what_does_not_matter_is_idle() {
    let study = study("rig", 800);
    let at = study.at(&condition(&study.model.machine, [1.998, 26.0, 2500.0, 28.5])).unwrap();
    let names = ["material.motor.density", "limit.motor shell.maximum", "variables.coolant_flow.default", "coolant_flow"];
    let parameters: Vec<_> = names.iter().map(|n| study.parameter(n).unwrap()).collect();
    let table = at.jacobian(&study.sensors(), &parameters).unwrap();
    assert_eq!(table.idle, [true, true, true, false]);
    assert!(table.slopes.iter().all(|row| row[..3] == [0.0; 3]));
}

/// Where a value may only grow or only shrink the difference is one-sided: still the derivative.
#[test]
fn ends_of_ranges() {
    // The pressure of a perfect vacuum. Without a gap to cross, the film of the gas is in proportion to it.
    let text = EVERYTHING.replace("pressure = \"2 Pa\"", "pressure = \"0 Pa\"\ngap = \"1 nm\"");
    let study = study_of(&text, 800);
    let at = condition(&study.model.machine, [2.6, 20.0, 1000.0, 10.0]);
    let pressure = study.parameter("chamber.pressure").unwrap();
    let slopes = study.at(&at).unwrap().jacobian(&study.sensors(), std::slice::from_ref(&pressure)).unwrap().slopes;
    let step = 0.01;
    let f = [0.0, 1.0, 2.0, 3.0].map(|k| readings(&study.with(&[(&pressure, k * step)]).unwrap(), &at));
    for (s, slope) in slopes.iter().enumerate() {
        let difference = (-11.0 * f[0][s] + 18.0 * f[1][s] - 9.0 * f[2][s] + 2.0 * f[3][s]) / (6.0 * step);
        println!("{:e} {difference:e}", slope[0]);
        assert!((slope[0] - difference).abs() < 3e-6 * difference.abs().max(1e-3), "{slope:?} {difference}");
    }
    // The end of a pressure table, from inside.
    let text = EVERYTHING.replace("pressure = \"0.4 MPa\"", "pressure = \"1 MPa\"");
    let study = study_of(&text, 800);
    let slope = study.at(&at).unwrap().jacobian(&study.sensors(), &[study.parameter("contact.side.pressure").unwrap()]).unwrap();
    // h = 300 + 600 (p - 0.1 MPa)/0.9 MPa: dT/dp = dT/d(factor on h) x (600/0.9e6)/900.
    let factor = study.at(&at).unwrap().jacobian(&study.sensors(), &[study.parameter("contact.side.pressure_table").unwrap()]).unwrap();
    for (p, f) in slope.slopes.iter().zip(&factor.slopes) {
        assert!((p[0] - f[0] * 600.0 / 0.9e6 / 900.0).abs() < 1e-7 * p[0].abs() + 1e-18, "{p:?} {f:?}");
    }
}

/// A kink between film regimes inside the step is reported, not hidden.
#[test]
fn kinks_are_reported() {
    let study = study("slab", 800);
    let mut low = 0.1;
    let mut high = 2.0;
    let reynolds =
        |flow: f64| study.at(&condition(&study.model.machine, [flow, 20.0, 1000.0, 23.0])).unwrap().state.solution.streams[0].reynolds;
    for _ in 0..40 {
        let middle = f64::midpoint(low, high);
        if reynolds(middle) < 2300.0 { low = middle } else { high = middle }
    }
    // 1.5 steps below the kink: one step stays on its side, two do not.
    let flow = high * (1.0 - 1.5e-3);
    let at = study.at(&condition(&study.model.machine, [flow, 20.0, 1000.0, 23.0])).unwrap();
    let at_kink = at.partial(&study.parameter("coolant_flow").unwrap()).unwrap().uneven;
    let away = study.at(&condition(&study.model.machine, [0.8 * flow, 20.0, 1000.0, 23.0])).unwrap();
    let smooth = away.partial(&study.parameter("coolant_flow").unwrap()).unwrap().uneven;
    assert!(smooth < 1e-4 && at_kink > 10.0 * smooth, "{at_kink:e} {smooth:e}");
}

#[test]
fn values_are_written_back_as_sets() {
    let study = study("spindle", 800);
    let machine = &study.model.machine;
    let set = |name: &str, value: f64| study.parameter(name).unwrap().to_set(value, machine).unwrap();
    assert_eq!(set("contact.clamp.conductance", 2500.0), Some(("contact.clamp.conductance".into(), "\"2500.0 W/(m2 K)\"".into())));
    assert_eq!(set("node.motor.area", 0.05).unwrap().1, "\"0.05 m2\"");
    assert_eq!(set("coolant_flow", 1.0), None);
    assert_eq!(set("source.windings.power", 1.5).unwrap().1, "\"(5 + 0.01 * motor_speed_rpm) * 1.5\"");
    assert_eq!(set("circuit.water.flow", 0.9).unwrap().1, "{ formula = \"(coolant_flow_L_min) * 0.9\", unit = \"L/min\" }");
    assert_eq!(set("chamber.temperature", -0.5).unwrap().1, "{ formula = \"(ambient_temperature_K) + (-0.5)\", unit = \"K\" }");
    let scaled = set("material.spindle steel.conductivity", 2.0).unwrap().1;
    assert_eq!(scaled, "[[\"0 degC\", \"29.2 W/(m K)\"], [\"100 degC\", \"32.4 W/(m K)\"]]");
    // And each of them is read again with that value.
    for name in ["source.windings.power", "circuit.water.flow", "chamber.temperature", "material.spindle steel.conductivity", "grease"] {
        let parameter = study.parameter(name).unwrap();
        let value = if parameter.kind == ParameterKind::Offset { 0.0 } else { 1.0 };
        assert!(parameter.value == value || parameter.kind == ParameterKind::Condition, "{name}");
        study.with(&[(&parameter, value)]).unwrap();
    }
    let twice = study
        .with(&[
            (&study.parameter("contact.clamp.conductance").unwrap(), 2500.0),
            (&study.parameter("contact.balls.total_conductance").unwrap(), 2.0),
        ])
        .unwrap();
    assert_eq!(twice.parameter("contact.clamp.conductance").unwrap().value, 2500.0);
    assert_eq!(twice.parameter("contact.balls.total_conductance").unwrap().value, 2.0);
}
