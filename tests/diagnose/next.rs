//! What is proposed to be measured next tells apart what could not be told apart.

use coldplate::evidence::diagnose::{Diagnosis, Law, Problem, Trial, Verdict, diagnose};
use coldplate::foundation::document::Document;
use coldplate::foundation::progress::Silent;

use super::hidden::Hidden;
use super::twin::SMALL;

const SPEED: f64 = 2000.0 * std::f64::consts::TAU / 60.0;

fn found(problem: &Problem) -> Diagnosis {
    diagnose(problem, &Silent).unwrap()
}

/// At one speed a source's own heat and other heat at its place are the same data.
#[test]
fn the_proposed_test_decides() {
    let machine = Document::parse(SMALL, "small.toml").unwrap();
    let mut hidden = Hidden {
        machine: &machine,
        cells: (300, 500),
        lines: &[("source.bearing.power", "\"0.0032 * motor_speed_rpm\"")],
        conditions: Hidden::conditions(&machine, 6, 3, &[("motor_speed", SPEED)]),
        seed: 4,
    };
    let problem = hidden.problem();
    let before = found(&problem);
    assert_eq!(before.verdict, Verdict::CannotTell, "{:?}", before.level);
    assert!(before.set.len() > 1);
    for next in &before.next {
        println!("{:?} at {:?}: {:.2}, least {:.2}", next.trial, next.condition.si(), next.mean, next.separation);
    }
    let is_intervention = |t: &Trial| !matches!(t, Trial::Steady);
    assert!(before.next.iter().any(|n| is_intervention(&n.trial)) && before.next.iter().any(|n| !is_intervention(&n.trial)));
    assert!(before.next.windows(2).all(|w| w[0].mean >= w[1].mean), "not in order");
    assert!(before.next.iter().all(|n| n.trial == Trial::Steady || n.mean >= 1.0), "not worth while");
    // The same heat is the same at every flow, pressure and with any heater: only another speed tells.
    let variables = &problem.study.model.machine.variables;
    let speed = variables.iter().position(|v| v.name == "motor_speed").unwrap();
    let changes_speed = |next: &coldplate::evidence::diagnose::Next| match next.trial {
        Trial::Step { variable, .. } => variable == speed,
        Trial::Steady => (next.condition.si()[speed] / SPEED - 1.0).abs() > 0.05,
        _ => false,
    };
    assert!(changes_speed(&before.next[0]), "{:?}", before.next[0]);
    // Made, it refutes the heat that stays the same; what grows with the speed is the same data as the source's own.
    let stays = |d: &Diagnosis| {
        d.set.iter().any(|i| {
            let h = &d.explanations[*i].causes[0].hypothesis;
            h.kind() == "heat source" && h.place == "bearing" && h.law == Law::Constant
        })
    };
    let steady = before.next.iter().find(|n| n.trial == Trial::Steady).unwrap();
    hidden.conditions.push(steady.condition.si().to_vec());
    let after = found(&hidden.problem());
    println!("{} explanations before, {} after, {:?}", before.set.len(), after.set.len(), after.level);
    assert!(stays(&before) && !stays(&after));
    let best = &after.explanations[0].causes[0].hypothesis;
    assert_eq!(best.place, "bearing", "{best:?}");
}
