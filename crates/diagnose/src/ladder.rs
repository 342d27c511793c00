//! The ladder: calibrate, compare, name, refit jointly, extend, and on to the next cause while unseen data are predicted better.

use std::borrow::Cow;
use std::time::Instant;

use super::decide::ALARM_CAUSE;
use super::rung::{Rung, once};
use super::view::square;
use super::{Diagnosis, NOISE, Problem, Verdict};
use coldplate_base::error::Result;
use coldplate_base::progress::Progress;
use coldplate_evidence::discrepancy::DiscrepancySize as DiscrepancyLevel;
use coldplate_solve::study::StateTables;

/// Rungs at most.
const MOST_RUNGS: usize = 5;
/// What readings of the end result may be off on the reduced model, K: noise and what meshes leave open are tens of this.
const ACCURACY: f64 = 1e-3;

/// Diagnoses: screens all causes, fits the most probable ones, decides, and says what is gained and what to measure next. Where a
/// cause is named and unseen data are predicted better with it, the machine is extended and diagnosed again. Tables are solved on the
/// reduced model ([`StateTables::Reduced`]) and their end result once in full; should they differ by more than a millikelvin, all of it is
/// done in full.
///
/// # Errors
/// The machine has a controller, or as it is cannot be solved at the data's conditions.
pub fn diagnose(problem: &Problem, progress: &dyn Progress) -> Result<Diagnosis> {
    let clock = Instant::now();
    problem.study.model.machine.without_controllers("a diagnosis")?;
    let mut found = climbed(problem, progress)?;
    if let Some(off) = found.off_in_full.filter(|off| off.is_nan() || *off > ACCURACY) {
        progress.say(&format!("the reduced model is off by {off:.1e} K: everything again in full"));
        let study = problem.study.clone().with_tables(StateTables::InFull);
        found = climbed(&Problem { study, ..problem.clone() }, progress)?;
    }
    found.seconds = clock.elapsed().as_secs_f64();
    Ok(found)
}

/// The same; where causes leave more than noise of a table and explain the rest without some readings or rows, these are set aside and
/// become [`Problem::faults`] of the problem that is returned.
///
/// # Errors
/// As [`diagnose`].
pub fn settled<'p>(problem: &'p Problem, progress: &dyn Progress) -> Result<(Cow<'p, Problem>, Diagnosis)> {
    let found = diagnose(problem, progress)?;
    if found.aside.is_empty() {
        return Ok((Cow::Borrowed(problem), found));
    }
    let without = problem.without(&found.aside);
    progress.say(&format!("again without {} readings that causes do not explain", problem.data.count() - without.data.count()));
    // The first answer stands where there is no better one.
    match diagnose(&without, progress) {
        Ok(again) if again.leaves_noise(problem.data.is_transient()) => {
            Ok((Cow::Owned(without), Diagnosis { seconds: found.seconds + again.seconds, ..again }))
        }
        Ok(_) => Ok((Cow::Borrowed(problem), found)),
        Err(e) => {
            progress.say(&format!("without them the machine could not be diagnosed: {e}"));
            Ok((Cow::Borrowed(problem), found))
        }
    }
}

/// All rungs.
fn climbed(problem: &Problem, progress: &dyn Progress) -> Result<Diagnosis> {
    let mut found = once(problem, progress)?;
    let mut here = Problem { may_set_aside: false, ..problem.clone() };
    while let Some(last) = found.rungs.last()
        && found.rungs.len() < MOST_RUNGS
        && found.verdict == Verdict::Explained
        && leaves_much(last)
    {
        progress.say(&format!("{} explained; looking for what is left", percent(last.share)));
        let extended = here.study.edited(&last.sets).and_then(|study| {
            here.study = study;
            once(&here, progress)
        });
        let next = match extended {
            Ok(next) => next,
            Err(e) => {
                progress.say(&format!("the extended machine could not be diagnosed again: {e}"));
                break;
            }
        };
        // A further cause must show on data kept out.
        let is_further = |rung: &Rung| next.verdict == Verdict::Explained && rung.gain.is_some();
        let Some(mut rung) = next.rungs.first().filter(|rung| is_further(rung)).cloned() else { break };
        // Shares of the machine as it was given, not of the extended one.
        rung.alone.clear();
        rung.share = 1.0 - square(&rung.predicted, problem) / square(&found.residuals.predicted, problem);
        found.sets.get_or_insert_default().extend(rung.sets.iter().cloned());
        found.explained = Some(rung.predicted.clone());
        found.off_in_full = found.off_in_full.zip(next.off_in_full).map(|(first, last)| first.max(last));
        found.gain = found.gain.map(|first| rung.gain.iter().fold(first, |first, last| first.and_then(last)));
        found.rungs.push(rung);
    }
    Ok(found)
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// Whether the readings ask for another cause: more is left than what is stated explains, or something stands out of it. How much of
/// that is a usual discrepancy is decided as for the first cause, by what another one takes of it.
fn leaves_much(rung: &Rung) -> bool {
    rung.left != DiscrepancyLevel::NONE || rung.probability_left < NOISE || rung.look_beside < ALARM_CAUSE
}
