//! A condition, evaluated: every number of the network that changes from one condition to the next.

use super::split::given_branches;
use super::{ContactGroup, GivenBranch};
use coldplate_base::error::Result;
use coldplate_base::formula::FormulaValues;
use coldplate_describe::machine::{BoundaryLaw, Condition, Machine};
use coldplate_physics::convection::FreeConvection;
use coldplate_physics::gas;

/// All numbers that depend on the condition. SI, temperatures in kelvin.
#[derive(Debug, Clone, PartialEq)]
pub struct Load {
    /// Values of the machine's variables, SI, in the order of [`Machine::variables`].
    pub variables: Vec<f64>,
    /// Value of every name that formulas may use.
    pub names: FormulaValues,
    /// Chamber wall temperature, K.
    pub chamber: f64,
    /// Film of the residual gas, W/(m² K).
    pub gas: f64,
    /// State of each boundary of the machine.
    pub boundaries: Vec<BoundaryState>,
    /// Factor on the conductance of each contact of the machine.
    pub contacts: ContactFactors,
    /// Power of each source, W: the stated one times the share that its controller gives.
    pub powers: Vec<f64>,
    /// Stated power of each source, W, of which a controller gives a share.
    pub full_powers: Vec<f64>,
    /// Set point of each controller, K.
    pub set_points: Vec<f64>,
    /// Volume flow into each circuit, m³/s.
    pub flows: Vec<f64>,
    /// Inlet temperature of each circuit, K. For a circuit fed by others: the flow-weighted inlet temperature of those circuits, used
    /// only for fluid properties.
    pub inlets: Vec<f64>,
    /// Branches of each circuit whose flow is given.
    pub branches: Vec<Vec<GivenBranch>>,
    /// Temperatures at which nodes are held, K: those of the lumped nodes, of the chamber wall, of the boundaries
    /// (entries without a temperature are 0).
    pub fixed: Vec<f64>,
}

/// Factors on the conductances of a machine's contacts, in the machine's order; missing ones are 1, so that the default leaves every
/// contact as its law has it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ContactFactors(Vec<f64>);

impl ContactFactors {
    /// The factor on a contact of the network.
    pub fn of(&self, group: &ContactGroup) -> f64 {
        group.of.and_then(|contact| self.0.get(contact)).copied().unwrap_or(1.0)
    }

    /// Whether some contact is open.
    pub fn has_open(&self) -> bool {
        self.0.contains(&0.0)
    }
}

/// A boundary at one condition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BoundaryState {
    /// Surface temperature, K.
    Temperature(f64),
    /// Film coefficient W/(m² K) and fluid temperature K.
    Film(f64, f64),
    /// Flux into the machine, W/m².
    Flux(f64),
    /// Emissivity, and temperature of the surroundings that it sees, K.
    Radiation(f64, f64),
    /// Free convection to a gas at a temperature, K.
    FreeConvection(FreeConvection, f64),
}

impl Load {
    /// Evaluates every formula of `machine` at `condition`.
    ///
    /// # Errors
    /// A formula has no finite value there, or a flow, film or absolute temperature comes out negative.
    pub fn at(machine: &Machine, condition: &Condition) -> Result<Self> {
        let values = machine.values(condition)?;
        let positive = |value: f64, what: &str| {
            if value < 0.0 {
                return Err(coldplate_base::error::Error::input(format!("{what} is negative at this condition")).read(value));
            }
            Ok(value)
        };
        let chamber = positive(machine.chamber.temperature.evaluate(&values)?, "the chamber's absolute temperature")?;
        let mut boundaries = Vec::with_capacity(machine.boundaries.len());
        for boundary in &machine.boundaries {
            boundaries.push(match &boundary.law {
                BoundaryLaw::Temperature(t) => BoundaryState::Temperature(positive(t.evaluate(&values)?, "an absolute temperature")?),
                BoundaryLaw::Film(h, t) => BoundaryState::Film(
                    positive(h.evaluate(&values)?, "a film coefficient")?,
                    positive(t.evaluate(&values)?, "an absolute temperature")?,
                ),
                BoundaryLaw::Flux(q) => BoundaryState::Flux(q.evaluate(&values)?),
                BoundaryLaw::FreeConvection(law, t) => {
                    BoundaryState::FreeConvection(*law, positive(t.evaluate(&values)?, "an absolute temperature")?)
                }
                BoundaryLaw::Radiation(e, t) => BoundaryState::Radiation(*e, positive(t.evaluate(&values)?, "an absolute temperature")?),
            });
        }
        let contacts = machine
            .contacts
            .iter()
            .map(|c| {
                let factor = c.factor.evaluate(&values)?;
                if factor < 0.0 { positive(factor, &format!("the factor on the contact '{}'", c.name)) } else { Ok(factor) }
            })
            .collect::<Result<_>>()?;
        let contacts = ContactFactors(contacts);
        let powers: Vec<f64> =
            machine.sources.iter().map(|s| Ok(s.power.evaluate(&values)? * s.volume.unwrap_or(1.0))).collect::<Result<_>>()?;
        let set_point = |c: &coldplate_describe::machine::Controller| positive(c.set_point.evaluate(&values)?, "an absolute temperature");
        let set_points = machine.controllers.iter().map(set_point).collect::<Result<_>>()?;
        let supplies = machine.supplies(&values)?;
        let (flows, inlets) = supplies.into_iter().map(|supply| (supply.flow, supply.temperature)).unzip();
        let branches = machine.circuits.iter().map(|c| given_branches(c, &values)).collect::<Result<_>>()?;
        let mut fixed: Vec<f64> =
            machine.nodes.iter().map(|n| n.fixed.as_ref().map_or(Ok(0.0), |t| t.evaluate(&values))).collect::<Result<_>>()?;
        fixed.push(chamber);
        fixed.extend(boundaries.iter().map(|b| if let BoundaryState::Temperature(t) = b { *t } else { 0.0 }));
        let gas = gas::film(machine.chamber.pressure, chamber, machine.chamber.accommodation, machine.chamber.gap);
        Ok(Self {
            variables: condition.si().to_vec(),
            names: values,
            chamber,
            gas,
            boundaries,
            contacts,
            full_powers: powers.clone(),
            powers,
            set_points,
            flows,
            inlets,
            branches,
            fixed,
        })
    }

    /// The boundary that an entry of [`Load::fixed`] gives the temperature of, if it is one's.
    pub fn boundary_of(&self, fixed: u32) -> Option<usize> {
        (fixed as usize + self.boundaries.len()).checked_sub(self.fixed.len())
    }
}
