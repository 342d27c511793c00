//! Charts as data: a TOML file says which figure, from which sweep, surrogate, table or machine, of which points and
//! variables, at which held conditions.
//!
//! Every kind of figure is one file in this folder, with its keys and its drawing. A new kind is a file and its line
//! in the list of `kinds!`; `docs/how-to/charts.md` has the keys.

mod acceptability;
mod accuracy;
mod borders;
mod heat;
pub mod history;
pub mod limits;
pub(crate) mod machine;
mod measured;
mod model;
mod one_factor;
mod published;
pub mod results;
pub(crate) mod sankey;
mod scan;
mod sheet;
mod slices;
mod source;
mod state;

use std::path::{Path, PathBuf};

use super::gallery::Gallery;
use coldplate_base::document::{Document, Section, suggestion};
use coldplate_base::error::{Error, Result};
use coldplate_figures::chart::Figure;
use coldplate_figures::chart::one_factor::OneFactorFigure;
use coldplate_figures::chart::resized::Resized;
use results::Results;
pub use sheet::operator_sheet;

/// Keys that every definition may have.
const COMMON: [&str; 4] = ["figure", "title", "width", "notes"];
/// Narrowest and widest picture, CSS pixels. Chosen: narrower cannot be read, wider has no use.
const WIDTHS: (usize, usize) = (240, 4000);

/// The list of kinds: the name in the file, and the type that reads its keys and draws it.
macro_rules! kinds {
    ($($name:literal => $variant:ident($kind:ty),)*) => {
        /// The figure that is drawn.
        #[derive(Debug, Clone)]
        enum Kind {
            $($variant($kind),)*
        }

        /// The names of all kinds of figures, as a definition gives them under `figure`.
        pub const KINDS: &[&str] = &[$($name),*];

        impl Kind {
            fn read(name: &str, root: &Section<'_>, folder: &Path) -> Result<Option<Self>> {
                Ok(match name {
                    $($name => Some(Self::$variant(<$kind>::read(root, folder)?)),)*
                    _ => None,
                })
            }

            fn draw(&self, head: &Head, results: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
                match self {
                    $(Self::$variant(kind) => kind.draw(head, results, gallery),)*
                }
            }
        }
    };
}

kinds! {
    "acceptability" => Acceptability(acceptability::AcceptabilityChart),
    "borders" => Borders(borders::BordersChart),
    "operator_sheet" => Sheet(sheet::SheetChart),
    "slices" => Slices(slices::SlicesChart),
    "one_factor" => OneFactor(one_factor::OneFactorChart),
    "published" => Published(published::PublishedChart),
    "parity" => Parity(accuracy::ParityChart),
    "residuals" => Residuals(accuracy::ResidualsChart),
    "errors" => Errors(accuracy::ErrorsChart),
    "machine" => Machine(machine::MachineChart),
    "model" => Model(model::ModelChart),
    "measured" => Measured(measured::MeasuredChart),
    "heat" => Heat(heat::HeatChart),
    "sankey" => Sankey(sankey::SankeyChart),
    "scan" => Scan(scan::ScanChart),
}

/// A chart definition that has been read.
#[derive(Debug, Clone)]
pub struct Chart {
    head: Head,
    kind: Kind,
}

/// Head that all definitions have in common.
#[derive(Debug, Clone)]
struct Head {
    /// Name of the file without its extension; the pictures are called after it.
    name: String,
    /// Kind of the figure.
    topic: &'static str,
    title: Option<String>,
    width: Option<f64>,
    notes: Vec<String>,
    document: Document,
}

impl Chart {
    /// Reads a definition. Names of variables and points are checked when it is drawn, against the source it names.
    ///
    /// # Errors
    /// The file cannot be read or is not TOML; a key is missing, unknown or wrong.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let document = Document::read(path)?;
        let root = document.root();
        if !root.has("figure") && ["part", "node", "variables"].iter().any(|key| root.has(key)) {
            return Err(root
                .error("this is a machine file, not a chart definition")
                .help("write a definition that names it: figure = \"machine\" and machine = \"FILE.toml\"; charts/ has examples"));
        }
        let at = root.choice("figure", KINDS)?;
        let title = root.opt_text("title")?;
        let width = match root.opt("width") {
            Some(value) => Some(value.integer(WIDTHS.0)?).filter(|w| *w <= WIDTHS.1).map(|w| Some(w as f64)).ok_or_else(|| {
                value.error("a picture this wide is of no use").help(format!("from {} to {} CSS pixels", WIDTHS.0, WIDTHS.1))
            })?,
            None => None,
        };
        let name = path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        let notes = root.opt_texts("notes")?.unwrap_or_default();
        let folder = path.parent().unwrap_or(Path::new(""));
        let kind = Kind::read(KINDS[at], &root, folder)?;
        for key in COMMON {
            let _ = root.has(key);
        }
        root.finish()?;
        // The name was chosen from the list, so it is in it.
        let kind = kind.ok_or_else(|| Error::input("no such figure").help(suggestion("", KINDS)))?;
        Ok(Self { head: Head { name, topic: KINDS[at], title, width, notes, document }, kind })
    }

    /// Name of the definition: its file without the extension.
    pub fn name(&self) -> &str {
        &self.head.name
    }

    /// Kind of the figure, one of [`KINDS`].
    pub fn figure(&self) -> &'static str {
        self.head.topic
    }

    /// Draws the chart into the gallery. Conditions of a sweep that are missing are solved first.
    ///
    /// # Errors
    /// A name that its source does not know, a source that cannot be read or solved, a figure that cannot be written.
    pub fn draw(&self, results: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
        self.kind.draw(&self.head, results, gallery)
    }
}

impl Head {
    fn root(&self) -> Section<'_> {
        self.document.root()
    }

    /// The title of the definition, or else this one.
    fn title(&self, usual: impl Into<String>) -> String {
        self.title.clone().unwrap_or_else(|| usual.into())
    }

    /// Notes of the figure, those of the definition behind them.
    fn notes(&self, usual: impl IntoIterator<Item = String>) -> Vec<String> {
        usual.into_iter().chain(self.notes.iter().cloned()).collect()
    }

    /// Places an error that does not know its place at a key of the definition.
    fn place(&self, error: Error, key: &str) -> Error {
        match self.root().opt(key) {
            Some(value) => value.place(error),
            None => error.in_file(self.document.file()),
        }
    }

    /// Draws figures of curves, numbered where there are several.
    fn add_curves(&self, gallery: &mut Gallery, figures: Vec<OneFactorFigure>) -> Result<()> {
        let count = figures.len();
        for (i, mut figure) in figures.into_iter().enumerate() {
            if let Some(title) = &self.title {
                figure.title = if count > 1 { format!("{title} ({} of {count})", i + 1) } else { title.clone() };
            }
            figure.notes = self.notes(figure.notes);
            let name = if count > 1 { format!("{}_{}", self.name, i + 1) } else { self.name.clone() };
            self.add_as(gallery, &name, &figure)?;
        }
        Ok(())
    }

    /// Draws a figure in the size asked for.
    fn add(&self, gallery: &mut Gallery, figure: &dyn Figure) -> Result<()> {
        self.add_as(gallery, &self.name, figure)
    }

    fn add_as(&self, gallery: &mut Gallery, name: &str, figure: &dyn Figure) -> Result<()> {
        match self.width {
            Some(width) => gallery.add(name, self.topic, &Resized { figure, width }),
            None => gallery.add(name, self.topic, figure),
        }
    }
}

/// The entries of `names` that the list under `key` asks for, in its order; all of them without that key.
fn chosen(root: &Section<'_>, key: &str, names: &[&str]) -> Result<Vec<usize>> {
    match root.opt_list(key)? {
        None => Ok((0..names.len()).collect()),
        Some(list) => list.iter().map(|value| value.choice(names)).collect(),
    }
}

/// A path in a definition, found from its folder.
fn path_of(root: &Section<'_>, folder: &Path, key: &str) -> Result<PathBuf> {
    Ok(folder.join(root.text(key)?))
}

/// Draws definitions one after the other; all are read before the first is drawn.
///
/// # Errors
/// Errors of [`Chart::read`] and [`Chart::draw`].
pub fn draw_all(paths: &[PathBuf], results: &mut Results<'_>, folder: &Path) -> Result<Vec<PathBuf>> {
    let charts = paths.iter().map(Chart::read).collect::<Result<Vec<_>>>()?;
    let mut gallery = Gallery::new(folder)?;
    for chart in &charts {
        chart.draw(results, &mut gallery)?;
    }
    Ok(gallery.files())
}
