//! Coolant over time: fronts, the steady state it settles in, and heat that is conserved on the way.

use super::close;
use crate::bench::{CONDITION, model};
use coldplate_base::units::ZERO_CELSIUS;
use coldplate_describe::machine::Machine;
use coldplate_network::Load;
use coldplate_solve::meshed::MeshedMachine;
use coldplate_solve::transient::{StepSettings, Transient};

fn shipped(name: &str, cells: usize) -> MeshedMachine {
    let path = coldplate_testing::root().join("machines").join(name);
    MeshedMachine::new(Machine::read(&path, &[]).unwrap_or_else(|e| panic!("{e}")), Some(cells)).unwrap_or_else(|e| panic!("{e}"))
}

/// Long after the start every machine is where the steady solver says, from a uniform temperature and from another
/// steady state; and the energy of the whole way closes.
#[test]
fn settles_in_the_steady_state() {
    for (name, cells, hours) in [("slab.toml", 600, 40.0), ("rig.toml", 600, 60.0)] {
        let model = shipped(name, cells);
        let at = |flow: &str, speed: &str| {
            let given =
                [("coolant_flow", flow), ("coolant_temperature", "20 degC"), ("motor_speed", speed), ("ambient_temperature", "23 degC")];
            Load::at(&model.machine, &model.machine.condition(&given).unwrap()).unwrap()
        };
        let load = at("2 L/min", "1000 rpm");
        let mut transient = Transient::new(&model.network, StepSettings { tolerance: 0.01, ..StepSettings::default() }).unwrap();
        let steady = transient.from_steady(&load).unwrap();
        let mut warm = transient.uniform(&load, 30.0 + ZERO_CELSIUS);
        let mut other = transient.from_steady(&at("4 L/min", "300 rpm")).unwrap();
        for (what, state) in [("uniform", &mut warm), ("another state", &mut other)] {
            transient.advance(state, hours * 3600.0, &|_| Ok(load.clone()), &mut |_, _| Ok(())).unwrap_or_else(|e| panic!("{name}: {e}"));
            let solids = model.network.solids;
            let water = state.temperatures.iter().zip(&steady.temperatures).skip(solids).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            println!("{name} from {what}: water {water:.1e} K from steady");
            let apart = state.temperatures[..solids].iter().zip(&steady.temperatures).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            println!(
                "{name} from {what}: {apart:.1e} K from steady, {} steps, {} rejected, energy {:.1e}",
                state.steps,
                state.rejected,
                state.energy.relative()
            );
            assert!(state.energy.relative() < 1e-8, "{name}: {:?}", state.energy);
            assert!(apart < 2e-3, "{name} from {what}: {apart} K");
        }
    }
}

/// Water is cut where stations end; what rounding leaves between two cuts is no water: it would count among the parcels of a stream, of
/// which only so many are kept.
#[test]
fn no_slivers() {
    let model = shipped("rig.toml", 600);
    let at = |inlet: &str| {
        let given =
            [("coolant_flow", "6 L/min"), ("coolant_temperature", inlet), ("motor_speed", "2500 rpm"), ("ambient_temperature", "22 degC")];
        Load::at(&model.machine, &model.machine.condition(&given).unwrap()).unwrap()
    };
    let (before, after) = (at("20 degC"), at("21 degC"));
    let mut transient = Transient::new(&model.network, StepSettings::default()).unwrap();
    let mut state = transient.from_steady(&before).unwrap();
    let (mut least, mut parcels) = (f64::INFINITY, 0);
    for minute in 1..=10 {
        let until = 60.0 * f64::from(minute);
        transient
            .advance(&mut state, until, &|_| Ok(after.clone()), &mut |state, _| {
                for (stream, water) in model.network.streams.iter().zip(&state.water) {
                    let whole: f64 = water.iter().map(|p| p.volume).sum();
                    let station = whole / stream.stations.len() as f64;
                    least = water.iter().map(|p| p.volume / station).fold(least, f64::min);
                    parcels = parcels.max(water.len());
                }
                Ok(())
            })
            .unwrap();
    }
    println!("the smallest of up to {parcels} parcels is {least:.1e} of a station");
    assert!(least > 1e-9, "{least:e}");
}

/// A hole through a block that is held and hardly conducts to its water: a step at the inlet arrives at the outlet as a
/// step, when the water that carried it has come through.
#[test]
fn a_front_stays_sharp() {
    let text = r#"
        [variables.inlet]
        unit = "degC"
        default = "20 degC"
        [ material.heavy ]
        conductivity = "1000 W/(m K)"
        density = "8000 kg/m3"
        specific_heat = "1e6 J/(kg K)"
        [part.block]
        material = "heavy"
        box = ["4 m", "0.1 m", "0.1 m"]
        cells = [80, 2, 2]
        [channel.hole]
        in = "block"
        diameter = "10 mm"
        path = [["0 m", "0.05 m", "0.05 m"], ["4 m", "0.05 m", "0.05 m"]]
        film = "1e-6 W/(m2 K)"
        [circuit.water]
        flow = "coolant_flow"
        inlet_temperature = "inlet"
        liquid = { density = "1000 kg/m3", specific_heat = "4000 J/(kg K)", viscosity = "1e-3 Pa s", conductivity = "0.6 W/(m K)" }
        layout = ["hole"]
        dissipation = false
        [sensor.out]
        outlet = "hole"
    "#;
    let model = model(text, 1.0);
    let at = |inlet: &str| {
        let mut given = CONDITION.to_vec();
        given.push(("inlet", inlet));
        Load::at(&model.machine, &model.machine.condition(&given).unwrap()).unwrap()
    };
    let hot = at("60 degC");
    let mut transient = Transient::new(&model.network, StepSettings::default()).unwrap();
    let mut state = transient.uniform(&at("20 degC"), 20.0 + ZERO_CELSIUS);
    // 4 m of 10 mm at 1 L/min.
    let transit = std::f64::consts::PI / 4.0 * 1e-4 * 4.0 / (1e-3 / 60.0);
    let outlet = model.network.streams[0].outlet() as usize;
    let mut seen: Vec<(f64, f64)> = Vec::new();
    for i in 1..=200 {
        transient
            .advance(&mut state, transit * f64::from(i) / 100.0, &|_| Ok(hot.clone()), &mut |s, _| {
                seen.push((s.time / transit, s.temperatures[outlet] - ZERO_CELSIUS));
                Ok(())
            })
            .unwrap();
    }
    let between = seen.iter().filter(|(_, t)| (20.5..59.5).contains(t)).count();
    let arrival = seen.iter().find(|(_, t)| *t > 40.0).unwrap().0;
    println!("front: {between} of {} outputs between, arrival at {arrival:.4} of the transit", seen.len());
    assert!(between <= 1, "{:?}", seen.iter().filter(|(_, t)| (20.5..59.5).contains(t)).collect::<Vec<_>>());
    close("arrival of the front", arrival, 1.0, 1.0, 0.02);
    assert!(state.energy.relative() < 1e-8);
}

/// A channel along a held wall whose inlet rises evenly: T = Tw + (Tin(t - transit) - Tw) exp(-h P L/(m c)), read every 7 s from
/// stations that hold several readings' worth of water. What is left of the straight parcels is smooth, and no reading stands
/// beside its neighbours.
#[test]
fn a_ramp_leaves_without_steps() {
    let text = r#"
        [variables.inlet]
        unit = "degC"
        default = "20 degC"
        [ material.heavy ]
        conductivity = "1e6 W/(m K)"
        density = "8000 kg/m3"
        specific_heat = "500 J/(kg K)"
        [part.block]
        material = "heavy"
        box = ["4 m", "0.1 m", "0.1 m"]
        cells = [8, 2, 2]
        [boundary.wall]
        faces = ["block.-y", "block.+y", "block.-z", "block.+z"]
        temperature = "30 degC"
        [channel.hole]
        in = "block"
        diameter = "10 mm"
        path = [["0 m", "0.05 m", "0.05 m"], ["4 m", "0.05 m", "0.05 m"]]
        film = "500 W/(m2 K)"
        [circuit.water]
        flow = "coolant_flow"
        inlet_temperature = "inlet"
        liquid = { density = "1000 kg/m3", specific_heat = "4000 J/(kg K)", viscosity = "1e-3 Pa s", conductivity = "0.6 W/(m K)" }
        layout = ["hole"]
        dissipation = false
        [sensor.out]
        outlet = "hole"
    "#;
    let model = model(text, 1.0);
    let at = |celsius: f64, flow: f64| {
        let (inlet, flow) = (format!("{celsius} degC"), format!("{flow} L/min"));
        let mut given: Vec<(&str, &str)> = CONDITION.to_vec();
        given[0].1 = &flow;
        given.push(("inlet", &inlet));
        Load::at(&model.machine, &model.machine.condition(&given).unwrap())
    };
    let inlet = |time: f64| 20.0 + 0.01 * time.max(0.0);
    let pi = std::f64::consts::PI;
    let transit = pi / 4.0 * 1e-4 * 4.0 / (1e-3 / 60.0);
    let left = (-500.0 * pi * 0.01 * 4.0 / (4e6 * 1e-3 / 60.0)).exp();
    let outlet = model.network.streams[0].outlet() as usize;
    // An even flow, and one that doubles, so that no two steps move the water alike.
    for growth in [0.0, 1.0 / 560.0] {
        let mut transient = Transient::new(&model.network, StepSettings { tolerance: 1e-3, ..StepSettings::default() }).unwrap();
        let mut state = transient.from_steady(&at(20.0, 1.0).unwrap()).unwrap();
        let mut seen: Vec<f64> = Vec::new();
        for i in 1..=80 {
            let time = 7.0 * f64::from(i);
            transient.advance(&mut state, time, &|t| at(inlet(t), 1.0 + growth * t), &mut |_, _| Ok(())).unwrap();
            seen.push(state.temperatures[outlet] - ZERO_CELSIUS);
            let exact = 30.0 + (inlet(time - transit) - 30.0) * left;
            let error = seen[seen.len() - 1] - exact;
            assert!(growth > 0.0 || error.abs() < 1e-2, "at {time} s: {error} K from {exact} degC");
        }
        // From the second reading behind the corner on, which the water brings after its transit.
        let from = (transit / 7.0).ceil() as usize + 2;
        let scatter = seen[from..].windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs()).fold(0.0, f64::max);
        println!("ramp: readings stand beside their neighbours by {scatter:.1e} K");
        // The growing flow itself bends the readings by 1.4e-3 K at first.
        let bend = if growth > 0.0 { 1.5e-3 } else { 0.0 };
        assert!(scatter < bend + 1e-3, "{scatter} K");
        assert!(state.energy.relative() < 1e-8);
    }
}
