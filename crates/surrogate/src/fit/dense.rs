//! Dense symmetric positive definite matrices: factor, inverse and determinant in one recursion made of matrix products,
//! which is where a processor is fastest.

use nalgebra::DMatrix;

/// Order of a matrix below which the recursion ends in plain loops. Chosen: matrix products pay only for larger
/// blocks.
const LEAF: usize = 24;

/// The inverse of a symmetric positive definite matrix and the logarithm of its determinant.
pub(crate) struct SpdInverse {
    /// M⁻¹, symmetric.
    pub inverse: DMatrix<f64>,
    /// L⁻¹ with M = L Lᵀ. Solving by L⁻ᵀ (L⁻¹ y) leaves a residual of order sqrt(cond M) eps, by M⁻¹ y of order cond M eps.
    pub factor: DMatrix<f64>,
    /// ln det M.
    pub log_determinant: f64,
}

impl SpdInverse {
    /// M⁻¹ y.
    pub fn solve(&self, y: &DMatrix<f64>) -> DMatrix<f64> {
        self.factor.tr_mul(&(&self.factor * y))
    }
}

/// Inverts `m`, of which the lower triangle is read. `None` when it is not positive definite to working precision.
pub(crate) fn invert_spd(m: &DMatrix<f64>) -> Option<SpdInverse> {
    let n = m.nrows();
    let mut log_determinant = 0.0;
    let lower = inverse_factor(m.clone(), &mut log_determinant)?;
    let mut inverse = DMatrix::zeros(n, n);
    inverse.gemm_tr(1.0, &lower, &lower, 0.0);
    Some(SpdInverse { inverse, factor: lower, log_determinant })
}

/// L⁻¹ where M = L Lᵀ. With M in blocks, L₂₁ = M₂₁ L₁₁⁻ᵀ, the rest M₂₂ - L₂₁ L₂₁ᵀ is factored in turn, and the lower left
/// block of the inverse is -L₂₂⁻¹ L₂₁ L₁₁⁻¹.
pub(super) fn inverse_factor(m: DMatrix<f64>, log_determinant: &mut f64) -> Option<DMatrix<f64>> {
    let n = m.nrows();
    if n <= LEAF {
        return leaf(m, log_determinant);
    }
    let h = n / 2;
    let first = inverse_factor(m.view((0, 0), (h, h)).into_owned(), log_determinant)?;
    let l21 = m.view((h, 0), (n - h, h)) * first.transpose();
    let mut rest = m.view((h, h), (n - h, n - h)).into_owned();
    rest.gemm(-1.0, &l21, &l21.transpose(), 1.0);
    let second = inverse_factor(rest, log_determinant)?;
    let mut lower = DMatrix::zeros(n, n);
    let coupling = &second * (l21 * &first);
    lower.view_mut((0, 0), (h, h)).copy_from(&first);
    lower.view_mut((h, h), (n - h, n - h)).copy_from(&second);
    lower.view_mut((h, 0), (n - h, h)).copy_from(&(-coupling));
    Some(lower)
}

fn leaf(mut l: DMatrix<f64>, log_determinant: &mut f64) -> Option<DMatrix<f64>> {
    let n = l.nrows();
    for j in 0..n {
        let pivot = l[(j, j)];
        if !(pivot > 0.0 && pivot.is_finite()) {
            return None;
        }
        *log_determinant += pivot.ln();
        let root = pivot.sqrt();
        l[(j, j)] = root;
        for i in j + 1..n {
            l[(i, j)] /= root;
        }
        for k in j + 1..n {
            let f = l[(k, j)];
            for i in k..n {
                l[(i, k)] -= l[(i, j)] * f;
            }
        }
    }
    let mut inverse = DMatrix::zeros(n, n);
    for j in 0..n {
        inverse[(j, j)] = 1.0 / l[(j, j)];
        for i in j + 1..n {
            let sum: f64 = (j..i).map(|k| l[(i, k)] * inverse[(k, j)]).sum();
            inverse[(i, j)] = -sum / l[(i, i)];
        }
    }
    Some(inverse)
}

/// Unit vectors v of Householder reflections H = I - 2 v vᵀ whose product Hₚ...H₁ turns the columns of a matrix into an
/// upper triangle. The rows below it span the complement of the columns.
pub(crate) struct Reflections(Vec<Vec<f64>>);

impl Reflections {
    /// Reflections of the columns of a matrix; `None` if they depend on each other.
    pub fn of(columns: &[Vec<f64>]) -> Option<Self> {
        let mut done = Self(Vec::new());
        for (j, column) in columns.iter().enumerate() {
            let size = super::least_squares::dot(column, column).sqrt();
            let mut v = column.clone();
            done.apply(&mut v);
            v.iter_mut().take(j).for_each(|x| *x = 0.0);
            let rest = super::least_squares::dot(&v, &v).sqrt();
            if rest.is_nan() || rest <= 1e-10 * size {
                return None;
            }
            let pivot = v.get_mut(j)?;
            *pivot += rest.copysign(*pivot);
            let norm = super::least_squares::dot(&v, &v).sqrt();
            v.iter_mut().for_each(|x| *x /= norm);
            done.0.push(v);
        }
        Some(done)
    }

    /// Hₚ...H₁ y.
    pub fn apply(&self, y: &mut [f64]) {
        for v in &self.0 {
            let d = super::least_squares::dot(v, y);
            super::least_squares::axpy(y, -2.0 * d, v);
        }
    }

    /// Hₚ...H₁ Y for every column of `y`, without the first p rows.
    pub(crate) fn reduce_columns(&self, mut y: DMatrix<f64>) -> DMatrix<f64> {
        let n = y.nrows();
        y.as_mut_slice().chunks_exact_mut(n).for_each(|column| self.apply(column));
        y.rows(self.0.len(), n - self.0.len()).into_owned()
    }

    /// The way back: H₁...Hₚ [0; Z] for every column.
    pub(crate) fn expand_columns(&self, z: &DMatrix<f64>) -> DMatrix<f64> {
        let n = z.nrows() + self.0.len();
        let mut y = DMatrix::zeros(n, z.ncols());
        y.rows_mut(self.0.len(), z.nrows()).copy_from(z);
        for column in y.as_mut_slice().chunks_exact_mut(n) {
            for v in self.0.iter().rev() {
                let d = super::least_squares::dot(v, column);
                super::least_squares::axpy(column, -2.0 * d, v);
            }
        }
        y
    }

    /// Hₚ...H₁ K H₁...Hₚ for symmetric K, without its first p rows and columns.
    pub fn reduce(&self, mut k: DMatrix<f64>) -> DMatrix<f64> {
        for v in &self.0 {
            reflect(&mut k, v);
        }
        let p = self.0.len();
        k.view((p, p), (k.nrows() - p, k.ncols() - p)).into_owned()
    }

    /// The way back: H₁...Hₚ [0 0; 0 M] Hₚ...H₁.
    pub(crate) fn expand(&self, m: &DMatrix<f64>) -> DMatrix<f64> {
        let p = self.0.len();
        let n = m.nrows() + p;
        let mut k = DMatrix::zeros(n, n);
        k.view_mut((p, p), (n - p, n - p)).copy_from(m);
        for v in self.0.iter().rev() {
            reflect(&mut k, v);
        }
        k
    }
}

/// K := H K H = K - v wᵀ - w vᵀ with w = 2 (K v - (vᵀ K v) v).
fn reflect(k: &mut DMatrix<f64>, v: &[f64]) {
    let n = v.len();
    let mut w = vec![0.0; n];
    for (column, vj) in k.as_slice().chunks_exact(n).zip(v) {
        if *vj != 0.0 {
            super::least_squares::axpy(&mut w, *vj, column);
        }
    }
    let a = super::least_squares::dot(&w, v);
    w.iter_mut().zip(v).for_each(|(w, v)| *w = 2.0 * (*w - a * v));
    for ((column, vj), wj) in k.as_mut_slice().chunks_exact_mut(n).zip(v).zip(&w) {
        for ((x, vi), wi) in column.iter_mut().zip(v).zip(&w) {
            *x -= vi * wj + wi * vj;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_times_matrix_is_identity_and_determinant_is_right() {
        for n in [1, 5, 24, 25, 60, 131] {
            // M = B Bᵀ + I with B of small integers; the determinant comes from nalgebra's own factorisation.
            let b = DMatrix::from_fn(n, n, |i, j| ((i * 7 + j * 13) % 11) as f64 - 5.0);
            let m = &b * b.transpose() + DMatrix::identity(n, n);
            let found = invert_spd(&m).unwrap();
            let error = (&m * &found.inverse - DMatrix::identity(n, n)).amax();
            assert!(error < 1e-9, "{n}: {error}");
            let determinant = m.clone().cholesky().unwrap().l().diagonal().iter().map(|d| 2.0 * d.ln()).sum::<f64>();
            assert!((found.log_determinant - determinant).abs() < 1e-8 * determinant.abs().max(1.0));
        }
        assert!(invert_spd(&DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0])).is_none());
    }
}
