//! Conditions with units, batches, and the command's exit status.

use coldplate_base::error::{Error, Result};
use coldplate_base::progress::Silent;
use coldplate_surrogate::fit::file::{encode, open};
use coldplate_surrogate::verdict::condition::condition;
use coldplate_surrogate::verdict::stream::{AnswerForm, answer};

use crate::surrogate::examples::*;

fn pairs(given: &[(&str, &str)]) -> Vec<(String, String)> {
    given.iter().map(|(n, v)| ((*n).into(), (*v).into())).collect()
}

fn read(given: &[(&str, &str)]) -> Result<Vec<f64>> {
    condition(&open(&encode(&small()).unwrap()).unwrap(), &pairs(given))
}

#[test]
fn values_arrive_in_the_units_of_the_file() {
    let x = read(&[("coolant_temperature", "293.15 K"), ("coolant_flow", "1.5e-4 m3/s"), ("ambient-temperature", "21 degC")]).unwrap();
    for (found, expected) in x.iter().zip([9.0, 20.0, 21.0]) {
        assert!((found - expected).abs() < 1e-12, "{x:?}");
    }
}

#[test]
fn the_ends_of_the_range_stay_inside_through_any_unit() {
    let bytes = encode(&small()).unwrap();
    let file = open(&bytes).unwrap();
    for flow in ["2 L/min", "12 L/min", "2e-4 m3/s", "0.12 m3/h", "720 L/h"] {
        for (coolant, ambient) in [("15 degC", "18 degC"), ("25 degC", "26 degC"), ("288.15 K", "299.15 K"), ("298.15 K", "291.15 K")] {
            let given = [("coolant_flow", flow), ("coolant_temperature", coolant), ("ambient_temperature", ambient)];
            let x = condition(&file, &pairs(&given)).unwrap();
            assert!(file.in_domain(&x), "{given:?}: {x:?}");
        }
    }
    let x = read(&[("coolant_flow", "12.000001 L/min"), ("coolant_temperature", "20 degC"), ("ambient_temperature", "20 degC")]).unwrap();
    assert!(!file.in_domain(&x));
}

#[test]
fn mistakes_are_named_with_their_remedy() {
    let full = [("coolant_flow", "8 L/min"), ("coolant_temperature", "20 degC"), ("ambient_temperature", "21 degC")];
    let mistake = |given: &[(&str, &str)], needles: &[&str]| {
        let message = read(given).unwrap_err().to_string();
        assert!(needles.iter().all(|n| message.contains(n)), "{message}");
    };
    mistake(&full[..2], &["ambient_temperature", "missing"]);
    mistake(&[full[0], full[1], ("ambient_temprature", "21 degC")], &["ambient_temprature", "did you mean 'ambient_temperature'"]);
    mistake(&[full[0], full[1], full[2], ("motor_speed", "2500 rpm")], &["motor_speed", "its variables are"]);
    mistake(&[full[0], full[0], full[1]], &["coolant_flow", "twice"]);
    mistake(&[("coolant_flow", "8"), full[1], full[2]], &["coolant_flow", "L/min"]);
    mistake(&[("coolant_flow", "8 degC"), full[1], full[2]], &["coolant_flow", "L/min"]);
}

#[test]
fn a_variable_of_ones_own_goes_by_its_unit() {
    let bytes = encode(&mixed()).unwrap();
    let file = open(&bytes).unwrap();
    let x = condition(&file, &pairs(&[("feed", "0.05 m/s"), ("coolant_flow", "3 L/min"), ("ambient_temperature", "20 degC")])).unwrap();
    assert!((x[1] - 50.0).abs() < 1e-12 && x[2] == 20.0, "{x:?}");
}

/// The labels, if there are any, and the conditions of a table, as they are read.
fn rows(columns: &str, text: &str, given: &[(&str, &str)]) -> Result<Vec<Vec<String>>> {
    let (bytes, form) = (encode(&small()).unwrap(), AnswerForm { columns: vec![columns.into()], ..AnswerForm::default() });
    let mut answers = Vec::new();
    answer(&open(&bytes).unwrap(), text.as_bytes(), &pairs(given), &form, None, &Silent, |piece| answers.extend(piece))?;
    let answers = String::from_utf8(answers).unwrap();
    Ok(answers.lines().skip(1).map(|line| coldplate_tables::cells(line).unwrap()).collect())
}

#[test]
fn a_table_of_conditions_is_read_by_its_header() {
    let text = "\u{feff}# two conditions\r\ntest, coolant_temperature [K], ambient_temperature, coolant_flow [L/min], motor [degC]\r\n\
                \"first, cold\", 288.15, 21 degC, 8, 26.1\r\n\r\nsecond, 298.15, 294.15 K, 2.5e0,\r\n";
    let rows = rows("test,conditions", text, &[]).unwrap();
    assert_eq!((rows[0][..3].join("|"), rows[1][..3].join("|")), ("first, cold|8|15".into(), "second|2.5|25".into()));
    assert!(rows.iter().all(|row| (row[3].parse::<f64>().unwrap() - 21.0).abs() < 1e-12), "{rows:?}");
}

#[test]
fn a_bad_row_or_column_is_named() {
    let header = "coolant_flow [L/min],coolant_temperature [degC],ambient_temperature [degC]\n";
    let bad = |text: &str, given: &[(&str, &str)]| -> Error { rows("conditions", text, given).unwrap_err() };
    for (body, line, key) in [
        ("8,20,21\n8,x,21\n", 3, Some("coolant_temperature")),
        ("8,20\n", 2, None),
        ("8,20,21,5\n", 2, None),
        ("8,20,21\n\n8,nan,21\n", 4, Some("coolant_temperature")),
        ("8,,21\n", 2, Some("coolant_temperature")),
        ("8,\"20,21\n", 2, None),
    ] {
        let error = bad(&format!("{header}{body}"), &[]);
        assert_eq!((error.location().line, error.location().key.as_deref()), (Some(line), key), "{body:?}: {error}");
    }
    let needles = |error: Error, needle: &str| assert!(error.to_string().contains(needle), "{error}");
    needles(bad("coolant_flow [L/min],coolant_temperature [degC]\n8,20\n", &[]), "ambient_temperature");
    needles(bad("coolant_flw [L/min]\n8\n", &[]), "did you mean 'coolant_flow'");
    needles(bad("coolant_flow [bar]\n8\n", &[]), "bar");
    needles(bad(&format!("{header}8,20,21\n"), &[("coolant_flow", "8 L/min")]), "twice");
    needles(bad(header, &[]), "no conditions");
    needles(bad("", &[]), "no header");
    let short = "coolant_flow [L/min],coolant_temperature [degC]\n8,20\n";
    assert_eq!(rows("conditions", short, &[("ambient_temperature", "21 degC")]).unwrap()[0], ["8", "20", "21"]);
}
