//! Error of the mesh in the results of a sweep: how far each output may lie from its value on an endlessly fine mesh, at the conditions
//! that reach farthest.

use std::collections::BTreeMap;

use super::journal::ConditionOutcome;
use super::{Plan, Purpose, SweepSubject};
use coldplate_base::error::Result;
use coldplate_base::numbers::significant;
use coldplate_describe::machine::Condition;
use coldplate_solve::meshed::{MeshErrors, MeshedMachine};

/// Key of the provenance of a table: the largest error of the mesh in each output, in its unit, as half the width of a 95 % interval.
pub const MESH_ERRORS: &str = "mesh errors";
/// Conditions at which the error of the mesh is estimated, count. Chosen: each costs two solutions on coarser meshes, and errors grow
/// with the heat, whose extremes are few.
const ESTIMATED_AT: usize = 6;

/// Error up to which nobody asks for a finer mesh, K. Chosen: that of a usual temperature sensor.
const AIM: f64 = 0.1;
/// Most cells that are proposed, a count. Chosen: more fit into the memory of few hosts.
const MOST_CELLS: f64 = 1e8;

/// Function that remarks on the outcomes of the conditions of a plan.
pub(super) type Remark<'r> = dyn Fn(&Plan, &[ConditionOutcome]) -> Remarks + 'r;

/// Remarks on the outcomes of a sweep.
#[derive(Default)]
pub(super) struct Remarks {
    /// Pairs of the provenance of the table to be fitted.
    pub(super) provenance: Vec<(String, String)>,
    /// Doubts, one sentence each.
    pub(super) notes: Vec<String>,
}

/// Remarks on the error that the mesh of `model` leaves in the outcomes of a sweep: its place in the provenance, and a note if a usual
/// sensor would see it.
pub(super) fn remarks(model: &MeshedMachine, subject: &SweepSubject, plan: &Plan, outcomes: &[ConditionOutcome]) -> Remarks {
    match MeshLeft::of(model, plan, outcomes) {
        Ok(Some(left)) => {
            Remarks { provenance: vec![left.noted(&subject.outputs)], notes: left.sentence(model, &subject.outputs).into_iter().collect() }
        }
        Ok(None) => Remarks::default(),
        Err(error) => {
            let note = format!("the error of the mesh is not known, and no band holds it: a coarser mesh gives '{}'", error.what());
            Remarks { notes: vec![note], ..Remarks::default() }
        }
    }
}

/// Error of the mesh in every output of a sweep.
struct MeshLeft {
    /// Largest error at the conditions that reach farthest, in the outputs' units.
    errors: Vec<f64>,
    /// Orders of convergence that show in the errors; `None` if none is believed.
    orders: Vec<Option<f64>>,
}

impl MeshLeft {
    /// Errors at the conditions of `outcomes` that reach farthest; `None` if the mesh has no coarser ones.
    ///
    /// # Errors
    /// A coarser mesh cannot be solved.
    fn of(model: &MeshedMachine, plan: &Plan, outcomes: &[ConditionOutcome]) -> Result<Option<Self>> {
        let sensors = model.network.sensors.len();
        let chosen = |sensor: usize| model.chosen.as_ref().and_then(|chosen| chosen.sensors.get(sensor).copied().flatten());
        if let Some(errors) = (0..sensors).map(chosen).collect::<Option<Vec<f64>>>() {
            return Ok(Some(Self { errors, orders: vec![None; sensors] }));
        }
        let solved = farthest(plan, outcomes, sensors).into_iter();
        let solved = solved.map(|(row, readings)| (Condition::from_si(plan.conditions[row].clone()), readings.to_vec()));
        let found = model.mesh_errors_over(&solved.collect::<Vec<_>>())?;
        Ok(found.map(|MeshErrors { errors, orders, .. }| {
            let errors = errors.into_iter().enumerate().map(|(sensor, error)| chosen(sensor).unwrap_or(error));
            Self { errors: errors.collect(), orders }
        }))
    }

    /// The errors under the names of their outputs, as the provenance states them.
    fn noted(&self, outputs: &[(String, String)]) -> (String, String) {
        let named: BTreeMap<&str, f64> = outputs.iter().map(|(name, _)| name.as_str()).zip(self.errors.iter().copied()).collect();
        (MESH_ERRORS.into(), serde_json::to_string(&named).unwrap_or_default())
    }

    /// Largest error in a temperature, and the price of a smaller one; `None` if it is small enough.
    fn sentence(&self, model: &MeshedMachine, outputs: &[(String, String)]) -> Option<String> {
        let temperatures = outputs.iter().zip(self.errors.iter().zip(&self.orders)).filter(|((_, unit), _)| unit == "degC");
        let ((name, _), (error, _)) = temperatures.clone().max_by(|a, b| a.1.0.total_cmp(b.1.0)).filter(|own| *own.1.0 > AIM)?;
        // Cells grow with the third power of their number along an axis.
        let growth = |(_, (error, order)): (_, (&f64, &Option<f64>))| (error / AIM).powf(3.0 / order.unwrap_or(1.0));
        let times = temperatures.map(growth).fold(1.0, f64::max);
        let (left, cells) = (significant(*error, 2), model.mesh.cells);
        let everywhere = match times * cells as f64 {
            all if all <= MOST_CELLS => {
                let all = significant(all, 2).parse::<f64>().unwrap_or_default();
                format!("--cells {all} ({} times the cells), or ", significant(times, 2))
            }
            _ => String::new(),
        };
        Some(format!(
            "the mesh of {cells} cells leaves up to {left} K open, in '{name}': bands hold this error. For {AIM} K everywhere: \
             {everywhere}--set mesh.accuracy=\"{AIM} K\", which adds cells only where they matter"
        ))
    }
}

/// Rows to be fitted at which the most outputs have their lowest or highest value, and their outputs.
fn farthest<'o>(plan: &Plan, outcomes: &'o [ConditionOutcome], sensors: usize) -> Vec<(usize, &'o [f64])> {
    let is_fitted = |row: &usize| plan.group_of(*row).is_some_and(|group| group.purpose == Purpose::Fit);
    let solved: Vec<(usize, &[f64])> = (outcomes.iter().enumerate())
        .filter(|(row, _)| is_fitted(row))
        .filter_map(|(row, outcome)| if let ConditionOutcome::Values(values) = outcome { Some((row, &values[..sensors])) } else { None })
        .collect();
    let mut ends: BTreeMap<usize, usize> = BTreeMap::new();
    for sensor in 0..sensors {
        let by_value = |a: &&(usize, &[f64]), b: &&(usize, &[f64])| a.1[sensor].total_cmp(&b.1[sensor]);
        for (row, _) in [solved.iter().min_by(by_value), solved.iter().max_by(by_value)].into_iter().flatten() {
            *ends.entry(*row).or_default() += 1;
        }
    }
    let mut rows: Vec<(usize, usize)> = ends.into_iter().collect();
    rows.sort_by_key(|(row, count)| (std::cmp::Reverse(*count), *row));
    rows.truncate(ESTIMATED_AT);
    rows.into_iter().filter_map(|(row, _)| solved.iter().find(|own| own.0 == row).copied()).collect()
}
