//! One schema says what a machine file may hold: misspelt keys, defaults and parameters come from it.

use coldplate_base::document::Document;
use coldplate_describe::machine::{Machine, SCHEMA};
use coldplate_describe::schema::{Unstated, ValueForm};
use coldplate_solve::study::MachineParameter;

const PLATE: &str = include_str!("plate.toml");

/// A misspelt key is named together with the right one, and all that are known there are listed, also where the key
/// had to be given.
#[test]
fn misspelt_keys_are_named_with_the_right_ones() {
    let cases = [
        ("conductance =", "conductence =", "conductence", "did you mean 'conductance'?"),
        ("rise =", "rize =", "rize", "did you mean 'rise'?"),
        ("film =", "h =", "h", "did you mean 'film'?"),
        ("conductance =", "h =", "h", "did you mean 'conductance'?"),
        ("power =", "heat =", "heat", "did you mean 'power'?"),
        ("between =", "betwen =", "betwen", "did you mean 'between'?"),
        ("material = \"steel\"\nbox", "materiel = \"steel\"\nbox", "materiel", "did you mean 'material'?"),
        ("[contact.motor]", "[kontact.motor]", "kontact", "did you mean 'contact'?"),
        ("starting_torque =", "startig_torque =", "startig_torque", "did you mean 'starting_torque'?"),
        ("part = \"motor\"", "prat = \"motor\"", "prat", "did you mean 'part'?"),
    ];
    for (right, wrong, key, meant) in cases {
        let text = PLATE.replacen(right, wrong, 1);
        let error = Machine::from_text(&text, "plate.toml", &[]).unwrap_err().to_string();
        for needle in [&format!("unknown key '{key}'"), meant, "Known here:", "plate.toml:"] {
            assert!(error.contains(needle), "{wrong}: {needle} is not in\n{error}");
        }
    }
    let text = PLATE.replace("conductance =", "conductence =");
    let error = Machine::from_text(&text, "plate.toml", &[]).unwrap_err().to_string();
    for key in ["between", "total_conductance", "temperature_table", "pressure_table", "pressure", "rough", "bonded", "insulated", "area"] {
        assert!(error.contains(key), "{key} is not in\n{error}");
    }
}

/// Every default of the schema, written into a file that leaves it out, changes nothing but the file's hash.
#[test]
fn defaults_written_out_change_nothing() {
    let plain = described(&[]);
    let mut tried = 0;
    for (pattern, key) in SCHEMA.patterns() {
        // A formula remembers where it was written.
        let Some(value) = key.default_toml().filter(|_| key.form.formula().is_none()) else { continue };
        let table = pattern.rsplit_once('.').map_or("", |(table, _)| table);
        // Keys that belong to a shape, an imported mesh or a point have no place in this file.
        let place = match table {
            "chamber" | "mesh" => pattern.clone(),
            "drive.*" => pattern.replace('*', "y"),
            "source.*" => pattern.replace('*', "motor"),
            "part.*" if key.name != "unit" => pattern.replace('*', "motor"),
            _ => continue,
        };
        assert_eq!(described(&[(place.clone(), value)]), plain, "{place}");
        tried += 1;
    }
    assert!(tried > 20, "{tried}");
}

/// Everything read from the plate with some values set, but for the hash of the file.
fn described(sets: &[(String, String)]) -> String {
    let mut machine = Machine::from_text(PLATE, "plate.toml", sets).unwrap();
    machine.hash.clear();
    format!("{machine:?}")
}

/// What is left at its default is a parameter too, where it varies continuously.
#[test]
fn unstated_keys_are_parameters_at_their_defaults() {
    let document = Document::parse(PLATE, "plate.toml").unwrap();
    let machine = Machine::from_document(&document).unwrap();
    let find = |name: &str| MachineParameter::find(name, &document, &machine);
    for (name, value, unit) in [
        ("drive.y.ratio", 5.0, "1"),
        ("drive.y.acceleration_time", 0.2, "s"),
        ("drive.y.motor_efficiency", 0.9, "1"),
        ("chamber.pressure", 0.0, "Pa"),
        ("chamber.gap", 0.5, "m"),
        ("source.motor.reference_temperature", 293.15, "degC"),
    ] {
        let found = find(name).unwrap();
        assert!((found.value - value).abs() < 1e-9 && found.unit == unit, "{name}: {found:?}");
    }
    for (name, reason) in [("mesh.cells", "counts something"), ("part.motor.align", "is a word")] {
        assert!(find(name).unwrap_err().to_string().contains(reason), "{name}");
    }
    let near = find("drive.y.ration").unwrap_err().to_string();
    assert!(near.contains("did you mean 'drive.y.ratio'?"), "{near}");
}

/// A number with a default is a number: its form has a dimension, and the default lies in it.
#[test]
fn defaults_fit_their_forms() {
    for (pattern, key) in SCHEMA.patterns() {
        let fits = match (key.default, key.form) {
            (Unstated::Whole(number), ValueForm::Whole(least)) => number >= least,
            (Unstated::Flag(_), ValueForm::Flag) | (Unstated::Nothing | Unstated::Follows(_), _) => true,
            (Unstated::Si(si), form) => si.is_finite() && !matches!(form, ValueForm::Text | ValueForm::Flag | ValueForm::Whole(_)),
            (Unstated::Text(text), ValueForm::Word(words)) => words.contains(&text),
            (Unstated::Text(_), ValueForm::Formula(_) | ValueForm::Text) => true,
            (Unstated::Text(text), ValueForm::Either(forms)) => {
                forms.iter().any(|f| matches!(f, ValueForm::Word(words) if words.contains(&text)))
            }
            _ => false,
        };
        assert!(fits, "{pattern}: {:?}", key.default);
        assert!(!key.doc.is_empty() && !key.doc.ends_with('.'), "{pattern}");
        assert!(!key.is_required || key.default == Unstated::Nothing, "{pattern} is required and has a default");
    }
}
