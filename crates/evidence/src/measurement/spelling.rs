//! Names of columns that differ from those of the machine in capitals, blanks and signs alone.

use super::{TEST, TIME};
use coldplate_describe::machine::Machine;
use coldplate_tables::{Ledger, Table};

/// Calls every column by the name of the one condition or sensor that it spells with other capitals, blanks or signs, unless a column
/// has that name; the account says so.
pub(super) fn settle(table: &mut Table, ledger: &mut Ledger, machine: &Machine) {
    let sensors = machine.sensors.iter().map(|s| s.name.as_str());
    let known: Vec<&str> = machine.variables.iter().map(|v| v.name.as_str()).chain(sensors).chain([TEST, TIME]).collect();
    let taken: Vec<String> = table.columns.iter().map(|c| c.name.clone()).chain(table.texts.iter().map(|t| t.name.clone())).collect();
    let meant = |name: &str| -> Option<&str> {
        let own = letters(name);
        let mut alike = known.iter().filter(|known| letters(known) == own);
        let (first, second) = (*alike.next()?, alike.next());
        let is_alone = taken.iter().filter(|other| letters(other) == own).count() == 1;
        (second.is_none() && is_alone && first != name).then_some(first)
    };
    let mut read = Vec::new();
    for name in table.columns.iter_mut().map(|c| &mut c.name).chain(table.texts.iter_mut().map(|t| &mut t.name)) {
        let Some(own) = meant(name) else { continue };
        read.push(format!("'{name}' as '{own}'"));
        ledger.between.iter_mut().filter(|(other, _)| other == name).for_each(|(other, _)| *other = own.to_string());
        *name = own.to_string();
    }
    if !read.is_empty() {
        ledger.assumed.push(format!("columns are named: {}", read.join(", ")));
    }
}

/// Letters and digits of a name, in small letters.
fn letters(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}
