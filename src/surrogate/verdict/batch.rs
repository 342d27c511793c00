//! Many conditions from a CSV file.

use std::path::Path;

use coldplate_runtime::Surrogate;

use super::condition;
use crate::error::{Error, Result, did_you_mean};

/// One row of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Line in the file, from 1.
    pub line: usize,
    /// The label in the column `test`, if there is one.
    pub label: Option<String>,
    /// The condition, in the surrogate's variables and units.
    pub condition: Vec<f64>,
}

/// What a column of the file is.
enum Column {
    /// A variable, with the unit from the header, or values that carry their own.
    Variable { index: usize, unit: Option<String> },
    /// The label of a row.
    Label,
    /// Measured readings of a point, or their time: no part of a condition.
    Ignored,
}

/// Reads conditions from CSV text. The header names variables, with their unit as in
/// `coolant_flow [L/min]`; cells of a column without a unit carry their own. `given` holds variables
/// that are the same in every row. A column `test` labels the rows; columns named after
/// measurement points are measurements and are passed over.
///
/// # Errors
/// Unknown or missing columns; a row with an unreadable, missing or surplus cell, named by its line.
pub fn read(surrogate: &Surrogate<'_>, text: &str, file: &Path, given: &[(String, String)]) -> Result<Vec<Row>> {
    read_rows(surrogate, text, given).map_err(|e| e.in_file(file))
}

fn read_rows(surrogate: &Surrogate<'_>, text: &str, given: &[(String, String)]) -> Result<Vec<Row>> {
    let common = condition::partial(surrogate, given)?;
    let mut lines = text.trim_start_matches('\u{feff}').lines().enumerate().map(|(i, line)| (i + 1, line));
    // Blank lines and remarks carry nothing, before the header as well as after it.
    let mut content = lines.by_ref().filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let Some((line, header)) = content.next() else {
        return Err(Error::input("this file holds no header").help("name the variables in the first line: coolant_flow [L/min], ..."));
    };
    let columns = header_columns(surrogate, header, &common).map_err(|e| e.at_line(line))?;
    let mut rows = Vec::new();
    for (line, text) in content {
        rows.push(row(surrogate, &columns, &common, line, text).map_err(|e| e.at_line(line))?);
    }
    if rows.is_empty() {
        return Err(Error::input("this file holds no conditions"));
    }
    Ok(rows)
}

fn header_columns(surrogate: &Surrogate<'_>, header: &str, common: &[Option<f64>]) -> Result<Vec<Column>> {
    let mut seen = common.to_vec();
    let mut columns = Vec::new();
    for cell in cells(header)? {
        let (name, unit) = match cell.split_once('[') {
            Some((name, unit)) => (name.trim(), Some(unit.trim().trim_end_matches(']').trim().to_owned())),
            None => (cell.trim(), None),
        };
        if let Some(index) = surrogate.variables().position(|v| v.name == name) {
            if seen[index].is_some() {
                return Err(Error::input(format!("'{name}' is given twice")).at_key(name).help("give it as an option or as one column"));
            }
            seen[index] = Some(0.0);
            if let (Some(unit), Some(variable)) = (&unit, surrogate.variable(index)) {
                condition::number_in(&variable, 1.0, unit).map_err(|e| e.at_key(name).read(unit))?;
            }
            columns.push(Column::Variable { index, unit });
        } else if name == "test" {
            columns.push(Column::Label);
        } else if name == "time" || surrogate.points().any(|p| p.name == name) {
            columns.push(Column::Ignored);
        } else {
            let known: Vec<&str> = surrogate.variables().map(|v| v.name).collect();
            let error = Error::input(format!("the column '{name}' is neither a variable nor a point of this surrogate")).at_key(name);
            return Err(match did_you_mean(name, known.iter().copied()) {
                Some(meant) => error.help(format!("did you mean '{meant}'? Its variables are: {}", known.join(", "))),
                None => error.help(format!("its variables are: {}", known.join(", "))),
            });
        }
    }
    condition::complete(surrogate, seen)?;
    Ok(columns)
}

fn row(surrogate: &Surrogate<'_>, columns: &[Column], common: &[Option<f64>], line: usize, text: &str) -> Result<Row> {
    let cells = cells(text)?;
    if cells.len() != columns.len() {
        return Err(Error::input(format!("this row has {} cells, the header {}", cells.len(), columns.len())));
    }
    let (mut x, mut label) = (common.to_vec(), None);
    for (column, cell) in columns.iter().zip(&cells) {
        match column {
            Column::Variable { index, unit } => {
                let Some(variable) = surrogate.variable(*index) else { continue };
                let value = match unit {
                    Some(unit) => match cell.parse::<f64>() {
                        Ok(number) => condition::number_in(&variable, number, unit),
                        Err(_) => Err(Error::input("no number can be read here").read(cell)),
                    },
                    None => condition::value_of(&variable, cell),
                };
                x[*index] = Some(value.map_err(|e| e.at_key(variable.name))?);
            }
            Column::Label => label = Some(cell.clone()),
            Column::Ignored => {}
        }
    }
    Ok(Row { line, label, condition: condition::complete(surrogate, x)? })
}

/// The cells of a line, trimmed; a cell in double quotes may hold commas, and quotes written twice.
fn cells(line: &str) -> Result<Vec<String>> {
    let mut cells = vec![String::new()];
    let mut quoted = false;
    let mut characters = line.chars().peekable();
    while let (Some(c), Some(cell)) = (characters.next(), cells.last_mut()) {
        match c {
            '"' if quoted && characters.peek() == Some(&'"') => {
                characters.next();
                cell.push('"');
            }
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(String::new()),
            _ => cell.push(c),
        }
    }
    if quoted {
        return Err(Error::input("a quotation mark is opened and not closed on this line"));
    }
    Ok(cells.into_iter().map(|c| c.trim().to_owned()).collect())
}
