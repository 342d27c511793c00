//! A changed Parquet file is refused, or gives what the unchanged one gives; any other bytes are read or refused.
#![no_main]

use std::sync::LazyLock;

use coldplate::Table;
use coldplate_fuzz::damaged;
use libfuzzer_sys::fuzz_target;

static SOUND: LazyLock<(String, Vec<u8>)> = LazyLock::new(|| {
    let table = Table::from_csv(include_str!("../../examples/tutorial/readings.csv"), "t.csv").expect("it is read");
    (table.to_csv().expect("it is a table"), table.to_parquet().expect("it is written"))
});

// A panic inside the Parquet decoder is caught by its caller and counts as a damaged file: the hook that ends the
// process at any panic is taken off. One that escapes still ends it.
fuzz_target!(init: drop(std::panic::take_hook()), |plan: &[u8]| {
    if let [0, raw @ ..] = plan {
        let _ = Table::from_parquet(raw.to_vec(), "t.parquet");
        return;
    }
    let (csv, sound) = &*SOUND;
    if let Ok(read) = Table::from_parquet(damaged(sound, plan), "t.parquet") {
        assert_eq!(read.to_csv().expect("it is a table"), *csv);
    }
});
