//! Measured displacements: a contact is found from them alone, and a hidden heat too.

use crate::common::coldplate_in;
use crate::displacement::{POST, folder, json};

const SPEEDS: [(u32, u32); 6] = [(500, 20), (1000, 26), (1500, 18), (2000, 22), (2500, 24), (3000, 20)];

/// Readings of the tip alone, of a machine that differs, with the scatter of a probe of 0.1 um.
fn readings(folder: &std::path::Path, sets: &[&str], with_arm: bool) {
    let mut table = String::from("test,coolant_flow [L/min],coolant_temperature [degC],motor_speed [rpm],ambient_temperature [degC],");
    table += if with_arm { "tip x [um],tip z [um],arm [degC]\n" } else { "tip x [um],tip z [um]\n" };
    for (i, (speed, ambient)) in SPEEDS.iter().enumerate() {
        let (speed, ambient) = (format!("{speed} rpm"), format!("{ambient} degC"));
        let mut args = vec!["solve", "post.toml", "--no-mesh-error", "--motor-speed", &speed, "--ambient-temperature", &ambient];
        sets.iter().for_each(|set| args.extend(["--set", set]));
        let solved = json(folder, &args);
        let read = |name: &str, scatter: f64| solved["sensors"][name].as_f64().unwrap() + scatter * [0.7, -1.1, 0.4, 1.2, -0.6, -0.5][i];
        let (rpm, degrees) = SPEEDS[i];
        table += &format!("test {i},2,20,{rpm},{degrees},{:.2},{:.2}", read("tip x", 0.1), read("tip z", -0.1));
        table += &if with_arm { format!(",{:.2}\n", read("arm", 0.05)) } else { "\n".to_string() };
    }
    std::fs::write(folder.join("data.csv"), table).unwrap();
    let uncertainty = "kind = \"standard deviations\"\nnoise = \"0.05 K\"\nbias = \"0.02 K\"\ndisplacement_noise = \"0.1 um\"\n\
                       displacement_bias = \"0.05 um\"\n[condition]\nambient_temperature = \"0.05 K\"\n";
    std::fs::write(folder.join("data.toml"), uncertainty).unwrap();
}

#[test]
fn a_contact_is_found_from_displacements() {
    let folder = folder("identify");
    readings(&folder, &["contact.foot.conductance=500 W/(m2 K)"], false);
    let found = json(&folder, &["identify", "post.toml", "data.csv", "--free", "contact.foot.conductance"]);
    let own = &found["parameters"]["contact.foot.conductance"];
    let (value, low, high) = (own["value"].as_f64().unwrap(), own["low"].as_f64().unwrap(), own["high"].as_f64().unwrap());
    assert!((470.0..530.0).contains(&value) && low < 500.0 && high > 500.0, "{own}");
}

/// Heat that the file does not know, in the post: the readings of the tip name it.
#[test]
fn a_hidden_heat_is_diagnosed_from_displacements() {
    let folder = folder("diagnose");
    readings(&folder, &["source.hidden={ in = [\"post\"], power = \"12 W\" }"], true);
    assert!(!POST.contains("hidden"));
    let found = json(&folder, &["diagnose", "post.toml", "data.csv"]);
    assert_eq!(found["verdict"], "explained", "{}", found["sentence"]);
    let causes = found["causes"].to_string() + &found["set"].to_string();
    assert!(causes.contains("post"), "{causes}");
    let gain = &found["gain"];
    assert!(gain["rmse_after_K"].as_f64().unwrap() < 0.3 * gain["rmse_before_K"].as_f64().unwrap(), "{gain}");
    assert!(gain["rmse_after_um"].as_f64().unwrap() < 0.3 * gain["rmse_before_um"].as_f64().unwrap(), "{gain}");
    let text = coldplate_in(&folder, &["predict", "post.toml", "data.csv", "--csv"]);
    assert!(String::from_utf8_lossy(&text.stdout).contains("tip x residual [um]"));
}

/// Sums of residuals are of one unit each, and a displacement is shown as one.
#[test]
fn micrometres_are_not_counted_as_kelvins() {
    let folder = folder("units");
    readings(&folder, &["contact.foot.conductance=500 W/(m2 K)"], true);
    let found = json(&folder, &["predict", "post.toml", "data.csv"]);
    let rmse = |of: &serde_json::Value, unit: &str| of[format!("rmse_{unit}")].as_f64();
    let (all, arm, tip) = (&found["all"], &found["sensors"]["arm"], &found["sensors"]["tip x"]);
    assert!(rmse(all, "K") == rmse(arm, "K") && rmse(arm, "um").is_none() && rmse(tip, "K").is_none(), "{found}");
    let own: Vec<f64> = found["readings"].as_array().unwrap().iter().filter_map(|r| r["residual_um"].as_f64()).collect();
    let expected = (own.iter().map(|r| r * r).sum::<f64>() / own.len() as f64).sqrt();
    assert!(own.len() == 12 && (rmse(all, "um").unwrap() - expected).abs() < 1e-12 * expected, "{all}");

    let asked = ["identify", "post.toml", "data.csv", "--free", "contact.foot.conductance", "--brief"];
    let used = ["--use", "test 0", "--use", "test 1", "--use", "test 2", "--use", "test 3"];
    let found = json(&folder, &[&asked[..], &used].concat());
    let tip = found["readings"].as_array().unwrap().iter().find(|r| r["sensor"] == "tip x").unwrap();
    assert!(tip["measured_um"].as_f64().unwrap() > 0.0 && tip.get("measured_degC").is_none(), "{tip}");
    let held = &found["held_out"];
    let rms = |unit: &str, key: &str| {
        let of = |r: &serde_json::Value| Some((r[format!("{key}_{unit}")].as_f64()? - r[format!("measured_{unit}")].as_f64()?).powi(2));
        let squares: Vec<f64> = held["readings"].as_array().unwrap().iter().filter_map(of).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    };
    for (key, unit, shown) in [("before", "um", "um"), ("after", "um", "um"), ("before", "K", "degC"), ("after", "K", "degC")] {
        let (told, expected) = (held[format!("rmse_{key}_{unit}")].as_f64().unwrap(), rms(shown, key));
        assert!((told - expected).abs() < 1e-6 * expected, "{key} {unit}: {told} and {expected}");
    }
    assert!(held["rmse_after_um"].as_f64() < held["rmse_before_um"].as_f64(), "{held}");
}

/// Readings that say nothing of the one number that is free: it keeps its value, and that is no crash.
#[test]
fn a_number_that_nothing_determines_is_kept() {
    let folder = folder("kept");
    std::fs::write(
        folder.join("data.csv"),
        "test,motor_speed [rpm],ambient_temperature [degC],arm [degC]\na,1000,20,30\nb,2000,22,45\nc,3000,25,60\nd,500,18,22\n",
    )
    .unwrap();
    let found = json(&folder, &["identify", "post.toml", "data.csv", "--free", "contact.flange.conductance", "--brief"]);
    let own = &found["parameters"]["contact.flange.conductance"];
    assert_eq!(own["value"], 1500.0, "{own}");
}
