//! Standard deviations of readings that are taken into a surrogate file.

use std::path::Path;

use coldplate_runtime::Surrogate;

use super::condition;
use coldplate_base::document::{Document, Section, Value, suggestion};
use coldplate_base::error::{Error, Result};
use coldplate_base::units::{self, Dimension};

/// Standard deviation of a uniform distribution over half its width, 1/√3, dimensionless.
const RECTANGULAR: f64 = 0.577_350_269_189_625_8;

/// Standard deviations of the errors of instruments.
#[derive(Debug, Clone, PartialEq)]
pub struct Instruments {
    /// Standard deviation of a reading of each point, K.
    readings: Vec<f64>,
    /// Standard deviation of each variable.
    variables: Vec<Own>,
}

/// Standard deviation of a variable: in its unit, and as a share of its value.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Own {
    absolute: f64,
    relative: f64,
}

impl Instruments {
    /// Readings with this standard deviation (K) at conditions that are known exactly.
    pub fn with_noise(surrogate: &Surrogate<'_>, noise: f64) -> Self {
        Self { readings: vec![noise; surrogate.point_count()], variables: vec![Own::default(); surrogate.variable_count()] }
    }

    /// Reads the `DATA.toml` that `identify` and `diagnose` read beside `DATA.csv`: noise and bias of readings, also sensor
    /// by sensor, and the uncertainty of the condition.
    ///
    /// # Errors
    /// The file cannot be read; the key `kind` is missing, which says whether the numbers are limits or standard
    /// deviations; a value has no unit or is below zero; there is no noise at all.
    pub fn read(path: &Path, surrogate: &Surrogate<'_>) -> Result<Self> {
        let document = Document::read(path)?;
        let root = document.root();
        let scale = match root.opt("kind") {
            Some(kind) => [RECTANGULAR, 1.0][kind.choice(&["limits", "standard deviations"])?],
            None => {
                let error = root.error("the file does not say whether its numbers are limits or standard deviations");
                return Err(error.help("write kind = \"limits\" or kind = \"standard deviations\""));
            }
        };
        let kelvin = |section: &Section<'_>, key: &str| match section.opt(key) {
            Some(value) => Ok(Some(scale * not_negative(&value, value.quantity(Dimension::DIFFERENCE)?)?)),
            None => Ok::<_, Error>(None),
        };
        let (noise, bias) = (kelvin(&root, "noise")?.unwrap_or(0.1 * RECTANGULAR), kelvin(&root, "bias")?.unwrap_or(0.1 * RECTANGULAR));
        let mut found = Self::with_noise(surrogate, noise.hypot(bias));
        for (name, section) in root.sections("sensor")? {
            let own = (kelvin(&section, "noise")?.unwrap_or(noise), kelvin(&section, "bias")?.unwrap_or(bias));
            // The file may serve a machine with more sensors than the surrogate has points.
            if let Some(point) = surrogate.points().position(|p| p.name == name) {
                found.readings[point] = own.0.hypot(own.1);
            }
            section.finish()?;
        }
        if let Some(value) = root.opt("condition") {
            let section = value.section()?;
            let known: Vec<&str> = condition::variables(surrogate).iter().map(|v| v.name).collect();
            for name in section.keys() {
                let value = section.value(name)?;
                let Some(variable) = surrogate.variables().position(|v| v.name == name) else {
                    if known.contains(&name) {
                        continue;
                    }
                    return Err(value.error(format!("there is no variable '{name}'")).help(suggestion(name, &known)));
                };
                found.variables[variable] = own(&value, &surrogate.variables().nth(variable).map(|v| v.unit.to_owned()), scale)?;
            }
        }
        // Other keys of the file concern logs and the solver.
        for key in ["model", "timing", "note"] {
            let _ = root.has(key);
        }
        let without = root.error("readings without any error cannot be weighed").help("give at least what the display rounds to");
        root.finish()?;
        if found.readings.iter().any(|deviation| *deviation <= 0.0) { Err(without) } else { Ok(found) }
    }

    /// Standard deviation of a reading of `point` at the condition `x`, K: of the instrument, and of the condition through the
    /// slopes of the surrogate.
    pub fn deviation(&self, surrogate: &Surrogate<'_>, x: &[f64], point: usize) -> f64 {
        let own = self.readings.get(point).copied().unwrap_or(f64::NAN);
        let mut slopes = vec![0.0; x.len()];
        if self.variables.iter().all(|v| *v == Own::default()) || surrogate.gradient(x, point, &mut slopes).is_err() {
            return own;
        }
        let of = |((slope, v), x): ((&f64, &Own), &f64)| (slope * v.absolute.hypot(v.relative * x)).powi(2);
        slopes.iter().zip(&self.variables).zip(x).map(of).sum::<f64>().sqrt().hypot(own)
    }
}

/// Standard deviation of a variable, from a text with its unit or in per cent.
fn own(value: &Value<'_>, unit: &Option<String>, scale: f64) -> Result<Own> {
    let text = value.text()?;
    if let Some(percent) = text.trim().strip_suffix('%') {
        let share: f64 = percent.trim().parse().map_err(|_| value.error("this is no number of percent"))?;
        return Ok(Own { absolute: 0.0, relative: scale * not_negative(value, share)? / 100.0 });
    }
    let unit = unit.as_deref().unwrap_or("1");
    let dimension = units::dimension_of(unit)?;
    let (dimension, unit) = if dimension.is_absolute() { (Dimension::DIFFERENCE, "K") } else { (dimension, unit) };
    let si = units::parse(&text, dimension).map_err(|e| value.place(e))?;
    Ok(Own { absolute: scale * units::express(not_negative(value, si)?, unit, dimension)?, relative: 0.0 })
}

fn not_negative(value: &Value<'_>, number: f64) -> Result<f64> {
    let is_one = (0.0..f64::INFINITY).contains(&number);
    if is_one { Ok(number) } else { Err(value.error("an uncertainty is a finite number and not negative")) }
}
