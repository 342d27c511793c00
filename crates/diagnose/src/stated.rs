//! Numbers of the machine file whose uncertainty is stated: each by the file or the user, or of the column that is a source's heat. They
//! are refitted under that uncertainty alone, not as numbers that are off by what numbers usually are. The error of a column is part of
//! the covariance until its heat is fitted, and not beside it.

use std::collections::BTreeSet;

use super::Problem;
use super::effects::{Effect, Heat, Hypothesis, Law, Scales};
use coldplate_base::document::Document;
use coldplate_evidence::measurement::{MeasuredHeat, MeasurementUncertainty, VariableUncertainty, whiten};
use coldplate_solve::study::Study;

/// Amplitude at which the keys that a hypothesis changes are asked for. Chosen: any that is not zero does.
const ASKED: f64 = 0.01;

/// Deviations that are stated in place of the usual ones.
#[derive(Debug, Clone, Default)]
pub(crate) struct Stated {
    /// Names in the keys of numbers that are called uncertain.
    keys: BTreeSet<Vec<String>>,
    /// Sources whose heat is a column of the table with a stated uncertainty.
    heats: Vec<MeasuredHeat>,
}

impl Stated {
    /// Deviations that a machine and its data state.
    pub fn of(problem: &Problem, study: &Study) -> Self {
        let heats = MeasuredHeat::all(&study.model.machine, &problem.data, &problem.uncertainty);
        let keys = problem.uncertain.iter().filter_map(|own| Document::names_in(&own.parameter.name));
        Self { keys: keys.collect(), heats }
    }

    /// Whether a hypothesis is about a heat that is a column.
    pub fn is_measured(&self, h: &Hypothesis) -> bool {
        matches!(h.effect, Effect::Heat(Heat::Source(source)) if self.heats.iter().any(|own| own.source == source))
    }

    /// Slopes along the conditions (K per SI unit) without those along columns that are heats, and the errors of these columns, one
    /// column each of unit variance, K. A share of a heat that changes through a log acts as a factor on the heat does; `signatures` has
    /// the change of the readings with each hypothesis of the catalogue, K per unit.
    pub fn split(
        &self,
        problem: &Problem,
        slopes: &[Vec<f64>],
        (catalogue, signatures): (&[Hypothesis], &[Vec<f64>]),
    ) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let mut rest = slopes.to_vec();
        let mut errors = Vec::new();
        let all = &problem.uncertainty;
        for own in &self.heats {
            let v = own.variable;
            let stated = all.variables[v];
            let factor = catalogue.iter().position(|h| is_factor(h, own)).filter(|_| stated.relative > 0.0);
            // The slope with which a deviation of one is the stated one.
            let (slope, unit): (Vec<f64>, VariableUncertainty) = match factor {
                Some(h) => (signatures[h].clone(), VariableUncertainty { absolute: stated.relative, relative: 0.0 }),
                None => (slopes.iter().map(|row| row[v]).collect(), stated),
            };
            let alone = |k: usize| if k == v { unit } else { VariableUncertainty::default() };
            let variables = (0..all.variables.len()).map(alone).collect();
            let uncertainty = MeasurementUncertainty { bias: vec![0.0; all.bias.len()], variables, ..all.clone() };
            let along: Vec<Vec<f64>> = rest.iter().zip(&slope).map(|(row, own)| with(row, v, *own)).collect();
            errors.extend(whiten::common_errors(&problem.data, &uncertainty, &along));
            rest.iter_mut().for_each(|row| row[v] = 0.0);
        }
        errors.retain(|column| column.iter().any(|c| *c != 0.0));
        (rest, errors)
    }

    /// The factors on heats that are columns, each with the stated uncertainty of its column as its scale.
    pub fn measured(&self, problem: &Problem, catalogue: &[Hypothesis]) -> Vec<Hypothesis> {
        let factor = |own: &MeasuredHeat| {
            let deviation = problem.uncertainty.variables[own.variable].relative;
            let h = catalogue.iter().find(|h| is_factor(h, own))?;
            (deviation > 0.0).then(|| h.clone().inexact_by(deviation))
        };
        self.heats.iter().filter_map(factor).collect()
    }

    /// Whether any heat is a column.
    pub fn has_measured(&self) -> bool {
        !self.heats.is_empty()
    }

    /// The amplitude of a change by a factor e of the number of the file that a hypothesis is about, unless its uncertainty is stated;
    /// `None` of what is no such number.
    pub fn number(&self, h: &Hypothesis, problem: &Problem, study: &Study, scales: &Scales) -> Option<f64> {
        let unit = h.of_a_number(&study.model.network)?;
        let is_stated = || {
            let lines = h.sets(study, scales, &problem.user, ASKED * unit).ok().flatten().unwrap_or_default();
            lines.iter().any(|(key, _)| Document::names_in(key).is_some_and(|names| self.keys.contains(&names)))
        };
        (!self.is_measured(h) && (self.keys.is_empty() || !is_stated())).then_some(unit)
    }
}

/// Whether a hypothesis is the factor on a measured heat.
fn is_factor(h: &Hypothesis, own: &MeasuredHeat) -> bool {
    h.effect == Effect::Heat(Heat::Source(own.source)) && h.law == Law::Constant
}

/// A row with another entry.
fn with(row: &[f64], at: usize, entry: f64) -> Vec<f64> {
    row.iter().enumerate().map(|(k, own)| if k == at { entry } else { *own }).collect()
}
