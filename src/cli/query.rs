//! `coldplate query`: temperatures, verdict and margins from a surrogate file.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use coldplate_runtime::Variable;

use super::condition::ConditionArgs;
use super::output::Output;
use super::text::table;
use crate::error::{Error, Result};
use crate::foundation::input;
use crate::foundation::numbers::{compact, without_zeros};
use crate::surrogate::fit::file;
use crate::surrogate::verdict::stream::{self, Form};
use crate::surrogate::verdict::{self, Acceptability, Answer, Inverse, Outside, Surrogate, condition};

/// Arguments of `coldplate query`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Exit status: 0 acceptable; 1 not acceptable; 2 bad input; 3 uncertain (too close to call, outside the \
                        fitted range, or no limits to judge by). With --csv: 0 if all are acceptable, 1 if any is not, else 3.")]
pub struct Args {
    /// Surrogate file
    #[arg(value_name = "SURROGATE")]
    pub surrogate: PathBuf,
    /// The condition.
    #[command(flatten)]
    pub condition: ConditionArgs,
    /// Find the smallest value of this variable that makes the condition acceptable; NAME=LOW..HIGH looks there only
    #[arg(long, value_name = "NAME", conflicts_with = "csv")]
    pub free: Option<String>,
    /// Answer every row of a CSV file; its header names variables with units, as in "coolant_flow [L/min]"
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// With --csv, only these columns, in this order: names as in the header of the answer, or conditions, temperatures,
    /// bands, margins for all of a kind; JSON rows are then flat objects
    #[arg(long, value_name = "A,B,..", requires = "csv")]
    pub columns: Vec<String>,
    /// With --csv, numbers of so many significant digits (default: all)
    #[arg(long, value_name = "N", requires = "csv", value_parser = clap::value_parser!(u8).range(1..=17))]
    pub digits: Option<u8>,
}

/// Answers the query and returns the exit status.
///
/// # Errors
/// A file that cannot be read or is damaged; a wrong, doubled or missing variable; a value without
/// its unit.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let bytes = input::read(&args.surrogate)?;
    let surrogate = file::open(&bytes).map_err(|e| e.in_file(&args.surrogate))?;
    let given = args.condition.values()?;
    match (&args.csv, &args.free) {
        (Some(csv), _) => many(&surrogate, csv, &given, args, out),
        (None, Some(name)) => inverse(&surrogate, name, &given, out),
        (None, None) => {
            let answer = verdict::query(&surrogate, &condition::condition(&surrogate, &given)?)?;
            out.report(&text(&surrogate, &answer), &answer.record());
            Ok(status(answer.verdict))
        }
    }
}

fn status(verdict: Acceptability) -> u8 {
    match verdict {
        Acceptability::Acceptable => 0,
        Acceptability::NotAcceptable => 1,
        Acceptability::Uncertain => 3,
    }
}

fn many(surrogate: &Surrogate<'_>, csv: &Path, given: &[(String, String)], args: &Args, out: Output) -> Result<u8> {
    let open = || File::open(csv).map(BufReader::new).map_err(|e| Error::file("read", csv, e));
    // A mistake shows before the first answer; only a pipe, which can be read once, is answered up to its mistake.
    let is_file = std::fs::metadata(csv).is_ok_and(|m| m.is_file());
    let total = if is_file { Some(stream::check(surrogate, open()?, given).map_err(|e| e.in_file(csv))?) } else { None };
    let form = Form { json: out.json, columns: args.columns.clone(), digits: args.digits.map(usize::from) };
    let tally = stream::answer(surrogate, open()?, given, &form, total, &out.progress(), out.pieces()).map_err(|e| e.in_file(csv))?;
    Ok(if tally.refused {
        1
    } else if tally.open {
        3
    } else {
        0
    })
}

fn inverse(surrogate: &Surrogate<'_>, asked: &str, given: &[(String, String)], out: Output) -> Result<u8> {
    let (name, bounds) = asked.split_once('=').map_or((asked, None), |(name, bounds)| (name, Some(bounds)));
    let index = condition::index_of(surrogate, name)?;
    let fitted = condition::variables(surrogate)[index];
    let bounds = bounds.map(|text| bounds_of(&fitted, text).map_err(|e| e.at_key(name).read(asked))).transpose()?;
    // What is said of the range is said of the bounds, where some are given.
    let variable = bounds.map_or(fitted, |(low, high)| Variable { low, high, ..fitted });
    let mut x = condition::partial(surrogate, given)?;
    if x[index].is_some() {
        return Err(Error::input(format!("'{}' is given and asked for at once", variable.name))
            .at_key(variable.name)
            .help("leave out its value, or --free"));
    }
    x[index] = Some(variable.low);
    let x = condition::complete(surrogate, x)?;
    let (unit, range) = (variable.unit, format!("{} to {} {}", plain(variable.low), plain(variable.high), variable.unit));
    let found = verdict::free_within(surrogate, &x, index, bounds)?;
    let answer = match &found {
        Inverse::Found { answer, .. } | Inverse::Nowhere { answer, .. } => answer.clone(),
        Inverse::OutsideRange(_) => verdict::query(surrogate, &x)?,
    };
    let head = match &found {
        Inverse::Found { smallest, until, .. } => {
            let whole = if bounds.is_some() { "the end of the bounds" } else { "the end of the fitted range" };
            let end = if *until == variable.high { whole } else { "where a limit stops it" };
            format!(
                "{}: {} {unit} is the smallest acceptable value; acceptable from there to {} {unit}, {end}.\n\n",
                variable.name,
                rounded_up(*smallest, *until, variable.high - variable.low),
                rounded_down(*smallest, *until, variable.high - variable.low),
            )
        }
        Inverse::Nowhere { best, limit, excess, .. } => {
            let (name, limit_unit) = answer.limits.get(*limit).map_or(("", ""), |l| (&l.name, &l.unit));
            format!(
                "{}: no value from {range} makes this acceptable. It comes closest at {} {unit}, where '{name}' with its band is \
                 over its limit by {} {limit_unit}.\n\n",
                variable.name,
                plain(*best),
                plain(*excess)
            )
        }
        Inverse::OutsideRange(outside) => {
            outside.iter().map(outside_sentence).collect::<String>() + "Uncertain: the surrogate says nothing there.\n"
        }
    };
    let is_outside = matches!(found, Inverse::OutsideRange(_));
    let shown = if is_outside { head } else { head + &text(surrogate, &answer) };
    out.report(&shown, &found.record(&variable, &answer));
    Ok(status(if is_outside { Acceptability::Uncertain } else { answer.verdict }))
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

fn text(surrogate: &Surrogate<'_>, answer: &Answer) -> String {
    let condition = surrogate.variables().zip(&answer.condition).map(|(v, x)| format!("{} {} {}", v.name, plain(*x), v.unit));
    let mut text = condition.collect::<Vec<_>>().join(", ") + "\n";
    if !answer.held.is_empty() {
        let held = answer.held.iter().map(|held| match held.unit.as_str() {
            "1" | "" => format!("{} {}", held.name, held.value),
            unit => format!("{} {} {unit}", held.name, held.value),
        });
        text += &format!("held when the surrogate was made: {}\n", held.collect::<Vec<_>>().join(", "));
    }
    text.push('\n');
    let rows: Vec<Vec<String>> =
        answer.temperatures.iter().map(|p| vec![p.name.clone(), fixed(p.value), fixed(p.low), fixed(p.high), p.unit.clone()]).collect();
    text += &table(&["point", "value", "low", "high", "unit"], &rows);
    if !answer.limits.is_empty() {
        let mark = |i: usize| if answer.binding == Some(i) { "binding" } else { "" };
        let rows: Vec<Vec<String>> = answer
            .limits
            .iter()
            .enumerate()
            .map(|(i, l)| {
                let band = format!("{} to {}", fixed(l.low), fixed(l.high));
                vec![l.name.clone(), fixed(l.value), band, fixed(l.limit), fixed(l.margin), l.unit.clone(), mark(i).into()]
            })
            .collect();
        text += "\n";
        text += &table(&["limit", "value", "band", "maximum", "margin", "unit", ""], &rows);
    }
    text += "\n";
    text.extend(answer.outside.iter().map(outside_sentence));
    text + &sentence(answer)
}

fn outside_sentence(outside: &Outside) -> String {
    let Outside { name, unit, value, low, high } = outside;
    if low == high {
        return format!("{name} = {value} {unit} is not the {low} {unit} at which it was held when the surrogate was made.\n");
    }
    format!("{name} = {} {unit} is outside the fitted range, {} to {} {unit}.\n", plain(*value), plain(*low), plain(*high))
}

fn sentence(answer: &Answer) -> String {
    let binding = answer.binding.and_then(|i| answer.limits.get(i));
    match (answer.verdict, binding) {
        (Acceptability::Uncertain, _) if !answer.in_domain => "Uncertain: outside the fitted range the values are a guess.\n".into(),
        (Acceptability::Uncertain, None) => "Uncertain: there is no limit to judge by.\n".into(),
        (Acceptability::Acceptable, Some(l)) => {
            format!("Acceptable: '{}' has the smallest margin, {} {} of {}.\n", l.name, fixed(l.margin), l.unit, fixed(l.limit))
        }
        (Acceptability::NotAcceptable, Some(l)) => {
            format!("Not acceptable: '{}' is over its limit of {} {} by {}.\n", l.name, fixed(l.limit), l.unit, fixed(-l.margin))
        }
        (Acceptability::Uncertain, Some(l)) => format!(
            "Uncertain, too close to call: the band of '{}', {} to {}, holds its limit of {} {}.\n",
            l.name,
            fixed(l.low),
            fixed(l.high),
            fixed(l.limit),
            l.unit
        ),
        (Acceptability::Acceptable, None) => "Acceptable.\n".into(),
        (Acceptability::NotAcceptable, None) => "Not acceptable.\n".into(),
    }
}

/// Temperatures and margins, to the millikelvin.
fn fixed(value: f64) -> String {
    format!("{value:.3}")
}

/// A number with six significant digits, without the zeros behind it.
fn plain(value: f64) -> String {
    compact(value, 6)
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
