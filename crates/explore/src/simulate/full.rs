//! A schedule run through the full model.

use std::time::Instant;

use super::checkpoint::{self, Identity, Progress};
use super::limits::Limits;
use super::settle::Settling;
use super::stretch::{Fronts, Stretch, reads_water, unevenness};
use super::{ENERGY_TOLERANCE, History, PlaceStart, Seen, SimulateOptions, Start, StartPlace, condition_at, shown, stops};
use crate::schedule::{Schedule, TIME};
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::{Condition, Machine};
use coldplate_network::{HeatMeter, Load, Network};
use coldplate_solve::heat_flow::{heat_flows_at, heat_flows_within};
use coldplate_solve::meshed::MeshedMachine;
use coldplate_solve::transient::water::residence;
use coldplate_solve::transient::{Settings, Transient, TransientState};

/// Runs `schedule` through `model`; `seen` is shown the beginning of every stretch between two corners and the end of every
/// step.
///
/// Readings within a step lie on the parabola through its three states. Steps end at the outputs in three cases: while water of
/// before the corner may be in the channels, so that fronts may pass; if readings of water are far from straight; and if heat
/// into water is metered. They always end there in machines of lumped nodes alone, whose steps cost little, and if a formula
/// knows the time.
///
/// # Errors
/// The condition or the water leaves its range, the numerics fail, the energy does not add up, or a checkpoint cannot be
/// written or belongs to another run.
pub fn run(model: &MeshedMachine, schedule: &Schedule, options: &SimulateOptions, seen: &mut dyn FnMut(&Seen<'_>)) -> Result<History> {
    let network = &model.network;
    let stops = stops(schedule, options.every)?;
    let load_of =
        |condition: &Condition, time: f64| Load::at(&model.machine, condition).map_err(|e| e.at_key(format!("the condition at {time} s")));
    let first = load_of(&schedule.stated(0), schedule.start())?;
    let settings = Settings { tolerance: options.tolerance, longest: (schedule.end() - schedule.start()) / 20.0, balance: options.balance };
    let mut transient = Transient::new(network, settings)?;
    if options.only_outputs {
        transient = transient.in_strides();
    }
    // A formula of the time may bend between two corners, and steps that go on look less closely there.
    let bends = model.machine.variables.iter().any(|v| v.name == TIME);
    let goes_on = options.only_temperatures && !bends;
    transient = transient.in_steps(options.steps.clone());
    let checkpoint = options.checkpoint.as_ref().map(|path| (path, Identity::new(model, schedule, options)));
    let known = match &checkpoint {
        Some((path, identity)) if options.resume && path.exists() => Some(checkpoint::read(path, identity, network, stops.len())?),
        _ => None,
    };
    // Runs for temperatures alone look for no limits.
    let limits = Limits::new(if options.only_temperatures { &[] } else { &model.machine.limits }, &network.measurands);
    let resumed_at = known.as_ref().map(|(state, _)| state.time);
    let read = |temperatures: &[f64], load: &Load| -> Vec<f64> { network.sensors.iter().map(|s| s.read(temperatures, load)).collect() };
    // Readings and heat flows at a time not behind that of a state.
    let output = |state: &TransientState, time: f64, load: &Load| -> Result<(Vec<f64>, Vec<f64>)> {
        let is_within = time < state.time;
        let between = if is_within { state.within(time) } else { Vec::new() };
        let temperatures = if is_within { &between } else { &state.temperatures };
        let heats = match options.only_temperatures {
            true => Vec::new(),
            false if is_within => heat_flows_within(network, load, temperatures),
            false => heat_flows_at(network, load, state)?,
        };
        Ok((read(temperatures, load), heats))
    };
    let (mut state, mut progress) = match known {
        Some(known) => known,
        None => {
            let mut state = match options.start {
                Start::Steady => transient.from_steady(&first)?,
                Start::Uniform(temperature) => transient.uniform(&first, temperature),
                Start::Readings | Start::Parts => {
                    return Err(Error::input("a schedule has no readings to begin with").at_key("--from").help("give a temperature"));
                }
            };
            for own in options.places.iter().copied().chain(own_starts(&model.machine, &schedule.stated(0))?) {
                match own.place {
                    StartPlace::Part(part) => transient.set_group(&mut state, part, own.temperature),
                    StartPlace::Node(node) => transient.set_group(&mut state, model.machine.parts.len() + node, own.temperature),
                    StartPlace::Channel(channel) => transient.set_stream(&mut state, channel, own.temperature),
                }
            }
            state.time = schedule.start();
            let steady = if options.only_temperatures {
                Err("was not asked for".to_string())
            } else {
                let last = load_of(&schedule.last_condition(), schedule.end())?;
                transient.from_steady(&last).map(|s| read(&s.temperatures, &last)).map_err(|e| e.what().to_string())
            };
            let (readings, heats) = output(&state, state.time, &first)?;
            let mut settling = Settling::new(options.within, network.sensors.len());
            settling.see(state.time, &readings, steady.as_deref().ok());
            let mut passing = limits.passing(&options.watched);
            passing.see(state.time, &limits.beside(&readings, &first.variables));
            let fronts = Fronts { until: state.time, are_near: false };
            (state, Progress { readings: vec![readings], heat_flows: vec![heats], steady, settling, passing, fronts })
        }
    };
    let mut boiling = vec![None; network.streams.len()];
    let mut clock = Instant::now();
    let meters_water = !options.only_temperatures && network.meters.iter().any(HeatMeter::is_of_water);
    let lands_always = transient.is_lumped() || bends || meters_water;
    let has_water_read = network.sensors.iter().any(|sensor| reads_water(network, sensor));
    for stretch in Stretch::all(schedule, &stops) {
        let range = stretch.range();
        if progress.readings.len() >= range.end {
            continue; // a checkpoint has it
        }
        let (from, until) = stretch.ends();
        let load = |time: f64| load_of(&stretch.condition(time), time);
        let mut now = load(state.time)?;
        // Unless the run was taken up in the middle of the stretch.
        if state.time <= from {
            state.before = state.before.take().filter(|_| goes_on);
            let leaves = |load: &Load| residence(network, load, &state.temperatures, &state.water);
            progress.fronts = Fronts { until: from + leaves(&now)?.max(leaves(&load(until)?)?), are_near: false };
            progress.passing.corner();
        }
        if state.time < until {
            seen(&Seen { state: &state, condition: &stretch.condition(state.time), load: &now });
            progress.passing.see(state.time, &limits.beside(&read(&state.temperatures, &now), &now.variables));
        }
        // Records the readings up to a time.
        let take = |progress: &mut Progress, state: &TransientState, is_due: &dyn Fn(f64) -> bool| -> Result<()> {
            while let Some(stop) = stops[..range.end].get(progress.readings.len()).filter(|stop| is_due(stop.time)) {
                let load = load_of(&condition_at(schedule, stop), stop.time)?;
                let (readings, heats) = output(state, stop.time, &load)?;
                if stop.time < state.time {
                    progress.passing.see(stop.time, &limits.beside(&readings, &load.variables));
                }
                progress.settling.see(stop.time, &readings, progress.steady.as_deref().ok());
                progress.readings.push(readings);
                progress.heat_flows.push(heats);
            }
            Ok(())
        };
        while state.time < until {
            let next = stops[progress.readings.len()].time;
            let lands = lands_always || progress.fronts.are_near || state.time < progress.fronts.until;
            let begun = (!lands && has_water_read).then(|| state.clone());
            let end = transient.towards(&mut state, if lands { next } else { until }, &now, &load)?;
            progress.fronts.are_near = unevenness(network, &state) > options.tolerance;
            if let Some(begun) = begun.filter(|_| progress.fronts.are_near && next < state.time) {
                state = TransientState { rejected: state.rejected + 1, ..begun };
                continue;
            }
            now = end;
            take(&mut progress, &state, &|time| time < state.time)?;
            if !options.only_temperatures {
                let readings = read(&state.temperatures, &now);
                progress.settling.see(state.time, &readings, progress.steady.as_deref().ok());
                progress.passing.see(state.time, &limits.beside(&readings, &now.variables));
                see_boiling(network, &now, &state, &mut boiling)?;
            }
            seen(&Seen { state: &state, condition: &stretch.condition(state.time), load: &now });
            take(&mut progress, &state, &|time| time <= state.time)?;
            // If steps end at every output in any case they begin anew there: nothing is lost, and small steps are more exact.
            if lands_always && !goes_on && state.time >= next {
                state.before = None;
            }
            if let Some((path, identity)) = &checkpoint
                && clock.elapsed() >= options.checkpoint_every
            {
                checkpoint::write(path, identity, &state, &progress)?;
                clock = Instant::now();
            }
        }
        take(&mut progress, &state, &|time| time <= state.time)?;
    }
    if let Some((path, identity)) = &checkpoint {
        checkpoint::write(path, identity, &state, &progress)?;
    }
    progress.passing.corner();
    let open = state.energy.relative();
    // A comparison that is false for NaN too.
    if open.is_nan() || open > ENERGY_TOLERANCE.max(2.0 * options.balance) {
        return Err(Error::numerics(format!(
            "the energy balance is open: {open:.3e} of it do not add up ({:.6e} J entered, {:.6e} J left, {:.6e} J are stored)",
            state.energy.entered, state.energy.left, state.energy.stored
        )));
    }
    let times: Vec<f64> = stops.iter().map(|stop| stop.time).collect();
    let sensors = &model.machine.sensors;
    let steady = progress.steady.as_ref().map(|t| sensors.iter().zip(t).map(|(s, t)| s.shows.settled(*t)).collect());
    let (passes, limits) = limits.found(&progress.passing, None);
    Ok(History {
        readings: shown(&model.machine, &times, &progress.readings),
        temperatures: progress.readings,
        heat_flows: progress.heat_flows,
        times,
        conditions: stops.iter().map(|stop| condition_at(schedule, stop)).collect(),
        settled: progress.settling.settled(schedule.start(), progress.steady.is_ok()),
        steady: steady.map_err(String::clone),
        within: options.within,
        passes,
        limits,
        steps: state.steps,
        rejected: state.rejected,
        energy: state.energy,
        bounds: None,
        resumed_at,
        notes: boiling.iter().enumerate().filter_map(|(s, wall)| Some(boiling_note(network, s, (*wall)?))).collect(),
    })
}

/// Boiling at the wall of a stream: time since when, s, and the hottest wall temperature, K.
#[derive(Debug, Clone, Copy)]
struct Boiling {
    since: f64,
    wall: f64,
}

fn see_boiling(network: &Network, load: &Load, state: &TransientState, found: &mut [Option<Boiling>]) -> Result<()> {
    let streams = network.stream_states(load, &state.temperatures)?;
    for (s, found) in found.iter_mut().enumerate() {
        if let Some(wall) = network.boiling_wall(s, &streams[s], &state.temperatures) {
            let boiling = found.get_or_insert(Boiling { since: state.time, wall });
            boiling.wall = boiling.wall.max(wall);
        }
    }
    Ok(())
}

fn boiling_note(network: &Network, s: usize, Boiling { since, wall }: Boiling) -> String {
    format!("channel '{}' from {since:.0} s on: {}", network.streams[s].name, network.boiling_note(s, wall))
}

/// Initial temperatures that the machine file states for parts and nodes.
pub(super) fn own_starts(machine: &Machine, condition: &Condition) -> Result<Vec<PlaceStart>> {
    let values = machine.values(condition)?;
    let parts = machine.parts.iter().enumerate().map(|(i, p)| (StartPlace::Part(i), "part", &p.name, &p.start));
    let nodes = machine.nodes.iter().enumerate().map(|(i, n)| (StartPlace::Node(i), "node", &n.name, &n.start));
    let mut found = Vec::new();
    for (place, table, name, start) in parts.chain(nodes) {
        let Some(start) = start else { continue };
        let temperature = start.evaluate(&values)?;
        if temperature <= 0.0 {
            let error = Error::input("a temperature at the start is below absolute zero").at_key(format!("{table}.{name}.start"));
            return Err(error.read(format!("{temperature} K")));
        }
        found.push(PlaceStart { place, temperature });
    }
    Ok(found)
}
