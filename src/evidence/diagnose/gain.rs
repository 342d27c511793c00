//! What the diagnosis gains on conditions that its selection never saw.

use rayon::prelude::*;

use super::effects::Hypothesis;
use super::finalists::leading;
use super::probability::{self, Candidate};
use super::refine::{FitData, Predictor, fit};
use super::view::{Comparison, ScreenInput};
use super::{Problem, is_wrong};
use crate::evidence::measurement::whiten;
use crate::foundation::random::Random;

/// Most parts the conditions are cut into.
const FOLDS: usize = 5;
/// Causes that are fitted in each.
const FITTED: usize = 1;
/// Resampled sets of conditions for the interval.
const RESAMPLED: usize = 2000;

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

/// A reading while its condition is held out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldOutReading {
    /// Which of [`Gain::conditions`] it belongs to.
    pub condition: usize,
    /// What the cause found without that condition changes in its prediction, K.
    pub change: f64,
}

/// Cuts the conditions into folds; in each, everything from the screen to the amplitude is done again without it. With
/// fewer than three conditions there is no such figure.
pub fn gain(problem: &Problem, predictor: &Predictor<'_>, catalogue: &[Hypothesis], base: &Comparison, is_extended: bool) -> Option<Gain> {
    let (data, found, errors) = (&problem.data, &base.found, &base.errors);
    let places = whiten::places(data);
    let key = |r: usize| if data.is_transient() { data.rows[r].test.clone() } else { format!("{}#{r}", data.rows[r].test) };
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
    // Squares by condition: before, after, count.
    let mut readings: Vec<HeldOutReading> = condition_of.iter().map(|c| HeldOutReading { condition: *c, change: 0.0 }).collect();
    let mut sums = vec![(0.0, 0.0, 0.0); conditions.len()];
    let without = |fold: usize| -> (Vec<usize>, Option<Vec<f64>>) {
        let (kept, out): (Vec<usize>, Vec<usize>) = (0..places.len()).partition(|i| condition_of[*i] % folds != fold);
        // Where all data together name no cause nothing is extended, so nothing is gained or lost.
        let seed = problem.seed.wrapping_add(1 + fold as u64);
        (out, if is_extended { found_without(predictor, catalogue, base, &kept, seed) } else { None })
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
    let marginal = errors.marginal();
    let noise_floor = (marginal.iter().map(|m| m * m).sum::<f64>() / marginal.len() as f64).sqrt();
    let names = conditions.iter().map(|c| c.split('#').next().unwrap_or(c).to_string()).collect();
    Some(Gain { before, after, low: at(0.05), high: at(0.95), noise_floor, conditions: names, readings })
}

/// What the cause that the kept readings point to changes in all predictions, K: screened and fitted with these alone.
/// `None` where they raise no alarm, or point to no cause.
fn found_without(predictor: &Predictor<'_>, catalogue: &[Hypothesis], base: &Comparison, kept: &[usize], seed: u64) -> Option<Vec<f64>> {
    let pick = |v: &Vec<f64>| kept.iter().map(|i| v[*i]).collect::<Vec<f64>>();
    let whitener = base.errors.whitener(kept);
    let columns: Vec<Vec<f64>> = base.found.columns.iter().map(pick).collect();
    let all = whiten::places(predictor.data);
    let places: Vec<(usize, usize)> = kept.iter().map(|i| all[*i]).collect();
    let residual = pick(&base.found.residual);
    let part = ScreenInput { residual: &residual, columns: &columns, whitener: &whitener, catalogue, places: &places }.screen();
    if !is_wrong(&part, seed) {
        return None;
    }
    let prior = probability::prior(&part, catalogue);
    let posterior = probability::posterior(&part, &prior, !predictor.data.is_transient());
    let readings = pick(&base.readings);
    let of = |c: &Candidate| -> Option<(f64, Vec<f64>)> {
        let members: Vec<&Hypothesis> = c.members.iter().map(|j| &catalogue[part.visible[*j]]).collect();
        let guess: Vec<f64> = c.amplitudes.iter().zip(&members).map(|(a, h)| a * h.scale).collect();
        let fitted = fit(
            predictor,
            &members,
            &guess,
            FitData { which: kept, readings: &readings, mesh: &base.mesh, places: &places, whitener: &whitener },
        )
        .ok()?;
        Some((fitted.evidence + probability::prior_of(&c.members, &prior), fitted.values))
    };
    let tried: Vec<(f64, Vec<f64>)> = leading(&posterior, &part, FITTED).par_iter().filter_map(of).collect();
    let (_, values) = tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(values.iter().zip(&base.found.prediction.values).map(|(a, b)| a - b).collect())
}
