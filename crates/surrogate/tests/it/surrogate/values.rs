//! Values and gradients against mpmath 1.3 (40 digits; its numerical derivatives), which was given
//! the same coefficients, centres and ranges and the formulas in the documentation of the model.

use coldplate_surrogate::fit::evaluate;
use coldplate_surrogate::fit::file::{encode, open};
use coldplate_surrogate::fit::model::*;

use crate::surrogate::examples::*;

const CONDITIONS: [[f64; 3]; 4] = [[2.0, 15.0, 100.0], [12.0, 25.0, 3000.0], [5.3, 18.7, 1234.5], [9.42, 20.5, 2500.0]];

/// Value and the derivatives with respect to the three variables, at each condition.
type Expected = [[f64; 4]; 4];

const POLYNOMIAL: Expected = [
    [19.3125, 3.375, 0.975, 0.005512764446160113],
    [41.5625, 0.10625, 1.175, 0.0004042693927184083],
    [31.89525461043283, 0.7033167756734591, 1.0163583747764848, 0.0009551105213601877],
    [36.00466190772827, 0.17626458998085978, 1.0717250882150118, 0.00037887886251742784],
];
const THIN_PLATE: Expected = [
    [100.29347627399741, 0.5975039312734498, -8.613675795692089, -0.0552852730715944],
    [67.07985025743497, 1.5134724225501381, 1.3387240273255925, 0.02929557841646315],
    [41.15665981688384, 0.8668367827344785, -1.6101765906972783, -0.019047819934927455],
    [46.322228146388014, 1.1755863398871775, 0.6481391536761966, 0.021618269612801763],
];
const CUBIC: Expected = [
    [265.7248153228188, 0.5483191581177159, -27.93049308257294, -0.19169542779519758],
    [163.63422341367442, 3.8159492010388436, 6.0592318239642795, 0.10295614816351008],
    [78.4662738113958, 1.3981437644044445, -4.515194225257537, -0.05367710578368338],
    [94.20212436423208, 2.5432811823801846, 2.3788250326390967, 0.06413146014587437],
];
const MULTIQUADRIC: Expected = [
    [30.376482512007904, 0.5452339939296137, -0.5272842499184264, -0.0024962740012207493],
    [31.221735424042862, 0.7150000964764864, 0.183205658571948, 0.0012977579366949244],
    [28.888844712312807, 0.6074926846929207, -0.3955462583958676, -0.001202099518660281],
    [29.581281490646415, 0.6864762168015788, -0.38350055587356535, -0.0006868943039016344],
];
const GAUSSIAN: Expected = [
    [18.90279764125016, 0.48389322336246493, -0.057263877276322046, -5.583773424045983e-05],
    [23.814058557533563, 0.31846312725991527, -0.3188253655408856, 1.2103756735163487e-05],
    [19.56623310836104, 0.45919817567252935, 0.25985146857392843, -0.0004327025082052184],
    [22.31917773319941, 0.34438650693786343, 0.4248200934670015, 0.0032230127342671075],
];

fn variables() -> Vec<VariableSpec> {
    vec![variable("flow", "L/min", 2.0, 12.0), variable("temperature", "degC", 15.0, 25.0), variable("speed", "rpm", 100.0, 3000.0)]
}

fn the_polynomial() -> PointModel {
    use Transform::{Identity, Log, Reciprocal};
    let terms: [&[u8]; 8] = [&[0, 0, 0], &[1, 0, 0], &[0, 1, 0], &[0, 0, 1], &[2, 0, 1], &[1, 1, 2], &[0, 3, 0], &[5, 0, 7]];
    PointModel::Polynomial(polynomial(&[Reciprocal, Identity, Log], &terms, &[30.0, 4.5, 5.0, 2.25, -0.75, 0.5, 0.125, -0.0625]))
}

fn basis(kernel: Kernel) -> RbfBasis {
    use Transform::{Identity, Log};
    let centres: [[f64; 3]; 6] =
        [[-1.0, -1.0, -1.0], [1.0, -0.5, 0.25], [0.125, 0.75, -0.5], [-0.375, 0.5, 1.0], [0.625, -0.25, -0.875], [0.0; 3]];
    RbfBasis {
        kernel,
        transforms: vec![Identity, Log, Identity],
        scales: vec![0.5, 1.25, 2.0],
        centres: centres.iter().map(|c| c.to_vec()).collect(),
    }
}

fn radial(basis: usize) -> PointModel {
    use Transform::{Identity, Log};
    let tail = polynomial(&[Identity, Log, Identity], &[&[0, 0, 0], &[1, 0, 0]], &[20.0, 2.5]);
    PointModel::Rbf { basis, weights: vec![1.5, -2.25, 0.75, 3.125, -0.5, 1.0], tail }
}

/// All five in one file, the polynomial in the middle.
fn all() -> (SurrogateSpec, [Expected; 5]) {
    let surrogate = SurrogateSpec {
        variables: variables(),
        bases: [Kernel::ThinPlate, Kernel::Cubic, Kernel::Multiquadric, Kernel::Gaussian].map(basis).into(),
        points: vec![
            point("thin plate", radial(0), 0.1),
            point("cubic", radial(1), 0.1),
            point("polynomial", the_polynomial(), 0.1),
            point("multiquadric", radial(2), 0.1),
            point("gaussian", radial(3), 0.1),
        ],
        ..Default::default()
    };
    (surrogate, [THIN_PLATE, CUBIC, POLYNOMIAL, MULTIQUADRIC, GAUSSIAN])
}

fn close(found: f64, expected: f64, relative: f64) -> bool {
    (found - expected).abs() <= relative * expected.abs()
}

#[test]
fn values_and_gradients_agree_with_mpmath() {
    let (surrogate, expected) = all();
    let bytes = encode(&surrogate).unwrap();
    let file = open(&bytes).unwrap();
    let (mut values, mut gradient) = ([0.0; 5], [0.0; 3]);
    for (i, x) in CONDITIONS.iter().enumerate() {
        file.evaluate(x, &mut values).unwrap();
        for (point, expected) in expected.iter().enumerate() {
            let [value, slopes @ ..] = expected[i];
            assert!(close(values[point], value, 8e-15), "point {point} at {x:?}: {} and {value}", values[point]);
            file.gradient(x, point, &mut gradient).unwrap();
            for (found, slope) in gradient.iter().zip(slopes) {
                assert!(close(*found, slope, 1e-12), "point {point} at {x:?}: slope {found} and {slope}");
            }
        }
    }
}

#[test]
fn one_point_alone_gives_the_same_bits() {
    for surrogate in [all().0, mixed(), ten_polynomials(), ten_radial(Kernel::ThinPlate, false), ten_radial(Kernel::Cubic, true)] {
        let bytes = encode(&surrogate).unwrap();
        let file = open(&bytes).unwrap();
        let x: Vec<f64> = surrogate.variables.iter().map(|v| v.low + 0.3 * (v.high - v.low)).collect();
        let mut values = vec![0.0; surrogate.points.len()];
        file.evaluate(&x, &mut values).unwrap();
        for (point, value) in values.iter().enumerate() {
            assert_eq!(file.evaluate_point(&x, point).unwrap().to_bits(), value.to_bits());
        }
    }
}

/// The runtime and the plain evaluation of the fit are written independently of each other.
#[test]
fn runtime_agrees_with_the_fit_over_the_whole_range() {
    let mut random = Random(11);
    for surrogate in [all().0, mixed(), ten_polynomials(), ten_radial(Kernel::ThinPlate, true), ten_radial(Kernel::Gaussian, false)] {
        let bytes = encode(&surrogate).unwrap();
        let file = open(&bytes).unwrap();
        let mut values = vec![0.0; surrogate.points.len()];
        for _ in 0..200 {
            let x: Vec<f64> = surrogate.variables.iter().map(|v| v.low + 0.5 * (1.0 + random.signed()) * (v.high - v.low)).collect();
            file.evaluate(&x, &mut values).unwrap();
            for (point, value) in values.iter().enumerate() {
                let expected = evaluate(&surrogate, point, &x).unwrap();
                assert!(close(*value, expected, 1e-13), "{} at {x:?}: {value} and {expected}", surrogate.points[point].name);
            }
        }
    }
}

#[test]
fn gradients_agree_with_central_differences() {
    let surrogate = ten_radial(Kernel::ThinPlate, true);
    let bytes = encode(&surrogate).unwrap();
    let file = open(&bytes).unwrap();
    let x = [7.1, 19.0, 1800.0, 22.0];
    let mut gradient = [0.0; 4];
    for point in 0..10 {
        file.gradient(&x, point, &mut gradient).unwrap();
        for (v, slope) in gradient.iter().enumerate() {
            // Truncation (h/range)² and rounding eps/(h/range) are both near 1e-10 here.
            let h = 1e-5 * (surrogate.variables[v].high - surrogate.variables[v].low);
            let at = |step: f64| {
                let mut moved = x;
                moved[v] += step;
                file.evaluate_point(&moved, point).unwrap()
            };
            let difference = (at(h) - at(-h)) / (2.0 * h);
            assert!((slope - difference).abs() * h < 1e-5 * 1e-7, "{slope} and {difference}");
        }
    }
}

#[test]
fn many_terms_and_centres_cross_the_blocks() {
    // Every term of three variables to degree 12, and 300 centres.
    let terms: Vec<Vec<u8>> =
        (0..=12u8).flat_map(|a| (0..=12 - a).flat_map(move |b| (0..=12 - a - b).map(move |c| vec![a, b, c]))).collect();
    assert_eq!(terms.len(), 455);
    let mut random = Random(5);
    let coefficients = terms.iter().map(|_| random.signed()).collect();
    let polynomial = PolynomialSpec { transforms: vec![Transform::Identity; 3], terms, coefficients };
    let mut basis = basis(Kernel::Multiquadric);
    basis.centres = (0..300).map(|_| (0..3).map(|_| random.signed()).collect()).collect();
    let weights = (0..300).map(|_| random.signed()).collect();
    let surrogate = SurrogateSpec {
        variables: variables(),
        bases: vec![basis],
        points: vec![point("both", PointModel::Rbf { basis: 0, weights, tail: polynomial }, 0.0)],
        ..Default::default()
    };
    let bytes = encode(&surrogate).unwrap();
    let file = open(&bytes).unwrap();
    for x in CONDITIONS {
        let expected = evaluate(&surrogate, 0, &x).unwrap();
        assert!((file.evaluate_point(&x, 0).unwrap() - expected).abs() < 1e-11, "{x:?}");
    }
}

#[test]
fn wrong_lengths_and_strange_numbers_are_no_panic() {
    let bytes = encode(&mixed()).unwrap();
    let file = open(&bytes).unwrap();
    let mut values = [0.0; 4];
    assert!(file.evaluate(&[1.0], &mut values).is_err());
    assert!(file.evaluate(&[3.0, 1.0, 20.0], &mut values[..3]).is_err());
    assert!(file.evaluate_point(&[3.0, 1.0, 20.0], 4).is_err());
    assert!(file.gradient(&[3.0, 1.0, 20.0], 0, &mut values).is_err());
    for strange in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -1.0, 1e300, -1e300, f64::MIN_POSITIVE, 5e-324] {
        for v in 0..3 {
            let mut x = [3.0, 1.0, 20.0];
            x[v] = strange;
            let inside = v == 1 && (0.0..=100.0).contains(&strange);
            file.evaluate(&x, &mut values).unwrap();
            file.gradient(&x, 1, &mut [0.0; 3]).unwrap();
            assert_eq!(file.in_domain(&x), inside, "{x:?}");
            assert_eq!(file.verdict(&x).state == coldplate_surrogate::verdict::Acceptability::Uncertain, !inside, "{x:?}");
        }
    }
}
