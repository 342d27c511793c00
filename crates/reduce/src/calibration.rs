//! Calibration of the bound on conditions whose full solutions are known.

use super::model::ReducedAnswer;

/// Factor, dimensionless, on the largest margin that a reading of the calibration needed. Chosen: larger covers more
/// unseen conditions, but widens every bound.
const SAFETY: f64 = 3.0;
/// Least margin of the bound, dimensionless. Chosen: the calibration may not have met the worst reading, larger
/// widens every bound.
pub(super) const LEAST_MARGIN: f64 = 1.0;
/// Error that the tolerance of the full solver leaves open, K: errors below are not counted against the bound.
pub(super) const FLOOR: f64 = 1e-5;
/// Floor of the bound as a share of the largest error in the calibration. Chosen: it covers readings at which both
/// networks happen to agree.
const FLOOR_SHARE: f64 = 0.25;

/// An answer at a condition whose full solution is known.
pub(super) struct ComparedAnswer {
    /// Error of every reading, K.
    errors: Vec<f64>,
    pub(super) answer: ReducedAnswer,
}

impl ComparedAnswer {
    /// Comparison with the readings of the full solution (K).
    pub(super) fn of(answer: ReducedAnswer, truth: &[f64]) -> Self {
        Self { errors: truth.iter().zip(&answer.readings).map(|(t, r)| (t - r).abs()).collect(), answer }
    }
}

/// Margin and floor with which the bound holds at conditions whose full solution is known.
pub(super) struct Calibration {
    pub(super) margin: f64,
    /// The least bound, K.
    pub(super) floor: f64,
    /// Largest error of a reading at these conditions, K.
    pub(super) worst: f64,
}

impl Calibration {
    /// Calibration from answers at conditions whose full solutions are known.
    pub(super) fn at(compared: &[ComparedAnswer]) -> Self {
        let worst = compared.iter().flat_map(|own| &own.errors).fold(0.0, |most: f64, error| most.max(*error));
        // Both networks may agree and still be off together.
        let floor = FLOOR.max(FLOOR_SHARE * worst);
        let mut needed: f64 = 0.0;
        for ComparedAnswer { errors, answer } in compared {
            let apart = answer.readings.iter().zip(&answer.finer).map(|(c, f)| (c - f).abs());
            let largest = apart.clone().fold(0.0, f64::max);
            let counted = errors.iter().zip(apart).filter(|(error, _)| **error > FLOOR);
            let beyond = counted.map(|(error, apart)| error - apart).fold(0.0, f64::max);
            if largest > 0.0 {
                needed = needed.max(beyond / largest);
            }
        }
        Self { margin: (SAFETY * needed).max(LEAST_MARGIN), floor, worst }
    }
}
