//! `coldplate export`: what is written, and what is refused.

use super::*;

#[test]
fn a_surrogate_becomes_source_text() {
    let folder = scratch("export");
    let (surrogate, out) = (root().join("crates/runtime/fixtures/uncertain.cps"), folder.to_str().unwrap());
    let surrogate = surrogate.to_str().unwrap();
    let output = coldplate(&["export", surrogate, "--to", "c99", "--out", out, "--name", "cold plate", "--json"]);
    assert_eq!(status(&output), 0, "{}", message(&output));
    let found = json(&output);
    assert_eq!(found["target"], "c99");
    for (place, name) in ["cold_plate.h", "cold_plate.c"].into_iter().enumerate() {
        let text = std::fs::read(folder.join(name)).unwrap();
        assert_eq!(found["written"][place]["path"], folder.join(name).to_str().unwrap());
        assert_eq!(found["written"][place]["bytes"], text.len());
    }
    // Everything in the file, under the name of the file.
    let output = coldplate(&["export", surrogate, "--to", "json", "--out", out]);
    assert_eq!(status(&output), 0, "{}", message(&output));
    let text = std::fs::read_to_string(folder.join("uncertain.json")).unwrap();
    let object: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(object["variables"][0], serde_json::json!({ "name": "coolant_flow", "unit": "L/min", "low": 2.0, "high": 12.0 }));
    assert_eq!(object["uncertainty"]["parameters"][0]["name"], "contact.foot.conductance");
    let _ = std::fs::remove_dir_all(folder);
}

#[test]
fn what_cannot_be_exported_is_said() {
    let surrogate = root().join("crates/runtime/fixtures/polynomial.cps");
    let surrogate = surrogate.to_str().unwrap();
    for (file, to, name, needles) in [
        (surrogate, "calculix", "s", ["this is a surrogate", "takes a machine file"]),
        (
            surrogate,
            "fortran",
            "s",
            ["invalid value 'fortran'", "c99, fmu2, fmu3, html, json, modelica, octave, onnx, st, dakota, openturns, calculix"],
        ),
        (surrogate, "c99", "-", ["no identifier", "--name surrogate"]),
        ("machines/slab.toml", "c99", "s", ["takes a surrogate", "slab.toml"]),
    ] {
        let output = coldplate(&["export", file, "--to", to, "--name", name]);
        assert_eq!(status(&output), 2, "{to}");
        for needle in needles {
            assert!(message(&output).contains(needle), "{needle}: {}", message(&output));
        }
    }
    let output = coldplate(&["export", surrogate, "--to", "c99", "--motor-speed", "100 rpm"]);
    assert_eq!(status(&output), 2);
    assert!(message(&output).contains("--motor-speed") && message(&output).contains("for machine files"), "{}", message(&output));
}

#[test]
fn a_unit_says_whether_it_has_a_binary() {
    let folder = scratch("export-unit");
    let surrogate = root().join("crates/runtime/fixtures/uncertain.cps");
    let (surrogate, out) = (surrogate.to_str().unwrap(), folder.to_str().unwrap());
    for (compiler, expected) in [("cc", "with sources and the binary for "), ("no-such-compiler", "with sources alone: ")] {
        let output = Command::new(env!("CARGO_BIN_EXE_coldplate"))
            .args(["export", surrogate, "--to", "fmu2", "--out", out, "--json"])
            .env("CC", compiler)
            .output()
            .unwrap();
        assert_eq!(status(&output), 0, "{}", message(&output));
        let found = json(&output);
        let remark = found["written"][0]["remark"].as_str().unwrap();
        assert!(remark.starts_with(expected), "{remark}");
        assert!(std::fs::read(folder.join("uncertain.fmu")).unwrap().starts_with(b"PK"));
    }
    let _ = std::fs::remove_dir_all(folder);
}
