//! The machine at one condition as a binary glTF 2.0 file (ISO/IEC 12113), for viewers and programs that show three dimensions.
//!
//! Parts, channels and sensors are nodes with the names of the machine file, in metres, y upwards: (x, y, z) of the machine is
//! (x, z, -y) of the file. Every vertex has its colour and, as the attribute `_TEMPERATURE`, its temperature in degC.

use serde_json::{Value, json};

use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::Condition;
use coldplate_figures::chart::style::on_bodies;
use coldplate_solve::meshed::{MeshedMachine, SteadyState};

use super::surface::{Surface, cross, dot, minus, shares, unit};
use crate::charts::machine::place_of;

/// Sides of the prism that a pipe is drawn as, a count. Chosen: round enough beside the parts.
const SIDES: usize = 12;
/// Radius of a sensor over the length of the longest side of the machine. Chosen: seen, and smaller than the parts.
const SENSOR: f64 = 1.0 / 120.0;
/// Codes of the format: kinds of numbers and uses of a part of the buffer.
const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
/// Materials of the file, by their places in its list.
const BY_TEMPERATURE: usize = 0;
const DARK: usize = 1;

/// A binary glTF file.
#[derive(Debug, Clone, PartialEq)]
pub struct Glb {
    /// Content of the file.
    pub bytes: Vec<u8>,
    /// Parts in it, a count.
    pub parts: usize,
    /// Triangles in it, those of a sensor once, a count.
    pub triangles: usize,
    /// Lowest and highest temperature of surfaces and water, degC: the ends of the colours.
    pub range: [f64; 2],
}

/// Triangles of one name, with outward normals of unit length, and the temperature of each vertex, degC.
#[derive(Default)]
struct Body {
    name: String,
    corners: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    temperatures: Vec<f64>,
    triangles: Vec<[usize; 3]>,
}

impl Glb {
    /// The file of a model whose `state` at `condition` is known.
    ///
    /// # Errors
    /// The machine has no part with a shape; the file would have more than 4 GB.
    pub fn new(model: &MeshedMachine, condition: &Condition, state: &SteadyState) -> Result<Self> {
        let machine = &model.machine;
        let surface = Surface::of(model)?;
        let temperatures = surface.temperatures(model, &state.solution.temperatures);
        let parts: Vec<Body> = (0..machine.parts.len()).filter_map(|p| part(model, &surface, &temperatures, p)).collect();
        let channels = channels(model, &temperatures[surface.vertices.len()..]);
        let all = parts.iter().chain(&channels).flat_map(|body| &body.temperatures);
        let [low, high] = all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], t| [low.min(*t), high.max(*t)]);
        let mut file = Contents::default();
        let share = |t: f64| if high > low { (t - low) / (high - low) } else { 0.5 };
        let is_part: Vec<usize> = parts.iter().map(|body| file.coloured(body, share)).collect();
        let is_channel: Vec<usize> = channels.iter().map(|body| file.coloured(body, share)).collect();
        let readings = model.readings(state);
        let marker = file.mesh(&sensor(surface.size() * SENSOR), DARK, Vec::new());
        let placed = (0..machine.sensors.len()).filter_map(|s| place_of(model, machine, s).map(|(_, at)| (s, at)));
        let is_sensor: Vec<usize> = placed
            .map(|(s, at)| {
                let own = &machine.sensors[s];
                let extras = json!({ "reading": written(readings[s]), "unit": own.measurand().unit() });
                file.node(json!({ "name": own.name, "mesh": marker, "translation": upwards(at), "extras": extras }))
            })
            .collect();
        let mut children = is_part;
        for (name, own) in [("channels", is_channel), ("sensors", is_sensor)] {
            // A list without entries is an error in this format.
            children.extend((!own.is_empty()).then(|| file.node(json!({ "name": name, "children": own }))));
        }
        let root = file.node(json!({ "name": machine.name, "children": children }));
        let extras = json!({ "condition": condition.by_name(machine), "temperature_low_degC": written(low), "temperature_high_degC": written(high) });
        let triangles = parts.iter().chain(&channels).map(|body| body.triangles.len()).sum();
        Ok(Self { bytes: file.bytes(root, &extras)?, parts: parts.len(), triangles, range: [low, high] })
    }
}

/// The surface of a part; none where it has no shape.
fn part(model: &MeshedMachine, surface: &Surface, temperatures: &[f64], part: usize) -> Option<Body> {
    let mut body = Body { name: model.machine.parts[part].name.clone(), ..Body::default() };
    let mut place_of_vertex = vec![None; surface.vertices.len()];
    for triangle in (0..surface.facets.len()).filter(|f| surface.facets[*f].part == part).flat_map(|f| surface.triangles(f)) {
        let own = triangle.map(|v| {
            *place_of_vertex[v].get_or_insert_with(|| {
                body.corners.push(surface.vertices[v].at);
                body.normals.push(unit(surface.vertices[v].normal));
                body.temperatures.push(temperatures[v]);
                body.corners.len() - 1
            })
        });
        body.triangles.push(own);
    }
    (!body.triangles.is_empty()).then_some(body)
}

/// Channels as pipes, coloured by the water that leaves each station; `water` has the stations of all, one channel after the other.
fn channels(model: &MeshedMachine, water: &[f64]) -> Vec<Body> {
    let mut first = 0;
    let mut found = Vec::new();
    for (channel, stream) in model.machine.channels.iter().zip(&model.network.streams) {
        let own = &water[first..first + stream.stations.len()];
        first += own.len();
        let body = pipe(&channel.name, &channel.path, 0.5 * channel.diameter, &shares(stream), own);
        found.extend((!body.triangles.is_empty()).then_some(body));
    }
    found
}

/// Prisms around the axis `path`, cut where it bends and where a station ends.
fn pipe(name: &str, path: &[[f64; 3]], radius: f64, shares: &[f64], water: &[f64]) -> Body {
    let mut body = Body { name: name.into(), ..Body::default() };
    let legs: Vec<f64> = path.windows(2).map(|ends| dot(minus(ends[1], ends[0]), minus(ends[1], ends[0])).sqrt()).collect();
    let whole: f64 = legs.iter().sum();
    let mut passed = 0.0;
    for (ends, leg) in path.windows(2).zip(&legs).filter(|(_, leg)| **leg > 0.0) {
        let direction = unit(minus(ends[1], ends[0]));
        let some = if direction[2].abs() < 0.9 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
        let e1 = unit(cross(direction, some));
        let e2 = cross(direction, e1);
        let (from, to) = (passed / whole, (passed + leg) / whole);
        let between = shares.iter().copied().filter(|share| *share > from + 1e-9 && *share < to - 1e-9);
        let begin = body.corners.len();
        for share in std::iter::once(from).chain(between).chain([to]) {
            let station = shares.iter().position(|own| *own >= share - 1e-9).unwrap_or(shares.len() - 1);
            for k in 0..SIDES {
                let (sine, cosine) = (std::f64::consts::TAU * k as f64 / SIDES as f64).sin_cos();
                let normal = [0, 1, 2].map(|d| e1[d] * cosine + e2[d] * sine);
                body.corners.push([0, 1, 2].map(|d| ends[0][d] + direction[d] * (share - from) * whole + radius * normal[d]));
                body.normals.push(normal);
                body.temperatures.push(water[station]);
            }
        }
        for ring in (begin..body.corners.len() - SIDES).step_by(SIDES) {
            for k in 0..SIDES {
                let (own, next) = (ring + k, ring + (k + 1) % SIDES);
                body.triangles.extend([[own, next, next + SIDES], [own, next + SIDES, own + SIDES]]);
            }
        }
        passed += leg;
    }
    body
}

/// An octahedron around the origin.
fn sensor(radius: f64) -> Body {
    let axis = |d: usize, sign: f64| [0, 1, 2].map(|k| if k == d { sign } else { 0.0 });
    let normals: Vec<[f64; 3]> = (0..3).flat_map(|d| [axis(d, 1.0), axis(d, -1.0)]).collect();
    let corners = normals.iter().map(|normal| normal.map(|x| radius * x)).collect();
    let triangles = (0..8).map(|octant: usize| {
        let ends = [0, 1, 2].map(|d| 2 * d + (octant >> d & 1));
        if octant.count_ones().is_multiple_of(2) { ends } else { [ends[0], ends[2], ends[1]] }
    });
    Body { name: "sensor".into(), triangles: triangles.collect(), corners, normals, temperatures: Vec::new() }
}

/// A reading to a millionth of its unit: what lies behind it is rounding, and would make files of other lengths.
fn written(reading: f64) -> f64 {
    (1e6 * reading).round() / 1e6
}

/// A place of the machine in the axes of the file.
fn upwards(at: [f64; 3]) -> [f32; 3] {
    [at[0] as f32, at[2] as f32, -at[1] as f32]
}

/// Lists of the file, in the format's words, and its buffer.
#[derive(Default)]
struct Contents {
    buffer: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
}

impl Contents {
    /// Adds numbers to the buffer; `kind` says which of them make an element. Every element has a multiple of four bytes.
    fn accessor(&mut self, bytes: Vec<u8>, target: u32, mut kind: Value) -> usize {
        self.views.push(json!({ "buffer": 0, "byteOffset": self.buffer.len(), "byteLength": bytes.len(), "target": target }));
        self.buffer.extend(bytes);
        kind["bufferView"] = json!(self.views.len() - 1);
        self.accessors.push(kind);
        self.accessors.len() - 1
    }

    fn vectors(&mut self, vectors: &[[f64; 3]], has_bounds: bool) -> usize {
        let all: Vec<[f32; 3]> = vectors.iter().map(|v| upwards(*v)).collect();
        let mut kind = json!({ "componentType": FLOAT, "count": all.len(), "type": "VEC3" });
        if has_bounds {
            let bound = |better: fn(f32, f32) -> f32| [0, 1, 2].map(|d| all.iter().map(|v| v[d]).fold(all[0][d], better));
            kind["min"] = json!(bound(f32::min));
            kind["max"] = json!(bound(f32::max));
        }
        self.accessor(all.iter().flatten().flat_map(|x| x.to_le_bytes()).collect(), ARRAY_BUFFER, kind)
    }

    /// A mesh of a body, with further attributes of its vertices.
    fn mesh(&mut self, body: &Body, material: usize, attributes: Vec<(&str, usize)>) -> usize {
        let (place, normal) = (self.vectors(&body.corners, true), self.vectors(&body.normals, false));
        let bytes = body.triangles.iter().flatten().flat_map(|v| (*v as u32).to_le_bytes()).collect();
        let kind = json!({ "componentType": UNSIGNED_INT, "count": 3 * body.triangles.len(), "type": "SCALAR" });
        let indices = self.accessor(bytes, ELEMENT_ARRAY_BUFFER, kind);
        let mut all = json!({ "POSITION": place, "NORMAL": normal });
        for (name, accessor) in attributes {
            all[name] = json!(accessor);
        }
        let primitive = json!({ "attributes": all, "indices": indices, "material": material });
        self.meshes.push(json!({ "name": body.name, "primitives": [primitive] }));
        self.meshes.len() - 1
    }

    /// A node with the mesh of a body, coloured by the shares of the range that its temperatures have.
    fn coloured(&mut self, body: &Body, share: impl Fn(f64) -> f64) -> usize {
        // Colours of vertices are shares of light; eight bits of these would show steps where it is dark.
        let colour = |t: &f64| {
            let [red, green, blue] = on_bodies(share(*t)).linear();
            [red, green, blue, 1.0].map(|light| (light * f64::from(u16::MAX)).round() as u16)
        };
        let colours = body.temperatures.iter().flat_map(colour).flat_map(u16::to_le_bytes).collect();
        let kind = json!({ "componentType": UNSIGNED_SHORT, "normalized": true, "count": body.temperatures.len(), "type": "VEC4" });
        let colours = self.accessor(colours, ARRAY_BUFFER, kind);
        let degrees = body.temperatures.iter().flat_map(|t| (*t as f32).to_le_bytes()).collect();
        let kind = json!({ "componentType": FLOAT, "count": body.temperatures.len(), "type": "SCALAR" });
        let degrees = self.accessor(degrees, ARRAY_BUFFER, kind);
        let mesh = self.mesh(body, BY_TEMPERATURE, vec![("COLOR_0", colours), ("_TEMPERATURE", degrees)]);
        let ends = body.temperatures.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], t| [low.min(*t), high.max(*t)]);
        let extras = json!({ "temperature_low_degC": written(ends[0]), "temperature_high_degC": written(ends[1]) });
        self.node(json!({ "name": body.name, "mesh": mesh, "extras": extras }))
    }

    fn node(&mut self, node: Value) -> usize {
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    /// The file with a scene of one node: header, JSON, buffer.
    fn bytes(self, root: usize, extras: &Value) -> Result<Vec<u8>> {
        let material = |name: &str, light: f64| {
            let surface = json!({ "baseColorFactor": [light, light, light, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9 });
            json!({ "name": name, "pbrMetallicRoughness": surface })
        };
        let whole = json!({
            "asset": { "version": "2.0", "generator": concat!("coldplate ", env!("CARGO_PKG_VERSION")) },
            "scene": 0,
            "scenes": [{ "nodes": [root], "extras": extras }],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": [material("temperature", 1.0), material("sensor", 0.01)],
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{ "byteLength": self.buffer.len() }],
        });
        let mut text = whole.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let size = |length: usize| {
            let error =
                |_| Error::input("a binary glTF file has up to 4 GB, and this would be more").help("take fewer parts or a coarser mesh");
            u32::try_from(length).map(u32::to_le_bytes).map_err(error)
        };
        let mut file = [b"glTF".as_slice(), &2_u32.to_le_bytes(), &size(28 + text.len() + self.buffer.len())?].concat();
        for (kind, content) in [(b"JSON", &text), (b"BIN\0", &self.buffer)] {
            file.extend(size(content.len())?);
            file.extend(kind);
            file.extend(content);
        }
        Ok(file)
    }
}
