//! A reduced network over time: TR-BDF2 on the amplitudes of the modes, as the full network is integrated. Water moves as parcels
//! along the walls of all stations, by the very law of the full network: it is not reduced.

use std::rc::Rc;

use nalgebra::{DVector, Dyn, LU};

use super::conductors::conductors;
use super::level::{Given, Level, Reduced};
use crate::discretise::network::{Load, Network};
use crate::error::{Error, Result, Stop};
use crate::solve::transient::parcels::Parcels;
use crate::solve::transient::{EARLIER, GAMMA, LOCAL_ERROR, OWN, even_water, inflows, steady_water, streams_of};

/// Most steps of the iteration within a stage.
const MOST_ITERATIONS: usize = 25;
/// A matrix that takes more of them is found anew.
const SLOW: usize = 6;
/// How far a stage is solved, as a share of the tolerance.
const SOLVED: f64 = 1e-3;
/// No step is tried again shorter than this, s.
const SHORTEST: f64 = 1e-6;
/// First step, s, at most.
const FIRST: f64 = 60.0;

/// The matrix of both stages of a step.
struct Factors {
    /// Length of the step, s.
    length: f64,
    lu: LU<f64, Dyn, Dyn>,
}

/// A load with what follows from it alone.
struct Now {
    load: Load,
    given: Given,
}

/// A stage: M (a - start) + earlier + own R(a) = heat from the water along walls at the effective amplitudes.
struct Stage<'s> {
    /// From the beginning of the step, s.
    duration: f64,
    /// Weight of what leaves at the end, s.
    own: f64,
    /// What left before, J.
    earlier: DVector<f64>,
    /// Weight of the end's amplitudes, and what known ones give, in those of the walls.
    effective: (f64, DVector<f64>),
    /// At the beginning, and halfway, whose flow carries the water.
    begin: &'s Load,
    middle: &'s Load,
    /// At the end.
    now: &'s Now,
}

/// What a stage comes to.
struct Taken {
    amplitudes: DVector<f64>,
    temperatures: Vec<f64>,
    water: Vec<Parcels>,
    /// Steps of its iteration.
    iterations: usize,
}

/// A reduced network at one instant, on its way.
pub struct Motion<'a> {
    level: &'a Level,
    network: &'a Network,
    /// Error allowed in a step, K.
    tolerance: f64,
    /// Time, s.
    pub time: f64,
    /// Amplitudes of the modes, K.
    pub amplitudes: DVector<f64>,
    /// Temperatures of the sampled network, K; its water at the ends of the stations.
    temperatures: Vec<f64>,
    /// Water in each stream from inlet to outlet.
    water: Vec<Parcels>,
    step: f64,
    /// The load at this instant.
    now: Option<Rc<Now>>,
    /// The matrix of the last step, as long as it serves.
    factors: Option<Factors>,
    /// Amplitudes before the last step, and its length.
    before: Option<(DVector<f64>, f64)>,
    /// Steps taken.
    pub steps: usize,
}

impl<'a> Motion<'a> {
    /// From a steady state at `time` (s).
    pub fn from_steady(level: &'a Level, load: &Load, state: Reduced, time: f64, tolerance: f64) -> Self {
        let water = steady_water(&level.network, load, &state.streams, &state.temperatures);
        Self::new(level, (state.amplitudes, state.temperatures, water), time, tolerance)
    }

    /// From one temperature (K) everywhere, in amplitudes.
    pub fn from_uniform(level: &'a Level, load: &Load, amplitudes: DVector<f64>, temperature: f64, time: f64, tolerance: f64) -> Self {
        let network = &level.network;
        let still = vec![temperature; network.nodes];
        let temperatures = level.temperatures(network, load, &amplitudes, Some(&still));
        Self::new(level, (amplitudes, temperatures, even_water(network, temperature)), time, tolerance)
    }

    /// From amplitudes, the temperatures that follow from them, and the water in the streams.
    fn new(level: &'a Level, start: (DVector<f64>, Vec<f64>, Vec<Parcels>), time: f64, tolerance: f64) -> Self {
        let (amplitudes, temperatures, water) = start;
        Self {
            level,
            network: &level.network,
            tolerance,
            time,
            amplitudes,
            temperatures,
            water,
            step: 0.0,
            now: None,
            factors: None,
            before: None,
            steps: 0,
        }
    }

    /// Readings of all sensors, K.
    pub fn read(&self, load: &Load) -> Vec<f64> {
        self.level.readings_of(self.network, load, &self.amplitudes, &self.temperatures)
    }

    /// Advances to `until` (s). `load` must be smooth until then.
    ///
    /// # Errors
    /// A condition cannot be evaluated, or no step is short enough.
    pub fn advance(&mut self, until: f64, load: &dyn Fn(f64) -> Result<Load>) -> Result<()> {
        // Behind a corner, slopes of before tell nothing.
        self.before = None;
        let mut now = self.now(load(self.time)?, self.now.as_ref());
        if self.step <= 0.0 {
            self.step = self.first_step(&now);
        }
        while self.time < until {
            let left = until - self.time;
            let is_last = self.step >= left * (1.0 - 1e-9);
            let h = if is_last {
                left
            } else if self.step > 0.5 * left {
                0.5 * left
            } else {
                self.step
            };
            let tried = self.try_step(h, &now, load);
            let (found, error) = match tried {
                Ok((found, error)) => (Some(found), error),
                Err(e) if h < SHORTEST => return Err(e),
                Err(_) => (None, f64::INFINITY),
            };
            let growth = 0.9 * (self.tolerance / error.max(1e-300)).cbrt();
            let Some((taken, end)) = found.filter(|_| error <= self.tolerance) else {
                self.step = h * growth.clamp(0.25, 0.7);
                if h < SHORTEST {
                    let what = format!("no step is short enough for the reduced model at {:.6} s", self.time);
                    return Err(Error::stopped(Stop::TimeStepTooShort, what).help("run the machine file in full"));
                }
                continue;
            };
            self.before = Some((std::mem::replace(&mut self.amplitudes, taken.amplitudes), h));
            (self.temperatures, self.water) = (taken.temperatures, taken.water);
            self.time = if is_last { until } else { self.time + h };
            self.steps += 1;
            let grown = if growth > 1.2 { h * growth.min(2.5) } else { h * growth.clamp(0.5, 1.0) };
            self.step = if is_last { self.step.max(grown) } else { grown };
            now = end;
        }
        self.now = Some(now);
        Ok(())
    }

    /// A load with what follows from it: the same as before, where it is the same load.
    fn now(&self, load: Load, known: Option<&Rc<Now>>) -> Rc<Now> {
        match known.filter(|known| known.load == load) {
            Some(known) => Rc::clone(known),
            None => {
                let given = self.level.given(self.network, &load);
                Rc::new(Now { load, given })
            }
        }
    }

    /// What leaves the modes at some amplitudes but through the water, W.
    fn leaving(&self, a: &DVector<f64>, now: &Now) -> DVector<f64> {
        let temperatures = self.level.temperatures(self.network, &now.load, a, Some(&self.temperatures));
        let acting = conductors(self.network, &now.load, &temperatures);
        self.level.solid_residual(&now.given, &acting, a)
    }

    /// One step of length `h`: what it comes to and the load at its end, and the estimated error, K.
    fn try_step(&mut self, h: f64, now: &Rc<Now>, load: &dyn Fn(f64) -> Result<Load>) -> Result<((Taken, Rc<Now>), f64)> {
        let factors = self.factors.take().filter(|f| f.length == h);
        let at = |share: f64, known: &Rc<Now>| load(self.time + share * h).map(|load| self.now(load, Some(known)));
        let between = at(GAMMA, now)?;
        let end = at(1.0, &between)?;
        let (early, middle) = (load(self.time + 0.5 * GAMMA * h)?, load(self.time + 0.5 * h)?);
        let start = &self.amplitudes;
        // One matrix for both stages: half of the first one's duration is the weight of either's own heat.
        let acting = conductors(self.network, &now.load, &self.temperatures);
        let lu = match factors {
            Some(known) => known.lu,
            None => {
                let streams = self.network.stream_states(&now.load, &self.temperatures)?;
                let slopes = self.level.jacobian(self.network, &streams, &now.given, &acting);
                (&self.level.capacity + slopes * (OWN * h)).lu()
            }
        };
        let begin = self.level.solid_residual(&now.given, &acting, start);
        let first = Stage {
            duration: GAMMA * h,
            own: OWN * h,
            earlier: &begin * (OWN * h),
            effective: (0.5, start * 0.5),
            begin: &now.load,
            middle: &early,
            now: &between,
        };
        let first = self.stage(&lu, &first, self.ahead(GAMMA * h))?.amplitudes;
        let second = Stage {
            duration: h,
            own: OWN * h,
            earlier: (&begin + self.leaving(&first, &between)) * (EARLIER * h),
            effective: (OWN, (start + &first) * EARLIER),
            begin: &now.load,
            middle: &middle,
            now: &end,
        };
        let taken = self.stage(&lu, &second, start + (&first - start) / GAMMA)?;
        let error = self.local_error(h, &first, &taken.amplitudes);
        // A matrix that has become slow is found anew.
        self.factors = (taken.iterations <= SLOW).then_some(Factors { length: h, lu });
        Ok(((taken, end), error))
    }

    /// Solves M (a - start) + earlier + own R(a) = heat from the water.
    fn stage(&self, lu: &LU<f64, Dyn, Dyn>, stage: &Stage<'_>, guess: DVector<f64>) -> Result<Taken> {
        let (level, network, start) = (self.level, self.network, &self.amplitudes);
        let effective = |a: &DVector<f64>| a * stage.effective.0 + &stage.effective.1;
        let wetted = |a: &DVector<f64>| level.temperatures(network, &stage.now.load, a, Some(&self.temperatures));
        // Films from the temperatures expected halfway, as in the full network.
        let states = network.stream_states(stage.middle, &wetted(&effective(&guess)))?;
        let streams = streams_of(network, &states, stage.duration);
        let (water, inflows) = (streams.fitted(&self.water), inflows(stage.begin, &stage.now.load));
        let mut a = guess;
        let mut last = f64::INFINITY;
        for iterations in 0..MOST_ITERATIONS {
            let along = effective(&a);
            let walls = wetted(&along);
            let carried = streams.carry(&|n| walls[n], &water, &inflows);
            let mut open = &level.capacity * (&a - start) + &stage.earlier + self.leaving(&a, stage.now) * stage.own;
            for (ring, carried) in level.rings.iter().zip(&carried) {
                ring.apply(ring.points.iter().map(|k| carried.weight[*k]), &along, &mut open);
            }
            let heats = DVector::from_iterator(level.walls.ncols(), carried.iter().flat_map(|c| c.heat.iter().copied()));
            open.gemv(-1.0, &level.walls, &heats, 1.0);
            if last < SOLVED * self.tolerance {
                let mut temperatures = wetted(&a);
                streams.place(&mut temperatures, &carried);
                let water = carried.into_iter().map(|c| c.parcels).collect();
                return Ok(Taken { amplitudes: a, temperatures, water, iterations });
            }
            let Some(step) = lu.solve(&open).filter(|s| s.iter().all(|v| v.is_finite())) else { break };
            a -= &step;
            last = level.largest(&step);
        }
        Err(Error::stopped(Stop::MostNewtonSteps, format!("a step of the reduced model does not converge at {:.3} s", self.time)))
    }

    /// Amplitudes a time `h` ahead, continuing the last step.
    fn ahead(&self, h: f64) -> DVector<f64> {
        match &self.before {
            Some((before, length)) => &self.amplitudes + (&self.amplitudes - before) * (h / length).min(1.0),
            None => self.amplitudes.clone(),
        }
    }

    /// A step in which nothing moves by more than a few tolerances.
    fn first_step(&self, now: &Now) -> f64 {
        let leaving = self.leaving(&self.amplitudes, now);
        let rate = self.level.capacity.clone().lu().solve(&leaving).map_or(f64::INFINITY, |rate| self.level.largest(&rate));
        if rate > 0.0 { (5.0 * self.tolerance / rate).clamp(SHORTEST, FIRST) } else { FIRST }
    }

    /// As that of the full network: from the third divided difference, or a tenth of the second where only three states are known.
    fn local_error(&self, h: f64, between: &DVector<f64>, after: &DVector<f64>) -> f64 {
        let (a, b) = (GAMMA * h, h);
        let (d1, d2) = ((between - &self.amplitudes) / a, (after - between) / (b - a));
        let second = (&d2 - &d1) / b;
        let error = match &self.before {
            Some((before, last)) => {
                let d0 = (&self.amplitudes - before) / *last;
                (second - (&d1 - d0) / (a + last)) * (LOCAL_ERROR * 6.0 * h * h * h / (b + last))
            }
            None => second * (0.1 * h * h),
        };
        self.level.largest(&error)
    }
}
