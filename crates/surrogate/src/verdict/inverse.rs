//! The inverse question: which value of one variable makes a condition acceptable?
//!
//! The slack of a condition is the smallest distance of a limit from the upper end of its band. If the surrogate has
//! uncertainty, it is the probability that all limits are kept, less the one asked for. The condition is acceptable if
//! the slack is not negative. Over the range of the free variable the slack need be neither monotone nor of one sign.
//! Therefore it is sampled, its extrema between samples are refined where they could hide a change of sign, and the
//! changes of sign are bisected.

use coldplate_runtime::{CONFIDENCE, Surrogate};

use super::slack::Slack;
use super::{OutOfRange, SurrogateAnswer, condition, outside_besides, query_at};
use coldplate_base::error::{Error, Result};

/// Reason why an interval of acceptable values ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The fitted range, or the bounds that were stated, end there.
    Range,
    /// The limit of this index is no longer kept for sure.
    Limit(usize),
    /// No row of the fit lies beyond.
    NoRows,
}

/// Number of intervals of the scan over the fitted range. Chosen: twelve, the highest degree of a polynomial, would
/// resolve one; radial functions have at most some tens of centres along one axis.
const INTERVALS: usize = 1024;
/// Length at which bisection and the search for extrema stop, as a fraction of the fitted range. Chosen: far below
/// the digits that are shown.
const RESOLUTION: f64 = 1e-9;
/// The answer to the inverse question.
#[derive(Debug, Clone, PartialEq)]
pub enum Inverse {
    /// The condition becomes acceptable.
    Found {
        /// The smallest acceptable value in the fitted range, in the variable's unit.
        smallest: f64,
        /// Every value from `smallest` to this one is acceptable.
        until: f64,
        /// Reasons why the interval ends below and above.
        stops: [Stop; 2],
        /// The answer at `smallest`.
        answer: SurrogateAnswer,
    },
    /// No value in the fitted range makes it acceptable.
    Nowhere {
        /// The value that comes closest.
        best: f64,
        /// Index of the limit that stands in the way there.
        limit: usize,
        /// Excess of the upper end of the limit's band over the limit there, in the limit's unit.
        excess: f64,
        /// The answer at `best`.
        answer: SurrogateAnswer,
    },
    /// The other variables lie outside the fitted range, where nothing is acceptable for sure.
    OutsideRange(Vec<OutOfRange>),
}

/// The smallest value of variable `free` in its fitted range that makes the condition acceptable, the
/// other variables being those of `x` (`x[free]` is not looked at).
///
/// # Errors
/// A variable that does not exist or was held fixed, a condition of wrong length, a surrogate
/// without limits.
pub fn free(surrogate: &Surrogate<'_>, x: &[f64], free: usize) -> Result<Inverse> {
    free_within(surrogate, x, free, None, CONFIDENCE)
}

/// The smallest value of variable `free` between the two `bounds`, in the variable's unit, that makes the condition acceptable
/// with the probability `confidence`.
///
/// # Errors
/// Errors of [`free`]; bounds outside the fitted range.
pub fn free_within(surrogate: &Surrogate<'_>, x: &[f64], free: usize, bounds: Option<(f64, f64)>, confidence: f64) -> Result<Inverse> {
    let (varied, variables) = (surrogate.variable_count(), condition::variables(surrogate));
    let Some(variable) = variables.get(free).filter(|_| [varied, variables.len()].contains(&x.len())) else {
        return Err(Error::input("a condition of this surrogate has another number of values").read(x.len()));
    };
    if surrogate.limit_count() == 0 {
        return Err(Error::input("this surrogate holds no limits, so nothing says what is acceptable"));
    }
    let (low, high) = (variable.low, variable.high);
    if low == high {
        return Err(Error::input(format!("'{}' was held at {low} {} when the surrogate was fitted", variable.name, variable.unit))
            .at_key(variable.name)
            .help("free a variable that was varied"));
    }
    let (from, to) = bounds.unwrap_or((low, high));
    if !(low <= from && from < to && to <= high) {
        return Err(Error::input("these bounds are not in the fitted range, or not in order")
            .at_key(variable.name)
            .read(format!("{from} to {to} {}", variable.unit))
            .help(format!("it is fitted from {low} to {high} {}", variable.unit)));
    }
    let (low, high) = (from, to);
    let mut line = Line { judge: Slack::new(surrogate, confidence), x: x.to_vec(), free };
    line.x[free] = low;
    let missing = outside_besides(surrogate, query_at(surrogate, &line.x, confidence)?.outside, &[free]);
    if !missing.is_empty() {
        return Ok(Inverse::OutsideRange(missing));
    }
    // The functions do not take held variables.
    line.x.truncate(varied);

    let samples = line.samples(low, high);
    let Some(first) = samples.iter().position(|s| s.slack >= 0.0) else {
        let best = samples.iter().max_by(|a, b| a.slack.total_cmp(&b.slack)).map_or(low, |s| s.at);
        let (_, limit) = line.slack(best);
        return Ok(Inverse::Nowhere {
            best,
            limit,
            excess: line.judge.excess(limit, &line.x),
            answer: query_at(surrogate, &line.x, confidence)?,
        });
    };
    let resolution = RESOLUTION * (high - low);
    let smallest = match first.checked_sub(1) {
        Some(before) => line.edge(samples[before].at, samples[first].at, resolution),
        None => low,
    };
    let until = match samples[first..].windows(2).find(|pair| pair[1].slack < 0.0) {
        Some(pair) => line.edge(pair[1].at, pair[0].at, resolution),
        None => high,
    };
    let mut stop = |beyond: f64| {
        if !(low..=high).contains(&beyond) {
            return Stop::Range;
        }
        let (_, limit) = line.slack(beyond);
        if surrogate.in_domain(&line.x) { Stop::Limit(limit) } else { Stop::NoRows }
    };
    let stops = [stop(smallest - 2.0 * resolution), stop(until + 2.0 * resolution)];
    line.x[free] = smallest;
    Ok(Inverse::Found { smallest, until, stops, answer: query_at(surrogate, &line.x, confidence)? })
}

#[derive(Clone, Copy)]
struct Sample {
    at: f64,
    slack: f64,
}

/// A condition with one variable free.
struct Line<'a, 'b> {
    judge: Slack<'a, 'b>,
    x: Vec<f64>,
    free: usize,
}

impl Line<'_, '_> {
    /// The slack at a value of the free variable, and the index of the limit with this slack.
    fn slack(&mut self, at: f64) -> (f64, usize) {
        self.x[self.free] = at;
        let found = self.judge.at(&self.x);
        (found.slack, found.limit)
    }

    /// Samples in order: the scan, with the extrema between its samples that reach for the other sign.
    fn samples(&mut self, low: f64, high: f64) -> Vec<Sample> {
        let at = |i: usize| if i == INTERVALS { high } else { low + (high - low) * (i as f64 / INTERVALS as f64) };
        let scan: Vec<Sample> = (0..=INTERVALS).map(|i| Sample { at: at(i), slack: self.slack(at(i)).0 }).collect();
        let mut samples = Vec::with_capacity(scan.len() + 8);
        for (i, here) in scan.iter().enumerate() {
            let mut extremum = None;
            if let Some([before, _, after]) = i.checked_sub(1).and_then(|start| scan.get(start..start + 3)) {
                // sign: +1 looks for a maximum below zero, -1 for a minimum above it
                let sign = if here.slack < 0.0 { 1.0 } else { -1.0 };
                let turns = sign * here.slack >= sign * before.slack && sign * here.slack >= sign * after.slack;
                let flat = before.slack == here.slack && here.slack == after.slack;
                if turns && !flat && here.slack.is_finite() {
                    extremum = Some(self.extremum(before.at, after.at, sign, RESOLUTION * (high - low)));
                }
            }
            match extremum {
                Some(e) if e.at < here.at => samples.extend([e, *here]),
                Some(e) if e.at > here.at => samples.extend([*here, e]),
                _ => samples.push(*here),
            }
        }
        // Extrema of neighbouring samples share an interval and may come out of order.
        samples.sort_by(|a, b| a.at.total_cmp(&b.at));
        samples
    }

    /// The maximum (`sign` 1) or minimum (`sign` -1) of the slack between two places, by golden section.
    fn extremum(&mut self, mut a: f64, mut b: f64, sign: f64, resolution: f64) -> Sample {
        let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
        let (mut c, mut d) = (b - golden * (b - a), a + golden * (b - a));
        let (mut at_c, mut at_d) = (self.slack(c).0, self.slack(d).0);
        while b - a > resolution {
            if sign * at_c > sign * at_d {
                (b, d, at_d) = (d, c, at_c);
                c = b - golden * (b - a);
                at_c = self.slack(c).0;
            } else {
                (a, c, at_c) = (c, d, at_d);
                d = a + golden * (b - a);
                at_d = self.slack(d).0;
            }
            if !(a < c && c < d && d < b) {
                break; // the places no longer differ in double precision
            }
        }
        if sign * at_c > sign * at_d { Sample { at: c, slack: at_c } } else { Sample { at: d, slack: at_d } }
    }

    /// The change of sign between a place that is not acceptable and one that is; the acceptable side of it.
    fn edge(&mut self, mut bad: f64, mut good: f64, resolution: f64) -> f64 {
        while (good - bad).abs() > resolution {
            let middle = 0.5 * (good + bad);
            if middle == good || middle == bad {
                break;
            }
            if self.slack(middle).0 >= 0.0 { good = middle } else { bad = middle }
        }
        good
    }
}
