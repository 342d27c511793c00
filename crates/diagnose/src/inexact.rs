//! What of an answer stays certain where all numbers of the machine file are a little off, as drawings and machines are, and where paths for
//! heat are attached anywhere on their parts.
//!
//! In the few readings of a steady table such numbers could do much of what any cause does. They take no part in which causes are named:
//! two small causes would be taken for one and such numbers. But what is not certain beside them is not certain.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector};

use super::attached::Attached;
use super::effects::Effect;
use super::finalists::{Entry, Finalists, Outcome};
use super::probability::Posterior;
use coldplate_base::error::Result;
use coldplate_evidence::discrepancy::{DiscrepancySize, PRICE};
use coldplate_evidence::measurement::Whitener;

/// Standard deviation of the logarithm of every number: of sizes that are off by up to 5 %.
const OFF: f64 = 0.03;

/// What a table comes to where numbers are a little off.
pub(super) struct Inexact {
    /// Everything with the probability that it has then.
    pub posterior: Posterior,
    /// The discrepancy of the machine as it is, with these numbers.
    pub level: DiscrepancySize,
}

impl Finalists<'_> {
    /// Everything with the probability that it has in a steady table where every number of the file may be off, and paths be attached anywhere:
    /// where that explains more than it costs, it counts.
    ///
    /// # Errors
    /// What the place of a path changes cannot be solved.
    pub(super) fn where_numbers_are_off(&self, now: &Outcome) -> Result<Inexact> {
        let off = |level: DiscrepancySize| DiscrepancySize { numbers: OFF, ..level };
        // How far they are off is known here, and has no prior of its own.
        let price = |level: DiscrepancySize| level.price() + PRICE;
        let all: Vec<usize> = (0..now.view.readings.len()).collect();
        let whitener = |level: DiscrepancySize| now.view.errors.whitener(&level, &all);
        let attached = Attached::new(self.predictor.study, &self.problem.data, self.predictor.fields)?;
        let is_path = |j: &usize| matches!(self.of(*j).effect, Effect::Leak(_));
        let rises = if now.fitted.iter().any(|(members, _)| members.iter().any(is_path)) { attached.rises()? } else { Vec::new() };
        // Most fits are at one level, whose covariances are made once, and a path is in many of them.
        let mut known: Vec<(DiscrepancySize, [Whitener; 2])> = Vec::new();
        let mut places: HashMap<usize, Vec<Vec<f64>>> = HashMap::new();
        let mut better: Vec<(&[usize], f64)> = Vec::new();
        for entry in &now.fitted {
            let (members, fitted) = entry;
            let level = fitted.level;
            let at = known.iter().position(|(other, _)| *other == level).unwrap_or_else(|| {
                known.push((level, [level, off(level)].map(whitener)));
                known.len() - 1
            });
            let [exact, inexact] = &known[at].1;
            let mut open: Vec<Vec<f64>> = Vec::new();
            for (j, amplitude) in members.iter().zip(&fitted.amplitudes).filter(|(j, _)| is_path(j)) {
                let columns = places.entry(*j).or_insert_with(|| attached.columns(self.of(*j).effect, &rises));
                open.extend(columns.iter().map(|column| column.iter().map(|v| amplitude * v).collect::<Vec<f64>>()));
            }
            let as_named = self.deviance(entry, exact, &[]) + level.price();
            let elsewhere = if open.is_empty() { as_named } else { self.deviance(entry, exact, &open) + level.price() };
            let with_numbers = self.deviance(entry, inexact, &open) + price(level);
            better.push((members, (0.5 * (as_named - elsewhere.min(with_numbers))).max(0.0)));
        }
        let usual = [DiscrepancySize::NONE, self.unexplained].into_iter().filter(|level| self.base.errors.is_usual(level));
        let ground = |level| (self.base.ground(&off(level)) - off(level).price() + price(level), off(level));
        let least = usual.map(ground).min_by(|a, b| a.0.total_cmp(&b.0));
        let (ground, level) = least.unwrap_or((f64::INFINITY, off(DiscrepancySize::NONE)));
        let nothing = (0.5 * (self.ground.usual - ground)).max(0.0);
        let raised = |members: &[usize]| better.iter().find(|(own, _)| *own == members).map_or(0.0, |(_, by)| *by);
        Ok(Inexact { posterior: now.posterior.raised(nothing, raised), level })
    }

    /// Minus twice the logarithm of the evidence of a fit under some covariance, as its slopes have it, but for the price of a level; with
    /// further columns of unit variance (K).
    fn deviance(&self, (members, fitted): &Entry, whitener: &Whitener, open: &[Vec<f64>]) -> f64 {
        let members: Vec<_> = members.iter().map(|j| self.of(*j)).collect();
        let (without, mut free) = fitted.without_amplitudes(&members);
        free.extend_from_slice(open);
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
