//! Kinds that real riddles asked for, on the milling head: each in front, with its size.

use super::amplitude::{AS_IT_IS, Row, front, line, only, table};

const NUT: usize = 7;

/// A sensor that is taped to the nut shows a fifth of the room.
#[test]
fn a_sensor_that_is_badly_attached() {
    let read = |_: &Row, values: &mut Vec<f64>, room: f64| values[NUT] = 0.8 * values[NUT] + 0.2 * room;
    let set = front("taped", &table(13, |_| Vec::new(), read).0);
    let own = only(&set, "badly attached sensor", "nut");
    assert!(own.amplitudes.iter().all(|a| (a - 0.2).abs() < 0.03), "{:?}", own.amplitudes);
}

/// The room's sensor stands in a draught: the room is warmer than the table states, the more the faster the spindle runs.
#[test]
fn a_temperature_that_the_table_states_wrongly() {
    let warmer = |row: &Row| 1.0 + 2.0 * row.rpm / 6000.0;
    let lines = |row: &Row| line("node.room.temperature", format!("ambient_temperature_degC + {}", warmer(row)));
    let (problem, rows) = table(14, lines, AS_IT_IS);
    let set = front("draught", &problem);
    let own = only(&set, "condition offset", "ambient_temperature");
    assert_eq!(own.over.as_deref(), Some("motor_speed"));
    assert!(rows.iter().zip(&own.amplitudes).all(|(row, a)| (a - warmer(row)).abs() < 0.3), "{:?}", own.amplitudes);
}
