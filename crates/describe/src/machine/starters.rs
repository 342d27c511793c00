//! Machine files to start from, and a sweep over their variables.

use super::model::Machine;
use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_base::numbers::compact;
use coldplate_base::units::express;

/// A commented machine file that passes the checks and solves without changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct Starter {
    /// Name by which a user asks for the file.
    pub name: &'static str,
    /// Subject of the example.
    pub about: &'static str,
    /// The machine file.
    #[serde(skip)]
    pub text: &'static str,
}

/// All starters, the usual one first.
pub const STARTERS: &[Starter] = &[
    Starter {
        name: "cold_plate",
        about: "a motor on a water-cooled plate: boxes, a bolted joint, a serpentine channel, a limit",
        text: include_str!("../../data/starters/cold_plate.toml"),
    },
    Starter {
        name: "spindle",
        about: "shaft, bearings and housing of cylinders, a motor as one node, residual gas, water in a hole",
        text: include_str!("../../data/starters/spindle.toml"),
    },
    Starter {
        name: "nodes",
        about: "motor, frame and foundation as three temperatures: no geometry, no water",
        text: include_str!("../../data/starters/nodes.toml"),
    },
];

/// Template of the sweep file.
const SWEEP: &str = include_str!("../../data/starters/sweep.toml");

/// The starter of this name.
///
/// # Errors
/// There is none of this name; a similar name is suggested.
pub fn starter(name: &str) -> Result<&'static Starter> {
    STARTERS.iter().find(|s| s.name == name).ok_or_else(|| {
        let names: Vec<&str> = STARTERS.iter().map(|s| s.name).collect();
        let near = did_you_mean(name, names.iter().copied()).map_or(String::new(), |near| format!("did you mean '{near}'? "));
        Error::input(format!("there is no starter '{name}'")).help(format!("{near}known: {}", names.join(", ")))
    })
}

/// A sweep over every variable of `machine` that has a range; `file` is the path of the machine file in the sweep.
///
/// # Errors
/// A variable's unit cannot be expressed.
pub fn sweep(machine: &Machine, file: &str) -> Result<String> {
    let mut ranges = String::new();
    for variable in &machine.variables {
        let Some((low, high)) = variable.range.filter(|(low, high)| high > low) else { continue };
        let shown = |si: f64| express(si, &variable.unit, variable.dimension).map(|v| compact(v, 7));
        ranges += &format!("{} = [\"{} {unit}\", \"{} {unit}\"]\n", variable.name, shown(low)?, shown(high)?, unit = variable.unit);
    }
    let escaped = |text: &str| text.replace('\\', "\\\\").replace('"', "\\\"");
    Ok(SWEEP.replace("NAME", &escaped(&machine.name)).replace("MACHINE", &escaped(file)).replace("RANGES\n", &format!("{ranges}\n")))
}
