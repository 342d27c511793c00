//! A changed surrogate file is refused; one whose checksum was mended as well answers without a panic.
#![no_main]

use std::sync::LazyLock;

use coldplate_fuzz::damaged;
use coldplate_runtime::{Surrogate, format};
use libfuzzer_sys::fuzz_target;

static SOUND: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let path = std::env::var_os("COLDPLATE_FUZZ_SURROGATE").expect("scripts/fuzz names a surrogate file");
    std::fs::read(path).expect("the surrogate file is there")
});

fuzz_target!(|plan: &[u8]| {
    let Some((mode, plan)) = plan.split_first() else { return };
    let mut bytes = if *mode == 2 { plan.to_vec() } else { damaged(&SOUND, plan) };
    if *mode == 0 {
        assert!(bytes == *SOUND || Surrogate::open(&bytes).is_err(), "damage passed for sound");
        return;
    }
    let length = bytes.len() as u32;
    if let Some(field) = bytes.get_mut(12..16) {
        field.copy_from_slice(&length.to_le_bytes());
    }
    if let Some(end) = bytes.len().checked_sub(format::TRAILER) {
        let checksum = format::crc32(&bytes[..end]);
        bytes[end..].copy_from_slice(&checksum.to_le_bytes());
    }
    let Ok(surrogate) = Surrogate::open(&bytes) else { return };
    let middle: Vec<f64> = surrogate.variables().map(|v| 0.5 * (v.low + v.high)).collect();
    let mut values = vec![0.0; surrogate.point_count()];
    let verdict = surrogate.query(&middle, &mut values).expect("the lengths are right");
    assert!(verdict.in_domain);
    let mut gradient = vec![0.0; middle.len()];
    surrogate.gradient(&middle, 0, &mut gradient).expect("the lengths are right");
});
