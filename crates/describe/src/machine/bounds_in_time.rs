//! Bounds on all names that formulas use, while the variables run straight from one condition to another.

use super::condition::{Condition, drive_quantities, drive_slopes};
use super::model::Machine;
use super::symbols::Meaning;
use coldplate_base::formula::{Enclosure, Interval};
use coldplate_physics::drive::Parameters;

impl Machine {
    /// Bounds on the value of every name that formulas use, and on its derivative in time, while the variables run straight from
    /// one condition to another in a time (s).
    pub fn enclosures(&self, first: &Condition, last: &Condition, duration: f64) -> Vec<Enclosure> {
        let variables: Vec<Enclosure> =
            first.si().iter().zip(last.si()).map(|(first, last)| Enclosure::straight(*first, *last, duration)).collect();
        let of_variable = |meaning: &Meaning| match *meaning {
            Meaning::Si(variable) => variables[variable],
            Meaning::InUnit { variable, scale, offset } => variables[variable].scaled(1.0 / scale, -offset / scale),
            Meaning::Drive(..) | Meaning::Definition(_) => Enclosure::constant(0.0),
        };
        let mut names: Vec<Enclosure> = self.symbols.meanings.iter().map(of_variable).collect();
        let drives: Vec<[Enclosure; 7]> =
            self.drives.iter().map(|drive| of_drive(&drive.parameters, drive.speed.enclosure(&names))).collect();
        for (name, meaning) in names.iter_mut().zip(&self.symbols.meanings) {
            if let Meaning::Drive(drive, quantity) = *meaning {
                *name = drives[drive][quantity];
            }
        }
        for (definition, slot) in self.definitions.iter().zip(&self.symbols.definition_slots) {
            names[*slot] = definition.formula.enclosure(&names);
        }
        names
    }
}

/// Bounds on the quantities of a drive. On either side of standstill they are polynomials of degree two or less in the speed: their
/// slopes are straight there, and lie between those at the ends.
fn of_drive(parameters: &Parameters, speed: Enclosure) -> [Enclosure; 7] {
    let Interval { low, high } = speed.value;
    let turns = low < 0.0 && high > 0.0;
    if !(low.is_finite() && high.is_finite()) {
        return [Enclosure { value: Interval::ALL, slope: Interval::ALL, is_smooth: speed.is_smooth }; 7];
    }
    let (first, last) = (drive_slopes(parameters, low), drive_slopes(parameters, high));
    // Slopes close to standstill, from either side: a millionth of the range away from it.
    let close = 1e-6 * (high - low);
    let (below, above) = (drive_slopes(parameters, -close), drive_slopes(parameters, close));
    let middle = drive_quantities(parameters, f64::midpoint(low, high));
    std::array::from_fn(|i| {
        let slopes = if turns { Interval::hull([first[i], last[i], below[i], above[i]]) } else { Interval::hull([first[i], last[i]]) };
        let half = 0.5 * (high - low) * slopes.low.abs().max(slopes.high.abs());
        Enclosure {
            value: Interval { low: middle[i] - half, high: middle[i] + half },
            slope: slopes.times(speed.slope),
            is_smooth: speed.is_smooth && !turns,
        }
    })
}
