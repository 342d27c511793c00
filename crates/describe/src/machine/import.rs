//! Parts from imported meshes: the file, its unit, the volume and the names on it.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use sha2::{Digest, Sha256};

use super::parts::{Face, Import, Part, Side};
use super::shape::contains;
use crate::gmsh::{Body, MeshFile};
use coldplate_base::document::{Section, Value, suggestion};
use coldplate_base::error::{Error, Result};
use coldplate_base::units::{self, Dimension};

/// Smallest and largest extent of an imported part, m. Chosen: catches a wrong unit, allows every real machine.
const SIZES: (f64, f64) = (1e-6, 1e3);

/// Mesh files that have been read, so that one file may serve several parts.
pub(super) struct Library<'a> {
    /// Folder of relative paths.
    folder: &'a Path,
    read: HashMap<PathBuf, MeshFile>,
}

impl<'a> Library<'a> {
    pub(super) fn new(folder: &'a Path) -> Self {
        Self { folder, read: HashMap::new() }
    }

    fn mesh(&mut self, file: &str) -> Result<&MeshFile> {
        let path = self.folder.join(file);
        if !self.read.contains_key(&path) {
            self.read.insert(path.clone(), MeshFile::read(&path)?);
        }
        self.read.get(&path).ok_or_else(|| Error::input("the mesh cannot be read").in_file(&path))
    }
}

/// The imported volume of a part, if the part has the key `mesh`.
pub(super) fn import(section: &Section<'_>, library: &mut Library<'_>) -> Result<Option<Import>> {
    let Some(value) = section.opt("mesh") else {
        for key in ["volume", "unit"] {
            if section.has(key) {
                return Err(section.error_at(key, format!("'{key}' belongs to an imported mesh")).help("add mesh = \"part.msh\""));
            }
        }
        return Ok(None);
    };
    for key in ["box", "cylinder", "sphere", "blocks"] {
        if section.has(key) {
            return Err(section.error_at(key, format!("'mesh' and '{key}' exclude each other")).help("keep one of them"));
        }
    }
    for key in ["cells", "element_scale"] {
        if section.has(key) {
            return Err(section
                .error_at(key, format!("an imported mesh keeps its own elements, so '{key}' has no effect"))
                .help("remove it; mesh again in Gmsh for smaller elements"));
        }
    }
    let file = value.text()?;
    let scale = match section.opt("unit") {
        None => 1.0,
        Some(unit) => units::convert(1.0, &unit.text()?, Dimension::LENGTH).map_err(|e| unit.place(e))?,
    };
    let mesh = library.mesh(&file)?;
    let volume = section.opt_text("volume")?;
    if let Some(name) = &volume {
        let known = mesh.volume_names();
        if !known.is_empty() && !known.contains(&name.as_str()) {
            return Err(section.error_at("volume", format!("the mesh has no physical volume '{name}'")).help(suggestion(name, &known)));
        }
    }
    let body = mesh.body(volume.as_deref(), scale)?;
    let (low, high) = body.bounds();
    let largest = (0..3).map(|d| high[d] - low[d]).fold(0.0, f64::max);
    let farthest = low.iter().chain(&high).fold(0.0f64, |m, x| m.max(x.abs()));
    if !(SIZES.0..=SIZES.1).contains(&largest) || farthest > 1e4 {
        return Err(value
            .error(format!("the imported volume is {largest:.3e} m long, {farthest:.3e} m from the origin"))
            .help("say which unit the mesh is in, unit = \"mm\" (default m)"));
    }
    Ok(Some(Import { file, body: Arc::new(body), at: [0.0; 3] }))
}

/// The named surface of an imported part.
pub(super) fn face(value: &Value<'_>, part: usize, part_name: &str, body: &Body, block: Option<usize>, name: &str) -> Result<Face> {
    if block.is_some() {
        return Err(value
            .error(format!("'{part_name}' is an imported mesh and has no blocks"))
            .help(format!("write \"{part_name}.NAME\" with the name of a physical surface")));
    }
    if let Some(surface) = body.surface(name) {
        return Ok(Face { part, block: Some(surface), side: Side::Low0 });
    }
    let known: Vec<&str> = body.surfaces.iter().map(|s| s.name.as_str()).collect();
    let what = if body.elsewhere.iter().any(|other| other == name) {
        format!("the physical surface '{name}' of the mesh does not lie on '{part_name}'")
    } else {
        format!("'{part_name}' has no surface '{name}'")
    };
    let help = if known.is_empty() { "it has none: make physical groups of dimension 2 in Gmsh".into() } else { suggestion(name, &known) };
    Err(value.error(what).help(help))
}

/// The hash of the machine file together with the content of its imported volumes.
pub(super) fn hash(document: String, parts: &[Part]) -> String {
    if parts.iter().all(|p| p.import.is_none()) {
        return document;
    }
    let mut hasher = Sha256::new_with_prefix(document.as_bytes());
    for body in parts.iter().filter_map(|p| p.import.as_ref()).map(|i| &i.body) {
        hasher.update(body.name.as_bytes());
        hasher.update(body.mesh_hash.as_bytes());
    }
    hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Checks that no node of an imported mesh lies inside a block, and that no two parts are the same volume. Two imported
/// volumes of different files, and a block inside an imported volume, are not checked.
pub(super) fn check_overlaps(root: &Section<'_>, parts: &[Part]) -> Result<()> {
    let refused = |name: &str, what: String| -> Result<()> {
        let help = "move one with 'at', or leave room for it: imported meshes and blocks may touch, not overlap";
        Err(root.section("part")?.section(name)?.error(what).help(help))
    };
    for (i, part) in parts.iter().enumerate() {
        let Some(import) = &part.import else { continue };
        for other in &parts[..i] {
            let Some(twin) = &other.import else { continue };
            if import.body.mesh_hash == twin.body.mesh_hash && import.body.name == twin.body.name && import.at == twin.at {
                return refused(&part.name, format!("'{}' and '{}' are the same volume in the same place", other.name, part.name));
            }
        }
        let (low, high) = import.body.bounds();
        // Facets cut the corners of curved faces and enter the bodies they touch.
        let margin = 0.02 * (0..3).map(|d| high[d] - low[d]).fold(f64::INFINITY, f64::min);
        for other in parts {
            for block in &other.blocks {
                let inside = |p: &[f64; 3]| contains(&block.shape, std::array::from_fn(|d| p[d] + import.at[d]), -margin);
                if import.body.points.iter().any(inside) {
                    return refused(&part.name, format!("'{}' and '{}' overlap", part.name, other.name));
                }
            }
        }
    }
    Ok(())
}
