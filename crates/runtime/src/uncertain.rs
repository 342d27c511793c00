//! Uncertainty of a surrogate's answers: its uncertain parameters, the slopes of every point with respect to them, and
//! the model error.
//!
//! All uncertainty is expressed in *states*, which are standard normal before anything is learnt: one per parameter,
//! one per point (the model error there alone), and one for the model error common to all points. The value of point i
//! at condition x is
//!
//! ```text
//! f_i(x) + sum over parameters k of  J_ik(x) z_k  +  own_i b_i  +  common_i s
//! ```
//!
//! with the fitted function f, its error, and an error that grows with the distance from the measured conditions.

use crate::bytes::{Numbers, u16_at, u32_at};
use crate::format::MEDIUM_RECORD;
use crate::math::{exp_minus, ln};
use crate::model::{Polynomial, Transform};

/// Relation between a parameter's value and its standardised deviation z.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// value = nominal + deviation z
    Linear,
    /// value = nominal exp(deviation z / nominal)
    Log,
    /// value = nominal / (1 - deviation z / nominal), for parameters that act as a resistance, such as contacts and
    /// films
    Reciprocal,
}

impl Scale {
    pub(crate) fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Linear),
            1 => Some(Self::Log),
            2 => Some(Self::Reciprocal),
            _ => None,
        }
    }
}

/// Source of the uncertainty of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// The machine file states it.
    Stated,
    /// Nothing was stated: the uncertainty usual for parameters of this kind.
    Assumed,
}

/// An uncertain parameter of the machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter<'a> {
    /// Key of the parameter in the machine file, or the name of a factor that several share.
    pub name: &'a str,
    /// Unit of the parameter's values.
    pub unit: &'a str,
    /// The value the surrogate was made with.
    pub nominal: f64,
    /// Standard deviation of the parameter, to first order.
    pub deviation: f64,
    /// Smallest value that may be stated for it.
    pub low: f64,
    /// Largest value that may be stated for it.
    pub high: f64,
    /// Relation between value and standardised deviation.
    pub scale: Scale,
    /// Source of the standard deviation.
    pub origin: Origin,
}

impl Parameter<'_> {
    /// The standardised deviation z at which the parameter has this value; not finite for impossible values.
    #[must_use]
    pub fn standardised(&self, value: f64) -> f64 {
        let share = self.deviation / self.nominal;
        match self.scale {
            Scale::Linear => (value - self.nominal) / self.deviation,
            Scale::Log => ln(value / self.nominal) / share,
            Scale::Reciprocal => (1.0 - self.nominal / value) / share,
        }
    }

    /// The parameter's value at a standardised deviation.
    #[must_use]
    pub fn value(&self, z: f64) -> f64 {
        let change = self.deviation / self.nominal * z;
        match self.scale {
            Scale::Linear => self.nominal + self.deviation * z,
            Scale::Log => self.nominal * if change < 0.0 { exp_minus(-change) } else { 1.0 / exp_minus(change) },
            Scale::Reciprocal => self.nominal / (1.0 - change),
        }
    }
}

/// The section of a file on the uncertainty of its answers.
#[derive(Debug, Clone, Copy)]
pub struct Uncertainty<'a> {
    pub(crate) records: &'a [[u8; MEDIUM_RECORD]],
    pub(crate) text: &'a str,
    /// Nominal value, deviation, low and high of each parameter.
    pub(crate) values: Numbers<'a>,
    /// Model error at each point: alone and in common with the others, as standard deviations.
    pub(crate) misses: Numbers<'a>,
    /// Growth of the model error per unit of distance from the measured conditions (share of `misses`).
    pub(crate) growth: f64,
    /// Conditions at which the model was compared with measurements, in the variables' units.
    pub(crate) measured: Numbers<'a>,
    /// Mean of every state and packed lower triangle of their covariance; empty if the states have their prior
    /// distribution.
    pub(crate) mean: Numbers<'a>,
    pub(crate) covariance: Numbers<'a>,
    /// Terms of the slopes.
    pub(crate) slope_terms: Polynomial<'a>,
    /// Point by point, term by term, one coefficient per parameter, in the point's unit per standard deviation.
    pub(crate) slopes: Numbers<'a>,
    /// The standard deviation of every point at the conditions of the self-tests.
    pub(crate) tests: Numbers<'a>,
    pub(crate) points: usize,
    pub(crate) variables: usize,
}

impl<'a> Uncertainty<'a> {
    /// Number of uncertain parameters.
    #[must_use]
    pub fn parameter_count(&self) -> usize {
        self.records.len()
    }

    /// Parameter `index`.
    #[must_use]
    pub fn parameter(&self, index: usize) -> Option<Parameter<'a>> {
        let record = self.records.get(index)?;
        let (start, name, unit) = (u32_at(record, 0), u16_at(record, 4), u16_at(record, 6));
        let text = |from: usize, length: usize| from.checked_add(length).and_then(|end| self.text.get(from..end)).unwrap_or("");
        let [nominal, deviation, low, high] = [0, 1, 2, 3].map(|k| self.values.at(4 * index + k));
        Some(Parameter {
            name: text(start, name),
            unit: text(start.saturating_add(name), unit),
            nominal,
            deviation,
            low,
            high,
            scale: Scale::from_code(record[8]).unwrap_or(Scale::Linear),
            origin: if record[9] == 0 { Origin::Stated } else { Origin::Assumed },
        })
    }

    /// The parameters, in the order of the states.
    pub fn parameters(&self) -> impl Iterator<Item = Parameter<'a>> + '_ {
        (0..self.records.len()).filter_map(|i| self.parameter(i))
    }

    /// Number of points of the slopes.
    #[must_use]
    pub fn point_count(&self) -> usize {
        self.points
    }

    /// Number of variables of the slopes.
    #[must_use]
    pub fn variable_count(&self) -> usize {
        self.variables
    }

    /// Number of terms of the slopes.
    #[must_use]
    pub fn terms(&self) -> usize {
        self.slope_terms.terms
    }

    /// Exponent of a variable in a term of the slopes; zero if the term or variable does not exist.
    #[must_use]
    pub fn exponent(&self, term: usize, variable: usize) -> u8 {
        self.slope_terms.exponent(term, variable)
    }

    /// Transform of variable `index` in the slopes.
    #[must_use]
    pub fn transform(&self, index: usize) -> Transform {
        self.slope_terms.transform(index)
    }

    /// Coefficient of a term of a point's slope along a parameter, in the point's unit per standard deviation; zero if
    /// there is none.
    #[must_use]
    pub fn slope_coefficient(&self, point: usize, term: usize, parameter: usize) -> f64 {
        let parameters = self.records.len();
        let exists = point < self.points && term < self.slope_terms.terms && parameter < parameters;
        if exists { self.slopes.at((point * self.slope_terms.terms + term) * parameters + parameter) } else { 0.0 }
    }

    /// Relative growth of the model error per half of a fitted range away from the mean of the measured conditions
    /// (share).
    #[must_use]
    pub fn growth(&self) -> f64 {
        self.growth
    }

    /// The conditions at which the model was compared with measurements, one value per variable each.
    pub fn measured(&self) -> impl Iterator<Item = Numbers<'a>> + '_ {
        (0..self.measured.len() / self.variables.max(1)).map(|i| self.measured.part(i * self.variables, self.variables))
    }

    /// Mean of the states and packed lower triangle of their covariance, if they differ from the prior distribution.
    #[must_use]
    pub fn known(&self) -> Option<(Numbers<'a>, Numbers<'a>)> {
        if self.mean.is_empty() { None } else { Some((self.mean, self.covariance)) }
    }

    /// Coefficient of a term in the contribution of the parameters' mean to a point.
    pub(crate) fn shift(&self, point: usize, term: usize) -> f64 {
        (0..self.records.len()).map(|k| self.slope_coefficient(point, term, k) * self.mean.at(k)).sum()
    }

    /// Number of states: one per parameter, one per point, one for all points.
    #[must_use]
    pub fn states(&self) -> usize {
        self.records.len() + self.points + 1
    }

    /// Number of entries of the packed covariance of the states.
    #[must_use]
    pub fn covariances(&self) -> usize {
        packed(self.states(), 0)
    }

    /// Model error at a point, alone and in common with all points: standard deviations in the point's unit; zero if
    /// the point does not exist.
    #[must_use]
    pub fn missed(&self, point: usize) -> (f64, f64) {
        (self.misses.at(2 * point), self.misses.at(2 * point + 1))
    }
}

/// Index of the entry (i, j), j at most i, in a packed lower triangle.
pub(crate) fn packed(i: usize, j: usize) -> usize {
    i * (i + 1) / 2 + j
}
