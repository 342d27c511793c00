//! Free convection from bodies to a still gas around them.
//!
//! Every law gives a Nusselt number of the Rayleigh number Ra = g beta |Ts - T| L³ rho² cp/(mu k), with the gas at the film
//! temperature (Ts + T)/2 and beta = 1/film temperature. Uncertainty +-10..20 %; draughts and neighbours matter more.

use super::constants::{GAS_CONSTANT, GRAVITY};

/// Range of film temperatures for the properties of the gases, K: the range of the fits of [`Gas`].
const RANGE: (f64, f64) = (200.0, 600.0);

/// A body in a gas.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeConvection {
    /// Shape of the body.
    pub shape: BodyShape,
    /// Characteristic length of the body, m: see [`BodyShape`].
    pub length: f64,
    /// Gas around the body.
    pub gas: Gas,
    /// Pressure of the gas, Pa; ideal, 1e3..1e6.
    pub pressure: f64,
}

/// Shape of a body, with its law and its characteristic length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BodyShape {
    /// Vertical plate or wide vertical cylinder of this height:
    /// Nu = {0.825 + 0.387 Ra^(1/6)/[1 + (0.492/Pr)^(9/16)]^(8/27)}². Ra 0.1..1e12.
    /// Source: Churchill and Chu, Int. J. Heat Mass Transfer 18 (1975) 1323.
    VerticalPlate,
    /// Horizontal plate facing up; characteristic length: area over perimeter. Warmer than the gas, it follows the
    /// larger of 0.54 Ra^(1/4) (printed for 1e4..1e7) and 0.15 Ra^(1/3) (to 1e11); the two meet at 4.7e6. Colder than
    /// the gas, it follows the law of a warmer [`BodyShape::FacingDown`]. Source: McAdams (1954), Lloyd and Moran (1974),
    /// Incropera equations 9.30 and 9.31.
    FacingUp,
    /// Horizontal plate facing down; characteristic length: area over perimeter. Warmer than the gas, it follows 0.52
    /// Ra^(1/5), Ra 1e4..1e9, Pr >= 0.7; colder, it follows the law of a warmer [`BodyShape::FacingUp`]. Source: Radziemska
    /// and Lewandowski (2001), Incropera equation 9.32.
    FacingDown,
    /// Long horizontal cylinder of this diameter:
    /// Nu = {0.60 + 0.387 Ra^(1/6)/[1 + (0.559/Pr)^(9/16)]^(8/27)}². Ra 1e-5..1e12.
    /// Source: Churchill and Chu, Int. J. Heat Mass Transfer 18 (1975) 1049.
    HorizontalCylinder,
    /// Sphere of this diameter, with F = [1 + (0.469/Pr)^(9/16)]^(-16/9):
    /// Nu = 2 + 0.589 (Ra F)^(1/4) (1 + 7.44e-8 Ra F)^(1/12). Ra to 1e13, Pr >= 0.6.
    /// Source: Churchill in Heat Exchanger Design Handbook (1983), 2.5.7.
    Sphere,
}

/// A gas at moderate pressure. Cubic polynomials over 200..600 K fitted to the reference equations of `CoolProp` 8.0 at 1 atm;
/// conductivity and viscosity to 5e-4, specific heat to 4e-4, the ideal gas's density to 3e-3.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gas {
    /// Dry air (Lemmon et al. 2000; Lemmon and Jacobsen 2004).
    Air,
    /// Nitrogen (Span et al. 2000; Lemmon and Jacobsen 2004).
    Nitrogen,
    /// Argon (Tegeler et al. 1999; Lemmon and Jacobsen 2004).
    Argon,
    /// Helium (Ortiz-Vega 2013; Hands and Arp 1981).
    Helium,
}

/// A heat flux with its derivatives with respect to both temperatures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flux {
    /// Heat flux from the surface to the gas, W/m².
    pub value: f64,
    /// Derivative with respect to the temperature of the surface, W/(m² K).
    pub per_surface: f64,
    /// Derivative with respect to the temperature of the gas, W/(m² K).
    pub per_gas: f64,
}

impl BodyShape {
    /// All shapes, in the order of [`BodyShape::NAMES`].
    pub const ALL: [Self; 5] = [Self::VerticalPlate, Self::FacingUp, Self::FacingDown, Self::HorizontalCylinder, Self::Sphere];
    /// Names in files.
    pub const NAMES: [&str; 5] = ["vertical_plate", "facing_up", "facing_down", "horizontal_cylinder", "sphere"];

    /// Range of Rayleigh numbers of the law, for a surface warmer or colder than the gas.
    pub fn range(self, is_warmer: bool) -> (f64, f64) {
        match (self, is_warmer) {
            (Self::VerticalPlate, _) => (0.1, 1e12),
            (Self::FacingUp, true) | (Self::FacingDown, false) => (1e4, 1e11),
            (Self::FacingUp, false) | (Self::FacingDown, true) => (1e4, 1e9),
            (Self::HorizontalCylinder, _) => (1e-5, 1e12),
            (Self::Sphere, _) => (0.0, 1e13),
        }
    }

    /// Nusselt number at a Rayleigh and a Prandtl number, of a surface warmer than the gas or colder.
    pub fn nusselt(self, rayleigh: f64, prandtl: f64, is_warmer: bool) -> f64 {
        self.law(Dual::constant(rayleigh), Dual::constant(prandtl), is_warmer).value
    }

    /// Nusselt number of the law, at least 1: power laws vanish with the Rayleigh number, but conduction through the
    /// still gas remains.
    fn law(self, ra: Dual, pr: Dual, is_warmer: bool) -> Dual {
        let larger = |a: Dual, b: Dual| if b.value > a.value { b } else { a };
        let still = Dual::constant(1.0);
        let bracket = |c: f64| Dual::constant(1.0) + pr.powf(-0.5625).times(c.powf(0.5625));
        let churchill_chu = |c: f64, still: f64| {
            let root = Dual::constant(still) + (ra.powf(1.0 / 6.0) * bracket(c).powf(-8.0 / 27.0)).times(0.387);
            root * root
        };
        match (self, is_warmer) {
            (Self::VerticalPlate, _) => churchill_chu(0.492, 0.825),
            (Self::HorizontalCylinder, _) => churchill_chu(0.559, 0.60),
            (Self::FacingUp, true) | (Self::FacingDown, false) => {
                larger(still, larger(ra.powf(0.25).times(0.54), ra.powf(1.0 / 3.0).times(0.15)))
            }
            (Self::FacingUp, false) | (Self::FacingDown, true) => larger(still, ra.powf(0.2).times(0.52)),
            (Self::Sphere, _) => {
                let reduced = ra * bracket(0.469).powf(-16.0 / 9.0);
                let bend = (Dual::constant(1.0) + reduced.times(7.44e-8)).powf(1.0 / 12.0);
                Dual::constant(2.0) + (reduced.powf(0.25) * bend).times(0.589)
            }
        }
    }
}

impl Gas {
    /// All gases, in the order of [`Gas::NAMES`].
    pub const ALL: [Self; 4] = [Self::Air, Self::Nitrogen, Self::Argon, Self::Helium];
    /// Names in files.
    pub const NAMES: [&str; 4] = ["air", "nitrogen", "argon", "helium"];

    /// Molar mass (kg/mol), and polynomial coefficients in (T/K - 400)/200 of conductivity (W/(m K)), viscosity (Pa s)
    /// and specific heat (J/(kg K)).
    fn fits(self) -> (f64, [[f64; 4]; 3]) {
        match self {
            Self::Air => (
                0.028_965_46,
                [
                    [0.033_458_4, 0.013_486_2, -0.001_190_5, 0.000_271_966],
                    [2.306_02e-5, 8.489_9e-6, -9.991_72e-7, 2.307_58e-7],
                    [1_014.28, 23.932_2, 14.931_3, -1.698_6],
                ],
            ),
            Self::Nitrogen => (
                0.028_013_48,
                [
                    [0.032_812, 0.012_996_5, -0.001_240_01, 0.000_287_805],
                    [2.221_31e-5, 8.111_8e-6, -9.595_45e-7, 2.241_97e-7],
                    [1_045.14, 14.860_5, 14.439_1, 1.045_97],
                ],
            ),
            Self::Argon => (
                0.039_948,
                [
                    [0.022_519, 0.008_841_56, -0.000_956_752, 0.000_177_208],
                    [2.870_73e-5, 1.127_65e-5, -1.202_66e-6, 2.255e-7],
                    [520.879, -0.571_491, 1.098_87, -0.942_786],
                ],
            ),
            Self::Helium => (
                0.004_002_602,
                [
                    [0.190_399, 0.065_977_8, -0.005_136_78, 0.001_247_1],
                    [2.429_6e-5, 8.391_91e-6, -6.086_66e-7, 1.463_25e-7],
                    [5_193.12, -0.058_460_5, 0.133_876, -0.108_383],
                ],
            ),
        }
    }

    /// Conductivity (W/(m K)), viscosity (Pa s) and specific heat (J/(kg K)) at a temperature (K) between 200 and 600 K.
    pub fn at(self, temperature: f64) -> [f64; 3] {
        self.properties(Dual::constant(temperature)).map(|p| p.value)
    }

    fn properties(self, temperature: Dual) -> [Dual; 3] {
        let x = (temperature + Dual::constant(-400.0)).times(1.0 / 200.0);
        self.fits().1.map(|fit| fit.iter().rev().fold(Dual::constant(0.0), |sum, c| sum * x + Dual::constant(*c)))
    }
}

impl FreeConvection {
    /// Flux from a surface to the gas (temperatures in K), with its exact derivatives.
    ///
    /// Outside 200..600 K of film temperature the properties at the end of that range are taken; see [`FreeConvection::note`].
    ///
    /// ```
    /// # use coldplate_physics::convection::{FreeConvection, Gas, BodyShape};
    /// let plate = FreeConvection { shape: BodyShape::VerticalPlate, length: 0.3, gas: Gas::Air, pressure: 101_325.0 };
    /// let flux = plate.flux(333.15, 293.15);
    /// assert!((4.0..6.0).contains(&(flux.value / 40.0))); // a film of some 5 W/(m2 K)
    /// ```
    pub fn flux(&self, surface: f64, gas: f64) -> Flux {
        let along =
            |by_surface: f64, by_gas: f64| self.of(Dual { value: surface, slope: by_surface }, Dual { value: gas, slope: by_gas }).1;
        let (per_surface, per_gas) = (along(1.0, 0.0), along(0.0, 1.0));
        Flux { value: per_surface.value, per_surface: per_surface.slope, per_gas: per_gas.slope }
    }

    /// Rayleigh number between a surface and the gas (temperatures in K).
    pub fn rayleigh(&self, surface: f64, gas: f64) -> f64 {
        self.of(Dual::constant(surface), Dual::constant(gas)).0.value
    }

    /// Doubt about the flux between a surface and the gas (temperatures in K), if there is one.
    pub fn note(&self, surface: f64, gas: f64) -> Option<String> {
        let film = 0.5 * (surface + gas);
        if !(RANGE.0..=RANGE.1).contains(&film) {
            return Some(format!("the gas is known from {} to {} K, and the film is at {film:.1} K", RANGE.0, RANGE.1));
        }
        let (rayleigh, (low, high)) = (self.rayleigh(surface, gas), self.shape.range(surface >= gas));
        // A surface hardly warmer than the gas gives hardly any heat, whatever the law.
        let is_weak = rayleigh < low && (surface - gas).abs() < 0.5;
        (!is_weak && !(low..=high).contains(&rayleigh))
            .then(|| format!("the law holds for Rayleigh numbers from {low:e} to {high:e}, and here it is {rayleigh:.2e}"))
    }

    /// Rayleigh number and flux.
    fn of(&self, surface: Dual, gas: Dual) -> (Dual, Dual) {
        let apart = surface + gas.times(-1.0);
        let mean = (surface + gas).times(0.5);
        let film = if (RANGE.0..=RANGE.1).contains(&mean.value) { mean } else { Dual::constant(mean.value.clamp(RANGE.0, RANGE.1)) };
        let [conductivity, viscosity, heat] = self.gas.properties(film);
        let density = film.powf(-1.0).times(self.pressure * self.gas.fits().0 / GAS_CONSTANT);
        let drop = apart.times(if apart.value < 0.0 { -1.0 } else { 1.0 });
        let lift = drop * film.powf(-1.0) * density * density * heat * (viscosity * conductivity).powf(-1.0);
        let rayleigh = lift.times(GRAVITY * self.length.powi(3));
        let prandtl = viscosity * heat * conductivity.powf(-1.0);
        let nusselt = self.shape.law(rayleigh, prandtl, apart.value >= 0.0);
        (rayleigh, nusselt * conductivity.times(1.0 / self.length) * apart)
    }
}

/// A number with its derivative along one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Dual {
    value: f64,
    slope: f64,
}

impl Dual {
    fn constant(value: f64) -> Self {
        Self { value, slope: 0.0 }
    }

    fn times(self, factor: f64) -> Self {
        Self { value: self.value * factor, slope: self.slope * factor }
    }

    /// A power. At x = 0 the derivative, which may be infinite, is left out: it would be multiplied by a factor that is
    /// zero there.
    fn powf(self, exponent: f64) -> Self {
        let slope = if self.value == 0.0 { 0.0 } else { exponent * self.value.powf(exponent - 1.0) * self.slope };
        Self { value: self.value.powf(exponent), slope }
    }
}

impl std::ops::Add for Dual {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, slope: self.slope + other.slope }
    }
}

impl std::ops::Mul for Dual {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self { value: self.value * other.value, slope: self.slope * other.value + self.value * other.slope }
    }
}
