//! End point of a search, with the fit and the covariance there.

use nalgebra::{DMatrix, DVector};

use super::learnt::Learnt;
use super::search::{Point, Search};
use crate::measurement::Whitener;
use crate::sandwich::pseudo_inverse;
use coldplate_base::numbers::sum_of_squares;

/// Quality of a fit under a covariance.
pub(super) struct Fit {
    /// Information of the data alone, without priors.
    pub(super) information: DMatrix<f64>,
    pub(super) covariance: DMatrix<f64>,
    pub(super) misfit: f64,
    pub(super) freedom: usize,
    pub(super) probability: f64,
}

pub(super) fn fit_of(search: &Search<'_>, at: &Point, whitener: &Whitener) -> Fit {
    let jacobian = search.jacobian(at, whitener);
    let information = jacobian.transpose() * &jacobian;
    let whole = &information + DMatrix::from_diagonal(&DVector::from_vec(search.prior_information()));
    let covariance = pseudo_inverse(&whole);
    let misfit = sum_of_squares(&search.residual(&at.prediction, whitener));
    let smooth = (&information * &covariance).trace();
    let freedom = (search.readings.len() as f64 - smooth).round().max(0.0) as usize;
    Fit { information, covariance, misfit, freedom, probability: chi_square_tail(misfit, freedom) }
}

/// End of a search: the point, the fit and the covariances there.
pub(super) struct Ended {
    pub(super) point: Point,
    /// Fit under [`Ended::whitener`].
    pub(super) fit: Fit,
    /// Curvature of half the misfit that the search descends, with priors.
    pub(super) curvature: DMatrix<f64>,
    /// Covariance of the slope of half the misfit that the search descends.
    pub(super) scatter: DMatrix<f64>,
    /// Whitening by the covariance that the result is judged with.
    pub(super) whitener: Whitener,
    /// Whitening that the search used.
    pub(super) weights: Whitener,
    pub(super) learnt: Option<Learnt>,
}

impl Ended {
    pub(super) fn stated(search: &Search<'_>, point: Point, whitener: Whitener) -> Self {
        let fit = fit_of(search, &point, &whitener);
        let curvature = &fit.information + DMatrix::from_diagonal(&DVector::from_vec(search.prior_information()));
        Self { scatter: curvature.clone(), curvature, weights: whitener.clone(), learnt: None, point, fit, whitener }
    }

    pub(super) fn learnt(search: &Search<'_>, learnt: Learnt) -> Self {
        let (point, whitener) = (learnt.point.clone(), learnt.whitener.clone());
        let mut fit = fit_of(search, &point, &whitener);
        // Least squares do not end at the optimum under this covariance. To first order, the misfit between the two is no
        // misfit.
        let left = DVector::from_vec(search.residual(&point.prediction, &whitener));
        let along = search.jacobian(&point, &whitener).tr_mul(&left);
        fit.misfit = (fit.misfit - along.dot(&(&fit.covariance * &along))).max(0.0);
        fit.probability = chi_square_tail(fit.misfit, fit.freedom);
        let (curvature, scatter, weights) = (learnt.curvature.clone(), learnt.scatter.clone(), learnt.weights.clone());
        Self { point, fit, curvature, scatter, whitener, weights, learnt: Some(learnt) }
    }

    /// The fit and covariances at another point.
    pub(super) fn at(&self, search: &Search<'_>, point: Point) -> Self {
        match &self.learnt {
            Some(learnt) => Self::learnt(search, learnt.at(search, point)),
            None => Self::stated(search, point, self.whitener.clone()),
        }
    }

    /// Covariance of the coordinates if some of them are kept; zero in the rows and columns of these.
    pub(super) fn covariance(&self, kept: &[usize]) -> DMatrix<f64> {
        let n = self.curvature.nrows();
        let rest: Vec<usize> = (0..n).filter(|k| !kept.contains(k)).collect();
        let among = |m: &DMatrix<f64>| DMatrix::from_fn(rest.len(), rest.len(), |i, j| m[(rest[i], rest[j])]);
        let inverse = pseudo_inverse(&among(&self.curvature));
        let own = match self.learnt {
            Some(_) => &inverse * among(&self.scatter) * &inverse,
            None => inverse,
        };
        let mut whole = DMatrix::zeros(n, n);
        rest.iter().enumerate().for_each(|(i, k)| rest.iter().enumerate().for_each(|(j, l)| whole[(*k, *l)] = own[(i, j)]));
        whole
    }
}

/// Probability of a chi-square of `freedom` degrees of freedom above `value`.
pub fn chi_square_tail(value: f64, freedom: usize) -> f64 {
    use statrs::distribution::{ChiSquared, ContinuousCDF};
    if freedom == 0 {
        return 1.0;
    }
    ChiSquared::new(freedom as f64).map_or(f64::NAN, |d| d.sf(value.max(0.0)))
}
