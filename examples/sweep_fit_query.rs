//! From a sweep file to answers: solve a design of conditions, fit a surrogate, ask it.
//!
//!     cargo run --release --example sweep_fit_query
//!
//! Started again, it takes what it solved from the journal in out/examples/sweep.

use coldplate::{FitOptions, Inverse, Progress, Surrogate, Sweep, SweepOptions, fit_table, free, query};

/// Progress as lines of text.
struct Lines;

impl Progress for Lines {
    fn say(&self, what: &str) {
        println!("{what}");
    }

    fn count(&self, done: usize, total: usize, what: &str) {
        if done.is_multiple_of(40) {
            println!("{done} of {total} {what}");
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let sweep = Sweep::open("examples/tutorial/sweep.toml", Some(500), &[])?;
    let options = SweepOptions { progress: Some(&Lines), ..SweepOptions::default() };
    let swept = sweep.run("out/examples/sweep", options)?;
    let fit = fit_table(&swept.table, Some(&sweep.scope), &FitOptions::default())?;
    for point in &fit.points {
        println!("{:<10} within {:.4} K on 95 of 100 new conditions", point.name, point.half_width);
    }

    let file = fit.to_bytes()?;
    let surrogate = Surrogate::open(&file)?;
    let condition = [4.0, 20.0, 2800.0, 22.0]; // L/min, degC, rpm, degC
    let answer = query(&surrogate, &condition)?;
    println!("{:?}: {:?} decides", answer.verdict, answer.binding_name());
    // The inverse question: how much water does it take?
    let flow = surrogate.variables().position(|v| v.name == "coolant_flow").unwrap_or(0);
    if let Inverse::Found { smallest, .. } = free(&surrogate, &condition, flow)? {
        println!("acceptable from {smallest:.2} L/min");
    }
    Ok(())
}
