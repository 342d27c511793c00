//! Error of the mesh: how far readings may lie from those on an endlessly fine mesh.
//!
//! The machine is solved on two coarser meshes, with a half and a third of the cells along each axis: an eighth and a twenty-seventh of
//! the cells. Where the three readings approach a limit at a positive order p, the error is the last difference over r^p - 1
//! (Richardson), times a safety factor (Roache, J. Fluids Eng. 116 (1994) 405). Near the scheme's second order the factor is 1.25. A
//! lower order comes from an edge at which the field is singular: two materials, a corner, the rim of a contact. There it falls further
//! on finer meshes, and the factor is 3 (Oberkampf and Roy, Verification and Validation in Scientific Computing, 2010, section 8.7).
//! Where no order shows, order 1 is assumed, and the larger of the two differences from the fine mesh counts. The
//! ratio r of cell sizes is the mean over all lines of more than one cell, since some blocks cannot be cut so coarsely.
//!
//! Bounds of the estimate: in a checkerboard of two materials the estimate covers the error up to a contrast of 1:1000
//! (`estimates_cover_errors_of_singular_fields`), at the price of two to three times the error.

use serde::Serialize;

use super::{MeshedMachine, SteadyState};
use crate::balance::contact_flows;
use coldplate_base::error::Result;
use coldplate_describe::machine::Condition;
use coldplate_describe::machine::{BlockShape, PartBlock};
use coldplate_network::mesh::Mesh;

/// Ratios of cell sizes of the two coarser meshes along each axis, dimensionless. Chosen: cost of two further solutions against the
/// range of the extrapolation.
const COARSER: [f64; 2] = [2.0, 3.0];
/// Least ratio of cell sizes from which an error is estimated, dimensionless. Chosen.
const LEAST_RATIO: f64 = 1.2;
/// Safety factors on the extrapolated error, dimensionless: for orders from [`REGULAR`] on or where none shows, and below; see above.
const SAFETY: [f64; 2] = [1.25, 3.0];
/// Order from which a field counts as regular, dimensionless. Chosen: between second order and the 4/3 of a corner of three quarters.
const REGULAR: f64 = 1.5;
/// Orders of convergence that are believed, dimensionless: up to the scheme's second order; the lower end is chosen, and bounds the
/// error by 28 times the last difference.
const ORDERS: std::ops::RangeInclusive<f64> = 0.05..=2.0;

/// Errors of discretisation at some conditions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeshErrors {
    /// Largest estimate for each sensor at any of the conditions, K or um, in the machine's order.
    #[serde(skip)]
    pub errors: Vec<f64>,
    /// Order of convergence of each sensor where its estimate is largest; `None` if no order that is believed shows.
    #[serde(skip)]
    pub orders: Vec<Option<f64>>,
    /// Largest estimate for the heat through each heat-flow sensor, then through each contact, W; empty where they were not asked for.
    #[serde(skip)]
    pub heats: Vec<f64>,
    /// Cells of the coarser meshes that the estimates come from.
    pub cells: [usize; 2],
}

impl MeshedMachine {
    /// Estimates the error of the mesh in every reading of a state of this model; `None` where its cells cannot be coarser: single
    /// ones, and imported elements.
    ///
    /// # Errors
    /// A coarser mesh cannot be solved.
    pub fn mesh_errors(&self, condition: &Condition, state: &SteadyState) -> Result<Option<MeshErrors>> {
        self.mesh_errors_over(&[(condition.clone(), self.estimated(state))])
    }

    /// Quantities of a state whose errors are estimated: readings of the sensors, then heats (W) of heat-flow sensors and contacts.
    fn estimated(&self, state: &SteadyState) -> Vec<f64> {
        let contacts = contact_flows(&self.network, &state.load.contacts, &state.solution.temperatures);
        let heats = self.heat_flows(state).into_iter().chain(contacts.into_iter().map(|contact| contact.heat));
        self.readings(state).into_iter().chain(heats).collect()
    }

    /// Estimates the error of the mesh in every reading as the largest at some conditions, each with its readings of this model
    /// ([`MeshedMachine::readings`]); heats are not asked for. `None` as for [`MeshedMachine::mesh_errors`], and without a condition.
    ///
    /// # Errors
    /// A coarser mesh cannot be solved.
    pub fn mesh_errors_over(&self, solved: &[(Condition, Vec<f64>)]) -> Result<Option<MeshErrors>> {
        let Some((reference, _)) = solved.first().filter(|_| !self.mesh.grids.is_empty() && self.mesh.tetra.is_empty()) else {
            return Ok(None);
        };
        let meshes = [self.coarser(COARSER[0])?, self.coarser(COARSER[1])?];
        let ratios = [&meshes[0], &meshes[1]].map(|coarse| self.ratio_to(coarse));
        if ratios[0] < LEAST_RATIO {
            return Ok(None);
        }
        let cells = [meshes[0].cells, meshes[1].cells];
        let readings = |mesh: Mesh| -> Result<Vec<Vec<f64>>> {
            let model = Self::on(self.machine.clone(), mesh)?;
            let solver = model.solver(reference)?;
            solved.iter().map(|(condition, _)| Ok(model.estimated(&model.solve(&solver, condition)?))).collect()
        };
        let [half, third] = meshes;
        let (half, third) = (readings(half)?, readings(third)?);
        let largest = |q: usize| {
            let at = |(k, (_, fine)): (usize, &(Condition, Vec<f64>))| estimate([fine[q], half[k][q], third[k][q]], ratios);
            solved.iter().enumerate().map(at).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default()
        };
        let all = solved.iter().map(|(_, fine)| fine).chain(&half).chain(&third);
        let count = all.map(Vec::len).min().unwrap_or(0);
        let (mut errors, mut orders): (Vec<f64>, Vec<Option<f64>>) = (0..count).map(largest).unzip();
        orders.truncate(self.network.sensors.len());
        let heats = errors.split_off(orders.len());
        Ok(Some(MeshErrors { errors, orders, heats, cells }))
    }

    /// Mean ratio of the cell sizes of a coarser mesh to those of this one, along lines that have more than one cell.
    fn ratio_to(&self, coarse: &Mesh) -> f64 {
        let (mut sum, mut weight) = (0.0, 0.0);
        for (fine, coarse) in self.mesh.divisions().iter().zip(coarse.divisions()) {
            let lines = fine.iter().filter(|n| **n > 1).count();
            let cells: f64 = fine.iter().map(|n| *n as f64).product();
            let fewer: f64 = fine.iter().zip(coarse).map(|(fine, coarse)| *fine as f64 / coarse as f64).product();
            if lines > 0 {
                (sum, weight) = (sum + cells * fewer.ln() / lines as f64, weight + cells);
            }
        }
        if weight > 0.0 { (sum / weight).exp() } else { 1.0 }
    }

    /// A mesh of the same machine with cells `ratio` times as long along each axis, as far as its blocks allow.
    pub(super) fn coarser(&self, ratio: f64) -> Result<Mesh> {
        let blocks = self.machine.parts.iter().flat_map(|p| &p.blocks);
        let fewer = |(n, block): (&[usize; 3], &PartBlock)| {
            let is_turn = matches!(block.shape, BlockShape::Cylinder { turn, .. } if turn.1 - turn.0 > 0.99 * std::f64::consts::TAU);
            let least = [1, if is_turn { 4 } else { 1 }, 1];
            std::array::from_fn(|d| ((n[d] as f64 / ratio).round() as usize).max(n[d].min(least[d])))
        };
        let counts: Vec<[usize; 3]> = self.mesh.divisions().iter().zip(blocks).map(fewer).collect();
        Mesh::with_divisions(&self.machine, &counts, ratio * self.mesh.element_size)
    }
}

/// Error of the first of three readings, K, and the order they show; cells of the others are `ratios` times as long.
fn estimate([fine, half, third]: [f64; 3], ratios: [f64; 2]) -> (f64, Option<f64>) {
    let order = order((half - third) / (fine - half), ratios).filter(|order| ORDERS.contains(order));
    let error = match order {
        Some(order) => SAFETY[usize::from(order < REGULAR)] * (fine - half).abs() / (ratios[0].powf(order) - 1.0),
        None => SAFETY[0] * f64::max((fine - half).abs() / (ratios[0] - 1.0), (fine - third).abs() / (ratios[1] - 1.0)),
    };
    (error, order)
}

/// Order of convergence p from the quotient of two differences, (b^p - a^p) / (a^p - 1) for ratios a and b: by bisection, as
/// the quotient grows with p.
fn order(quotient: f64, [a, b]: [f64; 2]) -> Option<f64> {
    let of = |p: f64| (b.powf(p) - a.powf(p)) / (a.powf(p) - 1.0);
    let (mut low, mut high) = (*ORDERS.start() / 2.0, *ORDERS.end() * 2.0);
    if b <= a || !(of(low)..=of(high)).contains(&quotient) {
        return None;
    }
    for _ in 0..50 {
        let middle = f64::midpoint(low, high);
        if of(middle) < quotient { low = middle } else { high = middle }
    }
    Some(low)
}
