//! Designs that grow where fits are least sure: at the moment they stop, their bands cover what they say.

use coldplate_base::document::Document;
use coldplate_base::units::Dimension;
use coldplate_describe::machine::DescribedVariable;
use coldplate_explore::sweep::{DesignGrowth, SweepDefinition};
use coldplate_surrogate::fit::placement::{KnownRow, most_telling};
use coldplate_surrogate::fit::{self, FitOptions, FitOutput, FitSamples};
use coldplate_testing::fits::*;

/// Designs per function.
const DESIGNS: u64 = 3;
/// Runs after which a design ends.
const MOST: usize = 72;

/// A first design of `n` variables that grows, and its rows in [0, 1].
fn first(n: usize, seed: u64) -> (DesignGrowth, Vec<Vec<f64>>) {
    let variable =
        |k: usize| DescribedVariable { name: format!("x{k}"), unit: "1".into(), dimension: Dimension::NUMBER, default: None, range: None };
    let variables: Vec<DescribedVariable> = (0..n).map(variable).collect();
    let ranges: String = (0..n).map(|k| format!("x{k} = [0, 1]\n")).collect();
    let text = format!("name = 'f'\nmachine = ''\n[design]\nkind = 'adaptive'\naccuracy = '1 K'\nseed = {seed}\n[range]\n{ranges}");
    let plan = SweepDefinition::new(Document::parse(&text, "f.toml").unwrap()).unwrap().plan(&variables).unwrap();
    (plan.growth.clone().unwrap(), plan.conditions)
}

/// What a round came to.
struct Round {
    runs: usize,
    half_width: f64,
    /// Largest error of the batch that was predicted before.
    predicted: f64,
    /// Sizes of the errors at unseen conditions, ascending.
    errors: Vec<f64>,
}

fn rounds(f: Function<'_>, ranges: &[(f64, f64)], seed: u64) -> Vec<Round> {
    let n = ranges.len();
    let (growth, mut places) = first(n, seed);
    let test = stretched(uniform(1000, n, &mut Random::new(70 + seed)), ranges);
    let (mut found, mut batches): (Vec<Round>, Vec<Vec<Vec<f64>>>) = (Vec::new(), Vec::new());
    loop {
        let rows = stretched(places.clone(), ranges);
        let table: FitSamples = samples(rows.clone(), ranges, &[f]);
        let mut fitted = fit::fit(&table, &FitOptions::default()).unwrap();
        let FitOutput { values, .. } = table.outputs[0].clone();
        fitted.state_bands(&[values], &batches, 0.95);
        let mut sizes: Vec<f64> = errors(&fitted, 0, &test, f).iter().map(|e| e.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let predicted = batches.last().map_or(f64::INFINITY, |batch| batch[0].iter().copied().fold(0.0, f64::max));
        found.push(Round { runs: rows.len(), half_width: fitted.points[0].half_width, predicted, errors: sizes });
        if rows.len() >= MOST {
            return found;
        }
        let scaled = |place: &Vec<f64>| -> Vec<f64> { place.iter().map(|u| 2.0 * u - 1.0).collect() };
        let residuals = &fitted.points[0].held_out;
        let known: Vec<KnownRow> =
            places.iter().zip(residuals).map(|(p, e)| KnownRow { place: scaled(p), errors: Some(vec![e.abs()]) }).collect();
        let candidates = growth.candidates(found.len());
        let scaled: Vec<Vec<f64>> = candidates.iter().map(scaled).collect();
        let batch: Vec<Vec<f64>> = most_telling(&known, &scaled, growth.batch()).iter().map(|i| candidates[*i].clone()).collect();
        let at = stretched(batch.clone(), ranges);
        batches.push(vec![errors(&fitted, 0, &at, f).iter().map(|e| e.abs()).collect()]);
        places.extend(batch);
    }
}

/// Name, function, ranges.
type Case<'a> = (&'a str, Function<'a>, &'a [(f64, f64)]);

/// Of each design, its stops at six accuracies, each half of the one before: the share of unseen conditions inside the band, and
/// within the accuracy.
#[test]
fn bands_of_growing_designs_cover_where_they_stop() {
    let hot = |x: &[f64]| machine(x, 0.09, 0.04, 0.05, 0.35);
    let smooth = |x: &[f64]| (0.5 * x[0] + 0.3 * x[1] - 0.2 * x[2] * x[3]).exp();
    let wave = |x: &[f64]| (2.0 * x[0]).sin() + (x[0] * x[1]).exp();
    let cases: [Case<'_>; 4] = [
        ("machine-like temperature", &hot, &MACHINE_RANGES),
        ("smooth", &smooth, &CUBE),
        ("ridge", &ridge, &CUBE),
        ("waves, two variables", &wave, &CUBE[..2]),
    ];
    println!("| function | stops | inside the band | within the accuracy | runs | largest error over accuracy |");
    println!("|---|---:|---:|---:|---:|---:|");
    let (mut shares, mut kept) = (Vec::new(), Vec::new());
    for (name, f, ranges) in cases {
        let mut stops: Vec<(f64, f64, f64, f64)> = Vec::new();
        for seed in 1..=DESIGNS {
            let rounds = rounds(f, ranges, seed);
            for halvings in 0..6 {
                let accuracy = rounds[0].half_width * 0.5f64.powi(halvings);
                let Some(stop) = rounds.iter().find(|r| r.half_width <= accuracy && r.predicted <= accuracy) else { continue };
                let share = |limit: f64| stop.errors.partition_point(|e| *e <= limit) as f64 / stop.errors.len() as f64;
                let largest = stop.errors.last().unwrap() / accuracy;
                stops.push((share(stop.half_width), share(accuracy), stop.runs as f64, largest));
            }
        }
        let mean = |of: fn(&(f64, f64, f64, f64)) -> f64| stops.iter().map(of).sum::<f64>() / stops.len() as f64;
        println!(
            "| {name} | {} | {:.1} % | {:.1} % | {:.0} | {:.2} |",
            stops.len(),
            100.0 * mean(|s| s.0),
            100.0 * mean(|s| s.1),
            mean(|s| s.2),
            mean(|s| s.3)
        );
        shares.push(mean(|s| s.0));
        kept.push(mean(|s| s.1));
    }
    assert!(shares.iter().all(|share| *share >= 0.95), "{shares:?}");
    assert!(kept.iter().all(|share| *share >= 0.95), "{kept:?}");
}
