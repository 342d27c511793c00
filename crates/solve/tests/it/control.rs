//! Controllers against closed forms: one node of capacity C that loses G to a node of given temperature.

use coldplate_base::units::ZERO_CELSIUS;
use coldplate_describe::machine::Machine;
use coldplate_network::Load;
use coldplate_solve::meshed::{MeshedMachine, SteadyState};
use coldplate_solve::transient::{StepSettings, Transient, TransientState};

const CAPACITY: f64 = 2000.0;
const LOSS: f64 = 4.0;
const POWER: f64 = 120.0;
const AMBIENT: f64 = 20.0;

/// Nodes `block`, and `other` where a second one is asked for, on a wall of 20 degC; lines of controllers and sources behind.
fn machine(lines: &str) -> MeshedMachine {
    let second = if lines.contains("other") {
        "[node.other]\ncapacity = \"1000 J/K\"\n[sensor.other]\nnode = \"other\"\n\
         [contact.other]\nbetween = [\"other\", \"wall\"]\ntotal_conductance = \"2 W/K\"\n\
         [contact.joint]\nbetween = [\"block\", \"other\"]\ntotal_conductance = \"1 W/K\"\n"
    } else {
        ""
    };
    let text = format!(
        "name = \"One block on a wall\"\n[node.block]\ncapacity = \"{CAPACITY} J/K\"\n[node.wall]\ntemperature = \"{AMBIENT} degC\"\n\
         [contact.block]\nbetween = [\"block\", \"wall\"]\ntotal_conductance = \"{LOSS} W/K\"\n[sensor.block]\nnode = \"block\"\n{second}{lines}"
    );
    MeshedMachine::new(Machine::from_text(&text, "control.toml", &[]).unwrap_or_else(|e| panic!("{e}")), None).unwrap()
}

/// Heater of the block with lines of its controller.
fn heater(controller: &str) -> String {
    format!(
        "[source.heater]\nin = \"block\"\npower = \"{POWER} W\"\ncontroller = \"loop\"\n[controller.loop]\nsensor = \"block\"\n{controller}\n"
    )
}

fn thermostat(set_point: f64, hysteresis: f64) -> MeshedMachine {
    machine(&heater(&format!("set_point = \"{set_point} degC\"\nhysteresis = \"{hysteresis} K\"")))
}

fn leading(set_point: f64, gain: f64, integral_time: f64) -> MeshedMachine {
    machine(&heater(&format!("set_point = \"{set_point} degC\"\ngain = \"{gain} 1/K\"\nintegral_time = \"{integral_time} s\"")))
}

fn steady(model: &MeshedMachine) -> SteadyState {
    let condition = model.machine.condition(&[]).unwrap();
    model.steady(&condition).unwrap_or_else(|e| panic!("{e}"))
}

fn degc(model: &MeshedMachine, state: &TransientState, node: usize) -> f64 {
    state.temperatures[model.mesh.cells + node] - ZERO_CELSIUS
}

/// Temperatures of the block at the ends of all steps from `from` degC until a time, s, each with its time and share.
fn course(model: &MeshedMachine, from: Option<f64>, until: f64, tolerance: f64) -> (Vec<(f64, f64, f64)>, TransientState) {
    let condition = model.machine.condition(&[]).unwrap();
    let load = |_: f64| Load::at(&model.machine, &condition);
    let settings = StepSettings { tolerance, ..StepSettings::default() };
    let mut transient = Transient::new(&model.network, settings).unwrap();
    let first = load(0.0).unwrap();
    let mut state = match from {
        Some(from) => transient.uniform(&first, from + ZERO_CELSIUS),
        None => transient.from_steady(&first).unwrap(),
    };
    let mut seen = Vec::new();
    let mut note = |state: &TransientState, _: &Load| {
        seen.push((state.time, degc(model, state, 0), state.controls[0].share));
        Ok(())
    };
    transient.advance(&mut state, until, &load, &mut note).unwrap_or_else(|e| panic!("{e}"));
    assert!(state.energy.relative() < 1e-8, "energy is open by {:e}", state.energy.relative());
    (seen, state)
}

/// Steady: at the set point with the share G (T - Ta)/P, or at a limit of the controller, for both laws.
#[test]
fn a_steady_state_is_at_the_set_point_or_at_a_limit() {
    for (set_point, share) in [(35.0, 0.5), (60.0, 1.0), (10.0, 0.0), (20.0, 0.0), (23.0, 0.1)] {
        for model in [thermostat(set_point, 1.0), leading(set_point, 0.2, 300.0)] {
            let state = steady(&model);
            let found = state.solution.temperatures[model.mesh.cells] - ZERO_CELSIUS;
            let expected = AMBIENT + share * POWER / LOSS;
            assert!((found - expected).abs() < 1e-6, "{set_point}: {found} degC, {expected} degC");
            assert!((state.solution.shares[0] - share).abs() < 1e-7, "{set_point}: {:?}", state.solution.shares);
            assert!((state.load.powers[0] - share * POWER).abs() < 1e-5 && state.solution.balance.relative < 1e-8);
        }
    }
}

/// A cooler: negative power, more of it above the set point. Beside it a heat of 60 W.
#[test]
fn a_cooler_takes_what_is_too_much() {
    let lines = "[source.heat]\nin = \"block\"\npower = \"60 W\"\n[source.cooler]\nin = \"block\"\npower = \"-50 W\"\ncontroller = \"cold\"\n\
                 [controller.cold]\nsensor = \"block\"\nset_point = \"25 degC\"\naction = \"cool\"\nhysteresis = \"1 K\"";
    let state = steady(&machine(lines));
    // 4 W/K over 5 K are 20 W: 40 W of 50 W are taken away.
    assert!((state.solution.shares[0] - 0.8).abs() < 1e-7, "{:?}", state.solution.shares);
}

/// Two heaters of two joined nodes: both at their set points; or one at its limit while the other holds its own.
#[test]
fn two_controllers_at_once() {
    let lines = |second: f64| {
        heater("set_point = \"30 degC\"\ngain = \"0.1 1/K\"\nintegral_time = \"100 s\"")
            + &format!(
                "[source.second]\nin = \"other\"\npower = \"50 W\"\ncontroller = \"second\"\n\
                 [controller.second]\nsensor = \"other\"\nset_point = \"{second} degC\"\nhysteresis = \"2 K\""
            )
    };
    let state = steady(&machine(&lines(35.0)));
    // Block: 4 (30 - 20) - 1 (35 - 30); other: 2 (35 - 20) + 1 (35 - 30).
    for (share, expected) in state.solution.shares.iter().zip([35.0 / POWER, 35.0 / 50.0]) {
        assert!((share - expected).abs() < 1e-7, "{:?}", state.solution.shares);
    }
    // At full power: 2 (T - 20) + (T - 30) = 50 W give 40 degC, below 60 degC.
    let model = machine(&lines(60.0));
    let state = steady(&model);
    assert!((state.solution.temperatures[model.mesh.cells + 2] - ZERO_CELSIUS - 40.0).abs() < 1e-6);
    assert!((state.solution.shares[0] - 30.0 / POWER).abs() < 1e-7 && state.solution.shares[1] == 1.0, "{:?}", state.solution.shares);
}

/// Conduction in a meshed bar: the sensor at its far end is held through the mesh.
#[test]
fn a_sensor_in_a_mesh_is_held() {
    let text = "name = \"Bar\"\n[part.bar]\nmaterial = \"aluminium 6061\"\nbox = [\"200 mm\", \"40 mm\", \"40 mm\"]\nsurface = \"none\"\n\
        [boundary.cold]\nfaces = [\"bar.-x\"]\nfilm = \"400 W/(m2 K)\"\nfluid_temperature = \"20 degC\"\n\
        [source.heater]\nin = \"bar.+x\"\npower = \"200 W\"\ncontroller = \"loop\"\n[sensor.end]\nface = \"bar.+x\"\n\
        [controller.loop]\nsensor = \"end\"\nset_point = \"50 degC\"\ngain = \"0.05 1/K\"\nintegral_time = \"200 s\"\n";
    let model = MeshedMachine::new(Machine::from_text(text, "bar.toml", &[]).unwrap_or_else(|e| panic!("{e}")), Some(2000)).unwrap();
    let state = steady(&model);
    assert!((model.readings(&state)[0] - 50.0).abs() < 1e-6, "{:?}", model.readings(&state));
    let (_, ended) = course(&model, Some(20.0), 4000.0, 0.002);
    let load = Load::at(&model.machine, &model.machine.condition(&[]).unwrap()).unwrap();
    let reading = model.network.sensors[0].read(&ended.temperatures, &load) - ZERO_CELSIUS;
    assert!(
        (reading - 50.0).abs() < 0.01 && (ended.controls[0].share - state.solution.shares[0]).abs() < 1e-3,
        "{reading} {:?}",
        ended.controls
    );
}

/// A thermostat's period and duty: on for tau ln((Tp - L)/(Tp - H)) and off for tau ln((H - Ta)/(L - Ta)), with Tp = Ta + P/G.
#[test]
fn period_and_duty_of_a_thermostat() {
    let (low, high, tau, hot) = (34.0, 36.0, CAPACITY / LOSS, AMBIENT + POWER / LOSS);
    let (on, off) = (tau * ((hot - low) / (hot - high)).ln(), tau * ((high - AMBIENT) / (low - AMBIENT)).ln());
    let (seen, _) = course(&thermostat(35.0, 2.0), Some(AMBIENT), 2000.0, 1e-4);
    // Ends of stretches of one share.
    let switched: Vec<(f64, f64)> = seen.windows(2).filter(|two| two[0].2 != two[1].2).map(|two| (two[0].0, two[0].2)).collect();
    let first = tau * ((hot - AMBIENT) / (hot - high)).ln();
    assert!(switched.len() > 10 && (switched[0].0 - first).abs() < 0.05, "{switched:?}, {first} s");
    for two in switched.windows(2) {
        let expected = if two[1].1 == 1.0 { on } else { off };
        assert!((two[1].0 - two[0].0 - expected).abs() < 0.02, "{:?}: {} s, {expected} s", two, two[1].0 - two[0].0);
    }
    // The mean heat of a narrow band is the steady one.
    let (seen, ended) = course(&thermostat(35.0, 0.1), None, 2000.0, 1e-3);
    assert!(seen.iter().all(|(_, t, _)| (t - 35.0).abs() < 0.0502), "{seen:?}");
    assert!((ended.energy.entered / 2000.0 - 60.0).abs() < 0.3, "{}", ended.energy.entered / 2000.0);
}

/// A PI controller on a first-order plant: with x = T - set point, x'' + (G + P K)/C x' + P K/(Ti C) x = 0.
#[test]
fn the_response_of_a_pi_controller_has_a_closed_form() {
    for (gain, integral_time) in [(0.04, 300.0), (0.02, 150.0), (0.04, 1000.0)] {
        let set_point = 35.0;
        let (a, b) = ((LOSS + POWER * gain) / CAPACITY, POWER * gain / (integral_time * CAPACITY));
        let start = AMBIENT - set_point;
        let rate = (-(LOSS + POWER * gain) * start - LOSS * (set_point - AMBIENT)) / CAPACITY;
        let exact = |t: f64| {
            let square = 0.25 * a * a - b;
            let (w, decay) = (square.abs().sqrt(), (-0.5 * a * t).exp());
            let slope = (rate + 0.5 * a * start) / w;
            let (c, s) = if square < 0.0 { ((w * t).cos(), (w * t).sin()) } else { ((w * t).cosh(), (w * t).sinh()) };
            set_point + decay * (start * c + slope * s)
        };
        let (seen, ended) = course(&leading(set_point, gain, integral_time), Some(AMBIENT), 20_000.0, 1e-4);
        let free = seen.iter().position(|(_, _, share)| *share <= 0.0 || *share >= 1.0).unwrap_or(seen.len());
        let worst = seen[..free].iter().map(|(t, found, _)| (found - exact(*t)).abs()).fold(0.0, f64::max);
        println!("gain {gain}, {integral_time} s: {worst:.1e} K");
        assert!(free > 20 && worst < 5e-3, "gain {gain}, {integral_time} s: {worst} K in {free} of {} steps", seen.len());
        assert!(
            (degc(&leading(set_point, gain, integral_time), &ended, 0) - set_point).abs() < 1e-3
                && (ended.controls[0].share - 0.5).abs() < 1e-4
        );
    }
}

/// At its limit a PI controller heats fully and its integral stands still; it then overshoots less than one that winds up would.
#[test]
fn a_saturated_integral_stands_still() {
    let (gain, integral_time, set_point) = (0.5, 100.0, 45.0);
    let (seen, _) = course(&leading(set_point, gain, integral_time), Some(AMBIENT), 8000.0, 1e-3);
    let tau = CAPACITY / LOSS;
    let full = |t: f64| AMBIENT + POWER / LOSS * (1.0 - (-t / tau).exp());
    // Full power until K (set point - T) = 1, two kelvin below the set point.
    let until = tau * (POWER / LOSS / (AMBIENT + POWER / LOSS - (set_point - 1.0 / gain))).ln();
    for (t, found, share) in seen.iter().filter(|(t, ..)| *t < until - 1.0) {
        assert!(*share == 1.0 && (found - full(*t)).abs() < 5e-3, "{t} s: {found} degC, {} degC, share {share}", full(*t));
    }
    let highest = seen.iter().map(|(_, t, _)| *t).fold(0.0, f64::max);
    assert!(highest < set_point + 0.6 && (seen.last().unwrap().1 - set_point).abs() < 1e-3, "{highest}");
    // A set point that full power does not reach: the steady state of full power.
    let (seen, ended) = course(&leading(60.0, gain, integral_time), Some(AMBIENT), 8000.0, 1e-3);
    assert!((seen.last().unwrap().1 - AMBIENT - POWER / LOSS).abs() < 1e-3 && ended.controls[0].integral == 0.0, "{:?}", ended.controls);
}

/// From a steady state nothing moves under a PI controller.
#[test]
fn a_steady_state_stays() {
    let (seen, _) = course(&leading(35.0, 0.2, 50.0), None, 5000.0, 1e-3);
    assert!(seen.iter().all(|(_, t, share)| (t - 35.0).abs() < 1e-6 && (share - 0.5).abs() < 1e-6), "{seen:?}");
}

/// Controllers that cannot work are refused, each with its remedy.
#[test]
fn a_controller_that_leads_away_is_refused() {
    let told = |lines: &str| {
        let model = machine(lines);
        model.steady(&model.machine.condition(&[]).unwrap()).unwrap_err().to_string()
    };
    let away = heater("set_point = \"30 degC\"\naction = \"cool\"\nhysteresis = \"1 K\"");
    assert!(told(&away).contains("leads away from its set point"), "{}", told(&away));
    let apart = heater("set_point = \"30 degC\"\nhysteresis = \"1 K\"").replace("sensor = \"block\"", "sensor = \"wall\"")
        + "[sensor.wall]\nnode = \"wall\"\n";
    assert!(told(&apart).contains("does not reach the sensor 'wall'"), "{}", told(&apart));
}
