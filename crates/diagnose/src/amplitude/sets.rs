//! All sets of places and kinds: alone, then grown place by place, each with what it calls grossly wrong and without.

use rayon::prelude::*;

use super::gross::Gross;
use super::search::{Fit, GROWING, Search, sorted};
use coldplate_base::progress::Progress;

/// Places of one set at most.
const MOST_PLACES: usize = 4;

/// Sets of one size. A gross error can hide a cause, and a cause look like gross errors: sets grow from both.
struct OfOneSize {
    /// Of the whole table, most probable first.
    whole: Vec<Fit>,
    /// With parts of the table set aside.
    cleared: Vec<Fit>,
}

impl OfOneSize {
    /// From sets of the whole table, and from some that were begun with parts of it set aside.
    fn new(search: &Search<'_>, gross: Option<&Gross<'_>>, most: usize, whole: Vec<Fit>, begun: Vec<Fit>) -> Self {
        let whole = refined(search, most, whole);
        let Some(gross) = gross else { return Self { whole, cleared: Vec::new() } };
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
pub fn fitted(search: &Search<'_>, gross: Option<&Gross<'_>>, most: usize, progress: &dyn Progress) -> (Fit, Vec<Fit>) {
    let whole = search.nothing();
    let nothing = gross.map_or_else(|| whole.clone(), |gross| gross.nothing(&whole));
    progress.say("places and kinds alone");
    let begun = gross.map_or_else(Vec::new, |gross| gross.beginnings(&nothing));
    let mut begun: Vec<Fit> = begun.iter().flat_map(|aside| search.beside(aside).singles(aside)).collect();
    begun.extend(gross.map_or_else(Vec::new, |gross| gross.instead(&nothing)));
    let mut last = OfOneSize::new(search, gross, most, search.singles(&whole), sorted(begun));
    let mut all: Vec<Fit> = last.all().cloned().collect();
    for count in 2..=MOST_PLACES {
        let before = all.iter().map(Fit::log_posterior).fold(f64::NEG_INFINITY, f64::max);
        progress.say(&format!("sets of {count}"));
        let instead = |gross: &Gross<'_>| last.cleared.par_iter().take(GROWING).flat_map_iter(|fit| gross.instead(fit)).collect();
        let begun = [search.grown(&last.cleared), gross.map_or_else(Vec::new, instead)].concat();
        last = OfOneSize::new(search, gross, most, search.grown(&last.whole), sorted(begun));
        all.extend(last.all().cloned());
        if last.most() <= before {
            break;
        }
    }
    (nothing, distinct(all))
}

/// The best of some fits about the machine with their sets in force, most probable first.
fn refined(search: &Search<'_>, most: usize, mut fits: Vec<Fit>) -> Vec<Fit> {
    let rest = fits.split_off(fits.len().min(most));
    let mut all: Vec<Fit> = fits.into_par_iter().map(|fit| search.refined(fit)).chain(rest).collect();
    all.retain(|fit| fit.log_evidence.is_finite());
    all.sort_by(|a, b| b.log_posterior().total_cmp(&a.log_posterior()));
    all
}

/// The most probable fit of each set, most probable first.
fn distinct(mut fits: Vec<Fit>) -> Vec<Fit> {
    fits.sort_by(|a, b| b.log_posterior().total_cmp(&a.log_posterior()));
    let mut seen = std::collections::HashSet::new();
    fits.retain(|fit| {
        let mut own = fit.members.clone();
        own.sort_unstable();
        seen.insert(own)
    });
    fits
}
