//! A question about a surrogate, as the command line and the service put it, and the reply to it.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;

use coldplate_runtime::{CONFIDENCE, Surrogate, Variable};
use schemars::JsonSchema;
use serde::de::{Deserializer, MapAccess, Visitor};
use serde::{Deserialize, Serialize};

use super::indices::{self, SobolIndices};
use super::record::{QueryRecord, TradeOffRecord};
use super::stated::{self, StatedValue};
use super::stream::{self, AnswerForm};
use super::trade_off::{self, TradeOff};
use super::{FreeVariable, Inverse, Objective, Optimum, Sense, SurrogateAnswer, best, condition, free_within, query_at};
use coldplate_base::error::{Error, Result};

/// A question: a condition, and possibly a search for values that make it acceptable.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a question, which is an object")]
pub struct Question {
    /// Variables, held ones and parameters by name, as `"coolant_flow": "9.42 L/min"` or `"coolant_flow [L/min]": 9.42`.
    #[serde(default, deserialize_with = "given")]
    #[schemars(with = "BTreeMap<String, Stated>", extend("default" = {}))]
    pub condition: Vec<StatedValue>,
    /// Probability with which a verdict is said: above 0.5, below 1.
    #[serde(default = "usual_confidence")]
    #[schemars(extend("exclusiveMinimum" = 0.5, "exclusiveMaximum" = 1.0))]
    pub confidence: f64,
    /// Find the smallest value of this variable that makes the condition acceptable, as `NAME` or `NAME=LOW..HIGH`; of two, the
    /// smallest of the first for values of the second.
    #[serde(default)]
    pub free: Vec<String>,
    /// Among the acceptable conditions, the one that makes a formula smallest.
    #[serde(default)]
    pub minimise: Option<String>,
    /// Among the acceptable conditions, the one that makes a formula largest.
    #[serde(default)]
    pub maximise: Option<String>,
    /// Share of each variable and uncertain number in the variance: Sobol' indices over the ranges of the variables that are
    /// not given.
    #[serde(default)]
    pub indices: bool,
}

impl Default for Question {
    fn default() -> Self {
        Self { condition: Vec::new(), confidence: CONFIDENCE, free: Vec::new(), minimise: None, maximise: None, indices: false }
    }
}

/// A value as JSON has it: text with its unit, or a number whose unit stands beside the name.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
enum Stated {
    Text(String),
    Number(f64),
}

fn check_confidence(confidence: f64) -> Result<()> {
    if confidence > 0.5 && confidence < 1.0 {
        return Ok(());
    }
    Err(Error::input("a probability above 0.5 and below 1 is wanted, for example 0.95").at_key("confidence").read(confidence))
}

fn usual_confidence() -> f64 {
    CONFIDENCE
}

/// The pairs of an object in their order, so that a name given twice is seen.
fn given<'de, D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Vec<StatedValue>, D::Error> {
    struct Pairs;
    impl<'de> Visitor<'de> for Pairs {
        type Value = Vec<StatedValue>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("an object of names and values")
        }

        fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> std::result::Result<Self::Value, M::Error> {
            let mut pairs = Vec::new();
            while let Some((name, value)) = map.next_entry::<Cow<'de, str>, Stated>()? {
                pairs.push(match (name.split_once('['), value) {
                    (_, Stated::Text(text)) => (name.into_owned(), text),
                    (Some((name, unit)), Stated::Number(number)) => {
                        (name.trim().to_owned(), format!("{number} {}", unit.trim().trim_end_matches(']').trim()))
                    }
                    (None, Stated::Number(number)) => (name.into_owned(), number.to_string()),
                });
            }
            Ok(pairs)
        }
    }
    deserializer.deserialize_map(Pairs)
}

/// The reply to a question.
#[derive(Debug, Clone)]
pub enum QuestionReply {
    /// The answer at the condition.
    At(SurrogateAnswer),
    /// The smallest acceptable value of one variable, and the answer there, or the answer to a plain query if the
    /// condition lies outside the fitted range.
    Smallest(FreeVariable, Inverse, SurrogateAnswer),
    /// The smallest acceptable values of the first variable for values of the second, and the answer to a plain query
    /// at the ends of both.
    Exchanged([FreeVariable; 2], TradeOff, SurrogateAnswer),
    /// The best acceptable condition, and the answer to a plain query if nothing was chosen.
    Best(Objective, Vec<FreeVariable>, Optimum, SurrogateAnswer),
    /// Shares of variables and uncertain numbers in the variance.
    Indices(SobolIndices),
}

/// A reply as outside programs read it.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[serde(untagged)]
#[allow(missing_docs)]
pub enum ReplyRecord {
    Query(Box<QueryRecord>),
    Indices(SobolIndices),
}

impl Question {
    /// Whether the question asks for the answer at one condition of the surrogate as it is: a matter of microseconds.
    pub fn is_plain(&self, surrogate: &Surrogate<'_>) -> bool {
        !self.is_open() && !self.indices && !stated::changes(surrogate, &self.condition)
    }

    /// Whether variables are to be chosen.
    fn is_open(&self) -> bool {
        !self.free.is_empty() || self.minimise.is_some() || self.maximise.is_some()
    }

    /// The reply of a surrogate in which parameters and held variables already have the stated values.
    ///
    /// # Errors
    /// Questions that exclude each other; a wrong, doubled or missing variable; a value without its unit; a formula that cannot
    /// be read; errors of the searches.
    pub fn ask(&self, surrogate: &Surrogate<'_>) -> Result<QuestionReply> {
        check_confidence(self.confidence)?;
        if self.indices && self.is_open() {
            return Err(Error::input("indices look at variables that are not given; nothing is chosen for them")
                .at_key("indices")
                .help("ask for the indices alone"));
        }
        if self.indices {
            let open = condition::varied(surrogate, condition::partial(surrogate, &self.condition)?)?;
            return indices::indices(surrogate, &open).map(QuestionReply::Indices);
        }
        if self.is_open() {
            return self.choose(surrogate);
        }
        query_at(surrogate, &condition::condition(surrogate, &self.condition)?, self.confidence).map(QuestionReply::At)
    }

    fn choose(&self, surrogate: &Surrogate<'_>) -> Result<QuestionReply> {
        let aim = |sense, formula, key: &str| Objective::parse(surrogate, sense, formula).map_err(|e| e.at_key(key)).map(Some);
        let aim = match (&self.minimise, &self.maximise) {
            (Some(_), Some(_)) => return Err(Error::input("one formula is made smallest, or largest").at_key("minimise, maximise")),
            (Some(formula), None) => aim(Sense::Minimise, formula, "--minimise")?,
            (None, Some(formula)) => aim(Sense::Maximise, formula, "--maximise")?,
            (None, None) => None,
        };
        let mut x = condition::partial(surrogate, &self.condition)?;
        let mut free = self.free.iter().map(|asked| asked_for(surrogate, asked, &x)).collect::<Result<Vec<_>>>()?;
        if free.is_empty() {
            // Without `free`, all variables that are not given are free.
            let open = (0..surrogate.variable_count()).filter(|index| x.get(*index).is_some_and(Option::is_none));
            free.extend(open.filter_map(|index| surrogate.variable(index).map(|v| FreeVariable { index, low: v.low, high: v.high })));
            if free.is_empty() {
                return Err(Error::input("no variable is free")
                    .at_key("--free")
                    .help("leave out the value of one, or name it with --free"));
            }
        }
        for own in &free {
            x[own.index] = Some(own.low);
        }
        let x = condition::complete(surrogate, x)?;
        match (aim, free.as_slice()) {
            (Some(aim), _) => {
                let found = best(surrogate, &x, &free, &aim, self.confidence)?;
                Ok(QuestionReply::Best(aim, free, found, query_at(surrogate, &x, self.confidence)?))
            }
            (None, [only]) => {
                let found = free_within(surrogate, &x, only.index, Some((only.low, only.high)), self.confidence)?;
                let answer = match &found {
                    Inverse::Found { answer, .. } | Inverse::Nowhere { answer, .. } => answer.clone(),
                    Inverse::OutsideRange(_) => query_at(surrogate, &x, self.confidence)?,
                };
                Ok(QuestionReply::Smallest(*only, found, answer))
            }
            (None, [first, second]) => {
                let found = trade_off::trade_off(surrogate, &x, *first, *second, self.confidence)?;
                Ok(QuestionReply::Exchanged([*first, *second], found, query_at(surrogate, &x, self.confidence)?))
            }
            (None, _) => Err(Error::input("of three free variables and more nothing says which is to be small")
                .at_key("--free")
                .help("add --minimise FORMULA or --maximise FORMULA, or free one or two")),
        }
    }
}

impl QuestionReply {
    /// The reply for other programs.
    pub fn record(&self, surrogate: &Surrogate<'_>) -> ReplyRecord {
        let record = match self {
            Self::Indices(found) => return ReplyRecord::Indices(found.clone()),
            Self::At(answer) => answer.record(),
            Self::Smallest(free, found, answer) => found.record(&shown(surrogate, *free), answer),
            Self::Exchanged(_, TradeOff::OutsideRange(_), answer) => answer.record(),
            Self::Exchanged([first, second], TradeOff::Rows(rows), answer) => {
                let record = TradeOffRecord::new(&shown(surrogate, *first), &shown(surrogate, *second), rows);
                QueryRecord { trade_off: Some(record), ..answer.record() }
            }
            Self::Best(aim, free, found, outside) => found.record(surrogate, aim, free, outside),
        };
        ReplyRecord::Query(Box::new(record))
    }
}

/// A free variable as it is to be shown: with the bounds in place of the fitted range, if some are given.
pub fn shown<'a>(surrogate: &Surrogate<'a>, free: FreeVariable) -> Variable<'a> {
    let fitted = condition::variables(surrogate)[free.index];
    Variable { low: free.low, high: free.high, ..fitted }
}

/// `NAME` or `NAME=LOW..HIGH`.
fn asked_for(surrogate: &Surrogate<'_>, asked: &str, x: &[Option<f64>]) -> Result<FreeVariable> {
    let (name, bounds) = asked.split_once('=').map_or((asked, None), |(name, bounds)| (name, Some(bounds)));
    let index = condition::index_of(surrogate, name)?;
    let fitted = condition::variables(surrogate)[index];
    if x[index].is_some() {
        return Err(Error::input(format!("'{}' is given and asked for at once", fitted.name))
            .at_key(fitted.name)
            .help("leave out its value, or --free"));
    }
    let bounds = bounds.map(|text| bounds_of(&fitted, text).map_err(|e| e.at_key(name).read(asked))).transpose()?;
    let (low, high) = bounds.unwrap_or((fitted.low, fitted.high));
    Ok(FreeVariable { index, low, high })
}

/// `LOW..HIGH`: numbers with their unit, or in the variable's.
fn bounds_of(variable: &Variable<'_>, text: &str) -> Result<(f64, f64)> {
    let help = || format!("write for example {}={}..{} {}", variable.name, variable.low, variable.high, variable.unit);
    let (low, high) = text.split_once("..").ok_or_else(|| Error::input("this is no interval").help(help()))?;
    let read = |text: &str| match text.trim().parse::<f64>() {
        Ok(number) => condition::number_in(variable, number, variable.unit),
        Err(_) => condition::value_of(variable, text.trim()),
    };
    Ok((read(low)?, read(high)?))
}

/// One question about many conditions.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BatchQuestion {
    /// The conditions, each as in a question.
    #[schemars(length(min = 1))]
    pub conditions: Vec<BatchCondition>,
    /// Columns of the answers, by name or as `conditions`, `temperatures`, `bands` and `margins`: each answer is then a flat
    /// object of these.
    #[serde(default)]
    pub columns: Vec<String>,
    /// Probability with which verdicts are said: above 0.5, below 1.
    #[serde(default = "usual_confidence")]
    #[schemars(extend("exclusiveMinimum" = 0.5, "exclusiveMaximum" = 1.0))]
    pub confidence: f64,
}

impl BatchQuestion {
    /// The answers as JSON if columns are asked for: one flat object for each condition.
    ///
    /// # Errors
    /// A column that does not exist; a wrong, doubled or missing variable; a value without its unit.
    pub fn columns_of(&self, surrogate: &Surrogate<'_>) -> Result<Vec<u8>> {
        check_confidence(self.confidence)?;
        let form = AnswerForm { json: true, columns: self.columns.clone(), digits: None, confidence: self.confidence };
        let conditions: Vec<&[StatedValue]> = self.conditions.iter().map(|own| &own.0[..]).collect();
        stream::answer_given(surrogate, &conditions, &form)
    }
}

/// One of many conditions.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct BatchCondition(
    #[serde(deserialize_with = "given")]
    #[schemars(with = "BTreeMap<String, Stated>")]
    pub Vec<StatedValue>,
);

/// The answers to many conditions, in their order.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct BatchRecord {
    /// Replies, one for each condition.
    pub conditions: Vec<ReplyRecord>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(json: &str) -> Question {
        serde_json::from_str(json).expect("a question")
    }

    #[test]
    fn values_carry_their_unit_in_the_text_or_beside_the_name() {
        let question = read(r#"{"condition": {"coolant_flow": "8 L/min", "motor_speed [rpm]": 1800, "table [ 1 ]": 0.5, "x": 3}}"#);
        let expected = [("coolant_flow", "8 L/min"), ("motor_speed", "1800 rpm"), ("table", "0.5 1"), ("x", "3")];
        assert_eq!(question.condition, expected.map(|(name, value)| (name.to_owned(), value.to_owned())));
        assert_eq!(read("{}"), Question::default());
    }

    #[test]
    fn what_is_not_known_is_refused() {
        for wrong in [r#"{"conditions": {}}"#, r#"{"condition": []}"#, r#"{"condition": {"x": null}}"#, ""] {
            assert!(serde_json::from_str::<Question>(wrong).is_err(), "{wrong}");
        }
    }
}
