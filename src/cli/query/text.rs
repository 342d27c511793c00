//! Answers to a query for the terminal: the condition, the points with their bands, the limits, the verdict in words.

use crate::cli::text::table;
use coldplate_base::numbers::{compact, significant};
use coldplate_surrogate::fit::model::{HeldSpec, MOVED};
use coldplate_surrogate::verdict::indices::{QuantityIndices, SobolIndices};
use coldplate_surrogate::verdict::{
    Acceptability, Beside, ChanceAnswer, LimitAnswer, OutOfRange, Surrogate, SurrogateAnswer, TellingReading, Temperature,
};

/// Least share of a variance that is shown, dimensionless. Chosen: smaller ones decide nothing.
const LEAST_SHARE: f64 = 0.02;

/// The whole answer at one condition.
pub(super) fn text(surrogate: &Surrogate<'_>, answer: &SurrogateAnswer) -> String {
    let condition = surrogate.variables().zip(&answer.condition).map(|(v, x)| format!("{} {} {}", v.name, plain(*x), v.unit));
    let mut text = condition.collect::<Vec<_>>().join(", ") + "\n";
    let with_unit = |value: f64, unit: &str| if matches!(unit, "1" | "") { value.to_string() } else { format!("{value} {unit}") };
    let from = |name: &str| surrogate.provenance().find(|(key, _)| key.strip_prefix(MOVED) == Some(name)).map(|(_, from)| from);
    let (moved, held): (Vec<&HeldSpec>, Vec<&HeldSpec>) = answer.held.iter().partition(|held| from(&held.name).is_some());
    let stated = |held: &&HeldSpec| format!("{} {}", held.name, with_unit(held.value, &held.unit));
    let moved: Vec<String> = moved.iter().map(|held| format!("{} ({})", stated(held), from(&held.name).unwrap_or(""))).collect();
    for (words, list) in [("moved", moved), ("held when the surrogate was made", held.iter().map(stated).collect())] {
        if !list.is_empty() {
            text += &format!("{words}: {}\n", list.join(", "));
        }
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
                // Outside the fitted range no probability is known.
                let kept = l.probability.map(|p| if answer.in_domain { percent(p) } else { "unknown".into() });
                let maximum = if answer.chance.is_some() { plain(l.limit) } else { fixed(l.limit) };
                let cells = [l.name.clone(), shown(l.value), band, maximum, l.unit.clone(), shown(l.margin), l.margin_unit.clone()];
                cells.into_iter().chain(kept).chain([mark(i).into()]).collect()
            })
            .collect();
        let kept = answer.chance.iter().map(|_| "kept");
        let heading: Vec<&str> = ["limit", "value", "band", "maximum", "unit", "margin", ""].into_iter().chain(kept).chain([""]).collect();
        text += "\n";
        text += &table(&heading, &rows);
    }
    text += "\n";
    text.extend(answer.outside.iter().map(outside_sentence));
    text += &sentence(answer);
    text + &answer.chance.as_ref().filter(|_| answer.in_domain && answer.binding.is_some()).map_or_else(String::new, reasons)
}

/// Number of meaningful decimals: two digits of the half width of a band, three for a surrogate without uncertainty of
/// the machine.
fn decimals(answer: &SurrogateAnswer, half_width: f64) -> usize {
    if answer.chance.is_some() { decimals_of(half_width) } else { 3 }
}

fn decimals_of(half_width: f64) -> usize {
    if half_width > 0.0 && half_width.is_finite() { (1.0 - half_width.log10().floor()).clamp(0.0, 3.0) as usize } else { 3 }
}

/// Values with their bands and the parts of these.
fn temperatures_in_parts(points: &[Temperature]) -> String {
    let row = |p: &Temperature| {
        let digits = decimals_of((p.high - p.low) / 2.0);
        let shown = |value: f64| format!("{value:.digits$}");
        let parts = p.parts.map_or([None; 4], |own| [Some(own.fit), own.mesh, Some(own.parameters), Some(own.misses)]);
        let parts = parts.into_iter().flatten().map(|half| significant(half, 2));
        [p.name.clone(), shown(p.value), shown(p.low), shown(p.high), p.unit.clone()].into_iter().chain(parts).collect()
    };
    let mesh = points.iter().any(|p| p.parts.is_some_and(|own| own.mesh.is_some())).then_some("+- mesh");
    let parts = [Some("+- fit"), mesh, Some("+- parameters"), Some("+- misses")];
    let heading: Vec<&str> = ["point", "value", "low", "high", "unit"].into_iter().chain(parts.into_iter().flatten()).collect();
    table(&heading, &points.iter().map(row).collect::<Vec<Vec<String>>>())
}

/// A probability in per cent, never rounded to certainty.
pub(super) fn percent(probability: f64) -> String {
    match 100.0 * probability {
        p if p.is_nan() => "-".into(),
        p if p > 99.9 => "> 99.9 %".into(),
        p if p < 0.1 => "< 0.1 %".into(),
        p => format!("{p:.1} %"),
    }
}

/// Parts of the uncertainty of the limit that decides, and the reading that would settle it.
fn reasons(chance: &ChanceAnswer) -> String {
    let large: Vec<String> = (chance.deciding.iter())
        .filter(|own| own.share >= 0.05)
        .map(|own| format!("{} {:.0} %{}", own.name, 100.0 * own.share, if own.is_assumed { " (assumed)" } else { "" }))
        .collect();
    let mut text = format!("Its variance: {}.\n", large.join(", "));
    if let Some(TellingReading { point, deviation, unit, share }) = &chance.would_settle {
        text += &format!("A reading of '{point}' at this condition to {deviation} {unit} would take away {:.0} % of it.\n", 100.0 * share);
    }
    text
}

/// A variable outside the fitted range.
pub(super) fn outside_sentence(outside: &OutOfRange) -> String {
    let OutOfRange { name, unit, value, low, high, beside } = outside;
    if let Some(Beside { name: other, unit: its_unit, value: its_value }) = beside {
        return format!(
            "{name} = {} {unit} lies where no row was fitted: beside {other} = {} {its_unit} rows are at {} to {} {unit}.\n",
            plain(*value),
            plain(*its_value),
            significant(*low, 4),
            significant(*high, 4)
        );
    }
    if low == high {
        return format!("{name} = {value} {unit} is not the {low} {unit} at which it was held when the surrogate was made.\n");
    }
    format!("{name} = {} {unit} is outside the fitted range, {} to {} {unit}.\n", plain(*value), plain(*low), plain(*high))
}

fn sentence(answer: &SurrogateAnswer) -> String {
    let binding = answer.binding.and_then(|i| answer.limits.get(i));
    if let (Some(chance), Some(limit), true) = (&answer.chance, binding, answer.in_domain) {
        return chance_sentence(answer.verdict, chance, limit);
    }
    match (answer.verdict, binding) {
        (Acceptability::Uncertain, _) if !answer.in_domain => "Uncertain: outside the fitted range the values are a guess.\n".into(),
        (Acceptability::Uncertain, None) => "Uncertain: there is no limit to judge by.\n".into(),
        (Acceptability::Acceptable, Some(l)) => {
            format!("Acceptable: '{}' has the smallest margin, {} {} of {}.\n", l.name, fixed(l.margin), l.margin_unit, fixed(l.limit))
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

/// Sobol' indices of each point and limit, as shares of its variance.
pub(super) fn of_indices(surrogate: &Surrogate<'_>, given: &[(String, String)], found: &SobolIndices) -> String {
    let open = surrogate.variables().filter(|v| given.iter().all(|(name, _)| name != v.name));
    let ranges: Vec<String> = open.map(|v| format!("{} {} to {} {}", v.name, plain(v.low), plain(v.high), v.unit)).collect();
    let assumed: Vec<&str> = found.factors.iter().filter(|own| own.is_assumed).map(|own| own.name.as_str()).collect();
    let row = |own: &QuantityIndices| {
        let large = own.ranked(&found.factors, LEAST_SHARE).into_iter();
        let shares =
            large.map(|(factor, index)| format!("{} {:.0} ({:.0})", factor.name, 100.0 * index.first_order.max(0.0), 100.0 * index.total));
        vec![own.name.clone(), significant(own.deviation, 3), shares.collect::<Vec<_>>().join(", ")]
    };
    let (limits, points): (Vec<&QuantityIndices>, Vec<&QuantityIndices>) = found.quantities.iter().partition(|own| own.is_limit);
    let numbers = surrogate.uncertainty().map(|_| "the machine's uncertain numbers".to_owned());
    let varied: Vec<String> = ranges.into_iter().chain(numbers).collect();
    let mut text = format!("Over {}\n\n", varied.join(", "));
    for (head, list) in [("point", points), ("limit", limits)] {
        if !list.is_empty() {
            let rows: Vec<Vec<String>> = list.into_iter().map(row).collect();
            text += &table(&[head, "deviation", "first-order share of the variance in % (total)"], &rows);
            text.push('\n');
        }
    }
    text += &format!("Shares below {:.0} % are left out; standard error {:.1} % at most.", 100.0 * LEAST_SHARE, 100.0 * found.error);
    if !assumed.is_empty() {
        text += &format!(" Assumed, not stated: {}.", assumed.join(", "));
    }
    text + "\n"
}

/// The verdict with its probability.
fn chance_sentence(verdict: Acceptability, chance: &ChanceAnswer, limit: &LimitAnswer) -> String {
    let digits = decimals_of((limit.high - limit.low) / 2.0);
    let all = format!("all limits are kept with a probability of {}", percent(chance.probability));
    let asked = percent(chance.confidence);
    let margin = match limit.margin {
        m if m >= 0.0 => format!("'{}' is {m:.digits$} {} below its limit of {}", limit.name, limit.margin_unit, plain(limit.limit)),
        m => format!("'{}' is {:.digits$} {} above its limit of {}", limit.name, -m, limit.margin_unit, plain(limit.limit)),
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
pub(super) fn plain(value: f64) -> String {
    compact(value, 6)
}
