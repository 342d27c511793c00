//! Readings that take no part in a fit, so that its predictions can be judged by them.

use std::collections::HashMap;

use super::{Data, ReadingRow, TEST};
use coldplate_base::error::{Error, Result, did_you_mean};

/// Rounds of blocks in which each log is cut, a count. Chosen: a few held-out stretches at different times of the log, each long
/// beside the interval of its rows.
const ROUNDS: usize = 4;

/// Readings to hold out, as [`HoldOut::read`] takes them from text.
#[derive(Debug, Clone, PartialEq)]
pub enum HoldOut {
    /// All readings of a test.
    Test(String),
    /// Last share of the time of each log; of a steady table as large a share of its tests, evenly chosen.
    Share(f64),
    /// Every n-th block of each log, or every n-th test of a steady table.
    Every(usize),
}

impl HoldOut {
    /// Reads `TEST`, `20%` or `every:5`; a test of `data` with this very name comes first.
    ///
    /// # Errors
    /// No such test; a share that leaves nothing on either side; a number of blocks below two.
    pub fn read(text: &str, data: &Data) -> Result<Self> {
        let (tests, text) = (data.tests(), text.trim());
        if tests.iter().any(|test| test == text) {
            return Ok(Self::Test(text.to_string()));
        }
        let wrong = |what: &str, help: &str| Err(Error::input(what).at_key("--hold-out").read(text).help(help));
        if let Some(share) = text.strip_suffix('%') {
            return match share.trim().parse::<f64>() {
                Ok(percent) if percent > 0.0 && percent < 100.0 => Ok(Self::Share(percent / 100.0)),
                _ => wrong("this is no share between 0 and 100 %", "write for example --hold-out 20%"),
            };
        }
        if let Some(count) = text.strip_prefix("every:") {
            return match count.trim().parse::<usize>() {
                Ok(count) if count >= 2 => Ok(Self::Every(count)),
                _ => wrong("this is no whole number of two or more", "write --hold-out every:5 for every fifth block or test"),
            };
        }
        let forms = "a share of the data is --hold-out 20%, every fifth block or test --hold-out every:5";
        let near = did_you_mean(text, tests.iter().map(String::as_str));
        let help =
            near.map_or_else(|| format!("tests here: {}; {forms}", tests.join(", ")), |near| format!("did you mean '{near}'? {forms}"));
        Err(Error::input(format!("there is no test '{text}'")).at_key(TEST).read(text).help(help))
    }

    /// Whether each row is held out, and a sentence on the choice.
    fn rows(&self, data: &Data) -> (Vec<bool>, String) {
        let units = units(data);
        match self {
            Self::Test(name) => (data.rows.iter().map(|row| row.test == *name).collect(), format!("test '{name}'")),
            Self::Share(share) if data.is_transient() => {
                let held = passed(data).into_iter().map(|passed| passed > 1.0 - share);
                (held.collect(), format!("the last {} % of the time of each log", 100.0 * share))
            }
            Self::Every(count) if data.is_transient() => {
                let blocks = count * ROUNDS;
                let block = |passed: f64| ((passed * blocks as f64) as usize).min(blocks - 1);
                let held = passed(data).into_iter().map(|passed| (block(passed) + 1).is_multiple_of(*count));
                (held.collect(), format!("the last of every {count} blocks, {blocks} blocks of equal time in each log"))
            }
            Self::Share(share) => {
                let all = units.len() as f64;
                let count = (share * all).round().max(1.0);
                let chosen: Vec<usize> = (0..count as usize).map(|j| ((j as f64 + 0.5) * all / count) as usize).collect();
                named(data, &units, |unit| chosen.contains(&unit))
            }
            Self::Every(count) => named(data, &units, |unit| (unit + 1).is_multiple_of(*count)),
        }
    }
}

/// Names of what a steady table is divided into: its tests, or the rows of a single test.
fn units(data: &Data) -> Vec<String> {
    let tests = data.tests();
    if tests.len() > 1 { tests } else { (1..=data.rows.len()).map(|row| format!("row {row}")).collect() }
}

/// Rows of the units that are chosen, and their names.
fn named(data: &Data, units: &[String], is_chosen: impl Fn(usize) -> bool) -> (Vec<bool>, String) {
    let is_by_test = data.tests().len() > 1;
    let unit = |r: usize| if is_by_test { units.iter().position(|name| *name == data.rows[r].test).unwrap_or(0) } else { r };
    let names: Vec<String> = (0..units.len()).filter(|u| is_chosen(*u)).map(|u| format!("'{}'", units[u])).collect();
    let what = if is_by_test { "tests" } else { "rows" };
    ((0..data.rows.len()).map(|r| is_chosen(unit(r))).collect(), format!("{what} {}", names.join(", ")))
}

/// Share of the time of its log that has passed at each row, 0 to 1.
fn passed(data: &Data) -> Vec<f64> {
    let mut ends: HashMap<&str, (f64, f64)> = HashMap::new();
    for row in &data.rows {
        let Some(time) = row.time else { continue };
        let own = ends.entry(&row.test).or_insert((time, time));
        *own = (own.0.min(time), own.1.max(time));
    }
    let share = |row: &ReadingRow| {
        let (time, (first, last)) = (row.time?, *ends.get(row.test.as_str())?);
        (last > first).then(|| (time - first) / (last - first))
    };
    data.rows.iter().map(|row| share(row).unwrap_or(0.0)).collect()
}

/// Data divided into readings to fit and readings held out.
#[derive(Debug, Clone)]
pub struct DividedData {
    /// Readings to fit. Rows of a log stay for their conditions.
    pub fitted: Data,
    /// Rows of the data that stay in `fitted`.
    pub kept: Vec<usize>,
    /// Whole tests in which readings are held out: a log runs from its beginning.
    whole: Data,
    /// Whether each row of `whole` is held out.
    rows: Vec<bool>,
    /// Sentence on what is held out.
    pub words: String,
}

impl DividedData {
    /// Data without all readings that `texts` hold out ([`HoldOut::read`]).
    ///
    /// # Errors
    /// Errors of [`HoldOut::read`]; no reading on one of the two sides.
    pub fn held_out(data: &Data, texts: &[String]) -> Result<Self> {
        let mut held = vec![false; data.rows.len()];
        let mut words = Vec::with_capacity(texts.len());
        for text in texts {
            let (rows, said) = HoldOut::read(text, data)?.rows(data);
            held.iter_mut().zip(rows).for_each(|(held, own)| *held |= own);
            words.push(said);
        }
        let divided = Self::of(data, &held, &words.join("; "));
        let side = if divided.fitted.count() == 0 { "to fit" } else { "held out" };
        if divided.fitted.count() == 0 || divided.data().count() == 0 {
            let error = Error::input(format!("no reading is left {side}")).at_key("--hold-out").read(texts.join(", "));
            return Err(error.help(format!("the data have {} readings of {} tests", data.count(), data.tests().len())));
        }
        Ok(divided)
    }

    /// Data of some tests alone; all others are held out.
    ///
    /// # Errors
    /// Errors of [`Data::split`].
    pub fn using(data: &Data, tests: &[String]) -> Result<Self> {
        data.split(tests)?;
        let held: Vec<bool> = data.rows.iter().map(|row| !tests.contains(&row.test)).collect();
        Ok(Self::of(data, &held, "the tests that are not used"))
    }

    fn of(data: &Data, held: &[bool], what: &str) -> Self {
        let of_tests = |keep: bool| -> Vec<String> {
            let mut tests: Vec<String> = Vec::new();
            for (row, held) in data.rows.iter().zip(held) {
                if *held == keep && row.readings.iter().any(Option::is_some) && !tests.contains(&row.test) {
                    tests.push(row.test.clone());
                }
            }
            tests
        };
        let (fitted, whole) = (of_tests(false), of_tests(true));
        let is_whole = |r: &usize| whole.contains(&data.rows[*r].test);
        let rows: Vec<bool> = (0..data.rows.len()).filter(is_whole).map(|r| held[r]).collect();
        let whole = only(data, is_whole);
        let is_kept = |r: &usize| fitted.contains(&data.rows[*r].test) && (data.is_transient() || !held[*r]);
        let kept = (0..data.rows.len()).filter(is_kept).collect();
        let fitted = only(&blanked(data, held, true), is_kept);
        let mut divided = Self { fitted, kept, whole, rows, words: String::new() };
        let count = divided.data().count();
        divided.words = format!("held out of the fit: {count} of {} readings, {what}", data.count());
        [&mut divided.fitted, &mut divided.whole].into_iter().for_each(|data| data.notes.push(divided.words.clone()));
        divided
    }

    /// Readings that are held out, among all rows of their tests.
    pub fn data(&self) -> Data {
        blanked(&self.whole, &self.rows, false)
    }

    /// Predictions of the readings that are held out, from a function that predicts all readings of their tests: a log may begin from
    /// readings that are fitted.
    ///
    /// # Errors
    /// Errors of `predict`.
    pub fn predicted(&self, predict: impl FnOnce(&Data) -> Result<Vec<f64>>) -> Result<Vec<f64>> {
        let all = predict(&self.whole)?;
        Ok(super::whiten::places(&self.whole).into_iter().zip(all).filter(|((r, _), _)| self.rows[*r]).map(|(_, told)| told).collect())
    }
}

/// Data with empty cells in the rows that are marked so.
fn blanked(data: &Data, marks: &[bool], mark: bool) -> Data {
    let mut rest = data.clone();
    rest.rows.iter_mut().zip(marks).filter(|(_, own)| **own == mark).for_each(|(row, _)| row.readings.fill(None));
    rest
}

fn only(data: &Data, keep: impl Fn(&usize) -> bool) -> Data {
    Data { rows: (0..data.rows.len()).filter(keep).map(|r| data.rows[r].clone()).collect(), ..data.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use coldplate_describe::machine::Condition;

    fn data(is_log: bool, tests: &[(&str, usize)]) -> Data {
        let rows = tests.iter().flat_map(|(test, rows)| {
            (0..*rows).map(move |r| ReadingRow {
                test: (*test).into(),
                time: is_log.then_some(10.0 * r as f64),
                condition: Condition::from_si(vec![1.0]),
                readings: vec![Some(300.0 + r as f64)],
                line: None,
            })
        });
        Data { sensors: vec![0], names: vec!["s".into()], rows: rows.collect(), ..Data::default() }
    }

    fn held(data: &Data, text: &str) -> Vec<usize> {
        let divided = DividedData::held_out(data, &[text.to_string()]).unwrap();
        let (rest, held) = (divided.fitted.count(), divided.data().count());
        assert_eq!(rest + held, data.count());
        let numbered = divided.predicted(|whole| Ok((0..whole.count()).map(|n| n as f64).collect())).unwrap();
        numbered.into_iter().map(|n| n as usize).collect()
    }

    #[test]
    fn every_form_divides_logs_and_tables() {
        let log = data(true, &[("log", 21)]);
        assert_eq!(held(&log, "20%"), [17, 18, 19, 20]);
        assert_eq!(held(&log, "every:5"), [4, 9, 14, 19, 20]);
        let two = data(true, &[("a", 5), ("b", 5)]);
        assert_eq!(held(&two, "b"), [0, 1, 2, 3, 4]);
        assert_eq!(held(&two, "40 %"), [3, 4, 8, 9]);
        let steady = data(false, &[("a", 1), ("b", 1), ("c", 2), ("d", 1), ("e", 1)]);
        assert_eq!(held(&steady, "20%"), [0, 1]);
        assert_eq!(held(&steady, "every:5"), [0]);
        assert_eq!(held(&data(false, &[("one", 10)]), "20%"), [2, 7]);
        // A test of this very name comes first.
        assert_eq!(held(&data(false, &[("a", 3), ("20%", 1)]), "20%"), [0]);
        for (text, needle) in [("c", "every:5"), ("0%", "no share"), ("every:1", "two or more"), ("all %", "no share")] {
            let message = DividedData::held_out(&two, &[text.to_string()]).unwrap_err().to_string();
            assert!(message.contains(needle), "{text}: {message}");
        }
        let nothing = DividedData::held_out(&two, &["a".into(), "b".into()]).unwrap_err().to_string();
        assert!(nothing.contains("no reading is left to fit"), "{nothing}");
    }
}
