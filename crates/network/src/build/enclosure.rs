//! Enclosures: grey diffuse surfaces become radiative conductors.

use super::views::{LEAK, Patch, Seeing, computed, given};
use super::{Builder, Foot};
use crate::mesh::grid::tangents;
use crate::mesh::sight::SidePiece;
use crate::{EnclosureViews, NONE};
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::{Enclosure, EnclosureSurface, Place, Side, Views};
use coldplate_physics::exchange::{ELIMINATED_ABOVE, RadiationNode, conductors};

/// Nodes that stand for a patch, each with its share of the patch's area; the shares sum to one.
type Members = Vec<(u32, f64)>;

impl Builder<'_> {
    /// The networks of all enclosures.
    ///
    /// Every patch has one radiosity. The faces of its cells stand behind half a cell of conduction each.
    pub(super) fn enclosures(&mut self) -> Result<()> {
        for enclosure in &self.machine.enclosures {
            self.enclosure(enclosure)?;
        }
        Ok(())
    }

    fn enclosure(&mut self, enclosure: &Enclosure) -> Result<()> {
        let (mut patches, mut members, mut emissivities, mut owner) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut cells: Vec<Vec<FaceCell>> = Vec::new();
        for (s, surface) in enclosure.surfaces.iter().enumerate() {
            let Some(place) = surface.place else { continue };
            for (patch, mut faces) in self.patches(enclosure, surface, place)? {
                members.push(match place {
                    Place::Node(n) => vec![(self.lumped(n), 1.0)],
                    _ => self.face_nodes(&mut faces, patch.area),
                });
                patches.push(patch);
                cells.push(faces);
                emissivities.push(surface.emissivity);
                owner.push(s);
            }
        }
        let listed = enclosure.surfaces.iter().find(|s| s.place.is_none());
        let mut areas: Vec<f64> = patches.iter().map(|p| p.area).collect();
        let seeing = match &enclosure.views {
            Views::Given(table) => {
                if let Some((wall, area)) = listed.and_then(|wall| Some((wall, wall.area?))) {
                    patches.push(Patch { name: wall.name.clone(), facets: Vec::new(), area });
                }
                given(enclosure, table, &patches)?
            }
            Views::Computed { rays, closed_forms } => {
                let sealed = enclosure.closed && listed.is_none();
                computed(self.machine, self.mesh, enclosure, &patches, *rays, *closed_forms, sealed)?
            }
        };
        let n = areas.len();
        // A table may have a row for the chamber; otherwise the chamber gets the rest of each row.
        let to_chamber: Vec<f64> =
            (0..n).map(|i| if seeing.exchange.nrows() > n { seeing.exchange[(i, n)] } else { seeing.rest[i] }).collect();
        let seen: f64 = to_chamber.iter().sum();
        let mut exchange = seeing.exchange.clone().resize(n, n, 0.0);
        if seen > 0.0 {
            let wall = listed.and_then(|wall| Some((wall.emissivity, wall.area?))).or(self.machine.chamber.enclosure);
            let (emissivity, area) = wall.unwrap_or((1.0, seen));
            if area < seen * (1.0 - 1e-9) {
                return Err(Error::input(format!("the chamber wall is smaller than what looks at it, {seen:.4} m2"))
                    .at_line(enclosure.line)
                    .at_key(format!("enclosure.{}", enclosure.name))
                    .read(area)
                    .help("check the area of the chamber"));
            }
            exchange = exchange.resize(n + 1, n + 1, 0.0);
            for (i, s) in to_chamber.iter().enumerate() {
                (exchange[(i, n)], exchange[(n, i)]) = (*s, *s);
            }
            areas.push(area);
            emissivities.push(emissivity);
            members.push(vec![(self.chamber_node(), 1.0)]);
        }
        let first = self.network.radiative.len();
        // The chamber's patch, after all others, has no owner.
        let ends = self.exchange_heat(&conductors(&exchange, &areas, &emissivities), &members, &areas, &emissivities);
        let owned = |end: u32| owner.get(end as usize).map_or(NONE, |s| listed_index(enclosure, *s));
        let ends: Vec<[u32; 2]> = ends.into_iter().map(|e| e.map(owned)).collect();
        for (i, faces) in cells.iter().enumerate() {
            for face in faces {
                self.enclosed.insert((face.grid, face.side as usize, face.cell), (face.node, to_chamber[i] / areas[i]));
            }
        }
        self.report(enclosure, &owner, &areas[..n], &seeing, &to_chamber);
        if let Some(views) = self.network.enclosures.last_mut() {
            (views.conductors, views.ends) = (first..self.network.radiative.len(), ends);
        }
        Ok(())
    }

    /// The patches of a surface with the open cell faces they are made of.
    fn patches(&self, enclosure: &Enclosure, surface: &EnclosureSurface, place: Place) -> Result<Vec<(Patch, Vec<FaceCell>)>> {
        if let (Place::Node(_), Some(area)) = (place, surface.area) {
            return Ok(vec![(Patch { name: surface.name.clone(), facets: Vec::new(), area }, Vec::new())]);
        }
        let mut found: Vec<(Patch, Vec<FaceCell>)> = Vec::new();
        let whole = surface.patches == [1, 1];
        for face in self.faces_of(place) {
            for (g, grid) in self.mesh.grids_of(face.part).filter(|(_, g)| face.block.is_none_or(|b| b == g.block)) {
                let [p, q] = tangents(face.side.axis());
                let counts = [surface.patches[0].min(grid.n(p)), surface.patches[1].min(grid.n(q))];
                for k in 0..counts[0] * counts[1] {
                    // Pieces end where cells do.
                    let range = |d: usize, i: usize, of: usize| (i * grid.n(d) / of, (i + 1) * grid.n(d) / of);
                    let (rp, rq) = (range(p, k % counts[0], counts[0]), range(q, k / counts[0], counts[1]));
                    let inside = |c: &[usize; 3]| (rp.0..rp.1).contains(&c[p]) && (rq.0..rq.1).contains(&c[q]);
                    let cells: Vec<FaceCell> = self
                        .mesh
                        .open_faces(g, face.side)
                        .filter(|(c, _)| inside(c))
                        .map(|(c, area)| {
                            let foot =
                                (grid.cell(c) as u32, area, grid.half_length(c, face.side), self.property(face.part, face.side.axis()));
                            FaceCell { grid: g, side: face.side, cell: grid.cell(c), foot, node: NONE }
                        })
                        .collect();
                    if cells.is_empty() {
                        continue;
                    }
                    let ends = |d: usize, r: (usize, usize)| (grid.edges[d][r.0], grid.edges[d][r.1]);
                    let (ep, eq) = (ends(p, rp), ends(q, rq));
                    let facet = SidePiece { grid: g, side: face.side, low: [ep.0, eq.0], high: [ep.1, eq.1] };
                    let area = cells.iter().map(|c| c.foot.1).sum::<f64>();
                    match found.last_mut() {
                        // A surface that is not cut is one patch, however many faces it has.
                        Some((patch, all)) if whole => {
                            patch.facets.push(facet);
                            patch.area += area;
                            all.extend(cells);
                        }
                        _ => {
                            let name = if whole { surface.name.clone() } else { format!("{} ({})", surface.name, found.len() + 1) };
                            found.push((Patch { name, facets: vec![facet], area }, cells));
                        }
                    }
                }
            }
        }
        if found.is_empty() {
            return Err(Error::input(format!("'{}' has no open face here", surface.name))
                .at_line(enclosure.line)
                .at_key(format!("enclosure.{}.surfaces", enclosure.name))
                .help("name a face that is not covered by another part"));
        }
        Ok(found)
    }
}

/// The place of a surface among those that are not the chamber; the chamber is the last.
fn listed_index(enclosure: &Enclosure, surface: usize) -> u32 {
    enclosure.surfaces[..surface].iter().filter(|s| s.place.is_some()).count() as u32
}

/// An open cell face of a patch.
struct FaceCell {
    grid: usize,
    side: Side,
    cell: usize,
    foot: Foot,
    /// The node of its surface, once it is made.
    node: u32,
}

impl Builder<'_> {
    /// Makes a node for the surface of every cell face of a patch.
    fn face_nodes(&mut self, faces: &mut [FaceCell], area: f64) -> Members {
        faces
            .iter_mut()
            .map(|face| {
                face.node = self.surface_node(face.foot);
                if let Some(law) = self.holding(&self.mesh.grids[face.grid], face.side) {
                    self.network.fixed.push((face.node, self.held_by(law)));
                }
                (face.node, face.foot.1 / area)
            })
            .collect()
    }

    /// The node held at the temperature of the chamber wall.
    fn chamber_node(&mut self) -> u32 {
        if let Some(node) = self.network.chamber {
            return node;
        }
        let node = self.arithmetic_node();
        self.network.chamber = Some(node);
        // The load lists the chamber's temperature after those of the lumped nodes.
        self.network.fixed.push((node, self.machine.nodes.len() as u32));
        node
    }

    /// Radiative conductors between the nodes of an enclosure's patches; returns the patches at the two ends of each,
    /// [`NONE`] where it ends at a node between.
    fn exchange_heat(
        &mut self,
        list: &[(RadiationNode, RadiationNode, f64)],
        members: &[Members],
        areas: &[f64],
        emissivities: &[f64],
    ) -> Vec<[u32; 2]> {
        let mut ends = Vec::new();
        let mut radiosity: Vec<Option<u32>> = vec![None; members.len()];
        for (i, e) in emissivities.iter().enumerate().filter(|(_, e)| **e <= ELIMINATED_ABOVE) {
            let node = self.arithmetic_node();
            radiosity[i] = Some(node);
            let own = e * areas[i] / (1.0 - e);
            self.network.radiative.extend(members[i].iter().map(|(n, share)| (*n, node, own * share)));
            ends.extend(members[i].iter().map(|_| [i as u32, NONE]));
        }
        let nodes = |terminal: &RadiationNode| match terminal {
            RadiationNode::Radiosity(i) => radiosity[*i].map_or(Vec::new(), |node| vec![(node, 1.0)]),
            RadiationNode::Surface(i) => members[*i].clone(),
        };
        let patch = |terminal: &RadiationNode| if let RadiationNode::Surface(i) = terminal { *i as u32 } else { NONE };
        for (a, b, conductor) in list {
            let (first, second) = (nodes(a), nodes(b));
            if first.len() == 1 || second.len() == 1 {
                let pairs = first.iter().flat_map(|(n, s)| second.iter().map(move |(m, t)| (*n, *m, conductor * s * t)));
                self.network.radiative.extend(pairs);
                ends.resize(ends.len() + first.len() * second.len(), [patch(a), patch(b)]);
            } else {
                // Many with many: by way of one node between, twice the conductor on either side.
                let middle = self.arithmetic_node();
                let both = first.iter().chain(&second);
                self.network.radiative.extend(both.map(|(n, share)| (*n, middle, 2.0 * conductor * share)));
                ends.resize(ends.len() + first.len(), [patch(a), NONE]);
                ends.resize(ends.len() + second.len(), [patch(b), NONE]);
            }
        }
        ends
    }

    /// Sums view factors of patches up to surfaces, for reports.
    fn report(&mut self, enclosure: &Enclosure, owner: &[usize], areas: &[f64], seeing: &Seeing, to_chamber: &[f64]) {
        let listed: Vec<&EnclosureSurface> = enclosure.surfaces.iter().filter(|s| s.place.is_some()).collect();
        let n = listed.len();
        let (mut own, mut views, mut chamber) = (vec![0.0; n], vec![vec![0.0; n]; n], vec![0.0; n]);
        let mut strayed = vec![0.0; n];
        for (i, s) in owner.iter().enumerate() {
            own[*s] += areas[i];
            chamber[*s] += to_chamber[i];
            strayed[*s] += areas[i] * seeing.strayed[i];
            for (j, t) in owner.iter().enumerate() {
                views[*s][*t] += seeing.exchange[(i, j)];
            }
        }
        for (s, area) in own.iter().enumerate() {
            views[s].iter_mut().for_each(|v| *v /= area);
            chamber[s] /= area;
        }
        let mut notes = seeing.notes.clone();
        for ((s, strayed), area) in listed.iter().zip(strayed).zip(&own).filter(|((_, strayed), area)| *strayed > LEAK * **area) {
            let share = 100.0 * strayed / area;
            notes.push(format!("{share:.1} % of what '{}' sends out falls on faces outside the enclosure, which count as chamber", s.name));
        }
        self.network.enclosures.push(EnclosureViews {
            name: enclosure.name.clone(),
            surfaces: listed.iter().map(|s| s.name.clone()).collect(),
            areas: own,
            emissivities: listed.iter().map(|s| s.emissivity).collect(),
            view_factors: views,
            chamber,
            conductors: 0..0,
            ends: Vec::new(),
            patches: areas.len(),
            by_rays: seeing.by_rays,
            error: seeing.error,
            corrected: seeing.corrected,
            notes,
        });
    }
}
