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

/// Conditions whose course between two rows of a log is stated.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct BetweenRows {
    /// Variables that stay until the next row.
    pub held: Vec<String>,
    /// Variables that run straight to the next row.
    pub joined: Vec<String>,
}

impl BetweenRows {
    /// Whether a variable is stated as held; `None` without a statement.
    fn of(&self, name: &str) -> Option<bool> {
        let is_in = |names: &[String]| names.iter().any(|own| own == name);
        if is_in(&self.held) { Some(true) } else { is_in(&self.joined).then_some(false) }
    }

    /// Checks that every name is a variable of the machine and stated once; `marks` stand before the keys in errors.
    fn check(&self, machine: &Machine, marks: &str) -> Result<()> {
        for (key, names) in [("held", &self.held), ("joined", &self.joined)] {
            let Some(name) = names.iter().find(|name| machine.variables.iter().all(|v| v.name != **name)) else { continue };
            let error = Error::input(format!("there is no condition '{name}'")).at_key(format!("{marks}{key}"));
            let known: Vec<&str> = machine.variables.iter().map(|v| v.name.as_str()).collect();
            return Err(match did_you_mean(name, known.iter().copied()) {
                Some(near) => error.help(format!("did you mean '{near}'?")),
                None => error.help(format!("conditions here: {}", known.join(", "))),
            });
        }
        match self.held.iter().find(|name| self.joined.contains(name)) {
            Some(name) => Err(Error::input(format!("'{name}' is stated as held and as joined"))
                .at_key(format!("{marks}held"))
                .help("keep one of the two")),
            None => Ok(()),
        }
    }
}

/// Settings by which a table is read.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ReadingSettings {
    /// Time zone of stamps that say none, a name of the IANA database.
    pub zone: Option<String>,
    /// Statements of the file beside the data.
    pub beside: BetweenRows,
    /// Statements of the caller, which replace those of the file beside the data and of the header.
    pub given: BetweenRows,
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
        let beside = BetweenRows { held: list("held")?, joined: list("joined")? };
        Ok(Self { zone: root.opt("zone").map(|value| value.text()).transpose()?, beside, given: BetweenRows::default() })
    }

    /// Whether each variable of the machine is held until the next row of a log, with a sentence for every column that moves.
    /// `header` has the columns whose header says so. A variable without a statement is held if it is switched: few levels, of many rows each, one of
    /// them left and reached again in a test. A single step may as well be a ramp from row to row.
    ///
    /// # Errors
    /// A name that is no variable, or contradicting statements.
    pub(super) fn held(
        &self,
        rows: &[ReadingRow],
        header: &[(String, bool)],
        machine: &Machine,
        notes: &mut Vec<String>,
    ) -> Result<Vec<bool>> {
        self.beside.check(machine, "")?;
        self.given.check(machine, "--")?;
        if rows.iter().all(|row| row.time.is_none()) {
            return Ok(Vec::new());
        }
        let mut held = Vec::with_capacity(machine.variables.len());
        for (v, variable) in machine.variables.iter().enumerate() {
            let name = &variable.name;
            let stated = self.stated(name, header)?;
            let values: Vec<f64> = rows.iter().map(|row| row.condition.si()[v]).collect();
            let levels = levels(&values);
            let switched = levels.filter(|n| values.len() >= ROWS_A_LEVEL * n && comes_back(rows, v));
            let is_held = stated.map_or(switched.is_some(), |(held, _)| held);
            if values.iter().any(|value| *value != values[0]) {
                let course = if is_held { "is held" } else { "runs straight" };
                let why = match (stated, switched, levels) {
                    (Some((_, by)), ..) => format!(", as {by} says"),
                    (None, Some(n), _) => format!(" (it has {n} levels and comes back to one; --joined {name} joins them)"),
                    (None, None, Some(_)) => format!(" (--held {name} if it steps)"),
                    (None, None, None) => String::new(),
                };
                notes.push(format!("between two rows '{name}' {course}{why}"));
            }
            held.push(is_held);
        }
        Ok(held)
    }

    /// Statement on a variable, and who makes it.
    fn stated(&self, name: &str, header: &[(String, bool)]) -> Result<Option<(bool, &'static str)>> {
        if let Some(held) = self.given.of(name) {
            return Ok(Some((held, "the command line")));
        }
        let header = header.iter().find(|(own, _)| own == name).map(|(_, held)| *held);
        match (header, self.beside.of(name)) {
            (Some(held), Some(other)) if held != other => {
                let word = |held: bool| if held { "held" } else { "joined" };
                let what = format!("'{name}' is {} by its header and {} by the file beside the data", word(held), word(other));
                Err(Error::input(what).at_key(word(other)).help(format!("keep one of the two, or say --held {name} or --joined {name}")))
            }
            (Some(held), _) => Ok(Some((held, "its header"))),
            (None, Some(held)) => Ok(Some((held, "the file beside the data"))),
            (None, None) => Ok(None),
        }
    }
}

/// Stretches of a test in which a variable keeps one value.
fn stretches(rows: &[ReadingRow], variable: usize) -> impl Iterator<Item = &[ReadingRow]> {
    rows.chunk_by(move |a, b| a.test == b.test && a.condition.si()[variable] == b.condition.si()[variable])
}

/// Whether a variable leaves a level and reaches it again in one test.
fn comes_back(rows: &[ReadingRow], variable: usize) -> bool {
    let mut seen: Vec<(&str, f64)> = Vec::new();
    stretches(rows, variable).any(|stretch| {
        let own = (stretch[0].test.as_str(), stretch[0].condition.si()[variable]);
        let again = seen.contains(&own);
        seen.push(own);
        again
    })
}

/// Number of levels of a quantity with few of them, two at least.
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
    (known.len() > 1).then_some(known.len())
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
    }
}
