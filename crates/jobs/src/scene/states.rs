//! The machine in three dimensions at conditions that were solved, as a page.

use serde::Serialize;

use coldplate_base::error::{Error, Result};
use coldplate_export::states_page;
use coldplate_solve::meshed::MeshedMachine;

use super::surface::Surface;
use super::{SceneChannel, SceneSensor, Shape, channels, packed, sensors};

/// A machine at conditions that were solved, in one or more versions.
#[derive(Debug)]
pub struct States<'a> {
    /// Versions of the machine with their names; they share a mesh.
    pub versions: Vec<(String, &'a MeshedMachine)>,
    /// Conditions with their names: temperatures of all nodes, K, for each version.
    pub conditions: Vec<(String, Vec<Vec<f64>>)>,
    /// Parts that are named in the picture, with what is said there.
    pub marked: Vec<(String, String)>,
    /// Remarks for the reader.
    pub notes: Vec<String>,
}

#[derive(Serialize)]
struct StatesScene {
    #[serde(flatten)]
    shape: Shape,
    channels: Vec<SceneChannel>,
    sensors: Vec<SceneSensor>,
    /// Names of the versions.
    names: Vec<String>,
    states: Vec<SceneState>,
    /// Names with their places, on parts.
    marked: Vec<SceneSensor>,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct SceneState {
    name: String,
    /// Temperatures of each vertex, then of each station, degC, packed `f32`, for each version.
    fields: Vec<String>,
}

impl States<'_> {
    /// The page that shows them.
    ///
    /// # Errors
    /// There is no version, the machine has no part, or the versions have different surfaces.
    pub fn page(&self) -> Result<String> {
        let Some((_, model)) = self.versions.first() else { return Err(Error::input("there is no machine to show")) };
        let surfaces: Vec<Surface> = self.versions.iter().map(|(_, own)| Surface::of(own)).collect::<Result<_>>()?;
        let surface = &surfaces[0];
        if surfaces.iter().any(|own| own.vertices.iter().map(|v| v.at).ne(surface.vertices.iter().map(|v| v.at))) {
            return Err(Error::input("the versions of this machine have different surfaces"));
        }
        let state = |(name, fields): &(String, Vec<Vec<f64>>)| {
            let of = |((own, (_, version)), kelvin): ((&Surface, &(String, &MeshedMachine)), &Vec<f64>)| {
                packed(own.temperatures(version, kelvin).into_iter().map(|t| (t as f32).to_le_bytes()))
            };
            SceneState { name: name.clone(), fields: surfaces.iter().zip(&self.versions).zip(fields).map(of).collect() }
        };
        let mark = |(part, name): &(String, String)| {
            let part = model.machine.parts.iter().position(|own| own.name == *part)?;
            Some(SceneSensor { name: name.clone(), part: Some(part), at: surface.middle(part) })
        };
        let scene = StatesScene {
            shape: surface.packed(model),
            channels: channels(model, surface.vertices.len()),
            sensors: sensors(model),
            names: self.versions.iter().map(|(name, _)| name.clone()).collect(),
            states: self.conditions.iter().map(state).collect(),
            marked: self.marked.iter().filter_map(mark).collect(),
            notes: self.notes.clone(),
        };
        let json = serde_json::to_string(&scene).map_err(|e| Error::input(format!("the machine cannot be written as JSON: {e}")))?;
        Ok(states_page(&json))
    }
}
