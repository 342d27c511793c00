//! Joints between the two sides of a contact.

use super::Foot;
use crate::{Joint, NONE};

/// Joints of one crossing between two bodies.
#[derive(Debug, Clone, Default)]
pub(super) struct Crossing {
    /// Joints from the first side to the second.
    pub(super) joints: Vec<Joint>,
    /// Joints between vertices of one side, of negative area: the terms of consistent shape functions beyond pairs of nodes, so that
    /// heat does not flow along the interface.
    pub(super) along: Vec<Joint>,
    /// True area, m².
    pub(super) area: f64,
    /// Index of the mesh's interface, if the crossing is between blocks.
    pub(super) interface: Option<usize>,
}

/// A joint from one foot to another, over the area of the first.
pub(super) fn joint_between(a: Foot, b: Foot, contact: u32) -> Joint {
    Joint { a: a.0, b: b.0, area: a.1, length_a: a.2, length_b: b.2, property_a: a.3, property_b: b.3, contact, reach: [NONE; 2] }
}

/// A joint counted the other way.
pub(super) fn reversed(j: Joint) -> Joint {
    Joint {
        a: j.b,
        b: j.a,
        area: j.area,
        length_a: j.length_b,
        length_b: j.length_a,
        property_a: j.property_b,
        property_b: j.property_a,
        contact: j.contact,
        reach: [j.reach[1], j.reach[0]],
    }
}
