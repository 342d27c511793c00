//! A damaged journal gives back what was written or less, never anything else; any other bytes are read or refused.
#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use coldplate_explore::sweep::journal::{Header, Journal, Outcome};
use coldplate_fuzz::damaged;
use libfuzzer_sys::fuzz_target;

/// Journals are files; this one stays in memory where the system has such a folder.
static PATH: LazyLock<PathBuf> = LazyLock::new(|| {
    let memory = PathBuf::from("/dev/shm");
    let folder = if memory.is_dir() { memory } else { std::env::temp_dir() };
    folder.join(format!("coldplate-fuzz-{}.journal", std::process::id()))
});

fn header() -> Header {
    Header { identity: vec![("machine".into(), "rig".into())], outputs: vec!["motor [degC]".into(), "plate [degC]".into()], conditions: 4 }
}

fn outcomes() -> [Outcome; 4] {
    [
        Outcome::Values(vec![31.25, 20.1]),
        Outcome::Failed("no \"convergence\"\tafter 50 steps".into()),
        Outcome::Values(vec![-1.0 / 3.0, 5e-324]),
        Outcome::Values(vec![21.0, 22.0]),
    ]
}

static SOUND: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let _ = std::fs::remove_file(&*PATH);
    let mut journal = Journal::open(&PATH, &header()).expect("it begins");
    for (index, outcome) in outcomes().into_iter().enumerate() {
        journal.append(index, outcome).expect("it is written");
    }
    std::fs::read(&*PATH).expect("it is there")
});

fuzz_target!(|plan: &[u8]| {
    let Some((mode, plan)) = plan.split_first() else { return };
    let first = SOUND.iter().position(|b| *b == b'\n').expect("a journal has a first line") + 1;
    let bytes = match mode {
        0 => plan.to_vec(),
        1 => [&SOUND[..first], plan].concat(),
        _ => damaged(&SOUND, plan),
    };
    std::fs::write(&*PATH, &bytes).expect("it is written");
    let Ok(journal) = Journal::open(&PATH, &header()) else { return };
    if *mode > 1 {
        for (found, written) in journal.outcomes().iter().zip(outcomes()) {
            assert!(found.as_ref().is_none_or(|found| *found == written), "{found:?}, written {written:?}");
        }
    }
});
