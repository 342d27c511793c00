//! Folds for cross-validation and the half width of a band from its residuals.

use std::cmp::Ordering;

use nalgebra::DMatrix;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::dense::{SpdInverse, invert_spd};
use coldplate_base::random::Random;

/// The conditions among rows, in the order of their first rows: the indices of all rows at each.
pub(crate) fn conditions(rows: &[&[f64]]) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by(|a, b| by_values(rows[*a], rows[*b]));
    let mut found: Vec<Vec<usize>> = order.chunk_by(|a, b| rows[*a] == rows[*b]).map(<[usize]>::to_vec).collect();
    found.sort_by_key(|members| members[0]);
    found
}

/// Order of two conditions by their values, the first variable before the others.
fn by_values(a: &[f64], b: &[f64]) -> Ordering {
    a.iter().zip(b).map(|(x, y)| x.total_cmp(y)).find(|o| o.is_ne()).unwrap_or(Ordering::Equal)
}

/// Splits conditions, no two alike, into `k` folds: `result[row]` is the fold of that condition. The split depends only on the
/// conditions, `k` and `seed`.
pub fn folds(rows: &[&[f64]], k: usize, seed: u64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by(|a, b| by_values(rows[*a], rows[*b]));
    let mut random = Random::new(seed);
    for i in (1..order.len()).rev() {
        let j = (random.bits() % (i as u64 + 1)) as usize;
        order.swap(i, j);
    }
    let mut fold = vec![0; rows.len()];
    order.into_iter().enumerate().for_each(|(position, row)| fold[row] = position % k.max(1));
    fold
}

/// Indices of at most `most` of the conditions, no two alike, in rising order: all, or an even share of them in shuffled order.
pub(super) fn share(rows: &[&[f64]], most: usize, seed: u64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..rows.len()).collect();
    if order.len() > most {
        let shuffled = folds(rows, rows.len(), seed);
        order.sort_by_key(|i| shuffled[*i]);
        order.truncate(most);
        order.sort_unstable();
    }
    order
}

/// Half width of a band that covers a share `coverage` of new conditions drawn like the rows.
///
/// `residuals` are held-out residuals of the whole procedure (cross-validation). With n of them the half width is the
/// ceil(coverage (n + 1))-th smallest magnitude, the finite-sample quantile of conformal prediction (Vovk 2005; Lei et al.
/// 2018). The band then covers at least this share on average over tables, whatever the errors' distribution, if the rows
/// are exchangeable with the new conditions. With fewer rows than the order statistic needs (n < 19 for 95 %) the half
/// width is the larger of the greatest magnitude and Student's t times the root mean square, which does assume a
/// distribution.
pub fn half_width(residuals: &[f64], coverage: f64) -> f64 {
    half_width_of_readings(residuals, &vec![1.0; residuals.len()], coverage)
}

/// [`half_width`] of residuals that count as shares of a condition: readings at one condition are no independent conditions, so the
/// shares of each sum to one, and n is their sum.
pub(crate) fn half_width_of_readings(residuals: &[f64], shares: &[f64], coverage: f64) -> f64 {
    let n = shares.iter().sum::<f64>().round();
    let mut sizes: Vec<(f64, f64)> = residuals.iter().zip(shares).map(|(e, share)| (e.abs(), *share)).collect();
    sizes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let wanted = (coverage * (n + 1.0)).ceil();
    if wanted > 0.0 && wanted <= n {
        // Shares of a third do not sum to one exactly.
        let mut covered = 0.0;
        let enough = sizes.iter().find(|(_, share)| {
            covered += share;
            covered >= wanted - 1e-6
        });
        if let Some((size, _)) = enough {
            return *size;
        }
    }
    let freedom = (n - 1.0).max(1.0);
    let t = StudentsT::new(0.0, 1.0, freedom).map_or(13.0, |t| t.inverse_cdf(0.5 + 0.5 * coverage));
    let square = sizes.iter().map(|(size, share)| share * size * size).sum::<f64>() / n.max(1.0);
    let spread = t * square.sqrt() * (1.0 + 1.0 / n.max(1.0)).sqrt();
    sizes.last().map_or(f64::INFINITY, |(size, _)| *size).max(spread)
}

/// Smoothing of the reference process, a share of its variance. Chosen: repeated conditions and rounding must not
/// make the matrix singular.
const NUGGET: f64 = 1e-8;
/// Variance of the trend of the reference process, a multiple of its variance. Chosen so large that the rows alone
/// decide the trend.
const TREND: f64 = 100.0;

/// Distance of conditions from known rows (both in scaled variables): the standard deviation of a reference Gaussian process of
/// length one with a linear trend. No values enter, so it is the same for every output of a table.
pub(crate) fn remoteness(known: &[Vec<f64>], asked: &[Vec<f64>]) -> Option<Vec<f64>> {
    let inverse = reference_system(known)?;
    let explained = &inverse.factor * DMatrix::from_fn(known.len(), asked.len(), |i, j| reference(&known[i], &asked[j]));
    let variance = |(j, u): (usize, &Vec<f64>)| reference(u, u) - explained.column(j).norm_squared();
    Some(asked.iter().enumerate().map(|at| variance(at).max(NUGGET).sqrt()).collect())
}

/// Distance of each of `known` from all the others, in the sense of [`remoteness`].
pub(crate) fn remoteness_of_each(known: &[Vec<f64>]) -> Option<Vec<f64>> {
    let inverse = reference_system(known)?.inverse;
    Some((0..known.len()).map(|i| (1.0 / inverse[(i, i)]).max(NUGGET).sqrt()).collect())
}

/// Square of the distance between two points.
pub(super) fn distance_square(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}

/// Covariance of the reference process.
fn reference(a: &[f64], b: &[f64]) -> f64 {
    let product: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    libm::exp(-distance_square(a, b)) + TREND * (1.0 + product)
}

fn reference_system(known: &[Vec<f64>]) -> Option<SpdInverse> {
    let n = known.len();
    let nugget = |i: usize, j: usize| if i == j { NUGGET } else { 0.0 };
    invert_spd(&DMatrix::from_fn(n, n, |i, j| reference(&known[i], &known[j]) + nugget(i, j)))
}

/// Remoteness of conditions: of held-out residuals from the rows of the other folds, and of conditions to be asked about from all
/// rows.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Remoteness {
    /// Remoteness, one per condition.
    pub held_out: Vec<f64>,
    /// Remoteness of conditions spread over the range.
    pub asked: Vec<f64>,
}

/// [`half_width`] of few residuals, each taken from where it was held out to where the surrogate will be asked.
///
/// Among few rows a corner that is left out would set the band, though no condition asked about is as far from all rows. Each
/// residual is therefore divided by the remoteness of its condition (conformal prediction with normalised residuals: Papadopoulos,
/// Gammerman, Vovk 2008). The half width is the least that covers the share `coverage` of n + 1 residuals, one of them infinite,
/// times the remoteness of the conditions asked about. If there are fewer residuals than this needs, [`half_width`] treats them as
/// they are. `shares` are those of [`half_width_of_readings`]; `conditions` names the condition of each residual.
pub(crate) fn half_width_of_few(residuals: &[f64], shares: &[f64], conditions: &[usize], remoteness: &Remoteness, coverage: f64) -> f64 {
    let n = shares.iter().sum::<f64>().round();
    let scores: Vec<f64> = residuals.iter().zip(conditions).map(|(e, c)| e.abs() / remoteness.held_out[*c]).collect();
    let mut asked = remoteness.asked.clone();
    asked.sort_by(f64::total_cmp);
    let wanted = coverage * (n + 1.0);
    if wanted > n {
        return half_width_of_readings(residuals, shares, coverage);
    }
    let covers = |width: f64, z: f64| asked.partition_point(|d| z * d <= width) as f64 / asked.len() as f64;
    let inside = |width: f64| scores.iter().zip(shares).map(|(z, share)| share * covers(width, *z)).sum::<f64>();
    let largest = scores.iter().copied().fold(0.0, f64::max) * asked.last().copied().unwrap_or(0.0);
    let (mut low, mut high) = (0.0, largest);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if inside(middle) >= wanted { high = middle } else { low = middle }
    }
    high
}

/// Number of halvings of the interval that holds a half width: 2⁻⁴⁰ is 1e-12 of it.
const HALVINGS: usize = 40;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folds_are_even_and_deterministic() {
        let data: Vec<Vec<f64>> = (0..50).map(|i| vec![f64::from(i), 1.0]).collect();
        let rows: Vec<&[f64]> = data.iter().map(Vec::as_slice).collect();
        let fold = folds(&rows, 5, 7);
        assert_eq!(fold, folds(&rows, 5, 7));
        assert_ne!(fold, folds(&rows, 5, 8));
        assert!((0..5).all(|k| fold.iter().filter(|f| **f == k).count() == 10));
    }

    #[test]
    fn rows_at_one_condition_are_one() {
        let data = [[2.0, 1.0], [1.0, 5.0], [2.0, 1.0], [1.0, 4.0], [1.0, 5.0], [2.0, 1.0]];
        let rows: Vec<&[f64]> = data.iter().map(<[f64; 2]>::as_slice).collect();
        assert_eq!(conditions(&rows), [vec![0, 2, 5], vec![1, 4], vec![3]]);
    }

    #[test]
    fn readings_at_one_condition_count_as_one() {
        // Every residual three times, in shares of a third: the half width of the residuals alone.
        for n in [6, 19, 39] {
            let residuals: Vec<f64> = (1..=n).map(f64::from).collect();
            let thrice: Vec<f64> = residuals.iter().flat_map(|e| [*e; 3]).collect();
            let shares = vec![1.0 / 3.0; thrice.len()];
            assert!((half_width_of_readings(&thrice, &shares, 0.95) - half_width(&residuals, 0.95)).abs() < 1e-9);
        }
    }

    #[test]
    fn half_width_is_the_conformal_order_statistic() {
        // n = 19 at 95 %: ceil(0.95 * 20) = 19, the largest; n = 39: the 38th.
        let residuals: Vec<f64> = (1..=39).map(f64::from).collect();
        assert_eq!(half_width(&residuals[..19], 0.95), 19.0);
        assert_eq!(half_width(&residuals, 0.95), 38.0);
        assert!(half_width(&residuals[..5], 0.95) > 5.0);
    }

    #[test]
    fn conditions_among_the_rows_are_less_remote_than_a_corner_left_out() {
        let rows: Vec<Vec<f64>> = [-1.0, 1.0].iter().flat_map(|a| [-1.0, 1.0].map(|b| vec![*a, b])).collect();
        let corner = remoteness(&rows[1..], &rows[..1]).unwrap()[0];
        let middle = remoteness(&rows, &[vec![0.0, 0.0]]).unwrap()[0];
        let known = remoteness(&rows, &rows[..1]).unwrap()[0];
        assert!(known < 1e-3 && known < middle && 1.5 * middle < corner, "{known} {middle} {corner}");
    }

    #[test]
    fn residuals_count_where_they_are_asked_for() {
        // 24 residuals of 1, held out twice as far from the rows as what is asked about: half as large there.
        let even = Remoteness { held_out: vec![2.0; 24], asked: vec![1.0; 10] };
        let few = |n: usize| half_width_of_few(&vec![1.0; n], &vec![1.0; n], &(0..n).collect::<Vec<_>>(), &even, 0.95);
        assert!((few(24) - 0.5).abs() < 1e-9);
        // With too few for the order statistic, Student's t stays.
        assert!((few(6) - half_width(&[1.0; 6], 0.95)).abs() < 1e-9);
    }
}
