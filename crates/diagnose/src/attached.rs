//! Where in a part a path is attached, and what hangs on it.
//!
//! A hose takes heat by the temperature of the place that it is screwed to; what is fitted is a path from the part's open faces alike. Where
//! these differ much, beside how far they are from where the path leads, the same heat is that of a larger conductance at a cold place and a
//! smaller one at a warm place. Readings far away do not tell which, and the machine with the path predicts them alike. Readings of the part
//! itself differ: what looks like an error of its sensor may be the place of the hose.

use super::Cause;
use super::effects::{Effect, Ground, Leak};
use coldplate_base::error::Result;
use coldplate_evidence::identify::conditions;
use coldplate_evidence::measurement::Data;
use coldplate_network::Load;
use coldplate_solve::study::Study;

/// Paths that may be attached anywhere on the open faces of a part, in a steady table.
pub(crate) struct Attached<'a> {
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
        let (distinct, _) = conditions(data);
        let surroundings = distinct.iter().map(|c| Ok(Load::at(&study.model.machine, c)?.chamber)).collect::<Result<_>>()?;
        Ok(Self { fields, surroundings, ground: Ground::new(study) })
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
}
