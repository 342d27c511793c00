//! Tables in the formats of other programs, read and written.
//!
//! | program | recognised by | place of the units |
//! |---|---|---|
//! | COMSOL Multiphysics, exported table | lines that begin with `%`, the last of them the header | `heat (W)` |
//! | Ansys Workbench, exported design points | `# ,P1 - heat [W],P2 - ...`, then a header `Name,P1,P2` | `[W]`, degrees as `C` |
//! | optiSLang, design export as CSV | a header that begins with the cell `#`, the number of the design | nowhere |
//! | Dakota, tabular file | a header that begins with `%eval_id`, columns separated by spaces | nowhere |
//! | any other | CSV with a header, as this program writes it | `heat [W]` |

use std::path::Path;

use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_base::units;
use coldplate_tables::{Column, Table, TextColumn, cells, quoted};

/// First word of the header of a Dakota table.
const DAKOTA: &str = "%eval_id";

/// Possible separators of optiSLang's columns: a tab unless another is chosen. A space is not among them, because `# `
/// begins a remark.
const OPTISLANG: [char; 3] = ['\t', ';', ','];

/// A column and its unit: for a file without units, or to convert the column into another unit.
pub type UnitOf = (String, String);

/// Reads the text of a table of this or another program. `units` states units by column names. A column with a unit
/// holds numbers. Columns named in `inputs` become the condition variables.
///
/// # Errors
/// The text is no table of a known format, or has no row; a column of `units` or `inputs` does not exist, has no
/// unit, or has a unit of another dimension.
pub fn read(text: &str, file: impl AsRef<Path>, units: &[UnitOf], inputs: &[String]) -> Result<Table> {
    let file = file.as_ref();
    let own = in_our_form(text, units).map_err(|e| e.in_file(file))?;
    let mut table = Table::from_csv(&own, file)?;
    for (name, unit) in units {
        express(&mut table, name, unit).map_err(|e| e.in_file(file))?;
    }
    if table.rows() == 0 {
        return Err(Error::input("the table has a header and no row").in_file(file).help("export it with its results"));
    }
    if !inputs.is_empty() {
        table.make_inputs(&inputs.iter().map(String::as_str).collect::<Vec<_>>()).map_err(|e| e.in_file(file))?;
    }
    // Condition variables must have a unit.
    for column in table.conditions() {
        units::dimension_of(&column.unit).map_err(|e| e.at_key(column.header()).in_file(file))?;
    }
    Ok(table)
}

/// A table in Dakota's tabular format: `%eval_id interface`, then every column of numbers, separated by spaces.
/// Spaces in names become underscores. The format has no place for units.
///
/// # Errors
/// Errors of [`Table::check`]; a value is missing.
pub fn dakota(table: &Table) -> Result<String> {
    numbers(table, &|names: &[String]| format!("{DAKOTA} interface {}", names.join(" ")), &|row, cells: &[String]| {
        format!("{} NO_ID {}", row + 1, cells.join(" "))
    })
}

/// A table in the format that OpenTURNS reads samples from (`Sample.ImportFromTextFile` with the separator `;`):
/// names with their units, then rows.
///
/// # Errors
/// Errors of [`dakota`].
pub fn openturns(table: &Table) -> Result<String> {
    let names: Vec<String> = table.columns.iter().map(|c| format!("\"{} [{}]\"", c.name, c.unit)).collect();
    numbers(table, &|_: &[String]| names.join(";"), &|_, cells: &[String]| cells.join(";"))
}

/// Converts a column of a table into another unit.
///
/// # Errors
/// There is no column of this name, or its unit has another dimension.
pub(super) fn express(table: &mut Table, name: &str, unit: &str) -> Result<()> {
    let wrong = |e: Error| Error::input(e.what()).at_key(format!("--unit {name}={unit}")).help(e.remedy().unwrap_or_default());
    let mut dimension = units::dimension_of(unit).map_err(wrong)?;
    let names: Vec<String> =
        table.columns.iter().map(|c| c.name.clone()).chain(table.texts.iter().map(|t: &TextColumn| t.name.clone())).collect();
    let Some(column) = table.columns.iter_mut().find(|c| c.name == name) else {
        let known = names.iter().map(String::as_str);
        let help = did_you_mean(name, known)
            .map_or_else(|| format!("columns here: {}", names.join(", ")), |meant| format!("did you mean '{meant}'?"));
        return Err(Error::input(format!("there is no column '{name}'")).at_key(format!("--unit {name}={unit}")).help(help));
    };
    if column.unit == unit {
        return Ok(());
    }
    let Column { unit: before, values, .. } = column;
    // A conversion between kelvin and degrees Celsius means an absolute temperature.
    if units::dimension_of(before).is_ok_and(|own| own.is_absolute()) && dimension == units::Dimension::DIFFERENCE {
        dimension = units::Dimension::TEMPERATURE;
    }
    for value in values.iter_mut().filter(|value| !value.is_nan()) {
        let found = units::convert(*value, before, dimension).and_then(|si| units::express(si, unit, dimension)).map_err(wrong)?;
        // Twelve digits, as for conditions: further digits come from the conversion, not from the value.
        *value = format!("{found:.11e}").parse().unwrap_or(found);
    }
    *before = unit.to_string();
    Ok(())
}

fn numbers(table: &Table, header: &dyn Fn(&[String]) -> String, line: &dyn Fn(usize, &[String]) -> String) -> Result<String> {
    table.check()?;
    let names: Vec<String> = table.columns.iter().map(|c| c.name.replace(char::is_whitespace, "_")).collect();
    let mut text = header(&names) + "\n";
    for row in 0..table.rows() {
        if let Some(column) = table.columns.iter().find(|c| c.values[row].is_nan()) {
            return Err(Error::input(format!("the value of row {} is missing", row + 1))
                .at_key(column.header())
                .help("this form has no missing values: leave the row or the column out"));
        }
        let cells: Vec<String> = table.columns.iter().map(|c| format!("{:e}", c.values[row])).collect();
        text += &(line(row, &cells) + "\n");
    }
    Ok(text)
}

/// The text in this program's CSV format.
fn in_our_form(text: &str, units: &[UnitOf]) -> Result<String> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let first = text.lines().find(|line| !line.trim().is_empty()).unwrap_or_default();
    if first.trim_start().starts_with(DAKOTA) {
        return Ok(of_dakota(text, units));
    }
    if first.starts_with('%') {
        return of_comsol(text, units);
    }
    if let Some(delimiter) = first.strip_prefix('#').and_then(|rest| rest.chars().next()).filter(|c| OPTISLANG.contains(c)) {
        return Ok(of_optislang(text, delimiter, units));
    }
    let named =
        text.lines().filter_map(|line| line.strip_prefix('#')).find(|line| line.trim_start_matches([' ', ',']).starts_with("P1 - "));
    Ok(named.map_or_else(|| with_units(text, units), |named| of_ansys(text, named, units)))
}

/// A header cell in this program's format, with the unit of the file or else the stated unit.
fn header(name: &str, unit: Option<&str>, units: &[UnitOf]) -> String {
    let stated = units.iter().find(|(own, _)| own == name).map(|(_, unit)| unit.as_str());
    quoted(&unit.or(stated).map_or_else(|| name.to_string(), |unit| format!("{name} [{unit}]")))
}

fn of_dakota(text: &str, units: &[UnitOf]) -> String {
    let line = |line: &str| -> String {
        let cells = line.split_whitespace().map(|cell| match cell.strip_prefix('%') {
            Some(name) => name.to_string(),
            None => header(cell, None, units),
        });
        cells.collect::<Vec<_>>().join(",") + "\n"
    };
    text.lines().filter(|line| !line.trim().is_empty()).map(line).collect()
}

fn of_optislang(text: &str, delimiter: char, units: &[UnitOf]) -> String {
    let mut is_header = true;
    let mut line = |line: &str| -> String {
        let is_names = std::mem::take(&mut is_header);
        let cell = |cell: &str| match cell.trim().trim_matches('"') {
            "#" => "design".to_string(),
            name if is_names => header(name, None, units),
            // A failed design has no response.
            missing if missing.eq_ignore_ascii_case("nan") => String::new(),
            value => quoted(value),
        };
        line.split(delimiter).map(cell).collect::<Vec<_>>().join(",") + "\n"
    };
    text.lines().filter(|line| !line.trim().is_empty()).map(&mut line).collect()
}

fn of_comsol(text: &str, units: &[UnitOf]) -> Result<String> {
    let remarks: Vec<&str> = text.lines().take_while(|line| line.starts_with('%')).map(|line| line[1..].trim()).collect();
    let (head, before) = remarks.split_last().ok_or_else(|| Error::input("there is no header"))?;
    let names: Vec<String> = (cells(head)?.iter())
        .map(|cell| match cell.strip_suffix(')').and_then(|rest| rest.rsplit_once(" (")) {
            Some((name, unit)) => header(name.trim(), Some(unit), units),
            None => header(cell, None, units),
        })
        .collect();
    // `Model, plate.mph` states the origin of the table.
    let origin = before.iter().filter_map(|line| line.split_once(',')).map(|(key, value)| format!("# {}: {}\n", key.trim(), value.trim()));
    let rows = text.lines().skip(remarks.len()).map(|line| format!("{line}\n"));
    Ok(origin.chain([names.join(",") + "\n"]).chain(rows).collect())
}

fn of_ansys(text: &str, named: &str, units: &[UnitOf]) -> String {
    let parameters: Vec<(&str, &str, Option<String>)> = (named.split(',').map(str::trim))
        .filter_map(|cell| {
            let (number, rest) = cell.split_once(" - ")?;
            let (name, unit) = rest.strip_suffix(']').and_then(|r| r.rsplit_once('[')).map_or((rest, None), |(n, u)| (n, Some(u)));
            // A temperature has the unit `C`; a longer unit writes `C` for a temperature difference.
            let unit = unit.map(|unit| if unit == "C" { "degC".to_string() } else { unit.replace("C^", "K^") });
            Some((number, name.trim(), unit.filter(|unit| !unit.is_empty())))
        })
        .collect();
    let mut is_header = true;
    let mut line = |line: &str| {
        if line.starts_with('#') || line.trim().is_empty() || !std::mem::take(&mut is_header) {
            return if line.starts_with('#') { String::new() } else { format!("{line}\n") };
        }
        let cells = line.split(',').map(str::trim).map(|cell| match parameters.iter().find(|(number, ..)| *number == cell) {
            Some((_, name, unit)) => header(name, unit.as_deref(), units),
            None => header(cell, None, units),
        });
        cells.collect::<Vec<_>>().join(",") + "\n"
    };
    text.lines().map(&mut line).collect()
}

/// A table in this program's format whose columns may lack units.
fn with_units(text: &str, units: &[UnitOf]) -> String {
    let mut is_header = true;
    let mut line = |line: &str| {
        if line.trim().is_empty() || line.trim_start().starts_with('#') || !std::mem::take(&mut is_header) {
            return format!("{line}\n");
        }
        let cells = cells(line).unwrap_or_default();
        let names = cells.iter().map(|cell| if cell.ends_with(']') { quoted(cell) } else { header(cell, None, units) });
        names.collect::<Vec<_>>().join(",") + "\n"
    };
    text.lines().map(&mut line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, units: &[(&str, &str)], inputs: &[&str]) -> Result<Table> {
        let units: Vec<UnitOf> = units.iter().map(|(name, unit)| (name.to_string(), unit.to_string())).collect();
        super::read(text, "x.csv", &units, &inputs.iter().map(ToString::to_string).collect::<Vec<_>>())
    }

    fn headers(table: &Table) -> Vec<String> {
        table.columns.iter().map(Column::header).collect()
    }

    #[test]
    fn comsol_tables() {
        let text = "% Model,plate.mph\n% Version,COMSOL 6.2.0.278\n% Q (W),v_in (l/min),\"motor, front (K)\"\n20,2,300.15\n120,8,310.15\n";
        let table = read(text, &[("motor, front", "degC")], &["Q", "v_in"]).unwrap();
        assert_eq!(headers(&table), ["Q [W]", "v_in [l/min]", "motor, front [degC]"]);
        assert!((table.columns[2].values[1] - 37.0).abs() < 1e-9);
        assert_eq!((table.inputs, table.provenance[0].1.as_str()), (2, "plate.mph"));
    }

    #[test]
    fn ansys_design_points() {
        let text = "# 03/05/2025 14:15:39\n# The parameters defined in the project are:\n# ,P1 - heat [W],P2 - film [W m^-2 C^-1],P5 - Temperature Maximum [C]\n#\n\
                    # The following header line defines the name of the columns by reference to the parameters.\nName,P1,P2,P5\nDP 0,100,500,41.5\nDP 1,200,500,63\n";
        let table = read(text, &[], &["heat", "film"]).unwrap();
        assert_eq!(headers(&table), ["heat [W]", "film [W m^-2 K^-1]", "Temperature Maximum [degC]"]);
        assert_eq!(table.column("Temperature Maximum").unwrap().values, [41.5, 63.0]);
        assert_eq!(table.text("Name").unwrap().values, ["DP 0", "DP 1"]);
    }

    #[test]
    fn optislang_designs() {
        for delimiter in ["\t", ";", ","] {
            let text = "#|heat|flow|Feasible|T_motor\r\n0.1|100|2|true|41.5\r\n0.2|2e2|8|false|nan\r\n".replace('|', delimiter);
            let table = read(&text, &[("heat", "W"), ("flow", "L/min"), ("T_motor", "degC")], &["heat", "flow"]).unwrap();
            assert_eq!(headers(&table), ["heat [W]", "flow [L/min]", "T_motor [degC]"]);
            assert_eq!(table.column("heat").unwrap().values, [100.0, 200.0]);
            assert!(table.column("T_motor").unwrap().values[1].is_nan());
            assert_eq!(table.text("design").unwrap().values, ["0.1", "0.2"]);
        }
        // A remark of this program is not taken for a header.
        assert_eq!(headers(&read("# made by hand\nQ [W],t [degC]\n1,2\n", &[], &["Q"]).unwrap()), ["Q [W]", "t [degC]"]);
    }

    #[test]
    fn dakota_tables_there_and_back() {
        let text = "%eval_id interface             x1             x2 response_fn_1\n1            NO_ID    0.25  1.5e-3   20.5\n2   NO_ID  0.5 2e-3  21\n";
        let units = [("x1", "L/min"), ("x2", "m"), ("response_fn_1", "degC")];
        let table = read(text, &units, &["x1", "x2"]).unwrap();
        assert_eq!(headers(&table), ["x1 [L/min]", "x2 [m]", "response_fn_1 [degC]"]);
        assert_eq!(table.text("eval_id").unwrap().values, ["1", "2"]);
        let back = read(&dakota(&table).unwrap(), &units, &["x1", "x2"]).unwrap();
        assert_eq!((&back.columns, &back.texts), (&table.columns, &table.texts));
        assert_eq!(openturns(&table).unwrap().lines().nth(1), Some("2.5e-1;1.5e-3;2.05e1"));
        // A column without a unit cannot be fitted.
        assert!(read(text, &[], &["x1"]).unwrap_err().to_string().contains("write the header as 'x1 [unit]'"));
    }

    #[test]
    fn what_does_not_fit_is_told() {
        let text = "Q [W],t\n1,2\n";
        assert_eq!(headers(&read(text, &[("t", "degC"), ("Q", "kW")], &["Q"]).unwrap()), ["Q [kW]", "t [degC]"]);
        for (units, needle) in
            [([("R", "W")], "columns here: Q, t"), ([("Q", "bar")], "not the unit of this quantity"), ([("t", "degQ")], "unknown unit")]
        {
            let error = read(text, &units, &[]).unwrap_err().to_string();
            assert!(error.contains(needle), "{error}");
        }
    }
}
