//! Columns of the table that state a temperature around the machine, and are off: a room's sensor that stands too near, one in a dead corner
//! of the tank. Where a circuit's inlet or the chamber alone follow the column, their own kinds say so.

use super::file::text;
use super::words::Quantity;
use super::{Family, Hypothesis, Law, Linearised, Lines, MachineEdit, Prepared, Site, Told, UserKind, along};
use coldplate_base::condition::{AMBIENT_TEMPERATURE, COOLANT_TEMPERATURE};
use coldplate_base::document::{Leaf, quoted};
use coldplate_base::error::Result;
use coldplate_describe::machine::Condition;
use coldplate_network::Load;
use coldplate_solve::sensitivity::Disturbance;
use coldplate_solve::study::Study;

/// Tables of the file whose texts are no formulas of the machine.
const NO_FORMULAS: [&str; 5] = ["name", "variables.", "limit.", "measurement.", "sensor."];
const CHAMBER: &str = "chamber.temperature";

/// Offset of a temperature among the machine's variables, K.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Variable(pub usize);

impl Variable {
    fn name(self, study: &Study) -> &str {
        &study.model.machine.variables[self.0].name
    }

    /// Values of the file in which the variable stands, those that it has by default among them: key and value.
    fn named_in(self, study: &Study) -> Result<Vec<(String, Leaf)>> {
        let (document, name) = (study.document(), self.name(study));
        let mut found = Vec::new();
        for key in document.keys().into_iter().filter(|key| NO_FORMULAS.iter().all(|own| !key.starts_with(own))) {
            let Some(leaf) = document.leaf(&key)? else { continue };
            if names(&leaf, name) {
                found.push((key, leaf));
            }
        }
        let by_default = |key: &str| -> Result<bool> { Ok(document.leaf(key)?.is_none()) };
        if name == AMBIENT_TEMPERATURE && by_default(CHAMBER)? {
            found.push((CHAMBER.into(), Leaf::Text(name.into())));
        }
        for key in inlets(study).into_iter().filter(|_| name == COOLANT_TEMPERATURE) {
            if by_default(&key)? {
                found.push((key, Leaf::Text(name.into())));
            }
        }
        Ok(found)
    }
}

/// Keys of the inlet temperatures of circuits that are fed from without.
fn inlets(study: &Study) -> Vec<String> {
    let fed_from_without = study.model.machine.circuits.iter().filter(|c| c.intake.feeders().is_empty());
    fed_from_without.map(|c| format!("circuit.{}.inlet_temperature", quoted(&c.name))).collect()
}

/// Words of a formula, each with whether it can be a name.
fn words(formula: &str) -> Vec<(&str, bool)> {
    let is_of_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut found: Vec<(&str, bool)> = Vec::new();
    let mut start = 0;
    for (at, c) in formula.char_indices() {
        let before = formula[start..at].chars().next();
        if before.is_some_and(|before| is_of_name(before) != is_of_name(c)) {
            found.push((&formula[start..at], before.is_some_and(is_of_name)));
            start = at;
        }
    }
    found.push((&formula[start..], formula[start..].starts_with(is_of_name)));
    found
}

/// Whether a word is a temperature by its name, in its own unit or another.
fn is_named(word: &str, name: &str) -> bool {
    word == name || word.strip_prefix(name).is_some_and(|unit| unit.starts_with('_'))
}

fn names(leaf: &Leaf, name: &str) -> bool {
    match leaf {
        Leaf::Text(formula) => words(formula).iter().any(|(word, is_name)| *is_name && is_named(word, name)),
        Leaf::Table(entries) => entries.iter().any(|(_, leaf)| names(leaf, name)),
        Leaf::List(items) => items.iter().any(|leaf| names(leaf, name)),
        _ => false,
    }
}

/// A value in which the temperature is warmer by a formula of kelvin; `None` where it counts in another unit.
fn warmer(leaf: &Leaf, name: &str, kelvin: &str) -> Option<Leaf> {
    Some(match leaf {
        Leaf::Text(own) if own.trim() == name => Leaf::Text(format!("{name}_degC + {kelvin}")),
        Leaf::Text(formula) => {
            let word = |(word, is_name): (&str, bool)| match word.strip_prefix(name) {
                Some("_degC" | "_K") if is_name => Some(format!("({word} + {kelvin})")),
                Some(unit) if is_name && (unit.is_empty() || unit.starts_with('_')) => None,
                _ => Some(word.to_string()),
            };
            Leaf::Text(words(formula).into_iter().map(word).collect::<Option<String>>()?)
        }
        Leaf::Table(entries) => {
            let one = |(key, leaf): &(String, Leaf)| Some((key.clone(), warmer(leaf, name, kelvin)?));
            Leaf::Table(entries.iter().map(one).collect::<Option<_>>()?)
        }
        Leaf::List(items) => Leaf::List(items.iter().map(|leaf| warmer(leaf, name, kelvin)).collect::<Option<_>>()?),
        other => other.clone(),
    })
}

impl Variable {
    /// Which of the machine's variables.
    pub fn variable(&self) -> usize {
        self.0
    }
}

impl Family for Variable {
    fn candidates(site: &Site<'_>) -> Vec<Hypothesis> {
        let all_inlets = inlets(site.study);
        let has_no_kind_of_its_own = |v: &usize| {
            let Ok(found) = Self(*v).named_in(site.study) else { return false };
            // Without anything that radiates or feels gas, the chamber's temperature acts on nothing.
            let keys: Vec<&String> = found.iter().map(|(key, _)| key).filter(|key| *key != CHAMBER || site.is_in_vacuum).collect();
            let is_inlet = |key: &&String| all_inlets.contains(key);
            match keys[..] {
                [] => false,
                [one] => one != CHAMBER && !is_inlet(&one),
                _ => !(keys.iter().all(is_inlet) && keys.len() == all_inlets.len()),
            }
        };
        let temperatures = site.machine.variables.iter().enumerate().filter(|(_, own)| own.dimension.is_absolute());
        let found = temperatures.map(|(v, _)| v).filter(has_no_kind_of_its_own);
        found.map(|v| Hypothesis::signed(Self(v), Self(v).name(site.study), Vec::new(), site.machine.priors.surroundings, "K")).collect()
    }

    fn kind(&self) -> &'static str {
        "condition offset"
    }

    fn lines(&self, edit: &MachineEdit<'_>) -> Result<Lines> {
        let kelvin = format!("({:?}) * ({})", edit.amplitude, edit.law());
        let name = self.name(edit.study);
        let line = |(key, leaf): (String, Leaf)| {
            let now = warmer(&leaf, name, &kelvin)?;
            Some((key, if let Leaf::Text(formula) = now { text(formula) } else { now.to_toml() }))
        };
        Ok(self.named_in(edit.study)?.into_iter().map(line).collect())
    }

    fn prepared(&self, study: &Study, _user: &[UserKind]) -> Option<Prepared> {
        along(study, self.name(study))
    }

    fn disturbance(&self, at: &Linearised<'_, '_>) -> Option<Disturbance> {
        let machine = at.machine();
        let moved = |by: f64| {
            let mut values = at.load().variables.clone();
            values[self.0] += by;
            Load::at(machine, &Condition::from_si(values)).ok()
        };
        // One kelvin: what follows a temperature does so nearly in proportion.
        let (more, less) = (moved(0.5)?, moved(-0.5)?);
        let fed_from_without = machine.circuits.iter().enumerate().filter(|(_, c)| c.intake.feeders().is_empty());
        let inlets = fed_from_without.map(|(c, _)| (c, more.inlets[c] - less.inlets[c])).filter(|(_, warmer)| *warmer != 0.0);
        Some(Disturbance { inlets: inlets.collect(), surroundings: more.chamber - less.chamber, ..at.along()? })
    }

    fn says_when(&self) -> bool {
        true
    }

    fn quantity(&self, _law: Law) -> Quantity {
        Quantity::plain("offset", "K")
    }

    fn sentence(&self, told: &Told<'_>) -> String {
        format!("{} is in truth {}{}", told.place(), told.warmer(), told.when())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_temperature_is_replaced_wherever_a_formula_names_it_and_nowhere_else() {
        let after = |formula: &str| warmer(&Leaf::Text(formula.into()), "room", "(2.0) * (1)");
        let text = |formula: &str| Some(Leaf::Text(formula.into()));
        assert_eq!(after("room"), text("room_degC + (2.0) * (1)"));
        assert_eq!(after("0.5 * room_degC + 0.5*room_K"), text("0.5 * (room_degC + (2.0) * (1)) + 0.5*(room_K + (2.0) * (1))"));
        assert_eq!(after("2 * broom_degC - roomy"), text("2 * broom_degC - roomy"));
        assert_eq!(after("room_degF"), None);
        assert!(!names(&Leaf::Text("20 degC".into()), "room") && names(&Leaf::Text("max(room_K, 3)".into()), "room"));
    }
}
