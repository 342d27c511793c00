//! Bound of a reduced model: how far a reading may be from the full model's.
//!
//! Two nested networks answer, and the finer one is the better. A reading's bound is d + m D + f: d is the difference of the two
//! networks in this reading, D the largest difference of any reading so far, and the margin m and the floor f are calibrated on
//! full solves (`calibration.rs`).

/// Bounds of readings, one instant after another.
pub(crate) struct ReadingBound {
    margin: f64,
    floor: f64,
    /// Largest difference of the two networks so far, K.
    largest: f64,
}

impl ReadingBound {
    /// A bound with this margin (dimensionless) and floor (K).
    pub(crate) fn new(margin: f64, floor: f64) -> Self {
        Self { margin, floor, largest: 0.0 }
    }

    /// Bounds of the readings of one instant, K.
    pub(crate) fn of(&mut self, finer: &[f64], coarser: &[f64]) -> Vec<f64> {
        let differences: Vec<f64> = finer.iter().zip(coarser).map(|(fine, coarse)| (fine - coarse).abs()).collect();
        self.largest = differences.iter().copied().fold(self.largest, f64::max);
        differences.iter().map(|d| d + self.margin * self.largest + self.floor).collect()
    }
}
