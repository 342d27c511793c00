//! What all films, all heats or all emissivities share beside a cause.
//!
//! A common factor is part of the covariance, so it takes what it may of any residual and no cause is named for it. A machine with the
//! cause alone in force would predict without the factor what was fitted beside it; so the factor, by its expectation under the
//! covariance, goes into the machine with the cause.

use nalgebra::{DMatrix, DVector};

use super::Cause;
use super::effects::{Common, CommonFactor, Effect, Hypothesis};
use super::finalists::Finalists;
use super::refine::Fitted;
use super::stated::Stated;
use super::view::Comparison;
use coldplate_evidence::measurement::Whitener;

/// A factor that the residual draws by less than this share of its standard deviation stays where it is.
const DRAWN: f64 = 0.3;

/// Factors that a residual draws.
#[derive(Debug, Clone, Default)]
pub struct Shared {
    /// Each, with how far.
    pub factors: Vec<Cause>,
    /// Correlations of all that was fitted, and behind it of the factors; none where there is no factor.
    pub correlations: Vec<Vec<f64>>,
}

/// The common factors that may act beside some causes, as causes whose scale is their standard deviation, and what one standard deviation
/// of each changes in every reading, K, about the machine of `view`.
pub fn beside<'v>(finals: &Finalists<'_>, causes: &[&Hypothesis], view: &'v Comparison) -> Vec<(Hypothesis, &'v Vec<f64>)> {
    let stated = Stated::of(finals.problem, &finals.problem.study);
    let of = |(factor, column): (CommonFactor, &'v Vec<f64>)| {
        let common = Effect::from(match factor {
            CommonFactor::Films => Common::Films,
            CommonFactor::Heats => Common::Heats,
            CommonFactor::Emissivities => Common::Emissivities,
        });
        let members = || finals.catalogue.iter().filter(|h| h.common_factor() == Some(factor));
        // One member alone has no name in common.
        let all = finals.catalogue.iter().find(|h| h.effect == common).or_else(|| members().next().filter(|_| members().count() == 1))?;
        let hypothesis = all.clone().inexact_by(factor.deviation(&finals.problem.discrepancy));
        // Exchanged readings show a factor at each other's places.
        let is_beside = causes.iter().all(|c| !c.is_fixed() && !c.is_same(&hypothesis));
        // The lines of all heats would move those too that are columns of the table.
        let is_meant = factor != CommonFactor::Heats || !stated.has_measured();
        let acts = is_beside && is_meant && hypothesis.scale > 0.0 && column.iter().any(|c| *c != 0.0);
        acts.then_some((hypothesis, column))
    };
    CommonFactor::ALL.into_iter().zip(&view.factors).filter_map(of).collect()
}

/// What the residual left by a fit of causes draws of them, under the covariance that the fit was made with.
pub fn shared(finals: &Finalists<'_>, causes: &[&Hypothesis], best: &Fitted, whitener: &Whitener, view: &Comparison) -> Shared {
    let left = DVector::from_vec(whitener.apply(&best.left));
    let whitened = |column: &Vec<f64>| DVector::from_vec(whitener.apply(column));
    let drawn: Vec<(Hypothesis, DVector<f64>, f64)> = beside(finals, causes, view)
        .into_iter()
        .map(|(h, column)| (h, whitened(column)))
        .map(|(h, column)| (column.dot(&left), h, column))
        .filter(|(drawn, ..)| drawn.abs() > DRAWN)
        .map(|(drawn, h, column)| (h, column, drawn))
        .collect();
    if drawn.is_empty() {
        return Shared::default();
    }
    // Given the amplitudes a, the factors have the mean C'(r - G a) and the covariance 1 - C'C; G and C are the whitened slopes.
    let (m, k) = (causes.len(), drawn.len());
    let amplitudes =
        DMatrix::from_fn(m, m, |i, j| best.deviations[i] * best.deviations[j] * if i == j { 1.0 } else { best.correlations[i][j] });
    let slopes: Vec<DVector<f64>> = best.slopes.iter().map(whitened).collect();
    let along = DMatrix::from_fn(k, m, |i, j| drawn[i].1.dot(&slopes[j]));
    let across = -(&along * &amplitudes);
    let own =
        DMatrix::from_fn(k, k, |i, j| f64::from(u8::from(i == j)) - drawn[i].1.dot(&drawn[j].1)) + &along * &amplitudes * along.transpose();
    let covariance = |i: usize, j: usize| match (i.checked_sub(m), j.checked_sub(m)) {
        (None, None) => amplitudes[(i, j)],
        (Some(i), None) => across[(i, j)],
        (None, Some(j)) => across[(j, i)],
        (Some(i), Some(j)) => own[(i, j)],
    };
    let correlation = |i: usize, j: usize| {
        let both = (covariance(i, i) * covariance(j, j)).max(0.0).sqrt();
        if both > 0.0 { covariance(i, j) / both } else { 0.0 }
    };
    let factor = |(i, (h, _, drawn)): (usize, &(Hypothesis, DVector<f64>, f64))| {
        Cause::new(h.clone(), drawn * h.scale, own[(i, i)].max(0.0).sqrt() * h.scale)
    };
    Shared {
        factors: drawn.iter().enumerate().map(factor).collect(),
        correlations: (0..m + k).map(|i| (0..m + k).map(|j| correlation(i, j)).collect()).collect(),
    }
}
