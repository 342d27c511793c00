//! Steps of a fit that are so short that slopes say where they lead: the machine is not solved at their end.

use nalgebra::{DMatrix, DVector};

use super::{Begun, Fit, Point, Slopes, Solved};

/// How far slopes may be off where a step ends, in standard deviations of all readings together, beside where the machine was last solved.
const STRAIGHT: f64 = 0.03;
/// No amplitude moves by more than this share of its prior's spread: slopes of what does nothing there, a surface that is black already,
/// say nothing of elsewhere.
const NEAR: f64 = 0.2;
/// Share by which a change of one kelvin bends: radiation, films and properties, 1/K.
const BEND: f64 = 0.01;

/// Where the machine was last solved, and how far slopes may be off since.
#[derive(Debug, Clone, PartialEq)]
pub struct Origin {
    /// Amplitudes.
    pub amplitudes: Vec<f64>,
    /// Predictions before the sensors' own errors, K.
    pub machine: Vec<f64>,
    /// In standard deviations.
    departure: f64,
}

/// Slopes of all predictions before the sensors' own errors, per unit of each amplitude.
#[derive(Debug, Clone, PartialEq)]
pub struct MachineSlopes {
    /// The amplitudes that they were made at.
    pub at: Vec<f64>,
    /// One column for each amplitude, K per unit: none of sensors, and where they are not known.
    pub columns: Vec<Vec<f64>>,
}

impl Origin {
    /// Where it is solved.
    pub(super) fn here(amplitudes: &[f64], solved: &Solved) -> Self {
        Self { amplitudes: amplitudes.to_vec(), machine: solved.values.clone(), departure: 0.0 }
    }

    /// Whether slopes were followed since.
    pub(super) fn is_left(&self) -> bool {
        self.departure > 0.0
    }
}

impl Fit<'_> {
    /// The point that slopes lead to, where they do so for certain: of tables, and where amplitudes differ from those that slopes were made
    /// at by too little to bend ([`super::Hypothesis::bend`]).
    pub(super) fn straight(&self, here: &Point, slopes: &Slopes, to: &[f64]) -> Option<Point> {
        if self.predictor.data.is_transient() {
            return None;
        }
        let mut departure = here.origin.departure;
        let mut values = here.solved.values.clone();
        for (j, h) in self.members.iter().enumerate().filter(|(_, h)| !h.is_sensor()) {
            let by = to[j] - here.amplitudes[j];
            if by == 0.0 {
                continue;
            }
            let machine = &slopes.machine.columns[j];
            if machine.is_empty() || by.abs() > NEAR * self.scales[j] {
                return None;
            }
            let most = machine.iter().fold(0.0, |m: f64, s| m.max((by * s).abs()));
            departure += (h.bend(to[j] - slopes.machine.at[j]) + BEND * most) * by.abs() * slopes.whitened.column(j).norm();
            values.iter_mut().zip(machine).for_each(|(v, s)| *v += by * s);
        }
        if departure > STRAIGHT {
            return None;
        }
        let point = self.seen(to.to_vec(), Solved { values, fields: Self::continued(here, slopes, to) });
        Some(Point { origin: Origin { departure, ..here.origin.clone() }, ..point })
    }

    /// Slopes of the fit that ended where this one begins, of the same readings; `None` of logs.
    pub(super) fn of_the_fit_before(&self, begun: &Begun<'_>) -> Option<Slopes> {
        let (kelvin, machine) = begun.slopes.clone()?;
        let readings = self.used.which.len();
        if self.predictor.data.is_transient() || kelvin.iter().any(|column| column.len() != readings) {
            return None;
        }
        let mut whitened = DMatrix::zeros(readings, kelvin.len());
        for (j, column) in kelvin.iter().enumerate() {
            whitened.set_column(j, &DVector::from_vec(self.used.whitener.apply(column)));
        }
        Some(Slopes { kelvin, whitened, machine, fields: vec![Vec::new(); self.members.len()] })
    }

    /// Where one step leads from here, where that is near enough for the slopes of here.
    pub(super) fn within_reach(&self, here: &Point, slopes: &Slopes, covariance: &DMatrix<f64>) -> Option<Point> {
        let step = covariance * self.downhill(here, slopes);
        let to: Vec<f64> = (0..step.len()).map(|j| self.bounded(j, here.amplitudes[j] + step[j])).collect();
        self.straight(here, slopes, &to).filter(|there| there.cost <= here.cost)
    }
}
