//! Numbers that a machine file states as uncertain.

use coldplate::evidence::identify::Free;
use coldplate::foundation::document::Document;
use coldplate::solve::sensitivity::{Study, UncertainNumber};

const PLATE: &str = include_str!("plate.toml");

fn study(sets: &[(&str, &str)]) -> Study {
    let mut document = Document::parse(PLATE, "plate.toml").unwrap();
    sets.iter().for_each(|(key, value)| document.apply_set(key, value).unwrap());
    Study::new(document, Some(200)).unwrap()
}

/// The model is that of the numbers themselves, and the numbers are parameters as any other.
#[test]
fn a_number_stays_the_number_it_is() {
    let key = "contact.motor.conductance";
    let plain = study(&[(key, "\"560 W/(m2 K)\"")]);
    assert!(plain.uncertain().unwrap().is_empty());
    for (text, deviation, limits) in [
        ("560 +- 40 W/(m2 K)", 40.0, None),
        ("560 W/(m2 K) ± 40 W/(m2 K)", 40.0, None),
        ("560 W/(m2 K) +- 10 %", 56.0, None),
        ("500 .. 620 W/(m2 K)", 60.0 / 3f64.sqrt(), Some((500.0, 620.0))),
    ] {
        let stated = study(&[(key, &format!("\"{text}\""))]);
        assert_eq!(stated.parameter(key).unwrap().value, 560.0, "{text}");
        assert_eq!(format!("{:?}", stated.model.network.contacts), format!("{:?}", plain.model.network.contacts), "{text}");
        let UncertainNumber { parameter, deviation: found, limits: between } = stated.uncertain().unwrap().remove(0);
        assert!(parameter.name == key && (found - deviation).abs() < 1e-9, "{text}: {found}");
        assert!(between.zip(limits).is_none_or(|(a, b)| (a.0 - b.0).abs() < 1e-9 && (a.1 - b.1).abs() < 1e-9));
        assert_eq!(between.is_some(), limits.is_some());
        // What the file says is what a search begins with; what the command says takes its place.
        let free = Free::parse(key, &stated).unwrap();
        match limits {
            None => assert_eq!(free.prior, Some((560.0, found))),
            Some(_) => assert!((free.bounds.0 - 500.0).abs() < 1e-3 && (free.bounds.1 - 620.0).abs() < 1e-3 && free.prior.is_none()),
        }
        assert!(Free::parse(&format!("{key}=400..700 W/(m2 K)"), &stated).unwrap().prior.is_none());
    }
    let of_paint =
        study(&[("surfaces", "{ effective_emissivity = \"0.5 +- 0.1\" }"), ("chamber", "{ temperature = \"23 degC +- 0.5 K\" }")]);
    let found: Vec<(String, f64)> = of_paint.uncertain().unwrap().into_iter().map(|u| (u.parameter.name, u.deviation)).collect();
    assert!(found.contains(&("surfaces.effective_emissivity".into(), 0.1)) && found.contains(&("chamber.temperature".into(), 0.5)));
}

#[test]
fn what_is_no_uncertainty_is_refused_with_its_place() {
    for (key, text, said) in [
        ("contact.motor.conductance", "560 +- 0 W/(m2 K)", "positive"),
        ("contact.motor.conductance", "560 +- -4 W/(m2 K)", "positive"),
        ("boundary.foot.fluid_temperature", "23 degC +- 5 %", "share of a temperature"),
    ] {
        let error = study(&[(key, &format!("\"{text}\""))]).uncertain().unwrap_err().to_string();
        assert!(error.contains(said) && error.contains(key) && error.contains("plate.toml"), "{error}");
    }
    // Another unit behind the sign is no quantity at all.
    let mut document = Document::parse(PLATE, "plate.toml").unwrap();
    document.apply_set("contact.motor.conductance", "\"560 W/(m2 K) +- 4 K\"").unwrap();
    let error = Study::new(document, Some(200)).unwrap_err().to_string();
    assert!(error.contains("contact.motor.conductance"), "{error}");
}
