//! Few columns in place of a large covariance.

/// Columns whose products with themselves sum to a covariance, from its largest variance on, until none of what is left exceeds `enough`.
/// `column` gives one column of the covariance, `left` are its variances.
pub fn low_rank(mut left: Vec<f64>, column: impl Fn(usize) -> Vec<f64>, enough: f64) -> Vec<Vec<f64>> {
    let mut found: Vec<Vec<f64>> = Vec::new();
    while found.len() < left.len() {
        let Some(pivot) = (0..left.len()).max_by(|a, b| left[*a].total_cmp(&left[*b])).filter(|p| left[*p] > enough) else { break };
        let root = left[pivot].sqrt();
        let mut own = column(pivot);
        for before in &found {
            let share = before[pivot];
            own.iter_mut().zip(before).for_each(|(o, b)| *o -= share * b);
        }
        own.iter_mut().for_each(|o| *o /= root);
        left.iter_mut().zip(&own).for_each(|(l, o)| *l = (*l - o * o).max(0.0));
        // Rounding leaves nothing of the pivot's own variance.
        left[pivot] = 0.0;
        found.push(own);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Forty smooth functions of thirty points come to far fewer columns, which keep every product within what is enough.
    #[test]
    fn few_columns_have_the_covariance_of_many() {
        let of = |i: usize, k: usize| (0.03 * i as f64 * k as f64).cos() / (1.0 + k as f64);
        let product = |i: usize, j: usize| (0..40).map(|k| of(i, k) * of(j, k)).sum::<f64>();
        let found = low_rank((0..30).map(|i| product(i, i)).collect(), |j| (0..30).map(|i| product(i, j)).collect(), 1e-3);
        assert!(found.len() < 25, "{}", found.len());
        for (i, j) in [(0, 0), (4, 17), (29, 29), (11, 12)] {
            let own: f64 = found.iter().map(|column| column[i] * column[j]).sum();
            assert!((own - product(i, j)).abs() < 1e-3, "{i} {j}: {own}");
        }
        assert!(low_rank(vec![0.0; 3], |_| vec![0.0; 3], 1e-9).is_empty());
    }
}
