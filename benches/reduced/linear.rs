//! A linear problem of conduction: three blocks of other materials, a film on the bottom, on the top and on one side, heat in the
//! uppermost. Films and heat are varied. What a Galerkin method needs of it goes to files, beside what our reduced model answers.

use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Instant;

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_network::{Load, Network};
use coldplate_reduce::{ReduceSettings, ReducedModel, reduce};
use coldplate_solve::study::Study;
use coldplate_solve::{Solver, System};
use serde_json::json;

/// The varied: name, lowest and highest value, SI.
const VARIED: [(&str, f64, f64); 4] =
    [("film_bottom", 50.0, 2000.0), ("film_top", 5.0, 200.0), ("film_side", 5.0, 500.0), ("heat", 10.0, 200.0)];
const FILMS: usize = 3;
/// Of the fluid behind all films, degC.
const FLUID: f64 = 20.0;
/// Conditions that it is judged at.
const JUDGED: usize = 200;
const ACCURACY: f64 = 1e-3;
/// Times that every one of them is answered where an answer's time is measured.
const REPEATS: usize = 5;
/// Sizes, m, and materials: conductivity, W/(m K), of the lowest, the middle and the uppermost.
const SIDE: f64 = 0.1;
const HEIGHT: f64 = 0.04;
const CONDUCTIVITY: [f64; 3] = [167.0, 16.3, 50.0];

fn text(cells: usize) -> String {
    // Cells of three blocks, as high as they are wide.
    let size = (SIDE * SIDE * 3.0 * HEIGHT / cells as f64).cbrt();
    let (n, layers) = ((SIDE / size).round() as usize, (HEIGHT / size).round() as usize);
    let mut text = "name = \"Three blocks\"\n[variables]\n".to_string();
    for (name, low, high) in &VARIED {
        let unit = if *name == "heat" { "W" } else { "W/(m2 K)" };
        let range = format!("range = [\"{low} {unit}\", \"{high} {unit}\"], default = \"{high} {unit}\"");
        text += &format!("{name} = {{ unit = \"{unit}\", {range} }}\n");
    }
    for (i, (name, conductivity)) in ["lower", "middle", "upper"].iter().zip(CONDUCTIVITY).enumerate() {
        text += &format!(
            "[material.{name}]\nconductivity = \"{conductivity} W/(m K)\"\ndensity = \"7900 kg/m3\"\nspecific_heat = \"500 J/(kg K)\"\n\
             [part.{name}]\nmaterial = \"{name}\"\nbox = [\"{SIDE} m\", \"{SIDE} m\", \"{HEIGHT} m\"]\nat = [\"0 m\", \"0 m\", \"{} m\"]\n\
             cells = [{n}, {n}, {layers}]\n[sensor.{name}]\nin = \"{name}\"\npoint = [\"0.03 m\", \"0.07 m\", \"0.02 m\"]\n",
            i as f64 * HEIGHT
        );
    }
    for (name, pair) in [("low", "[\"lower\", \"middle\"]"), ("high", "[\"middle\", \"upper\"]")] {
        text += &format!("[contact.{name}]\nbetween = {pair}\nbonded = true\n");
    }
    for (name, faces) in [("bottom", "\"lower.-z\""), ("top", "\"upper.+z\""), ("side", "\"lower.+x\", \"middle.+x\", \"upper.+x\"")] {
        text += &format!("[boundary.{name}]\nfaces = [{faces}]\nfilm = \"film_{name}_W_m2_K\"\nfluid_temperature = \"{FLUID} degC\"\n");
    }
    text + "[source.heat]\nin = [\"upper\"]\npower = \"heat_W\"\n"
}

/// Writes the problem and what we answer to `folder`.
pub fn run(folder: &Path, cells: usize) {
    let document = Document::parse(&text(cells), "blocks.toml").unwrap_or_else(|e| panic!("{e}"));
    let study = Study::new(document, None).unwrap_or_else(|e| panic!("{e}"));
    let (machine, network) = (&study.model.machine, &study.model.network);
    let ranges: Vec<(f64, f64)> =
        machine.variables.iter().map(|v| v.range.or(v.default.map(|d| (d, d))).unwrap_or((295.0, 295.0))).collect();
    let places: Vec<usize> = VARIED
        .iter()
        .map(|(name, ..)| machine.variables.iter().position(|v| v.name == *name).unwrap_or_else(|| panic!("no '{name}'")))
        .collect();
    let condition = |values: &[f64]| {
        let mut si: Vec<f64> = ranges.iter().map(|(low, high)| 0.5 * (low + high)).collect();
        places.iter().zip(values).for_each(|(place, value)| si[*place] = *value);
        Condition::from_si(si)
    };
    let load = |values: &[f64]| Load::at(machine, &condition(values)).unwrap_or_else(|e| panic!("{e}"));
    std::fs::create_dir_all(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let lowest: Vec<f64> = VARIED.iter().map(|(_, low, _)| *low).collect();
    export(folder, network, &load, &lowest);

    let clock = Instant::now();
    let settings = ReduceSettings {
        accuracy: ACCURACY,
        ranges: ranges.clone(),
        with_parameters: false,
        most: 400,
        histories: 0,
        with_field: false,
        seed: 1,
    };
    let model = reduce(&study, &settings, &Silent).unwrap_or_else(|e| panic!("{e}"));
    let offline = clock.elapsed().as_secs_f64();
    let mut random = Random::new(2026);
    let judged: Vec<Vec<f64>> =
        (0..JUDGED).map(|_| VARIED.iter().map(|(_, low, high)| low + random.unit() * (high - low)).collect()).collect();
    let solver = Solver::new(network, &load(&lowest)).unwrap_or_else(|e| panic!("{e}"));
    let clock = Instant::now();
    let truth: Vec<Vec<f64>> = judged
        .iter()
        .map(|values| {
            let load = load(values);
            let state = solver.steady(&load).unwrap_or_else(|e| panic!("{e}"));
            network.sensors.iter().map(|s| s.read(&state.temperatures, &load)).collect()
        })
        .collect();
    let full = clock.elapsed().as_secs_f64() / JUDGED as f64;
    let answer = |model: &ReducedModel, values: &[f64]| model.steady(&condition(values), &[]).unwrap_or_else(|e| panic!("{e}"));
    let clock = Instant::now();
    (0..REPEATS).for_each(|_| judged.iter().for_each(|values| drop(answer(&model, values))));
    let online = clock.elapsed().as_secs_f64() / (REPEATS * JUDGED) as f64;
    let (mut error, mut bound): (f64, f64) = (0.0, 0.0);
    let mut outside = 0;
    for (values, truth) in judged.iter().zip(&truth) {
        let found = answer(&model, values);
        for ((t, r), b) in truth.iter().zip(&found.readings).zip(&found.bounds) {
            (error, bound) = (error.max((t - r).abs()), bound.max(*b));
            outside += usize::from((t - r).abs() > *b);
        }
    }
    let half = |k: f64, width: f64| 0.5 * width / k;
    let layers = network_layers(cells);
    let record = json!({
        "nodes": network.nodes,
        "varied": VARIED.map(|(name, low, high)| json!({ "name": name, "low": low, "high": high })),
        "fluid_K": FLUID + 273.15,
        "accuracy_K": ACCURACY,
        // Between the middle of a cell and the face of its film, m2 K/W; the side has the cells of all three.
        "resistances": [vec![half(CONDUCTIVITY[0], layers.1)], vec![half(CONDUCTIVITY[2], layers.1)], CONDUCTIVITY.map(|k| half(k, layers.0)).to_vec()],
        "sensors": network.sensors.iter().map(|s| s.weights.clone()).collect::<Vec<_>>(),
        "judged": judged,
        "truth": truth,
        "full_seconds": full,
        "ours": {
            "modes": model.coarse.len(), "modes_of_the_bound": model.fine.len(), "solved": model.made.solved, "checks": model.made.checks,
            "offline_seconds": offline, "online_seconds": online, "largest_error_K": error, "largest_bound_K": bound, "outside": outside,
        },
    });
    std::fs::write(folder.join("problem.json"), record.to_string()).unwrap_or_else(|e| panic!("{e}"));
    println!(
        "{} unknowns: {} modes of {} solves, offline {offline:.1} s, online {:.2} ms, a full solve {:.1} ms; at {JUDGED} conditions error \
         {error:.1e} K, bound {bound:.1e} K, {outside} readings outside\nwrote the problem to {}",
        network.nodes,
        model.coarse.len(),
        model.made.solved,
        online * 1e3,
        full * 1e3,
        folder.display()
    );
}

/// Width and height of the cells, m.
fn network_layers(cells: usize) -> (f64, f64) {
    let size = (SIDE * SIDE * 3.0 * HEIGHT / cells as f64).cbrt();
    (SIDE / (SIDE / size).round(), HEIGHT / (HEIGHT / size).round())
}

/// Conductances between nodes, those of the films at the lowest films and with one of them at its highest, and the heat of a watt.
fn export(folder: &Path, network: &Network, load: &dyn Fn(&[f64]) -> Load, lowest: &[f64]) {
    let system = System::new(network);
    let temperatures = vec![FLUID + 273.15; network.nodes];
    let file = |name: &str| BufWriter::new(std::fs::File::create(folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}")));
    let numbers = |name: &str, values: &[f64]| {
        let mut out = file(name);
        values.iter().for_each(|v| out.write_all(&v.to_le_bytes()).unwrap_or_else(|e| panic!("{name}: {e}")));
    };
    let matrix = system.symmetric(network, &load(lowest), &[], &temperatures);
    let (mut pairs, mut values) = (Vec::new(), Vec::new());
    for (block, profile) in matrix.blocks.iter().zip(&matrix.profiles) {
        for segment in block.segments(block.nodes()) {
            segment.each_face(block.cells[0], |at, d, other, is_next, owner| {
                if is_next {
                    let g = if d == 0 { profile[0][owner + 1] } else { profile[d][owner] };
                    pairs.push([(segment.node + at) as f64, other as f64]);
                    values.push(g);
                }
            });
        }
    }
    for (a, b, g) in &matrix.couplings {
        pairs.push([f64::from(*a), f64::from(*b)]);
        values.push(*g);
    }
    numbers("pairs.f64", pairs.as_flattened());
    numbers("conductances.f64", &values);
    numbers("films.f64", &matrix.to_given);
    for film in 0..FILMS {
        let mut raised = lowest.to_vec();
        raised[film] = VARIED[film].2;
        numbers(&format!("film_{film}.f64"), &system.symmetric(network, &load(&raised), &[], &temperatures).to_given);
    }
    // At the temperature of the fluid nothing leaves: what is left is the heat.
    let right: Vec<f64> = system.residual(network, &load(lowest), &[], &temperatures).iter().map(|r| -r / lowest[FILMS]).collect();
    numbers("heat.f64", &right);
}
