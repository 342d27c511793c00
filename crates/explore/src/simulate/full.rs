//! A schedule run through the full model.

use std::path::Path;
use std::time::Instant;

use super::checkpoint::{self, Identity};
use super::limits::Limits;
use super::recorder::Recorder;
use super::stretch::{Fronts, Stretch, reads_water, unevenness};
use super::{ENERGY_TOLERANCE, History, PlaceStart, RunInstant, SimulateOptions, StartPlace, Stop, condition_at, stops};
use crate::schedule::{Schedule, TIME};
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::{Condition, Machine};
use coldplate_network::{Corner, Corners, HeatMeter, Load, Network};
use coldplate_reduce::Beginning;
use coldplate_solve::heat_flow::{heat_flows_at, heat_flows_within};
use coldplate_solve::meshed::MeshedMachine;
use coldplate_solve::transient::water::residence;
use coldplate_solve::transient::{StepSettings, Transient, TransientState};

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
pub fn run(
    model: &MeshedMachine,
    schedule: &Schedule,
    options: &SimulateOptions,
    seen: &mut dyn FnMut(&RunInstant<'_>),
) -> Result<History> {
    let stops = stops(schedule, options.every)?;
    let mut run = FullRun::begin(model, schedule, &stops, options)?;
    for stretch in Stretch::all(schedule, &stops) {
        // Unless a checkpoint has it.
        if run.recorder.seen.readings.len() < stretch.range().end {
            run.advance(&stretch, seen)?;
        }
    }
    run.finish()
}

/// Run of the full model up to a time.
struct FullRun<'a> {
    model: &'a MeshedMachine,
    schedule: &'a Schedule,
    options: &'a SimulateOptions,
    transient: Transient<'a>,
    state: TransientState,
    recorder: Recorder<'a>,
    /// Fronts in the water since the last corner.
    fronts: Fronts,
    boiling: Vec<Option<Boiling>>,
    checkpoint: Option<Checkpoint<'a>>,
    resumed_at: Option<f64>,
    /// Whether steps go on across rows at which no condition jumps.
    goes_on: bool,
    /// Whether steps end at every output in any case.
    lands_always: bool,
    has_water_read: bool,
    /// Times, s, from and until which a formula has more kinks than are looked for.
    unresolved: Option<(f64, f64)>,
}

/// Halvings of the time of a step around a passing, a count. Chosen: 50 reach the rounding of its times.
const HALVINGS: usize = 50;

/// File that holds the state of a run.
struct Checkpoint<'a> {
    path: &'a Path,
    identity: Identity,
    written: Instant,
}

impl<'a> FullRun<'a> {
    /// Run at its beginning, or at its checkpoint.
    fn begin(model: &'a MeshedMachine, schedule: &'a Schedule, stops: &'a [Stop], options: &'a SimulateOptions) -> Result<Self> {
        let network = &model.network;
        let first = load_at(model, &schedule.stated(0), schedule.start())?;
        let longest = (schedule.end() - schedule.start()) / 20.0;
        let settings = StepSettings { tolerance: options.tolerance, longest, balance: options.balance };
        let mut transient = Transient::new(network, settings)?.in_steps(options.steps.clone());
        if options.only_outputs {
            transient = transient.in_strides();
        }
        // A formula of the time may bend between two corners, and steps that go on look less closely there.
        let bends = model.machine.variables.iter().any(|v| v.name == TIME);
        let meters_water = !options.only_temperatures && network.meters.iter().any(HeatMeter::is_of_water);
        // Runs for temperatures alone look for no limits.
        let limits = Limits::new(if options.only_temperatures { &[] } else { &model.machine.limits }, &network.measurands);
        let checkpoint = options.checkpoint.as_deref().map(|path| {
            let identity = Identity::new(model, schedule, options);
            Checkpoint { path, identity, written: Instant::now() }
        });
        let known = match &checkpoint {
            Some(Checkpoint { path, identity, .. }) if options.resume && path.exists() => {
                Some(checkpoint::read(path, identity, network, stops.len())?)
            }
            _ => None,
        };
        let resumed_at = known.as_ref().map(|(state, ..)| state.time);
        let (state, recorder, fronts) = match known {
            Some((state, fronts, seen)) => (state, Recorder::resumed(schedule, stops, limits, seen), fronts),
            None => {
                let state = initial(model, &mut transient, schedule, options, &first)?;
                let steady = if options.only_temperatures {
                    Err("was not asked for".to_string())
                } else {
                    let last = load_at(model, &schedule.last_condition(), schedule.end())?;
                    transient.from_steady(&last).map(|s| read(network, &s.temperatures, &last)).map_err(|e| e.what().to_string())
                };
                let fronts = Fronts { until: state.time, are_near: false };
                (state, Recorder::new(schedule, stops, limits, options, steady), fronts)
            }
        };
        let mut run = Self {
            goes_on: options.only_temperatures && !bends,
            lands_always: transient.is_lumped() || bends || meters_water,
            has_water_read: network.sensors.iter().any(|sensor| reads_water(network, sensor)),
            unresolved: None,
            boiling: vec![None; network.streams.len()],
            model,
            schedule,
            options,
            transient,
            state,
            recorder,
            fronts,
            checkpoint,
            resumed_at,
        };
        if resumed_at.is_none() {
            let (readings, heats) = run.output(run.state.time, &first)?;
            run.recorder.look(run.state.time, &readings, &first.variables);
            run.recorder.record(readings, heats);
        }
        Ok(run)
    }

    /// Readings (K) and heat flows (W) at a time not behind that of the state.
    fn output(&self, time: f64, load: &Load) -> Result<(Vec<f64>, Vec<f64>)> {
        let (network, is_within) = (&self.model.network, time < self.state.time);
        let between = if is_within { self.state.within(network, time) } else { Vec::new() };
        let temperatures = if is_within { &between } else { &self.state.temperatures };
        let heats = match self.options.only_temperatures {
            true => Vec::new(),
            false if is_within => heat_flows_within(network, load, temperatures),
            false => heat_flows_at(network, load, &self.state)?,
        };
        Ok((read(network, temperatures, load), heats))
    }

    /// Runs a stretch from corner to corner, from wherever the state is.
    fn advance(&mut self, stretch: &Stretch<'_>, seen: &mut dyn FnMut(&RunInstant<'_>)) -> Result<()> {
        let (model, options) = (self.model, self.options);
        let network = &model.network;
        let (from, until) = stretch.ends();
        let load = |time: f64| load_at(model, &stretch.condition(time), time);
        let condition = |time: f64| stretch.condition(time);
        let Corners { corners, is_cut_off } = Corners::of(&model.machine, &network.warming(), &condition, [from, until], options.tolerance);
        if is_cut_off {
            self.unresolved = Some((self.unresolved.map_or(from, |(first, _)| first), until));
        }
        let mut now = load(self.state.time)?;
        // Unless the run was taken up in the middle of the stretch.
        if self.state.time <= from {
            self.state.before = self.state.before.take().filter(|_| self.goes_on);
            let leaves = |load: &Load| residence(network, load, &self.state.temperatures, &self.state.water);
            self.fronts = Fronts { until: from + leaves(&now)?.max(leaves(&load(until)?)?), are_near: false };
            self.recorder.corner();
        }
        if self.state.time < until {
            seen(&RunInstant { state: &self.state, condition: &stretch.condition(self.state.time), load: &now });
            self.recorder.pass(self.state.time, &read(network, &self.state.temperatures, &now), &now.variables);
        }
        while let Some(next) = self.recorder.next_stop().map(|stop| stop.time).filter(|_| self.state.time < until) {
            let lands = self.lands_always || self.fronts.are_near || self.state.time < self.fronts.until;
            let begun = (!lands && self.has_water_read).then(|| self.state.clone());
            let corner = corners.get(corners.partition_point(|corner| corner.time <= self.state.time));
            let goal = corner.map_or(until, |corner| corner.time);
            let end = self.transient.towards(&mut self.state, if lands { next.min(goal) } else { goal }, &now, &load)?;
            self.fronts.are_near = unevenness(network, &self.state) > options.tolerance;
            if let Some(begun) = begun.filter(|_| self.fronts.are_near && next < self.state.time) {
                self.state = TransientState { rejected: self.state.rejected + 1, ..begun };
                continue;
            }
            now = end;
            self.record(stretch, |time, now| time < now)?;
            if !options.only_temperatures {
                let readings = read(network, &self.state.temperatures, &now);
                self.recorder.settle(self.state.time, &readings);
                self.pass(stretch, self.state.time, &readings, &now)?;
                see_boiling(network, &now, &self.state, &mut self.boiling)?;
            }
            seen(&RunInstant { state: &self.state, condition: &stretch.condition(self.state.time), load: &now });
            self.record(stretch, |time, now| time <= now)?;
            // If steps end at every output in any case they begin anew there: nothing is lost, and small steps are more exact.
            if self.lands_always && !self.goes_on && self.state.time >= next {
                self.state.before = None;
            }
            if corner.is_some_and(|Corner { time, is_kink }| *is_kink && *time == self.state.time) && self.state.time < until {
                self.state.before = None;
                self.recorder.corner();
                self.recorder.pass(self.state.time, &read(network, &self.state.temperatures, &now), &now.variables);
            }
            if self.checkpoint.as_ref().is_some_and(|own| own.written.elapsed() >= options.checkpoint_every) {
                self.save()?;
            }
        }
        self.record(stretch, |time, now| time <= now)
    }

    /// Records readings and heat flows at the stops of a stretch that are due by their time and that of the state.
    fn record(&mut self, stretch: &Stretch<'_>, is_due: fn(f64, f64) -> bool) -> Result<()> {
        while self.recorder.seen.readings.len() < stretch.range().end
            && let Some(stop) = self.recorder.next_stop().filter(|stop| is_due(stop.time, self.state.time))
        {
            let load = load_at(self.model, &condition_at(self.schedule, stop), stop.time)?;
            let (readings, heats) = self.output(stop.time, &load)?;
            if stop.time < self.state.time {
                self.pass(stretch, stop.time, &readings, &load)?;
            }
            self.recorder.settle(stop.time, &readings);
            self.recorder.record(readings, heats);
        }
        Ok(())
    }

    /// Takes note of readings (K) at a time (s) of the last step, and at each time since the last look at which a watched value is
    /// passed, by halving the course within the step.
    fn pass(&mut self, stretch: &Stretch<'_>, time: f64, readings: &[f64], load: &Load) -> Result<()> {
        let begun = self.state.before.as_ref().map_or(f64::INFINITY, |before| before.time - before.length);
        let values = self.recorder.limits.beside(readings, &load.variables);
        let mut passed: Vec<(f64, Vec<f64>, Vec<f64>)> = Vec::new();
        let (since, crossed) = self.recorder.seen.passing.crossed(&values);
        // A stride or a jump has no course within.
        for watch in crossed.into_iter().filter(|_| since >= begun * (1.0 - f64::EPSILON) && since < time) {
            let (mut low, mut high, mut found) = (since, time, None);
            for _ in 0..HALVINGS {
                let middle = f64::midpoint(low, high);
                let load = load_at(self.model, &stretch.condition(middle), middle)?;
                let network = &self.model.network;
                let readings = read(network, &self.state.within(network, middle), &load);
                let there = self.recorder.limits.beside(&readings, &load.variables)[watch.sensor];
                if (there < watch.value) == (values[watch.sensor] < watch.value) {
                    (high, found) = (middle, Some((middle, readings, load.variables)));
                } else {
                    low = middle;
                }
            }
            passed.extend(found.filter(|_| high < time));
        }
        passed.sort_by(|a, b| a.0.total_cmp(&b.0));
        passed.iter().for_each(|(time, readings, variables)| self.recorder.pass(*time, readings, variables));
        self.recorder.pass(time, readings, &load.variables);
        Ok(())
    }

    /// Writes the checkpoint, if there is one.
    fn save(&mut self) -> Result<()> {
        let Some(own) = &mut self.checkpoint else { return Ok(()) };
        checkpoint::write(own.path, &own.identity, &self.state, self.fronts, &self.recorder.seen)?;
        own.written = Instant::now();
        Ok(())
    }

    /// The history, once the energy adds up.
    fn finish(mut self) -> Result<History> {
        self.save()?;
        let (network, energy) = (&self.model.network, self.state.energy);
        let open = energy.relative();
        // A comparison that is false for NaN too.
        if open.is_nan() || open > ENERGY_TOLERANCE.max(2.0 * self.options.balance) {
            return Err(Error::numerics(format!(
                "the energy balance is open: {open:.3e} of it do not add up ({:.6e} J entered, {:.6e} J left, {:.6e} J are stored)",
                energy.entered, energy.left, energy.stored
            )));
        }
        Ok(History {
            steps: self.state.steps,
            rejected: self.state.rejected,
            energy,
            resumed_at: self.resumed_at,
            notes: self
                .boiling
                .iter()
                .enumerate()
                .filter_map(|(s, wall)| Some(boiling_note(network, s, (*wall)?)))
                .chain(network.loops.iter().zip(&self.state.controls).map(|(own, at)| {
                    let share = 100.0 * at.given / (self.state.time - self.schedule.start());
                    format!(
                        "controller '{}': {share:.1} % of the full power on average, {} switches, now {:.1} %",
                        own.name,
                        at.switches,
                        100.0 * at.share
                    )
                }))
                .chain(self.unresolved.map(|(from, until)| {
                    format!("formulas have more kinks between {from:.0} s and {until:.0} s than are looked for: short pulses may be lost")
                }))
                .collect(),
            ..self.recorder.history(Some(&self.model.machine), None)?
        })
    }
}

/// Load at a condition; errors name the time, s.
fn load_at(model: &MeshedMachine, condition: &Condition, time: f64) -> Result<Load> {
    Load::at(&model.machine, condition).map_err(|e| e.at_key(format!("the condition at {time} s")))
}

/// Readings of all sensors, K.
fn read(network: &Network, temperatures: &[f64], load: &Load) -> Vec<f64> {
    network.sensors.iter().map(|s| s.read(temperatures, load)).collect()
}

/// State at the start of a schedule, whose load is `first`.
fn initial(
    model: &MeshedMachine,
    transient: &mut Transient<'_>,
    schedule: &Schedule,
    options: &SimulateOptions,
    first: &Load,
) -> Result<TransientState> {
    let mut state = match options.start.of_schedule()? {
        Beginning::Steady => transient.from_steady(first)?,
        Beginning::Uniform(temperature) => transient.uniform(first, temperature),
    };
    let places: Vec<_> = options.places.iter().copied().chain(own_starts(&model.machine, &schedule.stated(0))?).collect();
    for own in &places {
        match own.place {
            StartPlace::Part(part) => transient.set_group(&mut state, part, own.temperature),
            StartPlace::Node(node) => transient.set_group(&mut state, model.machine.parts.len() + node, own.temperature),
            StartPlace::Channel(channel) => transient.set_stream(&mut state, channel, own.temperature),
        }
    }
    state.time = schedule.start();
    // What stores no heat is in balance from the first reading on, unless the file or the command states where it begins.
    if places.is_empty() {
        transient.settle(&mut state, first)?;
    }
    Ok(state)
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
