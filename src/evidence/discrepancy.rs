//! How far a model is off where nothing is wrong with it: the discrepancy, and how large the data say it is.
//!
//! No model of a machine is right to the last tenth of a kelvin, and the supply, the draught and the room differ from day to
//! day. The covariance of a residual is therefore what the instruments state, and beside it a discrepancy whose size is a
//! [`Level`]: an error of each sensor that wanders with the time, factors between tests, and the spread of the numbers of the
//! machine file. [`ErrorParts::learn`] finds the level by restricted likelihood under a prior that likes every part of it to be
//! nothing: on data that the stated noise explains it stays nothing, and a stated noise that is too small raises it instead of
//! refuting every explanation.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use nalgebra::{DMatrix, DVector};

use crate::describe::machine::Machine;
use crate::evidence::measurement::filter::Wandering;
use crate::evidence::measurement::whiten::{self, Noise, Whitener};
use crate::evidence::measurement::{Data, Uncertainty, wander};
use crate::foundation::numbers::significant;
use crate::units::Dimension;

/// What the room and the water's temperature may differ by from test to test, K, beside a factor of one on all heats.
const KELVIN_BETWEEN_TESTS: f64 = 10.0;
/// Minus twice the logarithm of the prior odds of a part of the level that is not zero: 0.07 to 0.93.
pub const PRICE: f64 = 5.2;
/// Where the prior of each part has its middle, and its width as a logarithm.
const WANDERING: (f64, f64) = (0.1, 1.5);
const BETWEEN_TESTS: (f64, f64) = (0.02, 0.5);
const NUMBERS: (f64, f64) = (0.2, 1.0);
const MEMORY: (f64, f64) = (0.05, 0.7);
/// Steps of the search.
const WANDERINGS: [f64; 12] = [0.0, 0.02, 0.04, 0.08, 0.15, 0.25, 0.4, 0.6, 1.0, 1.6, 3.0, 6.0];
const MEMORIES: [f64; 3] = [wander::CORRELATION, 0.05, 0.12];
const TESTS: [f64; 7] = [0.0, 0.005, 0.01, 0.02, 0.03, 0.045, 0.07];
const SPREADS: [f64; 6] = [0.0, 0.03, 0.07, 0.15, 0.3, 0.5];
/// Readings that the search looks at: of more, every so many of each sensor.
const MOST_READINGS: usize = 800;
/// Sweeps over the parts of the level.
const MOST_SWEEPS: usize = 4;
/// Where the search begins a second time.
const OTHER: Level = Level { wandering: 0.6, memory: 0.12, between_tests: 0.02, numbers: 0.15 };
/// A level up to here is what models of such machines and days of such laboratories have.
const USUAL: Level = Level { wandering: 0.08, memory: 0.12, between_tests: 0.07, numbers: 0.15 };
/// The same of steady tables. Their rows are often tests of their own: what differs by more from each to the next could be anything.
const USUAL_STEADY: Level = Level { between_tests: 0.045, ..USUAL };

/// How large the discrepancy is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Standard deviation of an error of each sensor, K: in logs it wanders with the time, in steady tables it has a part that is
    /// new in every reading and one that is the sensor's own.
    pub wandering: f64,
    /// Correlation time of it over the length of a test.
    pub memory: f64,
    /// Standard deviation between tests of a factor on all heats; the room and the water go with it, 0.1 K for each per cent.
    pub between_tests: f64,
    /// Standard deviation of the logarithm of each number of the machine file; in logs only: in the few readings of a steady table it could
    /// do whatever a few causes do, and would take their place.
    pub numbers: f64,
}

impl Level {
    /// Nothing beside what is stated.
    pub const NONE: Self = Self { wandering: 0.0, memory: wander::CORRELATION, between_tests: 0.0, numbers: 0.0 };

    /// Whether it is no more than models of such machines have, in logs or in steady tables.
    pub fn is_usual(&self, is_log: bool) -> bool {
        self.is_within(Self::usual(is_log))
    }

    fn usual(is_log: bool) -> &'static Self {
        if is_log { &USUAL } else { &USUAL_STEADY }
    }

    fn is_within(&self, most: &Self) -> bool {
        self.wandering <= most.wandering && self.between_tests <= most.between_tests && self.numbers <= most.numbers
    }

    /// In words: "0.8 K wandering over 12 % of a test, 7 % from test to test"; nothing where it is nothing. In steady readings nothing
    /// wanders.
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

    /// Minus twice the logarithm of its prior.
    pub fn price(&self) -> f64 {
        let of = |value: f64, (middle, width): (f64, f64)| if value > 0.0 { PRICE + ((value / middle).ln() / width).powi(2) } else { 0.0 };
        let memory = if self.wandering > 0.0 { ((self.memory / MEMORY.0).ln() / MEMORY.1).powi(2) } else { 0.0 };
        of(self.wandering, WANDERING) + of(self.between_tests, BETWEEN_TESTS) + of(self.numbers, NUMBERS) + memory
    }
}

/// Covariance of a residual in parts, so that it can be had at any level and cut to some readings.
#[derive(Debug, Clone)]
pub struct ErrorParts {
    /// Standard deviation of the noise of each reading, K.
    noise: Vec<f64>,
    wandering: Vec<Wandering>,
    /// Errors that are stated, one column each of unit variance, K.
    stated: Vec<Vec<f64>>,
    /// A sensor's own part of the discrepancy in steady tables: one where the reading is the sensor's.
    sensors: Vec<Vec<f64>>,
    /// Factors between tests: all heats, and every temperature of the surroundings.
    tests: Vec<Vec<f64>>,
    /// Change of the readings with one standard deviation of each number that is called uncertain, K.
    uncertain: Vec<Vec<f64>>,
    /// Change of the readings with the logarithm of each number of the file, K.
    numbers: Vec<Vec<f64>>,
}

impl ErrorParts {
    /// What the instruments state, and what can be learnt beside; `model` is a standard deviation that is known beforehand, K;
    /// `predicted` are the model's readings, K, and `slopes` their derivatives with respect to the condition variables, K per SI
    /// unit.
    pub fn new(machine: &Machine, data: &Data, uncertainty: &Uncertainty, model: f64, predicted: &[f64], slopes: &[Vec<f64>]) -> Self {
        let wander::Errors { clock, wandering } = wander::errors(data, uncertainty, model, predicted);
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
            // One steady test says nothing of what differs between tests.
            tests: if data.is_transient() || data.tests().len() > 1 { between_tests(machine, data, predicted, slopes) } else { Vec::new() },
            uncertain: Vec::new(),
            numbers: Vec::new(),
        }
    }

    /// Whether they are those of a log.
    fn is_log(&self) -> bool {
        !self.wandering.is_empty()
    }

    /// Whether a level is no more than models of such machines have in such data.
    pub fn is_usual(&self, level: &Level) -> bool {
        level.is_usual(self.is_log())
    }

    /// Adds errors that are stated, one column each of unit variance, K.
    pub fn extend(&mut self, columns: impl IntoIterator<Item = Vec<f64>>) {
        self.stated.extend(columns);
    }

    /// Says what one standard deviation of each number that is called uncertain changes in the readings, and what a unit of the
    /// logarithm of each number of the file does, K.
    pub fn with_numbers(&mut self, uncertain: Vec<Vec<f64>>, numbers: Vec<Vec<f64>>) {
        (self.uncertain, self.numbers) = (uncertain, numbers);
    }

    /// The change of each reading with the logarithm of each number of the file, K.
    pub fn numbers(&self) -> &[Vec<f64>] {
        &self.numbers
    }

    /// The same where no number is uncertain that is called so, nor some of the file: they are fitted.
    pub fn without(&self, numbers: &[usize]) -> Self {
        let kept = self.numbers.iter().enumerate().filter(|(k, _)| !numbers.contains(k)).map(|(_, c)| c.clone()).collect();
        Self { uncertain: Vec::new(), numbers: kept, ..self.clone() }
    }

    /// The same with a share of the independent noise of readings.
    pub fn with_noise(&self, share: f64) -> Self {
        Self { noise: self.noise.iter().map(|noise| share * noise).collect(), ..self.clone() }
    }

    /// The whitening of some readings at a level.
    pub fn whitener(&self, level: &Level, readings: &[usize]) -> Whitener {
        let part = self.among(readings);
        Whitener::with(part.noise_at(level), &part.columns(level))
    }

    /// The same as if what wanders were new in every reading, and each were worth one of so many.
    pub fn whitener_apart(&self, level: &Level, readings: &[usize], worth: f64) -> Whitener {
        let part = self.among(readings);
        let deviations: Vec<f64> = part.deviations_apart(level).iter().map(|d| d * worth.sqrt()).collect();
        Whitener::new(&deviations, &part.columns(level))
    }

    /// Errors that readings share at a level, one column each of unit variance, K.
    fn columns(&self, level: &Level) -> Vec<Vec<f64>> {
        let scaled = |(columns, scale): (&Vec<Vec<f64>>, f64)| -> Vec<Vec<f64>> {
            columns.iter().map(|c| c.iter().map(|v| scale * v).collect()).collect()
        };
        self.common(level).into_iter().filter(|(_, scale)| *scale > 0.0).flat_map(scaled).collect()
    }

    /// Errors that readings share, with the standard deviation that each column has at a level.
    fn common(&self, level: &Level) -> [(&Vec<Vec<f64>>, f64); 5] {
        [
            (&self.stated, 1.0),
            (&self.uncertain, 1.0),
            (&self.sensors, level.wandering),
            (&self.tests, level.between_tests),
            (&self.numbers, level.numbers),
        ]
    }

    /// The covariance of all readings at a level times a vector of one entry per reading, K² times its unit.
    pub fn times(&self, level: &Level, vector: &[f64]) -> Vec<f64> {
        let mut product = self.times_apart(level, vector);
        for (columns, scale) in self.common(level) {
            for column in columns {
                let along: f64 = scale * scale * column.iter().zip(vector).map(|(c, v)| c * v).sum::<f64>();
                product.iter_mut().zip(column).for_each(|(p, c)| *p += along * c);
            }
        }
        product
    }

    /// The same of noise and of what wanders, without what readings share otherwise.
    pub fn times_apart(&self, level: &Level, vector: &[f64]) -> Vec<f64> {
        let own = if self.wandering.is_empty() { level.wandering } else { 0.0 };
        let mut product: Vec<f64> = vector.iter().zip(&self.noise).map(|(v, n)| v * (n * n + own * own)).collect();
        let memory = if level.wandering > 0.0 { level.memory } else { wander::CORRELATION };
        self.wandering.iter().for_each(|series| series.add_product(level.wandering, memory, vector, &mut product));
        product
    }

    /// Standard deviation of each reading at a level, K.
    pub fn marginal(&self, level: &Level) -> Vec<f64> {
        let mut squares: Vec<f64> = self.deviations_apart(level).iter().map(|d| d * d).collect();
        for (columns, scale) in self.common(level) {
            columns.iter().for_each(|c| squares.iter_mut().zip(c).for_each(|(s, v)| *s += (scale * v).powi(2)));
        }
        squares.into_iter().map(f64::sqrt).collect()
    }

    /// The same of noise and of what wanders, without what readings share otherwise.
    pub fn deviations_apart(&self, level: &Level) -> Vec<f64> {
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

    fn noise_at(&self, level: &Level) -> Noise {
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

    /// The most probable level of a residual (K, one per reading) in which `free` columns (K, each of unit prior variance) may act, from
    /// a first guess; with `most` no part of it is larger.
    pub fn learn(&self, residual: &[f64], free: &[Vec<f64>], from: Level, most: Option<&Level>) -> Level {
        let thin = self.every(residual.len().div_ceil(MOST_READINGS).max(1));
        let part = self.among(&thin);
        let pick = |v: &[f64]| thin.iter().map(|i| v[*i]).collect::<Vec<f64>>();
        let free: Vec<Vec<f64>> = free.iter().map(|c| pick(c)).collect();
        let residual = pick(residual);
        let mut known: Vec<((u64, u64), Products)> = Vec::new();
        let mut cost = |level: &Level| -> f64 {
            let key = (level.wandering.to_bits(), if level.wandering > 0.0 { level.memory.to_bits() } else { 0 });
            let at = known.iter().position(|(k, _)| *k == key).unwrap_or_else(|| {
                known.push((key, part.products(level, &residual, &free)));
                known.len() - 1
            });
            known[at].1.cost(level, [part.sensors.len(), part.tests.len(), part.numbers.len()]) + level.price()
        };
        let allowed = |level: &Level| most.is_none_or(|most| level.is_within(most));
        let mut descend = |from: Level| -> (Level, f64) {
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
        // Much that wanders and little between tests, or the other way round: the likelihood can have two tops.
        let other = if self.wandering.is_empty() { Level { numbers: 0.0, ..OTHER } } else { OTHER };
        [from, other].into_iter().filter(allowed).map(&mut descend).min_by(|a, b| a.1.total_cmp(&b.1)).map_or(from, |best| best.0)
    }

    /// Every so manieth reading of each sensor, in each test of logs.
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

    fn along_factors(&self, at: &Level) -> Vec<Level> {
        let tests = if self.tests.is_empty() { &TESTS[..1] } else { &TESTS };
        let is_steady = self.wandering.is_empty();
        let numbers = if self.numbers.is_empty() || is_steady { &SPREADS[..1] } else { &SPREADS };
        let of = |n: &f64| tests.iter().map(|t| Level { between_tests: *t, numbers: *n, ..*at }).collect::<Vec<_>>();
        numbers.iter().flat_map(of).collect()
    }

    fn along_wandering(&self, at: &Level) -> Vec<Level> {
        let memories = |wandering: f64| if self.wandering.is_empty() || wandering == 0.0 { &MEMORIES[..1] } else { &MEMORIES };
        let of =
            |wandering: &f64| memories(*wandering).iter().map(|m| Level { wandering: *wandering, memory: *m, ..*at }).collect::<Vec<_>>();
        WANDERINGS.iter().flat_map(of).collect()
    }

    /// The same no larger than models of such machines usually have.
    pub fn learn_usual(&self, residual: &[f64]) -> Level {
        self.learn(residual, &[], Level::NONE, Some(Level::usual(self.is_log())))
    }

    fn products(&self, level: &Level, residual: &[f64], free: &[Vec<f64>]) -> Products {
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

/// What a likelihood needs of readings that are whitened but for their common errors.
struct Products {
    gram: DMatrix<f64>,
    along: DVector<f64>,
    square: f64,
    log_determinant: f64,
}

impl Products {
    /// Minus twice the logarithm of the likelihood: columns of unit variance first, then those of the level's parts.
    fn cost(&self, level: &Level, [sensors, tests, numbers]: [usize; 3]) -> f64 {
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

/// What a factor on all heats, and a change of every temperature of the surroundings, does in each test, K.
///
/// Heats make what of a temperature the surroundings do not: a prediction less the share that each temperature among the conditions has
/// in it, by its slope, and less what is left of the state a log began with.
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
            // Of a steady table nothing is left of any beginning, but of walls whose temperature the file states.
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
