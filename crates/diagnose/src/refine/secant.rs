//! Fits where a prediction is a run of seconds: no run is spent on slopes alone.
//!
//! Slopes begin as those of the screen, about the machine as it is, and every run mends them along the step that it made (Broyden 1965,
//! Math. Comp. 19, 577), in amplitudes over their priors' scales; the first such step is the one from nothing to where the fit begins.
//! Slopes of sensors' own errors are exact, and cost no run.

use nalgebra::DVector;

use super::{Fit, Fitted, Point, SMALL, Slopes, Solved};
use coldplate_base::numbers::sum_of_squares;

/// Runs at most.
const MOST_RUNS: usize = 7;
/// What a step is shortened by where the machine cannot be solved at its end.
const SHORTER: f64 = 0.4;
/// Runs end where one lowers the cost by less than this: chi-square and priors together.
const HARDLY: f64 = 0.02;

impl Fit<'_> {
    /// The fit from a point on.
    pub(super) fn by_secants(&self, begun: Point) -> Fitted {
        let mut slopes = self.known_slopes(&begun);
        let mut here = begun;
        let mut share = 1.0;
        for _ in 0..MOST_RUNS {
            let covariance = self.covariance(&slopes.whitened);
            let step = &covariance * self.downhill(&here, &slopes);
            if step.iter().enumerate().all(|(j, s)| s.abs() < SMALL * covariance[(j, j)].sqrt()) {
                break;
            }
            let to: Vec<f64> = (0..step.len()).map(|j| self.bounded(j, here.amplitudes[j] + share * step[j])).collect();
            if to == here.amplitudes {
                break;
            }
            let Ok(there) = self.at(to, &[]) else {
                share *= SHORTER;
                continue;
            };
            share = 1.0;
            self.mend(&mut slopes, &here, &there);
            let gained = here.cost - there.cost;
            if gained >= 0.0 {
                here = there;
                self.follow_sensors(&mut slopes, &here);
            }
            self.whiten(&mut slopes);
            if gained.abs() < HARDLY {
                break;
            }
        }
        let covariance = self.covariance(&slopes.whitened);
        self.fitted(here, &covariance, slopes)
    }

    /// Slopes at a point as the screen has them, mended along the way from nothing; or those of a fit that ended there.
    pub(super) fn known_slopes(&self, here: &Point) -> Slopes {
        let count = self.members.len();
        let known = self
            .begun
            .filter(|begun| begun.amplitudes == here.amplitudes)
            .and_then(|begun| begun.slopes.as_ref())
            .map(|(kelvin, _)| kelvin);
        let of_screen = |j: usize| -> Vec<f64> {
            let column = self.predictor.slopes.of(self.members[j]);
            self.used.which.iter().map(|i| column.map_or(0.0, |column| column[*i])).collect()
        };
        let ended = known.filter(|slopes| slopes.iter().all(|column| column.len() == here.left.len()));
        let kelvin = ended.map_or_else(|| (0..count).map(of_screen).collect(), Clone::clone);
        let mut slopes = Slopes { kelvin, ..Slopes::none(&here.amplitudes, here.left.len()) };
        self.follow_sensors(&mut slopes, here);
        if ended.is_none() {
            let nothing = self.seen(vec![0.0; count], Solved { values: self.predictor.predicted.to_vec(), fields: Vec::new() });
            self.mend(&mut slopes, &nothing, here);
        }
        self.whiten(&mut slopes);
        slopes
    }

    /// Slopes of sensors' own errors at a point.
    fn follow_sensors(&self, slopes: &mut Slopes, here: &Point) {
        let (share, _) = self.predictor.steps();
        for (j, h) in self.members.iter().enumerate().filter(|(_, h)| h.is_sensor()) {
            let mut to = here.amplitudes.clone();
            to[j] = self.bounded(j, to[j] + share * h.scale);
            if to[j] == here.amplitudes[j] {
                to[j] = self.bounded(j, to[j] - share * h.scale);
            }
            let by = to[j] - here.amplitudes[j];
            if by != 0.0 {
                let there = self.seen(to, Solved { values: here.solved.values.clone(), fields: Vec::new() });
                slopes.kelvin[j] = here.left.iter().zip(&there.left).map(|(b, a)| (b - a) / by).collect();
            }
        }
    }

    /// Makes slopes agree with what a step changed, by the least change of them.
    fn mend(&self, slopes: &mut Slopes, from: &Point, to: &Point) {
        let scaled = |j: usize| if self.members[j].is_sensor() { 0.0 } else { (to.amplitudes[j] - from.amplitudes[j]) / self.scales[j] };
        let along: Vec<f64> = (0..self.members.len()).map(scaled).collect();
        let length = sum_of_squares(&along);
        if length == 0.0 {
            return;
        }
        let mut missing: Vec<f64> = from.left.iter().zip(&to.left).map(|(f, t)| f - t).collect();
        for (j, column) in slopes.kelvin.iter().enumerate() {
            let by = to.amplitudes[j] - from.amplitudes[j];
            missing.iter_mut().zip(column).for_each(|(m, c)| *m -= by * c);
        }
        for (j, column) in slopes.kelvin.iter_mut().enumerate() {
            let share = along[j] / (length * self.scales[j]);
            column.iter_mut().zip(&missing).for_each(|(c, m)| *c += share * m);
        }
    }

    fn whiten(&self, slopes: &mut Slopes) {
        for (j, column) in slopes.kelvin.iter().enumerate() {
            slopes.whitened.set_column(j, &DVector::from_vec(self.used.whitener.apply(column)));
        }
    }
}
