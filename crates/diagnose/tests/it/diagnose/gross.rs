//! Gross errors in a table, alone and beside a cause: both are found, and no reading is dropped that a cause explains.

use super::amplitude::{AS_IT_IS, Row, friction, front, only, stribeck, table};
use coldplate_describe::machine::Condition;
use coldplate_diagnose::{Aside, PlaceSet, Problem};

/// Columns of the head.
const FRONT_BEARING: usize = 2;
const NUT: usize = 7;

/// Changes the reading of a row after it was made, errors and all.
fn changed(mut problem: Problem, row: usize, change: impl Fn(&mut Vec<Option<f64>>)) -> Problem {
    change(&mut problem.data.rows[row].readings);
    problem
}

/// The only part that a set calls wrong.
fn aside(set: &PlaceSet) -> Aside {
    let [own] = set.aside[..] else { panic!("{:?}", set.aside) };
    own
}

fn clean(seed: u64) -> Problem {
    table(seed, |_| Vec::new(), AS_IT_IS).0
}

/// The heat in the front bearing in every row, as it is.
fn has_friction(set: &PlaceSet, rows: &[Row], but: Option<usize>) {
    let own = only(set, "heat source", "front_bearing");
    for (row, a) in rows.iter().zip(&own.amplitudes).filter(|(row, _)| Some(row.number) != but) {
        assert!((a - stribeck(row)).abs() < 6.0, "row {}: {a} W for {} W", row.number, stribeck(row));
    }
}

/// Two digits exchanged, or a ten too much, in one reading.
#[test]
fn a_number_that_was_typed_wrong() {
    let digits = |kelvin: f64| {
        let tenths = ((kelvin - 273.15) * 10.0).round() as i64;
        let (tens, ones, rest) = (tenths / 100, tenths / 10 % 10, tenths % 10);
        273.15 + (ones * 100 + tens * 10 + rest) as f64 / 10.0
    };
    let ten = |kelvin: f64| kelvin + 10.0;
    for (name, wrong) in [("ten too much", &ten as &dyn Fn(f64) -> f64), ("digits exchanged", &digits)] {
        let type_it = |readings: &mut Vec<Option<f64>>| readings[NUT] = readings[NUT].map(wrong);
        let problem = clean(11);
        let right = problem.data.rows[4].readings[NUT].unwrap();
        let off = wrong(right) - right;
        assert!(off.abs() > 1.0, "{right}");
        let set = front(name, &changed(problem, 4, type_it));
        assert!(set.members.is_empty());
        let own = aside(&set);
        assert_eq!((own.row, own.sensor), (Some(4), Some(NUT)));
        assert!((own.off - off).abs() < 0.5, "{} for {off}", own.off);
        // Beside a cause.
        let (problem, rows) = table(2, friction, AS_IT_IS);
        let right = problem.data.rows[4].readings[NUT].unwrap();
        let off = wrong(right) - right;
        assert!(off.abs() > 1.0, "{right}");
        let set = front(name, &changed(problem, 4, type_it));
        has_friction(&set, &rows, None);
        let own = aside(&set);
        assert_eq!((own.row, own.sensor), (Some(4), Some(NUT)));
        assert!((own.off - off).abs() < 0.5, "{} for {off}", own.off);
    }
}

/// All readings of a row stand one column too far.
#[test]
fn a_row_that_is_shifted() {
    let shift = |readings: &mut Vec<Option<f64>>| readings.rotate_right(1);
    let set = front("shifted", &changed(clean(11), 6, shift));
    assert!(set.members.is_empty());
    let own = aside(&set);
    assert_eq!((own.row, own.sensor), (Some(6), None));
    assert!(own.off > 1.0, "{}", own.off);
    let (problem, rows) = table(2, friction, AS_IT_IS);
    let set = front("shifted, and friction", &changed(problem, 6, shift));
    has_friction(&set, &rows, Some(6));
    let own = aside(&set);
    assert_eq!((own.row, own.sensor), (Some(6), None));
}

/// One row states the room 4 K warmer than it was. Its readings are right, and say so.
#[test]
fn a_condition_that_was_typed_wrong() {
    let typed = |mut problem: Problem| {
        let v = problem.study.model.machine.variables.iter().position(|v| v.name == "ambient_temperature").unwrap();
        let row = &mut problem.data.rows[4];
        let mut si = row.condition.si().to_vec();
        si[v] += 4.0;
        row.condition = Condition::from_si(si);
        (problem, v)
    };
    let is_so = |own: Aside, v: usize| {
        assert_eq!((own.row, own.sensor, own.variable), (Some(4), None, Some(v)));
        assert!((own.off - 4.0).abs() < 1.0, "{} K", own.off);
    };
    let (problem, v) = typed(clean(11));
    let set = front("a condition", &problem);
    assert!(set.members.is_empty());
    is_so(aside(&set), v);
    // Beside a cause.
    let (problem, rows) = table(2, friction, AS_IT_IS);
    let (problem, v) = typed(problem);
    let set = front("a condition beside a cause", &problem);
    has_friction(&set, &rows, None);
    is_so(aside(&set), v);
}

/// A sensor that shows one value throughout, with noise and without: at 20 degC too, where this is a gain of nothing.
#[test]
fn a_sensor_that_is_dead() {
    let die = |mut problem: Problem, at: f64, noise: f64| {
        let wave = |r: usize| noise * (7.0 * r as f64).sin();
        problem.data.rows.iter_mut().enumerate().for_each(|(r, row)| row.readings[NUT] = Some(at + wave(r)));
        problem
    };
    for (at, noise) in [(293.15, 0.0), (298.4, 0.05)] {
        let set = front("dead", &die(clean(11), at, noise));
        assert!(set.members.is_empty());
        let own = aside(&set);
        assert_eq!((own.row, own.sensor), (None, Some(NUT)));
        assert!(own.off > 1.0 && (own.stuck_at.unwrap() - at).abs() < 0.05, "{own:?}");
        let (problem, rows) = table(2, friction, AS_IT_IS);
        let set = front("dead, and friction", &die(problem, at, noise));
        has_friction(&set, &rows, None);
        let own = aside(&set);
        assert_eq!((own.row, own.sensor), (None, Some(NUT)));
    }
}

/// A sensor that shows anything.
#[test]
fn a_sensor_that_is_broken() {
    let mut problem = clean(11);
    for (r, row) in problem.data.rows.iter_mut().enumerate() {
        row.readings[NUT] = Some(300.0 + 20.0 * (7.0 * r as f64).sin());
    }
    let set = front("broken", &problem);
    assert!(set.members.is_empty());
    let own = aside(&set);
    assert_eq!((own.row, own.sensor, own.stuck_at), (None, Some(NUT), None));
}

/// Values of an instrument's own, however far off, leave no trace in the rest.
#[test]
fn a_value_that_is_no_temperature() {
    let fail = |readings: &mut Vec<Option<f64>>| readings[NUT] = Some(-9999.0 + 273.15);
    let set = front("an error value", &changed(clean(11), 4, fail));
    assert!(set.members.is_empty());
    assert_eq!((aside(&set).row, aside(&set).sensor), (Some(4), Some(NUT)));
}

/// Exchanged sensors are a cause, and nothing is lost by them.
#[test]
fn exchanged_sensors_are_no_gross_error() {
    let swap = |row: &Row, values: &mut Vec<f64>, _: f64| {
        if row.number >= 9 {
            values.swap(FRONT_BEARING, 5);
        }
    };
    let set = front("exchanged", &table(7, |_| Vec::new(), swap).0);
    only(&set, "swapped sensors", "front_bearing - gear");
    assert!(set.aside.is_empty());
}

#[test]
fn clean_tables_lose_nothing() {
    for seed in [1, 21, 31, 41] {
        let set = front("clean", &clean(seed));
        assert!(set.members.is_empty() && set.aside.is_empty(), "seed {seed}");
    }
}

/// A heater that is on in one row alone is named, or stands beside the row that is called wrong.
#[test]
fn a_cause_that_acts_in_one_row_is_not_dropped() {
    let lines = |row: &Row| {
        let power = if row.number == 6 { 30.0 } else { 0.0 };
        vec![("source.heater".to_string(), format!("{{ in = \"nut\", power = \"{power} W\" }}"))]
    };
    let problem = table(5, lines, AS_IT_IS).0;
    let set = front("one row", &problem);
    let own = only(&set, "heat source", "nut");
    assert!((own.amplitudes[6] - 30.0).abs() < 3.0, "{:?}", own.amplitudes);
    assert!(set.aside.is_empty(), "{:?}", set.aside);
}

/// Two sensors exchanged in the last rows, one of which has a wrong reading of a third: without the exchange five readings are wrong.
#[test]
fn sensors_exchanged_from_a_row_on_beside_a_wrong_reading() {
    let swap = |row: &Row, values: &mut Vec<f64>, _: f64| {
        if row.number >= 5 {
            values.swap(FRONT_BEARING, 5);
        }
    };
    let mut problem = table(7, |_| Vec::new(), swap).0;
    problem.data.rows.truncate(7);
    let problem = changed(problem, 6, |readings| readings[NUT] = readings[NUT].map(|kelvin| kelvin + 9.0));
    let set = front("exchanged in the last rows", &problem);
    let own = only(&set, "swapped sensors", "front_bearing - gear");
    assert!(own.amplitudes[..5].iter().all(|a| a.abs() < 0.2) && own.amplitudes[5..].iter().all(|a| (a - 1.0).abs() < 0.2));
    let own = aside(&set);
    assert_eq!((own.row, own.sensor), (Some(6), Some(NUT)));
}
