//! What all members of a kind share, and paths for heat to what has a given temperature.

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_diagnose::{Diagnosis, Law, Problem, Scales, Verdict, diagnose, hypotheses, sentence};
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, ReadingRow};
use coldplate_explore::simulate::Start;
use coldplate_solve::sensitivity::UncertainNumber;
use coldplate_solve::study::{StateTables, Study};
use coldplate_testing::machines::SMALL;

use super::hidden::Hidden;

fn shown(found: &Diagnosis) {
    println!("{:?} {:?}", found.verdict, found.level);
    for e in found.explanations.iter().take(6) {
        let words: Vec<String> = e.causes.iter().map(sentence).collect();
        println!("{:.3} {:.1} {}", e.probability, e.misfit, words.join("; "));
    }
}

fn is_in_set(found: &Diagnosis, kind: &str, place: &str) -> bool {
    let is = |i: &usize| found.explanations[*i].causes.iter().any(|c| c.hypothesis.kind() == kind && c.hypothesis.place == place);
    found.set.iter().any(is)
}

/// Every source gives 1.5 times what the file says: one cause, not three.
#[test]
fn all_heats() {
    let machine = Document::parse(SMALL, "small.toml").unwrap();
    let lines = [
        ("source.motor.power", "\"0.054 * motor_speed_rpm\""),
        ("source.gear.power", "\"0.024 * motor_speed_rpm\""),
        ("source.bearing.power", "\"0.0024 * motor_speed_rpm\""),
    ];
    let conditions = Hidden::conditions(&machine, 14, 21, &[]);
    let found = diagnose(&Hidden { machine: &machine, cells: (300, 500), lines: &lines, conditions, seed: 22 }.problem(), &Silent).unwrap();
    shown(&found);
    let best = &found.explanations[0].causes[0];
    assert!(matches!(found.verdict, Verdict::Explained | Verdict::CannotTell));
    assert_eq!((best.hypothesis.kind(), found.explanations[0].causes.len()), ("all heats", 1));
    let (low, high) = best.interval();
    assert!(low < 0.5 && 0.5 < high && low > 0.35, "{low} {high}");
    assert!(sentence(best).starts_with("all heats are 1."), "{}", sentence(best));
    let sets = found.sets.unwrap();
    assert!(lines.iter().all(|(key, _)| sets.iter().any(|(own, _)| own == key)), "{sets:?}");
}

/// The motor's contact is twice as good, and every source gives a twenty-fifth more than the file says: within what heats are taken to be
/// off by, so no cause of its own. The machine that is written has it all the same, whether or not some other number is stated as
/// uncertain.
#[test]
fn what_all_heats_share_is_written_beside_a_cause() {
    heats_are_written_beside_a_cause(None);
    heats_are_written_beside_a_cause(Some("contact.foot.conductance"));
}

fn heats_are_written_beside_a_cause(uncertain: Option<&str>) {
    let machine = Document::parse(SMALL, "small.toml").unwrap();
    let lines = [
        ("contact.motor.conductance", "\"1000 W/(m2 K)\""),
        ("source.motor.power", "\"0.03744 * motor_speed_rpm\""),
        ("source.gear.power", "\"0.01664 * motor_speed_rpm\""),
        ("source.bearing.power", "\"0.001664 * motor_speed_rpm\""),
    ];
    let conditions = Hidden::conditions(&machine, 14, 61, &[]);
    let mut problem = Hidden { machine: &machine, cells: (300, 10_000), lines: &lines, conditions, seed: 62 }.problem();
    if let Some(name) = uncertain {
        let parameter = problem.study.parameter(name).unwrap();
        problem.uncertain = vec![UncertainNumber { deviation: 0.1 * parameter.value, parameter, limits: None }];
    }
    let found = diagnose(&problem, &Silent).unwrap();
    shown(&found);
    let rung = &found.rungs[0];
    assert_eq!(rung.causes[0].hypothesis.kind_and_place(), "contact conductance at motor");
    let heats = rung.refitted.iter().find(|c| c.hypothesis.kind() == "all heats").unwrap_or_else(|| panic!("{:?}", rung.refitted));
    let (low, high) = heats.interval();
    println!("all heats {:.4} ({low:.4} to {high:.4})", heats.amplitude);
    assert!(low < 0.04 && 0.04 < high && low > 0.0, "{low} {high}");
    let members = rung.causes.len() + rung.refitted.len();
    assert!(rung.correlations.len() == members && rung.correlations.iter().all(|row| row.len() == members), "{:?}", rung.correlations);
    assert!(rung.correlations.iter().enumerate().all(|(i, row)| (row[i] - 1.0).abs() < 1e-9), "{:?}", rung.correlations);
    let sets = found.sets.unwrap();
    assert!(lines.iter().all(|(key, _)| sets.iter().any(|(own, _)| own == key)), "{sets:?}");
}

/// The scanner shows 0.6 K too much everywhere.
#[test]
fn all_sensors() {
    let machine = Document::parse(SMALL, "small.toml").unwrap();
    let conditions = Hidden::conditions(&machine, 12, 23, &[]);
    let mut problem = Hidden { machine: &machine, cells: (300, 500), lines: &[], conditions, seed: 24 }.problem();
    problem.data.rows.iter_mut().flat_map(|row| row.readings.iter_mut().flatten()).for_each(|t| *t += 0.6);
    let found = diagnose(&problem, &Silent).unwrap();
    shown(&found);
    assert!(is_in_set(&found, "all sensors", "all sensors"));
}

/// Two masses in air, and a cold head of its own temperature.
const LUMPED: &str = r#"
name = "Two masses and a cold head"
[node.room]
temperature = "ambient_temperature"
[node.head]
temperature = "coolant_temperature"
[node.motor]
capacity = "300 J/K"
[node.nut]
capacity = "150 J/K"
[contact.motor_nut]
between = ["motor", "nut"]
total_conductance = "0.8 W/K"
[contact.motor_room]
between = ["motor", "room"]
total_conductance = "1 W/K"
[contact.motor_head]
between = ["motor", "head"]
total_conductance = "0.3 W/K"
[source.motor]
in = "motor"
power = "0.02 * motor_speed_rpm"
[sensor.motor]
node = "motor"
[sensor.nut]
node = "nut"
"#;

pub(super) fn lumped(lines: &[(&str, &str)], seed: u64) -> Problem {
    let machine = Document::parse(LUMPED, "lumped.toml").unwrap();
    let mut truth = machine.clone();
    lines.iter().for_each(|(key, value)| truth.apply_set(key, value).unwrap());
    let (study, truth) = (Study::new(machine, None).unwrap(), Study::new(truth, None).unwrap());
    let mut random = Random::new(seed);
    let rpm = std::f64::consts::TAU / 60.0;
    let mut row = |i: usize| ReadingRow {
        test: format!("test {i}"),
        time: None,
        condition: Condition::from_si(vec![
            6e-5,
            278.15 + 20.0 * random.unit(),
            (200.0 + 2800.0 * random.unit()) * rpm,
            288.15 + 14.0 * random.unit(),
        ]),
        readings: vec![Some(300.0); 2],
        line: None,
    };
    let mut data = Data {
        source: "a table".into(),
        sensors: vec![0, 1],
        names: vec!["motor".into(), "nut".into()],
        rows: (1..=20).map(&mut row).collect(),
        ..Data::default()
    };
    let values = identify::values(&truth, &data, Start::Steady).unwrap();
    for (row, values) in data.rows.iter_mut().zip(values.chunks(2)) {
        row.readings = values.iter().map(|v| Some(v + 0.03 * random.normal())).collect();
    }
    let mut uncertainty = MeasurementUncertainty::usual(&data, &study.model.machine);
    (uncertainty.noise, uncertainty.bias) = (vec![0.03; 2], vec![0.03; 2]);
    let mut problem = Problem::new(study, data);
    problem.uncertainty = uncertainty;
    problem
}

/// A hose from the nut to the cold head, which has a temperature of its own: neither a leak to the room nor a contact.
#[test]
fn a_link_to_a_given_temperature() {
    let found =
        diagnose(&lumped(&[("contact.hose", "{ between = [\"nut\", \"head\"], total_conductance = \"0.4 W/K\" }")], 31), &Silent).unwrap();
    shown(&found);
    let best = &found.explanations[0].causes[0];
    assert_eq!((best.hypothesis.kind(), best.hypothesis.place.as_str()), ("conductive link", "nut - head"));
    let (low, high) = best.interval();
    assert!(low < 0.4 && 0.4 < high && low > 0.3, "{low} {high}");
}

/// What is added to a machine may be many times what is usual: paths of four and seven of their priors' standard deviations are found whole,
/// by themselves.
#[test]
fn paths_that_conduct_much() {
    for (line, kind, place, amplitude) in [
        ("{ between = [\"nut\", \"room\"], total_conductance = \"1.2 W/K\" }", "leak to the surroundings", "nut", 1.2),
        ("{ between = [\"nut\", \"head\"], total_conductance = \"2 W/K\" }", "conductive link", "nut - head", 2.0),
    ] {
        let found = diagnose(&lumped(&[("contact.hose", line)], 34), &Silent).unwrap();
        shown(&found);
        let [cause] = &found.explanations[0].causes[..] else { panic!("more than one cause: {:?}", found.level) };
        assert_eq!((found.verdict, cause.hypothesis.kind(), cause.hypothesis.place.as_str()), (Verdict::Explained, kind, place));
        let (low, high) = cause.interval();
        assert!(low < amplitude && amplitude < high && high - low < 0.1 * amplitude, "{low} {high}");
    }
}

/// The nut loses heat by free convection, which grows with the power 1.25 of the difference.
#[test]
fn free_convection_of_a_node() {
    let loss = "{ node = \"nut\", area = \"0.05 m2\", free_convection = \"vertical_plate\", length = \"100 mm\" }";
    let found = diagnose(&lumped(&[("boundary.loss", loss)], 32), &Silent).unwrap();
    shown(&found);
    assert!(is_in_set(&found, "free convection", "nut"), "{:?}", found.verdict);
}

/// Derivatives of all causes of the machine of lumped nodes are those of their lines.
#[test]
fn derivatives_of_lumped_causes() {
    let problem = lumped(&[], 33);
    // Differences ask for more than the reduced model gives.
    let study = &problem.study.clone().with_tables(StateTables::InFull);
    let data = &problem.data;
    let scales = Scales::of(data, &study.model.machine);
    let all = hypotheses(study, data, &[]);
    let found = coldplate_diagnose::signatures(study, data, Start::Steady, &[], &all, &scales, &[]).unwrap();
    let mut seen = Vec::new();
    for (h, column) in all.iter().zip(&found.columns).filter(|(h, _)| !h.is_sensor() && h.law == Law::Constant) {
        let step = 1e-3 * h.scale;
        let run = |amplitude: f64| -> Vec<f64> {
            let sets = h.sets(study, &scales, &[], amplitude).unwrap().unwrap();
            identify::values(&study.edited(&sets).unwrap_or_else(|e| panic!("{h:?}: {e}")), data, Start::Steady).unwrap()
        };
        let (near, far) = (run(step), run(2.0 * step));
        let base = &found.prediction.values;
        let slope = near.iter().zip(&far).zip(base).map(|((n, f), b)| (4.0 * (n - b) - (f - b)) / (2.0 * step));
        let (off, size) =
            slope.zip(column).fold((0.0f64, 0.0f64), |(off, size), (slope, c)| (off.max((slope - c).abs()), size.max(slope.abs())));
        assert!(off < 1e-3 * size + 1e-6 / h.scale, "{} at {}: {off:e} of {size:e}", h.kind(), h.place);
        seen.push(h.kind());
    }
    for kind in ["free convection", "radiation to the surroundings", "conductive link", "all contacts"] {
        assert!(seen.contains(&kind), "{kind}: {seen:?}");
    }
}

/// A machine file takes the lines of every cause, also where one circuit feeds another.
#[test]
fn causes_of_circuits_in_series() {
    let path = coldplate_testing::root().join("benches/diagnosis/machines/spindle.toml");
    let study = Study::new(Document::read(path).unwrap(), Some(200)).unwrap();
    let machine = &study.model.machine;
    let row = |i: usize| ReadingRow {
        test: format!("test {i}"),
        time: None,
        condition: machine.condition(&[("motor_speed", &format!("{} rpm", 1000 * i)), ("coolant_flow", &format!("{i} L/min"))]).unwrap(),
        readings: vec![Some(300.0); machine.sensors.len()],
        line: None,
    };
    let data = Data {
        source: "a table".into(),
        sensors: (0..machine.sensors.len()).collect(),
        names: machine.sensors.iter().map(|s| s.name.clone()).collect(),
        rows: (2..6).map(row).collect(),
        ..Data::default()
    };
    let scales = Scales::of(&data, machine);
    for h in hypotheses(&study, &data, &[]) {
        if let Some(sets) = h.sets(&study, &scales, &[], 0.1 * h.scale).unwrap() {
            study.edited(&sets).unwrap_or_else(|e| panic!("{} at {}: {e}", h.kind(), h.place));
        }
    }
}
