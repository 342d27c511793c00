//! Riddles in measurements that nobody here made, as a table: a machine is identified on data of its healthy state, a number of it is taken
//! away or other data are put before it, and `coldplate diagnose` says what is wrong. The measurements are not part of the project: FOLDER is
//! where they lie. Answers are kept in OUT and taken from there until the program is built anew; OUT/riddles.md is the table.
//!
//!     cargo bench --bench measured -- FOLDER OUT [RIDDLE...]

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use coldplate_base::atomic_file;
use coldplate_base::error::{Error, Result};
use serde_json::Value;

/// Numbers of a machine file that are identified on healthy data before a riddle.
struct Known {
    machine: &'static str,
    healthy: &'static str,
    /// How the runs begin, identified and diagnosed, if not as the program finds out itself.
    start: Option<&'static str>,
    free: &'static [&'static str],
}

/// A riddle: data and a machine that lacks something.
struct Riddle {
    name: &'static str,
    /// Fault that is documented, or was put into the machine file.
    truth: &'static str,
    known: Option<&'static Known>,
    /// The machine, where none is identified.
    machine: &'static str,
    data: &'static str,
    /// Lines that are set in the machine file.
    set: &'static [&'static str],
}

const BOREHOLE: Known = Known {
    machine: "borehole/machine.toml",
    healthy: "borehole/train.csv",
    start: Some("readings"),
    free: &[
        "material.sand.conductivity",
        "contact.tube.total_conductance",
        "contact.wall.total_conductance",
        "node.grout.capacity",
        "node.water.capacity",
    ],
};
const RIG: Known = Known {
    machine: "hydraulic_rig/machine.toml",
    healthy: "hydraulic_rig/healthy.csv",
    start: None,
    free: &["contact.cooler.total_conductance"],
};
const BOX: Known = Known {
    machine: "test_box/machine.toml",
    healthy: "test_box/train.csv",
    start: Some("readings"),
    free: &["node.inside.capacity", "node.wall.capacity", "contact.inner.total_conductance", "contact.outer.total_conductance"],
};

const TUBE: &str = "contact.tube.total_conductance=91 W/K";
const WALL: &str = "contact.wall.total_conductance=140 W/K";

const fn riddle(
    name: &'static str,
    truth: &'static str,
    known: &'static Known,
    data: &'static str,
    set: &'static [&'static str],
) -> Riddle {
    Riddle { name, truth, known: Some(known), machine: known.machine, data, set }
}

const fn as_given(name: &'static str, truth: &'static str, machine: &'static str, data: &'static str) -> Riddle {
    Riddle { name, truth, known: None, machine, data, set: &[] }
}

const RIDDLES: [Riddle; 11] = [
    riddle("borehole", "nothing", &BOREHOLE, "borehole/train.csv", &[]),
    riddle("borehole_tube", "contact of the tube halved", &BOREHOLE, "borehole/train.csv", &[TUBE]),
    riddle("borehole_both", "both contacts halved", &BOREHOLE, "borehole/train.csv", &[TUBE, WALL]),
    riddle(
        "borehole_sand",
        "conductivity of the sand halved",
        &BOREHOLE,
        "borehole/train.csv",
        &["material.sand.conductivity=1.55 W/(m K)"],
    ),
    riddle("rig", "nothing", &RIG, "hydraulic_rig/healthy.csv", &[]),
    riddle("rig_cooler", "cooler near failure: 0.4 times by a plain fit", &RIG, "hydraulic_rig/cooler_failing.csv", &[]),
    riddle("box", "nothing", &BOX, "test_box/train.csv", &[]),
    riddle("box_mass", "mass of the wall 1/29: 1.55e7 J/K less", &BOX, "test_box/train.csv", &["node.wall.capacity=5.54e5 J/K"]),
    riddle("box_loss", "loss twice too large", &BOX, "test_box/train.csv", &["contact.outer.total_conductance=119.5 W/K"]),
    as_given("collector", "loss to the air left out, about 22 W/K", "collector/machine_without_loss.toml", "collector/three_days.csv"),
    as_given("house", "sun through the windows left out", "twin_house/machine_without_sun.toml", "twin_house/two_zones.csv"),
];

fn main() {
    // Cargo adds --bench to the arguments.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match words.as_slice() {
        [folder, out, names @ ..] => table(Path::new(folder), Path::new(out), names),
        _ => Err(Error::input("give 'FOLDER OUT [RIDDLE...]'")),
    };
    if let Err(error) = done {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

fn table(folder: &Path, out: &Path, names: &[&str]) -> Result<()> {
    if let Some(name) = names.iter().find(|name| RIDDLES.iter().all(|riddle| riddle.name != **name)) {
        return Err(Error::input("there is no such riddle").read(*name));
    }
    std::fs::create_dir_all(out).map_err(|error| Error::file("make", out, error))?;
    let mut lines = String::from(
        "| riddle | what is wrong | named | probability | error on conditions kept out, K | s |\n|---|---|---|---:|---:|---:|\n",
    );
    for riddle in RIDDLES.iter().filter(|riddle| names.is_empty() || names.contains(&riddle.name)) {
        let (answer, seconds) = answer(folder, out, riddle)?;
        let line = line(riddle, &answer, seconds);
        println!("{line}");
        lines += &format!("{line}\n");
    }
    atomic_file::write(&out.join("riddles.md"), lines.as_bytes())
}

/// Answer of the program to a riddle, and the time that it took, s. One that is kept counts where it is younger than the program.
fn answer(folder: &Path, out: &Path, riddle: &Riddle) -> Result<(Value, f64)> {
    let kept = out.join(format!("{}.json", riddle.name));
    let written = |path: &Path| std::fs::metadata(path).and_then(|of| of.modified()).ok();
    let is_current = written(&kept) > written(Path::new(env!("CARGO_BIN_EXE_coldplate")));
    let read = || serde_json::from_str::<(Value, f64)>(&std::fs::read_to_string(&kept).ok()?).ok();
    if let Some(known) = is_current.then(read).flatten() {
        return Ok(known);
    }
    let path = |file: &str| folder.join(file).display().to_string();
    let machine = match riddle.known {
        None => path(riddle.machine),
        Some(known) => {
            let of_set = known.machine.split('/').next().unwrap_or(known.machine);
            let identified = out.join(format!("{of_set}_identified.toml"));
            if !identified.exists() {
                let mut words = vec!["identify".into(), path(known.machine), path(known.healthy)];
                words.extend(known.start.iter().flat_map(|start| ["--from".into(), start.to_string()]));
                words.extend(known.free.iter().flat_map(|key| ["--free".into(), key.to_string()]));
                words.extend(["--out".into(), identified.display().to_string()]);
                coldplate(&words)?;
            }
            identified.display().to_string()
        }
    };
    // An extended machine that is there already is not written over.
    let extended = out.join(format!("{}.toml", riddle.name));
    if extended.exists() {
        std::fs::remove_file(&extended).map_err(|error| Error::file("remove", &extended, error))?;
    }
    let mut words = vec!["diagnose".into(), machine, path(riddle.data), "--json".into()];
    let start = riddle.known.and_then(|known| known.start);
    words.extend(start.iter().flat_map(|start| ["--from".into(), start.to_string()]));
    words.extend(riddle.set.iter().flat_map(|line| ["--set".into(), line.to_string()]));
    words.extend(["--out".into(), extended.display().to_string()]);
    let begun = Instant::now();
    let text = coldplate(&words)?;
    let found = (serde_json::from_str(&text).map_err(|error| Error::input(error.to_string()))?, begun.elapsed().as_secs_f64());
    atomic_file::write(&kept, serde_json::to_string(&found).map_err(|error| Error::input(error.to_string()))?.as_bytes())?;
    Ok(found)
}

/// Standard output of the program.
fn coldplate(words: &[String]) -> Result<String> {
    let output = Command::new(env!("CARGO_BIN_EXE_coldplate")).args(words).arg("--quiet").output();
    let output = output.map_err(|error| Error::input(error.to_string()))?;
    if !output.status.success() {
        return Err(Error::input(String::from_utf8_lossy(&output.stderr).trim().to_string()).read(words.join(" ")));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

fn line(riddle: &Riddle, answer: &Value, seconds: f64) -> String {
    let text = |cause: &Value| cause["text"].as_str().unwrap_or_default().to_string();
    let causes: Vec<String> = answer["causes"].as_array().into_iter().flatten().map(text).collect();
    let named = if causes.is_empty() { format!("({})", answer["verdict"].as_str().unwrap_or_default()) } else { causes.join("; ") };
    let probability = answer["certainty"].as_array().into_iter().flatten().find(|part| part["name"] == "kind");
    let probability = probability.and_then(|part| part["probability"].as_f64()).map_or(String::from("-"), |p| format!("{p:.2}"));
    let error = |key: &str| answer["gain"][key].as_f64().map_or(String::from("-"), |k| format!("{k:.3}"));
    format!(
        "| {} | {} | {named} | {probability} | {} → {} | {seconds:.0} |",
        riddle.name,
        riddle.truth,
        error("rmse_before_K"),
        error("rmse_after_K")
    )
}
