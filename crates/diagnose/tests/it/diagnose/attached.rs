//! A hose that is screwed to one place of a part: the sensors beside it are not to blame.

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_diagnose::{Diagnosis, diagnose};
use coldplate_testing::machines::SMALL;

use super::hidden::Hidden;

/// What is said of a hose from one face of the motor, which has a thermometer near each end.
fn found(face: &str, seed: u64) -> Diagnosis {
    let mut machine = Document::parse(SMALL, "small.toml").unwrap();
    for (name, point) in [("motor top", "[\"60 mm\", \"60 mm\", \"130 mm\"]"), ("motor side", "[\"110 mm\", \"60 mm\", \"70 mm\"]")] {
        machine.apply_set(&format!("sensor.\"{name}\""), &format!("{{ in = \"motor\", point = {point} }}")).unwrap();
    }
    let contact = format!("{{ between = [\"motor.{face}\", \"hose\"], total_conductance = \"0.3 W/K\" }}");
    let lines = [("node.hose", "{ temperature = \"ambient_temperature\" }"), ("contact.hose", contact.as_str())];
    let conditions = Hidden::conditions(&machine, 12, seed, &[]);
    let hidden = Hidden { machine: &machine, cells: (600, 1500), lines: &lines, conditions, seed };
    let found = diagnose(&hidden.problem(), &Silent).unwrap();
    println!("{face} {seed}: {:?} {:?}", found.verdict, found.level);
    for e in found.explanations.iter().take(3) {
        println!("   {:.3} {:?}", e.probability, e.causes.iter().map(|c| (c.hypothesis.kind_and_place(), c.amplitude)).collect::<Vec<_>>());
    }
    found
}

#[test]
fn no_sensor_beside_a_hose_is_to_blame_for_certain() {
    for (face, seed) in [("+z", 1), ("+z", 2), ("+x", 3), ("-x", 4)] {
        let found = found(face, seed);
        assert!(found.level.what.contains("leak to the surroundings at motor"), "{:?}", found.level);
        assert!(!found.level.what.contains("sensor"), "{:?}", found.level);
    }
}
