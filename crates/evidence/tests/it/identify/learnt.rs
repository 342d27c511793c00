//! Models that are wrong beside their parameters: what is learnt of their error, what sensors are not made to swallow, and what
//! data that were not used make of it, beside plain least squares.

use coldplate_base::progress::Silent;
use coldplate_base::units::Measurand;
use coldplate_evidence::identify::{Estimate, Free, IdentifyOptions, IdentifyProblem, identify_and_learn, values};
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, ReadingRow, VariableUncertainty, whiten};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;
use coldplate_testing::machines::SERIES;

use super::common::{Normal, condition, problem, study, table};

/// A motor in a shell that loses in proportion to its rise; everything is off by a factor of three.
const SHELL: &str = r#"
name = "a motor in a shell"
[node.room]
temperature = "ambient_temperature"
[node.shell]
capacity = "4500 J/K"
[node.motor]
capacity = "400 J/K"
[contact.loss]
between = ["room", "shell"]
total_conductance = "0.7 W/K"
[contact.fit]
between = ["shell", "motor"]
total_conductance = "12 W/K"
[source.motor]
in = "motor"
power = "0.03 * motor_speed_rpm"
[sensor.motor]
node = "motor"
[sensor.shell]
node = "shell"
"#;
const FREE: [&str; 4] = ["node.shell.capacity", "node.motor.capacity", "contact.loss.total_conductance", "contact.fit.total_conductance"];
/// Speed, rpm, in the first hour and after it, of tests to learn from and of tests that are not seen.
const SEEN: [[f64; 2]; 3] = [[2000.0, 500.0], [800.0, 2500.0], [3000.0, 0.0]];
const UNSEEN: [[f64; 2]; 2] = [[1500.0, 1500.0], [2700.0, 1000.0]];
const ROOM: f64 = 22.0 + 273.15;
/// What is stated: a third of the noise that there is, and each sensor's own error, K.
const STATED: [f64; 2] = [0.03, 0.1];

/// Motor and shell every two minutes for two hours, by Runge and Kutta's method: 1500 and 1200 J/K, 4 W/K between them, and a loss of
/// 1.1 W/K at 10 K that grows with the third root of the rise, of which the machine file knows nothing.
fn truth(speeds: [f64; 2]) -> Vec<(f64, f64, [f64; 2])> {
    let rate = |[motor, shell]: [f64; 2], speed: f64| -> [f64; 2] {
        let (between, rise) = (4.0 * (motor - shell), shell - ROOM);
        [(0.03 * speed - between) / 1200.0, (between - 1.1 * rise * (rise.abs() / 10.0).cbrt()) / 1500.0]
    };
    let mut now = [ROOM; 2];
    let mut rows = Vec::new();
    for second in 0..=7200 {
        let speed = if second < 3600 { speeds[0] } else { speeds[1] };
        if second % 120 == 0 {
            rows.push((f64::from(second), speed, now));
        }
        let after = |k: [f64; 2], h: f64| [now[0] + h * k[0], now[1] + h * k[1]];
        let a = rate(now, speed);
        let b = rate(after(a, 0.5), speed);
        let c = rate(after(b, 0.5), speed);
        let d = rate(after(c, 1.0), speed);
        now = [0, 1].map(|i| now[i] + (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]) / 6.0);
    }
    rows
}

fn log(study: &Study, tests: &[[f64; 2]], seed: u64) -> Data {
    let mut noise = Normal(seed);
    let bias = [0.1 * noise.next(), 0.1 * noise.next()];
    let mut rows = Vec::new();
    for (n, speeds) in tests.iter().enumerate() {
        for (time, speed, at) in truth(*speeds) {
            let readings = [0, 1].map(|k| Some(at[k] + bias[k] + 0.1 * noise.next())).to_vec();
            let test = format!("test {n}");
            // The speed is held from row to row.
            if time == 3600.0 {
                let before = condition(study, [2.0, 20.0, speeds[0], 22.0]);
                rows.push(ReadingRow { test: test.clone(), time: Some(3599.0), condition: before, readings: vec![None; 2], line: None });
            }
            rows.push(ReadingRow { test, time: Some(time), condition: condition(study, [2.0, 20.0, speed, 22.0]), readings, line: None });
        }
    }
    let sensors = ["motor", "shell"].map(|name| study.model.machine.sensors.iter().position(|s| s.name == name).unwrap());
    Data { source: "log".into(), sensors: sensors.to_vec(), names: vec!["motor".into(), "shell".into()], rows, ..Data::default() }
}

fn fitted(file: &Study, data: &Data, [noise, bias]: [f64; 2]) -> Estimate {
    let mut u = MeasurementUncertainty::usual(data, &file.model.machine);
    (u.noise, u.bias, u.timing) = (vec![noise; 2], vec![bias; 2], 0.0);
    u.variables = vec![VariableUncertainty::default(); 4];
    let free = FREE.iter().map(|name| Free::parse(name, file).unwrap()).collect();
    let problem = IdentifyProblem { study: file.clone(), data: data.clone(), uncertainty: u, free, start: Start::Uniform(ROOM) };
    identify_and_learn(&problem, &IdentifyOptions { starts: 1, seed: 1 }, &Silent).unwrap()
}

fn unseen(file: &Study, found: &Estimate, data: &Data) -> f64 {
    let parameters: Vec<_> = FREE.iter().map(|name| file.parameter(name).unwrap()).collect();
    let pairs: Vec<_> = parameters.iter().zip(found.values.iter().copied()).collect();
    let machine = file.with(&pairs).unwrap();
    whiten::rmse(&machine.model.machine, data, &values(&machine, data, Start::Uniform(ROOM)).unwrap(), Measurand::Temperature).unwrap()
}

#[test]
fn parameters_move_where_biases_would_swallow_what_a_wrong_model_leaves() {
    let file = study(SHELL, None);
    for seed in 1..=3 {
        let (seen, other) = (log(&file, &SEEN, seed), log(&file, &UNSEEN, 100 + seed));
        let found = fitted(&file, &seen, STATED);
        // Least squares: a noise so large that nothing is left to learn, and no sensor has an error of its own.
        let plain = fitted(&file, &seen, [30.0, 0.0]);
        assert!(plain.model_error.is_none(), "{:?}", plain.model_error);
        let (ours, theirs) = (unseen(&file, &found, &other), unseen(&file, &plain, &other));
        println!("unseen {ours:.3} K, plain least squares {theirs:.3} K; {:?} {:?}", found.model_error, found.sensor_errors);
        assert!(ours < 1.15 * theirs, "{ours} {theirs}");
        let learnt = found.model_error.expect("the stated errors do not explain a loss that is not linear");
        assert!(learnt.level.wandering > 0.1 && found.probability < 1e-6, "{learnt:?}");
        assert!(learnt.misfit < 2.0 * learnt.freedom as f64, "{learnt:?}");
        for e in &found.sensor_errors {
            // What they are itself is drawn with that deviation.
            assert!(e.value.abs() < 2.5 * e.stated, "{e:?}");
        }
        for (k, planted) in [(0, 1500.0), (1, 1200.0), (3, 4.0)] {
            let (low, high) = found.intervals[k];
            assert!((found.values[k] / planted - 1.0).abs() < 0.25 && high / low > 1.02, "{k}: {:?} {:?}", found.values, found.intervals);
            assert!(low < 1.05 * planted && high > 0.95 * planted, "{k}: {low} to {high}");
        }
    }
}

/// Where the stated errors explain what is left, nothing is learnt.
#[test]
fn nothing_is_learnt_where_the_stated_errors_explain_the_rest() {
    let file = study(SERIES, None);
    let free = ["contact.first.total_conductance", "contact.second.conductance"];
    let of = |middle: f64| {
        let row = |i: i32| {
            let room = 20.0 + f64::from(i);
            let readings = vec![Some(room + 17.0 + 273.15), Some(room + 12.0 + 273.15 + middle * (-1f64).powi(i))];
            (condition(&file, [2.0, 20.0, 1000.0, room]), readings)
        };
        let data = table(&file, &["motor", "middle"], &(0..6).map(row).collect::<Vec<_>>());
        let mut u = MeasurementUncertainty::usual(&data, &file.model.machine);
        u.variables = vec![VariableUncertainty::default(); 4];
        identify_and_learn(&problem(file.clone(), data, u, &free), &IdentifyOptions { starts: 1, seed: 1 }, &Silent).unwrap()
    };
    let (quiet, loud) = (of(0.05), of(1.5));
    assert!(quiet.model_error.is_none() && quiet.widened == 1.0 && quiet.probability > 0.05, "{quiet:?}");
    let learnt = loud.model_error.expect("readings that differ by 3 K where 0.1 K is stated");
    assert!(learnt.level.wandering > 0.5 && loud.probability < 1e-6, "{learnt:?}");
    // Intervals are those of an error of a kelvin, not of a tenth.
    assert!(loud.deviations[0] > 8.0 * quiet.deviations[0], "{:?} {:?}", loud.deviations, quiet.deviations);
}
