//! What a test that was not made yet would show of the explanations.

use crate::{Effect, Hypothesis, Problem, hypotheses};
use coldplate_describe::machine::Condition;
use coldplate_evidence::measurement::{Data, ReadingRow, Whitener};

/// What a test would show of the explanations, reading by reading, K.
#[derive(Debug, Clone)]
pub(super) struct Outlook {
    /// Readings under each explanation, counted from any common base.
    pub shown: Vec<Vec<f64>>,
    /// What the amplitudes of each explanation leave open in them, one column per part.
    pub open: Vec<Vec<Vec<f64>>>,
    /// Standard deviation of each reading's own error.
    pub deviation: Vec<f64>,
    /// Errors that readings share, each of unit variance.
    pub common: Vec<Vec<f64>>,
}

impl Outlook {
    /// Distance of two explanations over some readings, in standard deviations: what their amplitudes could still make up for
    /// does not count.
    pub fn distance(&self, (a, b): (usize, usize), readings: &[usize]) -> f64 {
        let pick = |v: &Vec<f64>| readings.iter().map(|i| v[*i]).collect::<Vec<f64>>();
        let shared = self.common.iter().chain(&self.open[a]).chain(&self.open[b]).map(pick).collect::<Vec<_>>();
        let whitener = Whitener::new(&pick(&self.deviation), &shared);
        let apart: Vec<f64> = readings.iter().map(|i| self.shown[a][*i] - self.shown[b][*i]).collect();
        whitener.apply(&apart).iter().map(|v| v * v).sum::<f64>().sqrt()
    }

    /// The least distance of two explanations, and the mean one, weighted with their probabilities.
    pub fn apart(&self, probabilities: &[f64], readings: &[usize]) -> (f64, f64) {
        let (mut least, mut sum, mut weight) = (f64::INFINITY, 0.0, 0.0);
        for a in 0..self.shown.len() {
            for b in a + 1..self.shown.len() {
                let distance = self.distance((a, b), readings);
                let both = probabilities[a] * probabilities[b];
                least = least.min(distance);
                sum += both * distance;
                weight += both;
            }
        }
        (least, if weight > 0.0 { sum / weight } else { 0.0 })
    }
}

/// What every model leaves open: all films, heats and emissivities.
pub(super) fn open_causes(problem: &Problem, data: &Data) -> Vec<Hypothesis> {
    let mut found = hypotheses(&problem.study, data, &[]);
    found.retain(|h| h.common_factor().is_some());
    found
}

/// Rows (test, time, condition) to be predicted for all of the machine's sensors.
pub(super) fn all_sensors(problem: &Problem, rows: impl Iterator<Item = (String, Option<f64>, Condition)>) -> Data {
    let machine = &problem.study.model.machine;
    let sensors: Vec<usize> = (0..machine.sensors.len()).collect();
    let names = machine.sensors.iter().map(|s| s.name.clone()).collect();
    let row = |(test, time, condition): (String, Option<f64>, Condition)| ReadingRow {
        test,
        time,
        condition,
        readings: vec![Some(300.0); sensors.len()],
        line: None,
    };
    let rows = rows.map(row).collect();
    Data { source: String::new(), sensors, names, rows, ..Data::default() }
}

/// A sensor's own error refers to the columns of the data; here all of the machine's sensors are columns.
pub(super) fn moved(mut h: Hypothesis, problem: &Problem) -> Hypothesis {
    let to = |k: usize| problem.data.sensors[k];
    if let Some(sensor) = h.sensor() {
        h.effect = Effect::Sensor(sensor.renumbered(to));
    }
    h
}
