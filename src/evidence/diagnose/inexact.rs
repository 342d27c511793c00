//! What of an answer stays certain where all numbers of the machine file are a little off, as drawings and machines are.
//!
//! In the few readings of a steady table such numbers could do much of what any cause does. They take no part in which causes are named:
//! two small causes would be taken for one and such numbers. But what is not certain beside them is not certain.

use nalgebra::{DMatrix, DVector};

use super::finalists::{Entry, Finalists, Outcome};
use super::probability::Posterior;
use crate::evidence::discrepancy::Level;
use crate::evidence::measurement::Whitener;

/// Standard deviation of the logarithm of every number: of sizes that are off by up to 5 %.
const OFF: f64 = 0.03;

impl Finalists<'_> {
    /// Everything with the probability that it has in a steady table where every number of the file may be off: where that explains more
    /// than it costs, it counts.
    pub(super) fn where_numbers_are_off(&self, now: &Outcome) -> Posterior {
        let off = |level: Level| Level { numbers: OFF, ..level };
        let all: Vec<usize> = (0..now.view.readings.len()).collect();
        let whitener = |level: Level| now.view.errors.whitener(&level, &all);
        // Most fits are at one level, whose covariances are made once.
        let mut known: Vec<(Level, [Whitener; 2])> = Vec::new();
        let mut better: Vec<(&[usize], f64)> = Vec::new();
        for entry in &now.fitted {
            let level = entry.1.level;
            let at = known.iter().position(|(other, _)| *other == level).unwrap_or_else(|| {
                known.push((level, [level, off(level)].map(whitener)));
                known.len() - 1
            });
            let [exact, inexact] = &known[at].1;
            let gained = self.deviance(entry, exact) + level.price() - self.deviance(entry, inexact) - off(level).price();
            better.push((&entry.0, (0.5 * gained).max(0.0)));
        }
        let usual = [Level::NONE, self.unexplained].into_iter().filter(Level::is_usual);
        let ground = usual.map(|level| self.base.ground(&off(level))).fold(f64::INFINITY, f64::min);
        let nothing = (0.5 * (self.ground.usual - ground)).max(0.0);
        now.posterior.raised(nothing, |members| better.iter().find(|(own, _)| *own == members).map_or(0.0, |(_, by)| *by))
    }

    /// Minus twice the logarithm of the evidence of a fit under some covariance, as its slopes have it, but for the price of a level.
    fn deviance(&self, (members, fitted): &Entry, whitener: &Whitener) -> f64 {
        let members: Vec<_> = members.iter().map(|j| self.of(*j)).collect();
        let (without, free) = fitted.without_amplitudes(&members);
        let residual = DVector::from_vec(whitener.apply(&without));
        let deviance = residual.norm_squared() + whitener.log_determinant();
        if free.is_empty() {
            return deviance;
        }
        let columns = DMatrix::from_columns(&free.iter().map(|c| DVector::from_vec(whitener.apply(c))).collect::<Vec<_>>());
        let curvature = columns.tr_mul(&columns) + DMatrix::identity(free.len(), free.len());
        let along = columns.tr_mul(&residual);
        let explained = curvature.clone().try_inverse().map_or(0.0, |covariance| along.dot(&(covariance * &along)));
        deviance + curvature.determinant().ln() - explained
    }
}
