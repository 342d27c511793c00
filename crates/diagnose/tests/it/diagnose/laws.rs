//! Laws by the machine's own variables: any that varies, in proportion, squared, inverse, and above a threshold.

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_diagnose::{Explanation, Law, LawForm, Problem, Scales, Verdict, diagnose, hypotheses, sentence};
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, ReadingRow};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;
use coldplate_testing::machines::SMALL;

use super::hidden::Hidden;

/// A winding and a housing in a room; what drives them is a load, and a valve that opens.
const MACHINE: &str = r#"
name = "Winding and housing"
[variables.load]
unit = "W"
default = "5 W"
range = ["0 W", "10 W"]
[variables.valve]
unit = "1"
default = "0"
range = ["0", "4"]
[node.room]
temperature = "ambient_temperature"
[node.winding]
capacity = "300 J/K"
[node.housing]
capacity = "900 J/K"
[contact.slot]
between = ["winding", "housing"]
total_conductance = "2 W/K"
[contact.feet]
between = ["housing", "room"]
total_conductance = "1.5 W/K"
[source.winding]
in = "winding"
power = "4 * load_W"
[sensor.winding]
node = "winding"
[sensor.housing]
node = "housing"
"#;

fn problem(lines: &[(&str, &str)], seed: u64) -> Problem {
    let machine = Document::parse(MACHINE, "winding.toml").unwrap();
    let mut truth = machine.clone();
    lines.iter().for_each(|(key, value)| truth.apply_set(key, value).unwrap());
    let (study, truth) = (Study::new(machine, None).unwrap(), Study::new(truth, None).unwrap());
    let mut random = Random::new(seed);
    let mut row = |i: usize| {
        let own = |name: &str, random: &mut Random| match name {
            "load" => 1.0 + 9.0 * random.unit(),
            "valve" => [0.0, 1.0, 2.0, 4.0][i % 4],
            "ambient_temperature" => 290.15 + 10.0 * random.unit(),
            "coolant_temperature" => 293.15,
            _ => 1e-4,
        };
        let si = study.model.machine.variables.iter().map(|v| own(&v.name, &mut random)).collect();
        ReadingRow { test: format!("test {i}"), time: None, condition: Condition::from_si(si), readings: vec![Some(300.0); 2], line: None }
    };
    let rows = (0..24).map(&mut row).collect();
    let mut data =
        Data { source: "a table".into(), sensors: vec![0, 1], names: vec!["winding".into(), "housing".into()], rows, ..Data::default() };
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

fn named(lines: &[(&str, &str)], seed: u64) -> (Verdict, String, String, Vec<(String, String)>) {
    let found = diagnose(&problem(lines, seed), &Silent).unwrap();
    for e in found.explanations.iter().take(5) {
        println!("{:.3} {:.1} {}", e.probability, e.misfit, e.causes.iter().map(sentence).collect::<Vec<_>>().join("; "));
    }
    let best = &found.explanations[0].causes[0];
    (found.verdict, best.hypothesis.place.clone(), best.hypothesis.law_words(), found.sets.unwrap())
}

/// Iron in the housing that warms with the square of the load.
#[test]
fn heat_with_the_square_of_a_load() {
    let (verdict, place, law, sets) = named(&[("source.hidden", "{ in = \"housing\", power = \"0.1 * load_W^2\" }")], 1);
    assert!(matches!(verdict, Verdict::Explained | Verdict::CannotTell));
    assert_eq!((place.as_str(), law.as_str()), ("housing", "with the square of load"));
    assert!(sets[0].1.contains("(load_W / "), "{sets:?}");
}

/// A fan that runs while the valve is open beyond a level.
#[test]
fn heat_above_a_threshold() {
    let fan = "{ in = \"housing\", power = \"12 * min(1, max(0, (valve - 1.2) * 1000))\" }";
    let (verdict, place, law, sets) = named(&[("source.hidden", fan)], 2);
    assert!(matches!(verdict, Verdict::Explained | Verdict::CannotTell));
    assert_eq!((place.as_str(), law.as_str()), ("housing", "only where valve is above 1.500"));
    assert!(sets[0].1.contains("min(1, max(0, 0.5 + (valve - 1.5)"), "{sets:?}");
}

/// The catalogue has laws of what varies, thresholds only at few levels, and its factors are those of its expressions.
#[test]
fn laws_of_variables_that_vary() {
    let problem = problem(&[], 3);
    let (study, data) = (&problem.study, &problem.data);
    let scales = Scales::of(data, &study.model.machine);
    let laws = scales.laws(&study.model.machine);
    let at = |name: &str| study.model.machine.variables.iter().position(|v| v.name == name).unwrap();
    let of = |v: usize| laws.iter().filter(|law| matches!(law, Law::Of(own, _) if *own == v)).count();
    assert_eq!((of(at("load")), of(at("valve")), laws.len()), (3, 5, 8), "{laws:?}");
    assert!(laws.contains(&Law::Of(at("load"), LawForm::Inverse)) && laws.contains(&Law::Of(at("valve"), LawForm::Above(2))));
    for h in hypotheses(study, data, &[]).iter().filter(|h| h.kind() == "heat source" && h.place == "housing") {
        let sets = h.sets(study, &scales, &[], 1.0).unwrap().unwrap();
        let edited = study.edited(&sets).unwrap_or_else(|e| panic!("{h:?}: {e}"));
        for row in &data.rows {
            let load = coldplate_network::Load::at(&edited.model.machine, &row.condition).unwrap();
            let wanted = scales.factor(h.law, &row.condition);
            let own = load.powers.last().unwrap();
            assert!((own - wanted).abs() < 1e-6, "{}: {own} {wanted}", h.law_words());
        }
    }
}

/// What would be in force in one row alone is no law: any wrong reading of that row would be one.
#[test]
fn no_threshold_by_one_row() {
    let mut data = problem(&[], 4).data;
    let machine = problem(&[], 4).study.model.machine;
    data.rows.truncate(5);
    let load = machine.variables.iter().position(|v| v.name == "load").unwrap();
    let thresholds = |data: &Data| -> Vec<usize> {
        let above = |law: Law| matches!(law, Law::Of(v, LawForm::Above(_)) if v == load).then_some(law);
        let level = |law: Law| if let Law::Of(_, LawForm::Above(level)) = law { level } else { usize::MAX };
        Scales::of(data, &machine).laws(&machine).into_iter().filter_map(above).map(level).collect()
    };
    // Five loads: two rows at least on either side.
    assert_eq!(thresholds(&data), [1, 2]);
    // The lowest one measured twice.
    let lowest = (0..5).min_by(|a, b| data.rows[*a].condition.si()[load].total_cmp(&data.rows[*b].condition.si()[load])).unwrap();
    data.rows.push(ReadingRow { test: "again".into(), ..data.rows[lowest].clone() });
    assert_eq!(thresholds(&data), [0, 1, 2]);
}

/// What is found of 9 W at full speed in the gear that follow a power of the speed, on another mesh: the law in words, and the interval
/// of its exponent.
fn power_of_the_speed(exponent: f64, seed: u64) -> (String, Option<(f64, f64)>) {
    let machine = Document::parse(SMALL, "small.toml").unwrap();
    let heat = format!("{{ in = [\"gear\"], power = \"9 * (motor_speed_rpm / 2500)^{exponent}\" }}");
    let lines = [("source.hidden", heat.as_str())];
    let conditions = Hidden::conditions(&machine, 16, seed, &[]);
    let found =
        diagnose(&Hidden { machine: &machine, cells: (300, 500), lines: &lines, conditions, seed: seed + 1 }.problem(), &Silent).unwrap();
    for e in found.explanations.iter().take(5) {
        println!("{exponent}: {:.3} {:.1} {}", e.probability, e.misfit, e.causes.iter().map(sentence).collect::<Vec<_>>().join("; "));
    }
    let cause = &found.explanations[0].causes[0];
    assert!(matches!(found.verdict, Verdict::Explained | Verdict::CannotTell));
    assert_eq!(cause.hypothesis.place, "gear");
    let number = cause.hypothesis.number.as_ref();
    if number.is_some() {
        assert!(found.sets.as_ref().is_some_and(|sets| sets.iter().any(|(_, value)| value.contains(")^"))), "{:?}", found.sets);
    }
    (cause.hypothesis.law_words(), number.map(|n| (n.low, n.high)))
}

/// A power without a name is found as a number with its interval.
#[test]
fn powers_without_a_name() {
    for (exponent, seed) in [(1.5, 61), (0.6, 63)] {
        let (words, interval) = power_of_the_speed(exponent, seed);
        let (low, high) = interval.unwrap_or_else(|| panic!("{exponent}: {words}"));
        assert!(words.starts_with("in proportion to motor_speed^") && words.ends_with(')'), "{words}");
        assert!(low < exponent && exponent < high && high - low < 0.8, "{exponent}: {low} to {high}");
    }
}

/// One that has a name keeps it.
#[test]
fn powers_with_a_name() {
    // The source of the gear is in proportion to the speed itself: a constant factor on it is the same heat.
    for (exponent, seed, words) in [
        (1.0, 65, ["in proportion to the motor speed", "constant"]),
        (2.0, 67, ["with the square of the motor speed"; 2]),
        (0.0, 69, ["constant"; 2]),
    ] {
        let (found, interval) = power_of_the_speed(exponent, seed);
        assert!(words.contains(&found.as_str()) && interval.is_none(), "{found}");
    }
}

/// A power of a variable that the file declares. A contact that conducts less the more it has to carry does the same.
#[test]
fn a_power_of_a_load() {
    let hidden = [("source.hidden", "{ in = \"housing\", power = \"8 * (load_W / 10)^1.5\" }")];
    let found = diagnose(&problem(&hidden, 5), &Silent).unwrap();
    let is_it = |e: &&Explanation| e.causes.len() == 1 && e.causes[0].hypothesis.place == "housing";
    let own = found.set.iter().map(|i| &found.explanations[*i]).find(is_it).expect("it is in the set");
    assert!(own.probability > 0.2 && found.verdict == Verdict::CannotTell, "{} {:?}", own.probability, found.verdict);
    let number = own.causes[0].hypothesis.number.as_ref().unwrap();
    assert!(number.low < 1.5 && 1.5 < number.high && number.high - number.low < 0.8, "{number:?}");
}
