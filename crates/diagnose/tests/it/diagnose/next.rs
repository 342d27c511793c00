//! What is proposed to be measured next tells apart what could not be told apart.

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_diagnose::{Diagnosis, ExtraSensor, Law, Problem, Trial, Verdict, diagnose};
use coldplate_evidence::measurement::MeasurementUncertainty;
use coldplate_testing::machines::SMALL;

use super::hidden::Hidden;

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
    let settles = |n: &coldplate_diagnose::Next| n.worth.wrong_name.drop() / n.cost;
    assert!(before.next.windows(2).all(|w| settles(&w[0]) >= settles(&w[1]) - 0.01), "not in order");
    assert!(before.next.iter().all(|n| n.trial == Trial::Steady || n.mean >= 1.0), "not worth while");
    // The same heat is the same at every flow, pressure and with any heater: only another speed tells.
    let variables = &problem.study.model.machine.variables;
    let speed = variables.iter().position(|v| v.name == "motor_speed").unwrap();
    let changes_speed = |next: &coldplate_diagnose::Next| match next.trial {
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

/// Where neither the water nor the speed can be changed, heat into a plate, scale in its channel and less flow are the same data. A thermometer
/// in the little water that leaves would tell, and does.
#[test]
fn a_sensor_that_does_not_exist_is_proposed_and_settles() {
    let mut bare = SMALL.to_string();
    for range in ["[\"2 L/min\", \"8 L/min\"]", "[\"250 rpm\", \"2500 rpm\"]", "[\"18 degC\", \"26 degC\"]"] {
        bare = bare.replace(&format!("range = {range}\n"), "");
    }
    for sensor in [
        "[sensor.plate]\npoint = [\"20 mm\", \"80 mm\", \"10 mm\"]\nin = \"plate\"\n",
        "[sensor.\"second plate\"]\npoint = [\"10 mm\", \"80 mm\", \"10 mm\"]\nin = \"second_plate\"\n",
        "[sensor.outlet]\noutlet = \"second\"\n",
    ] {
        assert!(bare.contains(sensor));
        bare = bare.replace(sensor, "");
    }
    let machine = Document::parse(&bare, "small.toml").unwrap();
    let lines = [("channel.second.film_factor", "0.7")];
    let held = [("motor_speed", SPEED), ("coolant_flow", 0.3 / 60_000.0), ("coolant_temperature", 293.15)];
    let conditions = Hidden::conditions(&machine, 6, 3, &held);
    let mut hidden = Hidden { machine: &machine, cells: (300, 10_000), lines: &lines, conditions, seed: 4 };
    // Thermometers of a workshop: limits of 0.1 K.
    let of_workshop = |mut problem: Problem| {
        problem.uncertainty = MeasurementUncertainty::usual(&problem.data, &problem.study.model.machine);
        problem.costs.new_sensor = 0.25;
        problem
    };
    let problem = of_workshop(hidden.problem());
    let before = found(&problem);
    let is_heat = |d: &Diagnosis| d.set.iter().any(|i| d.explanations[*i].causes[0].hypothesis.kind() == "heat source");
    let is_wall = |d: &Diagnosis| {
        d.set.iter().any(|i| {
            let h = &d.explanations[*i].causes[0].hypothesis;
            h.place == "second" && matches!(h.kind(), "scale" | "film coefficient")
        })
    };
    assert!(before.verdict == Verdict::CannotTell && is_heat(&before) && is_wall(&before));
    let best = &before.next[0];
    let Some(ExtraSensor { name, entry: Some(entry), .. }) = &best.sensor else { panic!("no new sensor: {best:?}") };
    assert_eq!((name.as_str(), entry.as_str()), ("water leaving second", "{ outlet = \"second\" }"));
    assert!(best.trial == Trial::Steady && best.cost == 1.25, "{best:?}");
    let wrong = best.worth.wrong_name;
    println!("{best:?}");
    assert!(wrong.before > 0.5 && wrong.after < 0.7 * wrong.before, "{best:?}");
    assert!(best.worth.prediction.after < 0.8 * best.worth.prediction.before, "{best:?}");
    assert!(best.worth.wrong_verdict.is_none(), "a machine without limits");
    // A sensor that costs too much is not asked for.
    let mut dear = problem.clone();
    dear.costs.sensors.insert(name.clone(), 100.0);
    assert!(found(&dear).next.iter().all(|n| n.sensor.as_ref().is_none_or(|s| s.name != *name)));
    // Fitted and read, it refutes the heat.
    let mut fitted = machine.clone();
    fitted.apply_set("sensor.\"water leaving second\"", entry).unwrap();
    hidden = Hidden { machine: &fitted, ..hidden };
    hidden.conditions.push(best.condition.si().to_vec());
    let mut problem = of_workshop(hidden.problem());
    let own = problem.data.names.iter().position(|n| n == name).unwrap();
    problem.data.rows[..6].iter_mut().for_each(|row| row.readings[own] = None);
    let after = found(&problem);
    assert!(!is_heat(&after) && is_wall(&after), "{:?}", after.explanations[0].causes);
}

/// At one flow a film at a third of its value and scale look alike; the slope of the film alone would need an amplitude that nobody believes.
#[test]
fn a_film_at_a_third_is_not_called_scale() {
    let machine = Document::parse(SMALL, "small.toml").unwrap();
    let held = [("motor_speed", SPEED), ("coolant_flow", 4.0 / 60_000.0)];
    let hidden = Hidden {
        machine: &machine,
        cells: (300, 500),
        lines: &[("channel.first.film_factor", "0.3")],
        conditions: Hidden::conditions(&machine, 6, 3, &held),
        seed: 4,
    };
    let found = found(&hidden.problem());
    let open: Vec<&str> = found.set.iter().map(|i| found.explanations[*i].causes[0].hypothesis.kind()).collect();
    assert!(open.contains(&"film coefficient"), "{open:?}");
}
