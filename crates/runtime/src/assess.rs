//! Verdicts with a probability, from bands that include all uncertainties.

use crate::acceptability::{Chance, LimitChance};
use crate::belief::{Belief, Known};
use crate::direction::{Band, Here, compared};
use crate::normal::probability_below;
use crate::shape::{ShapeError, check};
use crate::surrogate::Surrogate;

impl Surrogate<'_> {
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
                self.solved_band([Some(first), second].into_iter().flatten())
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
        check("number of bands", self.points.len(), bands.len())?;
        self.judge(x, belief, confidence, values, Some(bands))
    }

    /// The verdict that [`Surrogate::assess`] gives beside the values, from the `values` of [`Surrogate::evaluate`] or
    /// [`Surrogate::evaluate_batch`] at condition `x`; with the bands if they are asked for.
    ///
    /// # Errors
    /// A slice has a wrong length.
    pub fn chance_at(&self, x: &[f64], confidence: f64, values: &[f64], bands: Option<&mut [Band]>) -> Result<Chance, ShapeError> {
        check("number of variables", self.variables.len(), x.len())?;
        check("number of points", self.points.len(), values.len())?;
        if let Some(bands) = &bands {
            check("number of bands", self.points.len(), bands.len())?;
        }
        let Some(uncertainty) = &self.uncertainty else { return Ok(self.judge_fit(x, confidence, values, bands)) };
        let mut here = self.here(uncertainty, x);
        here.remember();
        Ok(self.judge_here(x, &here, &Known::File(uncertainty), confidence, values, bands))
    }

    /// Values and the verdict, with the bands if they are asked for.
    pub(crate) fn judge(
        &self,
        x: &[f64],
        belief: Option<&Belief<'_>>,
        confidence: f64,
        values: &mut [f64],
        bands: Option<&mut [Band]>,
    ) -> Result<Chance, ShapeError> {
        self.evaluate_fit(x, values)?;
        let Some(uncertainty) = &self.uncertainty else { return Ok(self.judge_fit(x, confidence, values, bands)) };
        let known = belief.map_or(Known::File(uncertainty), Known::Memory);
        let mut here = self.here(uncertainty, x);
        here.remember();
        here.shift(&known, values);
        Ok(self.judge_here(x, &here, &known, confidence, values, bands))
    }

    /// The verdict by the bands of the fit alone.
    fn judge_fit(&self, x: &[f64], confidence: f64, values: &[f64], bands: Option<&mut [Band]>) -> Chance {
        if let Some(bands) = bands {
            self.solved_bands(bands);
        }
        self.judge_together(x, confidence, |limit| self.limit_chance(limit, x, None, values), |_, _| 0.0)
    }

    fn judge_here(
        &self,
        x: &[f64],
        here: &Here<'_>,
        known: &Known<'_, '_, '_>,
        confidence: f64,
        values: &[f64],
        bands: Option<&mut [Band]>,
    ) -> Chance {
        if let Some(bands) = bands {
            here.fill(known, bands);
        }
        let direction = |limit: usize| self.limits.get(limit).map(|record| here.limit(self.limit_kind(record), values));
        let chance = |limit: usize| {
            let (kind, maximum) = (self.limit_kind(self.limits.get(limit)?), self.maxima().at(limit));
            let of = |list: &[f64], index: usize| list.get(index).copied().unwrap_or(f64::NAN);
            let value = kind.value(|point| of(values, point), |variable| of(x, variable));
            let band = here.limit(kind, values).band(known);
            Some(LimitChance { value, band, maximum, probability: kept(maximum - value, band.total) })
        };
        let shared = |a: usize, b: usize| match (direction(a), direction(b)) {
            (Some(a), Some(b)) => a.covariance(&b, known),
            _ => 0.0,
        };
        self.judge_together(x, confidence, chance, shared)
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
}

/// Probability that a limit is kept, from its margin and the standard deviation of its value. NaN if one of them is NaN
/// or has overflown: the limit then counts neither as kept nor as broken.
fn kept(margin: f64, deviation: f64) -> f64 {
    if !(margin.is_finite() && deviation.is_finite()) {
        return f64::NAN;
    }
    if deviation > 0.0 { probability_below(margin / deviation) } else { f64::from(u8::from(margin >= 0.0)) }
}
