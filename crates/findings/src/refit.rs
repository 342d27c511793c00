//! Surrogates of the machine as it is and of the extended one, held against the readings.

use std::path::{Path, PathBuf};

use coldplate_runtime::Variable;

use super::extended::ExtendedMachine;
use coldplate_base::document::Document;
use coldplate_base::error::{Error, Result};
use coldplate_base::progress::Progress;
use coldplate_diagnose::Problem;
use coldplate_evidence::measurement::Data;
use coldplate_jobs::refit::{Refit, refit};
use coldplate_solve::study::Study;
use coldplate_surrogate::fit::file;
use coldplate_surrogate::verdict::{self, condition};

/// Result of `--surrogate`.
#[derive(Debug)]
pub struct Refitted {
    /// The surrogate of the extended machine, if there is one.
    pub fit: Option<RefittedSurrogate>,
}

/// A surrogate of the extended machine beside one of the machine as it was.
#[derive(Debug)]
pub struct RefittedSurrogate {
    /// Path of the file.
    pub path: PathBuf,
    /// Bytes of the file.
    pub bytes: Vec<u8>,
    /// Conditions it was fitted to.
    pub conditions: usize,
    /// Conditions that could not be solved.
    pub failed: usize,
    /// Largest error on conditions it was not fitted to, against the solver, K.
    pub largest: Option<f64>,
    /// Both surrogates against the readings; `None` for logs, and where no reading lies in the fitted ranges.
    pub readings: Option<AgainstReadings>,
}

/// Two surrogates against the readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AgainstReadings {
    /// Root mean square error of the surrogate of the machine as it was, K.
    pub before: f64,
    /// Root mean square error of the surrogate of the extended machine, K.
    pub after: f64,
    /// Readings that were compared.
    pub counted: usize,
    /// Readings left out, since their condition lies outside the ranges of the surrogate.
    pub outside: usize,
}

impl RefittedSurrogate {
    /// Errors of the surrogate, in a sentence or two.
    pub fn words(&self) -> String {
        let against = match self.readings {
            Some(AgainstReadings { before, after, counted, outside: left }) => {
                let outside = if left > 0 { format!("; {left} lie outside the fitted ranges") } else { String::new() };
                format!(
                    "surrogate against {counted} readings: error {before:.3} K of the machine as it is, {after:.3} K of the extended one{outside}"
                )
            }
            None => "surrogate not held against readings: they are logs, or lie outside the fitted ranges".into(),
        };
        let own = self.largest.map_or(String::new(), |k| format!("; against the solver at most {k:.4} K on conditions kept out"));
        let failed = if self.failed > 0 { format!(", {} could not be solved", self.failed) } else { String::new() };
        format!("{against}{own}; {} conditions{failed}", self.conditions)
    }
}

impl Refitted {
    /// Fits both surrogates; none if no extended machine is written.
    ///
    /// # Errors
    /// Errors of [`refit`].
    pub fn of(problem: &Problem, extended: Option<&ExtendedMachine>, path: &Path, progress: &dyn Progress) -> Result<Self> {
        let Some(extended) = extended else { return Ok(Self { fit: None }) };
        let folder = Scratch::beside(path)?;
        let cells = problem.study.model.mesh.cells;
        let fit = |document: &Document, what: &str| -> Result<Refit> {
            progress.say(&format!("surrogate of {what}"));
            refit(document, cells, what, &folder.0.join(what.replace(' ', "_")), progress)
        };
        let document = Document::parse(&extended.text, &extended.path)?;
        let before = fit(problem.study.document(), "the machine as it is")?;
        let after = fit(&document, "the extended machine")?;
        after.notes.iter().for_each(|note| progress.say(note));
        let errors = |bytes: &[u8]| errors(bytes, &problem.study, &problem.data);
        let readings = match (errors(&before.bytes)?, errors(&after.bytes)?) {
            (Some((before, ..)), Some((after, counted, outside))) => Some(AgainstReadings { before, after, counted, outside }),
            _ => None,
        };
        Ok(Self {
            fit: Some(RefittedSurrogate {
                path: path.to_path_buf(),
                bytes: after.bytes,
                conditions: after.conditions,
                failed: after.failed,
                largest: after.largest,
                readings,
            }),
        })
    }
}

/// Root mean square of surrogate less reading (K), number of readings, and number of readings left out because their
/// condition lies outside the ranges of the surrogate.
fn errors(bytes: &[u8], study: &Study, data: &Data) -> Result<Option<(f64, usize, usize)>> {
    if data.is_transient() {
        return Ok(None);
    }
    let surrogate = file::open(bytes)?;
    let machine = &study.model.machine;
    let (mut sum, mut counted, mut left) = (0.0, 0, 0);
    for row in &data.rows {
        // Held variables too: the design must have held them at the measured values.
        let at = |variable: &Variable<'_>| -> Result<f64> {
            let own = machine.variables.iter().zip(row.condition.si()).find(|(own, _)| own.name == variable.name);
            own.map_or(Ok(variable.low), |(own, si)| condition::of_si(variable, *si, own.dimension))
        };
        let x = condition::variables(&surrogate).iter().map(at).collect::<Result<Vec<_>>>()?;
        let answer = verdict::query(&surrogate, &x)?;
        for (k, (reading, name)) in row.readings.iter().zip(&data.names).enumerate() {
            let (Some(reading), Some(point)) = (reading, answer.temperatures.iter().find(|t| t.name == *name)) else { continue };
            if answer.in_domain {
                sum += (point.value - data.shown(machine, k, *reading)).powi(2);
                counted += 1;
            } else {
                left += 1;
            }
        }
    }
    Ok((counted > 0).then(|| ((sum / counted as f64).sqrt(), counted, left)))
}

/// A folder for the journals of the designs, removed in the end.
struct Scratch(PathBuf);

impl Scratch {
    fn beside(path: &Path) -> Result<Self> {
        let name = path.file_name().map_or_else(|| "surrogate".into(), |n| n.to_string_lossy().into_owned());
        let folder = path.with_file_name(format!(".{}.{name}.design", std::process::id()));
        std::fs::create_dir_all(&folder).map_err(|e| Error::file("make", &folder, e).at_key("--surrogate"))?;
        Ok(Self(folder))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // A folder that cannot be removed is hidden and small.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
