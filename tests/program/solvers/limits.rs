//! Time limits, licences, the cache.

use std::time::{Duration, Instant};

use super::{coldplate, folder, json, runs, shell, tables};

/// What a run starts in its turn ends with it.
#[cfg(target_os = "linux")]
#[test]
fn a_time_limit_ends_all_that_a_run_has_started() {
    let folder = folder("time");
    let mark = format!("31.{}", std::process::id());
    shell(&folder, 2, "time_limit = '300 ms'", &format!("if [ $x = 0 ]; then sleep {mark} & sleep {mark}; fi\necho \"t = $x\""));
    let begin = Instant::now();
    let ran = json(&folder, &["sweep", "sweep.toml", "--out", "out"]);
    assert_eq!(ran["failures"][0]["class"], "timed_out", "{ran}");
    assert!(begin.elapsed() < Duration::from_secs(20));
    let alive = || {
        let processes = std::fs::read_dir("/proc").unwrap().filter_map(|entry| std::fs::read(entry.unwrap().path().join("cmdline")).ok());
        processes.filter(|line| String::from_utf8_lossy(line).contains(&mark)).count()
    };
    let patience = Instant::now();
    while alive() > 0 && patience.elapsed() < Duration::from_secs(5) {
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_eq!(alive(), 0);
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Two processes of four threads each share two tokens: never more than two runs are under way.
#[test]
fn licences_are_counted_over_all_processes() {
    let folder = folder("licence");
    let busy = folder.join("busy");
    std::fs::create_dir(&busy).unwrap();
    let script = format!(
        "touch '{0}'/$$\nls '{0}' | wc -l >> '{1}'\nsleep 0.02\nrm '{0}'/$$\necho \"t = $x\"",
        busy.display(),
        folder.join("counts").display()
    );
    shell(&folder, 24, "at_once = 4\n[solver.licence]\nfolder = 'licence'\ntokens = 2", &script);
    let processes = ["one", "two"].map(|name| {
        let shard = if name == "one" { "1/2" } else { "2/2" };
        coldplate(&folder, &["sweep", "sweep.toml", "--out", "out", "--shard", shard, "--quiet"]).spawn().unwrap()
    });
    for mut process in processes {
        assert!(process.wait().unwrap().success());
    }
    let counts: Vec<usize> =
        std::fs::read_to_string(folder.join("counts")).unwrap().lines().map(|line| line.trim().parse().unwrap()).collect();
    assert_eq!(counts.len(), 24);
    assert!(counts.iter().all(|count| *count <= 2) && counts.contains(&2), "{counts:?}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn the_same_content_is_run_once_and_other_content_again() {
    let folder = folder("cache");
    let keys = "version = ['cat', 'version.txt']\ncache = 'cache'";
    shell(&folder, 5, keys, "echo \"t = $x.1234567890123\"");
    // `version` runs in a folder of its own: the path is absolute.
    let path = folder.join("version.txt");
    let stated = std::fs::read_to_string(folder.join("sweep.toml")).unwrap().replace("version.txt", path.to_str().unwrap());
    std::fs::write(folder.join("sweep.toml"), stated).unwrap();
    std::fs::write(&path, "\n1.0\n").unwrap();
    json(&folder, &["sweep", "sweep.toml", "--out", "out/first"]);
    json(&folder, &["sweep", "sweep.toml", "--out", "out/second"]);
    assert_eq!(runs(&folder).len(), 5);
    assert_eq!(tables(&folder.join("out/first")), tables(&folder.join("out/second")));
    // A design that shares conditions runs the others alone.
    let sweep = std::fs::read_to_string(folder.join("sweep.toml")).unwrap();
    std::fs::write(folder.join("more.toml"), sweep.replace("points = 5", "points = 9")).unwrap();
    json(&folder, &["sweep", "more.toml", "--out", "out/more"]);
    assert_eq!(runs(&folder).len(), 9);
    // Another version, another template, another file: all again.
    std::fs::write(&path, "2.0\n").unwrap();
    json(&folder, &["sweep", "sweep.toml", "--out", "out/version"]);
    assert_eq!(runs(&folder).len(), 14);
    std::fs::write(folder.join("x.txt.template"), "{{x:W}} \n").unwrap();
    json(&folder, &["sweep", "sweep.toml", "--out", "out/template"]);
    assert_eq!(runs(&folder).len(), 19);
    let script = std::fs::read_to_string(folder.join("solve.sh")).unwrap();
    std::fs::write(folder.join("solve.sh"), format!("{script}\n# changed\n")).unwrap();
    json(&folder, &["sweep", "sweep.toml", "--out", "out/file"]);
    assert_eq!(runs(&folder).len(), 24);
    // A damaged entry of the cache is none.
    for entry in std::fs::read_dir(folder.join("cache")).unwrap().flat_map(|e| std::fs::read_dir(e.unwrap().path()).unwrap()) {
        std::fs::write(entry.unwrap().path(), "{\"values\": [").unwrap();
    }
    json(&folder, &["sweep", "sweep.toml", "--out", "out/damaged"]);
    assert_eq!(runs(&folder).len(), 29);
    assert_eq!(tables(&folder.join("out/damaged")), tables(&folder.join("out/file")));
    std::fs::remove_dir_all(&folder).unwrap();
}
