//! Making a reduced model: full solves where the bound is largest, until it is small enough everywhere.

use std::time::Instant;

use rayon::prelude::*;

use super::assemble::Snapshot;
use super::basis::ModeBasis;
use super::calibration::{Calibration, ComparedAnswer, LEAST_MARGIN};
use super::fields::ModeField;
use super::growth::{AIM, BasisGrowth, FIRST, Grown, Guess, ROUND};
use super::model::{Made, ReducedAnswer, ReducedModel};
use super::reference::{COARSE, ReferenceNetwork, SAMPLING};
use super::training_runs::{HistoryPlan, TrainingRun, calibrated};
use coldplate_base::error::{Error, Result};
use coldplate_base::progress::{Progress, Silent};
use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_network::{Load, Network};
use coldplate_solve::sensitivity::OpenParameter;
use coldplate_solve::study::Study;
use coldplate_solve::{Solver, SteadySettings};

/// Fewest conditions that a model is made of, a count. Chosen: fewer leave too few modes for a bound.
const LEAST: usize = 8;
/// Number of random conditions that the next ones to be solved are taken from. Chosen: more find worse places, each
/// costs an answer of the reduced model a round.
const POOL: usize = 192;
/// Number of random conditions, solved in full, that the bound is calibrated on. Chosen: each costs a full solve,
/// fewer may miss the worst reading.
const CHECKS: usize = 60;
/// Number of further random conditions at which the calibrated bound must keep the accuracy too. Chosen: they cost an
/// answer of the reduced model each, no full solve.
const UNSEEN: usize = 512;
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
pub struct ReduceSettings {
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
struct Place {
    condition: Condition,
    parameters: Vec<f64>,
}

impl Place {
    /// Answer of a model.
    fn steady(&self, model: &ReducedModel) -> Result<ReducedAnswer> {
        model.steady(&self.condition, &self.parameters)
    }
}

/// Space that conditions are drawn from.
#[derive(Clone, Copy)]
struct Space<'a> {
    /// Range of each variable of the machine, SI.
    ranges: &'a [(f64, f64)],
    parameters: &'a [OpenParameter],
}

impl Space<'_> {
    /// Number of variables that have a width, and of parameters.
    fn axes(&self) -> usize {
        self.ranges.iter().filter(|(low, high)| high > low).count() + self.parameters.len()
    }

    /// Checks that something varies and that enough conditions may be solved in full.
    fn check(&self, most: usize) -> Result<()> {
        if self.axes() == 0 {
            return Err(Error::input("nothing varies: no variable has a range")
                .help("state one, for example --range coolant_flow=\"2 L/min .. 18 L/min\""));
        }
        if most < LEAST {
            let error = Error::input(format!("at least {LEAST} conditions must be solved in full")).at_key("--max-runs").read(most);
            return Err(error.help("leave it out, or allow more"));
        }
        Ok(())
    }

    /// The place at shares of the widths, each 0 to 1, in the order of the axes.
    fn place(&self, mut share: impl FnMut() -> f64) -> Place {
        let mut value = |low: f64, high: f64| low + share() * (high - low);
        let si = self.ranges.iter().map(|(low, high)| if high > low { value(*low, *high) } else { *low }).collect();
        let parameters = self.parameters.iter().map(|p| value(p.low, p.high)).collect();
        Place { condition: Condition::from_si(si), parameters }
    }

    /// Random places.
    fn draw(&self, count: usize, random: &mut Random) -> Vec<Place> {
        (0..count).map(|_| self.place(|| random.unit())).collect()
    }
}

/// Makes a reduced model of a machine.
///
/// # Errors
/// The machine has a controller; nothing varies, or too few conditions may be solved; a full solve fails in the middle of the ranges, or at most conditions;
/// the reduced model finds no steady state at most conditions of the calibration.
pub fn reduce(study: &Study, settings: &ReduceSettings, progress: &dyn Progress) -> Result<ReducedModel> {
    let (machine, network) = (&study.model.machine, &study.model.network);
    machine.without_controllers("a reduced model")?;
    let clock = Instant::now();
    let open = if settings.with_parameters { study.open_parameters(true)? } else { Vec::new() };
    let (parameters, left_out): (Vec<OpenParameter>, Vec<OpenParameter>) = open.into_iter().partition(OpenParameter::is_direct);
    let space = Space { ranges: &settings.ranges, parameters: &parameters };
    space.check(settings.most)?;
    let middle = space.place(|| 0.5).condition;
    let load = Load::at(machine, &middle)?;
    let solver = study.model.solver_heard(&middle, progress)?;
    let center = solver.steady(&load)?;
    let reference = ReferenceNetwork::new(machine, network, load, center, settings.accuracy);
    let offline = Offline { study, settings, space, solver: &solver, reference: &reference };
    let mut random = Random::new(settings.seed);
    let first = (FIRST.0 + FIRST.1 * space.axes()).min(settings.most);
    let [places, checks, unseen] = [first + POOL, CHECKS, UNSEEN].map(|count| space.draw(count, &mut random));
    let steady = |model: &ReducedModel, at: usize| places[at].steady(model);
    let round = |solved: usize, open: usize, _: usize| if solved + ROUND <= settings.most && open >= ROUND { ROUND } else { 0 };
    let mut solve = |at: &[usize], known: Option<&Grown>| -> Result<Vec<Snapshot>> {
        Ok(at.par_iter().filter_map(|at| offline.full(&places[*at], known).ok()).collect())
    };
    let mut growth = BasisGrowth {
        reference: &reference,
        ranges: &settings.ranges,
        parameters: parameters.clone(),
        left_out: left_out.into_iter().map(|p| p.name).collect(),
        steady: &steady,
        round: &round,
        margin: LEAST_MARGIN,
        open: (0..places.len()).collect(),
        snapshots: Vec::new(),
        failed: 0,
        worst: 0.0,
    };
    progress.at(&format!("solving {first} conditions in full"));
    growth.add(&(0..first).collect::<Vec<_>>(), None, &mut solve)?;
    let mut aim = AIM * settings.accuracy;
    let mut grown = growth.until(growth.grown()?, aim, &mut solve, progress)?;
    let past = match settings.histories {
        0 => None,
        _ => Some(Past::run(&offline, grown.model.fine.slowest(&Load::at(machine, &middle)?)?, progress)?),
    };
    progress.at(&format!("solving {CHECKS} further conditions in full to compare with"));
    let truths: Vec<(&Place, Snapshot)> =
        checks.par_iter().filter_map(|place| Some((place, offline.full(place, Some(&grown)).ok()?))).collect();
    let mut attempts = ATTEMPTS;
    let model = loop {
        let all = match &past {
            None => grown,
            Some(past) => past.added(&reference, grown, &growth.snapshots, progress),
        };
        let model = offline.calibrated(all, &truths, &unseen)?;
        let largest = model.made.largest_bound;
        attempts -= 1;
        if largest <= settings.accuracy || attempts == 0 || round(growth.snapshots.len(), growth.open.len(), 0) == 0 {
            break model;
        }
        // The margin from the comparison is larger than the aim allowed for.
        aim = FURTHER * aim.min(growth.worst) * settings.accuracy / largest;
        progress.at(&format!("calibrated, the largest bound is {largest:.1e} K: more conditions are needed"));
        grown = growth.until(growth.grown()?, aim, &mut solve, progress)?;
    };
    let made = Made {
        solved: growth.snapshots.len(),
        failed: growth.failed,
        cells: study.model.mesh.cells,
        nodes: network.nodes,
        conductors: reference.parts.conductors(),
        seconds: clock.elapsed().as_secs_f64(),
        ..model.made
    };
    // Work that serves steady states is not lost with the histories.
    let (in_time, untimed) = match past.map(|past| calibrated(&model, &past.checks, settings.histories)).transpose() {
        Ok(in_time) => (in_time, None),
        Err(error) => (None, Some(error.what().to_string())),
    };
    Ok(ReducedModel { in_time, untimed, made, ..model })
}

/// Histories run in full.
struct Past {
    /// States that the modes are enriched with.
    snapshots: Vec<Snapshot>,
    /// Histories that the bound over time is calibrated on.
    checks: Vec<(HistoryPlan, TrainingRun)>,
}

impl Past {
    /// `slowest` is the machine's longest time constant, s.
    fn run(offline: &Offline<'_>, slowest: f64, progress: &dyn Progress) -> Result<Self> {
        let (machine, network, histories) = (&offline.study.model.machine, &offline.study.model.network, offline.settings.histories);
        let mut random = Random::new(offline.settings.seed ^ HISTORIES);
        let condition = |random: &mut Random| offline.space.place(|| random.unit()).condition;
        let plan = |number: usize| HistoryPlan::random(number, slowest, &mut random, condition, machine);
        let mut plans: Vec<HistoryPlan> = (0..histories + HISTORY_CHECKS).map(plan).collect::<Result<_>>()?;
        progress.at(&format!("running {} histories in full", plans.len()));
        let one = |(number, plan): (usize, &HistoryPlan)| plan.run(machine, network, (number < histories).then_some(offline.reference));
        let mut runs: Vec<TrainingRun> = plans.par_iter().enumerate().map(one).collect::<Result<_>>()?;
        let tests = runs.split_off(histories);
        let checks = plans.split_off(histories).into_iter().zip(tests).collect();
        Ok(Self { snapshots: runs.into_iter().flat_map(|run| run.snapshots).collect(), checks })
    }

    /// A model of the steady states with the modes that histories add, and all its modes.
    fn added(&self, reference: &ReferenceNetwork<'_>, grown: Grown, steady: &[Snapshot], progress: &dyn Progress) -> Grown {
        let Grown { model, basis } = grown;
        let rises: Vec<Vec<f64>> = self.snapshots.iter().map(|s| s.rise.clone()).collect();
        let (energy, assembly) = (reference.energy(), reference.assembly());
        let enriched = |steady: Vec<Vec<f64>>, most: usize| {
            let steady = ModeBasis { modes: steady };
            let moving = steady.beyond(&rises, &energy, most).modes;
            [steady.modes, moving].concat()
        };
        let few = |count: usize| ((count as f64 * COARSE) as usize).max(1);
        let coarse = enriched(basis.modes[..few(basis.modes.len()).min(basis.modes.len())].to_vec(), few(MODES_IN_TIME));
        let fine = enriched(basis.modes, MODES_IN_TIME);
        let all: Vec<Snapshot> = steady.iter().chain(&self.snapshots).cloned().collect();
        progress.at(&format!("{} states in all, {} modes: choosing conductors", all.len(), fine.len()));
        let level = |modes: &[Vec<f64>], sampling| assembly.level(modes, &all, steady.len(), sampling);
        let model = ReducedModel { coarse: level(&coarse, SAMPLING[0]), fine: level(&fine, SAMPLING[1]), ..model };
        Grown { model, basis: ModeBasis { modes: fine } }
    }
}

/// Full solutions, and comparisons of models with them.
struct Offline<'a> {
    study: &'a Study,
    settings: &'a ReduceSettings,
    space: Space<'a>,
    /// Solver of the network with the file's values of all parameters.
    solver: &'a Solver<'a>,
    reference: &'a ReferenceNetwork<'a>,
}

impl Offline<'_> {
    /// Full solution at a place, started from the field of a model, or else from the middle of the ranges.
    fn full(&self, place: &Place, known: Option<&Grown>) -> Result<Snapshot> {
        let center = self.reference.center();
        let (machine, network) = (&self.study.model.machine, &self.study.model.network);
        let mut load = Load::at(machine, &place.condition)?;
        let near = |network: &Network, load: &Load| {
            let guessed = known.and_then(|known| known.guess(&place.condition, &place.parameters, network, load, center));
            guessed.unwrap_or_else(|| Guess { temperatures: center.to_vec(), error: f64::INFINITY })
        };
        if place.parameters.is_empty() {
            let Guess { temperatures, error } = near(network, &load);
            let solution = self.solver.steady_from(&load, &temperatures, error)?;
            return Ok(self.reference.snapshot(&load, &solution.streams, &solution.temperatures));
        }
        let (mut own, mut rest) = (network.clone(), self.reference.parts.rest.clone());
        for (parameter, value) in self.space.parameters.iter().zip(&place.parameters) {
            let mut unused = load.clone();
            parameter.set(*value, machine, &mut rest, &mut unused);
            parameter.set(*value, machine, &mut own, &mut load);
        }
        let start = near(&own, &load).temperatures;
        let solution = Solver::near(&own, &load, start, SteadySettings::default(), &Silent)?.steady(&load)?;
        Ok(Snapshot::of(&own, &rest, &load, &solution.streams, &solution.temperatures, center))
    }

    /// A model with its bound calibrated on full solutions, its largest bound there and at `unseen` places, and its field if wanted.
    ///
    /// # Errors
    /// The model finds a steady state at fewer than half of the conditions.
    fn calibrated(&self, grown: Grown, truths: &[(&Place, Snapshot)], unseen: &[Place]) -> Result<ReducedModel> {
        let Grown { model, basis } = grown;
        let both = truths
            .par_iter()
            .filter_map(|(place, truth)| Some((ComparedAnswer::of(place.steady(&model).ok()?, &truth.readings), &truth.rise)));
        let (compared, rises): (Vec<ComparedAnswer>, Vec<&Vec<f64>>) = both.collect::<Vec<_>>().into_iter().unzip();
        if 2 * compared.len() < CHECKS {
            let what = format!("the bound cannot be calibrated: only {} of {CHECKS} conditions could be compared", compared.len());
            return Err(Error::numerics(what).help("narrow the ranges with --range"));
        }
        let field = self.settings.with_field.then(|| {
            let (solids, element_size) = (self.study.model.network.solids, self.study.model.mesh.element_size);
            let field = ModeField::of(&basis.modes, &self.reference.center()[..solids], element_size);
            let apart = rises.iter().zip(&compared).map(|(rise, own)| field.apart(rise, own.answer.state.amplitudes.iter().copied()));
            let largest_error = apart.fold(0.0, f64::max);
            ModeField { largest_error, ..field }
        });
        let found = Calibration::at(&compared);
        let model = ReducedModel { margin: found.margin, floor: found.floor, field, ..model };
        let at_checks = compared.iter().flat_map(|own| model.bounds(&own.answer.readings, &own.answer.finer)).fold(0.0, f64::max);
        let bound = |place: &Place| place.steady(&model).map_or(0.0, |answer| answer.largest_bound());
        let largest_bound = unseen.par_iter().map(bound).reduce(|| at_checks, f64::max);
        let made = Made { checks: compared.len(), largest_error: found.worst, largest_bound, ..Made::default() };
        Ok(ReducedModel { made, ..model })
    }
}
