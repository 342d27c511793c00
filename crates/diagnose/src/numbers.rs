//! Numbers of laws, an exponent or an instant, through the full solver: slopes of the machine as it is chose them, at the stated noise.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::effects::{Hypothesis, Law};
use super::finalists::{Entry, Finalists, Outcome};
use super::refine::{FitData, Fitted, fit};
use coldplate_base::error::Result;

/// Steps at most, and the share of its standard deviation that a number moves no more by at the end.
const MOST_STEPS: usize = 3;
const RESTS: f64 = 0.3;
/// Step of differences, in standard deviations of the number, and at least, as it is counted.
const STEP: f64 = 1.0;
const LEAST_STEP: f64 = 2.0;
/// How far a number moves at once, in grid points of its first search.
const FARTHEST: f64 = 300.0;

/// What the leading explanation comes to with its law's number as the full solver has it.
pub enum Settled {
    /// The law that replaces the one of a cause of the screen, and the fit with it.
    At { cause: usize, hypothesis: Box<Hypothesis>, entry: Box<Entry> },
    /// A law with a name is as good.
    Named { members: Vec<usize> },
}

/// The explanation whose law's number is to be fitted next: the leading one, or the best of the others, which slopes may have given a
/// number far from theirs where their effect bends. What is no lumped machine takes runs of seconds: there only the leading one.
pub fn next(finals: &Finalists<'_>, outcome: &Outcome, done: &[Vec<usize>]) -> Option<Vec<usize>> {
    let is_open =
        |entry: &&Entry| entry.0.iter().any(|j| finals.of(*j).law.is_free()) && !done.contains(&entry.0) && entry.1.evidence.is_finite();
    let leading = outcome.leading().filter(is_open);
    let is_lumped = finals.problem.study.model.mesh.cells == 0;
    let others = || outcome.fitted.iter().filter(|entry| is_lumped && is_open(entry)).min_by(|a, b| a.1.deviance.total_cmp(&b.1.deviance));
    leading.or_else(others).map(|entry| entry.0.clone())
}

/// Fits the number of the law of an explanation beside its amplitudes; `None` where its laws have none, or it was not fitted.
///
/// # Errors
/// The machine cannot be solved with it.
pub fn settle(finals: &Finalists<'_>, outcome: &Outcome, members: &[usize]) -> Result<Option<Settled>> {
    let Some((members, before)) = outcome.fitted.iter().find(|entry| entry.0 == members) else { return Ok(None) };
    let numbered = members.iter().find(|j| finals.of(**j).law.is_free());
    let (Some(cause), false) = (numbered, members.iter().any(|j| finals.of(*j).is_fixed())) else { return Ok(None) };
    let all: Vec<usize> = (0..outcome.view.readings.len()).collect();
    let view = &outcome.view;
    let whitener = view.errors.whitener(&before.level, &all);
    let (readings, mesh, places) = (&view.readings, &view.mesh, &finals.places);
    let used = FitData { which: &all, readings, mesh, places, whitener: &whitener, level: before.level, without: view.without };
    let causes: Vec<&Hypothesis> = members.iter().map(|j| finals.of(*j)).collect();
    let place = members.iter().position(|j| j == cause).unwrap_or(0);
    let mut now = Now { hypothesis: causes[place].clone(), fitted: before.clone() };
    for _ in 0..MOST_STEPS {
        let Some(Step { by, deviation }) = step(finals, &causes, place, &now, used)? else { return Ok(None) };
        let Law::Of(variable, form) = now.hypothesis.law else { return Ok(None) };
        let Some(number) = form.number() else { return Ok(None) };
        let law = Law::Of(variable, form.with_number(number + by.clamp(-FARTHEST, FARTHEST)));
        let Some(found) = finals.predictor.scales.number(law, deviation) else {
            return Ok(Some(Settled::Named { members: members.clone() }));
        };
        let hypothesis = causes[place].under_found(law, found, finals.predictor.scales);
        let mut with = causes.clone();
        with[place] = &hypothesis;
        let fitted = if law == now.hypothesis.law { now.fitted } else { fit(finals.predictor, &with, &now.fitted.amplitudes, used)? };
        now = Now { hypothesis, fitted };
        if by.abs() < RESTS * deviation {
            break;
        }
    }
    let entry = (members.clone(), now.fitted);
    Ok(Some(Settled::At { cause: *cause, hypothesis: Box::new(now.hypothesis), entry: Box::new(entry) }))
}

struct Now {
    hypothesis: Hypothesis,
    fitted: Fitted,
}

/// A step of Gauss and Newton's method in the number, and its standard deviation beside free amplitudes, as the law counts it.
struct Step {
    by: f64,
    deviation: f64,
}

fn step(finals: &Finalists<'_>, causes: &[&Hypothesis], place: usize, now: &Now, used: FitData<'_>) -> Result<Option<Step>> {
    let Law::Of(variable, form) = now.hypothesis.law else { return Ok(None) };
    let (Some(number), Some(found)) = (form.number(), &now.hypothesis.number) else { return Ok(None) };
    let width = (STEP * found.deviation).clamp(LEAST_STEP, FARTHEST).round();
    let at = |number: f64| -> Result<(f64, Vec<f64>)> {
        let form = form.with_number(number);
        let mut moved = now.hypothesis.clone();
        moved.law = Law::Of(variable, form);
        let with: Vec<(&Hypothesis, f64)> =
            (0..causes.len()).map(|i| (if i == place { &moved } else { causes[i] }, now.fitted.amplitudes[i])).collect();
        Ok((form.number().unwrap_or(number), finals.predictor.predict(&with)?))
    };
    let mut both = [number - width, number + width].into_par_iter().map(at).collect::<Result<Vec<_>>>()?;
    let (Some((to, above)), Some((from, below))) = (both.pop(), both.pop()) else { return Ok(None) };
    if to <= from {
        return Ok(None);
    }
    let slope: Vec<f64> = above.iter().zip(&below).map(|(a, b)| (a - b) / (to - from)).collect();
    let columns: Vec<Vec<f64>> = now.fitted.slopes.iter().chain([&slope]).map(|c| used.whitener.apply(c)).collect();
    let left = DVector::from_vec(used.whitener.apply(&now.fitted.left));
    let matrix = DMatrix::from_fn(left.len(), columns.len(), |i, j| columns[j][i]);
    let last = columns.len() - 1;
    let mut curvature = matrix.transpose() * &matrix;
    let mut right = matrix.transpose() * left;
    for (j, (h, amplitude)) in causes.iter().zip(&now.fitted.amplitudes).enumerate() {
        let spread = h.spread(*amplitude);
        curvature[(j, j)] += spread.powi(-2);
        right[j] -= amplitude / spread.powi(2);
    }
    let Some(covariance) = curvature.try_inverse() else { return Ok(None) };
    let by = (&covariance * right)[last];
    Ok((by.is_finite() && covariance[(last, last)] > 0.0).then(|| Step { by, deviation: covariance[(last, last)].sqrt() }))
}
