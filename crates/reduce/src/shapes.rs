//! Projections of the conductors' heats on the modes.

use std::ops::Range;

use nalgebra::DMatrix;

use super::conductors::End;
use super::network_parts::NetworkParts;
use coldplate_network::NONE;

/// Projection of each conductor's heat on the modes: mode at the first end less mode at the second.
pub(super) struct Shapes<'a> {
    pub(super) modes: &'a [Vec<f64>],
    pub(super) ends: &'a [[End; 2]],
    /// Mode at each emitting node less the modes at the nodes it reaches, times the areas: nodes x modes, m².
    pub(super) emitted: DMatrix<f64>,
    /// Places of the emitting nodes among the conductors.
    pub(super) emitting: Range<usize>,
}

impl<'a> Shapes<'a> {
    pub(super) fn of(parts: &NetworkParts, modes: &'a [Vec<f64>], ends: &'a [[End; 2]]) -> Self {
        let rest = &parts.rest;
        let links = rest.radiative.len() - parts.reached.len();
        let first = rest.surfaces.len() + rest.joints.len() + links;
        let emitted = |e: usize, i: usize| {
            let own = modes[i][rest.radiative[links + e].0 as usize];
            parts.reached[e].iter().map(|(other, area)| area * (own - modes[i][*other as usize])).sum::<f64>()
        };
        let emitting = first..first + parts.reached.len();
        Self { modes, ends, emitted: DMatrix::from_fn(emitting.len(), modes.len(), emitted), emitting }
    }

    /// Projection of a conductor's heat on a mode.
    pub(super) fn at(&self, mode: usize, conductor: usize) -> f64 {
        if self.emitting.contains(&conductor) {
            return self.emitted[(conductor - self.emitting.start, mode)];
        }
        let [a, b] = self.ends[conductor].map(|end| if end.node == NONE { 0.0 } else { self.modes[mode][end.node as usize] });
        a - b
    }
}
