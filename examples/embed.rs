//! A surrogate inside another program: the runtime crate alone, which needs no standard library, no memory of its own and no
//! other crate. A control unit would do the same with the file in its flash.
//!
//!     cargo run --release --example embed

use coldplate_runtime::{Acceptability, Surrogate};

/// In a real program: `include_bytes!` of the file that `coldplate fit` or `coldplate run` wrote.
const FILE: &[u8] = include_bytes!("../crates/runtime/fixtures/held.cps");

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Checks everything, so that what follows cannot fail.
    let surrogate = Surrogate::open(FILE)?;
    for variable in surrogate.variables() {
        println!("{} from {} to {} {}", variable.name, variable.low, variable.high, variable.unit);
    }
    // What did not vary is no part of a condition, and every answer is for its value alone.
    for held in surrogate.held() {
        println!("{} held at {} {}", held.name, held.value, held.unit);
    }
    let condition = [8.0, 20.0, 21.0]; // in the order and units of the file
    let mut temperatures = [0.0; 2];
    let verdict = surrogate.query(&condition, &mut temperatures)?;
    for (point, value) in surrogate.points().zip(temperatures) {
        println!("{}: {value:.2} +- {:.2} {}", point.name, point.half_width, point.unit);
    }
    match verdict.state {
        Acceptability::Acceptable => println!("acceptable, margin {:.2} K", verdict.margin),
        Acceptability::NotAcceptable => println!("not acceptable, over by {:.2} K", -verdict.margin),
        Acceptability::Uncertain => println!("uncertain: too close to call, or outside the fitted range"),
    }
    Ok(())
}
