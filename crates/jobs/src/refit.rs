//! A small surrogate of a machine over the ranges its file states.

use std::path::Path;

use super::figures::TableComparison;
use super::fitting::{fit_table_heard, with_uncertainty};
use coldplate_base::document::Document;
use coldplate_base::error::{Error, Result};
use coldplate_base::progress::Progress;
use coldplate_base::units::express;
use coldplate_describe::machine::{DescribedVariable, Machine};
use coldplate_explore::sweep::sweep_file::Sweep;
use coldplate_explore::sweep::{self, SweepDefinition};
use coldplate_solve::study::Study;
use coldplate_surrogate::fit::{FitOptions, file};

/// Number of held-out conditions. Chosen: each costs a solve.
const HELD_OUT: usize = 16;
/// Number of runs per varied variable beside the corners. Chosen: more make a better surrogate, each costs a solve.
const PER_VARIABLE: usize = 12;
/// Most variables whose corners are run too, a count. Chosen: the number of corners doubles with each.
const CORNERS: u32 = 5;

/// A surrogate and its errors.
#[derive(Debug)]
pub struct Refit {
    /// The surrogate file.
    pub bytes: Vec<u8>,
    /// Conditions it was fitted to.
    pub conditions: usize,
    /// Conditions that could not be solved.
    pub failed: usize,
    /// Largest error of any point on held-out conditions, K.
    pub largest: Option<f64>,
    /// Remarks of the fit.
    pub notes: Vec<String>,
}

/// Checks that a machine states enough for a design.
///
/// # Errors
/// No variable has a range, or one has neither range nor default.
pub fn check(machine: &Machine) -> Result<()> {
    if !machine.variables.iter().any(is_varied) {
        return Err(Error::input("the machine file gives no condition a range, so there is nothing to fit a surrogate over")
            .at_key("variables")
            .help("write for example [variables.coolant_flow] range = [\"2 L/min\", \"8 L/min\"]"));
    }
    match machine.variables.iter().find(|v| !is_varied(v) && v.default.is_none()) {
        Some(v) => Err(Error::input(format!("the variable '{}' has neither a range nor a default", v.name))
            .at_key(format!("variables.{}", v.name))
            .help("give it one of them")),
        None => Ok(()),
    }
}

fn is_varied(variable: &DescribedVariable) -> bool {
    variable.range.is_some_and(|(low, high)| high > low)
}

/// Solves a small design on about `cells` cells and fits it; `folder` is for the journal, `name` for errors and provenance.
///
/// # Errors
/// Errors of [`check`], [`Sweep::run`] and [`fit_table_heard`].
pub fn refit(document: &Document, cells: usize, name: &str, folder: &Path, progress: &dyn Progress) -> Result<Refit> {
    let machine = Machine::from_document(document)?;
    check(&machine)?;
    let varied: Vec<&DescribedVariable> = machine.variables.iter().filter(|v| is_varied(v)).collect();
    let n = varied.len() as u32;
    let corners = n <= CORNERS;
    let runs = PER_VARIABLE * varied.len() + if corners { 1 << n } else { 0 };
    let range = |v: &&DescribedVariable| -> Result<String> {
        let (low, high) = v.range.unwrap_or_default();
        let text = |si: f64| express(si, &v.unit, v.dimension).map(|value| format!("\"{value:?} {}\"", v.unit));
        Ok(format!("{} = [{}, {}]\n", v.name, text(low)?, text(high)?))
    };
    let ranges = varied.iter().map(range).collect::<Result<String>>()?;
    let text = format!(
        "name = {name:?}\nmachine = \"\"\n[design]\nkind = \"latin_hypercube\"\nruns = {runs}\nseed = 1\ncorners = {corners}\n\
         [range]\n{ranges}[validation]\nruns = {HELD_OUT}\nseed = 2\n"
    );
    let definition = SweepDefinition::new(Document::parse(&text, "the design of the surrogate")?)?;
    let plan = definition.plan(&machine.variables)?;
    let sweep = Sweep::of(definition, plan, Study::new(document.clone(), Some(cells))?)?;
    let swept = sweep.run(folder, sweep::SweepOptions { progress: Some(progress), ..Default::default() })?;
    let mut fit = fit_table_heard(&swept.table, Some(&sweep.scope), &FitOptions::default(), progress)?;
    with_uncertainty(&mut fit, swept.slopes.as_ref())?;
    let bytes = file::encode(&fit.surrogate)?;
    let mut largest = None;
    if let Some(validation) = &swept.validation {
        let opened = file::open(&bytes)?;
        let mut comparison = TableComparison::default();
        comparison.add(&opened, validation, true)?;
        largest = (0..opened.point_count()).filter_map(|p| comparison.held_out_errors(p, 0.0)).map(|e| e.0).reduce(f64::max);
    }
    Ok(Refit { bytes, conditions: swept.table.rows(), failed: swept.failures.len(), largest, notes: fit.notes })
}
