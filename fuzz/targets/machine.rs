//! A machine file of any content is read or refused; what is read has finite values at its default condition.
#![no_main]

use coldplate::Machine;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let Ok(machine) = Machine::from_text(text, "fuzz/machine.toml", &[]) else { return };
    let Ok(condition) = machine.condition(&[]) else { return };
    assert!(condition.si().iter().all(|v| v.is_finite()), "{}", condition.words(&machine));
    let _ = machine.values(&condition);
});
