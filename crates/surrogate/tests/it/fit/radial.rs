//! Radial functions against refitting, finite differences and their own definition.

use coldplate_surrogate::fit::model::Kernel;
use coldplate_surrogate::fit::rbf::{Criterion, RbfSystem};
use coldplate_surrogate::fit::{evaluate, rbf};
use coldplate_testing::fits::*;

const KERNELS: [Kernel; 4] = [Kernel::Gaussian, Kernel::Multiquadric, Kernel::ThinPlate, Kernel::Cubic];
const SCALES: [f64; 3] = [0.9, 0.6, 1.3];

fn tail(degree: usize) -> Vec<Vec<u8>> {
    let mut terms = Vec::new();
    for a in 0..=degree {
        for b in 0..=degree - a {
            for c in 0..=degree - a - b {
                terms.push(vec![a as u8, b as u8, c as u8]);
            }
        }
    }
    terms
}

fn data(n: usize) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let rows = stretched(latin(n, 3, &mut Random::new(21)), &[(-1.0, 1.0); 3]);
    let y =
        vec![rows.iter().map(|u| (2.0 * u[0]).sin() + u[1] * u[2]).collect(), rows.iter().map(|u| 10.0 + (u[0] - u[2]).exp()).collect()];
    (rows, y)
}

fn value(kernel: Kernel, rows: &[Vec<f64>], weights: &[f64], terms: &[Vec<u8>], c: &[f64], u: &[f64]) -> f64 {
    let square = |a: &[f64]| a.iter().zip(u).zip(&SCALES).map(|((a, b), s)| (s * (a - b)).powi(2)).sum::<f64>();
    let radial: f64 = rows.iter().zip(weights).map(|(r, w)| w * evaluate::radial(kernel, square(r))).sum();
    let power = |t: &[u8]| t.iter().zip(u).map(|(e, u)| u.powi(i32::from(*e))).product::<f64>();
    radial + terms.iter().zip(c).map(|(t, c)| c * power(t)).sum::<f64>()
}

/// Leave-one-out residuals from one factorisation equal those of refitting without each row, for every kernel, tail and
/// with and without smoothing.
#[test]
fn leave_one_out_equals_refitting() {
    let (rows, y) = data(28);
    for kernel in KERNELS {
        for degree in rbf::least_tail(kernel)..=2 {
            for smoothing in [1e-6, 0.05] {
                let terms = tail(degree);
                let system = RbfSystem::new(rows.clone(), vec![0, 1, 2], terms.clone(), y.clone()).unwrap();
                let all = system.solve(kernel, &SCALES, smoothing).unwrap();
                for i in 0..rows.len() {
                    let without = |v: &[f64]| v.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, v)| *v).collect::<Vec<_>>();
                    let others: Vec<Vec<f64>> = rows.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, r)| r.clone()).collect();
                    let known = y.iter().map(|y| without(y)).collect();
                    let system = RbfSystem::new(others.clone(), vec![0, 1, 2], terms.clone(), known).unwrap();
                    let less = system.solve(kernel, &SCALES, smoothing).unwrap();
                    for (o, y) in y.iter().enumerate() {
                        let e = y[i] - value(kernel, &others, &less.weights[o], &terms, &less.tails[o], &rows[i]);
                        let error = (all.left_out[o][i] - e).abs();
                        assert!(error < 1e-8 * e.abs().max(0.1), "{kernel:?} {degree} {smoothing} row {i}: {error:e}");
                    }
                }
            }
        }
    }
}

/// The solution fulfils its defining equations: (K + λI) w + F c = y and Fᵀ w = 0.
#[test]
fn weights_fulfil_the_saddle_system() {
    let (rows, y) = data(60);
    for kernel in KERNELS {
        let terms = tail(1);
        let smoothing = 1e-3;
        let system = RbfSystem::new(rows.clone(), vec![0, 1, 2], terms.clone(), y.clone()).unwrap();
        let solved = system.solve(kernel, &SCALES, smoothing).unwrap();
        // The multiquadric enters with its sign turned, so its smoothing does too.
        let sign = if kernel == Kernel::Multiquadric { -1.0 } else { 1.0 };
        for (o, y) in y.iter().enumerate() {
            let w = &solved.weights[o];
            let size: f64 = w.iter().map(|w| w.abs()).sum();
            for i in 0..rows.len() {
                let left = value(kernel, &rows, w, &terms, &solved.tails[o], &rows[i]) + sign * smoothing * w[i];
                assert!((left - y[i]).abs() < 1e-13 * size.max(10.0), "{kernel:?}: {:e}", left - y[i]);
            }
            for t in &terms {
                let power = |u: &[f64]| t.iter().zip(u).map(|(e, u)| u.powi(i32::from(*e))).product::<f64>();
                let sum: f64 = rows.iter().zip(w).map(|(u, w)| w * power(u)).sum();
                assert!(sum.abs() < 1e-12 * size);
            }
        }
    }
}

/// The gradients of both criteria agree with central differences.
#[test]
fn gradients_equal_central_differences() {
    let (rows, y) = data(40);
    for kernel in KERNELS {
        for criterion in [Criterion::LeaveOneOut, Criterion::Likelihood] {
            let system = RbfSystem::new(rows.clone(), vec![0, 1, 2], tail(1), y.clone()).unwrap();
            let at = [-0.2, 0.3, 0.1, (1e-3f64).ln()];
            let (_, gradient) = system.judge(kernel, &at, criterion).unwrap();
            for k in 0..at.len() {
                let h = 1e-4;
                let shifted = |d: f64| {
                    let mut p = at;
                    p[k] += d;
                    system.judge(kernel, &p, criterion).unwrap().0
                };
                let difference = (shifted(h) - shifted(-h)) / (2.0 * h);
                assert!(
                    (difference - gradient[k]).abs() < 1e-5 * (1.0 + difference.abs()),
                    "{kernel:?} {criterion:?} {k}: {difference} {}",
                    gradient[k]
                );
            }
        }
    }
}

/// A tail that the rows cannot determine is refused instead of solved.
#[test]
fn an_undetermined_tail_is_refused() {
    let rows: Vec<Vec<f64>> = (0..20).map(|i| vec![f64::from(i) / 20.0; 3]).collect();
    assert!(RbfSystem::new(rows, vec![0, 1, 2], tail(1), vec![vec![0.0; 20]]).is_none());
}
