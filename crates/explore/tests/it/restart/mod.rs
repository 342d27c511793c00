//! A sweep that was stopped at any moment ends in the same files as one that never was.

mod growing;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use coldplate_base::document::Document;
use coldplate_base::error::{Error, Result};
use coldplate_base::units::Dimension;
use coldplate_describe::machine::{DescribedVariable, ModelError};
use coldplate_explore::sweep::journal::{ConditionOutcome, Header, Journal};
use coldplate_explore::sweep::{JOURNAL, Open, Plan, SolvedBy, SweepDefinition, SweepOptions, SweepSubject, Swept, execute};

/// Names the folder a child process works in.
const CHILD: &str = "COLDPLATE_RESTART_FOLDER";

fn variables() -> [DescribedVariable; 2] {
    let variable = |name: &str, unit: &str, dimension| DescribedVariable {
        name: name.into(),
        unit: unit.into(),
        dimension,
        default: None,
        range: None,
    };
    [variable("coolant_flow", "L/min", Dimension::VOLUME_FLOW), variable("coolant_temperature", "degC", Dimension::TEMPERATURE)]
}

fn plan(runs: usize) -> Plan {
    let text = format!(
        "name = 'restart'\nmachine = 'm.toml'\n[design]\nkind = 'latin_hypercube'\nruns = {runs}\n[range]\n\
         coolant_flow = ['2 L/min', '19 L/min']\ncoolant_temperature = ['18 degC', '24 degC']\n[validation]\nruns = 2\n"
    );
    SweepDefinition::new(Document::parse(&text, "s.toml").unwrap()).unwrap().plan(&variables()).unwrap()
}

fn subject() -> SweepSubject {
    let outputs = [("motor", "degC"), ("plate, \"front\"", "degC")].map(|(n, u)| (n.to_string(), u.to_string())).to_vec();
    SweepSubject {
        machine: "rig".into(),
        hash: "0123456789abcdef".repeat(4),
        by: SolvedBy::Mesh("1000 cells".into()),
        outputs,
        open: nothing_open(),
    }
}

fn nothing_open() -> Open {
    let model_error = ModelError { sensors: vec![0.0; 2], common: 0.0, growth: 0.0, measured: Vec::new(), is_stated: false };
    Open { parameters: Vec::new(), correlations: Vec::new(), model_error }
}

/// Two smooth outputs; conditions in the middle of the flow range fail, some by a panic.
fn solve(si: &[f64]) -> Result<Vec<f64>> {
    let (flow, temperature) = (si[0] * 6e4, si[1] - 273.15);
    if (9.0..11.0).contains(&flow) {
        return Err(Error::numerics("the solver stopped at a residual of 1e-3").help("take more cells, \"many\" more"));
    }
    assert!(!(14.0..15.0).contains(&flow), "broken at {flow}");
    Ok(vec![temperature + 30.0 / flow, temperature - (flow / 7.0).sin() / 3.0])
}

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("coldplate-restart-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn sweep(plan: &Plan, folder: &Path) -> Result<Swept> {
    execute(plan, &subject(), folder, SweepOptions::default(), solve)
}

/// Name and content.
type Files = Vec<(String, Vec<u8>)>;

/// Every file but the journal, whose lines come in the order in which conditions were finished.
fn results(folder: &Path) -> Files {
    let entries = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    let named = entries.map(|p| (p.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(&p).unwrap()));
    let mut files: Vec<_> = named.filter(|(name, _)| name != JOURNAL).collect();
    files.sort();
    files
}

/// A finished sweep: its folder, its results, its journal.
fn finished(name: &str, plan: &Plan) -> (PathBuf, Files, Vec<u8>) {
    let folder = folder(name);
    let swept = sweep(plan, &folder).unwrap();
    assert!(!swept.failures.is_empty() && swept.table.rows() > 3, "{:?}", swept.failures);
    let names = ["failures.csv", "sweep.csv", "sweep.parquet", "validation.csv", "validation.parquet"];
    let results = results(&folder);
    assert_eq!(results.iter().map(|(n, _)| n.as_str()).collect::<Vec<_>>(), names);
    let journal = std::fs::read(folder.join(JOURNAL)).unwrap();
    (folder, results, journal)
}

#[test]
fn a_journal_cut_at_every_byte_leads_to_the_same_files() {
    let plan = plan(8);
    let (folder, expected, journal) = finished("cut", &plan);
    for length in 0..=journal.len() {
        std::fs::remove_dir_all(&folder).unwrap();
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join(JOURNAL), &journal[..length]).unwrap();
        let swept = sweep(&plan, &folder).unwrap_or_else(|e| panic!("cut to {length} bytes: {e}"));
        let whole_lines = journal[..length].iter().filter(|b| **b == b'\n').count();
        assert_eq!(swept.resumed, whole_lines.saturating_sub(1), "cut to {length} bytes");
        assert_eq!(results(&folder), expected, "cut to {length} bytes");
        // What was there is kept, and the whole is sound: a third run finds nothing to do.
        let after = std::fs::read(folder.join(JOURNAL)).unwrap();
        let kept = journal[..length].iter().rposition(|b| *b == b'\n').map_or(0, |at| at + 1);
        assert_eq!(after[..kept], journal[..kept]);
        assert_eq!(after.len(), journal.len());
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_damaged_byte_costs_at_most_its_condition() {
    let plan = plan(8);
    let (folder, expected, journal) = finished("damage", &plan);
    let header = journal.iter().position(|b| *b == b'\n').unwrap();
    for at in 0..journal.len() {
        let mut damaged = journal.clone();
        damaged[at] ^= 0x04;
        std::fs::write(folder.join(JOURNAL), &damaged).unwrap();
        match sweep(&plan, &folder) {
            Ok(swept) => {
                assert!(at > header, "byte {at}");
                assert!(swept.resumed + 2 >= plan.conditions.len(), "byte {at}: {} resumed", swept.resumed);
                assert_eq!(results(&folder), expected, "byte {at}");
            }
            // The first line says whose journal it is: without it nothing may be used or overwritten.
            Err(error) => {
                assert!(at <= header, "byte {at}: {error}");
                assert!(error.location().line == Some(1) && error.remedy().is_some(), "{error}");
                assert_eq!(std::fs::read(folder.join(JOURNAL)).unwrap(), damaged, "byte {at}");
            }
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_journal_of_something_else_is_refused_and_left_alone() {
    let plan8 = plan(8);
    let (folder, _, journal) = finished("foreign", &plan8);
    let mut machine = subject();
    machine.hash = "f".repeat(64);
    let mut mesh = subject();
    mesh.by = SolvedBy::Mesh("2000 cells".into());
    let mut outputs = subject();
    outputs.outputs[0].0 = "reducer".into();
    for (plan, subject, needles) in [
        (&plan8, machine, vec!["machine hash: 0123456789abcdef... then, ffffffffffffffff... now"]),
        (&plan8, mesh, vec!["mesh: 1000 cells then, 2000 cells now"]),
        (&plan8, outputs, vec!["the outputs differ"]),
        (&plan(9), subject(), vec!["design hash", "conditions: 10 then, 11 now"]),
    ] {
        let message = execute(plan, &subject, &folder, SweepOptions::default(), solve).unwrap_err().to_string();
        assert!(needles.iter().all(|n| message.contains(n)) && message.contains("--out"), "{message}");
        assert_eq!(std::fs::read(folder.join(JOURNAL)).unwrap(), journal);
    }
    let text = String::from_utf8(journal.clone()).unwrap();
    let newer = text.replacen("coldplate-journal 1", "coldplate-journal 2", 1);
    let newer = {
        let (first, rest) = newer.split_once('\n').unwrap();
        let payload = first.rsplit_once('\t').unwrap().0;
        format!("{payload}\t{:08x}\n{rest}", crc32(payload.as_bytes()))
    };
    for (other, needle) in [(newer.as_str(), "version 2"), ("my notes\nabout things\n", "not a journal"), ("my notes", "not a journal")] {
        std::fs::write(folder.join(JOURNAL), other).unwrap();
        let message = sweep(&plan8, &folder).unwrap_err().to_string();
        assert!(message.contains(needle), "{message}");
        assert_eq!(std::fs::read_to_string(folder.join(JOURNAL)).unwrap(), other);
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// CRC-32 of IEEE 802.3, bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes
        .iter()
        .fold(!0u32, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 }))
}

#[test]
fn the_number_of_threads_does_not_show() {
    let plan = plan(30);
    let (folder, expected, _) = finished("threads", &plan);
    for threads in [1, 2, 7] {
        std::fs::remove_file(folder.join(JOURNAL)).unwrap();
        execute(&plan, &subject(), &folder, SweepOptions { threads: Some(threads), ..SweepOptions::default() }, solve).unwrap();
        assert_eq!(results(&folder), expected, "{threads} threads");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn failures_are_told_kept_and_run_again_when_asked() {
    let plan = plan(12);
    let (folder, _, _) = finished("failures", &plan);
    let text = std::fs::read_to_string(folder.join("failures.csv")).unwrap();
    assert!(text.contains("the solver stopped at a residual of 1e-3") && text.contains("broken at 14."), "{text}");
    let calls = AtomicUsize::new(0);
    let healed = |si: &[f64]| {
        calls.fetch_add(1, Ordering::Relaxed);
        Ok(vec![si[0], si[1]])
    };
    let failed = execute(&plan, &subject(), &folder, SweepOptions::default(), healed).unwrap().failures.len();
    assert_eq!(calls.load(Ordering::Relaxed), 0);
    let swept = execute(&plan, &subject(), &folder, SweepOptions { retry_failed: true, ..SweepOptions::default() }, healed).unwrap();
    assert_eq!((swept.failures.len(), calls.load(Ordering::Relaxed)), (0, failed));
    assert!(!folder.join("failures.csv").exists());
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn values_that_are_no_numbers_and_total_failure_are_errors() {
    let plan = plan(4);
    let folder = folder("nothing");
    let error = execute(&plan, &subject(), &folder, SweepOptions::default(), |_| Ok(vec![f64::NAN, 1.0])).unwrap_err();
    assert_eq!(error.exit_status(), 4);
    assert!(error.to_string().contains("not finite") && folder.join("failures.csv").exists(), "{error}");
    assert!(!folder.join("sweep.csv").exists());
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn results_of_another_build_are_not_resumed() {
    let (plan, folder) = (plan(4), folder("build"));
    execute(&plan, &subject(), &folder, SweepOptions::default(), solve).unwrap();
    let path = folder.join(JOURNAL);
    let text = std::fs::read_to_string(&path).unwrap();
    let (first, rest) = text.split_once('\n').unwrap();
    let payload = first.rsplit_once('\t').unwrap().0.replace(&coldplate_explore::numerics(), "0123456789abcdef");
    std::fs::write(&path, format!("{payload}\t{:08x}\n{rest}", crc32fast::hash(payload.as_bytes()))).unwrap();
    let message = execute(&plan, &subject(), &folder, SweepOptions::default(), solve).unwrap_err().to_string();
    assert!(message.contains("numerics of the program: 0123456789abcdef then") && message.contains("--out"), "{message}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn two_processes_cannot_write_one_journal() {
    let folder = folder("lock");
    let header = Header { identity: vec![("program".into(), "x".into())], outputs: vec!["a [K]".into()], conditions: 3 };
    let path = folder.join(JOURNAL);
    let mut first = Journal::open(&path, &header).unwrap();
    first.append(1, ConditionOutcome::Values(vec![0.1 + 0.2])).unwrap();
    let message = Journal::open(&path, &header).unwrap_err().to_string();
    assert!(message.contains("another process") && message.contains("--out"), "{message}");
    drop(first);
    let again = Journal::open(&path, &header).unwrap();
    assert_eq!(again.outcomes(), [None, Some(ConditionOutcome::Values(vec![0.1 + 0.2])), None]);
    drop(again);
    std::fs::remove_dir_all(&folder).unwrap();
}

/// What the killed children run; on its own it does nothing.
#[test]
fn child() {
    let Some(folder) = std::env::var_os(CHILD) else { return };
    let slow = |si: &[f64]| {
        std::thread::sleep(Duration::from_millis(5));
        solve(si)
    };
    match execute(&plan(60), &subject(), Path::new(&folder), SweepOptions { threads: Some(2), ..SweepOptions::default() }, slow) {
        Ok(_) => println!("child finished"),
        Err(error) => println!("child stopped: {error}"),
    }
}

fn child_command(folder: &Path, shell: Option<&str>) -> Command {
    let exe = std::env::current_exe().unwrap();
    let mut command = match shell {
        None => Command::new(exe),
        Some(script) => {
            let mut command = Command::new("sh");
            command.args(["-c", script]).arg(exe);
            command
        }
    };
    command.args(["restart::child", "--exact", "--nocapture"]).env(CHILD, folder).stdout(Stdio::piped()).stderr(Stdio::null());
    command
}

fn lines_of(path: &Path) -> usize {
    std::fs::read(path).unwrap_or_default().iter().filter(|b| **b == b'\n').count()
}

#[test]
fn a_killed_process_is_resumed_by_the_next() {
    let plan = plan(60);
    let (reference, expected, _) = finished("unkilled", &plan);
    let folder = folder("killed");
    let journal = folder.join(JOURNAL);
    let mut kills = 0;
    while lines_of(&journal) < 45 {
        let before = lines_of(&journal);
        let mut child = child_command(&folder, None).spawn().unwrap();
        // Let it record a few conditions, then end it without warning.
        while lines_of(&journal) < before + 5 && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        child.kill().unwrap();
        let status = child.wait().unwrap();
        assert!(!status.success(), "the child ended by itself");
        kills += 1;
        assert!(lines_of(&journal) > before, "nothing was recorded");
    }
    assert!(kills >= 3 && results(&folder).is_empty(), "{kills} kills");
    let held = lines_of(&journal) - 1;
    let calls = AtomicUsize::new(0);
    let counted = |si: &[f64]| {
        calls.fetch_add(1, Ordering::Relaxed);
        solve(si)
    };
    let swept = execute(&plan, &subject(), &folder, SweepOptions::default(), counted).unwrap();
    assert_eq!((swept.resumed, calls.load(Ordering::Relaxed)), (held, plan.conditions.len() - held));
    assert_eq!(results(&folder), expected);
    for folder in [folder, reference] {
        std::fs::remove_dir_all(&folder).unwrap();
    }
}

/// A limit on the size of files stands for a full disk: a write then fails half way through a line.
#[cfg(unix)]
#[test]
fn a_full_disk_stops_the_sweep_and_loses_nothing() {
    let plan = plan(60);
    let (reference, expected, _) = finished("roomy", &plan);
    let folder = folder("full");
    let output = child_command(&folder, Some("trap '' XFSZ; ulimit -f 4; exec \"$0\" \"$@\"")).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("child stopped") && said.contains("cannot write") && said.contains("make room"), "{said}");
    assert!(results(&folder).is_empty());
    let swept = sweep(&plan, &folder).unwrap();
    assert!(swept.resumed > 0 && swept.resumed < plan.conditions.len(), "{}", swept.resumed);
    assert_eq!(results(&folder), expected);
    for folder in [folder, reference] {
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
