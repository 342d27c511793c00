//! The rungs of a diagnosis in words.

use coldplate_base::numbers::significant;
use coldplate_diagnose::{Cause, Rung, WhereLeft, sentence};

/// Name of a rung without a cause.
pub const NUMBERS: &str = "numbers of the machine file as the readings draw them";

/// Causes of a rung and its share of the misfit, in words.
pub fn words(rung: &Rung) -> String {
    let each: Vec<String> = rung.alone.iter().map(|share| format!("{:.0} %", 100.0 * share)).collect();
    let alone = if each.is_empty() { String::new() } else { format!(" (by each alone {})", each.join(", ")) };
    format!("{}. {:.0} % of the squared misfit is explained{alone}", causes(rung), 100.0 * rung.share)
}

/// Causes of a rung in words.
pub fn causes(rung: &Rung) -> String {
    if rung.causes.is_empty() {
        return NUMBERS.into();
    }
    rung.causes.iter().map(sentence).collect::<Vec<_>>().join("; and ")
}

/// Numbers of the file that were fitted beside the rung's causes, in words.
pub fn refitted(rung: &Rung) -> Vec<String> {
    rung.refitted.iter().map(in_words).collect()
}

/// A number that moved, in words, with its change in standard deviations of its prior.
fn in_words(number: &Cause) -> String {
    let sigma = number.amplitude / number.hypothesis.scale;
    let pulled = if sigma.abs() > 3.0 { format!(": pulled by {} standard deviations", significant(sigma, 2)) } else { String::new() };
    format!("{}{pulled}", sentence(number))
}

/// Residual that a rung leaves, and the sensor with most of it, in words.
pub fn left(rung: &Rung) -> String {
    let place = match &rung.where_left {
        Some(WhereLeft { sensor, share }) => format!(", {:.0} % of its square at {sensor}", 100.0 * share),
        None => String::new(),
    };
    let learnt = match rung.left.in_words() {
        words if words.is_empty() => "what the stated uncertainty explains".into(),
        words => format!("left open: {words}"),
    };
    format!("left: {:.3} K{place}; {learnt}", rung.rms)
}

/// Causes of a rung that the extended machine leaves out, in words.
pub fn left_out(rung: &Rung) -> Option<String> {
    let own = rung.left_out.as_ref()?;
    Some(format!("not in the extended machine, for a machine file has no words: {}; it leaves {:.3} K", own.causes.join(", "), own.rms))
}
