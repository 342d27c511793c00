//! Values at many conditions at once.
//!
//! Eight conditions go side by side: every monomial and every kernel is computed for all eight, so that the processor's
//! wide registers are full whatever the number of points. The order of additions follows [`Surrogate::evaluate`]: the
//! values are equal to the last bit.

use crate::belief::Known;
use crate::evaluate::{BLOCK, POWERS, kernel_values};
use crate::format::MAX_VARIABLES;
use crate::model::{Basis, Polynomial, Scaling, TRANSFORMS};
use crate::shape::{ShapeError, check};
use crate::surrogate::Surrogate;

/// Number of conditions computed side by side (count): eight doubles fill one register of 512 bits or two of 256 bits.
const LANES: usize = 8;
/// Number of points summed side by side (count). Chosen: as many as leave registers for the rest of the loop.
const WIDTH: usize = 5;
/// Number of pairs of variables (count).
const PAIRS: usize = MAX_VARIABLES / 2;

type Lane = [f64; LANES];

/// Working memory of a block. The memory is too large for a controller's stack; the caller provides it.
#[derive(Debug, Clone)]
pub struct Room {
    /// Products of powers of both variables of a pair, indexed by the byte of their exponents.
    products: [[Lane; POWERS * POWERS]; PAIRS],
    /// Monomials or kernels of the present terms or centres.
    factors: [Lane; BLOCK],
}

impl Default for Room {
    fn default() -> Self {
        Self { products: [[[0.0; LANES]; POWERS * POWERS]; PAIRS], factors: [[0.0; LANES]; BLOCK] }
    }
}

impl Surrogate<'_> {
    /// The values of all points at many conditions, row by row: `x` has the variables of one condition after the other,
    /// `values` the points. The values equal those of [`Surrogate::evaluate`] to the last bit. Inlined: a caller that
    /// finds wide registers at run time gets code for them.
    ///
    /// # Errors
    /// `x` does not have a whole number of conditions, or `values` does not have one place per point for each
    /// condition.
    #[inline(always)]
    pub fn evaluate_batch(&self, x: &[f64], values: &mut [f64], room: &mut Room) -> Result<(), ShapeError> {
        let (variables, points) = (self.variables.len(), self.points.len());
        let conditions = x.len().checked_div(variables).unwrap_or(0);
        check("numbers of the conditions", conditions * variables, x.len())?;
        check("places for the values", conditions * points, values.len())?;
        if points == 0 || variables == 0 {
            return Ok(());
        }
        let whole = conditions - conditions % LANES;
        // A loop and no closure: a closure would not have the wide registers of the caller.
        for (x, values) in x.chunks_exact(LANES * variables).zip(values.chunks_exact_mut(LANES * points)) {
            self.evaluate_eight(x, values, room);
        }
        let rest = x.chunks_exact(variables).zip(values.chunks_exact_mut(points)).skip(whole);
        for (x, values) in rest {
            self.evaluate_fit(x, values)?;
        }
        if let Some(uncertainty) = self.learnt() {
            let known = Known::File(uncertainty);
            let rows = x.chunks_exact(variables).zip(values.chunks_exact_mut(points));
            rows.for_each(|(x, values)| self.here(uncertainty, x).shift(&known, values));
        }
        Ok(())
    }

    /// The scaled variables of eight conditions under each transform that a model uses.
    #[inline(always)]
    fn scale_eight(&self, x: &[f64], variables: usize) -> [[Lane; MAX_VARIABLES]; 3] {
        let mut scaled = [[[0.0; LANES]; MAX_VARIABLES]; 3];
        for (transform, (scaled, scaling)) in TRANSFORMS.into_iter().zip(scaled.iter_mut().zip(&self.scaling)) {
            for (v, (u, scaling)) in scaled.iter_mut().zip(scaling).enumerate().take(variables) {
                let Some(Scaling { low, factor, offset }) = scaling else { continue };
                for (u, x) in u.iter_mut().zip(x.iter().skip(v).step_by(variables)) {
                    *u = transform.apply(*x);
                }
                for u in u {
                    *u = (*u - low) * factor + offset;
                }
            }
        }
        scaled
    }

    #[inline(always)]
    fn evaluate_eight(&self, x: &[f64], values: &mut [f64], room: &mut Room) {
        let (variables, points) = (self.variables.len(), self.points.len());
        let scaled = self.scale_eight(x, variables);
        values.fill(0.0);
        for polynomial in self.polynomials() {
            let u = picked(polynomial.transforms, &scaled);
            let bytes = variables.div_ceil(2);
            products(&polynomial, &u, bytes, &mut room.products);
            let mut done = 0;
            while done < polynomial.terms {
                let count = BLOCK.min(polynomial.terms - done);
                let exponents = polynomial.exponents.get(done * bytes..).unwrap_or(&[]);
                for (bytes, factor) in exponents.chunks_exact(bytes).zip(&mut room.factors[..count]) {
                    let mut entries = bytes.iter().zip(&room.products).map(|(byte, table)| &table[usize::from(*byte)]);
                    let mut product = *entries.next().unwrap_or(&[1.0; LANES]);
                    for entry in entries {
                        for k in 0..LANES {
                            product[k] *= entry[k];
                        }
                    }
                    *factor = product;
                }
                let table = polynomial.coefficients.0.get(done * polynomial.points.0.len()..).unwrap_or(&[]);
                add_columns(&room.factors[..count], table, polynomial.points.0, points, values);
                done += count;
            }
        }
        for basis in self.bases() {
            let u = picked(basis.transforms, &scaled);
            let mut done = 0;
            while done < basis.count {
                let count = BLOCK.min(basis.count - done);
                kernels(&basis, &u[..variables.min(MAX_VARIABLES)], done, &mut room.factors[..count]);
                let table = basis.weights.0.get(done * basis.points.0.len()..).unwrap_or(&[]);
                add_columns(&room.factors[..count], table, basis.points.0, points, values);
                done += count;
            }
        }
    }
}

#[inline(always)]
fn picked(transforms: &[u8], scaled: &[[Lane; MAX_VARIABLES]; 3]) -> [Lane; MAX_VARIABLES] {
    let mut u = [[0.0; LANES]; MAX_VARIABLES];
    for (v, (u, code)) in u.iter_mut().zip(transforms).enumerate() {
        *u = scaled[usize::from(*code).min(2)][v];
    }
    u
}

/// Products of powers up to the degree, indexed by the byte of both exponents: the even variable's in its low half.
#[inline(always)]
fn products(polynomial: &Polynomial<'_>, u: &[Lane; MAX_VARIABLES], pairs: usize, tables: &mut [[Lane; POWERS * POWERS]; PAIRS]) {
    let degree = polynomial.degree.min(POWERS - 1);
    for (pair, table) in u.as_chunks::<2>().0.iter().zip(tables).take(pairs) {
        let mut powers = [[1.0; LANES]; POWERS];
        for e in 1..=degree {
            powers[e] = powers[e - 1];
            for k in 0..LANES {
                powers[e][k] *= pair[0][k];
            }
        }
        let mut odd_power = [1.0; LANES];
        for odd in 0..=degree {
            for even in 0..=degree - odd {
                let mut entry = powers[even];
                for k in 0..LANES {
                    entry[k] *= odd_power[k];
                }
                table[odd * POWERS + even] = entry;
            }
            for k in 0..LANES {
                odd_power[k] *= pair[1][k];
            }
        }
    }
}

/// The kernels of the centres from `start`, one per place of `factors`.
#[inline(always)]
fn kernels(basis: &Basis<'_>, u: &[Lane], start: usize, factors: &mut [Lane]) {
    for (centre, factor) in (start..).zip(factors.iter_mut()) {
        let mut squares = [0.0; LANES];
        for (v, (u, scale)) in u.iter().zip(basis.scales.iter()).enumerate() {
            let coordinate = basis.centres.at(v * basis.count + centre);
            for k in 0..LANES {
                let d = (u[k] - coordinate) * scale;
                squares[k] += d * d;
            }
        }
        *factor = squares;
    }
    kernel_values(basis.kernel, factors.as_flattened_mut());
}

/// Adds the sums of factors times the columns of a table to the values of its points.
#[inline(always)]
fn add_columns(factors: &[Lane], table: &[[u8; 8]], columns: &[[u8; 2]], points: usize, values: &mut [f64]) {
    let count = columns.len();
    let (full, rest) = columns.as_chunks::<WIDTH>();
    for (group, own) in full.iter().enumerate() {
        add_some::<WIDTH>(factors, table.get(group * WIDTH..).unwrap_or(&[]), count, own, points, values);
    }
    for (column, own) in rest.iter().enumerate() {
        let from = full.len() * WIDTH + column;
        add_some::<1>(factors, table.get(from..).unwrap_or(&[]), count, &[*own], points, values);
    }
}

#[inline(always)]
fn add_some<const W: usize>(factors: &[Lane], table: &[[u8; 8]], columns: usize, own: &[[u8; 2]; W], points: usize, values: &mut [f64]) {
    let mut sums = [[0.0; LANES]; W];
    for (row, factor) in factors.iter().enumerate() {
        let Some(row) = table.get(row * columns..).and_then(<[[u8; 8]]>::first_chunk::<W>) else { break };
        for (sum, entry) in sums.iter_mut().zip(row) {
            let entry = f64::from_le_bytes(*entry);
            for k in 0..LANES {
                sum[k] += factor[k] * entry;
            }
        }
    }
    for (point, sum) in own.iter().zip(&sums) {
        let point = usize::from(u16::from_le_bytes(*point));
        for (value, sum) in values.iter_mut().skip(point).step_by(points).zip(sum) {
            *value += sum;
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::boxed::Box;
    use std::path::Path;
    use std::vec::Vec;

    use super::*;
    use crate::direction::Band;

    #[test]
    fn batches_have_the_bits_of_single_conditions() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
        let mut tried = 0;
        for entry in std::fs::read_dir(folder).expect("the fixtures are there") {
            let path = entry.expect("the folder can be read").path();
            let bytes = std::fs::read(&path).expect("the fixtures can be read");
            let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
            let ranges: Vec<_> = surrogate.variables().map(|own| (own.low, own.high)).collect();
            let (variables, points, rows) = (surrogate.variable_count(), surrogate.point_count(), 1003);
            // Multiples of irrational numbers fill the ranges evenly, and a little beyond.
            let share = |row: usize, v: usize| (0.618_033_988_749_895 * (v + 1) as f64 * row as f64) % 1.0 * 1.2 - 0.1;
            let x: Vec<f64> = (0..rows)
                .flat_map(|row| ranges.iter().enumerate().map(move |(v, (low, high))| (low + share(row, v) * (high - low)).max(0.5 * low)))
                .collect();
            let (mut found, mut expected) = (std::vec![0.0; rows * points], std::vec![0.0; rows * points]);
            let mut room = Box::<Room>::default();
            surrogate.evaluate_batch(&x, &mut found, &mut room).expect("the shapes fit");
            for (x, values) in x.chunks_exact(variables).zip(expected.chunks_exact_mut(points)) {
                surrogate.evaluate(x, values).expect("the shapes fit");
                let (mut own, mut bands) = (std::vec![0.0; points], std::vec![Band::default(); points]);
                let mut their_bands = bands.clone();
                let (query, later) = (surrogate.query(x, &mut own), surrogate.verdict_at(x, values));
                assert_eq!(std::format!("{query:?}"), std::format!("{later:?}"));
                let chance = surrogate.assess(x, None, 0.9, &mut own, &mut bands);
                let later = surrogate.chance_at(x, 0.9, values, Some(&mut their_bands));
                assert_eq!(std::format!("{chance:?} {bands:?}"), std::format!("{later:?} {their_bands:?}"));
            }
            let same = found.iter().zip(&expected).all(|(a, b)| a.to_bits() == b.to_bits());
            assert!(same, "{}", path.display());
            assert!(surrogate.evaluate_batch(&x[1..], &mut found, &mut room).is_err() || variables == 1);
            assert!(surrogate.evaluate_batch(&x, &mut found[1..], &mut room).is_err());
            tried += 1;
        }
        assert!(tried >= 12, "{tried}");
    }
}
