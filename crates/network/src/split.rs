//! How the flow of a circuit splits among parallel branches: as given, and the rest so that pressure drops agree.

use super::Network;
use coldplate_base::error::{Error, Result};
use coldplate_base::formula::FormulaValues;
use coldplate_describe::machine::{Branch, BranchFlow, Circuit, Layout};
use coldplate_physics::channel;
use coldplate_physics::water::LiquidProperties;

/// A branch whose flow is given, at one condition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GivenBranch {
    /// A channel of the branch outside any further branching.
    pub channel: usize,
    /// Flow of the branch.
    pub flow: GivenFlow,
}

/// The flow that a branch is given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GivenFlow {
    /// Share of the flow into its group of branches.
    Share(f64),
    /// Volume flow, m³/s, at the circuit's inlet conditions.
    Volume(f64),
}

/// The given branches of a circuit where formulas have these values.
///
/// # Errors
/// A formula has no finite value, or a negative one.
pub(super) fn given_branches(circuit: &Circuit, values: &FormulaValues) -> Result<Vec<GivenBranch>> {
    let of = |branch: &Branch| {
        let flow = match &branch.flow {
            BranchFlow::Share(share) => GivenFlow::Share(share.evaluate(values)?),
            BranchFlow::Flow(flow) => GivenFlow::Volume(flow.evaluate(values)?),
        };
        let (GivenFlow::Share(number) | GivenFlow::Volume(number)) = flow;
        if number < 0.0 {
            let what = format!("the flow given to a branch of the circuit '{}' is negative at this condition", circuit.name);
            return Err(Error::input(what).read(number));
        }
        Ok(GivenBranch { channel: branch.channel, flow })
    };
    circuit.branches.iter().map(of).collect()
}

/// A circuit's branches at one condition.
pub(super) struct Split<'a> {
    pub(super) network: &'a Network,
    pub(super) given: &'a [GivenBranch],
    /// Density at the circuit's inlet, kg/m³.
    pub(super) density: f64,
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
            Some(match own.flow {
                GivenFlow::Share(share) => share * mass_flow,
                GivenFlow::Volume(flow) => flow * self.density,
            })
        };
        let mut flows: Vec<Option<f64>> = items.iter().map(given).collect();
        let taken: f64 = flows.iter().flatten().sum();
        if taken > mass_flow * (1.0 + 1e-12) {
            return Err(Error::input("branches are given more than flows in")
                .read(format!("{taken:.6} kg/s of {mass_flow:.6} kg/s"))
                .help("lower the flows given under 'branches', or raise the circuit's flow"));
        }
        let rest = if taken > 0.0 { (mass_flow - taken).max(0.0) } else { mass_flow };
        let free = items.iter().zip(&flows).filter(|(_, flow)| flow.is_none());
        let drops: Vec<_> = free.map(|(item, _)| move |m: f64| self.pressure_drop(item, m)).collect();
        let found = channel::split_flow(rest, &drops)?;
        flows.iter_mut().filter(|flow| flow.is_none()).zip(found).for_each(|(flow, m)| *flow = Some(m));
        Ok(flows.into_iter().flatten().collect())
    }

    /// Pressure drop (Pa) over `layout` at a mass flow (kg/s). Parallel branches have the largest drop of those whose flow is not
    /// given: whatever sets the given flows makes up for the difference.
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
