//! Finalists, fitted through the full solver.

mod begun;
mod secant;
mod straight;

pub use begun::Begun;
pub use straight::{MachineSlopes, Origin};

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::effects::Hypothesis;
use super::predictor::{Predictor, Solved};
use coldplate_base::error::Result;
use coldplate_base::numbers::sum_of_squares;
use coldplate_evidence::discrepancy::DiscrepancySize;
use coldplate_evidence::measurement::Whitener;

/// Steps with the same slopes, and how often slopes are renewed.
const MOST_STEPS: usize = 3;
const MOST_RENEWALS: usize = 4;
/// Where fronts run through the water every step has slopes of its own.
const MOST_RENEWALS_OF_FRONTS: usize = 6;
/// A step shorter than this share of the standard deviation is none.
const SMALL: f64 = 0.05;
/// Slopes are renewed until they moved the fit by less than this share of its standard deviation.
const RENEWED: f64 = 0.3;
/// The same of fits that begin together with slopes made once for all: each has a part of the data, and ends near the others.
const RENEWED_OF_PARTS: f64 = 2.0;

/// A cause with its amplitudes as the full solver has them.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// Amplitudes.
    pub amplitudes: Vec<f64>,
    /// Their standard deviations.
    pub deviations: Vec<f64>,
    /// Their correlations; those of what has no amplitude are zero.
    pub correlations: Vec<Vec<f64>>,
    /// Whitened misfit left.
    pub misfit: f64,
    /// Predictions, K.
    pub values: Vec<f64>,
    /// The same before the sensors' own errors.
    pub machine: Vec<f64>,
    /// Where the machine was last solved: from there slopes were followed.
    pub origin: Origin,
    /// What is left of the readings that were used, K, at the places they belong to.
    pub left: Vec<f64>,
    /// Change of the predictions of these with each amplitude, K per unit.
    pub slopes: Vec<Vec<f64>>,
    /// The same of all predictions before the sensors' own errors.
    pub machine_slopes: MachineSlopes,
    /// Logarithm of the evidence, without the prior of the hypothesis: Laplace's approximation.
    pub evidence: f64,
    /// Minus twice the logarithm of the likelihood at these amplitudes and of the prior of the level, beside that of a misfit of
    /// zero without any discrepancy: covariances about different machines are not compared.
    pub deviance: f64,
    /// The discrepancy it was fitted with.
    pub level: DiscrepancySize,
}

impl Fitted {
    /// What the members would have to explain, K, to first order: the residual without their amplitudes, and what each changes for an
    /// amplitude of its prior's spread. What has no amplitude is in both.
    pub(crate) fn without_amplitudes(&self, members: &[&Hypothesis]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let (mut without, mut columns) = (self.left.clone(), Vec::new());
        for ((h, amplitude), slope) in members.iter().zip(&self.amplitudes).zip(&self.slopes).filter(|((h, _), _)| !h.is_fixed()) {
            without.iter_mut().zip(slope).for_each(|(r, s)| *r += amplitude * s);
            let spread = h.spread(*amplitude);
            columns.push(slope.iter().map(|s| spread * s).collect());
        }
        (without, columns)
    }
}

/// Readings that a fit may use.
#[derive(Debug, Clone, Copy)]
pub struct FitData<'a> {
    /// Which, as positions among all readings.
    pub which: &'a [usize],
    /// These readings less what a finer mesh changes in their predictions, K.
    pub readings: &'a [f64],
    /// What it changes in all predictions, K.
    pub mesh: &'a [f64],
    /// Row and sensor of each.
    pub places: &'a [(usize, usize)],
    /// Their whitening.
    pub whitener: &'a Whitener,
    /// The discrepancy it is made with.
    pub level: DiscrepancySize,
    /// Logarithm of the determinant of the covariance without any discrepancy, K².
    pub without: f64,
}

/// A point of a fit.
struct Point {
    amplitudes: Vec<f64>,
    solved: Solved,
    origin: Origin,
    values: Vec<f64>,
    /// Readings less predictions, at the places they belong to, K.
    left: Vec<f64>,
    residual: Vec<f64>,
    cost: f64,
}

/// Slopes at a point, per unit of every amplitude: none where one is not free.
struct Slopes {
    /// Of the predictions, K, one column each.
    kelvin: Vec<Vec<f64>>,
    /// The same whitened.
    whitened: DMatrix<f64>,
    /// Of all predictions before the sensors' own errors, K.
    machine: MachineSlopes,
    /// Of the temperatures of all nodes.
    fields: Vec<Vec<Vec<f64>>>,
}

impl Slopes {
    /// All zero, in so many readings.
    fn none(amplitudes: &[f64], readings: usize) -> Self {
        let count = amplitudes.len();
        Self {
            kelvin: vec![vec![0.0; readings]; count],
            whitened: DMatrix::zeros(readings, count),
            machine: MachineSlopes { at: amplitudes.to_vec(), columns: vec![Vec::new(); count] },
            fields: vec![Vec::new(); count],
        }
    }
}

/// One column of them.
struct Slope {
    kelvin: Vec<f64>,
    machine: Vec<f64>,
    fields: Vec<Vec<f64>>,
}

/// An amplitude that is fitted: within what it can be.
fn bounded(h: &Hypothesis, amplitude: f64) -> f64 {
    if h.is_fixed() {
        return 1.0;
    }
    let (least, most) = h.range();
    amplitude.clamp(least, most)
}

/// The fit of one explanation.
///
/// The prior of what is added to the machine has tails like 1/a² ([`Hypothesis::has_tails`]): what is guessed to be larger than its prior's
/// scale is fitted under a normal prior of its own size, and pays for it in the evidence by the logarithm of how much larger it is.
struct Fit<'a> {
    predictor: &'a Predictor<'a>,
    members: &'a [&'a Hypothesis],
    /// Standard deviation of each amplitude's prior.
    scales: Vec<f64>,
    used: FitData<'a>,
    begun: Option<&'a Begun<'a>>,
}

impl<'a> Fit<'a> {
    fn new(
        predictor: &'a Predictor<'a>,
        members: &'a [&'a Hypothesis],
        guess: &[f64],
        used: FitData<'a>,
        begun: Option<&'a Begun<'a>>,
    ) -> Self {
        let scales = members.iter().zip(guess).map(|(h, a)| h.spread(*a)).collect();
        let at: Vec<f64> = members.iter().zip(guess).map(|(h, a)| bounded(h, *a)).collect();
        Self { predictor, members, scales, used, begun: begun.filter(|begun| begun.is_of(members, &at)) }
    }

    /// What it has come to.
    fn fitted(&self, here: Point, covariance: &DMatrix<f64>, slopes: Slopes) -> Fitted {
        let (members, used) = (self.members, &self.used);
        let misfit = sum_of_squares(&here.residual);
        let own = members.iter().zip(&self.scales).filter(|(h, _)| !h.is_fixed());
        let scale: f64 = own.map(|(h, s)| s.ln() + (s / h.scale).ln()).sum();
        let deviance = misfit + used.whitener.log_determinant() - used.without + used.level.price();
        let evidence = -0.5 * deviance - 0.5 * self.prior(&here.amplitudes) + 0.5 * covariance.determinant().max(1e-300).ln() - scale;
        let deviation = |j: usize| if members[j].is_fixed() { 0.0 } else { covariance[(j, j)].max(0.0).sqrt() };
        let deviations: Vec<f64> = (0..members.len()).map(deviation).collect();
        let correlation = |i: usize, j: usize| {
            let both = deviations[i] * deviations[j];
            if both > 0.0 { covariance[(i, j)] / both } else { 0.0 }
        };
        Fitted {
            correlations: (0..members.len()).map(|i| (0..members.len()).map(|j| correlation(i, j)).collect()).collect(),
            deviations,
            amplitudes: here.amplitudes,
            misfit,
            values: here.values,
            machine: here.solved.values,
            origin: here.origin,
            left: here.left,
            slopes: slopes.kelvin,
            machine_slopes: slopes.machine,
            evidence,
            deviance,
            level: used.level,
        }
    }

    fn with(&self, amplitudes: &[f64]) -> Vec<(&Hypothesis, f64)> {
        self.members.iter().copied().zip(amplitudes.iter().copied()).collect()
    }

    fn at(&self, amplitudes: Vec<f64>, near: &[Vec<f64>]) -> Result<Point> {
        let near = if near.is_empty() { self.predictor.fields } else { near };
        let solved = self.predictor.solve_near(&self.with(&amplitudes), near)?;
        Ok(self.seen(amplitudes, solved))
    }

    /// A point where the machine is solved already.
    fn seen(&self, amplitudes: Vec<f64>, solved: Solved) -> Point {
        // Sensors read what the machine comes to on a finer mesh.
        let finer = solved.values.iter().zip(self.used.mesh).map(|(v, m)| v + m).collect();
        let read = self.predictor.read(&self.with(&amplitudes), finer);
        let values: Vec<f64> = read.iter().zip(self.used.mesh).map(|(v, m)| v - m).collect();
        let apart: Vec<f64> = self.used.which.iter().zip(self.used.readings).map(|(i, r)| r - values[*i]).collect();
        let left = self.put_back(apart);
        let residual = self.used.whitener.apply(&left);
        let cost = sum_of_squares(&residual) + self.prior(&amplitudes);
        Point { origin: Origin::here(&amplitudes, &solved), amplitudes, solved, values, left, residual, cost }
    }

    /// What belongs to each place, where sensors are exchanged: the covariance is that of places.
    fn put_back(&self, apart: Vec<f64>) -> Vec<f64> {
        let relabelled = self.members.iter().rev().filter_map(|h| h.relabelled(self.used.places));
        relabelled.fold(apart, |apart, from| from.iter().map(|i| apart[*i]).collect())
    }

    fn prior(&self, amplitudes: &[f64]) -> f64 {
        amplitudes.iter().zip(self.members).zip(&self.scales).filter(|((_, h), _)| !h.is_fixed()).map(|((a, _), s)| (a / s).powi(2)).sum()
    }

    /// Takes the priors' spreads from where the fit has come to: a slope that falls with its amplitude guesses it too small.
    fn widen(&mut self, here: &mut Point) {
        for ((spread, h), amplitude) in self.scales.iter_mut().zip(self.members).zip(&here.amplitudes) {
            *spread = spread.max(h.spread(*amplitude));
        }
        here.cost = sum_of_squares(&here.residual) + self.prior(&here.amplitudes);
    }

    fn bounded(&self, j: usize, amplitude: f64) -> f64 {
        bounded(self.members[j], amplitude)
    }

    fn slopes(&self, here: &Point) -> Result<Slopes> {
        let (share, both) = self.predictor.steps();
        let begun = self.begun.filter(|begun| begun.amplitudes == here.amplitudes);
        let one = |j: usize| -> Result<Option<Slope>> {
            let h = self.members[j];
            if h.is_fixed() {
                return Ok(None);
            }
            let moved = |by: f64| -> Result<(Option<Point>, f64)> {
                let mut to = here.amplitudes.clone();
                to[j] = self.bounded(j, to[j] + by);
                let by = to[j] - here.amplitudes[j];
                Ok(match by {
                    0.0 => (None, by),
                    // The machine stays as it is.
                    _ if h.is_sensor() => (Some(self.seen(to, Solved { values: here.solved.values.clone(), fields: Vec::new() })), by),
                    _ => match begun.and_then(|b| if by > 0.0 { b.up[j].clone() } else { b.down[j].clone() }) {
                        Some(solved) => (Some(self.seen(to, solved)), by),
                        None => (Some(self.at(to, &here.solved.fields)?), by),
                    },
                })
            };
            // Where it cannot be more, less of it tells.
            let step = share * h.scale;
            let can_be_more = self.bounded(j, here.amplitudes[j] + step) > here.amplitudes[j] + 0.5 * step;
            let step = if can_be_more { step } else { -step };
            let (above, below) = rayon::join(|| moved(step), || if both { moved(-step) } else { Ok((None, 0.0)) });
            let ((above, up), (below, down)) = (above?, below?);
            let (Some(above), true) = (above, up != down) else { return Ok(None) };
            let below_left = below.as_ref().map_or(&here.left, |p| &p.left);
            let column = below_left.iter().zip(&above.left).map(|(b, a)| (b - a) / (up - down)).collect();
            let machine = below.as_ref().map_or(&here.solved.values, |p| &p.solved.values);
            let of_machine = || above.solved.values.iter().zip(machine).map(|(a, b)| (a - b) / (up - down)).collect();
            let of_field = |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(|(a, b)| (a - b) / up).collect();
            Ok(Some(Slope {
                kelvin: column,
                machine: if h.is_sensor() { Vec::new() } else { of_machine() },
                fields: above.solved.fields.iter().zip(&here.solved.fields).map(of_field).collect(),
            }))
        };
        let columns: Vec<_> = (0..self.members.len()).into_par_iter().map(one).collect::<Result<_>>()?;
        let mut slopes = Slopes::none(&here.amplitudes, here.left.len());
        for (j, found) in columns.into_iter().enumerate() {
            if let Some(Slope { kelvin, machine, fields }) = found {
                slopes.whitened.set_column(j, &DVector::from_vec(self.used.whitener.apply(&kelvin)));
                (slopes.kelvin[j], slopes.machine.columns[j], slopes.fields[j]) = (kelvin, machine, fields);
            }
        }
        Ok(slopes)
    }

    /// Temperatures of all nodes, K, as slopes continue them: where the next solve begins.
    fn continued(here: &Point, slopes: &Slopes, to: &[f64]) -> Vec<Vec<f64>> {
        let mut fields = here.solved.fields.clone();
        for (j, of_amplitude) in slopes.fields.iter().enumerate() {
            let by = to[j] - here.amplitudes[j];
            for (field, slope) in fields.iter_mut().zip(of_amplitude) {
                field.iter_mut().zip(slope).for_each(|(t, s)| *t += by * s);
            }
        }
        fields
    }

    /// Curvature with priors: its inverse is the covariance.
    fn covariance(&self, jacobian: &DMatrix<f64>) -> DMatrix<f64> {
        let mut matrix = jacobian.transpose() * jacobian;
        for (j, h) in self.members.iter().enumerate() {
            matrix[(j, j)] += if h.is_fixed() { 1.0 } else { self.scales[j].powi(-2) };
        }
        let k = matrix.nrows();
        matrix.try_inverse().unwrap_or_else(|| DMatrix::identity(k, k))
    }

    /// Half of minus the slope of the cost along every amplitude.
    fn downhill(&self, here: &Point, slopes: &Slopes) -> DVector<f64> {
        let mut right = slopes.whitened.transpose() * DVector::from_vec(here.residual.clone());
        for (j, h) in self.members.iter().enumerate() {
            right[j] = if h.is_fixed() { 0.0 } else { right[j] - here.amplitudes[j] / self.scales[j].powi(2) };
        }
        right
    }

    /// One step of Gauss and Newton's method, shortened until it leads down; `None` where none does or it is too small.
    fn step(&self, here: &Point, slopes: &Slopes, covariance: &DMatrix<f64>) -> Option<Point> {
        let step = covariance * self.downhill(here, slopes);
        if step.iter().enumerate().all(|(j, s)| s.abs() < SMALL * covariance[(j, j)].sqrt()) {
            return None;
        }
        let mut share = 1.0;
        for _ in 0..3 {
            let to: Vec<f64> = (0..step.len()).map(|j| self.bounded(j, here.amplitudes[j] + share * step[j])).collect();
            if to == here.amplitudes {
                return None;
            }
            if let Some(there) = self.straight(here, slopes, &to).filter(|there| there.cost <= here.cost) {
                return Some(there);
            }
            let near = Self::continued(here, slopes, &to);
            if let Ok(there) = self.at(to, &near)
                && there.cost <= here.cost
            {
                return Some(there);
            }
            share *= 0.4;
        }
        None
    }

    /// Where to begin: the guess, nearer to nothing where the machine cannot be solved with it.
    fn begin(&self, guess: &[f64]) -> Result<Point> {
        if let Some(begun) = self.begun {
            let here = self.seen(begun.amplitudes.clone(), begun.solved.clone());
            return Ok(Point { origin: begun.origin.clone(), ..here });
        }
        let mut at: Vec<f64> = guess.iter().enumerate().map(|(j, a)| self.bounded(j, *a)).collect();
        let near = self.predictor.fields;
        let mut here = self.at(at.clone(), near);
        for _ in 0..4 {
            if here.is_ok() {
                break;
            }
            at.iter_mut().for_each(|a| *a *= 0.5);
            here = self.at(at.iter().enumerate().map(|(j, a)| self.bounded(j, *a)).collect(), near);
        }
        let here = here?;
        if !self.predictor.fronts {
            return Ok(here);
        }
        // A front that is off by more than its width gives a slope that leads nowhere: the prior's scale may lie nearer.
        let sided = |(j, a): (usize, &f64)| self.bounded(j, if *a < 0.0 { -self.members[j].scale } else { self.members[j].scale });
        let far = self.at(here.amplitudes.iter().enumerate().map(sided).collect(), near);
        Ok(far.ok().filter(|far| far.cost < here.cost).unwrap_or(here))
    }
}

/// Fits amplitudes by Gauss and Newton's method from a first guess.
///
/// # Errors
/// As [`Predictor::predict`].
pub fn fit(predictor: &Predictor<'_>, members: &[&Hypothesis], guess: &[f64], used: FitData<'_>) -> Result<Fitted> {
    fit_begun(predictor, members, guess, used, None)
}

/// The same; where it begins as others did, what these solved is not solved again.
///
/// # Errors
/// As [`fit`].
pub(crate) fn fit_begun(
    predictor: &Predictor<'_>,
    members: &[&Hypothesis],
    guess: &[f64],
    used: FitData<'_>,
    begun: Option<&Begun<'_>>,
) -> Result<Fitted> {
    let mut fit = Fit::new(predictor, members, guess, used, begun);
    let mut here = fit.begin(guess)?;
    if predictor.has_slopes_of(members) {
        return Ok(fit.by_secants(here));
    }
    let (renewals, steps) = if predictor.fronts { (MOST_RENEWALS_OF_FRONTS, 1) } else { (MOST_RENEWALS, MOST_STEPS) };
    if let Some(slopes) = fit.begun.and_then(|begun| fit.of_the_fit_before(begun)) {
        fit.widen(&mut here);
        let covariance = fit.covariance(&slopes.whitened);
        match fit.within_reach(&here, &slopes, &covariance) {
            Some(there) => return Ok(fit.fitted(there, &covariance, slopes)),
            // Slopes are made from where the machine is solved.
            None => here = fit.at(here.amplitudes, &[])?,
        }
    }
    let mut covariance = DMatrix::identity(members.len(), members.len());
    let mut slopes = Slopes::none(&here.amplitudes, here.left.len());
    let renewed = if begun.is_some_and(Begun::has_steps) { RENEWED_OF_PARTS } else { RENEWED };
    for _ in 0..renewals {
        if here.origin.is_left() {
            here = fit.at(here.amplitudes, &here.solved.fields)?;
        }
        fit.widen(&mut here);
        slopes = fit.slopes(&here)?;
        covariance = fit.covariance(&slopes.whitened);
        let begun = (here.amplitudes.clone(), here.origin.amplitudes.clone());
        for _ in 0..steps {
            let Some(there) = fit.step(&here, &slopes, &covariance) else { break };
            here = there;
        }
        // Slopes, and with them the interval, are those of where the fit ended.
        let is_near = |(j, b): (usize, &f64)| (here.amplitudes[j] - b).abs() < renewed * covariance[(j, j)].sqrt();
        if here.origin.amplitudes == begun.1 || begun.0.iter().enumerate().all(is_near) {
            break;
        }
    }
    Ok(fit.fitted(here, &covariance, slopes))
}

/// The same from where another fit ended: under another covariance, or to bring it to rest.
///
/// # Errors
/// As [`fit`].
pub(crate) fn fit_again(predictor: &Predictor<'_>, members: &[&Hypothesis], before: &Fitted, used: FitData<'_>) -> Result<Fitted> {
    if predictor.fronts {
        return fit(predictor, members, &before.amplitudes, used);
    }
    let begun = Begun::ended(members, before);
    fit_begun(predictor, members, &before.amplitudes, used, Some(&begun))
}

/// The evidence that a fit of some readings can come to, as the slopes of its beginning promise it.
///
/// # Errors
/// As [`fit`].
pub(crate) fn promised(predictor: &Predictor<'_>, begun: &Begun<'_>, used: FitData<'_>) -> Result<f64> {
    let fit = Fit::new(predictor, &begun.members, &begun.amplitudes, used, Some(begun));
    let here = fit.begin(&begun.amplitudes)?;
    let slopes = if predictor.has_slopes_of(&begun.members) { fit.known_slopes(&here) } else { fit.slopes(&here)? };
    let covariance = fit.covariance(&slopes.whitened);
    let right = fit.downhill(&here, &slopes);
    let gained = 0.5 * right.dot(&(&covariance * &right));
    Ok(fit.fitted(here, &covariance, slopes).evidence + gained)
}

/// What a fit of one cause comes to where it begins, with the slope between nothing and there: of a cause that may be far behind
/// others. `None` where the cause is about readings alone.
pub(crate) fn first_look(predictor: &Predictor<'_>, begun: &Begun<'_>, used: FitData<'_>) -> Option<Fitted> {
    let [h] = begun.members[..] else { return None };
    let amplitude = begun.amplitudes[0];
    if h.is_sensor() || amplitude == 0.0 {
        return None;
    }
    let fit = Fit::new(predictor, &begun.members, &begun.amplitudes, used, Some(begun));
    let here = fit.seen(begun.amplitudes.clone(), begun.solved.clone());
    let nothing = fit.seen(vec![0.0], Solved { values: predictor.predicted.to_vec(), fields: Vec::new() });
    let column: Vec<f64> = nothing.left.iter().zip(&here.left).map(|(n, l)| (n - l) / amplitude).collect();
    let mut slopes = Slopes::none(&[amplitude], column.len());
    slopes.whitened.set_column(0, &DVector::from_vec(used.whitener.apply(&column)));
    slopes.kelvin[0] = column;
    let covariance = fit.covariance(&slopes.whitened);
    Some(fit.fitted(here, &covariance, slopes))
}
