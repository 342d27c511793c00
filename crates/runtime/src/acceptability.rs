//! Verdicts: on a condition, and on one limit at it, with and without a probability.

use crate::direction::Band;

/// Probability for a verdict if the caller states none (dimensionless). Chosen: the usual confidence.
pub const CONFIDENCE: f64 = 0.95;

/// Whether a condition, or one limit at it, is acceptable; the numbers ascend with severity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Acceptability {
    /// Every limit is kept even at the upper end of its band.
    Acceptable = 0,
    /// Too close to call, outside the fitted range, not a number, or no limit to judge by.
    Uncertain = 1,
    /// Some limit is broken even at the lower end of its band.
    NotAcceptable = 2,
}

/// One limit at one condition, in the points' unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitValue {
    /// The limited quantity.
    pub value: f64,
    /// Lower end of the quantity's band.
    pub low: f64,
    /// Upper end of the quantity's band.
    pub high: f64,
    /// The largest value allowed.
    pub maximum: f64,
    /// `maximum - value`: positive where the limit is kept.
    pub margin: f64,
    /// Verdict of this limit alone, inside the fitted range.
    pub state: Acceptability,
}

/// The verdict on a condition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// The verdict.
    pub state: Acceptability,
    /// True if every variable lies within its fitted range.
    pub in_domain: bool,
    /// The deciding limit: among the limits in the worst state, the one with the smallest margin. `None` without
    /// limits.
    pub binding: Option<usize>,
    /// Value of the binding limit; NaN without one, or if the models give no number.
    pub value: f64,
    /// Margin of the binding limit; NaN if its value is NaN.
    pub margin: f64,
}

/// One limit at one condition, with all uncertainties.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitChance {
    /// The limited quantity, in the points' unit.
    pub value: f64,
    /// Band of the limited quantity.
    pub band: Band,
    /// The largest value allowed.
    pub maximum: f64,
    /// Probability that the limit is kept.
    pub probability: f64,
}

/// The verdict on a condition at a stated confidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chance {
    /// Acceptable if all limits together are kept with at least the probability asked for; not acceptable if they are
    /// kept with at most one minus that probability; otherwise uncertain. Always uncertain outside the fitted range,
    /// without limits, and if a value is no number.
    pub state: Acceptability,
    /// True if every variable lies within its fitted range.
    pub in_domain: bool,
    /// Probability that all limits are kept; NaN without limits.
    pub probability: f64,
    /// The limit that is most likely broken.
    pub binding: Option<usize>,
}

/// Verdict from the probability that the limits are kept; uncertain for a probability that is no number.
pub(crate) fn judged(probability: f64, confidence: f64) -> Acceptability {
    if probability >= confidence {
        Acceptability::Acceptable
    } else if probability <= 1.0 - confidence {
        Acceptability::NotAcceptable
    } else {
        Acceptability::Uncertain
    }
}
