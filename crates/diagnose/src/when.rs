//! When a row was measured: variables that a diagnosis gives to the formulas of a machine, so that a cause may act at some times, in some
//! tests, or only on the way down.
//!
//! Nothing else depends on them: away from these data the time and the test are none, and nothing has fallen.

use coldplate_base::condition::{AMBIENT_TEMPERATURE, COOLANT_FLOW, COOLANT_TEMPERATURE};
use coldplate_base::document::{Document, Leaf};
use coldplate_base::error::Result;
use coldplate_describe::machine::{Condition, DescribedVariable};
use coldplate_evidence::measurement::{Data, TIME};

/// Number of the test, from 1 in the order of the data; 0 elsewhere.
pub(crate) const TEST_NUMBER: &str = "test_number";
/// Behind the name of a variable: 1 where it has come down to its value, 0 where it has risen, or has not moved yet.
pub(crate) const FALLEN: &str = "_fallen";

/// Most tests among which one may be another than the rest.
const MOST_TESTS: usize = 40;
/// A variable has moved by more than this share of its range.
const MOVED: f64 = 0.01;
/// Rows in which it has fallen, and in which it has not, at least.
const LEAST_ROWS: usize = 2;
/// Variables of every machine that nothing remembers: water and room.
const WITHOUT_MEMORY: [&str; 3] = [COOLANT_FLOW, COOLANT_TEMPERATURE, AMBIENT_TEMPERATURE];

/// A variable that is added.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Added {
    /// Its name.
    pub name: String,
    /// Its declaration in the machine file, as TOML.
    pub declared: &'static str,
    /// Its value in every row, SI.
    pub values: Vec<f64>,
    /// Whether it stays until the next row of a log instead of running straight to it.
    pub is_held: bool,
}

impl Added {
    /// Those that data can use and a machine file does not declare itself, by the variables of the data's conditions.
    pub fn all(data: &Data, variables: &[DescribedVariable]) -> Vec<Self> {
        let time = data.is_transient().then(|| Self::new(TIME, "{ unit = \"s\", default = \"0 s\" }", times(data)));
        let number = test_numbers(data).map(|values| Self::new(TEST_NUMBER, COUNT, values));
        let fallen = |(v, variable): (usize, &DescribedVariable)| {
            let name = format!("{}{FALLEN}", variable.name);
            let is_count = variable.name == TEST_NUMBER || variable.name.ends_with(FALLEN);
            let remembers = !variable.dimension.is_absolute() && !WITHOUT_MEMORY.contains(&variable.name.as_str()) && !is_count;
            Some(Self::new(name, COUNT, fallen(data, v).filter(|_| remembers && variable.name != TIME)?))
        };
        let fallen = variables.iter().enumerate().filter_map(fallen);
        let is_new = |added: &Self| variables.iter().all(|v| v.name != added.name);
        time.into_iter().chain(number).chain(fallen).filter(is_new).collect()
    }

    fn new(name: impl Into<String>, declared: &'static str, values: Vec<f64>) -> Self {
        Self { name: name.into(), declared, values, is_held: false }
    }

    /// Data whose conditions have some variables, with all of those that a machine has: what is added, and 0 where nothing is.
    pub fn fill(mut data: Data, given: &[DescribedVariable], all: &[DescribedVariable], added: &[Self]) -> Data {
        let before: Vec<Option<usize>> = all.iter().map(|v| given.iter().position(|own| own.name == v.name)).collect();
        let values: Vec<Option<&Self>> = all.iter().map(|v| added.iter().find(|added| added.name == v.name)).collect();
        let held = |(before, added): (&Option<usize>, &Option<&Self>)| match before {
            Some(v) => data.held.get(*v).copied().unwrap_or(false),
            None => added.is_some_and(|added| added.is_held),
        };
        data.held = before.iter().zip(&values).map(held).collect();
        for (r, row) in data.rows.iter_mut().enumerate() {
            let si = row.condition.si();
            let value = |(before, added): (&Option<usize>, &Option<&Self>)| match before {
                Some(v) => si[*v],
                None => added.and_then(|added| added.values.get(r).copied()).unwrap_or(0.0),
            };
            row.condition = Condition::from_si(before.iter().zip(&values).map(value).collect());
        }
        data
    }

    /// Whether it is the number of the test.
    pub(crate) fn is_test_number(&self) -> bool {
        self.name == TEST_NUMBER
    }

    /// The line of the machine file that declares it, (key, TOML value).
    fn line(&self) -> (String, String) {
        (format!("variables.{}", self.name), self.declared.into())
    }

    /// The lines of a machine file by which it has some variables: their declarations, and their defaults in the measured conditions that it
    /// states, which have every variable.
    ///
    /// # Errors
    /// A key of the file cannot be read.
    pub fn lines(added: &[Self], document: &Document) -> Result<Vec<(String, String)>> {
        let mut lines: Vec<(String, String)> = added.iter().map(Self::line).collect();
        if let Some(Leaf::List(measured)) = document.leaf(MEASURED)?.filter(|_| !added.is_empty()) {
            let with = |condition: Leaf| match condition {
                Leaf::Table(entries) => {
                    let none = added.iter().map(|a| (a.name.clone(), Leaf::Text(if a.name == TIME { "0 s" } else { "0 1" }.into())));
                    Leaf::Table(entries.into_iter().chain(none).collect())
                }
                other => other,
            };
            lines.push((MEASURED.into(), Leaf::List(measured.into_iter().map(with).collect()).to_toml()));
        }
        Ok(lines)
    }

    /// Whether lines of a machine file name it.
    pub fn is_named(&self, lines: &[(String, String)]) -> bool {
        let name = if self.name == TIME { format!("{TIME}_s") } else { self.name.clone() };
        lines.iter().any(|(_, value)| value.contains(&name))
    }
}

/// Conditions at which a machine was compared with measurements.
const MEASURED: &str = "model_error.measured";
/// A pure number.
const COUNT: &str = "{ unit = \"1\", default = \"0\" }";

fn times(data: &Data) -> Vec<f64> {
    data.rows.iter().map(|row| row.time.unwrap_or(0.0)).collect()
}

/// `None` where tests are one, as many as rows, or too many.
fn test_numbers(data: &Data) -> Option<Vec<f64>> {
    let tests = data.tests();
    if !(2..=MOST_TESTS).contains(&tests.len()) || tests.len() == data.rows.len() {
        return None;
    }
    let number = |name: &String| tests.iter().position(|test| test == name).map_or(0.0, |i| 1.0 + i as f64);
    Some(data.rows.iter().map(|row| number(&row.test)).collect())
}

/// Whether a variable has come down to its value, in the order of the rows; in logs within each test. `None` where it does not both rise and
/// fall.
fn fallen(data: &Data, variable: usize) -> Option<Vec<f64>> {
    let of = |row: usize| data.rows[row].condition.si()[variable];
    let (least, most) = (0..data.rows.len()).map(of).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let (mut values, mut risen): (Vec<f64>, usize) = (Vec::with_capacity(data.rows.len()), 0);
    for row in 0..data.rows.len() {
        let goes_on = row > 0 && (!data.is_transient() || data.rows[row].test == data.rows[row - 1].test);
        let change = if goes_on { of(row) - of(row - 1) } else { 0.0 };
        let before = if goes_on { values[row - 1] } else { 0.0 };
        let moved = change.abs() > MOVED * (most - least);
        risen += usize::from(moved && change > 0.0);
        values.push(if !moved { before } else { f64::from(u8::from(change < 0.0)) });
    }
    let falling = values.iter().filter(|v| **v > 0.0).count();
    (risen > 0 && falling >= LEAST_ROWS && values.len() >= falling + LEAST_ROWS).then_some(values)
}
