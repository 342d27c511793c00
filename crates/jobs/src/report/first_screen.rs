//! The first screen: the answer, how well the machine is known, the machine at its worst acceptable condition, and the map.

use super::super::figures::always;
use super::super::summary::Summary;
use super::{ReportInput, figures};
use coldplate_base::error::Result;
use coldplate_base::numbers::significant;
use coldplate_figures::chart::title_and_footer::fixed_conditions;
use coldplate_figures::report::{KeyFigure, ReportSection, Tone};
use coldplate_surrogate::fit::file;

pub(super) fn write(section: &mut ReportSection, material: &ReportInput<'_>) -> Result<()> {
    let summary = material.summary;
    match &summary.answer {
        Some(answer) => section.lead(if answer.is_found { Tone::Good } else { Tone::Bad }, &answer.sentence),
        None => section.lead(Tone::Plain, "No limit is asked about: nothing is acceptable or not."),
    };
    let mut keys: Vec<KeyFigure> = known(summary).into_iter().collect();
    if let Some(open) = summary.answer.as_ref().and_then(|answer| answer.open.as_ref()) {
        keys.push(KeyFigure::new(open, "too close to a limit to call; beyond, not acceptable").tone(Tone::Uncertain));
    }
    section.key_figures(keys);
    let failed = summary.failures.len();
    if failed > 0 {
        section.note(Tone::Bad, format!("{failed} conditions failed; failures.csv has the reasons. They are in no table and no fit."));
    }
    if let Some(found) = summary.adaptation.as_ref().filter(|found| !found.reached) {
        section.note(Tone::Bad, found.sentence());
    }
    figures(section, material.gallery, "answer");
    if let Some(fitted) = material.fitted {
        how_to_read(section, &file::open(&fitted.bytes)?);
    }
    for warning in material.inventory.iter().flat_map(|inventory| &inventory.warnings) {
        section.note(Tone::Uncertain, warning);
    }
    for note in &summary.notes {
        section.note(Tone::Plain, note);
    }
    Ok(())
}

/// The rule of the verdict, and the values that all of this is for.
fn how_to_read(section: &mut ReportSection, surrogate: &coldplate_surrogate::verdict::Surrogate<'_>) {
    if surrogate.limit_count() > 0 {
        section.paragraph(match surrogate.uncertainty() {
            Some(_) => {
                "A condition is acceptable if all limits are kept with a probability of at least 95 %, not acceptable if with at most 5 %, \
                 and uncertain otherwise. Outside the fitted range nothing is ever called acceptable."
            }
            None => {
                "A condition is acceptable if every limit is kept even at the unfavourable end of its band, not acceptable if some limit \
                 is broken even at the favourable end, and uncertain otherwise. Outside the fitted range nothing is ever called acceptable."
            }
        });
    }
    let held = always(surrogate);
    if !held.is_empty() {
        let reach = match surrogate.followed() {
            [] => "All of this, and the surrogate file, is for these values alone.",
            _ => {
                "All of this is for these values; the surrogate file answers for others too, within the ranges that `coldplate info` shows."
            }
        };
        section.paragraph(format!("{}. {reach}", fixed_conditions(&held)));
    }
}

/// How well the machine is known: its measured readings, and the error of the mesh. The error of the fit says nothing of it.
fn known(summary: &Summary) -> [KeyFigure; 2] {
    let measured = match &summary.known {
        Some(known) => {
            let tone = if known.inside == known.readings { Tone::Good } else { Tone::Uncertain };
            let off =
                format!("measured readings inside their band; the worst is {} K off ({})", significant(known.distance, 2), known.worst);
            KeyFigure::new(format!("{} of {}", known.inside, known.readings), off).tone(tone)
        }
        None => KeyFigure::new("none", "measured readings: the numbers of the machine file stand unproved").tone(Tone::Uncertain),
    };
    let temperatures = summary.points.iter().filter(|p| p.unit == "K").filter_map(|p| Some((p.mesh?, &p.name)));
    let mesh = match temperatures.max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((error, name)) => KeyFigure::new(format!("{} K", significant(error, 2)), format!("error of the mesh at most ({name})")),
        None => KeyFigure::new("–", "error of the mesh: not known"),
    };
    [measured, mesh]
}
