//! Least squares against the certified values of NIST's Statistical Reference Datasets, and radial functions against
//! scipy's `RBFInterpolator` (script and version beside the numbers, in `scipy/`).

use coldplate_surrogate::fit::evaluate;
use coldplate_surrogate::fit::least_squares::least_squares;
use coldplate_surrogate::fit::model::Kernel;
use coldplate_surrogate::fit::one_factor::OneFactorFit;
use coldplate_surrogate::fit::rbf::RbfSystem;

/// A data set: certified estimates with their standard deviations, residual standard deviation, R squared, rows of y and x.
struct Certified {
    coefficients: Vec<f64>,
    deviations: Vec<f64>,
    residual: f64,
    r_squared: Option<f64>,
    y: Vec<f64>,
    x: Vec<Vec<f64>>,
}

fn read(name: &str) -> Certified {
    let path = format!("{}/tests/it/certified/nist/{name}.dat", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let mut set = Certified { coefficients: vec![], deviations: vec![], residual: f64::NAN, r_squared: None, y: vec![], x: vec![] };
    for line in text.lines().filter(|l| !l.starts_with('#')) {
        let (kind, rest) = line.split_at(1);
        let numbers = |text: &str| text.split_whitespace().map(|n| n.parse::<f64>().unwrap()).collect::<Vec<_>>();
        match kind {
            "B" => {
                let pair = numbers(rest);
                set.coefficients.push(pair[0]);
                set.deviations.push(pair[1]);
            }
            "S" => set.residual = numbers(rest)[0],
            "R" => set.r_squared = Some(numbers(rest)[0]),
            _ => {
                let row = numbers(line);
                set.y.push(row[0]);
                set.x.push(row[1..].to_vec());
            }
        }
    }
    set
}

/// Decimal digits that agree; a certified zero counts digits of the absolute error.
fn digits(found: f64, certified: f64) -> f64 {
    let error = if certified == 0.0 { found.abs() } else { ((found - certified) / certified).abs() };
    if error == 0.0 { 16.0 } else { -error.log10() }
}

fn least(found: &[f64], certified: &[f64]) -> f64 {
    assert_eq!(found.len(), certified.len());
    found.iter().zip(certified).map(|(f, c)| digits(*f, *c)).fold(16.0, f64::min)
}

/// One-variable polynomials through the raw coefficients that are printed. Required digits: of coefficients, of their
/// standard deviations and of the residual deviation (`None`: certified zero, exact fit).
#[test]
fn nist_polynomials() {
    let cases: [(&str, usize, f64, Option<f64>); 8] = [
        ("norris", 1, 12.0, Some(12.0)),
        ("pontius", 2, 12.0, Some(11.0)),
        ("filip", 10, 9.0, Some(9.0)),
        ("wampler1", 5, 10.0, None),
        ("wampler2", 5, 12.0, None),
        ("wampler3", 5, 10.0, Some(12.0)),
        ("wampler4", 5, 9.0, Some(12.0)),
        ("wampler5", 5, 9.0, Some(12.0)),
    ];
    for (name, degree, required, deviations) in cases {
        let set = read(name);
        let x: Vec<f64> = set.x.iter().map(|x| x[0]).collect();
        let found = OneFactorFit::fit(&x, &set.y, degree).unwrap();
        let reached = least(&found.coefficients, &set.coefficients);
        let sd = least(&found.standard_errors, &set.deviations);
        println!(
            "{name}: coefficients {reached:.1} digits, deviations {sd:.1}, residual {:.1}",
            digits(found.residual_deviation, set.residual)
        );
        assert!(reached >= required, "{name}: {reached:.1} digits of {required}: {:?}", found.coefficients);
        if let Some(required) = deviations {
            assert!(sd >= required, "{name}: standard deviations to {sd:.1} digits");
            assert!(digits(found.residual_deviation, set.residual) >= required, "{name}: residual deviation");
        } else {
            let size = set.y.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
            assert!(found.residual_deviation < 1e-14 * size, "{name}: {:e}", found.residual_deviation);
        }
        if let Some(r_squared) = set.r_squared {
            assert!(digits(found.r_squared, r_squared) >= 12.0, "{name}: R squared {}", found.r_squared);
        }
    }
}

/// Several nearly dependent variables: the columns as given, no centring.
#[test]
fn nist_longley() {
    let set = read("longley");
    let mut columns = vec![vec![1.0; set.y.len()]];
    columns.extend((0..6).map(|k| set.x.iter().map(|x| x[k]).collect::<Vec<_>>()));
    let found = least_squares(&columns, &set.y).unwrap();
    let (reached, sd) = (least(&found.coefficients, &set.coefficients), least(&found.standard_errors, &set.deviations));
    println!("longley: coefficients {reached:.1} digits, deviations {sd:.1}");
    assert!(reached >= 11.0 && sd >= 10.0, "{reached:.1} {sd:.1}");
    assert!(digits(found.residual_deviation, set.residual) >= 11.0);
    assert!(digits(found.r_squared, set.r_squared.unwrap()) >= 12.0);
}

/// Every kernel, with several shapes, smoothings and tails, on fixed data: values at other places as scipy gives them.
#[test]
fn scipy_radial_functions() {
    let text = std::fs::read_to_string(format!("{}/tests/it/certified/scipy/rbf.csv", env!("CARGO_MANIFEST_DIR"))).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().filter(|l| !l.starts_with('#')).map(|l| l.split(',').collect()).collect();
    let numbers = |row: &[&str]| row.iter().map(|n| n.parse::<f64>().unwrap()).collect::<Vec<_>>();
    let of_kind = |kind: &str| rows.iter().filter(|r| r[0] == kind).collect::<Vec<_>>();
    let data: Vec<Vec<f64>> = of_kind("data").iter().map(|r| numbers(&r[1..])).collect();
    let d = data[0].len() - 1;
    let centres: Vec<Vec<f64>> = data.iter().map(|r| r[..d].to_vec()).collect();
    let y: Vec<f64> = data.iter().map(|r| r[d]).collect();
    let places: Vec<Vec<f64>> = of_kind("place").iter().map(|r| numbers(&r[1..])).collect();
    let cases = of_kind("case");
    assert!(cases.len() >= 20);
    for case in cases {
        let kernel = match case[1] {
            "thin_plate_spline" => Kernel::ThinPlate,
            "cubic" => Kernel::Cubic,
            "multiquadric" => Kernel::Multiquadric,
            "gaussian" => Kernel::Gaussian,
            other => panic!("unknown kernel {other}"),
        };
        let settings = numbers(&case[2..5]);
        let (epsilon, smoothing, degree) = (settings[0], settings[1], settings[2] as usize);
        let expected = numbers(&case[5..]);
        let terms: Vec<Vec<u8>> = exponents(d, degree);
        let system = RbfSystem::new(centres.clone(), (0..d).collect(), terms.clone(), vec![y.clone()]).unwrap();
        let scales = vec![epsilon; d];
        let solved = system.solve(kernel, &scales, smoothing).unwrap();
        for (u, expected) in places.iter().zip(&expected) {
            let radial: f64 = centres
                .iter()
                .zip(&solved.weights[0])
                .map(|(c, w)| w * evaluate::radial(kernel, c.iter().zip(u).map(|(a, b)| (epsilon * (a - b)).powi(2)).sum()))
                .sum();
            let power = |t: &[u8]| t.iter().zip(u).map(|(e, u)| u.powi(i32::from(*e))).product::<f64>();
            let value = radial + terms.iter().zip(&solved.tails[0]).map(|(t, c)| c * power(t)).sum::<f64>();
            let error = (value - expected).abs() / expected.abs().max(1.0);
            assert!(error < 1e-9, "{:?}: {value} instead of {expected}, {error:e}", &case[1..5]);
        }
    }
}

fn exponents(d: usize, degree: usize) -> Vec<Vec<u8>> {
    let mut all = vec![vec![]];
    for _ in 0..d {
        all = all
            .into_iter()
            .flat_map(|t: Vec<u8>| {
                let used: u8 = t.iter().sum();
                (0..=degree as u8 - used).map(move |e| {
                    let mut t = t.clone();
                    t.push(e);
                    t
                })
            })
            .collect();
    }
    all
}
