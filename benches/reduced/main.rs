//! What reduced models are worth (docs/record/reduced.md).
//!
//!     cargo bench --bench reduced -- effectivity [CONDITIONS]   bound over error at random conditions, of every shipped machine, as
//!                                                               a table and as docs/images/effectivity.svg
//!     cargo bench --bench reduced -- online FILE.cpr [CONDITIONS]  how long an answer takes, and the widest bound
//!     cargo bench --bench reduced -- linear DIR [CELLS]         a linear problem of conduction: its matrices, the conditions it is
//!                                                               judged at and our own answers go to DIR
//!
//! `scripts/peers-reduced` lets pyMOR reduce the same problem and prints both.

mod effectivity;
mod linear;
mod online;
mod plot;

use std::path::Path;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let number = |i: usize| args.get(i).and_then(|a| a.parse::<usize>().ok());
    match (args.first().map(String::as_str), args.get(1)) {
        (Some("linear"), Some(folder)) => linear::run(Path::new(folder), number(2).unwrap_or(30_000)),
        (Some("online"), Some(file)) => online::run(Path::new(file), number(2).unwrap_or(1000)),
        (None | Some("effectivity"), _) => effectivity::run(number(1).unwrap_or(500)),
        _ => eprintln!("give 'effectivity [CONDITIONS]', 'online FILE.cpr [CONDITIONS]' or 'linear DIR [CELLS]'"),
    }
}
