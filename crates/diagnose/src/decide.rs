//! From probabilities to an answer: consistent, explained, something else, or cannot tell.

use super::amplitude::AmplitudeSettings;
use super::{Cause, Explanation};

/// What a diagnosis comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The data do not contradict the machine as it is for certain.
    Consistent,
    /// Causes explain what is wrong, with probability 0.9 or more.
    Explained,
    /// Something is wrong that no cause of the catalogue explains.
    SomethingElse,
    /// Something is wrong; several causes explain it alike.
    CannotTell,
}

impl Verdict {
    /// As outside programs read it.
    pub fn code(self) -> &'static str {
        match self {
            Self::Consistent => "consistent",
            Self::Explained => "explained",
            Self::SomethingElse => "something_else",
            Self::CannotTell => "cannot_tell",
        }
    }

    /// Whether causes are named in it.
    pub fn names_causes(self) -> bool {
        matches!(self, Self::Explained | Self::CannotTell)
    }
}

/// What of an answer is certain, from most to least.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Certainty {
    /// Kind, place and law of every cause.
    Law,
    /// Kind and place of every cause.
    Kind,
    /// Kind and place of one of several causes.
    OneOfTwo,
    /// The place of every cause.
    Place,
    /// A part that the cause touches.
    Region,
    /// Nothing.
    Nothing,
}

impl Certainty {
    /// As outside programs read it.
    pub fn code(self) -> &'static str {
        match self {
            Self::Law => "law",
            Self::Kind => "kind",
            Self::OneOfTwo => "one",
            Self::Place => "place",
            Self::Region => "region",
            Self::Nothing => "nothing",
        }
    }

    /// Whether it is enough to name the cause.
    pub(crate) fn names_the_cause(self) -> bool {
        matches!(self, Self::Law | Self::Kind)
    }
}

/// What is certain of an answer, and its probability.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// How much.
    pub certainty: Certainty,
    /// What is certain on that level.
    pub what: String,
    /// Its probability.
    pub probability: f64,
}

impl Level {
    /// Nothing is certain.
    pub fn nothing(probability: f64) -> Self {
        Self { certainty: Certainty::Nothing, what: String::new(), probability }
    }
}

/// Explanations that have the probability of a set together, as indices; the first one is always among them.
pub(crate) fn set(explanations: &[Explanation], settings: &AmplitudeSettings) -> Vec<usize> {
    let all: f64 = explanations.iter().map(|e| e.probability).sum();
    let mut before = 0.0;
    let is_in = |e: &Explanation| {
        let is_in = before < settings.set * all;
        before += e.probability;
        is_in
    };
    let count = explanations.iter().map(is_in).take_while(|is_in| *is_in).count();
    (0..count.max(1).min(explanations.len())).collect()
}

/// Names of an explanation's causes: by law, kind or place.
fn names(e: &Explanation, depth: Certainty) -> Vec<String> {
    let name = |p: &Cause| {
        let h = &p.hypothesis;
        match depth {
            Certainty::Law => format!("{}, {}", h.kind_and_place(), h.law_words()),
            Certainty::Kind => h.kind_and_place(),
            _ => h.place.clone(),
        }
    };
    let mut names: Vec<String> = e.causes.iter().map(name).collect();
    names.sort();
    names
}

/// Probability that causes of these names act, alone or with others.
fn acting(explanations: &[Explanation], what: &[String], depth: Certainty) -> f64 {
    let has_all = |e: &&Explanation| what.iter().all(|w| names(e, depth).contains(w));
    explanations.iter().filter(has_all).map(|e| e.probability).sum::<f64>().min(1.0)
}

/// How certain the places of the best explanation's causes are, their kinds there, and their laws.
pub fn certainties(explanations: &[Explanation]) -> Vec<Level> {
    let of = |best: &Explanation, depth: Certainty| {
        let what = names(best, depth);
        Level { certainty: depth, probability: acting(explanations, &what, depth), what: what.join("; ") }
    };
    let depths = [Certainty::Place, Certainty::Kind, Certainty::Law];
    explanations.first().map_or(Vec::new(), |best| depths.into_iter().map(|depth| of(best, depth)).collect())
}

/// What is certain of the best explanation. What counts is the probability that its causes act, alone or with others.
pub(crate) fn ladder(explanations: &[Explanation], settings: &AmplitudeSettings) -> Level {
    let Some(best) = explanations.first() else { return Level::nothing(0.0) };
    let acting = |what: &[String], depth: Certainty| acting(explanations, what, depth);
    for depth in [Certainty::Law, Certainty::Kind] {
        let what = names(best, depth);
        let probability = acting(&what, depth);
        if probability >= settings.certain {
            return Level { certainty: depth, what: what.join("; "), probability };
        }
    }
    for what in names(best, Certainty::Kind) {
        let probability = acting(std::slice::from_ref(&what), Certainty::Kind);
        if best.causes.len() > 1 && probability >= settings.certain {
            return Level { certainty: Certainty::OneOfTwo, what, probability };
        }
    }
    let what = names(best, Certainty::Place);
    let probability = acting(&what, Certainty::Place);
    if probability >= settings.certain {
        return Level { certainty: Certainty::Place, what: what.join("; "), probability };
    }
    region(explanations, settings.certain)
}

/// The part that most of the probability touches, where that is at least so much.
pub(crate) fn region(explanations: &[Explanation], least: f64) -> Level {
    let mut parts: Vec<&String> = explanations.iter().flat_map(|e| e.causes.iter().flat_map(|p| &p.hypothesis.parts)).collect();
    parts.sort();
    parts.dedup();
    let share = |part: &String| -> f64 {
        explanations.iter().filter(|e| e.causes.iter().any(|p| p.hypothesis.parts.contains(part))).map(|e| e.probability).sum()
    };
    let best = parts.into_iter().map(|p| (share(p), p)).max_by(|a, b| a.0.total_cmp(&b.0));
    match best {
        Some((probability, part)) if probability >= least => Level { certainty: Certainty::Region, what: part.clone(), probability },
        _ => Level::nothing(0.0),
    }
}
