//! Newton's method on the temperatures of a network, damped so that no absolute temperature doubles or turns negative.

use super::csr::for_chunks;
use coldplate_base::error::{Error, Result, Stop};

/// Largest change of an absolute temperature in one step, as a share of it, dimensionless. Chosen below 1, where it would double or
/// vanish: T⁴ makes a step from far below overshoot.
const LARGEST_CHANGE: f64 = 0.9;

/// Heat balances of all nodes of a network, which [`solve`] closes.
pub(super) trait HeatBalances {
    /// Sum of the absolute heat balances, W, formed at temperatures of all nodes, K.
    fn assess(&mut self, temperatures: &[f64]) -> Result<f64>;

    /// Whether the temperatures (K) assessed last are the solution, although they leave `imbalance` (W).
    fn are_closed(&mut self, temperatures: &[f64], imbalance: f64) -> Result<bool>;

    /// Writes the Newton step, K, from the temperatures (K) assessed last, which leave `imbalance` (W).
    fn find_step(&mut self, temperatures: &[f64], imbalance: f64, step: &mut [f64]) -> Result<()>;

    /// Words for when the temperatures were assessed last, such as "at 0.5 s".
    fn when(&self) -> String;

    /// Error where the last allowed step still leaves `imbalance` (W).
    fn unsolved(&self, imbalance: f64) -> Error;
}

/// Closes heat balances by at most `most` steps from a first guess, K, which becomes the solution.
///
/// # Errors
/// Errors of the balances; temperatures that are no longer finite; balances that are still open after the last step.
pub(super) fn solve(balances: &mut impl HeatBalances, temperatures: &mut [f64], most: usize) -> Result<()> {
    let mut step = vec![0.0; temperatures.len()];
    let mut steps = 0;
    loop {
        let imbalance = balances.assess(temperatures)?;
        if !imbalance.is_finite() {
            return Err(Error::stopped(Stop::NotFinite, format!("the temperatures are no longer finite {}", balances.when())));
        }
        if balances.are_closed(temperatures, imbalance)? {
            return Ok(());
        }
        if steps == most {
            return Err(balances.unsolved(imbalance));
        }
        balances.find_step(temperatures, imbalance, &mut step)?;
        let factor = damping(&step, temperatures);
        for_chunks(temperatures, |first, part| part.iter_mut().zip(&step[first..]).for_each(|(t, s)| *t += factor * s));
        steps += 1;
    }
}

/// Factor on a step (K) with which no absolute temperature (K) may more than double or turn negative, dimensionless.
fn damping(step: &[f64], temperatures: &[f64]) -> f64 {
    let shortened = |factor: f64, (t, s): (&f64, &f64)| {
        let most = LARGEST_CHANGE * t;
        if s.abs() > most { factor.min(most / s.abs()) } else { factor }
    };
    temperatures.iter().zip(step).fold(1.0, shortened)
}

/// Largest absolute entry of a step, K.
pub(super) fn largest(step: &[f64]) -> f64 {
    step.iter().fold(0.0, |m: f64, s| m.max(s.abs()))
}
