//! The rungs of a diagnosis in words.

use crate::evidence::diagnose::{Cause, Rung, WhereLeft, sentence};
use crate::evidence::discrepancy::Level;
use crate::foundation::numbers::significant;

/// What a rung names, and its share of the misfit.
pub fn words(rung: &Rung) -> String {
    let alone = match rung.alone[..] {
        [first, second] => format!(" (by the first alone {:.0} %, by the second alone {:.0} %)", 100.0 * first, 100.0 * second),
        _ => String::new(),
    };
    format!("{}. {:.0} % of the squared misfit is explained{alone}", causes(rung), 100.0 * rung.share)
}

/// What a rung names.
pub fn causes(rung: &Rung) -> String {
    rung.causes.iter().map(sentence).collect::<Vec<_>>().join("; and ")
}

/// Numbers of the file that were fitted beside its causes, in words.
pub fn refitted(rung: &Rung) -> Vec<String> {
    rung.refitted.iter().map(in_words).collect()
}

/// A number that moved, with how far that is beside what it may be off by.
fn in_words(number: &Cause) -> String {
    let sigma = number.amplitude / number.hypothesis.scale;
    let pulled = if sigma.abs() > 3.0 { format!(": pulled by {} standard deviations", significant(sigma, 2)) } else { String::new() };
    format!("{}{pulled}", sentence(number))
}

/// What a rung leaves, and where.
pub fn left(rung: &Rung) -> String {
    let place = match &rung.where_left {
        Some(WhereLeft { sensor, share }) => format!(", {:.0} % of its square at {sensor}", 100.0 * share),
        None => String::new(),
    };
    format!("left: {:.3} K{place}; {}", rung.rms, level(&rung.left))
}

/// A discrepancy in words.
pub fn level(level: &Level) -> String {
    let mut parts = Vec::new();
    if level.wandering > 0.0 {
        parts.push(format!(
            "an error of {} K that wanders over {} % of a test",
            significant(level.wandering, 2),
            significant(100.0 * level.memory, 2)
        ));
    }
    if level.between_tests > 0.0 {
        parts.push(format!("{} % between tests", significant(100.0 * level.between_tests, 2)));
    }
    if level.numbers > 0.0 {
        parts.push(format!("numbers of the file off by {} %", significant(100.0 * level.numbers, 2)));
    }
    if parts.is_empty() { "what the stated uncertainty explains".into() } else { format!("learnt: {}", parts.join(", ")) }
}
