//! Knowledge of the states of an [`Uncertainty`]: their mean and covariance.

use crate::bytes::Numbers;
use crate::shape::ShapeError;
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

    pub(crate) fn check(&self, work: &[f64]) -> Result<(), ShapeError> {
        if work.len() == self.mean.len() {
            return Ok(());
        }
        Err(ShapeError { argument: "places to work in", expected: self.mean.len(), found: work.len() })
    }

    /// One scalar Kalman step: `towards` is the covariance of every state with the reading, `variance` the variance of
    /// the reading, and `gap` its deviation from its expectation. A variance of zero teaches nothing.
    pub(crate) fn condition(&mut self, towards: &[f64], variance: f64, gap: f64) {
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
