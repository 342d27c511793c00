//! Where to start: machines to begin with, and what may be named in them.

use super::{coldplate, json, message, scratch, status};

#[test]
fn starters_check_solve_and_run_and_are_never_written_over() {
    let folder = scratch("new");
    std::fs::create_dir_all(&folder).unwrap();
    let listed = json(&coldplate(&["new", "--list", "--json"]));
    let starters: Vec<String> = listed["starters"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap().to_string()).collect();
    assert!(starters.len() >= 3, "{starters:?}");
    for starter in &starters {
        let name = folder.join(starter);
        let made = coldplate(&["new", name.to_str().unwrap(), "--from", starter, "--json"]);
        assert_eq!(status(&made), 0, "{}", message(&made));
        let made = json(&made);
        let (machine, sweep) = (made["machine"].as_str().unwrap(), made["sweep"].as_str().unwrap());
        let text = std::fs::read_to_string(machine).unwrap();
        let comments = text.lines().filter(|l| l.contains('#')).count();
        assert!(
            comments >= 12 && !text.contains("FILE") && text.contains(&format!("{starter}_sweep.toml")) | (starter == "nodes"),
            "{text}"
        );
        let checked = coldplate(&["check", machine, "--cells", "1500", "--json"]);
        assert_eq!(status(&checked), 0, "{machine}: {}", message(&checked));
        let warnings = json(&checked)["warnings"].as_array().unwrap().clone();
        assert!(warnings.is_empty(), "{machine}: {warnings:?}");
        let solved = coldplate(&["solve", machine, "--cells", "1500", "--json"]);
        assert_eq!(status(&solved), 0, "{machine}: {}", message(&solved));
        for (sensor, degrees) in json(&solved)["sensors"].as_object().unwrap() {
            assert!((18.0..80.0).contains(&degrees.as_f64().unwrap()), "{starter}: {sensor} reads {degrees}");
        }
        let out = folder.join(format!("out-{starter}"));
        let ran = coldplate(&["run", sweep, "--cells", "500", "--out", out.to_str().unwrap(), "--quiet", "--json"]);
        assert_eq!(status(&ran), 0, "{sweep}: {}", message(&ran));
        assert_eq!(json(&ran)["failed"], 0, "{sweep}");
        let before = std::fs::read_to_string(machine).unwrap();
        let again = coldplate(&["new", machine, "--from", "spindle"]);
        assert!(status(&again) == 2 && message(&again).contains("nothing is written over"), "{}", message(&again));
        assert_eq!(std::fs::read_to_string(machine).unwrap(), before);
    }
    // A sweep that is there keeps the machine from being written too.
    std::fs::write(folder.join("half_sweep.toml"), "").unwrap();
    let half = folder.join("half.toml");
    assert_eq!(status(&coldplate(&["new", half.to_str().unwrap()])), 2);
    assert!(!half.exists());
    assert_eq!(status(&coldplate(&["new", half.to_str().unwrap(), "--no-sweep"])), 0);
    let unknown = coldplate(&["new", "x", "--from", "spindel"]);
    assert!(status(&unknown) == 2 && message(&unknown).contains("a similar value exists: 'spindle'"), "{}", message(&unknown));
}

#[test]
fn units_are_listed_and_found() {
    let all = json(&coldplate(&["units", "--json"]));
    let factor = |symbol: &str| {
        let found = all["units"].as_array().unwrap().iter().find(|u| u["symbol"] == symbol).unwrap_or_else(|| panic!("{symbol}"));
        (found["factor"].as_f64().unwrap(), found["dimension"].as_str().unwrap().to_string(), found["zero_K"].as_f64())
    };
    assert_eq!(factor("inch"), (0.0254, "length".into(), None));
    assert_eq!(factor("degC"), (1.0, "temperature".into(), Some(273.15)));
    assert!((factor("gpm").0 - 6.309_019_64e-5).abs() < 1e-14);
    let text = coldplate(&["units", "conductivity"]);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    assert!(text.contains("W/(m K)") && text.contains("16.3 W/(m K)") && !text.contains("rpm"), "{text}");
    let pressure = String::from_utf8_lossy(&coldplate(&["units", "bar"]).stdout).into_owned();
    assert!(pressure.contains("mbar") && pressure.contains("100000 Pa"), "{pressure}");
    let none = coldplate(&["units", "parsec"]);
    assert!(status(&none) == 2 && message(&none).contains("parsec"), "{}", message(&none));
}

#[test]
fn materials_and_liquids_are_listed_with_their_sources() {
    let all = json(&coldplate(&["materials", "--json"]));
    let materials = all["materials"].as_array().unwrap();
    assert!(materials.len() >= 13);
    for material in materials {
        assert!(material["source"].as_str().unwrap().len() > 10, "{material}");
        let name = material["name"].as_str().unwrap();
        // What is listed may be named.
        assert!(material["conductivity"]["value"].as_f64().unwrap() > 0.0, "{name}");
    }
    let stainless = materials.iter().find(|m| m["name"] == "stainless 304").unwrap();
    assert_eq!(stainless["conductivity"]["table"].as_array().unwrap().len(), 4);
    assert!((stainless["conductivity"]["range_degC"][1].as_f64().unwrap() - 326.85).abs() < 1e-9);
    // Between 200 K with 12.6 and 300 K with 14.9 W/(m K).
    assert!((stainless["conductivity"]["value"].as_f64().unwrap() - (12.6 + 0.9315 * 2.3)).abs() < 1e-9);
    let water = all["liquids"].as_array().unwrap().iter().find(|l| l["name"] == "water").unwrap().clone();
    assert!((water["density_kg_m3"].as_f64().unwrap() / 998.2523 - 1.0).abs() < 1e-5, "{water}");
    let text = String::from_utf8_lossy(&coldplate(&["materials", "copper"]).stdout).into_owned();
    assert!(text.contains("401") && text.contains("Incropera") && !text.contains("titanium"), "{text}");
    let none = coldplate(&["materials", "unobtainium"]);
    assert!(status(&none) == 2 && message(&none).contains("unobtainium"), "{}", message(&none));
}

/// A name with quotes is escaped in the sweep, and two reduced models of one machine have the same bytes.
#[test]
fn names_are_escaped_and_reduced_models_repeat() {
    let folder = crate::common::scratch("start-again");
    let at = |name: &str| folder.join(name).to_str().unwrap().to_string();
    assert_eq!(crate::common::coldplate(&["new", &at("a\"b"), "--from", "nodes"]).status.code(), Some(0));
    let read = crate::common::coldplate(&["info", &at("a\"b_sweep.toml")]);
    assert_eq!(read.status.code(), Some(0), "{}", crate::common::message(&read));
    let made = ["1.cpr", "2.cpr"].map(|name| {
        let made = crate::common::coldplate(&["reduce", "examples/tutorial/machine.toml", "--cells", "600", "--out", &at(name), "--quiet"]);
        assert_eq!(made.status.code(), Some(0), "{}", crate::common::message(&made));
        std::fs::read(folder.join(name)).unwrap()
    });
    assert_eq!(made[0], made[1]);
}
