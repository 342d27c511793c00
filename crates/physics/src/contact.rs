//! Conductance between touching rough surfaces: solid spots, gap gas and radiation in parallel.
//!
//! All conductances here are upper bounds for real plates: unflat surfaces add a macroscopic constriction in series.
//! Pressed bolted joints lose pressure beyond 1.5..2 head diameters from each bolt.

use super::radiation::{SIGMA, linearised};

/// Standard atmosphere, Pa (exact by definition).
const ATMOSPHERE: f64 = 101_325.0;
/// Reference temperature of the mean free path of [`GapGas`], K: 25 degC.
pub const GAS_REFERENCE_TEMPERATURE: f64 = 298.15;
/// Mean free path of air at 1 atm and 298.15 K, m.
pub const AIR_MEAN_FREE_PATH: f64 = 68e-9;

/// Deformation of the asperities.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Asperities {
    /// Plastic: microhardness of the softer side, Pa (Cooper, Mikic and Yovanovich).
    Plastic {
        /// Contact microhardness, Pa.
        hardness: f64,
    },
    /// Elastic: effective modulus E', 1/E' = (1-nu1²)/E1 + (1-nu2²)/E2, Pa (Mikic).
    Elastic {
        /// Effective modulus, Pa.
        modulus: f64,
    },
}

/// Gas in the gap between the asperities.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GapGas {
    /// Conductivity of the gas in bulk, W/(m K).
    pub conductivity: f64,
    /// Gas pressure, Pa.
    pub pressure: f64,
    /// Mean distance between the surfaces, m; `None` takes [`mean_gap`].
    pub gap: Option<f64>,
    /// Rarefaction length alpha beta Lambda at 1 atm and 298.15 K, m; see [`rarefaction_length`].
    pub rarefaction: f64,
}

/// A contact between two rough, flat surfaces.
#[derive(Debug, Clone, PartialEq)]
pub struct Rough {
    /// Combined roughness (s1² + s2²)^(1/2), m.
    pub roughness: f64,
    /// Combined mean absolute asperity slope (m1² + m2²)^(1/2).
    pub slope: f64,
    /// Deformation of the asperities.
    pub asperities: Asperities,
    /// Contact pressure, Pa.
    pub pressure: f64,
    /// Gas in the gap; `None` for vacuum.
    pub gas: Option<GapGas>,
    /// Emissivities of the two surfaces; `None` leaves radiation across the gap out.
    pub emissivity: Option<[f64; 2]>,
}

/// Conductivity of a body at the temperature of the contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conductivity {
    /// Conductivity, W/(m K).
    pub value: f64,
    /// Derivative with respect to temperature, W/(m K²).
    pub slope: f64,
}

/// Harmonic mean 2 k1 k2 / (k1 + k2) of two conductivities.
pub fn harmonic_mean(k1: f64, k2: f64) -> f64 {
    2.0 * k1 * k2 / (k1 + k2)
}

/// Solid-spot conductance of plastically flattened asperities, W/(m² K):
/// h = 1.25 k_s (m/sigma) (p/H)^0.95, k_s the harmonic mean conductivity.
///
/// Range: 1e-6 <= p/H <= 2.3e-2, conforming bead-blasted or lapped surfaces; +-20..50 %.
/// Source: Cooper, Mikic and Yovanovich, Int. J. Heat Mass Transfer 12 (1969) 279; Yovanovich (1981).
pub(crate) fn plastic_spots(conductivity: f64, slope: f64, roughness: f64, pressure_over_hardness: f64) -> f64 {
    1.25 * conductivity * slope / roughness * pressure_over_hardness.powf(0.95)
}

/// Solid-spot conductance of elastic asperities, W/(m² K): h = 1.55 k_s (m/sigma) (2^(1/2) p/(E' m))^0.94.
///
/// Source: Mikic, Int. J. Heat Mass Transfer 17 (1974) 205. For polished or once-loaded hard surfaces.
pub(crate) fn elastic_spots(conductivity: f64, slope: f64, roughness: f64, pressure_over_modulus: f64) -> f64 {
    1.55 * conductivity * slope / roughness * (std::f64::consts::SQRT_2 * pressure_over_modulus / slope).powf(0.94)
}

/// Mean distance between the surfaces, m: Y = 1.53 sigma (p/H)^-0.097.
///
/// Range: 1e-5 <= p/H <= 2e-2. Source: Yovanovich (1981), AIAA 86-1164.
pub(crate) fn mean_gap(roughness: f64, pressure_over_hardness: f64) -> f64 {
    1.53 * roughness * pressure_over_hardness.powf(-0.097)
}

/// Rarefaction length M = alpha beta Lambda, m, at the conditions of the mean free path Lambda:
/// alpha = (2-a1)/a1 + (2-a2)/a2 with accommodation coefficients a, beta = 2 gamma/((gamma+1) Pr).
///
/// With this beta the rarefied limit k/M of the gap conductance meets the free-molecular law of
/// [`super::gas`] within a few per cent; beta is 1.64 for air, and 2 is seen in rough estimates.
/// Source: Yovanovich, DeVaal and Hegazy, AIAA 82-0888.
pub fn rarefaction_length(accommodation: [f64; 2], heat_capacity_ratio: f64, prandtl: f64, mean_free_path: f64) -> f64 {
    let alpha: f64 = accommodation.iter().map(|a| (2.0 - a) / a).sum();
    alpha * 2.0 * heat_capacity_ratio / ((heat_capacity_ratio + 1.0) * prandtl) * mean_free_path
}

/// Conductance of the gas between the asperities, W/(m² K): h = k_g/(Y + M), where the rarefaction
/// length M grows as (1 atm/p)(T/298.15 K).
///
/// Source: Yovanovich (1981). From continuum to free molecules. A gap in air is worth thousands of
/// W/(m² K), in vacuum nothing: a joint measured in air says little about vacuum.
pub fn gap_gas(conductivity: f64, gap: f64, rarefaction: f64, pressure: f64, temperature: f64) -> f64 {
    if pressure <= 0.0 {
        return 0.0;
    }
    conductivity / (gap + rarefaction * (ATMOSPHERE / pressure) * (temperature / GAS_REFERENCE_TEMPERATURE))
}

/// Conductance of a contact, W/(m² K): solid spots, gap gas and radiation in parallel.
///
/// `k1`, `k2` are the conductivities of the two bodies, W/(m K); `mean_temperature` that of the
/// interface, K. See [`note`] for the range.
pub fn conductance(rough: &Rough, k1: f64, k2: f64, mean_temperature: f64) -> f64 {
    conductance_with_slope(rough, [k1, k2].map(|value| Conductivity { value, slope: 0.0 }), mean_temperature).0
}

/// [`conductance`] between two bodies, and its derivative with respect to the mean temperature, W/(m² K²).
pub fn conductance_with_slope(rough: &Rough, [first, second]: [Conductivity; 2], mean_temperature: f64) -> (f64, f64) {
    let solid = harmonic_mean(first.value, second.value);
    let spots = match rough.asperities {
        Asperities::Plastic { hardness } => plastic_spots(solid, rough.slope, rough.roughness, rough.pressure / hardness),
        Asperities::Elastic { modulus } => elastic_spots(solid, rough.slope, rough.roughness, rough.pressure / modulus),
    };
    // The spot conductance is proportional to the harmonic mean 2/(1/k1 + 1/k2), which has this relative slope.
    let spots_slope = spots * solid / 2.0 * (first.slope / (first.value * first.value) + second.slope / (second.value * second.value));
    let (gas, gas_slope) = rough.gas.as_ref().map_or((0.0, 0.0), |gas| {
        let gap = gas.gap.unwrap_or_else(|| mean_gap(rough.roughness, relative_pressure(rough)));
        let film = gap_gas(gas.conductivity, gap, gas.rarefaction, gas.pressure, mean_temperature);
        // Conductance k_g/(Y + M T/T0): the slope is -film M/T0 over the sum Y + M T/T0.
        let lengthening = gas.rarefaction * (ATMOSPHERE / gas.pressure) / GAS_REFERENCE_TEMPERATURE;
        (film, if film > 0.0 { -film * film / gas.conductivity * lengthening } else { 0.0 })
    });
    let radiation = rough.emissivity.map_or(0.0, |[e1, e2]| linearised(1.0 / (1.0 / e1 + 1.0 / e2 - 1.0), mean_temperature));
    (spots + gas + radiation, spots_slope + gas_slope + 3.0 * radiation / mean_temperature)
}

/// p/H, or for elastic asperities its counterpart 2^(1/2) p/(E' m).
fn relative_pressure(rough: &Rough) -> f64 {
    match rough.asperities {
        Asperities::Plastic { hardness } => rough.pressure / hardness,
        Asperities::Elastic { modulus } => std::f64::consts::SQRT_2 * rough.pressure / (modulus * rough.slope),
    }
}

/// Doubt about [`conductance`] for this contact, if there is one.
pub fn note(rough: &Rough) -> Option<&'static str> {
    let relative = relative_pressure(rough);
    if !(1e-6..=2.3e-2).contains(&relative) {
        Some("the contact pressure over hardness leaves 1e-6..2.3e-2, the range of the rough-contact law")
    } else if rough.gas.is_some_and(|gas| gas.gap.is_none()) && !(1e-5..=2e-2).contains(&relative) {
        Some("the contact pressure over hardness leaves 1e-5..2e-2, the range of the mean-gap law")
    } else {
        None
    }
}

/// Conductance by radiation across a gap between large parallel surfaces at `t1` and `t2` (K),
/// W/(m² K): sigma (t1² + t2²)(t1 + t2)/(1/e1 + 1/e2 - 1). Exact for grey surfaces.
pub fn gap_radiation(e1: f64, e2: f64, t1: f64, t2: f64) -> f64 {
    SIGMA * (t1 * t1 + t2 * t2) * (t1 + t2) / (1.0 / e1 + 1.0 / e2 - 1.0)
}
