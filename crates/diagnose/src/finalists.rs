//! The most probable causes fitted through the full solver, and what could act beside them.

use std::collections::HashMap;

use super::choice::{LEAST, LEFT, RARE_FINALISTS, doubted, has_rare, leading};
use super::effects::{Hypothesis, hypotheses};
use super::predictor::{Extended, Predictor};
use super::probability::{self, Candidate, Ground, Posterior};
use super::refine::Fitted;
use super::screen::Screened;
use super::view::{Comparison, ScreenInput, add_mesh_share};
use super::{Cause, Explanation, Problem, Synonym, signatures};
use coldplate_base::error::Result;
use coldplate_base::progress::Progress;
use coldplate_evidence::discrepancy::DiscrepancySize;
use coldplate_evidence::identify::chi_square_tail;

/// Causes and pairs of a screen that are fitted.
const FINALISTS: usize = 6;
/// Causes beside which a second one is looked for, and how many of each are fitted.
const FIRSTS: usize = 2;
const SECONDS: usize = 3;
/// Turns of fitting what leads unfitted.
const MOST_TURNS: usize = 3;
/// How often covariance and mesh are taken anew about the best explanation.
const ROUNDS: usize = 2;

/// What fitting needs.
#[derive(Clone)]
pub(crate) struct Finalists<'a> {
    /// Machine and data.
    pub problem: &'a Problem,
    /// Predictions with causes in force.
    pub predictor: &'a Predictor<'a>,
    /// All causes.
    pub catalogue: &'a [Hypothesis],
    /// The machine as it is.
    pub base: &'a Comparison,
    /// The first screen.
    pub screened: &'a Screened,
    /// Prior of every cause in it.
    pub prior: &'a [f64],
    /// The machine as it is, at the levels of discrepancy that suit it.
    pub ground: Ground,
    /// The level that suits it best.
    pub unexplained: DiscrepancySize,
    /// Row and sensor of every reading.
    pub places: Vec<(usize, usize)>,
}

/// Members of an explanation, as positions in the screen, with their fit.
pub type Entry = (Vec<usize>, Fitted);

/// What the fits come to.
#[derive(Clone)]
pub struct Outcome {
    /// Everything with its probability.
    pub posterior: Posterior,
    /// The fits.
    pub fitted: Vec<Entry>,
    /// The screen under the covariance about the best explanation.
    pub screened: Screened,
    /// The data beside the machine with the best explanation in force.
    pub view: Comparison,
    /// The machine as it is under the covariance of that screen.
    pub ground: Ground,
    /// Other names of causes, each with the members of the explanation that it belongs to.
    pub synonyms: Vec<(Vec<usize>, Synonym)>,
}

impl Outcome {
    /// The same with an explanation fitted anew.
    pub fn with(mut self, entry: Entry) -> Self {
        self.fitted.retain(|(members, _)| *members != entry.0);
        self.fitted.push(entry);
        self
    }

    /// The same without an explanation.
    pub fn without(mut self, members: &[usize]) -> Self {
        self.fitted.retain(|(own, _)| own != members);
        self.posterior.candidates.retain(|c| c.members != members);
        self.posterior.normalise();
        self
    }

    /// The same without any explanation by two causes.
    pub fn singles(mut self) -> Self {
        self.posterior.candidates.retain(|c| c.members.len() == 1);
        self.posterior.normalise();
        self
    }

    /// The fit of an explanation, where it was fitted.
    pub fn fit_of(&self, candidate: &Candidate) -> Option<&Fitted> {
        self.fitted.iter().find(|(members, _)| *members == candidate.members).map(|(_, fitted)| fitted)
    }

    /// The fit of the most probable explanation, where it was fitted.
    pub(crate) fn leading(&self) -> Option<&Entry> {
        let leading = self.posterior.candidates.first()?;
        self.fitted.iter().find(|(members, _)| *members == leading.members)
    }

    /// Predictions with the most probable explanation on the finer mesh, K; none where it was not fitted.
    pub(crate) fn leading_predictions(&self) -> Option<Vec<f64>> {
        let (_, fitted) = self.leading()?;
        Some(fitted.values.iter().zip(&self.view.mesh).map(|(v, m)| v + m).collect())
    }
}

impl Finalists<'_> {
    /// The most probable explanations of an outcome: as fitted, or from slopes.
    pub fn explanations(&self, outcome: &Outcome, posterior: &Posterior, most: usize) -> Vec<Explanation> {
        let one = |c: &Candidate| {
            let known = outcome.fit_of(c);
            let linear = outcome.screened.deviations(&c.members);
            let cause = |(i, j): (usize, &usize)| {
                let hypothesis = self.of(*j).clone();
                let scale = hypothesis.scale;
                let (amplitude, deviation) = known
                    .map_or((bounded(&hypothesis, c.amplitudes[i] * scale), linear[i] * scale), |f| (f.amplitudes[i], f.deviations[i]));
                Cause::new(hypothesis, amplitude, deviation)
            };
            let synonyms = outcome.synonyms.iter().filter(|(members, _)| *members == c.members);
            Explanation {
                causes: c.members.iter().enumerate().map(cause).collect(),
                synonyms: synonyms.map(|(_, synonym)| synonym.clone()).collect(),
                probability: c.probability,
                misfit: known.map_or(outcome.screened.misfit() - c.gain, |f| f.misfit),
                deviance: known.map_or(outcome.ground.screen - c.gain, |f| f.deviance),
                level: known.map_or(outcome.view.level, |f| f.level),
                is_fitted: known.is_some(),
            }
        };
        posterior.candidates.iter().take(most).map(one).collect()
    }

    /// What a screen says, before anything is fitted.
    pub(crate) fn unfitted(&self, posterior: Posterior) -> Outcome {
        let (screened, view) = (self.screened.clone(), self.base.clone());
        Outcome { posterior, fitted: Vec::new(), screened, view, ground: self.ground, synonyms: Vec::new() }
    }

    /// Fits the most probable causes and pairs, looks for a second cause where one alone leaves too much, and puts the
    /// evidence of the fits in place of the linear one. Covariance and mesh are taken anew about the best explanation: what
    /// is common to all films or heats acts on what the cause adds too.
    pub fn fit(&self, posterior: Posterior, progress: &dyn Progress) -> Outcome {
        progress.say("fitting the most probable causes through the full solver");
        let mut now = self.unfitted(posterior);
        let mut about: Vec<usize> = Vec::new();
        let mut chosen = leading(&now.posterior, &now.screened, FINALISTS);
        let doubted = doubted(&now.posterior, &now.screened, &chosen, &|j| self.of(j));
        if self.unexplained != self.base.level {
            // What stands out where the machine may be off by as much as it is.
            let open = self.screened_by(&self.base.at(self.unexplained));
            let ground = Ground { screen: self.ground.any, ..self.ground };
            let posterior = probability::posterior(&open, self.prior, &ground, !self.problem.data.is_transient());
            let more = leading(&posterior, &open, FINALISTS).into_iter().filter(|c| !chosen.iter().any(|other| other.members == c.members));
            chosen.extend(more.collect::<Vec<_>>());
        }
        let base = now.view.clone();
        now.fitted = self.solve(&chosen, &now.fitted, &base);
        // What bends has the benefit of the doubt once: it must explain what slopes do not, but for a usual discrepancy.
        now.fitted
            .extend(self.solve(&doubted, &now.fitted, &base).into_iter().filter(|(_, fitted)| self.base.errors.is_usual(&fitted.level)));
        self.keep(&mut now);
        self.weigh(&mut now);
        for round in 0..ROUNDS {
            let Some(best) = self.best(&now).filter(|best| best.0 != about) else { break };
            about.clone_from(&best.0);
            progress.say("what is uncertain about the best cause");
            // A machine that cannot be solved with a cause in force says nothing more of it; the others stand.
            let found = self.about(&best, round).unwrap_or_else(|e| {
                progress.say(&format!("the covariance about the best cause could not be had: {e}"));
                None
            });
            if let Some(view) = found {
                now.screened = self.screened_by(&view);
                now.ground = Ground { screen: view.deviance(&self.base.found.residual), ..self.ground };
                now.view = view.clone();
                // In logs, whose fits are runs, a second cause is looked for beside the first only where one leaves too much.
                now.posterior = probability::posterior(&now.screened, self.prior, &now.ground, !self.problem.data.is_transient());
                self.keep(&mut now);
                let mut chosen = leading(&now.posterior, &now.screened, FINALISTS);
                chosen.extend(self.again(&now, &chosen));
                now.fitted = self.solve(&chosen, &now.fitted, &view);
                self.weigh(&mut now);
            }
            let view = now.view.clone();
            self.settle(&mut now, &view);
            if round == 0 && (self.leaves_much(&now) || self.may_hide_another(&now)) {
                progress.say("looking for a second cause beside the best ones");
                let pairs = self.seconds(&now, &view).unwrap_or_else(|e| {
                    progress.say(&format!("a second cause could not be looked for: {e}"));
                    Vec::new()
                });
                let more = self.solve(&pairs, &now.fitted, &view);
                now.posterior.candidates.retain(|c| !more.iter().any(|(m, _)| *m == c.members));
                now.posterior.candidates.extend(pairs.into_iter().filter(|c| more.iter().any(|(m, _)| *m == c.members)));
                now.fitted.extend(more);
                self.weigh(&mut now);
                self.settle(&mut now, &view);
            }
        }
        now
    }

    /// Covariance and mesh with an explanation in force; `None` where they are those already taken, or the machine file has no words
    /// for it.
    fn about(&self, (members, fitted): &Entry, round: usize) -> Result<Option<Comparison>> {
        let members: Vec<(&Hypothesis, f64)> = members.iter().map(|j| self.of(*j)).zip(fitted.amplitudes.iter().copied()).collect();
        if members.iter().all(|(h, _)| h.is_sensor()) {
            return Ok((round > 0 || fitted.level != self.base.level).then(|| self.base.at(fitted.level)));
        }
        let Some(Extended { study, .. }) = self.predictor.extended(&members)? else { return Ok(None) };
        Ok(Some(self.base.about(self.problem, &study, self.catalogue, self.predictor.scales)?.at(fitted.level)))
    }

    /// The screen of the machine as it is under another covariance.
    pub(crate) fn screened_by(&self, view: &Comparison) -> Screened {
        let (base, whitener, places) = (&self.base.found, &view.whitener, &self.places);
        let held = ScreenInput { residual: &base.residual, columns: &base.columns, whitener, catalogue: self.catalogue, places };
        held.screen_of(&self.screened.visible)
    }

    /// Fits what slopes put ahead of all that is fitted, until what leads is fitted.
    fn settle(&self, now: &mut Outcome, view: &Comparison) {
        for _ in 0..MOST_TURNS {
            let is_open = |c: &&Candidate| c.probability > LEAST && !now.fitted.iter().any(|(m, _)| *m == c.members);
            let (rare, usual): (Vec<&Candidate>, Vec<&Candidate>) =
                now.posterior.candidates.iter().partition(|c| has_rare(self.screened, c));
            let foremost = usual.into_iter().take(FINALISTS).chain(rare.into_iter().take(RARE_FINALISTS));
            let open: Vec<Candidate> = foremost.filter(is_open).cloned().collect();
            let more = self.solve(&open, &now.fitted, view);
            if more.is_empty() {
                break;
            }
            now.fitted.extend(more);
            self.weigh(now);
        }
    }

    /// A cause of the screen.
    pub fn of(&self, j: usize) -> &Hypothesis {
        &self.catalogue[self.screened.visible[j]]
    }

    /// The most probable explanation that is fitted.
    fn best(&self, now: &Outcome) -> Option<Entry> {
        let of = |c: &Candidate| now.fitted.iter().find(|(members, _)| *members == c.members).cloned();
        now.posterior.candidates.iter().find_map(of)
    }

    /// Whether even the best fit leaves more than noise and a usual discrepancy.
    pub(crate) fn leaves_much(&self, now: &Outcome) -> bool {
        let least = now.fitted.iter().min_by(|a, b| a.1.deviance.total_cmp(&b.1.deviance));
        least.is_some_and(|(_, f)| {
            !self.base.errors.is_usual(&f.level) || chi_square_tail(f.misfit, self.base.readings.len().saturating_sub(1).max(1)) < LEFT
        })
    }

    /// Whether the discrepancy beside the best cause of a log may be a second cause: numbers of the file that are all a little off do what
    /// one of them does that is off by much. Only where runs cost little: of lumped nodes, without fronts in the water.
    fn may_hide_another(&self, now: &Outcome) -> bool {
        let is_cheap = self.problem.data.is_transient() && self.problem.study.model.mesh.cells == 0 && !self.predictor.fronts;
        is_cheap && self.best(now).is_some_and(|(_, fitted)| fitted.level != DiscrepancySize::NONE)
    }

    /// Probability that pure noise lets some cause take away as much as the best one does of what the most probable explanation leaves.
    pub(crate) fn look_beside(&self, now: &Outcome) -> f64 {
        let Some((members, fitted)) = now.leading().filter(|(_, fitted)| fitted.left.len() == self.base.readings.len()) else { return 1.0 };
        let own = (fitted.level != now.view.level).then(|| now.view.at(fitted.level)).map(|view| (self.screened_by(&view), view));
        let (screened, view) = own.as_ref().map_or((&now.screened, &now.view), |(screened, view)| (screened, view));
        let slopes: Vec<Vec<f64>> = fitted.slopes.iter().map(|slope| view.whitener.apply(slope)).collect();
        screened.look_beside(members, &view.whitener.apply(&fitted.left), &slopes)
    }

    /// What was fitted and is not among the linear candidates (a second cause found beside the first) stays one.
    fn keep(&self, now: &mut Outcome) {
        for (members, f) in &now.fitted {
            if now.posterior.candidates.iter().any(|c| c.members == *members) {
                continue;
            }
            let amplitudes = members.iter().zip(&f.amplitudes).map(|(j, a)| a / self.of(*j).scale).collect();
            let gain = now.ground.screen - f.deviance;
            now.posterior.candidates.push(Candidate {
                members: members.clone(),
                amplitudes,
                gain,
                weight: f64::NEG_INFINITY,
                probability: 0.0,
            });
        }
    }

    /// Those fitted before that are not chosen yet, the better ones.
    fn again(&self, now: &Outcome, chosen: &[Candidate]) -> Vec<Candidate> {
        let mut before: Vec<&Entry> = now.fitted.iter().filter(|(m, _)| !chosen.iter().any(|c| c.members == *m)).collect();
        before.sort_by(|a, b| a.1.deviance.total_cmp(&b.1.deviance));
        let of = |(members, _): &&Entry| now.posterior.candidates.iter().find(|c| c.members == *members).cloned();
        before.iter().filter_map(of).take(FINALISTS / 2).collect()
    }

    /// The evidence of fits in place of the linear one.
    pub fn weigh(&self, now: &mut Outcome) {
        for (members, f) in &now.fitted {
            let Some(candidate) = now.posterior.candidates.iter_mut().find(|c| c.members == *members) else { continue };
            let sides = members.iter().filter(|j| !self.screened.signed[**j]).count() as f64 * 2f64.ln();
            candidate.weight = f.evidence + 0.5 * self.ground.usual + sides + probability::prior_of(members, self.prior);
            candidate.gain = now.ground.screen - f.deviance;
        }
        now.posterior.normalise();
    }

    /// Pairs of the best single causes with whatever could act beside them.
    fn seconds(&self, now: &Outcome, view: &Comparison) -> Result<Vec<Candidate>> {
        let mut singles: Vec<&Entry> = now.fitted.iter().filter(|(members, _)| members.len() == 1).collect();
        singles.sort_by(|a, b| a.1.deviance.total_cmp(&b.1.deviance));
        let mut pairs: Vec<Candidate> = Vec::new();
        // Beside another cause a law with a number of its own makes up for anything.
        singles.retain(|(members, _)| !self.screened.is_rare[members[0]]);
        for (members, f) in singles.into_iter().take(FIRSTS) {
            for pair in self.beside(members[0], f, now, view)? {
                if !pairs.iter().any(|p| p.members == pair.members) && !now.fitted.iter().any(|(m, _)| *m == pair.members) {
                    pairs.push(pair);
                }
            }
        }
        Ok(pairs)
    }

    /// What could act beside a cause: all causes screened again about the machine with it in force, its own amplitude free.
    fn beside(&self, first: usize, fitted: &Fitted, now: &Outcome, view: &Comparison) -> Result<Vec<Candidate>> {
        let (h, problem) = (self.of(first), self.problem);
        let Some(Extended { study, .. }) = self.predictor.extended(&[(h, fitted.amplitudes[0])])? else { return Ok(Vec::new()) };
        let mut again = hypotheses(&study, &problem.data, &problem.user);
        let name = |h: &Hypothesis| (h.kind(), h.place.clone(), h.law);
        let known: HashMap<_, usize> = (0..self.screened.visible.len()).map(|j| (name(self.of(j)), j)).collect();
        again.retain(|h| known.contains_key(&name(h)));
        let found = signatures(&study, &problem.data, problem.runs(), &[], &again, self.predictor.scales, &problem.user)?;
        let left: Vec<f64> = view.readings.iter().zip(&fitted.values).map(|(r, v)| r - v).collect();
        let relabelled = h.relabelled(&self.places);
        let residual = relabelled
            .as_ref()
            .map_or_else(|| left.clone(), |from| from.iter().enumerate().map(|(i, o)| left[*o] + view.mesh[*o] - view.mesh[i]).collect());
        // What the readings show of another cause goes through the sensors' own error first; exchanged ones were put back.
        let shown = |column: &Vec<f64>, other: &Hypothesis| -> Vec<f64> {
            if !h.is_sensor() || h.is_fixed() || other.is_sensor() {
                return column.clone();
            }
            let values = &found.prediction.values;
            let moved: Vec<f64> = values.iter().zip(column).map(|(v, c)| v + c).collect();
            let read = |v: &[f64]| h.read(&problem.study.model.machine, &problem.data, v, fitted.amplitudes[0]);
            read(&moved).iter().zip(read(values)).map(|(a, b)| a - b).collect()
        };
        let mut columns: Vec<Vec<f64>> = found.columns.iter().zip(&again).map(|(column, other)| shown(column, other)).collect();
        add_mesh_share(&again, &mut columns, &view.mesh, &self.places);
        let held =
            ScreenInput { residual: &residual, columns: &columns, whitener: &view.whitener, catalogue: &again, places: &self.places };
        let mut second = held.screen();
        let position: Vec<usize> = second.visible.iter().map(|i| known[&name(&again[*i])]).collect();
        let Some(own) = position.iter().position(|j| *j == first) else { return Ok(Vec::new()) };
        // What is found of the first is a change of its amplitude.
        second.signed[own] = true;
        let pair = |i: usize| -> Option<Candidate> {
            // With the first one's amplitude free, where it has one.
            let share = if h.is_fixed() { 0.0 } else { second.product(own, i) / second.square(own) };
            let ([moved, other], gain) = if h.is_fixed() {
                let (other, gain) = second.single(i);
                ([0.0, other], gain)
            } else {
                second.pair(own, i)
            };
            let g = second.square(i) - share * second.product(own, i);
            let b = second.along[i] - share * second.along[own];
            let evidence = match &second.relabelled[i] {
                Some(left) if h.is_fixed() => 0.5 * (second.misfit() - left.misfit),
                Some(left) => 0.5 * (second.misfit() - left.misfit + left.along[own].powi(2) / (1.0 + second.square(own))),
                None => 0.5 * b * b / (1.0 + g) - 0.5 * (1.0 + g).ln() + second.tail(i, b / (1.0 + g)),
            };
            let weight = evidence + self.prior[position[i]].ln();
            let is_possible = h.is_signed || fitted.amplitudes[0] / h.scale + moved >= 0.0;
            let mut both = [(first, fitted.amplitudes[0] / h.scale + moved), (position[i], other)];
            both.sort_by_key(|(j, _)| *j);
            (gain > 0.0 && is_possible).then(|| Candidate {
                members: both.iter().map(|b| b.0).collect(),
                amplitudes: both.iter().map(|b| b.1).collect(),
                gain: now.ground.screen - view.deviance(&fitted.left) + gain,
                weight,
                probability: 0.0,
            })
        };
        let mut pairs: Vec<Candidate> = (0..position.len()).filter(|i| *i != own).filter_map(pair).collect();
        pairs.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        pairs.truncate(SECONDS);
        Ok(pairs)
    }
}

/// An amplitude of the screen, no larger than a fit could make it.
fn bounded(hypothesis: &Hypothesis, amplitude: f64) -> f64 {
    amplitude.clamp(-hypothesis.largest(), hypothesis.range().1)
}
