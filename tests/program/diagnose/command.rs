//! The command: what it prints, what it writes, that nothing is written over.

use std::path::{Path, PathBuf};

use coldplate_base::document::Document;
use coldplate_base::random::Random;
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, ReadingRow};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;
use coldplate_testing::machines::SMALL;
use serde_json::Value;

use super::scratch;
use crate::common::{coldplate, json, message, write};

pub(super) const HEADER: &str = "test,coolant_flow [L/min],coolant_temperature [degC],motor_speed [rpm],ambient_temperature [degC]";
/// Standard deviations: 0.03 K of noise and of each sensor, small errors of conditions.
const UNCERTAINTY: &str = "kind = \"standard deviations\"\nnoise = \"0.03 K\"\nbias = \"0.03 K\"\n[condition]\n\
    coolant_temperature = \"0.03 K\"\ncoolant_flow = \"1 %\"\nambient_temperature = \"0.1 K\"\n";
/// Conditions in L/min, degC, rpm, degC, over the ranges of the machine.
const CONDITIONS: [[f64; 4]; 10] = [
    [2.2, 19.0, 400.0, 21.0],
    [7.5, 25.0, 2400.0, 27.0],
    [3.1, 22.0, 1500.0, 24.0],
    [5.0, 20.0, 2500.0, 22.0],
    [6.4, 18.5, 900.0, 26.0],
    [2.6, 24.0, 2000.0, 20.5],
    [4.2, 21.0, 600.0, 23.0],
    [7.9, 23.0, 1800.0, 25.0],
    [3.6, 18.2, 2300.0, 28.0],
    [5.8, 25.8, 1200.0, 22.5],
];

/// What stands in a folder, hidden files too.
pub(super) fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// A machine and a table of what it would read with `planted` in it, on another mesh, with noise.
fn folder(name: &str, planted: &[(&str, &str)]) -> (PathBuf, String, String) {
    let folder = scratch(name);
    let machine = write(&folder, "small.toml", SMALL);
    let mut document = Document::parse(SMALL, "truth.toml").unwrap();
    for (key, value) in planted {
        document.apply_set(key, value).unwrap();
    }
    let truth = Study::new(document, Some(1100)).unwrap();
    let row = |(i, [flow, water, speed, ambient]): (usize, &[f64; 4])| {
        let given = [
            ("coolant_flow", format!("{flow} L/min")),
            ("coolant_temperature", format!("{water} degC")),
            ("motor_speed", format!("{speed} rpm")),
            ("ambient_temperature", format!("{ambient} degC")),
        ];
        let pairs: Vec<(&str, &str)> = given.iter().map(|(n, v)| (*n, v.as_str())).collect();
        let condition = truth.model.machine.condition(&pairs).unwrap();
        ReadingRow {
            test: format!("test {}", i + 1),
            time: None,
            condition,
            readings: vec![Some(300.0); truth.model.machine.sensors.len()],
            line: None,
        }
    };
    let sensors = &truth.model.machine.sensors;
    let names: Vec<String> = sensors.iter().map(|s| s.name.clone()).collect();
    let data = Data {
        source: "truth".into(),
        sensors: (0..sensors.len()).collect(),
        names: names.clone(),
        rows: CONDITIONS.iter().enumerate().map(row).collect(),
        ..Data::default()
    };
    let values = identify::values(&truth, &data, Start::Steady).unwrap();
    let mut random = Random::new(11);
    let own: Vec<f64> = names.iter().map(|_| 0.03 * random.normal()).collect();
    let mut text = format!("{HEADER},{}\n", names.iter().map(|n| format!("{n} [degC]")).collect::<Vec<_>>().join(","));
    for (r, c) in CONDITIONS.iter().enumerate() {
        let readings = (0..names.len()).map(|k| values[r * names.len() + k] - 273.15 + own[k] + 0.03 * random.normal());
        let readings: Vec<String> = readings.map(|t| format!("{t:.3}")).collect();
        text += &format!("test {},{},{},{},{},{}\n", r + 1, c[0], c[1], c[2], c[3], readings.join(","));
    }
    let table = write(&folder, "readings.csv", text);
    write(&folder, "readings.toml", UNCERTAINTY);
    (folder, machine, table)
}

/// Heat that no source of the file gives: at the bracket, which has none.
const HEAT: (&str, &str) = ("source.hidden", "{ in = \"bracket\", power = \"6 W\" }");

#[test]
fn a_hidden_heat_is_named_written_reported_and_fitted() {
    let (folder, machine, table) = folder("heat", &[HEAT]);
    let before = std::fs::read(&machine).unwrap();
    let (report, surrogate) = (folder.join("out").join("report.html"), folder.join("small.cps"));
    let options = ["--cells", "600", "--json", "--quiet"];
    let args = [&["diagnose", &machine, &table][..], &options].concat();
    let found =
        json(&coldplate(&[&args[..], &["--report", report.to_str().unwrap(), "--surrogate", surrogate.to_str().unwrap()]].concat()));
    shape(&found);
    assert_eq!(found["verdict"], "explained", "{}", found["headline"]);
    let cause = &found["causes"][0];
    assert_eq!((cause["kind"].as_str(), cause["place"].as_str()), (Some("heat source"), Some("bracket")), "{cause}");
    let heat = &cause["parameters"]["heat"];
    assert!((heat["value"].as_f64().unwrap() - 6.0).abs() < 0.6 && heat["unit"] == "W", "{heat}");
    // The place shows in the heat that is missing, too.
    let most = &found["missing_heat"][0];
    assert!(most["part"] == "bracket" && (most["W"].as_f64().unwrap() - 6.0).abs() < 0.9, "{most}");
    // Heat in and out agree at every condition, before and after.
    let balances = found["heat_balance"].as_array().unwrap();
    assert_eq!(balances.len(), CONDITIONS.len());
    for balance in balances {
        let sum = |side: &str, which: &str| balance[side][which].as_object().unwrap().values().map(|v| v.as_f64().unwrap()).sum::<f64>();
        for side in ["before", "after"] {
            let (into, out) = (sum(side, "in_W"), sum(side, "out_W"));
            // Friction in the water is the milliwatts between the two.
            assert!((into - out).abs() < 0.05 * into, "{side}: {into} {out}");
        }
        assert!((sum("after", "in_W") - sum("before", "in_W") - heat["value"].as_f64().unwrap()).abs() < 1e-6, "{balance}");
        assert_eq!(balance["water"].as_array().unwrap().len(), 1);
    }
    let gain = &found["gain"];
    assert!(gain["rmse_after_K"].as_f64().unwrap() < 0.5 * gain["rmse_before_K"].as_f64().unwrap(), "{gain}");
    // The machine file is as it was; the extended one is a machine that any command takes.
    assert_eq!(std::fs::read(&machine).unwrap(), before);
    let extended = found["extended_machine"].as_str().unwrap();
    assert_eq!(Path::new(extended), folder.join("small.extended.toml"));
    let text = std::fs::read_to_string(extended).unwrap();
    assert!(text.contains("readings.csv") && text.contains("90 % interval"), "{text}");
    let at = ["--json", "--coolant-flow", "5 L/min", "--coolant-temperature", "20 degC", "--motor-speed", "2500 rpm"];
    let at = [&at[..], &["--ambient-temperature", "22 degC"]].concat();
    let solved = |file: &str, cells: &str| json(&coldplate(&[&["solve", file, "--cells", cells][..], &at].concat()));
    let bracket = |file: &str, cells: &str| solved(file, cells)["sensors"]["bracket"].as_f64().unwrap();
    let measured = found["readings"].as_array().unwrap().iter().find(|r| r["test"] == "test 4" && r["sensor"] == "bracket").unwrap();
    let measured = measured["measured_degC"].as_f64().unwrap();
    // On enough cells: what 600 of them get wrong is corrected for, and not part of the heat.
    assert!((bracket(extended, "4000") - measured).abs() < 0.2 && measured - bracket(&machine, "4000") > 1.0, "{measured}");
    // The surrogate of it answers, and fits the readings better than that of the machine as it was.
    let fitted = &found["surrogate"];
    let error = |key: &str| fitted[key].as_f64().unwrap();
    assert!(error("error_after_K") < 0.4 * error("error_before_K") && error("held_out_max_K") < 0.1, "{fitted}");
    assert_eq!(fitted["readings"], CONDITIONS.len() * 7);
    let query = ["query", surrogate.to_str().unwrap(), "--json", "--coolant-flow", "5 L/min", "--coolant-temperature", "20 degC"];
    let query = coldplate(&[&query[..], &["--motor-speed", "2500 rpm", "--ambient-temperature", "22 degC"]].concat());
    let query: Value = serde_json::from_slice(&query.stdout).unwrap_or_else(|_| panic!("{}", message(&query)));
    assert!((query["temperatures"]["bracket"]["degC"].as_f64().unwrap() - bracket(extended, "600")).abs() < 0.2, "{query}");
    // The report stands alone and says what was found.
    let page = std::fs::read_to_string(&report).unwrap();
    stands_alone(&page);
    for part in [
        "In short",
        "Is it more than noise",
        "Where it sits, and what it changes",
        // The machine in its frame names the cause at its part.
        "heat source at bracket&quot;,&quot;part&quot;",
        "Where the heat goes",
        "What could explain it",
        "The extended machine",
        "bracket",
        "small.cps",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(page.matches("<svg").count() >= 6, "{} figures", page.matches("<svg").count());
    // Nothing else is left behind.
    let expected = ["out", "readings.csv", "readings.toml", "small.cps", "small.extended.toml", "small.toml"];
    assert_eq!(files(&folder), expected);
    assert_eq!(files(&folder.join("out")), ["report.html"]);
    // Again: another name. A name that is taken: refused before any work, and left as it is.
    let again = json(&coldplate(&args));
    assert_eq!(Path::new(again["extended_machine"].as_str().unwrap()), folder.join("small.extended-2.toml"));
    assert_eq!((&again["causes"], &again["gain"]), (&found["causes"], &found["gain"]), "the same data give the same answer");
    for option in ["--out", "--surrogate"] {
        let taken = if option == "--out" { extended } else { surrogate.to_str().unwrap() };
        let bytes = std::fs::read(taken).unwrap();
        let refused = coldplate(&[&args[..], &[option, taken]].concat());
        assert!(refused.status.code() == Some(2) && message(&refused).contains("nothing is written over"), "{}", message(&refused));
        assert_eq!(std::fs::read(taken).unwrap(), bytes);
    }
}

/// The shape that outside programs rely on.
pub(super) fn shape(found: &Value) {
    for key in ["chi2", "dof", "p"] {
        assert!(found["misfit"][key].is_number(), "misfit.{key}");
    }
    assert!(["consistent", "explained", "something_else", "cannot_tell"].contains(&found["verdict"].as_str().unwrap()));
    let cause = |cause: &Value| {
        for key in ["kind", "place", "law"] {
            assert!(cause[key].is_string(), "{key}: {cause}");
        }
        let parameters = cause["parameters"].as_object().unwrap();
        assert!(!parameters.is_empty());
        for parameter in parameters.values() {
            let [low, value, high] = ["low", "value", "high"].map(|k| parameter[k].as_f64().unwrap());
            assert!(low <= value && value <= high && parameter["unit"].is_string(), "{parameter}");
        }
        assert!((0.0..=1.0).contains(&cause["probability"].as_f64().unwrap()));
        assert!(cause["ambiguous_with"].as_array().unwrap().iter().all(Value::is_string));
    };
    found["causes"].as_array().unwrap().iter().for_each(cause);
    found["set"].as_array().unwrap().iter().for_each(|e| e.as_array().unwrap().iter().for_each(cause));
    let next = &found["next_measurement"];
    if !next.is_null() {
        assert!(next["condition"]["coolant_flow"].is_string() && next["others"].is_array(), "{next}");
    }
    let gain = &found["gain"];
    if !gain.is_null() {
        for key in ["rmse_before_K", "rmse_after_K", "low", "high", "noise_floor_K"] {
            assert!(gain[key].is_number(), "gain.{key}");
        }
        assert!(gain["held_out"].as_array().unwrap().iter().all(Value::is_string));
    }
    assert!(found["extended_machine"].is_string() || found["extended_machine"].is_null());
}

/// No request to anywhere, no script but in the frame of the machine, nothing outside the file.
pub(super) fn stands_alone(page: &str) {
    assert!(page.starts_with("<!DOCTYPE html>") && page.trim_end().ends_with("</html>"));
    // The name space of SVG is a name, not an address; a canvas is printed as data.
    let page = page.replace("xmlns=\"http://www.w3.org/2000/svg\"", "").replace("toDataURL()", "").to_lowercase();
    for taboo in ["http:", "https:", "<script", "javascript:", "<link", "<img", " src=", "@import", "url("] {
        assert!(!page.contains(taboo), "{taboo}");
    }
    assert!(!page.contains("nan ") && !page.contains(">nan<") && !page.contains(">inf<"), "a number that is none");
}

#[test]
fn what_was_set_is_part_of_the_extended_machine() {
    let (_, machine, table) = folder("set", &[HEAT, ("contact.motor.conductance", "300 W/(m2 K)")]);
    let args = ["diagnose", &machine, &table, "--cells", "600", "--json", "--quiet", "--set", "contact.motor.conductance=300 W/(m2 K)"];
    let found = json(&coldplate(&args));
    assert_eq!(found["causes"][0]["place"], "bracket", "{}", found["headline"]);
    let extended = found["extended_machine"].as_str().unwrap();
    let text = std::fs::read_to_string(extended).unwrap();
    assert!(text.contains("changed beforehand: contact.motor.conductance = \"300 W/(m2 K)\""), "{text}");
    let machine = Study::read(extended, &[], Some(600)).unwrap();
    assert!((machine.parameter("contact.motor.conductance").unwrap().value - 300.0).abs() < 1e-9);
    // Diagnosed again with the cause in it, nothing is wrong and no cause is named.
    let settled = json(&coldplate(&["diagnose", extended, &table, "--cells", "600", "--json", "--quiet"]));
    assert_eq!(settled["verdict"], "consistent", "{}", settled["headline"]);
    assert!(settled["causes"].as_array().unwrap().is_empty(), "{}", settled["causes"]);
}

/// The water of one test is stated 10 K too warm.
#[test]
fn what_is_set_aside_stands_in_the_first_sentence() {
    let (folder, machine, table) = folder("mistyped", &[]);
    let text = std::fs::read_to_string(&table).unwrap();
    assert!(text.contains("test 3,3.1,22,"), "{text}");
    std::fs::write(&table, text.replace("test 3,3.1,22,", "test 3,3.1,32,")).unwrap();
    let found = json(&coldplate(&["diagnose", &machine, &table, "--cells", "600", "--json", "--quiet"]));
    let headline = found["headline"].as_str().unwrap();
    assert_eq!(found["verdict"], "consistent", "{headline}");
    assert!(headline.starts_with("Without the part of the data that is set aside as grossly wrong"), "{headline}");
    assert!(!headline.contains("misfit"), "{headline}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn clean_data_leave_everything_as_it_is() {
    let (folder, machine, table) = folder("clean", &[]);
    let (report, surrogate) = (folder.join("report.html"), folder.join("small.cps"));
    let args = ["diagnose", &machine, &table, "--cells", "600", "--report", report.to_str().unwrap()];
    let found = coldplate(&[&args[..], &["--surrogate", surrogate.to_str().unwrap()]].concat());
    assert_eq!(found.status.code(), Some(0), "{}", message(&found));
    let text = String::from_utf8_lossy(&found.stdout).into_owned();
    for said in ["do not contradict", "no extended machine: nothing is wrong", "no surrogate: nothing is wrong"] {
        assert!(text.contains(said), "{said}: {text}");
    }
    assert_eq!(files(&folder), ["readings.csv", "readings.toml", "report.html", "small.toml"]);
    stands_alone(&std::fs::read_to_string(&report).unwrap());
}

#[test]
fn what_calibration_may_move_is_not_named() {
    let (_, machine, table) = folder("uncertain", &[("contact.seat.conductance", "500 W/(m2 K)")]);
    let args = ["diagnose", &machine, &table, "--cells", "600", "--json", "--quiet"];
    let found = json(&coldplate(&args));
    assert_ne!(found["verdict"], "consistent", "{}", found["headline"]);
    let found = json(&coldplate(&[&args[..], &["--uncertain", "contact.seat.conductance=100%"]].concat()));
    assert_eq!(found["verdict"], "consistent", "{}", found["headline"]);
}

#[test]
fn a_kind_of_the_user_s_own_is_found() {
    let (folder, machine, table) =
        folder("kinds", &[("source.hidden", "{ in = \"bracket\", power = \"5 * (4 / coolant_flow_L_min)^2\" }")]);
    let kinds = "[kind.\"hose friction\"]\nheat_into = [\"bracket\"]\nper_unit = \"(4 / coolant_flow_L_min)^2\"\nscale = 5.0\n";
    let kinds = write(&folder, "kinds.toml", kinds);
    let args = ["diagnose", &machine, &table, "--cells", "600", "--json", "--quiet"];
    let found = json(&coldplate(&[&args[..], &["--kinds", &kinds]].concat()));
    shape(&found);
    let cause = &found["causes"][0];
    assert_eq!((cause["kind"].as_str(), cause["place"].as_str()), (Some("user"), Some("hose friction")), "{}", found["headline"]);
    assert!((cause["parameters"]["amplitude"]["value"].as_f64().unwrap() - 5.0).abs() < 0.5, "{cause}");
    assert!(Study::read(found["extended_machine"].as_str().unwrap(), &[], Some(600)).is_ok());
}

#[test]
fn kinds_that_are_not_wanted_are_not_tried() {
    let (_, machine, table) = folder("without", &[HEAT]);
    let args = ["diagnose", &machine, &table, "--cells", "600", "--json", "--quiet", "--without", "heat source"];
    let found = json(&coldplate(&args));
    shape(&found);
    let all = found["causes"].as_array().unwrap().iter().chain(found["set"].as_array().unwrap().iter().flat_map(|e| e.as_array().unwrap()));
    assert!(all.clone().all(|c| c["kind"] != "heat source"));
    let typo = coldplate(&["diagnose", &machine, &table, "--without", "heat sorce"]);
    assert!(typo.status.code() == Some(2) && message(&typo).contains("did you mean 'heat source'?"), "{}", message(&typo));
}

/// A log of a machine of two nodes that is heavier than its file says.
#[test]
fn a_log_is_reported_too() {
    const NODES: &str = r#"
name = "two nodes in a row"
[node.base]
temperature = "ambient_temperature"
[node.middle]
capacity = "200 J/K"
[node.motor]
capacity = "1000 J/K"
[contact.first]
between = ["base", "middle"]
total_conductance = "2 W/K"
[contact.second]
between = ["middle", "motor"]
total_conductance = "4 W/K"
[source.motor]
in = "motor"
power = "0.02 * motor_speed_rpm"
[sensor.motor]
node = "motor"
[sensor.middle]
node = "middle"
"#;
    let folder = scratch("log");
    let machine = write(&folder, "nodes.toml", NODES);
    // Closed form by small explicit steps: C dT/dt = heat in less heat out, with 1500 J/K in place of 1000.
    let (mut middle, mut motor, mut t, step) = (22.0, 22.0, 0.0, 0.05);
    let mut random = Random::new(3);
    let mut rows = String::new();
    for k in 0..=60 {
        while t < 60.0 * f64::from(k) - 1e-9 {
            let (first, second) = (2.0 * (middle - 22.0), 4.0 * (motor - middle));
            middle += step * (second - first) / 200.0;
            motor += step * (20.0 - second) / 1500.0;
            t += step;
        }
        let (a, b) = (motor + 0.02 * random.normal(), middle + 0.02 * random.normal());
        rows += &format!("{},warming up,2,20,1000,22,{a:.3},{b:.3}\n", 60 * k);
    }
    let table = write(&folder, "log.csv", format!("time [s],{HEADER},motor [degC],middle [degC]\n{rows}"));
    write(&folder, "log.toml", "kind = \"standard deviations\"\nnoise = \"0.02 K\"\nbias = \"0.02 K\"\n");
    let report = folder.join("report.html");
    let args = ["diagnose", &machine, &table, "--json", "--quiet", "--from", "22 degC", "--report", report.to_str().unwrap()];
    let found = json(&coldplate(&args));
    shape(&found);
    let cause = &found["causes"][0];
    assert_eq!((cause["kind"].as_str(), cause["place"].as_str()), (Some("heat capacity"), Some("motor")), "{}", found["headline"]);
    let more = cause["parameters"]["heat_capacity"]["value"].as_f64().unwrap();
    assert!(((1000.0 + more) / 1500.0 - 1.0).abs() < 0.03, "{cause}");
    let page = std::fs::read_to_string(&report).unwrap();
    stands_alone(&page);
    assert!(page.contains("time [s]"));
}

/// The machine that is written says how sure each cause is, so that a sweep of it carries that on.
#[test]
fn a_written_cause_carries_its_deviation() {
    let folder = scratch("deviations");
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let out = folder.join("extended.toml");
    let tutorial = root.join("examples/tutorial");
    // The machine as identified, whose contact is uncertain: it is refitted beside the cause.
    let text = std::fs::read_to_string(tutorial.join("machine.toml")).unwrap();
    let identified = text.replace("\"600 W/(m2 K)\"", "\"497.4 +- 20.5 W/(m2 K)\"");
    assert_ne!(identified, text);
    let machine = write(&folder, "identified.toml", identified);
    let readings = tutorial.join("readings.csv").display().to_string();
    let found = json(&coldplate(&["diagnose", &machine, &readings, "--json", "--out", out.to_str().unwrap()]));
    let study = coldplate_solve::study::Study::read(&out, &[], Some(400)).unwrap();
    let stated = study.open_parameters(false).unwrap();
    let causes = found["rungs"].as_array().unwrap().iter().flat_map(|rung| rung["causes"].as_array().unwrap());
    let mut seen = 0;
    for cause in causes {
        let place = cause["place"].as_str().unwrap();
        let own = stated.iter().find(|p| p.name.contains(place)).unwrap_or_else(|| panic!("{place} is not among {stated:?}"));
        let [low, value, high] = ["low", "value", "high"].map(|k| cause["amplitude"][k].as_f64().unwrap());
        // Both are factors, or shares of the number: of 1 + a, where the amplitude is a.
        let share = own.deviation / own.nominal;
        let expected = (high - low) / (2.0 * 1.6449) / (1.0 + value);
        println!("{}: {:.3} %, amplitude {value:.4} ({low:.4} to {high:.4})", own.name, 100.0 * share);
        assert!(share > 0.5 * expected && share < 2.0 * expected, "{share} {expected}");
        seen += 1;
    }
    assert!(seen > 0);
    // More heat with less contact reads alike: what was fitted together is correlated.
    let correlations = study.correlations(&stated).unwrap();
    let apart = correlations.iter().enumerate().flat_map(|(i, row)| row.iter().enumerate().filter(move |(j, _)| *j < i));
    let strongest = apart.map(|(_, c)| *c).fold(0.0, |most: f64, c| if c.abs() > most.abs() { c } else { most });
    assert!((0.3..=1.0).contains(&strongest.abs()), "{strongest}");
}
