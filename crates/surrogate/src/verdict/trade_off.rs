//! Two variables traded off against each other: the smallest acceptable value of one for values of the other.

use coldplate_runtime::Surrogate;

use super::optimum::{FreeVariable, check};
use super::{Inverse, OutOfRange, condition, free_within, outside_besides, query_at};
use coldplate_base::error::{Error, Result};

/// Number of values of the second variable, from end to end. Chosen: steps of a tenth of the range.
const STEPS: usize = 11;

/// The smallest acceptable value of the first variable at one value of the second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exchange {
    /// The second variable.
    pub given: f64,
    /// The smallest acceptable value of the first variable, and the end of the interval that is acceptable from there; `None` if no
    /// value is.
    pub acceptable: Option<VariableInterval>,
}

/// Values of a variable from one to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VariableInterval {
    /// Lower end.
    pub from: f64,
    /// Upper end.
    pub until: f64,
}

/// The answer to a trade-off: acceptable values of one variable for each value of another.
#[derive(Debug, Clone, PartialEq)]
pub enum TradeOff {
    /// One row per value of the second variable.
    Rows(Vec<Exchange>),
    /// The other variables lie outside the fitted range.
    OutsideRange(Vec<OutOfRange>),
}

/// For values of `second` from end to end, the smallest value of `first` that is acceptable with the probability `confidence`.
/// `x` holds all variables; these two are chosen.
///
/// # Errors
/// Errors of [`free_within`], for either variable; twice the same one.
pub fn trade_off(surrogate: &Surrogate<'_>, x: &[f64], first: FreeVariable, second: FreeVariable, confidence: f64) -> Result<TradeOff> {
    let variables = condition::variables(surrogate);
    check(&first, surrogate, &variables)?;
    check(&second, surrogate, &variables)?;
    if first.index == second.index {
        return Err(Error::input("a variable cannot be traded off against itself").at_key(variables[first.index].name));
    }
    let mut x = x.to_vec();
    (x[first.index], x[second.index]) = (first.low, second.low);
    let missing = outside_besides(surrogate, query_at(surrogate, &x, confidence)?.outside, &[first.index, second.index]);
    if !missing.is_empty() {
        return Ok(TradeOff::OutsideRange(missing));
    }
    let row = |step: usize| {
        let share = step as f64 / (STEPS - 1) as f64;
        let given = if step + 1 == STEPS { second.high } else { second.low + (second.high - second.low) * share };
        let mut x = x.clone();
        x[second.index] = given;
        let acceptable = match free_within(surrogate, &x, first.index, Some((first.low, first.high)), confidence)? {
            Inverse::Found { smallest, until, .. } => Some(VariableInterval { from: smallest, until }),
            Inverse::Nowhere { .. } | Inverse::OutsideRange(_) => None,
        };
        Ok(Exchange { given, acceptable })
    };
    (0..STEPS).map(row).collect::<Result<_>>().map(TradeOff::Rows)
}
