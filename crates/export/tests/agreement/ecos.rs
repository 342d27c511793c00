//! Functional mock-up units in Ecos, which reads them by fmi4c: another importer than FMPy, in C and C++.

use std::process::Command;

use coldplate_export::Target;
use coldplate_runtime::{Band, Surrogate};

use crate::{Terms, compare, compare_courses, folder, is_there, lay_out, python_with, skipped};

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
    compare(&folder, &names, &Terms { answers, order_is_own: false });
    compare_courses(&folder, |_| STEP, 1e-12);
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
