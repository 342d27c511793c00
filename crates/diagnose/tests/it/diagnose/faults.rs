//! Faulty readings are found, named by row and column, and left out; clean data and real effects stay as they are.

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_describe::machine::Condition;
use coldplate_diagnose::{Diagnosis, Problem, Verdict, diagnose};
use coldplate_evidence::faulty_readings::{Fault, FaultKind, cleared, find};
use coldplate_evidence::identify;
use coldplate_explore::simulate::Start;
use coldplate_testing::machines::SMALL;
use coldplate_testing::two_masses::{log, noisy};

use super::hidden::Hidden;

fn steady(lines: &[(&str, &str)], rows: usize, seed: u64) -> Problem {
    let machine = Document::parse(SMALL, "small.toml").unwrap();
    let conditions = Hidden::conditions(&machine, rows, seed, &[]);
    Hidden { machine: &machine, cells: (300, 500), lines, conditions, seed }.problem()
}

/// Row and sensor of what a table's answer sets aside, in their order.
fn aside(problem: &Problem, found: &Diagnosis) -> Vec<(Option<usize>, Option<String>)> {
    let mut all: Vec<_> = found.aside().iter().map(|own| (own.row, own.sensor.map(|k| problem.data.names[k].clone()))).collect();
    all.sort();
    all
}

fn names(faults: &[Fault]) -> Vec<(FaultKind, usize, Option<String>)> {
    faults.iter().map(|f| (f.kind, *f.rows.start(), f.sensor.clone())).collect()
}

/// 20 K too much in one reading of a log: found there and nowhere else, and all else as without it.
#[test]
fn a_spike_in_a_log() {
    let (study, mut data, uncertainty) = log(&[], 1);
    let clean = data.clone();
    data.rows[77].readings[1] = data.rows[77].readings[1].map(|t| t + 20.0);
    let found = cleared(&study, &data, &uncertainty, Start::Steady).unwrap();
    assert_eq!(names(&found.faults), [(FaultKind::WrongReading, 77, Some("nut".into()))], "{:#?}", found.faults);
    let text = found.faults[0].text();
    assert!(
        text.starts_with("row 78 (line 79), 'nut': ") && text.contains(" 20 K off its neighbours") && text.ends_with("left out"),
        "{text}"
    );
    assert_eq!(found.data.count(), data.count() - 1);
    let mut wanted = clean;
    wanted.rows[77].readings[1] = None;
    assert_eq!(found.data.rows, wanted.rows);
}

/// A spike on the model that has another cause as well: the cause is named as without it.
#[test]
fn a_cause_is_found_in_spite_of_a_spike() {
    let mut problem = steady(&[("source.hidden", "{ in = \"bracket\", power = \"6 W\" }")], 12, 3);
    problem.data.rows[5].readings[0] = Some(273.15 + 85.0);
    let found = diagnose(&problem, &Silent).unwrap();
    assert_eq!(aside(&problem, &found), [(Some(5), Some(problem.data.names[0].clone()))]);
    let best = &found.explanations[0].causes[0].hypothesis;
    assert!(matches!(found.verdict, Verdict::Explained | Verdict::CannotTell), "{:?}", found.verdict);
    assert_eq!((best.kind(), best.place.as_str()), ("heat source", "bracket"));
}

/// A sensor that stops, and shows its last value for twenty minutes.
#[test]
fn a_stuck_sensor() {
    let (study, mut data, uncertainty) = log(&[], 2);
    let last = data.rows[100].readings[0];
    (100..118).for_each(|r| data.rows[r].readings[0] = last);
    let found = cleared(&study, &data, &uncertainty, Start::Steady).unwrap();
    assert_eq!(names(&found.faults), [(FaultKind::StuckSensor, 100, Some("motor".into()))], "{:#?}", found.faults);
    assert_eq!(*found.faults[0].rows.end(), 117);
    assert_eq!(found.data.count(), data.count() - 18);
}

/// A sensor that stops early in a log and never moves again is no sensor, however many readings that are.
#[test]
fn a_sensor_that_stops_for_good() {
    let (study, mut data, uncertainty) = log(&[], 2);
    let last = data.rows[40].readings[0];
    (40..181).for_each(|r| data.rows[r].readings[0] = last);
    let found = cleared(&study, &data, &uncertainty, Start::Steady).unwrap();
    assert!(
        !found.faults.is_empty() && found.faults.iter().all(|f| f.kind == FaultKind::StuckSensor && f.is_left_out),
        "{:#?}",
        found.faults
    );
    assert!(found.data.count() <= data.count() - 135, "{} of {}", found.data.count(), data.count());
    assert!(found.data.rows.iter().all(|row| row.readings[1].is_some() && row.readings[2].is_some()));
}

/// Two wrong readings of one sensor in a table hide each other from a look at one after the other.
#[test]
fn two_wrong_readings_of_one_sensor() {
    let mut problem = steady(&[], 12, 6);
    for (r, off) in [(3, 14.0), (8, -11.0)] {
        problem.data.rows[r].readings[2] = problem.data.rows[r].readings[2].map(|t| t + off);
    }
    let sensor = Some(problem.data.names[2].clone());
    let found = diagnose(&problem, &Silent).unwrap();
    assert_eq!(aside(&problem, &found), [(Some(3), sensor.clone()), (Some(8), sensor)]);
    assert_ne!(found.verdict, Verdict::Explained, "{:?}", found.level);
}

/// The row of a table with the largest value of a variable.
fn last(problem: &Problem, variable: &str) -> usize {
    let v = problem.study.model.machine.variables.iter().position(|own| own.name == variable).unwrap();
    let at = |r: &usize| problem.data.rows[*r].condition.si()[v];
    (0..problem.data.rows.len()).max_by(|a, b| at(a).total_cmp(&at(b))).unwrap()
}

/// One sensor at the end of a range: wrong where no cause makes it, by itself and beside a cause that is found all the same.
#[test]
fn a_reading_at_the_end_of_a_range_that_no_cause_makes() {
    for (lines, named) in [(&[][..], None), (&[("contact.foot.conductance", "\"120 W/(m2 K)\"")][..], Some("contact conductance at foot"))]
    {
        let mut problem = steady(lines, 12, 6);
        let row = last(&problem, "motor_speed");
        problem.data.rows[row].readings[2] = problem.data.rows[row].readings[2].map(|t| t + 1.2);
        let sensor = problem.data.names[2].clone();
        let found = diagnose(&problem, &Silent).unwrap();
        assert_eq!(aside(&problem, &found), [(Some(row), Some(sensor))], "{named:?}");
        match named {
            None => assert_eq!(found.verdict, Verdict::Consistent),
            Some(named) => assert_eq!(found.explanations[0].causes[0].hypothesis.kind_and_place(), named),
        }
    }
}

/// Five rows, one of them read at the conditions of another: it is found, and no cause is blamed for it. Whether heats of another level in every
/// test are to blame for a part of it, so few rows do not tell.
#[test]
fn a_wrong_row_of_five() {
    let mut problem = steady(&[], 5, 9);
    let row = last(&problem, "motor_speed");
    problem.data.rows[row].condition = problem.data.rows[(row + 1) % 5].condition.clone();
    let found = diagnose(&problem, &Silent).unwrap();
    assert_eq!(aside(&problem, &found), [(Some(row), None)]);
    assert!(!found.verdict.names_causes(), "{:?}", found.verdict);
}

/// A sensor without a cable: 85 degC in every row, in a table and in a log.
#[test]
fn a_dead_sensor() {
    let (study, mut data, uncertainty) = log(&[], 3);
    data.rows.iter_mut().for_each(|row| row.readings[2] = Some(273.15 + 999.0));
    let found = cleared(&study, &data, &uncertainty, Start::Steady).unwrap();
    assert_eq!(names(&found.faults), [(FaultKind::DeadSensor, 0, Some("foot".into()))], "{:#?}", found.faults);
    assert!(found.faults[0].text().contains("dead, 999.0 degC in all 181 readings"));
    let mut problem = steady(&[], 10, 4);
    problem.data.rows.iter_mut().for_each(|row| row.readings[3] = Some(273.15));
    let found = diagnose(&problem, &Silent).unwrap();
    assert_eq!(aside(&problem, &found), [(None, Some(problem.data.names[3].clone()))]);
    assert_eq!(found.verdict, Verdict::Consistent);
}

/// The flow of one row, typed with two digits exchanged.
#[test]
fn a_wrong_row_of_conditions() {
    let mut problem = steady(&[], 14, 5);
    let flow = problem.study.model.machine.variables.iter().position(|v| v.name == "coolant_flow").unwrap();
    let row = 6;
    let mut si = problem.data.rows[row].condition.si().to_vec();
    si[flow] *= if si[flow] * 60_000.0 > 5.0 { 0.3 } else { 2.6 };
    problem.data.rows[row].condition = Condition::from_si(si);
    let found = diagnose(&problem, &Silent).unwrap();
    // Another flow in that row is a cause by itself.
    let of_flow = || found.explanations.first().is_some_and(|e| e.causes.iter().any(|c| c.hypothesis.kind().contains("flow")));
    assert!(aside(&problem, &found) == [(Some(row), None)] || of_flow(), "{:?} {:?}", found.verdict, found.level);
}

/// A row between all others that was read at quite other conditions is set aside.
#[test]
fn a_row_of_other_conditions() {
    // Between others in every variable, but read at the conditions of another day.
    let mut problem = steady(&[], 16, 9);
    let conditions: Vec<Vec<f64>> = problem.data.rows.iter().map(|row| row.condition.si().to_vec()).collect();
    let is_inside = |r: &usize| {
        (0..4).all(|v| {
            let others = || conditions.iter().enumerate().filter(|(other, _)| other != r).map(|(_, si)| si[v]);
            others().any(|o| o <= conditions[*r][v]) && others().any(|o| o >= conditions[*r][v])
        })
    };
    let row = (0..16).find(is_inside).unwrap();
    let other =
        (0..16).max_by(|a, b| (conditions[*a][2] - conditions[row][2]).abs().total_cmp(&(conditions[*b][2] - conditions[row][2]).abs()));
    problem.data.rows[row].readings = problem.data.rows[other.unwrap()].readings.iter().map(|t| t.map(|t| t + 0.01)).collect();
    let found = diagnose(&problem, &Silent).unwrap();
    assert_eq!(aside(&problem, &found), [(Some(row), None)]);
    assert_eq!(found.verdict, Verdict::Consistent);
}

/// The same test copied twice counts once; a test that was really repeated stays.
#[test]
fn duplicate_rows() {
    let mut problem = steady(&[], 8, 6);
    let copy = problem.data.rows[2].clone();
    problem.data.rows.extend([copy.clone(), copy.clone()]);
    let mut repeated = copy;
    repeated.readings.iter_mut().flatten().for_each(|t| *t += 0.01);
    problem.data.rows.push(repeated);
    let problem = problem.cleared().unwrap();
    assert_eq!(names(&problem.faults), [(FaultKind::DuplicateRow, 8, None), (FaultKind::DuplicateRow, 9, None)]);
    assert_eq!(problem.data.rows.len(), 9);
}

/// Nothing is found in clean data, nor where the machine itself is wrong: fronts, a missing link, a slow sensor, wrong noise.
#[test]
fn clean_data_and_real_effects_stay() {
    let effects: [&[(&str, &str)]; 6] = [
        &[],
        &[("contact.motor_nut.total_conductance", "\"0.2 W/K\"")],
        &[("node.nut.capacity", "\"20 J/K\"")],
        &[("sensor.motor.lag", "\"60 s\"")],
        &[("source.motor.power", "\"0.04 * motor_speed_rpm\"")],
        &[("node.motor.capacity", "\"15 J/K\""), ("sensor.nut.lag", "\"5 s\"")],
    ];
    for (i, lines) in effects.iter().enumerate() {
        for scale in [0.5, 1.0, 2.0] {
            let (study, data, mut uncertainty) = log(lines, 10 + i as u64);
            uncertainty.noise.iter_mut().for_each(|noise| *noise *= scale);
            let found = cleared(&study, &data, &uncertainty, Start::Steady).unwrap();
            assert!(found.faults.is_empty() && found.data == data, "{lines:?} {scale}: {:#?}", found.faults);
        }
    }
}

/// Fewer than one false alarm in a thousand tables of noise.
#[test]
fn noise_is_no_fault() {
    let (study, log, uncertainty) = log(&[], 30);
    let predicted = identify::values(&study, &log, Start::Steady).unwrap();
    let table = steady(&[], 12, 31);
    let told = identify::values(&table.study, &table.data, Start::Steady).unwrap();
    let mut alarms = 0;
    for seed in 0..1000 {
        let (mut one, mut other) = (log.clone(), table.data.clone());
        noisy(&mut one, &predicted, 1000 + seed);
        noisy(&mut other, &told, 3000 + seed);
        alarms += find(&one, &predicted, &uncertainty.noise).len() + find(&other, &told, &table.uncertainty.noise).len();
    }
    assert_eq!(alarms, 0);
}
