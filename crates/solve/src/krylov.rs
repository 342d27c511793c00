//! Preconditioned conjugate gradients and flexible GMRES.

use rayon::prelude::*;

use super::csr::{CHUNK, add_scaled, dot, dot_chunk, for_chunks, norm};
use super::jacobian::Jacobian;

/// Vectors of the basis after which GMRES begins anew, a count. Chosen: memory and products with the basis against iterations.
const RESTART: usize = 12;

/// A linear operator.
pub trait Operator {
    /// y = A x
    fn multiply(&self, x: &[f64], y: &mut [f64]);

    /// r = b - A x
    fn residual(&self, x: &[f64], b: &[f64], r: &mut [f64]) {
        self.multiply(x, r);
        for_chunks(r, |first, part| part.iter_mut().zip(&b[first..]).for_each(|(r, b)| *r = b - *r));
    }
}

impl Operator for Jacobian<'_> {
    fn multiply(&self, x: &[f64], y: &mut [f64]) {
        self.multiply(x, y);
    }
}

/// How an iteration stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Status {
    /// The relative residual met the tolerance.
    Converged,
    /// The allowed number of iterations was taken before that.
    MostIterations,
    /// The iteration can do no more: the search direction or the residual is zero, negative or not finite.
    BreakDown,
}

/// Result of an iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// How the iteration stopped.
    pub status: Status,
    /// Matrix-vector products spent.
    pub iterations: usize,
    /// True residual over the norm of the right-hand side.
    pub relative_residual: f64,
}

impl Outcome {
    /// Whether Newton's method cannot go on with the result. A step with a tenth of the residual left still helps.
    pub fn is_useless(&self) -> bool {
        self.status != Status::Converged && self.relative_residual > 0.1
    }
}

/// The small least-squares problem of GMRES, min |beta e_1 - H y|, kept triangular by Givens rotations
/// (Saad, Iterative Methods for Sparse Linear Systems, section 6.5.3).
#[derive(Debug)]
pub struct Hessenberg {
    columns: Vec<Vec<f64>>,
    rotations: Vec<Rotation>,
    right: Vec<f64>,
}

#[derive(Debug, Clone, Copy)]
struct Rotation {
    cosine: f64,
    sine: f64,
}

impl Hessenberg {
    /// An empty problem whose right-hand side has length `beta`.
    pub fn new(beta: f64) -> Self {
        Self { columns: Vec::new(), rotations: Vec::new(), right: vec![beta] }
    }

    /// Number of columns.
    pub fn len(&self) -> usize {
        self.columns.len()
    }

    /// Whether no column was added yet.
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// Adds a column: the projections on the basis, and the `length` of the remainder. Returns the norm of the residual.
    pub fn add(&mut self, mut projections: Vec<f64>, length: f64) -> f64 {
        let (j, h) = (self.columns.len(), &mut projections);
        for (i, Rotation { cosine: c, sine: s }) in self.rotations.iter().enumerate() {
            (h[i], h[i + 1]) = (c * h[i] + s * h[i + 1], -s * h[i] + c * h[i + 1]);
        }
        let hypotenuse = h[j].hypot(length);
        let (c, s) = if hypotenuse > 0.0 { (h[j] / hypotenuse, length / hypotenuse) } else { (1.0, 0.0) };
        h[j] = hypotenuse;
        self.rotations.push(Rotation { cosine: c, sine: s });
        self.right.push(-s * self.right[j]);
        self.right[j] *= c;
        self.columns.push(projections);
        self.right[j + 1].abs()
    }

    /// The weights of the basis vectors that leave the smallest residual.
    pub fn weights(&self) -> Vec<f64> {
        let m = self.columns.len();
        let mut y = vec![0.0; m];
        for i in (0..m).rev() {
            let sum: f64 = (i + 1..m).map(|k| self.columns[k][i] * y[k]).sum();
            y[i] = if self.columns[i][i] == 0.0 { 0.0 } else { (self.right[i] - sum) / self.columns[i][i] };
        }
        y
    }
}

/// Conjugate gradients for a symmetric positive definite matrix, from zero (Saad, Iterative Methods, alg. 9.1).
pub fn conjugate_gradients(
    matrix: &impl Operator,
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
            for_chunks(&mut p, |first, part| part.iter_mut().zip(&z[first..]).for_each(|(p, z)| *p = z + beta * *p));
        }
    }
    finish(matrix, b, x, target, iterations, most)
}

/// Vectors that [`gmres`] needs, kept from one solve to the next: new memory costs as much as a product.
#[derive(Debug, Default)]
pub struct Scratch {
    double: [Vec<f64>; 3],
    single: Vec<Vec<f32>>,
}

/// Restarted flexible GMRES, from zero (Saad, SIAM Journal on Scientific Computing 14 (1993) 461).
///
/// The basis and the preconditioned vectors are kept in single precision, which halves their memory; the
/// products are formed in double precision with exactly the vectors kept, and each restart begins with the
/// true residual, so that the solution is as accurate as the tolerance asks.
pub fn gmres(
    matrix: &impl Operator,
    b: &[f64],
    x: &mut [f64],
    tolerance: f64,
    most: usize,
    scratch: &mut Scratch,
    mut precondition: impl FnMut(&[f64], &mut [f64]),
) -> Outcome {
    let Scratch { double: [r, z, w], single: spare } = scratch;
    let target = tolerance * norm(b);
    x.fill(0.0);
    r.clear();
    r.extend_from_slice(b);
    z.resize(b.len(), 0.0);
    w.resize(b.len(), 0.0);
    spare.retain(|v| v.len() == b.len());
    let (mut basis, mut images): (Vec<Vec<f32>>, Vec<Vec<f32>>) = (Vec::new(), Vec::new());
    let mut iterations = 0;
    while iterations < most {
        let beta = norm(r);
        if beta <= target || !beta.is_finite() {
            break;
        }
        spare.append(&mut basis);
        spare.append(&mut images);
        basis.push(rounded(r, 1.0 / beta, spare.pop()));
        let mut hessenberg = Hessenberg::new(beta);
        while hessenberg.len() < RESTART && iterations < most {
            // r holds the last basis vector as it was rounded.
            precondition(r, z);
            images.push(rounded(z, 1.0, spare.pop()));
            matrix.multiply(z, w);
            iterations += 1;
            let h = projections(&basis, w);
            let length = subtract(&basis, &h, w);
            let left = hessenberg.add(h, length);
            // Single-precision bases carry no more digits than this within one restart.
            if left <= target.max(1e-5 * beta) || length <= 1e-300 {
                break;
            }
            std::mem::swap(r, w);
            basis.push(rounded(r, 1.0 / length, spare.pop()));
        }
        let y = hessenberg.weights();
        for_chunks(x, |first, part| {
            for (image, weight) in images.iter().zip(&y) {
                part.iter_mut().zip(&image[first..]).for_each(|(x, z)| *x += weight * f64::from(*z));
            }
        });
        matrix.residual(x, b, r);
    }
    spare.append(&mut basis);
    spare.append(&mut images);
    // r is the true residual: each cycle ends with it.
    outcome(norm(r), norm(b), target, iterations, most)
}

/// `v` times `scale` in single precision, in the memory of a vector no longer needed; `v` becomes the rounded vector.
fn rounded(v: &mut [f64], scale: f64, spare: Option<Vec<f32>>) -> Vec<f32> {
    let mut single = spare.unwrap_or_else(|| vec![0.0f32; v.len()]);
    single.par_chunks_mut(CHUNK).zip(v.par_chunks_mut(CHUNK)).for_each(|(single, v)| {
        for (s, v) in single.iter_mut().zip(v) {
            *s = (*v * scale) as f32;
            *v = f64::from(*s);
        }
    });
    single
}

/// Scalar products of each basis vector with `w`, which is read once per chunk.
fn projections(basis: &[Vec<f32>], w: &[f64]) -> Vec<f64> {
    let chunk = |(c, w): (usize, &[f64])| -> Vec<f64> {
        let from = c * CHUNK;
        basis.iter().map(|v| dot_chunk(&v[from..from + w.len()], w)).collect()
    };
    let parts: Vec<Vec<f64>> = w.par_chunks(CHUNK).enumerate().map(chunk).collect();
    (0..basis.len()).map(|i| parts.iter().map(|p| p[i]).sum()).collect()
}

/// Subtracts the projections from `w` and returns its norm.
fn subtract(basis: &[Vec<f32>], h: &[f64], w: &mut [f64]) -> f64 {
    let chunk = |(c, w): (usize, &mut [f64])| -> f64 {
        let from = c * CHUNK;
        for (v, h) in basis.iter().zip(h) {
            w.iter_mut().zip(&v[from..]).for_each(|(w, v)| *w -= h * f64::from(*v));
        }
        dot_chunk(w, w)
    };
    let parts: Vec<f64> = w.par_chunks_mut(CHUNK).enumerate().map(chunk).collect();
    parts.iter().sum::<f64>().sqrt()
}

/// Measures the true residual: the recursive one may have drifted.
fn finish(matrix: &impl Operator, b: &[f64], x: &[f64], target: f64, iterations: usize, most: usize) -> Outcome {
    let mut r = vec![0.0; b.len()];
    matrix.residual(x, b, &mut r);
    outcome(norm(&r), norm(b), target, iterations, most)
}

fn outcome(residual: f64, size: f64, target: f64, iterations: usize, most: usize) -> Outcome {
    let relative_residual = if size > 0.0 { residual / size } else { 0.0 };
    let status = match residual <= 2.0 * target || size == 0.0 {
        true => Status::Converged,
        false if iterations >= most => Status::MostIterations,
        false => Status::BreakDown,
    };
    Outcome { status, iterations, relative_residual }
}
