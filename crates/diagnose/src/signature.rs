//! What each hypothesis would do to every reading, to first order.
//!
//! In steady state one adjoint field per reading gives every source, leak and link at once: the signature of a
//! hypothesis is a scalar product. Logs are in [`super::history`].

use std::sync::Arc;

use rayon::prelude::*;

use super::effects::{Change, Disturbances, EffectDerivatives, Hypothesis, Scales, Shares, UserKind};
use super::follow::Linear;
use coldplate_base::error::Result;
use coldplate_describe::machine::{Condition, SensorResponse};
use coldplate_evidence::identify::{Prediction, conditions, own_key, states, surroundings_slope};
use coldplate_evidence::measurement::{Data, whiten};
use coldplate_solve::sensitivity::{Adjoint, DerivativeTarget, Derivatives};
use coldplate_solve::study::{MachineParameter, StateTables, Study};

/// Relative residual of adjoint fields: causes are compared, and what is named is fitted.
const ADJOINT: f64 = 1e-9;
/// The same where only the covariance is made of them.
const ROUGH: f64 = 1e-6;

/// The machine as it is beside the data, and the slope of every hypothesis.
#[derive(Debug, Clone)]
pub struct Signatures {
    /// Readings less predictions, K.
    pub residual: Vec<f64>,
    /// Predictions of the machine as it is, and their slopes with respect to uncertain parameters and conditions.
    pub prediction: Prediction,
    /// Temperatures of all nodes at each distinct condition, K; none of logs.
    pub fields: Vec<Vec<f64>>,
    /// One column per hypothesis, K per unit of its amplitude; zeros where it does nothing.
    pub columns: Vec<Vec<f64>>,
    /// The machine linearised along the logs, where it was.
    pub linear: Option<Arc<Linear>>,
}

pub(super) fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Signatures in steady state, from the temperatures `near` of a machine much like this one, where there are any. Slopes with respect to
/// `uncertain` parameters and the condition variables are left out where there is no list of the former.
///
/// # Errors
/// The machine as it is cannot be solved at the data's conditions.
pub fn steady(
    study: &Study,
    data: &Data,
    uncertain: Option<&[MachineParameter]>,
    hypotheses: &[Hypothesis],
    (scales, user): (&Scales, &[UserKind]),
    near: Option<&[Vec<f64>]>,
) -> Result<Signatures> {
    let (distinct, index) = conditions(data);
    let states = states(study, &distinct, near.unwrap_or(&[]))?;
    // Beside a machine much like it only what is uncertain is asked for: how large it is, not which cause it is.
    let aim = if near.is_some() && study.tables == StateTables::Reduced { ROUGH } else { ADJOINT };
    let mut wanted: Vec<MachineParameter> = uncertain.unwrap_or_default().to_vec();
    let p = wanted.len();
    if uncertain.is_some() {
        let variables = study.model.machine.variables.iter().map(|v| study.parameter(&v.name));
        wanted.extend(variables.collect::<Result<Vec<_>>>()?);
    }
    let derivatives = EffectDerivatives::new(study, hypotheses, user);
    let responses: Vec<SensorResponse> = data.sensors.iter().map(|s| study.model.machine.sensors[*s].shows).collect();
    struct At {
        values: Vec<f64>,
        slopes: Vec<Vec<f64>>,
        effects: Vec<Vec<f64>>,
    }
    let of = |at: &Derivatives<'_>| -> Result<At> {
        let adjoints: Vec<Adjoint> =
            data.sensors.par_iter().map(|s| at.adjoint_within(DerivativeTarget::Sensor(*s), aim)).collect::<Result<_>>()?;
        let mut slopes = wanted
            .iter()
            .map(|p| {
                let partial = at.partial(p)?;
                Ok(adjoints.iter().map(|adjoint| at.against(adjoint, &partial)).collect())
            })
            .collect::<Result<Vec<Vec<f64>>>>()?;
        let screen = at.screen();
        let network = &study.model.network;
        let inlet = |k: usize| network.sensors[data.sensors[k]].inlet;
        let Disturbances { effects, shared } = derivatives.disturbances(at, &screen);
        let of_shared = |field: &Shares| -> Vec<f64> {
            adjoints.iter().map(|adjoint| -field.iter().map(|(node, heat)| adjoint.field[*node as usize] * heat).sum::<f64>()).collect()
        };
        let shared: Vec<Vec<f64>> = shared.par_iter().map(of_shared).collect();
        let on_all = |effect: Option<Change>| -> Vec<f64> {
            let on = |(k, adjoint): (usize, &Adjoint)| match &effect {
                Some(Change::Own(own)) => {
                    let r = &responses[k];
                    r.of_place() * own.on(&adjoint.field, inlet(k)) + r.of_surroundings() * own.surroundings
                }
                Some(Change::Shared(terms)) => {
                    responses[k].of_place() * terms.iter().map(|(field, coefficient)| coefficient * shared[*field][k]).sum::<f64>()
                }
                None => 0.0,
            };
            adjoints.iter().enumerate().map(on).collect()
        };
        let effects: Vec<Vec<f64>> = effects.into_par_iter().map(on_all).collect();
        let read = |s: &usize| network.sensors[*s].read(&at.state.solution.temperatures, &at.state.load);
        let temperatures: Vec<f64> = data.sensors.iter().map(read).collect();
        // What the sensors make of all that.
        let (around, condition) = (at.state.load.chamber, Condition::from_si(at.state.load.variables.clone()));
        for (row, p) in slopes.iter_mut().zip(&wanted) {
            let of_surroundings = surroundings_slope(study, p, &condition)?;
            row.iter_mut().zip(&responses).for_each(|(slope, r)| *slope = *slope * r.of_place() + r.of_surroundings() * of_surroundings);
            if let Some((k, key)) = own_key(p, data) {
                row[k] += responses[k].slope(&key, temperatures[k], around).unwrap_or(0.0);
            }
        }
        let values = responses.iter().zip(temperatures).map(|(r, t)| r.settled(t, around)).collect();
        Ok(At { values, slopes, effects })
    };
    let all: Vec<At> = states.par_iter().map(of).collect::<Result<_>>()?;
    let places = whiten::places(data);
    let pick = |which: std::ops::Range<usize>| -> Vec<Vec<f64>> {
        places.iter().map(|(r, k)| which.clone().map(|w| all[index[*r]].slopes[w][*k]).collect()).collect()
    };
    let prediction = Prediction {
        values: places.iter().map(|(r, k)| all[index[*r]].values[*k]).collect(),
        slopes: pick(0..p),
        conditions: pick(p..wanted.len()),
    };
    let column = |h: &Hypothesis| -> Vec<f64> {
        if h.is_sensor() {
            return difference(&h.read((scales, &study.model.machine), data, &prediction.values, 1.0), &prediction.values);
        }
        let Some(at) = derivatives.position(h) else { return vec![0.0; places.len()] };
        let factors = scales.factors(h.law, &data.rows.iter().map(|row| &row.condition).collect::<Vec<_>>());
        places.iter().map(|(r, k)| all[index[*r]].effects[at][*k] * factors[*r]).collect()
    };
    let columns = hypotheses.par_iter().map(column).collect();
    let fields = states.iter().map(|at| at.state.solution.temperatures.clone()).collect();
    Ok(Signatures { residual: difference(&whiten::readings(data), &prediction.values), prediction, fields, columns, linear: None })
}
