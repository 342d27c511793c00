//! The most probable causes fitted through the full solver, and what could act beside them.

use std::collections::HashMap;

use rayon::prelude::*;

use super::catalogue::{Hypothesis, hypotheses};
use super::probability::{self, Candidate, Posterior};
use super::refine::{Bench, Fitted, fit};
use super::screen::Screened;
use super::signature::signatures;
use super::{Problem, screened};
use crate::error::Result;
use crate::identify::chi_square_tail;
use crate::measure::Whitener;

/// Causes and pairs of the first screen that are fitted.
const FINALISTS: usize = 6;
/// Least probability of a finalist, once there is one.
const LEAST: f64 = 3e-3;
/// A misfit left that is less probable than this is looked into for a second cause.
const LEFT: f64 = 0.05;
/// Causes beside which a second one is looked for, and how many of each are fitted.
const FIRSTS: usize = 3;
const SECONDS: usize = 3;

/// What fitting needs.
pub struct Finals<'a> {
    /// Machine and data.
    pub problem: &'a Problem,
    /// Predictions with causes in force.
    pub bench: &'a Bench<'a>,
    /// All causes.
    pub catalogue: &'a [Hypothesis],
    /// The first screen.
    pub screened: &'a Screened,
    /// Readings that predictions are held against, K.
    pub readings: &'a [f64],
    /// Covariance.
    pub whitener: &'a Whitener,
}

/// Members of an explanation, as positions in the screen, with their fit.
pub type Entry = (Vec<usize>, Fitted);

impl Finals<'_> {
    /// Fits the most probable causes and pairs, looks for a second cause where one alone leaves too much, and puts the
    /// evidence of the fits in place of the linear one.
    ///
    /// # Errors
    /// As [`signatures`].
    pub fn fit(&self, posterior: &mut Posterior, prior: &[f64], progress: &mut dyn FnMut(&str)) -> Result<Vec<Entry>> {
        progress("fitting the most probable causes through the full solver");
        let mut fitted = self.solve(&self.first(posterior));
        self.weigh(posterior, prior, &fitted);
        let freedom = self.readings.len().saturating_sub(1).max(1);
        let least = fitted.iter().map(|(_, f)| f.misfit).fold(f64::INFINITY, f64::min);
        if chi_square_tail(least, freedom) < LEFT {
            progress("looking for a second cause beside the best ones");
            let mut singles: Vec<&Entry> = fitted.iter().filter(|(members, _)| members.len() == 1).collect();
            singles.sort_by(|a, b| a.1.misfit.total_cmp(&b.1.misfit));
            let mut pairs: Vec<Candidate> = Vec::new();
            for (members, f) in singles.into_iter().take(FIRSTS) {
                for pair in self.beside(members[0], f, prior)? {
                    if !pairs.iter().any(|p| p.members == pair.members) && !fitted.iter().any(|(m, _)| *m == pair.members) {
                        pairs.push(pair);
                    }
                }
            }
            let more = self.solve(&pairs);
            let is_new =
                |c: &Candidate| more.iter().any(|(m, _)| *m == c.members) && !posterior.candidates.iter().any(|p| p.members == c.members);
            let new: Vec<Candidate> = pairs.into_iter().filter(is_new).collect();
            posterior.candidates.extend(new);
            self.weigh(posterior, prior, &more);
            fitted.extend(more);
        }
        Ok(fitted)
    }

    /// Candidates worth a fit. Slopes serve only near the machine as it is: where even the best leaves more than noise,
    /// differences of evidence count for as much less.
    fn first(&self, posterior: &Posterior) -> Vec<Candidate> {
        let Some(best) = posterior.candidates.first() else { return Vec::new() };
        let left = (self.screened.misfit() - best.gain) / self.readings.len() as f64;
        let share = 1.0 / left.max(1.0);
        let probable = |c: &&Candidate| (share * (c.weight - best.weight)).exp() > LEAST;
        let mut chosen: Vec<Candidate> = posterior.candidates.iter().filter(probable).take(FINALISTS).cloned().collect();
        // Two must be held against the stronger one alone, which slopes put far behind where its effect bends.
        for pair in chosen.clone().iter().filter(|c| c.members.len() > 1) {
            let alone = posterior.candidates.iter().filter(|c| c.members.len() == 1 && pair.members.contains(&c.members[0]));
            if let Some(single) = alone.max_by(|a, b| a.gain.total_cmp(&b.gain))
                && !chosen.iter().any(|c| c.members == single.members)
            {
                chosen.push(single.clone());
            }
        }
        chosen
    }

    fn solve(&self, candidates: &[Candidate]) -> Vec<Entry> {
        let attempt = |c: &Candidate| -> Option<Entry> {
            let members: Vec<&Hypothesis> = c.members.iter().map(|j| self.of(*j)).collect();
            let guess: Vec<f64> = c.amplitudes.iter().zip(&members).map(|(a, h)| a * h.scale).collect();
            fit(self.bench, &members, &guess, self.readings, self.whitener).ok().map(|f| (c.members.clone(), f))
        };
        candidates.par_iter().filter_map(attempt).collect()
    }

    fn of(&self, j: usize) -> &Hypothesis {
        &self.catalogue[self.screened.visible[j]]
    }

    /// The evidence of fits in place of the linear one.
    fn weigh(&self, posterior: &mut Posterior, prior: &[f64], fitted: &[Entry]) {
        let whole = self.screened.misfit();
        for (members, f) in fitted {
            let Some(candidate) = posterior.candidates.iter_mut().find(|c| c.members == *members) else { continue };
            let sides = members.iter().filter(|j| !self.screened.signed[**j]).count() as f64 * 2f64.ln();
            candidate.weight = f.evidence + 0.5 * whole + sides + probability::prior_of(members, prior);
            candidate.gain = whole - f.misfit;
        }
        posterior.normalise();
    }

    /// What could act beside a cause: all causes screened again about the machine with it in force, its own amplitude free.
    fn beside(&self, first: usize, fitted: &Fitted, prior: &[f64]) -> Result<Vec<Candidate>> {
        let (h, problem) = (self.of(first), self.problem);
        let Some((study, _)) = self.bench.extended(&[(h, fitted.amplitudes[0])])? else { return Ok(Vec::new()) };
        let mut again = hypotheses(&study, &problem.data, &problem.user);
        let name = |h: &Hypothesis| (h.kind, h.place.clone(), h.law);
        let known: HashMap<_, usize> = (0..self.screened.visible.len()).map(|j| (name(self.of(j)), j)).collect();
        again.retain(|h| known.contains_key(&name(h)));
        let found = signatures(&study, &problem.data, problem.start, &[], &again, self.bench.scales, &problem.user)?;
        let residual: Vec<f64> = self.readings.iter().zip(&fitted.values).map(|(r, v)| r - v).collect();
        let second = screened(&residual, &found.columns, self.whitener, &again);
        let position: Vec<usize> = second.visible.iter().map(|i| known[&name(&again[*i])]).collect();
        let Some(own) = position.iter().position(|j| *j == first) else { return Ok(Vec::new()) };
        let mut pairs: Vec<Candidate> = (0..position.len())
            .filter(|i| *i != own)
            .filter_map(|i| {
                let ([moved, other], gain) = second.pair(own, i);
                // With the first one's amplitude free.
                let share = second.gram[(own, i)] / second.gram[(own, own)];
                let g = second.gram[(i, i)] - share * second.gram[(own, i)];
                let b = second.along[i] - share * second.along[own];
                let weight = 0.5 * b * b / (1.0 + g) - 0.5 * (1.0 + g).ln() + prior[position[i]].ln();
                let mut both = [(first, fitted.amplitudes[0] / h.scale + moved), (position[i], other)];
                both.sort_by_key(|(j, _)| *j);
                (gain > 0.0).then(|| Candidate {
                    members: both.iter().map(|b| b.0).collect(),
                    amplitudes: both.iter().map(|b| b.1).collect(),
                    gain: self.screened.misfit() - fitted.misfit + gain,
                    weight,
                    probability: 0.0,
                })
            })
            .collect();
        pairs.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        pairs.truncate(SECONDS);
        Ok(pairs)
    }
}
