//! Controllers of sources.

use super::{Load, Network};
use coldplate_describe::machine::{ControlLaw, Machine};

/// A controller with the sources of which it gives a share.
#[derive(Debug, Clone, PartialEq)]
pub struct ControlLoop {
    /// Name.
    pub name: String,
    /// The sensor that it reads.
    pub sensor: usize,
    /// The sources that follow it.
    pub sources: Vec<usize>,
    /// Whether the share grows when the sensor is too warm.
    pub cools: bool,
    /// How the share follows the sensor.
    pub law: ControlLaw,
}

impl ControlLoop {
    /// The controllers of a machine, in its order.
    pub(crate) fn of(machine: &Machine) -> Vec<Self> {
        let of = |(own, c): (usize, &coldplate_describe::machine::Controller)| {
            let sources = machine.sources.iter().enumerate().filter(|(_, source)| source.controller == Some(own)).map(|(at, _)| at);
            Self { name: c.name.clone(), sensor: c.sensor, sources: sources.collect(), cools: c.cools, law: c.law }
        };
        machine.controllers.iter().enumerate().map(of).collect()
    }

    /// 1 for a controller that heats, -1 for one that cools.
    pub fn sign(&self) -> f64 {
        if self.cools { -1.0 } else { 1.0 }
    }
}

impl Network {
    /// Deviation of the sensor of each controller that asks for more power, K: set point - reading, with the sign turned where it cools.
    pub fn deviations(&self, load: &Load, temperatures: &[f64]) -> Vec<f64> {
        let of = |(own, set_point): (&ControlLoop, &f64)| own.sign() * (set_point - self.sensors[own.sensor].read(temperatures, load));
        self.loops.iter().zip(&load.set_points).map(of).collect()
    }
}

impl Load {
    /// This load with shares of their power, one per controller, for the sources that controllers give a share of.
    #[must_use]
    pub fn with_shares(mut self, network: &Network, shares: &[f64]) -> Self {
        for (own, share) in network.loops.iter().zip(shares) {
            own.sources.iter().for_each(|source| self.powers[*source] = share * self.full_powers[*source]);
        }
        self
    }
}
