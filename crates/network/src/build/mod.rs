//! Machine and mesh become a network.

mod contacts;
mod enclosure;
mod joints;
mod meters;
mod sensors;
mod sources;
mod surfaces;
mod tetra;
mod views;

use std::collections::{HashMap, HashSet};

use super::block::Gap;
use super::control::ControlLoop;
use super::stream::{CircuitTree, Stream};
use super::{Block, NONE, Network};
use crate::mesh::{Mesh, path};
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::Property;
use coldplate_describe::machine::{Face, Layout, Machine, Side};

impl Network {
    /// Compiles `machine` on `mesh`.
    ///
    /// # Errors
    /// A contact, source, sensor or channel of the machine has nothing to attach to on this geometry.
    pub fn build(machine: &Machine, mesh: &Mesh) -> Result<Self> {
        let mut builder = Builder {
            machine,
            mesh,
            network: Network::default(),
            view_left: vec![],
            enclosed: HashMap::new(),
            probed: HashMap::new(),
            footed: HashMap::new(),
            bypassed: HashSet::new(),
        };
        builder.nodes();
        builder.probe();
        builder.meter_faces();
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
        builder.network.loops = ControlLoop::of(machine);
        builder.meters()?;
        Ok(builder.network)
    }
}

struct Builder<'a> {
    machine: &'a Machine,
    mesh: &'a Mesh,
    network: Network,
    /// Faces that see another surface, and the share of their view that is left for the chamber.
    view_left: Vec<(Face, f64)>,
    /// Cell faces in enclosures: the node of the surface and the share of its view that is the chamber.
    enclosed: HashMap<CellFace, (u32, f64)>,
    /// Cell faces that sensors read: the nodes of their surface, each with its area, m².
    probed: HashMap<CellFace, Vec<(u32, f64)>>,
    /// Probed cell faces at which contacts over a stated area or radiation links begin: the node of the surface.
    footed: HashMap<CellFace, u32>,
    /// Probed cell faces whose cells such contacts and links begin at all the same.
    bypassed: HashSet<CellFace>,
}

/// A face of a cell: grid, side, number of the cell.
type CellFace = (usize, usize, usize);

/// A node of a place with its share, and the half cell in front of it: (node, area, length, property).
type Foot = (u32, f64, f64, u32);

impl Builder<'_> {
    fn nodes(&mut self) {
        let net = &mut self.network;
        net.groups = self.machine.parts.iter().map(|p| &p.name).chain(self.machine.nodes.iter().map(|n| &n.name)).cloned().collect();
        // Three conductivities per material, one per local axis.
        net.properties = self.machine.materials.iter().flat_map(|m| m.conductivity.iter().cloned()).collect();
        let relative = |part: &coldplate_describe::machine::Part| {
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

    fn streams(&mut self) -> Result<()> {
        for (i, channel) in self.machine.channels.iter().enumerate() {
            let stations = path::stations(self.mesh, channel, &self.machine.parts[channel.part].name)?;
            let first_node = self.network.nodes as u32;
            self.network.nodes += stations.len();
            let circuit = self.machine.circuits.iter().position(|c| crate::stream::members(&c.layout).contains(&i));
            let circuit = circuit.ok_or_else(|| {
                Error::input(format!("no circuit feeds the channel '{}'", channel.name)).at_key(format!("channel.{}", channel.name))
            })?;
            self.network.streams.push(Stream {
                name: channel.name.clone(),
                circuit,
                length: stations.iter().map(|s| s.length).sum(),
                stations,
                water_weights: Vec::new(),
                first_node,
                upstream: Vec::new(),
                property: self.property(channel.part, 0),
                diameter: channel.diameter,
                film_factor: channel.film_factor,
                fouling_resistance: channel.fouling_resistance,
                minor_loss: channel.minor_loss,
                roughness: channel.roughness,
                film: channel.film.clone(),
            });
        }
        let mut outlets: Vec<Vec<usize>> = Vec::new();
        for circuit in &self.machine.circuits {
            let above = circuit.intake.feeders().iter().flat_map(|feeder| outlets[*feeder].clone()).collect();
            outlets.push(self.connect(&circuit.layout, above));
            self.network.circuits.push(CircuitTree { circuit: circuit.clone(), layout: circuit.layout.clone() });
        }
        Ok(())
    }

    /// Sets the streams that flow into each stream below `layout`; returns the streams that flow out of it.
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
}
