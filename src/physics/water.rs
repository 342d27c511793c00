//! Properties of the coolant.
//!
//! Source of the fits: IAPWS-95 with the IAPWS formulations for viscosity (2008) and conductivity
//! (2011) at 0.2 MPa, evaluated with `CoolProp` 8.0 and, independently, with `iapws` 1.5.5 (equal
//! to seven digits). Between 0.1 and 1 MPa the properties move by at most 1e-3, which is ignored.

use crate::error::{Error, Result};
use crate::units::ZERO_CELSIUS;

/// Range inside which a liquid answers at all, degC.
const ACCEPTED: (f64, f64) = (0.0, 60.0);
/// Range of the fits, degC.
const FITTED: (f64, f64) = (5.0, 40.0);

/// A coolant.
#[derive(Debug, Clone, PartialEq)]
pub enum Liquid {
    /// Water: [`water`].
    Water,
    /// Water with the round numbers of the source paper, density 1000 kg/m³ and specific heat
    /// 4200 J/(kg K), which make rho cp 0.8 % too large at 26 degC; otherwise as [`Liquid::Water`].
    PaperWater,
    /// The same properties at every temperature.
    Constant {
        /// Density, kg/m³.
        density: f64,
        /// Specific heat, J/(kg K).
        specific_heat: f64,
        /// Dynamic viscosity, Pa s.
        viscosity: f64,
        /// Conductivity, W/(m K).
        conductivity: f64,
    },
}

/// Properties of a liquid at one temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiquidProperties {
    /// Density, kg/m³.
    pub density: f64,
    /// Specific heat, J/(kg K).
    pub specific_heat: f64,
    /// Dynamic viscosity, Pa s.
    pub viscosity: f64,
    /// Conductivity, W/(m K).
    pub conductivity: f64,
}

impl LiquidProperties {
    /// Prandtl number mu cp / k.
    pub fn prandtl(&self) -> f64 {
        self.viscosity * self.specific_heat / self.conductivity
    }

    /// Heat capacity per volume, J/(m³ K).
    pub fn volumetric_heat(&self) -> f64 {
        self.density * self.specific_heat
    }
}

impl Liquid {
    /// Properties at `temperature` (K).
    ///
    /// # Errors
    /// Water outside 0..60 degC.
    pub fn at(&self, temperature: f64) -> Result<LiquidProperties> {
        match self {
            Self::Water => water(temperature),
            Self::PaperWater => Ok(LiquidProperties { density: 1000.0, specific_heat: 4200.0, ..water(temperature)? }),
            &Self::Constant { density, specific_heat, viscosity, conductivity } => {
                Ok(LiquidProperties { density, specific_heat, viscosity, conductivity })
            }
        }
    }

    /// What is doubtful about the properties at `temperature` (K), if anything.
    pub fn note(&self, temperature: f64) -> Option<&'static str> {
        let celsius = temperature - ZERO_CELSIUS;
        if matches!(self, Self::Constant { .. }) || (FITTED.0..=FITTED.1).contains(&celsius) {
            None
        } else if (ACCEPTED.0..=ACCEPTED.1).contains(&celsius) {
            Some("water properties are fitted over 5..40 degC; between there and 0..60 degC the viscosity is up to 2.1 % off")
        } else {
            Some("water properties are not known outside 0..60 degC")
        }
    }
}

/// Liquid water at `temperature` (K) and about 0.2 MPa.
///
/// With x = (T/degC - 22.5)/17.5: polynomials in x for density (cubic), specific heat (cubic), the
/// logarithm of the viscosity (cubic) and conductivity (quadratic). Largest relative errors:
///
/// | range, degC | density | specific heat | viscosity | conductivity | Prandtl |
/// |---|---|---|---|---|---|
/// | 5..40 (the fit) | 4.5e-6 | 3.2e-5 | 2.2e-4 | 2.6e-4 | 5.1e-4 |
/// | 0..5 | 5.2e-5 | 3.9e-4 | 2.5e-3 | 1.6e-3 | 4.5e-3 |
/// | 40..50 | 1.1e-4 | 7.2e-4 | 5.4e-3 | 2.1e-3 | 4.0e-3 |
/// | 50..60 | 4.4e-4 | 2.9e-3 | 2.2e-2 | 5.4e-3 | 1.9e-2 |
///
/// # Errors
/// Temperatures outside 0..60 degC.
///
/// ```
/// # use coldplate::physics::water::water;
/// let state = water(293.15).unwrap();
/// assert!((state.density / 998.2523 - 1.0).abs() < 1e-5); // IAPWS-95
/// assert!(water(353.15).is_err());
/// ```
pub fn water(temperature: f64) -> Result<LiquidProperties> {
    let celsius = temperature - ZERO_CELSIUS;
    if !(ACCEPTED.0..=ACCEPTED.1).contains(&celsius) {
        return Err(Error::input("the water temperature leaves the range in which its properties are known")
            .read(format_args!("{celsius:.2} degC"))
            .help("stay between 0 and 60 degC, or describe the liquid by constant properties"));
    }
    let x = (celsius - 22.5) / 17.5;
    Ok(LiquidProperties {
        density: 997.707_9 + x * (-4.067_856 + x * (-1.566_046 + x * 0.190_096_5)),
        specific_heat: 4182.083 + x * (-9.304_152 + x * (9.680_501 - x * 3.416_477)),
        viscosity: (-6.966_516 + x * (-0.412_971_9 + x * (0.053_963_46 - x * 0.009_022_698))).exp(),
        conductivity: 0.602_450_3 + x * (0.030_184_18 - x * 0.004_257_554),
    })
}
