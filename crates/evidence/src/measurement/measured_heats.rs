//! Sources whose heat is a column of the table: they are as certain as that column.

use super::{Data, MeasurementUncertainty};
use coldplate_base::units::Dimension;
use coldplate_describe::machine::{Condition, Machine, Source};

/// Relative difference below which a power counts as that of the column, dimensionless: rounding of units.
const SAME: f64 = 1e-9;

/// A source whose power is a condition variable, the uncertainty of which is stated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredHeat {
    /// Index of the source.
    pub source: usize,
    /// Index of the variable that is its power.
    pub variable: usize,
    /// Standard deviation of a factor on this heat in all rows, dimensionless: root mean square of the stated deviations over that of
    /// the powers.
    pub deviation: f64,
}

impl MeasuredHeat {
    /// All sources of the machine whose power is a variable with a stated uncertainty. One that is stated for no variable says nothing of
    /// its sources.
    pub fn all(machine: &Machine, data: &Data, uncertainty: &MeasurementUncertainty) -> Vec<Self> {
        let of = |(source, own): (usize, &Source)| {
            let variable = column_of(own, machine, data)?;
            let squares =
                data.rows.iter().map(|row| (uncertainty.at(&row.condition)[variable].powi(2), row.condition.si()[variable].powi(2)));
            let (errors, powers) = squares.fold((0.0, 0.0), |(e, p), (own, power)| (e + own, p + power));
            (errors > 0.0 && powers > 0.0).then(|| Self { source, variable, deviation: (errors / powers).sqrt() })
        };
        machine.sources.iter().enumerate().filter_map(of).collect()
    }
}

/// The variable whose value is the power of a source in every row, whatever the other variables are.
fn column_of(source: &Source, machine: &Machine, data: &Data) -> Option<usize> {
    if source.volume.is_some() || source.law.follows_temperature() {
        return None;
    }
    let is_power = |condition: &Condition, v: usize| {
        let power = machine.values(condition).and_then(|values| source.power.evaluate(&values));
        power.is_ok_and(|power| (power - condition.si()[v]).abs() <= SAME * power.abs())
    };
    let is_column = |v: usize| {
        // One row stands for all, with every other variable moved and with another power.
        let row = data.rows.first()?.condition.si();
        let moved = row.iter().enumerate().map(|(w, value)| if w == v { value + 1.0 } else { 1.01 * value }).collect();
        let holds = is_power(&Condition::from_si(moved), v) && data.rows.iter().all(|row| is_power(&row.condition, v));
        holds.then_some(v)
    };
    (0..machine.variables.len()).filter(|v| machine.variables[*v].dimension == Dimension::POWER).find_map(is_column)
}
