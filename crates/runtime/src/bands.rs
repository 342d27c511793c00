//! Values of the points with the knowledge of the parameters, and their bands.

use crate::belief::{Belief, Known};
use crate::direction::Band;
use crate::shape::ShapeError;
use crate::surrogate::Surrogate;
use crate::uncertain::Uncertainty;

impl Surrogate<'_> {
    /// The values of all points at condition `x`, given in the variables' units, into `values`, in the points' units.
    /// Outside the fitted range the models extrapolate, and may give infinities or NaN; see [`Surrogate::in_domain`].
    ///
    /// # Errors
    /// `x` does not have one value per variable, or `values` does not have one place per point.
    pub fn evaluate(&self, x: &[f64], values: &mut [f64]) -> Result<(), ShapeError> {
        self.evaluate_fit(x, values)?;
        if let Some(uncertainty) = self.learnt() {
            self.here(uncertainty, x).shift(&Known::File(uncertainty), values);
        }
        Ok(())
    }

    /// The uncertainty, if the file knows more of its parameters than was stated.
    pub(crate) fn learnt(&self) -> Option<&Uncertainty<'_>> {
        self.uncertainty.as_ref().filter(|own| !own.mean.is_empty())
    }

    /// The value of one point at condition `x`, equal to the last bit to [`Surrogate::evaluate`].
    ///
    /// # Errors
    /// `x` does not have one value per variable, or the point does not exist.
    pub fn evaluate_point(&self, x: &[f64], point: usize) -> Result<f64, ShapeError> {
        let value = self.evaluate_fit_of(x, point)?;
        let Some(uncertainty) = self.learnt() else { return Ok(value) };
        Ok(value + self.here(uncertainty, x).point(point).mean(&Known::File(uncertainty)))
    }

    /// The correction that a controller adds at condition `x` to reach the intended position, one place per point: the
    /// displacement of the point with the opposite sign, in its unit, and 0 for a point that is no displacement.
    ///
    /// # Errors
    /// Errors of [`Surrogate::evaluate`].
    pub fn offset(&self, x: &[f64], offsets: &mut [f64]) -> Result<(), ShapeError> {
        self.evaluate(x, offsets)?;
        for (point, value) in offsets.iter_mut().enumerate() {
            *value = if self.is_displacement(point) { -*value } else { 0.0 };
        }
        Ok(())
    }

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
            self.solved_bands(bands);
            return Ok(());
        };
        let known = belief.map_or(Known::File(&uncertainty), Known::Memory);
        let here = self.here(&uncertainty, x);
        here.shift(&known, values);
        here.fill(&known, bands);
        Ok(())
    }

    /// The bands of the fit alone.
    pub(crate) fn solved_bands(&self, bands: &mut [Band]) {
        bands.iter_mut().enumerate().for_each(|(point, band)| *band = self.solved_band(core::iter::once(point)));
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
}
