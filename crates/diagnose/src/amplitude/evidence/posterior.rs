//! The posterior of a set of causes under one choice of freedoms: amplitudes, their variances, and rows that are kept out.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::super::others::Others;
use super::super::rows::Looseness;
use super::{Explained, Freedom};
use crate::triangular::{cholesky, product_of_transpose, solve_lower};

/// The posterior under one choice of freedoms.
pub struct Posterior<'a> {
    explained: &'a Explained<'a>,
    freedoms: Vec<Freedom>,
    /// Shared columns and mean amplitudes under the metric of the rows, each for one standard deviation.
    metric: DMatrix<f64>,
    factor: Cholesky<f64, Dyn>,
    /// Inverse covariance times the residual.
    pull: DVector<f64>,
    /// Standard deviation of the coefficient of each shared and profiled column.
    deviations: DVector<f64>,
}

/// Coefficients of the causes of a log.
pub(super) struct Coefficients {
    /// Coefficients that may be other than nothing, by their place and prior deviation.
    pub acting: Vec<(usize, f64)>,
    /// Factor of their inverse covariance in units of these deviations.
    pub factor: Cholesky<f64, Dyn>,
}

/// Coefficients as all rows but one have them.
pub struct WithoutRow {
    /// Coefficients of the functions of the rows for each cause, in units of its scale.
    pub coefficients: Vec<Vec<f64>>,
    /// Coefficients of the shared columns that were asked for, in standard deviations.
    pub shared: Vec<f64>,
}

impl<'a> Explained<'a> {
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
        let mut matrix = product_of_transpose(&columns, &metric);
        (0..matrix.nrows()).for_each(|k| matrix[(k, k)] += 1.0);
        let factor = cholesky(matrix)?;
        let mut found = Posterior {
            pull: DVector::zeros(self.residual.len()),
            explained: self,
            freedoms: freedoms.to_vec(),
            metric,
            factor,
            deviations,
        };
        found.pull = found.solve(&DMatrix::from_columns(std::slice::from_ref(&self.residual))).column(0).into_owned();
        Some(found)
    }

    /// The most probable amplitude of each cause in every row, in units of its scale; of a log the coefficients of its functions of the rows. `None`
    /// as in [`Explained::log_evidence`].
    pub fn most_probable(&self, freedoms: &[Freedom], looseness: Looseness) -> Option<Vec<Vec<f64>>> {
        if !self.rows.is_log() {
            return Some(self.posterior(freedoms, looseness)?.amplitudes());
        }
        let reduced = self.reduced(looseness)?;
        let last = self.profiled.ncols();
        let Coefficients { acting, factor } = self.coefficients(&reduced.products, freedoms)?;
        let found = factor.solve(&DVector::from_fn(acting.len(), |i, _| acting[i].1 * reduced.products[(acting[i].0, last)]));
        let mut all = vec![vec![0.0; self.profiles.of.len()]; self.count()];
        for ((place, deviation), coefficient) in acting.iter().zip(found.iter()) {
            let (m, function) = self.followed[*place];
            all[m][function] = deviation * coefficient;
        }
        Some(all)
    }

    /// Coefficients of the causes of a log, from the products of profiled causes without what shared columns take; `None` where rounding leaves no
    /// positive matrix.
    pub(super) fn coefficients(&self, products: &DMatrix<f64>, freedoms: &[Freedom]) -> Option<Coefficients> {
        let acting: Vec<(usize, f64)> = self.of_causes(freedoms).enumerate().filter(|(_, d)| *d > 0.0).collect();
        let entry = |i: usize, j: usize| acting[i].1 * acting[j].1 * products[(acting[i].0, acting[j].0)] + f64::from(u8::from(i == j));
        let factor = cholesky(DMatrix::from_fn(acting.len(), acting.len(), entry))?;
        Some(Coefficients { acting, factor })
    }

    /// Variances as of [`Posterior::variances`]; `None` as in [`Explained::log_evidence`].
    pub fn variances(&self, freedoms: &[Freedom], looseness: Looseness, cause: usize) -> Option<Vec<f64>> {
        if !self.rows.is_log() {
            return Some(self.posterior(freedoms, looseness)?.variances(cause));
        }
        let Coefficients { acting, factor } = self.coefficients(&self.reduced(looseness)?.products, freedoms)?;
        let functions = &self.profiles.functions;
        let mut courses = DMatrix::zeros(acting.len(), functions.nrows());
        for (mut course, (place, deviation)) in courses.row_iter_mut().zip(&acting) {
            let (m, function) = self.followed[*place];
            if m == cause {
                course.tr_copy_from(&(functions.column(function) * *deviation));
            }
        }
        solve_lower(factor.l_dirty(), &mut courses);
        Some(courses.column_iter().map(|column| column.norm_squared()).collect())
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

    /// Variance of the amplitude of one cause in every row, in units of its scale squared.
    pub fn variances(&self, cause: usize) -> Vec<f64> {
        if self.freedoms[cause].freedom == 0.0 {
            return self.variances_of_functions(cause);
        }
        let with = self.with_readings(cause);
        let (prior, taken) = (self.prior(cause), self.solve(&with));
        (0..with.ncols()).map(|row| (prior[(row, row)] - with.column(row).dot(&taken.column(row))).max(0.0)).collect()
    }

    /// Variances of an amplitude that follows functions, by the covariance of their coefficients.
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

    /// Predictions of some readings from all others; in logs of one at a time.
    pub fn others(&self) -> Others {
        let (explained, rows) = (self.explained, &self.explained.rows);
        // The columns of the metric times the inverse of the upper factor of their matrix.
        let mut across = self.metric.transpose();
        solve_lower(self.factor.l_dirty(), &mut across);
        let across = rows.unwhiten(&across.transpose());
        let (ranges, blocks) = rows.precisions(|row| {
            let x = explained.columns.rows_range(rows.ranges[row].clone());
            x * explained.taken(row, &self.freedoms) * x.transpose()
        });
        let pull = rows.unwhiten(&DMatrix::from_columns(std::slice::from_ref(&self.pull))).column(0).into_owned();
        Others { ranges, blocks, across, pull }
    }

    /// Factor of the block of one row of the inverse covariance; `inverse` is that of the factor of the metric.
    fn block(&self, row: usize, inverse: &DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
        let range = self.explained.rows.ranges[row].clone();
        let metric = self.metric.rows_range(range.clone());
        let own = DMatrix::identity(range.len(), range.len());
        let mut block = own - metric * inverse * metric.transpose();
        if self.freedoms.iter().any(|f| f.freedom > 0.0) {
            let x = self.explained.columns.rows_range(range);
            let taken = self.explained.taken(row, &self.freedoms);
            block -= x * taken * x.transpose();
        }
        Cholesky::new(block)
    }

    /// For each row, the coefficients of the causes and of some shared columns as all other rows have them; `None` where rounding leaves no
    /// positive matrix. The inverse covariance of the others times their residual is S⁻¹ r - S⁻¹_·B (S⁻¹_BB)⁻¹ (S⁻¹ r)_B.
    pub fn without_each_row(&self, shared: &[usize]) -> Option<Vec<WithoutRow>> {
        let explained = self.explained;
        let (functions, places) = (explained.profiles.of.len(), explained.rows.shared.ncols());
        let of_causes = explained.profiled.column_iter().zip(self.deviations.iter().skip(places)).map(|(c, d)| c * (d * d));
        let of_shared = shared.iter().map(|k| explained.rows.shared.column(*k) * self.deviations[*k]);
        let columns: Vec<DVector<f64>> = of_causes.chain(of_shared).collect();
        let columns = if columns.is_empty() { DMatrix::zeros(self.pull.len(), 0) } else { DMatrix::from_columns(&columns) };
        let (solved, whole, inverse) = (self.solve(&columns), columns.tr_mul(&self.pull), self.factor.inverse());
        let of = |(row, range): (usize, &std::ops::Range<usize>)| {
            let taken = self.block(row, &inverse)?.solve(&self.pull.rows_range(range.clone()));
            let found = &whole - solved.rows_range(range.clone()).tr_mul(&taken);
            let mut coefficients = vec![vec![0.0; functions]; self.freedoms.len()];
            for ((m, f), c) in explained.followed.iter().zip(found.iter()) {
                coefficients[*m][*f] = *c;
            }
            Some(WithoutRow { coefficients, shared: found.iter().skip(explained.followed.len()).copied().collect() })
        };
        explained.rows.ranges.iter().enumerate().map(of).collect()
    }

    /// Logarithm of the density of each row's readings, given all other rows, without the constant of the number of readings.
    pub fn kept_out(&self) -> Vec<f64> {
        let rows = &self.explained.rows;
        let inverse = self.factor.inverse();
        let of = |(row, range): (usize, &std::ops::Range<usize>)| {
            let pull = self.pull.rows_range(range.clone());
            match self.block(row, &inverse) {
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
