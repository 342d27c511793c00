//! Uncertainty of readings and conditions.

use std::path::{Path, PathBuf};

use super::{Data, ReadingSettings, reading};
use coldplate_base::document::{Document, Section, Value};
use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_base::units::{self, Dimension, Measurand};
use coldplate_describe::machine::{Condition, Machine};

/// Standard deviation over the limit of a rectangular distribution between +-a, 1 / sqrt 3; dimensionless (GUM 4.3.7).
const RECTANGULAR: f64 = 0.577_350_269_189_625_8;
/// Usual limit of scanner, sensor, chiller and ambient temperature, +-0.1 K. Chosen; in K.
const USUAL_KELVIN: f64 = 0.1;
/// Usual limit of probes of displacement, um. Chosen.
const USUAL_MICROMETRES: f64 = 1.0;
/// Usual limit of a flow meter, +-0.05 L/min in m³/s. Chosen.
const USUAL_FLOW: f64 = 0.05 / 60_000.0;
/// Usual limit of a log's clock, s. Chosen: the time of a scanner to go through its channels.
const USUAL_SECONDS: f64 = 1.0;

/// Standard deviation of a condition variable: the larger of the two parts if both are given.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct VariableUncertainty {
    /// Standard deviation in the variable's SI unit.
    pub absolute: f64,
    /// Standard deviation as a share of the value.
    pub relative: f64,
}

/// Standard deviations of readings and conditions.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasurementUncertainty {
    /// Noise of each sensor, new in every reading, K or um, in the order of [`Data::sensors`].
    pub noise: Vec<f64>,
    /// Bias of each sensor, constant in all its readings, K or um.
    pub bias: Vec<f64>,
    /// Uncertainty of every condition variable, in the order of [`Machine::variables`]; one error per row (steady) or per test
    /// (log).
    pub variables: Vec<VariableUncertainty>,
    /// Numerical error of the model (mesh, solver), K, independent from reading to reading.
    pub model: f64,
    /// Timing of a log, s, for two errors: that of its clock, constant through a test, and that of the lags of sensors and
    /// fronts, which wanders; see [`super::wander`].
    pub timing: f64,
    /// The file it was read from, or `None` if the usual values stand in.
    pub file: Option<PathBuf>,
}

impl MeasurementUncertainty {
    /// Uncertainty from `DATA.toml` beside `data`, or usual values.
    ///
    /// # Errors
    /// The file cannot be read; an unknown key, sensor or variable; a value without its unit or below zero.
    pub fn beside(data_file: &Path, data: &Data, machine: &Machine) -> Result<Self> {
        let path = data_file.with_extension("toml");
        if path.exists() { Self::read(&path, data, machine) } else { Ok(Self::usual(data, machine)) }
    }

    /// The usual limits of the instruments of such tests.
    pub fn usual(data: &Data, machine: &Machine) -> Self {
        let variable = |v: &coldplate_describe::machine::DescribedVariable| {
            let absolute = if v.dimension == Dimension::TEMPERATURE {
                RECTANGULAR * USUAL_KELVIN
            } else if v.dimension == Dimension::VOLUME_FLOW {
                RECTANGULAR * USUAL_FLOW
            } else {
                0.0
            };
            VariableUncertainty { absolute, relative: 0.0 }
        };
        let limit = |sensor: &usize| match machine.sensors[*sensor].measurand() {
            Measurand::Temperature => USUAL_KELVIN,
            Measurand::Displacement => USUAL_MICROMETRES,
        };
        let usual: Vec<f64> = data.sensors.iter().map(|sensor| RECTANGULAR * limit(sensor)).collect();
        Self {
            noise: usual.clone(),
            bias: usual,
            variables: machine.variables.iter().map(variable).collect(),
            model: 0.0,
            timing: RECTANGULAR * USUAL_SECONDS,
            file: None,
        }
    }

    /// Reads a file such as
    ///
    /// ```toml
    /// kind = "limits"                 # or "standard deviations"
    /// noise = "0.1 K"                 # from reading to reading
    /// displacement_noise = "0.5 um"   # of sensors of displacement
    /// bias = "0.1 K"                  # of a sensor, the same in all its readings
    /// model = "0.05 K"                # of mesh and solver; a standard deviation always
    /// timing = "1 s"                  # of a log's clock, and of the lags of sensors
    /// zone = "Europe/Berlin"          # of dates that say none
    /// held = ["heater"]               # conditions that stay until the next row of a log; joined = [...] run straight to it
    /// [condition]
    /// coolant_temperature = "0.1 K"
    /// coolant_flow = "0.05 L/min"     # or "2 %"
    /// [sensor."motor shell"]
    /// bias = "0.3 K"
    /// ```
    ///
    /// # Errors
    /// Errors of [`MeasurementUncertainty::beside`].
    pub fn read(path: &Path, data: &Data, machine: &Machine) -> Result<Self> {
        let document = Document::read(path)?;
        let root = document.root();
        let mut found = Self::usual(data, machine);
        found.file = Some(path.to_path_buf());
        let scale = match root.opt("kind") {
            Some(kind) => [RECTANGULAR, 1.0][kind.choice(&["limits", "standard deviations"])?],
            // A file that only says how the table is read states no uncertainty.
            None if root.keys().all(|key| reading::KEYS.contains(&key)) => 1.0,
            None => {
                let error = root.error("the file does not say whether its numbers are limits or standard deviations");
                return Err(error.help("write kind = \"limits\" or kind = \"standard deviations\""));
            }
        };
        found.read_overall(&root, scale, data, machine)?;
        if let Some(value) = root.opt("condition") {
            found.read_conditions(value.section()?, scale, machine)?;
        }
        for (name, section) in root.sections("sensor")? {
            found.read_sensor(&name, section, scale, data, machine)?;
        }
        ReadingSettings::of(&root)?;
        if let Some(note) = root.opt("note") {
            note.text()?;
        }
        root.finish()?;
        if found.noise.iter().any(|n| *n <= 0.0) {
            return Err(Error::input("readings without any noise cannot be weighed")
                .at_key("noise")
                .in_file(path)
                .help("give at least what the display rounds to"));
        }
        Ok(found)
    }

    /// Noise and bias of all sensors, the error of the model, and timing.
    fn read_overall(&mut self, root: &Section<'_>, scale: f64, data: &Data, machine: &Machine) -> Result<()> {
        let of = |k: usize| machine.sensors[data.sensors[k]].measurand();
        for (key, all) in [("noise", &mut self.noise), ("bias", &mut self.bias)] {
            for (measurand, prefix) in [(Measurand::Temperature, ""), (Measurand::Displacement, "displacement_")] {
                if let Some(own) = spread(root, &format!("{prefix}{key}"), measurand)? {
                    all.iter_mut().enumerate().filter(|(k, _)| of(*k) == measurand).for_each(|(_, value)| *value = scale * own);
                }
            }
        }
        if let Some(model) = spread(root, "model", Measurand::Temperature)? {
            self.model = model;
        }
        if let Some(value) = root.opt("timing") {
            self.timing = scale * finite(&value, value.quantity(Dimension::TIME)?)?;
        }
        Ok(())
    }

    /// Uncertainty of the condition variables.
    fn read_conditions(&mut self, section: Section<'_>, scale: f64, machine: &Machine) -> Result<()> {
        for (v, variable) in machine.variables.iter().enumerate() {
            let Some(value) = section.opt(&variable.name) else { continue };
            let text = value.text()?;
            let mut own = VariableUncertainty::default();
            if let Some(percent) = text.trim().strip_suffix('%') {
                let share: f64 = percent.trim().parse().map_err(|_| value.error("this is no number of percent"))?;
                own.relative = finite(&value, scale * share / 100.0)?;
            } else {
                let dimension = if variable.dimension.is_absolute() { Dimension::DIFFERENCE } else { variable.dimension };
                own.absolute = finite(&value, scale * units::parse(&text, dimension).map_err(|e| value.place(e))?)?;
            }
            self.variables[v] = own;
        }
        section.finish()
    }

    /// Noise and bias of one sensor. A file may serve several tables, so that sensors of the machine without a column are allowed.
    fn read_sensor(&mut self, name: &str, section: Section<'_>, scale: f64, data: &Data, machine: &Machine) -> Result<()> {
        let Some(sensor) = machine.sensors.iter().find(|s| s.name == name) else {
            let error = section.error(format!("there is no sensor '{name}'"));
            return Err(match did_you_mean(name, machine.sensors.iter().map(|s| s.name.as_str())) {
                Some(near) => error.help(format!("did you mean '{near}'?")),
                None => error,
            });
        };
        let column = data.names.iter().position(|n| n == name);
        for (key, all) in [("noise", &mut self.noise), ("bias", &mut self.bias)] {
            if let (Some(own), Some(k)) = (spread(&section, key, sensor.measurand())?, column) {
                all[k] = scale * own;
            }
        }
        section.finish()
    }

    /// Standard deviation of every variable at a condition, SI.
    pub fn at(&self, condition: &Condition) -> Vec<f64> {
        self.variables.iter().zip(condition.si()).map(|(u, value)| u.absolute.max(u.relative * value.abs())).collect()
    }
}

/// An uncertainty (K or um) under a key, if it is there.
fn spread(section: &Section<'_>, key: &str, of: Measurand) -> Result<Option<f64>> {
    let Some(value) = section.opt(key) else { return Ok(None) };
    finite(&value, of.of_si(value.quantity(of.dimension().of_differences())?)).map(Some)
}

/// Checks that an uncertainty is finite and not negative.
fn finite(value: &Value<'_>, own: f64) -> Result<f64> {
    if (0.0..f64::INFINITY).contains(&own) { Ok(own) } else { Err(value.error("an uncertainty is a finite number and not negative")) }
}
