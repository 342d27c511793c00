//! Making a reduced model: full solves where the bound is largest, until it is small enough everywhere.

use std::time::Instant;

use rayon::prelude::*;

use super::assemble::Snapshot;
use super::basis::Basis;
use super::cell_fields::Guess;
use super::model::{Answer, Made, ReducedModel};
use super::modes_field::Field;
use super::reference::{COARSE, Calibrated, Ground, SAMPLING};
use super::training_runs::{Plan, Run, calibrated};
use coldplate_base::error::{Error, Result};
use coldplate_base::progress::{Progress, Silent};
use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_network::{Load, Network};
use coldplate_solve::Solver;
use coldplate_solve::sensitivity::{OpenParameter, Study};

/// Number of conditions solved in full before the first reduced model: `FIRST.0 + FIRST.1` · axes. Chosen: fewer make
/// the first bound a poor guide to the next conditions, more may be wasted.
const FIRST: (usize, usize) = (16, 4);
/// Fewest conditions that a model is made of, a count. Chosen: fewer leave too few modes for a bound.
const LEAST: usize = 8;
/// Number of random conditions that the next ones to be solved are taken from. Chosen: more find worse places, each
/// costs an answer of the reduced model a round.
const POOL: usize = 192;
/// Number of conditions solved in each round. Chosen: fewer are placed better, more use the cores better.
const ROUND: usize = 8;
/// Number of random conditions, solved in full, that the bound is calibrated on. Chosen: each costs a full solve,
/// fewer may miss the worst reading.
const CHECKS: usize = 60;
/// Number of further random conditions at which the calibrated bound must keep the accuracy too. Chosen: they cost an
/// answer of the reduced model each, no full solve.
const UNSEEN: usize = 512;
/// Share of the accuracy that the bounds with the least margin must keep while conditions are added. Chosen below one,
/// because the calibrated margin is larger and untried conditions may be worse.
const AIM: f64 = 0.4;
/// Factor on the aim, dimensionless, beyond the ratio of accuracy to largest bound, if the calibrated bound misses
/// the accuracy. Chosen: smaller needs fewer attempts, larger fewer solves.
const FURTHER: f64 = 0.8;
/// Number of calibrations at most, the first included. Chosen: each further one solves more conditions in full.
const ATTEMPTS: usize = 4;
/// Number of histories run in full that the bound over time is calibrated on. Chosen: each costs a full run.
const HISTORY_CHECKS: usize = 2;
/// Number of modes that histories add at most. Chosen: more follow faster changes, each makes an answer slower.
const MODES_IN_TIME: usize = 48;
/// Mask on the seed, a number without meaning, so that histories draw other conditions than the steady states.
const HISTORIES: u64 = 0x7131;

/// Settings of a reduced model that is to be made.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Largest bound wanted on any reading, K.
    pub accuracy: f64,
    /// Range of each variable of the machine, SI; both ends equal where it is held.
    pub ranges: Vec<(f64, f64)>,
    /// Whether parameters that the machine file leaves open may take other values.
    pub with_parameters: bool,
    /// Most conditions that may be solved in full, the calibration not counted.
    pub most: usize,
    /// Number of histories run in full to make the model follow time; with zero it knows steady states only.
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
/// Nothing varies, or too few conditions may be solved; a full solve fails in the middle of the ranges, or at most conditions;
/// the reduced model finds no steady state at most conditions of the calibration.
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
    let solver = study.model.solver_heard(&middle.condition, progress)?;
    let center = solver.steady(&load)?;
    let ground = Ground::new(machine, network, load, center, settings.accuracy);
    let full = |place: &Place, known: Option<&Grown>| offline.full(place, known, &solver, &ground);
    let mut random = Random::new(settings.seed);
    let mut draw = |count: usize| -> Vec<Place> {
        (0..count).map(|_| offline.place(&(0..offline.axes()).map(|_| random.unit()).collect::<Vec<_>>())).collect()
    };
    let first = draw((FIRST.0 + FIRST.1 * offline.axes()).min(settings.most));
    let left_out = left_out.into_iter().map(|p| p.name).collect();
    let mut growth =
        Growth { ground: &ground, settings, parameters: &parameters, left_out, pool: draw(POOL), snapshots: Vec::new(), failed: 0 };
    let places = draw(CHECKS);
    let unseen = draw(UNSEEN);
    progress.at(&format!("solving {} conditions in full", first.len()));
    growth.take(&first, None, &full);
    let mut aim = AIM * settings.accuracy;
    let mut grown = growth.until(aim, &full, progress)?;
    let past = if settings.histories == 0 {
        None
    } else {
        Some(Past::run(&offline, &ground, settings, grown.model.fine.slowest(&Load::at(machine, &middle.condition)?)?, progress)?)
    };
    progress.at(&format!("solving {CHECKS} further conditions in full to compare with"));
    let truths: Vec<(&Place, Snapshot)> = places.par_iter().filter_map(|place| Some((place, full(place, Some(&grown)).ok()?))).collect();
    let mut attempts = ATTEMPTS;
    loop {
        let (model, modes) = match &past {
            None => (grown.model, grown.basis.modes),
            Some(past) => past.added(&ground, grown.model, grown.basis, &growth.snapshots, progress),
        };
        let mut field = settings.with_field.then(|| Field::of(&modes, &ground.center()[..network.solids], study.model.mesh.element_size));
        let compared = compared(&model, &truths)?;
        if let Some(field) = &mut field {
            let apart = |((_, truth), own): (&(&Place, Snapshot), &Option<Compared>)| {
                own.as_ref().map(|(_, answer)| field.apart(&truth.rise, answer.state.amplitudes.iter().copied()))
            };
            field.largest_error = truths.iter().zip(&compared).filter_map(apart).fold(0.0, f64::max);
        }
        let compared: Vec<Compared> = compared.into_iter().flatten().collect();
        let found = Calibrated::at(&compared);
        let model = ReducedModel { margin: found.margin, floor: found.floor, ..model };
        let widest = |answer: &Answer| model.bounds(&answer.readings, &answer.finer).into_iter().fold(0.0, f64::max);
        let at_checks = compared.iter().map(|(_, answer)| widest(answer)).fold(0.0, f64::max);
        let bound = |place: &Place| model.steady(&place.condition, &place.parameters).map_or(0.0, |answer| widest(&answer));
        let largest = unseen.par_iter().map(bound).reduce(|| at_checks, f64::max);
        attempts -= 1;
        if largest > settings.accuracy && attempts > 0 && growth.goes_on() {
            // The margin from the comparison is larger than the aim allowed for.
            aim = FURTHER * aim.min(grown.worst) * settings.accuracy / largest;
            progress.at(&format!("calibrated, the largest bound is {largest:.1e} K: more conditions are needed"));
            grown = growth.until(aim, &full, progress)?;
            continue;
        }
        let made = Made {
            solved: growth.snapshots.len(),
            failed: growth.failed,
            checks: compared.len(),
            largest_error: found.worst,
            largest_bound: largest,
            cells: study.model.mesh.cells,
            nodes: network.nodes,
            conductors: ground.split.conductors(),
            seconds: clock.elapsed().as_secs_f64(),
        };
        let in_time = past.map(|past| calibrated(&model, &past.checks, settings.histories)).transpose()?;
        return Ok(ReducedModel { in_time, field, made, ..model });
    }
}

/// Errors of a model's readings at one condition, K, with its answer.
type Compared = (Vec<f64>, Answer);

/// Errors of a model's readings at conditions solved in full, with its answers; none if it finds no steady state.
///
/// # Errors
/// The model finds a steady state at fewer than half of the conditions.
fn compared(model: &ReducedModel, truths: &[(&Place, Snapshot)]) -> Result<Vec<Option<Compared>>> {
    let compare = |(place, truth): &(&Place, Snapshot)| {
        let answer = model.steady(&place.condition, &place.parameters).ok()?;
        Some((truth.readings.iter().zip(&answer.readings).map(|(t, r)| (t - r).abs()).collect(), answer))
    };
    let compared: Vec<Option<Compared>> = truths.par_iter().map(compare).collect();
    let count = compared.iter().flatten().count();
    if 2 * count < CHECKS {
        let what = format!("the bound cannot be calibrated: only {count} of {CHECKS} conditions could be compared");
        return Err(Error::numerics(what).help("narrow the ranges with --range"));
    }
    Ok(compared)
}

/// A full solve, started from a reduced model's field if there is one.
type Full<'f> = dyn Fn(&Place, Option<&Grown>) -> Result<Snapshot> + Sync + 'f;

/// A model whose bounds are within the aim, or as small as the allowed solves make them.
struct Grown {
    model: ReducedModel,
    basis: Basis,
    /// Largest bound in the pool, with the least margin, K.
    worst: f64,
}

/// Full solves so far, and the pool of conditions for further ones.
struct Growth<'a> {
    ground: &'a Ground<'a>,
    settings: &'a Settings,
    parameters: &'a [OpenParameter],
    left_out: Vec<String>,
    pool: Vec<Place>,
    snapshots: Vec<Snapshot>,
    failed: usize,
}

impl Growth<'_> {
    fn take(&mut self, places: &[Place], known: Option<&Grown>, full: &Full<'_>) {
        let solved: Vec<Option<Snapshot>> = places.par_iter().map(|place| full(place, known).ok()).collect();
        self.failed += solved.iter().filter(|s| s.is_none()).count();
        self.snapshots.extend(solved.into_iter().flatten());
    }

    /// Whether another round of full solves is allowed.
    fn goes_on(&self) -> bool {
        self.snapshots.len() + ROUND <= self.settings.most && self.pool.len() >= ROUND
    }

    /// Solves in full where the bound is largest, until none is above `aim`.
    fn until(&mut self, aim: f64, full: &Full<'_>, progress: &dyn Progress) -> Result<Grown> {
        loop {
            let (model, basis) = self.ground.model(&self.snapshots, &self.settings.ranges)?;
            let model = ReducedModel { parameters: self.parameters.to_vec(), left_out: self.left_out.clone(), ..model };
            // A full solve tells most at a condition with the largest bound, or without a steady state of the reduced
            // model.
            let bound = |place: &Place| match model.steady(&place.condition, &place.parameters) {
                Ok(answer) => answer.bounds.iter().fold(0.0, |m: f64, b| m.max(*b)),
                Err(_) => f64::INFINITY,
            };
            let bounds: Vec<f64> = self.pool.par_iter().map(bound).collect();
            let worst = bounds.iter().fold(0.0, |m: f64, b| m.max(*b));
            let (solved, fine) = (self.snapshots.len(), basis.modes.len());
            progress.at(&format!("{solved} conditions solved in full, {fine} modes: largest bound {worst:.1e} K"));
            let grown = Grown { model, basis, worst };
            if worst <= aim || !self.goes_on() {
                return Ok(grown);
            }
            let mut order: Vec<usize> = (0..self.pool.len()).collect();
            order.sort_by(|a, b| bounds[*b].total_cmp(&bounds[*a]).then(a.cmp(b)));
            order.truncate(ROUND);
            let next: Vec<Place> = order.iter().map(|i| self.pool[*i].clone()).collect();
            let mut at = 0..;
            self.pool.retain(|_| !at.next().is_some_and(|i| order.contains(&i)));
            self.take(&next, Some(&grown), full);
        }
    }
}

/// Histories run in full.
struct Past {
    /// States that the modes are enriched with.
    snapshots: Vec<Snapshot>,
    /// Histories that the bound over time is calibrated on.
    checks: Vec<(Plan, Run)>,
}

impl Past {
    /// `slowest` is the machine's longest time constant, s.
    fn run(offline: &Offline<'_>, ground: &Ground<'_>, settings: &Settings, slowest: f64, progress: &dyn Progress) -> Result<Self> {
        let (machine, network) = (&offline.study.model.machine, &offline.study.model.network);
        let mut random = Random::new(settings.seed ^ HISTORIES);
        let condition = |random: &mut Random| {
            let mut place = offline.place(&(0..offline.axes()).map(|_| random.unit()).collect::<Vec<_>>());
            place.parameters.clear();
            place.condition
        };
        let plan = |number: usize| Plan::random(number, slowest, &mut random, condition, machine);
        let mut plans: Vec<Plan> = (0..settings.histories + HISTORY_CHECKS).map(plan).collect::<Result<_>>()?;
        progress.at(&format!("running {} histories in full", plans.len()));
        let states = Some((&ground.split.rest, ground.center()));
        let one = |(number, plan): (usize, &Plan)| plan.run(machine, network, states.filter(|_| number < settings.histories));
        let mut runs: Vec<Run> = plans.par_iter().enumerate().map(one).collect::<Result<_>>()?;
        let tests = runs.split_off(settings.histories);
        let checks = plans.split_off(settings.histories).into_iter().zip(tests).collect();
        Ok(Self { snapshots: runs.into_iter().flat_map(|run| run.snapshots).collect(), checks })
    }

    /// A model of steady states with the modes that histories add, and all its modes.
    fn added(
        &self,
        ground: &Ground<'_>,
        model: ReducedModel,
        basis: Basis,
        steady: &[Snapshot],
        progress: &dyn Progress,
    ) -> (ReducedModel, Vec<Vec<f64>>) {
        let rises: Vec<Vec<f64>> = self.snapshots.iter().map(|s| s.rise.clone()).collect();
        let (energy, assembly) = (ground.energy(), ground.assembly());
        let enriched = |steady: Vec<Vec<f64>>, most: usize| {
            let steady = Basis { modes: steady };
            let moving = Basis::of(&steady.without(&rises, &energy), &energy, most).modes;
            [steady.modes, moving].concat()
        };
        let few = |count: usize| ((count as f64 * COARSE) as usize).max(1);
        let coarse = enriched(basis.modes[..few(basis.modes.len()).min(basis.modes.len())].to_vec(), few(MODES_IN_TIME));
        let fine = enriched(basis.modes, MODES_IN_TIME);
        let all: Vec<Snapshot> = steady.iter().chain(&self.snapshots).cloned().collect();
        progress.at(&format!("{} states in all, {} modes: choosing conductors", all.len(), fine.len()));
        let levels = (assembly.level(&coarse, &all, steady.len(), SAMPLING[0]), assembly.level(&fine, &all, steady.len(), SAMPLING[1]));
        (ReducedModel { coarse: levels.0, fine: levels.1, ..model }, fine)
    }
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

    /// Full solution at a place, started from the field of a reduced model, or else from the middle of the ranges.
    fn full(&self, place: &Place, known: Option<&Grown>, solver: &Solver<'_>, ground: &Ground<'_>) -> Result<Snapshot> {
        let center = ground.center();
        let (machine, network) = (&self.study.model.machine, &self.study.model.network);
        let mut load = Load::at(machine, &place.condition)?;
        let near = |network: &Network, load: &Load| {
            let guessed = known.and_then(|known| {
                let answer = known.model.steady(&place.condition, &place.parameters).ok()?;
                known.model.guess(&answer, (network, load), center, &known.basis.modes).ok()
            });
            guessed.unwrap_or_else(|| Guess { temperatures: center.to_vec(), error: f64::INFINITY })
        };
        if place.parameters.is_empty() {
            let Guess { temperatures, error } = near(network, &load);
            let solution = solver.steady_from(&load, &temperatures, error)?;
            return Ok(ground.snapshot(&load, &solution.streams, &solution.temperatures));
        }
        let (mut own, mut rest) = (network.clone(), ground.split.rest.clone());
        for (parameter, value) in self.parameters.iter().zip(&place.parameters) {
            let mut unused = load.clone();
            parameter.set(*value, machine, &mut rest, &mut unused);
            parameter.set(*value, machine, &mut own, &mut load);
        }
        let start = near(&own, &load).temperatures;
        let solution = Solver::near(&own, &load, start, &Silent)?.steady(&load)?;
        Ok(Snapshot::of(&own, &rest, &load, &solution.streams, &solution.temperatures, center))
    }
}
