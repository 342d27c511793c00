//! Steady states and predictions of tables: at distinct conditions, begun beside those of a machine much like it.

use rayon::prelude::*;

use super::prediction::{Prediction, own_key, surroundings_slope};
use crate::measurement::Data;
use crate::measurement::whiten::places;
use coldplate_base::error::Result;
use coldplate_describe::machine::{Condition, SensorResponse};
use coldplate_network::Load;
use coldplate_solve::Nearby;
use coldplate_solve::sensitivity::{DerivativeTarget, Derivatives, Variation};
use coldplate_solve::study::{MachineParameter, StateTables, Study};

/// Error allowed in the temperatures of a steady state that begins near another one, K. Chosen: slopes are differences of such
/// temperatures.
const STEADY_TOLERANCE: f64 = 2e-5;
/// Error allowed in the temperatures of states at which derivatives are taken, K. Chosen smaller than for predictions alone.
const STATE_TOLERANCE: f64 = 1e-6;

/// Distinct conditions of the data, and the index of each row's condition among them.
pub fn conditions(data: &Data) -> (Vec<Condition>, Vec<usize>) {
    let mut distinct: Vec<Condition> = Vec::new();
    let index = data
        .rows
        .iter()
        .map(|row| {
            distinct.iter().position(|c| *c == row.condition).unwrap_or_else(|| {
                distinct.push(row.condition.clone());
                distinct.len() - 1
            })
        })
        .collect();
    (distinct, index)
}

/// A steady state with its derivatives at each condition, solved from the temperatures `near` of a machine much like this one
/// if both have as many nodes.
///
/// # Errors
/// Errors of [`Study::at`].
pub fn states<'a>(study: &'a Study, conditions: &[Condition], near: &[Vec<f64>]) -> Result<Vec<Derivatives<'a>>> {
    let Some(first) = conditions.first() else { return Ok(Vec::new()) };
    if study.tables == StateTables::InFull {
        let solver = study.model.solver(first)?;
        return conditions.par_iter().map(|c| Derivatives::new(study, c, &study.model.solve(&solver, c)?)).collect();
    }
    let loads: Vec<Load> = conditions.iter().map(|c| Load::at(&study.model.machine, c)).collect::<Result<_>>()?;
    let fields = fields(study, conditions, &loads, near, STATE_TOLERANCE)?;
    conditions.par_iter().zip(&fields).map(|(c, field)| Derivatives::at(study, c, field)).collect()
}

/// Temperatures of all nodes at each condition, K.
fn fields(study: &Study, conditions: &[Condition], loads: &[Load], near: &[Vec<f64>], within: f64) -> Result<Vec<Vec<f64>>> {
    let (model, tables) = (&study.model, study.tables);
    let near = if near.len() == loads.len() && near.iter().all(|field| field.len() == model.network.nodes) { near } else { &[] };
    match (near.first(), tables) {
        (Some(first), _) => {
            let nearby = Nearby::new(&model.network, &loads[0], first.clone())?;
            if tables == StateTables::Reduced {
                return nearby.table(loads, &near.iter().map(Vec::as_slice).collect::<Vec<_>>(), within);
            }
            loads.par_iter().zip(near).map(|(load, from)| nearby.temperatures(load, from, within)).collect()
        }
        (None, StateTables::Reduced) => {
            let solver = model.solver(&conditions[0])?;
            let first = solver.steady(&loads[0])?.temperatures;
            let mut found = vec![first.clone()];
            let others = &loads[1..];
            found.extend(Nearby::of(solver).table(others, &vec![first.as_slice(); others.len()], within)?);
            Ok(found)
        }
        (None, StateTables::InFull) => {
            let solver = model.solver(&conditions[0])?;
            loads.par_iter().map(|load| Ok(solver.steady(load)?.temperatures)).collect()
        }
    }
}

/// Predictions of a steady table, and the temperatures of every node at each distinct condition, K; solved from the
/// temperatures `near` of a machine much like this one if both have as many nodes.
///
/// # Errors
/// The machine cannot be solved at a condition.
pub fn steady_near(study: &Study, data: &Data, near: &[Vec<f64>]) -> Result<(Vec<f64>, Vec<Vec<f64>>)> {
    steady_within(study, data, near, STEADY_TOLERANCE)
}

/// Predictions and temperatures as of [`steady_near`], to about `within` kelvin at every node if tables are solved on the
/// reduced model.
///
/// # Errors
/// The machine cannot be solved at a condition.
pub fn steady_within(study: &Study, data: &Data, near: &[Vec<f64>], within: f64) -> Result<(Vec<f64>, Vec<Vec<f64>>)> {
    let (distinct, index) = conditions(data);
    let model = &study.model;
    let loads: Vec<Load> = distinct.iter().map(|c| Load::at(&model.machine, c)).collect::<Result<_>>()?;
    let fields = fields(study, &distinct, &loads, near, within)?;
    let read = |(field, load): (&Vec<f64>, &Load)| -> Vec<f64> {
        let places = model.network.sensors.iter().zip(&model.machine.sensors);
        places.map(|(at, s)| s.shows.settled(at.read(field, load), load.chamber)).collect()
    };
    let found: Vec<Vec<f64>> = fields.iter().zip(&loads).map(read).collect();
    Ok((places(data).into_iter().map(|(r, k)| found[index[r]][data.sensors[k]]).collect(), fields))
}

/// Predictions and slopes of a steady table; without `with_conditions` the slopes with respect to the condition variables are left out.
pub(super) fn steady(study: &Study, data: &Data, parameters: &[MachineParameter], with_conditions: bool) -> Result<Prediction> {
    let (distinct, index) = conditions(data);
    let variables = if with_conditions { study.model.machine.variables.as_slice() } else { &[] };
    let variables = variables.iter().map(|v| study.parameter(&v.name)).collect::<Result<Vec<_>>>()?;
    let all: Vec<&MachineParameter> = parameters.iter().chain(&variables).collect();
    let variations: Vec<Variation> = all.par_iter().map(|p| study.variation(p)).collect::<Result<_>>()?;
    let targets: Vec<DerivativeTarget> = data.sensors.iter().map(|s| DerivativeTarget::Sensor(*s)).collect();
    if variations.is_empty() {
        let (values, _) = steady_near(study, data, &[])?;
        let none = vec![Vec::new(); values.len()];
        return Ok(Prediction { values, slopes: none.clone(), conditions: none });
    }
    let points = states(study, &distinct, &[])?;
    let sensors = &study.model.network.sensors;
    let responses: Vec<SensorResponse> = data.sensors.iter().map(|s| study.model.machine.sensors[*s].shows).collect();
    let own: Vec<Option<(usize, String)>> = all.iter().map(|p| own_key(p, data)).collect();
    let shown =
        |temperatures: &[f64], around: f64| responses.iter().zip(temperatures).map(|(r, t)| r.settled(*t, around)).collect::<Vec<f64>>();
    let at = |point: &Derivatives<'_>| -> Result<(Vec<f64>, Vec<Vec<f64>>)> {
        let read: Vec<f64> = data.sensors.iter().map(|s| sensors[*s].read(&point.state.solution.temperatures, &point.state.load)).collect();
        let mut slopes = point.jacobian_of(&targets, &variations)?.slopes;
        let around = point.state.load.chamber;
        let condition = Condition::from_si(point.state.load.variables.clone());
        let of_surroundings = all.iter().map(|p| surroundings_slope(study, p, &condition)).collect::<Result<Vec<f64>>>()?;
        for (k, row) in slopes.iter_mut().enumerate() {
            for ((slope, own), of_surroundings) in row.iter_mut().zip(&own).zip(&of_surroundings) {
                *slope = *slope * responses[k].of_place() + responses[k].of_surroundings() * of_surroundings;
                if let Some((_, key)) = own.as_ref().filter(|(sensor, _)| *sensor == k) {
                    *slope += responses[k].slope(key, read[k], around).unwrap_or(0.0);
                }
            }
        }
        Ok((shown(&read, around), slopes))
    };
    let found: Vec<(Vec<f64>, Vec<Vec<f64>>)> = points.par_iter().map(at).collect::<Result<_>>()?;
    let p = parameters.len();
    let mut prediction = Prediction { values: Vec::new(), slopes: Vec::new(), conditions: Vec::new() };
    for (r, k) in places(data) {
        let (values, slopes) = &found[index[r]];
        prediction.values.push(values[k]);
        prediction.slopes.push(slopes[k][..p].to_vec());
        prediction.conditions.push(slopes[k][p..].to_vec());
    }
    Ok(prediction)
}
