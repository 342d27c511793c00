//! How the flow of a circuit splits among parallel branches: as given, and the rest so that pressure drops agree.

use super::{Load, Network};
use crate::describe::machine::{Branch, BranchFlow, Layout};
use crate::error::{Error, Result};
use crate::physics::channel;
use crate::physics::water::LiquidProperties;

/// The flow of a branch that is given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Given {
    channel: usize,
    amount: Amount,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Amount {
    /// Of what flows into the group of branches.
    Share(f64),
    /// kg/s
    Mass(f64),
}

/// The flows of branches that are given, with the density (kg/m³) at the circuit's inlet.
///
/// # Errors
/// A formula has no finite value at this condition, or a negative one.
pub(super) fn given_flows(branches: &[Branch], load: &Load, density: f64) -> Result<Vec<Given>> {
    let of = |branch: &Branch| {
        let amount = match &branch.flow {
            BranchFlow::Share(share) => Amount::Share(share.evaluate(&load.names)?),
            BranchFlow::Flow(flow) => Amount::Mass(density * flow.evaluate(&load.names)?),
        };
        let (Amount::Share(number) | Amount::Mass(number)) = amount;
        if number < 0.0 {
            return Err(Error::input("the flow given to a branch is negative at this condition").read(number));
        }
        Ok(Given { channel: branch.channel, amount })
    };
    branches.iter().map(of).collect()
}

/// A circuit's branches at one condition.
pub(super) struct Split<'a> {
    pub(super) network: &'a Network,
    pub(super) given: &'a [Given],
    /// Liquid in each stream of the circuit.
    pub(super) liquids: &'a [Option<LiquidProperties>],
}

impl Split<'_> {
    /// Fills in the mass flow (kg/s) of every stream below `layout`.
    ///
    /// # Errors
    /// Branches are given more than there is, or the split does not converge.
    pub(super) fn distribute(&self, layout: &Layout, mass_flow: f64, flows: &mut [f64]) -> Result<()> {
        match layout {
            Layout::Channel(s) => flows[*s] = mass_flow,
            Layout::Series(items) => {
                for item in items {
                    self.distribute(item, mass_flow, flows)?;
                }
            }
            Layout::Parallel(items) => {
                for (item, m) in items.iter().zip(self.among(items, mass_flow)?) {
                    self.distribute(item, m, flows)?;
                }
            }
        }
        Ok(())
    }

    /// The mass flow (kg/s) of each of parallel branches.
    fn among(&self, items: &[Layout], mass_flow: f64) -> Result<Vec<f64>> {
        let given = |item: &Layout| {
            let own = self.given.iter().find(|given| item.has_directly(given.channel))?;
            Some(match own.amount {
                Amount::Share(share) => share * mass_flow,
                Amount::Mass(mass) => mass,
            })
        };
        let mut flows: Vec<Option<f64>> = items.iter().map(given).collect();
        let taken: f64 = flows.iter().flatten().sum();
        if taken > mass_flow * (1.0 + 1e-12) {
            return Err(Error::input("branches are given more than flows in")
                .read(format!("{taken:.6} kg/s of {mass_flow:.6} kg/s"))
                .help("lower what is given under 'branches', or raise the circuit's flow"));
        }
        let rest = if taken > 0.0 { (mass_flow - taken).max(0.0) } else { mass_flow };
        let free = items.iter().zip(&flows).filter(|(_, flow)| flow.is_none());
        let drops: Vec<_> = free.map(|(item, _)| move |m: f64| self.pressure_drop(item, m)).collect();
        let found = channel::split_flow(rest, &drops)?;
        flows.iter_mut().filter(|flow| flow.is_none()).zip(found).for_each(|(flow, m)| *flow = Some(m));
        Ok(flows.into_iter().flatten().collect())
    }

    /// Pressure drop (Pa) over `layout` at a mass flow (kg/s): of branches the largest of those whose flow is not given, since
    /// whatever gives the others theirs makes up for the difference.
    fn pressure_drop(&self, layout: &Layout, mass_flow: f64) -> f64 {
        match layout {
            Layout::Channel(s) => self.liquids[*s].map_or(0.0, |liquid| self.network.streams[*s].pressure_drop(mass_flow, liquid)),
            Layout::Series(items) => items.iter().map(|item| self.pressure_drop(item, mass_flow)).sum(),
            Layout::Parallel(items) => match self.among(items, mass_flow) {
                Ok(flows) => {
                    let is_free = |item: &Layout| !self.given.iter().any(|given| item.has_directly(given.channel));
                    let free = items.iter().zip(flows).filter(|(item, _)| is_free(item));
                    free.map(|(item, m)| self.pressure_drop(item, m)).fold(0.0, f64::max)
                }
                Err(_) => f64::NAN,
            },
        }
    }
}
