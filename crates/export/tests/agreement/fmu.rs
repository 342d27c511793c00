//! Functional mock-up units in FMPy: validated, simulated both ways, and beside the runtime at many conditions.

use std::process::Command;

use coldplate_export::{Target, export};
use coldplate_runtime::{Band, Surrogate};

use crate::{Terms, compare, fixtures, folder, is_there, lay_out, python_with, skipped};

fn count(name: &str) -> usize {
    if name.starts_with("bench") { 1000 } else { 10_000 }
}

const WARNINGS: &str = "-Wall -Wextra -Wpedantic -Werror -Wconversion -Wshadow -Wdouble-promotion";

/// For every unit: validates it, reads conditions, writes what `answers` lists; then the traps.
const DRIVER: &str = include_str!("fmu.py");

/// Values, half widths, margins, probabilities, all together, inside, verdict, and the gradient of the last value.
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
    all.extend([f64::from(u8::from(chance.in_domain)), f64::from(chance.state as u8)]);
    let mut gradient = vec![0.0; x.len()];
    surrogate.gradient(x, points - 1, &mut gradient).expect("the shapes fit");
    all.extend(&gradient);
    all
}

fn units_answer_as_the_runtime_does(target: Target) {
    let Some(python) = python_with("fmpy") else { return };
    if !is_there("cc") {
        skipped("cc is not on this machine: units have no binary to run");
        return;
    }
    let folder = folder(target.key());
    let names = lay_out(&folder, target, count);
    let output = Command::new(python).current_dir(&folder).args(["-c", DRIVER]).output().expect("python3 starts");
    assert!(output.status.success(), "{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    compare(&folder, &names, &Terms { answers, order_is_own: false });
    let _ = std::fs::remove_dir_all(&folder);
}

#[test]
fn units_of_version_two_answer_as_the_runtime_does() {
    units_answer_as_the_runtime_does(Target::Fmu2);
}

#[test]
fn units_of_version_three_answer_as_the_runtime_does() {
    units_answer_as_the_runtime_does(Target::Fmu3);
}

#[test]
fn the_sources_of_units_compile_without_a_warning() {
    if !is_there("gcc") || !is_there("python3") {
        skipped("gcc or python3 is not on this machine");
        return;
    }
    for target in [Target::Fmu2, Target::Fmu3] {
        // The surrogate's own source is compiled elsewhere: one file of each kind does.
        for (name, bytes) in fixtures().into_iter().filter(|(name, _)| ["bare", "known", "uncertain", "moving"].contains(&name.as_str())) {
            let folder = folder(&format!("{}-{name}", target.key()));
            let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
            let file = export(&surrogate, target, "surrogate").expect("the name is one").swap_remove(0);
            let remark = file.remark.unwrap_or_default();
            assert!(remark.starts_with("with sources and the binary for ") || !is_there("cc"), "{remark}");
            std::fs::write(folder.join(&file.name), &file.content).expect("the folder can be written to");
            let run = |program: &str, arguments: &[&str]| {
                let output = Command::new(program).current_dir(&folder).args(arguments).output().expect("the program starts");
                assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
            };
            run("python3", &["-m", "zipfile", "-e", "surrogate.fmu", "."]);
            let source = format!("sources/surrogate_{}.c", target.key().replace("fmu", "fmi"));
            let arguments: Vec<&str> =
                ["-std=c99", "-O1", "-c", "sources/surrogate.c", &source].into_iter().chain(WARNINGS.split_whitespace()).collect();
            run("gcc", &arguments);
            let _ = std::fs::remove_dir_all(&folder);
        }
    }
}
