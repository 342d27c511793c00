//! Several limits kept together.

use crate::assess::{Chance, LimitChance};
use crate::math::sqrt;
use crate::normal::{density, probability_below};
use crate::surrogate::Surrogate;
use crate::verdict::{Acceptability, judged};

/// Limits whose dependence on each other is followed; of more, those that are most likely broken.
const MOST_LIMITS: usize = 8;
/// Probability below which a limit that may be broken needs no company.
const NEGLIGIBLE: f64 = 1e-12;
/// Correlation from which on two limits are of one quantity.
const SAME: f64 = 1.0 - 1e-9;

impl Surrogate<'_> {
    /// The verdict on all limits together, from each of them and from the covariance of two.
    pub(crate) fn judge_together(
        &self,
        x: &[f64],
        confidence: f64,
        chance_of: impl Fn(usize) -> Option<LimitChance>,
        shared: impl Fn(usize, usize) -> f64,
    ) -> Chance {
        let in_domain = self.in_domain(x);
        let mut chance = Chance { state: Acceptability::Uncertain, in_domain, probability: f64::NAN, binding: None };
        // The limits most likely broken, the most likely first; what the others may add counts in full.
        let mut worst = [Critical::NONE; MOST_LIMITS];
        let (mut count, mut broken_elsewhere) = (0, 0.0);
        for index in 0..self.limits.len() {
            let Some(limit) = chance_of(index) else { continue };
            if limit.probability.is_nan() {
                return Chance { binding: Some(index), ..chance };
            }
            let slack = (limit.maximum - limit.value) / limit.band.total.max(f64::MIN_POSITIVE);
            let mut own = Critical { index, slack, broken: 1.0 - limit.probability, variance: limit.band.total * limit.band.total };
            for place in &mut worst {
                if own.index != usize::MAX && (place.index == usize::MAX || own.slack < place.slack) {
                    core::mem::swap(place, &mut own);
                }
            }
            if own.index == usize::MAX { count += 1 } else { broken_elsewhere += own.broken }
        }
        if count == 0 {
            return chance;
        }
        // What is as good as never broken depends on nothing.
        let doubtful = worst[..count].iter().skip(1).take_while(|own| own.broken > NEGLIGIBLE).count() + 1;
        let worst = &worst[..doubtful.min(count)];
        let mut correlation = [[0.0; MOST_LIMITS]; MOST_LIMITS];
        for (i, a) in worst.iter().enumerate() {
            correlation[i][i] = 1.0;
            for (j, b) in worst[..i].iter().enumerate() {
                let scale = sqrt(a.variance * b.variance);
                let r = if scale > 0.0 { (shared(a.index, b.index) / scale).clamp(-1.0, 1.0) } else { 0.0 };
                (correlation[i][j], correlation[j][i]) = (r, r);
            }
        }
        let together = all_kept(worst, correlation) - broken_elsewhere;
        chance.probability = if together > 0.0 { together } else { 0.0 };
        chance.binding = Some(worst[0].index);
        if in_domain && chance.probability.is_finite() {
            chance.state = judged(chance.probability, confidence);
        }
        chance
    }
}

/// A limit that may be broken.
#[derive(Clone, Copy)]
struct Critical {
    index: usize,
    /// Margin over its standard deviation.
    slack: f64,
    broken: f64,
    variance: f64,
}

impl Critical {
    const NONE: Self = Self { index: usize::MAX, slack: f64::INFINITY, broken: 0.0, variance: 0.0 };
}

/// Probability that all of some limits are kept: one after the other, each given those before, as if what is left stayed normal
/// (Mendell and Elston 1974), and never outside what their own probabilities allow.
fn all_kept(limits: &[Critical], mut correlation: [[f64; MOST_LIMITS]; MOST_LIMITS]) -> f64 {
    let mut slack = [0.0; MOST_LIMITS];
    slack.iter_mut().zip(limits).for_each(|(slack, limit)| *slack = limit.slack);
    let (mut together, mut least, mut broken) = (1.0, 1.0, 0.0);
    for (i, limit) in limits.iter().enumerate() {
        least = f64::min(least, 1.0 - limit.broken);
        broken += limit.broken;
        if slack[i] == f64::INFINITY {
            continue;
        }
        let own = probability_below(slack[i]);
        together *= own;
        if own < 1e-300 {
            return 0.0;
        }
        // Mean and loss of variance of a normal variable that is cut off above its slack.
        let a = density(slack[i]) / own;
        let loss = a * (a + slack[i]);
        for j in i + 1..limits.len() {
            let r = correlation[i][j];
            if r > SAME {
                // The same quantity with more room: kept where this one is.
                slack[j] = f64::INFINITY;
                continue;
            }
            let left = 1.0 - r * r * loss;
            slack[j] = if left > 1e-12 { (slack[j] + r * a) / sqrt(left) } else { slack[j] + r * a };
        }
        let row = correlation[i];
        for j in i + 1..limits.len() {
            for k in i + 1..limits.len() {
                if j != k {
                    let (left_j, left_k) = (1.0 - row[j] * row[j] * loss, 1.0 - row[k] * row[k] * loss);
                    let scale = sqrt(left_j.max(1e-12) * left_k.max(1e-12));
                    correlation[j][k] = ((correlation[j][k] - row[j] * row[k] * loss) / scale).clamp(-1.0, 1.0);
                }
            }
        }
    }
    together.clamp(if broken < 1.0 { 1.0 - broken } else { 0.0 }, least)
}
