//! How logs are run beside measured ones.

use crate::explore::simulate::Start;
use crate::solve::sensitivity::Study;

/// Error allowed in each time step at any node, over the noise of the readings, in machines of cells: that of their sensors after a run
/// is a fiftieth of it or less.
const BESIDE_NOISE: f64 = 0.5;
/// Least and most of it, K.
const WITHIN: (f64, f64) = (1e-3, 0.03);
/// The same of lumped nodes, which sensors show as they are, and where no noise is known, K.
const USUAL: f64 = 0.01;

/// How logs are run: the state they begin with, and how accurately.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Runs {
    /// The state at the beginning.
    pub start: Start,
    /// Error allowed in each time step at any node, K.
    pub tolerance: f64,
}

impl Runs {
    /// As accurately as readings of a noise (standard deviations, K) can tell.
    pub fn beside(study: &Study, noise: &[f64], start: Start) -> Self {
        let least = noise.iter().copied().filter(|noise| *noise > 0.0).fold(f64::INFINITY, f64::min);
        let has_cells = study.model.mesh.cells > 0 && least.is_finite();
        Self { start, tolerance: if has_cells { (BESIDE_NOISE * least).clamp(WITHIN.0, WITHIN.1) } else { USUAL } }
    }
}

impl From<Start> for Runs {
    fn from(start: Start) -> Self {
        Self { start, tolerance: USUAL }
    }
}
