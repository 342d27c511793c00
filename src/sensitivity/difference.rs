//! dR/dp at fixed temperatures, by differences of the residual, and what else depends on p directly.

use super::parameter::Parameter;
use super::point::Derivatives;
use crate::error::{Error, Kind, Result};
use crate::machine::{Condition, Machine};
use crate::network::{Load, Network};

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

impl Derivatives<'_> {
    /// dR/dp and its companions for one parameter.
    ///
    /// # Errors
    /// The machine is not valid on either side of the parameter's value, or has other unknowns there.
    pub fn partial(&self, parameter: &Parameter) -> Result<Partial> {
        let machine = &self.study.model.machine;
        let value = self.value_of(parameter);
        let step = parameter.step(value);
        let sample = |offset: f64| -> Result<Vec<f64>> {
            let value = value + offset * step;
            if let Some(variable) = parameter.variable() {
                let mut si = self.condition.si().to_vec();
                si[variable] = value;
                return self.sample(machine, None, &Condition::from_si(si));
            }
            let (machine, network) = self.study.changed(parameter, value)?;
            self.sample(&machine, network.as_ref(), &self.condition)
        };
        let nodes = self.study.model.network.nodes;
        let finish = |near: Vec<f64>, far: Vec<f64>, best: Vec<f64>| {
            let uneven = self.uneven(&near[..nodes], &far[..nodes], step);
            Partial::from_flat(best, nodes, self.study.model.network.sensors.len(), uneven)
        };
        let placed = |error: Error| error.at_key(&parameter.name);
        if !parameter.is_at_edge(value) {
            match (sample(-2.0), sample(2.0)) {
                (Ok(b2), Ok(a2)) => {
                    let (b1, a1) = (sample(-1.0).map_err(placed)?, sample(1.0).map_err(placed)?);
                    let near = zip(&a1, &b1, |a, b| (a - b) / (2.0 * step));
                    let far = zip(&a2, &b2, |a, b| (a - b) / (4.0 * step));
                    let best = zip(&near, &far, |n, f| (4.0 * n - f) / 3.0);
                    return Ok(finish(near, far, best));
                }
                (Err(e), Err(_)) => return Err(placed(e)),
                (Err(e), _) | (_, Err(e)) if e.kind() != Kind::Input => return Err(placed(e)),
                _ => {}
            }
        }
        // At the end of its range only one side exists.
        let side = if sample(3.0).is_ok() { 1.0 } else { -1.0 };
        let f = [0.0, 1.0, 2.0, 3.0].map(|k| sample(side * k).map_err(placed));
        let [f0, f1, f2, f3] = f;
        let (f0, f1, f2, f3) = (f0?, f1?, f2?, f3?);
        let h = side * step;
        let near: Vec<f64> = (0..f0.len()).map(|i| (-3.0 * f0[i] + 4.0 * f1[i] - f2[i]) / (2.0 * h)).collect();
        let best: Vec<f64> = (0..f0.len()).map(|i| (-11.0 * f0[i] + 18.0 * f1[i] - 9.0 * f2[i] + 2.0 * f3[i]) / (6.0 * h)).collect();
        Ok(finish(near, best.clone(), best))
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
