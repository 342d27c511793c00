//! Unstructured grids as VTK and ParaView write them (`.vtu`): the mesh, and the fields at its points and cells.
//!
//! The reader supports the three forms of an array (ascii, inline base64, appended as base64 or raw bytes), both byte
//! orders, headers of 32 and 64 bits, and zlib. An array is decoded on request. Counts that the file states are
//! compared with the bytes present before memory is taken. The format is described in VTK's *File Formats*.

mod array;
mod place;
mod tags;

use std::path::{Path, PathBuf};

pub use place::{MeshPlace, Weight};

use crate::error::{Error, Result, did_you_mean};
use crate::input;
use array::{Array, Coding};

/// Points and cells of one part of the mesh.
#[derive(Debug, Default)]
struct Piece {
    points: usize,
    cells: usize,
    /// Coordinates of the points.
    places: Option<Array>,
    at_points: Vec<Array>,
    at_cells: Vec<Array>,
    /// `connectivity`, `offsets`, `types`.
    topology: Vec<Array>,
}

/// Support of a field: the places at which its values are known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldSupport {
    /// At the points of the mesh.
    Points,
    /// In its cells.
    Cells,
}

/// A file whose arrays can be read.
#[derive(Debug)]
pub struct Vtu {
    file: PathBuf,
    bytes: Vec<u8>,
    coding: Coding,
    pieces: Vec<Piece>,
}

/// A scalar, or one component of a vector: `values[i * components + component]`.
#[derive(Debug, Clone, PartialEq)]
pub struct VtuField {
    /// Support of the field.
    pub support: FieldSupport,
    /// Number of components per point or cell.
    pub components: usize,
    /// All values, point by point or cell by cell.
    pub values: Vec<f64>,
}

/// Cells by their corners.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cells {
    /// Point indices of the corners, cell by cell.
    pub corners: Vec<usize>,
    /// End of each cell's corners in `corners`.
    pub ends: Vec<usize>,
    /// VTK's cell type number of each cell.
    pub shapes: Vec<u8>,
}

impl Vtu {
    /// Reads the description of a file; its arrays are not decoded yet.
    ///
    /// # Errors
    /// The file cannot be read, is no unstructured grid in XML, is cut off, or uses a compression other than zlib.
    pub fn read(path: &Path) -> Result<Vtu> {
        Self::from_bytes(input::read(path).map_err(|e| e.help("check the path"))?, path)
    }

    /// Reads the description of a file from its bytes; `file` is the name used in errors.
    ///
    /// # Errors
    /// Errors of [`Vtu::read`].
    pub fn from_bytes(bytes: Vec<u8>, file: &Path) -> Result<Vtu> {
        let (coding, pieces) = tags::read(&bytes).map_err(|e| e.in_file(file))?;
        Ok(Vtu { file: file.to_path_buf(), bytes, coding, pieces })
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.pieces.iter().map(|p| p.points).fold(0, usize::saturating_add)
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.pieces.iter().map(|p| p.cells).fold(0, usize::saturating_add)
    }

    /// Names of the numeric fields at points and in cells.
    pub fn fields(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for array in self.pieces.iter().flat_map(|p| p.at_points.iter().chain(&p.at_cells)).filter(|a| a.is_numbers()) {
            if !names.contains(&array.name.as_str()) {
                names.push(&array.name);
            }
        }
        names
    }

    /// The field called `name` at points or in cells. If both exist and `support` is `None`, the field at the points.
    ///
    /// # Errors
    /// There is none, parts of the mesh differ in it, or its numbers cannot be read.
    pub fn field(&self, name: &str, support: Option<FieldSupport>) -> Result<VtuField> {
        let has = |own: FieldSupport| self.pieces.iter().any(|piece| piece.find(own, name).is_some());
        let wanted = [FieldSupport::Points, FieldSupport::Cells].into_iter().filter(|own| support.is_none_or(|asked| asked == *own));
        let support = wanted.into_iter().find(|own| has(*own)).ok_or_else(|| self.no_field(name, support))?;
        let (mut components, mut values) = (None, Vec::new());
        for (piece, number) in self.pieces.iter().zip(1..) {
            let count = if support == FieldSupport::Points { piece.points } else { piece.cells };
            if count == 0 {
                continue;
            }
            let array = piece.find(support, name).ok_or_else(|| {
                let what = format!("part {number} of the mesh has no field '{name}'");
                Error::input(what).in_file(&self.file).help("save the field of the whole mesh")
            })?;
            if *components.get_or_insert(array.components) != array.components {
                return Err(Error::input("parts of the mesh have unlike numbers of components").in_file(&self.file).at_key(name));
            }
            values.extend(self.decode(array, count)?);
        }
        Ok(VtuField { support, components: components.unwrap_or(1), values })
    }

    /// Coordinates of the points.
    ///
    /// # Errors
    /// The coordinates are missing, are no triples, or cannot be read.
    pub fn coordinates(&self) -> Result<Vec<[f64; 3]>> {
        let mut all = Vec::new();
        for piece in self.pieces.iter().filter(|p| p.points > 0) {
            let array = piece.places.as_ref().filter(|array| array.components == 3);
            let array = array.ok_or_else(|| {
                Error::input("the coordinates of the points are missing").in_file(&self.file).at_key("Points").help("save the file again")
            })?;
            let values = self.decode(array, piece.points)?;
            all.extend(values.chunks_exact(3).map(|x| [x[0], x[1], x[2]]));
        }
        Ok(all)
    }

    /// The cells; corners count through all parts of the mesh.
    ///
    /// # Errors
    /// The cells cannot be read, or name points that do not exist.
    pub fn mesh(&self) -> Result<Cells> {
        let (mut mesh, mut first) = (Cells::default(), 0);
        for piece in &self.pieces {
            if piece.cells > 0 {
                self.add_cells(piece, first, &mut mesh)?;
            }
            first += piece.points;
        }
        Ok(mesh)
    }

    fn add_cells(&self, piece: &Piece, first: usize, mesh: &mut Cells) -> Result<()> {
        let array = |name: &str| {
            let found = piece.topology.iter().find(|a| a.name == name);
            found.ok_or_else(|| Error::input(format!("the cells lack their {name}")).in_file(&self.file).at_key("Cells"))
        };
        let whole = |value: f64, below: usize, what: &str| {
            let is_one = value >= 0.0 && value.fract() == 0.0 && value < below as f64;
            if is_one { Ok(value as usize) } else { Err(Error::input(what).in_file(&self.file).at_key("Cells").read(value)) }
        };
        let before = mesh.corners.len();
        let mut last = 0;
        for end in self.decode(array("offsets")?, piece.cells)? {
            let end = whole(end, usize::MAX, "this is no end of a cell")?;
            if end < last {
                return Err(Error::input("a cell ends before it begins").in_file(&self.file).at_key("Cells").read(end));
            }
            last = end;
            mesh.ends.push(before.saturating_add(end));
        }
        for corner in self.decode(array("connectivity")?, last)? {
            mesh.corners.push(first + whole(corner, piece.points, "a cell has a corner that is no point")?);
        }
        for shape in self.decode(array("types")?, piece.cells)? {
            mesh.shapes.push(whole(shape, 256, "this is no shape of a cell")? as u8);
        }
        Ok(())
    }

    /// The numbers of an array, `count` times its components.
    fn decode(&self, array: &Array, count: usize) -> Result<Vec<f64>> {
        self.coding.decode(array, count, &self.bytes).map_err(|e| e.at_key(&array.name).in_file(&self.file))
    }

    fn no_field(&self, name: &str, support: Option<FieldSupport>) -> Error {
        let names = self.fields();
        let place = match support {
            None => "",
            Some(FieldSupport::Points) => " at the points",
            Some(FieldSupport::Cells) => " in the cells",
        };
        let help = match did_you_mean(name, names.iter().copied()) {
            Some(meant) if meant != name => format!("did you mean '{meant}'?"),
            _ if names.is_empty() => "the file has a mesh and no numbers on it".into(),
            _ => format!("fields here: {}", names.join(", ")),
        };
        Error::input(format!("there is no field '{name}'{place}")).in_file(&self.file).at_key(name).help(help)
    }
}

impl Piece {
    fn find(&self, support: FieldSupport, name: &str) -> Option<&Array> {
        let all = if support == FieldSupport::Points { &self.at_points } else { &self.at_cells };
        all.iter().find(|array| array.name == name && array.is_numbers())
    }
}
