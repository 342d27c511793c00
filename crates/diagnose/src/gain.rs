//! The gain on conditions that took no part in fitting what is predicted there.

use std::ops::Range;

use super::Problem;
use super::view::Comparison;
use coldplate_base::random::Random;
use coldplate_evidence::measurement::{Data, whiten};

/// Resampled sets of conditions for the interval.
const RESAMPLED: usize = 2000;

/// Errors on conditions kept out, K.
#[derive(Debug, Clone, PartialEq)]
pub struct Gain {
    /// Root mean square error of the machine as it is.
    pub before: f64,
    /// The same with the causes as the other conditions have them.
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
    /// Whether data kept out are predicted no better than by the machine as it is.
    pub(crate) fn is_none(&self) -> bool {
        self.after >= self.before
    }
}

/// A reading while its condition is held out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldOutReading {
    /// Which of [`Gain::conditions`] it belongs to.
    pub condition: usize,
    /// Change of its prediction by the causes as the other conditions have them, K.
    pub change: f64,
}

/// Names of the rows of a table or of stretches of a log, given by their readings; and which of them each reading belongs to.
fn conditions(data: &Data, rows: &[Range<usize>]) -> (Vec<String>, Vec<usize>) {
    let places = whiten::places(data);
    let test = |range: &Range<usize>| data.rows[places[range.start].0].test.clone();
    let tests: Vec<String> = rows.iter().map(test).collect();
    let name = |k: usize| {
        let is_one = !data.is_transient() || tests.iter().filter(|other| **other == tests[k]).count() == 1;
        let part = tests[..=k].iter().filter(|other| **other == tests[k]).count();
        if is_one { tests[k].clone() } else { format!("{}, part {part}", tests[k]) }
    };
    let mut condition_of = vec![0; places.len()];
    rows.iter().enumerate().for_each(|(k, range)| condition_of[range.clone()].fill(k));
    ((0..rows.len()).map(name).collect(), condition_of)
}

/// The gain where all other rows change the predictions of each row by so many K; `None` of fewer than three rows. Readings that are set aside do
/// not count.
pub(crate) fn gain(problem: &Problem, base: &Comparison, rows: &[Range<usize>], change: &[f64], aside: &[usize]) -> Option<Gain> {
    if rows.len() < 3 {
        return None;
    }
    let residual = &base.found.residual;
    let (conditions, condition_of) = conditions(&problem.data, rows);
    let readings: Vec<HeldOutReading> =
        condition_of.iter().zip(change).map(|(condition, change)| HeldOutReading { condition: *condition, change: *change }).collect();
    // Squares by condition: before, after, count.
    let mut sums = vec![(0.0, 0.0, 0.0); conditions.len()];
    for (_, (reading, residual)) in readings.iter().zip(residual).enumerate().filter(|(i, _)| !aside.contains(i)) {
        let sum = &mut sums[reading.condition];
        sum.0 += residual.powi(2);
        sum.1 += (residual - reading.change).powi(2);
        sum.2 += 1.0;
    }
    let rms = |chosen: &[usize]| {
        let total = chosen.iter().fold((0.0, 0.0, 0.0), |t, c| (t.0 + sums[*c].0, t.1 + sums[*c].1, t.2 + sums[*c].2));
        ((total.0 / f64::max(total.2, 1.0)).sqrt(), (total.1 / f64::max(total.2, 1.0)).sqrt())
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
    let (low, high) = (at(0.05), at(0.95));
    Some(Gain { before, after, low, high, noise_floor: stated(problem, base), conditions, readings })
}

/// Uncertainty of readings and conditions as stated: root mean square, K.
fn stated(problem: &Problem, base: &Comparison) -> f64 {
    let (data, uncertainty) = (&problem.data, &problem.uncertainty);
    let noise: f64 = whiten::deviations(data, uncertainty).iter().map(|d| d * d).sum();
    let common = whiten::common_errors(data, uncertainty, &base.found.prediction.conditions);
    ((noise + common.iter().flatten().map(|c| c * c).sum::<f64>()) / base.readings.len().max(1) as f64).sqrt()
}
