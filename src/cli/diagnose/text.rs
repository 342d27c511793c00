//! A diagnosis as text.

use super::super::text::table;
use coldplate_base::numbers::short;
use coldplate_diagnose::{ExtraSensor, Verdict};
use coldplate_evidence::faulty_readings;
use coldplate_findings::{Findings, ladder, next_test_in_words, places, probability, words, worth_in_words};

/// The answer for a terminal.
pub(super) fn text(found: &Findings<'_>) -> String {
    let (problem, diagnosis) = (found.problem, &found.diagnosis);
    let data = &problem.data;
    let misfit = &diagnosis.misfit;
    let mut text = format!(
        "{}\n{} readings of {} sensors\n\n{}\n",
        problem.study.model.machine.name,
        data.count(),
        data.sensors.len(),
        found.headline()
    );
    for sentence in found.gain_in_words().into_iter().chain(found.otherwise_in_words()).chain(next_in_words(found)) {
        text += &format!("{sentence}\n");
    }
    text += "\n";
    text += &faulty_readings::listed(&problem.faults);
    for part in places::set_aside(found) {
        text += &format!("  set aside as grossly wrong: {part}\n");
    }
    text += &format!(
        "  misfit {:.1} over {} readings, p = {:.2e}; best of {}\n",
        misfit.chi2,
        misfit.freedom,
        misfit.probability,
        diagnosis.tried.sentence()
    );
    if let Some(words) = found.noise_in_words() {
        text += &format!("  {words}\n");
    }
    text += &format!("  nothing wrong {:.3}, something else {:.3}\n\n", diagnosis.others.nothing, diagnosis.others.something_else);
    if diagnosis.verdict != Verdict::Consistent {
        text += &explanations(found);
    }
    text + &rungs(found) + &next(found) + &extended(found) + &format!("{:.2} s\n", diagnosis.seconds)
}

/// The test worth making first.
fn next_in_words(found: &Findings<'_>) -> Option<String> {
    let next = found.diagnosis.next.first()?;
    Some(format!("Measure next: {}.", next_test_in_words(found.problem, next)))
}

/// Explanations by probability.
fn explanations(found: &Findings<'_>) -> String {
    let diagnosis = &found.diagnosis;
    let rows: Vec<Vec<String>> = found
        .ranked(12)
        .map(|(i, e)| {
            let open = if diagnosis.set.contains(&i) { "yes" } else { "no" };
            let misfit = if e.misfit.is_finite() { format!("{:.1}", e.misfit) } else { String::new() };
            vec![format!("{:.3}", e.probability), misfit, open.to_string(), words(e)]
        })
        .collect();
    let mut text = table(&["probability", "misfit left", "in the set", "cause"], &rows);
    text += "\n";
    for level in &diagnosis.certainties {
        text += &format!("  probability of the {}: {} ({})\n", level.certainty.code(), probability(level.probability), level.what);
    }
    if !diagnosis.certainties.is_empty() {
        text += "\n";
    }
    text
}

/// Causes step by step, and the gain on data kept out.
fn rungs(found: &Findings<'_>) -> String {
    let diagnosis = &found.diagnosis;
    let mut text = String::new();
    for (i, rung) in diagnosis.rungs.iter().enumerate() {
        text += &format!("{}. {}\n", i + 1, ladder::words(rung));
        let before = if rung.causes.is_empty() { "" } else { "refitted beside it: " };
        for line in ladder::refitted(rung) {
            text += &format!("   {before}{line}\n");
        }
        text += &format!("   {}\n", ladder::left(rung));
        if let Some(gain) = rung.gain.as_ref().filter(|_| diagnosis.rungs.len() > 1) {
            text += &format!("   on data kept out: error {:.3} K before, {:.3} K after\n", gain.before, gain.after);
        }
    }
    match &diagnosis.gain {
        Some(gain) => {
            text += &format!(
                "on {} conditions, each kept out of the fit: error {:.3} K before, {:.3} K after; gain {:.3} K ({:.3} to {:.3}), noise floor {:.3} K\n",
                gain.conditions.len(),
                gain.before,
                gain.after,
                gain.before - gain.after,
                gain.low,
                gain.high,
                gain.noise_floor
            );
        }
        None => text += "too few conditions to keep some out: the gain on unseen ones is not known\n",
    }
    text
}

/// Tests worth making next.
fn next(found: &Findings<'_>) -> String {
    let (problem, diagnosis) = (found.problem, &found.diagnosis);
    let mut text = String::new();
    for (i, next) in diagnosis.next.iter().enumerate() {
        let test = next_test_in_words(problem, next);
        let before = if i == 0 { "\nwhat to measure next:\n  " } else { "  or " };
        text += &format!("{before}{test}: sets them {:.1} standard deviations apart\n", next.mean);
        text += &format!("     {}\n", worth_in_words(next, &problem.costs));
        if let Some(ExtraSensor { name, entry: Some(entry), .. }) = &next.sensor {
            text += &format!("     in the machine file: sensor.\"{name}\" = {entry}\n");
        }
    }
    if diagnosis.verdict == Verdict::CannotTell && diagnosis.next.is_empty() {
        text += "\nno test within the machine's ranges would set these explanations one standard deviation apart\n";
    }
    text
}

/// The extended machine and its surrogate, or why there is none.
fn extended(found: &Findings<'_>) -> String {
    let mut text = String::new();
    match &found.extended {
        Some(extended) => {
            text += "\nthe extended machine\n";
            for change in &extended.changes {
                let before = change.before.as_deref().map_or("new".to_string(), short);
                text += &format!("  {}: {before} -> {}\n", change.key, short(&change.after));
            }
            for line in found.diagnosis.rungs.iter().filter_map(ladder::left_out) {
                text += &format!("  {line}\n");
            }
            text += &format!("wrote {}\n", extended.path.display());
        }
        None => text += &format!("\nno extended machine: {}\n", found.why_not_extended()),
    }
    if let Some(refitted) = &found.refitted {
        text += &match &refitted.fit {
            Some(fit) => format!("{}\nwrote {}\n", fit.words(), fit.path.display()),
            None => format!("no surrogate: {}\n", found.why_not_extended()),
        };
    }
    text
}
