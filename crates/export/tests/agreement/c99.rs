use std::path::Path;
use std::process::Command;

use coldplate_export::{Target, export};
use coldplate_runtime::Surrogate;

use crate::{answers, conditions, fixtures, folder, is_there, skipped, worst};

const WARNINGS: &str = "-Wall -Wextra -Wpedantic -Werror -Wconversion -Wshadow -Wdouble-promotion";
/// With the first compiler; a tenth of it with the others.
const CONDITIONS: usize = 10_000;

/// Reads conditions from standard input, writes what `answers` lists to standard output.
const DRIVER: &str = r#"
#include <math.h>
#include <stdio.h>
#include "surrogate.h"
static void put(double value) { (void)fwrite(&value, sizeof value, 1U, stdout); }
int main(void)
{
    double x[SURROGATE_VARIABLES], values[SURROGATE_POINTS], gradient[SURROGATE_VARIABLES];
    surrogate_band bands[SURROGATE_POINTS];
    int i, k;
    if (surrogate_self_test() != 0) { return 2; }
    if (surrogate_gradient(x, SURROGATE_POINTS, gradient) != -1 || surrogate_gradient(x, -1, gradient) != -1) { return 3; }
    while (fread(x, sizeof x, 1U, stdin) == 1U) {
        surrogate_verdict verdict;
        put((double)surrogate_in_domain(x));
        surrogate_evaluate(x, values);
        for (i = 0; i < SURROGATE_POINTS; i++) { put(values[i]); }
        for (i = 0; i < SURROGATE_POINTS; i++) {
            (void)surrogate_gradient(x, i, gradient);
            for (k = 0; k < SURROGATE_VARIABLES; k++) { put(gradient[k]); }
        }
        for (i = 0; i < 2; i++) {
            surrogate_chance chance;
            surrogate_assess(x, (i == 0) ? 0.95 : 0.8, values, bands, &chance);
            put((double)chance.state); put((double)chance.in_domain); put((double)chance.binding); put(chance.probability);
        }
        for (i = 0; i < SURROGATE_POINTS; i++) { put(values[i]); }
        for (i = 0; i < SURROGATE_POINTS; i++) { put(bands[i].fit); put(bands[i].parameters); put(bands[i].misses); put(bands[i].total); }
        surrogate_query(x, values, &verdict);
        put((double)verdict.state); put((double)verdict.in_domain); put((double)verdict.binding); put(verdict.value); put(verdict.margin);
        for (i = 0; i < SURROGATE_LIMITS; i++) {
            surrogate_limit_value own;
            surrogate_limit_chance chance;
            if (surrogate_limit(i, x, values, &own) != 0 || surrogate_limit_probability(i, x, values, &chance) != 0) { return 4; }
            put(own.value); put(own.low); put(own.high); put(own.maximum); put(own.margin); put((double)own.state);
            put(chance.value); put(chance.band.fit); put(chance.band.parameters); put(chance.band.misses); put(chance.band.total);
            put(chance.probability);
        }
#ifdef SURROGATE_TIME_STATES
        {
            /* From 20 degrees everywhere to this condition and back to readings of it. */
            surrogate_state state;
            double nothing[SURROGATE_VARIABLES];
            for (i = 0; i < SURROGATE_VARIABLES; i++) { nothing[i] = HUGE_VAL; }
            if (surrogate_at_temperature(20.0, &state) != 0 || surrogate_step(&state, 400.0, x) != 0) { return 5; }
            if (surrogate_step(&state, -1.0, x) != -1 || surrogate_step(&state, 1.0, nothing) != -1) { return 6; }
            if (surrogate_read(&state, x, values) != 0) { return 7; }
            for (i = 0; i < SURROGATE_POINTS; i++) { put(values[i]); }
            values[0] = HUGE_VAL;
            if (surrogate_at_readings(x, values, 0.1, &state) != 0 || surrogate_read(&state, x, values) != 0) { return 8; }
            for (i = 0; i < SURROGATE_POINTS; i++) { put(values[i]); put(surrogate_time_error(i)); }
        }
#endif
    }
    return 0;
}
"#;

/// A compiler and its options.
struct Build {
    compiler: &'static str,
    options: &'static str,
}

/// What is compiled and run with each, where the machine has it.
const BUILDS: [Build; 6] = [
    Build { compiler: "gcc", options: "-std=c99 -O2" },
    Build { compiler: "g++", options: "-x c++ -std=c++11 -O2" },
    Build { compiler: "clang", options: "-std=c99 -O2" },
    Build { compiler: "gcc", options: "-std=c99 -O1 -g -fsanitize=address,undefined -fno-sanitize-recover=all" },
    Build { compiler: "gcc", options: "-std=c99 -O2 -m32 -msse2 -mfpmath=sse" },
    Build { compiler: "gcc", options: "-std=c99 -O3 -march=native -ffp-contract=off" },
];

#[test]
fn the_c_answers_as_the_runtime_does_with_every_compiler() {
    for (number, build) in BUILDS.iter().enumerate() {
        if let Err(reason) = is_usable(build) {
            skipped(&format!("{} {}: {reason}", build.compiler, build.options));
            continue;
        }
        let mut most = 0.0_f64;
        for (name, bytes) in fixtures() {
            let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
            let folder = folder(&format!("c99-{number}-{name}"));
            let count = if number == 0 { CONDITIONS } else { CONDITIONS / 10 };
            let (apart, place) = agreement(&surrogate, &folder, build, count);
            assert!(apart < 1e-12, "{} {}: {name}: {apart:e} at answer {place}", build.compiler, build.options);
            most = most.max(apart);
            let _ = std::fs::remove_dir_all(&folder);
        }
        println!("{} {}: agrees to {most:.1e}", build.compiler, build.options);
    }
}

/// Whether the compiler is there and makes programs with these options.
fn is_usable(build: &Build) -> Result<(), String> {
    if !is_there(build.compiler) {
        return Err("no such compiler on this machine".into());
    }
    let folder = folder("try");
    std::fs::write(folder.join("try.c"), "#include <math.h>\nint main(void) { return (int)floor(0.5); }\n")
        .expect("the folder can be written to");
    let outcome = compile(&folder, build, &["try.c"], "try");
    let _ = std::fs::remove_dir_all(&folder);
    outcome.map_err(|text| text.lines().next().unwrap_or("it fails").to_owned())
}

fn compile(folder: &Path, build: &Build, sources: &[&str], out: &str) -> Result<(), String> {
    let options = build.options.split_whitespace().chain(WARNINGS.split_whitespace());
    let made = Command::new(build.compiler).current_dir(folder).args(options).args(sources).args(["-o", out, "-lm"]).output();
    let made = made.expect("the compiler starts");
    if made.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&made.stderr).into_owned()) }
}

/// Compiles the surrogate with the driver, runs it, and compares every answer.
fn agreement(surrogate: &Surrogate<'_>, folder: &Path, build: &Build, count: usize) -> (f64, usize) {
    for file in export(surrogate, Target::C99, "surrogate").expect("the name is one") {
        std::fs::write(folder.join(&file.name), &file.content).expect("the folder can be written to");
    }
    std::fs::write(folder.join("driver.c"), DRIVER).expect("the folder can be written to");
    compile(folder, build, &["surrogate.c", "driver.c"], "driver")
        .unwrap_or_else(|text| panic!("{} {}: {text}", build.compiler, build.options));
    let conditions = conditions(surrogate, count);
    let bytes: Vec<u8> = conditions.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    std::fs::write(folder.join("conditions"), bytes).expect("the folder can be written to");
    let input = std::fs::File::open(folder.join("conditions")).expect("it was just written");
    let output = Command::new(folder.join("driver")).stdin(input).output().expect("the program starts");
    assert!(output.status.success(), "{}: {}", output.status, String::from_utf8_lossy(&output.stderr));
    let found: Vec<f64> = output.stdout.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    let expected: Vec<f64> = conditions.iter().flat_map(|x| [answers(surrogate, x), moved(surrogate, x)].concat()).collect();
    let (apart, place) = worst(&found, &expected);
    (apart, place % (expected.len() / conditions.len()))
}

/// What the driver prints of a machine over time.
fn moved(surrogate: &Surrogate<'_>, x: &[f64]) -> Vec<f64> {
    let Some(own) = surrogate.in_time() else { return Vec::new() };
    let mut values = vec![0.0; surrogate.point_count()];
    let mut state = surrogate.at_temperature(20.0).expect("it moves");
    surrogate.step(&mut state, 400.0, x).expect("a step");
    surrogate.read(&state, x, &mut values).expect("the shapes fit");
    let mut all = values.clone();
    values[0] = f64::INFINITY;
    let state = surrogate.at_readings(x, &values, 0.1).expect("readings");
    surrogate.read(&state, x, &mut values).expect("the shapes fit");
    all.extend(values.iter().enumerate().flat_map(|(point, value)| [*value, own.error(point)]));
    all
}
