//! Sobol' sequence in up to ten dimensions.
//!
//! Primitive polynomials and initial direction numbers: S. Joe, F. Y. Kuo, Constructing Sobol sequences with
//! better two-dimensional projections, SIAM J. Sci. Comput. 30 (2008) 2635-2654, file new-joe-kuo-6.21201.
//! Points come in the Gray-code order of Antonov and Saleev (1979), the order most programs use.

use coldplate_base::error::{Error, Result};
use coldplate_base::random::Random;

/// Largest number of dimensions, count; the table below has no more.
pub const DIMENSIONS: usize = 10;

/// Bits of a coordinate, count: width of the integers of the sequence.
const BITS: usize = 32;

/// Degree, inner coefficients and initial direction numbers of dimensions 2 to 10, from the file of Joe and Kuo.
const JOE_KUO: [(usize, u32, &[u32]); DIMENSIONS - 1] = [
    (1, 0, &[1]),
    (2, 1, &[1, 3]),
    (3, 1, &[1, 3, 1]),
    (3, 2, &[1, 1, 1]),
    (4, 1, &[1, 1, 3, 3]),
    (4, 4, &[1, 3, 5, 13]),
    (5, 2, &[1, 1, 5, 5, 17]),
    (5, 4, &[1, 1, 5, 5, 5]),
    (5, 7, &[1, 1, 7, 11, 19]),
];

/// Direction numbers of one dimension, as 32-bit binary fractions.
fn directions(dimension: usize) -> [u32; BITS] {
    let mut v = [0; BITS];
    let Some(&(degree, inner, initial)) = dimension.checked_sub(1).and_then(|row| JOE_KUO.get(row)) else {
        // The first dimension is the van der Corput sequence.
        for (k, v) in v.iter_mut().enumerate() {
            *v = 1 << (BITS - 1 - k);
        }
        return v;
    };
    for k in 0..BITS {
        v[k] = if k < degree {
            initial[k] << (BITS - 1 - k)
        } else {
            let mut value = v[k - degree] ^ (v[k - degree] >> degree);
            for j in 1..degree {
                if inner >> (degree - 1 - j) & 1 == 1 {
                    value ^= v[k - j];
                }
            }
            value
        };
    }
    v
}

/// The first `count` points in [0, 1)^`dimensions`; with a seed, scrambled by a random digital shift, which keeps
/// the sequence's balance and moves its first point away from the corner.
///
/// # Errors
/// More than ten dimensions, or 2³² points or more.
pub fn points(count: usize, dimensions: usize, seed: Option<u64>) -> Result<Vec<Vec<f64>>> {
    if dimensions > DIMENSIONS {
        return Err(Error::input(format!("a Sobol' design has at most {DIMENSIONS} variables, this one has {dimensions}"))
            .help("hold some variables, or take a Latin hypercube"));
    }
    if count >= 1 << BITS {
        return Err(Error::input("a Sobol' design has fewer than 2^32 points"));
    }
    let directions: Vec<[u32; BITS]> = (0..dimensions).map(directions).collect();
    let mut rng = seed.map(Random::new);
    let shift: Vec<u32> = (0..dimensions).map(|_| rng.as_mut().map_or(0, |rng| (rng.bits() >> 32) as u32)).collect();
    let mut state = vec![0u32; dimensions];
    let mut points = Vec::with_capacity(count);
    for i in 0..count {
        points.push(state.iter().zip(&shift).map(|(x, s)| f64::from(x ^ s) / 4_294_967_296.0).collect());
        // The Gray codes of i and i + 1 differ in the place of the lowest zero of i.
        let changed = i.trailing_ones() as usize;
        for (x, v) in state.iter_mut().zip(&directions) {
            *x ^= v[changed.min(BITS - 1)];
        }
    }
    Ok(points)
}
