//! Wrong readings and rows that show only beside causes: set aside where causes then explain the rest, and nothing of sound tables.

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_describe::machine::Condition;
use coldplate_diagnose::{Diagnosis, Problem, Verdict, settled};
use coldplate_evidence::faulty_readings::FaultKind;
use coldplate_testing::machines::SMALL;

use super::hidden::Hidden;

/// Two causes of about the same size.
const TWO: [(&str, &str); 2] =
    [("contact.foot.conductance", "\"120 W/(m2 K)\""), ("source.hidden", "{ in = \"motor\", power = \"14 W\" }")];

fn table(lines: &[(&str, &str)], rows: usize, seed: u64) -> Problem {
    let machine = Document::parse(SMALL, "small.toml").unwrap();
    let conditions = Hidden::conditions(&machine, rows, seed, &[]);
    Hidden { machine: &machine, cells: (300, 500), lines, conditions, seed }.problem()
}

/// Rows, kinds and sensors of what was left out, and the answer without.
fn answered(problem: Problem) -> (Vec<(FaultKind, usize, Option<String>)>, Diagnosis) {
    let problem = problem.cleared().unwrap();
    let (left, found) = settled(&problem, &Silent).unwrap();
    left.faults.iter().for_each(|fault| println!("{}", fault.text()));
    assert!(left.faults.iter().all(|fault| fault.is_left_out));
    assert_eq!(left.data.count(), found.residuals.residual.len());
    (left.faults.iter().map(|f| (f.kind, *f.rows.start(), f.sensor.clone())).collect(), found)
}

fn named(found: &Diagnosis) -> Vec<String> {
    let mut names: Vec<String> = match found.rungs.as_slice() {
        [] => found.explanations[0].causes.iter().map(|c| c.hypothesis.kind_and_place()).collect(),
        rungs => rungs.iter().flat_map(|rung| &rung.causes).map(|c| c.hypothesis.kind_and_place()).collect(),
    };
    names.sort();
    names
}

/// One sensor 6 K too high in one row, and another row with the conditions of a third, beside two causes; named by their places in a
/// table whose first row is empty.
#[test]
fn a_wrong_reading_and_a_wrong_row_beside_two_causes() {
    let mut problem = table(&TWO, 9, 41);
    problem.data.rows[2].readings[3] = problem.data.rows[2].readings[3].map(|t| t + 6.0);
    let others: Vec<f64> = problem.data.rows[7].condition.si().to_vec();
    problem.data.rows[5].condition = Condition::from_si(others);
    let sensor = problem.data.names[3].clone();
    let mut empty = problem.data.rows[0].clone();
    empty.readings.iter_mut().for_each(|reading| *reading = None);
    problem.data.rows.insert(0, empty);
    let (faults, found) = answered(problem);
    assert_eq!(faults, [(FaultKind::WrongReading, 3, Some(sensor)), (FaultKind::WrongCondition, 6, None)]);
    assert!(matches!(found.verdict, Verdict::Explained | Verdict::CannotTell), "{:?}", found.verdict);
    assert_eq!(named(&found), named(&answered(table(&TWO, 9, 41)).1), "as without faults");
}

/// The very same table without faults keeps all its readings; so does one whose cause the catalogue does not have.
#[test]
fn sound_tables_stay_whole() {
    let fouled = [("source.hidden", "{ in = \"gear\", power = \"8e-6 * motor_speed_rpm^2 * coolant_flow_L_min^0.5\" }")];
    for lines in [&TWO[..], &TWO[..1], &fouled] {
        for seed in [41, 42, 43] {
            let (faults, _) = answered(table(lines, 9, seed));
            assert!(faults.is_empty(), "{lines:?}, seed {seed}: {faults:?}");
        }
    }
}

/// `--keep-all` keeps what was not cleared.
#[test]
fn nothing_is_set_aside_unasked() {
    let mut problem = table(&TWO, 9, 41);
    problem.data.rows[2].readings[3] = problem.data.rows[2].readings[3].map(|t| t + 6.0);
    let (left, found) = settled(&problem, &Silent).unwrap();
    assert!(left.faults.is_empty() && found.aside.is_empty());
    assert_eq!(left.data.count(), problem.data.count());
}
