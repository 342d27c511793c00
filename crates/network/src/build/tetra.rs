//! Imported volumes in the network: their vertices, conduction, contacts and surfaces.

use std::collections::BTreeMap;

use super::joints::{Crossing, reversed};
use super::surfaces::slot;
use super::{Builder, Foot};
use crate::mesh::tetra::Tetra;
use crate::mesh::tetra::touch::{Other, PAIRS, SharedArea, Touch};
use crate::{FREE, Joint, Laws, NONE, Surface};
use coldplate_describe::machine::{ContactLaw, Face, Place, Side};

/// Most vertices on one cell's face among which pairs are formed, a count. Chosen: number of joints, about its square, against
/// exactness.
const MOST_VERTICES: usize = 200;

/// Open area that a vertex of an imported part stands for.
pub(super) struct OpenVertex {
    node: u32,
    /// m².
    pub(super) area: f64,
    /// Boundaries of the machine.
    laws: Laws,
    /// Share of the view that the chamber has.
    pub(super) view: f64,
}

impl Builder<'_> {
    /// Capacities and groups of the vertices; a vertex holds a quarter of each of its tetrahedra.
    pub(super) fn vertices(&mut self) {
        let net = &mut self.network;
        for tetra in &self.mesh.tetra {
            let material = &self.machine.materials[self.machine.parts[tetra.part].material];
            // At 300 K; the group's relative capacity says how it changes.
            let volumetric = material.density * material.specific_heat.at(300.0);
            for (i, volume) in tetra.volumes.iter().enumerate() {
                net.capacity[tetra.first + i] = volumetric * volume;
                net.group[tetra.first + i] = tetra.part as u32;
            }
        }
    }

    /// Conduction along the edges of imported volumes.
    pub(super) fn edges(&mut self) {
        for tetra in &self.mesh.tetra {
            let conductivity = &self.machine.materials[self.machine.parts[tetra.part].material].conductivity;
            let is_isotropic = conductivity[0] == conductivity[1] && conductivity[0] == conductivity[2];
            let properties = [0, 1, 2].map(|d| self.property(tetra.part, d));
            for edge in tetra.edges() {
                let (a, b) = (tetra.node(edge.a) as u32, tetra.node(edge.b) as u32);
                // Half of the edge has the conductivity at either end.
                let mut joint = |area: f64, property: u32| {
                    if area != 0.0 {
                        self.network.joints.push(Joint {
                            a,
                            b,
                            area,
                            length_a: 0.5,
                            length_b: 0.5,
                            property_a: property,
                            property_b: property,
                            contact: NONE,
                            reach: [NONE; 2],
                        });
                    }
                };
                if is_isotropic {
                    joint(edge.factor.iter().sum(), properties[0]);
                } else {
                    (0..3).for_each(|d| joint(edge.factor[d], properties[d]));
                }
            }
        }
    }

    /// Conductivity that acts across a boundary triangle: along the axis nearest to its normal.
    fn across(&self, tetra: &Tetra, face: usize) -> u32 {
        let n = tetra.face_normal(face);
        let axis = (0..3).max_by(|a, b| n[*a].abs().total_cmp(&n[*b].abs())).unwrap_or(0);
        self.property(tetra.part, axis)
    }

    /// Parts on the two sides of a touch.
    pub(super) fn touch_parts(&self, touch: &Touch) -> [usize; 2] {
        let other = match touch.other {
            Other::Grid(g, _) => self.mesh.grids[g].part,
            Other::Tetra(t) => self.mesh.tetra[t].part,
        };
        [self.mesh.tetra[touch.tetra].part, other]
    }

    /// The pieces of a touch by the contact of the machine file that covers them (`None` where none does), and
    /// whether that contact counts them from the other side. One that names faces goes first.
    pub(super) fn covered_pieces<'a>(&self, touch: &'a Touch) -> Vec<(Option<usize>, bool, Vec<&'a SharedArea>)> {
        let tetra = &self.mesh.tetra[touch.tetra];
        let parts = self.touch_parts(touch);
        let contacts = &self.machine.contacts;
        let is_specific = |i: &usize| contacts[*i].between.iter().any(|p| matches!(p, Place::Face(_)));
        let concerned = |i: &usize| {
            let named = contacts[*i].between.map(Place::part);
            named == parts.map(Some) || named == [Some(parts[1]), Some(parts[0])]
        };
        let (mut candidates, general): (Vec<usize>, Vec<usize>) = (0..contacts.len()).filter(concerned).partition(is_specific);
        candidates.extend(general);
        let covers_first = |place: Place, piece: &SharedArea| match place {
            Place::Part(p) => p == parts[0],
            Place::Face(f) => tetra.belongs(piece.face as usize, f),
            Place::Node(_) => false,
        };
        let covers_second = |place: Place, piece: &SharedArea| match (place, touch.other) {
            (Place::Part(p), _) => p == parts[1],
            (Place::Face(f), Other::Grid(g, side)) => {
                f.part == parts[1] && f.side == side && f.block.is_none_or(|b| b == self.mesh.grids[g].block)
            }
            (Place::Face(f), Other::Tetra(t)) => self.mesh.tetra[t].belongs(piece.other as usize, f),
            (Place::Node(_), _) => false,
        };
        let mut found: Vec<(Option<usize>, bool, Vec<&SharedArea>)> = Vec::new();
        for piece in &touch.pieces {
            let covering = candidates.iter().find_map(|i| {
                let [first, second] = contacts[*i].between;
                let straight = covers_first(first, piece) && covers_second(second, piece);
                let crossed = covers_first(second, piece) && covers_second(first, piece);
                (straight || crossed).then_some((*i, crossed && !straight))
            });
            let (contact, crossed) = covering.map_or((None, false), |(i, crossed)| (Some(i), crossed));
            match found.iter_mut().find(|(c, x, _)| *c == contact && *x == crossed) {
                Some((.., list)) => list.push(piece),
                None => found.push((contact, crossed, vec![piece])),
            }
        }
        found
    }

    /// The joints of pieces of a touch under a law, from the imported side to the other (or crossed).
    pub(super) fn crossing(&self, touch: &Touch, pieces: &[&SharedArea], law: &ContactLaw, crossed: bool) -> Crossing {
        let tetra = &self.mesh.tetra[touch.tetra];
        let is_bonded = law.is_bonded();
        let mut crossing = Crossing::default();
        // Joints of each cell with the vertices that face it.
        let mut cells: BTreeMap<u32, Vec<Joint>> = BTreeMap::new();
        for piece in pieces {
            crossing.area += piece.area();
            let corners = tetra.body.faces[piece.face as usize].map(|v| tetra.node(v) as u32);
            let property_a = self.across(tetra, piece.face as usize);
            // Conduction length between the corner and the interface: none, unless a bond needs its layer.
            let layer = if is_bonded { piece.bond / 2.0 } else { 0.0 };
            let (others, length_b, property_b): ([u32; 3], f64, u32) = match touch.other {
                Other::Grid(g, side) => {
                    let grid = &self.mesh.grids[g];
                    let c = grid.indices(piece.other as usize);
                    ([piece.other, NONE, NONE], grid.half_length(c, side), self.property(grid.part, side.axis()))
                }
                Other::Tetra(t) => {
                    let far = &self.mesh.tetra[t];
                    let corners = far.body.faces[piece.other as usize].map(|v| far.node(v) as u32);
                    (corners, layer, self.across(far, piece.other as usize))
                }
            };
            let joint = |a: u32, b: u32, area: f64| Joint {
                a,
                b,
                area,
                length_a: layer,
                length_b,
                property_a,
                property_b,
                contact: NONE,
                reach: [NONE; 2],
            };
            for (corner, row) in corners.iter().zip(piece.shared) {
                for (other, area) in others.iter().zip(row).filter(|(other, area)| **other != NONE && *area != 0.0) {
                    let pair = joint(*corner, *other, area);
                    crossing.joints.push(pair);
                    if matches!(touch.other, Other::Grid(..)) {
                        cells.entry(pair.b).or_default().push(pair);
                    }
                }
            }
            if matches!(touch.other, Other::Grid(..)) {
                continue;
            }
            for (at, (i, j)) in PAIRS.into_iter().enumerate() {
                if piece.own[at] != 0.0 {
                    crossing.along.push(joint(corners[i], corners[j], -piece.own[at]));
                }
                if piece.far[at] != 0.0 {
                    crossing.along.push(joint(others[i], others[j], -piece.far[at]));
                }
            }
        }
        cells.into_values().for_each(|pairs| mean_of_cell(pairs, &mut crossing.along));
        merge(&mut crossing.joints);
        merge(&mut crossing.along);
        if crossed {
            crossing.joints.iter_mut().for_each(|j| *j = reversed(*j));
        }
        crossing
    }

    /// The vertices of a face (or of the whole boundary) of an imported part with the area each stands for: open area,
    /// or all of it.
    pub(super) fn vertex_areas(&self, tetra: &Tetra, face: Face, open: bool) -> Vec<Foot> {
        let mut areas: Vec<Foot> = Vec::new();
        for f in tetra.faces_of(face) {
            let shares = if open { tetra.open[f] } else { [tetra.face_area(f) / 3.0; 3] };
            let property = self.across(tetra, f);
            areas.extend((0..3).map(|i| (tetra.node(tetra.body.faces[f][i]) as u32, shares[i], 0.0, property)));
        }
        areas.sort_by_key(|foot| foot.0);
        let mut merged: Vec<Foot> = Vec::new();
        for foot in areas.into_iter().filter(|foot| foot.1 > 0.0) {
            match merged.last_mut() {
                Some(last) if last.0 == foot.0 => last.1 += foot.1,
                _ => merged.push(foot),
            }
        }
        merged
    }

    /// Open area of an imported part, one entry per vertex and kind; triangles at a given temperature hold their vertices.
    pub(super) fn open_vertices(&mut self, part: usize) -> Vec<OpenVertex> {
        let Some(tetra) = self.mesh.tetra_of(part) else { return Vec::new() };
        let surface = &self.machine.parts[part].surface;
        let mut found: Vec<OpenVertex> = Vec::new();
        let mut held: Vec<(u32, u32)> = Vec::new();
        let seen = |f: usize, view: &(Face, f64)| tetra.belongs(f, view.0);
        for f in 0..tetra.body.faces.len() {
            let mut laws = FREE;
            for (l, boundary) in self.machine.boundaries.iter().enumerate() {
                let slot = &mut laws[slot(&boundary.law)];
                if *slot == NONE && boundary.faces.iter().any(|face| tetra.belongs(f, *face)) {
                    *slot = l as u32;
                }
            }
            let open: f64 = tetra.open[f].iter().map(|area| area.max(0.0)).sum();
            for l in laws.into_iter().filter(|l| *l != NONE) {
                let area = &mut self.network.acting[l as usize];
                area.acting += open;
                area.whole += tetra.face_area(f);
            }
            if open <= 0.0 {
                continue;
            }
            let is_excluded = surface.excluded.iter().any(|face| tetra.belongs(f, *face));
            let view: f64 = self.view_left.iter().filter(|v| seen(f, v)).map(|v| v.1).product();
            let view = if is_excluded { 0.0 } else { view };
            for (corner, area) in tetra.body.faces[f].iter().zip(tetra.open[f]) {
                let node = tetra.node(*corner) as u32;
                found.push(OpenVertex { node, area, laws, view });
                if let Some(l) = laws.into_iter().find(|l| *l != NONE && self.holds(*l as usize)) {
                    held.push((node, self.held_by(l as usize)));
                }
            }
        }
        // A vertex between two such boundaries belongs to the first in the file.
        held.sort_unstable();
        held.dedup_by_key(|h| h.0);
        self.network.fixed.extend(held);
        let key = |e: &OpenVertex| (e.node, e.laws, e.view.to_bits());
        found.sort_by_key(key);
        let mut merged: Vec<OpenVertex> = Vec::new();
        for entry in found.into_iter().filter(|e| e.area > 0.0) {
            match merged.last_mut() {
                Some(last) if key(last) == key(&entry) => last.area += entry.area,
                _ => merged.push(entry),
            }
        }
        merged
    }

    /// The surface of a vertex; `None` if its temperature is given.
    pub(super) fn vertex_surface(&self, vertex: &OpenVertex, emissivity: f64, factor: f64) -> Option<Surface> {
        let OpenVertex { node, area, laws, view } = *vertex;
        let is_held = laws.into_iter().any(|l| l != NONE && self.holds(l as usize));
        let seen = area * view * factor;
        (!is_held).then_some(Surface { node, property: NONE, length: 0.0, area, emissive: emissivity * seen, gas_area: seen, laws })
    }

    /// The faces of a place: all six sides of a part, its boundary where it is imported, none of a lumped node.
    pub(super) fn faces_of(&self, place: Place) -> Vec<Face> {
        match place {
            Place::Node(_) => Vec::new(),
            Place::Face(face) => vec![face],
            Place::Part(part) if self.mesh.tetra_of(part).is_some() => vec![Face { part, block: None, side: Side::Low0 }],
            Place::Part(part) => Side::ALL.map(|side| Face { part, block: None, side }).to_vec(),
        }
    }
}

/// Adds the joints that make a cell exchange heat with the mean temperature over its face instead of with each vertex.
///
/// With shares w_i of the area A the energy G (sum w_i T_i / A - T)² is the sum over pairs of w_i/A G (T_i - T)² less
/// w_i w_j / A² G (T_i - T_j)². A linear field then has its value at the middle of the cell, where the cell has its own:
/// without this the interface would conduct along itself like a sheet a sixth of a cell thick.
fn mean_of_cell(mut pairs: Vec<Joint>, along: &mut Vec<Joint>) {
    merge(&mut pairs);
    let total: f64 = pairs.iter().map(|p| p.area).sum();
    // A cell with very many vertices on it keeps the nearest: those of the largest shares.
    if pairs.len() > MOST_VERTICES {
        pairs.sort_by(|p, q| q.area.total_cmp(&p.area).then(p.a.cmp(&q.a)));
        pairs.truncate(MOST_VERTICES);
    }
    for (i, p) in pairs.iter().enumerate() {
        along.extend(pairs[..i].iter().map(|q| Joint { b: q.a, area: -p.area * q.area / total, ..*p }));
    }
}

/// Adds up the joints between the same nodes with the same lengths.
fn merge(joints: &mut Vec<Joint>) {
    for joint in joints.iter_mut().filter(|j| j.area < 0.0 && j.a > j.b) {
        // Along one side both directions are one joint.
        std::mem::swap(&mut joint.a, &mut joint.b);
    }
    let key = |j: &Joint| (j.a, j.b, j.property_a, j.property_b, j.length_a.to_bits(), j.length_b.to_bits());
    joints.sort_by_key(key);
    joints.dedup_by(|next, kept| {
        let same = key(next) == key(kept);
        if same {
            kept.area += next.area;
        }
        same
    });
}
