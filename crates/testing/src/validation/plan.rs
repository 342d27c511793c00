//! What to measure next on the published rig and machine: docs/record/test-plan.md, one page.

use coldplate_base::atomic_file;
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::significant;
use coldplate_describe::machine::DescribedVariable;
use coldplate_evidence::identify::{self, Advice, Estimate, Free, IdentifyOptions, IdentifyProblem};
use coldplate_evidence::measurement::{Data, MeasurementUncertainty};
use coldplate_explore::simulate::Start;

use crate::validation::common::{Section, owned, project, study, table, wrapped, written};
use crate::validation::machine;
use crate::validation::rig;

/// Cells of the rig and of the machine.
const RIG: usize = 1500;
const MACHINE: usize = 2000;

/// Numbers that readings leave open, and the test that the program proposes.
pub struct Plan {
    pub problem: IdentifyProblem,
    pub estimate: Estimate,
    /// With the sensors that were there, and with all that the machine file has.
    pub best: [Advice; 2],
    /// The sensor that adds most to those that were there, and the information with it, nats.
    pub added: Option<(String, f64)>,
}

fn plan(problem: IdentifyProblem) -> Result<Plan> {
    let estimate = identify::identify(&problem, &IdentifyOptions { starts: 1, seed: 1 }, &coldplate_base::progress::Silent)?;
    let every: Vec<usize> = (0..problem.study.model.machine.sensors.len()).collect();
    let best = |sensors: &[usize]| -> Result<Advice> {
        let found = identify::next_tests(&problem, &estimate, sensors)?;
        found.into_iter().next().ok_or_else(|| Error::numerics("no test can be solved"))
    };
    let own = &problem.data.sensors;
    let mut added: Option<(String, f64)> = None;
    for one in every.iter().filter(|s| !own.contains(s)) {
        let gain = best(&[own.as_slice(), &[*one]].concat())?.gain;
        if added.as_ref().is_none_or(|(_, most)| gain > *most) {
            added = Some((problem.study.model.machine.sensors[*one].name.clone(), gain));
        }
    }
    let best = [best(own)?, best(&every)?];
    Ok(Plan { problem, estimate, best, added })
}

/// The rig with a joint between motor and reducer that nobody measured, and a motor that can be fed at standstill: its own heat
/// without that of the reducer.
pub fn rig_plan() -> Result<Plan> {
    let mut sets = owned(&[
        ("variables.reducer_turns", "{ unit = \"1\", default = 1, range = [0, 1] }"),
        ("source.reducer.power", "reducer_turns * y_reducer_W"),
    ]);
    sets.push(rig::coupling(1.5));
    let study = study("rig.toml", &sets, Some(RIG))?;
    let data = Data::read(&project("data/paper/rig_likely.csv"), &study.model.machine)?;
    let uncertainty = MeasurementUncertainty::read(&project("data/rig.toml"), &data, &study.model.machine)?;
    // 1.5 W/K over 0.01 m2 is what such a flange may have.
    let keys = ["contact.motor.conductance", "contact.reducer.conductance", "contact.coupling.conductance=150 W/(m2 K) +- 150 W/(m2 K)"];
    let free = keys.iter().map(|key| Free::parse(key, &study)).collect::<Result<Vec<_>>>()?;
    plan(IdentifyProblem { study, data, uncertainty, free, start: Start::Steady })
}

/// The whole machine: line, bearing, emissivity and the neck to the seat, with a thermometer in the leaving water.
pub fn machine_plan() -> Result<Plan> {
    let mut sets = machine::line_gain("0.4");
    sets.extend(owned(&[("sensor.\"Y water out\"", "{ outlet = \"y_reducer_plate\" }")]));
    // What no test can set is no condition here; the other axes rest, for their bearings' heats are as little known.
    for (fixed, range) in [("bearing_preload", ["2999 N", "3001 N"]), ("nut_preload", ["2999 N", "3001 N"])] {
        sets.push((format!("variables.{fixed}.range"), format!("{range:?}")));
    }
    for axis in ["x1", "x2", "z", "a", "b"] {
        sets.push((format!("variables.{axis}_speed.range"), "[\"0 rpm\", \"0.001 rpm\"]".into()));
    }
    sets.push(("variables.table_4.range".into(), "[0, 1e-6]".into()));
    let study = study("five_axis.toml", &sets, Some(MACHINE))?;
    let data = machine::data(&study)?;
    let uncertainty = MeasurementUncertainty::read(&project("data/five_axis.toml"), &data, &study.model.machine)?;
    let neck = "contact.y_base.conductance=500 W/(m2 K) +- 400 W/(m2 K)";
    let keys = ["define.line_gain_K", "source.y_bearing.power=0.05..33", "surfaces.effective_emissivity", neck];
    let free = keys.iter().map(|key| Free::parse(key, &study)).collect::<Result<Vec<_>>>()?;
    plan(IdentifyProblem { study, data, uncertainty, free, start: Start::Steady })
}

/// A value and its unit in four digits.
fn tidy(text: &str) -> String {
    let (number, unit) = text.split_once(' ').unwrap_or((text, ""));
    let number =
        number.parse().map_or(number.to_string(), |x: f64| if x != 0.0 && x.abs() < 1e-3 { format!("{x:.2e}") } else { significant(x, 4) });
    if unit == "1" { number } else { format!("{number} {unit}") }
}

fn shown(plan: &Plan) -> String {
    let machine = &plan.problem.study.model.machine;
    let rows = plan.problem.free.iter().enumerate().map(|(k, free)| {
        let p = &free.parameter;
        let at = |v: f64| significant(p.shown(v), 3);
        let (low, high) = plan.estimate.intervals[k];
        let mut row = vec![
            format!("`{}`", p.name),
            format!("{} {}", at(plan.estimate.values[k]), if p.unit == "1" { "" } else { &p.unit }).trim().to_string(),
            format!("{} to {}", at(low), at(high)),
        ];
        row.extend(plan.best.iter().map(|a| format!("{:.0} %", 100.0 * a.shrink[k])));
        row
    });
    let mut text = table(
        &["number", "now", "95 % interval", "its width after the test, same sensors", "with all sensors of the file"],
        &rows.collect::<Vec<_>>(),
    );
    for open in &plan.estimate.undetermined {
        text += &format!("The readings cannot determine {}.\n\n", open.text);
    }
    // The four conditions of the study, and what a plan adds to them.
    let is_shown = |v: &&DescribedVariable| {
        !v.name.ends_with("preload") && v.name != "table_4" && (!v.name.ends_with("_speed") || v.name == "motor_speed")
    };
    for (best, which) in plan.best.iter().zip(["the sensors that were read", "all sensors of the machine file"]) {
        let by_name = best.condition.by_name(machine);
        let said: Vec<String> = machine
            .variables
            .iter()
            .filter(is_shown)
            .filter_map(|v| by_name.get(&v.name).map(|value| format!("{} {}", v.name.replace('_', " "), tidy(value))))
            .collect();
        text += &format!("* With {which}: a steady test at {} ({:.1} nats).\n", said.join(", "), best.gain);
    }
    if let Some((name, gain)) = &plan.added {
        text += &format!("* One sensor more: *{name}* tells most beside those that were read ({gain:.1} nats).\n");
    }
    text + "\n"
}

/// Writes docs/record/test-plan.md; the section points there.
pub fn section() -> Result<Section> {
    let (rig, whole) = (rig_plan()?, machine_plan()?);
    let text = format!(
        "# A test plan for the published rig and machine\n\n{}\
         What the published readings leave open, and the one test more that would say most about it, as the program finds it (the advice of \
         [identification](../method/identification.md#the-statistics)). Tests are sought within the ranges of the machine files, their corners first; what is not \
         named as open counts as known, the heats of other parts among it.\n\n\
         ## The rig\n\n\
         Both working conditions heat motor and reducer in the same proportion, so that a joint between the two that nobody measured trades against both contacts \
         ([validation](validation.md)). Here that joint is open too (beforehand 1.5 W/K, give or take as much), and the motor may be fed at standstill, its own heat without the reducer's (`reducer_turns` 0, with the current of full load).\n\n{}\
         ## The whole machine\n\n\
         One steady test gave 16 readings. Open are the heat gain of the line, the heat of the Y bearing, the emissivity, and the joint of base and seat (beforehand 500 W/(m2 K) give or take 400); the other axes rest, \
         and a thermometer in the water that leaves Y is among the sensors of the file here.\n\n{}",
        written("cargo bench --bench validation -- plan"),
        shown(&rig),
        shown(&whole)
    );
    atomic_file::write(&project("docs/record/test-plan.md"), wrapped(&text).as_bytes())?;
    Ok(Section { text: "What to measure next on both: [a test plan](test-plan.md).\n\n".into(), ..Section::default() })
}
