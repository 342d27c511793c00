//! What the answers of a surrogate leave open: uncertain parameters with the slopes of every point along them, and what the
//! model misses. [`Uncertainty::fit`] makes it from a table of slopes, [`Uncertainty::section`] writes it.

use std::collections::BTreeMap;

use coldplate_runtime::{self as runtime, NINETY_FIVE, Origin, Scale, format};
use rayon::prelude::*;
use serde::Deserialize;

use super::evaluate::{monomial, scale_row};
use super::least_squares::{Orthonormal, left_out, rms};
use super::model::{Surrogate, Transform, Variable};
use super::polynomial::{Fitted, Search};
use crate::error::{Error, Result};
use crate::foundation::table::Table;

/// Key of the note in a table of slopes that says what they are along.
pub const NOTE: &str = "uncertainty";
/// Largest degree of the slopes: of four variables it has 35 terms.
const MOST_DEGREE: usize = 3;
/// Rows per term at least.
const ROWS_PER_TERM: usize = 2;
/// Slopes are good enough when their leave-one-out error is this share of their size.
const GOOD: f64 = 0.01;

/// An uncertain parameter of the machine.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Key in the machine file, or name of a factor.
    pub name: String,
    /// Unit of its values.
    pub unit: String,
    /// Value the surrogate was made with.
    pub nominal: f64,
    /// Standard deviation.
    pub deviation: f64,
    /// Smallest value that may be stated.
    pub low: f64,
    /// Largest value that may be stated.
    pub high: f64,
    /// How it enters.
    pub scale: Scale,
    /// Where its deviation is from.
    pub origin: Origin,
}

/// What the model misses at a point, as standard deviations in its unit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Miss {
    /// At this point alone.
    pub own: f64,
    /// In common with all points.
    pub common: f64,
}

/// What is known of the states (one per parameter, one per point, one for all points) beyond their standard deviations.
#[derive(Debug, Clone, PartialEq)]
pub struct States {
    /// Mean of each.
    pub mean: Vec<f64>,
    /// Packed lower triangle of their covariance, row by row.
    pub covariance: Vec<f64>,
}

/// What the answers of a surrogate leave open.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Uncertainty {
    /// Uncertain parameters.
    pub parameters: Vec<Parameter>,
    /// How the variables enter the slopes.
    pub transforms: Vec<Transform>,
    /// Exponents of the slopes' terms.
    pub terms: Vec<Vec<u8>>,
    /// Point by point, term by term, one coefficient per parameter: change of the point with one standard deviation.
    pub slopes: Vec<Vec<Vec<f64>>>,
    /// What the model misses, point by point.
    pub misses: Vec<Miss>,
    /// Growth of that away from the measured conditions.
    pub growth: f64,
    /// Conditions at which the model was compared with measurements.
    pub measured: Vec<Vec<f64>>,
    /// What is known of the states; `None` where that is nothing.
    pub states: Option<States>,
}

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

impl Uncertainty {
    /// From a table of slopes on conditions of the surrogate's variables.
    ///
    /// # Errors
    /// The table does not say what its slopes are along, lacks one of them or a variable of the surrogate, or is beyond the bounds
    /// of a surrogate file.
    pub fn fit(surrogate: &Surrogate, table: &Table) -> Result<Self> {
        let wrong = |what: String| Error::input(what).help("make the table of slopes anew with `coldplate sweep`");
        let text = table.provenance.iter().find(|(key, _)| key == NOTE).map(|(_, text)| text);
        let text = text.ok_or_else(|| wrong("this table does not say what its slopes are along".into()))?;
        let note: Note = serde_json::from_str(text).map_err(|e| wrong(format!("what the slopes are along cannot be read: {e}")))?;
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
        let slopes = (0..surrogate.points.len()).map(|p| {
            (0..terms).map(|t| (0..count).map(|k| shape.coefficients[p * count + k][t]).collect()).collect()
        });
        let misses = surrogate.points.iter().map(|p| {
            let own = note.model_error.get(&p.name).copied().unwrap_or(0.0);
            Miss { own, common: note.common }
        });
        let measured = note.measured.iter().map(|row| {
            let value = |v: &Variable| row.get(&v.name).copied().ok_or_else(|| wrong(format!("a measured condition lacks '{}'", v.name)));
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

    /// What an opened file holds.
    pub fn of(file: &runtime::Uncertainty<'_>) -> Self {
        let parameters = file.parameters().map(|p| Parameter {
            name: p.name.to_owned(),
            unit: p.unit.to_owned(),
            nominal: p.nominal,
            deviation: p.deviation,
            low: p.low,
            high: p.high,
            scale: p.scale,
            origin: p.origin,
        });
        let terms: Vec<Vec<u8>> = (0..file.terms()).map(|t| (0..file.variable_count()).map(|v| file.exponent(t, v)).collect()).collect();
        let count = file.parameter_count();
        let row = |p: usize, t: usize| (0..count).map(|k| file.slope_coefficient(p, t, k)).collect();
        let states = file.known().map(|(mean, covariance)| States { mean: mean.iter().collect(), covariance: covariance.iter().collect() });
        Self {
            parameters: parameters.collect(),
            transforms: (0..file.variable_count()).map(|v| file.transform(v)).collect(),
            slopes: (0..file.point_count()).map(|p| (0..terms.len()).map(|t| row(p, t)).collect()).collect(),
            misses: (0..file.point_count()).map(|p| file.missed(p)).map(|(own, common)| Miss { own, common }).collect(),
            growth: file.growth(),
            measured: file.measured().map(|row| row.iter().collect()).collect(),
            states,
            terms,
        }
    }

    /// The content of its section in a surrogate file; `tests` are the conditions of the self-tests.
    ///
    /// # Errors
    /// Content beyond the format.
    pub fn section(&self, surrogate: &Surrogate, tests: &[Vec<f64>]) -> Result<Vec<u8>> {
        let (count, points, variables) = (self.parameters.len(), surrogate.points.len(), surrogate.variables.len());
        let sizes_agree = self.slopes.len() == points
            && self.misses.len() == points
            && self.slopes.iter().all(|t| t.len() == self.terms.len() && t.iter().all(|row| row.len() == count))
            && self.terms.iter().all(|t| t.len() == variables)
            && self.transforms.len() == variables
            && self.measured.iter().all(|row| row.len() == variables)
            && self.states.as_ref().is_none_or(|s| {
                let n = count + points + 1;
                s.mean.len() == n && s.covariance.len() == n * (n + 1) / 2
            });
        if !sizes_agree {
            return Err(Error::input("the uncertainty of this surrogate is that of other points, variables or parameters"));
        }
        let transforms = surrogate.variables.iter().zip(&self.transforms).map(|(v, t)| if v.low == v.high { 0 } else { *t as u8 });
        let transforms: Vec<u8> = transforms.chain(std::iter::repeat(0)).take(format::MAX_VARIABLES).collect();
        let degree = self.terms.iter().map(|t| t.iter().map(|e| usize::from(*e)).sum::<usize>()).max().unwrap_or(0);
        let mut text = String::new();
        let mut records = Vec::new();
        for p in &self.parameters {
            records.extend(small(text.len(), 4)?);
            records.extend(small(p.name.len(), 2)?);
            records.extend(small(p.unit.len(), 2)?);
            records.extend([p.scale as u8, p.origin as u8, 0, 0, 0, 0, 0, 0]);
            text.push_str(&p.name);
            text.push_str(&p.unit);
        }
        let mut content = Vec::new();
        for n in [count, self.terms.len(), degree, self.measured.len()] {
            content.extend(small(n, 2)?);
        }
        content.extend(transforms);
        content.extend(small(text.len(), 4)?);
        content.extend(small(usize::from(self.states.is_some()), 2)?);
        content.extend(small(tests.len(), 2)?);
        content.extend(records);
        let mut numbers: Vec<f64> = self.parameters.iter().flat_map(|p| [p.nominal, p.deviation, p.low, p.high]).collect();
        numbers.extend(self.misses.iter().flat_map(|m| [m.own, m.common]));
        numbers.push(self.growth);
        numbers.extend(self.measured.iter().flatten());
        if let Some(states) = &self.states {
            numbers.extend(states.mean.iter().chain(&states.covariance));
        }
        numbers.extend(self.slopes.iter().flatten().flatten());
        for x in tests {
            numbers.extend((0..points).map(|p| self.deviation(surrogate, p, x)));
        }
        content.extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
        content.extend(self.terms.iter().flat_map(|t| t.chunks(2)).map(|pair| pair[0] | pair.get(1).map_or(0, |odd| odd << 4)));
        content.extend(text.as_bytes());
        Ok(content)
    }

    /// Change of a point with one standard deviation of each parameter at the condition `x`, in the point's unit.
    pub fn slopes_at(&self, surrogate: &Surrogate, point: usize, x: &[f64]) -> Vec<f64> {
        let u = scale_row(&surrogate.variables, &self.transforms, x);
        let mut slopes = vec![0.0; self.parameters.len()];
        for (term, row) in self.terms.iter().zip(&self.slopes[point]) {
            let factor = monomial(term, &u);
            slopes.iter_mut().zip(row).for_each(|(s, c)| *s += factor * c);
        }
        slopes
    }

    /// What the mean of the states adds to a point's value at the condition `x`, in its unit.
    pub fn shift(&self, surrogate: &Surrogate, point: usize, x: &[f64]) -> f64 {
        let Some(states) = &self.states else { return 0.0 };
        let (count, Miss { own, common }) = (self.parameters.len(), self.misses[point]);
        let slopes: f64 = self.slopes_at(surrogate, point, x).iter().zip(&states.mean).map(|(s, m)| s * m).sum();
        let last = states.mean.len() - 1;
        slopes + own * states.mean[count + point] + common * states.mean[last]
    }

    /// Standard deviation of a point's value at the condition `x`, in its unit: the definition that the runtime crate is tested
    /// against.
    pub fn deviation(&self, surrogate: &Surrogate, point: usize, x: &[f64]) -> f64 {
        let (count, points) = (self.parameters.len(), surrogate.points.len());
        let Miss { own, common } = self.misses[point];
        let mut weights = self.slopes_at(surrogate, point, x);
        weights.extend((0..points).map(|p| if p == point { own } else { 0.0 }));
        weights.push(common);
        let covariance = |i: usize, j: usize| match &self.states {
            Some(states) => states.covariance[i.max(j) * (i.max(j) + 1) / 2 + i.min(j)],
            None => f64::from(u8::from(i == j)),
        };
        let n = count + points + 1;
        let by_states: f64 = (0..n).map(|i| weights[i] * (0..n).map(|j| weights[j] * covariance(i, j)).sum::<f64>()).sum();
        let fit = surrogate.points[point].half_width / NINETY_FIVE;
        let away = self.growth * self.distance(surrogate, x);
        (by_states.max(0.0) + fit * fit + away * away * (own * own + common * common)).sqrt()
    }

    fn distance(&self, surrogate: &Surrogate, x: &[f64]) -> f64 {
        let rows = self.measured.len() as f64;
        let square = |(k, v): (usize, &Variable)| {
            let mean = self.measured.iter().map(|row| row[k]).sum::<f64>() / rows;
            if v.high > v.low { (2.0 * (x[k] - mean) / (v.high - v.low)).powi(2) } else { 0.0 }
        };
        if self.measured.is_empty() { 0.0 } else { surrogate.variables.iter().enumerate().map(square).sum::<f64>().sqrt() }
    }
}

impl NoteParameter {
    fn parameter(self) -> Result<Parameter> {
        let scale = match self.scale.as_str() {
            "linear" => Scale::Linear,
            "log" => Scale::Log,
            "reciprocal" => Scale::Reciprocal,
            other => return Err(Error::input("this is no scale of a parameter").read(other)),
        };
        let origin = if self.assumed { Origin::Assumed } else { Origin::Stated };
        let Self { name, unit, nominal, deviation, low, high, .. } = self;
        Ok(Parameter { name, unit, nominal, deviation, low, high, scale, origin })
    }
}

/// States of which nothing but correlations of the parameters is known; `None` where there are none.
fn correlated(correlations: &[Vec<f64>], points: usize) -> Option<States> {
    let is_one = correlations.iter().enumerate().all(|(i, row)| row.iter().enumerate().all(|(j, c)| i == j || *c == 0.0));
    if is_one {
        return None;
    }
    let n = correlations.len() + points + 1;
    let of = |i: usize, j: usize| correlations.get(i).and_then(|row| row.get(j)).copied().unwrap_or(f64::from(u8::from(i == j)));
    Some(States { mean: vec![0.0; n], covariance: (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))).map(|(i, j)| of(i, j)).collect() })
}

fn small(value: usize, bytes: usize) -> Result<Vec<u8>> {
    let all = (value as u64).to_le_bytes();
    if all[bytes..].iter().any(|b| *b != 0) {
        return Err(Error::input("a text or table is too long for a surrogate file").read(value));
    }
    Ok(all[..bytes].to_vec())
}

/// Terms of the slopes with one set of coefficients per slope.
struct Shape {
    transforms: Vec<Transform>,
    terms: Vec<Vec<u8>>,
    coefficients: Vec<Vec<f64>>,
}

impl Shape {
    /// The least degree, and the transforms, whose leave-one-out error is good; otherwise the best there is.
    fn choose(variables: &[Variable], rows: &[Vec<f64>], outputs: &[Vec<f64>]) -> Result<Self> {
        let complete: Vec<usize> = (0..rows.len()).filter(|r| outputs.iter().all(|o| o[*r].is_finite())).collect();
        let rows: Vec<&[f64]> = complete.iter().map(|r| rows[*r].as_slice()).collect();
        let outputs: Vec<Vec<f64>> = outputs.iter().map(|o| complete.iter().map(|r| o[*r]).collect()).collect();
        if rows.is_empty() {
            return Err(Error::input("no condition has all slopes").help("make the table of slopes anew with `coldplate sweep`"));
        }
        let active: Vec<bool> = variables.iter().map(|v| v.high > v.low).collect();
        let search = Search { variables, active: &active, max_degree: MOST_DEGREE };
        let size = rms(&outputs.iter().map(|o| rms(o)).collect::<Vec<_>>());
        let mut best: Option<(f64, Vec<Transform>, usize)> = None;
        for degree in 0..=MOST_DEGREE {
            let terms = search.terms(degree);
            if degree > 0 && terms.len() * ROWS_PER_TERM > rows.len() || terms.len() > format::MAX_SLOPE_TERMS {
                break;
            }
            let tried: Vec<(f64, Vec<Transform>)> = (search.transforms().into_par_iter())
                .map(|transforms| {
                    let (basis, _) = basis(&search, &rows, &transforms, &terms);
                    let leverages = basis.leverages(rows.len());
                    let error = |o: &Vec<f64>| {
                        let mut residuals = o.clone();
                        basis.project_out(&mut residuals);
                        rms(&left_out(&residuals, &leverages))
                    };
                    (rms(&outputs.iter().map(error).collect::<Vec<_>>()), transforms)
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
            Fitted { transforms: transforms.clone(), terms: terms.clone(), coefficients, left_out: Vec::new() }.expanded()
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

/// Orthonormal columns of those terms that do not depend on the others on these rows, and these terms.
fn basis(search: &Search<'_>, rows: &[&[f64]], transforms: &[Transform], terms: &[Vec<u8>]) -> (Orthonormal, Vec<Vec<u8>>) {
    let mut basis = Orthonormal::new();
    let mut kept = Vec::new();
    for (term, column) in terms.iter().zip(search.columns(rows, transforms, terms)) {
        if basis.push(&column) {
            kept.push(term.clone());
        }
    }
    (basis, kept)
}
