//! Machines whose sizes are off by a few per cent, as drawings and machines are: nothing is wrong with them.

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_base::random::Random;
use coldplate_diagnose::{Diagnosis, Verdict, diagnose};
use coldplate_testing::machines::SMALL;

use super::hidden::Hidden;

/// Edges of boxes, mm, and which of them can differ without the parts coming apart.
const BOXES: [(&str, [f64; 3], [bool; 3]); 5] = [
    ("part.plate.box", [200.0, 160.0, 20.0], [true, true, false]),
    ("part.motor.box", [120.0, 120.0, 140.0], [true, true, true]),
    ("part.gear.box", [100.0, 100.0, 110.0], [true, true, true]),
    ("part.bracket.box", [40.0, 60.0, 200.0], [true, true, false]),
    ("part.bearing.box", [80.0, 80.0, 60.0], [true, true, true]),
];

/// Lines that make every edge up to 5 % larger or smaller.
fn resized(seed: u64) -> Vec<(&'static str, String)> {
    let mut random = Random::new(seed);
    let mut edge = |(mm, is_free): (&f64, &bool)| format!("\"{:.4} mm\"", mm * if *is_free { 0.95 + 0.1 * random.unit() } else { 1.0 });
    BOXES
        .iter()
        .map(|(key, edges, free)| (*key, format!("[{}]", edges.iter().zip(free).map(&mut edge).collect::<Vec<_>>().join(", "))))
        .collect()
}

/// What is said of a table of a machine of other sizes, with a cause or without.
fn found(seed: u64, cause: Option<(&str, &str)>) -> Diagnosis {
    let machine = Document::parse(SMALL, "small.toml").unwrap();
    let sizes = resized(seed);
    let lines: Vec<(&str, &str)> = sizes.iter().map(|(key, value)| (*key, value.as_str())).chain(cause).collect();
    let conditions = Hidden::conditions(&machine, 10, seed + 100, &[]);
    let hidden = Hidden { machine: &machine, cells: (300, 500), lines: &lines, conditions, seed: seed + 200 };
    let found = diagnose(&hidden.problem(), &Silent).unwrap();
    println!(
        "seed {seed}: {:?}, chi2 {:.0}, {:?}, left open: {}",
        found.verdict,
        found.misfit.chi2,
        named(&found),
        found.unexplained.in_words()
    );
    found
}

fn named(found: &Diagnosis) -> Vec<String> {
    found.explanations.first().map_or(Vec::new(), |best| best.causes.iter().map(|c| c.hypothesis.kind_and_place()).collect())
}

/// Without numbers that may be off, all of these raise an alarm, and a cause is named for certain on three.
#[test]
fn nothing_is_wrong_with_machines_of_other_sizes() {
    let all: Vec<Diagnosis> = (1..=6).map(|seed| found(seed, None)).collect();
    assert!(all.iter().all(|found| found.verdict != Verdict::Explained));
    let consistent: Vec<&Diagnosis> = all.iter().filter(|found| found.verdict == Verdict::Consistent).collect();
    assert!(consistent.len() >= 4, "{} of 6", consistent.len());
    assert!(consistent.iter().filter(|found| found.misfit.probability < 0.001).all(|found| found.unexplained.spread > 0.0));
}

/// Nothing but the cause itself is named for certain.
#[test]
fn a_small_cause_is_no_other_beside_other_sizes() {
    for seed in 31..=36 {
        let found = found(seed, Some(("contact.foot.conductance", "\"200 W/(m2 K)\"")));
        assert!(found.verdict != Verdict::Explained || found.level.what.contains("contact conductance at foot"), "{:?}", found.level);
    }
}

#[test]
fn a_cause_is_certain_beside_other_sizes() {
    for seed in [21, 22, 23] {
        let found = found(seed, Some(("contact.foot.conductance", "\"80 W/(m2 K)\"")));
        assert!(found.level.what.contains("contact conductance at foot"), "{:?}", found.level);
        assert!(found.level.probability > 0.9);
    }
}
