//! `coldplate check`: inventory of a machine file, with warnings.

use std::path::PathBuf;

use super::condition::ConditionArgs;
use super::mesh_options::{CellsArgs, stated_cells};
use super::output::Output;
use super::text::table;
use coldplate_base::document::Document;
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::significant;
use coldplate_base::units::{self, Dimension};
use coldplate_describe::machine::Machine;
use coldplate_network::EnclosureViews;
use coldplate_solve::meshed::described::UncertainRecord;
use coldplate_solve::meshed::{Inventory, MeshedMachine, inventory};
use coldplate_solve::sensitivity::{Study, UncertainNumber};

/// Inventory of a machine file
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Machine file
    machine: PathBuf,
    #[command(flatten)]
    condition: ConditionArgs,
    /// Change a value of the machine file, KEY=VALUE
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    #[command(flatten)]
    cells: CellsArgs,
    /// Also say which coolant flow takes up the heat of all sources with this rise, such as "1 K"
    #[arg(long, value_name = "KELVIN", allow_hyphen_values = true)]
    rise: Option<String>,
}

/// Runs the command.
///
/// # Errors
/// The machine file cannot be used.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let sets = args.cells.with(&args.set)?;
    let given = args.condition.values()?;
    let counting = |machine: &Machine| {
        args.condition.condition(machine).map(|c| vec![c]).or_else(|e| if given.is_empty() { machine.usual_conditions() } else { Err(e) })
    };
    let progress = out.progress();
    let study = Study::for_conditions(Document::with_sets(&args.machine, &sets)?, args.cells.cells, counting, &progress)?;
    drop(progress);
    let (model, uncertain) = (&study.model, study.uncertain()?);
    // Heats are shown where the condition is complete; an inventory needs none.
    let condition = match args.condition.condition(&model.machine) {
        Ok(condition) => Some(condition),
        Err(error) if given.is_empty() => {
            out.note(&format!("heats and films are not shown: {}", error.what()));
            None
        }
        Err(error) => return Err(error),
    };
    let found = inventory(model, condition.as_ref())?;
    let sizing = match (&args.rise, condition.as_ref()) {
        (Some(rise), Some(condition)) => Some(model.flow_for_rise(self::rise(rise)?, condition)?),
        (Some(rise), None) => {
            return Err(Error::input("the heat of the sources is not known without a condition")
                .at_key("--rise")
                .read(rise)
                .help("give --coolant-temperature, --motor-speed and what else the machine file leaves open"));
        }
        (None, _) => None,
    };
    let (mut text, mut record) = (text(model, &found, &uncertain), model.describe(&found));
    record.uncertain = uncertain.iter().map(UncertainNumber::record).collect();
    if let Some(s) = sizing {
        text += &format!(
            "\n{:.2} W of all sources warm the water by {} K at {} L/min ({:.4e} m3/s), by more in a chamber warmer than the machine\n",
            s.heat_W,
            significant(s.rise_K, 3),
            significant(s.flow_m3_s * 6e4, 4),
            s.flow_m3_s
        );
        record.flow_for_rise = Some(s);
    }
    out.report(&text, &record);
    Ok(0)
}

/// `--rise`: a difference of temperatures that cooling water can have.
fn rise(text: &str) -> Result<f64> {
    let rise = units::parse(text, Dimension::DIFFERENCE).map_err(|e| e.at_key("--rise"))?;
    if rise > 0.0 && rise < 80.0 {
        Ok(rise)
    } else {
        Err(Error::input("this is no rise of cooling water").at_key("--rise").read(text).help("write for example --rise \"1 K\""))
    }
}

fn text(model: &MeshedMachine, found: &Inventory, uncertain: &[UncertainNumber]) -> String {
    let mut text = format!("{}\n{}\n\n", model.machine.name, model.machine.description.trim());
    let rows: Vec<Vec<String>> = found
        .parts
        .iter()
        .map(|p| {
            vec![
                p.name.clone(),
                p.material.clone(),
                significant(p.mass, 4),
                significant(p.capacity / 1e3, 4),
                significant(p.radiating_area, 4),
                p.cells.to_string(),
            ]
        })
        .collect();
    text += &table(&["part", "material", "mass kg", "capacity kJ/K", "radiating m2", "cells"], &rows);
    let rows: Vec<Vec<String>> = found
        .imports
        .iter()
        .map(|i| {
            let surfaces: Vec<String> = i.surfaces.iter().map(|(name, area)| format!("{name} {}", significant(*area, 4))).collect();
            let obtuse = format!("{:.1} %", 100.0 * i.obtuse);
            vec![i.name.clone(), i.file.clone(), i.tetrahedra.to_string(), format!("{:.2}", i.worst_quality), obtuse, surfaces.join(", ")]
        })
        .collect();
    if !rows.is_empty() {
        text += "\n";
        text += &table(&["imported", "mesh", "tetrahedra", "worst quality", "obtuse edges", "surfaces m2"], &rows);
    }
    let rows: Vec<Vec<String>> = found
        .contacts
        .iter()
        .map(|c| {
            let conductance = if c.conductance.is_finite() { significant(c.conductance, 4) } else { "bonded".into() };
            let note = if c.named { "" } else { "found, not named" };
            vec![c.name.clone(), c.between.join(" - "), significant(c.area, 4), conductance, note.into()]
        })
        .collect();
    if !rows.is_empty() {
        text += "\n";
        text += &table(&["contact", "between", "true area m2", "hA W/K", ""], &rows);
    }
    let rows: Vec<Vec<String>> = found
        .channels
        .iter()
        .map(|c| {
            let shown = |value: Option<f64>| value.map(|v| format!("{v:.0}")).unwrap_or_default();
            vec![
                c.name.clone(),
                c.circuit.clone(),
                format!("{:.3}", c.length),
                format!("{:.1}", c.diameter * 1e3),
                shown(c.reynolds),
                shown(c.film),
                shown(c.pressure_drop),
            ]
        })
        .collect();
    if !rows.is_empty() {
        text += "\n";
        text += &table(&["channel", "circuit", "length m", "d mm", "Re", "h W/(m2 K)", "drop Pa"], &rows);
    }
    let rows: Vec<Vec<String>> = (found.boundaries.iter())
        .map(|b| {
            let covered = if b.covered > 0.0 { format!("{} % covered", significant(100.0 * b.covered, 3)) } else { String::new() };
            vec![b.name.clone(), b.faces.join(", "), b.prescribes.clone(), significant(b.area, 4), covered]
        })
        .collect();
    if !rows.is_empty() {
        text += "\n";
        text += &table(&["boundary", "on", "prescribes", "acts on m2", ""], &rows);
    }
    if !found.sources.is_empty() {
        let rows: Vec<Vec<String>> =
            found.sources.iter().map(|s| vec![s.name.clone(), s.power.map(|p| format!("{p:.4}")).unwrap_or_default()]).collect();
        text += "\n";
        text += &table(&["source", "W"], &rows);
    }
    for enclosure in &model.network.enclosures {
        text += &enclosure_text(enclosure);
    }
    let size = if model.mesh.grids.is_empty() { String::new() } else { format!(" of {:.1} mm", model.mesh.element_size * 1e3) };
    text += &format!(
        "\n{} cells{size}, {} unknowns, {} sensors, {} limits\n",
        model.mesh.cells,
        model.network.nodes,
        model.network.sensors.len(),
        model.machine.limits.len()
    );
    if let Some(chosen) = &model.chosen {
        text += &format!(
            "cells chosen to leave less than {} K open, at {} conditions; estimates from {} cells\n",
            significant(chosen.accuracy, 3),
            chosen.conditions,
            chosen.checked_on
        );
        let sensors = model.network.sensor_names.iter().zip(&chosen.sensors);
        let limits = model.machine.limits.iter().map(|l| &l.name).zip(&chosen.limits);
        let of = |what: &str, (name, open): (&String, &Option<f64>)| Some(vec![name.clone(), what.into(), format!("{:.4}", (*open)?)]);
        let rows: Vec<Vec<String>> = sensors.filter_map(|own| of("", own)).chain(limits.filter_map(|own| of("limit", own))).collect();
        text += "\n";
        text += &table(&["what the mesh leaves open", "", "K"], &rows);
        text += &stated_cells(model, chosen).map(|note| format!("note: {note}\n")).collect::<String>();
    }
    if !model.machine.assumptions.is_empty() {
        let rows: Vec<Vec<String>> =
            model.machine.assumptions.iter().map(|a| vec![a.key.clone(), a.value.clone(), a.reason.clone()]).collect();
        text += "\n";
        text += &table(&["assumed", "value", "because"], &rows);
    }
    if !uncertain.is_empty() {
        text += "\n";
        text += &table(&["uncertain", "value", "standard deviation", ""], &uncertain.iter().map(uncertain_row).collect::<Vec<_>>());
    }
    for warning in &found.warnings {
        text += &format!("\nwarning: {warning}");
    }
    text
}

fn uncertain_row(number: &UncertainNumber) -> Vec<String> {
    let UncertainRecord { key, value, unit, standard_deviation, limits } = number.record();
    let unit_after = |unit: &str| if unit == "1" { String::new() } else { format!(" {unit}") };
    let limits = limits.map_or(String::new(), |[low, high]| format!("limits {} to {}", significant(low, 4), significant(high, 4)));
    let deviation = format!("{}{}", significant(standard_deviation, 3), unit_after(number.parameter.step_unit()));
    vec![key, format!("{}{}", significant(value, 4), unit_after(&unit)), deviation, limits]
}

/// Surfaces of an enclosure with their view factors.
fn enclosure_text(e: &EnclosureViews) -> String {
    let numbers: Vec<String> = (1..=e.surfaces.len()).map(|i| format!("to {i}")).collect();
    let name = format!("enclosure {}", e.name);
    let mut header = vec![name.as_str(), "area m2", "emissivity"];
    header.extend(numbers.iter().map(String::as_str));
    header.push("chamber");
    let row = |i: usize| {
        let mut row = vec![format!("{} {}", i + 1, e.surfaces[i]), significant(e.areas[i], 4), significant(e.emissivities[i], 3)];
        row.extend(e.view_factors[i].iter().chain([&e.chamber[i]]).map(|f| format!("{f:.5}")));
        row
    };
    let mut text = format!("\n{}", table(&header, &(0..e.surfaces.len()).map(row).collect::<Vec<_>>()));
    if e.by_rays > 0 {
        text += &format!(
            "{} patches, {} pairs by rays: standard error at most {:.1e}, corrected by at most {:.1e} for reciprocity and sums\n",
            e.patches, e.by_rays, e.error, e.corrected
        );
    }
    for note in &e.notes {
        text += &format!("note: {note}\n");
    }
    text
}
