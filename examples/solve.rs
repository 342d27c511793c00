//! One condition of a machine: how warm its sensors get, and how much heat its joints carry.
//!
//!     cargo run --release --example solve

use coldplate::{Machine, MeshedMachine, Result};

fn main() -> Result<()> {
    let machine = Machine::read("examples/tutorial/machine.toml", &[])?;
    // Variables that are not named take the machine file's defaults.
    let condition = machine.condition(&[("motor_speed", "2500 rpm"), ("coolant_flow", "3 L/min")])?;
    println!("{}: {}", machine.name, condition.words(&machine));

    let model = MeshedMachine::new(machine, Some(2000))?;
    let record = model.record(&model.steady(&condition)?);
    for (sensor, celsius) in &record.sensors {
        println!("  {sensor:<10} {celsius:7.2} degC");
    }
    for (contact, flow) in &record.contacts {
        println!("  {contact:<14} carries {:7.2} W over {:.2} K", flow.heat_W, flow.drop_K);
    }
    for limit in &record.limits {
        println!("  limit '{}': {:.2} of {:.2}, margin {:+.2} K", limit.name, limit.value, limit.limit, limit.margin);
    }
    Ok(())
}
