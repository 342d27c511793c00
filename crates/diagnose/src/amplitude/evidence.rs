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

use std::sync::{Mutex, PoisonError};

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::others::Others;
use super::profiles::{Curve, Function, Profiles};
use super::response::Slope;
use super::rows::{Looseness, Rows};
use crate::triangular::solve_lower;

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
    rows: &'a Rows,
    profiles: &'a Profiles,
    residual: DVector<f64>,
    /// One column per cause, for an amplitude of its scale.
    columns: DMatrix<f64>,
    /// Each cause times each function of the rows that it may follow.
    profiled: DMatrix<f64>,
    /// Cause and function of each of these columns.
    followed: Vec<(usize, usize)>,
    /// Scalar products of shared columns, profiled causes and residual, in this order.
    gram: DMatrix<f64>,
    /// Products of the causes with all of these and with each other, row by row.
    own: Vec<(DMatrix<f64>, DMatrix<f64>)>,
    /// Products of profiled causes and residual without what the shared columns take, under the last looseness that was asked for.
    reduced: Mutex<Option<(Looseness, DMatrix<f64>, f64)>>,
}

/// The posterior under one choice of freedoms.
pub struct Posterior<'a> {
    explained: &'a Explained<'a>,
    freedoms: Vec<Freedom>,
    /// Shared columns and mean amplitudes under the metric of the rows, each for one standard deviation.
    metric: DMatrix<f64>,
    factor: Cholesky<f64, Dyn>,
    /// Inverse covariance times the residual.
    pull: DVector<f64>,
}

impl<'a> Explained<'a> {
    /// A residual (K) beside causes, one column each: K for an amplitude of the cause's scale. `functions` are those of the rows that each
    /// cause may follow.
    pub fn new(rows: &'a Rows, profiles: &'a Profiles, residual: &[f64], slopes: &[Slope], functions: &[Vec<usize>]) -> Self {
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
        for range in rows.ranges.iter().filter(|_| rows.disturbance.is_some()) {
            let x = columns.rows_range(range.clone());
            let mut products = DMatrix::zeros(k, q + p + 1);
            products.view_mut((0, 0), (k, q)).copy_from(&x.tr_mul(&shared.rows_range(range.clone())));
            products.view_mut((0, q), (k, p)).copy_from(&x.tr_mul(&profiled.rows_range(range.clone())));
            products.view_mut((0, q + p), (k, 1)).copy_from(&x.tr_mul(&residual.rows_range(range.clone())));
            own.push((products, x.tr_mul(&x)));
        }
        let mut gram = DMatrix::zeros(q + p + 1, q + p + 1);
        gram.view_mut((0, 0), (q, q)).copy_from(rows.gram());
        let across = shared.transpose() * &profiled;
        gram.view_mut((0, q), (q, p)).copy_from(&across);
        gram.view_mut((q, 0), (p, q)).tr_copy_from(&across);
        gram.view_mut((q, q), (p, p)).copy_from(&(profiled.transpose() * &profiled));
        // The last row is never read but for its end.
        gram.view_mut((0, q + p), (q, 1)).copy_from(&shared.tr_mul(&residual));
        gram.view_mut((q, q + p), (p, 1)).copy_from(&profiled.tr_mul(&residual));
        gram[(q + p, q + p)] = residual.norm_squared();
        Self { rows, profiles, residual, columns, profiled, followed, gram, own, reduced: Mutex::default() }
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

    /// Matrix that the deviations of a row take from its metric: the inverse of K⁻¹ + XᵀX for the causes that are free, zero for the others.
    fn taken(&self, row: usize, freedoms: &[Freedom]) -> DMatrix<f64> {
        let k = self.count();
        let free: Vec<usize> = (0..k).filter(|m| freedoms[*m].freedom > 0.0).collect();
        let mut all = DMatrix::zeros(k, k);
        let Some(factor) = self.loosened(row, &free, freedoms) else { return all };
        let inverse = factor.inverse();
        for (i, a) in free.iter().enumerate() {
            for (j, b) in free.iter().enumerate() {
                all[(*a, *b)] = freedoms[*a].freedom * freedoms[*b].freedom * inverse[(i, j)];
            }
        }
        all
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

    /// Products of profiled causes and residual (in this order) without what the shared columns take, and the logarithm of the determinant of
    /// these.
    fn reduced(&self, looseness: Looseness) -> Option<(DMatrix<f64>, f64)> {
        let mut last = self.reduced.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, products, log)) = last.as_ref().filter(|(of, ..)| *of == looseness) {
            return Some((products.clone(), *log));
        }
        let eliminated = self.rows.eliminated(looseness)?;
        let (q, own) = (self.rows.shared.ncols(), self.profiled.ncols() + 1);
        let mut along = DMatrix::from_fn(eliminated.acting.len(), own, |i, j| {
            let (k, deviation) = eliminated.acting[i];
            deviation * self.gram[(k, q + j)]
        });
        solve_lower(eliminated.factor.l_dirty(), &mut along);
        let mut products = self.gram.view((q, q), (own, own)).into_owned();
        products.gemm(-1.0, &along.transpose(), &along, 1.0);
        *last = Some((looseness, products.clone(), eliminated.log_determinant));
        Some((products, eliminated.log_determinant))
    }

    /// Logarithm of the evidence, without the constant that is alike for all sets; `None` where rounding leaves no positive matrix.
    pub fn log_evidence(&self, freedoms: &[Freedom], looseness: Looseness) -> Option<f64> {
        let mut determinant = self.rows.log_determinant();
        let is_free = freedoms.iter().any(|f| f.freedom > 0.0);
        let eliminated;
        let (gram, deviations) = if is_free {
            (&self.gram, self.deviations(freedoms, looseness))
        } else {
            let (products, of_shared) = self.reduced(looseness)?;
            determinant += of_shared;
            eliminated = products;
            (&eliminated, DVector::from_iterator(self.profiled.ncols(), self.of_causes(freedoms)))
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
            let (taken, own) = self.taken_from(&acting, freedoms)?;
            determinant += own;
            matrix.gemm(-1.0, &taken, &taken.transpose(), 1.0);
        }
        (0..size).for_each(|k| matrix[(k, k)] += 1.0);
        let factor = Cholesky::new(matrix.view((0, 0), (size, size)).into_owned())?;
        let mut along = DVector::from_fn(size, |i, _| matrix[(size, i)]);
        factor.l_dirty().solve_lower_triangular_mut(&mut along);
        determinant += 2.0 * factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        Some(-0.5 * (matrix[(size, size)] - along.norm_squared() + determinant))
    }

    /// A root of all that the deviations of the rows take from the products of columns, which are scaled: a line for each of these; with the sum
    /// of the logarithms of the determinants.
    fn taken_from(&self, columns: &[(usize, f64)], freedoms: &[Freedom]) -> Option<(DMatrix<f64>, f64)> {
        let free: Vec<usize> = (0..self.count()).filter(|m| freedoms[*m].freedom > 0.0).collect();
        let mut root = DMatrix::zeros(columns.len(), free.len() * self.own.len());
        let mut log_determinant = 0.0;
        for (row, (products, _)) in self.own.iter().enumerate() {
            let factor = self.loosened(row, &free, freedoms)?;
            log_determinant += 2.0 * factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
            // A triangular solve by the small factor, for all columns at once.
            let lower = factor.l_dirty();
            for (i, m) in free.iter().enumerate() {
                let at = row * free.len();
                for (k, (column, deviation)) in columns.iter().enumerate() {
                    let own = freedoms[*m].freedom * deviation * products[(*m, *column)];
                    let before: f64 = (0..i).map(|j| lower[(i, j)] * root[(k, at + j)]).sum();
                    root[(k, at + i)] = (own - before) / lower[(i, i)];
                }
            }
        }
        Some((root, log_determinant))
    }

    /// The posterior under one choice; `None` as in [`Explained::log_evidence`].
    pub fn posterior(&'a self, freedoms: &[Freedom], looseness: Looseness) -> Option<Posterior<'a>> {
        let deviations = self.deviations(freedoms, looseness);
        let q = self.rows.shared.ncols();
        // Columns without variance are left out.
        let acting: Vec<usize> = (0..deviations.len()).filter(|k| deviations[*k] > 0.0).collect();
        let mut columns = DMatrix::zeros(self.residual.len(), acting.len());
        for (mut column, k) in columns.column_iter_mut().zip(&acting) {
            let own = if *k < q { self.rows.shared.column(*k) } else { self.profiled.column(*k - q) };
            column.axpy(deviations[*k], &own, 0.0);
        }
        let metric = self.under_metric(&columns, freedoms);
        let mut matrix = columns.transpose() * &metric;
        (0..matrix.nrows()).for_each(|k| matrix[(k, k)] += 1.0);
        let factor = Cholesky::new(matrix)?;
        let mut found =
            Posterior { pull: DVector::zeros(self.residual.len()), explained: self, freedoms: freedoms.to_vec(), metric, factor };
        found.pull = found.solve(&DMatrix::from_columns(std::slice::from_ref(&self.residual))).column(0).into_owned();
        Some(found)
    }

    /// Columns under the metric of the rows.
    fn under_metric(&self, columns: &DMatrix<f64>, freedoms: &[Freedom]) -> DMatrix<f64> {
        let mut found = columns.clone();
        if freedoms.iter().all(|f| f.freedom == 0.0) {
            return found;
        }
        for (row, range) in self.rows.ranges.iter().enumerate() {
            let x = self.columns.rows_range(range.clone());
            let taken = self.taken(row, freedoms);
            let less = x * (taken * x.tr_mul(&columns.rows_range(range.clone())));
            let mut own = found.rows_range_mut(range.clone());
            own -= less;
        }
        found
    }
}

impl Posterior<'_> {
    /// Inverse covariance times columns.
    fn solve(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let along = self.factor.solve(&self.metric.tr_mul(columns));
        self.explained.under_metric(columns, &self.freedoms) - &self.metric * along
    }

    /// Prior covariance of the amplitudes of one cause in all rows, in units of its scale squared.
    fn prior(&self, cause: usize) -> DMatrix<f64> {
        let (f, profiles) = (self.freedoms[cause], self.explained.profiles);
        let mut scaled = profiles.functions.clone();
        scaled.column_iter_mut().zip(&profiles.of).for_each(|(mut column, function)| column *= f.of(*function));
        let mut prior = &scaled * scaled.transpose();
        (0..prior.nrows()).for_each(|row| prior[(row, row)] += f.freedom * f.freedom);
        prior
    }

    /// Functions that one cause follows, each with the place of its column and the standard deviation of its coefficient.
    fn followed(&self, cause: usize) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        let own = self.explained.followed.iter().enumerate().filter(move |(_, (m, _))| *m == cause);
        let f = self.freedoms[cause];
        own.map(move |(place, (_, function))| (*function, place, f.of(self.explained.profiles.of[*function])))
    }

    /// Covariance of the readings, whitened row by row, with the amplitudes of one cause in all rows.
    fn with_readings(&self, cause: usize) -> DMatrix<f64> {
        let (explained, freedom) = (self.explained, self.freedoms[cause].freedom);
        let functions = &explained.profiles.functions;
        let mut with = DMatrix::zeros(explained.residual.len(), functions.nrows());
        for (function, place, deviation) in self.followed(cause).filter(|(.., deviation)| *deviation > 0.0) {
            with.ger(deviation * deviation, &explained.profiled.column(place), &functions.column(function), 1.0);
        }
        if freedom > 0.0 {
            for (row, range) in explained.rows.ranges.iter().enumerate() {
                range.clone().for_each(|i| with[(i, row)] += freedom * freedom * explained.columns[(i, cause)]);
            }
        }
        with
    }

    /// The most probable amplitude of each cause in every row, in units of its scale.
    pub fn amplitudes(&self) -> Vec<Vec<f64>> {
        (0..self.freedoms.len()).map(|m| self.with_readings(m).tr_mul(&self.pull).iter().copied().collect()).collect()
    }

    /// The most probable coefficients of the functions of the rows for each cause, in units of its scale.
    pub fn coefficients(&self) -> Vec<Vec<f64>> {
        let of = |m: usize| {
            let mut all = vec![0.0; self.explained.profiles.of.len()];
            for (function, place, deviation) in self.followed(m) {
                all[function] = deviation * deviation * self.explained.profiled.column(place).dot(&self.pull);
            }
            all
        };
        (0..self.freedoms.len()).map(of).collect()
    }

    /// Variance of the amplitude of one cause in every row, in units of its scale squared.
    pub fn variances(&self, cause: usize) -> Vec<f64> {
        if self.freedoms[cause].freedom == 0.0 {
            return self.variances_of_functions(cause);
        }
        let with = self.with_readings(cause);
        let (prior, taken) = (self.prior(cause), self.solve(&with));
        (0..with.ncols()).map(|row| (prior[(row, row)] - with.column(row).dot(&taken.column(row))).max(0.0)).collect()
    }

    /// The same of an amplitude that follows functions, by the covariance of their coefficients.
    fn variances_of_functions(&self, cause: usize) -> Vec<f64> {
        let explained = self.explained;
        let acting: Vec<(usize, usize, f64)> = self.followed(cause).filter(|(.., deviation)| *deviation > 0.0).collect();
        if acting.is_empty() {
            return vec![0.0; explained.profiles.functions.nrows()];
        }
        let scaled = |(_, place, deviation): &(usize, usize, f64)| explained.profiled.column(*place) * *deviation;
        let columns = DMatrix::from_columns(&acting.iter().map(scaled).collect::<Vec<_>>());
        let functions = DMatrix::from_columns(
            &acting.iter().map(|(f, _, deviation)| explained.profiles.functions.column(*f) * *deviation).collect::<Vec<_>>(),
        );
        let known = columns.tr_mul(&self.solve(&columns));
        let left = &functions - &functions * known;
        functions.row_iter().zip(left.row_iter()).map(|(own, left)| own.dot(&left).max(0.0)).collect()
    }

    /// Products of one cause times functions of the rows (rows times functions) under the inverse covariance: with each
    /// other, and with the residual.
    pub fn of_functions(&self, cause: usize, functions: &DMatrix<f64>) -> Functions {
        let explained = self.explained;
        let mut columns = DMatrix::zeros(self.pull.len(), functions.ncols());
        for (row, range) in explained.rows.ranges.iter().enumerate() {
            for (f, size) in functions.row(row).iter().enumerate() {
                range.clone().for_each(|i| columns[(i, f)] = size * explained.columns[(i, cause)]);
            }
        }
        Functions { solved: self.solve(&columns), pulls: columns.tr_mul(&self.pull), columns }
    }

    /// What the readings say of each other.
    pub fn others(&self) -> Others {
        let (explained, rows) = (self.explained, self.explained.rows);
        // The columns of the metric times the inverse of the upper factor of their matrix.
        let mut across = self.metric.transpose();
        solve_lower(self.factor.l_dirty(), &mut across);
        let across = rows.unwhiten(&across.transpose());
        let of = |(row, range): (usize, &std::ops::Range<usize>)| {
            let x = explained.columns.rows_range(range.clone());
            let taken = explained.taken(row, &self.freedoms);
            rows.unwhiten_row(row, DMatrix::identity(range.len(), range.len()) - x * taken * x.transpose())
        };
        let blocks = rows.ranges.iter().enumerate().map(of).collect();
        let pull = rows.unwhiten(&DMatrix::from_columns(std::slice::from_ref(&self.pull))).column(0).into_owned();
        Others { ranges: rows.ranges.clone(), blocks, across, pull }
    }

    /// Logarithm of the density of each row's readings, given all other rows, without the constant of the number of readings.
    pub fn kept_out(&self) -> Vec<f64> {
        let rows = self.explained.rows;
        let inverse = self.factor.inverse();
        let of = |(row, range): (usize, &std::ops::Range<usize>)| {
            let size = range.len();
            let metric = self.metric.rows_range(range.clone());
            let own = DMatrix::identity(size, size);
            let mut block = own - metric * &inverse * metric.transpose();
            if self.freedoms.iter().any(|f| f.freedom > 0.0) {
                let x = self.explained.columns.rows_range(range.clone());
                let taken = self.explained.taken(row, &self.freedoms);
                block -= x * taken * x.transpose();
            }
            let pull = self.pull.rows_range(range.clone());
            match Cholesky::new(block) {
                Some(factor) => {
                    let log = factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
                    -0.5 * pull.dot(&factor.solve(&pull)) + log - rows.log_of_row(row)
                }
                None => f64::NEG_INFINITY,
            }
        };
        rows.ranges.iter().enumerate().map(of).collect()
    }
}

/// Functions of the rows that a cause may follow, beside all that is explained already.
pub struct Functions {
    columns: DMatrix<f64>,
    /// Inverse covariance times these.
    solved: DMatrix<f64>,
    /// Products with the residual under it.
    pulls: DVector<f64>,
}

impl Functions {
    /// Logarithm of the evidence over that without the cause, where it is a sum of some functions with coefficients of these standard
    /// deviations; `None` where rounding leaves no positive matrix.
    pub fn gain(&self, terms: &[(usize, f64)]) -> Option<f64> {
        let product = |i: usize, j: usize| self.columns.column(terms[i].0).dot(&self.solved.column(terms[j].0));
        let own = |i: usize, j: usize| terms[i].1 * terms[j].1 * product(i, j) + f64::from(u8::from(i == j));
        let factor = Cholesky::new(DMatrix::from_fn(terms.len(), terms.len(), own))?;
        let mut along = DVector::from_iterator(terms.len(), terms.iter().map(|(f, deviation)| deviation * self.pulls[*f]));
        factor.l_dirty().solve_lower_triangular_mut(&mut along);
        let log_of_root: f64 = factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
        Some(0.5 * along.norm_squared() - log_of_root)
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
            row_of,
            log: None,
            aside: Vec::new(),
        };
        (errors, wave(8), vec![wave(9), wave(10)])
    }

    /// The covariance of everything, written out, with the prior covariance of each cause's amplitudes.
    fn dense(errors: &Errors, columns: &[Vec<f64>], priors: &[DMatrix<f64>], loose: (f64, f64)) -> DMatrix<f64> {
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
        errors.stated.iter().for_each(|c| add(c, 1.0, false));
        errors.numbers.iter().for_each(|c| add(c, loose.0 * loose.0, false));
        errors.heats.iter().for_each(|c| add(c, loose.1 * loose.1, true));
        (0..n).for_each(|i| all[(i, i)] += errors.noise[i].powi(2));
        for (column, prior) in columns.iter().zip(priors) {
            all += DMatrix::from_fn(n, n, |i, j| column[i] * column[j] * prior[(errors.row_of[i], errors.row_of[j])]);
        }
        all
    }

    #[test]
    fn evidence_amplitudes_and_kept_out_rows_are_those_of_the_covariance_written_out() {
        let (errors, residual, columns) = case();
        let loose = (0.3, 0.2);
        let looseness = Looseness { spread: loose.0, disturbance: loose.1, wandering: 0.0 };
        let slopes: Vec<Slope> = columns.iter().cloned().map(Slope::OfRow).collect();
        let rows = Rows::new(&errors, loose.1).unwrap();
        let profiles = Profiles::smooth(3, &[vec![0.0, 1.0, 3.0]]);
        let explained = Explained::new(&rows, &profiles, &residual, &slopes, &[profiles.all(), profiles.all()]);
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
            let full = dense(&errors, &columns, &freedoms.map(|f| prior(&f)), loose);
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
            let beside = explained.posterior(&without, looseness).unwrap();
            let terms: Vec<(usize, f64)> = (0..profiles.of.len()).map(|f| (f, freedoms[1].of(profiles.of[f]))).collect();
            if freedoms[1].freedom == 0.0 {
                let gain = beside.of_functions(1, &profiles.functions).gain(&terms).unwrap();
                let expected = found - explained.log_evidence(&without, looseness).unwrap();
                assert!((gain - expected).abs() < 1e-9, "{gain} {expected}");
            }

            for (row, density) in posterior.kept_out().into_iter().enumerate() {
                let own: Vec<usize> = (0..8).filter(|i| errors.row_of[*i] == row).collect();
                let block = DMatrix::from_fn(own.len(), own.len(), |i, j| inverse[(own[i], own[j])]);
                let pull = &inverse * &r;
                let pull = DVector::from_fn(own.len(), |i, _| pull[own[i]]);
                let expected = -0.5 * (pull.transpose() * block.clone().try_inverse().unwrap() * &pull)[0] + 0.5 * block.determinant().ln();
                assert!((density - expected).abs() < 1e-9, "{density} {expected}");
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
            let more = [(0.3, 0.1), (-0.2, 0.4), (0.0, 0.2)];
            let others = error + DVector::from_iterator(3, more.map(|(residual, _)| residual));
            let wider = block + DMatrix::from_diagonal(&DVector::from_iterator(3, more.map(|(_, variance)| variance)));
            assert!((found.log_density_with(&more).unwrap() - of(&others, &wider)).abs() < 1e-9);
        }
    }
}
