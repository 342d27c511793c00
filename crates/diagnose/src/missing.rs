//! Where heat is missing or in excess: what every part alone would have to give or take.
//! Of the laws such heat can follow, each part has the one that fits best.

use super::effects::{Effect, Heat, Hypothesis, Law};
use super::screen::Screened;

/// Heat into one part that fits the residual best.
#[derive(Debug, Clone, PartialEq)]
pub struct MissingHeat {
    /// The part.
    pub part: String,
    /// How it depends on the condition.
    pub law: Law,
    /// In words.
    pub law_words: String,
    /// Best heat, W, where the law is one (at the highest speed); negative where the model has too much.
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
        if !matches!(hypothesis.effect, Effect::Heat(Heat::Into(_))) {
            return None;
        }
        let (amplitude, explained) = screened.single(j);
        Some(MissingHeat {
            part: hypothesis.place.clone(),
            law: hypothesis.law,
            law_words: hypothesis.law_words(),
            watts: amplitude * hypothesis.scale,
            deviation: hypothesis.scale / screened.square(j).sqrt(),
            explained,
        })
    };
    let mut found: Vec<MissingHeat> = screened.visible.iter().enumerate().filter_map(of).collect();
    found.sort_by(|a, b| b.explained.total_cmp(&a.explained));
    let mut seen = std::collections::HashSet::new();
    found.retain(|m| seen.insert(m.part.clone()));
    found
}
