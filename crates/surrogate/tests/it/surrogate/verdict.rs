//! The rules of the verdict, on surrogates whose values are plain numbers.

use coldplate_surrogate::fit::file::{encode, open};
use coldplate_surrogate::fit::model::*;
use coldplate_surrogate::verdict::{self, Acceptability};

use crate::surrogate::examples::*;

/// Points with constant values and bands; one variable, ambient temperature from 10 to 30 degC.
fn constant(points: &[(f64, f64)], limits: Vec<LimitSpec>) -> Vec<u8> {
    let models = points.iter().enumerate().map(|(i, (value, half_width))| {
        point(&format!("p{i}"), PointModel::Polynomial(polynomial(&[Transform::Identity], &[&[0]], &[*value])), *half_width)
    });
    let surrogate = SurrogateSpec {
        variables: vec![variable("ambient_temperature", "degC", 10.0, 30.0)],
        points: models.collect(),
        limits,
        ..Default::default()
    };
    encode(&surrogate).unwrap()
}

fn state(points: &[(f64, f64)], limits: Vec<LimitSpec>) -> Acceptability {
    open(&constant(points, limits)).unwrap().verdict(&[20.0]).state
}

#[test]
fn one_limit_against_the_band_of_its_value() {
    // 30 ± 0.5 against limits on and around the ends of its band
    let at = |maximum| state(&[(30.0, 0.5)], vec![limit("m", LimitKind::Maximum { point: 0 }, maximum)]);
    assert_eq!(at(30.5), Acceptability::Acceptable);
    assert_eq!(at(30.499), Acceptability::Uncertain);
    assert_eq!(at(29.5), Acceptability::Uncertain);
    assert_eq!(at(29.499), Acceptability::NotAcceptable);
}

#[test]
fn the_worst_limit_decides_and_is_named() {
    let limits = vec![
        limit("kept closely", LimitKind::Maximum { point: 0 }, 30.2), // margin 0.2, band 0.1: acceptable
        limit("unclear", LimitKind::Maximum { point: 1 }, 25.3),      // margin 0.3, band 0.5: uncertain
        limit("kept", LimitKind::Maximum { point: 2 }, 40.0),
    ];
    let points = [(30.0, 0.1), (25.0, 0.5), (20.0, 0.1)];
    let bytes = constant(&points, limits.clone());
    let verdict = open(&bytes).unwrap().verdict(&[20.0]);
    assert_eq!((verdict.state, verdict.binding), (Acceptability::Uncertain, Some(1)));
    assert!((verdict.margin - 0.3).abs() < 1e-12 && verdict.value == 25.0);

    let mut broken = limits;
    broken[2].maximum = 19.5;
    let bytes = constant(&points, broken);
    let verdict = open(&bytes).unwrap().verdict(&[20.0]);
    assert_eq!((verdict.state, verdict.binding, verdict.margin), (Acceptability::NotAcceptable, Some(2), -0.5));
}

#[test]
fn rise_difference_and_spread_add_up_their_bands() {
    let points = [(30.0, 0.5), (26.0, 0.25), (28.0, 1.0)];
    let limits = vec![
        limit("rise", LimitKind::Rise { point: 0, variable: 0 }, 11.0),
        limit("difference", LimitKind::Difference { first: 0, second: 1 }, 5.0),
        limit("spread", LimitKind::Spread(vec![0, 1, 2]), 5.0),
    ];
    let bytes = constant(&points, limits);
    let answer = verdict::query(&open(&bytes).unwrap(), &[20.0]).unwrap();
    let found: Vec<_> = answer.limits.iter().map(|l| (l.value, l.low, l.high, l.margin, l.unit.as_str())).collect();
    assert_eq!(
        found,
        [
            (10.0, 9.5, 10.5, 1.0, "K"),
            (4.0, 3.25, 4.75, 1.0, "K"),
            // at most 30.5 - 25.75; at least 29.5 - 26.25
            (4.0, 3.25, 4.75, 1.0, "K"),
        ]
    );
    assert_eq!(answer.verdict, Acceptability::Acceptable);
}

/// The band of a spread against a search over the box of the points' bands: every corner of it for
/// the largest spread, every common level for the smallest.
#[test]
fn the_band_of_a_spread_holds_every_spread_the_bands_allow() {
    let mut random = Random(17);
    for _ in 0..200 {
        let points: Vec<(f64, f64)> = (0..4).map(|_| (30.0 + random.signed(), random.signed().abs())).collect();
        let bytes = constant(&points, vec![limit("s", LimitKind::Spread(vec![0, 1, 2, 3]), 1.0)]);
        let answer = verdict::query(&open(&bytes).unwrap(), &[20.0]).unwrap();
        let spread =
            |values: &[f64]| values.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b)) - values.iter().fold(f64::INFINITY, |a, b| a.min(*b));
        let mut largest: f64 = 0.0;
        for corner in 0..16 {
            let values: Vec<f64> = points.iter().enumerate().map(|(i, (v, b))| if corner >> i & 1 == 1 { v + b } else { v - b }).collect();
            largest = largest.max(spread(&values));
        }
        // The smallest spread is reached by moving every point towards one common level.
        let level = |t: f64| spread(&points.iter().map(|(v, b)| t.clamp(v - b, v + b)).collect::<Vec<_>>());
        // Piecewise linear in the level, it has its minimum at an end of some band.
        let ends = points.iter().flat_map(|(v, b)| [v - b, v + b]);
        let smallest = ends.map(level).fold(f64::INFINITY, f64::min);
        assert!((answer.limits[0].high - largest).abs() < 1e-12, "{points:?}");
        assert!((answer.limits[0].low - smallest).abs() < 1e-12, "{points:?}");
    }
}

/// The query's own pass over the points of a spread against the definition of a limit's value, to the last digit.
#[test]
fn the_value_of_a_spread_is_that_of_its_definition() {
    let mut random = Random(29);
    for count in [2, 3, 7] {
        let points: Vec<(f64, f64)> = (0..count).map(|_| (30.0 + 5.0 * random.signed(), random.signed().abs())).collect();
        let bytes = constant(&points, vec![limit("s", LimitKind::Spread((0..count).rev().collect()), 1.0)]);
        let file = open(&bytes).unwrap();
        let mut values: Vec<f64> = points.iter().map(|p| p.0).collect();
        let check = |values: &[f64]| {
            let kind = file.limit(0).unwrap().kind;
            let defined = kind.value(|point| values[point], |_| unreachable!("a spread is over no variable"));
            assert_eq!(file.limit_value(0, &[20.0], values).unwrap().value.to_bits(), defined.to_bits(), "{values:?}");
        };
        check(&values);
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            values[count - 1] = bad;
            check(&values);
        }
    }
}

#[test]
fn outside_the_range_nothing_is_said() {
    for maximum in [100.0, 0.0] {
        let bytes = constant(&[(30.0, 0.5)], vec![limit("m", LimitKind::Maximum { point: 0 }, maximum)]);
        let file = open(&bytes).unwrap();
        for x in [9.999, 30.001, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let verdict = file.verdict(&[x]);
            assert_eq!((verdict.state, verdict.in_domain), (Acceptability::Uncertain, false), "{x}");
        }
        assert!(file.verdict(&[10.0]).in_domain && file.verdict(&[30.0]).in_domain);
        assert_eq!(file.verdict(&[]).state, Acceptability::Uncertain);
        assert_eq!(file.verdict(&[20.0, 20.0]).state, Acceptability::Uncertain);
    }
}

#[test]
fn without_limits_nothing_is_acceptable() {
    assert_eq!(state(&[(30.0, 0.5)], vec![]), Acceptability::Uncertain);
}

#[test]
fn a_fixed_variable_is_inside_at_its_value_only() {
    let bytes = encode(&mixed()).unwrap();
    let file = open(&bytes).unwrap();
    assert!(file.in_domain(&[3.0, 50.0, 20.0]));
    assert!(!file.in_domain(&[3.0, 50.0, 20.001]));
}
