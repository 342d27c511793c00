//! The answer to a condition as a row of a table: which columns, with how many digits.

use coldplate_runtime::{Band, Limit, ShapeError, Surrogate};
use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use super::Acceptability;
use super::batch::{BatchRow, BatchRows};
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
    /// The names of the limits as cells of CSV.
    limit_cells: Vec<String>,
    /// Whether a chosen column tells of the uncertainty.
    with_bands: bool,
    /// Whether a chosen column needs the verdict.
    with_verdict: bool,
    held: Vec<f64>,
    digits: Option<usize>,
    confidence: f64,
}

/// The answer at one condition, for the columns to choose from.
pub(crate) struct ConditionAnswer<'r> {
    row: BatchRow<'r>,
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
        let limit_cells = surrogate.limits().map(|limit| quoted(limit.name)).collect();
        let with_bands = surrogate.uncertainty().is_some() && chosen.iter().any(|c| matches!(c.cell, Cell::Low(_) | Cell::High(_)));
        let with_verdict =
            with_bands || chosen.iter().any(|c| matches!(c.cell, Cell::Probability | Cell::Verdict | Cell::Binding | Cell::InDomain));
        let held = surrogate.held().map(|h| h.value).collect();
        Ok(Self { surrogate, chosen, half_widths, limits, limit_cells, with_bands, with_verdict, held, digits, confidence })
    }

    /// The header of a CSV file, with its line end.
    pub fn header(&self) -> String {
        self.chosen.iter().map(|c| quoted(&c.header())).collect::<Vec<_>>().join(",") + "\n"
    }

    /// Gives the answer at each row to `take`, in their order. The verdict on a row is left out, and stands as not
    /// acceptable, where no column needs it and `is_settled` says that another row is not acceptable.
    ///
    /// # Errors
    /// Errors of `take`.
    pub fn each(
        &self,
        rows: &BatchRows<'_>,
        is_settled: impl Fn() -> bool,
        mut take: impl FnMut(&ConditionAnswer<'_>) -> Result<()>,
    ) -> Result<()> {
        let points = self.half_widths.len();
        let mut values = vec![0.0; rows.lines.len() * points];
        let mut bands = vec![Band::default(); if self.with_bands { points } else { 0 }];
        let wrong = |e: ShapeError| Error::input(e.to_string());
        coldplate_batch::evaluate(self.surrogate, &rows.conditions, &mut values, &mut Box::default()).map_err(wrong)?;
        for (index, values) in values.chunks_exact(points.max(1)).enumerate() {
            let row = rows.row(index);
            let (mut probability, mut binding, mut verdict, mut in_domain) = (f64::NAN, None, Acceptability::NotAcceptable, false);
            if self.with_verdict || !is_settled() {
                if self.surrogate.uncertainty().is_some() {
                    let bands = self.with_bands.then_some(&mut bands[..]);
                    let found = self.surrogate.chance_at(row.condition, self.confidence, values, bands).map_err(wrong)?;
                    (probability, binding, verdict, in_domain) = (found.probability, found.binding, found.state, found.in_domain);
                } else {
                    let found = self.surrogate.verdict_at(row.condition, values).map_err(wrong)?;
                    (binding, verdict, in_domain) = (found.binding, found.state, found.in_domain);
                }
                if row.held != self.held {
                    (verdict, in_domain) = (Acceptability::Uncertain, false);
                }
            }
            take(&ConditionAnswer { row, values, bands: &bands, probability, binding, verdict, in_domain })?;
        }
        Ok(())
    }

    /// Appends a row of a CSV file, with its line end.
    pub fn csv(&self, answer: &ConditionAnswer<'_>, out: &mut Vec<u8>) {
        for (i, column) in self.chosen.iter().enumerate() {
            if i > 0 {
                out.push(b',');
            }
            match self.value(column.cell, answer) {
                Value::Number(number) => digits::push(number, self.digits, out),
                Value::Label(label) => out.extend_from_slice(quoted(label).as_bytes()),
                Value::Limit(limit) => out.extend_from_slice(limit.and_then(|i| self.limit_cells.get(i)).map_or("", |own| own).as_bytes()),
                Value::Word(word) => out.extend_from_slice(word.as_bytes()),
                Value::Truth(truth) => out.extend_from_slice(if truth { b"true" } else { b"false" }),
            }
        }
        out.push(b'\n');
    }

    /// The chosen columns of an answer as one flat JSON object.
    pub fn object<'r>(&'r self, answer: &'r ConditionAnswer<'r>) -> impl Serialize + 'r {
        Object { columns: self, answer }
    }

    fn value<'r>(&'r self, cell: Cell, answer: &ConditionAnswer<'r>) -> Value<'r> {
        let of = |list: &[f64], i: usize| list.get(i).copied().unwrap_or(f64::NAN);
        match cell {
            Cell::Label => Value::Label(answer.row.label.unwrap_or("")),
            Cell::Variable(v) => Value::Number(match v.checked_sub(answer.row.condition.len()) {
                None => of(answer.row.condition, v),
                Some(held) => of(answer.row.held, held),
            }),
            Cell::Point(p) => Value::Number(of(answer.values, p)),
            Cell::Low(p) => Value::Number(of(answer.values, p) - self.half_width(answer, p)),
            Cell::High(p) => Value::Number(of(answer.values, p) + self.half_width(answer, p)),
            Cell::Probability => Value::Number(answer.probability),
            Cell::Margin(l) => Value::Number(self.limits.get(l).map_or(f64::NAN, |limit| {
                limit.maximum - limit.kind.value(|point| of(answer.values, point), |variable| of(answer.row.condition, variable))
            })),
            Cell::Verdict => Value::Word(code(answer.verdict)),
            Cell::Binding => Value::Limit(answer.binding),
            Cell::InDomain => Value::Truth(answer.in_domain),
        }
    }

    fn half_width(&self, answer: &ConditionAnswer<'_>, point: usize) -> f64 {
        let own = self.half_widths.get(point).copied().unwrap_or(f64::NAN);
        answer.bands.get(point).map_or(own, |band| band.half_width())
    }
}

enum Value<'r> {
    Number(f64),
    Label(&'r str),
    /// Index of a limit, if there is one.
    Limit(Option<usize>),
    Word(&'static str),
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
                Value::Label(text) | Value::Word(text) => map.serialize_entry(&column.name, text)?,
                Value::Limit(limit) => {
                    map.serialize_entry(&column.name, &limit.and_then(|i| self.columns.limits.get(i)).map(|own| own.name))?;
                }
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
