//! Measured displacements: a contact is found from them alone, and a hidden heat too.

use crate::{POST, coldplate, folder, json};

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
    let text = coldplate(&folder, &["predict", "post.toml", "data.csv", "--csv"]);
    assert!(String::from_utf8_lossy(&text.stdout).contains("tip x residual [um]"));
}
