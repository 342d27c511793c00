//! Heat through the residual gas between the machine and the chamber wall.

use super::constants::GAS_CONSTANT;

/// Molar mass of dry air, kg/mol.
const AIR_MOLAR_MASS: f64 = 0.028_965;
/// Heat capacity ratio of air (dimensionless): 7/5, a gas of diatomic molecules.
const AIR_HEAT_CAPACITY_RATIO: f64 = 1.4;

/// Free-molecular film coefficient of air, W/(m² K):
/// h = alpha p (gamma+1)/(gamma-1) [R/(8 pi M T)]^(1/2).
///
/// `pressure` in Pa, `temperature` in K, `accommodation` the energy accommodation coefficient of
/// the machine's surface. Range: mean free path over ten times the distance (0.7 mm Pa/p).
/// Source: Knudsen's law, e.g. Dushman, Scientific Foundations of Vacuum Technique.
pub fn free_molecular(pressure: f64, temperature: f64, accommodation: f64) -> f64 {
    let gamma = AIR_HEAT_CAPACITY_RATIO;
    let flux = (GAS_CONSTANT / (8.0 * std::f64::consts::PI * AIR_MOLAR_MASS * temperature)).sqrt();
    accommodation * pressure * (gamma + 1.0) / (gamma - 1.0) * flux
}

/// Conductivity of air, W/(m K), Sutherland's law: 0.0241 (T/273)^(3/2) (273 + 194)/(T + 194).
///
/// Range: 250..500 K, +-2 % (checked against `CoolProp` 8.0; 3 % low at 200 K). Source: White, Viscous Fluid Flow.
pub fn air_conductivity(temperature: f64) -> f64 {
    0.0241 * (temperature / 273.0).powf(1.5) * (273.0 + 194.0) / (temperature + 194.0)
}

/// Film coefficient of residual air from the machine to the wall, W/(m² K), from free molecules to
/// still continuum: 1/h = 1/h_fm + gap/k (Sherman's blend).
///
/// `gap` in m is the distance to the wall; 0 leaves the continuum limit out. Convection is not included: above some
/// 1000 Pa natural convection sets in, and the result is a lower bound; see [`note`]. Source: Sherman (1963), in
/// Springer, Adv. Heat Transfer 7 (1971) 163.
///
/// ```
/// # use coldplate_physics::gas::film;
/// assert!((film(1.0, 300.0, 1.0, 0.0) - 1.171).abs() < 1e-3);
/// assert_eq!(film(0.0, 300.0, 1.0, 0.1), 0.0);
/// ```
pub fn film(pressure: f64, temperature: f64, accommodation: f64, gap: f64) -> f64 {
    let free = free_molecular(pressure, temperature, accommodation);
    if free <= 0.0 {
        return 0.0;
    }
    1.0 / (1.0 / free + gap.max(0.0) / air_conductivity(temperature))
}

/// Doubt about [`film`] at this pressure (Pa), if there is one.
pub fn note(pressure: f64) -> Option<&'static str> {
    (pressure > 1000.0).then_some("above 1000 Pa the residual gas may convect; conduction alone is a lower bound")
}
