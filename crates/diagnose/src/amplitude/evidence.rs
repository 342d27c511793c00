//! Evidence of a set of causes whose amplitudes are free in every row, by linear algebra alone.
//!
//! Readings are y = f + sum of a_mc x_mc + errors, with a_mc = a0_m + g_m(row c) + d_mc for cause m in row c. The mean amplitude a0 is normal
//! with a standard deviation `size`, a function g that is smooth over one variable with `curve`, the deviation d of each row with `freedom`,
//! all in units of the kind's scale. Deviations act in one row each: they change the metric of that row by a matrix as small as the set.
//! Mean amplitudes and smooth functions join the columns that all rows share. So a set costs about as many operations as there are rows,
//! times the square of the number of shared columns.
//!
//! In logs a reading answers to all amplitudes before it: x_m is a column for each function of time that the amplitude may follow, and d is
//! left out. Nothing then changes the metric, and the columns that all sets share are eliminated once.

mod one_cause;
mod posterior;

use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::profiles::{Curve, Function, Profiles};
use super::response::Slope;
use super::rows::{Looseness, Rows};
use crate::triangular::{product_of_transpose, products};
pub use one_cause::Functions;

/// Standard deviation of what is in proportion to a variable, as a share of that of the mean amplitude. Chosen: a law is about as large as
/// what it is a law of.
const LAW: f64 = 0.5;

/// How much the amplitude of one cause may be, in units of its scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Freedom {
    /// Standard deviation of the mean amplitude.
    pub size: f64,
    /// Standard deviation of the deviation in each row.
    pub freedom: f64,
    /// Curve that it follows, and the standard deviation of that.
    pub curve: Option<(Curve, f64)>,
    /// Laws of a log that it follows, one bit each: variables that it is in proportion to, then laws of the time.
    pub law: u64,
}

impl Freedom {
    /// Alike in all rows.
    pub fn constant(size: f64) -> Self {
        Self { size, freedom: 0.0, curve: None, law: 0 }
    }

    /// Whether it follows a law.
    pub fn has(&self, law: usize) -> bool {
        self.law >> law & 1 == 1
    }

    /// Freedoms with one law or curve less, all that leave something.
    pub fn with_one_less(&self) -> Vec<Self> {
        let laws = (0..u64::BITS as usize).filter(|law| self.has(*law)).map(|law| Self { law: self.law ^ 1 << law, ..*self });
        let curve = self.curve.map(|_| Self { curve: None, ..*self });
        laws.chain(curve).filter(|own| own.size > 0.0 || own.law != 0 || own.curve.is_some()).collect()
    }

    /// Functions of the rows that act, each with the standard deviation of its coefficient.
    pub fn acting(&self, profiles: &Profiles) -> Vec<(usize, f64)> {
        profiles.of.iter().map(|function| self.of(*function)).enumerate().filter(|(_, deviation)| *deviation > 0.0).collect()
    }

    /// Standard deviation of the coefficient of a function of the rows.
    fn of(&self, function: Function) -> f64 {
        match (function, self.curve) {
            (Function::Constant, _) => self.size,
            (Function::Linear(v), _) if self.has(v) => LAW * self.size,
            // It may act by such a law alone, and then is as large.
            (Function::When(law), _) if self.has(law) => {
                if self.size > 0.0 {
                    self.size
                } else {
                    1.0
                }
            }
            (Function::Smooth(curve), Some((own, deviation))) if curve == own => deviation,
            _ => 0.0,
        }
    }
}

/// A residual beside a set of causes, all whitened row by row.
pub struct Explained<'a> {
    rows: Arc<Rows>,
    profiles: &'a Profiles,
    residual: DVector<f64>,
    /// One column per cause, for an amplitude of its scale.
    columns: DMatrix<f64>,
    /// Each cause times each function of the rows that it may follow.
    profiled: DMatrix<f64>,
    /// Functions that each cause may follow.
    functions: Vec<Vec<usize>>,
    /// Cause and function of each of these columns.
    followed: Vec<(usize, usize)>,
    /// Scalar products of shared columns, profiled causes and residual, in this order.
    gram: DMatrix<f64>,
    /// Products of the causes with all of these and with each other, row by row.
    own: Vec<(DMatrix<f64>, DMatrix<f64>)>,
    /// Reduced products under the last looseness that was asked for.
    reduced: Mutex<Option<Arc<Reduced>>>,
}

/// Products of profiled causes and residual, in this order, without what the shared columns take.
struct Reduced {
    looseness: Looseness,
    products: DMatrix<f64>,
    /// Logarithm of the determinant of the shared columns.
    log_determinant: f64,
}

impl<'a> Explained<'a> {
    /// A residual (K) beside causes, one column each: K for an amplitude of the cause's scale. `functions` are those of the rows that each
    /// cause may follow.
    pub fn new(rows: Arc<Rows>, profiles: &'a Profiles, residual: &[f64], slopes: &[Slope], functions: &[Vec<usize>]) -> Self {
        let residual = rows.whiten(residual);
        let mean = |slope: &Slope| match slope {
            Slope::OfRow(column) => rows.whiten(column),
            Slope::OfFunctions(columns) => rows.whiten(&columns[0]),
        };
        let columns = match slopes {
            [] => DMatrix::zeros(residual.len(), 0),
            slopes => DMatrix::from_columns(&slopes.iter().map(mean).collect::<Vec<_>>()),
        };
        let shared = &rows.shared;
        let (q, k) = (shared.ncols(), columns.ncols());
        let is_unknown = |m: usize, f: usize| matches!(&slopes[m], Slope::OfFunctions(columns) if f >= columns.len());
        let of_cause =
            |(m, own): (usize, &Vec<usize>)| own.iter().map(|f| (m, *f)).filter(|(m, f)| !is_unknown(*m, *f)).collect::<Vec<_>>();
        let followed: Vec<(usize, usize)> = functions.iter().take(k).enumerate().flat_map(of_cause).collect();
        let mut profiled = DMatrix::zeros(residual.len(), followed.len());
        for (place, (m, f)) in followed.iter().enumerate() {
            match &slopes[*m] {
                Slope::OfFunctions(columns) => profiled.set_column(place, &rows.whiten(&columns[*f])),
                Slope::OfRow(_) => {
                    for (row, range) in rows.ranges.iter().enumerate() {
                        let size = profiles.functions[(row, *f)];
                        range.clone().for_each(|i| profiled[(i, place)] = size * columns[(i, *m)]);
                    }
                }
            }
        }
        let p = profiled.ncols();
        let mut own = Vec::with_capacity(rows.ranges.len());
        // In logs no cause has an amplitude of its own in a row.
        for range in rows.ranges.iter().filter(|_| !rows.is_log()) {
            let x = columns.rows_range(range.clone());
            let mut products = DMatrix::zeros(k, q + p + 1);
            products.view_mut((0, 0), (k, q)).copy_from(&x.tr_mul(&shared.rows_range(range.clone())));
            products.view_mut((0, q), (k, p)).copy_from(&x.tr_mul(&profiled.rows_range(range.clone())));
            products.view_mut((0, q + p), (k, 1)).copy_from(&x.tr_mul(&residual.rows_range(range.clone())));
            own.push((products, x.tr_mul(&x)));
        }
        let mut gram = DMatrix::zeros(q + p + 1, q + p + 1);
        gram.view_mut((0, 0), (q, q)).copy_from(rows.gram());
        let across = product_of_transpose(shared, &profiled);
        gram.view_mut((0, q), (q, p)).copy_from(&across);
        gram.view_mut((q, 0), (p, q)).tr_copy_from(&across);
        gram.view_mut((q, q), (p, p)).copy_from(&products(&profiled));
        // The last row is never read but for its end.
        gram.view_mut((0, q + p), (q, 1)).copy_from(&shared.tr_mul(&residual));
        gram.view_mut((q, q + p), (p, 1)).copy_from(&profiled.tr_mul(&residual));
        gram[(q + p, q + p)] = residual.norm_squared();
        let functions = functions.to_vec();
        Self { rows, profiles, residual, columns, profiled, functions, followed, gram, own, reduced: Mutex::default() }
    }

    /// Whether it is of some rows and functions.
    pub fn is_of(&self, rows: &Arc<Rows>, functions: &[Vec<usize>]) -> bool {
        Arc::ptr_eq(&self.rows, rows) && self.functions == functions
    }

    /// Readings of a row.
    pub fn readings(&self, row: usize) -> std::ops::Range<usize> {
        self.rows.ranges[row].clone()
    }

    /// Number of causes.
    fn count(&self) -> usize {
        self.columns.ncols()
    }

    /// Factor of I + K XᵀX in one row for the causes that are `free`. Scaled by the freedoms, the matrix stays regular where one of them is small.
    fn loosened(&self, row: usize, free: &[usize], freedoms: &[Freedom]) -> Option<Cholesky<f64, Dyn>> {
        let (_, products) = &self.own[row];
        Cholesky::new(DMatrix::from_fn(free.len(), free.len(), |i, j| {
            let of = freedoms[free[i]].freedom * freedoms[free[j]].freedom * products[(free[i], free[j])];
            of + f64::from(u8::from(i == j))
        }))
    }

    /// Standard deviations of the coefficients of the profiled causes.
    fn of_causes<'s>(&'s self, freedoms: &'s [Freedom]) -> impl Iterator<Item = f64> + 's {
        self.followed.iter().map(|(m, f)| freedoms[*m].of(self.profiles.of[*f]))
    }

    fn deviations(&self, freedoms: &[Freedom], looseness: Looseness) -> DVector<f64> {
        let shared = self.rows.deviations(looseness);
        let count = shared.len() + self.profiled.ncols();
        DVector::from_iterator(count, shared.iter().copied().chain(self.of_causes(freedoms)))
    }

    /// Products of profiled causes and residual without what the shared columns take under a looseness.
    fn reduced(&self, looseness: Looseness) -> Option<Arc<Reduced>> {
        let mut last = self.reduced.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = last.as_ref().filter(|known| known.looseness == looseness) {
            return Some(known.clone());
        }
        let eliminated = self.rows.eliminated(looseness)?;
        let (q, own) = (self.rows.shared.ncols(), self.profiled.ncols() + 1);
        let along = eliminated.along(own, |k, j| self.gram[(k, q + j)]);
        let mut products = self.gram.view((q, q), (own, own)).into_owned();
        products.gemm(-1.0, &along.transpose(), &along, 1.0);
        let found = Arc::new(Reduced { looseness, products, log_determinant: eliminated.log_determinant });
        *last = Some(found.clone());
        Some(found)
    }

    /// Logarithm of the evidence, without the constant that is alike for all sets; `None` where rounding leaves no positive matrix.
    pub fn log_evidence(&self, freedoms: &[Freedom], looseness: Looseness) -> Option<f64> {
        let mut determinant = self.rows.log_determinant();
        let is_free = freedoms.iter().any(|f| f.freedom > 0.0);
        let eliminated;
        let (gram, deviations) = if is_free {
            (&self.gram, self.deviations(freedoms, looseness))
        } else {
            eliminated = self.reduced(looseness)?;
            determinant += eliminated.log_determinant;
            (&eliminated.products, DVector::from_iterator(self.profiled.ncols(), self.of_causes(freedoms)))
        };
        let last = gram.nrows() - 1;
        // Columns without variance are left out; the residual comes last.
        let mut acting: Vec<(usize, f64)> = deviations.iter().copied().enumerate().filter(|(_, d)| *d > 0.0).collect();
        let size = acting.len();
        acting.push((last, 1.0));
        let scaled = |i: usize, j: usize| acting[i].1 * acting[j].1 * gram[(acting[i].0, acting[j].0)];
        // Only the triangle below the diagonal is read.
        let mut matrix = DMatrix::from_fn(size + 1, size + 1, |i, j| if i >= j { scaled(j, i) } else { 0.0 });
        if is_free {
            let in_row = |row: usize, cause: usize, k: usize| acting[k].1 * self.own[row].0[(cause, acting[k].0)];
            let (taken, own) = self.taken_from(acting.len(), in_row, freedoms)?;
            determinant += own;
            matrix.gemm_tr(-1.0, &taken, &taken, 1.0);
        }
        (0..size).for_each(|k| matrix[(k, k)] += 1.0);
        let factor = Cholesky::new(matrix.view((0, 0), (size, size)).into_owned())?;
        let mut along = DVector::from_fn(size, |i, _| matrix[(size, i)]);
        factor.l_dirty().solve_lower_triangular_mut(&mut along);
        determinant += 2.0 * factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        Some(-0.5 * (matrix[(size, size)] - along.norm_squared() + determinant))
    }

    /// Coordinates C of so many columns along the deviations of the rows, which take C' C from the products of these columns; with the logarithm of
    /// the determinant of the deviations. `product(row, cause, column)` is that of a cause with a column in one row.
    fn taken_from(
        &self,
        columns: usize,
        product: impl Fn(usize, usize, usize) -> f64,
        freedoms: &[Freedom],
    ) -> Option<(DMatrix<f64>, f64)> {
        let free: Vec<usize> = (0..self.count()).filter(|m| freedoms[*m].freedom > 0.0).collect();
        let mut along = DMatrix::zeros(free.len() * self.own.len(), columns);
        let mut log_determinant = 0.0;
        for row in 0..self.own.len() {
            let factor = self.loosened(row, &free, freedoms)?;
            let lower = factor.l_dirty();
            log_determinant += 2.0 * lower.diagonal().iter().map(|d| d.ln()).sum::<f64>();
            let at = row * free.len();
            for (k, mut column) in along.column_iter_mut().enumerate() {
                for (i, m) in free.iter().enumerate() {
                    let before: f64 = (0..i).map(|j| lower[(i, j)] * column[at + j]).sum();
                    column[at + i] = (freedoms[*m].freedom * product(row, *m, k) - before) / lower[(i, i)];
                }
            }
        }
        Some((along, log_determinant))
    }
}

#[cfg(test)]
mod tests {
    use super::super::profiles::{LENGTHS, near};
    use super::super::rows::Errors;
    use super::*;

    /// Two causes over three rows of unequal length, with a number, a bias, errors of rows and a disturbance.
    fn case() -> (Errors, Vec<f64>, Vec<Vec<f64>>) {
        let row_of = vec![0, 0, 0, 1, 1, 1, 2, 2];
        let wave = |k: usize| (0..8).map(|i| ((i * (k + 2) + k) as f64 * 0.7).sin()).collect::<Vec<f64>>();
        let only = |row: usize, column: Vec<f64>| {
            column.into_iter().zip(&row_of).map(|(c, r)| if *r == row { c } else { 0.0 }).collect::<Vec<f64>>()
        };
        let errors = Errors {
            noise: vec![0.1, 0.2, 0.1, 0.1, 0.2, 0.1, 0.2, 0.1],
            stated: vec![wave(1), only(1, wave(2)), only(0, wave(3))],
            uncertain: 0..0,
            numbers: vec![wave(4), wave(5)],
            heats: vec![wave(6), wave(7)],
            levels: vec![wave(12)],
            conditions: vec![wave(11)],
            wrong_conditions: vec![only(2, wave(13))],
            biases: 1,
            row_of,
            log: None,
            aside: Vec::new(),
            wide: 0.0,
        };
        (errors, wave(8), vec![wave(9), wave(10)])
    }

    /// The covariance of everything, written out, with the prior covariance of each cause's amplitudes.
    fn dense(errors: &Errors, columns: &[Vec<f64>], priors: &[DMatrix<f64>], loose: Looseness) -> DMatrix<f64> {
        let n = errors.noise.len();
        let mut all = DMatrix::zeros(n, n);
        let mut add = |a: &[f64], variance: f64, same_row: bool| {
            for i in 0..n {
                for j in 0..n {
                    if !same_row || errors.row_of[i] == errors.row_of[j] {
                        all[(i, j)] += variance * a[i] * a[j];
                    }
                }
            }
        };
        let is_bias = |k: usize| k < errors.biases;
        errors.stated.iter().enumerate().for_each(|(k, c)| add(c, if is_bias(k) { loose.noise.powi(2) } else { 1.0 }, false));
        errors.numbers.iter().for_each(|c| add(c, loose.spread.powi(2), false));
        errors.heats.iter().for_each(|c| add(c, loose.disturbance.powi(2), true));
        errors.levels.iter().for_each(|c| add(c, loose.level.powi(2), true));
        errors.conditions.iter().for_each(|c| add(c, loose.conditions.powi(2), true));
        errors.wrong_conditions.iter().for_each(|c| add(c, 1.0, true));
        (0..n).for_each(|i| all[(i, i)] += (loose.noise * errors.noise[i]).powi(2));
        for (column, prior) in columns.iter().zip(priors) {
            all += DMatrix::from_fn(n, n, |i, j| column[i] * column[j] * prior[(errors.row_of[i], errors.row_of[j])]);
        }
        all
    }

    #[test]
    fn evidence_amplitudes_and_kept_out_rows_are_those_of_the_covariance_written_out() {
        let (errors, residual, columns) = case();
        let looseness = Looseness { spread: 0.3, disturbance: 0.2, level: 0.1, conditions: 0.4, wandering: 0.0, noise: 1.5 };
        let slopes: Vec<Slope> = columns.iter().cloned().map(Slope::OfRow).collect();
        let rows = Arc::new(Rows::new(&errors, looseness).unwrap());
        let profiles = Profiles::smooth(3, &[vec![0.0, 1.0, 3.0]]);
        let all: Vec<usize> = (0..profiles.of.len()).collect();
        let explained = Explained::new(rows, &profiles, &residual, &slopes, &[all.clone(), all]);
        let r = DVector::from_column_slice(&residual);
        let curve = Some(((0, 0), 0.7));
        for freedoms in [
            [(1.0, 0.5, None), (3.0, 0.0, None)],
            [(1.0, 0.0, None), (3.0, 0.0, None)],
            [(1.0, 0.0, None), (1.0, 0.0, curve)],
            [(3.0, 1.5, curve), (1.0, 0.15, None)],
        ] {
            let freedoms = freedoms.map(|(size, freedom, curve)| Freedom { size, freedom, curve, law: 0 });
            // The kernel of a smooth function less its means, as the definition has it.
            let x: [f64; 3] = [0.0, 1.0, 3.0];
            let deviation = (x.iter().map(|x| (x - 4.0 / 3.0).powi(2)).sum::<f64>() / 3.0).sqrt();
            let kernel = DMatrix::from_fn(3, 3, |i, j| near((x[i] - x[j]) / (LENGTHS[0] * deviation)));
            let centre = DMatrix::identity(3, 3) - DMatrix::from_element(3, 3, 1.0 / 3.0);
            let kernel = &centre * kernel * &centre;
            let prior = |f: &Freedom| {
                let curve = f.curve.map_or(0.0, |(_, size)| size * size);
                let other = |i: usize, j: usize| f.size * f.size + if i == j { f.freedom * f.freedom } else { 0.0 };
                &kernel * curve + DMatrix::from_fn(3, 3, other)
            };
            let full = dense(&errors, &columns, &freedoms.map(|f| prior(&f)), looseness);
            let inverse = full.clone().try_inverse().unwrap();
            let expected = -0.5 * ((r.transpose() * &inverse * &r)[0] + full.determinant().ln());
            let found = explained.log_evidence(&freedoms, looseness).unwrap();
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");

            let posterior = explained.posterior(&freedoms, looseness).unwrap();
            for (m, amplitudes) in posterior.amplitudes().iter().enumerate() {
                let prior = prior(&freedoms[m]);
                let with = DMatrix::from_fn(3, 8, |row, i| columns[m][i] * prior[(row, errors.row_of[i])]);
                let mean = &with * &inverse * &r;
                let covariance = prior - &with * &inverse * with.transpose();
                assert!((0..3).all(|row| (amplitudes[row] - mean[row]).abs() < 1e-9));
                let variances = posterior.variances(m);
                assert!((0..3).all(|row| (variances[row] - covariance[(row, row)]).abs() < 1e-9));
            }

            // A cause that follows functions, beside the other alone.
            let without = [freedoms[0], Freedom::constant(0.0)];
            let beside = explained.one_cause(1, &freedoms, looseness).unwrap();
            let terms: Vec<(usize, f64)> = (0..profiles.of.len()).map(|f| (f, freedoms[1].of(profiles.of[f]))).collect();
            let gain = beside.functions(&profiles.functions, freedoms[1].freedom).unwrap().gain(&terms).unwrap();
            let expected = found - explained.log_evidence(&without, looseness).unwrap();
            assert!((gain - expected).abs() < 1e-9, "{gain} {expected}");
            for (cause, own) in freedoms.iter().enumerate() {
                let one = explained.one_cause(cause, &freedoms, looseness).unwrap();
                let again = one.without + one.gains()(own).unwrap();
                assert!((again - found).abs() < 1e-9, "{again} {found}");
            }

            for (row, density) in posterior.kept_out().into_iter().enumerate() {
                let own: Vec<usize> = (0..8).filter(|i| errors.row_of[*i] == row).collect();
                let block = DMatrix::from_fn(own.len(), own.len(), |i, j| inverse[(own[i], own[j])]);
                let pull = &inverse * &r;
                let pull = DVector::from_fn(own.len(), |i, _| pull[own[i]]);
                let expected = -0.5 * (pull.transpose() * block.clone().try_inverse().unwrap() * &pull)[0] + 0.5 * block.determinant().ln();
                assert!((density - expected).abs() < 1e-9, "{density} {expected}");
            }

            // Amplitudes in a row, and the coefficient of a bias, as all other rows have them.
            for (row, without) in posterior.without_each_row(&[0]).unwrap().into_iter().enumerate() {
                let others: Vec<usize> = (0..8).filter(|i| errors.row_of[*i] != row).collect();
                let known = full.select_rows(&others).select_columns(&others).try_inverse().unwrap() * r.select_rows(&others);
                for (m, own) in without.coefficients.iter().enumerate() {
                    let prior = prior(&freedoms[m]);
                    let with = DVector::from_fn(others.len(), |i, _| columns[m][others[i]] * prior[(row, errors.row_of[others[i]])]);
                    assert!((profiles.course(own)[row] - with.dot(&known)).abs() < 1e-9, "cause {m} in row {row}");
                }
                let bias = DVector::from_fn(others.len(), |i, _| looseness.noise * errors.stated[0][others[i]]);
                assert!((without.shared[0] - bias.dot(&known)).abs() < 1e-9, "bias in row {row}");
            }

            // Readings of two rows, and what they were with other residuals and other noise.
            let own = [1, 4, 5];
            let block = DMatrix::from_fn(3, 3, |i, j| inverse[(own[i], own[j])]).try_inverse().unwrap();
            let error = &block * (&inverse * &r).select_rows(&own);
            let found = posterior.others().predict(&own).unwrap();
            assert!((&found.error - &error).amax() < 1e-9);
            let of = |error: &DVector<f64>, covariance: &DMatrix<f64>| {
                let weighed = covariance.clone().try_inverse().unwrap() * error;
                -0.5 * (error.dot(&weighed) + covariance.determinant().ln())
            };
            assert!((found.log_density - of(&error, &block)).abs() < 1e-9);
            let residual = DVector::from_row_slice(&[0.3, -0.2, 0.0]);
            let more = DMatrix::from_diagonal(&DVector::from_row_slice(&[0.1, 0.4, 0.2]));
            let expected = of(&(&error + &residual), &(&block + &more));
            assert!((found.log_density_with(&residual, more).unwrap() - expected).abs() < 1e-9);
            // With c cᵀ in the covariance, the coefficient of c is cᵀ of the inverse covariance times the error.
            let column = DVector::from_row_slice(&[0.2, 0.1, -0.3]);
            let expected = column.dot(&(block.try_inverse().unwrap() * &error));
            assert!((found.coefficient(&column) - expected).abs() < 1e-9);
        }
    }
}
