//! Hidden effects must be found, and nothing where there is nothing. `cargo bench --bench diagnosis` runs many more.

mod amplitude;
mod amplitude_logs;
mod attached;
mod calibrated;
mod common;
mod derivatives;
mod faults;
mod found_by_amplitude;
mod gas;
mod gross;
mod hidden;
mod history;
mod kinds;
mod laws;
mod logs;
mod mesh;
mod next;
mod over_time;
mod overstated;
mod plan;
mod reduced;
mod restless;
mod sizes;
mod straight;
mod ties;
mod ways;
mod when;

use coldplate_base::progress::Silent;
use coldplate_diagnose::{Effect, Leak, Radiation, Scales, Verdict, diagnose, hypotheses, signatures};
use coldplate_evidence::identify;
use coldplate_explore::simulate::Start;
use coldplate_testing::twin::score::score;
use coldplate_testing::twin::{Family, case};

/// Seeds of clean twins on the small machine, taken in order, none left out; the rate is what the benchmark measures.
#[test]
fn silence_on_clean_data() {
    let mut alarms = Vec::new();
    for seed in 1..=8 {
        let case = case(seed, Family::Clean);
        let found = diagnose(&case.problem, &Silent).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
        if found.verdict != Verdict::Consistent {
            alarms.push((seed, found.misfit));
        }
        if let Some(gain) = found.gain {
            assert!(gain.after <= gain.before * 1.05, "seed {seed}: worse on clean data: {gain:?}");
        }
    }
    assert!(alarms.is_empty(), "false alarms: {alarms:?}");
}

/// One hidden effect each; those large enough must be found, in the right place, and never named wrongly with confidence.
#[test]
fn one_hidden_effect() {
    let (mut missed, mut misplaced, mut wrong, mut large) = (Vec::new(), Vec::new(), Vec::new(), 0);
    for seed in 203..=208 {
        let case = case(seed, Family::One);
        let found = diagnose(&case.problem, &Silent).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
        let score = score(&case, &found);
        println!(
            "seed {seed} d {:.1}: {:?} -> {:?} {:?}",
            score.d,
            case.hidden.iter().map(|h| (&h.kind, &h.place)).collect::<Vec<_>>(),
            found.verdict,
            found.level
        );
        if score.d >= 5.5 && !score.detected {
            missed.push(seed);
        }
        if score.d >= 12.0 {
            large += 1;
            if !score.group {
                misplaced.push(seed);
            }
        }
        if score.confident && !score.exact {
            wrong.push(seed);
        }
    }
    println!("{large} large effects; missed {missed:?}, misplaced {misplaced:?}, confident and wrong {wrong:?}");
    assert!(large >= 3, "the seeds must hold large effects: {large}");
    assert!(missed.is_empty(), "missed: {missed:?}");
    assert!(misplaced.is_empty(), "in the wrong place: {misplaced:?}");
    assert!(wrong.is_empty(), "confident and wrong: {wrong:?}");
}

/// The signature of every cause, by adjoints, is the slope of what its lines of the machine file do, by solving again.
#[test]
fn signatures_are_slopes_of_the_edits() {
    let case = case(5, Family::Clean);
    let (study, data) = (&case.problem.study, &case.problem.data);
    let scales = Scales::of(data, &study.model.machine);
    let all = hypotheses(study, data, &[]);
    let found = signatures(study, data, Start::Steady, &[], &all, &scales, &[]).unwrap();
    let base = identify::values(study, data, Start::Steady).unwrap();
    let (mut checked, mut wrong) = (0, Vec::new());
    for (h, column) in all.iter().zip(&found.columns) {
        // Residual gas saturates within a pascal: it is followed along the secant over its prior.
        let step = if h.effect == Effect::Radiation(Radiation::Gas) { h.scale } else { 0.02 * h.scale };
        let Some(sets) = h.sets(study, &scales, &[], step).unwrap() else { continue };
        if sets.is_empty() {
            continue;
        }
        let moved = identify::values(&study.edited(&sets).unwrap_or_else(|e| panic!("{h:?}: {e}")), data, Start::Steady).unwrap();
        let slope: Vec<f64> = moved.iter().zip(&base).map(|(a, b)| (a - b) / step).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (own, other, both) = (dot(column, column).sqrt(), dot(&slope, &slope).sqrt(), dot(column, &slope));
        // What is spread over a part in the screen enters over its surface in the file: between places of nearly one
        // temperature that decides the sign, so only what shows is held to it.
        let loose = matches!(h.effect, Effect::Leak(Leak::Surroundings(_) | Leak::Link(..)) | Effect::Radiation(Radiation::Exchange(..)));
        if other * h.scale < if loose { 0.3 } else { 1e-3 } {
            continue; // shows nowhere
        }
        let (cosine, ratio) = (both / (own * other), own / other);
        let (alike, size) = if loose { (0.98, 0.35) } else { (0.999, 0.03) };
        if !(cosine > alike && (ratio - 1.0).abs() < size) {
            wrong.push(format!(
                "{} at {} {:?}: cosine {cosine:.4}, ratio {ratio:.3}, size {:.2} K",
                h.kind(),
                h.place,
                h.law,
                other * h.scale
            ));
        }
        checked += 1;
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    println!("{checked} of {} causes checked", all.len());
    assert!(checked > 40, "{checked}");
}
