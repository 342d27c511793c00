//! `coldplate units`: units that values may carry.

use serde::Serialize;

use super::output::Output;
use super::text::table;
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::compact;
use coldplate_base::units::{KnownQuantity, KnownUnit, quantities, symbols};

/// Units that values may carry
///
/// Symbols are put together with spaces, slashes, brackets and powers: "W/(m2 K)", "kg m2", "J/kg/K", "m^3/s".
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Only units with this text in symbol, quantity or SI unit
    #[arg(value_name = "TEXT")]
    search: Option<String>,
}

/// Known units: each field is a key of `coldplate units --json`.
#[derive(Debug, Serialize)]
struct UnitsRecord {
    units: Vec<KnownUnit>,
    quantities: Vec<KnownQuantity>,
}

/// Runs the command.
///
/// # Errors
/// Nothing has the text that is searched for.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let wanted = args.search.as_deref().unwrap_or_default().to_lowercase();
    let has = |text: &str| text.to_lowercase().contains(&wanted);
    let mut found = UnitsRecord { units: symbols(), quantities: quantities() };
    found.units.retain(|u| [u.symbol, u.dimension, u.si].into_iter().chain(u.not.iter().copied()).any(has));
    found.quantities.retain(|q| [q.name, q.si, q.example].into_iter().any(has));
    if found.units.is_empty() && found.quantities.is_empty() {
        return Err(Error::input("no unit and no quantity has this in its name")
            .read(args.search.as_deref().unwrap_or_default())
            .help("coldplate units alone lists all of them"));
    }
    out.report(&text(&found), &found);
    Ok(0)
}

fn text(found: &UnitsRecord) -> String {
    let unit = |u: &KnownUnit| {
        let zero = u.zero_K.map_or(String::new(), |zero| format!("{} K + ", compact(zero, 7)));
        vec![u.symbol.to_string(), u.dimension.to_string(), format!("= {zero}{} {}", compact(u.factor, 10), u.si), u.not.join(", ")]
    };
    let mut text = String::new();
    if !found.units.is_empty() {
        text += &table(&["unit", "of", "one of it", "not written"], &found.units.iter().map(unit).collect::<Vec<_>>());
        text += "\n";
    }
    let quantity = |q: &KnownQuantity| vec![q.name.to_string(), q.si.to_string(), q.example.to_string()];
    if !found.quantities.is_empty() {
        text += &table(&["quantity", "SI", "written for example"], &found.quantities.iter().map(quantity).collect::<Vec<_>>());
    }
    text
}
