//! A design that grows: what is added depends on what was found, and a stop at any moment still changes nothing.

use std::sync::OnceLock;

use coldplate_explore::sweep::{ADDED, JOURNAL, Plan, Purpose, SweepOptions, SweepRound, Swept, execute_growing, journal};

use super::*;

/// Made once: finding a good Latin hypercube takes longer than all else here.
fn growing_plan() -> &'static Plan {
    static PLAN: OnceLock<Plan> = OnceLock::new();
    PLAN.get_or_init(made_plan)
}

fn made_plan() -> Plan {
    let text = "name = 'restart'\nmachine = 'm.toml'\n[design]\nkind = 'adaptive'\naccuracy = '1 K'\nruns = 7\n[range]\n\
         coolant_flow = ['2 L/min', '19 L/min']\ncoolant_temperature = ['18 degC', '24 degC']\n[validation]\nruns = 2\n\
         [[one_factor]]\nvariable = 'coolant_flow'\nlow = '3 L/min'\nhigh = '6 L/min'\npoints = 3\nhold = { coolant_temperature = '20 degC' }\n";
    SweepDefinition::new(Document::parse(text, "s.toml").unwrap()).unwrap().plan(&variables()).unwrap()
}

/// Three times three conditions, chosen by the last bits of all that was found.
fn grow(round: &SweepRound<'_>) -> Result<Option<Vec<Vec<f64>>>> {
    let growth = round.plan.growth.as_ref().unwrap();
    assert_eq!(round.table.rows(), round.rows.len());
    let bits = round.table.outputs().iter().flat_map(|c| &c.values).fold(0u64, |sum, v| sum.rotate_left(5) ^ v.to_bits());
    let candidates = growth.candidates(round.plan.conditions.len());
    let row = |k: u64| growth.condition(&candidates[((bits >> (8 * k)) % candidates.len() as u64) as usize], &round.plan.variables);
    Ok((round.plan.conditions.len() < 12 + 9).then(|| (0..3).map(row).collect()))
}

fn sweep(folder: &Path, options: SweepOptions<'_>) -> Result<Swept> {
    execute_growing(growing_plan(), &subject(), folder, options, |plan, row| solve(&plan.conditions[row]), &mut grow)
}

fn finished(name: &str) -> (PathBuf, Files, Vec<u8>) {
    let folder = folder(name);
    let swept = sweep(&folder, SweepOptions::default()).unwrap();
    let added = swept.plan.groups.last().unwrap();
    assert_eq!((added.name.as_str(), added.purpose, added.rows.clone()), (ADDED, Purpose::Fit, 12..21));
    // What was there keeps its rows.
    let first = growing_plan();
    assert_eq!(swept.plan.conditions[..12], first.conditions);
    assert!(swept.failures.iter().any(|f| f.group == ADDED), "some of what is added fails too: {:?}", swept.failures);
    let journal = std::fs::read(folder.join(JOURNAL)).unwrap();
    let seen = journal::seen(Path::new("j"), &journal).unwrap();
    assert_eq!((seen.conditions, seen.solved + seen.failed, seen.header.conditions), (21, 21, 12));
    let results = results(&folder);
    (folder, results, journal)
}

#[test]
fn a_journal_of_a_growing_design_cut_anywhere_leads_to_the_same_files() {
    let (folder, expected, journal) = finished("growing-cut");
    for length in (0..=journal.len()).step_by(3) {
        std::fs::remove_dir_all(&folder).unwrap();
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join(JOURNAL), &journal[..length]).unwrap();
        let swept = sweep(&folder, SweepOptions::default()).unwrap_or_else(|e| panic!("cut to {length} bytes: {e}"));
        assert_eq!(results(&folder), expected, "cut to {length} bytes");
        assert!(swept.damaged_lines.is_empty());
        assert_eq!(std::fs::read(folder.join(JOURNAL)).unwrap().len(), journal.len());
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_damaged_byte_in_the_journal_of_a_growing_design_changes_no_result() {
    let (folder, expected, journal) = finished("growing-damage");
    let header = journal.iter().position(|b| *b == b'\n').unwrap();
    for at in (header + 1..journal.len()).step_by(5) {
        let mut damaged = journal.clone();
        damaged[at] ^= 0x04;
        std::fs::write(folder.join(JOURNAL), &damaged).unwrap();
        sweep(&folder, SweepOptions::default()).unwrap_or_else(|e| panic!("byte {at}: {e}"));
        assert_eq!(results(&folder), expected, "byte {at}");
        // What was written beside the damage can be read again.
        sweep(&folder, SweepOptions::default()).unwrap_or_else(|e| panic!("byte {at}, again: {e}"));
        assert_eq!(results(&folder), expected, "byte {at}, again");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn neither_threads_nor_rounds_that_are_known_show() {
    let (folder, expected, _) = finished("growing-threads");
    for threads in [1, 5] {
        std::fs::remove_file(folder.join(JOURNAL)).unwrap();
        sweep(&folder, SweepOptions { threads: Some(threads), ..SweepOptions::default() }).unwrap();
        assert_eq!(results(&folder), expected, "{threads} threads");
    }
    // A sweep that would end sooner takes what the journal holds: it is solved already.
    let stop = &mut |_: &SweepRound<'_>| Ok(None);
    let solve = |plan: &Plan, row: usize| solve(&plan.conditions[row]);
    let swept = execute_growing(growing_plan(), &subject(), &folder, SweepOptions::default(), solve, stop).unwrap();
    assert_eq!(swept.plan.conditions.len(), 21);
    assert_eq!(results(&folder), expected);
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Each failed condition is tried once more, not once more in every round.
#[test]
fn failures_of_a_growing_design_are_run_again_when_asked() {
    let (folder, _, _) = finished("growing-failures");
    let calls = AtomicUsize::new(0);
    let still = |plan: &Plan, row: usize| {
        calls.fetch_add(1, Ordering::Relaxed);
        solve(&plan.conditions[row])
    };
    let options = SweepOptions { retry_failed: true, ..SweepOptions::default() };
    let swept = execute_growing(growing_plan(), &subject(), &folder, options, still, &mut grow).unwrap();
    assert_eq!(calls.load(Ordering::Relaxed), swept.failures.len());
    std::fs::remove_dir_all(&folder).unwrap();
}
