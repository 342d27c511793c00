//! Formulas: arithmetic against hand-calculated values, derivatives against differences, errors.

use coldplate_base::error::Location;
use coldplate_base::formula::{Formula, FormulaNames, FormulaValues};
use coldplate_base::units::Dimension;

fn names() -> FormulaNames {
    let mut names = FormulaNames::default();
    names.add_bare("ambient_temperature", Dimension::TEMPERATURE).unwrap();
    for name in ["ambient_temperature_degC", "motor_speed_rpm", "min_flow", "y_motor_W"] {
        names.add(name).unwrap();
    }
    names
}

fn values() -> FormulaValues {
    FormulaValues(vec![296.65, 23.5, 2500.0, 3.0, 113.7])
}

fn parse(text: &str, dimension: Dimension) -> coldplate_base::error::Result<Formula> {
    Formula::parse(text, dimension, None, &names(), Location::default())
}

#[test]
fn arithmetic_follows_the_rules_of_mathematics() {
    for (text, expected) in [
        ("min_flow * 0 + 9.451e-4", 9.451e-4),
        ("min_flow - 3 + 2^3^2", 512.0),
        ("-min_flow^2", -9.0),
        ("2^-1 * min_flow", 1.5),
        ("min_flow ** 2", 9.0),
        ("max(1, min(2, min_flow), 0.5)", 2.0),
        ("abs(-min_flow) + sqrt(16) - ln(exp(2))", 5.0),
        ("min_flow - 2 - 1", 0.0),
        ("12 / min_flow / 2", 2.0),
        ("2 * (min_flow + 1) ^ 2", 32.0),
        ("log10(1000) * min_flow + cos(0) - sin(0) + tanh(0) + tan(0)", 10.0),
        ("2 * pi * min_flow", 6.0 * std::f64::consts::PI),
        ("y_motor_W / 2", 56.85),
        ("interpolate(motor_speed_rpm, 300, 43, 2000, 20, 3000, 2 * 5)", 15.0),
        ("interpolate(min_flow, 4, -1, 6, 2) + interpolate(min_flow, 0, 1, 2, 7)", 6.0),
        ("interpolate(min_flow, 4, 8) * interpolate(3, 2, 1, 4, 3)", 16.0),
    ] {
        let value = parse(text, Dimension::POWER).unwrap().evaluate(&values()).unwrap();
        assert!((value - expected).abs() < 1e-12 * expected.abs().max(1.0), "{text} = {value}, expected {expected}");
    }
}

/// Machine tools have tables, sliders and feeds: a variable can have the name of a part.
#[test]
fn names_of_parts_stay_free_for_variables() {
    let mut names = names();
    let mut values = values();
    for name in ["table", "slider", "feed"] {
        names.add(name).unwrap();
        values.0.push(2.0);
    }
    assert!(names.add("interpolate").is_err());
    let formula = Formula::parse("interpolate(table, 1, 5, 3, 9) + table", Dimension::POWER, None, &names, Location::default()).unwrap();
    assert_eq!(formula.evaluate(&values).unwrap(), 9.0);
}

#[test]
fn slots_take_constants_variables_and_expressions_in_their_unit() {
    let at = |formula: Formula| formula.evaluate(&values()).unwrap();
    assert_eq!(parse("20.5 degC", Dimension::TEMPERATURE).unwrap().as_constant(), Some(293.65));
    assert_eq!(at(parse("ambient_temperature", Dimension::TEMPERATURE).unwrap()), 296.65);
    assert!((at(parse("ambient_temperature_degC + 2", Dimension::TEMPERATURE).unwrap()) - 298.65).abs() < 1e-12);
    assert!((at(parse("0.0453 * motor_speed_rpm + 2", Dimension::POWER).unwrap()) - 115.25).abs() < 1e-12);
    assert!((at(parse("motor_speed_rpm / 5", Dimension::ANGULAR_SPEED).unwrap()) - 52.359_877_559_829_88).abs() < 1e-12);
    let litres = Formula::parse("3 * min_flow", Dimension::VOLUME_FLOW, Some("L/min"), &names(), Location::default()).unwrap();
    assert!((at(litres) - 1.5e-4).abs() < 1e-18);
    assert_eq!(parse("motor_speed_rpm", Dimension::POWER).unwrap().as_constant(), None);
    // Expressions without names are constants in the slot's unit.
    for (text, watts) in [("2 * pi", 2.0 * std::f64::consts::PI), ("100 / 4", 25.0), ("sqrt(4)", 2.0), ("-(1 - 3)", 2.0), ("2e1 + 1", 21.0)]
    {
        assert_eq!(parse(text, Dimension::POWER).unwrap().as_constant(), Some(watts), "{text}");
    }
    assert_eq!(parse("40 / 2", Dimension::TEMPERATURE).unwrap().as_constant(), Some(293.15));
}

#[test]
fn derivatives_agree_with_differences() {
    let tangent = FormulaValues(vec![0.0, 0.0, 1.0, -2.0, 0.5]);
    let h = 1e-4;
    let moved = |sign: f64| FormulaValues(values().0.iter().zip(&tangent.0).map(|(v, t)| v + sign * h * t).collect());
    for text in [
        "motor_speed_rpm * min_flow / y_motor_W",
        "sqrt(motor_speed_rpm) ^ (min_flow / 4)",
        "exp(-min_flow) + ln(y_motor_W) * log10(motor_speed_rpm)",
        "max(min_flow, y_motor_W) - min(min_flow, 2 * motor_speed_rpm) + abs(-min_flow)",
        "sin(min_flow) * cos(y_motor_W) + tan(min_flow) + tanh(min_flow)",
        "(min_flow - 3) ^ 2 + (min_flow - 5) ^ 3",
        "interpolate(min_flow * y_motor_W, 0, 1, 300, 2, 400, -5) + interpolate(min_flow, 0, 2, 1, 9)",
    ] {
        let formula = parse(text, Dimension::POWER).unwrap();
        let exact = formula.derivative(&values(), &tangent).unwrap();
        let difference = (formula.evaluate(&moved(1.0)).unwrap() - formula.evaluate(&moved(-1.0)).unwrap()) / (2.0 * h);
        assert!((exact - difference).abs() < 1e-6 * exact.abs().max(1.0), "{text}: {exact} {difference}");
    }
}

#[test]
fn mistakes_are_explained() {
    for (text, dimension, needle) in [
        ("0.04 * motor_sped_rpm", Dimension::POWER, "did you mean 'motor_speed_rpm'"),
        ("ambient_temperature + 2", Dimension::TEMPERATURE, "write ambient_temperature_degC"),
        ("ambient_temperature", Dimension::POWER, "not of this kind"),
        ("20.5", Dimension::TEMPERATURE, "without its unit"),
        ("20.5 degc", Dimension::TEMPERATURE, "unknown unit 'degc'"),
        ("5 L/min", Dimension::POWER, "not the unit"),
        ("2 * (motor_speed_rpm", Dimension::POWER, "')' is missing"),
        ("motor_speed_rpm *", Dimension::POWER, "a number or a name is missing"),
        ("motor_speed_rpm $ 2", Dimension::POWER, "'$' (character 17)"),
        ("max(motor_speed_rpm)", Dimension::POWER, "two arguments"),
        ("sqrt(motor_speed_rpm, 2)", Dimension::POWER, "one argument"),
        ("motor_speed_rpm 2", Dimension::POWER, "is not expected"),
        ("1.2.3 * motor_speed_rpm", Dimension::POWER, "not a number"),
        ("", Dimension::POWER, "no number"),
        ("1/0", Dimension::POWER, "no finite value from character 2 on"),
        ("3 + sqrt(-1)", Dimension::POWER, "no finite value from character 5 on"),
        ("2 +", Dimension::POWER, "a number or a name is missing at the end"),
        ("2 % 3", Dimension::POWER, "'3' has no place in a unit"),
        ("2 * p", Dimension::POWER, "unknown name 'p' (character 5)"),
        ("-1 degC * motor_speed_rpm", Dimension::POWER, "not expected"),
        ("interpolate(min_flow)", Dimension::POWER, "write interpolate(x, x0, y0, x1, y1, ...) with x0 < x1"),
        ("interpolate(min_flow, 1, 2, 3)", Dimension::POWER, "3 numbers after the first argument"),
        ("interpolate(min_flow, 1, 2, 1, 3)", Dimension::POWER, "1 does not lie beyond 1"),
        ("interpolate(min_flow, 1, motor_speed_rpm)", Dimension::POWER, "depends on a name (character 26)"),
        ("interpolate(min_flow, 1, 1 / 0)", Dimension::POWER, "a number of 'interpolate' is inf"),
    ] {
        let error = parse(text, dimension).unwrap_err();
        assert!(error.to_string().contains(needle), "{text}: {error}");
    }
    let place = Location { file: Some("m.toml".into()), line: Some(7), key: Some("source.a.power".into()) };
    let formula = Formula::parse("1 / (min_flow - 3)", Dimension::POWER, None, &names(), place).unwrap();
    let message = formula.evaluate(&values()).unwrap_err().to_string();
    assert!(message.contains("m.toml:7, source.a.power") && message.contains("1 / (min_flow - 3)"), "{message}");
    assert!(Formula::parse("1", Dimension::POWER, Some("degC"), &names(), Location::default()).is_err());
}

#[test]
fn deep_nesting_and_noise_are_refused_without_a_panic() {
    for deep in ["(".repeat(100_000), "-".repeat(100_000), "2^".repeat(100_000), "sqrt(".repeat(100_000)] {
        assert!(parse(&format!("{deep}motor_speed_rpm"), Dimension::POWER).is_err());
    }
    let mut state = 1_u64;
    let pieces: Vec<&str> = "(|)|+|-|*|/|^|max|sqrt|interpolate(|,|1e|9|.|min_flow| |°|é|W|degC|_|e+".split('|').collect();
    for _ in 0..20_000 {
        let mut text = String::new();
        for _ in 0..12 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            text.push_str(pieces[(state >> 33) as usize % pieces.len()]);
        }
        if let Ok(formula) = parse(&text, Dimension::POWER) {
            let _ = formula.evaluate(&values());
            let _ = formula.derivative(&values(), &values());
        }
    }
}
