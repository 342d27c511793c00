//! Answers as outside programs read them: each field is a key of `coldplate query --json`.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::ser::{Serialize, SerializeMap, Serializer};

use super::batch::BatchRow;
use super::condition;
use super::trade_off::Exchange;
use super::{
    Acceptability, BandParts, ChanceAnswer, FreeVariable, Inverse, LimitAnswer, Objective, Optimum, OutOfRange, Sense, Stop, Surrogate,
    SurrogateAnswer, Temperature,
};
use coldplate_base::units::celsius;

/// The answer at one condition.
#[derive(Debug, Clone, serde::Serialize, JsonSchema)]
#[non_exhaustive]
#[allow(missing_docs)]
pub struct QueryRecord {
    pub temperatures: BTreeMap<String, PointAnswerRecord>,
    pub verdict: &'static str,
    pub limits: Vec<LimitAnswer>,
    /// Name of the limit that decides.
    pub binding: Option<String>,
    pub in_domain: bool,
    /// Probability that all limits are kept, the probability that was asked for, and the contributions that decide; only
    /// for surrogates with uncertainty.
    #[serde(flatten)]
    pub chance: Option<ChanceAnswer>,
    /// Variables that were held while the surrogate was made, each with the value it was held at.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub held: BTreeMap<String, ValueRecord>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outside: Vec<OutOfRange>,
    /// The answer to the inverse question, if it was asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub free: Option<FreeRecord>,
    /// The best acceptable condition, if it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub optimum: Option<OptimumRecord>,
    /// The smallest acceptable values of one variable for values of another, if they were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trade_off: Option<TradeOffRecord>,
    /// Row of a table of conditions, if the condition comes from one.
    #[serde(flatten)]
    pub row: Option<RowRecord>,
}

/// The value of a point under the name of its unit, and its band. Kelvins are given in degC.
#[derive(Debug, Clone, serde::Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct PointAnswerRecord {
    #[serde(flatten)]
    #[schemars(with = "BTreeMap<String, f64>")]
    pub value: InUnit,
    pub low: f64,
    pub high: f64,
    /// Half widths of bands by each part of the uncertainty alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parts: Option<BandParts>,
}

/// A value under the name of its unit.
#[derive(Debug, Clone)]
#[allow(missing_docs)]
pub struct InUnit {
    pub unit: String,
    pub value: f64,
}

impl Serialize for InUnit {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(1))?;
        map.serialize_entry(&self.unit, &self.value)?;
        map.end()
    }
}

/// The smallest value of one variable that makes a condition acceptable.
#[derive(Debug, Clone, Default, serde::Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct FreeRecord {
    pub variable: String,
    pub unit: String,
    /// Smallest acceptable value; `null` if there is none.
    pub value: Option<f64>,
    /// Lower end of the acceptable interval: from here to `high` every value is acceptable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub low: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub high: Option<f64>,
    /// Limit that is no longer kept below `low`; missing where the range ends.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub low_stopped_by: Option<String>,
    /// Limit that is no longer kept above `high`; missing where the range ends.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub high_stopped_by: Option<String>,
    /// Value that comes closest, if none is acceptable.
    #[serde(flatten)]
    pub nearest: Option<NearestRecord>,
}

/// The value that comes closest to being acceptable.
#[derive(Debug, Clone, serde::Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct NearestRecord {
    pub best: f64,
    /// Name of the limit that is broken there.
    pub binding: String,
    /// Excess of the limit's band over the limit.
    pub excess: f64,
    pub excess_unit: String,
}

/// The formula that was made smallest or largest, and the values of the variables that do it.
#[derive(Debug, Clone, serde::Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct OptimumRecord {
    /// Sense of the search: `minimise` or `maximise`.
    pub sense: &'static str,
    pub formula: String,
    /// Value of the formula; `null` if no condition is acceptable.
    pub value: Option<f64>,
    pub free: BTreeMap<String, ValueRecord>,
}

/// Rows of a trade-off.
#[derive(Debug, Clone, serde::Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct TradeOffRecord {
    /// The variable whose smallest acceptable value is given.
    pub variable: String,
    pub unit: String,
    /// The variable whose values it is given for.
    pub against: String,
    pub against_unit: String,
    pub rows: Vec<ExchangeRecord>,
}

/// `low` and `high` are the ends of the acceptable interval, `null` where no value is acceptable.
#[derive(Debug, Clone, serde::Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct ExchangeRecord {
    pub at: f64,
    pub low: Option<f64>,
    pub high: Option<f64>,
}

/// Row of a table of conditions that an answer belongs to.
#[derive(Debug, Clone, serde::Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct RowRecord {
    /// Line in the file, from 1.
    pub line: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub test: Option<String>,
    pub condition: BTreeMap<String, ValueRecord>,
}

/// A number with its unit.
#[derive(Debug, Clone, serde::Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct ValueRecord {
    pub value: f64,
    pub unit: String,
}

/// The word for a verdict: `acceptable`, `not_acceptable` or `uncertain`.
pub fn code(verdict: Acceptability) -> &'static str {
    match verdict {
        Acceptability::Acceptable => "acceptable",
        Acceptability::NotAcceptable => "not_acceptable",
        Acceptability::Uncertain => "uncertain",
    }
}

impl SurrogateAnswer {
    /// The answer for other programs.
    pub fn record(&self) -> QueryRecord {
        QueryRecord {
            temperatures: self.temperatures.iter().map(|point| (point.name.clone(), PointAnswerRecord::of(point))).collect(),
            verdict: code(self.verdict),
            limits: self.limits.clone(),
            binding: self.binding_name().map(str::to_owned),
            in_domain: self.in_domain,
            chance: self.chance.clone(),
            held: self.held.iter().map(|held| (held.name.clone(), ValueRecord { value: held.value, unit: held.unit.clone() })).collect(),
            outside: self.outside.clone(),
            free: None,
            optimum: None,
            trade_off: None,
            row: None,
        }
    }

    /// The answer to a row of a table of conditions, for other programs.
    pub(crate) fn record_of_row(&self, surrogate: &Surrogate<'_>, row: &BatchRow<'_>) -> QueryRecord {
        let value =
            |(v, x): (coldplate_runtime::Variable<'_>, &f64)| (v.name.to_owned(), ValueRecord { value: *x, unit: v.unit.to_owned() });
        let condition = condition::variables(surrogate).into_iter().zip(row.condition.iter().chain(row.held)).map(value).collect();
        QueryRecord { row: Some(RowRecord { line: row.line, test: row.label.map(str::to_owned), condition }), ..self.record() }
    }
}

impl Inverse {
    /// The answer to the inverse question on `variable`, for other programs. `answer` is the one at the value found, or
    /// that of a plain query outside the fitted range.
    pub fn record(&self, variable: &coldplate_runtime::Variable<'_>, answer: &SurrogateAnswer) -> QueryRecord {
        let free = FreeRecord { variable: variable.name.to_owned(), unit: variable.unit.to_owned(), ..FreeRecord::default() };
        let record = answer.record();
        match self {
            Self::Found { smallest, until, stops, .. } => {
                let [low_stopped_by, high_stopped_by] = stops.map(|stop| match stop {
                    Stop::Limit(limit) => answer.limits.get(limit).map(|limit| limit.name.clone()),
                    Stop::Range | Stop::NoRows => None,
                });
                let (low, high) = (Some(*smallest), Some(*until));
                let free = FreeRecord { value: low, low, high, low_stopped_by, high_stopped_by, ..free };
                QueryRecord { free: Some(free), ..record }
            }
            Self::Nowhere { best, limit, excess, answer } => {
                let (binding, excess_unit) = answer.limits.get(*limit).map(|l| (l.name.clone(), l.unit.clone())).unwrap_or_default();
                let nearest = Some(NearestRecord { best: *best, binding, excess: *excess, excess_unit });
                QueryRecord { free: Some(FreeRecord { nearest, ..free }), ..record }
            }
            // Without a value for the free variable there is nothing to evaluate.
            Self::OutsideRange(_) => {
                QueryRecord { temperatures: BTreeMap::new(), limits: Vec::new(), binding: None, free: Some(free), ..record }
            }
        }
    }
}

impl Optimum {
    /// The answer for other programs. `free` are the variables that were chosen, `outside` is the answer of a plain
    /// query outside the fitted range.
    pub fn record(
        &self,
        surrogate: &Surrogate<'_>,
        objective: &Objective,
        free: &[FreeVariable],
        outside: &SurrogateAnswer,
    ) -> QueryRecord {
        let (answer, value) = match self {
            Self::Found { answer, value } => (answer, Some(*value)),
            Self::Nowhere { answer } => (answer, None),
            Self::OutsideRange(_) => (outside, None),
        };
        let variables = condition::variables(surrogate);
        let chosen = free.iter().filter_map(|own| {
            let (variable, value) = (variables.get(own.index)?, *answer.condition.get(own.index)?);
            Some((variable.name.to_owned(), ValueRecord { value, unit: variable.unit.to_owned() }))
        });
        let sense = match objective.sense() {
            Sense::Minimise => "minimise",
            Sense::Maximise => "maximise",
        };
        let optimum = OptimumRecord { sense, formula: objective.text().to_owned(), value, free: chosen.collect() };
        QueryRecord { optimum: Some(optimum), ..answer.record() }
    }
}

impl TradeOffRecord {
    /// The record of the smallest acceptable values of `variable` for values of `against`.
    pub fn new(variable: &coldplate_runtime::Variable<'_>, against: &coldplate_runtime::Variable<'_>, rows: &[Exchange]) -> Self {
        let row = |own: &Exchange| ExchangeRecord {
            at: own.given,
            low: own.acceptable.map(|interval| interval.from),
            high: own.acceptable.map(|interval| interval.until),
        };
        Self {
            variable: variable.name.to_owned(),
            unit: variable.unit.to_owned(),
            against: against.name.to_owned(),
            against_unit: against.unit.to_owned(),
            rows: rows.iter().map(row).collect(),
        }
    }
}

impl PointAnswerRecord {
    fn of(point: &Temperature) -> Self {
        let values = [point.value, point.low, point.high];
        let (unit, [value, low, high]) = match point.unit.as_str() {
            "K" if values.iter().all(|v| v.is_finite()) => ("degC".to_string(), values.map(celsius)),
            "" => ("value".into(), values),
            unit => (unit.replace("°C", "degC"), values),
        };
        Self { value: InUnit { unit, value }, low, high, parts: point.parts }
    }
}
