//! The command line: one file per subcommand; each turns arguments into a library call and reports its result.

mod chart;
mod check;
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
mod text;
mod units;
mod update;

use std::process::ExitCode;

use clap::{FromArgMatches, Parser, Subcommand};

use coldplate_base::error::{Error, Result, panic_text};
use output::Output;

/// Temperatures of a water-cooled machine in vacuum: solve, sweep, fit, chart, query.
#[derive(Debug, Parser)]
#[command(name = "coldplate", version, propagate_version = true, arg_required_else_help = true)]
#[command(
    after_help = "Exit status: 0 done (query: acceptable); 1 query: not acceptable; 2 bad input; 3 query: uncertain; 4 the numerics failed."
)]
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
    /// Everything: sweep, fit, charts, surrogate, report
    Run(run::Args),
    /// Inventory of a machine file: parts, contacts with true areas and hA, channels, sources; warnings
    Check(check::Args),
    /// Steady temperatures at one condition
    Solve(solve::Args),
    /// A reduced model: any condition of the ranges in milliseconds, with a bound on every reading
    Reduce(reduce::Args),
    /// Derivatives of readings with respect to conditions and numbers of the machine file
    Sensitivity(sensitivity::Args),
    /// Temperatures over time, through a schedule of conditions
    Simulate(simulate::Args),
    /// Design of experiments: run every condition of a sweep file, or as many as its accuracy needs, resuming what is there
    Sweep(sweep::Args),
    /// A surrogate from any table of conditions and outputs
    Fit(fit::Args),
    /// Results of a study in another program as a table with units
    Import(import::Args),
    /// Parameters of a machine file from measured data
    Identify(identify::Args),
    /// A machine beside measured data: prediction, residual, RMSE per test and sensor
    Predict(predict::Args),
    /// Errors of the simulation against measured data, their causes, and how much better the machine gets without
    /// them
    Diagnose(diagnose::Args),
    /// Figures: from chart definitions, a surrogate file, or a folder of results
    Chart(chart::Args),
    /// Temperatures, verdict and margins from a surrogate file
    Query(query::Args),
    /// Answers over HTTP: surrogates for other programs, and as pages
    Serve(serve::Args),
    /// New readings into the parameters of a surrogate file
    Update(update::Args),
    /// A surrogate as source text in another language
    Export(export::Args),
    /// A commented machine file to start from, and a sweep over it
    New(new::Args),
    /// Units that values may carry
    Units(units::Args),
    /// Materials and liquids that machine files may name
    Materials(materials::Args),
    /// Content of a file: a surrogate, a machine, a sweep, its journal, or a table
    Info(info::Args),
    /// JSON Schema of machine files, for editors
    Schema(schema::Args),
    /// Completions for a shell
    Completions(completions::Args),
    /// Manual pages
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
            eprintln!("error: {error}");
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
