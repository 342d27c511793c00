//! Dynamics of a surrogate: those of a reduced model in few states, with an error over time from random histories.

use coldplate_base::error::{Error, Result};
use coldplate_base::progress::Progress;
use coldplate_base::random::Random;
use coldplate_base::units::{self, Dimension, Measurand};
use coldplate_describe::machine::{Condition, DescribedVariable, Machine};
use coldplate_explore::sweep::design;
use coldplate_reduce::ReducedModel;
use coldplate_surrogate::fit::file;
use coldplate_surrogate::fit::in_time::DynamicsSample;
use coldplate_surrogate::fit::model::{InTimeSpec, PointSpec, SurrogateSpec};

use crate::trial::Trial;

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
    let opened = file::open(&bytes)?;
    let mut worst = vec![0.0; surrogate.points.len()];
    let mut random = Random::new(SEED);
    for number in 0..HISTORIES {
        let trial = Trial::random(number, slow.slowest, &mut random, &at, varied.len());
        for step in trial.steps(&opened, model, &|x| places.condition(x))? {
            for (k, (worst, sensor)) in worst.iter_mut().zip(&places.sensors).enumerate() {
                *worst = f64::max(*worst, (places.reading(k, step.values[k]) - step.readings[*sensor]).abs());
            }
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
