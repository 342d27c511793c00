//! The package in Rumoca, an open Modelica compiler.

use std::process::Command;

use coldplate_export::Target;
use coldplate_runtime::{State, Surrogate};

use crate::{Terms, compare, fixtures, folder, lay_out, margins, python_with, worst};

/// Simulates the last model of some files for a second, and prints its own variables at the end.
pub const SHOW: &str = r#"
import os, re, sys
import rumoca
text = "\n".join(open(path).read() for path in sys.argv[1:])
os.mkdir("both")
open("both/both.mo", "w").write(text)
model = re.findall(r"^model (\w+)", text, re.M)[-1]
result = rumoca.Session().load("both/both.mo", model=model).simulate(t=(0, 1), dt=1.0).to_dict()
for name in result["names"]:
    if "." not in name:
        print(name, f"{result['data'][name][-1]:.4f}")
"#;

/// For every package: variables that swing through the range and out of it while time goes on; writes them, and what `margins` lists.
const DRIVER: &str = r#"
import os
import numpy as np
import rumoca
for name in open("names").read().split():
    corners = np.fromfile(name + ".in").reshape(-1, int(open(name + ".shape").read()))
    low, high = corners[0], corners[2 ** corners.shape[1] - 1]
    text = open(name + ".mo").read()
    swings = []
    for v in range(len(low)):
        middle, half = float(0.5 * low[v] + 0.5 * high[v]), float(0.5 * (high[v] - low[v]))
        # Where a range is positive, no lower than half its low end.
        reach = min(1.4, float((middle - 0.5 * low[v]) / half)) if low[v] > 0 and half > 0 else 1.4
        swings.append(f"{middle!r} + {reach * half!r} * sin({7.0 + 3.1 * v} * time + {0.9 * v})")
    text += "\nmodel Swing\n  " + name + ".Surrogate plate;\nequation\n  plate.x = {" + ", ".join(swings) + "};\nend Swing;\n"
    # The compiler reads every file of a folder. A condition of 200 centres takes it a tenth of a second.
    os.mkdir(name)
    open(name + "/swing.mo", "w").write(text)
    result = rumoca.Session().load(name + "/swing.mo", model="Swing").simulate(t=(0, 1), dt=0.01 if name == "bare" else 0.001).to_dict()
    data = result["data"]
    columns = lambda what: [data[own] for own in result["names"] if own.startswith("plate." + what + "[")]
    x = np.array(columns("x")).T
    inside = np.array(data["plate.inside"], dtype=float)
    x.tofile(name + ".in")
    np.array(columns("values") + columns("bands") + [inside] + columns("margins")).T.tofile(name + ".out")
    assert len(x) > 100 and 0 < inside.mean() < 1, (name, len(x), inside.mean())
"#;

#[test]
fn a_modelica_compiler_answers_as_the_runtime_does() {
    let Some(python) = python_with("rumoca, numpy") else { return };
    let folder = folder("modelica");
    // The compiler unrolls the loops over centres and points: of the larger files it makes millions of equations.
    let mut names = lay_out(&folder, Target::Modelica, |_| 64);
    names.retain(|name| !name.starts_with("bench"));
    std::fs::write(folder.join("names"), names.join("\n")).expect("the folder can be written to");
    assert_eq!(names.len(), 7, "{names:?}");
    let output = Command::new(python).current_dir(&folder).args(["-c", DRIVER]).output().expect("python3 starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    compare(&folder, &names, &Terms { answers: margins, order_is_own: true });
    let _ = std::fs::remove_dir_all(&folder);
}

/// Step of the differences, s.
const H: f64 = 1e-3;

/// For every package that moves: variables that swing, from both beginnings; writes them with the states, then what the points read
/// and how the states move. The times are those of the simulation, which has steps of its own.
const COURSES: &str = r#"
import os
import numpy as np
import rumoca
for name in [own for own in open("names").read().split() if own.endswith("moving")]:
    corners = np.fromfile(name + ".in").reshape(-1, int(open(name + ".shape").read()))
    low, high = corners[0], corners[2 ** corners.shape[1] - 1]
    swings = [f"{float(0.5 * (a + b))!r} + {float(0.4 * (b - a))!r} * sin({0.02 + 0.01 * v} * time + {0.9 * v})" for v, (a, b) in enumerate(zip(low, high))]
    rows = []
    for number, begin in enumerate(["at_rest = true", "at_rest = false, initial_temperature = 18.0"]):
        folder = f"{name}-{number}"
        os.mkdir(folder)
        text = open(name + ".mo").read()
        text += f"\nmodel Swing\n  {name}.InTime plate({begin});\nequation\n  plate.x = {{{', '.join(swings)}}};\nend Swing;\n"
        open(folder + "/swing.mo", "w").write(text)
        result = rumoca.Session().load(folder + "/swing.mo", model="Swing").simulate(t=(0, 300), dt=5.0).to_dict()
        data = result["data"]
        columns = lambda what: [data[own] for own in result["names"] if own.startswith("plate." + what + "[")]
        rows.append(np.array([data["time"] if "time" in data else result["time"]] + columns("x") + columns("states") + columns("now") + columns("slopes")).T)
    np.array(rows).tofile(name + ".course")
"#;

#[test]
fn a_modelica_compiler_moves_as_the_runtime_does() {
    let Some(python) = python_with("rumoca, numpy") else { return };
    let folder = folder("modelica-moving");
    let mut names = lay_out(&folder, Target::Modelica, |_| 64);
    names.retain(|name| name == "moving");
    std::fs::write(folder.join("names"), names.join("\n")).expect("the folder can be written to");
    let output = Command::new(python).current_dir(&folder).args(["-c", COURSES]).output().expect("python3 starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let bytes = std::fs::read(folder.join("moving.course")).expect("it was written");
    let numbers: Vec<f64> = bytes.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    let (_, file) = fixtures().into_iter().find(|(name, _)| name == "moving").expect("it is one of the fixtures");
    let surrogate = Surrogate::open(&file).expect("the fixtures are intact");
    let (variables, points) = (surrogate.variable_count(), surrogate.point_count());
    let count = surrogate.in_time().expect("the file moves").states();
    let rows: Vec<&[f64]> = numbers.chunks_exact(1 + variables + 2 * count + points).collect();
    assert!(rows.len() > 100, "{}", rows.len());
    let (mut read, mut moved) = (0.0_f64, 0.0_f64);
    for row in &rows {
        let (x, rest) = row[1..].split_at(variables);
        let (states, rest) = rest.split_at(count);
        let (now, slopes) = rest.split_at(points);
        let mut all = surrogate.at_temperature(0.0).expect("the file moves").numbers();
        all[..count].copy_from_slice(states);
        let state = State::from_numbers(&all);
        let mut values = vec![0.0; points];
        surrogate.read(&state, x, &mut values).expect("the shapes fit");
        read = read.max(worst(now, &values).0);
        // How the states of the runtime move, by differences of second order.
        let after = |seconds: f64| {
            let mut state = state;
            surrogate.step(&mut state, seconds, x).expect("the numbers are finite");
            state.numbers()
        };
        let (one, two) = (after(H), after(2.0 * H));
        for k in 0..count {
            moved = moved.max((slopes[k] - (4.0 * one[k] - 3.0 * states[k] - two[k]) / (2.0 * H)).abs());
        }
    }
    // Both beginnings are those that were asked for.
    let start = |state: State| state.numbers()[..count].to_vec();
    let begins = [surrogate.at_rest(&rows[0][1..=variables]), surrogate.at_temperature(18.0)];
    for (row, begin) in [rows[0], rows[rows.len() / 2]].into_iter().zip(begins) {
        assert!(worst(&row[1 + variables..1 + variables + count], &start(begin.expect("it is a number"))).0 < 1e-9);
    }
    println!("moving: what points read {read:.1e}, how states move {moved:.1e} a second");
    assert!(read < 1e-9, "{read:e}");
    assert!(moved < 1e-8, "{moved:e}");
    let _ = std::fs::remove_dir_all(&folder);
}
