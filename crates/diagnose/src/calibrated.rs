//! The machine where nothing is named: its numbers, drawn as far as the readings draw them.
//!
//! Data that contradict no machine still say something of it. What all films, all heats and all emissivities share, what the user calls
//! uncertain, and the other numbers of the file are part of the covariance; so the machine has an expectation given the readings. Where
//! conditions that were kept out are predicted better by it for certain, it is worth more than the file as it is.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::Cause;
use super::effects::{Hypothesis, Number};
use super::finalists::Finalists;
use super::gain::{Cut, Gain, KeptOut};
use super::shared;
use super::view::square;
use coldplate_evidence::discrepancy::DiscrepancySize;
use coldplate_evidence::measurement::Whitener;

/// Standard deviations of the logarithm of each number of the file that are tried.
const SPREADS: [f64; 6] = [0.0, 0.02, 0.04, 0.08, 0.15, 0.3];
/// A number that is drawn by less than this share of its standard deviation stays where it is.
const DRAWN: f64 = 0.1;
/// Probability that what is gained on conditions kept out is no chance, and the least share of the error that the low end of its interval
/// is: a machine is not changed for less.
const FOR_CERTAIN: f64 = 0.95;
const LEAST_GAIN: f64 = 0.05;
/// Nor where it misses conditions kept out by less than so many times what readings and conditions are uncertain by.
const NOISE: f64 = 1.2;

/// The machine as the readings draw it.
pub(super) struct Calibrated {
    /// What moved, with how far.
    pub numbers: Vec<Cause>,
    /// Their correlations.
    pub correlations: Vec<Vec<f64>>,
    /// What that gains on data kept out.
    pub gain: Gain,
    /// Predictions on the model's own mesh, K.
    pub values: Vec<f64>,
}

impl Calibrated {
    /// What moved, by how much.
    pub fn members(&self) -> Vec<(&Hypothesis, f64)> {
        self.numbers.iter().map(|c| (&c.hypothesis, c.amplitude)).collect()
    }
}

/// The machine as readings draw it that leave a level of discrepancy; `None` where it is not certain to predict better.
pub(super) fn calibrated(finals: &Finalists<'_>, level: DiscrepancySize) -> Option<Calibrated> {
    let base = finals.base;
    let residual = &base.found.residual;
    let cut = Cut::of(&finals.problem.data, KeptOut::Tests)?;
    let all: Vec<usize> = (0..residual.len()).collect();
    let at = |spread: f64, kept: &[usize]| base.errors.whitener(&DiscrepancySize { numbers: spread, ..level }, kept);
    let deviance = |spread: f64| {
        let whitener = at(spread, &all);
        (whitener.apply(residual).iter().map(|v| v * v).sum::<f64>() + whitener.log_determinant(), spread)
    };
    let (_, spread) = SPREADS.into_iter().map(deviance).min_by(|a, b| a.0.total_cmp(&b.0))?;
    let open = open(finals, spread);
    let changes: Vec<Vec<f64>> = cut.parts.iter().map(|(kept, _)| Drawn::by(residual, &open, &at(spread, kept), kept).kelvin).collect();
    let changes: Vec<Option<&[f64]>> = changes.iter().map(|kelvin| Some(kelvin.as_slice())).collect();
    let gain = cut.gain(finals.problem, base, &changes);
    if gain.before < NOISE * gain.noise_floor || gain.low < LEAST_GAIN * gain.before || !is_certain(&gain, residual) {
        return None;
    }
    let drawn = Drawn::by(residual, &open, &at(spread, &all), &all);
    let numbers: Vec<Cause> = drawn.chosen.iter().map(|k| drawn.cause(*k, &open[*k])).collect();
    let correlations = drawn.chosen.iter().map(|i| drawn.chosen.iter().map(|j| drawn.correlation(*i, *j)).collect()).collect();
    let mut found = Calibrated { numbers, correlations, gain, values: Vec::new() };
    found.values = finals.predictor.predict(&found.members()).ok()?;
    // What was drawn by slopes must hold for the machine itself.
    let of = |values: &[f64]| square(&values.iter().zip(&base.mesh).map(|(v, m)| v + m).collect::<Vec<_>>(), finals.problem);
    (of(&found.values) < of(&base.found.prediction.values)).then_some(found)
}

/// Whether the squared error of conditions kept out falls for certain: by Student's t, for conditions are few.
fn is_certain(gain: &Gain, residual: &[f64]) -> bool {
    let mut falls = vec![0.0; gain.conditions.len()];
    for (reading, residual) in gain.readings.iter().zip(residual) {
        falls[reading.condition] += residual.powi(2) - (residual - reading.change).powi(2);
    }
    let count = falls.len() as f64;
    let mean = falls.iter().sum::<f64>() / count;
    let variance = falls.iter().map(|fall| (fall - mean).powi(2)).sum::<f64>() / (count - 1.0);
    StudentsT::new(0.0, 1.0, count - 1.0).is_ok_and(|t| mean > t.inverse_cdf(FOR_CERTAIN) * (variance / count).sqrt())
}

/// A number that may be drawn: its scale is its standard deviation.
struct Open {
    hypothesis: Hypothesis,
    /// Change of every reading with one standard deviation, K.
    column: Vec<f64>,
}

/// All numbers that may be drawn, those of the file with a spread of their logarithm.
fn open(finals: &Finalists<'_>, spread: f64) -> Vec<Open> {
    let (problem, base) = (finals.problem, finals.base);
    let common = shared::beside(finals, &[], base);
    let common = common.into_iter().map(|(hypothesis, column)| Open { hypothesis, column: column.clone() });
    let slope = |k: usize, by: f64| base.found.prediction.slopes.iter().map(|row| by * row[k]).collect();
    let uncertain = problem.uncertain.iter().enumerate().map(|(k, u)| Open { hypothesis: Number::of(u), column: slope(k, u.deviation) });
    let numbers = base.numbers.iter().zip(base.errors.numbers()).map(|((h, unit), column)| Open {
        hypothesis: h.clone().inexact_by(spread * unit),
        column: column.iter().map(|c| spread * c).collect(),
    });
    common.chain(uncertain).chain(numbers).filter(|open| open.column.iter().any(|c| *c != 0.0)).collect()
}

/// The expectation of open numbers given some readings, in standard deviations, and what is left open of them.
struct Drawn {
    along: DVector<f64>,
    /// Whitened changes of these readings.
    columns: DMatrix<f64>,
    /// Which are drawn.
    chosen: Vec<usize>,
    /// Change of all predictions, K.
    kelvin: Vec<f64>,
}

impl Drawn {
    fn by(residual: &[f64], open: &[Open], whitener: &Whitener, kept: &[usize]) -> Self {
        let pick = |v: &[f64]| kept.iter().map(|i| v[*i]).collect::<Vec<f64>>();
        let left = DVector::from_vec(whitener.apply(&pick(residual)));
        let columns = whitener.apply_all(&open.iter().map(|open| pick(&open.column)).collect::<Vec<_>>());
        let along = columns.tr_mul(&left);
        let chosen: Vec<usize> = (0..open.len()).filter(|k| along[*k].abs() > DRAWN).collect();
        let mut kelvin = vec![0.0; residual.len()];
        for k in &chosen {
            kelvin.iter_mut().zip(&open[*k].column).for_each(|(v, c)| *v += along[*k] * c);
        }
        Self { along, columns, chosen, kelvin }
    }

    /// Covariance of what is left open of two numbers, in standard deviations.
    fn covariance(&self, i: usize, j: usize) -> f64 {
        f64::from(u8::from(i == j)) - self.columns.column(i).dot(&self.columns.column(j))
    }

    fn deviation(&self, k: usize) -> f64 {
        self.covariance(k, k).max(0.0).sqrt()
    }

    fn correlation(&self, i: usize, j: usize) -> f64 {
        let both = self.deviation(i) * self.deviation(j);
        if both > 0.0 { self.covariance(i, j) / both } else { 0.0 }
    }

    fn cause(&self, k: usize, open: &Open) -> Cause {
        let scale = open.hypothesis.scale;
        Cause::new(open.hypothesis.clone(), scale * self.along[k], scale * self.deviation(k))
    }
}
