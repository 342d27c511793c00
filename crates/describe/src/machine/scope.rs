//! Questions asked of a machine, whichever solver answers them.

use super::model::Machine;
use super::readings::{MachineLimit, Sensor};
use super::sensors::limits;
use super::symbols::Symbols;
use super::variables::{DescribedVariable, variables};
use coldplate_base::condition;
use coldplate_base::document::Section;
use coldplate_base::error::Result;
use coldplate_base::terms::LimitKind;
use coldplate_base::units::Dimension;

/// Variables, measurement points and limits: the part of a machine that a fit, a chart or a verdict needs.
#[derive(Debug, Clone)]
pub struct Scope {
    /// One-line name.
    pub name: String,
    /// Hash of everything the results depend on, in hexadecimal.
    pub hash: String,
    /// Variables of a condition.
    pub variables: Vec<DescribedVariable>,
    /// Measurement points.
    pub points: Vec<PointColumn>,
    /// Limits, by indices into the points and variables; SI.
    pub limits: Vec<MachineLimit>,
    /// Indices of the variables that affect nothing.
    pub unused: Vec<usize>,
}

/// A measurement point as a column of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct PointColumn {
    /// Name.
    pub name: String,
    /// Unit of the column.
    pub unit: String,
    /// Physical dimension of the point.
    pub dimension: Dimension,
}

impl PointColumn {
    /// A point that measures a temperature.
    pub fn temperature(name: &str) -> Self {
        Self { name: name.into(), unit: "degC".into(), dimension: Dimension::TEMPERATURE }
    }

    /// The point of a sensor.
    pub fn of(sensor: &Sensor) -> Self {
        Self { name: sensor.name.clone(), unit: sensor.measurand().unit().into(), dimension: sensor.measurand().dimension() }
    }
}

impl Machine {
    /// The scope of the machine.
    pub fn scope(&self) -> Scope {
        Scope {
            name: self.name.clone(),
            hash: self.hash.clone(),
            variables: self.variables.clone(),
            points: self.sensors.iter().map(PointColumn::of).collect(),
            limits: self.limits.clone(),
            unused: (0..self.variables.len()).filter(|v| !self.uses(*v)).collect(),
        }
    }
}

impl Scope {
    /// Whether anything depends on a variable (index into [`Scope::variables`]).
    pub fn uses(&self, variable: usize) -> bool {
        !self.unused.contains(&variable)
    }

    /// Reads `[variables]` in the notation of a machine file; no other variables exist.
    ///
    /// # Errors
    /// A unit is not known, or a default or range does not fit its unit.
    pub fn variables(root: &Section<'_>) -> Result<Vec<DescribedVariable>> {
        let given: Vec<&str> = root.opt_section("variables")?.map(|section| section.keys().collect()).unwrap_or_default();
        let mut found = variables(root, &mut Symbols::default())?;
        found.retain(|variable| given.contains(&variable.name.as_str()));
        if found.is_empty() {
            return Err(root.error_at("variables", "no variable is declared").help(format!(
                "write [variables] {} = {{ unit = \"W\" }}, or one of the usual: {}",
                "heat",
                condition::NAMES.join(", ")
            )));
        }
        Ok(found)
    }

    /// The scope of these variables and points, with `[limit.NAME]` of the same file in the notation of a machine file.
    ///
    /// # Errors
    /// A limit names a point or a variable that does not exist.
    pub fn new(
        root: &Section<'_>,
        name: String,
        hash: String,
        variables: Vec<DescribedVariable>,
        points: Vec<PointColumn>,
    ) -> Result<Self> {
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
