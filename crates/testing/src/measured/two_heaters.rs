//! The measured runs of two heaters on a board as a table for `coldplate diagnose`.

use std::fmt::Write as _;
use std::path::Path;

use coldplate_base::error::{Error, Result};

/// W per per cent of a heater's drive, as documented.
const WATTS: f64 = 0.032;

/// Runs of a folder with columns time [s], drive of both heaters [%] and both thermistors [degC]; at first everything is at the
/// temperature of the room, which is what both thermistors read.
///
/// # Errors
/// A file cannot be read, or has a row without these five numbers.
pub fn table(folder: &Path, tests: &[&str]) -> Result<String> {
    let mut text = "test,time [s],heater_1 [W],heater_2 [W],ambient_temperature [degC],T1 [degC],T2 [degC]\n".to_string();
    for test in tests {
        let path = folder.join(format!("{test}.csv"));
        let file = std::fs::read_to_string(&path).map_err(|e| Error::input(format!("cannot read this file: {e}")).in_file(&path))?;
        let mut room = None;
        for (line, row) in file.lines().enumerate().skip(1) {
            let numbers: Vec<f64> = row.split(',').filter_map(|cell| cell.trim().parse().ok()).collect();
            let [time, heater_1, heater_2, t1, t2] = numbers[..] else {
                return Err(Error::input("this row has not five numbers").in_file(&path).at_key(format!("line {}", line + 1)).read(row));
            };
            let room = *room.get_or_insert(0.5 * (t1 + t2));
            // Writing to a text cannot fail.
            let _ = writeln!(text, "{test},{time},{},{},{room},{t1},{t2}", WATTS * heater_1, WATTS * heater_2);
        }
    }
    Ok(text)
}

/// Standard deviations beside a table: noise as a limit, K.
pub fn uncertainty(limit: f64) -> String {
    format!("kind = \"limits\"\nnoise = \"{limit} K\"\nbias = \"0.1 K\"\n[condition]\nambient_temperature = \"0.5 K\"\n")
}
