//! How long a diagnosis and an identification take, beside what they may take on two cores.
//!
//!     cargo bench --bench evidence_speed -- [threads=N] [program=PATH] [shared=FOLDER] [CASE]...
//!
//! runs the program on files that it makes first (those of CASE alone), and prints for each the goal, the time on the clock, the
//! time of the processor, and what is named; with `program` those of another build. The hot-water pipe and the two heaters are measured and not part of
//! the project: FOLDER (../shared/measured) is where they lie; without it these cases are left out.

mod cases;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use cases::{Readings, condition};
use coldplate_base::atomic_file;
use coldplate_base::document::Document;
use coldplate_base::error::{Error, Result};
use coldplate_base::random::Random;
use coldplate_solve::study::Study;
use coldplate_testing::machines::SMALL;
use coldplate_testing::measured::{hot_water_pipe, two_heaters};

/// What is timed.
struct Case {
    name: &'static str,
    what: &'static str,
    /// Seconds on two cores.
    goal: f64,
    /// The command; none where its files cannot be made.
    command: fn(&Folders) -> Result<Option<Vec<String>>>,
}

const CASES: [Case; 7] = [
    Case { name: "small", what: "diagnose, small machine, 14 steady conditions", goal: 1.0, command: small },
    Case { name: "five_axis", what: "diagnose, five-axis machine, 16 steady conditions", goal: 5.0, command: five_axis },
    Case { name: "five_axis_log", what: "diagnose, five-axis machine, a log of 2852 readings", goal: 60.0, command: five_axis_log },
    Case { name: "year", what: "diagnose, lumped machine, a year of 10^5 rows", goal: 60.0, command: year },
    Case { name: "pipe", what: "identify, hot-water pipe, a log of 274 rows", goal: 10.0, command: hot_water_pipe },
    Case { name: "board", what: "diagnose, two heaters, four days", goal: 10.0, command: two_heaters },
    Case { name: "board_one", what: "identify, two heaters, four days", goal: 10.0, command: two_heaters_found },
];

/// Where files are made, and where measured ones lie.
struct Folders {
    made: PathBuf,
    shared: PathBuf,
}

impl Folders {
    fn measured(&self, name: &str) -> Option<PathBuf> {
        Some(self.shared.join(name)).filter(|folder| folder.is_dir())
    }

    fn path(&self, name: &str) -> String {
        self.made.join(name).display().to_string()
    }

    fn write(&self, name: &str, text: &str) -> Result<String> {
        atomic_file::write(&self.made.join(name), text.as_bytes())?;
        Ok(self.path(name))
    }
}

fn main() {
    if let Err(error) = run() {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

fn run() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let option = |key: &str| arguments.iter().find_map(|a| a.strip_prefix(key).map(String::from));
    let program = option("program=").unwrap_or_else(|| env!("CARGO_BIN_EXE_coldplate").into());
    let threads = option("threads=").unwrap_or_else(|| "2".into());
    let shared = option("shared=").map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/measured"), PathBuf::from);
    let folders = Folders { made: Path::new(env!("CARGO_TARGET_TMPDIR")).join("evidence_speed"), shared };
    std::fs::create_dir_all(&folders.made).map_err(|e| Error::file("make", &folders.made, e))?;
    let named: Vec<&String> = arguments.iter().filter(|a| !a.contains('=')).collect();
    println!("| case | goal, s | clock, s | processor, s | named |\n|---|---:|---:|---:|---|");
    for case in CASES.iter().filter(|case| named.is_empty() || named.iter().any(|name| *name == case.name)) {
        let Some(command) = (case.command)(&folders)? else {
            println!("| {} | {} | no measurements here | | |", case.what, case.goal);
            continue;
        };
        let answer = folders.made.join(format!("{}.json", case.name));
        let file = std::fs::File::create(&answer).map_err(|e| Error::file("write", &answer, e))?;
        let (before, clock) = (processor_of_children(), Instant::now());
        let done = Command::new(&program)
            .args(&command)
            .args(["--threads", &threads, "--json", "--quiet"])
            .stdout(Stdio::from(file))
            .status()
            .map_err(|e| Error::file("start", Path::new(&program), e))?;
        let (clock, used) = (clock.elapsed().as_secs_f64(), processor_of_children() - before);
        let status = if done.success() { "" } else { " (failed)" };
        println!("| {} | {} | {clock:.1}{status} | {used:.1} | {} |", case.what, case.goal, named_in(&answer));
    }
    Ok(())
}

/// What a diagnosis names, rung after rung; its headline where it names nothing; nothing of an identification.
fn named_in(answer: &Path) -> String {
    let text = std::fs::read_to_string(answer).unwrap_or_default();
    let found: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    let causes = found["rungs"].as_array().into_iter().flatten().flat_map(|rung| rung["causes"].as_array().into_iter().flatten());
    let named: Vec<&str> = causes.filter_map(|cause| cause["text"].as_str()).collect();
    if named.is_empty() { found["headline"].as_str().unwrap_or_default().to_string() } else { named.join("; ") }
}

/// Seconds of processor that ended children took, where the system says so.
fn processor_of_children() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = text.rsplit(") ").next().unwrap_or_default();
    let ticks = |place: usize| after_name.split(' ').nth(place).and_then(|t| t.parse::<f64>().ok()).unwrap_or(0.0);
    // User and system time of children, in hundredths of a second.
    (ticks(13) + ticks(14)) / 100.0
}

fn project(file: &str) -> String {
    format!("{}/{file}", env!("CARGO_MANIFEST_DIR"))
}

fn words(words: &[&str]) -> Option<Vec<String>> {
    Some(words.iter().map(|w| (*w).to_string()).collect())
}

/// `diagnose` with its extended machine among the files made.
fn diagnose(folders: &Folders, machine: &str, data: &str, more: &[&str]) -> Option<Vec<String>> {
    let out = format!("{data}.extended.toml");
    let _ = std::fs::remove_file(folders.made.join(&out));
    words(&[&["diagnose", machine, data, "--out", &out], more].concat())
}

/// The motor's contact is half as good.
fn small(folders: &Folders) -> Result<Option<Vec<String>>> {
    let machine = Document::parse(SMALL, "small.toml")?;
    let file = folders.write("small_machine.toml", SMALL)?;
    let study = Study::new(machine.clone(), Some(300))?;
    let mut random = Random::new(5);
    let row = |i: usize| (format!("test {i}"), None, condition(&study, &mut |_| Some(random.unit())));
    let rows = (1..=14).map(row).collect();
    let lines = [("contact.motor.conductance", "\"250 W/(m2 K)\"")];
    let data =
        Readings { machine: &machine, cells: Some(1200), lines: &lines, rows, seed: 6 }.write(Path::new(&folders.path("small.csv")))?;
    Ok(diagnose(folders, &file, &data.display().to_string(), &["--cells", "600"]))
}

/// What varies in the tests of the five-axis machine.
const VARIED: [&str; 6] = ["coolant_flow", "coolant_temperature", "motor_speed", "ambient_temperature", "x1_speed", "z_speed"];
/// What is wrong with it.
const FAULT: (&str, &str) = ("contact.y_motor.conductance", "\"300 W/(m2 K)\"");

fn five_axis(folders: &Folders) -> Result<Option<Vec<String>>> {
    let machine = Document::read(project("machines/five_axis.toml"))?;
    let study = Study::new(machine.clone(), Some(300))?;
    let mut random = Random::new(7);
    let row = |i: usize| {
        let mut share = |name: &str| Some(random.unit()).filter(|_| VARIED.contains(&name));
        (format!("test {i}"), None, condition(&study, &mut share))
    };
    let rows = (1..=16).map(row).collect();
    let data = Readings { machine: &machine, cells: Some(8000), lines: &[FAULT], rows, seed: 8 };
    let data = data.write(Path::new(&folders.path("five_axis.csv")))?;
    Ok(diagnose(folders, &project("machines/five_axis.toml"), &data.display().to_string(), &["--cells", "6000"]))
}

/// Three tests of an hour and a half, of 41 or 42 rows: speeds and flow are stepped.
fn five_axis_log(folders: &Folders) -> Result<Option<Vec<String>>> {
    let machine = Document::read(project("machines/five_axis.toml"))?;
    let study = Study::new(machine.clone(), Some(300))?;
    let mut random = Random::new(9);
    let mut rows = Vec::new();
    for (test, count) in [41, 41, 42].into_iter().enumerate() {
        let mut states = (0..2).map(|_| {
            let mut share = |name: &str| Some(random.unit()).filter(|_| VARIED.contains(&name));
            condition(&study, &mut share)
        });
        let (first, second) = (states.next().unwrap_or_default(), states.next().unwrap_or_default());
        let one = |i: usize| {
            // A time that stands in two rows is a step.
            let (time, state) = if i == 0 { (0.0, &first) } else { (135.0 * (i - 1) as f64, &second) };
            (format!("test {}", test + 1), Some(time), state.clone())
        };
        rows.extend((0..count).map(one));
    }
    let data = Readings { machine: &machine, cells: Some(8000), lines: &[FAULT], rows, seed: 10 };
    let data = data.write(Path::new(&folders.path("five_axis_log.csv")))?;
    Ok(diagnose(folders, &project("machines/five_axis.toml"), &data.display().to_string(), &["--cells", "6000"]))
}

/// A reading every 315 s; the load is set anew every six hours, the hall has its day and its year.
fn year(folders: &Folders) -> Result<Option<Vec<String>>> {
    let file = project("benches/evidence_speed/lumped.toml");
    let machine = Document::read(&file)?;
    let mut random = Random::new(11);
    let day = 86400.0;
    let mut power = 300.0;
    let study = Study::new(machine.clone(), None)?;
    let usual = condition(&study, &mut |_| None);
    let place = |name: &str| study.model.machine.variables.iter().position(|v| v.name == name);
    let (Some(load), Some(room)) = (place("power"), place("ambient_temperature")) else { return Ok(None) };
    let mut row = |i: usize| {
        let time = 315.0 * i as f64;
        let hall = 293.15 - 4.0 * (std::f64::consts::TAU * time / (365.0 * day)).cos() - 3.0 * (std::f64::consts::TAU * time / day).cos();
        if i.is_multiple_of(69) {
            power = 600.0 * random.unit();
        }
        let mut values = usual.clone();
        (values[load], values[room]) = (power, hall);
        ("year".to_string(), Some(time), values)
    };
    let rows = (0..100_000).map(&mut row).collect();
    let lines = [("contact.bearing_housing.total_conductance", "\"3 W/K\"")];
    let data = Readings { machine: &machine, cells: None, lines: &lines, rows, seed: 12 }.write(Path::new(&folders.path("year.csv")))?;
    Ok(diagnose(folders, &file, &data.display().to_string(), &[]))
}

fn hot_water_pipe(folders: &Folders) -> Result<Option<Vec<String>>> {
    let Some(folder) = folders.measured("hot_water_pipe") else { return Ok(None) };
    let data = folders.write("pipe.csv", &hot_water_pipe::table(&folder, &["150801", "151202", "151204_2"])?)?;
    folders.write("pipe.toml", hot_water_pipe::UNCERTAINTY)?;
    let machine = project("machines/hot_water_pipe.toml");
    let free = ["--free", "material.\"carbon steel\".specific_heat", "--free", "boundary.insulation.film"];
    Ok(words(&[&["identify", &machine, &data, "--from", "readings"], free.as_slice()].concat()))
}

/// The table of four days.
fn days(folders: &Folders) -> Result<Option<String>> {
    let Some(folder) = folders.measured("tclab") else { return Ok(None) };
    folders.write("days.toml", &two_heaters::uncertainty(0.35))?;
    Ok(Some(folders.write("days.csv", &two_heaters::table(&folder, &["step_1", "sine5_1", "sine2_1", "sine50_1"])?)?))
}

fn two_heaters(folders: &Folders) -> Result<Option<Vec<String>>> {
    let Some(data) = days(folders)? else { return Ok(None) };
    Ok(diagnose(folders, &project("machines/two_heaters_bare.toml"), &data, &["--from", "readings"]))
}

fn two_heaters_found(folders: &Folders) -> Result<Option<Vec<String>>> {
    let Some(data) = days(folders)? else { return Ok(None) };
    let machine = project("machines/two_heaters_bare.toml");
    let free = ["--free", "node.\"heater 1\".capacity", "--free", "contact.\"heater 1 to air\".total_conductance"];
    Ok(words(&[&["identify", &machine, &data, "--from", "readings"], free.as_slice()].concat()))
}
