//! The laws of places and kinds: those of the list by name, others as the curve that they are.

use coldplate_base::progress::Silent;
use coldplate_describe::machine::Condition;
use coldplate_diagnose::{AmplitudeSettings, Course, FoundLaw, Hypothesis, Law, LawForm, Places, Problem, Scales, Sequence, Way, places};
use coldplate_evidence::identify;
use coldplate_explore::simulate::Start;
use coldplate_testing::twin::{Family, case};

use super::amplitude::{AS_IT_IS, Row, friction, line, only, stribeck, table, table_of};

/// Least probability at which a wrong law would be certain.
const CERTAIN: f64 = 0.95;

fn heater(watts: f64) -> Vec<(String, String)> {
    vec![("source.heater".to_string(), format!("{{ in = \"nut\", power = \"{watts} W\" }}"))]
}

/// The ways of the set in front, which is one cause of a kind at a place, told for who reads a failure.
fn ways(name: &str, problem: &Problem, kind: &str, place: &str) -> (Places, Vec<Way>) {
    let found = places(problem, &AmplitudeSettings::default(), &Silent).unwrap();
    for set in found.sets.iter().take(4) {
        let of = |i: usize| format!("{}, {}", set.members[i].hypothesis.kind_and_place(), set.ways[0].causes[i].hypothesis.law_words());
        let words: Vec<String> = (0..set.members.len()).map(of).collect();
        println!("{name}: {:.4} lead {:.1} {}", set.probability, set.lead, words.join("; "));
    }
    only(&found.sets[0], kind, place);
    for set in &found.sets {
        let sum: f64 = set.ways.iter().map(|way| way.probability).sum();
        assert!((sum - 1.0).abs() < 1e-9 && set.ways.len() <= 12, "{sum}");
        assert!(set.ways.iter().all(|way| way.causes.len() == set.members.len()));
    }
    let ways = found.sets[0].ways.clone();
    for way in &ways {
        let cause = &way.causes[0];
        let words = cause.hypothesis.law_words();
        println!("{name}: {:.4} {:.3} +- {:.3} {words} ({})", way.probability, cause.amplitude, cause.deviation, way.is_writable);
    }
    (found, ways)
}

/// Checks the law of a list: in the first two, its coefficient within three deviations, and no other law certain.
fn named(name: &str, problem: &Problem, at: (&str, &str), amplitude: f64, is_true: impl Fn(&Scales, Law) -> bool) -> Way {
    let (found, ways) = ways(name, problem, at.0, at.1);
    let is_true = |way: &Way| is_true(&found.scales, way.causes[0].hypothesis.law);
    let place = ways.iter().position(is_true).unwrap_or_else(|| panic!("{name}: the law is not among its ways"));
    assert!(place < 2, "{name}: in place {place}");
    assert!(ways.iter().filter(|way| !is_true(way)).all(|way| way.probability < CERTAIN), "{name}: another law is certain");
    let own = &ways[place].causes[0];
    assert!((own.amplitude - amplitude).abs() < 3.0 * own.deviation, "{name}: {} +- {} for {amplitude}", own.amplitude, own.deviation);
    ways[place].clone()
}

fn largest(rows: &[Row], of: impl Fn(&Row) -> f64) -> f64 {
    rows.iter().map(of).fold(0.0, f64::max)
}

#[test]
fn the_square_of_the_speed() {
    let watts = |row: &Row| 60.0 * (row.rpm / 6000.0).powi(2);
    let (problem, rows) = table(31, |row| heater(watts(row)), AS_IT_IS);
    let way = named("square", &problem, ("heat source", "nut"), largest(&rows, watts), |_, law| law == Law::SpeedSquared);
    assert!(way.is_writable);
}

#[test]
fn a_power_of_the_speed_with_its_interval() {
    let watts = |row: &Row| 60.0 * (row.rpm / 6000.0).powf(1.4);
    let (problem, rows) = table(32, |row| heater(watts(row)), AS_IT_IS);
    let is_power = |_: &Scales, law: Law| matches!(law, Law::Of(_, LawForm::Power(_)));
    let way = named("power", &problem, ("heat source", "nut"), largest(&rows, watts), is_power);
    let number = way.causes[0].hypothesis.number.clone().unwrap();
    assert!((number.value - 1.4).abs() < 3.0 * number.deviation / 100.0 && number.high - number.low < 0.4, "{number:?}");
}

#[test]
fn a_threshold_in_the_hours() {
    let watts = |row: &Row| if row.hours > 800.0 { 25.0 } else { 0.0 };
    let (problem, _) = table(33, |row| heater(watts(row)), AS_IT_IS);
    let way = named("threshold", &problem, ("heat source", "nut"), 25.0, |_, law| matches!(law, Law::Of(_, LawForm::Above(_))));
    assert!(way.is_writable);
}

#[test]
fn a_valve_with_hysteresis() {
    // The order of the speeds is that of the same table without a fault.
    let speeds: Vec<f64> = table(34, |_| Vec::new(), AS_IT_IS).1.iter().map(|row| row.rpm).collect();
    let has_fallen = |row: &Row| row.number > 0 && speeds[row.number] < speeds[row.number - 1];
    let open = |row: &Row| if has_fallen(row) { 0.2f64 } else { -0.2 };
    let lines = |row: &Row| line("contact.head_plate.total_conductance", format!("{} W/K", 30.0 * open(row).exp()));
    let (problem, _) = table(34, lines, AS_IT_IS);
    let is_true = |scales: &Scales, law: Law| matches!(scales.found(law), Some(FoundLaw::Rows(Sequence::Fallen(axis))) if axis.name == "motor_speed_rpm");
    let way = named("valve", &problem, ("contact conductance", "head_plate"), 0.2, is_true);
    assert!(!way.is_writable);
}

#[test]
fn a_drift_in_the_order_of_the_rows() {
    let lines = |row: &Row| line("contact.jacket.total_conductance", format!("{} W/K", 45.0 * (-0.6 * row.number as f64 / 15.0).exp()));
    let (problem, _) = table(35, lines, AS_IT_IS);
    let is_true = |scales: &Scales, law: Law| matches!(scales.found(law), Some(FoundLaw::Rows(Sequence::Drift)));
    let way = named("drift", &problem, ("contact conductance", "jacket"), -0.6, is_true);
    assert!(!way.is_writable);
}

/// A law that stands in no list is a table, which predicts what lies between the rows that were seen.
#[test]
fn boundary_friction_is_no_known_law() {
    // The numbers of the file are right here: what is compared is the curve alone.
    let (problem, rows) = table_of((20, 0.0), 2, friction, AS_IT_IS);
    let (found, ways) = ways("friction", &problem, "heat source", "front_bearing");
    let is_curve = |way: &&Way| {
        let law = found.scales.found(way.causes[0].hypothesis.law);
        matches!(law, Some(FoundLaw::Over(axis, Course::Curve(_))) if axis.name == "motor_speed_rpm")
    };
    let curve = ways.iter().find(is_curve).expect("the curve over the speed");
    assert!(ways.iter().filter(|way| !is_curve(way)).all(|way| way.probability < CERTAIN));
    assert!(is_curve(&&ways[0]), "no known law stands in front");
    assert!(curve.is_writable && curve.causes[0].hypothesis.law_words().contains("as found between"));

    // Between each two speeds, with the numbers of the file as they are.
    let mut speeds: Vec<f64> = rows.iter().map(|row| row.rpm).collect();
    speeds.sort_by(f64::total_cmp);
    let mut data = problem.data.clone();
    data.rows.truncate(speeds.len() - 1);
    let at = problem.study.model.machine.variables.iter().position(|v| v.name == "motor_speed").unwrap();
    for (row, pair) in data.rows.iter_mut().zip(speeds.windows(2)) {
        let mut si = row.condition.si().to_vec();
        si[at] = 0.5 * (pair[0] + pair[1]) * std::f64::consts::TAU / 60.0;
        row.condition = Condition::from_si(si);
    }
    let cause = &curve.causes[0];
    let lines = cause.hypothesis.written(&problem.study, &problem.data, &found.scales, &[], cause.amplitude).unwrap().unwrap();
    let told = identify::values(&problem.study.edited(&lines).unwrap(), &data, Start::Steady).unwrap();
    let width = data.sensors.len();
    for (i, pair) in speeds.windows(2).enumerate() {
        let row = Row { rpm: 0.5 * (pair[0] + pair[1]), hours: 0.0, position: 0.0, number: 0 };
        let truth = problem.study.edited(&friction(&row)).unwrap();
        let alone = coldplate_evidence::measurement::Data { rows: vec![data.rows[i].clone()], ..data.clone() };
        let truth = identify::values(&truth, &alone, Start::Steady).unwrap();
        let off = truth.iter().zip(&told[i * width..]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 0.1, "at {:.0} rpm, {:.1} W: {off:.3} K", row.rpm, stribeck(&row));
    }
}

/// Twins of another mesh, films and emissivities: where the hidden place is in front, its law is, and no other law is certain.
#[test]
fn laws_of_twins() {
    let (mut seen, mut in_front, mut sum, mut wrong) = (0, 0, 0.0, Vec::new());
    for seed in [201, 202, 203, 225, 327] {
        let case = case(seed, Family::One);
        let found = places(&case.problem, &AmplitudeSettings::default(), &Silent).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
        let hidden = &case.hidden[0];
        let set = &found.sets[0];
        let is_place = |h: &Hypothesis| h.kind() == hidden.kind && h.place == hidden.place;
        if set.members.len() != 1 || !is_place(&set.members[0].hypothesis) {
            let names: Vec<String> = set.members.iter().map(|own| own.hypothesis.kind_and_place()).collect();
            println!(
                "seed {seed}: {} at {} {:?} hidden, {names:?} in front at {:.3}",
                hidden.kind, hidden.place, hidden.law, set.probability
            );
            for set in found.sets.iter().take(3) {
                let of = |i: usize| {
                    format!(
                        "{}, {} {}",
                        set.members[i].hypothesis.kind_and_place(),
                        set.ways[0].causes[i].hypothesis.law_words(),
                        set.ways[0].causes[i].amplitude / set.members[i].hypothesis.scale
                    )
                };
                println!(
                    "   {:.3} {:.1} {:?} {} {}",
                    set.probability,
                    set.lead,
                    (0..set.members.len()).map(of).collect::<Vec<_>>(),
                    set.looseness.spread,
                    set.looseness.disturbance
                );
            }
            println!("{:?}", case.problem.data.rows.iter().map(|r| r.condition.si().to_vec()).collect::<Vec<_>>());
            continue;
        }
        let of_truth: f64 = set.ways.iter().filter(|way| way.causes[0].hypothesis.law == hidden.law).map(|way| way.probability).sum();
        let first = &set.ways[0];
        let words = first.causes[0].hypothesis.law_words();
        let rows = case.problem.data.rows.len();
        println!(
            "seed {seed}: {} at {}, {:?}: {of_truth:.3}; {words} at {:.3}, {rows} rows",
            hidden.kind, hidden.place, hidden.law, first.probability
        );
        (seen, sum) = (seen + 1, sum + of_truth);
        in_front += usize::from(first.causes[0].hypothesis.law == hidden.law);
        if first.causes[0].hypothesis.law != hidden.law && first.probability > CERTAIN {
            wrong.push(seed);
        }
    }
    println!("{in_front} of {seen} true laws in front, mean probability {:.3}", sum / f64::from(seen));
    assert!(wrong.is_empty(), "certain of a wrong law: {wrong:?}");
}
