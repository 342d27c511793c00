//! The names that a machine's formulas use, with their meanings.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

use coldplate_base::error::{Error, Location, Result};
use coldplate_base::formula::{Formula, FormulaNames, FormulaValues};
use coldplate_base::units::{Dimension, ZERO_CELSIUS};

/// Temperature at which formulas for temperatures are tried, K: a room at 20 degC.
const ROOM: f64 = 293.15;
/// Difference of two temperatures that are about the same, K. Chosen: a sixth of the difference between both scales.
const ROUGHLY: f64 = 50.0;

/// One slot of a machine's formula names.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Meaning {
    /// Variable in SI.
    Si(usize),
    /// Variable in another unit: SI = scale * value + offset.
    InUnit {
        /// Index into the variables.
        variable: usize,
        /// SI per unit.
        scale: f64,
        /// SI at the unit's zero.
        offset: f64,
    },
    /// A quantity of a drive: index of the drive, and of the quantity in `Heats::named`.
    Drive(usize, usize),
    /// A definition.
    Definition(usize),
}

impl Meaning {
    pub(super) fn variable(self) -> Option<usize> {
        match self {
            Self::Si(variable) | Self::InUnit { variable, .. } => Some(variable),
            Self::Drive(..) | Self::Definition(_) => None,
        }
    }

    pub(super) fn drive(self) -> Option<usize> {
        if let Self::Drive(drive, _) = self { Some(drive) } else { None }
    }
}

/// The names of a machine's formulas with their meanings, slot by slot.
#[derive(Debug, Clone, Default)]
pub(super) struct Symbols {
    pub(super) names: FormulaNames,
    pub(super) meanings: Vec<Meaning>,
    /// Slots of the definitions, in the order of `Machine::definitions`.
    pub(super) definition_slots: Vec<usize>,
    /// Names of parts, nodes and sensors, whose temperatures are no names of formulas.
    pub(super) places: Vec<String>,
    /// Slots of temperatures in kelvin.
    pub(super) kelvins: BTreeSet<usize>,
    /// Slots named by the formulas read since the last [`Symbols::take_named`].
    named: Arc<Mutex<BTreeSet<usize>>>,
}

impl Symbols {
    /// Adds a name; see [`FormulaNames::add`].
    pub(super) fn add(&mut self, name: &str, meaning: Meaning) -> Result<usize> {
        let slot = self.names.add(name)?;
        self.meanings.push(meaning);
        Ok(slot)
    }

    /// Parses a formula of the machine and records the slots it names. Every formula is read here: a variable that none
    /// names affects nothing.
    ///
    /// # Errors
    /// Errors of [`Formula::parse`]; a temperature in degC is given a number in K.
    pub(super) fn parse(&self, text: &str, dimension: Dimension, unit: Option<&str>, place: Location) -> Result<Formula> {
        let formula = Formula::parse(text, dimension, unit, &self.names, place).map_err(|error| self.controller(error))?;
        if dimension == Dimension::TEMPERATURE && unit.is_none() && self.is_in_kelvin(&formula) {
            return Err(Error::input("a number in K stands where one in degC is meant")
                .read(text)
                .help("name the temperature in degC (NAME_degC), or subtract 273.15"));
        }
        self.named.lock().unwrap_or_else(PoisonError::into_inner).extend(formula.slots());
        Ok(formula)
    }

    /// An error about an unknown name, with the remedy for a formula that follows a temperature of the machine, as a controller does.
    fn controller(&self, error: Error) -> Error {
        let names = |place: &String| ["", "_degC", "_K"].map(|unit| format!("unknown name '{place}{unit}'"));
        match self.places.iter().find(|place| names(place).iter().any(|name| error.what().contains(name))) {
            None => error,
            Some(place) => Error::input(format!("formulas know the condition, not the temperature of '{place}'")).help(
                "a thermostat or PI controller: [controller.NAME] with the sensor, and controller = \"NAME\" in the source; \
                     power that follows the temperature of the heated place: temperature_coefficient = \"-20 %/K\" with \
                     reference_temperature",
            ),
        }
    }

    /// Whether a formula for a temperature in degC gives kelvin: where all temperatures that it names are 20 degC, and all other
    /// variables zero, it gives about 293 in place of about 20.
    fn is_in_kelvin(&self, formula: &Formula) -> bool {
        let is_variable = |slot: usize| self.meanings.get(slot).is_some_and(|meaning| meaning.variable().is_some());
        if !formula.slots().any(|slot| self.kelvins.contains(&slot)) || !formula.slots().all(is_variable) {
            return false;
        }
        let value = |(slot, meaning): (usize, &Meaning)| match meaning {
            _ if self.kelvins.contains(&slot) => ROOM,
            Meaning::InUnit { scale, offset, .. } if *offset != 0.0 => (ROOM - offset) / scale,
            _ => 0.0,
        };
        let values = FormulaValues(self.meanings.iter().enumerate().map(value).collect());
        formula.evaluate(&values).is_ok_and(|si| (si - ZERO_CELSIUS - ROOM).abs() < ROUGHLY)
    }

    /// The slots named by formulas since the last call.
    pub(super) fn take_named(&self) -> BTreeSet<usize> {
        std::mem::take(&mut *self.named.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Names that a drive gives to formulas, each behind the drive's own name.
pub(super) const DRIVE_NAMES: [&str; 7] = ["motor_W", "reducer_W", "screw_W", "rail_W", "bearing_W", "velocity_m_s", "torque_N_m"];
