//! The search: every place and kind to the end of its fit, then sets of two and more that explain what one leaves.

use std::sync::Arc;

use rayon::prelude::*;

use super::evidence::{Explained, Freedom};
use super::profiles::{Curve, LENGTHS, Profiles};
use super::response::Answer;
use super::rows::{Errors, Looseness, Rows};
use super::settings::AmplitudeSettings;
use super::wrong::{Wrong, log_odds};

/// Iterations of a fit at most.
const MOST_ITERATIONS: usize = 12;
/// A fit stands when no amplitude moves by more than this, in units of its kind's scale.
const STANDS: f64 = 0.02;
/// Longest step of an amplitude, in units of its kind's scale: beyond it the linear model has not been.
const LONGEST_STEP: f64 = 1.5;
/// Sets that grow by a further place.
const GROWING: usize = 6;
/// Further places of each of them that are fitted to the end.
const FITTED: usize = 6;

/// A place and a kind.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// How the readings answer.
    pub answer: Answer,
    /// Whether it can be less than nothing.
    pub is_signed: bool,
    /// Least and largest amplitude, in units of its scale.
    pub range: (f64, f64),
    /// How often it is to blame, relative to others.
    pub rate: f64,
}

/// One set of places and kinds, fitted.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Candidates of the set, by their places in the list.
    pub members: Vec<usize>,
    /// How free each amplitude is.
    pub freedoms: Vec<Freedom>,
    /// Spread of the numbers and disturbance beside the set.
    pub looseness: Looseness,
    /// Amplitude of each member in every row, in units of its scale.
    pub amplitudes: Vec<Vec<f64>>,
    /// Logarithm of the evidence, prices of all choices included.
    pub log_evidence: f64,
    /// Logarithm of the prior of the set.
    pub log_prior: f64,
    /// Whether the iteration came to rest.
    pub stands: bool,
    /// Errors about the machine with the set in force, where they were found.
    pub errors: Option<Arc<Errors>>,
    /// Parts of the table that it calls grossly wrong.
    pub aside: Vec<Wrong>,
}

impl Fit {
    /// Logarithm of the evidence with the price of what is set aside.
    pub fn log_mixture(&self) -> f64 {
        self.log_evidence + log_odds(&self.aside)
    }

    /// Logarithm of the posterior, not normalised.
    pub fn log_posterior(&self) -> f64 {
        self.log_mixture() + self.log_prior
    }
}

/// Change of the readings with several causes in force at once, K, at amplitudes in units of their scales; `None` where it is the sum of the
/// changes of each.
pub type Together<'a> = &'a (dyn Fn(&[(usize, f64)]) -> Option<Vec<f64>> + Sync);
/// Change of the readings with the logarithm of each number of the machine (K) with one cause in force; `None` of what acts on readings.
pub type NumbersWith<'a> = &'a (dyn Fn(usize, f64) -> Option<Vec<Vec<f64>>> + Sync);

/// A table with its candidates and the choices that are searched.
pub struct Search<'a> {
    pub errors: &'a Errors,
    /// Readings less predictions of the machine as it is, K.
    pub residual: &'a [f64],
    pub candidates: &'a [Candidate],
    pub settings: &'a AmplitudeSettings,
    /// Change of the readings with several causes at once.
    pub together: Together<'a>,
    /// Columns of the machine's numbers beside one cause.
    pub numbers_with: NumbersWith<'a>,
    /// Functions of the rows that an amplitude may follow.
    pub profiles: Profiles,
    /// Values of each variable in the rows.
    pub variables: &'a [Vec<f64>],
    /// Blocks under each size of the disturbance.
    pub rows: Vec<(f64, Rows)>,
}

impl<'a> Search<'a> {
    /// A search; the blocks are factored once.
    pub fn new(
        errors: &'a Errors,
        residual: &'a [f64],
        candidates: &'a [Candidate],
        settings: &'a AmplitudeSettings,
        (together, numbers_with): (Together<'a>, NumbersWith<'a>),
        variables: &'a [Vec<f64>],
    ) -> Self {
        let of = |size: &f64| Some((*size, Rows::new(errors, *size)?));
        let rows: Vec<(f64, Rows)> = settings.disturbances.par_iter().filter_map(of).collect();
        let profiles = Profiles::constant(rows.first().map_or(0, |(_, rows)| rows.ranges.len()));
        Self { errors, residual, candidates, settings, together, numbers_with, profiles, variables, rows }
    }

    /// This search with the errors of a fit.
    pub fn beside<'b>(&'b self, fit: &'b Fit) -> Search<'b> {
        let errors = fit.errors.as_deref().unwrap_or(self.errors);
        let changes = (self.together, self.numbers_with);
        Search::new(errors, self.residual, self.candidates, self.settings, changes, self.variables)
    }

    /// This search with the errors of a fit, in which amplitudes may follow curves.
    pub fn with_errors_of<'b>(&'b self, fit: &'b Fit) -> Search<'b> {
        Search { profiles: Profiles::smooth(self.row_count(), self.variables), ..self.beside(fit) }
    }

    /// A fit about the machine with its set in force: with a heat that the model lacks, one per cent of a conductance is more kelvin than
    /// without. To first order each number's column grows in every row with the amplitude there.
    pub fn refined(&self, fit: Fit) -> Fit {
        let mut errors = self.errors.clone();
        if let Some(own) = &fit.errors {
            // What it calls wrong stays so.
            (errors.noise, errors.aside) = (own.noise.clone(), own.aside.clone());
        }
        for (m, own) in fit.members.iter().zip(&fit.amplitudes) {
            let mean = own.iter().sum::<f64>() / own.len().max(1) as f64;
            let size = (own.iter().map(|a| a * a).sum::<f64>() / own.len().max(1) as f64).sqrt().copysign(mean);
            if size.abs() < STANDS {
                continue;
            }
            let Some(columns) = (self.numbers_with)(*m, size) else { continue };
            for ((column, with), before) in errors.numbers.iter_mut().zip(&columns).zip(&self.errors.numbers) {
                for (i, entry) in column.iter_mut().enumerate() {
                    *entry += own[self.errors.row_of[i]] / size * (with[i] - before[i]);
                }
            }
        }
        let before = fit.clone();
        let begun = Fit { errors: Some(Arc::new(errors)), ..fit };
        let found = self.with_errors_of(&begun).fit(begun.clone());
        if found.log_evidence.is_finite() { found } else { before }
    }

    fn row_count(&self) -> usize {
        self.rows.first().map_or(0, |(_, rows)| rows.ranges.len())
    }

    fn rows_at(&self, disturbance: f64) -> &Rows {
        let found = self.rows.iter().find(|(size, _)| *size == disturbance);
        &found.unwrap_or(&self.rows[0]).1
    }

    /// Logarithm of the prior of a set of so many places: a Poisson count, shared among the sets of as many by how often each is to blame.
    fn log_prior(&self, members: &[usize]) -> f64 {
        let all: f64 = self.candidates.iter().map(|c| c.rate).sum();
        let expected = self.settings.expected_causes;
        // Poisson's k! cancels against the k! orders of the members.
        members.iter().map(|m| (expected * self.candidates[*m].rate / all).ln()).sum::<f64>() - expected
    }

    fn price(&self, freedoms: &[Freedom], looseness: Looseness) -> f64 {
        let s = self.settings;
        let chosen = |is: bool| s.choice_price * f64::from(u8::from(is));
        // A curve pays for the choice of its variable and its length too.
        let all = self.variables.len().max(1) * LENGTHS.len();
        let curve = |f: &Freedom| f.curve.map_or(0.0, |_| s.choice_price + (all as f64).ln());
        freedoms.iter().map(|f| chosen(f.freedom > 0.0) + chosen(f.size > s.sizes[0]) + curve(f)).sum::<f64>()
            + s.spread_price * looseness.spread
            + s.disturbance_price * looseness.disturbance
    }

    /// The machine as it is.
    pub fn nothing(&self) -> Fit {
        let (looseness, log_evidence) = self.loosest(&self.linear(&[], &[], None), &[], None);
        Fit {
            members: Vec::new(),
            freedoms: Vec::new(),
            looseness,
            amplitudes: Vec::new(),
            log_evidence,
            log_prior: self.log_prior(&[]),
            stands: true,
            errors: None,
            aside: Vec::new(),
        }
    }

    /// The linear model about amplitudes: the residual without the members (K), and one column for each, K per scale.
    fn linear(&self, members: &[usize], amplitudes: &[Vec<f64>], excess: Option<&[f64]>) -> Linear {
        let mut residual = self.residual.to_vec();
        if let Some(excess) = excess {
            residual.iter_mut().zip(excess).for_each(|(r, e)| *r -= e);
        }
        let mut columns = Vec::with_capacity(members.len());
        for (m, own) in members.iter().zip(amplitudes) {
            let (change, slope) = self.candidates[*m].answer.at(own, &self.errors.row_of);
            for (i, r) in residual.iter_mut().enumerate() {
                *r += slope[i] * own[self.errors.row_of[i]] - change[i];
            }
            columns.push(slope);
        }
        self.errors.aside.iter().for_each(|i| residual[*i] = 0.0);
        Linear { residual, columns }
    }

    /// The looseness of the model with the largest evidence under given freedoms, near one where there is one.
    fn loosest(&self, linear: &Linear, freedoms: &[Freedom], near: Option<Looseness>) -> (Looseness, f64) {
        let near_by = |all: &[f64], value: f64| -> Vec<f64> {
            let at = all.iter().position(|v| *v == value).unwrap_or(0);
            all[at.saturating_sub(1)..(at + 2).min(all.len())].to_vec()
        };
        let (disturbances, spreads) = match near {
            Some(near) => (near_by(&self.settings.disturbances, near.disturbance), near_by(&self.settings.spreads, near.spread)),
            None => (self.settings.disturbances.clone(), self.settings.spreads.clone()),
        };
        let mut best = (Looseness { spread: 0.0, disturbance: 0.0 }, f64::NEG_INFINITY);
        for (size, rows) in self.rows.iter().filter(|(size, _)| disturbances.contains(size)) {
            let explained = Explained::new(rows, &self.profiles, &linear.residual, &linear.columns, &self.followed(freedoms));
            for spread in &spreads {
                let looseness = Looseness { spread: *spread, disturbance: *size };
                let Some(log) = explained.log_evidence(freedoms, *spread) else { continue };
                let log = log - self.price(freedoms, looseness);
                if log > best.1 {
                    best = (looseness, log);
                }
            }
        }
        best
    }

    /// Functions of the rows that each amplitude follows.
    pub fn followed(&self, freedoms: &[Freedom]) -> Vec<Vec<usize>> {
        freedoms.iter().map(|f| self.profiles.with(f.curve.map(|(curve, _)| curve))).collect()
    }

    /// Ways in which an amplitude may run over the rows, from one of them: another size or freedom, or another curve.
    fn ways(&self, from: Freedom, with_curves: bool) -> [Vec<Freedom>; 2] {
        let s = self.settings;
        let of = |size: &f64| s.freedoms.iter().map(|freedom| Freedom { size: *size, freedom: *freedom, ..from }).collect::<Vec<_>>();
        let sizes = s.sizes.iter().flat_map(of).collect();
        let mut curves = Vec::new();
        if with_curves {
            let free = s.freedoms.iter().copied().filter(|f| *f > 0.0);
            let of = |curve: Curve| {
                free.clone().flat_map(move |size| {
                    // A curve takes the place of the freedom, or leaves some of it.
                    [from.freedom, 0.0].map(|freedom| Freedom { freedom, curve: Some((curve, size)), ..from })
                })
            };
            curves.extend(self.profiles.curves().into_iter().flat_map(of));
            curves.push(Freedom { curve: None, ..from });
        }
        [sizes, curves]
    }

    /// The freedoms with the largest evidence at a looseness; those of all members but `of` stay as they are.
    fn freest(
        &self,
        linear: &Linear,
        freedoms: &[Freedom],
        (of, with_curves): (&[usize], bool),
        looseness: Looseness,
    ) -> (Vec<Freedom>, f64) {
        let mut followed = self.followed(freedoms);
        if with_curves {
            of.iter().for_each(|m| followed[*m] = self.profiles.all());
        }
        let rows = self.rows_at(looseness.disturbance);
        let explained = Explained::new(rows, &self.profiles, &linear.residual, &linear.columns, &followed);
        let mut best = (freedoms.to_vec(), f64::NEG_INFINITY);
        for m in of {
            for kind in 0..2 {
                let ways = &self.ways(best.0[*m], with_curves)[kind];
                for tried in ways {
                    let mut freedoms = best.0.clone();
                    freedoms[*m] = *tried;
                    let Some(log) = explained.log_evidence(&freedoms, looseness.spread) else { continue };
                    let log = log - self.price(&freedoms, looseness);
                    if log > best.1 {
                        best = (freedoms, log);
                    }
                }
            }
        }
        best
    }

    /// The linear model about a fit, with the rows that it is whitened by.
    pub fn about(&self, fit: &Fit) -> (&Rows, Linear) {
        let excess = if fit.members.len() > 1 { self.excess(fit) } else { None };
        (self.rows_at(fit.looseness.disturbance), self.linear(&fit.members, &fit.amplitudes, excess.as_deref()))
    }

    /// Fits a set from where it begins.
    pub fn fit(&self, begun: Fit) -> Fit {
        let mut fit = begun;
        let bent = fit.members.iter().filter(|m| matches!(self.candidates[**m].answer, Answer::Bent(_))).count();
        let mut is_settled = false;
        for iteration in 0..MOST_ITERATIONS {
            let excess = if bent > 1 { self.excess(&fit) } else { None };
            let linear = self.linear(&fit.members, &fit.amplitudes, excess.as_deref());
            let before = (fit.freedoms.clone(), fit.looseness);
            if !is_settled {
                let all: Vec<usize> = (0..fit.members.len()).collect();
                fit.freedoms = self.freest(&linear, &fit.freedoms, (&all, true), fit.looseness).0;
            }
            let near = (iteration > 0).then_some(fit.looseness);
            (fit.looseness, fit.log_evidence) = self.loosest(&linear, &fit.freedoms, near);
            // Choices that stood once stand to the end: the amplitudes come to rest beneath them.
            is_settled |= iteration > 0 && before == (fit.freedoms.clone(), fit.looseness);
            let (rows, followed) = (self.rows_at(fit.looseness.disturbance), self.followed(&fit.freedoms));
            let explained = Explained::new(rows, &self.profiles, &linear.residual, &linear.columns, &followed);
            let Some(posterior) = explained.posterior(&fit.freedoms, fit.looseness.spread) else { break };
            let mut most = 0.0f64;
            for ((m, own), found) in fit.members.iter().zip(&mut fit.amplitudes).zip(posterior.amplitudes()) {
                let candidate = &self.candidates[*m];
                let is_straight = matches!(candidate.answer, Answer::Straight(_));
                let is_negative = found.iter().sum::<f64>() < 0.0;
                for (a, to) in own.iter_mut().zip(found) {
                    let to = to.clamp(candidate.range.0, candidate.range.1);
                    let step = if is_straight { to - *a } else { (to - *a).clamp(-LONGEST_STEP, LONGEST_STEP) };
                    *a += step;
                    if !is_straight {
                        most = most.max(step.abs());
                    }
                }
                // What cannot be less than nothing and wants to be explains nothing.
                if !candidate.is_signed && is_negative && own.iter().all(|a| *a <= STANDS) {
                    return Fit { log_evidence: f64::NEG_INFINITY, ..fit };
                }
            }
            fit.stands = most < STANDS;
            if fit.stands {
                break;
            }
        }
        if !fit.stands {
            // Evidence counts where the iteration stands.
            fit.log_evidence = f64::NEG_INFINITY;
        }
        fit
    }

    /// What several causes change together beyond the sum of their own changes, K, at their mean amplitudes.
    fn excess(&self, fit: &Fit) -> Option<Vec<f64>> {
        let mean = |own: &Vec<f64>| own.iter().sum::<f64>() / own.len().max(1) as f64;
        let at: Vec<(usize, f64)> = fit.members.iter().zip(&fit.amplitudes).map(|(m, own)| (*m, mean(own))).collect();
        let mut excess = (self.together)(&at)?;
        for (m, amplitude) in at {
            let (change, _) = self.candidates[m].answer.at(&vec![amplitude; self.row_count()], &self.errors.row_of);
            excess.iter_mut().zip(change).for_each(|(e, c)| *e -= c);
        }
        Some(excess)
    }

    /// A set with one further place, where its linear model has the largest evidence.
    fn begun(&self, fit: &Fit, further: usize, excess: Option<&[f64]>) -> Option<Fit> {
        let candidate = &self.candidates[further];
        let mut members = fit.members.clone();
        members.push(further);
        let own = members.len() - 1;
        let mut freedoms = fit.freedoms.clone();
        freedoms.push(Freedom::constant(self.settings.sizes[0]));
        let mut best: Option<Fit> = None;
        // A disturbance that took the place of a cause goes only as the cause comes: with one alone neither is better.
        let still = Looseness { disturbance: self.settings.disturbances[0], ..fit.looseness };
        let mut begins: Vec<(f64, Looseness)> = candidate.answer.knots().iter().map(|knot| (*knot, fit.looseness)).collect();
        if still != fit.looseness {
            begins.extend(candidate.answer.knots().iter().map(|knot| (*knot, still)));
        }
        for (knot, looseness) in begins {
            let mut amplitudes = fit.amplitudes.clone();
            amplitudes.push(vec![knot; self.row_count()]);
            let linear = self.linear(&members, &amplitudes, excess);
            let (found, log_evidence) = self.freest(&linear, &freedoms, (&[own], false), looseness);
            if best.as_ref().is_none_or(|best| log_evidence > best.log_evidence) {
                let log_prior = self.log_prior(&members);
                let members = members.clone();
                let (errors, aside) = (fit.errors.clone(), fit.aside.clone());
                best = Some(Fit { members, freedoms: found, looseness, amplitudes, log_evidence, log_prior, stands: false, errors, aside });
            }
        }
        best
    }

    /// Every place and kind alone, fitted, most probable first.
    pub fn singles(&self, nothing: &Fit) -> Vec<Fit> {
        let one = |c: usize| Some(self.fit(self.begun(nothing, c, None)?));
        sorted((0..self.candidates.len()).into_par_iter().filter_map(one).collect())
    }

    /// Sets with one place more than given ones, most probable first.
    pub fn grown(&self, from: &[Fit]) -> Vec<Fit> {
        let mut found: Vec<Fit> = Vec::new();
        for fit in from.iter().take(GROWING) {
            let about = self.with_errors_of(fit);
            let excess = if fit.members.len() > 1 { self.excess(fit) } else { None };
            let excess = excess.as_deref();
            let further: Vec<usize> = (0..self.candidates.len()).filter(|c| !fit.members.contains(c)).collect();
            let mut begun = sorted(further.par_iter().filter_map(|c| about.begun(fit, *c, excess)).collect());
            begun.truncate(FITTED);
            let is_new = |one: &Fit, found: &[Fit]| {
                let own = ordered(&one.members);
                found.iter().all(|other| ordered(&other.members) != own)
            };
            begun.retain(|one| is_new(one, &found));
            found.extend(begun.into_par_iter().map(|one| about.fit(one)).collect::<Vec<_>>());
        }
        sorted(found)
    }
}

/// A residual without members, and their columns.
pub struct Linear {
    /// K
    pub residual: Vec<f64>,
    /// K per scale.
    pub columns: Vec<Vec<f64>>,
}

fn ordered(members: &[usize]) -> Vec<usize> {
    let mut all = members.to_vec();
    all.sort_unstable();
    all
}

/// Fits with evidence, most probable first.
fn sorted(mut fits: Vec<Fit>) -> Vec<Fit> {
    fits.retain(|fit| fit.log_evidence.is_finite());
    fits.sort_by(|a, b| b.log_posterior().total_cmp(&a.log_posterior()));
    fits
}
