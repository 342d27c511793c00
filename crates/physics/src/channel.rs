//! Heat transfer and hydraulics of a straight round channel: film, friction, bends, flow split.
//!
//! Uncertainty of the film: +-10 % when turbulent, +-20..30 % for Reynolds numbers 2300..6000. The Nusselt number is
//! the mean over the run; a network uses it in every cell of the run.

pub use super::bend::{
    bend_critical_reynolds, coil_friction_ito, coil_nusselt_laminar, coil_nusselt_mori_nakayama, coil_nusselt_schmidt,
    serpentine_bend_factor,
};
pub use super::hydraulics::{friction, konakov, pressure_drop, split_flow};
pub use super::regime::{LAMINAR_LIMIT, Regime, TURBULENT_LIMIT};

use super::water::LiquidProperties;

/// Thermal boundary condition at the wall; only the laminar branch depends on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wall {
    /// Uniform heat flux.
    Flux,
    /// Uniform temperature.
    Temperature,
}

/// The film in a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Film {
    /// Film coefficient, W/(m² K).
    pub coefficient: f64,
    /// Nusselt number.
    pub nusselt: f64,
    /// Reynolds number.
    pub reynolds: f64,
    /// Flow regime.
    pub regime: Regime,
    /// Doubt about the film, if there is one.
    pub note: Option<&'static str>,
}

/// A straight round channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StraightChannel {
    /// Hydraulic diameter, m.
    pub diameter: f64,
    /// Heated length, m.
    pub length: f64,
    /// Thermal boundary condition at the wall.
    pub wall: Wall,
    /// Whether the velocity profile is developed where heating begins.
    pub velocity_developed: bool,
}

impl StraightChannel {
    fn diameter_over_length(&self) -> f64 {
        self.diameter / self.length
    }
}

/// Reynolds number 4 rho Q / (pi d mu) of a volume flow (m³/s) in a round channel (m).
pub fn reynolds(flow: f64, diameter: f64, state: &LiquidProperties) -> f64 {
    4.0 * state.density * flow.abs() / (std::f64::consts::PI * diameter * state.viscosity)
}

/// Mean Nusselt number of a straight round channel over its heated length.
///
/// * laminar, Re <= 2300, wall temperature:
///   Nu³ = 3.66³ + 0.7³ + [1.615 (Re Pr d/L)^(1/3) - 0.7]³ + [(2/(1 + 22 Pr))^(1/6) (Re Pr d/L)^(1/2)]³;
///   wall flux: Nu³ = 4.364³ + 0.6³ + [1.953 (Re Pr d/L)^(1/3) - 0.6]³ + [0.924 Pr^(1/3) (Re d/L)^(1/2)]³;
///   the last term only while the velocity profile develops;
/// * turbulent, Re >= 4000:
///   Nu = (f/8)(Re - 1000) Pr / [1 + 12.7 (f/8)^(1/2) (Pr^(2/3) - 1)] [1 + (d/L)^(2/3)],
///   with the smooth f of [`konakov`] always (a rough or bend-augmented f here gives nonsense);
/// * between: linear in Re from Nu(2300) to Nu(4000). Continuous, with a kink at both ends.
///
/// All branches times (Pr/Pr_wall)^0.11. Pass `prandtl` again for `prandtl_wall` to leave it out.
///
/// Range: Re up to 1e6, 0.1 <= Pr <= 1000, d/L <= 1, 0.1 <= Pr/Pr_wall <= 10; see [`note`].
/// Source: Gnielinski, Int. J. Heat Mass Transfer 63 (2013) 134; VDI Heat Atlas, chapter G1.
///
/// ```
/// # use coldplate_physics::channel::{StraightChannel, Wall, nusselt};
/// let long = StraightChannel { diameter: 0.01, length: f64::INFINITY, wall: Wall::Temperature, velocity_developed: true };
/// assert!((nusselt(&long, 100.0, 6.0, 6.0) - 3.66).abs() < 1e-2);
/// ```
pub fn nusselt(channel: &StraightChannel, reynolds: f64, prandtl: f64, prandtl_wall: f64) -> f64 {
    let laminar = |re: f64| laminar_nusselt(channel, re, prandtl);
    let turbulent = |re: f64| turbulent_nusselt(channel, re, prandtl);
    let straight = match Regime::at(reynolds) {
        Regime::Laminar => laminar(reynolds),
        Regime::Turbulent => turbulent(reynolds),
        Regime::Transition => {
            let share = (reynolds - LAMINAR_LIMIT) / (TURBULENT_LIMIT - LAMINAR_LIMIT);
            (1.0 - share) * laminar(LAMINAR_LIMIT) + share * turbulent(TURBULENT_LIMIT)
        }
    };
    straight * (prandtl / prandtl_wall).powf(0.11)
}

fn laminar_nusselt(channel: &StraightChannel, re: f64, pr: f64) -> f64 {
    let ratio = channel.diameter_over_length();
    let graetz = re * pr * ratio;
    let (developed, offset, leveque, entrance) = match channel.wall {
        Wall::Temperature => (3.66_f64, 0.7_f64, 1.615 * graetz.cbrt(), (2.0 / (1.0 + 22.0 * pr)).powf(1.0 / 6.0) * graetz.sqrt()),
        Wall::Flux => (4.364, 0.6, 1.953 * graetz.cbrt(), 0.924 * pr.cbrt() * (re * ratio).sqrt()),
    };
    let entrance = if channel.velocity_developed { 0.0 } else { entrance };
    (developed.powi(3) + offset.powi(3) + (leveque - offset).powi(3) + entrance.powi(3)).cbrt()
}

fn turbulent_nusselt(channel: &StraightChannel, re: f64, pr: f64) -> f64 {
    let f8 = konakov(re) / 8.0;
    let developed = f8 * (re - 1000.0) * pr / (1.0 + 12.7 * f8.sqrt() * (pr.powf(2.0 / 3.0) - 1.0));
    developed * (1.0 + channel.diameter_over_length().powf(2.0 / 3.0))
}

/// Doubt about [`nusselt`] at these arguments, if there is one.
pub fn note(channel: &StraightChannel, reynolds: f64, prandtl: f64, prandtl_wall: f64) -> Option<&'static str> {
    let ratio = prandtl / prandtl_wall;
    if !(0.1..=1000.0).contains(&prandtl) {
        Some("the film correlation holds for Prandtl numbers 0.1..1000")
    } else if reynolds > 1e6 {
        Some("the film correlation holds up to a Reynolds number of 1e6")
    } else if channel.diameter_over_length() > 1.0 {
        Some("the film correlation holds for channels longer than their diameter")
    } else if !(0.1..=10.0).contains(&ratio) {
        Some("the wall-property factor holds for Pr/Pr_wall between 0.1 and 10")
    } else {
        None
    }
}

/// The film in a straight channel at a volume flow (m³/s): h = Nu k / d.
///
/// `state` is the liquid at its bulk temperature; `prandtl_wall` is its Prandtl number at the wall temperature; `None`
/// leaves the wall-property factor out. Source and range: [`nusselt`].
///
/// ```
/// # use coldplate_physics::{channel::{StraightChannel, Wall, film}, liquid::Liquid};
/// let channel = StraightChannel { diameter: 0.01, length: 1.6, wall: Wall::Flux, velocity_developed: false };
/// let film = film(3.33e-5, &channel, &Liquid::Water.at(299.15).unwrap(), None);
/// assert!((film.coefficient - 2287.5).abs() < 0.1 && (film.reynolds - 4858.0).abs() < 0.1);
/// ```
pub fn film(flow: f64, channel: &StraightChannel, state: &LiquidProperties, prandtl_wall: Option<f64>) -> Film {
    let prandtl = state.prandtl();
    let (reynolds, prandtl_wall) = (reynolds(flow, channel.diameter, state), prandtl_wall.unwrap_or(prandtl));
    let nusselt = nusselt(channel, reynolds, prandtl, prandtl_wall);
    Film {
        coefficient: nusselt * state.conductivity / channel.diameter,
        nusselt,
        reynolds,
        regime: Regime::at(reynolds),
        note: note(channel, reynolds, prandtl, prandtl_wall),
    }
}
