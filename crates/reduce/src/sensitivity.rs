//! Sensitivity of readings: slopes along variables and parameters, and their spread over all open parameters (Monte
//! Carlo).

use rayon::prelude::*;

use super::model::ReducedModel;
use coldplate_base::error::{Error, Result};
use coldplate_base::progress::Silent;
use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_network::{Load, Network};
use coldplate_solve::sensitivity::{OpenParameter, Scale};
use coldplate_solve::{Solver, SteadySettings};

/// Half the step of a difference quotient, as a share of the range. Chosen: smaller loses digits to the solver's
/// tolerance, larger to curvature.
const STEP: f64 = 0.01;
/// Shares of the draws below the two ends of a 95 % interval, dimensionless.
const ENDS: [f64; 2] = [0.025, 0.975];
/// Share of the draws that must have a steady state, dimensionless. Chosen: with fewer, mean and interval would be
/// those of the solvable machines only.
const ENOUGH: f64 = 0.5;

/// Slopes of the readings.
#[derive(Debug, Clone, PartialEq)]
pub struct Slopes {
    /// Readings at the condition, K.
    pub readings: Vec<f64>,
    /// Slopes per varying variable, given by its index: change of every reading per SI unit of it.
    pub variables: Vec<(usize, Vec<f64>)>,
    /// Slopes per parameter: change of every reading per unit of it.
    pub parameters: Vec<Vec<f64>>,
}

/// A reading over the draws.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReadingSpread {
    /// Mean, K.
    pub mean: f64,
    /// Standard deviation, K.
    pub deviation: f64,
    /// Interval that holds the middle 95 % of the draws, K.
    pub interval: (f64, f64),
    /// Largest bound over the draws on the difference from the full model, K; zero if these were solved in full.
    pub bound: f64,
}

/// Readings over draws of the parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Spreads {
    /// Sensor by sensor.
    pub readings: Vec<ReadingSpread>,
    /// Draws with a steady state.
    pub draws: usize,
    /// Draws without one.
    pub failed: usize,
}

impl ReducedModel {
    /// Slopes at a condition, by differences of the reduced model.
    ///
    /// # Errors
    /// No steady state is found at the condition, or beside it.
    pub fn slopes(&self, condition: &Condition) -> Result<Slopes> {
        let nominal: Vec<f64> = self.parameters.iter().map(|p| p.nominal).collect();
        let readings = self.steady(condition, &[])?.finer;
        let between = |places: [(Condition, Vec<f64>); 2], step: f64| -> Result<Vec<f64>> {
            let [low, high] = places;
            let (low, high) = (self.steady(&low.0, &low.1)?.finer, self.steady(&high.0, &high.1)?.finer);
            Ok(high.iter().zip(low).map(|(h, l)| (h - l) / (2.0 * step)).collect())
        };
        let variable = |v: usize| {
            let (low, high) = self.ranges[v];
            let step = STEP * (high - low);
            let moved = |by: f64| {
                let mut si = condition.si().to_vec();
                si[v] += by;
                (Condition::from_si(si), Vec::new())
            };
            Ok((v, between([moved(-step), moved(step)], step)?))
        };
        let parameter = |p: usize| {
            let step = STEP * (self.parameters[p].high - self.parameters[p].low);
            let moved = |by: f64| {
                let mut values = nominal.clone();
                values[p] += by;
                (condition.clone(), values)
            };
            between([moved(-step), moved(step)], step)
        };
        let varied = (0..self.ranges.len()).filter(|v| self.ranges[*v].1 > self.ranges[*v].0);
        Ok(Slopes {
            readings,
            variables: varied.map(variable).collect::<Result<_>>()?,
            parameters: (0..self.parameters.len()).map(parameter).collect::<Result<_>>()?,
        })
    }

    /// Readings at a condition over `draws` draws of the parameters. Each is drawn about its value in the file with the
    /// stated standard deviation, within its range. If a full network is given, every draw is solved on it.
    ///
    /// # Errors
    /// The model has no parameters, or hardly any draw has a steady state.
    pub fn spreads(&self, condition: &Condition, draws: usize, seed: u64, full: Option<&Network>) -> Result<Spreads> {
        if self.parameters.is_empty() {
            return Err(Error::input("no number of this model may vary").help("make it with `coldplate reduce --uncertain`"));
        }
        let mut random = Random::new(seed);
        let drawn: Vec<Vec<f64>> = (0..draws).map(|_| self.parameters.iter().map(|p| draw(p, &mut random)).collect()).collect();
        let found: Vec<Option<(Vec<f64>, Vec<f64>)>> = match full {
            None => drawn.par_iter().map(|values| self.steady(condition, values).ok().map(|a| (a.readings, a.bounds))).collect(),
            Some(network) => {
                let load = Load::at(&self.machine, condition)?;
                let center = Solver::new(network, &load)?.steady(&load)?.temperatures;
                drawn.par_iter().map(|values| self.in_full(network, &load, &center, values).ok()).collect()
            }
        };
        let known: Vec<&(Vec<f64>, Vec<f64>)> = found.iter().flatten().collect();
        if (known.len() as f64) < (ENOUGH * draws as f64).max(2.0) {
            let what = format!("only {} of {draws} draws have a steady state", known.len());
            return Err(Error::numerics(what).help("narrow what is open in the machine file"));
        }
        let sensors = known.first().map_or(0, |(readings, _)| readings.len());
        Ok(Spreads { readings: (0..sensors).map(|s| spread(&known, s)).collect(), draws: known.len(), failed: draws - known.len() })
    }

    /// Readings of a full network with these values in it, and bounds of zero.
    fn in_full(&self, network: &Network, load: &Load, near: &[f64], values: &[f64]) -> Result<(Vec<f64>, Vec<f64>)> {
        let (mut own, mut load) = (network.clone(), load.clone());
        for (parameter, value) in self.parameters.iter().zip(values) {
            parameter.set(*value, &self.machine, &mut own, &mut load);
        }
        let state = Solver::near(&own, &load, near.to_vec(), SteadySettings::default(), &Silent)?.steady(&load)?;
        let readings: Vec<f64> = own.sensors.iter().map(|s| s.read(&state.temperatures, &load)).collect();
        let bounds = vec![0.0; readings.len()];
        Ok((readings, bounds))
    }
}

/// A random value of a parameter: normal on its scale, and within its range.
fn draw(parameter: &OpenParameter, random: &mut Random) -> f64 {
    let (nominal, relative) = (parameter.nominal, parameter.deviation / parameter.nominal);
    let z = random.normal();
    let value = match parameter.scale {
        Scale::Linear => nominal + parameter.deviation * z,
        Scale::Log => nominal * (relative * z).exp(),
        Scale::Reciprocal => nominal / (1.0 + relative * z).max(f64::MIN_POSITIVE),
    };
    value.clamp(parameter.low, parameter.high)
}

fn spread(known: &[&(Vec<f64>, Vec<f64>)], sensor: usize) -> ReadingSpread {
    let mut values: Vec<f64> = known.iter().map(|(readings, _)| readings[sensor]).collect();
    values.sort_by(f64::total_cmp);
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let at = |share: f64| {
        let place = share * (count - 1.0);
        let (below, part) = (place.floor() as usize, place.fract());
        values[below] + part * (values[(below + 1).min(values.len() - 1)] - values[below])
    };
    let bound = known.iter().map(|(_, bounds)| bounds[sensor]).fold(0.0, f64::max);
    ReadingSpread { mean, deviation: variance.sqrt(), interval: (at(ENDS[0]), at(ENDS[1])), bound }
}
