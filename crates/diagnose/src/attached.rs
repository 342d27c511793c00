//! Where in a part a path is attached, and what hangs on it.
//!
//! A hose takes heat by the temperature of the place that it is screwed to; what is fitted is a path from the part's open faces alike. Where
//! these differ much, beside how far they are from where the path leads, the same heat is that of a larger conductance at a cold place and a
//! smaller one at a warm place. Readings far away do not tell which, and the machine with the path predicts them alike. Readings of the part
//! itself differ: what looks like an error of its sensor may be the place of the hose.

use rayon::prelude::*;

use super::Cause;
use super::effects::{Effect, Ground, Leak};
use super::low_rank::low_rank;
use coldplate_base::error::Result;
use coldplate_evidence::identify::conditions;
use coldplate_evidence::measurement::{Data, whiten};
use coldplate_network::Load;
use coldplate_solve::sensitivity::{DerivativeTarget, Derivatives};
use coldplate_solve::study::Study;

/// Variance that is left out of columns, as a share of the largest of a reading.
const NOTHING: f64 = 1e-3;

/// Paths that may be attached anywhere on the open faces of a part, in a steady table.
pub(crate) struct Attached<'a> {
    study: &'a Study,
    data: &'a Data,
    /// Which of the distinct conditions each row has.
    index: Vec<usize>,
    /// Temperatures of all nodes at each distinct condition, K.
    fields: &'a [Vec<f64>],
    /// Temperature of the surroundings at each, K.
    surroundings: Vec<f64>,
    ground: Ground<'a>,
}

impl<'a> Attached<'a> {
    /// On a machine with temperatures of all nodes (K) at each distinct condition of a table.
    ///
    /// # Errors
    /// The machine's formulas have no value at a condition.
    pub fn new(study: &'a Study, data: &'a Data, fields: &'a [Vec<f64>]) -> Result<Self> {
        let (distinct, index) = conditions(data);
        let surroundings = distinct.iter().map(|c| Ok(Load::at(&study.model.machine, c)?.chamber)).collect::<Result<_>>()?;
        Ok(Self { study, data, index, fields, surroundings, ground: Ground::new(study) })
    }

    /// Writes into causes how far their size hangs on the place.
    pub fn write<'c>(&self, causes: impl Iterator<Item = &'c mut Cause>) {
        for cause in causes {
            let Effect::Leak(leak) = cause.hypothesis.effect else { continue };
            let at = |c: usize| -> Option<(f64, f64)> {
                let (ends, other) = match leak {
                    Leak::Surroundings(group) => (self.of_group(group, c), (self.surroundings[c], 0.0)),
                    Leak::Link(a, b) => (self.of_group(a, c), self.of_group(b, c)),
                    _ => return None,
                };
                Some((ends.1 + other.1, (ends.0 - other.0).powi(2)))
            };
            let sums = (0..self.fields.len()).filter_map(at).fold((0.0, 0.0), |sum, (v, s)| (sum.0 + v, sum.1 + s));
            if sums.1 > 0.0 {
                cause.of_place = (sums.0 / sums.1).sqrt();
            }
        }
    }

    /// Mean and variance over the open faces of a group at a condition, K and K².
    fn of_group(&self, group: u32, condition: usize) -> (f64, f64) {
        let field = &self.fields[condition];
        let nodes = || self.ground.joined(group).iter().map(|(n, share)| (field[*n as usize], *share));
        let mean = nodes().map(|(t, share)| t * share).sum::<f64>();
        (mean, nodes().map(|(t, share)| share * (t - mean).powi(2)).sum())
    }

    /// Rise of every sensor per watt put into each node, K/W, at the first condition: with the others they differ by what flows do to films,
    /// far less than from node to node of a part.
    ///
    /// # Errors
    /// A field cannot be solved.
    pub fn rises(&self) -> Result<Vec<Vec<f64>>> {
        let (distinct, _) = conditions(self.data);
        let Some((first, field)) = distinct.first().zip(self.fields.first()) else { return Ok(Vec::new()) };
        let at = Derivatives::at(self.study, first, field)?;
        let rise = |s: &usize| -> Result<Vec<f64>> {
            let shown = self.study.model.machine.sensors[*s].shows.of_place();
            Ok(at.adjoint(DerivativeTarget::Sensor(*s))?.field.into_iter().map(|rise| shown * rise).collect())
        };
        self.data.sensors.par_iter().map(rise).collect()
    }

    /// What the place changes in every reading: columns of unit variance for a path of 1 W/K, K per W/K; none of what has no place.
    pub fn columns(&self, effect: Effect, rises: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let at_surroundings = |c: usize| self.surroundings[c];
        match effect {
            Effect::Leak(Leak::Surroundings(group)) => self.of_end(group, at_surroundings, rises),
            Effect::Leak(Leak::Link(a, b)) => {
                let mut columns = self.of_end(a, |c| self.of_group(b, c).0, rises);
                columns.extend(self.of_end(b, |c| self.of_group(a, c).0, rises));
                columns
            }
            _ => Vec::new(),
        }
    }

    /// The same of one end, whose other end is at a temperature (K) that the condition says.
    fn of_end(&self, group: u32, other: impl Fn(usize) -> f64, rises: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let others: Vec<f64> = (0..self.fields.len()).map(other).collect();
        let places = whiten::places(self.data);
        let nodes = self.ground.joined(group);
        let of_node = |(node, _): &(u32, f64)| -> Vec<f64> {
            let n = *node as usize;
            let at = |(row, sensor): &(usize, usize)| {
                let c = self.index[*row];
                rises[*sensor][n] * (self.fields[c][n] - others[c])
            };
            places.iter().map(at).collect()
        };
        let mut all: Vec<Vec<f64>> = nodes.iter().map(of_node).collect();
        for i in 0..places.len() {
            let mean: f64 = all.iter().zip(nodes).map(|(column, (_, share))| share * column[i]).sum();
            all.iter_mut().zip(nodes).for_each(|(column, (_, share))| column[i] = share.sqrt() * (column[i] - mean));
        }
        let product = |i: usize, j: usize| all.iter().map(|column| column[i] * column[j]).sum::<f64>();
        let variances: Vec<f64> = (0..places.len()).map(|i| product(i, i)).collect();
        let enough = NOTHING * variances.iter().copied().fold(0.0, f64::max);
        low_rank(variances, |j| (0..places.len()).map(|i| product(i, j)).collect(), enough)
    }
}
