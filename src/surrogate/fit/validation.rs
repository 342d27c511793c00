//! Folds for cross-validation and the half width of a band from its residuals.

use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::foundation::random::Random;

/// Splits rows into `k` folds: `result[row]` is the fold of that row. Rows at the same condition stay together, otherwise a
/// repeated measurement would be predicted from its own twin. The split depends only on the rows, `k` and `seed`.
pub fn folds(rows: &[&[f64]], k: usize, seed: u64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..rows.len()).collect();
    let compare = |a: &usize, b: &usize| {
        let differing = rows[*a].iter().zip(rows[*b]).map(|(x, y)| x.total_cmp(y)).find(|o| o.is_ne());
        differing.unwrap_or(std::cmp::Ordering::Equal)
    };
    order.sort_by(compare);
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for row in order {
        match groups.last_mut() {
            Some(group) if rows[group[0]] == rows[row] => group.push(row),
            _ => groups.push(vec![row]),
        }
    }
    let mut random = Random::new(seed);
    for i in (1..groups.len()).rev() {
        let j = (random.bits() % (i as u64 + 1)) as usize;
        groups.swap(i, j);
    }
    let mut fold = vec![0; rows.len()];
    for (position, group) in groups.iter().enumerate() {
        for row in group {
            fold[*row] = position % k.max(1);
        }
    }
    fold
}

/// Half width of a band that covers a share `coverage` of new conditions drawn like the rows.
///
/// `residuals` are held-out residuals of the whole procedure (cross-validation). With n of them the half width is the
/// ceil(coverage (n + 1))-th smallest magnitude, the finite-sample quantile of conformal prediction (Vovk 2005; Lei et al.
/// 2018): it covers at least that share on average over tables, whatever the errors' distribution, if the rows are
/// exchangeable with the new conditions. Fewer rows than that order statistic needs (n < 19 for 95 %): the larger of the
/// greatest magnitude and Student's t times the root mean square, which does assume a distribution.
pub fn half_width(residuals: &[f64], coverage: f64) -> f64 {
    let mut sizes: Vec<f64> = residuals.iter().map(|e| e.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let n = sizes.len();
    let order = (coverage * (n as f64 + 1.0)).ceil() as usize;
    if let Some(size) = order.checked_sub(1).and_then(|k| sizes.get(k)) {
        return *size;
    }
    let freedom = (n as f64 - 1.0).max(1.0);
    let t = StudentsT::new(0.0, 1.0, freedom).map_or(13.0, |t| t.inverse_cdf(0.5 + 0.5 * coverage));
    let spread = t * super::least_squares::rms(residuals) * (1.0 + 1.0 / n.max(1) as f64).sqrt();
    sizes.last().copied().unwrap_or(f64::INFINITY).max(spread)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folds_are_even_deterministic_and_keep_repeats_together() {
        let data: Vec<Vec<f64>> = (0..50).map(|i| vec![f64::from(i / 2), 1.0]).collect();
        let rows: Vec<&[f64]> = data.iter().map(Vec::as_slice).collect();
        let fold = folds(&rows, 5, 7);
        assert_eq!(fold, folds(&rows, 5, 7));
        assert_ne!(fold, folds(&rows, 5, 8));
        assert!((0..5).all(|k| fold.iter().filter(|f| **f == k).count() == 10));
        assert!((0..25).all(|i| fold[2 * i] == fold[2 * i + 1]));
    }

    #[test]
    fn half_width_is_the_conformal_order_statistic() {
        // n = 19 at 95 %: ceil(0.95 * 20) = 19, the largest; n = 39: the 38th.
        let residuals: Vec<f64> = (1..=39).map(f64::from).collect();
        assert_eq!(half_width(&residuals[..19], 0.95), 19.0);
        assert_eq!(half_width(&residuals, 0.95), 38.0);
        assert!(half_width(&residuals[..5], 0.95) > 5.0);
    }
}
