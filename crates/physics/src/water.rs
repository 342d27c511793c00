//! Properties and boiling point of liquid water.
//!
//! Source of the fits: IAPWS-95 with the IAPWS formulations for viscosity (2008) and conductivity (2011), evaluated
//! with `CoolProp` 8.0 and, independently, with `iapws` 1.5.5 (equal to seven digits), at 0.2 MPa, above 120 degC at
//! saturation. Between saturation and 1 MPa density, specific heat, viscosity and conductivity change by at most
//! 1.2e-3, which is ignored.

use coldplate_base::error::{Error, Result};
use coldplate_base::units::ZERO_CELSIUS;

/// Range of the properties, degC: the range of the fits.
const RANGE: (f64, f64) = (0.0, 150.0);

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

/// Range of the properties, K: 0 to 150 degC.
pub fn range() -> (f64, f64) {
    (RANGE.0 + ZERO_CELSIUS, RANGE.1 + ZERO_CELSIUS)
}

/// Liquid water at `temperature` (K), at pressures from saturation to 1 MPa.
///
/// The properties are polynomials for density, specific heat, the logarithm of the viscosity, and conductivity. Their
/// degree is three over 5..40 degC (conductivity: two), five above and two below; value and slope are continuous at 5
/// and 40 degC. Largest relative errors at the pressures of the fit:
///
/// | range, degC | density | specific heat | viscosity | conductivity | Prandtl |
/// |---|---|---|---|---|---|
/// | 0..5 | 7.6e-6 | 5.4e-5 | 3.7e-4 | 3.8e-4 | 8e-4 |
/// | 5..40 | 4.5e-6 | 3.2e-5 | 2.2e-4 | 2.6e-4 | 5.1e-4 |
/// | 40..150 | 1.9e-5 | 1.2e-4 | 8.4e-4 | 5.5e-4 | 1.3e-3 |
///
/// # Errors
/// Temperatures outside 0..150 degC.
///
/// ```
/// # use coldplate_physics::water::water;
/// let state = water(293.15).unwrap();
/// assert!((state.density / 998.2523 - 1.0).abs() < 1e-5); // IAPWS-95
/// assert!(water(433.15).is_err());
/// ```
pub fn water(temperature: f64) -> Result<LiquidProperties> {
    let celsius = temperature - ZERO_CELSIUS;
    if !(RANGE.0..=RANGE.1).contains(&celsius) {
        return Err(Error::input("the water temperature leaves the range in which its properties are known")
            .read(format_args!("{celsius:.2} degC"))
            .help("stay between 0 and 150 degC, or describe the liquid by a [fluid.NAME] of its own"));
    }
    let [density, specific_heat, log_viscosity, conductivity] = [0, 1, 2, 3].map(|property| fit(property, celsius));
    Ok(LiquidProperties { density, specific_heat, viscosity: log_viscosity.exp(), conductivity })
}

/// Specific heat of the source paper's water, J/(kg K).
pub(crate) const PAPER_SPECIFIC_HEAT: f64 = 4200.0;

/// Specific heat (J/(kg K)) of liquid water at a temperature (K) within the range.
pub(crate) fn specific_heat(temperature: f64) -> f64 {
    fit(1, temperature - ZERO_CELSIUS)
}

/// Temperatures (K) at which the polynomials join.
pub(crate) fn joins() -> [f64; 2] {
    JOINS.map(|t| t + ZERO_CELSIUS)
}

/// Temperatures at which the polynomials join, degC.
const JOINS: [f64; 2] = [5.0, 40.0];

/// A property (0: density, 1: specific heat, 2: ln viscosity, 3: conductivity) at a temperature in degC.
fn fit(property: usize, celsius: f64) -> f64 {
    match celsius {
        t if t < JOINS[0] => polynomial(&COLD[property], (5.0 - t) / 5.0),
        t if t <= JOINS[1] => polynomial(&MILD[property], (t - 22.5) / 17.5),
        t => polynomial(&HOT[property], (t - 40.0) / 110.0),
    }
}

/// Coefficients below 5 degC, in powers of (5 - T/degC)/5: density, specific heat, ln viscosity, conductivity (SI).
/// Fitted, see the module.
const COLD: [[f64; 3]; 4] = [
    [1_000.019_613_5, 0.104_421_283_709, -0.238_382_279_873],
    [4_204.484_13, 11.118_452_857_8, 3.579_318_287_02],
    [-6.490_557_942, 0.156_561_975_428, 0.009_684_486_425_46],
    [0.568_008_566, -0.011_056_939_427_9, -0.001_436_606_684_07],
];

/// Coefficients between 5 and 40 degC, in powers of (T/degC - 22.5)/17.5. Fitted, see the module.
const MILD: [[f64; 4]; 4] = [
    [997.707_9, -4.067_856, -1.566_046, 0.190_096_5],
    [4_182.083, -9.304_152, 9.680_501, -3.416_477],
    [-6.966_516, -0.412_971_9, 0.053_963_46, -0.009_022_698],
    [0.602_450_3, 0.030_184_18, -0.004_257_554, 0.0],
];

/// Coefficients above 40 degC, in powers of (T/degC - 40)/110. Fitted, see the module.
const HOT: [[f64; 6]; 4] = [
    [992.264_094_5, -41.672_139_19, -48.591_522_023_3, 31.379_645_576_1, -24.564_433_192_1, 8.209_192_353_13],
    [4_179.042_872, -1.210_509_435_62, 247.701_920_836, -489.300_026_922, 613.384_444_982, -243.040_768_735],
    [-7.334_547_138, -2.087_567_893_84, 1.538_775_438_22, -1.553_590_878_83, 1.295_960_271_02, -0.468_009_221_091],
    [0.628_376_926, 0.136_205_595_441, -0.025_363_740_295_1, -0.254_579_839_486, 0.341_737_445_628, -0.145_730_947_647],
];

/// Horner's scheme.
fn polynomial(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| c + x * sum)
}

/// Coefficients of the saturation curve (temperature in K, pressure in MPa): IAPWS-IF97, region 4.
const SATURATION: [f64; 10] = [
    1_167.052_145_276_7,
    -724_213.167_032_06,
    -17.073_846_940_092,
    12_020.824_702_470,
    -3_232_555.032_233_3,
    14.915_108_613_530,
    -4_823.265_736_159_1,
    405_113.405_420_57,
    -0.238_555_575_678_49,
    650.175_348_447_98,
];

/// Pressure (Pa) at which water of `temperature` (K) boils: IAPWS-IF97, equation 30, exact to 3e-4 against IAPWS-95.
///
/// Range: 273.15..647.096 K; `None` outside.
///
/// ```
/// # use coldplate_physics::water::saturation_pressure;
/// assert!((saturation_pressure(300.0).unwrap() - 3536.58941).abs() < 1e-5); // IAPWS-IF97, table 35
/// ```
pub fn saturation_pressure(temperature: f64) -> Option<f64> {
    let n = &SATURATION;
    if !(273.15..=647.096).contains(&temperature) {
        return None;
    }
    let x = temperature + n[8] / (temperature - n[9]);
    let a = x * x + n[0] * x + n[1];
    let b = n[2] * x * x + n[3] * x + n[4];
    let c = n[5] * x * x + n[6] * x + n[7];
    Some(1e6 * (2.0 * c / (-b + (b * b - 4.0 * a * c).sqrt())).powi(4))
}

/// Temperature (K) at which water boils under `pressure` (Pa): IAPWS-IF97, equation 31.
///
/// Range: 611.213 Pa..22.064 MPa; `None` outside.
///
/// ```
/// # use coldplate_physics::water::saturation_temperature;
/// assert!((saturation_temperature(1e5).unwrap() - 372.755919).abs() < 1e-6); // IAPWS-IF97, table 36
/// ```
pub fn saturation_temperature(pressure: f64) -> Option<f64> {
    let n = &SATURATION;
    if !(611.213..=22.064e6).contains(&pressure) {
        return None;
    }
    let x = (pressure / 1e6).powf(0.25);
    let e = x * x + n[2] * x + n[5];
    let f = n[0] * x * x + n[3] * x + n[6];
    let g = n[1] * x * x + n[4] * x + n[7];
    let d = 2.0 * g / (-f - (f * f - 4.0 * e * g).sqrt());
    Some(0.5 * (n[9] + d - ((n[9] + d).powi(2) - 4.0 * (n[8] + n[9] * d)).sqrt()))
}
