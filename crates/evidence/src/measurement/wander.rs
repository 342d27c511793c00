//! Errors of logs that are correlated in time.
//!
//! Rows of a log are seconds apart. The discrepancy of a model of moving temperatures (a lag of sensors behind a front, a
//! mixing that is left out, a clock that is off) does not change sign from one row to the next. Were it taken as independent
//! between rows it would average out, and any log of enough rows would refute any model. Each sensor in each test gets
//!
//! * a constant clock error: timing x rate of change of its reading, and
//! * a wandering error of standard deviation hypot(model, timing x rate) and correlation exp(-|t - t'| / tau), where tau is
//!   a share of the test's length.
//!
//! The clock error uses the rate of the readings; the wandering error the larger of theirs and the model's, whose fronts may
//! lie elsewhere. The wandering error is a Markov process, so that a scalar Kalman filter whitens it exactly, in one pass over
//! the readings ([`super::filter`]).

use super::filter::Wandering;
use super::{Data, MeasurementUncertainty, whiten};

/// Correlation time over the length of a test if none is learnt; dimensionless. Chosen with data such as those of the hot-water
/// pipe in view (docs/record/diagnosis-measured.md).
pub const CORRELATION: f64 = 0.02;

/// Every sensor's clock error in each test (columns of unit variance, one entry per reading, K), and its wandering error.
#[derive(Debug, Clone, Default)]
pub struct LogErrors {
    /// Errors of the clock, one column per test, K.
    pub clock: Vec<Vec<f64>>,
    /// Wandering errors of every sensor in every test.
    pub wandering: Vec<Wandering>,
}

/// Errors of logs; none for steady tables. `model` is the standard deviation of an error that does not depend on the rate, K,
/// beside [`MeasurementUncertainty::model`]. `predicted` are the model's readings, K.
pub fn errors(data: &Data, uncertainty: &MeasurementUncertainty, model: f64, predicted: &[f64]) -> LogErrors {
    let mut found = LogErrors::default();
    if !data.is_transient() {
        return found;
    }
    let model = model.hypot(uncertainty.model);
    let places = whiten::places(data);
    let readings = whiten::readings(data);
    let time = |i: usize| data.rows[places[i].0].time.unwrap_or(0.0);
    for test in data.tests() {
        let of_test: Vec<usize> = (0..places.len()).filter(|i| data.rows[places[*i].0].test == test).collect();
        let ends = of_test.iter().map(|i| time(*i)).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(t), b.max(t)));
        let mut clock = vec![0.0; places.len()];
        for sensor in 0..data.sensors.len() {
            let own: Vec<usize> = of_test.iter().copied().filter(|i| places[*i].1 == sensor).collect();
            if own.is_empty() {
                continue;
            }
            let series: Vec<(f64, f64)> = own.iter().map(|i| (time(*i), readings[*i])).collect();
            let told: Vec<(f64, f64)> = own.iter().map(|i| (time(*i), predicted[*i])).collect();
            let (read, told) = (moved(&series, uncertainty.timing), moved(&told, uncertainty.timing));
            own.iter().zip(&read).for_each(|(i, (_, slope))| clock[*i] = *slope);
            found.wandering.push(Wandering {
                deviations: read.iter().zip(&told).map(|((a, _), (b, _))| model.hypot(a.max(*b))).collect(),
                times: series.iter().map(|(t, _)| *t).collect(),
                readings: own,
                span: ends.1 - ends.0,
            });
        }
        found.clock.push(clock);
    }
    found
}

/// Effect of a clock error of one standard deviation (s) on a series of (time, value): standard deviation and slope at each
/// time. Shortly before a front both are larger than the rate alone gives.
fn moved(series: &[(f64, f64)], timing: f64) -> Vec<(f64, f64)> {
    let at = |t: f64| -> f64 {
        let above = series.partition_point(|(own, _)| *own <= t).clamp(1, series.len() - 1);
        let ((t0, v0), (t1, v1)) = (series[above - 1], series[above]);
        if t1 > t0 { v0 + (v1 - v0) * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0) } else { v1 }
    };
    if series.len() < 2 || timing <= 0.0 {
        return vec![(0.0, 0.0); series.len()];
    }
    let of = |(t, v): &(f64, f64)| {
        let (mut sum, mut weight) = (0.0, 0.0);
        for step in [-2.0f64, -1.0, 1.0, 2.0] {
            let w = (-0.5 * step * step).exp();
            sum += w * (at(t + step * timing) - v).powi(2);
            weight += w * step * step;
        }
        ((sum / weight).sqrt(), 0.5 * (at(t + timing) - at(t - timing)))
    };
    series.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On a ramp both are timing x rate; the deviation rises ahead of a step.
    #[test]
    fn errors_of_time() {
        let ramp: Vec<(f64, f64)> = (0..60).map(|i| (f64::from(i), 2.0 + 0.5 * f64::from(i))).collect();
        for (deviation, slope) in &moved(&ramp, 1.5)[4..56] {
            assert!((deviation - 0.75).abs() < 1e-12 && (slope - 0.75).abs() < 1e-12, "{deviation} {slope}");
        }
        let step = [(0.0, 0.0), (9.0, 0.0), (10.0, 0.0), (10.5, 20.0), (30.0, 20.0)];
        let found = moved(&step, 1.0);
        assert!(found[2].0 > 5.0 && found[1].0 > 1.0 && found[0].0 == 0.0, "{found:?}");
        assert_eq!(moved(&[(0.0, 1.0)], 1.0), vec![(0.0, 0.0)]);
    }
}
