//! The machine in three dimensions for a page: its surface, and temperatures everywhere from those of the measurement points.
//!
//! A surrogate knows the points and nothing between them. Between them the field is nearly linear in the temperatures of the points
//! and in the variables: heat is conducted, and films and radiation change with the condition alone. So the machine is solved at
//! some dozen conditions; the temperatures of its surface are written in few modes (proper orthogonal decomposition), and the
//! amplitude of each mode is fitted to what the surrogate says of the points, by ridge regression. Every condition is predicted from
//! all others, and the error of these predictions is stated.

mod glb;
mod surface;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use coldplate_base::error::{Error, Result};
use coldplate_base::progress::Progress;
use coldplate_describe::machine::Condition;
use coldplate_explore::sweep::design;
use coldplate_runtime::Surrogate;
use coldplate_solve::meshed::MeshedMachine;

pub use glb::Glb;

use crate::charts::machine::place_of;
use surface::{Surface, shares, unit};

/// Conditions at which the machine is solved, a count. Chosen: twice the points of a large machine.
const CONDITIONS: usize = 48;
/// Modes of the field at most, a count. Chosen: beyond it lie the solver's own errors.
const MOST_MODES: usize = 12;
/// Error that the modes may leave, K, root mean square over the surface. Chosen: a fiftieth of what thermometers resolve.
const LEFT_BY_MODES: f64 = 0.002;
/// Penalties of the regression that are tried, on features of unit variance. Chosen: from rounding to one that forgets the features; which
/// one counts is decided by conditions that are left out.
const PENALTIES: [f64; 9] = [1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1];
/// Vertices of a self-test, a count.
const TESTED: usize = 7;

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

#[derive(Debug, Serialize)]
struct SceneField {
    /// Features that the amplitudes are linear in: a constant, these variables, then these points, all in the surrogate's units.
    variables: Vec<String>,
    points: Vec<String>,
    /// Mean temperature of each vertex, then of each station, degC, packed `f32`.
    center: String,
    /// Modes at all of these, packed `i16`; the unit of each, K; and the coefficients of its amplitude.
    modes: Vec<String>,
    scales: Vec<f64>,
    coefficients: Vec<Vec<f64>>,
    /// Error of conditions that were predicted from all others, K: root mean square, and largest.
    error: f64,
    largest_error: f64,
    /// Conditions that were solved.
    conditions: usize,
    self_tests: Vec<FieldTest>,
}

/// Temperatures that a page must find at a condition.
#[derive(Debug, Serialize)]
struct FieldTest {
    condition: Vec<f64>,
    vertices: Vec<usize>,
    values: Vec<f64>,
}

/// The machine of a surrogate as a scene.
///
/// # Errors
/// The machine lacks a variable of the surrogate or has no part; a condition cannot be solved.
pub fn scene(model: &MeshedMachine, surrogate: &Surrogate<'_>, progress: &dyn Progress) -> Result<Scene> {
    let surface = Surface::of(model)?;
    let channels = channels(model, surface.vertices.len());
    let conditions = conditions(surrogate);
    let asked: Vec<Condition> = conditions.iter().map(|x| condition_of(model, surrogate, x)).collect::<Result<_>>()?;
    let solver = model.solver(&asked[0])?;
    let mut snapshots = Vec::with_capacity(asked.len());
    for (done, condition) in asked.iter().enumerate() {
        progress.count(done, asked.len(), "conditions");
        let temperatures = model.solve(&solver, condition)?.solution.temperatures;
        snapshots.push(surface.temperatures(model, &temperatures));
    }
    progress.count(conditions.len(), conditions.len(), "conditions");
    let field = field(surrogate, &conditions, &snapshots)?;
    let machine = &model.machine;
    let sensor = |s: usize| place_of(model, machine, s).map(|(part, at)| SceneSensor { name: machine.sensors[s].name.clone(), part, at });
    let sensors = (0..machine.sensors.len()).filter_map(sensor).collect();
    Ok(Scene { shape: surface.packed(model), channels, sensors, field, notes: Vec::new() })
}

/// Conditions over the ranges of a surrogate, in its units.
fn conditions(surrogate: &Surrogate<'_>) -> Vec<Vec<f64>> {
    let variables: Vec<_> = surrogate.variables().collect();
    let at = |unit: Vec<f64>| unit.iter().zip(&variables).map(|(u, v)| v.low + u * (v.high - v.low)).collect();
    design::latin_hypercube(CONDITIONS, variables.len(), 1).into_iter().map(at).collect()
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

/// The field of a surface over the features of a surrogate.
fn field(surrogate: &Surrogate<'_>, conditions: &[Vec<f64>], snapshots: &[Vec<f64>]) -> Result<SceneField> {
    let places = snapshots.first().map_or(0, Vec::len);
    let n = snapshots.len();
    let points: Vec<usize> = (0..surrogate.point_count()).filter(|p| surrogate.point(*p).is_some_and(|own| own.unit == "degC")).collect();
    let features_of = |x: &Vec<f64>| {
        let mut values = vec![0.0; surrogate.point_count()];
        surrogate.evaluate(x, &mut values).map_err(|e| Error::input(e.to_string()))?;
        Ok(x.iter().copied().chain(points.iter().map(|p| values[*p])).collect::<Vec<f64>>())
    };
    let features: Vec<Vec<f64>> = conditions.iter().map(features_of).collect::<Result<_>>()?;
    let y = DMatrix::from_fn(n, places, |i, j| snapshots[i][j]);
    let center = y.row_mean();
    let rise = DMatrix::from_fn(n, places, |i, j| y[(i, j)] - center[j]);
    let (amplitudes, modes) = modes(&rise);
    let fit = Regression::new(&features, &amplitudes);
    let left = &rise - &amplitudes * &modes + &fit.left_out * &modes;
    let (mut units, mut packed_modes) = (Vec::new(), Vec::new());
    for mode in modes.row_iter() {
        let scale = mode.iter().fold(1e-12, |most: f64, x| most.max(x.abs())) / f64::from(i16::MAX);
        packed_modes.push(packed(mode.iter().map(|x| ((x / scale).round() as i16).to_le_bytes())));
        units.push(scale);
    }
    let tests = [0, n / 2].into_iter().filter(|i| *i < n).map(|i| {
        let found = (0..modes.nrows()).map(|k| fit.at(k, &features[i])).collect::<Vec<f64>>();
        let vertices: Vec<usize> = (0..TESTED).map(|k| k * places / TESTED).collect();
        let value = |v: &usize| center[*v] + found.iter().enumerate().map(|(k, a)| a * modes[(k, *v)]).sum::<f64>();
        FieldTest { condition: conditions[i].clone(), values: vertices.iter().map(value).collect(), vertices }
    });
    Ok(SceneField {
        variables: surrogate.variables().map(|v| v.name.to_string()).collect(),
        points: points.iter().filter_map(|p| surrogate.point(*p)).map(|p| p.name.to_string()).collect(),
        center: packed(center.iter().map(|x| (*x as f32).to_le_bytes())),
        modes: packed_modes,
        scales: units,
        self_tests: tests.collect(),
        coefficients: fit.coefficients,
        error: (left.norm_squared() / (n * places).max(1) as f64).sqrt(),
        largest_error: left.amax(),
        conditions: n,
    })
}

/// Amplitudes (conditions by modes) and modes (by places) that leave little of a rise: the singular vectors of largest value.
fn modes(rise: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let eigen = (rise * rise.transpose()).symmetric_eigen();
    let mut order: Vec<usize> = (0..rise.nrows()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let may_be_left = LEFT_BY_MODES.powi(2) * (rise.nrows() * rise.ncols()) as f64;
    let left_after = |count: usize| order[count..].iter().map(|k| eigen.eigenvalues[*k].max(0.0)).sum::<f64>();
    let count = (1..MOST_MODES.min(order.len())).find(|count| left_after(*count) <= may_be_left).unwrap_or(MOST_MODES.min(order.len()));
    let value = |k: usize| eigen.eigenvalues[order[k]].max(1e-24).sqrt();
    let amplitudes = DMatrix::from_fn(rise.nrows(), count, |i, k| eigen.eigenvectors[(i, order[k])] * value(k));
    let lengths = DVector::from_fn(count, |k, _| value(k).powi(-2));
    let modes = DMatrix::from_diagonal(&lengths) * amplitudes.transpose() * rise;
    (amplitudes, modes)
}

/// Ridge regression of amplitudes on features.
struct Regression {
    /// Coefficients of each amplitude: a constant, then one for each feature.
    coefficients: Vec<Vec<f64>>,
    /// Amplitudes of each condition less what all other conditions say of them.
    left_out: DMatrix<f64>,
}

impl Regression {
    /// The regression with the penalty that predicts conditions best that are left out.
    fn new(features: &[Vec<f64>], amplitudes: &DMatrix<f64>) -> Self {
        let (n, m) = (features.len(), features.first().map_or(0, Vec::len));
        let raw = DMatrix::from_fn(n, m, |i, j| features[i][j]);
        let means = raw.row_mean();
        let spread = |j: usize| (raw.column(j).iter().map(|x| (x - means[j]).powi(2)).sum::<f64>() / n as f64).sqrt().max(1e-12);
        let spreads: Vec<f64> = (0..m).map(spread).collect();
        let standard = DMatrix::from_fn(n, m, |i, j| (raw[(i, j)] - means[j]) / spreads[j]);
        let level = amplitudes.row_mean();
        let target = DMatrix::from_fn(n, amplitudes.ncols(), |i, k| amplitudes[(i, k)] - level[k]);
        let svd = standard.svd(true, true);
        let (Some(u), Some(v_t)) = (&svd.u, &svd.v_t) else {
            return Self { coefficients: level.iter().map(|a| vec![*a]).collect(), left_out: target };
        };
        let projected = u.transpose() * &target;
        let with = |penalty: f64| {
            let shrink = svd.singular_values.map(|s| s * s / (s * s + penalty * n as f64));
            let leverage =
                DVector::from_fn(n, |i, _| 1.0 / n as f64 + (0..shrink.len()).map(|k| u[(i, k)].powi(2) * shrink[k]).sum::<f64>());
            let left = &target - u * DMatrix::from_diagonal(&shrink) * &projected;
            let left_out = DMatrix::from_fn(n, target.ncols(), |i, k| left[(i, k)] / (1.0 - leverage[i]).max(1e-6));
            (left_out.norm_squared(), penalty, left_out)
        };
        let best = PENALTIES.into_iter().map(with).min_by(|a, b| a.0.total_cmp(&b.0));
        let (_, penalty, left_out) = best.unwrap_or_else(|| with(1.0));
        let inverse = svd.singular_values.map(|s| s / (s * s + penalty * n as f64));
        let slopes = v_t.transpose() * DMatrix::from_diagonal(&inverse) * projected;
        let of = |k: usize| {
            let own: Vec<f64> = (0..m).map(|j| slopes[(j, k)] / spreads[j]).collect();
            let constant = level[k] - own.iter().zip(means.iter()).map(|(c, x)| c * x).sum::<f64>();
            std::iter::once(constant).chain(own).collect()
        };
        Self { coefficients: (0..target.ncols()).map(of).collect(), left_out }
    }

    /// An amplitude at some features.
    fn at(&self, amplitude: usize, features: &[f64]) -> f64 {
        let own = &self.coefficients[amplitude];
        own[0] + own[1..].iter().zip(features).map(|(c, x)| c * x).sum::<f64>()
    }
}

fn packed<const N: usize>(numbers: impl Iterator<Item = [u8; N]>) -> String {
    STANDARD.encode(numbers.flatten().collect::<Vec<u8>>())
}
