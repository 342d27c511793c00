//! How the answers follow variables that were held. The change is fitted to conditions at which one held variable has another
//! value, and judged by conditions at which all have.

pub(super) mod section;

use std::collections::BTreeMap;

use coldplate_runtime::format;
use rayon::prelude::*;

use super::evaluate::{monomial, scale_row};
use super::least_squares::{Orthonormal, left_out, max_abs};
use super::model::{FollowedSpec, FollowedVariable, Interaction, MOVED, SurrogateSpec, Transform};
use super::polynomial::{PolynomialSearch, forward, monomial_columns};
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::root_mean_square;
use coldplate_base::terms::FOLLOW_CHECK;
use coldplate_tables::Table;

/// Largest degree of a change in the variables that were varied. Chosen: more terms need more full solves.
const MOST_DEGREE: usize = 2;
/// Fewest conditions per coefficient of a change. Chosen: more coefficients fit better, more conditions cost full
/// solves.
const ROWS_PER_COEFFICIENT: usize = 3;
/// Fewest conditions at which a variable alone is moved, a count. Chosen: from fewer no error can be estimated.
const LEAST_ROWS: usize = 8;
/// Least standard deviation of a change, in the points' unit. Chosen: errors of the solver are of this size.
const SMALL: f64 = 1e-4;
/// Fewest conditions with several variables moved per interaction of a point. Chosen: more interactions fit better,
/// more conditions cost full solves.
const INTERACTIONS_PER_ROW: usize = 4;
/// Least share of the remaining error that the interactions must take away. Chosen: less may be chance.
const WORTH: f64 = 0.05;
/// Share of all changes, root mean square, below which a variable's change does not interact. Chosen: a remainder
/// this small is an error of other changes.
const LEAST_SHARE: f64 = 0.005;
/// Expected largest held-out error, in standard deviations: that of ten normal numbers.
const LARGEST: f64 = 1.5;

/// A condition at which held variables have other values.
struct Moved {
    /// The varied variables.
    x: Vec<f64>,
    /// Held variables that have another value: index in the surrogate's list, value.
    to: Vec<(usize, f64)>,
    /// Change of each point.
    change: Vec<f64>,
    /// Whether the condition is held out of the fit.
    is_check: bool,
}

impl FollowedSpec {
    /// Fits the changes to a table of conditions at which variables that the surrogate holds have other values.
    ///
    /// # Errors
    /// The table lacks a variable or a point of the surrogate, or has too few conditions for any variable.
    pub fn fit(surrogate: &SurrogateSpec, table: &Table) -> Result<Self> {
        let (checks, rows): (Vec<Moved>, Vec<Moved>) = moved(surrogate, table)?.into_iter().partition(|row| row.is_check);
        let (alone, together): (Vec<Moved>, Vec<Moved>) = rows.into_iter().partition(|row| row.to.len() == 1);
        let mut by_variable: BTreeMap<usize, Vec<Moved>> = BTreeMap::new();
        alone.into_iter().for_each(|row| by_variable.entry(row.to[0].0).or_default().push(row));
        if by_variable.is_empty() {
            return Err(Error::input("no condition of this table has one held variable at another value")
                .help("make it anew with `coldplate sweep`, from a sweep file with [follow]"));
        }
        if let Some((held, rows)) = by_variable.iter().find(|(_, rows)| rows.len() < LEAST_ROWS) {
            let what = format!("only {} conditions of this table move '{}' alone", rows.len(), surrogate.held[*held].name);
            return Err(Error::input(what).help(format!("at least {LEAST_ROWS} are needed: make it anew with `coldplate sweep`")));
        }
        let shape = Shape::choose(surrogate, &by_variable)?;
        let variables = by_variable.into_iter().map(|(held, rows)| shape.variable(surrogate, held, &rows)).collect();
        let mut found = Self { transforms: shape.transforms, terms: shape.terms, variables, ..Self::default() };
        let points = 0..surrogate.points.len();
        let interactions = points.clone().flat_map(|point| found.interactions_of(surrogate, point, &together)).collect();
        found.interactions = interactions;
        let errors = points.map(|point| found.error(surrogate, point, &checks)).collect();
        found.errors = errors;
        if let [only] = found.variables.as_mut_slice() {
            only.errors.iter_mut().zip(&found.errors).for_each(|(own, checked)| *own *= checked);
        }
        Ok(found)
    }

    /// Interactions at a point, fitted to the difference between moving several variables at once and the sum of their
    /// changes: the change with one variable in proportion to another.
    fn interactions_of(&self, surrogate: &SurrogateSpec, point: usize, together: &[Moved]) -> Vec<Interaction> {
        let n = self.variables.len();
        let (mut gaps, mut columns) = (Vec::new(), vec![Vec::new(); n * n]);
        for row in together {
            let parts = self.parts(surrogate, &row.to, point, &row.x);
            let of = |k: usize| parts.iter().find(|p| p.variable == k).map_or((0.0, 0.0), |p| (p.change, p.t));
            // Errors count as shares of the changes, so that large changes do not drown the others.
            let size = parts.iter().map(|p| p.change.abs()).sum::<f64>() + SMALL;
            gaps.push((row.change[point] - parts.iter().map(|p| p.change).sum::<f64>()) / size);
            for (place, column) in columns.iter_mut().enumerate() {
                let (k, l) = (place / n, place % n);
                column.push(if k == l { 0.0 } else { of(k).0 * of(l).1 / size });
            }
        }
        columns.iter_mut().filter(|column| root_mean_square(column) < LEAST_SHARE).for_each(|column| column.fill(0.0));
        let picked = forward(&columns, &gaps, together.len() / INTERACTIONS_PER_ROW, false);
        let mut basis = Orthonormal::new();
        let picked: Vec<usize> = picked.into_iter().filter(|place| basis.push(&columns[*place])).collect();
        let mut residuals = gaps.clone();
        let factors = basis.back_substitute(&basis.project_out(&mut residuals));
        if root_mean_square(&left_out(&residuals, &basis.leverages(gaps.len()))) > (1.0 - WORTH) * root_mean_square(&gaps) {
            return Vec::new();
        }
        picked.into_iter().zip(factors).map(|(place, factor)| Interaction { point, of: place / n, by: place % n, factor }).collect()
    }

    /// Error of the changes of a point at held-out conditions, over the stated standard deviation; at least one.
    fn error(&self, surrogate: &SurrogateSpec, point: usize, checks: &[Moved]) -> f64 {
        let ratio = |row: &Moved| {
            let found: f64 = self.interacting(surrogate, &row.to, point, &row.x).map(|(part, factor)| part.change * factor).sum();
            (row.change[point] - found) / self.deviation(point, &self.parts(surrogate, &row.to, point, &row.x))
        };
        let ratios: Vec<f64> = checks.iter().map(ratio).collect();
        // The largest of ten normal numbers lies at one and a half deviations; errors of products have longer tails.
        root_mean_square(&ratios).max(max_abs(&ratios) / LARGEST).max(1.0)
    }

    /// Standard deviation of the changes that moved variables make by themselves, taken together.
    fn deviation(&self, point: usize, parts: &[Part]) -> f64 {
        parts.iter().map(|p| (self.variables[p.variable].errors[point] * p.t).powi(2)).fold(SMALL * SMALL, |sum, v| sum + v).sqrt()
    }

    /// Change of a point at condition `x` by each moved variable (index in the surrogate's list, value) alone.
    fn parts(&self, surrogate: &SurrogateSpec, to: &[(usize, f64)], point: usize, x: &[f64]) -> Vec<Part> {
        let u = scale_row(&surrogate.variables, &self.transforms, x);
        let part = |(held, value): &(usize, f64)| {
            let variable = self.variables.iter().position(|v| v.held == *held)?;
            let own = &self.variables[variable];
            let t = (value - surrogate.held[*held].value) / (own.high - own.low);
            let add = |(term, [a, b]): (&Vec<u8>, &[f64; 2])| (a + b * t) * t * monomial(term, &u);
            Some(Part { variable, t, change: self.terms.iter().zip(&own.coefficients[point]).map(add).sum() })
        };
        to.iter().filter_map(part).collect()
    }

    /// Change by each moved variable alone, with the factor by which the others multiply it.
    fn interacting(&self, surrogate: &SurrogateSpec, to: &[(usize, f64)], point: usize, x: &[f64]) -> impl Iterator<Item = (Part, f64)> {
        let parts = self.parts(surrogate, to, point, x);
        let others: Vec<(usize, f64)> = parts.iter().map(|p| (p.variable, p.t)).collect();
        parts.into_iter().map(move |part| {
            let factor = self.factor(point, part.variable, &others);
            (part, factor)
        })
    }

    /// Factor on the change of a point with a variable, if `others` have moved by these t.
    fn factor(&self, point: usize, variable: usize, others: &[(usize, f64)]) -> f64 {
        let own = self.interactions.iter().filter(|i| i.point == point && i.of == variable);
        let by = |i: &Interaction| others.iter().find(|(other, _)| *other == i.by).map_or(0.0, |(_, t)| i.factor * t);
        1.0 + own.map(by).sum::<f64>()
    }
}

/// Change of a point by one moved variable.
struct Part {
    /// Index into [`FollowedSpec::variables`].
    variable: usize,
    /// Change of the variable over its range, dimensionless.
    t: f64,
    change: f64,
}

/// The conditions of a table, with the changes of the surrogate's answers by the held variables.
fn moved(surrogate: &SurrogateSpec, table: &Table) -> Result<Vec<Moved>> {
    let column = |name: &str| {
        let found = table.columns.iter().find(|c| c.name == name).map(|c| &c.values);
        found.ok_or_else(|| {
            Error::input(format!("this table of followed variables has no column '{name}'"))
                .help("make it anew with `coldplate sweep`, from the sweep file of the surrogate")
        })
    };
    let varied: Vec<&Vec<f64>> = surrogate.variables.iter().map(|v| column(&v.name)).collect::<Result<_>>()?;
    let held: Vec<Option<&Vec<f64>>> = surrogate.held.iter().map(|h| column(&h.name).ok()).collect();
    let outputs: Vec<&Vec<f64>> = surrogate.points.iter().map(|p| column(&p.name)).collect::<Result<_>>()?;
    let group = table.texts.iter().find(|t| t.name == "group");
    let mut rows = Vec::new();
    for row in 0..table.rows() {
        let x: Vec<f64> = varied.iter().map(|c| c[row]).collect();
        let value = |(h, c): (usize, &Option<&Vec<f64>>)| c.map(|c| (h, c[row])).filter(|(h, value)| *value != surrogate.held[*h].value);
        let to: Vec<(usize, f64)> = held.iter().enumerate().filter_map(value).collect();
        let change = |(point, c): (usize, &&Vec<f64>)| Ok(c[row] - super::evaluate(surrogate, point, &x)?);
        let change: Vec<f64> = outputs.iter().enumerate().map(change).collect::<Result<_>>()?;
        let numbers = x.iter().chain(to.iter().map(|(_, value)| value)).chain(&change);
        if !to.is_empty() && numbers.into_iter().all(|n| n.is_finite()) {
            rows.push(Moved { x, to, change, is_check: group.is_some_and(|g| g.values[row] == FOLLOW_CHECK) });
        }
    }
    Ok(rows)
}

/// Terms in the varied variables that all changes share.
struct Shape {
    transforms: Vec<Transform>,
    terms: Vec<Vec<u8>>,
}

impl Shape {
    /// The transforms of the slopes if the surrogate has any, so that both fit into one table; otherwise the transforms
    /// with the least leave-one-out error.
    fn choose(surrogate: &SurrogateSpec, by_variable: &BTreeMap<usize, Vec<Moved>>) -> Result<Self> {
        let variables = &surrogate.variables;
        let active: Vec<bool> = variables.iter().map(|v| v.high > v.low).collect();
        let search = PolynomialSearch { variables, active: &active, max_degree: MOST_DEGREE };
        let rows: Vec<&[f64]> = by_variable.values().flatten().map(|row| row.x.as_slice()).collect();
        let terms = (0..=MOST_DEGREE).rev().map(|degree| search.terms(degree)).find(|terms| terms.len() <= format::MAX_SLOPE_TERMS);
        let terms = terms.unwrap_or_default();
        let transforms = match surrogate.uncertainty.as_ref().filter(|own| !own.terms.is_empty()) {
            Some(own) => vec![own.transforms.clone()],
            None => search.transforms(&rows),
        };
        let tried = transforms.into_par_iter().map(|transforms| {
            let shape = Self { transforms, terms: terms.clone() };
            let errors = by_variable.iter().flat_map(|(held, rows)| shape.variable(surrogate, *held, rows).errors);
            (root_mean_square(&errors.collect::<Vec<_>>()), shape)
        });
        let best = tried.min_by(|a, b| a.0.total_cmp(&b.0));
        best.map(|(_, shape)| shape).ok_or_else(|| Error::numerics("no polynomial follows the held variables"))
    }

    /// The change with one variable, fitted to conditions at which it alone has another value.
    fn variable(&self, surrogate: &SurrogateSpec, held: usize, rows: &[Moved]) -> FollowedVariable {
        let (low, high) = reach(surrogate, held, rows);
        let t: Vec<f64> = rows.iter().map(|row| (row.to[0].1 - surrogate.held[held].value) / (high - low)).collect();
        let scaled: Vec<Vec<f64>> = rows.iter().map(|row| scale_row(&surrogate.variables, &self.transforms, &row.x)).collect();
        // Changes are divided by t, since their errors grow with it.
        let times = |column: Vec<f64>| [column.clone(), column.iter().zip(&t).map(|(c, t)| c * t).collect::<Vec<f64>>()];
        let columns: Vec<Vec<f64>> = monomial_columns(&scaled, &self.terms).into_iter().flat_map(times).collect();
        let (mut coefficients, mut errors) = (Vec::new(), Vec::new());
        for point in 0..surrogate.points.len() {
            let rates: Vec<f64> = rows.iter().zip(&t).map(|(row, t)| row.change[point] / t).collect();
            let picked = forward(&columns, &rates, rows.len() / ROWS_PER_COEFFICIENT, true);
            let mut basis = Orthonormal::new();
            let picked: Vec<usize> = picked.into_iter().filter(|column| basis.push(&columns[*column])).collect();
            let mut residuals = rates.clone();
            let found = basis.back_substitute(&basis.project_out(&mut residuals));
            let mut own = vec![[0.0; 2]; self.terms.len()];
            picked.iter().zip(&found).for_each(|(column, value)| own[column / 2][column % 2] = *value);
            coefficients.push(own);
            // Terms were picked by the same rows: n / (n - p) keeps that from being rewarded.
            let (n, p) = (rows.len() as f64, picked.len() as f64);
            errors.push(root_mean_square(&left_out(&residuals, &basis.leverages(rows.len()))) * (n / (n - p).max(1.0)).sqrt());
        }
        FollowedVariable { held, low, high, coefficients, errors }
    }
}

/// The range of a held variable that some conditions span, the value it was held at included.
fn reach(surrogate: &SurrogateSpec, held: usize, rows: &[Moved]) -> (f64, f64) {
    let own = surrogate.held[held].value;
    rows.iter().map(|row| row.to[0].1).fold((own, own), |(low, high), value| (low.min(value), high.max(value)))
}

impl SurrogateSpec {
    /// The surrogate of the same machine with other values of variables that it holds: index in [`SurrogateSpec::held`] and value, each
    /// within its range. The held values move with them, and the error of following is added to the model error.
    ///
    /// # Errors
    /// A variable that is not followed, or more uncertain parameters or terms than a file has room for.
    pub fn moved(&self, to: &[(usize, f64)]) -> Result<Self> {
        let none = FollowedSpec::default();
        let followed = self.followed.as_ref().unwrap_or(&none);
        let mut after = self.clone();
        let mut uncertainty = self.uncertainty.clone().unwrap_or_default();
        if uncertainty.misses.is_empty() {
            uncertainty.misses = vec![super::model::Miss::default(); self.points.len()];
            uncertainty.slopes = vec![Vec::new(); self.points.len()];
        }
        if uncertainty.terms.is_empty() {
            uncertainty.transforms.clone_from(&followed.transforms);
        }
        let of = |held: usize| {
            let found = followed.variables.iter().position(|v| v.held == held);
            found.ok_or_else(|| {
                Error::input(format!("'{}' was held, and the surrogate does not follow it", self.held[held].name))
                    .at_key(&self.held[held].name)
                    .help("name it under [follow] in the sweep file, and run the sweep again")
            })
        };
        let mut others = Vec::new();
        for (held, value) in to {
            let (k, own) = (of(*held)?, &self.held[*held]);
            others.push((k, (value - own.value) / (followed.variables[k].high - followed.variables[k].low)));
        }
        for ((held, value), (k, t)) in to.iter().zip(&others) {
            let (own, variable) = (&self.held[*held], &followed.variables[*k]);
            let add = |point: usize| {
                let factor = followed.factor(point, *k, &others);
                variable.coefficients[point].iter().map(|[a, b]| (a + b * t) * t * factor).collect::<Vec<f64>>()
            };
            let changes: Vec<Vec<f64>> = (0..self.points.len()).map(add).collect();
            let unit = if own.unit == "1" { String::new() } else { format!(" {}", own.unit) };
            uncertainty.add_known(&format!("{} at {value}{unit}", own.name), &followed.terms, &changes);
            for (limit, _) in followed.limits.iter().filter(|(_, over)| over == held) {
                after.limits[*limit].maximum += value - own.value;
            }
            after.held[*held].value = *value;
            after.provenance.push((format!("{MOVED}{}", own.name), format!("held at {}{unit} when the surrogate was made", own.value)));
        }
        let variance = |point: usize| {
            let alone: f64 = others.iter().map(|(k, t)| (followed.variables[*k].errors[point] * t).powi(2)).sum();
            if to.len() == 1 { alone } else { alone * followed.errors[point].powi(2) }
        };
        let variances: Vec<f64> = (0..self.points.len()).map(variance).collect();
        for (miss, variance) in uncertainty.misses.iter_mut().zip(&variances) {
            miss.own = (miss.own * miss.own + variance).sqrt();
        }
        // Moved variables interact with the others, so nothing more can be moved on top.
        after.followed = None;
        // The dynamics are known only for the values that were held.
        after.in_time = None;
        after.uncertainty = Some(uncertainty);
        Ok(after)
    }
}
