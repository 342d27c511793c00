//! What all reduced models of a machine are made from: its network taken apart, and the state in the middle of the ranges.

use super::assemble::{Assembly, Sampling, Snapshot};
use super::basis::Basis;
use super::model::{Answer, Made, ReducedModel};
use super::split::Split;
use crate::describe::machine::Machine;
use crate::discretise::network::{Load, Network, StreamState};
use crate::error::{Error, Result};
use crate::solve::{Solution, Symmetric, System};

/// Modes for each solved condition: the last ones are noise of the choice.
const MODES_PER_STATE: f64 = 0.7;
/// Modes of the network that answers, of those of the finer one.
pub(super) const COARSE: f64 = 0.75;
/// How closely the two networks sample.
pub(super) const SAMPLING: [Sampling; 2] = [Sampling { tolerance: 1e-3, together: 0.05 }, Sampling { tolerance: 1e-4, together: 0.01 }];
/// The margin of the bound over the largest that was needed where it was calibrated, and the least.
const SAFETY: f64 = 3.0;
/// The least margin.
pub(super) const LEAST_MARGIN: f64 = 1.0;
/// What the full solver itself leaves open, K.
const FLOOR: f64 = 1e-5;
/// The same as a share of the largest error where the bound was calibrated.
const FLOOR_SHARE: f64 = 0.25;
/// Fewest states that a model is made of.
pub(super) const FEWEST: usize = 4;

/// A machine's network with what reduced ones are assembled from.
pub(super) struct Ground<'a> {
    machine: &'a Machine,
    network: &'a Network,
    system: System,
    pub(super) split: Split,
    /// The load in the middle of the ranges.
    load: Load,
    /// The steady state there.
    center: Solution,
    /// What is wanted of the readings, K.
    accuracy: f64,
}

impl<'a> Ground<'a> {
    /// Around a steady state of the network, for readings to within `accuracy` (K).
    pub(super) fn new(machine: &'a Machine, network: &'a Network, load: Load, center: Solution, accuracy: f64) -> Self {
        Self { machine, network, system: System::new(network), split: Split::of(network), load, center, accuracy }
    }

    /// Temperatures of the middle, K.
    pub(super) fn center(&self) -> &[f64] {
        &self.center.temperatures
    }

    /// The norm of heat that modes are found in.
    pub(super) fn energy(&self) -> Symmetric<'_> {
        self.system.symmetric(self.network, &self.load, &self.center.streams, &self.center.temperatures)
    }

    pub(super) fn assembly(&self) -> Assembly<'_> {
        Assembly { network: self.network, split: &self.split, load: &self.load, center: &self.center.temperatures, accuracy: self.accuracy }
    }

    /// A steady state of this very network with what is learnt from it.
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

/// What a bound needs so that it holds at conditions whose full solution is known.
pub(super) struct Calibrated {
    pub(super) margin: f64,
    /// The least bound, K.
    pub(super) floor: f64,
    /// Largest error there, K.
    pub(super) worst: f64,
}

impl Calibrated {
    /// From the errors of all readings, condition by condition, and the answers that have them.
    pub(super) fn at(compared: &[(Vec<f64>, Answer)]) -> Self {
        let worst = compared.iter().flat_map(|(errors, _)| errors).fold(0.0, |most: f64, error| most.max(*error));
        // Where both networks happen to agree they may still be off together.
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
