//! From measured data to a better machine: causes, heat balances, the machine file with the best explanation in it, a
//! surrogate of that machine, and a report for readers who were not there.
//!
//! [`examine`] does all of it and writes nothing; [`Findings`] holds the results, and writes files where asked to.

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

mod deviations;
pub mod energy;
mod estimate;
pub mod extended;
mod figures;
pub mod input;
pub mod ladder;
mod next;
mod picture;
pub mod places;
pub mod record;
pub mod refit;
mod report;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use coldplate_base::atomic_file;
use coldplate_base::error::{Result, panic_text};
use coldplate_base::numbers::significant;
use coldplate_base::progress::Progress;
use coldplate_diagnose::{Certainty, Diagnosis, Explanation, Looseness, Problem, Verdict, sentence};
use coldplate_evidence::identify;
use coldplate_evidence::measurement::DividedData;
use coldplate_evidence::record::HeldOut;
use coldplate_figures::chart::gains::GainsFigure;
use coldplate_figures::report::Report;
use energy::EnergyBalances;
use extended::ExtendedMachine;
pub use next::{in_words as next_test_in_words, worth_in_words};
use refit::Refitted;

/// Other explanations that are told in a sentence, a count. Chosen: more are no sentence.
const TOLD: usize = 3;

/// Results of a diagnosis.
#[derive(Debug)]
#[non_exhaustive]
pub struct Findings<'a> {
    /// The problem.
    pub problem: &'a Problem,
    /// Causes with their probabilities, and the gain.
    pub diagnosis: Diagnosis,
    /// The machine file with the best explanation in it, if one can be written.
    pub extended: Option<ExtendedMachine>,
    /// Heat balances before and after.
    pub energy: EnergyBalances,
    /// The surrogate of the extended machine, if one was asked for.
    pub refitted: Option<Refitted>,
    /// Sentences on steps behind the diagnosis that failed: what they would have made is missing.
    pub failed: Vec<String>,
}

/// Diagnoses, extends the machine file (to be written to `extended`), balances the heat, and fits a surrogate of the
/// extended machine (to be written to `surrogate`) where one is asked for. Nothing is written yet. A step behind the diagnosis
/// that fails leaves the diagnosis as it is and is named in [`Findings::failed`].
///
/// # Errors
/// Errors of [`coldplate_diagnose::diagnose`].
pub fn examine<'a>(
    problem: &'a Problem,
    extended: impl AsRef<Path>,
    surrogate: Option<&Path>,
    progress: &dyn Progress,
) -> Result<Findings<'a>> {
    let diagnosis = coldplate_diagnose::diagnose(problem, progress)?;
    let mut failed = Vec::new();
    let extended = kept("the extended machine", &mut failed, || ExtendedMachine::of(problem, &diagnosis, extended.as_ref())).flatten();
    progress.say("heat balances");
    let energy = kept("heat balances", &mut failed, || EnergyBalances::of(problem, &diagnosis, extended.is_some())).unwrap_or_default();
    let fit = |path| kept("the surrogate", &mut failed, || Refitted::of(problem, extended.as_ref(), path, progress));
    let refitted = surrogate.and_then(fit);
    Ok(Findings { problem, diagnosis, extended, energy, refitted, failed })
}

/// The result of a step; `None` with a sentence in `failed` where it fails or breaks down.
fn kept<T>(name: &str, failed: &mut Vec<String>, step: impl FnOnce() -> Result<T>) -> Option<T> {
    let why = match catch_unwind(AssertUnwindSafe(step)) {
        Ok(Ok(made)) => return Some(made),
        Ok(Err(error)) => error.to_string(),
        Err(panic) => panic_text(&*panic),
    };
    failed.push(format!("{name} could not be made: {why}"));
    None
}

impl Findings<'_> {
    /// Writes the extended machine and the surrogate, where there are any.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self) -> Result<()> {
        if let Some(extended) = &self.extended {
            atomic_file::write(&extended.path, extended.text.as_bytes())?;
        }
        if let Some(fit) = self.refitted.as_ref().and_then(|r| r.fit.as_ref()) {
            atomic_file::write(&fit.path, &fit.bytes)?;
        }
        Ok(())
    }

    /// Readings that were held out, predicted by the machine as it is and by the extended one.
    ///
    /// # Errors
    /// A machine cannot be solved at a condition, or a log cannot be run.
    pub fn held_out(&self, divided: &DividedData) -> Result<HeldOut> {
        let (study, start) = (&self.problem.study, self.problem.start);
        let extended = match self.diagnosis.sets.as_ref().filter(|_| self.extended.is_some()) {
            Some(sets) => study.edited(sets)?,
            None => study.clone(),
        };
        HeldOut::of(divided, [study, &extended], |study, data| identify::values(study, data, start))
    }

    /// The report for readers who were not there.
    ///
    /// # Errors
    /// A figure has nothing to show.
    pub fn report(&self) -> Result<Report> {
        report::report(self)
    }

    /// The ladder of gains as a figure; `None` where no cause was added to the machine.
    pub fn gains(&self) -> Option<GainsFigure> {
        figures::gains(self)
    }

    /// Explanations that the data cannot refute.
    pub fn open(&self) -> Vec<&Explanation> {
        self.diagnosis.set.iter().filter_map(|i| self.diagnosis.explanations.get(*i)).collect()
    }

    /// Explanations worth showing: the first three, and those with some probability; at most `most`.
    pub fn ranked(&self, most: usize) -> impl Iterator<Item = (usize, &Explanation)> {
        self.diagnosis.explanations.iter().enumerate().filter(|(i, e)| *i < 3 || e.probability > 2e-3).take(most)
    }

    /// A sentence on the share of the stated noise that the readings show, if the stated noise is far too large.
    pub fn noise_in_words(&self) -> Option<String> {
        let share = Some(self.diagnosis.noise_share).filter(|share| *share < 1.0)?;
        let percent = significant(100.0 * share, 2);
        Some(format!("the readings scatter by {percent} % of the noise that is stated: they are judged by that share"))
    }

    /// The answer in a sentence or two.
    pub fn headline(&self) -> String {
        let found = &self.diagnosis;
        let better = match &found.gain {
            Some(gain) if found.is_calibrated() => format!(
                " {} predict conditions kept out better: the error is {:.3} K, {:.3} K before.",
                capital(ladder::NUMBERS),
                gain.after,
                gain.before
            ),
            _ => String::new(),
        };
        format!("{}{better}", self.verdict_in_words())
    }

    fn verdict_in_words(&self) -> String {
        let found = &self.diagnosis;
        match found.verdict {
            Verdict::Consistent => {
                let nothing = probability(found.others.nothing);
                let (readings, aside) = match found.aside().len() {
                    0 => ("The readings".into(), ""),
                    1 => (
                        "Without the part of the data that is set aside as grossly wrong the readings".into(),
                        " Check that part first: a cause that acts in it alone looks the same.",
                    ),
                    n => (
                        format!("Without {n} parts of the data that are set aside as grossly wrong the readings"),
                        " Check these parts first: a cause that acts in them alone looks the same.",
                    ),
                };
                let open = if found.unexplained != Looseness::default() {
                    format!(", beside what models of such machines leave open ({})", found.unexplained.in_words())
                } else if aside.is_empty() {
                    format!(", and a misfit this large or larger {:.2}", found.misfit.probability)
                } else {
                    String::new()
                };
                format!("{readings} do not contradict the machine: no cause has probability {nothing}{open}.{aside}")
            }
            Verdict::Explained => {
                let what = found.explanations.first().map(words).unwrap_or_default();
                let p = probability(found.level.probability);
                match found.level.certainty {
                    Certainty::Law => format!("{}; probability {p}.", capital(&what)),
                    _ => format!("{}; probability {p} that it is {}, by whatever law.", capital(&what), found.level.what),
                }
            }
            Verdict::SomethingElse => format!(
                "Something is wrong that no cause of the catalogue explains{}.",
                if found.level.what.is_empty() { String::new() } else { format!("; what comes nearest points to {}", found.level.what) }
            ),
            Verdict::CannotTell if found.is_vetoed && found.level.certainty == Certainty::Nothing => format!(
                "Something is wrong; nearest comes that {}, but data kept out are predicted no better with it: the cause is not known.",
                found.explanations.first().map(words).unwrap_or_default()
            ),
            Verdict::CannotTell => {
                let certain = match found.level.certainty {
                    Certainty::OneOfTwo => format!("certain is {}, and something acts beside it", found.level.what),
                    Certainty::Place => format!("it is at {}", found.level.what),
                    Certainty::Region => format!("it touches {}", found.level.what),
                    _ => "not even its place is certain".into(),
                };
                let n = found.set.len();
                let fit = match n {
                    1 => "1 explanation fits, but not for certain".to_string(),
                    _ => format!("{n} explanations fit alike: the data cannot tell which it is"),
                };
                format!("Something is wrong; {certain}, and {fit}.")
            }
        }
    }

    /// How much of the misfit the machine with the best explanation takes, and what that means in kelvin on conditions that took no part; empty
    /// where nothing is added to the machine.
    pub fn gain_in_words(&self) -> Option<String> {
        let rung = self.diagnosis.rungs.first()?;
        let share = format!("{} % of the squared misfit", significant(100.0 * rung.share, 3));
        Some(match &self.diagnosis.gain {
            Some(gain) => format!(
                "It takes {share}; on conditions kept out the error falls from {} to {} K, where readings alone are uncertain by {} K.",
                significant(gain.before, 3),
                significant(gain.after, 3),
                significant(gain.noise_floor, 2)
            ),
            None => format!("It takes {share}; there are too few conditions to keep some out."),
        })
    }

    /// Further possibilities: the other explanations of the set by kind and place, or the other laws; `None` where there is none.
    pub fn otherwise_in_words(&self) -> Option<String> {
        let first = self.diagnosis.explanations.first().filter(|_| self.diagnosis.verdict.names_causes())?;
        let mut others: Vec<(String, f64)> = Vec::new();
        for e in self.open().into_iter().filter(|e| name(e) != name(first)) {
            match others.iter_mut().find(|(known, _)| *known == name(e)) {
                Some((_, p)) => *p += e.probability,
                None => others.push((name(e), e.probability)),
            }
        }
        if !others.is_empty() {
            let told = others.iter().take(TOLD).map(|(name, p)| format!("{name} ({})", probability(*p)));
            let more = if others.len() > TOLD { format!(", and {} more", others.len() - TOLD) } else { String::new() };
            return Some(format!("It could also be {}{more}.", told.collect::<Vec<_>>().join(", or ")));
        }
        let laws = |e: &Explanation| e.causes.iter().map(|c| c.hypothesis.law_words()).collect::<Vec<_>>().join("; ");
        let own = self.open().into_iter().filter(|e| *e != first).take(TOLD);
        let told: Vec<String> = own.map(|e| format!("{} ({})", laws(e), probability(e.probability))).collect();
        (!told.is_empty()).then(|| format!("Its law could also be: {}.", told.join(", or ")))
    }

    /// Why no extended machine was written.
    pub fn why_not_extended(&self) -> &'static str {
        match self.diagnosis.verdict {
            Verdict::Consistent => "nothing is wrong, and no other numbers are certain to predict conditions kept out better",
            Verdict::SomethingElse => "no cause explains the readings, so there is nothing to extend the machine by",
            _ if self.diagnosis.misses => "the machine with the cause that fits best misses the readings by more than the machine as it is",
            _ if self.diagnosis.is_vetoed => "no cause predicts data kept out better than the machine as it is",
            Verdict::CannotTell if self.diagnosis.gain.as_ref().is_some_and(|gain| gain.low <= 0.0) => {
                "the cause is not certain, nor is its gain on data kept out"
            }
            _ => "the machine file has no number that is the cause",
        }
    }
}

/// A probability in words.
pub fn probability(p: f64) -> String {
    if p > 0.994 { "above 0.99".into() } else { format!("{p:.2}") }
}

/// An explanation in words.
pub fn words(explanation: &Explanation) -> String {
    explanation.causes.iter().map(sentence).collect::<Vec<_>>().join("; and ")
}

/// An explanation by kind and place.
fn name(explanation: &Explanation) -> String {
    explanation.causes.iter().map(|p| p.hypothesis.kind_and_place()).collect::<Vec<_>>().join("; ")
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::kept;
    use coldplate_base::error::Error;

    #[test]
    fn a_step_that_fails_or_breaks_down_is_named() {
        let mut failed = Vec::new();
        assert_eq!(kept("one", &mut failed, || Ok(1)), Some(1));
        assert_eq!(kept::<u8>("two", &mut failed, || Err(Error::input("no such source"))), None);
        assert_eq!(kept::<u8>("three", &mut failed, || panic!("out of bounds")), None);
        assert!(failed.len() == 2 && failed[0].contains("two") && failed[0].contains("no such source"), "{failed:?}");
        assert!(failed[1].contains("three") && failed[1].contains("out of bounds"), "{failed:?}");
    }
}
