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

/// What is stated beside the usual.
#[derive(Debug, Clone, Default)]
pub(crate) struct Stated {
    /// Names in the keys of numbers that are called uncertain.
    keys: BTreeSet<Vec<String>>,
    /// Sources whose heat is a column of the table with a stated uncertainty.
    heats: Vec<MeasuredHeat>,
}

impl Stated {
    /// What is stated of a machine and its data.
    pub fn of(problem: &Problem, study: &Study) -> Self {
        let heats = MeasuredHeat::all(&study.model.machine, &problem.data, &problem.uncertainty);
        let keys = problem.uncertain.iter().filter_map(|own| Document::names_in(&own.parameter.name));
        Self { keys: keys.collect(), heats }
    }

    /// Whether a hypothesis is about a heat that is a column.
    pub fn is_measured(&self, h: &Hypothesis) -> bool {
        matches!(h.effect, Effect::Heat(Heat::Source(source)) if self.heats.iter().any(|own| own.source == source))
    }

    /// The factors on measured heats among a catalogue, each with the standard deviation that is stated of its column.
    pub fn measured<'a>(&'a self, catalogue: &'a [Hypothesis]) -> impl Iterator<Item = Hypothesis> + 'a {
        let factor = |own: &MeasuredHeat| {
            let is_own = |h: &&Hypothesis| h.effect == Effect::Heat(Heat::Source(own.source)) && h.law == Law::Constant;
            catalogue.iter().find(is_own).map(|h| h.clone().inexact_by(own.deviation))
        };
        self.heats.iter().filter_map(factor)
    }

    /// Slopes along the conditions (K per SI unit) without those along columns that are heats, and the errors of these columns, one
    /// column each of unit variance, K.
    pub fn split(&self, problem: &Problem, slopes: &[Vec<f64>]) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let is_heat = |v: usize| self.heats.iter().any(|own| own.variable == v);
        let without = |row: &Vec<f64>| row.iter().enumerate().map(|(v, slope)| if is_heat(v) { 0.0 } else { *slope }).collect();
        let of = |(v, own): (usize, &VariableUncertainty)| if is_heat(v) { *own } else { VariableUncertainty::default() };
        let all = &problem.uncertainty;
        let variables = all.variables.iter().enumerate().map(of).collect();
        let alone = MeasurementUncertainty { bias: vec![0.0; all.bias.len()], variables, ..all.clone() };
        let mut errors = if self.has_measured() { whiten::common_errors(&problem.data, &alone, slopes) } else { Vec::new() };
        errors.retain(|column| column.iter().any(|c| *c != 0.0));
        (slopes.iter().map(without).collect(), errors)
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
