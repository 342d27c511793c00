//! What the diagnosis gains on conditions that its selection never saw.

use super::catalogue::Hypothesis;
use super::probability;
use super::refine::Fitted;
use super::screen::Screened;
use super::signature::Signatures;
use super::view::{View, screened};
use super::{Problem, decide, misfit};
use crate::measure::whiten;
use crate::random::Random;

/// Most parts the conditions are cut into.
const FOLDS: usize = 8;
/// Resampled sets of conditions for the interval.
const RESAMPLED: usize = 2000;

/// Errors on conditions kept out, K.
#[derive(Debug, Clone, PartialEq)]
pub struct Gain {
    /// Root mean square error of the machine as it is.
    pub before: f64,
    /// The same with the cause that the other conditions pointed to.
    pub after: f64,
    /// 90 % interval of what is gained, over conditions.
    pub interval: (f64, f64),
    /// What the readings' own uncertainty comes to.
    pub noise_floor: f64,
    /// Conditions, each kept out once.
    pub conditions: Vec<String>,
    /// Which of them each reading belongs to, and what the cause found without it changes in its prediction, K.
    pub readings: Vec<(usize, f64)>,
}

/// Cuts the conditions into folds; in each, everything from the screen to the amplitude is done again without it. With
/// fewer than three conditions there is no such figure.
pub fn gain(
    problem: &Problem,
    catalogue: &[Hypothesis],
    base: &View,
    fitted: &[(Vec<usize>, Fitted)],
    whole: &Screened,
    is_wrong: bool,
) -> Option<Gain> {
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
    let mut readings: Vec<(usize, f64)> = condition_of.iter().map(|c| (*c, 0.0)).collect();
    let mut sums = vec![(0.0, 0.0, 0.0); conditions.len()];
    for fold in 0..folds {
        let (kept, out): (Vec<usize>, Vec<usize>) = (0..places.len()).partition(|i| condition_of[*i] % folds != fold);
        let pick = |v: &Vec<f64>, which: &[usize]| which.iter().map(|i| v[*i]).collect::<Vec<f64>>();
        let columns: Vec<Vec<f64>> = found.columns.iter().map(|c| pick(c, &kept)).collect();
        let part = screened(&pick(&found.residual, &kept), &columns, &errors.whitener(&kept), catalogue);
        let mut shift = vec![0.0; out.len()];
        // Where all data together raise no alarm nothing is extended, so nothing is gained or lost.
        if is_wrong && decide::is_wrong(&misfit(&part, problem.seed.wrapping_add(1 + fold as u64))) {
            let posterior = probability::posterior(&part, &probability::prior(&part, catalogue));
            if let Some(best) = posterior.candidates.first().filter(|b| b.probability > posterior.something_else.max(posterior.nothing)) {
                for (j, amplitude) in best.members.iter().zip(&best.amplitudes) {
                    let h = part.visible[*j];
                    let amplitude = amplitude * catalogue[h].scale;
                    // A cause that was fitted through the solver is followed along its secant, which bends as it does.
                    let secant = fitted.iter().find(|(m, f)| m.len() == 1 && whole.visible[m[0]] == h && f.amplitudes[0].abs() > 1e-9);
                    for (s, i) in shift.iter_mut().zip(&out) {
                        *s += match secant {
                            Some((_, f)) => {
                                let slope = (f.values[*i] - found.prediction.values[*i]) / f.amplitudes[0];
                                amplitude_along(amplitude, found, f, h, &kept) * slope
                            }
                            None => amplitude * found.columns[h][*i],
                        };
                    }
                }
            }
        }
        for (s, i) in shift.iter().zip(&out) {
            readings[*i].1 = *s;
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
    Some(Gain { before, after, interval: (at(0.05), at(0.95)), noise_floor, conditions: names, readings })
}

/// The amplitude that the kept readings ask for along a secant: by least squares beside the linear one.
fn amplitude_along(linear: f64, found: &Signatures, fitted: &Fitted, h: usize, kept: &[usize]) -> f64 {
    let (mut up, mut down) = (0.0, 0.0);
    for i in kept {
        let slope = (fitted.values[*i] - found.prediction.values[*i]) / fitted.amplitudes[0];
        up += slope * linear * found.columns[h][*i];
        down += slope * slope;
    }
    if down > 0.0 { up / down } else { linear }
}
