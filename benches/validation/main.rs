//! Writes docs/record/validation.md and its figures from real runs: what of the published study is reproduced, improved, contradicted.
//!
//!     cargo bench --bench validation                 # all of it
//!     cargo bench --bench validation -- rig fits     # prints these sections only, writes figures, not the page
//!     cargo bench --bench validation -- tables       # writes docs/record/paper-tables.md and data/paper/tables.csv
//!     cargo bench --bench validation -- plan         # writes docs/record/test-plan.md

use std::time::Instant;

use coldplate_base::atomic_file;
use coldplate_base::error::Result;
use coldplate_testing::validation::common::{Outcome, Section, project, wrapped, written};
use coldplate_testing::validation::{fits, flow, machine, placement, plan, rig, settling, standstill, tables};

type Make = fn() -> Result<Section>;

/// Name on the command line, heading, what makes it.
const SECTIONS: [(&str, &str, Make); 9] = [
    ("rig", "The rig: contact conductances", || rig::section(None)),
    ("settling", "The rig: settling times", || settling::section(None)),
    ("machine", "The whole machine", || machine::section(Some(machine::CELLS))),
    ("fits", "The published fits", || fits::section(Some(machine::CELLS))),
    ("tables", "The tables as measurements", || tables::section(Some(machine::CELLS))),
    ("standstill", "The emissivity from 17 hours at rest", standstill::section),
    ("placement", "Where sensors tell most", placement::section),
    ("flow", "How much water", flow::section),
    ("plan", "What to measure next", plan::section),
];

const HEAD: &str = "The machines of this project follow a published study of a five-axis machine tool in vacuum. This page asks of each of its claims: does
the program find the same number (*reproduced*), does it know more or come nearer to the measurement (*improved*), or does the number
contradict another one (*contradicted*)? Targets of this project that are not reached stand last.

In short: the rig's two contact conductances come out as published, and predict the test that was not used for them within 0.4 K. They
belong to smaller areas than the published fluxes do, and they are determined only if nothing else joins motor and reducer. The whole
machine is met within 0.34 K at 16 sensors once two numbers are identified, of which one is the heat of a bearing that the study puts a
hundred times too small. Of the published prediction curves a part contradicts the rest, and no one machine can meet them all; one whose heats differ from table to table meets all but three
([the paper's tables](paper-tables.md)).

Every number and figure below comes from runs of this command.

Published numbers are in `data/paper/`, readings in `data/rig.csv` and `data/five_axis.csv`. Differences are predicted less measured;
intervals hold with 95 % probability; *misfit* is the chi-square of the residuals, about as large as the degrees of freedom where model
and data agree within the stated errors. Further words are in the [glossary](../glossary.md).

";

fn main() {
    if let Err(error) = run() {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

fn run() -> Result<()> {
    // Cargo adds --bench to the arguments.
    let chosen: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let mut body = String::new();
    let mut verdicts = Vec::new();
    for (name, heading, make) in SECTIONS {
        if !chosen.is_empty() && !chosen.iter().any(|c| c == name) {
            continue;
        }
        let clock = Instant::now();
        let section = make()?;
        eprintln!("{name}: {:.1} s", clock.elapsed().as_secs_f64());
        body += &format!("## {heading}\n\n{}", section.text);
        verdicts.extend(section.verdicts);
    }
    let mut overview = String::from("## At a glance\n\n");
    for (outcome, title) in [
        (Outcome::Reproduced, "Reproduced"),
        (Outcome::Improved, "Improved"),
        (Outcome::Contradicted, "Contradicted"),
        (Outcome::Missed, "Targets missed"),
    ] {
        let lines: Vec<String> =
            verdicts.iter().filter(|v| v.outcome == outcome).map(|v| format!("* {}: **{}**\n", v.what, v.figure)).collect();
        if lines.is_empty() {
            continue;
        }
        overview += &format!("### {title}\n\n{}\n", lines.concat());
    }
    let text = wrapped(&format!("# Validation\n\n{}{HEAD}{overview}{}\n", written("cargo bench --bench validation"), body.trim_end()));
    if chosen.is_empty() {
        return atomic_file::write(&project("docs/record/validation.md"), text.as_bytes());
    }
    print!("{text}");
    Ok(())
}
