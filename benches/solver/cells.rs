//! Cells chosen for an accuracy beside as many cells of one size: how many there are, and how far they are off.

use std::path::Path;
use std::time::Instant;

use coldplate_base::progress::Silent;
use coldplate_describe::machine::{Condition, Machine};
use coldplate_network::mesh::Mesh;
use coldplate_solve::meshed::MeshedMachine;

use crate::plot;

const MACHINES: [&str; 6] = ["rig", "spindle", "five_axis", "column", "enclosure", "slab"];
const ACCURACIES: [f64; 3] = [0.2, 0.1, 0.05];
/// Cells of one size, coarse to fine.
const UNIFORM: [usize; 9] = [150, 300, 700, 1500, 4000, 10_000, 30_000, 80_000, 200_000];
/// Cells of the mesh that stands for the truth, at least, and along every line of the finest one that was chosen.
const TRUTH: f64 = 5e5;
const FINER: f64 = 3.0;

/// One mesh: its cells and the largest error of a reading there, K.
type Point = (f64, f64);

pub fn run(images: &Path) {
    println!("| machine | accuracy K | cells | largest error K | estimate K | cells of one size | ratio | choosing s |");
    println!("|---|---:|---:|---:|---:|---:|---:|---:|");
    let mut series: Vec<plot::Series> = Vec::new();
    for name in MACHINES {
        let (chosen, uniform) = of(name);
        if matches!(name, "five_axis" | "rig" | "spindle") {
            series.push((format!("{name}, cells of one size"), uniform));
            series.push((format!("{name}, chosen"), chosen));
        }
    }
    let title = "Largest error of a reading by the number of cells";
    plot::draw(&images.join("cells.svg"), title, ["cells", "error, K"], &series, (-2.0 / 3.0, "second order"));
}

fn of(name: &str) -> (Vec<Point>, Vec<Point>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("machines/{name}.toml"));
    let machine = Machine::read(path, &[]).unwrap_or_else(|e| panic!("{e}"));
    let usual =
        [("coolant_flow", "6 L/min"), ("coolant_temperature", "20 degC"), ("motor_speed", "1000 rpm"), ("ambient_temperature", "22 degC")];
    let given: Vec<(&str, &str)> = usual.into_iter().filter(|(name, _)| machine.variables.iter().any(|v| v.name == *name)).collect();
    let condition = machine.condition(&given).unwrap_or_else(|e| panic!("{e}"));
    let chosen: Vec<(MeshedMachine, f64)> = ACCURACIES
        .iter()
        .map(|accuracy| {
            let clock = Instant::now();
            let model = MeshedMachine::within(machine.clone(), *accuracy, std::slice::from_ref(&condition), &Silent);
            (model.unwrap_or_else(|e| panic!("{name}: {e}")), clock.elapsed().as_secs_f64())
        })
        .collect();
    let finest = &chosen[ACCURACIES.len() - 1].0.mesh;
    let along = FINER.max((TRUTH / finest.cells as f64).cbrt());
    let finer: Vec<[usize; 3]> = finest.divisions().into_iter().map(|n| n.map(|n| (along * n as f64) as usize)).collect();
    let truth = readings(&machine, &condition, Mesh::with_divisions(&machine, &finer, 1.0));
    let is_temperature: Vec<bool> = chosen[0].0.chosen.iter().flat_map(|c| c.sensors.iter().map(Option::is_some)).collect();
    let error = |own: &[f64]| -> f64 {
        let apart = own.iter().zip(&truth.1).zip(&is_temperature).filter(|(_, wanted)| **wanted).map(|((a, b), _)| (a - b).abs());
        apart.fold(0.0, f64::max)
    };
    let uniform: Vec<Point> = UNIFORM
        .iter()
        .map(|cells| {
            let (cells, own) = readings(&machine, &condition, Mesh::with_cells(&machine, *cells));
            (cells, error(&own))
        })
        .collect();
    let mut points = Vec::new();
    for (accuracy, (model, seconds)) in ACCURACIES.iter().zip(&chosen) {
        let (cells, own) = readings(&machine, &condition, Ok(model.mesh.clone()));
        let off = error(&own);
        let estimate = model.chosen.iter().flat_map(|c| c.sensors.iter().flatten()).fold(0.0f64, |m, e| m.max(*e));
        // From there on every mesh is as good.
        let needed = uniform.iter().rposition(|(_, e)| *e > off).map_or(uniform.first(), |last| uniform.get(last + 1));
        let (needed, ratio) =
            needed.map_or(("more than 200000".into(), String::new()), |(n, _)| (format!("{n:.0}"), format!("{:.1}", n / cells)));
        println!("| {name} | {accuracy} | {cells:.0} | {off:.4} | {estimate:.4} | {needed} | {ratio} | {seconds:.1} |");
        points.push((cells, off));
    }
    (points, uniform)
}

/// Cells of a mesh and the readings on it, degC and um.
fn readings(machine: &Machine, condition: &Condition, mesh: coldplate::Result<Mesh>) -> (f64, Vec<f64>) {
    let model = mesh.and_then(|mesh| MeshedMachine::on(machine.clone(), mesh)).unwrap_or_else(|e| panic!("{e}"));
    let state = model.steady(condition).unwrap_or_else(|e| panic!("{e}"));
    (model.mesh.cells as f64, model.readings(&state))
}
