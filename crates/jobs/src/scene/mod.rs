//! The machine in three dimensions for a page: its surface, and temperatures everywhere from those of the measurement points.
//!
//! A surrogate knows the points and nothing between them. Between them the field is nearly linear in the temperatures of the points
//! and in the variables: heat is conducted, and films and radiation change with the condition alone. So the machine is solved at
//! some dozen conditions, or a reduced model gives its field at some hundred. The temperatures of its surface are written in few
//! modes (proper orthogonal decomposition), and the amplitude of each mode is fitted to what the surrogate says of the points, by
//! ridge regression. Every condition is predicted from all others, and the error of these predictions is stated. With a reduced
//! model that follows time, the amplitudes over time are fitted in the same way to the states of the surrogate.

mod field;
mod glb;
mod snapshots;
mod states;
mod surface;

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

use coldplate_base::error::{Error, Result};
use coldplate_base::progress::Progress;
use coldplate_describe::machine::{Condition, Machine};
use coldplate_explore::sweep::MACHINE_HASH;
use coldplate_reduce::ReducedModel;
use coldplate_runtime::Surrogate;
use coldplate_solve::meshed::MeshedMachine;

pub use glb::Glb;
pub use states::States;

use crate::charts::machine::place_of;
use crate::open;
use crate::reduced::meshed;
use field::{SceneField, field};
use snapshots::Snapshots;
use surface::{Surface, shares, unit};

/// The machine in three dimensions, as a page reads it. Packed numbers are little-endian, in base64.
#[derive(Debug, Serialize)]
pub struct Scene {
    #[serde(flatten)]
    shape: Shape,
    /// Channels.
    channels: Vec<SceneChannel>,
    /// Sensors that have a place.
    sensors: Vec<SceneSensor>,
    /// Temperatures everywhere.
    field: SceneField,
    /// Remarks for the reader.
    pub notes: Vec<String>,
}

/// Surface of the parts.
#[derive(Debug, Serialize)]
struct Shape {
    /// Parts with their triangles.
    parts: Vec<ScenePart>,
    /// Corner of the machine from which positions count, m.
    origin: [f64; 3],
    /// Length of a unit of the positions, m.
    step: f64,
    /// Positions of the vertices, packed `u16`, three each.
    positions: String,
    /// Normals of the vertices, packed `i8` of 127, three each.
    normals: String,
    /// Vertices of the triangles, packed `u32`, three each.
    triangles: String,
    /// Ends of the edges of blocks, packed `u32`, two each.
    edges: String,
}

#[derive(Debug, Serialize)]
struct ScenePart {
    name: String,
    /// First triangle, and number of triangles.
    first: usize,
    count: usize,
    /// First edge, and number of edges.
    first_edge: usize,
    edges: usize,
}

#[derive(Debug, Serialize)]
struct SceneChannel {
    name: String,
    part: usize,
    /// Diameter of the pipe, m.
    diameter: f64,
    /// Corners of the axis from inlet to outlet, m.
    path: Vec<[f64; 3]>,
    /// Share of the length at which the water leaves each station.
    shares: Vec<f64>,
    /// Place of the first station in the field.
    first: usize,
}

#[derive(Debug, Serialize)]
struct SceneSensor {
    name: String,
    /// Index of its part; none in the water.
    part: Option<usize>,
    at: [f64; 3],
}

/// Files that the scene of a surrogate is made of.
#[derive(Debug, Clone, Copy)]
pub struct SceneFiles<'a> {
    /// Machine file.
    pub machine: &'a Path,
    /// Changed values of the machine file, by their keys.
    pub sets: &'a [(String, String)],
    /// Reduced model of the machine with its field, which takes the place of full solutions.
    pub reduced: Option<&'a Path>,
    /// About how many cells; none for those of the machine file.
    pub cells: Option<usize>,
}

/// The machine of a surrogate as a scene.
///
/// # Errors
/// A file cannot be read; the machine lacks a variable of the surrogate or has no part; a condition cannot be solved; the reduced
/// model has no field, or is of another machine or of other ranges.
pub fn scene(files: &SceneFiles<'_>, surrogate: &Surrogate<'_>, progress: &dyn Progress) -> Result<Scene> {
    let machine = open(files.machine)?.machine(files.sets)?;
    let is_own = surrogate.provenance().all(|(key, hash)| key != MACHINE_HASH || hash == machine.hash);
    let mut scene = match files.reduced {
        None => of_machine(&MeshedMachine::new(machine, files.cells)?, surrogate, None, progress),
        Some(path) => {
            let reduced = open(path)?.reduced_model()?;
            check(&reduced, &machine, files.cells).map_err(|e| e.in_file(path))?;
            of_machine(&meshed(&reduced).map_err(|e| e.in_file(path))?, surrogate, Some(&reduced), progress)
        }
    }
    .map_err(|e| e.in_file(files.machine))?;
    if !is_own {
        scene.notes.push("The machine file is not the one that the surrogate was made of; names and limits may differ, or more.".into());
    }
    Ok(scene)
}

/// Refuses a reduced model of another machine, and a mesh beside its own.
fn check(reduced: &ReducedModel, machine: &Machine, cells: Option<usize>) -> Result<()> {
    if cells.is_some() {
        let error = Error::input("the field of a reduced model is on the mesh that it was made on").at_key("--cells");
        return Err(error.help("leave it out, or make the model with `coldplate reduce --field --cells N`"));
    }
    if reduced.machine.hash != machine.hash {
        let error = Error::input("this reduced model was made of another machine file, or of other values in it").at_key("--field");
        return Err(error.help("make it anew: `coldplate reduce MACHINE --field`, with the same --set"));
    }
    Ok(())
}

fn of_machine(model: &MeshedMachine, surrogate: &Surrogate<'_>, reduced: Option<&ReducedModel>, progress: &dyn Progress) -> Result<Scene> {
    let surface = Surface::of(model)?;
    let channels = channels(model, surface.vertices.len());
    let snapshots = match reduced {
        Some(reduced) => Snapshots::reduced(reduced, model, &surface, surrogate, progress)?,
        None => Snapshots::solved(model, &surface, surrogate, progress)?,
    };
    let field = field(surrogate, &snapshots)?;
    Ok(Scene {
        shape: surface.packed(model),
        channels,
        sensors: sensors(model),
        field,
        notes: still(surrogate, reduced).into_iter().collect(),
    })
}

/// Remark on a surrogate that knows the machine over time, beside a picture that does not.
fn still(surrogate: &Surrogate<'_>, reduced: Option<&ReducedModel>) -> Option<String> {
    surrogate.in_time()?;
    let why = match reduced {
        None => "it was exported without a reduced model (--field)",
        Some(own) if own.in_time.is_none() => "its reduced model was made without histories (coldplate reduce --field --histories)",
        Some(_) => return None,
    };
    Some(format!("Over time the picture stays that of the steady state: {why}."))
}

/// A condition of the surrogate as one of the machine.
fn condition_of(model: &MeshedMachine, surrogate: &Surrogate<'_>, x: &[f64]) -> Result<Condition> {
    let held = surrogate.held().map(|held| (held.name, format!("{:?} {}", held.value, held.unit)));
    let set = surrogate.variables().zip(x).map(|(v, value)| (v.name, format!("{value:?} {}", v.unit)));
    let known = |name: &str| model.machine.variables.iter().any(|own| own.name == name);
    let all: Vec<(&str, String)> = held.filter(|(name, _)| known(name)).chain(set).collect();
    let pairs: Vec<(&str, &str)> = all.iter().map(|(name, value)| (*name, value.trim_end_matches(" 1"))).collect();
    model.machine.condition(&pairs)
}

impl Surface {
    /// The surface as a page reads it.
    fn packed(&self, model: &MeshedMachine) -> Shape {
        let origin = self.bounds().map(|(low, _)| low);
        let step = self.size() / f64::from(u16::MAX);
        let (mut parts, mut triangles, mut edges): (Vec<ScenePart>, Vec<u32>, Vec<u32>) = (Vec::new(), Vec::new(), Vec::new());
        for (p, part) in model.machine.parts.iter().enumerate() {
            let (first, first_edge) = (triangles.len() / 3, edges.len() / 2);
            for f in (0..self.facets.len()).filter(|f| self.facets[*f].part == p) {
                let (facet, own) = (&self.facets[f], &self.corners[f]);
                triangles.extend(self.triangles(f).flatten().map(|v| v as u32));
                let ends = (0..own.len()).filter(|k| facet.edges[*k]).map(|k| [own[k], own[(k + 1) % own.len()]]);
                edges.extend(ends.flatten().map(|v| v as u32));
            }
            let (count, edges) = (triangles.len() / 3 - first, edges.len() / 2 - first_edge);
            parts.push(ScenePart { name: part.name.clone(), first, count, first_edge, edges });
        }
        let positions = self.vertices.iter().flat_map(|v| [0, 1, 2].map(|d| ((v.at[d] - origin[d]) / step).round() as u16));
        let normals = self.vertices.iter().flat_map(|v| unit(v.normal).map(|x| (127.0 * x).round() as i8));
        Shape {
            parts,
            origin,
            step,
            positions: packed(positions.map(u16::to_le_bytes)),
            normals: packed(normals.map(i8::to_le_bytes)),
            triangles: packed(triangles.into_iter().map(u32::to_le_bytes)),
            edges: packed(edges.into_iter().map(u32::to_le_bytes)),
        }
    }
}

/// Sensors that have a place.
fn sensors(model: &MeshedMachine) -> Vec<SceneSensor> {
    let machine = &model.machine;
    let sensor = |s: usize| place_of(model, machine, s).map(|(part, at)| SceneSensor { name: machine.sensors[s].name.clone(), part, at });
    (0..machine.sensors.len()).filter_map(sensor).collect()
}

/// Channels, whose stations follow the vertices in the field.
fn channels(model: &MeshedMachine, vertices: usize) -> Vec<SceneChannel> {
    let mut first = vertices;
    let mut found = Vec::new();
    for (channel, stream) in model.machine.channels.iter().zip(&model.network.streams) {
        let shares = shares(stream);
        let (path, diameter) = (channel.path.clone(), channel.diameter);
        let count = shares.len();
        found.push(SceneChannel { name: channel.name.clone(), part: channel.part, diameter, path, shares, first });
        first += count;
    }
    found
}

fn packed<const N: usize>(numbers: impl Iterator<Item = [u8; N]>) -> String {
    STANDARD.encode(numbers.flatten().collect::<Vec<u8>>())
}
