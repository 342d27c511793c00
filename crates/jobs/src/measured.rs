//! The machine's measured states, solved in full and laid beside the readings.

use coldplate_runtime::NINETY_FIVE;

use coldplate_base::error::Result;
use coldplate_base::units::express;
use coldplate_describe::machine::{Condition, DescribedVariable, Machine, Measurement, Sensor};
use coldplate_figures::chart::heat::HeatFigure;
use coldplate_figures::chart::measured::{MeasuredFigure, SensorRow};
use coldplate_figures::chart::style::Quantity;
use coldplate_solve::meshed::{MeshedMachine, SteadyState};
use coldplate_solve::sensitivity::Derivatives;
use coldplate_solve::study::Study;

/// A measured state beside its prediction.
#[derive(Debug)]
pub struct CheckedState {
    /// Name of the machine.
    pub machine: String,
    /// Name of the measurement.
    pub name: String,
    /// The condition in words.
    pub condition: String,
    /// Remarks on the readings.
    pub note: String,
    /// One per reading.
    pub rows: Vec<CheckedReading>,
    /// Readings beside predictions.
    pub figure: MeasuredFigure,
    /// Heat balance of the state.
    pub heat: HeatFigure,
    /// Heat in, heat out (W), relative imbalance.
    pub balance: (f64, f64, f64),
}

/// A reading beside its prediction.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckedReading {
    /// Name of the sensor.
    pub name: String,
    /// Reading, degC.
    pub measured: f64,
    /// Half width of the reading's 95 % interval, K, if it is stated.
    pub uncertainty: Option<f64>,
    /// Prediction of the machine file, degC.
    pub predicted: f64,
    /// Half width of the prediction's 95 % band, K, by the parameters that the machine file leaves open, the model error, and
    /// the mesh where its error is known.
    pub band: f64,
    /// Prediction of another program, degC.
    pub other: Option<f64>,
}

impl CheckedReading {
    /// Whether reading and prediction differ by no more than their uncertainties together.
    pub fn is_inside(&self) -> bool {
        (self.predicted - self.measured).abs() <= self.band.hypot(self.uncertainty.unwrap_or(0.0))
    }
}

/// Solves every measured state of the machine as its file stands; nothing is fitted here.
///
/// # Errors
/// A condition is incomplete, or a state cannot be solved.
pub fn check(study: &Study) -> Result<Vec<CheckedState>> {
    study.model.machine.measurements.iter().map(|m| one(study, m)).collect()
}

/// The condition of a measured state; variables it does not mention take the machine's defaults.
///
/// # Errors
/// A variable is neither stated nor has a default.
pub fn condition_of(machine: &Machine, measurement: &Measurement) -> Result<Condition> {
    let mut si: Vec<f64> = machine.variables.iter().map(|v| v.default.unwrap_or(f64::NAN)).collect();
    for (variable, value) in &measurement.condition {
        si[*variable] = *value;
    }
    if let Some(v) = si.iter().position(|x| x.is_nan()) {
        let name = &machine.variables[v].name;
        return Err(coldplate_base::error::Error::input(format!("the measurement '{}' does not say its {name}", measurement.name))
            .at_key(format!("measurement.{}.condition", measurement.name)));
    }
    Ok(Condition::from_si(si))
}

/// Variables with their values, each in its own unit.
pub type Fixed = Vec<(Quantity, f64)>;

/// Values of variables (index and SI) as a figure shows them.
pub fn fixed(machine: &Machine, values: &[(usize, f64)]) -> Fixed {
    values
        .iter()
        .filter_map(|(v, value)| {
            let variable = &machine.variables[*v];
            let shown = express(*value, &variable.unit, variable.dimension).ok()?;
            // Seven digits: the conversion to SI and back must not show.
            let shown = format!("{shown:.6e}").parse().unwrap_or(shown);
            Some((Quantity::new(&variable.name, &variable.unit), shown))
        })
        .collect()
}

/// How many readings lie inside the band, in words; the band holds the error of the mesh if it is known.
fn inside(rows: &[CheckedReading], has_mesh: bool) -> String {
    let inside = rows.iter().filter(|row| row.is_inside()).count();
    let open = if has_mesh { "the machine file and the mesh leave" } else { "the machine file leaves" };
    format!("{inside} of {} readings lie inside the band of what {open} open, with their own uncertainty.", rows.len())
}

/// Solves one measured state.
///
/// # Errors
/// Errors of [`check`].
pub fn one(study: &Study, measurement: &Measurement) -> Result<CheckedState> {
    let model = &study.model;
    let condition = condition_of(&model.machine, measurement)?;
    let solver = model.solver(&condition)?;
    let state = model.solve(&solver, &condition)?;
    // Sensors show a value with lag, offset and gain, and the readings are shown values.
    let shown = |(sensor, at): (&Sensor, f64)| sensor.measurand().shown(sensor.shows.settled(at, state.load.chamber));
    let predicted: Vec<f64> = model.machine.sensors.iter().zip(model.read(&state)).map(shown).collect();
    let mesh = model.mesh_errors(&condition, &state).ok().flatten().map_or_else(Vec::new, |found| found.errors);
    let has_mesh = !mesh.is_empty();
    let mut bands = bands(study, &condition, &state)?;
    bands.iter_mut().zip(mesh).for_each(|(band, mesh)| *band = band.hypot(mesh));
    let rows: Vec<CheckedReading> = measurement
        .readings
        .iter()
        .map(|(sensor, kelvin)| CheckedReading {
            name: model.network.sensor_names[*sensor].clone(),
            measured: model.machine.sensors[*sensor].measurand().shown(*kelvin),
            uncertainty: measurement.uncertainty,
            predicted: predicted[*sensor],
            band: bands[*sensor],
            other: measurement.others.iter().find(|(s, _)| s == sensor).map(|(_, t)| model.machine.sensors[*sensor].measurand().shown(*t)),
        })
        .collect();
    // The condition as stated: variables the measurement does not mention keep their defaults unseen.
    let fixed = fixed(&model.machine, &measurement.condition);
    let words: Vec<String> = fixed.iter().map(|(q, v)| q.named(*v)).collect();
    let sensors = rows
        .iter()
        .map(|row| SensorRow {
            name: row.name.clone(),
            measured: Some(row.measured),
            uncertainty: row.uncertainty,
            predicted: Some(row.predicted),
            band: Some(row.band),
            other: row.other,
        })
        .collect();
    let figure = MeasuredFigure {
        title: format!("{}: predicted beside measured", measurement.name),
        quantity: Quantity::new("temperature", "degC"),
        sensors,
        other_name: "published simulation".into(),
        fixed: fixed.clone(),
        notes: vec![
            inside(&rows, has_mesh),
            "The machine file as it stands; its assumptions say which numbers were chosen with readings in view.".into(),
        ],
    };
    let balance = &state.solution.balance;
    Ok(CheckedState {
        machine: model.machine.name.clone(),
        name: measurement.name.clone(),
        condition: words.join(", "),
        note: measurement.note.clone(),
        rows,
        figure,
        heat: heat(model, &state, format!("{}: where the heat goes", measurement.name), fixed),
        balance: (balance.in_watts, balance.out_watts, balance.relative),
    })
}

/// Half width of the 95 % band of every sensor at a state, K: by the parameters that the machine file leaves open, with their
/// correlations, and by the model error, which grows away from the conditions at which the model was compared with
/// measurements.
///
/// # Errors
/// Errors of [`Study::open_parameters`], [`Study::correlations`] and [`Derivatives::along_open`].
fn bands(study: &Study, condition: &Condition, state: &SteadyState) -> Result<Vec<f64>> {
    let parameters = study.open_parameters(true)?;
    let correlations = study.correlations(&parameters)?;
    let slopes = Derivatives::at(study, condition, &state.solution.temperatures)?.along_open(&parameters)?;
    let missing = &study.model.machine.model_error;
    let growth = missing.growth * distance(&study.model.machine, condition);
    let band = |(slopes, own): (&Vec<f64>, &f64)| {
        let along = |i: usize| slopes.iter().zip(&correlations[i]).map(|(slope, correlation)| slope * correlation).sum::<f64>();
        let variance: f64 = slopes.iter().enumerate().map(|(i, slope)| slope * along(i)).sum();
        let missed = (own * own + missing.common * missing.common) * (1.0 + growth * growth);
        NINETY_FIVE * (variance.max(0.0) + missed).sqrt()
    };
    Ok(slopes.iter().zip(&missing.sensors).map(band).collect())
}

/// Distance of a condition from the mean of the measured ones, in halves of the ranges of its variables.
fn distance(machine: &Machine, condition: &Condition) -> f64 {
    let rows = &machine.model_error.measured;
    let square = |(v, variable): (usize, &DescribedVariable)| {
        let (low, high) = variable.range?;
        let mean = rows.iter().filter_map(|row| row.get(v)).sum::<f64>() / rows.len() as f64;
        Some((2.0 * (condition.si()[v] - mean) / (high - low)).powi(2)).filter(|square| square.is_finite())
    };
    machine.variables.iter().enumerate().filter_map(square).sum::<f64>().sqrt()
}

/// Sources and sinks of a state; those that carry next to nothing are left out.
pub fn heat(model: &MeshedMachine, state: &SteadyState, title: String, fixed: Fixed) -> HeatFigure {
    let flows = model.flows(state);
    HeatFigure {
        title,
        sources: flows.sources.into_iter().filter(|(_, q)| q.abs() > 1e-9).collect(),
        sinks: flows.sinks.into_iter().filter(|(_, q)| q.abs() > 1e-6).collect(),
        fixed,
        notes: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use coldplate_base::document::Document;

    /// 37 degC, shown by a sensor that reads 10 K too high.
    #[test]
    fn measured_states_are_compared_with_what_is_shown() {
        let text = "name = \"node\"\n[node.base]\ntemperature = \"22 degC\"\n[node.motor]\ncapacity = \"1 J/K\"\n[contact.foot]\n\
                    between = [\"base\", \"motor\"]\ntotal_conductance = \"2 W/K\"\n[source.motor]\nin = \"motor\"\npower = \"30 W\"\n\
                    [sensor.motor]\nnode = \"motor\"\noffset = \"10 K\"\n[measurement.hot]\nreadings = { motor = \"47 degC\" }\n\
                    condition = { coolant_flow = \"2 L/min\", coolant_temperature = \"20 degC\", motor_speed = \"0 rpm\", \
                    ambient_temperature = \"22 degC\" }\n";
        let study = Study::new(Document::parse(text, "node.toml").unwrap(), None).unwrap();
        let checked = check(&study).unwrap();
        let CheckedReading { name, measured, predicted, band, .. } = &checked[0].rows[0];
        assert!(name == "motor" && (measured - predicted).abs() < 1e-9, "{measured} {predicted}");
        // 15 K of rise: 5 % by the heat and 20 % by the contact, both assumed, and 0.05 K that the model misses.
        let expected = NINETY_FIVE * ((0.05 * 15.0_f64).powi(2) + (0.2 * 15.0_f64).powi(2) + 0.05_f64.powi(2)).sqrt();
        assert!((band - expected).abs() < 1e-6, "{band} {expected}");
    }
}
