//! `coldplate query`: temperatures, verdict and margins from a surrogate file.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use coldplate_runtime::{CONFIDENCE, Variable};

use super::condition::ConditionArgs;
use super::output::Output;
use super::text::table;
use crate::error::{Error, Result};
use crate::foundation::input;
use crate::foundation::numbers::{compact, significant, without_zeros};
use crate::surrogate::fit::file;
use crate::surrogate::verdict::stream::{self, Form};
use crate::surrogate::verdict::{
    self, Acceptability, Answer, ChanceAnswer, Inverse, LimitAnswer, Outside, Settling, Surrogate, Temperature, condition, stated,
};

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
    /// Probability with which a verdict is said: above 0.5, below 1
    #[arg(long, value_name = "P", default_value_t = CONFIDENCE, value_parser = confidence)]
    pub confidence: f64,
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
    let mut bytes = input::read(&args.surrogate)?;
    let given = args.condition.values()?;
    let opened = file::open(&bytes).map_err(|e| e.in_file(&args.surrogate))?;
    let (stated, given): (Vec<_>, Vec<_>) = given.into_iter().partition(|(name, _)| stated::is_parameter(&opened, name));
    if !stated.is_empty() {
        bytes = stated::with_stated(&bytes, &stated)?;
    }
    let surrogate = file::open(&bytes).map_err(|e| e.in_file(&args.surrogate))?;
    match (&args.csv, &args.free) {
        (Some(csv), _) => many(&surrogate, csv, &given, args, out),
        (None, Some(name)) => inverse(&surrogate, name, &given, args.confidence, out),
        (None, None) => {
            let answer = verdict::query_at(&surrogate, &condition::condition(&surrogate, &given)?, args.confidence)?;
            out.report(&text(&surrogate, &answer), &answer.record());
            Ok(status(answer.verdict))
        }
    }
}

fn confidence(text: &str) -> std::result::Result<f64, String> {
    let value = text.strip_suffix('%').map_or_else(|| text.parse::<f64>(), |percent| percent.trim().parse::<f64>().map(|p| p / 100.0));
    let inside = value.ok().filter(|p| *p > 0.5 && *p < 1.0);
    inside.ok_or_else(|| "a probability above 0.5 and below 1 is wanted, for example 0.95".into())
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
    let form = Form { json: out.json, columns: args.columns.clone(), digits: args.digits.map(usize::from), confidence: args.confidence };
    let tally = stream::answer(surrogate, open()?, given, &form, total, &out.progress(), out.pieces()).map_err(|e| e.in_file(csv))?;
    Ok(if tally.refused {
        1
    } else if tally.open {
        3
    } else {
        0
    })
}

fn inverse(surrogate: &Surrogate<'_>, asked: &str, given: &[(String, String)], confidence: f64, out: Output) -> Result<u8> {
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
    let found = verdict::free_within(surrogate, &x, index, bounds, confidence)?;
    let answer = match &found {
        Inverse::Found { answer, .. } | Inverse::Nowhere { answer, .. } => answer.clone(),
        Inverse::OutsideRange(_) => verdict::query_at(surrogate, &x, confidence)?,
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
    text += &match answer.chance {
        Some(_) => temperatures_in_parts(&answer.temperatures),
        None => {
            let row = |p: &Temperature| vec![p.name.clone(), fixed(p.value), fixed(p.low), fixed(p.high), p.unit.clone()];
            table(&["point", "value", "low", "high", "unit"], &answer.temperatures.iter().map(row).collect::<Vec<_>>())
        }
    };
    if !answer.limits.is_empty() {
        let mark = |i: usize| if answer.binding == Some(i) { "binding" } else { "" };
        let rows: Vec<Vec<String>> = answer
            .limits
            .iter()
            .enumerate()
            .map(|(i, l)| {
                let digits = decimals(answer, (l.high - l.low) / 2.0);
                let shown = |value: f64| format!("{value:.digits$}");
                let band = format!("{} to {}", shown(l.low), shown(l.high));
                let kept = l.probability.map(percent);
                let maximum = if answer.chance.is_some() { plain(l.limit) } else { fixed(l.limit) };
                let cells = [l.name.clone(), shown(l.value), band, maximum, shown(l.margin), l.unit.clone()];
                cells.into_iter().chain(kept).chain([mark(i).into()]).collect()
            })
            .collect();
        let kept = answer.chance.iter().map(|_| "kept");
        let heading: Vec<&str> = ["limit", "value", "band", "maximum", "margin", "unit"].into_iter().chain(kept).chain([""]).collect();
        text += "\n";
        text += &table(&heading, &rows);
    }
    text += "\n";
    text.extend(answer.outside.iter().map(outside_sentence));
    text += &sentence(answer);
    text + &answer.chance.as_ref().filter(|_| answer.in_domain && answer.binding.is_some()).map_or_else(String::new, reasons)
}

/// Decimals that mean something: two digits of the half width of a band, three for a surrogate that knows its fit alone.
fn decimals(answer: &Answer, half_width: f64) -> usize {
    if answer.chance.is_some() { decimals_of(half_width) } else { 3 }
}

fn decimals_of(half_width: f64) -> usize {
    if half_width > 0.0 && half_width.is_finite() { (1.0 - half_width.log10().floor()).clamp(0.0, 3.0) as usize } else { 3 }
}

/// Values with their bands and what these are made of.
fn temperatures_in_parts(points: &[Temperature]) -> String {
    let row = |p: &Temperature| {
        let digits = decimals_of((p.high - p.low) / 2.0);
        let shown = |value: f64| format!("{value:.digits$}");
        let parts = p.parts.map_or([f64::NAN; 3], |own| [own.fit, own.parameters, own.misses]);
        let [fit, parameters, misses] = parts.map(|half| significant(half, 2));
        vec![p.name.clone(), shown(p.value), shown(p.low), shown(p.high), p.unit.clone(), fit, parameters, misses]
    };
    table(&["point", "value", "low", "high", "unit", "+- fit", "+- parameters", "+- misses"], &points.iter().map(row).collect::<Vec<_>>())
}

/// A probability in per cent, never rounded to certainty.
fn percent(probability: f64) -> String {
    match 100.0 * probability {
        p if p.is_nan() => "-".into(),
        p if p > 99.9 => "> 99.9 %".into(),
        p if p < 0.1 => "< 0.1 %".into(),
        p => format!("{p:.1} %"),
    }
}

/// What the uncertainty of the limit that decides is made of, and what would settle it.
fn reasons(chance: &ChanceAnswer) -> String {
    let large: Vec<String> = (chance.deciding.iter())
        .filter(|own| own.share >= 0.05)
        .map(|own| format!("{} {:.0} %{}", own.name, 100.0 * own.share, if own.is_assumed { " (assumed)" } else { "" }))
        .collect();
    let mut text = format!("Its variance: {}.\n", large.join(", "));
    if let Some(Settling { point, deviation, unit, share }) = &chance.would_settle {
        text += &format!("A reading of '{point}' at this condition to {deviation} {unit} would take away {:.0} % of it.\n", 100.0 * share);
    }
    text
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
    if let (Some(chance), Some(limit), true) = (&answer.chance, binding, answer.in_domain) {
        return chance_sentence(answer.verdict, chance, limit);
    }
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

/// The verdict with its probability.
fn chance_sentence(verdict: Acceptability, chance: &ChanceAnswer, limit: &LimitAnswer) -> String {
    let digits = decimals_of((limit.high - limit.low) / 2.0);
    let all = format!("all limits are kept with a probability of {}", percent(chance.probability));
    let asked = percent(chance.confidence);
    let margin = match limit.margin {
        m if m >= 0.0 => format!("'{}' is {m:.digits$} {} below its limit of {}", limit.name, limit.unit, plain(limit.limit)),
        m => format!("'{}' is {:.digits$} {} above its limit of {}", limit.name, -m, limit.unit, plain(limit.limit)),
    };
    match verdict {
        Acceptability::Acceptable => format!("Acceptable: {all} ({asked} asked for). {margin}.\n"),
        Acceptability::NotAcceptable => format!("Not acceptable: {all}. {margin}.\n"),
        Acceptability::Uncertain => format!("Uncertain, too close to call: {all} ({asked} asked for). {margin}.\n"),
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
