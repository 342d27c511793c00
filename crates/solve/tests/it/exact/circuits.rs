//! Branches with a given flow, and circuits fed by others: mixing junctions and series against the balance of enthalpy.

use coldplate_base::units::ZERO_CELSIUS;
use coldplate_describe::machine::{Condition, Machine};
use coldplate_network::Load;
use coldplate_solve::transient::{StepSettings, Transient};

use crate::bench::{self, CONDITION, Solved, check, solve};

/// Four plates that give all their heat, 50, 100, 150 and 200 W, into their channels a, b, c and d.
fn plates(circuits: &str) -> String {
    let mut text = String::from("[material.metal]\nconductivity = \"200 W/(m K)\"\n");
    for (i, name) in ["a", "b", "c", "d"].into_iter().enumerate() {
        text += &format!(
            r#"
            [part.{name}]
            material = "metal"
            box = ["0.2 m", "40 mm", "20 mm"]
            at = ["0 mm", "{y} mm", "0 mm"]
            surface = "none"
            [source.{name}]
            in = "{name}"
            power = "{power} W"
            [channel.{name}]
            in = "{name}"
            diameter = "8 mm"
            path = [["0 mm", "20 mm", "10 mm"], ["200 mm", "20 mm", "10 mm"]]
            [sensor.{name}]
            outlet = "{name}"
            "#,
            y = 100 * i,
            power = 50 * (i + 1)
        );
    }
    // 4 kJ/(kg K) at 1000 kg/m3: 66.67 W/K at 1 L/min.
    let liquid = "dissipation = false\nliquid = { density = \"1000 kg/m3\", specific_heat = \"4000 J/(kg K)\", viscosity = \"1 mPa s\", conductivity = \"0.6 W/(m K)\" }";
    text + &circuits.replace("LIQUID", liquid)
}

/// Capacity rate of 1 L/min, W/K.
const RATE: f64 = 4e6 / 6e4;

fn outlets(run: &Solved, expected: [f64; 4], what: &str) {
    for (name, exact) in ["a", "b", "c", "d"].into_iter().zip(expected) {
        check("own", &format!("{what}: outlet of '{name}', degC"), run.celsius(name), exact, exact - 15.0, 1e-9);
    }
    assert!(run.state.solution.balance.relative < 1e-9, "{:?}", run.state.solution.balance);
}

/// 3 L/min: half of it through a, 0.6 L/min through b, the rest through c, all of it through d.
#[test]
fn branches_with_a_given_flow() {
    let circuit = |branches: &str| {
        plates(&format!("[circuit.water]\nflow = \"3 L/min\"\nlayout = [[\"a\", \"b\", \"c\"], \"d\"]\nbranches = {branches}\nLIQUID"))
    };
    for given in [
        "{ a = 0.5, b = \"0.6 L/min\" }",
        "{ a = \"50 %\", b = { formula = \"0.03 * coolant_temperature_degC\", unit = \"L/min\" } }",
        "{ c = 0.3, a = \"coolant_temperature_degC / 40\" }",
    ] {
        let run = solve(&circuit(given), 0.01);
        let exact = [20.0 + 50.0 / RATE / 1.5, 20.0 + 100.0 / RATE / 0.6, 20.0 + 150.0 / RATE / 0.9, 20.0 + 500.0 / RATE / 3.0];
        outlets(&run, exact, "given branches");
    }
    // Two that are alike share what a third leaves; one that gets nothing stands still.
    let run = solve(&circuit("{ b = 0.2 }"), 0.01);
    let exact = [20.0 + 50.0 / RATE / 1.2, 20.0 + 100.0 / RATE / 0.6, 20.0 + 150.0 / RATE / 1.2, 20.0 + 500.0 / RATE / 3.0];
    outlets(&run, exact, "branches that share the rest");
    let refused = [
        ("{ e = 0.2 }", "no channel 'e'"),
        ("{ d = 0.2 }", "no branch"),
        ("{ a = 0.2, b = 0.3, c = 0.5 }", "leave one out"),
        ("{ a = 1.2 }", "from 0 to 1"),
        ("{ a = \"2 W\" }", "neither a share nor a flow"),
        ("{ a = \"-1 L/min\" }", "not negative"),
    ];
    for (given, words) in refused {
        let error = read(&circuit(given)).expect_err(given);
        assert!(error.contains(words) && error.contains("circuit.water.branches"), "{given}: {error}");
    }
    let model = bench::model(&circuit("{ a = \"2 L/min\", b = \"coolant_temperature_degC / 40\" }"), 0.01);
    let error = model.solver(&model.machine.condition(&CONDITION).unwrap()).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("more than flows in") && error.contains("circuit.water"), "{error}");
}

fn read(text: &str) -> Result<Machine, String> {
    let material = "conductivity = \"200 W/(m K)\"\ndensity = \"7900 kg/m3\"\nspecific_heat = \"500 J/(kg K)\"";
    let text = format!("name = \"case\"\n{}", text.replace("conductivity = \"200 W/(m K)\"", material));
    Machine::from_text(&text, "case.toml", &[]).map_err(|e| e.to_string())
}

/// Hot 2 L/min at 40 degC through a, cold 1 L/min at 20 degC through b, mixed through c, and on through d.
const JUNCTION: &str = r#"
    [circuit.last]
    from = "mixed"
    layout = ["d"]
    dissipation = false
    [circuit.mixed]
    from = ["hot", "cold"]
    layout = ["c"]
    dissipation = false
    [circuit.hot]
    flow = "2 L/min"
    inlet_temperature = "40 degC"
    layout = ["a"]
    LIQUID
    [circuit.cold]
    flow = "1 L/min"
    layout = ["b"]
    LIQUID
"#;

#[test]
fn a_mixing_junction_and_a_series() {
    let run = solve(&plates(JUNCTION), 0.01);
    let (a, b) = (40.0 + 50.0 / RATE / 2.0, 20.0 + 100.0 / RATE);
    let c = (2.0 * a + b) / 3.0 + 150.0 / RATE / 3.0;
    outlets(&run, [a, b, c, c + 200.0 / RATE / 3.0], "junction");
    // Of what leaves the junction 1.2 L/min go on; the rest leaves the machine.
    let part = solve(&plates(&JUNCTION.replacen("from = \"mixed\"", "from = \"mixed\"\nflow = \"1.2 L/min\"", 1)), 0.01);
    outlets(&part, [a, b, c, c + 200.0 / RATE / 1.2], "part of a junction");
    // Two circuits from one; a sensor at the inlet of one reads what leaves the other.
    let two = r#"
        [circuit.first]
        flow = "3 L/min"
        layout = [["a", "b"]]
        branches = { a = 0.25 }
        LIQUID
        [circuit.left]
        from = "first"
        flow = "1 L/min"
        layout = ["c"]
        dissipation = false
        [circuit.right]
        from = "first"
        flow = "2 L/min"
        layout = ["d"]
        dissipation = false
    "#;
    let run = solve(&plates(two), 0.01);
    let mix = 20.0 + 150.0 / RATE / 3.0;
    outlets(&run, [20.0 + 50.0 / RATE / 0.75, 20.0 + 100.0 / RATE / 2.25, mix + 150.0 / RATE, mix + 200.0 / RATE / 2.0], "two from one");
    let inlet = solve(&(plates(JUNCTION) + "[sensor.between]\ninlet = \"d\""), 0.01);
    check("own", "inlet of a circuit that another feeds, degC", inlet.celsius("between"), c, c - 20.0, 1e-9);
}

/// Enthalpy of water (J/kg) from 20 degC to a temperature (degC): Simpson's rule on the specific heat, on each side of the temperatures
/// at which its polynomials join.
fn enthalpy(celsius: f64) -> f64 {
    let specific = |t: f64| coldplate_physics::water::water(t + ZERO_CELSIUS).unwrap().specific_heat;
    let piece = |from: f64, to: f64| {
        let step = (to - from) / 200.0;
        let at = |i: usize| specific((from + step * i as f64).clamp(from.min(to), from.max(to)));
        (0..100).map(|i| step / 3.0 * (at(2 * i) + 4.0 * at(2 * i + 1) + at(2 * i + 2))).sum::<f64>()
    };
    let cuts = [20.0, if celsius < 20.0 { 5.0 } else { 40.0 }];
    let turn = if celsius < 20.0 { celsius.max(cuts[1]) } else { celsius.min(cuts[1]) };
    piece(cuts[0], turn) + piece(turn, celsius)
}

/// Mass flow (kg/s) of 1 L/min of water that enters at a temperature (degC).
fn mass_flow(celsius: f64) -> f64 {
    coldplate_physics::water::water(celsius + ZERO_CELSIUS).unwrap().density / 6e4
}

/// Real water with heat of friction: nothing is lost at a junction of 5 and 95 degC, nor of 20 and 40 degC.
#[test]
fn water_mixes_by_enthalpy() {
    for (hot, cold) in [(40.0, 20.0), (95.0, 5.0)] {
        let text = plates(&JUNCTION.replace("LIQUID", "").replace("dissipation = false", ""))
            .replace("\"40 degC\"", &format!("\"{hot} degC\""))
            .replace("flow = \"1 L/min\"", &format!("flow = \"1 L/min\"\ninlet_temperature = \"{cold} degC\""));
        let run = solve(&text, 0.01);
        let [m_hot, m_cold] = [2.0 * mass_flow(hot), mass_flow(cold)];
        let friction = run.state.solution.streams[2].dissipation * 0.2;
        let given = m_hot * enthalpy(run.celsius("a")) + m_cold * enthalpy(run.celsius("b")) + 150.0 + friction;
        let found = (m_hot + m_cold) * enthalpy(run.celsius("c"));
        check("own", &format!("heat behind a junction of {hot} and {cold} degC, W"), found, given, given.abs() + 1e3, 1e-9);
        let balance = &run.state.solution.balance;
        assert!(balance.relative < 1e-9, "{balance:?}");
    }
}

/// Water that enters at 3 degC and takes all the heat of a plate: enthalpy rises by P/m, at rest and after a long time, in one channel
/// and through a split and its junction.
#[test]
fn the_rise_of_water_follows_its_enthalpy() {
    // Water passes in a second, so the steps over time follow the plates.
    for (flow, layout, powers) in [(0.96, "\"a\"", 2000.0), (3.0, "[\"a\", \"b\"], [\"c\", \"d\"]", 2450.0)] {
        let rest = if layout.len() > 3 { "" } else { "[circuit.rest]\nflow = \"1 L/min\"\nlayout = [\"b\", \"c\", \"d\"]\n" };
        let water = format!(
            "[circuit.water]\nflow = \"{flow} L/min\"\ninlet_temperature = \"3 degC\"\nlayout = [{layout}]\ndissipation = false\n{rest}"
        );
        let run = solve(&plates(&water).replace("\"50 W\"", "\"2000 W\""), 0.01);
        let leaves: &[usize] = if rest.is_empty() { &[2, 3] } else { &[0] };
        let carried = |temperatures: &[f64]| -> f64 {
            let out = |s: &usize| {
                let outlet = temperatures[run.model.network.streams[*s].outlet() as usize];
                run.state.solution.streams[*s].mass_flow * (enthalpy(outlet - ZERO_CELSIUS) - enthalpy(3.0))
            };
            leaves.iter().map(out).sum()
        };
        check("own", "rise of the enthalpy of water from 3 degC, W", carried(&run.state.solution.temperatures), powers, powers, 1e-9);
        assert!(run.celsius("a") > 25.0 || rest.is_empty());
        assert!(run.state.solution.balance.relative < 1e-9, "{:?}", run.state.solution.balance);
        let mut transient = Transient::new(&run.model.network, StepSettings { tolerance: 1e-4, ..StepSettings::default() }).unwrap();
        let mut state = transient.uniform(&run.state.load, 3.0 + ZERO_CELSIUS);
        transient.advance(&mut state, 40_000.0, &|_| Ok(run.state.load.clone()), &mut |_, _| Ok(())).unwrap();
        assert!(state.energy.relative() < 1e-9, "{:?}", state.energy);
        check("own", "rise of the enthalpy of water after long, W", carried(&state.temperatures), powers, powers, 1e-6);
    }
}

#[test]
fn feeds_that_cannot_be() {
    let with = |from: &str, to: &str| read(&plates(&JUNCTION.replacen(from, to, 1))).expect_err(to);
    for (from, to, words) in [
        ("inlet_temperature = \"40 degC\"", "from = \"last\"", "circle"),
        ("from = \"mixed\"", "from = \"last\"", "circle"),
        ("from = \"mixed\"", "from = \"mixt\"", "did you mean 'mixed'"),
        ("from = \"mixed\"", "from = [\"mixed\", \"mixed\"]", "twice"),
        ("from = \"mixed\"", "from = []", "no circuit is named"),
        ("from = \"mixed\"", "from = \"mixed\"\ninlet_temperature = \"20 degC\"", "another circuit"),
        ("from = \"mixed\"", "from = \"mixed\"\nliquid = \"water\"", "another liquid"),
    ] {
        let error = with(from, to);
        assert!(error.contains(words) && error.contains("circuit."), "{to}: {error}");
    }
    for (flow, words) in [("flow = \"3.5 L/min\"", "'mixed' feeds take more"), ("flow = \"1 - coolant_temperature_degC\"", "negative")] {
        let model = bench::model(&plates(&JUNCTION.replacen("from = \"mixed\"", &format!("from = \"mixed\"\n{flow}"), 1)), 0.01);
        let error = Load::at(&model.machine, &model.machine.condition(&CONDITION).unwrap()).unwrap_err().to_string();
        assert!(error.contains(words), "{flow}: {error}");
    }
}

/// Over time the junction comes to its steady state, and heat is kept, all of it going on or a part.
#[test]
fn a_junction_over_time() {
    for flow in ["", "flow = \"1.2 L/min\""] {
        let text = plates(&JUNCTION.replacen("from = \"mixed\"", &format!("from = \"mixed\"\n{flow}"), 1));
        let run = solve(&text, 0.01);
        let mut transient = Transient::new(&run.model.network, StepSettings { tolerance: 1e-4, ..StepSettings::default() }).unwrap();
        let mut state = transient.uniform(&run.state.load, 20.0 + ZERO_CELSIUS);
        transient.advance(&mut state, 20_000.0, &|_| Ok(run.state.load.clone()), &mut |_, _| Ok(())).unwrap();
        assert!(state.energy.relative() < 1e-9, "{flow}: {:?}", state.energy);
        for (s, sensor) in run.model.network.sensors.iter().enumerate() {
            let (found, steady) =
                (sensor.read(&state.temperatures, &run.state.load), sensor.read(&run.state.solution.temperatures, &run.state.load));
            check("own", &format!("junction after long, outlet {s}, K"), found, steady, 10.0, 1e-6);
        }
    }
}

/// Channels that exchange nothing: a ramp of 0.1 K/s at the first inlet comes out of the third circuit as late as water needs
/// for three of them.
#[test]
fn a_ramp_passes_from_circuit_to_circuit() {
    let circuits = r#"
        [variables]
        time = { unit = "s", default = "0 s" }
        [circuit.first]
        flow = "1 L/min"
        inlet_temperature = "20 + 0.1 * time_s"
        layout = ["a"]
        LIQUID
        [circuit.second]
        from = "first"
        layout = ["b"]
        dissipation = false
        [circuit.third]
        from = "second"
        layout = ["c"]
        dissipation = false
        [circuit.fourth]
        flow = "1 L/min"
        layout = ["d"]
        LIQUID
    "#;
    let text = plates(circuits).replace("diameter = \"8 mm\"", "diameter = \"8 mm\"\nfilm = \"1e-9 W/(m2 K)\"");
    let model = bench::model(&text.replace("power = \"", "power = \"0 W\" # \""), 0.01);
    let condition = model.machine.condition(&CONDITION).unwrap();
    let load = |time: f64| {
        let mut si = condition.si().to_vec();
        si[4] = time;
        Load::at(&model.machine, &Condition::from_si(si))
    };
    let mut transient = Transient::new(&model.network, StepSettings { tolerance: 1e-3, longest: 1.0, ..StepSettings::default() }).unwrap();
    let mut state = transient.uniform(&load(0.0).unwrap(), 20.0 + ZERO_CELSIUS);
    let volume = std::f64::consts::PI / 4.0 * 0.008f64.powi(2) * 0.2;
    transient.advance(&mut state, 12.0, &load, &mut |_, _| Ok(())).unwrap();
    transient.advance(&mut state, 40.0, &load, &mut |_, _| Ok(())).unwrap();
    for (s, channels) in [(0, 1.0), (1, 2.0), (2, 3.0)] {
        let found = state.temperatures[model.network.streams[s].outlet() as usize] - ZERO_CELSIUS;
        let late = channels * volume / (1e-3 / 60.0);
        check("own", &format!("ramp after {channels} circuits, degC"), found, 20.0 + 0.1 * (40.0 - late), 4.0, 1e-6);
    }
}
