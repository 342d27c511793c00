//! Bands that include all uncertainties, and verdicts with a probability.

use crate::belief::{Belief, Known};
use crate::direction::{Band, Here, compared};
use crate::evaluate::ShapeError;
use crate::math::sqrt;
use crate::normal::{NINETY_FIVE, probability_below};
use crate::surrogate::Surrogate;
use crate::uncertain::Uncertainty;
use crate::verdict::Acceptability;

/// One limit at one condition, with all uncertainties.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitChance {
    /// The limited quantity, in the points' unit.
    pub value: f64,
    /// Band of the limited quantity.
    pub band: Band,
    /// The largest value allowed.
    pub maximum: f64,
    /// Probability that the limit is kept.
    pub probability: f64,
}

/// The verdict on a condition at a stated confidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chance {
    /// Acceptable if all limits together are kept with at least the probability asked for; not acceptable if they are
    /// kept with at most one minus that probability; otherwise uncertain. Always uncertain outside the fitted range,
    /// without limits, and if a value is no number.
    pub state: Acceptability,
    /// True if every variable lies within its fitted range.
    pub in_domain: bool,
    /// Probability that all limits are kept; NaN without limits.
    pub probability: f64,
    /// The limit that is most likely broken.
    pub binding: Option<usize>,
}

impl Surrogate<'_> {
    /// Values and bands of all points at condition `x`, from the file's knowledge of its parameters or from the
    /// caller's `belief`. A file without uncertainty has the band of its fit alone.
    ///
    /// # Errors
    /// A slice has a wrong length.
    pub fn bands(&self, x: &[f64], belief: Option<&Belief<'_>>, values: &mut [f64], bands: &mut [Band]) -> Result<(), ShapeError> {
        self.evaluate_fit(x, values)?;
        if bands.len() != self.points.len() {
            return Err(ShapeError { argument: "number of bands", expected: self.points.len(), found: bands.len() });
        }
        let Some(uncertainty) = self.uncertainty else {
            for (point, band) in bands.iter_mut().enumerate() {
                let fit = self.half_width(point) / NINETY_FIVE;
                *band = Band { fit, total: fit, ..Band::default() };
            }
            return Ok(());
        };
        let known = belief.map_or(Known::File(&uncertainty), Known::Memory);
        self.here(&uncertainty, x).fill(&known, values, bands);
        Ok(())
    }

    /// Values of all points at condition `x` for a machine whose parameters lie `deviations` standard deviations off
    /// their nominal values, to first order; knowledge about the parameters is not used here. For Monte Carlo over the
    /// machine.
    ///
    /// # Errors
    /// A slice has a wrong length.
    pub fn evaluate_with(&self, x: &[f64], deviations: &[f64], values: &mut [f64]) -> Result<(), ShapeError> {
        let parameters = self.uncertainty.map_or(0, |u| u.parameter_count());
        if deviations.len() != parameters {
            return Err(ShapeError { argument: "number of deviations", expected: parameters, found: deviations.len() });
        }
        self.evaluate_fit(x, values)?;
        let Some(uncertainty) = self.uncertainty else { return Ok(()) };
        let here = self.here(&uncertainty, x);
        for (point, value) in values.iter_mut().enumerate() {
            let direction = here.point(point);
            *value += deviations.iter().enumerate().map(|(k, z)| direction.slope(k) * z).sum::<f64>();
        }
        Ok(())
    }

    /// One limit at condition `x`, given the points' values there from [`Surrogate::bands`]. For a spread, the hottest
    /// and the coldest point there are compared. `None` if there is no limit with this index.
    #[must_use]
    pub fn limit_chance(&self, index: usize, x: &[f64], belief: Option<&Belief<'_>>, values: &[f64]) -> Option<LimitChance> {
        let maximum = self.maxima().get(index)?;
        let kind = self.limit_kind(self.limits.get(index)?);
        let of = |list: &[f64], index: usize| list.get(index).copied().unwrap_or(f64::NAN);
        let value = kind.value(|point| of(values, point), |variable| of(x, variable));
        let band = match self.uncertainty {
            Some(uncertainty) => {
                let known = belief.map_or(Known::File(&uncertainty), Known::Memory);
                self.here(&uncertainty, x).limit(kind, values).band(&known)
            }
            None => {
                let (first, second) = compared(kind, values);
                let fit = sqrt(self.fit_variance(first) + second.map_or(0.0, |second| self.fit_variance(second)));
                Band { fit, total: fit, ..Band::default() }
            }
        };
        Some(LimitChance { value, band, maximum, probability: kept(maximum - value, band.total) })
    }

    /// Values, bands and the verdict at condition `x`: whether all limits together are kept with probability
    /// `confidence`, which lies between one half and one.
    ///
    /// # Errors
    /// A slice has a wrong length.
    pub fn assess(
        &self,
        x: &[f64],
        belief: Option<&Belief<'_>>,
        confidence: f64,
        values: &mut [f64],
        bands: &mut [Band],
    ) -> Result<Chance, ShapeError> {
        if bands.len() != self.points.len() {
            return Err(ShapeError { argument: "number of bands", expected: self.points.len(), found: bands.len() });
        }
        self.judge(x, belief, confidence, values, Some(bands))
    }

    /// The verdict, with the bands if they are asked for.
    pub(crate) fn judge(
        &self,
        x: &[f64],
        belief: Option<&Belief<'_>>,
        confidence: f64,
        values: &mut [f64],
        bands: Option<&mut [Band]>,
    ) -> Result<Chance, ShapeError> {
        let Some(uncertainty) = &self.uncertainty else {
            match bands {
                Some(bands) => self.bands(x, belief, values, bands)?,
                None => self.evaluate_fit(x, values)?,
            }
            let independent = |limit: usize| self.limit_chance(limit, x, None, values);
            return Ok(self.judge_together(x, confidence, independent, |_, _| 0.0));
        };
        self.evaluate_fit(x, values)?;
        let known = belief.map_or(Known::File(uncertainty), Known::Memory);
        let mut here = self.here(uncertainty, x);
        here.remember();
        match bands {
            Some(bands) => here.fill(&known, values, bands),
            None => here.shift(&known, values),
        }
        let direction = |limit: usize| self.limits.get(limit).map(|record| here.limit(self.limit_kind(record), values));
        let chance = |limit: usize| {
            let (kind, maximum) = (self.limit_kind(self.limits.get(limit)?), self.maxima().at(limit));
            let of = |list: &[f64], index: usize| list.get(index).copied().unwrap_or(f64::NAN);
            let value = kind.value(|point| of(values, point), |variable| of(x, variable));
            let band = here.limit(kind, values).band(&known);
            Some(LimitChance { value, band, maximum, probability: kept(maximum - value, band.total) })
        };
        let shared = |a: usize, b: usize| match (direction(a), direction(b)) {
            (Some(a), Some(b)) => a.covariance(&b, &known),
            _ => 0.0,
        };
        Ok(self.judge_together(x, confidence, chance, shared))
    }

    /// Share of each parameter in the variance of limit `index` at condition `x` from all parameters, into `shares`,
    /// one place per parameter. The shares add up to one; for correlated parameters one of them can be negative.
    ///
    /// # Errors
    /// `shares` has a wrong length, or there is no limit with this index.
    pub fn shares(
        &self,
        index: usize,
        x: &[f64],
        belief: Option<&Belief<'_>>,
        values: &[f64],
        shares: &mut [f64],
    ) -> Result<(), ShapeError> {
        let parameters = self.uncertainty.map_or(0, |u| u.parameter_count());
        let wrong = |argument, expected, found| Err(ShapeError { argument, expected, found });
        if shares.len() != parameters {
            return wrong("places for shares", parameters, shares.len());
        }
        let Some(record) = self.limits.get(index) else { return wrong("index of the limit", self.limits.len(), index) };
        let Some(uncertainty) = self.uncertainty else { return Ok(()) };
        let known = belief.map_or(Known::File(&uncertainty), Known::Memory);
        let direction = self.here(&uncertainty, x).limit(self.limit_kind(record), values);
        let of = |k: usize| {
            let along: f64 = (0..parameters).map(|j| direction.slope(j) * known.covariance(k, j)).sum();
            direction.slope(k) * along
        };
        let total: f64 = (0..parameters).map(of).sum();
        for (k, share) in shares.iter_mut().enumerate() {
            *share = if total > 0.0 { of(k) / total } else { 0.0 };
        }
        Ok(())
    }

    /// Share of the variance of limit `index` at condition `x` that one reading of a point there would remove, by an
    /// instrument with standard deviation `deviation`; `None` if the limit or point does not exist.
    #[must_use]
    pub fn worth(&self, index: usize, x: &[f64], belief: Option<&Belief<'_>>, values: &[f64], point: usize, deviation: f64) -> Option<f64> {
        let uncertainty = self.uncertainty?;
        let record = self.limits.get(index)?;
        self.check_point(x, point).ok()?;
        let known = belief.map_or(Known::File(&uncertainty), Known::Memory);
        let here = self.here(&uncertainty, x);
        let (limit, reading) = (here.limit(self.limit_kind(record), values), here.point(point));
        let shared = limit.covariance(&reading, &known);
        let read = reading.band(&known).total;
        let own = limit.band(&known).total;
        let variance = (read * read + deviation * deviation) * own * own;
        Some(if variance > 0.0 { shared * shared / variance } else { 0.0 })
    }

    /// Uncertainty of the answers of this file, if the file states it.
    #[must_use]
    pub fn uncertainty(&self) -> Option<Uncertainty<'_>> {
        self.uncertainty
    }

    pub(crate) fn fit_variance(&self, point: usize) -> f64 {
        let fit = self.half_width(point) / NINETY_FIVE;
        fit * fit
    }

    pub(crate) fn here<'h>(&'h self, uncertainty: &'h Uncertainty<'h>, x: &[f64]) -> Here<'h> {
        Here::new(self, uncertainty, x)
    }
}

/// Probability that a limit is kept, from its margin and the standard deviation of its value. NaN if one of them is NaN
/// or has overflown: the limit then counts neither as kept nor as broken.
fn kept(margin: f64, deviation: f64) -> f64 {
    if !(margin.is_finite() && deviation.is_finite()) {
        return f64::NAN;
    }
    if deviation > 0.0 { probability_below(margin / deviation) } else { f64::from(u8::from(margin >= 0.0)) }
}
