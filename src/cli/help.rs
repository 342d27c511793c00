//! Parts of `--help`, completions and manual pages beside the options themselves: groups of commands, examples, and
//! headings of groups of options. `-h` is short: options of daily use, a line each; `--help` says everything.

use clap::builder::styling::Styles;
use clap::{Arg, Command, CommandFactory};

use super::kinds::KINDS;
use coldplate_base::condition::{AMBIENT_TEMPERATURE, COOLANT_FLOW, COOLANT_TEMPERATURE, MOTOR_SPEED};

/// Commands by what one wants to do, in the order of the work.
const GROUPS: &[(&str, &[&str])] = &[
    ("A machine", &["new", "check", "solve", "simulate", "sensitivity", "reduce"]),
    ("Many conditions, and a surrogate of them", &["run", "sweep", "import", "fit"]),
    ("Answers", &["query", "chart", "serve", "export"]),
    ("Beside measurements", &["predict", "identify", "diagnose", "update"]),
    ("To look up, and to set up", &["info", "units", "materials", "schema", "completions", "man"]),
];

/// Statuses with which every command ends.
const STATUSES: &[(&str, &str)] = &[
    ("0", "done (query: acceptable)"),
    ("1", "query: not acceptable"),
    ("2", "bad input, with file, line, key and remedy"),
    ("3", "query: uncertain"),
    ("4", "the numerics failed"),
];

/// Variables of the environment that the program heeds.
const ENVIRONMENT: &[(&str, &str)] = &[
    ("COLUMNS", "width of tables and paragraphs (default: that of the terminal; 120 for tables where there is none)"),
    ("NO_COLOR", "no colours on a terminal"),
];

/// Headings of options that `-h` leaves out: they are rarely needed.
const RARE: &[&str] = &["Search", "Service", "Going on", "Parts"];

/// Most characters of an option's line in `-h`, beyond which the line ends at its first remark. Chosen: a line beside the
/// longest option.
const SHORT: usize = 60;

/// Commands as a user would type them in the project's folder; each is tried by a test, in the order of the groups.
pub const EXAMPLES: &[(&str, &[&str])] = &[
    ("run", &["coldplate run examples/tutorial/sweep.toml --out out/tutorial"]),
    ("check", &["coldplate check examples/tutorial/machine.toml", "coldplate check examples/tutorial/machine.toml --rise \"1 K\""]),
    ("reduce", &["coldplate reduce examples/tutorial/machine.toml --out out/model.cpr"]),
    (
        "solve",
        &[
            "coldplate solve examples/tutorial/machine.toml --motor-speed \"2500 rpm\"",
            "coldplate solve examples/tutorial/machine.toml --set contact.motor_foot.conductance=\"400 W/(m2 K)\" --vtu out/field.vtu",
        ],
    ),
    ("sensitivity", &["coldplate sensitivity examples/tutorial/machine.toml --sensor motor --top 5"]),
    (
        "simulate",
        &["coldplate simulate examples/tutorial/machine.toml examples/tutorial/warm_up.csv --within \"0.5 K\" --chart out/warm_up.svg"],
    ),
    (
        "sweep",
        &[
            "coldplate sweep examples/tutorial/sweep.toml --out out/design",
            "coldplate sweep examples/solvers/python/sweep.toml --out out/python",
            "coldplate sweep examples/tutorial/sweep.toml --shards 4",
        ],
    ),
    ("fit", &["coldplate fit out/design/sweep.csv --machine examples/tutorial/machine.toml --out out/design.cps"]),
    (
        "query",
        &[
            "coldplate query out/tutorial/surrogate.cps --coolant-flow \"4 L/min\" --coolant-temperature \"20 degC\" \
             --motor-speed \"2000 rpm\" --ambient-temperature \"22 degC\"",
            "coldplate query out/tutorial/surrogate.cps --free coolant_flow --coolant-temperature \"20 degC\" \
             --motor-speed \"2000 rpm\" --ambient-temperature \"22 degC\"",
            "coldplate query out/tutorial/surrogate.cps --minimise coolant_flow_L_min^3 --motor-speed \"2000 rpm\" \
             --ambient-temperature \"22 degC\"",
            "coldplate query out/tutorial/surrogate.cps --indices",
        ],
    ),
    ("chart", &["coldplate chart out/tutorial/surrogate.cps --out out/figures"]),
    ("info", &["coldplate info out/tutorial/surrogate.cps", "coldplate info examples/tutorial/machine.toml"]),
    ("predict", &["coldplate predict examples/tutorial/machine.toml examples/tutorial/readings.csv"]),
    (
        "identify",
        &["coldplate identify examples/tutorial/machine.toml examples/tutorial/readings.csv \
           --free contact.motor_foot.conductance --out out/identified.toml"],
    ),
    (
        "diagnose",
        &[
            "coldplate diagnose --plan examples/tutorial/machine.toml examples/tutorial/readings.csv",
            "coldplate diagnose examples/tutorial/machine.toml examples/tutorial/readings.csv --out out/extended.toml \
             --report out/diagnosis.html",
        ],
    ),
    ("update", &["coldplate update out/tutorial/surrogate.cps examples/tutorial/readings.csv --out out/updated.cps --anyway"]),
    (
        "export",
        &[
            "coldplate export out/tutorial/surrogate.cps --to c99 --out out/embed --name cooling",
            "coldplate export out/tutorial/surrogate.cps --to c99 --single --out out/embed --name cooling_single",
            "coldplate export machines/rig.toml --to calculix --motor-speed \"2500 rpm\" --out out/deck",
            "coldplate export machines/rig.toml --to glb --motor-speed \"2500 rpm\" --out out/model",
        ],
    ),
    (
        "import",
        &[
            "coldplate import examples/solvers/studies/comsol.csv --input heat --input v_in --unit motor=degC --out out/study.csv",
            "coldplate import examples/solvers/studies/dakota.dat --unit x1=W --unit x2=L/min --unit response_fn_1=degC \
             --input x1 --input x2 --out out/dakota.csv",
            "coldplate import examples/solvers/studies/vtu --names \"plate_{{coolant_flow:L/min}}_{{heat:W}}.vtu\" \
             --point \"top=T @ 250 mm, 100 mm, 100 mm\" --unit T=K --unit top=degC --out out/plate.csv",
        ],
    ),
    ("serve", &["coldplate serve out/tutorial/surrogate.cps --listen 127.0.0.1:0"]),
    ("new", &["coldplate new --list", "coldplate new out/press --from spindle"]),
    ("units", &["coldplate units", "coldplate units pressure"]),
    ("materials", &["coldplate materials", "coldplate materials steel"]),
    ("schema", &["coldplate schema > out/machine.schema.json"]),
    ("completions", &["coldplate completions bash > out/coldplate.bash"]),
    ("man", &["coldplate man --out out/man"]),
];

/// Options by subject. A name with a command belongs to that command alone.
const HEADINGS: &[(&str, &[&str])] = &[
    ("Condition", &[COOLANT_FLOW, COOLANT_TEMPERATURE, MOTOR_SPEED, AMBIENT_TEMPERATURE, "at"]),
    ("Machine", &["set", "cells", "machine", "export.field", "full", "mesh_accuracy", "mesh_tolerance", "no_mesh_error"]),
    (
        "Data",
        &[
            "use_tests",
            "without",
            "uncertain",
            "kinds",
            "costs",
            "inputs",
            "ignored",
            "points",
            "conditions",
            "names",
            "length",
            "slopes",
            "followed",
            "dynamics",
            "noise",
            "from",
            "keep_all",
            "every_row",
            "hold_out",
            "held",
            "joined",
        ],
    ),
    (
        "Question",
        &[
            "to",
            "sensor",
            "rise",
            "query.free",
            "minimise",
            "maximise",
            "indices",
            "query.csv",
            "confidence",
            "vary",
            "range",
            "reduce.uncertain",
            "accuracy",
            "max_runs",
            "histories",
            "draws",
            "reduce.field",
            "map",
            "within",
            "passes",
            "new.from",
            "diagnose.plan",
        ],
    ),
    ("Search", &["amplitudes", "identify.free", "scan", "starts", "brief", "max_degree", "seed"]),
    ("Time", &["every", "until", "hold", "repeat", "tolerance", "simulate.from"]),
    ("Service", &["listen", "token_file", "most_bytes", "most_seconds", "patience", "most_requests", "most_connections"]),
    ("Going on", &["checkpoint", "checkpoint_every", "resume", "retry_failed"]),
    ("Parts", &["shard", "shards", "merge", "slurm", "sbatch"]),
    (
        "Results",
        &[
            "out",
            "chart",
            "vtu",
            "hottest",
            "report",
            "pdf",
            "surrogate",
            "results",
            "top",
            "predict.csv",
            "columns",
            "digits",
            "markdown",
            "update",
            "no_sweep",
            "anyway",
            "list",
            "export.to",
            "units",
            "export.name",
            "single",
        ],
    ),
];

/// The whole command line: commands in groups, options under their headings, examples below them.
pub fn command() -> Command {
    let all = super::Cli::command();
    let styles = Styles::styled();
    let heading = |text: &str| format!("{0}{text}:{0:#}", styles.get_header());
    let name =
        |text: &str, width: usize| format!("  {0}{text}{0:#}{1}", styles.get_literal(), " ".repeat(width.saturating_sub(text.len())));
    let list = |entries: &[(&str, String)]| -> String {
        let width = entries.iter().map(|(entry, _)| entry.len()).max().unwrap_or(0);
        entries.iter().map(|(entry, about)| format!("\n{}  {about}", name(entry, width))).collect()
    };
    let about = |name: &str| all.find_subcommand(name).and_then(Command::get_about).map_or_else(String::new, ToString::to_string);
    let width = all.get_subcommands().map(|sub| sub.get_name().len()).max().unwrap_or(0);
    let group = |(title, commands): &(&str, &[&str])| {
        let lines: String = commands.iter().map(|own| format!("\n{}  {}", name(own, width), about(own))).collect();
        format!("{}{lines}", heading(title))
    };
    let groups = GROUPS.iter().map(group).collect::<Vec<_>>().join("\n\n");
    let kinds: Vec<(&str, String)> = (KINDS.iter())
        .map(|kind| {
            let plain = kind.name.trim_start_matches("a ").trim_start_matches("the ");
            (plain, format!("{} ({}): {}", kind.holds, kind.ending, kind.commands.join(", ")))
        })
        .collect();
    let pairs = |pairs: &[(&'static str, &str)]| pairs.iter().map(|(key, text)| (*key, text.to_string())).collect::<Vec<_>>();
    let short = "`coldplate COMMAND -h` lists the options of a command; `--help` says everything, with examples.";
    let long = format!(
        "{short}\n\n{}{}\n\n{}{}\n\n{}{}",
        heading("Files"),
        list(&kinds),
        heading("Exit status"),
        list(&pairs(STATUSES)),
        heading("Environment"),
        list(&pairs(ENVIRONMENT))
    );
    // In this order: purpose, usage, groups of commands, options.
    let template =
        format!("{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{{before-help}}{}\n{{options}}{{after-help}}", heading("Options"));
    let all = all.help_template(template).before_help(groups).after_help(short).after_long_help(long);
    all.mut_subcommands(|sub| {
        let name = sub.get_name().to_string();
        let sub = sub.mut_args(|arg| shortened(under_heading(&name, arg)));
        let Some((_, examples)) = EXAMPLES.iter().find(|(command, _)| *command == name) else { return sub };
        let before = sub.get_after_help().map_or(String::new(), |text| format!("{text}\n\n"));
        let lines: String = examples.iter().map(|line| format!("\n  {line}")).collect();
        let first = examples.first().map_or_else(String::new, |line| format!("Example:\n  {line}"));
        sub.after_help(first).after_long_help(format!("{before}Examples:{lines}"))
    })
}

/// An option whose line in `-h` ends at its first remark; rare ones stand in `--help` alone.
fn shortened(arg: Arg) -> Arg {
    let is_rare = arg.get_help_heading().is_some_and(|heading| RARE.contains(&heading));
    let arg = arg.hide_short_help(is_rare);
    let Some(text) = arg.get_help().map(ToString::to_string).filter(|text| text.chars().count() > SHORT) else { return arg };
    let end = ["; ", ": ", " (", ", for example", ", such as"].iter().filter_map(|mark| text.find(mark)).filter(|at| *at > 0).min();
    let Some(end) = end else { return arg };
    let short = text[..end].to_string();
    let long = arg.get_long_help().map_or(text, ToString::to_string);
    arg.help(short).long_help(long)
}

fn under_heading(command: &str, arg: Arg) -> Arg {
    if arg.is_positional() || arg.is_global_set() {
        return arg;
    }
    let id = arg.get_id().as_str().to_string();
    let own = format!("{command}.{id}");
    let find = |id: &str| HEADINGS.iter().find(|(_, ids)| ids.contains(&id)).map(|(heading, _)| *heading);
    let heading = find(&own).or_else(|| find(&id));
    arg.help_heading(heading)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_stands_in_one_group() {
        let commands: Vec<String> =
            command().get_subcommands().map(|sub| sub.get_name().to_string()).filter(|name| name != "help").collect();
        let grouped: Vec<&str> = GROUPS.iter().flat_map(|(_, commands)| commands.iter().copied()).collect();
        assert_eq!(grouped.len(), commands.len());
        for name in &commands {
            assert!(grouped.contains(&name.as_str()), "{name} stands in no group");
        }
        for kind in KINDS {
            assert!(kind.commands.iter().all(|own| grouped.contains(own)), "{kind:?}");
        }
    }

    #[test]
    fn every_command_has_examples_and_every_option_a_heading() {
        for sub in command().get_subcommands().filter(|sub| sub.get_name() != "help") {
            let name = sub.get_name();
            assert!(EXAMPLES.iter().any(|(command, examples)| *command == name && !examples.is_empty()), "{name} has no example");
            for arg in sub.get_arguments().filter(|a| !a.is_positional() && !["help", "version"].contains(&a.get_id().as_str())) {
                assert!(arg.get_help_heading().is_some(), "{name} --{}", arg.get_id());
            }
        }
    }
}
