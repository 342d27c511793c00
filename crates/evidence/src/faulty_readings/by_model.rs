//! Rows of wrong conditions, judged by the model beside all other faults.
//!
//! A row counts as one of wrong conditions if all its sensors are off by the change that another value of one condition gives.
//! The machine is solved for that value.

use super::{Fault, OddRow, blanked, find, odd_row, suspects, without};
use crate::identify::{self, Prediction, Runs};
use crate::measurement::{Data, MeasurementUncertainty, ReadingRow, whiten};
use coldplate_base::error::Result;
use coldplate_describe::machine::Condition;
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;

/// Most rows of wrong conditions that are looked for, count. Chosen: each costs a few solves per variable.
const MOST_ROWS: usize = 3;
/// Largest deviations of a row that another value may leave: a share of the row's deviations, or a multiple of the scatter of
/// its sensors, whichever is larger. Dimensionless; chosen: looser values name conditions that do not explain the row.
const LEFT: [f64; 2] = [0.1, 3.0];
/// Least difference of the fitted value from the stated one, in stated standard deviations of the condition. Chosen: a smaller
/// one takes usual errors of a condition for wrong ones.
const OFF: f64 = 5.0;
/// Least deviation of half of the sensors of a row, in standard deviations of their noise, if no other value explains the row.
/// Chosen: a smaller one takes effects of the machine for wrong rows.
const FAR: f64 = 20.0;
/// Most steps towards the fitting value, count. Chosen: each costs a solve.
const STEPS: usize = 6;

/// Data without their faults.
#[derive(Debug, Clone)]
pub struct Cleared {
    /// The readings that are left.
    pub data: Data,
    /// The faults that were found; marked if they were left out.
    pub faults: Vec<Fault>,
    /// Readings and rows of a table that stand out by themselves, but may be the machine's.
    pub suspects: Vec<Fault>,
}

/// Finds faulty readings and leaves them out; logs begin with the state `start`.
///
/// # Errors
/// The machine cannot be solved at a condition, or a log cannot be run.
pub fn cleared(study: &Study, data: &Data, uncertainty: &MeasurementUncertainty, start: Start) -> Result<Cleared> {
    let predicted = identify::values_within(study, data, start, Runs::beside(study, &uncertainty.noise, start).tolerance)?;
    let mut found = find(data, &predicted, &uncertainty.noise);
    let places = whiten::places(data);
    // Rows are judged without the readings that are wrong by themselves.
    let left = |found: &[Fault]| -> (Data, Vec<f64>) {
        let rest = blanked(data, found);
        let is_kept = |(place, told): (&(usize, usize), &f64)| rest.rows[place.0].readings[place.1].map(|_| *told);
        let told = places.iter().zip(&predicted).filter_map(is_kept).collect();
        (rest, told)
    };
    for _ in 0..if data.is_transient() { 0 } else { MOST_ROWS } {
        let (rest, told) = left(&found);
        let Some(odd) = odd_row(&rest, &told, &uncertainty.noise) else { break };
        let fault = wrong_condition(study, &rest, uncertainty, &odd).or_else(|| wrong_row(&rest, uncertainty, &odd));
        let Some(fault) = fault else { break };
        found.push(fault);
    }
    let (rest, told) = left(&found);
    let suspects = suspects(&rest, &told, &uncertainty.noise);
    found.sort_by_key(|fault| *fault.rows.start());
    let data = without(data, &mut found);
    Ok(Cleared { data, faults: found, suspects })
}

/// Another value of one condition, with which the sensors of the row fit those of the other rows.
struct Fitting {
    variable: usize,
    /// The value, SI.
    value: f64,
    /// Root mean square of the deviations left, over the scatter of the sensors.
    left: f64,
}

/// Fault of an odd row whose deviations disappear with another value of one condition. `None` if there is no such condition, or
/// if its stated uncertainty suffices.
fn wrong_condition(study: &Study, data: &Data, uncertainty: &MeasurementUncertainty, odd: &OddRow) -> Option<Fault> {
    let variables = &study.model.machine.variables;
    let mut fitting: Vec<Fitting> = (0..variables.len()).filter_map(|v| fitted(study, data, odd, v)).collect();
    fitting.sort_by(|a, b| a.left.total_cmp(&b.left));
    let best = fitting.first().filter(|best| best.left < (LEFT[0] * odd.size(&odd.off)).max(LEFT[1]))?;
    let condition = &data.rows[odd.row].condition;
    let stated = condition.si()[best.variable];
    if (best.value - stated).abs() < OFF * uncertainty.at(condition)[best.variable] {
        return None;
    }
    let others = fitting[1..].iter().filter(|other| other.left < 2.0 * best.left.max(LEFT[1]));
    let shown = |fit: &Fitting| format!("{} {}", variables[fit.variable].name, variables[fit.variable].with_unit(fit.value, 4));
    let or: String = others.map(|other| format!(", or {}", shown(other))).collect();
    let words = format!(
        "{} is {}, but all {} sensors fit {}{or}",
        variables[best.variable].name,
        variables[best.variable].with_unit(stated, 4),
        odd.sensors.len(),
        shown(best)
    );
    Some(Fault::wrong_condition(data, odd.row, &variables[best.variable].name, words))
}

/// Fault of a row that is far off, although its stated conditions lie between those of other rows. An effect of the machine
/// would show in the neighbouring rows too, so the readings belong to other conditions. At the end of a range it may be the
/// machine.
fn wrong_row(data: &Data, uncertainty: &MeasurementUncertainty, odd: &OddRow) -> Option<Fault> {
    let far = odd.off.iter().zip(&odd.sensors).filter(|(off, k)| off.abs() > FAR * uncertainty.noise[**k]).count();
    if !odd.is_inside || 2 * far < odd.sensors.len() {
        return None;
    }
    let most = odd.off.iter().fold(0.0f64, |most, off| if off.abs() > most.abs() { *off } else { most });
    let words = format!(
        "all {} sensors are off what they show in other rows, the most by {most:+.1} K, and no other value of one condition explains it: \
         the readings of other conditions",
        odd.sensors.len()
    );
    Some(Fault::wrong_row(data, odd.row, words))
}

/// Value of a variable with which the sensors of a row are off least. `None` if the machine cannot be solved with it.
fn fitted(study: &Study, data: &Data, odd: &OddRow, v: usize) -> Option<Fitting> {
    let variable = &study.model.machine.variables[v];
    let own = &data.rows[odd.row];
    let at = |value: f64| -> Option<Prediction> {
        let mut si = own.condition.si().to_vec();
        si[v] = value;
        let row = ReadingRow { condition: Condition::from_si(si), ..own.clone() };
        identify::predict(study, &Data { rows: vec![row], ..data.clone() }, &[], Start::Steady).ok()
    };
    // Half the range is allowed beyond either end: a mistyped value is often outside.
    let (low, high) = variable.range.map_or((f64::NEG_INFINITY, f64::INFINITY), |(low, high)| {
        let least = if low > 0.0 && !variable.dimension.is_absolute() { 0.1 * low } else { low - 0.5 * (high - low) };
        (least, high + 0.5 * (high - low))
    });
    let value = own.condition.si()[v];
    let first = at(value)?;
    let left = |found: &Prediction| -> Vec<f64> {
        odd.off.iter().zip(&found.values).zip(&first.values).map(|((off, now), before)| off - (now - before)).collect()
    };
    // A variable that is positive by nature, such as a flow, is varied by its logarithm.
    let is_ratio = value > 0.0 && !variable.dimension.is_absolute();
    let mut found = first.clone();
    let mut best = Fitting { variable: v, value, left: odd.size(&odd.off) };
    for _ in 0..STEPS {
        let unit = if is_ratio { best.value } else { 1.0 };
        let slopes = found.conditions.iter().map(|row| row[v] * unit).zip(&odd.scatter).zip(left(&found));
        let (dot, square) = slopes.fold((0.0, 0.0), |(d, q), ((s, w), o)| (d + s * o / (w * w), q + s * s / (w * w)));
        let step = if square > 0.0 { dot / square } else { 0.0 };
        let moved = |share: f64| if is_ratio { best.value * (share * step).exp() } else { best.value + share * step };
        let nearer = [1.0, 0.5, 0.25].into_iter().find_map(|share| {
            let value = moved(share).clamp(low, high);
            let found = at(value)?;
            let left = odd.size(&left(&found));
            (left < best.left).then_some((Fitting { variable: v, value, left }, found))
        });
        let Some((better, there)) = nearer else { break };
        let is_close = better.left > 0.99 * best.left;
        (best, found) = (better, there);
        if is_close {
            break;
        }
    }
    Some(best)
}
