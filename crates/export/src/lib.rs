//! Writes an opened surrogate for other languages and programs. Every export gives the answers of the runtime.
//!
//! ```
//! use coldplate_export::{Target, export};
//! use coldplate_runtime::Surrogate;
//!
//! let surrogate = Surrogate::open(include_bytes!("../../runtime/fixtures/polynomial.cps"))?;
//! let files = export(&surrogate, Target::C99, "cold plate")?;
//! let names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
//! assert_eq!(names, ["cold_plate.h", "cold_plate.c"]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![warn(missing_docs)]

mod c99;
mod content;
mod flat;
mod fmu;
mod html;
mod json;
mod modelica;
mod name;
mod octave;
mod onnx;
mod st;
mod template;

use coldplate_runtime::Surrogate;

use content::Content;

/// Format in which a surrogate can be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// Everything in the file as one JSON object.
    Json,
    /// A source file and a header in C99, which compile as C++ too.
    C99,
    /// A source file and a header in C99, in single precision.
    C99Single,
    /// A function file for Octave and MATLAB.
    Octave,
    /// A page with sliders, in one file.
    Html,
    /// An ONNX model in double precision.
    Onnx,
    /// A function block in structured text, for controllers.
    St,
    /// A functional mock-up unit of version 2.0.
    Fmu2,
    /// A functional mock-up unit of version 3.0.
    Fmu3,
    /// A Modelica package.
    Modelica,
}

impl Target {
    /// Every target except those in another precision, in the order in which they are listed for users.
    pub const ALL: [Self; 9] =
        [Self::C99, Self::Fmu2, Self::Fmu3, Self::Html, Self::Json, Self::Modelica, Self::Octave, Self::Onnx, Self::St];

    /// Name by which a user asks for the target.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::Json => "json",
            Self::C99 | Self::C99Single => "c99",
            Self::Octave => "octave",
            Self::Html => "html",
            Self::Onnx => "onnx",
            Self::St => "st",
            Self::Fmu2 => "fmu2",
            Self::Fmu3 => "fmu3",
            Self::Modelica => "modelica",
        }
    }
}

/// A file to write.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// Name of the file, without a folder.
    pub name: String,
    /// Content of the file.
    pub content: Vec<u8>,
    /// Remark on the file for the user, if there is one.
    pub remark: Option<String>,
}

impl File {
    pub(crate) fn new(name: String, content: Vec<u8>) -> Self {
        Self { name, content, remark: None }
    }
}

/// Reason why nothing was written.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum ExportError {
    /// The name has no letter and no digit to make an identifier of.
    Name(String),
    /// The files do not fit into an archive, with the reason.
    Archive(String),
    /// Single precision is not sufficient for the surrogate, with the reason.
    Single(String),
}

impl std::fmt::Display for ExportError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Name(name) => write!(f, "no identifier can be made of the name '{name}': it has no letter from a to z and no digit"),
            Self::Single(reason) => write!(f, "single precision does not do here: {reason}"),
            Self::Archive(reason) => write!(f, "the files do not fit into an archive: {reason}"),
        }
    }
}

impl std::error::Error for ExportError {}

/// Data of a page that a surrogate file alone does not give, each as JSON.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Beside<'a> {
    /// Shape and field of the machine, for its picture in three dimensions.
    pub scene: Option<&'a str>,
    /// How the answers follow variables that were held.
    pub followed: Option<&'a str>,
}

/// The page of [`Target::Html`] with what stands `beside` the surrogate.
///
/// # Errors
/// The name has no letter or digit for an identifier.
pub fn page(surrogate: &Surrogate<'_>, beside: &Beside<'_>, name: &str) -> Result<Vec<File>, ExportError> {
    let identifier = name::identifier(name).ok_or_else(|| ExportError::Name(name.into()))?;
    Ok(html::write(surrogate, &Content::of(surrogate), beside, &identifier))
}

/// A page of a machine in three dimensions at conditions that were solved; `scene` is its shape and temperatures as JSON.
#[must_use]
pub fn states_page(scene: &str) -> String {
    html::states(scene)
}

/// The files of a target. Identifiers and file names begin with `name`, in which everything but letters, digits and
/// underscores becomes an underscore.
///
/// # Errors
/// The name has no letter or digit for an identifier, an archive would be larger than its format allows, or values in
/// single precision would be off by more than a tenth of the half width of their bands and 0.01 of their unit.
pub fn export(surrogate: &Surrogate<'_>, target: Target, name: &str) -> Result<Vec<File>, ExportError> {
    let identifier = name::identifier(name).ok_or_else(|| ExportError::Name(name.into()))?;
    let content = Content::of(surrogate);
    let mut files = match target {
        Target::Json => vec![File::new(format!("{identifier}.json"), json::write(surrogate, &content, None).into_bytes())],
        Target::C99 => c99::write(&content, &identifier),
        Target::C99Single => c99::write_single(surrogate, &content, &identifier)?,
        Target::Octave => octave::write(&content, &identifier),
        Target::Html => html::write(surrogate, &content, &Beside::default(), &identifier),
        Target::Onnx => onnx::write(surrogate, &content, &identifier),
        Target::St => st::write(&content, &identifier),
        Target::Modelica => modelica::write(&content, &identifier),
        Target::Fmu2 => fmu::write(surrogate, &content, &identifier, fmu::Version::Two)?,
        Target::Fmu3 => fmu::write(surrogate, &content, &identifier, fmu::Version::Three)?,
    };
    // No target but the file itself knows these corners.
    if let Some(file) = files.first_mut().filter(|_| surrogate.empty_corners().next().is_some()) {
        let remark = "in corners of the ranges no row was fitted: there the surrogate file says uncertain, \
                      and what was written here does not";
        file.remark = Some(file.remark.take().map_or(remark.to_owned(), |own| format!("{own}; {remark}")));
    }
    Ok(files)
}
