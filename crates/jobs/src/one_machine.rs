//! Tables and models that a fit brings together: all must be of one machine.

use coldplate_base::error::{Error, Result};
use coldplate_explore::sweep::{MACHINE_HASH, SOLVER_HASH};
use coldplate_tables::Table;

/// Checks that a table has rows of one machine, by the hashes that tables of sweeps state.
///
/// # Errors
/// The table states hashes of several machines, or of several solvers.
pub fn of_one_machine(table: &Table) -> Result<()> {
    for key in [MACHINE_HASH, SOLVER_HASH] {
        let mut all = hashes(table, key);
        let Some(first) = all.next() else { continue };
        if let Some(other) = all.find(|other| *other != first) {
            return Err(differ("the rows of this table are of two machines", first, other).help("fit a table of each machine"));
        }
    }
    Ok(())
}

/// Checks that another table is of the machine of `table`. Tables without a hash, measured ones among them, are not
/// compared.
///
/// # Errors
/// Both state a hash, and the hashes differ.
pub fn same_machine(table: &Table, other: &Table) -> Result<()> {
    of_one_machine(other)?;
    for key in [MACHINE_HASH, SOLVER_HASH] {
        if let (Some(own), Some(other)) = (hashes(table, key).next(), hashes(other, key).next())
            && own != other
        {
            return Err(differ("this table is of another machine than the one that is fitted", own, other)
                .help("sweep both anew, or leave this table out"));
        }
    }
    Ok(())
}

/// Checks that a machine with this hash is the one of `table`.
///
/// # Errors
/// The table states the hash of another machine.
pub fn is_machine_of(table: &Table, hash: &str) -> Result<()> {
    match hashes(table, MACHINE_HASH).find(|own| *own != hash) {
        Some(own) => Err(differ("this is another machine than the one that the table is of", own, hash)
            .help("take the file as it was swept; if only names or limits were changed, add --anyway")),
        None => Ok(()),
    }
}

fn hashes<'t>(table: &'t Table, key: &'static str) -> impl Iterator<Item = &'t str> {
    let stated = table.provenance.iter().filter(move |(own, _)| own == key).map(|(_, hash)| hash.as_str());
    let column = table.text(key).into_iter().flat_map(|column| column.values.iter().map(String::as_str));
    stated.chain(column).filter(|hash| !hash.is_empty())
}

fn differ(what: &str, own: &str, other: &str) -> Error {
    Error::input(what).at_key(MACHINE_HASH).read(format!("{own} and {other}"))
}
