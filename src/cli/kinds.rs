//! Kinds of files: the commands that take each, and what to say where a command is given another kind than it takes.

use std::path::{Path, PathBuf};

use clap::ArgMatches;

use super::target::{Made, To};
use coldplate_base::document::Document;
use coldplate_base::error::{Error, Kind};
use coldplate_base::input;
use coldplate_jobs::{DocumentKind, FileKind, open};

/// A kind of file.
#[derive(Debug, PartialEq, Eq)]
pub struct KindOfFile {
    /// Name, with its article.
    pub name: &'static str,
    /// Usual ending of its files.
    pub ending: &'static str,
    /// Content in a few words.
    pub holds: &'static str,
    /// Commands that take it, the most usual first.
    pub commands: &'static [&'static str],
}

const MACHINE: KindOfFile = KindOfFile {
    name: "a machine file",
    ending: ".toml",
    holds: "parts, contacts, channels, sources, sensors, limits",
    commands: &["check", "solve", "simulate", "sensitivity", "reduce", "predict", "identify", "diagnose", "export", "info"],
};
const SWEEP: KindOfFile = KindOfFile {
    name: "a sweep file",
    ending: ".toml",
    holds: "a machine and the conditions to solve",
    commands: &["run", "sweep", "info"],
};
const CHART: KindOfFile = KindOfFile { name: "a chart definition", ending: ".toml", holds: "what a figure shows", commands: &["chart"] };
const SURROGATE: KindOfFile = KindOfFile {
    name: "a surrogate",
    ending: ".cps",
    holds: "functions fitted to a table, with their bands",
    commands: &["query", "serve", "chart", "update", "export", "simulate", "info"],
};
const REDUCED: KindOfFile = KindOfFile {
    name: "a reduced model",
    ending: ".cpr",
    holds: "a machine in few unknowns, with a bound",
    commands: &["solve", "simulate", "sensitivity", "fit", "info"],
};
const JOURNAL: KindOfFile =
    KindOfFile { name: "the journal of a sweep", ending: ".journal", holds: "solved conditions, to go on from", commands: &["info"] };
const TABLE: KindOfFile = KindOfFile {
    name: "a table",
    ending: ".csv, .parquet",
    holds: "conditions and readings, units in the header",
    commands: &["fit", "predict", "identify", "diagnose", "update", "simulate", "import", "info"],
};

/// All kinds, in the order in which they are made.
pub const KINDS: [&KindOfFile; 7] = [&MACHINE, &SWEEP, &TABLE, &SURROGATE, &REDUCED, &CHART, &JOURNAL];

/// Kinds that an argument takes; `COMMAND.argument` where commands differ. Other arguments take files of no kind of ours.
const TAKEN: &[(&str, &[&KindOfFile])] = &[
    ("solve.machine", &[&MACHINE, &REDUCED]),
    ("sensitivity.machine", &[&MACHINE, &REDUCED]),
    ("simulate.machine", &[&MACHINE, &REDUCED, &SURROGATE]),
    ("fit.machine", &[&MACHINE, &SWEEP]),
    ("machine", &[&MACHINE]),
    ("sweep", &[&SWEEP]),
    ("surrogate", &[&SURROGATE]),
    ("surrogates", &[&SURROGATE]),
    ("dynamics", &[&REDUCED]),
    ("table", &[&TABLE]),
    ("data", &[&TABLE]),
    ("schedule", &[&TABLE]),
    ("csv", &[&TABLE]),
    ("slopes", &[&TABLE]),
    ("followed", &[&TABLE]),
];

/// The error of a command; where the file that it is about is of another kind than the argument takes, an error that says
/// so, and which command takes it.
pub fn explained(error: Error, matches: &ArgMatches) -> Error {
    let Some((command, own)) = matches.subcommand().filter(|_| error.kind() == Kind::Input) else { return error };
    let Some(path) = error.location().file.clone() else { return error };
    let arguments = own.ids().map(clap::Id::as_str).filter(|id| {
        let paths = own.try_get_many::<PathBuf>(id).ok().flatten();
        paths.into_iter().flatten().any(|given| *given == path)
    });
    for id in arguments {
        let Some(taken) = taken(command, id, own) else { continue };
        if let Some(kind) = of(&path).filter(|kind| !taken.contains(kind)) {
            let names: Vec<&str> = taken.iter().map(|kind| kind.name).collect();
            let what = format!("this is {}, and `coldplate {command}` takes {} here", kind.name, names.join(" or "));
            let named = if taken == [&SWEEP] && *kind == MACHINE { "; a sweep file names its machine: machine = \"FILE\"" } else { "" };
            return Error::input(what).in_file(path).help(format!("{}{named}", used_by(kind)));
        }
    }
    error
}

/// Commands that take a kind, for a message.
fn used_by(kind: &KindOfFile) -> String {
    let commands: Vec<String> = kind.commands.iter().map(|command| format!("`{command}`")).collect();
    match commands.as_slice() {
        [first @ .., last] if !first.is_empty() => format!("{} and {last} take {}", first.join(", "), kind.name),
        _ => format!("{} takes {}", commands.concat(), kind.name),
    }
}

/// Kinds that an argument takes. An export takes the kind that its target is made of.
fn taken(command: &str, id: &str, arguments: &ArgMatches) -> Option<&'static [&'static KindOfFile]> {
    if (command, id) == ("export", "surrogate") {
        return Some(match arguments.get_one::<To>("to").map(|to| to.made()) {
            Some(Made::Table(..)) => &[&TABLE],
            Some(Made::Machine) => &[&MACHINE],
            Some(Made::Surrogate(_)) | None => &[&SURROGATE],
        });
    }
    let own = format!("{command}.{id}");
    TAKEN.iter().find(|(known, _)| *known == own || *known == id).map(|(_, kinds)| *kinds)
}

/// Kind of a file, if it is one of ours.
fn of(path: &Path) -> Option<&'static KindOfFile> {
    if !path.is_file() {
        return None;
    }
    let file = open(path).ok()?;
    match file.kind {
        FileKind::Surrogate => Some(&SURROGATE),
        FileKind::ReducedModel => Some(&REDUCED),
        FileKind::Journal => Some(&JOURNAL),
        FileKind::Table => Some(&TABLE),
        FileKind::Document => {
            let document = Document::parse(input::utf8(&file.bytes, path).ok()?, path).ok()?;
            DocumentKind::of(&document).map(|kind| match kind {
                DocumentKind::Machine => &MACHINE,
                DocumentKind::Sweep => &SWEEP,
                DocumentKind::Chart => &CHART,
            })
        }
        FileKind::Unknown => None,
    }
}
