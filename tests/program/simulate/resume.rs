//! Killed at any moment and taken up again, a run ends in the same numbers.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::{coldplate, json, numbers, scratch, write};

const SCHEDULE: &str = "time [h],motor_speed [rpm],coolant_flow [L/min],coolant_temperature [degC],ambient_temperature [degC]\n\
                        0,0,6,20,22\n0,2500,6,20,22\n3,2500,6,20,22\n3,500,6,21,22\n6,2500,4,20,22\n";

#[test]
fn killed_runs_go_on_where_they_were() {
    let folder = scratch("resume");
    let schedule = write(&folder, "s.csv", SCHEDULE);
    let checkpoint = folder.join("state").to_str().unwrap().to_string();
    let (whole, resumed) = (folder.join("whole.csv"), folder.join("resumed.csv"));
    let base = ["simulate", "machines/rig.toml", &schedule, "--cells", "3000", "--every", "1 min", "--json", "--quiet", "--out"];
    let reference = json(&coldplate(&[&base[..], &[whole.to_str().unwrap()]].concat()));

    let with = |checkpoint| {
        [&base[..], &[resumed.to_str().unwrap(), "--checkpoint", checkpoint, "--checkpoint-every", "0 s", "--resume"]].concat()
    };
    let mut killed = 0;
    for _ in 0..3 {
        let before = std::fs::metadata(&checkpoint).and_then(|m| m.modified()).ok();
        let mut child = Command::new(env!("CARGO_BIN_EXE_coldplate"))
            .args(with(&checkpoint))
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let start = Instant::now();
        let is_new = || std::fs::metadata(&checkpoint).and_then(|m| m.modified()).ok().is_some_and(|m| Some(m) != before);
        while !is_new() && start.elapsed() < Duration::from_secs(60) && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(3));
        }
        std::thread::sleep(Duration::from_millis(20));
        if child.try_wait().unwrap().is_none() {
            killed += 1;
        }
        // SIGKILL on Unix: nothing of the program runs after it.
        let _ = child.kill();
        child.wait().unwrap();
        assert!(!resumed.exists() || killed < 3);
    }
    assert!(killed > 0, "the program was never killed while running");
    let end = json(&coldplate(&with(&checkpoint)));
    assert!(end["resumed_at_s"].as_f64().unwrap() > 0.0);
    let (a, b) = (&reference["series"], &end["series"]);
    for name in a.as_object().unwrap().keys() {
        let (a, b) = (numbers(&a[name]), numbers(&b[name]));
        assert_eq!(a.len(), b.len(), "{name}");
        let worst = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("{name}: at most {worst:.1e} apart");
        assert!(worst <= 1e-9, "{name}: {worst:e}");
    }
    let rows = |path| std::fs::read_to_string(path).unwrap().lines().count();
    assert_eq!(rows(&whole), rows(&resumed));

    // A checkpoint of another run is refused, and it is said why.
    for (change, needle) in [
        (["--cells", "2000"], "number of cells"),
        (["--within", "1 K"], "--within"),
        (["--from", "20 degC"], "--from"),
        (["--until", "5 h"], "schedule"),
        (["--set", "contacts.default=\"bonded\""], "machine file"),
    ] {
        let mut args: Vec<&str> = with(&checkpoint);
        if change[0] == "--cells" {
            args[4] = change[1];
        } else {
            args.extend(change);
        }
        let output = coldplate(&args);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{change:?}: {message}");
        assert!(message.contains("another run") && message.contains(needle), "{change:?}: {message}");
    }
    // So is a damaged one, wherever the damage is.
    let bytes = std::fs::read(&checkpoint).unwrap();
    for at in [0, 30, bytes.len() / 2, bytes.len() - 1] {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1;
        std::fs::write(&checkpoint, &damaged).unwrap();
        assert_eq!(coldplate(&with(&checkpoint)).status.code(), Some(2), "byte {at}");
    }
    for length in [0, 10, 23, 26, bytes.len() - 1] {
        std::fs::write(&checkpoint, &bytes[..length]).unwrap();
        assert_eq!(coldplate(&with(&checkpoint)).status.code(), Some(2), "{length} bytes");
    }
}
