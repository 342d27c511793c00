//! Causes that do the same at every condition are one cause with several names.

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_diagnose::{Diagnosis, Law, Verdict, diagnose};
use coldplate_testing::machines::SMALL;

use super::common::lumped;
use super::hidden::Hidden;

/// Kind and law of what may be at the bearing.
type Name = (&'static str, Law);

const FACTOR: Name = ("source factor", Law::Constant);
const WITH_SPEED: Name = ("heat source", Law::Speed);
const CONSTANT: Name = ("heat source", Law::Constant);

/// Half as much heat again in the bearing, whose source is in proportion to the speed.
fn found(held: &[(&str, f64)], seed: u64) -> Diagnosis {
    let machine = Document::parse(SMALL, "small.toml").unwrap();
    let lines = [("source.bearing.power", "\"0.0024 * motor_speed_rpm\"")];
    let conditions = Hidden::conditions(&machine, 12, seed, held);
    diagnose(&Hidden { machine: &machine, cells: (300, 10_000), lines: &lines, conditions, seed }.problem(), &Silent).unwrap()
}

/// All names at the bearing under which single causes are listed, and those that are synonyms of the first.
fn names(found: &Diagnosis) -> (Vec<Name>, Vec<Name>) {
    let name = |c: &coldplate_diagnose::Cause| -> Option<Name> {
        let own =
            [FACTOR, WITH_SPEED, CONSTANT].into_iter().find(|(kind, law)| c.hypothesis.kind() == *kind && c.hypothesis.law == *law)?;
        (c.hypothesis.place == "bearing").then_some(own)
    };
    let listed = found.explanations.iter().filter(|e| e.causes.len() == 1).filter_map(|e| name(&e.causes[0])).collect();
    let synonyms = found.explanations[0].synonyms.iter().filter_map(|s| name(&s.cause)).collect();
    (listed, synonyms)
}

/// Over all speeds more of the source and heat in proportion to the speed are one and the same, which is certain.
#[test]
fn a_source_s_factor_and_heat_in_proportion() {
    let found = found(&[], 71);
    let (listed, synonyms) = names(&found);
    println!("{:?}: {listed:?}, synonyms {synonyms:?}, {:.3}", found.verdict, found.explanations[0].probability);
    assert_eq!(found.verdict, Verdict::Explained);
    assert!(listed.contains(&FACTOR) != listed.contains(&WITH_SPEED), "both are listed: {listed:?}");
    assert!(synonyms.len() == 1 && synonyms[0] != listed[0], "{synonyms:?}");
    let [own, other] = [&found.explanations[0].causes[0], &found.explanations[0].synonyms[0].cause];
    // The one in W at full speed, of 4 W in the file, the other as a factor of that.
    let share = |c: &coldplate_diagnose::Cause| if c.hypothesis.kind() == "heat source" { c.amplitude / 4.0 } else { c.amplitude };
    assert!((share(own) / share(other) - 1.0).abs() < 0.1, "{} {}", own.amplitude, other.amplitude);
}

/// In steady state twice the heat and half of every contact are the same, but not while the machine warms up: a test tells them apart.
#[test]
fn twice_the_heat_and_half_of_all_contacts() {
    let found = diagnose(&lumped(&[("source.motor.power", "\"0.04 * motor_speed_rpm\"")], 73), &Silent).unwrap();
    let best = &found.explanations[0];
    assert_eq!((best.causes[0].hypothesis.place.as_str(), best.causes.len()), ("motor", 1));
    assert!(found.explanations.iter().any(|e| e.causes.len() == 1 && e.causes[0].hypothesis.kind() == "all contacts"));
    assert!(best.synonyms.iter().all(|s| s.cause.hypothesis.place == "motor" && s.cause.hypothesis.kind() != "all contacts"));
}

/// At one speed heat that stays the same fits as well, and another speed would tell: it keeps its name.
#[test]
fn what_another_speed_would_tell_apart() {
    let found = found(&[("motor_speed", 2000.0 * std::f64::consts::TAU / 60.0)], 72);
    let (listed, synonyms) = names(&found);
    println!("{:?}: {listed:?}, synonyms {synonyms:?}", found.verdict);
    assert_eq!(found.verdict, Verdict::CannotTell);
    assert!(listed.contains(&CONSTANT) && !synonyms.contains(&CONSTANT));
    assert!(listed.contains(&FACTOR) != listed.contains(&WITH_SPEED), "both are listed: {listed:?}");
}

/// The same of a fifth variable of the machine, a load that the data hold: with another load a factor of what it heats is another heat.
#[test]
fn what_another_load_would_tell_apart() {
    let load = "[variables.load]\nunit = \"W\"\ndefault = \"1 W\"\nrange = [\"0 W\", \"2 W\"]\n[chamber]";
    let text = SMALL.replace("[chamber]", load).replace("0.0016 * motor_speed_rpm", "4 * load_W");
    assert!(text.contains("variables.load") && text.contains("4 * load_W"));
    let machine = Document::parse(&text, "small.toml").unwrap();
    let lines = [("source.bearing.power", "\"6 * load_W\"")];
    let conditions = Hidden::conditions(&machine, 12, 74, &[("load", 1.0)]);
    let hidden = Hidden { machine: &machine, cells: (300, 10_000), lines: &lines, conditions, seed: 74 };
    let found = diagnose(&hidden.problem(), &Silent).unwrap();
    let (listed, synonyms) = names(&found);
    println!("{:?}: {listed:?}, synonyms {synonyms:?}", found.verdict);
    assert!(listed.contains(&CONSTANT) && listed.contains(&FACTOR) && synonyms.is_empty(), "{listed:?} {synonyms:?}");
}
