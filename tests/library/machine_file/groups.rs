//! Parts that radiate alike by one number.

use coldplate_base::document::Document;
use coldplate_describe::machine::Machine;
use coldplate_solve::study::Study;

const PARTS: &str = r#"
name = "three blocks"
[part.motor]
material = "steel"
box = ["40 mm", "40 mm", "40 mm"]
[part.gear]
material = "steel"
box = ["40 mm", "40 mm", "40 mm"]
at = ["100 mm", "0 mm", "0 mm"]
[part.bright]
material = "steel"
box = ["40 mm", "40 mm", "40 mm"]
at = ["200 mm", "0 mm", "0 mm"]
[source.all]
in = ["motor", "gear", "bright"]
power = "15 W"
[sensor.motor]
part = "motor"
[sensor.gear]
part = "gear"
[sensor.bright]
part = "bright"
[surfaces]
emissivity = 0.3
[surfaces.group.painted]
parts = ["motor", "gear"]
emissivity = 0.9
"#;

fn study(text: &str) -> Study {
    Study::new(Document::parse(text, "groups.toml").unwrap(), Some(60)).unwrap()
}

#[test]
fn one_number_holds_for_all_parts_of_a_group() {
    let study = study(PARTS);
    let emissivities = |study: &Study| study.model.machine.parts.iter().map(|p| p.surface.emissivity).collect::<Vec<_>>();
    assert_eq!(emissivities(&study), [0.9, 0.9, 0.3]);
    let all = study.parameter("surfaces.group.painted.emissivity").unwrap();
    assert_eq!(emissivities(&study.with(&[(&all, 0.6)]).unwrap()), [0.6, 0.6, 0.3]);
    // A part's own comes first, and can be varied from the group's.
    let own = study.parameter("part.gear.surface.emissivity").unwrap();
    assert_eq!(own.value, 0.9);
    assert_eq!(emissivities(&study.with(&[(&own, 0.5)]).unwrap()), [0.9, 0.5, 0.3]);
    assert!(study.usual_parameters().iter().any(|p| p.name == "surfaces.group.painted.emissivity"));
    // The derivative with respect to the one number is the sum of those with respect to each.
    let conditions = ["coolant_flow", "coolant_temperature", "motor_speed", "ambient_temperature"].into_iter();
    let given: Vec<(&str, &str)> = conditions.zip(["1 L/min", "20 degC", "0 rpm", "22 degC"]).collect();
    let at = study.at(&study.model.machine.condition(&given).unwrap()).unwrap();
    let parameters = [all, study.parameter("part.motor.surface.emissivity").unwrap(), own];
    for row in at.jacobian(&study.sensors(), &parameters).unwrap().slopes {
        assert!((row[0] - row[1] - row[2]).abs() <= 1e-6 * row[0].abs() + 1e-9, "{row:?}");
    }
}

#[test]
fn groups_that_cannot_be_are_refused() {
    for (from, to, needles) in [
        ("parts = [\"motor\", \"gear\"]", "parts = [\"motr\"]", &["motr", "did you mean 'motor'"][..]),
        ("emissivity = 0.9", "", &["painted", "no emissivity"]),
        ("emissivity = 0.9", "emissivity = 1.9", &["above 0 and at most at 1"]),
        ("emissivity = 0.9", "emissivity = 0.9\n[surfaces.group.dull]\nparts = [\"gear\"]\nemissivity = 0.5", &["'painted' already"]),
        ("emissivity = 0.9", "emissivity = 0.9\nemisivity = 0.9", &["emisivity", "emissivity"]),
    ] {
        let text = PARTS.replace(from, to);
        let error = Machine::from_document(&Document::parse(&text, "groups.toml").unwrap()).unwrap_err().to_string();
        needles.iter().for_each(|n| assert!(error.contains(n), "{to}: {error}"));
    }
}
