//! Accuracy and initial state of runs of logs beside measured ones.

use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;

/// Error allowed in each time step at any node, over the noise of the readings, in machines of cells; dimensionless. Chosen:
/// the error of their sensors after a run is a fiftieth of it or less.
const BESIDE_NOISE: f64 = 0.5;
/// Least and largest error allowed in each time step in machines of cells, K. Chosen.
const WITHIN: (f64, f64) = (1e-3, 0.03);
/// Error allowed in each time step, K, in machines of lumped nodes, which sensors show as they are, and if no noise is known.
/// Chosen.
const USUAL: f64 = 0.01;

/// Initial state and accuracy of runs of logs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Runs {
    /// The state at the beginning.
    pub start: Start,
    /// Error allowed in each time step at any node, K.
    pub tolerance: f64,
}

impl Runs {
    /// Runs as accurate as readings of a noise (standard deviations, K) can resolve.
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
