//! Causes in force, each with an amplitude of its own in every row: a variable of the machine file holds the course of each, and the data have
//! its values.

use crate::effects::{Hypothesis, Law, LawForm, Scales};
use crate::predictor::{Predictor, in_order};
use crate::when::Added;
use coldplate_describe::machine::{DescribedVariable, Machine};
use coldplate_evidence::measurement::Data;
use coldplate_solve::study::Study;

/// Step of the mean amplitude by which slopes along a course are scaled, as a share of the kind's scale.
pub const STEP: f64 = 0.1;
/// Name of the variable that is the course of a member.
const COURSE: &str = "diagnosed_course_";

/// A cause with its amplitude in every row, in its unit.
pub struct Acting<'a> {
    /// The cause.
    pub hypothesis: &'a Hypothesis,
    /// Amplitude in every row of the data.
    pub values: Vec<f64>,
    /// Whether they stay until the next row of a log instead of running straight to it.
    pub is_held: bool,
}

/// A machine in which causes follow variables that its data have.
#[derive(Debug, Clone)]
pub struct Courses {
    /// The machine.
    pub study: Study,
    /// Each cause under the law by which it is in force, with its amplitude.
    pub laws: Vec<(Hypothesis, f64)>,
}

impl Courses {
    /// The machine with some causes, of which those that have no words for a course have their first value throughout; `None` where the machine file
    /// has no words for one.
    pub fn new(predictor: &Predictor<'_>, (study, data): (&Study, &Data), members: &[Acting<'_>]) -> Option<Self> {
        let added = added(members);
        let lines = Added::lines(&added, study.document()).ok()?;
        let mut own = study.edited(&lines).ok()?;
        let variables = own.model.machine.variables.clone();
        let data = Added::fill(data.clone(), &study.model.machine.variables, &variables, &added);
        let scales = Scales::of(&data, &own.model.machine);
        let mut laws = Vec::new();
        for (k, Acting { hypothesis: h, values, .. }) in members.iter().enumerate() {
            let at = variables.iter().position(|v| v.name == name(k))?;
            let (law, amplitude) =
                if runs(predictor, h) { (h.by_course(Law::Of(at, LawForm::Course)), 1.0) } else { ((*h).clone(), values[0]) };
            let lines = law.sets(&own, &scales, predictor.user, amplitude).ok()??;
            if !lines.is_empty() {
                own = own.edited(&lines).ok()?;
            }
            laws.push((law, amplitude));
        }
        Some(Self { study: own, laws })
    }

    /// Data of the machine without these causes, with their courses.
    pub fn data(&self, given: &[DescribedVariable], data: &Data, members: &[Acting<'_>]) -> Data {
        Added::fill(data.clone(), given, &self.study.model.machine.variables, &added(members))
    }
}

fn name(member: usize) -> String {
    format!("{COURSE}{member}")
}

fn added(members: &[Acting<'_>]) -> Vec<Added> {
    let of = |(k, own): (usize, &Acting<'_>)| Added {
        name: name(k),
        declared: "{ unit = \"1\", default = \"0\" }",
        values: own.values.clone(),
        is_held: own.is_held,
    };
    members.iter().enumerate().map(of).collect()
}

/// Whether the amplitude of a cause may run over the rows: whether the machine file, or what shows its readings, has words for that. A cause
/// that changes with the temperature of its place has a law already.
pub fn runs(predictor: &Predictor<'_>, h: &Hypothesis) -> bool {
    if h.law != h.effect.usual_law() {
        return false;
    }
    let law = h.by_course(Law::Of(0, LawForm::Course));
    let (study, scales) = (predictor.study, predictor.scales);
    let lines = |h: &Hypothesis| h.sets(study, scales, predictor.user, STEP * h.scale).ok().flatten();
    h.reads_course() || lines(&law).is_some_and(|by_course| Some(by_course) != lines(h))
}

/// What a machine's sensors show of predictions (K) with causes in force, and with a little more of one of them or of another.
pub fn shown(
    (scales, machine, data): (&Scales, &Machine, &Data),
    values: &[f64],
    laws: &[(Hypothesis, f64)],
    more: Option<(usize, &Hypothesis, f64)>,
) -> Vec<f64> {
    let mut sensors: Vec<(&Hypothesis, f64)> = laws.iter().map(|(h, a)| (h, *a)).collect();
    if let Some((k, h, step)) = more {
        // A lag in force grows; it is not followed by another.
        match sensors.get_mut(k).filter(|(own, _)| own.law == h.law) {
            Some((_, amplitude)) => *amplitude += step,
            None => sensors.push((h, step)),
        }
    }
    sensors.retain(|(h, _)| h.is_sensor());
    in_order(&sensors).fold(values.to_vec(), |values, (h, amplitude)| h.read((scales, machine), data, &values, amplitude))
}
