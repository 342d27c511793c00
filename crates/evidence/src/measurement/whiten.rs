//! Whitening: residuals of unit variance and without correlation.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::filter::{Filter, Wandering};
use super::{Data, MeasurementUncertainty};
use coldplate_base::numbers::root_mean_square;
use coldplate_base::units::Measurand;
use coldplate_describe::machine::Machine;

/// The inverse square root of a covariance D + U Uᵀ: D of independent noise, and of errors that wander along series of readings;
/// U of few columns.
///
/// D is whitened by a Kalman filter along each series, D⁻¹ = Lᵀ L. With V = L U and the eigenvectors Q of V Vᵀ,
/// (I + V Vᵀ)^-½ = I + Q (diag(1 + s²)^-½ - I) Qᵀ, so that nothing larger than a column per common error is ever formed.
#[derive(Debug, Clone, PartialEq)]
pub struct Whitener {
    noise: Noise,
    directions: DMatrix<f64>,
    shrink: Vec<f64>,
    log_determinant: f64,
}

/// Covariance of readings without common errors: independent noise, and errors that wander along series.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise {
    /// Inverse standard deviation of readings that are on no series, 1/K; zero of the others.
    inverse_deviation: Vec<f64>,
    series: Vec<Filter>,
    log_determinant: f64,
}

impl Noise {
    /// Independent errors of the given standard deviation of each reading, K.
    pub fn independent(deviation: &[f64]) -> Self {
        Self::wandering(deviation, &[], 0.0)
    }

    /// Independent errors (K), with errors that wander along series. The correlation time is a share `memory` of each test's
    /// length.
    pub fn wandering(deviation: &[f64], series: &[Wandering], memory: f64) -> Self {
        let mut inverse_deviation: Vec<f64> = deviation.iter().map(|d| 1.0 / d).collect();
        series.iter().flat_map(|s| &s.readings).for_each(|i| inverse_deviation[*i] = 0.0);
        let series: Vec<Filter> = series.iter().map(|s| Filter::new(s, deviation, memory * s.span)).collect();
        let alone: f64 = inverse_deviation.iter().filter(|d| **d > 0.0).map(|d| -2.0 * d.ln()).sum();
        Self { log_determinant: alone + series.iter().map(Filter::log_determinant).sum::<f64>(), inverse_deviation, series }
    }

    /// Whitens readings, K.
    pub fn apply(&self, readings: &[f64]) -> Vec<f64> {
        // A reading on a series keeps its value for the filter.
        let alone = |(r, d): (&f64, &f64)| if *d > 0.0 { r * d } else { *r };
        let mut whitened: Vec<f64> = readings.iter().zip(&self.inverse_deviation).map(alone).collect();
        self.series.iter().for_each(|filter| filter.apply(&mut whitened));
        whitened
    }

    /// Multiplies whitened readings by the transposed whitening, in place: of whitened columns it makes those under the inverse covariance.
    pub fn apply_transposed(&self, whitened: &mut [f64]) {
        whitened.iter_mut().zip(&self.inverse_deviation).filter(|(_, d)| **d > 0.0).for_each(|(own, d)| *own *= d);
        self.series.iter().for_each(|filter| filter.apply_transposed(whitened));
    }

    /// Diagonal of the inverse covariance, 1/K².
    pub fn precisions(&self) -> Vec<f64> {
        let mut all: Vec<f64> = self.inverse_deviation.iter().map(|d| d * d).collect();
        self.series.iter().for_each(|filter| filter.precisions(&mut all));
        all
    }

    /// Logarithm of the determinant of the covariance, which is in K² for each reading.
    pub fn log_determinant(&self) -> f64 {
        self.log_determinant
    }
}

impl Whitener {
    /// Whitening by the standard deviation of each reading's independent error (K) and columns of common errors, each of unit
    /// variance.
    pub fn new(deviation: &[f64], common: &[Vec<f64>]) -> Self {
        Self::with(Noise::independent(deviation), common)
    }

    /// Whitening by the covariance without common errors, and columns of common errors, each of unit variance.
    pub fn with(noise: Noise, common: &[Vec<f64>]) -> Self {
        let columns: Vec<DVector<f64>> =
            common.iter().filter(|c| c.iter().any(|v| *v != 0.0)).map(|c| DVector::from_vec(noise.apply(c))).collect();
        if columns.is_empty() {
            let log_determinant = noise.log_determinant;
            return Self { directions: DMatrix::zeros(noise.inverse_deviation.len(), 0), noise, shrink: Vec::new(), log_determinant };
        }
        let v = DMatrix::from_columns(&columns);
        let eigen = SymmetricEigen::new(v.tr_mul(&v));
        let largest = eigen.eigenvalues.max().max(0.0);
        let kept: Vec<usize> = (0..columns.len()).filter(|k| eigen.eigenvalues[*k] > 1e-12 * largest).collect();
        let mut directions = DMatrix::zeros(v.nrows(), kept.len());
        let mut shrink = Vec::with_capacity(kept.len());
        let mut log_determinant = noise.log_determinant;
        for (j, k) in kept.into_iter().enumerate() {
            let squared = eigen.eigenvalues[k];
            directions.set_column(j, &(&v * eigen.eigenvectors.column(k) / squared.sqrt()));
            shrink.push(1.0 / (1.0 + squared).sqrt() - 1.0);
            log_determinant += squared.ln_1p();
        }
        Self { noise, directions, shrink, log_determinant }
    }

    /// Whitening by the covariance of `data` under `uncertainty`. `slopes` are derivatives of each reading (rows of data, then
    /// sensors, missing ones left out) with respect to the condition variables, K per SI unit. Errors of conditions are one per
    /// row in steady tables, one per test in logs.
    pub fn of(data: &Data, uncertainty: &MeasurementUncertainty, slopes: &[Vec<f64>]) -> Self {
        Self::new(&deviations(data, uncertainty), &common_errors(data, uncertainty, slopes))
    }

    /// Whitens a vector of one entry per reading, K.
    pub fn apply(&self, residual: &[f64]) -> Vec<f64> {
        let mut whitened = self.noise.apply(residual);
        let before = whitened.clone();
        for (column, shrink) in self.directions.column_iter().zip(&self.shrink) {
            let along: f64 = column.iter().zip(&before).map(|(q, s)| q * s).sum();
            whitened.iter_mut().zip(column.iter()).for_each(|(s, q)| *s += shrink * along * q);
        }
        whitened
    }

    /// Whitens many vectors of one entry per reading (K), into the columns of a matrix.
    pub fn apply_all(&self, columns: &[Vec<f64>]) -> DMatrix<f64> {
        let mut whitened = DMatrix::zeros(self.directions.nrows(), columns.len());
        columns.iter().zip(whitened.column_iter_mut()).for_each(|(column, mut into)| into.copy_from_slice(&self.noise.apply(column)));
        if !self.shrink.is_empty() {
            let mut along = self.directions.transpose() * &whitened;
            along.row_iter_mut().zip(&self.shrink).for_each(|(mut row, shrink)| row *= *shrink);
            whitened.gemm(1.0, &self.directions, &along, 1.0);
        }
        whitened
    }

    /// Inverse of the covariance times a vector of one entry per reading (K), in 1/K. Only for independent noise.
    pub fn weigh(&self, vector: &[f64]) -> Vec<f64> {
        let inner = DVector::from_vec(self.noise.apply(vector));
        let shrunk = |(along, shrink): (&f64, &f64)| along * ((1.0 + shrink).powi(2) - 1.0);
        let along = self.directions.tr_mul(&inner);
        let along = DVector::from_iterator(along.len(), along.iter().zip(&self.shrink).map(shrunk));
        self.noise.apply((inner + &self.directions * along).as_slice())
    }

    /// Logarithm of the determinant of the covariance, which is in K² for each reading.
    pub fn log_determinant(&self) -> f64 {
        self.log_determinant
    }
}

/// Standard deviation of each reading's independent error, K.
pub fn deviations(data: &Data, uncertainty: &MeasurementUncertainty) -> Vec<f64> {
    places(data).iter().map(|(_, k)| uncertainty.noise[*k].hypot(uncertainty.model)).collect()
}

/// Uncorrelated part of each reading's error, K: reading noise. In logs the rest wanders ([`super::wander`]).
pub fn noise(data: &Data, uncertainty: &MeasurementUncertainty) -> Vec<f64> {
    places(data).iter().map(|(_, k)| uncertainty.noise[*k]).collect()
}

/// Errors common to several readings, each of unit variance: sensor biases and errors of conditions; see [`Whitener::of`].
pub fn common_errors(data: &Data, uncertainty: &MeasurementUncertainty, slopes: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let places = places(data);
    let mut common: Vec<Vec<f64>> = Vec::new();
    for (k, bias) in uncertainty.bias.iter().enumerate() {
        common.push(places.iter().map(|(_, own)| if *own == k { *bias } else { 0.0 }).collect());
    }
    let mut groups: Vec<Vec<usize>> = Vec::new();
    if data.is_transient() {
        for test in data.tests() {
            groups.push((0..data.rows.len()).filter(|r| data.rows[*r].test == test).collect());
        }
    } else {
        groups.extend((0..data.rows.len()).map(|r| vec![r]));
    }
    for group in groups {
        // A share of a value that changes through a log is as large as in the root mean square of its rows.
        let rows: Vec<Vec<f64>> = group.iter().map(|r| uncertainty.at(&data.rows[*r].condition)).collect();
        let deviations = (0..uncertainty.variables.len()).map(|v| root_mean_square(&rows.iter().map(|row| row[v]).collect::<Vec<_>>()));
        let deviations: Vec<f64> = deviations.collect();
        for (v, deviation) in deviations.iter().enumerate().filter(|(_, d)| **d > 0.0) {
            let of = |(i, (r, _)): (usize, &(usize, usize))| if group.contains(r) { deviation * slopes[i][v] } else { 0.0 };
            common.push(places.iter().enumerate().map(of).collect());
        }
    }
    common
}

/// Place of each reading: row of the data and position of its sensor, missing ones left out.
pub fn places(data: &Data) -> Vec<(usize, usize)> {
    let of_row = |(r, row): (usize, &super::ReadingRow)| -> Vec<(usize, usize)> {
        row.readings.iter().enumerate().filter(|(_, t)| t.is_some()).map(|(k, _)| (r, k)).collect()
    };
    data.rows.iter().enumerate().flat_map(of_row).collect()
}

/// Root mean square of predictions (one per reading) less readings, K or um, of all sensors that read `measurand`; `None` if
/// there is no such sensor.
pub fn rmse(machine: &Machine, data: &Data, predicted: &[f64], measurand: Measurand) -> Option<f64> {
    let measurands = data.measurands(machine);
    let of = places(data).into_iter().zip(readings(data)).zip(predicted).filter(|(((_, k), _), _)| measurands[*k] == measurand);
    let (sum, count) = of.fold((0.0, 0_usize), |(sum, count), ((_, r), p)| (sum + (r - p).powi(2), count + 1));
    (count > 0).then(|| (sum / count as f64).sqrt())
}

/// Readings in the order of [`places`], K.
pub fn readings(data: &Data) -> Vec<f64> {
    data.rows.iter().flat_map(|row| row.readings.iter().flatten().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// W Σ Wᵀ is the identity.
    #[test]
    fn whitens() {
        let deviation = [0.1, 0.2, 0.3, 0.05];
        let common = vec![vec![0.2, 0.2, 0.0, 0.0], vec![0.0, 0.1, 0.4, -0.3], vec![0.0; 4]];
        let sigma =
            |i: usize, j: usize| common.iter().map(|c| c[i] * c[j]).sum::<f64>() + if i == j { deviation[i] * deviation[i] } else { 0.0 };
        let w = Whitener::new(&deviation, &common);
        // W is Q-symmetric only after D^-½: rows of W from unit vectors.
        let columns: Vec<Vec<f64>> = (0..4).map(|j| w.apply(&(0..4).map(|i| f64::from(u8::from(i == j))).collect::<Vec<_>>())).collect();
        for a in 0..4 {
            for b in 0..4 {
                let entry: f64 =
                    (0..4).flat_map(|i| (0..4).map(move |j| (i, j))).map(|(i, j)| columns[i][a] * sigma(i, j) * columns[j][b]).sum();
                assert!((entry - f64::from(u8::from(a == b))).abs() < 1e-12, "{a} {b} {entry}");
            }
        }
        let vectors = [vec![1.0, -2.0, 0.5, 3.0], vec![0.0, 1.0, 0.0, -1.0]];
        for (one, together) in vectors.iter().zip(w.apply_all(&vectors).column_iter()) {
            assert!(w.apply(one).iter().zip(&together).all(|(a, b)| (a - b).abs() < 1e-12));
        }
        let inverse = DMatrix::from_fn(4, 4, sigma).try_inverse().unwrap();
        let weighed = DVector::from_vec(w.weigh(&vectors[0]));
        assert!((inverse * DVector::from_column_slice(&vectors[0]) - weighed).amax() < 1e-9);
        let determinant = DMatrix::from_fn(4, 4, sigma).determinant();
        assert!((w.log_determinant() - determinant.ln()).abs() < 1e-10);
    }
}
