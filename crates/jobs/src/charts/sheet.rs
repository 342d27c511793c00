//! `figure = "operator_sheet"`: one page for the wall.

use std::path::Path;

use coldplate_base::condition::{AMBIENT_TEMPERATURE, COOLANT_FLOW, COOLANT_TEMPERATURE, MOTOR_SPEED};
use coldplate_runtime::CONFIDENCE;

use super::super::figures::{self, ContourQuantity, steps};
use super::super::gallery::Gallery;
use super::Head;
use super::limits::{listed, worded};
use super::results::Results;
use super::source::SurrogateSource;
use coldplate_base::document::Section;
use coldplate_base::error::{Error, Result};
use coldplate_figures::chart::acceptability::CellState;
use coldplate_figures::chart::operator_sheet::{FlowCell, FlowTable, OperatorSheet};
use coldplate_figures::chart::style::{Quantity, fixed as decimals, number, readable};
use coldplate_figures::chart::title_and_footer::fixed_conditions;
use coldplate_surrogate::verdict::{self, Acceptability, Inverse, Surrogate, condition, free_within};

/// Most conditions at which one flow is tried: with ends and middle of every range (3⁵), and with the ends alone
/// (2¹⁰). Chosen: more cases find worse ones, each costs a query.
const MOST_CASES: (usize, usize) = (243, 1024);
/// Most raises of a flow before it counts as none. Chosen: a flow that needs more has gaps too thin to rely on.
const MOST_RAISES: usize = 64;
/// Number of flows tried for a cell without one that is sure to be enough. Chosen: a border between refused and uncertain is
/// flatter than the steps between them.
const TRIED: usize = 9;
/// Most rows and columns of the table. Chosen: numbers must be readable from two metres.
const TABLE: (usize, usize) = (6, 5);

/// No keys but those of its source.
#[derive(Debug, Clone)]
pub(super) struct SheetChart {
    source: SurrogateSource,
}

impl SheetChart {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        Ok(Self { source: SurrogateSource::read(root, folder)? })
    }

    pub(super) fn draw(&self, head: &Head, results: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
        let opened = self.source.open(results)?;
        let surrogate = opened.surrogate()?;
        let machine = head.title(opened.machine(&surrogate));
        let sheet = operator_sheet(&surrogate, &machine, &figures::provenance(&surrogate))?;
        head.add(gallery, &sheet)
    }
}

fn quantity(surrogate: &Surrogate<'_>, variable: usize) -> Quantity {
    surrogate.variable(variable).map_or_else(Quantity::default, |v| Quantity::new(v.name, v.unit))
}

/// The sheet for the wall. It has maps at both ends of the ambient temperature. For each speed and coolant temperature
/// it has the smallest flow that is enough, whatever the values of the variables that the table does not show.
///
/// # Errors
/// A surrogate without limits or without the four condition variables; one with more variables than can be looked through.
pub fn operator_sheet(surrogate: &Surrogate<'_>, machine: &str, provenance: &str) -> Result<OperatorSheet> {
    let index = |name: &str| match condition::index_of(surrogate, name)? {
        index if index < surrogate.variable_count() => Ok(index),
        _ => Err(Error::input(format!("the sheet varies '{name}', which was held when the surrogate was made")).help("sweep over it")),
    };
    let (flow, coolant, speed, ambient) =
        (index(COOLANT_FLOW)?, index(COOLANT_TEMPERATURE)?, index(MOTOR_SPEED)?, index(AMBIENT_TEMPERATURE)?);
    let ranges: Vec<(f64, f64)> = surrogate.variables().map(|v| (v.low, v.high)).collect();
    let middle = figures::centre(surrogate);
    let mut maps = Vec::new();
    for end in [ranges[ambient].0, ranges[ambient].1] {
        let mut at = middle.clone();
        at[ambient] = end;
        let mut map = figures::map(surrogate, speed, flow, &at, None, ContourQuantity::Margin)?;
        // Held variables are named in the explanation.
        map.fixed.truncate(map.fixed.len() - surrogate.held().count());
        map.title = format!("{} {}", readable(&quantity(surrogate, ambient).name), quantity(surrogate, ambient).with_value(end));
        maps.push(map);
    }
    let unshown: Vec<usize> = (0..surrogate.variable_count()).filter(|v| ![flow, coolant, speed].contains(v)).collect();
    let (cases, with_middle) = cases(&unshown, &ranges)?;
    let (rows, columns) = (round_steps(ranges[speed], TABLE.0), round_steps(ranges[coolant], TABLE.1));
    let range = FlowRange { variable: flow, low: ranges[flow].0, high: ranges[flow].1 };
    let mut cells = Vec::new();
    for n in &rows {
        for t in &columns {
            let mut at = middle.clone();
            (at[speed], at[coolant]) = (*n, *t);
            cells.push(cell(surrogate, &at, &range, &cases)?);
        }
    }
    let flow_quantity = quantity(surrogate, flow);
    let words = |v: &usize| {
        let (own, (low, high)) = (quantity(surrogate, *v), ranges[*v]);
        format!("{} from {} to {}", readable(&own.name), number(low), own.with_value(high))
    };
    let looked_at = if with_middle { "at both ends and in the middle" } else { "at both ends" };
    Ok(OperatorSheet {
        machine: machine.into(),
        subtitle: format!(
            "Is this condition acceptable? Valid for flows of {} to {}.",
            number(ranges[flow].0),
            flow_quantity.with_value(ranges[flow].1)
        ),
        maps,
        table: Some(FlowTable {
            title: format!("Smallest {} whatever the {}", flow_quantity.label(), listed(unshown.iter().map(words))),
            row: quantity(surrogate, speed),
            rows,
            column: quantity(surrogate, coolant),
            columns,
            cells,
        }),
        limits: worded(surrogate),
        how_to_read: how_to_read(surrogate, looked_at),
        provenance: provenance.into(),
    })
}

/// The ends of a range and round values between them, at most so many in all: a reader looks for 500 and 1000 rpm.
fn round_steps((low, high): (f64, f64), most: usize) -> Vec<f64> {
    let coarse = 10f64.powf(((high - low) / most as f64).log10().floor());
    let steps = [1.0, 2.0, 2.5, 5.0, 10.0, 20.0, 25.0, 50.0].map(|n| n * coarse);
    let inside = |step: f64| {
        // A value that nearly is an end would repeat it.
        let (first, last) = (((low + 0.3 * step) / step).ceil() as i64, ((high - 0.3 * step) / step).floor() as i64);
        (first..=last).map(|k| k as f64 * step).collect::<Vec<f64>>()
    };
    let between = steps.into_iter().map(inside).find(|between| between.len() + 2 <= most).unwrap_or_default();
    std::iter::once(low).chain(between).chain(std::iter::once(high)).collect()
}

/// The explanations, the most important first: the sheet leaves out the last if there is no room.
fn how_to_read(surrogate: &Surrogate<'_>, looked_at: &str) -> Vec<String> {
    let held: Vec<(Quantity, f64)> = figures::always(surrogate);
    let held = (!held.is_empty()).then(|| format!("{}. At any other value this sheet says nothing.", fixed_conditions(&held)));
    let always = [
        "Uncertain means: closer to a limit than the prediction is sure. Take it as not acceptable, or ask.".to_string(),
        format!("The flows of the table are enough {looked_at} of the ranges in its heading, in every combination."),
        "any: every flow is enough. none: no flow is. ask: no flow is sure to be enough, and some may be.".into(),
        "Find the speed below and the flow at the side: the colour and the hatching say whether the condition is acceptable.".into(),
        "The letter in a region is the limit that decides there.".into(),
    ];
    held.into_iter().chain(always).collect()
}

/// Values of the variables that the table does not show.
type Case = Vec<(usize, f64)>;

/// Every combination of the ends of these variables' ranges, with their middles unless there are too many, and whether
/// the middles are included. Either end may be the worse one: a limit above the ambient temperature is hardest where it
/// is cold outside, one in degrees where it is hot.
fn cases(unshown: &[usize], ranges: &[(f64, f64)]) -> Result<(Vec<Case>, bool)> {
    let count = |values: usize| u32::try_from(unshown.len()).ok().and_then(|n| values.checked_pow(n)).unwrap_or(usize::MAX);
    let with_middle = count(3) <= MOST_CASES.0;
    if !with_middle && count(2) > MOST_CASES.1 {
        return Err(Error::input(format!("the sheet cannot look through {} variables that its table does not show", unshown.len()))
            .help("hold some of them in the sweep, or make the sheet from a sweep of fewer variables"));
    }
    let mut cases: Vec<Case> = vec![Vec::new()];
    for v in unshown {
        let (low, high) = ranges[*v];
        let values = if with_middle { vec![low, f64::midpoint(low, high), high] } else { vec![low, high] };
        let with = |case: &Case| values.iter().map(|x| case.iter().copied().chain([(*v, *x)]).collect()).collect::<Vec<Case>>();
        cases = cases.iter().flat_map(with).collect();
    }
    Ok((cases, with_middle))
}

/// Flow that the table gives, with its range.
struct FlowRange {
    /// Index of the variable.
    variable: usize,
    low: f64,
    high: f64,
}

/// Cell of the table at one speed and coolant temperature.
fn cell(surrogate: &Surrogate<'_>, at: &[f64], flow: &FlowRange, cases: &[Case]) -> Result<FlowCell> {
    let acceptable = |text: String| FlowCell { text, state: CellState::Acceptable };
    let Some(smallest) = smallest_for_all(surrogate, at, flow, cases)? else { return none_or_ask(surrogate, at, flow, cases) };
    if smallest <= flow.low {
        return Ok(acceptable("any".into()));
    }
    // The flow is rounded up; it must still be in the range and enough. A flow that is enough only in a band thinner than
    // can be set counts as none.
    for digits in 1..=3 {
        let scale = 10f64.powi(digits);
        let rounded = (smallest * scale).ceil() / scale;
        if rounded <= flow.high && hardest(surrogate, at, flow, rounded, cases)?.is_none() {
            return Ok(acceptable(decimals(rounded, digits as usize)));
        }
    }
    none_or_ask(surrogate, at, flow, cases)
}

/// Cell without a flow that is sure to be enough: uncertain if at some flow no case is surely refused.
fn none_or_ask(surrogate: &Surrogate<'_>, at: &[f64], flow: &FlowRange, cases: &[Case]) -> Result<FlowCell> {
    for value in steps(flow.low, flow.high, TRIED) {
        let mut is_refused = false;
        for case in cases {
            is_refused |= verdict::query(surrogate, &with(at, flow, value, case))?.verdict == Acceptability::NotAcceptable;
        }
        if !is_refused {
            return Ok(FlowCell { text: "ask".into(), state: CellState::Uncertain });
        }
    }
    Ok(FlowCell { text: "none".into(), state: CellState::NotAcceptable })
}

/// The condition `at` with a flow and the values of a case.
fn with(at: &[f64], flow: &FlowRange, value: f64, case: &Case) -> Vec<f64> {
    let mut x = at.to_vec();
    x[flow.variable] = value;
    case.iter().for_each(|(v, own)| x[*v] = *own);
    x
}

/// The smallest flow that is acceptable in every case; `None` without one. The flow is raised to the one that the hardest
/// case asks for, until no case asks for more: a flow that one case refuses cannot be that of all.
fn smallest_for_all(surrogate: &Surrogate<'_>, at: &[f64], flow: &FlowRange, cases: &[Case]) -> Result<Option<f64>> {
    let (low, high) = (flow.low, flow.high);
    let mut least = low;
    for _ in 0..MOST_RAISES {
        let Some(case) = hardest(surrogate, at, flow, least, cases)? else { return Ok(Some(least)) };
        if least >= high {
            return Ok(None);
        }
        match free_within(surrogate, &case, flow.variable, Some((least, high)), CONFIDENCE)? {
            // Raise it a little more if rounding would ask for the same flow again.
            Inverse::Found { smallest, .. } => least = smallest.max(least + 1e-6 * (high - low)).min(high),
            Inverse::Nowhere { .. } | Inverse::OutsideRange(_) => return Ok(None),
        }
    }
    Ok(None)
}

/// The condition with the least margin among the cases that are not acceptable at a flow; `None` if all are
/// acceptable.
fn hardest(surrogate: &Surrogate<'_>, at: &[f64], flow: &FlowRange, value: f64, cases: &[Case]) -> Result<Option<Vec<f64>>> {
    let mut found: Option<(f64, Vec<f64>)> = None;
    for case in cases {
        let x = with(at, flow, value, case);
        let answer = verdict::query(surrogate, &x)?;
        if answer.verdict == Acceptability::Acceptable {
            continue;
        }
        let margin = answer.binding.and_then(|i| answer.limits.get(i)).map_or(f64::NEG_INFINITY, |l| l.margin);
        if found.as_ref().is_none_or(|(least, _)| margin < *least) {
            found = Some((margin, x));
        }
    }
    Ok(found.map(|(_, x)| x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_stand_at_round_values() {
        assert_eq!(round_steps((250.0, 2500.0), 6), [250.0, 500.0, 1000.0, 1500.0, 2000.0, 2500.0]);
        assert_eq!(round_steps((18.0, 24.0), 5), [18.0, 20.0, 22.0, 24.0]);
        for (low, high) in [(0.0, 1.0), (-3.7, 12.9), (0.013, 0.0271), (1e6, 3.3e6)] {
            let values = round_steps((low, high), 6);
            assert!(values.len() <= 6 && values.len() > 3 && values.windows(2).all(|p| p[0] < p[1]), "{values:?}");
            assert!(values[0] == low && values[values.len() - 1] == high);
        }
    }

    #[test]
    fn every_end_and_middle_is_looked_at_as_long_as_they_are_not_too_many() {
        let ranges = vec![(0.0, 2.0); 12];
        let (two, with_middle) = cases(&[3, 5], &ranges).unwrap();
        assert!(with_middle && two.len() == 9 && two.contains(&vec![(3, 1.0), (5, 2.0)]) && two.contains(&vec![(3, 0.0), (5, 0.0)]));
        let (many, with_middle) = cases(&[0, 1, 2, 3, 4, 5], &ranges).unwrap();
        assert!(!with_middle && many.len() == 64);
        assert!(cases(&(0..11).collect::<Vec<_>>(), &ranges).is_err());
    }
}
