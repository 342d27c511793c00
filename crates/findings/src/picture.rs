//! The machine in three dimensions: where the best explanation sits, and by how much it changes the temperatures.

use super::Findings;
use super::energy::ConditionBalance;
use coldplate_base::error::Result;
use coldplate_figures::report::{Align, ReportSection, ReportTable, TableCell};
use coldplate_jobs::scene::States;

/// Most conditions that are shown, a count. Chosen: each makes the report larger by two fields.
const CONDITIONS: usize = 4;
/// Most parts that the name of one cause stands at, a count. Chosen: more names hide the machine.
const NAMED: usize = 2;
/// Most rows of the table of parts, a count. Chosen: the parts that change most say where it sits.
const ROWS: usize = 12;

/// The machine in three dimensions, and a table of the parts that change most.
pub(super) fn picture(section: &mut ReportSection, found: &Findings<'_>) {
    let solved: Vec<&ConditionBalance> = found.energy.balances.iter().filter(|b| b.extended_temperatures.is_some()).collect();
    let is_compared = !solved.is_empty();
    let shown = if is_compared { solved } else { found.energy.balances.iter().collect() };
    if !is_compared {
        section.paragraph(format!("The machine is shown as it is alone: {}.", found.why_not_extended()));
    }
    match page(found, &shown, is_compared) {
        Ok(page) => section.page(page, "The machine in three dimensions, coloured by temperature"),
        Err(error) => section.paragraph(format!("The machine is not shown in three dimensions: {}.", error.what())),
    };
    if let Some(balance) = found.energy.largest().filter(|_| is_compared) {
        changes(section, found, balance);
    }
}

fn page(found: &Findings<'_>, shown: &[&ConditionBalance], is_compared: bool) -> Result<String> {
    let own = &found.problem.study.model;
    let extended =
        found.energy.extended.as_ref().filter(|_| is_compared).map(|study| ("with the best explanation".to_string(), &study.model));
    // The condition with most heat, which says most, before the others.
    let largest = found.energy.largest();
    let is_largest = |b: &&&ConditionBalance| largest.is_some_and(|own| std::ptr::eq(**b, own));
    let others: Vec<&&ConditionBalance> = shown.iter().filter(|b| !is_largest(b)).collect();
    let evenly = others.iter().step_by(others.len().div_ceil(CONDITIONS - 1).max(1)).copied();
    let chosen = shown.iter().filter(is_largest).chain(evenly);
    let fields =
        |b: &ConditionBalance| std::iter::once(b.temperatures.clone()).chain(b.extended_temperatures.clone().filter(|_| is_compared));
    let causes = found.diagnosis.explanations.first().into_iter().flat_map(|best| &best.causes);
    let named = causes.filter(|cause| cause.hypothesis.parts.len() <= NAMED);
    let marked = named.flat_map(|cause| cause.hypothesis.parts.iter().map(|part| (part.clone(), cause.hypothesis.kind_and_place())));
    let note = if is_compared {
        "The change is that of the steady state at the conditions of the data, by the best explanation."
    } else {
        "Steady states at conditions of the data."
    };
    let states = States {
        versions: std::iter::once(("the machine as it is".to_string(), own)).chain(extended).collect(),
        conditions: chosen.map(|b| (b.test.clone(), fields(b).collect())).collect(),
        marked: marked.collect(),
        notes: vec![note.into()],
    };
    states.page()
}

/// Parts that change most at a condition.
fn changes(section: &mut ReportSection, found: &Findings<'_>, balance: &ConditionBalance) {
    let Some(after) = &balance.extended_temperatures else { return };
    let network = &found.problem.study.model.network;
    let mut parts: Vec<(&String, f64, f64, usize)> = network.groups.iter().map(|name| (name, 0.0, 0.0, 0)).collect();
    for ((group, before), after) in network.group.iter().zip(&balance.temperatures).zip(after) {
        let Some((_, sum, largest, count)) = parts.get_mut(*group as usize) else { continue };
        let change = after - before;
        (*sum, *count) = (*sum + change, *count + 1);
        if change.abs() > f64::abs(*largest) {
            *largest = change;
        }
    }
    parts.retain(|(.., count)| *count > 0);
    parts.sort_by(|a, b| b.2.abs().total_cmp(&a.2.abs()));
    let mut table = ReportTable::new([("part", Align::Left), ("mean change [K]", Align::Right), ("largest change [K]", Align::Right)]);
    for (name, sum, largest, count) in parts.iter().take(ROWS) {
        table.row([TableCell::from(name.replace('_', " ")), signed(sum / *count as f64), signed(*largest)]);
    }
    let more = if parts.len() > ROWS { format!("; the {ROWS} of {} parts that change most", parts.len()) } else { String::new() };
    table.caption(format!(
        "Temperature with the best explanation less that without, at {}, the condition with most heat{more}",
        balance.test
    ));
    section.table(table);
}

fn signed(kelvin: f64) -> TableCell {
    TableCell::from(format!("{kelvin:+.2}"))
}
