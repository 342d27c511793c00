//! Where heat is missing or in excess: what every part alone would have to give or take.

use super::catalogue::{Act, Hypothesis, Law};
use super::screen::Screened;

/// Constant heat into one part that fits the residual best.
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

/// Every part that could show in the data, what takes away most misfit first.
pub(super) fn missing(screened: &Screened, catalogue: &[Hypothesis]) -> Vec<MissingHeat> {
    let of = |(j, h): (usize, &usize)| {
        let hypothesis = &catalogue[*h];
        if !(matches!(hypothesis.act, Act::Heat(_)) && hypothesis.law == Law::Constant) {
            return None;
        }
        let (amplitude, explained) = screened.single(j);
        Some(MissingHeat {
            part: hypothesis.place.clone(),
            watts: amplitude * hypothesis.scale,
            deviation: hypothesis.scale / screened.gram[(j, j)].sqrt(),
            explained,
        })
    };
    let mut found: Vec<MissingHeat> = screened.visible.iter().enumerate().filter_map(of).collect();
    found.sort_by(|a, b| b.explained.total_cmp(&a.explained));
    found
}
