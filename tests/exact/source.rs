//! A source that follows its own temperature.

use coldplate::describe::machine::Machine;
use coldplate::solve::meshed::MeshedMachine;

const POWER: f64 = 20.0;
const CONDUCTANCE: f64 = 0.5;
const AMBIENT: f64 = 296.15;
const REFERENCE: f64 = 298.15;

/// P (1 + b (T - T0)) = G (T - Ta).
fn temperature(coefficient: f64) -> f64 {
    (POWER * (1.0 - coefficient * REFERENCE) + CONDUCTANCE * AMBIENT) / (CONDUCTANCE - POWER * coefficient)
}

fn machine(coefficient: f64, place: &str) -> Machine {
    let text = format!(
        r#"
        name = "One node, or one cube, on a wall"
        [variables]
        coolant_flow = "1 L/min"
        coolant_temperature = "20 degC"
        motor_speed = "0 rpm"
        ambient_temperature = "{ambient} degC"
        [chamber]
        temperature = "ambient_temperature"
        [material.copper]
        conductivity = "4e5 W/(m K)"
        density = "8900 kg/m3"
        specific_heat = "385 J/(kg K)"
        {place}
        [node.wall]
        temperature = "ambient_temperature"
        [contact.wall]
        between = ["coil", "wall"]
        conductance = "{film} W/(m2 K)"
        area = "0.01 m2"
        [source.coil]
        in = "coil"
        power = "{POWER} W"
        temperature_coefficient = "{coefficient:?} 1/K"
        reference_temperature = "25 degC"
        [sensor.coil]
        {reads}
        "#,
        ambient = AMBIENT - 273.15,
        film = CONDUCTANCE / 0.01,
        reads = if place.contains("node.coil") { "node = \"coil\"" } else { "part = \"coil\"" },
    );
    Machine::from_text(&text, "source.toml", &[]).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn heat_that_follows_its_own_temperature() {
    let places = [
        "[node.coil]\ncapacity = \"100 J/K\"",
        "[part.coil]\nmaterial = \"copper\"\nbox = [\"30 mm\", \"30 mm\", \"30 mm\"]\nsurface = \"none\"",
    ];
    for place in places {
        for coefficient in [0.0039, -0.03, 0.0, 0.012] {
            let model = MeshedMachine::new(machine(coefficient, place), Some(60)).unwrap();
            let condition = model.machine.condition(&[]).unwrap();
            let state = model.solve(&model.solver(&condition).unwrap(), &condition).unwrap();
            let found = model.network.sensors[0].read(&state.solution.temperatures, &state.load);
            let exact = temperature(coefficient);
            println!("{coefficient}: {found:.6} K, exactly {exact:.6} K");
            assert!((found - exact).abs() < 5e-4, "{coefficient}: {found} {exact}");
            let heat = POWER * (1.0 + coefficient * (exact - REFERENCE));
            let balance = &state.solution.balance;
            assert!((balance.sources[0] - heat).abs() < 1e-3 * heat && balance.relative < 1e-8, "{balance:?}");
        }
    }
}

/// A loss that grows faster with the temperature than heat can leave has no steady state, and none is invented.
#[test]
fn runaway_is_an_error() {
    let model = MeshedMachine::new(machine(0.05, "[node.coil]\ncapacity = \"100 J/K\""), None).unwrap();
    let condition = model.machine.condition(&[]).unwrap();
    let error = model.solver(&condition).unwrap_err();
    assert!(error.remedy().unwrap().contains("grows with its own temperature"), "{error}");
}
