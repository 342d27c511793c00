//! A schedule run through a model: readings over time, times of settling, and checkpoints to resume from.

mod checkpoint;
pub mod drift;
mod full;
mod limits;
mod options;
mod passing;
pub mod record;
mod recorder;
mod reduced;
mod settle;
mod stepped;
mod stretch;

use crate::schedule::{Schedule, ScheduleSegment, TIME};
use coldplate_base::error::{Error, Result};
use coldplate_base::units::{Measurand, express};
use coldplate_describe::machine::{Condition, DescribedVariable, Machine};
use coldplate_network::Load;
use coldplate_network::{HeatMeter, Network};
use coldplate_reduce::{Beginning, ReducedModel};
use coldplate_solve::meshed::MeshedMachine;
use coldplate_solve::transient::{Energy, TransientState};
use coldplate_tables::{Column, Table};

pub use full::run;
pub use limits::LimitCourse;
pub use options::SimulateOptions;
pub use passing::{FirstPassings, Passed, Watch};
pub use reduced::run_reduced;
pub use stepped::{Stepper, check_beginning, run_stepped};

/// Largest open share of the energy over a whole run, dimensionless. Chosen, and stated in docs/method/time-steps.md.
pub(crate) const ENERGY_TOLERANCE: f64 = 1e-8;
/// Most output times, count. Chosen: limits the memory of a run.
const MOST_OUTPUTS: usize = 5_000_000;
/// Output times by default, for a schedule of fewer rows; count. Chosen: enough for a chart.
const USUAL_OUTPUTS: f64 = 200.0;

/// The state a run begins with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// The steady state of the first row's condition.
    Steady,
    /// Everything, water included, at one temperature, K.
    Uniform(f64),
    /// For a measured log: everything at the mean of its own first readings. A schedule has none.
    Readings,
    /// For a measured log: every part, node and channel at the mean of the first readings of its own sensors, one without
    /// sensors at the mean of all. A schedule has none.
    Parts,
}

impl Start {
    /// Beginning of a schedule.
    ///
    /// # Errors
    /// A start from readings, which a schedule does not have.
    pub(crate) fn of_schedule(self) -> Result<Beginning> {
        match self {
            Self::Steady => Ok(Beginning::Steady),
            Self::Uniform(temperature) => Ok(Beginning::Uniform(temperature)),
            Self::Readings | Self::Parts => {
                Err(Error::input("a schedule has no readings to begin with").at_key("--from").help("give a temperature"))
            }
        }
    }
}

/// Place that begins at a temperature of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StartPlace {
    /// A part, by its index.
    Part(usize),
    /// A lumped node, by its index.
    Node(usize),
    /// The water in a channel, by its index.
    Channel(usize),
}

/// Initial temperature of a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaceStart {
    /// Place of the temperature.
    pub place: StartPlace,
    /// Initial temperature, K.
    pub temperature: f64,
}

/// The machine at an instant of a run.
#[derive(Debug, Clone, Copy)]
pub struct RunInstant<'a> {
    /// Time and temperatures.
    pub state: &'a TransientState,
    /// The condition at the instant. A step of the schedule is seen twice, with the condition before and the one behind.
    pub condition: &'a Condition,
    /// Load at this condition.
    pub load: &'a Load,
}

/// Machine of a history: a machine with its mesh, a reduced model, or a surrogate that moves.
#[derive(Debug, Clone, Copy)]
pub struct SimulatedMachine<'a> {
    /// The machine's name.
    pub name: &'a str,
    /// Hash of the machine.
    pub hash: &'a str,
    /// Variables of its conditions.
    pub variables: &'a [DescribedVariable],
    /// Names of the sensors.
    pub sensors: &'a [String],
    /// Measurand of each sensor.
    pub measurands: &'a [Measurand],
    /// Heat-flow sensors of the machine.
    pub meters: &'a [HeatMeter],
    /// Cells of the mesh; zero if that is not known.
    pub cells: usize,
    /// Number of unknowns.
    pub nodes: usize,
    /// The machine, if it is known.
    pub machine: Option<&'a Machine>,
}

impl<'a> SimulatedMachine<'a> {
    fn of(machine: &'a Machine, network: &'a Network, cells: usize) -> Self {
        Self {
            name: &machine.name,
            hash: &machine.hash,
            variables: &machine.variables,
            sensors: &network.sensor_names,
            measurands: &network.measurands,
            meters: &network.meters,
            cells,
            nodes: network.nodes,
            machine: Some(machine),
        }
    }
}

impl<'a> From<&'a MeshedMachine> for SimulatedMachine<'a> {
    fn from(model: &'a MeshedMachine) -> Self {
        Self::of(&model.machine, &model.network, model.mesh.cells)
    }
}

impl<'a> From<&'a ReducedModel> for SimulatedMachine<'a> {
    fn from(model: &'a ReducedModel) -> Self {
        Self::of(&model.machine, &model.fine.network, model.made.cells)
    }
}

/// Result of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct History {
    /// Output times, s.
    pub times: Vec<f64>,
    /// The condition at each output time; at a step the one before and the one behind it.
    pub conditions: Vec<Condition>,
    /// Readings of all sensors at each output time, K, straight between them: their own lag, gain and offset included.
    pub readings: Vec<Vec<f64>>,
    /// Temperatures of the sensors' places at each output time, K.
    pub temperatures: Vec<Vec<f64>>,
    /// Heat through all heat-flow sensors at each output time, W.
    pub heat_flows: Vec<Vec<f64>>,
    /// Steady readings at the last condition, K, or why there are none.
    pub steady: std::result::Result<Vec<f64>, String>,
    /// Largest distance from the steady readings that counts as settled, K.
    pub within: f64,
    /// Time after the start at which each sensor has settled for good, s.
    pub settled: Vec<Option<f64>>,
    /// Times at which the watched temperatures were passed.
    pub passes: Vec<FirstPassings>,
    /// Largest values of the machine's limits, in its order.
    pub limits: Vec<LimitCourse>,
    /// Time steps taken.
    pub steps: usize,
    /// Time steps that were rejected and repeated with a shorter length.
    pub rejected: usize,
    /// Heat that went in, that went out and that the machine has stored, J.
    pub energy: Energy,
    /// Bound on the distance of each reading from that of the full model, K, if a reduced model was run.
    pub bounds: Option<Vec<Vec<f64>>>,
    /// Time at which a checkpoint was taken up, s.
    pub resumed_at: Option<f64>,
    /// Doubts about the run, since the checkpoint or the start, one sentence each.
    pub notes: Vec<String>,
}

impl History {
    /// Time after the start at which all sensors have settled, s.
    pub fn settled_overall(&self) -> Option<f64> {
        self.settled.iter().copied().try_fold(0.0, |latest: f64, at| at.map(|at| latest.max(at)))
    }

    /// The series as a table: time, condition, sensors, heat flows.
    ///
    /// # Errors
    /// A variable's unit cannot be expressed.
    pub fn table(&self, model: &SimulatedMachine<'_>) -> Result<Table> {
        let column = |name: &str, unit: &str, values: Vec<f64>| Column { name: name.into(), unit: unit.into(), values };
        let mut columns = vec![column(TIME, "s", self.times.clone())];
        for (v, variable) in model.variables.iter().enumerate().filter(|(_, v)| v.name != TIME) {
            let values = self.conditions.iter().map(|c| express(c.si()[v], &variable.unit, variable.dimension));
            columns.push(column(&variable.name, &variable.unit, values.collect::<Result<_>>()?));
        }
        let inputs = columns.len();
        for (s, name) in model.sensors.iter().enumerate() {
            // A sensor may have the name of a condition; two columns may not.
            let name = if columns.iter().any(|c| c.name == *name) { format!("{name} (sensor)") } else { name.clone() };
            let own = model.measurands[s];
            columns.push(column(&name, own.unit(), self.readings.iter().map(|r| own.shown(r[s])).collect()));
        }
        for (s, name) in model.sensors.iter().enumerate() {
            if let Some(bounds) = &self.bounds {
                columns.push(column(
                    &format!("{name} bound"),
                    model.measurands[s].unit_of_differences(),
                    bounds.iter().map(|row| row[s]).collect(),
                ));
            }
        }
        for (m, meter) in model.meters.iter().enumerate() {
            let is_taken = columns.iter().any(|c| c.name == meter.name);
            let name = if is_taken { format!("{} (heat flow)", meter.name) } else { meter.name.clone() };
            columns.push(column(&name, "W", self.heat_flows.iter().map(|heats| heats[m]).collect()));
        }
        let provenance = vec![
            ("machine".to_string(), model.name.to_string()),
            ("machine_hash".to_string(), model.hash.to_string()),
            ("cells".to_string(), model.cells.to_string()),
            ("program".to_string(), concat!("coldplate ", env!("CARGO_PKG_VERSION")).to_string()),
        ];
        Ok(Table { texts: Vec::new(), columns, inputs, provenance })
    }
}

/// A time at which readings are taken.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stop {
    time: f64,
    segment: ScheduleSegment,
}

/// Readings of a machine's sensors at the temperatures of their places (K, all sensors at each of ascending times, s) under the conditions
/// of these times.
///
/// # Errors
/// The temperature of the surroundings, which some sensor takes on in part, cannot be found.
pub fn shown(machine: &Machine, times: &[f64], conditions: &[Condition], temperatures: &[Vec<f64>]) -> Result<Vec<Vec<f64>>> {
    let mut readings = temperatures.to_vec();
    let takes_part = machine.sensors.iter().any(|sensor| sensor.shows.surroundings != 0.0);
    let of = |condition: &Condition| if takes_part { machine.surroundings(condition) } else { Ok(0.0) };
    let surroundings: Vec<f64> = conditions.iter().map(of).collect::<Result<_>>()?;
    for (s, sensor) in machine.sensors.iter().enumerate().filter(|(_, sensor)| !sensor.shows.is_ideal()) {
        let course: Vec<f64> = temperatures.iter().map(|row| row[s]).collect();
        readings.iter_mut().zip(sensor.shows.course(times, &course, &surroundings)).for_each(|(row, shown)| row[s] = shown);
    }
    Ok(readings)
}

/// The condition recorded at a stop: behind the step, if there is one.
fn condition_at(schedule: &Schedule, stop: &Stop) -> Condition {
    if stop.time >= stop.segment.until { schedule.stated(stop.segment.row + 1) } else { schedule.condition(stop.segment, stop.time) }
}

/// The output times: the start, every row, and the multiples of `every` between them.
fn stops(schedule: &Schedule, every: Option<f64>) -> Result<Vec<Stop>> {
    let (start, end) = (schedule.start(), schedule.end());
    let every = match every {
        Some(every) => every,
        None if schedule.rows().len() as f64 >= USUAL_OUTPUTS => f64::INFINITY,
        None => round_interval((end - start) / USUAL_OUTPUTS),
    };
    if (end - start) / every > MOST_OUTPUTS as f64 {
        return Err(Error::input(format!("outputs every {every} s would be more than {MOST_OUTPUTS}"))
            .at_key("--every")
            .help("give a longer interval"));
    }
    let mut stops = vec![Stop { time: start, segment: ScheduleSegment { from: start, until: f64::INFINITY, row: 0 } }];
    for segment in schedule.segments() {
        // A multiple that is a row but for rounding is that row.
        let (from, until) = (((segment.from - start) / every + 1e-9).floor(), ((segment.until - start) / every - 1e-9).floor());
        let inside = (from as u64 + 1..=until.max(0.0) as u64).map(|n| start + n as f64 * every);
        stops.extend(inside.chain([segment.until]).map(|time| Stop { time, segment }));
    }
    Ok(stops)
}

/// 1, 2, 5, 10, 15, 20, 30 of seconds, minutes, hours: the first that is not shorter; powers of ten below a second.
fn round_interval(seconds: f64) -> f64 {
    if seconds < 1.0 {
        let power = 10f64.powf(seconds.log10().floor());
        return [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= seconds * (1.0 - 1e-9)).unwrap_or(seconds);
    }
    let steps = [1.0, 60.0, 3600.0].into_iter().flat_map(|unit| [1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 30.0].map(|m| m * unit));
    steps.into_iter().find(|s| *s >= seconds).unwrap_or_else(|| (seconds / 86400.0).ceil() * 86400.0)
}

#[cfg(test)]
mod tests {
    use super::round_interval;

    #[test]
    fn intervals_are_round() {
        for (seconds, expected) in
            [(0.0131, 0.02), (0.5, 0.5), (1.0, 1.0), (3.0, 5.0), (45.0, 60.0), (306.0, 600.0), (4000.0, 7200.0), (2e5, 259200.0)]
        {
            let found: f64 = round_interval(seconds);
            assert!((found / expected - 1.0).abs() < 1e-12, "{seconds}: {found}");
        }
    }
}
