//! Integrator of the states: a rational approximation of the exponential with one real pole, third order and L-stable
//! (Nørsett 1974; Hairer and Wanner, Solving Ordinary Differential Equations II, IV.6). A step is divided if its error
//! estimate asks for it. In double and in single precision.

use core::ops::{Add, Div, Mul, Sub};

use crate::format::{MAX_STATES, POLE, WEIGHTS};

/// Error of a step allowed at any point, in the points' unit. Chosen: far below the accuracy of sensors; time of a step
/// against its error.
const TOLERANCE: f64 = 1e-4;
/// Factor (dimensionless) on the third difference of the solves as an error estimate: the error of a scheme of second
/// order.
const ESTIMATE: f64 = 0.5;
/// Shortest part of a step as a share of the step (dimensionless). Chosen: bounds the work of one step.
const SHORTEST: f64 = 1e-6;

/// One number per state.
pub(crate) type States<R> = [R; MAX_STATES];

/// A number of either precision.
pub(crate) trait Real:
    Copy + PartialOrd + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    const ZERO: Self;
    const ONE: Self;
    fn of(x: f64) -> Self;
    /// Absolute value.
    fn size(self) -> Self;
    /// Relative difference up to which two lengths count as equal (dimensionless). Chosen: above rounding in this
    /// precision.
    const ROUNDING: f64;
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const ROUNDING: f64 = 1e-9;
    fn of(x: f64) -> Self {
        x
    }
    fn size(self) -> Self {
        self.abs()
    }
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const ROUNDING: f64 = 1e-6;
    fn of(x: f64) -> Self {
        x as Self
    }
    fn size(self) -> Self {
        self.abs()
    }
}

/// Moves the deviations `away` of `n` states from the steady ones by L (by columns, 1/s) over `duration` seconds.
/// `length` is the length of the last internal step; the function returns the new one. `reach` is the largest change of
/// any point per unit of each state.
pub(crate) fn advance<R: Real>(
    rates: &[States<R>; MAX_STATES],
    away: &mut States<R>,
    n: usize,
    duration: R,
    length: R,
    reach: impl Fn(usize) -> R,
) -> R {
    let (mut left, shortest, tolerance) = (duration, R::of(SHORTEST) * duration, R::of(TOLERANCE));
    let mut next = if length > R::ZERO { length } else { duration };
    let mut factors = Factors::new(rates, if next < left { next } else { left }, n);
    while left > R::ZERO {
        let is_last = next >= left * R::of(1.0 - R::ROUNDING);
        let length = if is_last { left } else { next };
        if factors.length != length {
            factors = Factors::new(rates, length, n);
        }
        let (after, difference) = factors.step(away);
        let sum = (0..n).fold(R::ZERO, |sum, k| sum + difference[k].size() * reach(k));
        let error = R::of(ESTIMATE) * sum;
        // Lengths are halved and doubled only: most steps keep their factors.
        if error > tolerance && length > shortest {
            next = R::of(0.5) * length;
            continue;
        }
        *away = after;
        left = if is_last { R::ZERO } else { left - length };
        let grown = if error < R::of(0.05) * tolerance { R::of(2.0) * length } else { length };
        next = if is_last && grown < next { next } else { grown };
    }
    next
}

pub(crate) fn dot<R: Real>(a: &States<R>, b: &States<R>, n: usize) -> R {
    a.iter().zip(b).take(n).fold(R::ZERO, |sum, (a, b)| sum + *a * *b)
}

/// LU factors of I + POLE length L by columns, with rows exchanged by the largest pivot. All inner loops run down a
/// column: they vectorise.
struct Factors<R> {
    length: R,
    columns: [States<R>; MAX_STATES],
    /// One over the pivots.
    inverse: States<R>,
    order: [usize; MAX_STATES],
    n: usize,
}

impl<R: Real> Factors<R> {
    fn new(rates: &[States<R>; MAX_STATES], length: R, n: usize) -> Self {
        let n = n.min(MAX_STATES);
        let mut columns = *rates;
        for (k, column) in columns.iter_mut().enumerate().take(n) {
            column.iter_mut().take(n).for_each(|entry| *entry = *entry * (R::of(POLE) * length));
            column[k] = column[k] + R::ONE;
        }
        let (mut inverse, mut order) = ([R::ZERO; MAX_STATES], [0; MAX_STATES]);
        order.iter_mut().enumerate().for_each(|(i, place)| *place = i);
        for k in 0..n {
            let (before, behind) = columns.split_at_mut(k + 1);
            let pivots = &before[k];
            let mut largest = k;
            for i in k + 1..n {
                if pivots[i].size() > pivots[largest].size() {
                    largest = i;
                }
            }
            if largest != k {
                before.iter_mut().for_each(|column| column.swap(k, largest));
                behind.iter_mut().take(n - k - 1).for_each(|column| column.swap(k, largest));
                order.swap(k, largest);
            }
            let pivots = &mut before[k];
            inverse[k] = R::ONE / pivots[k];
            pivots[k + 1..n].iter_mut().for_each(|entry| *entry = *entry * inverse[k]);
            for column in behind.iter_mut().take(n - k - 1) {
                let above = column[k];
                for (entry, factor) in column[k + 1..n].iter_mut().zip(&pivots[k + 1..n]) {
                    *entry = *entry - *factor * above;
                }
            }
        }
        Self { length, columns, inverse, order, n }
    }

    fn solve(&self, right: &States<R>) -> States<R> {
        let mut x = [R::ZERO; MAX_STATES];
        for (x, place) in x.iter_mut().zip(&self.order).take(self.n) {
            *x = right[*place];
        }
        for k in 0..self.n {
            let known = x[k];
            for (x, entry) in x[k + 1..self.n].iter_mut().zip(&self.columns[k][k + 1..self.n]) {
                *x = *x - *entry * known;
            }
        }
        for k in (0..self.n).rev() {
            x[k] = x[k] * self.inverse[k];
            let known = x[k];
            for (x, entry) in x[..k].iter_mut().zip(&self.columns[k][..k]) {
                *x = *x - *entry * known;
            }
        }
        x
    }

    /// The deviations after the step, and the third difference of the solves.
    fn step(&self, away: &States<R>) -> (States<R>, States<R>) {
        let one = self.solve(away);
        let two = self.solve(&one);
        let three = self.solve(&two);
        let four = self.solve(&three);
        let (mut after, mut difference) = ([R::ZERO; MAX_STATES], [R::ZERO; MAX_STATES]);
        let (weights, thrice) = (WEIGHTS.map(R::of), R::of(3.0));
        for k in 0..self.n {
            after[k] = weights[0] * one[k] + weights[1] * two[k] + weights[2] * three[k];
            difference[k] = one[k] - thrice * two[k] + thrice * three[k] - four[k];
        }
        (after, difference)
    }
}
