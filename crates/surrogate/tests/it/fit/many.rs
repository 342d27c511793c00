//! Tables of more rows than a basis has centres.

use super::{polynomials_only, rms};
use coldplate_surrogate::fit::model::{Kernel, PointModel};
use coldplate_surrogate::fit::{self, FitOptions};
use coldplate_testing::fits::*;

/// Error over the standard deviation of the truth, share of unseen conditions inside the band, and centres.
fn judged(ranges: &[(f64, f64)], f: Function<'_>, rows: usize, options: &FitOptions) -> (f64, f64, usize) {
    let mut random = Random::new(7);
    let table = samples(stretched(uniform(rows, ranges.len(), &mut random), ranges), ranges, &[f]);
    let found = fit::fit(&table, options).unwrap();
    let test = stretched(uniform(4000, ranges.len(), &mut random), ranges);
    let truth: Vec<f64> = test.iter().map(|x| f(x)).collect();
    let mean = truth.iter().sum::<f64>() / truth.len() as f64;
    let spread = rms(&truth.iter().map(|y| y - mean).collect::<Vec<_>>());
    let e = errors(&found, 0, &test, f);
    let inside = e.iter().filter(|e| e.abs() <= found.points[0].half_width).count() as f64 / e.len() as f64;
    // Stored as ever, and answered by the runtime to the tolerance of the self-tests.
    found.to_bytes().unwrap();
    let centres = match &found.surrogate.points[0].model {
        PointModel::Rbf { basis, .. } => found.surrogate.bases[*basis].centres.len(),
        PointModel::Polynomial(_) => 0,
    };
    (rms(&e) / spread, inside, centres)
}

/// Five times the rows make the error less than half as large, though no more than 1500 of them are centres: a smooth function is
/// known the better the closer the rows are, and least squares average what the centres alone leave open.
#[test]
fn more_rows_than_centres_lower_the_error_and_keep_the_band() {
    let options = FitOptions { kernels: vec![Kernel::Gaussian], ..FitOptions::default() };
    let compare = |name: &str, ranges: &[(f64, f64)], f: Function<'_>| {
        let [few, many] = [1000, 5000].map(|rows| judged(ranges, f, rows, &options));
        println!("{name}: {few:?} with 1000 rows, {many:?} with 5000");
        assert_eq!((few.2, many.2), (1000, 1500), "{name}");
        assert!(many.0 < 0.5 * few.0, "{name}: {:.1e} after {:.1e}", many.0, few.0);
        assert!((0.93..=0.97).contains(&many.1), "{name}: {:.3} inside", many.1);
    };
    compare("ishigami", &ISHIGAMI_RANGES, &ishigami);
    compare("rough", &CUBE, &rough);
}

/// Polynomials whose terms are chosen on some rows take their coefficients from all: the error does not rise, and the band covers.
#[test]
fn coefficients_of_polynomials_are_of_all_rows() {
    let options = FitOptions { max_degree: 3, ..polynomials_only() };
    let [few, many] = [1000, 5000].map(|rows| judged(&BOREHOLE_RANGES, &borehole, rows, &options));
    println!("borehole: {few:?} with 1000 rows, {many:?} with 5000");
    assert!(many.0 < few.0, "{:.1e} after {:.1e}", many.0, few.0);
    assert!((0.93..=0.97).contains(&many.1), "{:.3} inside", many.1);
}
