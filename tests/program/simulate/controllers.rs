//! Machines with controllers, from the command line.

use super::{coldplate, json, scratch, write};

const ROOM: [&str; 2] = ["--ambient-temperature", "20 degC"];

/// Plate: 4 (30 - 20) - 1 (40 - 30) = 30 W of 100 W. Bath: 6 (40 - 20) + 1 (40 - 30) = 130 W of 200 W.
#[test]
fn steady_shares_and_mean_shares_over_time_agree() {
    let found = json(&coldplate(&[&["solve", "machines/heater.toml", "--json"], &ROOM[..]].concat()));
    for (controller, share) in [("plate", 0.30), ("bath", 0.65)] {
        let own = found["controllers"][controller].as_f64().unwrap();
        assert!((own - share).abs() < 1e-6, "{controller}: {own}");
    }
    assert!((found["heat_balance"]["sources_W"]["bath_heater"].as_f64().unwrap() - 130.0).abs() < 1e-3);
    let text = coldplate(&[&["solve", "machines/heater.toml"], &ROOM[..]].concat());
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    assert!(text.contains("cycles, on for this share of the time") && text.contains("holds its set point"), "{text}");

    let folder = scratch("controllers");
    let schedule = write(&folder, "s.csv", "time [s],plate_temperature [degC]\n0,30\n20000,30\n");
    let args = ["simulate", "machines/heater.toml", &schedule, "--from", "steady", "--every", "500 s", "--json", "--quiet"];
    let found = json(&coldplate(&[&args[..], &ROOM].concat()));
    let notes = found["notes"].as_array().unwrap().iter().map(|n| n.as_str().unwrap()).collect::<Vec<_>>().join("\n");
    let mean = |name: &str| {
        let line = notes.lines().find(|line| line.contains(name)).unwrap_or_else(|| panic!("{notes}"));
        line.split(": ").nth(1).unwrap().split(' ').next().unwrap().parse::<f64>().unwrap()
    };
    assert!((mean("'plate'") - 30.0).abs() < 0.5 && (mean("'bath'") - 65.0).abs() < 1.0, "{notes}");
    assert!(found["energy"]["relative"].as_f64().unwrap() < 1e-8);
    let bath: Vec<f64> = found["series"]["bath"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    assert!(bath.iter().all(|t| (t - 40.0).abs() < 0.51), "{bath:?}");
    let plate: Vec<f64> = found["series"]["plate"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    assert!(plate.iter().all(|t| (t - 30.0).abs() < 0.2), "{plate:?}");
}

/// A set point that jumps in the schedule is followed; a reduced model of such a machine is refused before any work.
#[test]
fn set_points_are_formulas_and_reduced_models_are_refused() {
    let folder = scratch("set-point");
    let schedule = write(&folder, "s.csv", "time [s],plate_temperature [degC]\n0,30\n3000,30\n3000,36\n20000,36\n");
    let args = ["simulate", "machines/heater.toml", &schedule, "--from", "steady", "--every", "1000 s", "--json", "--quiet"];
    let found = json(&coldplate(&[&args[..], &ROOM].concat()));
    let plate: Vec<f64> = found["series"]["plate"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    assert!((plate.last().unwrap() - 36.0).abs() < 0.1, "{plate:?}");
    let refused = coldplate(&["reduce", "machines/heater.toml", "--vary", "plate_temperature"]);
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(2), "{message}");
    assert!(message.contains("cannot follow a controller") && message.contains("controller.plate"), "{message}");
}
