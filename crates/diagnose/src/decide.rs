//! From probabilities to an answer: consistent, explained, something else, or cannot tell.

use super::probability::Posterior;
use super::screen::Screened;
use super::{Cause, Explanation, Gain, Misfit, SET_95};
use coldplate_evidence::discrepancy::ErrorParts;
use coldplate_evidence::identify::chi_square_tail;

/// Probability of the whole misfit below which an alarm is raised: the false alarms allowed to it. Chosen: fewer miss more causes.
pub const ALARM_MISFIT: f64 = 0.002;
/// Probability of the best cause, with the look-elsewhere effect paid for, below which an alarm is raised. Chosen as the other one.
pub const ALARM_CAUSE: f64 = 0.006;
/// Probability at which something is said without reserve.
const CERTAIN: f64 = 0.9;
/// An explanation that takes less of the squared residual than this, leaves more than models usually do, and for certain gains nothing
/// on unseen data, is none.
const LEAST_SHARE: f64 = 0.5;

/// What a diagnosis comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The data do not contradict the machine as it is.
    Consistent,
    /// A cause, or two, explain what is wrong, with probability 0.9 or more.
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
}

/// What of an answer is certain, from most to least.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Certainty {
    /// Kind, place and law of every cause.
    Law,
    /// Kind and place of every cause.
    Kind,
    /// Kind and place of one of two causes.
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
    fn names_the_cause(self) -> bool {
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

/// Whether the misfit is significant.
pub fn is_wrong(misfit: &Misfit) -> bool {
    misfit.probability < ALARM_MISFIT || misfit.look_elsewhere < ALARM_CAUSE
}

/// The misfit of a screen, with the look-elsewhere effect paid for.
pub(crate) fn misfit_of(screened: &Screened, seed: u64) -> Misfit {
    Misfit { look_elsewhere: screened.look_elsewhere(seed), ..of_the_whole(screened) }
}

fn of_the_whole(screened: &Screened) -> Misfit {
    let (chi2, freedom) = (screened.misfit(), screened.residual.len());
    Misfit { chi2, freedom, probability: chi_square_tail(chi2, freedom), look_elsewhere: 1.0 }
}

/// Whether a screen raises the alarm. The Monte Carlo test runs only if the chi-square test does not already reject.
pub(crate) fn raises_alarm(screened: &Screened, seed: u64) -> bool {
    is_wrong(&of_the_whole(screened)) || is_wrong(&misfit_of(screened, seed))
}

/// A verdict with what is certain of it.
#[derive(Debug, Clone)]
pub struct Answer {
    /// The verdict.
    pub verdict: Verdict,
    /// What is certain.
    pub level: Level,
    /// Explanations that the data cannot refute, as indices, the first one always among them.
    pub set: Vec<usize>,
    /// Whether it would be certain were all numbers of the file exact.
    pub is_open_by_numbers: bool,
}

impl Answer {
    /// Whether causes are named in it.
    pub(crate) fn names_causes(&self) -> bool {
        matches!(self.verdict, Verdict::Explained | Verdict::CannotTell)
    }

    /// The same where the misfit at the level of the best explanation is `misfit`: without an alarm there, causes explain no more than a
    /// discrepancy does, whose size is usual or not.
    pub fn beside(self, misfit: &Misfit, is_usual: bool) -> Self {
        if misfit.look_elsewhere < ALARM_CAUSE {
            return self;
        }
        Self { verdict: if is_usual { Verdict::Consistent } else { Verdict::SomethingElse }, ..self }
    }

    /// The same after data kept out have been predicted, with the best explanation taking a share of the squared residual; `by_itself` says
    /// what it gains without what was refitted beside it.
    pub(crate) fn vetoed(
        self,
        (explanations, errors): (&[Explanation], &ErrorParts),
        gain: Option<&Gain>,
        by_itself: impl FnOnce() -> Option<Gain>,
        share: f64,
    ) -> Self {
        if !self.names_causes() {
            return self;
        }
        let is_certain = |gain: Option<&Gain>| gain.is_some_and(|gain| gain.low > 0.0);
        let is_unusual = || explanations.first().is_some_and(|e| !errors.is_usual(&e.level));
        if share < LEAST_SHARE && is_unusual() && !is_certain(gain) && !is_certain(by_itself().as_ref()) {
            return Self { verdict: Verdict::SomethingElse, level: region(explanations, 0.0), ..self };
        }
        if predicts_worse(gain) {
            // A cause that predicts what it has not seen no better is no finding.
            return self.withdrawn();
        }
        self
    }

    /// The same of causes that are certain, where all numbers of the file may be a little off, with the probabilities that explanations then
    /// have: what is not certain beside that is not certain.
    pub(crate) fn beside_numbers(self, named: &Explanation, explanations: &[Explanation]) -> Self {
        let level = ladder(named, explanations);
        let is_certain = level.certainty.names_the_cause();
        let verdict = if is_certain { Verdict::Explained } else { Verdict::CannotTell };
        Self { verdict, level, is_open_by_numbers: !is_certain, ..self }
    }

    /// The same where numbers of the file that are all a little off explain more than causes do: no contradiction.
    pub(crate) fn by_numbers(self, probability: f64) -> Self {
        Self { verdict: Verdict::Consistent, level: Level::nothing(probability), set: Vec::new(), is_open_by_numbers: false }
    }

    /// Without what is named.
    pub(crate) fn withdrawn(self) -> Self {
        Self { verdict: Verdict::CannotTell, level: Level::nothing(self.level.probability), is_open_by_numbers: false, ..self }
    }

    /// Whether the machine is extended by the best explanation. By one of several that fit a log alike only if what it gains is certain: of
    /// few tests one may decide.
    pub(crate) fn extends_the_machine(&self, gain: Option<&Gain>, is_log: bool) -> bool {
        let is_certain = self.verdict == Verdict::Explained || gain.is_none_or(|gain| gain.low > 0.0);
        self.names_causes() && !predicts_worse(gain) && (is_certain || !is_log)
    }
}

/// Whether data kept out are predicted no better than by the machine as it is.
pub(crate) fn predicts_worse(gain: Option<&Gain>) -> bool {
    gain.is_some_and(|gain| gain.after >= gain.before)
}

/// What the probabilities come to; `is_learnt` says whether a discrepancy of a usual size explains any of the misfit.
pub fn decide(misfit: &Misfit, posterior: &Posterior, explanations: &[Explanation], is_learnt: bool) -> Answer {
    let answer = |verdict, level, set| Answer { verdict, level, set, is_open_by_numbers: false };
    // What models and days usually leave open is no contradiction.
    if !is_wrong(misfit) || (is_learnt && posterior.nothing > 0.5) {
        return answer(Verdict::Consistent, Level::nothing(posterior.nothing), Vec::new());
    }
    let Some(best) = explanations.first() else {
        return answer(Verdict::SomethingElse, Level::nothing(posterior.something_else), Vec::new());
    };
    // One cause competes with the best single one, two with the best two: two always fit better than one.
    let least = explanations.iter().filter(|e| e.causes.len() == best.causes.len()).map(|e| e.deviance).fold(f64::INFINITY, f64::min);
    let is_alive = |e: &Explanation| {
        e.causes.len() == best.causes.len() && e.deviance - least < SET_95 && e.probability > (1e-3 * best.probability).max(1e-4)
    };
    let set = (0..explanations.len()).filter(|i| *i == 0 || is_alive(&explanations[*i])).collect();
    if posterior.something_else > 0.5 {
        return answer(Verdict::SomethingElse, region(explanations, 0.0), set);
    }
    // As many numbers as readings fit anything: the prior alone would choose.
    let is_judged = misfit.freedom > best.causes.len();
    let level = if is_judged { ladder(best, explanations) } else { region(explanations, CERTAIN) };
    let verdict = if level.certainty.names_the_cause() { Verdict::Explained } else { Verdict::CannotTell };
    answer(verdict, level, set)
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
fn ladder(best: &Explanation, explanations: &[Explanation]) -> Level {
    let acting = |what: &[String], depth: Certainty| acting(explanations, what, depth);
    for depth in [Certainty::Law, Certainty::Kind] {
        let what = names(best, depth);
        let probability = acting(&what, depth);
        if probability >= CERTAIN {
            return Level { certainty: depth, what: what.join("; "), probability };
        }
    }
    // One of two.
    for what in names(best, Certainty::Kind) {
        let probability = acting(std::slice::from_ref(&what), Certainty::Kind);
        if best.causes.len() > 1 && probability >= CERTAIN {
            return Level { certainty: Certainty::OneOfTwo, what, probability };
        }
    }
    let what = names(best, Certainty::Place);
    let probability = acting(&what, Certainty::Place);
    if probability >= CERTAIN {
        return Level { certainty: Certainty::Place, what: what.join("; "), probability };
    }
    region(explanations, CERTAIN)
}

/// The part that most of the probability touches.
pub fn region(explanations: &[Explanation], least: f64) -> Level {
    let mut parts: Vec<&String> = explanations.iter().flat_map(|e| e.causes.iter().flat_map(|p| &p.hypothesis.parts)).collect();
    parts.sort();
    parts.dedup();
    let share = |part: &String| -> f64 {
        explanations.iter().filter(|e| e.causes.iter().any(|p| p.hypothesis.parts.contains(part))).map(|e| e.probability).sum()
    };
    let best = parts.into_iter().map(|p| (share(p), p)).max_by(|a, b| a.0.total_cmp(&b.0));
    match best {
        Some((probability, part)) if probability >= least => Level { certainty: Certainty::Region, what: part.clone(), probability },
        _ => Level { certainty: Certainty::Nothing, what: String::new(), probability: 0.0 },
    }
}
