//! Machine and mesh become a network.

mod contacts;
mod enclosure;
mod joints;
mod tetra;
mod views;

use std::collections::HashMap;

use super::block::Gap;
use super::stream::{CircuitTree, Stream};
use super::{Block, HeatSource, NONE, Network, SensorTerm, Surface};
use crate::describe::machine::Property;
use crate::describe::machine::{BoundaryLaw, Face, Layout, Machine, Place, Reading, Side};
use crate::discretise::mesh::grid::Grid;
use crate::discretise::mesh::{Mesh, path};
use crate::error::{Error, Result};
use crate::physics::radiation::effective_emissivity;

impl Network {
    /// Compiles `machine` on `mesh`.
    ///
    /// # Errors
    /// A contact, source, sensor or channel of the machine has nothing to attach to on this geometry.
    pub fn build(machine: &Machine, mesh: &Mesh) -> Result<Self> {
        let mut builder = Builder { machine, mesh, network: Network::default(), view_left: vec![], enclosed: HashMap::new() };
        builder.nodes();
        builder.blocks();
        builder.edges();
        builder.interfaces()?;
        builder.stated_contacts()?;
        builder.radiation_links()?;
        builder.enclosures()?;
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
    /// Cell faces (grid, side, cell) in enclosures: the node of the surface and the share of its view that is the
    /// chamber.
    enclosed: HashMap<(usize, usize, usize), (u32, f64)>,
}

/// A node of a place with its share, and the half cell in front of it: (node, area, length, property).
type Foot = (u32, f64, f64, u32);

impl Builder<'_> {
    fn nodes(&mut self) {
        let net = &mut self.network;
        net.groups = self.machine.parts.iter().map(|p| &p.name).chain(self.machine.nodes.iter().map(|n| &n.name)).cloned().collect();
        // Three conductivities per material, one per local axis.
        net.properties = self.machine.materials.iter().flat_map(|m| m.conductivity.iter().cloned()).collect();
        let relative = |part: &crate::describe::machine::Part| {
            let c = &self.machine.materials[part.material].specific_heat;
            match c {
                Property::Constant(_) => Property::Constant(1.0),
                Property::Table(table) => Property::Table(table.iter().map(|(t, v)| (*t, v / c.at(300.0))).collect()),
            }
        };
        net.relative_capacity = self.machine.parts.iter().map(relative).collect();
        net.relative_capacity.resize(net.groups.len(), Property::Constant(1.0));
        net.capacity = vec![0.0; self.mesh.cells];
        net.group = vec![0; self.mesh.cells];
        for grid in &self.mesh.grids {
            let material = &self.machine.materials[self.machine.parts[grid.part].material];
            // At 300 K; the group's relative capacity says how it changes.
            let volumetric = material.density * material.specific_heat.at(300.0);
            for (i, c) in grid.cells().enumerate() {
                net.capacity[grid.first + i] = volumetric * grid.volume(c);
                net.group[grid.first + i] = grid.part as u32;
            }
        }
        self.vertices();
        let net = &mut self.network;
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
            let cells = [0, 1, 2].map(|d| grid.n(d));
            let wraps = grid.wraps(1) && cells[1] > 2;
            // Widths along the second and third axis are uniform, so one line of cells stands for all.
            let faces = [0, 1, 2].map(|d| {
                let (low, high) = (Side::ALL[2 * d], Side::ALL[2 * d + 1]);
                let gap = |i: usize| {
                    let c = [i, 0, 0];
                    let mut next = c;
                    next[d] += 1;
                    if next[d] == cells[d] {
                        if !(d == 1 && wraps) {
                            return Gap::default();
                        }
                        next[d] = 0;
                    }
                    Gap { area: grid.face_area(c, high), length_a: grid.half_length(c, high), length_b: grid.half_length(next, low) }
                };
                (0..cells[0]).map(gap).collect()
            });
            let property = [0, 1, 2].map(|d| self.property(grid.part, d));
            self.network.blocks.push(Block { first: grid.first, cells, wraps, property, faces });
        }
    }

    fn surfaces(&mut self) -> Result<()> {
        for (p, part) in self.machine.parts.iter().enumerate() {
            let excluded = |grid: &Grid, side: Side| {
                part.surface.excluded.iter().any(|f| f.part == p && f.side == side && f.block.is_none_or(|b| b == grid.block))
            };
            let mut faces = Vec::new();
            for (g, grid) in self.mesh.grids_of(p) {
                for side in Side::ALL {
                    let law = self.law_on(grid, side);
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
                    faces.extend(self.mesh.open_faces(g, side).map(|(c, area)| {
                        let enclosed = self.enclosed.get(&(g, side as usize, grid.cell(c))).copied();
                        (grid, side, c, area, law, if enclosed.is_some() { 0.0 } else { view }, enclosed)
                    }));
                }
            }
            let vertices = self.vertex_surfaces(p);
            let seen: f64 = faces.iter().map(|f| f.3 * f.5).chain(vertices.iter().map(|v| v.1 * v.3)).sum();
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
            for (grid, side, c, area, law, view, enclosed) in faces {
                let is_held = enclosed.is_some() && law.is_some_and(|l| self.holds(l));
                let law = if is_held { NONE } else { law.map_or(NONE, |l| l as u32) };
                let surface = match enclosed {
                    // Its surface is a node of its own, with the enclosure's radiation.
                    Some((node, share)) => Surface { node, property: NONE, length: 0.0, area, emissive: 0.0, gas_area: area * share, law },
                    None => Surface {
                        node: grid.cell(c) as u32,
                        property: self.property(p, side.axis()),
                        length: grid.half_length(c, side),
                        area,
                        emissive: emissivity * area * view * factor,
                        gas_area: area * view * factor,
                        law,
                    },
                };
                self.push_surface(surface);
            }
            for vertex in vertices {
                if let Some(surface) = self.vertex_surface(vertex, emissivity, factor) {
                    self.push_surface(surface);
                }
            }
        }
        for (b, boundary) in self.machine.boundaries.iter().enumerate() {
            if let Some(exposed) = boundary.node {
                let node = self.lumped(exposed.node);
                let law = b as u32;
                self.push_surface(Surface { node, property: NONE, length: 0.0, area: exposed.area, emissive: 0.0, gas_area: 0.0, law });
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

    /// The boundary that acts on a side of a grid.
    fn law_on(&self, grid: &Grid, side: Side) -> Option<usize> {
        let acts = |f: &Face| f.part == grid.part && f.side == side && f.block.is_none_or(|b| b == grid.block);
        self.machine.boundaries.iter().position(|b| b.faces.iter().any(acts))
    }

    /// Whether a boundary prescribes a temperature.
    fn holds(&self, boundary: usize) -> bool {
        matches!(self.machine.boundaries[boundary].law, BoundaryLaw::Temperature(_))
    }

    /// Where the load lists the temperature of a boundary among those of held nodes: after the lumped nodes and the
    /// chamber.
    fn held_by(&self, boundary: usize) -> u32 {
        (self.machine.nodes.len() + 1 + boundary) as u32
    }

    /// Keeps a surface through which anything leaves.
    fn push_surface(&mut self, surface: Surface) {
        let gas = surface.gas_area > 0.0 && self.machine.chamber.pressure > 0.0;
        if surface.emissive > 0.0 || surface.law != NONE || gas {
            self.network.surfaces.push(surface);
        }
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
            let circuit = self.machine.circuits.iter().position(|c| crate::discretise::network::stream::members(&c.layout).contains(&i));
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
                film_factor: channel.film_factor,
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
                        if let Some(tetra) = self.mesh.tetra_of(*p) {
                            shares.extend(tetra.volumes.iter().enumerate().map(|(i, v)| ((tetra.first + i) as u32, *v)));
                        }
                    }
                    Place::Face(face) => {
                        for (g, c, area) in self.mesh.face_cells(*face) {
                            shares.push((self.mesh.grids[g].cell(c) as u32, area));
                        }
                        if let Some(tetra) = self.mesh.tetra_of(face.part) {
                            shares.extend(self.vertex_areas(tetra, *face, false).into_iter().map(|foot| (foot.0, foot.1)));
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

    fn sensors(&mut self) -> Result<()> {
        for sensor in &self.machine.sensors {
            let key = || format!("sensor.{}", sensor.name);
            let term = match &sensor.reads {
                Reading::Node(n) => SensorTerm { weights: vec![(self.lumped(*n), 1.0)], inlet: None },
                Reading::Point(part, point) if self.mesh.tetra_of(*part).is_some() => {
                    let weights = self.mesh.tetra_of(*part).and_then(|t| t.interpolate(*point)).ok_or_else(|| {
                        Error::input(format!("the sensor '{}' lies outside '{}'", sensor.name, self.machine.parts[*part].name))
                            .at_key(key())
                            .help("move the point inside the part; its coordinates are those of the mesh file, in SI or with their unit")
                    })?;
                    SensorTerm { weights: weights.map(|(c, w)| (c as u32, w)).to_vec(), inlet: None }
                }
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
                    let vertices = self.mesh.tetra_of(*p).into_iter();
                    let vertices =
                        vertices.flat_map(|t| t.volumes.iter().enumerate().map(move |(i, v)| ((t.first + i) as u32, v / volume)));
                    SensorTerm { weights: cells.chain(vertices).collect(), inlet: None }
                }
                Reading::FaceMean(face) => {
                    let cells = self.mesh.face_cells(*face);
                    let vertices = self.mesh.tetra_of(face.part).map_or_else(Vec::new, |t| self.vertex_areas(t, *face, false));
                    let area: f64 = cells.iter().map(|c| c.2).chain(vertices.iter().map(|v| v.1)).sum();
                    if area <= 0.0 {
                        return Err(Error::input("this face has no area").at_key(key()));
                    }
                    let mut weights: Vec<(u32, f64)> = vertices.iter().map(|v| (v.0, v.1 / area)).collect();
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
