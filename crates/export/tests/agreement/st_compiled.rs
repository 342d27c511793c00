//! The function block through open compilers of structured text, where they are at hand: neither comes from a package registry, so that
//! the environment says in which folder they were built.

use std::path::{Path, PathBuf};
use std::process::Command;

use coldplate_export::Target;
use coldplate_runtime::Surrogate;

use crate::st::answers;
use crate::{Terms, compare, fixtures, folder, lay_out, skipped};

const CONDITIONS: usize = 1000;

/// Around what matiec makes of a block: the self-tests, then conditions in and answers out.
const AROUND_MATIEC: &str = r#"
#include <stdio.h>
#include "iec_std_lib.h"
TIME __CURRENT_TIME;
BOOL __DEBUG;
#include "POUS.h"
#include "POUS.c"
#define PUT(array) fwrite(block.array.value.table, sizeof block.array.value.table, 1, stdout)
int main(void)
{
    static BLOCK_SELF_TEST test;
    static BLOCK block;
    double more[3];
    BLOCK_SELF_TEST_init__(&test, 0);
    BLOCK_SELF_TEST_body__(&test);
    if (!__GET_VAR(test.PASSED)) return 3;
#if MOVES
    static BLOCK_IN_TIME_SELF_TEST moved;
    BLOCK_IN_TIME_SELF_TEST_init__(&moved, 0);
    BLOCK_IN_TIME_SELF_TEST_body__(&moved);
    if (!__GET_VAR(moved.PASSED)) return 4;
#endif
    BLOCK_init__(&block, 0);
    while (fread(block.X.value.table, sizeof block.X.value.table, 1, stdin) == 1) {
        BLOCK_body__(&block);
        PUT(VALUES);
        PUT(BANDS);
        more[0] = __GET_VAR(block.INSIDE);
        fwrite(more, sizeof *more, 1, stdout);
#if MOST_LIMITS
        PUT(LIMITED);
        PUT(MARGINS);
        PUT(PROBABILITIES);
#endif
        more[0] = __GET_VAR(block.STATE);
        more[1] = __GET_VAR(block.BINDING);
        more[2] = __GET_VAR(block.PROBABILITY);
        fwrite(more, sizeof *more, 3, stdout);
    }
    return 0;
}
"#;

/// The same around what STruC++ makes of it.
const AROUND_STRUCPP: &str = r#"
#include <cstdio>
#include "block.hpp"
static void put(double value) { fwrite(&value, sizeof value, 1, stdout); }
template <class Array> static void all(Array &own, int length) { for (int k = 0; k < length; ++k) put(static_cast<double>(own[k])); }
int main()
{
    static strucpp::BLOCK_SELF_TEST test;
    static strucpp::BLOCK block;
    test();
    if (!test.PASSED) return 3;
#if MOVES
    static strucpp::BLOCK_IN_TIME_SELF_TEST moved;
    moved();
    if (!moved.PASSED) return 4;
#endif
    double x[WIDTH];
    while (fread(x, sizeof x, 1, stdin) == 1) {
        for (int k = 0; k < WIDTH; ++k) block.X[k] = x[k];
        block();
        all(block.VALUES, MOST_POINTS);
        all(block.BANDS, MOST_POINTS);
        put(block.INSIDE);
#if MOST_LIMITS
        all(block.LIMITED, MOST_LIMITS);
        all(block.MARGINS, MOST_LIMITS);
        all(block.PROBABILITIES, MOST_LIMITS);
#endif
        put(block.STATE);
        put(block.BINDING);
        put(block.PROBABILITY);
    }
    return 0;
}
"#;

fn place(variable: &str) -> Option<PathBuf> {
    let found = std::env::var_os(variable).map(PathBuf::from);
    if found.is_none() {
        skipped(&format!("no compiler of structured text: {variable} names no folder"));
    }
    found
}

fn done(command: &mut Command, what: &str) {
    let output = command.output().expect("the program starts");
    let said = [output.stdout, output.stderr].map(|own| String::from_utf8_lossy(&own).into_owned());
    assert!(output.status.success(), "{what}: {}{}", said[0], said[1]);
}

/// Compiles every block by `translate`, which is given the folder, the text's name and a folder of its own, and what is around it by
/// `build`; then compares.
fn agree(kind: &str, around: &str, source: &str, translate: impl Fn(&Path, &str, &Path), build: impl Fn(&Path) -> Command) {
    let folder = folder(kind);
    let names = lay_out(&folder, Target::St, |_| CONDITIONS);
    for (fixture, bytes) in fixtures() {
        let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
        let name = names.iter().find(|own| **own == fixture || **own == fixture.replace('-', "_")).expect("it was exported");
        let own = folder.join(format!("{name}-made"));
        std::fs::create_dir_all(&own).expect("the folder can be written to");
        translate(&folder, name, &own);
        let block = name.to_uppercase();
        let text = around.replace("BLOCK", &block).replace("block.hpp", &format!("{name}.hpp"));
        std::fs::write(own.join(source), text).expect("the folder can be written to");
        let program = own.join("program");
        let mut compiler = build(&own);
        let define = |name: &str, value: usize| format!("-D{name}={value}");
        compiler.args([
            define("WIDTH", surrogate.variable_count()),
            define("MOST_POINTS", surrogate.point_count()),
            define("MOST_LIMITS", surrogate.limit_count()),
            define("MOVES", usize::from(surrogate.in_time().is_some())),
        ]);
        done(compiler.current_dir(&own).args(["-O1", "-w", "-ffp-contract=off", "-o"]).arg(&program).arg("-lm"), name);
        let read = std::fs::File::open(folder.join(format!("{name}.in"))).expect("it was written");
        let write = std::fs::File::create(folder.join(format!("{name}.out"))).expect("the folder can be written to");
        let ended = Command::new(&program).stdin(read).stdout(write).status().expect("it starts");
        assert!(ended.success(), "{kind}, {name}: {ended}");
    }
    compare(&folder, &names, &Terms { answers, order_is_own: true });
    let _ = std::fs::remove_dir_all(&folder);
}

#[test]
fn matiec_compiles_it() {
    let Some(matiec) = place("COLDPLATE_MATIEC") else { return };
    let translate = |folder: &Path, name: &str, own: &Path| {
        let text = folder.join(format!("{name}.st"));
        done(Command::new(matiec.join("iec2c")).arg("-I").arg(matiec.join("lib")).arg("-T").arg(own).arg(text), name);
    };
    let build = |_: &Path| {
        let mut gcc = Command::new("gcc");
        gcc.arg("-I").arg(matiec.join("lib/C")).args(["-I", ".", "around.c"]);
        gcc
    };
    agree("matiec", AROUND_MATIEC, "around.c", translate, build);
}

#[test]
fn strucpp_compiles_it() {
    let Some(strucpp) = place("COLDPLATE_STRUCPP") else { return };
    let translate = |folder: &Path, name: &str, own: &Path| {
        let text = folder.join(format!("{name}.st"));
        done(Command::new("node").arg(strucpp.join("dist/node/cli.js")).arg(text).arg("-o").arg(own.join(format!("{name}.cpp"))), name);
        std::fs::rename(own.join(format!("{name}.cpp")), own.join("made.cpp")).expect("it was made");
    };
    let build = |_: &Path| {
        let mut gcc = Command::new("g++");
        gcc.arg("-std=c++17").arg("-I").arg(strucpp.join("src/runtime/include")).args(["-I", ".", "made.cpp", "around.cpp"]);
        gcc
    };
    agree("strucpp", AROUND_STRUCPP, "around.cpp", translate, build);
}
