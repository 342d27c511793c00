//! Heat through a joint: two halves whose conductivities may follow the temperature, and the interface between them.
//!
//! In each half k(T) dT/dx = -q, so that a half of length l carries q l as the integral of its conductivity between its two ends
//! (Kirchhoff's transformation; Carslaw and Jaeger 1959, 2.16): exact for any table. The interface has the temperatures of its two
//! faces, and its law takes their mean.

use super::{ContactFactors, Joint, NONE, Network};
use coldplate_describe::machine::{Interface, Property, Slope};

/// Most steps of Newton's method for the flux, a count. Chosen: bisection alone reaches rounding in as many.
const MOST_STEPS: usize = 80;
/// Relative change of the flux below which it is found, dimensionless. Chosen above rounding.
const FOUND: f64 = 1e-14;

/// Conductance of a joint and the derivatives of its heat.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct JointState {
    /// Heat over the difference of the temperatures at its ends, W/K.
    pub conductance: f64,
    /// Derivative of the heat with respect to the temperature at the first end, W/K.
    pub along_a: f64,
    /// Derivative of the heat with respect to the temperature at the second end, sign turned, W/K.
    pub along_b: f64,
}

/// A joint between two temperatures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Conductance and derivatives.
    pub state: JointState,
    /// Temperatures of the two faces of the interface, K.
    pub faces: [f64; 2],
    /// Conductance of the interface, W/(m² K): infinite where nothing resists.
    pub contact: f64,
    /// Relative change of the heat per relative change of the interface's conductance, dimensionless.
    pub per_contact: f64,
    /// Relative change of the heat per relative change of the conductivity of each half, dimensionless.
    pub per_half: [f64; 2],
}

/// Half of a joint.
#[derive(Clone, Copy)]
struct Half<'n> {
    /// `None` where nothing resists.
    property: Option<&'n Property>,
    length: f64,
    /// Temperature at its end, K.
    end: f64,
}

impl Half<'_> {
    /// Temperature (K) at the face if this flux (W/m²) flows from the end to the face.
    fn face(&self, flux: f64) -> f64 {
        self.property.map_or(self.end, |k| k.moved(self.end, -flux * self.length))
    }

    /// Specific resistance (m² K/W) up to a face at a temperature (K).
    fn resistance(&self, face: f64) -> f64 {
        self.property.map_or(0.0, |k| self.length / k.mean(self.end, face))
    }

    /// Rise of the face's temperature per flux, sign turned (m² K/W), and per kelvin of the end, at a temperature of the face (K).
    fn slopes(&self, face: f64) -> (f64, f64) {
        self.property.map_or((0.0, 1.0), |k| {
            let at_face = k.at(face);
            (self.length / at_face, k.at(self.end) / at_face)
        })
    }
}

impl Network {
    /// Conductance of a joint between two temperatures (K), with the derivatives of its heat.
    pub fn joint_state(&self, joint: &Joint, ta: f64, tb: f64, factors: &ContactFactors) -> JointState {
        self.crossing(joint, ta, tb, factors).state
    }

    /// A joint between two temperatures (K).
    pub fn crossing(&self, joint: &Joint, ta: f64, tb: f64, factors: &ContactFactors) -> Crossing {
        let half = |property: u32, length: f64, end: f64| {
            let property = self.properties.get(property as usize).filter(|_| length != 0.0);
            Half { property, length, end }
        };
        let halves = [half(joint.property_a, joint.length_a, ta), half(joint.property_b, joint.length_b, tb)];
        let contact = |mean: f64| if joint.contact == NONE { (0.0, 0.0) } else { self.contact_resistance(joint, mean, factors) };
        let faces = |flux: f64| [halves[0].face(flux), halves[1].face(-flux)];
        let at_ends = contact(f64::midpoint(ta, tb));
        let first = halves[0].resistance(ta) + halves[1].resistance(tb) + at_ends.0;
        if first.is_infinite() {
            return Crossing { state: JointState::default(), faces: [ta, tb], contact: 0.0, per_contact: 0.0, per_half: [0.0; 2] };
        }
        let is_even = halves.iter().all(|half| half.property.is_none_or(Property::is_constant));
        let follows = !is_even || joint.contact != NONE && self.contacts[joint.contact as usize].law.follows_temperature();
        let drop = ta - tb;
        let flux = match follows && drop != 0.0 {
            true => find_flux(drop, drop / first, |flux| flux_balance(drop, flux, faces(flux), &halves, &contact)),
            false => drop / first,
        };
        let found = faces(flux);
        let (rc, bend) = if follows { contact(f64::midpoint(found[0], found[1])) } else { at_ends };
        let resistance = if follows { halves[0].resistance(found[0]) + halves[1].resistance(found[1]) + rc } else { first };
        let [(ra, along_a), (rb, along_b)] = [halves[0].slopes(found[0]), halves[1].slopes(found[1])];
        // Half of the change of the interface's drop per kelvin of its mean temperature, dimensionless.
        let turn = 0.5 * flux * bend;
        let whole = ra + rb + rc + turn * (rb - ra);
        let state = JointState {
            conductance: joint.area / resistance,
            along_a: joint.area * along_a * (1.0 - turn) / whole,
            along_b: joint.area * along_b * (1.0 + turn) / whole,
        };
        Crossing {
            state,
            faces: found,
            contact: 1.0 / rc,
            per_contact: rc / whole,
            per_half: [ra * (1.0 - turn) / whole, rb * (1.0 + turn) / whole],
        }
    }

    /// Heat (W) through a joint from its first node to its second.
    pub fn joint_heat(&self, joint: &Joint, temperatures: &[f64], factors: &ContactFactors) -> f64 {
        let (ta, tb) = self.joint_ends(joint, temperatures);
        self.joint_state(joint, ta, tb, factors).conductance * (ta - tb)
    }

    /// Conductance (W/(m² K)) of the contact that a joint crosses at temperatures of all nodes (K): infinite where nothing resists,
    /// as in a bond.
    pub fn contact_conductance(&self, joint: &Joint, temperatures: &[f64], factors: &ContactFactors) -> f64 {
        let (ta, tb) = self.joint_ends(joint, temperatures);
        self.crossing(joint, ta, tb, factors).contact
    }

    /// Specific resistance (m² K/W) of a joint's contact at a mean temperature (K), with its slope.
    fn contact_resistance(&self, joint: &Joint, mean: f64, factors: &ContactFactors) -> (f64, f64) {
        let group = &self.contacts[joint.contact as usize];
        let conductivity = |property: u32| {
            let (value, slope) = self.properties.get(property as usize)?.with_slope(mean);
            Some(Slope { value, slope })
        };
        let conductivities = [conductivity(joint.property_a), conductivity(joint.property_b)];
        let found = group.law.conductance(&Interface { area: group.area, temperature: mean, conductivities });
        let scale = group.scale * factors.of(group);
        let h = found.value * scale;
        if h == 0.0 || h.is_infinite() {
            return (1.0 / h, 0.0);
        }
        (1.0 / h, -found.slope * scale / (h * h))
    }
}

/// Drop (K) that is left over a joint with this flux (W/m²) and these temperatures of its faces (K), and the derivative with respect
/// to the flux, sign turned.
fn flux_balance(drop: f64, flux: f64, faces: [f64; 2], halves: &[Half<'_>; 2], contact: &impl Fn(f64) -> (f64, f64)) -> (f64, f64) {
    let (rc, bend) = contact(f64::midpoint(faces[0], faces[1]));
    let [(ra, _), (rb, _)] = [halves[0].slopes(faces[0]), halves[1].slopes(faces[1])];
    let left = drop - flux * (halves[0].resistance(faces[0]) + halves[1].resistance(faces[1]) + rc);
    (left, ra + rb + rc + 0.5 * flux * bend * (rb - ra))
}

/// Flux (W/m²) that leaves no drop, by Newton's method between bounds that close in.
fn find_flux(drop: f64, first: f64, balance: impl Fn(f64) -> (f64, f64)) -> f64 {
    let sign = drop.signum();
    let (mut low, mut high, mut size) = (0.0, f64::INFINITY, first.abs());
    for _ in 0..MOST_STEPS {
        let (left, slope) = balance(sign * size);
        let left = sign * left;
        let newton = size + left / slope;
        // Near the solution the sign of the drop that is left is rounding: no bound follows from it.
        if (newton - size).abs() <= FOUND * size {
            break;
        }
        if left > 0.0 {
            low = size
        } else {
            high = size
        }
        size = match (newton > low && newton < high, high.is_finite()) {
            (true, _) => newton,
            (false, true) => f64::midpoint(low, high),
            (false, false) => 2.0 * size,
        };
    }
    sign * size
}
