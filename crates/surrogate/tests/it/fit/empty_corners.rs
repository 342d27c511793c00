//! Corners of the fitted ranges that no row lies in: answers there are outside, elsewhere they are not.

use coldplate_surrogate::fit::{self, FitOptions, FitOutput, FitSamples, file};
use coldplate_surrogate::verdict::{Acceptability, query};
use coldplate_testing::fits::*;

/// The file of a fit to rows in the square from -1 to 1, with a limit that no answer comes near.
fn fitted(names: &[(&str, &str)], rows: Vec<Vec<f64>>) -> Vec<u8> {
    let values = rows.iter().map(|x| 20.0 + x.iter().sum::<f64>()).collect();
    let outputs = vec![FitOutput { name: "motor".into(), unit: "degC".into(), values }];
    let mut found = fit::fit(&FitSamples::with_measured_ranges(names, rows, outputs), &FitOptions::default()).unwrap();
    let kind = fit::model::LimitKind::Maximum { point: 0 };
    found.surrogate.limits.push(fit::model::LimitSpec { name: "motor".into(), kind, maximum: 60.0 });
    found.to_bytes().unwrap()
}

const TWO: [(&str, &str); 2] = [("coolant_flow", "L/min"), ("motor_speed", "rpm")];

/// Two inputs that were only changed together: on their line the surrogate knows the machine, beside it nothing.
#[test]
fn inputs_on_one_line_leave_two_corners_outside() {
    let rows = (0..20).map(|i| vec![-1.0 + f64::from(i) / 9.5; 2]).collect();
    let bytes = fitted(&TWO, rows);
    let surrogate = file::open(&bytes).unwrap();
    assert_eq!(surrogate.empty_corners().count(), 2);
    for x in [[-1.0, -1.0], [0.3, 0.3], [1.0, 1.0]] {
        let answer = query(&surrogate, &x).unwrap();
        assert!(answer.in_domain && answer.verdict == Acceptability::Acceptable, "{x:?}");
    }
    for x in [[-1.0, 1.0], [1.0, -1.0], [0.5, -0.5]] {
        let answer = query(&surrogate, &x).unwrap();
        assert!(!answer.in_domain && answer.verdict == Acceptability::Uncertain, "{x:?}");
        let [out] = answer.outside.as_slice() else { panic!("{:?}", answer.outside) };
        let beside = out.beside.as_ref().unwrap();
        assert_eq!((out.name.as_str(), beside.name.as_str(), beside.value), ("motor_speed", "coolant_flow", x[0]));
        // The rows at that flow are within a twentieth of half a range of the line.
        assert!((out.low.max(x[0] - 0.06)..=out.high.min(x[0] + 0.06)).contains(&x[0]), "{out:?}");
        assert!(!(out.low..=out.high).contains(&x[1]));
    }
    // The file keeps the corners.
    let again = file::encode(&file::decode(&bytes).unwrap()).unwrap();
    assert_eq!(again, bytes);
}

/// One variable changed at a time: their joint effect is unknown.
#[test]
fn a_cross_leaves_all_corners_outside() {
    let along = |k: usize| (0..9).map(move |i| (0..2).map(|j| if j == k { -1.0 + f64::from(i) / 4.0 } else { 0.0 }).collect());
    let bytes = fitted(&TWO, along(0).chain(along(1)).collect());
    let surrogate = file::open(&bytes).unwrap();
    assert_eq!(surrogate.empty_corners().count(), 4);
    assert!(surrogate.in_domain(&[1.0, 0.0]) && surrogate.in_domain(&[0.5, 0.5]) && !surrogate.in_domain(&[1.0, -1.0]));
}

/// A quarter of the square without a row, in a table that would have had ten there.
#[test]
fn a_quarter_without_rows_is_outside() {
    let rows: Vec<Vec<f64>> = stretched(latin(60, 2, &mut Random::new(5)), &[(-1.0, 1.0); 2]);
    let rows = rows.into_iter().filter(|x| x[0] < 0.0 || x[1] < 0.0).chain([vec![1.0, -1.0], vec![-1.0, 1.0], vec![-1.0, -1.0]]);
    let bytes = fitted(&TWO, rows.collect());
    let surrogate = file::open(&bytes).unwrap();
    let corners: Vec<_> = surrogate.empty_corners().collect();
    assert!(corners.len() == 1 && corners[0].is_low == [false, false], "{corners:?}");
    assert!(!surrogate.in_domain(&[0.95, 0.95]) && surrogate.in_domain(&[0.9, -0.9]) && surrogate.in_domain(&[-0.9, 0.9]));
}

/// Designs of independent values have no empty corner, in equal steps and in steps of the reciprocal, nor do factorials.
#[test]
fn designs_have_no_empty_corners() {
    let four = [("a", "1"), ("b", "1"), ("c", "1"), ("d", "1")];
    for seed in 1..=10 {
        for reciprocal in [false, true] {
            let mut rows = stretched(latin(80, 4, &mut Random::new(seed)), &[(2.0, 8.0); 4]);
            if reciprocal {
                rows.iter_mut().for_each(|x| x[0] = 1.0 / (0.5 + (x[0] - 2.0) * (0.125 - 0.5) / 6.0));
            }
            let bytes = fitted(&four, rows);
            let corners: Vec<_> = file::open(&bytes).unwrap().empty_corners().collect();
            assert!(corners.is_empty(), "seed {seed}: {corners:?}");
        }
    }
    let factorial = (0..27).map(|i| vec![f64::from(i % 3) - 1.0, f64::from(i / 3 % 3) - 1.0, f64::from(i / 9) - 1.0]).collect();
    assert_eq!(file::open(&fitted(&four[..3], factorial)).unwrap().empty_corners().count(), 0);
}
