//! Is a condition acceptable? Answers from an opened surrogate: temperatures with their bands,
//! limits with their margins, the verdict, and the inverse question.
//!
//! ```text
//! acceptable        all limits are kept, with a probability of at least 95 % or the one asked for
//! not acceptable    they are kept with a probability of at most 5 %, or one minus that
//! uncertain         otherwise, and always outside the fitted range
//! ```
//!
//! If a surrogate has no uncertainty, value and band of its fit decide: acceptable if every limit is kept at the upper end
//! of the band, not acceptable if one is broken at the lower end.

mod batch;
mod chances;
mod chaos;
pub mod columns;
pub mod condition;
mod digits;
pub mod indices;
pub mod instruments;
pub mod inverse;
mod learnt_readings;
pub mod optimum;
pub mod question;
pub mod record;
mod slack;
pub mod stated;
pub mod stream;
pub mod trade_off;
pub mod update;

pub use coldplate_runtime::{Acceptability, LimitKind, Surrogate};
pub use condition::condition;
pub use inverse::{Inverse, Stop, free, free_within};
pub use optimum::{FreeVariable, Objective, Optimum, Sense, best};
pub use trade_off::{TradeOff, trade_off};

use coldplate_runtime::{Band, CONFIDENCE, EmptyCorner, NINETY_FIVE, Variable};
use schemars::JsonSchema;
use serde::Serialize;

use super::fit::model::HeldSpec;
use coldplate_base::error::{Error, Result};

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
    /// Parts of the band, if the surrogate has uncertainty.
    pub parts: Option<BandParts>,
}

/// Parts of the half width of a 95 % band; each is the half width of a band by this part alone.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct BandParts {
    /// Half width by the fit to the solver's results.
    pub fit: f64,
    /// Half width by the mesh of the solver, if its error is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<f64>,
    /// Half width by the machine's parameters.
    pub parameters: f64,
    /// Half width by the model error.
    pub misses: f64,
}

impl BandParts {
    /// Parts of a band of a surrogate; `mesh_is_known` says whether its file states the error of the mesh.
    fn of(band: Band, mesh_is_known: bool) -> Self {
        let [fit, mesh, parameters, misses] = [band.fit, band.mesh, band.parameters, band.misses].map(|own| NINETY_FIVE * own);
        Self { fit, mesh: mesh_is_known.then_some(mesh), parameters, misses }
    }
}

/// A limit at one condition.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
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
    /// Unit of the margin, that of a difference.
    pub margin_unit: String,
    /// Probability that the limit is kept, if the surrogate has uncertainty.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub probability: Option<f64>,
    /// Verdict by this limit alone, inside the fitted range.
    #[serde(skip)]
    pub state: Acceptability,
}

/// A variable outside the range the surrogate was fitted on.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct OutOfRange {
    /// Name of the variable.
    #[serde(rename = "variable")]
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// Value that was asked for.
    pub value: f64,
    /// Smallest value of the fitted range.
    pub low: f64,
    /// Largest value of the fitted range.
    pub high: f64,
    /// Value of the other variable that the range belongs to, where rows fill only a part of the ranges of both.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub beside: Option<Beside>,
}

/// A variable whose value narrows the range of another.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Beside {
    /// Name of the variable.
    #[serde(rename = "variable")]
    pub name: String,
    /// Unit of its value.
    pub unit: String,
    /// Value that was asked for.
    pub value: f64,
}

/// Everything there is to say about one condition.
#[derive(Debug, Clone, PartialEq)]
pub struct SurrogateAnswer {
    /// The condition: one value per variable of the surrogate, and one per variable that was held, in their units.
    pub condition: Vec<f64>,
    /// The variables that were held while the surrogate was made; the answer holds for these values only.
    pub held: Vec<HeldSpec>,
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
    /// The variables outside their range, or not at the value they were held at.
    pub outside: Vec<OutOfRange>,
    /// Probability of the verdict and the contributions that decide it, if the surrogate has uncertainty.
    pub chance: Option<ChanceAnswer>,
}

/// The probability of a verdict, and the contributions that decide it.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ChanceAnswer {
    /// Probability that all limits are kept together.
    pub probability: f64,
    /// The probability that was asked for.
    pub confidence: f64,
    /// Parts of the variance of the limit that decides, the largest share first: parameters, the fit, and the model error.
    pub deciding: Vec<VarianceShare>,
    /// The point whose reading at this condition would tell most about that limit, if any would.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub would_settle: Option<TellingReading>,
}

/// A share of a variance.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct VarianceShare {
    /// Key of a parameter, name of a factor, `fit`, `the mesh`, or `what the model misses`.
    pub name: String,
    /// Share of the variance; shares of correlated parameters may be negative.
    pub share: f64,
    /// Whether the standard deviation is assumed, since the machine file does not state one.
    pub is_assumed: bool,
}

/// A reading that would tell much.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct TellingReading {
    /// The point.
    pub point: String,
    /// Standard deviation of the instrument that is assumed.
    pub deviation: f64,
    /// Unit of the standard deviation.
    pub unit: String,
    /// Share of the limit's variance that the reading would take away.
    pub share: f64,
}

impl SurrogateAnswer {
    /// Name of the limit that decides.
    pub fn binding_name(&self) -> Option<&str> {
        self.binding.and_then(|i| self.limits.get(i)).map(|l| l.name.as_str())
    }
}

/// Temperatures, limits and verdict at the condition `x`, in the surrogate's variables and units; see [`mod@condition`] for
/// the held ones.
///
/// # Errors
/// The number of values in `x` is not that of the variables, with or without the held ones.
pub fn query(surrogate: &Surrogate<'_>, x: &[f64]) -> Result<SurrogateAnswer> {
    query_at(surrogate, x, CONFIDENCE)
}

/// Temperatures, limits and verdict at the condition `x`, at another confidence than 95 %, between one half and one. A
/// surrogate without uncertainty ignores it.
///
/// # Errors
/// Errors of [`query`].
pub fn query_at(surrogate: &Surrogate<'_>, x: &[f64], confidence: f64) -> Result<SurrogateAnswer> {
    let mut values = vec![0.0; surrogate.point_count()];
    let (x, stated) = split(surrogate, x);
    let outside = outside(surrogate, x, stated);
    let wrong =
        |e: coldplate_runtime::ShapeError| Error::input(format!("a condition of this surrogate has {} values", e.expected)).read(e.found);
    let mut bands = vec![Band::default(); values.len()];
    let (binding, mut state, mut in_domain, chance) = if surrogate.uncertainty().is_some() {
        let found = surrogate.assess(x, None, confidence, &mut values, &mut bands).map_err(wrong)?;
        let chance = chances::explain(surrogate, x, &values, found, confidence);
        (found.binding, found.state, found.in_domain, Some(chance))
    } else {
        let found = surrogate.query(x, &mut values).map_err(wrong)?;
        (found.binding, found.state, found.in_domain, None)
    };
    let is_open = chance.is_some();
    let temperatures = surrogate.points().zip(&values).zip(&bands).map(|((point, value), band)| {
        let half = if is_open { band.half_width() } else { point.half_width };
        Temperature {
            name: point.name.to_owned(),
            unit: point.unit.to_owned(),
            value: *value,
            low: value - half,
            high: value + half,
            parts: is_open.then(|| BandParts::of(*band, surrogate.mesh_half_width(0).is_some())),
        }
    });
    let limits = surrogate.limits().enumerate().filter_map(|(i, limit)| {
        let at = surrogate.limit_value(i, x, &values)?;
        let probability = surrogate.limit_chance(i, x, None, &values).filter(|_| is_open).map(|own| own.probability);
        Some(LimitAnswer {
            probability,
            name: limit.name.to_owned(),
            unit: limit_unit(surrogate, limit.kind),
            margin_unit: margin_unit(surrogate, limit.kind),
            value: at.value,
            low: at.low,
            high: at.high,
            limit: at.maximum,
            margin: at.margin,
            state: at.state,
        })
    });
    if !outside.is_empty() {
        (in_domain, state) = (false, Acceptability::Uncertain);
    }
    let held: Vec<HeldSpec> =
        surrogate.held().map(|held| HeldSpec { name: held.name.to_owned(), unit: held.unit.to_owned(), value: held.value }).collect();
    Ok(SurrogateAnswer {
        condition: x.iter().chain(stated).copied().chain(held.iter().map(|held| held.value).skip(stated.len())).collect(),
        held,
        temperatures: temperatures.collect(),
        limits: limits.collect(),
        binding,
        verdict: state,
        in_domain,
        outside,
        chance,
    })
}

/// Splits `x` into the values of the varied variables and the stated values of held ones.
fn split<'x>(surrogate: &Surrogate<'_>, x: &'x [f64]) -> (&'x [f64], &'x [f64]) {
    let (varied, held) = (surrogate.variable_count(), surrogate.held().count());
    if (varied + 1..=varied + held).contains(&x.len()) { x.split_at(varied) } else { (x, &[]) }
}

/// The variables of `x` that lie outside their fitted ranges, and those of `stated` that were held at another value.
fn outside(surrogate: &Surrogate<'_>, x: &[f64], stated: &[f64]) -> Vec<OutOfRange> {
    let all = condition::variables(surrogate);
    let (varied, held) = all.split_at(surrogate.variable_count().min(x.len()));
    let values = varied.iter().zip(x).chain(held.iter().zip(stated)).filter(|(v, x)| !(v.low..=v.high).contains(*x));
    let of = |(v, x): (&Variable<'_>, &f64)| OutOfRange {
        name: v.name.to_owned(),
        unit: v.unit.to_owned(),
        value: *x,
        low: v.low,
        high: v.high,
        beside: None,
    };
    values.map(of).chain(in_corners(surrogate, varied, x)).collect()
}

/// The values outside their ranges that stay there whatever values the variables `free` take.
fn outside_besides(surrogate: &Surrogate<'_>, found: Vec<OutOfRange>, free: &[usize]) -> Vec<OutOfRange> {
    let variables = condition::variables(surrogate);
    let is_free = |name: &str| free.iter().any(|index| variables.get(*index).is_some_and(|v| v.name == name));
    let in_corner = |out: &OutOfRange| out.beside.as_ref().is_some_and(|other| is_free(&other.name) || is_free(&out.name));
    found.into_iter().filter(|out| !in_corner(out)).collect()
}

/// The given values that lie outside the fitted ranges; others are open.
///
/// # Errors
/// Errors of [`condition::partial`].
pub fn outside_of_given(surrogate: &Surrogate<'_>, given: &[(String, String)]) -> Result<Vec<OutOfRange>> {
    let x = condition::partial(surrogate, given)?;
    let filled = x.iter().zip(condition::variables(surrogate)).map(|(x, v)| x.unwrap_or(f64::midpoint(v.low, v.high)));
    let filled: Vec<f64> = filled.collect();
    let (varied, held) = filled.split_at(surrogate.variable_count().min(filled.len()));
    let is_given = |out: &OutOfRange| given.iter().any(|(name, _)| *name == out.name);
    Ok(outside(surrogate, varied, held).into_iter().filter(is_given).collect())
}

/// The variables of `x` that lie in a corner without a row, each with the range that is left to it beside the other.
fn in_corners(surrogate: &Surrogate<'_>, variables: &[Variable<'_>], x: &[f64]) -> Vec<OutOfRange> {
    let narrowed = |corner: EmptyCorner| {
        let [i, j] = corner.variables;
        let (first, second, a, b) = (variables.get(i)?, variables.get(j)?, x.get(i)?, x.get(j)?);
        let (mean, half) = (0.5 * (second.low + second.high), 0.5 * (second.high - second.low));
        let u = (2.0 * a - first.low - first.high) / (first.high - first.low);
        let left = corner.reach - if corner.is_low[0] { -u } else { u };
        let (low, high) = if corner.is_low[1] { (mean - half * left, second.high) } else { (second.low, mean + half * left) };
        let (low, high) = (low.clamp(second.low, second.high), high.clamp(second.low, second.high));
        (!(low..=high).contains(b)).then(|| OutOfRange {
            name: second.name.to_owned(),
            unit: second.unit.to_owned(),
            value: *b,
            low,
            high,
            beside: Some(Beside { name: first.name.to_owned(), unit: first.unit.to_owned(), value: *a }),
        })
    };
    surrogate.empty_corners().filter_map(narrowed).collect()
}

/// Unit of the limited quantity.
fn limit_unit(surrogate: &Surrogate<'_>, kind: LimitKind<coldplate_runtime::Indices<'_>>) -> String {
    match kind {
        LimitKind::Maximum { .. } => kind.points().next().and_then(|i| surrogate.point(i)).map_or("", |p| p.unit).to_owned(),
        _ => margin_unit(surrogate, kind),
    }
}

/// Differences of Celsius temperatures are kelvins.
fn margin_unit(surrogate: &Surrogate<'_>, kind: LimitKind<coldplate_runtime::Indices<'_>>) -> String {
    match kind.points().next().and_then(|i| surrogate.point(i)).map_or("", |p| p.unit) {
        "degC" | "°C" => "K".into(),
        unit => unit.to_owned(),
    }
}
