//! `coldplate export`: a surrogate in other languages, a table or a machine for other programs.

use std::path::{Path, PathBuf};

use coldplate_export::{ExportError, Target};
use serde::Serialize;

use super::condition::{ConditionArgs, pair_of};
use super::output::Output;
use coldplate_base::atomic_file;
use coldplate_base::error::{Error, Result};
use coldplate_explore::sweep::MACHINE_HASH;
use coldplate_interchange::calculix::{DeckPoint, InputDeck};
use coldplate_interchange::foreign;
use coldplate_jobs::open;
use coldplate_runtime::Surrogate;
use coldplate_solve::meshed::MeshedMachine;
use coldplate_tables::Table;

/// A form in which another program reads a table.
struct TableForm {
    key: &'static str,
    ending: &'static str,
    write: fn(&Table) -> Result<String>,
}

/// Forms of tables for other programs.
const TABLES: [TableForm; 2] = [
    TableForm { key: "dakota", ending: ".dat", write: foreign::dakota },
    TableForm { key: "openturns", ending: "_openturns.csv", write: foreign::openturns },
];

/// The target of a machine at one condition.
const CALCULIX: &str = "calculix";

/// A surrogate for other languages and programs, with the same answers there
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Surrogate file; for dakota and openturns a table; for calculix a machine file
    #[arg(value_name = "SURROGATE|TABLE|MACHINE")]
    surrogate: PathBuf,
    /// Target: c99 (a source file and a header), fmu2, fmu3 (a functional mock-up unit), html (a page with sliders), json
    /// (everything in the file), modelica (a package), octave (a function), onnx (a model), st (a function block for controllers);
    /// from a table: dakota (a tabular file), openturns (a sample); from a machine: calculix (an input deck at one condition)
    #[arg(long, value_name = "TARGET")]
    to: String,
    /// In single precision, for processors that have no other (c99); reports the loss of accuracy
    #[arg(long)]
    single: bool,
    /// Folder to write into (default: beside the surrogate)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Beginning of the names of files and identifiers (default: the name of the surrogate file)
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Machine file of the surrogate: the page shows it in three dimensions, with temperatures everywhere (html)
    #[arg(long, value_name = "MACHINE")]
    machine: Option<PathBuf>,
    #[command(flatten)]
    condition: ConditionArgs,
    /// Change a value of the machine file (calculix, html), for example contact.motor.conductance="560 W/(m2 K)"
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// About how many cells (calculix, html; default: the machine file's own)
    #[arg(long, value_name = "N")]
    cells: Option<usize>,
}

/// Record of the files written.
#[derive(Debug, Serialize)]
struct Record {
    /// The target.
    target: &'static str,
    /// The files, in the order in which they were written.
    written: Vec<WrittenFile>,
    /// Node of each sensor in an input deck.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    points: Vec<DeckPoint>,
}

/// A file that was written.
#[derive(Debug, Serialize)]
struct WrittenFile {
    /// Path of the file.
    path: PathBuf,
    /// Length in bytes.
    bytes: usize,
    /// Remark on the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    remark: Option<String>,
}

/// Runs the command.
///
/// # Errors
/// Bad input, a target that does not exist, or a file that cannot be written.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    if let Some(form) = TABLES.iter().find(|form| form.key == args.to) {
        surrogate_alone(args)?;
        machine_alone(args)?;
        return table(args, form, out);
    }
    if args.to == CALCULIX {
        surrogate_alone(args)?;
        no_machine(args)?;
        return machine(args, out);
    }
    let target = match (target(&args.to)?, args.single) {
        (Target::C99, true) => Target::C99Single,
        (_, true) => {
            let error = Error::input(format!("'{}' is written in double precision alone", args.to)).at_key("--single");
            return Err(error.help("leave it out, or write --to c99"));
        }
        (target, false) => target,
    };
    let scene_of = args.machine.as_ref().filter(|_| target == Target::Html);
    match scene_of {
        Some(_) => no_condition(args)?,
        None => machine_alone(args)?,
    }
    let file = open(&args.surrogate)?;
    let surrogate = file.surrogate()?;
    let name = args.name();
    let scene = scene_of.map(|path| scene(args, path, &surrogate, out)).transpose()?;
    let written = match &scene {
        Some(scene) => coldplate_export::page(&surrogate, scene, &name),
        None => coldplate_export::export(&surrogate, target, &name),
    };
    let files = written.map_err(|e| {
        let error = Error::input(e.to_string());
        match e {
            ExportError::Name(_) => error.at_key("--name").help("write for example --name surrogate"),
            ExportError::Single(_) => error.in_file(&args.surrogate).at_key("--single").help("leave it out: double precision does"),
            _ => error,
        }
    })?;
    let mut record = Record { target: target.key(), written: Vec::new(), points: Vec::new() };
    for file in files {
        let path = args.folder().join(&file.name);
        atomic_file::write(&path, &file.content)?;
        record.written.push(WrittenFile { path, bytes: file.content.len(), remark: file.remark });
    }
    let line = |file: &WrittenFile| {
        let remark = file.remark.as_ref().map_or(String::new(), |remark| format!(", {remark}"));
        format!("wrote {} ({} bytes){remark}\n", file.path.display(), file.bytes)
    };
    let text: String = record.written.iter().map(line).collect();
    out.report(&text, &record);
    Ok(0)
}

/// The machine of a page in three dimensions, as its JSON.
fn scene(args: &Args, path: &Path, surrogate: &Surrogate<'_>, out: Output) -> Result<String> {
    let sets = args.set.iter().map(|s| pair_of(s, "--set")).collect::<Result<Vec<_>>>()?;
    let machine = open(path)?.machine(&sets)?;
    let is_own = surrogate.provenance().all(|(key, hash)| key != MACHINE_HASH || hash == machine.hash);
    let model = MeshedMachine::new(machine, args.cells)?;
    let mut scene = coldplate_jobs::scene::scene(&model, surrogate, &out.progress()).map_err(|e| e.in_file(path))?;
    if !is_own {
        let note = "The machine file is not the one that the surrogate was made of; names and limits may differ, or more.";
        out.note(&format!("{}: {note}", path.display()));
        scene.notes.push(note.into());
    }
    serde_json::to_string(&scene).map_err(|e| Error::input(format!("the machine cannot be written as JSON: {e}")).in_file(path))
}

/// Writes a table in the form of another program.
fn table(args: &Args, form: &TableForm, out: Output) -> Result<u8> {
    let table = Table::read(&args.surrogate)?;
    let text = (form.write)(&table).map_err(|e| e.in_file(&args.surrogate))?;
    let path = args.folder().join(format!("{}{}", args.file_name()?, form.ending));
    atomic_file::write(&path, text.as_bytes())?;
    let written = vec![WrittenFile { path: path.clone(), bytes: text.len(), remark: None }];
    let record = Record { target: form.key, written, points: Vec::new() };
    out.report(&format!("wrote {} ({} bytes)\n", path.display(), text.len()), &record);
    Ok(0)
}

/// Writes a machine at one condition as an input deck.
fn machine(args: &Args, out: Output) -> Result<u8> {
    let sets = args.set.iter().map(|s| pair_of(s, "--set")).collect::<Result<Vec<_>>>()?;
    let file = open(&args.surrogate)?;
    if std::str::from_utf8(&file.bytes).is_err() {
        return Err(Error::input("this is no machine file")
            .in_file(&args.surrogate)
            .help("an input deck is written of a machine file in TOML"));
    }
    let machine = file.machine(&sets)?;
    let condition = args.condition.condition(&machine)?;
    let model = MeshedMachine::new(machine, args.cells)?;
    let state = model.steady(&condition)?;
    let deck = InputDeck::new(&model, &condition, &state)?;
    let path = args.folder().join(format!("{}.inp", args.file_name()?));
    atomic_file::write(&path, deck.text.as_bytes())?;
    let remark = format!("{} nodes, {} elements", deck.nodes, deck.elements);
    let mut text = format!("wrote {} ({} bytes), {remark}\n", path.display(), deck.text.len());
    for point in &deck.points {
        text += &format!("  node {}: {}\n", point.node, point.sensor);
    }
    let written = vec![WrittenFile { path, bytes: deck.text.len(), remark: Some(remark) }];
    out.report(&text, &Record { target: CALCULIX, written, points: deck.points });
    Ok(0)
}

/// Refuses an option that applies to surrogates only.
fn surrogate_alone(args: &Args) -> Result<()> {
    if !args.single {
        return Ok(());
    }
    Err(Error::input(format!("this option is for surrogates, and '{}' is written of none", args.to))
        .at_key("--single")
        .help("leave it out"))
}

/// Refuses options that apply to machines only.
fn machine_alone(args: &Args) -> Result<()> {
    no_condition(args)?;
    let machine = args.machine.as_ref().map(|_| "--machine");
    let given = machine.or(args.cells.map(|_| "--cells")).or(args.set.first().map(|_| "--set"));
    given.map_or(Ok(()), |option| Err(of_machines(args, option)))
}

/// Refuses a second machine file.
fn no_machine(args: &Args) -> Result<()> {
    let twice = |_| Err(Error::input("an input deck is written of the machine file alone").at_key("--machine").help("leave it out"));
    args.machine.as_ref().map_or(Ok(()), twice)
}

/// Refuses a condition: only an input deck has one.
fn no_condition(args: &Args) -> Result<()> {
    let condition = args.condition.values()?.first().map(|(name, _)| format!("--{}", name.replace('_', "-")));
    condition.map_or(Ok(()), |option| Err(of_machines(args, &option)))
}

fn of_machines(args: &Args, option: &str) -> Error {
    Error::input(format!("this option is for machine files, and '{}' is written of none", args.to))
        .at_key(option)
        .help("leave it out, or write --to calculix of a machine file; --machine, --cells and --set go with --to html too")
}

impl Args {
    /// Beginning of the names of files; it may name no folder, since that is the one of `--out`.
    fn file_name(&self) -> Result<String> {
        let name = self.name();
        if Path::new(&name).file_name().is_some_and(|own| own == name.as_str()) {
            return Ok(name);
        }
        Err(Error::input("this is no name of a file").at_key("--name").read(name).help("state the folder by --out DIR"))
    }

    /// Beginning of the names of files and identifiers.
    fn name(&self) -> String {
        let stem = || self.surrogate.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        self.name.clone().unwrap_or_else(stem)
    }

    /// Folder to write into.
    fn folder(&self) -> &Path {
        self.out.as_deref().or(self.surrogate.parent()).unwrap_or(Path::new(""))
    }
}

fn target(asked: &str) -> Result<Target> {
    if let Some(target) = Target::ALL.into_iter().find(|target| target.key() == asked) {
        return Ok(target);
    }
    let others = TABLES.iter().map(|form| form.key).chain([CALCULIX]);
    let built = Target::ALL.map(Target::key).into_iter().chain(others).collect::<Vec<_>>().join(", ");
    Err(Error::input("there is no such target").at_key("--to").read(asked).help(format!("what is built: {built}")))
}
