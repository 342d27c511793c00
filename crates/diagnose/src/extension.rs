//! How the machine is extended by what is named: fitted with everything uncertain or alone, as data kept out say.

use super::effects::Hypothesis;
use super::finalists::{Finalists, Outcome};
use super::gain::KeptOut;
use super::joint::{Joint, JointWeights, joint};
use super::{Explanation, Gain, decide, gain, shared};
use coldplate_base::progress::Progress;

/// Of a table, causes alone are written where their error on data kept out is less than this share of that with numbers fitted beside them.
const BETTER: f64 = 0.98;

/// How the machine is extended: what is fitted beside the cause, and what that gains on data kept out.
pub(super) struct Extension {
    /// What is fitted beside.
    pub joint: Option<Joint>,
    /// What that gains.
    pub gain: Option<Gain>,
}

impl Extension {
    /// Error on data kept out, K; without end where none is known.
    fn after(&self) -> f64 {
        self.gain.as_ref().map_or(f64::INFINITY, |gain| gain.after)
    }
}

/// The best explanation refitted with everything uncertain, by the first weights with which it predicts data kept out better than the
/// machine as it is; alone where it does so only alone, and of a table where it does so better alone. What shows in one test only cannot be
/// found without it: of logs, parts of tests are kept out where whole ones give no gain.
pub(super) fn extension(finals: &Finalists<'_>, outcome: &Outcome, named: Option<&Explanation>, progress: &dyn Progress) -> Extension {
    let problem = finals.problem;
    let entry = outcome.leading().filter(|_| named.is_some());
    let refitted = |weights: JointWeights| -> Option<Joint> {
        let found = joint(finals, entry?, &outcome.view, weights).unwrap_or_else(|e| {
            progress.say(&format!("what is uncertain could not be refitted beside the cause: {e}"));
            None
        });
        found.filter(|joint| named.is_none_or(|named| !joint.empties(&named.causes)))
    };
    let kept_out: &[KeptOut] =
        if named.is_some() && problem.data.is_transient() { &[KeptOut::Tests, KeptOut::Blocks] } else { &[KeptOut::Tests] };
    let gain_of = |joint: Option<&Joint>, kept_out: KeptOut| {
        progress.say("gain on conditions kept out");
        gained(finals, outcome, named, joint, kept_out)
    };
    let mut first = None;
    let mut ways: Vec<Option<Joint>> = Vec::new();
    for (turn, kept_out) in kept_out.iter().enumerate() {
        for (k, weights) in [Some(JointWeights::Covariance), Some(JointWeights::Apart), None].into_iter().enumerate() {
            if turn == 0 {
                ways.push(weights.and_then(refitted));
            }
            if weights.is_some() && ways[k].is_none() {
                continue;
            }
            let found = Extension { joint: ways[k].clone(), gain: gain_of(ways[k].as_ref(), *kept_out) };
            if decide::predicts_worse(found.gain.as_ref()) {
                first.get_or_insert(found);
                continue;
            }
            // In a table the numbers that are pulled may follow what is not theirs.
            let is_pulled = found.joint.as_ref().is_some_and(|joint| joint.has_pulled);
            if is_pulled && !problem.data.is_transient() {
                let alone = Extension { joint: None, gain: gain_of(None, *kept_out) };
                return if alone.after() < BETTER * found.after() { alone } else { found };
            }
            return found;
        }
    }
    first.unwrap_or(Extension { joint: None, gain: None })
}

/// What an explanation gains, with what was fitted beside it.
pub(super) fn gained(
    finals: &Finalists<'_>,
    outcome: &Outcome,
    named: Option<&Explanation>,
    joint: Option<&Joint>,
    kept_out: KeptOut,
) -> Option<Gain> {
    let causes: Vec<&Hypothesis> = named.iter().flat_map(|named| &named.causes).map(|c| &c.hypothesis).collect();
    let has_none = causes.is_empty() || joint.is_some_and(|joint| joint.takes_factors_place(finals));
    let factors = if has_none { Vec::new() } else { shared::beside(finals, &causes, &outcome.view) };
    let shared: Vec<Vec<f64>> = factors.into_iter().map(|(_, column)| column.clone()).collect();
    let named = named.map(|explanation| gain::Named { explanation, joint, shared: &shared, view: &outcome.view });
    gain::gain(finals.problem, finals.predictor, finals.catalogue, finals.base, named, kept_out)
}
