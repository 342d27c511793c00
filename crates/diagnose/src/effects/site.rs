//! Where causes are looked for: a machine with its data.

use super::UserKind;
use super::law::Law;
use super::scales::Scales;
use coldplate_base::condition::{COOLANT_FLOW, MOTOR_SPEED};
use coldplate_describe::machine::{Machine, Place};
use coldplate_evidence::measurement::Data;
use coldplate_network::{Load, Network};
use coldplate_solve::study::Study;

/// Where candidates are looked for.
pub struct Site<'a> {
    pub study: &'a Study,
    pub machine: &'a Machine,
    pub network: &'a Network,
    pub data: &'a Data,
    pub user: &'a [UserKind],
    /// Parts and lumped nodes that are free to move.
    pub groups: Vec<Group>,
    /// Laws that heat can follow in these data.
    pub laws: Vec<Law>,
    /// Where they are one.
    pub scales: Scales,
    /// Whether the coolant flow varies.
    pub flow_varies: bool,
    /// Whether anything radiates to the chamber: a machine in vacuum, not in a room.
    pub is_in_vacuum: bool,
}

/// A part or lumped node.
#[derive(Debug, Clone)]
pub struct Group {
    pub index: u32,
    pub name: String,
}

impl<'a> Site<'a> {
    pub fn new(study: &'a Study, data: &'a Data, user: &'a [UserKind]) -> Self {
        let (machine, network) = (&study.model.machine, &study.model.network);
        let scales = Scales::of(data, machine);
        let varies = |name: &str| machine.variables.iter().position(|v| v.name == name).is_some_and(|v| scales.varies(v));
        let mut laws = vec![Law::Constant];
        if varies(MOTOR_SPEED) {
            laws.extend([Law::Speed, Law::SpeedSquared]);
        }
        let flow_varies = varies(COOLANT_FLOW);
        laws.extend(scales.laws(machine));
        let is_free =
            |g: usize| (0..network.solids).any(|n| network.group[n] == g as u32 && !network.fixed.iter().any(|(f, _)| *f as usize == n));
        let groups = network.groups.iter().enumerate().filter(|(g, _)| is_free(*g));
        Self {
            groups: groups.map(|(g, name)| Group { index: g as u32, name: name.clone() }).collect(),
            flow_varies,
            is_in_vacuum: network.surfaces.iter().any(|s| s.emissive > 0.0),
            study,
            machine,
            network,
            data,
            user,
            laws,
            scales,
        }
    }

    /// All heat of the sources, W: the most at any condition of the data.
    pub(crate) fn whole_heat(&self) -> f64 {
        let loads = self.data.rows.iter().filter_map(|row| Load::at(self.machine, &row.condition).ok());
        loads.map(|load| load.powers.iter().map(|p| p.abs()).sum::<f64>()).fold(0.0, f64::max)
    }

    /// Names of the parts and lumped nodes of some places.
    pub fn part_names(&self, places: &[Place]) -> Vec<String> {
        let name = |place: &Place| match place {
            Place::Part(p) => self.machine.parts[*p].name.clone(),
            Place::Face(face) => self.machine.parts[face.part].name.clone(),
            Place::Node(n) => self.machine.nodes[*n].name.clone(),
        };
        places.iter().map(name).collect()
    }

    /// Lumped nodes of given temperature, but those at the temperature of the chamber, to which every group may leak.
    pub fn given(&self) -> Vec<Group> {
        let loads: Vec<Load> = self.data.rows.iter().filter_map(|row| Load::at(self.machine, &row.condition).ok()).collect();
        let differs = |n: usize| loads.iter().any(|load| (load.fixed[n] - load.chamber).abs() > 1e-6);
        let parts = self.machine.parts.len();
        let held = self.machine.nodes.iter().enumerate().filter(|(n, node)| node.fixed.is_some() && differs(*n));
        held.map(|(n, node)| Group { index: (parts + n) as u32, name: node.name.clone() }).collect()
    }

    /// Whether something joins two groups.
    pub fn touch(&self, a: u32, b: u32) -> bool {
        let of = |n: u32| self.network.group[n as usize];
        self.network.joints.iter().any(|j| (of(j.a), of(j.b)) == (a, b) || (of(j.a), of(j.b)) == (b, a))
    }

    /// Pairs of some groups that do not touch.
    pub fn apart<'g>(&self, groups: &'g [Group]) -> Vec<(&'g Group, &'g Group)> {
        let of = |n: u32| self.network.group[n as usize];
        let touches: std::collections::HashSet<(u32, u32)> =
            self.network.joints.iter().map(|j| (of(j.a).min(of(j.b)), of(j.a).max(of(j.b)))).collect();
        let pairs = groups.iter().enumerate().flat_map(|(i, a)| groups[i + 1..].iter().map(move |b| (a, b)));
        pairs.filter(|(a, b)| !touches.contains(&(a.index.min(b.index), a.index.max(b.index)))).collect()
    }
}
