//! The machine over time: a few states that relax towards the steady state, step by step.
//!
//! At a condition x the states z follow z' = -L(x) (z - z_s(x)), and a point reads f(x) + C(x) (z - z_s(x)): every
//! steady state is that of [`Surrogate::query`]. The condition is constant over a step. The integrator is a rational
//! approximation of the exponential with one real pole, third order and L-stable (Nørsett 1974; Hairer and Wanner,
//! Solving Ordinary Differential Equations II, IV.6). A step is divided if its error estimate asks for it.

use core::fmt;

use crate::bytes::Numbers;
use crate::evaluate::Monomials;
use crate::factors::{States, advance, dot};
use crate::format::{MAX_POINTS, MAX_STATES};
use crate::in_time::InTime;
use crate::shape::ShapeError;
use crate::surrogate::Surrogate;
use crate::uncertain::packed;

/// Number of products summed side by side (count): eight doubles fill one register of 512 bits or two of 256 bits.
const LANES: usize = 8;

/// The state of a machine: [`Surrogate::at_rest`] and related functions make one, [`Surrogate::step`] moves it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    pub(crate) values: [f64; MAX_STATES],
    /// Length of the last internal step, s; zero at the beginning.
    pub(crate) length: f64,
}

impl State {
    /// The state as numbers, for storage elsewhere: the states, then the length of the last internal step, s.
    #[must_use]
    pub fn numbers(&self) -> [f64; MAX_STATES + 1] {
        let mut all = [self.length; MAX_STATES + 1];
        all[..MAX_STATES].copy_from_slice(&self.values);
        all
    }

    /// The state of [`State::numbers`].
    #[must_use]
    pub fn from_numbers(all: &[f64; MAX_STATES + 1]) -> Self {
        let mut values = [0.0; MAX_STATES];
        values.copy_from_slice(&all[..MAX_STATES]);
        Self { values, length: all[MAX_STATES] }
    }
}

/// Reason why a state cannot be made or moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepError {
    /// The file holds steady states only.
    NotInTime,
    /// A slice has the wrong length.
    Shape(ShapeError),
    /// A condition, temperature or duration is no finite number, or the duration is negative.
    Number,
}

impl fmt::Display for StepError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotInTime => f.write_str("this surrogate knows steady states only"),
            Self::Shape(error) => error.fmt(f),
            Self::Number => f.write_str("a condition, temperature or duration is no finite number, or the duration is negative"),
        }
    }
}

impl core::error::Error for StepError {}

impl From<ShapeError> for StepError {
    fn from(error: ShapeError) -> Self {
        Self::Shape(error)
    }
}

impl<'a> Surrogate<'a> {
    /// The steady state at condition `x`.
    ///
    /// # Errors
    /// The file holds steady states only; `x` does not have one finite value per variable.
    pub fn at_rest(&self, x: &[f64]) -> Result<State, StepError> {
        let own = self.moving(x)?;
        Ok(State { values: self.steady_states(own, x), length: 0.0 })
    }

    /// The state in which everything has one temperature, in the points' unit.
    ///
    /// # Errors
    /// The file holds steady states only; the temperature is no finite number.
    pub fn at_temperature(&self, temperature: f64) -> Result<State, StepError> {
        let own = self.in_time.as_ref().ok_or(StepError::NotInTime)?;
        if !temperature.is_finite() {
            return Err(StepError::Number);
        }
        let mut values = [0.0; MAX_STATES];
        for (k, value) in values.iter_mut().enumerate().take(own.states) {
            *value = own.uniform.at(k) + own.uniform.at(own.states + k) * temperature;
        }
        Ok(State { values, length: 0.0 })
    }

    /// The most probable state at condition `x` given readings of the points, each with standard deviation `deviation`;
    /// a reading is NaN for a point that is not measured. Without any reading it is the steady state.
    ///
    /// # Errors
    /// The file holds steady states only; a wrong number of values; a deviation that is not positive.
    pub fn at_readings(&self, x: &[f64], readings: &[f64], deviation: f64) -> Result<State, StepError> {
        let own = self.moving(x)?;
        if !(deviation > 0.0 && deviation.is_finite()) {
            return Err(StepError::Number);
        }
        let mut buffer = [0.0; MAX_POINTS];
        let steady = &mut buffer[..self.points.len().min(MAX_POINTS)];
        self.evaluate(x, steady)?;
        if readings.len() != steady.len() {
            return Err(ShapeError { argument: "number of readings", expected: steady.len(), found: readings.len() }.into());
        }
        let n = own.states;
        let mut covariance = [[0.0; MAX_STATES]; MAX_STATES];
        for (i, row) in covariance.iter_mut().enumerate().take(n) {
            for (j, entry) in row.iter_mut().enumerate().take(n) {
                *entry = own.spread.at(if i < j { packed(j, i) } else { packed(i, j) });
            }
        }
        let terms = self.monomials(&own.moving, x);
        let mut away = [0.0; MAX_STATES];
        for (point, (reading, steady)) in readings.iter().zip(steady.iter()).enumerate().filter(|(_, (r, _))| r.is_finite()) {
            let row = own.output(point, &terms);
            let mut gain = [0.0; MAX_STATES];
            for (gain, own) in gain.iter_mut().zip(&covariance).take(n) {
                *gain = dot(own, &row, n);
            }
            let error = deviation * deviation + own.errors.at(point) * own.errors.at(point);
            let variance = dot(&row, &gain, n) + error;
            let surprise = reading - steady - dot(&row, &away, n);
            for (i, away) in away.iter_mut().enumerate().take(n) {
                *away += gain[i] * surprise / variance;
                for (entry, other) in covariance[i].iter_mut().zip(&gain).take(n) {
                    *entry -= gain[i] * other / variance;
                }
            }
        }
        let mut state = self.at_rest(x)?;
        state.values.iter_mut().zip(away).for_each(|(value, away)| *value += away);
        Ok(state)
    }

    /// Moves a state by `duration` seconds at the constant condition `x`.
    ///
    /// # Errors
    /// The file holds steady states only; `x` does not have one finite value per variable; the duration is negative or
    /// no number. The state is unchanged then.
    pub fn step(&self, state: &mut State, duration: f64, x: &[f64]) -> Result<(), StepError> {
        let own = self.moving(x)?;
        if !(duration >= 0.0 && duration.is_finite()) {
            return Err(StepError::Number);
        }
        let (n, steady) = (own.states, self.steady_states(own, x));
        let rates = own.rates(&self.monomials(&own.moving, x));
        let mut away = [0.0; MAX_STATES];
        for (away, (value, steady)) in away.iter_mut().zip(state.values.iter().zip(&steady)).take(n) {
            *away = value - steady;
        }
        state.length = advance(&rates, &mut away, n, duration, state.length, |k| own.reach.at(k));
        for (value, (away, steady)) in state.values.iter_mut().zip(away.iter().zip(&steady)).take(n) {
            *value = steady + away;
        }
        Ok(())
    }

    /// Readings of the points in a state at condition `x`.
    ///
    /// # Errors
    /// The file holds steady states only; a wrong number of values or of places for them.
    pub fn read(&self, state: &State, x: &[f64], values: &mut [f64]) -> Result<(), StepError> {
        let own = self.moving(x)?;
        self.evaluate(x, values)?;
        let (steady, terms) = (self.steady_states(own, x), self.monomials(&own.moving, x));
        let mut away = [0.0; MAX_STATES];
        for (away, (value, steady)) in away.iter_mut().zip(state.values.iter().zip(&steady)).take(own.states) {
            *away = value - steady;
        }
        for (point, value) in values.iter_mut().enumerate() {
            *value += own.moved(point, &terms, &away);
        }
        Ok(())
    }

    pub(crate) fn moving(&self, x: &[f64]) -> Result<&InTime<'a>, StepError> {
        let own = self.in_time.as_ref().ok_or(StepError::NotInTime)?;
        if x.len() != self.variables.len() {
            return Err(ShapeError { argument: "number of variables", expected: self.variables.len(), found: x.len() }.into());
        }
        if x.iter().all(|v| v.is_finite()) { Ok(own) } else { Err(StepError::Number) }
    }

    fn steady_states(&self, own: &InTime<'_>, x: &[f64]) -> States<f64> {
        let terms = self.monomials(&own.steady, x);
        let mut values = [0.0; MAX_STATES];
        combine(own.steady_coefficients, 0, own.states, &terms, &mut values);
        values
    }
}

impl InTime<'_> {
    /// Rates L by columns, 1/s.
    fn rates(&self, terms: &Monomials) -> [States<f64>; MAX_STATES] {
        let mut rates = [[0.0; MAX_STATES]; MAX_STATES];
        let n = self.states;
        for (term, monomial) in terms.values[..terms.count].iter().enumerate() {
            for (k, column) in rates.iter_mut().enumerate().take(n) {
                let coefficients = self.rates.part((term * n + k) * n, n);
                for (entry, coefficient) in column.iter_mut().zip(coefficients.iter()) {
                    *entry += monomial * coefficient;
                }
            }
        }
        rates
    }

    /// Contribution of the states' deviations from the steady ones to a point.
    fn moved(&self, point: usize, terms: &Monomials, away: &States<f64>) -> f64 {
        let (n, first) = (self.states, point * terms.count * self.states);
        let all = self.outputs.part(first, terms.count * n);
        let rows = terms.values[..terms.count].iter().zip(all.chunks(n));
        rows.fold(0.0, |sum, (monomial, row)| sum + monomial * along(row, away))
    }

    /// Contribution of a unit of each state to a point.
    fn output(&self, point: usize, terms: &Monomials) -> States<f64> {
        let mut row = [0.0; MAX_STATES];
        combine(self.outputs, point * terms.count * self.states, self.states, terms, &mut row);
        row
    }
}

/// The scalar product of coefficients and states, in lanes that a processor adds side by side.
fn along(coefficients: Numbers<'_>, states: &States<f64>) -> f64 {
    let (whole, rest) = coefficients.0.as_chunks::<LANES>();
    let (blocks, _) = states.as_chunks::<LANES>();
    let mut lanes = [0.0; LANES];
    for (own, states) in whole.iter().zip(blocks) {
        for k in 0..LANES {
            lanes[k] += f64::from_le_bytes(own[k]) * states[k];
        }
    }
    let behind = states.iter().skip(whole.len() * LANES);
    let rest = rest.iter().zip(behind).fold(0.0, |sum, (own, state)| sum + f64::from_le_bytes(*own) * state);
    lanes.iter().fold(rest, |sum, lane| sum + lane)
}

/// Adds the terms times their coefficients, which begin at `start`, `count` a term.
fn combine(coefficients: Numbers<'_>, start: usize, count: usize, terms: &Monomials, values: &mut States<f64>) {
    for (term, monomial) in terms.values[..terms.count].iter().enumerate() {
        for (value, coefficient) in values.iter_mut().zip(coefficients.part(start + term * count, count).iter()) {
            *value += monomial * coefficient;
        }
    }
}
