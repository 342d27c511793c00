//! A machine whose readings are known in closed form: estimates, intervals, open directions, bounds, priors, scans.

use coldplate_base::progress::Silent;
use coldplate_evidence::identify::{IdentifyOptions, MisfitScan, identify, next_tests, profile, scan};
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, VariableUncertainty};
use coldplate_solve::study::Study;
use coldplate_testing::machines::SERIES;

use super::common::{condition, problem, study, table};

const AMBIENT: f64 = 22.0 + 273.15;
const FIRST: &str = "contact.first.total_conductance";
const SECOND: &str = "contact.second.conductance";
const AREA: &str = "contact.second.area";
/// Noise, own error of a sensor, error of the ambient temperature, K.
const ERRORS: [f64; 3] = [0.03, 0.04, 0.12];

/// Motor and middle over the ambient temperature with conductances g1 and g2, W/K.
fn rise(g1: f64, g2: f64) -> [f64; 2] {
    [30.0 / g1 + 30.0 / g2, 30.0 / g1]
}

fn data(file: &Study, sensors: &[&str], rises: &[f64]) -> (Data, MeasurementUncertainty) {
    let rows = [(condition(file, [2.0, 20.0, 1000.0, 22.0]), rises.iter().map(|r| Some(AMBIENT + r)).collect())];
    let data = table(file, sensors, &rows);
    let mut u = MeasurementUncertainty::usual(&data, &file.model.machine);
    u.noise.fill(ERRORS[0]);
    u.bias.fill(ERRORS[1]);
    u.variables = vec![VariableUncertainty::default(); 4];
    u.variables[3].absolute = ERRORS[2];
    (data, u)
}

fn options() -> IdentifyOptions {
    IdentifyOptions { starts: 1, seed: 1 }
}

#[test]
fn a_single_reading_gives_one_conductance_and_its_interval() {
    let file = study(SERIES, None);
    let (data, u) = data(&file, &["motor"], &rise(2.0, 5.0)[..1]);
    let problem = problem(file, data, u, &[SECOND]);
    let found = identify(&problem, &options(), &Silent).unwrap();
    assert!((found.values[0] / 500.0 - 1.0).abs() < 1e-4, "{:?}", found.values);
    // The motor stands 30 W / (5 W/K) = 6 K above the middle: that moves by 6 K per unit of the logarithm.
    let expected = ERRORS.iter().map(|e| e * e).sum::<f64>().sqrt() / 6.0;
    assert!((found.deviations[0] / expected - 1.0).abs() < 1e-4, "{} {expected}", found.deviations[0]);
    let edge = 500.0 * (1.959_964 * expected).exp();
    assert!((found.intervals[0].1 / edge - 1.0).abs() < 1e-4, "{:?} {edge}", found.intervals);
    assert_eq!((found.freedom, found.undetermined.len()), (0, 0));
    // Where the misfit rises by 3.84: the motor reads 1.96 deviations less or more.
    let reach = 1.959_964 * expected * 6.0;
    let p = profile(&problem, &found, 0).unwrap();
    for (end, at) in [(p.interval.0, 3000.0 / (6.0 + reach)), (p.interval.1, 3000.0 / (6.0 - reach))] {
        assert!((end.unwrap() / at - 1.0).abs() < 2e-4, "{end:?} {at}");
    }
}

#[test]
fn only_the_sum_of_resistances_is_known() {
    let file = study(SERIES, None);
    let (data, u) = data(&file, &["motor"], &rise(2.0, 4.0)[..1]);
    let found = identify(&problem(file, data, u, &[FIRST, SECOND]), &options(), &Silent).unwrap();
    // 1/G1 + 1/G2 stands still where the logarithms move by G1 and -G2: 2 and -4.
    let [open] = found.undetermined.as_slice() else { panic!("{:?}", found.undetermined) };
    let length = 20f64.sqrt();
    assert!((open.weights[0] + 2.0 / length).abs() < 1e-4 && (open.weights[1] - 4.0 / length).abs() < 1e-4, "{open:?}");
    assert!(open.deviation > 1e5, "{open:?}");
    assert!(open.text.contains(&format!("more '{SECOND}' (0.89)")) && open.text.contains(&format!("less '{FIRST}' (0.45)")), "{open:?}");
    assert!((found.correlation[(0, 1)] + 1.0).abs() < 1e-6, "{}", found.correlation);
    let sum = 1.0 / found.values[0] + 100.0 / found.values[1];
    assert!((sum - 0.75).abs() < 1e-5, "{sum}");
    // A reading in between tells them apart, and that is what is advised.
    let file = study(SERIES, None);
    let (two, u) = data_of_both(&file);
    let settled = identify(&problem(file, two, u, &[FIRST, SECOND]), &options(), &Silent).unwrap();
    assert!(settled.undetermined.is_empty(), "{:?}", settled.undetermined);
}

fn data_of_both(file: &Study) -> (Data, MeasurementUncertainty) {
    data(file, &["motor", "middle"], &rise(2.5, 6.0))
}

#[test]
fn only_the_product_of_conductance_and_area_is_known() {
    let file = study(SERIES, None);
    let (data, u) = data_of_both(&file);
    let problem = problem(file, data, u, &[FIRST, SECOND, AREA]);
    let found = identify(&problem, &options(), &Silent).unwrap();
    let [open] = found.undetermined.as_slice() else { panic!("{:?}", found.undetermined) };
    let half = 0.5f64.sqrt();
    assert!(open.weights[0].abs() < 1e-4 && (open.weights[1].abs() - half).abs() < 1e-4, "{open:?}");
    assert!((open.weights[1] + open.weights[2]).abs() < 1e-4 && !open.text.contains(FIRST), "{open:?}");
    assert!((found.values[1] * found.values[2] / 6.0 - 1.0).abs() < 1e-4, "{:?}", found.values);
    assert!((found.values[0] / 2.5 - 1.0).abs() < 1e-4, "{:?}", found.values);
    // What is known keeps its interval: 12 K over the ambient.
    let expected = ERRORS.iter().map(|e| e * e).sum::<f64>().sqrt() / 12.0;
    assert!((found.deviations[0] / expected - 1.0).abs() < 1e-3, "{} {expected}", found.deviations[0]);
    let advice = next_tests(&problem, &found, &[0, 1]).unwrap();
    assert!(!advice.is_empty() && advice[0].shrink[0] < 0.9 && advice[0].shrink[1] > 0.999, "{:?}", advice[0]);
}

#[test]
fn nothing_depends_on_a_capacity_in_a_steady_state() {
    let file = study(SERIES, None);
    let (data, u) = data_of_both(&file);
    let found = identify(&problem(file, data, u, &[FIRST, "node.motor.capacity"]), &options(), &Silent).unwrap();
    let [open] = found.undetermined.as_slice() else { panic!("{:?}", found.undetermined) };
    assert!(open.deviation.is_infinite() && open.text == "'node.motor.capacity' alone", "{open:?}");
    assert!((found.values[1] / 1000.0 - 1.0).abs() < 1e-12, "{:?}", found.values);
    // The interval is all that was allowed.
    assert!((found.intervals[1].0 / 10.0 - 1.0).abs() < 1e-9 && (found.intervals[1].1 / 1e5 - 1.0).abs() < 1e-9, "{:?}", found.intervals);
}

#[test]
fn more_parameters_than_readings_leave_directions_open() {
    let file = study(SERIES, None);
    let (data, u) = data_of_both(&file);
    let free = [FIRST, SECOND, AREA, "source.motor.power"];
    let found = identify(&problem(file, data, u, &free), &options(), &Silent).unwrap();
    assert_eq!((found.undetermined.len(), found.freedom), (2, 0));
    assert!(found.misfit.1 < 1e-4, "{:?}", found.misfit);
}

/// Parameters that may be zero are no logarithms; how well they are known is judged by their size all the same.
#[test]
fn linear_parameters_are_judged_by_their_size() {
    let file = study(SERIES, None);
    let (data, u) = data_of_both(&file);
    let free = format!("{SECOND}=0 W/(m2 K)..1000 W/(m2 K)");
    let problem = problem(file, data, u, &[FIRST, &free]);
    assert!(!problem.free[1].is_logarithmic);
    let found = identify(&problem, &options(), &Silent).unwrap();
    // 8 W/(m2 K) of 600 are known well, although it is more than one.
    assert!(found.deviations[1] > 5.0 && found.undetermined.is_empty(), "{:?} {:?}", found.deviations, found.undetermined);
    assert!((found.values[1] / 600.0 - 1.0).abs() < 1e-4, "{:?}", found.values);
}

#[test]
fn bounds_hold_and_are_told() {
    let file = study(SERIES, None);
    let (data, u) = data_of_both(&file);
    let free = format!("{SECOND}=200 W/(m2 K)..550 W/(m2 K)");
    let found = identify(&problem(file, data, u, &[FIRST, &free]), &options(), &Silent).unwrap();
    assert!((found.values[1] - 550.0).abs() < 1e-9 && found.at_bound == [false, true], "{:?} {:?}", found.values, found.at_bound);
    // The motor is predicted 30/5.5 - 5 = 0.45 K too warm: both readings share it, their own errors being alike.
    let shared = 30.0 / (12.0 - 0.5 * (30.0 / 5.5 - 5.0));
    assert!((found.values[0] / shared - 1.0).abs() < 2e-4, "{:?}", found.values);
}

#[test]
fn a_prior_weighs_by_its_deviation() {
    // The reading says 5 W/K with 2.2 % (0.13 K of 6 K), the prior 4 W/K with 2 %: in logarithms the weighted mean.
    let file = study(SERIES, None);
    let (data, u) = data(&file, &["motor"], &rise(2.0, 5.0)[..1]);
    let prior = format!("{SECOND}=400 W/(m2 K) +- 8 W/(m2 K)");
    let problem = problem(file, data, u, &[&prior]);
    let found = identify(&problem, &options(), &Silent).unwrap();
    // Least of ((30/g - 6)/s)² + ((ln g - ln 4)/0.02)², by golden section.
    let s = ERRORS.iter().map(|e| e * e).sum::<f64>().sqrt();
    let cost = |g: f64| ((30.0 / g - 6.0) / s).powi(2) + ((g / 4.0).ln() / 0.02).powi(2);
    let (mut a, mut b) = (4.0, 5.0);
    for _ in 0..100 {
        let (c, d) = (b - 0.618_033_988_749_895 * (b - a), a + 0.618_033_988_749_895 * (b - a));
        if cost(c) < cost(d) { b = d } else { a = c }
    }
    assert!((found.values[0] / (100.0 * a) - 1.0).abs() < 1e-4, "{} {a}", found.values[0]);
    let expected = ((30.0 / a / s).powi(2) + 2500.0).powf(-0.5);
    assert!((found.deviations[0] / expected - 1.0).abs() < 1e-3, "{} {expected}", found.deviations[0]);
    // Nothing but the prior: it comes back.
    let file = study(SERIES, None);
    let (data, u) = data_of_both(&file);
    let prior = "node.motor.capacity=1200 J/K +- 60 J/K";
    let found = identify(&super::common::problem(file, data, u, &[prior]), &options(), &Silent).unwrap();
    assert!((found.values[0] - 1200.0).abs() < 0.1 && (found.deviations[0] - 0.05).abs() < 1e-6, "{found:?}");
}

#[test]
fn a_scan_is_least_at_the_planted_pair() {
    let file = study(SERIES, None);
    let (data, u) = data_of_both(&file);
    let problem = problem(file, data, u, &[]);
    let [first, second] = [FIRST, SECOND].map(|name| problem.study.parameter(name).unwrap());
    let along: Vec<f64> = (0..9).map(|i| 1.5 + 0.25 * f64::from(i)).collect();
    let across: Vec<f64> = (0..11).map(|i| 100.0 * f64::from(i)).collect();
    let found = scan(&problem, [(&first, along), (&second, across)], &Silent).unwrap();
    for table in [&found.misfit, &found.mean] {
        let (i, j) = MisfitScan::least(table);
        assert_eq!((found.axes[0][i], found.axes[1][j]), (2.5, 600.0));
        assert!(table[i][j] < 1e-6, "{}", table[i][j]);
    }
    // Without any conductance the source has no way out.
    assert!(found.misfit.iter().all(|row| row[0].is_nan() && row[1..].iter().all(|m| m.is_finite())));
    for (i, g1) in found.axes[0].iter().enumerate() {
        for (j, h2) in found.axes[1].iter().enumerate().skip(1) {
            for (k, rise) in rise(*g1, h2 / 100.0).iter().enumerate() {
                assert!((found.predictions[i][j][k] - AMBIENT - rise).abs() < 1e-6, "{g1} {h2}");
            }
        }
    }
    let twice = scan(&problem, [(&first, vec![1.0]), (&first, vec![1.0])], &Silent).unwrap_err();
    assert!(twice.to_string().contains("same parameter"), "{twice}");
}
