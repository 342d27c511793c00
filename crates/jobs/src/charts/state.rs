//! A machine at one condition, solved in full: the basis of pictures of heat and temperature.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::super::measured::{self, Fixed};
use super::Head;
use super::path_of;
use super::results::Results;
use coldplate_base::document::Section;
use coldplate_base::error::Result;
use coldplate_describe::machine::{Condition, Machine};
use coldplate_solve::meshed::SteadyState;
use coldplate_solve::study::Study;

/// Keys: `machine`, and `measurement` (a measured state of the machine file) or `condition`; variables it does not name
/// take the machine's defaults.
#[derive(Debug, Clone)]
pub(super) struct StateKeys {
    pub(super) machine: PathBuf,
}

/// The solved state, and its condition as a figure shows it.
pub(super) struct SolvedState {
    pub(super) study: Rc<Study>,
    pub(super) condition: Condition,
    pub(super) state: SteadyState,
    pub(super) fixed: Fixed,
}

impl StateKeys {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        let machine = path_of(root, folder, "machine")?;
        if root.one_of(&["measurement", "condition"])? == Some("condition") {
            root.section("condition")?;
        }
        Ok(Self { machine })
    }

    pub(super) fn open(&self, head: &Head, results: &mut Results<'_>) -> Result<SolvedState> {
        let study = results.machine(&self.machine)?;
        let model = &study.model;
        let (condition, fixed) = condition_of(&head.root(), &model.machine)?;
        let solver = model.solver(&condition)?;
        let state = model.solve(&solver, &condition)?;
        Ok(SolvedState { study, condition, state, fixed })
    }
}

/// The condition that a definition asks for, and the values that the figure shows.
pub(super) fn condition_of(root: &Section<'_>, machine: &Machine) -> Result<(Condition, Fixed)> {
    if root.has("measurement") {
        let names: Vec<&str> = machine.measurements.iter().map(|m| m.name.as_str()).collect();
        let measurement = &machine.measurements[root.choice("measurement", &names)?];
        let named: Vec<usize> = measurement.condition.iter().map(|(v, _)| *v).collect();
        return Ok(shown(machine, measured::condition_of(machine, measurement)?, &named));
    }
    let mut given: Vec<(String, String)> = Vec::new();
    if let Some(section) = root.opt_section("condition")? {
        for name in section.keys() {
            let value = section.value(name)?;
            let text = value.text()?;
            // Each value is checked by itself first, so that an error names its place.
            let variable = machine.variables.iter().find(|v| v.name == name);
            match variable {
                Some(v) => value.quantity(v.dimension).map(|_| ())?,
                None => {
                    let known: Vec<&str> = machine.variables.iter().map(|v| v.name.as_str()).collect();
                    let help = coldplate_base::document::suggestion(name, &known);
                    return Err(value.error(format!("'{name}' is not a variable of this machine")).help(help));
                }
            }
            given.push((name.to_string(), text));
        }
    }
    let pairs: Vec<(&str, &str)> = given.iter().map(|(k, v)| (k.as_str(), v.as_str())).collect();
    let condition = machine.condition(&pairs)?;
    let named = |v: &usize| given.iter().any(|(name, _)| *name == machine.variables[*v].name);
    let named: Vec<usize> = (0..machine.variables.len()).filter(named).collect();
    Ok(shown(machine, condition, &named))
}

/// A condition as a figure shows it: with all named variables and all that the machine depends on. Variables that are not
/// named are held at their default, and those that a machine has declared itself are as much part of the condition as the
/// rest.
fn shown(machine: &Machine, condition: Condition, named: &[usize]) -> (Condition, Fixed) {
    let all = condition.si().iter().copied().enumerate();
    let all: Vec<(usize, f64)> = all.filter(|(v, _)| named.contains(v) || machine.uses(*v)).collect();
    let fixed = measured::fixed(machine, &all);
    (condition, fixed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use coldplate_base::document::Document;

    #[test]
    fn all_that_is_held_is_said() {
        let text = "name = \"node\"\n[variables]\ntorque = { unit = \"N m\", default = \"4 N m\" }\n\
                    motor_speed = { default = \"3000 rpm\" }\ncoolant_flow = \"2 L/min\"\n\
                    coolant_temperature = \"20 degC\"\nambient_temperature = \"22 degC\"\n[node.base]\ntemperature = \"22 degC\"\n\
                    [node.motor]\ncapacity = \"1 J/K\"\n[contact.foot]\nbetween = [\"base\", \"motor\"]\n\
                    total_conductance = \"2 W/K\"\n[source.motor]\nin = \"motor\"\npower = \"6 * torque_N_m\"\n\
                    [sensor.motor]\nnode = \"motor\"\n[measurement.hot]\nreadings = { motor = \"47 degC\" }\n\
                    condition = { motor_speed = \"100 rpm\" }\n";
        let study = coldplate_solve::study::Study::new(Document::parse(text, "node.toml").unwrap(), None).unwrap();
        let of = |definition: &str| {
            let document = Document::parse(definition, "chart.toml").unwrap();
            let (_, fixed) = condition_of(&document.root(), &study.model.machine).unwrap();
            fixed.into_iter().map(|(q, v)| format!("{} {}", q.name, q.with_value(v))).collect::<Vec<_>>()
        };
        for definition in ["figure = \"heat\"", "condition = { motor_speed = \"100 rpm\" }", "measurement = \"hot\""] {
            let fixed = of(definition);
            assert!(fixed.contains(&"torque 4 N m".to_string()), "{definition}: {fixed:?}");
        }
    }
}
