//! Content of a file: a surrogate, a reduced model, a machine, a sweep, a journal or a table, each recognised by its content or its
//! ending. Every field is a key of `coldplate info --json`.

use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;

use super::fitting::model_text;
use super::open::{DocumentKind, FileKind, open};
use coldplate_base::document::Document;
use coldplate_base::error::{Error, Result};
use coldplate_base::units::express;
use coldplate_describe::machine::{DescribedVariable, Machine};
use coldplate_explore::sweep::journal::{self, JournalContent};
use coldplate_explore::sweep::{Plan, SweepDefinition};
use coldplate_reduce::ReducedModel;
use coldplate_surrogate::fit::file;
use coldplate_surrogate::fit::model;
use coldplate_surrogate::verdict::{self, LimitAnswer, LimitKind, Surrogate};
use coldplate_tables::Table;

/// Content of a file.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[allow(missing_docs)]
pub enum Info {
    Surrogate(SurrogateInfo),
    Machine(MachineInfo),
    Sweep(SweepInfo),
    Reduced(ReducedInfo),
    Journal(JournalInfo),
    Table(TableInfo),
}

/// A surrogate.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct SurrogateInfo {
    /// Version of the file's layout.
    pub version: u16,
    pub bytes: usize,
    pub variables: Vec<RangeInfo>,
    pub held: Vec<HeldInfo>,
    pub points: Vec<PointInfo>,
    pub uncertain: Vec<ParameterInfo>,
    pub limits: Vec<LimitInfo>,
    pub provenance: Vec<Fact>,
}

/// A variable that was held, with the range of values that may be stated for it, if there is one.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct HeldInfo {
    pub name: String,
    pub unit: String,
    pub value: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub followed: Option<[f64; 2]>,
}

/// A variable with its range, in its unit; ends that are not known are `null`.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct RangeInfo {
    pub name: String,
    pub unit: String,
    pub low: Option<f64>,
    pub high: Option<f64>,
}

/// A measurement point.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct PointInfo {
    pub name: String,
    pub unit: String,
    /// The kind of function in words.
    pub model: String,
    /// Half width of the band that covers 95 % of new conditions, in the unit.
    pub half_width: f64,
    /// Further error while the machine moves, in the unit; only for files with dynamics.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub over_time: Option<f64>,
}

/// An uncertain parameter of the machine.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct ParameterInfo {
    pub name: String,
    pub unit: String,
    /// Mean value by all that the file knows.
    pub value: f64,
    pub standard_deviation: f64,
    /// Values that may be stated for it.
    pub low: f64,
    pub high: f64,
    /// Whether the standard deviation is assumed, since the machine file does not state one.
    pub assumed: bool,
}

/// A limit.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct LimitInfo {
    pub name: String,
    /// Limited quantity, in words.
    pub of: String,
    pub maximum: f64,
    pub unit: String,
}

/// A fact on the origin of the numbers.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct Fact {
    pub key: String,
    pub value: String,
}

/// A machine file, with the names of its entries by kind.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct MachineInfo {
    pub name: String,
    pub hash: String,
    pub variables: Vec<MachineVariable>,
    pub parts: Vec<String>,
    pub nodes: Vec<String>,
    pub contacts: Vec<String>,
    pub channels: Vec<String>,
    pub circuits: Vec<String>,
    pub sources: Vec<String>,
    pub sensors: Vec<String>,
    pub limits: Vec<String>,
    pub measurements: Vec<String>,
    /// Numbers that are marked as assumed.
    pub assumed: Vec<String>,
    pub cells: usize,
}

/// A variable of a machine.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct MachineVariable {
    #[serde(flatten)]
    pub range: RangeInfo,
    pub default: Option<f64>,
    /// Whether anything in the machine depends on it.
    pub used: bool,
}

/// A sweep file.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct SweepInfo {
    pub name: String,
    pub machine: String,
    pub conditions: usize,
    pub groups: Vec<GroupInfo>,
    /// Every variable with the least and the largest value of the conditions.
    pub variables: Vec<RangeInfo>,
}

/// A design of a sweep.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct GroupInfo {
    pub name: String,
    pub design: String,
    pub conditions: usize,
}

/// A reduced model.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[allow(missing_docs, non_snake_case)]
pub struct ReducedInfo {
    pub machine: String,
    pub hash: String,
    pub bytes: usize,
    /// Ranges that the model was made for.
    pub variables: Vec<RangeInfo>,
    /// Numbers that may be given other values than the file's.
    pub parameters: Vec<String>,
    pub sensors: Vec<String>,
    /// Modes of the coarser and of the finer network.
    pub modes: [usize; 2],
    /// Cells of the full model.
    pub cells: usize,
    /// Random conditions that the bound was calibrated on, with the largest error and the largest bound there.
    pub checks: usize,
    pub largest_error_K: f64,
    pub largest_bound_K: f64,
    /// Whether the model follows temperatures over time.
    pub in_time: bool,
    /// Whether the model holds the temperatures of all cells.
    pub field: bool,
}

/// The journal of a sweep.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct JournalInfo {
    pub conditions: usize,
    pub solved: usize,
    pub failed: usize,
    /// Lines that are damaged; their conditions are run again.
    pub damaged_lines: Vec<usize>,
    pub outputs: Vec<String>,
    /// Facts that the results depend on.
    pub identity: Vec<Fact>,
}

/// A table.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct TableInfo {
    pub rows: usize,
    pub conditions: Vec<ColumnInfo>,
    pub outputs: Vec<ColumnInfo>,
    /// Columns of text.
    pub texts: Vec<String>,
    pub provenance: Vec<Fact>,
}

/// A column of numbers.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[allow(missing_docs)]
pub struct ColumnInfo {
    #[serde(flatten)]
    pub range: RangeInfo,
    /// Rows without a value.
    pub missing: usize,
}

impl Info {
    /// Content of the bytes of a surrogate file.
    ///
    /// # Errors
    /// The file is damaged.
    pub fn of_surrogate(bytes: &[u8]) -> Result<Self> {
        surrogate(bytes).map(Self::Surrogate)
    }

    /// Content of a file.
    ///
    /// # Errors
    /// The file cannot be read, is of no known kind, or is no sound file of its kind.
    pub fn of(path: &Path) -> Result<Self> {
        if path.is_dir() {
            return Err(Error::input("this is a folder").in_file(path).help("name a file in it, such as surrogate.cps or sweep.csv"));
        }
        let file = open(path).map_err(|e| e.help("check the path"))?;
        match file.kind {
            FileKind::Surrogate => Self::of_surrogate(&file.bytes).map_err(|e| e.in_file(path)),
            FileKind::ReducedModel => Ok(Self::Reduced(reduced_info(&file.reduced_model()?, file.bytes.len()))),
            FileKind::Journal => journal::seen(path, &file.bytes).map(|seen| Self::Journal(journal_info(seen))),
            FileKind::Table => Table::from_bytes(file.bytes, path).map(|(table, _)| Self::Table(table_info(&table))),
            FileKind::Document => document(&file.document(&[])?),
            FileKind::Unknown => Err(Error::input("this is no surrogate, and its name does not say what it is").in_file(path).help(
                "known are surrogates, reduced models, journals of sweeps, machine and sweep files (.toml) and tables (.csv, .parquet)",
            )),
        }
    }
}

fn reduced_info(model: &ReducedModel, bytes: usize) -> ReducedInfo {
    let range = |(v, (low, high)): (&DescribedVariable, &(f64, f64))| {
        let shown = |si: f64| express(si, &v.unit, v.dimension).ok();
        RangeInfo { name: v.name.clone(), unit: v.unit.clone(), low: shown(*low), high: shown(*high) }
    };
    let made = &model.made;
    ReducedInfo {
        machine: model.machine.name.clone(),
        hash: model.machine.hash.clone(),
        bytes,
        variables: model.machine.variables.iter().zip(&model.ranges).map(range).collect(),
        parameters: model.parameters.iter().map(|p| p.name.clone()).collect(),
        sensors: model.machine.sensors.iter().map(|s| s.name.clone()).collect(),
        modes: [model.coarse.len(), model.fine.len()],
        cells: made.cells,
        checks: made.checks,
        largest_error_K: made.largest_error,
        largest_bound_K: made.largest_bound,
        in_time: model.in_time.is_some(),
        field: model.field.is_some(),
    }
}

fn facts(pairs: impl IntoIterator<Item = (String, String)>) -> Vec<Fact> {
    pairs.into_iter().map(|(key, value)| Fact { key, value }).collect()
}

fn surrogate(bytes: &[u8]) -> Result<SurrogateInfo> {
    let (opened, content) = (file::open(bytes)?, file::decode(bytes)?);
    let centre: Vec<f64> = opened.variables().map(|v| f64::midpoint(v.low, v.high)).collect();
    let answers = verdict::query(&opened, &centre)?.limits;
    let variables = content.variables.iter();
    Ok(SurrogateInfo {
        version: u16::from_le_bytes([bytes[8], bytes[9]]),
        bytes: bytes.len(),
        variables: variables
            .map(|v| RangeInfo { name: v.name.clone(), unit: v.unit.clone(), low: Some(v.low), high: Some(v.high) })
            .collect(),
        held: content.held.iter().enumerate().map(|(i, h)| held(&content, i, h)).collect(),
        points: (content.points.iter().enumerate())
            .map(|(i, p)| PointInfo {
                name: p.name.clone(),
                unit: p.unit.clone(),
                model: model_text(&content, i),
                half_width: p.half_width,
                over_time: content.in_time.as_ref().and_then(|own| own.errors.get(i).copied()),
            })
            .collect(),
        uncertain: uncertain(&opened),
        limits: opened.limits().zip(answers).map(|(limit, answer)| limit_info(&opened, &limit, answer)).collect(),
        provenance: facts(content.provenance),
    })
}

fn held(content: &model::SurrogateSpec, index: usize, held: &model::HeldSpec) -> HeldInfo {
    let own = content.followed.iter().flat_map(|f| &f.variables).find(|v| v.held == index);
    HeldInfo { name: held.name.clone(), unit: held.unit.clone(), value: held.value, followed: own.map(|v| [v.low, v.high]) }
}

fn uncertain(surrogate: &Surrogate<'_>) -> Vec<ParameterInfo> {
    let Some(own) = surrogate.uncertainty() else { return Vec::new() };
    let one = |(k, p): (usize, coldplate_runtime::Parameter<'_>)| {
        let (mean, variance) = own
            .known()
            .map_or((0.0, 1.0), |(mean, covariance)| (mean.get(k).unwrap_or(0.0), covariance.get(k * (k + 1) / 2 + k).unwrap_or(1.0)));
        ParameterInfo {
            name: p.name.to_owned(),
            unit: p.unit.to_owned(),
            value: p.value(mean),
            standard_deviation: p.deviation * variance.max(0.0).sqrt(),
            low: p.low,
            high: p.high,
            assumed: p.origin == coldplate_runtime::Origin::Assumed,
        }
    };
    own.parameters().enumerate().map(one).collect()
}

fn limit_info(surrogate: &Surrogate<'_>, limit: &coldplate_runtime::Limit<'_>, answer: LimitAnswer) -> LimitInfo {
    let point = |index: usize| surrogate.point(index).map_or("", |p| p.name);
    let of = match limit.kind {
        LimitKind::Maximum { point: p } => point(p).to_owned(),
        LimitKind::Rise { point: p, variable } => format!("{} over {}", point(p), surrogate.variable(variable).map_or("", |v| v.name)),
        LimitKind::Difference { first, second } => format!("{} minus {}", point(first), point(second)),
        LimitKind::Spread(points) => format!("spread of {}", points.iter().map(point).collect::<Vec<_>>().join(", ")),
    };
    LimitInfo { name: answer.name, of, maximum: answer.limit, unit: answer.unit }
}

fn journal_info(seen: JournalContent) -> JournalInfo {
    JournalInfo {
        conditions: seen.conditions,
        solved: seen.solved,
        failed: seen.failed,
        damaged_lines: seen.damaged,
        outputs: seen.header.outputs,
        identity: facts(seen.header.identity),
    }
}

fn table_info(table: &Table) -> TableInfo {
    let column = |c: &coldplate_tables::Column| {
        let present = || c.values.iter().copied().filter(|v| !v.is_nan());
        let range =
            RangeInfo { name: c.name.clone(), unit: c.unit.clone(), low: present().reduce(f64::min), high: present().reduce(f64::max) };
        ColumnInfo { range, missing: c.values.len() - present().count() }
    };
    TableInfo {
        rows: table.rows(),
        conditions: table.conditions().iter().map(column).collect(),
        outputs: table.outputs().iter().map(column).collect(),
        texts: table.texts.iter().map(|t| t.name.clone()).collect(),
        provenance: facts(table.provenance.iter().cloned()),
    }
}

/// A TOML file: a sweep names its machine and its conditions, a chart its figure; anything else is meant as a machine.
fn document(document: &Document) -> Result<Info> {
    match DocumentKind::of(document) {
        Some(DocumentKind::Chart) => {
            return Err(Error::input("this defines a chart").in_file(document.file()).help("`coldplate chart` draws it"));
        }
        Some(DocumentKind::Sweep) => {
            let definition = SweepDefinition::new(document.clone())?;
            let scope = definition.scope(&[])?;
            return Ok(Info::Sweep(sweep(&definition, &definition.plan(&scope.variables)?)?));
        }
        Some(DocumentKind::Machine) | None => {}
    }
    Ok(Info::Machine(machine(&Machine::from_document(document)?)?))
}

fn sweep(definition: &SweepDefinition, plan: &Plan) -> Result<SweepInfo> {
    let variable = |(at, v): (usize, &coldplate_describe::machine::DescribedVariable)| {
        let shown = || plan.shown.iter().map(|row| row[at]);
        RangeInfo { name: v.name.clone(), unit: v.unit.clone(), low: shown().reduce(f64::min), high: shown().reduce(f64::max) }
    };
    let group = |g: &coldplate_explore::sweep::ConditionGroup| GroupInfo {
        name: g.name.clone(),
        design: g.description.clone(),
        conditions: g.rows.len(),
    };
    Ok(SweepInfo {
        name: definition.name.clone(),
        machine: definition.machine.as_ref().map_or_else(String::new, |machine| machine.display().to_string()),
        conditions: plan.conditions.len(),
        groups: plan.groups.iter().map(group).collect(),
        variables: plan.variables.iter().enumerate().map(variable).collect(),
    })
}

fn machine(machine: &Machine) -> Result<MachineInfo> {
    let variable = |(at, v): (usize, &coldplate_describe::machine::DescribedVariable)| {
        let shown = |si: f64| express(si, &v.unit, v.dimension);
        let range = v.range.map(|(low, high)| Ok::<_, Error>((shown(low)?, shown(high)?))).transpose()?;
        let range =
            RangeInfo { name: v.name.clone(), unit: v.unit.clone(), low: range.map(|(low, _)| low), high: range.map(|(_, high)| high) };
        Ok(MachineVariable { range, default: v.default.map(shown).transpose()?, used: machine.uses(at) })
    };
    Ok(MachineInfo {
        name: machine.name.clone(),
        hash: machine.hash.clone(),
        variables: machine.variables.iter().enumerate().map(variable).collect::<Result<_>>()?,
        parts: machine.parts.iter().map(|p| p.name.clone()).collect(),
        nodes: machine.nodes.iter().map(|n| n.name.clone()).collect(),
        contacts: machine.contacts.iter().map(|c| c.name.clone()).collect(),
        channels: machine.channels.iter().map(|c| c.name.clone()).collect(),
        circuits: machine.circuits.iter().map(|c| c.name.clone()).collect(),
        sources: machine.sources.iter().map(|s| s.name.clone()).collect(),
        sensors: machine.sensors.iter().map(|s| s.name.clone()).collect(),
        limits: machine.limits.iter().map(|l| l.name.clone()).collect(),
        measurements: machine.measurements.iter().map(|m| m.name.clone()).collect(),
        assumed: machine.assumptions.iter().map(|a| a.key.clone()).collect(),
        cells: machine.default_cells,
    })
}
