//! Readings of sensors. On faces and within half a cell of them a sensor reads the temperature that the solver balances there: every
//! cell face that a sensor looks at gets a node for its surface, behind half a cell of conduction.

use super::{Builder, CellFace};
use crate::SensorTerm;
use crate::elastic;
use crate::mesh::grid::Grid;
use coldplate_base::error::{Error, Result};
use coldplate_base::units::Measurand;
use coldplate_describe::machine::{Face, Sensor, SensorReading, Side};

/// A point between the outermost cells of a block and one of its faces.
struct AtFace {
    side: Side,
    /// The outermost cells beside the point, with their weights.
    cells: Vec<(usize, f64)>,
    /// Position of the point on the way from these to the face, 0 to 1.
    share: f64,
}

impl Builder<'_> {
    /// Marks the cell faces that sensors look at.
    pub(super) fn probe(&mut self) {
        for sensor in &self.machine.sensors {
            match &sensor.reads {
                SensorReading::FaceMean(face) => {
                    for (g, c, _) in self.mesh.face_cells(*face) {
                        self.probed.entry((g, face.side as usize, self.mesh.grids[g].cell(c))).or_default();
                    }
                }
                SensorReading::Point(part, point) => {
                    let Some(g) = self.mesh.grid_at(*part, *point, 1e-6) else { continue };
                    let Some(at) = at_face(&self.mesh.grids[g], *point) else { continue };
                    for (cell, _) in at.cells {
                        self.probed.entry((g, at.side as usize, cell)).or_default();
                    }
                }
                SensorReading::PartMean(_)
                | SensorReading::Node(_)
                | SensorReading::Inlet(_)
                | SensorReading::Outlet(_)
                | SensorReading::Displacement(_) => {}
            }
        }
    }

    /// The temperature of a cell's face as weights over nodes. If parts of it have no node of their own (the wall of a bore, places
    /// under imported meshes), the two cells behind it give the temperature there.
    fn face_weights(&self, (g, side, cell): CellFace, area: f64) -> Vec<(u32, f64)> {
        let nodes = self.probed.get(&(g, side, cell)).map_or(&[][..], Vec::as_slice);
        let known: f64 = nodes.iter().map(|n| n.1).sum();
        let mut weights: Vec<(u32, f64)> = nodes.iter().map(|(n, a)| (*n, a / area.max(known))).collect();
        let left = 1.0 - known / area.max(known);
        if left > 1e-9 {
            let grid = &self.mesh.grids[g];
            let behind = grid.surface_weights(grid.indices(cell), Side::ALL[side]);
            weights.extend(behind.into_iter().map(|(c, w)| (c as u32, w * left)));
        }
        weights
    }

    fn face_mean(&self, face: Face, key: String) -> Result<SensorTerm> {
        let cells = self.mesh.face_cells(face);
        let vertices = self.mesh.tetra_of(face.part).map_or_else(Vec::new, |t| self.vertex_areas(t, face, false));
        let area: f64 = cells.iter().map(|c| c.2).chain(vertices.iter().map(|v| v.1)).sum();
        if area <= 0.0 {
            return Err(Error::input("this face has no area").at_key(key));
        }
        let mut weights: Vec<(u32, f64)> = vertices.iter().map(|v| (v.0, v.1 / area)).collect();
        for (g, c, a) in cells {
            let own = self.face_weights((g, face.side as usize, self.mesh.grids[g].cell(c)), a);
            weights.extend(own.into_iter().map(|(n, w)| (n, w * a / area)));
        }
        Ok(SensorTerm::temperature(weights))
    }

    fn point(&self, sensor: &Sensor, part: usize, point: [f64; 3]) -> Result<SensorTerm> {
        let outside = |help: &str| {
            Error::input(format!("the sensor '{}' lies outside '{}'", sensor.name, self.machine.parts[part].name))
                .at_key(format!("sensor.{}", sensor.name))
                .help(help)
        };
        if let Some(tetra) = self.mesh.tetra_of(part) {
            let help = "move the point inside the part; its coordinates are those of the mesh file, in SI or with their unit";
            let weights = tetra.interpolate(point).ok_or_else(|| outside(help))?;
            return Ok(SensorTerm::temperature(weights.map(|(c, w)| (c as u32, w)).to_vec()));
        }
        let g = self.mesh.grid_at(part, point, 1e-6).ok_or_else(|| outside("move the point inside the part"))?;
        let grid = &self.mesh.grids[g];
        let Some(at) = at_face(grid, point) else {
            let weights = grid.interpolate(point).into_iter().map(|(c, w)| (c as u32, w)).collect();
            return Ok(SensorTerm::temperature(weights));
        };
        let mut weights = Vec::new();
        for (cell, w) in &at.cells {
            weights.push((*cell as u32, w * (1.0 - at.share)));
            let face = self.face_weights((g, at.side as usize, *cell), grid.face_area(grid.indices(*cell), at.side));
            weights.extend(face.into_iter().map(|(n, own)| (n, own * w * at.share)));
        }
        Ok(SensorTerm::temperature(weights))
    }

    pub(super) fn sensors(&mut self) -> Result<()> {
        let displacements = elastic::weights(self.machine, self.mesh)?;
        let mut displacements = displacements.iter();
        for sensor in &self.machine.sensors {
            let key = || format!("sensor.{}", sensor.name);
            let term = match &sensor.reads {
                SensorReading::Node(n) => SensorTerm::temperature(vec![(self.lumped(*n), 1.0)]),
                SensorReading::Point(part, point) => self.point(sensor, *part, *point)?,
                SensorReading::PartMean(p) => {
                    let volume = self.mesh.volume(*p);
                    let cells = self.mesh.grids_of(*p).flat_map(|(_, g)| g.cells().map(move |c| (g.cell(c) as u32, g.volume(c) / volume)));
                    let vertices = self.mesh.tetra_of(*p).into_iter();
                    let vertices =
                        vertices.flat_map(|t| t.volumes.iter().enumerate().map(move |(i, v)| ((t.first + i) as u32, v / volume)));
                    SensorTerm::temperature(cells.chain(vertices).collect())
                }
                SensorReading::FaceMean(face) => self.face_mean(*face, key())?,
                SensorReading::Displacement(_) => {
                    let metres = displacements.next().map_or(&[][..], |own| &own.cells);
                    let weights: Vec<(u32, f64)> = metres.iter().map(|(c, w)| (*c, Measurand::Displacement.of_si(*w))).collect();
                    let constant = -self.machine.elasticity.reference * weights.iter().map(|(_, w)| w).sum::<f64>();
                    SensorTerm { weights, inlet: None, constant }
                }
                SensorReading::Outlet(s) => SensorTerm::temperature(vec![(self.network.streams[*s].outlet(), 1.0)]),
                SensorReading::Inlet(s) => {
                    let stream = &self.network.streams[*s];
                    match stream.upstream.as_slice() {
                        [] => SensorTerm { weights: Vec::new(), inlet: Some((stream.circuit, 1.0)), ..SensorTerm::temperature(Vec::new()) },
                        [one] => SensorTerm::temperature(vec![(self.network.streams[*one].outlet(), 1.0)]),
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
            self.network.measurands.push(sensor.measurand());
        }
        Ok(())
    }
}

/// Place of a point between the outermost cells of a block and the nearest of its faces; `None` for a point farther inside.
fn at_face(grid: &Grid, point: [f64; 3]) -> Option<AtFace> {
    let local = grid.to_local(point);
    let of_side = |side: &Side| -> Option<(f64, Side)> {
        let d = side.axis();
        let last = if side.is_high() { grid.n(d) - 1 } else { 0 };
        let face = grid.edges[d][last + usize::from(side.is_high())];
        let mut at = [0; 3];
        at[d] = last;
        if grid.wraps(d) || grid.face_area(at, *side) == 0.0 {
            return None;
        }
        let share = grid.share_to_face(d, local[d], grid.centre(d, last), face);
        (share > 0.0).then_some((share, *side))
    };
    let (share, side) = Side::ALL.iter().filter_map(of_side).max_by(|a, b| a.0.total_cmp(&b.0))?;
    // The point moved inwards to the middle of the outermost cells.
    let d = side.axis();
    let last = if side.is_high() { grid.n(d) - 1 } else { 0 };
    let mut middle = local;
    middle[d] = grid.centre(d, last);
    let cells = grid.interpolate(grid.to_machine(middle)).into_iter().filter(|(cell, _)| grid.indices(*cell)[d] == last).collect();
    Some(AtFace { side, cells, share: share.min(1.0) })
}
