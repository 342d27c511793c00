//! Triangular factors, systems with many right-hand sides, and eigenvectors.

use faer::linalg::solvers::Llt;
use faer::{MatRef, Side};
use nalgebra::{Cholesky, DMatrix, DMatrixView, DMatrixViewMut, Dyn, SymmetricEigen};

/// Unknowns below which a system is solved column by column. Chosen; it decides the time alone.
const SMALL: usize = 32;

/// The factor of a symmetric matrix, of which the triangle below the diagonal is read; `None` where it is not positive.
pub fn cholesky(matrix: DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    let size = matrix.nrows();
    if size <= SMALL {
        return Cholesky::new(matrix);
    }
    let factor = Llt::new(MatRef::from_column_major_slice(matrix.as_slice(), size, size), Side::Lower).ok()?;
    let lower = factor.L();
    Some(Cholesky::pack_dirty(DMatrix::from_fn(size, size, |i, j| if i >= j { lower[(i, j)] } else { 0.0 })))
}

/// Eigenvectors of a symmetric matrix, one column each; those of the identity where a number is not finite.
pub fn eigenvectors(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let size = matrix.nrows();
    if matrix.iter().any(|own| !own.is_finite()) {
        return DMatrix::identity(size, size);
    }
    match MatRef::from_column_major_slice(matrix.as_slice(), size, size).self_adjoint_eigen(Side::Lower) {
        Ok(found) => DMatrix::from_fn(size, size, |i, j| found.U()[(i, j)]),
        Err(_) => SymmetricEigen::new(matrix).eigenvectors,
    }
}

/// Solves L X = B in place of B, with the triangle of L below its diagonal. The system is halved again and again, so that most of the work is
/// in products of matrices.
pub fn solve_lower(lower: &DMatrix<f64>, columns: &mut DMatrix<f64>) {
    solve(lower.as_view(), columns.as_view_mut());
}

fn solve(lower: DMatrixView<'_, f64>, mut columns: DMatrixViewMut<'_, f64>) {
    let size = lower.nrows();
    if size <= SMALL {
        lower.solve_lower_triangular_mut(&mut columns);
        return;
    }
    let half = size / 2;
    let (mut first, mut second) = columns.rows_range_pair_mut(..half, half..);
    solve(lower.view((0, 0), (half, half)), first.as_view_mut());
    second.gemm(-1.0, &lower.view((half, 0), (size - half, half)), &first, 1.0);
    solve(lower.view((half, half), (size - half, size - half)), second);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_times_its_transpose_is_the_matrix() {
        for size in [3, SMALL + 1, 90] {
            let root = DMatrix::from_fn(size, size + 2, |i, j| ((i * 5 + j * 3) as f64).sin());
            let matrix = &root * root.transpose() + DMatrix::identity(size, size);
            let lower = cholesky(matrix.clone()).unwrap().l();
            assert!((&lower * lower.transpose() - matrix).amax() < 1e-10);
            assert!(cholesky(-DMatrix::<f64>::identity(size, size)).is_none());
        }
    }

    #[test]
    fn halves_give_what_columns_give() {
        for size in [1, 32, 33, 131] {
            let lower = DMatrix::from_fn(size, size, |i, j| if i == j { 2.0 } else { ((i * 7 + j * 3) as f64).sin() / size as f64 });
            let columns = DMatrix::from_fn(size, 5, |i, j| ((i + 11 * j) as f64).cos());
            let mut found = columns.clone();
            solve_lower(&lower, &mut found);
            assert!((lower.lower_triangle() * &found - columns).amax() < 1e-12);
        }
    }
}
