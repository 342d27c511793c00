//! Radiation between grey diffuse surfaces: exchange factors and closed-form view factors.

use std::f64::consts::PI;

/// Stefan-Boltzmann constant, W/(m² K⁴) (CODATA 2018, exact in its digits).
pub const SIGMA: f64 = 5.670_374_419e-8;

/// Effective emissivity of a convex body (emissivity `e`, `area` m²) inside a chamber (`e_ch`,
/// `area_ch`): 1/(1/e + (A/A_ch)(1/e_ch - 1)). The heat is eps sigma A (T⁴ - T_ch⁴).
///
/// Range: grey diffuse surfaces, convex body, area not larger than the chamber's. Source: two-surface
/// enclosure with F = 1.
///
/// ```
/// # use coldplate::physics::radiation::effective_emissivity;
/// assert!((effective_emissivity(0.55, 0.1525, 0.3, 96.0) - 0.548881).abs() < 1e-6);
/// ```
pub fn effective_emissivity(e: f64, area: f64, e_ch: f64, area_ch: f64) -> f64 {
    1.0 / (1.0 / e + area / area_ch * (1.0 / e_ch - 1.0))
}

/// Radiative conductor (m²) between two grey surfaces that see each other with view factor
/// `view_factor` from the first to the second: 1/[(1-e1)/(e1 A1) + 1/(A1 F12) + (1-e2)/(e2 A2)].
/// The heat is sigma GR (T1⁴ - T2⁴).
///
/// Exact where the two surfaces form an enclosure; else the exchange by way of third surfaces is missing.
pub fn two_surface(e1: f64, area1: f64, e2: f64, area2: f64, view_factor: f64) -> f64 {
    if view_factor <= 0.0 {
        return 0.0;
    }
    1.0 / ((1.0 - e1) / (e1 * area1) + 1.0 / (area1 * view_factor) + (1.0 - e2) / (e2 * area2))
}

/// Linearised coefficient 4 eps sigma Tm³, W/(m² K), at the mean temperature Tm (K).
pub fn linearised(emissivity: f64, mean_temperature: f64) -> f64 {
    4.0 * emissivity * SIGMA * mean_temperature.powi(3)
}

/// View factor between two equal aligned parallel rectangles `a` x `b` (m) at `distance` (m).
///
/// Closed form (Howell's catalogue C-11); rounding costs digits where the rectangles are smaller
/// than about 1e-3 of their distance.
pub fn parallel_rectangles(a: f64, b: f64, distance: f64) -> f64 {
    let (x, y) = (a / distance, b / distance);
    let (x1, y1) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    let logarithm = (x1 * y1 / (1.0 + x * x + y * y).sqrt()).ln();
    let arcs = x * y1 * (x / y1).atan() + y * x1 * (y / x1).atan() - x * x.atan() - y * y.atan();
    2.0 / (PI * x * y) * (logarithm + arcs)
}

/// View factor from a rectangle `depth1` x `width` to one `depth2` x `width` (m) at a right angle to
/// it, the common edge being `width` long. Closed form (Howell's catalogue C-14).
pub fn perpendicular_rectangles(width: f64, depth1: f64, depth2: f64) -> f64 {
    let (w, h) = (depth1 / width, depth2 / width);
    let (w2, h2) = (w * w, h * h);
    let s = w2 + h2;
    let arcs = w * (1.0 / w).atan() + h * (1.0 / h).atan() - s.sqrt() * (1.0 / s.sqrt()).atan();
    let all = 1.0 + s;
    let logarithm =
        ((1.0 + w2) * (1.0 + h2) / all).ln() + w2 * (w2 * all / ((1.0 + w2) * s)).ln() + h2 * (h2 * all / ((1.0 + h2) * s)).ln();
    (arcs + 0.25 * logarithm) / (PI * w)
}

/// View factor from a disc of radius `r1` to a coaxial parallel disc of radius `r2` at `distance` (m).
/// Closed form (Howell's catalogue C-41).
pub fn coaxial_discs(r1: f64, r2: f64, distance: f64) -> f64 {
    let (x, y) = (r1 / distance, r2 / distance);
    let s = 1.0 + (1.0 + y * y) / (x * x);
    // [s - (s² - 4 q)^(1/2)]/2, written so that nothing cancels for small discs.
    let q = (y / x) * (y / x);
    2.0 * q / (s + (s * s - 4.0 * q).sqrt())
}
