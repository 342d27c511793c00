//! All sets of places and kinds: alone, then grown place by place, each with what it calls grossly wrong and without.

use rayon::prelude::*;

use super::gross::Gross;
use super::search::{Fit, GROWING, Search, ordered, sorted};
use coldplate_base::progress::Progress;

/// Places of one set at most.
const MOST_PLACES: usize = 4;
/// A member whose amplitude is nowhere as many standard deviations from nothing may be nothing. Chosen: beyond it the member explains more
/// than any choice of it costs.
const MAY_BE_NOTHING: f64 = 4.0;

/// Sets of one size. A gross error can hide a cause, and a cause look like gross errors: sets grow from both.
struct OfOneSize {
    /// Of the whole table, most probable first.
    whole: Vec<Fit>,
    /// With parts of the table set aside.
    cleared: Vec<Fit>,
}

impl OfOneSize {
    /// From sets of the whole table, and from some that were begun with parts of it set aside.
    fn new(search: &Search<'_>, gross: &Gross<'_>, most: usize, whole: Vec<Fit>, begun: Vec<Fit>) -> Self {
        let whole = refined(search, most, whole);
        let best = |fits: &[Fit]| fits.iter().take(most).cloned().collect::<Vec<Fit>>();
        let begun = refined(search, most, begun);
        let clear = |fit: Fit| {
            let found = gross.cleared(fit.clone());
            if found.aside == fit.aside { found } else { search.refined(found) }
        };
        let rest = begun.iter().skip(most).cloned();
        let found: Vec<Fit> = [best(&whole), best(&begun)].concat().into_par_iter().map(clear).collect();
        let (cleared, as_it_is): (Vec<Fit>, Vec<Fit>) = found.into_iter().chain(rest).partition(|fit| !fit.aside.is_empty());
        Self { whole: distinct([whole, as_it_is].concat()), cleared: distinct(cleared) }
    }

    fn all(&self) -> impl Iterator<Item = &Fit> {
        self.whole.iter().chain(&self.cleared)
    }

    fn most(&self) -> f64 {
        self.all().map(Fit::log_posterior).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// The machine as it is, and all sets that are fitted, most probable first; `most` of each size about the machine with the set in force, and with
/// parts set aside that may be grossly wrong.
pub fn fitted(search: &Search<'_>, gross: &Gross<'_>, most: usize, progress: &dyn Progress) -> (Fit, Vec<Fit>) {
    let whole = search.nothing();
    let nothing = gross.nothing(&whole);
    progress.say("places and kinds alone");
    let mut begun: Vec<Fit> = gross.beginnings(&nothing).iter().flat_map(|aside| search.beside(aside).singles(aside)).collect();
    begun.extend(gross.instead(&nothing));
    let mut last = OfOneSize::new(search, gross, most, search.singles(&whole), sorted(begun));
    let mut all: Vec<Fit> = last.all().cloned().collect();
    for count in 2..=MOST_PLACES {
        let before = all.iter().map(Fit::log_posterior).fold(f64::NEG_INFINITY, f64::max);
        progress.say(&format!("sets of {count}"));
        let instead: Vec<Fit> = last.cleared.par_iter().take(GROWING).flat_map_iter(|fit| gross.instead(fit)).collect();
        let begun = [search.grown(&last.cleared), instead].concat();
        last = OfOneSize::new(search, gross, most, search.grown(&last.whole), sorted(begun));
        all.extend(last.all().cloned());
        // A set that was begun badly may be found from one with a place more.
        all.extend(without_nothings(search, &all, &[&last.whole[..], &last.cleared[..]]));
        if last.most() <= before {
            break;
        }
    }
    (nothing, distinct(all))
}

/// The best of some fits about the machine with their sets in force, most probable first.
pub fn refined(search: &Search<'_>, most: usize, mut fits: Vec<Fit>) -> Vec<Fit> {
    let rest = fits.split_off(fits.len().min(most));
    let mut all: Vec<Fit> = fits.into_par_iter().map(|fit| search.refined(fit)).chain(rest).collect();
    all.retain(|fit| fit.log_evidence.is_finite());
    all.sort_by(|a, b| b.log_posterior().total_cmp(&a.log_posterior()));
    all
}

/// Sets without a member that may be nothing, fitted from where the most probable sets with it stand; those that are known to be more probable
/// are left as they are.
fn without_nothings(search: &Search<'_>, known: &[Fit], of_one_size: &[&[Fit]]) -> Vec<Fit> {
    let mut begun: Vec<Fit> = Vec::new();
    for fit in of_one_size.iter().flat_map(|fits| fits.iter().take(GROWING)) {
        let deviations = seen(search, fit).0;
        for (k, deviations) in deviations.iter().enumerate() {
            let own = search.course(&fit.amplitudes[k]);
            if own.iter().zip(deviations).any(|(a, deviation)| a.abs() > MAY_BE_NOTHING * deviation) {
                continue;
            }
            let mut less = Fit { reference: None, stands: false, log_evidence: f64::NEG_INFINITY, ..fit.clone() };
            less.members.remove(k);
            less.freedoms.remove(k);
            less.amplitudes.remove(k);
            less.log_prior = search.log_prior(&less.members);
            let is_same = |other: &&Fit| ordered(&other.members) == ordered(&less.members) && other.aside == less.aside;
            let is_known = known.iter().filter(is_same).any(|other| other.log_posterior() > fit.log_posterior());
            if !is_known && !begun.iter().any(|other| is_same(&other)) {
                begun.push(less);
            }
        }
    }
    refined(search, begun.len(), begun)
}

/// The most probable fit of each set, most probable first.
fn distinct(mut fits: Vec<Fit>) -> Vec<Fit> {
    fits.sort_by(|a, b| b.log_posterior().total_cmp(&a.log_posterior()));
    let mut known = std::collections::HashSet::new();
    fits.retain(|fit| known.insert(ordered(&fit.members)));
    fits
}

/// Deviations of the amplitudes of each member, and the density of each row given all others.
pub fn seen(search: &Search<'_>, fit: &Fit) -> (Vec<Vec<f64>>, Vec<f64>) {
    let search = search.with_errors_of(fit);
    let explained = search.explained(&search.linear_about(fit), fit.looseness, &search.followed(&fit.freedoms));
    let Some(explained) = explained else { return Default::default() };
    let Some(posterior) = explained.posterior(&fit.freedoms, fit.looseness) else { return Default::default() };
    let deviations = |m: usize| posterior.variances(m).into_iter().map(f64::sqrt).collect();
    ((0..fit.members.len()).map(deviations).collect(), posterior.kept_out())
}
