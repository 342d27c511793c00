//! Designs that grow: what can be written.

use super::files::{HOLD, plan_of};

const RANGE: &str = "[range]\ncoolant_flow = ['3 L/min', '9 L/min']\nambient_temperature = ['18 degC', '24 degC']\n";

#[test]
fn the_first_design_is_a_latin_hypercube_and_grows() {
    let plan = plan_of(&format!("[design]\nkind = 'adaptive'\naccuracy = '0.02 K'\n{RANGE}{HOLD}")).unwrap();
    let fixed = plan_of(&format!("[design]\nkind = 'latin_hypercube'\nruns = 12\n{RANGE}{HOLD}")).unwrap();
    assert_eq!(plan.conditions, fixed.conditions);
    let growth = plan.growth.clone().unwrap();
    assert_eq!((growth.most, growth.batch()), (100, 4));
    assert!((growth.accuracy - 0.02).abs() < 1e-15);
    let candidates = growth.candidates(3);
    assert_eq!(candidates, growth.candidates(3));
    assert_ne!(candidates, growth.candidates(4));
    assert!(candidates.iter().flatten().all(|u| (0.0..=1.0).contains(u)));
    for corner in [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]] {
        assert!(candidates.iter().any(|c| *c == corner));
    }
    // A place is found again from its condition, which can be typed.
    let mut grown = plan.clone();
    grown.grow(candidates[..10].iter().map(|c| growth.condition(c, &plan.variables)).collect());
    grown.grow(vec![growth.condition(&[0.25, 1.0], &plan.variables)]);
    assert_eq!((grown.conditions.len(), grown.groups.len()), (23, 2));
    assert_eq!(grown.groups[1].rows, 12..23);
    assert_eq!((grown.shown[22][0], grown.shown[22][1], grown.shown[22][3]), (4.5, 20.0, 24.0));
    assert!(growth.place(&grown.conditions[22]).iter().zip([0.25, 1.0]).all(|(a, b)| (a - b).abs() < 1e-12));
    // What is added changes nothing for the rows before, and conditions are solved with slopes until there are enough.
    let sloped = |plan: &coldplate_explore::sweep::Plan, rows: std::ops::Range<usize>| rows.filter(|r| plan.is_sloped(*r)).count();
    assert_eq!(sloped(&plan, 0..12), sloped(&grown, 0..12));
    grown.grow((0..100).map(|_| grown.shown[22].clone()).collect());
    assert_eq!((0..23).filter(|r| grown.is_sloped(*r)).count(), 23);
    assert_eq!(sloped(&grown, 0..123), 25);
}

#[test]
fn what_an_adaptive_design_cannot_be_is_told() {
    let two = format!("{RANGE}{HOLD}");
    let one = format!("[range]\ncoolant_flow = ['3 L/min', '9 L/min']\n{HOLD}");
    let design = |keys: &str, rest: &str| format!("[design]\nkind = 'adaptive'\n{keys}\n{rest}");
    let same_name =
        format!("{two}[[one_factor]]\nname = 'added'\nvariable = 'coolant_flow'\nlow = '3 L/min'\nhigh = '6 L/min'\npoints = 3\n");
    for (text, needles) in [
        (design("", &two), vec!["design.accuracy", "missing"]),
        (design("accuracy = 0.02", &two), vec![":5", "design.accuracy", "0.5 K"]),
        (design("accuracy = '0.02'", &two), vec![":5", "design.accuracy", "K"]),
        (design("accuracy = '0 K'", &two), vec![":5", "design.accuracy", "larger than zero"]),
        (design("accuracy = '-1 K'", &two), vec![":5", "design.accuracy", "larger than zero"]),
        (design("accuracy = '20 degC'", &two), vec![":5", "design.accuracy", "in K"]),
        (design("accuracy = '1 K'\nruns = 5", &two), vec![":6", "design.runs", "at least 6"]),
        (design("accuracy = '1 K'\nruns = 20\nmax_runs = 20", &two), vec![":7", "design.max_runs", "larger than runs"]),
        (design("accuracy = '1 K'\nmax_runs = 2000000", &two), vec![":6", "design.max_runs", "1000000"]),
        (design("accuracy = '1 K'\ncorners = true", &two), vec![":6", "design.corners", "unknown key", "max_runs"]),
        (design("accuracy = '1 K'", &one), vec![":4", "design.kind", "two variables", "[[one_factor]]"]),
        (design("accuracy = '1 K'", &same_name), vec!["'added'", "another name"]),
        (format!("[design]\nkind = 'latin_hypercube'\nruns = 20\naccuracy = '1 K'\n{two}"), vec![":6", "design.accuracy", "adaptive"]),
    ] {
        let message = plan_of(&text).map(|_| ()).unwrap_err().to_string();
        assert!(message.contains("sweeps/test.toml"), "{text}\n{message}");
        assert!(needles.iter().all(|needle| message.contains(needle)), "{text}\n{message}\nwanted: {needles:?}");
    }
}
