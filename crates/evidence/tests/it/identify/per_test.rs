//! Slopes and machines of numbers that hold in one test alone.

use coldplate_evidence::identify::{Free, IdentifyProblem};
use coldplate_evidence::measurement::MeasurementUncertainty;
use coldplate_explore::simulate::Start;
use coldplate_testing::machines::BLOCKS;

use super::common::{condition, study, table};

/// Factors, tests in rows that alternate: slopes as differences of predictions have them.
#[test]
fn slopes_of_a_test_alone_are_those_of_its_readings() {
    let study = study(BLOCKS, Some(300));
    let at = |speed: f64| condition(&study, [4.0, 20.0, speed, 25.0]);
    let mut data = table(&study, &["motor", "plate"], &[1000.0, 1500.0, 2000.0].map(|n| (at(n), vec![Some(300.0), Some(295.0)])));
    data.rows[2].test = "test 1".into();
    data.rows[1].readings[1] = None;
    let uncertainty = MeasurementUncertainty::usual(&data, &study.model.machine);
    let free = ["source.motor.power@test 1", "source.motor.power", "contact.motor.conductance@test 2"];
    let free: Vec<Free> = free.iter().map(|text| Free::parse(text, &study).unwrap()).collect();
    let problem = IdentifyProblem { study, data, uncertainty, free, start: Start::Steady };
    let values = [1.3, 0.8, 600.0];
    let found = problem.predict(&values).unwrap();
    assert_eq!((found.values.len(), found.conditions.len()), (5, 5));
    for k in 0..3 {
        let moved = |by: f64| {
            let mut values = values;
            values[k] *= 1.0 + by;
            problem.predict(&values).unwrap().values
        };
        let (more, less) = (moved(1e-3), moved(-1e-3));
        for i in 0..5 {
            let expected = (more[i] - less[i]) / (2e-3 * values[k]);
            let is_own = (k == 0) == (i != 2);
            assert!((found.slopes[i][k] - expected).abs() <= 1e-5 * expected.abs() + 1e-9, "{k} {i}: {} {expected}", found.slopes[i][k]);
            assert!(is_own || found.slopes[i][k] == 0.0, "{k} {i}");
        }
    }
    // The machine of a test carries its own values.
    let own = problem.machine_in("test 2", &values).unwrap();
    assert!((own.parameter("contact.motor.conductance").unwrap().value - 600.0).abs() < 1e-6);
    let common = problem.machine_at(&values).unwrap();
    assert!((common.parameter("contact.motor.conductance").unwrap().value - 700.0).abs() < 1e-6);
}
