//! Independence of choices that mean nothing.

use crate::bench::{Solved, model, solve, solved};
use crate::invariant::{close, everything};

const SENSORS: [&str; 6] = ["bed", "plate", "bearing", "motor", "out2", "out3"];

#[test]
fn order_of_parts() {
    let a = solve(&everything(&["bed", "plate", "other", "bearing"]), 12e-3);
    let b = solve(&everything(&["bearing", "other", "plate", "bed"]), 12e-3);
    for sensor in SENSORS {
        close(b.celsius(sensor), a.celsius(sensor), 10.0, 1e-9);
    }
}

/// Bit for bit the same temperatures on one thread and on two, on a mesh of several chunks of rows.
#[test]
fn number_of_threads() {
    let text = everything(&["bed", "plate", "other", "bearing"]);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| solve(&text, 4e-3))
    };
    let (one, two) = (run(1), run(2));
    assert!(one.model.mesh.cells > 50_000, "{} cells are too few to be shared out", one.model.mesh.cells);
    let bits = |run: &Solved| run.state.solution.temperatures.iter().map(|t| t.to_bits()).collect::<Vec<_>>();
    assert!(bits(&one) == bits(&two));
    assert_eq!(one.state.solution.krylov_iterations, two.state.solution.krylov_iterations);
}

/// One box, and the same box cut into four bonded blocks of the same cells (of one part, and of several parts):
/// the temperatures agree cell by cell.
#[test]
fn cuts_between_blocks() {
    let rest = r#"
surface = { emissivity = 0.8 }
[chamber]
temperature = "10 degC"
[contacts]
default = { bonded = true }
[material.steel]
conductivity = [["0 degC", "14.6 W/(m K)"], ["200 degC", "20 W/(m K)"]]
[boundary.hot]
faces = [HOT]
temperature = "90 degC"
"#;
    let rest = |hot: &str| rest.replace("HOT", hot);
    let whole = format!(
        "[part.a]\nmaterial = \"steel\"\nbox = [\"80 mm\", \"40 mm\", \"20 mm\"]\nat = [\"0 m\", \"0 m\", \"0 m\"]{}",
        rest("\"a.-x\"")
    );
    let blocks = format!(
        r#"[part.a]
material = "steel"
blocks = [
    {{ box = ["30 mm", "40 mm", "20 mm"], at = ["0 m", "0 m", "0 m"] }},
    {{ box = ["50 mm", "10 mm", "20 mm"], at = ["30 mm", "0 m", "0 m"] }},
    {{ box = ["50 mm", "30 mm", "10 mm"], at = ["30 mm", "10 mm", "0 m"] }},
    {{ box = ["50 mm", "30 mm", "10 mm"], at = ["30 mm", "10 mm", "10 mm"] }},
]{}"#,
        rest("\"a[1].-x\"")
    );
    let part = |name: &str, size: &str, at: &str| {
        format!("[part.{name}]\nmaterial = \"steel\"\nbox = {size}\nat = {at}\nsurface = {{ emissivity = 0.8 }}\n")
    };
    let parts = part("b", r#"["50 mm", "10 mm", "20 mm"]"#, r#"["30 mm", "0 m", "0 m"]"#)
        + &part("c", r#"["50 mm", "30 mm", "20 mm"]"#, r#"["30 mm", "10 mm", "0 m"]"#)
        + &format!(
            "[part.a]\nmaterial = \"steel\"\nbox = [\"30 mm\", \"40 mm\", \"20 mm\"]\nat = [\"0 m\", \"0 m\", \"0 m\"]{}",
            rest("\"a.-x\"")
        );
    let cells = |text: &str| {
        let run = solve(text, 5e-3 * 1.000_001);
        let mut found: Vec<([i64; 3], f64)> = Vec::new();
        for grid in &run.model.mesh.grids {
            for c in grid.cells() {
                let at = [0, 1, 2].map(|d| (grid.centre(d, c[d]) * 1e6).round() as i64);
                found.push((at, run.state.solution.temperatures[grid.cell(c)]));
            }
        }
        found.sort_by_key(|(at, _)| *at);
        found
    };
    let one = cells(&whole);
    for other in [cells(&blocks), cells(&parts)] {
        assert_eq!(one.len(), other.len());
        for (a, b) in one.iter().zip(&other) {
            assert_eq!(a.0, b.0);
            close(b.1, a.1, 80.0, 1e-10);
        }
    }
}

/// A machine that is its own mirror image has mirrored temperatures, cells and channel included.
#[test]
fn symmetric_machine() {
    let text = r#"
[chamber]
temperature = "23 degC"
[material.steel]
conductivity = "16.3 W/(m K)"
[material.brass]
conductivity = "120 W/(m K)"
[contacts]
default = { conductance = "800 W/(m2 K)" }
[part.bed]
material = "steel"
box = ["200 mm", "100 mm", "40 mm"]
at = ["-100 mm", "0 m", "0 m"]
surface = { emissivity = 0.5 }
[part.left]
material = "brass"
box = ["30 mm", "70 mm", "30 mm"]
at = ["-80 mm", "10 mm", "40 mm"]
surface = { emissivity = 0.3 }
[part.right]
material = "brass"
box = ["30 mm", "70 mm", "30 mm"]
at = ["50 mm", "10 mm", "40 mm"]
surface = { emissivity = 0.3 }
[source.heat]
in = ["left", "right"]
power = "60 W"
[channel.middle]
in = "bed"
diameter = "9 mm"
path = [["100 mm", "0 mm", "20 mm"], ["100 mm", "100 mm", "20 mm"]]
[circuit.main]
flow = "3 L/min"
inlet_temperature = "18 degC"
layout = ["middle"]
"#;
    for size in [20e-3, 7e-3] {
        let run = solve(text, size);
        let t = &run.state.solution.temperatures;
        let grids = &run.model.mesh.grids;
        for (g, mirror) in [(0, 0), (1, 2)] {
            for c in grids[g].cells() {
                let other = [grids[g].n(0) - 1 - c[0], c[1], c[2]];
                close(t[grids[mirror].cell(other)], t[grids[g].cell(c)], 10.0, 1e-9);
            }
        }
    }
}

/// Where everything given has one temperature, everything has it, however odd its digits.
#[test]
fn nothing_to_drive_heat() {
    for celsius in ["20.1", "23.456789", "0.3"] {
        let text = everything(&["bed", "plate", "other", "bearing"]);
        let text = text.replace("23.5 degC", &format!("{celsius} degC")).replace("\"20 degC\"", &format!("\"{celsius} degC\""));
        let text = text
            .replace("80 W\"", "0 W\"")
            .replace("25 W\"", "0 W\"")
            .replace("12 W\"", "0 W\"")
            .replace("dissipation = true", "dissipation = false");
        let run = solve(&text, 15e-3);
        let expected: f64 = celsius.parse().unwrap();
        for sensor in SENSORS {
            close(run.celsius(sensor), expected, 1.0, 1e-9);
        }
    }
}

/// A second condition solved with the solver of a first one equals that condition solved on its own.
#[test]
fn reference_condition_of_the_solver() {
    let text = everything(&["bed", "plate", "other", "bearing"]);
    let text = text
        .replace("\"2 L/min\"", "\"coolant_flow\"")
        .replace("inlet_temperature = \"20 degC\"", "inlet_temperature = \"coolant_temperature\"");
    let model = model(&text, 15e-3);
    let condition = |flow: &str, inlet: &str| {
        model
            .machine
            .condition(&[
                ("coolant_flow", flow),
                ("coolant_temperature", inlet),
                ("motor_speed", "0 rpm"),
                ("ambient_temperature", "20 degC"),
            ])
            .unwrap()
    };
    let (a, b) = (condition("2 L/min", "20 degC"), condition("0.7 L/min", "27 degC"));
    let (from_a, from_b) = (model.solver(&a).unwrap(), model.solver(&b).unwrap());
    let readings = |solver| model.readings(&model.solve(solver, &b).unwrap());
    for (x, y) in readings(&from_a).iter().zip(readings(&from_b)) {
        close(*x, y, 10.0, 1e-8);
    }
}

/// The number of Krylov iterations stays bounded as the cells grow.
#[test]
fn iterations_do_not_grow_with_the_mesh() {
    let text = everything(&["bed", "plate", "other", "bearing"]);
    let runs = [16e-3, 8e-3, 4e-3].map(|size| solved(model(&text, size)));
    let per_step = runs.each_ref().map(|r| r.state.solution.krylov_iterations as f64 / r.state.solution.newton_iterations.max(1) as f64);
    println!("Krylov iterations per Newton step: {per_step:?} at {:?} cells", runs.each_ref().map(|r| r.model.mesh.cells));
    assert!(per_step[2] < 40.0, "{per_step:?}");
}
