//! What a test is worth before it is made: readings are drawn from every open explanation, and each draw is judged as the real
//! readings would be.
//!
//! Explanations are linear in their amplitudes, which have a normal distribution of unit variance in the columns of an
//! [`Outlook`]. So what a draw leaves is a mixture of normal distributions: probabilities, amplitudes and what follows from them for
//! the temperatures and limits at other conditions.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, Normal};

use super::outlook::Outlook;
use coldplate_base::random::Random;
use coldplate_describe::machine::{Condition, Machine};
use coldplate_evidence::measurement::Whitener;

/// Draws from each explanation.
const DRAWS: usize = 32;

/// A quantity as it is and as it is expected to be after a test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expected {
    /// As it is.
    pub before: f64,
    /// Its mean over what the test may show.
    pub after: f64,
}

impl Expected {
    /// How much less it is expected to be.
    pub fn drop(&self) -> f64 {
        self.before - self.after
    }
}

/// What a test is expected to settle of what the open explanations leave open; the machine's other uncertainties are not in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Worth {
    /// Probability that the most probable explanation is a wrong one.
    pub wrong_name: Expected,
    /// Root mean square of the error of predictions over the ranges of the machine, at the sensors of the data, K.
    pub prediction: Expected,
    /// Probability of a wrong verdict about the limits, mean over the conditions; `None` without limits.
    pub wrong_verdict: Option<Expected>,
}

/// What decisions rest on: predictions at conditions over the machine's ranges under each explanation.
pub(super) struct Stakes {
    of: Vec<Stake>,
    has_limits: bool,
}

/// Predictions under one explanation, linear in its amplitudes.
struct Stake {
    /// Temperatures at the sensors of the data, K, and what each amplitude adds to them.
    temperatures: DVector<f64>,
    slopes: DMatrix<f64>,
    /// Least margin to a limit at each condition, K, and what each amplitude adds to it.
    margins: DVector<f64>,
    margin_slopes: DMatrix<f64>,
}

impl Stakes {
    /// From readings of all the machine's sensors at some conditions (conditions, then sensors): those of the machine as it is, K, and what
    /// each explanation adds; `own` are the sensors of the data.
    pub fn new(
        machine: &Machine,
        conditions: &[Condition],
        base: &[f64],
        shown: &[Vec<f64>],
        open: &[Vec<Vec<f64>>],
        own: &[usize],
    ) -> Self {
        let sensors = machine.sensors.len();
        let least = |readings: &[f64]| -> DVector<f64> {
            let at = |(c, condition): (usize, &Condition)| {
                let row = &readings[c * sensors..(c + 1) * sensors];
                let margin = |l: &coldplate_describe::machine::MachineLimit| l.maximum - l.kind.value(|s| row[s], |v| condition.si()[v]);
                machine.limits.iter().map(margin).fold(f64::INFINITY, f64::min)
            };
            DVector::from_iterator(conditions.len(), conditions.iter().enumerate().map(at))
        };
        let picked = |readings: &[f64]| -> DVector<f64> {
            let count = conditions.len() * own.len();
            DVector::from_iterator(count, (0..conditions.len()).flat_map(|c| own.iter().map(move |s| readings[c * sensors + s])))
        };
        let of = |(added, columns): (&Vec<f64>, &Vec<Vec<f64>>)| -> Stake {
            let mean: Vec<f64> = base.iter().zip(added).map(|(b, a)| b + a).collect();
            let moved = |column: &[f64], by: f64| -> Vec<f64> { mean.iter().zip(column).map(|(m, c)| m + by * c).collect() };
            let of_margin = |column: &Vec<f64>| 0.5 * (least(&moved(column, 1.0)) - least(&moved(column, -1.0)));
            let slopes: Vec<DVector<f64>> = columns.iter().map(|column| picked(column)).collect();
            let margin_slopes: Vec<DVector<f64>> = columns.iter().map(of_margin).collect();
            let margins = least(&mean);
            Stake {
                temperatures: picked(&mean),
                slopes: DMatrix::from_columns(&slopes),
                margin_slopes: DMatrix::from_columns(&margin_slopes),
                margins,
            }
        };
        Self { of: shown.iter().zip(open).map(of).collect(), has_limits: !machine.limits.is_empty() }
    }
}

/// What is believed of one explanation: its probability, and its amplitudes.
struct Belief {
    probability: f64,
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
}

/// What is left open.
struct Left {
    wrong_name: f64,
    /// Mean square, K².
    prediction: f64,
    wrong_verdict: f64,
}

impl Stakes {
    fn left(&self, beliefs: &[Belief]) -> Left {
        let certain = beliefs.iter().map(|b| b.probability).fold(0.0, f64::max);
        let means: Vec<DVector<f64>> = self.of.iter().zip(beliefs).map(|(s, b)| &s.temperatures + &s.slopes * &b.mean).collect();
        let count = means.first().map_or(0, |m| m.len());
        let mut middle = DVector::zeros(count);
        means.iter().zip(beliefs).for_each(|(m, b)| middle += b.probability * m);
        let mut square = 0.0;
        for ((stake, b), mean) in self.of.iter().zip(beliefs).zip(&means) {
            let within = (&stake.slopes * &b.covariance).component_mul(&stake.slopes).sum();
            square += b.probability * (within + (mean - &middle).norm_squared());
        }
        Left { wrong_name: 1.0 - certain, prediction: square / count.max(1) as f64, wrong_verdict: self.wrong_verdict(beliefs) }
    }

    /// Mean over the conditions of the smaller one of the probabilities that all limits are kept and that one is not.
    fn wrong_verdict(&self, beliefs: &[Belief]) -> f64 {
        if !self.has_limits {
            return 0.0;
        }
        let conditions = self.of[0].margins.len();
        let mut kept = DVector::<f64>::zeros(conditions);
        for (stake, b) in self.of.iter().zip(beliefs) {
            let means = &stake.margins + &stake.margin_slopes * &b.mean;
            let variances = (&stake.margin_slopes * &b.covariance).component_mul(&stake.margin_slopes).column_sum();
            for c in 0..conditions {
                kept[c] += b.probability * probability_above(means[c], variances[c].max(0.0).sqrt());
            }
        }
        kept.iter().map(|p| p.min(1.0 - p).max(0.0)).sum::<f64>() / conditions.max(1) as f64
    }
}

/// Probability that a normal quantity is positive.
fn probability_above(mean: f64, deviation: f64) -> f64 {
    match Normal::new(mean, deviation) {
        Ok(normal) => normal.sf(0.0),
        Err(_) => f64::from(u8::from(mean > 0.0)),
    }
}

/// What a test is worth that shows some readings of an outlook, where the explanations have these probabilities now.
pub(super) fn worth(outlook: &Outlook, readings: &[usize], probabilities: &[f64], stakes: &Stakes) -> Worth {
    let pick = |v: &Vec<f64>| readings.iter().map(|i| v[*i]).collect::<Vec<f64>>();
    let whitener = Whitener::new(&pick(&outlook.deviation), &outlook.common.iter().map(pick).collect::<Vec<_>>());
    let whitened = |v: &Vec<f64>| DVector::from_vec(whitener.apply(&pick(v)));
    let shown: Vec<DVector<f64>> = outlook.shown.iter().map(whitened).collect();
    let open: Vec<DMatrix<f64>> =
        outlook.open.iter().map(|columns| DMatrix::from_columns(&columns.iter().map(whitened).collect::<Vec<_>>())).collect();
    let whole: f64 = probabilities.iter().sum();
    let prior: Vec<f64> = probabilities.iter().map(|p| p / whole).collect();
    let believed = |probability: f64, q: usize| Belief { probability, mean: DVector::zeros(q), covariance: DMatrix::identity(q, q) };
    let before = stakes.left(&prior.iter().zip(&open).map(|(p, o)| believed(*p, o.ncols())).collect::<Vec<_>>());
    let inverses: Vec<DMatrix<f64>> = open.iter().map(|o| inverse(DMatrix::identity(o.ncols(), o.ncols()) + o.tr_mul(o))).collect();
    let judged = |read: &DVector<f64>| -> Left {
        let mut beliefs: Vec<Belief> = Vec::with_capacity(open.len());
        let mut logs = Vec::with_capacity(open.len());
        for (((o, m), covariance), p) in open.iter().zip(&shown).zip(&inverses).zip(&prior) {
            let left = read - m;
            let along = o.tr_mul(&left);
            let mean = covariance * &along;
            let chi2 = left.norm_squared() - along.dot(&mean);
            logs.push(p.ln() - 0.5 * chi2 + 0.5 * covariance.determinant().max(f64::MIN_POSITIVE).ln());
            beliefs.push(Belief { probability: 0.0, mean, covariance: covariance.clone() });
        }
        let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = logs.iter().map(|l| (l - most).exp()).sum();
        beliefs.iter_mut().zip(&logs).for_each(|(b, l)| b.probability = (l - most).exp() / sum);
        stakes.left(&beliefs)
    };
    // The same draws for every test: their differences are the tests'.
    let mut random = Random::new(1);
    let mut after = Left { wrong_name: 0.0, prediction: 0.0, wrong_verdict: 0.0 };
    for ((o, m), p) in open.iter().zip(&shown).zip(&prior) {
        for _ in 0..DRAWS {
            let amplitudes = DVector::from_fn(o.ncols(), |_, _| random.normal());
            let noise = DVector::from_fn(m.len(), |_, _| random.normal());
            let left = judged(&(m + o * amplitudes + noise));
            let share = p / DRAWS as f64;
            after.wrong_name += share * left.wrong_name;
            after.prediction += share * left.prediction;
            after.wrong_verdict += share * left.wrong_verdict;
        }
    }
    Worth {
        wrong_name: Expected { before: before.wrong_name, after: after.wrong_name },
        prediction: Expected { before: before.prediction.sqrt(), after: after.prediction.sqrt() },
        wrong_verdict: stakes.has_limits.then_some(Expected { before: before.wrong_verdict, after: after.wrong_verdict }),
    }
}

/// Of I + Oᵀ O, which is positive definite.
fn inverse(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let n = matrix.nrows();
    matrix.cholesky().map_or_else(|| DMatrix::identity(n, n), |c| c.inverse())
}
