//! One cause of a set beside all others: by how much each way in which it may run over the rows makes the readings more probable.
//!
//! With S the covariance of the readings beside the others, X the cause in each row and r the residual, a way in which the cause is a sum of
//! functions phi of the rows, with coefficients of the standard deviations D, has
//!
//! ```text
//! ½ b' (D⁻² + G)⁻¹ b - ½ ln |I + D G D|,    G = phi' X' S⁻¹ X phi,    b = phi' X' S⁻¹ r
//! ```
//!
//! more log evidence than none. So every way costs a matrix as small as its functions are few. A deviation f that is new in every row makes
//! G of X' S⁻¹ X = M the same of M (I + f² M)⁻¹.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::super::profiles::Profiles;
use super::super::rows::Looseness;
use super::posterior::Coefficients;
use super::{Explained, Freedom};
use crate::triangular::{cholesky, solve_lower};

/// A cause beside the others of its set.
pub struct OneCause<'a> {
    profiles: &'a Profiles,
    /// Logarithm of the evidence of the others alone.
    pub without: f64,
    products: Products,
}

enum Products {
    /// Products in each row of a table: M, which is a diagonal less the product of coordinates with themselves, and X' S⁻¹ r.
    OfRows { own: DVector<f64>, along: DMatrix<f64>, pulls: DVector<f64> },
    /// Products of the functions of a log, with the places of these functions.
    OfFunctions(Functions, Vec<usize>),
}

/// Functions of the rows that a cause may follow, beside all that is explained already.
pub struct Functions {
    products: Gram,
    /// Products with the residual.
    pulls: DVector<f64>,
    /// Log evidence of what is new in every row, over that of the others alone.
    without: f64,
}

/// Products of columns with each other.
enum Gram {
    Whole(DMatrix<f64>),
    /// Columns, and those whose products are subtracted from theirs.
    Less(DMatrix<f64>, DMatrix<f64>),
}

impl<'a> Explained<'a> {
    /// A cause beside the others; `None` as in [`Explained::log_evidence`].
    pub fn one_cause(&self, cause: usize, freedoms: &[Freedom], looseness: Looseness) -> Option<OneCause<'a>> {
        let mut others = freedoms.to_vec();
        others[cause] = Freedom::constant(0.0);
        let (without, products) =
            if self.rows.is_log() { self.of_log(cause, &others, looseness)? } else { self.of_rows(cause, &others, looseness)? };
        Some(OneCause { profiles: self.profiles, without, products })
    }

    fn of_rows(&self, cause: usize, others: &[Freedom], looseness: Looseness) -> Option<(f64, Products)> {
        let (rows, shared, last) = (self.own.len(), self.rows.shared.ncols(), self.gram.nrows() - 1);
        let is_free = others.iter().any(|f| f.freedom > 0.0);
        let deviations = self.deviations(others, looseness);
        // Shared columns are eliminated already where no other cause is new in every row.
        let acting: Vec<(usize, f64)> =
            (if is_free { 0 } else { shared }..last).map(|k| (k, deviations[k])).filter(|(_, d)| *d > 0.0).collect();
        let count = acting.len();
        // Columns in this order: those that act, the cause in each row, the residual.
        let all = count + rows + 1;
        let product = |k: usize, column: usize| match column {
            c if c < count => acting[c].1 * self.gram[(k, acting[c].0)],
            c if c < count + rows => self.own[c - count].0[(cause, k)],
            _ => self.gram[(k, last)],
        };
        let (taken, mut determinant) = if is_free {
            let in_row = |row: usize, other: usize, column: usize| match column {
                c if c < count => acting[c].1 * self.own[row].0[(other, acting[c].0)],
                c if c < count + rows => {
                    if c - count == row {
                        self.own[row].1[(other, cause)]
                    } else {
                        0.0
                    }
                }
                _ => self.own[row].0[(other, last)],
            };
            self.taken_from(all, in_row, others)?
        } else {
            let eliminated = self.rows.eliminated(looseness)?;
            (eliminated.along(all, product), eliminated.log_determinant)
        };
        determinant += self.rows.log_determinant();
        let mut matrix = DMatrix::from_fn(count, all, |i, j| acting[i].1 * product(acting[i].0, j) + f64::from(u8::from(i == j)));
        matrix.gemm_tr(-1.0, &taken.columns_range(..count), &taken, 1.0);
        let factor = cholesky(matrix.columns_range(..count).into_owned())?;
        determinant += log_determinant(&factor);
        let mut further = matrix.columns_range(count..).into_owned();
        solve_lower(factor.l_dirty(), &mut further);
        let mut along = DMatrix::zeros(taken.nrows() + count, rows + 1);
        along.rows_range_mut(..taken.nrows()).copy_from(&taken.columns_range(count..));
        along.rows_range_mut(taken.nrows()..).copy_from(&further);
        let (along, of_residual) = (along.columns_range(..rows).into_owned(), along.column(rows));
        let without = -0.5 * (self.gram[(last, last)] - of_residual.norm_squared() + determinant);
        let pulls = DVector::from_fn(rows, |row, _| self.own[row].0[(cause, last)]) - along.tr_mul(&of_residual);
        let own = DVector::from_fn(rows, |row, _| self.own[row].1[(cause, cause)]);
        Some((without, Products::OfRows { own, along, pulls }))
    }

    fn of_log(&self, cause: usize, others: &[Freedom], looseness: Looseness) -> Option<(f64, Products)> {
        let reduced = self.reduced(looseness)?;
        let last = self.profiled.ncols();
        let Coefficients { acting, factor } = self.coefficients(&reduced.products, others)?;
        let own: Vec<usize> = (0..last).filter(|place| self.followed[*place].0 == cause).collect();
        let product = |i: usize, j: usize| reduced.products[(i, j)];
        let place = |j: usize| own.get(j).copied().unwrap_or(last);
        let mut along = DMatrix::from_fn(acting.len(), own.len() + 1, |i, j| acting[i].1 * product(acting[i].0, place(j)));
        solve_lower(factor.l_dirty(), &mut along);
        let (along, of_residual) = (along.columns_range(..own.len()).into_owned(), along.column(own.len()));
        let determinant = self.rows.log_determinant() + reduced.log_determinant + log_determinant(&factor);
        let without = -0.5 * (product(last, last) - of_residual.norm_squared() + determinant);
        let mut products = DMatrix::from_fn(own.len(), own.len(), |i, j| product(own[i], own[j]));
        products.gemm_tr(-1.0, &along, &along, 1.0);
        let pulls = DVector::from_fn(own.len(), |j, _| product(own[j], last)) - along.tr_mul(&of_residual);
        let functions = own.iter().map(|place| self.followed[*place].1).collect();
        Some((without, Products::OfFunctions(Functions { products: Gram::Whole(products), pulls, without: 0.0 }, functions)))
    }
}

impl OneCause<'_> {
    /// Log evidence of the set over that of the others alone, as a function of how free this cause is; `None` where rounding leaves no positive
    /// matrix.
    pub fn gains(&self) -> impl FnMut(&Freedom) -> Option<f64> + '_ {
        let mut known: Vec<(f64, Option<Functions>)> = Vec::new();
        move |freedom| {
            let terms = freedom.acting(self.profiles);
            match &self.products {
                Products::OfFunctions(functions, places) => {
                    let place = |(f, deviation): (usize, f64)| Some((places.iter().position(|own| *own == f)?, deviation));
                    functions.gain(&terms.into_iter().filter_map(place).collect::<Vec<_>>())
                }
                Products::OfRows { .. } => {
                    if !known.iter().any(|(own, _)| *own == freedom.freedom) {
                        known.push((freedom.freedom, self.functions(&self.profiles.functions, freedom.freedom)));
                    }
                    known.iter().find(|(own, _)| *own == freedom.freedom)?.1.as_ref()?.gain(&terms)
                }
            }
        }
    }

    /// Functions of the rows of a table (rows times functions) that the cause may follow beside a deviation that is new in every row; `None` of a log,
    /// and where rounding leaves no positive matrix.
    pub fn functions(&self, functions: &DMatrix<f64>, freedom: f64) -> Option<Functions> {
        let Products::OfRows { own, along, pulls } = &self.products else { return None };
        if freedom == 0.0 {
            let mut columns = functions.clone();
            columns.row_iter_mut().zip(own).for_each(|(mut row, own)| row *= own.sqrt());
            return Some(Functions { products: Gram::Less(columns, along * functions), pulls: functions.tr_mul(pulls), without: 0.0 });
        }
        let root = Root::new(own, along, freedom)?;
        let pull = root.of_columns(DMatrix::from_columns(std::slice::from_ref(pulls)));
        let less = root.of_columns(functions.clone());
        let without = 0.5 * (freedom * freedom * pull.norm_squared() - root.log_determinant);
        let pulls = less.tr_mul(&pull).column(0).into_owned();
        Some(Functions { products: Gram::Less(functions / freedom, less / freedom), pulls, without })
    }
}

impl Functions {
    /// Logarithm of the evidence over that without the cause, where it is a sum of some functions with coefficients of these standard
    /// deviations; `None` where rounding leaves no positive matrix.
    pub fn gain(&self, terms: &[(usize, f64)]) -> Option<f64> {
        let own = |i: usize, j: usize| terms[i].1 * terms[j].1 * self.products.of(terms[i].0, terms[j].0) + f64::from(u8::from(i == j));
        let factor = Cholesky::new(DMatrix::from_fn(terms.len(), terms.len(), own))?;
        let mut along = DVector::from_iterator(terms.len(), terms.iter().map(|(f, deviation)| deviation * self.pulls[*f]));
        factor.l_dirty().solve_lower_triangular_mut(&mut along);
        let log_of_root: f64 = factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
        Some(self.without + 0.5 * along.norm_squared() - log_of_root)
    }
}

impl Gram {
    fn of(&self, i: usize, j: usize) -> f64 {
        match self {
            Self::Whole(products) => products[(i, j)],
            Self::Less(columns, less) => columns.column(i).dot(&columns.column(j)) - less.column(i).dot(&less.column(j)),
        }
    }
}

/// A root of the inverse of A = I + f² M, with M = diag(g) - W' W: by the rows or by the coordinates W, whichever are fewer.
struct Root<'a> {
    /// Logarithm of the determinant of A.
    log_determinant: f64,
    factor: Cholesky<f64, Dyn>,
    /// Diagonal of I + f² diag(g), W, and f where A is inverted by the coordinates.
    by_coordinates: Option<(DVector<f64>, &'a DMatrix<f64>, f64)>,
}

impl<'a> Root<'a> {
    fn new(own: &DVector<f64>, along: &'a DMatrix<f64>, freedom: f64) -> Option<Self> {
        let diagonal = own.map(|g| 1.0 + freedom * freedom * g);
        if own.len() <= along.nrows() {
            let mut matrix = DMatrix::from_diagonal(&diagonal);
            matrix.gemm_tr(-freedom * freedom, along, along, 1.0);
            let factor = cholesky(matrix)?;
            return Some(Self { log_determinant: log_determinant(&factor), factor, by_coordinates: None });
        }
        // |A| = |D| |I - f² W D⁻¹ W'|, and the inverse likewise.
        let mut scaled = along.clone();
        scaled.column_iter_mut().zip(&diagonal).for_each(|(mut column, d)| column *= freedom / d.sqrt());
        let mut matrix = DMatrix::identity(along.nrows(), along.nrows());
        matrix.gemm(-1.0, &scaled, &scaled.transpose(), 1.0);
        let factor = cholesky(matrix)?;
        let log_determinant = log_determinant(&factor) + diagonal.iter().map(|d| d.ln()).sum::<f64>();
        Some(Self { log_determinant, factor, by_coordinates: Some((diagonal, along, freedom)) })
    }

    /// Columns C as Z, with Z' Z = C' A⁻¹ C.
    fn of_columns(&self, mut columns: DMatrix<f64>) -> DMatrix<f64> {
        let Some((diagonal, along, freedom)) = &self.by_coordinates else {
            solve_lower(self.factor.l_dirty(), &mut columns);
            return columns;
        };
        let mut divided = columns.clone();
        divided.row_iter_mut().zip(diagonal).for_each(|(mut row, d)| row /= *d);
        columns.row_iter_mut().zip(diagonal).for_each(|(mut row, d)| row /= d.sqrt());
        let mut further = *along * divided * *freedom;
        solve_lower(self.factor.l_dirty(), &mut further);
        let mut all = DMatrix::zeros(columns.nrows() + further.nrows(), columns.ncols());
        all.rows_range_mut(..columns.nrows()).copy_from(&columns);
        all.rows_range_mut(columns.nrows()..).copy_from(&further);
        all
    }
}

fn log_determinant(factor: &Cholesky<f64, Dyn>) -> f64 {
    2.0 * factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>()
}
