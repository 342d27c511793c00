//! The file of a reduced model: the line `COLDPLATE-REDUCED 7`, SHA-256 of the rest, and the rest in postcard's
//! encoding.
//!
//! Laws are not stored but read from the machine file's text, which is part of it: materials, contact laws, channels, circuits and
//! sources of the sampled network are the machine's own.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::fields::ModeField;
use super::model::{HistoryBound, Made, ReducedModel};
use super::reduced_network::ReducedNetwork;
use coldplate_base::document::Document;
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::{Machine, Sensor};
use coldplate_network::mesh::path::Station;
use coldplate_network::stream::CircuitTree;
use coldplate_network::{ContactGroup, EndInterpolation, HeatSource, Joint, Network, SensorTerm, Stream, Surface};
use coldplate_solve::sensitivity::OpenParameter;

#[derive(Serialize, Deserialize)]
struct StoredModel {
    /// Text of the machine file.
    text: String,
    /// Name of the machine file in error messages.
    file: PathBuf,
    hash: String,
    parameters: Vec<OpenParameter>,
    left_out: Vec<String>,
    ranges: Vec<(f64, f64)>,
    coarse: StoredLevel,
    fine: StoredLevel,
    margin: f64,
    floor: f64,
    in_time: Option<HistoryBound>,
    made: Made,
    field: Option<ModeField>,
}

#[derive(Serialize, Deserialize)]
struct StoredLevel {
    level: ReducedNetwork,
    network: StoredNetwork,
}

/// Parts of a sampled network that do not follow from the machine file.
#[derive(Serialize, Deserialize)]
struct StoredNetwork {
    nodes: usize,
    group: Vec<u32>,
    groups: Vec<String>,
    joints: Vec<Joint>,
    reaches: Vec<EndInterpolation>,
    contacts: Vec<StoredContact>,
    surfaces: Vec<Surface>,
    radiative: Vec<(u32, u32, f64)>,
    streams: Vec<StoredStream>,
    sources: Vec<Vec<(u32, f64)>>,
    fixed: Vec<(u32, u32)>,
    sensors: Vec<SensorTerm>,
    sensor_names: Vec<String>,
}

#[derive(Serialize, Deserialize)]
struct StoredContact {
    of: usize,
    name: String,
    between: [String; 2],
    area: f64,
    scale: f64,
    is_half: bool,
}

#[derive(Serialize, Deserialize)]
struct StoredStream {
    circuit: usize,
    stations: Vec<Station>,
    water_weights: Vec<f64>,
    first_node: u32,
    upstream: Vec<usize>,
    property: u32,
    length: f64,
}

impl ReducedModel {
    /// First bytes of the file, whatever its version.
    pub const FAMILY: &[u8] = b"COLDPLATE-REDUCED ";
    /// First bytes of the file.
    pub const MAGIC: &[u8] = b"COLDPLATE-REDUCED 7\n";

    /// The file's bytes; `document` is the machine file the model was made of.
    ///
    /// # Errors
    /// The machine file cannot be read again.
    pub fn to_bytes(&self, document: &Document) -> Result<Vec<u8>> {
        let level = |level: &ReducedNetwork| StoredLevel { level: level.clone(), network: StoredNetwork::of(&level.network) };
        let stored = StoredModel {
            text: document.rewritten(&[], &[])?,
            file: document.file().to_path_buf(),
            hash: self.machine.hash.clone(),
            parameters: self.parameters.clone(),
            left_out: self.left_out.clone(),
            ranges: self.ranges.clone(),
            coarse: level(&self.coarse),
            fine: level(&self.fine),
            margin: self.margin,
            floor: self.floor,
            in_time: self.in_time.clone(),
            made: self.made.clone(),
            field: self.field.clone(),
        };
        let body = postcard::to_stdvec(&stored).map_err(|e| Error::numerics(format!("the reduced model cannot be written: {e}")))?;
        Ok([Self::MAGIC, Sha256::digest(&body).as_slice(), &body].concat())
    }

    /// From a file's bytes.
    ///
    /// # Errors
    /// The bytes are no reduced model, or are damaged.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let damaged = || Error::input("this reduced model is damaged").help("make it anew with `coldplate reduce`");
        let rest = bytes.strip_prefix(Self::MAGIC).ok_or_else(|| {
            Error::input("this is no reduced model of this version of the program").help("make one with `coldplate reduce`")
        })?;
        let (digest, body) = rest.split_at_checked(32).ok_or_else(damaged)?;
        let (own, stored) = rayon::join(|| Sha256::digest(body), || postcard::from_bytes::<StoredModel>(body));
        let stored = stored.ok().filter(|_| own.as_slice() == digest).ok_or_else(damaged)?;
        let mut machine = Machine::from_document(&Document::parse(&stored.text, &stored.file)?)?;
        machine.hash = stored.hash;
        let level = |stored: StoredLevel| -> Option<ReducedNetwork> {
            let network = stored.network.network(&machine)?;
            let level = ReducedNetwork { network, ..stored.level };
            level.is_sound().then_some(level)
        };
        let (coarse, fine) = (level(stored.coarse).ok_or_else(damaged)?, level(stored.fine).ok_or_else(damaged)?);
        if stored.field.as_ref().is_some_and(|field| !field.is_sound(fine.len())) {
            return Err(damaged());
        }
        Ok(Self {
            coarse,
            fine,
            machine,
            parameters: stored.parameters,
            left_out: stored.left_out,
            ranges: stored.ranges,
            margin: stored.margin,
            floor: stored.floor,
            in_time: stored.in_time,
            untimed: None,
            made: stored.made,
            field: stored.field,
        })
    }
}

impl StoredNetwork {
    fn of(network: &Network) -> Self {
        let contact = |g: &ContactGroup| StoredContact {
            of: g.of.unwrap_or(usize::MAX),
            name: g.name.clone(),
            between: g.between.clone(),
            area: g.area,
            scale: g.scale,
            is_half: g.is_half,
        };
        let stream = |s: &Stream| StoredStream {
            circuit: s.circuit,
            stations: s.stations.clone(),
            water_weights: s.water_weights.clone(),
            first_node: s.first_node,
            upstream: s.upstream.clone(),
            property: s.property,
            length: s.length,
        };
        Self {
            nodes: network.nodes,
            group: network.group.clone(),
            groups: network.groups.clone(),
            joints: network.joints.clone(),
            reaches: network.reaches.clone(),
            contacts: network.contacts.iter().map(contact).collect(),
            surfaces: network.surfaces.clone(),
            radiative: network.radiative.clone(),
            streams: network.streams.iter().map(stream).collect(),
            sources: network.sources.iter().map(|s| s.shares.clone()).collect(),
            fixed: network.fixed.clone(),
            sensors: network.sensors.clone(),
            sensor_names: network.sensor_names.clone(),
        }
    }

    /// The network with the laws of the machine; `None` if the two do not belong together.
    fn network(self, machine: &Machine) -> Option<Network> {
        let contact = |g: StoredContact| {
            let law = match machine.contacts.get(g.of) {
                Some(contact) => contact.law.clone(),
                None => machine.default_contact.clone()?,
            };
            let of = (g.of != usize::MAX).then_some(g.of);
            Some(ContactGroup { of, name: g.name, law, between: g.between, area: g.area, scale: g.scale, is_half: g.is_half, joints: 0..0 })
        };
        let stream = |(s, channel): (StoredStream, &coldplate_describe::machine::Channel)| Stream {
            name: channel.name.clone(),
            circuit: s.circuit,
            stations: s.stations,
            water_weights: s.water_weights,
            first_node: s.first_node,
            upstream: s.upstream,
            property: s.property,
            diameter: channel.diameter,
            length: s.length,
            film_factor: channel.film_factor,
            fouling_resistance: channel.fouling_resistance,
            minor_loss: channel.minor_loss,
            roughness: channel.roughness,
            film: channel.film.clone(),
        };
        if self.streams.len() != machine.channels.len() || self.sources.len() != machine.sources.len() {
            return None;
        }
        Some(Network {
            solids: self.group.len(),
            nodes: self.nodes,
            capacity: vec![0.0; self.group.len()],
            group: self.group,
            groups: self.groups,
            joints: self.joints,
            reaches: self.reaches,
            contacts: self.contacts.into_iter().map(contact).collect::<Option<_>>()?,
            properties: machine.materials.iter().flat_map(|m| m.conductivity.iter().cloned()).collect(),
            surfaces: self.surfaces,
            radiative: self.radiative,
            streams: self.streams.into_iter().zip(&machine.channels).map(stream).collect(),
            circuits: machine.circuits.iter().map(|c| CircuitTree { circuit: c.clone(), layout: c.layout.clone() }).collect(),
            sources: self.sources.into_iter().zip(&machine.sources).map(|(shares, s)| HeatSource { shares, law: s.law.clone() }).collect(),
            fixed: self.fixed,
            sensors: self.sensors,
            sensor_names: self.sensor_names,
            measurands: machine.sensors.iter().map(Sensor::measurand).collect(),
            ..Network::default()
        })
    }
}
