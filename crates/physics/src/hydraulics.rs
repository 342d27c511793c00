//! Friction, pressure drop, and the split of a flow over parallel branches.

use std::f64::consts::PI;

use super::regime::{LAMINAR_LIMIT, Regime, TURBULENT_LIMIT};
use super::water::LiquidProperties;
use coldplate_base::error::{Error, Result};

/// Darcy friction factor of a smooth tube in turbulent flow: f = (1.8 lg Re - 1.5)^-2.
///
/// Range: Re 4e3..1e6. Source: Konakov (1946), as used by Gnielinski (2013).
pub fn konakov(reynolds: f64) -> f64 {
    (1.8 * reynolds.log10() - 1.5).powi(-2)
}

/// Darcy friction factor of the all-regime formula of Churchill, Chem. Eng. 84 (24) (1977) 91:
/// f = 8 [(8/Re)^12 + (A + B)^-1.5]^(1/12), A = [2.457 ln 1/((7/Re)^0.9 + 0.27 e/d)]^16, B = (37530/Re)^16.
fn churchill(reynolds: f64, relative_roughness: f64) -> f64 {
    let a = (2.457 * ((7.0 / reynolds).powf(0.9) + 0.27 * relative_roughness).recip().ln()).powi(16);
    let b = (37_530.0 / reynolds).powi(16);
    8.0 * ((8.0 / reynolds).powi(12) + (a + b).powf(-1.5)).powf(1.0 / 12.0)
}

/// Darcy friction factor.
///
/// Laminar 64/Re up to Re = 2300; from 4000 the smooth factor of [`konakov`], multiplied for rough walls by Churchill's
/// ratio f(Re, e/d)/f(Re, 0) so that a vanishing roughness changes nothing; linear in Re between. The factor is
/// continuous and f Re² increases with Re: the pressure drop always grows with the flow.
///
/// Range: Re up to 1e6, e/d up to 0.05; within 2 % of Colebrook's equation. At Re = 0 the factor is infinite; [`pressure_drop`] takes
/// the limit.
///
/// ```
/// # use coldplate_physics::channel::friction;
/// assert_eq!(friction(1000.0, 0.0), 0.064);
/// assert!(friction(1e5, 0.01) > friction(1e5, 0.0));
/// ```
pub fn friction(reynolds: f64, relative_roughness: f64) -> f64 {
    let turbulent = |re: f64| {
        let roughness = if relative_roughness > 0.0 { churchill(re, relative_roughness) / churchill(re, 0.0) } else { 1.0 };
        konakov(re) * roughness
    };
    match Regime::at(reynolds) {
        Regime::Laminar => 64.0 / reynolds,
        Regime::Turbulent => turbulent(reynolds),
        Regime::Transition => {
            let share = (reynolds - LAMINAR_LIMIT) / (TURBULENT_LIMIT - LAMINAR_LIMIT);
            (1.0 - share) * 64.0 / LAMINAR_LIMIT + share * turbulent(TURBULENT_LIMIT)
        }
    }
}

/// Pressure drop (Pa) of a volume flow (m³/s) in a round channel of `diameter` and `length` (m):
/// dp = (f L/d + K) rho v²/2, with the sum K of the loss coefficients and the wall `roughness` (m).
///
/// Odd in the flow. Typical K: 180-degree bend of r/d = 1.5 0.4..0.6, drilled sharp corner
/// 1.1..1.5, inlet 0.5, outlet 1.0. Range: that of [`friction`].
pub fn pressure_drop(flow: f64, diameter: f64, length: f64, minor_loss: f64, roughness: f64, state: &LiquidProperties) -> f64 {
    let speed = 4.0 * flow.abs() / (PI * diameter * diameter);
    if speed == 0.0 {
        return 0.0;
    }
    let reynolds = state.density * speed * diameter / state.viscosity;
    let resistance = friction(reynolds, roughness / diameter) * length / diameter + minor_loss;
    (resistance * 0.5 * state.density * speed * speed).copysign(flow)
}

/// Splits `total` (m³/s, not negative) over parallel branches with equal pressure drops.
///
/// Each branch is its pressure drop (Pa) as an increasing function of its flow on 0..`total`, zero at zero flow. The
/// flows returned sum to `total` exactly up to rounding and give equal drops to 1e-8 or better. The method uses no
/// derivatives: the kinks between flow regimes do not matter.
///
/// # Errors
/// No branch, a total that is negative or not finite, a branch whose pressure drop is not positive
/// and finite at the total flow.
///
/// ```
/// # use coldplate_physics::channel::split_flow;
/// let quadratic = |r: f64| move |q: f64| r * q * q;
/// let flows = split_flow(3.0, &[quadratic(1.0), quadratic(4.0)]).unwrap();
/// assert!((flows[0] - 2.0).abs() < 1e-9 && (flows[1] - 1.0).abs() < 1e-9);
/// ```
pub fn split_flow(total: f64, branches: &[impl Fn(f64) -> f64]) -> Result<Vec<f64>> {
    if branches.is_empty() {
        return Err(Error::input("parallel channels without a single branch"));
    }
    if !(total.is_finite() && total >= 0.0) {
        return Err(Error::input("the flow to be split must be finite and not negative").read(total));
    }
    if branches.len() == 1 || total == 0.0 {
        return Ok(vec![total; branches.len()]);
    }
    // No branch takes more than the total flow: the common drop is at most the smallest drop at the total flow.
    let mut highest = f64::INFINITY;
    for (index, branch) in branches.iter().enumerate() {
        let drop = branch(total);
        if !(drop.is_finite() && drop > 0.0) {
            return Err(Error::numerics(format!("branch {index} of a flow split has a pressure drop of {drop} Pa at the full flow")));
        }
        highest = highest.min(drop);
    }
    let flow_at = |branch: &dyn Fn(f64) -> f64, drop: f64| root(|q| branch(q) - drop, 0.0, total);
    let excess = |drop: f64| branches.iter().map(|branch| flow_at(branch, drop)).sum::<f64>() - total;
    let drop = root(excess, 0.0, highest);
    let mut flows: Vec<f64> = branches.iter().map(|branch| flow_at(branch, drop)).collect();
    let sum: f64 = flows.iter().sum();
    if !(sum.is_finite() && (sum / total - 1.0).abs() < 1e-8) {
        return Err(Error::numerics(format!(
            "a flow split missed its total by {:.1e}: is a pressure drop not increasing?",
            sum / total - 1.0
        )));
    }
    flows.iter_mut().for_each(|flow| *flow *= total / sum);
    Ok(flows)
}

/// Zero of an increasing function on `low..high`, by regula falsi with the Illinois rule, made safe by a bisection
/// whenever the bracket did not halve. An end is returned if the sign never changes.
fn root(f: impl Fn(f64) -> f64, low: f64, high: f64) -> f64 {
    let (mut a, mut b) = (low, high);
    let (mut fa, mut fb) = (f(a), f(b));
    if fa >= 0.0 {
        return a;
    }
    if fb <= 0.0 {
        return b;
    }
    for step in 0..200 {
        let width = b - a;
        if width <= 4.0 * f64::EPSILON * b.abs() {
            break;
        }
        let secant = b - fb * width / (fb - fa);
        let c = if step % 3 == 2 || !(secant > a && secant < b) { a + 0.5 * width } else { secant };
        if c <= a || c >= b {
            break;
        }
        let fc = f(c);
        if fc == 0.0 {
            return c;
        }
        if fc < 0.0 {
            (a, fa) = (c, fc);
            fb *= 0.5;
        } else {
            (b, fb) = (c, fc);
            fa *= 0.5;
        }
    }
    0.5 * (a + b)
}
