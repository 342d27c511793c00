//! Machine and mesh become a network.

use super::stream::{CircuitTree, Stream};
use super::{ContactGroup, Joint, NONE, Network, SensorTerm, Surface};
use crate::error::{Error, Result};
use crate::machine::{Contact, ContactLaw, Face, Layout, Machine, Place, Reading, Side};
use crate::mesh::{Interface, Mesh, path};
use crate::physics::radiation::effective_emissivity;

impl Network {
    /// Compiles `machine` on `mesh`.
    ///
    /// # Errors
    /// A contact, source, sensor or channel of the machine has nothing to attach to on this geometry.
    pub fn build(machine: &Machine, mesh: &Mesh) -> Result<Self> {
        let mut builder = Builder { machine, mesh, network: Network::default(), view_left: vec![] };
        builder.nodes();
        builder.blocks();
        builder.interfaces()?;
        builder.stated_contacts()?;
        builder.radiation_links()?;
        builder.surfaces()?;
        builder.streams()?;
        builder.sources()?;
        builder.sensors()?;
        Ok(builder.network)
    }
}

struct Builder<'a> {
    machine: &'a Machine,
    mesh: &'a Mesh,
    network: Network,
    /// Faces that see another surface, and the share of their view that is left for the chamber.
    view_left: Vec<(Face, f64)>,
}

/// A node of a place with its share, and the half cell in front of it: (node, area, length, property).
type Foot = (u32, f64, f64, u32);

impl Builder<'_> {
    fn nodes(&mut self) {
        let net = &mut self.network;
        net.groups = self.machine.parts.iter().map(|p| &p.name).chain(self.machine.nodes.iter().map(|n| &n.name)).cloned().collect();
        // Three conductivities per material, one per local axis.
        net.properties = self.machine.materials.iter().flat_map(|m| m.conductivity.iter().cloned()).collect();
        net.capacity = vec![0.0; self.mesh.cells];
        net.group = vec![0; self.mesh.cells];
        for grid in &self.mesh.grids {
            let material = &self.machine.materials[self.machine.parts[grid.part].material];
            // Capacity at 300 K; transients re-evaluate c(T).
            let volumetric = material.density * material.specific_heat.at(300.0);
            for (i, c) in grid.cells().enumerate() {
                net.capacity[grid.first + i] = volumetric * grid.volume(c);
                net.group[grid.first + i] = grid.part as u32;
            }
        }
        for (i, node) in self.machine.nodes.iter().enumerate() {
            if node.fixed.is_some() {
                net.fixed.push((net.capacity.len() as u32, i as u32));
            }
            net.capacity.push(node.capacity);
            net.group.push((self.machine.parts.len() + i) as u32);
        }
        net.solids = net.capacity.len();
        net.nodes = net.solids;
    }

    fn arithmetic_node(&mut self) -> u32 {
        self.network.capacity.push(0.0);
        self.network.group.push(NONE);
        self.network.solids += 1;
        self.network.nodes = self.network.solids;
        self.network.solids as u32 - 1
    }

    fn lumped(&self, node: usize) -> u32 {
        (self.mesh.cells + node) as u32
    }

    fn property(&self, part: usize, axis: usize) -> u32 {
        (3 * self.machine.parts[part].material + axis) as u32
    }

    /// Conduction between neighbouring cells of each block.
    fn blocks(&mut self) {
        for grid in &self.mesh.grids {
            for d in 0..3 {
                let (low, high) = (Side::ALL[2 * d], Side::ALL[2 * d + 1]);
                let property = self.property(grid.part, d);
                let constant = self.network.properties[property as usize].is_constant();
                let k = self.network.properties[property as usize].at(300.0);
                for c in grid.cells() {
                    let mut next = c;
                    next[d] += 1;
                    if next[d] == grid.n(d) {
                        if !(grid.wraps(d) && grid.n(d) > 2) {
                            continue;
                        }
                        next[d] = 0;
                    }
                    let (a, b) = (grid.cell(c) as u32, grid.cell(next) as u32);
                    let area = grid.face_area(c, high);
                    let (length_a, length_b) = (grid.half_length(c, high), grid.half_length(next, low));
                    if constant {
                        self.network.conductors.push((a, b, k * area / (length_a + length_b)));
                    } else {
                        let joint = Joint { a, b, area, length_a, length_b, property_a: property, property_b: property, contact: NONE };
                        self.network.joints.push(joint);
                    }
                }
            }
        }
    }

    /// The contact of the machine file that covers an interface; one that names faces goes first.
    fn covering(&self, interface: &Interface) -> Option<(&Contact, bool)> {
        let faces = [interface.a, interface.b].map(|(g, side)| {
            let grid = &self.mesh.grids[g];
            Face { part: grid.part, block: Some(grid.block), side }
        });
        let covers = |place: &Place, face: Face| match place {
            Place::Part(p) => *p == face.part,
            Place::Face(f) => f.part == face.part && f.side == face.side && f.block.is_none_or(|b| Some(b) == face.block),
            Place::Node(_) => false,
        };
        let is_specific = |c: &Contact| c.between.iter().any(|p| matches!(p, Place::Face(_)));
        let (specific, general): (Vec<&Contact>, Vec<&Contact>) = self.machine.contacts.iter().partition(|c| is_specific(c));
        specific.into_iter().chain(general).find_map(|c| {
            let straight = covers(&c.between[0], faces[0]) && covers(&c.between[1], faces[1]);
            let crossed = covers(&c.between[0], faces[1]) && covers(&c.between[1], faces[0]);
            (straight || crossed).then_some((c, crossed && !straight))
        })
    }

    /// Joints where blocks touch.
    fn interfaces(&mut self) -> Result<()> {
        // Interfaces that share a contact form one group: sort them by the contact they belong to.
        let mut named: Vec<Vec<(usize, bool)>> = vec![Vec::new(); self.machine.contacts.len()];
        let mut unnamed: Vec<((usize, usize), Vec<(usize, bool)>)> = Vec::new();
        for (i, interface) in self.mesh.interfaces.iter().enumerate() {
            let (pa, pb) = (self.mesh.grids[interface.a.0].part, self.mesh.grids[interface.b.0].part);
            if let Some((contact, crossed)) = self.covering(interface) {
                let index = self.machine.contacts.iter().position(|c| c.name == contact.name).unwrap_or(0);
                named[index].push((i, crossed));
            } else if pa == pb {
                for joint in self.joints_of(interface, false, NONE) {
                    self.network.joints.push(joint);
                }
            } else {
                let (key, crossed) = ((pa.min(pb), pa.max(pb)), pa > pb);
                match unnamed.iter_mut().find(|(k, _)| *k == key) {
                    Some((_, list)) => list.push((i, crossed)),
                    None => unnamed.push((key, vec![(i, crossed)])),
                }
            }
        }
        for (index, list) in named.into_iter().enumerate() {
            let contact = &self.machine.contacts[index];
            if list.is_empty() {
                let stated = contact.area.is_some() || contact.between.iter().any(|p| matches!(p, Place::Node(_)));
                if !stated {
                    return Err(Error::input(format!("the contact '{}' joins faces that do not touch", contact.name))
                        .at_line(contact.line)
                        .at_key(format!("contact.{}", contact.name))
                        .help("move the parts together, or give the contact an area to join them all the same"));
                }
                continue; // joined by its stated area later
            }
            let true_area: f64 = list.iter().map(|(i, _)| self.mesh.interfaces[*i].area()).sum();
            let scale = match (&contact.law, contact.area) {
                (ContactLaw::Total(_), _) | (_, None) => 1.0,
                (_, Some(stated)) => stated / true_area,
            };
            let names = contact.between.map(|p| self.place_name(p));
            self.group(contact.name.clone(), contact.law.clone(), names, true_area, scale, &list, false);
        }
        let default = self.machine.default_contact.clone().unwrap_or(ContactLaw::Bonded);
        for ((pa, pb), list) in unnamed {
            let area = list.iter().map(|(i, _)| self.mesh.interfaces[*i].area()).sum();
            let names = [pa, pb].map(|p| self.machine.parts[p].name.clone());
            let name = format!("{} | {}", names[0], names[1]);
            self.group(name, default.clone(), names, area, 1.0, &list, true);
        }
        Ok(())
    }

    #[allow(clippy::too_many_arguments)]
    fn group(
        &mut self,
        name: String,
        law: ContactLaw,
        between: [String; 2],
        area: f64,
        scale: f64,
        interfaces: &[(usize, bool)],
        unnamed: bool,
    ) {
        let start = self.network.joints.len();
        let contact = self.network.contacts.len() as u32;
        for (i, crossed) in interfaces {
            let joints = self.joints_of(&self.mesh.interfaces[*i], *crossed, contact);
            self.network.joints.extend(joints);
        }
        let joints = start..self.network.joints.len();
        self.network.contacts.push(ContactGroup { name, law, between, area, scale, joints, unnamed });
    }

    /// Joints of one interface, from its first side to its second (or crossed).
    fn joints_of(&self, interface: &Interface, crossed: bool, contact: u32) -> Vec<Joint> {
        let ((ga, sa), (gb, sb)) = (interface.a, interface.b);
        let (grid_a, grid_b) = (&self.mesh.grids[ga], &self.mesh.grids[gb]);
        let (property_a, property_b) = (self.property(grid_a.part, sa.axis()), self.property(grid_b.part, sb.axis()));
        let joint = |o: &crate::mesh::overlap::Overlap| {
            let (length_a, length_b) = (grid_a.half_length(grid_a.indices(o.a), sa), grid_b.half_length(grid_b.indices(o.b), sb));
            let (a, b) = (o.a as u32, o.b as u32);
            if crossed {
                let (length_a, length_b, property_a, property_b) = (length_b, length_a, property_b, property_a);
                Joint { a: b, b: a, area: o.area, length_a, length_b, property_a, property_b, contact }
            } else {
                Joint { a, b, area: o.area, length_a, length_b, property_a, property_b, contact }
            }
        };
        interface.overlaps.iter().map(joint).collect()
    }

    fn place_name(&self, place: Place) -> String {
        match place {
            Place::Part(p) => self.machine.parts[p].name.clone(),
            Place::Face(f) => self.machine.parts[f.part].name.clone(),
            Place::Node(n) => self.machine.nodes[n].name.clone(),
        }
    }

    /// The nodes of a place with their share of `area` (of its own area where `None`).
    fn feet(&self, place: Place, area: Option<f64>, key: &str) -> Result<Vec<Foot>> {
        let faces: Vec<Face> = match place {
            Place::Node(n) => {
                let area = area.ok_or_else(|| {
                    Error::input("a lumped node has no faces of its own")
                        .at_key(key)
                        .help("state the area, for example area = \"0.0143 m2\"")
                })?;
                return Ok(vec![(self.lumped(n), area, 0.0, NONE)]);
            }
            place => faces_of(place),
        };
        let gather = |open: bool| {
            let mut cells: Vec<Foot> = Vec::new();
            for face in &faces {
                for (g, c, a) in if open { self.mesh.open_cells(*face) } else { self.mesh.face_cells(*face) } {
                    let grid = &self.mesh.grids[g];
                    let property = self.property(grid.part, face.side.axis());
                    cells.push((grid.cell(c) as u32, a, grid.half_length(c, face.side), property));
                }
            }
            cells
        };
        // A face that is covered altogether (a plate under a motor) is still a place to join a node to.
        let open = gather(true);
        let mut cells = if open.is_empty() { gather(false) } else { open };
        let total: f64 = cells.iter().map(|c| c.1).sum();
        if total <= 0.0 {
            return Err(Error::input(format!("'{}' has no open face here", self.place_name(place)))
                .at_key(key)
                .help("name a face that is not covered by another part"));
        }
        let factor = area.map_or(1.0, |a| a / total);
        for foot in &mut cells {
            foot.1 *= factor;
        }
        Ok(cells)
    }

    /// Contacts joined by a stated area: to lumped nodes, or between places that do not touch.
    fn stated_contacts(&mut self) -> Result<()> {
        for contact in &self.machine.contacts {
            if self.network.contacts.iter().any(|c| c.name == contact.name) {
                continue;
            }
            let key = format!("contact.{}", contact.name);
            let is_node = contact.between.map(|p| matches!(p, Place::Node(_)));
            // Where only one side is a node, the other side's own area may serve.
            let own = |place: Place| -> Result<f64> { Ok(self.feet(place, None, &key)?.iter().map(|f| f.1).sum()) };
            let area = match (contact.area, is_node) {
                (Some(area), _) => area,
                (None, [true, false]) => own(contact.between[1])?,
                (None, [false, true]) => own(contact.between[0])?,
                (None, _) if matches!(contact.law, ContactLaw::Total(_)) => 1.0,
                (None, _) => {
                    return Err(Error::input("the area of this contact cannot be computed")
                        .at_line(contact.line)
                        .at_key(key)
                        .help("state it, for example area = \"0.0143 m2\""));
                }
            };
            let sides = [self.feet(contact.between[0], Some(area), &key)?, self.feet(contact.between[1], Some(area), &key)?];
            // What the contact covers no longer sees the chamber.
            for place in contact.between {
                if let Place::Face(face) = place {
                    let open: f64 = self.mesh.open_cells(face).iter().map(|(_, _, a)| a).sum();
                    if open > 0.0 && contact.area.is_some() {
                        self.view_left.push((face, (1.0 - area / open).max(0.0)));
                    }
                }
            }
            let start = self.network.joints.len();
            let index = self.network.contacts.len() as u32;
            let scale = if is_node[0] || is_node[1] {
                let crossed = !is_node[0];
                let (node, others) = if is_node[0] { (sides[0][0], &sides[1]) } else { (sides[1][0], &sides[0]) };
                for other in others {
                    let joint = joint_between((node.0, other.1, 0.0, NONE), *other, index);
                    self.network.joints.push(if crossed { reversed(joint) } else { joint });
                }
                1.0
            } else {
                // Two resolved places: an arithmetic node between, half of the resistance on each side.
                let middle = self.arithmetic_node();
                for foot in &sides[0] {
                    self.network.joints.push(joint_between(*foot, (middle, foot.1, 0.0, NONE), index));
                }
                2.0
            };
            let joints = start..self.network.joints.len();
            if scale == 2.0 {
                let middle = self.network.solids as u32 - 1;
                let second = self.network.contacts.len() as u32 + 1;
                for foot in &sides[1] {
                    self.network.joints.push(joint_between((middle, foot.1, 0.0, NONE), *foot, second));
                }
            }
            let between = contact.between.map(|p| self.place_name(p));
            let group = ContactGroup {
                name: contact.name.clone(),
                law: contact.law.clone(),
                between,
                area,
                scale,
                joints: joints.clone(),
                unnamed: false,
            };
            self.network.contacts.push(group.clone());
            if scale == 2.0 {
                let joints = joints.end..self.network.joints.len();
                self.network.contacts.push(ContactGroup { name: format!("{} (far side)", group.name), joints, ..group });
            }
        }
        Ok(())
    }

    /// Radiation between facing places: each side radiates to one arithmetic node between them, with
    /// half of the space resistance each; exact for two isothermal grey surfaces.
    fn radiation_links(&mut self) -> Result<()> {
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
                self.view_left.extend(faces_of(place).into_iter().map(|face| (face, 1.0 - view)));
            }
        }
        Ok(())
    }

    /// The node of a foot's surface: behind half a cell of conduction, or the node itself where it is lumped.
    fn surface_node(&mut self, (node, area, length, property): Foot) -> u32 {
        if property == NONE || length == 0.0 {
            return node;
        }
        let surface = self.arithmetic_node();
        self.network.joints.push(joint_between((node, area, length, property), (surface, area, 0.0, NONE), NONE));
        surface
    }

    fn surfaces(&mut self) -> Result<()> {
        for (p, part) in self.machine.parts.iter().enumerate() {
            let excluded = |grid: &crate::mesh::grid::Grid, side: Side| {
                part.surface.excluded.iter().any(|f| f.part == p && f.side == side && f.block.is_none_or(|b| b == grid.block))
            };
            let mut faces = Vec::new();
            for (g, grid) in self.mesh.grids_of(p) {
                for side in Side::ALL {
                    let law = self
                        .machine
                        .boundaries
                        .iter()
                        .position(|b| b.faces.iter().any(|f| f.part == p && f.side == side && f.block.is_none_or(|i| i == grid.block)));
                    let view = self
                        .view_left
                        .iter()
                        .filter(|(f, _)| f.part == p && f.side == side && f.block.is_none_or(|b| b == grid.block))
                        .map(|(_, left)| left)
                        .product::<f64>();
                    let view = if excluded(grid, side) { 0.0 } else { view };
                    faces.extend(self.mesh.open_faces(g, side).map(|(c, area)| (grid, side, c, area, law, view)));
                }
            }
            let seen: f64 = faces.iter().map(|f| f.3 * f.5).sum();
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
            for (grid, side, c, area, law, view) in faces {
                let surface = Surface {
                    node: grid.cell(c) as u32,
                    property: self.property(p, side.axis()),
                    length: grid.half_length(c, side),
                    area,
                    emissive: emissivity * area * view * factor,
                    gas_area: area * view * factor,
                    law: law.map_or(NONE, |l| l as u32),
                };
                if surface.emissive > 0.0 || surface.law != NONE || surface.gas_area > 0.0 {
                    self.network.surfaces.push(surface);
                }
            }
        }
        for (n, node) in self.machine.nodes.iter().enumerate() {
            if let Some((emissivity, effective, area)) = node.radiation {
                let emissive = self.effective(emissivity, effective, area) * area;
                let node = self.lumped(n);
                self.network.surfaces.push(Surface { node, property: NONE, length: 0.0, area, emissive, gas_area: area, law: NONE });
            }
        }
        Ok(())
    }

    fn effective(&self, emissivity: f64, effective: bool, area: f64) -> f64 {
        match self.machine.chamber.enclosure {
            Some((e_wall, area_wall)) if !effective && emissivity > 0.0 => effective_emissivity(emissivity, area, e_wall, area_wall),
            _ => emissivity,
        }
    }

    fn streams(&mut self) -> Result<()> {
        for (i, channel) in self.machine.channels.iter().enumerate() {
            let stations = path::stations(self.mesh, channel, &self.machine.parts[channel.part].name)?;
            let first_node = self.network.nodes as u32;
            self.network.nodes += stations.len();
            let circuit = self.machine.circuits.iter().position(|c| super::stream::members(&c.layout).contains(&i));
            let circuit = circuit.ok_or_else(|| {
                Error::input(format!("no circuit feeds the channel '{}'", channel.name)).at_key(format!("channel.{}", channel.name))
            })?;
            self.network.streams.push(Stream {
                name: channel.name.clone(),
                circuit,
                length: stations.iter().map(|s| s.length).sum(),
                stations,
                first_node,
                upstream: Vec::new(),
                property: self.property(channel.part, 0),
                diameter: channel.diameter,
                minor_loss: channel.minor_loss,
                roughness: channel.roughness,
                film: channel.film.clone(),
            });
        }
        for circuit in &self.machine.circuits {
            self.connect(&circuit.layout, Vec::new());
            self.network.circuits.push(CircuitTree { circuit: circuit.clone(), layout: circuit.layout.clone() });
        }
        Ok(())
    }

    /// Sets what flows into each stream below `layout`; returns the streams that flow out of it.
    fn connect(&mut self, layout: &Layout, upstream: Vec<usize>) -> Vec<usize> {
        match layout {
            Layout::Channel(s) => {
                self.network.streams[*s].upstream = upstream;
                vec![*s]
            }
            Layout::Series(items) => items.iter().fold(upstream, |above, item| self.connect(item, above)),
            Layout::Parallel(items) => items.iter().flat_map(|item| self.connect(item, upstream.clone())).collect(),
        }
    }

    fn sources(&mut self) -> Result<()> {
        for source in &self.machine.sources {
            let mut shares: Vec<(u32, f64)> = Vec::new();
            for place in &source.places {
                match place {
                    Place::Node(n) => shares.push((self.lumped(*n), 1.0)),
                    Place::Part(p) => {
                        for (_, grid) in self.mesh.grids_of(*p) {
                            shares.extend(grid.cells().map(|c| (grid.cell(c) as u32, grid.volume(c))));
                        }
                    }
                    Place::Face(face) => {
                        for (g, c, area) in self.mesh.face_cells(*face) {
                            shares.push((self.mesh.grids[g].cell(c) as u32, area));
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
            self.network.sources.push(shares);
        }
        Ok(())
    }

    fn sensors(&mut self) -> Result<()> {
        for sensor in &self.machine.sensors {
            let key = || format!("sensor.{}", sensor.name);
            let term = match &sensor.reads {
                Reading::Node(n) => SensorTerm { weights: vec![(self.lumped(*n), 1.0)], inlet: None },
                Reading::Point(part, point) => {
                    let grid = self.mesh.grid_at(*part, *point, 1e-6).ok_or_else(|| {
                        Error::input(format!("the sensor '{}' lies outside '{}'", sensor.name, self.machine.parts[*part].name))
                            .at_key(key())
                            .help("move the point inside the part")
                    })?;
                    let weights = self.mesh.grids[grid].interpolate(*point);
                    SensorTerm { weights: weights.into_iter().map(|(c, w)| (c as u32, w)).collect(), inlet: None }
                }
                Reading::PartMean(p) => {
                    let volume = self.mesh.volume(*p);
                    let cells = self.mesh.grids_of(*p).flat_map(|(_, g)| g.cells().map(move |c| (g.cell(c) as u32, g.volume(c) / volume)));
                    SensorTerm { weights: cells.collect(), inlet: None }
                }
                Reading::FaceMean(face) => {
                    let cells = self.mesh.face_cells(*face);
                    let area: f64 = cells.iter().map(|c| c.2).sum();
                    if area <= 0.0 {
                        return Err(Error::input("this face has no area").at_key(key()));
                    }
                    let mut weights = Vec::new();
                    for (g, c, a) in cells {
                        weights.extend(self.mesh.grids[g].surface_weights(c, face.side).into_iter().map(|(n, w)| (n as u32, w * a / area)));
                    }
                    SensorTerm { weights, inlet: None }
                }
                Reading::Outlet(s) => SensorTerm { weights: vec![(self.network.streams[*s].outlet(), 1.0)], inlet: None },
                Reading::Inlet(s) => {
                    let stream = &self.network.streams[*s];
                    match stream.upstream.as_slice() {
                        [] => SensorTerm { weights: Vec::new(), inlet: Some((stream.circuit, 1.0)) },
                        [one] => SensorTerm { weights: vec![(self.network.streams[*one].outlet(), 1.0)], inlet: None },
                        _ => {
                            return Err(Error::input("this channel is fed by several branches: their mixture is no single point")
                                .at_key(key())
                                .help("read the outlets of the branches instead"));
                        }
                    }
                }
            };
            self.network.sensors.push(term);
            self.network.sensor_names.push(sensor.name.clone());
        }
        Ok(())
    }
}

/// The faces of a place: all six sides of a part, none of a lumped node.
fn faces_of(place: Place) -> Vec<Face> {
    match place {
        Place::Node(_) => Vec::new(),
        Place::Face(face) => vec![face],
        Place::Part(part) => Side::ALL.map(|side| Face { part, block: None, side }).to_vec(),
    }
}

/// A joint from one foot to another, over the area of the first.
fn joint_between(a: Foot, b: Foot, contact: u32) -> Joint {
    Joint { a: a.0, b: b.0, area: a.1, length_a: a.2, length_b: b.2, property_a: a.3, property_b: b.3, contact }
}

/// The same joint, counted the other way.
fn reversed(j: Joint) -> Joint {
    Joint {
        a: j.b,
        b: j.a,
        area: j.area,
        length_a: j.length_b,
        length_b: j.length_a,
        property_a: j.property_b,
        property_b: j.property_a,
        contact: j.contact,
    }
}
