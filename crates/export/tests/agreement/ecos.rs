//! Functional mock-up units in Ecos, which reads them by fmi4c: another importer than FMPy, in C and C++.

use std::process::Command;

use coldplate_export::Target;
use coldplate_runtime::{Band, Surrogate};

use crate::{Terms, compare, fixtures, folder, is_there, lay_out, python_with, skipped, worst};

const DRIVER: &str = include_str!("ecos.py");
/// Length of a step, s.
const STEP: f64 = 60.0;

/// Values, half widths, margins, probabilities, all together, and whether the condition is inside. Ecos has no enumerations, and
/// so no verdict.
fn answers(surrogate: &Surrogate<'_>, x: &[f64]) -> Vec<f64> {
    let points = surrogate.point_count();
    let (mut values, mut bands) = (vec![0.0; points], vec![Band::default(); points]);
    let chance = surrogate.assess(x, None, 0.95, &mut values, &mut bands).expect("the shapes fit");
    let limits: Vec<_> =
        (0..surrogate.limit_count()).map(|own| surrogate.limit_chance(own, x, None, &values).expect("the limit exists")).collect();
    let mut all = values.clone();
    all.extend(bands.iter().map(|band| band.half_width()));
    all.extend(limits.iter().map(|own| own.maximum - own.value));
    all.extend(limits.iter().map(|own| own.probability));
    all.push(if limits.is_empty() { 0.0 } else { chance.probability });
    all.push(f64::from(u8::from(chance.in_domain)));
    all
}

/// What the points read after a step at each condition but the first, at which it begins: in the steady state, then at 18 degC.
fn course(surrogate: &Surrogate<'_>, conditions: &[&[f64]]) -> Vec<f64> {
    let mut all = Vec::new();
    let begins = [surrogate.at_rest(conditions[0]), surrogate.at_temperature(18.0)];
    for begin in begins {
        let mut state = begin.expect("the file moves");
        let mut values = vec![0.0; surrogate.point_count()];
        for x in &conditions[1..] {
            surrogate.step(&mut state, STEP, x).expect("the numbers are finite");
            surrogate.read(&state, x, &mut values).expect("the shapes fit");
            all.extend(&values);
            all.push(f64::from(u8::from(surrogate.in_domain(x))));
        }
    }
    all
}

fn units_answer_in_ecos(target: Target) {
    let Some(python) = python_with("ecospy") else { return };
    if !is_there("cc") {
        skipped("cc is not on this machine: units have no binary to run");
        return;
    }
    let folder = folder(&format!("ecos-{}", target.key()));
    let names = lay_out(&folder, target, |_| 200);
    let output = Command::new(python).current_dir(&folder).args(["-c", DRIVER]).output().expect("python3 starts");
    assert!(output.status.success(), "{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    compare(&folder, &names, &Terms { answers, cancelling: 1e-12 });
    let moving: Vec<_> = fixtures().into_iter().filter(|(name, _)| name.ends_with("moving")).collect();
    assert!(!moving.is_empty());
    for (name, bytes) in moving {
        let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
        let numbers = |what: &str| -> Vec<f64> {
            let written = std::fs::read(folder.join(format!("{}.{what}", name.replace('-', "_")))).expect("it was written");
            written.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect()
        };
        let conditions = numbers("in");
        let conditions: Vec<&[f64]> = conditions.chunks_exact(surrogate.variable_count()).collect();
        let (apart, place) = worst(&numbers("course"), &course(&surrogate, &conditions));
        println!("{name} over time: {apart:.1e} at answer {place}");
        assert!(apart < 1e-12, "{name}: {apart:e}");
    }
    let _ = std::fs::remove_dir_all(&folder);
}

#[test]
fn units_of_version_two_answer_in_ecos() {
    units_answer_in_ecos(Target::Fmu2);
}

#[test]
fn units_of_version_three_answer_in_ecos() {
    units_answer_in_ecos(Target::Fmu3);
}
