//! `coldplate man`: manual pages.

use std::path::PathBuf;

use clap_mangen::Man;
use serde_json::json;

use super::help;
use super::output::Output;
use coldplate_base::atomic_file;
use coldplate_base::error::{Error, Result};

/// Manual pages
///
/// The page of the program on standard output, or one page for each command as files.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Write coldplate.1 and coldplate-COMMAND.1 for every command into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// The folder cannot be made, or a file in it cannot be written.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let mut command = help::command().disable_help_subcommand(true);
    command.build();
    let page = |command: &clap::Command| -> Result<String> {
        let mut bytes = Vec::new();
        Man::new(command.clone()).render(&mut bytes).map_err(|e| Error::numerics(format!("a manual page cannot be made: {e}")))?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    };
    let Some(folder) = &args.out else {
        let text = page(&command)?;
        out.verbatim(&text, &json!({ "page": text }));
        return Ok(0);
    };
    std::fs::create_dir_all(folder).map_err(|e| Error::file("make", folder, e).at_key("--out"))?;
    let mut files = Vec::new();
    let below = command.get_subcommands().flat_map(|sub| std::iter::once(sub).chain(sub.get_subcommands()));
    for command in std::iter::once(&command).chain(below) {
        let name = command.get_display_name().unwrap_or_else(|| command.get_name());
        let path = folder.join(format!("{name}.1"));
        atomic_file::write(&path, page(command)?.as_bytes())?;
        files.push(path.display().to_string());
    }
    let said: String = files.iter().map(|file| format!("wrote {file}\n")).collect();
    out.report(&said, &json!({ "files": files }));
    Ok(0)
}
