//! `coldplate export`: a surrogate in other languages.

use std::path::{Path, PathBuf};

use coldplate_export::{ExportError, Target};
use serde::Serialize;

use super::output::Output;
use crate::error::{Error, Result};
use crate::foundation::atomic_file;
use crate::foundation::input;
use crate::foundation::table::Table;
use crate::surrogate::fit::file;

/// Targets that are named in the documents and not built yet.
const NOT_BUILT: &[&str] = &["calculix"];

/// A form in which another program reads a table.
struct TableForm {
    key: &'static str,
    ending: &'static str,
    write: fn(&Table) -> Result<String>,
}

const TABLES: [TableForm; 2] = [
    TableForm { key: "dakota", ending: ".dat", write: Table::to_dakota },
    TableForm { key: "openturns", ending: "_openturns.csv", write: Table::to_openturns },
];

/// A surrogate for other languages and programs, which answers there as it does here
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Surrogate file; for dakota and openturns a table
    #[arg(value_name = "SURROGATE|TABLE")]
    surrogate: PathBuf,
    /// What to write: c99 (a source file and a header), fmu2, fmu3 (a functional mock-up unit), html (a page with sliders), json
    /// (everything in the file), modelica (a package), octave (a function), onnx (a model), st (a function block for controllers); of a table: dakota (a tabular file), openturns (a
    /// sample)
    #[arg(long, value_name = "TARGET")]
    to: String,
    /// Folder to write into (default: beside the surrogate)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// What files and identifiers begin with (default: the name of the surrogate file)
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
}

/// What was written.
#[derive(Debug, Serialize)]
struct Record {
    /// The target.
    target: &'static str,
    /// The files, in the order in which they were written.
    written: Vec<WrittenFile>,
}

/// A file that was written.
#[derive(Debug, Serialize)]
struct WrittenFile {
    /// Where it is.
    path: PathBuf,
    /// Its length.
    bytes: usize,
    /// What there is to know of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    remark: Option<String>,
}

/// Runs the command.
///
/// # Errors
/// Bad input, a target that does not exist, or a file that cannot be written.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    if let Some(form) = TABLES.iter().find(|form| form.key == args.to) {
        return table(args, form, out);
    }
    let target = target(&args.to)?;
    let bytes = input::read(&args.surrogate)?;
    let surrogate = file::open(&bytes).map_err(|e| e.in_file(&args.surrogate))?;
    let stem = args.surrogate.file_stem().unwrap_or_default().to_string_lossy();
    let name = args.name.as_deref().unwrap_or(&stem);
    let files = coldplate_export::export(&surrogate, target, name).map_err(|e| {
        let error = Error::input(e.to_string());
        if matches!(e, ExportError::Name(_)) { error.at_key("--name").help("write for example --name surrogate") } else { error }
    })?;
    let folder = args.out.as_deref().or(args.surrogate.parent()).unwrap_or(Path::new(""));
    let mut record = Record { target: target.key(), written: Vec::new() };
    for file in files {
        let path = folder.join(&file.name);
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

/// Writes a table in the form of another program.
fn table(args: &Args, form: &TableForm, out: Output) -> Result<u8> {
    let table = Table::read(&args.surrogate)?;
    let text = (form.write)(&table).map_err(|e| e.in_file(&args.surrogate))?;
    let stem = args.surrogate.file_stem().unwrap_or_default().to_string_lossy();
    let folder = args.out.as_deref().or(args.surrogate.parent()).unwrap_or(Path::new(""));
    let path = folder.join(format!("{}{}", args.name.as_deref().unwrap_or(&stem), form.ending));
    atomic_file::write(&path, text.as_bytes())?;
    let written = vec![WrittenFile { path: path.clone(), bytes: text.len(), remark: None }];
    out.report(&format!("wrote {} ({} bytes)\n", path.display(), text.len()), &Record { target: form.key, written });
    Ok(0)
}

fn target(asked: &str) -> Result<Target> {
    if let Some(target) = Target::ALL.into_iter().find(|target| target.key() == asked) {
        return Ok(target);
    }
    let tables = TABLES.iter().map(|form| form.key);
    let built = Target::ALL.map(Target::key).into_iter().chain(tables).collect::<Vec<_>>().join(", ");
    let what = if NOT_BUILT.contains(&asked) { "this target is not built yet" } else { "there is no such target" };
    Err(Error::input(what).at_key("--to").read(asked).help(format!("what is built: {built}")))
}
