//! The probability that several limits are kept together.

use crate::acceptability::{Acceptability, Chance, LimitChance, judged};
use crate::joint_normal::{Breaking, MOST_LIMITS, SAME};
use crate::math::sqrt;
use crate::normal::{density, probability_below};
use crate::surrogate::Surrogate;

/// Probability of being broken below which the dependence of a limit on others is ignored. Chosen: far below one minus
/// any confidence in use.
const NEGLIGIBLE: f64 = 1e-12;

impl Surrogate<'_> {
    /// The verdict on all limits together, from the probability of each and the covariance of pairs.
    pub(crate) fn judge_together(
        &self,
        x: &[f64],
        confidence: f64,
        chance_of: impl Fn(usize) -> Option<LimitChance>,
        shared: impl Fn(usize, usize) -> f64,
    ) -> Chance {
        let in_domain = self.in_domain(x);
        let mut chance = Chance { state: Acceptability::Uncertain, in_domain, probability: f64::NAN, binding: None };
        // The limits most likely broken, the most likely first; the probabilities of the others are added in full.
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
        // A limit that is practically never broken needs no correlation.
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
    /// No limit.
    const NONE: Self = Self { index: usize::MAX, slack: f64::INFINITY, broken: 0.0, variance: 0.0 };
}

/// Ratio of a margin to its standard deviation (dimensionless) beyond which a larger margin changes nothing: the tail
/// beyond 40 standard deviations underflows.
const FAR: f64 = 40.0;
/// Largest number of limits for which the bound is exact (count); see [`Breaking::least_kept`].
const FEW: usize = 3;
/// Bound (probability) up to which the estimate counts in full. Chosen; the tests below hold the error on cases of many
/// kinds.
const UNLIKELY: f64 = 0.7;
/// Bound (probability) from which on the bound alone counts. Chosen; the tests below hold the error on cases of many
/// kinds.
const LIKELY: f64 = 0.9;

/// Probability that all of some limits are kept. The result is a lower bound, so that "acceptable" is not said too
/// early. For more than three limits the bound is loose when far below one: there a closer estimate takes over.
fn all_kept(limits: &[Critical], correlation: [[f64; MOST_LIMITS]; MOST_LIMITS]) -> f64 {
    let (mut bound, mut broken) = ([0.0; MOST_LIMITS], [0.0; MOST_LIMITS]);
    for (i, limit) in limits.iter().enumerate() {
        (bound[i], broken[i]) = ((-limit.slack).clamp(-FAR, FAR), limit.broken);
    }
    let least = Breaking::new(&bound[..limits.len()], &broken[..limits.len()], &correlation).least_kept();
    if limits.len() <= FEW || least >= LIKELY {
        return least;
    }
    let most = limits.iter().fold(1.0, |most, limit| f64::min(most, 1.0 - limit.broken));
    let more = f64::min(one_by_one(limits, correlation), most) - least;
    least + if more > 0.0 { more * f64::min(1.0, (LIKELY - least) / (LIKELY - UNLIKELY)) } else { 0.0 }
}

/// Estimate of the probability that all of some limits are kept: one limit after the other, each given the ones before,
/// as if the remaining distribution stayed normal (Mendell and Elston 1974).
fn one_by_one(limits: &[Critical], mut correlation: [[f64; MOST_LIMITS]; MOST_LIMITS]) -> f64 {
    let mut slack = [0.0; MOST_LIMITS];
    slack.iter_mut().zip(limits).for_each(|(slack, limit)| *slack = limit.slack);
    let mut together = 1.0;
    for i in 0..limits.len() {
        if slack[i] == f64::INFINITY {
            continue;
        }
        let own = probability_below(slack[i]);
        together *= own;
        if own < 1e-300 {
            return 0.0;
        }
        // Mean, and loss of variance, of a normal variable cut off above its slack.
        let a = density(slack[i]) / own;
        let loss = a * (a + slack[i]);
        for j in i + 1..limits.len() {
            let r = correlation[i][j];
            if r > SAME {
                // A limit of one quantity with a larger margin is kept whenever this one is.
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
    together
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::vec::Vec;

    use super::*;
    use crate::normal::density;

    /// Probability that all of some standard normal numbers l z + sqrt(1 - l²) e are below their slacks, by a fine sum over z.
    fn exact(slack: &[f64], loads: &[f64]) -> f64 {
        let steps = 2_000;
        let width = 16.0 / f64::from(steps);
        let kept = |z: f64| slack.iter().zip(loads).map(|(s, l)| probability_below((s - l * z) / (1.0 - l * l).sqrt())).product::<f64>();
        (0..=steps).map(|k| -8.0 + f64::from(k) * width).map(|z| width * density(z) * kept(z)).sum()
    }

    fn found(slack: &[f64], correlation: impl Fn(usize, usize) -> f64) -> f64 {
        let critical = |(index, slack): (usize, &f64)| Critical { index, slack: *slack, broken: probability_below(-*slack), variance: 1.0 };
        let limits: Vec<Critical> = slack.iter().enumerate().map(critical).collect();
        let mut r = [[0.0; MOST_LIMITS]; MOST_LIMITS];
        for (i, row) in r.iter_mut().enumerate().take(slack.len()) {
            for (j, r) in row.iter_mut().enumerate().take(slack.len()) {
                *r = if i == j { 1.0 } else { correlation(i, j) };
            }
        }
        all_kept(&limits, r)
    }

    /// Largest errors, too low and too high, at slacks and correlations of many kinds, by ranges of the true
    /// probability.
    fn errors(count: usize, ranges: [f64; 2]) -> [(f64, f64); 3] {
        let mut errors = [(0.0_f64, 0.0_f64); 3];
        for r in [0.0, 0.3, 0.6, 0.9, 0.99, 0.999] {
            for (second, slope) in [(1.0, 0.0), (-0.95, 0.0), (1.0, 0.1)] {
                let load = |i: usize| f64::sqrt(r) * if i.is_multiple_of(2) { 1.0 } else { second } * (1.0 - slope * i as f64);
                let loads: Vec<f64> = (0..count).map(load).collect();
                let nearest = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5].into_iter();
                for (nearest, step) in nearest.flat_map(|nearest| [0.0, 0.05, 0.3].map(|step| (nearest, step))) {
                    let slack: Vec<f64> = (0..count).map(|i| nearest + step * i as f64).collect();
                    let truth = exact(&slack, &loads);
                    let error = found(&slack, |i, j| loads[i] * loads[j]) - truth;
                    let own = &mut errors[ranges.iter().filter(|from| truth >= **from).count()];
                    *own = (own.0.min(error), own.1.max(error));
                }
            }
        }
        errors
    }

    #[test]
    fn two_and_three_limits_are_exact() {
        let errors = [2, 3].map(|count| errors(count, [0.5, 0.9]));
        assert!(errors[0].iter().all(|(low, high)| *low > -1e-11 && *high < 1e-11), "{:?}", errors[0]);
        assert!(errors[1].iter().all(|(low, high)| *low > -2e-6 && *high < 2e-7), "{:?}", errors[1]);
        // All above their mean: Sheppard's 1/4 + asin(r)/2 pi, and 1/8 and the sum of three angles over 4 pi.
        for r in [-0.999, -0.9, -0.3, 0.0, 0.5, 0.9, 0.95, 0.999] {
            let two = 0.25 + f64::asin(r) / core::f64::consts::TAU;
            assert!((found(&[0.0; 2], |_, _| r) - two).abs() < 1e-11, "{r}");
            let opposed = |i: usize, j: usize| if i + j == 3 { r * r } else { r };
            let three = 0.125 + (2.0 * f64::asin(r) + f64::asin(r * r)) / (2.0 * core::f64::consts::TAU);
            assert!((found(&[0.0; 3], opposed) - three).abs() < 2e-6, "{r}: {} {three}", found(&[0.0; 3], opposed));
        }
        // scipy.stats.multivariate_normal(cov=[[1, .6, -.4], [.6, 1, .3], [-.4, .3, 1]], abseps=1e-8).cdf([0.5, 1, 1.5])
        let mixed = found(&[0.5, 1.0, 1.5], |i, j| [0.6, -0.4, 0.3][i + j - 1]);
        assert!((mixed - 0.597_521_879).abs() < 1e-6, "{mixed}");
    }

    #[test]
    fn more_limits_are_kept_with_no_less_than_is_said_where_they_are_likely_to_be() {
        // Up to one half, up to 0.9, and above.
        let [low, middle, high] = errors(5, [0.5, 0.9]);
        assert!(low.0 > -0.015 && low.1 < 0.015 && middle.0 > -0.02 && middle.1 < 0.006, "{low:?} {middle:?}");
        assert!(high.0 > -0.006 && high.1 < 1e-9, "{high:?}");
        let [low, middle, high] = errors(8, [0.5, 0.9]);
        assert!(low.0 > -0.035 && low.1 < 0.015 && middle.0 > -0.035 && middle.1 < 0.009, "{low:?} {middle:?}");
        assert!(high.0 > -0.015 && high.1 < 1e-9, "{high:?}");
        let [_, _, high] = errors(8, [0.5, 0.95]);
        assert!(high.0 > -0.006 && high.1 < 1e-9, "{high:?}");
        // scipy.stats.multivariate_normal(cov=..., abseps=1e-8).cdf([1.2, 1.4, 1.5, 1.7, 2.1])
        let rows = [[0.878, -0.392, 0.390, 0.738], [0.0, -0.120, 0.120, 0.794], [0.0, 0.0, -0.803, 0.0], [0.0; 4]];
        let mixed = found(&[1.2, 1.4, 1.5, 1.7, 2.1], |i, j| rows[i.min(j)][i.max(j) - 1]);
        assert!(mixed < 0.771_533 && mixed > 0.771, "{mixed}");
    }

    #[test]
    fn the_same_limit_again_changes_nothing() {
        for slack in [-1.0, 0.0, 1.0, 3.0] {
            for count in [2, 3, 5, 8] {
                let kept = found(&[slack; 8][..count], |_, _| 1.0);
                assert!((kept - probability_below(slack)).abs() < 1e-12, "{slack} {count}: {kept}");
            }
        }
        // A limit that cannot be broken does not count, nor do two that exclude each other.
        assert!((found(&[1.0, 1.0, 50.0], |_, _| 0.0) - probability_below(1.0).powi(2)).abs() < 1e-12);
        assert!((found(&[1.0, 1.0], |_, _| -1.0) - (2.0 * probability_below(1.0) - 1.0)).abs() < 1e-12);
        assert_eq!(found(&[f64::INFINITY, 1e300, 1e300, -1e300], |_, _| 0.0), 0.0);
    }
}
