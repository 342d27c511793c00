//! The machine over time in single precision, for processors without double precision: its numbers take half the memory
//! and half the time.
//!
//! States are moved and points are read in single precision. The parts that depend on the condition alone, the few
//! dozen terms of its polynomials and the steady values, are computed in double precision and then rounded.

use crate::evaluate::Monomials;
use crate::factors::{States, advance, dot};
use crate::format::{MAX_POINTS, MAX_SLOPE_TERMS, MAX_STATES};
use crate::in_time::InTime;
use crate::shape::ShapeError;
use crate::step::{State, StepError};
use crate::surrogate::Surrogate;

/// The machine over time of a surrogate, with numbers rounded to single precision in memory of the caller.
#[derive(Debug, Clone, Copy)]
pub struct Single<'s, 'a> {
    surrogate: &'s Surrogate<'a>,
    own: &'s InTime<'a>,
    /// Coefficients of the steady states, of the rates and of the outputs, then the reach of each state.
    numbers: &'s [f32],
}

/// The state of a machine in single precision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SingleState {
    values: [f32; MAX_STATES],
    /// Length of the last internal step, s; zero at the beginning.
    length: f32,
}

impl From<&State> for SingleState {
    fn from(state: &State) -> Self {
        Self { values: state.values.map(|x| x as f32), length: state.length as f32 }
    }
}

impl From<&SingleState> for State {
    fn from(state: &SingleState) -> Self {
        Self { values: state.values.map(f64::from), length: f64::from(state.length) }
    }
}

/// Terms of a condition, rounded.
struct Rounded {
    values: [f32; MAX_SLOPE_TERMS],
    count: usize,
}

impl From<Monomials> for Rounded {
    fn from(terms: Monomials) -> Self {
        Self { values: terms.values.map(|x| x as f32), count: terms.count }
    }
}

impl InTime<'_> {
    /// Number of numbers that [`Surrogate::single`] rounds.
    #[must_use]
    pub fn single_len(&self) -> usize {
        self.steady_coefficients.len() + self.rates.len() + self.outputs.len() + self.reach.len()
    }
}

impl<'a> Surrogate<'a> {
    /// The machine over time in single precision; `numbers` is memory for [`InTime::single_len`] of them.
    ///
    /// # Errors
    /// The file holds steady states only; memory of another size.
    pub fn single<'s>(&'s self, numbers: &'s mut [f32]) -> Result<Single<'s, 'a>, StepError> {
        let own = self.in_time.as_ref().ok_or(StepError::NotInTime)?;
        if numbers.len() != own.single_len() {
            return Err(ShapeError { argument: "place of numbers", expected: own.single_len(), found: numbers.len() }.into());
        }
        let all = own.steady_coefficients.iter().chain(own.rates.iter()).chain(own.outputs.iter()).chain(own.reach.iter());
        numbers.iter_mut().zip(all).for_each(|(to, from)| *to = from as f32);
        Ok(Single { surrogate: self, own, numbers })
    }
}

impl Single<'_, '_> {
    /// Moves a state by `duration` seconds at the constant condition `x`.
    ///
    /// # Errors
    /// Errors of [`Surrogate::step`].
    pub fn step(&self, state: &mut SingleState, duration: f32, x: &[f64]) -> Result<(), StepError> {
        let own = self.surrogate.moving(x)?;
        if !(duration >= 0.0 && duration.is_finite()) {
            return Err(StepError::Number);
        }
        let (n, steady) = (own.states, self.steady_states(x));
        let terms = Rounded::from(self.surrogate.monomials(&own.moving, x));
        let mut rates = [[0.0; MAX_STATES]; MAX_STATES];
        for (monomial, all) in terms.values[..terms.count].iter().zip(self.rates().chunks_exact((n * n).max(1))) {
            for (column, coefficients) in rates.iter_mut().zip(all.chunks_exact(n.max(1))) {
                column.iter_mut().zip(coefficients).for_each(|(entry, c)| *entry += monomial * c);
            }
        }
        let mut away = self.away(state, &steady);
        let reach = self.part(own.steady_coefficients.len() + own.rates.len() + own.outputs.len(), n);
        state.length = advance(&rates, &mut away, n, duration, state.length, |k| reach.get(k).copied().unwrap_or(0.0));
        for (value, (away, steady)) in state.values.iter_mut().zip(away.iter().zip(&steady)).take(n) {
            *value = steady + away;
        }
        Ok(())
    }

    /// Readings of the points in a state at condition `x`.
    ///
    /// # Errors
    /// Errors of [`Surrogate::read`].
    pub fn read(&self, state: &SingleState, x: &[f64], values: &mut [f32]) -> Result<(), StepError> {
        let own = self.surrogate.moving(x)?;
        let mut buffer = [0.0; MAX_POINTS];
        let steady = &mut buffer[..self.surrogate.points.len().min(MAX_POINTS)];
        if values.len() != steady.len() {
            return Err(ShapeError { argument: "number of values", expected: steady.len(), found: values.len() }.into());
        }
        self.surrogate.evaluate(x, steady)?;
        let terms = Rounded::from(self.surrogate.monomials(&own.moving, x));
        let away = self.away(state, &self.steady_states(x));
        let (n, first) = (own.states, own.steady_coefficients.len() + own.rates.len());
        for (point, (value, steady)) in values.iter_mut().zip(steady.iter()).enumerate() {
            let mut row = [0.0; MAX_STATES];
            combine(self.part(first + point * terms.count * n, terms.count * n), n, &terms, &mut row);
            *value = *steady as f32 + dot(&row, &away, n);
        }
        Ok(())
    }

    fn part(&self, start: usize, count: usize) -> &[f32] {
        crate::bytes::part(self.numbers, start, count)
    }

    fn rates(&self) -> &[f32] {
        self.part(self.own.steady_coefficients.len(), self.own.rates.len())
    }

    fn steady_states(&self, x: &[f64]) -> States<f32> {
        let terms = Rounded::from(self.surrogate.monomials(&self.own.steady, x));
        let mut values = [0.0; MAX_STATES];
        combine(self.part(0, self.own.steady_coefficients.len()), self.own.states, &terms, &mut values);
        values
    }

    fn away(&self, state: &SingleState, steady: &States<f32>) -> States<f32> {
        let mut away = [0.0; MAX_STATES];
        for (away, (value, steady)) in away.iter_mut().zip(state.values.iter().zip(steady)).take(self.own.states) {
            *away = value - steady;
        }
        away
    }
}

/// Adds the terms times their coefficients, `count` a term.
fn combine(coefficients: &[f32], count: usize, terms: &Rounded, values: &mut States<f32>) {
    for (monomial, coefficients) in terms.values[..terms.count].iter().zip(coefficients.chunks_exact(count.max(1))) {
        values.iter_mut().zip(coefficients).for_each(|(value, c)| *value += monomial * c);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &[u8] = include_bytes!("../fixtures/bench-moving.cps");
    /// Numbers of the file in single precision, at most.
    const ROOM: usize = 8192;
    /// Error of single precision (in the points' unit): values of some 300 have seven digits.
    const OPEN: f64 = 2e-4;

    /// Steps from a millisecond to days at conditions all over the range.
    #[test]
    fn states_follow_those_of_double_precision() {
        let surrogate = Surrogate::open(FILE).expect("the fixture is intact");
        let mut numbers = [0.0; ROOM];
        let count = surrogate.in_time().expect("it moves").single_len();
        let single = surrogate.single(&mut numbers[..count]).expect("it moves");
        let (points, variables) = (surrogate.point_count(), surrogate.variable_count());
        let mut x = [0.0; MAX_POINTS];
        let mut state = surrogate.at_temperature(20.0).expect("it moves");
        let mut narrow = SingleState::from(&state);
        let (mut values, mut rounded) = ([0.0; MAX_POINTS], [0.0; MAX_POINTS]);
        let mut random = 1u64;
        let mut largest: f64 = 0.0;
        for number in 0..300 {
            for (v, x) in surrogate.variables().zip(&mut x) {
                random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                *x = v.low + (v.high - v.low) * ((random >> 40) as f64 / 16_777_216.0);
            }
            let duration = [0.001, 0.1, 1.0, 10.0, 60.0, 600.0, 7200.0, 172_800.0][number % 8];
            surrogate.step(&mut state, duration, &x[..variables]).expect("a step");
            single.step(&mut narrow, duration as f32, &x[..variables]).expect("a step");
            surrogate.read(&state, &x[..variables], &mut values[..points]).expect("a reading");
            single.read(&narrow, &x[..variables], &mut rounded[..points]).expect("a reading");
            for (value, rounded) in values[..points].iter().zip(&rounded) {
                largest = largest.max((value - f64::from(*rounded)).abs());
            }
        }
        assert!(largest > 0.0 && largest <= OPEN, "{largest}");
        let back = State::from(&narrow);
        assert_eq!(SingleState::from(&back), narrow);
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let surrogate = Surrogate::open(FILE).expect("the fixture is intact");
        let mut numbers = [0.0; ROOM];
        assert!(matches!(surrogate.single(&mut numbers[..7]), Err(StepError::Shape(_))));
        let count = surrogate.in_time().expect("it moves").single_len();
        let mut state = SingleState::from(&surrogate.at_temperature(20.0).expect("it moves"));
        let single = surrogate.single(&mut numbers[..count]).expect("it moves");
        let x = [1.0; MAX_POINTS];
        let variables = surrogate.variable_count();
        assert_eq!(single.step(&mut state, f32::NAN, &x[..variables]), Err(StepError::Number));
        assert_eq!(single.step(&mut state, -1.0, &x[..variables]), Err(StepError::Number));
        assert!(single.step(&mut state, 1.0, &x[..variables + 1]).is_err());
        assert!(single.read(&state, &x[..variables], &mut [0.0; 1]).is_err());
        let steady = Surrogate::open(include_bytes!("../fixtures/polynomial.cps")).expect("the fixture is intact");
        assert!(matches!(steady.single(&mut []), Err(StepError::NotInTime)));
    }
}
