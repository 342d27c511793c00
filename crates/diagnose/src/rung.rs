//! One rung of the ladder: a machine against the data, its best explanation, and what that gains.

use super::attached::Attached;
use super::calibrated::{Calibrated, calibrated};
use super::effects::{Hypothesis, Scales, hypotheses};
use super::extension::{Extension, extension, gained};
use super::faults::beside_causes;
use super::finalists::{Entry, Finalists, Outcome};
use super::gain::KeptOut;
use super::inexact::Inexact;
use super::joint::Joint;
use super::numbers::{self, Settled};
use super::predictor::{KnownSlopes, Predictor};
use super::probability::Ground;
use super::refine::Fitted;
use super::screen::Screened;
use super::shared::{self, Shared};
use super::view::{Comparison, square};
use super::{
    Cause, Diagnosis, Explanation, Gain, MOST_EXPLANATIONS, Others, Problem, Residuals, Tried, Verdict, decide, history, missing, next,
    overstated, probability, rarer, synonyms,
};
use coldplate_base::error::Result;
use coldplate_base::progress::Progress;
use coldplate_evidence::discrepancy::DiscrepancySize;
use coldplate_evidence::identify::chi_square_tail;
use coldplate_evidence::measurement::whiten;
use coldplate_solve::study::StateTables;

/// Explanations whose law has a number that is fitted, one after another.
const MOST_SETTLED: usize = 3;
/// A number of the file is a cause itself where it moved by more than so many of its prior's standard deviations, and of its own.
const PULLED: f64 = 3.0;
const FOR_CERTAIN: f64 = 5.5;

/// One step of the ladder.
#[derive(Debug, Clone)]
pub struct Rung {
    /// What is named on it: one cause, or two together, and numbers of the file beside them that are pulled too far to be inexact. Nothing
    /// where nothing is named, and numbers of the file as the readings draw them predict data kept out better for certain.
    pub causes: Vec<Cause>,
    /// Numbers of the file that were fitted beside it, with how far they moved.
    pub refitted: Vec<Cause>,
    /// Correlations of the causes, and behind them of these numbers; none where nothing was fitted beside the causes.
    pub correlations: Vec<Vec<f64>>,
    /// Root mean square residual with it in force, K.
    pub rms: f64,
    /// Share of the squared residual of the machine as it was given that is explained up to here.
    pub share: f64,
    /// The same of each cause by itself, in the order of the causes, where there are two on the first rung.
    pub alone: Vec<f64>,
    /// The discrepancy that is left.
    pub left: DiscrepancySize,
    /// Probability of a misfit as large as is left, beside that discrepancy.
    pub probability_left: f64,
    /// Probability that pure noise lets some other cause take away as much of what is left as the best one does.
    pub look_beside: f64,
    /// Where most of what is left is.
    pub where_left: Option<WhereLeft>,
    /// What it gains on data its selection has not seen.
    pub gain: Option<Gain>,
    /// Lines of the machine file, on top of those of the rungs below.
    pub sets: Vec<(String, String)>,
    /// Predictions with it in force, K.
    pub predicted: Vec<f64>,
}

/// The sensor that most of what is left belongs to.
#[derive(Debug, Clone, PartialEq)]
pub struct WhereLeft {
    /// Its name.
    pub sensor: String,
    /// Its share of the squared residual.
    pub share: f64,
}

/// The machine of a problem against its data.
///
/// # Errors
/// The machine as it is cannot be solved at the data's conditions.
pub(super) fn once(problem: &Problem, progress: &dyn Progress) -> Result<Diagnosis> {
    let (study, data) = (&problem.study, &problem.data);
    let scales = Scales::of(data, &study.model.machine);
    let mut catalogue = hypotheses(study, data, &problem.user);
    catalogue.retain(|h| !problem.without.iter().any(|kind| kind == h.kind()));
    progress.say(&format!("{} readings: slopes of every cause", data.count()));
    let mut base = Comparison::of(problem, study, &catalogue, &scales)?;
    let mut screened = base.screen(&catalogue, data);
    let misfit = decide::misfit_of(&screened, problem.seed);
    if let Some(share) = overstated::share(problem, &base, &base.found.residual, 0) {
        return once(&problem.with_noise(share, progress), progress);
    }
    let is_wrong = decide::is_wrong(&misfit);
    if is_wrong {
        progress.say("causes that act at some times or in some tests only, and powers");
        if let Err(e) = rarer::add(problem, &mut base, &mut catalogue, &scales) {
            progress.say(&format!("they could not be looked for: {e}"));
        }
        screened = base.screen(&catalogue, data);
    }
    let tried = Tried { all: catalogue.len(), visible: screened.visible.len() };
    progress.say(&tried.sentence());
    let prior = probability::prior(&screened, &catalogue);
    let predictor = Predictor {
        study,
        data,
        predicted: &base.found.prediction.values,
        fields: &base.found.fields,
        runs: problem.runs(),
        scales: &scales,
        user: &problem.user,
        fronts: history::has_fronts(study, data)?,
        slopes: KnownSlopes { catalogue: &catalogue, columns: &base.found.columns },
    };
    let (unexplained, usual) = if is_wrong { levels(&base) } else { (DiscrepancySize::NONE, DiscrepancySize::NONE) };
    let ground = Ground { usual: base.ground(&usual), any: base.ground(&unexplained), screen: base.ground(&base.level) };
    let posterior = probability::posterior(&screened, &prior, &ground, !data.is_transient());
    let finals = Finalists {
        problem,
        predictor: &predictor,
        catalogue: &catalogue,
        base: &base,
        screened: &screened,
        prior: &prior,
        ground,
        unexplained,
        places: whiten::places(data),
    };
    let mut outcome = match is_wrong {
        true => finals.fit(posterior, progress),
        false => finals.unfitted(posterior),
    };
    let (mut settled, mut prior_of_settled) = (catalogue.clone(), prior.clone());
    let mut done: Vec<Vec<usize>> = Vec::new();
    for _ in 0..MOST_SETTLED {
        let now = Finalists { catalogue: &settled, prior: &prior_of_settled, ..finals.clone() };
        let Some(members) = numbers::next(&now, &outcome, &done) else { break };
        match numbers::settle(&now, &outcome, &members).unwrap_or(None) {
            Some(Settled::Named { members }) => outcome = outcome.without(&members),
            Some(Settled::At { cause, hypothesis, entry }) => {
                settled[screened.visible[cause]] = *hypothesis;
                prior_of_settled = probability::prior(&screened, &settled);
                outcome = outcome.with(*entry);
                Finalists { catalogue: &settled, prior: &prior_of_settled, ..finals.clone() }.weigh(&mut outcome);
            }
            None => {}
        }
        done.push(members);
    }
    let finals = Finalists { catalogue: &settled, prior: &prior_of_settled, ..finals };
    outcome = synonyms::merged(&finals, outcome);
    let scatter = |(members, fitted): &Entry| overstated::share(problem, &outcome.view, &outcome.view.left(&fitted.values), members.len());
    if let Some(share) = outcome.leading().and_then(scatter) {
        return once(&problem.with_noise(share, progress), progress);
    }
    let answered = |outcome: &Outcome| -> Result<Answered> {
        let explanations = finals.explanations(outcome, &outcome.posterior, MOST_EXPLANATIONS);
        let mut answer = decide::decide(&misfit, &outcome.posterior, &explanations, usual != DiscrepancySize::NONE);
        if let Some(best) = explanations.first().filter(|e| e.level != DiscrepancySize::NONE && answer.verdict != Verdict::Consistent) {
            // The alarm must hold beside the discrepancy that the cause is named with.
            let at_its_level = decide::misfit_of(&finals.screened_by(&base.at(best.level)), problem.seed);
            answer = answer.beside(&at_its_level, base.errors.is_usual(&unexplained));
        }
        let mut unexplained = unexplained;
        if let Some(best) = explanations.first().filter(|_| answer.verdict != Verdict::Consistent && !data.is_transient()) {
            let Inexact { posterior, level } = finals.where_numbers_are_off(outcome)?;
            if posterior.nothing > 0.5 {
                (answer, unexplained) = (answer.by_numbers(posterior.nothing), level);
            } else if answer.verdict == Verdict::Explained {
                answer = answer.beside_numbers(best, &finals.explanations(outcome, &posterior, MOST_EXPLANATIONS));
            }
        }
        let extension = extension(&finals, outcome, explanations.first().filter(|_| answer.names_causes()), progress);
        Ok(Answered { explanations, answer, unexplained, extension })
    };
    let mut found = answered(&outcome)?;
    if data.is_transient() && found.names_two() {
        // Numbers of logs are many, and two causes follow what the days have in common with neither. One of them alone must not do better
        // on what was kept out; what the other is worth beside it shows on the next rung.
        let singles = outcome.clone().singles();
        let alone = answered(&singles)?;
        if alone.predicts_better(&found) {
            (outcome, found) = (singles, alone);
        }
    }
    let Answered { mut explanations, answer, unexplained, extension: Extension { joint, gain } } = found;
    let started_from = residuals(&base, &screened);
    let explained = |predicted: &[f64]| 1.0 - square(predicted, problem) / square(&started_from.predicted, problem).max(1e-300);
    let share = outcome.leading_predictions().map_or(0.0, |values| explained(&values));
    let by_itself = || joint.as_ref().and_then(|_| gained(&finals, &outcome, explanations.first(), None, KeptOut::Tests));
    let answer = answer.vetoed((&explanations, &base.errors), gain.as_ref(), by_itself, share);
    if let Some(best) = explanations.first_mut() {
        if let Some(joint) = &joint {
            best.causes.clone_from(&joint.causes);
        }
        let scatter = gain.iter().flat_map(|gain| &gain.scatter);
        best.causes.iter_mut().zip(scatter).for_each(|(cause, scatter)| cause.at_least(*scatter));
    }
    let all = explanations.iter_mut().flat_map(|e| e.causes.iter_mut().chain(e.synonyms.iter_mut().map(|s| &mut s.cause)));
    if !data.is_transient() {
        Attached::new(study, data, &base.found.fields)?.write(all);
    }
    let rung = match explanations.first().filter(|_| answer.extends_the_machine(gain.as_ref(), data.is_transient())) {
        Some(best) => {
            let shared = drawn(&finals, &outcome, joint.as_ref());
            rung(problem, &predictor, best, (joint.as_ref(), &shared), &outcome, gain.clone())?
        }
        None => None,
    };
    let rung = rung.map(|rung| {
        let alone = alone(&predictor, &rung, &outcome.view.mesh).iter().map(|values| explained(values)).collect();
        Rung { share: explained(&rung.predicted), look_beside: finals.look_beside(&outcome), alone, ..rung }
    });
    // A machine that misses the very data by more than the one that it came from is no finding either.
    let misses = rung.as_ref().is_some_and(|rung| rung.share <= 0.0);
    let (rung, answer) = if misses { (None, answer.withdrawn()) } else { (rung, answer) };
    let is_vetoed = answer.verdict == Verdict::CannotTell && decide::predicts_worse(gain.as_ref());
    let drawn = if !answer.extends_the_machine(gain.as_ref(), data.is_transient()) && !misses { calibrated(&finals, usual) } else { None };
    let (rung, gain) = match &drawn {
        Some(found) => {
            let rung = of_numbers(problem, &predictor, &base, found, usual)?;
            (rung.map(|rung| Rung { share: explained(&rung.predicted), ..rung }), Some(found.gain.clone()))
        }
        None => (rung, gain),
    };
    let off_in_full = (study.tables == StateTables::Reduced && !data.is_transient()).then(|| {
        progress.say("the end result in full");
        let named = explanations.first().filter(|_| answer.names_causes());
        match (named, &joint, outcome.leading()) {
            (Some(_), Some(Joint { members, fitted: Fitted { origin, .. }, .. }), _) => {
                let members: Vec<_> = members.iter().zip(origin.amplitudes.iter().copied()).collect();
                predictor.off_in_full(&members, &origin.machine)
            }
            (Some(best), None, Some((_, Fitted { origin, .. }))) => {
                let members: Vec<_> = best.causes.iter().map(|c| &c.hypothesis).zip(origin.amplitudes.iter().copied()).collect();
                predictor.off_in_full(&members, &origin.machine)
            }
            _ => match &drawn {
                Some(found) => predictor.off_in_full(&found.members(), &found.values),
                None => predictor.off_in_full(&[], &base.found.prediction.values),
            },
        }
    });
    let leaves_much = || outcome.fitted.is_empty() || finals.leaves_much(&outcome);
    let aside = if problem.may_set_aside && answer.verdict != Verdict::Consistent && leaves_much() {
        progress.say("readings and rows without which causes explain the rest");
        beside_causes::aside(problem, &base, &screened)
    } else {
        Vec::new()
    };
    let next = if matches!(answer.verdict, Verdict::CannotTell | Verdict::SomethingElse) {
        progress.say("what to measure next");
        let open: Vec<&Explanation> = answer.set.iter().map(|i| &explanations[*i]).collect();
        next::next(&predictor, problem, answer.verdict, &open)?
    } else {
        Vec::new()
    };
    Ok(Diagnosis {
        misfit,
        verdict: answer.verdict,
        certainties: if answer.names_causes() { decide::certainties(&explanations) } else { Vec::new() },
        level: answer.level,
        others: Others { nothing: outcome.posterior.nothing, something_else: outcome.posterior.something_else },
        set: answer.set,
        tried,
        residuals: started_from,
        explained: rung.as_ref().map(|rung| rung.predicted.clone()),
        gain,
        next,
        missing: missing::missing(&screened, &catalogue),
        sets: rung.as_ref().map(|rung| rung.sets.clone()),
        is_open_by_numbers: answer.is_open_by_numbers,
        rungs: rung.into_iter().collect(),
        noise_share: problem.noise_share,
        unexplained,
        misses,
        is_vetoed,
        explanations,
        aside,
        whitener: base.whitener,
        off_in_full,
        seconds: 0.0,
    })
}

/// What an outcome comes to.
struct Answered {
    explanations: Vec<Explanation>,
    answer: decide::Answer,
    /// The discrepancy of the machine as it is.
    unexplained: DiscrepancySize,
    extension: Extension,
}

impl Answered {
    fn names_two(&self) -> bool {
        self.answer.names_causes() && self.explanations.first().is_some_and(|best| best.causes.len() == 2)
    }

    /// Whether causes are named that predict data kept out better than another answer's do.
    fn predicts_better(&self, other: &Self) -> bool {
        let after = |found: &Self| found.extension.gain.as_ref().map(|gain| gain.after);
        self.answer.names_causes() && after(self).zip(after(other)).is_some_and(|(own, other)| own < other)
    }
}

/// The level of discrepancy that suits the machine as it is best, and the best of usual ones.
fn levels(base: &Comparison) -> (DiscrepancySize, DiscrepancySize) {
    let residual = &base.found.residual;
    let any = base.errors.learn(residual, &[], DiscrepancySize::NONE, None);
    let usual = if base.errors.is_usual(&any) { any } else { base.errors.learn_usual(residual) };
    (any, usual)
}

fn residuals(base: &Comparison, screened: &Screened) -> Residuals {
    Residuals {
        predicted: base.found.prediction.values.iter().zip(&base.mesh).map(|(v, m)| v + m).collect(),
        whitened: screened.residual.clone(),
        deviation: base.errors.marginal(&base.level),
        residual: base.found.residual.clone(),
    }
}

/// What the best explanation comes to, with the common factors that it draws; `None` where the machine file has no words for it.
fn rung(
    problem: &Problem,
    predictor: &Predictor<'_>,
    best: &Explanation,
    (joint, shared): (Option<&Joint>, &Shared),
    outcome: &Outcome,
    gain: Option<Gain>,
) -> Result<Option<Rung>> {
    let Split { causes, mut refitted, order } = split(problem, best, joint);
    let correlations_of = |all: &[Vec<f64>]| -> Vec<Vec<f64>> {
        let kept = joint.map_or_else(|| all.to_vec(), |joint| joint.among_kept(all));
        let order: Vec<usize> = order.iter().copied().chain(order.len()..kept.len()).collect();
        order.iter().map(|i| order.iter().map(|j| kept[*i][*j]).collect()).collect()
    };
    let mut correlations = joint.map_or_else(Vec::new, |joint| correlations_of(&joint.fitted.correlations));
    let with_mesh = |values: &[f64]| -> Vec<f64> { values.iter().zip(&outcome.view.mesh).map(|(v, m)| v + m).collect() };
    let mut predicted = match joint {
        Some(joint) => with_mesh(&joint.fitted.values),
        None => outcome.leading_predictions().unwrap_or_default(),
    };
    if !shared.factors.is_empty() {
        let all = refitted.iter().chain(&shared.factors).chain(&causes);
        let members: Vec<(&Hypothesis, f64)> = all.map(|c| (&c.hypothesis, c.amplitude)).collect();
        // They were drawn by slopes.
        let with = predictor.predict(&members).map(|values| with_mesh(&values)).ok();
        let with = with.filter(|with| square(with, problem) < square(&predicted, problem));
        if let (Ok(Some(_)), Some(with)) = (predictor.written(&members), with) {
            predicted = with;
            refitted.extend(shared.factors.iter().cloned());
            correlations = correlations_of(&shared.correlations);
        }
    }
    // Numbers of the file first: a cause may take their place.
    let members: Vec<(&Hypothesis, f64)> = refitted.iter().chain(&causes).map(|c| (&c.hypothesis, c.amplitude)).collect();
    let Some(sets) = predictor.written(&members)? else { return Ok(None) };
    let (rms, where_left) = left_by(problem, &predicted);
    let named = causes.len();
    Ok(Some(Rung {
        causes,
        refitted,
        correlations,
        rms,
        share: 0.0,
        alone: Vec::new(),
        left: joint.map_or(best.level, |joint| joint.fitted.level),
        probability_left: chi_square_tail(best.misfit, problem.data.count().saturating_sub(named).max(1)),
        look_beside: 1.0,
        where_left,
        gain,
        sets,
        predicted,
    }))
}

/// Root mean square of what predictions (K) leave of the readings, K, and the sensor that most of it belongs to.
fn left_by(problem: &Problem, predicted: &[f64]) -> (f64, Option<WhereLeft>) {
    let left: Vec<f64> = whiten::readings(&problem.data).iter().zip(predicted).map(|(r, p)| r - p).collect();
    let square = left.iter().map(|v| v * v).sum::<f64>();
    let places = whiten::places(&problem.data);
    let of_sensor = |k: usize| left.iter().zip(&places).filter(|(_, (_, s))| *s == k).map(|(v, _)| v * v).sum::<f64>();
    let most = (0..problem.data.names.len()).max_by(|a, b| of_sensor(*a).total_cmp(&of_sensor(*b)));
    let share = |k: usize| WhereLeft { sensor: problem.data.names[k].clone(), share: of_sensor(k) / square.max(1e-300) };
    ((square / left.len().max(1) as f64).sqrt(), most.map(share))
}

/// What the machine as the readings draw it comes to, with no cause.
fn of_numbers(
    problem: &Problem,
    predictor: &Predictor<'_>,
    base: &Comparison,
    found: &Calibrated,
    left: DiscrepancySize,
) -> Result<Option<Rung>> {
    let Some(sets) = predictor.written(&found.members())? else { return Ok(None) };
    let predicted: Vec<f64> = found.values.iter().zip(&base.mesh).map(|(v, m)| v + m).collect();
    let (rms, where_left) = left_by(problem, &predicted);
    Ok(Some(Rung {
        causes: Vec::new(),
        refitted: found.numbers.clone(),
        correlations: found.correlations.clone(),
        rms,
        share: 0.0,
        alone: Vec::new(),
        left,
        probability_left: 1.0,
        look_beside: 1.0,
        where_left,
        gain: Some(found.gain.clone()),
        sets,
        predicted,
    }))
}

/// The common factors that the residual draws beside what is named and fitted with it. In a log numbers that nobody called uncertain take
/// their place.
fn drawn(finals: &Finalists<'_>, outcome: &Outcome, joint: Option<&Joint>) -> Shared {
    let all: Vec<usize> = (0..outcome.view.readings.len()).collect();
    match (joint, outcome.leading()) {
        (Some(joint), _) if joint.takes_factors_place(finals) => Shared::default(),
        (Some(joint), _) => {
            let members: Vec<&Hypothesis> = joint.members.iter().collect();
            shared::shared(finals, &members, &joint.fitted, &joint.whitener(&all), &outcome.view)
        }
        (None, Some((members, best))) => {
            let causes: Vec<&Hypothesis> = members.iter().map(|j| finals.of(*j)).collect();
            shared::shared(finals, &causes, best, &outcome.view.errors.whitener(&best.level, &all), &outcome.view)
        }
        (None, None) => Shared::default(),
    }
}

/// Causes of a rung, numbers refitted beside them, and where each of them stands among those of a fit.
struct Split {
    causes: Vec<Cause>,
    refitted: Vec<Cause>,
    order: Vec<usize>,
}

/// A number of the file that is pulled far beyond what files are off by, and for certain, is a cause itself.
fn split(problem: &Problem, best: &Explanation, joint: Option<&Joint>) -> Split {
    let Some(joint) = joint else {
        return Split { causes: best.causes.clone(), refitted: Vec::new(), order: (0..best.causes.len()).collect() };
    };
    let network = &problem.study.model.network;
    let is_cause = |c: &Cause| {
        c.hypothesis.of_a_number(network).is_some()
            && c.amplitude.abs() > PULLED * c.hypothesis.scale
            && c.amplitude.abs() > FOR_CERTAIN * c.deviation
    };
    let own = best.causes.len();
    let (pulled, others): (Vec<usize>, Vec<usize>) = (0..joint.others.len()).partition(|k| is_cause(&joint.others[*k]));
    let order: Vec<usize> = (0..own).chain(pulled.iter().chain(&others).map(|k| own + k)).collect();
    let of = |which: &[usize]| which.iter().map(|k| joint.others[*k].clone()).collect::<Vec<_>>();
    Split { causes: best.causes.iter().cloned().chain(of(&pulled)).collect(), refitted: of(&others), order }
}

/// Predictions with each of two causes by itself in force, K; none where the machine cannot be solved so.
fn alone(predictor: &Predictor<'_>, rung: &Rung, mesh: &[f64]) -> Vec<Vec<f64>> {
    let with = |cause: &Cause| -> Option<Vec<f64>> {
        let values = predictor.predict(&[(&cause.hypothesis, cause.amplitude)]).ok()?;
        Some(values.iter().zip(mesh).map(|(v, m)| v + m).collect())
    };
    match rung.causes.as_slice() {
        [_, _] => rung.causes.iter().map(with).collect::<Option<_>>().unwrap_or_default(),
        _ => Vec::new(),
    }
}
