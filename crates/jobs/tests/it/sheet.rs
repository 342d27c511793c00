//! What the sheet for the wall says: flows that are enough whatever its table does not show, limits in full.

use coldplate_figures::chart::acceptability::CellState;
use coldplate_figures::chart::operator_sheet::OperatorSheet;
use coldplate_jobs::charts::operator_sheet;
use coldplate_surrogate::fit::file::{encode, open};
use coldplate_surrogate::fit::model::{
    LimitKind, LimitSpec, PointModel, PointSpec, PolynomialSpec, SurrogateSpec, Transform, VariableSpec,
};

const HALF_WIDTH: f64 = 0.03;
const RISE: f64 = 25.0;

/// Two bearings of a machine whose front one must not be more than 25 K above the air. With all variables from -1 to 1 its
/// temperature is 44 - 3 flow + 2 coolant + 3 speed + 2 torque, whatever the air.
fn bytes() -> Vec<u8> {
    let variable = |name: &str, unit: &str, low: f64, high: f64| VariableSpec { name: name.into(), unit: unit.into(), low, high };
    let terms: Vec<Vec<u8>> = (0..6).map(|k| (1..6).map(|v| u8::from(v == k)).collect()).collect();
    let point = |name: &str, coefficients: [f64; 6]| {
        let model = PolynomialSpec { transforms: vec![Transform::Identity; 5], terms: terms.clone(), coefficients: coefficients.to_vec() };
        PointSpec { name: name.into(), unit: "degC".into(), model: PointModel::Polynomial(model), half_width: HALF_WIDTH }
    };
    let limit = |name: &str, kind: LimitKind<Vec<usize>>, maximum: f64| LimitSpec { name: name.into(), kind, maximum };
    let surrogate = SurrogateSpec {
        mesh: Vec::new(),
        variables: vec![
            variable("coolant_flow", "L/min", 2.0, 10.0),
            variable("coolant_temperature", "degC", 16.0, 24.0),
            variable("motor_speed", "rpm", 0.0, 6000.0),
            variable("ambient_temperature", "degC", 18.0, 28.0),
            variable("torque", "N m", 0.0, 10.0),
        ],
        held: Vec::new(),
        bases: Vec::new(),
        points: vec![point("front_bearing", [44.0, -3.0, 2.0, 3.0, 0.0, 2.0]), point("rear_bearing", [43.0, -3.0, 2.0, 3.0, 0.0, 2.0])],
        limits: vec![
            limit("front_bearing", LimitKind::Rise { point: 0, variable: 3 }, RISE),
            limit("heat", LimitKind::Maximum { point: 0 }, 90.0),
            limit("bend", LimitKind::Difference { first: 0, second: 1 }, 6.0),
            limit("bearings", LimitKind::Spread(vec![0, 1]), 7.0),
        ],
        uncertainty: None,
        followed: None,
        in_time: None,
        empty_corners: vec![],
        readings: vec![],
        provenance: Vec::new(),
    };
    encode(&surrogate).unwrap()
}

fn sheet() -> OperatorSheet {
    operator_sheet(&open(&bytes()).unwrap(), "a spindle", "").unwrap()
}

#[test]
fn the_smallest_flow_is_enough_at_the_worst_of_what_the_table_does_not_show() {
    let table = sheet().table.unwrap();
    for (r, speed) in table.rows.iter().enumerate() {
        for (c, coolant) in table.columns.iter().enumerate() {
            // The air at its coldest and the torque at its largest: the rise is 28 - 3 flow + 2 coolant + 3 speed.
            let (speed, coolant) = (speed / 3000.0 - 1.0, (coolant - 20.0) / 4.0);
            let excess = 44.0 - 18.0 + 2.0 + 2.0 * coolant + 3.0 * speed - RISE;
            let flow = (excess + HALF_WIDTH) / 3.0;
            let cell = &table.cells[r * table.columns.len() + c];
            if flow > 1.0 {
                // With the largest flow, 1, the limit is surely broken, or it lies within the band.
                let is_sure = excess - 3.0 > HALF_WIDTH;
                let expected = if is_sure { ("none", CellState::NotAcceptable) } else { ("ask", CellState::Uncertain) };
                assert_eq!((cell.text.as_str(), cell.state), expected, "speed {speed}, coolant {coolant}");
            } else {
                let expected = format!("{:.1}", ((6.0 + 4.0 * flow) * 10.0).ceil() / 10.0);
                assert_eq!(
                    (cell.text.as_str(), cell.state),
                    (expected.as_str(), CellState::Acceptable),
                    "speed {speed}, coolant {coolant}"
                );
            }
        }
    }
    for text in ["none", "ask", "3.4"] {
        assert!(table.cells.iter().any(|c| c.text == text), "{text}");
    }
}

#[test]
fn the_table_says_for_which_values_it_holds() {
    let expected = "Smallest coolant flow [L/min] whatever the ambient temperature from 18 to 28 °C and torque from 0 to 10 N m";
    assert_eq!(sheet().table.unwrap().title, expected);
}

#[test]
fn limits_say_above_or_between_what() {
    let found: Vec<String> = sheet().limits.into_iter().map(|(name, words)| format!("{name}: {words}")).collect();
    let expected = [
        "front_bearing: at most 25 K above ambient temperature",
        "heat: front_bearing at most 90 °C",
        "bend: front_bearing at most 6 K above rear_bearing",
        "bearings: at most 7 K between front_bearing and rear_bearing",
    ];
    assert_eq!(found, expected);
}
