//! `coldplate solve`: steady temperatures at one condition.

mod reduced;
mod text;

use std::path::PathBuf;
use std::time::Instant;

use serde::Serialize;

use super::condition::ConditionArgs;
use super::hottest::{HottestPlace, hottest, hottest_text};
use super::mesh_options::MeshArgs;
use super::output::Output;
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::significant;
use coldplate_base::progress::Progress;
use coldplate_base::units::{self, Dimension, Measurand, express};
use coldplate_describe::machine::{Condition, Machine};
use coldplate_jobs::{FileKind, OpenFile, open};
use coldplate_network::mesh::vtu;
use coldplate_solve::meshed::{MeshErrors, MeshRecord, MeshedMachine, SteadyState};

/// Steady temperatures at one condition
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Machine file, or a reduced model of one
    machine: PathBuf,
    #[command(flatten)]
    condition: ConditionArgs,
    #[command(flatten)]
    mesh: MeshArgs,
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

/// A solution, and the hottest places of the parts if asked for.
#[derive(Serialize)]
struct WithPlaces<R> {
    #[serde(flatten)]
    record: R,
    #[serde(skip_serializing_if = "Option::is_none")]
    hottest: Option<Vec<HottestPlace>>,
}

/// Runs the command.
///
/// # Errors
/// Bad input, or numerics that failed.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let start = Instant::now();
    let file = open(&args.machine).map_err(|e| e.help("check the path"))?;
    if file.kind == FileKind::ReducedModel {
        args.mesh.refuse(&file, &[])?;
        return reduced::run(&file, args, out);
    }
    of_machine(&file, args, start, out)
}

/// Solves a machine in full.
fn of_machine(file: &OpenFile, args: &Args, start: Instant, out: Output) -> Result<u8> {
    let sets = args.mesh.sets()?;
    let tolerance = units::parse(&args.mesh_tolerance, Dimension::DIFFERENCE).map_err(|e| e.at_key("--mesh-tolerance"))?;
    if tolerance.is_nan() || tolerance <= 0.0 {
        let error = Error::input("a tolerance must be positive").at_key("--mesh-tolerance").read(&args.mesh_tolerance);
        return Err(error.help("write for example --mesh-tolerance \"0.1 K\""));
    }
    let machine = file.machine(&sets)?;
    let condition = args.condition.condition(&machine)?;
    range_notes(&machine, &condition, out);
    let progress = out.progress();
    progress.at("meshing");
    let model = MeshedMachine::for_conditions(machine, args.mesh.cells, |_| Ok(vec![condition.clone()]), &progress)?;
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
    let mut record = model.record(&state);
    record.seconds.total = seconds;
    record.mesh = mesh.as_ref().map(|mesh| MeshRecord::of(&model, mesh, tolerance));
    let places = args.hottest.then(|| hottest(&model.machine, &model.mesh, &state.solution.temperatures));
    let text = text::text(&model, &state, mesh.as_ref(), seconds) + &places.as_deref().map_or_else(String::new, hottest_text);
    out.report(&text, &WithPlaces { record, hottest: places });
    Ok(0)
}

/// Notes on variables outside the ranges of the machine file.
fn range_notes(machine: &Machine, condition: &Condition, out: Output) {
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
