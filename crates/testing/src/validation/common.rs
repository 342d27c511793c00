//! What every section needs: files of the project, tables in Markdown, verdicts.

use std::path::PathBuf;

use coldplate_base::error::{Error, Result};
use coldplate_base::units::{Celsius, Kelvin};
use coldplate_evidence::measurement::Data;
use coldplate_figures::chart::{Figure, draw_as};
use coldplate_solve::study::Study;

/// How a published claim fared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// Our number agrees.
    Reproduced,
    /// More is known than was published, or it is nearer to the measurement.
    Improved,
    /// The published number cannot stand beside another one, or beside arithmetic.
    Contradicted,
    /// A target of this project that is not reached.
    Missed,
}

/// One line of the overview.
#[derive(Debug, Clone)]
pub struct Verdict {
    pub outcome: Outcome,
    pub what: String,
    pub figure: String,
}

/// A line of the overview.
pub fn verdict(outcome: Outcome, what: impl Into<String>, figure: impl Into<String>) -> Verdict {
    Verdict { outcome, what: what.into(), figure: figure.into() }
}

/// A section of the page.
#[derive(Debug, Default)]
pub struct Section {
    pub text: String,
    pub verdicts: Vec<Verdict>,
}

/// A file of the project.
pub fn project(name: &str) -> PathBuf {
    crate::root().join(name)
}

/// A machine of the project with changes, on about `cells` cells.
pub fn study(machine: &str, sets: &[(String, String)], cells: Option<usize>) -> Result<Study> {
    Study::read(project("machines").join(machine), sets, cells)
}

/// Owned `--set` pairs.
pub fn owned(sets: &[(&str, &str)]) -> Vec<(String, String)> {
    sets.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect()
}

/// Rows of a small CSV file without quotes: header, then cells; `#` starts a remark.
pub struct Records {
    header: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl Records {
    /// Reads `data/paper/NAME`.
    pub fn read(name: &str) -> Result<Self> {
        let path = project("data/paper").join(name);
        let text = std::fs::read_to_string(&path).map_err(|e| Error::file("read", &path, e))?;
        let cells = |line: &str| line.split(',').map(|c| c.trim().to_string()).collect::<Vec<_>>();
        let mut lines = text.lines().filter(|l| !l.starts_with('#') && !l.trim().is_empty()).map(cells);
        let header = lines.next().unwrap_or_default();
        let rows: Vec<Vec<String>> = lines.collect();
        if rows.iter().any(|r| r.len() != header.len()) {
            return Err(Error::input("a row has another number of cells than the header").in_file(&path));
        }
        Ok(Self { header, rows })
    }

    /// A cell by the name of its column.
    pub fn text<'a>(&self, row: &'a [String], column: &str) -> Result<&'a str> {
        let at = self.header.iter().position(|h| h == column);
        at.and_then(|i| row.get(i)).map(String::as_str).ok_or_else(|| Error::input(format!("there is no column '{column}'")))
    }

    /// A number, or nothing where the cell is empty.
    pub fn number(&self, row: &[String], column: &str) -> Result<Option<f64>> {
        let text = self.text(row, column)?;
        if text.is_empty() {
            return Ok(None);
        }
        text.parse().map(Some).map_err(|_| Error::input("this cell is no number").at_key(column).read(text))
    }
}

/// A table in Markdown.
pub fn table(heading: &[&str], rows: &[Vec<String>]) -> String {
    let mut text = format!("| {} |\n|{}\n", heading.join(" | "), "---|".repeat(heading.len()));
    rows.iter().for_each(|row| text += &format!("| {} |\n", row.join(" | ")));
    text + "\n"
}

/// Columns of the page.
const WIDTH: usize = 120;

/// Paragraphs and points of a list, broken into lines of at most [`WIDTH`] characters; tables, headings and commands stay.
pub fn wrapped(page: &str) -> String {
    let mut text = String::new();
    let mut open = String::new();
    for line in page.lines() {
        let stands = line.is_empty() || line.starts_with(['|', '#', '!']) || line.starts_with("    ");
        if stands || line.starts_with("* ") {
            text += &broken(&std::mem::take(&mut open));
        }
        if stands {
            text += &format!("{line}\n");
        } else {
            open += &format!("{}{}", if open.is_empty() { "" } else { " " }, line.trim());
        }
    }
    text + &broken(&open)
}

fn broken(paragraph: &str) -> String {
    let indent = if paragraph.starts_with("* ") { "  " } else { "" };
    let mut text = String::new();
    let mut line = String::new();
    // A number and its unit stay together.
    let paragraph = [" %", " K", " W"].iter().fold(paragraph.to_string(), |p, unit| p.replace(unit, &unit.replace(' ', "\u{a0}")));
    for word in paragraph.split(' ').filter(|w| !w.is_empty()) {
        if !line.is_empty() && line.chars().count() + 1 + word.chars().count() > WIDTH {
            text += &format!("{line}\n");
            line = format!("{indent}{word}");
        } else {
            line += &format!("{}{word}", if line.is_empty() { "" } else { " " });
        }
    }
    let text = if line.is_empty() { text } else { text + &line + "\n" };
    text.replace('\u{a0}', " ")
}

/// Degrees Celsius of a temperature in kelvin.
pub fn celsius(kelvin: f64) -> f64 {
    Celsius::from(Kelvin(kelvin)).0
}

/// Head of a page that a command writes: the command, the commit it was built from, and the machine.
pub fn written(command: &str) -> String {
    let git = std::process::Command::new("git").args(["log", "-1", "--format=%h of %cs"]).current_dir(project(".")).output();
    let commit = git.ok().map(|output| String::from_utf8_lossy(&output.stdout).trim().to_string()).filter(|text| !text.is_empty());
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    format!("    {command}\n\nWritten at commit {} on a machine with {cores} cores.\n\n", commit.as_deref().unwrap_or("unknown"))
}

/// Draws `docs/images/validation_NAME.svg` and gives the line that shows it.
pub fn figure<F: Figure>(name: &str, figure: &F) -> Result<String> {
    let file = format!("validation_{name}.svg");
    draw_as(&project("docs/images").join(&file), figure)?;
    Ok(format!("![{}](../images/{file})\n\n", figure.title()))
}

/// The data without some sensors.
pub fn without(mut data: Data, names: &[&str]) -> Data {
    for name in names {
        if let Some(k) = data.names.iter().position(|n| n == name) {
            data.names.remove(k);
            data.sensors.remove(k);
            for row in &mut data.rows {
                row.readings.remove(k);
            }
        }
    }
    data
}
