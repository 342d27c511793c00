//! Answers of a reduced model, each with a bound.

use crate::bound::ReadingBound;
use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::fields::ModeField;
use super::reduced_network::{ReducedNetwork, ReducedState};
use coldplate_base::error::{Error, Result};
use coldplate_base::units::Measurand;
use coldplate_describe::machine::{Condition, Machine};
use coldplate_network::{Load, Network};
use coldplate_solve::sensitivity::OpenParameter;

/// Most variables whose corners are all looked at, a count. Chosen: the number of corners doubles with each.
const MOST_CORNERED: usize = 6;

/// A machine as two reduced networks, one finer than the other.
#[derive(Debug, Clone)]
pub struct ReducedModel {
    /// The machine.
    pub machine: Machine,
    /// Parameters that may take other values than those of the machine file.
    pub parameters: Vec<OpenParameter>,
    /// Names of the parameters that the machine file leaves open but that stay at the file's value, because a network
    /// cannot take another one without being made anew.
    pub left_out: Vec<String>,
    /// Range of each variable of the machine, SI, in which the model was trained.
    pub ranges: Vec<(f64, f64)>,
    /// The coarser reduced network. In steady state it gives the readings, over time the comparison that the bound is
    /// made of.
    pub coarse: ReducedNetwork,
    /// The finer reduced network. In steady state it gives the comparison that the bound is made of, over time the
    /// readings.
    pub fine: ReducedNetwork,
    /// Margin of the bound, dimensionless: bound = |coarse - fine| + `margin` · (largest |coarse - fine| of all
    /// readings) + `floor`.
    pub margin: f64,
    /// Constant term of the bound, K: no bound is smaller.
    pub floor: f64,
    /// Bound over time, if the model was made with histories.
    pub in_time: Option<HistoryBound>,
    /// Reason why a model that was to be made with histories cannot follow time; not kept in the file.
    pub untimed: Option<String>,
    /// Modes at all nodes, if the model was made with its field.
    pub field: Option<ModeField>,
    /// Record of how the model was made.
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
    /// Largest error of a reading at the conditions of the calibration, K.
    pub largest_error: f64,
    /// Largest bound of a reading at the conditions of the calibration and at further ones without a full solve, K.
    pub largest_bound: f64,
    /// Cells of the full model.
    pub cells: usize,
    /// Nodes of the full model.
    pub nodes: usize,
    /// Conductors of the full model that follow the temperature or the surroundings.
    pub conductors: usize,
    /// Time taken to make the model, s. Not in a file, so that two runs write the same bytes; 0 for a model that was read.
    #[serde(skip)]
    pub seconds: f64,
}

/// Bound of a reduced model over time, and the histories it was calibrated on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HistoryBound {
    /// Margin of the bound, dimensionless: a reading's bound is the difference of the two networks there, plus this
    /// share of the largest difference so far, plus `floor`.
    pub margin: f64,
    /// Constant term of the bound, K: no bound is smaller.
    pub floor: f64,
    /// Number of histories that contributed modes.
    pub histories: usize,
    /// Number of further histories that the bound was calibrated on.
    pub checks: usize,
    /// Largest error of a reading in the histories of the calibration, K.
    pub largest_error: f64,
    /// Largest bound of a reading in the histories of the calibration, K.
    pub largest_bound: f64,
}

impl HistoryBound {
    /// Bounds on the difference of the finer network's readings from the full model's, K, time by time.
    pub fn bounds(&self, readings: &[Vec<f64>], coarser: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut bound = ReadingBound::new(self.margin, self.floor);
        readings.iter().zip(coarser).map(|(fine, coarse)| bound.of(fine, coarse)).collect()
    }
}

/// The readings at one condition.
#[derive(Debug, Clone)]
pub struct ReducedAnswer {
    /// Readings of all sensors, K.
    pub readings: Vec<f64>,
    /// Bound on the difference of each reading from the full model's, K.
    pub bounds: Vec<f64>,
    /// Whether condition and parameters are within the ranges of the training.
    pub in_range: bool,
    /// State of the finer reduced network.
    pub state: ReducedState,
    /// Readings of the finer network, K.
    pub finer: Vec<f64>,
    /// Streams whose wall boils: index and temperature of the hottest wall, K.
    pub boiling: Vec<(usize, f64)>,
}

impl ReducedAnswer {
    /// Largest bound of a reading, K.
    pub(super) fn largest_bound(&self) -> f64 {
        self.bounds.iter().fold(0.0, |most: f64, bound| most.max(*bound))
    }
}

impl ReducedModel {
    /// The steady state at a condition, with values of the parameters in their order (empty: the file's).
    ///
    /// # Errors
    /// The condition cannot be evaluated, or no steady state is found.
    pub fn steady(&self, condition: &Condition, parameters: &[f64]) -> Result<ReducedAnswer> {
        let load = Load::at(&self.machine, condition)?;
        let solve = |level: &ReducedNetwork, start: &DVector<f64>| -> Result<Solved> {
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
        // Both networks share their first modes, unless histories have added others: then this is a start like any
        // other.
        let near = coarse.amplitudes.resize_vertically(self.fine.len(), 0.0);
        let (state, finer, boiling) = solve(&self.fine, &near)?;
        let bounds = self.bounds(&readings, &finer);
        let in_range = self.is_inside(condition) && parameters.iter().zip(&self.parameters).all(|(x, p)| is_within(*x, p.low, p.high));
        Ok(ReducedAnswer { readings, bounds, in_range, state, finer, boiling })
    }

    /// Whether a condition is within the ranges of the training.
    pub fn is_inside(&self, condition: &Condition) -> bool {
        condition.si().iter().zip(&self.ranges).all(|(x, (low, high))| is_within(*x, *low, *high))
    }

    /// Coldest and hottest temperature (K) of the surroundings and of the steady readings at the corners of the ranges: the
    /// temperatures that the bound over time is known for. Of many variables, each end is taken with the others in the
    /// middle.
    ///
    /// # Errors
    /// A condition cannot be evaluated.
    pub fn temperature_range(&self) -> Result<(f64, f64)> {
        let middle: Vec<f64> = self.ranges.iter().map(|(low, high)| f64::midpoint(*low, *high)).collect();
        let varied: Vec<usize> = (0..self.ranges.len()).filter(|v| self.ranges[*v].1 > self.ranges[*v].0).collect();
        let end = |v: usize, is_high: bool| if is_high { self.ranges[v].1 } else { self.ranges[v].0 };
        let mut conditions = vec![middle.clone()];
        if varied.len() <= MOST_CORNERED {
            for corner in 0..1usize << varied.len() {
                let mut own = middle.clone();
                varied.iter().enumerate().for_each(|(bit, v)| own[*v] = end(*v, corner >> bit & 1 == 1));
                conditions.push(own);
            }
        } else {
            for (v, is_high) in varied.iter().flat_map(|v| [(*v, false), (*v, true)]) {
                let mut own = middle.clone();
                own[v] = end(v, is_high);
                conditions.push(own);
            }
        }
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for condition in conditions.into_iter().map(Condition::from_si) {
            let load = Load::at(&self.machine, &condition)?;
            // A corner at which the water boils has no steady state.
            let readings = self.steady(&condition, &[]).map(|answer| answer.finer).unwrap_or_default();
            let measured = readings.iter().zip(&self.machine.sensors).filter(|(_, s)| s.measurand() == Measurand::Temperature);
            for temperature in load.inlets.iter().copied().chain([load.chamber]).chain(measured.map(|(value, _)| *value)) {
                (low, high) = (low.min(temperature), high.max(temperature));
            }
        }
        Ok((low, high))
    }

    /// Temperatures of all nodes of the full network (K) in an answer at a condition.
    ///
    /// # Errors
    /// The model was made without its field, the condition cannot be evaluated, or the network is another one.
    pub fn temperatures(&self, answer: &ReducedAnswer, condition: &Condition, network: &Network) -> Result<Vec<f64>> {
        self.known_field()?.temperatures(&self.fine, &answer.state, network, &Load::at(&self.machine, condition)?)
    }

    /// Temperatures of all nodes of the full network (K) with amplitudes of the finer network's modes, as [`ReducedModel::course`]
    /// gives them. Water is taken as steady along its walls.
    ///
    /// # Errors
    /// Errors of [`ReducedModel::temperatures`].
    pub fn temperatures_with(&self, amplitudes: &DVector<f64>, condition: &Condition, network: &Network) -> Result<Vec<f64>> {
        let load = Load::at(&self.machine, condition)?;
        self.known_field()?.temperatures(&self.fine, &self.fine.state_with(&load, amplitudes)?, network, &load)
    }

    /// The field of the model.
    ///
    /// # Errors
    /// The model was made without it.
    pub fn known_field(&self) -> Result<&ModeField> {
        let missing =
            || Error::input("this reduced model knows its sensors, not its field").help("make it with `coldplate reduce --field`");
        self.field.as_ref().ok_or_else(missing)
    }

    /// Bounds on the difference of the coarser network's readings from the full model's, K.
    pub(super) fn bounds(&self, readings: &[f64], finer: &[f64]) -> Vec<f64> {
        ReadingBound::new(self.margin, self.floor).of(finer, readings)
    }
}

/// A reduced network's state, its readings, and the streams whose wall boils.
type Solved = (ReducedState, Vec<f64>, Vec<(usize, f64)>);

/// Streams whose wall boils: index and temperature of the hottest wall, K.
fn boiling(network: &Network, state: &ReducedState) -> Vec<(usize, f64)> {
    let wall = |(s, stream)| Some((s, network.boiling_wall(s, stream, &state.temperatures)?));
    state.streams.iter().enumerate().filter_map(wall).collect()
}

/// Whether a value is in a range, but for rounding.
fn is_within(x: f64, low: f64, high: f64) -> bool {
    let slack = 1e-9 * (high - low).abs().max(high.abs());
    (low - slack..=high + slack).contains(&x)
}
