//! The sweep file: the machine and the conditions.

use std::path::{Path, PathBuf};

use super::builder::{Builder, Space};
use super::design::LevelSpacing;
use super::plan::{ConditionGroup, Plan, Purpose};
use coldplate_base::document::{Document, Section, Value, suggestion};
use coldplate_base::error::{Error, Faults, Result, all};
use coldplate_base::units::Dimension;
use coldplate_describe::machine::DescribedVariable;

/// A sweep file, read as far as it can be without its machine.
#[derive(Debug, Clone)]
pub struct SweepDefinition {
    /// One-line name.
    pub name: String,
    /// The machine file, found from the folder of the sweep file; none if another program solves a problem of its own.
    pub machine: Option<PathBuf>,
    /// Number of cells aimed at, if the file states it.
    pub cells: Option<usize>,
    /// Changes to the machine file: key and value, as for `--set`.
    pub set: Vec<(String, String)>,
    /// Further machines whose measured states are laid beside predictions in the report.
    pub compare: Vec<PathBuf>,
    /// Chart definitions to draw from the results.
    pub charts: Vec<PathBuf>,
    /// Settings of the fit.
    pub fit: FitKeys,
    /// Uncertain parameters of the machine that the sweep follows.
    pub uncertainty: Openness,
    /// Largest error of a reading against the full solution, K, up to which a reduced model answers a condition.
    pub accuracy: Option<f64>,
    document: Document,
}

/// Uncertain parameters that a sweep follows: the slopes of every reading along them are found beside the reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Openness {
    /// Parameters that the machine file calls uncertain, and those that every such model leaves open.
    All,
    /// Parameters that the machine file calls uncertain alone.
    Stated,
    /// No parameters.
    None,
}

impl Openness {
    const WORDS: [&str; 3] = ["all", "stated", "none"];

    fn read(root: &Section<'_>) -> Result<Self> {
        Ok([Self::All, Self::Stated, Self::None][root.opt_choice("uncertainty", &Self::WORDS)?.unwrap_or(0)])
    }
}

/// Name of the table of another program that solves.
pub(super) const SOLVER: &str = "solver";

/// Largest degree of a polynomial that a surrogate file holds.
const MOST_DEGREE: usize = coldplate_base::terms::MAX_DEGREE;
/// Default runs of the first design of an adaptive one, per varied variable; count. Chosen (docs/reference/sweep-file.md): more runs are
/// solved before the fit can choose.
const RUNS_PER_VARIABLE: usize = 6;
/// Least runs of the first design of an adaptive one, per varied variable; count. Chosen: fewer leave no fit to choose by.
const LEAST_PER_VARIABLE: usize = 3;
/// Default number of runs after which an adaptive design stops, per varied variable; count. Chosen (docs/reference/sweep-file.md).
const MOST_PER_VARIABLE: usize = 50;
/// Tables that may stand in the file but have no keys, each with the remedy for a key in it.
const EMPTY: [(&str, &str); 3] = [
    ("chart", "name chart definitions at the head of the file: charts = [\"../charts/NAME.toml\"]"),
    ("report", "the report has no settings"),
    ("accept", "limits stand in the machine file, as [limit.NAME]"),
];

/// Tables that a design may have.
const OF_DESIGNS: [&str; 8] = ["design", "one_factor", "range", "levels", "spacing", "hold", "validation", "follow"];

/// Settings of the fit, as the file states them; see `FitOptions`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FitKeys {
    /// Largest total degree of a polynomial.
    pub max_degree: Option<usize>,
    /// Folds of the cross-validation.
    pub folds: Option<usize>,
    /// Seed of the folds.
    pub seed: Option<u64>,
}

impl SweepDefinition {
    /// Reads a sweep file. The design is checked by [`SweepDefinition::plan`], which knows the machine's variables.
    ///
    /// # Errors
    /// The file cannot be read, is not TOML, or one of `name`, `machine`, `cells`, `set` is wrong.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        Self::new(Document::read(path)?)
    }

    /// Reads a parsed sweep file, as [`SweepDefinition::read`] does.
    ///
    /// # Errors
    /// Errors of [`SweepDefinition::read`].
    pub fn new(document: Document) -> Result<Self> {
        let root = document.root();
        let folder = document.file().parent().unwrap_or(Path::new(""));
        // Each key by itself, so that all mistakes show at once.
        let mut faults = Faults::default();
        let machine = faults.take(if root.has(SOLVER) { root.opt_text("machine") } else { root.text("machine").map(Some) });
        let machine = machine.flatten().map(|machine| folder.join(machine));
        let name = faults.take(root.text("name"));
        let cells = faults.take(root.opt_integer("cells", 1)).flatten();
        let mut set = Vec::new();
        if let Some(section) = root.opt("set") {
            faults.take(flatten(&section, "", &mut set));
        }
        let mut files = |key: &str| -> Vec<PathBuf> {
            let named = faults.take(root.opt_texts(key)).flatten().unwrap_or_default();
            named.iter().map(|path| folder.join(path)).collect()
        };
        let (compare, charts) = (files("compare"), files("charts"));
        for table in EMPTY {
            faults.take(has_no_keys(&root, table));
        }
        let fit = faults.take(fit_keys(&root));
        let uncertainty = faults.take(Openness::read(&root));
        let accuracy = faults.take(root.opt_positive("accuracy", Dimension::DIFFERENCE)).flatten();
        if accuracy.is_some() && root.has(SOLVER) {
            let error = root.error_at("accuracy", "another program solves this sweep: there is no network to make a reduced model of");
            faults.take::<()>(Err(error.help("remove the line")));
        }
        faults.end()?;
        let (name, fit, uncertainty) = (name.unwrap_or_default(), fit.unwrap_or_default(), uncertainty.unwrap_or(Openness::All));
        Ok(Self { name, machine, cells, set, compare, charts, fit, uncertainty, accuracy, document })
    }

    /// The parsed file, for the tables that others read from it.
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// The conditions to run, for a machine with these variables.
    ///
    /// # Errors
    /// An unknown key or variable, a value out of place, a variable that is neither varied nor held, an empty design.
    pub fn plan(&self, variables: &[DescribedVariable]) -> Result<Plan> {
        let root = self.document.root();
        let others = EMPTY.map(|(table, _)| table);
        for key in ["name", "machine", "cells", "set", "compare", "charts", "fit", "uncertainty", "accuracy"].into_iter().chain(others) {
            let _ = root.has(key);
        }
        // These keys are read by the reader of [solver].
        if root.has(SOLVER) {
            let own: &[&str] = if self.machine.is_none() { &["variables", "limit"] } else { &[] };
            for key in ["point"].iter().chain(own) {
                let _ = root.has(key);
            }
        }
        let sweeps = root.tables("one_factor")?;
        let mut builder = Builder::new(self.name.clone(), variables);
        let mut faults = Faults::default();
        if root.has("design") || sweeps.is_empty() {
            faults.take(self.one_design(&root, variables, &mut builder));
        }
        if let Some(section) = faults.take(root.opt_section("follow")).flatten() {
            faults.take(follow(section, variables, &mut builder));
        }
        let common = faults.take(held(&root, variables)).unwrap_or_default();
        for sweep in sweeps {
            faults.take(one_factor(sweep, variables, &common, &mut builder));
        }
        if let Err(error) = faults.end() {
            // Tables behind the first mistake of a design were not asked for.
            for key in OF_DESIGNS {
                let _ = root.has(key);
            }
            return Err(error.and(root.finish().err()));
        }
        root.finish()?;
        let plan = builder.finish().map_err(|e| e.in_file(self.document.file()))?;
        Ok(Plan { accuracy: self.accuracy, ..plan })
    }

    fn one_design(&self, root: &Section<'_>, variables: &[DescribedVariable], builder: &mut Builder) -> Result<()> {
        let design = root.section("design")?;
        let kinds = ["latin_hypercube", "sobol", "factorial", "list", "adaptive"];
        let kind = kinds[design.choice("kind", &kinds)?];
        if let Some(value) = design.opt("accuracy").filter(|_| kind != "adaptive") {
            return Err(value
                .error(format!("a design of kind '{kind}' has as many runs as are given, whatever the accuracy"))
                .help("write kind = \"adaptive\" to add runs until the accuracy is reached, or remove the line"));
        }
        if kind == "list" {
            let held = held(root, variables)?;
            let file = self.document.file().parent().unwrap_or(Path::new("")).join(design.text("file")?);
            builder.list(&file, &held)?;
            return design.finish();
        }
        let mut faults = Faults::default();
        let held = faults.take(held(root, variables)).unwrap_or_default();
        let spacings = faults.take(spacings(root, variables)).unwrap_or_default();
        let mut space = builder.space(&held);
        for (at, value) in faults.take(by_variable(root, "range", variables)).unwrap_or_default() {
            let spacing = spacings.iter().find(|(v, _)| *v == at).map_or(LevelSpacing::Linear, |(_, s)| *s);
            let range = value.range(variables[at].dimension).and_then(|(low, high)| {
                let placed = variables[at].check(low).and_then(|()| space.vary(at, low, high, spacing));
                placed.map_err(|e| value.place(e))
            });
            faults.take(range);
        }
        faults.end()?;
        if kind == "factorial" {
            for (at, value) in by_variable(root, "levels", variables)? {
                space.levels(at, value.quantities(variables[at].dimension, None)?).map_err(|e| value.place(e))?;
            }
        }
        if let Some((stray, _)) = spacings.iter().find(|(at, _)| !space.is_varied(*at)) {
            let name = variables[*stray].name.clone();
            return Err(root
                .error_at("spacing", format!("'{name}' has a spacing but no range"))
                .help(format!("give it a range under [range], or remove {name}")));
        }
        if space.is_empty() {
            return Err(design
                .error_at("kind", "no variable is varied")
                .help("give at least one a range under [range], e.g. coolant_flow = [\"3 L/min\", \"18 L/min\"]"));
        }
        let place = |e: Error| match design.opt("runs").or_else(|| design.opt("kind")) {
            Some(value) => value.place(e),
            None => e,
        };
        match kind {
            "latin_hypercube" => {
                let corners = design.opt_flag("corners")?.unwrap_or(false);
                space.latin_hypercube(design.integer("runs", 2)?, seed(&design)?.unwrap_or(1), corners).map_err(place)?;
            }
            "adaptive" if self.accuracy.is_some() => {
                let what = "the few runs of an adaptive design are all solved in full";
                return Err(root.error_at("accuracy", what).help("remove this line; that of the [design] says when the design is done"));
            }
            "adaptive" => adaptive(&design, &mut space)?,
            "sobol" => space.sobol(design.integer("runs", 1)?, seed(&design)?).map_err(place)?,
            _ => space.factorial(design.opt_integer("points", 1)?).map_err(place)?,
        }
        if let Some(validation) = root.opt_section("validation")? {
            space.validation(validation.integer("runs", 1)?, seed(&validation)?.unwrap_or(2));
            validation.finish()?;
        }
        space.into_groups(builder);
        design.finish()
    }
}

/// Checks that a table that may stand in the file has no keys.
fn has_no_keys(root: &Section<'_>, (table, help): (&str, &str)) -> Result<()> {
    let section = root.section_or_empty(table)?;
    section.keys().next().map_or(Ok(()), |key| Err(section.error_at(key, format!("unknown key '{key}': [{table}] has none")).help(help)))
}

/// Reads `[fit]`.
fn fit_keys(root: &Section<'_>) -> Result<FitKeys> {
    let section = root.section_or_empty("fit")?;
    let max_degree = section.opt_integer("max_degree", 0)?;
    if max_degree.is_some_and(|degree| degree > MOST_DEGREE) {
        return Err(section.error_at("max_degree", format!("the degree is at most {MOST_DEGREE}")).help("6 is usual"));
    }
    let keys = FitKeys { max_degree, folds: section.opt_integer("folds", 2)?, seed: seed(&section)? };
    section.finish()?;
    Ok(keys)
}

/// Reads the keys of a design that grows.
fn adaptive(design: &Section<'_>, space: &mut Space) -> Result<()> {
    let n = space.varied();
    if n < 2 {
        return Err(design
            .error_at("kind", "an adaptive design varies at least two variables")
            .help("give another variable a range under [range], or run [[one_factor]] over this one"));
    }
    let accuracy = design.positive("accuracy", Dimension::DIFFERENCE)?;
    let runs = design.opt_integer("runs", 1)?.unwrap_or(RUNS_PER_VARIABLE * n);
    if runs < LEAST_PER_VARIABLE * n {
        return Err(design
            .error_at("runs", format!("a first design of {n} variables has at least {} runs", LEAST_PER_VARIABLE * n))
            .help(format!("{} are usual; leave the line out to have them", RUNS_PER_VARIABLE * n)));
    }
    let most = design.opt_integer("max_runs", 1)?.unwrap_or((MOST_PER_VARIABLE * n).max(2 * runs));
    if most <= runs {
        return Err(design
            .error_at("max_runs", format!("the first design has {runs} runs already, and runs are added until {most}"))
            .help("make max_runs larger than runs"));
    }
    let seed = seed(design)?.unwrap_or(1);
    space.adaptive(runs, most, seed, accuracy).map_err(|e| design.opt("max_runs").map_or(e.clone(), |value| value.place(e)))
}

fn seed(section: &Section<'_>) -> Result<Option<u64>> {
    Ok(section.opt_integer("seed", 0)?.map(|seed| seed as u64))
}

/// Reads `[follow]`: held variables whose effect on the answers a surrogate is to know.
fn follow(section: Section<'_>, variables: &[DescribedVariable], builder: &mut Builder) -> Result<()> {
    let value = section.value("variables")?;
    let named = if value.is_list() { Some(value.list()?.iter().map(Value::text).collect::<Result<Vec<_>>>()?) } else { None };
    if named.is_none() && value.text()? != "all" {
        return Err(value
            .error("which held variables are followed is a list, or \"all\"")
            .help("write variables = \"all\", or [\"NAME\", ..]"));
    }
    let mut followed = Vec::new();
    match named {
        None => {
            followed.extend(variables.iter().enumerate().filter(|(at, _)| !builder.varies(*at)).filter_map(|(at, v)| Some((at, v.range?))))
        }
        Some(names) => {
            for name in &names {
                let known: Vec<&str> = variables.iter().map(|v| v.name.as_str()).collect();
                let at = known.iter().position(|own| own == name);
                let at = at.ok_or_else(|| value.error(format!("there is no variable '{name}'")).help(suggestion(name, &known)))?;
                let range = variables[at].range.ok_or_else(|| {
                    value.error(format!("'{name}' has no range in the machine file")).help("give it one there: range = [\"LOW\", \"HIGH\"]")
                })?;
                followed.push((at, range));
            }
        }
    }
    followed.sort_by_key(|(at, _)| *at);
    followed.dedup_by_key(|(at, _)| *at);
    if followed.is_empty() {
        return Err(value.error("no held variable has a range in the machine file").help("give one a range there, or remove [follow]"));
    }
    let runs = section.opt_integer("runs", 1)?;
    section.finish()?;
    builder.follow(&followed, runs).map_err(|e| value.place(e))
}

/// One `[[one_factor]]`: a variable runs over its range, the others are held.
fn one_factor(sweep: Section<'_>, variables: &[DescribedVariable], common: &[(usize, f64)], builder: &mut Builder) -> Result<()> {
    let names: Vec<&str> = variables.iter().map(|v| v.name.as_str()).collect();
    let at = sweep.choice("variable", &names)?;
    let dimension = variables[at].dimension;
    let (low, high) = (sweep.quantity("low", dimension)?, sweep.quantity("high", dimension)?);
    if low >= high {
        return Err(sweep.error_at("high", "the end of the range must be above its start").help("exchange low and high"));
    }
    variables[at].check(low).map_err(|e| sweep.error_at("low", e.what()).help(e.remedy().unwrap_or_default()))?;
    let mut held_here = held(&sweep, variables)?;
    if held_here.iter().any(|(v, _)| *v == at) {
        return Err(sweep.error_at("hold", format!("'{}' is both varied and held", names[at])).help("remove it from hold"));
    }
    // A value held for all sweeps gives way to one held for this sweep, and to the variable that this sweep varies.
    held_here.extend(common.iter().filter(|(v, _)| *v != at && !held_here.iter().any(|(h, _)| h == v)).copied().collect::<Vec<_>>());
    let spacing = LevelSpacing::named(sweep.opt_choice("spacing", &LevelSpacing::NAMES)?.unwrap_or(0));
    let points = sweep.integer("points", 2)?;
    let group = ConditionGroup {
        name: sweep.opt_text("name")?.unwrap_or_else(|| names[at].to_string()),
        purpose: Purpose::Fit,
        varied: vec![at],
        degree: sweep.opt_integer("degree", 0)?,
        description: format!("one factor, {points} points"),
        rows: 0..0,
    };
    if builder.has_group(&group.name) {
        return Err(sweep
            .error_at("name", format!("two sweeps are called '{}'", group.name))
            .help("give each [[one_factor]] its own name"));
    }
    let value = sweep.value("low")?;
    let mut space = builder.space(&held_here);
    space.vary(at, low, high, spacing).map_err(|e| value.place(e))?;
    space.one_factor(points, group);
    space.into_groups(builder);
    sweep.finish()
}

/// The values of a table keyed by variable names, in the machine's order.
fn by_variable<'a>(section: &Section<'a>, key: &str, variables: &[DescribedVariable]) -> Result<Vec<(usize, Value<'a>)>> {
    let Some(table) = section.opt_section(key)? else { return Ok(Vec::new()) };
    let found = variables.iter().enumerate().filter_map(|(at, v)| Some((at, table.opt(&v.name)?))).collect();
    table.finish()?;
    Ok(found)
}

fn held(section: &Section<'_>, variables: &[DescribedVariable]) -> Result<Vec<(usize, f64)>> {
    all(by_variable(section, "hold", variables)?.into_iter().map(|(at, value)| {
        let si = value.quantity(variables[at].dimension)?;
        variables[at].check(si).map_err(|e| value.place(e))?;
        Ok((at, si))
    }))
}

fn spacings(section: &Section<'_>, variables: &[DescribedVariable]) -> Result<Vec<(usize, LevelSpacing)>> {
    let table = by_variable(section, "spacing", variables)?;
    table.into_iter().map(|(at, value)| Ok((at, LevelSpacing::named(value.choice(&LevelSpacing::NAMES)?)))).collect()
}

/// `[set]` as pairs of a dotted key and the TOML of its value; tables inside it are walked through.
fn flatten(value: &Value<'_>, key: &str, found: &mut Vec<(String, String)>) -> Result<()> {
    if !value.is_table() {
        found.push((key.to_string(), toml_of(value)?));
        return Ok(());
    }
    let section = value.section()?;
    let names: Vec<&str> = section.keys().collect();
    for name in names {
        // `"contact.motor.conductance" = ...` in quotes is a whole key, as on the command line.
        let bare = name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.' | '[' | ']' | '"'));
        let name_shown = if bare { name.to_string() } else { format!("\"{name}\"") };
        let path = if key.is_empty() { name_shown } else { format!("{key}.{name_shown}") };
        flatten(&section.value(name)?, &path, found)?;
    }
    Ok(())
}

fn toml_of(value: &Value<'_>) -> Result<String> {
    if value.is_text() {
        return value.text_with_spread();
    }
    if value.is_list() {
        let items: Vec<String> = (value.list()?.iter())
            .map(|item| if item.is_text() { Ok(toml::Value::String(item.text()?).to_string()) } else { toml_of(item) })
            .collect::<Result<_>>()?;
        return Ok(format!("[{}]", items.join(", ")));
    }
    if value.is_number() { value.number().map(|n| n.to_string()) } else { value.flag().map(|f| f.to_string()) }
}
