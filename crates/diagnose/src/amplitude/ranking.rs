//! Order of fitted sets: which stand against smaller ones by the rows that are kept out, how probable each is, and which are reported.

use std::collections::HashMap;

use coldplate_base::random::Random;
use rayon::prelude::*;

use super::search::{Fit, Search};
use super::sets::seen;
use super::{PlaceAndKind, PlaceSet};

/// Sets of each size that are fitted about the machine with the set in force.
pub const REFINED: usize = 10;
/// Logs like the one at hand over which probabilities are averaged, a count: a share is known to one or two per cent.
const RESAMPLED: usize = 2000;
/// Sets that are reported.
const MOST_SETS: usize = 12;

/// Sets with their members in another order: the place and kind that the fewest of all sets lack stands first.
pub fn with_certain_first(mut sets: Vec<PlaceSet>) -> Vec<PlaceSet> {
    let is = |a: &PlaceAndKind, b: &PlaceAndKind| (a.hypothesis.kind(), &a.hypothesis.place) == (b.hypothesis.kind(), &b.hypothesis.place);
    let missing = |member: &PlaceAndKind| -> f64 {
        let without = sets.iter().filter(|set| !set.members.iter().any(|other| is(member, other)));
        without.map(|set| set.probability).sum()
    };
    let order = |set: &PlaceSet| {
        let of: Vec<f64> = set.members.iter().map(missing).collect();
        let mut order: Vec<usize> = (0..of.len()).collect();
        order.sort_by(|a, b| of[*a].total_cmp(&of[*b]));
        order
    };
    let orders: Vec<Vec<usize>> = sets.iter().map(order).collect();
    for (set, order) in sets.iter_mut().zip(&orders) {
        set.members = order.iter().map(|k| set.members[*k].clone()).collect();
        for way in &mut set.ways {
            way.causes = order.iter().map(|k| way.causes[*k].clone()).collect();
        }
    }
    sets
}

/// Sets that are reported, of some that are in order: the first ones, and the machine as it is.
pub fn most_probable<T>(all: Vec<T>, fit: impl Fn(&T) -> &Fit) -> impl Iterator<Item = T> {
    let is_kept = move |(place, own): &(usize, T)| *place < MOST_SETS || fit(own).members.is_empty();
    all.into_iter().enumerate().filter(is_kept).map(|(_, own)| own)
}

/// Logarithm of the sum of the posteriors of some fits.
pub fn whole<'f>(all: impl Iterator<Item = &'f Fit> + Clone) -> f64 {
    let most = all.clone().map(Fit::log_posterior).fold(f64::NEG_INFINITY, f64::max);
    most + all.map(|fit| (fit.log_posterior() - most).exp()).sum::<f64>().ln()
}

/// Posterior probabilities of the sets of a log, given by the logarithms of their posteriors and by their log densities of each stretch given all
/// others: the mean over logs like this one, in which each stretch counts as often as it might (Bayesian bootstrap: Rubin 1981; for models that
/// are compared, Yao and others 2018). What a model of a log leaves out differs from stretch to stretch, so that a stretch is one draw of it,
/// however many readings it has.
pub fn resampled(log_posteriors: &[f64], densities: &[Vec<f64>], seed: u64) -> Vec<f64> {
    let mut random = Random::new(seed);
    let stretches = densities.iter().map(Vec::len).max().unwrap_or(0);
    let mut probabilities = vec![0.0; log_posteriors.len()];
    for _ in 0..RESAMPLED {
        let shares: Vec<f64> = (0..stretches).map(|_| -(1.0 - random.unit()).ln()).collect();
        let mean = shares.iter().sum::<f64>() / stretches.max(1) as f64;
        let more = |own: &Vec<f64>| own.iter().zip(&shares).map(|(density, share)| (share / mean - 1.0) * density).sum::<f64>();
        let logs: Vec<f64> = log_posteriors.iter().zip(densities).map(|(log, own)| log + more(own)).collect();
        let most = logs.iter().copied().filter(|log| !log.is_nan()).fold(f64::NEG_INFINITY, f64::max);
        let own: Vec<f64> = logs.iter().map(|log| if log.is_nan() { 0.0 } else { (log - most).exp() }).collect();
        let whole = own.iter().sum::<f64>() * RESAMPLED as f64;
        probabilities.iter_mut().zip(own).for_each(|(p, own)| *p += own / whole);
    }
    probabilities
}

/// Sets, most probable first, without those of several places that do not make the rows that are kept out more probable than the most probable
/// smaller sets among their places do, of these and of some others, by more than the standard error of that. A smaller set that leaves more open
/// than models of careful machine files do is not simpler than one that does not: what is open are causes without a name. Whether anything acts
/// is decided by evidence: it may act in one row.
pub fn that_predict_more(search: &Search<'_>, sets: Vec<Fit>, others: &[Fit]) -> Vec<Fit> {
    let own = sets.into_iter().map(|fit| (fit, true)).chain(others.iter().map(|fit| (fit.clone(), false)));
    let mut sets: Vec<(Fit, bool)> = own.collect();
    sets.sort_by(|a, b| b.0.log_posterior().total_cmp(&a.0.log_posterior()));
    let densities: Vec<Vec<f64>> = sets.par_iter().map(|(fit, _)| seen(search, fit).1).collect();
    let is_usual = |fit: &Fit| search.settings.is_usual(&fit.looseness);
    let is_simpler = |less: &Fit, fit: &Fit| less.members.iter().all(|m| fit.members.contains(m)) && (is_usual(less) || !is_usual(fit));
    let predicts_more = |k: &usize| {
        let fit = &sets[*k].0;
        let simpler = |size: usize| (0..sets.len()).find(|other| sets[*other].0.members.len() == size && is_simpler(&sets[*other].0, fit));
        (1..fit.members.len()).filter_map(simpler).all(|less| {
            let (sum, error) = sum_and_error(&difference(&densities[*k], &densities[less]));
            sum > error
        })
    };
    let kept: Vec<usize> = (0..sets.len()).filter(|k| sets[*k].1).filter(predicts_more).collect();
    kept.into_iter().map(|k| sets[k].0.clone()).collect()
}

/// The best sets of each size, whose laws are looked for, and the others.
pub fn best_of_each_size(mut all: Vec<Fit>) -> (Vec<Fit>, Vec<Fit>) {
    all.sort_by(|a, b| b.log_posterior().total_cmp(&a.log_posterior()));
    let mut counts = HashMap::new();
    all.into_iter().partition(|fit| {
        let count: &mut usize = counts.entry(fit.members.len()).or_default();
        *count += 1;
        *count <= REFINED
    })
}

pub fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Sum of some numbers, and its standard error.
pub fn sum_and_error(numbers: &[f64]) -> (f64, f64) {
    let n = numbers.len().max(1) as f64;
    let mean = numbers.iter().sum::<f64>() / n;
    let variance = numbers.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    (n * mean, (n * variance).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lead_that_one_stretch_makes_is_less_certain_than_one_that_all_make() {
        let of = |own: [f64; 6]| resampled(&[own.iter().sum::<f64>(), 0.0], &[own.to_vec(), vec![0.0; 6]], 1);
        let (all, one) = (of([2.0; 6]), of([32.0, -4.0, -4.0, -4.0, -4.0, -4.0]));
        // Where all stretches say the same, a lead of 12 is one in evidence.
        assert!((all[0] - 1.0 / (1.0 + (-12.0f64).exp())).abs() < 1e-9, "{all:?}");
        // The mean of the logistic function of 12 under as many draws as one likes.
        assert!((one[0] - 0.552).abs() < 0.03, "{one:?}");
        assert!([all, one].iter().all(|own| (own.iter().sum::<f64>() - 1.0).abs() < 1e-9));
        // A set whose densities are unknown has its evidence.
        assert!((resampled(&[3.0, 0.0], &[Vec::new(), Vec::new()], 1)[0] - 1.0 / (1.0 + (-3.0f64).exp())).abs() < 1e-9);
    }
}
