//! The command line: one file per subcommand; each turns arguments into a library call and reports its result.

mod chart;
mod check;
mod colour;
mod completions;
mod condition;
mod diagnose;
mod draws;
mod export;
mod fit;
mod help;
mod hottest;
mod identify;
mod import;
mod info;
mod interrupt;
mod kinds;
mod man;
mod materials;
mod measured;
mod mesh_options;
mod new;
mod output;
mod predict;
mod query;
mod reduce;
mod roles;
mod run;
mod schema;
mod sensitivity;
mod serve;
mod simulate;
mod solve;
mod sweep;
mod target;
mod text;
mod units;
mod update;
mod window;

use std::process::ExitCode;

use clap::{FromArgMatches, Parser, Subcommand};

use coldplate_base::error::{Error, Result, panic_text};
use output::Output;

/// Temperatures of a water-cooled machine in vacuum: solve, sweep, fit, chart, query.
#[derive(Debug, Parser)]
#[command(name = "coldplate", version, propagate_version = true, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Print one JSON object and nothing else on standard output
    #[arg(long, global = true, help_heading = "Program")]
    json: bool,
    /// No progress and no notes on standard error
    #[arg(long, global = true, help_heading = "Program")]
    quiet: bool,
    /// Progress as lines on standard error, even if that is no terminal
    #[arg(long, global = true, help_heading = "Program", conflicts_with = "quiet")]
    progress: bool,
    /// Worker threads (default: all cores); results do not depend on it
    #[arg(long, global = true, help_heading = "Program", value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

#[derive(Debug, Subcommand)]
enum Command {
    New(new::Args),
    Check(check::Args),
    Solve(solve::Args),
    Simulate(simulate::Args),
    Sensitivity(sensitivity::Args),
    Reduce(reduce::Args),
    Run(run::Args),
    Sweep(sweep::Args),
    Import(import::Args),
    Fit(fit::Args),
    Query(query::Args),
    Chart(chart::Args),
    Serve(serve::Args),
    Export(export::Args),
    Predict(predict::Args),
    Identify(identify::Args),
    Diagnose(diagnose::Args),
    Update(update::Args),
    Info(info::Args),
    Units(units::Args),
    Materials(materials::Args),
    Schema(schema::Args),
    Completions(completions::Args),
    Man(man::Args),
}

/// Runs the program on the process's arguments.
pub fn main() -> ExitCode {
    let matches = help::command().try_get_matches().unwrap_or_else(|error| refused(&error));
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    let out = Output { json: cli.json, quiet: cli.quiet };
    if cli.progress {
        Output::progress_as_lines();
    }
    if let Some(n) = cli.threads {
        // Fails only if a pool exists already, which nothing before this line makes.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(n.into()).build_global();
    }
    // A service answers the requests under way before it ends.
    if !matches!(cli.command, Command::Serve(_)) {
        interrupt::listen(out);
    }
    match whole(|| roles::keep_apart(&matches).and_then(|()| run(&cli.command, out))) {
        Ok(status) => ExitCode::from(status),
        Err(error) => {
            let error = kinds::explained(error, &matches);
            output::say(&format!("error: {error}"));
            ExitCode::from(error.exit_status())
        }
    }
}

/// Runs a command.
fn run(command: &Command, out: Output) -> Result<u8> {
    match command {
        Command::Run(args) => run::run(args, out),
        Command::Check(args) => check::run(args, out),
        Command::Solve(args) => solve::run(args, out),
        Command::Reduce(args) => reduce::run(args, out),
        Command::Sensitivity(args) => sensitivity::run(args, out),
        Command::Simulate(args) => simulate::run(args, out),
        Command::Sweep(args) => sweep::run(args, out),
        Command::Fit(args) => fit::run(args, out),
        Command::Import(args) => import::run(args, out),
        Command::Identify(args) => identify::run(args, out),
        Command::Predict(args) => predict::run(args, out),
        Command::Diagnose(args) => diagnose::run(args, out),
        Command::Chart(args) => chart::run(args, out),
        Command::Query(args) => query::run(args, out),
        Command::Serve(args) => serve::run(args, out),
        Command::Update(args) => update::run(args, out),
        Command::Export(args) => export::run(args, out),
        Command::New(args) => new::run(args, out),
        Command::Units(args) => units::run(args, out),
        Command::Materials(args) => materials::run(args, out),
        Command::Info(args) => info::run(args, out),
        Command::Schema(args) => schema::run(args, out),
        Command::Completions(args) => completions::run(args, out),
        Command::Man(args) => man::run(args, out),
    }
}

/// Does some work, and turns a panic in it into an error: a fault of the program ends with a message and its own status.
fn whole(work: impl FnOnce() -> Result<u8>) -> Result<u8> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let error = Error::numerics(format!("the program broke down: {}", panic_text(&*panic)));
        Err(error.help("files that were written are whole, and a sweep goes on where it stopped; please report this with the input"))
    })
}

/// Ends the program where arguments are refused; variables of a machine's own have no option of their own.
fn refused(error: &clap::Error) -> ! {
    if error.kind() == clap::error::ErrorKind::UnknownArgument {
        let _ = error.print();
        eprintln!("\n  tip: a variable of the machine's own is stated as --at NAME=\"VALUE UNIT\"");
        std::process::exit(error.exit_code());
    }
    error.exit()
}

#[cfg(test)]
mod tests {
    use super::whole;

    #[test]
    fn a_panic_ends_with_a_message_and_status_4() {
        let error = whole(|| panic!("index {} is beyond the end", 7)).unwrap_err();
        assert_eq!(error.exit_status(), 4);
        assert!(error.to_string().contains("index 7 is beyond the end"), "{error}");
        assert_eq!(whole(|| Ok(3)).unwrap(), 3);
    }
}
