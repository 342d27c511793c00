//! Measurement points: each is a node that CalculiX prints.

use serde::Serialize;

use super::bodies::{DeckBodies, add as add_weight};
use super::deck::{Deck, NodeWeights};
use super::lumped::DeckNodes;
use super::water::Ends;
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::{Sensor, SensorReading};
use coldplate_solve::meshed::MeshedMachine;

/// Most nodes that a mean may be taken over, a count: each is joined to each in the matrix. Chosen: size of the matrix against sensors
/// that are refused.
const MOST_NODES: usize = 1000;
/// Area of the element whose corner a sensor is, m². Chosen; nothing flows through it.
const AREA: f64 = 1e-6;

/// A sensor in the results.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DeckPoint {
    /// Name of the sensor.
    pub sensor: String,
    /// The node that has its temperature.
    pub node: u32,
}

/// Adds the measurement points, in the machine's order, without displacements: the deck is one of temperatures.
///
/// # Errors
/// A sensor reads a quantity or place that the deck does not have.
pub(super) fn add(
    model: &MeshedMachine,
    bodies: &DeckBodies<'_>,
    water: &[Ends],
    lumped: &DeckNodes,
    deck: &mut Deck,
) -> Result<Vec<DeckPoint>> {
    let point = |sensor: &Sensor| {
        let node = match &sensor.reads {
            SensorReading::Inlet(s) => water[*s].inlet,
            SensorReading::Outlet(s) => water[*s].outlet,
            SensorReading::Node(n) => {
                let own = lumped.get((model.mesh.cells + n) as u32);
                own.ok_or_else(|| not_there(sensor, "a node that is not in the deck"))?.0
            }
            solid => {
                let (at, weights) = place(model, bodies, sensor, solid)?;
                if weights.len() > MOST_NODES {
                    return Err(Error::input(format!("the sensor '{}' reads the mean of {} nodes", sensor.name, weights.len()))
                        .at_key(format!("sensor.{}", sensor.name))
                        .read(format!("{MOST_NODES} at most, since each is joined to each"))
                        .help("ask for fewer --cells, or read a point"));
                }
                deck.place(at, AREA, &weights).1
            }
        };
        Ok(DeckPoint { sensor: sensor.name.clone(), node })
    };
    model.machine.sensors.iter().filter(|sensor| !sensor.reads.is_displacement()).map(point).collect()
}

/// Place of a sensor, and the nodes that it reads.
fn place(model: &MeshedMachine, bodies: &DeckBodies<'_>, sensor: &Sensor, reads: &SensorReading) -> Result<([f64; 3], NodeWeights)> {
    let mesh = &model.mesh;
    let mut weights = NodeWeights::new();
    let mut add = |share: f64, own: NodeWeights| own.into_iter().for_each(|(node, weight)| add_weight(&mut weights, node, weight * share));
    let at = match reads {
        SensorReading::Point(part, point) => {
            let g = mesh.grid_at(*part, *point, 1e-6).ok_or_else(|| not_there(sensor, "a point outside of its part"))?;
            add(1.0, bodies.at(g, mesh.grids[g].locate(*point), *point));
            *point
        }
        SensorReading::FaceMean(face) => {
            let cells = mesh.face_cells(*face);
            let area: f64 = cells.iter().map(|c| c.2).sum();
            for (g, c, own) in &cells {
                add(own / area, bodies.face_mean(*g, *c, face.side));
            }
            model.machine.parts[face.part].origin()
        }
        SensorReading::PartMean(part) => {
            let volume = mesh.volume(*part);
            for (g, grid) in mesh.grids_of(*part) {
                for c in grid.cells() {
                    add(grid.volume(c) / volume, bodies.mean(g, c));
                }
            }
            model.machine.parts[*part].origin()
        }
        SensorReading::Node(_) | SensorReading::Inlet(_) | SensorReading::Outlet(_) | SensorReading::Displacement(_) => {
            return Err(not_there(sensor, "no place in a part"));
        }
    };
    Ok((at, weights))
}

fn not_there(sensor: &Sensor, what: &str) -> Error {
    Error::input(format!("the sensor '{}' reads {what}", sensor.name))
        .at_key(format!("sensor.{}", sensor.name))
        .help("read a point, a face or a part")
}
