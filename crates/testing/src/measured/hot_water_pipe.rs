//! The measured step tests of the pipe as a table that `coldplate` reads.

use std::fmt::Write as _;
use std::path::Path;

use coldplate_base::error::{Error, Result};
use coldplate_base::units::ZERO_CELSIUS;
use coldplate_physics::liquid::Liquid;

/// Rows closer than this to the one kept before, in both temperatures (K), say nothing new ...
const ALIKE: f64 = 0.5;
/// ... unless they are this much later, as a share of the test.
const LATER: f64 = 0.035;
/// The slow test, and the time (s) before which its outlet is not read: the water that stood in the pipe was not at one
/// temperature, and nobody knows at which.
const SLOW: (&str, f64) = ("160104_2", 600.0);

/// How uncertain the readings are: what such a set-up has, the interval of its rows (3 to 5 s) as that of its clock.
pub const UNCERTAINTY: &str = r#"kind = "limits"
noise = "0.1 K"                           # readings are given to 0.1 K
bias = "0.2 K"
timing = "3 s"                            # rows are 3 to 5 s apart; sensors sit in pockets
[condition]
coolant_flow = "2 %"
coolant_temperature = "0.2 K"
ambient_temperature = "2 K"               # documented as 18 degC, not recorded
"#;

/// Rows of some tests, thinned where nothing changes; of a test written `NAME:SECONDS` those up to that time.
///
/// # Errors
/// A file is not there or has no such columns.
pub fn table(folder: &Path, tests: &[&str]) -> Result<String> {
    let mut text = "test,time [s],coolant_flow [m3/s],coolant_temperature [degC],water out [degC]\n".to_string();
    for test in tests {
        let (test, until) = match test.split_once(':') {
            Some((name, until)) => {
                (name, until.parse().map_err(|_| Error::input("this is no number of seconds").at_key("TEST:SECONDS").read(*test))?)
            }
            None => (*test, f64::INFINITY),
        };
        let path = folder.join(format!("test_{test}.csv"));
        let file = std::fs::read_to_string(&path).map_err(|e| Error::file("read", &path, e))?;
        let mut lines = file.lines();
        let header: Vec<&str> = lines.next().unwrap_or("").split(',').map(str::trim).collect();
        let column =
            |name: &str| header.iter().position(|h| *h == name).ok_or_else(|| Error::input(format!("no column '{name}'")).in_file(&path));
        let wanted = [column("time_s")?, column("mass_flow_kg_s")?, column("inlet_water_C")?, column("outlet_water_C")?];
        let mut rows: Vec<[f64; 4]> = Vec::new();
        for (n, line) in lines.enumerate() {
            let cells: Vec<&str> = line.split(',').map(str::trim).collect();
            let mut row = [0.0; 4];
            for (value, at) in row.iter_mut().zip(wanted) {
                let cell = cells.get(at).copied().unwrap_or("");
                *value = cell.parse().map_err(|_| Error::input("this is no number").in_file(&path).at_line(n + 2).read(cell))?;
            }
            if row[0] <= until {
                rows.push(row);
            }
        }
        let span = rows.last().map_or(0.0, |row| row[0]);
        let mut kept: Option<[f64; 4]> = None;
        for (n, row) in rows.iter().enumerate() {
            let says_nothing = |k: [f64; 4]| (row[2] - k[2]).abs() < ALIKE && (row[3] - k[3]).abs() < ALIKE && row[0] - k[0] < LATER * span;
            if n + 1 < rows.len() && kept.is_some_and(says_nothing) {
                continue;
            }
            kept = Some(*row);
            let [time, flow, inlet, outlet] = *row;
            let density = Liquid::Water.at(inlet + ZERO_CELSIUS)?.density;
            let is_read = test != SLOW.0 || time == 0.0 || time >= SLOW.1;
            let outlet = if is_read { outlet.to_string() } else { String::new() };
            let _ = writeln!(text, "{test},{time},{:.8e},{inlet},{outlet}", flow / density);
        }
    }
    Ok(text)
}
