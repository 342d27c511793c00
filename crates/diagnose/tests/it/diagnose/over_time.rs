//! Causes that set in or grow in the course of logs: found with their time, written with formulas of it, and never called where nothing
//! changes.

use coldplate_diagnose::{Diagnosis, sentence};

use crate::diagnose::logs::{CELLS, Hidden, found, is_named, study, told};

fn line(key: &str, value: &str) -> (String, String) {
    (key.to_string(), value.to_string())
}

/// The truth's file declares the time.
fn with_time(lines: &[(&str, &str)]) -> Hidden {
    let time = [line("variables.time", "{ unit = \"s\", default = \"0 s\" }")];
    Hidden { lines: time.into_iter().chain(lines.iter().map(|(k, v)| line(k, v))).collect(), ..Hidden::default() }
}

fn shown(seed: u64, found: &Diagnosis) {
    println!("{}", told(seed, found));
    for e in found.explanations.iter().take(6) {
        println!("{:.3} {:.1} {}", e.probability, e.misfit, e.causes.iter().map(sentence).collect::<Vec<_>>().join("; "));
    }
}

/// 12 W into the gear from a time on.
#[test]
fn a_heat_that_sets_in() {
    for (seed, time) in [(41, 1900.0), (42, 3400.0)] {
        let power = format!("\"12 * min(1, max(0, (time_s - {time}) / 5))\"");
        let found = found(seed, &with_time(&[("source.hidden", &format!("{{ in = [\"gear\"], power = {power} }}"))]));
        shown(seed, &found);
        let cause = &found.explanations[0].causes[0];
        assert!(is_named(&found, "heat source", "gear"), "{}", told(seed, &found));
        assert!(cause.hypothesis.law_words().starts_with("only after "), "{}", cause.hypothesis.law_words());
        let number = cause.hypothesis.number.as_ref().unwrap();
        assert!(number.low - 30.0 < time && time < number.high + 30.0, "{number:?}");
        assert!((cause.amplitude - 12.0).abs() < 1.5, "{}", cause.amplitude);
        // What is written is a machine that knows the time.
        let lines = found.sets.clone().unwrap();
        assert!(lines.iter().any(|(_, value)| value.contains("time_s")), "{lines:?}");
        study(CELLS, &[vec![line("variables.time", "{ unit = \"s\", default = \"0 s\" }")], lines].concat());
        let gain = found.gain.unwrap();
        assert!(gain.after < 0.7 * gain.before, "{gain:?}");
    }
}

/// The motor's contact loosens in the course of each test.
#[test]
fn a_contact_that_loosens() {
    let found = found(43, &with_time(&[("contact.motor.factor", "\"exp(-0.9 * time_s / 4800)\"")]));
    shown(43, &found);
    let cause = &found.explanations[0].causes[0];
    assert!(is_named(&found, "contact conductance", "motor"), "{}", told(43, &found));
    assert!(cause.hypothesis.law_words().starts_with("in proportion to the time"), "{}", cause.hypothesis.law_words());
    assert!((cause.amplitude + 0.9).abs() < 0.15, "{}", cause.amplitude);
    assert!(found.sets.unwrap().iter().any(|(key, _)| key == "contact.motor.factor"));
}

/// A sensor that jumps is named with the instant.
#[test]
fn a_sensor_that_jumps() {
    let found = found(45, &Hidden { error: Some((0, |t| if t > 2600.0 { 0.8 } else { 0.0 })), ..Hidden::default() });
    shown(45, &found);
    assert!(is_named(&found, "sensor offset", "motor"), "{}", told(45, &found));
    let law = found.explanations[0].causes[0].hypothesis.law_words();
    assert!(law.starts_with("only after "), "{law}");
    // No machine file can say it.
    assert!(found.sets.is_none());
}

/// A sensor that drifts away and a heat that grows leave the same misfit but for 3: both are said, with their course, and no third cause.
#[test]
fn a_sensor_that_drifts() {
    let found = found(44, &Hidden { error: Some((1, |t| 0.9 * t / 4800.0)), ..Hidden::default() });
    shown(44, &found);
    let set: Vec<_> = found.set.iter().map(|i| &found.explanations[*i]).collect();
    let said: Vec<_> = set.iter().map(|e| (e.causes.len(), e.causes[0].hypothesis.kind_and_place())).collect();
    assert!(
        said.iter().all(|(count, kind)| *count == 1 && ["sensor offset at gear", "heat source at gear"].contains(&kind.as_str())),
        "{said:?}"
    );
    let of_sensor = set.iter().find(|e| e.causes[0].hypothesis.is_sensor()).unwrap();
    let (cause, law) = (&of_sensor.causes[0], of_sensor.causes[0].hypothesis.law_words());
    assert!(law.starts_with("in proportion to the time"), "{law}");
    assert!((cause.amplitude - 0.9).abs() < 0.1, "{}", cause.amplitude);
}

/// What is there all the time stays constant.
#[test]
fn a_heat_that_is_always_there() {
    let found = found(46, &Hidden { lines: vec![line("source.hidden", "{ in = [\"gear\"], power = \"8 W\" }")], ..Hidden::default() });
    shown(46, &found);
    assert!(is_named(&found, "heat source", "gear"), "{}", told(46, &found));
    assert_eq!(found.explanations[0].causes[0].hypothesis.law_words(), "constant");
}
