//! One linear system: a cube of two materials with a film on one face and radiation from the others.

use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Instant;

use coldplate_describe::machine::Machine;
use coldplate_network::mesh::Mesh;
use coldplate_network::{Load, Network};
use coldplate_solve::krylov::conjugate_gradients;
use coldplate_solve::multigrid::Multigrid;
use coldplate_solve::{Symmetric, System};

fn machine(n: usize) -> Machine {
    // Cells of one size on either side of the interface.
    let (lower, upper) = (n / 2, n - n / 2);
    let side = n as f64 * 1e-3;
    let text = format!(
        r#"
        name = "cube"
        [chamber]
        temperature = "ambient_temperature"
        [material.steel]
        conductivity = "16.3 W/(m K)"
        density = "7900 kg/m3"
        specific_heat = "500 J/(kg K)"
        [material.aluminium]
        conductivity = "167 W/(m K)"
        density = "2700 kg/m3"
        specific_heat = "896 J/(kg K)"
        [part.lower]
        material = "aluminium"
        box = ["{side} m", "{side} m", "{} m"]
        cells = [{n}, {n}, {lower}]
        surface = {{ effective_emissivity = 0.55 }}
        [part.upper]
        material = "steel"
        box = ["{side} m", "{side} m", "{} m"]
        at = ["0 m", "0 m", "{} m"]
        cells = [{n}, {n}, {upper}]
        surface = {{ effective_emissivity = 0.55 }}
        [contact.bond]
        between = ["lower", "upper"]
        bonded = true
        [boundary.film]
        faces = ["lower.-z"]
        film = "500 W/(m2 K)"
        fluid_temperature = "20 degC"
        [source.heat]
        in = ["upper"]
        power = "100 W"
        "#,
        lower as f64 * 1e-3,
        upper as f64 * 1e-3,
        lower as f64 * 1e-3
    );
    Machine::from_text(&text, "cube.toml", &[]).unwrap_or_else(|e| panic!("{e}"))
}

/// Sets up and solves the first Newton step of the cube to a relative residual of 1e-8.
pub fn run(n: usize, export: Option<&Path>) {
    let machine = machine(n);
    let given =
        [("coolant_flow", "1 L/min"), ("coolant_temperature", "20 degC"), ("motor_speed", "0 rpm"), ("ambient_temperature", "23.5 degC")];
    let condition = machine.condition(&given).unwrap_or_else(|e| panic!("{e}"));
    let mesh = Mesh::with_size(&machine, 1.0).unwrap_or_else(|e| panic!("{e}"));
    let network = Network::build(&machine, &mesh).unwrap_or_else(|e| panic!("{e}"));
    let load = Load::at(&machine, &condition).unwrap_or_else(|e| panic!("{e}"));
    let system = System::new(&network);
    let start = vec![295.0; network.nodes];
    let matrix = system.jacobian(&network, &load, &[], &start);
    let right: Vec<f64> = system.residual(&network, &load, &[], &start).iter().map(|r| -r).collect();
    let symmetric = system.symmetric(&network, &load, &[], &start);
    let rows = right.len();

    let clock = Instant::now();
    let multigrid = Multigrid::new(&symmetric, &network.capacity).unwrap_or_else(|e| panic!("{e}"));
    let setup = clock.elapsed().as_secs_f64();
    let mut x = vec![0.0; rows];
    let mut work = multigrid.workspace();
    let clock = Instant::now();
    let outcome = conjugate_gradients(&matrix, &right, &mut x, 1e-8, 200, |r, z| multigrid.apply(r, z, &mut work));
    let solve = clock.elapsed().as_secs_f64();
    println!(
        "linear system, {rows} unknowns: setup {setup:.2} s, solve {solve:.2} s, {} iterations, relative residual {:.1e}, peak {:.0} MB",
        outcome.iterations,
        outcome.relative_residual,
        peak_megabytes()
    );
    let mut product = vec![0.0; rows];
    let clock = Instant::now();
    for _ in 0..10 {
        matrix.multiply(&x, &mut product);
    }
    let seconds = clock.elapsed().as_secs_f64() / 10.0;
    // Vector, diagonal and result, 8 bytes each.
    println!("one product with the matrix: {:.1} ms, {:.1} GB/s", seconds * 1e3, 24.0 * rows as f64 / seconds / 1e9);
    if let Some(folder) = export {
        write(folder, &symmetric, &right, &x).unwrap_or_else(|e| panic!("{e}"));
        println!("wrote the matrix to {}", folder.display());
    }
}

/// Upper triangle (row, column, value), right-hand side and our solution as raw little-endian arrays.
fn write(folder: &Path, matrix: &Symmetric<'_>, right: &[f64], x: &[f64]) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let file = |name: &str| std::fs::File::create(folder.join(name)).map(BufWriter::new);
    let (mut pairs, mut values) = (file("pairs.u32")?, file("conductances.f64")?);
    let mut put = |a: usize, b: usize, g: f64| -> std::io::Result<()> {
        pairs.write_all(&(a as u32).to_le_bytes())?;
        pairs.write_all(&(b as u32).to_le_bytes())?;
        values.write_all(&g.to_le_bytes())
    };
    for (block, profile) in matrix.blocks.iter().zip(&matrix.profiles) {
        let mut found = Vec::new();
        for segment in block.segments(block.nodes()) {
            segment.each_face(block.cells[0], |at, d, other, is_next, owner| {
                if is_next {
                    let g = if d == 0 { profile[0][owner + 1] } else { profile[d][owner] };
                    found.push((segment.node + at, other, g));
                }
            });
        }
        for (a, b, g) in found {
            put(a, b, g)?;
        }
    }
    for (a, b, g) in &matrix.couplings {
        put(*a as usize, *b as usize, *g)?;
    }
    for (name, vector) in [("to_given.f64", matrix.to_given.as_slice()), ("right.f64", right), ("solution.f64", x)] {
        let mut out = file(name)?;
        for v in vector {
            out.write_all(&v.to_le_bytes())?;
        }
    }
    Ok(())
}

/// Most memory this process has used, MB (Linux; 0 elsewhere).
pub fn peak_megabytes() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|l| l.starts_with("VmHWM")).unwrap_or("");
    line.split_whitespace().nth(1).and_then(|kb| kb.parse::<f64>().ok()).unwrap_or(0.0) / 1024.0
}
