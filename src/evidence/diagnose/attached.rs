//! How far the size of a path hangs on where in a part it is attached.
//!
//! A hose takes heat by the temperature of the place that it is screwed to; what is fitted is a path from the part's open faces alike. Where
//! these differ much, beside how far they are from where the path leads, the same heat is that of a larger conductance at a cold place and a
//! smaller one at a warm place. Readings do not tell which, and the machine with the path predicts them alike.

use super::Cause;
use super::effects::{Effect, Ground, Leak};
use crate::discretise::network::Load;
use crate::error::Result;
use crate::evidence::identify::conditions;
use crate::evidence::measurement::Data;
use crate::solve::sensitivity::Study;

/// Writes into causes of a table how far they hang on that, from a machine's temperatures of all nodes (K) at each distinct condition.
///
/// # Errors
/// The machine's formulas have no value at a condition.
pub fn write<'c>(study: &Study, data: &Data, fields: &[Vec<f64>], causes: impl Iterator<Item = &'c mut Cause>) -> Result<()> {
    if data.is_transient() {
        return Ok(());
    }
    let ground = Ground::new(study);
    let (distinct, _) = conditions(data);
    let model = &study.model;
    let surroundings: Vec<f64> = distinct.iter().map(|c| Ok(Load::at(&model.machine, c)?.chamber)).collect::<Result<_>>()?;
    // Mean and variance over the open faces of a group, K and K².
    let of_group = |group: u32, field: &Vec<f64>| -> (f64, f64) {
        let nodes = || ground.joined(group).iter().map(|(n, share)| (field[*n as usize], *share));
        let mean = nodes().map(|(t, share)| t * share).sum::<f64>();
        (mean, nodes().map(|(t, share)| share * (t - mean).powi(2)).sum())
    };
    for cause in causes {
        let Effect::Leak(leak) = cause.hypothesis.effect else { continue };
        let at = |(field, surroundings): (&Vec<f64>, &f64)| -> Option<(f64, f64)> {
            let (ends, other) = match leak {
                Leak::Surroundings(group) => (of_group(group, field), (*surroundings, 0.0)),
                Leak::Link(a, b) => (of_group(a, field), of_group(b, field)),
                _ => return None,
            };
            Some((ends.1 + other.1, (ends.0 - other.0).powi(2)))
        };
        let sums = fields.iter().zip(&surroundings).filter_map(at).fold((0.0, 0.0), |sum, (v, s)| (sum.0 + v, sum.1 + s));
        if sums.1 > 0.0 {
            cause.of_place = (sums.0 / sums.1).sqrt();
        }
    }
    Ok(())
}
