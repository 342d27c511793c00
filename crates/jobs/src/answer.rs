//! The answer of a sweep: how far one variable may go until a limit is no longer kept for sure, and the machine there.

use super::charts::limits::worded;
use super::charts::{machine, sankey};
use super::figures::{self, ContourQuantity};
use super::gallery::Gallery;
use super::measured;
use coldplate_base::condition::{AMBIENT_TEMPERATURE, COOLANT_FLOW, COOLANT_TEMPERATURE, MOTOR_SPEED};
use coldplate_base::error::Result;
use coldplate_base::units;
use coldplate_describe::machine::{Condition, DescribedVariable};
use coldplate_explore::sweep::sweep_file::Sweep;
use coldplate_figures::chart::acceptability::MarkedCondition;
use coldplate_figures::chart::machine::MachineFigure;
use coldplate_figures::chart::sankey::SankeyFigure;
use coldplate_figures::chart::style::{Quantity, number, readable};
use coldplate_surrogate::verdict::condition::{index_of, of_si};
use coldplate_surrogate::verdict::inverse::{Inverse, Stop};
use coldplate_surrogate::verdict::{self, Acceptability, Surrogate};

/// Number of steps in which the border of refused conditions is looked for, and of halvings of the step that holds it. Chosen:
/// finer than the three digits that are told.
const STEPS: [usize; 2] = [64, 20];
/// Significant digits of an end that is told. Chosen: nobody sets a speed more finely.
const DIGITS: i32 = 3;

/// How far one variable may go, the others held at the machine's defaults.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// The answer in a sentence.
    pub sentence: String,
    /// Whether some value is acceptable.
    pub is_found: bool,
    /// Values that are neither acceptable nor refused for sure, in words.
    pub open: Option<String>,
    /// The worst condition that is acceptable, or else the one that comes closest: the variables of the surrogate.
    pub condition: Vec<(Quantity, f64)>,
    /// Index of the variable.
    variable: usize,
}

impl Answer {
    /// The answer of a surrogate; `None` if it has no limits, or no rows about the machine's defaults.
    ///
    /// # Errors
    /// The surrogate cannot be queried.
    pub(super) fn of(surrogate: &Surrogate<'_>, described: &[DescribedVariable]) -> Result<Option<Self>> {
        if surrogate.limit_count() == 0 || surrogate.variable_count() == 0 {
            return Ok(None);
        }
        let variable = [MOTOR_SPEED, COOLANT_TEMPERATURE, AMBIENT_TEMPERATURE].into_iter().find_map(|name| varied(surrogate, name));
        let variable = variable.unwrap_or(0);
        let Some(range) = surrogate.variable(variable) else { return Ok(None) };
        let x = usual(surrogate, described)?;
        let along = Quantity::new(range.name, range.unit);
        let at = Self::held(surrogate, &x, variable);
        let limit = |i: usize| worded(surrogate).into_iter().nth(i).map_or(String::new(), |(name, words)| format!("{name} ({words})"));
        let with = |value: f64| x.iter().enumerate().map(|(v, own)| if v == variable { value } else { *own }).collect::<Vec<f64>>();
        let (sentence, is_found, condition, open) = match verdict::free(surrogate, &x, variable)? {
            Inverse::OutsideRange(_) => return Ok(None),
            Inverse::Nowhere { best, limit: i, .. } => {
                let name = readable(range.name);
                let between = format!("from {} to {}", number(range.low), along.with_value(range.high));
                let words = format!("No {name} {between} is sure to be acceptable{at}. First limit: {}.", limit(i));
                (words, false, with(best), None)
            }
            Inverse::Found { smallest, until, stops, .. } => {
                let [low, high] = [rounded(smallest, f64::ceil).min(until), rounded(until, f64::floor).max(smallest)];
                let [from, to] = [low, high].map(|value| along.with_value(value));
                let (words, worst, stop) = match stops {
                    [Stop::Limit(_), Stop::Limit(i)] => (format!("Acceptable from {from} to {to}"), high, Some(i)),
                    [_, Stop::Limit(i)] => (format!("Acceptable up to {to}"), high, Some(i)),
                    [Stop::Limit(i), _] => (format!("Acceptable from {from} on"), low, Some(i)),
                    _ => {
                        let margin = |value: f64| -> Result<f64> {
                            let answer = verdict::query(surrogate, &with(value))?;
                            Ok(answer.binding.and_then(|i| answer.limits.get(i)).map_or(f64::INFINITY, |limit| limit.margin))
                        };
                        let worst = if margin(until)? <= margin(smallest)? { until } else { smallest };
                        let name = readable(range.name);
                        (format!("Acceptable at every {name} from {} to {}", number(smallest), along.with_value(until)), worst, None)
                    }
                };
                let binding = match stop {
                    Some(i) => Some(("First", i)),
                    None => verdict::query(surrogate, &with(worst))?.binding.map(|i| ("Nearest", i)),
                };
                let binding = binding.map_or(String::new(), |(which, i)| format!(" {which} limit: {}.", limit(i)));
                let open = if matches!(stops[1], Stop::Limit(_)) { open_above(surrogate, &with(until), variable, until)? } else { None };
                let open = open.map(|end| format!("{} to {}", number(high), along.with_value(end)));
                (format!("{words}{at}.{binding}"), true, with(worst), open)
            }
        };
        let condition = surrogate.variables().map(|v| Quantity::new(v.name, v.unit)).zip(condition).collect();
        Ok(Some(Self { sentence, is_found, open, condition, variable }))
    }

    /// The variables that are held, as ` at coolant flow 9.42 L/min, ...`.
    fn held(surrogate: &Surrogate<'_>, x: &[f64], variable: usize) -> String {
        let others = surrogate.variables().zip(x).enumerate().filter(|(v, _)| *v != variable);
        let words: Vec<String> = others.map(|(_, (v, value))| Quantity::new(v.name, v.unit).named(*value)).collect();
        if words.is_empty() { String::new() } else { format!(" at {}", words.join(", ")) }
    }

    /// Draws the map about the condition, with the condition marked.
    ///
    /// # Errors
    /// The surrogate cannot be queried; the figure cannot be written.
    pub(super) fn draw_map(&self, gallery: &mut Gallery, surrogate: &Surrogate<'_>) -> Result<()> {
        let others = [COOLANT_FLOW, COOLANT_TEMPERATURE, AMBIENT_TEMPERATURE].into_iter().filter_map(|name| varied(surrogate, name));
        let Some(up) = others.chain(0..surrogate.variable_count()).find(|v| *v != self.variable) else { return Ok(()) };
        let label = if self.is_found { "the worst acceptable condition" } else { "the condition that comes closest" };
        let at: Vec<f64> = self.condition.iter().map(|(_, value)| *value).collect();
        let here = MarkedCondition { x: at[self.variable], y: at[up], label: label.into() };
        let map = figures::map(surrogate, self.variable, up, &at, Some(here), ContourQuantity::Margin)?;
        gallery.add("answer_map", "answer", &map)
    }
}

/// Index of a variable that the surrogate varies.
fn varied(surrogate: &Surrogate<'_>, name: &str) -> Option<usize> {
    index_of(surrogate, name).ok().filter(|index| *index < surrogate.variable_count())
}

/// The machine's defaults, or the middle of the range where a default is not stated or lies outside.
fn usual(surrogate: &Surrogate<'_>, described: &[DescribedVariable]) -> Result<Vec<f64>> {
    let usual = |variable: coldplate_runtime::Variable<'_>| -> Result<f64> {
        let stated = described.iter().find(|d| d.name == variable.name).and_then(|d| Some((d.default?, d.dimension)));
        let default = stated.map(|(si, dimension)| of_si(&variable, si, dimension)).transpose()?;
        let inside = default.filter(|value| (variable.low..=variable.high).contains(value));
        Ok(inside.unwrap_or(f64::midpoint(variable.low, variable.high)))
    };
    surrogate.variables().map(usual).collect()
}

/// The value above which all that was tried is refused, if that begins within the range.
fn open_above(surrogate: &Surrogate<'_>, x: &[f64], variable: usize, from: f64) -> Result<Option<f64>> {
    let Some(range) = surrogate.variable(variable) else { return Ok(None) };
    let is_refused = |value: f64| -> Result<bool> {
        let mut at = x.to_vec();
        at[variable] = value;
        Ok(verdict::query(surrogate, &at)?.verdict == Acceptability::NotAcceptable)
    };
    let step = (range.high - from) / STEPS[0] as f64;
    for k in 1..=STEPS[0] {
        if !is_refused(from + step * k as f64)? {
            continue;
        }
        let (mut low, mut high) = (from + step * (k - 1) as f64, from + step * k as f64);
        for _ in 0..STEPS[1] {
            let middle = f64::midpoint(low, high);
            if is_refused(middle)? { high = middle } else { low = middle }
        }
        return Ok(Some(rounded(high, f64::ceil).min(range.high)));
    }
    Ok(Some(range.high))
}

/// A value of few digits, on the side that `towards` rounds to.
fn rounded(value: f64, towards: fn(f64) -> f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    let step = 10f64.powi(value.abs().log10().floor() as i32 + 1 - DIGITS);
    // Division by the inverse keeps decimal values exact.
    let scaled = if step < 1.0 { towards(value * (1.0 / step).round()) / (1.0 / step).round() } else { towards(value / step) * step };
    if scaled.is_finite() { scaled } else { value }
}

/// Draws the machine and the ways of its heat at a condition of the surrogate, or in the middle of the swept ranges without one.
///
/// # Errors
/// The condition cannot be solved; a figure cannot be written.
pub(super) fn draw_machine(gallery: &mut Gallery, sweep: &Sweep, answer: Option<(&Surrogate<'_>, &Answer)>) -> Result<()> {
    let Some(study) = sweep.study() else { return Ok(()) };
    let model = &study.model;
    let mut si = sweep.reference().si().to_vec();
    if let Some((surrogate, answer)) = answer {
        let varied = answer.condition.iter().map(|(quantity, value)| (quantity.name.as_str(), quantity.unit.as_str(), *value));
        for (name, unit, value) in varied.chain(surrogate.held().map(|held| (held.name, held.unit, held.value))) {
            if let Some(v) = model.machine.variables.iter().position(|own| own.name == name) {
                si[v] = units::convert(value, unit, model.machine.variables[v].dimension)?;
            }
        }
    }
    let condition = Condition::from_si(si);
    let state = model.solve(&model.solver(&condition)?, &condition)?;
    let shown: Vec<(usize, f64)> = condition.si().iter().copied().enumerate().filter(|(v, _)| model.machine.uses(*v)).collect();
    let fixed = measured::fixed(&model.machine, &shown);
    let place = match answer {
        Some((_, answer)) if answer.is_found => "at the worst acceptable condition",
        Some(_) => "at the condition that comes closest to acceptable",
        None => "in the middle of the swept ranges",
    };
    let picture = machine::whole(model, &state);
    if !picture.pieces.is_empty() {
        let picture = MachineFigure { title: format!("The machine {place}"), fixed: fixed.clone(), ..picture };
        gallery.add("answer_machine", "answer", &picture)?;
    }
    let ways = sankey::whole(model, &state);
    if ways.bands.is_empty() {
        return Ok(());
    }
    gallery.add("answer_sankey", "causes", &SankeyFigure { title: format!("The ways of the heat {place}"), fixed, ..ways })
}

#[cfg(test)]
mod tests {
    use super::*;
    use coldplate_surrogate::fit::file::{encode, open};
    use coldplate_surrogate::fit::model::{
        LimitKind, LimitSpec, PointModel, PointSpec, PolynomialSpec, SurrogateSpec, Transform, VariableSpec,
    };

    /// A motor of 40 + slope · speed ± 0.5 degC, with flow and speed from -1 to 1, that must not be warmer than `most`.
    fn answer(slope: f64, most: f64) -> Answer {
        let variable = |name: &str, unit: &str, low: f64, high: f64| VariableSpec { name: name.into(), unit: unit.into(), low, high };
        let terms = vec![vec![0, 0], vec![0, 1]];
        let model = PolynomialSpec { transforms: vec![Transform::Identity; 2], terms, coefficients: vec![40.0, slope] };
        let surrogate = SurrogateSpec {
            mesh: Vec::new(),
            variables: vec![variable("coolant_flow", "L/min", 2.0, 10.0), variable("motor_speed", "rpm", 0.0, 2000.0)],
            held: Vec::new(),
            bases: Vec::new(),
            points: vec![PointSpec { name: "motor".into(), unit: "degC".into(), model: PointModel::Polynomial(model), half_width: 0.5 }],
            limits: vec![LimitSpec { name: "heat".into(), kind: LimitKind::Maximum { point: 0 }, maximum: most }],
            uncertainty: None,
            followed: None,
            in_time: None,
            empty_corners: vec![],
            readings: vec![],
            provenance: Vec::new(),
        };
        let described = DescribedVariable {
            name: "coolant_flow".into(),
            unit: "L/min".into(),
            dimension: units::Dimension::VOLUME_FLOW,
            default: Some(1e-4),
            range: None,
        };
        Answer::of(&open(&encode(&surrogate).unwrap()).unwrap(), &[described]).unwrap().unwrap()
    }

    #[test]
    fn the_answer_says_how_far_the_speed_may_go_at_the_default_flow() {
        // Acceptable up to 0.4535 of half the range above its middle, refused from 0.5535 on.
        let found = answer(10.0, 45.035);
        assert_eq!(found.sentence, "Acceptable up to 1450 rpm at coolant flow 6 L/min. First limit: heat (motor at most 45.035 °C).");
        assert_eq!((found.is_found, found.open.as_deref()), (true, Some("1450 to 1560 rpm")));
        assert_eq!(found.condition.iter().map(|(_, value)| *value).collect::<Vec<_>>(), [6.0, 1450.0]);
        let from = answer(-10.0, 45.035);
        assert!(from.sentence.starts_with("Acceptable from 547 rpm on at coolant flow 6 L/min."), "{}", from.sentence);
        let always = answer(10.0, 60.0);
        assert!(always.sentence.starts_with("Acceptable at every motor speed from 0 to 2000 rpm"), "{}", always.sentence);
        assert!(always.sentence.ends_with("Nearest limit: heat (motor at most 60 °C).") && always.condition[1].1 == 2000.0);
        let never = answer(10.0, 30.0);
        assert!(!never.is_found && never.sentence.starts_with("No motor speed from 0 to 2000 rpm is sure"), "{}", never.sentence);
        assert_eq!((never.open, never.condition[1].1), (None, 0.0));
    }

    #[test]
    fn ends_are_rounded_to_the_side_that_holds() {
        assert_eq!((rounded(1213.7, f64::floor), rounded(1213.7, f64::ceil)), (1210.0, 1220.0));
        assert_eq!((rounded(9.4249, f64::floor), rounded(0.012_341, f64::ceil)), (9.42, 0.0124));
        assert_eq!((rounded(0.0, f64::floor), rounded(-3.337, f64::floor)), (0.0, -3.34));
    }
}
