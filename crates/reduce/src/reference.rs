//! Reference for all reduced models of a machine: its network taken apart, and the state in the middle of the ranges.

use super::assemble::{Assembly, Sampling, Snapshot};
use super::basis::ModeBasis;
use super::calibration::{FLOOR, LEAST_MARGIN};
use super::model::{Made, ReducedModel};
use super::network_parts::NetworkParts;
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
/// Fewest states that a model is made of, a count. Chosen: below, nearly no condition of the ranges could be solved.
const FEWEST: usize = 4;

/// A machine's network with the parts that reduced networks are assembled from.
pub(super) struct ReferenceNetwork<'a> {
    machine: &'a Machine,
    network: &'a Network,
    system: System,
    pub(super) parts: NetworkParts,
    /// The load in the middle of the ranges.
    load: Load,
    /// The steady state in the middle of the ranges.
    center: Solution,
    /// Accuracy wanted of the readings, K.
    accuracy: f64,
}

impl<'a> ReferenceNetwork<'a> {
    /// Reference around a steady state of the network, for readings to within `accuracy` (K).
    pub(super) fn new(machine: &'a Machine, network: &'a Network, load: Load, center: Solution, accuracy: f64) -> Self {
        Self { machine, network, system: System::new(network), parts: NetworkParts::of(network), load, center, accuracy }
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
        Assembly { network: self.network, parts: &self.parts, load: &self.load, center: &self.center.temperatures, accuracy: self.accuracy }
    }

    /// A steady state of this very network as a snapshot.
    pub(super) fn snapshot(&self, load: &Load, streams: &[StreamState], temperatures: &[f64]) -> Snapshot {
        Snapshot::of(self.network, &self.parts.rest, load, streams, temperatures, self.center())
    }

    /// A model without parameters made of these states, with the least margin; and its modes.
    ///
    /// # Errors
    /// Too few states, or no temperature follows the variables that vary.
    pub(super) fn model(&self, snapshots: &[Snapshot], ranges: &[(f64, f64)]) -> Result<(ReducedModel, ModeBasis)> {
        if snapshots.len() < FEWEST {
            return Err(Error::numerics("hardly any condition of the ranges has a steady state").help("narrow the ranges with --range"));
        }
        let (assembly, energy) = (self.assembly(), self.energy());
        let (most, free) = (((snapshots.len() as f64 * MODES_PER_STATE) as usize).max(2), assembly.free());
        let is_moving = snapshots.iter().any(|s| s.rise.iter().any(|rise| *rise != 0.0));
        let whole = if free.len() <= most && is_moving { ModeBasis::whole(&free, self.network.solids, &energy) } else { None };
        let basis = whole.unwrap_or_else(|| {
            let rises: Vec<Vec<f64>> = snapshots.iter().map(|s| s.rise.clone()).collect();
            ModeBasis::of(&rises, &energy, most)
        });
        let fine = basis.modes.len();
        if fine == 0 {
            return Err(Error::input("no temperature follows the variables that vary").help("vary what the machine file's formulas name"));
        }
        let coarse = if assembly.is_whole(fine) { fine } else { ((fine as f64 * COARSE) as usize).clamp(1, fine) };
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
            untimed: None,
            field: None,
            made: Made::default(),
        };
        Ok((model, basis))
    }
}
