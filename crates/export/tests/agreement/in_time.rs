//! The machine over time beside the runtime, in the languages that step it: JavaScript, Octave, structured text.

use std::path::Path;
use std::process::Command;

use coldplate_export::Target;

use crate::st::INTERPRETER;
use crate::{compare_courses, folder, is_there, lay_out, seconds, skipped};

/// Most steps of a run.
const STEPS: usize = 60;

/// For every page that moves: takes its own data and arithmetic, and steps it.
const PAGES: &str = r#"
const fs = require("fs");
for (const name of fs.readFileSync("names", "utf8").trim().split("\n").filter((name) => name.endsWith("moving"))) {
    const page = fs.readFileSync(name + ".html", "utf8");
    const [data, code] = [...page.matchAll(/<script[^>]*>([^]*?)<\/script>/g)].map((found) => found[1]);
    const s = JSON.parse(data);
    const core = code.slice(0, code.indexOf("\n(() => {"));
    const { coldplate, coldplateInTime } = new Function(core + "; return { coldplate, coldplateInTime };")();
    const motion = coldplateInTime(s, coldplate(s));
    if (!motion.selfTest()) throw new Error(name + ": self-test");
    const bytes = fs.readFileSync(name + ".in");
    const numbers = [...new Float64Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length))];
    const width = s.variables.length;
    const x = Array.from({ length: numbers.length / width }, (_, row) => numbers.slice(row * width, (row + 1) * width));
    const all = [];
    for (const begin of [motion.atRest(x[0]), motion.atTemperature(18)]) {
        let state = begin;
        for (let k = 1; k < x.length; k += 1) {
            const at = motion.here(x[k]);
            state = motion.step(state, [0.5, 60, 900, 3600, 5][k % 5], at);
            all.push(...motion.read(state, at));
        }
    }
    fs.writeFileSync(name + ".course", Buffer.from(new Float64Array(all).buffer));
}
"#;

/// The same in Octave.
const FUNCTIONS: &str = r#"
names = strsplit(strtrim(fileread("names")), "\n");
for k = find(endsWith(names, "moving"))
    answer = str2func([names{k} "_in_time"]);
    shape = sscanf(fileread([names{k} ".shape"]), "%d");
    f = fopen([names{k} ".in"]); x = fread(f, [shape, Inf], "double").'; fclose(f);
    seconds = [0.5 60 900 3600 5];
    f = fopen([names{k} ".course"], "w");
    for begin = 1:2
        if begin == 1
            state = answer("rest", x(1, :));
        else
            state = answer("temperature", 18);
        end
        for row = 2:size(x, 1)
            [state, values] = answer("step", state, seconds(mod(row - 1, 5) + 1), x(row, :));
            assert(isequal(values, answer("read", state, x(row, :))));
            fwrite(f, values, "double");
        end
    end
    fclose(f);
    for wrong = {{"rest", [1 2]}, {"rest", nan(1, shape)}, {"temperature", Inf}, {"step", state, -1, x(1, :)}, {"stop"}}
        refused = false;
        try
            answer(wrong{1}{:});
        catch
            refused = true;
        end
        assert(refused);
    end
end
"#;

/// The same of structured text, by the interpreter.
const BLOCKS: &str = r#"
const fs = require("fs");
const structuredText = require("./structured_text.js");
for (const name of fs.readFileSync("names", "utf8").trim().split("\n").filter((name) => name.endsWith("moving"))) {
    const blocks = structuredText(fs.readFileSync(name + ".st", "utf8"));
    const test = blocks[name.toUpperCase() + "_IN_TIME_SELF_TEST"].make();
    test.run();
    if (test.PASSED !== true) throw new Error(name + ": self-test");
    const bytes = fs.readFileSync(name + ".in");
    const numbers = [...new Float64Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length))];
    const all = [];
    const block = blocks[name.toUpperCase() + "_IN_TIME"].make();
    const width = block.X.length;
    const call = (row, seconds, more) => {
        Object.assign(block, { X: numbers.slice(row * width, (row + 1) * width), SECONDS: seconds, RESTART: false, ...more });
        block.run();
        if (!block.ACCEPTED) throw new Error(name + ": refused");
    };
    for (const begin of [{ AT_REST: true, RESTART: true }, { AT_REST: false, RESTART: true, INITIAL_TEMPERATURE: 18 }]) {
        call(0, 0, begin);
        for (let row = 1; row * width < numbers.length; row += 1) {
            call(row, [0.5, 60, 900, 3600, 5][row % 5]);
            all.push(...block.NOW);
        }
    }
    const before = block.NOW.slice();
    for (const wrong of [{ SECONDS: -1 }, { SECONDS: NaN }, { X: block.X.map(() => Infinity) }, { INITIAL_TEMPERATURE: NaN }]) {
        const kept = { SECONDS: block.SECONDS, X: block.X, INITIAL_TEMPERATURE: block.INITIAL_TEMPERATURE };
        Object.assign(block, wrong);
        block.run();
        if (block.ACCEPTED || block.NOW.some((value, p) => value !== before[p])) throw new Error(name + ": it moved");
        Object.assign(block, kept);
    }
    fs.writeFileSync(name + ".course", Buffer.from(new Float64Array(all).buffer));
}
"#;

/// Runs a program on the files of a target, and compares what it wrote.
fn moves(target: Target, program: &str, driver: &str, arguments: &[&str], also: &[(&str, &str)]) {
    if !is_there(program) {
        skipped(&format!("{program} is not on this machine"));
        return;
    }
    let folder = folder(&format!("in-time-{}", target.key()));
    lay_out(&folder, target, |_| STEPS + 1);
    let write = |name: &str, text: &str| std::fs::write(Path::new(&folder).join(name), text).expect("the folder can be written to");
    write("driver", driver);
    also.iter().for_each(|(name, text)| write(name, text));
    let output = Command::new(program).current_dir(&folder).args(arguments).output().expect("the program starts");
    assert!(output.status.success(), "{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    compare_courses(&folder, seconds, 1e-9);
    let _ = std::fs::remove_dir_all(&folder);
}

#[test]
fn pages_move_as_the_runtime_does() {
    moves(Target::Html, "node", PAGES, &["driver"], &[]);
}

#[test]
fn octave_moves_as_the_runtime_does() {
    moves(Target::Octave, "octave-cli", FUNCTIONS, &["--norc", "driver"], &[]);
}

#[test]
fn structured_text_moves_as_the_runtime_does() {
    moves(Target::St, "node", BLOCKS, &["driver"], &[("structured_text.js", INTERPRETER)]);
}
