//! Radiation between grey diffuse surfaces: exchange factors.

/// Stefan-Boltzmann constant, W/(m² K⁴) (CODATA 2018, exact in its digits).
pub const SIGMA: f64 = 5.670_374_419e-8;

/// Effective emissivity of a convex body (emissivity `e`, `area` m²) inside a chamber (`e_ch`,
/// `area_ch`): 1/(1/e + (A/A_ch)(1/e_ch - 1)). The heat is eps sigma A (T⁴ - T_ch⁴).
///
/// Range: grey diffuse surfaces, convex body, area not larger than the chamber's. Source: two-surface
/// enclosure with F = 1.
///
/// ```
/// # use coldplate_physics::radiation::effective_emissivity;
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
