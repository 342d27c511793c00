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
//! lie elsewhere.

use super::{Data, Uncertainty, whiten};

/// Correlation time over the length of a test.
pub const CORRELATION: f64 = 0.02;
/// Points per correlation time between which the wandering error runs straight.
const KNOTS: f64 = 2.0;

/// Columns of unit variance each, one entry per reading (K), beside those of [`whiten::common_errors`]; `model` is the
/// standard deviation of what does not depend on the rate, K, beside [`Uncertainty::model`]; `predicted` are the
/// model's readings, K. None for steady tables.
pub fn errors(data: &Data, uncertainty: &Uncertainty, model: f64, predicted: &[f64]) -> Vec<Vec<f64>> {
    let mut common = Vec::new();
    if !data.is_transient() {
        return common;
    }
    let model = model.hypot(uncertainty.model);
    let places = whiten::places(data);
    let readings = whiten::readings(data);
    let time = |i: usize| data.rows[places[i].0].time.unwrap_or(0.0);
    for test in data.tests() {
        let of_test: Vec<usize> = (0..places.len()).filter(|i| data.rows[places[*i].0].test == test).collect();
        let mut clock = vec![0.0; places.len()];
        let mut wandering = Vec::new();
        for sensor in 0..data.sensors.len() {
            let own: Vec<usize> = of_test.iter().copied().filter(|i| places[*i].1 == sensor).collect();
            let series: Vec<(f64, f64)> = own.iter().map(|i| (time(*i), readings[*i])).collect();
            let told: Vec<(f64, f64)> = own.iter().map(|i| (time(*i), predicted[*i])).collect();
            let (read, told) = (moved(&series, uncertainty.timing), moved(&told, uncertainty.timing));
            own.iter().zip(&read).for_each(|(i, (_, slope))| clock[*i] = *slope);
            let deviations: Vec<f64> = read.iter().zip(&told).map(|((a, _), (b, _))| model.hypot(a.max(*b))).collect();
            let times: Vec<f64> = series.iter().map(|(t, _)| *t).collect();
            for weights in walk(&times) {
                let mut column = vec![0.0; places.len()];
                for ((i, w), deviation) in own.iter().zip(weights).zip(&deviations) {
                    column[*i] = w * deviation;
                }
                wandering.push(column);
            }
        }
        common.push(clock);
        common.extend(wandering);
    }
    common
}

/// Effect of a clock error of one standard deviation (s) on a series of (time, value): standard deviation and slope at each
/// time. Shortly before a front both are larger than the rate alone gives.
fn moved(series: &[(f64, f64)], timing: f64) -> Vec<(f64, f64)> {
    let at = |t: f64| -> f64 {
        let above = series.partition_point(|(own, _)| *own <= t).clamp(1, series.len() - 1);
        let ((t0, v0), (t1, v1)) = (series[above - 1], series[above]);
        v0 + (v1 - v0) * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0)
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

/// A process of unit variance and correlation exp(-|t - t'| / tau) at some times: columns whose squares add up to one (a
/// little less between two knots).
fn walk(times: &[f64]) -> Vec<Vec<f64>> {
    let (Some(first), Some(last)) = (times.first(), times.last()) else { return Vec::new() };
    let span = last - first;
    if span <= 0.0 {
        return vec![vec![1.0; times.len()]];
    }
    let tau = CORRELATION * span;
    let count = (KNOTS / CORRELATION).round() as usize + 1;
    let knots: Vec<f64> =
        if times.len() <= count { times.to_vec() } else { (0..count).map(|k| first + span * k as f64 / (count - 1) as f64).collect() };
    // A Markov process: each knot remembers the one before. Column j of the factor: what draw j leaves at each knot.
    let mut factor = vec![vec![0.0; knots.len()]; knots.len()];
    for k in 0..knots.len() {
        let memory = if k == 0 { 0.0 } else { (-(knots[k] - knots[k - 1]) / tau).exp() };
        for (j, column) in factor.iter_mut().enumerate().take(k + 1) {
            column[k] = if j == k { (1.0 - memory * memory).sqrt() } else { memory * column[k - 1] };
        }
    }
    let at = |column: &Vec<f64>, t: f64| -> f64 {
        let above = knots.partition_point(|k| *k <= t).clamp(1, knots.len() - 1);
        let share = ((t - knots[above - 1]) / (knots[above] - knots[above - 1])).clamp(0.0, 1.0);
        (1.0 - share) * column[above - 1] + share * column[above]
    };
    factor.iter().map(|column| times.iter().map(|t| at(column, *t)).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At the knots the covariance is exp(-|t - t'| / tau); between them it is within what straight lines leave.
    #[test]
    fn remembers_exponentially() {
        for count in [12, 200] {
            let times: Vec<f64> = (0..count).map(|i| 3.0 * i as f64 + if i % 2 == 1 { 0.5 } else { 0.0 }).collect();
            let columns = walk(&times);
            let tau = CORRELATION * (times[count - 1] - times[0]);
            for a in 0..count {
                for b in 0..count {
                    let found: f64 = columns.iter().map(|c| c[a] * c[b]).sum();
                    let wanted = (-(times[a] - times[b]).abs() / tau).exp();
                    let allowed = if count == 12 { 1e-12 } else { 0.21 };
                    assert!((found - wanted).abs() < allowed, "{count}: {a} {b} {found} {wanted}");
                }
            }
        }
    }

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
