//! Order of fitted sets: which stand against smaller ones by the rows that are kept out, how probable each is, and which are reported.

use std::collections::HashMap;

use rayon::prelude::*;

use super::search::{Fit, Search};
use super::sets::seen;
use super::{PlaceAndKind, PlaceSet};

/// Sets of each size that are fitted about the machine with the set in force.
pub const REFINED: usize = 10;
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
