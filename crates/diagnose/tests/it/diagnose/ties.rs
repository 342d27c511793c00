//! Causes that do the same at every condition are as probable as each other, and those that another condition would tell apart are told.

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_diagnose::{Diagnosis, Verdict, diagnose};
use coldplate_testing::machines::SMALL;

use super::hidden::Hidden;

/// Half as much heat again in the bearing, whose source is in proportion to the speed.
fn found(held: &[(&str, f64)], seed: u64) -> Diagnosis {
    let machine = Document::parse(SMALL, "small.toml").unwrap();
    let lines = [("source.bearing.power", "\"0.0024 * motor_speed_rpm\"")];
    let conditions = Hidden::conditions(&machine, 12, seed, held);
    diagnose(&Hidden { machine: &machine, cells: (300, 10_000), lines: &lines, conditions, seed }.problem(), &Silent).unwrap()
}

/// More of the source and heat in proportion to the speed are one and the same: the place is certain, and the plainer name comes first.
#[test]
fn a_source_s_factor_and_heat_in_proportion() {
    for (seed, held) in [(71, &[][..]), (72, &[("motor_speed", 2000.0 * std::f64::consts::TAU / 60.0)])] {
        let found = found(held, seed);
        println!("{:?} {:?}", found.verdict, found.level);
        assert!(matches!(found.verdict, Verdict::Explained | Verdict::CannotTell));
        assert!(found.level.what.contains("bearing") && found.level.probability >= 0.9, "{:?}", found.level);
        let best = &found.explanations[0].causes[0].hypothesis;
        assert!(["source factor", "heat source"].contains(&best.kind()) && best.place == "bearing", "{best:?}");
    }
}
