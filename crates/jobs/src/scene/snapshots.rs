//! Temperatures of the surface of a machine at conditions of a surrogate, and over time.

use coldplate_base::error::{Error, Result};
use coldplate_base::progress::Progress;
use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_explore::sweep::design;
use coldplate_network::Load;
use coldplate_reduce::ReducedModel;
use coldplate_runtime::Surrogate;
use coldplate_solve::meshed::MeshedMachine;

use super::condition_of;
use super::surface::Surface;
use crate::trial::Trial;

/// Conditions at which the machine is solved, a count. Chosen: twice the points of a large machine.
const SOLVED: usize = 48;
/// Conditions at which a reduced model gives the field, a count. Chosen: more change the error that is stated by little.
const REDUCED: usize = 200;
/// Random histories of a reduced model, a count. Chosen: each is predicted from the others.
const HISTORIES: usize = 8;
/// Outputs of a history from one that is taken to the next, a count. Chosen: neighbours say the same.
const EVERY: usize = 2;
/// Seed of the conditions and histories, a number without meaning.
const SEED: u64 = 1;

/// Temperatures of a surface at conditions of a surrogate.
pub(super) struct Snapshots {
    /// Conditions, in the surrogate's units.
    pub(super) conditions: Vec<Vec<f64>>,
    /// Steady temperatures of the vertices, then of the stations of the channels, at each condition, degC.
    pub(super) steady: Vec<Vec<f64>>,
    /// Largest error of the field of the reduced model at any node, K, as the model states it; none of full solutions.
    pub(super) bound: Option<f64>,
    /// Largest bound of its readings over time, K, as the model states it.
    pub(super) bound_in_time: Option<f64>,
    /// Temperatures along each history.
    pub(super) histories: Vec<Vec<Moving>>,
}

/// Temperatures at a time of a history.
pub(super) struct Moving {
    /// The condition, in the surrogate's units.
    pub(super) x: Vec<f64>,
    /// States of the surrogate less those of the steady state at the condition.
    pub(super) away: Vec<f64>,
    /// Temperatures of the surface less those of that steady state, K.
    pub(super) rise: Vec<f64>,
}

impl Snapshots {
    /// Full solutions.
    pub(super) fn solved(model: &MeshedMachine, surface: &Surface, surrogate: &Surrogate<'_>, progress: &dyn Progress) -> Result<Self> {
        let conditions = conditions(surrogate, SOLVED);
        let asked: Vec<Condition> = conditions.iter().map(|x| condition_of(model, surrogate, x)).collect::<Result<_>>()?;
        let solver = model.solver(&asked[0])?;
        let mut steady = Vec::with_capacity(asked.len());
        for (done, condition) in asked.iter().enumerate() {
            progress.count(done, asked.len(), "conditions");
            steady.push(surface.temperatures(model, &model.solve(&solver, condition)?.solution.temperatures));
        }
        progress.count(asked.len(), asked.len(), "conditions");
        Ok(Self { conditions, steady, bound: None, bound_in_time: None, histories: Vec::new() })
    }

    /// Fields of a reduced model on its own mesh, those over time too where model and surrogate know them.
    pub(super) fn reduced(
        reduced: &ReducedModel,
        model: &MeshedMachine,
        surface: &Surface,
        surrogate: &Surrogate<'_>,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let conditions = conditions(surrogate, REDUCED);
        let steady_at = |condition: &Condition| -> Result<Vec<f64>> {
            let answer = reduced.steady(condition, &[])?;
            Ok(surface.temperatures(model, &reduced.temperatures(&answer, condition, &model.network)?))
        };
        progress.at("temperatures of the surface from the reduced model");
        let mut steady = Vec::with_capacity(conditions.len());
        for x in &conditions {
            let condition = condition_of(model, surrogate, x)?;
            if !reduced.is_inside(&condition) {
                return Err(Error::input("the reduced model was not made for all conditions of this surrogate")
                    .at_key("--field")
                    .read(condition.words(&reduced.machine))
                    .help("make it for the ranges of the sweep: `coldplate reduce MACHINE --range ... --field`"));
            }
            steady.push(steady_at(&condition)?);
        }
        let bound = Some(reduced.known_field()?.largest_error);
        let mut found = Self { conditions, steady, bound, bound_in_time: None, histories: Vec::new() };
        let Some(in_time) = reduced.in_time.as_ref().filter(|_| surrogate.in_time().is_some()) else { return Ok(found) };
        found.bound_in_time = Some(in_time.largest_bound);
        progress.at("the surface over time");
        let middle = condition_of(model, surrogate, &found.conditions[0])?;
        let slowest = reduced.fine.slowest(&Load::at(&reduced.machine, &middle)?)?;
        let variables: Vec<_> = surrogate.variables().collect();
        let at = |shares: &[f64]| shares.iter().zip(&variables).map(|(share, v)| v.low + share * (v.high - v.low)).collect::<Vec<f64>>();
        let mut random = Random::new(SEED);
        for number in 0..HISTORIES {
            let trial = Trial::random(number, slowest, &mut random, &at, variables.len());
            let steps = trial.steps(surrogate, reduced, &|x| condition_of(model, surrogate, x))?;
            let mut history = Vec::with_capacity(steps.len() / EVERY);
            let mut steady: Option<(Vec<f64>, Vec<f64>)> = None;
            for step in steps.into_iter().step_by(EVERY) {
                let condition = condition_of(model, surrogate, &step.x)?;
                let base = match steady.take().filter(|(x, _)| *x == step.x) {
                    Some((_, base)) => base,
                    None => steady_at(&condition)?,
                };
                let now = surface.temperatures(model, &reduced.temperatures_with(&step.amplitudes, &condition, &model.network)?);
                let rise = now.iter().zip(&base).map(|(now, base)| now - base).collect();
                steady = Some((step.x.clone(), base));
                history.push(Moving { x: step.x, away: step.away, rise });
            }
            found.histories.push(history);
        }
        Ok(found)
    }
}

/// Conditions over the ranges of a surrogate, in its units.
fn conditions(surrogate: &Surrogate<'_>, count: usize) -> Vec<Vec<f64>> {
    let variables: Vec<_> = surrogate.variables().collect();
    let at = |unit: Vec<f64>| unit.iter().zip(&variables).map(|(u, v)| v.low + u * (v.high - v.low)).collect();
    design::latin_hypercube(count, variables.len(), SEED).into_iter().map(at).collect()
}
