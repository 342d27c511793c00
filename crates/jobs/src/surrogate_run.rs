//! A surrogate with dynamics, run through a schedule.

use coldplate_runtime::{State, Surrogate as Opened};

use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::significant;
use coldplate_base::units::{self, Dimension, Measurand};
use coldplate_describe::machine::{Condition, DescribedVariable, LimitKind, MachineLimit};
use coldplate_explore::schedule::Quantities;
use coldplate_explore::simulate::{SimulatedMachine, Stepper, check_beginning};
use coldplate_explore::sweep::MACHINE_HASH;
use coldplate_reduce::Beginning;

/// A surrogate that runs through a schedule.
pub struct SurrogateRun<'a> {
    surrogate: &'a Opened<'a>,
    state: Option<State>,
    /// Variables of a query, then the held ones.
    variables: Vec<DescribedVariable>,
    points: Vec<String>,
    measurands: Vec<Measurand>,
    limits: Vec<MachineLimit>,
    hash: String,
}

impl<'a> SurrogateRun<'a> {
    /// # Errors
    /// A surrogate of steady states only, or with points that are neither temperatures nor displacements.
    pub fn new(surrogate: &'a Opened<'a>) -> Result<Self> {
        if surrogate.in_time().is_none() {
            return Err(Error::input("this surrogate knows steady states only")
                .help("make it with `coldplate fit TABLE --dynamics MODEL.cpr`, the model by `coldplate reduce MACHINE --histories`"));
        }
        let measurand = |point: coldplate_runtime::Point<'_>| match point.unit {
            "degC" | "K" => Ok(Measurand::Temperature),
            unit if is_length(unit) => Ok(Measurand::Displacement),
            unit => Err(Error::input(format!("'{}' is in {unit}: it is neither a temperature nor a displacement in um", point.name))),
        };
        let variable = |name: &str, unit: &str, default: Option<f64>| -> Result<DescribedVariable> {
            let dimension = units::dimension_of(unit)?;
            let default = default.map(|v| units::convert(v, unit, dimension)).transpose()?;
            Ok(DescribedVariable { name: name.into(), unit: unit.into(), dimension, default, range: None })
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
            hash: surrogate.provenance().find(|(key, _)| *key == MACHINE_HASH).map_or(String::new(), |(_, hash)| hash.to_string()),
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
    pub fn subject(&self) -> SimulatedMachine<'_> {
        let name = self.surrogate.provenance().find(|(key, _)| *key == "machine").map_or("surrogate", |(_, name)| name);
        let mesh = self.surrogate.provenance().find(|(key, _)| *key == "mesh");
        let cells = mesh.and_then(|(_, mesh)| mesh.split_once(" cells")?.0.parse().ok());
        SimulatedMachine {
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

    /// Coldest and hottest temperature (K) of the steady points at the corners of the fitted ranges and in their middle, and
    /// of the temperatures that the ranges themselves are of.
    fn temperature_range(&self) -> Result<(f64, f64)> {
        let variables: Vec<_> = self.surrogate.variables().collect();
        let middle: Vec<f64> = variables.iter().map(|v| f64::midpoint(v.low, v.high)).collect();
        // A surrogate has at most eight variables.
        let corner = |corner: usize| {
            let end = |(bit, v): (usize, &coldplate_runtime::Variable<'_>)| if corner >> bit & 1 == 1 { v.high } else { v.low };
            variables.iter().enumerate().map(end).collect::<Vec<f64>>()
        };
        let ends = variables.iter().flat_map(|v| [(v.low, v.unit), (v.high, v.unit)]);
        let held = self.surrogate.held().map(|held| (held.value, held.unit));
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        // Only a temperature converts to kelvin.
        for kelvin in ends.chain(held).filter_map(|(value, unit)| units::convert(value, unit, Dimension::TEMPERATURE).ok()) {
            (low, high) = (low.min(kelvin), high.max(kelvin));
        }
        let mut values = vec![0.0; self.surrogate.point_count()];
        for x in std::iter::once(middle).chain((0..1 << variables.len()).map(corner)) {
            self.surrogate.evaluate(&x, &mut values).map_err(|e| Error::input(e.to_string()))?;
            for (kelvin, point) in self.kelvin(&values)?.iter().zip(self.surrogate.points()) {
                if !is_length(point.unit) {
                    (low, high) = (low.min(*kelvin), high.max(*kelvin));
                }
            }
        }
        Ok((low, high))
    }

    /// A condition in the units of a query.
    fn own(&self, condition: &Condition) -> Result<Vec<f64>> {
        let express = |(v, si): (&DescribedVariable, &f64)| units::express(*si, &v.unit, v.dimension);
        self.variables.iter().zip(condition.si()).take(self.surrogate.variable_count()).map(express).collect()
    }

    fn kelvin(&self, values: &[f64]) -> Result<Vec<f64>> {
        let all = self.surrogate.points().zip(values);
        all.map(
            |(point, value)| {
                if is_length(point.unit) { Ok(*value) } else { units::convert(*value, point.unit, Dimension::TEMPERATURE) }
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

fn is_length(unit: &str) -> bool {
    unit == Measurand::Displacement.unit()
}

/// A limit of a surrogate as a machine's limit in SI; the points take the place of sensors.
fn limit_of(surrogate: &Opened<'_>, limit: coldplate_runtime::Limit<'_>) -> Result<MachineLimit> {
    let strange = || Error::input(format!("the limit '{}' looks at a point that is not there", limit.name));
    let kind: LimitKind<Vec<usize>> = limit.kind.renumbered(Some, Some).ok_or_else(strange)?;
    let unit = kind.points().next().and_then(|point| surrogate.point(point)).ok_or_else(strange)?.unit;
    let maximum = match kind {
        _ if is_length(unit) => units::convert(limit.maximum, unit, Dimension::LENGTH)?,
        LimitKind::Maximum { .. } => units::convert(limit.maximum, unit, Dimension::TEMPERATURE)?,
        // Differences of temperatures are in K, whatever the unit of the points.
        _ => limit.maximum,
    };
    Ok(MachineLimit { name: limit.name.to_string(), kind, maximum })
}

fn refused(error: coldplate_runtime::StepError) -> Error {
    Error::input(error.to_string())
}

impl Stepper for SurrogateRun<'_> {
    fn begin(&mut self, beginning: Beginning, condition: &Condition) -> Result<()> {
        let x = self.own(condition)?;
        check_beginning(beginning, || self.temperature_range())?;
        self.state = Some(match beginning {
            Beginning::Steady => self.surrogate.at_rest(&x).map_err(refused)?,
            Beginning::Uniform(temperature) => {
                let unit = self.surrogate.point(0).map_or("degC", |p| p.unit);
                self.surrogate.at_temperature(units::express(temperature, unit, Dimension::TEMPERATURE)?).map_err(refused)?
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

    fn limits(&self) -> &[MachineLimit] {
        &self.limits
    }

    fn is_inside(&self, condition: &Condition) -> bool {
        let held = self.variables.iter().zip(condition.si()).skip(self.surrogate.variable_count());
        let as_held = |(v, si): (&DescribedVariable, &f64)| v.default.is_some_and(|held| (held - si).abs() <= 1e-9 * held.abs().max(1e-12));
        self.own(condition).is_ok_and(|x| self.surrogate.in_domain(&x)) && held.into_iter().all(as_held)
    }
}
