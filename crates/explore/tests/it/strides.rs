//! A linear network of few nodes takes a stretch of straight loads in one exact step.

use coldplate_explore::schedule::{Breakpoint, Schedule};
use coldplate_explore::simulate::{SimulateOptions, run};
use coldplate_solve::study::Study;

/// Half a day of a hall with steps, ramps and rest of the load, in rows minutes to hours apart.
fn schedule(study: &Study) -> Schedule {
    let machine = &study.model.machine;
    let defaults: Vec<f64> = machine.variables.iter().map(|v| v.default.unwrap_or(0.0)).collect();
    let place = |name: &str| machine.variables.iter().position(|v| v.name == name).unwrap();
    let (power, hall) = (place("power"), place("ambient_temperature"));
    let rows = [
        (0.0, 0.0, 290.0),
        (300.0, 0.0, 290.0),
        (300.0, 550.0, 290.0),
        (4000.0, 550.0, 294.0),
        (4100.0, 20.0, 294.0),
        (43200.0, 20.0, 288.0),
    ];
    let row = |(time, watts, kelvin): &(f64, f64, f64)| {
        let mut values = defaults.clone();
        (values[power], values[hall]) = (*watts, *kelvin);
        Breakpoint { time: *time, values }
    };
    Schedule::from_rows(rows.iter().map(row).collect(), &[]).unwrap()
}

/// As an integration to a hundredth of the usual error, in four steps; heat adds up.
#[test]
fn one_step_is_as_many_small_ones() {
    let path = coldplate_testing::root().join("benches/evidence_speed/lumped.toml");
    let study = Study::read(path, &[], None).unwrap();
    let schedule = schedule(&study);
    let with = |only_outputs: bool, tolerance: f64| {
        let options = SimulateOptions { every: Some(f64::INFINITY), only_outputs, tolerance, ..SimulateOptions::default() };
        run(&study.model, &schedule, &options, &mut |_| {}).unwrap()
    };
    let (exact, small) = (with(true, 0.01), with(false, 1e-5));
    assert_eq!(exact.steps, 4);
    assert!(small.steps > 200, "{}", small.steps);
    for (a, b) in exact.temperatures.iter().flatten().zip(small.temperatures.iter().flatten()) {
        assert!((a - b).abs() < 1e-3, "{a} {b}");
    }
    assert!(exact.energy.relative() < 1e-12, "{:?}", exact.energy);
    assert!((exact.energy.stored / small.energy.stored - 1.0).abs() < 1e-4, "{:?} {:?}", exact.energy, small.energy);
}
