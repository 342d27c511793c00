//! Surrogates from any table of conditions and outputs: polynomials and radial functions, judged by held-out data.
//!
//! [`fit`] makes one function per output. Candidates are polynomials with chosen terms and radial functions of four kernels
//! with tuned length scales; each is judged by cross-validation of its whole procedure, the better one becomes the model,
//! and the residuals of that cross-validation give the band. [`one_factor`] makes the one-variable formulas of the paper.
//! The module sees tables only, never the solver that may have made them.

mod corners;
pub mod dense;
pub mod double_double;
pub mod evaluate;
pub mod file;
mod followed;
mod group;
pub mod in_time;
pub mod least_squares;
pub mod model;
pub mod one_factor;
pub mod placement;
pub mod polynomial;
mod radial;
pub mod rbf;
mod select;
mod slopes;
mod sparse;
mod tall;
pub mod tune;
mod uncertain;
pub mod validation;

pub use evaluate::evaluate;
pub use select::fit_heard;

use model::{Kernel, SurrogateSpec, Transform, VariableSpec};
use rbf::Criterion;

use coldplate_base::error::{Error, Result};
use coldplate_base::progress::Silent;

/// One output of a table.
#[derive(Debug, Clone)]
pub struct FitOutput {
    /// Name.
    pub name: String,
    /// Unit of its values.
    pub unit: String,
    /// One per row; NaN where missing.
    pub values: Vec<f64>,
}

/// Conditions and outputs to fit, row by row.
#[derive(Debug, Clone)]
pub struct FitSamples {
    /// Condition variables. Their ranges are those in which the surrogate counts as inside: the ranges of the design if
    /// known. They are widened to rows that lie outside.
    pub variables: Vec<VariableSpec>,
    /// Conditions, one row of one value per variable each.
    pub rows: Vec<Vec<f64>>,
    /// Outputs on those rows.
    pub outputs: Vec<FitOutput>,
}

impl FitSamples {
    /// Samples whose variables are given by name and unit only; their ranges are those of the rows.
    pub fn with_measured_ranges(variables: &[(&str, &str)], rows: Vec<Vec<f64>>, outputs: Vec<FitOutput>) -> Self {
        let variables = variables
            .iter()
            .map(|(name, unit)| VariableSpec {
                name: (*name).to_owned(),
                unit: (*unit).to_owned(),
                low: f64::INFINITY,
                high: f64::NEG_INFINITY,
            })
            .collect();
        let mut samples = Self { variables, rows, outputs };
        samples.widen();
        samples
    }

    fn widen(&mut self) {
        for (k, variable) in self.variables.iter_mut().enumerate() {
            for x in self.rows.iter().filter_map(|row| row.get(k)) {
                variable.low = variable.low.min(*x);
                variable.high = variable.high.max(*x);
            }
        }
    }

    /// Checks shapes and values and widens the ranges to the rows.
    fn checked(&self) -> Result<Self> {
        let mut samples = self.clone();
        if samples.variables.is_empty() || samples.variables.len() > 16 {
            return Err(Error::input("a fit takes one to sixteen condition variables").read(samples.variables.len()));
        }
        for (i, row) in samples.rows.iter().enumerate() {
            if row.len() != samples.variables.len() {
                return Err(Error::input(format!("row {} has {} conditions for {} variables", i + 1, row.len(), samples.variables.len())));
            }
            if let Some(k) = row.iter().position(|x| !x.is_finite()) {
                let name = samples.variables[k].name.clone();
                return Err(Error::input(format!("row {} misses a condition", i + 1)).at_key(name).help("leave the row out"));
            }
        }
        for output in &samples.outputs {
            if output.values.len() != samples.rows.len() {
                let what = format!("{} values for {} rows", output.values.len(), samples.rows.len());
                return Err(Error::input(what).at_key(output.name.clone()));
            }
            if let Some(i) = output.values.iter().position(|y| y.is_infinite()) {
                return Err(Error::input(format!("row {} holds an infinite value", i + 1)).at_key(output.name.clone()));
            }
        }
        if samples.outputs.is_empty() {
            return Err(Error::input("no output to fit"));
        }
        samples.widen();
        Ok(samples)
    }
}

/// Candidates and settings of a fit.
#[derive(Debug, Clone)]
pub struct FitOptions {
    /// Largest total degree of a polynomial's terms (default 6, at most 12).
    pub max_degree: usize,
    /// Whether polynomials may be chosen (default true).
    pub polynomials: bool,
    /// Kernels that may be chosen (default all four; empty for none).
    pub kernels: Vec<Kernel>,
    /// Criterion of length scales and smoothing (default the likelihood: it overfits less than the leave-one-out error,
    /// which remains an honest judge of kernels and tails).
    pub tuning: Criterion,
    /// Folds of the cross-validation (default 10; one per condition if there are fewer).
    pub folds: usize,
    /// Seed of the folds (default 1).
    pub seed: u64,
    /// Share of new conditions the band covers (default 0.95).
    pub coverage: f64,
    /// Most radial bases one surrogate may hold (default 3); each costs a query about a microsecond.
    pub max_bases: usize,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            max_degree: 6,
            polynomials: true,
            kernels: vec![Kernel::Gaussian, Kernel::Multiquadric, Kernel::ThinPlate, Kernel::Cubic],
            tuning: Criterion::Likelihood,
            folds: 10,
            seed: 1,
            coverage: 0.95,
            max_bases: 3,
        }
    }
}

/// A kind of model with its settings.
#[derive(Debug, Clone, PartialEq)]
pub enum ModelFamily {
    /// A polynomial.
    Polynomial {
        /// Largest total degree of a term.
        degree: usize,
        /// Monomials.
        terms: usize,
    },
    /// Radial functions.
    Rbf {
        /// Kernel.
        kernel: Kernel,
        /// Degree of the tail.
        tail: usize,
        /// Inverse length scale per variable, in scaled variables.
        scales: Vec<f64>,
        /// Smoothing.
        smoothing: f64,
        /// Whether the scales were tuned for this output alone.
        own: bool,
    },
}

/// Root mean square and largest magnitude of residuals.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ResidualSizes {
    /// Root mean square.
    pub rms: f64,
    /// Largest magnitude.
    pub max: f64,
}

/// A model that was considered for an output.
#[derive(Debug, Clone, PartialEq)]
pub struct CandidateModel {
    /// Kind and settings.
    pub family: ModelFamily,
    /// How the variables enter.
    pub transforms: Vec<Transform>,
    /// Leave-one-out residuals with everything but the coefficients held fixed; optimistic, since settings were chosen by them.
    pub leave_one_out: ResidualSizes,
    /// Held-out residuals of the whole procedure in k folds, settings chosen anew in each, where this was computed.
    pub k_fold: Option<ResidualSizes>,
}

/// How one output was fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct PointReport {
    /// Name of the output.
    pub name: String,
    /// Unit of the output.
    pub unit: String,
    /// Rows used: those where the output is present.
    pub rows: usize,
    /// The model chosen.
    pub chosen: CandidateModel,
    /// Half width of the band, in the output's unit.
    pub half_width: f64,
    /// Held-out residuals of the choice, one per row used.
    pub held_out: Vec<f64>,
    /// Everything considered, the chosen one among it.
    pub candidates: Vec<CandidateModel>,
}

/// Fits every output of `samples`; [`fit_heard`] also reports progress.
///
/// # Errors
/// Errors of [`fit_heard`].
pub fn fit(samples: &FitSamples, options: &FitOptions) -> Result<SurrogateFit> {
    fit_heard(samples, options, &Silent)
}

/// A surrogate with the record of its choice.
#[derive(Debug, Clone)]
pub struct SurrogateFit {
    /// The functions; no limits yet, provenance empty.
    pub surrogate: SurrogateSpec,
    /// One per output.
    pub points: Vec<PointReport>,
    /// Remarks for the user: variables that do not vary, rows left out.
    pub notes: Vec<String>,
}

impl SurrogateFit {
    /// States the bands of a fit to rows that were placed where fits were least sure.
    ///
    /// Rows placed there are no easier to predict than later conditions, so their held-out residuals count as they are
    /// ([`validation::half_width`]), however few they are. The errors of the last of `batches`, predicted before the values were
    /// known, count with them. If enough conditions were predicted before (19 for 95 %), the latest of these errors alone are
    /// evidence too: of earlier fits, at places that were the worst. The narrower of both bands is stated.
    ///
    /// `values` are the values of the rows, one list per output; `batches` hold lists of errors in this form, the last
    /// batch at the end.
    pub fn state_bands(&mut self, values: &[Vec<f64>], batches: &[Vec<Vec<f64>>], coverage: f64) {
        let enough = (coverage / (1.0 - coverage)).ceil() as usize;
        for (o, (point, report)) in self.surrogate.points.iter_mut().zip(&mut self.points).enumerate() {
            let last: &[f64] = batches.last().map_or(&[], |batch| &batch[o]);
            let residuals = [report.held_out.as_slice(), last].concat();
            let mut half_width = validation::half_width(&residuals, coverage);
            let mut direct = Vec::new();
            for batch in batches.iter().rev() {
                if direct.len() < enough {
                    direct.extend_from_slice(&batch[o]);
                }
            }
            if direct.len() >= enough {
                half_width = half_width.min(validation::half_width(&direct, coverage));
            }
            report.half_width = half_width.max(values.get(o).map_or(0.0, |values| select::least_half_width(values)));
            point.half_width = report.half_width;
        }
    }

    /// The surrogate file, for [`file::open`] and the runtime crate.
    ///
    /// # Errors
    /// Errors of [`file::encode`].
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        file::encode(&self.surrogate)
    }
}
