//! Sweeps that go on until they are accurate enough: that what they say is true, and that a killed one goes on.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use coldplate_base::progress::Silent;
use coldplate_explore::sweep::sweep_file::Sweep;
use coldplate_explore::sweep::{ADDED, JOURNAL, SweepOptions};
use coldplate_jobs::adaptive::{self, FinishedSweep};
use coldplate_jobs::figures::TableComparison;
use coldplate_surrogate::fit::file;
use coldplate_tables::Table;

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("adaptive-{name}"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// A sweep of the rig on a few cells.
fn rig(folder: &Path, design: &str) -> PathBuf {
    let machine = Path::new(env!("CARGO_MANIFEST_DIR")).join("machines/rig.toml");
    let text = format!(
        "name = 'rig'\nmachine = {machine:?}\ncells = 300\n[design]\n{design}\n[range]\ncoolant_flow = ['3.0e-5 m3/s', '7.0e-5 m3/s']\n\
         coolant_temperature = ['18 degC', '30 degC']\nmotor_speed = ['250 rpm', '2500 rpm']\n[hold]\nambient_temperature = '22 degC'\n\
         [validation]\nruns = 60\nseed = 5\n"
    );
    let path = folder.join("rig.toml");
    std::fs::write(&path, text).unwrap();
    path
}

fn ran(folder: &Path, design: &str) -> FinishedSweep {
    let sweep = Sweep::open(rig(folder, design), None, &[]).unwrap();
    adaptive::run(&sweep, &folder.join("out"), SweepOptions::default(), &Silent).unwrap()
}

/// Largest error of a fit at the held-out conditions, and the smallest share inside the band of any point.
fn held_out(ran: &FinishedSweep) -> (f64, f64) {
    let fit = ran.fit.as_ref().unwrap();
    let bytes = fit.to_bytes().unwrap();
    let opened = file::open(&bytes).unwrap();
    let mut comparison = TableComparison::default();
    comparison.add(&opened, ran.swept.validation.as_ref().unwrap(), true).unwrap();
    let errors = (0..fit.points.len()).map(|p| comparison.held_out_errors(p, fit.points[p].half_width).unwrap());
    errors.fold((0.0, 1.0), |(largest, share): (f64, f64), e| (largest.max(e.0), share.min(e.2)))
}

#[test]
fn the_accuracy_is_reached_with_few_runs_and_is_true() {
    let folder = folder("reached");
    let accuracy = 0.02;
    let one = ran(&folder, &format!("kind = 'adaptive'\naccuracy = '{accuracy} K'"));
    let found = one.adaptation.as_ref().unwrap();
    let (largest, share) = held_out(&one);
    println!("{}; held out: largest error {largest:.2e} K, {:.0} % inside the band at least", found.sentence(), 100.0 * share);
    found.rounds.iter().for_each(|round| println!("  {}", round.line()));
    assert!(found.reached && found.runs() <= 70, "{}", found.sentence());
    assert!(found.rounds.len() >= 2, "a batch is always predicted before it is solved");
    let last = found.rounds.last().unwrap();
    assert!(last.band <= accuracy && last.predicted.as_ref().unwrap().error <= accuracy);
    assert_eq!(found.rounds[0].runs, 18);
    assert!(found.rounds[0].predicted.is_none());
    // Held out are conditions that had no part in any of it.
    assert!(largest <= accuracy, "{largest}");
    assert!(share >= 0.9, "{share}");
    // Far fewer than what a grid or the usual design of ten times as many takes.
    let table = Table::read(folder.join("out/sweep.csv")).unwrap();
    assert_eq!(table.rows(), found.runs());
    let groups = &table.text("group").unwrap().values;
    assert_eq!(groups.iter().filter(|g| *g == ADDED).count(), found.runs() - 18);
    // A tighter accuracy goes on from what is there.
    let tighter = ran(&folder, &format!("kind = 'adaptive'\naccuracy = '{} K'", accuracy / 4.0));
    assert_eq!(tighter.swept.resumed, one.swept.plan.conditions.len());
    assert!(tighter.adaptation.unwrap().runs() >= found.runs());
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn what_is_not_reached_is_said() {
    let folder = folder("missed");
    let sweep = rig(&folder, "kind = 'adaptive'\naccuracy = '1e-9 K'\nruns = 9\nmax_runs = 14");
    let run = |command: &str, more: &[&str]| {
        let output =
            Command::new(env!("CARGO_BIN_EXE_coldplate")).arg(command).arg(&sweep).arg("--out").arg(folder.join("out")).args(more).output();
        output.unwrap()
    };
    let output = run("sweep", &[]);
    let (text, remarks) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{remarks}");
    for words in ["NOT reached with 14 runs", "9 runs: band", "14 runs: band", "predicted before they were solved"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    assert!(remarks.contains("warning: the accuracy of 0.000000001 K was NOT reached"), "{remarks}");
    let output = run("run", &["--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let adaptive = &json["adaptive"];
    assert_eq!((adaptive["reached"].as_bool(), adaptive["max_runs"].as_u64()), (Some(false), Some(14)));
    let rounds = adaptive["rounds"].as_array().unwrap();
    assert_eq!(rounds.iter().map(|r| r["runs"].as_u64().unwrap()).collect::<Vec<_>>(), [9, 14]);
    assert!(rounds[1]["predicted"]["error_K"].as_f64().unwrap() > 0.0 && rounds[0]["predicted"].is_null());
    assert!(std::fs::read_to_string(folder.join("out/report.html")).unwrap().contains("NOT reached"));
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_killed_run_comes_to_the_same_bytes_with_any_number_of_threads() {
    let folder = folder("killed");
    let sweep = rig(&folder, "kind = 'adaptive'\naccuracy = '0.003 K'\nruns = 10\nmax_runs = 40");
    let command = |out: &str, threads: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_coldplate"));
        command.arg("run").arg(&sweep).arg("--out").arg(folder.join(out)).args(["--threads", threads]);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        command
    };
    assert!(command("whole", "2").status().unwrap().success());
    let lines = |out: &str| {
        let bytes = std::fs::read(folder.join(out).join(JOURNAL)).unwrap_or_default();
        (bytes.iter().filter(|b| **b == b'\n').count(), bytes.windows(7).filter(|w| w == b"\nadded\t").count())
    };
    let (whole, added) = lines("whole");
    assert!(added >= 1, "no round was added");
    let mut kills = 0;
    while lines("killed").0 + 3 < whole {
        let before = lines("killed").0;
        let mut child = command("killed", "1").spawn().unwrap();
        while lines("killed").0 < before + 17 && child.try_wait().unwrap().is_none() {
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        let _ = child.kill();
        child.wait().unwrap();
        kills += 1;
        assert!(kills < 40, "no progress");
    }
    assert!(command("killed", "1").status().unwrap().success());
    assert!(kills >= 3, "{kills}");
    for file in ["sweep.csv", "sweep.parquet", "slopes.csv", "validation.csv", "surrogate.cps"] {
        let read = |out: &str| std::fs::read(folder.join(out).join(file)).unwrap();
        assert!(read("whole") == read("killed"), "{file} differs");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}
