//! Is a condition acceptable? Answers from an opened surrogate: temperatures with their bands,
//! limits with their margins, the verdict, and the inverse question.
//!
//! ```text
//! acceptable        value + band <= limit, for every limit
//! not acceptable    value - band >  limit, for some limit
//! uncertain         otherwise, and always outside the fitted range
//! ```

pub mod batch;
pub mod columns;
pub mod condition;
pub mod inverse;
pub mod record;
pub mod stream;

pub use coldplate_runtime::{Acceptability, LimitKind, Surrogate};
pub use condition::condition;
pub use inverse::{Inverse, free, free_within};

use coldplate_runtime::Indices;
use serde::Serialize;

use super::fit::model::Held;
use crate::error::{Error, Result};

/// The value of a measurement point, with the band that covers 95 % of conditions inside the range.
#[derive(Debug, Clone, PartialEq)]
pub struct Temperature {
    /// Name of the point.
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// The surrogate's value.
    pub value: f64,
    /// Lower end of the band.
    pub low: f64,
    /// Upper end of the band.
    pub high: f64,
}

/// A limit at one condition.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LimitAnswer {
    /// Name of the limit.
    pub name: String,
    /// Unit of the values: that of a point for a maximum, of a difference for the others.
    pub unit: String,
    /// The limited quantity.
    pub value: f64,
    /// Lower end of its band.
    pub low: f64,
    /// Upper end of its band.
    pub high: f64,
    /// The largest value allowed.
    pub limit: f64,
    /// `limit - value`: positive where the limit is kept.
    pub margin: f64,
    /// What this limit alone says, inside the fitted range.
    #[serde(skip)]
    pub state: Acceptability,
}

/// A variable outside the range the surrogate was fitted on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outside {
    /// Name of the variable.
    #[serde(rename = "variable")]
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// What was asked for.
    pub value: f64,
    /// Smallest value of the fitted range.
    pub low: f64,
    /// Largest value of the fitted range.
    pub high: f64,
}

/// Everything there is to say about one condition.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// The condition: one value per variable of the surrogate, and one per variable that was held, in their units.
    pub condition: Vec<f64>,
    /// The variables that were held while the surrogate was made; what is said is true there alone.
    pub held: Vec<Held>,
    /// One per measurement point.
    pub temperatures: Vec<Temperature>,
    /// One per limit.
    pub limits: Vec<LimitAnswer>,
    /// Index of the limit that decides: among those in the worst state, the one with the smallest margin.
    pub binding: Option<usize>,
    /// The verdict.
    pub verdict: Acceptability,
    /// True if every variable lies within its fitted range, and every held one has the value it was held at.
    pub in_domain: bool,
    /// The variables that do not.
    pub outside: Vec<Outside>,
}

impl Answer {
    /// Name of the limit that decides.
    pub fn binding_name(&self) -> Option<&str> {
        self.binding.and_then(|i| self.limits.get(i)).map(|l| l.name.as_str())
    }
}

/// Temperatures, limits and verdict at the condition `x`, in the surrogate's variables and units; see [`mod@condition`] for
/// the held ones.
///
/// # Errors
/// If `x` has another number of values than there are variables, with or without the held ones.
pub fn query(surrogate: &Surrogate<'_>, x: &[f64]) -> Result<Answer> {
    let mut values = vec![0.0; surrogate.point_count()];
    let (x, stated) = split(surrogate, x);
    let outside = outside(surrogate, x, stated);
    let mut verdict = surrogate
        .query(x, &mut values)
        .map_err(|e| Error::input(format!("a condition of this surrogate has {} values", e.expected)).read(e.found))?;
    let temperatures = surrogate.points().zip(&values).map(|(point, value)| Temperature {
        name: point.name.to_owned(),
        unit: point.unit.to_owned(),
        value: *value,
        low: value - point.half_width,
        high: value + point.half_width,
    });
    let limits = surrogate.limits().enumerate().filter_map(|(i, limit)| {
        let at = surrogate.limit_value(i, x, &values)?;
        Some(LimitAnswer {
            name: limit.name.to_owned(),
            unit: limit_unit(surrogate, limit.kind),
            value: at.value,
            low: at.low,
            high: at.high,
            limit: at.maximum,
            margin: at.margin,
            state: at.state,
        })
    });
    if !outside.is_empty() {
        (verdict.in_domain, verdict.state) = (false, Acceptability::Uncertain);
    }
    let held: Vec<Held> =
        surrogate.held().map(|held| Held { name: held.name.to_owned(), unit: held.unit.to_owned(), value: held.value }).collect();
    Ok(Answer {
        condition: x.iter().chain(stated).copied().chain(held.iter().map(|held| held.value).skip(stated.len())).collect(),
        held,
        temperatures: temperatures.collect(),
        limits: limits.collect(),
        binding: verdict.binding,
        verdict: verdict.state,
        in_domain: verdict.in_domain,
        outside,
    })
}

/// The values of the variables, and those of the held ones that are stated.
fn split<'x>(surrogate: &Surrogate<'_>, x: &'x [f64]) -> (&'x [f64], &'x [f64]) {
    let (varied, held) = (surrogate.variable_count(), surrogate.held().count());
    if (varied + 1..=varied + held).contains(&x.len()) { x.split_at(varied) } else { (x, &[]) }
}

/// The variables of `x` that lie outside their fitted ranges, and those of `stated` that were held at another value.
fn outside(surrogate: &Surrogate<'_>, x: &[f64], stated: &[f64]) -> Vec<Outside> {
    let all = condition::variables(surrogate);
    let (varied, held) = all.split_at(surrogate.variable_count().min(x.len()));
    let values = varied.iter().zip(x).chain(held.iter().zip(stated)).filter(|(v, x)| !(v.low..=v.high).contains(*x));
    values.map(|(v, x)| Outside { name: v.name.to_owned(), unit: v.unit.to_owned(), value: *x, low: v.low, high: v.high }).collect()
}

/// Differences of Celsius temperatures are kelvins.
fn limit_unit(surrogate: &Surrogate<'_>, kind: LimitKind<Indices<'_>>) -> String {
    let difference = !matches!(kind, LimitKind::Maximum { .. });
    let unit = kind.points().next().and_then(|i| surrogate.point(i)).map_or("", |p| p.unit);
    if difference && matches!(unit, "degC" | "°C") { "K".into() } else { unit.to_owned() }
}
