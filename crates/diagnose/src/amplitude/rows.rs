//! The covariance of a table's readings without any cause, row by row.
//!
//! Readings of one row share errors that no other row has: those of the condition, as stated and further ones, and the disturbance, a heat in
//! every part that is new in every row. All rows share biases of sensors and numbers of the machine. The covariance is D + U V Uᵀ with D in one block per row and few
//! columns U, so that nothing larger than a row or a column is ever factored.
//!
//! In logs a "row" is what is kept out as a whole: a test, or a stretch of time. D is that of the noise and of an error of each sensor that
//! wanders with the time, which a filter whitens reading by reading; the disturbance wanders with the time too, and joins the columns U.

use coldplate_base::numbers::significant;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SymmetricEigen};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use crate::triangular::{cholesky, eigen, product, product_of_transpose, products, solve_lower};
use coldplate_evidence::discrepancy::{DiscrepancySize, ErrorParts};
use coldplate_evidence::measurement::whiten::Noise;

/// Numbers that stretches of one machine may take, under all loosenesses that are kept: 256 MB.
const KEPT_NUMBERS: usize = 32 << 20;
/// Shared columns eliminated under as many loosenesses are kept. Chosen: those of a search by steps from two places.
const ELIMINATED: usize = 32;
/// Least and most loosenesses under which stretches are kept: those next to one of them, and all pairs of wandering and noise that are tried.
const KEPT: (usize, usize) = (6, 24);

/// A small store of what was asked for last.
#[derive(Debug)]
pub struct Recent<T> {
    most: usize,
    all: Mutex<Vec<Arc<T>>>,
}

impl<T> Recent<T> {
    /// A store of as many as this at most.
    pub fn of(most: usize) -> Self {
        Self { most, all: Mutex::default() }
    }

    /// The one that is asked for, made if it is not known; `None` where it cannot be made. The one that was asked for longest ago is forgotten
    /// where they are too many.
    pub fn get(&self, is_asked: impl Fn(&T) -> bool, make: impl FnOnce() -> Option<T>) -> Option<Arc<T>> {
        let find = |all: &mut Vec<Arc<T>>| {
            let place = all.iter().position(|own| is_asked(own))?;
            all[place..].rotate_left(1);
            all.last().cloned()
        };
        let locked = || self.all.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = find(&mut locked()) {
            return Some(found);
        }
        let made = Arc::new(make()?);
        // Another thread may have made it meanwhile.
        let mut all = locked();
        if let Some(found) = find(&mut all) {
            return Some(found);
        }
        if all.len() >= self.most {
            all.remove(0);
        }
        all.push(made.clone());
        Some(made)
    }

    /// Forgets all.
    pub fn clear(&self) {
        self.all.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }
}

/// Errors of the readings of a table, K.
#[derive(Debug, Clone)]
pub struct Errors {
    /// Row of every reading, rising.
    pub row_of: Vec<usize>,
    /// Standard deviation of the noise of every reading, K.
    pub noise: Vec<f64>,
    /// Errors of unit variance that readings share, one column each, K: first the bias of each sensor.
    pub stated: Vec<Vec<f64>>,
    /// How many of them are biases.
    pub biases: usize,
    /// Places among these of numbers called uncertain and, behind them, of heats that are columns of the data.
    pub uncertain: Range<usize>,
    /// Change of every reading with the logarithm of each number of the machine, K.
    pub numbers: Vec<Vec<f64>>,
    /// Change of every reading with the disturbance of size one, K, which is another in every row: with a heat in each part as large as the
    /// machine's mean heat. In logs also of each stretch of time.
    pub heats: Vec<Vec<f64>>,
    /// Change of every reading with the level of all heats, K, by one times these heats: one column that counts anew in every row of a table, and
    /// in logs one for each test.
    pub levels: Vec<Vec<f64>>,
    /// Change of every reading with what is stated of the error of each condition, K: which counts anew in every row of a table, and in logs one
    /// for each test.
    pub conditions: Vec<Vec<f64>>,
    /// Change of the readings of one row with what it states of a condition, K, by so much as a value that may be anywhere is off: of each
    /// value that is grossly wrong.
    pub wrong_conditions: Vec<Vec<f64>>,
    /// In logs, what the readings are whitened by in place of `noise`.
    pub log: Option<LogNoise>,
    /// Readings that are grossly wrong, rising: their noise is wide, and their residual says nothing.
    pub aside: Vec<usize>,
    /// Standard deviation of their noise, K.
    pub wide: f64,
}

/// Noise of logs, with an error of each sensor that wanders with the time.
#[derive(Debug, Clone)]
pub struct LogNoise {
    /// The covariance in parts, of which noise and wandering errors count here.
    pub parts: ErrorParts,
    /// Time over which the errors wander, as a share of the test.
    pub memory: f64,
    /// Stretches under the loosenesses that were asked for last.
    known: Arc<Recent<Rows>>,
    /// Stretches with readings set aside, likewise.
    cleared: Arc<Recent<Rows>>,
}

impl LogNoise {
    /// For so many readings and shared columns: they decide how many stretches are kept.
    pub fn new(parts: ErrorParts, memory: f64, [readings, columns]: [usize; 2]) -> Self {
        let numbers = columns * (readings + columns);
        let most = (KEPT_NUMBERS / numbers.max(1)).clamp(KEPT.0, KEPT.1);
        Self { parts, memory, known: Arc::new(Recent::of(most)), cleared: Arc::new(Recent::of(most)) }
    }

    /// Forgets all stretches.
    pub fn forget(&self) {
        self.known.clear();
        self.cleared.clear();
    }
}

impl Errors {
    /// Errors of some readings of a table, given by their places, which rise.
    pub fn of_readings(&self, readings: &[usize]) -> Self {
        Self {
            row_of: readings.iter().map(|i| self.row_of[*i]).collect(),
            aside: readings.iter().enumerate().filter(|(_, i)| self.aside.contains(i)).map(|(n, _)| n).collect(),
            ..self.clone().map(|column| readings.iter().map(|i| column[*i]).collect())
        }
    }

    /// Standard deviation of the noise of every reading under a looseness, K. The wide noise of what is set aside stays.
    fn noise_under(&self, looseness: Looseness) -> Vec<f64> {
        let mut all: Vec<f64> = self.noise.iter().map(|noise| noise * looseness.noise).collect();
        self.aside.iter().for_each(|i| all[*i] = self.wide);
        all
    }

    /// Readings that no machine is asked to predict, rising: those set aside, and those of rows that state a wrong condition.
    pub fn unpredicted(&self) -> Vec<usize> {
        let is_wrong = |i: &usize| self.wrong_conditions.iter().any(|column| column[*i] != 0.0) || self.aside.contains(i);
        (0..self.noise.len()).filter(is_wrong).collect()
    }

    /// Errors of a table, each of whose columns becomes another one.
    pub fn map(self, of: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        let all = |columns: &[Vec<f64>]| columns.iter().map(|column| of(column)).collect();
        Self {
            noise: of(&self.noise),
            stated: all(&self.stated),
            numbers: all(&self.numbers),
            heats: all(&self.heats),
            levels: all(&self.levels),
            conditions: all(&self.conditions),
            wrong_conditions: all(&self.wrong_conditions),
            log: None,
            ..self
        }
    }
}

/// What a model leaves open beside its causes, as the data have it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Looseness {
    /// Standard deviation of the logarithm of every number of the machine.
    pub spread: f64,
    /// Standard deviation of a heat in every part, new in every row, as a share of the machine's mean heat. In logs it wanders with the time.
    pub disturbance: f64,
    /// Standard deviation of the level of all heats, new in every row of a table and in every test of a log, as a share of them.
    pub level: f64,
    /// Standard deviation of a further error of each condition, new in every row of a table and in every test of a log, as a multiple of what is
    /// stated.
    pub conditions: f64,
    /// Standard deviation of an error of each sensor of a log that wanders with the time, K, beside what is stated.
    pub wandering: f64,
    /// Noise of readings and biases of sensors as multiples of what is stated.
    pub noise: f64,
}

impl Default for Looseness {
    /// Nothing is left open.
    fn default() -> Self {
        Self { spread: 0.0, disturbance: 0.0, level: 0.0, conditions: 0.0, wandering: 0.0, noise: 1.0 }
    }
}

/// How readings are whitened by what belongs to their own row.
#[derive(Debug)]
enum Whitening {
    /// A factor for each row of a table.
    Blocks(Vec<Cholesky<f64, Dyn>>),
    /// A filter along each series of a log.
    Series(Noise),
}

/// Shared columns eliminated under one looseness.
#[derive(Debug)]
pub struct Eliminated {
    looseness: Looseness,
    /// Columns of the disturbance of a log that act. They are at right angles. Each has the standard deviation of its coefficient once the readings
    /// are known.
    heats: Vec<(usize, f64)>,
    /// Other columns that act, with their standard deviations.
    others: Vec<(usize, f64)>,
    /// Products of the other columns (lines) with those of the disturbance (columns), scaled by the numbers above.
    across: DMatrix<f64>,
    /// Factor of one plus the products of the other columns, less what the disturbance takes from them.
    factor: Cholesky<f64, Dyn>,
    /// Logarithm of the determinant of the whole matrix.
    pub log_determinant: f64,
}

impl Eliminated {
    /// Coordinates C of columns X along the shared ones: with S the covariance of whitened readings, X'S⁻¹X = X'X - C'C. `product(k, j)` is that of
    /// shared column k with column j.
    pub fn along(&self, count: usize, product: impl Fn(usize, usize) -> f64) -> DMatrix<f64> {
        let scaled = |own: &[(usize, f64)]| DMatrix::from_fn(own.len(), count, |i, j| own[i].1 * product(own[i].0, j));
        let (heats, mut others) = (scaled(&self.heats), scaled(&self.others));
        others.gemm(-1.0, &self.across, &heats, 1.0);
        solve_lower(self.factor.l_dirty(), &mut others);
        let mut all = DMatrix::zeros(heats.nrows() + others.nrows(), count);
        all.rows_range_mut(..heats.nrows()).copy_from(&heats);
        all.rows_range_mut(heats.nrows()..).copy_from(&others);
        all
    }
}

impl Looseness {
    /// In words; empty where nothing is left open.
    pub fn in_words(&self) -> String {
        let percent = |share: f64| significant(100.0 * share, 2);
        let numbers = (self.spread > 0.0).then(|| format!("numbers of the machine file off by {} %", percent(self.spread)));
        let heats = (self.disturbance > 0.0)
            .then(|| format!("heats that nothing explains, of {} % of the machine's heat", percent(self.disturbance)));
        let level = (self.level > 0.0).then(|| format!("all heats {} % more or less from test to test", percent(self.level)));
        let times = |factor: f64| significant(factor, 2);
        let conditions =
            (self.conditions > 0.0).then(|| format!("errors of conditions, of {} times what is stated of them", times(self.conditions)));
        let noise = (self.noise != 1.0).then(|| format!("noise and offsets of the sensors {} times as large as stated", times(self.noise)));
        let errors = (self.wandering > 0.0).then(|| format!("errors of the sensors that wander, of {} K", significant(self.wandering, 2)));
        numbers.into_iter().chain(heats).chain(level).chain(conditions).chain(errors).chain(noise).collect::<Vec<_>>().join("; ")
    }
}

/// Readings whitened by what belongs to their own row, with the columns that all rows share.
#[derive(Debug)]
pub struct Rows {
    /// Readings of each row.
    pub ranges: Vec<Range<usize>>,
    /// Sizes in the blocks of a table: disturbance, level of the heats, errors of conditions and noise; in logs, where the first three are among
    /// the shared columns, wandering errors and noise.
    pub own: Looseness,
    whitening: Arc<Whitening>,
    /// Shared columns, whitened: stated ones, then numbers; then of logs the disturbance, the levels of the heats, errors of conditions, and one
    /// for each reading set aside.
    pub shared: DMatrix<f64>,
    /// Place of each of them among [`Errors::stated`] and, behind these, [`Errors::numbers`].
    pub of: Vec<usize>,
    gram: DMatrix<f64>,
    stated: usize,
    numbers: usize,
    heats: usize,
    levels: usize,
    biases: usize,
    /// Readings of a log that are set aside.
    aside: Vec<usize>,
    log_determinant: f64,
    eliminated: Recent<Eliminated>,
}

/// Places of uncertain numbers among the errors that readings share.
pub fn uncertain(errors: &ErrorParts) -> Range<usize> {
    let all = errors.shared().len();
    all - errors.uncertain().len()..all
}

/// Rows of rising row numbers as ranges.
fn ranges(row_of: &[usize]) -> Vec<Range<usize>> {
    let mut all: Vec<Range<usize>> = Vec::new();
    for (i, row) in row_of.iter().enumerate() {
        match all.last_mut() {
            Some(range) if row_of[range.start] == *row => range.end = i + 1,
            _ => all.push(i..i + 1),
        }
    }
    all
}

impl Rows {
    /// The rows of a table or a log under a looseness; `None` as in [`Rows::new`].
    pub fn under(errors: &Errors, looseness: Looseness) -> Option<Arc<Self>> {
        match &errors.log {
            None => Self::new(errors, looseness).map(Arc::new),
            Some(log) => {
                let whole = log.known.get(|rows| rows.is_under(looseness), || Some(Self::wandering(errors, log, looseness)))?;
                if errors.aside.is_empty() {
                    return Some(whole);
                }
                let is_asked = |rows: &Self| rows.is_under(looseness) && rows.aside == errors.aside;
                log.cleared.get(is_asked, || Some(whole.with_aside(errors, looseness)))
            }
        }
    }

    /// Whether rows under one looseness are those under another one: all but the deviations of shared columns is alike.
    pub fn is_under(&self, looseness: Looseness) -> bool {
        self.own == Self::own_part(self.is_log(), looseness)
    }

    /// Whether they are stretches of a log.
    pub fn is_log(&self) -> bool {
        matches!(*self.whitening, Whitening::Series(_))
    }

    fn own_part(is_log: bool, Looseness { disturbance, level, conditions, wandering, noise, .. }: Looseness) -> Looseness {
        match is_log {
            true => Looseness { wandering, noise, ..Looseness::default() },
            false => Looseness { disturbance, level, conditions, noise, ..Looseness::default() },
        }
    }

    /// The rows of a table under a looseness; `None` where a block is not positive, for lack of noise.
    pub fn new(errors: &Errors, looseness: Looseness) -> Option<Self> {
        let ranges = ranges(&errors.row_of);
        // A column that acts in one row alone belongs to that row's block.
        let own_row = |column: &Vec<f64>| -> Option<Option<usize>> {
            let mut acting = column.iter().enumerate().filter(|(_, c)| **c != 0.0).map(|(i, _)| errors.row_of[i]);
            let first = acting.next()?;
            Some(acting.all(|row| row == first).then_some(first))
        };
        let mut shared: Vec<(usize, &Vec<f64>)> = Vec::new();
        let mut local: Vec<(usize, f64, &Vec<f64>)> = Vec::new();
        for (place, column) in errors.stated.iter().enumerate() {
            match own_row(column) {
                Some(Some(row)) => local.push((row, if place < errors.biases { looseness.noise } else { 1.0 }, column)),
                Some(None) => shared.push((place, column)),
                None => {}
            }
        }
        local.extend(errors.wrong_conditions.iter().filter_map(|column| Some((own_row(column)??, 1.0, column))));
        let stated = shared.len();
        let numbers = errors.numbers.iter().enumerate().filter(|(_, column)| own_row(column).is_some());
        shared.extend(numbers.map(|(k, column)| (errors.stated.len() + k, column)));
        let mut factors = Vec::with_capacity(ranges.len());
        let noise = errors.noise_under(looseness);
        for range in &ranges {
            let squares = noise[range.clone()].iter().map(|noise| noise * noise);
            let mut block = DMatrix::from_diagonal(&DVector::from_iterator(range.len(), squares));
            let mut add = |column: &[f64], scale: f64| {
                let own = DVector::from_column_slice(&column[range.clone()]);
                block.ger(scale * scale, &own, &own, 1.0);
            };
            let row = errors.row_of[range.start];
            local.iter().filter(|(own, ..)| *own == row).for_each(|(_, scale, column)| add(column, *scale));
            let of_row =
                [(&errors.heats, looseness.disturbance), (&errors.levels, looseness.level), (&errors.conditions, looseness.conditions)];
            for (columns, size) in of_row {
                columns.iter().filter(|_| size > 0.0).for_each(|column| add(column, size));
            }
            factors.push(Cholesky::new(block)?);
        }
        let log_determinant = factors.iter().map(|f| 2.0 * f.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>()).sum();
        let numbers = shared.len() - stated;
        let mut all = Self::without_columns(ranges, Whitening::Blocks(factors), log_determinant, errors.biases);
        all.own = Self::own_part(false, looseness);
        all.of = shared.iter().map(|(place, _)| *place).collect();
        let whitened: Vec<DVector<f64>> = shared.iter().map(|(_, column)| all.whiten(column)).collect();
        Some(all.with_columns(&whitened, [stated, numbers, 0, 0]))
    }

    /// The stretches of logs under a looseness, nothing of them set aside.
    fn wandering(errors: &Errors, log: &LogNoise, looseness: Looseness) -> Self {
        let level = DiscrepancySize { wandering: looseness.wandering, memory: log.memory, ..DiscrepancySize::NONE };
        let stated = errors.noise.iter().map(|noise| noise * looseness.noise).collect();
        let noise = log.parts.with_noise(stated).noise_at(&level);
        let log_determinant = noise.log_determinant();
        let mut all = Self::without_columns(ranges(&errors.row_of), Whitening::Series(noise), log_determinant, errors.biases);
        all.own = Self::own_part(true, looseness);
        let acts = |(_, column): &(usize, &Vec<f64>)| column.iter().any(|c| *c != 0.0);
        let acting = |columns: &'_ [Vec<f64>]| columns.iter().enumerate().filter(acts).map(|(place, _)| place).collect::<Vec<usize>>();
        let shared = [&errors.stated, &errors.numbers, &errors.heats, &errors.levels, &errors.conditions];
        let places = shared.map(|columns| acting(columns));
        let counts = [0, 1, 2, 3].map(|k| places[k].len());
        let of = |(columns, own): (&Vec<Vec<f64>>, &Vec<usize>)| own.iter().map(|k| all.whiten(&columns[*k])).collect::<Vec<_>>();
        let columns: Vec<DVector<f64>> = shared.into_iter().zip(&places).flat_map(of).collect();
        let [stated, numbers, ..] = places;
        all.of = stated.into_iter().chain(numbers.into_iter().map(|k| errors.stated.len() + k)).collect();
        all.with_columns(&columns, counts)
    }

    fn without_columns(ranges: Vec<Range<usize>>, whitening: Whitening, log_determinant: f64, biases: usize) -> Self {
        Self {
            ranges,
            own: Looseness::default(),
            whitening: Arc::new(whitening),
            shared: DMatrix::zeros(0, 0),
            of: Vec::new(),
            gram: DMatrix::zeros(0, 0),
            stated: 0,
            numbers: 0,
            heats: 0,
            levels: 0,
            biases,
            aside: Vec::new(),
            log_determinant,
            eliminated: Recent::of(ELIMINATED),
        }
    }

    /// Stretches of a log with the readings set aside that its errors name. What their noise is wider by is one column each, so that what is
    /// whitened stays as it is.
    fn with_aside(&self, errors: &Errors, looseness: Looseness) -> Self {
        let (before, count) = (self.shared.ncols(), self.shared.nrows());
        let column = |i: &usize| {
            let mut own = vec![0.0; count];
            own[*i] = (errors.wide.powi(2) - (errors.noise[*i] * looseness.noise).powi(2)).max(0.0).sqrt();
            self.whiten(&own)
        };
        let columns: Vec<DVector<f64>> = errors.aside.iter().map(column).collect();
        let columns = DMatrix::from_columns(&columns);
        let all = before + columns.ncols();
        let mut shared = DMatrix::zeros(count, all);
        shared.columns_range_mut(..before).copy_from(&self.shared);
        shared.columns_range_mut(before..).copy_from(&columns);
        let mut gram = DMatrix::zeros(all, all);
        gram.view_range_mut(..before, ..before).copy_from(&self.gram);
        let across = product_of_transpose(&shared, &columns);
        gram.view_range_mut(.., before..).copy_from(&across);
        gram.view_range_mut(before.., ..).copy_from(&across.transpose());
        Self {
            ranges: self.ranges.clone(),
            whitening: self.whitening.clone(),
            shared,
            of: self.of.clone(),
            gram,
            aside: errors.aside.clone(),
            eliminated: Recent::of(ELIMINATED),
            ..*self
        }
    }

    fn with_columns(self, whitened: &[DVector<f64>], [stated, numbers, heats, levels]: [usize; 4]) -> Self {
        let count = self.ranges.last().map_or(0, |last| last.end);
        let shared = if whitened.is_empty() { DMatrix::zeros(count, 0) } else { DMatrix::from_columns(whitened) };
        let gram = products(&shared);
        let mut all = Self { gram, shared, stated, numbers, heats, levels, ..self };
        if heats > 0 {
            // All columns of the disturbance have the same prior variance, so that turning them leaves the covariance as it is. Here they come to
            // be at right angles.
            let at = all.of_heats();
            let (values, turned) = eigen(all.gram.view((at.start, at.start), (heats, heats)).into_owned());
            let own = product(&all.shared.columns_range(at.clone()).into_owned(), &turned);
            all.shared.columns_range_mut(at.clone()).copy_from(&own);
            for others in [0..at.start, at.end..all.gram.nrows()] {
                let across = product(&all.gram.view_range(others.clone(), at.clone()).into_owned(), &turned);
                all.gram.view_range_mut(others.clone(), at.clone()).copy_from(&across);
                all.gram.view_range_mut(at.clone(), others).copy_from(&across.transpose());
            }
            all.gram.view_range_mut(at.clone(), at).copy_from(&DMatrix::from_diagonal(&values));
        }
        all
    }

    /// Readings (K) whitened by the block of their row.
    pub fn whiten(&self, readings: &[f64]) -> DVector<f64> {
        let factors = match &*self.whitening {
            Whitening::Blocks(factors) => factors,
            Whitening::Series(noise) => return DVector::from_vec(noise.apply(readings)),
        };
        let mut whitened = DVector::from_column_slice(readings);
        for (range, factor) in self.ranges.iter().zip(factors) {
            let mut own = whitened.rows_range_mut(range.clone());
            factor.l_dirty().solve_lower_triangular_mut(&mut own);
        }
        whitened
    }

    /// Scalar products of the shared columns.
    pub fn gram(&self) -> &DMatrix<f64> {
        &self.gram
    }

    /// Logarithm of the determinant of the root of a row's block, K for each reading; in logs of all noise, shared among the stretches.
    pub fn log_of_row(&self, row: usize) -> f64 {
        match &*self.whitening {
            Whitening::Blocks(factors) => factors[row].l_dirty().diagonal().iter().map(|d| d.ln()).sum(),
            Whitening::Series(_) => {
                let count = self.ranges.last().map_or(1, |last| last.end);
                0.5 * self.log_determinant * self.ranges[row].len() as f64 / count as f64
            }
        }
    }

    /// Logarithm of the determinant of all blocks, K² for each reading.
    pub fn log_determinant(&self) -> f64 {
        self.log_determinant
    }

    /// Columns that are whitened, multiplied by the transposed whitening: S⁻¹ of columns is this of their whitened ones.
    pub fn unwhiten(&self, whitened: &DMatrix<f64>) -> DMatrix<f64> {
        let mut found = whitened.clone();
        match &*self.whitening {
            Whitening::Blocks(factors) => {
                for (range, factor) in self.ranges.iter().zip(factors) {
                    let mut own = found.rows_range_mut(range.clone());
                    factor.l_dirty().tr_solve_lower_triangular_mut(&mut own);
                }
            }
            Whitening::Series(noise) => found.column_iter_mut().for_each(|mut column| noise.apply_transposed(column.as_mut_slice())),
        }
        found
    }

    /// Inverse covariance of the readings of each row of a table without shared columns, less by `taken` in each (whitened); of a log that of
    /// each reading by itself. With the readings of each, and in 1/K².
    pub fn precisions(&self, taken: impl Fn(usize) -> DMatrix<f64>) -> (Vec<Range<usize>>, Vec<DMatrix<f64>>) {
        match &*self.whitening {
            Whitening::Blocks(factors) => {
                let of = |(row, factor): (usize, &Cholesky<f64, Dyn>)| {
                    let size = self.ranges[row].len();
                    let mut precision = DMatrix::identity(size, size) - taken(row);
                    factor.l_dirty().tr_solve_lower_triangular_mut(&mut precision);
                    precision.transpose_mut();
                    factor.l_dirty().tr_solve_lower_triangular_mut(&mut precision);
                    precision
                };
                (self.ranges.clone(), factors.iter().enumerate().map(of).collect())
            }
            Whitening::Series(noise) => {
                let own = noise.precisions();
                ((0..own.len()).map(|i| i..i + 1).collect(), own.into_iter().map(|p| DMatrix::from_element(1, 1, p)).collect())
            }
        }
    }

    /// Standard deviation of each shared column's coefficient.
    pub fn deviations(&self, looseness: Looseness) -> DVector<f64> {
        let count = self.shared.ncols();
        DVector::from_fn(count, |k, _| match k {
            k if k >= count - self.aside.len() => 1.0,
            k if k < self.stated => {
                if self.of[k] < self.biases {
                    looseness.noise
                } else {
                    1.0
                }
            }
            k if k < self.stated + self.numbers => looseness.spread,
            k if k < self.stated + self.numbers + self.heats => looseness.disturbance,
            k if k < self.stated + self.numbers + self.heats + self.levels => looseness.level,
            _ => looseness.conditions,
        })
    }

    /// The shared columns eliminated under a looseness; `None` where rounding leaves no positive matrix.
    pub fn eliminated(&self, looseness: Looseness) -> Option<Arc<Eliminated>> {
        self.eliminated.get(|own| own.looseness == looseness, || self.eliminate(looseness))
    }

    fn eliminate(&self, looseness: Looseness) -> Option<Eliminated> {
        let deviations = self.deviations(looseness);
        let acting = deviations.iter().copied().enumerate().filter(|(_, d)| *d > 0.0);
        let (mut heats, others): (Vec<_>, Vec<_>) = acting.partition(|(k, _)| self.of_heats().contains(k));
        let mut log_determinant = 0.0;
        for (k, root) in &mut heats {
            let diagonal = 1.0 + root.powi(2) * self.gram[(*k, *k)];
            log_determinant += diagonal.ln();
            *root /= diagonal.sqrt();
        }
        let product = |a: &(usize, f64), b: &(usize, f64)| a.1 * b.1 * self.gram[(a.0, b.0)];
        let across = DMatrix::from_fn(others.len(), heats.len(), |i, j| product(&others[i], &heats[j]));
        let entry = |i: usize, j: usize| product(&others[i], &others[j]) + f64::from(u8::from(i == j));
        let mut matrix = DMatrix::from_fn(others.len(), others.len(), entry);
        matrix.gemm(-1.0, &across, &across.transpose(), 1.0);
        let factor = cholesky(matrix)?;
        log_determinant += 2.0 * factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        Some(Eliminated { looseness, heats, others, across, factor, log_determinant })
    }

    /// Places of the columns of the disturbance of a log among the shared ones.
    fn of_heats(&self) -> Range<usize> {
        self.stated + self.numbers..self.stated + self.numbers + self.heats
    }

    /// The whole covariance under a looseness.
    pub fn metric(&self, looseness: Looseness) -> Metric<'_> {
        let mut columns = self.shared.clone();
        columns.column_iter_mut().zip(&self.deviations(looseness)).for_each(|(mut column, d)| column *= *d);
        let eigen = SymmetricEigen::new(columns.tr_mul(&columns));
        // The inverse root of I + UU' is I - U Q f(l) Q' U', where U'U = Q l Q'.
        let of = |l: f64| if l > 1e-12 { (1.0 - (1.0 + l).sqrt().recip()) / l } else { 0.5 };
        let mut scaled = eigen.eigenvectors.clone();
        scaled.column_iter_mut().zip(&eigen.eigenvalues).for_each(|(mut column, l)| column *= of(*l));
        Metric { rows: self, root: scaled * eigen.eigenvectors.transpose(), columns }
    }
}

/// The inverse of a covariance, as an inverse root.
pub struct Metric<'a> {
    rows: &'a Rows,
    columns: DMatrix<f64>,
    root: DMatrix<f64>,
}

impl Metric<'_> {
    /// Readings (K) in standard deviations, uncorrelated.
    pub fn whitened(&self, readings: &[f64]) -> DVector<f64> {
        let own = self.rows.whiten(readings);
        let along = &self.root * self.columns.tr_mul(&own);
        own - &self.columns * along
    }

    /// Sum of the squares of readings (K) in standard deviations.
    pub fn square(&self, readings: &[f64]) -> f64 {
        self.whitened(readings).norm_squared()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bias, two numbers, a disturbance of three columns, a level and a condition beside eight readings of a log.
    #[test]
    fn columns_that_are_turned_take_what_they_took() {
        let wave = |k: usize| DVector::from_fn(8, |i, _| ((i * (k + 2) + k) as f64 * 0.7).sin());
        let columns: Vec<DVector<f64>> = (0..8).map(wave).collect();
        let whitening = Whitening::Blocks(vec![Cholesky::new(DMatrix::identity(8, 8)).unwrap()]);
        let plain = Rows { of: vec![0, 1, 2], ..Rows::without_columns(ranges(&[0; 8]), whitening, 0.0, 1) };
        let rows = plain.with_columns(&columns, [1, 2, 3, 1]);
        let looseness = Looseness { spread: 0.3, disturbance: 2.0, level: 0.2, conditions: 0.7, wandering: 0.0, noise: 1.5 };
        let deviations = [1.5, 0.3, 0.3, 2.0, 2.0, 2.0, 0.2, 0.7];
        let taken = columns.iter().zip(deviations).map(|(column, d)| column * column.transpose() * d * d);
        let covariance = taken.fold(DMatrix::identity(8, 8), |sum, own| sum + own);
        let found = rows.eliminated(looseness).unwrap();
        assert!((found.log_determinant - covariance.determinant().ln()).abs() < 1e-9);
        let own = DMatrix::from_columns(&[wave(11), wave(12)]);
        let products = rows.shared.tr_mul(&own);
        let along = found.along(2, |k, j| products[(k, j)]);
        let expected = own.transpose() * covariance.try_inverse().unwrap() * &own;
        assert!((own.tr_mul(&own) - along.tr_mul(&along) - expected).amax() < 1e-9);
        let heats = rows.gram.view((3, 3), (3, 3));
        assert!((heats - DMatrix::from_diagonal(&heats.diagonal())).amax() < 1e-12);
    }
}
