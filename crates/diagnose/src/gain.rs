//! What the diagnosis gains on conditions that its selection never saw.

use rayon::prelude::*;

use super::choice::leading;
use super::effects::Hypothesis;
use super::joint::Joint;
use super::predictor::Predictor;
use super::probability::{self, Candidate, Ground};
use super::refine::{Begun, FitData, fit_begun, promised};
use super::view::{Comparison, ScreenInput};
use super::{Cause, Explanation, Problem, decide};
use coldplate_base::random::Random;
use coldplate_evidence::measurement::{Data, Whitener, whiten};

/// Most parts the conditions are cut into.
const FOLDS: usize = 5;
/// Causes that are fitted in each, beside the one that all data point to.
const FITTED: usize = 2;
/// A cause is not fitted in a fold where slopes promise an evidence behind another's by this much (a logarithm).
const BEHIND: f64 = 20.0;
/// Resampled sets of conditions for the interval.
const RESAMPLED: usize = 2000;

/// What is kept out of logs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum KeptOut {
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
    /// What one standard deviation of each common factor that may be drawn beside it changes in every reading, K.
    pub shared: &'a [Vec<f64>],
    /// The data beside the machine with it in force: its covariance.
    pub view: &'a Comparison,
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
    /// Standard deviation of the amplitude of each cause that all data point to, in its hypothesis' unit, from how it moves while tests
    /// of a log are kept out (the jackknife); empty of steady tables, of fewer than three tests, and where a part points elsewhere.
    pub scatter: Vec<f64>,
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

/// In each fold everything from the screen to the amplitude is done again without it. With fewer than three conditions there is no such
/// figure.
pub fn gain(
    problem: &Problem,
    predictor: &Predictor<'_>,
    catalogue: &[Hypothesis],
    base: &Comparison,
    named: Option<Named<'_>>,
    kept_out: KeptOut,
) -> Option<Gain> {
    let data = &problem.data;
    let cut = Cut::of(data, kept_out)?;
    // Where all data together name no cause nothing is extended, so nothing is gained or lost.
    let changes = match named {
        Some(named) => {
            let kept: Vec<&[usize]> = cut.parts.iter().map(|(kept, _)| kept.as_slice()).collect();
            Folds { predictor, catalogue, base, named }.changes(&kept, problem.seed)
        }
        None => cut.parts.iter().map(|_| None).collect(),
    };
    let is_by_test = data.is_transient() && kept_out == KeptOut::Tests && data.tests().len() >= 3;
    let scatter = if is_by_test { scatter(&changes) } else { Vec::new() };
    let kelvin: Vec<Option<&[f64]>> = changes.iter().map(|change| change.as_ref().map(|c| c.kelvin.as_slice())).collect();
    Some(Gain { scatter, ..cut.gain(problem, base, &kelvin) })
}

/// The conditions of data cut into folds. Of logs a condition is a test, and of one or two tests a block of time.
pub(crate) struct Cut {
    conditions: Vec<String>,
    /// Of every reading.
    condition_of: Vec<usize>,
    /// Of every fold the readings that are kept, and those kept out.
    pub parts: Vec<(Vec<usize>, Vec<usize>)>,
}

impl Cut {
    /// `None` of fewer than three conditions.
    pub fn of(data: &Data, kept_out: KeptOut) -> Option<Self> {
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
        let of_fold = |fold: usize| (0..places.len()).partition(|i| condition_of[*i] % folds != fold);
        let parts = (0..folds).map(of_fold).collect();
        Some(Self { conditions, condition_of, parts })
    }

    /// The gain of what every fold's kept readings change in all predictions, K.
    pub fn gain(&self, problem: &Problem, base: &Comparison, changes: &[Option<&[f64]>]) -> Gain {
        let residual = &base.found.residual;
        let mut readings: Vec<HeldOutReading> = self.condition_of.iter().map(|c| HeldOutReading { condition: *c, change: 0.0 }).collect();
        // Squares by condition: before, after, count.
        let mut sums = vec![(0.0, 0.0, 0.0); self.conditions.len()];
        for ((_, out), change) in self.parts.iter().zip(changes) {
            for i in out {
                readings[*i].change = change.map_or(0.0, |kelvin| kelvin[*i]);
                let sum = &mut sums[self.condition_of[*i]];
                sum.0 += residual[*i].powi(2);
                sum.1 += (residual[*i] - readings[*i].change).powi(2);
                sum.2 += 1.0;
            }
        }
        let rms = |chosen: &[usize]| {
            let total = chosen.iter().fold((0.0, 0.0, 0.0), |t, c| (t.0 + sums[*c].0, t.1 + sums[*c].1, t.2 + sums[*c].2));
            ((total.0 / total.2).sqrt(), (total.1 / total.2).sqrt())
        };
        let all: Vec<usize> = (0..self.conditions.len()).collect();
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
        let conditions = self.conditions.iter().map(|c| c.split('#').next().unwrap_or(c).to_string()).collect();
        Gain { before, after, low: at(0.05), high: at(0.95), noise_floor: stated(problem, base), conditions, readings, scatter: Vec::new() }
    }
}

/// The jackknife's standard deviation of every amplitude: the spread of those found while a part is kept out, times the square root of
/// the parts less one. It asks nothing of the covariance: days that differ in what nobody stated move what each of them says.
fn scatter(changes: &[Option<Change>]) -> Vec<f64> {
    let found: Option<Vec<&Vec<f64>>> = changes.iter().map(|change| change.as_ref()?.amplitudes.as_ref()).collect();
    let Some(found) = found else { return Vec::new() };
    let parts = found.len() as f64;
    let of = |j: usize| -> f64 {
        let mean = found.iter().map(|a| a[j]).sum::<f64>() / parts;
        (found.iter().map(|a| (a[j] - mean).powi(2)).sum::<f64>() * (parts - 1.0) / parts).sqrt()
    };
    (0..found.first().map_or(0, |a| a.len())).map(of).collect()
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

/// What folds share.
struct Folds<'a> {
    predictor: &'a Predictor<'a>,
    catalogue: &'a [Hypothesis],
    base: &'a Comparison,
    named: Named<'a>,
}

/// The readings of a fold, and what they point to.
struct Part<'k> {
    kept: &'k [usize],
    whitener: Whitener,
    candidates: Vec<Choice>,
}

/// What a fold comes to.
struct Change {
    /// Of all predictions, K.
    kelvin: Vec<f64>,
    /// Amplitudes of the causes that all data point to, where they are the fold's best too.
    amplitudes: Option<Vec<f64>>,
}

/// Causes worth a fit.
struct Choice {
    /// As indices into the catalogue.
    members: Vec<usize>,
    amplitudes: Vec<f64>,
    /// Logarithm of their prior.
    prior: f64,
}

impl<'a> Folds<'a> {
    /// What the cause that the kept readings of every fold point to changes in all predictions, K: screened and fitted with these
    /// alone. `None` where they raise no alarm, or point to no cause.
    fn changes(&self, kept: &[&[usize]], seed: u64) -> Vec<Option<Change>> {
        let part = |fold: usize| self.part(kept[fold], seed.wrapping_add(1 + fold as u64));
        let parts: Vec<Option<Part<'_>>> = (0..kept.len()).into_par_iter().map(part).collect();
        // Fits of the same causes begin where the first fold has them, what all data point to where all data have it: solved once.
        let mut sets: Vec<&Choice> = Vec::new();
        for choice in parts.iter().flatten().flat_map(|part| &part.candidates) {
            if !sets.iter().any(|known| known.members == choice.members) {
                sets.push(choice);
            }
        }
        let begin = |choice: &&Choice| -> Option<Begun<'_>> {
            let (members, guess) = self.fitted_with(choice);
            Some(Begun::at(self.predictor, &members, &guess)?.with_steps(self.predictor))
        };
        let begun: Vec<Option<Begun<'_>>> = sets.par_iter().map(begin).collect();
        let begun: Vec<Begun<'_>> = begun.into_iter().flatten().collect();
        parts.par_iter().map(|part| self.change(part.as_ref()?, &begun)).collect()
    }

    /// Everything that is fitted with some causes, and from where.
    fn fitted_with(&'a self, choice: &Choice) -> (Vec<&'a Hypothesis>, Vec<f64>) {
        let causes = choice.members.iter().zip(&choice.amplitudes).map(|(h, a)| (&self.catalogue[*h], *a));
        beside(causes.collect(), self.named.joint).into_iter().unzip()
    }

    /// The screen of the kept readings.
    fn part<'k>(&self, kept: &'k [usize], seed: u64) -> Option<Part<'k>> {
        let Named { explanation, joint, view, .. } = self.named;
        let (catalogue, found) = (self.catalogue, &self.base.found);
        let pick = |v: &Vec<f64>| kept.iter().map(|i| v[*i]).collect::<Vec<f64>>();
        let whitener = view.errors.whitener(&explanation.level, kept);
        let columns: Vec<Vec<f64>> = found.columns.iter().map(pick).collect();
        let places = self.places(kept);
        let residual = pick(&found.residual);
        let part = ScreenInput { residual: &residual, columns: &columns, whitener: &whitener, catalogue, places: &places }.screen();
        if !decide::raises_alarm(&part, seed) {
            return None;
        }
        let prior = probability::prior(&part, catalogue);
        let posterior = probability::posterior(&part, &prior, &Ground::default(), !self.predictor.data.is_transient());
        // What all data point to is tried in every fold: as one of several.
        let position = |h: &Hypothesis| (0..part.visible.len()).find(|j| catalogue[part.visible[*j]].is_same(h));
        let mut all_point_to: Vec<(usize, f64)> =
            explanation.causes.iter().filter_map(|c| Some((position(&c.hypothesis)?, c.amplitude))).collect();
        all_point_to.sort_by_key(|(j, _)| *j);
        let of = |(positions, amplitudes): (Vec<usize>, Vec<f64>)| Choice {
            members: positions.iter().map(|j| part.visible[*j]).collect(),
            amplitudes,
            prior: probability::prior_of(&positions, &prior),
        };
        let named = (all_point_to.len() == explanation.causes.len()).then(|| of(all_point_to.into_iter().unzip()));
        let is_other = |choice: &Choice| named.as_ref().is_none_or(|named| named.members != choice.members);
        let scaled = |c: Candidate| {
            let amplitudes = c.members.iter().zip(&c.amplitudes).map(|(j, a)| a * catalogue[part.visible[*j]].scale).collect();
            of((c.members, amplitudes))
        };
        let others: Vec<Choice> = leading(&posterior, &part, FITTED).into_iter().map(scaled).filter(is_other).collect();
        let whitener = joint.map_or(whitener, |joint| joint.whitener(kept));
        Some(Part { kept, whitener, candidates: named.into_iter().chain(others).collect() })
    }

    /// What the best of the causes that a fold points to changes.
    fn change(&self, part: &Part<'_>, begun: &[Begun<'_>]) -> Option<Change> {
        let Named { explanation, joint, shared, view } = self.named;
        let level = joint.map_or(explanation.level, |joint| joint.fitted.level);
        let readings: Vec<f64> = part.kept.iter().map(|i| view.readings[*i]).collect();
        let places = self.places(part.kept);
        let used = FitData {
            which: part.kept,
            readings: &readings,
            mesh: &view.mesh,
            places: &places,
            whitener: &part.whitener,
            level,
            without: 0.0,
        };
        let fit = |choice: &Choice, best: f64| -> Option<(f64, Change)> {
            let (members, mut guess) = self.fitted_with(choice);
            let begun = begun.iter().find(|begun| begun.is_about(&members));
            if let Some(begun) = begun {
                guess = begun.amplitudes().to_vec();
                if promised(self.predictor, begun, used).ok()? + choice.prior < best - BEHIND {
                    return None;
                }
            }
            let fitted = fit_begun(self.predictor, &members, &guess, used, begun).ok()?;
            let mut kelvin: Vec<f64> = fitted.values.iter().zip(&self.base.found.prediction.values).map(|(a, b)| a - b).collect();
            let left = part.whitener.apply(&fitted.left);
            for column in shared {
                let own: Vec<f64> = part.kept.iter().map(|i| column[*i]).collect();
                let drawn: f64 = part.whitener.apply(&own).iter().zip(&left).map(|(c, l)| c * l).sum();
                kelvin.iter_mut().zip(column).for_each(|(k, c)| *k += drawn * c);
            }
            let amplitude = |cause: &Cause| members.iter().position(|h| h.is_same(&cause.hypothesis)).map(|j| fitted.amplitudes[j]);
            let amplitudes = explanation.causes.iter().map(amplitude).collect();
            Some((fitted.evidence + choice.prior, Change { kelvin, amplitudes }))
        };
        let (first, others) = part.candidates.split_first()?;
        let first = fit(first, f64::NEG_INFINITY);
        let best = first.as_ref().map_or(f64::NEG_INFINITY, |(evidence, _)| *evidence);
        let others: Vec<(f64, Change)> = others.par_iter().filter_map(|choice| fit(choice, best)).collect();
        first.into_iter().chain(others).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, change)| change)
    }

    /// Row and sensor of some readings.
    fn places(&self, which: &[usize]) -> Vec<(usize, usize)> {
        let all = whiten::places(self.predictor.data);
        which.iter().map(|i| all[*i]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The jackknife of a mean is its standard error; where a part points elsewhere there is none.
    #[test]
    fn scatter_of_a_mean() {
        let days = [1.0, 2.0, 4.0, 9.0];
        let mean = |days: &[f64]| days.iter().sum::<f64>() / days.len() as f64;
        let without = |out: usize| {
            let kept: Vec<f64> = days.iter().enumerate().filter(|(i, _)| *i != out).map(|(_, d)| *d).collect();
            Some(Change { kelvin: Vec::new(), amplitudes: Some(vec![mean(&kept)]) })
        };
        let mut changes: Vec<Option<Change>> = (0..days.len()).map(without).collect();
        let variance = days.iter().map(|d| (d - mean(&days)).powi(2)).sum::<f64>() / 3.0;
        assert!((scatter(&changes)[0] - (variance / 4.0).sqrt()).abs() < 1e-12);
        changes[2] = None;
        assert!(scatter(&changes).is_empty());
    }
}
