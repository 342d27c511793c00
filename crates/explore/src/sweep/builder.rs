//! Rows of a [`Plan`] from ranges and held values.

use std::path::Path;

use super::adaptive::{ADDED, Axis, DesignGrowth, typed};
use super::design::{self, LevelSpacing};
use super::plan::{ConditionGroup, Plan, Purpose};
use coldplate_base::error::{Error, Result};
use coldplate_base::terms::FOLLOW_CHECK;
use coldplate_describe::machine::DescribedVariable;
use coldplate_tables::Table;

/// Most conditions of a design, count. Chosen: a guard against typing errors.
const MOST_CONDITIONS: usize = 1_000_000;

/// Group of conditions with one held variable at other values.
const FOLLOW: &str = "follow";
/// Group of conditions with all held variables at other values.
const FOLLOW_TOGETHER: &str = "follow together";
/// Least number of design conditions at which one held variable is moved, to two values each; count. Chosen.
const LEAST_FOLLOWED: usize = 4;
/// Conditions at which all held variables are moved, per variable; count. Chosen, and stated in docs/reference/sweep-file.md.
const JOINED_PER_VARIABLE: usize = 6;
/// Least number of conditions that check the effect of held variables, count. Chosen, and stated in docs/reference/sweep-file.md.
const LEAST_CHECKS: usize = 10;
/// Seed of the values of held variables at these conditions. Chosen.
const CHECK_SEED: u64 = 3;
/// Prime steps from condition to condition, count, of which the first that meets all conditions is taken: neighbours in a
/// design then do not get neighbouring values. Chosen.
const STRIDES: [usize; 3] = [7, 11, 13];

/// Values of a range, evenly apart from end to end, without an end that is the held value.
fn apart(held: f64, low: f64, high: f64, count: usize) -> Vec<f64> {
    let (first, last) = (usize::from(held <= low), usize::from(held >= high));
    let steps = (count + first + last - 1) as f64;
    (first..count + first).map(|k| low + (high - low) * k as f64 / steps).collect()
}

/// Collects groups of conditions.
#[derive(Debug)]
pub(super) struct Builder {
    plan: Plan,
}

/// The ranges of one design, and the groups of conditions made in them (SI).
#[derive(Debug)]
pub(super) struct Space {
    variables: Vec<DescribedVariable>,
    held: Vec<(usize, f64)>,
    axes: Vec<Axis>,
    groups: Vec<(ConditionGroup, Vec<Vec<f64>>)>,
    growth: Option<DesignGrowth>,
}

impl Builder {
    pub(super) fn new(name: String, variables: &[DescribedVariable]) -> Self {
        Self {
            plan: Plan {
                name,
                variables: variables.to_vec(),
                groups: Vec::new(),
                shown: Vec::new(),
                conditions: Vec::new(),
                growth: None,
                accuracy: None,
            },
        }
    }

    pub(super) fn has_group(&self, name: &str) -> bool {
        self.plan.groups.iter().any(|g| g.name == name)
    }

    /// Whether any condition so far varies a variable.
    pub(super) fn varies(&self, variable: usize) -> bool {
        self.plan.groups.iter().any(|g| g.varied.contains(&variable))
    }

    /// A design with these variables (index, SI) held.
    pub(super) fn space(&self, held: &[(usize, f64)]) -> Space {
        Space { variables: self.plan.variables.clone(), held: held.to_vec(), axes: Vec::new(), groups: Vec::new(), growth: None }
    }

    /// Adds the conditions of a CSV file; variables without a column are held or take their default.
    pub(super) fn list(&mut self, file: &Path, held: &[(usize, f64)]) -> Result<()> {
        let table = Table::read(file)?;
        let names: Vec<&str> = self.plan.variables.iter().map(|v| v.name.as_str()).collect();
        for column in table.columns.iter().filter(|c| !names.contains(&c.name.as_str())) {
            // A name that differs by two typing errors at most is a misspelt variable. Any other is a column of its own, such
            // as a reading.
            if let Some(meant) = names.iter().find(|name| strsim::damerau_levenshtein(name, &column.name) <= 2) {
                let error =
                    Error::input(format!("'{}' is not a variable of this machine", column.name)).in_file(file).at_key(column.header());
                return Err(error.help(format!("did you mean '{meant}'?")));
            }
        }
        if let Some(text) = table.texts.iter().find(|t| names.contains(&t.name.as_str())) {
            return Err(table.column(&text.name).err().unwrap_or_else(|| Error::input("this column has no unit")).in_file(file));
        }
        let mut space = self.space(held);
        let mut columns = Vec::new();
        for (at, variable) in space.variables.iter().enumerate() {
            if !table.columns.iter().any(|c| c.name == variable.name) {
                continue;
            }
            let values = table.column_si(&variable.name, variable.dimension).map_err(|e| e.in_file(file))?;
            if let Some(row) = values.iter().position(|v| v.is_nan()) {
                let error = Error::input(format!("the value of row {} is missing", row + 1)).in_file(file).at_key(&variable.name);
                return Err(error.help("a condition needs a value in every column"));
            }
            columns.push((at, values));
        }
        let varied: Vec<usize> = columns.iter().map(|(at, _)| *at).collect();
        if varied.is_empty() || table.rows() == 0 {
            return Err(Error::input("the file holds no conditions").in_file(file).help(format!("columns wanted: {}", names.join(", "))));
        }
        for (at, values) in &columns {
            space.axes.push(Axis { variable: *at, low: values[0], high: values[0], spacing: LevelSpacing::Linear, levels: None });
        }
        let points = (0..table.rows()).map(|row| columns.iter().map(|(_, values)| values[row]).collect()).collect();
        let description = format!("list of {} conditions", table.rows());
        space
            .groups
            .push((ConditionGroup { name: "design".into(), purpose: Purpose::Fit, varied, degree: None, description, rows: 0..0 }, points));
        space.into_groups(self);
        Ok(())
    }

    /// Adds conditions with other values of held variables (index, range in SI) than in the first design: each of them alone,
    /// at two values, at some of the design's conditions, and all of them together at others.
    ///
    /// # Errors
    /// There is no design; a variable is varied, or its held value lies outside its range.
    pub(super) fn follow(&mut self, followed: &[(usize, (f64, f64))], runs: Option<usize>) -> Result<()> {
        let Some(design) = self.plan.groups.iter().find(|g| g.purpose == Purpose::Fit && g.varied.len() > 1).cloned() else {
            return Err(Error::input("there is no design of several variables whose held ones could be followed")
                .help("give two variables or more a range under [range], or remove [follow]"));
        };
        let variables = self.plan.variables.clone();
        for (at, (low, high)) in followed {
            let (name, held) = (&variables[*at].name, self.plan.conditions[design.rows.start][*at]);
            if design.varied.contains(at) {
                return Err(Error::input(format!("'{name}' is varied, not held")).help("remove it from [follow]"));
            }
            // A variable without a value is reported with all others that have none.
            if !held.is_nan() && !(*low..=*high).contains(&held) {
                return Err(Error::input(format!("'{name}' is held outside its range"))
                    .help("widen its range in the machine file, or hold another value"));
            }
        }
        let runs = runs.unwrap_or(3 * (design.varied.len() + 1)).min(design.rows.len());
        if runs < LEAST_FOLLOWED {
            return Err(Error::input(format!("held variables are followed from at least {LEAST_FOLLOWED} conditions of the design"))
                .read(runs)
                .help("take more runs, or leave [follow] out"));
        }
        let chosen = |k: usize, of: usize| design.rows.start + (2 * k + 1) * design.rows.len() / (2 * of);
        let moved = |row: usize, to: &[(usize, f64)]| {
            let mut condition = self.plan.conditions[row].clone();
            to.iter().for_each(|(at, value)| condition[*at] = *value);
            condition
        };
        let mut alone = Vec::new();
        for (at, (low, high)) in followed {
            let held = self.plan.conditions[design.rows.start][*at];
            let values = apart(held, *low, *high, 2 * runs);
            // The two values of a condition lie half the range apart; they are assigned to the conditions in a mixed order.
            let stride = STRIDES.into_iter().find(|stride| !runs.is_multiple_of(*stride)).unwrap_or(1);
            let row = |j: usize| chosen((j % runs) * stride % runs, runs);
            alone.extend(values.iter().enumerate().map(|(j, value)| moved(row(j), &[(*at, *value)])));
        }
        let joined = |count: usize, units: Vec<Vec<f64>>| -> Vec<Vec<f64>> {
            let place = |((at, (low, high)), u): (&(usize, (f64, f64)), &f64)| (*at, low + u * (high - low));
            let at = |(k, units): (usize, &Vec<f64>)| moved(chosen(k, count), &followed.iter().zip(units).map(place).collect::<Vec<_>>());
            units.iter().enumerate().map(at).collect()
        };
        let pairs = if followed.len() > 1 { (JOINED_PER_VARIABLE * followed.len()).min(design.rows.len()) } else { 0 };
        let together = if pairs > 0 { joined(pairs, design::latin_hypercube(pairs, followed.len(), CHECK_SEED + 1)) } else { Vec::new() };
        let checks = LEAST_CHECKS.max(2 * followed.len()).min(design.rows.len());
        let check = joined(checks, design::uniform(checks, followed.len(), CHECK_SEED));
        let varied: Vec<usize> = followed.iter().map(|(at, _)| *at).collect();
        let groups = [
            (FOLLOW, format!("one at a time, at two values each, at {runs} conditions of the design"), alone),
            (FOLLOW_TOGETHER, format!("all together, at {pairs} conditions of the design"), together),
            (FOLLOW_CHECK, format!("all together, at {checks} conditions of the design, held out"), check),
        ];
        for (name, description, rows) in groups.into_iter().filter(|(_, _, rows)| !rows.is_empty()) {
            let start = self.plan.shown.len();
            for row in rows {
                self.plan.push(row.iter().zip(&variables).map(|(si, variable)| typed(*si, variable)).collect());
            }
            let rows = start..self.plan.shown.len();
            self.plan.groups.push(ConditionGroup {
                name: name.into(),
                purpose: Purpose::Follow,
                varied: varied.clone(),
                degree: None,
                description,
                rows,
            });
        }
        Ok(())
    }

    /// Checks that every condition has a value of every variable.
    pub(super) fn finish(self) -> Result<Plan> {
        let plan = self.plan;
        if plan.conditions.is_empty() {
            return Err(Error::input("the sweep has no conditions"));
        }
        if plan.growth.is_some() && plan.groups.iter().any(|g| g.name == ADDED) {
            return Err(Error::input(format!("'{ADDED}' is the name of what an adaptive design adds"))
                .at_key("one_factor.name")
                .help("give this [[one_factor]] another name"));
        }
        for row in &plan.shown {
            let missing: Vec<&DescribedVariable> =
                row.iter().zip(&plan.variables).filter(|(value, _)| value.is_nan()).map(|(_, v)| v).collect();
            if let Some(first) = missing.first() {
                let names: Vec<&str> = missing.iter().map(|v| v.name.as_str()).collect();
                let (word, verb) = if names.len() == 1 { ("variable", "has") } else { ("variables", "have") };
                return Err(Error::input(format!("the {word} '{}' {verb} neither a range nor a value", names.join("', '")))
                    .at_key(names.join(", "))
                    .help(format!("write it under [range] or [hold], e.g. [hold] {} = {}", first.name, first.dimension.example())));
            }
        }
        Ok(plan)
    }
}

impl Space {
    pub(super) fn is_varied(&self, variable: usize) -> bool {
        self.axes.iter().any(|a| a.variable == variable)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.axes.is_empty()
    }

    fn push(&mut self, axis: Axis) -> Result<()> {
        let name = &self.variables[axis.variable].name;
        if self.is_varied(axis.variable) {
            return Err(Error::input(format!("'{name}' has both a range and levels")).help("keep one of them"));
        }
        if self.held.iter().any(|(v, _)| *v == axis.variable) {
            return Err(Error::input(format!("'{name}' is both varied and held")).help("remove it from [hold]"));
        }
        self.axes.push(axis);
        self.axes.sort_by_key(|a| a.variable);
        Ok(())
    }

    pub(super) fn vary(&mut self, variable: usize, low: f64, high: f64, spacing: LevelSpacing) -> Result<()> {
        if spacing != LevelSpacing::Linear && low <= 0.0 {
            return Err(Error::input("this spacing needs a range above zero").help("take linear spacing, or begin the range above zero"));
        }
        self.push(Axis { variable, low, high, spacing, levels: None })
    }

    pub(super) fn levels(&mut self, variable: usize, levels: Vec<f64>) -> Result<()> {
        if levels.is_empty() {
            return Err(Error::input("no level is given").help("list at least one"));
        }
        let (low, high) = levels.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        self.push(Axis { variable, low, high, spacing: LevelSpacing::Linear, levels: Some(levels) })
    }

    fn scale(&self, units: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        let value = |(axis, u): (&Axis, f64)| axis.spacing.value(u, axis.low, axis.high);
        units.into_iter().map(|point| self.axes.iter().zip(point).map(value).collect()).collect()
    }

    fn add(&mut self, name: &str, purpose: Purpose, description: String, points: Vec<Vec<f64>>) {
        let varied = self.axes.iter().map(|a| a.variable).collect();
        self.groups.push((ConditionGroup { name: name.into(), purpose, varied, degree: None, description, rows: 0..0 }, points));
    }

    pub(super) fn latin_hypercube(&mut self, runs: usize, seed: u64, corners: bool) -> Result<()> {
        let mut units = if corners {
            let count = 1usize.checked_shl(self.axes.len() as u32).filter(|c| c + 2 <= runs).ok_or_else(|| {
                Error::input("there are fewer runs than corners of the ranges").help("take more runs, or corners = false")
            })?;
            debug_assert_eq!(count, 1 << self.axes.len());
            design::corners(self.axes.len())
        } else {
            Vec::new()
        };
        check_count(runs)?;
        units.extend(design::latin_hypercube(runs - units.len(), self.axes.len(), seed));
        let with = if corners { ", corners included" } else { "" };
        self.add("design", Purpose::Fit, format!("maximin Latin hypercube, {runs} runs, seed {seed}{with}"), self.scale(units));
        Ok(())
    }

    /// A Latin hypercube that grows: to `accuracy` (K), or to `most` conditions.
    pub(super) fn adaptive(&mut self, runs: usize, most: usize, seed: u64, accuracy: f64) -> Result<()> {
        check_count(most)?;
        let units = design::latin_hypercube(runs, self.axes.len(), seed);
        let description =
            format!("maximin Latin hypercube, {runs} runs, seed {seed}, to grow to an accuracy of {accuracy} K or to {most} runs");
        self.add("design", Purpose::Fit, description, self.scale(units));
        self.growth = Some(DesignGrowth { accuracy, most, seed, axes: self.axes.clone(), base: self.base() });
        Ok(())
    }

    pub(super) fn sobol(&mut self, runs: usize, seed: Option<u64>) -> Result<()> {
        check_count(runs)?;
        let units = design::sobol(runs, self.axes.len(), seed)?;
        let shift = seed.map_or("unscrambled".to_string(), |seed| format!("digital shift of seed {seed}"));
        self.add("design", Purpose::Fit, format!("Sobol', {runs} runs, {shift}"), self.scale(units));
        Ok(())
    }

    pub(super) fn factorial(&mut self, points: Option<usize>) -> Result<()> {
        let mut levels = Vec::new();
        for axis in &self.axes {
            levels.push(match (&axis.levels, points) {
                (Some(levels), _) => levels.clone(),
                (None, Some(points)) => design::levels(points, axis.low, axis.high, axis.spacing),
                (None, None) => {
                    let name = &self.variables[axis.variable].name;
                    return Err(Error::input(format!("the number of levels of '{name}' is missing"))
                        .help("write points = 3 under [design], or its levels under [levels] instead of its range"));
                }
            });
        }
        let count = levels.iter().try_fold(1usize, |product, l| product.checked_mul(l.len())).unwrap_or(usize::MAX);
        check_count(count)?;
        let shape: Vec<String> = levels.iter().map(|l| l.len().to_string()).collect();
        self.add("design", Purpose::Fit, format!("full factorial, {}", shape.join(" x ")), design::full_factorial(&levels));
        Ok(())
    }

    pub(super) fn one_factor(&mut self, points: usize, group: ConditionGroup) {
        let axis = &self.axes[0];
        let values = design::levels(points, axis.low, axis.high, axis.spacing).into_iter().map(|v| vec![v]).collect();
        self.groups.push((group, values));
    }

    /// Held-out conditions: uniform in the variables themselves, whatever the design's spacing.
    pub(super) fn validation(&mut self, runs: usize, seed: u64) {
        let units = design::uniform(runs, self.axes.len(), seed);
        let value = |(axis, u): (&Axis, f64)| LevelSpacing::Linear.value(u, axis.low, axis.high);
        let points = units.into_iter().map(|point| self.axes.iter().zip(point).map(value).collect()).collect();
        self.add("validation", Purpose::Validation, format!("uniform, {runs} runs, seed {seed}"), points);
    }

    pub(super) fn varied(&self) -> usize {
        self.axes.len()
    }

    /// Held and default values, NaN if there is none.
    fn base(&self) -> Vec<f64> {
        let mut base: Vec<f64> = self.variables.iter().map(|v| v.default.unwrap_or(f64::NAN)).collect();
        for (variable, value) in &self.held {
            base[*variable] = *value;
        }
        base
    }

    /// Completes the points with held and default values and hands them over.
    pub(super) fn into_groups(self, builder: &mut Builder) {
        let base = self.base();
        if self.growth.is_some() {
            builder.plan.growth = self.growth;
        }
        for (mut group, points) in self.groups {
            let start = builder.plan.shown.len();
            for point in points {
                let mut row = base.clone();
                for (axis, value) in self.axes.iter().zip(point) {
                    row[axis.variable] = value;
                }
                builder.plan.push(row.iter().zip(&self.variables).map(|(value, variable)| typed(*value, variable)).collect());
            }
            group.rows = start..builder.plan.shown.len();
            builder.plan.groups.push(group);
        }
    }
}

fn check_count(count: usize) -> Result<()> {
    if count <= MOST_CONDITIONS {
        return Ok(());
    }
    Err(Error::input(format!("the design has more than {MOST_CONDITIONS} conditions")).help("take fewer levels or runs"))
}
