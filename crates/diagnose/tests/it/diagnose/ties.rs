//! Causes that do the same at every condition are as probable as each other, and those that another condition would tell apart are told.

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_diagnose::{Certainty, Diagnosis, Verdict, diagnose};
use coldplate_testing::machines::SMALL;

use super::hidden::Hidden;

/// Half as much heat again in the bearing, whose source is in proportion to the speed.
fn found(held: &[(&str, f64)], seed: u64) -> Diagnosis {
    let machine = Document::parse(SMALL, "small.toml").unwrap();
    let lines = [("source.bearing.power", "\"0.0024 * motor_speed_rpm\"")];
    let conditions = Hidden::conditions(&machine, 12, seed, held);
    diagnose(&Hidden { machine: &machine, cells: (300, 10_000), lines: &lines, conditions, seed }.problem(), &Silent).unwrap()
}

/// Probability that a kind acts alone at the bearing, by whatever law.
fn of_kind(found: &Diagnosis, kind: &str) -> f64 {
    let is_it = |c: &coldplate_diagnose::Cause| c.hypothesis.kind() == kind && c.hypothesis.place == "bearing";
    let own = found.explanations.iter().filter(|e| e.causes.len() == 1 && is_it(&e.causes[0]));
    own.map(|e| e.probability).sum()
}

/// More of the source and heat in proportion to the speed are one and the same: the place is certain, and neither name is.
#[test]
fn a_source_s_factor_and_heat_in_proportion() {
    for (seed, held) in [(71, &[][..]), (72, &[("motor_speed", 2000.0 * std::f64::consts::TAU / 60.0)])] {
        let found = found(held, seed);
        let (factor, heat) = (of_kind(&found, "source factor"), of_kind(&found, "heat source"));
        println!("{:?} {:?}: factor {factor:.3}, heat {heat:.3}", found.verdict, found.level);
        assert_eq!((found.verdict, found.level.certainty, found.level.what.as_str()), (Verdict::CannotTell, Certainty::Place, "bearing"));
        assert!(factor > 0.1 && heat > 0.1 && factor < 0.9 && heat < 0.9);
    }
}
