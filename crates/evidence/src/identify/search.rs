//! Levenberg and Marquardt's method on the whitened misfit: points, their curvature, and the steps from them.

use nalgebra::{DMatrix, DVector};

use super::predict::{Pace, Steps};
use super::search_end::SearchEnd;
use super::{Derivatives, Free, IdentifyProblem, MeshShare, Prediction};
use crate::measurement::{MeasuredHeat, Whitener, whiten};
use coldplate_base::document::Document;
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::{significant, sum_of_squares};
use coldplate_base::progress::Progress;
use coldplate_explore::stop;

/// Derivatives with respect to the conditions are reused at points whose coordinates differ by no more than this share of their
/// size. Chosen: a larger one saves runs of logs.
const ALIKE: f64 = 0.1;
/// Error allowed in each time step of a log of a machine of cells on the way to the end, over that at the end. Dimensionless;
/// chosen: a larger one is faster and adds noise.
const ON_THE_WAY: f64 = 20.0;
/// Logs on the way are run in the time steps of another point whose coordinates differ by no more than this share of their
/// size. Chosen: common steps avoid noise, and farther away their error grows.
const IN_STEP: f64 = 0.5;

/// A point of the search.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Point {
    pub coordinates: Vec<f64>,
    pub prediction: Prediction,
    /// Whitened misfit plus the priors' part.
    pub cost: f64,
    /// Whether the slopes with respect to the parameters were computed at this point, not carried along from another one.
    pub is_sloped: bool,
}

/// Longer time steps, in which logs are run on the way to the end: the point at which they were found, and the change of the
/// predictions by shorter steps there.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Stride {
    coordinates: Vec<f64>,
    steps: Steps,
    /// Change of each reading by shorter steps, K; empty if all runs are equally accurate.
    share: Vec<f64>,
}

impl Stride {
    /// Predictions without the change by shorter steps.
    fn coarse(&self, values: &[f64]) -> Vec<f64> {
        values.iter().enumerate().map(|(i, v)| v - self.share.get(i).unwrap_or(&0.0)).collect()
    }
}

/// The search of one problem, with its cost so far.
pub(super) struct Search<'a> {
    pub problem: &'a IdentifyProblem,
    /// The parameters, with the scales and limits in which they are searched now.
    pub free: Vec<Free>,
    /// Parameters that are the heat of a column, with the variable of that column: the parameter has the column's uncertainty as its
    /// prior, and the column has no error of its own where the parameter acts.
    columns: Vec<(usize, usize)>,
    /// Readings less the mesh's share, K: they compare with predictions on the model's own mesh.
    pub readings: Vec<f64>,
    pub mesh: MeshShare,
    pub evaluations: usize,
    /// Indices of the coordinates that are held.
    pub frozen: Vec<usize>,
    /// Error allowed in each time step of a log at the end of the search, K.
    pub accuracy: f64,
    /// Error allowed in each time step now, K: larger while further starts are tried.
    pub tolerance: f64,
    /// Point at which a log's derivatives with respect to the conditions were computed last, and these derivatives.
    sloped: Option<(Vec<f64>, Vec<Vec<f64>>)>,
    pub stride: Stride,
    /// How the last descent ended.
    pub ended: SearchEnd,
    /// Coordinates and misfit of the point that the last step led to.
    pub reached: Option<(Vec<f64>, f64)>,
    progress: &'a dyn Progress,
}

impl<'a> Search<'a> {
    pub fn new(problem: &'a IdentifyProblem, progress: &'a dyn Progress) -> Self {
        let readings = whiten::readings(&problem.data);
        let mesh = MeshShare::none(readings.len());
        let stride = Stride::default();
        let accuracy = problem.accuracy();
        let (free, columns) = with_measured_heats(problem);
        Self {
            problem,
            free,
            columns,
            readings,
            mesh,
            evaluations: 0,
            frozen: Vec::new(),
            accuracy,
            tolerance: accuracy,
            sloped: None,
            stride,
            ended: SearchEnd::AtRest,
            reached: None,
            progress,
        }
    }

    /// The search with the mesh's share subtracted from the readings.
    pub fn corrected(mut self, mesh: MeshShare) -> Self {
        self.correct(mesh);
        self
    }

    /// Sets the mesh's share.
    fn correct(&mut self, mesh: MeshShare) {
        self.readings = whiten::readings(&self.problem.data).iter().zip(&mesh.correction).map(|(r, m)| r - m).collect();
        self.mesh = mesh;
    }

    /// Computes the mesh's share at a point and sets it; returns whether it changes anything.
    ///
    /// # Errors
    /// Errors of [`MeshShare::of`].
    pub(crate) fn continue_from(&mut self, at: &Point) -> Result<bool> {
        let own = self.stride.coarse(&at.prediction.values);
        let share = self.problem.mesh_share(&self.values(&at.coordinates), &own, self.pace(&at.coordinates))?;
        self.correct(share);
        Ok(!self.mesh.is_none())
    }

    /// Whitening by the stated covariance, with the derivatives of a prediction with respect to the conditions.
    pub fn stated(&self, prediction: &Prediction) -> Whitener {
        let IdentifyProblem { data, uncertainty, .. } = self.problem;
        let mut common = whiten::common_errors(data, uncertainty, &prediction.conditions);
        common.extend(self.mesh.scatter.iter().cloned());
        Whitener::new(&whiten::deviations(data, uncertainty), &common)
    }

    /// Whitening by the stated deviation of each reading alone, without derivatives.
    pub fn apart(&self) -> Whitener {
        let IdentifyProblem { data, uncertainty, .. } = self.problem;
        let own = whiten::places(data).into_iter().zip(whiten::deviations(data, uncertainty));
        Whitener::new(&own.map(|((_, k), d)| d.hypot(uncertainty.bias[k])).collect::<Vec<_>>(), &[])
    }

    /// Reports a stage of the search.
    pub fn say(&self, what: &str) {
        self.progress.say(what);
    }

    pub fn values(&self, coordinates: &[f64]) -> Vec<f64> {
        self.free.iter().zip(coordinates).map(|(f, c)| f.value(*c)).collect()
    }

    /// A point with the derivatives with respect to the conditions, and the covariance these give.
    pub fn whole(&mut self, coordinates: Vec<f64>) -> Result<(Point, Whitener)> {
        self.may_go_on()?;
        let values = self.values(&coordinates);
        let is_alike = |near: &[f64]| {
            let of = |(free, (a, b)): (&Free, (&f64, &f64))| (a - b).abs() <= ALIKE * free.size(free.value(*a));
            self.free.iter().zip(coordinates.iter().zip(near)).all(of)
        };
        let known = self.sloped.as_ref().filter(|(near, _)| is_alike(near)).map(|(_, conditions)| conditions.clone());
        let mut prediction = if self.has_strides() {
            let rough = Pace::own(ON_THE_WAY * self.accuracy);
            let (fine, found) = rayon::join(
                || self.problem.predict_free(&values, false, Pace::own(self.accuracy)),
                || self.problem.predict_some(&values, Derivatives { parameters: true, conditions: known.is_none() }, rough),
            );
            let (fine, (found, steps)) = (fine?.values, found?);
            let share = fine.iter().zip(&found.values).map(|(f, c)| f - c).collect();
            self.stride = Stride { coordinates: coordinates.clone(), steps, share };
            Prediction { values: fine, ..found }
        } else {
            self.problem.predict_some(&values, Derivatives { parameters: true, conditions: known.is_none() }, Pace::own(self.accuracy))?.0
        };
        self.without_columns(&mut prediction);
        match known {
            Some(conditions) => prediction.conditions = conditions,
            None if self.problem.data.is_transient() => self.sloped = Some((coordinates.clone(), prediction.conditions.clone())),
            None => {}
        }
        self.evaluations += 1;
        let whitener = self.stated(&prediction);
        let cost = self.cost(&coordinates, &prediction, &whitener);
        Ok((Point { coordinates, prediction, cost, is_sloped: true }, whitener))
    }

    /// Takes the errors of columns away from the readings in which a parameter stands for them.
    fn without_columns(&self, prediction: &mut Prediction) {
        let data = &self.problem.data;
        let acts = |k: usize, row: usize| self.problem.held_in(Some(&data.rows[row].test)).contains(&k);
        for (k, variable) in &self.columns {
            for ((row, _), slopes) in whiten::places(data).into_iter().zip(&mut prediction.conditions) {
                if let Some(slope) = slopes.get_mut(*variable).filter(|_| acts(*k, row)) {
                    *slope = 0.0;
                }
            }
        }
    }

    /// Whether logs are run in longer time steps on the way: only for machines of cells.
    fn has_strides(&self) -> bool {
        self.problem.data.is_transient() && self.problem.study.model.mesh.cells > 0
    }

    /// Pace of logs on the way: in the steps of a point nearby, if there is one.
    fn pace(&self, coordinates: &[f64]) -> Pace<'_> {
        if !self.has_strides() {
            return Pace::own(self.tolerance);
        }
        let Stride { coordinates: known, steps, .. } = &self.stride;
        let is_near = |(free, (a, b)): (&Free, (&f64, &f64))| (a - b).abs() <= IN_STEP * free.size(free.value(*b));
        let is_near = known.len() == coordinates.len() && self.free.iter().zip(coordinates.iter().zip(known)).all(is_near);
        Pace { tolerance: ON_THE_WAY * self.accuracy, steps: is_near.then_some(steps) }
    }

    /// A point under a covariance that is known.
    pub fn point(&mut self, coordinates: Vec<f64>, whitener: &Whitener) -> Result<Point> {
        let moves = (0..coordinates.len()).any(|k| !self.frozen.contains(&k));
        self.predicted(coordinates, moves, whitener)
    }

    /// Checks that the process was not told to stop.
    ///
    /// # Errors
    /// The process was told to stop: the error says how far the search came.
    fn may_go_on(&self) -> Result<()> {
        if !stop::is_asked() {
            return Ok(());
        }
        let error = Error::input("stopped by a signal before the search came to its end; nothing was written");
        let Some((coordinates, cost)) = &self.reached else { return Err(error.help("nothing was found yet: start again")) };
        let found = self.free.iter().zip(self.values(coordinates)).map(|(free, value)| {
            let p = &free.parameter;
            let unit = if p.unit == "1" { String::new() } else { format!(" {}", p.unit) };
            format!("{} = {}{unit}", free.name(), significant(p.shown(value), 5))
        });
        let found = found.collect::<Vec<_>>().join(", ");
        Err(error.help(format!("the last values had a misfit of {cost:.1}, and --set KEY=VALUE begins there: {found}")))
    }

    /// A point with its slopes, or without them.
    pub fn predicted(&mut self, coordinates: Vec<f64>, is_sloped: bool, whitener: &Whitener) -> Result<Point> {
        self.may_go_on()?;
        let mut prediction = self.problem.predict_free(&self.values(&coordinates), is_sloped, self.pace(&coordinates))?;
        prediction.values.iter_mut().zip(&self.stride.share).for_each(|(v, s)| *v += s);
        self.evaluations += 1;
        let cost = self.cost(&coordinates, &prediction, whitener);
        self.progress.at(&format!("prediction {}: misfit {cost:.2}", self.evaluations));
        Ok(Point { coordinates, prediction, cost, is_sloped })
    }

    /// A point a step away. A log is run once, and the slopes are those of the last point, corrected by the change of the
    /// predictions over the step (Broyden, Mathematics of Computation 19 (1965) 577), each coordinate in units of its standard
    /// deviation.
    pub fn after(&mut self, here: &Point, to: Vec<f64>, matrix: &DMatrix<f64>, whitener: &Whitener) -> Result<Point> {
        if !self.problem.data.is_transient() {
            return self.point(to, whitener);
        }
        let mut there = self.predicted(to, false, whitener)?;
        let slopes = self.slopes(here);
        let moved: Vec<f64> = there.coordinates.iter().zip(&here.coordinates).map(|(t, h)| t - h).collect();
        let weighed: Vec<f64> = moved.iter().enumerate().map(|(k, m)| m * matrix[(k, k)]).collect();
        let length: f64 = moved.iter().zip(&weighed).map(|(m, w)| m * w).sum();
        let scales: Vec<f64> = self.free.iter().zip(&there.coordinates).map(|(f, c)| f.scale(*c)).collect();
        let mended = |i: usize| {
            let expected: f64 = slopes.iter().zip(&moved).map(|(column, m)| column[i] * m).sum();
            let missed = (there.prediction.values[i] - here.prediction.values[i] - expected) / length.max(f64::MIN_POSITIVE);
            (0..moved.len()).map(|k| (slopes[k][i] + missed * weighed[k]) / scales[k]).collect()
        };
        there.prediction.slopes = (0..here.prediction.values.len()).map(mended).collect();
        Ok(there)
    }

    /// Whitened residual.
    pub fn residual(&self, prediction: &Prediction, whitener: &Whitener) -> Vec<f64> {
        let apart: Vec<f64> = self.readings.iter().zip(&prediction.values).map(|(r, p)| r - p).collect();
        whitener.apply(&apart)
    }

    /// Readings less predictions, K.
    pub fn left(&self, at: &Point) -> Vec<f64> {
        self.readings.iter().zip(&at.prediction.values).map(|(r, p)| r - p).collect()
    }

    /// A point under another covariance.
    pub fn under(&self, at: Point, whitener: &Whitener) -> Point {
        Point { cost: self.cost(&at.coordinates, &at.prediction, whitener), ..at }
    }

    /// Derivatives of the readings with respect to each coordinate, K.
    pub fn slopes(&self, at: &Point) -> Vec<Vec<f64>> {
        let of = |(k, free): (usize, &Free)| {
            let scale = free.scale(at.coordinates[k]);
            at.prediction.slopes.iter().map(|row| row[k] * scale).collect()
        };
        self.free.iter().enumerate().map(of).collect()
    }

    /// One over the variance of each coordinate's prior; zero without one.
    pub(crate) fn prior_information(&self) -> Vec<f64> {
        self.free.iter().map(|f| prior(f).map_or(0.0, |(_, spread)| 1.0 / (spread * spread))).collect()
    }

    /// Change of the readings with each parameter, K, over the parameter's plausible range: its prior's standard deviation, or
    /// its size.
    pub(crate) fn broad_columns(&self, at: &Point) -> Vec<Vec<f64>> {
        let mut columns = self.slopes(at);
        for (k, (free, column)) in self.free.iter().zip(&mut columns).enumerate() {
            let reach = prior(free).map_or_else(|| free.size(free.value(at.coordinates[k])), |(_, spread)| spread);
            column.iter_mut().for_each(|c| *c *= reach);
        }
        columns
    }

    fn cost(&self, coordinates: &[f64], prediction: &Prediction, whitener: &Whitener) -> f64 {
        sum_of_squares(&self.residual(prediction, whitener)) + priors(&self.free, coordinates)
    }

    /// Whitened derivatives with respect to the coordinates.
    pub fn jacobian(&self, at: &Point, whitener: &Whitener) -> DMatrix<f64> {
        let slopes = self.slopes(at);
        let mut jacobian = DMatrix::zeros(at.prediction.values.len(), slopes.len());
        for (k, column) in slopes.iter().enumerate() {
            jacobian.set_column(k, &DVector::from_vec(whitener.apply(column)));
        }
        jacobian
    }

    /// The curvature at a point and the direction down from it, priors included.
    pub fn normal(&self, at: &Point, whitener: &Whitener) -> (DMatrix<f64>, DVector<f64>) {
        let jacobian = self.jacobian(at, whitener);
        let residual = DVector::from_vec(self.residual(&at.prediction, whitener));
        let (mut matrix, mut right) = (jacobian.transpose() * &jacobian, jacobian.transpose() * residual);
        for (k, free) in self.free.iter().enumerate() {
            if let Some((centre, spread)) = prior(free) {
                matrix[(k, k)] += 1.0 / (spread * spread);
                right[k] += (centre - at.coordinates[k]) / (spread * spread);
            }
        }
        (matrix, right)
    }
}

/// The parameters of a problem, and those among them that are the heat of a column, with its variable.
fn with_measured_heats(problem: &IdentifyProblem) -> (Vec<Free>, Vec<(usize, usize)>) {
    let (machine, mut free, mut columns) = (&problem.study.model.machine, problem.free.clone(), Vec::new());
    for heat in MeasuredHeat::all(machine, &problem.data, &problem.uncertainty) {
        let key = ["source", &machine.sources[heat.source].name, "power"];
        for (k, own) in free.iter_mut().enumerate() {
            if Document::names_in(&own.parameter.name).is_some_and(|names| names == key) {
                own.as_certain_as(heat.deviation);
                columns.push((k, heat.variable));
            }
        }
    }
    (free, columns)
}

/// Prior of the coordinate: centre and standard deviation.
pub(super) fn prior(free: &Free) -> Option<(f64, f64)> {
    free.prior.map(|(value, deviation)| if free.is_logarithmic { (value.ln(), deviation / value) } else { (value, deviation) })
}

/// The priors' part of the misfit.
pub(super) fn priors(free: &[Free], coordinates: &[f64]) -> f64 {
    free.iter().zip(coordinates).filter_map(|(f, c)| prior(f).map(|(at, spread)| ((c - at) / spread).powi(2))).sum()
}
