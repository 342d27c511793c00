//! Replies to questions with free variables in words: the smallest acceptable value, two variables traded off, the best
//! acceptable condition.

use coldplate_runtime::Variable;

use super::status;
use super::text::{outside_sentence, plain, text};
use crate::cli::text::table;
use coldplate_base::numbers::without_zeros;
use coldplate_surrogate::verdict::question::{QuestionReply, shown};
use coldplate_surrogate::verdict::trade_off::Exchange;
use coldplate_surrogate::verdict::{
    Acceptability, FreeVariable, Inverse, Objective, Optimum, OutOfRange, Sense, Stop, Surrogate, SurrogateAnswer, TradeOff, condition,
};

/// The reply in words, and the exit status; nothing where no variable was free.
pub(super) fn told(surrogate: &Surrogate<'_>, reply: &QuestionReply) -> (String, u8) {
    match reply {
        QuestionReply::Smallest(free, found, answer) => inverse(surrogate, *free, found, answer),
        QuestionReply::Exchanged(free, found, _) => trade_off(surrogate, *free, found),
        QuestionReply::Best(aim, free, found, _) => optimum(surrogate, free, aim, found),
        QuestionReply::At(_) | QuestionReply::Indices(_) => (String::new(), 0),
    }
}

fn inverse(surrogate: &Surrogate<'_>, free: FreeVariable, found: &Inverse, answer: &SurrogateAnswer) -> (String, u8) {
    let (fitted, variable) = (condition::variables(surrogate)[free.index], shown(surrogate, free));
    let is_bounded = (fitted.low, fitted.high) != (free.low, free.high);
    let (unit, range) = (variable.unit, format!("{} to {} {}", plain(variable.low), plain(variable.high), variable.unit));
    let head = match found {
        Inverse::Found { smallest, until, stops, .. } => {
            let [low, high] = stops.map(|stop| match stop {
                Stop::Range if is_bounded => "the end of the bounds".to_owned(),
                Stop::Range => "the end of the fitted range".to_owned(),
                Stop::NoRows => "beyond which no row was fitted".to_owned(),
                Stop::Limit(limit) => format!("where '{}' stops it", answer.limits.get(limit).map_or("", |l| &l.name)),
            });
            format!(
                "{}: acceptable from {} {unit}, {low}, to {} {unit}, {high}.\n\n",
                variable.name,
                rounded_up(*smallest, *until, variable.high - variable.low),
                rounded_down(*smallest, *until, variable.high - variable.low),
            )
        }
        Inverse::Nowhere { best, limit, excess, .. } => {
            let (name, limit_unit) = answer.limits.get(*limit).map_or(("", ""), |l| (&l.name, &l.margin_unit));
            format!(
                "{}: no value from {range} makes this acceptable. It comes closest at {} {unit}, where '{name}' with its band is \
                 over its limit by {} {limit_unit}.\n\n",
                variable.name,
                plain(*best),
                plain(*excess)
            )
        }
        Inverse::OutsideRange(outside) => return (outside_text(outside), status(Acceptability::Uncertain)),
    };
    (head + &text(surrogate, answer), status(answer.verdict))
}

fn trade_off(surrogate: &Surrogate<'_>, [first, second]: [FreeVariable; 2], found: &TradeOff) -> (String, u8) {
    let (variable, against) = (shown(surrogate, first), shown(surrogate, second));
    let rows = match found {
        TradeOff::Rows(rows) => rows,
        TradeOff::OutsideRange(outside) => return (outside_text(outside), status(Acceptability::Uncertain)),
    };
    let column = |v: &Variable<'_>| format!("{} [{}]", v.name, v.unit);
    let cells = |row: &Exchange| {
        let (low, high) = (first.low, first.high);
        let ends = row.acceptable.map_or(["none".to_owned(), String::new()], |own| {
            [rounded_up(own.from, own.until, high - low), rounded_down(own.from, own.until, high - low)]
        });
        std::iter::once(plain(row.given)).chain(ends).collect::<Vec<_>>()
    };
    let heads = [column(&against), format!("{}, at least", column(&variable)), "acceptable until".to_owned()];
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    let head = format!("The smallest acceptable {} for values of {}:\n\n", variable.name, against.name);
    let shown = head + &table(&heads, &rows.iter().map(cells).collect::<Vec<_>>());
    (shown, u8::from(rows.iter().all(|row| row.acceptable.is_none())))
}

fn optimum(surrogate: &Surrogate<'_>, free: &[FreeVariable], aim: &Objective, found: &Optimum) -> (String, u8) {
    let word = match aim.sense() {
        Sense::Minimise => "smallest",
        Sense::Maximise => "largest",
    };
    let values = |answer: &SurrogateAnswer| {
        let of = |own: &FreeVariable| {
            let variable = shown(surrogate, *own);
            let value = answer.condition.get(own.index).copied().unwrap_or(f64::NAN);
            let end = match value {
                v if v == own.low => ", the smallest allowed",
                v if v == own.high => ", the largest allowed",
                _ => "",
            };
            format!("  {} {} {}{end}\n", variable.name, plain(value), variable.unit)
        };
        free.iter().map(of).collect::<String>()
    };
    match found {
        Optimum::Found { value, answer } => {
            let head = format!("{} is {word} acceptable, {}, at\n{}\n", aim.text(), plain(*value), values(answer));
            (head + &text(surrogate, answer), status(answer.verdict))
        }
        Optimum::Nowhere { answer } => {
            let head = format!("No condition in the ranges was found acceptable. It comes closest at\n{}\n", values(answer));
            (head + &text(surrogate, answer), status(answer.verdict))
        }
        Optimum::OutsideRange(missing) => (outside_text(missing), status(Acceptability::Uncertain)),
    }
}

fn outside_text(outside: &[OutOfRange]) -> String {
    outside.iter().map(outside_sentence).collect::<String>() + "Uncertain: the surrogate says nothing there.\n"
}

/// An end of an interval, to about 1e-5 of the fitted range, rounded into the interval: a reader who types it in gets
/// the verdict that was promised.
fn rounded_up(low: f64, high: f64, range: f64) -> String {
    rounded(low, high, range, f64::ceil, low)
}

fn rounded_down(low: f64, high: f64, range: f64) -> String {
    rounded(low, high, range, f64::floor, high)
}

fn rounded(low: f64, high: f64, range: f64, round: fn(f64) -> f64, end: f64) -> String {
    let decimals = (4.0 - range.log10().floor()).clamp(0.0, 12.0);
    let step = 10.0_f64.powf(decimals);
    let value = round(end * step) / step;
    if !(low..=high).contains(&value) {
        return end.to_string();
    }
    without_zeros(&format!("{value:.*}", decimals as usize)).to_owned()
}
