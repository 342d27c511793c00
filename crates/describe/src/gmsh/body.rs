//! One named volume of a mesh: its tetrahedra, its boundary, and the names on it.

use std::collections::HashMap;

use super::MeshFile;
use coldplate_base::error::{Error, Result};

/// Size below which a tetrahedron counts as flat: its volume over the cube of the root of the summed squared edges
/// (dimensionless). Chosen: well above the rounding of coordinates, far below the worst usable tetrahedron.
const FLAT: f64 = 1e-9;

/// A volume cut out of a mesh file, in its own numbering.
#[derive(Debug, Clone, Default)]
pub struct Body {
    /// Name of the physical volume.
    pub name: String,
    /// SHA-256 of the mesh file, in hexadecimal.
    pub mesh_hash: String,
    /// Nodes, m.
    pub points: Vec<[f64; 3]>,
    /// Tetrahedra, all positively oriented: (b - a) x (c - a) . (d - a) > 0.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Boundary triangles, their normals pointing outward.
    pub faces: Vec<[u32; 3]>,
    /// Physical surfaces that have triangles on the boundary.
    pub surfaces: Vec<NamedSurface>,
    /// Physical surfaces of the file without triangles on this boundary.
    pub elsewhere: Vec<String>,
    /// Number of pieces that share no node.
    pub pieces: usize,
    /// The worst shape among the tetrahedra: mean ratio, 1 for a regular one, 0 for a flat one.
    pub worst_quality: f64,
    /// Number of elements of second or higher order, which are used with their corners alone.
    pub curved: usize,
}

/// A named part of the boundary.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedSurface {
    /// Name of the physical surface.
    pub name: String,
    /// Indices into [`Body::faces`], ascending.
    pub faces: Vec<u32>,
}

/// The faces of a positively oriented tetrahedron, normals outward.
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

impl Body {
    /// Cuts out the physical volume with index `volume`.
    pub(super) fn new(mesh: &MeshFile, volume: usize, scale: f64) -> Result<Self> {
        let group = &mesh.volumes[volume];
        let mut body = Self { name: group.name.clone(), mesh_hash: mesh.hash.clone(), worst_quality: 1.0, ..Self::default() };
        let mut local = vec![u32::MAX; mesh.points.len()];
        let runs = mesh.volume_runs.iter().filter(|(entity, _)| group.entities.contains(entity));
        let mut tags = Vec::new();
        for (_, range) in runs {
            let mut run = mesh.tetrahedra[range.clone()].to_vec();
            orient(mesh, &mut run, &mesh.tags[range.clone()], scale, &mut body.worst_quality)?;
            body.tetrahedra.append(&mut run);
            tags.extend_from_slice(&mesh.tags[range.clone()]);
        }
        // Nodes keep the order of the file.
        for corner in body.tetrahedra.iter().flatten() {
            local[*corner as usize] = 0;
        }
        for (at, number) in local.iter_mut().enumerate().filter(|(_, number)| **number == 0) {
            *number = body.points.len() as u32;
            body.points.push(mesh.points[at].map(|x| x * scale));
        }
        body.tetrahedra.iter_mut().flatten().for_each(|corner| *corner = local[*corner as usize]);
        body.pieces = pieces(&body.tetrahedra, body.points.len());
        body.faces = boundary(&body.tetrahedra, body.points.len(), &tags)?;
        body.curved = mesh.curved.min(body.tetrahedra.len());
        body.name_surfaces(mesh, &local);
        Ok(body)
    }

    /// Volume of a tetrahedron, m³.
    pub fn volume(&self, tetrahedron: usize) -> f64 {
        signed_volume(self.tetrahedra[tetrahedron].map(|i| self.points[i as usize]))
    }

    /// The surface called `name`.
    pub fn surface(&self, name: &str) -> Option<usize> {
        self.surfaces.iter().position(|s| s.name == name)
    }

    /// Smallest and largest coordinates, m.
    pub fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let mut bounds = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for point in &self.points {
            for (d, x) in point.iter().enumerate() {
                bounds.0[d] = bounds.0[d].min(*x);
                bounds.1[d] = bounds.1[d].max(*x);
            }
        }
        bounds
    }

    fn name_surfaces(&mut self, mesh: &MeshFile, local: &[u32]) {
        let sorted = |mut t: [u32; 3]| {
            t.sort_unstable();
            t
        };
        let place: HashMap<[u32; 3], u32> = self.faces.iter().enumerate().map(|(i, f)| (sorted(*f), i as u32)).collect();
        for group in &mesh.surfaces {
            let runs = mesh.surface_runs.iter().filter(|(entity, _)| group.entities.contains(entity));
            let triangles = runs.flat_map(|(_, range)| &mesh.triangles[range.clone()]);
            let mut faces: Vec<u32> = triangles
                .map(|t| t.map(|i| local[i as usize]))
                .filter_map(|t| if t.contains(&u32::MAX) { None } else { place.get(&sorted(t)).copied() })
                .collect();
            faces.sort_unstable();
            faces.dedup();
            if faces.is_empty() {
                self.elsewhere.push(group.name.clone());
            } else {
                self.surfaces.push(NamedSurface { name: group.name.clone(), faces });
            }
        }
    }
}

fn signed_volume(p: [[f64; 3]; 4]) -> f64 {
    let e = |i: usize| [0, 1, 2].map(|d| p[i][d] - p[0][d]);
    let (a, b, c) = (e(1), e(2), e(3));
    (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6.0
}

/// Turns the tetrahedra of one entity to positive volumes. All of them may be inverted; if only some are, the mesh is
/// tangled.
fn orient(mesh: &MeshFile, run: &mut [[u32; 4]], tags: &[u64], scale: f64, worst: &mut f64) -> Result<()> {
    let mut first_negative = None;
    let mut negative = 0;
    for (corners, tag) in run.iter_mut().zip(tags) {
        let points = corners.map(|i| mesh.points[i as usize]);
        let volume = signed_volume(points);
        let mut squares = 0.0;
        for (i, p) in points.iter().enumerate() {
            for q in &points[..i] {
                squares += (0..3).map(|d| (p[d] - q[d]).powi(2)).sum::<f64>();
            }
        }
        let place = |error: Error| error.at_key(format!("element {tag}"));
        let is_solid = volume.abs() > FLAT * squares * squares.sqrt();
        if !is_solid || !(volume * scale * scale * scale).is_normal() {
            return Err(place(Error::input(format!("the tetrahedron {tag} is flat: it has no volume")))
                .read(format!("{volume:e} (unit of the file)^3"))
                .help("mesh again, with optimization (Mesh.Optimize = 1) or another size"));
        }
        // Mean ratio: 12 (3 V)^(2/3) over the summed squared edges.
        *worst = worst.min(12.0 * (3.0 * volume.abs()).powf(2.0 / 3.0) / squares);
        if volume < 0.0 {
            negative += 1;
            first_negative.get_or_insert(*tag);
            corners.swap(2, 3);
        }
    }
    match first_negative {
        Some(tag) if negative < run.len() => {
            Err(Error::input(format!("the tetrahedron {tag} is turned inside out, with {} others of its volume", negative - 1))
                .at_key(format!("element {tag}"))
                .read(format!("{negative} of {} with negative volume", run.len()))
                .help(
                    "the mesh is tangled; mesh again, with optimization (Mesh.Optimize = 1, for second order Mesh.HighOrderOptimize = 1)",
                ))
        }
        _ => Ok(()),
    }
}

/// Number of groups of tetrahedra that share no node.
fn pieces(tetrahedra: &[[u32; 4]], points: usize) -> usize {
    let mut root: Vec<u32> = (0..points as u32).collect();
    fn find(root: &mut [u32], mut i: u32) -> u32 {
        while root[i as usize] != i {
            root[i as usize] = root[root[i as usize] as usize];
            i = root[i as usize];
        }
        i
    }
    for t in tetrahedra {
        let first = find(&mut root, t[0]);
        for corner in &t[1..] {
            let other = find(&mut root, *corner);
            root[other as usize] = first;
        }
    }
    (0..points).filter(|i| root[*i] == *i as u32).count()
}

/// The faces that belong to one tetrahedron only.
fn boundary(tetrahedra: &[[u32; 4]], points: usize, tags: &[u64]) -> Result<Vec<[u32; 3]>> {
    // Faces are gathered by their lowest node; the rest of the key is sorted within.
    let key = |t: &[u32; 4], f: usize| {
        let mut k = FACES[f].map(|i| t[i]);
        k.sort_unstable();
        k
    };
    let mut starts = vec![0usize; points + 1];
    for t in tetrahedra {
        for f in 0..4 {
            starts[key(t, f)[0] as usize + 1] += 1;
        }
    }
    for i in 0..points {
        starts[i + 1] += starts[i];
    }
    let mut next = starts.clone();
    let mut gathered = vec![(0u32, 0u32, 0u32, 0u8); 4 * tetrahedra.len()];
    for (i, t) in tetrahedra.iter().enumerate() {
        for f in 0..4 {
            let k = key(t, f);
            let at = &mut next[k[0] as usize];
            gathered[*at] = (k[1], k[2], i as u32, f as u8);
            *at += 1;
        }
    }
    let mut open: Vec<(u32, u8)> = Vec::new();
    for i in 0..points {
        let bucket = &mut gathered[starts[i]..starts[i + 1]];
        bucket.sort_unstable();
        let mut at = 0;
        while at < bucket.len() {
            let same = bucket[at..].iter().take_while(|g| (g.0, g.1) == (bucket[at].0, bucket[at].1)).count();
            match same {
                1 => open.push((bucket[at].2, bucket[at].3)),
                2 => {}
                _ => {
                    let tag = tags[bucket[at].2 as usize];
                    return Err(Error::input(format!("{same} tetrahedra share one face, {tag} among them: they overlap"))
                        .at_key(format!("element {tag}"))
                        .help("the mesh holds elements twice; save it once, without duplicates (Coherence Mesh)"));
                }
            }
            at += same;
        }
    }
    open.sort_unstable();
    Ok(open.into_iter().map(|(t, f)| FACES[f as usize].map(|i| tetrahedra[t as usize][i])).collect())
}
