//! Uncertainty of a surrogate from a table of slopes: polynomials that share their terms, and the note on the parameters that
//! the slopes belong to.

use std::collections::BTreeMap;

use coldplate_runtime::format;
use rayon::prelude::*;
use serde::Deserialize;

use super::least_squares::{Orthonormal, left_out};
use super::model::{Miss, Origin, ParameterSpec, Scale, StateDistribution, SurrogateSpec, Transform, UncertaintySpec, VariableSpec};
use super::polynomial::{FittedPolynomial, PolynomialSearch};
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::root_mean_square;
use coldplate_tables::Table;

/// Key of the note in a table of slopes that names the parameters the slopes belong to.
pub const NOTE: &str = "uncertainty";
/// Largest degree of the slopes. Chosen: with four variables there are 35 terms, and each slope needs a multiple of
/// that in rows.
const MOST_DEGREE: usize = 3;
/// Fewest rows per term. Chosen: more terms fit better, more rows cost full solves.
const ROWS_PER_TERM: usize = 2;
/// Leave-one-out error, as a share of the slopes' size, at which a degree is good enough. Chosen: one per cent of a
/// standard deviation does not matter, and fewer terms make queries quicker.
const GOOD: f64 = 0.01;

/// The note of a table of slopes.
#[derive(Debug, Deserialize)]
struct Note {
    parameters: Vec<NoteParameter>,
    correlations: Vec<Vec<f64>>,
    model_error: BTreeMap<String, f64>,
    common: f64,
    growth: f64,
    measured: Vec<BTreeMap<String, f64>>,
}

#[derive(Debug, Deserialize)]
struct NoteParameter {
    name: String,
    unit: String,
    nominal: f64,
    deviation: f64,
    low: f64,
    high: f64,
    scale: String,
    assumed: bool,
}

impl UncertaintySpec {
    /// Uncertainty from a table of slopes on conditions of the surrogate's variables.
    ///
    /// # Errors
    /// The table does not name the parameters of its slopes, lacks a slope or a variable of the surrogate, or is beyond the bounds
    /// of a surrogate file.
    pub fn fit(surrogate: &SurrogateSpec, table: &Table) -> Result<Self> {
        let wrong = |what: String| Error::input(what).help("make the table of slopes anew with `coldplate sweep`");
        let text = table.provenance.iter().find(|(key, _)| key == NOTE).map(|(_, text)| text);
        let text = text.ok_or_else(|| wrong("this table does not name the parameters of its slopes".into()))?;
        let note: Note = serde_json::from_str(text).map_err(|e| wrong(format!("the parameters of the slopes cannot be read: {e}")))?;
        if note.parameters.len() > format::MAX_PARAMETERS {
            let what = format!("a surrogate file holds at most {} uncertain parameters", format::MAX_PARAMETERS);
            return Err(Error::input(what).read(note.parameters.len()).help("let some of them share a factor: [uncertain.NAME]"));
        }
        let column = |name: &str| {
            let found = table.columns.iter().find(|c| c.name == name);
            found.map(|c| &c.values).ok_or_else(|| wrong(format!("the table of slopes has no column '{name}'")))
        };
        let conditions: Vec<&Vec<f64>> = surrogate.variables.iter().map(|v| column(&v.name)).collect::<Result<_>>()?;
        let rows: Vec<Vec<f64>> = (0..table.rows()).map(|r| conditions.iter().map(|c| c[r]).collect()).collect();
        let mut outputs = Vec::new();
        for point in &surrogate.points {
            for parameter in &note.parameters {
                outputs.push(column(&format!("d({})/d({})", point.name, parameter.name))?.clone());
            }
        }
        let shape = Shape::choose(&surrogate.variables, &rows, &outputs)?;
        let (count, terms) = (note.parameters.len(), shape.terms.len());
        let slopes = (0..surrogate.points.len())
            .map(|p| (0..terms).map(|t| (0..count).map(|k| shape.coefficients[p * count + k][t]).collect()).collect());
        let misses = surrogate.points.iter().map(|p| {
            let own = note.model_error.get(&p.name).copied().unwrap_or(0.0);
            Miss { own, common: note.common }
        });
        let measured = note.measured.iter().map(|row| {
            let value =
                |v: &VariableSpec| row.get(&v.name).copied().ok_or_else(|| wrong(format!("a measured condition lacks '{}'", v.name)));
            surrogate.variables.iter().map(value).collect::<Result<Vec<f64>>>()
        });
        Ok(Self {
            slopes: slopes.collect(),
            misses: misses.collect(),
            growth: note.growth,
            measured: measured.take(format::MAX_MEASURED).collect::<Result<_>>()?,
            states: correlated(&note.correlations, surrogate.points.len()),
            transforms: shape.transforms,
            terms: shape.terms,
            parameters: note.parameters.into_iter().map(NoteParameter::parameter).collect::<Result<_>>()?,
        })
    }
}

impl NoteParameter {
    fn parameter(self) -> Result<ParameterSpec> {
        let scale = match self.scale.as_str() {
            "linear" => Scale::Linear,
            "log" => Scale::Log,
            "reciprocal" => Scale::Reciprocal,
            other => return Err(Error::input("this is no scale of a parameter").read(other)),
        };
        let origin = if self.assumed { Origin::Assumed } else { Origin::Stated };
        let Self { name, unit, nominal, deviation, low, high, .. } = self;
        Ok(ParameterSpec { name, unit, nominal, deviation, low, high, scale, origin })
    }
}

/// States whose correlations are those of the parameters; `None` if there are none.
fn correlated(correlations: &[Vec<f64>], points: usize) -> Option<StateDistribution> {
    let is_one = correlations.iter().enumerate().all(|(i, row)| row.iter().enumerate().all(|(j, c)| i == j || *c == 0.0));
    if is_one {
        return None;
    }
    let n = correlations.len() + points + 1;
    let of = |i: usize, j: usize| correlations.get(i).and_then(|row| row.get(j)).copied().unwrap_or(f64::from(u8::from(i == j)));
    Some(StateDistribution {
        mean: vec![0.0; n],
        covariance: (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))).map(|(i, j)| of(i, j)).collect(),
    })
}

/// Terms of the slopes with one set of coefficients per slope.
struct Shape {
    transforms: Vec<Transform>,
    terms: Vec<Vec<u8>>,
    coefficients: Vec<Vec<f64>>,
}

impl Shape {
    /// The least degree, and its transforms, with a good leave-one-out error; otherwise the best there is.
    fn choose(variables: &[VariableSpec], rows: &[Vec<f64>], outputs: &[Vec<f64>]) -> Result<Self> {
        let complete: Vec<usize> = (0..rows.len()).filter(|r| outputs.iter().all(|o| o[*r].is_finite())).collect();
        let rows: Vec<&[f64]> = complete.iter().map(|r| rows[*r].as_slice()).collect();
        let outputs: Vec<Vec<f64>> = outputs.iter().map(|o| complete.iter().map(|r| o[*r]).collect()).collect();
        if rows.is_empty() {
            return Err(Error::input("no condition has all slopes").help("make the table of slopes anew with `coldplate sweep`"));
        }
        let active: Vec<bool> = variables.iter().map(|v| v.high > v.low).collect();
        let search = PolynomialSearch { variables, active: &active, max_degree: MOST_DEGREE };
        let size = root_mean_square(&outputs.iter().map(|o| root_mean_square(o)).collect::<Vec<_>>());
        let mut best: Option<(f64, Vec<Transform>, usize)> = None;
        for degree in 0..=MOST_DEGREE {
            let terms = search.terms(degree);
            if degree > 0 && terms.len() * ROWS_PER_TERM > rows.len() || terms.len() > format::MAX_SLOPE_TERMS {
                break;
            }
            let tried: Vec<(f64, Vec<Transform>)> = (search.transforms(&rows).into_par_iter())
                .map(|transforms| {
                    let (basis, _) = basis(&search, &rows, &transforms, &terms);
                    let leverages = basis.leverages(rows.len());
                    let error = |o: &Vec<f64>| {
                        let mut residuals = o.clone();
                        basis.project_out(&mut residuals);
                        root_mean_square(&left_out(&residuals, &leverages))
                    };
                    (root_mean_square(&outputs.iter().map(error).collect::<Vec<_>>()), transforms)
                })
                .collect();
            let Some((error, transforms)) = tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) else { break };
            if best.as_ref().is_none_or(|(least, ..)| error < *least) {
                best = Some((error, transforms, degree));
            }
            if error <= GOOD * size {
                break;
            }
        }
        let (_, transforms, degree) = best.ok_or_else(|| Error::numerics("no polynomial fits the slopes"))?;
        let (basis, terms) = basis(&search, &rows, &transforms, &search.terms(degree));
        let fits = outputs.iter().map(|o| {
            let mut residuals = o.clone();
            let coefficients = basis.back_substitute(&basis.project_out(&mut residuals));
            FittedPolynomial { transforms: transforms.clone(), terms: terms.clone(), coefficients, left_out: Vec::new() }.expanded()
        });
        let expanded: Vec<_> = fits.collect();
        let mut all: Vec<Vec<u8>> = expanded.iter().flat_map(|p| p.terms.iter().cloned()).collect();
        all.sort_by_key(|t| (t.iter().map(|e| usize::from(*e)).sum::<usize>(), std::cmp::Reverse(t.clone())));
        all.dedup();
        let place: BTreeMap<&Vec<u8>, usize> = all.iter().enumerate().map(|(i, t)| (t, i)).collect();
        let coefficients = expanded.iter().map(|p| {
            let mut row = vec![0.0; all.len()];
            p.terms.iter().zip(&p.coefficients).for_each(|(t, c)| row[place[t]] = *c);
            row
        });
        let coefficients = coefficients.collect();
        Ok(Self { transforms, coefficients, terms: all })
    }
}

/// Orthonormal columns of the terms that are linearly independent on these rows, and these terms.
fn basis(search: &PolynomialSearch<'_>, rows: &[&[f64]], transforms: &[Transform], terms: &[Vec<u8>]) -> (Orthonormal, Vec<Vec<u8>>) {
    let mut basis = Orthonormal::new();
    let mut kept = Vec::new();
    for (term, column) in terms.iter().zip(search.columns(rows, transforms, terms)) {
        if basis.push(&column) {
            kept.push(term.clone());
        }
    }
    (basis, kept)
}
