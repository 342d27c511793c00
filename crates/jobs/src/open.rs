//! Files of all kinds: a file is known by its first bytes, or else by the ending of its name.

use std::path::{Path, PathBuf};

use coldplate_runtime::format;

use coldplate_base::document::Document;
use coldplate_base::error::Result;
use coldplate_base::input;
use coldplate_describe::machine::Machine;
use coldplate_explore::sweep::journal;
use coldplate_reduce::ReducedModel;
use coldplate_surrogate::fit::file;
use coldplate_surrogate::verdict::Surrogate;

/// Kind of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// Surrogate, usually `.cps`.
    Surrogate,
    /// Reduced model of a machine, usually `.cpr`.
    ReducedModel,
    /// Journal of a sweep.
    Journal,
    /// Table, by the ending `.csv` or `.parquet`.
    Table,
    /// Machine, sweep or chart definition, by the ending `.toml`.
    Document,
    /// Neither content nor name of any of these.
    Unknown,
}

impl FileKind {
    /// Kind by the ending of a name: table, document or unknown.
    pub fn by_name(path: &Path) -> Self {
        match path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).as_deref() {
            Some("csv" | "parquet") => Self::Table,
            Some("toml") => Self::Document,
            _ => Self::Unknown,
        }
    }
}

/// Kind of a TOML file, by the tables at its head.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DocumentKind {
    /// Machine: it has parts or nodes.
    Machine,
    /// Sweep: it names a machine or another solver, and conditions.
    Sweep,
    /// Chart definition: it names a figure.
    Chart,
}

impl DocumentKind {
    /// Kind of a file; `None` if it has the tables of no kind.
    pub fn of(document: &Document) -> Option<Self> {
        let root = document.root();
        match () {
            () if root.has("figure") => Some(Self::Chart),
            () if (root.has("machine") || root.has("solver")) && (root.has("design") || root.has("one_factor")) => Some(Self::Sweep),
            () if root.has("part") || root.has("node") => Some(Self::Machine),
            () => None,
        }
    }
}

/// A file that has been read.
#[derive(Debug)]
pub struct OpenFile {
    /// Kind of the file.
    pub kind: FileKind,
    /// Path of the file.
    pub path: PathBuf,
    /// Content of the file.
    pub bytes: Vec<u8>,
}

/// Reads a file and tells its kind.
///
/// # Errors
/// The file cannot be read.
pub fn open(path: &Path) -> Result<OpenFile> {
    let bytes = input::read(path)?;
    let kind = match &bytes {
        own if own.starts_with(&format::MAGIC) => FileKind::Surrogate,
        own if own.starts_with(ReducedModel::FAMILY) => FileKind::ReducedModel,
        own if own.starts_with(journal::MAGIC.as_bytes()) => FileKind::Journal,
        _ => FileKind::by_name(path),
    };
    Ok(OpenFile { kind, path: path.to_path_buf(), bytes })
}

impl OpenFile {
    /// The surrogate in the file.
    ///
    /// # Errors
    /// The file is none, or is damaged.
    pub fn surrogate(&self) -> Result<Surrogate<'_>> {
        file::open(&self.bytes).map_err(|e| e.in_file(&self.path))
    }

    /// The reduced model in the file.
    ///
    /// # Errors
    /// The file is none, or is damaged.
    pub fn reduced_model(&self) -> Result<ReducedModel> {
        ReducedModel::from_bytes(&self.bytes).map_err(|e| e.in_file(&self.path))
    }

    /// The TOML text of the file with `sets` (key, value) applied to it.
    ///
    /// # Errors
    /// The file is not UTF-8 or not TOML; errors of [`Document::apply_set`].
    pub fn document(&self, sets: &[(String, String)]) -> Result<Document> {
        Document::parse(input::utf8(&self.bytes, &self.path)?, &self.path)?.with_sets(sets)
    }

    /// The machine in the file with `sets` (key, value) applied to it.
    ///
    /// # Errors
    /// Errors of [`OpenFile::document`] and [`Machine::from_document`].
    pub fn machine(&self, sets: &[(String, String)]) -> Result<Machine> {
        Machine::from_document(&self.document(sets)?)
    }
}
