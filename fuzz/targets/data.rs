//! A CSV table of any content is read or refused as a table, as measured data and as a schedule.
#![no_main]

use std::sync::LazyLock;

use coldplate::{Data, Machine, Schedule, Table};
use coldplate_explore::schedule::ScheduleOptions;
use libfuzzer_sys::fuzz_target;

static MACHINE: LazyLock<Machine> =
    LazyLock::new(|| Machine::from_text(include_str!("../../examples/tutorial/machine.toml"), "machine.toml", &[]).expect("it is read"));

fuzz_target!(|text: &str| {
    let Ok(table) = Table::from_csv(text, "data.csv") else { return };
    table.check().expect("what is read is a table");
    let again = Table::from_csv(&table.to_csv().expect("what is read can be written"), "data.csv").expect("what is written can be read");
    assert_eq!(again.rows(), table.rows());
    let lines = Table::csv_lines(text);
    if let Ok(data) = Data::from_table(&table, &lines, &MACHINE, "data.csv") {
        assert!(data.count() <= table.rows() * table.columns.len());
    }
    if let Ok(schedule) = Schedule::from_table(&table, &lines, &MACHINE, &[], ScheduleOptions::default()) {
        assert!(schedule.end() > schedule.start());
    }
});
