//! From the machine file to the embedded answer.

use std::process::Command;

use crate::common::coldplate_in;
use crate::displacement::{folder, json};

/// Speed and ambient temperature, at 24 conditions.
const SWEEP: &str = "name = \"post\"\nmachine = \"post.toml\"\n[range]\nmotor_speed = [\"0 rpm\", \"3000 rpm\"]\n\
    ambient_temperature = [\"16 degC\", \"28 degC\"]\n[design]\nkind = \"latin_hypercube\"\nruns = 24\nseed = 1\n";

const AT: [&str; 4] = ["--motor-speed", "2000 rpm", "--ambient-temperature", "22 degC"];

#[test]
fn a_displacement_goes_all_the_way() {
    let folder = folder("pipeline");
    let solved = json(&folder, &[&["solve", "post.toml"], &AT[..]].concat());
    let (x, z) = (solved["sensors"]["tip x"].as_f64().unwrap(), solved["sensors"]["tip z"].as_f64().unwrap());
    // The arm is warmer than the post: it grows by alpha dT L along x at least from the post's axis on, and the post lifts it.
    let (arm, post) = (solved["sensors"]["arm"].as_f64().unwrap() - 20.0, solved["sensors"]["post"].as_f64().unwrap() - 20.0);
    let free = 23.6 * arm * 0.3 + 12.0 * post * 0.03;
    assert!((x / free - 1.0).abs() < 0.05, "{x} um, {free} um if nothing were held");
    let lift = 12.0 * post * 0.375;
    assert!(z > lift && z < 1.5 * lift, "{z} um: the post lifts the tip by {lift} um, and bends away from its warm side");
    let limit = solved["limits"].as_array().unwrap().iter().find(|l| l["name"] == "tip x").unwrap();
    assert_eq!((limit["value"].as_f64().unwrap(), limit["limit"].as_f64().unwrap()), (x, 120.0));
    assert!(solved["mesh"]["errors_um"]["tip x"].as_f64().unwrap() < 0.1 * x);
    assert!(solved["mesh"]["errors_K"].get("tip x").is_none());

    std::fs::write(folder.join("sweep.toml"), SWEEP).unwrap();
    let swept = coldplate_in(&folder, &["sweep", "sweep.toml", "--out", "out"]);
    assert!(swept.status.success(), "{}", String::from_utf8_lossy(&swept.stderr));
    let table = std::fs::read_dir(folder.join("out")).unwrap().map(|e| e.unwrap().path()).find(|p| p.ends_with("sweep.csv"));
    let table = std::fs::read_to_string(table.unwrap()).unwrap();
    assert!(table.contains("tip x [um]") && table.contains("arm [degC]"), "{}", table.lines().take(12).collect::<Vec<_>>().join("\n"));

    let fitted = json(&folder, &["fit", "out/sweep.csv", "--machine", "post.toml", "--out", "post.cps"]);
    let point = fitted["points"].as_array().unwrap().iter().find(|p| p["name"] == "tip x").unwrap();
    assert!(point["unit"] == "um" && point["half_width"].as_f64().unwrap() < 1.0, "{point}");
    let query = json(&folder, &[&["query", "post.cps"], &AT[..]].concat());
    let predicted = query["temperatures"]["tip x"]["um"].as_f64().unwrap();
    assert!((predicted - x).abs() < 0.5, "{predicted} um beside {x} um");
    let limit = query["limits"].as_array().unwrap().iter().find(|l| l["name"] == "tip x").unwrap();
    assert!(limit["limit"] == 120.0 && (limit["value"].as_f64().unwrap() - predicted).abs() < 1e-9, "{limit}");
    // The speed at which the tip has moved by its limit.
    let free = coldplate_in(&folder, &["query", "post.cps", "--free", "motor_speed", "--ambient-temperature", "22 degC"]);
    assert!(String::from_utf8_lossy(&free.stdout).contains("motor_speed"), "{}", String::from_utf8_lossy(&free.stderr));

    offset(&folder, predicted);
}

/// The exported C source gives the same offset of the tip.
fn offset(folder: &std::path::Path, expected: f64) {
    let exported = coldplate_in(folder, &["export", "post.cps", "--to", "c99", "--out", "embed", "--name", "post"]);
    assert!(exported.status.success(), "{}", String::from_utf8_lossy(&exported.stderr));
    let header = std::fs::read_to_string(folder.join("embed/post.h")).unwrap();
    assert!(header.contains("tip x, um"), "{header}");
    let query = json(folder, &[&["query", "post.cps"], &AT[..]].concat());
    let order: Vec<&String> = query["temperatures"].as_object().unwrap().keys().collect();
    assert!(order.iter().any(|name| *name == "tip x"));
    let main = "#include <stdio.h>\n#include \"post.h\"\nint main(void) {\n  double x[2] = {2000.0, 22.0}, values[8];\n\
                post_offset(x, values);\n  for (int i = 0; i < 4; i++) printf(\"%.12g\\n\", values[i]);\n  return 0;\n}\n";
    std::fs::write(folder.join("embed/main.c"), main).unwrap();
    let built =
        Command::new("cc").args(["-std=c99", "-O1", "main.c", "post.c", "-lm", "-o", "main"]).current_dir(folder.join("embed")).output();
    let Ok(built) = built else {
        println!("skipped: there is no C compiler");
        return;
    };
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let ran = Command::new(folder.join("embed/main")).output().unwrap();
    let values: Vec<f64> = String::from_utf8_lossy(&ran.stdout).lines().map(|l| l.parse().unwrap()).collect();
    // The points are post, arm, tip x, tip z: temperatures have no offset.
    assert!(values[..2] == [0.0, 0.0] && (values[2] + expected).abs() < 1e-9 * expected.abs(), "{values:?}, and {expected} um");
}

/// Over time: the history ends where the steady state is, and says how far the tip drifted.
#[test]
fn a_drift_over_time() {
    let folder = folder("drift");
    let schedule = "time [h],motor_speed [rpm],ambient_temperature [degC]\n0,0,22\n0,2000,22\n30,2000,22\n";
    std::fs::write(folder.join("run.csv"), schedule).unwrap();
    let found = json(&folder, &["simulate", "post.toml", "run.csv"]);
    let solved = json(&folder, &[&["solve", "post.toml", "--no-mesh-error"], &AT[..]].concat());
    let course = &found["sensors"]["tip x"];
    let (start, end) = (course["start_um"].as_f64().unwrap(), course["end_um"].as_f64().unwrap());
    let steady = solved["sensors"]["tip x"].as_f64().unwrap();
    assert!((end - steady).abs() < 0.02 * steady, "{end} um, steady {steady} um");
    let drift = found["drifts"].as_array().unwrap().iter().find(|d| d["sensor"] == "tip x").unwrap();
    let number = |key: &str| drift[key].as_f64().unwrap();
    assert!((number("end_um") - (end - start)).abs() < 1e-9 && (number("steady_um") - (steady - start)).abs() < 0.01);
    assert!(number("range_um") >= number("end_um") && number("first_hour_um") < number("range_um") && number("first_hour_um") > 0.0);
    // Nearly one time constant: a tenth is left after ln 10 of them, and the first hour tells the constant.
    let constant = -3600.0 / (1.0 - number("first_hour_um") / number("steady_um")).ln();
    assert!((number("settled_s") / (constant * 10_f64.ln()) - 1.0).abs() < 0.35, "{drift}");
    let text = coldplate_in(&folder, &["simulate", "post.toml", "run.csv"]);
    assert!(String::from_utf8_lossy(&text.stdout).contains("drift um"));
}

/// Over time without the machine: a reduced model and a surrogate that moves follow the tip as the full run does, and the exported C
/// has the step.
#[test]
fn a_drift_from_few_states() {
    let folder = folder("few_states");
    let schedule = "time [h],motor_speed [rpm],ambient_temperature [degC]\n0,500,22\n0,2000,22\n4,2000,22\n4,1000,22\n6,1000,22\n";
    std::fs::write(folder.join("run.csv"), schedule).unwrap();
    let full = json(&folder, &["simulate", "post.toml", "run.csv"]);
    std::fs::write(folder.join("sweep.toml"), SWEEP).unwrap();
    let done = |args: &[&str]| {
        let output = coldplate_in(&folder, args);
        assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    };
    done(&["reduce", "post.toml", "--histories", "4", "--out", "post.cpr"]);
    done(&["sweep", "sweep.toml", "--out", "out"]);
    done(&["fit", "out/sweep.csv", "--machine", "post.toml", "--dynamics", "post.cpr", "--out", "post.cps"]);
    let tip = |run: &serde_json::Value, key: &str| run["sensors"]["tip x"][key].as_f64().unwrap_or_else(|| panic!("{key}: {run}"));
    for (file, most) in [("post.cpr", 0.02), ("post.cps", 0.05)] {
        let found = json(&folder, &["simulate", file, "run.csv"]);
        let (start, end) = (tip(&full, "start_um"), tip(&full, "end_um"));
        let moved = (end - start).abs();
        for (key, truth) in [("start_um", start), ("end_um", end)] {
            let error = (tip(&found, key) - truth).abs();
            println!("{file} {key}: {} um, {truth} um in full", tip(&found, key));
            assert!(error < most * moved, "{file} {key}: {error} um off, {moved} um moved");
        }
    }
    let info = json(&folder, &["info", "post.cps"]);
    let point = info["points"].as_array().unwrap().iter().find(|p| p["name"] == "tip x").unwrap();
    assert!(point["over_time"].as_f64().unwrap() > 0.0, "{point}");
    done(&["export", "post.cps", "--to", "c99", "--out", "embed", "--name", "post"]);
    assert!(std::fs::read_to_string(folder.join("embed/post.h")).unwrap().contains("post_step"));
}
