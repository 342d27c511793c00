//! The power as stated, a number or a formula, at every temperature of what it heats.

use super::{Law, LinearPower, Slope};

/// The power as stated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConstantPower;

impl Law for ConstantPower {
    fn power(&self, base: f64, _: f64) -> Slope {
        Slope::constant(base)
    }

    fn linear(&self) -> Option<LinearPower> {
        Some(LinearPower::UNSTATED)
    }
}
