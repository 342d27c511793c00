//! An identification as text and as JSON.

use std::path::Path;

use super::super::measured::{not_used, reading_rows};
use super::super::text::table;
use coldplate_base::numbers::significant;
use coldplate_evidence::faulty_readings::{self, Fault};
use coldplate_evidence::identify::{Advice, Estimate, IdentifyProblem, ParameterProfile};
use coldplate_evidence::record::{HeldOut, IdentifyRecord};

/// Estimated error of a sensor, in stated standard deviations, above which the sensor is named. Chosen: smaller ones
/// may be chance.
const TOLD: f64 = 2.0;
/// Ratio of a sensor's scatter to the stated noise above which the sensor is named, dimensionless. Chosen: smaller
/// ones may be chance.
const LOUD: f64 = 1.25;

/// Results of an identification, for a reader and for programs.
pub(super) struct IdentifyResults<'a> {
    pub(super) problem: &'a IdentifyProblem,
    pub(super) estimate: &'a Estimate,
    pub(super) profiles: &'a [ParameterProfile],
    pub(super) advice: &'a [Advice],
    pub(super) held_out: Option<HeldOut>,
    pub(super) faults: &'a [Fault],
    pub(super) path: Option<&'a Path>,
    pub(super) seconds: f64,
}

impl IdentifyResults<'_> {
    fn shown(&self, k: usize, value: f64) -> String {
        significant(self.problem.free[k].parameter.shown(value), 5)
    }

    pub(super) fn text(&self) -> String {
        let (problem, estimate) = (self.problem, self.estimate);
        let mut text = format!(
            "{}\n{} readings of {} sensors in {}\n\n",
            problem.study.model.machine.name,
            problem.data.count(),
            problem.data.sensors.len(),
            plural(problem.data.tests().len(), "test")
        );
        text += &faulty_readings::listed(self.faults);
        text += &self.parameters();
        text += &self.misfit();
        text += &self.undetermined();
        text += &self.readings();
        text += &self.advice();
        text += &match self.path {
            Some(path) => format!("\nwrote {}\n", path.display()),
            None => "\nno machine file was written: --out FILE writes the one with these values\n".to_string(),
        };
        text + &format!("{:.2} s, {} predictions\n", self.seconds, estimate.evaluations)
    }

    fn parameters(&self) -> String {
        let (problem, estimate) = (self.problem, self.estimate);
        let rows: Vec<Vec<String>> = (0..problem.free.len())
            .map(|k| {
                let p = &problem.free[k].parameter;
                let profile = self.profiles.iter().find(|f| f.parameter == k).map_or(String::new(), |f| {
                    let end = |v: Option<f64>| v.map_or("open".to_string(), |v| self.shown(k, v));
                    format!("{} to {}", end(f.interval.0), end(f.interval.1))
                });
                vec![
                    problem.free[k].name(),
                    self.shown(k, p.value),
                    self.shown(k, estimate.values[k]),
                    if p.unit == "1" { String::new() } else { p.unit.clone() },
                    format!("{} to {}", self.shown(k, estimate.intervals[k].0), self.shown(k, estimate.intervals[k].1)),
                    profile,
                    match (estimate.kept[k], estimate.at_bound[k]) {
                        _ if estimate.search_end.reason().is_some() => "not at rest".into(),
                        (true, _) => "not determined".into(),
                        _ if estimate.free[k].is_like_zero => "not told from zero".into(),
                        (false, true) => "at its bound".into(),
                        (false, false) => String::new(),
                    },
                ]
            })
            .collect();
        table(&["parameter", "before", "found", "unit", "95 % interval", "profile", ""], &rows)
    }

    fn misfit(&self) -> String {
        let estimate = self.estimate;
        let mut text = format!("\n  misfit {:.1} before, {:.1} after", estimate.misfit.0, estimate.misfit.1);
        text += &match estimate.freedom {
            0 => "; as many readings as parameters: nothing is left to judge the fit by\n".to_string(),
            n => format!(", {n} degrees of freedom; a misfit this large or larger has probability {:.3}\n", estimate.probability),
        };
        let mesh = estimate.mesh.largest();
        if mesh > 0.0 {
            let by = significant(mesh, 2);
            text += &format!("  predictions are continued to an endlessly fine mesh, which changes them by up to {by} K\n");
        }
        text += &self.columns();
        text += &self.search();
        text += &self.model_error();
        text
    }

    /// Heats that are columns of the table, with the uncertainty that these have.
    fn columns(&self) -> String {
        let (problem, estimate) = (self.problem, self.estimate);
        let own = problem.free.iter().zip(&estimate.free).filter(|(given, own)| given.prior.is_none() && own.prior.is_some());
        own.map(|(_, own)| {
            let share = own.prior.map_or(0.0, |(value, deviation)| 100.0 * deviation / value);
            format!("  {} is measured: it is found within the {} % that are stated of its column\n", own.name(), significant(share, 2))
        })
        .collect()
    }

    /// How the search ended, where that is not plain.
    fn search(&self) -> String {
        let mut text = String::new();
        if let Some(wider) = self.estimate.wider {
            text += &format!("  the stated errors do not explain this misfit: a wider search looked at {} further points; ", wider.points);
            text += &match wider.after < wider.before {
                true => format!("it lowered the misfit from {:.1} to {:.1}\n", wider.before, wider.after),
                false => "it found nothing better\n".to_string(),
            };
        }
        if let Some(reason) = self.estimate.search_end.reason() {
            text += &format!("  the search did not come to rest ({reason}): the values are the best so far, and nothing is said of\n");
            text += "  how well the data determine them; try other values with --set, bounds with --free KEY=LOW..HIGH, or more --starts\n";
        }
        text
    }

    /// Correlations, and what the data cannot determine.
    fn undetermined(&self) -> String {
        let (problem, estimate) = (self.problem, self.estimate);
        let mut text = String::new();
        if problem.free.len() > 1 {
            text += "\n  correlation\n";
            for i in 0..problem.free.len() {
                let row: Vec<String> = (0..=i).map(|j| format!("{:6.2}", estimate.correlation[(i, j)])).collect();
                text += &format!("    {}  {}\n", row.join(" "), problem.free[i].name());
            }
        }
        for k in (0..problem.free.len()).filter(|k| estimate.kept[*k]) {
            let p = &problem.free[k].parameter;
            let unit = if p.unit == "1" { String::new() } else { format!(" {}", p.unit) };
            text += &format!("\n  {} is not determined by these data: kept at {}{unit}\n", problem.free[k].name(), self.shown(k, p.value));
        }
        for open in &estimate.undetermined {
            let reach = if open.deviation.is_finite() {
                format!("standard deviation {} %", significant(100.0 * open.deviation, 2))
            } else {
                "no limit at all".into()
            };
            text += &format!("\n  these readings cannot determine {} ({reach})\n", open.text);
        }
        text
    }

    /// Readings beside predictions, those that were not used too.
    fn readings(&self) -> String {
        let (problem, estimate) = (self.problem, self.estimate);
        let rows = reading_rows(&problem.study.model.machine, &problem.data, &estimate.predictions.0, &estimate.predictions.1);
        let heading = ["test", "sensor", "measured degC", "before", "after", "difference K"];
        let mut text = format!("\n{}", table(&heading, &rows));
        if let Some(held_out) = &self.held_out {
            text += &not_used(held_out, &problem.study.model.machine);
        }
        text
    }

    /// The measurement that would tell most.
    fn advice(&self) -> String {
        let problem = self.problem;
        let mut text = String::new();
        if let Some(best) = self.advice.first() {
            text += &format!(
                "\nwhat would tell more: a steady test at {}, all {} sensors\n",
                best.condition.words(&self.problem.study.model.machine),
                best.sensors.len()
            );
            for (k, free) in problem.free.iter().enumerate() {
                text += &format!("  the interval of {} would shrink to {:.0} %\n", free.name(), 100.0 * best.shrink[k]);
            }
        }
        text
    }

    /// The model error in words: the part of the residuals that the stated errors do not explain.
    fn model_error(&self) -> String {
        let (data, estimate) = (&self.problem.data, self.estimate);
        let mut text = String::new();
        if let Some(m) = &estimate.model_error {
            let words = m.level.in_words(data.is_transient());
            text += &match words.is_empty() {
                true => "  the stated timing of the log explains what is left".to_string(),
                false => format!("  model error learnt from the readings: {words}"),
            };
            text += &format!("; misfit with it {:.1}, {} degrees of freedom, probability {:.3}\n", m.misfit, m.freedom, m.probability);
            text += "  intervals hold with it\n";
        }
        if estimate.widened > 1.0 {
            let factor = significant(estimate.widened, 3);
            text += &format!("  more is left than all of that explains: intervals are widened by a factor of {factor}\n");
        }
        for e in estimate.sensor_errors.iter().filter(|e| e.noise > LOUD * self.problem.uncertainty.noise[e.sensor]) {
            let [noise, stated] = [e.noise, self.problem.uncertainty.noise[e.sensor]].map(|k| significant(k, 2));
            text += &format!("  '{}' scatters by {noise} K from reading to reading; stated are {stated} K\n", data.names[e.sensor]);
        }
        for e in estimate.sensor_errors.iter().filter(|e| e.value.abs() > TOLD * e.stated) {
            let (name, value, stated) = (&data.names[e.sensor], significant(e.value.abs(), 2), significant(e.stated, 2));
            let way = if e.value > 0.0 { "high" } else { "low" };
            text += &format!("  the fit takes '{name}' to read {value} K too {way}; stated of it are {stated} K\n");
        }
        text
    }

    pub(super) fn record(&self) -> IdentifyRecord {
        let mut record = self.estimate.record(self.problem, self.profiles, self.advice, self.held_out.as_ref());
        record.machine = self.path.map(|path| path.display().to_string());
        record.seconds = self.seconds;
        record.faults = self.faults.iter().map(Fault::record).collect();
        record
    }
}

fn plural(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}
