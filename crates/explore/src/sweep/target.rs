//! Scope of a sweep file, and its solver: our own, or another program.

use std::path::Path;

use super::SweepDefinition;
use super::definition::SOLVER;
use crate::external::Program;
use coldplate_base::document::Document;
use coldplate_base::error::Result;
use coldplate_describe::machine::{Machine, Scope};

impl SweepDefinition {
    /// The machine file with the changes of this file and then `sets`; `None` if this file names no machine.
    ///
    /// # Errors
    /// The machine file cannot be read, or a change not be made.
    pub fn machine_file(&self, sets: &[(String, String)]) -> Result<Option<Document>> {
        let Some(machine) = &self.machine else { return Ok(None) };
        let mut document = Document::read(machine)?;
        for (key, value) in self.set.iter().chain(sets) {
            document.apply_set(key, value).map_err(|error| error.in_file(document.file()))?;
        }
        Ok(Some(document))
    }

    /// Variables, measurement points and limits: those of the machine file with `sets`, or of this file if it names none.
    ///
    /// # Errors
    /// The machine file is wrong, or the tables in its place here are.
    pub fn scope(&self, sets: &[(String, String)]) -> Result<Scope> {
        Ok(self.asked(sets)?.0)
    }

    /// The scope, and the other program that solves, if there is one.
    ///
    /// # Errors
    /// Errors of [`SweepDefinition::scope`] and [`Program::read`].
    pub fn asked(&self, sets: &[(String, String)]) -> Result<(Scope, Option<Program>)> {
        let root = self.document().root();
        let machine = self.machine_file(sets)?.map(|document| Machine::from_document(&document)).transpose()?;
        if !root.has(SOLVER) {
            let machine = machine.ok_or_else(|| root.error_at("machine", "'machine' is missing").help("name the machine file"))?;
            return Ok((machine.scope(), None));
        }
        if self.cells.is_some() {
            return Err(root.error_at("cells", "another program makes its own mesh").help("remove the line"));
        }
        if self.machine.is_none()
            && let Some((key, _)) = self.set.iter().chain(sets).next()
        {
            return Err(root.error_at("set", format!("'{key}' cannot be changed: there is no machine file")).help("remove it"));
        }
        let folder = self.document().file().parent().unwrap_or(Path::new(""));
        let machine = machine.map(|machine| machine.scope());
        let variables = match &machine {
            Some(machine) => machine.variables.clone(),
            None => Scope::variables(&root)?,
        };
        let is_needed = |v: usize| machine.as_ref().is_none_or(|machine| machine.uses(v));
        let program = Program::read(&root, folder, &variables, is_needed)?;
        let hash = program.hash.clone();
        let scope = match machine {
            Some(machine) => Scope { hash, ..machine },
            None => Scope::new(&root, self.name.clone(), hash, variables, program.points())?,
        };
        Ok((scope, Some(program)))
    }
}

/// The scope of a file: of a machine, or of a sweep that another program solves.
///
/// # Errors
/// Errors of [`Machine::from_document`] and [`SweepDefinition::scope`].
pub fn scope_of(path: &Path) -> Result<Scope> {
    let document = Document::read(path)?;
    match document.root().has(SOLVER) {
        true => SweepDefinition::new(document)?.scope(&[]),
        false => Ok(Machine::from_document(&document)?.scope()),
    }
}
