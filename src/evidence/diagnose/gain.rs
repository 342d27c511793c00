//! What the diagnosis gains on conditions that its selection never saw.

use rayon::prelude::*;

use super::choice::leading;
use super::effects::Hypothesis;
use super::joint::Joint;
use super::predictor::Predictor;
use super::probability::{self, Candidate, Ground};
use super::refine::{Begun, FitData, fit_begun};
use super::view::{Comparison, ScreenInput};
use super::{Explanation, Problem, decide};
use crate::evidence::measurement::{Data, whiten};
use crate::foundation::random::Random;

/// Most parts the conditions are cut into.
const FOLDS: usize = 5;
/// Causes that are fitted in each, beside the one that all data point to.
const FITTED: usize = 2;
/// Resampled sets of conditions for the interval.
const RESAMPLED: usize = 2000;

/// What is kept out of logs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeptOut {
    /// A test, or a block of time where there are one or two.
    Tests,
    /// A block of time of every test.
    Blocks,
}

/// What all data point to, and how it was fitted.
#[derive(Clone, Copy)]
pub struct Named<'a> {
    /// The explanation.
    pub explanation: &'a Explanation,
    /// What was fitted with it.
    pub joint: Option<&'a Joint>,
    /// The data beside the machine with it in force: its covariance.
    pub view: &'a Comparison,
}

impl<'a> Named<'a> {
    /// What is fitted in every fold, in the order of the catalogue, with amplitudes.
    fn members(&self, catalogue: &'a [Hypothesis]) -> Vec<(&'a Hypothesis, f64)> {
        let of = |h: &&Hypothesis| self.explanation.causes.iter().find(|cause| cause.hypothesis.is_same(h));
        // Through the scale, as folds guess it: they begin here where it is the same to the last digit.
        let causes = catalogue.iter().filter_map(|h| of(&h).map(|cause| (h, cause.amplitude / h.scale * h.scale)));
        beside(causes.collect(), self.joint)
    }
}

/// Causes with what is fitted beside them.
fn beside<'a>(mut causes: Vec<(&'a Hypothesis, f64)>, joint: Option<&'a Joint>) -> Vec<(&'a Hypothesis, f64)> {
    for other in joint.iter().flat_map(|joint| &joint.others) {
        if !causes.iter().any(|(h, _)| h.is_same(&other.hypothesis)) {
            causes.push((&other.hypothesis, other.amplitude));
        }
    }
    causes
}

/// Errors on conditions kept out, K.
#[derive(Debug, Clone, PartialEq)]
pub struct Gain {
    /// Root mean square error of the machine as it is.
    pub before: f64,
    /// The same with the cause that the other conditions pointed to.
    pub after: f64,
    /// Low end of the 90 % interval of what is gained, over conditions.
    pub low: f64,
    /// High end.
    pub high: f64,
    /// What the readings' own uncertainty comes to.
    pub noise_floor: f64,
    /// Conditions, each kept out once.
    pub conditions: Vec<String>,
    /// Every reading.
    pub readings: Vec<HeldOutReading>,
}

impl Gain {
    /// This gain and a later one on top of it.
    pub fn and_then(&self, later: &Self) -> Self {
        let of = |(a, b): (&HeldOutReading, &HeldOutReading)| HeldOutReading { change: a.change + b.change, ..*a };
        Self {
            after: later.after,
            low: self.low + later.low,
            high: self.high + later.high,
            readings: self.readings.iter().zip(&later.readings).map(of).collect(),
            ..self.clone()
        }
    }
}

/// A reading while its condition is held out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldOutReading {
    /// Which of [`Gain::conditions`] it belongs to.
    pub condition: usize,
    /// What the cause found without that condition changes in its prediction, K.
    pub change: f64,
}

/// Cuts the conditions into folds; in each, everything from the screen to the amplitude is done again without it. Of logs a
/// condition is a test, and of one or two tests a block of time. With fewer than three conditions there is no such figure.
pub fn gain(
    problem: &Problem,
    predictor: &Predictor<'_>,
    catalogue: &[Hypothesis],
    base: &Comparison,
    named: Option<Named<'_>>,
    kept_out: KeptOut,
) -> Option<Gain> {
    let (data, found) = (&problem.data, &base.found);
    let places = whiten::places(data);
    let key = keys(data, kept_out);
    let mut conditions: Vec<String> = Vec::new();
    for (r, _) in &places {
        if !conditions.contains(&key(*r)) {
            conditions.push(key(*r));
        }
    }
    if conditions.len() < 3 {
        return None;
    }
    let folds = FOLDS.min(conditions.len());
    let condition_of: Vec<usize> = places.iter().map(|(r, _)| conditions.iter().position(|c| *c == key(*r)).unwrap_or(0)).collect();
    // In every fold the cause that all data point to is fitted from where all data have it.
    let begun = named.and_then(|named| {
        let (members, guess): (Vec<&Hypothesis>, Vec<f64>) = named.members(catalogue).into_iter().unzip();
        Some(Begun::at(predictor, &members, &guess)?.with_steps(predictor))
    });
    // Squares by condition: before, after, count.
    let mut readings: Vec<HeldOutReading> = condition_of.iter().map(|c| HeldOutReading { condition: *c, change: 0.0 }).collect();
    let mut sums = vec![(0.0, 0.0, 0.0); conditions.len()];
    let without = |fold: usize| -> (Vec<usize>, Option<Vec<f64>>) {
        let (kept, out): (Vec<usize>, Vec<usize>) = (0..places.len()).partition(|i| condition_of[*i] % folds != fold);
        // Where all data together name no cause nothing is extended, so nothing is gained or lost.
        let seed = problem.seed.wrapping_add(1 + fold as u64);
        (out, named.and_then(|named| found_without(predictor, catalogue, base, named, begun.as_ref(), &kept, seed)))
    };
    for (out, change) in (0..folds).into_par_iter().map(without).collect::<Vec<_>>() {
        let shift: Vec<f64> = out.iter().map(|i| change.as_ref().map_or(0.0, |c| c[*i])).collect();
        for (s, i) in shift.iter().zip(&out) {
            readings[*i].change = *s;
            let sum = &mut sums[condition_of[*i]];
            sum.0 += found.residual[*i].powi(2);
            sum.1 += (found.residual[*i] - s).powi(2);
            sum.2 += 1.0;
        }
    }
    let rms = |chosen: &[usize]| {
        let total = chosen.iter().fold((0.0, 0.0, 0.0), |t, c| (t.0 + sums[*c].0, t.1 + sums[*c].1, t.2 + sums[*c].2));
        ((total.0 / total.2).sqrt(), (total.1 / total.2).sqrt())
    };
    let all: Vec<usize> = (0..conditions.len()).collect();
    let (before, after) = rms(&all);
    let mut random = Random::new(problem.seed);
    let mut gains: Vec<f64> = (0..RESAMPLED)
        .map(|_| {
            let chosen: Vec<usize> = all.iter().map(|_| (random.unit() * all.len() as f64) as usize).collect();
            let (before, after) = rms(&chosen);
            before - after
        })
        .collect();
    gains.sort_by(f64::total_cmp);
    let at = |share: f64| gains[((gains.len() - 1) as f64 * share).round() as usize];
    let noise_floor = stated(problem, base);
    let names = conditions.iter().map(|c| c.split('#').next().unwrap_or(c).to_string()).collect();
    Some(Gain { before, after, low: at(0.05), high: at(0.95), noise_floor, conditions: names, readings })
}

/// The condition each row belongs to: itself in a steady table, its test in a log, and its part of one where there are few tests.
fn keys(data: &Data, kept_out: KeptOut) -> impl Fn(usize) -> String {
    let tests = data.tests();
    let blocks = match kept_out {
        KeptOut::Tests if tests.len() >= 3 => 1,
        KeptOut::Tests => FOLDS.div_ceil(tests.len().max(1)),
        KeptOut::Blocks => FOLDS,
    };
    let time = |r: usize| data.rows[r].time.unwrap_or(0.0);
    let span = |test: &String| {
        let own = (0..data.rows.len()).filter(|r| data.rows[*r].test == *test).map(time);
        own.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(t), b.max(t)))
    };
    let spans: Vec<(f64, f64)> = tests.iter().map(span).collect();
    let key = move |r: usize| {
        let row = &data.rows[r];
        let (Some(time), Some(t)) = (row.time, tests.iter().position(|t| *t == row.test)) else { return format!("{}#{r}", row.test) };
        let (first, last) = spans[t];
        let block = (((time - first) / (last - first).max(1e-9) * blocks as f64) as usize).min(blocks - 1);
        if blocks > 1 { format!("{}, part {}", row.test, block + 1) } else { row.test.clone() }
    };
    let all: Vec<String> = (0..data.rows.len()).map(key).collect();
    move |r| all[r].clone()
}

/// What readings and conditions are uncertain by, as stated: root mean square, K.
fn stated(problem: &Problem, base: &Comparison) -> f64 {
    let (data, uncertainty) = (&problem.data, &problem.uncertainty);
    let noise: f64 = whiten::deviations(data, uncertainty).iter().map(|d| d * d).sum();
    let common = whiten::common_errors(data, uncertainty, &base.found.prediction.conditions);
    ((noise + common.iter().flatten().map(|c| c * c).sum::<f64>()) / base.readings.len().max(1) as f64).sqrt()
}

/// What the cause that the kept readings point to changes in all predictions, K: screened and fitted with these alone.
/// `None` where they raise no alarm, or point to no cause.
fn found_without(
    predictor: &Predictor<'_>,
    catalogue: &[Hypothesis],
    base: &Comparison,
    Named { explanation, joint, view }: Named<'_>,
    begun: Option<&Begun<'_>>,
    kept: &[usize],
    seed: u64,
) -> Option<Vec<f64>> {
    let pick = |v: &Vec<f64>| kept.iter().map(|i| v[*i]).collect::<Vec<f64>>();
    let level = explanation.level;
    let whitener = view.errors.whitener(&level, kept);
    let columns: Vec<Vec<f64>> = base.found.columns.iter().map(pick).collect();
    let all = whiten::places(predictor.data);
    let places: Vec<(usize, usize)> = kept.iter().map(|i| all[*i]).collect();
    let residual = pick(&base.found.residual);
    let part = ScreenInput { residual: &residual, columns: &columns, whitener: &whitener, catalogue, places: &places }.screen();
    if !decide::raises_alarm(&part, seed) {
        return None;
    }
    let prior = probability::prior(&part, catalogue);
    let posterior = probability::posterior(&part, &prior, &Ground::default(), !predictor.data.is_transient());
    let readings = pick(&view.readings);
    let (fitting, level) = match joint {
        Some(joint) => (joint.errors.whitener(&joint.level, kept), joint.level),
        None => (whitener, level),
    };
    // What all data point to is tried in every fold: as one of several.
    let position = |h: &Hypothesis| (0..part.visible.len()).find(|j| catalogue[part.visible[*j]].is_same(h));
    let mut all_point_to: Vec<(usize, f64)> =
        explanation.causes.iter().filter_map(|c| Some((position(&c.hypothesis)?, c.amplitude / c.hypothesis.scale))).collect();
    all_point_to.sort_by_key(|(j, _)| *j);
    let mut chosen = leading(&posterior, &part, FITTED);
    if all_point_to.len() == explanation.causes.len() {
        let (members, amplitudes): (Vec<usize>, Vec<f64>) = all_point_to.into_iter().unzip();
        chosen.retain(|c| c.members != members);
        chosen.push(Candidate { members, amplitudes, gain: 0.0, weight: 0.0, probability: 0.0 });
    }
    let of = |c: &Candidate| -> Option<(f64, Vec<f64>)> {
        let causes = c.members.iter().zip(&c.amplitudes).map(|(j, a)| {
            let h = &catalogue[part.visible[*j]];
            (h, a * h.scale)
        });
        let (members, guess): (Vec<&Hypothesis>, Vec<f64>) = beside(causes.collect(), joint).into_iter().unzip();
        let (readings, mesh, places) = (&readings, &view.mesh, &places);
        let used = FitData { which: kept, readings, mesh, places, whitener: &fitting, level, without: 0.0 };
        let fitted = fit_begun(predictor, &members, &guess, used, begun).ok()?;
        Some((fitted.evidence + probability::prior_of(&c.members, &prior), fitted.values))
    };
    let tried: Vec<(f64, Vec<f64>)> = chosen.par_iter().filter_map(of).collect();
    let (_, values) = tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(values.iter().zip(&base.found.prediction.values).map(|(a, b)| a - b).collect())
}
