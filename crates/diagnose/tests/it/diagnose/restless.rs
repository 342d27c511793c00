//! Weeks of a lumped machine whose conditions never rest: readings are thinned, and still every turn drives the machine.

use coldplate_base::progress::Silent;
use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_diagnose::{Law, Problem, Scales, Verdict, diagnose, hypotheses, signatures};
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, ReadingRow, VariableUncertainty};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;

const NOISE: f64 = 0.05;

fn study(lines: &[(String, String)]) -> Study {
    let path = coldplate_testing::root().join("benches/evidence_speed/lumped.toml");
    Study::read(std::path::Path::new(&path), lines, None).unwrap()
}

/// Rows every 315 s for some days: the load is set anew every six hours, the hall has its day.
fn log(study: &Study, days: f64) -> Data {
    let machine = &study.model.machine;
    let place = |name: &str| machine.variables.iter().position(|v| v.name == name).unwrap();
    let (power, hall) = (place("power"), place("ambient_temperature"));
    let mut random = Random::new(3);
    let mut watts = 300.0;
    let row = |i: usize| {
        let time = 315.0 * i as f64;
        if i.is_multiple_of(69) {
            watts = 600.0 * random.unit();
        }
        let mut values: Vec<f64> = machine.variables.iter().map(|v| v.default.unwrap_or(0.0)).collect();
        values[power] = watts;
        values[hall] = 293.15 - 4.0 * (time / 2e6).cos() - 3.0 * (std::f64::consts::TAU * time / 86400.0).cos();
        ReadingRow {
            test: "weeks".into(),
            time: Some(time),
            condition: Condition::from_si(values),
            readings: vec![Some(300.0); 3],
            line: None,
        }
    };
    let rows = (0..(days * 86400.0 / 315.0) as usize).map(row).collect();
    Data {
        source: String::new(),
        sensors: vec![0, 1, 2],
        names: machine.sensors.iter().map(|s| s.name.clone()).collect(),
        rows,
        ..Data::default()
    }
}

/// The log with what a machine shows, and noise.
fn measured(study: &Study, data: &Data) -> Data {
    let values = identify::values(study, data, Start::Steady).unwrap();
    let mut random = Random::new(4);
    let mut measured = data.clone();
    for (row, values) in measured.rows.iter_mut().zip(values.chunks(3)) {
        row.readings = values.iter().map(|v| Some(v + NOISE * random.normal())).collect();
    }
    measured
}

fn uncertainty(data: &Data, study: &Study) -> MeasurementUncertainty {
    let usual = MeasurementUncertainty::usual(data, &study.model.machine);
    let variables = vec![VariableUncertainty::default(); usual.variables.len()];
    MeasurementUncertainty { noise: vec![NOISE; 3], bias: vec![0.01; 3], variables, timing: 0.0, ..usual }
}

/// What is left of 99 000 readings is 2400 of them at most, predicted as with every row within about their noise; the cause is named.
#[test]
fn weeks_are_thinned_and_the_cause_is_named() {
    let (file, every) = (study(&[]), log(&study(&[]), 120.0));
    let truth = study(&[("contact.bearing_housing.total_conductance".to_string(), "\"3 W/K\"".to_string())]);
    let data = measured(&truth, &every);
    let mut problem = Problem::new(file.clone(), data.clone()).thinned();
    problem.uncertainty = uncertainty(&problem.data, &file);
    assert!((1200..=2400).contains(&problem.data.count()), "{}", problem.data.count());
    assert!(problem.data.rows.len() * 2 < data.rows.len(), "{}", problem.data.rows.len());
    let (thin, all) =
        (identify::values(&file, &problem.data, Start::Steady).unwrap(), identify::values(&file, &data, Start::Steady).unwrap());
    let time = |row: &ReadingRow| row.time.unwrap();
    let read: Vec<usize> =
        problem.data.rows.iter().filter(|r| r.readings[0].is_some()).map(|r| data.rows.partition_point(|o| time(o) < time(r))).collect();
    let apart = |(r, own): (&usize, &[f64])| own.iter().zip(&all[3 * r..]).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
    let worst = read.iter().zip(thin.chunks(3)).map(apart).fold(0.0, f64::max);
    assert!(worst < 0.06, "thinned conditions change a prediction by {worst} K");
    let found = diagnose(&problem, &Silent).unwrap();
    let best = &found.explanations[0];
    let cause = best.causes.iter().find(|c| c.hypothesis.place == "bearing_housing").unwrap_or_else(|| panic!("{best:?}"));
    let (low, high) = cause.interval();
    assert!((low..=high).contains(&0.6f64.ln()), "{:?}", (low.exp(), high.exp()));
}

/// A contact that conducts much less bends: its slope leaves more than a sensor's gain does, which is straight, and yet it is the cause.
#[test]
fn a_contact_comes_before_the_gains_that_slopes_prefer() {
    let (file, every) = (study(&[]), log(&study(&[]), 30.0));
    let line = ("contact.bearing_housing.total_conductance".to_string(), "\"2 W/K\"".to_string());
    let mut problem = Problem::new(file.clone(), measured(&study(&[line]), &every)).thinned();
    problem.uncertainty = uncertainty(&problem.data, &file);
    let found = diagnose(&problem, &Silent).unwrap();
    let named: Vec<String> = found.rungs.iter().flat_map(|r| &r.causes).map(|c| c.hypothesis.kind_and_place()).collect();
    println!(
        "{:?} {:?} {:?} {:?}",
        found.verdict,
        found.is_vetoed,
        found.gain.as_ref().map(|g| (g.before, g.after, g.low)),
        found.explanations.iter().take(3).map(|e| (e.probability, e.misfit, &e.causes, e.level)).collect::<Vec<_>>()
    );
    assert_eq!(named, ["contact conductance at bearing_housing"], "{:?}", found.verdict);
    let (low, high) = found.rungs[0].causes[0].interval();
    assert!((low..=high).contains(&f64::ln(2.0 / 5.0)), "{:?}", (low.exp(), high.exp()));
    assert_eq!(found.verdict, Verdict::Explained);
    assert!(found.gain.unwrap().after < 0.1);
}

/// A motor that stands still throughout gives no law: nothing is in proportion to a speed over a largest speed of nothing.
#[test]
fn what_is_nothing_throughout_does_not_vary() {
    let file = study(&[]);
    let data = log(&file, 2.0);
    let scales = Scales::of(&data, &file.model.machine);
    let catalogue = hypotheses(&file, &data, &[]);
    assert!(!catalogue.is_empty());
    for h in &catalogue {
        assert!(!matches!(h.law, Law::Speed | Law::SpeedSquared | Law::InverseFlow), "{} at {}", h.kind(), h.place);
        let lines = h.sets(&file, &scales, &[], 0.5 * h.scale).unwrap_or_else(|e| panic!("{} at {}: {e}", h.kind(), h.place));
        let read = lines.map_or(Ok(file.clone()), |lines| file.edited(&lines));
        read.unwrap_or_else(|e| panic!("{} at {}, {}: {e}", h.kind(), h.place, h.law_words()));
    }
}

/// Effects are followed through hundreds of turns, not along a straight line across all of them.
#[test]
fn effects_are_followed_through_every_turn() {
    let (file, every) = (study(&[]), log(&study(&[]), 8.0));
    let data = measured(&file, &every);
    let catalogue = hypotheses(&file, &data, &[]);
    let scales = Scales::of(&data, &file.model.machine);
    let found = signatures(&file, &data, Start::Steady, &[], &catalogue, &scales, &[]).unwrap();
    let run = |sets: &[(String, String)]| identify::values(&file.edited(sets).ok()?, &data, Start::Steady).ok();
    let mut followed = 0;
    for (h, column) in catalogue.iter().zip(&found.columns).filter(|(h, _)| !h.is_sensor() && h.is_signed) {
        let at = |step: f64| h.sets(&file, &scales, &[], step).ok().flatten().and_then(|sets| run(&sets));
        let (Some(more), Some(less)) = (at(0.05 * h.scale), at(-0.05 * h.scale)) else { continue };
        let slope: Vec<f64> = more.iter().zip(&less).map(|(a, b)| (a - b) / (0.1 * h.scale)).collect();
        let norm = |v: &[f64]| v.iter().map(|s| s * s).sum::<f64>().sqrt();
        if norm(&slope) * h.scale < 0.5 {
            continue;
        }
        followed += 1;
        let apart: Vec<f64> = slope.iter().zip(column).map(|(a, b)| a - b).collect();
        assert!(norm(&apart) < 0.05 * norm(&slope), "{} at {}: {}", h.kind(), h.place, norm(&apart) / norm(&slope));
    }
    assert!(followed > 10, "{followed}");
}
