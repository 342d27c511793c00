//! Heat balances at the measured conditions, of the machine as it is and with the best explanation.

use rayon::prelude::*;

use coldplate_base::condition::COOLANT_TEMPERATURE;
use coldplate_base::error::Result;
use coldplate_describe::machine::Condition;
use coldplate_diagnose::{Cause, Diagnosis, Problem};
use coldplate_evidence::measurement::Data;
use coldplate_solve::meshed::{Flows, MeshedMachine, OutletSensor, SteadyState};
use coldplate_solve::study::Study;

/// Most conditions that are balanced, a count. Chosen: each costs two solves.
const MOST: usize = 12;

/// Heat balances.
#[derive(Debug, Default)]
pub struct EnergyBalances {
    /// One per condition, in the order of the data.
    pub balances: Vec<ConditionBalance>,
    /// Number of conditions in the data.
    pub conditions: usize,
    /// The machine with the best explanation, if there is one that holds at all conditions and can be solved.
    pub extended: Option<Study>,
}

/// The balance of one condition, steady.
#[derive(Debug)]
pub struct ConditionBalance {
    /// Name of the test.
    pub test: String,
    /// The condition.
    pub condition: Condition,
    /// Heat flows of the machine as it is.
    pub before: Flows,
    /// Heat flows with the best explanation, if it can be solved.
    pub after: Option<Flows>,
    /// Temperatures of all nodes of the machine as it is, K.
    pub temperatures: Vec<f64>,
    /// Temperatures of all nodes with the best explanation, K, if it can be solved.
    pub extended_temperatures: Option<Vec<f64>>,
    /// Heat that outlet sensors say the water took.
    pub water: Vec<WaterHeat>,
}

/// Heat that the water of a circuit takes, W.
#[derive(Debug)]
pub struct WaterHeat {
    /// Name of the circuit.
    pub circuit: String,
    /// Heat by the outlet sensor, W.
    pub measured: f64,
    /// Standard deviation of the measured heat, W.
    pub deviation: f64,
    /// Heat by the machine as it is, at the same place, W.
    pub before: f64,
    /// Heat by the machine with the best explanation, W.
    pub after: Option<f64>,
}

impl EnergyBalances {
    /// Balances at the conditions of the data, evenly chosen if there are many; of logs at the end of each test.
    ///
    /// # Errors
    /// The machine as it is cannot be solved.
    pub fn of(problem: &Problem, found: &Diagnosis, is_extended: bool) -> Result<Self> {
        let data = &problem.data;
        let rows = rows(data);
        let conditions = rows.len();
        let chosen: Vec<usize> =
            if conditions <= MOST { rows } else { (0..MOST).map(|i| rows[i * (conditions - 1) / (MOST - 1)]).collect() };
        // The machine after the last row says nothing of those before.
        let is_of_row = |cause: &Cause| !cause.hypothesis.is_written_afterwards(&found.places.scales);
        let is_of_all_rows = found.explanations.first().is_none_or(|best| best.causes.iter().all(is_of_row));
        let extended: Option<Study> = match &found.sets {
            Some(sets) if is_extended && is_of_all_rows => problem.study.edited(sets).ok(),
            _ => None,
        };
        let outlets = problem.study.model.outlet_sensors();
        let model = &problem.study.model;
        let Some(first) = chosen.first() else { return Ok(Self { conditions, ..Self::default() }) };
        let first = &data.rows[*first].condition;
        let own = model.solver(first)?;
        // An extended machine that cannot be solved is left out: the machine as it is stays worth showing.
        let other = extended.as_ref().and_then(|study| Some((&study.model, study.model.solver(first).ok()?)));
        let one = |r: &usize| -> Result<ConditionBalance> {
            let condition = &data.rows[*r].condition;
            let state = model.solve(&own, condition)?;
            let after = other.as_ref().and_then(|(model, solver)| Some((*model, model.solve(solver, condition).ok()?)));
            Ok(ConditionBalance {
                test: data.rows[*r].test.clone(),
                condition: condition.clone(),
                before: model.flows(&state),
                water: outlets.iter().filter_map(|outlet| water(problem, *r, outlet, &state, after.as_ref())).collect(),
                after: after.as_ref().map(|(model, state)| model.flows(state)),
                temperatures: state.solution.temperatures,
                extended_temperatures: after.map(|(_, state)| state.solution.temperatures),
            })
        };
        let balances = chosen.par_iter().map(one).collect::<Result<_>>()?;
        Ok(Self { balances, conditions, extended })
    }

    /// The balance with most heat in it, which says most.
    pub fn largest(&self) -> Option<&ConditionBalance> {
        let heat = |b: &ConditionBalance| b.before.sources.iter().map(|s| s.1).sum::<f64>();
        self.balances.iter().max_by(|a, b| heat(a).total_cmp(&heat(b)))
    }
}

/// Rows that stand for a condition each: distinct ones of tables, the last of each log.
fn rows(data: &Data) -> Vec<usize> {
    let all = 0..data.rows.len();
    if data.is_transient() {
        return data.tests().iter().filter_map(|test| data.rows.iter().rposition(|row| row.test == *test)).collect();
    }
    all.clone().filter(|r| data.rows[..*r].iter().all(|other| other.condition != data.rows[*r].condition)).collect()
}

fn water(
    problem: &Problem,
    r: usize,
    outlet: &OutletSensor,
    state: &SteadyState,
    after: Option<&(&MeshedMachine, SteadyState)>,
) -> Option<WaterHeat> {
    let data = &problem.data;
    if data.is_transient() {
        return None;
    }
    let k = data.sensors.iter().position(|s| *s == outlet.sensor)?;
    // The temperature at which the sensor shows the reading.
    let reading = problem.study.model.machine.sensors.get(outlet.sensor)?.shows.temperature(data.rows[r].readings[k]?, state.load.chamber);
    let inlet = *state.load.inlets.get(outlet.circuit)?;
    let circuit = &problem.study.model.network.circuits.get(outlet.circuit)?.circuit;
    let rate = |state: &SteadyState, reads: f64| {
        Some(state.solution.streams.get(outlet.stream)?.mass_flow * circuit.liquid.mean_specific_heat(inlet, reads))
    };
    let heat = |model: &MeshedMachine, state: &SteadyState| {
        let reads = model.network.sensors.get(outlet.sensor)?.read(&state.solution.temperatures, &state.load);
        Some(rate(state, reads)? * (reads - inlet))
    };
    let machine = &problem.study.model.machine;
    let at = machine.variables.iter().position(|v| v.name == COOLANT_TEMPERATURE);
    let own = problem.uncertainty.at(&data.rows[r].condition);
    let spread = problem.uncertainty.noise[k].hypot(problem.uncertainty.bias[k]).hypot(at.map_or(0.0, |v| own[v]));
    Some(WaterHeat {
        circuit: circuit.name.clone(),
        measured: rate(state, reading)? * (reading - inlet),
        deviation: rate(state, reading)? * spread,
        before: heat(&problem.study.model, state)?,
        after: after.and_then(|(model, state)| heat(model, state)),
    })
}
