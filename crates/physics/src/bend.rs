//! Curved channels: coils, and the bends of a serpentine. r = d/Dc, the diameter of the channel over the diameter of
//! the coil's centre line. The laws were validated up to about r = 0.2.

use std::f64::consts::PI;

use super::NotedValue;

/// Largest curvature ratio r (dimensionless) for which the coil laws were validated.
const CURVATURE_LIMIT: f64 = 0.2;

/// Reynolds number below which the flow in a bend stays laminar: 2300 (1 + 8.6 r^0.45).
///
/// Source: Schmidt, Chem.-Ing.-Tech. 39 (1967) 781. Range: r 0.012..0.2.
pub fn bend_critical_reynolds(curvature: f64) -> f64 {
    2300.0 * (1.0 + 8.6 * curvature.powf(0.45))
}

/// Nusselt number of laminar flow in a coil:
/// Nu = 3.66 + 0.08 (1 + 0.8 r^0.9) Re^m Pr^(1/3), m = 0.5 + 0.2903 r^0.194.
///
/// Source: Schmidt (1967), VDI Heat Atlas G3. Range: 100 < Re < [`bend_critical_reynolds`].
pub fn coil_nusselt_laminar(reynolds: f64, prandtl: f64, curvature: f64) -> f64 {
    let exponent = 0.5 + 0.2903 * curvature.powf(0.194);
    3.66 + 0.08 * (1.0 + 0.8 * curvature.powf(0.9)) * reynolds.powf(exponent) * prandtl.cbrt()
}

/// Nusselt number of turbulent flow in a coil.
///
/// Re < 2.2e4: 0.023 [1 + 14.8 (1 + r) r^(1/3)] Re^(0.8 - 0.22 r^0.1) Pr^(1/3);
/// above: 0.023 [1 + 3.6 (1 - r) r^0.8] Re^0.8 Pr^(1/3).
///
/// Source: Schmidt (1967). Range: [`bend_critical_reynolds`] < Re < 1.5e5. The two branches do not
/// meet at 2.2e4 (a few per cent apart).
pub fn coil_nusselt_schmidt(reynolds: f64, prandtl: f64, curvature: f64) -> f64 {
    let r = curvature;
    if reynolds < 2.2e4 {
        0.023 * (1.0 + 14.8 * (1.0 + r) * r.cbrt()) * reynolds.powf(0.8 - 0.22 * r.powf(0.1)) * prandtl.cbrt()
    } else {
        0.023 * (1.0 + 3.6 * (1.0 - r) * r.powf(0.8)) * reynolds.powf(0.8) * prandtl.cbrt()
    }
}

/// Nusselt number of turbulent flow of a liquid in a coil:
/// Nu = Pr^0.4/41 Re^(5/6) r^(1/12) [1 + 0.061/(Re r^2.5)^(1/6)].
///
/// Source: Mori and Nakayama, Int. J. Heat Mass Transfer 10 (1967) 681. Range: Pr >= 1, Re r^2.5 > 0.4.
pub fn coil_nusselt_mori_nakayama(reynolds: f64, prandtl: f64, curvature: f64) -> f64 {
    let dean_like = reynolds * curvature.powf(2.5);
    prandtl.powf(0.4) / 41.0 * reynolds.powf(5.0 / 6.0) * curvature.powf(1.0 / 12.0) * (1.0 + 0.061 / dean_like.powf(1.0 / 6.0))
}

/// Darcy friction factor of turbulent flow in a coil: 0.304 Re^-0.25 + 0.029 r^(1/2).
///
/// Source: Ito, J. Basic Eng. 81 (1959) 123. Range: 0.034 < Re r² < 300.
pub fn coil_friction_ito(reynolds: f64, curvature: f64) -> f64 {
    0.304 * reynolds.powf(-0.25) + 0.029 * curvature.sqrt()
}

/// Ratio by which the bends of a serpentine raise its mean film: sum(L_i h_i)/(L h_straight) over one straight pass and
/// one 180-degree bend, the bend's film reaching 10 diameters downstream.
///
/// `straight_nusselt` is the Nusselt number of the straight run ([`super::channel::nusselt`]). The bend's Nusselt
/// number follows [`coil_nusselt_mori_nakayama`] with r capped at 0.2. Below Re 1e4 the laws disagree: at Re 4858, Pr
/// 5.98, r 0.2 Mori and Nakayama and Xin and Ebadian both give 53, Schmidt's laminar law 77 and his turbulent one 86;
/// the two that agree are followed. The result is limited to 1.0..1.4; a note says if the limit took effect.
pub fn serpentine_bend_factor(
    reynolds: f64,
    prandtl: f64,
    diameter: f64,
    bend_diameter: f64,
    pass_length: f64,
    straight_nusselt: f64,
) -> NotedValue {
    let curvature = diameter / bend_diameter;
    let bend = PI * bend_diameter / 2.0;
    let reach = (10.0 * diameter).min(pass_length);
    let ratio = coil_nusselt_mori_nakayama(reynolds, prandtl, curvature.min(CURVATURE_LIMIT)) / straight_nusselt;
    let factor = (pass_length - reach + (bend + reach) * ratio.max(1.0)) / (pass_length + bend);
    let note = if factor > 1.4 {
        Some("the bend factor came out above 1.4 and was held there")
    } else if reynolds < 2300.0 || prandtl < 1.0 {
        Some("the bend factor rests on a law for turbulent flow of liquids")
    } else if curvature > CURVATURE_LIMIT {
        Some("the bends are tighter than the coil laws were validated for; r was capped at 0.2")
    } else {
        None
    };
    NotedValue { value: factor.clamp(1.0, 1.4), note }
}
