//! Noise and a wandering error along one series of readings, whitened by a scalar Kalman filter.

/// Readings of one sensor in one test, in the order of time, with an error that wanders.
#[derive(Debug, Clone, PartialEq)]
pub struct Wandering {
    /// Positions among all readings, in the order of time.
    pub readings: Vec<usize>,
    /// Time of each reading, s.
    pub times: Vec<f64>,
    /// Standard deviation of the wandering error of each reading, K.
    pub deviations: Vec<f64>,
    /// First and last time of the whole test, s.
    pub span: f64,
}

impl Wandering {
    /// Series of the readings that are among a selection. `position` gives the place of each reading in the selection.
    pub fn among(&self, position: &[Option<usize>]) -> Self {
        let kept: Vec<(usize, usize)> = self.readings.iter().enumerate().filter_map(|(k, i)| position[*i].map(|p| (k, p))).collect();
        Self {
            readings: kept.iter().map(|(_, p)| *p).collect(),
            times: kept.iter().map(|(k, _)| self.times[*k]).collect(),
            deviations: kept.iter().map(|(k, _)| self.deviations[*k]).collect(),
            span: self.span,
        }
    }

    /// Adds the covariance of the wandering error, times a vector, to `product`. Each standard deviation is wider by `more` (K,
    /// as a sum of squares); the correlation time is a share `memory` of the test.
    pub fn add_product(&self, more: f64, memory: f64, vector: &[f64], product: &mut [f64]) {
        let n = self.readings.len();
        let deviation = |k: usize| self.deviations[k].hypot(more);
        let loaded: Vec<f64> = (0..n).map(|k| deviation(k) * vector[self.readings[k]]).collect();
        // exp(-|t - t'| / tau) is a product of steps: one pass over the readings before, one over those after.
        let step = |k: usize| match memory * self.span {
            tau if tau > 0.0 => (-(self.times[k] - self.times[k - 1]).abs() / tau).exp(),
            _ => 0.0,
        };
        let (mut before, mut after) = (0.0, 0.0);
        for k in 0..n {
            before = loaded[k] + if k > 0 { step(k) * before } else { 0.0 };
            product[self.readings[k]] += deviation(k) * before;
        }
        for k in (0..n.saturating_sub(1)).rev() {
            after = step(k + 1) * (after + loaded[k + 1]);
            product[self.readings[k]] += deviation(k) * after;
        }
    }
}

/// One reading in a [`Filter`].
#[derive(Debug, Clone, PartialEq)]
struct Step {
    reading: usize,
    /// Correlation of the wandering error with that of the reading before.
    memory: f64,
    /// Standard deviation of the wandering error, K.
    loading: f64,
    gain: f64,
    /// One over the standard deviation of the innovation, 1/K.
    inverse: f64,
}

/// A Kalman filter of noise and a wandering error of unit variance along one series. The innovations over their standard
/// deviations are independent and of unit variance.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Filter {
    steps: Vec<Step>,
}

impl Filter {
    /// Filter of a series; `noise` of all readings, K; `correlation` time in s.
    pub fn new(series: &Wandering, noise: &[f64], correlation: f64) -> Self {
        let mut spread = 1.0;
        let mut before: Option<f64> = None;
        let mut steps = Vec::with_capacity(series.readings.len());
        for ((reading, time), loading) in series.readings.iter().zip(&series.times).zip(&series.deviations) {
            let memory = match before {
                None => 0.0,
                Some(_) if correlation <= 0.0 => 0.0,
                Some(before) => (-(time - before).abs() / correlation).exp(),
            };
            before = Some(*time);
            let ahead = memory * memory * spread + (1.0 - memory * memory);
            let variance = loading * loading * ahead + noise[*reading] * noise[*reading];
            let gain = ahead * loading / variance;
            spread = ahead * (1.0 - gain * loading);
            steps.push(Step { reading: *reading, memory, loading: *loading, gain, inverse: 1.0 / variance.sqrt() });
        }
        Self { steps }
    }

    /// Whitens the readings of the series in place; they are in K before and dimensionless after.
    pub fn apply(&self, readings: &mut [f64]) {
        let mut state = 0.0;
        for step in &self.steps {
            let ahead = step.memory * state;
            let innovation = readings[step.reading] - step.loading * ahead;
            state = ahead + step.gain * innovation;
            readings[step.reading] = innovation * step.inverse;
        }
    }

    /// Multiplies the readings of the series by the transposed whitening, in place.
    pub fn apply_transposed(&self, whitened: &mut [f64]) {
        // Pull on the state behind a reading.
        let mut pull = 0.0;
        for step in self.steps.iter().rev() {
            let innovation = step.inverse * whitened[step.reading] + step.gain * pull;
            pull = step.memory * (pull - step.loading * innovation);
            whitened[step.reading] = innovation;
        }
    }

    /// Writes the diagonal of the inverse covariance of the series, 1/K².
    pub fn precisions(&self, all: &mut [f64]) {
        // Squares of all later whitened readings for a state of one behind a reading.
        let mut later = 0.0;
        for step in self.steps.iter().rev() {
            all[step.reading] = step.inverse * step.inverse + step.gain * step.gain * later;
            let (innovation, kept) = (step.loading * step.inverse, 1.0 - step.gain * step.loading);
            later = step.memory * step.memory * (innovation * innovation + kept * kept * later);
        }
    }

    /// Logarithm of the determinant of the covariance, which is in K² for each reading.
    pub fn log_determinant(&self) -> f64 {
        self.steps.iter().map(|step| -2.0 * step.inverse.ln()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// L⁻¹ Σ L⁻ᵀ is the identity, Σ = noise² + d d' exp(-|t - t'| / tau), and the determinant is that of Σ.
    #[test]
    fn whitens_a_wandering_error() {
        let times = [0.0, 3.0, 3.5, 10.0, 11.0, 40.0];
        let deviations = vec![0.5, 0.1, 2.0, 0.7, 0.7, 0.3];
        let noise = [0.1, 0.2, 0.05, 0.3, 0.1, 0.4];
        let tau = 5.0;
        let n = times.len();
        let sigma = nalgebra::DMatrix::from_fn(n, n, |i, j| {
            let diagonal = if i == j { noise[i] * noise[i] } else { 0.0 };
            deviations[i] * deviations[j] * (-(f64::abs(times[i] - times[j])) / tau).exp() + diagonal
        });
        let series = Wandering { readings: (0..n).collect(), times: times.to_vec(), deviations, span: 40.0 };
        for j in 0..n {
            let unit: Vec<f64> = (0..n).map(|i| f64::from(u8::from(i == j))).collect();
            let mut column: Vec<f64> = unit.iter().zip(&noise).map(|(u, n)| u * n * n).collect();
            series.add_product(0.0, tau / 40.0, &unit, &mut column);
            assert!((0..n).all(|i| (column[i] - sigma[(i, j)]).abs() < 1e-12), "{column:?}");
        }
        let filter = Filter::new(&series, &noise, tau);
        let mut whitened = nalgebra::DMatrix::<f64>::identity(n, n);
        for mut column in whitened.column_iter_mut() {
            let mut values: Vec<f64> = column.iter().copied().collect();
            filter.apply(&mut values);
            column.copy_from_slice(&values);
        }
        let unit = &whitened * &sigma * whitened.transpose();
        assert!((unit - nalgebra::DMatrix::identity(n, n)).amax() < 1e-12);
        assert!((filter.log_determinant() - sigma.determinant().ln()).abs() < 1e-10);
        let inverse = sigma.try_inverse().unwrap();
        let mut precisions = vec![0.0; n];
        filter.precisions(&mut precisions);
        assert!((0..n).all(|i| (precisions[i] / inverse[(i, i)] - 1.0).abs() < 1e-12));
        for mut column in whitened.column_iter_mut() {
            filter.apply_transposed(column.as_mut_slice());
        }
        assert!((whitened - inverse).amax() < 1e-9);
    }
}
