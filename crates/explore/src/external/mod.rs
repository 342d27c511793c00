//! Other programs as solvers: a command run in a folder of its own for every condition.
//!
//! ```text
//! condition -> templates, files -> folder -> command -> results (CSV, JSON, a pattern) -> values
//!                     |                                                                     |
//!                     '-------------------- cache: results by content ----------------------'
//! ```

mod cache;
mod failure;
mod keys;
mod licence;
mod process;
mod reading;
mod template;

pub use failure::Class;
pub use reading::ResultReading;
pub use template::TemplateValues;

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use regex::Regex;

use crate::stop;
use cache::{Cache, Key};
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::{DescribedVariable, PointColumn};
use failure::Failure;
use licence::Licence;
use process::Ended;
use template::Template;

/// Time limit for a program that prints its version. Chosen: a program that hangs holds up the sweep for so long.
const VERSION_LIMIT: Duration = Duration::from_secs(60);
/// Longest line of a program's output that a reason repeats, count of characters. Chosen: longer ones fill the tables.
const LONGEST_LINE: usize = 200;
/// Name and version of the format of cached results.
const FORMAT: &str = "coldplate solver 1";
/// Remedy for a full disk.
const ROOM: &str = "make room and start again: results in the journal are kept";

/// Counts the folders of runs of this process.
static RUNS: AtomicUsize = AtomicUsize::new(0);

/// Another program as a solver.
#[derive(Debug, Clone)]
pub struct Program {
    /// Name of the program.
    pub name: String,
    /// SHA-256 of everything that results depend on beside the condition and the program's version, in hexadecimal.
    pub hash: String,
    /// Results that are read after a run.
    pub readings: Vec<ResultReading>,
    /// Runs at once in this process, if the sweep file states it.
    pub at_once: Option<usize>,
    version: Version,
    command: Vec<Template>,
    /// Folder of the sweep file.
    folder: PathBuf,
    /// Templates by their names in the folder of a run.
    templates: Vec<(String, Template)>,
    files: Vec<Carried>,
    variables: Vec<DescribedVariable>,
    limit: Option<Duration>,
    retries: usize,
    not_converged: Option<Regex>,
    licence: Option<Licence>,
    cache: Option<PathBuf>,
    scratch: Option<PathBuf>,
    keep: bool,
}

/// Command that prints a program's version, and the printed line.
#[derive(Debug, Clone)]
struct Version {
    command: Option<Vec<String>>,
    said: Option<String>,
}

/// A file that is copied into the folder of every run.
#[derive(Debug, Clone)]
struct Carried {
    name: String,
    path: PathBuf,
    hash: String,
}

/// Folders in which the runs of one sweep are made and kept.
#[derive(Debug)]
pub(crate) struct Workshop<'a> {
    program: &'a Program,
    /// Folders of runs in progress.
    runs: PathBuf,
    /// Folders of failed runs, and of all runs if the sweep file asks for them.
    kept: PathBuf,
    cache: Cache,
}

impl Program {
    /// Measurement points of the results, as they stand in tables.
    pub fn points(&self) -> Vec<PointColumn> {
        self.readings.iter().map(|reading| reading.point.clone()).collect()
    }

    /// Version of the program: the first line that it prints.
    pub fn version(&self) -> &str {
        self.version.said.as_deref().unwrap_or("not stated")
    }

    /// Name and version.
    pub fn called(&self) -> String {
        format!("{}, version {}", self.name, self.version())
    }

    /// Asks the program for its version, in a folder with the files that every run gets.
    ///
    /// # Errors
    /// The program cannot be run, takes longer than a minute or prints nothing; a file cannot be copied.
    pub(crate) fn ask_version(&mut self) -> Result<()> {
        let Some(command) = &self.version.command else { return Ok(()) };
        let folder = std::env::temp_dir().join(run_name("version"));
        make(&folder)?;
        self.carry(&folder)?;
        let ended = process::run(command, &folder, &self.folder, Some(VERSION_LIMIT), None);
        let first = |name: &str| {
            let text = std::fs::read(folder.join(name)).ok()?;
            line_of(String::from_utf8_lossy(&text).lines())
        };
        // Some programs print their version to the stream of errors and end well; others print it to the stream of output and
        // end with any status.
        let is_well = matches!(&ended, Ok(Ended::Itself(status)) if status.success());
        let said = first(process::STDOUT).or_else(|| first(process::STDERR).filter(|_| is_well));
        remove(&folder);
        let wrong = |what: &str| Error::input(format!("the command for the program's version {what}")).at_key("solver.version");
        match (ended.map_err(|e| Error::input(e.what()).at_key("solver.version").help(e.remedy().unwrap_or_default()))?, said) {
            (Ended::TimedOut, _) => Err(wrong("takes longer than a minute").help("name one that prints it and ends")),
            (Ended::Itself(_), None) => Err(wrong("prints no version").help("name one that prints it")),
            (Ended::Itself(_), Some(said)) => {
                self.version.said = Some(said);
                Ok(())
            }
        }
    }

    /// Copies the files that every run gets.
    fn carry(&self, folder: &Path) -> Result<()> {
        for file in &self.files {
            let path = folder.join(&file.name);
            std::fs::copy(&file.path, &path).map_err(|e| Error::file("write", &path, e))?;
        }
        Ok(())
    }

    /// Workshop for the runs of a sweep with its results in the folder `out`.
    pub(crate) fn workshop(&self, out: &Path) -> Workshop<'_> {
        stop::listen();
        let base = out.join("solver");
        Workshop {
            program: self,
            runs: self.scratch.clone().unwrap_or_else(|| base.clone()).join("runs"),
            kept: base,
            cache: Cache { folder: self.cache.clone().unwrap_or_else(|| cache::default_folder(out)) },
        }
    }
}

/// The inputs of a run.
struct Inputs {
    arguments: Vec<String>,
    texts: Vec<(String, String)>,
    key: Key,
}

impl Workshop<'_> {
    /// Results at a condition, in the order and the units of [`Program::points`].
    ///
    /// # Errors
    /// The run failed: its [`Class`] begins the message. Or files could not be written or the program not be started: such an
    /// error has a source, and is no result of the condition.
    pub fn solve(&self, values: TemplateValues<'_>) -> Result<Vec<f64>> {
        let program = self.program;
        let inputs = self.inputs(values)?;
        if let Some(known) = self.cache.get(&inputs.key, program.readings.len()) {
            return Ok(known);
        }
        let mut tried = 0;
        loop {
            tried += 1;
            match self.attempt(&inputs)? {
                Ok(found) => {
                    let points = program.readings.iter().map(|r| format!("{} [{}]", r.point.name, r.point.unit)).collect();
                    self.cache.put(&inputs.key, &format!("{} {}", program.name, program.version()), points, &found)?;
                    return Ok(found);
                }
                Err(failure) if tried <= program.retries && failure.class.is_worth_a_retry() => {}
                Err(failure) => {
                    let times = if tried > 1 { format!("; tried {tried} times") } else { String::new() };
                    return Err(Error::numerics(format!("{failure}{times}; its files: solver/failed/{}", inputs.key.short())));
                }
            }
        }
    }

    fn inputs(&self, values: TemplateValues<'_>) -> Result<Inputs> {
        let program = self.program;
        let render = |template: &Template| template.render(values, &program.variables);
        let arguments: Vec<String> = program.command.iter().map(render).collect::<Result<_>>()?;
        let rendered = program.templates.iter().map(|(name, template)| Ok((name.clone(), render(template)?)));
        let texts: Vec<(String, String)> = rendered.collect::<Result<_>>()?;
        let fixed = [FORMAT, &program.hash, program.version()].into_iter();
        let key = Key::of(fixed.chain(arguments.iter().map(String::as_str)).chain(texts.iter().map(|(_, text)| text.as_str())));
        Ok(Inputs { arguments, texts, key })
    }

    /// One run in a folder of its own, which no other process uses, whatever became of earlier runs.
    fn attempt(&self, inputs: &Inputs) -> Result<std::result::Result<Vec<f64>, Failure>> {
        let program = self.program;
        let folder = self.runs.join(run_name(inputs.key.short()));
        make(&folder)?;
        for (name, text) in &inputs.texts {
            let path = folder.join(name);
            std::fs::write(&path, text).map_err(|e| Error::file("write", &path, e))?;
        }
        program.carry(&folder)?;
        program.readings.iter().try_for_each(|reading| reading.mark_shipped(&folder))?;
        let token: Option<File> = program.licence.as_ref().map(Licence::take).transpose()?;
        let ended = process::run(&inputs.arguments, &folder, &program.folder, program.limit, token);
        if ended.is_err() {
            remove(&folder);
        }
        let found = self.outcome(ended?, &folder);
        if let Err(Failure { class: Class::Crashed | Class::ResultMissing, .. }) = &found {
            has_room(&folder).inspect_err(|_| remove(&folder))?;
        }
        match (&found, program.keep) {
            (Err(_), _) => keep(&folder, &self.kept.join("failed").join(inputs.key.short())),
            (Ok(_), true) => keep(&folder, &self.kept.join("kept").join(inputs.key.short())),
            (Ok(_), false) => remove(&folder),
        }
        Ok(found)
    }

    fn outcome(&self, ended: Ended, folder: &Path) -> std::result::Result<Vec<f64>, Failure> {
        let program = self.program;
        let status = match ended {
            Ended::TimedOut => {
                let limit = program.limit.unwrap_or_default().as_secs_f64();
                return Err(Failure::new(Class::TimedOut, format!("not done after {limit} s")));
            }
            Ended::Itself(status) => status,
        };
        let (stdout, stderr) = (printed(folder, process::STDOUT), printed(folder, process::STDERR));
        // The pattern is checked before the status: programs without a solution often end with an error status too.
        if let Some(pattern) = &program.not_converged
            && let Some(found) = pattern.find(&stdout).or_else(|| pattern.find(&stderr))
        {
            return Err(Failure::new(Class::DidNotConverge, line_of(found.as_str().lines()).unwrap_or_default()));
        }
        if !status.success() {
            let last = line_of(stderr.lines().rev()).or_else(|| line_of(stdout.lines().rev()));
            let said = last.map_or_else(String::new, |line| format!(", its last line: {line}"));
            return Err(Failure::new(Class::Crashed, format!("{status}{said}")));
        }
        program.readings.iter().map(|reading| reading.value(folder)).collect()
    }
}

/// First line that is not empty, cut to the length that a reason repeats.
fn line_of<'a>(mut lines: impl Iterator<Item = &'a str>) -> Option<String> {
    lines.find(|line| !line.trim().is_empty()).map(|line| line.trim().chars().take(LONGEST_LINE).collect())
}

/// Name of a folder, unique over processes and hosts.
fn run_name(what: &str) -> String {
    let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    format!("{what}-{}-{}-{}", host.trim(), std::process::id(), RUNS.fetch_add(1, Ordering::Relaxed))
}

fn make(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::file("make", folder, e))
}

/// Output of a program to one of its streams.
fn printed(folder: &Path, name: &str) -> String {
    std::fs::read(folder.join(name)).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default()
}

/// Checks that a program could write here: on a full disk the failure is not one of the condition. The program may have
/// reported the full disk itself, and there may be room again since, because neighbouring runs make room when they end.
fn has_room(folder: &Path) -> Result<()> {
    /// Size of the file that is written as a test, bytes. Chosen: larger than a block of usual file systems.
    const PROBE: usize = 64 << 10;
    /// Messages of the C library, as most programs repeat them.
    const FULL: [&str; 2] = ["No space left on device", "Disk quota exceeded"];
    let path = folder.join(".room");
    if let Some(said) = [process::STDERR, process::STDOUT].iter().find_map(|name| {
        let text = printed(folder, name);
        line_of(text.lines().filter(|line| FULL.iter().any(|full| line.contains(full))))
    }) {
        return Err(Error::input(format!("the program had no room: {said}")).in_file(folder).help(ROOM));
    }
    let written = File::create(&path).and_then(|mut file| file.write_all(&vec![0; PROBE]).and_then(|()| file.sync_all()));
    let _ = std::fs::remove_file(&path);
    written.map_err(|e| Error::file("write", &path, e).help(ROOM))
}

/// Removes a folder. A folder that stays behind is a nuisance and no failure.
fn remove(folder: &Path) {
    let _ = std::fs::remove_dir_all(folder);
}

/// Moves the folder of a run to the place where it is kept, replacing an earlier one. If that fails, it stays where it is.
fn keep(folder: &Path, place: &Path) {
    remove(place);
    if let Some(parent) = place.parent() {
        let _ = std::fs::create_dir_all(parent);
    }
    let _ = std::fs::rename(folder, place);
}
