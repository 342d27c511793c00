//! `--help`, completions and manual pages: every example works, every option has its heading.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};

use super::{coldplate, json, message, root, scratch, status};

/// Words of a command line as a shell would split it; a redirection is left out.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut word, mut quoted) = (Vec::new(), String::new(), false);
    for c in line.split(" > ").next().unwrap().chars() {
        match c {
            '"' => quoted = !quoted,
            ' ' if !quoted => words.extend((!word.is_empty()).then(|| std::mem::take(&mut word))),
            c => word.push(c),
        }
    }
    words.extend((!word.is_empty()).then_some(word));
    words
}

/// Names of all commands, as `--help` lists them in groups.
fn commands() -> Vec<String> {
    let help = String::from_utf8_lossy(&coldplate(&["--help"]).stdout).into_owned();
    let listed = help.split("Options:\n").next().expect("a list of commands");
    let name =
        |line: &str| line.strip_prefix("  ").filter(|l| !l.starts_with(' ')).and_then(|l| l.split_whitespace().next().map(String::from));
    let names: Vec<String> = listed.lines().filter_map(name).collect();
    assert!(names.len() > 20, "{help}");
    names
}

/// The page `coldplate NAME --help`.
fn help_of(name: &str) -> String {
    String::from_utf8_lossy(&coldplate(&[name, "--help"]).stdout).into_owned()
}

/// Lines below `Examples:` of a help page.
fn examples(help: &str) -> Vec<String> {
    help.split("Examples:\n")
        .nth(1)
        .unwrap_or("")
        .lines()
        .map(str::trim)
        .filter(|line| line.starts_with("coldplate "))
        .map(String::from)
        .collect()
}

/// What a service prints before it is told to end.
fn until_it_listens(run: &mut Command) -> Output {
    let mut child = run.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let (mut lines, mut line) = (BufReader::new(child.stdout.take().unwrap()), String::new());
    lines.read_line(&mut line).unwrap();
    assert!(Command::new("kill").arg(child.id().to_string()).status().unwrap().success());
    Output { stdout: line.into_bytes(), ..child.wait_with_output().unwrap() }
}

/// In a folder that looks like the project but for its results; coarse where cells can be said.
#[test]
fn every_example_works() {
    let place = scratch("help");
    std::fs::create_dir_all(place.join("out")).unwrap();
    for name in ["machines", "sweeps", "examples", "data"] {
        std::os::unix::fs::symlink(root().join(name), place.join(name)).unwrap();
    }
    for name in commands() {
        let help = help_of(&name);
        let examples = examples(&help);
        assert!(!examples.is_empty(), "{name} has no example");
        for line in &examples {
            let words = words(line);
            assert_eq!(words[..2], ["coldplate", &name], "{line}");
            let mut run = Command::new(env!("CARGO_BIN_EXE_coldplate"));
            run.args(&words[1..]).current_dir(&place);
            // Other programs make their own meshes, and a surrogate has none.
            if help.contains("--cells ") && !line.contains("solvers") && !line.contains("export out/") {
                run.args(["--cells", "150"]);
            }
            let output = if name == "serve" { until_it_listens(&mut run) } else { run.output().unwrap() };
            assert_eq!(status(&output), 0, "{line}\n{}", message(&output));
            assert!(!output.stdout.is_empty(), "{line}");
        }
    }
}

/// `-h` fits a screen; `--help` says what `-h` leaves out.
#[test]
fn short_help_is_short() {
    let page = |words: &[&str]| String::from_utf8_lossy(&coldplate(words).stdout).into_owned();
    let (short, long) = (page(&["-h"]), page(&["--help"]));
    assert!(short.lines().count() < 60 && short.lines().all(|line| line.chars().count() <= 96), "{short}");
    for text in ["A machine:", "Beside measurements:"] {
        assert!(short.contains(text) && long.contains(text), "{text}: {short}");
    }
    for text in ["Exit status:", "journal of a sweep", "NO_COLOR"] {
        assert!(long.contains(text) && !short.contains(text), "{text}: {long}");
    }
    let (short, long) = (page(&["sweep", "-h"]), page(&["sweep", "--help"]));
    for option in ["--sbatch", "--retry-failed", "--shards"] {
        assert!(long.contains(option) && !short.contains(option), "{option}: {short}");
    }
    assert!(2 * short.len() < long.len(), "{short}");
    // Paragraphs below the first line reach the reader.
    assert!(page(&["simulate", "--help"]).contains("a time in two rows is a step"));
}

#[test]
fn help_has_headings() {
    let solve = help_of("solve");
    for heading in ["Condition:", "Machine:", "Results:", "Program:", "Examples:"] {
        assert!(solve.contains(heading), "{heading}: {solve}");
    }
}

#[test]
fn completions_and_manual_pages_name_every_command() {
    let names = commands();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = String::from_utf8_lossy(&coldplate(&["completions", shell]).stdout).into_owned();
        names.iter().for_each(|name| assert!(script.contains(name.as_str()), "{shell}: {name}"));
        assert!(script.contains("coolant-flow"), "{shell}");
        // Values that an option takes.
        for value in ["fmu3", "openturns", "cold_plate"] {
            assert!(script.contains(value) || shell == "elvish" || shell == "powershell", "{shell}: {value}");
        }
    }
    let folder = scratch("man");
    let made = json(&coldplate(&["man", "--out", folder.to_str().unwrap(), "--json"]));
    assert!(made["files"].as_array().unwrap().len() > names.len());
    for name in &names {
        let page = std::fs::read_to_string(folder.join(format!("coldplate-{name}.1"))).unwrap();
        assert!(page.contains(".TH") && page.contains("Examples:"), "{page}");
    }
    let page = String::from_utf8_lossy(&coldplate(&["man"]).stdout).into_owned();
    assert!(page.contains(".TH coldplate 1") && page.contains("coldplate\\-solve"), "{page}");
    assert!(!Path::new("coldplate.1").exists());
    assert_eq!(status(&coldplate(&["completions", "tcsh"])), 2);
}
