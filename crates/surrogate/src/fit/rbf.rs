//! Radial functions with a polynomial tail, for several outputs at once, and their leave-one-out error without refitting.
//!
//! With φ the kernel of scaled distances, K_ij = φ(|S (u_i - u_j)|) over the rows, F the tail's monomials at the rows and λ
//! the smoothing, the weights w and the tail's coefficients c solve the saddle system
//!
//! ```text
//! | K + λI  F | | w |   | y |
//! | Fᵀ      0 | | c | = | 0 |
//! ```
//!
//! Householder reflections of F give an orthonormal basis N of the complement of the tail, and w = P y with P = N (Nᵀ (K +
//! λI) N)⁻¹ Nᵀ, the leading block of the inverse of the saddle matrix. Nᵀ K N is positive definite for every kernel here
//! (with the multiquadric's sign turned) once the tail is at least of the kernel's order, so this is one Cholesky
//! factorisation and no indefinite solve.
//!
//! Leaving row i out means demanding w_i = 0 and letting y_i be free. Changing y_i by δ changes w_i by P_ii δ, so δ =
//! -w_i / P_ii, and the left-out residual is e_i = w_i / P_ii. This is Rippa's formula (1999), here with tail and
//! smoothing; a test compares it with refitting.
//!
//! Length scales and smoothing minimise either the restricted likelihood of the Gaussian process with that covariance, or
//! the mean log of the left-out errors over the outputs: both with their exact gradients from dP = -P dK P, at the price of
//! one matrix product.

use nalgebra::DMatrix;

use super::dense::{Reflections, SpdInverse, invert_spd};
use super::evaluate::radial;
use super::least_squares::{Orthonormal, dot, max_abs};
use super::model::Kernel;
use super::polynomial::monomial_columns;

/// Share of an output's standard deviation below which left-out errors count as none. Chosen: nothing is gained by
/// tuning further.
const NEGLIGIBLE: f64 = 1e-9;

/// Largest ratio of the weights' magnitudes, summed, to the largest value (at least one), dimensionless. It multiplies the
/// rounding of every query, which then stays below about 5e-8 of the values: half of the tolerance of the self-tests of a
/// surrogate file.
const MOST_WEIGHT: f64 = 1e8;

/// Lowest degree of the tail that makes a kernel's interpolation matrix definite.
pub fn least_tail(kernel: Kernel) -> usize {
    match kernel {
        Kernel::ThinPlate | Kernel::Cubic => 1,
        Kernel::Multiquadric | Kernel::Gaussian => 0,
    }
}

/// The sign that makes a kernel conditionally positive definite.
pub(super) fn sign(kernel: Kernel) -> f64 {
    if kernel == Kernel::Multiquadric { -1.0 } else { 1.0 }
}

/// 2 dφ/d(r²) of a kernel, times its sign, given r² and the signed value.
fn slope(kernel: Kernel, r2: f64, value: f64) -> f64 {
    match kernel {
        Kernel::ThinPlate if r2 > 0.0 => 2.0 * value / r2 + 1.0,
        Kernel::ThinPlate => 0.0,
        Kernel::Cubic => 3.0 * r2.sqrt(),
        Kernel::Multiquadric => 1.0 / value,
        Kernel::Gaussian => -2.0 * value,
    }
}

/// Criterion of length scales and smoothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Criterion {
    /// Mean over outputs of ln(mean squared left-out residual).
    LeaveOneOut,
    /// Restricted likelihood, -2 ln per row and output.
    Likelihood,
}

/// Rows in scaled variables, outputs on them, and the tail.
pub struct RbfSystem {
    rows: Vec<Vec<f64>>,
    active: Vec<usize>,
    tail: Vec<Vec<u8>>,
    columns: Vec<Vec<f64>>,
    reflections: Reflections,
    outputs: Vec<Vec<f64>>,
    floors: Vec<f64>,
}

/// Weights, tail and left-out residuals, one of each per output.
pub struct RbfSolution {
    /// Indices of the rows that are centres.
    pub centres: Vec<usize>,
    /// One weight per centre.
    pub weights: Vec<Vec<f64>>,
    /// One coefficient per monomial of the tail.
    pub tails: Vec<Vec<f64>>,
    /// One residual per row.
    pub left_out: Vec<Vec<f64>>,
}

impl RbfSolution {
    /// Whether rounding in a query stays small.
    pub(super) fn is_well_conditioned(&self, outputs: &[Vec<f64>]) -> bool {
        let sum = |w: &[f64]| w.iter().map(|w| w.abs()).sum::<f64>();
        self.weights.iter().zip(outputs).all(|(w, y)| sum(w) <= MOST_WEIGHT * max_abs(y).max(1.0))
    }
}

struct Factored {
    p: DMatrix<f64>,
    w: DMatrix<f64>,
    inverse: SpdInverse,
}

impl RbfSystem {
    /// `rows` in scaled variables; `active` the indices of those that vary; `tail` exponents. `None` when the rows do not
    /// determine the tail or are fewer than three more than its terms.
    pub fn new(rows: Vec<Vec<f64>>, active: Vec<usize>, tail: Vec<Vec<u8>>, outputs: Vec<Vec<f64>>) -> Option<Self> {
        let columns = monomial_columns(&rows, &tail);
        if rows.len() < tail.len() + 3 {
            return None;
        }
        let reflections = Reflections::of(&columns)?;
        let floors = outputs.iter().map(|y| negligible(y)).collect();
        Some(Self { rows, active, tail, columns, reflections, outputs, floors })
    }

    /// Indices of the variables that vary: one length scale each.
    pub fn active(&self) -> &[usize] {
        &self.active
    }

    /// Exponents of the tail's monomials.
    pub fn tail(&self) -> &[Vec<u8>] {
        &self.tail
    }

    /// The active variables times their inverse length scales, variable by variable.
    fn stretched(&self, scales: &[f64]) -> Vec<Vec<f64>> {
        self.active.iter().zip(scales).map(|(k, s)| self.rows.iter().map(|u| s * u[*k]).collect()).collect()
    }

    /// Signed kernel matrix for inverse length scales `scales` of the active variables.
    fn kernel_matrix(&self, kernel: Kernel, scales: &[f64]) -> DMatrix<f64> {
        let stretched = self.stretched(scales);
        let n = self.rows.len();
        let mut k = DMatrix::zeros(n, n);
        for j in 0..n {
            for (i, r2) in (j..n).zip(squares_from(&stretched, j).r2) {
                let value = sign(kernel) * radial(kernel, r2);
                k[(i, j)] = value;
                k[(j, i)] = value;
            }
        }
        k
    }

    fn outputs(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.rows.len(), self.outputs.len(), |i, j| self.outputs[j][i])
    }

    /// P y.
    fn apply(&self, inverse: &SpdInverse, y: DMatrix<f64>) -> DMatrix<f64> {
        self.reflections.expand_columns(&inverse.solve(&self.reflections.reduce_columns(y)))
    }

    fn factor(&self, k: &DMatrix<f64>, smoothing: f64) -> Option<Factored> {
        let mut m = self.reflections.reduce(k.clone());
        for i in 0..m.nrows() {
            m[(i, i)] += smoothing;
        }
        let inverse = invert_spd(&m)?;
        let p = self.reflections.expand(&inverse.inverse);
        let w = self.apply(&inverse, self.outputs());
        Some(Factored { p, w, inverse })
    }

    /// The criterion and its gradient at `parameters`: the logarithms of the inverse length scales of the active variables,
    /// then of the smoothing. `None` where the matrix is not positive definite to working precision.
    pub fn judge(&self, kernel: Kernel, parameters: &[f64], criterion: Criterion) -> Option<(f64, Vec<f64>)> {
        let (log_smoothing, log_scales) = parameters.split_last()?;
        let scales: Vec<f64> = log_scales.iter().map(|s| s.exp()).collect();
        let k = self.kernel_matrix(kernel, &scales);
        let f = self.factor(&k, log_smoothing.exp())?;
        let (value, sensitivity) = match criterion {
            Criterion::LeaveOneOut => self.left_out_error(&f),
            Criterion::Likelihood => self.likelihood(&f),
        };
        let mut gradient = vec![0.0; parameters.len()];
        let stretched = self.stretched(&scales);
        for j in 0..self.rows.len() {
            let squares = squares_from(&stretched, j);
            let of_pair = |(i, r2): (usize, &f64)| (sensitivity[(i, j)] + sensitivity[(j, i)]) * slope(kernel, *r2, k[(i, j)]);
            // The pair of a row with itself has no distance, so that its part is zero.
            let g: Vec<f64> = (j..).zip(&squares.r2).map(of_pair).collect();
            gradient.iter_mut().zip(&squares.by_variable).for_each(|(d, squares)| *d += dot(&g, squares));
        }
        if let Some(last) = gradient.last_mut() {
            *last = sensitivity.trace() * log_smoothing.exp();
        }
        (value.is_finite() && gradient.iter().all(|g| g.is_finite())).then_some((value, gradient))
    }

    /// [`left_out_score`] of the weights that these parameters give.
    pub(crate) fn left_out_score(&self, kernel: Kernel, scales: &[f64], smoothing: f64) -> Option<f64> {
        let f = self.factor(&self.kernel_matrix(kernel, scales), smoothing)?;
        let of_output = |o: usize| f.w.column(o).iter().enumerate().map(|(i, w)| w / f.p[(i, i)]).collect();
        Some(left_out_score(&(0..self.outputs.len()).map(of_output).collect::<Vec<_>>(), &self.outputs))
    }

    /// Mean of ln S over outputs, S = Σ e²/n, and the matrix G with d(mean) = tr(G dK):
    /// de_i = (-(P dK w)_i + e_i (P dK P)_ii) / P_ii.
    fn left_out_error(&self, f: &Factored) -> (f64, DMatrix<f64>) {
        let (n, m) = (self.rows.len(), self.outputs.len());
        let mut value = 0.0;
        let mut a = DMatrix::zeros(n, m);
        let mut diagonal = vec![0.0; n];
        for o in 0..m {
            let e: Vec<f64> = (0..n).map(|i| f.w[(i, o)] / f.p[(i, i)]).collect();
            let sum = dot(&e, &e) / n as f64 + self.floors[o];
            value += sum.ln() / m as f64;
            let share = 2.0 / (sum * (n * m) as f64);
            for i in 0..n {
                a[(i, o)] = -share * e[i] / f.p[(i, i)];
                diagonal[i] += share * e[i] * e[i] / f.p[(i, i)];
            }
        }
        let mut weighted = f.p.clone();
        for (mut column, d) in weighted.column_iter_mut().zip(&diagonal) {
            column *= *d;
        }
        let mut g = weighted * &f.p;
        g.gemm(1.0, &(&f.p * a), &f.w.transpose(), 1.0);
        (value, g)
    }

    /// ln(yᵀ P y / f) averaged over outputs plus ln det(Nᵀ(K + λI)N) / f, f = rows - tail terms, and its G.
    fn likelihood(&self, f: &Factored) -> (f64, DMatrix<f64>) {
        let (n, m) = (self.rows.len(), self.outputs.len());
        let freedom = (n - self.tail.len()) as f64;
        let mut value = f.inverse.log_determinant / freedom;
        let mut g = &f.p * (1.0 / freedom);
        let mut scaled = f.w.clone();
        for o in 0..m {
            let energy = dot(&self.outputs[o], f.w.column(o).as_slice()).max(self.floors[o] * freedom);
            value += (energy / freedom).ln() / m as f64;
            scaled.column_mut(o).iter_mut().for_each(|w| *w /= -energy * m as f64);
        }
        g.gemm(1.0, &scaled, &f.w.transpose(), 1.0);
        (value, g)
    }

    /// Values, output by output.
    pub(super) fn values(&self) -> &[Vec<f64>] {
        &self.outputs
    }

    /// Solves for every output. `scales` are inverse length scales of the active variables.
    pub fn solve(&self, kernel: Kernel, scales: &[f64], smoothing: f64) -> Option<RbfSolution> {
        let k = self.kernel_matrix(kernel, scales);
        let f = self.factor(&k, smoothing)?;
        let mut tail = Orthonormal::new();
        if !self.columns.iter().all(|column| tail.push(column)) {
            return None;
        }
        let mut weights = f.w.clone();
        let centres = (0..self.rows.len()).collect();
        let mut solved = RbfSolution { centres, weights: Vec::new(), tails: Vec::new(), left_out: Vec::new() };
        let outputs = self.outputs();
        // P annihilates the tail, so the weights are corrected by the residual of the kernel part alone.
        for _ in 0..2 {
            let rest = &outputs - &k * &weights - &weights * smoothing;
            weights += self.apply(&f.inverse, rest);
        }
        let rest = outputs - &k * &weights - &weights * smoothing;
        for o in 0..self.outputs.len() {
            let w = weights.column(o);
            solved.left_out.push(w.iter().enumerate().map(|(i, w)| w / f.p[(i, i)]).collect());
            solved.weights.push(w.iter().map(|w| sign(kernel) * w).collect());
            let mut y = rest.column(o).as_slice().to_vec();
            let c = tail.project_out(&mut y);
            solved.tails.push(tail.back_substitute(&c));
        }
        Some(solved)
    }
}

/// Squared distances of a row from itself and all rows after it, and the parts that the variables have in them.
struct Squares {
    r2: Vec<f64>,
    by_variable: Vec<Vec<f64>>,
}

/// Squares from row `j` on; `places` are variable by variable.
fn squares_from(places: &[Vec<f64>], j: usize) -> Squares {
    let of_variable = |x: &Vec<f64>| x[j..].iter().map(|other| (other - x[j]) * (other - x[j])).collect();
    let by_variable: Vec<Vec<f64>> = places.iter().map(of_variable).collect();
    let mut r2 = vec![0.0; places.first().map_or(0, |x| x.len() - j)];
    by_variable.iter().for_each(|squares| r2.iter_mut().zip(squares).for_each(|(sum, square)| *sum += square));
    Squares { r2, by_variable }
}

/// Mean over outputs of ln(mean squared left-out residual): the score of kernels, tails and transforms.
pub(super) fn left_out_score(left_out: &[Vec<f64>], outputs: &[Vec<f64>]) -> f64 {
    let mean = |e: &[f64]| dot(e, e) / e.len().max(1) as f64;
    let sum: f64 = left_out.iter().zip(outputs).map(|(e, y)| (mean(e) + negligible(y)).ln()).sum();
    sum / outputs.len().max(1) as f64
}

/// Mean squared left-out residual of an output that counts as none.
fn negligible(y: &[f64]) -> f64 {
    (NEGLIGIBLE * spread(y)).powi(2).max(f64::MIN_POSITIVE)
}

/// Standard deviation of a list.
pub(super) fn spread(y: &[f64]) -> f64 {
    let mean = y.iter().sum::<f64>() / y.len().max(1) as f64;
    (y.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / y.len().max(1) as f64).sqrt()
}
