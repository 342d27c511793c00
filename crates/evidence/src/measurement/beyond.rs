//! Conditions of measured data that the machine file does not expect: most often a wrong unit in a header.

use super::ReadingRow;
use coldplate_base::numbers::significant;
use coldplate_base::units::express;
use coldplate_describe::machine::{DescribedVariable, Machine};

/// Largest excess beyond either end of a range, as a share of its width, at which the range counts as kept. Chosen: room for
/// readings at the ends.
const SLACK: f64 = 0.01;
/// Excess beyond either end, as a multiple of the width of the range, above which a value points to a wrong unit. The unit is
/// asked for if at least half of all rows exceed it. Dimensionless; chosen: smaller values occur with the right unit.
const FAR: f64 = 1.0;

/// A remark for each variable whose values leave the range that the machine file gives it.
pub(super) fn remarks(rows: &[ReadingRow], machine: &Machine) -> Vec<String> {
    machine.variables.iter().enumerate().filter_map(|(v, variable)| remark(rows, v, variable)).collect()
}

fn remark(rows: &[ReadingRow], v: usize, variable: &DescribedVariable) -> Option<String> {
    let (low, high) = variable.range?;
    let width = (high - low).max(f64::MIN_POSITIVE);
    let beyond = |row: &ReadingRow| (low - row.condition.si()[v]).max(row.condition.si()[v] - high) / width;
    let outside = rows.iter().filter(|row| beyond(row) > SLACK).count();
    let farthest = rows.iter().max_by(|a, b| beyond(a).total_cmp(&beyond(b))).filter(|_| outside > 0)?;
    let shown = |si: f64| significant(express(si, &variable.unit, variable.dimension).unwrap_or(si), 6);
    let is_far = 2 * rows.iter().filter(|row| beyond(row) > FAR).count() >= rows.len();
    Some(format!(
        "{} is outside the range of the machine file, {} to {} {}, in {outside} of {} rows, by most at {} {}{}",
        variable.name,
        shown(low),
        shown(high),
        variable.unit,
        rows.len(),
        shown(farthest.condition.si()[v]),
        variable.unit,
        if is_far { ": is the unit in its header right?" } else { "" }
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measurement::Data;
    use coldplate_base::document::Document;

    /// Speeds in turns per second under a header that says so, of a machine that turns some thousand times a minute.
    #[test]
    fn a_wrong_unit_is_asked_for() {
        let machine = concat!(env!("CARGO_MANIFEST_DIR"), "/../../machines/rig.toml");
        let machine = Machine::from_document(&Document::read(machine).unwrap()).unwrap();
        let sensor = &machine.sensors[0].name;
        let notes = |unit: &str, speed: f64| {
            let head = format!("test, coolant_flow [L/min], coolant_temperature [degC], motor_speed [{unit}], ambient_temperature [degC]");
            let rows = [1.0, 0.8].map(|share| format!("a, 3.6, 20.5, {}, 22, 25", share * speed));
            let text = format!("{head}, {sensor} [degC]\n{}\n", rows.join("\n"));
            let path = std::env::temp_dir().join(format!("coldplate-beyond-{}-{unit}.csv", std::process::id()));
            std::fs::write(&path, text).unwrap();
            let mut notes = Data::read(&path, &machine).unwrap().notes;
            std::fs::remove_file(&path).unwrap();
            assert!(notes.remove(0).contains("3 lines seen"));
            notes
        };
        assert_eq!(notes("rpm", 2000.0), Vec::<String>::new());
        let far = notes("Hz", 2000.0);
        assert!(far.len() == 1 && far[0].starts_with("motor_speed is outside the range") && far[0].contains("unit"), "{far:?}");
    }
}
