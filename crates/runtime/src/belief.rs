//! Knowledge of the states of an [`Uncertainty`], their mean and covariance, and learning from readings.

use crate::bytes::Numbers;
use crate::evaluate::ShapeError;
use crate::normal::probability_above_chi_square;
use crate::surrogate::Surrogate;
use crate::uncertain::{Uncertainty, packed};

/// Knowledge of the states, in memory that the caller lends: a mean per state and the packed lower triangle of their
/// covariance, row by row.
///
/// ```
/// use coldplate_runtime::{Belief, Reading, Surrogate};
///
/// let surrogate = Surrogate::open(include_bytes!("../fixtures/uncertain.cps"))?;
/// let uncertainty = surrogate.uncertainty().ok_or("no uncertainty in this file")?;
/// let (mut mean, mut covariance) = ([0.0; 5], [0.0; 15]); // 5 states, and 5 * 6 / 2 entries
/// let mut belief = Belief::begin(&uncertainty, &mut mean, &mut covariance)?;
/// let mut work = [0.0; 5];
/// let condition = [8.0, 20.0, 21.0];
/// let reading = Reading { point: 0, value: 24.2, deviation: 0.1 };
/// let surprise = surrogate.learn(&condition, &[reading], &mut belief, &mut work)?;
/// assert!(surprise.probability() > 0.001, "the readings leave the model");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Belief<'b> {
    pub(crate) mean: &'b mut [f64],
    pub(crate) covariance: &'b mut [f64],
}

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

impl<'b> Belief<'b> {
    /// The knowledge stated in the file. `mean` has one place per state ([`Uncertainty::states`]) and `covariance`
    /// [`Uncertainty::covariances`] places.
    ///
    /// # Errors
    /// One of them has another length.
    pub fn begin(uncertainty: &Uncertainty<'_>, mean: &'b mut [f64], covariance: &'b mut [f64]) -> Result<Self, ShapeError> {
        let wrong = |argument, expected, found| Err(ShapeError { argument, expected, found });
        if mean.len() != uncertainty.states() {
            return wrong("places for the mean", uncertainty.states(), mean.len());
        }
        if covariance.len() != uncertainty.covariances() {
            return wrong("places for the covariance", uncertainty.covariances(), covariance.len());
        }
        let known = Known::File(uncertainty);
        for i in 0..mean.len() {
            mean[i] = known.mean(i);
            for j in 0..=i {
                covariance[packed(i, j)] = known.covariance(i, j);
            }
        }
        Ok(Self { mean, covariance })
    }

    /// The mean of each state.
    #[must_use]
    pub fn mean(&self) -> &[f64] {
        self.mean
    }

    /// Packed lower triangle of the covariance of the states, row by row.
    #[must_use]
    pub fn covariance(&self) -> &[f64] {
        self.covariance
    }

    /// Takes a state as known: the others change as far as they depend on it. `work` has one place per state.
    ///
    /// # Errors
    /// There is no state with this index, or `work` has another length.
    pub fn know(&mut self, state: usize, value: f64, work: &mut [f64]) -> Result<(), ShapeError> {
        self.check(work)?;
        if state >= self.mean.len() {
            return Err(ShapeError { argument: "index of the state", expected: self.mean.len(), found: state });
        }
        for (i, w) in work.iter_mut().enumerate() {
            *w = self.covariance[packed(i.max(state), i.min(state))];
        }
        let (variance, gap) = (work[state], value - self.mean[state]);
        self.condition(work, variance, gap);
        self.mean[state] = value;
        Ok(())
    }

    fn check(&self, work: &[f64]) -> Result<(), ShapeError> {
        if work.len() == self.mean.len() {
            return Ok(());
        }
        Err(ShapeError { argument: "places to work in", expected: self.mean.len(), found: work.len() })
    }

    /// One scalar Kalman step: `towards` is the covariance of every state with the reading, `variance` the variance of
    /// the reading, and `gap` its deviation from its expectation. A variance of zero teaches nothing.
    fn condition(&mut self, towards: &[f64], variance: f64, gap: f64) {
        if !(variance > 0.0 && variance.is_finite() && gap.is_finite()) {
            return;
        }
        for (i, a) in towards.iter().enumerate() {
            let gain = a / variance;
            self.mean[i] += gain * gap;
            for (j, b) in towards[..=i].iter().enumerate() {
                self.covariance[packed(i, j)] -= gain * b;
            }
            // Rounding must not leave a negative variance.
            if self.covariance[packed(i, i)] < 0.0 {
                self.covariance[packed(i, i)] = 0.0;
            }
        }
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
            let (fit, growth) = direction.beside();
            let variance = own + fit + growth + reading.deviation * reading.deviation;
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
    /// The file states no uncertainty of its answers.
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
            Self::NoUncertainty => write!(f, "this surrogate says nothing of what its answers leave open"),
            Self::OutsideRange => write!(f, "the condition is outside the fitted range"),
            Self::Reading => write!(f, "a reading is not finite, or its standard deviation is not positive"),
            Self::Shape(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for LearnError {}

/// Mean and covariance of the states, from the file or from the caller.
#[derive(Clone, Copy)]
pub(crate) enum Known<'k, 'a, 'b> {
    File(&'k Uncertainty<'a>),
    Memory(&'k Belief<'b>),
}

impl Known<'_, '_, '_> {
    /// Whether the states have their prior distribution: mean zero, and the identity as covariance.
    pub(crate) fn is_prior(&self) -> bool {
        matches!(self, Self::File(Uncertainty { mean: Numbers([]), .. }))
    }

    pub(crate) fn mean(&self, state: usize) -> f64 {
        match self {
            Self::File(uncertainty) => uncertainty.mean.at(state),
            Self::Memory(belief) => belief.mean.get(state).copied().unwrap_or(0.0),
        }
    }

    pub(crate) fn covariance(&self, i: usize, j: usize) -> f64 {
        let place = if i < j { packed(j, i) } else { packed(i, j) };
        match self {
            Self::File(_) if self.is_prior() => f64::from(u8::from(i == j)),
            Self::File(uncertainty) => uncertainty.covariance.at(place),
            Self::Memory(belief) => belief.covariance.get(place).copied().unwrap_or(0.0),
        }
    }
}
