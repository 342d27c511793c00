//! Figures of drift as tests of machine tools report them, limits of magnitude, and the unit of every figure.

use crate::common::coldplate_in;
use crate::displacement::{POST, folder, json};

const SCHEDULE: &str = "time [h],motor_speed [rpm],ambient_temperature [degC]\n0,0,22\n0,2000,22\n4,2000,22\n4,0,22\n6,0,22\n";

/// The tip once more, 25 mm higher on the arm.
const ABOVE: &str = "displacement.\"tip x above\"={ point = [\"300 mm\", \"30 mm\", \"50 mm\"], in = \"arm\", direction = \"x\" }";

#[test]
fn a_drift_becomes_a_page() {
    let folder = folder("page");
    std::fs::write(folder.join("run.csv"), SCHEDULE).unwrap();
    let asked = ["simulate", "post.toml", "run.csv", "--set", ABOVE, "--report", "drift.html"];
    let found = json(&folder, &asked);
    let course = |name: &str| found["series"][name].as_array().unwrap().iter().map(|u| u.as_f64().unwrap()).collect::<Vec<_>>();
    let tilt = &found["tilts"][0];
    assert_eq!((&tilt["about"], found["tilts"].as_array().unwrap().len()), (&"y".into(), 1), "{}", found["tilts"]);
    assert_eq!(tilt["of"], serde_json::json!(["tip x above", "tip x"]));
    let turned: Vec<f64> = course("tip x above").iter().zip(course("tip x")).map(|(a, b)| (a - b) / 0.025).collect();
    let range = turned.iter().copied().fold(f64::NEG_INFINITY, f64::max) - turned.iter().copied().fold(f64::INFINITY, f64::min);
    assert!((tilt["range_urad"].as_f64().unwrap() - range).abs() < 1e-6 * range, "{tilt}: {range}");
    assert!((tilt["end_urad"].as_f64().unwrap() - (turned.last().unwrap() - turned[0])).abs() < 1e-6 * range);
    // The post is heated on the side of the arm, and bends away from it: what stands higher goes back.
    assert!(turned.iter().all(|angle| *angle <= turned[0] + 1e-9), "{turned:?}");

    let page = std::fs::read_to_string(folder.join("drift.html")).unwrap();
    let drift = found["drifts"].as_array().unwrap().iter().find(|d| d["sensor"] == "tip x").unwrap();
    for words in [
        "Thermal drift over 6 h",
        "about y: tip x above and tip x, 25.00 mm apart",
        &format!("{:.2}", drift["range_um"].as_f64().unwrap()),
        "<td class=\"right\">2000 rpm</td>",
        "<svg",
        "repeatability of positioning",
    ] {
        assert!(page.contains(words), "the page lacks {words}");
    }
    assert!(!page.contains("<script") && !page.contains("NaN"));

    let refused = |args: &[&str]| {
        let ended = coldplate_in(&folder, args);
        assert_eq!(ended.status.code(), Some(2), "{args:?}");
        String::from_utf8_lossy(&ended.stderr).into_owned()
    };
    let plain = POST.split("[displacement").next().unwrap().to_string() + "[mesh]\ncells = 100\n";
    std::fs::write(folder.join("plain.toml"), plain).unwrap();
    assert!(refused(&["simulate", "plain.toml", "run.csv", "--report", "x.html"]).contains("no displacement to report"));
    assert!(refused(&["simulate", "post.toml", "run.csv", "--report", "x.pdf"]).contains("end the name in .html"));
    assert!(!folder.join("x.html").exists() && !folder.join("x.pdf").exists());
}

#[test]
fn a_magnitude_is_limited_in_both_senses() {
    let folder = folder("magnitude");
    let limit = "limit.\"tip z\"={ sensor = \"tip z\", magnitude = \"30 um\" }";
    let turned = "displacement.\"tip z\".direction=\"-z\"";
    let at = ["--motor-speed", "2000 rpm", "--ambient-temperature", "22 degC", "--no-mesh-error"];
    for sets in [&["--set", limit][..], &["--set", limit, "--set", turned]] {
        let solved = json(&folder, &[&["solve", "post.toml"], &at[..], sets].concat());
        let (value, other) = (solved["sensors"]["tip z"].as_f64().unwrap(), solved["sensors"]["-tip z"].as_f64().unwrap());
        assert!(value.abs() > 30.0 && other == -value, "{value} and {other}");
        let margins: Vec<f64> = ["tip z", "-tip z"]
            .map(|name| solved["limits"].as_array().unwrap().iter().find(|l| l["name"] == name).unwrap()["margin"].as_f64().unwrap())
            .to_vec();
        // One of the two is broken, whatever is counted as positive.
        assert!((margins.iter().copied().fold(f64::INFINITY, f64::min) - (30.0 - value.abs())).abs() < 1e-9, "{margins:?}");
    }

    // From the sweep to the query; every figure says its unit.
    std::fs::write(folder.join("post.toml"), POST.to_string() + "[limit.z]\nsensor = \"tip z\"\nmagnitude = \"30 um\"\n").unwrap();
    let sweep = "name = \"post\"\nmachine = \"post.toml\"\n[range]\nmotor_speed = [\"0 rpm\", \"3000 rpm\"]\n\
                 ambient_temperature = [\"16 degC\", \"28 degC\"]\n[design]\nkind = \"latin_hypercube\"\nruns = 16\nseed = 1\n\
                 [validation]\nruns = 4\nseed = 2\n";
    std::fs::write(folder.join("sweep.toml"), sweep).unwrap();
    let ran = json(&folder, &["run", "sweep.toml", "--out", "out"]);
    let point = |name: &str| ran["points"].as_array().unwrap().iter().find(|p| p["name"] == name).unwrap().clone();
    let (tip, arm) = (point("tip z"), point("arm"));
    assert!(tip["half_width_um"].is_number() && tip["held_out"]["max_um"].is_number() && tip.get("half_width_K").is_none(), "{tip}");
    assert!(arm["half_width_K"].is_number() && arm["held_out"]["max_K"].is_number() && arm.get("half_width_um").is_none(), "{arm}");
    let fitted = coldplate_in(&folder, &["fit", "out/sweep.csv", "--machine", "post.toml", "--out", "post.cps"]);
    let text = String::from_utf8_lossy(&fitted.stdout).into_owned();
    assert!(
        text.lines().any(|l| l.contains("tip z") && l.ends_with("um")) && text.lines().any(|l| l.contains("arm") && l.ends_with('K')),
        "{text}"
    );
    let asked = json(&folder, &[&["query", "post.cps"], &at[..4]].concat());
    assert_eq!(asked["verdict"], "not_acceptable", "{asked}");
}

/// A direction is one however long it is written.
#[test]
fn directions_have_no_length() {
    let folder = folder("direction");
    let read = |direction: &str| {
        let set = format!("displacement.\"tip x\".direction={direction}");
        json(&folder, &["solve", "post.toml", "--no-mesh-error", "--set", &set])["sensors"]["tip x"].as_f64().unwrap()
    };
    let expected = read("[1, 0, 1]");
    for direction in ["[1e300, 0, 1e300]", "[1e-300, 0, 1e-300]"] {
        assert!((read(direction) - expected).abs() < 1e-9 * expected.abs(), "{direction}");
    }
}
