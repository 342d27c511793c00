//! The inverse question on limits whose crossings are known in closed form.

use coldplate_surrogate::fit::file::{encode, open};
use coldplate_surrogate::fit::model::*;
use coldplate_surrogate::verdict::{Acceptability, Inverse, free};

use crate::surrogate::examples::*;

/// One point over flow (2 to 12 L/min, transformed as told) and ambient temperature, band 0.5.
fn surrogate(transform: Transform, terms: &[&[u8]], coefficients: &[f64], maximum: f64) -> Vec<u8> {
    let model = PointModel::Polynomial(polynomial(&[transform, Transform::Identity], terms, coefficients));
    let surrogate = SurrogateSpec {
        variables: vec![variable("coolant_flow", "L/min", 2.0, 12.0), variable("ambient_temperature", "degC", 10.0, 30.0)],
        points: vec![point("motor", model, 0.5)],
        limits: vec![limit("motor", LimitKind::Maximum { point: 0 }, maximum)],
        ..Default::default()
    };
    encode(&surrogate).unwrap()
}

fn found(bytes: &[u8]) -> (f64, f64) {
    match free(&open(bytes).unwrap(), &[f64::NAN, 20.0], 0).unwrap() {
        Inverse::Found { smallest, until, answer, .. } => {
            assert_eq!(answer.verdict, Acceptability::Acceptable);
            assert_eq!(answer.condition, [smallest, 20.0]);
            (smallest, until)
        }
        other => panic!("{other:?}"),
    }
}

/// u for a flow under the plain transform: (q - 7)/5.
fn plain(u: f64) -> f64 {
    7.0 + 5.0 * u
}

#[test]
fn falling_temperature_has_a_smallest_flow() {
    // T = 30 + 4 u with u = 2 (1/q - 1/12)/(1/2 - 1/12) - 1 reversed: u runs from -1 at q = 2 to 1 at q = 12,
    // g(low) = 1/2, so u = 2 (1/q - 1/2)/(1/12 - 1/2) - 1 and T = 30 - 4 u <= 31.5 where u >= -3/8.
    let bytes = surrogate(Transform::Reciprocal, &[&[0, 0], &[1, 0]], &[30.0, -4.0], 32.0);
    let (smallest, until) = found(&bytes);
    let exact = 1.0 / (0.5 + 0.5 * (1.0 - 0.375) * (1.0 / 12.0 - 0.5));
    assert!((0.0..1e-5).contains(&(smallest - exact)), "{smallest} and {exact}");
    assert_eq!(until, 12.0);
}

#[test]
fn acceptable_from_the_start_is_the_start() {
    let bytes = surrogate(Transform::Identity, &[&[0, 0], &[1, 0]], &[30.0, 1.0], 30.75);
    let (smallest, until) = found(&bytes);
    assert_eq!(smallest, 2.0);
    assert!((0.0..1e-5).contains(&(plain(0.25) - until)), "{until}"); // 30 + u + 0.5 <= 30.75
}

#[test]
fn a_dip_gives_its_own_interval() {
    // T = 30 + u² + 0.5 <= 30.54 for |u| <= 0.2
    let (smallest, until) = found(&surrogate(Transform::Identity, &[&[0, 0], &[2, 0]], &[30.0, 1.0], 30.54));
    assert!((0.0..1e-5).contains(&(smallest - plain(-0.2))) && (0.0..1e-5).contains(&(plain(0.2) - until)), "{smallest} {until}");
}

#[test]
fn a_dip_narrower_than_the_scan_is_found() {
    // (u - 0.1234567)² <= 1e-8: 1e-3 L/min wide, a tenth of the scan's step
    let c = 0.123_456_7;
    let bytes = surrogate(Transform::Identity, &[&[0, 0], &[1, 0], &[2, 0]], &[30.0 + c * c, -2.0 * c, 1.0], 30.5 + 1e-8);
    let (smallest, until) = found(&bytes);
    let (low, high) = (plain(c - 1e-4), plain(c + 1e-4));
    assert!((smallest - low).abs() < 1e-5 && (until - high).abs() < 1e-5, "{smallest} {until}");
}

#[test]
fn a_bump_narrower_than_the_scan_ends_the_interval() {
    // T rises over its limit by 1e-8 within 1e-4 of u = 0.1234567, and stays under it everywhere else.
    let c = 0.123_456_7;
    let bytes = surrogate(Transform::Identity, &[&[0, 0], &[1, 0], &[2, 0]], &[30.0 - c * c, 2.0 * c, -1.0], 30.5 - 1e-8);
    let (smallest, until) = found(&bytes);
    assert_eq!(smallest, 2.0);
    assert!((until - plain(c - 1e-4)).abs() < 1e-5, "{until}");
}

#[test]
fn the_first_of_several_intervals_is_given() {
    // The Chebyshev polynomial T5(u) = 16 u⁵ - 20 u³ + 5 u is below zero first from -1 to -cos(pi/10).
    let bytes = surrogate(Transform::Identity, &[&[0, 0], &[1, 0], &[3, 0], &[5, 0]], &[30.0, -5.0, 20.0, -16.0], 30.5);
    let (smallest, until) = found(&bytes);
    let root = |k: f64| plain((k * std::f64::consts::PI / 10.0).cos());
    assert!((0.0..1e-5).contains(&(smallest - root(9.0))), "{smallest} {}", root(9.0));
    assert!((0.0..1e-5).contains(&(root(7.0) - until)), "{until} {}", root(7.0));
}

#[test]
fn nowhere_names_the_limit_and_what_is_missing() {
    // The lowest upper end is 30 + 0.5 at u = 0.3; the limit is 30.2
    let c = 0.3;
    let bytes = surrogate(Transform::Identity, &[&[0, 0], &[1, 0], &[2, 0]], &[30.0 + c * c, -2.0 * c, 1.0], 30.2);
    let Inverse::Nowhere { best, limit, excess, answer } = free(&open(&bytes).unwrap(), &[2.0, 20.0], 0).unwrap() else { panic!() };
    assert!((best - plain(0.3)).abs() < 1e-5, "{best}");
    assert_eq!((limit, answer.limits[limit].name.as_str()), (0, "motor"));
    assert!((excess - 0.3).abs() < 1e-9, "{excess}");
    assert_eq!(answer.verdict, Acceptability::Uncertain); // 30 ± 0.5 against 30.2
}

#[test]
fn other_variables_outside_the_range_make_no_answer() {
    let bytes = surrogate(Transform::Identity, &[&[0, 0]], &[20.0], 50.0);
    let Inverse::OutsideRange(outside) = free(&open(&bytes).unwrap(), &[2.0, 31.0], 0).unwrap() else { panic!() };
    assert_eq!((outside.len(), outside[0].name.as_str(), outside[0].high), (1, "ambient_temperature", 30.0));
}

#[test]
fn any_variable_can_be_free_but_not_a_fixed_one() {
    // T = 20 + u(ambient) falls nowhere below 19.5 - the range starts acceptable up to 20.25
    let bytes = surrogate(Transform::Identity, &[&[0, 0], &[0, 1]], &[20.0, 1.0], 20.75);
    let Inverse::Found { smallest, until, .. } = free(&open(&bytes).unwrap(), &[5.0, 0.0], 1).unwrap() else { panic!() };
    assert_eq!(smallest, 10.0);
    assert!((until - 22.5).abs() < 1e-5, "{until}");

    let bytes = encode(&mixed()).unwrap();
    let error = free(&open(&bytes).unwrap(), &[3.0, 50.0, 20.0], 2).unwrap_err();
    assert!(error.to_string().contains("held at 20"), "{error}");
}
