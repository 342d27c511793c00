//! Radiation between the surfaces of an enclosure: view factors completed and made consistent, and the network of grey
//! diffuse surfaces.
//!
//! The matrix used throughout is the exchange area S_ij = A_i F_ij, m², which reciprocity makes symmetric. The
//! remainder of a row, A_i - sum S_ij, is radiation past all other surfaces; it goes to the surroundings.

use nalgebra::{DMatrix, DVector};

/// Fills gaps in a table of view factors by reciprocity (A_i F_ij = A_j F_ji) and, if `closed`, by the sum of a row
/// (1). Entries that are not determined stay `None`.
pub fn complete(views: &mut [Vec<Option<f64>>], areas: &[f64], closed: bool) {
    let n = areas.len();
    loop {
        let mut changed = false;
        for i in 0..n {
            for j in 0..n {
                if let (None, Some(back)) = (views[i][j], views[j][i]) {
                    views[i][j] = Some(areas[j] * back / areas[i]);
                    changed = true;
                }
            }
            if closed && views[i].iter().filter(|f| f.is_none()).count() == 1 {
                let rest = 1.0 - views[i].iter().flatten().sum::<f64>();
                if let Some(gap) = views[i].iter_mut().find(|f| f.is_none()) {
                    // Rounding of the other entries must not make a view factor negative.
                    *gap = Some(if rest.abs() < 1e-12 { 0.0 } else { rest });
                    changed = true;
                }
            }
        }
        if !changed {
            return;
        }
    }
}

/// Makes estimated exchange areas consistent. The result is the smallest change, weighted by `variance`, for which
/// every row sums to its entry of `areas`. `variance` is symmetric, with 0 for entries known exactly. `rest` holds for
/// each row the exchange area to the surroundings and its variance; it is changed in the same way. Entries stay at or
/// above 0.
///
/// Least squares with Lagrange multipliers: S + v (l_i + l_j), where the multipliers solve one symmetric system.
pub fn enforce(exchange: &mut DMatrix<f64>, variance: &DMatrix<f64>, rest: &mut [(f64, f64)], areas: &[f64]) {
    let n = areas.len();
    // Rows that cannot change have no equation; an entry that would turn negative is set to 0 and left out in the next
    // pass.
    for _ in 0..20 {
        let missing = DVector::from_fn(n, |i, _| areas[i] - exchange.row(i).sum() - rest[i].0);
        if missing.iter().zip(areas).all(|(m, a)| m.abs() <= 1e-14 * a) {
            return;
        }
        let free = |i: usize, j: usize| if exchange[(i, j)] > 0.0 { variance[(i, j)] } else { 0.0 };
        let mut system = DMatrix::from_fn(n, n, free);
        for i in 0..n {
            let own: f64 = (0..n).map(|j| free(i, j)).sum::<f64>() + if rest[i].0 > 0.0 { rest[i].1 } else { 0.0 };
            system[(i, i)] += own;
            if own <= 0.0 {
                system[(i, i)] = 1.0;
            }
        }
        // A pair of rows that can only change together makes the system singular; the least-norm solution is then used.
        let Ok(multipliers) = system.svd(true, true).solve(&missing, 1e-12) else { return };
        for i in 0..n {
            for j in 0..n {
                let v = if exchange[(i, j)] > 0.0 { variance[(i, j)] } else { 0.0 };
                exchange[(i, j)] = (exchange[(i, j)] + v * (multipliers[i] + multipliers[j])).max(0.0);
            }
            if rest[i].0 > 0.0 {
                rest[i].0 = (rest[i].0 + rest[i].1 * multipliers[i]).max(0.0);
            }
        }
    }
}

/// A node of an enclosure's network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RadiationNode {
    /// Radiosity of a surface: the node's T⁴ is J/sigma.
    Radiosity(usize),
    /// Temperature of a surface: the node's T⁴ is the mean T⁴ of the surface.
    Surface(usize),
}

/// Emissivity (dimensionless) above which the radiosity of a surface is eliminated. Chosen between two forms:
///
/// With a node for its radiosity, all parts of a surface are joined to one node by eps A/(1 - eps). This also joins
/// them to each other, as if heat were conducted along the surface, without bound as eps goes to 1. Without the node
/// the surface itself appears in the network, and a black one is no special case.
pub const ELIMINATED_ABOVE: f64 = 0.5;

/// Conductors (m²) of the network of grey diffuse surfaces (A. K. Oppenheim, Trans. ASME 78 (1956) 725) with the
/// radiosities of surfaces above [`ELIMINATED_ABOVE`] eliminated: heat sigma GR (T_a⁴ - T_b⁴) flows from a to b.
/// Surfaces with a radiosity node are joined to it by eps A/(1 - eps), which is not in the list.
///
/// `exchange` is S, `areas` and `emissivities` (above 0, at most 1) belong to its rows.
pub fn conductors(exchange: &DMatrix<f64>, areas: &[f64], emissivities: &[f64]) -> Vec<(RadiationNode, RadiationNode, f64)> {
    let n = areas.len();
    // Rows: radiosities, then the surfaces whose radiosity is to be eliminated. A black surface is its radiosity.
    let grey: Vec<usize> = (0..n).filter(|i| emissivities[*i] > ELIMINATED_ABOVE && emissivities[*i] < 1.0).collect();
    let size = n + grey.len();
    let mut g = DMatrix::from_fn(size, size, |i, j| if i < n && j < n && i != j { exchange[(i, j)] } else { 0.0 });
    for (k, i) in grey.iter().enumerate() {
        let own = emissivities[*i] * areas[*i] / (1.0 - emissivities[*i]);
        (g[(*i, n + k)], g[(n + k, *i)]) = (own, own);
    }
    // Star to mesh, one radiosity after the other; only sums of positive numbers.
    for out in &grey {
        let total: f64 = g.row(*out).sum();
        let row: Vec<f64> = g.row(*out).iter().copied().collect();
        for a in (0..size).filter(|a| row[*a] > 0.0) {
            for b in (0..size).filter(|b| row[*b] > 0.0 && *b != a) {
                g[(a, b)] += row[a] * row[b] / total;
            }
        }
        g.row_mut(*out).fill(0.0);
        g.column_mut(*out).fill(0.0);
    }
    let terminal = |i: usize| match i {
        i if i >= n => RadiationNode::Surface(grey[i - n]),
        i if emissivities[i] < 1.0 => RadiationNode::Radiosity(i),
        i => RadiationNode::Surface(i),
    };
    let pairs = (0..size).flat_map(|a| (a + 1..size).map(move |b| (a, b)));
    pairs.filter(|(a, b)| g[(*a, *b)] > 0.0).map(|(a, b)| (terminal(a), terminal(b), g[(a, b)])).collect()
}
