//! A machine at one condition, solved in full: what pictures of heat and temperature are drawn from.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::super::measured::{self, Fixed};
use super::Head;
use super::path_of;
use super::results::Results;
use crate::describe::machine::{Condition, Machine};
use crate::error::Result;
use crate::foundation::document::Section;
use crate::solve::meshed::SteadyState;
use crate::solve::sensitivity::Study;

/// Keys: `machine`, and `measurement` (a measured state of the machine file) or `condition`; variables it does not name
/// take the machine's defaults.
#[derive(Debug, Clone)]
pub(super) struct State {
    pub(super) machine: PathBuf,
}

/// The solved state, and its condition as a figure shows it.
pub(super) struct Solved {
    pub(super) study: Rc<Study>,
    pub(super) state: SteadyState,
    pub(super) fixed: Fixed,
}

impl State {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        let machine = path_of(root, folder, "machine")?;
        if root.one_of(&["measurement", "condition"])? == Some("condition") {
            root.section("condition")?;
        }
        Ok(Self { machine })
    }

    pub(super) fn open(&self, head: &Head, results: &mut Results<'_>) -> Result<Solved> {
        let study = results.machine(&self.machine)?;
        let model = &study.model;
        let (condition, fixed) = condition_of(&head.root(), &model.machine)?;
        let solver = model.solver(&condition)?;
        let state = model.solve(&solver, &condition)?;
        Ok(Solved { study, state, fixed })
    }
}

/// The condition that a definition asks for, and what of it is said in the figure.
pub(super) fn condition_of(root: &Section<'_>, machine: &Machine) -> Result<(Condition, Fixed)> {
    if root.has("measurement") {
        let names: Vec<&str> = machine.measurements.iter().map(|m| m.name.as_str()).collect();
        let measurement = &machine.measurements[root.choice("measurement", &names)?];
        return Ok((measured::condition_of(machine, measurement)?, measured::fixed(machine, &measurement.condition)));
    }
    let mut given: Vec<(String, String)> = Vec::new();
    if let Some(section) = root.opt_section("condition")? {
        for name in section.keys() {
            let value = section.value(name)?;
            let text = value.text()?;
            // One by one first, so that a mistake is shown where it stands.
            let variable = machine.variables.iter().find(|v| v.name == name);
            match variable {
                Some(v) => value.quantity(v.dimension).map(|_| ())?,
                None => {
                    let known: Vec<&str> = machine.variables.iter().map(|v| v.name.as_str()).collect();
                    let help = crate::foundation::document::suggestion(name, &known);
                    return Err(value.error(format!("'{name}' is not a variable of this machine")).help(help));
                }
            }
            given.push((name.to_string(), text));
        }
    }
    let pairs: Vec<(&str, &str)> = given.iter().map(|(k, v)| (k.as_str(), v.as_str())).collect();
    let condition = machine.condition(&pairs)?;
    let shown: Vec<(usize, f64)> = condition.si().iter().copied().enumerate().collect();
    let said = |at: &(usize, f64)| {
        let name = &machine.variables[at.0].name;
        crate::foundation::table::CONDITION_NAMES.contains(&name.as_str()) || given.iter().any(|(k, _)| k == name)
    };
    let shown: Vec<(usize, f64)> = shown.into_iter().filter(said).collect();
    let fixed = measured::fixed(machine, &shown);
    Ok((condition, fixed))
}
