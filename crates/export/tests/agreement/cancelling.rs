//! Files that single precision does not do for as it is: bases whose weights are large and cancel, and a value that is far too large.

use std::path::Path;

use coldplate_runtime::format::crc32;
use coldplate_runtime::{Basis, Kernel, Surrogate, Transform};

use crate::Random;

/// The numbers of a file, to be changed.
struct Numbers {
    bytes: Vec<u8>,
    start: usize,
    all: Vec<f64>,
}

impl Numbers {
    /// docs/reference/surrogate-format.md says where they are.
    fn of(bytes: &[u8]) -> Self {
        let at = |place: usize| usize::from(u16::from_le_bytes([bytes[place], bytes[place + 1]]));
        let records = [(10, 8), (16, 8), (18, 28), (20, 16), (22, 16), (24, 16), (26, 8)];
        let end: usize = 48 + records.map(|(place, length)| at(place) * length).iter().sum::<usize>();
        let start = end.next_multiple_of(8);
        let count = at(32) + (at(34) << 16);
        let all = bytes[start..].as_chunks::<8>().0[..count].iter().map(|number| f64::from_le_bytes(*number)).collect();
        Self { bytes: bytes.to_vec(), start, all }
    }

    fn into_file(mut self) -> Vec<u8> {
        for (place, number) in self.bytes[self.start..].as_chunks_mut::<8>().0.iter_mut().zip(&self.all) {
            *place = number.to_le_bytes();
        }
        let end = self.bytes.len() - 4;
        let sum = crc32(&self.bytes[..end]);
        self.bytes[end..].copy_from_slice(&sum.to_le_bytes());
        self.bytes
    }
}

fn fixture(name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../runtime/fixtures");
    std::fs::read(folder.join(format!("{name}.cps"))).expect("the fixtures can be read")
}

/// A file for every kernel.
pub fn cancelling() -> Vec<(String, Vec<u8>)> {
    let kernels = ["thin-plate", "cubic", "multiquadric", "gaussian"];
    kernels.map(|kernel| (format!("cancelling-{kernel}"), with_large_weights(&fixture(&format!("bench-{kernel}"))))).into()
}

/// Every other centre comes beside the one before it, and both get large weights of opposite sign, as fits of smooth answers have them.
fn with_large_weights(bytes: &[u8]) -> Vec<u8> {
    let surrogate = Surrogate::open(bytes).expect("the fixtures are intact");
    let basis = surrogate.bases().next().expect("the file has one basis");
    let (variables, points, columns) = (surrogate.variable_count(), surrogate.point_count(), basis.points.iter().len());
    let mut numbers = Numbers::of(bytes);
    let tests = numbers.all.len() - surrogate.self_tests().count() * (variables + points);
    let weights = tests - basis.count * columns;
    let centres = weights - variables - variables * basis.count;
    assert!(numbers.all[weights] == basis.weight(0, 0) && numbers.all[centres] == basis.coordinate(0, 0));
    let mut random = Random(11);
    let before = numbers.all.clone();
    for k in (1..basis.count).step_by(2) {
        for v in 0..variables {
            let row = centres + v * basis.count;
            numbers.all[row + k] = numbers.all[row + k - 1] + if v == 0 { 1e-6 } else { 0.0 };
        }
        for c in 0..columns {
            let weight = 2e5 * (random.unit() - 0.5);
            numbers.all[weights + (k - 1) * columns + c] += weight;
            numbers.all[weights + k * columns + c] -= weight;
        }
    }
    for (test, own) in surrogate.self_tests().enumerate() {
        let x: Vec<f64> = own.condition.iter().collect();
        let sums = |all: &[f64]| sums(&surrogate, &basis, &all[centres..], &all[weights..], &x);
        for (point, (now, before)) in basis.points.iter().zip(sums(&numbers.all).iter().zip(sums(&before))) {
            numbers.all[tests + test * (variables + points) + variables + point] += now - before;
        }
    }
    numbers.into_file()
}

/// Largest sum of the sizes of the terms that bases add to a point at a condition.
pub fn size(surrogate: &Surrogate<'_>, x: &[f64]) -> f64 {
    let of_basis = |basis: Basis<'_>| {
        let columns = basis.points.iter().len();
        let centres: Vec<f64> =
            (0..x.len()).flat_map(|v| (0..basis.count).map(move |k| (k, v))).map(|(k, v)| basis.coordinate(k, v)).collect();
        let kernels = kernels(surrogate, &basis, &centres, x);
        let sum = |c: usize| kernels.iter().enumerate().map(|(k, kernel)| (kernel * basis.weight(k, c)).abs()).sum::<f64>();
        (0..columns).map(sum).fold(0.0, f64::max)
    };
    surrogate.bases().map(of_basis).fold(0.0, f64::max)
}

/// What a basis adds to its points, of these centres and weights.
fn sums(surrogate: &Surrogate<'_>, basis: &Basis<'_>, centres: &[f64], weights: &[f64], x: &[f64]) -> Vec<f64> {
    let columns = basis.points.iter().len();
    let kernels = kernels(surrogate, basis, centres, x);
    (0..columns).map(|c| kernels.iter().enumerate().map(|(k, kernel)| kernel * weights[k * columns + c]).sum()).collect()
}

/// Kernel of each of these centres at a condition.
fn kernels(surrogate: &Surrogate<'_>, basis: &Basis<'_>, centres: &[f64], x: &[f64]) -> Vec<f64> {
    let scaled = |(v, x): (usize, &f64)| {
        let transform = basis.transform(v);
        let own = surrogate.scaling(transform, v).expect("the basis asks for it");
        let g = match transform {
            Transform::Identity => *x,
            Transform::Reciprocal => 1.0 / x,
            Transform::Log => x.ln(),
        };
        (g - own.low) * own.factor + own.offset
    };
    let u: Vec<f64> = x.iter().enumerate().map(scaled).collect();
    let kernel = |k: usize| {
        let distances = u.iter().zip(basis.scales.iter()).enumerate().map(|(v, (u, scale))| (u - centres[v * basis.count + k]) * scale);
        let square: f64 = distances.map(|d| d * d).sum();
        match basis.kernel {
            Kernel::ThinPlate => 0.5 * square * square.max(f64::MIN_POSITIVE).ln(),
            Kernel::Cubic => square * square.sqrt(),
            Kernel::Multiquadric => (1.0 + square).sqrt(),
            Kernel::Gaussian => (-square).exp(),
        }
    };
    (0..basis.count).map(kernel).collect()
}

/// A polynomial whose first point is so large that single precision has no digit behind its point, and the point's name.
pub fn too_large() -> (Vec<u8>, String) {
    const RAISED: f64 = 1e8;
    let bytes = fixture("polynomial");
    let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
    let (variables, points) = (surrogate.variable_count(), surrogate.point_count());
    let polynomial = surrogate.polynomials().next().expect("every file has one");
    let is_constant = |term: &usize| (0..variables).all(|v| polynomial.exponent(*term, v) == 0);
    let term = (0..polynomial.terms).find(is_constant).expect("the polynomial has a constant");
    let point = polynomial.points.iter().next().expect("a polynomial has a point");
    let mut numbers = Numbers::of(&bytes);
    let coefficients = 2 * variables + points + surrogate.limit_count();
    let place = coefficients + term * polynomial.points.iter().len();
    assert_eq!(numbers.all[place], polynomial.coefficient(term, 0));
    numbers.all[place] += RAISED;
    let tests = surrogate.self_tests().count();
    let first = numbers.all.len() - tests * (variables + points) + variables + point;
    for test in 0..tests {
        numbers.all[first + test * (variables + points)] += RAISED;
    }
    let name = surrogate.point(point).expect("the point is there").name.to_owned();
    (numbers.into_file(), name)
}
