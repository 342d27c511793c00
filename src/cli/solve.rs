//! `coldplate solve`: steady temperatures at one condition.

use std::path::PathBuf;
use std::time::Instant;

use serde::Serialize;

use super::condition::ConditionArgs;
use super::hottest::{Place, hottest, hottest_text};
use super::mesh_options::{CellsArgs, stated_cells};
use super::output::Output;
use super::text::table;
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::significant;
use coldplate_base::progress::Progress;
use coldplate_base::units::{self, Celsius, Dimension, Kelvin, Measurand, express};
use coldplate_describe::machine::{Condition, Machine};
use coldplate_network::HeatMeter;
use coldplate_network::mesh::vtu;
use coldplate_solve::balance::{ContactFlow, contact_flows, enclosure_heats};
use coldplate_solve::meshed::{MeshErrors, MeshRecord, MeshedMachine, SteadyState};

/// Steady temperatures at one condition
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Machine file, or a reduced model of one
    machine: PathBuf,
    #[command(flatten)]
    condition: ConditionArgs,
    /// Change a value of the machine file, for example contact.motor.conductance="560 W/(m2 K)"
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    #[command(flatten)]
    cells: CellsArgs,
    /// Warn if the error by the mesh is larger than this in a reading
    #[arg(long, value_name = "KELVIN", default_value = "0.1 K", allow_hyphen_values = true)]
    mesh_tolerance: String,
    /// Do not estimate the error by the mesh: saves two solutions with an eighth and a 27th of the cells
    #[arg(long)]
    no_mesh_error: bool,
    /// Write the temperature field for ParaView
    #[arg(long, value_name = "FILE")]
    vtu: Option<PathBuf>,
    /// Say where every part is hottest
    #[arg(long)]
    hottest: bool,
}

/// Runs the command.
///
/// # Errors
/// Bad input, or numerics that failed.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let start = Instant::now();
    let options = [("--set", !args.set.is_empty()), args.cells.given()];
    if let Some(bytes) = super::reduced::bytes(&args.machine, &options)? {
        return super::reduced::run(&args.machine, &bytes, &args.condition, (args.vtu.as_deref(), args.hottest), out);
    }
    let sets = args.cells.with(&args.set)?;
    let tolerance = units::parse(&args.mesh_tolerance, Dimension::DIFFERENCE).map_err(|e| e.at_key("--mesh-tolerance"))?;
    if tolerance.is_nan() || tolerance <= 0.0 {
        let error = Error::input("a tolerance must be positive").at_key("--mesh-tolerance").read(&args.mesh_tolerance);
        return Err(error.help("write for example --mesh-tolerance \"0.1 K\""));
    }
    let machine = Machine::read(&args.machine, &sets)?;
    let condition = args.condition.condition(&machine)?;
    for (variable, value) in machine.variables.iter().zip(condition.si()) {
        if let Some((low, high)) = variable.range.filter(|(low, high)| value < low || value > high) {
            let shown = |si: f64| express(si, &variable.unit, variable.dimension).unwrap_or(si);
            out.note(&format!(
                "note: {} = {} {} is outside the range the machine file gives, {} to {}",
                variable.name,
                significant(shown(*value), 6),
                variable.unit,
                significant(shown(low), 6),
                significant(shown(high), 6)
            ));
        }
    }
    let progress = out.progress();
    progress.at("meshing");
    let model = MeshedMachine::for_conditions(machine, args.cells.cells, |_| Ok(vec![condition.clone()]), &progress)?;
    let solver = model.solver_heard(&condition, &progress)?;
    let state = model.solve(&solver, &condition)?;
    drop(solver);
    progress.at("error by the mesh");
    let is_asked = !args.no_mesh_error && model.chosen.is_none();
    let mesh = if is_asked { mesh_errors(&model, &condition, &state, out) } else { None };
    drop(progress);
    for warning in mesh.iter().flat_map(|mesh| too_coarse(&model, mesh, tolerance)) {
        out.note(&warning);
    }
    let seconds = start.elapsed().as_secs_f64();
    if let Some(path) = &args.vtu {
        vtu::write(path, &model.machine, &model.mesh, &state.solution.temperatures)?;
        out.note(&format!("wrote {}", path.display()));
    }
    let contacts = contact_flows(&model.network, &state.load.contacts, &state.solution.temperatures);
    let mut record = model.record(&state);
    record.seconds.total = seconds;
    record.mesh = mesh.as_ref().map(|mesh| MeshRecord::of(&model, mesh, tolerance));
    let places = args.hottest.then(|| hottest(&model.machine, &model.mesh, &state.solution.temperatures));
    let text = text(&model, &state, mesh.as_ref(), &contacts, seconds) + &places.as_deref().map_or_else(String::new, hottest_text);
    out.report(&text, &WithPlaces { record, hottest: places });
    Ok(0)
}

/// A solution, and the hottest places of the parts if asked for.
#[derive(Serialize)]
struct WithPlaces<R> {
    #[serde(flatten)]
    record: R,
    #[serde(skip_serializing_if = "Option::is_none")]
    hottest: Option<Vec<Place>>,
}

/// Errors by the mesh, or a note why they are not known.
fn mesh_errors(model: &MeshedMachine, condition: &Condition, state: &SteadyState, out: Output) -> Option<MeshErrors> {
    if !model.mesh.tetra.is_empty() {
        out.note("note: the error by the mesh is not known: imported parts keep their elements");
    }
    model.mesh_errors(condition, state).unwrap_or_else(|error| {
        out.note(&format!("note: the error by the mesh is not known: a coarser mesh gives '{}'", error.what()));
        None
    })
}

/// A warning if readings are less certain on this mesh than asked for.
fn too_coarse(model: &MeshedMachine, mesh: &MeshErrors, tolerance: f64) -> Option<String> {
    let temperatures = model.network.measurands.iter().map(|own| *own == Measurand::Temperature);
    let names = model.network.sensor_names.iter().zip(&mesh.errors).zip(temperatures);
    let names = names.filter(|((_, e), is_temperature)| *is_temperature && **e > tolerance).map(|(own, _)| own);
    let list: Vec<String> = names.map(|(name, e)| format!("{name} by {} K", significant(*e, 2))).collect();
    let shown = if list.len() > 5 { format!("{} and {} more", list[..5].join(", "), list.len() - 5) } else { list.join(", ") };
    (!list.is_empty())
        .then(|| format!("warning: the mesh leaves more open than {} K: {shown}; ask for more --cells", significant(tolerance, 3)))
}

fn outlet(model: &MeshedMachine, state: &SteadyState, s: usize) -> Celsius {
    Kelvin(state.solution.temperatures[model.network.streams[s].outlet() as usize]).into()
}

fn text(model: &MeshedMachine, state: &SteadyState, mesh: Option<&MeshErrors>, contacts: &[ContactFlow], seconds: f64) -> String {
    let solution = &state.solution;
    let mut text = format!("{}\n\n", model.machine.name);
    let shown = model.shown(state);
    let row = |s: usize, name: &String, reading: f64| -> Vec<String> {
        let known = model.chosen.as_ref().map(|chosen| chosen.sensors[s]);
        let open = known.or(mesh.map(|mesh| Some(mesh.errors[s]))).map(|open| open.map_or_else(String::new, |e| format!("{e:.3}")));
        let reads = shown.iter().find(|(n, _)| n == name).map(|(_, shown)| format!("reads {shown:.3}"));
        [Some(name.clone()), Some(format!("{reading:.3}")), open, reads].into_iter().flatten().collect()
    };
    let has_open = mesh.is_some() || model.chosen.is_some();
    let readings = model.readings(state);
    let mut blocks = Vec::new();
    for (measurand, what) in [(Measurand::Temperature, "sensor"), (Measurand::Displacement, "displacement")] {
        let own = model.network.measurands.iter().zip(&model.network.sensor_names).enumerate().filter(|(_, (own, _))| **own == measurand);
        let rows: Vec<Vec<String>> = own.map(|(s, (_, name))| row(s, name, readings[s])).collect();
        let open = format!("mesh {}", measurand.unit_of_differences());
        let header = [Some(what), Some(measurand.unit()), has_open.then_some(open.as_str()), (!shown.is_empty()).then_some("")];
        if !rows.is_empty() || measurand == Measurand::Temperature {
            blocks.push(table(&header.into_iter().flatten().collect::<Vec<_>>(), &rows));
        }
    }
    text += &blocks.join("\n");
    let row = |(meter, heat): (&HeatMeter, f64)| vec![meter.name.clone(), format!("{heat:+.3}")];
    let flows: Vec<Vec<String>> = model.network.meters.iter().zip(model.heat_flows(state)).map(row).collect();
    if !flows.is_empty() {
        text += "\n";
        text += &table(&["heat flow", "W"], &flows);
    }
    let limits = model.limits(state);
    let has_lengths = limits.iter().any(|l| l.measurand != Measurand::Temperature);
    let limits: Vec<Vec<String>> = (limits.iter())
        .map(|l| {
            let shown = |x: f64| format!("{:.3} {}", l.shown(x), l.unit());
            let verdict = if l.margin() >= 0.0 { "kept" } else { "broken" };
            let unit = if has_lengths { format!(" {}", l.measurand.unit_of_differences()) } else { String::new() };
            let margin = format!("{:+.3}{unit}", l.margin());
            vec![l.name.clone(), shown(l.value), shown(l.maximum), margin, verdict.into()]
        })
        .collect();
    if !limits.is_empty() {
        text += "\n";
        text += &table(&["limit", "value", "at most", if has_lengths { "margin" } else { "margin K" }, ""], &limits);
    }
    if !model.network.streams.is_empty() {
        let notes = model.network.coolant_notes(&solution.streams, &solution.temperatures);
        let rows: Vec<Vec<String>> = (model.network.streams.iter().zip(&solution.streams).enumerate())
            .map(|(s, (stream, at))| {
                vec![
                    stream.name.clone(),
                    format!("{:.3}", outlet(model, state, s).0),
                    format!("{:.3}", at.flow * 6e4),
                    format!("{:.0}", at.reynolds),
                    format!("{:.0}", at.film),
                    format!("{:.0}", at.pressure_drop),
                    notes[s].clone().unwrap_or_default(),
                ]
            })
            .collect();
        text += "\n";
        text += &table(&["channel", "outlet degC", "L/min", "Re", "h W/(m2 K)", "drop Pa", ""], &rows);
    }
    if !contacts.is_empty() {
        let rows: Vec<Vec<String>> = contacts
            .iter()
            .map(|c| {
                let conductance = if c.conductance.is_finite() { significant(c.conductance, 4) } else { "bonded".into() };
                vec![c.name.clone(), significant(c.area, 4), conductance, format!("{:.3}", c.heat), format!("{:.3}", c.drop)]
            })
            .collect();
        text += "\n";
        text += &table(&["contact", "area m2", "hA W/K", "heat W", "drop K"], &rows);
    }
    let rows: Vec<Vec<String>> = (model.machine.boundaries.iter().zip(&model.network.acting).zip(&solution.balance.boundaries))
        .map(|((b, area), heat)| vec![b.name.clone(), significant(area.acting, 4), format!("{heat:+.3}")])
        .collect();
    if !rows.is_empty() {
        text += "\n";
        text += &table(&["boundary", "acts on m2", "brings W"], &rows);
    }
    for (e, heats) in model.network.enclosures.iter().zip(enclosure_heats(&model.network, &solution.temperatures)) {
        let to_chamber = ("chamber".to_string(), -heats.iter().sum::<f64>());
        let rows = e.surfaces.iter().cloned().zip(heats.iter().copied()).chain([to_chamber]);
        let rows: Vec<Vec<String>> = rows.map(|(name, heat)| vec![name, format!("{heat:+.3}")]).collect();
        text += "\n";
        text += &table(&[&format!("enclosure {}", e.name), "gives off W"], &rows);
    }
    let balance = &solution.balance;
    text += &format!(
        "\nheat in {:.4} W, out {:.4} W, open {:.1e}; radiation {:+.3} W, gas {:+.3} W, coolant {:+.3} W (positive is into the machine)\n",
        balance.in_watts,
        balance.out_watts,
        balance.relative,
        balance.radiation,
        balance.gas,
        balance.circuits.iter().sum::<f64>()
    );
    for note in model.boundary_notes(state) {
        text += &format!("note: {note}\n");
    }
    if let Some(chosen) = &model.chosen {
        let (asked, cells) = (significant(chosen.accuracy, 3), model.mesh.cells);
        text += &stated_cells(model, chosen).map(|note| format!("note: {note}\n")).collect::<String>();
        text += &format!("{cells} cells, chosen to leave less than {asked} K open; estimates from {} cells\n", chosen.checked_on);
    }
    text += &format!(
        "{} unknowns, {} Newton steps, {} Krylov iterations, {:.2} s\n",
        model.network.nodes, solution.newton_iterations, solution.krylov_iterations, seconds
    );
    text
}
