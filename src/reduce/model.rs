//! Answers of a reduced model, each with a bound.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::field::Field;
use super::level::{Level, Reduced};
use crate::describe::machine::{Condition, Machine};
use crate::discretise::network::{Load, Network};
use crate::error::Result;
use crate::solve::sensitivity::OpenParameter;

/// A machine as two reduced networks, one of them finer than the other.
#[derive(Debug, Clone)]
pub struct ReducedModel {
    /// The machine.
    pub machine: Machine,
    /// Parameters that may be given other values than the file's.
    pub parameters: Vec<OpenParameter>,
    /// What the file leaves open and no network takes another value of.
    pub left_out: Vec<String>,
    /// Range of each variable of the machine (SI) in which the model was trained.
    pub ranges: Vec<(f64, f64)>,
    /// The reduced network that answers in steady state; over time the bound is from it.
    pub coarse: Level,
    /// The one that the bound is from in steady state; over time it answers.
    pub fine: Level,
    /// What the bound adds to the difference of the two: a share of the largest difference of all readings.
    pub margin: f64,
    /// What it adds beside, K: the least bound.
    pub floor: f64,
    /// How it does in time, where it was made for that.
    pub in_time: Option<InTime>,
    /// The temperatures of all nodes, where it was made for that.
    pub field: Option<Field>,
    /// How it was made.
    pub made: Made,
}

/// How a reduced model was made.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Made {
    /// Conditions solved in full to make it.
    pub solved: usize,
    /// Conditions at which the full model found no steady state.
    pub failed: usize,
    /// Further random conditions solved in full to calibrate the bound.
    pub checks: usize,
    /// Largest error at those, K.
    pub largest_error: f64,
    /// Largest bound at those, K.
    pub largest_bound: f64,
    /// Cells of the full model.
    pub cells: usize,
    /// Its nodes.
    pub nodes: usize,
    /// Its conductors that follow the temperature or the surroundings.
    pub conductors: usize,
    /// Seconds that it took.
    pub seconds: f64,
}

/// How a reduced model does in time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InTime {
    /// What the bound adds to the difference of the two networks: a share of the largest difference so far.
    pub margin: f64,
    /// The least bound, K.
    pub floor: f64,
    /// Histories that the modes are from.
    pub histories: usize,
    /// Further ones that the bound was calibrated on.
    pub checks: usize,
    /// Largest error at those, K.
    pub largest_error: f64,
    /// Largest bound at those, K.
    pub largest_bound: f64,
}

impl InTime {
    /// How far readings of the finer network may be from those of the full model, K, time by time.
    pub fn bounds(&self, readings: &[Vec<f64>], coarser: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut largest: f64 = 0.0;
        let at = |(fine, coarse): (&Vec<f64>, &Vec<f64>)| {
            let differences: Vec<f64> = fine.iter().zip(coarse).map(|(f, c)| (f - c).abs()).collect();
            largest = differences.iter().copied().fold(largest, f64::max);
            differences.iter().map(|d| d + self.margin * largest + self.floor).collect()
        };
        readings.iter().zip(coarser).map(at).collect()
    }
}

/// The readings at one condition.
#[derive(Debug, Clone)]
pub struct Answer {
    /// Readings of all sensors, K.
    pub readings: Vec<f64>,
    /// How far each may be from that of the full model, K.
    pub bounds: Vec<f64>,
    /// Whether condition and parameters are within the ranges of the training.
    pub in_range: bool,
    /// State of the finer reduced network.
    pub state: Reduced,
    /// Its readings, K.
    pub finer: Vec<f64>,
    /// Streams whose wall boils, by their places, each with the temperature of its hottest wall, K.
    pub boiling: Vec<(usize, f64)>,
}

impl ReducedModel {
    /// The steady state at a condition, with values of the parameters in their order (empty: the file's).
    ///
    /// # Errors
    /// The condition cannot be evaluated, or no steady state is found.
    pub fn steady(&self, condition: &Condition, parameters: &[f64]) -> Result<Answer> {
        let load = Load::at(&self.machine, condition)?;
        let solve = |level: &Level, start: &DVector<f64>| -> Result<Solved> {
            if parameters.is_empty() {
                let state = level.steady(&level.network, &load, start)?;
                let readings = level.read(&level.network, &load, &state);
                let boiling = boiling(&level.network, &state);
                return Ok((state, readings, boiling));
            }
            let (mut network, mut load) = (level.network.clone(), load.clone());
            for (parameter, value) in self.parameters.iter().zip(parameters) {
                parameter.set(*value, &self.machine, &mut network, &mut load);
            }
            let state = level.steady(&network, &load, start)?;
            let readings = level.read(&network, &load, &state);
            let boiling = boiling(&network, &state);
            Ok((state, readings, boiling))
        };
        let (coarse, readings, _) = solve(&self.coarse, &DVector::zeros(self.coarse.len()))?;
        // The first modes of both are the same; where histories have added others, this is a start like any other.
        let near = coarse.amplitudes.resize_vertically(self.fine.len(), 0.0);
        let (state, finer, boiling) = solve(&self.fine, &near)?;
        let bounds = self.bounds(&readings, &finer);
        let in_range = self.is_inside(condition) && parameters.iter().zip(&self.parameters).all(|(x, p)| is_within(*x, (p.low, p.high)));
        Ok(Answer { readings, bounds, in_range, state, finer, boiling })
    }

    /// Whether a condition is within the ranges of the training.
    pub fn is_inside(&self, condition: &Condition) -> bool {
        condition.si().iter().zip(&self.ranges).all(|(x, range)| is_within(*x, *range))
    }

    /// How far the readings of the coarser network may be from those of the full model, K.
    pub(super) fn bounds(&self, readings: &[f64], finer: &[f64]) -> Vec<f64> {
        let differences: Vec<f64> = readings.iter().zip(finer).map(|(r, f)| (r - f).abs()).collect();
        let largest = differences.iter().fold(0.0, |m: f64, d| m.max(*d));
        differences.iter().map(|d| d + self.margin * largest + self.floor).collect()
    }
}

/// A reduced network's state, its readings, and the streams whose wall boils.
type Solved = (Reduced, Vec<f64>, Vec<(usize, f64)>);

/// Streams whose wall boils, each with its hottest wall, K.
fn boiling(network: &Network, state: &Reduced) -> Vec<(usize, f64)> {
    let wall = |(s, stream)| Some((s, network.boiling_wall(s, stream, &state.temperatures)?));
    state.streams.iter().enumerate().filter_map(wall).collect()
}

/// Whether a value is in a range, but for rounding.
fn is_within(x: f64, (low, high): (f64, f64)) -> bool {
    let slack = 1e-9 * (high - low).abs().max(high.abs());
    (low - slack..=high + slack).contains(&x)
}
