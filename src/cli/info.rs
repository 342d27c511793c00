//! `coldplate info`: content of a file.

use std::path::PathBuf;

use super::output::Output;
use super::text::table;
use coldplate_base::error::Result;
use coldplate_base::numbers::{compact, significant};
use coldplate_jobs::info::{
    ColumnInfo, Fact, HeldInfo, Info, JournalInfo, MachineInfo, ParameterInfo, PointInfo, RangeInfo, ReducedInfo, SurrogateInfo, SweepInfo,
    TableInfo,
};

/// Content of any file of the program
///
/// A surrogate, a reduced model, a machine, a sweep, its journal, or a table.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Surrogate (.cps), reduced model (.cpr), machine or sweep file (.toml), journal, or table (.csv, .parquet)
    file: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// The file cannot be read or is of no known kind.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let info = Info::of(&args.file)?;
    let text = match &info {
        Info::Surrogate(found) => surrogate(found),
        Info::Machine(found) => machine(found),
        Info::Sweep(found) => sweep(found),
        Info::Reduced(found) => reduced(found),
        Info::Journal(found) => journal(found),
        Info::Table(found) => a_table(found),
    };
    out.report(&text, &info);
    Ok(0)
}

/// A number in full, or nothing.
fn shown(value: Option<f64>) -> String {
    value.map_or(String::new(), |v| compact(v, 9))
}

fn range(range: &RangeInfo) -> Vec<String> {
    vec![range.name.clone(), shown(range.low), shown(range.high), range.unit.clone()]
}

fn facts(facts: &[Fact]) -> String {
    facts.iter().map(|fact| format!("  {}: {}\n", fact.key, fact.value)).collect()
}

fn surrogate(found: &SurrogateInfo) -> String {
    let variables: Vec<Vec<String>> = found.variables.iter().map(range).collect();
    let mut text = format!("surrogate, layout version {}, {} bytes\n\n", found.version, found.bytes);
    text += &table(&["variable", "from", "to", "unit"], &variables);
    if !found.held.is_empty() {
        let ends = |h: &HeldInfo| h.followed.map_or([None, None], |range| range.map(Some));
        let row = |h: &HeldInfo| [vec![h.name.clone(), shown(Some(h.value)), h.unit.clone()], ends(h).map(shown).to_vec()].concat();
        let held: Vec<Vec<String>> = found.held.iter().map(row).collect();
        text += &format!("\n{}", table(&["held", "at", "unit", "followed from", "to"], &held));
    }
    let moves = found.points.iter().any(|p| p.over_time.is_some());
    let point = |p: &PointInfo| -> Vec<String> {
        let over_time = moves.then(|| p.over_time.map_or(String::new(), |more| significant(more, 2)));
        let (band, unit) = (significant(p.half_width, 2), p.unit.clone());
        [p.name.clone(), p.model.clone(), band].into_iter().chain(over_time).chain([unit]).collect()
    };
    let points: Vec<Vec<String>> = found.points.iter().map(point).collect();
    let heading: &[&str] =
        if moves { &["point", "model", "band +-", "over time +-", "unit"] } else { &["point", "model", "band +-", "unit"] };
    text += &format!("\n{}", table(heading, &points));
    if !found.uncertain.is_empty() {
        let origin = |assumed: bool| if assumed { "assumed" } else { "" };
        let row = |p: &ParameterInfo| {
            let numbers = [p.value, p.standard_deviation, p.low, p.high].map(|value| significant(value, 4));
            [vec![p.name.clone()], numbers.to_vec(), vec![p.unit.clone(), origin(p.assumed).into()]].concat()
        };
        let rows: Vec<Vec<String>> = found.uncertain.iter().map(row).collect();
        text += &format!("\n{}", table(&["uncertain", "value", "deviation", "from", "to", "unit", ""], &rows));
    }
    let limits: Vec<Vec<String>> =
        found.limits.iter().map(|l| vec![l.name.clone(), l.of.clone(), shown(Some(l.maximum)), l.unit.clone()]).collect();
    text += &if limits.is_empty() { "\nno limits\n".into() } else { format!("\n{}", table(&["limit", "of", "maximum", "unit"], &limits)) };
    text + &format!("\nprovenance\n{}", facts(&found.provenance))
}

fn machine(found: &MachineInfo) -> String {
    let variables: Vec<Vec<String>> = (found.variables.iter())
        .map(|v| {
            let used = if v.used { "" } else { "nothing follows it" };
            vec![v.range.name.clone(), shown(v.default), shown(v.range.low), shown(v.range.high), v.range.unit.clone(), used.into()]
        })
        .collect();
    let mut text = format!("machine '{}', about {} cells, hash {}\n\n", found.name, found.cells, found.hash);
    text += &table(&["variable", "default", "from", "to", "unit", ""], &variables);
    text.push('\n');
    for (what, names) in [
        ("parts", &found.parts),
        ("nodes", &found.nodes),
        ("contacts", &found.contacts),
        ("channels", &found.channels),
        ("circuits", &found.circuits),
        ("sources", &found.sources),
        ("sensors", &found.sensors),
        ("limits", &found.limits),
        ("measured states", &found.measurements),
        ("assumed numbers", &found.assumed),
    ] {
        if !names.is_empty() {
            text += &format!("{} {what}: {}\n", names.len(), names.join(", "));
        }
    }
    text
}

fn sweep(found: &SweepInfo) -> String {
    let groups: Vec<Vec<String>> = found.groups.iter().map(|g| vec![g.name.clone(), g.conditions.to_string(), g.design.clone()]).collect();
    let variables: Vec<Vec<String>> = found.variables.iter().map(range).collect();
    format!(
        "sweep '{}' of {}: {} conditions\n\n{}\n{}",
        found.name,
        found.machine,
        found.conditions,
        table(&["design", "conditions", "kind"], &groups),
        table(&["variable", "from", "to", "unit"], &variables)
    )
}

fn reduced(found: &ReducedInfo) -> String {
    let variables: Vec<Vec<String>> = found.variables.iter().map(range).collect();
    let [coarse, fine] = found.modes;
    let over_time = if found.in_time { "steady states and histories" } else { "steady states" };
    let field = if found.field { ", and the temperatures of all cells" } else { "" };
    let mut text = format!("reduced model of '{}', {} bytes, machine hash {}\n\n", found.machine, found.bytes, found.hash);
    text += &table(&["variable", "from", "to", "unit"], &variables);
    text += &format!("\n{coarse} and {fine} modes for {} cells; {over_time}{field}\n", found.cells);
    text += &format!(
        "at {} random conditions off by {} K at most, within a bound of {} K\n{} sensors: {}\n",
        found.checks,
        significant(found.largest_error_K, 2),
        significant(found.largest_bound_K, 2),
        found.sensors.len(),
        found.sensors.join(", ")
    );
    if !found.parameters.is_empty() {
        text += &format!("{} parameters: {}\n", found.parameters.len(), found.parameters.join(", "));
    }
    text
}

fn journal(found: &JournalInfo) -> String {
    let damaged = if found.damaged_lines.is_empty() { String::new() } else { format!(", damaged lines: {:?}", found.damaged_lines) };
    format!(
        "journal of {} conditions: {} solved, {} failed, {} to do{damaged}\n\n{} outputs: {}\n\nthe results depend on\n{}",
        found.conditions,
        found.solved,
        found.failed,
        found.conditions.saturating_sub(found.solved + found.failed),
        found.outputs.len(),
        found.outputs.join(", "),
        facts(&found.identity)
    )
}

fn a_table(found: &TableInfo) -> String {
    let row = |kind: &'static str| {
        move |c: &ColumnInfo| {
            let mut cells = range(&c.range);
            cells.extend([kind.to_owned(), if c.missing > 0 { c.missing.to_string() } else { String::new() }]);
            cells
        }
    };
    let columns: Vec<Vec<String>> = found.conditions.iter().map(row("condition")).chain(found.outputs.iter().map(row("output"))).collect();
    let texts = if found.texts.is_empty() { String::new() } else { format!("\ntext: {}\n", found.texts.join(", ")) };
    format!(
        "table of {} rows\n\n{}{texts}\nprovenance\n{}",
        found.rows,
        table(&["column", "from", "to", "unit", "kind", "missing"], &columns),
        facts(&found.provenance)
    )
}
