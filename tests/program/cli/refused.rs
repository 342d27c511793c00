//! What was swallowed once, and is refused now, with its place and a remedy; and what is asked for, and no more.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("coldplate-refused-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn put(&self, name: &str, text: &str) {
        std::fs::write(self.0.join(name), text).unwrap();
    }

    fn run(&self, words: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_coldplate")).args(words).current_dir(&self.0).output().unwrap()
    }

    /// Runs it, and holds status and standard error against what is expected.
    fn expect(&self, words: &[&str], status: i32, needles: &[&str]) {
        let output = self.run(words);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(status), "{words:?}: {message}");
        for needle in needles {
            assert!(message.contains(needle), "{words:?} lacks '{needle}': {message}");
        }
        assert!(message.len() < 20_000, "{words:?}: {} bytes", message.len());
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn machine(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("machines").join(name).display().to_string()
}

/// A sweep of the slab with more lines at its end.
fn sweep(more: &str) -> String {
    format!(
        "name = \"slab\"\nmachine = {:?}\ncells = 300\n[design]\nkind = \"sobol\"\nruns = 16\n[range]\n\
         coolant_flow = [\"1 L/min\", \"3 L/min\"]\nmotor_speed = [\"500 rpm\", \"2000 rpm\"]\n[hold]\n\
         coolant_temperature = \"20 degC\"\nambient_temperature = \"23 degC\"\n{more}",
        machine("slab.toml")
    )
}

#[test]
fn tables_of_a_sweep_file_have_the_keys_that_are_honoured() {
    let folder = Folder::new("sweep");
    for (more, needles) in [
        ("[fit]\ndegree = 3\n", &["s.toml:14", "fit.degree", "unknown key", "max_degree", "folds", "seed"][..]),
        ("[fit]\nmax_degree = 13\n", &["s.toml:14", "at most 12"]),
        ("[chart]\nfigure = \"slices\"\n", &["s.toml:14", "chart.figure", "charts = ["]),
        ("[report]\ntitle = \"x\"\n", &["s.toml:14", "report.title"]),
        ("[accept]\nmotor = \"40 degC\"\n", &["s.toml:14", "accept.motor", "[limit.NAME]"]),
    ] {
        folder.put("s.toml", &sweep(more));
        folder.expect(&["sweep", "s.toml", "--out", "out"], 2, needles);
        assert!(!folder.0.join("out").exists());
    }
    folder.put("s.toml", &sweep("").replace("\"1 L/min\"", "\"-1 L/min\""));
    folder.expect(&["sweep", "s.toml", "--out", "out"], 2, &["s.toml:8", "coolant_flow", "negative"]);
    folder.put("s.toml", &sweep("").replace("ambient_temperature = \"23 degC\"\n", "").replace("coolant_temperature = \"20 degC\"\n", ""));
    folder.expect(&["sweep", "s.toml", "--out", "out"], 2, &["'coolant_temperature', 'ambient_temperature' have neither"]);

    folder.put("s.toml", &sweep("[fit]\nmax_degree = 1\nfolds = 4\nseed = 3\n[report]\n"));
    let output = folder.run(&["run", "s.toml", "--out", "out", "--json", "--quiet"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let surrogate = coldplate_surrogate::fit::file::decode(&std::fs::read(folder.0.join("out/surrogate.cps")).unwrap()).unwrap();
    for point in &surrogate.points {
        if let coldplate_surrogate::fit::model::PointModel::Polynomial(p) = &point.model {
            assert!(p.terms.iter().all(|t| t.iter().sum::<u8>() <= 1), "{}", point.name);
        }
    }
    let held: Vec<&str> = surrogate.held.iter().map(|h| h.name.as_str()).collect();
    assert_eq!(held, ["coolant_temperature", "ambient_temperature"]);
    let report = std::fs::read_to_string(folder.0.join("out/report.html")).unwrap();
    assert!(report.contains("coolant temperature 20") && report.contains("is for these values alone"));
}

#[test]
fn what_a_surrogate_cannot_hold_shows_before_the_sweep() {
    let folder = Folder::new("long");
    let text = std::fs::read_to_string(machine("slab.toml")).unwrap();
    folder.put("m.toml", &text.replace("[sensor.plate]", &format!("[sensor.{}]", "x".repeat(300))));
    folder.expect(&["check", "m.toml"], 2, &["m.toml:", "255 bytes", "300 bytes", "shorten it"]);
    let sensors: String = (0..300).map(|i| format!("[sensor.s{i}]\npart = \"plate\"\n")).collect();
    folder.put("m.toml", &(text + &sensors));
    folder.put("s.toml", &sweep("").replace(&format!("{:?}", machine("slab.toml")), "\"m.toml\""));
    folder.expect(&["run", "s.toml", "--out", "out"], 2, &["s.toml", "at most 256 points"]);
    assert!(!folder.0.join("out").exists());
    // A sweep alone gives tables, which hold any number; what they cannot become is said first.
    let output = folder.run(&["sweep", "s.toml", "--out", "out", "--cells", "100"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("no surrogate") && said.contains("at most 256 points"), "{said}");
}

#[test]
fn columns_that_name_nothing_are_refused_everywhere() {
    let folder = Folder::new("columns");
    let slab = machine("slab.toml");
    folder.put("s.csv", "time [s],motor_sped [rpm]\n0,1000\n60,2000\n");
    let usual = ["--coolant-flow", "2 L/min", "--coolant-temperature", "20 degC", "--ambient-temperature", "23 degC"];
    let speed = ["--motor-speed", "1000 rpm"];
    folder.expect(
        &[&["simulate", &slab, "s.csv"], &usual[..], &speed].concat(),
        2,
        &["s.csv:1", "'motor_sped' is neither", "did you mean 'motor_speed'"],
    );
    folder.put("d.csv", "test,coolant_flow [L/min],coolant_temperature [degC],ambient_temperature [degC],motor_sped [rpm],block [degC]\na,2,20,23,1000,30\n");
    for command in ["identify", "diagnose", "predict"] {
        let free = if command == "identify" { &["--free", "contact.joint.conductance"][..] } else { &[] };
        folder.expect(&[&[command, &slab, "d.csv"], free].concat(), 2, &["d.csv", "motor_sped", "did you mean 'motor_speed'"]);
    }
    folder.put("s.csv", "time [s],motor_speed [rpm]\n0,1000\n60,2000\n");
    folder.expect(&[&["simulate", &slab, "s.csv", "--out", "x.xlsx"], &usual[..]].concat(), 2, &["x.xlsx", "--out", ".csv or .parquet"]);
    folder.expect(&["identify", &slab, "d.csv", "--free", "contact.joint.conductance", "--starts", "0"], 2, &["--starts", "0"]);
    let rise = std::fs::read_to_string(&slab).unwrap() + "\n[limit.rise]\nsensor = \"block\"\nrise = \"20 degC\"\n";
    folder.put("m.toml", &rise);
    folder.expect(&["check", "m.toml"], 2, &["m.toml:", "limit.rise", "difference in K"]);
}

#[test]
fn only_what_a_machine_uses_is_asked_for_and_all_at_once() {
    let folder = Folder::new("asked");
    folder.expect(&["solve", &machine("slab.toml")], 2, &["'coolant_flow', 'coolant_temperature', 'motor_speed', 'ambient_temperature'"]);
    folder.expect(
        &["sensitivity", &machine("slab.toml"), "--motor-speed", "1 rpm"],
        2,
        &["'coolant_flow', 'coolant_temperature', 'ambient"],
    );
    // Nothing flows, turns or radiates here.
    let block = "name = \"block\"\n[part.block]\nmaterial = \"steel\"\nbox = [\"10 mm\", \"10 mm\", \"50 mm\"]\n[boundary.cold]\n\
                 faces = [\"block.-z\"]\ntemperature = \"20 degC\"\n[source.heat]\nin = [\"block\"]\npower = \"1 W\"\n[sensor.top]\nface = \"block.+z\"\n";
    folder.put("block.toml", block);
    let output = folder.run(&["solve", "block.toml", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    // What a formula names through a definition is used, and so is what is radiated to.
    let defined = block
        .replace("\"1 W\"", "\"loss\"")
        .replace("[source", "[define]\nfriction = \"2 * motor_speed_rpm\"\nloss = \"friction + 1\"\n[source");
    folder.put("block.toml", &defined);
    folder.expect(&["solve", "block.toml"], 2, &["a value for 'motor_speed'"]);
    folder.put("block.toml", &block.replace("[boundary", "surface = { emissivity = 0.5 }\n[boundary"));
    folder.expect(&["solve", "block.toml"], 2, &["a value for 'ambient_temperature'"]);
}

#[test]
fn bounds_and_axes_are_written_alike() {
    let folder = Folder::new("bounds");
    let slab = machine("slab.toml");
    folder.put(
        "d.csv",
        "test,coolant_flow [L/min],coolant_temperature [degC],ambient_temperature [degC],motor_speed [rpm],block [degC],plate [degC]\n\
         a,2,20,23,1000,27.5,21\nb,3,20,23,2000,35,21.5\n",
    );
    for bounds in ["500..5000", "500 W/(m2 K)..5000 W/(m2 K)", "5e2 .. 5000"] {
        let free = format!("contact.joint.conductance={bounds}");
        let output =
            folder.run(&["identify", &slab, "d.csv", "--free", &free, "--brief", "--cells", "300", "--out", "found.toml", "--json"]);
        assert_eq!(output.status.code(), Some(0), "{bounds}: {}", String::from_utf8_lossy(&output.stderr));
        std::fs::remove_file(folder.0.join("found.toml")).unwrap();
    }
    let step = "contact.joint.conductance=500..5000/100";
    folder.expect(&["identify", &slab, "d.csv", "--free", step], 2, &["no steps", "--scan"]);
    let no_step = "contact.joint.conductance=500..5000";
    folder.expect(&["identify", &slab, "d.csv", "--scan", no_step, "--scan", step], 2, &["no axis of a scan"]);
}

#[test]
fn all_conditions_failing_is_a_failure_of_the_numerics() {
    let folder = Folder::new("failing");
    let text = std::fs::read_to_string(machine("slab.toml")).unwrap();
    folder.put("m.toml", &text.replace("0.04 * motor_speed_rpm", "0.04 * sqrt(motor_speed_rpm - 10000)"));
    folder.put("s.toml", &sweep("").replace(&format!("{:?}", machine("slab.toml")), "\"m.toml\""));
    folder.expect(&["sweep", "s.toml", "--out", "out"], 4, &["every condition failed"]);
    folder.expect(&["run", "s.toml", "--out", "out"], 4, &["every condition failed"]);
}

#[test]
fn long_chains_many_threads_and_endless_files_are_bounded() {
    let folder = Folder::new("bounded");
    let text = std::fs::read_to_string(machine("slab.toml")).unwrap();
    let chain: String = (0..5000)
        .rev()
        .map(|i| if i == 0 { "d0 = \"motor_speed_rpm\"\n".into() } else { format!("d{i} = \"d{} + 0.001\"\n", i - 1) })
        .collect();
    folder.put("m.toml", &(text.replace("0.04 * motor_speed_rpm", "0.04 * d4999") + "[define]\n" + &chain));
    let clock = std::time::Instant::now();
    let condition =
        ["--coolant-flow", "2 L/min", "--coolant-temperature", "20 degC", "--motor-speed", "1000 rpm", "--ambient-temperature", "23 degC"];
    let output = folder.run(&[&["solve", "m.toml", "--cells", "300", "--json"], &condition[..]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(clock.elapsed().as_secs() < 60, "{:?}", clock.elapsed());
    for threads in ["20000", "0"] {
        folder.expect(&["check", &machine("slab.toml"), "--threads", threads], 2, &["--threads", "1..=1024"]);
    }
    folder.put("m.toml", &format!("name = \"x\"\nwrong = \"{}\"\n", "y".repeat(1_000_000)));
    folder.expect(&["check", "m.toml"], 2, &["m.toml:2", "wrong"]);
    folder.put("d.csv", &format!("coolant_flow [L/min],x [K]\n1,{}\n", "9".repeat(1_000_000)));
    folder.expect(&["fit", "d.csv"], 2, &["d.csv:2"]);
    if cfg!(target_os = "linux") {
        let slab = machine("slab.toml");
        for words in [
            &["check", "/dev/zero"][..],
            &["fit", "/dev/zero"],
            &["query", "/dev/zero"],
            &["simulate", &slab, "/dev/zero"],
            &["predict", &slab, "/dev/zero"],
            &["run", "/dev/zero"],
        ] {
            folder.expect(words, 2, &["/dev/zero", "more than 256 MiB"]);
        }
    }
}
