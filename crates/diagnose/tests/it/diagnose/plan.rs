//! What a plan says would be seen is seen, and less is not.

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_diagnose::{Looseness, Plan, Verdict, diagnose, plan, planned_conditions};
use coldplate_testing::machines::SMALL;

use super::hidden::Hidden;

const SEEDS: std::ops::Range<u64> = 1..5;

/// Heat in a part, of the least amplitude that the plan calls seen and of a quarter of it.
#[test]
fn the_least_heat_that_is_seen() {
    let machine = Document::parse(SMALL, "small.toml").unwrap();
    let conditions = Hidden::conditions(&machine, 10, 3, &[]);
    let hidden = |lines: &[(&str, &str)], seed: u64| {
        Hidden { machine: &machine, cells: (300, 300), lines, conditions: conditions.clone(), seed }.problem()
    };
    // These readings are made by the file itself, whose numbers and heats are off by nothing.
    let mut exact = hidden(&[], 1);
    exact.settings.usual = Looseness::default();
    let planned = plan(&exact, &Silent).unwrap();
    let careful = plan(&hidden(&[], 1), &Silent).unwrap();
    let of =
        |planned: &Plan| planned.seen.iter().find(|own| own.hypothesis.kind() == "heat source" && own.hypothesis.place == "plate").cloned();
    let own = of(&planned).unwrap();
    assert!(of(&careful).is_none_or(|careful| own.least < careful.least));
    let alarms = |watts: f64| {
        let entry = format!("{{ in = [\"plate\"], power = \"{watts} W\" }}");
        let found = SEEDS.map(|seed| diagnose(&hidden(&[("source.hidden", &entry)], seed), &Silent).unwrap().verdict);
        found.filter(|verdict| *verdict != Verdict::Consistent).count()
    };
    let (seen, less) = (alarms(own.least), alarms(0.25 * own.least));
    println!("{:.2} W, {:.3} K: {seen} of 4, of a quarter {less}", own.least, own.change);
    assert!(seen >= 3 && less <= 1, "{:.2} W: {seen} of 4, of a quarter {less}", own.least);
}

/// Two names of one heat are never told apart; a sensor on the part that has none tells most.
#[test]
fn two_names_of_one_heat_and_a_sensor_more() {
    let few = SMALL.replace("[sensor.bearing]\npart = \"bearing\"\n", "");
    let few = Document::parse(&few, "few.toml").unwrap();
    let conditions = Hidden::conditions(&few, 10, 3, &[]);
    let problem = Hidden { machine: &few, cells: (300, 300), lines: &[], conditions, seed: 1 }.problem();
    let planned = plan(&problem, &Silent).unwrap();
    println!("{:?}", planned.further);
    assert_eq!(planned.further.first().map(|own| own.name.as_str()), Some("bearing, mean"));
    let named = |n: &usize| planned.seen[*n].hypothesis.kind_and_place();
    let groups: Vec<Vec<String>> = planned.alike.iter().map(|group| group.iter().map(named).collect()).collect();
    println!("{groups:#?}");
    assert!(groups.iter().any(|group| group.iter().filter(|name| name.ends_with("bearing")).count() > 1), "{groups:?}");
    // Nothing is both seen and not.
    assert!(planned.unseen.iter().all(|h| planned.seen.iter().all(|own| own.hypothesis != *h)));
}

/// Every variable at both ends of its range, the others at their defaults.
#[test]
fn conditions_of_a_plan() {
    let machine = Document::parse(SMALL, "small.toml").unwrap();
    let study = coldplate_solve::study::Study::new(machine, Some(200)).unwrap();
    let data = planned_conditions(&study.model.machine).unwrap();
    // The default speed is the end of its range.
    assert_eq!(data.rows.len(), 1 + 2 * 4 - 1);
    assert_eq!(data.sensors.len(), study.model.machine.sensors.len());
}
