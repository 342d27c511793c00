//! Joints, boundaries and streams whose heat is measured by heat-flow sensors.

use std::collections::HashSet;

use super::Builder;
use crate::{HeatMeter, Through};
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::{Face, HeatFlow, HeatPath};

/// Share of a cell's face that counts as rounding, dimensionless. Chosen.
const LEAST_SHARE: f64 = 1e-9;

impl Builder<'_> {
    /// Marks the cell faces whose heat is asked for: each gets a node of its own, and all heat goes through its half cell.
    pub(super) fn meter_faces(&mut self) {
        for flow in &self.machine.heat_flows {
            if let HeatPath::Face(face) = flow.through {
                for (g, c, _) in self.mesh.face_cells(face) {
                    self.probed.entry((g, face.side as usize, self.mesh.grids[g].cell(c))).or_default();
                }
            }
        }
    }

    pub(super) fn meters(&mut self) -> Result<()> {
        for flow in &self.machine.heat_flows {
            let through = match flow.through {
                HeatPath::Boundary(boundary) => Through::Boundary(boundary),
                HeatPath::Channel(channel) => Through::Stream(channel),
                HeatPath::Contact { contact, out_of } => {
                    // A link between places that do not touch: its first half, which begins at the first place.
                    let group = self.network.contacts.iter().find(|group| group.of == Some(contact));
                    let sign = if out_of == 0 { 1.0 } else { -1.0 };
                    Through::Joints(group.map_or_else(Vec::new, |g| g.joints.clone().map(|j| (j as u32, sign)).collect()))
                }
                HeatPath::Face(face) => Through::Joints(self.half_cells(flow, face)?),
            };
            self.network.meters.push(HeatMeter { name: flow.name.clone(), through });
        }
        Ok(())
    }

    /// The joints through which all heat out of a face goes, with their signs.
    fn half_cells(&self, flow: &HeatFlow, face: Face) -> Result<Vec<(u32, f64)>> {
        let refused = |what: &str, help: &str| {
            Err(Error::input(format!("the heat through the face of '{}' is not known: {what}", flow.name))
                .at_line(flow.line)
                .at_key(format!("heat_flow.{}.face", flow.name))
                .help(help))
        };
        let mut halves: HashSet<(u32, u32)> = HashSet::new();
        for (g, c, area) in self.mesh.face_cells(face) {
            let cell = self.mesh.grids[g].cell(c);
            let at = (g, face.side as usize, cell);
            let nodes = self.probed.get(&at).map_or(&[][..], Vec::as_slice);
            let known: f64 = nodes.iter().map(|n| n.1).sum();
            if self.bypassed.contains(&at) {
                return refused("a contact over a stated area, or a radiation link, shares it", "name that contact");
            }
            if known < (1.0 - LEAST_SHARE) * area {
                return refused("it is the wall of a bore, or lies under a mesh", "name the channel, or the contact");
            }
            if known > (1.0 + LEAST_SHARE) * area {
                return refused("a cell of it lies partly against its own part", "name the face of one block");
            }
            halves.extend(nodes.iter().map(|(node, _)| (cell as u32, *node)));
        }
        if halves.is_empty() {
            return refused("it has no area", "name a face on the outside of its part");
        }
        let sign = |j: &crate::Joint| {
            if halves.contains(&(j.a, j.b)) { Some(1.0) } else { halves.contains(&(j.b, j.a)).then_some(-1.0) }
        };
        Ok(self.network.joints.iter().enumerate().filter_map(|(i, j)| Some((i as u32, sign(j)?))).collect())
    }
}
