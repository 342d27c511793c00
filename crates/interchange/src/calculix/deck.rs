//! Nodes, elements, equations and loads on the way into a deck.

/// Kinds of elements, by CalculiX's names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ElementKind {
    /// Hexahedron.
    C3D8,
    /// Wedge.
    C3D6,
    /// Tetrahedron.
    C3D4,
    /// Fluid network element: a node before, the mass flow, a node behind.
    D,
}

impl ElementKind {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::C3D8 => "C3D8",
            Self::C3D6 => "C3D6",
            Self::C3D4 => "C3D4",
            Self::D => "D",
        }
    }
}

/// Sets of elements that share a section.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum ElementSet {
    /// The cells of a grid of the mesh.
    Grid(usize),
    /// Wedges across contacts.
    Contact,
    /// Wedges across bonds.
    Bond,
    /// Tetrahedra that have the temperature of a place.
    Place,
    /// The fluid network.
    Water,
}

impl ElementSet {
    pub(super) fn name(self) -> String {
        match self {
            Self::Grid(g) => format!("BLOCK{}", g + 1),
            Self::Contact => "CONTACT".into(),
            Self::Bond => "BOND".into(),
            Self::Place => "PLACE".into(),
            Self::Water => "WATER".into(),
        }
    }
}

/// Weights over nodes, which sum to one.
pub(super) type NodeWeights = Vec<(u32, f64)>;

/// Number of the node that stands outside of the network, where water comes from and goes to: zero in CalculiX.
pub(super) const OUTSIDE: u32 = 0;

#[derive(Debug, Clone)]
pub(super) struct Element {
    pub(super) kind: ElementKind,
    pub(super) set: ElementSet,
    pub(super) nodes: Vec<u32>,
}

/// A film on a face of an element.
#[derive(Debug, Clone, Copy)]
pub(super) struct FilmCard {
    pub(super) element: usize,
    pub(super) face: u8,
    /// Film coefficient, W/(m² K).
    pub(super) film: f64,
    pub(super) sink: Sink,
}

/// Sink of a film's heat.
#[derive(Debug, Clone, Copy)]
pub(super) enum Sink {
    /// A temperature, K.
    Temperature(f64),
    /// A node of the fluid network.
    Water(u32),
}

/// Content of a deck.
#[derive(Debug, Clone, Default)]
pub(super) struct Deck {
    /// Coordinates, m.
    pub(super) nodes: Vec<[f64; 3]>,
    pub(super) elements: Vec<Element>,
    /// Nodes whose temperature follows from those of others.
    pub(super) equations: Vec<(u32, NodeWeights)>,
    /// Nodes held at a temperature.
    pub(super) held: Vec<(u32, f64)>,
    /// Mass flow (kg/s) at the middle nodes of fluid elements.
    pub(super) flows: Vec<(u32, f64)>,
    /// Heat into nodes, W.
    pub(super) heats: Vec<(u32, f64)>,
    pub(super) films: Vec<FilmCard>,
    /// Element, face, effective emissivity, temperature of the surroundings that it sees (K).
    pub(super) radiation: Vec<(usize, u8, f64, f64)>,
    /// Element, face, flux into it (W/m²).
    pub(super) fluxes: Vec<(usize, u8, f64)>,
    /// Element, heat per volume (W/m³).
    pub(super) sources: Vec<(usize, f64)>,
}

impl Deck {
    /// Adds a node; returns its number.
    pub(super) fn node(&mut self, at: [f64; 3]) -> u32 {
        self.nodes.push(at);
        self.nodes.len() as u32
    }

    /// Adds a node whose temperature is a mean of others; returns its number.
    pub(super) fn follower(&mut self, at: [f64; 3], weights: &NodeWeights) -> u32 {
        let node = self.node(at);
        self.equations.push((node, weights.clone()));
        node
    }

    /// Adds an element; returns its number.
    pub(super) fn element(&mut self, kind: ElementKind, set: ElementSet, nodes: Vec<u32>) -> usize {
        self.elements.push(Element { kind, set, nodes });
        self.elements.len()
    }

    /// Adds a tetrahedron at the temperature of `weights`, with a first face of `area` (m²); returns its number and first node. The
    /// fourth node is free: nothing takes heat from it.
    pub(super) fn place(&mut self, at: [f64; 3], area: f64, weights: &NodeWeights) -> (usize, u32) {
        let leg = (2.0 * area).sqrt();
        let free = self.node([at[0], at[1], at[2] + leg]);
        self.under(free, at, leg, weights)
    }

    /// Adds a tetrahedron below a node, at this node's temperature; returns its number.
    pub(super) fn place_of(&mut self, node: u32, area: f64) -> usize {
        let leg = (2.0 * area).sqrt();
        let [x, y, z] = self.nodes[node as usize - 1];
        self.under(node, [x, y, z - leg], leg, &vec![(node, 1.0)]).0
    }

    fn under(&mut self, top: u32, [x, y, z]: [f64; 3], leg: f64, weights: &NodeWeights) -> (usize, u32) {
        let nodes = [[x, y, z], [x + leg, y, z], [x, y + leg, z]].map(|p| self.follower(p, weights));
        (self.element(ElementKind::C3D4, ElementSet::Place, vec![nodes[0], nodes[1], nodes[2], top]), nodes[0])
    }

    /// Adds a wedge between two places: ends of `area` (m²), `thickness` (m) apart.
    pub(super) fn wedge(&mut self, set: ElementSet, at: [f64; 3], area: f64, thickness: f64, ends: [&NodeWeights; 2]) {
        let leg = (2.0 * area).sqrt();
        let corner = |x: f64, y: f64, z: f64| [at[0] + x, at[1] + y, at[2] + z];
        let mut nodes = Vec::with_capacity(6);
        for (weights, z) in ends.into_iter().zip([0.0, thickness]) {
            nodes.extend([corner(0.0, 0.0, z), corner(leg, 0.0, z), corner(0.0, leg, z)].map(|p| self.follower(p, weights)));
        }
        self.element(ElementKind::C3D6, set, nodes);
    }
}
