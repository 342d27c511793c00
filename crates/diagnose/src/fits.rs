//! Which of some causes are fitted through the full solver, and how far.

use rayon::prelude::*;

use super::choice::LEFT;
use super::effects::Hypothesis;
use super::finalists::{Entry, Finalists};
use super::probability::Candidate;
use super::refine::{Begun, FitData, Fitted, first_look, fit_again, fit_begun};
use super::view::Comparison;
use coldplate_evidence::discrepancy::DiscrepancySize;
use coldplate_evidence::identify::chi_square_tail;

/// A misfit left that is more probable than this is too small.
const TOO_GOOD: f64 = 1.0 - 1e-6;
/// A cause is fitted no further where its first look promises a deviance worse than another's by this much, and by this share of what
/// that one is better than the machine as it is.
const BEHIND: f64 = 100.0;
const BEHIND_SHARE: f64 = 0.5;
/// Causes whose slopes have this cosine and more look the same.
const ALIKE: f64 = 0.999;

/// A fit, or the beginning of one that is far behind.
struct Tried {
    entry: Entry,
    is_far: bool,
}

impl Finalists<'_> {
    /// Fits, from amplitudes found before where there are any: the most probable first, and of the others only the beginning where
    /// they are far behind it or behind one that is known. What looks the same to slopes as one that is far behind is as far.
    pub(super) fn solve(&self, candidates: &[Candidate], before: &[Entry], view: &Comparison) -> Vec<Entry> {
        let all: Vec<usize> = (0..view.readings.len()).collect();
        let (readings, mesh, places) = (&view.readings, &view.mesh, &self.places);
        let used = FitData { which: &all, readings, mesh, places, whitener: &view.whitener, level: view.level, without: view.without };
        let attempt = |c: &Candidate, bar: Option<f64>| -> Option<Tried> {
            let members: Vec<&Hypothesis> = c.members.iter().map(|j| self.of(*j)).collect();
            let ended = before.iter().find(|(m, _)| *m == c.members).map(|(_, fitted)| fitted);
            let guess: Vec<f64> = match ended {
                Some(fitted) => fitted.amplitudes.clone(),
                None => c.amplitudes.iter().zip(&members).map(|(a, h)| a * h.scale).collect(),
            };
            let begun = match ended.filter(|_| !self.predictor.fronts) {
                Some(fitted) => Some(Begun::ended(&members, fitted)),
                None => bar.and_then(|_| Begun::at(self.predictor, &members, &guess)),
            };
            let look = begun.as_ref().and_then(|begun| first_look(self.predictor, begun, used));
            if let Some(look) = look.filter(|look| bar.is_some_and(|bar| self.promise(&members, look, used, view) > bar)) {
                return Some(Tried { entry: (c.members.clone(), look), is_far: true });
            }
            let fitted = fit_begun(self.predictor, &members, &guess, used, begun.as_ref()).ok()?;
            Some(Tried { entry: (c.members.clone(), self.at_its_level(&members, fitted, used, view)), is_far: false })
        };
        let [first, others @ ..] = candidates else { return Vec::new() };
        let least = |entries: &[Entry]| entries.iter().map(|(_, fitted)| fitted.deviance).min_by(f64::total_cmp);
        let bar = |deviance: f64| deviance + BEHIND.max(BEHIND_SHARE * (self.ground.any - deviance));
        let mut found: Vec<Entry> = attempt(first, least(before).map(bar)).map(|tried| tried.entry).into_iter().collect();
        let bar = least(before).into_iter().chain(least(&found)).min_by(f64::total_cmp).map(bar);
        let heads: Vec<usize> = (0..others.len()).filter(|k| !others[..*k].iter().any(|c| self.are_alike(c, &others[*k]))).collect();
        let tried: Vec<Option<Tried>> = heads.par_iter().map(|k| attempt(&others[*k], bar)).collect();
        let rest: Vec<Entry> = (0..others.len())
            .into_par_iter()
            .filter(|k| !heads.contains(k))
            .filter_map(|k| {
                let head = heads.iter().position(|h| self.are_alike(&others[*h], &others[k]));
                match head.and_then(|h| tried[h].as_ref()).filter(|head| head.is_far) {
                    Some(head) => Some(self.as_far(&others[k], &head.entry)),
                    None => attempt(&others[k], bar).map(|tried| tried.entry),
                }
            })
            .collect();
        found.extend(tried.into_iter().flatten().map(|tried| tried.entry));
        found.extend(rest);
        found
    }

    /// Whether two single causes do the same to first order, each as far as it would have to.
    fn are_alike(&self, a: &Candidate, b: &Candidate) -> bool {
        let (&[i], &[j]) = (a.members.as_slice(), b.members.as_slice()) else { return false };
        let screened = self.screened;
        !screened.is_fixed(i)
            && !screened.is_fixed(j)
            && self.of(i).is_sensor() == self.of(j).is_sensor()
            && screened.product(i, j).abs() > ALIKE * (screened.square(i) * screened.square(j)).sqrt()
            && (a.gain - b.gain).abs() < (1.0 - ALIKE) * a.gain.max(b.gain)
    }

    /// The first look at a cause that is far behind, as that of another one alike.
    fn as_far(&self, other: &Candidate, (members, look): &Entry) -> Entry {
        let (h, own) = (self.of(members[0]), self.of(other.members[0]));
        // In units of its own that do the same.
        let (i, j) = (members[0], other.members[0]);
        let ratio = self.screened.product(i, j) / self.screened.square(j) * own.scale / h.scale;
        let of = |values: &[f64]| values.iter().map(|v| v * ratio).collect::<Vec<f64>>();
        let slopes = look.slopes.iter().map(|slope| slope.iter().map(|s| s / ratio).collect()).collect();
        let deviations = of(&look.deviations).iter().map(|d| d.abs()).collect();
        (other.members.clone(), Fitted { amplitudes: of(&look.amplitudes), deviations, slopes, ..look.clone() })
    }

    /// The deviance that slopes promise a fit, under the discrepancy that suits it.
    fn promise(&self, members: &[&Hypothesis], look: &Fitted, used: FitData<'_>, view: &Comparison) -> f64 {
        let (without, free) = look.without_amplitudes(members);
        let level = view.errors.learn(&without, &free, used.level, None);
        let learnt = (level != used.level).then(|| view.errors.whitener(&level, used.which));
        let whitener = learnt.as_ref().unwrap_or(used.whitener);
        let square = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let residual = whitener.apply(&without);
        let explained: f64 = free
            .iter()
            .map(|column| {
                let column = whitener.apply(column);
                square(&column, &residual).powi(2) / (1.0 + square(&column, &column))
            })
            .sum();
        square(&residual, &residual) - explained + whitener.log_determinant() - used.without + level.price()
    }

    /// A fit under the discrepancy that suits it.
    fn at_its_level(&self, members: &[&Hypothesis], fitted: Fitted, used: FitData<'_>, view: &Comparison) -> Fitted {
        let freedom = used.which.len().saturating_sub(members.len()).max(1);
        // Noise that is stated as far too large leaves a misfit far too small, and hides what is smoother than it.
        if used.level == DiscrepancySize::NONE && (LEFT..TOO_GOOD).contains(&chi_square_tail(fitted.misfit, freedom)) {
            return fitted;
        }
        // The prior of amplitudes is about nothing.
        let (without, free) = fitted.without_amplitudes(members);
        let level = view.errors.learn(&without, &free, used.level, None);
        if level == used.level {
            return fitted;
        }
        let whitener = view.errors.whitener(&level, used.which);
        let again = fit_again(self.predictor, members, &fitted, FitData { whitener: &whitener, level, ..used });
        again.ok().filter(|again| again.evidence > fitted.evidence).unwrap_or(fitted)
    }
}
