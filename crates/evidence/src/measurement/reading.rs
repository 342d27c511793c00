//! How a table is to be read: the zone of its stamps, and what its conditions do between two rows.

use std::path::Path;

use super::ReadingRow;
use coldplate_base::document::{Document, Section};
use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_describe::machine::Machine;

/// Most levels of a switched condition, a count. Chosen: a relay has two, a fan or pump a few steps.
const MOST_LEVELS: usize = 6;
/// Fewest rows for each level of a switched condition, a count. Chosen: fewer rows may be the corners of a ramp.
const ROWS_A_LEVEL: usize = 5;

/// Keys of [`ReadingSettings`] in `DATA.toml`.
pub(super) const KEYS: [&str; 3] = ["zone", "held", "joined"];

/// Settings of `DATA.toml` by which the table beside it is read.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ReadingSettings {
    /// Time zone of stamps that say none, a name of the IANA database.
    pub zone: Option<String>,
    /// Variables that stay until the next row.
    pub held: Vec<String>,
    /// Variables that run straight to the next row.
    pub joined: Vec<String>,
}

impl ReadingSettings {
    /// Settings of `DATA.toml` beside `data`, if there is one.
    ///
    /// # Errors
    /// The file cannot be read; a value of another kind.
    pub fn beside(data: &Path) -> Result<Self> {
        let path = data.with_extension("toml");
        if !path.exists() {
            return Ok(Self::default());
        }
        let document = Document::read(&path)?;
        let root = document.root();
        // A machine file with the table's name says nothing of the table.
        if root.has("machine") { Ok(Self::default()) } else { Self::of(&root) }
    }

    /// Settings in a section of a file.
    ///
    /// # Errors
    /// A value of another kind.
    pub(super) fn of(root: &Section<'_>) -> Result<Self> {
        let list = |key: &str| root.opt(key).map_or(Ok(Vec::new()), |value| value.texts());
        Ok(Self { zone: root.opt("zone").map(|value| value.text()).transpose()?, held: list("held")?, joined: list("joined")? })
    }

    /// Whether each variable of the machine is held until the next row of a log, with a sentence for every column that is. A
    /// variable without a statement is held if it is switched: few levels, of many rows each, one of them left and reached again in
    /// a test. A single step may as well be a ramp from row to row.
    ///
    /// # Errors
    /// A name that is no variable, or stated twice.
    pub(super) fn held(&self, rows: &[ReadingRow], machine: &Machine, notes: &mut Vec<String>) -> Result<Vec<bool>> {
        for name in self.held.iter().chain(&self.joined) {
            if machine.variables.iter().all(|v| v.name != *name) {
                let error = Error::input(format!("there is no condition '{name}'")).at_key(if self.held.contains(name) {
                    "held"
                } else {
                    "joined"
                });
                let names: Vec<&str> = machine.variables.iter().map(|v| v.name.as_str()).collect();
                return Err(match did_you_mean(name, names.iter().copied()) {
                    Some(near) => error.help(format!("did you mean '{near}'?")),
                    None => error.help(format!("conditions here: {}", names.join(", "))),
                });
            }
            if self.held.contains(name) && self.joined.contains(name) {
                return Err(Error::input(format!("'{name}' is stated as held and as joined")).at_key("held").help("keep one of the two"));
            }
        }
        if rows.iter().all(|row| row.time.is_none()) {
            return Ok(Vec::new());
        }
        let mut held = Vec::with_capacity(machine.variables.len());
        for (v, variable) in machine.variables.iter().enumerate() {
            let values: Vec<f64> = rows.iter().map(|row| row.condition.si()[v]).collect();
            let switched = levels(&values).filter(|_| comes_back(rows, v));
            let is_held = match (self.held.contains(&variable.name), self.joined.contains(&variable.name)) {
                (true, _) => true,
                (_, true) => false,
                _ => switched.is_some(),
            };
            let moves = values.iter().any(|value| *value != values[0]);
            if is_held && moves {
                let why = switched.filter(|_| !self.held.contains(&variable.name)).map_or(String::new(), |n| {
                    format!(
                        " (it has {n} levels; joined = [\"{}\"] in the file beside the data joins its rows by straight lines)",
                        variable.name
                    )
                });
                notes.push(format!("between two rows '{}' is held{why}", variable.name));
            } else if moves {
                notes.push(format!("between two rows '{}' runs straight", variable.name));
            }
            held.push(is_held);
        }
        Ok(held)
    }
}

/// Whether a variable leaves a level and reaches it again in one test.
fn comes_back(rows: &[ReadingRow], variable: usize) -> bool {
    let stretches = rows.chunk_by(|a, b| a.test == b.test && a.condition.si()[variable] == b.condition.si()[variable]);
    let mut seen: Vec<(&str, f64)> = Vec::new();
    stretches.into_iter().any(|stretch| {
        let own = (stretch[0].test.as_str(), stretch[0].condition.si()[variable]);
        let again = seen.contains(&own);
        seen.push(own);
        again
    })
}

/// Number of levels of a switched quantity; `None` if it is none.
fn levels(values: &[f64]) -> Option<usize> {
    let mut known: Vec<f64> = Vec::new();
    for value in values {
        if !known.contains(value) {
            known.push(*value);
        }
        if known.len() > MOST_LEVELS {
            return None;
        }
    }
    (known.len() > 1 && values.len() >= ROWS_A_LEVEL * known.len()).then_some(known.len())
}

#[cfg(test)]
mod tests {
    use super::levels;

    #[test]
    fn a_relay_has_levels_and_a_ramp_has_none() {
        let relay: Vec<f64> = (0..40).map(|r| if r % 10 < 4 { 60.0 } else { 0.0 }).collect();
        assert_eq!(levels(&relay), Some(2));
        let ramp: Vec<f64> = (0..40).map(f64::from).collect();
        assert_eq!(levels(&ramp), None);
        assert_eq!(levels(&[1.0; 30]), None);
        // Three corners of a schedule are no levels.
        assert_eq!(levels(&[0.0, 100.0, 100.0, 50.0]), None);
    }
}
