//! dR/dp at fixed temperatures, by differences of the residual, and what else depends on p directly.

use super::parameter::Parameter;
use super::point::Derivatives;
use super::study::Study;
use crate::describe::machine::{Condition, Machine};
use crate::discretise::network::{Load, Network};
use crate::error::{Error, Kind, Result};

/// Differences over one and over two steps that deviate by more than this, relatively, speak of a kink.
pub const UNEVEN: f64 = 1e-2;

/// What depends on a parameter directly, per SI unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Partial {
    /// Residual of every node at fixed temperatures, W; nodes that are held move along.
    pub residual: Vec<f64>,
    /// Reading of every sensor at fixed temperatures, K.
    pub readings: Vec<f64>,
    /// Temperature of the nodes that are held, in the network's order, K.
    pub held: Vec<f64>,
    /// Chamber temperature, K.
    pub chamber: f64,
    /// Relative deviation between the differences over one and over two steps: below [`UNEVEN`] where the residual is smooth.
    pub uneven: f64,
}

impl Partial {
    /// Whether nothing depends on the parameter here.
    pub fn is_idle(&self) -> bool {
        let all = self.residual.iter().chain(&self.readings).chain(&self.held).chain([&self.chamber]);
        all.into_iter().all(|d| *d == 0.0)
    }

    fn from_flat(mut flat: Vec<f64>, nodes: usize, sensors: usize, uneven: f64) -> Self {
        let chamber = flat.pop().unwrap_or(0.0);
        let held = flat.split_off(nodes + sensors);
        let readings = flat.split_off(nodes);
        Self { residual: flat, readings, held, chamber, uneven }
    }
}

/// The machines, and networks where they are others, on either side of a parameter's value: built once, used at every
/// condition.
#[derive(Debug, Clone)]
pub struct Variation {
    /// The parameter.
    pub parameter: Parameter,
    /// Places in steps, each with what is there; empty for a condition variable.
    samples: Vec<(f64, Machine, Option<Network>)>,
}

/// Places of a central and of a one-sided difference, in steps.
const CENTRAL: [f64; 4] = [-2.0, -1.0, 1.0, 2.0];
const ONE_SIDED: [f64; 4] = [0.0, 1.0, 2.0, 3.0];

impl Study {
    /// Builds what the derivatives with respect to a parameter need.
    ///
    /// # Errors
    /// The machine is not valid on either side of the parameter's value, or has other unknowns there.
    pub fn variation(&self, parameter: &Parameter) -> Result<Variation> {
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

impl Derivatives<'_> {
    /// dR/dp and its companions for one parameter.
    ///
    /// # Errors
    /// As [`Study::variation`] and [`Derivatives::partial_of`].
    pub fn partial(&self, parameter: &Parameter) -> Result<Partial> {
        self.partial_of(&self.study.variation(parameter)?)
    }

    /// As [`Derivatives::partial`], with what was built before (for this study).
    ///
    /// # Errors
    /// A formula or the water's properties fail on either side of the parameter's value.
    pub fn partial_of(&self, variation: &Variation) -> Result<Partial> {
        let parameter = &variation.parameter;
        let value = self.value_of(parameter);
        let step = parameter.step(value);
        let (places, samples): (Vec<f64>, Vec<Vec<f64>>) = match parameter.variable() {
            Some(variable) => {
                let places = if parameter.is_at_edge(value) { ONE_SIDED } else { CENTRAL };
                let at = |place: &f64| {
                    let mut si = self.condition.si().to_vec();
                    si[variable] = value + place * step;
                    self.sample(&self.study.model.machine, None, &Condition::from_si(si))
                };
                (places.to_vec(), places.iter().map(at).collect::<Result<_>>().map_err(|e| e.at_key(&parameter.name))?)
            }
            None => {
                let at = |(_, machine, network): &(f64, Machine, Option<Network>)| self.sample(machine, network.as_ref(), &self.condition);
                let samples = variation.samples.iter().map(at).collect::<Result<_>>().map_err(|e| e.at_key(&parameter.name))?;
                (variation.samples.iter().map(|s| s.0).collect(), samples)
            }
        };
        let [f0, f1, f2, f3] = samples.as_slice() else {
            return Err(Error::numerics("a difference needs four samples"));
        };
        let (near, far, best);
        if places[0] != 0.0 {
            near = zip(f2, f1, |a, b| (a - b) / (2.0 * step));
            far = zip(f3, f0, |a, b| (a - b) / (4.0 * step));
            best = zip(&near, &far, |n, f| (4.0 * n - f) / 3.0);
        } else {
            // Differences first: what does not change must come out as zero.
            let [d1, d2, d3] = [f1, f2, f3].map(|f| zip(f, f0, |f, f0| f - f0));
            let h = places[1] * step;
            near = zip(&d1, &d2, |d1, d2| (4.0 * d1 - d2) / (2.0 * h));
            best = (0..f0.len()).map(|i| (18.0 * d1[i] - 9.0 * d2[i] + 2.0 * d3[i]) / (6.0 * h)).collect::<Vec<f64>>();
            far = best.clone();
        }
        let (nodes, sensors) = (self.study.model.network.nodes, self.study.model.network.sensors.len());
        let uneven = self.uneven(&near[..nodes], &far[..nodes], step);
        Ok(Partial::from_flat(best, nodes, sensors, uneven))
    }

    /// Residual, readings, held temperatures and chamber temperature in one vector, at this state's temperatures.
    fn sample(&self, machine: &Machine, network: Option<&Network>, condition: &Condition) -> Result<Vec<f64>> {
        let network = network.unwrap_or(&self.study.model.network);
        let load = Load::at(machine, condition)?;
        let mut temperatures = self.state.solution.temperatures.clone();
        let held: Vec<f64> = network.fixed.iter().map(|(_, index)| load.fixed[*index as usize]).collect();
        network.fixed.iter().zip(&held).for_each(|((node, _), t)| temperatures[*node as usize] = *t);
        let mut flat = self.tangent.residual(network, &load, &temperatures)?;
        flat.extend(network.sensors.iter().map(|sensor| sensor.read(&temperatures, &load)));
        flat.extend(held);
        flat.push(load.chamber);
        Ok(flat)
    }

    /// Relative deviation of two differences of the residual beyond its rounding.
    fn uneven(&self, near: &[f64], far: &[f64], step: f64) -> f64 {
        let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|x| x * x).sum::<f64>().sqrt();
        let temperatures = &self.state.solution.temperatures;
        let noise = 4.0 * f64::EPSILON / step * norm(&mut self.tangent.diagonal().iter().zip(temperatures).map(|(d, t)| d * t));
        let apart = norm(&mut near.iter().zip(far).map(|(n, f)| n - f));
        let size = norm(&mut near.iter().copied());
        if apart <= noise { 0.0 } else { (apart - noise) / size }
    }
}

fn zip(a: &[f64], b: &[f64], f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| f(*a, *b)).collect()
}
