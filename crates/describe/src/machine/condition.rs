//! A condition of a machine, and the values of all names in its formulas there.

use std::collections::{BTreeMap, BTreeSet};

use super::circuits::{Intake, Supply};
use super::model::Machine;
use super::symbols::Meaning;
use super::variables::{DescribedVariable, check_variable};
use coldplate_base::error::{Error, Result};
use coldplate_base::formula::FormulaValues;
use coldplate_base::units::{self, Dimension};
use coldplate_physics::drive;

/// A value (SI) for every variable of a machine, in the order of [`Machine::variables`].
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    si: Vec<f64>,
}

impl Condition {
    /// A condition from SI values in the order of [`Machine::variables`].
    pub fn from_si(si: Vec<f64>) -> Self {
        Self { si }
    }

    /// A condition of some variables from names and values with units; variables not named take their defaults.
    ///
    /// # Errors
    /// An unknown or repeated name, a value that cannot be read, a variable without value and without default.
    pub fn given(variables: &[DescribedVariable], given: &[(&str, &str)]) -> Result<Self> {
        let mut values: Vec<Option<f64>> = vec![None; variables.len()];
        for (name, text) in given {
            let Some(at) = variables.iter().position(|v| v.name == *name) else {
                let known: Vec<&str> = variables.iter().map(|v| v.name.as_str()).collect();
                let error = Error::input(format!("'{name}' is not a variable of this machine")).at_key(*name).read(text);
                return Err(error.help(coldplate_base::document::suggestion(name, &known)));
            };
            if values[at].is_some() {
                return Err(Error::input("this variable is given twice").at_key(*name).read(text).help("give it once"));
            }
            let variable = &variables[at];
            let value = units::parse(text, variable.dimension).map_err(|e| e.at_key(*name))?;
            if !value.is_finite() {
                return Err(Error::input("the number is too large").at_key(*name).read(text));
            }
            check_variable(name, value).map_err(|e| e.at_key(*name).read(text))?;
            values[at] = Some(value);
        }
        let values: Vec<Option<f64>> = variables.iter().zip(values).map(|(variable, value)| value.or(variable.default)).collect();
        let missing: Vec<&DescribedVariable> = variables.iter().zip(&values).filter(|(_, value)| value.is_none()).map(|(v, _)| v).collect();
        if missing.is_empty() {
            return Ok(Self { si: values.into_iter().flatten().collect() });
        }
        let example = |variable: &&DescribedVariable| {
            let low = variable.range.and_then(|(low, _)| units::express(low, &variable.unit, variable.dimension).ok());
            let example = low.map_or(variable.dimension.example().to_string(), |v| format!("\"{v} {}\"", variable.unit));
            format!("{} {example}", variable.name)
        };
        let names: Vec<String> = missing.iter().map(|v| format!("'{}'", v.name)).collect();
        let (word, one) = if missing.len() == 1 { ("a value", "one") } else { ("values", "them") };
        Err(Error::input(format!("the condition needs {word} for {}", names.join(", ")))
            .at_key(missing.iter().map(|v| v.name.as_str()).collect::<Vec<_>>().join(", "))
            .help(format!(
                "give {one}, for example {}, or a default under [variables.{}] in the machine file",
                missing.iter().map(example).collect::<Vec<_>>().join(", "),
                missing[0].name
            )))
    }

    /// At most `most` of some conditions, spread far apart: the first, then repeatedly the one farthest from all
    /// chosen. Distances count each variable as a share of its span.
    pub fn far_apart(all: &[Self], most: usize) -> Vec<Self> {
        let Some(first) = all.first() else { return Vec::new() };
        let span = |v: usize| {
            let values = all.iter().map(|c| c.si[v]);
            let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
            if high > low { high - low } else { f64::INFINITY }
        };
        let spans: Vec<f64> = (0..first.si.len()).map(span).collect();
        let apart = |a: &Self, b: &Self| -> f64 { (0..spans.len()).map(|v| ((a.si[v] - b.si[v]) / spans[v]).powi(2)).sum() };
        let mut chosen = vec![first.clone()];
        let mut nearest: Vec<f64> = all.iter().map(|c| apart(c, first)).collect();
        while chosen.len() < most {
            let farthest = nearest.iter().enumerate().fold((0, 0.0), |m: (usize, f64), (i, d)| if *d > m.1 { (i, *d) } else { m });
            if farthest.1 == 0.0 {
                break;
            }
            let next = all[farthest.0].clone();
            nearest.iter_mut().zip(all).for_each(|(own, c)| *own = own.min(apart(c, &next)));
            chosen.push(next);
        }
        chosen
    }

    /// The SI values in the order of [`Machine::variables`].
    pub fn si(&self) -> &[f64] {
        &self.si
    }

    /// The condition in words: `coolant flow 4.000 L/min, motor speed 2500 rpm`.
    pub fn words(&self, machine: &Machine) -> String {
        self.words_of(machine, |_| true)
    }

    /// The condition in words, for the variables that `is_told` selects.
    pub fn words_of(&self, machine: &Machine, is_told: impl Fn(&DescribedVariable) -> bool) -> String {
        let of = |(v, si): (&DescribedVariable, &f64)| format!("{} {}", v.name.replace('_', " "), v.with_unit(*si, 4));
        machine.variables.iter().zip(&self.si).filter(|(v, _)| is_told(v)).map(of).collect::<Vec<_>>().join(", ")
    }

    /// Every variable by name, as a value with its unit: `"2500.00 rpm"`.
    pub fn by_name(&self, machine: &Machine) -> BTreeMap<String, String> {
        machine.variables.iter().zip(&self.si).map(|(v, si)| (v.name.clone(), v.with_unit(*si, 6))).collect()
    }
}

impl Machine {
    /// Typical conditions of the machine: every variable at its default or in the middle of its range, then each
    /// variable alone at either end of its range.
    ///
    /// # Errors
    /// A variable has neither a default nor a range.
    pub fn usual_conditions(&self) -> Result<Vec<Condition>> {
        let middle = |v: &DescribedVariable| v.default.or(v.range.map(|(low, high)| f64::midpoint(low, high)));
        let known: Vec<DescribedVariable> = self.variables.iter().map(|v| DescribedVariable { default: middle(v), ..v.clone() }).collect();
        let first = Condition::given(&known, &[])?;
        let mut found = vec![first.clone()];
        for (v, variable) in self.variables.iter().enumerate().filter(|(v, _)| !self.unused.contains(v)) {
            let (low, high) = variable.range.unwrap_or((first.si[v], first.si[v]));
            for end in [low, high].into_iter().filter(|end| *end != first.si[v]) {
                let mut moved = first.clone();
                moved.si[v] = end;
                found.push(moved);
            }
        }
        Ok(found)
    }
}

/// The quantities of a drive in the order of [`DRIVE_NAMES`], at `speed` (rad/s).
pub(super) fn drive_quantities(parameters: &drive::Parameters, speed: f64) -> [f64; 7] {
    let heats = drive::heats(parameters, speed);
    [heats.motor, heats.reducer, heats.screw, heats.rail, heats.bearing, heats.velocity, heats.torques.starting]
}

/// Derivatives of the quantities with respect to the speed. All quantities are polynomials of degree two or less on
/// either side of standstill: the central difference is exact there. At standstill it is the mean of the two sides.
pub(super) fn drive_slopes(parameters: &drive::Parameters, speed: f64) -> [f64; 7] {
    let step = if speed == 0.0 { 1.0 } else { speed.abs() / 2.0 };
    let (above, below) = (drive_quantities(parameters, speed + step), drive_quantities(parameters, speed - step));
    std::array::from_fn(|i| (above[i] - below[i]) / (2.0 * step))
}

impl Machine {
    /// A condition from names and values with units; variables not named take their defaults.
    ///
    /// # Errors
    /// An unknown or repeated name, a value that cannot be read, a variable without value and without default.
    pub fn condition(&self, given: &[(&str, &str)]) -> Result<Condition> {
        Condition::given(&self.variables, given)
    }

    /// Whether anything of the machine depends on a variable (index into [`Machine::variables`]). A variable without
    /// any effect need not be given: it has a default.
    pub fn uses(&self, variable: usize) -> bool {
        !self.unused.contains(&variable)
    }

    /// Finds the variables on which neither the slots `named` nor a limit depend, and gives them defaults.
    pub(super) fn find_unused(&mut self, mut named: BTreeSet<usize>) {
        // Definitions may name drives and earlier definitions: they are followed from the last to the first.
        for (definition, slot) in self.definitions.iter().zip(&self.symbols.definition_slots).rev() {
            if named.contains(slot) {
                named.extend(definition.formula.slots());
            }
        }
        let drives: Vec<usize> = named.iter().filter_map(|slot| self.symbols.meanings.get(*slot)?.drive()).collect();
        named.extend(drives.iter().filter_map(|drive| self.drives.get(*drive)).flat_map(|drive| drive.speed.slots()));
        let mut used: BTreeSet<usize> = named.iter().filter_map(|slot| self.symbols.meanings.get(*slot)?.variable()).collect();
        used.extend(self.limits.iter().filter_map(|limit| limit.kind.variable()));
        for (index, variable) in self.variables.iter_mut().enumerate().filter(|(index, _)| !used.contains(index)) {
            self.unused.push(index);
            let usual = if variable.dimension == Dimension::TEMPERATURE { units::ZERO_CELSIUS + 20.0 } else { 0.0 };
            variable.default = variable.default.or(Some(variable.range.map_or(usual, |(low, high)| f64::midpoint(low, high))));
        }
    }

    /// Temperature of the surroundings at `condition`, K: that of the chamber.
    ///
    /// # Errors
    /// Errors of [`Machine::values`].
    pub fn surroundings(&self, condition: &Condition) -> Result<f64> {
        self.chamber.temperature.evaluate(&self.values(condition)?)
    }

    /// The value of every name that formulas use, at `condition`.
    ///
    /// # Errors
    /// The condition does not have one finite value per variable; a drive's speed or a definition is not finite at the
    /// condition.
    pub fn values(&self, condition: &Condition) -> Result<FormulaValues> {
        if condition.si.len() != self.variables.len() || condition.si.iter().any(|v| !v.is_finite()) {
            return Err(Error::input(format!("a condition of this machine is {} finite numbers", self.variables.len())));
        }
        let mut values = FormulaValues(vec![0.0; self.symbols.meanings.len()]);
        for (value, meaning) in values.0.iter_mut().zip(&self.symbols.meanings) {
            match *meaning {
                Meaning::Si(variable) => *value = condition.si[variable],
                Meaning::InUnit { variable, scale, offset } => *value = (condition.si[variable] - offset) / scale,
                Meaning::Drive(..) | Meaning::Definition(_) => {}
            }
        }
        let quantities = self.drives.iter().map(|d| Ok(drive_quantities(&d.parameters, d.speed.evaluate(&values)?)));
        let quantities: Vec<[f64; 7]> = quantities.collect::<Result<_>>()?;
        self.fill_drives(&mut values, &quantities);
        for (definition, slot) in self.definitions.iter().zip(&self.symbols.definition_slots) {
            values.0[*slot] = definition.formula.evaluate(&values)?;
        }
        Ok(values)
    }

    /// The derivative of every name with respect to one variable (index into [`Machine::variables`], per SI unit):
    /// the second argument of [`coldplate_base::formula::Formula::derivative`]. Drives and definitions are followed.
    ///
    /// # Errors
    /// Errors of [`Machine::values`]; a derivative is not finite; the variable does not exist.
    pub fn tangent(&self, condition: &Condition, variable: usize) -> Result<FormulaValues> {
        if variable >= self.variables.len() {
            return Err(Error::input(format!("this machine has {} variables, not {}", self.variables.len(), variable + 1)));
        }
        let values = self.values(condition)?;
        let mut tangent = FormulaValues(vec![0.0; values.0.len()]);
        for (slope, meaning) in tangent.0.iter_mut().zip(&self.symbols.meanings) {
            match *meaning {
                Meaning::Si(v) if v == variable => *slope = 1.0,
                Meaning::InUnit { variable: v, scale, .. } if v == variable => *slope = 1.0 / scale,
                _ => {}
            }
        }
        let mut slopes = Vec::with_capacity(self.drives.len());
        for drive in &self.drives {
            let along = drive.speed.derivative(&values, &tangent)?;
            slopes.push(drive_slopes(&drive.parameters, drive.speed.evaluate(&values)?).map(|slope| slope * along));
        }
        self.fill_drives(&mut tangent, &slopes);
        for (definition, slot) in self.definitions.iter().zip(&self.symbols.definition_slots) {
            tangent.0[*slot] = definition.formula.derivative(&values, &tangent)?;
        }
        Ok(tangent)
    }

    /// Supply of each circuit for these values of the formulas. The outflow of a feeding circuit counts with the
    /// temperature that enters the feeding circuit.
    ///
    /// # Errors
    /// A formula has no finite value, a flow is negative, or circuits take more than their feeders give.
    pub fn supplies(&self, values: &FormulaValues) -> Result<Vec<Supply>> {
        let (mut flows, mut inlets): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
        let mut taken = vec![0.0; self.circuits.len()];
        for circuit in &self.circuits {
            let offered = circuit.intake.offered(&flows, &inlets);
            let (flow, temperature) = match (&circuit.intake, offered) {
                (Intake::Stated { flow, temperature }, _) => (flow.evaluate(values)?, temperature.evaluate(values)?),
                (Intake::Fed { flow, .. }, offered) => {
                    let offered = offered.unwrap_or(Supply { flow: 0.0, temperature: 0.0 });
                    (flow.as_ref().map_or(Ok(offered.flow), |flow| flow.evaluate(values))?, offered.temperature)
                }
            };
            if flow < 0.0 {
                return Err(Error::input(format!("the flow of the circuit '{}' is negative at this condition", circuit.name)).read(flow));
            }
            if let Some(offered) = offered {
                for feeder in circuit.intake.feeders() {
                    taken[*feeder] += if offered.flow > 0.0 { flow * flows[*feeder] / offered.flow } else { flow };
                }
            }
            flows.push(flow);
            inlets.push(temperature);
        }
        for ((circuit, flow), taken) in self.circuits.iter().zip(&flows).zip(taken) {
            if taken > flow * (1.0 + 1e-9) {
                let litres = |flow: f64| format!("{:.6} L/min", flow * 6e4);
                return Err(Error::input(format!("the circuits that '{}' feeds take more than it gives", circuit.name))
                    .at_key(format!("circuit.{}.flow", circuit.name))
                    .read(format!("{} of {}", litres(taken), litres(*flow)))
                    .help("state the 'flow' of each circuit that takes part of it; without one it takes all"));
            }
        }
        Ok(flows.into_iter().zip(inlets).map(|(flow, temperature)| Supply { flow, temperature }).collect())
    }

    fn fill_drives(&self, values: &mut FormulaValues, quantities: &[[f64; 7]]) {
        for (value, meaning) in values.0.iter_mut().zip(&self.symbols.meanings) {
            if let Meaning::Drive(drive, quantity) = *meaning {
                *value = quantities[drive][quantity];
            }
        }
    }
}
