//! Tables on the reduced model give what full solves give.

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_diagnose::{Diagnosis, Problem, diagnose};
use coldplate_evidence::identify;
use coldplate_solve::study::{StateTables, Study};
use coldplate_testing::machines::SMALL;

use super::hidden::Hidden;

/// What readings may be off, K: what `diagnose` checks its end result to.
const ACCURACY: f64 = 1e-3;

fn in_full(problem: &Problem) -> Problem {
    let mut problem = problem.clone();
    problem.study.tables = StateTables::InFull;
    problem
}

fn farthest(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()))
}

/// The five-axis machine as it is, then with a contact at half and heat added, begun from the machine as it is: every node.
#[test]
fn states_are_those_of_full_solves() {
    let machine = Document::read(coldplate_testing::root().join("machines/five_axis.toml")).unwrap();
    let conditions = Hidden::conditions(&machine, 11, 31, &[]);
    let problem = Hidden { machine: &machine, cells: (1500, 1500), lines: &[], conditions, seed: 32 }.problem();
    let source = format!("{{ in = \"{}\", power = \"6 W\" }}", problem.study.model.machine.parts[0].name);
    let lines = [("contact.y_motor.conductance".into(), "\"280 W/(m2 K)\"".into()), ("source.hidden".into(), source)];
    let full = |study: &Study| identify::steady_near(&study.clone().with_tables(StateTables::InFull), &problem.data, &[]).unwrap();
    let mut near: Vec<Vec<f64>> = Vec::new();
    for study in [problem.study.clone(), problem.study.edited(&lines).unwrap()] {
        let (exact, fields) = full(&study);
        let (values, found) = identify::steady_near(&study, &problem.data, &near).unwrap();
        let of_nodes = fields.iter().zip(&found).map(|(a, b)| farthest(a, b)).fold(0.0, f64::max);
        println!("readings off by {:.1e} K, nodes by {of_nodes:.1e} K", farthest(&exact, &values));
        assert!(farthest(&exact, &values) < 5e-5 && of_nodes < 1e-4);
        if let Some(first) = near.first() {
            assert!(farthest(first, &fields[0]) > 1.0, "the causes hardly act");
        }
        near = found;
    }
}

fn same(reduced: &Diagnosis, full: &Diagnosis) {
    println!("off in full {:?}", reduced.off_in_full);
    assert!(reduced.off_in_full.unwrap() < ACCURACY && full.off_in_full.is_none());
    assert_eq!((reduced.verdict, reduced.set.len(), reduced.rungs.len()), (full.verdict, full.set.len(), full.rungs.len()));
    assert!(farthest(&reduced.residuals.predicted, &full.residuals.predicted) < ACCURACY);
    for (a, b) in reduced.set.iter().zip(&full.set) {
        let (a, b) = (&reduced.explanations[*a], &full.explanations[*b]);
        assert!((a.probability - b.probability).abs() < 0.01, "{} {}", a.probability, b.probability);
        for (a, b) in a.causes.iter().zip(&b.causes) {
            assert!(a.hypothesis.is_same(&b.hypothesis));
            assert!((a.amplitude - b.amplitude).abs() < 0.02 * b.deviation, "{a:?} {b:?}");
            assert!((a.deviation / b.deviation - 1.0).abs() < 0.01, "{a:?} {b:?}");
        }
    }
    if let (Some(a), Some(b)) = (&reduced.explained, &full.explained) {
        assert!(farthest(a, b) < ACCURACY);
    }
    if let (Some(a), Some(b)) = (&reduced.gain, &full.gain) {
        assert!((a.before - b.before).abs() < ACCURACY && (a.after - b.after).abs() < ACCURACY, "{} {}", a.after, b.after);
    }
}

/// A contact, a source and a film, one after another.
#[test]
fn diagnoses_are_those_of_full_solves() {
    let machine = Document::parse(SMALL, "small.toml").unwrap();
    for (seed, lines) in [
        (41, [("contact.motor.conductance", "\"250 W/(m2 K)\"")]),
        (42, [("source.gear.power", "\"0.03 * motor_speed_rpm\"")]),
        (43, [("channel.first.film_factor", "0.6")]),
    ] {
        let conditions = Hidden::conditions(&machine, 12, seed, &[]);
        let problem = Hidden { machine: &machine, cells: (300, 500), lines: &lines, conditions, seed }.problem();
        same(&diagnose(&problem, &Silent).unwrap(), &diagnose(&in_full(&problem), &Silent).unwrap());
    }
}
