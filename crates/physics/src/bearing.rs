//! Friction of rolling bearings. SI outside; the catalogues' mm, mm²/s, r/min and N mm inside.

use std::f64::consts::PI;

/// r/min per rad/s: 30/pi.
const RPM: f64 = 30.0 / PI;

/// A bearing for [`palmgren`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Palmgren {
    /// Lubrication factor f0 (1..2 grease or oil mist, deep groove and angular contact).
    pub f0: f64,
    /// Load factor f1 (0.0003..0.001 for ball bearings).
    pub f1: f64,
    /// Mean diameter, m.
    pub mean_diameter: f64,
    /// Kinematic viscosity of the oil, or of the grease's base oil, at running temperature, m²/s.
    pub viscosity: f64,
    /// Decisive load, N, the preload included.
    pub load: f64,
}

/// Friction torque M0 + M1 (N m) of a rolling bearing at `speed` (rad/s), as (M0, M1).
///
/// With nu in mm²/s, n in r/min, d_m in mm, P1 in N, torques in N mm:
/// M0 = 1e-7 f0 (nu n)^(2/3) d_m³ for nu n >= 2000, else 160e-7 f0 d_m³; M1 = f1 P1 d_m.
/// The two forms of M0 differ by 0.8 % where they meet.
///
/// Source: Palmgren, Grundlagen der Wälzlagertechnik; Harris, Rolling Bearing Analysis.
///
/// ```
/// # use coldplate_physics::bearing::{Palmgren, palmgren};
/// let bearing = Palmgren { f0: 2.0, f1: 7e-4, mean_diameter: 0.072, viscosity: 150e-6, load: 3000.0 };
/// let speed = 50.0 * std::f64::consts::PI / 30.0;
/// let (viscous, load) = palmgren(&bearing, speed);
/// assert!(((viscous + load) * speed - 0.94144).abs() < 1e-5); // W
/// ```
pub fn palmgren(bearing: &Palmgren, speed: f64) -> (f64, f64) {
    let diameter = bearing.mean_diameter * 1e3;
    let product = bearing.viscosity * 1e6 * speed.abs() * RPM;
    let scale = if product >= 2000.0 { 1e-7 * product.powf(2.0 / 3.0) } else { 160e-7 };
    (scale * bearing.f0 * diameter.powi(3) * 1e-3, bearing.f1 * bearing.load * bearing.mean_diameter)
}

/// A bearing for [`skf`], with the catalogue's variables for its type, size and load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Skf {
    /// Rolling variable G_rr, as tabulated (gives N mm with nu in mm²/s and n in r/min).
    pub rolling: f64,
    /// Sliding variable G_sl, N mm.
    pub sliding: f64,
    /// Boundary friction coefficient mu_bl, generally 0.15.
    pub boundary_friction: f64,
    /// Full-film friction coefficient mu_EHL, 0.05 for mineral and 0.04 for synthetic oil.
    pub film_friction: f64,
    /// Bore, m.
    pub bore: f64,
    /// Outside diameter, m.
    pub outside: f64,
    /// Replenishment constant K_rs: 3e-8 for oil level and oil jet, 6e-8 for grease and oil-air.
    pub replenishment: f64,
    /// Geometry constant K_z (3.1 for single-row deep groove, 4.4 for angular contact).
    pub geometry: f64,
    /// Kinematic viscosity at running temperature, m²/s.
    pub viscosity: f64,
    /// Torque of the seals, N m.
    pub seals: f64,
    /// Torque of oil drag, N m.
    pub drag: f64,
}

/// Friction torque (N m) of a rolling bearing at `speed` (rad/s), SKF's model:
/// M = phi_ish phi_rs G_rr (nu n)^0.6 + G_sl mu_sl + M_seal + M_drag, with
/// phi_ish = 1/(1 + 1.84e-9 (n d_m)^1.28 nu^0.64), phi_rs = exp(-K_rs nu n (d + D) [K_z/(2(D - d))]^(1/2)),
/// mu_sl = phi_bl mu_bl + (1 - phi_bl) mu_EHL, phi_bl = exp(-2.6e-8 (n nu)^1.4 d_m).
///
/// Range: the catalogue's; loads above the minimum load, steady running. Source: SKF, Rolling
/// bearings (2016), the SKF model for calculating the frictional moment.
pub fn skf(bearing: &Skf, speed: f64) -> f64 {
    let (bore, outside) = (bearing.bore * 1e3, bearing.outside * 1e3);
    let mean = 0.5 * (bore + outside);
    let (viscosity, rpm) = (bearing.viscosity * 1e6, speed.abs() * RPM);
    let product = viscosity * rpm;
    let shear = 1.0 / (1.0 + 1.84e-9 * (rpm * mean).powf(1.28) * viscosity.powf(0.64));
    let supply = (-bearing.replenishment * product * (bore + outside) * (bearing.geometry / (2.0 * (outside - bore))).sqrt()).exp();
    let boundary = (-2.6e-8 * product.powf(1.4) * mean).exp();
    let sliding = boundary * bearing.boundary_friction + (1.0 - boundary) * bearing.film_friction;
    (shear * supply * bearing.rolling * product.powf(0.6) + bearing.sliding * sliding) * 1e-3 + bearing.seals + bearing.drag
}
