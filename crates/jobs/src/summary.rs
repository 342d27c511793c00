//! Results of the main job, for whoever reports them.

use std::path::PathBuf;

use serde::Serialize;

use super::adaptive::Adaptation;
use super::answer::Answer;
use super::measured::{CheckedReading, CheckedState};
use coldplate_base::numbers::significant;
use coldplate_explore::sweep::{FailedCondition, ReducedRows};
use coldplate_surrogate::fit::one_factor::RESOLVED;

/// Name of the surrogate in the output folder.
pub const SURROGATE: &str = "surrogate.cps";
/// The held-out error aimed at, K. Chosen: drawn as a line in figures, it decides nothing.
pub const TARGET: f64 = 0.02;

/// Results of a job.
#[derive(Debug)]
pub struct Summary {
    /// The folder everything is in.
    pub folder: PathBuf,
    /// Conditions of the sweep, and how many of them came from the journal.
    pub conditions: (usize, usize),
    /// Conditions that failed, with the reason.
    pub failures: Vec<FailedCondition>,
    /// Number of conditions that a reduced model answered, if the sweep file asks for an accuracy of all rows.
    pub answered: Option<ReducedRows>,
    /// How the sweep came to the accuracy that the sweep file states, if it states one.
    pub adaptation: Option<Adaptation>,
    /// How far one variable may go, if the machine has limits.
    pub answer: Option<Answer>,
    /// How well the machine is known: its measured readings beside their predictions, if there are any.
    pub known: Option<MachineKnown>,
    /// One per measurement point of the surrogate; empty for sweeps of one factor at a time.
    pub points: Vec<PointSummary>,
    /// Formulas of the one-factor sweeps.
    pub formulas: Vec<PrintedFormula>,
    /// Remarks of the fit.
    pub notes: Vec<String>,
    /// Files written, the report first.
    pub files: Vec<PathBuf>,
    /// Seconds: sweep, fit, figures and report.
    pub seconds: [f64; 3],
}

/// Measured readings beside their predictions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MachineKnown {
    /// Readings that lie inside the band of their prediction, with their own uncertainty.
    pub inside: usize,
    /// All readings.
    pub readings: usize,
    /// State and sensor of the reading that lies farthest off.
    pub worst: String,
    /// Distance of this reading from its prediction, K.
    #[serde(rename = "worst_K")]
    pub distance: f64,
}

impl MachineKnown {
    /// Counts the readings of some states; `None` without a reading.
    pub(crate) fn of(checked: &[CheckedState]) -> Option<Self> {
        let all = || checked.iter().flat_map(|state| state.rows.iter().map(move |row| (state, row)));
        let off = |row: &CheckedReading| (row.predicted - row.measured).abs();
        let (state, row) = all().max_by(|a, b| off(a.1).total_cmp(&off(b.1)))?;
        let inside = all().filter(|(_, row)| row.is_inside()).count();
        Some(Self { inside, readings: all().count(), worst: format!("{}, {}", row.name, state.name), distance: off(row) })
    }

    /// The count in a sentence.
    pub fn sentence(&self) -> String {
        let Self { inside, readings, worst, distance } = self;
        format!(
            "{inside} of {readings} measured readings lie inside the band of their prediction; the worst is {} K off ({worst})",
            significant(*distance, 2)
        )
    }
}

/// How well one measurement point is predicted.
#[derive(Debug, Clone)]
pub struct PointSummary {
    /// Name.
    pub name: String,
    /// The model in a few words.
    pub model: String,
    /// Unit of the point's errors: K for a temperature.
    pub unit: String,
    /// Root mean square of the leave-one-out errors.
    pub leave_one_out: f64,
    /// Root mean square of the k-fold errors of the whole procedure.
    pub k_fold: Option<f64>,
    /// Half width of the band.
    pub half_width: f64,
    /// Half width of the error of the mesh, if it is known.
    pub mesh: Option<f64>,
    /// On held-out conditions: largest error, root mean square error, share inside the band.
    pub held_out: Option<(f64, f64, f64)>,
}

impl Summary {
    /// The unit of the errors of all points, if it is the same for all.
    pub fn unit_of_errors(&self) -> Option<&str> {
        let first = self.points.first()?.unit.as_str();
        self.points.iter().all(|p| p.unit == first).then_some(first)
    }

    /// The largest error of a temperature on held-out conditions, K.
    pub fn worst_held_out(&self) -> Option<f64> {
        self.points.iter().filter(|p| p.unit == "K").filter_map(|p| p.held_out).map(|h| h.0).reduce(f64::max)
    }
}

/// A fit in one variable, as the paper prints it.
#[derive(Debug, Clone)]
pub struct PrintedFormula {
    /// Name of the one-factor sweep.
    pub group: String,
    /// The variable, with its unit.
    pub variable: String,
    /// Name of the measurement point.
    pub point: String,
    /// The formula.
    pub text: String,
    /// Share of the variance explained.
    pub r_squared: f64,
    /// Root mean square of the residuals, K.
    pub rms: f64,
}

impl PrintedFormula {
    /// The share of the variance that is explained; none for a constant, whose variance is rounding.
    pub fn r_squared_in_words(&self) -> Option<String> {
        self.text.contains('x').then(|| format!("{:.5}", self.r_squared))
    }

    /// The residuals, as finely as the formula is printed.
    pub fn rms_in_words(&self) -> String {
        if self.rms < RESOLVED { format!("< {RESOLVED}") } else { significant(self.rms, 2) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_has_no_digits_of_rounding() {
        let formula = |text: &str, r_squared: f64, rms: f64| PrintedFormula {
            group: "table 9".into(),
            variable: "motor_speed [rpm]".into(),
            point: "plate".into(),
            text: text.into(),
            r_squared,
            rms,
        };
        let constant = formula("y = 20.009", 0.896_04, 2.5e-14);
        assert_eq!((constant.r_squared_in_words(), constant.rms_in_words()), (None, "< 0.001".to_string()));
        let line = formula("y = 0.00607 x + 20.096", 0.999_991, 0.0123);
        assert_eq!((line.r_squared_in_words().as_deref(), line.rms_in_words().as_str()), (Some("0.99999"), "0.012"));
    }
}
