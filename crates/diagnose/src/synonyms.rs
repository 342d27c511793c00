//! Causes that do the same at every condition are one cause with several names.
//!
//! Where a source's heat is in proportion to the speed, more heat at its place in proportion to the speed is a larger factor of it: no test
//! tells one from the other, and the machines that are written predict the same. So their probabilities add up. What is the same in steady
//! state alone, as twice the heat and half of every contact, is told apart by warming up and keeps its names.

use super::effects::{EffectDerivatives, Hypothesis, Scales};
use super::finalists::{Finalists, Outcome};
use super::probability::Candidate;
use super::{Cause, Problem, Synonym, next};
use coldplate_base::random::Random;
use coldplate_solve::sensitivity::Derivatives;

/// Columns that differ by less than this share of their length are the same.
const SAME: f64 = 1e-4;
/// Temperatures of nodes at which causes are compared: the lowest, and how far they differ, K.
const COOLEST: f64 = 290.0;
const SPREAD: f64 = 20.0;
/// Explanations less probable than this share of the best one keep their names to themselves.
const CONTENDS: f64 = 1e-3;

/// An outcome in which explanations that are the same are one, the most probable of them, under its own name.
pub fn merged(finals: &Finalists<'_>, mut outcome: Outcome) -> Outcome {
    let same = same(finals, &outcome);
    if same.is_empty() {
        return outcome;
    }
    let is_same = |i: usize, j: usize| i == j || same.contains(&(i.min(j), i.max(j)));
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in std::mem::take(&mut outcome.posterior.candidates) {
        let partner = kept.iter_mut().find_map(|k| Some((partners(&k.members, &candidate.members, is_same)?, k)));
        let Some((partners, own)) = partner else {
            kept.push(candidate);
            continue;
        };
        let (most, least) = (own.weight.max(candidate.weight), own.weight.min(candidate.weight));
        own.weight = most + (least - most).exp().ln_1p();
        // How large it is under a name by which nothing was fitted, slopes do not say where it bends.
        let Some(fitted) = outcome.fit_of(&candidate).cloned() else { continue };
        for (k, (of, j)) in partners.into_iter().zip(&candidate.members).enumerate() {
            let known = &mut outcome.synonyms;
            let is_known = |(members, s): &(Vec<usize>, Synonym)| *members == own.members && s.cause.hypothesis.is_same(finals.of(*j));
            if own.members[of] != *j && !known.iter().any(is_known) {
                let cause = Cause::new(finals.of(*j).clone(), fitted.amplitudes[k], fitted.deviations[k]);
                known.push((own.members.clone(), Synonym { of, cause }));
            }
        }
    }
    outcome.posterior.candidates = kept;
    outcome.posterior.normalise();
    outcome
}

/// The place of every member of an explanation among those of another, where they are the same.
fn partners(own: &[usize], other: &[usize], is_same: impl Fn(usize, usize) -> bool) -> Option<Vec<usize>> {
    match (own, other) {
        (&[a], &[b]) => is_same(a, b).then(|| vec![0]),
        (&[a, b], &[c, d]) if is_same(a, c) && is_same(b, d) => Some(vec![0, 1]),
        (&[a, b], &[c, d]) if is_same(a, d) && is_same(b, c) => Some(vec![1, 0]),
        _ => None,
    }
}

/// Pairs of the machine's causes, as positions in the screen, whose slopes are the same at the data and that do the same to the machine at
/// conditions all over its ranges.
fn same(finals: &Finalists<'_>, outcome: &Outcome) -> Vec<(usize, usize)> {
    let candidates = &outcome.posterior.candidates;
    let least = CONTENDS * candidates.first().map_or(0.0, |best| best.probability);
    let mut causes: Vec<usize> = candidates.iter().filter(|c| c.probability > least).flat_map(|c| c.members.iter().copied()).collect();
    causes.sort_unstable();
    causes.dedup();
    let of_machine = |h: &Hypothesis| !h.is_sensor() && !h.is_fixed() && !h.is_rare();
    causes.retain(|j| of_machine(finals.of(*j)));
    let columns = &finals.base.found.columns;
    let of_data = |j: usize| &columns[finals.screened.visible[j]];
    let pairs = causes.iter().enumerate().flat_map(|(k, i)| causes[k + 1..].iter().map(move |j| (*i, *j)));
    let alike: Vec<(usize, usize)> = pairs.filter(|(i, j)| Products::of(of_data(*i), of_data(*j)).are_parallel()).collect();
    if alike.is_empty() {
        return Vec::new();
    }
    let found = alike.iter().map(|(i, j)| [finals.of(*i), finals.of(*j)]).collect::<Vec<_>>();
    let are_same = do_the_same(finals.problem, &found, finals.predictor.scales);
    alike.into_iter().zip(are_same).filter_map(|(pair, is_same)| is_same.then_some(pair)).collect()
}

/// Whether pairs of causes, none where no condition can be had, do the same to the balance of every node, at temperatures that are those of no steady state: then they do the
/// same in any test, as the machine warms up too.
fn do_the_same(problem: &Problem, pairs: &[[&Hypothesis; 2]], scales: &Scales) -> Vec<bool> {
    let coarse = next::coarse(problem);
    let problem = coarse.as_ref().unwrap_or(problem);
    let study = &problem.study;
    let all: Vec<Hypothesis> = pairs.iter().flatten().map(|h| (*h).clone()).collect();
    let derivatives = EffectDerivatives::new(study, &all, &problem.user);
    let mut random = Random::new(1);
    let mut sums = vec![Products::default(); pairs.len()];
    for condition in next::within_ranges(problem) {
        let field: Vec<f64> = (0..study.model.network.nodes).map(|_| COOLEST + SPREAD * random.unit()).collect();
        // Some cannot be run: water out of its range, no flow where heat needs it.
        let Ok(at) = Derivatives::at(study, &condition, &field) else { continue };
        let changes = derivatives.disturbances(&at, &at.screen());
        let of = |h: &Hypothesis| -> Option<Vec<f64>> {
            let own = changes.dense(derivatives.position(h)?, field.len(), study.model.machine.circuits.len())?;
            Some(own.into_iter().map(|heat| heat * scales.factor(h.law, &condition)).collect())
        };
        for (sum, [a, b]) in sums.iter_mut().zip(pairs) {
            // What has no words of its own is like nothing.
            *sum = of(a).zip(of(b)).map_or(Products::UNLIKE, |(a, b)| sum.and(Products::of(&a, &b)));
        }
    }
    sums.into_iter().map(Products::are_parallel).collect()
}

/// Scalar products of two columns.
#[derive(Debug, Clone, Copy, Default)]
struct Products {
    own: f64,
    other: f64,
    both: f64,
}

impl Products {
    /// Of columns that nothing makes parallel.
    const UNLIKE: Self = Self { own: f64::NAN, other: f64::NAN, both: f64::NAN };

    fn of(a: &[f64], b: &[f64]) -> Self {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        Self { own: dot(a, a), other: dot(b, b), both: dot(a, b) }
    }

    /// Of the columns followed by others.
    fn and(self, more: Self) -> Self {
        Self { own: self.own + more.own, other: self.other + more.other, both: self.both + more.both }
    }

    /// Whether the columns differ by a factor alone.
    fn are_parallel(self) -> bool {
        self.own > 0.0 && self.other - self.both * self.both / self.own < SAME * SAME * self.other
    }
}
