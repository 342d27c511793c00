//! The machine part by part, and its assumed numbers.

use super::{ReportInput, figures, text};
use coldplate_describe::machine::Machine;
use coldplate_figures::report::{Align, ReportSection, ReportTable, TableCell};
use coldplate_solve::meshed::Inventory;

pub(super) fn write(section: &mut ReportSection, material: &ReportInput<'_>) {
    let study = material.sweep.study();
    if let Some(study) = study {
        section.paragraph(study.model.machine.description.trim());
    }
    for topic in ["machine", "measured"] {
        figures(section, material.gallery, topic);
    }
    if let Some(found) = material.inventory {
        inventory(section, found);
    }
    if let Some(study) = study {
        assumptions(section, &study.model.machine);
    }
}

fn inventory(section: &mut ReportSection, found: &Inventory) {
    let mut parts = ReportTable::new([
        ("part", Align::Left),
        ("material", Align::Left),
        ("mass [kg]", Align::Right),
        ("radiating [m²]", Align::Right),
        ("cells", Align::Right),
    ]);
    for part in &found.parts {
        parts.row([
            text(&part.name),
            text(&part.material),
            TableCell::number(part.mass, 2),
            TableCell::number(part.radiating_area, 4),
            text(part.cells.to_string()),
        ]);
    }
    parts.folded(format!("{} parts", found.parts.len()));
    section.table(parts);
    let mut contacts = ReportTable::new([
        ("contact", Align::Left),
        ("between", Align::Left),
        ("true area [m²]", Align::Right),
        ("hA [W/K]", Align::Right),
    ]);
    for contact in &found.contacts {
        let conductance = if contact.conductance.is_finite() { TableCell::number(contact.conductance, 3) } else { text("bonded") };
        contacts.row([text(&contact.name), text(contact.between.join(" – ")), TableCell::number(contact.area, 5), conductance]);
    }
    contacts.folded(format!("{} contacts", found.contacts.len()));
    section.table(contacts);
    let mut channels = ReportTable::new([
        ("channel", Align::Left),
        ("length [m]", Align::Right),
        ("Re", Align::Right),
        ("h [W/(m² K)]", Align::Right),
        ("pressure drop [kPa]", Align::Right),
    ]);
    for channel in &found.channels {
        let kilopascal = channel.pressure_drop.map(|p| p / 1e3);
        channels.row([
            text(&channel.name),
            TableCell::number(channel.length, 3),
            TableCell::optional(channel.reynolds, 0),
            TableCell::optional(channel.film, 0),
            TableCell::optional(kilopascal, 2),
        ]);
    }
    if !channels.is_empty() {
        channels.folded("Channels, at the middle of the swept ranges");
        section.table(channels);
    }
    let mut sources = ReportTable::new([("source", Align::Left), ("heat [W]", Align::Right)]);
    for source in &found.sources {
        sources.row([text(&source.name), TableCell::optional(source.power, 3)]);
    }
    if !sources.is_empty() {
        sources.folded("Heat sources, at the middle of the swept ranges");
        section.table(sources);
    }
}

fn assumptions(section: &mut ReportSection, machine: &Machine) {
    let assumed = &machine.assumptions;
    if assumed.is_empty() {
        section.paragraph("The machine file marks no number as assumed.");
        return;
    }
    let mut table = ReportTable::new([("what", Align::Left), ("value", Align::Left), ("because", Align::Left)]);
    for assumption in assumed {
        table.row([text(&assumption.key), text(&assumption.value), text(&assumption.reason)]);
    }
    table.folded(format!("{} numbers of the machine file, each with its reason", assumed.len()));
    section.table(table);
}
