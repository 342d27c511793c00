//! Numbers that a machine file states as uncertain.

use coldplate_base::document::Document;
use coldplate_evidence::identify::Free;
use coldplate_solve::sensitivity::UncertainNumber;
use coldplate_solve::study::Study;

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

/// Factors that several numbers share, correlations, and what the model misses.
#[test]
fn factors_correlations_and_the_models_own_error() {
    let key = "contact.motor.conductance";
    let study = study(&[
        (key, "\"560 +- 40 W/(m2 K)\""),
        ("uncertain.paint", "{ all = \"emissivities\", limits = \"12 %\", source = \"data sheet\" }"),
        ("uncertain.heats", "{ numbers = [\"source.motor.power\"], deviation = \"4 %\" }"),
        ("correlation", "[{ between = [\"contact.motor.conductance\", \"heats\"], value = 0.6 }]"),
        ("model_error", "{ sensors = \"0.3 K\", common = \"0.2 K\", growth = 0.5 }"),
    ]);
    let open = study.open_parameters(true).unwrap();
    let of = |name: &str| open.iter().position(|p| p.name == name).unwrap_or_else(|| panic!("{name}"));
    assert!((open[of("paint")].deviation - 0.12 / 3f64.sqrt()).abs() < 1e-12);
    assert!((open[of(key)].deviation - 40.0).abs() < 1e-9 && (open[of("heats")].deviation - 0.04).abs() < 1e-12);
    // Contacts, heats and emissivities are stated, so nothing is assumed of them.
    let assumed: Vec<&str> =
        open.iter().filter(|p| p.origin == coldplate_solve::sensitivity::Origin::Assumed).map(|p| p.name.as_str()).collect();
    assert!(assumed.iter().all(|name| *name == "all films"), "{assumed:?}");
    assert!(study.open_parameters(false).unwrap().len() == 3);
    let correlations = study.correlations(&open).unwrap();
    assert_eq!(correlations[of(key)][of("heats")], 0.6);
    let error = &study.model.machine.model_error;
    assert!(error.sensors.iter().all(|k| *k == 0.3) && error.common == 0.2 && error.growth == 0.5);
}

#[test]
fn what_is_no_factor_is_refused_with_its_place() {
    for (key, value, said) in [
        ("uncertain.x", "{ deviation = \"4 %\" }", "multiplies nothing"),
        ("uncertain.x", "{ all = \"filns\", deviation = \"4 %\" }", "films"),
        ("uncertain.x", "{ all = \"films\" }", "how uncertain"),
        ("uncertain.x", "{ all = \"films\", deviation = \"-4 %\" }", "more than nothing"),
        ("uncertain.x", "{ all = \"films\", deviation = 2 }", "less than all"),
        ("uncertain.x", "{ numbers = [], deviation = \"4 %\" }", "no number"),
        ("uncertain.x", "{ numbers = [\"contact.motor.conductence\"], deviation = \"4 %\" }", "conductance"),
        ("uncertain.x", "{ numbers = [\"chamber.temperature\"], deviation = \"4 %\" }", "no factor"),
        ("uncertain.x", "{ all = \"films\", deviation = \"4 %\", sorce = \"me\" }", "source"),
        ("correlation", "[{ between = [\"a\"], value = 0.5 }]", "two names"),
        ("correlation", "[{ between = [\"a\", \"b\"], value = 1.5 }]", "between -1 and 1"),
        ("correlation", "[{ between = [\"all heats\", \"b\"], value = 0.5 }]", "not uncertain"),
        ("prior", "{ sensor_ofset = \"0.05 K\" }", "sensor_offset"),
        ("prior", "{ sensor_offset = \"0 K\" }", "larger than zero"),
        ("model_error", "{ sensors = \"-0.3 K\" }", "not negative"),
        ("model_error", "{ sensor = { nobody = \"0.3 K\" } }", "no sensor"),
        ("model_error", "{ measured = [{ coolant_flow = \"8 L/min\" }] }", "1 of 4 variables"),
    ] {
        let mut document = Document::parse(PLATE, "plate.toml").unwrap();
        document.apply_set(key, value).unwrap();
        let open = |study: Study| study.open_parameters(true).and_then(|open| study.correlations(&open));
        let error = Study::new(document, Some(200)).and_then(open).unwrap_err().to_string();
        assert!(error.contains(said) && error.contains("plate.toml"), "{key} = {value}: {error}");
    }
}
