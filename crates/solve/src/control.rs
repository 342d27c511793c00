//! Steady states with controllers: each sensor at its set point, or its controller at a limit.

use nalgebra::DMatrix;

use super::bounded;
use super::steady::{Solution, Solver};
use coldplate_base::error::{Error, Result, Stop};
use coldplate_base::progress::Progress;
use coldplate_network::{ControlLoop, Load, Network};

/// Relative residual of the linear solves for the slopes of readings, dimensionless. Chosen: iterations against steps of the shares.
const SLOPE: f64 = 1e-8;
/// Largest step of a reading, K, and of a share, at which the shares have been found: the error that Newton's method leaves in any
/// temperature.
const CLOSE: f64 = 1e-7;
/// Most steps of the shares, a count. Chosen: time against conditions that are refused.
const MOST_STEPS: usize = 40;
/// Least warming of the sensor by the full power over the largest warming by it, dimensionless: less is rounding. Chosen.
const LEAST_REACH: f64 = 1e-9;

impl Solver<'_> {
    /// Newton's method with the shares that the controllers of the network give in the steady state.
    pub(super) fn controlled(&self, load: &Load, start: &[f64], error: f64, progress: &dyn Progress) -> Result<Solution> {
        if self.network.loops.is_empty() {
            return self.newton(load, start, error, progress);
        }
        // Full power may lead far away: sources that are off come first.
        let mut shares = self.reference.1.shares.clone();
        shares.resize(self.network.loops.len(), 0.0);
        let mut found = self.newton(&load.clone().with_shares(self.network, &shares), start, error, progress)?;
        for _ in 0..MOST_STEPS {
            let (responses, slopes) = self.responses(load, &found)?;
            let values: Vec<f64> = self.network.deviations(load, &found.temperatures).iter().map(|deviation| -deviation).collect();
            let Some(next) = bounded::shares(&shares, &values, &slopes) else {
                return Err(opposed(self.network));
            };
            let step: Vec<f64> = next.iter().zip(&shares).map(|(next, now)| next - now).collect();
            let moved = (0..step.len()).map(|i| (0..step.len()).map(|j| slopes[(i, j)] * step[j]).sum::<f64>().abs());
            if moved.chain(step.iter().map(|step| step.abs())).fold(0.0, f64::max) <= CLOSE {
                return Ok(Solution { shares, ..found });
            }
            let mut guess = found.temperatures;
            for (response, step) in responses.iter().zip(&step) {
                guess.iter_mut().zip(response).for_each(|(t, r)| *t += r * step);
            }
            shares = next;
            let at = self.newton(&load.clone().with_shares(self.network, &shares), &guess, f64::INFINITY, progress)?;
            found = Solution {
                newton_iterations: found.newton_iterations + at.newton_iterations,
                krylov_iterations: found.krylov_iterations + at.krylov_iterations,
                assemble_seconds: found.assemble_seconds + at.assemble_seconds,
                solve_seconds: found.solve_seconds + at.solve_seconds,
                ..at
            };
        }
        let names: Vec<&str> = self.network.loops.iter().map(|own| own.name.as_str()).collect();
        Err(Error::stopped(
            Stop::MostNewtonSteps,
            format!("no steady state of the controllers found in {MOST_STEPS} steps: {}", names.join(", ")),
        ))
    }

    /// Warming of all nodes by a whole share of each controller, K, and the slopes of minus the deviations that follow from it.
    fn responses(&self, load: &Load, at: &Solution) -> Result<(Vec<Vec<f64>>, DMatrix<f64>)> {
        let network = self.network;
        let matrix = self.system.jacobian(network, load, &at.streams, &at.temperatures);
        let mut work = self.work_space();
        let mut responses = Vec::with_capacity(network.loops.len());
        for own in &network.loops {
            let mut heats = vec![0.0; network.nodes];
            for source in &own.sources {
                let (source, power) = (&network.sources[*source], load.full_powers[*source]);
                source.heats(power, &at.temperatures).for_each(|(node, heat)| heats[node as usize] += heat);
            }
            network.fixed.iter().for_each(|(node, _)| heats[*node as usize] = 0.0);
            let mut response = vec![0.0; network.nodes];
            if heats.iter().any(|heat| *heat != 0.0) {
                self.linear(&matrix, &at.streams, &heats, &mut response, SLOPE, &mut work).useful()?;
            }
            responses.push(response);
        }
        let slope = |own: &ControlLoop, response: &[f64]| {
            own.sign() * network.sensors[own.sensor].weights.iter().map(|(node, weight)| weight * response[*node as usize]).sum::<f64>()
        };
        let slopes = DMatrix::from_fn(responses.len(), responses.len(), |i, j| slope(&network.loops[i], &responses[j]));
        for (i, (own, response)) in network.loops.iter().zip(&responses).enumerate() {
            let largest = response.iter().fold(0.0f64, |most, r| most.max(r.abs()));
            check(network, own, slopes[(i, i)], largest)?;
        }
        Ok((responses, slopes))
    }
}

/// Refuses a controller whose full power warms its sensor by `slope` (K, in its own direction) and something by `largest` (K).
fn check(network: &Network, own: &ControlLoop, slope: f64, largest: f64) -> Result<()> {
    let sensor = &network.sensor_names[own.sensor];
    let refused = |what: String| Error::input(what).at_key(format!("controller.{}", own.name));
    if slope.abs() <= LEAST_REACH * largest && largest > 0.0 {
        let what = format!("the heat of its sources does not reach the sensor '{sensor}'");
        return Err(refused(what).help("name a sensor that these sources warm or cool"));
    }
    if slope < 0.0 {
        let (does, action, sign) = if own.cools { ("warm", "heat", "negative") } else { ("cool", "cool", "positive") };
        let what = format!("more power of its sources would {does} the sensor '{sensor}': the controller leads away from its set point");
        return Err(refused(what).help(format!("write action = \"{action}\", or a {sign} power")));
    }
    Ok(())
}

fn opposed(network: &Network) -> Error {
    let names: Vec<&str> = network.loops.iter().map(|own| own.name.as_str()).collect();
    Error::input(format!("these controllers work against each other: {}", names.join(", ")))
        .at_key("controller")
        .help("let each read a sensor that its own sources move more than those of the others")
}
