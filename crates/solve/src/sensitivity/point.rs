//! One steady state with its exact derivative: fields, adjoints, and tables of both.

use rayon::prelude::*;

use super::difference::{CENTRAL, ONE_SIDED, Partial, Variation};
use super::screen::Screen;
use crate::balance::balance;
use crate::meshed::SteadyState;
use crate::study::{MachineParameter, ParameterKind, Study};
use crate::{Solution, Tangent};
use coldplate_base::document::suggestion;
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::{Condition, LimitKind, Machine};
use coldplate_network::{Load, Network};

/// Quantity that is differentiated. Indices are those of the network's sensors and streams and of the machine's limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DerivativeTarget {
    /// The reading of a sensor.
    Sensor(usize),
    /// The temperature of the water leaving a channel.
    Outlet(usize),
    /// The value that a limit looks at (not its maximum).
    Limit(usize),
}

/// A target as weights of sensors, nodes and the machine's variables.
#[derive(Debug, Clone, Default)]
struct Terms {
    sensors: Vec<(usize, f64)>,
    nodes: Vec<(u32, f64)>,
    variables: Vec<(usize, f64)>,
}

/// The adjoint field of a target.
#[derive(Debug, Clone)]
pub struct Adjoint {
    terms: Terms,
    /// Rise of the target per watt put into each node, K/W (water nodes likewise; zero where held).
    pub field: Vec<f64>,
}

/// A table of derivatives.
#[derive(Debug, Clone)]
pub struct DerivativeTable {
    /// Derivative of each target (row) with respect to each parameter (column), K per SI unit.
    pub slopes: Vec<Vec<f64>>,
    /// Parameters nothing depends on here.
    pub idle: Vec<bool>,
    /// How uneven each parameter's differences were; see [`Partial::uneven`].
    pub uneven: Vec<f64>,
}

/// A steady state and the derivatives there.
#[derive(Debug, Clone)]
pub struct Derivatives<'a> {
    /// The machine and its model.
    pub study: &'a Study,
    /// The condition.
    pub condition: Condition,
    /// The state.
    pub state: SteadyState,
    /// The exact derivative of the residual.
    pub tangent: Tangent<'a>,
}

impl<'a> Derivatives<'a> {
    /// Takes the derivatives at a solved state. One more exact Newton step brings it to rounding first.
    ///
    /// # Errors
    /// The machine has a controller; errors of [`Tangent::new`] and [`Tangent::solve`].
    pub fn new(study: &'a Study, condition: &Condition, state: &SteadyState) -> Result<Self> {
        study.model.machine.without_controllers("a derivative")?;
        let network = &study.model.network;
        let mut state = state.clone();
        let tangent = Tangent::new(network, &state.load, &state.solution.temperatures)?;
        tangent.correct(&state.load, &mut state.solution.temperatures)?;
        state.solution.streams = network.stream_states(&state.load, &state.solution.temperatures)?;
        Ok(Self { study, condition: condition.clone(), state, tangent })
    }

    /// Derivatives at temperatures (K, of every node) that need not be in balance, as at an instant of a history.
    ///
    /// # Errors
    /// The machine has a controller; errors of [`Tangent::new`].
    pub fn at(study: &'a Study, condition: &Condition, temperatures: &[f64]) -> Result<Self> {
        study.model.machine.without_controllers("a derivative")?;
        let network = &study.model.network;
        let load = Load::at(&study.model.machine, condition)?;
        let tangent = Tangent::new(network, &load, temperatures)?;
        let streams = tangent.streams().to_vec();
        let solution = Solution {
            balance: balance(network, &load, &streams, temperatures),
            temperatures: temperatures.to_vec(),
            streams,
            shares: Vec::new(),
            newton_iterations: 0,
            krylov_iterations: 0,
            assemble_seconds: 0.0,
            solve_seconds: 0.0,
        };
        Ok(Self { study, condition: condition.clone(), state: SteadyState { load, solution }, tangent })
    }

    /// The value a parameter has here, SI.
    pub fn value_of(&self, parameter: &MachineParameter) -> f64 {
        match parameter.variable() {
            Some(variable) if parameter.kind == ParameterKind::Condition => self.condition.si()[variable],
            _ => parameter.value,
        }
    }

    /// Derivative of every node's temperature along a parameter, K per SI unit.
    ///
    /// # Errors
    /// Errors of [`Tangent::solve`].
    pub fn field(&self, partial: &Partial) -> Result<Vec<f64>> {
        let right: Vec<f64> = partial.residual.iter().map(|r| -r).collect();
        let mut field = self.tangent.solve(&right)?;
        for ((node, _), slope) in self.study.model.network.fixed.iter().zip(&partial.held) {
            field[*node as usize] = *slope;
        }
        Ok(field)
    }

    /// Derivative of a target from a parameter's field, K per SI unit.
    pub fn along(&self, target: DerivativeTarget, partial: &Partial, field: &[f64]) -> f64 {
        let terms = self.terms(target);
        // The change of held nodes is in the direct part already.
        let held = |node: u32| self.study.model.network.fixed.iter().any(|(n, _)| *n == node) && !terms.sensors.is_empty();
        let nodes: f64 = terms.nodes.iter().filter(|(n, _)| !held(*n)).map(|(n, w)| w * field[*n as usize]).sum();
        nodes + direct(&terms, partial)
    }

    /// The adjoint field of a target.
    ///
    /// # Errors
    /// Errors of [`Tangent::solve_transposed`].
    pub fn adjoint(&self, target: DerivativeTarget) -> Result<Adjoint> {
        self.adjoint_by(target, |right| self.tangent.solve_transposed(right))
    }

    /// The adjoint field of a target to a relative residual `aim`, for a comparison of causes that needs no more.
    ///
    /// # Errors
    /// Errors of [`Tangent::solve_transposed`].
    pub fn adjoint_within(&self, target: DerivativeTarget, aim: f64) -> Result<Adjoint> {
        self.adjoint_by(target, |right| self.tangent.solve_transposed_within(right, aim))
    }

    fn adjoint_by(&self, target: DerivativeTarget, solve: impl Fn(&[f64]) -> Result<Vec<f64>>) -> Result<Adjoint> {
        let terms = self.terms(target);
        let network = &self.study.model.network;
        let mut right = vec![0.0; network.nodes];
        terms.nodes.iter().for_each(|(node, w)| right[*node as usize] += w);
        network.fixed.iter().for_each(|(node, _)| right[*node as usize] = 0.0);
        Ok(Adjoint { terms, field: solve(&right)? })
    }

    /// Derivative of an adjoint's target with respect to a parameter, K per SI unit: one scalar product.
    pub fn against(&self, adjoint: &Adjoint, partial: &Partial) -> f64 {
        let inner: f64 = adjoint.field.iter().zip(&partial.residual).map(|(l, r)| l * r).sum();
        direct(&adjoint.terms, partial) - inner
    }

    /// Derivatives of several targets with respect to several parameters, by whichever of the two ways needs fewer solves.
    ///
    /// # Errors
    /// Errors of [`Derivatives::partial`], [`Tangent::solve`] and [`Tangent::solve_transposed`].
    pub fn jacobian(&self, targets: &[DerivativeTarget], parameters: &[MachineParameter]) -> Result<DerivativeTable> {
        let variations: Vec<Variation> = parameters.par_iter().map(|p| self.study.variation(p)).collect::<Result<_>>()?;
        self.jacobian_of(targets, &variations)
    }

    /// Derivatives of several targets with variations built before (for this study), which serve any number of conditions.
    ///
    /// # Errors
    /// Errors of [`Derivatives::partial_of`], [`Tangent::solve`] and [`Tangent::solve_transposed`].
    pub fn jacobian_of(&self, targets: &[DerivativeTarget], variations: &[Variation]) -> Result<DerivativeTable> {
        let is_adjoint = targets.len() <= variations.len();
        let adjoints: Vec<Adjoint> =
            if is_adjoint { targets.par_iter().map(|t| self.adjoint(*t)).collect::<Result<_>>()? } else { Vec::new() };
        let column = |variation: &Variation| -> Result<(Vec<f64>, bool, f64)> {
            let partial = self.partial_of(variation)?;
            let slopes = if is_adjoint {
                adjoints.iter().map(|adjoint| self.against(adjoint, &partial)).collect()
            } else {
                let field = self.field(&partial)?;
                targets.iter().map(|target| self.along(*target, &partial, &field)).collect()
            };
            Ok((slopes, partial.is_idle(), partial.uneven))
        };
        let columns: Vec<(Vec<f64>, bool, f64)> = variations.par_iter().map(column).collect::<Result<_>>()?;
        Ok(DerivativeTable {
            slopes: (0..targets.len()).map(|t| columns.iter().map(|c| c.0[t]).collect()).collect(),
            idle: columns.iter().map(|c| c.1).collect(),
            uneven: columns.iter().map(|c| c.2).collect(),
        })
    }

    /// Derivatives with respect to candidates that are no parameter of the file.
    pub fn screen(&self) -> Screen<'_> {
        Screen::new(&self.study.model.network, &self.state.load, &self.state.solution)
    }

    /// A sensor, limit or channel (its outlet) by its name, in this order.
    ///
    /// # Errors
    /// No such name.
    pub fn target(&self, name: &str) -> Result<DerivativeTarget> {
        let (network, machine) = (&self.study.model.network, &self.study.model.machine);
        let sensor = network.sensor_names.iter().position(|n| n == name).map(DerivativeTarget::Sensor);
        let limit = machine.limits.iter().position(|l| l.name == name).map(DerivativeTarget::Limit);
        let outlet = network.streams.iter().position(|s| s.name == name).map(DerivativeTarget::Outlet);
        sensor.or(limit).or(outlet).ok_or_else(|| {
            let known: Vec<&str> = network.sensor_names.iter().map(String::as_str).collect();
            Error::input(format!("there is no sensor, limit or channel '{name}'"))
                .at_key("sensor")
                .read(name)
                .help(suggestion(name, &known))
        })
    }

    fn terms(&self, target: DerivativeTarget) -> Terms {
        let network = &self.study.model.network;
        let mut terms = Terms::default();
        let mut add = |sensor: usize, weight: f64| {
            terms.sensors.push((sensor, weight));
            terms.nodes.extend(network.sensors[sensor].weights.iter().map(|(n, w)| (*n, w * weight)));
        };
        match target {
            DerivativeTarget::Sensor(s) => add(s, 1.0),
            DerivativeTarget::Outlet(s) => terms.nodes.push((network.streams[s].outlet(), 1.0)),
            DerivativeTarget::Limit(l) => match &self.study.model.machine.limits[l].kind {
                LimitKind::Maximum { point } => add(*point, 1.0),
                LimitKind::Rise { point, variable } => {
                    add(*point, 1.0);
                    terms.variables.push((*variable, -1.0));
                }
                LimitKind::Difference { first, second } => {
                    add(*first, 1.0);
                    add(*second, -1.0);
                }
                LimitKind::Spread(several) => {
                    let readings = self.study.model.read(&self.state);
                    let order = |a: &&usize, b: &&usize| readings[**a].total_cmp(&readings[**b]);
                    if let (Some(high), Some(low)) = (several.iter().max_by(order), several.iter().min_by(order)) {
                        add(*high, 1.0);
                        add(*low, -1.0);
                    }
                }
            },
        }
        terms
    }
}

impl Study {
    /// Every sensor.
    pub fn sensors(&self) -> Vec<DerivativeTarget> {
        (0..self.model.network.sensors.len()).map(DerivativeTarget::Sensor).collect()
    }

    /// Solves one condition and takes the derivatives there.
    ///
    /// # Errors
    /// Errors of [`solve`](crate::meshed::MeshedMachine::solve) and [`Derivatives::new`].
    pub fn at(&self, condition: &Condition) -> Result<Derivatives<'_>> {
        self.model.machine.without_controllers("a derivative")?;
        let state = self.model.solve(&self.model.solver(condition)?, condition)?;
        Derivatives::new(self, condition, &state)
    }
}

impl Derivatives<'_> {
    /// dR/dp and its companions for one parameter.
    ///
    /// # Errors
    /// Errors of [`Study::variation`] and [`Derivatives::partial_of`].
    pub fn partial(&self, parameter: &MachineParameter) -> Result<Partial> {
        self.partial_of(&self.study.variation(parameter)?)
    }

    /// dR/dp and its companions from a variation built before (for this study).
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
            // Differences first: an unchanged value must come out as zero.
            let [d1, d2, d3] = [f1, f2, f3].map(|f| zip(f, f0, |f, f0| f - f0));
            let h = places[1] * step;
            near = zip(&d1, &d2, |d1, d2| (4.0 * d1 - d2) / (2.0 * h));
            best = (0..f0.len()).map(|i| (18.0 * d1[i] - 9.0 * d2[i] + 2.0 * d3[i]) / (6.0 * h)).collect::<Vec<f64>>();
            far = best.clone();
        }
        let (nodes, sensors) = (self.study.model.network.nodes, self.study.model.network.sensors.len());
        let uneven = self.uneven(&near[..nodes], &far[..nodes], step);
        let limited = parameter.variable().filter(|v| self.study.model.machine.limits.iter().any(|l| l.kind.variable() == Some(*v)));
        Ok(Partial::from_flat(best, nodes, sensors, limited, uneven))
    }

    /// Residual, readings and held temperatures in one vector, at this state's temperatures.
    fn sample(&self, machine: &Machine, network: Option<&Network>, condition: &Condition) -> Result<Vec<f64>> {
        let network = network.unwrap_or(&self.study.model.network);
        let load = Load::at(machine, condition)?;
        let mut temperatures = self.state.solution.temperatures.clone();
        let held: Vec<f64> = network.fixed.iter().map(|(_, index)| load.fixed[*index as usize]).collect();
        network.fixed.iter().zip(&held).for_each(|((node, _), t)| temperatures[*node as usize] = *t);
        let mut flat = self.tangent.residual(network, &load, &temperatures)?;
        flat.extend(network.sensors.iter().map(|sensor| sensor.read(&temperatures, &load)));
        flat.extend(held);
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

/// The part of a target's derivative that does not go through the temperatures of free nodes.
fn direct(terms: &Terms, partial: &Partial) -> f64 {
    let sensors: f64 = terms.sensors.iter().map(|(s, w)| w * partial.readings[*s]).sum();
    let variables: f64 = terms.variables.iter().filter(|(v, _)| partial.limited == Some(*v)).map(|(_, w)| w).sum();
    sensors + variables
}

fn zip(a: &[f64], b: &[f64], f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| f(*a, *b)).collect()
}
