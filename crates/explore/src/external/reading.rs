//! Places of another program's results in its files.

use std::fs::File;
use std::path::{Path, PathBuf};

use regex::Regex;

use super::failure::{Class, Failure};
use coldplate_base::document::{Section, Value};
use coldplate_base::error::{Error, Result};
use coldplate_base::units::{self, Dimension};
use coldplate_describe::machine::PointColumn;
use coldplate_tables::Table;

/// Date of files that lie in the folder of a run before it: the epoch, when no run was.
const SHIPPED: std::time::SystemTime = std::time::SystemTime::UNIX_EPOCH;

/// A result that is read after a run.
#[derive(Debug, Clone)]
pub struct ResultReading {
    /// The point as it stands in the table.
    pub point: PointColumn,
    /// Value in place of a missing result, in the unit of the point.
    pub recover: Option<f64>,
    /// Unit of the number in the file.
    unit: String,
    file: PathBuf,
    place: Place,
}

#[derive(Debug, Clone)]
enum Place {
    /// Column and row (from 1; the last if none is stated) of a CSV file.
    Column(String, Option<usize>),
    /// JSON pointer (RFC 6901).
    Pointer(String),
    /// Expression with one group; the last match, or the first.
    Pattern { expression: Regex, is_first: bool },
}

impl ResultReading {
    /// Reads `[point.NAME]`.
    ///
    /// # Errors
    /// No unit or an unknown one; none or several of `column`, `pointer` and `pattern`; an expression without exactly one group.
    pub(super) fn read(name: &str, section: Section<'_>) -> Result<Self> {
        let unit = section.text("unit")?;
        let mut dimension =
            units::dimension_of(&unit).map_err(|e| section.error_at("unit", e.what()).help(e.remedy().unwrap_or_default()))?;
        let is_difference = section.opt_flag("difference")?.unwrap_or(false);
        if is_difference && dimension.is_absolute() {
            return Err(section.error_at("unit", "a difference of temperatures is in K").help("write unit = \"K\""));
        }
        // Numbers that programs print in K are temperatures as a rule.
        if dimension == Dimension::DIFFERENCE && !is_difference {
            dimension = Dimension::TEMPERATURE;
        }
        let point = match dimension {
            Dimension::TEMPERATURE => PointColumn::temperature(name),
            _ => PointColumn { name: name.into(), unit: unit.clone(), dimension },
        };
        let place = place(&section)?;
        let file = PathBuf::from(section.opt_text("file")?.unwrap_or_else(|| super::process::STDOUT.into()));
        let recover = section.opt("recover").map(|value| recovered(&value, &point)).transpose()?;
        section.finish()?;
        Ok(Self { point, recover, unit, file, place })
    }

    /// Text of everything that the reading depends on, for the key of the cache.
    pub(super) fn key(&self) -> String {
        format!("{} {} {} {:?}", self.point.name, self.unit, self.file.display(), self.place)
    }

    /// Dates a file back that lies in the folder before the run, so that a result of an earlier time is known.
    ///
    /// # Errors
    /// The file cannot be changed.
    pub(super) fn mark_shipped(&self, folder: &Path) -> Result<()> {
        let path = folder.join(&self.file);
        match File::open(&path).and_then(|file| file.set_modified(SHIPPED)) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::file("write", &path, e)),
            _ => Ok(()),
        }
    }

    /// The value after a run in `folder`, in the unit of the point.
    pub(super) fn value(&self, folder: &Path) -> std::result::Result<f64, Failure> {
        let missing = |why: String| Failure::new(Class::ResultMissing, format!("'{}': {why}", self.point.name));
        let file = self.file.display();
        let path = folder.join(&self.file);
        let bytes = std::fs::read(&path).map_err(|e| match e.kind() {
            std::io::ErrorKind::NotFound => missing(format!("{file} was not written")),
            _ => missing(format!("{file} cannot be read: {e}")),
        })?;
        if std::fs::metadata(&path).and_then(|about| about.modified()).is_ok_and(|time| time == SHIPPED) {
            return Err(missing(format!("{file} was there before the run, and the run did not write it")));
        }
        let text = String::from_utf8_lossy(&bytes);
        let found = match &self.place {
            Place::Column(name, row) => cell(&text, &self.file, name, *row),
            Place::Pointer(pointer) => pointed(&text, pointer),
            Place::Pattern { expression, is_first } => matched(&text, expression, *is_first),
        };
        let (value, unit) = found.map_err(|why| missing(format!("{file}: {why}")))?;
        let unit = unit.unwrap_or_else(|| self.unit.clone());
        let si =
            units::convert(value, &unit, self.point.dimension).map_err(|e| missing(format!("{file}: {value} {unit}: {}", e.what())))?;
        let own = match unit == self.point.unit {
            true => Ok(value),
            false => units::express(si, &self.point.unit, self.point.dimension).map_err(|e| missing(e.what().into())),
        }?;
        if own.is_finite() { Ok(own) } else { Err(missing(format!("{file}: {value} is not finite"))) }
    }
}

fn place(section: &Section<'_>) -> Result<Place> {
    match section.one_of(&["column", "pointer", "pattern"])? {
        Some("column") => Ok(Place::Column(section.text("column")?, section.opt_integer("row", 1)?)),
        Some("pointer") => {
            let pointer = section.text("pointer")?;
            if pointer.starts_with('/') {
                return Ok(Place::Pointer(pointer));
            }
            Err(section.error_at("pointer", "a JSON pointer begins with a slash").help("for example \"/results/0/temperature\""))
        }
        Some(_) => {
            let expression = expression(&section.value("pattern")?)?;
            if expression.captures_len() != 2 {
                let what = format!("the expression has {} groups, and one is wanted", expression.captures_len() - 1);
                return Err(section
                    .error_at("pattern", what)
                    .help("put the number, and nothing else, in brackets; (?:...) groups without being one"));
            }
            let is_first = section.opt_choice("match", &["last", "first"])?.unwrap_or(0) == 1;
            Ok(Place::Pattern { expression, is_first })
        }
        None => Err(section
            .error("where does this result stand?")
            .help("give file and column (CSV), pointer (JSON) or pattern (an expression with one group)")),
    }
}

/// Reads a regular expression; `^` and `$` mean lines.
///
/// # Errors
/// The expression cannot be read.
pub(super) fn expression(value: &Value<'_>) -> Result<Regex> {
    let built = regex::RegexBuilder::new(&value.text()?).multi_line(true).build();
    built.map_err(|e| {
        let what = e.to_string().lines().last().unwrap_or_default().trim().to_string();
        value.place(Error::input(format!("this expression cannot be read: {what}")).help("single quotes keep backslashes as they are"))
    })
}

fn recovered(value: &Value<'_>, point: &PointColumn) -> Result<f64> {
    let si = value.quantity(point.dimension)?;
    units::express(si, &point.unit, point.dimension).map_err(|e| value.place(e))
}

/// A number and, if the file states it, its unit.
type Found = std::result::Result<(f64, Option<String>), String>;

/// A number as programs print it; Fortran writes `1.5D+02`.
fn number(text: &str) -> std::result::Result<f64, String> {
    let text = text.trim();
    let value = text.parse().or_else(|_| text.replace(['d', 'D'], "e").parse());
    value.map_err(|_| format!("'{}' is no number", text.chars().take(40).collect::<String>()))
}

fn cell(text: &str, file: &Path, name: &str, row: Option<usize>) -> Found {
    let table = Table::from_csv(text, file).map_err(|e| e.what().to_string())?;
    let row = match row {
        None => table.rows().checked_sub(1).ok_or("there are no rows")?,
        Some(row) if row <= table.rows() => row - 1,
        Some(row) => return Err(format!("there is no row {row}, the last is {}", table.rows())),
    };
    if let Some(column) = table.columns.iter().find(|c| c.name == name) {
        return match column.values[row] {
            value if value.is_nan() => Err(format!("the cell of '{name}' in row {} is empty", row + 1)),
            value => Ok((value, Some(column.unit.clone()))),
        };
    }
    let column = table.text(name).ok_or_else(|| format!("there is no column '{name}'"))?;
    Ok((number(&column.values[row])?, None))
}

fn pointed(text: &str, pointer: &str) -> Found {
    let json: serde_json::Value = serde_json::from_str(text).map_err(|e| format!("this is not JSON: {e}"))?;
    match json.pointer(pointer) {
        None => Err(format!("there is nothing at {pointer}")),
        Some(serde_json::Value::String(text)) => Ok((number(text)?, None)),
        Some(value) => Ok((value.as_f64().ok_or_else(|| format!("the value at {pointer} is no number"))?, None)),
    }
}

fn matched(text: &str, expression: &Regex, is_first: bool) -> Found {
    let mut all = expression.captures_iter(text);
    let found = if is_first { all.next() } else { all.last() };
    let group = found.and_then(|captures| captures.get(1)).ok_or_else(|| "nothing matches the pattern".to_string())?;
    Ok((number(group.as_str())?, None))
}

#[cfg(test)]
mod tests {
    use super::*;
    use coldplate_base::document::Document;

    fn value(keys: &str, text: &str) -> std::result::Result<f64, String> {
        let document = Document::parse(&format!("[point.tip]\n{keys}"), "s.toml").unwrap();
        let (name, section) = document.root().sections("point").unwrap().remove(0);
        let reading = ResultReading::read(&name, section).unwrap();
        let folder = std::env::temp_dir().join(format!("coldplate-reading-{}-{}", std::process::id(), keys.len() + 1000 * text.len()));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("r"), text).unwrap();
        let found = reading.value(&folder).map_err(|failure| failure.to_string());
        std::fs::remove_dir_all(&folder).unwrap();
        found
    }

    #[test]
    fn results_are_found_in_every_form() {
        let of = |keys: &str| format!("unit = 'degC'\nfile = 'r'\n{keys}");
        assert_eq!(value(&of("column = 'tip'"), "time,tip\n0,20\n1,21.5\n"), Ok(21.5));
        assert_eq!(value(&of("column = 'tip'\nrow = 1"), "time,tip\n0,20\n1,21.5\n"), Ok(20.0));
        assert!((value(&of("column = 'tip'"), "tip [K]\n300\n").unwrap() - 26.85).abs() < 1e-9);
        assert_eq!(value(&of("pointer = '/a/1/t'"), "{\"a\": [0, {\"t\": 7}]}"), Ok(7.0));
        assert_eq!(value(&of("pattern = 'T =\\s+(\\S+)'"), "T = 1.0D+01\nT = 2.5D+01\n"), Ok(25.0));
        assert_eq!(value(&of("pattern = 'T =\\s+(\\S+)'\nmatch = 'first'"), "T = 1.0D+01\nT = 2.5D+01\n"), Ok(10.0));
        assert!((value("unit = 'K'\nfile = 'r'\npointer = '/t'", "{\"t\": 300}").unwrap() - 26.85).abs() < 1e-9);
        assert_eq!(value("unit = 'K'\ndifference = true\nfile = 'r'\npointer = '/t'", "{\"t\": 3}"), Ok(3.0));
    }

    #[test]
    fn what_is_missing_is_told() {
        let of = |keys: &str, text: &str| value(&format!("unit = 'degC'\n{keys}"), text).unwrap_err();
        assert_eq!(of("file = 'other'\npointer = '/t'", ""), "result missing: 'tip': other was not written");
        assert_eq!(of("file = 'r'\npointer = '/t'", "{}"), "result missing: 'tip': r: there is nothing at /t");
        assert!(of("file = 'r'\npointer = '/t'", "{\"t\": 1").contains("not JSON"));
        assert!(of("file = 'r'\ncolumn = 'x'", "t\n1\n").contains("no column 'x'"));
        assert!(of("file = 'r'\ncolumn = 'tip'", "tip [degC]\n").contains("no rows"));
        assert!(of("file = 'r'\npattern = '(\\d+) K'", "none").contains("nothing matches"));
        assert!(of("file = 'r'\npattern = 'T (.*)'", "T inf").contains("not finite"));
        assert!(of("file = 'r'\npattern = 'T (.*)'", "T -300").contains("absolute zero"));
    }
}
