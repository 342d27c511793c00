//! The best acceptable condition, and two variables traded off.

use coldplate_surrogate::fit::file::{encode, open};
use coldplate_surrogate::verdict::trade_off::Exchange;
use coldplate_surrogate::verdict::{
    Acceptability, FreeVariable, Inverse, Objective, Optimum, Sense, Surrogate, TradeOff, best, free_within, query_at, trade_off,
};

use crate::surrogate::examples::*;

const FLOW: FreeVariable = FreeVariable { index: 0, low: 2.0, high: 12.0 };
const COOLANT: FreeVariable = FreeVariable { index: 1, low: 15.0, high: 25.0 };

fn found(surrogate: &Surrogate<'_>, x: &[f64; 3], free: &[FreeVariable], sense: Sense, formula: &str) -> (f64, Vec<f64>) {
    let aim = Objective::parse(surrogate, sense, formula).unwrap();
    match best(surrogate, x, free, &aim, 0.95).unwrap() {
        Optimum::Found { value, answer } => {
            assert_eq!(answer.verdict, Acceptability::Acceptable);
            (value, answer.condition)
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn of_one_variable_the_best_is_the_smallest_acceptable() {
    for surrogate in [small(), uncertain(), uncertain_together()] {
        let bytes = encode(&surrogate).unwrap();
        let file = open(&bytes).unwrap();
        let x = [0.0, 19.5, 21.0];
        let Inverse::Found { smallest, .. } = free_within(&file, &x, 0, None, 0.95).unwrap() else { panic!() };
        let (value, condition) = found(&file, &x, &[FLOW], Sense::Minimise, "coolant_flow_L_min^3");
        assert!((condition[0] / smallest - 1.0).abs() < 1e-6 && condition[0] >= smallest - 1e-8, "{condition:?} {smallest}");
        assert!((value / smallest.powi(3) - 1.0).abs() < 1e-5);
    }
}

/// No place of a fine grid that is acceptable is better, whatever formula is asked for.
#[test]
fn no_place_of_a_grid_is_better() {
    for surrogate in [small(), uncertain()] {
        let bytes = encode(&surrogate).unwrap();
        let file = open(&bytes).unwrap();
        // Value of each formula at a flow and a coolant temperature, where the points have their temperatures.
        type Value = fn(f64, f64, &[f64]) -> f64;
        let formulas: [(&str, Sense, Value); 4] = [
            ("coolant_flow_L_min^2 - 8 * coolant_temperature_degC", Sense::Minimise, |q, t, _| q * q - 8.0 * t),
            ("coolant_temperature_degC", Sense::Maximise, |_, t, _| t),
            ("abs(motor_degC - 24) + 0.01 * coolant_flow_L_min", Sense::Minimise, |q, _, points| (points[0] - 24.0).abs() + 0.01 * q),
            ("screw_nut_degC - coolant_flow_L_min", Sense::Maximise, |q, _, points| points[1] - q),
        ];
        for (text, sense, value) in formulas {
            let x = [f64::NAN, f64::NAN, 22.0];
            let (reached, _) = found(&file, &x, &[FLOW, COOLANT], sense, text);
            let sign = if sense == Sense::Minimise { 1.0 } else { -1.0 };
            let (mut least, mut most, mut at) = (f64::INFINITY, f64::NEG_INFINITY, (0.0, 0.0));
            for i in 0..=200 {
                for j in 0..=200 {
                    let (q, t) = (2.0 + 0.05 * f64::from(i), 15.0 + 0.05 * f64::from(j));
                    let answer = query_at(&file, &[q, t, 22.0], 0.95).unwrap();
                    let points: Vec<f64> = answer.temperatures.iter().map(|own| own.value).collect();
                    let cost = sign * value(q, t, &points);
                    most = most.max(cost);
                    if answer.verdict == Acceptability::Acceptable && cost < least {
                        (least, at) = (cost, (q, t));
                    }
                }
            }
            // A bent valley with a kink at its bottom is not followed to its end.
            let allowed = if text.contains("abs") { 1e-3 * (most - least) } else { 1e-6 };
            assert!(sign * reached <= least + allowed, "{text}: {reached}, {} at {at:?}", sign * least);
        }
    }
}

#[test]
fn nothing_is_said_where_nothing_is_acceptable_or_fitted() {
    let bytes = encode(&uncertain()).unwrap();
    let file = open(&bytes).unwrap();
    let aim = Objective::parse(&file, Sense::Minimise, "coolant_flow_L_min").unwrap();
    match best(&file, &[0.0, 25.0, 18.0], &[FLOW], &aim, 0.95).unwrap() {
        Optimum::Nowhere { answer } => assert_eq!(answer.condition[0], 12.0, "most water comes closest"),
        other => panic!("{other:?}"),
    }
    assert!(matches!(best(&file, &[0.0, 26.0, 18.0], &[FLOW], &aim, 0.95).unwrap(), Optimum::OutsideRange(_)));
    let wrong = |text: &str| Objective::parse(&file, Sense::Minimise, text).unwrap_err().to_string();
    assert!(wrong("coolant_flow").contains("coolant_flow_L_min"), "{}", wrong("coolant_flow"));
    assert!(wrong("3 + 4").contains("the same everywhere"));
    let nowhere = Objective::parse(&file, Sense::Minimise, "sqrt(-coolant_flow_L_min)").unwrap();
    assert!(best(&file, &[0.0, 20.0, 21.0], &[FLOW], &nowhere, 0.95).unwrap_err().to_string().contains("a number nowhere"));
    assert!(best(&file, &[0.0, 20.0, 21.0], &[FLOW, FLOW], &aim, 0.95).unwrap_err().to_string().contains("free twice"));
    let outside = FreeVariable { high: 13.0, ..FLOW };
    assert!(best(&file, &[0.0, 20.0, 21.0], &[outside], &aim, 0.95).unwrap_err().to_string().contains("fitted range"));
}

#[test]
fn each_row_of_a_trade_off_is_the_inverse_question() {
    let bytes = encode(&uncertain()).unwrap();
    let file = open(&bytes).unwrap();
    let TradeOff::Rows(rows) = trade_off(&file, &[f64::NAN, f64::NAN, 21.0], FLOW, COOLANT, 0.9).unwrap() else { panic!() };
    assert_eq!((rows[0].given, rows[rows.len() - 1].given), (15.0, 25.0));
    for Exchange { given, acceptable } in &rows {
        match free_within(&file, &[0.0, *given, 21.0], 0, None, 0.9).unwrap() {
            Inverse::Found { smallest, until, .. } => {
                assert!(acceptable.is_some_and(|own| own.from == smallest && own.until == until), "{acceptable:?} {smallest}");
            }
            _ => assert!(acceptable.is_none()),
        }
    }
    assert!(trade_off(&file, &[f64::NAN, 20.0, 21.0], FLOW, FLOW, 0.9).unwrap_err().to_string().contains("against itself"));
    // Warmer water needs more of it, until none is enough.
    assert!(rows.iter().any(|row| row.acceptable.is_none()) && rows[0].acceptable.is_some());
}
