//! Extrapolation from the step before: the temperatures it leads to, and the error of a step.

use super::tr_bdf2::{GAMMA, LOCAL_ERROR, parabola};
use super::{HeatPassing, Transient, TransientState};
use coldplate_network::{Load, Network};

/// Relative difference below which variables and lengths are equal, dimensionless: values between two rows are rounded, and so are two
/// even steps. Chosen above rounding.
const SAME: f64 = 1e-9;

/// The step before, from which the error of the next one is estimated.
#[derive(Debug, Clone, PartialEq)]
pub struct Before {
    /// Temperatures at the beginning of the step, K.
    pub temperatures: Vec<f64>,
    /// Temperatures at the end of its first stage, K.
    pub between: Vec<f64>,
    /// Length of the step, s.
    pub length: f64,
    /// Time at the end of the step, s.
    pub time: f64,
    /// Variables of the machine at the end of the step.
    pub variables: Vec<f64>,
    /// Heat into each solid at its end, W.
    pub flow: Vec<f64>,
    /// Heat that passed at its end.
    pub passing: HeatPassing,
}

impl Before {
    /// Whether it ended at this time in this condition.
    pub(crate) fn ended_at(&self, time: f64, load: &Load) -> bool {
        let is_same = |(a, b): (&f64, &f64)| (a - b).abs() <= SAME * a.abs().max(b.abs());
        self.time == time && self.variables.iter().zip(&load.variables).all(is_same)
    }
}

impl TransientState {
    /// Temperatures of all nodes at a time within the step that led here, K, off by a quarter of the step's error. They lie on the
    /// parabola through its three states; if a node's capacity follows its temperature, its enthalpy does: that has no kink where the
    /// capacity has one. Temperatures of water hold if no front passed.
    pub fn within(&self, network: &Network, time: f64) -> Vec<f64> {
        let Some(before) = self.before.as_ref().filter(|before| before.time == self.time && time < self.time) else {
            return self.temperatures.clone();
        };
        let [first, second, third] = parabola(1.0 - (self.time - time) / before.length);
        let states = before.temperatures.iter().zip(&before.between).zip(&self.temperatures);
        let mut found: Vec<f64> = states.map(|((begin, between), end)| first * begin + second * between + third * end).collect();
        for node in (0..network.solids).filter(|node| network.has_own_heat_curve(*node)) {
            let [begin, between, end] =
                [&before.temperatures, &before.between, &self.temperatures].map(|t| network.enthalpy(node, t[node]));
            found[node] = network.warmed(node, before.temperatures[node], second * (between - begin) + third * (end - begin));
        }
        found
    }
}

impl Transient<'_> {
    /// Temperatures a time `h` ahead, continuing the last step: a parabola, or a straight line further ahead than it was long.
    pub(super) fn extrapolated(&self, state: &TransientState, h: f64) -> Vec<f64> {
        let Some(Before { temperatures, between, length, .. }) = &state.before else { return state.temperatures.clone() };
        let ahead = h / length;
        let along = |((t, m), b): ((&f64, &f64), &f64)| {
            let (late, early) = ((t - m) / (1.0 - GAMMA), (m - b) / GAMMA);
            if ahead <= 1.0 + SAME { t + ahead * late + ahead * (ahead + 1.0 - GAMMA) * (late - early) } else { t + (t - b) }
        };
        state.temperatures.iter().zip(between).zip(temperatures).map(along).collect()
    }

    /// Temperatures at the end of a step of which the first stage is known.
    pub(super) fn continued(&self, state: &TransientState, h: f64, between: &[f64]) -> Vec<f64> {
        let slope = |(a, b): (&f64, &f64)| (b - a) / (GAMMA * h);
        let from_here = state.temperatures.iter().zip(between);
        match &state.before {
            Some(Before { temperatures, length, .. }) if h <= *length * (1.0 + SAME) => from_here
                .zip(temperatures)
                .map(|((a, b), before)| {
                    let bend = (slope((a, b)) - (a - before) / length) / (GAMMA * h + length);
                    (a + h * slope((a, b)) + bend * h * h * (1.0 - GAMMA)).max(0.5 * b)
                })
                .collect(),
            _ => from_here.map(|(a, b)| (a + h * slope((a, b))).max(0.5 * b)).collect(),
        }
    }

    /// Largest local error of the step at any node that stores heat, K, from the third divided difference of its temperatures, or on
    /// the first step, where only three are known, from a tenth of the second. If a node's capacity follows its temperature, the
    /// differences are those of its enthalpy, which is integrated, over the least capacity in the step.
    pub(super) fn local_error(&self, state: &TransientState, h: f64, between: &[f64], after: &[f64]) -> f64 {
        let (a, b) = (GAMMA * h, h);
        let of_course = |begin: f64, middle: f64, end: f64, earlier: Option<(f64, f64)>| {
            let (d1, d2) = ((middle - begin) / a, (end - middle) / (b - a));
            let second = (d2 - d1) / b;
            match earlier {
                Some((earlier, last)) => {
                    let third = (second - (d1 - (begin - earlier) / last) / (a + last)) / (b + last);
                    LOCAL_ERROR * 6.0 * h * h * h * third.abs()
                }
                None => 0.1 * h * h * second.abs(),
            }
        };
        let network = self.network;
        let of_node = |i: usize| {
            let earlier = state.before.as_ref().map(|before| (before.temperatures[i], before.length));
            let (begin, middle, end) = (state.temperatures[i], between[i], after[i]);
            if !network.has_own_heat_curve(i) {
                return of_course(begin, middle, end, earlier);
            }
            let enthalpy = |t: f64| network.enthalpy(i, t);
            let earlier = earlier.map(|(t, last)| (enthalpy(t), last));
            let capacity = [begin, middle, end].map(|t| network.capacity_at(i, t)).into_iter().fold(f64::INFINITY, f64::min);
            of_course(enthalpy(begin), enthalpy(middle), enthalpy(end), earlier) / capacity
        };
        let stores = |i: &usize| network.capacity[*i] > 0.0;
        (0..network.solids).filter(stores).map(of_node).fold(0.0, f64::max)
    }
}
