//! The C99 in single precision beside the runtime: no further from it than it says, and never far.

use std::path::Path;
use std::process::Command;

use coldplate_export::{ExportError, Target, export};
use coldplate_runtime::{Band, Surrogate};

use crate::cancelling::{cancelling, too_large};
use crate::{conditions, fixtures, folder, is_there, skipped};

const OPTIONS: &str = "-std=c99 -O2 -Wall -Wextra -Wpedantic -Werror -Wconversion -Wshadow -Wdouble-promotion";

/// By how much a value may be said to be off: of what is rounded, not of what cancels.
const STATED: f64 = 2e-4;

/// Reads conditions in single precision; writes values, total deviations, probability and state, gradients, and a course over time.
const DRIVER: &str = r#"
#include <stdio.h>
#include "surrogate.h"
static void put(float value) { (void)fwrite(&value, sizeof value, 1U, stdout); }
int main(void)
{
    float x[SURROGATE_VARIABLES], values[SURROGATE_POINTS], gradient[SURROGATE_VARIABLES];
    surrogate_band bands[SURROGATE_POINTS];
    int i, k;
    if (surrogate_self_test() != 0) { return 2; }
    for (i = 0; i < SURROGATE_POINTS; i++) { put(surrogate_value_error(i)); }
    while (fread(x, sizeof x, 1U, stdin) == 1U) {
        surrogate_chance chance;
        surrogate_assess(x, 0.95F, values, bands, &chance);
        for (i = 0; i < SURROGATE_POINTS; i++) { put(values[i]); }
        for (i = 0; i < SURROGATE_POINTS; i++) { put(bands[i].total); }
        put(chance.probability);
        put((float)chance.state);
        for (i = 0; i < SURROGATE_POINTS; i++) {
            (void)surrogate_gradient(x, i, gradient);
            for (k = 0; k < SURROGATE_VARIABLES; k++) { put(gradient[k]); }
        }
#ifdef SURROGATE_TIME_STATES
        {
            surrogate_state state;
            if (surrogate_at_temperature(20.0F, &state) != 0 || surrogate_step(&state, 400.0F, x) != 0) { return 5; }
            if (surrogate_read(&state, x, values) != 0) { return 7; }
            for (i = 0; i < SURROGATE_POINTS; i++) { put(values[i]); }
        }
#endif
    }
    return 0;
}
"#;

/// Largest differences that are found: of values as a share of what is stated, of deviations relative to them, of probabilities, of
/// gradients over a whole range and of values over time; and what is stated.
#[derive(Debug, Default)]
struct Apart {
    stated: f64,
    values: f64,
    deviations: f64,
    probabilities: f64,
    gradients: f64,
    over_time: f64,
}

#[test]
fn single_precision_costs_no_more_than_it_says() {
    if !is_there("gcc") {
        skipped("no gcc on this machine");
        return;
    }
    for (name, bytes) in fixtures().into_iter().chain(cancelling()) {
        let surrogate = Surrogate::open(&bytes).expect("the file is intact");
        let folder = folder(&format!("c99-single-{name}"));
        let apart = apart(&surrogate, &folder, &name);
        println!("{name}: {apart:?}");
        assert!(apart.stated < STATED && apart.values <= 1.0 && apart.deviations < 1e-5 && apart.probabilities < 1e-3, "{name}: {apart:?}");
        assert!(apart.gradients < 1e-3 && apart.over_time < 1e-3, "{name}: {apart:?}");
        let _ = std::fs::remove_dir_all(&folder);
    }
}

#[test]
fn the_self_test_in_single_precision_finds_a_build_that_loses_digits() {
    if !is_there("gcc") {
        skipped("no gcc on this machine");
        return;
    }
    for (name, bytes) in cancelling() {
        let surrogate = Surrogate::open(&bytes).expect("the file is intact");
        let folder = folder(&format!("c99-single-wrong-{name}"));
        write(&surrogate, &folder);
        let source = std::fs::read_to_string(folder.join("surrogate.c")).expect("it was just written");
        // As of a compiler that takes what rounding leaves out for zero.
        let kept = "lost + (a.low + b.low)";
        assert!(source.contains(kept), "{name}");
        std::fs::write(folder.join("surrogate.c"), source.replace(kept, &format!("0.0F * ({kept})")))
            .expect("the folder can be written to");
        compile(&folder, &name);
        let status = Command::new(folder.join("driver")).stdin(std::process::Stdio::null()).status().expect("the program starts");
        assert_eq!(status.code(), Some(2), "{name}");
        let _ = std::fs::remove_dir_all(&folder);
    }
}

#[test]
fn what_single_precision_cannot_hold_is_refused() {
    let (bytes, point) = too_large();
    let surrogate = Surrogate::open(&bytes).expect("the file is intact");
    let said = match export(&surrogate, Target::C99Single, "surrogate") {
        Err(ExportError::Single(said)) => said,
        other => panic!("{other:?}"),
    };
    assert!(said.contains(&format!("'{point}'")) && said.contains(" K, and ") && said.ends_with(" K are allowed"), "{said}");
    assert!(export(&surrogate, Target::C99, "surrogate").is_ok());
}

fn write(surrogate: &Surrogate<'_>, folder: &Path) {
    for file in export(surrogate, Target::C99Single, "surrogate").expect("single precision does") {
        std::fs::write(folder.join(&file.name), &file.content).expect("the folder can be written to");
    }
    std::fs::write(folder.join("driver.c"), DRIVER).expect("the folder can be written to");
}

fn compile(folder: &Path, name: &str) {
    let files = ["surrogate.c", "driver.c", "-o", "driver", "-lm"];
    let made = Command::new("gcc").current_dir(folder).args(OPTIONS.split_whitespace()).args(files).output().expect("the compiler starts");
    assert!(made.status.success(), "{name}: {}", String::from_utf8_lossy(&made.stderr));
}

fn apart(surrogate: &Surrogate<'_>, folder: &Path, name: &str) -> Apart {
    write(surrogate, folder);
    compile(folder, name);
    // Conditions that single precision can hold, inside the ranges: what is stated is stated of these.
    let narrow = |x: Vec<f64>| x.into_iter().map(|value| f64::from(value as f32)).collect::<Vec<f64>>();
    let conditions: Vec<Vec<f64>> = conditions(surrogate, 10_000).into_iter().map(narrow).filter(|x| surrogate.in_domain(x)).collect();
    assert!(conditions.len() > 5000);
    let bytes: Vec<u8> = conditions.iter().flatten().flat_map(|value| (*value as f32).to_le_bytes()).collect();
    std::fs::write(folder.join("conditions"), bytes).expect("the folder can be written to");
    let input = std::fs::File::open(folder.join("conditions")).expect("it was just written");
    let output = Command::new(folder.join("driver")).stdin(input).output().expect("the program starts");
    assert!(output.status.success(), "{name}: {}", output.status);
    let found: Vec<f64> = output.stdout.as_chunks::<4>().0.iter().map(|bytes| f64::from(f32::from_le_bytes(*bytes))).collect();

    let points = surrogate.point_count();
    let (stated, rows) = found.split_at(points);
    let gradients = 2 * points + 2;
    let over_time = gradients + points * surrogate.variable_count();
    let width = over_time + if surrogate.in_time().is_some() { points } else { 0 };
    assert_eq!(rows.len(), width * conditions.len());
    let (mut values, mut bands) = (vec![0.0; points], vec![Band::default(); points]);
    let mut gradient = vec![0.0; surrogate.variable_count()];
    let mut apart = Apart { stated: stated.iter().copied().fold(0.0, f64::max), ..Apart::default() };
    for (x, row) in conditions.iter().zip(rows.chunks_exact(width)) {
        let chance = surrogate.assess(x, None, 0.95, &mut values, &mut bands).expect("the shapes fit");
        for point in 0..points {
            apart.values = apart.values.max((row[point] - values[point]).abs() / stated[point]);
            let total = bands[point].total;
            surrogate.gradient(x, point, &mut gradient).expect("the shapes fit");
            let found = &row[gradients + point * gradient.len()..];
            for (own, (found, exact)) in surrogate.variables().zip(found.iter().zip(&gradient)) {
                apart.gradients = apart.gradients.max((found - exact).abs() * (own.high - own.low));
            }
            apart.deviations = apart.deviations.max((row[points + point] - total).abs() / total.max(1e-6));
        }
        let (probability, state) = (row[2 * points], row[2 * points + 1]);
        if chance.probability.is_finite() {
            let own = (probability - chance.probability).abs();
            apart.probabilities = apart.probabilities.max(own);
            let is_clear = (chance.probability - 0.95).abs() > 1e-3 && (chance.probability - 0.05).abs() > 1e-3;
            assert!(!is_clear || state == f64::from(chance.state as u8), "{name}: {x:?}");
        }
        if surrogate.in_time().is_some() {
            let mut state = surrogate.at_temperature(20.0).expect("it moves");
            surrogate.step(&mut state, 400.0, x).expect("a step");
            surrogate.read(&state, x, &mut values).expect("the shapes fit");
            let differences = values.iter().zip(&row[over_time..]).map(|(a, b)| (a - b).abs());
            apart.over_time = differences.fold(apart.over_time, f64::max);
        }
    }
    apart
}
