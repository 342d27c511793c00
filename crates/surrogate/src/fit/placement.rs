//! Placement of further rows where they would tell most about the functions of a table.

use super::validation::{distance_square, remoteness, remoteness_of_each};

/// A row that is known, or has failed.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownRow {
    /// Place of the row, in [-1, 1] per variable.
    pub place: Vec<f64>,
    /// Sizes of the row's held-out residuals, one per output, in units that make the outputs comparable; `None` if it has none.
    pub errors: Option<Vec<f64>>,
}

/// Least distance of a candidate from known rows, as a share of the largest distance of any candidate. Chosen: rows
/// close together tell little more than one.
const APART: f64 = 0.5;
/// Least distance of a candidate from known rows, as a share of the largest distance before the first was taken.
/// Chosen: a batch ends rather than fill in places beside known rows.
const APART_AT_FIRST: f64 = 0.25;

/// Indices of `count` of the `candidates` (in [-1, 1] per variable) at which a fit is least sure, one after another, each as if
/// the ones before were known.
///
/// The uncertainty of a fit in an output is a product of two factors. The first is the remoteness of the place from the
/// known rows (the standard deviation of the reference process of [`remoteness`]). The second is the error of the rows
/// around it when they were held out, over their own remoteness: the root mean square of these ratios, weighted by the
/// inverse fourth power of the distance. The output with the largest uncertainty counts. No candidate is taken that lies
/// nearer to known rows than half as far as the farthest, or a quarter as far as the farthest was at first: then fewer are
/// taken.
pub fn most_telling(known: &[KnownRow], candidates: &[Vec<f64>], count: usize) -> Vec<usize> {
    let mut places: Vec<Vec<f64>> = known.iter().map(|k| k.place.clone()).collect();
    let errors = local_errors(known, &places, candidates);
    let mut nearest: Vec<f64> =
        candidates.iter().map(|c| places.iter().map(|p| distance_square(c, p)).fold(f64::INFINITY, f64::min)).collect();
    let least = APART_AT_FIRST.powi(2) * nearest.iter().copied().fold(0.0, f64::max);
    let mut taken = Vec::new();
    for _ in 0..count.min(candidates.len()) {
        let farthest = nearest.iter().copied().fold(0.0, f64::max);
        // Repeated rows make the matrix of the reference process singular: then distance alone decides.
        let remote = remoteness(&places, candidates).unwrap_or_else(|| nearest.iter().map(|d| d.sqrt()).collect());
        let score = |i: &usize| remote[*i] * errors[*i];
        let admitted = (0..candidates.len()).filter(|i| nearest[*i] >= least.max(APART * APART * farthest) && !taken.contains(i));
        // The first of equals, so that the choice is the same everywhere.
        let Some(best) = admitted.reduce(|a, b| if score(&b) > score(&a) { b } else { a }) else { break };
        taken.push(best);
        places.push(candidates[best].clone());
        nearest.iter_mut().zip(candidates).for_each(|(d, c)| *d = d.min(distance_square(c, &candidates[best])));
    }
    taken
}

/// Error of the rows around each candidate over their remoteness, for the worst output.
fn local_errors(known: &[KnownRow], places: &[Vec<f64>], candidates: &[Vec<f64>]) -> Vec<f64> {
    let remote = remoteness_of_each(places).unwrap_or_else(|| vec![1.0; places.len()]);
    let rated: Vec<(&[f64], Vec<f64>)> = (known.iter().enumerate())
        .filter_map(|(i, k)| Some((k.place.as_slice(), k.errors.as_ref()?.iter().map(|e| (e / remote[i]).powi(2)).collect())))
        .collect();
    let of = |candidate: &Vec<f64>| {
        let weights: Vec<f64> = rated.iter().map(|(place, _)| 1.0 / distance_square(candidate, place).max(1e-12).powi(2)).collect();
        let total: f64 = weights.iter().sum();
        let outputs = rated.first().map_or(0, |(_, errors)| errors.len());
        let mean = |o: usize| rated.iter().zip(&weights).map(|((_, errors), w)| w * errors[o]).sum::<f64>() / total;
        let worst = (0..outputs).map(mean).fold(0.0, f64::max).sqrt();
        // Without any error, remoteness alone decides.
        if worst > 0.0 { worst } else { f64::MIN_POSITIVE.sqrt() }
    };
    candidates.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(x: f64, y: f64, error: f64) -> KnownRow {
        KnownRow { place: vec![x, y], errors: Some(vec![error, 0.0]) }
    }

    #[test]
    fn what_is_remote_and_badly_predicted_comes_first_and_nothing_twice() {
        let mut rows: Vec<KnownRow> =
            [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0), (0.0, 0.0)].map(|(x, y)| known(x, y, 0.1)).to_vec();
        let candidates: Vec<Vec<f64>> = vec![vec![0.5, 0.0], vec![-0.5, 0.0], vec![0.9, 0.95], vec![0.0, 0.5], vec![0.0, -0.5]];
        rows[2] = known(1.0, -1.0, 3.0);
        rows[3] = known(1.0, 1.0, 3.0);
        let taken = most_telling(&rows, &candidates, 5);
        assert_eq!(taken[0], 0, "between the badly predicted rows");
        assert!(!taken.contains(&2), "beside a known row: {taken:?}");
        let mut distinct = taken.clone();
        distinct.sort_unstable();
        distinct.dedup();
        assert_eq!(distinct.len(), taken.len());
    }

    #[test]
    fn a_place_that_failed_is_left_alone() {
        let mut rows = vec![known(-1.0, -1.0, 1.0), known(1.0, -1.0, 1.0), known(-1.0, 1.0, 1.0), known(0.0, 0.0, 1.0)];
        let candidates = vec![vec![1.0, 1.0], vec![0.0, -1.0], vec![0.95, 1.0]];
        assert_eq!(most_telling(&rows, &candidates, 1), [0]);
        rows.push(KnownRow { place: vec![1.0, 1.0], errors: None });
        assert_eq!(most_telling(&rows, &candidates, 3), [1]);
    }
}
