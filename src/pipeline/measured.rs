//! The machine's measured states, solved in full and laid beside the readings.

use crate::describe::machine::{Condition, Machine, Measurement, Sensor};
use crate::error::Result;
use crate::figures::chart::heat::HeatFigure;
use crate::figures::chart::measured::{MeasuredFigure, SensorRow};
use crate::figures::chart::style::Quantity;
use crate::solve::meshed::{MeshedMachine, SteadyState};
use crate::units::{Celsius, Kelvin, celsius, express};

/// A measured state beside its prediction.
#[derive(Debug)]
pub struct Checked {
    /// Name of the machine.
    pub machine: String,
    /// Name of the measurement.
    pub name: String,
    /// The condition in words.
    pub condition: String,
    /// Remarks on the readings.
    pub note: String,
    /// Sensor, measured, predicted, predicted by others; degC.
    pub rows: Vec<(String, f64, f64, Option<f64>)>,
    /// Readings beside predictions.
    pub figure: MeasuredFigure,
    /// Where the heat goes.
    pub heat: HeatFigure,
    /// Heat in, heat out (W), relative imbalance.
    pub balance: (f64, f64, f64),
}

/// Solves every measured state of the machine as its file stands; nothing is fitted here.
///
/// # Errors
/// A condition is incomplete, or a state cannot be solved.
pub fn check(model: &MeshedMachine) -> Result<Vec<Checked>> {
    model.machine.measurements.iter().map(|m| one(model, m)).collect()
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
        return Err(crate::error::Error::input(format!("the measurement '{}' does not say its {name}", measurement.name))
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

/// Solves one measured state.
///
/// # Errors
/// As [`check`].
pub fn one(model: &MeshedMachine, measurement: &Measurement) -> Result<Checked> {
    let condition = condition_of(&model.machine, measurement)?;
    let solver = model.solver(&condition)?;
    let state = model.solve(&solver, &condition)?;
    // What the sensors show is what was read.
    let shown = |(sensor, at): (&Sensor, Celsius)| Celsius::from(Kelvin(sensor.shows.settled(Kelvin::from(at).0)));
    let predicted: Vec<Celsius> = model.machine.sensors.iter().zip(model.readings(&state)).map(shown).collect();
    let rows: Vec<(String, f64, f64, Option<f64>)> = measurement
        .readings
        .iter()
        .map(|(sensor, kelvin)| {
            let other = measurement.others.iter().find(|(s, _)| s == sensor).map(|(_, t)| celsius(*t));
            (model.network.sensor_names[*sensor].clone(), celsius(*kelvin), predicted[*sensor].0, other)
        })
        .collect();
    // The condition as stated: variables the measurement does not mention keep their defaults unseen.
    let fixed = fixed(&model.machine, &measurement.condition);
    let words: Vec<String> = fixed.iter().map(|(q, v)| format!("{} {}", q.name.replace('_', " "), q.with_value(*v))).collect();
    let sensors = rows
        .iter()
        .map(|(name, measured, predicted, other)| SensorRow {
            name: name.clone(),
            measured: Some(*measured),
            predicted: Some(*predicted),
            other: *other,
            ..SensorRow::default()
        })
        .collect();
    let figure = MeasuredFigure {
        title: format!("{}: predicted beside measured", measurement.name),
        quantity: Quantity::new("temperature", "degC"),
        sensors,
        other_name: "published simulation".into(),
        fixed: fixed.clone(),
        notes: vec!["The machine file as it stands; its assumptions say which numbers were chosen with readings in view.".into()],
    };
    let balance = &state.solution.balance;
    Ok(Checked {
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

/// Sources and sinks of a state; what carries next to nothing is left out.
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

    /// 37 degC, shown by a sensor that reads 10 K too high.
    #[test]
    fn measured_states_are_compared_with_what_is_shown() {
        let text = "name = \"node\"\n[node.base]\ntemperature = \"22 degC\"\n[node.motor]\ncapacity = \"1 J/K\"\n[contact.foot]\n\
                    between = [\"base\", \"motor\"]\ntotal_conductance = \"2 W/K\"\n[source.motor]\nin = \"motor\"\npower = \"30 W\"\n\
                    [sensor.motor]\nnode = \"motor\"\noffset = \"10 K\"\n[measurement.hot]\nreadings = { motor = \"47 degC\" }\n\
                    condition = { coolant_flow = \"2 L/min\", coolant_temperature = \"20 degC\", motor_speed = \"0 rpm\", \
                    ambient_temperature = \"22 degC\" }\n";
        let model = MeshedMachine::new(Machine::from_text(text, "node.toml", &[]).unwrap(), None).unwrap();
        let checked = check(&model).unwrap();
        let (name, measured, predicted, _) = &checked[0].rows[0];
        assert!(name == "motor" && (measured - predicted).abs() < 1e-9, "{measured} {predicted}");
    }
}
