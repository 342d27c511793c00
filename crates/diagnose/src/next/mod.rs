//! What to measure next: the conditions, interventions and sensors that settle most of what the surviving explanations leave open, for what
//! they cost.

mod costs;
mod outlook;
mod proposed;
mod steady;
mod trial;
mod worth;

use rayon::prelude::*;

use super::predictor::Predictor;
use super::{Cause, Explanation, Problem, Verdict};
use coldplate_base::error::Result;
use coldplate_describe::machine::Condition;
use coldplate_solve::study::Study;
use outlook::Outlook;
pub(super) use proposed::{Proposed, with_all_proposed};
use worth::Stakes;

pub use costs::Costs;
pub use trial::Trial;
pub use worth::{Expected, Worth};

/// Most explanations that are told apart.
const MOST: usize = 6;
/// Steady conditions, and interventions, that are proposed.
const PROPOSED: usize = 3;
/// Of each kind, tests whose worth is found: those that set the explanations furthest apart for their cost.
const JUDGED: usize = 12;
/// Cells that tests are ranked on: what is found in one is fitted on the machine's own mesh.
const CELLS: usize = 1000;
/// Least distance worth a test, in standard deviations.
const TELLING: f64 = 1.0;
/// Drops in a probability that differ by less than this are the same: they are means of draws.
const SAME: f64 = 0.01;

/// A test worth making.
#[derive(Debug, Clone, PartialEq)]
pub struct Next {
    /// What is done.
    pub trial: Trial,
    /// The condition it is done at, or begins with.
    pub condition: Condition,
    /// Distance of the two explanations it tells apart least, in standard deviations, over all sensors of the data and the further one.
    pub separation: f64,
    /// The probability-weighted mean distance.
    pub mean: f64,
    /// A sensor that the data lack and that this test needs.
    pub sensor: Option<ExtraSensor>,
    /// What it costs; see [`Costs`].
    pub cost: f64,
    /// What it is expected to settle.
    pub worth: Worth,
}

impl Next {
    /// Whether another test of this kind settles no more than this one.
    fn is_as_good_as(&self, other: &Self) -> bool {
        let name = |n: &Self| n.sensor.as_ref().map(|s| s.name.clone());
        let settles = |n: &Self| n.worth.wrong_name.drop();
        self.trial == other.trial && name(self) == name(other) && settles(other) < settles(self) + SAME
    }
}

/// A sensor that the data lack.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtraSensor {
    /// Its name in the machine file.
    pub name: String,
    /// Its entry in the machine file, as TOML, where it does not exist yet.
    pub entry: Option<String>,
    /// Distance of the two most probable explanations by it alone, in standard deviations.
    pub separation: f64,
}

/// Ranks feasible tests: first what makes a wrong name least probable for its cost. Empty where fewer than two explanations survive, or no
/// test tells them apart. Interventions are only proposed where one of the explanations is right: they are solved with each cause in force.
///
/// # Errors
/// As [`super::signatures`].
pub(super) fn next(predictor: &Predictor<'_>, problem: &Problem, verdict: Verdict, explanations: &[&Explanation]) -> Result<Vec<Next>> {
    let is_finite = |e: &&Explanation| e.causes.iter().all(|p| p.deviation.is_finite());
    let alive = explanations.iter().copied().take(MOST).filter(is_finite);
    let elsewhere = |cause: &Cause| {
        let (hypothesis, factor) = cause.hypothesis.elsewhere(predictor.scales);
        Cause { hypothesis, amplitude: factor * cause.amplitude, deviation: factor.abs() * cause.deviation, ..cause.clone() }
    };
    let alive: Vec<Explanation> = alive.map(|e| Explanation { causes: e.causes.iter().map(elsewhere).collect(), ..e.clone() }).collect();
    let alive: Vec<&Explanation> = alive.iter().collect();
    if alive.len() < 2 {
        return Ok(Vec::new());
    }
    let coarse = coarse(problem);
    let problem = coarse.as_ref().unwrap_or(problem);
    let with = proposed::with_proposed(problem, &alive)?;
    let (problem, proposed) = with.as_ref().map_or((problem, &[][..]), |(p, new)| (p, new.as_slice()));
    let predictor = Predictor { study: &problem.study, ..*predictor };
    let Some(steady) = steady::steady(problem, &alive, &predictor)? else { return Ok(Vec::new()) };
    let probabilities: Vec<f64> = alive.iter().map(|e| e.probability).collect();
    let scene = Scene { problem, proposed, probabilities: &probabilities, stakes: &steady.stakes };
    let tests = steady.conditions.iter().zip(&steady.outlooks);
    let mut found = scene.best(&tests.map(|(c, outlook)| Test::steady(c.clone(), outlook, problem)).collect::<Vec<_>>());
    if verdict == Verdict::CannotTell {
        let solved = trial::trials(&predictor, problem, &alive);
        found.extend(scene.best(&solved.iter().map(|t| Test::intervention(t, problem)).collect::<Vec<_>>()));
        found.sort_by(in_order);
    }
    Ok(found)
}

/// The problem on a coarser mesh, where its own is finer than what tests are ranked by needs.
pub(super) fn coarse(problem: &Problem) -> Option<Problem> {
    let fine = &problem.study;
    let study = (fine.model.mesh.cells > CELLS).then(|| Study::new(fine.document().clone(), Some(CELLS)).ok())??;
    (study.model.mesh.cells < fine.model.mesh.cells).then(|| Problem { study, ..problem.clone() })
}

/// The more a test settles for its cost the earlier; of equals, what sets the explanations further apart.
fn in_order(a: &Next, b: &Next) -> std::cmp::Ordering {
    let per_cost = |n: &Next| (n.worth.wrong_name.drop() / SAME).round() / n.cost;
    per_cost(b).total_cmp(&per_cost(a)).then(b.mean.total_cmp(&a.mean))
}

/// A test, with the readings of its outlook that belong to each sensor.
struct Test<'a> {
    trial: Trial,
    condition: Condition,
    outlook: &'a Outlook,
    /// Readings of the sensors of the data.
    own: Vec<usize>,
    /// Readings of each of the machine's sensors.
    of_sensor: Vec<Vec<usize>>,
}

impl<'a> Test<'a> {
    fn steady(condition: Condition, outlook: &'a Outlook, problem: &Problem) -> Self {
        Self::new(Trial::Steady, condition, outlook, problem, |_| true)
    }

    fn intervention(solved: &'a trial::Solved, problem: &Problem) -> Self {
        // The row before a step shows what the step's own row shows.
        let times = &solved.times;
        let is_once = |row: usize| times.get(row + 1).is_none_or(|next| *next != times[row] || next.is_none());
        Self::new(solved.trial.clone(), solved.condition.clone(), &solved.outlook, problem, is_once)
    }

    fn new(trial: Trial, condition: Condition, outlook: &'a Outlook, problem: &Problem, is_read: impl Fn(usize) -> bool) -> Self {
        let sensors = problem.study.model.machine.sensors.len();
        let mut of_sensor = vec![Vec::new(); sensors];
        (0..outlook.deviation.len()).filter(|i| is_read(i / sensors)).for_each(|i| of_sensor[i % sensors].push(i));
        let own = problem.data.sensors.iter().flat_map(|s| of_sensor[*s].iter().copied()).collect();
        Self { trial, condition, outlook, own, of_sensor }
    }

    fn with(&self, sensor: Option<usize>) -> Vec<usize> {
        self.own.iter().chain(sensor.into_iter().flat_map(|s| &self.of_sensor[s])).copied().collect()
    }
}

/// What all tests are rated by.
struct Scene<'a> {
    problem: &'a Problem,
    proposed: &'a [Proposed],
    probabilities: &'a [f64],
    stakes: &'a Stakes,
}

/// A test with a sensor or none beside those of the data.
struct Choice<'a> {
    test: &'a Test<'a>,
    readings: Vec<usize>,
    sensor: Option<ExtraSensor>,
    separation: f64,
    mean: f64,
    cost: f64,
}

impl Scene<'_> {
    /// Those worth proposing, in order.
    fn best(&self, tests: &[Test<'_>]) -> Vec<Next> {
        let mut choices: Vec<Choice<'_>> = tests.par_iter().flat_map_iter(|test| self.choices(test)).collect();
        choices.retain(|choice| choice.mean >= TELLING);
        // Twice the test at twice the cost has twice the square of the distance.
        let telling = |choice: &Choice<'_>| choice.mean * choice.mean / choice.cost;
        choices.sort_by(|a, b| telling(b).total_cmp(&telling(a)));
        choices.truncate(JUDGED);
        let mut found: Vec<Next> = choices.into_par_iter().map(|choice| self.judged(choice)).collect();
        found.sort_by(in_order);
        let mut proposed: Vec<Next> = Vec::new();
        for next in found {
            if proposed.len() < PROPOSED && !proposed.iter().any(|better| better.is_as_good_as(&next)) {
                proposed.push(next);
            }
        }
        proposed
    }

    /// A test as it is, and with the sensor that adds most for its cost.
    fn choices<'t>(&self, test: &'t Test<'t>) -> Vec<Choice<'t>> {
        let sensors = &self.problem.study.model.machine.sensors;
        let alone = self.choice(test, None);
        let further = (0..sensors.len()).filter(|s| !self.problem.data.sensors.contains(s)).map(|s| {
            let name = sensors[s].name.clone();
            let entry = self.proposed.iter().find(|p| p.name == name).map(|p| p.entry.clone());
            let separation = test.outlook.distance((0, 1), &test.of_sensor[s]);
            self.choice(test, Some((s, ExtraSensor { name, entry, separation })))
        });
        let gained = |choice: &Choice<'_>| choice.mean * choice.mean / choice.cost;
        let best = further.max_by(|a, b| gained(a).total_cmp(&gained(b))).filter(|best| gained(best) > gained(&alone));
        std::iter::once(alone).chain(best).collect()
    }

    fn choice<'t>(&self, test: &'t Test<'t>, sensor: Option<(usize, ExtraSensor)>) -> Choice<'t> {
        let (own, sensor) = sensor.map_or((None, None), |(s, sensor)| (Some(s), Some(sensor)));
        let readings = test.with(own);
        let (separation, mean) = test.outlook.apart(self.probabilities, &readings);
        let cost = self.problem.costs.of(&test.trial, sensor.as_ref());
        Choice { test, readings, sensor, separation, mean, cost }
    }

    fn judged(&self, choice: Choice<'_>) -> Next {
        let Choice { test, readings, sensor, separation, mean, cost } = choice;
        let worth = worth::worth(test.outlook, &readings, &self.probabilities[..test.outlook.shown.len()], self.stakes);
        Next { trial: test.trial.clone(), condition: test.condition.clone(), separation, mean, sensor, cost, worth }
    }
}
