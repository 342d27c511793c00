//! `update`: a reading counts once.

use crate::common::{coldplate, json, message, scratch};

const HEADER: &str = "coolant_flow [L/min],coolant_temperature [degC],ambient_temperature [degC],motor [degC],screw nut [degC]\n";

/// The surrogate's own answers at a condition, as a row of readings.
fn row(file: &str, flow: f64, coolant: f64, ambient: f64) -> String {
    let args = [format!("{flow} L/min"), format!("{coolant} degC"), format!("{ambient} degC")];
    let output = coldplate(&[
        "query",
        file,
        "--coolant-flow",
        &args[0],
        "--coolant-temperature",
        &args[1],
        "--ambient-temperature",
        &args[2],
        "--json",
    ]);
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let at = |point: &str| answer["temperatures"][point]["degC"].as_f64().unwrap();
    format!("{flow},{coolant},{ambient},{:.3},{:.3}\n", at("motor"), at("screw nut"))
}

#[test]
fn a_reading_counts_once() {
    let folder = scratch("update-once");
    let at = |name: &str| folder.join(name).to_str().unwrap().to_string();
    let fixture = super::fixture("uncertain.cps");
    let rows: Vec<String> =
        [(8.0, 20.0, 21.0), (5.0, 20.0, 21.0), (4.0, 18.0, 22.0)].iter().map(|x| row(fixture.to_str().unwrap(), x.0, x.1, x.2)).collect();
    std::fs::write(folder.join("first.csv"), HEADER.to_string() + &rows[0] + &rows[1]).unwrap();
    std::fs::write(folder.join("all.csv"), HEADER.to_string() + &rows[2] + &rows[1] + &rows[0]).unwrap();
    let (first, all, once, twice) = (at("first.csv"), at("all.csv"), at("once.cps"), at("twice.cps"));
    let update = |from: &str, data: &str, to: &str| coldplate(&["update", from, data, "--out", to, "--json"]);

    let told = json(&update(fixture.to_str().unwrap(), &first, &once));
    assert_eq!((told["readings"].as_u64(), told["known"].as_u64()), (Some(4), Some(0)));
    // The same table again is refused, and nothing is written.
    let again = update(&once, &first, &twice);
    assert_eq!(again.status.code(), Some(2));
    assert!(message(&again).contains("learnt these readings before"), "{}", message(&again));
    assert!(!folder.join("twice.cps").exists());
    // In a longer table, in another order, only the new row teaches.
    let told = json(&update(&once, &all, &twice));
    assert_eq!((told["readings"].as_u64(), told["known"].as_u64()), (Some(2), Some(4)));
    // Two equal rows of one table are two readings, unless they are taken for a copy.
    std::fs::write(folder.join("equal.csv"), HEADER.to_string() + &rows[0] + &rows[0]).unwrap();
    let told = json(&coldplate(&["update", &once, &at("equal.csv"), "--keep-all", "--out", &twice, "--json"]));
    assert_eq!((told["readings"].as_u64(), told["known"].as_u64()), (Some(2), Some(2)));
}
