//! Constant power: the stated number or formula, at every temperature of the heated place.

use super::{Law, LinearPower, Slope};

/// The stated power.
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
