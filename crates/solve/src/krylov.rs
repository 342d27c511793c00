//! Preconditioned conjugate gradients and flexible GMRES.

use rayon::prelude::*;

use super::csr::{CHUNK, add_scaled, dot, dot_chunk, for_chunks, norm};
use super::jacobian::Jacobian;
use coldplate_base::error::{Error, Result, Stop};

/// A linear operator.
pub trait Operator {
    /// y = A x
    fn multiply(&self, x: &[f64], y: &mut [f64]);

    /// r = b - A x
    fn residual(&self, x: &[f64], b: &[f64], r: &mut [f64]) {
        self.multiply(x, r);
        for_chunks(r, |first, part| part.iter_mut().zip(&b[first..]).for_each(|(r, b)| *r = b - *r));
    }

    /// Norm of the rounding error of A x, which no iteration brings the residual below; 0 where it does not matter.
    fn rounding(&self, _x: &[f64]) -> f64 {
        0.0
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
pub struct KrylovResult {
    /// How the iteration stopped.
    pub status: Status,
    /// Matrix-vector products spent.
    pub iterations: usize,
    /// True residual over the norm of the right-hand side.
    pub relative_residual: f64,
}

impl KrylovResult {
    /// Whether Newton's method cannot go on with the result. A step with a tenth of the residual left still helps.
    pub(crate) fn is_useless(&self) -> bool {
        self.status != Status::Converged && self.relative_residual > 0.1
    }

    /// This result, unless Newton's method cannot go on with it.
    pub(super) fn useful(self) -> Result<Self> {
        if self.is_useless() { Err(self.stopped("the linear solver")) } else { Ok(self) }
    }

    /// Error of a solver (as in "the linear solver") that stopped with this result.
    pub(super) fn stopped(&self, solver: &str) -> Error {
        let Self { relative_residual, iterations, .. } = self;
        let what = format!("{solver} stopped at a relative residual of {relative_residual:.2e} after {iterations} iterations");
        Error::stopped(Stop::LinearSolver, what)
    }
}

/// The small least-squares problem of GMRES, min |beta e_1 - H y|, kept triangular by Givens rotations
/// (Saad, Iterative Methods for Sparse Linear Systems, section 6.5.3).
#[derive(Debug)]
struct Hessenberg {
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
    fn new(beta: f64) -> Self {
        Self { columns: Vec::new(), rotations: Vec::new(), right: vec![beta] }
    }

    /// Number of columns.
    fn len(&self) -> usize {
        self.columns.len()
    }

    /// Adds a column: the projections on the basis, and the `length` of the remainder. Returns the norm of the residual.
    fn add(&mut self, mut projections: Vec<f64>, length: f64) -> f64 {
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
    fn weights(&self) -> Vec<f64> {
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
) -> KrylovResult {
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

/// Orthonormal vectors of one cycle of [`gmres`], from which its correction of the solution is combined.
pub(crate) trait KrylovBasis: Default {
    /// Vectors after which GMRES begins anew, a count.
    const RESTART: usize;
    /// Least ratio of the residuals after and before one cycle, dimensionless: below it the recursive residual is no longer the true
    /// one.
    const CYCLE: f64;
    /// Recursive residual at which a cycle ends, over the one that the true residual must reach, dimensionless.
    const MARGIN: f64;

    /// Leaves no vector, and makes room for vectors of `length` entries.
    fn clear(&mut self, length: usize);

    /// Adds `v` over its norm; `v` becomes the vector as it is kept.
    fn push(&mut self, v: &mut [f64], norm: f64);

    /// Takes note of the last vector preconditioned; `z` becomes the vector as it is kept.
    fn push_image(&mut self, z: &mut [f64]);

    /// Subtracts from `w` its projections on the vectors; returns them and the norm of the remainder.
    fn remove(&self, w: &mut [f64]) -> (Vec<f64>, f64);

    /// Adds the vectors, weighted and preconditioned, to `x`; `z` is work space.
    fn add_to(&self, x: &mut [f64], weights: &[f64], z: &mut [f64], precondition: &mut dyn FnMut(&[f64], &mut [f64]));
}

/// Vectors that [`gmres`] needs, kept from one solve to the next: new memory costs as much as a product.
#[derive(Debug, Default)]
pub struct Scratch<B> {
    double: [Vec<f64>; 3],
    basis: B,
}

/// Stopping rule of [`gmres`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stopping {
    /// Relative residual aimed at, dimensionless.
    pub tolerance: f64,
    /// Relative residual at which the iteration ends once a cycle no longer halves the residual, dimensionless.
    pub settled: f64,
    /// Most matrix-vector products, a count.
    pub most: usize,
}

/// Restarted GMRES with right preconditioning, from zero (Saad, Iterative Methods, alg. 9.5). Each cycle begins with the true residual,
/// so that the solution is as accurate as the tolerance asks in any precision of the basis.
pub(crate) fn gmres<B: KrylovBasis>(
    matrix: &impl Operator,
    b: &[f64],
    x: &mut [f64],
    stopping: Stopping,
    scratch: &mut Scratch<B>,
    mut precondition: impl FnMut(&[f64], &mut [f64]),
) -> KrylovResult {
    let Scratch { double: [r, z, w], basis } = scratch;
    let size = norm(b);
    x.fill(0.0);
    r.clear();
    r.extend_from_slice(b);
    z.resize(b.len(), 0.0);
    w.resize(b.len(), 0.0);
    let (mut iterations, mut before) = (0, f64::INFINITY);
    loop {
        let beta = norm(r);
        let target = (stopping.tolerance * size).max(matrix.rounding(x));
        let has_settled = beta > 0.5 * before && beta <= stopping.settled * size;
        if beta <= target || has_settled || iterations >= stopping.most || !beta.is_finite() {
            return outcome(beta, size, target, iterations, stopping.most);
        }
        before = beta;
        basis.clear(b.len());
        basis.push(r, beta);
        let mut hessenberg = Hessenberg::new(beta);
        while hessenberg.len() < B::RESTART && iterations < stopping.most {
            // r holds the last vector of the basis as it is kept.
            precondition(r, z);
            basis.push_image(z);
            matrix.multiply(z, w);
            iterations += 1;
            let (projections, length) = basis.remove(w);
            let left = hessenberg.add(projections, length);
            if left <= (B::MARGIN * target).max(B::CYCLE * beta) || length <= 1e-300 {
                break;
            }
            std::mem::swap(r, w);
            basis.push(r, length);
        }
        basis.add_to(x, &hessenberg.weights(), z, &mut precondition);
        matrix.residual(x, b, r);
    }
}

/// Basis in double precision, orthogonalised vector by vector, for solves to rounding. Images are left out: the preconditioner acts once
/// more on the combination of each cycle.
#[derive(Debug, Default)]
pub(crate) struct DoubleBasis(Vec<Vec<f64>>);

impl KrylovBasis for DoubleBasis {
    /// Chosen: memory against iterations.
    const RESTART: usize = 50;
    /// Chosen above the rounding of double precision.
    const CYCLE: f64 = 1e-12;
    /// Chosen: iterations against a further cycle.
    const MARGIN: f64 = 0.3;

    fn clear(&mut self, _: usize) {
        self.0.clear();
    }

    fn push(&mut self, v: &mut [f64], norm: f64) {
        v.iter_mut().for_each(|v| *v /= norm);
        self.0.push(v.to_vec());
    }

    fn push_image(&mut self, _: &mut [f64]) {}

    fn remove(&self, w: &mut [f64]) -> (Vec<f64>, f64) {
        let one = |v: &Vec<f64>| {
            let projection = dot(v, w);
            add_scaled(w, -projection, v);
            projection
        };
        (self.0.iter().map(one).collect(), norm(w))
    }

    fn add_to(&self, x: &mut [f64], weights: &[f64], z: &mut [f64], precondition: &mut dyn FnMut(&[f64], &mut [f64])) {
        let mut combination = vec![0.0; x.len()];
        self.0.iter().zip(weights).for_each(|(v, weight)| add_scaled(&mut combination, *weight, v));
        precondition(&combination, z);
        add_scaled(x, 1.0, z);
    }
}

/// Basis in single precision, which halves its memory, with the preconditioned vector of each, so that the preconditioner may change
/// from one to the next (flexible GMRES: Saad, SIAM Journal on Scientific Computing 14 (1993) 461). Products are formed in double
/// precision with exactly the vectors kept.
#[derive(Debug, Default)]
pub(crate) struct SingleBasis {
    vectors: Vec<Vec<f32>>,
    images: Vec<Vec<f32>>,
    /// Memory of earlier cycles.
    spare: Vec<Vec<f32>>,
}

impl KrylovBasis for SingleBasis {
    /// Chosen: memory and products with the basis against iterations.
    const RESTART: usize = 12;
    /// Chosen: single-precision bases carry no more digits within one cycle.
    const CYCLE: f64 = 1e-5;
    const MARGIN: f64 = 1.0;

    fn clear(&mut self, length: usize) {
        self.spare.append(&mut self.vectors);
        self.spare.append(&mut self.images);
        self.spare.retain(|v| v.len() == length);
    }

    fn push(&mut self, v: &mut [f64], norm: f64) {
        self.vectors.push(rounded(v, 1.0 / norm, self.spare.pop()));
    }

    fn push_image(&mut self, z: &mut [f64]) {
        self.images.push(rounded(z, 1.0, self.spare.pop()));
    }

    fn remove(&self, w: &mut [f64]) -> (Vec<f64>, f64) {
        let projections = projections(&self.vectors, w);
        let length = subtract(&self.vectors, &projections, w);
        (projections, length)
    }

    fn add_to(&self, x: &mut [f64], weights: &[f64], _: &mut [f64], _: &mut dyn FnMut(&[f64], &mut [f64])) {
        for_chunks(x, |first, part| {
            for (image, weight) in self.images.iter().zip(weights) {
                part.iter_mut().zip(&image[first..]).for_each(|(x, z)| *x += weight * f64::from(*z));
            }
        });
    }
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
fn finish(matrix: &impl Operator, b: &[f64], x: &[f64], target: f64, iterations: usize, most: usize) -> KrylovResult {
    let mut r = vec![0.0; b.len()];
    matrix.residual(x, b, &mut r);
    outcome(norm(&r), norm(b), target, iterations, most)
}

fn outcome(residual: f64, size: f64, target: f64, iterations: usize, most: usize) -> KrylovResult {
    let relative_residual = if size > 0.0 { residual / size } else { 0.0 };
    let status = match residual <= 2.0 * target || size == 0.0 {
        true => Status::Converged,
        false if iterations >= most => Status::MostIterations,
        false => Status::BreakDown,
    };
    KrylovResult { status, iterations, relative_residual }
}
