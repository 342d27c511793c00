//! `figure = "published"`: temperatures over one variable, point by point, beside published polynomials.

use std::path::{Path, PathBuf};

use super::super::figures::steps;
use super::super::gallery::Gallery;
use super::one_factor::{OneFactorTable, SampleSource};
use super::results::Results;
use super::{Head, path_of};
use coldplate_base::document::Section;
use coldplate_base::error::{Error, Result};
use coldplate_base::units::{dimension_of, express};
use coldplate_figures::chart::panels::{Panel, PanelsFigure};
use coldplate_figures::chart::style::Quantity;
use coldplate_figures::chart::title_and_footer::fixed_conditions;
use coldplate_surrogate::fit::one_factor::OneFactorFit;
use coldplate_tables::{Column, Table};

/// Largest distance of a printed curve from ours at which it is drawn, K. Chosen: further away it would hide all
/// others.
const FAR: f64 = 100.0;
/// Number of values along a curve. Chosen: enough to look smooth.
const FINE: usize = 61;

/// Keys: as `one_factor`; `fits` (a CSV file with the columns `table`, `part`, `sensor` and the coefficients `c0`, `c1`,
/// ...), `number` (which table of it), `x_unit` (the unit its polynomials count in, or a multiple of one, as
/// `1e-5 m3/s`); optional `corrections` (a CSV file with `table`, `part`, `coefficient`, `probably`).
#[derive(Debug, Clone)]
pub(super) struct PublishedChart {
    samples: SampleSource,
    fits: PathBuf,
    corrections: Option<PathBuf>,
    number: String,
    x_unit: String,
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
        })
    }

    pub(super) fn draw(&self, head: &Head, results: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
        let OneFactorTable { table, variable, degree } = self.samples.open(head, results)?;
        let x = table.column(&variable)?;
        let theirs = self.counted(x).map_err(|e| head.place(e, "x_unit"))?;
        let (low, high) = x.values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        let along = steps(low, high, FINE);
        let mut panels = Vec::new();
        for polynomial in self.polynomials(head)? {
            let ours = table.column(&polynomial.sensor).map_err(|e| e.in_file(&self.fits))?;
            let fit = OneFactorFit::fit(&x.values, &ours.values, degree)?;
            let line = |c: &[f64]| along.iter().map(|x| (*x, value(c, theirs.of(*x)))).collect::<Vec<_>>();
            let drawable = (value(&polynomial.printed, theirs.of(low)) - fit.value(low)).abs() < FAR;
            panels.push(Panel {
                title: polynomial.part.clone(),
                samples: x.values.iter().copied().zip(ours.values.iter().copied()).collect(),
                curves: vec![
                    along.iter().map(|x| (*x, fit.value(*x))).collect(),
                    if drawable { line(&polynomial.printed) } else { Vec::new() },
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
        let mut names = vec![format!("ours, polynomial of degree {degree}"), "printed".to_string()];
        if panels.iter().any(|p| !p.curves[2].is_empty()) {
            names.push("printed, one coefficient corrected".into());
        } else {
            panels.iter_mut().for_each(|p| p.curves.truncate(2));
        }
        let usual = [fixed_conditions(&fixed), "Markers: our conditions, solved in full.".to_string()];
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
