//! Thinning of logs: rows that add no information are left out.
//!
//! A log of a machine that changes over minutes is often read every second. The discrepancy of its model wanders over such
//! times, so that rows between two others repeat the information and cost as much to follow.
//!
//! Conditions drive the simulation through every row at which one of them turns. The choice of the readings to compare is
//! separate. In a year of a hall's weather or of a machine's duty, some condition turns in nearly every row that is left. So
//! many readings inform no more than an even choice of them.

use super::{Data, ReadingRow};

/// Readings of logs that are looked at, count: further rows between others repeat the information. Chosen with the days of two
/// heaters on a board in view (docs/record/diagnosis-measured.md).
pub const MOST_READINGS: usize = 1200;
/// Deviation of a condition from a straight line between two rows, as a share of its range in the log, above which a row is kept. Chosen:
/// lines of 1 % put 0.05 K into weeks of a lumped machine, which its readings resolve; these put 0.002 K there. A row that is not compared
/// costs little more than its time step.
const BENT: f64 = 5e-4;

/// Rows of logs so thinned that about `most` readings are left: evenly, and those of rows at which a condition turns. If these
/// alone are more than `most`, an even choice of `most` of them is left; the other rows stay for their condition. Steady
/// tables, and logs with no more readings, stay as they are.
pub fn thinned(data: &Data, most: usize) -> Data {
    let Some(stride) = stride(data, most) else { return data.clone() };
    let even = evenly(data, stride);
    let rows = kept(data, stride);
    let turns: Vec<usize> = (0..rows.len()).filter(|r| rows[*r] && !even[*r]).collect();
    let read: usize = turns.iter().map(|r| data.rows[*r].readings.iter().flatten().count()).sum();
    let share = read.div_ceil(most.max(1)).max(1);
    let mut thin = data.clone();
    turns.iter().enumerate().filter(|(n, _)| n % share != 0).for_each(|(_, r)| thin.rows[*r].readings.fill(None));
    only(&thin, &rows)
}

/// Rows of logs thinned with readings evenly in time alone: a row that is kept for its condition has none. No test and no time
/// then weighs more because conditions turn there.
pub fn thinned_evenly(data: &Data, most: usize) -> Data {
    let Some(stride) = stride(data, most) else { return data.clone() };
    let mut rows = kept(data, stride);
    let mut even = data.clone();
    even.rows.iter_mut().for_each(|row| row.readings.fill(None));
    for test in data.tests() {
        for sensor in 0..data.sensors.len() {
            let own = (0..data.rows.len()).filter(|r| data.rows[*r].test == test && data.rows[*r].readings[sensor].is_some());
            for r in own.step_by(stride) {
                even.rows[r].readings[sensor] = data.rows[r].readings[sensor];
                rows[r] = true;
            }
        }
    }
    // A start from readings takes those of the first row.
    for test in data.tests() {
        let first = (0..data.rows.len()).find(|r| data.rows[*r].test == test);
        first.into_iter().for_each(|r| even.rows[r].readings.clone_from(&data.rows[r].readings));
    }
    only(&even, &rows)
}

/// Number of readings of which one is kept; `None` if all are.
fn stride(data: &Data, most: usize) -> Option<usize> {
    let stride = data.count().div_ceil(most.max(1));
    (data.is_transient() && stride >= 2).then_some(stride)
}

fn only(data: &Data, kept: &[bool]) -> Data {
    let rows = data.rows.iter().zip(kept).filter(|(_, kept)| **kept).map(|(row, _)| row.clone()).collect();
    Data { rows, ..data.clone() }
}

/// Flags of the rows that are kept: every `stride`-th, the last of each test, and those at which a condition turns.
fn kept(data: &Data, stride: usize) -> Vec<bool> {
    let even = evenly(data, stride);
    let mut kept = even.clone();
    for test in data.tests() {
        let own: Vec<usize> = (0..data.rows.len()).filter(|r| data.rows[*r].test == test).collect();
        let ranges = ranges(data, &own);
        let ends: Vec<usize> = (0..own.len()).filter(|i| even[own[*i]]).collect();
        ends.windows(2).for_each(|pair| keep_turns(data, &own[pair[0]..=pair[1]], &ranges, &mut kept));
    }
    kept
}

/// Flags of every `stride`-th row of each test, and of its last.
fn evenly(data: &Data, stride: usize) -> Vec<bool> {
    let mut even = vec![false; data.rows.len()];
    for test in data.tests() {
        let own: Vec<usize> = (0..data.rows.len()).filter(|r| data.rows[*r].test == test).collect();
        own.iter().step_by(stride).chain(own.last()).for_each(|r| even[*r] = true);
    }
    even
}

/// Largest less smallest value of each condition, SI.
fn ranges(data: &Data, own: &[usize]) -> Vec<f64> {
    let of = |v: usize| {
        let values = own.iter().map(|r| data.rows[*r].condition.si()[v]);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        high - low
    };
    (0..data.rows[own[0]].condition.si().len()).map(of).collect()
}

/// Keeps the rows between the first and the last of some without which a straight line would miss a condition.
fn keep_turns(data: &Data, rows: &[usize], ranges: &[f64], kept: &mut [bool]) {
    let (first, last) = (&data.rows[rows[0]], &data.rows[rows[rows.len() - 1]]);
    let missed = |(i, r): (usize, &usize)| (i + 1, off(&data.rows[*r], first, last, ranges));
    let inner = rows[1..rows.len().max(2) - 1].iter().enumerate().map(missed);
    let Some((worst, most)) = inner.max_by(|a, b| a.1.total_cmp(&b.1)) else { return };
    if most > BENT {
        kept[rows[worst]] = true;
        keep_turns(data, &rows[..=worst], ranges, kept);
        keep_turns(data, &rows[worst..], ranges, kept);
    }
}

/// Distance of a row's conditions from a straight line between two rows, as the largest share of a range.
fn off(row: &ReadingRow, first: &ReadingRow, last: &ReadingRow, ranges: &[f64]) -> f64 {
    let time = |row: &ReadingRow| row.time.unwrap_or(0.0);
    let share = if time(last) > time(first) { (time(row) - time(first)) / (time(last) - time(first)) } else { 0.0 };
    let of = |(v, range): (usize, &f64)| {
        let at = |row: &ReadingRow| row.condition.si()[v];
        if *range > 0.0 { (at(row) - at(first) - share * (at(last) - at(first))).abs() / range } else { 0.0 }
    };
    ranges.iter().enumerate().map(of).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use coldplate_describe::machine::Condition;

    /// A thousand rows are thinned to a hundred, plus both sides of a step.
    #[test]
    fn steps_stay() {
        let row = |i: usize| ReadingRow {
            test: "a".into(),
            time: Some(i as f64),
            condition: Condition::from_si(vec![if i < 437 { 1.0 } else { 2.0 }]),
            readings: vec![Some(300.0)],
            line: None,
        };
        let rows = (0..1000).map(row).collect();
        let data = Data { source: String::new(), sensors: vec![0], names: vec!["s".into()], rows, ..Data::default() };
        let thin = thinned(&data, 100);
        let times: Vec<f64> = thin.rows.iter().filter_map(|r| r.time).collect();
        assert!((101..105).contains(&times.len()), "{}", times.len());
        assert!([0.0, 436.0, 437.0, 999.0].iter().all(|t| times.contains(t)), "{times:?}");
        assert_eq!(thinned(&data, 2000), data);
        // The row before the step is there for its condition alone.
        let even = thinned_evenly(&data, 100);
        let read: Vec<f64> = even.rows.iter().filter(|r| r.readings[0].is_some()).filter_map(|r| r.time).collect();
        assert!(read.len() == 100 && read.windows(2).all(|w| w[1] - w[0] == 10.0), "{read:?}");
        assert!(even.rows.iter().any(|r| r.time == Some(436.0) && r.readings[0].is_none()));
    }

    /// If a condition turns in every row, all rows drive the machine, and at most twice the readings are compared.
    #[test]
    fn restless_conditions_are_driven_through_and_not_all_compared() {
        let row = |i: usize| ReadingRow {
            test: "a".into(),
            time: Some(i as f64),
            condition: Condition::from_si(vec![f64::from(u8::from(i.is_multiple_of(2)))]),
            readings: vec![Some(300.0), Some(301.0)],
            line: None,
        };
        let names = vec!["s".into(), "t".into()];
        let rows = (0..1000).map(row).collect();
        let data = Data { source: String::new(), sensors: vec![0, 1], names, rows, ..Data::default() };
        let thin = thinned(&data, 200);
        assert_eq!(thin.rows.len(), 1000);
        assert!((200..=402).contains(&thin.count()), "{}", thin.count());
        let conditions = |data: &Data| data.rows.iter().map(|r| r.condition.clone()).collect::<Vec<_>>();
        assert_eq!(conditions(&thin), conditions(&data));
    }
}
