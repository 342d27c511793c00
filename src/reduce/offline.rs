//! Making a reduced model: full solves where the bound is largest, until it is small enough everywhere.

use std::time::Instant;

use rayon::prelude::*;

use super::assemble::Snapshot;
use super::basis::Basis;
use super::field::Field;
use super::ground::{COARSE, Calibrated, Ground, TOLERANCES};
use super::histories::{Plan, Run, calibrated};
use super::model::{Answer, Made, ReducedModel};
use crate::describe::machine::Condition;
use crate::discretise::network::Load;
use crate::error::{Error, Result};
use crate::foundation::progress::Progress;
use crate::foundation::random::Random;
use crate::solve::Solver;
use crate::solve::sensitivity::{OpenParameter, Study};

/// Conditions solved in full before the first reduced model, and for each axis more.
const FIRST: (usize, usize) = (16, 4);
/// Fewest conditions that a model is made of.
const LEAST: usize = 8;
/// Conditions among which the next are chosen, and how many in each round.
const POOL: usize = 192;
const ROUND: usize = 8;
/// Random conditions that the bound is calibrated on.
const CHECKS: usize = 60;
/// Share of the accuracy that the bounds of the choice must keep with the least margin: the calibrated one is larger, and
/// conditions that were not tried may be worse.
const AIM: f64 = 0.4;
/// Histories in full that the bound in time is calibrated on.
const HISTORY_CHECKS: usize = 2;
/// Modes that histories add.
const MODES_IN_TIME: usize = 48;
/// Their conditions are others than those of the steady states.
const HISTORIES: u64 = 0x7131;
/// What a reduced model shall be.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Largest bound wanted on any reading, K.
    pub accuracy: f64,
    /// Range of each variable of the machine, SI; both ends equal where it is held.
    pub ranges: Vec<(f64, f64)>,
    /// Whether what the machine file leaves open may be given other values.
    pub with_parameters: bool,
    /// Most conditions that may be solved in full, those of the calibration aside.
    pub most: usize,
    /// Histories in full that it shall follow in time; none: it is steady only.
    pub histories: usize,
    /// Whether the temperatures of all nodes are wanted too.
    pub with_field: bool,
    /// Seed of the conditions.
    pub seed: u64,
}

/// A condition with values of the parameters.
#[derive(Debug, Clone)]
struct Place {
    condition: Condition,
    parameters: Vec<f64>,
}

/// Makes a reduced model of a machine.
///
/// # Errors
/// Nothing varies, or too few conditions may be solved; a full solve fails in the middle of the ranges, or at most places; the
/// reduced model finds no steady state at most of those it is compared at.
pub fn reduce(study: &Study, settings: &Settings, progress: &dyn Progress) -> Result<ReducedModel> {
    let (machine, network) = (&study.model.machine, &study.model.network);
    let clock = Instant::now();
    let open = if settings.with_parameters { study.open_parameters(true)? } else { Vec::new() };
    let (parameters, left_out): (Vec<OpenParameter>, Vec<OpenParameter>) = open.into_iter().partition(OpenParameter::is_direct);
    let offline = Offline { study, ranges: &settings.ranges, parameters: &parameters };
    if offline.axes() == 0 {
        return Err(Error::input("nothing varies: no variable has a range")
            .help("state one, for example --range coolant_flow=\"2 L/min .. 18 L/min\""));
    }
    if settings.most < LEAST {
        let error = Error::input(format!("at least {LEAST} conditions must be solved in full")).at_key("--max-runs").read(settings.most);
        return Err(error.help("leave it out, or allow more"));
    }
    let middle = offline.place(&vec![0.5; offline.axes()]);
    let load = Load::at(machine, &middle.condition)?;
    let solver = Solver::heard(network, &load, progress)?;
    let center = solver.steady(&load)?;
    let ground = Ground::new(machine, network, load, center);
    let full = |place: &Place| offline.full(place, &solver, &ground);
    let mut random = Random::new(settings.seed);
    let mut draw = |count: usize| -> Vec<Place> {
        (0..count).map(|_| offline.place(&(0..offline.axes()).map(|_| random.unit()).collect::<Vec<_>>())).collect()
    };
    let mut failed = 0;
    let mut take = |places: Vec<Place>, to: &mut Vec<Snapshot>| {
        let solved: Vec<Option<Snapshot>> = places.par_iter().map(|p| full(p).ok()).collect();
        failed += solved.iter().filter(|s| s.is_none()).count();
        to.extend(solved.into_iter().flatten());
    };
    let count = (FIRST.0 + FIRST.1 * offline.axes()).min(settings.most);
    progress.at(&format!("solving {count} conditions in full"));
    let mut snapshots = Vec::new();
    take(draw(count), &mut snapshots);
    let mut pool = draw(POOL);
    let (model, basis) = loop {
        let (model, basis) = ground.model(&snapshots, &settings.ranges)?;
        let left_out = left_out.iter().map(|p| p.name.clone()).collect();
        let model = ReducedModel { parameters: parameters.clone(), left_out, ..model };
        let fine = basis.modes.len();
        // Where the bound is largest, or nothing is found at all, a full solve tells most.
        let bound = |place: &Place| match model.steady(&place.condition, &place.parameters) {
            Ok(answer) => answer.bounds.iter().fold(0.0, |m: f64, b| m.max(*b)),
            Err(_) => f64::INFINITY,
        };
        let bounds: Vec<f64> = pool.par_iter().map(bound).collect();
        let worst = bounds.iter().fold(0.0, |m: f64, b| m.max(*b));
        progress.at(&format!("{} conditions solved in full, {fine} modes: largest bound {worst:.1e} K", snapshots.len()));
        if worst <= AIM * settings.accuracy || snapshots.len() + ROUND > settings.most || pool.len() < ROUND {
            break (model, basis);
        }
        let mut order: Vec<usize> = (0..pool.len()).collect();
        order.sort_by(|a, b| bounds[*b].total_cmp(&bounds[*a]).then(a.cmp(b)));
        order.truncate(ROUND);
        let next = order.iter().map(|i| pool[*i].clone()).collect();
        let mut at = 0..;
        pool.retain(|_| !at.next().is_some_and(|i| order.contains(&i)));
        take(next, &mut snapshots);
    };
    let mut checks = Vec::new();
    let (model, modes) = if settings.histories == 0 {
        (model, basis.modes)
    } else {
        let slowest = model.fine.slowest(&Load::at(machine, &middle.condition)?)?;
        let mut random = Random::new(settings.seed ^ HISTORIES);
        let condition = |random: &mut Random| {
            let mut place = offline.place(&(0..offline.axes()).map(|_| random.unit()).collect::<Vec<_>>());
            place.parameters.clear();
            place.condition
        };
        let plan = |number: usize| Plan::random(number, slowest, &mut random, condition, machine);
        let plans: Vec<Plan> = (0..settings.histories + HISTORY_CHECKS).map(plan).collect::<Result<_>>()?;
        progress.at(&format!("running {} histories in full", plans.len()));
        let states = Some((&ground.split.rest, ground.center()));
        let one = |(number, plan): (usize, &Plan)| plan.run(machine, network, states.filter(|_| number < settings.histories));
        let mut runs: Vec<Run> = plans.par_iter().enumerate().map(one).collect::<Result<_>>()?;
        let tests = runs.split_off(settings.histories);
        checks = plans[settings.histories..].iter().cloned().zip(tests).collect();
        // What histories add to the modes of the steady states.
        let histories: Vec<Snapshot> = runs.into_iter().flat_map(|run| run.snapshots).collect();
        let rises: Vec<Vec<f64>> = histories.iter().map(|s| s.rise.clone()).collect();
        let (energy, assembly) = (ground.energy(), ground.assembly());
        let enriched = |steady: Vec<Vec<f64>>, most: usize| {
            let steady = Basis { modes: steady };
            let moving = Basis::of(&steady.without(&rises, &energy), &energy, most).modes;
            [steady.modes, moving].concat()
        };
        let few = |count: usize| ((count as f64 * COARSE) as usize).max(1);
        let coarse = enriched(basis.modes[..few(basis.modes.len()).min(basis.modes.len())].to_vec(), few(MODES_IN_TIME));
        let fine = enriched(basis.modes, MODES_IN_TIME);
        let all: Vec<Snapshot> = snapshots.iter().cloned().chain(histories).collect();
        progress.at(&format!("{} states in all, {} modes: choosing conductors", all.len(), fine.len()));
        let levels = (assembly.level(&coarse, &all, TOLERANCES[0]), assembly.level(&fine, &all, TOLERANCES[1]));
        (ReducedModel { coarse: levels.0, fine: levels.1, ..model }, fine)
    };
    let mut field = settings.with_field.then(|| Field::of(&modes, &ground.center()[..network.solids], study.model.mesh.element_size));
    progress.at(&format!("comparing with {CHECKS} further conditions solved in full"));
    let places = draw(CHECKS);
    let compare = |place: &Place| {
        let (truth, answer) = (full(place).ok()?, model.steady(&place.condition, &place.parameters).ok()?);
        let errors = truth.readings.iter().zip(&answer.readings).map(|(t, r)| (t - r).abs()).collect();
        // At held nodes the field is the condition's.
        let apart = |field: &Field| {
            let rise = field.rise(answer.state.amplitudes.iter().copied());
            truth.rise.iter().zip(rise).map(|(t, r)| (t - r).abs()).fold(0.0, f64::max)
        };
        let apart = field.as_ref().map_or(0.0, apart);
        Some(((errors, answer), apart))
    };
    let (compared, apart): (Vec<(Vec<f64>, Answer)>, Vec<f64>) =
        places.par_iter().filter_map(compare).collect::<Vec<_>>().into_iter().unzip();
    if let Some(field) = &mut field {
        field.largest_error = apart.into_iter().fold(0.0, f64::max);
    }
    if 2 * compared.len() < CHECKS {
        let what = format!("the bound cannot be calibrated: only {} of {CHECKS} conditions could be compared", compared.len());
        return Err(Error::numerics(what).help("narrow the ranges with --range"));
    }
    let found = Calibrated::at(&compared);
    let model = ReducedModel { margin: found.margin, floor: found.floor, ..model };
    let widened = |answer: &Answer| model.bounds(&answer.readings, &answer.finer);
    let largest = compared.iter().flat_map(|(_, answer)| widened(answer)).fold(0.0, f64::max);
    let made = Made {
        solved: snapshots.len(),
        failed,
        checks: compared.len(),
        largest_error: found.worst,
        largest_bound: largest,
        cells: study.model.mesh.cells,
        nodes: network.nodes,
        conductors: ground.split.conductors(),
        seconds: clock.elapsed().as_secs_f64(),
    };
    let in_time = if checks.is_empty() { None } else { Some(calibrated(&model, &checks, settings.histories)?) };
    Ok(ReducedModel { in_time, field, made, ..model })
}

struct Offline<'a> {
    study: &'a Study,
    ranges: &'a [(f64, f64)],
    parameters: &'a [OpenParameter],
}

impl Offline<'_> {
    /// Variables that have a width, and parameters.
    fn axes(&self) -> usize {
        self.ranges.iter().filter(|(low, high)| high > low).count() + self.parameters.len()
    }

    /// The place at shares of all widths, each 0 to 1.
    fn place(&self, shares: &[f64]) -> Place {
        let mut shares = shares.iter();
        let mut share = || shares.next().copied().unwrap_or(0.5);
        let value = |low: f64, high: f64, share: f64| low + share * (high - low);
        let si = self.ranges.iter().map(|(low, high)| if high > low { value(*low, *high, share()) } else { *low }).collect();
        let parameters = self.parameters.iter().map(|p| value(p.low, p.high, share())).collect();
        Place { condition: Condition::from_si(si), parameters }
    }

    /// The full model there.
    fn full(&self, place: &Place, solver: &Solver<'_>, ground: &Ground<'_>) -> Result<Snapshot> {
        let near = ground.center();
        let (machine, network) = (&self.study.model.machine, &self.study.model.network);
        let mut load = Load::at(machine, &place.condition)?;
        if place.parameters.is_empty() {
            let solution = solver.steady_from(&load, near)?;
            return Ok(ground.snapshot(&load, &solution.streams, &solution.temperatures));
        }
        let (mut own, mut rest) = (network.clone(), ground.split.rest.clone());
        for (parameter, value) in self.parameters.iter().zip(&place.parameters) {
            let mut unused = load.clone();
            parameter.set(*value, machine, &mut rest, &mut unused);
            parameter.set(*value, machine, &mut own, &mut load);
        }
        let solution = Solver::near(&own, &load, near.to_vec())?.steady(&load)?;
        Ok(Snapshot::of(&own, &rest, &load, &solution.streams, &solution.temperatures, near))
    }
}
