//! The best explanation and everything uncertain, fitted together.
//!
//! A cause that is right makes things worse where the rest stays as it was: what the file's other numbers had been chosen to make
//! up for is now in the cause. The numbers that the residual pulls most are therefore fitted beside it, each under its prior, and
//! those that the user calls uncertain.

use super::Cause;
use super::effects::{Hypothesis, Number};
use super::finalists::{Entry, Finalists};
use super::refine::{FitData, Fitted, fit, fit_again};
use super::view::Comparison;
use crate::error::Result;
use crate::evidence::discrepancy::{ErrorParts, Level};

/// Numbers of the file that are fitted beside a cause: of machines of lumped nodes, and of those of cells, whose runs cost more.
const MOST_OF_NODES: usize = 16;
const MOST_OF_CELLS: usize = 4;
/// Standard deviation of the logarithm of each number, where the model is found to be off beside its cause.
const SPREAD: f64 = 0.15;
/// The fit is begun anew until no number moves by more than this share of its standard deviation, and at most so often.
const RESTS: f64 = 0.03;
const MOST_FITS: usize = 4;
/// A number stays where the file has it if its standard deviation after the fit is more than this share of that before, and it moved by
/// less than this share of it: the data say nothing about it.
const UNKNOWN: f64 = 0.95;
const STILL: f64 = 0.1;
/// A number of a machine of cells that the residual moves by less than this share of its standard deviation stays where it is.
const MOVED: f64 = 0.3;

/// The fit of all.
#[derive(Debug, Clone)]
pub struct Joint {
    /// The causes.
    pub causes: Vec<Cause>,
    /// Numbers of the file that moved with them.
    pub others: Vec<Cause>,
    /// Correlations of the causes, and behind them of these numbers.
    pub correlations: Vec<Vec<f64>>,
    /// Predictions, K.
    pub values: Vec<f64>,
    /// The same before the sensors' own errors.
    pub machine: Vec<f64>,
    /// Covariance without what was fitted.
    pub errors: ErrorParts,
    /// The discrepancy left.
    pub level: Level,
}

/// Fits the best explanation with everything uncertain; `None` where nothing is.
///
/// # Errors
/// The machine cannot be solved with what the residual asks for.
pub fn joint(finals: &Finalists<'_>, (members, best): &Entry, view: &Comparison) -> Result<Option<Joint>> {
    let causes: Vec<&Hypothesis> = members.iter().map(|j| finals.of(*j)).collect();
    let mut beside = pulled(finals, &causes, best, view);
    let uncertain = |u| Beside { number: None, hypothesis: Number::of(u), moved: 0.0 };
    beside.extend(finals.problem.uncertain.iter().map(uncertain));
    if beside.is_empty() {
        return Ok(None);
    }
    let mut found = together(finals, &causes, &beside, best, view)?;
    let is_known = |c: &Cause| c.deviation < UNKNOWN * c.hypothesis.scale || c.amplitude.abs() > STILL * c.hypothesis.scale;
    let kept: Vec<bool> = found.causes.iter().map(|_| true).chain(found.others.iter().map(is_known)).collect();
    let keep = |row: &Vec<f64>| row.iter().zip(&kept).filter(|(_, kept)| **kept).map(|(c, _)| *c).collect();
    found.correlations = found.correlations.iter().zip(&kept).filter(|(_, kept)| **kept).map(|(row, _)| keep(row)).collect();
    found.others.retain(is_known);
    Ok(Some(found))
}

/// The fit of causes with numbers beside them.
fn together(finals: &Finalists<'_>, causes: &[&Hypothesis], beside: &[Beside], best: &Fitted, view: &Comparison) -> Result<Joint> {
    let level = best.level;
    let all: Vec<usize> = (0..view.readings.len()).collect();
    let errors = view.errors.without(&beside.iter().filter_map(|b| b.number).collect::<Vec<_>>());
    let free: Vec<&Hypothesis> = causes.iter().copied().chain(beside.iter().map(|b| &b.hypothesis)).collect();
    let guess: Vec<f64> = best.amplitudes.iter().copied().chain(beside.iter().map(|b| b.moved)).collect();
    let whitener = errors.whitener(&level, &all);
    let (readings, mesh, places) = (&view.readings, &view.mesh, &finals.places);
    let used = FitData { which: &all, readings, mesh, places, whitener: &whitener, level, without: view.without };
    let rested = |mut fitted: Fitted, used: FitData<'_>| -> Result<Fitted> {
        for _ in 1..MOST_FITS {
            let again = fit_again(finals.predictor, &free, &fitted, used)?;
            let moved =
                again.amplitudes.iter().zip(&fitted.amplitudes).zip(&again.deviations).map(|((a, b), d)| (a - b).abs() / d.max(1e-300));
            let is_small = moved.fold(0.0, f64::max) < RESTS;
            fitted = again;
            if is_small {
                break;
            }
        }
        Ok(fitted)
    };
    let mut fitted = rested(fit(finals.predictor, &free, &guess, used)?, used)?;
    // With all of it free less may be left than with the cause alone.
    let (without, columns) = fitted.without_amplitudes(&free);
    let learnt = Level { numbers: level.numbers, ..errors.learn(&without, &columns, level, None) };
    if learnt != level {
        let whitener = errors.whitener(&learnt, &all);
        let used = FitData { whitener: &whitener, level: learnt, ..used };
        fitted = rested(fit_again(finals.predictor, &free, &fitted, used)?, used)?;
    }
    let Fitted { amplitudes, deviations, correlations, values, machine, level, .. } = fitted;
    let cause = |j: usize| Cause { hypothesis: free[j].clone(), amplitude: amplitudes[j], deviation: deviations[j] };
    let (own, others) = ((0..causes.len()).map(cause).collect(), (causes.len()..free.len()).map(cause).collect());
    Ok(Joint { causes: own, others, correlations, values, machine, errors, level })
}

/// A number that is fitted beside causes.
struct Beside {
    /// Which of the numbers of the covariance; none where the user calls it uncertain.
    number: Option<usize>,
    /// As a hypothesis whose scale is its standard deviation.
    hypothesis: Hypothesis,
    /// Where to, in the hypothesis' unit.
    moved: f64,
}

/// The numbers that the residual left by a fit moves most, each by its expectation under the covariance.
fn pulled(finals: &Finalists<'_>, causes: &[&Hypothesis], best: &Fitted, view: &Comparison) -> Vec<Beside> {
    let is_lumped = finals.problem.study.model.mesh.cells == 0;
    if best.level == Level::NONE {
        return Vec::new();
    }
    let all: Vec<usize> = (0..best.left.len()).collect();
    let whitener = view.errors.whitener(&best.level, &all);
    let left = whitener.apply(&best.left);
    let one = |(number, ((h, unit), column)): (usize, (&(Hypothesis, f64), &Vec<f64>))| {
        let along: f64 = whitener.apply(column).iter().zip(&left).map(|(c, l)| c * l).sum();
        let mut hypothesis = h.clone();
        hypothesis.scale = SPREAD * unit;
        Beside { number: Some(number), hypothesis, moved: SPREAD * SPREAD * along * unit }
    };
    let mut found: Vec<Beside> = view.numbers.iter().zip(view.errors.numbers()).enumerate().map(one).collect();
    let is_cause = |p: &Beside| causes.iter().any(|h| h.is_same(&p.hypothesis));
    found.retain(|p| (is_lumped || p.moved.abs() > MOVED * p.hypothesis.scale) && !is_cause(p));
    found.sort_by(|a, b| (b.moved / b.hypothesis.scale).abs().total_cmp(&(a.moved / a.hypothesis.scale).abs()));
    found.truncate(if is_lumped { MOST_OF_NODES } else { MOST_OF_CELLS });
    found
}
