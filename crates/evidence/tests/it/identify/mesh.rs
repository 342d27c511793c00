//! The mesh's share: contacts and an emissivity found on a coarse mesh from readings of a much finer one.

use coldplate_base::progress::Silent;
use coldplate_describe::machine::Condition;
use coldplate_evidence::identify::{Estimate, IdentifyOptions, identify, identify_and_learn, values};
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, VariableUncertainty};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;
use coldplate_testing::machines::BLOCKS;
use rayon::prelude::*;

use super::common::{Normal, condition, is_likely, problem, study, table};

const SEEDS: usize = 40;
const LEAST_CELLS: usize = 800;
const FURTHER_CELLS: usize = 50;
const NOISE: f64 = 0.02;
/// Half an interval, per cent.
const WIDEST: f64 = 4.0;
const SENSORS: [&str; 4] = ["motor", "reducer", "plate", "outlet"];
const TESTS: [[f64; 4]; 4] = [[2.0, 20.0, 2000.0, 23.0], [4.0, 20.0, 1000.0, 22.0], [2.0, 24.0, 1500.0, 22.0], [6.0, 18.0, 2000.0, 24.0]];
const PLANTED: [(&str, f64); 2] = [("contact.motor.conductance", 820.0), ("contact.reducer.conductance", 430.0)];

/// The blocks of aluminium, in which temperatures differ.
fn blocks(cells: usize) -> Study {
    study(&BLOCKS.replace("20000 W/(m K)", "160 W/(m K)"), Some(cells))
}

fn exactly(data: &Data, study: &Study) -> MeasurementUncertainty {
    let mut u = MeasurementUncertainty::usual(data, &study.model.machine);
    (u.noise, u.bias) = (vec![NOISE; SENSORS.len()], vec![0.0; SENSORS.len()]);
    u.variables = vec![VariableUncertainty::default(); 4];
    u
}

/// Without the mesh's share contacts come out wrong, in intervals far too narrow; with it the intervals hold the truth.
#[test]
fn intervals_hold_what_a_finer_mesh_says() {
    let coarse = blocks(LEAST_CELLS);
    let fine = {
        let fine = blocks(60_000);
        let parameters: Vec<_> = PLANTED.iter().map(|(name, value)| (fine.parameter(name).unwrap(), *value)).collect();
        fine.with(&parameters.iter().map(|(p, v)| (p, *v)).collect::<Vec<_>>()).unwrap()
    };
    let stated: Vec<Condition> = TESTS.iter().map(|c| condition(&coarse, *c)).collect();
    let rows: Vec<_> = stated.iter().map(|c| (c.clone(), vec![Some(300.0); SENSORS.len()])).collect();
    let exact = values(&fine, &table(&fine, &SENSORS, &rows), Start::Steady).unwrap();
    let one = |seed: usize| -> [Estimate; 2] {
        let mut noise = Normal(seed as u64 * 6151 + 3);
        let read = exact.chunks(SENSORS.len()).map(|row| row.iter().map(|t| Some(t + NOISE * noise.next())).collect::<Vec<_>>());
        // Another mesh every time: each is off in its own way.
        let coarse = blocks(LEAST_CELLS + FURTHER_CELLS * seed);
        let data = table(&coarse, &SENSORS, &stated.iter().cloned().zip(read).collect::<Vec<_>>());
        let u = exactly(&data, &coarse);
        let problem = problem(coarse, data, u, &PLANTED.map(|(name, _)| name));
        let options = IdentifyOptions { starts: 1, seed: 1 };
        [identify(&problem, &options, &Silent).unwrap(), identify_and_learn(&problem, &options, &Silent).unwrap()]
    };
    let all: Vec<[Estimate; 2]> = (0..SEEDS).into_par_iter().map(one).collect();
    for (k, (name, planted)) in PLANTED.iter().enumerate() {
        let off = |way: usize| 100.0 * all.iter().map(|e| e[way].values[k] / planted - 1.0).sum::<f64>() / SEEDS as f64;
        let hits = |way: usize| all.iter().filter(|e| (e[way].intervals[k].0..=e[way].intervals[k].1).contains(planted)).count();
        let width = |way: usize| {
            let one = |e: &[Estimate; 2]| 50.0 * (e[way].intervals[k].1 - e[way].intervals[k].0) / planted;
            all.iter().map(one).sum::<f64>() / SEEDS as f64
        };
        for (way, words) in ["as it is", "with the mesh's share"].iter().enumerate() {
            println!("{name}, {words}: off by {:.2} %, +-{:.2} %, {} of {SEEDS} hold it", off(way), width(way), hits(way));
        }
        assert!(is_likely(hits(1), SEEDS, 0.95), "{name}: {}", hits(1));
        assert!(hits(0) < SEEDS / 2 && 2.0 * off(1).abs() < off(0).abs(), "{name}");
        assert!(width(1) < WIDEST, "{name}: {}", width(1));
    }
    assert!(all.iter().all(|e| e[0].mesh.largest() == 0.0 && e[1].mesh.largest() > 0.0));
}
