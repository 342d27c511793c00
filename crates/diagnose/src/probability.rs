//! Probabilities of "nothing", of every cause, of every pair, and of something else.
//!
//! Linear model, Gaussian amplitudes: evidence is closed form, but for the tails of what is added ([`Screened::tail`]). The prior is even
//! over all that could be to blame ([`Hypothesis::rate`]), each kind at each place, then over its laws. Every explanation
//! has its own discrepancy ([`coldplate_evidence::discrepancy`]). Something else is the machine as it is with a larger one than such
//! models have.

use std::collections::HashMap;

use rayon::prelude::*;

use super::effects::Hypothesis;
use super::screen::{Relabelled, Screened};

/// Prior of nothing, one cause, two causes.
///
/// Two are rare, and most pairs of the true cause with any other fit as well as the true cause alone: with a larger prior
/// they would take its probability.
const PRIORS: [f64; 3] = [0.50, 0.42, 0.01];
/// Pairs whose probability, relative to the best, is below this are not kept.
const NEGLIGIBLE: f64 = 1e-6;
/// A bound of weights is not rounded to less than the weight itself.
const ROUNDING: f64 = 1e-6;

/// A cause or two, as positions in [`Screened::visible`].
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Candidate {
    /// Positions.
    pub members: Vec<usize>,
    /// Best amplitudes, in the prior's scale.
    pub amplitudes: Vec<f64>,
    /// Misfit it takes away.
    pub gain: f64,
    /// Logarithm of evidence over that of nothing, and of its prior.
    pub weight: f64,
    /// Posterior probability.
    pub probability: f64,
}

/// Minus twice the logarithm of likelihood and prior of the machine as it is.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Ground {
    /// With a discrepancy that such models usually have.
    pub usual: f64,
    /// With any; the same as [`Ground::usual`] where that is best.
    pub any: f64,
    /// With that of the screen.
    pub screen: f64,
}

/// Everything with its probability.
#[derive(Debug, Clone)]
pub(crate) struct Posterior {
    /// Nothing is wrong.
    pub nothing: f64,
    /// Something that no cause explains.
    pub something_else: f64,
    /// Causes and pairs, most probable first.
    pub candidates: Vec<Candidate>,
    something_else_weight: f64,
}

/// Prior of every visible hypothesis, summing to one.
pub fn prior(screened: &Screened, hypotheses: &[Hypothesis]) -> Vec<f64> {
    let mut laws: HashMap<(&str, &str), f64> = HashMap::new();
    let mut places: HashMap<&str, usize> = HashMap::new();
    let all = || screened.visible.iter().map(|i| &hypotheses[*i]);
    for h in all() {
        let of_place = laws.entry((h.kind(), &h.place)).or_default();
        if *of_place == 0.0 {
            *places.entry(h.kind()).or_default() += 1;
        }
        *of_place += h.share();
    }
    let rate = |h: &Hypothesis| h.rate(places[h.kind()]) * h.share() / laws[&(h.kind(), h.place.as_str())];
    let total: f64 = all().map(rate).sum();
    all().map(|h| rate(h) / total).collect()
}

/// Logarithm of the prior of one cause or two.
pub(crate) fn prior_of(members: &[usize], prior: &[f64]) -> f64 {
    match *members {
        [j] => (PRIORS[1] * prior[j]).ln(),
        [i, j] => (PRIORS[2] * 2.0 * prior[i] * prior[j]).ln(),
        _ => f64::NEG_INFINITY,
    }
}

/// Logarithm of the evidence of one cause or two over that of nothing, in the linear model.
pub fn evidence(screened: &Screened, members: &[usize]) -> f64 {
    let along = &screened.along;
    let free = |g: f64, b: f64| 0.5 * b * b / (1.0 + g) - 0.5 * (1.0 + g).ln();
    let relabelled = |left: &Relabelled| 0.5 * (screened.misfit() - left.misfit);
    match *members {
        [j] => {
            if let Some(left) = &screened.relabelled[j] {
                return relabelled(left);
            }
            let (g, b) = (screened.square(j), along[j]);
            let most = screened.most[j];
            if b / (1.0 + g) > most {
                // At its end: the best amplitude there is, and the width it would have.
                return most * b - 0.5 * most * most * (1.0 + g) - 0.5 * (1.0 + g).ln() + screened.tail(j, most);
            }
            let sided = if screened.signed[j] { 0.0 } else { sided(b / (1.0 + g), 1.0 / (1.0 + g).sqrt()) };
            free(g, b) + sided + screened.tail(j, b / (1.0 + g))
        }
        [i, j] => {
            let (a, b, c) = (screened.square(i), screened.product(i, j), screened.square(j));
            match (&screened.relabelled[i], &screened.relabelled[j]) {
                (Some(_), Some(_)) => along[i] + along[j] - b - 0.5 * (a + c),
                (Some(left), None) => relabelled(left) + free(c, left.along[j]) + screened.tail(j, left.along[j] / (1.0 + c)),
                (None, Some(left)) => relabelled(left) + free(a, left.along[i]) + screened.tail(i, left.along[i] / (1.0 + a)),
                (None, None) => {
                    // ½ bᵀ (G + 1)⁻¹ b - ½ ln det(G + 1)
                    let (a, c) = (a + 1.0, c + 1.0);
                    let determinant = a * c - b * b;
                    let (x, y) = (along[i], along[j]);
                    let ([p, q], [most_p, most_q]) =
                        ([(c * x - b * y) / determinant, (a * y - b * x) / determinant], [screened.most[i], screened.most[j]]);
                    if p > most_p || q > most_q {
                        let (p, q) = if p > most_p { (most_p, ((y - b * most_p) / c).min(most_q)) } else { ((x - b * most_q) / a, most_q) };
                        let tails = screened.tail(i, p) + screened.tail(j, q);
                        return p * x + q * y - 0.5 * (a * p * p + 2.0 * b * p * q + c * q * q) - 0.5 * determinant.ln() + tails;
                    }
                    let tails = screened.tail(i, p) + screened.tail(j, q);
                    0.5 * (c * x * x - 2.0 * b * x * y + a * y * y) / determinant - 0.5 * determinant.ln() + tails
                }
            }
        }
        _ => f64::NEG_INFINITY,
    }
}

/// Probabilities from the linear model; pairs only where slopes serve for more than the first step, and none with a rarer law: beside
/// another cause a law with a number of its own makes up for anything.
pub(crate) fn posterior(screened: &Screened, prior: &[f64], ground: &Ground, with_pairs: bool) -> Posterior {
    let n = screened.visible.len();
    let beside_nothing = 0.5 * (ground.usual - ground.screen);
    let mut candidates: Vec<Candidate> = (0..n)
        .map(|j| {
            let (amplitude, gain) = screened.single(j);
            let weight = beside_nothing + evidence(screened, &[j]) + prior_of(&[j], prior);
            Candidate { members: vec![j], amplitudes: vec![amplitude], gain, weight, probability: 0.0 }
        })
        .collect();
    let best_single = candidates.iter().map(|c| c.weight).fold(f64::NEG_INFINITY, f64::max);
    if with_pairs {
        screened.find_products();
    }
    // Most pairs could not come to this weight at any amplitudes.
    let least = best_single + NEGLIGIBLE.ln();
    let logarithms: Vec<f64> = prior.iter().map(|p| p.ln()).collect();
    let of_two = beside_nothing + (2.0 * PRIORS[2]).ln() + ROUNDING;
    let may_count =
        |i: usize, j: usize| 0.5 * screened.pair_at_most(i, j) + of_two + logarithms[i] + logarithms[j] > least && !screened.is_rare[j];
    let pairs: Vec<Candidate> = (0..if with_pairs { n } else { 0 })
        .into_par_iter()
        .filter(|i| !screened.is_rare[*i])
        .flat_map_iter(|i| {
            (i + 1..n).filter(move |j| may_count(i, *j)).filter_map(move |j| {
                let (amplitudes, gain) = screened.pair(i, j);
                if gain <= 0.0 {
                    return None;
                }
                let weight = beside_nothing + evidence(screened, &[i, j]) + prior_of(&[i, j], prior);
                (weight > least).then(|| Candidate { members: vec![i, j], amplitudes: amplitudes.to_vec(), gain, weight, probability: 0.0 })
            })
        })
        .collect();
    candidates.extend(pairs);
    let something_else_weight =
        if ground.any < ground.usual { 0.5 * (ground.usual - ground.any) + PRIORS[0].ln() } else { f64::NEG_INFINITY };
    let mut found = Posterior { nothing: 0.0, something_else: 0.0, candidates, something_else_weight };
    found.normalise();
    found
}

impl Posterior {
    /// The same with nothing and every candidate more probable by some factors, given as logarithms.
    pub fn raised(&self, nothing: f64, of: impl Fn(&[usize]) -> f64) -> Self {
        let mut raised = self.clone();
        raised.something_else_weight -= nothing;
        raised.candidates.iter_mut().for_each(|c| c.weight += of(&c.members) - nothing);
        raised.normalise();
        raised
    }

    /// Makes probabilities of weights, and sorts.
    pub(crate) fn normalise(&mut self) {
        let mut weights = vec![PRIORS[0].ln(), self.something_else_weight];
        weights.extend(self.candidates.iter().map(|c| c.weight));
        let all = log_sum(&weights);
        self.nothing = (weights[0] - all).exp();
        self.something_else = (weights[1] - all).exp();
        self.candidates.iter_mut().for_each(|c| c.probability = (c.weight - all).exp());
        self.candidates.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    }
}

/// Logarithm of twice the probability that a normal amplitude of this mean and deviation is positive.
fn sided(mean: f64, deviation: f64) -> f64 {
    use statrs::distribution::{ContinuousCDF, Normal};
    let p = Normal::new(0.0, 1.0).map_or(0.5, |n| n.cdf(mean / deviation));
    (2.0 * p).max(1e-300).ln()
}

fn log_sum(terms: &[f64]) -> f64 {
    let most = terms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    most + terms.iter().map(|t| (t - most).exp()).sum::<f64>().ln()
}
