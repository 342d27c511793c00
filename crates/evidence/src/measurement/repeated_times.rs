//! Times that repeat because a logger writes fewer digits of its clock than it takes readings.

use std::collections::HashMap;

/// Last digits of clocks, s: milliseconds to minutes.
const DIGITS: [f64; 5] = [1e-3, 1e-2, 0.1, 1.0, 60.0];
/// Fewest different times by which the digit of a clock is known, a count. Chosen: fewer may be the corners of a schedule.
const FEWEST: usize = 4;
/// Least share of the times that the clock goes on by its last digit, and that several rows repeat; dimensionless. Chosen: more gaps
/// or fewer repeats leave it open how the rows lie within the digit.
const PLAIN: [f64; 2] = [0.8, 0.5];

/// Rows of a test at one time.
struct Run {
    time: f64,
    rows: Vec<usize>,
}

/// Spreads rows evenly within the last digit of the clock where a test repeats its times plainly; one sentence for each test. `times`
/// in s; `is_same(a, b)` says whether two rows have the same conditions.
pub(super) fn spread(times: &mut [f64], tests: &[String], is_same: impl Fn(usize, usize) -> bool) -> Vec<String> {
    let mut runs: Vec<(&str, Vec<Run>)> = Vec::new();
    let mut place: HashMap<&str, usize> = HashMap::new();
    for (row, (time, test)) in times.iter().zip(tests).enumerate() {
        let own = *place.entry(test).or_insert_with(|| {
            runs.push((test, Vec::new()));
            runs.len() - 1
        });
        match runs[own].1.last_mut().filter(|run| run.time == *time) {
            Some(run) => run.rows.push(row),
            None => runs[own].1.push(Run { time: *time, rows: vec![row] }),
        }
    }
    let mut told = Vec::new();
    for (test, runs) in &runs {
        let Some((digit, usual)) = plain(runs, &is_same) else { continue };
        for (n, run) in runs.iter().enumerate() {
            let count = run.rows.len();
            // A log may begin within a digit, and end within one.
            let (all, before) = match n {
                0 => (usual.max(count), usual.saturating_sub(count)),
                n if n + 1 == runs.len() => (usual.max(count), 0),
                _ => (count, 0),
            };
            run.rows.iter().enumerate().for_each(|(k, row)| times[*row] = run.time + digit * (before + k) as f64 / all as f64);
        }
        told.push(format!("the times of '{test}' repeat: about {usual} rows in each {digit} s, which are spread evenly within it"));
    }
    told
}

/// Last digit of the clock (s) and the usual number of rows within it, if the times repeat plainly.
fn plain(runs: &[Run], is_same: &impl Fn(usize, usize) -> bool) -> Option<(f64, usize)> {
    if runs.len() < FEWEST {
        return None;
    }
    let steps: Vec<f64> = runs.windows(2).map(|pair| pair[1].time - pair[0].time).collect();
    let least = steps.iter().copied().fold(f64::INFINITY, f64::min);
    let is_step = |step: f64, digit: f64| (step - digit).abs() < 1e-6 * digit.max(1.0);
    let digit = DIGITS.into_iter().find(|digit| is_step(least, *digit))?;
    let share = |count: usize, all: usize| count as f64 / all as f64;
    let even = steps.iter().filter(|step| is_step(**step, digit)).count();
    let repeated: Vec<&Run> = runs.iter().filter(|run| run.rows.len() > 1).collect();
    if share(even, steps.len()) < PLAIN[0] || share(repeated.len(), runs.len()) < PLAIN[1] {
        return None;
    }
    // Two rows at one time that differ, while the conditions stay until the next time, are a step.
    let is_step = |pair: &&[Run]| {
        let (first, last, next) = (pair[0].rows[0], pair[0].rows[pair[0].rows.len() - 1], pair[1].rows[0]);
        !is_same(first, last) && is_same(last, next)
    };
    if 2 * runs.windows(2).filter(is_step).count() >= repeated.len() {
        return None;
    }
    let mut counts: Vec<usize> = runs[1..runs.len() - 1].iter().map(|run| run.rows.len()).collect();
    counts.sort_unstable();
    Some((digit, counts[counts.len() / 2]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(times: &[f64], is_same: impl Fn(usize, usize) -> bool) -> (Vec<f64>, usize) {
        let mut times = times.to_vec();
        let tests = vec!["log".to_string(); times.len()];
        let said = spread(&mut times, &tests, is_same).len();
        (times, said)
    }

    #[test]
    fn rows_of_a_fast_logger_lie_evenly_in_each_second() {
        // 4 Hz in whole seconds: the log begins and ends within one.
        let read: Vec<f64> = (2..23).map(|n| (0.25 * f64::from(n)).floor()).collect();
        let (times, said) = told(&read, |_, _| true);
        let exact: Vec<f64> = (2..23).map(|n| 0.25 * f64::from(n)).collect();
        assert_eq!((times, said), (exact, 1));
        // Minutes, with a gap.
        let read: Vec<f64> = (0..40).map(|n| 60.0 * f64::from(n / 2 + if n > 30 { 5 } else { 0 })).collect();
        let (times, said) = told(&read, |_, _| true);
        assert!(said == 1 && times[1] == 30.0 && times[33] == 60.0 * 21.0 + 30.0, "{times:?}");
    }

    #[test]
    fn steps_and_single_copies_stay() {
        // Corners of a schedule: the conditions change at each time and stay until the next.
        let corners: Vec<f64> = (0..20).map(|n| f64::from((n + 1) / 2)).collect();
        let (times, said) = told(&corners, |a, b| (a / 2) == (b / 2));
        assert_eq!((times, said), (corners, 0));
        let one: Vec<f64> = [0.0, 1.0, 2.0, 2.0, 3.0, 4.0, 5.0].to_vec();
        assert_eq!(told(&one, |_, _| true), (one, 0));
    }
}
