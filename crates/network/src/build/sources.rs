//! Distribution of the power of sources over nodes.

use super::Builder;
use crate::HeatSource;
use crate::mesh::grid::Grid;
use coldplate_base::error::{Error, Result};
use coldplate_base::formula::FormulaValues;
use coldplate_describe::machine::{Place, Side, Source};

/// Places of two points in an interval, from its middle and over its length: ±1/(2 sqrt 3), Gauss's, which integrate cubic polynomials
/// exactly.
const GAUSS: [f64; 2] = [-0.288_675_134_594_812_9, 0.288_675_134_594_812_9];

impl Builder<'_> {
    pub(super) fn sources(&mut self) -> Result<()> {
        for source in &self.machine.sources {
            let mut shares: Vec<(u32, f64)> = Vec::new();
            for heated in &source.places {
                match heated.place {
                    Place::Node(n) => shares.push((self.lumped(n), 1.0)),
                    Place::Part(p) => {
                        for (_, grid) in self.mesh.grids_of(p).filter(|(_, g)| heated.block.is_none_or(|b| b == g.block)) {
                            for c in grid.cells() {
                                shares.push((grid.cell(c) as u32, grid.volume(c) * self.mean(source, p, grid, c, None)?));
                            }
                        }
                        if let Some(tetra) = self.mesh.tetra_of(p) {
                            for (i, v) in tetra.volumes.iter().enumerate() {
                                shares.push(((tetra.first + i) as u32, v * self.relative(source, p, tetra.points[i])?));
                            }
                        }
                    }
                    Place::Face(face) => {
                        for (g, c, area) in self.mesh.face_cells(face) {
                            let grid = &self.mesh.grids[g];
                            shares.push((grid.cell(c) as u32, area * self.mean(source, face.part, grid, c, Some(face.side))?));
                        }
                        if let Some(tetra) = self.mesh.tetra_of(face.part) {
                            for foot in self.vertex_areas(tetra, face, false) {
                                let point = tetra.points[foot.0 as usize - tetra.first];
                                shares.push((foot.0, foot.1 * self.relative(source, face.part, point)?));
                            }
                        }
                    }
                }
            }
            // Several lumped nodes share alike; parts share by volume, faces by area.
            let total: f64 = shares.iter().map(|s| s.1).sum();
            if total <= 0.0 {
                return Err(Error::input(format!("the source '{}' heats nothing", source.name)).at_key(format!("source.{}", source.name)));
            }
            for share in &mut shares {
                share.1 /= total;
            }
            self.network.sources.push(HeatSource { shares, law: source.law.clone() });
        }
        Ok(())
    }

    /// Mean of a source's distribution over a cell, or over one of its faces.
    fn mean(&self, source: &Source, part: usize, grid: &Grid, c: [usize; 3], side: Option<Side>) -> Result<f64> {
        if source.distribution.is_none() {
            return Ok(1.0);
        }
        let (mut sum, mut whole) = (0.0, 0.0);
        for k in 0..8usize {
            let mut local = [0, 1, 2].map(|d| {
                let (low, high) = (grid.edges[d][c[d]], grid.edges[d][c[d] + 1]);
                f64::midpoint(low, high) + GAUSS[k >> d & 1] * (high - low)
            });
            if let Some(side) = side {
                local[side.axis()] = grid.edges[side.axis()][c[side.axis()] + usize::from(side.is_high())];
            }
            // Volume grows with the radius: once in cylinders; in spheres twice, and with the sine of the polar angle.
            let spread = match (grid.is_cylindrical(), grid.is_spherical()) {
                (true, _) => local[0],
                (_, true) => local[0] * local[0] * local[1].sin(),
                _ => 1.0,
            };
            sum += spread * self.relative(source, part, grid.to_machine(local))?;
            whole += spread;
        }
        Ok(if whole > 0.0 { sum / whole } else { 0.0 })
    }

    /// A source's distribution at a point in the machine.
    fn relative(&self, source: &Source, part: usize, point: [f64; 3]) -> Result<f64> {
        let Some(distribution) = &source.distribution else { return Ok(1.0) };
        let from = self.machine.parts[part].origin();
        let value = distribution.evaluate(&FormulaValues((0..3).map(|d| (point[d] - from[d]) * 1e3).collect()))?;
        if value < 0.0 {
            let shown = (0..3).map(|d| format!("{:.3} mm", (point[d] - from[d]) * 1e3)).collect::<Vec<_>>().join(", ");
            return Err(distribution.place(
                Error::input(format!("the share of the power is negative at [{shown}]"))
                    .read(distribution.text())
                    .help("a source heats: write max(0, ...), or a second source of negative power"),
            ));
        }
        Ok(value)
    }
}
