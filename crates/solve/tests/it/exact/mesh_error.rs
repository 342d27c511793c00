//! What the mesh costs: the estimate beside the true error.

use coldplate_solve::meshed::MeshedMachine;

use crate::bench::{CONDITION, machine, solve};

/// A bar of 0.1 m with heat shared as exp(-x/a), held at one end: its readings are known (see the sources).
const BAR: &str = r#"
    [material.steel]
    conductivity = "20 W/(m K)"
    [part.rod]
    material = "steel"
    surface = "none"
    box = ["100 mm", "10 mm", "10 mm"]
    cells = CELLS
    [boundary.held]
    faces = ["rod.-x"]
    temperature = "20 degC"
    [source.heat]
    in = "rod"
    power = "8 W"
    distribution = "exp(-x_mm / 25)"
    [sensor.end]
    face = "rod.+x"
    [sensor.mean]
    part = "rod"
"#;

/// The estimate covers the error and is not many times larger; its order is the scheme's.
#[test]
fn estimates_cover_errors() {
    let e = (-4.0f64).exp();
    let end = 20.0 + 8.0 / (20.0 * 1e-4) * (0.025 * (1.0 - e) - 0.1 * e) / (1.0 - e);
    // Numbers of cells that halves and thirds divide.
    for cells in [[24, 6, 6], [48, 12, 12], [96, 12, 12]] {
        let solved = solve(&BAR.replace("CELLS", &format!("{cells:?}")), 1e-3);
        let condition = solved.model.machine.condition(&CONDITION).unwrap();
        let found = solved.model.mesh_errors(&condition, &solved.state).unwrap().unwrap();
        let error = (solved.celsius("end") - end).abs();
        println!("{cells:?}: error {error:.2e}, estimate {:.2e}, order {:?}, cells {:?}", found.errors[0], found.orders[0], found.cells);
        assert!(error <= found.errors[0] && found.errors[0] < 1.5 * error, "{cells:?}: {error} {found:?}");
        assert!((found.orders[0].unwrap() - 2.0).abs() < 0.1, "{found:?}");
    }
}

/// A checkerboard of two materials between a plate that conducts perfectly and a held face: heat flows as through a plate of
/// sqrt(k1 k2) (Keller, J. Math. Phys. 5 (1964) 548). The field is singular where four corners meet, and the order of convergence is
/// 0.78 at a contrast of 1:10, 0.25 at 1:100, and 0.08 at 1:1000.
#[test]
fn estimates_cover_errors_of_singular_fields() {
    let part = |name: &str, material: &str, at: [i32; 2], cells: usize| {
        format!(
            "[part.{name}]\nmaterial = \"{material}\"\nsurface = \"none\"\nbox = [\"50 mm\", \"50 mm\", \"10 mm\"]\n\
             at = [\"{} mm\", \"{} mm\", \"0 mm\"]\ncells = [{cells}, {cells}, 1]\n",
            at[0], at[1]
        )
    };
    for contrast in [10.0f64, 100.0, 1000.0] {
        for cells in [6, 12, 24] {
            let (low, high) = (10.0 / contrast, 10.0);
            let materials = [("low", low), ("high", high), ("plate", 1e5)]
                .map(|(name, k)| format!("[material.{name}]\nconductivity = \"{k} W/(m K)\"\n"));
            let text = materials.concat()
                + &part("a", "low", [0, 0], cells)
                + &part("b", "high", [50, 0], cells)
                + &part("c", "high", [0, 50], cells)
                + &part("d", "low", [50, 50], cells)
                + &format!(
                    "[part.plate]\nmaterial = \"plate\"\nsurface = \"none\"\nbox = [\"1 mm\", \"100 mm\", \"10 mm\"]\n\
                     at = [\"-1 mm\", \"0 mm\", \"0 mm\"]\ncells = [1, {}, 1]\n\
                     [boundary.held]\nfaces = [\"b.+x\", \"d.+x\"]\ntemperature = \"20 degC\"\n\
                     [source.heat]\nin = \"plate\"\npower = \"1 W\"\n[sensor.plate]\npart = \"plate\"\n\
                     [contacts]\ndefault = \"bonded\"\n",
                    2 * cells
                );
            let solved = solve(&text, 1e-3);
            let condition = solved.model.machine.condition(&CONDITION).unwrap();
            let found = solved.model.mesh_errors(&condition, &solved.state).unwrap().unwrap();
            let error = (solved.celsius("plate") - 20.0 - 1.0 / ((low * high).sqrt() * 0.01)).abs();
            println!("1:{contrast} {cells}: error {error:.3}, estimate {:.3}, order {:?}", found.errors[0], found.orders[0]);
            assert!(error <= found.errors[0] && found.errors[0] < 3.0 * error, "1:{contrast} {cells}: {error} {found:?}");
        }
    }
}

/// The same of shipped machines on coarse meshes, against meshes of a hundred times as many cells: of 20 readings the
/// estimate covers 19.
#[test]
fn estimates_cover_errors_of_machines() {
    let (mut covered, mut all, mut ratios) = (0, 0, Vec::new());
    let shown = 1e-3;
    for name in ["rig", "spindle", "five_axis"] {
        let path = coldplate_testing::root().join(format!("machines/{name}.toml"));
        let read = || coldplate_describe::machine::Machine::read(&path, &[]).unwrap();
        let given = [
            ("coolant_flow", "6 L/min"),
            ("coolant_temperature", "20 degC"),
            ("motor_speed", "1000 rpm"),
            ("ambient_temperature", "22 degC"),
        ];
        let fine = MeshedMachine::new(read(), Some(600_000)).unwrap();
        let condition = fine.machine.condition(&given).unwrap();
        let truth = fine.readings(&fine.steady(&condition).unwrap());
        for cells in [2000, 6000] {
            let coarse = MeshedMachine::new(read(), Some(cells)).unwrap();
            let state = coarse.steady(&condition).unwrap();
            let found = coarse.mesh_errors(&condition, &state).unwrap().unwrap();
            for (s, (own, fine)) in coarse.readings(&state).iter().zip(&truth).enumerate() {
                let error = (own - fine).abs();
                println!(
                    "{name} {cells} {}: error {error:.4}, estimate {:.4}, order {:?}",
                    coarse.network.sensor_names[s], found.errors[s], found.orders[s]
                );
                all += 1;
                covered += usize::from(found.errors[s] >= error || error < 1e-4);
                ratios.extend((error > shown).then(|| found.errors[s] / error));
            }
        }
    }
    ratios.sort_by(f64::total_cmp);
    let median = ratios[ratios.len() / 2];
    println!("{covered} of {all} covered, median estimate over error {median:.2} where it is above a millikelvin");
    assert!(covered * 20 >= all * 19 && median < 4.0, "{covered} of {all}, {median}");
}

/// Lumped nodes have no mesh.
#[test]
fn nodes_cost_nothing() {
    let text = "[node.a]\n[node.b]\ntemperature = \"20 degC\"\n[contact.ab]\nbetween = [\"a\", \"b\"]\ntotal_conductance = \"1 W/K\"\n\
                [source.a]\nin = \"a\"\npower = \"1 W\"\n[sensor.a]\nnode = \"a\"\n";
    let model = MeshedMachine::new(machine(text), None).unwrap();
    let condition = model.machine.condition(&CONDITION).unwrap();
    let state = model.steady(&condition).unwrap();
    assert_eq!(model.mesh_errors(&condition, &state).unwrap(), None);
}
