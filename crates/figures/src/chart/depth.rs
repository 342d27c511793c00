//! Order in which bodies are painted, so that the nearer hide the farther.

/// The box around a body, along the axes of the machine, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Around {
    /// Smallest coordinates.
    pub low: [f64; 3],
    /// Largest coordinates.
    pub high: [f64; 3],
}

impl Around {
    /// The box around points; `None` without any.
    pub fn of(points: impl IntoIterator<Item = [f64; 3]>) -> Option<Self> {
        points.into_iter().fold(None, |found: Option<Self>, p| {
            let Self { low, high } = found.unwrap_or(Self { low: p, high: p });
            Some(Self { low: [0, 1, 2].map(|d| low[d].min(p[d])), high: [0, 1, 2].map(|d| high[d].max(p[d])) })
        })
    }

    fn depth(&self, eye: [f64; 3]) -> f64 {
        (0..3).map(|d| 0.5 * (self.low[d] + self.high[d]) * eye[d]).sum()
    }

    /// Whether a plane between the two, normal to an axis, shows that this one cannot hide the other.
    fn cannot_hide(&self, other: &Self, eye: [f64; 3]) -> bool {
        (0..3).any(|d| {
            let room = 1e-6 * (self.high[d] - self.low[d]).abs().max(other.high[d] - other.low[d]);
            let (below, above) = (self.high[d] <= other.low[d] + room, self.low[d] + room >= other.high[d]);
            // Seen along the plane, neither hides the other.
            below && eye[d] >= 0.0 || above && eye[d] <= 0.0
        })
    }
}

/// Indices of the boxes, first the boxes that others may hide. Boxes that pass through each other are ordered by
/// their middles, and so are circles of boxes.
pub fn order(boxes: &[Around], eye: [f64; 3]) -> Vec<usize> {
    let before = |a: usize, b: usize| {
        let (a_cannot, b_cannot) = (boxes[a].cannot_hide(&boxes[b], eye), boxes[b].cannot_hide(&boxes[a], eye));
        match (a_cannot, b_cannot) {
            (true, false) => true,
            (false, false) => boxes[a].depth(eye) < boxes[b].depth(eye),
            _ => false,
        }
    };
    let mut left: Vec<usize> = (0..boxes.len()).collect();
    left.sort_by(|a, b| boxes[*a].depth(eye).total_cmp(&boxes[*b].depth(eye)));
    let mut order = Vec::with_capacity(left.len());
    while !left.is_empty() {
        let free = left.iter().position(|b| left.iter().all(|a| a == b || !before(*a, *b))).unwrap_or(0);
        order.push(left.remove(free));
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_on_a_plate_is_painted_after_it() {
        // The middle of the large plate is nearer to the eye than that of the block on its far corner.
        let plate = Around { low: [0.0; 3], high: [1.0, 1.0, 0.1] };
        let block = Around { low: [0.0, 0.8, 0.1], high: [0.1, 0.9, 0.2] };
        let eye = [0.6, -0.6, 0.5];
        assert!(plate.depth(eye) > block.depth(eye));
        assert_eq!(order(&[block, plate], eye), [1, 0]);
    }
}
