//! Adaptive designs, which grow until the fit is as accurate as asked: choice of their conditions.

use super::design::{self, LevelSpacing};
use coldplate_base::units;
use coldplate_describe::machine::DescribedVariable;

/// Name of the group of conditions that were added to a first design.
pub const ADDED: &str = "added";
/// Conditions, beside the corners, from which those to be added are chosen, count. Chosen: more cost time (docs/how-to/sweep.md).
const CANDIDATES: usize = 1500;
/// Most variables with all corners among these conditions, count. Chosen: n variables have 2^n corners.
const MOST_WITH_CORNERS: usize = 8;
/// Conditions added at a time, per varied variable; count. Chosen: a larger batch needs fewer fits and places runs less well.
const BATCH_PER_VARIABLE: usize = 2;

/// A varied variable.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    pub(super) variable: usize,
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) spacing: LevelSpacing,
    pub(super) levels: Option<Vec<f64>>,
}

/// Growth of a design.
#[derive(Debug, Clone)]
pub struct DesignGrowth {
    /// Largest half width of the band wanted for any measurement point, K.
    pub accuracy: f64,
    /// Largest number of conditions, those of the first design included.
    pub most: usize,
    pub(super) seed: u64,
    pub(super) axes: Vec<Axis>,
    /// A condition (SI) with the values of the held variables.
    pub(super) base: Vec<f64>,
}

impl DesignGrowth {
    /// Conditions added at a time.
    pub fn batch(&self) -> usize {
        BATCH_PER_VARIABLE * self.axes.len()
    }

    /// Indices of the varied variables.
    pub(super) fn varied(&self) -> Vec<usize> {
        self.axes.iter().map(|a| a.variable).collect()
    }

    /// Candidates of a round, one row of one value in [0, 1] per varied variable each: conditions spread evenly, half of them
    /// taken to the faces of the ranges, on which fits err most, and the corners.
    pub fn candidates(&self, round: usize) -> Vec<Vec<f64>> {
        let n = self.axes.len();
        // Two numbers per variable: the value, and whether it is taken to an end.
        let drawn = design::uniform(CANDIDATES, 2 * n, self.seed.wrapping_mul(1009).wrapping_add(round as u64 + 1));
        let at = |(i, row): (usize, Vec<f64>)| -> Vec<f64> {
            let (values, ends) = row.split_at(n);
            let taken = |(value, end): (&f64, &f64)| if i % 2 == 1 && *end < 0.5 { value.round() } else { *value };
            values.iter().zip(ends).map(taken).collect()
        };
        let mut rows: Vec<Vec<f64>> = if n <= MOST_WITH_CORNERS { design::corners(n) } else { Vec::new() };
        rows.extend(drawn.into_iter().enumerate().map(at));
        rows
    }

    /// Place of a condition (SI) between the ends of the ranges, by their spacing: one value in [0, 1] per varied variable.
    pub fn place(&self, condition: &[f64]) -> Vec<f64> {
        self.axes.iter().map(|a| a.spacing.unit(condition[a.variable], a.low, a.high)).collect()
    }

    /// The condition at such a place, as it is typed: one value per variable in its own unit.
    pub fn condition(&self, place: &[f64], variables: &[DescribedVariable]) -> Vec<f64> {
        let mut row = self.base.clone();
        for (axis, unit) in self.axes.iter().zip(place) {
            row[axis.variable] = axis.spacing.value(*unit, axis.low, axis.high);
        }
        row.iter().zip(variables).map(|(si, variable)| typed(*si, variable)).collect()
    }
}

/// The value in the variable's unit, rounded to twelve digits.
pub(super) fn typed(si: f64, variable: &DescribedVariable) -> f64 {
    let shown = units::express(si, &variable.unit, variable.dimension).ok().and_then(|v| format!("{v:.11e}").parse().ok());
    shown.unwrap_or(f64::NAN)
}

/// A typed value in SI.
pub(super) fn in_si(shown: f64, variable: &DescribedVariable) -> f64 {
    units::convert(shown, &variable.unit, variable.dimension).unwrap_or(f64::NAN)
}
