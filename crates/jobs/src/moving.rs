//! Surrogates over time: the dynamics of a reduced model in few states, put into the file of a surrogate, and schedules run
//! through it.

use coldplate_runtime::{State, Surrogate as Opened};

use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::significant;
use coldplate_base::progress::Progress;
use coldplate_base::random::Random;
use coldplate_base::units::{self, Dimension, Measurand};
use coldplate_describe::machine::{Condition, Limit, LimitKind, Machine, Variable};
use coldplate_explore::schedule::Quantities;
use coldplate_explore::simulate::{Follower, Start, Subject};
use coldplate_explore::sweep::design;
use coldplate_reduce::{Beginning, ReducedModel, Stretch};
use coldplate_surrogate::fit::file;
use coldplate_surrogate::fit::in_time::Sample;
use coldplate_surrogate::fit::model::{InTime, Point, Surrogate};

/// Number of states of the dynamics, at most. Chosen: more states are more accurate, but a step costs their third
/// power.
const STATES: usize = 24;
/// Number of conditions that the dynamics are fitted to, beside the corners of the range. Chosen: more than the
/// polynomials have terms, each costs a linearised reduced model.
const CONDITIONS: usize = 200;
/// Most variables whose corners are taken, a count. Chosen: the number of corners doubles with each.
const MOST_CORNERED: usize = 6;
/// Seed of the conditions and histories, a number without meaning.
const SEED: u64 = 11;
/// Number of random histories that the error over time is taken from. Chosen: each costs a run of the reduced model.
const HISTORIES: usize = 8;
/// Number of stretches of one condition in each history. Chosen as for the histories of the reduced model.
const STRETCHES: usize = 5;
/// Shortest and longest stretch, in slowest time constants. Chosen: from a change that only fast states follow to one that
/// mostly settles.
const LENGTHS: (f64, f64) = (0.01, 1.0);
/// Number of outputs in a stretch. Chosen: dense enough to meet the largest error.
const OUTPUTS: usize = 24;
/// Time of the first output after the beginning of a stretch, s. Chosen: early enough for the fastest response.
const FIRST: f64 = 1.0;
/// Unit of displacements.
const LENGTHS_IN: &str = "um";
/// Temperature that histories begin at if no point is a temperature, in degC. Chosen: a usual room.
const ROOM: f64 = 20.0;
/// Factor on the largest error in the histories, dimensionless. Chosen: other histories may be worse, larger widens
/// every band.
const SAFETY: f64 = 1.5;

/// Adds dynamics to a surrogate, from a reduced model that was made with histories.
///
/// # Errors
/// The model knows steady states only, or was not made for the range of the surrogate or its held values; a point is no
/// temperature sensor of the model; the dynamics cannot be fitted.
pub fn with_dynamics(surrogate: &mut Surrogate, model: &ReducedModel, progress: &dyn Progress) -> Result<()> {
    let Some(known) = &model.in_time else {
        return Err(Error::input("this reduced model knows steady states only").help("make it with `coldplate reduce MACHINE --histories`"));
    };
    let places = Places::of(surrogate, &model.machine)?;
    let varied: Vec<usize> =
        (0..surrogate.variables.len()).filter(|v| surrogate.variables[*v].high > surrogate.variables[*v].low).collect();
    let at = |shares: &[f64]| -> Vec<f64> {
        let mut x: Vec<f64> = surrogate.variables.iter().map(|v| v.low).collect();
        for (v, share) in varied.iter().zip(shares) {
            x[*v] += share * (surrogate.variables[*v].high - x[*v]);
        }
        x
    };
    progress.at("fitting the dynamics of the machine");
    let mut shares = design::latin_hypercube(CONDITIONS, varied.len(), SEED);
    if varied.len() <= MOST_CORNERED {
        shares.extend(design::corners(varied.len()));
    }
    let xs: Vec<Vec<f64>> = shares.iter().map(|s| at(s)).collect();
    let conditions: Vec<Condition> = xs.iter().map(|x| places.condition(x)).collect::<Result<_>>()?;
    if let Some(outside) = conditions.iter().find(|c| !model.is_inside(c)) {
        return Err(Error::input("the reduced model was not made for all conditions of this surrogate")
            .read(outside.words(&model.machine))
            .help("make it for the ranges of the sweep: `coldplate reduce MACHINE --range ... --histories`"));
    }
    let slow = model.slow(&conditions, STATES)?;
    let samples: Vec<Sample> = (slow.samples.iter().zip(&xs))
        .map(|(own, x)| Sample {
            x: x.clone(),
            steady: own.steady.iter().copied().collect(),
            rates: own.rates.iter().copied().collect(),
            outputs: places.sensors.iter().flat_map(|s| own.outputs.row(*s).iter().copied().collect::<Vec<_>>()).collect(),
        })
        .collect();
    // The points are in degC or in K.
    let zero = places.kelvin(0.0);
    let uniform = [(&slow.uniform[0] + &slow.uniform[1] * zero).iter().copied().collect(), slow.uniform[1].iter().copied().collect()];
    let mut found = InTime::fit(surrogate, &samples, uniform)?;
    progress.at(&format!("comparing with {HISTORIES} random histories of the reduced model"));
    let bytes = file::encode(&Surrogate { in_time: Some(found.clone()), ..surrogate.clone() })?;
    let mut worst = vec![0.0; surrogate.points.len()];
    let mut random = Random::new(SEED);
    for number in 0..HISTORIES {
        let trial = Trial::random(number, slow.slowest, &mut random, &at, varied.len());
        for (worst, error) in worst.iter_mut().zip(trial.errors(&bytes, model, &places)?) {
            *worst = f64::max(*worst, error);
        }
    }
    found.errors = worst.iter().map(|error| SAFETY * error + known.largest_error).collect();
    surrogate.provenance.push(("dynamics".into(), format!("{} states, from a reduced model of {}", found.states, model.machine.name)));
    surrogate.in_time = Some(found);
    Ok(())
}

/// The surrogate's variables and points in a machine.
struct Places<'a> {
    machine: &'a Machine,
    /// For each variable of the machine: index of the surrogate's variable, or the held value (SI).
    values: Vec<std::result::Result<usize, f64>>,
    units: Vec<String>,
    /// Sensor of each point.
    sensors: Vec<usize>,
    /// Whether each point is a displacement, in um.
    lengths: Vec<bool>,
    /// Unit of the temperatures.
    unit: String,
}

impl<'a> Places<'a> {
    fn of(surrogate: &Surrogate, machine: &'a Machine) -> Result<Self> {
        for name in surrogate.variables.iter().map(|v| &v.name).chain(surrogate.held.iter().map(|h| &h.name)) {
            if machine.variables.iter().all(|v| v.name != *name) {
                return Err(Error::input(format!("the reduced model has no variable '{name}'")).help("take that of the same machine"));
            }
        }
        let value = |variable: &Variable| {
            if let Some(own) = surrogate.variables.iter().position(|v| v.name == variable.name) {
                return Ok(Ok(own));
            }
            if let Some(held) = surrogate.held.iter().find(|h| h.name == variable.name) {
                return Ok(Err(units::convert(held.value, &held.unit, variable.dimension)?));
            }
            let missing = || Error::input(format!("the surrogate says nothing of '{}', which has no default", variable.name));
            variable.default.map(Err).ok_or_else(missing)
        };
        let sensor = |point: &Point| {
            let found = machine.sensors.iter().position(|s| s.name == point.name);
            found.ok_or_else(|| {
                Error::input(format!("the reduced model has no sensor '{}'", point.name)).help("leave it out of the table with --ignore")
            })
        };
        let unit = surrogate.points.iter().find(|p| p.unit != LENGTHS_IN).map_or("degC".into(), |p| p.unit.clone());
        let is_known = |p: &&Point| p.unit == LENGTHS_IN || p.unit == unit && ["degC", "K"].contains(&p.unit.as_str());
        if let Some(other) = surrogate.points.iter().find(|p| !is_known(p)) {
            let error = Error::input(format!("'{}' is in {}", other.name, other.unit));
            return Err(error.help("dynamics are known of temperatures, all of them in degC or all in K, and of displacements in um"));
        }
        Ok(Self {
            machine,
            values: machine.variables.iter().map(value).collect::<Result<_>>()?,
            units: surrogate.variables.iter().map(|v| v.unit.clone()).collect(),
            sensors: surrogate.points.iter().map(sensor).collect::<Result<_>>()?,
            lengths: surrogate.points.iter().map(|p| p.unit == LENGTHS_IN).collect(),
            unit,
        })
    }

    /// The machine's condition, from values in the surrogate's units.
    fn condition(&self, x: &[f64]) -> Result<Condition> {
        let si = |(variable, value): (&Variable, &std::result::Result<usize, f64>)| match value {
            Ok(own) => units::convert(x[*own], &self.units[*own], variable.dimension),
            Err(held) => Ok(*held),
        };
        Ok(Condition::from_si(self.machine.variables.iter().zip(&self.values).map(si).collect::<Result<_>>()?))
    }

    /// A point's value in the unit of its sensor, K or um.
    fn reading(&self, point: usize, value: f64) -> f64 {
        if self.lengths[point] { value } else { self.kelvin(value) }
    }

    /// A temperature in the points' unit, in K.
    fn kelvin(&self, value: f64) -> f64 {
        units::convert(value, &self.unit, Dimension::TEMPERATURE).unwrap_or(value)
    }
}

/// A random history of conditions, in the surrogate's units.
struct Trial {
    /// Whether everything begins at the coldest reading of the first steady state; otherwise it begins in that state.
    is_uniform: bool,
    /// Conditions, each with its length, s.
    stretches: Vec<(Vec<f64>, f64)>,
}

impl Trial {
    fn random(number: usize, slowest: f64, random: &mut Random, at: &dyn Fn(&[f64]) -> Vec<f64>, varied: usize) -> Self {
        let stretch = |_| {
            let shares: Vec<f64> = (0..varied).map(|_| random.unit()).collect();
            let length = slowest * LENGTHS.0 * (LENGTHS.1 / LENGTHS.0).powf(random.unit());
            (at(&shares), length.max(10.0 * FIRST))
        };
        Self { is_uniform: number % 2 == 1, stretches: (0..STRETCHES).map(stretch).collect() }
    }

    /// Largest difference of each point between the surrogate and the finer network of the model.
    fn errors(&self, bytes: &[u8], model: &ReducedModel, places: &Places<'_>) -> Result<Vec<f64>> {
        let surrogate = file::open(bytes)?;
        let broken = |e: coldplate_runtime::StepError| Error::numerics(format!("the dynamics cannot be followed: {e}"));
        let mut values = vec![0.0; surrogate.point_count()];
        let first = &self.stretches[0].0;
        let mut state = surrogate.at_rest(first).map_err(broken)?;
        let mut beginning = Beginning::Steady;
        if self.is_uniform {
            surrogate.read(&state, first, &mut values).map_err(broken)?;
            let temperatures = values.iter().zip(&places.lengths).filter(|(_, is_length)| !**is_length);
            let coldest = temperatures.map(|(value, _)| *value).reduce(f64::min).unwrap_or(ROOM);
            state = surrogate.at_temperature(coldest).map_err(broken)?;
            beginning = Beginning::Uniform(places.kelvin(coldest));
        }
        let (mut stretches, mut from) = (Vec::new(), 0.0);
        for (x, length) in &self.stretches {
            let condition = places.condition(x)?;
            let time = |k: usize| from + FIRST * (length / FIRST).powf(k as f64 / (OUTPUTS - 1) as f64);
            let outputs: Vec<f64> = (0..OUTPUTS).map(time).collect();
            from = outputs[OUTPUTS - 1];
            stretches.push(Stretch { until: from, condition: Box::new(move |_| condition.clone()), at_end: None, outputs });
        }
        let course = model.course(beginning, 0.0, &stretches)?;
        let mut worst = vec![0.0; values.len()];
        let (mut now, mut row) = (0.0, 1);
        for ((x, _), stretch) in self.stretches.iter().zip(&stretches) {
            for time in &stretch.outputs {
                surrogate.step(&mut state, time - now, x).map_err(broken)?;
                surrogate.read(&state, x, &mut values).map_err(broken)?;
                for (k, (worst, sensor)) in worst.iter_mut().zip(&places.sensors).enumerate() {
                    *worst = f64::max(*worst, (places.reading(k, values[k]) - course.readings[row][*sensor]).abs());
                }
                (now, row) = (*time, row + 1);
            }
        }
        Ok(worst)
    }
}

/// A surrogate that runs through a schedule.
pub struct Moving<'a> {
    surrogate: &'a Opened<'a>,
    state: Option<State>,
    /// Variables of a query, then the held ones.
    variables: Vec<Variable>,
    points: Vec<String>,
    measurands: Vec<Measurand>,
    limits: Vec<Limit>,
    hash: String,
}

impl<'a> Moving<'a> {
    /// # Errors
    /// A surrogate of steady states only, or with points that are neither temperatures nor displacements.
    pub fn new(surrogate: &'a Opened<'a>) -> Result<Self> {
        if surrogate.in_time().is_none() {
            return Err(Error::input("this surrogate knows steady states only")
                .help("make it with `coldplate fit TABLE --dynamics MODEL.cpr`, the model by `coldplate reduce MACHINE --histories`"));
        }
        let measurand = |point: coldplate_runtime::Point<'_>| match point.unit {
            "degC" | "K" => Ok(Measurand::Temperature),
            LENGTHS_IN => Ok(Measurand::Displacement),
            unit => Err(Error::input(format!("'{}' is in {unit}: it is neither a temperature nor a displacement in um", point.name))),
        };
        let variable = |name: &str, unit: &str, default: Option<f64>| -> Result<Variable> {
            let dimension = units::dimension_of(unit)?;
            let default = default.map(|v| units::convert(v, unit, dimension)).transpose()?;
            Ok(Variable { name: name.into(), unit: unit.into(), dimension, default, range: None })
        };
        let own = surrogate.variables().map(|v| variable(v.name, v.unit, None));
        let held = surrogate.held().map(|h| variable(h.name, h.unit, Some(h.value)));
        Ok(Self {
            surrogate,
            state: None,
            variables: own.chain(held).collect::<Result<_>>()?,
            points: surrogate.points().map(|p| p.name.to_string()).collect(),
            measurands: surrogate.points().map(measurand).collect::<Result<_>>()?,
            limits: surrogate.limits().map(|limit| limit_of(surrogate, limit)).collect::<Result<_>>()?,
            hash: surrogate.provenance().find(|(key, _)| *key == "machine_hash").map_or(String::new(), |(_, hash)| hash.to_string()),
        })
    }

    /// Quantities that a schedule may name.
    pub fn quantities(&self) -> Quantities<'_> {
        Quantities { variables: &self.variables, sensors: self.points.iter().map(String::as_str).collect(), heat_flows: Vec::new() }
    }

    /// An error of a schedule that states some variables. If values of others are missing, the remedy is one that suits a
    /// surrogate, which holds no defaults.
    #[must_use]
    pub fn without_defaults(&self, error: Error, is_stated: impl Fn(&str) -> bool) -> Error {
        let own = self.surrogate.variables().filter(|v| !is_stated(v.name));
        let missing: Vec<coldplate_runtime::Variable<'_>> = own.collect();
        let names = missing.iter().map(|v| v.name).collect::<Vec<_>>().join(", ");
        let (Some(first), true) = (missing.first(), error.location().key.as_deref() == Some(names.as_str())) else { return error };
        let column = |v: &coldplate_runtime::Variable<'_>| format!("'{} [{}]' ({} to {})", v.name, v.unit, v.low, v.high);
        let clear = Error::input(error.what()).at_key(names.as_str()).help(format!(
            "a surrogate holds no defaults: give columns such as {}, or values beside the schedule: --at {}=\"{} {}\"",
            missing.iter().map(column).collect::<Vec<_>>().join(", "),
            first.name,
            first.low,
            first.unit
        ));
        match error.location().line {
            Some(line) => clear.at_line(line),
            None => clear,
        }
    }

    /// Subject of the histories: name, sensors, limits.
    pub fn subject(&self) -> Subject<'_> {
        let name = self.surrogate.provenance().find(|(key, _)| *key == "machine").map_or("surrogate", |(_, name)| name);
        let cells = self.surrogate.provenance().find(|(key, _)| *key == "cells").and_then(|(_, cells)| cells.parse().ok());
        Subject {
            name,
            hash: &self.hash,
            variables: &self.variables,
            sensors: &self.points,
            measurands: &self.measurands,
            meters: &[],
            cells: cells.unwrap_or(0),
            nodes: self.surrogate.in_time().map_or(0, |own| own.states()),
            machine: None,
        }
    }

    /// A condition in the units of a query.
    fn own(&self, condition: &Condition) -> Result<Vec<f64>> {
        let express = |(v, si): (&Variable, &f64)| units::express(*si, &v.unit, v.dimension);
        self.variables.iter().zip(condition.si()).take(self.surrogate.variable_count()).map(express).collect()
    }

    fn kelvin(&self, values: &[f64]) -> Result<Vec<f64>> {
        let all = self.surrogate.points().zip(values);
        all.map(
            |(point, value)| {
                if point.unit == LENGTHS_IN { Ok(*value) } else { units::convert(*value, point.unit, Dimension::TEMPERATURE) }
            },
        )
        .collect()
    }

    /// Readings of all sensors in a state, at a condition in the units of a query: K, um.
    fn readings(&self, state: &State, x: &[f64]) -> Result<Vec<f64>> {
        let mut values = vec![0.0; self.surrogate.point_count()];
        self.surrogate.read(state, x, &mut values).map_err(refused)?;
        if values.iter().any(|v| !v.is_finite()) {
            let own =
                self.surrogate.variables().zip(x).map(|(v, x)| format!("{} {} {}", v.name.replace('_', " "), significant(*x, 4), v.unit));
            return Err(Error::input("the surrogate gives no temperatures here, outside the range that it was fitted to")
                .read(own.collect::<Vec<_>>().join(", "))
                .help("keep the schedule within the range, or sweep one that holds it"));
        }
        self.kelvin(&values)
    }

    fn state(&self) -> Result<State> {
        self.state.ok_or_else(|| Error::input("this history has no beginning"))
    }
}

/// A limit of a surrogate as a machine's limit in SI; the points take the place of sensors.
fn limit_of(surrogate: &Opened<'_>, limit: coldplate_runtime::Limit<'_>) -> Result<Limit> {
    let strange = || Error::input(format!("the limit '{}' looks at a point that is not there", limit.name));
    let kind: LimitKind<Vec<usize>> = limit.kind.renumbered(Some, Some).ok_or_else(strange)?;
    let unit = kind.points().next().and_then(|point| surrogate.point(point)).ok_or_else(strange)?.unit;
    let maximum = match kind {
        _ if unit == LENGTHS_IN => units::convert(limit.maximum, unit, Dimension::LENGTH)?,
        LimitKind::Maximum { .. } => units::convert(limit.maximum, unit, Dimension::TEMPERATURE)?,
        // Differences of temperatures are in K, whatever the unit of the points.
        _ => limit.maximum,
    };
    Ok(Limit { name: limit.name.to_string(), kind, maximum })
}

fn refused(error: coldplate_runtime::StepError) -> Error {
    Error::input(error.to_string())
}

impl Follower for Moving<'_> {
    fn begin(&mut self, start: Start, condition: &Condition) -> Result<()> {
        let x = self.own(condition)?;
        self.state = Some(match start {
            Start::Steady => self.surrogate.at_rest(&x).map_err(refused)?,
            Start::Uniform(temperature) => {
                let unit = self.surrogate.point(0).map_or("degC", |p| p.unit);
                self.surrogate.at_temperature(units::express(temperature, unit, Dimension::TEMPERATURE)?).map_err(refused)?
            }
            Start::Readings | Start::Parts => {
                return Err(Error::input("a schedule has no readings to begin with").at_key("--from").help("give a temperature"));
            }
        });
        Ok(())
    }

    fn advance(&mut self, seconds: f64, condition: &Condition) -> Result<()> {
        let (x, mut state) = (self.own(condition)?, self.state()?);
        self.surrogate.step(&mut state, seconds, &x).map_err(refused)?;
        self.state = Some(state);
        Ok(())
    }

    fn ahead(&self, seconds: f64, condition: &Condition) -> Result<Vec<f64>> {
        let (x, mut state) = (self.own(condition)?, self.state()?);
        self.surrogate.step(&mut state, seconds, &x).map_err(refused)?;
        self.readings(&state, &x)
    }

    fn read(&self, condition: &Condition) -> Result<Vec<f64>> {
        self.readings(&self.state()?, &self.own(condition)?)
    }

    fn steady(&self, condition: &Condition) -> Result<Vec<f64>> {
        let mut values = vec![0.0; self.surrogate.point_count()];
        self.surrogate.evaluate(&self.own(condition)?, &mut values).map_err(|e| Error::input(e.to_string()))?;
        self.kelvin(&values)
    }

    fn bounds(&self) -> Vec<f64> {
        let own = self.surrogate.in_time();
        self.surrogate.points().enumerate().map(|(k, p)| p.half_width + own.map_or(0.0, |own| own.error(k))).collect()
    }

    fn measurands(&self) -> &[Measurand] {
        &self.measurands
    }

    fn limits(&self) -> &[Limit] {
        &self.limits
    }

    fn is_inside(&self, condition: &Condition) -> bool {
        let held = self.variables.iter().zip(condition.si()).skip(self.surrogate.variable_count());
        let as_held = |(v, si): (&Variable, &f64)| v.default.is_some_and(|held| (held - si).abs() <= 1e-9 * held.abs().max(1e-12));
        self.own(condition).is_ok_and(|x| self.surrogate.in_domain(&x)) && held.into_iter().all(as_held)
    }
}
