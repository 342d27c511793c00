//! What a machine file gets wrong against readings, and the file with the best explanation in it.
//!
//!     cargo run --release --example diagnose_extend

use coldplate::{DiagnosisProblem, Machine, Result, examine, words};

fn main() -> Result<()> {
    // How good the readings are stands beside them, in readings.toml.
    let problem = DiagnosisProblem::read(
        "examples/tutorial/machine.toml",
        "examples/tutorial/readings.csv",
        Some(300), // differences matter here, not the last tenth of a kelvin
    )?;
    let progress = |what: &str| eprintln!("{what}");
    let found = examine(&problem, "out/examples/extended.toml", None, &progress)?;
    println!("{}", found.headline());
    for (_, explanation) in found.ranked(5) {
        println!("  {:.3}  {}", explanation.probability, words(explanation));
    }
    if let Some(gain) = &found.diagnosis.gain {
        println!("on conditions that took no part: {:.2} K before, {:.2} K after", gain.before, gain.after);
    }
    let Some(extended) = &found.extended else {
        println!("no extended machine: {}", found.why_not_extended());
        return Ok(());
    };
    for change in &extended.changes {
        println!("{} = {}", change.key, change.after);
    }
    // A machine file like any other.
    found.write()?;
    println!("{} has {} parts", extended.path.display(), Machine::read(&extended.path, &[])?.parts.len());
    Ok(())
}
