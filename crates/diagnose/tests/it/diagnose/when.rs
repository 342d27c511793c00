//! Causes that act in some tests only, or on the way down: named with their test, written with formulas that need it, found in tables and in
//! logs, and never called where all tests are alike.

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_diagnose::{Diagnosis, Problem, Verdict, diagnose, sentence};
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, ReadingRow};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;

use crate::diagnose::logs;

/// A spindle on a column in a room.
const MACHINE: &str = r#"
name = "Spindle on a column"
[node.room]
temperature = "ambient_temperature"
[node.spindle]
capacity = "300 J/K"
[node.column]
capacity = "900 J/K"
[contact.flange]
between = ["spindle", "column"]
total_conductance = "2 W/K"
[contact.feet]
between = ["column", "room"]
total_conductance = "1.5 W/K"
[source.bearing]
in = "spindle"
power = "0.02 * motor_speed_rpm"
[sensor.spindle]
node = "spindle"
[sensor.column]
node = "column"
"#;

/// Up and down again, in rpm.
const SPEEDS: [f64; 8] = [500.0, 1200.0, 1900.0, 2500.0, 2100.0, 1400.0, 700.0, 300.0];
const TESTS: [&str; 4] = ["monday", "tuesday", "wednesday", "thursday"];

/// What is found in four tests whose truth has other lines in some rows, and a sensor that is off in some.
fn found(seed: u64, lines: &[(&str, &str)], acts: impl Fn(usize, usize) -> bool, spindle_off: f64) -> Diagnosis {
    let machine = Document::parse(MACHINE, "spindle.toml").unwrap();
    let mut other = machine.clone();
    lines.iter().for_each(|(key, value)| other.apply_set(key, value).unwrap());
    let (study, other) = (Study::new(machine, None).unwrap(), Study::new(other, None).unwrap());
    let mut random = Random::new(seed);
    let mut rows = Vec::new();
    for (t, test) in TESTS.iter().enumerate() {
        for (i, rpm) in SPEEDS.iter().enumerate() {
            let value = |name: &str| match name {
                "motor_speed" => rpm * (1.0 - 0.05 * t as f64) * std::f64::consts::TAU / 60.0,
                "ambient_temperature" => 290.15 + 10.0 * random.unit(),
                "coolant_temperature" => 293.15,
                _ => 1e-4,
            };
            let mut value = value;
            let si = study.model.machine.variables.iter().map(|v| value(&v.name)).collect();
            let own = acts(t, i);
            rows.push((
                own,
                ReadingRow {
                    test: (*test).into(),
                    time: None,
                    condition: Condition::from_si(si),
                    readings: vec![Some(300.0); 2],
                    line: None,
                },
            ));
        }
    }
    let (acting, rows): (Vec<bool>, Vec<ReadingRow>) = rows.into_iter().unzip();
    let names = vec!["spindle".into(), "column".into()];
    let mut data = Data { source: "a table".into(), sensors: vec![0, 1], names, rows, ..Data::default() };
    let [usual, otherwise] = [&study, &other].map(|study| identify::values(study, &data, Start::Steady).unwrap());
    for (r, row) in data.rows.iter_mut().enumerate() {
        let values = if acting[r] { &otherwise } else { &usual };
        let off = if acting[r] { spindle_off } else { 0.0 };
        row.readings = (0..2).map(|k| Some(values[2 * r + k] + if k == 0 { off } else { 0.0 } + 0.05 * random.normal())).collect();
    }
    let mut uncertainty = MeasurementUncertainty::usual(&data, &study.model.machine);
    (uncertainty.noise, uncertainty.bias) = (vec![0.05; 2], vec![0.03; 2]);
    let mut problem = Problem::new(study, data);
    problem.uncertainty = uncertainty;
    let found = diagnose(&problem.timed().unwrap(), &Silent).unwrap();
    println!("{:?} {:?}", found.verdict, found.gain.as_ref().map(|g| (g.before, g.after)));
    for e in found.explanations.iter().take(5) {
        println!("{:.3} {:.1} {}", e.probability, e.misfit, e.causes.iter().map(sentence).collect::<Vec<_>>().join("; "));
    }
    found
}

fn best(found: &Diagnosis) -> (&str, &str, String) {
    let cause = &found.explanations[0].causes[0];
    assert_eq!(found.explanations[0].causes.len(), 1);
    (cause.hypothesis.kind(), &cause.hypothesis.place, cause.hypothesis.law_words())
}

#[test]
fn a_contact_in_one_of_four_tests() {
    let found = found(1, &[("contact.feet.total_conductance", "0.9 W/K")], |t, _| t == 2, 0.0);
    assert!(matches!(found.verdict, Verdict::Explained | Verdict::CannotTell));
    assert_eq!(best(&found), ("contact conductance", "feet", "only in the test 'wednesday'".into()));
    let lines = found.sets.as_ref().unwrap();
    assert!(lines.iter().any(|(key, value)| key == "contact.feet.factor" && value.contains("abs(test_number - 3)")), "{lines:?}");
    let amplitude = found.explanations[0].causes[0].amplitude;
    assert!((amplitude - 0.6f64.ln()).abs() < 0.05, "{amplitude}");
    let gain = found.gain.unwrap();
    assert!(gain.after < 0.3 * gain.before, "{gain:?}");
}

#[test]
fn a_sensor_that_was_put_back_otherwise() {
    let found = found(2, &[], |t, _| t >= 2, 0.8);
    assert_eq!(best(&found), ("sensor offset", "spindle", "from the test 'wednesday' on".into()));
    assert!(found.gain.as_ref().is_some_and(|gain| gain.after < 0.5 * gain.before), "{:?}", found.gain);
}

/// The flange closes as the spindle warms, and stays closed as it cools.
#[test]
fn a_contact_with_hysteresis() {
    let found = found(3, &[("contact.flange.total_conductance", "3.4 W/K")], |_, i| i >= 4, 0.0);
    assert_eq!(best(&found), ("contact conductance", "flange", "only where motor speed has fallen".into()));
    let lines = found.sets.as_ref().unwrap();
    assert!(lines.iter().any(|(_, value)| value.contains("motor_speed_fallen")), "{lines:?}");
}

/// 12 W into the gear in one of three logs.
#[test]
fn a_heat_in_one_of_three_logs() {
    let number = ("variables.test_number".to_string(), "{ unit = \"1\", default = \"0\" }".to_string());
    let heat = "{ in = [\"gear\"], power = \"12 * max(0, 1 - abs(test_number - 2))\" }";
    let lines = vec![number, ("source.hidden".to_string(), heat.to_string())];
    let found = logs::found(51, &logs::Hidden { lines, ..logs::Hidden::default() });
    println!("{}", logs::told(51, &found));
    assert_eq!(best(&found), ("heat source", "gear", "only in the test 'log 2'".into()));
    let amplitude = found.explanations[0].causes[0].amplitude;
    assert!((amplitude - 12.0).abs() < 1.5, "{amplitude}");
    assert!(found.gain.is_some_and(|gain| gain.after < 0.7 * gain.before));
}

/// What acts in all tests is no matter of one of them, and clean tests raise no alarm.
#[test]
fn all_tests_alike() {
    for seed in 1..=6 {
        let clean = found(10 + seed, &[], |_, _| false, 0.0);
        assert_eq!(clean.verdict, Verdict::Consistent);
        let all = found(20 + seed, &[("contact.feet.total_conductance", "1.2 W/K")], |_, _| true, 0.0);
        assert_eq!(best(&all), ("contact conductance", "feet", "constant".into()));
    }
}
