//! The package in Rumoca, an open Modelica compiler.

use std::process::Command;

use coldplate_export::Target;

use crate::{Terms, compare, folder, lay_out, margins, python_with};

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
    assert_eq!(names.len(), 6, "{names:?}");
    let output = Command::new(python).current_dir(&folder).args(["-c", DRIVER]).output().expect("python3 starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    compare(&folder, &names, &Terms { answers: margins, cancelling: 5e-12 });
    let _ = std::fs::remove_dir_all(&folder);
}
