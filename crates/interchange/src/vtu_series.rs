//! A study saved as one VTU file per condition, as a table: readings at points of the mesh, conditions from a table or from names.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use regex::Regex;
use serde::Serialize;

use super::foreign::{UnitOf, express};
use coldplate_base::document::suggestion;
use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_base::units::{self, Dimension};
use coldplate_base::vtu::{FieldSupport, MeshPlace, Vtu};
use coldplate_tables::{Column, Table, TextColumn};

/// Column of the conditions that names the file.
const FILE: &str = "file";
/// Largest distance of a point from the mesh, as a share of the mesh's diagonal. Chosen: a curved surface of straight edges leaves
/// about so much out.
const FARTHEST: f64 = 0.01;

/// Place at which a point is read.
#[derive(Debug, Clone, PartialEq)]
enum At {
    /// A place, m.
    Place([f64; 3]),
    /// A point of the mesh, from 0.
    Point(usize),
    /// A cell of the mesh, from 0.
    Cell(usize),
}

/// A measurement point: `motor=T @ 100 mm, 20 mm, 5 mm`, `motor=T @ point 17`, `tool z=u.z @ cell 3`.
#[derive(Debug, Clone, PartialEq)]
pub struct PointOf {
    name: String,
    field: String,
    at: At,
}

/// Source of the conditions.
#[derive(Debug)]
pub enum Conditions {
    /// A table with a column `file`, and the path of the table.
    Table(Box<Table>, PathBuf),
    /// Names of the files, with places `{{NAME:UNIT}}` for values.
    Names(NamePattern),
}

/// How a measurement point was read, over all files.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReadAt {
    /// The measurement point.
    pub point: String,
    /// The field of the files.
    pub field: String,
    /// Largest distance from the place to the point of the mesh that was read, m; `None` where the place lies in a cell of every file.
    pub nearest_m: Option<f64>,
}

impl PointOf {
    /// Reads a measurement point as it is stated on the command line.
    ///
    /// # Errors
    /// The text is of another form, or a coordinate has no unit.
    pub fn parse(text: &str) -> Result<PointOf> {
        let form = || {
            let help = "write NAME=FIELD @ 100 mm, 20 mm, 5 mm, or NAME=FIELD @ point 17, or NAME=FIELD @ cell 3";
            Error::input("no measurement point can be read here").at_key("--point").read(text).help(help)
        };
        let (name, rest) = text.split_once('=').ok_or_else(form)?;
        let (field, at) = rest.rsplit_once('@').ok_or_else(form)?;
        let (name, field, at) = (name.trim().to_string(), field.trim().to_string(), at.trim());
        if name.is_empty() || field.is_empty() {
            return Err(form());
        }
        let number = |word: &str| at.strip_prefix(word).map(|rest| rest.trim().parse().map_err(|_| form())).transpose();
        let at = match (number("point")?, number("cell")?) {
            (Some(point), _) => At::Point(point),
            (_, Some(cell)) => At::Cell(cell),
            _ => {
                let length = |text: &str| units::parse(text, Dimension::LENGTH).map_err(|e| e.at_key("--point"));
                let place: Vec<f64> = at.split(',').map(length).collect::<Result<_>>()?;
                At::Place(place.try_into().map_err(|_| form())?)
            }
        };
        Ok(PointOf { name, field, at })
    }
}

/// A pattern of names: `rig_{{coolant_flow:L/min}}_{{motor_speed:rpm}}.vtu`.
#[derive(Debug)]
pub struct NamePattern {
    pattern: Regex,
    text: String,
    /// Name and unit of each place.
    variables: Vec<(String, String)>,
}

impl NamePattern {
    /// Reads a pattern.
    ///
    /// # Errors
    /// A place that is not closed, has no name or no unit, or stands twice; a pattern without places.
    pub fn parse(text: &str) -> Result<NamePattern> {
        let wrong = |what: &str| Error::input(what).at_key("--names").read(text).help("write {{NAME:UNIT}} where a value stands");
        let (mut pattern, mut variables, mut rest) = (String::from("^"), Vec::<(String, String)>::new(), text);
        while let Some((before, after)) = rest.split_once("{{") {
            let (place, behind) = after.split_once("}}").ok_or_else(|| wrong("a place for a value is not closed"))?;
            let (name, unit) = place.split_once(':').ok_or_else(|| wrong("a place for a value has no unit"))?;
            let (name, unit) = (name.trim().to_string(), unit.trim().to_string());
            units::dimension_of(&unit).map_err(|e| e.at_key("--names").read(text))?;
            if name.is_empty() || variables.iter().any(|(other, _)| *other == name) {
                return Err(wrong("a place for a value has no name, or the name of another"));
            }
            pattern += &regex::escape(before);
            pattern += r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)";
            variables.push((name, unit));
            rest = behind;
        }
        if variables.is_empty() {
            return Err(wrong("no condition stands in this name"));
        }
        pattern += &regex::escape(rest);
        pattern += "$";
        let pattern = Regex::new(&pattern).map_err(|_| wrong("this pattern is too long"))?;
        Ok(NamePattern { pattern, text: text.to_string(), variables })
    }

    /// The condition columns of these files.
    fn columns(&self, files: &[PathBuf]) -> Result<Vec<Column>> {
        let column = |(name, unit): &(String, String)| Column { name: name.clone(), unit: unit.clone(), values: Vec::new() };
        let mut columns: Vec<Column> = self.variables.iter().map(column).collect();
        for file in files {
            let found = self.pattern.captures(file_name(file)).ok_or_else(|| {
                let help = format!("its name must match '{}': leave out files that do not", self.text);
                Error::input("the conditions do not stand in the name of this file").in_file(file).at_key("--names").help(help)
            })?;
            for (i, column) in columns.iter_mut().enumerate() {
                column.values.push(found[i + 1].parse().unwrap_or(f64::NAN));
            }
        }
        Ok(columns)
    }
}

/// The VTU files of a study: those named, and those in the folders that are named, by their names.
///
/// # Errors
/// A folder cannot be read or has none, or two files have the same name.
pub fn files(paths: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut all = Vec::new();
    for path in paths {
        if !path.is_dir() {
            all.push(path.clone());
            continue;
        }
        let entries = std::fs::read_dir(path).and_then(Iterator::collect::<std::io::Result<Vec<_>>>);
        let entries = entries.map_err(|e| Error::file("read", path, e))?;
        let mut own: Vec<PathBuf> = entries.into_iter().map(|entry| entry.path()).filter(|path| is_vtu(path)).collect();
        if own.is_empty() {
            return Err(Error::input("no .vtu file is in this folder").in_file(path).help("name the folder that has them"));
        }
        own.sort();
        all.append(&mut own);
    }
    let mut names: Vec<&str> = all.iter().map(|path| file_name(path)).collect();
    names.sort_unstable();
    if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(Error::input(format!("two files are called '{}'", twice[0])).help("a condition is known by the name of its file"));
    }
    Ok(all)
}

/// Whether a path is a file of such a study, by its name, or a folder.
pub fn is_vtu(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("vtu"))
}

/// The table of a study: a text column `file`, the conditions, and a column for each measurement point. `units` states the unit of a
/// field, or of a measurement point, whose values are then converted where its field has one; `length` is the unit of the coordinates.
///
/// # Errors
/// A file, field or place that is not there; a condition without file or a file without condition; a unit that is not stated.
pub fn table(
    files: &[PathBuf],
    conditions: &Conditions,
    points: &[PointOf],
    units: &[UnitOf],
    length: &str,
) -> Result<(Table, Vec<ReadAt>)> {
    if points.is_empty() {
        return Err(Error::input("no measurement point is stated").at_key("--point").help("--point \"motor=T @ 100 mm, 20 mm, 5 mm\""));
    }
    let metre = units::convert(1.0, length, Dimension::LENGTH).map_err(|e| e.at_key("--length"))?;
    let stated = stated_units(points, units)?;
    let (files, columns) = match conditions {
        Conditions::Names(names) => (files.to_vec(), names.columns(files)?),
        Conditions::Table(table, path) => in_table(table, files).map_err(|e| e.in_file(path))?,
    };
    let mut table = Table { inputs: columns.len(), columns, ..Table::default() };
    table.texts.push(TextColumn { name: FILE.into(), values: files.iter().map(|file| file_name(file).into()).collect() });
    let mut outputs: Vec<Column> =
        points.iter().zip(&stated).map(|(p, unit)| Column { name: p.name.clone(), unit: unit.clone(), values: Vec::new() }).collect();
    let mut read_at: Vec<ReadAt> =
        points.iter().map(|p| ReadAt { point: p.name.clone(), field: p.field.clone(), nearest_m: None }).collect();
    for file in &files {
        for ((value, off), (column, at)) in read(file, points, metre)?.into_iter().zip(outputs.iter_mut().zip(&mut read_at)) {
            column.values.push(value);
            at.nearest_m = [at.nearest_m, off].into_iter().flatten().reduce(f64::max);
        }
    }
    table.columns.append(&mut outputs);
    table.provenance.push(("source".into(), format!("{} VTU files", files.len())));
    for (name, unit) in units.iter().filter(|(name, _)| points.iter().any(|p| p.name == *name)) {
        express(&mut table, name, unit)?;
    }
    table.check()?;
    Ok((table, read_at))
}

/// The unit in which each measurement point is read.
fn stated_units(points: &[PointOf], units: &[UnitOf]) -> Result<Vec<String>> {
    let of = |name: &str| units.iter().find(|(own, _)| own == name).map(|(_, unit)| unit.clone());
    let is_used =
        |name: &str| points.iter().any(|p| p.name == name || p.field == name || component_of(&p.field).is_some_and(|(f, _)| f == name));
    if let Some((name, unit)) = units.iter().find(|(name, _)| !is_used(name)) {
        let known: Vec<&str> = points.iter().flat_map(|p| [p.name.as_str(), p.field.as_str()]).collect();
        let help = did_you_mean(name, known.iter().copied())
            .map_or_else(|| "a unit is stated of a field, or of a measurement point".into(), |meant| format!("did you mean '{meant}'?"));
        return Err(Error::input(format!("'{name}' is neither a field that is read nor a point"))
            .at_key(format!("--unit {name}={unit}"))
            .help(help));
    }
    let own = |point: &PointOf| {
        let field = of(&point.field).or_else(|| component_of(&point.field).and_then(|(field, _)| of(field)));
        let unit = field.or_else(|| of(&point.name)).ok_or_else(|| {
            let help = format!("--unit \"{}=degC\", in the unit of the file", point.field);
            Error::input(format!("the unit of the field '{}' is not stated, and VTU files have none", point.field))
                .at_key("--unit")
                .help(help)
        })?;
        units::dimension_of(&unit).map_err(|e| e.at_key("--unit"))?;
        Ok(unit)
    };
    points.iter().map(own).collect()
}

/// The files in the order of their conditions, and the columns of these.
fn in_table(table: &Table, files: &[PathBuf]) -> Result<(Vec<PathBuf>, Vec<Column>)> {
    let names = table.text(FILE).ok_or_else(|| {
        let texts: Vec<&str> = table.texts.iter().map(|t| t.name.as_str()).collect();
        Error::input(format!("there is no column '{FILE}'"))
            .at_key(FILE)
            .help(format!("it has the name of the file of each condition, and no unit; {}", suggestion(FILE, &texts)))
    })?;
    if table.columns.is_empty() {
        return Err(
            Error::input("no column has a unit, so there is no condition").help("write the header as file, coolant_flow [L/min], ...")
        );
    }
    let mut by_name: BTreeMap<&str, &PathBuf> = files.iter().map(|file| (file_name(file), file)).collect();
    let mut ordered = Vec::new();
    for (name, row) in names.values.iter().zip(1..) {
        let file = by_name.remove(name.as_str()).ok_or_else(|| {
            let help = match did_you_mean(name, by_name.keys().copied()) {
                Some(near) => format!("did you mean '{near}'?"),
                None => "every condition has one file of its own: name it, or leave the row out".into(),
            };
            Error::input(format!("the file of condition {row} is not there")).at_key(FILE).read(name).help(help)
        })?;
        ordered.push(file.clone());
    }
    match by_name.first_key_value() {
        Some((name, _)) => Err(Error::input("a file has no condition").at_key(FILE).read(name).help("add its row, or leave the file out")),
        None => Ok((ordered, table.columns.clone())),
    }
}

/// Values of the points in one file, each with the distance (m) to the point of the mesh that was read, where its place lies in no
/// cell.
fn read(file: &Path, points: &[PointOf], metre: f64) -> Result<Vec<(f64, Option<f64>)>> {
    let grid = Vtu::read(file)?;
    let asks_places = points.iter().any(|p| matches!(p.at, At::Place(_)));
    let mesh = if asks_places { Some((grid.coordinates()?, grid.mesh()?)) } else { None };
    let one = |point: &PointOf| {
        let support = match point.at {
            At::Place(_) => None,
            At::Point(_) => Some(FieldSupport::Points),
            At::Cell(_) => Some(FieldSupport::Cells),
        };
        let (name, component) = match component_of(&point.field) {
            Some((name, component)) if !grid.fields().contains(&point.field.as_str()) => (name, Some(component)),
            _ => (point.field.as_str(), None),
        };
        let field = grid.field(name, support)?;
        let component = which(component, field.components).map_err(|e| e.in_file(file).at_key(name))?;
        let place = match (&point.at, &mesh) {
            (At::Place(at), Some((places, cells))) => cells.place(places, at.map(|x| x / metre)),
            (At::Point(at), _) => Some(MeshPlace::Near { point: *at, cell: None, distance: 0.0 }),
            (At::Cell(at), _) => Some(MeshPlace::Inside { cell: *at, corners: Vec::new() }),
            (At::Place(_), None) => None,
        };
        let off = match (&place, &point.at, &mesh) {
            (Some(MeshPlace::Near { distance, .. }), At::Place(_), Some((places, _))) => Some((distance * metre, diagonal(places) * metre)),
            _ => None,
        };
        if let Some((distance, diagonal)) = off.filter(|(distance, diagonal)| *distance > FARTHEST * diagonal) {
            let what = format!(
                "the place is in no cell, and {:.3} mm from the nearest point of the mesh ({:.3} mm large)",
                1e3 * distance,
                1e3 * diagonal
            );
            return Err(Error::input(what).in_file(file).help("check the coordinates, and --length, the length unit of the mesh"));
        }
        let value = place.and_then(|place| place.value(&field, component)).ok_or_else(|| {
            let count = field.values.len() / field.components.max(1);
            Error::input(format!("there is no such point or cell: the field has {count} values, counted from 0")).in_file(file)
        })?;
        if value.is_finite() {
            Ok((value, off.map(|(distance, _)| distance)))
        } else {
            Err(Error::input("the value is not finite").in_file(file).read(value))
        }
    };
    points.iter().map(|point| one(point).map_err(|e| e.at_key(format!("--point {}", point.name)))).collect()
}

/// A field with the component that is asked for: `u.z`, `stress.4`.
fn component_of(field: &str) -> Option<(&str, usize)> {
    let (name, component) = field.rsplit_once('.')?;
    let number = ["x", "y", "z"].iter().position(|axis| *axis == component).or_else(|| component.parse().ok())?;
    Some((name, number))
}

fn which(asked: Option<usize>, components: usize) -> Result<usize> {
    match asked {
        None if components == 1 => Ok(0),
        None => {
            Err(Error::input(format!("the field has {components} components")).help("say which: FIELD.x, FIELD.y, FIELD.z, or FIELD.0"))
        }
        Some(component) if component < components => Ok(component),
        Some(component) => {
            Err(Error::input("the field has no such component").read(component).help(format!("it has {components}, counted from 0")))
        }
    }
}

fn diagonal(points: &[[f64; 3]]) -> f64 {
    let along = |d: usize| {
        let (low, high) = points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p[d]), high.max(p[d])));
        high - low
    };
    (0..3).map(|d| along(d).powi(2)).sum::<f64>().sqrt()
}

fn file_name(path: &Path) -> &str {
    path.file_name().and_then(|name| name.to_str()).unwrap_or_default()
}
