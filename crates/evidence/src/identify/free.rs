//! A parameter that is to be found: how it is written, and the coordinate that a search moves in.

use super::interval::ParameterRange;
use crate::measurement::Data;
use coldplate_base::document::Document;
use coldplate_base::error::{Error, Result};
use coldplate_base::units;
use coldplate_describe::machine::Machine;
use coldplate_solve::study::{MachineParameter, ParameterKind, Study};

/// Usual range of a positive parameter without bounds: from its value over this factor to its value times this factor. Chosen,
/// and stated in docs/method/identification.md.
const FARTHEST: f64 = 100.0;
/// Share of the usual range to which a parameter without bounds may go where the data ask for it: nine decades, for a value that
/// was never more than a place holder. Chosen, and stated in docs/method/identification.md.
const PHYSICAL: f64 = 1e9;
/// Largest change of a measured heat, in standard deviations that are stated of its column. Chosen: farther out something else is
/// wrong, and no fit of the heat may hide it.
const MOST_DEVIATIONS: f64 = 3.0;
/// Least share of a positive parameter that one step of the search leaves of it, dimensionless. Chosen: larger falls take several
/// steps, and a value that is all but gone has no slope by which it would come back.
const LEAST_SHARE: f64 = 1e-2;
/// Size of a temperature for the test whether the data determine it, K. Chosen: half of it counts as open (docs/method/identification.md).
const OPEN_KELVIN: f64 = 10.0;

/// A parameter that is to be found.
#[derive(Debug, Clone, PartialEq)]
pub struct Free {
    /// The parameter; the search begins at its value.
    pub parameter: MachineParameter,
    /// The one test in which it holds; the others keep the value common to all.
    pub test: Option<String>,
    /// Least and largest value, SI: as stated, or the usual range about the file's value.
    pub bounds: (f64, f64),
    /// Least and largest value, SI, to which the search goes where the data ask for it: the bounds, if these are stated.
    pub limits: (f64, f64),
    /// Prior: value and standard deviation, SI.
    pub prior: Option<(f64, f64)>,
    /// Whether the parameter varies by its logarithm, because it is positive by nature.
    pub is_logarithmic: bool,
    /// Whether the bounds are no more than the usual range.
    pub has_usual_range: bool,
    /// Whether the data determine the parameter on one side only: they cannot tell its value from zero.
    pub is_like_zero: bool,
    /// Whether temperatures are linear in the parameter, because it is a heat.
    pub is_heat: bool,
}

impl Free {
    /// Reads `KEY`, `KEY=LOW..HIGH` (as in [`ParameterRange`]), `KEY=VALUE +- DEVIATION`, or both: `KEY=LOW..HIGH, VALUE +-
    /// DEVIATION`. With `KEY@TEST` in place of `KEY` the value holds in that test alone.
    ///
    /// # Errors
    /// No such key, a condition variable, or bounds that cannot be read or hold nothing.
    pub fn parse(text: &str, study: &Study) -> Result<Self> {
        let (key, test, rest) = pieces(text);
        let parameter = study.parameter(key)?;
        if parameter.kind == ParameterKind::Condition {
            return Err(Error::input(format!("'{}' is a condition, not a number of the machine", parameter.name))
                .at_key(&parameter.name)
                .help("say in DATA.toml how uncertain it is: its error is then taken into account"));
        }
        let is_logarithmic = parameter.value > 0.0 && !parameter.dimension.is_absolute() && parameter.kind != ParameterKind::Offset;
        let v = parameter.value;
        let reach =
            if parameter.dimension.is_absolute() || parameter.kind == ParameterKind::Offset { 100.0 } else { (10.0 * v.abs()).max(100.0) };
        let bounds = if is_logarithmic { (v / FARTHEST, v * FARTHEST) } else { (v - reach, v + reach) };
        let is_heat = Document::names_in(&parameter.name).is_some_and(|names| matches!(names[0].as_str(), "source" | "drive"));
        let mut free = Self {
            parameter,
            test: test.map(String::from),
            bounds,
            limits: bounds,
            prior: None,
            is_logarithmic,
            has_usual_range: false,
            is_like_zero: false,
            is_heat,
        };
        let mut is_bounded = false;
        for part in rest.split(',').map(str::trim).filter(|p| !p.is_empty()) {
            if part.contains("..") {
                let ParameterRange { low, high, step } = ParameterRange::parse(part, &free.parameter)?;
                if step.is_some() {
                    return Err(free.wrong("a search has no steps", part).help("leave the step out, or try a grid with --scan"));
                }
                free.bounds = (low, high);
                is_bounded = true;
            } else if let Some((value, deviation)) = part.split_once("+-").or(part.split_once('±')) {
                let (value, deviation) = (free.read(value)?, free.read_difference(deviation)?);
                free.prior = Some((value, deviation));
            } else {
                return Err(free.malformed(part));
            }
        }
        if rest.trim().is_empty()
            && let Some(stated) = study.uncertain()?.into_iter().find(|own| own.parameter.name == free.parameter.name)
        {
            match stated.limits {
                Some(limits) => (free.bounds, is_bounded) = (limits, true),
                None => free.prior = Some((stated.parameter.value, stated.deviation)),
            }
        }
        if free.bounds.0.is_nan() || free.bounds.1.is_nan() || free.bounds.0 >= free.bounds.1 {
            return Err(free.wrong("the lower bound comes first", rest));
        }
        if free.bounds.0 <= 0.0 {
            free.is_logarithmic = false;
        }
        if is_bounded {
            // If the range ends at a value that is not part of it, such as a conductance of zero, the bound comes close to it.
            let (low, high) = (free.valid(study, free.bounds.0), free.valid(study, free.bounds.1));
            let close = 1e-6 * (free.bounds.1 - free.bounds.0);
            if (low - free.bounds.0).abs() > close || (high - free.bounds.1).abs() > close {
                return Err(free
                    .wrong("the machine does not allow these bounds", rest)
                    .help("choose bounds between which the machine file stays valid"));
            }
            free.bounds = (low, high);
            free.limits = free.bounds;
        } else {
            free.has_usual_range = true;
            free.bounds = (free.valid(study, bounds.0), free.valid(study, bounds.1));
            free.limits = (free.farthest(study, bounds.0, free.bounds.0), free.farthest(study, bounds.1, free.bounds.1));
        }
        if let Some((value, deviation)) = free.prior {
            if deviation.is_nan() || deviation <= 0.0 {
                return Err(free.wrong("a standard deviation is positive", rest));
            }
            if !(free.bounds.0..=free.bounds.1).contains(&value) {
                let shown = [free.bounds.0, free.bounds.1].map(|v| free.parameter.shown(v));
                return Err(Error::input("the value of the prior lies outside the bounds")
                    .at_key(&free.parameter.name)
                    .read(rest)
                    .help(format!("the bounds are {} to {} {}", shown[0], shown[1], free.parameter.unit)));
            }
        }
        Ok(free)
    }

    /// Reads a text as [`Free::parse`] does; `KEY@*` gives one parameter for each test of the data.
    ///
    /// # Errors
    /// Errors of [`Free::parse`].
    pub fn each(text: &str, study: &Study, data: &Data) -> Result<Vec<Self>> {
        let free = Self::parse(text, study)?;
        if free.test.as_deref() != Some(EVERY_TEST) {
            return Ok(vec![free]);
        }
        Ok(data.tests().into_iter().map(|test| Self { test: Some(test), ..free.clone() }).collect())
    }

    /// The key, followed by the test if the value holds in one alone: `KEY@TEST`.
    pub fn name(&self) -> String {
        self.test.as_ref().map_or(self.parameter.name.clone(), |test| format!("{}@{test}", self.parameter.name))
    }

    /// The physical limit beyond an end of the usual range: the end itself, where the machine is not valid farther out.
    fn farthest(&self, study: &Study, usual: f64, valid: f64) -> f64 {
        let p = &self.parameter;
        if valid != usual || p.dimension.is_absolute() || p.kind == ParameterKind::Offset {
            return valid;
        }
        let far = match self.is_logarithmic {
            true if usual < p.value => usual / PHYSICAL,
            _ => usual * PHYSICAL,
        };
        if self.is_valid(study, far) { far } else { valid }
    }

    /// Whether the machine file is valid with a value.
    pub(super) fn is_valid(&self, study: &Study, value: f64) -> bool {
        study.document_with(&[(&self.parameter, value)]).and_then(|d| Machine::from_document(&d)).is_ok()
    }

    /// A bound moved towards the file's value until the machine is valid, as for an emissivity that ends at one.
    fn valid(&self, study: &Study, bound: f64) -> f64 {
        let holds = |value: f64| self.is_valid(study, value);
        if holds(bound) {
            return bound;
        }
        // Shares and emissivities end at one.
        if self.parameter.value < 1.0 && bound > 1.0 && holds(1.0) {
            return 1.0;
        }
        let (mut inside, mut outside) = (self.parameter.value, bound);
        for _ in 0..50 {
            let middle = self.value(0.5 * (self.coordinate(inside) + self.coordinate(outside)));
            if holds(middle) { inside = middle } else { outside = middle }
        }
        inside
    }

    fn read(&self, text: &str) -> Result<f64> {
        let p = &self.parameter;
        let result = if p.unit == "1" || p.unit.is_empty() {
            text.trim().parse::<f64>().map_err(|_| self.malformed(text))
        } else {
            units::parse(text.trim(), p.dimension).map_err(|e| e.at_key(&p.name))
        };
        result.and_then(|v| if v.is_finite() { Ok(v) } else { Err(self.malformed(text)) })
    }

    fn read_difference(&self, text: &str) -> Result<f64> {
        let p = &self.parameter;
        if p.dimension.is_absolute() {
            return units::parse(text.trim(), units::Dimension::DIFFERENCE).map_err(|e| e.at_key(&p.name));
        }
        self.read(text)
    }

    fn wrong(&self, what: &str, text: &str) -> Error {
        Error::input(what).at_key(&self.parameter.name).read(text)
    }

    fn malformed(&self, text: &str) -> Error {
        let unit = if self.parameter.unit == "1" { String::new() } else { format!(" {}", self.parameter.unit) };
        Error::input("this says neither bounds nor prior of a parameter")
            .at_key(&self.parameter.name)
            .read(text)
            .help(format!("write {}=1{unit}..2{unit} or {}=1{unit} +- 0.1{unit}", self.parameter.name, self.parameter.name))
    }

    /// The coordinate the search moves in.
    pub fn coordinate(&self, value: f64) -> f64 {
        if self.is_logarithmic { value.ln() } else { value }
    }

    /// The bounds as coordinates.
    pub(super) fn coordinate_bounds(&self) -> (f64, f64) {
        (self.coordinate(self.bounds.0), self.coordinate(self.bounds.1))
    }

    /// The limits as coordinates.
    pub(super) fn coordinate_limits(&self) -> (f64, f64) {
        (self.coordinate(self.limits.0), self.coordinate(self.limits.1))
    }

    /// Whether a value is not in the usual range.
    pub(super) fn is_unusual(&self, value: f64) -> bool {
        !(self.bounds.0..=self.bounds.1).contains(&value)
    }

    /// Widens the bounds to the usual range about a value that is not between them, within the limits.
    pub(super) fn widen(&mut self, value: f64) {
        let (low, high) = match self.is_logarithmic {
            true => (value / FARTHEST, value * FARTHEST),
            false => (value - 10.0 * value.abs(), value + 10.0 * value.abs()),
        };
        self.bounds = (low.min(self.bounds.0).max(self.limits.0), high.max(self.bounds.1).min(self.limits.1));
    }

    /// Gives a measured heat the uncertainty of its column, as a share of the value: a prior, and bounds if none are stated.
    pub(super) fn as_certain_as(&mut self, share: f64) {
        let value = self.parameter.value;
        self.prior = self.prior.or(Some((value, share * value)));
        if self.has_usual_range {
            let reach = MOST_DEVIATIONS * share;
            self.bounds = (self.bounds.0.max(value * (1.0 - reach)), self.bounds.1.min(value * (1.0 + reach)));
            (self.limits, self.has_usual_range) = (self.bounds, false);
        }
    }

    /// Gives a parameter that cannot be told from zero a linear scale; `high` is well within its bounds.
    pub(super) fn on_linear_scale(&mut self, high: f64) {
        self.is_logarithmic = false;
        self.is_like_zero = true;
        self.bounds.1 = self.bounds.1.max(FARTHEST * high);
        self.limits = self.bounds;
    }

    /// Size of the parameter at a value, as a step of its coordinate: a logarithm of one, ten kelvin, or the value.
    pub(super) fn size(&self, value: f64) -> f64 {
        let p = &self.parameter;
        let size = value.abs().max(p.value.abs());
        if self.is_logarithmic {
            1.0
        } else if self.is_like_zero {
            // Ten times the upper end of the interval.
            10.0 * self.bounds.1 / FARTHEST
        } else if p.dimension.is_absolute() || p.kind == ParameterKind::Offset {
            OPEN_KELVIN
        } else if size > 0.0 {
            size
        } else {
            0.1 * (self.bounds.1 - self.bounds.0)
        }
    }

    /// Derivative of the value with respect to its coordinate.
    pub(super) fn scale(&self, coordinate: f64) -> f64 {
        if self.is_logarithmic { self.value(coordinate) } else { 1.0 }
    }

    /// The value at a coordinate.
    pub fn value(&self, coordinate: f64) -> f64 {
        if self.is_logarithmic { coordinate.exp() } else { coordinate }
    }

    /// Coordinate to which a step of a linear model leads, in units of the coordinate. A logarithm that grows by `step` is a value
    /// times 1 + step, because a conductance that is far too small acts in proportion to its value. One that falls by `step` is a
    /// value over 1 + step, because a conductance that is far too large acts by its reciprocal, but for heats.
    pub(super) fn moved(&self, coordinate: f64, step: f64) -> f64 {
        if !self.is_logarithmic {
            coordinate + step
        } else if step >= 0.0 {
            coordinate + step.ln_1p()
        } else {
            let share = if self.is_heat { 1.0 + step } else { 1.0 / (1.0 - step) };
            coordinate + share.max(LEAST_SHARE).ln()
        }
    }

    /// Least and largest step that [`Free::moved`] takes within the limits.
    pub(super) fn reach(&self, coordinate: f64) -> (f64, f64) {
        let (low, high) = self.coordinate_limits();
        if !self.is_logarithmic {
            return ((low - coordinate).min(0.0), (high - coordinate).max(0.0));
        }
        let down = if self.is_heat { (low - coordinate).exp_m1() } else { -(coordinate - low).exp_m1() };
        (down.min(0.0), (high - coordinate).exp_m1().max(0.0))
    }
}

/// Name that stands for every test, in `KEY@*`.
const EVERY_TEST: &str = "*";

/// Key, test and text of the values, of `KEY@TEST=VALUES`. An `@` within quotes belongs to a name.
fn pieces(text: &str) -> (&str, Option<&str>, &str) {
    let (name, rest) = text.split_once('=').unwrap_or((text, ""));
    match name.rfind('@').filter(|at| !name[*at..].contains('"')) {
        Some(at) => (name[..at].trim(), Some(name[at + 1..].trim()), rest),
        None => (name, None, rest),
    }
}
