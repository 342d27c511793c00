//! Open faces: their radiation, and the boundaries of the machine on them.

use super::{Builder, CellFace};
use crate::mesh::grid::{Grid, tangents};
use crate::{BoundaryArea, FREE, FaceNode, Laws, NONE, OpenFace, Surface};
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::{Boundary, BoundaryLaw, Face, Region, Side};
use coldplate_physics::radiation::effective_emissivity;

/// Pieces along each axis of a cell's face, a count: a cell that the edge of a part of a face crosses is looked up piece by piece.
/// Chosen: error of the area against time.
const PIECES: usize = 24;
/// Share of a face below which the area that a boundary acts on is rounding, dimensionless. Chosen.
const LEAST_SHARE: f64 = 1e-9;

/// An open cell face, or a piece of it, with the boundaries that act on it.
struct Piece<'a> {
    grid: &'a Grid,
    number: usize,
    side: Side,
    cell: [usize; 3],
    area: f64,
    laws: Laws,
    /// Share of its view that the chamber has.
    view: f64,
    enclosed: Option<(u32, f64)>,
}

impl Builder<'_> {
    pub(super) fn surfaces(&mut self) -> Result<()> {
        self.network.acting = vec![BoundaryArea::default(); self.machine.boundaries.len()];
        for (p, part) in self.machine.parts.iter().enumerate() {
            let excluded = |grid: &Grid, side: Side| {
                part.surface.excluded.iter().any(|f| f.part == p && f.side == side && f.block.is_none_or(|b| b == grid.block))
            };
            let mut faces: Vec<Piece<'_>> = Vec::new();
            for (g, grid) in self.mesh.grids_of(p) {
                for side in Side::ALL {
                    self.count_whole(grid, side);
                    let view = self
                        .view_left
                        .iter()
                        .filter(|(f, _)| f.part == p && f.side == side && f.block.is_none_or(|b| b == grid.block))
                        .map(|(_, left)| left)
                        .product::<f64>();
                    // The wall of a bore sees water and nothing else.
                    if side == Side::Low0 && self.machine.channels.iter().any(|c| c.is_bore && c.part == p) {
                        continue;
                    }
                    let view = if excluded(grid, side) { 0.0 } else { view };
                    for (c, area) in self.mesh.open_faces(g, side) {
                        let enclosed = self.enclosed.get(&(g, side as usize, grid.cell(c))).copied();
                        let view = if enclosed.is_some() { 0.0 } else { view };
                        for (area, laws) in self.pieces(grid, side, c, area) {
                            self.count_acting(laws, area);
                            faces.push(Piece { grid, number: g, side, cell: c, area, laws, view, enclosed });
                        }
                    }
                }
            }
            let vertices = self.open_vertices(p);
            let seen: f64 = faces.iter().map(|f| f.area * f.view).chain(vertices.iter().map(|v| v.area * v.view)).sum();
            let factor = match part.surface.area {
                Some(stated) if seen > 0.0 => stated / seen,
                Some(_) => {
                    return Err(Error::input(format!("'{}' has no open face to radiate from", part.name))
                        .at_key(format!("part.{}.surface.area", part.name))
                        .help("leave the area out, or uncover a face"));
                }
                None => 1.0,
            };
            let emissivity = self.effective(part.surface.emissivity, part.surface.effective, seen * factor);
            for piece in faces {
                self.piece(&piece, emissivity * factor, factor)?;
            }
            for vertex in &vertices {
                if let Some(surface) = self.vertex_surface(vertex, emissivity, factor) {
                    self.push_surface(surface);
                }
            }
        }
        for (b, boundary) in self.machine.boundaries.iter().enumerate() {
            if let Some(exposed) = boundary.node {
                let node = self.lumped(exposed.node);
                let mut laws = FREE;
                laws[slot(&boundary.law)] = b as u32;
                self.network.acting[b] = BoundaryArea { acting: exposed.area, whole: exposed.area };
                self.push_surface(Surface { node, property: NONE, length: 0.0, area: exposed.area, emissive: 0.0, gas_area: 0.0, laws });
            }
        }
        for (n, node) in self.machine.nodes.iter().enumerate() {
            if let Some((emissivity, effective, area)) = node.radiation {
                let emissive = self.effective(emissivity, effective, area) * area;
                let node = self.lumped(n);
                self.network.surfaces.push(Surface { node, property: NONE, length: 0.0, area, emissive, gas_area: area, laws: FREE });
            }
        }
        self.check_boundaries()
    }

    /// The surface of a piece of a cell's face.
    fn piece(&mut self, piece: &Piece<'_>, emissivity: f64, factor: f64) -> Result<()> {
        let Piece { grid, side, area, laws, view, .. } = *piece;
        let held = laws.into_iter().find(|l| *l != NONE && self.holds(*l as usize));
        let at = (piece.number, side as usize, grid.cell(piece.cell));
        if let Some((node, share)) = piece.enclosed {
            // The surface is a node of its own, with the enclosure's radiation.
            if let Some(l) = held.filter(|l| self.machine.boundaries[*l as usize].within.is_some()) {
                let boundary = &self.machine.boundaries[l as usize];
                return Err(Error::input("a temperature on part of a face cannot act inside an enclosure")
                    .at_line(boundary.line)
                    .at_key(format!("boundary.{}.within", boundary.name))
                    .help("cut the part into blocks there, and name the face of one block"));
            }
            if let Some(nodes) = self.probed.get_mut(&at) {
                nodes.push((node, area));
            }
            let laws = if held.is_some() { FREE } else { laws };
            self.push_face(at, Surface { node, property: NONE, length: 0.0, area, emissive: 0.0, gas_area: area * share, laws });
            return Ok(());
        }
        let foot = (at.2 as u32, area, grid.half_length(piece.cell, side), self.property(grid.part, side.axis()));
        let (emissive, gas_area) = (emissivity * area * view, area * view * factor);
        if !self.probed.contains_key(&at) {
            let (node, _, length, property) = foot;
            self.push_face(at, Surface { node, property, length, area, emissive, gas_area, laws });
            return Ok(());
        }
        let node = match self.footed.get(&at) {
            Some(node) => *node,
            None => self.surface_node(foot),
        };
        self.probed.entry(at).or_default().push((node, area));
        self.network.faces.push(FaceNode { cell: at.2 as u32, side: at.1 as u8, node });
        match held {
            Some(l) => self.network.fixed.push((node, self.held_by(l as usize))),
            None => self.push_face(at, Surface { node, property: NONE, length: 0.0, area, emissive, gas_area, laws }),
        }
        Ok(())
    }

    /// Areas of a cell's face by the combination of boundaries that acts on them. Open and covered parts of a cell are divided alike.
    fn pieces(&self, grid: &Grid, side: Side, c: [usize; 3], area: f64) -> Vec<(f64, Laws)> {
        let acts = |f: &Face| f.part == grid.part && f.side == side && f.block.is_none_or(|b| b == grid.block);
        let on: Vec<(usize, &Boundary)> = self.machine.boundaries.iter().enumerate().filter(|(_, b)| b.faces.iter().any(acts)).collect();
        let regions: Vec<&Region> = on.iter().filter_map(|(_, b)| b.within.as_ref()).collect();
        let laws = |point: Option<[f64; 3]>| {
            let mut laws = FREE;
            for (l, boundary) in &on {
                let slot = &mut laws[slot(&boundary.law)];
                if *slot == NONE && boundary.within.as_ref().is_none_or(|w| point.is_some_and(|p| w.contains(p))) {
                    *slot = *l as u32;
                }
            }
            laws
        };
        if regions.is_empty() {
            return vec![(area, laws(None))];
        }
        let [p, q] = tangents(side.axis());
        let cuts = |d: usize| self.cuts(grid, d, c[d], &regions);
        let (along_p, along_q) = (cuts(p), cuts(q));
        let mut local = [0.0; 3];
        local[side.axis()] = grid.edges[side.axis()][c[side.axis()] + usize::from(side.is_high())];
        let mut found: Vec<(f64, Laws)> = Vec::new();
        for wp in along_p.windows(2) {
            for wq in along_q.windows(2) {
                (local[p], local[q]) = (f64::midpoint(wp[0], wp[1]), f64::midpoint(wq[0], wq[1]));
                // Rings on the end of a cylinder grow with their radius.
                let spread = if grid.is_cylindrical() && p == 0 && q == 1 { local[0] } else { 1.0 };
                let share = (wp[1] - wp[0]) * (wq[1] - wq[0]) * spread;
                let own = laws(Some(grid.to_machine(local)));
                match found.iter_mut().find(|(_, known)| *known == own) {
                    Some((sum, _)) => *sum += share,
                    None => found.push((share, own)),
                }
            }
        }
        let whole: f64 = found.iter().map(|f| f.0).sum();
        found.retain(|(share, _)| *share > LEAST_SHARE * whole);
        found.iter_mut().for_each(|(share, _)| *share *= area / whole);
        found
    }

    /// Cuts of a cell along a local axis: at the edges of ranges, exactly, or evenly where edges run otherwise.
    fn cuts(&self, grid: &Grid, d: usize, i: usize, regions: &[&Region]) -> Vec<f64> {
        let (low, high) = (grid.edges[d][i], grid.edges[d][i + 1]);
        let is_box = !grid.is_cylindrical() && !grid.is_spherical();
        let mut cuts = vec![low, high];
        for region in regions {
            match region {
                Region::Ranges { low: l, high: h } if is_box => {
                    cuts.extend([l[d], h[d]].into_iter().filter(|x| *x > low && *x < high));
                }
                _ => cuts.extend((1..PIECES).map(|k| low + (high - low) * k as f64 / PIECES as f64)),
            }
        }
        cuts.sort_by(f64::total_cmp);
        cuts.dedup();
        cuts
    }

    fn count_acting(&mut self, laws: Laws, area: f64) {
        for l in laws.into_iter().filter(|l| *l != NONE) {
            self.network.acting[l as usize].acting += area;
        }
    }

    /// Counts the areas that boundaries would act on if nothing covered a side of a block.
    fn count_whole(&mut self, grid: &Grid, side: Side) {
        let face = Face { part: grid.part, block: Some(grid.block), side };
        for (_, c, area) in self.mesh.face_cells(face) {
            for (area, laws) in self.pieces(grid, side, c, area) {
                for l in laws.into_iter().filter(|l| *l != NONE) {
                    self.network.acting[l as usize].whole += area;
                }
            }
        }
    }

    /// A boundary that acts nowhere is a mistake.
    fn check_boundaries(&self) -> Result<()> {
        for (boundary, area) in self.machine.boundaries.iter().zip(&self.network.acting) {
            if area.acting > LEAST_SHARE * area.whole {
                continue;
            }
            let (key, what, help) = if area.whole == 0.0 {
                ("within", "lies outside its faces", "coordinates are those of the part unless coordinates = \"machine\"")
            } else {
                ("faces", "acts on nothing: its faces are covered altogether", "name an open face, or uncover this one")
            };
            return Err(Error::input(format!("the boundary '{}' {what}", boundary.name))
                .at_line(boundary.line)
                .at_key(format!("boundary.{}.{key}", boundary.name))
                .help(help));
        }
        Ok(())
    }

    /// Whether the open surface of a cell on a side is in one piece: no boundary acts on part of it, no enclosure has it.
    pub(super) fn has_one_surface(&self, grid: &Grid, side: Side) -> bool {
        let is_own = |f: &Face| f.part == grid.part && f.side == side && f.block.is_none_or(|b| b == grid.block);
        let places = self.machine.enclosures.iter().flat_map(|e| &e.surfaces).filter_map(|s| s.place);
        let is_cut = self.machine.boundaries.iter().any(|b| b.within.is_some() && b.faces.iter().any(is_own));
        !is_cut && !places.into_iter().any(|place| self.faces_of(place).iter().any(is_own))
    }

    /// The boundary that holds the temperature of a side of a grid.
    pub(super) fn holding(&self, grid: &Grid, side: Side) -> Option<usize> {
        let acts = |f: &Face| f.part == grid.part && f.side == side && f.block.is_none_or(|b| b == grid.block);
        let of = |l: &usize| self.holds(*l) && self.machine.boundaries[*l].faces.iter().any(acts);
        (0..self.machine.boundaries.len()).find(of)
    }

    /// Whether a boundary prescribes a temperature.
    pub(super) fn holds(&self, boundary: usize) -> bool {
        matches!(self.machine.boundaries[boundary].law, BoundaryLaw::Temperature(_))
    }

    /// Index of a boundary's temperature in the load's list of those of held nodes: after the lumped nodes and the chamber.
    pub(super) fn held_by(&self, boundary: usize) -> u32 {
        (self.machine.nodes.len() + 1 + boundary) as u32
    }

    /// Keeps the surface of a cell's face, with its place, if anything leaves through it.
    fn push_face(&mut self, (_, side, cell): CellFace, surface: Surface) {
        let known = self.network.surfaces.len();
        self.push_surface(surface);
        if self.network.surfaces.len() > known {
            self.network.open.push(OpenFace { surface: known, cell, side: Side::ALL[side] });
        }
    }

    /// Keeps a surface through which anything leaves.
    fn push_surface(&mut self, surface: Surface) {
        let gas = surface.gas_area > 0.0 && self.machine.chamber.pressure > 0.0;
        if surface.emissive > 0.0 || surface.laws != FREE || gas {
            self.network.surfaces.push(surface);
        }
    }

    fn effective(&self, emissivity: f64, effective: bool, area: f64) -> f64 {
        match self.machine.chamber.enclosure {
            Some((e_wall, area_wall)) if !effective && emissivity > 0.0 => effective_emissivity(emissivity, area, e_wall, area_wall),
            _ => emissivity,
        }
    }
}

/// Place of a boundary among those that act on one surface: a temperature or a film, a flux, radiation.
pub(super) fn slot(law: &BoundaryLaw) -> usize {
    match law {
        BoundaryLaw::Temperature(_) | BoundaryLaw::Film(..) | BoundaryLaw::FreeConvection(..) => 0,
        BoundaryLaw::Flux(_) => 1,
        BoundaryLaw::Radiation(..) => 2,
    }
}
