//! `coldplate export`: a surrogate in other languages, a table or a machine for other programs.

use std::path::{Path, PathBuf};

use coldplate_export::{Beside, ExportError, Target};
use serde::Serialize;

use super::condition::{ConditionArgs, pair_of};
use super::output::Output;
use super::target::{Made, To};
use coldplate_base::atomic_file;
use coldplate_base::error::{Error, Result};
use coldplate_interchange::calculix::{DeckPoint, InputDeck};
use coldplate_jobs::followed::followed;
use coldplate_jobs::open;
use coldplate_jobs::scene::{self, Glb, SceneFiles};
use coldplate_runtime::Surrogate;
use coldplate_solve::meshed::MeshedMachine;
use coldplate_tables::Table;

/// A surrogate as source text in another language
///
/// The answers there are the same; or a table or a machine in the form of another program.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Surrogate, table or machine, whichever the target is made of
    #[arg(value_name = "SURROGATE|TABLE|MACHINE")]
    surrogate: PathBuf,
    /// Target
    #[arg(long, value_name = "TARGET")]
    to: To,
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
    /// Reduced model of that machine (`coldplate reduce --field`), which gives the temperatures in place of full solutions; made
    /// with --histories too, it shows them over time (html)
    #[arg(long, value_name = "MODEL")]
    field: Option<PathBuf>,
    #[command(flatten)]
    condition: ConditionArgs,
    /// Change a value of the machine file (calculix, glb, html), for example contact.motor.conductance="560 W/(m2 K)"
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// About how many cells (calculix, glb, html; default: the machine file's own)
    #[arg(long, value_name = "N")]
    cells: Option<usize>,
}

/// Record of the files written.
#[derive(Debug, Serialize)]
struct Record {
    /// The target.
    target: String,
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
    let target = match args.to.made() {
        Made::Table(write, ending) => {
            surrogate_alone(args)?;
            machine_alone(args)?;
            return table(args, write, ending, out);
        }
        Made::Machine => {
            surrogate_alone(args)?;
            no_machine(args)?;
            return machine(args, out);
        }
        Made::Surrogate(Target::C99) if args.single => Target::C99Single,
        Made::Surrogate(_) if args.single => {
            let error = Error::input(format!("'{}' is written in double precision alone", args.to)).at_key("--single");
            return Err(error.help("leave it out, or write --to c99"));
        }
        Made::Surrogate(target) => target,
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
    let written = if target == Target::Html {
        let followed = followed(&file.bytes)?;
        coldplate_export::page(&surrogate, &Beside { scene: scene.as_deref(), followed: followed.as_deref() }, &name)
    } else {
        coldplate_export::export(&surrogate, target, &name)
    };
    let files = written.map_err(|e| {
        let error = Error::input(e.to_string());
        match e {
            ExportError::Name(_) => error.at_key("--name").help("write for example --name surrogate"),
            ExportError::Single(_) => error.in_file(&args.surrogate).at_key("--single").help("leave it out: double precision does"),
            _ => error,
        }
    })?;
    let mut record = Record { target: args.to.to_string(), written: Vec::new(), points: Vec::new() };
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
fn scene(args: &Args, machine: &Path, surrogate: &Surrogate<'_>, out: Output) -> Result<String> {
    let sets = args.set.iter().map(|s| pair_of(s, "--set")).collect::<Result<Vec<_>>>()?;
    let files = SceneFiles { machine, sets: &sets, reduced: args.field.as_deref(), cells: args.cells };
    let scene = scene::scene(&files, surrogate, &out.progress())?;
    scene.notes.iter().for_each(|note| out.note(&format!("{}: {note}", machine.display())));
    serde_json::to_string(&scene).map_err(|e| Error::input(format!("the machine cannot be written as JSON: {e}")).in_file(machine))
}

/// Writes a table in the form of another program.
fn table(args: &Args, write: fn(&Table) -> Result<String>, ending: &str, out: Output) -> Result<u8> {
    let table = Table::read(&args.surrogate)?;
    let text = write(&table).map_err(|e| e.in_file(&args.surrogate))?;
    let path = args.folder().join(format!("{}{}", args.file_name()?, ending));
    atomic_file::write(&path, text.as_bytes())?;
    let written = vec![WrittenFile { path: path.clone(), bytes: text.len(), remark: None }];
    let record = Record { target: args.to.to_string(), written, points: Vec::new() };
    out.report(&format!("wrote {} ({} bytes)\n", path.display(), text.len()), &record);
    Ok(0)
}

/// Writes a machine at one condition.
fn machine(args: &Args, out: Output) -> Result<u8> {
    let sets = args.set.iter().map(|s| pair_of(s, "--set")).collect::<Result<Vec<_>>>()?;
    let file = open(&args.surrogate)?;
    let machine = file.machine(&sets)?;
    let condition = args.condition.condition(&machine)?;
    let model = MeshedMachine::new(machine, args.cells)?;
    let state = model.steady(&condition)?;
    if args.to == To::Glb {
        let glb = Glb::new(&model, &condition, &state).map_err(|e| e.in_file(&args.surrogate))?;
        let [low, high] = glb.range;
        let remark = format!("{} parts, {} triangles, {low:.2} to {high:.2} degC", glb.parts, glb.triangles);
        return write_of_machine(args, out, "glb", &glb.bytes, &remark, Vec::new());
    }
    let deck = InputDeck::new(&model, &condition, &state)?;
    let remark = format!("{} nodes, {} elements", deck.nodes, deck.elements);
    write_of_machine(args, out, "inp", deck.text.as_bytes(), &remark, deck.points)
}

/// Writes the file of a machine, and says so.
fn write_of_machine(args: &Args, out: Output, ending: &str, content: &[u8], remark: &str, points: Vec<DeckPoint>) -> Result<u8> {
    let path = args.folder().join(format!("{}.{ending}", args.file_name()?));
    atomic_file::write(&path, content)?;
    let mut text = format!("wrote {} ({} bytes), {remark}\n", path.display(), content.len());
    for point in &points {
        text += &format!("  node {}: {}\n", point.node, point.sensor);
    }
    let written = vec![WrittenFile { path, bytes: content.len(), remark: Some(remark.into()) }];
    out.report(&text, &Record { target: args.to.to_string(), written, points });
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
    no_field(args)?;
    let machine = args.machine.as_ref().map(|_| "--machine");
    let given = machine.or(args.cells.map(|_| "--cells")).or(args.set.first().map(|_| "--set"));
    given.map_or(Ok(()), |option| Err(of_machines(args, option)))
}

/// Refuses the field of a machine that is not shown.
fn no_field(args: &Args) -> Result<()> {
    let alone = || Error::input("a field is shown on a machine, in a page").at_key("--field");
    args.field.as_ref().map_or(Ok(()), |_| Err(alone().help("write --to html, and name the machine file: --machine MACHINE")))
}

/// Refuses a second machine file.
fn no_machine(args: &Args) -> Result<()> {
    no_field(args)?;
    let twice =
        |_| Err(Error::input(format!("'{}' is written of the machine file alone", args.to)).at_key("--machine").help("leave it out"));
    args.machine.as_ref().map_or(Ok(()), twice)
}

/// Refuses a condition: only what is written of a machine has one.
fn no_condition(args: &Args) -> Result<()> {
    let condition = args.condition.values()?.first().map(|(name, _)| format!("--{}", name.replace('_', "-")));
    condition.map_or(Ok(()), |option| Err(of_machines(args, &option)))
}

fn of_machines(args: &Args, option: &str) -> Error {
    Error::input(format!("this option is for machine files, and '{}' is written of none", args.to))
        .at_key(option)
        .help("leave it out, or write --to calculix or glb of a machine file; --machine, --cells and --set go with --to html too")
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
