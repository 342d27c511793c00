//! What is asked of a machine, whoever solves it.

use super::condition::Symbols;
use super::sensors::limits;
use super::variables::{four, variables};
use super::{Limit, LimitKind, Machine, Sensor, Variable};
use crate::error::Result;
use crate::foundation::document::Section;
use crate::units::Dimension;

/// Variables, measurement points and limits: what a fit, a chart or a verdict needs to know of a machine.
#[derive(Debug, Clone)]
pub struct Scope {
    /// One-line name.
    pub name: String,
    /// What the results depend on, in hexadecimal.
    pub hash: String,
    /// What a condition consists of.
    pub variables: Vec<Variable>,
    /// What is measured.
    pub points: Vec<Point>,
    /// What is acceptable, by indices into the points and variables; SI.
    pub limits: Vec<Limit>,
    /// Variables that nothing follows, as indices.
    pub unused: Vec<usize>,
}

/// A measurement point as it stands in tables.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Name.
    pub name: String,
    /// Unit of its column.
    pub unit: String,
    /// Its physical dimension.
    pub dimension: Dimension,
}

impl Point {
    /// A temperature.
    pub fn temperature(name: &str) -> Self {
        Self { name: name.into(), unit: "degC".into(), dimension: Dimension::TEMPERATURE }
    }

    /// What a sensor reads.
    pub fn of(sensor: &Sensor) -> Self {
        Self { name: sensor.name.clone(), unit: sensor.measurand().unit().into(), dimension: sensor.measurand().dimension() }
    }
}

impl Machine {
    /// What is asked of it.
    pub fn scope(&self) -> Scope {
        Scope {
            name: self.name.clone(),
            hash: self.hash.clone(),
            variables: self.variables.clone(),
            points: self.sensors.iter().map(Point::of).collect(),
            limits: self.limits.clone(),
            unused: (0..self.variables.len()).filter(|v| !self.uses(*v)).collect(),
        }
    }
}

impl Scope {
    /// Whether anything follows a variable (index into [`Scope::variables`]).
    pub fn uses(&self, variable: usize) -> bool {
        !self.unused.contains(&variable)
    }

    /// Reads `[variables]`, written as in a machine file: none but those exist.
    ///
    /// # Errors
    /// A unit that is not known, or a default or range that does not fit it.
    pub fn variables(root: &Section<'_>) -> Result<Vec<Variable>> {
        let given: Vec<&str> = root.opt_section("variables")?.map(|section| section.keys().collect()).unwrap_or_default();
        let mut found = variables(root, &mut Symbols::default())?;
        found.retain(|variable| given.contains(&variable.name.as_str()));
        if found.is_empty() {
            return Err(root.error_at("variables", "no variable is declared").help(format!(
                "write [variables] {} = {{ unit = \"W\" }}, or one of the usual: {}",
                "heat",
                four().join(", ")
            )));
        }
        Ok(found)
    }

    /// The scope of these variables and points, with `[limit.NAME]` of the same file, written as in a machine file.
    ///
    /// # Errors
    /// A limit on what is no point, or over a variable that there is none of.
    pub fn new(root: &Section<'_>, name: String, hash: String, variables: Vec<Variable>, points: Vec<Point>) -> Result<Self> {
        let named: Vec<(String, Dimension)> = points.iter().map(|point| (point.name.clone(), point.dimension)).collect();
        let limits = limits(root, &named, &variables)?;
        let unit = |point: &usize| points[*point].unit.as_str();
        for limit in &limits {
            let compared = match &limit.kind {
                LimitKind::Difference { first, second } => vec![*first, *second],
                LimitKind::Spread(all) => all.clone(),
                LimitKind::Maximum { .. } | LimitKind::Rise { .. } => Vec::new(),
            };
            if let Some(other) = compared.iter().find(|point| unit(point) != unit(&compared[0])) {
                return Err(root
                    .error_at("limit", format!("'{}' compares points in {} and in {}", limit.name, unit(&compared[0]), unit(other)))
                    .help("give them one unit"));
            }
        }
        Ok(Self { name, hash, variables, points, limits, unused: Vec::new() })
    }
}
