//! Truth from another mesh with planted parameters and noise drawn from the stated covariance, over many seeds.

use coldplate_base::progress::Silent;
use coldplate_describe::machine::Condition;
use coldplate_evidence::identify::{IdentifyOptions, identify, profile, values};
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, VariableUncertainty};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;
use coldplate_testing::machines::BLOCKS;
use rayon::prelude::*;

use super::common::{Normal, condition, is_likely, problem, study, table};

const SEEDS: usize = 120;
const SENSORS: [&str; 4] = ["motor", "reducer", "plate", "outlet"];
const TESTS: [[f64; 4]; 4] = [[2.0, 20.0, 2000.0, 23.0], [4.0, 20.0, 1000.0, 22.0], [2.0, 24.0, 1500.0, 22.0], [6.0, 18.0, 2000.0, 24.0]];
const PLANTED: [(&str, f64); 4] = [
    ("contact.motor.conductance", 820.0),
    ("contact.reducer.conductance", 430.0),
    ("part.motor.surface.emissivity", 0.7),
    ("source.reducer.power", 1.15),
];

fn truth(cells: usize) -> Study {
    let file = study(BLOCKS, Some(cells));
    let parameters: Vec<_> = PLANTED.iter().map(|(name, value)| (file.parameter(name).unwrap(), *value)).collect();
    file.with(&parameters.iter().map(|(p, v)| (p, *v)).collect::<Vec<_>>()).unwrap()
}

fn uncertainty(data: &Data, study: &Study) -> MeasurementUncertainty {
    let mut u = MeasurementUncertainty::usual(data, &study.model.machine);
    u.noise = vec![0.05, 0.05, 0.03, 0.03];
    u.bias = vec![0.10, 0.06, 0.06, 0.03];
    // Flow, water, speed, ambient.
    u.variables = vec![
        VariableUncertainty { absolute: 0.0, relative: 0.02 },
        VariableUncertainty { absolute: 0.06, relative: 0.0 },
        VariableUncertainty { absolute: 0.0, relative: 0.002 },
        VariableUncertainty { absolute: 0.2, relative: 0.0 },
    ];
    u
}

fn at(study: &Study, conditions: &[Condition]) -> Vec<Vec<f64>> {
    let rows: Vec<_> = conditions.iter().map(|c| (c.clone(), vec![Some(300.0); SENSORS.len()])).collect();
    values(study, &table(study, &SENSORS, &rows), Start::Steady).unwrap().chunks(SENSORS.len()).map(<[f64]>::to_vec).collect()
}

#[test]
fn intervals_cover_the_planted_values_at_their_stated_rate() {
    let (fine, coarse) = (truth(2500), study(BLOCKS, Some(250)));
    assert!(fine.model.mesh.cells > 5 * coarse.model.mesh.cells, "{} {}", fine.model.mesh.cells, coarse.model.mesh.cells);
    let stated: Vec<Condition> = TESTS.iter().map(|c| condition(&coarse, *c)).collect();
    // The meshes differ by less than a third of the least reading noise.
    let apart = at(&fine, &stated).concat().into_iter().zip(at(&truth(250), &stated).concat()).map(|(a, b)| (a - b).abs());
    let apart = apart.fold(0.0, f64::max);
    println!("the meshes differ by {apart:.4} K");
    assert!(apart < 0.01, "{apart}");
    let one = |seed: usize| -> (Vec<bool>, Vec<bool>, f64) {
        let mut noise = Normal(seed as u64 * 7919 + 1);
        let empty = table(&coarse, &SENSORS, &[]);
        let u = uncertainty(&empty, &coarse);
        let actual = |c: &Condition, noise: &mut Normal| {
            Condition::from_si(c.si().iter().zip(u.at(c)).map(|(v, deviation)| v + deviation * noise.next()).collect())
        };
        let actual: Vec<Condition> = stated.iter().map(|c| actual(c, &mut noise)).collect();
        let bias: Vec<f64> = u.bias.iter().map(|b| b * noise.next()).collect();
        let rows = stated.iter().cloned().zip(at(&fine, &actual)).map(|(c, readings)| {
            let read = readings.iter().enumerate().map(|(k, t)| Some(t + bias[k] + u.noise[k] * noise.next()));
            (c, read.collect())
        });
        let data = table(&coarse, &SENSORS, &rows.collect::<Vec<_>>());
        let problem = problem(coarse.clone(), data, u.clone(), &PLANTED.map(|(name, _)| name));
        let found = identify(&problem, &IdentifyOptions { starts: 1, seed: 1 }, &Silent).unwrap();
        assert_eq!(found.freedom, 12);
        let inside = |(low, high): (f64, f64), planted: f64| low <= planted && planted <= high;
        let covers = PLANTED.iter().zip(&found.intervals).map(|((_, planted), i)| inside(*i, *planted)).collect();
        // Profiles of the first seeds only: they take longer.
        let mut profiles = Vec::new();
        if seed < 40 {
            let p = profile(&problem, &found, 2).unwrap();
            profiles.push(inside((p.interval.0.unwrap_or(0.0), p.interval.1.unwrap_or(1.0)), PLANTED[2].1));
        }
        (covers, profiles, found.probability)
    };
    let all: Vec<_> = (0..SEEDS).into_par_iter().map(one).collect();
    for (k, (name, _)) in PLANTED.iter().enumerate() {
        let hits = all.iter().filter(|(covers, ..)| covers[k]).count();
        println!("{name}: {hits} of {SEEDS} intervals hold the planted value");
        assert!(is_likely(hits, SEEDS, 0.95), "{name}: {hits} of {SEEDS}");
    }
    let profiled: Vec<bool> = all.iter().flat_map(|(_, p, _)| p.clone()).collect();
    let hits = profiled.iter().filter(|hit| **hit).count();
    println!("profiles: {hits} of {}", profiled.len());
    assert!(profiled.len() == 40 && is_likely(hits, profiled.len(), 0.95), "{hits} of {}", profiled.len());
    let mut p: Vec<f64> = all.iter().map(|(.., p)| *p).collect();
    let low = p.iter().filter(|p| **p < 0.05).count();
    p.sort_by(f64::total_cmp);
    // Kolmogorov and Smirnov's distance from the uniform distribution; 1.95 / sqrt n is exceeded once in a thousand.
    let n = SEEDS as f64;
    let distance = p.iter().enumerate().map(|(i, p)| (p - i as f64 / n).abs().max((p - (i + 1) as f64 / n).abs())).fold(0.0, f64::max);
    println!("p below 0.05: {low} of {SEEDS}; distance from uniform {distance:.3}, limit {:.3}", 1.95 / n.sqrt());
    assert!(is_likely(low, SEEDS, 0.05), "{low} of {SEEDS}");
    assert!(distance < 1.95 / n.sqrt(), "{distance}");
}

/// Without noise and on the same mesh the planted values come back, from every start.
#[test]
fn planted_values_come_back_without_noise() {
    let (planted, file) = (truth(250), study(BLOCKS, Some(250)));
    let stated: Vec<Condition> = TESTS.iter().map(|c| condition(&file, *c)).collect();
    let rows: Vec<_> = stated.iter().cloned().zip(at(&planted, &stated)).map(|(c, r)| (c, r.into_iter().map(Some).collect())).collect();
    let data = table(&file, &SENSORS, &rows);
    let u = uncertainty(&data, &file);
    let problem = problem(file, data, u, &PLANTED.map(|(name, _)| name));
    let found = identify(&problem, &IdentifyOptions { starts: 3, seed: 3 }, &Silent).unwrap();
    for ((name, planted), value) in PLANTED.iter().zip(&found.values) {
        println!("{name}: {:.1e}", value / planted - 1.0);
        assert!((value / planted - 1.0).abs() < 1e-4, "{name}: {value}");
    }
    assert_eq!(found.ends.len(), 3);
    assert!(found.ends.iter().all(|end| *end < 1e-3), "{:?}", found.ends);
    assert!(found.misfit.1 < 1e-4 && found.misfit.0 > 100.0, "{:?}", found.misfit);
}
