//! What of an answer holds where all numbers of the machine file are a little off, as drawings and machines are.
//!
//! In the few readings of a steady table such numbers could do much of what any cause does. They take no part in which causes are named:
//! two small causes would be taken for one and such numbers. But what is not certain beside them is not certain, and no interval is
//! narrower than they leave it.

use nalgebra::{DMatrix, DVector};

use super::finalists::{Finalists, Outcome};
use super::probability::Posterior;
use super::refine::Fitted;
use crate::evidence::discrepancy::Level;
use crate::evidence::measurement::Whitener;

/// Standard deviation of the logarithm of every number: of sizes that are off by up to 5 %.
const OFF: f64 = 0.03;

/// An outcome where numbers may be off.
pub struct Inexact {
    /// Everything with its probability.
    pub posterior: Posterior,
    /// Standard deviations of the amplitudes of the most probable explanation, where the data prefer numbers that are off beside it.
    pub deviations: Option<Vec<f64>>,
}

impl Finalists<'_> {
    /// What a steady table leaves of an outcome where every number of the file may be off; `None` where that is no better for anything.
    pub(super) fn where_numbers_are_off(&self, now: &Outcome) -> Option<Inexact> {
        let off = |level: Level| Level { numbers: OFF, ..level };
        let all: Vec<usize> = (0..now.view.readings.len()).collect();
        // Most fits are at one level: its whitening is made once.
        let mut pairs: Vec<(Level, [Whitener; 2])> = Vec::new();
        for (_, fitted) in &now.fitted {
            if !pairs.iter().any(|(level, _)| *level == fitted.level) {
                let errors = &now.view.errors;
                pairs.push((fitted.level, [fitted.level, off(fitted.level)].map(|level| errors.whitener(&level, &all))));
            }
        }
        let better = |members: &[usize], fitted: &Fitted| -> (f64, Vec<f64>) {
            let Some((level, [exact, inexact])) = pairs.iter().find(|(level, _)| *level == fitted.level) else { return (0.0, Vec::new()) };
            let (exact, _) = self.laplace(members, fitted, exact);
            let (inexact, deviations) = self.laplace(members, fitted, inexact);
            ((0.5 * (exact + level.price() - inexact - off(*level).price())).max(0.0), deviations)
        };
        let usual = [Level::NONE, self.unexplained].into_iter().filter(Level::is_usual);
        let ground = usual.map(|level| self.base.ground(&off(level))).fold(f64::INFINITY, f64::min);
        let nothing = (0.5 * (self.ground.usual - ground)).max(0.0);
        let (leading, fitted) = now.leading()?;
        let (of_leading, deviations) = better(leading, fitted);
        let others: Vec<(&Vec<usize>, f64)> = now.fitted.iter().map(|(members, fitted)| (members, better(members, fitted).0)).collect();
        if nothing == 0.0 && others.iter().all(|(_, by)| *by == 0.0) {
            return None;
        }
        let of = |members: &Vec<usize>| others.iter().find(|(own, _)| *own == members).map_or(0.0, |(_, by)| *by);
        Some(Inexact { posterior: now.posterior.raised(nothing, of), deviations: (of_leading > 0.0).then_some(deviations) })
    }

    /// Minus twice the logarithm of the evidence of a fit under some covariance, as its slopes have it, and the standard deviations of its
    /// amplitudes there.
    fn laplace(&self, members: &[usize], fitted: &Fitted, whitener: &Whitener) -> (f64, Vec<f64>) {
        let members: Vec<_> = members.iter().map(|j| self.of(*j)).collect();
        let (without, free) = fitted.without_amplitudes(&members);
        let residual = DVector::from_vec(whitener.apply(&without));
        let mut deviance = residual.norm_squared() + whitener.log_determinant();
        let mut deviations = vec![0.0; members.len()];
        if !free.is_empty() {
            let columns = DMatrix::from_columns(&free.iter().map(|c| DVector::from_vec(whitener.apply(c))).collect::<Vec<_>>());
            let curvature = columns.tr_mul(&columns) + DMatrix::identity(free.len(), free.len());
            let along = columns.tr_mul(&residual);
            deviance += curvature.determinant().ln();
            if let Some(covariance) = curvature.try_inverse() {
                deviance -= along.dot(&(&covariance * &along));
                let own = (0..members.len()).filter(|j| !members[*j].is_fixed());
                for (k, j) in own.enumerate() {
                    deviations[j] = members[j].spread(fitted.amplitudes[j]) * covariance[(k, k)].max(0.0).sqrt();
                }
            }
        }
        (deviance, deviations)
    }
}
