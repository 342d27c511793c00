//! The answer: a verdict from the posterior, the machine with the best explanation in it, the gain, and the next measurement.

use std::ops::Range;
use std::time::Instant;

use super::amplitude::{Beside, KeptOut, Looseness, PlaceSet, Rows};
use super::attached::Attached;
use super::effects::Hypothesis;
use super::gain::gain;
use super::in_force::InForce;
use super::{Cause, Diagnosis, Explanation, Gain, Misfit, Others, Problem, Residuals, Tried, Verdict, decide, missing, next, overstated};
use coldplate_base::error::Result;
use coldplate_base::numbers::sum_of_squares;
use coldplate_base::progress::Progress;
use coldplate_evidence::discrepancy::DiscrepancySize;
use coldplate_evidence::identify::chi_square_tail;
use coldplate_evidence::measurement::whiten;
use coldplate_solve::study::StateTables;

/// Readings of the end result may be off by so much on the reduced model, K: noise and what meshes leave open are tens of this.
const ACCURACY: f64 = 1e-3;
/// Keys of a machine file with their values.
type Lines = Vec<(String, String)>;

/// Explanations that are kept.
const MOST_EXPLANATIONS: usize = 40;
/// Explanations whose misfit is found through the solver.
const SOLVED: usize = 12;

/// The machine with what is named in force.
#[derive(Debug, Clone)]
pub struct Rung {
    /// Causes that are named. Empty where numbers of the file as the readings draw them predict data kept out better for certain, and nothing is
    /// named.
    pub causes: Vec<Cause>,
    /// Numbers of the file that the readings draw beside them.
    pub refitted: Vec<Cause>,
    /// Correlations of the causes.
    pub correlations: Vec<Vec<f64>>,
    /// Root mean square residual with it in force, K.
    pub rms: f64,
    /// Share of the squared residual of the machine as it is that is explained.
    pub share: f64,
    /// The same of each cause by itself, in the order of the causes, where there are several.
    pub alone: Vec<f64>,
    /// What the model leaves open beside it.
    pub left: Looseness,
    /// Probability of a misfit as large as is left, beside that.
    pub probability_left: f64,
    /// Where most of what is left is.
    pub where_left: Option<WhereLeft>,
    /// Gain on data that took no part: of the causes that its lines say, or of all where there are no lines.
    pub gain: Option<Gain>,
    /// Whether all causes together predict data that took no part no better than the machine as it is.
    is_vetoed: bool,
    /// Whether a law is known of every cause that its lines say.
    has_laws: bool,
    /// Lines of the machine file; `None` where it has no words for any cause, or predicts no better with those that it has words for.
    pub sets: Option<Lines>,
    /// Causes that these lines leave out, for a machine file has no words for them.
    pub left_out: Option<LeftOut>,
    /// Predictions with it in force, K.
    pub predicted: Vec<f64>,
    /// Difference of the predictions on the reduced model from those of full solves, K; none of logs and of full solves.
    off_in_full: Option<f64>,
}

/// Causes that a machine file has no words for.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOut {
    /// Their kinds and places.
    pub causes: Vec<String>,
    /// Root mean square residual without them, K.
    pub rms: f64,
}

/// The sensor that most of what is left belongs to.
#[derive(Debug, Clone, PartialEq)]
pub struct WhereLeft {
    /// Its name.
    pub sensor: String,
    /// Its share of the squared residual.
    pub share: f64,
}

/// Diagnoses: fits every set of places and kinds that could win, decides, extends the machine by the most probable one, and says what is gained
/// and what to measure next. Tables are solved on the reduced model ([`StateTables::Reduced`]) and their end result once in full; should they
/// differ by more than a millikelvin, all of it is done in full.
///
/// # Errors
/// The machine has a controller, or as it is cannot be solved at the data's conditions.
pub fn diagnose(problem: &Problem, progress: &dyn Progress) -> Result<Diagnosis> {
    let clock = Instant::now();
    problem.study.model.machine.without_controllers("a diagnosis")?;
    let mut found = once(problem, progress)?;
    if let Some(off) = found.off_in_full.filter(|off| off.is_nan() || *off > ACCURACY) {
        progress.say(&format!("the reduced model is off by {off:.1e} K: everything again in full"));
        let study = problem.study.clone().with_tables(StateTables::InFull);
        found = once(&Problem { study, ..problem.clone() }, progress)?;
    }
    found.seconds = clock.elapsed().as_secs_f64();
    Ok(found)
}

fn once(problem: &Problem, progress: &dyn Progress) -> Result<Diagnosis> {
    progress.say(&format!("{} readings: slopes of every cause", problem.data.count()));
    let beside = Beside::of(problem)?;
    let residual = &beside.base.found.residual;
    if let Some(share) = overstated::share(problem, &beside.base, residual, 0) {
        return once(&problem.with_noise(share, progress), progress);
    }
    let places = beside.places(&problem.settings, progress);
    let beside = beside.knowing(places.scales.clone());
    let weighed = Weighed::new(&beside, &places.sets);
    let mut explanations = weighed.explanations();
    progress.say("the machine with the best explanation in force");
    let mut in_force = None;
    for _ in 0..SOLVED {
        let Some(best) = explanations.first() else { break };
        in_force = weighed.in_force(&best.causes, &places.sets[best.of], progress);
        if !in_force.as_ref().is_some_and(InForce::has_nothing) {
            break;
        }
        // A cause of which the solver leaves nothing is none: what the search made of it was a slope.
        let refuted = explanations.remove(0).probability;
        explanations.iter_mut().for_each(|e| e.probability /= (1.0 - refuted).max(f64::MIN_POSITIVE));
    }
    if let Some(found) = &in_force
        && let Some(share) = overstated::share(problem, &beside.base, &beside.base.left(&found.values), found.causes.len())
    {
        return once(&problem.with_noise(share, progress), progress);
    }
    if let (Some(best), Some(found)) = (explanations.first_mut(), &in_force) {
        for own in &mut best.causes {
            if let Some(fitted) = found.causes.iter().find(|fitted| fitted.hypothesis == own.hypothesis) {
                *own = fitted.clone();
            }
        }
    }
    let all = explanations.first().map_or(&[][..], |best| &best.causes);
    let kept_out = explanations.first().and_then(|best| best.kept_out.clone());
    let rung = in_force.map(|found| weighed.rung(found, all, kept_out.as_deref())).transpose()?;
    // The rest of an explanation may show nothing by itself where one of its causes cannot be solved.
    let shows = |rung: &Rung| rung.share > 0.0 && !rung.gain.as_ref().is_some_and(Gain::is_none);
    let rung = rung.filter(|rung| rung.causes.len() == all.len() || shows(rung));
    let mut answer = weighed.answer(&explanations, rung.as_ref());
    let is_log = problem.data.is_transient();
    // A law holds in rows that took no part; a number of its own in every row, or a curve over few, says little of them and may act all the same.
    let has_laws = all.iter().all(|cause| cause.hypothesis.has_known_law(&places.scales));
    let is_extended = answer.verdict.names_causes()
        && rung.as_ref().is_some_and(|rung| {
            let is_certain =
                answer.verdict == Verdict::Explained && rung.has_laws || rung.gain.as_ref().map_or(rung.has_laws, |gain| gain.low > 0.0);
            rung.share > 0.0 && !rung.gain.as_ref().is_some_and(Gain::is_none) && (is_certain || !is_log && rung.has_laws)
        });
    let misses = answer.verdict.names_causes() && rung.as_ref().is_some_and(|rung| rung.share <= 0.0);
    let is_vetoed = answer.verdict.names_causes() && rung.as_ref().is_some_and(|rung| rung.is_vetoed);
    if is_vetoed && has_laws || misses {
        answer.verdict = Verdict::CannotTell;
        answer.level = decide::Level::nothing(answer.level.probability);
    }
    if answer.verdict == Verdict::Explained && (rung.is_none() || is_vetoed) {
        // A cause is not certain if its machine cannot be solved, or predicts rows kept out no better: nobody has seen it predict.
        answer.verdict = Verdict::CannotTell;
        answer.level = decide::region(&explanations, problem.settings.certain);
    }
    let rung = if is_extended { rung } else { weighed.calibrated()? };
    let gain = rung.as_ref().and_then(|rung| rung.gain.clone()).or_else(|| weighed.without_gain());
    let next = if matches!(answer.verdict, Verdict::CannotTell | Verdict::SomethingElse) {
        progress.say("what to measure next");
        let open: Vec<&Explanation> = answer.set.iter().map(|i| &explanations[*i]).collect();
        next::next(&beside.predictor(), problem, answer.verdict, &open)?
    } else {
        Vec::new()
    };
    let off_in_full = match &rung {
        Some(rung) => rung.off_in_full,
        None => weighed.off_in_full(&[]),
    };
    Ok(Diagnosis {
        misfit: weighed.misfit,
        verdict: answer.verdict,
        certainties: if answer.verdict.names_causes() { decide::certainties(&explanations) } else { Vec::new() },
        level: answer.level,
        others: Others { nothing: weighed.nothing(), something_else: answer.something_else },
        set: answer.set,
        tried: Tried { all: beside.count(), visible: places.tried },
        residuals: residuals(&beside),
        explained: rung.as_ref().map(|rung| rung.predicted.clone()),
        gain,
        next,
        missing: weighed.empty().map_or_else(Vec::new, |nothing| missing::missing(&beside, nothing)),
        sets: rung.as_ref().and_then(|rung| rung.sets.clone()),
        rungs: rung.into_iter().collect(),
        noise_share: problem.noise_share,
        unexplained: weighed.looseness(),
        is_vetoed,
        misses,
        whitener: beside.base.whitener.clone(),
        off_in_full,
        places: places.clone(),
        explanations,
        seconds: 0.0,
    })
}

/// What the posterior comes to.
struct Answer {
    verdict: Verdict,
    level: decide::Level,
    set: Vec<usize>,
    something_else: f64,
}

/// Sets with their posterior beside the data.
struct Weighed<'b> {
    beside: &'b Beside<'b>,
    sets: &'b [PlaceSet],
    misfit: Misfit,
}

impl<'b> Weighed<'b> {
    fn new(beside: &'b Beside<'b>, sets: &'b [PlaceSet]) -> Self {
        let whitened = beside.base.whitener.apply(&beside.base.found.residual);
        let (chi2, freedom) = (sum_of_squares(&whitened), whitened.len());
        let mut weighed =
            Self { beside, sets, misfit: Misfit { chi2, freedom, probability: chi_square_tail(chi2, freedom), look_elsewhere: 1.0 } };
        weighed.misfit.look_elsewhere = weighed.nothing();
        weighed
    }

    fn empty(&self) -> Option<&'b PlaceSet> {
        self.sets.iter().find(|set| set.members.is_empty())
    }

    /// Posterior probability that no cause acts.
    fn nothing(&self) -> f64 {
        self.empty().map_or(0.0, |set| set.probability)
    }

    /// What the machine as it is leaves open.
    fn looseness(&self) -> Looseness {
        self.empty().map_or_else(Looseness::default, |set| set.looseness)
    }

    /// Sets under their laws, most probable first.
    fn explanations(&self) -> Vec<Explanation> {
        let mut all: Vec<Explanation> = Vec::new();
        for (of, set) in self.sets.iter().enumerate().filter(|(_, set)| !set.members.is_empty()) {
            all.extend(set.ways.iter().map(|way| Explanation {
                causes: way.causes.clone(),
                probability: set.probability * way.probability,
                misfit: f64::NAN,
                level: set.looseness,
                is_writable: way.is_writable,
                kept_out: way.kept_out.clone(),
                of,
            }));
        }
        all.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        all.truncate(MOST_EXPLANATIONS);
        for e in all.iter_mut().take(SOLVED) {
            let members: Vec<(&Hypothesis, f64)> = e.causes.iter().map(|c| (&c.hypothesis, c.amplitude)).collect();
            let values = self.beside.predictor().predict(&members).ok();
            e.misfit = values.and_then(|values| e.misfit_of(self.beside, &self.sets[e.of].errors, &values)).unwrap_or(f64::NAN);
        }
        let Beside { problem, base, .. } = self.beside;
        if let Ok(attached) = Attached::new(&problem.study, &problem.data, &base.found.fields) {
            attached.write(all.iter_mut().flat_map(|e| &mut e.causes));
        }
        all
    }

    /// Causes of an explanation in force, as many of them as can be solved: a law that no file can say may have no machine.
    fn in_force(&self, causes: &[Cause], set: &'b PlaceSet, progress: &dyn Progress) -> Option<InForce<'b>> {
        let fitted = |causes: &[Cause]| InForce::fitted(self.beside, causes, &set.errors, set.looseness);
        let error = match fitted(causes) {
            Ok(found) => return found,
            Err(error) => error,
        };
        progress.say(&format!("the machine with the best explanation could not be solved: {error}"));
        let predictor = self.beside.predictor();
        let is_solved = |cause: &&Cause| predictor.predict(&[(&cause.hypothesis, cause.amplitude)]).is_ok();
        let solved: Vec<Cause> = causes.iter().filter(is_solved).cloned().collect();
        if solved.is_empty() || solved.len() == causes.len() { None } else { fitted(&solved).ok().flatten() }
    }
}

impl Weighed<'_> {
    /// The machine with causes in force, of all that an explanation has.
    fn rung(&self, found: InForce<'_>, all: &[Cause], kept_out: Option<&KeptOut>) -> Result<Rung> {
        let problem = self.beside.problem;
        let aside = &found.unpredicted()[..];
        // Predictions of other rows are of all causes together: of some of them there are none.
        let kept_out = kept_out.filter(|_| found.causes.len() == all.len());
        let predictor = self.beside.predictor();
        let mut is_chosen = Vec::with_capacity(found.causes.len());
        for cause in &found.causes {
            is_chosen.push(predictor.written(&[(&cause.hypothesis, cause.amplitude)])?.is_some());
        }
        let whole = vec![true; is_chosen.len()];
        if !is_chosen.contains(&true) {
            is_chosen.clone_from(&whole);
        }
        let gain_of = |is_chosen: &[bool]| kept_out.and_then(|kept_out| self.gain(kept_out, is_chosen, found.ranges(), aside));
        let mut gain = gain_of(&is_chosen);
        let is_known: Vec<bool> = found.causes.iter().map(|cause| cause.hypothesis.has_known_law(&self.beside.scales)).collect();
        let known: Vec<bool> = is_chosen.iter().zip(&is_known).map(|(is_chosen, is_known)| *is_chosen && *is_known).collect();
        if known != is_chosen && known.contains(&true) && !gain.as_ref().is_some_and(|(gain, _)| gain.low > 0.0) {
            // A cause that follows no known law is written where rows kept out are predicted better with it, for certain.
            is_chosen = known;
            gain = gain_of(&is_chosen);
        }
        let of_all = if is_chosen == whole { gain.clone() } else { gain_of(&whole) };
        let is_vetoed = of_all.is_some_and(|(gain, _)| gain.is_none());
        let has_laws = is_chosen.iter().zip(&is_known).all(|(is_chosen, is_known)| *is_known || !is_chosen);
        let drawn = if gain.as_ref().is_some_and(|(_, with_numbers)| *with_numbers) { found.drawn() } else { Vec::new() };
        let plain = found.predicted(&[])?;
        // They were drawn by slopes.
        let with = if drawn.is_empty() { None } else { found.predicted(&drawn).ok() };
        let with = with.filter(|with| square(with, problem, aside) < square(&plain, problem, aside));
        let refitted = if with.is_some() { drawn } else { Vec::new() };
        let predicted = with.unwrap_or(plain);
        // Numbers of the file first: a cause may take their place.
        let members: Vec<(&Hypothesis, f64)> = refitted.iter().chain(&found.causes).map(|c| (&c.hypothesis, c.amplitude)).collect();
        let chosen = found.causes.iter().zip(&is_chosen).filter(|(_, is_chosen)| **is_chosen).map(|(cause, _)| cause);
        let said: Vec<(&Hypothesis, f64)> = refitted.iter().chain(chosen.clone()).map(|c| (&c.hypothesis, c.amplitude)).collect();
        let left = all.iter().filter(|own| chosen.clone().all(|c| c.hypothesis != own.hypothesis));
        let (mut sets, mut left_out) = self.written(&said, left.map(|c| c.hypothesis.kind_and_place()).collect(), aside)?;
        if left_out.as_ref().is_some_and(|own| own.causes.len() >= all.len()) {
            // Numbers that were drawn beside causes are none without any of these.
            (sets, left_out) = (None, None);
        }
        let before = square(&self.predicted(), problem, aside).max(f64::MIN_POSITIVE);
        let share = |values: &[f64]| 1.0 - square(values, problem, aside) / before;
        let alone = match found.causes.len() {
            0 | 1 => Vec::new(),
            _ => found.each_alone().iter().map(|values| share(values)).collect(),
        };
        let (rms, where_left) = left_by(problem, &predicted, aside);
        let left = found.looseness();
        let misfit = found.misfit();
        let freedom = problem.data.count().saturating_sub(found.causes.len()).max(1);
        Ok(Rung {
            share: share(&predicted),
            alone,
            rms,
            where_left,
            left,
            probability_left: chi_square_tail(misfit, freedom),
            correlations: found.correlations(&refitted),
            off_in_full: self.off_in_full(&members),
            gain: gain.map(|(gain, _)| gain),
            is_vetoed,
            has_laws,
            causes: found.causes,
            refitted,
            sets,
            left_out,
            predicted,
        })
    }

    /// Lines of a machine file for those of some members that it has words for, and all that they leave out beside causes of these names.
    fn written(
        &self,
        members: &[(&Hypothesis, f64)],
        mut causes: Vec<String>,
        aside: &[usize],
    ) -> Result<(Option<Lines>, Option<LeftOut>)> {
        let predictor = self.beside.predictor();
        let mut said = Vec::new();
        for member in members {
            match predictor.written(&[*member])? {
                Some(_) => said.push(*member),
                None => causes.push(member.0.kind_and_place()),
            }
        }
        let sets = predictor.written(&said)?;
        if causes.is_empty() || said.is_empty() {
            return Ok((sets.filter(|_| !said.is_empty()), None));
        }
        let (problem, before) = (self.beside.problem, self.predicted());
        let values: Vec<f64> = predictor.predict(&said)?.iter().zip(&self.beside.base.mesh).map(|(v, m)| v + m).collect();
        if square(&values, problem, aside) >= square(&before, problem, aside) {
            return Ok((None, None));
        }
        let (rms, _) = left_by(problem, &values, aside);
        Ok((sets, Some(LeftOut { causes, rms })))
    }

    /// Predictions of the machine as it is on an endlessly fine mesh, K.
    fn predicted(&self) -> Vec<f64> {
        let base = &self.beside.base;
        base.found.prediction.values.iter().zip(&base.mesh).map(|(v, m)| v + m).collect()
    }

    /// The machine as the readings draw its numbers, with no cause, where that predicts rows kept out better for certain and the file
    /// misses them by more than their noise does: more than half of the squared error is the model's.
    fn calibrated(&self) -> Result<Option<Rung>> {
        let Some(empty) = self.empty() else { return Ok(None) };
        let Some(found) = InForce::fitted(self.beside, &[], &empty.errors, empty.looseness)? else { return Ok(None) };
        let rung = Some(self.rung(found, &[], empty.ways.first().and_then(|way| way.kept_out.as_deref()))?);
        let is_worth = |gain: &Gain| gain.low > 0.0 && gain.before.powi(2) > 2.0 * gain.noise_floor.powi(2);
        Ok(rung.filter(|rung| !rung.refitted.is_empty() && rung.gain.as_ref().is_some_and(is_worth)))
    }

    /// The gain where nothing is added to the machine.
    fn without_gain(&self) -> Option<Gain> {
        let empty = self.empty()?;
        let rows = Rows::under(&empty.errors, empty.looseness)?;
        let Beside { problem, base, .. } = self.beside;
        gain(problem, base, &rows.ranges, &vec![0.0; base.found.residual.len()], &empty.errors.unpredicted())
    }

    /// The gain of some causes with numbers of the file as the readings draw them or as the file has them, whichever predicts better, and whether
    /// it is with them.
    fn gain(&self, kept_out: &KeptOut, is_chosen: &[bool], rows: &[Range<usize>], aside: &[usize]) -> Option<(Gain, bool)> {
        let Beside { problem, base, .. } = self.beside;
        let by_causes = kept_out.by(is_chosen);
        let of = |change: &[f64]| gain(problem, base, rows, change, aside);
        let plain = of(&by_causes)?;
        let with_numbers = |own: &Vec<f64>| of(&by_causes.iter().zip(own).map(|(a, b)| a + b).collect::<Vec<f64>>());
        let drawn = kept_out.by_numbers.as_ref().and_then(with_numbers).filter(|drawn| drawn.after < plain.after);
        Some(drawn.map_or((plain, false), |drawn| (drawn, true)))
    }

    /// Difference of predictions on the reduced model from those of full solves, K.
    fn off_in_full(&self, members: &[(&Hypothesis, f64)]) -> Option<f64> {
        let problem = self.beside.problem;
        if problem.study.tables != StateTables::Reduced || problem.data.is_transient() {
            return None;
        }
        let predictor = self.beside.predictor();
        let reduced = predictor.without_sensors(members);
        Some(reduced.map_or(f64::INFINITY, |values| predictor.off_in_full(members, &values)))
    }

    /// Whether a model leaves more open than models of careful machine files do, for certain, or a misfit beside it (a sum of squares) is no
    /// noise.
    fn is_unusual(&self, set: &PlaceSet, misfit: f64) -> bool {
        let settings = &self.beside.problem.settings;
        let freedom = self.misfit.freedom.saturating_sub(set.members.len()).max(1);
        set.lead_over_usual > (settings.certain / (1.0 - settings.certain)).ln() || chi_square_tail(misfit, freedom) < settings.alarm
    }

    /// The verdict.
    fn answer(&self, explanations: &[Explanation], rung: Option<&Rung>) -> Answer {
        let settings = &self.beside.problem.settings;
        let nothing = self.nothing();
        let answer = |verdict, level| Answer { verdict, level, set: decide::set(explanations, settings), something_else: 0.0 };
        // An alarm is given as a cause is named: where it is certain.
        let Some(best) = explanations.first().filter(|_| nothing <= 1.0 - settings.certain) else {
            let is_open = self.empty().and_then(|empty| {
                let rows = Rows::under(&empty.errors, empty.looseness)?;
                let mut left = self.beside.base.found.residual.clone();
                empty.errors.aside.iter().for_each(|i| left[*i] = 0.0);
                Some(self.is_unusual(empty, rows.metric(empty.looseness).square(&left)))
            });
            let is_open = is_open.unwrap_or(true);
            let level = decide::Level::nothing(nothing);
            return match is_open {
                true => Answer { something_else: nothing, ..answer(Verdict::SomethingElse, level) },
                false => Answer { set: Vec::new(), ..answer(Verdict::Consistent, level) },
            };
        };
        let is_small = rung.is_some_and(|rung| rung.share < settings.least_share);
        if is_small && self.is_unusual(&self.sets[best.of], best.misfit) {
            return answer(Verdict::SomethingElse, decide::region(explanations, 0.0));
        }
        // As many numbers as readings fit anything: the prior alone would choose.
        let is_judged = self.misfit.freedom > best.causes.len();
        let level = if is_judged { decide::ladder(explanations, settings) } else { decide::region(explanations, settings.certain) };
        answer(if level.certainty.names_the_cause() { Verdict::Explained } else { Verdict::CannotTell }, level)
    }
}

fn residuals(beside: &Beside<'_>) -> Residuals {
    let base = &beside.base;
    Residuals {
        predicted: base.found.prediction.values.iter().zip(&base.mesh).map(|(v, m)| v + m).collect(),
        whitened: base.whitener.apply(&base.found.residual),
        deviation: base.errors.marginal(&DiscrepancySize::NONE),
        residual: base.found.residual.clone(),
    }
}

/// Sum of the squares of what predictions (K) leave of the readings that are not set aside, K².
fn square(predicted: &[f64], problem: &Problem, aside: &[usize]) -> f64 {
    let readings = whiten::readings(&problem.data);
    let left = readings.iter().zip(predicted).enumerate().filter(|(i, _)| !aside.contains(i));
    left.map(|(_, (r, p))| (r - p).powi(2)).sum()
}

/// Root mean square of what predictions (K) leave of the readings, K, and the sensor that most of it belongs to.
fn left_by(problem: &Problem, predicted: &[f64], aside: &[usize]) -> (f64, Option<WhereLeft>) {
    let mut left: Vec<f64> = whiten::readings(&problem.data).iter().zip(predicted).map(|(r, p)| r - p).collect();
    aside.iter().for_each(|i| left[*i] = 0.0);
    let square = sum_of_squares(&left);
    let places = whiten::places(&problem.data);
    let of_sensor = |k: usize| left.iter().zip(&places).filter(|(_, (_, s))| *s == k).map(|(v, _)| v * v).sum::<f64>();
    let most = (0..problem.data.names.len()).max_by(|a, b| of_sensor(*a).total_cmp(&of_sensor(*b)));
    let share = |k: usize| WhereLeft { sensor: problem.data.names[k].clone(), share: of_sensor(k) / square.max(f64::MIN_POSITIVE) };
    ((square / left.len().saturating_sub(aside.len()).max(1) as f64).sqrt(), most.map(share))
}
