//! A real Slurm of our own on this host: its nodes and jobs are killed, and nothing is lost or done twice.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::{coldplate, folder, json, root, runs, said, shell, tables};

const CONDITIONS: usize = 2000;
const PARTS: usize = 8;

/// The daemons, ended when the test is.
struct Slurm {
    folder: PathBuf,
}

impl Slurm {
    fn start(folder: &Path) -> Option<Self> {
        let slurm = Self { folder: folder.join("slurm-here") };
        let started = slurm.here("start", &["3"]);
        if started.status.code() == Some(3) {
            println!("skipped: {}", said(&started).trim());
            return None;
        }
        assert!(started.status.success(), "{}", said(&started));
        Some(slurm)
    }

    fn here(&self, action: &str, more: &[&str]) -> std::process::Output {
        let mut command = Command::new(root().join("scripts/slurm-here"));
        // Daemons keep what they are given open: a pipe would never end.
        let log = std::fs::File::create(self.folder.with_extension("log")).unwrap();
        command.arg(action).arg(&self.folder).args(more).stdout(Stdio::null()).stderr(log);
        let status = command.status().unwrap();
        let stderr = std::fs::read(self.folder.with_extension("log")).unwrap();
        std::process::Output { status, stdout: Vec::new(), stderr }
    }

    fn ask(&self, command: &str, arguments: &[&str]) -> String {
        let output = Command::new(command).args(arguments).env("SLURM_CONF", self.folder.join("slurm.conf")).output().unwrap();
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    fn sweep(&self, folder: &Path, parts: usize) -> Command {
        let mut command = coldplate(folder, &["sweep", "sweep.toml", "--out", "out", "--slurm", &parts.to_string(), "--json"]);
        command.env("SLURM_CONF", self.folder.join("slurm.conf")).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        self.here("stop", &[]);
    }
}

/// Lines of all journals of parts, their first ones not counted.
fn journal_lines(folder: &Path) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(folder.join("out/shards")) else { return Vec::new() };
    let texts = entries.filter_map(|entry| std::fs::read_to_string(entry.ok()?.path()).ok());
    texts.flat_map(|text| text.lines().skip(1).map(String::from).collect::<Vec<_>>()).collect()
}

fn wait_for(what: &str, watcher: &mut Child, is_so: impl Fn() -> bool) {
    let begin = Instant::now();
    while !is_so() {
        assert!(watcher.try_wait().unwrap().is_none(), "the sweep ended before {what}");
        assert!(begin.elapsed() < Duration::from_secs(120), "no {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn nothing_is_lost_or_done_twice() {
    let folder = folder("slurm");
    let Some(slurm) = Slurm::start(&folder) else { return };
    shell(&folder, CONDITIONS, "", "sleep 0.01\nif [ $x = 0 ]; then exit 2; fi\necho \"t = $x\"");
    let mut watcher = slurm.sweep(&folder, PARTS).spawn().unwrap();

    // A node fails, with all that runs on it.
    wait_for("some conditions", &mut watcher, || journal_lines(&folder).len() > 200);
    let running = slurm.ask("squeue", &["-h", "-r", "-t", "R", "-o", "%N"]);
    let lost = running.lines().next().unwrap().trim_start_matches("node").to_string();
    assert!(slurm.here("kill-node", &[&lost]).status.success());
    // A task is cancelled by somebody.
    wait_for("more conditions", &mut watcher, || journal_lines(&folder).len() > 500);
    let others = slurm.ask("squeue", &["-h", "-r", "-t", "R", "-o", "%i %N"]);
    let other = others.lines().find(|line| !line.ends_with(&format!("node{lost}"))).unwrap().split(' ').next().unwrap().to_string();
    slurm.ask("scancel", &[&other]);
    // Whoever watches is killed, while the jobs go on.
    watcher.kill().unwrap();
    watcher.wait().unwrap();
    let mut watcher = slurm.sweep(&folder, PARTS).spawn().unwrap();
    // The node comes back.
    wait_for("many conditions", &mut watcher, || journal_lines(&folder).len() > 900);
    assert!(slurm.here("start-node", &[&lost]).status.success());
    // A task is put back into the queue.
    wait_for("most conditions", &mut watcher, || journal_lines(&folder).len() > 1200);
    let running = slurm.ask("squeue", &["-h", "-r", "-t", "R", "-o", "%i"]);
    running.lines().take(1).for_each(|task| drop(slurm.ask("scontrol", &["requeue", task])));
    let ended = watcher.wait_with_output().unwrap();
    assert!(ended.status.success(), "{}", said(&ended));
    let told: serde_json::Value = serde_json::from_slice(&ended.stdout).unwrap();
    assert_eq!((&told["conditions"], &told["failed"]), (&CONDITIONS.into(), &1.into()), "{told}");

    // Every condition stands in one journal once, and all that was run more than once was under way when something was killed:
    // four tasks of one run each on the node, the one that was cancelled, and the one that was put back.
    let mut of: BTreeMap<usize, usize> = BTreeMap::new();
    for line in journal_lines(&folder) {
        *of.entry(line.split('\t').next().unwrap().parse().unwrap()).or_default() += 1;
    }
    assert_eq!(of.len(), CONDITIONS);
    let more: Vec<_> = of.iter().filter(|(_, count)| **count > 1).collect();
    assert!(more.is_empty(), "{more:?} stand more than once; {}", told["slurm"]["rounds"]);
    let again = runs(&folder).len() - CONDITIONS;
    assert!(again <= 6, "{again} runs were made again");
    let rounds = told["slurm"]["rounds"].as_array().unwrap();
    assert!(said(&ended).contains("cancelled") || rounds.len() > 1, "{}", said(&ended));
    println!("{} conditions, {again} runs made again, {} rounds", CONDITIONS, rounds.len());

    // One machine gives the same bytes.
    std::fs::remove_dir_all(folder.join("solver-cache")).unwrap_or_default();
    let shared = folder.join("out");
    std::fs::write(folder.join("whole.toml"), std::fs::read(folder.join("sweep.toml")).unwrap()).unwrap();
    json(&folder, &["sweep", "whole.toml", "--out", "whole", "--threads", "8"]);
    assert_eq!(tables(&folder.join("whole")), tables(&shared));

    preempted(&slurm, &folder);
    stuck(&slurm, &folder);
    full_disk(&slurm, &folder);
    main_job(&slurm, &folder);
    drop(slurm);
    std::fs::remove_dir_all(&folder).unwrap();
}

/// The main job has its sweep run there too, in as many tasks as the number of conditions says, and goes on to the end by itself.
fn main_job(slurm: &Slurm, folder: &Path) {
    let folder = folder.join("job");
    std::fs::create_dir_all(&folder).unwrap();
    shell(&folder, 41, "", "echo \"t = $x\"");
    let mut command = coldplate(&folder, &["run", "sweep.toml", "--out", "out", "--slurm", "--sbatch=--time=5", "--json"]);
    let ended = command.env("SLURM_CONF", slurm.folder.join("slurm.conf")).output().unwrap();
    assert!(ended.status.success(), "{}", said(&ended));
    let told: serde_json::Value = serde_json::from_slice(&ended.stdout).unwrap();
    assert_eq!((&told["slurm"]["parts"], &told["conditions"], &told["resumed"]), (&5.into(), &41.into(), &41.into()), "{told}");
    assert!(folder.join("out/report.html").exists());
    assert_eq!(runs(&folder).len(), 41);
}

/// A job of a partition that goes before takes all nodes: the tasks go back into the queue, and on from where they were.
fn preempted(slurm: &Slurm, folder: &Path) {
    const ROWS: usize = 400;
    std::fs::remove_dir_all(folder.join("out")).unwrap();
    shell(folder, ROWS, "", "sleep 0.05\necho \"t = $x\"");
    let put_back = || slurm.ask("scontrol", &["show", "job"]).split("\n\n").filter(|job| job.contains("Restarts=1")).count();
    let before = (runs(folder).len(), put_back());
    let mut watcher = slurm.sweep(folder, PARTS).spawn().unwrap();
    wait_for("some conditions", &mut watcher, || journal_lines(folder).len() > 40);
    let urgent =
        slurm.ask("sbatch", &["--parsable", "--partition=urgent", "--nodes=3", "--exclusive", "--output=/dev/null", "--wrap=sleep 1"]);
    let has_run = || slurm.ask("scontrol", &["show", "job", urgent.trim()]).contains("JobState=COMPLETED");
    wait_for("urgent job", &mut watcher, has_run);
    let restarted = put_back() - before.1;
    let ended = watcher.wait_with_output().unwrap();
    assert!(ended.status.success(), "{}", said(&ended));
    let told: serde_json::Value = serde_json::from_slice(&ended.stdout).unwrap();
    assert_eq!((&told["conditions"], &told["failed"]), (&ROWS.into(), &0.into()), "{told}");
    let lines = journal_lines(folder);
    let rows: std::collections::BTreeSet<&str> = lines.iter().filter_map(|line| line.split('\t').next()).collect();
    assert_eq!((lines.len(), rows.len()), (ROWS, ROWS));
    // What was under way in each task is all that is run again.
    let again = runs(folder).len() - before.0 - ROWS;
    println!("{restarted} tasks preempted, {again} runs made again");
    assert!(restarted > 0 && again <= restarted, "{restarted} tasks preempted, {again} runs made again");
}

/// The disk of one node is full: its parts are run on the others, and no condition is lost or counts as failed.
fn full_disk(slurm: &Slurm, folder: &Path) {
    std::fs::remove_dir_all(folder.join("out")).unwrap();
    std::fs::create_dir(folder.join("local")).unwrap();
    assert!(slurm.here("kill-node", &["1"]).status.success());
    if !slurm.here("start-node", &["1", folder.join("local").to_str().unwrap()]).status.success() {
        println!("skipped: no node can have a small disk here");
        return;
    }
    let begin = Instant::now();
    while !slurm.ask("sinfo", &["-h", "-n", "node1", "-o", "%T"]).starts_with("idle") {
        assert!(begin.elapsed() < Duration::from_secs(60), "node1 does not come back: {}", slurm.ask("sinfo", &["-Nl"]));
        std::thread::sleep(Duration::from_millis(200));
    }
    // Some programs say why and clean up before they end, so that there is room again; others do neither. A third kind cleans up
    // and says nothing: then a neighbour's failure must tell.
    let script = "dd if=/dev/zero of=big bs=1024 count=1000 2> why || {\ncase $x in *[0-3]) cat why >&2; rm big;; *[4-6]) rm big;; esac\nexit 1\n}\nsleep 0.05\necho \"t = $x\"";
    shell(folder, 40, &format!("scratch = '{}'", folder.join("local").display()), script);
    // Every node gets some of as many parts as there are processors.
    let ended = slurm.sweep(folder, 12).output().unwrap();
    assert!(ended.status.success(), "{}", said(&ended));
    let told: serde_json::Value = serde_json::from_slice(&ended.stdout).unwrap();
    assert_eq!((&told["conditions"], &told["failed"]), (&40.into(), &0.into()), "{told}");
    let rounds = told["slurm"]["rounds"].as_array().unwrap();
    assert!(rounds.len() == 2 && rounds[1]["avoided"] == serde_json::json!(["node1"]), "{told}");
    assert!(said(&ended).contains("tasks failed on node1"), "{}", said(&ended));
    let lines = journal_lines(folder);
    let solved: Vec<&str> = lines.iter().filter_map(|line| line.split_once("\tok\t")).map(|(row, _)| row).collect();
    assert_eq!((solved.len(), solved.iter().collect::<std::collections::BTreeSet<_>>().len()), (40, 40));
    println!("{} failures of the full disk were run again", lines.len() - 40);
}

/// Where tasks cannot write, it is told why after three rounds, and goes on once that is mended.
fn stuck(slurm: &Slurm, folder: &Path) {
    std::fs::remove_dir_all(folder.join("out")).unwrap();
    shell(folder, 20, "scratch = 'blocked'", "echo \"t = $x\"");
    std::fs::write(folder.join("blocked"), "a file where a folder should be").unwrap();
    let ended = slurm.sweep(folder, 2).output().unwrap();
    assert_eq!(ended.status.code(), Some(2), "{}", said(&ended));
    let told = said(&ended);
    assert!(told.contains("3 times in a row no task solved anything") && told.contains("cannot make this file"), "{told}");
    std::fs::remove_file(folder.join("blocked")).unwrap();
    let ended = slurm.sweep(folder, 2).output().unwrap();
    assert!(ended.status.success(), "{}", said(&ended));
}
