//! View factors of an enclosure, for reports.

/// The view factors an enclosure was built with.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EnclosureViews {
    /// Name of the enclosure.
    pub name: String,
    /// Names of its surfaces, in the order of the machine file, the chamber left out.
    pub surfaces: Vec<String>,
    /// Areas, m².
    pub areas: Vec<f64>,
    /// Emissivities.
    pub emissivities: Vec<f64>,
    /// View factors from each surface (row) to each.
    pub view_factors: Vec<Vec<f64>>,
    /// View factor from each surface to the chamber.
    pub chamber: Vec<f64>,
    /// Conductors of the enclosure in the network's list of radiative ones.
    pub conductors: std::ops::Range<usize>,
    /// Surfaces at the two ends of each conductor; [`super::NONE`] where an end is the chamber or a node between.
    pub ends: Vec<[u32; 2]>,
    /// Patches the surfaces were cut into.
    pub patches: usize,
    /// Pairs of patches whose view factor was found by rays.
    pub by_rays: usize,
    /// Largest standard error of those view factors.
    pub error: f64,
    /// Largest change of a view factor to make reciprocity and sums hold.
    pub corrected: f64,
    /// Remarks.
    pub notes: Vec<String>,
}
