//! Steps that are followed along slopes end nowhere that the machine does not.

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_diagnose::diagnose;
use coldplate_testing::machines::SMALL;

use super::hidden::Hidden;

/// A hose takes nine tenths of what the gear radiates. By slopes its emissivity would have to be beyond that of a black surface, where more
/// of it changes nothing: from there it must be found back to what explains most.
#[test]
fn from_beyond_a_black_surface() {
    let machine = Document::parse(SMALL, "small.toml").unwrap();
    let lines = [
        ("node.outside", "{ temperature = \"ambient_temperature\" }"),
        ("contact.hose", "{ between = [\"gear\", \"outside\"], total_conductance = \"0.16 W/K\" }"),
    ];
    let hidden =
        Hidden { machine: &machine, cells: (300, 500), lines: &lines, conditions: Hidden::conditions(&machine, 12, 51, &[]), seed: 52 };
    let found = diagnose(&hidden.problem(), &Silent).unwrap();
    let is_it = |c: &coldplate_diagnose::Cause| c.hypothesis.kind() == "emissivity" && c.hypothesis.place == "gear";
    let alone = found.explanations.iter().find(|e| e.causes.len() == 1 && is_it(&e.causes[0])).expect("it explains much");
    let cause = &alone.causes[0];
    println!("{} +- {}", cause.amplitude, cause.deviation);
    assert!(cause.amplitude > 0.5 && cause.deviation < 0.2);
    assert!(found.explanations.iter().flat_map(|e| &e.causes).filter(|c| is_it(c)).all(|c| c.amplitude <= 2f64.ln()), "more than black");
}
