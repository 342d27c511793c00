//! What each hypothesis would do to every reading, to first order.
//!
//! In steady state one adjoint field per reading gives every source, leak and link at once: the signature of a
//! hypothesis is a scalar product. For logs, and for what acts on no node, it is the difference of two predictions.

use rayon::prelude::*;

use super::catalogue::{Act, DRIFT, Hypothesis, REFERENCE, Scales, UserKind};
use crate::error::Result;
use crate::identify::{self, Prediction, conditions, states};
use crate::measure::{Data, whiten};
use crate::network::Network;
use crate::reader::quoted;
use crate::sensitivity::{Adjoint, Derivatives, Effect, Screen, Study, Target};
use crate::simulate::Start;

/// Amplitudes of differences of logs, as a share of the prior's scale: what acts one way only, or moves a front, is followed
/// along a secant about as long as it is likely to be; the rest along a slope.
const SECANT: f64 = 0.5;
const STEP: f64 = 0.1;
/// Relative residual of adjoint fields: causes are compared, and what is named is fitted.
const ADJOINT: f64 = 1e-9;
/// Error allowed in each time step of a log, K, well below what every model leaves open.
pub const TIME_TOLERANCE: f64 = 0.01;
/// What changes no reading by more than this many of them, for an amplitude of the prior's scale, is the solver's own error.
const VISIBLE: f64 = 3.0;

/// The machine as it is beside the data, and the slope of every hypothesis.
#[derive(Debug, Clone)]
pub struct Signatures {
    /// Readings less predictions, K.
    pub residual: Vec<f64>,
    /// Predictions of the machine as it is, and their slopes with respect to uncertain parameters and conditions.
    pub prediction: Prediction,
    /// Temperatures of all nodes at each distinct condition, K; none of logs.
    pub fields: Vec<Vec<f64>>,
    /// One column per hypothesis, K per unit of its amplitude; zeros where it does nothing.
    pub columns: Vec<Vec<f64>>,
}

/// Computes them.
///
/// # Errors
/// The machine as it is cannot be solved at the data's conditions.
pub fn signatures(
    study: &Study,
    data: &Data,
    start: Start,
    uncertain: &[crate::sensitivity::Parameter],
    hypotheses: &[Hypothesis],
    scales: &Scales,
    user: &[UserKind],
) -> Result<Signatures> {
    let prediction = if data.is_transient() {
        identify::predict_within(study, data, uncertain, start, TIME_TOLERANCE)?
    } else {
        return steady(study, data, uncertain, hypotheses, scales, user);
    };
    let residual = difference(&whiten::readings(data), &prediction.values);
    let none = || vec![0.0; residual.len()];
    let along = |h: &Hypothesis, step: f64| -> Vec<f64> {
        let moved = match h.sets(study, scales, user, step) {
            Ok(Some(sets)) if sets.is_empty() => Ok(prediction.values.clone()),
            Ok(Some(sets)) => study.edited(&sets).and_then(|study| identify::values_within(&study, data, start, TIME_TOLERANCE)),
            _ => return none(),
        };
        let Ok(values) = moved else { return none() };
        let column: Vec<f64> = h.read(data, &values, step).iter().zip(&prediction.values).map(|(a, b)| (a - b) / step).collect();
        let shows = h.is_sensor() || column.iter().any(|c| (c * h.scale).abs() > VISIBLE * TIME_TOLERANCE);
        if shows { column } else { none() }
    };
    let column = |h: &Hypothesis| -> Vec<f64> {
        if !matches!(h.act, Act::Capacity(_)) {
            return along(h, h.scale * if h.is_signed { STEP } else { SECANT });
        }
        // More and less bend differently: the secant of the sign that the readings ask for.
        let explains = |column: &Vec<f64>, sign: f64| -> f64 {
            let (dot, square) = column.iter().zip(&residual).fold((0.0, 0.0), |(d, s), (c, r)| (d + c * r, s + c * c));
            if square > 0.0 { (sign * dot).max(0.0).powi(2) / square } else { 0.0 }
        };
        let (more, less) = (along(h, SECANT * h.scale), along(h, -SECANT * h.scale));
        if explains(&less, -1.0) > explains(&more, 1.0) { less } else { more }
    };
    let columns = hypotheses.par_iter().map(column).collect();
    Ok(Signatures { residual, prediction, fields: Vec::new(), columns })
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn steady(
    study: &Study,
    data: &Data,
    uncertain: &[crate::sensitivity::Parameter],
    hypotheses: &[Hypothesis],
    scales: &Scales,
    user: &[UserKind],
) -> Result<Signatures> {
    let (distinct, index) = conditions(data);
    let states = states(study, &distinct)?;
    let variables = study.model.machine.variables.iter().map(|v| study.parameter(&v.name)).collect::<Result<Vec<_>>>()?;
    let wanted: Vec<_> = uncertain.iter().chain(&variables).cloned().collect();
    // Different laws share what the act does.
    let mut acts: Vec<(Act, bool)> = hypotheses.iter().map(|h| (h.act, h.law == super::Law::Temperature)).collect();
    acts.sort_by_key(|a| format!("{a:?}"));
    acts.dedup();
    let powers: Vec<Vec<f64>> = user_powers(study, &distinct, user);
    struct At {
        values: Vec<f64>,
        slopes: Vec<Vec<f64>>,
        effects: Vec<Vec<f64>>,
    }
    let of = |(c, at): (usize, &Derivatives<'_>)| -> Result<At> {
        let adjoints: Vec<Adjoint> =
            data.sensors.par_iter().map(|s| at.adjoint_within(Target::Sensor(*s), ADJOINT)).collect::<Result<_>>()?;
        let slopes = wanted
            .iter()
            .map(|p| {
                let partial = at.partial(p)?;
                Ok(adjoints.iter().map(|adjoint| at.against(adjoint, &partial)).collect())
            })
            .collect::<Result<Vec<Vec<f64>>>>()?;
        let screen = at.screen();
        let network = &study.model.network;
        let effects = acts
            .par_iter()
            .map(|(act, drifts)| {
                let effect = effect(study, at, &screen, (*act, *drifts), user, &powers, c);
                let inlet = |k: usize| network.sensors[data.sensors[k]].inlet;
                adjoints.iter().enumerate().map(|(k, adjoint)| effect.as_ref().map_or(0.0, |e| e.on(&adjoint.field, inlet(k)))).collect()
            })
            .collect();
        let values = data.sensors.iter().map(|s| network.sensors[*s].read(&at.state.solution.temperatures, &at.state.load)).collect();
        Ok(At { values, slopes, effects })
    };
    let all: Vec<At> = states.par_iter().enumerate().map(of).collect::<Result<_>>()?;
    let places = whiten::places(data);
    let p = uncertain.len();
    let pick = |which: std::ops::Range<usize>| -> Vec<Vec<f64>> {
        places.iter().map(|(r, k)| which.clone().map(|w| all[index[*r]].slopes[w][*k]).collect()).collect()
    };
    let prediction = Prediction {
        values: places.iter().map(|(r, k)| all[index[*r]].values[*k]).collect(),
        slopes: pick(0..p),
        conditions: pick(p..wanted.len()),
    };
    let column = |h: &Hypothesis| -> Vec<f64> {
        if h.is_sensor() {
            return difference(&h.read(data, &prediction.values, 1.0), &prediction.values);
        }
        let Ok(at) = acts.binary_search_by_key(&format!("{:?}", (h.act, h.law == super::Law::Temperature)), |a| format!("{a:?}")) else {
            return vec![0.0; places.len()];
        };
        places.iter().map(|(r, k)| all[index[*r]].effects[at][*k] * scales.factor(h.law, &data.rows[*r].condition)).collect()
    };
    let columns = hypotheses.par_iter().map(column).collect();
    let fields = states.iter().map(|at| at.state.solution.temperatures.clone()).collect();
    Ok(Signatures { residual: difference(&whiten::readings(data), &prediction.values), prediction, fields, columns })
}

/// Heat per unit amplitude of the user's kinds at every condition, W; zero where the expression cannot be read.
fn user_powers(study: &Study, distinct: &[crate::machine::Condition], user: &[UserKind]) -> Vec<Vec<f64>> {
    let of = |kind: &UserKind| -> Vec<f64> {
        let value = format!("{{ in = {:?}, power = {:?} }}", kind.places, kind.expression);
        let powers = study.edited(&[("source.\"user kind\"".to_string(), value)]).and_then(|edited| {
            let machine = &edited.model.machine;
            let at = machine.sources.iter().position(|s| s.name == "user kind").unwrap_or(0);
            distinct.iter().map(|c| crate::network::Load::at(machine, c).map(|load| load.powers[at])).collect::<Result<Vec<f64>>>()
        });
        powers.unwrap_or_else(|_| vec![0.0; distinct.len()])
    };
    user.iter().map(of).collect()
}

/// Shares of a group's nodes in what is spread over it: by heat capacity, or evenly where there is none.
pub fn shares(network: &Network, group: u32) -> Vec<(u32, f64)> {
    let nodes: Vec<u32> = (0..network.solids as u32).filter(|n| network.group[*n as usize] == group).collect();
    let total: f64 = nodes.iter().map(|n| network.capacity[*n as usize]).sum();
    let share = |n: &u32| if total > 0.0 { network.capacity[*n as usize] / total } else { 1.0 / nodes.len() as f64 };
    nodes.iter().map(|n| (*n, share(n))).collect()
}

fn mean(shares: &[(u32, f64)], temperatures: &[f64]) -> f64 {
    shares.iter().map(|(n, w)| w * temperatures[*n as usize]).sum()
}

/// What an act does to the residual at a condition, per unit of its amplitude; a drift per 10 K away from 20 degC.
fn effect(
    study: &Study,
    at: &Derivatives<'_>,
    screen: &Screen<'_>,
    (act, drifts): (Act, bool),
    user: &[UserKind],
    powers: &[Vec<f64>],
    c: usize,
) -> Option<Effect> {
    let (network, machine) = (&study.model.network, &study.model.machine);
    let temperatures = &at.state.solution.temperatures;
    let load = &at.state.load;
    let scaled = |mut e: Effect, by: f64| {
        e.rows.iter_mut().for_each(|(_, r)| *r *= by);
        e
    };
    let along = |key: &str| -> Option<Effect> {
        let partial = at.partial(&study.parameter(key).ok()?).ok()?;
        let rows = partial.residual.iter().enumerate().filter(|(_, r)| **r != 0.0).map(|(n, r)| (n as u32, *r));
        Some(Effect { rows: rows.collect(), inlets: Vec::new() })
    };
    let stream = |channel: usize| network.streams.iter().position(|s| s.name == machine.channels[channel].name);
    Some(match act {
        Act::Heat(g) => screen.source(&shares(network, g)),
        Act::Source(s) if drifts => scaled(screen.temperature_coefficient(s), 1.0 / DRIFT),
        Act::Source(s) => screen.power(s),
        Act::UserHeat(u) => {
            // Where the file's own source would put it.
            let value = format!("{{ in = {:?}, power = \"1 W\" }}", user[u].places);
            let edited = study.edited(&[("source.\"user kind\"".to_string(), value)]).ok()?;
            let at = edited.model.machine.sources.iter().position(|s| s.name == "user kind")?;
            scaled(screen.source(&edited.model.network.sources.get(at)?.shares), powers[u][c])
        }
        Act::Contact(i) => {
            let contact = &machine.contacts[i].name;
            let whole = screen.contact(contact);
            if !drifts {
                return Some(whole);
            }
            let joints = network.contacts.iter().filter(|g| g.name == *contact).flat_map(|g| g.joints.clone());
            let (mut sum, mut area) = (0.0, 0.0);
            for joint in joints.map(|j| &network.joints[j]) {
                let (a, b) = network.joint_ends(joint, temperatures);
                sum += joint.area * 0.5 * (a + b);
                area += joint.area;
            }
            scaled(whole, if area > 0.0 { (sum / area - REFERENCE) / DRIFT } else { 0.0 })
        }
        Act::Film(channel) => screen.stream_film(stream(channel)?),
        Act::Branch(channel) => along(&format!("channel.{}.minor_loss", quoted(&machine.channels[channel].name)))?,
        Act::Flow(circuit) => screen.flow(circuit).ok()?,
        Act::Inlet(circuit) => screen.inlet(circuit).ok()?,
        Act::Chamber => along("chamber.temperature")?,
        Act::Emissivity(g) => screen.emissivity(screen.surfaces_of(g)),
        Act::Boundary(b) => screen.boundary(b as u32),
        Act::Loss(_) => {
            // The file's own words say which faces are open.
            let h = Hypothesis {
                kind: "",
                place: String::new(),
                parts: Vec::new(),
                law: super::Law::Constant,
                act,
                scale: 1.0,
                is_signed: false,
                unit: "",
            };
            let sets = h.sets(study, &Scales::default(), &[], 1.0).ok()??;
            let edited = study.edited(&sets).ok()?;
            let law = (edited.model.machine.boundaries.len() - 1) as u32;
            let open = edited.model.network.surfaces.iter().filter(|s| s.law == law);
            Effect { rows: open.map(|s| (s.node, s.area * (temperatures[s.node as usize] - load.chamber))).collect(), inlets: Vec::new() }
        }
        Act::Gas => screen.film(
            (0..network.surfaces.len()).filter(|s| network.surfaces[*s].gas_area > 0.0 || network.surfaces[*s].emissive > 0.0),
            load.chamber,
        ),
        Act::Leak(g) => {
            let rows = shares(network, g).into_iter().map(|(n, w)| (n, w * (temperatures[n as usize] - load.chamber)));
            Effect { rows: rows.collect(), inlets: Vec::new() }
        }
        Act::Link(a, b) | Act::Radiate(a, b) => {
            let (first, second) = (shares(network, a), shares(network, b));
            let (ta, tb) = (mean(&first, temperatures), mean(&second, temperatures));
            let heat = if matches!(act, Act::Link(..)) { ta - tb } else { crate::physics::radiation::SIGMA * (ta.powi(4) - tb.powi(4)) };
            let rows = first.into_iter().map(|(n, w)| (n, w * heat)).chain(second.into_iter().map(|(n, w)| (n, -w * heat)));
            Effect { rows: rows.collect(), inlets: Vec::new() }
        }
        Act::Capacity(_) | Act::Bias(_) | Act::Gain(_) | Act::Lag(_) | Act::Swap(..) => return None,
    })
}
