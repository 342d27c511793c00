//! Preconditioned conjugate gradients and GMRES.

use super::csr::{Csr, add_scaled, dot, norm};

/// How an iteration ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Whether the relative residual met the tolerance.
    pub converged: bool,
    /// Matrix-vector products spent.
    pub iterations: usize,
    /// True residual over the norm of the right-hand side.
    pub relative_residual: f64,
}

/// Conjugate gradients for a symmetric positive definite matrix, from zero (Saad, Iterative Methods, alg. 9.1).
pub fn conjugate_gradients(
    matrix: &Csr,
    b: &[f64],
    x: &mut [f64],
    tolerance: f64,
    most: usize,
    mut precondition: impl FnMut(&[f64], &mut [f64]),
) -> Outcome {
    let n = b.len();
    let target = tolerance * norm(b);
    x.fill(0.0);
    let (mut r, mut z, mut q) = (b.to_vec(), vec![0.0; n], vec![0.0; n]);
    let mut iterations = 0;
    if norm(b) > 0.0 {
        precondition(&r, &mut z);
        let mut p = z.clone();
        let mut rho = dot(&r, &z);
        while iterations < most && norm(&r) > target && rho.is_finite() && rho > 0.0 {
            matrix.multiply(&p, &mut q);
            let alpha = rho / dot(&p, &q);
            add_scaled(x, alpha, &p);
            add_scaled(&mut r, -alpha, &q);
            iterations += 1;
            precondition(&r, &mut z);
            let next = dot(&r, &z);
            let beta = next / rho;
            rho = next;
            p.iter_mut().zip(&z).for_each(|(p, z)| *p = z + beta * *p);
        }
    }
    finish(matrix, b, x, target, iterations)
}

/// Restarted GMRES with right preconditioning, from zero (Saad, alg. 9.5): the residual it minimises is the true one.
pub fn gmres(
    matrix: &Csr,
    b: &[f64],
    x: &mut [f64],
    tolerance: f64,
    most: usize,
    restart: usize,
    mut precondition: impl FnMut(&[f64], &mut [f64]),
) -> Outcome {
    let n = b.len();
    let target = tolerance * norm(b);
    x.fill(0.0);
    let mut r = b.to_vec();
    let mut z = vec![0.0; n];
    let mut iterations = 0;
    while iterations < most {
        let beta = norm(&r);
        if beta <= target || !beta.is_finite() {
            break;
        }
        let mut basis: Vec<Vec<f64>> = vec![r.iter().map(|v| v / beta).collect()];
        let mut hessenberg: Vec<Vec<f64>> = Vec::new();
        let mut rotations: Vec<(f64, f64)> = Vec::new();
        let mut g = vec![beta];
        while hessenberg.len() < restart && iterations < most {
            let j = hessenberg.len();
            precondition(&basis[j], &mut z);
            let mut w = vec![0.0; n];
            matrix.multiply(&z, &mut w);
            iterations += 1;
            let mut h = Vec::with_capacity(j + 2);
            for v in &basis {
                let projection = dot(v, &w);
                add_scaled(&mut w, -projection, v);
                h.push(projection);
            }
            let length = norm(&w);
            for (i, (c, s)) in rotations.iter().enumerate() {
                (h[i], h[i + 1]) = (c * h[i] + s * h[i + 1], -s * h[i] + c * h[i + 1]);
            }
            let hypotenuse = h[j].hypot(length);
            let (c, s) = if hypotenuse > 0.0 { (h[j] / hypotenuse, length / hypotenuse) } else { (1.0, 0.0) };
            h[j] = hypotenuse;
            rotations.push((c, s));
            g.push(-s * g[j]);
            g[j] *= c;
            hessenberg.push(h);
            if g[j + 1].abs() <= target || length <= 1e-300 {
                break;
            }
            w.iter_mut().for_each(|v| *v /= length);
            basis.push(w);
        }
        let m = hessenberg.len();
        let mut y = vec![0.0; m];
        for i in (0..m).rev() {
            let sum: f64 = (i + 1..m).map(|k| hessenberg[k][i] * y[k]).sum();
            y[i] = if hessenberg[i][i] == 0.0 { 0.0 } else { (g[i] - sum) / hessenberg[i][i] };
        }
        let mut combination = vec![0.0; n];
        for (v, weight) in basis.iter().zip(&y) {
            add_scaled(&mut combination, *weight, v);
        }
        precondition(&combination, &mut z);
        add_scaled(x, 1.0, &z);
        matrix.residual(x, b, &mut r);
    }
    finish(matrix, b, x, target, iterations)
}

/// Measures the true residual: the recursive one may have drifted.
fn finish(matrix: &Csr, b: &[f64], x: &[f64], target: f64, iterations: usize) -> Outcome {
    let mut r = vec![0.0; b.len()];
    matrix.residual(x, b, &mut r);
    let (residual, size) = (norm(&r), norm(b));
    let relative_residual = if size > 0.0 { residual / size } else { 0.0 };
    Outcome { converged: residual <= 2.0 * target || size == 0.0, iterations, relative_residual }
}
