//! Least value of a quadratic model within a box, by active sets (Stark & Parker 1995, Computational Statistics 10, 129-141).

use nalgebra::{DMatrix, DVector};

/// Most changes of the set of coordinates at their bounds, over the number of coordinates. Chosen: a guard against cycles by
/// rounding; each coordinate usually changes once.
const MOST_CHANGES: usize = 10;

/// The x within `within` (least and largest value of each coordinate, which hold zero) that minimises ½ xᵀ M x - bᵀ x, for a positive
/// definite M = `matrix`. A coordinate without curvature stays at zero. `None` if the matrix is not positive definite.
pub(super) fn least_within(matrix: &DMatrix<f64>, right: &DVector<f64>, within: &[(f64, f64)]) -> Option<DVector<f64>> {
    let n = right.len();
    let moves = |k: usize| matrix[(k, k)] > 0.0 && within[k].0 < within[k].1;
    let mut x = DVector::zeros(n);
    let mut is_free: Vec<bool> = (0..n).map(moves).collect();
    for _ in 0..MOST_CHANGES * n.max(1) {
        let free: Vec<usize> = (0..n).filter(|k| is_free[*k]).collect();
        let to = among(matrix, right, &x, &free)?;
        // The step goes as far as the box allows.
        let share = |(k, to): (&usize, &f64)| {
            let end = if *to > x[*k] { within[*k].1 } else { within[*k].0 };
            ((end - x[*k]) / (to - x[*k])).max(0.0)
        };
        let beyond = |(k, to): &(&usize, &f64)| **to < within[**k].0 || **to > within[**k].1;
        let first = free.iter().zip(to.iter()).filter(beyond).map(|own| (*own.0, share(own))).min_by(|a, b| a.1.total_cmp(&b.1));
        let length = first.map_or(1.0, |(_, share)| share);
        free.iter().zip(to.iter()).for_each(|(k, to)| x[*k] += length * (to - x[*k]));
        if let Some((k, _)) = first {
            x[k] = if x[k] > 0.5 * (within[k].0 + within[k].1) { within[k].1 } else { within[k].0 };
            is_free[k] = false;
            continue;
        }
        // A coordinate at its bound is released if the model falls inwards.
        let slope = right - matrix * &x;
        let inwards = |k: usize| if x[k] <= within[k].0 { slope[k] } else { -slope[k] };
        let scaled = |k: usize| inwards(k) / matrix[(k, k)].sqrt();
        let held = (0..n).filter(|k| !is_free[*k] && moves(*k) && scaled(*k) > 0.0);
        let Some(k) = held.max_by(|a, b| scaled(*a).total_cmp(&scaled(*b))) else { break };
        is_free[k] = true;
    }
    x.iter().all(|v| v.is_finite()).then_some(x)
}

/// Values of the free coordinates at the least of the model if the others stay.
fn among(matrix: &DMatrix<f64>, right: &DVector<f64>, x: &DVector<f64>, free: &[usize]) -> Option<Vec<f64>> {
    // A unit diagonal: coordinates may differ by many powers of ten in their effect.
    let scale: Vec<f64> = free.iter().map(|k| matrix[(*k, *k)].sqrt()).collect();
    let own = DMatrix::from_fn(free.len(), free.len(), |i, j| matrix[(free[i], free[j])] / (scale[i] * scale[j]));
    let held = |i: usize| (0..x.len()).filter(|k| !free.contains(k)).map(|k| matrix[(free[i], k)] * x[k]).sum::<f64>();
    let aim = DVector::from_fn(free.len(), |i, _| (right[free[i]] - held(i)) / scale[i]);
    let found = own.cholesky()?.solve(&aim);
    Some(found.iter().zip(&scale).map(|(v, s)| v / s).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x² + x y + y² - 3 x: slopes of zero at the least, or against the side of the box.
    #[test]
    fn the_least_of_a_bowl_lies_in_the_withinor_on_its_side() {
        let matrix = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0]);
        let right = DVector::from_vec(vec![3.0, 0.0]);
        let at = |within: [(f64, f64); 2]| least_within(&matrix, &right, &within).unwrap();
        let wide = (-10.0, 10.0);
        // 2x + y = 3 and x + 2y = 0.
        assert!((at([wide, wide]) - DVector::from_vec(vec![2.0, -1.0])).amax() < 1e-12);
        // With x at one, y is -1/2.
        assert!((at([(-10.0, 1.0), wide]) - DVector::from_vec(vec![1.0, -0.5])).amax() < 1e-12);
        // With y at zero, x is 3/2.
        assert!((at([wide, (0.0, 10.0)]) - DVector::from_vec(vec![1.5, 0.0])).amax() < 1e-12);
        assert_eq!(at([(0.0, 0.0), (0.0, 0.0)]), DVector::zeros(2));
    }

    /// Coordinates whose effects differ by twelve powers of ten, and one without any.
    #[test]
    fn scales_make_no_difference() {
        let matrix = DMatrix::from_row_slice(3, 3, &[1e-12, 5e-7, 0.0, 5e-7, 1.0, 0.0, 0.0, 0.0, 0.0]);
        let right = DVector::from_vec(vec![1e-6, 1.0, 1.0]);
        let found = least_within(&matrix, &right, &[(-1e9, 1e9); 3]).unwrap();
        assert!((found[0] / 1e6 - 2.0 / 3.0).abs() < 1e-9 && (found[1] - 2.0 / 3.0).abs() < 1e-9 && found[2] == 0.0, "{found}");
    }
}
