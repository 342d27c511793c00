//! dR/dp at fixed temperatures, by differences of the residual, and other direct dependences on p.

use crate::study::{MachineParameter, Study};
use coldplate_base::error::{Kind, Result};
use coldplate_describe::machine::Machine;
use coldplate_network::Network;

/// Relative deviation of the differences over one and over two steps above which they show a kink, dimensionless. Chosen: kinks against
/// rounding.
pub const UNEVEN: f64 = 1e-2;

/// Direct derivatives with respect to a parameter, per SI unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Partial {
    /// Residual of every node at fixed temperatures, W; nodes that are held move along.
    pub residual: Vec<f64>,
    /// Reading of every sensor at fixed temperatures, K.
    pub readings: Vec<f64>,
    /// Temperature of the nodes that are held, in the network's order, K.
    pub held: Vec<f64>,
    /// The parameter as a variable of the machine (its index) that a limit takes a rise over.
    pub limited: Option<usize>,
    /// Relative deviation between the differences over one and over two steps: below [`UNEVEN`] where the residual is smooth.
    pub uneven: f64,
}

impl Partial {
    /// Whether nothing depends on the parameter here.
    pub fn is_idle(&self) -> bool {
        let mut all = self.residual.iter().chain(&self.readings).chain(&self.held);
        all.all(|d| *d == 0.0) && self.limited.is_none()
    }

    pub(super) fn from_flat(mut flat: Vec<f64>, nodes: usize, sensors: usize, limited: Option<usize>, uneven: f64) -> Self {
        let held = flat.split_off(nodes + sensors);
        let readings = flat.split_off(nodes);
        Self { residual: flat, readings, held, limited, uneven }
    }
}

/// Machines, and networks if they differ, on either side of a parameter's value: built once, used at every condition.
#[derive(Debug, Clone)]
pub struct Variation {
    /// The parameter.
    pub parameter: MachineParameter,
    /// Places in steps, each with its machine and network; empty for a condition variable.
    pub(super) samples: Vec<(f64, Machine, Option<Network>)>,
}

/// Places of a central difference, in steps: four points, exact for polynomials of degree four.
pub(super) const CENTRAL: [f64; 4] = [-2.0, -1.0, 1.0, 2.0];
/// Places of a one-sided difference, in steps: four points, exact for polynomials of degree three.
pub(super) const ONE_SIDED: [f64; 4] = [0.0, 1.0, 2.0, 3.0];

impl Study {
    /// Builds the machines and networks that derivatives with respect to a parameter need.
    ///
    /// # Errors
    /// The machine is not valid on either side of the parameter's value, or has other unknowns there.
    pub fn variation(&self, parameter: &MachineParameter) -> Result<Variation> {
        let parameter = parameter.clone();
        if parameter.variable().is_some() {
            return Ok(Variation { parameter, samples: Vec::new() });
        }
        let (value, step) = (parameter.value, parameter.step(parameter.value));
        let build = |side: f64, places: [f64; 4]| -> Result<Vec<(f64, Machine, Option<Network>)>> {
            let one = |place: &f64| self.changed(&parameter, value + side * place * step).map(|(m, n)| (side * place, m, n));
            places.iter().map(one).collect()
        };
        let central = if parameter.is_at_edge(value) { None } else { Some(build(1.0, CENTRAL)) };
        let samples = match central {
            Some(Ok(samples)) => Ok(samples),
            Some(Err(e)) if e.kind() != Kind::Input => Err(e),
            // At the end of its range only one side exists.
            Some(Err(first)) => build(1.0, ONE_SIDED).or_else(|_| build(-1.0, ONE_SIDED)).map_err(|_| first),
            None => build(1.0, ONE_SIDED).or_else(|_| build(-1.0, ONE_SIDED)),
        };
        let samples = samples.map_err(|e| e.at_key(&parameter.name))?;
        Ok(Variation { parameter, samples })
    }
}
