//! Memory and time that a mesh takes, before it is made.

use coldplate_base::error::{Error, Result};
use coldplate_base::memory;

/// Peak of memory for each cell of a steady solution, bytes. `coldplate solve` was measured at 1.0 and 5.0 million cells: 312
/// and 267 with machines/five_axis.toml, 235 and 208 with machines/rig.toml.
const BYTES_PER_CELL: f64 = 300.0;
/// Wall time for each cell of a steady solution, s: the same runs on two cores took 2.2e-6 and 1.8e-6, 0.9e-6 and 0.9e-6.
const SECONDS_PER_CELL: f64 = 2e-6;

/// Refuses a mesh that does not fit into the memory that is free.
pub(super) fn check(cells: f64) -> Result<()> {
    memory::free().map_or(Ok(()), |free| check_against(cells, free as f64))
}

/// Refuses a mesh that does not fit into `free` bytes of memory.
fn check_against(cells: f64, free: f64) -> Result<()> {
    let needed = cells * BYTES_PER_CELL;
    if needed <= free {
        return Ok(());
    }
    let gigabytes = |bytes: f64| format!("{:.1} GB", bytes / 1e9);
    let minutes = (cells * SECONDS_PER_CELL / 60.0).ceil();
    let what =
        format!("so many cells need about {} of memory and {minutes:.0} min on two cores; {} are free", gigabytes(needed), gigabytes(free));
    // Two figures: it is an estimate.
    let fits = free / BYTES_PER_CELL;
    let digits = 10f64.powf(fits.max(10.0).log10().floor() - 1.0);
    Err(Error::input(what).at_key("cells").read(cells).help(format!("ask for at most {:.0}", (fits / digits).floor() * digits)))
}

#[cfg(test)]
mod tests {
    use super::check_against;

    #[test]
    fn what_does_not_fit_is_refused_with_what_does() {
        assert!(check_against(5e6, 2e9).is_ok());
        let error = check_against(1e8, 2e9).unwrap_err().to_string();
        for word in ["30.0 GB", "4 min", "2.0 GB are free", "at most 6600000"] {
            assert!(error.contains(word), "{word}: {error}");
        }
    }
}
