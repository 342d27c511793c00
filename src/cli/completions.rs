//! `coldplate completions`: scripts with which a shell completes commands and options.

use clap_complete::Shell;
use serde_json::json;

use super::help;
use super::output::Output;
use coldplate_base::error::Result;

/// Completions of commands, options and values for a shell
///
/// bash: save them where bash-completion looks, such as ~/.local/share/bash-completion/completions/coldplate; zsh: as
/// _coldplate in a folder of $fpath; fish: ~/.config/fish/completions/coldplate.fish.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The shell
    shell: Shell,
}

/// Runs the command.
///
/// # Errors
/// None.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut help::command(), "coldplate", &mut script);
    let script = String::from_utf8_lossy(&script).into_owned();
    out.verbatim(&script, &json!({ "shell": args.shell.to_string(), "script": script }));
    Ok(0)
}
