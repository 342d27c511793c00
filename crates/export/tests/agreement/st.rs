//! The function block, run by a small interpreter, since no compiler of structured text comes from a package registry
//! ([`crate::st_compiled`] takes those that were built by hand).

use std::process::Command;

use coldplate_export::Target;
use coldplate_runtime::{Band, Surrogate};

use crate::{Terms, compare, folder, is_there, lay_out, skipped};

pub const INTERPRETER: &str = include_str!("structured_text.js");

/// Runs the last block of some files once, and prints its outputs.
pub const SHOW: &str = r#"
const text = process.argv.slice(1).map((path) => require("fs").readFileSync(path, "utf8")).join("\n");
const { variables, make } = Object.values(require("./structured_text.js")(text)).pop();
const block = make();
block.run();
for (const [name, own] of Object.entries(variables)) {
    if (own.part === "VAR_OUTPUT") console.log(name.toLowerCase(), own.element === "LREAL" ? block[name].toFixed(4) : String(block[name]));
}
"#;

/// For every block: runs its self-test, reads conditions, writes what `answers` lists.
const DRIVER: &str = r#"
const fs = require("fs");
const structuredText = require("./structured_text.js");
for (const name of fs.readFileSync("names", "utf8").trim().split("\n")) {
    const blocks = structuredText(fs.readFileSync(name + ".st", "utf8"));
    const test = blocks[name.toUpperCase() + "_SELF_TEST"].make();
    test.run();
    if (test.PASSED !== true) throw new Error(name + ": self-test");
    const block = blocks[name.toUpperCase()].make();
    const bytes = fs.readFileSync(name + ".in");
    const input = new Float64Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
    const width = block.X.length;
    const all = [];
    for (let row = 0; row * width < input.length; row += 1) {
        block.X = [...input.subarray(row * width, (row + 1) * width)];
        block.run();
        all.push(...block.VALUES, ...block.BANDS, Number(block.INSIDE));
        if (block.LIMITED) all.push(...block.LIMITED, ...block.MARGINS, ...block.PROBABILITIES);
        all.push(block.STATE, block.BINDING, block.PROBABILITY);
    }
    fs.writeFileSync(name + ".out", Buffer.from(new Float64Array(all).buffer));
}
"#;

fn count(name: &str) -> usize {
    if name.starts_with("bench") { 1000 } else { 10_000 }
}

/// Values, half widths, inside, per limit what is limited, its margin and its probability, and the verdict.
pub fn answers(surrogate: &Surrogate<'_>, x: &[f64]) -> Vec<f64> {
    let points = surrogate.point_count();
    let (mut values, mut bands) = (vec![0.0; points], vec![Band::default(); points]);
    let chance = surrogate.assess(x, None, 0.95, &mut values, &mut bands).expect("the shapes fit");
    let limits: Vec<_> =
        (0..surrogate.limit_count()).map(|own| surrogate.limit_chance(own, x, None, &values).expect("the limit exists")).collect();
    let mut all = values.clone();
    all.extend(bands.iter().map(|band| band.half_width()));
    all.push(f64::from(u8::from(chance.in_domain)));
    all.extend(limits.iter().map(|own| own.value));
    all.extend(limits.iter().map(|own| own.maximum - own.value));
    all.extend(limits.iter().map(|own| own.probability));
    all.push(f64::from(chance.state as u8));
    all.push(chance.binding.map_or(-1.0, |binding| binding as f64));
    all.push(if limits.is_empty() { 0.0 } else { chance.probability });
    all
}

#[test]
fn a_controller_answers_as_the_runtime_does() {
    if !is_there("node") {
        skipped("node is not on this machine");
        return;
    }
    let folder = folder("st");
    let names = lay_out(&folder, Target::St, count);
    std::fs::write(folder.join("structured_text.js"), INTERPRETER).expect("the folder can be written to");
    std::fs::write(folder.join("driver.js"), DRIVER).expect("the folder can be written to");
    let output = Command::new("node").current_dir(&folder).arg("driver.js").output().expect("node starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    compare(&folder, &names, &Terms { answers, order_is_own: true });
    let _ = std::fs::remove_dir_all(&folder);
}

/// What the interpreter would refuse, it refuses: otherwise its word on the blocks is worth little.
#[test]
fn the_interpreter_refuses_what_is_wrong() {
    if !is_there("node") {
        skipped("node is not on this machine");
        return;
    }
    let folder = folder("st-wrong");
    std::fs::write(folder.join("structured_text.js"), INTERPRETER).expect("the folder can be written to");
    let declared = "VAR_INPUT x : LREAL; END_VAR VAR y : LREAL; k : DINT; t : ARRAY [0..1] OF LREAL; END_VAR";
    for (body, accepted) in [
        ("y := x + 1.0; t[k] := SQRT(y);", true),
        ("y := x + 1;", false),
        ("z := x;", false),
        ("x := y;", false),
        ("t[y] := x;", false),
        ("IF x THEN y := 1.0; END_IF;", false),
        ("y := 1 / k;", false),
        ("t[k + 2] := x;", false),
        ("y := SIN(x);", false),
        ("y := x", false),
    ] {
        let text = format!("FUNCTION_BLOCK b {declared} {body} END_FUNCTION_BLOCK");
        std::fs::write(folder.join("b.st"), text).expect("the folder can be written to");
        let program = r#"require("./structured_text.js")(require("fs").readFileSync("b.st", "utf8")).B.make().run()"#;
        let output = Command::new("node").current_dir(&folder).args(["-e", program]).output().expect("node starts");
        assert_eq!(output.status.success(), accepted, "{body}: {}", String::from_utf8_lossy(&output.stderr));
    }
    let _ = std::fs::remove_dir_all(&folder);
}
