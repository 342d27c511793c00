//! `coldplate materials`: materials and liquids that machine files may name without defining them.

use super::output::Output;
use super::text::table;
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::compact;
use coldplate_describe::machine::{Catalogue, LiquidRecord, MaterialRecord, PropertyRecord};

/// Materials and liquids that machine files may name
///
/// One of your own: [material.NAME] with conductivity, density, specific_heat; base = "steel" takes the rest from there.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Only entries with this text in name or source
    #[arg(value_name = "TEXT")]
    search: Option<String>,
}

/// Runs the command.
///
/// # Errors
/// Nothing has the text that is searched for.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let wanted = args.search.as_deref().unwrap_or_default();
    let found = Catalogue::built_in()?.search(wanted);
    if found.materials.is_empty() && found.liquids.is_empty() {
        return Err(Error::input("no material and no liquid has this in its name")
            .read(wanted)
            .help("coldplate materials alone lists all of them; one of your own is a table [material.NAME] in the machine file"));
    }
    out.report(&text(&found), &found);
    Ok(0)
}

fn text(found: &Catalogue) -> String {
    let shown = |p: &PropertyRecord| {
        let range = p.range_degC.map_or(String::new(), |[low, high]| format!(" ({} to {} degC)", compact(low, 4), compact(high, 4)));
        format!("{}{range}", compact(p.value, 4))
    };
    let material =
        |m: &MaterialRecord| vec![m.name.clone(), shown(&m.conductivity), shown(&m.density), shown(&m.specific_heat), m.source.clone()];
    let mut text = String::new();
    if !found.materials.is_empty() {
        let rows: Vec<Vec<String>> = found.materials.iter().map(material).collect();
        text += &table(&["material", "W/(m K)", "kg/m3", "J/(kg K)", "source"], &rows);
        text += "\n";
    }
    let liquid = |l: &LiquidRecord| {
        let [low, high] = l.range_degC.map(|t| compact(t, 4));
        let cells = [l.conductivity_W_mK, l.density_kg_m3, l.specific_heat_J_kgK].map(|v| compact(v, 4));
        let [conductivity, density, heat] = cells;
        vec![
            l.name.clone(),
            conductivity,
            density,
            heat,
            compact(l.viscosity_Pa_s * 1e3, 4),
            format!("{low} to {high} degC"),
            l.source.clone(),
        ]
    };
    if !found.liquids.is_empty() {
        let rows: Vec<Vec<String>> = found.liquids.iter().map(liquid).collect();
        text += &table(&["liquid", "W/(m K)", "kg/m3", "J/(kg K)", "mPa s", "known", "source"], &rows);
        text += "\n";
    }
    text + "values at 20 degC; in brackets where a table follows the temperature\n"
}
