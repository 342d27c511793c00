//! Which variable and which uncertain parameter decides how warm a point gets? First-order and total Sobol' indices over the
//! fitted ranges and the uncertainty of the machine.
//!
//! The first-order index of a factor is the share of the variance that would go if the factor were known; the total index is the
//! share that would be left if all others were known. Variables are even over their ranges, parameters normal. Parameters that
//! are correlated count as one factor, since indices of dependent factors are not defined. The numbers are correlations between
//! two latin hypercubes and their crossings (A. Janon et al., ESAIM: Probability and Statistics 18 (2014) 342).

use coldplate_runtime::{Band, Origin, Surrogate};
use nalgebra::DMatrix;
use rayon::prelude::*;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

use crate::error::{Error, Result};
use crate::foundation::random::Random;

/// Rows of each hypercube.
const ROWS: usize = 16384;
/// Rows at which bands are looked at.
const BANDS: usize = 1024;
/// Parts whose scatter tells how far the indices can be trusted.
const PARTS: usize = 16;
/// Correlations from here on join parameters to one factor.
const CORRELATED: f64 = 0.01;

/// Indices of all points and limits.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Indices {
    /// What was varied.
    pub factors: Vec<Factor>,
    /// One per measurement point, then one per limit.
    pub quantities: Vec<Quantity>,
    /// Largest standard error of any index.
    pub error: f64,
}

/// Something that moves the values.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Factor {
    /// A variable, a parameter, several parameters that are correlated, `fit`, or `what the model misses`.
    pub name: String,
    /// Whether its deviation is assumed, since the machine file says nothing of it.
    pub is_assumed: bool,
}

/// A point or limit with what moves it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quantity {
    /// Name of the point or limit.
    pub name: String,
    /// Whether it is a limited quantity.
    pub is_limit: bool,
    /// Standard deviation over everything, in the point's unit.
    pub deviation: f64,
    /// One index per factor.
    pub indices: Vec<Index>,
}

/// What a factor does to a quantity, as shares of its variance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Index {
    /// Share of the variance that would go if the factor were known.
    pub first_order: f64,
    /// Share that would be left if all others were known.
    pub total: f64,
}

impl Quantity {
    /// Factors by their total index, the largest first, down to `least`.
    pub fn ranked<'a>(&'a self, factors: &'a [Factor], least: f64) -> Vec<(&'a Factor, Index)> {
        let mut list: Vec<(&Factor, Index)> =
            factors.iter().zip(self.indices.iter().copied()).filter(|(_, own)| own.total >= least).collect();
        list.sort_by(|a, b| b.1.total.total_cmp(&a.1.total));
        list
    }
}

/// What is drawn together: a variable, or parameters that are correlated.
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
    fn width(&self) -> usize {
        match self {
            Self::Variable { .. } => 1,
            Self::Parameters { members, .. } => members.len(),
        }
    }

    /// Puts what the unit numbers `shares` stand for into a condition and the parameters' deviations.
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

/// Indices over the fitted ranges of the variables without a value in `x`, the others having theirs, and over the parameters.
///
/// # Errors
/// A condition of wrong length; nothing that varies.
pub fn indices(surrogate: &Surrogate<'_>, x: &[Option<f64>]) -> Result<Indices> {
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
    let at_b = sampler.all(|row| b[row].clone())?;
    let mut first = 0;
    let crossed = (drawn.iter())
        .map(|own| {
            let taken = first..first + own.width();
            first = taken.end;
            let at = |row: usize| (0..width).map(|k| if taken.contains(&k) { b[row][k] } else { a[row][k] }).collect();
            sampler.all(at)
        })
        .collect::<Result<Vec<_>>>()?;
    let beside = sampler.beside(&a)?;
    let names = surrogate.points().map(|p| (p.name, false)).chain(surrogate.limits().map(|l| (l.name, true)));
    let mut error = 0.0_f64;
    let quantities = names.enumerate().map(|(q, (name, is_limit))| {
        let estimate = |rows: std::ops::Range<usize>| shares(&at_a, &at_b, &crossed, &beside, q, rows);
        let (deviation, indices) = estimate(0..ROWS);
        let parts: Vec<Vec<Index>> = (0..PARTS).map(|k| estimate(k * ROWS / PARTS..(k + 1) * ROWS / PARTS).1).collect();
        for place in 0..indices.len() {
            for of in [|own: &Index| own.first_order, |own: &Index| own.total] {
                error = error.max(scatter(parts.iter().map(|part| of(&part[place]))));
            }
        }
        Quantity { name: name.to_owned(), is_limit, deviation, indices }
    });
    let quantities = quantities.collect();
    factors.extend(["what the model misses", "fit"].map(|name| Factor { name: name.into(), is_assumed: false }));
    Ok(Indices { factors, quantities, error })
}

/// Standard error of the mean of some numbers.
fn scatter(numbers: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = PARTS as f64;
    let mean = numbers.clone().sum::<f64>() / count;
    (numbers.map(|n| (n - mean).powi(2)).sum::<f64>() / (count - 1.0) / count).sqrt()
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

/// Rows of numbers between zero and one, each column in as many layers as there are rows.
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

/// Standard deviation of a quantity and its indices, from some of the rows: one per factor drawn, then what the model misses,
/// then the fit.
fn shares(
    a: &[Vec<f64>],
    b: &[Vec<f64>],
    crossed: &[Vec<Vec<f64>>],
    beside: &[Vec<Band>],
    q: usize,
    rows: std::ops::Range<usize>,
) -> (f64, Vec<Index>) {
    let count = rows.len() as f64;
    let mean = rows.clone().map(|r| a[r][q] + b[r][q]).sum::<f64>() / (2.0 * count);
    let square = |r: usize| (a[r][q] - mean).powi(2) + (b[r][q] - mean).powi(2);
    let drawn = rows.clone().map(square).sum::<f64>() / (2.0 * count);
    // An error of deviation s(x) adds s(x) e: its own share is that of the mean of s, its whole share that of the mean of s².
    let error = |of: fn(&Band) -> f64| {
        let sum = beside.iter().map(|bands| of(&bands[q])).sum::<f64>() / beside.len() as f64;
        let squares = beside.iter().map(|bands| of(&bands[q]).powi(2)).sum::<f64>() / beside.len() as f64;
        (sum * sum, squares)
    };
    let errors = [error(|band| band.misses), error(|band| band.fit)];
    let variance = drawn + errors.iter().map(|own| own.1).sum::<f64>();
    let share = |part: f64| if variance > 0.0 { part / variance } else { 0.0 };
    // Rows of `b` and the crossing have the factor in common; rows of `a` and the crossing everything else.
    let of = |ab: &Vec<Vec<f64>>| {
        let correlation = |with: &[Vec<f64>]| {
            let pairs = rows.clone().map(|r| (with[r][q] - mean, ab[r][q] - mean));
            let centre = pairs.clone().map(|(p, q)| 0.5 * (p + q)).sum::<f64>() / count;
            let together = pairs.clone().map(|(p, q)| p * q).sum::<f64>() / count - centre * centre;
            let alone = pairs.map(|(p, q)| 0.5 * (p * p + q * q)).sum::<f64>() / count - centre * centre;
            if alone > 0.0 { together / alone } else { 0.0 }
        };
        Index { first_order: share(drawn * correlation(b)), total: share(drawn * (1.0 - correlation(a))) }
    };
    let errors = errors.map(|(first, total)| Index { first_order: share(first), total: share(total) });
    (variance.sqrt(), crossed.iter().map(of).chain(errors).collect())
}
