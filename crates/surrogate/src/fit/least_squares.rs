//! Linear least squares by orthonormalisation, one column at a time.
//!
//! Modified Gram-Schmidt, each column orthogonalised twice, gives an explicit orthonormal basis Q of the columns to
//! working precision (Giraud, Langou, Rozložník 2005). From it the numbers for choosing a model follow at no further
//! cost: the diagonal h of the hat matrix Q Qᵀ, and the residual each row would have if it had been left out, e_i /
//! (1 - h_i). Columns are scaled by their own norm, so their units do not matter.

use super::double_double::DoubleDouble;
use coldplate_base::error::{Error, Result};

/// Share of a column, orthogonal to the columns before it, below which the column counts as dependent. Chosen: above
/// rounding.
const DEPENDENT: f64 = 1e-13;

/// Orthonormal columns q_j and the triangular factor r that rebuilds the columns they came from.
#[derive(Debug, Clone, Default)]
pub(crate) struct Orthonormal {
    q: Vec<Vec<f64>>,
    r: Vec<Vec<f64>>,
}

impl Orthonormal {
    /// A basis without columns.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a column. False, and nothing added, when it depends linearly on those before it (or is zero).
    pub fn push(&mut self, column: &[f64]) -> bool {
        let size = norm(column);
        if !(size > 0.0 && size.is_finite()) {
            return false;
        }
        let mut v: Vec<f64> = column.iter().map(|x| x / size).collect();
        let mut r = vec![0.0; self.q.len() + 1];
        for _ in 0..2 {
            for (q, r) in self.q.iter().zip(&mut r) {
                let h = dot(q, &v);
                axpy(&mut v, -h, q);
                *r += h * size;
            }
        }
        let rest = norm(&v);
        if rest < DEPENDENT * (self.q.len() as f64 + 1.0) || self.q.len() == column.len() {
            return false;
        }
        v.iter_mut().for_each(|x| *x /= rest);
        if let Some(last) = r.last_mut() {
            *last = rest * size;
        }
        self.q.push(v);
        self.r.push(r);
        true
    }

    /// Number of columns.
    pub(crate) fn len(&self) -> usize {
        self.q.len()
    }

    /// Subtracts from `y` its projection on the columns, and returns the coefficients of the projection in the q_j.
    pub(crate) fn project_out(&self, y: &mut [f64]) -> Vec<f64> {
        let mut c = vec![0.0; self.q.len()];
        for _ in 0..2 {
            for (q, c) in self.q.iter().zip(&mut c) {
                let h = dot(q, y);
                axpy(y, -h, q);
                *c += h;
            }
        }
        c
    }

    /// Diagonal of the hat matrix, one value in [0, 1] per row.
    pub(crate) fn leverages(&self, rows: usize) -> Vec<f64> {
        let mut h = vec![0.0; rows];
        for q in &self.q {
            h.iter_mut().zip(q).for_each(|(h, q)| *h += q * q);
        }
        h
    }

    /// Turns coefficients in the q_j into coefficients of the columns as given: solves R x = c.
    pub(crate) fn back_substitute(&self, c: &[f64]) -> Vec<f64> {
        let mut x = c.to_vec();
        for j in (0..x.len().min(self.r.len())).rev() {
            x[j] /= self.r[j][j];
            let xj = x[j];
            for (xi, rij) in x[..j].iter_mut().zip(&self.r[j]) {
                *xi -= rij * xj;
            }
        }
        x
    }

    /// Solves Rᵀ z = g.
    fn forward_substitute(&self, g: &[f64]) -> Vec<f64> {
        let mut z: Vec<f64> = Vec::with_capacity(g.len());
        for (r, g) in self.r.iter().zip(g) {
            let known: f64 = r.iter().zip(&z).map(|(r, z)| r * z).sum();
            z.push((g - known) / r[z.len()]);
        }
        z
    }

    /// Diagonal of (RᵀR)⁻¹, which times the residual variance gives the coefficients' variances.
    fn inverse_gram_diagonal(&self) -> Vec<f64> {
        let p = self.q.len();
        let mut diagonal = vec![0.0; p];
        for k in 0..p {
            let mut unit = vec![0.0; p];
            unit[k] = 1.0;
            for (d, x) in diagonal.iter_mut().zip(self.back_substitute(&unit)) {
                *d += x * x;
            }
        }
        diagonal
    }
}

/// A least-squares solution with its error estimates.
#[derive(Debug, Clone)]
pub struct LeastSquares {
    /// One per column.
    pub coefficients: Vec<f64>,
    /// Standard deviation of each coefficient, for independent errors of equal variance; zero without degrees of freedom.
    pub standard_errors: Vec<f64>,
    /// y minus the fit, per row.
    pub residuals: Vec<f64>,
    /// Leave-one-out residual of each row; infinite where the fit needs that row.
    pub left_out: Vec<f64>,
    /// sqrt(sum of squared residuals / (rows - columns)); zero without degrees of freedom.
    pub residual_deviation: f64,
    /// Share of the variance about the mean that the fit explains.
    pub r_squared: f64,
}

/// Least squares of `y` on `columns` (each of `y.len()` rows).
///
/// # Errors
/// Columns that depend on each other, or more columns than rows, as bad input.
pub fn least_squares(columns: &[Vec<f64>], y: &[f64]) -> Result<LeastSquares> {
    let columns: Vec<Vec<DoubleDouble>> = columns.iter().map(|column| column.iter().map(|x| DoubleDouble::from(*x)).collect()).collect();
    Ok(accurate_least_squares(&columns, y)?.0)
}

/// Least squares on columns known to twice the working precision, with coefficients to that precision: solved in doubles,
/// then refined by RᵀR d = Xᵀ r with residuals r and products in double-double. Without the refinement, large residuals
/// leave their rounding in the coefficients.
pub(super) fn accurate_least_squares(columns: &[Vec<DoubleDouble>], y: &[f64]) -> Result<(LeastSquares, Vec<DoubleDouble>)> {
    let mut basis = Orthonormal::new();
    for (j, column) in columns.iter().enumerate() {
        if column.len() != y.len() {
            return Err(Error::input(format!("column {} has {} rows where the data have {}", j + 1, column.len(), y.len())));
        }
        let rounded: Vec<f64> = column.iter().map(|x| x.value()).collect();
        if !basis.push(&rounded) {
            return Err(Error::input(format!("least squares: column {} depends on the columns before it", j + 1))
                .help("use fewer terms, or data in which the variables change independently"));
        }
    }
    let c = basis.project_out(&mut y.to_vec());
    let mut coefficients: Vec<DoubleDouble> = basis.back_substitute(&c).into_iter().map(DoubleDouble::from).collect();
    for _ in 0..3 {
        let r = accurate_residuals(columns, &coefficients, y);
        let product = |x: &Vec<DoubleDouble>| x.iter().zip(&r).fold(DoubleDouble::ZERO, |sum, (x, r)| sum + *x * *r).value();
        let gradient: Vec<f64> = columns.iter().map(product).collect();
        let correction = basis.back_substitute(&basis.forward_substitute(&gradient));
        coefficients.iter_mut().zip(correction).for_each(|(x, d)| *x = *x + DoubleDouble::from(d));
    }
    let residuals: Vec<f64> = accurate_residuals(columns, &coefficients, y).iter().map(|r| r.value()).collect();
    let freedom = y.len() - basis.len();
    let sum: f64 = residuals.iter().map(|e| e * e).sum();
    let variance = if freedom > 0 { sum / freedom as f64 } else { 0.0 };
    let mean = y.iter().sum::<f64>() / y.len() as f64;
    let total: f64 = y.iter().map(|y| (y - mean).powi(2)).sum();
    let solution = LeastSquares {
        coefficients: coefficients.iter().map(|c| c.value()).collect(),
        standard_errors: basis.inverse_gram_diagonal().iter().map(|d| (d * variance).sqrt()).collect(),
        left_out: left_out(&residuals, &basis.leverages(y.len())),
        residuals,
        residual_deviation: variance.sqrt(),
        r_squared: if total > 0.0 { 1.0 - sum / total } else { 1.0 },
    };
    Ok((solution, coefficients))
}

/// Leave-one-out residuals e_i / (1 - h_i).
pub fn left_out(residuals: &[f64], leverages: &[f64]) -> Vec<f64> {
    residuals.iter().zip(leverages).map(|(e, h)| if 1.0 - h > 1e-10 { e / (1.0 - h) } else { f64::INFINITY }).collect()
}

fn accurate_residuals(columns: &[Vec<DoubleDouble>], coefficients: &[DoubleDouble], y: &[f64]) -> Vec<DoubleDouble> {
    (0..y.len())
        .map(|i| columns.iter().zip(coefficients).fold(DoubleDouble::from(y[i]), |rest, (column, c)| rest - column[i] * *c))
        .collect()
}

/// Largest magnitude; a value that is not a number counts as infinite.
pub(crate) fn max_abs(values: &[f64]) -> f64 {
    values.iter().map(|x| if x.is_nan() { f64::INFINITY } else { x.abs() }).fold(0.0, f64::max)
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four running sums let the compiler use vector registers; the order is fixed, so results do not vary.
    let mut sums = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let tail: f64 = a4.remainder().iter().zip(b4.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a4.zip(b4) {
        for k in 0..4 {
            sums[k] += x[k] * y[k];
        }
    }
    (sums[0] + sums[2]) + (sums[1] + sums[3]) + tail
}

pub(super) fn axpy(y: &mut [f64], factor: f64, x: &[f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y += factor * x);
}

fn norm(v: &[f64]) -> f64 {
    let scale = max_abs(v);
    if scale == 0.0 || !scale.is_finite() {
        return scale;
    }
    scale * v.iter().map(|x| (x / scale).powi(2)).sum::<f64>().sqrt()
}
