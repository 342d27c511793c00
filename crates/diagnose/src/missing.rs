//! Where heat is missing or in excess: the heat that every part alone would have to give or take, alike at all conditions.

use super::amplitude::{Beside, PlaceSet, Rows};
use super::effects::{Effect, Heat};

/// Heat into one part that fits the residual best.
#[derive(Debug, Clone, PartialEq)]
pub struct MissingHeat {
    /// The part.
    pub part: String,
    /// Best heat, W; negative where the model has too much.
    pub watts: f64,
    /// Its standard deviation, W.
    pub deviation: f64,
    /// Misfit it takes away.
    pub explained: f64,
}

/// Every part that could show in the data beside what the machine as it is leaves open; the heat that takes away most misfit first.
pub(super) fn missing(beside: &Beside<'_>, nothing: &PlaceSet) -> Vec<MissingHeat> {
    let Some(rows) = Rows::under(&nothing.errors, nothing.looseness) else { return Vec::new() };
    let metric = rows.metric(nothing.looseness);
    let residual = metric.whitened(&beside.base.found.residual);
    let of = |(h, column): (&super::Hypothesis, &Vec<f64>)| {
        let whitened = metric.whitened(column);
        let square = whitened.norm_squared();
        if !matches!(h.effect, Effect::Heat(Heat::Into(_))) || square <= 0.0 {
            return None;
        }
        let watts = whitened.dot(&residual) / square;
        Some(MissingHeat { part: h.place.clone(), watts, deviation: square.sqrt().recip(), explained: watts * watts * square })
    };
    let mut found: Vec<MissingHeat> = beside.catalogue.iter().zip(&beside.base.found.columns).filter_map(of).collect();
    found.sort_by(|a, b| b.explained.total_cmp(&a.explained));
    found
}
