//! Readings of a machine on trial meshes.

use std::f64::consts::TAU;

use rayon::prelude::*;

use crate::meshed::{MeshedMachine, budget, limit_states};
use coldplate_base::error::{Error, Result};
use coldplate_base::units::Measurand;
use coldplate_describe::machine::{BlockShape, Condition, Machine, PartBlock, SensorReading};
use coldplate_network::Load;
use coldplate_network::mesh::Mesh;

/// Orders of convergence that are believed, dimensionless: from first order, which is chosen, to second, the order of the scheme.
const ORDERS: (f64, f64) = (1.0, 2.0);

/// Cells of every block along its three axes, in the order of parts and blocks.
pub(super) type Counts = Vec<[usize; 3]>;

/// An axis of a block whose cells the file leaves open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct CellLine {
    /// Index of the block, in the order of parts and blocks.
    pub block: usize,
    /// Axis of the block.
    pub axis: usize,
    /// The fewest cells that make sense: a whole turn needs some to be one.
    pub least: usize,
}

/// A machine at the conditions at which its readings count.
pub(super) struct Trials<'a> {
    machine: Machine,
    conditions: &'a [Condition],
    /// Error that the mesh may leave, K.
    pub accuracy: f64,
    /// The axes whose cells are to be chosen.
    pub lines: Vec<CellLine>,
    /// For each part (index): the lines whose cells the file states; parts without such lines are left out.
    pub stated: Vec<(usize, Vec<CellLine>)>,
    /// Whether each sensor, then each limit, is a temperature or a difference of temperatures.
    wanted: Vec<bool>,
}

/// Error of a mesh as a whole. Entries are those of [`Trials::values`].
#[derive(Debug, Clone)]
pub(super) struct Whole {
    /// Readings, K.
    pub own: Vec<f64>,
    /// Error of the readings, over the accuracy.
    pub open: Vec<f64>,
}

impl Whole {
    /// Entry with the largest error, and this error over the accuracy.
    pub(super) fn largest(&self) -> (usize, f64) {
        self.open.iter().enumerate().fold((0, 0.0), |most: (usize, f64), (i, open)| if *open > most.1 { (i, *open) } else { most })
    }
}

impl<'a> Trials<'a> {
    /// # Errors
    /// The accuracy is not above zero, or the machine has imported parts.
    pub(super) fn new(machine: &Machine, conditions: &'a [Condition], accuracy: f64) -> Result<Self> {
        if accuracy.is_nan() || accuracy <= 0.0 {
            return Err(Error::input("an accuracy is above zero").at_key("accuracy").read(accuracy).help("write for example \"0.05 K\""));
        }
        if let Some(part) = machine.parts.iter().find(|p| p.import.is_some()) {
            return Err(Error::input(format!("'{}' brings its own elements, which cannot be chosen", part.name))
                .at_key("accuracy")
                .help("leave the accuracy out, and refine the imported mesh where it was made"));
        }
        let mut machine = machine.clone();
        let is_temperature = |sensor: usize| machine.sensors[sensor].measurand() == Measurand::Temperature;
        let sensors = (0..machine.sensors.len()).map(is_temperature);
        let wanted = sensors.chain(machine.limits.iter().map(|l| l.kind.points().all(is_temperature))).collect();
        // Displacements are not wanted, and cost a solution of the elastic structure on every mesh.
        for sensor in machine.sensors.iter_mut().filter(|s| s.reads.is_displacement()) {
            sensor.reads = SensorReading::PartMean(0);
        }
        machine.enclosures.iter_mut().for_each(|e| e.cache = None);
        let mut lines = Vec::new();
        let mut stated: Vec<(usize, Vec<CellLine>)> = Vec::new();
        let blocks = machine.parts.iter().enumerate().flat_map(|(p, part)| part.blocks.iter().map(move |own| (p, own)));
        for (block, (part, own)) in blocks.enumerate() {
            let (kept, open): (Vec<CellLine>, Vec<CellLine>) = lines_of(block, own).partition(|line| own.cells[line.axis].is_some());
            lines.extend(open);
            match stated.last_mut().filter(|last| last.0 == part) {
                Some((_, more)) => more.extend(kept),
                None if !kept.is_empty() => stated.push((part, kept)),
                None => {}
            }
        }
        Ok(Self { machine, conditions, accuracy, lines, stated, wanted })
    }

    /// Number of blocks.
    pub(super) fn blocks(&self) -> usize {
        self.machine.parts.iter().map(|p| p.blocks.len()).sum()
    }

    /// Readings (K) of every sensor and values of every limit (K) at conditions `at`, one after the other, on a mesh; zero where
    /// they are no temperatures.
    ///
    /// # Errors
    /// The mesh does not fit into memory, or the machine cannot be solved on it.
    pub(super) fn values(&self, counts: &Counts, at: &[usize]) -> Result<Vec<f64>> {
        budget::check(cells(counts))?;
        let mesh = Mesh::with_divisions(&self.machine, counts, 1.0)?;
        let model = MeshedMachine::on(self.machine.clone(), mesh)?;
        let first = at.first().ok_or_else(|| Error::input("cells cannot be chosen without a condition"))?;
        let solver = model.solver(&self.conditions[*first])?;
        let mut values = Vec::with_capacity(at.len() * self.wanted.len());
        for condition in at.iter().map(|c| &self.conditions[*c]) {
            let load = Load::at(&model.machine, condition)?;
            let temperatures = solver.steady(&load)?.temperatures;
            let readings: Vec<f64> = model.network.sensors.iter().map(|s| s.read(&temperatures, &load)).collect();
            let limits: Vec<f64> = limit_states(&model.machine, &readings, &load.variables).iter().map(|l| l.value).collect();
            values.extend(readings.into_iter().chain(limits).zip(&self.wanted).map(|(v, wanted)| if *wanted { v } else { 0.0 }));
        }
        Ok(values)
    }

    /// Error of a mesh at conditions `at`, from readings on it and on meshes with twice and half the cells along every line.
    ///
    /// # Errors
    /// Errors of [`Trials::values`].
    pub(super) fn whole(&self, counts: &Counts, at: &[usize]) -> Result<Whole> {
        let meshes = [counts.clone(), changed(counts, &self.lines, |n| 2 * n), changed(counts, &self.lines, |n| n.div_ceil(2))];
        let mut found: Vec<Vec<f64>> = meshes.par_iter().map(|counts| self.values(counts, at)).collect::<Result<_>>()?;
        let of = |f: usize| open(found[1][f], found[0][f], found[2][f]) / self.accuracy;
        let open = (0..found[0].len()).map(of).collect();
        Ok(Whole { own: found.swap_remove(0), open })
    }

    /// The conditions with the largest errors, worst first and at most `most`: for each reading the condition with its largest error.
    /// `open` has entries at all conditions.
    pub(super) fn telling(&self, open: &[f64], most: usize) -> Vec<usize> {
        let n = self.wanted.len();
        let worst = |i: usize| {
            let at = (0..self.conditions.len()).map(|c| (c, open[c * n + i]));
            at.fold((0, 0.0), |most: (usize, f64), next| if next.1 > most.1 { next } else { most })
        };
        let mut found: Vec<(usize, f64)> = (0..n).map(worst).collect();
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut chosen = Vec::new();
        for (condition, _) in found {
            if !chosen.contains(&condition) && chosen.len() < most {
                chosen.push(condition);
            }
        }
        chosen
    }

    /// The largest entry over all conditions of every sensor and every limit, from entries in the order of [`Trials::values`]; `None`
    /// where they are no temperatures.
    pub(super) fn worst(&self, entries: &[f64]) -> (Vec<Option<f64>>, Vec<Option<f64>>) {
        let n = self.wanted.len();
        let of = |i: usize| self.wanted[i].then(|| entries.iter().skip(i).step_by(n).fold(0.0, |m: f64, e| m.max(*e)));
        let mut sensors: Vec<Option<f64>> = (0..n).map(of).collect();
        let limits = sensors.split_off(self.machine.sensors.len());
        (sensors, limits)
    }

    /// Name of a sensor or limit, by its place among the entries of [`Trials::values`].
    pub(super) fn name(&self, entry: usize) -> &str {
        let i = entry % self.wanted.len().max(1);
        let limit = |i: usize| self.machine.limits.get(i).map_or("", |l| l.name.as_str());
        self.machine.sensors.get(i).map_or_else(|| limit(i.wrapping_sub(self.machine.sensors.len())), |s| s.name.as_str())
    }
}

/// The axes of a block that have cells.
fn lines_of(block: usize, own: &PartBlock) -> impl Iterator<Item = CellLine> + use<> {
    let (axes, is_turn) = match own.shape {
        BlockShape::Box { .. } => (3, false),
        BlockShape::Cylinder { turn, .. } => (3, turn.1 - turn.0 > 0.99 * TAU),
        BlockShape::Sphere { .. } => (1, false),
    };
    (0..axes).map(move |axis| CellLine { block, axis, least: if is_turn && axis == 1 { 4 } else { 1 } })
}

/// Error of a mesh in a reading, K, from the reading on it (`own`) and on meshes with twice and half the cells along every line. At
/// second order both differences give one estimate; otherwise one of them may vanish by chance, and the larger estimate counts.
fn open(twice: f64, own: f64, half: f64) -> f64 {
    let order = ((own - half) / (twice - own)).abs().log2();
    let order = if order.is_nan() { ORDERS.0 } else { order.clamp(ORDERS.0, ORDERS.1) };
    let finer = (twice - own).abs() / (1.0 - 0.5f64.powf(order));
    finer.max((own - half).abs() / (2f64.powf(ORDERS.1) - 1.0))
}

/// Number of cells of these counts.
pub(super) fn cells(counts: &Counts) -> f64 {
    counts.iter().map(|n| n.iter().map(|n| *n as f64).product::<f64>()).sum()
}

/// The counts with those of `lines` changed.
pub(super) fn changed(counts: &Counts, lines: &[CellLine], to: impl Fn(usize) -> usize) -> Counts {
    let mut found = counts.clone();
    for line in lines {
        let n = &mut found[line.block][line.axis];
        *n = to(*n).max(line.least);
    }
    found
}
