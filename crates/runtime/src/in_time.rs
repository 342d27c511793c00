//! The section of a file on the machine over time.

use crate::bytes::Numbers;
use crate::model::Polynomial;

/// The section of a file on the machine over time.
#[derive(Debug, Clone, Copy)]
pub struct InTime<'a> {
    pub(crate) states: usize,
    /// Terms of the steady states, and of the rates and outputs.
    pub(crate) steady: Polynomial<'a>,
    pub(crate) moving: Polynomial<'a>,
    /// Largest error of each point over time, in its unit.
    pub(crate) errors: Numbers<'a>,
    /// Largest change of any point per unit of each state.
    pub(crate) reach: Numbers<'a>,
    /// States of one temperature everywhere: at temperature zero, and per unit of the points.
    pub(crate) uniform: Numbers<'a>,
    /// Packed lower triangle of the covariance of the states' deviations from the steady ones.
    pub(crate) spread: Numbers<'a>,
    /// Coefficients of the steady states: term by term, one per state.
    pub(crate) steady_coefficients: Numbers<'a>,
    /// Coefficients of L: term by term, states times states, column by column.
    pub(crate) rates: Numbers<'a>,
    /// Coefficients of the outputs: point by point, term by term, one per state.
    pub(crate) outputs: Numbers<'a>,
    /// Self-tests: two conditions, a duration and the values at its end, for each.
    pub(crate) tests: Numbers<'a>,
    pub(crate) test_count: usize,
    /// All numbers in the order of the file.
    pub(crate) numbers: Numbers<'a>,
}

impl<'a> InTime<'a> {
    /// The terms of the steady states; this polynomial has no points.
    #[must_use]
    pub fn steady_terms(&self) -> Polynomial<'a> {
        self.steady
    }

    /// The terms of rates and outputs; this polynomial has no points.
    #[must_use]
    pub fn moving_terms(&self) -> Polynomial<'a> {
        self.moving
    }

    /// All numbers of the section in the order of the file, which the format states.
    #[must_use]
    pub fn numbers(&self) -> Numbers<'a> {
        self.numbers
    }

    /// Number of states.
    #[must_use]
    pub fn states(&self) -> usize {
        self.states
    }

    /// Number of self-tests at the end of [`InTime::numbers`]: two conditions, a duration and the values at its end,
    /// for each.
    #[must_use]
    pub fn test_count(&self) -> usize {
        self.test_count
    }

    /// Largest error of a point over time beyond its band in the steady state, in its unit; zero if the point does not
    /// exist.
    #[must_use]
    pub fn error(&self, point: usize) -> f64 {
        self.errors.at(point)
    }
}
