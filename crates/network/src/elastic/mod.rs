//! Thermal displacement: linear thermo-elasticity on the blocks of the machine.
//!
//! If expansion and stiffness do not depend on temperature, the displacement of a point along a direction is a weighted sum of the
//! temperatures of the cells. Each displacement sensor therefore costs one elastic solution, when the network is built. With unit
//! forces at the point and against its counterpart, the displacements everywhere are the forces by which expansion anywhere moves the
//! point (Maxwell and Betti). The weight of a cell is the work of its expansion on these displacements.

mod bodies;
mod element;
mod known;
mod matrix;
mod nodes;
mod solver;

use std::sync::Arc;

use nalgebra::{SVector, Vector3};
use rayon::prelude::*;

use crate::mesh::Mesh;
use crate::mesh::grid::Grid;
use crate::mesh::tetra::touch::Other;
use bodies::ElasticBodies;
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::{Contact, Displacement, JointKind, Machine, SensorReading};
use element::{ElasticConstants, Expansion, Stiffness, brick, locate, shapes};
use matrix::{Matrix, NodeVectors};
use nodes::Nodes;
use solver::ElasticSolver;

/// Corners of cells along an axis of a box of the coarse level, a count; more where there would be too many boxes. Chosen: size of the
/// coarse level against iterations.
const BOX: usize = 3;
/// Most boxes, a count; above it they are made larger. Chosen: cost of the coarse level against iterations.
const MOST_BOXES: usize = 2500;

/// Weights of a displacement sensor over the temperatures of cells.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorWeights {
    /// Displacement per kelvin of each cell's warming, m/K.
    pub cells: Vec<(u32, f64)>,
    /// Iterations of the solution.
    pub iterations: usize,
}

/// The weights of every displacement sensor, in the machine's order.
///
/// # Errors
/// A part has no expansion or stiffness, or a shape that is not solved for; nothing holds the machine; the solution fails.
pub fn weights(machine: &Machine, thermal: &Mesh) -> Result<Arc<Vec<SensorWeights>>> {
    let wanted: Vec<&Displacement> =
        machine.sensors.iter().filter_map(|s| if let SensorReading::Displacement(own) = &s.reads { Some(own) } else { None }).collect();
    if wanted.is_empty() {
        return Ok(Arc::default());
    }
    known::or_solve(known::key(machine, thermal), || {
        let mesh = nodes::mesh(machine, thermal)?;
        Structure::new(machine, &mesh, &wanted)?.weights(thermal, &wanted)
    })
}

/// Cells, corners and stiffness of the blocks connected with the points whose displacement is asked for.
struct Structure<'a> {
    mesh: &'a Mesh,
    nodes: Nodes<'a>,
    bodies: ElasticBodies,
    /// Material of each part; zero for parts outside the structure.
    solids: Vec<ElasticConstants>,
    /// Number in the matrix of each corner; [`ABSENT`] where it takes no part.
    rows: Vec<u32>,
    solver: ElasticSolver,
}

/// Marks corners of grids that take no part.
const ABSENT: u32 = u32::MAX;

impl<'a> Structure<'a> {
    fn new(machine: &Machine, mesh: &'a Mesh, wanted: &[&Displacement]) -> Result<Self> {
        let mut nodes = Nodes::new(mesh);
        let points = wanted.iter().flat_map(|d| std::iter::once((d.of, d.line)).chain(d.relative_to.map(|other| (other, d.line))));
        let grids = points.map(|((part, point), line)| grid_at(machine, mesh, part, point, line)).collect::<Result<Vec<_>>>()?;
        // The material of parts that take part is asked for below.
        let moduli: Vec<f64> = machine.parts.iter().map(|p| machine.materials[p.material].elastic.modulus.unwrap_or(1.0)).collect();
        let bodies = ElasticBodies::new(machine, mesh, &mut nodes, &grids, &moduli)?;
        no_imports(machine, mesh, &bodies)?;
        let takes_part = |part: usize| mesh.grids.iter().enumerate().any(|(g, grid)| grid.part == part && bodies.has(g));
        let solids = (0..machine.parts.len()).map(|part| if takes_part(part) { solid(machine, mesh, part) } else { Ok(NOTHING) });
        let solids = solids.collect::<Result<Vec<_>>>()?;
        let numbered = number(mesh, &nodes, &bodies);
        let held: Vec<[bool; 3]> = {
            let mut held = vec![[false; 3]; numbered.points.len()];
            for (node, row) in numbered.rows.iter().enumerate().filter(|(_, row)| **row != ABSENT) {
                (0..3).for_each(|d| held[*row as usize][d] |= bodies.held[node][d]);
            }
            held
        };
        let mut matrix = assemble(mesh, &nodes, &bodies, &solids, &numbered)?;
        let loose = || Error::input("nothing holds a part of the structure").at_key("support").help("add [support.NAME] with its faces");
        matrix.hold(&held);
        let solver = ElasticSolver::new(matrix.finished().ok_or_else(loose)?, &numbered.boxes, &numbered.points, &held)?;
        Ok(Self { mesh, nodes, bodies, solids, rows: numbered.rows, solver })
    }

    fn weights(&self, thermal: &Mesh, wanted: &[&Displacement]) -> Result<Vec<SensorWeights>> {
        // A displacement opposite to another one has its weights with the other sign.
        let is_solved = |i: usize| !wanted[..i].iter().any(|other| is_turned(wanted[i], other));
        let turned = |i: usize| (0..i).find(|j| is_turned(wanted[i], wanted[*j]) && is_solved(*j));
        let own: Vec<Option<SensorWeights>> = (wanted.par_iter().enumerate())
            .map(|(i, displacement)| {
                if turned(i).is_some() {
                    return Ok(None);
                }
                let (field, iterations) = self.solver.solve(&self.forces(displacement))?;
                Ok(Some(SensorWeights { cells: self.pull(thermal, &field), iterations }))
            })
            .collect::<Result<_>>()?;
        let of = |i: usize| match turned(i).map(|other| &own[other]) {
            Some(Some(other)) => {
                Some(SensorWeights { cells: other.cells.iter().map(|(cell, weight)| (*cell, -weight)).collect(), iterations: 0 })
            }
            _ => own[i].clone(),
        };
        Ok((0..wanted.len()).filter_map(of).collect())
    }

    /// Unit forces at the point along its direction, and against it at the counterpart, N.
    fn forces(&self, displacement: &Displacement) -> NodeVectors {
        let mut forces = vec![Vector3::zeros(); self.solver.len()];
        let ends = [Some((displacement.of, 1.0)), displacement.relative_to.map(|other| (other, -1.0))];
        for ((part, point), sign) in ends.into_iter().flatten() {
            let Some(g) = self.mesh.grid_at(part, point, 1e-6) else { continue };
            let cell = self.mesh.grids[g].locate(point);
            let at = locate(&self.nodes.places(g, cell), point);
            for (node, share) in self.nodes.of_cell(g, cell).into_iter().zip(shapes(at)) {
                forces[self.rows[node as usize] as usize] += Vector3::from(displacement.direction) * share * sign;
            }
        }
        self.solver.free(&mut forces);
        forces
    }

    /// Work of each cell's warming on displacements, m/K.
    fn pull(&self, thermal: &Mesh, field: &NodeVectors) -> Vec<(u32, f64)> {
        let mut cells = vec![0.0; thermal.cells];
        for (g, grid) in self.mesh.grids.iter().enumerate().filter(|(g, _)| self.bodies.has(*g)) {
            let mut corners = vec![0.0; self.nodes.of_grid(g).count()];
            let first = self.nodes.at(g, [0; 3]) as usize;
            // A grid of boxes has cells of one size: one brick stands for all.
            let shared = self.brick(g, [0; 3]).ok();
            for c in grid.cells() {
                let own = if is_uniform(grid) { None } else { self.brick(g, c).ok() };
                let Some((_, expansion)) = own.as_ref().or(shared.as_ref()) else { continue };
                let nodes = self.nodes.of_cell(g, c);
                let moved = SVector::<f64, 24>::from_fn(|i, _| field[self.rows[nodes[i / 3] as usize] as usize][i % 3]);
                let pulled = expansion.transpose() * moved;
                (0..8).for_each(|i| corners[nodes[i] as usize - first] += pulled[i]);
            }
            for (node, at) in self.nodes.of_grid(g) {
                let weight = corners[node as usize - first];
                for (cell, share) in thermal.grids[g].interpolate(self.nodes.place(g, at)) {
                    cells[cell] += weight * share;
                }
            }
        }
        cells.into_iter().enumerate().filter(|(_, weight)| *weight != 0.0).map(|(cell, weight)| (cell as u32, weight)).collect()
    }

    fn brick(&self, g: usize, c: [usize; 3]) -> Result<(Stiffness, Expansion)> {
        brick(&self.nodes.places(g, c), &self.solids[self.mesh.grids[g].part])
    }
}

/// Material of parts outside the structure: zero.
const NOTHING: ElasticConstants = ElasticConstants { modulus: 0.0, poisson: 0.0, expansion: 0.0 };

/// Whether two displacements are of the same points, in opposite senses.
fn is_turned(a: &Displacement, b: &Displacement) -> bool {
    a.of == b.of && a.relative_to == b.relative_to && a.direction == b.direction.map(|x| -x)
}

/// Whether all cells of a grid have one size and shape.
fn is_uniform(grid: &Grid) -> bool {
    !grid.is_cylindrical()
}

/// The grid that a point lies in.
fn grid_at(machine: &Machine, mesh: &Mesh, part: usize, point: [f64; 3], line: usize) -> Result<usize> {
    let own = &machine.parts[part];
    if own.import.is_some() {
        return Err(imported(&own.name).at_line(line));
    }
    mesh.grid_at(part, point, 1e-6).ok_or_else(|| {
        Error::input(format!("no block of '{}' is where the displacement is asked for", own.name))
            .at_line(line)
            .help("move the point inside the part")
    })
}

/// Refuses imported parts that carry blocks of the structure, or are carried by them.
fn no_imports(machine: &Machine, mesh: &Mesh, bodies: &ElasticBodies) -> Result<()> {
    for touch in &mesh.touches {
        let Other::Grid(g, _) = touch.other else { continue };
        let both = [mesh.tetra[touch.tetra].part, mesh.grids[g].part];
        let is_open = |contact: &Contact| {
            contact.joint == JointKind::Open && both.iter().all(|part| contact.between.iter().any(|place| place.part() == Some(*part)))
        };
        if bodies.has(g) && !machine.contacts.iter().any(is_open) {
            return Err(imported(&machine.parts[both[0]].name));
        }
    }
    Ok(())
}

fn imported(name: &str) -> Error {
    Error::input(format!("'{name}' is an imported mesh, and displacements are solved on blocks alone"))
        .at_key(format!("part.{name}.mesh"))
        .help("describe it by blocks, or let its contacts have joint = \"open\" where it carries nothing")
}

/// Material of a part.
fn solid(machine: &Machine, mesh: &Mesh, part: usize) -> Result<ElasticConstants> {
    let own = &machine.parts[part];
    if mesh.grids_of(part).any(|(_, grid)| grid.is_spherical()) {
        return Err(Error::input(format!("'{}' is a sphere, and displacements are solved on boxes and cylinders", own.name))
            .at_key(format!("part.{}.sphere", own.name))
            .help("describe it by a cylinder or a box of the same volume"));
    }
    let material = &machine.materials[own.material];
    let wanted = |value: Option<f64>, key: &str, example: &str| {
        value.ok_or_else(|| {
            Error::input(format!("'{}' has no {key}, which the displacement of '{}' needs", material.name, own.name))
                .at_key(format!("material.{}.{key}", material.name))
                .help(format!(
                    "write {key} = {example} into [material.{:?}], with base = {:?} if it is of the library",
                    material.name, material.name
                ))
        })
    };
    let elastic = &material.elastic;
    Ok(ElasticConstants {
        modulus: wanted(elastic.modulus, "youngs_modulus", "\"210 GPa\"")?,
        poisson: wanted(elastic.poisson, "poisson_ratio", "0.3")?,
        expansion: wanted(elastic.expansion, "expansion", "\"11.5e-6 1/K\"")?,
    })
}

/// Corners in the order of the matrix.
struct Numbered {
    /// Row of each corner, or [`ABSENT`].
    rows: Vec<u32>,
    /// Place of each row's corner, m.
    points: Vec<[f64; 3]>,
    /// Box of each row.
    boxes: Vec<u32>,
}

/// Numbers the corners of grids that take part, and puts them into boxes.
fn number(mesh: &Mesh, nodes: &Nodes<'_>, bodies: &ElasticBodies) -> Numbered {
    let mut found = Numbered { rows: vec![ABSENT; nodes.len()], points: Vec::new(), boxes: Vec::new() };
    let taking_part = || (0..mesh.grids.len()).filter(|g| bodies.has(*g));
    let counts = |g: usize, size: usize| [0, 1, 2].map(|d| (mesh.grids[g].n(d) + 1).div_ceil(size));
    let size = (BOX..).find(|size| {
        taking_part().map(|g| counts(g, *size).iter().product::<usize>()).sum::<usize>() <= MOST_BOXES.max(taking_part().count())
    });
    let size = size.unwrap_or(BOX);
    let mut numbers: std::collections::HashMap<(usize, [usize; 3]), u32> = std::collections::HashMap::new();
    for g in taking_part() {
        let most = counts(g, size);
        for (node, at) in nodes.of_grid(g) {
            let root = nodes.root(node) as usize;
            if found.rows[root] == ABSENT {
                // Boxes of nearly one size, none of them a thin rest.
                let own = [0, 1, 2].map(|d| at[d] * most[d] / (mesh.grids[g].n(d) + 1));
                let next = numbers.len() as u32;
                found.boxes.push(*numbers.entry((g, own)).or_insert(next));
                found.rows[root] = found.points.len() as u32;
                found.points.push(nodes.place(g, at));
            }
            found.rows[node as usize] = found.rows[root];
        }
    }
    found
}

/// The stiffness of cells and springs.
fn assemble(mesh: &Mesh, nodes: &Nodes<'_>, bodies: &ElasticBodies, solids: &[ElasticConstants], numbered: &Numbered) -> Result<Matrix> {
    let grids = || mesh.grids.iter().enumerate().filter(|(g, _)| bodies.has(*g));
    let row = |node: u32| numbered.rows[node as usize];
    let cells: Vec<(usize, [usize; 3], [u32; 8])> =
        grids().flat_map(|(g, grid)| grid.cells().map(move |c| (g, c, nodes.of_cell(g, c).map(row)))).collect();
    let springs: Vec<[u32; 8]> = bodies.springs.iter().map(|s| s.ends.map(|(node, _)| row(node))).collect();
    let groups = cells.iter().map(|(_, _, rows)| rows.as_slice()).chain(springs.iter().map(<[u32; 8]>::as_slice));
    let mut matrix = Matrix::coupling(numbered.points.len(), groups);
    let mut shared: Option<(usize, Stiffness)> = None;
    for (g, c, rows) in &cells {
        let stiffness = match shared {
            Some((of, stiffness)) if of == *g && is_uniform(&mesh.grids[*g]) => stiffness,
            _ => brick(&nodes.places(*g, *c), &solids[mesh.grids[*g].part])?.0,
        };
        shared = Some((*g, stiffness));
        for (i, j) in (0..64).map(|e| (e % 8, e / 8)) {
            matrix.add(rows[i], rows[j], stiffness.fixed_view::<3, 3>(3 * i, 3 * j).into_owned());
        }
    }
    for (spring, rows) in bodies.springs.iter().zip(&springs) {
        for (i, j) in (0..64).map(|e| (e % 8, e / 8)) {
            matrix.add(rows[i], rows[j], spring.stiffness * (spring.ends[i].1 * spring.ends[j].1));
        }
    }
    Ok(matrix)
}
