//! A C program's answers beside those of the runtime.

use std::process::{Command, Output};

use coldplate_capi::{coldplate_close, coldplate_evaluate_batch, coldplate_open};
use coldplate_runtime::{Band, Surrogate, Variable};

use super::{is_there, library, own, run};

#[test]
fn the_example_answers_as_the_runtime_does() {
    let folder = std::env::temp_dir().join(format!("coldplate-capi-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder can be made");
    let program = folder.join("query");
    for (compiler, options) in [("gcc", "-std=c99"), ("clang", "-std=c99"), ("g++", "-x c++ -std=c++11")] {
        if !is_there(compiler) {
            continue;
        }
        let made = run(Command::new(compiler)
            .args(options.split_whitespace())
            .args(["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wconversion", "-I"])
            .arg(own().join("include"))
            .arg(own().join("examples/query.c"))
            .args(["-x", "none"])
            .arg(library())
            .args(["-lm", "-lpthread", "-ldl", "-o"])
            .arg(&program));
        assert!(made.status.success(), "{compiler}: {}", String::from_utf8_lossy(&made.stderr));
        for name in ["uncertain", "polynomial", "bench-thin-plate", "held", "moving", "bench-moving"] {
            let path = own().join(format!("../runtime/fixtures/{name}.cps"));
            let output = run(Command::new(&program).arg(&path));
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            assert_eq!(numbers(&output), expected(&std::fs::read(&path).expect("the fixture is there")), "{compiler}: {name}");
        }
        let refused = run(Command::new(&program).arg(own().join("Cargo.toml")));
        assert_eq!(String::from_utf8_lossy(&refused.stderr).trim(), "this is not a surrogate file");
    }
    if program.exists() && is_there("valgrind") {
        let checked = run(Command::new("valgrind")
            .args(["--error-exitcode=9", "--leak-check=full", "-q"])
            .arg(&program)
            .arg(own().join("../runtime/fixtures/moving.cps")));
        assert!(checked.status.success(), "{}", String::from_utf8_lossy(&checked.stderr));
    }
    let _ = std::fs::remove_dir_all(&folder);
}

/// Every number of the lines that the example prints behind those of the variables.
fn numbers(output: &Output) -> Vec<f64> {
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let lines = text.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit() || c == '-'));
    lines.flat_map(|line| line.split(' ').map(|number| number.parse().expect("a number")).collect::<Vec<f64>>()).collect()
}

fn expected(bytes: &[u8]) -> Vec<f64> {
    let surrogate = Surrogate::open(bytes).expect("the fixtures are intact");
    let x: Vec<f64> = surrogate.variables().map(|v| 0.5 * (v.low + v.high)).collect();
    let mut values = vec![0.0; surrogate.point_count()];
    let mut bands = vec![Band::default(); surrogate.point_count()];
    let chance = surrogate.assess(&x, None, 0.95, &mut values, &mut bands).expect("the shapes fit");
    let mut all: Vec<f64> = values.iter().zip(&bands).flat_map(|(value, band)| [*value, band.total]).collect();
    all.extend([f64::from(chance.state as u8), chance.binding.map_or(-1.0, |index| index as f64), chance.probability]);
    if surrogate.in_time().is_some() {
        let mut state = surrogate.at_temperature(20.0).expect("it moves");
        surrogate.step(&mut state, 600.0, &x).expect("a step");
        surrogate.read(&state, &x, &mut values).expect("the shapes fit");
        all.extend(values);
    }
    all
}

#[test]
fn batches_have_the_bits_of_single_conditions() {
    for bytes in [&include_bytes!("../../../runtime/fixtures/bench-gaussian.cps")[..], include_bytes!("../../../runtime/fixtures/held.cps")]
    {
        let surrogate = Surrogate::open(bytes).expect("the fixture is intact");
        let (variables, points, conditions) = (surrogate.variable_count(), surrogate.point_count(), 13);
        let at = |row: usize, v: Variable<'_>| v.low + row as f64 / 12.0 * (v.high - v.low);
        let x: Vec<f64> = (0..conditions).flat_map(|row| surrogate.variables().map(move |v| at(row, v))).collect();
        let (mut found, mut own) = (vec![0.0; conditions * points], vec![0.0; points]);
        let mut handle = std::ptr::null_mut();
        // SAFETY: the bytes outlive the handle, and every array has the length that is stated.
        let codes = unsafe {
            let opened = coldplate_open(bytes.as_ptr(), bytes.len(), &raw mut handle);
            let right = coldplate_evaluate_batch(handle, x.as_ptr(), variables, found.as_mut_ptr(), points, conditions);
            let wrong = coldplate_evaluate_batch(handle, x.as_ptr(), variables, found.as_mut_ptr(), points - 1, conditions);
            let null = coldplate_evaluate_batch(handle, std::ptr::null(), variables, found.as_mut_ptr(), points, conditions);
            coldplate_close(handle);
            [opened, right, wrong, null]
        };
        // Done, done, a wrong length, a null pointer.
        assert_eq!(codes, [0, 0, 7, 1]);
        for (x, found) in x.chunks_exact(variables).zip(found.chunks_exact(points)) {
            surrogate.evaluate(x, &mut own).expect("the shapes fit");
            assert!(own.iter().zip(found).all(|(a, b)| a.to_bits() == b.to_bits()), "{x:?}");
        }
    }
}

/// Both examples under the sanitizers of gcc (those of clang are a package of their own); the one of C++ asks one handle from four threads.
#[test]
fn sanitizers_find_nothing() {
    let folder = std::env::temp_dir().join(format!("coldplate-capi-sanitized-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder can be made");
    let strict = ["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wconversion", "-Wshadow", "-g", "-O1", "-I"];
    for (compiler, standard, example, sanitizer) in [
        ("gcc", "-std=c99", "query.c", "-fsanitize=address,undefined"),
        ("g++", "-std=c++11", "threads.cpp", "-fsanitize=address,undefined"),
        ("g++", "-std=c++11", "threads.cpp", "-fsanitize=thread"),
    ] {
        if !is_there(compiler) {
            continue;
        }
        let program = folder.join("program");
        let made = run(Command::new(compiler)
            .arg(standard)
            .args(strict)
            .arg(own().join("include"))
            .args([sanitizer, "-fno-sanitize-recover=all"])
            .arg(own().join("examples").join(example))
            .arg(library())
            .args(["-lm", "-lpthread", "-ldl", "-o"])
            .arg(&program));
        let what = format!("{compiler} {sanitizer} {example}");
        assert!(made.status.success(), "{what}: {}", String::from_utf8_lossy(&made.stderr));
        for name in ["uncertain", "held", "moving"] {
            let output = run(Command::new(&program).arg(own().join(format!("../runtime/fixtures/{name}.cps"))));
            assert!(output.status.success(), "{what}, {name}: {}", String::from_utf8_lossy(&output.stderr));
            let said = String::from_utf8_lossy(&output.stdout).into_owned();
            assert!(example == "query.c" || said.trim() == "8000 answers in 4 threads", "{what}, {name}: {said}");
        }
    }
    let _ = std::fs::remove_dir_all(&folder);
}
