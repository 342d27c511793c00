//! Reading tetrahedral meshes in Gmsh's MSH 4.1 format, text or binary.
//!
//! [`MeshFile::read`] takes from a file the content that a thermal model needs: nodes, tetrahedra, triangles, and the
//! *physical groups* that name volumes and surfaces. [`MeshFile::body`] cuts one named volume out of it: its own numbering,
//! its boundary, and the named surfaces that lie on it. Format: Gmsh reference manual, section "MSH file format",
//! version 4.1.
//!
//! Counts stated in a file are checked against the bytes left in it before memory is taken, and every error names the
//! file and the line (text), byte (binary) or element tag.

mod body;
mod sections;
mod source;

pub use body::{Body, NamedSurface};

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use coldplate_base::error::{Error, Result};
use coldplate_base::input;

/// Help text: how to save a mesh that this program can read.
const SAVE_AS: &str = "save it with Gmsh: gmsh model.geo -3 -format msh41 -o model.msh (or set Mesh.MshFileVersion = 4.1)";

/// A mesh file: all volumes it holds.
#[derive(Debug, Clone, Default)]
pub struct MeshFile {
    /// The file the mesh came from.
    pub file: PathBuf,
    /// SHA-256 of the file, in hexadecimal.
    pub hash: String,
    /// Coordinates of the nodes in the file's own length unit.
    pub points: Vec<[f64; 3]>,
    /// Corners of the tetrahedra (indices into the points), in the file's order.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Gmsh's number of each tetrahedron.
    pub tags: Vec<u64>,
    /// Corners of the triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Runs of tetrahedra with the volume entity they belong to.
    volume_runs: Vec<(i64, Range<usize>)>,
    /// Runs of triangles with the surface entity they belong to.
    surface_runs: Vec<(i64, Range<usize>)>,
    /// Physical groups of volumes: name and volume entities.
    volumes: Vec<Group>,
    /// Physical groups of surfaces: name and surface entities.
    surfaces: Vec<Group>,
    /// Number of elements of second or higher order, which are used with their corners alone.
    pub curved: usize,
}

/// A physical group.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Group {
    name: String,
    entities: Vec<i64>,
}

impl MeshFile {
    /// Reads a mesh file.
    ///
    /// # Errors
    /// The file cannot be read, is not MSH 4.1, is cut off or contradicts itself, or holds no tetrahedra.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = input::read(path).map_err(|e| e.help("check the path; it counts from the folder of the machine file"))?;
        Self::from_bytes(&bytes, path)
    }

    /// Reads a mesh from the bytes of a file; `file` is the name used in errors.
    ///
    /// # Errors
    /// Errors of [`MeshFile::read`].
    pub fn from_bytes(bytes: &[u8], file: &Path) -> Result<Self> {
        let raw = sections::read(bytes).map_err(|e| e.in_file(file))?;
        let mut mesh = raw.mesh().map_err(|e| e.in_file(file))?;
        mesh.file = file.to_path_buf();
        mesh.hash = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(mesh)
    }

    /// Names of the volumes.
    pub fn volume_names(&self) -> Vec<&str> {
        self.volumes.iter().map(|g| g.name.as_str()).collect()
    }

    /// Index of the volume called `name`; without a name, of the only volume.
    ///
    /// # Errors
    /// There is no volume of this name, no named volume at all, or several to choose from.
    fn volume(&self, name: Option<&str>) -> Result<usize> {
        let names = self.volume_names();
        if names.is_empty() {
            return Err(Error::input("no volume of this mesh has a name")
                .in_file(&self.file)
                .help("make a physical group of dimension 3 in Gmsh, Physical Volume(\"bracket\") = {1}; and mesh again"));
        }
        match name {
            Some(name) => names.iter().position(|n| *n == name).ok_or_else(|| {
                let help = format!("its physical volumes: {}", names.join(", "));
                Error::input(format!("the mesh has no physical volume '{name}'")).in_file(&self.file).help(help)
            }),
            None if names.len() == 1 => Ok(0),
            None => Err(Error::input("the mesh has several volumes and none is chosen")
                .in_file(&self.file)
                .help(format!("add volume = \"NAME\", one of: {}", names.join(", ")))),
        }
    }

    /// The volume called `name` (without a name, the only one), with coordinates multiplied by `scale` (m per unit of
    /// the file).
    ///
    /// # Errors
    /// There is no volume of this name, or its tetrahedra are flat, tangled or of other kinds.
    pub fn body(&self, name: Option<&str>, scale: f64) -> Result<Body> {
        let volume = self.volume(name)?;
        Body::new(self, volume, scale).map_err(|e| e.in_file(&self.file))
    }
}

/// Everything a file holds, before tags are replaced by indices.
#[derive(Debug, Default)]
struct Raw {
    /// Names of the physical groups by dimension and tag.
    names: BTreeMap<(i64, i64), String>,
    /// Physical tags of each surface (2) and volume (3) entity.
    physical: BTreeMap<(i64, i64), Vec<i64>>,
    node_tags: Vec<u64>,
    points: Vec<[f64; 3]>,
    /// Corners as node tags.
    tetrahedra: Vec<[u64; 4]>,
    tags: Vec<u64>,
    triangles: Vec<[u64; 3]>,
    triangle_tags: Vec<u64>,
    volume_runs: Vec<(i64, Range<usize>)>,
    surface_runs: Vec<(i64, Range<usize>)>,
    curved: usize,
    /// The first volume element that is no tetrahedron, per volume entity: its name and tag.
    others: BTreeMap<i64, (&'static str, u64)>,
    /// Whether there is any element of a surface.
    has_surface_elements: bool,
}

impl Raw {
    /// Replaces tags by indices and collects the groups.
    fn mesh(self) -> Result<MeshFile> {
        if let Some((kind, tag)) = self.others.values().next() {
            return Err(Error::input(format!("element {tag} is a {kind}; only tetrahedra can be used"))
                .at_key(format!("element {tag}"))
                .help("mesh the volume with tetrahedra alone: no transfinite, recombined or extruded-with-layers volumes"));
        }
        if self.tetrahedra.is_empty() {
            let what = if self.has_surface_elements { "the mesh has surface elements only" } else { "the mesh has no tetrahedra" };
            return Err(Error::input(what).help("mesh in three dimensions: gmsh model.geo -3"));
        }
        let index = Numbers::new(&self.node_tags)?;
        let corner = |node: u64, tag: u64| {
            index.of(node).ok_or_else(|| {
                Error::input(format!("element {tag} has a corner at node {node}, which the file does not hold"))
                    .at_key(format!("element {tag}"))
                    .help("the file is damaged; save the mesh again")
            })
        };
        let mut tetrahedra = Vec::with_capacity(self.tetrahedra.len());
        for (nodes, tag) in self.tetrahedra.iter().zip(&self.tags) {
            tetrahedra.push([corner(nodes[0], *tag)?, corner(nodes[1], *tag)?, corner(nodes[2], *tag)?, corner(nodes[3], *tag)?]);
        }
        let mut triangles = Vec::with_capacity(self.triangles.len());
        for (nodes, tag) in self.triangles.iter().zip(&self.triangle_tags) {
            triangles.push([corner(nodes[0], *tag)?, corner(nodes[1], *tag)?, corner(nodes[2], *tag)?]);
        }
        Ok(MeshFile {
            points: self.points,
            tetrahedra,
            tags: self.tags,
            triangles,
            volumes: groups(3, &self.physical, &self.names, &self.volume_runs),
            surfaces: groups(2, &self.physical, &self.names, &self.surface_runs),
            volume_runs: self.volume_runs,
            surface_runs: self.surface_runs,
            curved: self.curved,
            ..MeshFile::default()
        })
    }
}

/// The physical groups of one dimension that hold elements; a group without a name goes by its number.
fn groups(
    dimension: i64,
    physical: &BTreeMap<(i64, i64), Vec<i64>>,
    names: &BTreeMap<(i64, i64), String>,
    runs: &[(i64, Range<usize>)],
) -> Vec<Group> {
    let mut found: BTreeMap<i64, Vec<i64>> = BTreeMap::new();
    for ((_, entity), tags) in physical.iter().filter(|((d, _), _)| *d == dimension) {
        if runs.iter().any(|(e, _)| e == entity) {
            // A negative tag marks an orientation.
            tags.iter().for_each(|tag| found.entry(tag.abs()).or_default().push(*entity));
        }
    }
    let name = |tag: i64| names.get(&(dimension, tag)).cloned().unwrap_or_else(|| tag.to_string());
    found.into_iter().map(|(tag, entities)| Group { name: name(tag), entities }).collect()
}

/// Node tags to indices: a table where the tags are dense, a sorted list where they are sparse.
enum Numbers {
    Dense(Vec<u32>),
    Sparse(Vec<(u64, u32)>),
}

impl Numbers {
    fn new(tags: &[u64]) -> Result<Self> {
        let twice = |tag: u64| {
            Err(Error::input(format!("node {tag} is there twice"))
                .at_key(format!("node {tag}"))
                .help("the file is damaged; save the mesh again"))
        };
        if u32::try_from(tags.len()).is_err() {
            return Err(Error::input("more nodes than can be numbered").read(tags.len()).help("use a coarser mesh"));
        }
        let largest = tags.iter().copied().max().unwrap_or(0);
        if largest <= 8 * tags.len() as u64 + 1024 {
            let mut table = vec![u32::MAX; largest as usize + 1];
            for (i, tag) in tags.iter().enumerate() {
                if table[*tag as usize] != u32::MAX {
                    return twice(*tag);
                }
                table[*tag as usize] = i as u32;
            }
            return Ok(Self::Dense(table));
        }
        let mut list: Vec<(u64, u32)> = tags.iter().enumerate().map(|(i, tag)| (*tag, i as u32)).collect();
        list.sort_unstable();
        if let Some(pair) = list.windows(2).find(|w| w[0].0 == w[1].0) {
            return twice(pair[0].0);
        }
        Ok(Self::Sparse(list))
    }

    fn of(&self, tag: u64) -> Option<u32> {
        match self {
            Self::Dense(table) => table.get(usize::try_from(tag).ok()?).copied().filter(|i| *i != u32::MAX),
            Self::Sparse(list) => list.binary_search_by_key(&tag, |entry| entry.0).ok().map(|at| list[at].1),
        }
    }
}
