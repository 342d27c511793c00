//! Heat of a feed drive: motor, reducer, screw, guides, bearings.
//!
//! [`heats`] is equations 1-5 of the paper on the large five-axis machine tool in vacuum whose rig and machine ship
//! with this project. Where the paper slips, this module computes the following:
//!
//! * equation 2 gives the inertia of the moving parts with the coupling's mass m3; it must be, and
//!   here is, the moving mass m;
//! * equation 4 makes the acceleration torque proportional to the speed n, but Table 2 scales every
//!   heat with n from 2500 r/min downwards, which is a constant torque: [`Parameters::reference_speed`]
//!   is the speed the torque is evaluated at; `None` follows equation 4 as printed;
//! * equation 5 halves the guide heat without a word: [`Parameters::rail_heat_share`] is 0.5 to
//!   reproduce the tables, 1 for all friction work to become heat in the guides;
//! * equation 5 multiplies screw and bearing torques referred to the motor shaft with the motor
//!   speed, which counts 1/reducer-efficiency of the true friction heat (5 % too much). Kept;
//! * the acceleration torque acts during acceleration only (0.2 s per reversal) and is 99 % of the
//!   starting torque, yet the motor heat is taken as continuous. Kept; give `starting_torque` for
//!   the torque of a real duty;
//! * the rotor's own inertia is absent from equation 1. Kept; add it to `reducer_inertia`;
//! * 9.55 in the paper is 30/pi; here speeds are rad/s and the factor is exact.
//!
//! Parameter sets that reproduce Tables 1 and 2 to their printed digits are in `docs/reference/physics.md`.

use std::f64::consts::PI;

use coldplate_base::error::{Error, Result};

use super::constants::GRAVITY;

/// Parameters of one axis in equations 1-5. [`Parameters::default`] is [`Parameters::PAPER`].
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// Inertia of the reducer at the motor shaft, J_R, kg m².
    pub reducer_inertia: f64,
    /// Mass of the screw, m2, kg.
    pub screw_mass: f64,
    /// Diameter of the screw, D2, m.
    pub screw_diameter: f64,
    /// Mass of the coupling, m3, kg.
    pub coupling_mass: f64,
    /// Diameter of the coupling, D3, m.
    pub coupling_diameter: f64,
    /// Mass moved along the guides, m, kg.
    pub moving_mass: f64,
    /// Inertia turned directly by the reducer's output (rotary axes), kg m².
    pub rotary_inertia: f64,
    /// Lead of the screw, m; 0 for a rotary axis, which has neither screw nor guides.
    pub lead: f64,
    /// Reduction ratio i.
    pub ratio: f64,
    /// Time in which the motor reaches its speed, T, s.
    pub acceleration_time: f64,
    /// Preload force of the screw nut, F_P, N.
    pub preload: f64,
    /// Efficiency of the screw without preload, eta_0.
    pub screw_efficiency: f64,
    /// Efficiency of the reducer, eta_R.
    pub reducer_efficiency: f64,
    /// Efficiency of the motor, eta_M.
    pub motor_efficiency: f64,
    /// Friction coefficient of the guides, mu_1.
    pub guide_friction: f64,
    /// Friction coefficient of the bearings, mu_2.
    pub bearing_friction: f64,
    /// Load on the bearings, N. Only the product of load and diameter matters.
    pub bearing_load: f64,
    /// Inner diameter of the bearings, m.
    pub bearing_diameter: f64,
    /// Speed at which the acceleration torque is evaluated, rad/s; `None`: the actual speed.
    pub reference_speed: Option<f64>,
    /// Torque of the motor, N m, in place of equations 1-4; the friction heats stay.
    pub starting_torque: Option<f64>,
    /// Share of the guides' friction work that heats the guides.
    pub rail_heat_share: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        Self::PAPER
    }
}

impl Parameters {
    /// The values the paper states for every axis, and zero for the rest.
    pub const PAPER: Self = Self {
        reducer_inertia: 0.0,
        screw_mass: 0.0,
        screw_diameter: 0.0,
        coupling_mass: 0.0,
        coupling_diameter: 0.0,
        moving_mass: 0.0,
        rotary_inertia: 0.0,
        lead: 0.0,
        ratio: 5.0,
        acceleration_time: 0.2,
        preload: 0.0,
        screw_efficiency: 0.95,
        reducer_efficiency: 0.95,
        motor_efficiency: 0.9,
        guide_friction: 0.01,
        bearing_friction: 0.0025,
        bearing_load: 0.0,
        bearing_diameter: 0.0,
        reference_speed: Some(2500.0 * PI / 30.0),
        starting_torque: None,
        rail_heat_share: 0.5,
    };

    /// Checks that the numbers can be used.
    ///
    /// # Errors
    /// Names the first field (its key as in this struct) that is negative, not finite, or, for
    /// ratio, time and efficiencies, zero; and efficiencies above 1.
    pub fn check(&self) -> Result<()> {
        let refuse = |key: &str, value: f64, wants: &str| {
            Err(Error::input("this drive parameter cannot be used").at_key(key).read(value).help(format!("it must be {wants}")))
        };
        for (key, value) in [
            ("reducer_inertia", self.reducer_inertia),
            ("screw_mass", self.screw_mass),
            ("screw_diameter", self.screw_diameter),
            ("coupling_mass", self.coupling_mass),
            ("coupling_diameter", self.coupling_diameter),
            ("moving_mass", self.moving_mass),
            ("rotary_inertia", self.rotary_inertia),
            ("lead", self.lead),
            ("preload", self.preload),
            ("guide_friction", self.guide_friction),
            ("bearing_friction", self.bearing_friction),
            ("bearing_load", self.bearing_load),
            ("bearing_diameter", self.bearing_diameter),
            ("rail_heat_share", self.rail_heat_share),
            ("reference_speed", self.reference_speed.unwrap_or(0.0)),
            ("starting_torque", self.starting_torque.unwrap_or(0.0)),
        ] {
            if !(value.is_finite() && value >= 0.0) {
                return refuse(key, value, "finite and not negative");
            }
        }
        for (key, value) in [("ratio", self.ratio), ("acceleration_time", self.acceleration_time)] {
            if !(value.is_finite() && value > 0.0) {
                return refuse(key, value, "finite and positive");
            }
        }
        for (key, value) in [
            ("screw_efficiency", self.screw_efficiency),
            ("reducer_efficiency", self.reducer_efficiency),
            ("motor_efficiency", self.motor_efficiency),
        ] {
            if !(value > 0.0 && value <= 1.0) {
                return refuse(key, value, "above 0 and at most 1");
            }
        }
        Ok(())
    }

    /// Inertia of the load at the motor shaft, kg m² (equations 1 and 2):
    /// J = J_R + [m2 D2²/8 + m3 D3²/8 + m (P/2 pi)² + J_rotary]/i².
    pub fn load_inertia(&self) -> f64 {
        let screw = self.screw_mass * self.screw_diameter.powi(2) / 8.0;
        let coupling = self.coupling_mass * self.coupling_diameter.powi(2) / 8.0;
        let moving = self.moving_mass * (self.lead / (2.0 * PI)).powi(2);
        self.reducer_inertia + (screw + coupling + moving + self.rotary_inertia) / self.ratio.powi(2)
    }
}

/// Torques at the motor shaft, N m (equations 3 and 4).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Torques {
    /// Acceleration of the load, M_a.
    pub acceleration: f64,
    /// Preload friction of the screw.
    pub screw: f64,
    /// Friction of the guides.
    pub rail: f64,
    /// Friction of the bearings.
    pub bearing: f64,
    /// Starting torque M_s: the sum of the torques above, or the stated torque.
    pub starting: f64,
}

/// Heats of a drive, W, with the torques behind them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heats {
    /// Motor.
    pub motor: f64,
    /// Reducer.
    pub reducer: f64,
    /// Screw and nut.
    pub screw: f64,
    /// Guide rails and sliders.
    pub rail: f64,
    /// Bearings of the screw (or of the rotary axis).
    pub bearing: f64,
    /// Speed of the moving parts, m/s (0 for rotary axes); its sign is that of the motor speed.
    pub velocity: f64,
    /// Torques at the motor shaft.
    pub torques: Torques,
}

impl Heats {
    /// Every quantity with the suffix under which formulas see it, behind the drive's own name.
    pub fn named(&self) -> [(&'static str, f64); 7] {
        [
            ("motor_W", self.motor),
            ("reducer_W", self.reducer),
            ("screw_W", self.screw),
            ("rail_W", self.rail),
            ("bearing_W", self.bearing),
            ("velocity", self.velocity),
            ("torque", self.torques.starting),
        ]
    }
}

/// Torques at the motor shaft at `motor_speed` (rad/s), equations 3 and 4:
/// M_a = J omega_ref/T; M_screw = F_P P (1 - eta_0²)/(2 pi eta_R eta_0 i);
/// M_rail = mu_1 m g P/(2 pi eta_R eta_0 i); M_bearing = mu_2 P_b d/(2 eta_R i).
pub fn torques(p: &Parameters, motor_speed: f64) -> Torques {
    let per_newton = p.lead / (2.0 * PI * p.reducer_efficiency * p.screw_efficiency * p.ratio);
    let speed = p.reference_speed.unwrap_or(motor_speed.abs());
    let acceleration = p.load_inertia() * speed / p.acceleration_time;
    let screw = p.preload * per_newton * (1.0 - p.screw_efficiency.powi(2));
    let rail = p.guide_friction * p.moving_mass * GRAVITY * per_newton;
    let bearing = p.bearing_friction * p.bearing_load * p.bearing_diameter / (2.0 * p.reducer_efficiency * p.ratio);
    let starting = p.starting_torque.unwrap_or(acceleration + screw + rail + bearing);
    Torques { acceleration, screw, rail, bearing, starting }
}

/// Heats of a drive at `motor_speed` (rad/s), equation 5: Q_motor = M_s omega (1 - eta_M)/eta_M; Q_reducer = M_s omega
/// (1 - eta_R); Q_bearing = M_bearing omega; Q_screw = M_screw omega; Q_rail = s mu_1 m g |v| with s =
/// [`Parameters::rail_heat_share`], v = P omega/(2 pi i).
///
/// Both directions of turning give equal heats. The module documentation lists the differences from the paper.
///
/// ```
/// # use coldplate_physics::drive::{Parameters, heats};
/// let drive = Parameters { lead: 0.012, starting_torque: Some(3.91), ..Parameters::default() };
/// let heats = heats(&drive, 2500.0 * std::f64::consts::PI / 30.0);
/// assert!((heats.velocity - 0.1).abs() < 1e-12);
/// assert!((heats.motor - 113.7).abs() < 0.1 && (heats.reducer / heats.motor - 0.45).abs() < 1e-12);
/// ```
pub fn heats(p: &Parameters, motor_speed: f64) -> Heats {
    let torques = torques(p, motor_speed);
    let speed = motor_speed.abs();
    let shaft_power = torques.starting * speed;
    let velocity = p.lead * motor_speed / (2.0 * PI * p.ratio);
    Heats {
        motor: shaft_power * (1.0 - p.motor_efficiency) / p.motor_efficiency,
        reducer: shaft_power * (1.0 - p.reducer_efficiency),
        screw: torques.screw * speed,
        rail: p.rail_heat_share * p.guide_friction * p.moving_mass * GRAVITY * velocity.abs(),
        bearing: torques.bearing * speed,
        velocity,
        torques,
    }
}

/// Copper loss (W) of a three-phase motor at `torque` (N m) and winding temperature (K):
/// P = 3 R20 I² [1 + 0.00393 (T - 20 degC)], I = M/K_t with K_t falling by `torque_constant_slope`
/// per kelvin from 20 degC (about -0.001 1/K for NdFeB magnets, 0 to leave it out).
///
/// `resistance` is one phase at 20 degC, ohm; `torque_constant` in N m per ampere of phase current
/// (r.m.s.) at 20 degC. At constant torque the loss rises by about 0.6 %/K with NdFeB magnets.
/// Range: windings and magnets 0..150 degC (linear laws). Source: IEC 60034-1 for copper.
pub fn copper_loss(torque: f64, torque_constant: f64, torque_constant_slope: f64, resistance: f64, temperature: f64) -> f64 {
    let rise = temperature - 293.15;
    let current = torque / (torque_constant * (1.0 + torque_constant_slope * rise));
    3.0 * resistance * (1.0 + 0.003_93 * rise) * current * current
}

/// Friction force (N) of guides under a normal load W (N) with sealed carriages: mu W + n F_seal.
///
/// Seals cost 2..5 N per carriage. The heat is this force times the speed. Source: makers' catalogues.
pub fn guide_force(friction: f64, normal_load: f64, carriages: f64, seal_force: f64) -> f64 {
    friction * normal_load + carriages * seal_force
}

/// Preload drag torque of a ball screw, N m: 0.05 (tan beta)^(-1/2) F_a0 P/(2 pi), where
/// tan beta = P/(pi d), P the lead and d the ball-circle diameter (m), F_a0 the preload (N).
///
/// Source: makers' catalogues (JIS B 1192). The catalogue tolerance of the torque is +-20..50 %.
pub fn preload_torque(preload: f64, lead: f64, ball_circle: f64) -> f64 {
    let tangent = lead / (PI * ball_circle);
    0.05 / tangent.sqrt() * preload * lead / (2.0 * PI)
}
