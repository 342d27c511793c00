//! Sweeps that are killed, or asked to end, while programs run.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use super::{coldplate, folder, json, runs, shell, tables};

const SLOW: &str = "sleep 0.03\nif [ $x = 500 ]; then exit 2; fi\necho \"t = $x\"";

fn started(folder: &Path) -> Child {
    coldplate(folder, &["sweep", "sweep.toml", "--out", "out", "--quiet"]).spawn().unwrap()
}

/// Waits until so many runs have begun since.
fn wait_for(folder: &Path, count: usize) {
    let begin = Instant::now();
    while runs(folder).len() < count {
        assert!(begin.elapsed() < Duration::from_secs(60), "{} runs", runs(folder).len());
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_killed_sweep_goes_on_to_the_same_bytes() {
    let whole = folder("whole");
    shell(&whole, 41, "at_once = 2", SLOW);
    json(&whole, &["sweep", "sweep.toml", "--out", "out"]);
    let folder = folder("killed");
    for file in ["sweep.toml", "x.txt.template"] {
        std::fs::copy(whole.join(file), folder.join(file)).unwrap();
    }
    // The same script to the byte, as its hash is part of what results depend on.
    std::fs::copy(whole.join("solve.sh"), folder.join("solve.sh")).unwrap();
    let log = whole.join("runs.log");
    std::fs::remove_file(&log).unwrap();
    let mut kills = 0;
    for at in [3, 9, 17, 26, 33] {
        let mut process = started(&folder);
        wait_for(&whole, at + kills);
        process.kill().unwrap();
        process.wait().unwrap();
        kills += 1;
    }
    let ran = json(&folder, &["sweep", "sweep.toml", "--out", "out"]);
    assert!(ran["resumed"].as_u64().unwrap() > 5, "{ran}");
    assert_eq!(tables(&folder.join("out")), tables(&whole.join("out")));
    let mut of: BTreeMap<String, usize> = BTreeMap::new();
    runs(&whole).into_iter().for_each(|x| *of.entry(x).or_default() += 1);
    assert_eq!(of.len(), 41);
    // What was under way when the sweep was killed, two runs at most each time, is all that was run again.
    assert!(of.values().sum::<usize>() <= 41 + 2 * kills, "{of:?}");
    let journal = std::fs::read_to_string(folder.join("out/sweep.journal")).unwrap();
    assert_eq!(journal.lines().count(), 1 + 41);
    for folder in [folder, whole] {
        std::fs::remove_dir_all(&folder).unwrap();
    }
}

/// A scheduler ends every process of a job, and a run may hear of it before the sweep: that is no crash of its condition.
#[cfg(target_os = "linux")]
#[test]
fn a_run_that_is_told_first_has_not_crashed() {
    let folder = folder("first");
    // The run ends itself by the signal, and the sweep a moment later.
    shell(
        &folder,
        3,
        "at_once = 1",
        "if [ $x != 0 ]; then (sleep 0.1; kill -TERM $(cat ../../../../pid)) & kill -TERM $$; fi\necho \"t = $x\"",
    );
    std::fs::write(folder.join("start.sh"), "echo $$ > pid\nexec \"$0\" sweep sweep.toml --out out --quiet\n").unwrap();
    let script = std::fs::read_to_string(folder.join("start.sh")).unwrap();
    let ended = Command::new("sh").args(["-c", &script, env!("CARGO_BIN_EXE_coldplate")]).current_dir(&folder).output().unwrap();
    assert_eq!(ended.status.code(), Some(2), "{}", super::said(&ended));
    let journal = std::fs::read_to_string(folder.join("out/sweep.journal")).unwrap();
    assert!(!journal.contains("failed") && journal.lines().count() == 2, "{journal}");
    std::fs::remove_dir_all(&folder).unwrap();
}

/// The terminate signal and a terminal that is closed, as Ctrl-C, end the runs with the sweep: nothing goes on behind its back.
#[cfg(target_os = "linux")]
#[test]
fn a_sweep_that_is_asked_to_end_takes_its_runs_with_it() {
    for signal in ["-TERM", "-HUP"] {
        ended_by(signal);
    }
}

#[cfg(target_os = "linux")]
fn ended_by(signal: &str) {
    let folder = folder("ended");
    let mark = format!("37.{}", std::process::id());
    shell(&folder, 4, "at_once = 2", &format!("if [ $x != 0 ]; then sleep {mark}; fi\necho \"t = $x\""));
    let process = started(&folder);
    wait_for(&folder, 3);
    assert!(Command::new("kill").args([signal, &process.id().to_string()]).status().unwrap().success());
    let ended = process.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(2));
    let processes = std::fs::read_dir("/proc").unwrap().filter_map(|entry| std::fs::read(entry.unwrap().path().join("cmdline")).ok());
    assert_eq!(processes.filter(|line| String::from_utf8_lossy(line).contains(&mark)).count(), 0);
    let journal = std::fs::read_to_string(folder.join("out/sweep.journal")).unwrap();
    assert_eq!(journal.lines().count(), 2, "{journal}");
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Whoever says that a closed terminal is to be outlived (nohup) is believed.
#[cfg(target_os = "linux")]
#[test]
fn a_sweep_that_is_to_outlive_its_terminal_does() {
    let folder = folder("nohup");
    shell(&folder, 6, "at_once = 1", "sleep 0.05\necho \"t = $x\"");
    let line = "trap '' HUP; exec \"$0\" sweep sweep.toml --out out --quiet";
    let process = Command::new("sh").args(["-c", line, env!("CARGO_BIN_EXE_coldplate")]).current_dir(&folder).spawn().unwrap();
    wait_for(&folder, 2);
    assert!(Command::new("kill").args(["-HUP", &process.id().to_string()]).status().unwrap().success());
    assert!(process.wait_with_output().unwrap().status.success());
    assert_eq!(runs(&folder).len(), 6);
    std::fs::remove_dir_all(&folder).unwrap();
}
