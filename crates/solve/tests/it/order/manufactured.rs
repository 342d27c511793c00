//! A chosen temperature field as the solution of a network.

use coldplate_describe::machine::Side;
use coldplate_network::mesh::grid::{Grid, LocalFrame};
use coldplate_network::{BoundaryState, HeatSource, Load};
use coldplate_solve::Solver;
use coldplate_solve::meshed::MeshedMachine;

const SIGMA: f64 = 5.670374419e-8;

/// A field in machine coordinates (m), in K.
pub trait Field {
    /// T
    fn temperature(&self, at: [f64; 3]) -> f64;
    /// grad T
    fn gradient(&self, at: [f64; 3]) -> [f64; 3];
    /// -div(k grad T)
    fn source(&self, at: [f64; 3]) -> f64;
    /// k at a temperature, along the machine's axes.
    fn conductivity(&self, t: f64) -> [f64; 3];
}

/// Centre of a cell's face and its outward normal, in machine coordinates.
pub fn face(grid: &Grid, c: [usize; 3], side: Side) -> ([f64; 3], [f64; 3]) {
    let d = side.axis();
    let mut local = [0, 1, 2].map(|e| middle(grid, e, c[e]));
    local[d] = grid.edges[d][c[d] + usize::from(side.is_high())];
    let sign = if side.is_high() { 1.0 } else { -1.0 };
    let mut normal = [0.0; 3];
    match grid.frame {
        LocalFrame::Cartesian => normal[d] = sign,
        LocalFrame::Cylindrical { axis, .. } => {
            let [u, v] = LocalFrame::normals(axis);
            let (sin, cos) = local[1].sin_cos();
            match d {
                0 => (normal[u], normal[v]) = (sign * cos, sign * sin),
                1 => (normal[u], normal[v]) = (-sign * sin, sign * cos),
                _ => normal[axis.index()] = sign,
            }
        }
        LocalFrame::Spherical { .. } => panic!("fields that vary over a sphere's surface have no place in its shells"),
    }
    (grid.to_machine(local), normal)
}

/// Middle of a cell along an axis; in r the mean over the area.
fn middle(grid: &Grid, d: usize, i: usize) -> f64 {
    let (low, high) = (grid.edges[d][i], grid.edges[d][i + 1]);
    if d == 0 && grid.is_cylindrical() {
        2.0 / 3.0 * (high * high + high * low + low * low) / (high + low)
    } else {
        f64::midpoint(low, high)
    }
}

/// L2 and maximum norm of the error of the cells' temperatures when `model` is given the sources and
/// fluxes of `field`. Its sources are replaced; its surfaces must all radiate to the chamber.
pub fn errors(mut model: MeshedMachine, field: &impl Field) -> [f64; 2] {
    let mut load = Load::at(&model.machine, &model.machine.condition(&crate::bench::CONDITION).unwrap()).unwrap();
    // The cell's heat: its volume times the source at its centre, second order like the scheme.
    let mut heats = Vec::new();
    for grid in &model.mesh.grids {
        for c in grid.cells() {
            let centre = grid.to_machine([0, 1, 2].map(|d| middle(grid, d, c[d])));
            heats.push((grid.cell(c) as u32, field.source(centre) * grid.volume(c)));
        }
    }
    // Two sources, what heats and what cools, so that the balance knows both.
    let (heating, cooling): (Vec<_>, Vec<_>) = heats.into_iter().filter(|(_, q)| *q != 0.0).partition(|(_, q)| *q > 0.0);
    (model.network.sources, load.powers) = (Vec::new(), Vec::new());
    for side in [heating, cooling].into_iter().filter(|side| !side.is_empty()) {
        let total: f64 = side.iter().map(|(_, q)| q).sum();
        model.network.sources.push(HeatSource::constant(side.into_iter().map(|(cell, q)| (cell, q / total)).collect()));
        load.powers.push(total);
    }
    // One flux per surface: what the field conducts there, beside what the surface radiates by itself.
    let mut next = 0;
    for (g, grid) in model.mesh.grids.iter().enumerate() {
        for side in Side::ALL {
            for (c, area) in model.mesh.open_faces(g, side) {
                let (at, n) = face(grid, c, side);
                let (t, gradient) = (field.temperature(at), field.gradient(at));
                let k = field.conductivity(t);
                let conducted: f64 = (0..3).map(|d| -k[d] * gradient[d] * n[d]).sum();
                let surface = &mut model.network.surfaces[next];
                assert_eq!(surface.node as usize, grid.cell(c), "surfaces follow the open faces");
                let radiated = SIGMA * surface.emissive / area * (t.powi(4) - load.chamber.powi(4));
                surface.laws[1] = load.boundaries.len() as u32;
                load.boundaries.push(BoundaryState::Flux(radiated - conducted));
                next += 1;
            }
        }
    }
    assert_eq!(next, model.network.surfaces.len());
    let solver = Solver::new(&model.network, &load).unwrap_or_else(|e| panic!("{e}"));
    let solution = solver.steady(&load).unwrap_or_else(|e| panic!("{e}"));
    let (mut square, mut volume, mut largest) = (0.0, 0.0, 0.0f64);
    for grid in &model.mesh.grids {
        for c in grid.cells() {
            // Compared where the cell's temperature stands.
            let at = grid.to_machine([0, 1, 2].map(|d| grid.centre(d, c[d])));
            let error = solution.temperatures[grid.cell(c)] - field.temperature(at);
            square += error * error * grid.volume(c);
            volume += grid.volume(c);
            largest = largest.max(error.abs());
        }
    }
    [(square / volume).sqrt(), largest]
}
