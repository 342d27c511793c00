//! Arguments that name files to write: no input of the run may lie there.

use std::path::PathBuf;

use clap::ArgMatches;
use coldplate_base::error::Result;
use coldplate_base::roles;

/// Arguments that name a file or folder to write, in any command.
const OUTPUTS: &[&str] = &["out", "vtu", "chart", "report", "checkpoint"];

/// Notes every file that the arguments name as an output, before any work.
///
/// # Errors
/// One of them is an input too.
pub fn keep_apart(matches: &ArgMatches) -> Result<()> {
    roles::keep_apart();
    let mut level = matches.subcommand();
    while let Some((_, own)) = level {
        for id in OUTPUTS {
            // A command without this argument has none of its files.
            for path in own.try_get_many::<PathBuf>(id).ok().flatten().into_iter().flatten() {
                roles::will_write(path).map_err(|e| e.at_key(format!("--{id}")))?;
            }
        }
        level = own.subcommand();
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Command;
    use clap::builder::ValueParser;

    /// Arguments that name files to read, a file that the command is asked to change, or one that must be new.
    const INPUTS: &[&str] = &[
        "machine",
        "data",
        "schedule",
        "file",
        "name",
        "surrogate",
        "csv",
        "sweep",
        "merge",
        "journals",
        "table",
        "slopes",
        "followed",
        "dynamics",
        "surrogates",
        "token_file",
        "update",
        "sources",
        "results",
        "files",
        "conditions",
        "field",
        "kinds",
        "costs",
    ];

    fn paths(command: &Command, found: &mut Vec<String>) {
        let is_path = |arg: &&clap::Arg| arg.get_value_parser().type_id() == ValueParser::path_buf().type_id();
        found.extend(command.get_arguments().filter(is_path).map(|arg| format!("{} {}", command.get_name(), arg.get_id())));
        command.get_subcommands().for_each(|own| paths(own, found));
    }

    #[test]
    fn every_argument_that_names_a_file_is_an_input_or_an_output() {
        let mut found = Vec::new();
        paths(&super::super::help::command(), &mut found);
        assert!(found.len() > 40, "{found:?}");
        for argument in found {
            let id = argument.split(' ').next_back().unwrap();
            assert!(INPUTS.contains(&id) != OUTPUTS.contains(&id), "{argument}");
        }
    }
}
