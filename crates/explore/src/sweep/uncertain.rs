//! Uncertain parameters of the machine of a sweep, and the note of them beside the slopes.

use std::collections::BTreeMap;

use coldplate_base::terms::MAX_PARAMETERS;
use serde::Serialize;

use super::definition::Openness;
use coldplate_base::error::{Error, Result};
use coldplate_base::units::express;
use coldplate_describe::machine::{DescribedVariable, ModelError};
use coldplate_solve::sensitivity::{OpenParameter, Origin, Scale};
use coldplate_solve::study::Study;

/// Key of the note in the provenance of a table of slopes.
const NOTE: &str = "uncertainty";

/// Uncertain parameters of a machine, and its model error.
#[derive(Debug, Clone)]
pub struct Open {
    /// Uncertain parameters.
    pub parameters: Vec<OpenParameter>,
    /// Correlations of the parameters.
    pub correlations: Vec<Vec<f64>>,
    /// Error of the model against measurements.
    pub model_error: ModelError,
}

/// The note, as the fit reads it.
#[derive(Serialize)]
struct Note<'a> {
    parameters: Vec<ParameterNote<'a>>,
    correlations: &'a [Vec<f64>],
    model_error: BTreeMap<&'a str, f64>,
    common: f64,
    growth: f64,
    measured: Vec<BTreeMap<&'a str, f64>>,
}

#[derive(Serialize)]
struct ParameterNote<'a> {
    name: &'a str,
    unit: &'a str,
    nominal: f64,
    deviation: f64,
    low: f64,
    high: f64,
    scale: &'static str,
    assumed: bool,
}

impl Open {
    /// Uncertain parameters of a machine that a sweep follows.
    ///
    /// # Errors
    /// Errors of [`Study::open_parameters`] and [`Study::correlations`].
    pub fn of(study: &Study, openness: Openness) -> Result<Self> {
        let parameters = match openness {
            Openness::None => Vec::new(),
            Openness::Stated => study.open_parameters(false)?,
            Openness::All => study.open_parameters(true)?,
        };
        if parameters.len() > MAX_PARAMETERS {
            return Err(Error::input(format!("a surrogate file holds at most {MAX_PARAMETERS} uncertain parameters"))
                .in_file(study.document().file())
                .read(parameters.len())
                .help("let some of them share a factor ([uncertain.NAME]), or write uncertainty = \"none\" into the sweep file"));
        }
        let correlations = if parameters.is_empty() { Vec::new() } else { study.correlations(&parameters)? };
        Ok(Self { parameters, correlations, model_error: study.model.machine.model_error.clone() })
    }

    /// Key and text of the note; `sensors` are the outputs' names and `variables` those of the conditions.
    ///
    /// # Errors
    /// A unit of a variable that cannot be expressed.
    pub(super) fn note(&self, sensors: &[(String, String)], variables: &[DescribedVariable]) -> Result<(String, String)> {
        let parameters = self.parameters.iter().map(|p| ParameterNote {
            name: &p.name,
            unit: &p.unit,
            nominal: p.nominal,
            deviation: p.deviation,
            low: p.low,
            high: p.high,
            scale: match p.scale {
                Scale::Linear => "linear",
                Scale::Log => "log",
                Scale::Reciprocal => "reciprocal",
            },
            assumed: p.origin == Origin::Assumed,
        });
        let measured = self.model_error.measured.iter().map(|row| {
            let values = row.iter().zip(variables).map(|(si, v)| Ok((v.name.as_str(), express(*si, &v.unit, v.dimension)?)));
            values.collect::<Result<BTreeMap<&str, f64>>>()
        });
        let note = Note {
            parameters: parameters.collect(),
            correlations: &self.correlations,
            model_error: sensors.iter().map(|(name, _)| name.as_str()).zip(self.model_error.sensors.iter().copied()).collect(),
            common: self.model_error.common,
            growth: self.model_error.growth,
            measured: measured.collect::<Result<_>>()?,
        };
        Ok((NOTE.into(), serde_json::to_string(&note).unwrap_or_default()))
    }
}
