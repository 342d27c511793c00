use coldplate_export::{ExportError, Target, export};
use coldplate_runtime::Surrogate;

use crate::{fixtures, folder, is_there, skipped};

/// Python, which shares nothing with the writer, evaluates the polynomials and bases of the object by the formulas of the
/// format's page and finds the self-test vectors.
const READER: &str = r#"
import json, math, sys
for path in sys.argv[1:]:
    s = json.load(open(path, encoding="utf-8"))
    worst = 0.0
    g = {"identity": lambda x: x, "reciprocal": lambda x: 1 / x, "log": math.log}
    kernel = {"thin_plate": lambda q: 0.5 * q * math.log(q) if q > 0 else 0.0, "cubic": lambda q: q ** 1.5,
              "multiquadric": lambda q: math.sqrt(1 + q), "gaussian": lambda q: math.exp(-q)}
    for test in s["self_tests"]:
        x = test["condition"]
        u = [(g[k["transform"]](x[k["variable"]]) - k["low"]) * k["factor"] + k["offset"] for k in s["scalings"]]
        value = [0.0] * len(s["points"])
        for p in s["polynomials"]:
            v = [u[i] for i in p["scalings"]]
            for e, row in zip(p["exponents"], p["coefficients"]):
                for point, c in zip(p["points"], row):
                    value[point] += c * math.prod(a ** b for a, b in zip(v, e))
        for b in s["bases"]:
            v = [u[i] for i in b["scalings"]]
            for z, row in zip(b["centres"], b["weights"]):
                phi = kernel[b["kernel"]](sum((r * (a - c)) ** 2 for r, a, c in zip(b["scales"], v, z)))
                for point, w in zip(b["points"], row):
                    value[point] += w * phi
        own = s.get("uncertainty", {})
        if "mean" in own:
            v = [u[i] for i in own["scalings"]]
            k = len(own["parameters"])
            for point in range(len(value)):
                for e, row in zip(own["exponents"], own["slopes"][point]):
                    value[point] += math.prod(a ** b for a, b in zip(v, e)) * sum(c * m for c, m in zip(row, own["mean"]))
                missed = own["missed"][point]
                value[point] += missed["own"] * own["mean"][k + point] + missed["common"] * own["mean"][-1]
        worst = max([worst] + [abs(a - b) / max(1, abs(b)) for a, b in zip(value, test["values"])])
    print(path.split("/")[-1], len(s["self_tests"]), worst)
    assert worst < 1e-7, (path, worst)
"#;

#[test]
fn another_reader_evaluates_the_object() {
    if !is_there("python3") {
        skipped("python3 is not on this machine");
        return;
    }
    let folder = folder("json");
    let mut paths = Vec::new();
    for (name, bytes) in fixtures() {
        let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
        let files = export(&surrogate, Target::Json, &name).expect("the name is one");
        let path = folder.join(&files[0].name);
        std::fs::write(&path, &files[0].content).expect("the folder can be written to");
        paths.push(path);
    }
    let output = std::process::Command::new("python3").args(["-c", READER]).args(&paths).output().expect("python3 starts");
    print!("{}", String::from_utf8_lossy(&output.stdout));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let _ = std::fs::remove_dir_all(&folder);
}

#[test]
fn a_name_without_a_letter_is_refused() {
    let (_, bytes) = fixtures().swap_remove(0);
    let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
    assert_eq!(export(&surrogate, Target::Json, "-"), Err(ExportError::Name("-".into())));
}
