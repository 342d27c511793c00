//! Shares between 0 and 1 that satisfy linear conditions or stand at a limit: a linear complementarity problem with two bounds.

use nalgebra::{DMatrix, DVector};

/// Most exchanges of the active set, a count. Chosen: time against sets of controllers that are refused.
const MOST_EXCHANGES: usize = 1000;

#[derive(Clone, Copy, PartialEq)]
enum Place {
    Low,
    Between,
    High,
}

/// The shares u at which g(u) = g(u0) + M (u - u0) is zero between the limits, not negative at 0 and not positive at 1; `None` if no
/// such shares are found. Murty's principal pivoting with the least index, which ends for every P-matrix (Murty, Linear Algebra and its
/// Applications 7 (1974) 1).
pub(super) fn shares(at: &[f64], values: &[f64], slopes: &DMatrix<f64>) -> Option<Vec<f64>> {
    let n = at.len();
    let has_effect: Vec<bool> = (0..n).map(|i| slopes.column(i).iter().any(|slope| *slope != 0.0)).collect();
    let mut places = vec![Place::Low; n];
    for _ in 0..MOST_EXCHANGES {
        let mut found: Vec<f64> = places.iter().map(|place| if *place == Place::High { 1.0 } else { 0.0 }).collect();
        let between: Vec<usize> = (0..n).filter(|i| places[*i] == Place::Between).collect();
        let value = |found: &[f64], i: usize| values[i] + (0..n).map(|j| slopes[(i, j)] * (found[j] - at[j])).sum::<f64>();
        let own = DMatrix::from_fn(between.len(), between.len(), |i, j| slopes[(between[i], between[j])]);
        let right = DVector::from_fn(between.len(), |i, _| -value(&found, between[i]));
        let solved = if between.is_empty() { right } else { own.lu().solve(&right)? };
        between.iter().zip(solved.iter()).for_each(|(i, share)| found[*i] = *share);
        let next = |i: usize| match places[i] {
            Place::Between if found[i] < 0.0 => Some(Place::Low),
            Place::Between if found[i] > 1.0 => Some(Place::High),
            Place::Low if value(&found, i) < 0.0 => Some(if has_effect[i] { Place::Between } else { Place::High }),
            Place::High if value(&found, i) > 0.0 => Some(if has_effect[i] { Place::Between } else { Place::Low }),
            _ => None,
        };
        match (0..n).find_map(|i| Some((i, next(i)?))) {
            Some((i, place)) => places[i] = place,
            None => return Some(found),
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every combination of limits, in a problem of two shares that help each other.
    #[test]
    fn two_shares() {
        let slopes = DMatrix::from_row_slice(2, 2, &[10.0, 6.0, 5.0, 8.0]);
        for (values, expected) in [
            ([-8.0, -6.5], [0.5, 0.5]),
            ([1.0, 2.0], [0.0, 0.0]),
            ([-20.0, -20.0], [1.0, 1.0]),
            ([-5.0, 0.0], [0.5, 0.0]),
            ([0.0, -4.0], [0.0, 0.5]),
            ([-15.0, -9.0], [1.0, 0.5]),
        ] {
            let found = shares(&[0.0, 0.0], &values, &slopes).unwrap();
            assert!(found.iter().zip(expected).all(|(f, e)| (f - e).abs() < 1e-12), "{values:?}: {found:?}");
        }
    }

    /// A share without effect stands at the limit that its value asks for.
    #[test]
    fn no_effect() {
        let none = DMatrix::zeros(1, 1);
        assert_eq!(shares(&[0.5], &[-1.0], &none), Some(vec![1.0]));
        assert_eq!(shares(&[0.5], &[1.0], &none), Some(vec![0.0]));
    }
}
