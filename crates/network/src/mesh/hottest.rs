//! The hottest place of every part.

use rayon::prelude::*;

use super::Mesh;
use super::grid::Grid;

/// The hottest place of a part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hottest {
    /// Index of the part in the machine.
    pub part: usize,
    /// Temperature of the cell or of the corner of the element, K.
    pub temperature: f64,
    /// Place of the cell or corner, m.
    pub at: [f64; 3],
}

impl Mesh {
    /// The hottest place of every part that has cells, in the order of the parts; `temperatures` are those of the mesh's nodes, K.
    pub fn hottest(&self, temperatures: &[f64]) -> Vec<Hottest> {
        let of_grid = |grid: &Grid| {
            let cell = (grid.first..grid.first + grid.len()).max_by(|a, b| temperatures[*a].total_cmp(&temperatures[*b]))?;
            let c = grid.indices(cell);
            let at = grid.to_machine([0, 1, 2].map(|d| grid.centre(d, c[d])));
            Some(Hottest { part: grid.part, temperature: temperatures[cell], at })
        };
        let mut found: Vec<Hottest> = self.grids.par_iter().filter_map(of_grid).collect();
        for tetra in &self.tetra {
            let corners = (0..tetra.points.len()).map(|i| (temperatures[tetra.node(i as u32)], tetra.points[i]));
            let hottest = corners.max_by(|a, b| a.0.total_cmp(&b.0));
            found.extend(hottest.map(|(temperature, at)| Hottest { part: tetra.part, temperature, at }));
        }
        // One entry for each part: the hottest of its blocks.
        found.sort_by(|a, b| a.part.cmp(&b.part).then(b.temperature.total_cmp(&a.temperature)));
        found.dedup_by_key(|own| own.part);
        found
    }
}
