//! `figure = "scan"`: readings over a number of the machine file, with published or measured values marked.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::super::figures::steps;
use super::super::gallery::Gallery;
use super::results::Results;
use super::state::condition_of;
use super::{Head, path_of};
use coldplate_base::document::Section;
use coldplate_base::error::Result;
use coldplate_describe::machine::Machine;
use coldplate_figures::chart::one_factor::{OneFactorFigure, SampledCurve};
use coldplate_figures::chart::style::Quantity;
use coldplate_solve::meshed::MeshedMachine;

/// Keys: `machine`, `measurement` or `condition`, `label`, `unit`, `low`, `high`, `points`, and one `[[curve]]` for each
/// number that runs: `key` in the machine file, `sensor`, optional `name`; one `[[mark]]` per value beside them: `name`
/// and `places` (pairs of x and y) or `level` (one y along the whole axis).
#[derive(Debug, Clone)]
pub(super) struct ScanChart {
    machine: PathBuf,
    x: Quantity,
    values: Vec<f64>,
    curves: Vec<Scanned>,
    marks: Vec<SampledCurve>,
}

/// A number of the machine file that runs, and the name of its curve; the sensor is looked up when it is drawn.
#[derive(Debug, Clone)]
struct Scanned {
    key: String,
    name: String,
}

impl ScanChart {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        root.one_of(&["measurement", "condition"])?;
        let (low, high) = (root.number("low")?, root.number("high")?);
        if low >= high {
            return Err(root.error_at("high", "the end of the range must be above its start").help("exchange low and high"));
        }
        let curves = root.tables("curve")?.into_iter().map(|curve| {
            let (key, sensor) = (curve.text("key")?, curve.text("sensor")?);
            let name = curve.opt_text("name")?.unwrap_or(sensor);
            curve.finish()?;
            Ok(Scanned { key, name })
        });
        let marks = root.tables("mark")?.into_iter().map(|mark| {
            let name = mark.text("name")?;
            if let Some(level) = mark.opt_number("level")? {
                mark.finish()?;
                return Ok(SampledCurve { name, line: vec![(low, level), (high, level)], ..SampledCurve::default() });
            }
            let pairs = mark.list("places")?;
            let pair = |value: &coldplate_base::document::Value<'_>| {
                let pair = value.quantities(coldplate_base::units::Dimension::NUMBER, Some(2))?;
                Ok((pair[0], pair[1]))
            };
            let samples = pairs.iter().map(pair).collect::<Result<Vec<_>>>()?;
            mark.finish()?;
            Ok(SampledCurve { name, samples, ..SampledCurve::default() })
        });
        Ok(Self {
            machine: path_of(root, folder, "machine")?,
            x: Quantity::new(root.text("label")?, root.text("unit")?),
            values: steps(low, high, root.integer("points", 2)?),
            curves: curves.collect::<Result<Vec<_>>>()?,
            marks: marks.collect::<Result<Vec<_>>>()?,
        })
    }

    pub(super) fn draw(&self, head: &Head, _: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
        let machine = Machine::read(&self.machine, &[])?;
        let root = head.root();
        let (_, fixed) = condition_of(&root, &machine)?;
        let names: Vec<&str> = machine.sensors.iter().map(|s| s.name.as_str()).collect();
        let sensors = root.tables("curve")?.iter().map(|c| c.choice("sensor", &names)).collect::<Result<Vec<_>>>()?;
        let mut curves = Vec::new();
        for (scanned, sensor) in self.curves.iter().zip(sensors) {
            let read = |x: &f64| -> Result<(f64, f64)> {
                let set = (scanned.key.clone(), format!("{x} {}", self.x.unit));
                let changed = Machine::read(&self.machine, &[set])?;
                let (condition, _) = condition_of(&head.root(), &changed)?;
                let model = MeshedMachine::new(changed, None)?;
                let state = model.solve(&model.solver(&condition)?, &condition)?;
                Ok((*x, model.readings(&state)[sensor]))
            };
            let line = self.values.par_iter().map(read).collect::<Result<Vec<_>>>()?;
            curves.push(SampledCurve { name: scanned.name.clone(), line, ..SampledCurve::default() });
        }
        curves.extend(self.marks.iter().cloned());
        head.add(
            gallery,
            &OneFactorFigure {
                title: head.title(format!("{}: readings over {}", machine.name, self.x.name)),
                x: self.x.clone(),
                y: Quantity::new("temperature", "degC"),
                curves,
                band_of: String::new(),
                fixed,
                notes: head.notes([]),
            },
        )
    }
}
