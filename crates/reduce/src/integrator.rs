//! A reduced network over time: TR-BDF2 on the amplitudes of the modes, the method of the full network. Water moves as parcels
//! along the walls of all stations, by the law of the full network.

use std::rc::Rc;

use nalgebra::{DMatrix, DVector, Dyn, LU};

use super::conductors::conductors;
use super::reduced_network::{ConstantTerms, ReducedNetwork, ReducedState};
use super::storing::Storing;
use super::water::Along;
use coldplate_base::error::{Error, Result, Stop};
use coldplate_network::mesh::path::Station;
use coldplate_network::{Load, Network, SensorTerm};
use coldplate_solve::transient::parcels::Parcels;
use coldplate_solve::transient::tr_bdf2::{EARLIER, GAMMA, LOCAL_ERROR, OWN, parabola};
use coldplate_solve::transient::water::{Streams, inflows, residence};
use coldplate_solve::transient::{even_water, steady_water};

/// Most steps of the iteration within a stage, a count. Chosen: a stage that needs more is cheaper with a shorter
/// time step.
const MOST_ITERATIONS: usize = 25;
/// Number of iterations of a stage above which the matrix is computed anew. Chosen: a matrix costs more than a few
/// iterations.
const SLOW: usize = 6;
/// Factor, dimensionless, on the contraction ratio of the last stage, for the first iteration of the next one.
/// Chosen: a stage may converge worse than the one before.
const WORSE: f64 = 3.0;
/// Accuracy of a stage's solution as a share of the tolerance of a step. Chosen: small enough not to disturb the
/// estimated error of a step.
const SOLVED: f64 = 1e-2;
/// Shortest time step that is tried again, s. Chosen: far below any time constant of a machine.
const SHORTEST: f64 = 1e-6;
/// Instants nearer than this count as reached, s. Chosen: above rounding of the time, below any step.
const SAME_INSTANT: f64 = 1e-9;
/// Least length of the last time step, as a share of the next one, from which a curvature is estimated. Chosen:
/// slivers of steps tell nothing of how the next one bends.
const TELLING: f64 = 0.1;
/// Longest first time step, s. Chosen: long ones are found within a few steps.
const FIRST: f64 = 60.0;

/// The matrix of both stages of a step.
struct Factors {
    /// Length of the step, s.
    length: f64,
    lu: LU<f64, Dyn, Dyn>,
    /// Derivatives of the heat that leaves the modes, W/K, with which the matrix was made.
    slopes: DMatrix<f64>,
    /// Contraction ratio that is assumed of the iteration, at most 1.
    shrinks: f64,
}

impl Factors {
    /// Takes note of how quickly the iteration of a stage converged.
    fn saw(&mut self, taken: &Taken) {
        if let Some(shrank) = taken.shrank {
            self.shrinks = (WORSE * shrank).min(1.0);
        }
    }
}

/// A load with the parts of the equations that depend on it alone.
struct Now {
    load: Load,
    given: ConstantTerms,
}

/// A stage: M (a - start) + earlier + own R(a) = heat from the water along walls at the effective amplitudes.
struct Stage<'s> {
    /// Time from the beginning of the step to the end of the stage, s.
    duration: f64,
    /// Weight of the heat that leaves at the end of the stage, s.
    own: f64,
    /// Heat that left before, J.
    earlier: DVector<f64>,
    /// Amplitudes that the walls have for the water: weight of the amplitudes at the end, and the part from known
    /// ones.
    effective: (f64, DVector<f64>),
    /// Load at the beginning of the step.
    begin: &'s Load,
    /// Load halfway through the stage, whose flow carries the water.
    middle: &'s Load,
    /// Load at the end of the stage.
    now: &'s Now,
}

/// Result of a stage.
struct Taken {
    amplitudes: DVector<f64>,
    temperatures: Vec<f64>,
    /// Heat that leaves the modes there except through the water, W.
    leaving: DVector<f64>,
    water: Vec<Parcels>,
    /// Number of iterations.
    iterations: usize,
    /// Ratio of the last two steps of the iteration, if there were two.
    shrank: Option<f64>,
}

/// A time step that was tried.
struct Tried {
    /// Amplitudes and temperatures at the end of its first stage.
    between: (DVector<f64>, Vec<f64>),
    taken: Taken,
    /// The load at the end of the step.
    end: Rc<Now>,
}

/// The last step taken: amplitudes at its beginning and after its first stage, and its length, s.
struct Before {
    begin: DVector<f64>,
    between: DVector<f64>,
    length: f64,
}

/// Readings of all sensors (K) at ascending times (s).
pub type Path = Vec<(f64, Vec<f64>)>;

/// A reduced network at the time of an output.
pub(crate) struct Output {
    /// Readings of all sensors, K.
    pub readings: Vec<f64>,
    /// Amplitudes of the modes, K.
    pub amplitudes: DVector<f64>,
}

/// The load at a time, s.
type LoadAt<'l> = dyn Fn(f64) -> Result<Load> + 'l;

/// State of a reduced network at one instant of a run.
pub(crate) struct Motion<'a> {
    level: &'a ReducedNetwork,
    network: &'a Network,
    /// Modes that store heat, and those in balance at once.
    storing: Storing,
    /// Error allowed in a step, K.
    tolerance: f64,
    /// Time, s.
    pub time: f64,
    /// Amplitudes of the modes, K.
    pub amplitudes: DVector<f64>,
    /// Temperatures of the sampled network, K, water at the ends of the stations.
    temperatures: Vec<f64>,
    /// Water in each stream from inlet to outlet.
    water: Vec<Parcels>,
    step: f64,
    /// The load at this instant.
    now: Option<Rc<Now>>,
    /// Heat that leaves the modes at this instant except through the water, W; kept as long as the load is the one of
    /// `now`.
    leaving: Option<DVector<f64>>,
    /// The matrix of the last step, kept as long as the iteration converges quickly with it.
    factors: Option<Factors>,
    /// Coupling of the water to the modes in the last stage.
    along: Option<Rc<Along>>,
    /// Whether readings of water were far from straight in the last step.
    lands: bool,
    /// The last step.
    before: Option<Before>,
    /// Steps taken.
    pub steps: usize,
}

impl<'a> Motion<'a> {
    /// A run that begins in a steady state at `time` (s).
    pub fn from_steady(level: &'a ReducedNetwork, load: &Load, state: ReducedState, time: f64, tolerance: f64) -> Self {
        let water = steady_water(&level.network, load, &state.streams, &state.temperatures);
        Self::new(level, state.amplitudes, state.temperatures, water, time, tolerance)
    }

    /// A run that begins with one temperature (K) everywhere, but for what stores no heat.
    ///
    /// # Errors
    /// Modes that store no heat find no balance.
    pub(crate) fn from_uniform(level: &'a ReducedNetwork, load: &Load, temperature: f64, time: f64, tolerance: f64) -> Result<Self> {
        let network = &level.network;
        let still = vec![temperature; network.nodes];
        let amplitudes = Storing::of(&level.capacity).amplitudes(&level.uniform(temperature));
        let temperatures = level.temperatures(network, load, &amplitudes, Some(&still));
        let mut begun = Self::new(level, amplitudes, temperatures, even_water(network, temperature), time, tolerance);
        begun.settle(load, &level.given(network, load))?;
        Ok(begun)
    }

    /// A run that begins with these amplitudes, the temperatures that follow from them, and the water in the streams.
    fn new(
        level: &'a ReducedNetwork,
        amplitudes: DVector<f64>,
        temperatures: Vec<f64>,
        water: Vec<Parcels>,
        time: f64,
        tolerance: f64,
    ) -> Self {
        Self {
            level,
            network: &level.network,
            storing: Storing::of(&level.capacity),
            tolerance,
            time,
            amplitudes,
            temperatures,
            water,
            step: 0.0,
            now: None,
            leaving: None,
            factors: None,
            along: None,
            lands: false,
            before: None,
            steps: 0,
        }
    }

    /// Readings of all sensors, K.
    pub fn read(&self, load: &Load) -> Vec<f64> {
        self.level.readings_of(self.network, load, &self.amplitudes, &self.temperatures)
    }

    /// The network at this instant, under the load that its sensors see.
    pub fn output(&self, load: &Load) -> Output {
        Output { readings: self.read(load), amplitudes: self.amplitudes.clone() }
    }

    /// Advances to `until` (s), from one corner of the condition to the next: `load` must be smooth until then. Returns the network at
    /// ascending `outputs`, its readings under the load that they see there. Within a step they are read from the parabola
    /// through its three states. Steps end at the outputs while water from before the corner may be in the channels, because fronts may
    /// pass, and while readings of water are far from straight. `path` takes in the readings now and at the end of every step.
    ///
    /// # Errors
    /// A condition cannot be evaluated, or no step is short enough.
    pub fn advance(&mut self, until: f64, load: &LoadAt<'_>, outputs: &[f64], seen: &LoadAt<'_>, path: &mut Path) -> Result<Vec<Output>> {
        // Slopes from before a corner say nothing about the time after it.
        self.before = None;
        let mut reached_outputs = Vec::with_capacity(outputs.len());
        let mut now = self.now(load(self.time)?, self.now.as_ref());
        self.leaving = self.leaving.take().filter(|_| self.now.as_ref().is_some_and(|before| Rc::ptr_eq(before, &now)));
        self.settle(&now.load, &now.given)?;
        if self.step <= 0.0 {
            self.step = self.first_step(&now);
        }
        path.push((self.time, self.read(&now.load)));
        let residence = |load: &Load| residence(self.network, load, &self.temperatures, &self.water);
        let even = self.time + residence(&now.load)?.max(residence(&load(until)?)?);
        while until - self.time > SAME_INSTANT {
            while let Some(time) = outputs.get(reached_outputs.len()).filter(|time| **time - self.time <= SAME_INSTANT) {
                reached_outputs.push(self.output(&seen(*time)?));
            }
            let output = outputs.get(reached_outputs.len()).copied();
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
            while let Some(time) = outputs.get(reached_outputs.len()).filter(|time| **time <= self.time) {
                let [first, second, third] = parabola((time - begun) / h);
                let a = first * &amplitudes + second * &between.0 + third * &self.amplitudes;
                let states = temperatures.iter().zip(&between.1).zip(&self.temperatures);
                let t: Vec<f64> = states.map(|((begin, between), end)| first * begin + second * between + third * end).collect();
                let readings = self.level.readings_of(self.network, &seen(*time)?, &a, &t);
                reached_outputs.push(Output { readings, amplitudes: a });
            }
            self.before = Some(Before { begin: amplitudes, between: between.0, length: h });
            self.steps += 1;
            let grown = if growth > 1.05 { h * growth.min(2.5) } else { h * growth.clamp(0.5, 1.0) };
            self.step = if is_last { self.step.max(grown) } else { grown };
            now = end;
            path.push((self.time, self.read(&now.load)));
        }
        for time in &outputs[reached_outputs.len()..] {
            reached_outputs.push(self.output(&seen(*time)?));
        }
        self.time = until;
        self.now = Some(now);
        Ok(reached_outputs)
    }

    /// Brings modes that store no heat into balance, which a jump of the condition upsets.
    fn settle(&mut self, load: &Load, given: &ConstantTerms) -> Result<()> {
        if self.storing.is_whole() {
            return Ok(());
        }
        self.leaving = None;
        let within = (SOLVED * self.tolerance, self.time);
        self.level.settle(&self.storing, (load, given), within, &mut self.amplitudes, &mut self.temperatures)
    }

    /// A load with the parts of the equations that depend on it; taken from `known` if the load has not changed.
    fn now(&self, load: Load, known: Option<&Rc<Now>>) -> Rc<Now> {
        match known.filter(|known| known.load == load) {
            Some(known) => Rc::clone(known),
            None => {
                let given = self.level.given(self.network, &load);
                Rc::new(Now { load, given })
            }
        }
    }

    /// Largest distance, K, of a reading after the first stage from the straight line between beginning and end of a
    /// step.
    fn unevenness(&self, between: &[f64], end: &[f64], load: &Load) -> f64 {
        let uneven = |sensor: &SensorTerm| {
            let [begin, between, end] = [&self.temperatures, between, end].map(|t| sensor.read(t, load));
            (between - begin - GAMMA * (end - begin)).abs()
        };
        self.network.sensors.iter().map(uneven).fold(0.0, f64::max)
    }

    /// Heat that leaves the modes at some amplitudes and their temperatures, except through the water, W.
    fn leaving(&self, a: &DVector<f64>, temperatures: &[f64], now: &Now) -> DVector<f64> {
        self.level.solid_residual(&now.given, &conductors(self.network, &now.load, temperatures), a)
    }

    /// One step of length `h`, and its estimated error, K.
    fn try_step(&mut self, h: f64, now: &Rc<Now>, load: &LoadAt<'_>) -> Result<(Tried, f64)> {
        let at = |share: f64, known: &Rc<Now>| load(self.time + share * h).map(|load| self.now(load, Some(known)));
        let between = at(GAMMA, now)?;
        let end = at(1.0, &between)?;
        let (early, middle) = (load(self.time + 0.5 * GAMMA * h)?, load(self.time + 0.5 * h)?);
        let start = &self.amplitudes.clone();
        // One matrix serves both stages, because the weight of the heat at the end is the same in both.
        let mut factors = match self.factors.take() {
            Some(known) if known.length == h => known,
            known => {
                let (slopes, shrinks) = known.map_or_else(|| Ok((self.slopes(now)?, 1.0)), |known| Ok((known.slopes, known.shrinks)))?;
                Factors { length: h, lu: (&self.level.capacity + &slopes * (OWN * h)).lu(), slopes, shrinks }
            }
        };
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
        let middle_states = self.stage(&factors, &first, self.ahead(h))?;
        factors.saw(&middle_states);
        let Taken { amplitudes: first, temperatures, leaving, .. } = middle_states;
        let second = Stage {
            duration: h,
            own: OWN * h,
            earlier: (&begin + leaving) * (EARLIER * h),
            effective: (OWN, (start + &first) * EARLIER),
            begin: &now.load,
            middle: &middle,
            now: &end,
        };
        let taken = self.stage(&factors, &second, self.onward(h, &first))?;
        factors.saw(&taken);
        let error = self.local_error(&factors, &first, &taken.amplitudes);
        // A matrix with which the iteration has become slow is dropped.
        self.factors = (taken.iterations <= SLOW).then_some(factors);
        Ok((Tried { between: (first, temperatures), taken, end }, error))
    }

    /// Derivatives of the heat that leaves the modes now, W/K.
    fn slopes(&self, now: &Now) -> Result<DMatrix<f64>> {
        let acting = conductors(self.network, &now.load, &self.temperatures);
        let streams = self.network.stream_states(&now.load, &self.temperatures)?;
        let water = self.level.channels().alongside(&streams);
        Ok(self.level.jacobian(self.network, &streams, &water, &now.given, &acting))
    }

    /// Solves M (a - start) + earlier + own R(a) = heat from the water.
    fn stage(&mut self, factors: &Factors, stage: &Stage<'_>, guess: DVector<f64>) -> Result<Taken> {
        let (level, network, load) = (self.level, self.network, &stage.now.load);
        let effective = |a: &DVector<f64>| a * stage.effective.0 + &stage.effective.1;
        // Films at the temperatures expected halfway, as in the full network.
        let mut walls = self.temperatures.clone();
        level.set_walls(network, &effective(&guess), &mut walls);
        let states = network.stream_states(stage.middle, &walls)?;
        let streams = Streams::new(network, &states, stage.duration, &self.water, inflows(stage.begin, load));
        let weights: Vec<f64> = (0..states.len()).flat_map(|s| streams.weight(s)).copied().collect();
        let water = level.channels().alongside_over(&states, &weights, self.along.as_ref());
        self.along = Some(Rc::clone(&water.along));
        // Linear part of the equations, and the part that does not depend on the amplitudes.
        let given = &stage.now.given;
        let around = water.around.columns(0, level.len());
        let linear = &level.capacity + &given.linear * stage.own + around * stage.effective.0;
        let mut known = &stage.earlier + &given.constant * stage.own + water.around.column(level.len());
        known.gemv(-1.0, &level.capacity, &self.amplitudes, 1.0);
        known.gemv(1.0, &around, &stage.effective.1, 1.0);
        let outside = network.solids - level.walls.ncols();
        let mut a = guess;
        let mut t = self.temperatures.clone();
        level.set_outside(network, load, &a, &mut t);
        let mut felt = water.walls(&effective(&a));
        let (mut last, mut before_last) = (f64::INFINITY, f64::INFINITY);
        for iterations in 0..MOST_ITERATIONS {
            stations(network).zip(felt.iter()).for_each(|(station, felt)| walls[station.cells[0].0] = *felt);
            let passed = streams.carry(&|n| walls[n]);
            let beyond = level.beyond(given, &conductors(network, load, &t));
            // The next step is predicted to be shorter by the last ratio. A step may be small by chance, in directions that earlier
            // steps did not take, so that none above the tolerance is the last one.
            let shrank = before_last.is_finite().then(|| (last / before_last).min(1.0));
            if last * shrank.unwrap_or(factors.shrinks).max(SOLVED) < SOLVED * self.tolerance {
                let mut leaving = beyond + &given.constant;
                leaving.gemv(1.0, &given.linear, &a, 1.0);
                level.set_walls(network, &a, &mut t);
                let water = streams.moved(&passed, &mut t).parcels;
                return Ok(Taken { amplitudes: a, temperatures: t, leaving, water, iterations, shrank });
            }
            let mut open = &known + beyond * stage.own;
            open.gemv(1.0, &linear, &a, 1.0);
            let heats = DVector::from_iterator(felt.len(), passed.iter().flat_map(|p| p.heat.iter().map(|heat| -heat)));
            water.take(&heats, stage.duration, &mut open);
            let Some(step) = factors.lu.solve(&open).filter(|s| s.iter().all(|v| v.is_finite())) else { break };
            a -= &step;
            let before = (t[..outside].to_vec(), std::mem::replace(&mut felt, water.walls(&effective(&a))));
            level.set_outside(network, load, &a, &mut t);
            before_last = last;
            let moved = t.iter().zip(&before.0).fold(level.largest_reading(&step), |most, (t, b)| most.max((t - b).abs()));
            last = felt.iter().zip(before.1.iter()).fold(moved, |most, (t, b)| most.max((t - b).abs() / stage.effective.0));
        }
        Err(Error::stopped(Stop::MostNewtonSteps, format!("a step of the reduced model does not converge at {:.3} s", self.time)))
    }

    /// Amplitudes expected after the first stage of a step of length `h`: on the parabola of the last step, but extrapolated by no
    /// more than its length.
    fn ahead(&self, h: f64) -> DVector<f64> {
        match &self.before {
            Some(Before { begin, between, length }) => {
                let [first, second, third] = parabola(1.0 + (GAMMA * h / length).min(1.0));
                first * begin + second * between + third * &self.amplitudes
            }
            None => self.amplitudes.clone(),
        }
    }

    /// Amplitudes expected at the end of a step, if those `between` are known: on the parabola through both and the amplitudes
    /// before the last step.
    fn onward(&self, h: f64, between: &DVector<f64>) -> DVector<f64> {
        let rise = (between - &self.amplitudes) / GAMMA;
        match &self.before {
            Some(Before { begin, length, .. }) if *length >= TELLING * h => {
                let rate = (&self.amplitudes - begin) * (h / length);
                let bend = (&rise - &rate) / (GAMMA + length / h);
                &self.amplitudes + rise + bend * (1.0 - GAMMA)
            }
            _ => &self.amplitudes + rise,
        }
    }

    /// First step, s: no reading or temperature moves by more than a few tolerances in it.
    fn first_step(&self, now: &Now) -> f64 {
        let leaving = self.leaving(&self.amplitudes, &self.temperatures, now);
        let rate = self.level.largest(&self.storing.amplitudes(&leaving));
        if rate > 0.0 { (5.0 * self.tolerance / rate).clamp(SHORTEST, FIRST) } else { FIRST }
    }

    /// Estimated local error, K, by the formula of the full network: from the third divided difference, or a tenth of the second if no
    /// earlier state is known. Parts that store no heat may jump (two parcels of water that become one) and have no error of their own.
    /// Therefore the difference goes through the matrix of the stages (Hosea and Shampine, Appl. Numer. Math. 20 (1996) 21).
    fn local_error(&self, factors: &Factors, between: &DVector<f64>, after: &DVector<f64>) -> f64 {
        let h = factors.length;
        let (a, b) = (GAMMA * h, h);
        let (d1, d2) = ((between - &self.amplitudes) / a, (after - between) / (b - a));
        let second = (&d2 - &d1) / b;
        let error = match &self.before {
            Some(Before { begin, length: last, .. }) if *last >= TELLING * h => {
                let d0 = (&self.amplitudes - begin) / *last;
                (second - (&d1 - d0) / (a + last)) * (LOCAL_ERROR * 6.0 * h * h * h / (b + last))
            }
            _ => second * (0.1 * h * h),
        };
        factors.lu.solve(&(&self.level.capacity * error)).map_or(f64::INFINITY, |error| self.level.largest(&error))
    }
}

/// The stations of all streams.
fn stations(network: &Network) -> impl Iterator<Item = &Station> {
    network.streams.iter().flat_map(|stream| &stream.stations)
}
