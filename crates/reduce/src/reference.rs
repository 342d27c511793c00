//! Reference for all reduced models of a machine: its network taken apart, and the state in the middle of the ranges.

use super::assemble::{Assembly, Sampling, Snapshot};
use super::basis::Basis;
use super::model::{Answer, Made, ReducedModel};
use super::network_parts::Split;
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::Machine;
use coldplate_network::{Load, Network, StreamState};
use coldplate_solve::{Solution, Symmetric, System};

/// Modes per solved condition, dimensionless. Chosen below one: the last modes hold the noise of which conditions
/// were solved.
const MODES_PER_STATE: f64 = 0.7;
/// Share of the finer network's modes that the coarser one has. Chosen: closer to one, the difference of the two no
/// longer shows the error; smaller, the readings are worse.
pub(super) const COARSE: f64 = 0.75;
/// Sampling of the coarser and of the finer network; the fields say what each number is. Chosen: smaller values add
/// conductors and stations to every answer.
pub(super) const SAMPLING: [Sampling; 2] = [Sampling { tolerance: 1e-3, together: 0.05 }, Sampling { tolerance: 1e-4, together: 0.01 }];
/// Factor, dimensionless, on the largest margin that a reading of the calibration needed. Chosen: larger covers more
/// unseen conditions, but widens every bound.
const SAFETY: f64 = 3.0;
/// Least margin of the bound, dimensionless. Chosen: the calibration may not have met the worst reading, larger
/// widens every bound.
pub(super) const LEAST_MARGIN: f64 = 1.0;
/// Error that the tolerance of the full solver leaves open, K: errors below are not counted against the bound.
const FLOOR: f64 = 1e-5;
/// Floor of the bound as a share of the largest error in the calibration. Chosen: it covers readings at which both
/// networks happen to agree.
const FLOOR_SHARE: f64 = 0.25;
/// Fewest states that a model is made of, a count. Chosen: below, nearly no condition of the ranges could be solved.
pub(super) const FEWEST: usize = 4;

/// A machine's network with what reduced ones are assembled from.
pub(super) struct Ground<'a> {
    machine: &'a Machine,
    network: &'a Network,
    system: System,
    pub(super) split: Split,
    /// The load in the middle of the ranges.
    load: Load,
    /// The steady state in the middle of the ranges.
    center: Solution,
    /// Accuracy wanted of the readings, K.
    accuracy: f64,
}

impl<'a> Ground<'a> {
    /// Reference around a steady state of the network, for readings to within `accuracy` (K).
    pub(super) fn new(machine: &'a Machine, network: &'a Network, load: Load, center: Solution, accuracy: f64) -> Self {
        Self { machine, network, system: System::new(network), split: Split::of(network), load, center, accuracy }
    }

    /// Temperatures of the middle, K.
    pub(super) fn center(&self) -> &[f64] {
        &self.center.temperatures
    }

    /// Matrix of the energy norm that modes are orthonormal in.
    pub(super) fn energy(&self) -> Symmetric<'_> {
        self.system.symmetric(self.network, &self.load, &self.center.streams, &self.center.temperatures)
    }

    pub(super) fn assembly(&self) -> Assembly<'_> {
        Assembly { network: self.network, split: &self.split, load: &self.load, center: &self.center.temperatures, accuracy: self.accuracy }
    }

    /// A steady state of this very network as a snapshot.
    pub(super) fn snapshot(&self, load: &Load, streams: &[StreamState], temperatures: &[f64]) -> Snapshot {
        Snapshot::of(self.network, &self.split.rest, load, streams, temperatures, self.center())
    }

    /// A model without parameters made of these states, with the least margin; and its modes.
    ///
    /// # Errors
    /// Too few states, or no temperature follows what varies.
    pub(super) fn model(&self, snapshots: &[Snapshot], ranges: &[(f64, f64)]) -> Result<(ReducedModel, Basis)> {
        if snapshots.len() < FEWEST {
            return Err(Error::numerics("hardly any condition of the ranges has a steady state").help("narrow the ranges with --range"));
        }
        let rises: Vec<Vec<f64>> = snapshots.iter().map(|s| s.rise.clone()).collect();
        let basis = Basis::of(&rises, &self.energy(), ((snapshots.len() as f64 * MODES_PER_STATE) as usize).max(2));
        let fine = basis.modes.len();
        if fine == 0 {
            return Err(Error::input("no temperature follows what varies").help("vary what the machine file's formulas name"));
        }
        let (coarse, assembly) = (((fine as f64 * COARSE) as usize).clamp(1, fine), self.assembly());
        let model = ReducedModel {
            machine: self.machine.clone(),
            parameters: Vec::new(),
            left_out: Vec::new(),
            ranges: ranges.to_vec(),
            coarse: assembly.level(&basis.modes[..coarse], snapshots, snapshots.len(), SAMPLING[0]),
            fine: assembly.level(&basis.modes, snapshots, snapshots.len(), SAMPLING[1]),
            margin: LEAST_MARGIN,
            floor: FLOOR,
            in_time: None,
            field: None,
            made: Made::default(),
        };
        Ok((model, basis))
    }
}

/// Margin and floor with which the bound holds at conditions whose full solution is known.
pub(super) struct Calibrated {
    pub(super) margin: f64,
    /// The least bound, K.
    pub(super) floor: f64,
    /// Largest error of a reading at these conditions, K.
    pub(super) worst: f64,
}

impl Calibrated {
    /// Calibration from the errors of all readings, condition by condition, and the answers with these errors.
    pub(super) fn at(compared: &[(Vec<f64>, Answer)]) -> Self {
        let worst = compared.iter().flat_map(|(errors, _)| errors).fold(0.0, |most: f64, error| most.max(*error));
        // Both networks may agree and still be off together.
        let floor = FLOOR.max(FLOOR_SHARE * worst);
        let mut needed: f64 = 0.0;
        for (errors, answer) in compared {
            let apart = answer.readings.iter().zip(&answer.finer).map(|(c, f)| (c - f).abs());
            let largest = apart.clone().fold(0.0, f64::max);
            let counted = errors.iter().zip(apart).filter(|(error, _)| **error > FLOOR);
            let beyond = counted.map(|(error, apart)| error - apart).fold(0.0, f64::max);
            if largest > 0.0 {
                needed = needed.max(beyond / largest);
            }
        }
        Self { margin: (SAFETY * needed).max(LEAST_MARGIN), floor, worst }
    }
}
