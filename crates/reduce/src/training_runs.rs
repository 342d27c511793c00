//! Histories of the full model. Some enrich the modes, the others calibrate the bound over time.

use super::assemble::Snapshot;
use super::model::{HistoryBound, ReducedModel};
use super::reference::ReferenceNetwork;
use super::run::{Beginning, ConditionStretch, ReducedHistory};
use coldplate_base::error::Result;
use coldplate_base::random::Random;
use coldplate_describe::machine::{Condition, Machine};
use coldplate_network::{Load, Network};
use coldplate_solve::transient::{StepSettings, Transient, TransientState};

/// Number of stretches of one condition in a history. Chosen: more steps in a history, but each costs time of the
/// full model.
const STRETCHES: usize = 5;
/// Shortest and longest stretch, in slowest time constants of the machine. Chosen: from a change that only fast modes
/// follow to one that nearly settles.
const LENGTHS: (f64, f64) = (0.02, 1.5);
/// First time after a step at which a state is taken, in slowest time constants. Chosen: early enough for the fastest
/// response.
const FIRST: f64 = 2e-5;
/// Ratio of each next time at which a state is taken to the one before, dimensionless. Chosen: closer to one, more states to hold.
const LATER: f64 = 1.7;
/// Error allowed in each time step of the full model, K. Chosen: a fifth of [`FLOOR`], since errors of steps add up.
const TOLERANCE: f64 = 0.001;
/// Factor on the largest margin that a reading of the calibration needed, and least margin, both dimensionless.
/// Chosen: larger covers more unseen histories, but widens every bound.
const SAFETY: (f64, f64) = (2.0, 0.5);
/// Steps of the search for the margin, a count: each leaves two thirds of the interval. Chosen: 120 reach rounding.
const THIRDS: usize = 120;
/// Error that the time steps of the full model leave open, K. Chosen to cover steps of [`TOLERANCE`] each.
const FLOOR: f64 = 0.005;

/// Course of a history: its beginning and its conditions.
#[derive(Debug, Clone)]
pub(super) struct HistoryPlan {
    beginning: Beginning,
    /// Conditions, each until a time, s.
    stretches: Vec<(Condition, f64)>,
    /// Slowest time constant, s.
    slowest: f64,
}

/// A history of the full model.
pub(super) struct TrainingRun {
    /// States along the history.
    pub(super) snapshots: Vec<Snapshot>,
    /// Times (s) and readings (K), the beginning first.
    readings: Vec<(f64, Vec<f64>)>,
}

impl HistoryPlan {
    /// A random plan over conditions that `draw` finds; every other one begins with one temperature everywhere.
    pub(super) fn random(
        number: usize,
        slowest: f64,
        random: &mut Random,
        mut draw: impl FnMut(&mut Random) -> Condition,
        machine: &Machine,
    ) -> Result<Self> {
        let mut time = 0.0;
        let ratio: f64 = LENGTHS.1 / LENGTHS.0;
        let mut stretch = |random: &mut Random| {
            let condition = draw(random);
            time += slowest * LENGTHS.0 * ratio.powf(random.unit());
            (condition, time)
        };
        let stretches: Vec<(Condition, f64)> = (0..STRETCHES).map(|_| stretch(random)).collect();
        let surroundings = Load::at(machine, &stretches[0].0)?;
        let cold = surroundings.inlets.first().copied().unwrap_or(surroundings.chamber);
        let beginning = if number.is_multiple_of(2) { Beginning::Uniform(cold) } else { Beginning::Steady };
        Ok(Self { beginning, stretches, slowest })
    }

    /// Runs the history in full. States are taken if there is a reference for them.
    pub(super) fn run(&self, machine: &Machine, network: &Network, reference: Option<&ReferenceNetwork<'_>>) -> Result<TrainingRun> {
        let mut transient = Transient::new(network, StepSettings { tolerance: TOLERANCE, ..StepSettings::default() })?;
        let first = Load::at(machine, &self.stretches[0].0)?;
        let mut state = match self.beginning {
            Beginning::Steady => transient.from_steady(&first)?,
            Beginning::Uniform(temperature) => transient.uniform(&first, temperature),
        };
        transient.settle(&mut state, &first)?;
        let mut run = TrainingRun { snapshots: Vec::new(), readings: Vec::new() };
        let mut take = |state: &TransientState, load: &Load| -> Result<()> {
            run.readings.push((state.time, network.sensors.iter().map(|s| s.read(&state.temperatures, load)).collect()));
            if let Some(reference) = reference {
                let streams = network.stream_states(load, &state.temperatures)?;
                run.snapshots.push(reference.snapshot(load, &streams, &state.temperatures));
            }
            Ok(())
        };
        take(&state, &first)?;
        for (condition, until) in &self.stretches {
            let load = Load::at(machine, condition)?;
            let begun = state.time;
            let mut next = FIRST * self.slowest;
            transient.advance(&mut state, *until, &|_| Ok(load.clone()), &mut |state, load| {
                if state.time - begun < next && state.time < *until {
                    return Ok(());
                }
                while next <= state.time - begun {
                    next *= LATER;
                }
                take(state, load)
            })?;
        }
        Ok(run)
    }

    /// Runs this history through a reduced model, with outputs at the times of a run in full.
    fn reduced(&self, model: &ReducedModel, run: &TrainingRun) -> Result<ReducedHistory> {
        let mut from = 0.0;
        let mut stretches = Vec::new();
        for (condition, until) in &self.stretches {
            let begun = std::mem::replace(&mut from, *until);
            let times = run.readings.iter().map(|(time, _)| *time).filter(|t| *t > begun && t <= until);
            stretches.push(ConditionStretch {
                until: *until,
                condition: Box::new(|_| condition.clone()),
                at_end: None,
                outputs: times.collect(),
            });
        }
        model.course(self.beginning, 0.0, &stretches)
    }
}

/// The bound over time, calibrated on histories that contributed no modes; `made` is the number of those that did.
///
/// # Errors
/// The reduced model cannot follow one of them.
pub(super) fn calibrated(model: &ReducedModel, checks: &[(HistoryPlan, TrainingRun)], made: usize) -> Result<HistoryBound> {
    let mut needs = Vec::new();
    let mut courses = Vec::new();
    for (plan, run) in checks {
        let course = plan.reduced(model, run)?;
        let mut largest: f64 = 0.0;
        for ((_, truth), (fine, coarse)) in run.readings.iter().zip(course.readings.iter().zip(&course.coarser)) {
            let own: Vec<f64> = fine.iter().zip(coarse).map(|(f, c)| (f - c).abs()).collect();
            largest = own.iter().copied().fold(largest, f64::max);
            let beyond = truth.iter().zip(fine).zip(&own).map(|((t, f), d)| (t - f).abs() - FLOOR - d);
            needs.extend(beyond.map(|beyond| Need { beyond: SAFETY.0 * beyond.max(0.0), largest }));
        }
        courses.push(course);
    }
    let errors = checks.iter().zip(&courses).flat_map(|((_, run), course)| run.readings.iter().zip(&course.readings));
    let largest = |(truth, own): (&(f64, Vec<f64>), &Vec<f64>)| truth.1.iter().zip(own).map(|(t, f)| (t - f).abs()).fold(0.0, f64::max);
    let largest_error = errors.map(largest).fold(0.0, f64::max);
    let (margin, further) = smallest(&needs);
    // Both networks may agree and still be off together, by as much as was seen anywhere.
    let floor = largest_error.max(FLOOR + further);
    let found = HistoryBound { margin, floor, histories: made, checks: checks.len(), largest_error, largest_bound: 0.0 };
    let bounds = courses.iter().flat_map(|course| found.bounds(&course.readings, &course.coarser)).flatten();
    let largest_bound = bounds.fold(0.0, f64::max);
    Ok(HistoryBound { largest_bound, ..found })
}

/// Part of a reading's error that neither the difference of the two networks there nor [`FLOOR`] explains.
struct Need {
    /// That part with its safety, K.
    beyond: f64,
    /// Largest difference of the two networks so far, K.
    largest: f64,
}

/// Margin (dimensionless) and further floor (K) that cover all needs and add least to them on average. A margin alone would be
/// without limit where an error stands beside networks that happen to agree.
fn smallest(needs: &[Need]) -> (f64, f64) {
    let further = |margin: f64| needs.iter().map(|need| need.beyond - margin * need.largest).fold(0.0, f64::max);
    let mean = needs.iter().map(|need| need.largest).sum::<f64>() / needs.len().max(1) as f64;
    // The sum is convex in the margin, and above this one the margin alone adds more than the floor alone would.
    let most = needs.iter().map(|need| need.beyond).fold(0.0, f64::max) / mean.max(f64::MIN_POSITIVE);
    let (mut low, mut high) = (SAFETY.1, SAFETY.1 + most.min(f64::MAX.sqrt()));
    for _ in 0..THIRDS {
        let third = (high - low) / 3.0;
        let [left, right] = [low + third, high - third].map(|margin| margin * mean + further(margin));
        if left <= right { high -= third } else { low += third }
    }
    (low, further(low))
}
