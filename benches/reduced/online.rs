//! How long an answer of a model in a file takes, at random conditions of its ranges, and how wide its widest bound is.

use std::path::Path;
use std::time::Instant;

use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_reduce::ReducedModel;

/// Prints both.
pub fn run(file: &Path, count: usize) {
    let bytes = std::fs::read(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let model = ReducedModel::from_bytes(&bytes).unwrap_or_else(|e| panic!("{e}"));
    let mut random = Random::new(11);
    let mut place = || Condition::from_si(model.ranges.iter().map(|(low, high)| low + random.unit() * (high - low)).collect());
    let conditions: Vec<Condition> = (0..count).map(|_| place()).collect();
    let begun = Instant::now();
    let answers: Vec<_> = conditions.iter().map(|c| model.steady(c, &[]).unwrap_or_else(|e| panic!("{e}"))).collect();
    let each = 1e3 * begun.elapsed().as_secs_f64() / count as f64;
    let widest = answers.iter().flat_map(|a| &a.bounds).fold(0.0f64, |m, b| m.max(*b));
    let steps = answers.iter().map(|a| a.state.steps).sum::<usize>() as f64 / count as f64;
    println!(
        "{count} conditions, {} modes: {each:.2} ms each on one thread, {steps:.1} steps of the finer network, widest bound {widest:.1e} K",
        model.fine.len()
    );
}
