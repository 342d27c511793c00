//! Numbers of a machine file that are stated as uncertain: `"560 +- 40 W/(m2 K)"`.

use crate::meshed::described::UncertainRecord;
use crate::study::{MachineParameter, ParameterKind, Study};
use coldplate_base::document::{StatedSpread, Uncertain};
use coldplate_base::error::{Error, Result};
use coldplate_base::units::{Dimension, parse};
use coldplate_describe::machine::Machine;

/// A number of a machine file that is uncertain.
#[derive(Debug, Clone, PartialEq)]
pub struct UncertainNumber {
    /// The number, as a parameter.
    pub parameter: MachineParameter,
    /// Standard deviation, SI; kelvin for temperatures.
    pub deviation: f64,
    /// Limits that were stated, if any, SI: every value between them is as probable as any other.
    pub limits: Option<(f64, f64)>,
}

impl UncertainNumber {
    /// The number as outside programs read it.
    pub fn record(&self) -> UncertainRecord {
        let p = &self.parameter;
        UncertainRecord {
            key: p.name.clone(),
            value: p.shown(p.value),
            unit: p.unit.clone(),
            standard_deviation: self.deviation / p.per_unit(1.0).abs(),
            limits: self.limits.map(|(low, high)| [p.shown(low), p.shown(high)]),
        }
    }
}

impl Study {
    /// The numbers that the file states as uncertain, in its order.
    ///
    /// # Errors
    /// A number stated as uncertain cannot vary continuously, its deviation is not positive or has another dimension, or its
    /// limits (one standard deviation where none are stated) are values that the machine cannot have.
    pub fn uncertain(&self) -> Result<Vec<UncertainNumber>> {
        let found = self.document().uncertain().iter().map(|own| self.uncertain_number(own)).collect::<Result<Vec<_>>>()?;
        for side in [-1.0, 1.0] {
            self.check_ends(&found, side)?;
        }
        Ok(found)
    }

    /// Reads the machine with each uncertain number at one end of its uncertainty.
    fn check_ends(&self, numbers: &[UncertainNumber], side: f64) -> Result<()> {
        let mut document = self.document().clone();
        for UncertainNumber { parameter, deviation, limits } in numbers {
            let end = match limits {
                Some((low, high)) => {
                    if side < 0.0 {
                        *low
                    } else {
                        *high
                    }
                }
                None => parameter.value + side * deviation,
            };
            if let Some((key, value)) = parameter.to_set(end, &self.model.machine)? {
                document.apply_set(&key, &value)?;
            }
        }
        let Err(error) = Machine::from_document(&document) else { return Ok(()) };
        // Another place is refused for several numbers together, which no machine need have at once.
        let key = error.location().key.as_deref().unwrap_or_default();
        let own = numbers.iter().map(|own| own.parameter.name.as_str()).find(|name| key.ends_with(name));
        let Some(name) = own else { return Ok(()) };
        let what = format!("the uncertainty of this number reaches values that it cannot have: {}", error.what());
        Err(Error::input(what).at_key(name).in_file(self.document().file()).help("state a narrower one, or limits: \"LOW .. HIGH UNIT\""))
    }

    fn uncertain_number(&self, Uncertain { key, spread }: &Uncertain) -> Result<UncertainNumber> {
        let place = |e: Error| e.at_key(key).in_file(self.document().file());
        let parameter = self.parameter(key).map_err(place)?;
        let refuse = |what: &str, help: &str| Err(place(Error::input(what).help(help)));
        if parameter.kind != ParameterKind::Quantity {
            return refuse("only a number can be uncertain", "write a number with its unit, for example \"560 +- 40 W/(m2 K)\"");
        }
        let own = if parameter.dimension.is_absolute() { Dimension::DIFFERENCE } else { parameter.dimension };
        // Degrees of a difference are kelvin.
        let in_unit = |amount: f64, unit: &str| match unit {
            "1" => parse(&format!("{amount:?}"), own),
            "degC" => parse(&format!("{amount:?} K"), own),
            unit => parse(&format!("{amount:?} {unit}"), own),
        };
        let (deviation, limits) = match spread {
            StatedSpread::Share(_) if parameter.dimension.is_absolute() => {
                return refuse("a share of a temperature means nothing", "write the deviation in K, for example \"20 degC +- 0.3 K\"");
            }
            StatedSpread::Share(share) => (share * parameter.value.abs(), None),
            StatedSpread::Deviation(amount, unit) => (in_unit(*amount, unit).map_err(place)?, None),
            StatedSpread::Limits(half, unit) => {
                let half = in_unit(*half, unit).map_err(place)?;
                (half / 3f64.sqrt(), Some((parameter.value - half, parameter.value + half)))
            }
        };
        if deviation > 0.0 && deviation.is_finite() {
            return Ok(UncertainNumber { parameter, deviation, limits });
        }
        refuse("a standard deviation is positive", "write for example \"560 +- 40 W/(m2 K)\" or \"0.55 +- 10 %\"")
    }
}
