//! Questions with free variables: the smallest acceptable value, two variables traded off, the best acceptable condition.

use coldplate_runtime::Variable;

use super::text::{outside_sentence, plain, text};
use super::{Args, status};
use crate::cli::output::Output;
use crate::cli::text::table;
use crate::error::{Error, Result};
use crate::foundation::numbers::without_zeros;
use crate::surrogate::verdict::record::TradeOffRecord;
use crate::surrogate::verdict::trade_off::Exchange;
use crate::surrogate::verdict::{
    self, Acceptability, Answer, Free, Inverse, Objective, Optimum, Outside, Sense, Surrogate, TradeOff, condition,
};

/// Answers a question with free variables.
pub(super) fn answer(surrogate: &Surrogate<'_>, given: &[(String, String)], args: &Args, out: Output) -> Result<u8> {
    let aim = match (&args.minimise, &args.maximise) {
        (Some(formula), _) => Some(Objective::parse(surrogate, Sense::Minimise, formula).map_err(|e| e.at_key("--minimise"))?),
        (None, Some(formula)) => Some(Objective::parse(surrogate, Sense::Maximise, formula).map_err(|e| e.at_key("--maximise"))?),
        (None, None) => None,
    };
    let mut x = condition::partial(surrogate, given)?;
    let mut free = args.free.iter().map(|asked| asked_for(surrogate, asked, &x)).collect::<Result<Vec<_>>>()?;
    if free.is_empty() {
        // With nothing said, what is not given is free.
        let open = (0..surrogate.variable_count()).filter(|index| x.get(*index).is_some_and(Option::is_none));
        free.extend(open.filter_map(|index| surrogate.variable(index).map(|v| Free { index, low: v.low, high: v.high })));
        if free.is_empty() {
            return Err(Error::input("no variable is free").at_key("--free").help("leave out the value of one, or name it with --free"));
        }
    }
    for own in &free {
        x[own.index] = Some(own.low);
    }
    let x = condition::complete(surrogate, x)?;
    match (aim, free.as_slice()) {
        (Some(aim), _) => optimum(surrogate, &x, &free, &aim, args.confidence, out),
        (None, [only]) => inverse(surrogate, &x, *only, args.confidence, out),
        (None, [first, second]) => trade_off(surrogate, &x, *first, *second, args.confidence, out),
        (None, _) => Err(Error::input("of three free variables and more nothing says which is to be small")
            .at_key("--free")
            .help("add --minimise FORMULA or --maximise FORMULA, or free one or two")),
    }
}

/// `NAME` or `NAME=LOW..HIGH`.
fn asked_for(surrogate: &Surrogate<'_>, asked: &str, x: &[Option<f64>]) -> Result<Free> {
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
    Ok(Free { index, low, high })
}

/// A free variable as it is to be shown: what is said of its range is said of the bounds, where some are given.
fn shown<'a>(surrogate: &Surrogate<'a>, free: Free) -> Variable<'a> {
    let fitted = condition::variables(surrogate)[free.index];
    Variable { low: free.low, high: free.high, ..fitted }
}

fn inverse(surrogate: &Surrogate<'_>, x: &[f64], free: Free, confidence: f64, out: Output) -> Result<u8> {
    let (fitted, variable) = (condition::variables(surrogate)[free.index], shown(surrogate, free));
    let is_bounded = (fitted.low, fitted.high) != (free.low, free.high);
    let (unit, range) = (variable.unit, format!("{} to {} {}", plain(variable.low), plain(variable.high), variable.unit));
    let found = verdict::free_within(surrogate, x, free.index, Some((free.low, free.high)), confidence)?;
    let answer = match &found {
        Inverse::Found { answer, .. } | Inverse::Nowhere { answer, .. } => answer.clone(),
        Inverse::OutsideRange(_) => verdict::query_at(surrogate, x, confidence)?,
    };
    let head = match &found {
        Inverse::Found { smallest, until, .. } => {
            let whole = if is_bounded { "the end of the bounds" } else { "the end of the fitted range" };
            let end = if *until == variable.high { whole } else { "where a limit stops it" };
            format!(
                "{}: {} {unit} is the smallest acceptable value; acceptable from there to {} {unit}, {end}.\n\n",
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
        Inverse::OutsideRange(outside) => outside_text(outside),
    };
    let is_outside = matches!(found, Inverse::OutsideRange(_));
    let shown = if is_outside { head } else { head + &text(surrogate, &answer) };
    out.report(&shown, &found.record(&variable, &answer));
    Ok(status(if is_outside { Acceptability::Uncertain } else { answer.verdict }))
}

fn trade_off(surrogate: &Surrogate<'_>, x: &[f64], first: Free, second: Free, confidence: f64, out: Output) -> Result<u8> {
    let (variable, against) = (shown(surrogate, first), shown(surrogate, second));
    let answer = verdict::query_at(surrogate, x, confidence)?;
    let rows = match verdict::trade_off(surrogate, x, first, second, confidence)? {
        TradeOff::Rows(rows) => rows,
        TradeOff::OutsideRange(outside) => {
            out.report(&outside_text(&outside), &answer.record());
            return Ok(status(Acceptability::Uncertain));
        }
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
    let record = verdict::record::QueryRecord { trade_off: Some(TradeOffRecord::new(&variable, &against, &rows)), ..answer.record() };
    out.report(&shown, &record);
    Ok(u8::from(rows.iter().all(|row| row.acceptable.is_none())))
}

fn optimum(surrogate: &Surrogate<'_>, x: &[f64], free: &[Free], aim: &Objective, confidence: f64, out: Output) -> Result<u8> {
    let found = verdict::best(surrogate, x, free, aim, confidence)?;
    let outside = verdict::query_at(surrogate, x, confidence)?;
    let word = match aim.sense() {
        Sense::Minimise => "smallest",
        Sense::Maximise => "largest",
    };
    let values = |answer: &Answer| {
        let of = |own: &Free| {
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
    let (shown, verdict) = match &found {
        Optimum::Found { value, answer } => {
            let head = format!("{} is {word} acceptable, {}, at\n{}\n", aim.text(), plain(*value), values(answer));
            (head + &text(surrogate, answer), answer.verdict)
        }
        Optimum::Nowhere { answer } => {
            let head = format!("No condition in the ranges was found acceptable. It comes closest at\n{}\n", values(answer));
            (head + &text(surrogate, answer), answer.verdict)
        }
        Optimum::OutsideRange(missing) => (outside_text(missing), Acceptability::Uncertain),
    };
    out.report(&shown, &found.record(surrogate, aim, free, &outside));
    Ok(status(verdict))
}

fn outside_text(outside: &[Outside]) -> String {
    outside.iter().map(outside_sentence).collect::<String>() + "Uncertain: the surrogate says nothing there.\n"
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

/// An end of an interval to some 1e-5 of the fitted range, rounded into the interval, so that a
/// reader who types it in gets what was promised.
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
