//! One rung of the ladder: a machine against the data, its best explanation, and what that gains.

use super::effects::{Hypothesis, Scales, hypotheses};
use super::finalists::{Finalists, Outcome};
use super::gain::KeptOut;
use super::joint::{Joint, joint};
use super::probability::Ground;
use super::refine::Predictor;
use super::screen::Screened;
use super::view::Comparison;
use super::{
    Cause, Diagnosis, Explanation, Gain, MOST_EXPLANATIONS, Others, Problem, Residuals, Tried, Verdict, advice, decide, gain, history,
    missing, probability,
};
use crate::error::Result;
use crate::evidence::discrepancy::Level;
use crate::evidence::identify::chi_square_tail;
use crate::evidence::measurement::whiten;
use crate::foundation::progress::Progress;

/// One step of the ladder.
#[derive(Debug, Clone)]
pub struct Rung {
    /// What is named on it: one cause, or two together.
    pub causes: Vec<Cause>,
    /// Numbers of the file that were fitted beside it, with how far they moved.
    pub refitted: Vec<Cause>,
    /// Root mean square residual with it in force, K.
    pub rms: f64,
    /// Share of the squared residual of the machine as it was given that is explained up to here.
    pub share: f64,
    /// The discrepancy that is left.
    pub left: Level,
    /// Probability of a misfit as large as is left, beside that discrepancy.
    pub probability_left: f64,
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

/// An explanation that takes less of the squared residual than this, leaves more than models usually do, and for certain gains nothing
/// on unseen data, is none.
const LEAST_SHARE: f64 = 0.5;

/// The machine of a problem against its data.
///
/// # Errors
/// The machine as it is cannot be solved at the data's conditions.
pub(super) fn once(problem: &Problem, progress: &dyn Progress) -> Result<Diagnosis> {
    let (study, data) = (&problem.study, &problem.data);
    let scales = Scales::of(data, &study.model.machine);
    let mut catalogue = hypotheses(study, data, &problem.user);
    catalogue.retain(|h| !problem.without.iter().any(|kind| kind == h.kind()));
    progress.say(&format!("{} readings, {} causes that could act", data.count(), catalogue.len()));
    let base = Comparison::of(problem, study, &catalogue, &scales)?;
    let screened = base.screen(&catalogue, data);
    let misfit = decide::misfit_of(&screened, problem.seed);
    let prior = probability::prior(&screened, &catalogue);
    let predictor = Predictor {
        study,
        data,
        predicted: &base.found.prediction.values,
        fields: &base.found.fields,
        start: problem.start,
        scales: &scales,
        user: &problem.user,
        fronts: history::has_fronts(study, data)?,
    };
    let is_wrong = decide::is_wrong(&misfit);
    let (unexplained, usual) = if is_wrong { levels(&base) } else { (Level::NONE, Level::NONE) };
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
    let outcome = match is_wrong {
        true => finals.fit(posterior, progress)?,
        false => Outcome { posterior, fitted: Vec::new(), screened: screened.clone(), view: base.clone(), ground },
    };
    let mut explanations = finals.explanations(&outcome, MOST_EXPLANATIONS);
    let share = |predicted: &[f64]| 1.0 - square(predicted, problem) / square(&residuals(&base, &screened).predicted, problem).max(1e-300);
    let explained = outcome.leading_predictions().map_or(0.0, |values| share(&values));
    let posterior = &outcome.posterior;
    let (mut verdict, mut level, set) = decide::decide(&misfit, posterior, &explanations, usual != Level::NONE);
    if let Some(best) = explanations.first().filter(|e| e.level != Level::NONE && verdict != Verdict::Consistent) {
        // The alarm must hold beside the discrepancy that the cause is named with.
        let at_its_level = decide::misfit_of(&finals.screened_by(&base.at(best.level)), problem.seed);
        if at_its_level.look_elsewhere >= decide::ALARM_CAUSE {
            verdict = if unexplained.is_usual() { Verdict::Consistent } else { Verdict::SomethingElse };
        }
    }
    let is_named = matches!(verdict, Verdict::Explained | Verdict::CannotTell);
    let entry = outcome.leading().filter(|_| is_named);
    let joint = match entry {
        Some(entry) => joint(&finals, entry, &outcome.view).ok().flatten(),
        None => None,
    };
    if let (Some(joint), Some(best)) = (&joint, explanations.first_mut()) {
        best.causes.clone_from(&joint.causes);
    }
    progress.say("gain on conditions kept out");
    let named = explanations.first().filter(|_| is_named);
    let named = named.map(|explanation| gain::Named { explanation, joint: joint.as_ref(), view: &outcome.view });
    let of = |kept_out| gain::gain(problem, &predictor, &catalogue, &base, named, kept_out);
    let gain = match of(KeptOut::Tests) {
        // What shows in one test only cannot be found without it: there, parts of tests are kept out.
        Some(gain) if named.is_some() && data.is_transient() && gain.after >= gain.before => of(KeptOut::Blocks),
        gain => gain,
    };
    if is_named && gain.as_ref().is_some_and(|gain| gain.after >= gain.before) {
        // A cause that predicts what it has not seen no better is no finding.
        (verdict, level) = (Verdict::CannotTell, decide::Level::nothing(level.probability));
    }
    let is_gain = gain.as_ref().is_some_and(|gain| gain.low > 0.0);
    if is_named && !is_gain && explained < LEAST_SHARE && explanations.first().is_some_and(|e| !e.level.is_usual()) {
        (verdict, level) = (Verdict::SomethingElse, decide::region(&explanations, 0.0));
    }
    let is_vetoed = verdict == Verdict::SomethingElse || gain.as_ref().is_some_and(|gain| is_named && gain.after >= gain.before);
    let rung = match explanations.first().filter(|_| is_named && !is_vetoed) {
        Some(best) => rung(problem, &predictor, best, joint.as_ref(), &outcome, gain.clone())?,
        None => None,
    };
    let rung = rung.map(|rung| Rung { share: share(&rung.predicted), ..rung });
    let next = if verdict == Verdict::CannotTell || verdict == Verdict::SomethingElse {
        progress.say("what to measure next");
        advice::next(&predictor, problem, verdict, &set.iter().map(|i| &explanations[*i]).collect::<Vec<_>>())?
    } else {
        Vec::new()
    };
    Ok(Diagnosis {
        misfit,
        verdict,
        level,
        others: Others { nothing: posterior.nothing, something_else: posterior.something_else },
        set,
        tried: Tried { all: catalogue.len(), visible: screened.visible.len() },
        residuals: residuals(&base, &screened),
        explained: rung.as_ref().map(|rung| rung.predicted.clone()),
        gain,
        next,
        missing: missing::missing(&screened, &catalogue),
        sets: rung.as_ref().map(|rung| rung.sets.clone()),
        rungs: rung.into_iter().collect(),
        unexplained,
        explanations,
        whitener: base.whitener,
        seconds: 0.0,
    })
}

/// The level of discrepancy that suits the machine as it is best, and the best of usual ones.
fn levels(base: &Comparison) -> (Level, Level) {
    let residual = &base.found.residual;
    let any = base.errors.learn(residual, &[], Level::NONE, None);
    let usual = if any.is_usual() { any } else { base.errors.learn_usual(residual) };
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

/// What the best explanation comes to; `None` where the machine file has no words for it.
fn rung(
    problem: &Problem,
    predictor: &Predictor<'_>,
    best: &Explanation,
    joint: Option<&Joint>,
    outcome: &Outcome,
    gain: Option<Gain>,
) -> Result<Option<Rung>> {
    let refitted = joint.map_or(Vec::new(), |joint| joint.others.clone());
    // Numbers of the file first: a cause may take their place.
    let members: Vec<(&Hypothesis, f64)> = refitted.iter().chain(&best.causes).map(|c| (&c.hypothesis, c.amplitude)).collect();
    let Some(sets) = predictor.written(&members)? else { return Ok(None) };
    let predicted = match joint {
        Some(joint) => joint.values.iter().zip(&outcome.view.mesh).map(|(v, m)| v + m).collect(),
        None => outcome.leading_predictions().unwrap_or_default(),
    };
    let left: Vec<f64> = whiten::readings(&problem.data).iter().zip(&predicted).map(|(r, p)| r - p).collect();
    let square = left.iter().map(|v| v * v).sum::<f64>();
    let places = whiten::places(&problem.data);
    let of_sensor = |k: usize| left.iter().zip(&places).filter(|(_, (_, s))| *s == k).map(|(v, _)| v * v).sum::<f64>();
    let most = (0..problem.data.names.len()).max_by(|a, b| of_sensor(*a).total_cmp(&of_sensor(*b)));
    Ok(Some(Rung {
        causes: best.causes.clone(),
        refitted,
        rms: (square / left.len().max(1) as f64).sqrt(),
        share: 0.0,
        left: joint.map_or(best.level, |joint| joint.level),
        probability_left: chi_square_tail(best.misfit, left.len().saturating_sub(best.causes.len()).max(1)),
        where_left: most.map(|k| WhereLeft { sensor: problem.data.names[k].clone(), share: of_sensor(k) / square.max(1e-300) }),
        gain,
        sets,
        predicted,
    }))
}

/// Sum of the squared residuals of predictions (K), K².
pub(super) fn square(predicted: &[f64], problem: &Problem) -> f64 {
    whiten::readings(&problem.data).iter().zip(predicted).map(|(r, p)| (r - p).powi(2)).sum()
}
