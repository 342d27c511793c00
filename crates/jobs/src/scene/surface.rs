//! Surface of the parts of a machine: triangles with shared vertices, their temperatures, and the places along its channels.

use std::collections::HashMap;

use coldplate_base::error::{Error, Result};
use coldplate_base::units::{Celsius, Kelvin};
use coldplate_network::mesh::hull::Facet;
use coldplate_network::stream::Stream;
use coldplate_solve::meshed::MeshedMachine;

/// Pieces along an edge of a block, a count. Chosen: smooth colours against the size of the page.
const DETAIL: usize = 7;
/// Cosine of the angle between neighbouring facets from which on there is an edge between them: of a cylinder they are ten degrees apart.
const SMOOTH: f64 = 0.7;

/// Vertices of the surface: facets of a body that meet at a place without an edge share one.
pub(super) struct Surface {
    pub(super) facets: Vec<Facet>,
    pub(super) vertices: Vec<Vertex>,
    /// Vertices of each facet.
    pub(super) corners: Vec<Vec<usize>>,
}

#[derive(Default)]
pub(super) struct Vertex {
    pub(super) at: [f64; 3],
    /// Sum of the outward normals of its facets.
    pub(super) normal: [f64; 3],
    facets: Vec<usize>,
}

impl Surface {
    /// # Errors
    /// The machine has no part with a shape.
    pub(super) fn of(model: &MeshedMachine) -> Result<Self> {
        let mut facets = model.mesh.hull(DETAIL);
        facets.sort_by_key(|facet| facet.part);
        if facets.is_empty() {
            return Err(Error::input("this machine has no part that could be drawn").help("nodes have no shape: describe a [part.NAME]"));
        }
        let mut vertices: Vec<Vertex> = Vec::new();
        let mut at_place: HashMap<(usize, [i64; 3]), Vec<usize>> = HashMap::new();
        let mut corners = Vec::with_capacity(facets.len());
        for (f, facet) in facets.iter().enumerate() {
            let normal = unit(facet.outward);
            let mut own = Vec::with_capacity(facet.corners.len());
            for at in &facet.corners {
                // Corners of neighbours differ by rounding: a micrometre is no distance.
                let near = at_place.entry((facet.body, at.map(|x| (x * 1e6).round() as i64))).or_default();
                let shared = near.iter().copied().find(|v| dot(unit(vertices[*v].normal), normal) > SMOOTH);
                let vertex = shared.unwrap_or_else(|| {
                    near.push(vertices.len());
                    vertices.push(Vertex { at: *at, ..Vertex::default() });
                    vertices.len() - 1
                });
                vertices[vertex].facets.push(f);
                (0..3).for_each(|d| vertices[vertex].normal[d] += normal[d]);
                own.push(vertex);
            }
            corners.push(own);
        }
        Ok(Self { facets, vertices, corners })
    }

    /// Lowest and highest coordinate along each axis, m.
    pub(super) fn bounds(&self) -> [(f64, f64); 3] {
        let along = |d: usize| {
            let all = self.vertices.iter().map(|v| v.at[d]);
            all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
        };
        [0, 1, 2].map(along)
    }

    /// Length of the longest side, m.
    pub(super) fn size(&self) -> f64 {
        self.bounds().iter().map(|(low, high)| high - low).fold(1e-9, f64::max)
    }

    /// Middle of a part, m.
    pub(super) fn middle(&self, part: usize) -> [f64; 3] {
        let own = self.facets.iter().zip(&self.corners).filter(|(facet, _)| facet.part == part);
        let places: Vec<[f64; 3]> = own.flat_map(|(_, corners)| corners.iter().map(|v| self.vertices[*v].at)).collect();
        [0, 1, 2].map(|d| places.iter().map(|at| at[d]).sum::<f64>() / places.len().max(1) as f64)
    }

    /// Temperatures of the vertices, then of the water that leaves each station, degC.
    pub(super) fn temperatures(&self, model: &MeshedMachine, kelvin: &[f64]) -> Vec<f64> {
        let degrees = |t: f64| Celsius::from(Kelvin(t)).0;
        let mean = |facet: &Facet| facet.nodes.iter().map(|n| kelvin[*n]).sum::<f64>() / facet.nodes.len().max(1) as f64;
        let of_facets: Vec<f64> = self.facets.iter().map(|facet| degrees(mean(facet))).collect();
        let of_vertex = |v: &Vertex| v.facets.iter().map(|f| of_facets[*f]).sum::<f64>() / v.facets.len() as f64;
        let water = model.network.streams.iter().flat_map(|s| s.first_node as usize..=s.outlet() as usize).map(|n| degrees(kelvin[n]));
        self.vertices.iter().map(of_vertex).chain(water).collect()
    }

    /// Vertices of the triangles of a facet, around its outward normal, so that a picture can leave out the sides seen from behind.
    pub(super) fn triangles(&self, facet: usize) -> impl Iterator<Item = [usize; 3]> + '_ {
        let (own, corners) = (&self.facets[facet], &self.corners[facet]);
        (2..corners.len()).map(move |k| {
            let [a, b, c] = [own.corners[0], own.corners[k - 1], own.corners[k]];
            let is_turned = dot(cross(minus(b, a), minus(c, a)), own.outward) < 0.0;
            let (second, third) = if is_turned { (corners[k], corners[k - 1]) } else { (corners[k - 1], corners[k]) };
            [corners[0], second, third]
        })
    }
}

/// Share of the length of a channel at which the water leaves each station.
pub(super) fn shares(stream: &Stream) -> Vec<f64> {
    let whole: f64 = stream.stations.iter().map(|s| s.length).sum();
    let passed = stream.stations.iter().scan(0.0, |sum, s| {
        *sum += s.length / whole;
        Some(*sum)
    });
    passed.collect()
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|d| a[d] - b[d])
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = dot(a, a).sqrt();
    if length > 0.0 { a.map(|x| x / length) } else { [0.0, 0.0, 1.0] }
}
