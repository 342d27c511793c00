//! Contacts and radiative links: where parts touch, and where the machine file joins them all the same.

use super::joints::{Crossing, joint_between, reversed};
use super::{Builder, CellFace, Foot};
use crate::mesh::TouchingFaces;
use crate::mesh::grid::{Grid, tangents};
use crate::{ContactGroup, Crossed, EndInterpolation, Joint, NONE};
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::{Bonded, ContactLaw, Face, Place, Side};
use std::f64::consts::TAU;

/// Largest area of a joint as a multiple of the faces that it joins, dimensionless. Chosen: teeth and fins double a face a
/// few times, a wrong unit makes it a hundred times and more.
const LARGEST_SHARE: f64 = 10.0;

fn too_large(share: f64) -> Error {
    Error::input(format!("this area is {share:.0} times that of the faces it joins"))
        .help("look at its unit; of a joint with a known conductance in W/K, state total_conductance")
}

impl Builder<'_> {
    /// The contact of the machine file that covers an interface, and whether the other way round.
    fn covering(&self, interface: &TouchingFaces) -> Option<(usize, bool)> {
        let faces = [interface.a, interface.b].map(|(g, side)| {
            let grid = &self.mesh.grids[g];
            Face { part: grid.part, block: Some(grid.block), side }
        });
        self.machine.contact_between(faces)
    }

    /// Joints where blocks touch.
    pub(super) fn interfaces(&mut self) -> Result<()> {
        // Interfaces that share a contact form one group: sort them by the contact they belong to.
        let default = self.machine.default_contact.clone().unwrap_or(ContactLaw::Bonded(Bonded));
        let mut named: Vec<Vec<Crossing>> = vec![Vec::new(); self.machine.contacts.len()];
        let mut unnamed: Vec<((usize, usize), Vec<Crossing>)> = Vec::new();
        let mut add_unnamed = |pa: usize, pb: usize, crossing: Crossing| {
            let key = (pa.min(pb), pa.max(pb));
            match unnamed.iter_mut().find(|(k, _)| *k == key) {
                Some((_, list)) => list.push(crossing),
                None => unnamed.push((key, vec![crossing])),
            }
        };
        let mesh = self.mesh;
        for (i, interface) in mesh.interfaces.iter().enumerate() {
            let (pa, pb) = (self.mesh.grids[interface.a.0].part, self.mesh.grids[interface.b.0].part);
            if let Some((index, crossed)) = self.covering(interface) {
                let is_bonded = self.machine.contacts[index].law.is_bonded();
                named[index].push(self.block_crossing(i, crossed, is_bonded));
            } else if pa == pb {
                let joints = self.joints_of(interface, false, true);
                let start = self.network.joints.len();
                self.network.joints.extend(joints);
                self.network.crossed.push(Crossed { interface: i, joints: start..self.network.joints.len() });
            } else {
                add_unnamed(pa, pb, self.block_crossing(i, pa > pb, default.is_bonded()));
            }
        }
        for touch in &self.mesh.touches {
            let [pa, pb] = self.touch_parts(touch);
            for (contact, crossed, pieces) in self.covered_pieces(touch) {
                match contact {
                    Some(index) => named[index].push(self.crossing(touch, &pieces, &self.machine.contacts[index].law, crossed)),
                    None => add_unnamed(pa, pb, self.crossing(touch, &pieces, &default, pa > pb)),
                }
            }
        }
        for (index, list) in named.into_iter().enumerate() {
            let contact = &self.machine.contacts[index];
            if list.is_empty() {
                let stated =
                    contact.area.is_some() || contact.law.is_total() || contact.between.iter().any(|p| matches!(p, Place::Node(_)));
                if !stated {
                    return Err(Error::input(format!("the contact '{}' joins faces that do not touch", contact.name))
                        .at_line(contact.line)
                        .at_key(format!("contact.{}", contact.name))
                        .help("move the parts together, or give the contact an area to join them all the same"));
                }
                continue; // joined by its stated area later
            }
            let true_area: f64 = list.iter().map(|crossing| crossing.area).sum();
            let stated = contact.area.filter(|_| !contact.law.is_total());
            let scale = stated.map_or(1.0, |stated| stated / true_area);
            if scale > LARGEST_SHARE {
                return Err(too_large(scale).at_line(contact.line).at_key(format!("contact.{}.area", contact.name)));
            }
            let names = contact.between.map(|p| self.place_name(p));
            self.group(Some(index), contact.name.clone(), contact.law.clone(), names, true_area, scale, list);
        }
        for ((pa, pb), list) in unnamed {
            let area = list.iter().map(|crossing| crossing.area).sum();
            let names = [pa, pb].map(|p| self.machine.parts[p].name.clone());
            let name = format!("{} | {}", names[0], names[1]);
            self.group(None, name, default.clone(), names, area, 1.0, list);
        }
        Ok(())
    }

    #[allow(clippy::too_many_arguments)]
    fn group(
        &mut self,
        of: Option<usize>,
        name: String,
        law: ContactLaw,
        between: [String; 2],
        area: f64,
        scale: f64,
        crossings: Vec<Crossing>,
    ) {
        let start = self.network.joints.len();
        let contact = self.network.contacts.len() as u32;
        let within = |joint: Joint| Joint { contact, ..joint };
        for crossing in &crossings {
            let first = self.network.joints.len();
            self.network.joints.extend(crossing.joints.iter().copied().map(within));
            let crossed = crossing.interface.map(|interface| Crossed { interface, joints: first..self.network.joints.len() });
            self.network.crossed.extend(crossed);
        }
        let joints = start..self.network.joints.len();
        if law.joins_along() {
            self.network.joints.extend(crossings.iter().flat_map(|c| &c.along).copied().map(within));
        }
        self.network.contacts.push(ContactGroup { of, name, law, between, area, scale, is_half: false, joints });
    }

    fn block_crossing(&mut self, index: usize, crossed: bool, is_bonded: bool) -> Crossing {
        let interface = &self.mesh.interfaces[index];
        let joints = self.joints_of(interface, crossed, is_bonded);
        Crossing { joints, along: Vec::new(), area: interface.area(), interface: Some(index) }
    }

    /// Joints of one interface, from its first side to its second (or crossed). Sides that a sensor reads have a node of their own,
    /// behind the half cell; both sides of a bond share one.
    fn joints_of(&mut self, interface: &TouchingFaces, crossed: bool, is_bonded: bool) -> Vec<Joint> {
        let ((ga, sa), (gb, sb)) = (interface.a, interface.b);
        let (grid_a, grid_b) = (&self.mesh.grids[ga], &self.mesh.grids[gb]);
        let (property_a, property_b) = (self.property(grid_a.part, sa.axis()), self.property(grid_b.part, sb.axis()));
        let mut found = Vec::with_capacity(interface.overlaps.len());
        for o in &interface.overlaps {
            let reaches = &mut self.network.reaches;
            let (length_a, length_b) = (grid_a.half_length(grid_a.indices(o.a), sa), grid_b.half_length(grid_b.indices(o.b), sb));
            let reach = [reach(grid_a, o.a, sa, o.point, reaches), reach(grid_b, o.b, sb, o.point, reaches)];
            let (a, b) = (o.a as u32, o.b as u32);
            let mut joint = Joint { a, b, area: o.area, length_a, length_b, property_a, property_b, contact: NONE, reach };
            let (at_a, at_b) = ((ga, sa as usize, o.a), (gb, sb as usize, o.b));
            let reads = [at_a, at_b].map(|at| self.probed.contains_key(&at));
            if reads[0] || (is_bonded && reads[1]) {
                self.split(&mut joint, at_a);
                if is_bonded && reads[1] {
                    self.probed.entry(at_b).or_default().push((joint.a, o.area));
                }
            }
            if reads[1] && !is_bonded {
                joint = reversed(joint);
                self.split(&mut joint, at_b);
                joint = reversed(joint);
            }
            found.push(if crossed { reversed(joint) } else { joint });
        }
        found
    }

    /// Puts a node on the first side of a joint's interface and lets the joint begin there.
    fn split(&mut self, joint: &mut Joint, at: CellFace) {
        let surface = self.surface_node((joint.a, joint.area, joint.length_a, joint.property_a));
        if let Some(half) = self.network.joints.last_mut().filter(|half| half.b == surface) {
            half.reach[0] = joint.reach[0];
        }
        if let Some(nodes) = self.probed.get_mut(&at) {
            nodes.push((surface, joint.area));
        }
        (joint.a, joint.length_a, joint.reach[0]) = (surface, 0.0, NONE);
    }

    pub(super) fn place_name(&self, place: Place) -> String {
        match place {
            Place::Part(p) => self.machine.parts[p].name.clone(),
            Place::Face(f) => self.machine.parts[f.part].name.clone(),
            Place::Node(n) => self.machine.nodes[n].name.clone(),
        }
    }

    /// The nodes of a place with their share of `area` (of its own area where `None`).
    pub(super) fn feet(&mut self, place: Place, area: Option<f64>, key: &str) -> Result<Vec<Foot>> {
        let faces: Vec<Face> = match place {
            Place::Node(n) => {
                let area = area.ok_or_else(|| {
                    Error::input("a lumped node has no faces of its own")
                        .at_key(key)
                        .help("state the area, for example area = \"0.0143 m2\"")
                })?;
                return Ok(vec![(self.lumped(n), area, 0.0, NONE)]);
            }
            place => self.faces_of(place),
        };
        // A face that is covered altogether (a plate under a motor) is still a place to join a node to.
        let open = self.gather(&faces, true);
        let mut cells = if open.is_empty() { self.gather(&faces, false) } else { open };
        let total: f64 = cells.iter().map(|c| c.1).sum();
        if total <= 0.0 {
            return Err(Error::input(format!("'{}' has no open face here", self.place_name(place)))
                .at_key(key)
                .help("name a face that is not covered by another part"));
        }
        let factor = area.map_or(1.0, |a| a / total);
        // The open part of a face may be small; the whole face bounds what can be joined to it.
        if factor > LARGEST_SHARE {
            let whole: f64 = self.gather(&faces, false).iter().map(|foot| foot.1).sum();
            let share = factor * total / whole.max(total);
            if share > LARGEST_SHARE {
                return Err(too_large(share).at_key(key));
            }
        }
        for foot in &mut cells {
            foot.1 *= factor;
        }
        Ok(cells)
    }

    /// The feet of faces: of open cells, or of all. On an open face that a sensor reads they stand on its node there.
    fn gather(&mut self, faces: &[Face], open: bool) -> Vec<Foot> {
        let mut cells: Vec<Foot> = Vec::new();
        for face in faces {
            if let Some(tetra) = self.mesh.tetra_of(face.part) {
                cells.extend(self.vertex_areas(tetra, *face, open));
            }
            for (g, c, a) in if open { self.mesh.open_cells(*face) } else { self.mesh.face_cells(*face) } {
                let grid = &self.mesh.grids[g];
                let property = self.property(grid.part, face.side.axis());
                let foot = (grid.cell(c) as u32, a, grid.half_length(c, face.side), property);
                let at = (g, face.side as usize, grid.cell(c));
                if open && self.probed.contains_key(&at) && self.has_one_surface(grid, face.side) {
                    let node = match self.footed.get(&at) {
                        Some(node) => *node,
                        None => self.surface_node(foot),
                    };
                    self.footed.insert(at, node);
                    cells.push((node, a, 0.0, property));
                } else {
                    if self.probed.contains_key(&at) {
                        self.bypassed.insert(at);
                    }
                    cells.push(foot);
                }
            }
        }
        cells
    }

    /// Contacts joined by a stated area: to lumped nodes, or between places that do not touch.
    ///
    /// Conduction to the surface goes through the whole face of each cell; only the interface itself is
    /// scaled to the stated area, so that coarse cells do not choke it.
    pub(super) fn stated_contacts(&mut self) -> Result<()> {
        for (of, contact) in self.machine.contacts.iter().enumerate() {
            if self.network.contacts.iter().any(|group| group.of == Some(of)) {
                continue;
            }
            let key = format!("contact.{}", contact.name);
            let is_node = contact.between.map(|p| matches!(p, Place::Node(_)));
            if is_node == [true, true] {
                let area = contact.area.unwrap_or(1.0);
                if contact.area.is_none() && !contact.law.is_total() {
                    return Err(Error::input("two lumped nodes have no faces to take the area from")
                        .at_line(contact.line)
                        .at_key(key)
                        .help("state the area, for example area = \"0.0143 m2\", or give total_conductance"));
                }
                let feet = contact.between.map(|p| self.node_foot(p, area));
                let start = self.network.joints.len();
                self.network.joints.push(joint_between(feet[0], feet[1], self.network.contacts.len() as u32));
                self.push_group(of, area, 1.0, false, start);
                continue;
            }
            let sides = [0, 1].map(|i| if is_node[i] { Ok(Vec::new()) } else { self.feet(contact.between[i], None, &key) });
            let [first, second] = sides;
            let sides = [first?, second?];
            let own = [0, 1].map(|i| sides[i].iter().map(|f| f.1).sum::<f64>());
            let smaller = own.iter().copied().filter(|a| *a > 0.0).fold(f64::INFINITY, f64::min);
            let area = contact.area.unwrap_or(smaller);
            if area > LARGEST_SHARE * smaller && !contact.law.is_total() {
                return Err(too_large(area / smaller).at_line(contact.line).at_key(format!("{key}.area")));
            }
            // The area that the contact covers no longer sees the chamber.
            for (place, own) in contact.between.iter().zip(own) {
                if let (Place::Face(face), Some(covered)) = (place, contact.area) {
                    self.view_left.push((*face, (1.0 - covered / own).max(0.0)));
                }
            }
            let start = self.network.joints.len();
            let index = self.network.contacts.len() as u32;
            if is_node[0] || is_node[1] {
                let crossed = !is_node[0];
                let (node, others) = if crossed { (contact.between[1], &sides[0]) } else { (contact.between[0], &sides[1]) };
                for other in others {
                    let joint = joint_between(self.node_foot(node, other.1), *other, index);
                    self.network.joints.push(if crossed { reversed(joint) } else { joint });
                }
                self.push_group(of, area, area / own[usize::from(!crossed)], false, start);
            } else {
                // Two resolved places: an arithmetic node between, half of the resistance on each side.
                let middle = self.arithmetic_node();
                for foot in &sides[0] {
                    self.network.joints.push(joint_between(*foot, (middle, foot.1, 0.0, NONE), index));
                }
                self.push_group(of, area, 2.0 * area / own[0], true, start);
                let start = self.network.joints.len();
                for foot in &sides[1] {
                    self.network.joints.push(joint_between((middle, foot.1, 0.0, NONE), *foot, index + 1));
                }
                self.push_group(of, area, 2.0 * area / own[1], true, start);
            }
        }
        Ok(())
    }

    /// The foot of a lumped node.
    fn node_foot(&self, place: Place, area: f64) -> Foot {
        match place {
            Place::Node(n) => (self.lumped(n), area, 0.0, NONE),
            Place::Part(_) | Place::Face(_) => (NONE, 0.0, 0.0, NONE),
        }
    }

    /// Closes the group of the joints from `start` on.
    fn push_group(&mut self, of: usize, area: f64, scale: f64, is_half: bool, start: usize) {
        let contact = &self.machine.contacts[of];
        let name = match self.network.contacts.last() {
            Some(last) if is_half && last.of == Some(of) => format!("{} (far side)", contact.name),
            _ => contact.name.clone(),
        };
        let between = contact.between.map(|p| self.place_name(p));
        let joints = start..self.network.joints.len();
        self.network.contacts.push(ContactGroup { of: Some(of), name, law: contact.law.clone(), between, area, scale, is_half, joints });
    }

    /// Radiation between facing places: each side radiates to one arithmetic node between them, with
    /// half of the space resistance each; exact for two isothermal grey surfaces.
    pub(super) fn radiation_links(&mut self) -> Result<()> {
        for link in &self.machine.radiation_links {
            let key = format!("radiation_link.{}", link.name);
            let first = self.feet(link.between[0], link.area, &key)?;
            let area_1: f64 = first.iter().map(|f| f.1).sum();
            let second = match link.between[1] {
                Place::Node(_) => self.feet(link.between[1], Some(area_1), &key)?,
                place => self.feet(place, None, &key)?,
            };
            let area_2: f64 = second.iter().map(|f| f.1).sum();
            let back = link.view_factor * area_1 / area_2;
            if back > 1.0 + 1e-9 {
                return Err(Error::input("by reciprocity the second surface would see the first with a view factor above one")
                    .at_key(format!("{key}.view_factor"))
                    .read(link.view_factor)
                    .help(format!("with these areas at most {:.4}", area_2 / area_1)));
            }
            let middle = self.arithmetic_node();
            for (feet, e, area, view) in
                [(&first, link.emissivity[0], area_1, link.view_factor), (&second, link.emissivity[1], area_2, back)]
            {
                let resistance = (1.0 - e) / (e * area) + 0.5 / (area_1 * link.view_factor);
                for foot in feet {
                    let surface = self.surface_node(*foot);
                    self.network.radiative.push((surface, middle, foot.1 / area / resistance));
                }
                let place = if std::ptr::eq(feet, &first) { link.between[0] } else { link.between[1] };
                self.view_left.extend(self.faces_of(place).into_iter().map(|face| (face, 1.0 - view)));
            }
        }
        Ok(())
    }

    /// The node of a foot's surface: behind half a cell of conduction, or the node itself where it is lumped.
    pub(super) fn surface_node(&mut self, (node, area, length, property): Foot) -> u32 {
        if property == NONE || length == 0.0 {
            return node;
        }
        let surface = self.arithmetic_node();
        self.network.group[surface as usize] = self.network.group[node as usize];
        self.network.joints.push(joint_between((node, area, length, property), (surface, area, 0.0, NONE), NONE));
        surface
    }
}

/// Interpolation to the temperature beside the middle of a face cell, for a `point` (m) outside its middle.
fn reach(grid: &Grid, cell: usize, side: Side, point: [f64; 3], reaches: &mut Vec<EndInterpolation>) -> u32 {
    let (c, local) = (grid.indices(cell), grid.to_local(point));
    let mut found = EndInterpolation { nodes: [cell as u32; 2], shares: [0.0; 2] };
    for (slot, d) in tangents(side.axis()).into_iter().enumerate() {
        let (n, at) = (grid.n(d), c[d]);
        let mut offset = local[d] - grid.centre(d, at);
        if grid.wraps(d) {
            offset = (offset + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
        }
        if offset.abs() < 1e-6 * grid.width(d, at) {
            continue;
        }
        let (next, sign) = match (offset > 0.0, grid.wraps(d)) {
            (true, true) => ((at + 1) % n, 1.0),
            (false, true) => ((at + n - 1) % n, 1.0),
            (true, false) if at + 1 < n => (at + 1, 1.0),
            (false, false) if at > 0 => (at - 1, 1.0),
            // At the edge of a face nothing lies beyond: the slope inside is continued.
            (true, false) if at > 0 => (at - 1, -1.0),
            (false, false) if at + 1 < n => (at + 1, -1.0),
            _ => continue,
        };
        let mut other = c;
        other[d] = next;
        let span = (grid.width(d, at) + grid.width(d, next)) / 2.0;
        let span = if grid.wraps(d) { span } else { (grid.centre(d, next) - grid.centre(d, at)).abs() };
        found.nodes[slot] = grid.cell(other) as u32;
        found.shares[slot] = sign * (offset.abs() / span).min(0.5);
    }
    if found.shares == [0.0; 2] {
        return NONE;
    }
    reaches.push(found);
    (reaches.len() - 1) as u32
}
