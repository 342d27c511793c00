//! Dynamics of a surrogate: those of a reduced model in few states, with an error over time from random histories.

use coldplate_base::error::{Error, Result};
use coldplate_base::progress::Progress;
use coldplate_base::random::Random;
use coldplate_base::units::{self, Dimension, Measurand};
use coldplate_describe::machine::{Condition, DescribedVariable, Machine};
use coldplate_explore::sweep::design;
use coldplate_reduce::{Beginning, ConditionStretch, ReducedModel};
use coldplate_surrogate::fit::file;
use coldplate_surrogate::fit::in_time::DynamicsSample;
use coldplate_surrogate::fit::model::{InTimeSpec, PointSpec, SurrogateSpec};

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
pub fn with_dynamics(surrogate: &mut SurrogateSpec, model: &ReducedModel, progress: &dyn Progress) -> Result<()> {
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
    let samples: Vec<DynamicsSample> = (slow.samples.iter().zip(&xs))
        .map(|(own, x)| DynamicsSample {
            x: x.clone(),
            steady: own.steady.iter().copied().collect(),
            rates: own.rates.iter().copied().collect(),
            outputs: places.sensors.iter().flat_map(|s| own.outputs.row(*s).iter().copied().collect::<Vec<_>>()).collect(),
        })
        .collect();
    // The points are in degC or in K.
    let zero = places.kelvin(0.0);
    let uniform = [(&slow.uniform[0] + &slow.uniform[1] * zero).iter().copied().collect(), slow.uniform[1].iter().copied().collect()];
    let mut found = InTimeSpec::fit(surrogate, &samples, uniform)?;
    progress.at(&format!("comparing with {HISTORIES} random histories of the reduced model"));
    let bytes = file::encode(&SurrogateSpec { in_time: Some(found.clone()), ..surrogate.clone() })?;
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
    fn of(surrogate: &SurrogateSpec, machine: &'a Machine) -> Result<Self> {
        for name in surrogate.variables.iter().map(|v| &v.name).chain(surrogate.held.iter().map(|h| &h.name)) {
            if machine.variables.iter().all(|v| v.name != *name) {
                return Err(Error::input(format!("the reduced model has no variable '{name}'")).help("take that of the same machine"));
            }
        }
        let value = |variable: &DescribedVariable| {
            if let Some(own) = surrogate.variables.iter().position(|v| v.name == variable.name) {
                return Ok(Ok(own));
            }
            if let Some(held) = surrogate.held.iter().find(|h| h.name == variable.name) {
                return Ok(Err(units::convert(held.value, &held.unit, variable.dimension)?));
            }
            let missing = || Error::input(format!("the surrogate says nothing of '{}', which has no default", variable.name));
            variable.default.map(Err).ok_or_else(missing)
        };
        let sensor = |point: &PointSpec| {
            let found = machine.sensors.iter().position(|s| s.name == point.name);
            found.ok_or_else(|| {
                Error::input(format!("the reduced model has no sensor '{}'", point.name)).help("leave it out of the table with --ignore")
            })
        };
        let length = Measurand::Displacement.unit();
        let unit = surrogate.points.iter().find(|p| p.unit != length).map_or("degC".into(), |p| p.unit.clone());
        let is_known = |p: &&PointSpec| p.unit == length || p.unit == unit && ["degC", "K"].contains(&p.unit.as_str());
        if let Some(other) = surrogate.points.iter().find(|p| !is_known(p)) {
            let error = Error::input(format!("'{}' is in {}", other.name, other.unit));
            return Err(error.help("dynamics are known of temperatures, all of them in degC or all in K, and of displacements in um"));
        }
        Ok(Self {
            machine,
            values: machine.variables.iter().map(value).collect::<Result<_>>()?,
            units: surrogate.variables.iter().map(|v| v.unit.clone()).collect(),
            sensors: surrogate.points.iter().map(sensor).collect::<Result<_>>()?,
            lengths: surrogate.points.iter().map(|p| p.unit == length).collect(),
            unit,
        })
    }

    /// The machine's condition, from values in the surrogate's units.
    fn condition(&self, x: &[f64]) -> Result<Condition> {
        let si = |(variable, value): (&DescribedVariable, &std::result::Result<usize, f64>)| match value {
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
            stretches.push(ConditionStretch { until: from, condition: Box::new(move |_| condition.clone()), at_end: None, outputs });
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
