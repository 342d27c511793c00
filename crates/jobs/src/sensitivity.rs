//! Sensitivities at one condition: derivatives of every reading with respect to variables and numbers of the machine
//! file.

use serde_json::{Map, Value, json};

use coldplate_base::error::Result;
use coldplate_base::units::{Celsius, Kelvin};
use coldplate_describe::machine::Condition;
use coldplate_solve::sensitivity::{DerivativeTable, DerivativeTarget, Derivatives, UNEVEN};
use coldplate_solve::study::{MachineParameter, ParameterKind, Study};

/// A reading.
pub struct SensitivityRow {
    /// Target that is read.
    pub target: DerivativeTarget,
    /// Name of the reading.
    pub name: String,
    /// Value of the reading: degC, or K for a difference.
    pub value: f64,
    /// Whether the value is a temperature, not a difference.
    pub is_absolute: bool,
}

/// Readings at one condition, and their derivatives.
pub struct Sensitivities<'s> {
    /// The state that the derivatives are taken at.
    pub at: Derivatives<'s>,
    /// Readings.
    pub rows: Vec<SensitivityRow>,
    /// Parameters of the derivatives.
    pub parameters: Vec<MachineParameter>,
    /// Derivatives, a row for each reading.
    pub found: DerivativeTable,
}

impl<'s> Sensitivities<'s> {
    /// Derivatives of readings (sensors, limits, outlets of channels; empty: all sensors) with respect to variables and numbers of
    /// the machine file (empty: all variables, contact conductances, emissivities and sources).
    ///
    /// # Errors
    /// A name is neither a variable nor a number of the machine file, or there is no steady state.
    pub fn of(study: &'s Study, condition: &Condition, readings: &[String], by: &[String]) -> Result<Self> {
        let parameters = if by.is_empty() {
            study.usual_parameters()
        } else {
            by.iter().map(|name| study.parameter(name)).collect::<Result<Vec<_>>>()?
        };
        let at = study.at(condition)?;
        let targets =
            if readings.is_empty() { study.sensors() } else { readings.iter().map(|name| at.target(name)).collect::<Result<Vec<_>>>()? };
        let found = at.jacobian(&targets, &parameters)?;
        let rows = targets.iter().map(|target| row(&at, *target)).collect();
        Ok(Self { at, rows, parameters, found })
    }

    /// The record for outside programs; `seconds` is the time taken.
    pub fn record(&self, seconds: f64) -> Value {
        let Self { at, rows, parameters, found } = self;
        let described: Map<String, Value> = parameters
            .iter()
            .zip(found.idle.iter().zip(&found.uneven))
            .map(|(p, (idle, uneven))| {
                let value = at.value_of(p);
                let entry = json!({
                    "kind": kind(p),
                    "value": p.shown(value),
                    "unit": p.unit,
                    "value_SI": value,
                    "idle": idle,
                    "at_a_kink": *uneven > UNEVEN,
                });
                (p.name.clone(), entry)
            })
            .collect();
        let of_row = |(row, slopes): (&SensitivityRow, &Vec<f64>)| {
            let slopes: Map<String, Value> = parameters
                .iter()
                .zip(slopes)
                .map(|(p, slope)| {
                    let entry = json!({
                        "K_per_unit": p.per_unit(*slope),
                        "K_per_SI_unit": slope,
                        "K_per_percent": p.per_percent(*slope, at.value_of(p)),
                    });
                    (p.name.clone(), entry)
                })
                .collect();
            let what = match row.target {
                DerivativeTarget::Sensor(_) => "sensor",
                DerivativeTarget::Outlet(_) => "outlet",
                DerivativeTarget::Limit(_) => "limit",
            };
            (row.name.clone(), json!({ "is": what, if row.is_absolute { "degC" } else { "K" }: row.value, "slopes": slopes }))
        };
        let readings: Map<String, Value> = rows.iter().zip(&found.slopes).map(of_row).collect();
        json!({ "readings": readings, "parameters": described, "unknowns": at.study.model.network.nodes, "seconds": { "total": seconds } })
    }
}

fn row(at: &Derivatives<'_>, target: DerivativeTarget) -> SensitivityRow {
    let (model, state) = (&at.study.model, &at.state);
    match target {
        DerivativeTarget::Sensor(s) => {
            let value = model.network.measurands[s].shown(model.network.sensors[s].read(&state.solution.temperatures, &state.load));
            SensitivityRow { target, name: model.network.sensor_names[s].clone(), value, is_absolute: true }
        }
        DerivativeTarget::Outlet(s) => {
            let stream = &model.network.streams[s];
            let value = Celsius::from(Kelvin(state.solution.temperatures[stream.outlet() as usize])).0;
            SensitivityRow { target, name: format!("outlet of {}", stream.name), value, is_absolute: true }
        }
        DerivativeTarget::Limit(l) => {
            let limit = &model.limits(state)[l];
            let value = limit.shown(limit.value);
            SensitivityRow { target, name: format!("limit {}", limit.name), value, is_absolute: limit.is_absolute }
        }
    }
}

fn kind(parameter: &MachineParameter) -> &'static str {
    match parameter.kind {
        ParameterKind::Condition => "condition",
        ParameterKind::Quantity => "quantity",
        ParameterKind::Factor => "factor",
        ParameterKind::Offset => "offset",
    }
}
