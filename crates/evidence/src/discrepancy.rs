//! Model discrepancy: the error of a model in which nothing is wrong with the machine, and its size as the data show it.
//!
//! No model of a machine is right to the last tenth of a kelvin. The supply, the draught and the room differ from day to day.
//! The covariance of a residual is therefore the stated covariance of the instruments plus a discrepancy. Its size is a
//! [`DiscrepancySize`]: an error of each sensor that wanders with the time, factors between tests, and the spread of the numbers of the
//! machine file. [`ErrorParts::learn`] finds the level by restricted likelihood, under a prior by which each part is most
//! probably zero. On data that the stated noise explains it stays zero. A stated noise that is too small raises it instead of
//! refuting every explanation.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use nalgebra::{DMatrix, DVector};

use crate::measurement::filter::Wandering;
use crate::measurement::whiten::{self, Noise, Whitener};
use crate::measurement::{Data, MeasurementUncertainty, wander};
use coldplate_base::numbers::significant;
use coldplate_base::units::Dimension;
use coldplate_describe::machine::Machine;

/// Standard deviation between tests of the temperatures of the room and the water, K per unit of the factor on all heats (0.1 K
/// per per cent). Chosen; no measurement stands behind it.
const KELVIN_BETWEEN_TESTS: f64 = 10.0;
/// Minus twice the logarithm of the prior odds that a part of the level is not zero, 0.07 to 0.93; dimensionless. Chosen with
/// the days of two heaters on a board in view (docs/record/diagnosis-measured.md).
pub const PRICE: f64 = 5.2;
/// Prior of the wandering error if it is not zero: median, K, and width as a natural logarithm. Chosen with the days of two
/// heaters on a board in view (docs/record/diagnosis-measured.md), as are the three priors below.
const WANDERING: (f64, f64) = (0.1, 1.5);
/// Prior of the factor between tests if it is not zero: median as a share of the heats, and width as a natural logarithm.
const BETWEEN_TESTS: (f64, f64) = (0.02, 0.5);
/// Prior of the spread of the file's numbers if it is not zero: median as a logarithm of a number, and width as a natural
/// logarithm.
const NUMBERS: (f64, f64) = (0.2, 1.0);
/// Prior of the correlation time: median as a share of the test, and width as a natural logarithm.
const MEMORY: (f64, f64) = (0.05, 0.7);
/// Grid of wandering errors that the search tries, K. Chosen: a finer grid costs one factorisation for each value.
const WANDERINGS: [f64; 12] = [0.0, 0.02, 0.04, 0.08, 0.15, 0.25, 0.4, 0.6, 1.0, 1.6, 3.0, 6.0];
/// Grid of correlation times that the search tries, as shares of the test. The end, 12 %, was chosen with the days of two
/// heaters on a board in view (docs/record/diagnosis-measured.md).
const MEMORIES: [f64; 3] = [wander::CORRELATION, 0.05, 0.12];
/// Grid of factors between tests that the search tries, as shares of the heats. The end, 7 %, was chosen with the days of two
/// heaters on a board in view (docs/record/diagnosis-measured.md).
const TESTS: [f64; 7] = [0.0, 0.005, 0.01, 0.02, 0.03, 0.045, 0.07];
/// Grid of spreads of the file's numbers that the search tries, as logarithms. Chosen: a finer grid costs time.
const SPREADS: [f64; 6] = [0.0, 0.03, 0.07, 0.15, 0.3, 0.5];
/// Most readings that the search looks at, count: of more, every n-th of each sensor. Chosen: the time grows with their number.
const MOST_READINGS: usize = 800;
/// Most sweeps of the search over the parts of the level, count. Chosen: a search that has not come to rest by then stops.
const MOST_SWEEPS: usize = 4;
/// Second start of the search: a large wandering error (K) and a small factor between tests, as the likelihood can have two
/// maxima. Chosen.
const OTHER: DiscrepancySize = DiscrepancySize { wandering: 0.6, memory: 0.12, between_tests: 0.02, numbers: 0.15 };
/// Largest discrepancy that models of such machines and days of such laboratories usually have, in logs. Chosen with the days
/// of two heaters on a board in view (docs/record/diagnosis-measured.md).
const USUAL: DiscrepancySize = DiscrepancySize { wandering: 0.08, memory: 0.12, between_tests: 0.07, numbers: 0.15 };
/// Largest discrepancy that is usual in steady tables. Their rows are often tests of their own, so a larger difference from row
/// to row could have any cause. Chosen: a smaller one raises more alarms.
const USUAL_STEADY: DiscrepancySize = DiscrepancySize { between_tests: 0.045, ..USUAL };

/// Size of the discrepancy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscrepancySize {
    /// Standard deviation of an error of each sensor, K. In logs it wanders with the time. In steady tables it is that of two
    /// errors: one new in every reading, and one constant for the sensor.
    pub wandering: f64,
    /// Correlation time of the wandering error over the length of a test.
    pub memory: f64,
    /// Standard deviation between tests of a factor on all heats. The temperatures of the room and the water vary with it, 0.1
    /// K for each per cent.
    pub between_tests: f64,
    /// Standard deviation of the logarithm of each number of the machine file, in logs only. In the few readings of a steady
    /// table such a spread could do whatever a few causes do, and would take their place.
    pub numbers: f64,
}

impl DiscrepancySize {
    /// No discrepancy: the stated errors alone.
    pub const NONE: Self = Self { wandering: 0.0, memory: wander::CORRELATION, between_tests: 0.0, numbers: 0.0 };

    /// Whether the level is no more than models of such machines have, in logs or in steady tables.
    pub fn is_usual(&self, is_log: bool) -> bool {
        self.is_within(Self::usual(is_log))
    }

    fn usual(is_log: bool) -> &'static Self {
        if is_log { &USUAL } else { &USUAL_STEADY }
    }

    fn is_within(&self, most: &Self) -> bool {
        self.wandering <= most.wandering && self.between_tests <= most.between_tests && self.numbers <= most.numbers
    }

    /// The level in words: "0.8 K wandering over 12 % of a test, 7 % from test to test". Empty if the level is zero. In steady
    /// tables nothing wanders.
    pub fn in_words(&self, is_log: bool) -> String {
        let (size, percent) = (significant(self.wandering, 2), |share: f64| significant(100.0 * share, 2));
        let mut parts = Vec::new();
        match (self.wandering > 0.0, is_log) {
            (true, true) => parts.push(format!("{size} K wandering over {} % of a test", percent(self.memory))),
            (true, false) => parts.push(format!("{size} K in every reading and {size} K of every sensor")),
            (false, _) => {}
        }
        if self.between_tests > 0.0 {
            parts.push(format!("{} % from test to test", percent(self.between_tests)));
        }
        if self.numbers > 0.0 {
            parts.push(format!("numbers of the file off by {} %", percent(self.numbers)));
        }
        parts.join(", ")
    }

    /// Minus twice the logarithm of the prior of this level.
    pub fn price(&self) -> f64 {
        let of = |value: f64, (middle, width): (f64, f64)| if value > 0.0 { PRICE + ((value / middle).ln() / width).powi(2) } else { 0.0 };
        let memory = if self.wandering > 0.0 { ((self.memory / MEMORY.0).ln() / MEMORY.1).powi(2) } else { 0.0 };
        of(self.wandering, WANDERING) + of(self.between_tests, BETWEEN_TESTS) + of(self.numbers, NUMBERS) + memory
    }
}

/// Covariance of a residual in parts, from which it is composed at any level and for any selection of readings.
#[derive(Debug, Clone)]
pub struct ErrorParts {
    /// Standard deviation of the noise of each reading, K.
    noise: Vec<f64>,
    /// Wandering errors of the series of a log, K; empty for steady tables.
    wandering: Vec<Wandering>,
    /// Stated errors that several readings share, one column each of unit variance, K.
    stated: Vec<Vec<f64>>,
    /// Indicator of each sensor's readings in steady tables, dimensionless: the direction of the sensor's own part of the
    /// discrepancy.
    sensors: Vec<Vec<f64>>,
    /// Changes of the readings with the factors between tests, K: of all heats, and of every temperature of the surroundings.
    tests: Vec<Vec<f64>>,
    /// Change of the readings with one standard deviation of each number that the machine file calls uncertain, and of each measured
    /// heat, K.
    uncertain: Vec<Vec<f64>>,
    /// Change of the readings with the natural logarithm of each number of the machine file, K.
    numbers: Vec<Vec<f64>>,
}

impl ErrorParts {
    /// Parts of the covariance from the stated errors of the instruments, with those that can be learnt beside them. `model` is
    /// a standard deviation of the model known beforehand, K. `predicted` are the model's readings, K. `slopes` are their
    /// derivatives with respect to the condition variables, K per SI unit.
    pub fn new(
        machine: &Machine,
        data: &Data,
        uncertainty: &MeasurementUncertainty,
        model: f64,
        predicted: &[f64],
        slopes: &[Vec<f64>],
    ) -> Self {
        let wander::LogErrors { clock, wandering } = wander::errors(data, uncertainty, model, predicted);
        let noise = match data.is_transient() {
            true => whiten::noise(data, uncertainty),
            false => whiten::deviations(data, uncertainty).iter().map(|d| d.hypot(model)).collect(),
        };
        let mut stated = whiten::common_errors(data, uncertainty, slopes);
        stated.extend(clock);
        let places = whiten::places(data);
        let own = |k: usize| places.iter().map(|(_, s)| f64::from(u8::from(*s == k))).collect();
        let sensors = if data.is_transient() { Vec::new() } else { (0..data.sensors.len()).map(own).collect() };
        Self {
            noise,
            wandering,
            stated,
            sensors,
            // A single steady test does not show any difference between tests.
            tests: if data.is_transient() || data.tests().len() > 1 { between_tests(machine, data, predicted, slopes) } else { Vec::new() },
            uncertain: Vec::new(),
            numbers: Vec::new(),
        }
    }

    /// Whether the readings are those of a log.
    fn is_log(&self) -> bool {
        !self.wandering.is_empty()
    }

    /// Whether a level is no more than models of such machines have in such data.
    pub fn is_usual(&self, level: &DiscrepancySize) -> bool {
        level.is_usual(self.is_log())
    }

    /// Adds stated errors, one column each of unit variance, K.
    pub fn extend(&mut self, columns: impl IntoIterator<Item = Vec<f64>>) {
        self.stated.extend(columns);
    }

    /// Sets the change of the readings with one standard deviation of each number called uncertain or measured heat, and with the
    /// natural logarithm of each number of the file, K.
    pub fn with_numbers(&mut self, uncertain: Vec<Vec<f64>>, numbers: Vec<Vec<f64>>) {
        (self.uncertain, self.numbers) = (uncertain, numbers);
    }

    /// Standard deviation of the independent noise of each reading, K.
    pub fn noise(&self) -> &[f64] {
        &self.noise
    }

    /// Errors of unit variance that readings share, those of numbers called uncertain among them, one column each, K.
    pub fn shared(&self) -> Vec<Vec<f64>> {
        self.stated.iter().chain(&self.uncertain).cloned().collect()
    }

    /// Change of each reading with one standard deviation of each number called uncertain, and behind these of each measured heat, K.
    pub fn uncertain(&self) -> &[Vec<f64>] {
        &self.uncertain
    }

    /// Change of each reading with the natural logarithm of each number of the file, K.
    pub fn numbers(&self) -> &[Vec<f64>] {
        &self.numbers
    }

    /// Parts with other independent noise of the readings, K.
    pub fn with_noise(&self, noise: Vec<f64>) -> Self {
        Self { noise, ..self.clone() }
    }

    /// Whitening of some readings at a level.
    pub fn whitener(&self, level: &DiscrepancySize, readings: &[usize]) -> Whitener {
        let part = self.among(readings);
        Whitener::with(part.noise_at(level), &part.columns(level))
    }

    /// Whitening of some readings at a level, with the wandering error taken as new in every reading, and with each reading's
    /// variance larger by the factor `worth`.
    pub fn whitener_apart(&self, level: &DiscrepancySize, readings: &[usize], worth: f64) -> Whitener {
        let part = self.among(readings);
        let deviations: Vec<f64> = part.deviations_apart(level).iter().map(|d| d * worth.sqrt()).collect();
        Whitener::new(&deviations, &part.columns(level))
    }

    /// Errors that readings share at a level, one column each of unit variance, K.
    fn columns(&self, level: &DiscrepancySize) -> Vec<Vec<f64>> {
        let scaled = |(columns, scale): (&Vec<Vec<f64>>, f64)| -> Vec<Vec<f64>> {
            columns.iter().map(|c| c.iter().map(|v| scale * v).collect()).collect()
        };
        self.common(level).into_iter().filter(|(_, scale)| *scale > 0.0).flat_map(scaled).collect()
    }

    /// Errors that readings share, with the standard deviation of each column at a level.
    fn common(&self, level: &DiscrepancySize) -> [(&Vec<Vec<f64>>, f64); 5] {
        [
            (&self.stated, 1.0),
            (&self.uncertain, 1.0),
            (&self.sensors, level.wandering),
            (&self.tests, level.between_tests),
            (&self.numbers, level.numbers),
        ]
    }

    /// Covariance of all readings at a level times a vector of one entry per reading, K² times the unit of the vector.
    pub fn times(&self, level: &DiscrepancySize, vector: &[f64]) -> Vec<f64> {
        let mut product = self.times_apart(level, vector);
        for (columns, scale) in self.common(level) {
            for column in columns {
                let along: f64 = scale * scale * column.iter().zip(vector).map(|(c, v)| c * v).sum::<f64>();
                product.iter_mut().zip(column).for_each(|(p, c)| *p += along * c);
            }
        }
        product
    }

    /// Covariance of the noise and of the wandering errors alone at a level, without errors that readings share otherwise,
    /// times a vector of one entry per reading; K² times the unit of the vector.
    pub fn times_apart(&self, level: &DiscrepancySize, vector: &[f64]) -> Vec<f64> {
        let own = if self.wandering.is_empty() { level.wandering } else { 0.0 };
        let mut product: Vec<f64> = vector.iter().zip(&self.noise).map(|(v, n)| v * (n * n + own * own)).collect();
        let memory = if level.wandering > 0.0 { level.memory } else { wander::CORRELATION };
        self.wandering.iter().for_each(|series| series.add_product(level.wandering, memory, vector, &mut product));
        product
    }

    /// Standard deviation of each reading at a level, K.
    pub fn marginal(&self, level: &DiscrepancySize) -> Vec<f64> {
        let mut squares: Vec<f64> = self.deviations_apart(level).iter().map(|d| d * d).collect();
        for (columns, scale) in self.common(level) {
            columns.iter().for_each(|c| squares.iter_mut().zip(c).for_each(|(s, v)| *s += (scale * v).powi(2)));
        }
        squares.into_iter().map(f64::sqrt).collect()
    }

    /// Standard deviation of each reading at a level by noise and wandering errors alone, without errors that readings share
    /// otherwise, K.
    pub fn deviations_apart(&self, level: &DiscrepancySize) -> Vec<f64> {
        let mut squares: Vec<f64> = self.noise.iter().map(|n| n * n).collect();
        if self.wandering.is_empty() {
            squares.iter_mut().for_each(|s| *s += level.wandering.powi(2));
        }
        for series in &self.wandering {
            let of = |(i, d): (&usize, &f64)| (*i, d * d + level.wandering.powi(2));
            series.readings.iter().zip(&series.deviations).map(of).for_each(|(i, v)| squares[i] += v);
        }
        squares.into_iter().map(f64::sqrt).collect()
    }

    fn among(&self, readings: &[usize]) -> Self {
        if readings.len() == self.noise.len() && readings.iter().enumerate().all(|(k, i)| k == *i) {
            return self.clone();
        }
        let mut position = vec![None; self.noise.len()];
        readings.iter().enumerate().for_each(|(k, i)| position[*i] = Some(k));
        let pick = |v: &Vec<f64>| readings.iter().map(|i| v[*i]).collect::<Vec<f64>>();
        let all = |columns: &Vec<Vec<f64>>| columns.iter().map(pick).collect();
        Self {
            noise: pick(&self.noise),
            wandering: self.wandering.iter().map(|s| s.among(&position)).collect(),
            stated: all(&self.stated),
            sensors: all(&self.sensors),
            tests: all(&self.tests),
            uncertain: all(&self.uncertain),
            numbers: all(&self.numbers),
        }
    }

    /// Noise and wandering errors at a level, without errors that readings share otherwise.
    pub fn noise_at(&self, level: &DiscrepancySize) -> Noise {
        if self.wandering.is_empty() {
            let independent: Vec<f64> = self.noise.iter().map(|n| n.hypot(level.wandering)).collect();
            return Noise::independent(&independent);
        }
        if level.wandering == 0.0 {
            return Noise::wandering(&self.noise, &self.wandering, wander::CORRELATION);
        }
        let wider = |s: &Wandering| Wandering { deviations: s.deviations.iter().map(|d| d.hypot(level.wandering)).collect(), ..s.clone() };
        Noise::wandering(&self.noise, &self.wandering.iter().map(wider).collect::<Vec<_>>(), level.memory)
    }

    /// Most probable level of a residual (K, one entry per reading), searched from a first guess. `free` are columns (K, each
    /// of unit prior variance) that may act in the residual. With `most` no part of the level is larger than there.
    pub fn learn(&self, residual: &[f64], free: &[Vec<f64>], from: DiscrepancySize, most: Option<&DiscrepancySize>) -> DiscrepancySize {
        let thin = self.every(residual.len().div_ceil(MOST_READINGS).max(1));
        let part = self.among(&thin);
        let pick = |v: &[f64]| thin.iter().map(|i| v[*i]).collect::<Vec<f64>>();
        let free: Vec<Vec<f64>> = free.iter().map(|c| pick(c)).collect();
        let residual = pick(residual);
        let mut known: Vec<((u64, u64), Products)> = Vec::new();
        let mut cost = |level: &DiscrepancySize| -> f64 {
            let key = (level.wandering.to_bits(), if level.wandering > 0.0 { level.memory.to_bits() } else { 0 });
            let at = known.iter().position(|(k, _)| *k == key).unwrap_or_else(|| {
                known.push((key, part.products(level, &residual, &free)));
                known.len() - 1
            });
            known[at].1.cost(level, [part.sensors.len(), part.tests.len(), part.numbers.len()]) + level.price()
        };
        let allowed = |level: &DiscrepancySize| most.is_none_or(|most| level.is_within(most));
        let mut descend = |from: DiscrepancySize| -> (DiscrepancySize, f64) {
            let mut best = (from, cost(&from));
            for _ in 0..MOST_SWEEPS {
                let begun = best.0;
                for along in [Self::along_factors, Self::along_wandering] {
                    for level in along(&part, &best.0).into_iter().filter(allowed) {
                        let c = cost(&level);
                        if c < best.1 - 1e-6 {
                            best = (level, c);
                        }
                    }
                }
                if best.0 == begun {
                    break;
                }
            }
            best
        };
        // The likelihood can have two maxima: large wandering with little between tests, or the other way round.
        let other = if self.wandering.is_empty() { DiscrepancySize { numbers: 0.0, ..OTHER } } else { OTHER };
        [from, other].into_iter().filter(allowed).map(&mut descend).min_by(|a, b| a.1.total_cmp(&b.1)).map_or(from, |best| best.0)
    }

    /// Every `stride`-th reading of each sensor, in each test of logs.
    fn every(&self, stride: usize) -> Vec<usize> {
        let own = |column: &Vec<f64>| (0..column.len()).filter(|i| column[*i] > 0.0).collect::<Vec<usize>>();
        let series: Vec<Vec<usize>> = match self.wandering.as_slice() {
            [] => self.sensors.iter().map(own).collect(),
            wandering => wandering.iter().map(|s| s.readings.clone()).collect(),
        };
        let mut chosen: Vec<usize> = series.iter().flat_map(|s| s.iter().step_by(stride).copied()).collect();
        chosen.sort_unstable();
        chosen
    }

    fn along_factors(&self, at: &DiscrepancySize) -> Vec<DiscrepancySize> {
        let tests = if self.tests.is_empty() { &TESTS[..1] } else { &TESTS };
        let is_steady = self.wandering.is_empty();
        let numbers = if self.numbers.is_empty() || is_steady { &SPREADS[..1] } else { &SPREADS };
        let of = |n: &f64| tests.iter().map(|t| DiscrepancySize { between_tests: *t, numbers: *n, ..*at }).collect::<Vec<_>>();
        numbers.iter().flat_map(of).collect()
    }

    fn along_wandering(&self, at: &DiscrepancySize) -> Vec<DiscrepancySize> {
        let memories = |wandering: f64| if self.wandering.is_empty() || wandering == 0.0 { &MEMORIES[..1] } else { &MEMORIES };
        let of = |wandering: &f64| {
            memories(*wandering).iter().map(|m| DiscrepancySize { wandering: *wandering, memory: *m, ..*at }).collect::<Vec<_>>()
        };
        WANDERINGS.iter().flat_map(of).collect()
    }

    fn products(&self, level: &DiscrepancySize, residual: &[f64], free: &[Vec<f64>]) -> Products {
        let noise = self.noise_at(level);
        let columns = self.stated.iter().chain(&self.uncertain).chain(free).chain(&self.sensors).chain(&self.tests).chain(&self.numbers);
        let columns: Vec<DVector<f64>> = columns.map(|c| DVector::from_vec(noise.apply(c))).collect();
        let residual = DVector::from_vec(noise.apply(residual));
        let v = if columns.is_empty() { DMatrix::zeros(residual.len(), 0) } else { DMatrix::from_columns(&columns) };
        Products {
            gram: v.transpose() * &v,
            along: v.tr_mul(&residual),
            square: residual.norm_squared(),
            log_determinant: noise.log_determinant(),
        }
    }
}

/// Scalar products by which the likelihood is computed, from readings that are whitened for all but their common errors.
struct Products {
    gram: DMatrix<f64>,
    along: DVector<f64>,
    square: f64,
    log_determinant: f64,
}

impl Products {
    /// Minus twice the logarithm of the likelihood. Columns of unit variance come first, then those of the level's parts.
    fn cost(&self, level: &DiscrepancySize, [sensors, tests, numbers]: [usize; 3]) -> f64 {
        let mut scale = vec![1.0; self.gram.nrows() - sensors - tests - numbers];
        scale.extend(vec![level.wandering; sensors]);
        scale.extend(vec![level.between_tests; tests]);
        scale.extend(vec![level.numbers; numbers]);
        let on: Vec<usize> = (0..scale.len()).filter(|k| scale[*k] > 0.0).collect();
        let at = |i: usize, j: usize| scale[on[i]] * scale[on[j]] * self.gram[(on[i], on[j])] + f64::from(u8::from(i == j));
        let right = Mat::from_fn(on.len(), 1, |i, _| scale[on[i]] * self.along[on[i]]);
        let Ok(factor) = Mat::from_fn(on.len(), on.len(), at).llt(Side::Lower) else { return f64::INFINITY };
        let determinant: f64 = (0..on.len()).map(|k| 2.0 * factor.L()[(k, k)].ln()).sum();
        let taken = (right.transpose() * factor.solve(&right))[(0, 0)];
        self.square - taken + self.log_determinant + determinant
    }
}

/// Columns of the change of the readings with a factor on all heats, and with each temperature of the surroundings, in each
/// test, K.
///
/// The heats cause the part of a temperature that the surroundings do not cause: the prediction less the share of each
/// temperature among the conditions (by its slope), and less the rest of the state that a log began with.
fn between_tests(machine: &Machine, data: &Data, predicted: &[f64], slopes: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let places = whiten::places(data);
    let warm: Vec<usize> = (0..machine.variables.len()).filter(|v| machine.variables[*v].dimension == Dimension::TEMPERATURE).collect();
    let slope = |i: usize, v: usize| slopes[i].get(v).copied().unwrap_or(0.0);
    let mut found = Vec::new();
    for test in data.tests() {
        let of_test: Vec<usize> = (0..places.len()).filter(|i| data.rows[places[*i].0].test == test).collect();
        let mut heats = vec![0.0; places.len()];
        for i in &of_test {
            let (row, sensor) = places[*i];
            let outside: f64 = warm.iter().map(|v| slope(*i, *v) * data.rows[row].condition.si()[*v]).sum();
            let share: f64 = warm.iter().map(|v| slope(*i, *v)).sum();
            let first = of_test.iter().find(|j| places[**j].1 == sensor).map_or(0.0, |j| predicted[*j]);
            // A steady table has no initial state left, except the temperatures of walls that the file states.
            heats[*i] = predicted[*i] - outside - (1.0 - share) * if data.is_transient() { first } else { outside_mean(&warm, data, row) };
        }
        found.push(heats);
        for v in &warm {
            let mut column = vec![0.0; places.len()];
            of_test.iter().for_each(|i| column[*i] = KELVIN_BETWEEN_TESTS * slope(*i, *v));
            found.push(column);
        }
    }
    found.retain(|c| c.iter().any(|v| v.abs() > 0.0));
    found
}

/// Mean of the temperatures among the conditions of a row, K.
fn outside_mean(warm: &[usize], data: &Data, row: usize) -> f64 {
    let values: Vec<f64> = warm.iter().map(|v| data.rows[row].condition.si()[*v]).collect();
    if values.is_empty() {
        data.rows[row].readings.iter().flatten().copied().fold(f64::INFINITY, f64::min)
    } else {
        values.iter().sum::<f64>() / values.len() as f64
    }
}
