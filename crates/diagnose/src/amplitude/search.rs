//! The search: every place and kind to the end of its fit, then sets of two and more that explain what one leaves.

use std::sync::{Arc, Mutex};

use rayon::prelude::*;

use super::evidence::{Explained, Freedom};
use super::profiles::Profiles;
use super::relaxation::Relaxation;
use super::response::{Answer, Slope};
use super::rows::{Errors, Looseness, Recent, Rows};
use super::settings::AmplitudeSettings;
use super::wrong::{Wrong, log_odds};

/// Iterations of a fit at most.
const MOST_ITERATIONS: usize = 12;
/// A fit stands when no amplitude moves by more than this, in units of its kind's scale.
const STANDS: f64 = 0.02;
/// Errors about a machine serve beside amplitudes that are as near, in units of their kind's scale. Chosen: they change by as much themselves.
const NEAR: f64 = 0.2;
/// Longest step of an amplitude, in units of its kind's scale: beyond it the linear model has not been.
const LONGEST_STEP: f64 = 1.5;
/// Sets that grow by a further place. Chosen: with six the best sets of a real test box lack the capacity that was taken from its machine, with
/// ten and with thirty all of them have it.
pub(super) const GROWING: usize = 10;
/// Further places of each of them that are fitted to the end.
pub(super) const FITTED: usize = 6;
/// Loosenesses under which a set is kept whitened: those next to one of them.
const KEPT: usize = 6;
/// Machines with a set in force that are made linear at most.
const MOST_REFERENCES: usize = 10;
/// The first of them about which choices are made anew: beside a cause that bends two of them may change places for ever.
const CHOOSING_REFERENCES: usize = 3;
/// Iterations of a fit in which choices are made; in the rest of them the amplitudes come to rest. Chosen: half of all.
const CHOOSING_ITERATIONS: usize = 6;

/// A place and a kind.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// How the readings answer.
    pub answer: Answer,
    /// Whether it can be less than nothing.
    pub is_signed: bool,
    /// Whether it is or is not, as an exchange of sensors: an amplitude beyond one says only that something else is missing.
    pub is_fixed: bool,
    /// Least and largest amplitude, in units of its scale.
    pub range: (f64, f64),
    /// Whether it may be many times what is usual.
    pub has_tails: bool,
    /// How often it is to blame, relative to others.
    pub rate: f64,
    /// Whether its amplitude may wander with the time of a log. A heat that does is the disturbance.
    pub may_wander: bool,
    /// Whether its amplitude may follow the variables of a log.
    pub may_follow: bool,
    /// Whether its amplitude may run over the rows at all.
    pub may_run: bool,
    /// Whether its amplitude may follow a curve over the rows of a table; always in logs, where curves have rules of their own.
    pub may_vary: bool,
    /// Whether its amplitude may be another in every row of a table.
    pub may_scatter: bool,
}

impl Candidate {
    /// Whether its amplitude is a number of its own unit that may have any size: a path that the model lacks, and no factor.
    fn is_scale_free(&self) -> bool {
        self.has_tails && !self.is_signed
    }

    /// Unit in which an amplitude that is as large moves and stands, in its scale: its own size where it may have any.
    fn unit(&self, amplitude: f64) -> f64 {
        if self.is_scale_free() { amplitude.abs().max(1.0) } else { 1.0 }
    }

    /// The same in a log, with its slopes by functions of the rows, and whether its amplitude may run over these.
    pub fn in_time(self, along: Vec<Vec<f64>>, may_run: bool) -> Self {
        Self { answer: Answer::InTime(Box::new(self.answer), along), may_run, may_vary: true, ..self }
    }
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
    /// Amplitude of each member in every row, in units of its scale; in logs its coefficients, for the functions of the rows.
    pub amplitudes: Vec<Vec<f64>>,
    /// Logarithm of the evidence, prices of all choices included.
    pub log_evidence: f64,
    /// Logarithm of the prior of the set.
    pub log_prior: f64,
    /// Whether the iteration came to rest.
    pub stands: bool,
    /// Errors about the machine with the set in force, where they were found.
    pub errors: Option<Arc<Errors>>,
    /// The machine with the set in force that it is linear about.
    pub reference: Option<Arc<Reference>>,
    /// Parts of the data that it calls grossly wrong.
    pub aside: Vec<Wrong>,
}

/// The machine with causes in force, made linear.
#[derive(Debug)]
pub struct Reference {
    /// Amplitudes of each member in force, as in [`Fit::amplitudes`]: those that were asked for, within their range.
    pub amplitudes: Vec<Vec<f64>>,
    /// Change of the readings with all of them in force, K.
    pub change: Vec<f64>,
    /// Slopes of the readings in each member.
    pub slopes: Vec<Slope>,
    /// The same in every candidate, where they were asked for.
    pub others: Vec<Slope>,
    /// Exchanges among the members, of a table.
    pub exchanges: Vec<Exchange>,
}

/// Readings that show what belongs to another one, of a table.
#[derive(Debug, Clone)]
pub struct Exchange {
    /// At each reading, the one that belongs there.
    pub from: Vec<usize>,
    /// By how much each is exchanged: nothing or one.
    pub shares: Vec<f64>,
}

impl Exchange {
    /// Values of all readings as they are shown.
    pub fn shown(&self, values: &[f64]) -> Vec<f64> {
        self.from.iter().zip(&self.shares).zip(values).map(|((from, share), own)| own + share * (values[*from] - own)).collect()
    }
}

impl Fit {
    /// Logarithm of the evidence with the price of what is set aside.
    pub fn log_mixture(&self) -> f64 {
        self.log_evidence + log_odds(&self.aside)
    }

    /// Errors about the machine with the set in force, in which stays wrong what the fit calls so.
    fn without_aside(&self, mut errors: Errors) -> Errors {
        if let Some(own) = self.errors.as_ref().filter(|_| !self.aside.is_empty()) {
            (errors.aside, errors.wide) = (own.aside.clone(), own.wide);
            errors.wrong_conditions.clone_from(&own.wrong_conditions);
        }
        errors
    }

    /// Logarithm of the posterior, not normalised.
    pub fn log_posterior(&self) -> f64 {
        self.log_mixture() + self.log_prior
    }
}

/// The machine with members in force, and its errors; with the slopes in every candidate of a log if asked for.
/// `Errors` that are near enough, found where the set was in force before, serve again.
pub type About<'a> = &'a (dyn Fn(&[usize], &[Vec<f64>], bool, Option<&Errors>) -> Option<(Reference, Errors)> + Sync);

/// A table with its candidates and the choices that are searched.
pub struct Search<'a> {
    pub errors: &'a Errors,
    /// Readings less predictions of the machine as it is, K.
    pub residual: &'a [f64],
    pub candidates: &'a [Candidate],
    pub settings: &'a AmplitudeSettings,
    /// The machine with a set in force, where it can be had.
    pub about: Option<About<'a>>,
    /// Functions of the rows that an amplitude may follow.
    pub profiles: &'a Profiles,
    /// The same of fits about the machine with the set in force.
    pub all_profiles: &'a Profiles,
    /// Rows of a table under each looseness that was asked for.
    pub rows: Mutex<Vec<Arc<Rows>>>,
}

impl<'a> Search<'a> {
    /// A search.
    pub fn new(
        errors: &'a Errors,
        residual: &'a [f64],
        candidates: &'a [Candidate],
        settings: &'a AmplitudeSettings,
        about: Option<About<'a>>,
        (profiles, all_profiles): (&'a Profiles, &'a Profiles),
    ) -> Self {
        Self { errors, residual, candidates, settings, about, profiles, all_profiles, rows: Mutex::default() }
    }

    /// This search with the errors of a fit.
    pub fn beside<'b>(&'b self, fit: &'b Fit) -> Search<'b> {
        let errors = fit.errors.as_deref().unwrap_or(self.errors);
        let profiles = (self.profiles, self.all_profiles);
        Search::new(errors, self.residual, self.candidates, self.settings, self.about, profiles)
    }

    /// This search with the errors of a fit, in which amplitudes may follow curves.
    pub fn with_errors_of<'b>(&'b self, fit: &'b Fit) -> Search<'b> {
        let errors = fit.errors.as_deref().unwrap_or(self.errors);
        let profiles = (self.all_profiles, self.all_profiles);
        Search::new(errors, self.residual, self.candidates, self.settings, self.about, profiles)
    }

    /// Whether amplitudes are given by coefficients: in logs.
    pub(super) fn is_log(&self) -> bool {
        self.errors.log.is_some()
    }

    /// An amplitude that is alike in all rows.
    fn alike(&self, amplitude: f64) -> Vec<f64> {
        if !self.is_log() {
            return vec![amplitude; self.profiles.functions.nrows()];
        }
        let mut coefficients = vec![0.0; self.all_profiles.of.len()];
        coefficients[0] = amplitude;
        coefficients
    }

    /// Mean of an amplitude.
    fn mean(&self, own: &[f64]) -> f64 {
        if self.is_log() {
            own.iter().zip(self.all_profiles.functions.column_iter()).filter(|(a, _)| **a != 0.0).map(|(a, f)| a * f.mean()).sum()
        } else {
            own.iter().sum::<f64>() / own.len().max(1) as f64
        }
    }

    /// How large an amplitude is: in logs the part of it that is alike in all rows, in tables that in the row that has most.
    fn size_of(&self, own: &[f64]) -> f64 {
        if self.is_log() { own.first().map_or(0.0, |a| a.abs()) } else { own.iter().fold(0.0, |most: f64, a| most.max(a.abs())) }
    }

    /// Largest size of an amplitude without tails.
    fn largest_size(&self) -> f64 {
        self.settings.sizes.iter().copied().fold(0.0, f64::max)
    }

    /// Sizes that are tried of an amplitude, the present one among them. What may be many times the usual has a prior with tails like 1/a²:
    /// beyond the sizes that all have it has those next to the amplitude on both sides, each three times the one before.
    pub(super) fn sizes(&self, candidate: &Candidate, own: &[f64], present: f64) -> Vec<f64> {
        let mut sizes = self.settings.sizes.clone();
        let (least, most, amplitude) = (sizes[0], self.largest_size(), self.size_of(own));
        if candidate.has_tails && amplitude > most && most > least {
            let (ratio, steps) = (most / least, (amplitude / least).log(most / least));
            sizes.extend([steps.floor(), steps.ceil()].map(|step| least * ratio.powf(step)));
        }
        sizes.push(present);
        sizes.retain(|size| *size > 0.0);
        sizes.sort_by(f64::total_cmp);
        sizes.dedup_by(|next, last| *next <= *last * (1.0 + 1e-9));
        sizes
    }

    /// Price of a size in log evidence.
    pub(super) fn price_of_size(&self, size: f64) -> f64 {
        let (least, most) = (self.settings.sizes[0], self.largest_size());
        if size <= least { 0.0 } else { self.settings.choice_price * (size / least).ln() / (most / least).ln() }
    }

    /// A fit about the machine with its set in force, again and again until the set stands where it is in force; it has no evidence where it
    /// does not come to rest. There causes act together, and with a heat that the model lacks one per cent of a conductance is more kelvin than
    /// without. What cannot be solved so keeps the fit.
    pub fn refined(&self, fit: Fit) -> Fit {
        let Some(about) = self.about else { return fit };
        let fit = self.refined_by(about, fit);
        forget_rows(&fit);
        fit
    }

    fn refined_by(&self, about: About<'_>, mut fit: Fit) -> Fit {
        // Errors about the machine as it is serve beside small amplitudes.
        let from_nothing = || fit.amplitudes.iter().flat_map(|own| self.course(own)).fold(0.0, |most: f64, a| most.max(a.abs()));
        let (mut moved, mut relaxation) = (if fit.reference.is_none() { from_nothing() } else { f64::INFINITY }, Relaxation::default());
        for place in 0..MOST_REFERENCES {
            let known = Some(fit.errors.as_deref().unwrap_or(self.errors)).filter(|_| moved < NEAR);
            let Some((reference, errors)) = about(&fit.members, &fit.amplitudes, false, known) else {
                // Between a few amplitudes it is known all the same.
                return if place == 0 { fit } else { Fit { stands: false, log_evidence: f64::NEG_INFINITY, ..fit } };
            };
            let errors = fit.without_aside(errors);
            let begun = Fit { errors: Some(Arc::new(errors)), reference: Some(Arc::new(reference)), stands: false, ..fit };
            let sought = if place == 0 { Sought::All } else { Sought::Near };
            fit = self.with_errors_of(&begun).fit_from(begun.clone(), sought, place >= CHOOSING_REFERENCES);
            let steps = self.steps(&begun, &fit);
            moved = steps.iter().fold(0.0, |most: f64, step| most.max(step.abs()));
            if !fit.log_evidence.is_finite() || moved < STANDS {
                return fit;
            }
            if place >= CHOOSING_REFERENCES {
                let share = relaxation.share(steps);
                let both = fit.amplitudes.iter_mut().zip(&begun.amplitudes).flat_map(|(a, b)| a.iter_mut().zip(b));
                both.for_each(|(a, b)| *a = b + share * (*a - b));
            }
        }
        Fit { stands: false, log_evidence: f64::NEG_INFINITY, ..fit }
    }

    /// Steps of all amplitudes from one fit of a set to another: in units of their scale, and of the amplitude where it is larger.
    fn steps(&self, from: &Fit, to: &Fit) -> Vec<f64> {
        let steps = from.amplitudes.iter().zip(&to.amplitudes).flat_map(|(a, b)| {
            let of_coefficients = self.is_log().then(|| self.size_of(a));
            a.iter().zip(b).map(move |(a, b)| (b - a) / of_coefficients.unwrap_or(a.abs()).max(1.0))
        });
        steps.collect()
    }

    /// The machine as it is.
    pub fn nothing(&self) -> Fit {
        let (looseness, log_evidence) = self.loosest(&self.linear(&[], &[], None), &[], Looseness::default(), Sought::All);
        Fit {
            members: Vec::new(),
            freedoms: Vec::new(),
            looseness,
            amplitudes: Vec::new(),
            log_evidence,
            log_prior: self.log_prior(&[]),
            stands: true,
            errors: None,
            reference: None,
            aside: Vec::new(),
        }
    }

    /// The linear model about amplitudes: the residual without the members (K), and the slopes in each. Members that are in force in a
    /// reference have theirs about it.
    pub fn linear(&self, members: &[usize], amplitudes: &[Vec<f64>], reference: Option<&Reference>) -> Linear<'a> {
        let mut residual = self.residual.to_vec();
        if let Some(own) = reference {
            residual.iter_mut().zip(&own.change).for_each(|(r, c)| *r -= c);
        }
        let mut slopes = Vec::with_capacity(members.len());
        for (k, (m, own)) in members.iter().zip(amplitudes).enumerate() {
            let in_force = reference.and_then(|all| Some((all.slopes.get(k)?, all.amplitudes.get(k)?)));
            let other = reference.and_then(|all| all.others.get(*m));
            let slope = match (in_force, other) {
                (Some((slope, at)), _) => {
                    slope.add_to(&mut residual, at, &self.errors.row_of);
                    slope.clone()
                }
                (None, Some(slope)) => slope.clone(),
                (None, None) => {
                    let (mut change, mut slope) = self.candidates[*m].answer.at(own, &self.errors.row_of);
                    for exchange in reference.iter().flat_map(|all| &all.exchanges) {
                        change = exchange.shown(&change);
                        slope = slope.map(|column| exchange.shown(column));
                    }
                    slope.add_to(&mut residual, own, &self.errors.row_of);
                    residual.iter_mut().zip(change).for_each(|(r, c)| *r -= c);
                    slope
                }
            };
            slopes.push(slope);
        }
        self.errors.aside.iter().for_each(|i| residual[*i] = 0.0);
        Linear { residual, slopes, profiles: self.profiles, known: Recent::of(KEPT) }
    }

    /// The linear model about a fit.
    pub fn linear_about(&self, fit: &Fit) -> Linear<'a> {
        self.linear(&fit.members, &fit.amplitudes, fit.reference.as_deref())
    }

    /// Whether the linear model about a fit is one wherever its amplitudes are: each is straight, or known about a machine alone.
    fn is_straight(&self, fit: &Fit) -> bool {
        let in_force = |k: usize| fit.reference.as_ref().is_some_and(|all| k < all.slopes.len() || !all.others.is_empty());
        fit.members.iter().enumerate().all(|(k, m)| in_force(k) || self.candidates[*m].answer.is_straight())
    }

    /// Fits a set from where it begins.
    pub fn fit(&self, begun: Fit) -> Fit {
        self.fit_from(begun, Sought::All, false)
    }

    /// The same, with the looseness sought at first as is said; choices that are settled stay.
    pub fn fit_from(&self, begun: Fit, sought: Sought, mut is_settled: bool) -> Fit {
        let mut fit = begun;
        let (mut linear, is_straight) = (self.linear_about(&fit), self.is_straight(&fit));
        for iteration in 0..MOST_ITERATIONS {
            if iteration > 0 && !is_straight {
                linear = self.linear_about(&fit);
            }
            let before = (fit.freedoms.clone(), fit.looseness);
            if !is_settled {
                let all: Vec<(usize, usize)> = fit.members.iter().copied().enumerate().collect();
                let by = Open { members: &all, with_curves: true, are_bounded: true };
                fit.freedoms = self.freest(&linear, &fit.freedoms, &fit.amplitudes, by, fit.looseness).0;
            }
            let by = match iteration {
                0 => sought,
                _ if is_settled => Sought::AsItIs,
                _ => Sought::Near,
            };
            (fit.looseness, fit.log_evidence) = self.loosest(&linear, &fit.freedoms, fit.looseness, by);
            // Choices that stood once stand to the end: the amplitudes come to rest beneath them.
            is_settled |= iteration + 1 == CHOOSING_ITERATIONS || iteration > 0 && before == (fit.freedoms.clone(), fit.looseness);
            let Some(explained) = self.explained(&linear, fit.looseness, &self.followed(&fit.freedoms)) else { break };
            let Some(found) = explained.most_probable(&fit.freedoms, fit.looseness) else { break };
            let variances = |k: usize| explained.variances(&fit.freedoms, fit.looseness, k);
            let beyond: f64 = (0..found.len()).map(|k| self.beyond(fit.members[k], fit.freedoms[k], &found[k], || variances(k))).sum();
            let Some(most) = self.step(&mut fit, found) else { return Fit { log_evidence: f64::NEG_INFINITY, ..fit } };
            fit.log_evidence -= beyond;
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

    /// Evidence that a fit loses where an amplitude wants to be beyond its range: half the square of how far, in standard deviations. One that
    /// is alike in all rows counts once, one that is new in every row in each, and of a curve the row that is furthest. An exchange that differs
    /// from row to row is in each row there or not; one that is alike may be off from one, for something else may be missing, and is none where
    /// it is nearer to nothing.
    pub(super) fn beyond(&self, member: usize, freedom: Freedom, found: &[f64], variances: impl FnOnce() -> Option<Vec<f64>>) -> f64 {
        let candidate = &self.candidates[member];
        let (low, high) = candidate.range;
        let low = if candidate.is_signed { low } else { low.max(0.0) };
        let course = self.course(found);
        let is_alike = freedom.freedom == 0.0 && freedom.curve.is_none();
        let beyond = |a: &f64| if candidate.is_fixed { a.abs().min((a - 1.0).abs()) } else { (low - a).max(a - high).max(0.0) };
        let excess: Vec<f64> = course.iter().map(beyond).collect();
        if candidate.is_fixed && is_alike {
            return if course.iter().all(|a| *a < 0.5) { f64::INFINITY } else { 0.0 };
        }
        if excess.iter().all(|e| *e < STANDS) {
            return 0.0;
        }
        let Some(variances) = variances() else { return f64::INFINITY };
        let squares = excess.iter().zip(variances).map(|(e, variance)| e * e / variance.max(f64::MIN_POSITIVE));
        0.5 * if freedom.freedom > 0.0 { squares.sum::<f64>() } else { squares.fold(0.0, f64::max) }
    }

    /// An amplitude in every row.
    pub(super) fn course(&self, own: &[f64]) -> Vec<f64> {
        if self.is_log() { self.all_profiles.course(own) } else { own.to_vec() }
    }

    /// Moves the amplitudes of a fit towards those found; returns the longest step of one that bends, in units of its scale. `None` where a
    /// cause cannot be less than nothing and wants to be: it explains nothing.
    fn step(&self, fit: &mut Fit, found: Vec<Vec<f64>>) -> Option<f64> {
        let mut most = 0.0f64;
        for (k, ((m, own), mut found)) in fit.members.iter().zip(&mut fit.amplitudes).zip(found).enumerate() {
            let candidate = &self.candidates[*m];
            let is_straight = candidate.answer.is_straight();
            let is_negative = self.mean(&found) < 0.0;
            found.resize(own.len(), 0.0);
            // What is in force is linear about the machine that has it, however the choices beside it change.
            let in_force = fit.reference.as_deref().and_then(|all| all.amplitudes.get(k).cloned());
            let is_followed = fit.reference.as_deref().is_some_and(|all| !all.others.is_empty());
            let from = in_force.or_else(|| is_followed.then(|| vec![0.0; own.len()])).unwrap_or_else(|| own.clone());
            let of_coefficients = self.is_log().then(|| candidate.unit(self.size_of(&from)));
            for (i, ((a, to), from)) in own.iter_mut().zip(found).zip(from).enumerate() {
                let is_law = self.is_log() && i > 0;
                let to = if is_law { to } else { to.clamp(candidate.range.0, candidate.range.1) };
                let unit = of_coefficients.unwrap_or_else(|| candidate.unit(from));
                let up = LONGEST_STEP * unit;
                // An amplitude of any size moves by a factor, the same up and down.
                let down = if is_law || unit <= 1.0 { up } else { up / (1.0 + LONGEST_STEP) };
                let to = if is_straight { to } else { from + (to - from).clamp(-down, up) };
                let step = (to - *a) / unit;
                *a = to;
                if !is_straight {
                    most = most.max(step.abs());
                }
            }
            let is_nothing = if self.is_log() { self.mean(own) <= STANDS } else { own.iter().all(|a| *a <= STANDS) };
            if !candidate.is_signed && is_negative && is_nothing {
                return None;
            }
        }
        Some(most)
    }

    /// Readings of a table that a cause acts on, rising.
    pub(super) fn acting(&self, cause: usize) -> Vec<usize> {
        match self.candidates[cause].answer.at(&self.alike(0.0), &self.errors.row_of).1 {
            Slope::OfRow(column) => column.iter().enumerate().filter(|(_, slope)| **slope != 0.0).map(|(i, _)| i).collect(),
            Slope::OfFunctions(_) => Vec::new(),
        }
    }

    /// A looseness without what may take the place of a cause: disturbance, errors of conditions, and more noise than is stated.
    pub(super) fn still(&self, looseness: Looseness) -> Looseness {
        Looseness { spread: looseness.spread, wandering: looseness.wandering, ..Looseness::default() }
    }

    /// A set with one further place, where its linear model has the largest evidence.
    pub(super) fn begun(&self, fit: &Fit, further: usize) -> Option<Fit> {
        let candidate = &self.candidates[further];
        let mut members = fit.members.clone();
        members.push(further);
        let own = members.len() - 1;
        let mut freedoms = fit.freedoms.clone();
        freedoms.push(Freedom::constant(self.settings.sizes[0]));
        let mut best: Option<Fit> = None;
        // A disturbance that took the place of a cause goes only as the cause comes: with one alone neither is better.
        let still = self.still(fit.looseness);
        // About a machine with others in force only the slope is known.
        let is_slope = fit.reference.as_ref().is_some_and(|all| !all.others.is_empty());
        let knots = if is_slope { &[0.0][..] } else { candidate.answer.knots() };
        let mut begins: Vec<(f64, Looseness)> = knots.iter().map(|knot| (*knot, fit.looseness)).collect();
        if still != fit.looseness {
            begins.extend(knots.iter().map(|knot| (*knot, still)));
        }
        for (knot, looseness) in begins {
            let mut amplitudes = fit.amplitudes.clone();
            amplitudes.push(self.alike(knot));
            let linear = self.linear(&members, &amplitudes, fit.reference.as_deref());
            // In logs a cause may act by its law alone.
            let by = Open { members: &[(own, further)], with_curves: self.is_log(), are_bounded: false };
            let (mut found, mut log_evidence) = self.freest(&linear, &freedoms, &amplitudes, by, looseness);
            // What bends begins at large amplitudes too; of what is straight the readings say how much they ask for.
            if candidate.has_tails
                && candidate.answer.is_straight()
                && let Some(asked) = self.asked(&linear, &found, looseness, own).filter(|asked| *asked > self.largest_size())
            {
                let mut larger = amplitudes.clone();
                larger[own] = self.alike(asked);
                (found, log_evidence) = self.freest(&linear, &freedoms, &larger, by, looseness);
            }
            if best.as_ref().is_none_or(|best| log_evidence > best.log_evidence) {
                let log_prior = self.log_prior(&members);
                let members = members.clone();
                let (errors, reference) = (fit.errors.clone(), fit.reference.clone());
                best = Some(Fit {
                    members,
                    freedoms: found,
                    looseness,
                    amplitudes,
                    log_evidence,
                    log_prior,
                    stands: false,
                    errors,
                    reference,
                    aside: fit.aside.clone(),
                });
            }
        }
        best
    }

    /// How large the linear model asks a member to be.
    fn asked(&self, linear: &Linear<'_>, freedoms: &[Freedom], looseness: Looseness, member: usize) -> Option<f64> {
        let explained = self.explained(linear, looseness, &self.followed(freedoms))?;
        explained.most_probable(freedoms, looseness)?.get(member).map(|own| self.size_of(own))
    }

    /// Every place and kind alone, fitted, most probable first.
    pub fn singles(&self, nothing: &Fit) -> Vec<Fit> {
        let one = |c: usize| Some(self.fit(self.begun(nothing, c)?));
        sorted((0..self.candidates.len()).into_par_iter().filter_map(one).collect())
    }

    /// Sets with one place more than given ones, most probable first.
    pub fn grown(&self, from: &[Fit]) -> Vec<Fit> {
        let mut found: Vec<Fit> = Vec::new();
        for fit in from.iter().take(GROWING) {
            let fit = &self.with_others(fit);
            let about = self.with_errors_of(fit);
            let further: Vec<usize> = (0..self.candidates.len()).filter(|c| !fit.members.contains(c)).collect();
            let mut begun = sorted(further.par_iter().filter_map(|c| about.begun(fit, *c)).collect());
            begun.truncate(FITTED);
            let is_new = |one: &Fit, found: &[Fit]| {
                let own = ordered(&one.members);
                found.iter().all(|other| ordered(&other.members) != own)
            };
            begun.retain(|one| is_new(one, &found));
            found.extend(begun.into_par_iter().map(|one| about.fit(one)).collect::<Vec<_>>());
            forget_rows(fit);
        }
        sorted(found)
    }

    /// A fit to a log with the slopes in every candidate about the machine with its set in force.
    fn with_others(&self, fit: &Fit) -> Fit {
        let all = self.about.filter(|_| self.is_log()).and_then(|about| about(&fit.members, &fit.amplitudes, true, None));
        match all {
            Some((reference, errors)) => {
                let errors = fit.without_aside(errors);
                Fit { reference: Some(Arc::new(reference)), errors: Some(Arc::new(errors)), ..fit.clone() }
            }
            None => fit.clone(),
        }
    }
}

/// How far the looseness of a model is sought.
#[derive(Clone, Copy, PartialEq)]
pub enum Sought {
    /// By steps from a given one and from none.
    All,
    /// By steps from a given one alone.
    Near,
    /// Nowhere: it stays as it is.
    AsItIs,
}

/// Members of a set whose ways are chosen, each with its candidate.
#[derive(Clone, Copy)]
pub(super) struct Open<'a> {
    pub members: &'a [(usize, usize)],
    /// Whether their amplitudes may follow curves and laws.
    pub with_curves: bool,
    /// Whether ways lose evidence by amplitudes beyond their range, which takes a posterior each.
    pub are_bounded: bool,
}

/// A residual without members, and their slopes.
pub struct Linear<'a> {
    /// K
    pub residual: Vec<f64>,
    /// K per scale.
    pub slopes: Vec<Slope>,
    /// Functions of the rows.
    pub profiles: &'a Profiles,
    /// Whitened as was asked for last.
    pub known: Recent<Explained<'a>>,
}

/// Forgets what was made of a fit's own errors: it is large and seldom asked for again.
fn forget_rows(fit: &Fit) {
    if let Some(log) = fit.errors.as_deref().and_then(|errors| errors.log.as_ref()) {
        log.forget();
    }
}

/// A value among some, with the ones beside it.
pub(super) fn near_by(all: &[f64], value: f64) -> Vec<f64> {
    let at = all.iter().position(|v| *v == value).unwrap_or(0);
    all[at.saturating_sub(1)..(at + 2).min(all.len())].to_vec()
}

pub(super) fn ordered(members: &[usize]) -> Vec<usize> {
    let mut all = members.to_vec();
    all.sort_unstable();
    all
}

/// Fits with evidence, most probable first.
pub(super) fn sorted(mut fits: Vec<Fit>) -> Vec<Fit> {
    fits.retain(|fit| fit.log_evidence.is_finite());
    fits.sort_by(|a, b| b.log_posterior().total_cmp(&a.log_posterior()));
    fits
}
