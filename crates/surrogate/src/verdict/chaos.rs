//! Polynomial chaos: values as a sum of orthonormal polynomials of the random numbers they depend on. The squared coefficients
//! are shares of the variance (B. Sudret, Reliability Engineering and System Safety 93 (2008) 964).

use nalgebra::{Cholesky, DMatrix};
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};

use coldplate_base::error::{Error, Result};

/// Highest degree in one variable by itself. Chosen: more terms leave less variance to the sampled rest, but cost
/// more to fit.
const VARIABLE: usize = 8;
/// Highest degree in one parameter by itself. Chosen lower, because readings are nearly linear in parameters.
const PARAMETER: usize = 3;
/// Highest sum of degrees of two variables. Chosen: the number of terms grows with its square.
const TWO_VARIABLES: usize = 5;
/// Highest sum of degrees of a parameter and a variable. Chosen lower, because readings are nearly linear in parameters.
const PARAMETER_AND_VARIABLE: usize = 3;
/// Number of rows of one task. Chosen: the sums have a fixed order whatever the number of threads.
const BLOCK: usize = 1024;

/// Distribution that a column of unit numbers stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum ChaosColumn {
    /// Uniform between the ends.
    Even,
    /// Standard normal.
    Normal,
}

/// Columns and their degrees in one product; the second has degree 0 where there is none.
type Term = [(usize, usize); 2];

/// The terms and, per term and quantity, the coefficients.
pub(super) struct Chaos {
    columns: Vec<ChaosColumn>,
    terms: Vec<Term>,
    coefficients: DMatrix<f64>,
}

impl Chaos {
    /// Fits `values` (one row per row of `shares`) by least squares.
    pub(super) fn fit(columns: Vec<ChaosColumn>, shares: &[Vec<f64>], values: &[Vec<f64>]) -> Result<Self> {
        let terms = terms(&columns);
        let quantities = values.first().map_or(0, Vec::len);
        let sums = shares.par_chunks(BLOCK).zip(values.par_chunks(BLOCK)).map(|(shares, values)| {
            let mut at = DMatrix::zeros(terms.len(), shares.len());
            shares.iter().enumerate().for_each(|(row, own)| at.column_mut(row).copy_from_slice(&products(&columns, &terms, own)));
            let values = DMatrix::from_fn(shares.len(), quantities, |row, q| values[row][q]);
            (&at * at.transpose(), at * values)
        });
        // Sums in the order of the rows, so that every run gives the same numbers.
        let sums: Vec<_> = sums.collect();
        let mut square = DMatrix::zeros(terms.len(), terms.len());
        let mut right = DMatrix::zeros(terms.len(), quantities);
        for (own_square, own_right) in &sums {
            square += own_square;
            right += own_right;
        }
        let factor = Cholesky::new(square).ok_or_else(|| Error::numerics("too few rows for the polynomials of the indices"))?;
        Ok(Self { coefficients: factor.solve(&right), columns, terms })
    }

    /// The polynomials' values at a row.
    pub(super) fn at(&self, shares: &[f64]) -> Vec<f64> {
        let products = products(&self.columns, &self.terms, shares);
        self.coefficients.column_iter().map(|own| own.iter().zip(&products).map(|(c, p)| c * p).sum()).collect()
    }

    /// Variance of a quantity by terms in columns of `range` alone, and by terms in any of them.
    pub(super) fn variances(&self, q: usize, range: &std::ops::Range<usize>) -> (f64, f64) {
        let (mut alone, mut any) = (0.0, 0.0);
        for (term, c) in self.terms.iter().zip(self.coefficients.column(q).iter()) {
            let mut used = term.iter().filter(|(_, degree)| *degree > 0).map(|(column, _)| range.contains(column)).peekable();
            if used.peek().is_none() {
                continue;
            }
            let (is_alone, is_any) = used.fold((true, false), |(all, any), own| (all && own, any || own));
            alone += if is_alone { c * c } else { 0.0 };
            any += if is_any { c * c } else { 0.0 };
        }
        (alone, any)
    }
}

/// A constant, polynomials of each column, and products of two columns.
fn terms(columns: &[ChaosColumn]) -> Vec<Term> {
    let mut terms = vec![[(0, 0); 2]];
    for (i, own) in columns.iter().enumerate() {
        let highest = if *own == ChaosColumn::Even { VARIABLE } else { PARAMETER };
        terms.extend((1..=highest).map(|degree| [(i, degree), (0, 0)]));
        for (j, other) in columns.iter().enumerate().skip(i + 1) {
            let (sum, most) = match (own, other) {
                (ChaosColumn::Even, ChaosColumn::Even) => (TWO_VARIABLES, TWO_VARIABLES),
                (ChaosColumn::Normal, ChaosColumn::Normal) => continue,
                _ => (PARAMETER_AND_VARIABLE, 1),
            };
            // Variables come before parameters.
            for k in 1..sum {
                terms.extend((1..=(sum - k).min(most)).map(|l| [(i, k), (j, l)]));
            }
        }
    }
    terms
}

/// Every term at a row of unit numbers.
fn products(columns: &[ChaosColumn], terms: &[Term], shares: &[f64]) -> Vec<f64> {
    let normal = Normal::standard();
    let powers: Vec<[f64; VARIABLE + 1]> = (columns.iter().zip(shares))
        .map(|(column, share)| match column {
            ChaosColumn::Even => legendre(2.0 * share - 1.0),
            ChaosColumn::Normal => hermite(normal.inverse_cdf(*share)),
        })
        .collect();
    terms.iter().map(|[(i, k), (j, l)]| powers[*i][*k] * powers[*j][*l]).collect()
}

/// Legendre polynomials, orthonormal for the uniform distribution on [-1, 1].
fn legendre(x: f64) -> [f64; VARIABLE + 1] {
    let mut p = [1.0; VARIABLE + 1];
    p[1] = x;
    for n in 1..VARIABLE {
        let k = n as f64;
        p[n + 1] = ((2.0 * k + 1.0) * x * p[n] - k * p[n - 1]) / (k + 1.0);
    }
    p.iter_mut().enumerate().for_each(|(n, p)| *p *= (2.0 * n as f64 + 1.0).sqrt());
    p
}

/// Hermite polynomials, orthonormal for the standard normal distribution.
fn hermite(x: f64) -> [f64; VARIABLE + 1] {
    let mut p = [1.0; VARIABLE + 1];
    p[1] = x;
    for n in 1..VARIABLE {
        let k = n as f64;
        p[n + 1] = (x * p[n] - k.sqrt() * p[n - 1]) / (k + 1.0).sqrt();
    }
    p
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_orthonormal() {
        let rows = 200_000;
        let shares = |n: usize| (n as f64 + 0.5) / rows as f64;
        let normal = Normal::standard();
        let even: Vec<_> = (0..rows).map(|n| legendre(2.0 * shares(n) - 1.0)).collect();
        let bell: Vec<_> = (0..rows).map(|n| hermite(normal.inverse_cdf(shares(n)))).collect();
        for (i, j) in [(0, 1), (1, 1), (2, 2), (1, 3), (3, 3), (2, 4)] {
            let mean = |all: &[[f64; VARIABLE + 1]]| all.iter().map(|p| p[i] * p[j]).sum::<f64>() / rows as f64;
            let expected = f64::from(u8::from(i == j));
            assert!((mean(&even) - expected).abs() < 1e-6, "{i} {j}");
            assert!((mean(&bell) - expected).abs() < 0.02, "{i} {j}: {}", mean(&bell));
        }
    }
}
