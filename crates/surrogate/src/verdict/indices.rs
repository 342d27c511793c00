//! First-order and total Sobol' indices: which variable and which uncertain parameter decides how warm a point gets, over
//! the fitted ranges and the uncertainty of the machine.
//!
//! The first-order index of a factor is the share of the variance that would go if the factor were known. The total index is the
//! share that would be left if all others were known. Variables are uniform over their ranges, parameters normal. Correlated
//! parameters count as one factor, since indices of dependent factors are not defined. Nearly all of the variance is that of
//! orthonormal polynomials fitted to the rows of a latin hypercube. The rest is estimated from crossings with a second
//! hypercube, by products of differences for the first order and by their squares for the total (A. Saltelli et al., Computer
//! Physics Communications 181 (2010) 259). A factor that never changes a value has indices of zero.

use coldplate_runtime::{Band, Origin, Surrogate};
use nalgebra::DMatrix;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

use super::chaos::{Chaos, ChaosColumn};
use coldplate_base::error::{Error, Result};
use coldplate_base::random::Random;

/// Number of rows of each hypercube, as many again per factor. Chosen: standard errors fall with the root of it.
const ROWS: usize = 16384;
/// Number of rows at which bands are evaluated. Chosen fewer, because a band costs more than a value and varies
/// little.
const BANDS: usize = 1024;
/// Correlation, dimensionless, from which parameters are joined to one factor. Chosen: smaller ones hardly change the
/// indices.
const CORRELATED: f64 = 0.01;

/// A part of a band, as a standard deviation.
type PartOfBand = fn(&Band) -> f64;

/// Errors of an answer beside the factors drawn; the last one stands in some files only.
const ERRORS: [(&str, PartOfBand); 3] =
    [("what the model misses", |band| band.misses), ("fit", |band| band.fit), (super::chances::MESH, |band| band.mesh)];

/// Sobol indices of all points and limits.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SobolIndices {
    /// Factors that were varied.
    pub factors: Vec<Factor>,
    /// One per measurement point, then one per limit.
    pub quantities: Vec<QuantityIndices>,
    /// Largest standard error of any index.
    pub error: f64,
}

/// A factor that moves the values.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Factor {
    /// A variable, a parameter, several parameters that are correlated, `fit`, `the mesh`, or `what the model misses`.
    pub name: String,
    /// Whether the standard deviation is assumed, since the machine file does not state one.
    pub is_assumed: bool,
}

/// A point or limit with its indices.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct QuantityIndices {
    /// Name of the point or limit.
    pub name: String,
    /// Whether it is a limited quantity.
    pub is_limit: bool,
    /// Standard deviation over everything, in the point's unit.
    pub deviation: f64,
    /// One index per factor.
    pub indices: Vec<SobolIndex>,
}

/// Sobol indices of a factor for a quantity, as shares of the quantity's variance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct SobolIndex {
    /// Share of the variance that would go if the factor were known.
    pub first_order: f64,
    /// Share that would be left if all others were known.
    pub total: f64,
}

impl QuantityIndices {
    /// Factors by their total index, the largest first, down to `least`.
    pub fn ranked<'a>(&'a self, factors: &'a [Factor], least: f64) -> Vec<(&'a Factor, SobolIndex)> {
        let mut list: Vec<(&Factor, SobolIndex)> =
            factors.iter().zip(self.indices.iter().copied()).filter(|(_, own)| own.total >= least).collect();
        list.sort_by(|a, b| b.1.total.total_cmp(&a.1.total));
        list
    }
}

/// Numbers that are drawn together: a variable, or parameters that are correlated.
enum Drawn {
    Variable {
        index: usize,
        low: f64,
        high: f64,
    },
    /// Parameters with their mean and the root of their covariance.
    Parameters {
        members: Vec<usize>,
        mean: Vec<f64>,
        root: DMatrix<f64>,
    },
}

impl Drawn {
    fn columns(&self) -> Vec<ChaosColumn> {
        match self {
            Self::Variable { .. } => vec![ChaosColumn::Even],
            Self::Parameters { members, .. } => vec![ChaosColumn::Normal; members.len()],
        }
    }

    fn width(&self) -> usize {
        match self {
            Self::Variable { .. } => 1,
            Self::Parameters { members, .. } => members.len(),
        }
    }

    /// Puts the values that the unit numbers `shares` stand for into a condition and the parameters' deviations.
    fn set(&self, shares: &[f64], x: &mut [f64], z: &mut [f64]) {
        match self {
            Self::Variable { index, low, high } => x[*index] = low + (high - low) * shares[0],
            Self::Parameters { members, mean, root } => {
                let normal = Normal::standard();
                let free: Vec<f64> = shares.iter().map(|share| normal.inverse_cdf(*share)).collect();
                for (row, member) in members.iter().enumerate() {
                    z[*member] = mean[row] + (0..=row).map(|k| root[(row, k)] * free[k]).sum::<f64>();
                }
            }
        }
    }
}

/// Sobol indices over the fitted ranges of the variables without a value in `x`, and over the parameters. The other variables keep
/// the value in `x`.
///
/// # Errors
/// A condition of wrong length; nothing that varies.
pub fn indices(surrogate: &Surrogate<'_>, x: &[Option<f64>]) -> Result<SobolIndices> {
    let varied = surrogate.variable_count();
    if x.len() < varied {
        return Err(Error::input("a condition of this surrogate has another number of values").read(x.len()));
    }
    let (drawn, mut factors) = factors(surrogate, x)?;
    if drawn.is_empty() {
        return Err(Error::input("nothing varies: every variable has a value, and the surrogate knows no parameters")
            .help("leave out the value of a variable"));
    }
    let base: Vec<f64> = x.iter().take(varied).map(|x| x.unwrap_or(0.0)).collect();
    let width: usize = drawn.iter().map(Drawn::width).sum();
    let mut random = Random::new(1);
    let (a, b) = (hypercube(&mut random, width), hypercube(&mut random, width));
    let sampler = Sampler { surrogate, drawn: &drawn, base };
    let at_a = sampler.all(|row| a[row].clone())?;
    let chaos = Chaos::fit(drawn.iter().flat_map(Drawn::columns).collect(), &a, &at_a)?;
    let left_a = left(&chaos, &at_a, |row| a[row].clone());
    let left_b = left(&chaos, &sampler.all(|row| b[row].clone())?, |row| b[row].clone());
    let mut first = 0;
    let crossed = (drawn.iter())
        .map(|own| {
            let range = first..first + own.width();
            first = range.end;
            let at = |row: usize| (0..width).map(|k| if range.contains(&k) { b[row][k] } else { a[row][k] }).collect();
            let values = sampler.all(at)?;
            let moves = (0..at_a[0].len()).map(|q| values.iter().zip(&at_a).any(|(ab, a)| ab[q] != a[q])).collect();
            Ok(Crossed { left: left(&chaos, &values, at), moves, range })
        })
        .collect::<Result<Vec<_>>>()?;
    let beside = sampler.beside(&a)?;
    let errors = &ERRORS[..if surrogate.mesh_half_width(0).is_some() { ERRORS.len() } else { ERRORS.len() - 1 }];
    let sample = Sample { errors, chaos, left: left_a, left_again: left_b, crossed, beside, width };
    let names = surrogate.points().map(|p| (p.name, false)).chain(surrogate.limits().map(|l| (l.name, true)));
    let mut error = 0.0_f64;
    let quantities = names.enumerate().map(|(q, (name, is_limit))| {
        let (deviation, indices, own_error) = sample.shares(q);
        error = error.max(own_error);
        QuantityIndices { name: name.to_owned(), is_limit, deviation, indices }
    });
    let quantities = quantities.collect();
    factors.extend(errors.iter().map(|(name, _)| Factor { name: (*name).into(), is_assumed: false }));
    Ok(SobolIndices { factors, quantities, error })
}

/// Standard error of the mean of some numbers.
fn scatter(numbers: impl Iterator<Item = f64>) -> f64 {
    let (mut count, mut sum, mut squares) = (0.0_f64, 0.0, 0.0);
    for n in numbers {
        (count, sum, squares) = (count + 1.0, sum + n, squares + n * n);
    }
    ((squares - sum * sum / count).max(0.0) / (count - 1.0) / count).sqrt()
}

/// Residuals of the polynomials in every row.
fn left(chaos: &Chaos, values: &[Vec<f64>], shares: impl Fn(usize) -> Vec<f64> + Sync) -> Vec<Vec<f64>> {
    let row = |(row, own): (usize, &Vec<f64>)| own.iter().zip(chaos.at(&shares(row))).map(|(value, fitted)| value - fitted).collect();
    values.par_iter().enumerate().map(row).collect()
}

/// The variables without a value, then the parameters, those that are correlated together.
fn factors(surrogate: &Surrogate<'_>, x: &[Option<f64>]) -> Result<(Vec<Drawn>, Vec<Factor>)> {
    let mut drawn = Vec::new();
    let mut factors = Vec::new();
    for (index, v) in surrogate.variables().enumerate().filter(|(index, _)| x[*index].is_none()) {
        drawn.push(Drawn::Variable { index, low: v.low, high: v.high });
        factors.push(Factor { name: v.name.to_owned(), is_assumed: false });
    }
    let Some(uncertainty) = surrogate.uncertainty() else { return Ok((drawn, factors)) };
    let parameters: Vec<_> = uncertainty.parameters().collect();
    let known = uncertainty.known().map(|(mean, packed)| (mean.iter().collect::<Vec<f64>>(), packed.iter().collect::<Vec<f64>>()));
    let covariance = |i: usize, j: usize| match &known {
        Some((_, packed)) => packed[i.max(j) * (i.max(j) + 1) / 2 + i.min(j)],
        None => f64::from(u8::from(i == j)),
    };
    let is_joined = |i: usize, j: usize| covariance(i, j).abs() > CORRELATED * (covariance(i, i) * covariance(j, j)).sqrt();
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for i in 0..parameters.len() {
        let (joined, mut apart): (Vec<_>, Vec<_>) = groups.into_iter().partition(|group| group.iter().any(|j| is_joined(i, *j)));
        let mut group: Vec<usize> = joined.into_iter().flatten().chain([i]).collect();
        group.sort_unstable();
        apart.push(group);
        groups = apart;
    }
    groups.sort();
    for members in groups {
        let block = DMatrix::from_fn(members.len(), members.len(), |i, j| covariance(members[i], members[j]));
        let root = nalgebra::Cholesky::new(block).ok_or_else(|| Error::numerics("the covariance of the parameters is not positive"))?.l();
        let names: Vec<&str> = members.iter().map(|k| parameters[*k].name).collect();
        let is_assumed = members.iter().all(|k| parameters[*k].origin == Origin::Assumed);
        let mean = members.iter().map(|k| known.as_ref().map_or(0.0, |(mean, _)| mean[*k])).collect();
        factors.push(Factor { name: names.join(" and "), is_assumed });
        drawn.push(Drawn::Parameters { members, mean, root });
    }
    Ok((drawn, factors))
}

/// A latin hypercube: rows of numbers between zero and one, each column with one number in each of as many layers as
/// there are rows.
fn hypercube(random: &mut Random, width: usize) -> Vec<Vec<f64>> {
    let mut rows = vec![vec![0.0; width]; ROWS];
    for column in 0..width {
        for (row, layer) in rows.iter_mut().zip(random.permutation(ROWS)) {
            // Never zero nor one, whose normal deviates are infinite.
            row[column] = (layer as f64 + random.unit().clamp(0.001, 0.999)) / ROWS as f64;
        }
    }
    rows
}

struct Sampler<'a, 'b> {
    surrogate: &'a Surrogate<'b>,
    drawn: &'a [Drawn],
    base: Vec<f64>,
}

impl Sampler<'_, '_> {
    /// Condition and deviations of the parameters that a row of unit numbers stands for.
    fn state(&self, shares: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut x = self.base.clone();
        let mut z = vec![0.0; self.surrogate.uncertainty().map_or(0, |own| own.parameter_count())];
        let mut from = 0;
        for own in self.drawn {
            own.set(&shares[from..from + own.width()], &mut x, &mut z);
            from += own.width();
        }
        (x, z)
    }

    /// Points and limits of every row.
    fn all(&self, shares: impl Fn(usize) -> Vec<f64> + Sync) -> Result<Vec<Vec<f64>>> {
        let row = |row: usize| {
            let (x, z) = self.state(&shares(row));
            let mut values = vec![0.0; self.surrogate.point_count()];
            self.surrogate.evaluate_with(&x, &z, &mut values).map_err(|e| Error::numerics(e.to_string()))?;
            let limits =
                (0..self.surrogate.limit_count()).map(|i| self.surrogate.limit_value(i, &x, &values).map_or(f64::NAN, |l| l.value));
            let limits: Vec<f64> = limits.collect();
            values.extend(limits);
            Ok(values)
        };
        (0..ROWS).into_par_iter().map(row).collect()
    }

    /// Bands of every point and limit at the first rows.
    fn beside(&self, rows: &[Vec<f64>]) -> Result<Vec<Vec<Band>>> {
        let row = |shares: &Vec<f64>| {
            let (x, _) = self.state(shares);
            let points = self.surrogate.point_count();
            let (mut values, mut bands) = (vec![0.0; points], vec![Band::default(); points]);
            self.surrogate.bands(&x, None, &mut values, &mut bands).map_err(|e| Error::numerics(e.to_string()))?;
            let limits = (0..self.surrogate.limit_count())
                .map(|i| self.surrogate.limit_chance(i, &x, None, &values).map_or_else(Band::default, |own| own.band));
            bands.extend(limits);
            Ok(bands)
        };
        rows[..BANDS].par_iter().map(row).collect()
    }
}

/// Rows in which one factor was drawn again.
struct Crossed {
    /// Residuals of the polynomials in these rows.
    left: Vec<Vec<f64>>,
    /// Whether the factor moves each quantity at all.
    moves: Vec<bool>,
    range: std::ops::Range<usize>,
}

struct Sample {
    /// The errors beside the factors drawn.
    errors: &'static [(&'static str, PartOfBand)],
    chaos: Chaos,
    /// Residuals of the polynomials in the rows of the first hypercube.
    left: Vec<Vec<f64>>,
    /// Residuals of the polynomials in rows with every factor drawn again.
    left_again: Vec<Vec<f64>>,
    crossed: Vec<Crossed>,
    beside: Vec<Vec<Band>>,
    width: usize,
}

impl Sample {
    /// Standard deviation of a quantity, its indices, and their largest standard error. There is one index per factor drawn,
    /// then one for each of the errors beside them.
    fn shares(&self, q: usize) -> (f64, Vec<SobolIndex>, f64) {
        let rows = ROWS as f64;
        let left = self.left.iter().map(|row| row[q].powi(2)).sum::<f64>() / rows;
        let drawn = self.chaos.variances(q, &(0..self.width)).0 + left;
        // An error of deviation s(x) adds s(x) e: its first-order share is that of the mean of s, its total share that of the
        // mean of s².
        let error_of = |(_, of): &(&str, PartOfBand)| {
            let mean = |of: &dyn Fn(&Band) -> f64| self.beside.iter().map(|bands| of(&bands[q])).sum::<f64>() / self.beside.len() as f64;
            (mean(&|band| of(band)).powi(2), mean(&|band| of(band).powi(2)))
        };
        let errors: Vec<(f64, f64)> = self.errors.iter().map(error_of).collect();
        let variance = drawn + errors.iter().map(|own| own.1).sum::<f64>();
        let share = |part: f64| if variance > 0.0 { part / variance } else { 0.0 };
        let mut error = 0.0_f64;
        let mut indices = Vec::with_capacity(self.crossed.len() + errors.len());
        for own in &self.crossed {
            if !own.moves[q] {
                indices.push(SobolIndex { first_order: 0.0, total: 0.0 });
                continue;
            }
            let (alone, any) = self.chaos.variances(q, &own.range);
            let half_squares = self.left.iter().zip(&own.left).map(|(a, ab)| 0.5 * (a[q] - ab[q]).powi(2));
            let not_fitted = half_squares.clone().sum::<f64>() / rows;
            let pairs = self.left_again.iter().zip(self.left.iter().zip(&own.left));
            let products = pairs.map(|(b, (a, ab))| b[q] * (ab[q] - a[q]));
            let not_fitted_alone = products.clone().sum::<f64>() / rows;
            // The error of a coefficient is the root of the residual variance over the number of rows.
            let of_coefficients = 2.0 * (share(any) * share(left) / rows).sqrt();
            error = error.max(share(scatter(half_squares).max(scatter(products))).hypot(of_coefficients));
            let total = share(any + not_fitted);
            indices.push(SobolIndex { first_order: share(alone + not_fitted_alone).clamp(0.0, total), total });
        }
        indices.extend(errors.into_iter().map(|(first, total)| SobolIndex { first_order: share(first), total: share(total) }));
        (variance.sqrt(), indices, error)
    }
}
