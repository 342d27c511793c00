//! The same structures, meshes and nodal temperatures in CalculiX: bricks with incompatible modes (C3D8I), parts tied.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use coldplate_describe::machine::{Face, Machine, SensorReading, Side};
use coldplate_solve::meshed::MeshedMachine;

use crate::displacement::{POST, folder};

/// Faces of a C3D8I in the order of [`Side::ALL`].
const FACES: [&str; 6] = ["S6", "S4", "S3", "S5", "S1", "S2"];

/// A deck of the parts with these names, whose blocks are boxes, at the temperatures of cells (K); also the node nearest to each
/// displacement's point.
fn deck(model: &MeshedMachine, parts: &[&str], temperatures: &[f64]) -> (String, Vec<usize>) {
    let (machine, mesh) = (&model.machine, &model.mesh);
    let (mut nodes, mut elements, mut heat, mut more) = (String::from("*NODE\n"), String::new(), String::new(), String::new());
    let (mut count, mut element) = (0, 0);
    let mut places: Vec<(usize, [f64; 3])> = Vec::new();
    let mut elements_of: HashMap<usize, usize> = HashMap::new();
    let mut fixed = String::new();
    let taking_part = |g: usize| parts.contains(&machine.parts[mesh.grids[g].part].name.as_str());
    for (g, grid) in mesh.grids.iter().enumerate().filter(|(g, _)| taking_part(*g)) {
        let n = [0, 1, 2].map(|d| grid.n(d) + 1);
        let node = |at: [usize; 3]| count + 1 + at[0] + n[0] * (at[1] + n[1] * at[2]);
        for at in (0..n[0] * n[1] * n[2]).map(|i| [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])]) {
            let point = grid.to_machine([0, 1, 2].map(|d| grid.edges[d][at[d]]));
            let warmth: f64 = grid.interpolate(point).into_iter().map(|(cell, w)| w * temperatures[cell]).sum();
            let _ = writeln!(nodes, "{}, {:.12e}, {:.12e}, {:.12e}", node(at), point[0], point[1], point[2]);
            let _ = writeln!(heat, "{}, {:.12e}", node(at), warmth - 273.15);
            places.push((grid.part, point));
            for side in Side::ALL {
                let on_side = at[side.axis()] == if side.is_high() { n[side.axis()] - 1 } else { 0 };
                let holds = machine.elasticity.held(Face { part: grid.part, block: Some(grid.block), side });
                for d in (0..3).filter(|d| on_side && holds[*d]) {
                    let _ = writeln!(fixed, "{}, {}, {}", node(at), d + 1, d + 1);
                }
            }
        }
        let _ = writeln!(elements, "*ELEMENT, TYPE=C3D8I, ELSET=E{g}");
        for c in grid.cells() {
            element += 1;
            elements_of.insert(grid.cell(c), element);
            let corner = |i: usize, j: usize, k: usize| node([c[0] + i, c[1] + j, c[2] + k]);
            let own = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
            let list: Vec<String> = own.iter().map(|[i, j, k]| corner(*i, *j, *k).to_string()).collect();
            let _ = writeln!(elements, "{element}, {}", list.join(", "));
        }
        let elastic = &machine.materials[machine.parts[grid.part].material].elastic;
        let (modulus, poisson, expansion) = (elastic.modulus.unwrap(), elastic.poisson.unwrap(), elastic.expansion.unwrap());
        let _ = writeln!(
            more,
            "*MATERIAL, NAME=M{g}\n*ELASTIC\n{modulus:e}, {poisson}\n*EXPANSION, ZERO={}\n{expansion:e}\n*SOLID SECTION, ELSET=E{g}, MATERIAL=M{g}",
            machine.elasticity.reference - 273.15
        );
        count += n[0] * n[1] * n[2];
    }
    for (i, interface) in mesh.interfaces.iter().enumerate().filter(|(_, i)| taking_part(i.a.0) && taking_part(i.b.0)) {
        let mut surface = |name: &str, side: Side, cells: Vec<usize>| {
            let mut cells: Vec<usize> = cells.iter().map(|cell| elements_of[cell]).collect();
            cells.sort_unstable();
            cells.dedup();
            let _ = writeln!(more, "*SURFACE, NAME={name}{i}");
            cells.iter().for_each(|cell| _ = writeln!(more, "{cell}, {}", FACES[side as usize]));
        };
        // The finer side follows the other.
        let (a, b): (Vec<usize>, Vec<usize>) = interface.overlaps.iter().map(|o| (o.a, o.b)).unzip();
        let number = |cells: &[usize]| cells.iter().collect::<std::collections::HashSet<_>>().len();
        let is_a_finer = number(&a) >= number(&b);
        surface(if is_a_finer { "SLAVE" } else { "MASTER" }, interface.a.1, a);
        surface(if is_a_finer { "MASTER" } else { "SLAVE" }, interface.b.1, b);
        let _ = writeln!(more, "*TIE, NAME=T{i}, POSITION TOLERANCE=1e-5\nSLAVE{i}, MASTER{i}");
    }
    let nearest = |(part, point): (usize, [f64; 3])| {
        let apart = |at: &[f64; 3]| (0..3).map(|d| (at[d] - point[d]).powi(2)).sum::<f64>();
        let own = places.iter().enumerate().filter(|(_, (p, _))| *p == part);
        own.min_by(|a, b| apart(&a.1.1).total_cmp(&apart(&b.1.1))).unwrap().0 + 1
    };
    let read: Vec<usize> = (machine.sensors.iter())
        .filter_map(|s| if let SensorReading::Displacement(own) = &s.reads { Some(nearest(own.of)) } else { None })
        .collect();
    let list: Vec<String> = read.iter().map(usize::to_string).collect();
    let reference = machine.elasticity.reference - 273.15;
    let text = format!(
        "{nodes}{elements}{more}*NSET, NSET=ALL, GENERATE\n1, {count}\n*NSET, NSET=READ\n{}\n*BOUNDARY\n{fixed}\
         *INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, {reference}\n*STEP\n*STATIC\n*TEMPERATURE\n{heat}*NODE PRINT, NSET=READ\nU\n*END STEP\n",
        list.join(",\n")
    );
    (text, read)
}

/// Displacements of nodes, m.
fn solved(folder: &Path, deck: &str) -> Option<HashMap<usize, [f64; 3]>> {
    std::fs::write(folder.join("post.inp"), deck).unwrap();
    let Ok(ran) = Command::new("ccx").args(["-i", "post"]).current_dir(folder).output() else {
        println!("skipped: CalculiX is missing");
        return None;
    };
    let text = std::fs::read_to_string(folder.join("post.dat")).unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&ran.stdout)));
    let row = |line: &str| -> Option<(usize, [f64; 3])> {
        let fields: Vec<&str> = line.split_whitespace().collect();
        let [node, x, y, z] = fields[..] else { return None };
        Some((node.parse().ok()?, [x.parse().ok()?, y.parse().ok()?, z.parse().ok()?]))
    };
    Some(text.lines().filter_map(row).collect())
}

/// Every displacement of the machine beside that of CalculiX; returns the largest difference as a share of the largest value.
fn compared(name: &str, machine: Machine, parts: &[&str], cells: usize, condition: &[(&str, &str)]) -> Option<f64> {
    let folder = folder(name);
    let model = MeshedMachine::new(machine, Some(cells)).unwrap();
    let state = model.steady(&model.machine.condition(condition).unwrap()).unwrap();
    let (deck, read) = deck(&model, parts, &state.solution.temperatures);
    let theirs = solved(&folder, &deck)?;
    let ours = model.readings(&state);
    let displacements = model.machine.sensors.iter().zip(&ours).filter_map(|(sensor, value)| match &sensor.reads {
        SensorReading::Displacement(own) => Some((&sensor.name, own.direction, *value)),
        _ => None,
    });
    let (mut apart, mut largest) = (0.0_f64, 0.0_f64);
    for ((name, direction, value), node) in displacements.zip(read) {
        let theirs: f64 = (0..3).map(|d| direction[d] * theirs[&node][d] * 1e6).sum();
        println!("| {name} | {value:.4} | {theirs:.4} |");
        (apart, largest) = (apart.max((value - theirs).abs()), largest.max(theirs.abs()));
    }
    Some(apart / largest)
}

#[test]
fn a_post_with_an_arm() {
    // At a corner of a cell, so that a node of the deck is the very point; and cells that match, as ties of CalculiX between
    // others move the tip by several per cent from mesh to mesh.
    let text = POST
        .replace("\"300 mm\", \"30 mm\", \"25 mm\"", "\"300 mm\", \"60 mm\", \"50 mm\"")
        .replace("\"60 mm\", \"400 mm\"]", "\"60 mm\", \"400 mm\"]\ncells = [6, 6, 40]")
        .replace("\"60 mm\", \"50 mm\"]\nat", "\"60 mm\", \"50 mm\"]\ncells = [30, 6, 5]\nat");
    let machine: Machine = text.parse().unwrap();
    let condition = [("motor_speed", "2000 rpm"), ("ambient_temperature", "22 degC")];
    if let Some(apart) = compared("calculix", machine, &["post", "arm"], 1500, &condition) {
        assert!(apart < 0.005, "{apart}");
    }
}

/// The motor of the published rig on its plate, held at its foot; stiffness and expansion are those of aluminium.
#[test]
fn the_rig() {
    let rig = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("machines/rig.toml")).unwrap();
    let solid = "expansion = \"23.6e-6 1/K\"\nyoungs_modulus = \"68.9 GPa\"\npoisson_ratio = 0.33\n";
    // Cells of 5 mm along plate and motor match.
    let mut text = rig
        .replace("[material.motor]\n", &format!("[material.motor]\n{solid}"))
        .replace("box = [\"240 mm\", \"220 mm\", \"20 mm\"]", "box = [\"240 mm\", \"220 mm\", \"20 mm\"]\ncells = [48, 44, 2]")
        .replace("box = [\"130 mm\", \"130 mm\", \"162 mm\"]", "cells = [26, 26, 8], box = [\"130 mm\", \"130 mm\", \"162 mm\"]")
        .replace("box = [\"130 mm\", \"110 mm\", \"4 mm\"]", "cells = [26, 22, 1], box = [\"130 mm\", \"110 mm\", \"4 mm\"]");
    assert_eq!(text.matches("cells = [").count(), 3);
    text += "\n[support.bench]\nfaces = [\"motor_plate.-z\"]\n";
    for axis in ["x", "y", "z"] {
        text += &format!(
            "[displacement.\"top {axis}\"]\npoint = [\"185 mm\", \"45 mm\", \"186 mm\"]\nin = \"motor\"\ncoordinates = \"machine\"\ndirection = \"{axis}\"\n"
        );
    }
    let machine: Machine = text.parse().unwrap();
    let condition = [
        ("coolant_flow", "3.33e-5 m3/s"),
        ("coolant_temperature", "26 degC"),
        ("motor_speed", "2500 rpm"),
        ("ambient_temperature", "28.5 degC"),
    ];
    if let Some(apart) = compared("rig", machine, &["motor_plate", "motor"], 6000, &condition) {
        assert!(apart < 0.005, "{apart}");
    }
}
