//! What the full solver costs on this machine.
//!
//!     cargo bench --bench solver                         all of the below, the machine's default sizes
//!     cargo bench --bench solver -- cost [CELLS ...]     one steady state of the five-axis machine from file to temperatures
//!     cargo bench --bench solver -- linear [N] [DIR]     one linear system of N^3 unknowns to 1e-8; its matrix goes to DIR
//!     cargo bench --bench solver -- sweep [CELLS [CPR]]  further conditions beside the first, from a reduced model with its field too
//!     cargo bench --bench solver -- cells                cells chosen for an accuracy beside cells of one size: docs/images/cells.svg
//!
//!     cargo test --release -p coldplate-solve --test it order:: -- --nocapture | cargo bench --bench solver -- convergence
//!                                                        the errors those tests print, as docs/images/convergence.svg
//!
//! `compare.py` beside this file solves the exported matrix with other programs and prints both.

mod cells;
mod linear;
mod plot;

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use coldplate_describe::machine::{Condition, Machine};
use coldplate_network::Load;
use coldplate_network::mesh::Mesh;
use coldplate_reduce::ReducedModel;
use coldplate_solve::Solver;
use coldplate_solve::meshed::MeshedMachine;

const MACHINE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/machines/five_axis.toml");
const IMAGES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/images");
const SIZES: [usize; 8] = [10_000, 30_000, 100_000, 300_000, 1_000_000, 3_000_000, 5_000_000, 10_000_000];

fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let number = |i: usize| args.get(i).and_then(|a| a.parse::<usize>().ok());
    match args.first().map(String::as_str) {
        Some("cost") => cost(&args[1..].iter().filter_map(|a| a.parse().ok()).collect::<Vec<_>>()),
        Some("linear") => linear::run(number(1).unwrap_or(171), args.get(2).map(Path::new)),
        Some("convergence") => convergence(),
        Some("cells") => cells::run(Path::new(IMAGES)),
        Some("sweep") => sweep(number(1).unwrap_or(1_000_000), args.get(2).map(Path::new)),
        _ => {
            println!("memory bandwidth (triad, all cores): {:.1} GB/s\n", triad());
            cost(&[]);
            println!();
            sweep(1_000_000, None);
            println!();
            linear::run(171, None);
        }
    }
}

fn condition(machine: &Machine, flow: &str, speed: &str) -> Condition {
    let given =
        [("coolant_flow", flow), ("coolant_temperature", "20.5 degC"), ("motor_speed", speed), ("ambient_temperature", "23.5 degC")];
    machine.condition(&given).unwrap_or_else(|e| panic!("{e}"))
}

/// The cost of one steady state, everything included, by size.
fn cost(sizes: &[usize]) {
    let machine = Machine::read(Path::new(MACHINE), &[]).unwrap_or_else(|e| panic!("{e}"));
    println!(
        "| unknowns | mesh, network s | hierarchy s | coefficients s | linear solves s | total s | us per unknown | Newton | Krylov | peak MB |"
    );
    println!("|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|");
    let mut points: Vec<(f64, f64)> = Vec::new();
    let mut parts: Vec<(f64, [f64; 5])> = Vec::new();
    for cells in if sizes.is_empty() { &SIZES } else { sizes } {
        let clock = Instant::now();
        let mesh = Mesh::with_cells(&machine, *cells).unwrap_or_else(|e| panic!("{e}"));
        let model = MeshedMachine::on(machine.clone(), mesh).unwrap_or_else(|e| panic!("{e}"));
        let built = clock.elapsed().as_secs_f64();
        let condition = condition(&machine, "9.42 L/min", "2500 rpm");
        let solver = model.solver(&condition).unwrap_or_else(|e| panic!("{e}"));
        let total = clock.elapsed().as_secs_f64();
        let s = model.solve(&solver, &condition).unwrap_or_else(|e| panic!("{e}")).solution;
        let hierarchy = total - built - s.assemble_seconds - s.solve_seconds;
        println!(
            "| {} | {built:.2} | {hierarchy:.2} | {:.2} | {:.2} | {total:.2} | {:.2} | {} | {} | {:.0} |",
            model.network.nodes,
            s.assemble_seconds,
            s.solve_seconds,
            total / model.network.nodes as f64 * 1e6,
            s.newton_iterations,
            s.krylov_iterations,
            linear::peak_megabytes()
        );
        points.push(((model.network.nodes as f64).ln(), total.ln()));
        parts.push((model.network.nodes as f64, [total, s.solve_seconds, s.assemble_seconds, built, hierarchy]));
    }
    if points.len() > 1 {
        let names = ["everything", "linear solves", "coefficients", "mesh and network", "hierarchy"];
        let of = |(k, name): (usize, &&str)| (name.to_string(), parts.iter().map(|(n, seconds)| (*n, seconds[k])).collect());
        let series: Vec<plot::Series> = names.iter().enumerate().map(of).collect();
        let title = "One steady state of the five-axis machine, two cores";
        plot::draw(&Path::new(IMAGES).join("cost.svg"), title, ["unknowns", "seconds"], &series, (1.0, "proportional to the unknowns"));
        let n = points.len() as f64;
        let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
        let slope = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>() / points.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>();
        println!("\ncost grows as N^{slope:.2}");
    }
}

/// Errors in the L2 norm by size of the cells, from the lines `NAME: cells 1/N: L2 ERROR K` on standard input.
fn convergence() {
    let mut series: Vec<plot::Series> = Vec::new();
    for line in std::io::stdin().lines().map_while(Result::ok) {
        let Some((name, rest)) = line.split_once(": cells 1/") else { continue };
        let Some((cells, rest)) = rest.split_once(": L2 ") else { continue };
        let (Ok(cells), Some(Ok(error))) = (cells.parse::<f64>(), rest.split(' ').next().map(str::parse)) else { continue };
        match series.iter_mut().find(|(known, _)| known == name) {
            Some((_, points)) => points.push((1.0 / cells, error)),
            None => series.push((name.to_string(), vec![(1.0 / cells, error)])),
        }
    }
    let title = "Error against manufactured solutions, L2 norm";
    let axes = ["size of the cells, of the coarsest", "error, K"];
    plot::draw(&Path::new(IMAGES).join("convergence.svg"), title, axes, &series, (2.0, "second order"));
}

/// Further conditions on one hierarchy, beside the first with everything it sets up: from the reference state, from a reduced model of
/// the same mesh in a file, and from a dozen known states.
fn sweep(cells: usize, reduced: Option<&Path>) {
    let machine = Machine::read(Path::new(MACHINE), &[]).unwrap_or_else(|e| panic!("{e}"));
    let clock = Instant::now();
    let mesh = Mesh::with_cells(&machine, cells).unwrap_or_else(|e| panic!("{e}"));
    let model = MeshedMachine::on(machine.clone(), mesh).unwrap_or_else(|e| panic!("{e}"));
    let network = &model.network;
    let at = |flow: &str, speed: &str| Load::at(&machine, &condition(&machine, flow, speed)).unwrap_or_else(|e| panic!("{e}"));
    let mut solver = model.solver(&condition(&machine, "9.42 L/min", "2500 rpm")).unwrap_or_else(|e| panic!("{e}"));
    let first = clock.elapsed().as_secs_f64();
    println!("first condition, {} unknowns: {first:.2} s", network.nodes);
    let reduced = reduced.map(|file| {
        let bytes = std::fs::read(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        ReducedModel::from_bytes(&bytes).unwrap_or_else(|e| panic!("{e}"))
    });
    let further = |solver: &Solver<'_>, (flow, speed): (&str, &str), model: Option<&ReducedModel>| {
        let clock = Instant::now();
        let load = at(flow, speed);
        let start = model.map(|model| {
            let condition = condition(&machine, flow, speed);
            let answer = model.steady(&condition, &[]).unwrap_or_else(|e| panic!("{e}"));
            let start = model.temperatures(&answer, &condition, network).unwrap_or_else(|e| panic!("{e}"));
            (start, model.field.as_ref().map_or(f64::INFINITY, |field| field.largest_error))
        });
        let from = |(start, error): (Vec<f64>, f64)| solver.steady_from(&load, &start, error);
        let s = start.map_or_else(|| solver.steady(&load), from).unwrap_or_else(|e| panic!("{e}"));
        let seconds = clock.elapsed().as_secs_f64();
        let share = seconds / first;
        println!(
            "{flow}, {speed}: {seconds:.2} s, {share:.2} of the first ({} Newton, {} Krylov; start {:.2} s, matrices {:.2} s, linear {:.2} s)",
            s.newton_iterations,
            s.krylov_iterations,
            seconds - s.assemble_seconds - s.solve_seconds,
            s.assemble_seconds,
            s.solve_seconds
        );
    };
    let others =
        [("9.42 L/min", "2400 rpm"), ("9 L/min", "2500 rpm"), ("4 L/min", "1000 rpm"), ("18 L/min", "250 rpm"), ("6 L/min", "1700 rpm")];
    for other in others {
        further(&solver, other, None);
    }
    if let Some(model) = &reduced {
        println!("from a reduced model:");
        others.iter().for_each(|other| further(&solver, *other, Some(model)));
    }
    let flows = ["2.355 L/min", "3.5 L/min", "5.5 L/min", "8.5 L/min", "13 L/min", "18.84 L/min"];
    let speeds = ["250 rpm", "2500 rpm", "1400 rpm"];
    let known: Vec<Load> = flows.iter().enumerate().flat_map(|(i, f)| [at(f, speeds[i % 3]), at(f, speeds[(i + 1) % 3])]).collect();
    let clock = Instant::now();
    solver.learn(&known);
    println!("{} conditions to start from: {:.2} s", known.len(), clock.elapsed().as_secs_f64());
    for other in others {
        further(&solver, other, None);
    }
}

/// Memory bandwidth: a = b + s c over vectors larger than any cache, GB/s.
fn triad() -> f64 {
    use rayon::prelude::*;
    let n = 40_000_000;
    let (mut a, b, c) = (vec![0.0f64; n], vec![1.0f64; n], vec![2.0f64; n]);
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let clock = Instant::now();
        a.par_chunks_mut(65_536).zip(b.par_chunks(65_536)).zip(c.par_chunks(65_536)).for_each(|((a, b), c)| {
            a.iter_mut().zip(b).zip(c).for_each(|((a, b), c)| *a = b + 3.0 * c);
        });
        best = best.min(clock.elapsed().as_secs_f64());
    }
    black_box(&a);
    24.0 * n as f64 / best / 1e9
}
