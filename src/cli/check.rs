//! `coldplate check`: inventory of a machine file, with warnings.

use std::path::PathBuf;

use super::condition::ConditionArgs;
use super::mesh_options::{MeshArgs, stated_cells};
use super::output::Output;
use super::text::{block, table};
use coldplate_base::document::Document;
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::significant;
use coldplate_base::units::{self, Dimension};
use coldplate_describe::machine::{LimitKind, Machine, MachineLimit};
use coldplate_network::EnclosureViews;
use coldplate_solve::meshed::described::UncertainRecord;
use coldplate_solve::meshed::{ChannelEntry, ContactEntry, ImportEntry, Inventory, MeshedMachine, PartEntry, SourceEntry, inventory};
use coldplate_solve::sensitivity::UncertainNumber;
use coldplate_solve::study::Study;

/// Inventory of a machine file, with warnings
///
/// Parts, contacts with their true areas and hA, channels, boundaries, sources, the size of the mesh, and everything that the
/// file assumes or calls uncertain.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Machine file
    machine: PathBuf,
    #[command(flatten)]
    condition: ConditionArgs,
    #[command(flatten)]
    mesh: MeshArgs,
    /// Also say which coolant flow takes up the heat of all sources with this rise, such as "1 K"
    #[arg(long, value_name = "KELVIN", allow_hyphen_values = true)]
    rise: Option<String>,
}

/// Runs the command.
///
/// # Errors
/// The machine file cannot be used.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let sets = args.mesh.sets()?;
    let given = args.condition.values()?;
    let counting = |machine: &Machine| {
        args.condition.condition(machine).map(|c| vec![c]).or_else(|e| if given.is_empty() { machine.usual_conditions() } else { Err(e) })
    };
    let progress = out.progress();
    let study = Study::for_conditions(Document::read(&args.machine)?.with_sets(&sets)?, args.mesh.cells, counting, &progress)?;
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
    let mut text = format!("{}\n{}\n", model.machine.name, model.machine.description.trim());
    for stage in [parts, imports, contacts, channels, boundaries, sources] {
        text += &stage(found);
    }
    text += &model.network.enclosures.iter().map(enclosure_text).collect::<String>();
    text += &size(model);
    text += &one_sided(&model.machine);
    let rows: Vec<Vec<String>> = model.machine.assumptions.iter().map(|a| vec![a.key.clone(), a.value.clone(), a.reason.clone()]).collect();
    text += &block(&["assumed", "value", "because"], &rows);
    text += &block(&["uncertain", "value", "standard deviation", ""], &uncertain.iter().map(uncertain_row).collect::<Vec<_>>());
    text + &found.warnings.iter().map(|warning| format!("\nwarning: {warning}")).collect::<String>()
}

fn parts(found: &Inventory) -> String {
    let row = |p: &PartEntry| {
        vec![
            p.name.clone(),
            p.material.clone(),
            significant(p.mass, 4),
            significant(p.capacity / 1e3, 4),
            significant(p.radiating_area, 4),
            p.cells.to_string(),
        ]
    };
    let heading = ["part", "material", "mass kg", "capacity kJ/K", "radiating m2", "cells"];
    format!("\n{}", table(&heading, &found.parts.iter().map(row).collect::<Vec<_>>()))
}

fn imports(found: &Inventory) -> String {
    let row = |i: &ImportEntry| {
        let surfaces: Vec<String> = i.surfaces.iter().map(|(name, area)| format!("{name} {}", significant(*area, 4))).collect();
        let obtuse = format!("{:.1} %", 100.0 * i.obtuse);
        vec![i.name.clone(), i.file.clone(), i.tetrahedra.to_string(), format!("{:.2}", i.worst_quality), obtuse, surfaces.join(", ")]
    };
    let heading = ["imported", "mesh", "tetrahedra", "worst quality", "obtuse edges", "surfaces m2"];
    block(&heading, &found.imports.iter().map(row).collect::<Vec<_>>())
}

fn contacts(found: &Inventory) -> String {
    let row = |c: &ContactEntry| {
        let conductance = if c.conductance.is_finite() { significant(c.conductance, 4) } else { "bonded".into() };
        let note = if c.named { "" } else { "found, not named" };
        vec![c.name.clone(), c.between.join(" - "), significant(c.area, 4), conductance, note.into()]
    };
    block(&["contact", "between", "true area m2", "hA W/K", ""], &found.contacts.iter().map(row).collect::<Vec<_>>())
}

fn channels(found: &Inventory) -> String {
    let row = |c: &ChannelEntry| {
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
    };
    let heading = ["channel", "circuit", "length m", "d mm", "Re", "h W/(m2 K)", "drop Pa"];
    block(&heading, &found.channels.iter().map(row).collect::<Vec<_>>())
}

fn boundaries(found: &Inventory) -> String {
    let rows: Vec<Vec<String>> = (found.boundaries.iter())
        .map(|b| {
            let covered = if b.covered > 0.0 { format!("{} % covered", significant(100.0 * b.covered, 3)) } else { String::new() };
            vec![b.name.clone(), b.faces.join(", "), b.prescribes.clone(), significant(b.area, 4), covered]
        })
        .collect();
    block(&["boundary", "on", "prescribes", "acts on m2", ""], &rows)
}

fn sources(found: &Inventory) -> String {
    let row = |s: &SourceEntry| vec![s.name.clone(), s.power.map(|p| format!("{p:.4}")).unwrap_or_default()];
    block(&["source", "W"], &found.sources.iter().map(row).collect::<Vec<_>>())
}

/// Size of the model, and the errors that its cells were chosen for.
fn size(model: &MeshedMachine) -> String {
    let size = if model.mesh.grids.is_empty() { String::new() } else { format!(" of {:.1} mm", model.mesh.element_size * 1e3) };
    let text = format!(
        "\n{} cells{size}, {} unknowns, {} sensors, {} limits\n",
        model.mesh.cells,
        model.network.nodes,
        model.network.sensors.len(),
        model.machine.limits.len()
    );
    let Some(chosen) = &model.chosen else { return text };
    let sensors = model.network.sensor_names.iter().map(|name| (name, "")).zip(&chosen.sensors);
    let limits = model.machine.limits.iter().map(|l| (&l.name, "limit")).zip(&chosen.limits);
    let rows: Vec<Vec<String>> = (sensors.chain(limits))
        .filter_map(|((name, what), open)| Some(vec![name.clone(), what.into(), format!("{:.4}", (*open)?)]))
        .collect();
    format!(
        "{text}cells chosen to leave less than {} K open, at {} conditions; estimates from {} cells\n\n{}{}",
        significant(chosen.accuracy, 3),
        chosen.conditions,
        chosen.checked_on,
        table(&["what the mesh leaves open", "", "K"], &rows),
        stated_cells(model, chosen).map(|note| format!("note: {note}\n")).collect::<String>()
    )
}

/// Limits of a difference, which watch one side of it.
fn one_sided(machine: &Machine) -> String {
    let sentence = |limit: &MachineLimit| match limit.kind {
        LimitKind::Difference { first, second } => {
            let [first, second] = [first, second].map(|sensor| machine.sensors[sensor].name.as_str());
            Some(format!(
                "limit '{}' watches '{first}' above '{second}' alone; sensors = [{first:?}, {second:?}] with spread watches both sides\n",
                limit.name
            ))
        }
        _ => None,
    };
    machine.limits.iter().filter_map(sentence).collect()
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
