//! Open faces: half a cell of conduction to a surface that radiates, loses heat to gas, and may
//! have a film, a flux, radiation or a temperature prescribed. The surface temperature is eliminated here.

use serde::{Deserialize, Serialize};

use super::{BoundaryState, Load, NONE};
use coldplate_describe::machine::Property;
use coldplate_physics::radiation::SIGMA;

/// The boundaries of the machine that act on one surface, [`NONE`] where there is none of a kind: a temperature or a
/// film, a flux, radiation.
pub type Laws = [u32; 3];

/// No boundary at all.
pub const FREE: Laws = [NONE; 3];

/// The node of an open face that a sensor reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaceNode {
    /// The cell behind it.
    pub cell: u32,
    /// Side of the cell, in the order of [`coldplate_describe::machine::Side::ALL`].
    pub side: u8,
    /// The node.
    pub node: u32,
}

/// Areas of a boundary, m².
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BoundaryArea {
    /// Open area that it acts on.
    pub acting: f64,
    /// Area that it would act on if nothing covered its faces.
    pub whole: f64,
}

/// An open face of a cell, or the radiating area of a lumped node.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// The node behind it.
    pub node: u32,
    /// Conductivity behind it: index into the network's properties, or [`NONE`] for a lumped node.
    pub property: u32,
    /// Conduction length from the node to the surface, m.
    pub length: f64,
    /// Area of the face, m².
    pub area: f64,
    /// Effective emissivity times radiating area towards the chamber, m².
    pub emissive: f64,
    /// Area wetted by the residual gas, m².
    pub gas_area: f64,
    /// Boundaries of the machine that act on it.
    pub laws: Laws,
}

/// Heat through a surface.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SurfaceState {
    /// Temperature of the surface itself, K.
    pub temperature: f64,
    /// Heat leaving the node, W.
    pub heat: f64,
    /// Derivative of the heat with respect to the node's temperature, W/K; never negative.
    pub slope: f64,
    /// Derivative of the heat from the node with respect to the temperature of the surface, sign turned, W/K.
    pub inward: f64,
    /// Part of the heat that radiates to the chamber, W.
    pub radiated: f64,
    /// Part of the heat that the gas carries, W.
    pub gas: f64,
    /// Part of the heat that leaves through the prescribed laws, W.
    pub law: f64,
    /// Change of the heat per watt that the outside takes more at the same surface temperature.
    pub share: f64,
}

impl Surface {
    /// The boundaries of the machine that act on it.
    pub fn boundaries(&self) -> impl Iterator<Item = usize> + '_ {
        self.laws.iter().filter(|l| **l != NONE).map(|l| *l as usize)
    }

    /// Heat (W) that leaves through one of its boundaries in a state.
    pub fn through(&self, boundary: usize, state: &SurfaceState, load: &Load) -> f64 {
        match &load.boundaries[boundary] {
            BoundaryState::Temperature(_) => state.law,
            law => self.leaving(law, state.temperature),
        }
    }

    /// Heat (W) that leaves at a surface temperature (K) by a law other than a prescribed temperature.
    fn leaving(&self, law: &BoundaryState, ts: f64) -> f64 {
        match *law {
            BoundaryState::Film(h, t) => h * self.area * (ts - t),
            BoundaryState::Flux(q) => -q * self.area,
            BoundaryState::Radiation(e, t) => SIGMA * e * self.area * (ts.powi(4) - t.powi(4)),
            BoundaryState::FreeConvection(convection, t) => convection.flux(ts, t).value * self.area,
            BoundaryState::Temperature(_) => 0.0,
        }
    }

    /// Heat leaving at a node temperature (K). The surface balance is solved by Newton's method between bounds that close in; it
    /// stops at rounding.
    pub fn state(&self, node: f64, properties: &[Property], load: &Load) -> SurfaceState {
        // Conductance to the surface per conductivity, m: none where nothing resists.
        let own = properties.get(self.property as usize).filter(|_| self.length != 0.0).map(|k| (k, self.area / self.length));
        if let Some(BoundaryState::Temperature(t)) = self.boundaries().map(|l| load.boundaries[l]).next() {
            // Nothing between a lumped node and its held surface: a stiff but finite link.
            let stiff = 1e9 * self.area.max(1e-9);
            let at = |k: &dyn Fn(&Property) -> f64| own.map_or(stiff, |(property, shape)| shape * k(property));
            let heat = at(&|k| k.mean(node, t)) * (node - t);
            return SurfaceState {
                temperature: t,
                heat,
                slope: at(&|k| k.at(node)),
                inward: at(&|k| k.at(t)),
                law: heat,
                ..SurfaceState::default()
            };
        }
        let sky = load.chamber.powi(4);
        // Radiation, gas and laws: the heat of each at a surface temperature, and its slope.
        let outward = |ts: f64| {
            let cube = ts * ts * ts;
            let radiated = (SIGMA * self.emissive * (ts * cube - sky), 4.0 * SIGMA * self.emissive * cube);
            let conductance = load.gas * self.gas_area;
            let mut law = (0.0, 0.0);
            for l in self.boundaries() {
                law.0 += self.leaving(&load.boundaries[l], ts);
                law.1 += match load.boundaries[l] {
                    BoundaryState::Film(h, _) => h * self.area,
                    BoundaryState::Radiation(e, _) => 4.0 * SIGMA * e * self.area * cube,
                    BoundaryState::FreeConvection(convection, t) => convection.flux(ts, t).per_surface * self.area,
                    BoundaryState::Flux(_) | BoundaryState::Temperature(_) => 0.0,
                };
            }
            [radiated, (conductance * (ts - load.chamber), conductance), law]
        };
        let mut ts = node;
        let mut taken = outward(ts);
        let steepness = |taken: &[(f64, f64); 3]| taken.iter().map(|(_, slope)| slope).sum::<f64>();
        let mut inward = f64::INFINITY;
        if let Some((k, shape)) = own {
            // The heat towards the surface falls with its temperature, and the heat outward grows: one solution between these.
            let (mut low, mut high) = (0.0, f64::INFINITY);
            for _ in 0..100 {
                let left = shape * k.mean(node, ts) * (node - ts) - taken.iter().map(|(heat, _)| heat).sum::<f64>();
                inward = shape * k.at(ts);
                let newton = ts + left / (inward + steepness(&taken));
                if left > 0.0 {
                    low = ts
                } else {
                    high = ts
                }
                let is_between = newton >= low && newton <= high || (newton - ts).abs() <= 1e-8 * ts;
                let next = if is_between { newton } else { f64::midpoint(low, high) };
                let step = next - ts;
                ts = next;
                // The remaining error is 1.5 step²/T at most, and so is the error of a straight line: rounding.
                if step.abs() <= 1e-8 * ts.max(1.0) {
                    taken.iter_mut().for_each(|(heat, slope)| *heat += *slope * step);
                    break;
                }
                taken = outward(ts);
            }
        }
        let slope = steepness(&taken);
        let [radiated, gas, law] = taken.map(|(heat, _)| heat);
        let (share, slope) = match own {
            Some((k, shape)) => (inward / (inward + slope), shape * k.at(node) * slope / (inward + slope)),
            None => (1.0, slope),
        };
        SurfaceState { temperature: ts, heat: radiated + gas + law, slope, inward, radiated, gas, law, share }
    }
}
