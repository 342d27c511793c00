//! All hypotheses and all pairs of them beside the whitened residual, with the look-elsewhere effect.

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::foundation::random::Random;

/// Simulated data sets of pure noise.
const SIMULATIONS: usize = 2000;
/// How many of them go through the screen as one matrix.
const BATCH: usize = 125;
/// A signature shorter than this, whitened and for an amplitude of its prior's scale, cannot show.
const FAINT: f64 = 0.05;

/// The whitened residual beside whitened signatures.
#[derive(Debug, Clone)]
pub struct Screened {
    /// Whitened residual.
    pub residual: Vec<f64>,
    /// Hypotheses that can show, as indices into the catalogue.
    pub visible: Vec<usize>,
    /// Their whitened signatures for an amplitude of the prior's scale, one column each.
    pub columns: DMatrix<f64>,
    /// Scalar products of the signatures with the residual.
    pub along: Vec<f64>,
    /// Scalar products among signatures.
    pub gram: DMatrix<f64>,
    /// Whether a negative amplitude means something.
    pub signed: Vec<bool>,
    /// For swaps, which have no amplitude: the residual with the readings permuted.
    pub relabelled: Vec<Option<Relabelled>>,
}

/// The residual with two sensors swapped.
#[derive(Debug, Clone)]
pub struct Relabelled {
    /// Its whitened misfit.
    pub misfit: f64,
    /// Scalar products of all signatures with it.
    pub along: Vec<f64>,
}

impl Screened {
    /// Hypotheses that can show, of their whitened signatures for amplitudes of their prior's scale.
    pub fn visible(signatures: &[Vec<f64>]) -> Vec<usize> {
        let length = |c: &Vec<f64>| c.iter().map(|v| v * v).sum::<f64>().sqrt();
        let is_visible = |h: &usize| length(&signatures[*h]) > FAINT && signatures[*h].iter().all(|v| v.is_finite());
        (0..signatures.len()).filter(is_visible).collect()
    }

    /// From whitened vectors; `signatures` are all hypotheses', the rest is of the visible ones.
    pub fn new(
        visible: Vec<usize>,
        residual: Vec<f64>,
        signatures: &[Vec<f64>],
        signed: Vec<bool>,
        relabelled: Vec<Option<Vec<f64>>>,
    ) -> Self {
        let matrix = DMatrix::from_fn(residual.len(), visible.len(), |i, j| signatures[visible[j]][i]);
        let gram = matrix.transpose() * &matrix;
        let products =
            |v: &[f64]| -> Vec<f64> { (0..visible.len()).map(|j| matrix.column(j).iter().zip(v).map(|(s, r)| s * r).sum()).collect() };
        let along = products(&residual);
        let of = |left: &Vec<f64>| Relabelled { misfit: left.iter().map(|v| v * v).sum(), along: products(left) };
        let relabelled = relabelled.par_iter().map(|left| left.as_ref().map(of)).collect();
        Self { residual, visible, columns: matrix, along, gram, signed, relabelled }
    }

    /// Whether a hypothesis is a swap, without an amplitude.
    pub fn is_fixed(&self, j: usize) -> bool {
        self.relabelled[j].is_some()
    }

    /// Whitened misfit of the machine as it is.
    pub fn misfit(&self) -> f64 {
        self.residual.iter().map(|r| r * r).sum()
    }

    /// Best amplitude of a hypothesis (in its prior's scale) and the misfit it takes away, never less than nothing.
    pub fn single(&self, j: usize) -> (f64, f64) {
        if let Some(left) = &self.relabelled[j] {
            return (1.0, (self.misfit() - left.misfit).max(0.0));
        }
        let (g, b) = (self.gram[(j, j)], self.along[j]);
        let a = b / g;
        if a < 0.0 && !self.signed[j] { (0.0, 0.0) } else { (a, a * b) }
    }

    /// The same of two together.
    pub fn pair(&self, i: usize, j: usize) -> ([f64; 2], f64) {
        let (a, b, c) = (self.gram[(i, i)], self.gram[(i, j)], self.gram[(j, j)]);
        let beside =
            |left: &Relabelled, free: usize, g: f64| (left.along[free] / g, self.misfit() - left.misfit + left.along[free].powi(2) / g);
        let ([x, y], gain) = match (&self.relabelled[i], &self.relabelled[j]) {
            (None, None) => {
                let determinant = a * c - b * b;
                if determinant < 1e-6 * a * c {
                    return ([0.0; 2], 0.0);
                }
                let x = (c * self.along[i] - b * self.along[j]) / determinant;
                let y = (a * self.along[j] - b * self.along[i]) / determinant;
                ([x, y], x * self.along[i] + y * self.along[j])
            }
            // Each as if the other were not: to first order, under the covariance of neither.
            (Some(_), Some(_)) => ([1.0, 1.0], 2.0 * (self.along[i] + self.along[j] - b) - a - c),
            (Some(left), None) => {
                let (y, gain) = beside(left, j, c);
                ([1.0, y], gain)
            }
            (None, Some(left)) => {
                let (x, gain) = beside(left, i, a);
                ([x, 1.0], gain)
            }
        };
        if (x < 0.0 && !self.signed[i]) || (y < 0.0 && !self.signed[j]) { ([0.0; 2], 0.0) } else { ([x, y], gain.max(0.0)) }
    }

    /// Standard deviations of the amplitudes of one or two together, in their priors' scale, priors included.
    pub fn deviations(&self, members: &[usize]) -> Vec<f64> {
        let at = |i: usize, j: usize| self.gram[(members[i], members[j])] + f64::from(u8::from(i == j));
        let free: Vec<usize> = (0..members.len()).filter(|i| !self.is_fixed(members[*i])).collect();
        let mut found = vec![0.0; members.len()];
        if let Some(inverse) = DMatrix::from_fn(free.len(), free.len(), |i, j| at(free[i], free[j])).try_inverse() {
            free.iter().enumerate().for_each(|(i, k)| found[*k] = inverse[(i, i)].max(0.0).sqrt());
        }
        found
    }

    /// Probability that pure noise lets some hypothesis take away as much misfit as the best one does.
    pub fn look_elsewhere(&self, seed: u64) -> f64 {
        let best = (0..self.visible.len()).map(|j| self.single(j).1).fold(0.0, f64::max);
        let n = self.residual.len();
        let signatures = self.columns.transpose();
        let exceeding = |batch: usize| -> usize {
            let first = batch * BATCH;
            let width = BATCH.min(SIMULATIONS - first);
            let mut noise = DMatrix::zeros(n, width);
            for (s, mut column) in noise.column_iter_mut().enumerate() {
                let mut random = Random::new(seed.wrapping_add((first + s) as u64));
                column.iter_mut().for_each(|z| *z = random.normal());
            }
            let along = &signatures * noise;
            let exceeds = |j: usize, b: f64| match (self.is_fixed(j), self.gram[(j, j)]) {
                (true, g) => 2.0 * b - g >= best,
                (false, g) => (b > 0.0 || self.signed[j]) && b * b / g >= best,
            };
            along.column_iter().filter(|column| column.iter().enumerate().any(|(j, b)| exceeds(j, *b))).count()
        };
        let count: usize = (0..SIMULATIONS.div_ceil(BATCH)).into_par_iter().map(exceeding).sum();
        (1 + count) as f64 / (SIMULATIONS + 1) as f64
    }
}
