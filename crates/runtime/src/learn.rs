//! Learning from readings.

use crate::belief::{Belief, Known};
use crate::normal::probability_above_chi_square;
use crate::shape::ShapeError;
use crate::surrogate::Surrogate;

/// A reading of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Index of the point.
    pub point: usize,
    /// Value of the reading, in the point's unit.
    pub value: f64,
    /// Standard deviation of the instrument, in the point's unit.
    pub deviation: f64,
}

/// Distance of readings from their expectation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surprise {
    /// Sum of the squares of the independent parts of their deviations, each over its standard deviation.
    pub chi_square: f64,
    /// Number of readings.
    pub readings: usize,
}

impl Surprise {
    /// Probability that readings of a machine that agrees with the file are at least this far from their expectation.
    /// Below 0.001 something has changed that the parameters do not describe: ask for a diagnosis.
    #[must_use]
    pub fn probability(self) -> f64 {
        probability_above_chi_square(self.chi_square, self.readings)
    }
}

impl Surrogate<'_> {
    /// Learns from readings at condition `x`: a Kalman step per reading, on the parameters and on the model error at
    /// each point. Readings that repeat a condition teach the parameters no more than the model error allows. `work`
    /// has one place per state.
    ///
    /// # Errors
    /// The file states no uncertainty; the condition has a wrong length or lies outside the fitted range; a point does
    /// not exist; a reading is no number or its deviation is no positive number; or a slice has a wrong length. Nothing
    /// is learnt then.
    pub fn learn(&self, x: &[f64], readings: &[Reading], belief: &mut Belief<'_>, work: &mut [f64]) -> Result<Surprise, LearnError> {
        let uncertainty = self.uncertainty().ok_or(LearnError::NoUncertainty)?;
        belief.check(work).map_err(LearnError::Shape)?;
        let states = uncertainty.states();
        if belief.mean.len() != states || belief.covariance.len() != uncertainty.covariances() {
            return Err(LearnError::Shape(ShapeError { argument: "states of the belief", expected: states, found: belief.mean.len() }));
        }
        for reading in readings {
            self.check_point(x, reading.point).map_err(LearnError::Shape)?;
            if !(reading.value.is_finite() && reading.deviation.is_finite() && reading.deviation > 0.0) {
                return Err(LearnError::Reading);
            }
        }
        if !self.in_domain(x) {
            return Err(LearnError::OutsideRange);
        }
        let here = self.here(&uncertainty, x);
        let mut surprise = Surprise { chi_square: 0.0, readings: readings.len() };
        for reading in readings {
            let direction = here.point(reading.point);
            let expected = self.evaluate_fit_of(x, reading.point).map_err(LearnError::Shape)? + direction.mean(&Known::Memory(belief));
            for (i, w) in work.iter_mut().enumerate() {
                *w = direction.towards(&Known::Memory(belief), i);
            }
            let own = direction.variance_of(|i| work.get(i).copied().unwrap_or(0.0));
            let beside: f64 = direction.beside().iter().sum();
            let variance = own + beside + reading.deviation * reading.deviation;
            let gap = reading.value - expected;
            surprise.chi_square += gap * gap / variance;
            belief.condition(work, variance, gap);
        }
        Ok(surprise)
    }
}

/// Reason why nothing was learnt from readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum LearnError {
    /// The file states no uncertainty of the machine.
    NoUncertainty,
    /// The condition is outside the fitted range.
    OutsideRange,
    /// A reading is no number, or its deviation is not positive.
    Reading,
    /// A slice or index does not fit.
    Shape(ShapeError),
}

impl core::fmt::Display for LearnError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NoUncertainty => write!(f, "this surrogate states no uncertainty of the machine"),
            Self::OutsideRange => write!(f, "the condition is outside the fitted range"),
            Self::Reading => write!(f, "a reading is not finite, or its standard deviation is not positive"),
            Self::Shape(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for LearnError {}
