//! A reduced network over time: TR-BDF2 on the amplitudes of the modes, as the full network is integrated. Water moves as parcels
//! along the walls of all stations, by the law of the full network.

use std::rc::Rc;

use nalgebra::{DMatrix, DVector, Dyn, LU};

use super::conductors::conductors;
use super::level::{Given, Level, Reduced, drift};
use crate::discretise::network::{Load, Network, SensorTerm};
use crate::error::{Error, Result, Stop};
use crate::solve::transient::parcels::Parcels;
use crate::solve::transient::water::{Streams, inflows, residence};
use crate::solve::transient::{EARLIER, GAMMA, LOCAL_ERROR, OWN, even_water, parabola, steady_water};

/// Most steps of the iteration within a stage.
const MOST_ITERATIONS: usize = 25;
/// A matrix that takes more of them is found anew.
const SLOW: usize = 6;
/// How far a stage is solved, as a share of the tolerance.
const SOLVED: f64 = 1e-2;
/// No step is tried again shorter than this, s.
const SHORTEST: f64 = 1e-6;
/// No step leads to an instant nearer than this, s: it is reached.
const SAME_INSTANT: f64 = 1e-9;
/// A last step that is a smaller share of the next one tells nothing about how it bends.
const TELLING: f64 = 0.1;
/// First step, s, at most.
const FIRST: f64 = 60.0;

/// The matrix of both stages of a step.
struct Factors {
    /// Length of the step, s.
    length: f64,
    lu: LU<f64, Dyn, Dyn>,
    /// Derivatives of what leaves the modes, W/K, that it was made with.
    slopes: DMatrix<f64>,
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
    /// What leaves the modes there but through the water, W.
    leaving: DVector<f64>,
    water: Vec<Parcels>,
    /// Steps of its iteration.
    iterations: usize,
}

/// A step.
struct Tried {
    /// Amplitudes and temperatures between its beginning and its end.
    between: (DVector<f64>, Vec<f64>),
    taken: Taken,
    /// The load at its end.
    end: Rc<Now>,
}

/// Readings of all sensors (K) at ascending times (s).
pub type Path = Vec<(f64, Vec<f64>)>;

/// The load at a time, s.
type LoadAt<'l> = dyn Fn(f64) -> Result<Load> + 'l;

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
    /// What leaves the modes at this instant but through the water, W, as long as its load is that of `now`.
    leaving: Option<DVector<f64>>,
    /// The matrix of the last step, as long as its derivatives serve.
    factors: Option<Factors>,
    /// Whether readings of water were far from straight in the last step.
    lands: bool,
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
            leaving: None,
            factors: None,
            lands: false,
            before: None,
            steps: 0,
        }
    }

    /// Readings of all sensors, K.
    pub fn read(&self, load: &Load) -> Vec<f64> {
        self.level.readings_of(self.network, load, &self.amplitudes, &self.temperatures)
    }

    /// Advances to `until` (s), from one corner of the condition to the next: `load` must be smooth until then. Readings of all sensors
    /// at ascending `outputs` on the way (s), under the load that they see there, K: within a step by the parabola through its three
    /// states. Steps end at the outputs while water of before the corner may be in the channels, so that fronts may pass, and where
    /// readings of water are far from straight. `path` takes in the readings now and at the end of every step.
    ///
    /// # Errors
    /// A condition cannot be evaluated, or no step is short enough.
    pub fn advance(&mut self, until: f64, load: &LoadAt<'_>, outputs: &[f64], seen: &LoadAt<'_>, path: &mut Path) -> Result<Vec<Vec<f64>>> {
        // Behind a corner, slopes of before tell nothing.
        self.before = None;
        let mut readings = Vec::with_capacity(outputs.len());
        let mut now = self.now(load(self.time)?, self.now.as_ref());
        self.leaving = self.leaving.take().filter(|_| self.now.as_ref().is_some_and(|before| Rc::ptr_eq(before, &now)));
        if self.step <= 0.0 {
            self.step = self.first_step(&now);
        }
        path.push((self.time, self.read(&now.load)));
        let residence = |load: &Load| residence(self.network, load, &self.temperatures, &self.water);
        let even = self.time + residence(&now.load)?.max(residence(&load(until)?)?);
        while until - self.time > SAME_INSTANT {
            while let Some(time) = outputs.get(readings.len()).filter(|time| **time - self.time <= SAME_INSTANT) {
                readings.push(self.read(&seen(*time)?));
            }
            let output = outputs.get(readings.len()).copied();
            let goal = output.filter(|_| self.lands || self.time < even).unwrap_or(until);
            let left = goal - self.time;
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
            let Some(Tried { between, taken, end }) = found.filter(|_| error <= self.tolerance) else {
                self.step = h * growth.clamp(0.25, 0.7);
                if h < SHORTEST {
                    let what = format!("no step is short enough for the reduced model at {:.6} s", self.time);
                    return Err(Error::stopped(Stop::TimeStepTooShort, what).help("run the machine file in full"));
                }
                continue;
            };
            self.lands = self.unevenness(&between.1, &taken.temperatures, &now.load) > self.tolerance;
            let reached = if is_last { goal } else { self.time + h };
            if self.lands && output.is_some_and(|output| output < reached) {
                self.step = h;
                continue;
            }
            let begun = std::mem::replace(&mut self.time, reached);
            let amplitudes = std::mem::replace(&mut self.amplitudes, taken.amplitudes);
            let temperatures = std::mem::replace(&mut self.temperatures, taken.temperatures);
            (self.water, self.leaving) = (taken.water, Some(taken.leaving));
            while let Some(time) = outputs.get(readings.len()).filter(|time| **time <= self.time) {
                let [first, second, third] = parabola((time - begun) / h);
                let a = first * &amplitudes + second * &between.0 + third * &self.amplitudes;
                let states = temperatures.iter().zip(&between.1).zip(&self.temperatures);
                let t: Vec<f64> = states.map(|((begin, between), end)| first * begin + second * between + third * end).collect();
                readings.push(self.level.readings_of(self.network, &seen(*time)?, &a, &t));
            }
            self.before = Some((amplitudes, h));
            self.steps += 1;
            let grown = if growth > 1.2 { h * growth.min(2.5) } else { h * growth.clamp(0.5, 1.0) };
            self.step = if is_last { self.step.max(grown) } else { grown };
            now = end;
            path.push((self.time, self.read(&now.load)));
        }
        for time in &outputs[readings.len()..] {
            readings.push(self.read(&seen(*time)?));
        }
        self.time = until;
        self.now = Some(now);
        Ok(readings)
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

    /// How far readings of water between the beginning and the end of a step are from the straight line, K.
    fn unevenness(&self, between: &[f64], end: &[f64], load: &Load) -> f64 {
        let uneven = |sensor: &SensorTerm| {
            let [begin, between, end] = [&self.temperatures, between, end].map(|t| sensor.read(t, load));
            (between - begin - GAMMA * (end - begin)).abs()
        };
        self.network.sensors.iter().map(uneven).fold(0.0, f64::max)
    }

    /// What leaves the modes at some amplitudes, whose temperatures are given too, but through the water, W.
    fn leaving(&self, a: &DVector<f64>, temperatures: &[f64], now: &Now) -> DVector<f64> {
        self.level.solid_residual(&now.given, &conductors(self.network, &now.load, temperatures), a)
    }

    /// One step of length `h`, and its estimated error, K.
    fn try_step(&mut self, h: f64, now: &Rc<Now>, load: &LoadAt<'_>) -> Result<(Tried, f64)> {
        let at = |share: f64, known: &Rc<Now>| load(self.time + share * h).map(|load| self.now(load, Some(known)));
        let between = at(GAMMA, now)?;
        let end = at(1.0, &between)?;
        let (early, middle) = (load(self.time + 0.5 * GAMMA * h)?, load(self.time + 0.5 * h)?);
        let start = &self.amplitudes;
        // One matrix for both stages: half of the first one's duration is the weight of either's own heat.
        let factors = match self.factors.take() {
            Some(known) if known.length == h => known,
            known => {
                let slopes = known.map_or_else(|| self.slopes(now), |known| Ok(known.slopes))?;
                Factors { length: h, lu: (&self.level.capacity + &slopes * (OWN * h)).lu(), slopes }
            }
        };
        let lu = &factors.lu;
        let begin = match &self.leaving {
            Some(known) => known.clone(),
            None => self.leaving(start, &self.temperatures, now),
        };
        let first = Stage {
            duration: GAMMA * h,
            own: OWN * h,
            earlier: &begin * (OWN * h),
            effective: (0.5, start * 0.5),
            begin: &now.load,
            middle: &early,
            now: &between,
        };
        let Taken { amplitudes: first, temperatures, leaving, .. } = self.stage(lu, &first, self.ahead(GAMMA * h))?;
        let second = Stage {
            duration: h,
            own: OWN * h,
            earlier: (&begin + leaving) * (EARLIER * h),
            effective: (OWN, (start + &first) * EARLIER),
            begin: &now.load,
            middle: &middle,
            now: &end,
        };
        let taken = self.stage(lu, &second, start + (&first - start) / GAMMA)?;
        let error = self.local_error(h, &first, &taken.amplitudes);
        // A matrix that has become slow is found anew.
        self.factors = (taken.iterations <= SLOW).then_some(factors);
        Ok((Tried { between: (first, temperatures), taken, end }, error))
    }

    /// Derivatives of what leaves the modes now, W/K.
    fn slopes(&self, now: &Now) -> Result<DMatrix<f64>> {
        let acting = conductors(self.network, &now.load, &self.temperatures);
        let streams = self.network.stream_states(&now.load, &self.temperatures)?;
        Ok(self.level.jacobian(self.network, &streams, &now.given, &acting))
    }

    /// Solves M (a - start) + earlier + own R(a) = heat from the water.
    fn stage(&self, lu: &LU<f64, Dyn, Dyn>, stage: &Stage<'_>, guess: DVector<f64>) -> Result<Taken> {
        let (level, network, load) = (self.level, self.network, &stage.now.load);
        let effective = |a: &DVector<f64>| a * stage.effective.0 + &stage.effective.1;
        let temperatures = |a: &DVector<f64>| level.temperatures(network, load, a, Some(&self.temperatures));
        // Films from the temperatures expected halfway, as in the full network.
        let mut walls = temperatures(&effective(&guess));
        let states = network.stream_states(stage.middle, &walls)?;
        let streams = Streams::new(network, &states, stage.duration, &self.water, inflows(stage.begin, load));
        let mut rings = DMatrix::zeros(level.len(), level.len() + 1);
        for (s, ring) in level.rings.iter().enumerate() {
            ring.add(ring.points.iter().map(|k| streams.weight(s)[*k]), &mut rings);
        }
        for (s, family) in level.drifts.iter().enumerate() {
            family.add(drift(family, &states[s], streams.weight(s)), &mut rings);
        }
        let known = rings.column(level.len()) - &level.capacity * &self.amplitudes + &stage.earlier;
        let mut a = guess;
        let mut t = temperatures(&a);
        let (mut last, mut before_last) = (f64::INFINITY, f64::INFINITY);
        for iterations in 0..MOST_ITERATIONS {
            let along = effective(&a);
            level.set_walls(&states, &along, &mut walls);
            let passed = streams.carry(&|n| walls[n]);
            let leaving = self.leaving(&a, &t, stage.now);
            let mut open = &known + &leaving * stage.own;
            open.gemv(1.0, &level.capacity, &a, 1.0);
            open.gemv(1.0, &rings.columns(0, level.len()), &along, 1.0);
            let heats = DVector::from_iterator(level.walls.ncols(), passed.iter().flat_map(|p| p.heat.iter().map(|heat| -heat)));
            level.take(&states, &heats, stage.duration, &mut open);
            // What is left shrinks as it did in the last step.
            let shrinks = if before_last.is_finite() { (last / before_last).min(1.0) } else { 1.0 };
            if last * shrinks < SOLVED * self.tolerance {
                let water = streams.moved(&passed, &mut t).parcels;
                return Ok(Taken { amplitudes: a, temperatures: t, leaving, water, iterations });
            }
            let Some(step) = lu.solve(&open).filter(|s| s.iter().all(|v| v.is_finite())) else { break };
            a -= &step;
            let before = std::mem::replace(&mut t, temperatures(&a));
            before_last = last;
            last = t[..network.solids].iter().zip(&before).fold(level.largest_reading(&step), |most, (t, b)| most.max((t - b).abs()));
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
        let leaving = self.leaving(&self.amplitudes, &self.temperatures, now);
        let rate = self.level.capacity.clone().lu().solve(&leaving).map_or(f64::INFINITY, |rate| self.level.largest(&rate));
        if rate > 0.0 { (5.0 * self.tolerance / rate).clamp(SHORTEST, FIRST) } else { FIRST }
    }

    /// As that of the full network: from the third divided difference, or a tenth of the second where no state before tells of it.
    fn local_error(&self, h: f64, between: &DVector<f64>, after: &DVector<f64>) -> f64 {
        let (a, b) = (GAMMA * h, h);
        let (d1, d2) = ((between - &self.amplitudes) / a, (after - between) / (b - a));
        let second = (&d2 - &d1) / b;
        let error = match &self.before {
            Some((before, last)) if *last >= TELLING * h => {
                let d0 = (&self.amplitudes - before) / *last;
                (second - (&d1 - d0) / (a + last)) * (LOCAL_ERROR * 6.0 * h * h * h / (b + last))
            }
            _ => second * (0.1 * h * h),
        };
        self.level.largest(&error)
    }
}
