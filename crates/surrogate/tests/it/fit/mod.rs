//! Fits judged by functions that are known: exact recovery, brute-force refitting, held-out errors and coverage.

mod corner;
mod empty_corners;
mod held_out;
mod many;
mod radial;
mod repeated;
mod small;

use coldplate_surrogate::fit::model::{Kernel, PointModel, Transform, VariableSpec};
use coldplate_surrogate::fit::one_factor::OneFactorFit;
use coldplate_surrogate::fit::{self, FitOptions, ModelFamily};
use coldplate_testing::fits::*;

fn rms(e: &[f64]) -> f64 {
    (e.iter().map(|e| e * e).sum::<f64>() / e.len() as f64).sqrt()
}

fn max(e: &[f64]) -> f64 {
    e.iter().fold(0.0, |m: f64, e| m.max(e.abs()))
}

fn polynomials_only() -> FitOptions {
    FitOptions { kernels: Vec::new(), ..FitOptions::default() }
}

/// Table 7 of the paper prints y = -3.178e-5 x³ + 0.00117 x² - 0.02727 x + 25.76486 for one sensor; the fit of values made
/// by that formula must give it back.
#[test]
fn a_cubic_in_flow_is_recovered_and_printed() {
    let x: Vec<f64> = (0..12).map(|i| 2.355 + 1.5 * f64::from(i)).collect();
    let y: Vec<f64> = x.iter().map(|x| -3.178e-5 * x * x * x + 0.00117 * x * x - 0.02727 * x + 25.76486).collect();
    let found = OneFactorFit::fit(&x, &y, 3).unwrap();
    assert_eq!(found.formula("y", "x", 7), "y = -3.178e-5 x^3 + 0.00117 x^2 - 0.02727 x + 25.76486");
    assert!(found.rms < 1e-13 && 1.0 - found.r_squared < 1e-13);
}

/// The leave-one-out errors of a one-factor fit are those of refitting without each row.
#[test]
fn one_factor_leave_one_out_equals_refitting() {
    let mut random = Random::new(5);
    let x: Vec<f64> = (0..15).map(|i| 3.925e-5 + 2e-5 * f64::from(i)).collect();
    let y: Vec<f64> = x.iter().map(|x| 20.0 + 1e-4 / x + 0.05 * random.normal()).collect();
    let found = OneFactorFit::fit(&x, &y, 3).unwrap();
    let refitted: Vec<f64> = (0..x.len())
        .map(|i| {
            let keep = |v: &[f64]| v.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, v)| *v).collect::<Vec<_>>();
            y[i] - OneFactorFit::fit(&keep(&x), &keep(&y), 3).unwrap().value(x[i])
        })
        .collect();
    assert!((found.loo_rms / rms(&refitted) - 1.0).abs() < 1e-8);
    assert!((found.loo_max / max(&refitted) - 1.0).abs() < 1e-8);
}

/// A sparse polynomial of four variables is found again: its terms, its coefficients, its transform.
#[test]
fn a_sparse_polynomial_is_recovered() {
    let ranges = [(2.0, 20.0), (18.0, 24.0), (250.0, 2500.0), (18.0, 24.0)];
    let u = |k: usize, x: &[f64]| 2.0 * (x[k] - ranges[k].0) / (ranges[k].1 - ranges[k].0) - 1.0;
    let g = |x: f64| 1.0 / x;
    let v = move |x: &[f64]| 2.0 * (g(x[0]) - g(2.0)) / (g(20.0) - g(2.0)) - 1.0;
    let f = |x: &[f64]| 21.0 + 3.0 * u(1, x) - 1.5 * v(x) * u(2, x) + 0.25 * u(2, x).powi(3) * u(3, x) + 0.5 * v(x).powi(2);
    let rows = stretched(latin(120, 4, &mut Random::new(1)), &ranges);
    let found = fit::fit(&samples(rows, &ranges, &[&f]), &polynomials_only()).unwrap();
    let PointModel::Polynomial(p) = &found.surrogate.points[0].model else { panic!("a polynomial was asked for") };
    assert_eq!(p.transforms, [Transform::Reciprocal, Transform::Identity, Transform::Identity, Transform::Identity]);
    let mut expected: Vec<(Vec<u8>, f64)> = vec![
        (vec![0, 0, 0, 0], 21.0),
        (vec![0, 1, 0, 0], 3.0),
        (vec![1, 0, 1, 0], -1.5),
        (vec![0, 0, 3, 1], 0.25),
        (vec![2, 0, 0, 0], 0.5),
    ];
    for (term, c) in p.terms.iter().zip(&p.coefficients) {
        let wanted = expected.iter().position(|(t, _)| t == term).map_or(0.0, |k| expected.swap_remove(k).1);
        assert!((c - wanted).abs() < 1e-10, "{term:?}: {c} instead of {wanted}");
    }
    assert!(expected.is_empty(), "not found: {expected:?}");
    assert!(found.points[0].half_width < 1e-10);
}

/// The leave-one-out residuals a polynomial reports are those of refitting its terms without each row.
#[test]
fn polynomial_leave_one_out_equals_refitting() {
    use coldplate_surrogate::fit::least_squares::least_squares;
    let mut random = Random::new(8);
    let rows = uniform(40, 2, &mut random);
    let columns = |rows: &[&Vec<f64>]| -> Vec<Vec<f64>> {
        let term = |f: &dyn Fn(&[f64]) -> f64| rows.iter().map(|x| f(x)).collect::<Vec<f64>>();
        vec![term(&|_| 1.0), term(&|x| x[0]), term(&|x| x[1] * x[0]), term(&|x| x[1].powi(2))]
    };
    let y: Vec<f64> = rows.iter().map(|x| x[0].exp() + x[1] + random.normal()).collect();
    let found = least_squares(&columns(&rows.iter().collect::<Vec<_>>()), &y).unwrap();
    for i in 0..rows.len() {
        let others: Vec<&Vec<f64>> = rows.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, x)| x).collect();
        let known: Vec<f64> = y.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, y)| *y).collect();
        let without = least_squares(&columns(&others), &known).unwrap();
        let left: f64 = columns(&[&rows[i]]).iter().zip(&without.coefficients).map(|(c, b)| c[0] * b).sum();
        assert!((found.left_out[i] - (y[i] - left)).abs() < 1e-11);
    }
}

/// A variable that never changes is left out with a note, and the surrogate can still be asked.
#[test]
fn a_constant_variable_is_left_out_with_a_note() {
    let ranges = [(-1.0, 1.0), (20.0, 20.0), (-1.0, 1.0)];
    let f = |x: &[f64]| (x[0] + 0.5 * x[2]).sin();
    for options in [FitOptions::default(), polynomials_only(), FitOptions { polynomials: false, ..FitOptions::default() }] {
        let rows = stretched(latin(60, 3, &mut Random::new(2)), &ranges);
        let found = fit::fit(&samples(rows, &ranges, &[&f]), &options).unwrap();
        assert!(found.notes.iter().any(|n| n.contains("x1 does not vary")), "{:?}", found.notes);
        let e = errors(&found, 0, &stretched(uniform(50, 3, &mut Random::new(3)), &ranges), &f);
        assert!(max(&e) < 1e-2, "{:e}", max(&e));
    }
}

/// Missing values cost their own output only, and an output with too few is named.
#[test]
fn missing_values_drop_rows_of_their_output_only() {
    let f = |x: &[f64]| x[0] + 2.0 * x[1] * x[1];
    let rows = stretched(latin(60, 4, &mut Random::new(4)), &CUBE);
    let mut table = samples(rows, &CUBE, &[&f, &f]);
    for i in 0..20 {
        table.outputs[1].values[3 * i] = f64::NAN;
    }
    let found = fit::fit(&table, &polynomials_only()).unwrap();
    assert_eq!((found.points[0].rows, found.points[1].rows), (60, 40));
    assert!((0..2).all(|k| max(&errors(&found, k, &table.rows, &f)) < 1e-9));
    table.outputs[1].values.iter_mut().skip(6).for_each(|y| *y = f64::NAN);
    let error = fit::fit(&table, &polynomials_only()).unwrap_err();
    assert!(error.to_string().contains("too few rows") && error.to_string().contains("y1"), "{error}");
}

/// One-factor sweeps put together leave cross terms undetermined; that must not break anything.
#[test]
fn a_design_of_crossing_lines_is_fitted() {
    let mut rows = Vec::new();
    for k in 0..4 {
        for step in 0..11 {
            let mut x = vec![0.1; 4];
            x[k] = -1.0 + 0.2 * f64::from(step);
            rows.push(x);
        }
    }
    let f = |x: &[f64]| x[0].exp() + x[1] - 0.3 * x[2].powi(2) + 0.1 * x[3];
    let found = fit::fit(&samples(rows.clone(), &CUBE, &[&f]), &FitOptions::default()).unwrap();
    assert!(max(&errors(&found, 0, &rows, &f)) < 1e-2);
}

/// Bad tables are refused with the place named.
#[test]
fn bad_samples_are_refused() {
    let f = |x: &[f64]| x[0];
    let good = samples(stretched(latin(30, 4, &mut Random::new(4)), &CUBE), &CUBE, &[&f]);
    let refused = |table: &fit::FitSamples| fit::fit(table, &FitOptions::default()).unwrap_err().to_string();
    let mut table = good.clone();
    table.rows[4][2] = f64::NAN;
    assert!(refused(&table).contains("row 5") && refused(&table).contains("x2"));
    let mut table = good.clone();
    table.outputs[0].values[7] = f64::INFINITY;
    assert!(refused(&table).contains("row 8"));
    let mut table = good.clone();
    table.rows[0].pop();
    assert!(refused(&table).contains("row 1"));
    let mut table = good;
    table.outputs.clear();
    assert!(refused(&table).contains("no output"));
}

/// The same samples give the same surrogate to the last bit, whatever the number of threads.
#[test]
fn threads_do_not_change_the_result() {
    let rows = stretched(latin(50, 4, &mut Random::new(6)), &CUBE);
    let table = samples(rows, &CUBE, &[&rough, &ridge]);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| fit::fit(&table, &FitOptions::default()).unwrap())
    };
    let (one, three) = (with(1), with(3));
    assert_eq!(one.surrogate, three.surrogate);
    assert_eq!(one.points, three.points);
}

/// The scaled variable runs from -1 to 1 over the range for every transform, and is 0 where there is no range.
#[test]
fn scaling_follows_its_definition() {
    let v = VariableSpec { name: "q".into(), unit: "L/min".into(), low: 2.0, high: 8.0 };
    for t in [Transform::Identity, Transform::Reciprocal, Transform::Log] {
        assert!((fit::evaluate::scaled(&v, t, 2.0) + 1.0).abs() < 1e-15);
        assert!((fit::evaluate::scaled(&v, t, 8.0) - 1.0).abs() < 1e-15);
    }
    // ln 4 is half way from ln 2 to ln 8; 1/3.2 half way from 1/2 to 1/8.
    assert!(fit::evaluate::scaled(&v, Transform::Log, 4.0).abs() < 1e-15);
    assert!(fit::evaluate::scaled(&v, Transform::Reciprocal, 3.2).abs() < 1e-15);
    let still = VariableSpec { low: 3.0, high: 3.0, ..v };
    assert_eq!(fit::evaluate::scaled(&still, Transform::Log, 3.0), 0.0);
}

/// Radial functions alone, one kernel at a time, can be asked for; noise is smoothed, not interpolated.
#[test]
fn noise_is_smoothed() {
    let mut random = Random::new(12);
    let rows = stretched(uniform(150, 2, &mut random), &CUBE[..2]);
    let clean = |x: &[f64]| (2.0 * x[0]).sin() + x[1];
    let mut table = samples(rows, &CUBE[..2], &[&clean]);
    table.outputs[0].values.iter_mut().for_each(|y| *y += 0.1 * random.normal());
    for kernel in [Kernel::Gaussian, Kernel::Multiquadric, Kernel::ThinPlate, Kernel::Cubic] {
        let options = FitOptions { polynomials: false, kernels: vec![kernel], ..FitOptions::default() };
        let found = fit::fit(&table, &options).unwrap();
        assert!(matches!(found.points[0].chosen.family, ModelFamily::Rbf { kernel: k, .. } if k == kernel));
        let e = rms(&errors(&found, 0, &stretched(uniform(400, 2, &mut random), &CUBE[..2]), &clean));
        assert!(e < 0.06, "{kernel:?}: {e:.3} of noise 0.1 remains");
    }
}

/// By hand: slope 0.6, residual sum of squares 0.2 on two degrees of freedom, Student's 0.975 quantile 4.302653.
#[test]
fn the_band_of_one_factor_is_students() {
    let fitted = coldplate_surrogate::fit::one_factor::OneFactorFit::fit(&[0.0, 1.0, 2.0, 3.0], &[0.0, 1.0, 1.0, 2.0], 1).unwrap();
    assert!((fitted.coefficients[1] - 0.6).abs() < 1e-12);
    let by_hand = 4.302_652_73 * (0.2f64 / 2.0).sqrt() * 1.5f64.sqrt();
    assert!((fitted.half_width(0.95) - by_hand).abs() < 1e-6, "{} against {by_hand}", fitted.half_width(0.95));
    let exact = coldplate_surrogate::fit::one_factor::OneFactorFit::fit(&[0.0, 1.0], &[0.0, 1.0], 1).unwrap();
    assert!(exact.half_width(0.95).is_infinite());
}
