//! All hypotheses and all pairs of them beside the whitened residual, with the look-elsewhere effect.

use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use coldplate_base::random::Random;
use coldplate_evidence::identify::chi_square_tail;

/// Simulated data sets of pure noise.
pub const SIMULATIONS: usize = 2000;
/// Where fewer of them than this would exceed what was found, none is made.
const NEVER: f64 = 1e-9;
/// How many of them go through the screen as one matrix.
const BATCH: usize = 125;
/// Columns that are multiplied with all before them as one matrix.
const GRAM: usize = 256;
/// Two signatures are one where the determinant of their products is less than this, of unit squares.
const LEAST_DETERMINANT: f64 = 1e-6;
/// A signature shorter than this, whitened and for an amplitude of its prior's scale, cannot show.
const FAINT: f64 = 0.05;
/// What is left of a signature's square beside causes that are in force, as a share of it, for it to be another one.
const DISTINCT: f64 = 0.01;

/// The whitened residual beside whitened signatures.
#[derive(Debug, Clone)]
pub(crate) struct Screened {
    /// Whitened residual.
    pub residual: Vec<f64>,
    /// Hypotheses that can show, as indices into the catalogue.
    pub visible: Vec<usize>,
    /// Their whitened signatures for an amplitude of the prior's scale, one column each.
    pub columns: DMatrix<f64>,
    /// Scalar products of the signatures with the residual.
    pub along: Vec<f64>,
    /// Square of the residual, and of each signature.
    misfit: f64,
    squares: Vec<f64>,
    /// Scalar products among signatures, where all of them are needed.
    gram: OnceLock<DMatrix<f64>>,
    /// Whether a negative amplitude means something.
    pub signed: Vec<bool>,
    /// Largest amplitude to which slopes are continued, in the prior's scale.
    pub most: Vec<f64>,
    /// For swaps, which have no amplitude: the residual with the readings permuted.
    pub relabelled: Vec<Option<Relabelled>>,
    /// How many laws each was chosen from by these data, and is to be compared with noise beside.
    pub chosen_from: Vec<f64>,
    /// Whether its law is one of those that are looked for only where something is wrong.
    pub is_rare: Vec<bool>,
    /// Whether the prior of its amplitude has tails.
    pub has_tails: Vec<bool>,
}

/// The residual with two sensors swapped.
#[derive(Debug, Clone)]
pub(crate) struct Relabelled {
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
        (signed, most): (Vec<bool>, Vec<f64>),
        relabelled: Vec<Option<Vec<f64>>>,
    ) -> Self {
        let matrix = DMatrix::from_fn(residual.len(), visible.len(), |i, j| signatures[visible[j]][i]);
        let squares = matrix.column_iter().map(|column| column.norm_squared()).collect();
        let along = matrix.tr_mul(&DVector::from_column_slice(&residual)).as_slice().to_vec();
        // All of them through the signatures at once: a product with each one alone takes most of a screen.
        let left: Vec<&Vec<f64>> = relabelled.iter().flatten().collect();
        let products = matrix.transpose() * DMatrix::from_fn(residual.len(), left.len(), |i, k| left[k][i]);
        let mut columns = products.column_iter();
        let mut of = |left: &Vec<f64>| Relabelled {
            misfit: left.iter().map(|v| v * v).sum(),
            along: columns.next().map_or(Vec::new(), |column| column.iter().copied().collect()),
        };
        let relabelled = relabelled.iter().map(|left| left.as_ref().map(&mut of)).collect();
        let (chosen_from, is_rare, has_tails) = (vec![1.0; visible.len()], vec![false; visible.len()], vec![false; visible.len()]);
        let (columns, gram, misfit) = (matrix, OnceLock::new(), residual.iter().map(|r| r * r).sum());
        Self { residual, visible, columns, along, misfit, squares, gram, signed, most, relabelled, chosen_from, is_rare, has_tails }
    }

    /// The same with rarer laws, and from how many each was chosen.
    pub(crate) fn with_rare(self, is_rare: Vec<bool>, chosen_from: Vec<f64>) -> Self {
        Self { is_rare, chosen_from, ..self }
    }

    /// The same with amplitudes whose priors have tails.
    pub(crate) fn with_tails(self, has_tails: Vec<bool>) -> Self {
        Self { has_tails, ..self }
    }

    /// What the tails of its prior give back of the evidence that a normal prior takes from an amplitude (in the prior's scale).
    pub fn tail(&self, j: usize, amplitude: f64) -> f64 {
        let a = amplitude.abs();
        if self.has_tails[j] && a > 1.0 { 0.5 * (a * a - 1.0) - 2.0 * a.ln() } else { 0.0 }
    }

    /// Square of a signature.
    pub fn square(&self, j: usize) -> f64 {
        self.squares[j]
    }

    /// Scalar product of two signatures.
    pub fn product(&self, i: usize, j: usize) -> f64 {
        self.gram.get().map_or_else(|| self.columns.column(i).dot(&self.columns.column(j)), |gram| gram[(i, j)])
    }

    /// Finds the scalar products of all pairs: of many they are found faster together.
    pub(crate) fn find_products(&self) {
        self.gram.get_or_init(|| gram(&self.columns));
    }

    /// Whether a hypothesis is a swap, without an amplitude.
    pub fn is_fixed(&self, j: usize) -> bool {
        self.relabelled[j].is_some()
    }

    /// Whitened misfit of the machine as it is.
    pub fn misfit(&self) -> f64 {
        self.misfit
    }

    /// Best amplitude of a hypothesis (in its prior's scale) and the misfit it takes away, never less than nothing.
    pub fn single(&self, j: usize) -> (f64, f64) {
        if let Some(left) = &self.relabelled[j] {
            return (1.0, (self.misfit() - left.misfit).max(0.0));
        }
        self.best_amplitude(j, self.squares[j], self.along[j])
    }

    /// The misfit that a cause takes away of a residual along which its signature's product is `b`, and the signature's own square `g`.
    pub(crate) fn taken_away(&self, j: usize, g: f64, b: f64) -> f64 {
        self.best_amplitude(j, g, b).1
    }

    fn best_amplitude(&self, j: usize, g: f64, b: f64) -> (f64, f64) {
        if b < 0.0 && !self.signed[j] {
            return (0.0, 0.0);
        }
        let (a, most) = (b / g, self.most[j]);
        if a > most { (most, most * (2.0 * b - most * g)) } else { (a, a * b) }
    }

    /// The same of two together.
    pub fn pair(&self, i: usize, j: usize) -> ([f64; 2], f64) {
        let (a, b, c) = (self.squares[i], self.product(i, j), self.squares[j]);
        let beside =
            |left: &Relabelled, free: usize, g: f64| (left.along[free] / g, self.misfit() - left.misfit + left.along[free].powi(2) / g);
        let ([x, y], gain) = match (&self.relabelled[i], &self.relabelled[j]) {
            (None, None) => return self.pair_beside([i, j], (a, b, c), [self.along[i], self.along[j]]),
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
        if self.is_possible([i, j], [x, y]) { ([x, y], gain.max(0.0)) } else { ([0.0; 2], 0.0) }
    }

    /// What two could take away together if amplitudes had neither sense nor end: no less than [`Screened::pair`], nor than twice the
    /// logarithm of their evidence.
    pub(crate) fn pair_at_most(&self, i: usize, j: usize) -> f64 {
        let beside = |left: &Relabelled, free: usize| self.misfit() - left.misfit + left.along[free].powi(2) / self.squares[free];
        let (a, b, c) = (self.squares[i], self.product(i, j), self.squares[j]);
        let (x, y) = (self.along[i], self.along[j]);
        match (&self.relabelled[i], &self.relabelled[j]) {
            (None, None) => (c * x * x - 2.0 * b * x * y + a * y * y) / (a * c - b * b).max(LEAST_DETERMINANT * a * c),
            (Some(_), Some(_)) => 2.0 * (x + y - b) - a - c,
            (Some(left), None) => beside(left, j),
            (None, Some(left)) => beside(left, i),
        }
    }

    /// The same of two that have amplitudes, of a residual along which their signatures' products are `along`; squares of the signatures
    /// and between them their product.
    pub(crate) fn pair_beside(&self, [i, j]: [usize; 2], (a, b, c): (f64, f64, f64), along: [f64; 2]) -> ([f64; 2], f64) {
        let determinant = a * c - b * b;
        if determinant < LEAST_DETERMINANT * a * c {
            return ([0.0; 2], 0.0);
        }
        let x = (c * along[0] - b * along[1]) / determinant;
        let y = (a * along[1] - b * along[0]) / determinant;
        let ([x, y], gain) = if x <= self.most[i] && y <= self.most[j] {
            ([x, y], x * along[0] + y * along[1])
        } else {
            // Beside what has come to its end the other is free; beyond both ends both stay there.
            let (x, y) = if x > self.most[i] { (self.most[i], (along[1] - b * self.most[i]) / c) } else { (x, y) };
            let (x, y) = if y > self.most[j] { (((along[0] - b * self.most[j]) / a).min(self.most[i]), self.most[j]) } else { (x, y) };
            ([x, y], 2.0 * (x * along[0] + y * along[1]) - (a * x * x + 2.0 * b * x * y + c * y * y))
        };
        if self.is_possible([i, j], [x, y]) { ([x, y], gain.max(0.0)) } else { ([0.0; 2], 0.0) }
    }

    /// Whether amplitudes of two have senses that mean something.
    fn is_possible(&self, [i, j]: [usize; 2], [x, y]: [f64; 2]) -> bool {
        (x >= 0.0 || self.signed[i]) && (y >= 0.0 || self.signed[j])
    }

    /// Standard deviations of the amplitudes of one or two together, in their priors' scale, priors included.
    pub fn deviations(&self, members: &[usize]) -> Vec<f64> {
        let at = |i: usize, j: usize| self.product(members[i], members[j]) + f64::from(u8::from(i == j));
        let free: Vec<usize> = (0..members.len()).filter(|i| !self.is_fixed(members[*i])).collect();
        let mut found = vec![0.0; members.len()];
        if let Some(inverse) = DMatrix::from_fn(free.len(), free.len(), |i, j| at(free[i], free[j])).try_inverse() {
            free.iter().enumerate().for_each(|(i, k)| found[*k] = inverse[(i, i)].max(0.0).sqrt());
        }
        found
    }

    /// Probability that pure noise lets some hypothesis take away as much misfit as the best one does.
    pub fn look_elsewhere(&self, seed: u64) -> f64 {
        // The best of n tries takes away 2 ln n more than one of them.
        let fair = |j: usize| self.single(j).1 - 2.0 * self.chosen_from[j].ln();
        let best = (0..self.visible.len()).map(fair).fold(0.0, f64::max);
        let n = self.residual.len();
        let least = 1.0 / (SIMULATIONS + 1) as f64;
        if (self.visible.len() * SIMULATIONS) as f64 * chi_square_tail(best, 1) < NEVER {
            return least;
        }
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
            let exceeds = |j: usize, b: f64| match (self.is_fixed(j), self.squares[j]) {
                (true, g) => 2.0 * b - g >= best,
                (false, g) => {
                    let gain = if b / g > self.most[j] { self.most[j] * (2.0 * b - self.most[j] * g) } else { b * b / g };
                    (b > 0.0 || self.signed[j]) && gain >= best
                }
            };
            along.column_iter().filter(|column| column.iter().enumerate().any(|(j, b)| exceeds(j, *b))).count()
        };
        let count: usize = (0..SIMULATIONS.div_ceil(BATCH)).into_par_iter().map(exceeding).sum();
        (1 + count) as f64 * least
    }

    /// Probability that pure noise lets some hypothesis take away as much as the best one does of what fitted causes leave: `left` and
    /// their slopes, both whitened as this screen is. Bonferroni's bound over all hypotheses; those without an amplitude are not tried.
    pub(crate) fn look_beside(&self, members: &[usize], left: &[f64], slopes: &[Vec<f64>]) -> f64 {
        let mut own: Vec<DVector<f64>> = Vec::new();
        for slope in slopes {
            let slope = DVector::from_column_slice(slope);
            let rest = own.iter().fold(slope, |rest, q| &rest - q * q.dot(&rest));
            own.extend(rest.try_normalize(0.0));
        }
        let left = own.iter().fold(DVector::from_column_slice(left), |left, q| &left - q * q.dot(&left));
        let along = self.columns.tr_mul(&left);
        let beside: Vec<DVector<f64>> = own.iter().map(|q| self.columns.tr_mul(q)).collect();
        let is_tried = |j: &usize| !members.contains(j) && !self.is_fixed(*j);
        let gain = |j: usize| {
            let (whole, b) = (self.squares[j], along[j]);
            let g = whole - beside.iter().map(|c| c[j] * c[j]).sum::<f64>();
            let is_possible = g > DISTINCT * whole && (b > 0.0 || self.signed[j]);
            if is_possible { b * b / g - 2.0 * self.chosen_from[j].ln() } else { 0.0 }
        };
        let best = (0..self.visible.len()).filter(is_tried).map(gain).fold(0.0, f64::max);
        (self.visible.len() as f64 * chi_square_tail(best, 1)).min(1.0)
    }
}

/// Scalar products of all columns with each other: half of them are made, in parts.
fn gram(columns: &DMatrix<f64>) -> DMatrix<f64> {
    let (rows, n) = columns.shape();
    let rest = columns.transpose();
    let part = |first: usize| -> (usize, DMatrix<f64>) {
        let width = GRAM.min(n - first);
        (first, rest.rows(0, first + width) * columns.view((0, first), (rows, width)))
    };
    let parts: Vec<(usize, DMatrix<f64>)> = (0..n.div_ceil(GRAM)).into_par_iter().map(|k| part(k * GRAM)).collect();
    let mut gram = DMatrix::zeros(n, n);
    for (first, part) in parts {
        gram.view_mut((0, first), part.shape()).copy_from(&part);
    }
    gram.fill_lower_triangle_with_upper_triangle();
    gram
}

#[cfg(test)]
mod tests {
    use super::*;

    fn screened(residual: &[f64], signatures: &[Vec<f64>], most: &[f64]) -> Screened {
        let n = signatures.len();
        Screened::new((0..n).collect(), residual.to_vec(), signatures, (vec![false; n], most.to_vec()), vec![None; n])
    }

    /// A cause that can do no more than one unit takes no more of a residual of five than that does.
    #[test]
    fn what_saturates_explains_no_more_than_it_can() {
        let signatures = [vec![1.0, 1.0], vec![1.0, -1.0]];
        let free = screened(&[5.0, 5.0], &signatures, &[f64::INFINITY; 2]);
        let bound = screened(&[5.0, 5.0], &signatures, &[1.0, f64::INFINITY]);
        assert_eq!(free.single(0), (5.0, 50.0));
        // 50 before, 2 (5 - 1)² left.
        assert_eq!(bound.single(0), (1.0, 18.0));
        assert!((free.pair(0, 1).1 - 50.0).abs() < 1e-9);
        assert!((bound.pair_at_most(0, 1) - 50.0).abs() < 1e-9);
        let ([x, y], gain) = bound.pair(0, 1);
        assert!((x - 1.0).abs() < 1e-12 && y.abs() < 1e-12 && (gain - 18.0).abs() < 1e-9, "{x} {y} {gain}");
        // Alone it is no alarm: noise often makes as much of two readings as it can explain of these.
        let tame = screened(&[3.0, 3.0], &signatures, &[0.1, f64::INFINITY]);
        assert!(screened(&[3.0, 3.0], &signatures, &[f64::INFINITY; 2]).look_elsewhere(1) < 0.01);
        assert!(tame.look_elsewhere(1) > 0.1, "{}", tame.look_elsewhere(1));
    }

    /// Noise along a cause in force asks for no other; what stands out across it does, were it never so little of the whole misfit.
    #[test]
    fn what_stands_out_of_much_noise_is_seen_beside_a_cause() {
        let n = 400;
        let signature = |k: usize| -> Vec<f64> { (0..n).map(|i| ((k + 1) as f64 * 0.05 * i as f64).sin() / 10.0).collect() };
        let signatures: Vec<Vec<f64>> = (0..20).map(signature).collect();
        let mut random = Random::new(7);
        let drawn: Vec<f64> = (0..n).map(|_| random.normal()).collect();
        let size = (n as f64 / drawn.iter().map(|z| z * z).sum::<f64>()).sqrt();
        let noise: Vec<f64> = drawn.iter().map(|z| size * z).collect();
        let with = |amplitude: f64, k: usize| -> Vec<f64> { noise.iter().zip(&signatures[k]).map(|(z, s)| z + amplitude * s).collect() };
        let alone = |left: &[f64]| screened(left, &signatures, &[f64::INFINITY; 20]).look_beside(&[3], left, &signatures[3..4]);
        assert!(alone(&noise) > 0.05 && alone(&with(5.0, 3)) > 0.05);
        let two = with(4.0, 11);
        assert!(chi_square_tail(two.iter().map(|v| v * v).sum(), n) > 0.01, "no misfit as a whole");
        assert!(alone(&two) < 1e-3, "{}", alone(&two));
    }
}
