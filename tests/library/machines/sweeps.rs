//! The shipped sweeps: every one names a machine that exists and a design that can be run.

use coldplate_describe::machine::Machine;
use coldplate_explore::sweep::{ConditionGroup, Plan, Purpose, SweepDefinition};

use super::{files, folder};

fn plan(path: &std::path::Path) -> (Machine, Plan) {
    let definition = SweepDefinition::read(path).unwrap_or_else(|e| panic!("{e}"));
    let machine = Machine::read(definition.machine.as_ref().unwrap(), &definition.set).unwrap_or_else(|e| panic!("{e}"));
    let plan = definition.plan(&machine.variables).unwrap_or_else(|e| panic!("{e}"));
    (machine, plan)
}

#[test]
fn every_sweep_can_be_planned_inside_its_machines_ranges() {
    let sweeps = files("sweeps");
    assert!(sweeps.len() >= 3, "{sweeps:?}");
    for path in sweeps {
        let (machine, plan) = plan(&path);
        assert!(!plan.conditions.is_empty());
        for condition in &plan.conditions {
            for (variable, value) in machine.variables.iter().zip(condition) {
                let (low, high) = variable.range.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
                let slack = 1e-9 * (high - low).abs();
                assert!((low - slack..=high + slack).contains(value), "{}: {} {value}", path.display(), variable.name);
            }
        }
    }
}

/// `sweeps.csv` of the paper: variable, range, what is held, degree.
#[test]
fn the_papers_sweeps_are_as_published() {
    let (machine, plan) = plan(&folder("sweeps").join("paper.toml"));
    let rpm = std::f64::consts::PI / 30.0;
    let published = [
        ("coolant_flow", 3.925e-5, 3.14e-4, 3, [f64::NAN, 293.15, 2500.0 * rpm, 293.15]),
        ("coolant_temperature", 291.15, 297.15, 2, [1.57e-4, f64::NAN, 2500.0 * rpm, 296.65]),
        ("motor_speed", 250.0 * rpm, 2500.0 * rpm, 2, [1.57e-4, 293.15, f64::NAN, 296.65]),
        ("ambient_temperature", 291.15, 297.15, 2, [1.57e-4, 293.15, 250.0 * rpm, f64::NAN]),
    ];
    assert_eq!(plan.groups.len(), published.len());
    for (group, (name, low, high, degree, held)) in plan.groups.iter().zip(published) {
        assert_eq!(machine.variables[group.varied[0]].name, name);
        assert_eq!(group.degree, Some(degree));
        let rows = &plan.conditions[group.rows.clone()];
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b.abs();
        assert!(close(rows[0][group.varied[0]], low) && close(rows[rows.len() - 1][group.varied[0]], high), "{name}");
        for row in rows {
            assert!(held.iter().zip(row).all(|(held, value)| held.is_nan() || close(*value, *held)), "{name}: {row:?}");
        }
    }
}

/// What the surrogate is promised for: at most 200 runs to train on, 200 held out.
#[test]
fn the_main_job_trains_on_200_runs_at_most() {
    let (_, plan) = plan(&folder("sweeps").join("five_axis.toml"));
    // One-factor sweeps beside the design vary a single variable and train nothing.
    let rows = |keep: &dyn Fn(&ConditionGroup) -> bool| plan.groups.iter().filter(|g| keep(g)).map(|g| g.rows.len()).sum::<usize>();
    let training = rows(&|g| g.purpose == Purpose::Fit && g.varied.len() == 4);
    let held_out = rows(&|g| g.purpose == Purpose::Validation);
    assert!((100..=200).contains(&training), "{training}");
    assert_eq!(held_out, 200);
}
