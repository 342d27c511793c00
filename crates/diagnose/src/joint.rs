//! The best explanation and everything uncertain, fitted together.
//!
//! A cause that is right makes things worse where the rest stays as it was: what the file's other numbers had been chosen to make
//! up for is now in the cause. The numbers that the residual pulls most are therefore fitted beside it, each under its prior, and
//! those that the user calls uncertain.
//!
//! Where the model of a log wanders off beside its cause, weighing by the covariance may let fast changes outvote levels. Where that
//! predicts data kept out worse than the machine as it is, all of it is found as if what wanders were new in every reading
//! ([`Sandwich`]).

use nalgebra::DMatrix;

use super::Cause;
use super::effects::{Hypothesis, Number};
use super::finalists::{Entry, Finalists};
use super::refine::{FitData, Fitted, fit, fit_again};
use super::stated::Stated;
use super::view::Comparison;
use coldplate_base::error::Result;
use coldplate_base::numbers::TWO_SIDED_90;
use coldplate_evidence::discrepancy::{DiscrepancySize, ErrorParts};
use coldplate_evidence::measurement::Whitener;
use coldplate_evidence::sandwich::{Sandwich, worth};

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
/// A cause that stands out by itself by so many of its standard deviations, and with numbers free beside it by no more than so many, was
/// emptied by them.
const STANDS: f64 = 3.0;
const EMPTY: f64 = TWO_SIDED_90;
/// A number of a machine of cells that the residual moves by less than this share of its standard deviation stays where it is.
const MOVED: f64 = 0.3;

/// The fit of all.
#[derive(Debug, Clone)]
pub struct Joint {
    /// The causes.
    pub causes: Vec<Cause>,
    /// Numbers of the file that moved with them.
    pub others: Vec<Cause>,
    /// All that was fitted.
    pub members: Vec<Hypothesis>,
    /// Which of it are causes or numbers that moved.
    kept: Vec<bool>,
    /// How it was fitted.
    pub fitted: Fitted,
    /// Whether numbers are among it that nobody called uncertain.
    pub has_pulled: bool,
    /// Covariance without what was fitted.
    errors: ErrorParts,
    /// How many times more readings there are than they are worth, where what wanders was taken as new in each of them.
    worth: Option<f64>,
}

impl Joint {
    /// Whether numbers that can do what a cause does, such as the factor of the source that it adds to, took its place: its own
    /// interval then holds nothing at all. `alone` are the causes as they were fitted by themselves.
    pub(crate) fn empties(&self, alone: &[Cause]) -> bool {
        let stands = |cause: &Cause, by: f64| cause.amplitude.abs() > by * cause.deviation;
        let was = |cause: &Cause| alone.iter().any(|own| own.hypothesis.is_same(&cause.hypothesis) && stands(own, STANDS));
        self.causes.iter().any(|cause| !cause.hypothesis.is_fixed() && was(cause) && !stands(cause, EMPTY))
    }

    /// Whether numbers that nobody called uncertain do what common factors do: in logs, which say much of each.
    pub(crate) fn takes_factors_place(&self, finals: &Finalists<'_>) -> bool {
        self.has_pulled && finals.problem.data.is_transient()
    }

    /// The whitening of some readings by which it was found.
    pub fn whitener(&self, readings: &[usize]) -> Whitener {
        whitener(&self.errors, &self.fitted.level, self.worth, readings)
    }

    /// The rows and columns of causes, of numbers that moved, and of whatever stands behind all that was fitted.
    pub(crate) fn among_kept(&self, correlations: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let is_kept = |k: usize| self.kept.get(k).is_none_or(|kept| *kept);
        let keep = |row: &Vec<f64>| row.iter().enumerate().filter(|(k, _)| is_kept(*k)).map(|(_, c)| *c).collect();
        correlations.iter().enumerate().filter(|(k, _)| is_kept(*k)).map(|(_, row)| keep(row)).collect()
    }
}

fn whitener(errors: &ErrorParts, level: &DiscrepancySize, worth: Option<f64>, readings: &[usize]) -> Whitener {
    match worth {
        Some(worth) => errors.whitener_apart(level, readings, worth),
        None => errors.whitener(level, readings),
    }
}

/// What readings weigh in the fit of all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum JointWeights {
    /// The inverse of their covariance.
    Covariance,
    /// The same as if what wanders were new in every reading.
    Apart,
}

/// Fits the best explanation with everything uncertain; `None` where nothing is, or nothing wanders that could count as new in every
/// reading.
///
/// # Errors
/// The machine cannot be solved with what the residual asks for.
pub fn joint(finals: &Finalists<'_>, (members, best): &Entry, view: &Comparison, weights: JointWeights) -> Result<Option<Joint>> {
    // Of a machine of cells only what the residual pulls is free, too little to trade levels for fast changes.
    let wanders = is_lumped(finals) && finals.problem.data.is_transient() && best.level.wandering > 0.0;
    if weights == JointWeights::Apart && !wanders {
        return Ok(None);
    }
    let causes: Vec<&Hypothesis> = members.iter().map(|j| finals.of(*j)).collect();
    let mut beside = pulled(finals, &causes, best, view);
    let readings = view.readings.len();
    let uncertain = |u| Beside { number: None, hypothesis: Number::of(u), moved: 0.0, slope: vec![0.0; readings] };
    beside.extend(finals.problem.uncertain.iter().map(uncertain));
    let stated = Stated::of(finals.problem, &finals.problem.study);
    let measured = stated.measured(finals.catalogue).filter(|h| causes.iter().all(|cause| !cause.is_same(h)));
    beside.extend(measured.map(|hypothesis| Beside { number: None, hypothesis, moved: 0.0, slope: vec![0.0; readings] }));
    if beside.is_empty() {
        return Ok(None);
    }
    let mut found = together(finals, &causes, &beside, best, view, weights)?;
    let is_known = |c: &Cause| c.deviation < UNKNOWN * c.hypothesis.scale || c.amplitude.abs() > STILL * c.hypothesis.scale;
    found.kept = found.causes.iter().map(|_| true).chain(found.others.iter().map(is_known)).collect();
    found.others.retain(is_known);
    Ok(Some(found))
}

/// The fit of causes with numbers beside them.
fn together(
    finals: &Finalists<'_>,
    causes: &[&Hypothesis],
    beside: &[Beside],
    best: &Fitted,
    view: &Comparison,
    weights: JointWeights,
) -> Result<Joint> {
    let level = best.level;
    let all: Vec<usize> = (0..view.readings.len()).collect();
    let errors = view.errors.without(&beside.iter().filter_map(|b| b.number).collect::<Vec<_>>());
    let free: Vec<&Hypothesis> = causes.iter().copied().chain(beside.iter().map(|b| &b.hypothesis)).collect();
    // In tables of a machine of cells each number is guessed by itself, and four that explain the same would go four times too far.
    let is_guessed = is_lumped(finals) || finals.problem.data.is_transient();
    let begins = |b: &Beside| if is_guessed { b.moved } else { 0.0 };
    let guess: Vec<f64> = best.amplitudes.iter().copied().chain(beside.iter().map(begins)).collect();
    let worth_of = |slopes: &[Vec<f64>], level: &DiscrepancySize| -> Option<f64> {
        (weights == JointWeights::Apart).then(|| worth(slopes, &errors.deviations_apart(level), |vector| errors.times_apart(level, vector)))
    };
    let (readings, mesh, places) = (&view.readings, &view.mesh, &finals.places);
    let fitted_from = |from: Option<&Fitted>, worth: Option<f64>, level: DiscrepancySize| -> Result<Fitted> {
        let whitener = whitener(&errors, &level, worth, &all);
        let used = FitData { which: &all, readings, mesh, places, whitener: &whitener, level, without: view.without };
        let mut fitted = match from {
            Some(before) => fit_again(finals.predictor, &free, before, used)?,
            None => fit(finals.predictor, &free, &guess, used)?,
        };
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
    let slopes: Vec<Vec<f64>> = best.slopes.iter().cloned().chain(beside.iter().map(|b| b.slope.clone())).collect();
    let mut worth = worth_of(&slopes, &level);
    let mut fitted = fitted_from(None, worth, level)?;
    // With all of it free less may be left than with the cause alone.
    let (without, columns) = fitted.without_amplitudes(&free);
    let learnt = DiscrepancySize { numbers: level.numbers, ..errors.learn(&without, &columns, level, None) };
    if learnt != level {
        worth = worth_of(&fitted.slopes, &learnt);
        fitted = fitted_from(Some(&fitted), worth, learnt)?;
    }
    if worth.is_some() {
        let prior = free.iter().zip(&guess).map(|(h, a)| information(h, *a)).collect();
        let weights = whitener(&errors, &fitted.level, worth, &all);
        let covariance = Sandwich::of(&fitted.slopes, &weights, &errors, &fitted.level, prior).covariance();
        (fitted.deviations, fitted.correlations) = spread(&covariance, &free);
    }
    let cause = |j: usize| Cause::new(free[j].clone(), fitted.amplitudes[j], fitted.deviations[j]);
    let (own, others) = ((0..causes.len()).map(cause).collect(), (causes.len()..free.len()).map(cause).collect());
    let (kept, has_pulled) = (vec![true; free.len()], beside.iter().any(|b| b.number.is_some()));
    let members = free.into_iter().cloned().collect();
    Ok(Joint { causes: own, others, members, kept, fitted, has_pulled, errors, worth })
}

/// Inverse variance of an amplitude's prior, which has tails where the hypothesis has.
fn information(h: &Hypothesis, guess: f64) -> f64 {
    if h.is_fixed() { 1.0 } else { h.spread(guess).powi(-2) }
}

/// Standard deviations and correlations of a covariance; zero of what has no amplitude.
fn spread(covariance: &DMatrix<f64>, free: &[&Hypothesis]) -> (Vec<f64>, Vec<Vec<f64>>) {
    let deviation = |j: usize| if free[j].is_fixed() { 0.0 } else { covariance[(j, j)].max(0.0).sqrt() };
    let deviations: Vec<f64> = (0..free.len()).map(deviation).collect();
    let correlation = |i: usize, j: usize| {
        let both = deviations[i] * deviations[j];
        if both > 0.0 { covariance[(i, j)] / both } else { 0.0 }
    };
    let correlations = (0..free.len()).map(|i| (0..free.len()).map(|j| correlation(i, j)).collect()).collect();
    (deviations, correlations)
}

/// A number that is fitted beside causes.
struct Beside {
    /// Index among the numbers of the covariance; none where its uncertainty is stated.
    number: Option<usize>,
    /// As a hypothesis whose scale is its standard deviation.
    hypothesis: Hypothesis,
    /// Where to, in the hypothesis' unit.
    moved: f64,
    /// Change of the readings with it, K per unit; zero where it is not known yet.
    slope: Vec<f64>,
}

/// Whether the machine is made of lumped nodes alone.
fn is_lumped(finals: &Finalists<'_>) -> bool {
    finals.problem.study.model.mesh.cells == 0
}

/// The numbers that the residual left by a fit moves most, each by its expectation under the covariance.
fn pulled(finals: &Finalists<'_>, causes: &[&Hypothesis], best: &Fitted, view: &Comparison) -> Vec<Beside> {
    let is_lumped = is_lumped(finals);
    if best.level == DiscrepancySize::NONE {
        return Vec::new();
    }
    let all: Vec<usize> = (0..best.left.len()).collect();
    let whitener = view.errors.whitener(&best.level, &all);
    let left = whitener.apply(&best.left);
    let one = |(number, ((h, unit), column)): (usize, (&(Hypothesis, f64), &Vec<f64>))| {
        let along: f64 = whitener.apply(column).iter().zip(&left).map(|(c, l)| c * l).sum();
        let hypothesis = h.clone().inexact_by(SPREAD * unit);
        let slope = column.iter().map(|c| c / unit).collect();
        Beside { number: Some(number), hypothesis, moved: SPREAD * SPREAD * along * unit, slope }
    };
    let mut found: Vec<Beside> = view.numbers.iter().zip(view.errors.numbers()).enumerate().map(one).collect();
    let is_cause = |p: &Beside| causes.iter().any(|h| h.is_same(&p.hypothesis));
    found.retain(|p| (is_lumped || p.moved.abs() > MOVED * p.hypothesis.scale) && !is_cause(p));
    found.sort_by(|a, b| (b.moved / b.hypothesis.scale).abs().total_cmp(&(a.moved / a.hypothesis.scale).abs()));
    found.truncate(if is_lumped { MOST_OF_NODES } else { MOST_OF_CELLS });
    found
}
