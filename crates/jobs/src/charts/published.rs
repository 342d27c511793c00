//! `figure = "published"`: temperatures over one variable, point by point, beside published polynomials.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::super::figures::steps;
use super::super::gallery::Gallery;
use super::one_factor::{OneFactorTable, SampleSource};
use super::results::Results;
use super::{Head, path_of};
use coldplate_base::document::Section;
use coldplate_base::error::{Error, Result};
use coldplate_base::units::{self, dimension_of, express};
use coldplate_describe::machine::{Condition, DescribedVariable};
use coldplate_figures::chart::panels::{Panel, PanelsFigure};
use coldplate_figures::chart::style::Quantity;
use coldplate_figures::chart::title_and_footer::fixed_conditions;
use coldplate_solve::study::Study;
use coldplate_surrogate::fit::one_factor::OneFactorFit;
use coldplate_tables::{Column, Table};

/// Largest distance of a printed curve from ours at which it is drawn, K. Chosen: further away it would hide all
/// others.
const FAR: f64 = 100.0;
/// Number of values along a curve. Chosen: enough to look smooth.
const FINE: usize = 61;

/// Keys: as `one_factor`; `fits` (a CSV file with the columns `table`, `part`, `sensor` and the coefficients `c0`, `c1`,
/// ...), `number` (which table of it), `x_unit` (the unit its polynomials count in, or a multiple of one, as
/// `1e-5 m3/s`); optional `corrections` (a CSV file with `table`, `part`, `coefficient`, `probably`) and `asked` (another
/// machine at the same conditions: `machine`, `set`, `numbers`, `test`, `name`).
#[derive(Debug, Clone)]
pub(super) struct PublishedChart {
    samples: SampleSource,
    fits: PathBuf,
    corrections: Option<PathBuf>,
    number: String,
    x_unit: String,
    asked: Option<AskedMachine>,
}

/// A machine with numbers that were identified, solved at the conditions of the samples.
#[derive(Debug, Clone)]
struct AskedMachine {
    /// The machine file.
    machine: PathBuf,
    /// Changes of the machine file, `KEY=VALUE`, before its numbers.
    set: Vec<(String, String)>,
    /// A CSV file with the columns `number` and `value`; a number of one test alone is written `KEY@TEST`.
    numbers: PathBuf,
    /// The test whose numbers count.
    test: String,
    /// Name of its curve.
    name: String,
}

impl AskedMachine {
    fn read(section: Section<'_>, folder: &Path) -> Result<Self> {
        let set = section.opt_texts("set")?.unwrap_or_default();
        let pair = |text: &String| match text.split_once('=') {
            Some((key, value)) => Ok((key.trim().to_string(), value.trim().to_string())),
            None => Err(section.error_at("set", "a change is written KEY=VALUE").read(text)),
        };
        let asked = Self {
            machine: path_of(&section, folder, "machine")?,
            set: set.iter().map(pair).collect::<Result<_>>()?,
            numbers: path_of(&section, folder, "numbers")?,
            test: section.text("test")?,
            name: section.text("name")?,
        };
        section.finish()?;
        Ok(asked)
    }

    /// The machine with its numbers.
    fn study(&self) -> Result<Study> {
        let study = Study::read(&self.machine, &self.set, None)?;
        let table = Table::read(&self.numbers)?;
        let missing = |name: &str| Error::input(format!("there is no column '{name}'")).in_file(&self.numbers);
        let names = &table.text("number").ok_or_else(|| missing("number"))?.values;
        let values = &table.column("value").map_err(|e| e.in_file(&self.numbers))?.values;
        let mut found = Vec::new();
        for (name, value) in names.iter().zip(values) {
            let (key, test) = name.split_once('@').map_or((name.as_str(), None), |(key, test)| (key, Some(test)));
            if test.is_none_or(|test| test == self.test) {
                found.push((study.parameter(key).map_err(|e| e.in_file(&self.numbers))?, *value));
            }
        }
        study.with(&found.iter().map(|(parameter, value)| (parameter, *value)).collect::<Vec<_>>())
    }

    /// Readings of all sensors at every condition of a table, by row.
    fn readings(&self, table: &Table) -> Result<AskedReadings> {
        let study = self.study()?;
        let model = &study.model;
        let read = |row: usize| -> Result<Vec<f64>> {
            let condition = |variable: &DescribedVariable| {
                let column = table.conditions().iter().find(|c| c.name == variable.name);
                column.map_or(Ok(variable.default.unwrap_or(f64::NAN)), |c| units::convert(c.values[row], &c.unit, variable.dimension))
            };
            let condition = Condition::from_si(model.machine.variables.iter().map(condition).collect::<Result<_>>()?);
            Ok(model.readings(&model.solve(&model.solver(&condition)?, &condition)?))
        };
        let rows = (0..table.rows()).into_par_iter().map(read).collect::<Result<_>>()?;
        Ok(AskedReadings { sensors: model.machine.sensors.iter().map(|s| s.name.clone()).collect(), rows })
    }
}

/// Readings of a machine, row by row.
struct AskedReadings {
    sensors: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl AskedReadings {
    /// Readings of one sensor over `x`; none if the machine lacks it.
    fn of(&self, sensor: &str, x: &[f64]) -> Vec<(f64, f64)> {
        match self.sensors.iter().position(|own| own == sensor) {
            Some(at) => x.iter().copied().zip(self.rows.iter().map(|row| row[at])).collect(),
            None => Vec::new(),
        }
    }
}

/// A published polynomial, coefficients from the constant up.
struct Polynomial {
    part: String,
    sensor: String,
    printed: Vec<f64>,
    corrected: Option<Vec<f64>>,
}

impl PublishedChart {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        Ok(Self {
            samples: SampleSource::read(root, folder)?,
            fits: path_of(root, folder, "fits")?,
            corrections: root.opt_text("corrections")?.map(|p| folder.join(p)),
            number: root.integer("number", 0)?.to_string(),
            x_unit: root.text("x_unit")?,
            asked: root.opt_section("asked")?.map(|section| AskedMachine::read(section, folder)).transpose()?,
        })
    }

    pub(super) fn draw(&self, head: &Head, results: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
        let OneFactorTable { table, variable, degree } = self.samples.open(head, results)?;
        let x = table.column(&variable)?;
        let theirs = self.counted(x).map_err(|e| head.place(e, "x_unit"))?;
        let (low, high) = x.values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        let along = steps(low, high, FINE);
        let asked = self.asked.as_ref().map(|asked| asked.readings(&table)).transpose()?;
        let mut panels = Vec::new();
        for polynomial in self.polynomials(head)? {
            let ours = table.column(&polynomial.sensor).map_err(|e| e.in_file(&self.fits))?;
            let fit = OneFactorFit::fit(&x.values, &ours.values, degree)?;
            let line = |c: &[f64]| along.iter().map(|x| (*x, value(c, theirs.of(*x)))).collect::<Vec<_>>();
            let drawable = (value(&polynomial.printed, theirs.of(low)) - fit.value(low)).abs() < FAR;
            let at_asked = asked.as_ref().map(|asked| asked.of(&polynomial.sensor, &x.values)).unwrap_or_default();
            panels.push(Panel {
                title: polynomial.part.clone(),
                samples: x.values.iter().copied().zip(ours.values.iter().copied()).collect(),
                curves: vec![
                    along.iter().map(|x| (*x, fit.value(*x))).collect(),
                    if drawable { line(&polynomial.printed) } else { Vec::new() },
                    at_asked,
                    polynomial.corrected.as_deref().map(line).unwrap_or_default(),
                ],
            });
        }
        let fixed: Vec<(Quantity, f64)> = table
            .conditions()
            .iter()
            .filter(|c| c.name != x.name && c.values.first().is_some_and(|v| v.is_finite()))
            .map(|c| (Quantity::new(&c.name, &c.unit), c.values[0]))
            .collect();
        let names = [
            format!("the machine file as shipped, polynomial of degree {degree}"),
            "printed".to_string(),
            self.asked.as_ref().map_or_else(String::new, |asked| asked.name.clone()),
            "printed, one coefficient corrected".to_string(),
        ];
        // A curve that no panel has is no curve of the figure.
        let used: Vec<usize> = (0..names.len()).filter(|k| *k < 2 || panels.iter().any(|p| !p.curves[*k].is_empty())).collect();
        let names: Vec<String> = used.iter().map(|k| names[*k].clone()).collect();
        panels.iter_mut().for_each(|p| p.curves = used.iter().map(|k| std::mem::take(&mut p.curves[*k])).collect());
        let usual = [fixed_conditions(&fixed), "Markers: the shipped machine, solved in full.".to_string()];
        head.add(
            gallery,
            &PanelsFigure {
                title: head.title(format!("Table {}: temperatures over the {}", self.number, variable.replace('_', " "))),
                x: Quantity::new(&x.name, &x.unit),
                y: Quantity::new("temperature", "degC"),
                names,
                panels,
                notes: head.notes(usual),
            },
        )
    }

    /// Conversion of the variable to the unit of the polynomials.
    fn counted(&self, x: &Column) -> Result<Counted> {
        let dimension = dimension_of(&x.unit)?;
        let (factor, unit) = match self.x_unit.split_once(' ') {
            Some((number, unit)) => match number.parse::<f64>() {
                Ok(number) => (number, unit),
                Err(_) => (1.0, self.x_unit.as_str()),
            },
            None => (1.0, self.x_unit.as_str()),
        };
        if dimension_of(unit)? != dimension {
            return Err(Error::input(format!("the table counts {} in {}, which is no {unit}", x.name, x.unit)));
        }
        let at = |v: f64| -> Result<f64> { Ok(express(coldplate_base::units::convert(v, &x.unit, dimension)?, unit, dimension)? / factor) };
        let (zero, one) = (at(0.0)?, at(1.0)?);
        Ok(Counted { offset: zero, factor: one - zero })
    }

    fn polynomials(&self, head: &Head) -> Result<Vec<Polynomial>> {
        let fits = Table::read(&self.fits)?;
        let corrections = self.corrections.as_deref().map(Table::read).transpose()?;
        let text = |table: &Table, name: &str, row: usize, file: &Path| -> Result<String> {
            let column = table.text(name).ok_or_else(|| Error::input(format!("there is no column '{name}'")).in_file(file))?;
            Ok(column.values[row].clone())
        };
        let number = |text: &str, file: &Path| -> Result<f64> {
            if text.is_empty() {
                Ok(0.0)
            } else {
                text.parse().map_err(|_| Error::input("this cell is no number").in_file(file).read(text))
            }
        };
        let mut found = Vec::new();
        for row in 0..fits.rows() {
            if text(&fits, "table", row, &self.fits)? != self.number {
                continue;
            }
            let part = text(&fits, "part", row, &self.fits)?;
            let mut printed = Vec::new();
            for power in 0.. {
                let Some(column) = fits.text(&format!("c{power}")) else { break };
                printed.push(number(&column.values[row], &self.fits)?);
            }
            let mut corrected = None;
            if let (Some(table), Some(file)) = (&corrections, &self.corrections) {
                for fix in 0..table.rows() {
                    if text(table, "table", fix, file)? == self.number && text(table, "part", fix, file)? == part {
                        let name = text(table, "coefficient", fix, file)?;
                        let power = name.strip_prefix('c').and_then(|p| p.parse::<usize>().ok()).filter(|p| *p < printed.len());
                        let power = power.ok_or_else(|| Error::input("no such coefficient").in_file(file).read(&name))?;
                        corrected.get_or_insert_with(|| printed.clone())[power] = number(&text(table, "probably", fix, file)?, file)?;
                    }
                }
            }
            found.push(Polynomial { part, sensor: text(&fits, "sensor", row, &self.fits)?, printed, corrected });
        }
        if found.is_empty() {
            let what = format!("{} has no polynomial of a table {}", self.fits.display(), self.number);
            return Err(head.root().error_at("number", what));
        }
        Ok(found)
    }
}

/// Conversion from our unit to the unit of the polynomials.
struct Counted {
    offset: f64,
    factor: f64,
}

impl Counted {
    fn of(&self, x: f64) -> f64 {
        self.offset + self.factor * x
    }
}

/// Value of a polynomial, coefficients from the constant up.
fn value(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |y, c| y * x + c)
}
