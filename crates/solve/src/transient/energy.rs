//! Heat that crosses the boundary of a machine over time, and heat that it stores.

use super::super::balance::{Balance, balance};
use coldplate_network::{Load, Network};

/// Heat that crossed the boundary of the machine and its water, and stored heat, J.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energy {
    /// Heat that entered.
    pub entered: f64,
    /// Heat that left.
    pub left: f64,
    /// Increase of the stored heat since the beginning.
    pub stored: f64,
    /// Heat that parts and water took up or gave off from step to step, whatever its sign: what a closed machine exchanges inside.
    pub moved: f64,
    /// Rounding of the stored heat, step by step.
    pub rounding: f64,
}

/// Rounding of a sum of enthalpies, in units of its terms' rounding; dimensionless. Chosen: a few operations for each term.
const ROUNDINGS: f64 = 8.0;

impl Energy {
    /// Error of the balance, entered - left - stored, beyond rounding and over the largest of the three and of the heat that moved.
    pub fn relative(&self) -> f64 {
        let largest = self.entered.max(self.left).max(self.stored.abs()).max(self.moved);
        let open = (self.entered - self.left - self.stored).abs();
        // An error that is not a number is not within rounding.
        if open <= self.rounding { 0.0 } else { (open - self.rounding) / largest }
    }

    /// Counts the heat `more` that something took up and now has `now`, J.
    pub(super) fn store(&mut self, more: f64, now: f64) {
        self.stored += more;
        self.moved += more.abs();
        self.rounding += ROUNDINGS * f64::EPSILON * now.abs();
    }

    pub(super) fn add(&mut self, entered: f64, left: f64) {
        self.entered += entered;
        self.left += left;
    }
}

/// Heat that enters and leaves the solids and their surroundings other than water, W.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeatPassing {
    /// Heat that enters.
    pub entering: f64,
    /// Heat that leaves.
    pub leaving: f64,
}

impl HeatPassing {
    pub(super) fn at(network: &Network, load: &Load, temperatures: &[f64]) -> Self {
        Self::of(&balance(network, load, &[], temperatures))
    }

    pub(super) fn of(found: &Balance) -> Self {
        Self { entering: found.in_watts, leaving: found.out_watts }
    }
}
