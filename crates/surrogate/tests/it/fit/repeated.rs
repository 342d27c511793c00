//! Tables whose rows repeat conditions: a condition counts once, the scatter of its readings counts in the band.

use coldplate_base::random::Random;
use coldplate_surrogate::fit::{self, FitOptions, FitOutput, FitSamples, SurrogateFit};

/// A table of readings (degC) over two variables.
fn table(rows: &[([f64; 2], f64)]) -> FitSamples {
    let values = rows.iter().map(|row| row.1).collect();
    let output = FitOutput { name: "motor".into(), unit: "degC".into(), values };
    FitSamples::with_measured_ranges(&[("flow", "1"), ("heater", "1")], rows.iter().map(|row| row.0.to_vec()).collect(), vec![output])
}

fn fitted(rows: &[([f64; 2], f64)]) -> SurrogateFit {
    fit::fit(&table(rows), &FitOptions::default()).unwrap()
}

const PLACES: [[f64; 2]; 8] = [[1.5, 2.2], [9.1, 3.3], [4.0, 7.7], [6.6, 5.0], [2.7, 6.1], [8.0, 8.0], [5.2, 1.4], [3.3, 4.1]];

fn product(x: [f64; 2]) -> f64 {
    20.0 + x[0] * x[1]
}

/// Copies of a row say nothing new: model and band are those of the table without them.
#[test]
fn exact_copies_change_nothing() {
    let rows: Vec<([f64; 2], f64)> = PLACES.iter().map(|x| (*x, product(*x))).collect();
    let alone = fitted(&rows);
    for copied in [0, 3, 7] {
        for copies in [1, 5] {
            let with = [rows.clone(), vec![rows[copied]; copies]].concat();
            let found = fitted(&with);
            assert_eq!(found.surrogate.points[0].model, alone.surrogate.points[0].model);
            let [before, after] = [&alone, &found].map(|fit| fit.points[0].half_width);
            assert!((after / before - 1.0).abs() < 1e-9, "row {copied}, {copies} copies: {before} K, {after} K");
            assert_eq!(found.points[0].held_out.len(), 8 + copies);
            assert!(found.notes.iter().any(|note| note.contains("8 conditions")), "{:?}", found.notes);
        }
    }
}

/// Readings that scatter by 0.33 K at one condition: their mean is fitted, and the band holds the scatter without leaving its size.
#[test]
fn scatter_at_a_condition_widens_the_band_by_itself() {
    let mut rows: Vec<([f64; 2], f64)> = PLACES.iter().map(|x| (*x, product(*x))).collect();
    rows.extend([(PLACES[0], product(PLACES[0]) + 0.33), (PLACES[0], product(PLACES[0]) - 0.33)]);
    let found = fitted(&rows);
    for (x, _) in &rows[..8] {
        let value = fit::evaluate::evaluate(&found.surrogate, 0, x).unwrap();
        assert!((value - product(*x)).abs() < 0.1, "{value} at {x:?}");
    }
    let band = found.points[0].half_width;
    assert!((0.33..1.0).contains(&band), "{band} K");
}

/// Every condition read four times with noise of 0.2 K: the band covers new readings, and is no wider than twice what noise needs.
#[test]
fn a_band_of_repeated_noise_covers_new_readings() {
    let mut random = Random::new(5);
    let places: Vec<[f64; 2]> = (0..40).map(|_| [1.0 + 8.0 * random.unit(), 1.0 + 8.0 * random.unit()]).collect();
    let rows: Vec<([f64; 2], f64)> = places.iter().flat_map(|x| [*x; 4]).map(|x| (x, product(x) + 0.2 * random.normal())).collect();
    let found = fitted(&rows);
    let band = found.points[0].half_width;
    assert!((0.3..0.8).contains(&band), "{band} K");
    let inside = (0..400).filter(|_| {
        let x = [1.5 + 7.0 * random.unit(), 1.5 + 7.0 * random.unit()];
        let reading = product(x) + 0.2 * random.normal();
        (fit::evaluate::evaluate(&found.surrogate, 0, &x).unwrap() - reading).abs() <= band
    });
    let inside = inside.count();
    assert!(inside >= 368, "{inside} of 400 new readings in a band of {band} K");
}

/// Four rows at two conditions know two values, which is no surrogate.
#[test]
fn two_conditions_are_too_few_however_often_they_were_read() {
    let rows: Vec<([f64; 2], f64)> = [(20.0, 74.0), (20.0, 68.0), (140.0, 126.0), (140.0, 120.0)].map(|(x, y)| ([x, 1.0], y)).to_vec();
    let error = fit::fit(&table(&rows), &FitOptions::default()).unwrap_err().to_string();
    assert!(error.contains("2 different conditions") && error.contains("at least 4 conditions"), "{error}");
}
