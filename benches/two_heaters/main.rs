//! The measured runs of two heaters on a board (docs/how-to/diagnosis-examples.md) as a table for `coldplate diagnose`. The measurements are not
//! part of the project: FOLDER is where step_1.csv and the others lie, LIMIT the noise that is stated of them, in kelvin.
//!
//!     cargo bench --bench two_heaters -- FOLDER OUT.csv LIMIT TEST...

use std::path::Path;

use coldplate_base::atomic_file;
use coldplate_base::error::{Error, Result};
use coldplate_testing::measured::two_heaters;

fn main() {
    // Cargo adds --bench to the arguments.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match words.as_slice() {
        [folder, out, limit, tests @ ..] if !tests.is_empty() => table(Path::new(folder), Path::new(out), limit, tests),
        _ => Err(Error::input("give 'FOLDER OUT.csv LIMIT TEST...'")),
    };
    if let Err(error) = done {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

fn table(folder: &Path, out: &Path, limit: &str, tests: &[&str]) -> Result<()> {
    let limit = limit.parse().map_err(|_| Error::input("this is no number of kelvin").read(limit))?;
    atomic_file::write(out, two_heaters::table(folder, tests)?.as_bytes())?;
    atomic_file::write(&out.with_extension("toml"), two_heaters::uncertainty(limit).as_bytes())
}
