//! Water that moves through all streams during a stage: parcels in plug flow, exchanging heat with walls held at one temperature.
//!
//! Cuts and ways of the water follow from the flow alone (`plan`); the heat that it gives off is linear in the wall
//! temperatures. A stage therefore plans once, asks for the heat along as many walls as its iteration takes, and moves the water once,
//! at its end.

use super::parcels::{Inflow, Inflows, Parcel, Parcels, mixed};
use super::passage::Passage;
pub use super::plan::WaterPassage;
use super::plan::WaterPlan;
use coldplate_base::error::Result;
use coldplate_network::stream::members;
use coldplate_network::{Load, Network, StreamState};

/// The streams of a network during a stage, and the water in them.
pub struct Streams<'n> {
    network: &'n Network,
    passages: Vec<Passage>,
    /// Weight of each upstream stream in the inlet mixture.
    mixtures: Vec<Vec<f64>>,
    /// Whether another stream takes in the outflow of each stream.
    feeds: Vec<bool>,
    /// Water in each stream at the beginning.
    parcels: Vec<Parcels>,
    /// Inflow of each circuit.
    inflows: Vec<Inflows>,
    plans: Vec<WaterPlan>,
}

/// Result of a stage for the water.
#[derive(Debug, Default)]
pub struct Water {
    /// Parcels of each stream, from the inlet on.
    pub parcels: Vec<Parcels>,
    /// Heat that came with the water, less the heat that went with it, J.
    pub brought: f64,
    /// Heat of dissipation, J.
    pub dissipated: f64,
    /// Increase of the heat in the water, J.
    pub stored: f64,
}

impl<'n> Streams<'n> {
    /// The streams in given states for a duration (s), with the water that is in them and the inflow of each circuit.
    pub fn new(network: &'n Network, states: &[StreamState], duration: f64, water: &[Parcels], inflows: Vec<Inflows>) -> Self {
        let passages: Vec<Passage> = network.streams.iter().zip(states).map(|(stream, s)| Passage::new(stream, s, duration)).collect();
        let parcels = passages.iter().zip(water).map(|(passage, parcels)| passage.fitted(parcels)).collect();
        Self::planned(network, passages, states.iter().map(|s| s.mixture.clone()).collect(), parcels, inflows)
    }

    fn planned(
        network: &'n Network,
        passages: Vec<Passage>,
        mixtures: Vec<Vec<f64>>,
        parcels: Vec<Parcels>,
        inflows: Vec<Inflows>,
    ) -> Self {
        let feeds = (0..network.streams.len()).map(|s| network.streams.iter().any(|below| below.upstream.contains(&s))).collect();
        let mut streams = Self { network, passages, mixtures, feeds, parcels, inflows, plans: Vec::new() };
        let mut plans: Vec<Option<WaterPlan>> = vec![None; network.streams.len()];
        // The division of flows depends on no temperature, so flows of zero temperature tell how mixed flows are divided.
        let mut outflows: Vec<Inflows> = vec![Inflows::new(); network.streams.len()];
        for (circuit, tree) in network.circuits.iter().enumerate() {
            for s in members(&tree.layout) {
                let entering = streams.entering(circuit, s, |above| &outflows[above]);
                let plan = WaterPlan::new(&streams.passages[s], &streams.parcels[s], &entering);
                if streams.feeds[s] {
                    outflows[s] = plan.empty_outflow();
                }
                plans[s] = Some(plan);
            }
        }
        streams.plans = plans.into_iter().flatten().collect();
        streams
    }

    /// These streams with water of zero temperature and without dissipation: the response to the walls alone. Water of one temperature
    /// needs one parcel, which is cut at the stations.
    pub fn cold(&self) -> Self {
        let one = |parcels: &Parcels| vec![Parcel::even(parcels.iter().map(|p| p.volume).sum(), 0.0)];
        let none = |flow: &Inflows| flow.iter().map(|s| Inflow { share: s.share, first: 0.0, last: 0.0 }).collect();
        let passages = self.passages.iter().map(Passage::calm).collect();
        let (parcels, inflows) = (self.parcels.iter().map(one).collect(), self.inflows.iter().map(none).collect());
        Self::planned(self.network, passages, self.mixtures.clone(), parcels, inflows)
    }

    /// Whether there is no water.
    pub fn is_empty(&self) -> bool {
        self.passages.is_empty()
    }

    /// Carries the water of every stream along walls, upstream ones first.
    pub fn carry(&self, wall: &dyn Fn(usize) -> f64) -> Vec<WaterPassage> {
        let mut found: Vec<WaterPassage> = vec![WaterPassage::default(); self.passages.len()];
        let mut walls = Vec::new();
        for (circuit, tree) in self.network.circuits.iter().enumerate() {
            for s in members(&tree.layout) {
                walls.clear();
                walls.extend(self.network.streams[s].stations.iter().map(|k| k.cells.iter().map(|(n, w)| w * wall(*n)).sum::<f64>()));
                let entering = self.entering(circuit, s, |above| &found[above].outflow);
                let mut passed = self.plans[s].pass(&self.passages[s], &walls, &self.parcels[s], &entering);
                if self.feeds[s] {
                    passed.outflow = self.plans[s].outflow(&passed.marks);
                }
                found[s] = passed;
            }
        }
        found
    }

    /// Derivative of the heat to each wall of a stream with respect to the wall's own temperature, sign turned, J/K.
    pub fn weight(&self, stream: usize) -> &[f64] {
        &self.plans[stream].weight
    }

    /// Visits the heat (J) of every cell: a share of the heat to its station's wall, corrected by the cell's own temperature.
    pub fn heats(&self, wall: &dyn Fn(usize) -> f64, passed: &[WaterPassage], mut visit: impl FnMut(usize, f64)) {
        for ((stream, passed), plan) in self.network.streams.iter().zip(passed).zip(&self.plans) {
            for ((station, heat), weight) in stream.stations.iter().zip(&passed.heat).zip(&plan.weight) {
                let mean: f64 = station.cells.iter().map(|(n, w)| w * wall(*n)).sum();
                for (cell, share) in &station.cells {
                    visit(*cell, share * (heat + weight * (mean - wall(*cell))));
                }
            }
        }
    }

    /// Moves the water to where it has come, and sets the water nodes to the ends of their stations.
    pub fn moved(&self, passed: &[WaterPassage], temperatures: &mut [f64]) -> Water {
        let mut found = Water::default();
        // Enthalpy counts from one temperature near all others, so that little cancels.
        let zero = self.inflows.iter().flatten().next().map_or(300.0, |s| s.first);
        let heat = |flow: &Inflows| flow.iter().map(|s| s.share * (s.mean() - zero)).sum::<f64>();
        for (s, (stream, plan)) in self.network.streams.iter().zip(&self.plans).enumerate() {
            let (passage, marks) = (&self.passages[s], &passed[s].marks);
            let parcels = plan.parcels(passage, marks);
            let ends = passage.at_ends(&parcels, plan.outlet(marks));
            let first = stream.first_node as usize;
            temperatures[first..first + ends.len()].copy_from_slice(&ends);
            // Every stream counts on its own: water that it gives to another leaves here and enters there.
            let entering = heat(&self.entering(stream.circuit, s, |above| &passed[above].outflow));
            found.brought += passage.moved() * (entering - heat(&plan.outflow(marks)));
            let content = |parcels: &Parcels| passage.volumetric * parcels.iter().map(|p| p.volume * (p.mean() - zero)).sum::<f64>();
            found.stored += content(&parcels) - content(&self.parcels[s]);
            found.dissipated += plan.dissipated;
            found.parcels.push(parcels);
        }
        found
    }

    /// Inflow of a stream: the inflow of its circuit, or the mixed outflow of the streams upstream.
    fn entering<'f>(&self, circuit: usize, s: usize, outflow: impl Fn(usize) -> &'f Inflows) -> Inflows {
        let upstream = &self.network.streams[s].upstream;
        if upstream.is_empty() {
            return self.inflows[circuit].clone();
        }
        let flows: Vec<(&Inflows, f64)> = upstream.iter().zip(&self.mixtures[s]).map(|(u, w)| (outflow(*u), *w)).collect();
        mixed(&flows)
    }
}

/// Inflow of each circuit over a stage: the inlet temperature runs straight from its value at the beginning.
pub fn inflows(begin: &Load, end: &Load) -> Vec<Inflows> {
    let of_circuit = |(first, last): (&f64, &f64)| vec![Inflow { share: 1.0, first: *first, last: *last }];
    begin.inlets.iter().zip(&end.inlets).map(of_circuit).collect()
}

/// Time that water takes through all streams one after another, s, an upper bound of its stay; infinite if any water is at rest.
///
/// # Errors
/// Errors of [`Network::stream_states`].
pub fn residence(network: &Network, load: &Load, temperatures: &[f64], water: &[Parcels]) -> Result<f64> {
    let states = network.stream_states(load, temperatures)?;
    let volume = |parcels: &Parcels| parcels.iter().map(|parcel| parcel.volume).sum::<f64>();
    Ok(water.iter().zip(&states).map(|(parcels, state)| volume(parcels) / state.flow).sum())
}
