//! Controllers over time: thermostats switch at the ends of their bands, PI controllers are solved with each stage.

use nalgebra::DMatrix;

use super::super::bounded;
use super::stage::SolvedStage;
use super::tr_bdf2::{GAMMA, parabola};
use super::{Transient, TransientState};
use coldplate_base::error::{Error, Result, Stop};
use coldplate_describe::machine::ControlLaw;
use coldplate_network::{Load, Network};

/// Error of a share, dimensionless, at which a stage has found it. Chosen: far below what a step's error lets through.
const CLOSE: f64 = 1e-9;
/// Most solves of a stage for its shares, a count. Chosen: time against steps that are halved.
const MOST_SOLVES: usize = 30;
/// A switch is located until its sensor is this near to the end of its band, as a share of the step's tolerance. Chosen: an instant is
/// then more exact than the temperatures.
const LOCATED: f64 = 1e-3;
/// Halvings of a step on the way to the instant of a switch, a count: they reach rounding.
const HALVINGS: usize = 53;
/// Deviation of a sensor at which it counts as at its set point, K: the error that a steady state leaves, with room.
const AT_SET_POINT: f64 = 1e-6;

/// A controller at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControlState {
    /// Share of the power of its sources, from 0 to 1.
    pub share: f64,
    /// Part of the share that the integral of a PI controller makes, from 0 to 1; 0 for a thermostat.
    pub integral: f64,
    /// Time at full power that would have given as much heat since the beginning, s.
    pub given: f64,
    /// Switches of a thermostat since the beginning.
    pub switches: usize,
}

impl ControlState {
    /// Controllers in a steady state with known shares.
    pub(super) fn steady(network: &Network, load: &Load, temperatures: &[f64], shares: &[f64]) -> Vec<Self> {
        let of = |((own, share), deviation): ((&coldplate_network::ControlLoop, &f64), f64)| {
            let integral = match own.law {
                ControlLaw::Thermostat { .. } => 0.0,
                // At a limit: as it would leave it at once.
                ControlLaw::ProportionalIntegral { gain, .. } => (share - gain * deviation).clamp(0.0, 1.0),
            };
            Self { share: *share, integral, given: 0.0, switches: 0 }
        };
        network.loops.iter().zip(shares).zip(network.deviations(load, temperatures)).map(of).collect()
    }
}

impl TransientState {
    /// Takes note of shares and integrals at the end of a step of a length, s.
    pub(super) fn advance_controls(&mut self, h: f64, shares: &[f64], integrals: &[f64]) {
        for ((own, share), integral) in self.controls.iter_mut().zip(shares).zip(integrals) {
            own.given += h * f64::midpoint(own.share, *share);
            (own.share, own.integral) = (*share, *integral);
        }
    }

    pub(super) fn shares(&self) -> Vec<f64> {
        self.controls.iter().map(|own| own.share).collect()
    }
}

/// A stage's rule of integration for the integrals of the controllers.
pub(super) struct Integration<'r> {
    /// Weight of the rate at the end, s.
    pub own: f64,
    /// Weights (s) and rates (1/s) that are known already.
    pub earlier: &'r [(f64, &'r [f64])],
    /// Shares to begin with.
    pub shares: Vec<f64>,
}

/// The integral of one controller over a stage.
struct Integral {
    /// Integral without the rate at the end of the stage.
    known: f64,
    /// Weight of the rate at the end, s.
    own: f64,
}

/// A solved stage with the shares at its end, and the integrals and the rates at which they grow (1/s).
pub(super) struct ControlledStage {
    pub solved: SolvedStage,
    pub load: Load,
    pub shares: Vec<f64>,
    pub integrals: Vec<f64>,
    pub rates: Vec<f64>,
}

impl Transient<'_> {
    /// Sets all controllers at the beginning of a step from the deviations of their sensors: thermostats switch, and a PI controller
    /// follows a set point that has jumped. Whether a thermostat switched.
    fn switch(&self, state: &mut TransientState, load: &Load) -> bool {
        let network = self.network;
        let deviations = network.deviations(load, &state.temperatures);
        if state.controls.is_empty() {
            state.controls = vec![ControlState { share: f64::NAN, integral: 0.0, given: 0.0, switches: 0 }; network.loops.len()];
        }
        let is_new = state.before.is_none();
        let located = LOCATED * self.settings.tolerance;
        let mut has_switched = false;
        for ((own, state), deviation) in network.loops.iter().zip(&mut state.controls).zip(deviations) {
            match own.law {
                ControlLaw::Thermostat { hysteresis } => {
                    let end = 0.5 * hysteresis - located.min(0.25 * hysteresis);
                    let share = match state.share {
                        _ if deviation >= end => 1.0,
                        _ if deviation <= -end => 0.0,
                        share if share == 0.0 || share == 1.0 => share,
                        _ if deviation >= -AT_SET_POINT => 1.0,
                        _ => 0.0,
                    };
                    has_switched |= share != state.share;
                    // From off to on or back; not at the beginning.
                    state.switches += usize::from((share - state.share).abs() == 1.0);
                    state.share = share;
                }
                ControlLaw::ProportionalIntegral { gain, .. } if is_new => {
                    state.share = (gain * deviation + state.integral).clamp(0.0, 1.0);
                }
                ControlLaw::ProportionalIntegral { .. } => {}
            }
        }
        has_switched
    }

    /// Largest excess of a thermostat's sensor over the end of its band, K, at given temperatures: negative before it switches.
    pub(super) fn excess(&self, state: &TransientState, load: &Load, temperatures: &[f64]) -> f64 {
        let of = |((own, state), deviation): ((&coldplate_network::ControlLoop, &ControlState), f64)| match own.law {
            ControlLaw::Thermostat { hysteresis } => (if state.share == 0.0 { deviation } else { -deviation }) - 0.5 * hysteresis,
            ControlLaw::ProportionalIntegral { .. } => f64::NEG_INFINITY,
        };
        let deviations = self.network.deviations(load, temperatures);
        self.network.loops.iter().zip(&state.controls).zip(deviations).map(of).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Rates at which the integrals grow at the beginning of a step, 1/s.
    pub(super) fn rates(&self, state: &TransientState, load: &Load) -> Vec<f64> {
        let of = |((own, state), deviation): ((&coldplate_network::ControlLoop, &ControlState), f64)| match own.law {
            ControlLaw::Thermostat { .. } => 0.0,
            ControlLaw::ProportionalIntegral { gain, integral_time } => {
                let asked = gain * deviation + state.integral;
                let stands = (asked >= 1.0 && deviation > 0.0) || (asked <= 0.0 && deviation < 0.0);
                if stands { 0.0 } else { gain * deviation / integral_time }
            }
        };
        let deviations = self.network.deviations(load, &state.temperatures);
        self.network.loops.iter().zip(&state.controls).zip(deviations).map(of).collect()
    }

    /// Controllers, held nodes and nodes without capacity at the beginning of a step; returns the load with the shares of the controllers.
    pub(super) fn begun(&mut self, state: &mut TransientState, now: &Load) -> Result<Load> {
        let mut now = now.clone();
        for _ in 0..2 {
            if !self.network.loops.is_empty() {
                if self.switch(state, &now) {
                    state.before = None;
                }
                now = now.with_shares(self.network, &state.shares());
            }
            if state.before.is_some() {
                break;
            }
            self.settle(state, &now)?;
            // A sensor may read a node that has just settled.
            if self.network.loops.is_empty() {
                break;
            }
        }
        Ok(now)
    }

    /// Share of a step at which the first thermostat reaches the end of its band, from the excess (K) at the three states of the step;
    /// `None` if none does, or if it does just at the end.
    pub(super) fn switch_within(&self, excess: [f64; 3]) -> Option<f64> {
        let located = LOCATED * self.settings.tolerance;
        if excess[1] <= located && excess[2] <= located {
            return None;
        }
        // From below zero to above it along the parabola through the three states.
        let (mut low, mut high) = (0.0, if excess[1] > located { GAMMA } else { 1.0 });
        for _ in 0..HALVINGS {
            let middle = f64::midpoint(low, high);
            let there: f64 = parabola(middle).iter().zip([0.0, excess[1] - excess[0], excess[2] - excess[0]]).map(|(w, g)| w * g).sum();
            if excess[0] + there < 0.0 { low = middle } else { high = middle }
        }
        Some(high)
    }

    /// Error of a thermostat whose sensor jumps over its band at a time, s.
    pub(super) fn chatters(&self, time: f64) -> Error {
        let thermostats = self.network.loops.iter().filter(|own| matches!(own.law, ControlLaw::Thermostat { .. }));
        let names: Vec<&str> = thermostats.map(|own| own.name.as_str()).collect();
        Error::stopped(Stop::TimeStepTooShort, format!("a thermostat switches without end at {time:.6} s: {}", names.join(", ")))
            .at_key("controller")
            .help("its sensor moves by more than the band at once: let it read a place that stores heat, or state a wider hysteresis")
    }

    /// Solves a stage for the temperatures and for the shares at its end; `solve` solves it under a load.
    pub(super) fn controlled_stage(
        &mut self,
        state: &TransientState,
        load: &Load,
        Integration { own, earlier, mut shares }: Integration<'_>,
        solve: &mut dyn FnMut(&mut Self, &Load) -> Result<SolvedStage>,
    ) -> Result<ControlledStage> {
        let network = self.network;
        if network.loops.is_empty() {
            let solved = solve(self, load)?;
            return Ok(ControlledStage { solved, load: load.clone(), shares, integrals: Vec::new(), rates: Vec::new() });
        }
        let known = |i: usize| state.controls[i].integral + earlier.iter().map(|(weight, rates)| weight * rates[i]).sum::<f64>();
        let integrals: Vec<Integral> = (0..network.loops.len()).map(|i| Integral { known: known(i), own }).collect();
        let leading: Vec<usize> =
            (0..network.loops.len()).filter(|i| matches!(network.loops[*i].law, ControlLaw::ProportionalIntegral { .. })).collect();
        // Change of the deviations with the shares, by differences (Broyden): it is exact after as many solves as there are controllers.
        let mut slopes = DMatrix::<f64>::zeros(leading.len(), leading.len());
        let mut last: Option<(Vec<f64>, Vec<f64>)> = None;
        for _ in 0..MOST_SOLVES {
            let own_load = load.clone().with_shares(network, &shares);
            let solved = solve(self, &own_load)?;
            let deviations = network.deviations(load, &solved.temperatures);
            let laws: Vec<(f64, f64)> = leading.iter().map(|i| integrals[*i].line(network.loops[*i].law)).collect();
            let asked = |i: usize| laws[i].0 + laws[i].1 * deviations[leading[i]];
            let open = (0..leading.len()).map(|i| (asked(i).clamp(0.0, 1.0) - shares[leading[i]]).abs()).fold(0.0, f64::max);
            if open <= CLOSE {
                let ended = network.loops.iter().zip(&integrals).zip(&shares).zip(&deviations);
                let (integrals, rates) = ended.map(|(((l, integral), share), deviation)| integral.ended(l.law, *share, *deviation)).unzip();
                return Ok(ControlledStage { solved, load: own_load, shares, integrals, rates });
            }
            let here: Vec<f64> = leading.iter().map(|i| shares[*i]).collect();
            let seen: Vec<f64> = leading.iter().map(|i| deviations[*i]).collect();
            if let Some((share, deviation)) = &last {
                broyden(&mut slopes, &here, share, &seen, deviation);
            }
            // u - (a + b e) is zero between the limits, not negative at 0 and not positive at 1.
            let values: Vec<f64> = (0..leading.len()).map(|i| here[i] - asked(i)).collect();
            let matrix = DMatrix::from_fn(leading.len(), leading.len(), |i, j| f64::from(u8::from(i == j)) - laws[i].1 * slopes[(i, j)]);
            let Some(next) = bounded::shares(&here, &values, &matrix) else { break };
            leading.iter().zip(next).for_each(|(i, share)| shares[*i] = share);
            last = Some((here, seen));
        }
        Err(Error::stopped(Stop::MostNewtonSteps, format!("the controllers find no shares at {:.6} s", state.time)))
    }
}

impl Integral {
    /// Share at the end of the stage as a straight line of the deviation there, before it is limited.
    fn line(&self, law: ControlLaw) -> (f64, f64) {
        match law {
            ControlLaw::Thermostat { .. } => (0.0, 0.0),
            ControlLaw::ProportionalIntegral { gain, integral_time } => (self.known, gain * (1.0 + self.own / integral_time)),
        }
    }

    /// Integral at the end of the stage and the rate at which it grows there, 1/s: it grows until the share is at a limit, no further.
    fn ended(&self, law: ControlLaw, share: f64, deviation: f64) -> (f64, f64) {
        let ControlLaw::ProportionalIntegral { gain, integral_time } = law else { return (0.0, 0.0) };
        let grown = self.known + self.own * gain * deviation / integral_time;
        let end = (share - gain * deviation).clamp(self.known.min(grown), self.known.max(grown));
        (end, (end - self.known) / self.own)
    }
}

/// Broyden's update of slopes, from a step of the shares and of the deviations.
fn broyden(slopes: &mut DMatrix<f64>, share: &[f64], share_before: &[f64], seen: &[f64], seen_before: &[f64]) {
    let step: Vec<f64> = share.iter().zip(share_before).map(|(now, then)| now - then).collect();
    let square: f64 = step.iter().map(|s| s * s).sum();
    for i in 0..step.len() {
        let expected: f64 = (0..step.len()).map(|j| slopes[(i, j)] * step[j]).sum();
        let missing = seen[i] - seen_before[i] - expected;
        (0..step.len()).for_each(|j| slopes[(i, j)] += missing * step[j] / square);
    }
}
