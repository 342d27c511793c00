//! Products, triangular factors, systems with many right-hand sides, and eigenvectors.

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::solvers::Llt;
use faer::{Accum, MatMut, MatRef, Par, Side};
use nalgebra::{Cholesky, DMatrix, DMatrixView, DMatrixViewMut, DVector, Dyn, SymmetricEigen};

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

/// Eigenvalues and eigenvectors of a symmetric matrix, one column each; those of the identity where a number is not finite.
pub fn eigen(matrix: DMatrix<f64>) -> (DVector<f64>, DMatrix<f64>) {
    let size = matrix.nrows();
    if matrix.iter().any(|own| !own.is_finite()) {
        return (DVector::from_element(size, 1.0), DMatrix::identity(size, size));
    }
    match MatRef::from_column_major_slice(matrix.as_slice(), size, size).self_adjoint_eigen(Side::Lower) {
        Ok(found) => (DVector::from_fn(size, |i, _| found.S()[i]), DMatrix::from_fn(size, size, |i, j| found.U()[(i, j)])),
        Err(_) => {
            let found = SymmetricEigen::new(matrix);
            (found.eigenvalues, found.eigenvectors)
        }
    }
}

/// Products of columns with each other.
pub fn products(columns: &DMatrix<f64>) -> DMatrix<f64> {
    let (own, count) = (whole(columns), columns.ncols());
    let mut all = DMatrix::zeros(count, count);
    let found = MatMut::from_column_major_slice_mut(all.as_mut_slice(), count, count);
    let (lower, full) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
    triangular::matmul(found, lower, Accum::Replace, own.transpose(), full, own, full, 1.0, Par::Seq);
    all.fill_upper_triangle_with_lower_triangle();
    all
}

/// The product of two matrices.
pub fn product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    times(whole(a), whole(b))
}

/// The product of the transpose of one matrix with another one.
pub fn product_of_transpose(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    times(whole(a).transpose(), whole(b))
}

fn whole(matrix: &DMatrix<f64>) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(matrix.as_slice(), matrix.nrows(), matrix.ncols())
}

fn times(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(a.nrows(), b.ncols());
    matmul(MatMut::from_column_major_slice_mut(all.as_mut_slice(), a.nrows(), b.ncols()), Accum::Replace, a, b, 1.0, Par::Seq);
    all
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
    fn products_are_those_written_out() {
        for (rows, count) in [(0, 2), (5, 3), (70, 45)] {
            let columns = DMatrix::from_fn(rows, count, |i, j| ((i * 5 + j * 3) as f64).sin());
            assert!(count == 0 || (products(&columns) - columns.transpose() * &columns).amax() < 1e-11);
            let turned = DMatrix::from_fn(count, 4, |i, j| ((i + 11 * j) as f64).cos());
            assert!(rows == 0 || (product(&columns, &turned) - &columns * &turned).amax() < 1e-11);
            let same = product_of_transpose(&columns, &columns);
            assert!(rows == 0 || (same - columns.transpose() * &columns).amax() < 1e-11);
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
