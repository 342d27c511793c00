//! Sources: one that follows its own temperature, heat per volume, in one block, and varying in space.

use coldplate_describe::machine::Machine;
use coldplate_solve::meshed::MeshedMachine;

use crate::bench::{self, solve};

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

const LENGTH: f64 = 0.1;
const SECTION: f64 = 1e-4;
const K: f64 = 20.0;

/// A rod held at 20 degC at its low end, of two blocks of 60 and 40 mm, with one source.
fn rod(source: &str) -> String {
    format!(
        r#"
        [material.steel]
        conductivity = "{K} W/(m K)"
        [part.rod]
        material = "steel"
        surface = "none"
        at = ["5 mm", "0 mm", "0 mm"]
        blocks = [
            {{ box = ["60 mm", "10 mm", "10 mm"] }},
            {{ box = ["40 mm", "10 mm", "10 mm"], at = ["60 mm", "0 mm", "0 mm"] }},
        ]
        [boundary.held]
        faces = ["rod.-x"]
        temperature = "20 degC"
        [source.heat]
        {source}
        [sensor.end]
        face = "rod.+x"
        "#
    )
}

/// 2e6 W/m3 in the second block: q/k (L2²/2 + L2 L1) at the insulated end; the same per machine variable, and in both.
#[test]
fn heat_per_volume_and_in_one_block() {
    let q = 2e6;
    let (first, second) = (0.06, 0.04);
    let of_second = q / K * (second * second / 2.0 + second * first);
    let cases = [
        ("in = \"rod[2]\"\npower_density = \"2e6 W/m3\"", of_second, q * SECTION * second),
        ("in = \"rod[2]\"\npower_density = \"2 W/cm3\"", of_second, q * SECTION * second),
        ("in = \"rod[2]\"\npower_density = \"1e5 * coolant_temperature_degC\"", of_second, q * SECTION * second),
        ("in = \"rod[2]\"\npower = \"8 W\"", of_second, 8.0),
        ("in = \"rod\"\npower_density = \"2e6 W/m3\"", q * LENGTH * LENGTH / (2.0 * K), q * SECTION * LENGTH),
        ("in = [\"rod[1]\", \"rod[2]\"]\npower_density = \"2e6 W/m3\"", q * LENGTH * LENGTH / (2.0 * K), q * SECTION * LENGTH),
    ];
    for (source, rise, watts) in cases {
        // Cells of one width: what a cell's middle misses of a parabola its balanced surface gives back.
        let found = [2e-3, 1e-3].map(|size| solve(&rod(source), size));
        let errors = found.each_ref().map(|solved| solved.celsius("end") - 20.0 - rise);
        println!("{source}: {errors:?} of {rise}");
        assert!(
            errors[1].abs() < 2e-4 * rise && errors[1].abs() < 0.3 * errors[0].abs().max(1e-9 * rise),
            "{source}: {errors:?} of {rise}"
        );
        assert!((found[1].state.solution.balance.sources[0] - watts).abs() < 1e-12 * watts, "{source}");
    }
}

/// 8 W shared as exp(-x/a): P/(kA) (a (1 - e) - L e)/(1 - e) at the insulated end, e = exp(-L/a).
#[test]
fn heat_that_varies_in_space() {
    let a: f64 = 0.025;
    let e = (-LENGTH / a).exp();
    let rise = 8.0 / (K * SECTION) * (a * (1.0 - e) - LENGTH * e) / (1.0 - e);
    let text = rod("in = \"rod\"\npower = \"8 W\"\ndistribution = \"exp(-x_mm / 25)\"");
    let errors = [2e-3, 1e-3].map(|size| solve(&text, size).celsius("end") - 20.0 - rise);
    println!("{errors:?} of {rise}");
    assert!(errors[1].abs() < 2e-4 * rise && (errors[0] / errors[1] - 4.0).abs() < 0.2, "{errors:?} of {rise}");
    // Even is even.
    let even = ["", "distribution = \"3\""].map(|d| solve(&rod(&format!("in = \"rod\"\npower = \"8 W\"\n{d}")), 2e-3).celsius("end"));
    assert!((even[0] - even[1]).abs() < 1e-10, "{even:?}");
}

#[test]
fn sources_that_cannot_be() {
    let refused = [
        ("in = \"rod[3]\"\npower = \"8 W\"", "no block number 3"),
        ("in = [\"rod\", \"rod[2]\"]\npower = \"8 W\"", "named twice"),
        ("in = \"rod\"", "power_density"),
        ("in = \"rod\"\npower = \"8 W\"\npower_density = \"1 W/m3\"", "power_density"),
        ("in = \"rod.+x\"\npower_density = \"1 W/m3\"", "no volume"),
        ("in = \"rod\"\npower_density = \"1 W\"", "W/m3"),
        ("in = \"rod\"\npower_density = \"1 W/m3\"\ndistribution = \"x_mm\"", "shares a total"),
        ("in = \"rod\"\npower = \"1 W\"\ndistribution = \"x\"", "x_mm"),
    ];
    for (source, words) in refused {
        let text = format!(
            "name = \"case\"\n{}",
            rod(source).replace("W/(m K)\"", "W/(m K)\"\ndensity = \"7900 kg/m3\"\nspecific_heat = \"500 J/(kg K)\"")
        );
        let error = Machine::from_text(&text, "case.toml", &[]).expect_err(source).to_string();
        assert!(error.contains(words) && error.contains("source.heat"), "{source}: {error}");
    }
    let machine = bench::machine(&rod("in = \"rod\"\npower = \"1 W\"\ndistribution = \"x_mm - 50\""));
    let error = MeshedMachine::new(machine, Some(100)).unwrap_err().to_string();
    assert!(error.contains("negative") && error.contains("source.heat.distribution"), "{error}");
}
