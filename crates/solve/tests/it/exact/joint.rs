//! Contacts whose conductance follows the condition or the time: two nodes, two bars, a switch that opens and closes.

use coldplate_base::units::ZERO_CELSIUS;
use coldplate_describe::machine::Machine;
use coldplate_network::Load;
use coldplate_solve::Solver;
use coldplate_solve::transient::{StepSettings, Transient};

use crate::bench::{self, check, solve};

/// 12 W through a joint of 5 W/K times 1 + (Tc - 10 K) / 20 K at 20 degC coolant: 7.5 W/K.
#[test]
fn a_joint_follows_the_condition() {
    let text = r#"
        [node.coil]
        [node.plate]
        temperature = "20 degC"
        [contact.joint]
        between = ["coil", "plate"]
        total_conductance = "5 W/K"
        factor = "1 + (coolant_temperature_degC - 10) / 20"
        [source.heat]
        in = "coil"
        power = "12 W"
        [sensor.coil]
        node = "coil"
    "#;
    let run = solve(text, 1.0);
    assert!(run.model.machine.uses(1), "the coolant's temperature is followed by the joint");
    check("own", "node behind a joint that follows the coolant, degC", run.celsius("coil"), 20.0 + 12.0 / 7.5, 1.6, 1e-12);
    assert!((run.contact("joint").0 - 12.0).abs() < 1e-9);
    let record = run.model.record(&run.state);
    assert!((record.contacts["joint"].hA_W_K - 7.5).abs() < 1e-12, "{record:?}");
}

/// Two bars of 0.1 m and 20 W/(m K) between 80 and 20 degC, and between them h(Tc) = 400 W/(m2 K) times Tc / 50 degC.
#[test]
fn a_joint_of_bars_follows_the_condition_under_every_law() {
    let text = |law: &str| {
        format!(
            r#"
        [material.steel]
        conductivity = "20 W/(m K)"
        [part.left]
        material = "steel"
        box = ["0.1 m", "20 mm", "20 mm"]
        surface = "none"
        [part.right]
        material = "steel"
        box = ["0.1 m", "20 mm", "20 mm"]
        on = "left.+x"
        surface = "none"
        [contact.joint]
        between = ["left", "right"]
        {law}
        factor = "coolant_temperature_degC / 50"
        [boundary.hot]
        faces = ["left.-x"]
        temperature = "80 degC"
        [boundary.cold]
        faces = ["right.+x"]
        temperature = "20 degC"
        [sensor.before]
        face = "left.+x"
    "#
        )
    };
    let laws = [
        "conductance = \"400 W/(m2 K)\"",
        "total_conductance = \"0.16 W/K\"",
        "temperature_table = [[\"0 degC\", \"400 W/(m2 K)\"], [\"90 degC\", \"400 W/(m2 K)\"]]",
        "pressure = \"1 MPa\"\npressure_table = [[\"0.1 MPa\", \"400 W/(m2 K)\"], [\"2 MPa\", \"400 W/(m2 K)\"]]",
        "area = \"8 cm2\"\nconductance = \"200 W/(m2 K)\"",
    ];
    for law in laws {
        let run = solve(&text(law), 0.01);
        // 0.4 of the conductance at 20 degC.
        let flux = 60.0 / (0.1 / 20.0 + 1.0 / 160.0 + 0.1 / 20.0);
        check("own", "bars and a joint that follows the coolant, W", run.contact("joint").0, 4e-4 * flux, 4e-4 * flux, 1e-9);
        check("own", "hot side of that joint, degC", run.celsius("before"), 80.0 - flux * 0.1 / 20.0, 60.0, 1e-9);
    }
    for law in ["bonded = true", "insulated = true"] {
        let error = Machine::from_text(&refusable(&text(law)), "case.toml", &[]).unwrap_err().to_string();
        assert!(error.contains("contact.joint.factor") && error.contains("conductance"), "{error}");
    }
    let text = text(laws[0]).replace("coolant_temperature_degC / 50", "20 - coolant_temperature_degC");
    let model = bench::model(&text, 0.01);
    let hot =
        [("coolant_flow", "1 L/min"), ("coolant_temperature", "30 degC"), ("motor_speed", "0 rpm"), ("ambient_temperature", "20 degC")];
    let error = Load::at(&model.machine, &model.machine.condition(&hot).unwrap()).unwrap_err().to_string();
    assert!(error.contains("'joint'") && error.contains("negative"), "{error}");
}

fn refusable(text: &str) -> String {
    let material = "[material.steel]\ndensity = \"7900 kg/m3\"\nspecific_heat = \"500 J/(kg K)\"";
    format!("name = \"case\"\n{}", text.replace("[material.steel]", material))
}

/// C T' = -G (1 + t/500 s) (T - T0): the temperature falls by exp(-G/C (t + t²/1000 s)).
#[test]
fn a_joint_follows_the_time() {
    let text = r#"
        [variables]
        time = { unit = "s", default = "0 s" }
        [node.coil]
        capacity = "1000 J/K"
        [node.plate]
        temperature = "20 degC"
        [contact.joint]
        between = ["coil", "plate"]
        conductance = "500 W/(m2 K)"
        area = "40 cm2"
        factor = "1 + time_s / 500"
        [sensor.coil]
        node = "coil"
    "#;
    let model = bench::model(text, 1.0);
    let condition = model.machine.condition(&bench::CONDITION).unwrap();
    let load = |time: f64| {
        let mut si = condition.si().to_vec();
        si[4] = time;
        Load::at(&model.machine, &coldplate_describe::machine::Condition::from_si(si))
    };
    let mut transient = Transient::new(&model.network, StepSettings { tolerance: 1e-6, ..StepSettings::default() }).unwrap();
    let mut state = transient.uniform(&load(0.0).unwrap(), 60.0 + ZERO_CELSIUS);
    transient.advance(&mut state, 600.0, &load, &mut |_, _| Ok(())).unwrap();
    let exact = 20.0 + 40.0 * f64::exp(-2.0 / 1000.0 * (600.0 + 600.0f64.powi(2) / 1000.0));
    check("own", "node behind a joint that closes with the time, degC", state.temperatures[0] - ZERO_CELSIUS, exact, 40.0, 1e-6);
    assert!(state.energy.relative() < 1e-8, "{:?}", state.energy);
}

/// A thermal switch: closed it conducts a thousand times better than at the reference; open there is no steady state.
#[test]
fn a_joint_opens_and_closes() {
    let text = r#"
        [variables]
        closed = { unit = "1", default = 0.001 }
        [material.steel]
        conductivity = "20 W/(m K)"
        [part.bar]
        material = "steel"
        box = ["0.1 m", "20 mm", "20 mm"]
        surface = "none"
        [node.sink]
        temperature = "20 degC"
        [contact.switch]
        between = ["bar.+x", "sink"]
        conductance = "1e4 W/(m2 K)"
        area = "4 cm2"
        factor = "closed"
        [source.heat]
        in = "bar.-x"
        power = "4 W"
        [sensor.end]
        face = "bar.+x"
    "#;
    let model = bench::model(text, 2e-3);
    let load = |closed: &str| {
        let all: Vec<(&str, &str)> = bench::CONDITION.into_iter().chain([("closed", closed)]).collect();
        Load::at(&model.machine, &model.machine.condition(&all).unwrap()).unwrap()
    };
    let solver = Solver::new(&model.network, &load("0.001")).unwrap();
    for (closed, number) in [("0.001", 1e-3), ("1", 1.0), ("0.05", 0.05)] {
        let solution = solver.steady(&load(closed)).unwrap();
        let end = model.network.sensors[0].read(&solution.temperatures, &load(closed)) - ZERO_CELSIUS;
        check("own", "bar behind a thermal switch, degC", end, 20.0 + 1.0 / number, 1.0 / number, 1e-8);
    }
    for refused in [solver.steady(&load("0")).map(|_| ()), Solver::new(&model.network, &load("0")).map(|_| ())] {
        let error = refused.unwrap_err().to_string();
        assert!(error.contains("no way out of 'bar'"), "{error}");
    }
}
