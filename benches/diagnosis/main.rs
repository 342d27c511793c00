//! Hidden effects, found or not: the goals of a diagnosis over many seeded cases, drawn as unkind as reality.
//!
//!     cargo bench --bench diagnosis -- run JOURNAL [CASES] [FIRST SEED] [EVERY] [FAMILY]
//!     cargo bench --bench diagnosis -- report JOURNAL...
//!     cargo bench --bench diagnosis -- show SEED...
//!     cargo bench --bench diagnosis -- constants JOURNAL [CASES] [FIRST SEED] [EVERY] [FAMILY]
//!     cargo bench --bench diagnosis -- moved JOURNAL...
//!
//! `run` adds a line to the journal for each case, and leaves out those that are there: a run that was ended goes on where it
//! stopped. With EVERY it takes every so many of the seeds, so that several runs share them; with FAMILY (clean, one, two,
//! three, four, outside) only these cases. `report` prints the tables of docs/record/diagnosis.md from journals, `show` one case with
//! all that was hidden and answered. `constants` halves and doubles each constant that decides an answer, on so many cases; `moved` prints what
//! that changes. A seed decides machine, family, effects and unkindnesses.

mod draw;
mod journal;
mod machines;
mod outside;
mod run;
mod sensitivity;
mod table;
mod truth;
mod unkind;

use std::path::PathBuf;

use journal::Journal;

fn main() {
    // `cargo bench` adds a flag of its own.
    let args: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let number = |i: usize, usual: u64| args.get(i).map_or(usual, |a| a.parse().unwrap_or_else(|_| usage()));
    let seeds = || {
        let (cases, first, every) = (number(2, 600), number(3, 700_000), number(4, 1).max(1));
        let wanted = args.get(5).map(|name| draw::Family::named(name).unwrap_or_else(|| usage()));
        let is_wanted = move |seed: &u64| wanted.is_none_or(|family| draw::family(*seed) == family);
        (first..first + cases).step_by(every as usize).filter(is_wanted)
    };
    match (args.first().map(String::as_str), args.get(1)) {
        (Some("run"), Some(path)) => {
            let mut journal: Journal<run::Record> = Journal::open(PathBuf::from(path));
            for seed in seeds().filter(|seed| !journal.holds(*seed)).collect::<Vec<_>>() {
                journal.add(run::case(seed, false));
            }
        }
        (Some("report"), Some(_)) => table::print(&records(&args[1..])),
        (Some("constants"), Some(path)) => sensitivity::run(PathBuf::from(path), seeds()),
        (Some("moved"), Some(_)) => sensitivity::print(&records(&args[1..])),
        (Some("show"), Some(_)) => args[1..].iter().for_each(|seed| {
            run::case(seed.parse().unwrap_or_else(|_| usage()), true);
        }),
        _ => usage(),
    }
}

fn records<E: journal::Entry>(paths: &[String]) -> Vec<E> {
    paths.iter().flat_map(|path| Journal::open(PathBuf::from(path)).records).collect()
}

fn usage() -> ! {
    eprintln!("run or constants JOURNAL [CASES] [FIRST SEED] [EVERY] [FAMILY], report or moved JOURNAL..., or show SEED...");
    std::process::exit(2)
}
