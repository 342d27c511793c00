//! Dense symmetric positive definite matrices: factor, inverse and determinant in one recursion made of matrix products,
//! which is where a processor is fastest.

use nalgebra::{DMatrix, DMatrixView};

use super::least_squares::{axpy, dot};

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
        self.factor.transpose() * (&self.factor * y)
    }
}

/// Inverts `m`, of which the lower triangle is read. `None` when it is not positive definite to working precision.
pub(crate) fn invert_spd(m: &DMatrix<f64>) -> Option<SpdInverse> {
    let mut log_determinant = 0.0;
    let factor = inverse_factor(m.clone(), &mut log_determinant)?;
    Some(SpdInverse { inverse: gram(factor.as_view()), factor, log_determinant })
}

/// TᵀT of a lower triangle T. In blocks [A 0; B C] it is [AᵀA + BᵀB, BᵀC; CᵀB, CᵀC], a third of the work of a full product.
fn gram(t: DMatrixView<'_, f64>) -> DMatrix<f64> {
    let n = t.nrows();
    if n <= LEAF {
        return t.transpose() * t;
    }
    let h = n / 2;
    let (below, last) = (t.view((h, 0), (n - h, h)), t.view((h, h), (n - h, n - h)));
    let mut first = gram(t.view((0, 0), (h, h)));
    first.gemm(1.0, &below.transpose(), &below, 1.0);
    let coupling = last.transpose() * below;
    let mut product = DMatrix::zeros(n, n);
    product.view_mut((0, 0), (h, h)).copy_from(&first);
    product.view_mut((h, h), (n - h, n - h)).copy_from(&gram(last));
    product.view_mut((0, h), (h, n - h)).copy_from(&coupling.transpose());
    product.view_mut((h, 0), (n - h, h)).copy_from(&coupling);
    product
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

/// Householder reflections whose product Hₚ...H₁ turns the columns of a matrix into an upper triangle. The rows below it span
/// the complement of the columns.
///
/// The product is kept as H₁...Hₚ = I - V T Vᵀ (Schreiber, Van Loan 1989), so that it is applied by matrix products.
pub(crate) struct Reflections {
    /// V: unit vectors v of the reflections I - 2 v vᵀ, as columns.
    vectors: DMatrix<f64>,
    /// V T.
    turned: DMatrix<f64>,
    /// V Tᵀ.
    turned_back: DMatrix<f64>,
}

impl Reflections {
    /// Reflections of the columns of a matrix; `None` if they depend on each other.
    pub fn of(columns: &[Vec<f64>]) -> Option<Self> {
        let n = columns.first().map_or(0, Vec::len);
        let mut done: Vec<Vec<f64>> = Vec::new();
        let mut t = DMatrix::zeros(columns.len(), columns.len());
        for (j, column) in columns.iter().enumerate() {
            let size = dot(column, column).sqrt();
            let mut v = column.clone();
            for other in &done {
                let d = dot(other, &v);
                axpy(&mut v, -2.0 * d, other);
            }
            v.iter_mut().take(j).for_each(|x| *x = 0.0);
            let rest = dot(&v, &v).sqrt();
            if rest.is_nan() || rest <= 1e-10 * size {
                return None;
            }
            let pivot = v.get_mut(j)?;
            *pivot += rest.copysign(*pivot);
            let norm = dot(&v, &v).sqrt();
            v.iter_mut().for_each(|x| *x /= norm);
            // (I - V T Vᵀ)(I - 2 v vᵀ) adds the column [-2 T Vᵀ v; 2] to T.
            let along: Vec<f64> = done.iter().map(|other| dot(other, &v)).collect();
            for i in 0..j {
                t[(i, j)] = -2.0 * (i..j).map(|k| t[(i, k)] * along[k]).sum::<f64>();
            }
            t[(j, j)] = 2.0;
            done.push(v);
        }
        let vectors = DMatrix::from_iterator(n, done.len(), done.into_iter().flatten());
        Some(Self { turned: &vectors * &t, turned_back: &vectors * t.transpose(), vectors })
    }

    /// Hₚ...H₁ Y without the first p rows.
    pub(crate) fn reduce_columns(&self, mut y: DMatrix<f64>) -> DMatrix<f64> {
        let along = self.vectors.transpose() * &y;
        y.gemm(-1.0, &self.turned_back, &along, 1.0);
        let p = self.vectors.ncols();
        y.rows(p, y.nrows() - p).into_owned()
    }

    /// The way back: H₁...Hₚ [0; Z].
    pub(crate) fn expand_columns(&self, z: &DMatrix<f64>) -> DMatrix<f64> {
        let p = self.vectors.ncols();
        let mut y = DMatrix::zeros(z.nrows() + p, z.ncols());
        y.rows_mut(p, z.nrows()).copy_from(z);
        let along = self.vectors.transpose() * &y;
        y.gemm(-1.0, &self.turned, &along, 1.0);
        y
    }

    /// Hₚ...H₁ K H₁...Hₚ for symmetric K, without its first p rows and columns.
    pub fn reduce(&self, mut k: DMatrix<f64>) -> DMatrix<f64> {
        self.reflect(&mut k, &self.turned);
        let p = self.vectors.ncols();
        k.view((p, p), (k.nrows() - p, k.ncols() - p)).into_owned()
    }

    /// The way back: H₁...Hₚ [0 0; 0 M] Hₚ...H₁.
    pub(crate) fn expand(&self, m: &DMatrix<f64>) -> DMatrix<f64> {
        let p = self.vectors.ncols();
        let n = m.nrows() + p;
        let mut k = DMatrix::zeros(n, n);
        k.view_mut((p, p), (n - p, n - p)).copy_from(m);
        self.reflect(&mut k, &self.turned_back);
        k
    }

    /// K := (I - V Aᵀ) K (I - A Vᵀ) = K - V Wᵀ - W Vᵀ with W = K A - V (Aᵀ K A) / 2.
    fn reflect(&self, k: &mut DMatrix<f64>, a: &DMatrix<f64>) {
        let mut w = &*k * a;
        let inner = a.transpose() * &w;
        w.gemm(-0.5, &self.vectors, &inner, 1.0);
        k.gemm(-1.0, &self.vectors, &w.transpose(), 1.0);
        k.gemm(-1.0, &w, &self.vectors.transpose(), 1.0);
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
