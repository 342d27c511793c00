//! The answer to a condition as a row of a table: which columns, with how many digits.

use coldplate_runtime::{Band, CONFIDENCE, Limit, Surrogate};
use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use super::Acceptability;
use super::condition;
use super::digits;
use super::record::code;
use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_tables::quoted;

/// Names that stand for several columns each.
const GROUPS: [&str; 4] = ["conditions", "temperatures", "bands", "margins"];

/// Content of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cell {
    Label,
    /// A variable, or a held one.
    Variable(usize),
    Point(usize),
    Low(usize),
    High(usize),
    Margin(usize),
    Probability,
    Verdict,
    Binding,
    InDomain,
}

impl Cell {
    fn is_of(self, group: &str) -> bool {
        match self {
            Self::Variable(_) => group == "conditions",
            Self::Point(_) => group == "temperatures",
            Self::Low(_) | Self::High(_) => group == "bands",
            Self::Margin(_) => group == "margins",
            Self::Label | Self::Probability | Self::Verdict | Self::Binding | Self::InDomain => false,
        }
    }
}

/// A column: its name, its unit if it has one, and its content.
#[derive(Debug, Clone)]
struct Column {
    name: String,
    unit: String,
    cell: Cell,
}

impl Column {
    fn header(&self) -> String {
        if self.unit.is_empty() { self.name.clone() } else { format!("{} [{}]", self.name, self.unit) }
    }
}

/// The columns of a table of answers.
pub(crate) struct AnswerColumns<'a> {
    surrogate: &'a Surrogate<'a>,
    chosen: Vec<Column>,
    half_widths: Vec<f64>,
    limits: Vec<Limit<'a>>,
    /// Whether a chosen column tells more of the uncertainty than the verdict.
    with_bands: bool,
    held: Vec<f64>,
    digits: Option<usize>,
    confidence: f64,
}

/// Memory for the answer at one condition.
#[derive(Debug, Default)]
pub(crate) struct AnswerMemory {
    values: Vec<f64>,
    bands: Vec<Band>,
}

/// The answer at one condition, for the columns to choose from.
pub(crate) struct ConditionAnswer<'r> {
    label: Option<&'r str>,
    x: &'r [f64],
    values: &'r [f64],
    bands: &'r [Band],
    /// Probability that all limits are kept; not a number if the surrogate has no uncertainty.
    probability: f64,
    binding: Option<usize>,
    /// The verdict.
    pub verdict: Acceptability,
    in_domain: bool,
}

impl<'a> AnswerColumns<'a> {
    /// The columns that `names` lists, in that order; all if it is empty. A name is that of a column, with or without its
    /// unit, or one of `conditions`, `temperatures`, `bands` and `margins`; commas separate names. Numbers have `digits`
    /// significant digits, or all they need to come back bit for bit. Verdicts are given at the `confidence`.
    ///
    /// # Errors
    /// A name that no column has.
    pub fn new(surrogate: &'a Surrogate<'a>, labelled: bool, names: &[String], digits: Option<usize>, confidence: f64) -> Result<Self> {
        let all = all(surrogate, labelled);
        let mut chosen = Vec::new();
        for name in names {
            // A name may hold a comma.
            let whole = find(&all, name);
            let found = if whole.is_empty() {
                name.split(',').map(|part| (part.trim(), find(&all, part.trim()))).collect()
            } else {
                vec![(name.as_str(), whole)]
            };
            for (part, columns) in found {
                if columns.is_empty() {
                    let known: Vec<&str> = all.iter().map(|c| c.name.as_str()).chain(GROUPS).collect();
                    let meant =
                        did_you_mean(part, known.iter().copied()).map_or(String::new(), |meant| format!("did you mean '{meant}'? "));
                    return Err(Error::input("there is no such column").at_key("--columns").read(part).help(format!(
                        "{meant}there are {}; temperatures, bands (low and high), margins and conditions stand for all of their kind",
                        known[..known.len() - GROUPS.len()].join(", ")
                    )));
                }
                chosen.extend(columns);
            }
        }
        let chosen = if names.is_empty() { all } else { chosen };
        let half_widths = surrogate.points().map(|p| p.half_width).collect();
        let limits = surrogate.limits().collect();
        let with_bands = chosen.iter().any(|c| matches!(c.cell, Cell::Low(_) | Cell::High(_) | Cell::Probability));
        let held = surrogate.held().map(|h| h.value).collect();
        Ok(Self { surrogate, chosen, half_widths, limits, with_bands, held, digits, confidence })
    }

    /// The header of a CSV file, with its line end.
    pub fn header(&self) -> String {
        self.chosen.iter().map(|c| quoted(&c.header())).collect::<Vec<_>>().join(",") + "\n"
    }

    /// Evaluates the surrogate at `condition`.
    pub fn answer<'r>(&self, label: Option<&'r str>, condition: &'r [f64], room: &'r mut AnswerMemory) -> ConditionAnswer<'r> {
        room.values.resize(self.half_widths.len(), 0.0);
        let (x, stated) = condition.split_at(self.surrogate.variable_count().min(condition.len()));
        let agrees = stated.iter().zip(&self.held).all(|(x, held)| x == held);
        // The shorter way gives the verdict at the usual confidence alone.
        let found = if self.surrogate.uncertainty().is_some() && (self.with_bands || self.confidence != CONFIDENCE) {
            room.bands.resize(self.half_widths.len(), Band::default());
            let found = self.surrogate.assess(x, None, self.confidence, &mut room.values, &mut room.bands);
            found.map(|own| (own.binding, own.state, own.in_domain, own.probability))
        } else {
            self.surrogate.query(x, &mut room.values).map(|own| (own.binding, own.state, own.in_domain, f64::NAN))
        };
        // A `Batch` gives no condition of the wrong length.
        let (binding, state, in_domain, probability) = found.unwrap_or((None, Acceptability::Uncertain, false, f64::NAN));
        ConditionAnswer {
            label,
            x: condition,
            values: &room.values,
            bands: &room.bands,
            probability,
            binding,
            verdict: if agrees { state } else { Acceptability::Uncertain },
            in_domain: in_domain && agrees,
        }
    }

    /// Appends a row of a CSV file, with its line end.
    pub fn csv(&self, answer: &ConditionAnswer<'_>, out: &mut String) {
        for (i, column) in self.chosen.iter().enumerate() {
            if i > 0 {
                out.push(',');
            }
            match self.value(column.cell, answer) {
                Value::Number(number) => self.number(number, out),
                Value::Text(text) => out.push_str(&quoted(text)),
                Value::Truth(truth) => out.push_str(if truth { "true" } else { "false" }),
            }
        }
        out.push('\n');
    }

    /// The chosen columns of an answer as one flat JSON object.
    pub fn object<'r>(&'r self, answer: &'r ConditionAnswer<'r>) -> impl Serialize + 'r {
        Object { columns: self, answer }
    }

    fn value<'r>(&'r self, cell: Cell, answer: &ConditionAnswer<'r>) -> Value<'r> {
        let of = |list: &[f64], i: usize| list.get(i).copied().unwrap_or(f64::NAN);
        match cell {
            Cell::Label => Value::Text(answer.label.unwrap_or("")),
            Cell::Variable(v) => Value::Number(of(answer.x, v)),
            Cell::Point(p) => Value::Number(of(answer.values, p)),
            Cell::Low(p) => Value::Number(of(answer.values, p) - self.half_width(answer, p)),
            Cell::High(p) => Value::Number(of(answer.values, p) + self.half_width(answer, p)),
            Cell::Probability => Value::Number(answer.probability),
            Cell::Margin(l) => Value::Number(self.limits.get(l).map_or(f64::NAN, |limit| {
                limit.maximum - limit.kind.value(|point| of(answer.values, point), |variable| of(answer.x, variable))
            })),
            Cell::Verdict => Value::Text(code(answer.verdict)),
            Cell::Binding => Value::Text(answer.binding.and_then(|i| self.limits.get(i)).map_or("", |limit| limit.name)),
            Cell::InDomain => Value::Truth(answer.in_domain),
        }
    }

    fn half_width(&self, answer: &ConditionAnswer<'_>, point: usize) -> f64 {
        let own = self.half_widths.get(point).copied().unwrap_or(f64::NAN);
        answer.bands.get(point).map_or(own, |band| band.half_width())
    }

    fn number(&self, value: f64, out: &mut String) {
        use std::fmt::Write;
        // Writing into a text cannot fail.
        let _ = match self.digits {
            Some(digits) => {
                digits::push(value, digits, out);
                Ok(())
            }
            None => write!(out, "{value}"),
        };
    }
}

enum Value<'r> {
    Number(f64),
    Text(&'r str),
    Truth(bool),
}

struct Object<'r, 'a> {
    columns: &'r AnswerColumns<'a>,
    answer: &'r ConditionAnswer<'r>,
}

impl Serialize for Object<'_, '_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.columns.chosen.len()))?;
        for column in &self.columns.chosen {
            match self.columns.value(column.cell, self.answer) {
                Value::Number(number) => map.serialize_entry(&column.name, &number)?,
                Value::Text("") if column.cell == Cell::Binding => map.serialize_entry(&column.name, &())?,
                Value::Text(text) => map.serialize_entry(&column.name, text)?,
                Value::Truth(truth) => map.serialize_entry(&column.name, &truth)?,
            }
        }
        map.end()
    }
}

/// Every column there is, in the order of a whole table.
fn all(surrogate: &Surrogate<'_>, labelled: bool) -> Vec<Column> {
    let plain = |name: &str, cell: Cell| Column { name: name.to_owned(), unit: String::new(), cell };
    let mut columns: Vec<Column> = labelled.then(|| plain("test", Cell::Label)).into_iter().collect();
    for (i, v) in condition::variables(surrogate).into_iter().enumerate() {
        columns.push(Column { name: v.name.to_owned(), unit: v.unit.to_owned(), cell: Cell::Variable(i) });
    }
    for (i, p) in surrogate.points().enumerate() {
        columns.push(Column { name: p.name.to_owned(), unit: p.unit.to_owned(), cell: Cell::Point(i) });
        columns.push(plain(&format!("{} low", p.name), Cell::Low(i)));
        columns.push(plain(&format!("{} high", p.name), Cell::High(i)));
    }
    columns.extend(surrogate.limits().enumerate().map(|(i, l)| plain(&format!("margin of {}", l.name), Cell::Margin(i))));
    if surrogate.uncertainty().is_some() {
        columns.push(plain("probability", Cell::Probability));
    }
    columns.extend([plain("verdict", Cell::Verdict), plain("binding", Cell::Binding), plain("in_domain", Cell::InDomain)]);
    columns
}

/// The columns called `name`, or those of the group of that name.
fn find(all: &[Column], name: &str) -> Vec<Column> {
    let own: Vec<Column> = all.iter().filter(|c| c.name == name || c.header() == name).take(1).cloned().collect();
    if own.is_empty() { all.iter().filter(|c| c.cell.is_of(name)).cloned().collect() } else { own }
}
