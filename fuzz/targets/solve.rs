//! A machine of any content, on a coarse mesh, is solved to finite temperatures that balance, or refused.
#![no_main]

use coldplate::{Machine, MeshedMachine};
use libfuzzer_sys::fuzz_target;

/// Cells asked for: enough for every kind of element, few enough for many runs.
const CELLS: usize = 40;

fuzz_target!(|text: &str| {
    let Ok(machine) = Machine::from_text(text, "fuzz/machine.toml", &[]) else { return };
    let Ok(condition) = machine.condition(&[]) else { return };
    let Ok(meshed) = MeshedMachine::new(machine, Some(CELLS)) else { return };
    if meshed.network.solids > 100 * CELLS {
        return;
    }
    let Ok(state) = meshed.steady(&condition) else { return };
    for (sensor, reading) in meshed.network.sensor_names.iter().zip(meshed.readings(&state)) {
        assert!(reading.0.is_finite() && reading.0 > -273.2, "{sensor} reads {}", reading.0);
    }
});
