//! Why a curve does not agree: the printed number that forbids it, by computation.

use coldplate_base::error::{Error, Result};
use coldplate_solve::study::Study;

use super::numbers;
use super::search::{Compared, Found};
use crate::validation::fits::reasons;
use crate::validation::fits::{Published, value};

/// Heats of motor and reducer printed for 2500 r/min, W.
const PRINTED: f64 = 113.729 + 51.178;
/// Heat that is added to see how a place warms, W.
const ADDED: f64 = 100.0;
/// Flow of Tables 8 to 10 in the unit of Table 7.
const FLOW: f64 = 15.7;

/// Reading of a sensor, degC, at one row of a table of the data.
pub fn reading(study: &Study, found: &Found, table: usize, row: usize, sensor: &str) -> Result<f64> {
    let test = numbers::test(table);
    let row = found.problem.data.rows.iter().filter(|r| r.test == test).nth(row).ok_or_else(|| Error::input("no such row"))?;
    let state = study.model.solve(&study.model.solver(&row.condition)?, &row.condition)?;
    let at = study.model.machine.sensors.iter().position(|s| s.name == sensor);
    let at = at.ok_or_else(|| Error::input(format!("no sensor '{sensor}'")))?;
    Ok(study.model.readings(&state)[at])
}

/// Heat that would have to enter a part so that its sensor reads `degc`, W.
fn watts(found: &Found, table: usize, row: usize, sensor: &str, part: &str, degc: f64) -> Result<f64> {
    let study = found.machine(table)?;
    let source = format!("{{ in = [\"{part}\"], power = \"{ADDED} W\" }}");
    let warmed = study.edited(&[("source.added_to_see".to_string(), source)])?;
    let before = reading(&study, found, table, row, sensor)?;
    let after = reading(&warmed, found, table, row, sensor)?;
    Ok(ADDED * (degc - before) / (after - before))
}

/// For one curve that does not agree; `alone` is what its own table gives.
pub fn reason(found: &Found, alone: &Found, all: &[Published], left: &Compared) -> Result<String> {
    let printed = |table: usize, sensor: &str, x: f64| {
        all.iter().find(|p| p.table == table && p.sensor == sensor).map_or(f64::NAN, |p| value(p.curve(), x))
    };
    match (left.test.as_str(), left.sensor.as_str()) {
        ("table 8", sensor @ "Y reducer plate") => {
            let degc = printed(8, sensor, 20.0);
            Ok(format!(
                "its {degc:.2} degC at 20 degC of water. The water takes so much heat at this flow that {:.0} W would have to enter the plate, and all printed \
                 heats of motor and reducer are {PRINTED:.0} W; the reducer on it is printed at {:.2} degC, and nothing is warmed through a colder body",
                watts(found, 8, 2, sensor, "y_reducer_plate", degc)?,
                printed(8, "Y reducer", 20.0)
            ))
        }
        ("table 9", sensor @ "Y motor plate") => {
            let degc = printed(9, sensor, 2500.0);
            Ok(format!(
                "its {degc:.2} degC at 2500 r/min. {:.0} W would have to enter the plate, and all printed heats of motor and reducer are {PRINTED:.0} W; the motor on \
                 it is printed at {:.2} degC, and Table 7 has the plate at {:.2} degC at this speed and flow",
                watts(found, 9, 6, sensor, "y_motor_plate", degc)?,
                printed(9, "Y motor", 2500.0),
                printed(7, sensor, FLOW)
            ))
        }
        ("table 8", sensor @ "Y coupling") => {
            let joints = ["contact.y_shaft.total_conductance", "contact.y_screw_clamp.conductance"];
            let mut study = found.machine(7)?;
            let mut said = Vec::new();
            for key in joints {
                let Some(k) = alone.number(key, None) else { continue };
                let parameter = study.parameter(key)?;
                study = study.with(&[(&parameter, alone.estimate.values[k])])?;
                said.push(format!("{:.2} {}", parameter.shown(alone.estimate.values[k]), parameter.unit));
            }
            let own = alone.curve(&left.test, sensor).map_or(f64::NAN, |c| c.difference.rise);
            let there = printed(7, sensor, FLOW);
            let rows = found.problem.data.rows.iter().filter(|r| r.test == "table 7").count();
            Ok(format!(
                "the {there:.2} degC of Table 7. Here the coupling follows its water by {:.2} K per kelvin, which asks for a firm joint to the reducer and a loose one to \
                 the screw ({}, from Table 8 alone, rise {own:+.2} K); with these the coupling of Table 7, whose reducer is at {:.2} degC, would have {:.2} degC",
                (printed(8, sensor, 24.0) - printed(8, sensor, 18.0)) / 6.0,
                said.join(" and "),
                printed(7, "Y reducer", FLOW),
                reading(&study, found, 7, rows / 2, sensor)?,
            ))
        }
        ("table 10" | "table 8", sensor @ "Y bearing motor side") => Ok(format!(
            "the rise of its other table: it follows its water by {:.2} K per kelvin in Table 8 and its chamber by {:.2} in Table 10, {:.2} together, where a \
             machine with fixed heats has nearly 1",
            (printed(8, sensor, 24.0) - printed(8, sensor, 18.0)) / 6.0,
            (printed(10, sensor, 24.0) - printed(10, sensor, 18.0)) / 6.0,
            (printed(8, sensor, 24.0) - printed(8, sensor, 18.0) + printed(10, sensor, 24.0) - printed(10, sensor, 18.0)) / 6.0,
        )),
        (test, sensor) => {
            let table = test.rsplit(' ').next().and_then(|n| n.parse().ok()).unwrap_or(0);
            let part = all.iter().find(|p| p.table == table && p.sensor == sensor).map_or("", |p| p.part.as_str());
            Ok(reasons::reason(all, table, part))
        }
    }
}
