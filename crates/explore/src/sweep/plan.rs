//! The conditions of a sweep, laid out row by row.

use std::ops::Range;

use sha2::{Digest, Sha256};

use super::adaptive::{ADDED, DesignGrowth, in_si};
use coldplate_describe::machine::{Condition, DescribedVariable};
use coldplate_tables::Column;

/// Purpose of a group of conditions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// To be fitted.
    Fit,
    /// Held out: only to check a fit.
    Validation,
    /// Conditions of the design with held variables at other values, for the effect of these on the answers.
    Follow,
}

/// Conditions that belong together: a design, a one-factor sweep, the held-out ones.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConditionGroup {
    /// Name, as in the column `group` of the result.
    pub name: String,
    /// Purpose of the group.
    pub purpose: Purpose,
    /// The variables that are varied in the group, as indices into [`Plan::variables`].
    pub varied: Vec<usize>,
    /// Degree of the polynomial, if the sweep file asks for one.
    pub degree: Option<usize>,
    /// The design in words.
    pub description: String,
    /// Rows of the group in [`Plan::shown`] and [`Plan::conditions`].
    pub rows: Range<usize>,
}

/// Every condition of a sweep.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Name of the sweep.
    pub name: String,
    /// The machine's variables.
    pub variables: Vec<DescribedVariable>,
    /// The groups, in the order of their rows.
    pub groups: Vec<ConditionGroup>,
    /// One row per condition, one value per variable in its own unit, of at most twelve digits.
    pub shown: Vec<Vec<f64>>,
    /// The conditions in SI, converted from [`Plan::shown`], so that typing a row of the table gives the very same condition.
    pub conditions: Vec<Vec<f64>>,
    /// Growth of the design, if it grows.
    pub growth: Option<DesignGrowth>,
    /// Largest error of a reading against the full solution, K, up to which a reduced model answers; `None` to solve all in
    /// full.
    pub accuracy: Option<f64>,
}

/// Least number of rows with slopes, if there are so many; count. Chosen: slopes cost time at each row.
const LEAST_SLOPED: usize = 24;

impl Plan {
    /// The group of a row.
    pub fn group_of(&self, row: usize) -> Option<&ConditionGroup> {
        self.groups.iter().find(|g| g.rows.contains(&row))
    }

    /// Whether the slopes of the readings are wanted at a row: at those a surrogate is fitted to, evenly chosen if these are
    /// more than polynomials of the slopes need. Groups that vary one variable are for formulas, unless there are no others.
    /// Added rows have slopes until there are enough: a later one changes nothing for those before.
    pub fn is_sloped(&self, row: usize) -> bool {
        let is_design = |g: &ConditionGroup| g.purpose == Purpose::Fit && g.varied.len() > 1;
        let has_design = self.groups.iter().any(is_design);
        let is_fitted = |g: &ConditionGroup| if has_design { is_design(g) } else { g.purpose == Purpose::Fit };
        let Some(group) = self.group_of(row).filter(|g| is_fitted(g)) else { return false };
        let is_added = |g: &ConditionGroup| self.growth.is_some() && g.name == ADDED;
        let fitted: usize = self.groups.iter().filter(|g| is_fitted(g) && !is_added(g)).map(|g| g.rows.len()).sum();
        let before: usize = self.groups.iter().take_while(|g| g.rows != group.rows).filter(|g| is_fitted(g)).map(|g| g.rows.len()).sum();
        let place = before + row - group.rows.start;
        // Two and a half rows for each term of the third degree.
        let n = (0..self.variables.len()).filter(|v| self.groups.iter().any(|g| is_fitted(g) && g.varied.contains(v))).count();
        let enough = (5 * (n + 1) * (n + 2) * (n + 3) / 12).max(LEAST_SLOPED);
        if is_added(group) {
            return place < enough;
        }
        let counted = |place: usize| place * enough.min(fitted) / fitted;
        counted(place + 1) > counted(place)
    }

    /// The middle of the ranges.
    pub fn middle(&self) -> Condition {
        let middle = |v: usize| {
            let values = self.conditions.iter().map(|row| row[v]);
            let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            0.5 * (low + high)
        };
        Condition::from_si((0..self.variables.len()).map(middle).collect())
    }

    /// Adds a condition to the last rows: one value per variable in its own unit.
    pub(super) fn push(&mut self, shown: Vec<f64>) {
        self.conditions.push(shown.iter().zip(&self.variables).map(|(value, variable)| in_si(*value, variable)).collect());
        self.shown.push(shown);
    }

    /// Adds conditions to a design that grows: they are the last rows, and those before keep their numbers.
    pub fn grow(&mut self, added: Vec<Vec<f64>>) {
        let Some(growth) = self.growth.as_ref().filter(|_| !added.is_empty()) else { return };
        let (start, end) = (self.shown.len(), self.shown.len() + added.len());
        let varied = growth.varied();
        let describe = |count: usize| format!("{count} runs where the fit was least sure");
        match self.groups.last_mut().filter(|g| g.name == ADDED) {
            Some(group) => {
                group.rows.end = end;
                group.description = describe(group.rows.len());
            }
            None => self.groups.push(ConditionGroup {
                name: ADDED.into(),
                purpose: Purpose::Fit,
                varied,
                degree: None,
                description: describe(added.len()),
                rows: start..end,
            }),
        }
        added.into_iter().for_each(|row| self.push(row));
    }

    /// SHA-256 over variables, units, conditions and groups, in hexadecimal.
    pub fn hash(&self) -> String {
        let mut hasher = Sha256::new();
        for variable in &self.variables {
            hasher.update(format!("{} [{}]\n", variable.name, variable.unit));
        }
        for group in &self.groups {
            hasher.update(format!("{}\n", group.rows.end));
        }
        for value in self.conditions.iter().flatten() {
            hasher.update(value.to_bits().to_le_bytes());
        }
        hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// The condition columns of the given rows.
    pub fn columns(&self, rows: &[usize]) -> Vec<Column> {
        let values = |v: usize| rows.iter().map(|row| self.shown[*row][v]).collect();
        let column = |(v, variable): (usize, &DescribedVariable)| Column {
            name: variable.name.clone(),
            unit: variable.unit.clone(),
            values: values(v),
        };
        self.variables.iter().enumerate().map(column).collect()
    }
}
