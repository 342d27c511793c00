//! `coldplate new`: a machine file to start from.

use std::path::{Path, PathBuf};

use clap::builder::PossibleValuesParser;
use serde_json::json;

use super::output::Output;
use super::text::table;
use coldplate_base::atomic_file;
use coldplate_base::document::Document;
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::Machine;
use coldplate_describe::machine::starters::{STARTERS, starter, sweep};
use coldplate_evidence::command_input::must_be_new;

/// A commented machine file to start from, and a sweep over it
///
/// Both are complete: they check, solve and run as they are.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Name of the machine, or of its file: "motor" makes motor.toml and motor_sweep.toml; nothing is written over
    #[arg(value_name = "NAME", default_value = "machine")]
    name: PathBuf,
    /// Machine to start from; --list says what each shows
    #[arg(long, value_name = "STARTER", default_value = "cold_plate", value_parser = starters())]
    from: String,
    /// Leave the sweep out
    #[arg(long)]
    no_sweep: bool,
    /// List the machines to start from, and write nothing
    #[arg(long)]
    list: bool,
}

/// Names of the starters, for completions.
fn starters() -> PossibleValuesParser {
    PossibleValuesParser::new(STARTERS.iter().map(|starter| starter.name))
}

/// Runs the command.
///
/// # Errors
/// There is no such starter; a file is there already or cannot be written.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    if args.list {
        let rows: Vec<Vec<String>> = STARTERS.iter().map(|s| vec![s.name.to_string(), s.about.to_string()]).collect();
        out.report(&table(&["starter", "what it shows"], &rows), &json!({ "starters": STARTERS }));
        return Ok(0);
    }
    let chosen = starter(&args.from).map_err(|e| e.at_key("--from"))?;
    let path = if args.name.extension().is_some_and(|e| e == "toml") { args.name.clone() } else { with_ending(&args.name, ".toml")? };
    let sweep_path = with_ending(&path.with_extension(""), "_sweep.toml")?;
    if path.to_string_lossy().contains(char::is_control) {
        return Err(Error::input("a line end or tab in a name").at_key("NAME").read(format!("{path:?}")).help("write coldplate new motor"));
    }
    let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let text = chosen.text.replace("FILE", &file).replace("SWEEP", &sweep_path.file_name().unwrap_or_default().to_string_lossy());
    let machine = Machine::from_document(&Document::parse(&text, &path)?)?;
    let mut files = vec![(path, text)];
    if !args.no_sweep {
        files.push((sweep_path, sweep(&machine, &file)?));
    }
    // Both files are written, or none.
    for (path, _) in &files {
        must_be_new(path, "NAME")?;
    }
    for (path, text) in &files {
        atomic_file::write(path, text.as_bytes())?;
    }
    let names: Vec<String> = files.iter().map(|(path, _)| path.display().to_string()).collect();
    let [first, rest @ ..] = names.as_slice() else { return Ok(0) };
    let mut said: String = names.iter().map(|name| format!("wrote {name}\n")).collect();
    said += &format!("\nnow: coldplate check {first}\n     coldplate solve {first}\n");
    rest.iter().for_each(|sweep| said += &format!("     coldplate run {sweep}\n"));
    out.report(&said, &json!({ "starter": chosen.name, "machine": first, "sweep": rest.first() }));
    Ok(0)
}

fn with_ending(path: &Path, ending: &str) -> Result<PathBuf> {
    let Some(name) = path.file_name() else {
        return Err(Error::input("this is no name of a file").at_key("NAME").read(path.display()).help("write coldplate new motor"));
    };
    Ok(path.with_file_name(format!("{}{ending}", name.to_string_lossy())))
}
