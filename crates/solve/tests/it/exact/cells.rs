//! Cells that follow the error: the accuracy that was asked for beside the true errors.

use coldplate_base::progress::Silent;
use coldplate_describe::machine::{Condition, Machine};
use coldplate_network::mesh::Mesh;
use coldplate_solve::meshed::{ChosenCells, MeshedMachine, limit_states};

use crate::bench;

/// Shipped machines of blocks whose cells their file leaves open, and that a much finer mesh takes a moment of.
const MACHINES: [&str; 3] = ["rig", "spindle", "slab"];
const USUAL: [(&str, &str); 4] =
    [("coolant_flow", "6 L/min"), ("coolant_temperature", "20 degC"), ("motor_speed", "1000 rpm"), ("ambient_temperature", "22 degC")];
/// Cells of the mesh that stands for the truth, at least, and along every line of the finest one that was chosen.
const TRUTH: f64 = 6e4;
const FINER: f64 = 2.5;

fn machine(name: &str) -> Machine {
    let path = coldplate_testing::root().join(format!("machines/{name}.toml"));
    Machine::read(path, &[]).unwrap()
}

fn usual(machine: &Machine) -> Condition {
    let given: Vec<(&str, &str)> = USUAL.into_iter().filter(|(name, _)| machine.variables.iter().any(|v| v.name == *name)).collect();
    machine.condition(&given).unwrap()
}

fn within(machine: &Machine, accuracy: f64, conditions: &[Condition]) -> MeshedMachine {
    MeshedMachine::within(machine.clone(), accuracy, conditions, &Silent).unwrap_or_else(|e| panic!("{}: {e}", machine.name))
}

fn chosen(model: &MeshedMachine) -> &ChosenCells {
    model.chosen.as_ref().unwrap()
}

/// The machine on the cells of a mesh, finer along every line.
fn truth(machine: &Machine, mesh: &Mesh) -> MeshedMachine {
    let along = FINER.max((TRUTH / mesh.cells as f64).cbrt());
    let counts: Vec<[usize; 3]> = mesh.divisions().iter().map(|n| n.map(|n| (n as f64 * along) as usize)).collect();
    on(machine, Mesh::with_divisions(machine, &counts, 1.0).unwrap())
}

/// Every sensor's reading and every limit's value, K.
fn values(model: &MeshedMachine, condition: &Condition) -> Vec<f64> {
    let state = model.steady(condition).unwrap();
    let readings = model.read(&state);
    let limits: Vec<f64> = limit_states(&model.machine, &readings, &state.load.variables).iter().map(|l| l.value).collect();
    readings.into_iter().chain(limits).collect()
}

fn on(machine: &Machine, mesh: Mesh) -> MeshedMachine {
    MeshedMachine::on(machine.clone(), mesh).unwrap()
}

/// Against a mesh many times finer no reading and no limit is off by more than was asked for; how many are within their own estimate,
/// which is none of a bound, is told.
#[test]
fn cells_keep_their_accuracy() {
    let (mut all, mut kept, mut covered, mut ratios) = (0, 0, 0, Vec::new());
    for name in MACHINES {
        let own = machine(name);
        let condition = usual(&own);
        let models: Vec<MeshedMachine> =
            [0.2, 0.05].iter().map(|accuracy| within(&own, *accuracy, std::slice::from_ref(&condition))).collect();
        let fine = truth(&own, &models[1].mesh);
        let truth = values(&fine, &condition);
        for model in &models {
            let found = chosen(model);
            let estimates = found.sensors.iter().chain(&found.limits);
            let mut largest = (0.0f64, 0.0f64);
            for (i, ((value, truth), estimate)) in values(model, &condition).iter().zip(&truth).zip(estimates).enumerate() {
                let Some(estimate) = estimate else { continue };
                let error = (value - truth).abs();
                assert!(*estimate <= found.accuracy, "{name}: {estimate} {}", found.accuracy);
                if error > found.accuracy {
                    println!("{name} {} reading {i}: error {error:.4} above the accuracy {}", model.mesh.cells, found.accuracy);
                }
                all += 1;
                kept += usize::from(error <= found.accuracy);
                covered += usize::from(error <= estimate.max(1e-4));
                ratios.extend((error > 1e-3).then(|| estimate / error));
                largest = (largest.0.max(error), largest.1.max(*estimate));
            }
            println!(
                "{name} {} K: {} cells, largest error {:.4}, largest estimate {:.4}, beside {} cells; {:?}",
                found.accuracy, model.mesh.cells, largest.0, largest.1, fine.mesh.cells, found.rounds
            );
        }
    }
    ratios.sort_by(f64::total_cmp);
    let median = ratios[ratios.len() / 2];
    println!("{kept} of {all} keep the accuracy, {covered} their estimate; median estimate over error {median:.2} above a millikelvin");
    assert!(kept == all && all > 40, "{kept} of {all}");
}

/// As many cells of one size leave more open.
#[test]
fn chosen_cells_are_better_than_cells_of_one_size() {
    let own = machine("five_axis");
    let condition = usual(&own);
    let model = within(&own, 0.1, std::slice::from_ref(&condition));
    let truth = values(&truth(&own, &model.mesh), &condition);
    let off = |model: &MeshedMachine| {
        let apart = values(model, &condition).into_iter().zip(&truth).map(|(a, b)| (a - b).abs());
        apart.fold(0.0, f64::max)
    };
    let uniform = on(&own, Mesh::with_cells(&own, model.mesh.cells).unwrap());
    let (chosen, uniform) = (off(&model), off(&uniform));
    println!("{} cells, {chosen:.4} K off chosen, {uniform:.4} of one size", model.mesh.cells);
    assert!(chosen < uniform, "{chosen} {uniform}");
}

/// The choice is the same on any number of threads, and keeps the accuracy at every condition.
#[test]
fn the_choice_does_not_depend_on_threads() {
    let own = machine("spindle");
    let at = |flow: &str, speed: &str| {
        let given = [("coolant_flow", flow), USUAL[1], ("motor_speed", speed), USUAL[3]];
        own.condition(&given).unwrap()
    };
    let conditions = [at("6 L/min", "1000 rpm"), at("2 L/min", "1000 rpm"), at("6 L/min", "3000 rpm"), at("2 L/min", "3000 rpm")];
    let of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| within(&own, 0.05, &conditions))
    };
    let (one, three) = (of(1), of(3));
    assert!(one.mesh.divisions() == three.mesh.divisions() && one.chosen == three.chosen);
    assert!(chosen(&one).conditions == conditions.len() && chosen(&one).sensors.iter().flatten().all(|open| *open <= 0.05));
}

/// A bar of 0.1 m held at one end and heated along itself; its cells across are stated.
const BAR: &str = r#"
    [material.steel]
    conductivity = "20 W/(m K)"
    [part.rod]
    material = "steel"
    surface = "none"
    box = ["100 mm", "10 mm", "10 mm"]
    cells = [0, 3, 2]
    [boundary.held]
    faces = ["rod.-x"]
    temperature = "20 degC"
    [source.heat]
    in = "rod"
    power = "8 W"
    distribution = "exp(-x_mm / 25)"
    [sensor.end]
    face = "rod.+x"
"#;

/// Cells go where the error is: along the bar, as many as its exact solution asks for, and none where the file states them.
#[test]
fn stated_cells_are_kept() {
    let e = (-4.0f64).exp();
    let exact = 20.0 + 8.0 / (20.0 * 1e-4) * (0.025 * (1.0 - e) - 0.1 * e) / (1.0 - e);
    let own = bench::machine(BAR);
    let condition = own.condition(&bench::CONDITION).unwrap();
    let mut before = 0;
    for accuracy in [0.5, 0.1, 0.02] {
        let model = within(&own, accuracy, std::slice::from_ref(&condition));
        let solved = bench::solved(model);
        let (found, counts) = (chosen(&solved.model), solved.model.mesh.divisions());
        let error = (solved.celsius("end") - exact).abs();
        println!("{accuracy} K: {counts:?}, error {error:.4}, estimate {:?}, {:?}", found.sensors, found.stated);
        assert!(error <= accuracy && counts[0][1..] == [3, 2] && counts[0][0] > before, "{counts:?} {error}");
        // The field does not change across the bar.
        assert!(found.stated.len() == 1 && found.stated[0].1 < 1e-6, "{:?}", found.stated);
        before = counts[0][0];
    }
}

/// What cannot be had is refused with what is left, and imported elements at once.
#[test]
fn what_cannot_be_had_is_refused() {
    let own = machine("rig");
    let condition = usual(&own);
    let error = MeshedMachine::within(own, 1e-7, &[condition], &Silent).unwrap_err().to_string();
    assert!(error.contains("cannot be had") && error.contains("cells still leave"), "{error}");
    let own = machine("bracket");
    let condition = usual(&own);
    let error = MeshedMachine::within(own, 0.1, &[condition], &Silent).unwrap_err().to_string();
    assert!(error.contains("brings its own elements"), "{error}");
}
