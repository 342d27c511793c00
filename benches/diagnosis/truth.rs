//! What the machine really does: solved otherwise than the model that diagnoses, row by row, with what remembers.

use coldplate_describe::machine::Condition;
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, ReadingRow};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;

use crate::outside::Memory;
use coldplate_testing::twin::Hidden;

/// Parts that the time between two rows of a log is cut into.
const FINE: usize = 2;
/// Error allowed in each time step of a log, K.
const TIME_TOLERANCE: f64 = 2e-3;
/// What all heats are raised by to learn what a factor on them does.
const HEATS: f64 = 0.05;

/// A machine as it is.
pub struct Truth {
    /// Its file on its own mesh.
    pub study: Study,
    /// The conditions it has, at more times than are read.
    pub data: Data,
    /// Rows that are read.
    pub kept: Vec<usize>,
    /// Factor on all heats, row by row.
    pub heats: Option<Vec<f64>>,
}

/// Rows at more times.
pub struct Fine {
    /// All of them.
    pub rows: Vec<ReadingRow>,
    /// Those that were there.
    pub kept: Vec<usize>,
}

/// The time between two rows of a log cut into parts; conditions change in a line, as between rows that are read.
pub fn fine(rows: &[ReadingRow]) -> Fine {
    let (mut all, mut kept): (Vec<ReadingRow>, Vec<usize>) = (Vec::new(), Vec::new());
    for row in rows {
        let before = all.last().filter(|before: &&ReadingRow| before.test == row.test).cloned();
        if let Some((before, from, to)) =
            before.and_then(|before| Some((before.clone(), before.time?, row.time?))).filter(|(_, a, b)| b - a > 2.0)
        {
            all.extend((1..FINE).map(|i| {
                let share = i as f64 / FINE as f64;
                let between = before.condition.si().iter().zip(row.condition.si()).map(|(a, b)| a + share * (b - a));
                ReadingRow { time: Some(from + share * (to - from)), condition: Condition::from_si(between.collect()), ..row.clone() }
            }));
        }
        kept.push(all.len());
        all.push(row.clone());
    }
    Fine { rows: all, kept }
}

impl Truth {
    /// Readings without any error of theirs, K; none where the machine cannot be solved so.
    pub fn values(&self, hidden: &[Hidden], memory: Option<Memory>) -> Option<Vec<f64>> {
        let width = self.data.sensors.len();
        let data = match memory {
            Some(Memory::Lag(lag)) => self.late(lag),
            Some(Memory::Clock(behind)) => self.behind(behind),
            _ => self.data.clone(),
        };
        let lines: Vec<(String, String)> = hidden.iter().flat_map(|h| h.lines.clone()).collect();
        let mut values = self.solved(&lines, &data)?;
        if memory == Some(Memory::Hysteresis) {
            let last = hidden.last()?;
            let rest: Vec<(String, String)> = lines.iter().filter(|line| !last.lines.contains(line)).cloned().collect();
            let without = self.solved(&rest, &data)?;
            for (r, _) in self.stays().into_iter().enumerate().filter(|(_, stays)| !stays) {
                let own = r * width..(r + 1) * width;
                values[own.clone()].copy_from_slice(&without[own]);
            }
        }
        // Rows that were measured before: those that the program never sees come last.
        let before = match memory {
            Some(Memory::From(share)) => {
                let seen = data.rows.iter().filter(|row| !row.test.starts_with("unseen")).count();
                (share * seen as f64).ceil() as usize * width
            }
            _ => 0,
        };
        // A gain or an offset belongs to the sensor: wires are exchanged behind it.
        let (exchanged, own): (Vec<&Hidden>, Vec<&Hidden>) = hidden.iter().partition(|h| h.kind == "swapped sensors");
        own.iter().chain(&exchanged).for_each(|h| {
            h.read(&mut values[before..], width);
            if let (Some((k, lag, _)), "sensor lag") = (h.sensor, h.kind.as_str()) {
                self.follow(&mut values, k, lag);
            }
        });
        Some(self.kept.iter().flat_map(|r| values[r * width..(r + 1) * width].to_vec()).collect())
    }

    /// With heats as they are from test to test.
    fn solved(&self, lines: &[(String, String)], data: &Data) -> Option<Vec<f64>> {
        // What acts on nothing, as radiation from a face that is covered, is drawn anew.
        let study = self.study.edited(lines).ok()?;
        let solve = |study: &Study| identify::values_within(study, data, Start::Steady, TIME_TOLERANCE).ok();
        let values = solve(&study)?;
        let Some(heats) = &self.heats else { return Some(values) };
        let machine = &study.model.machine;
        let mut hotter = Vec::new();
        for source in &machine.sources {
            let p = study.parameter(&format!("source.{}.power", source.name)).ok()?;
            hotter.extend(p.to_set(p.value * (1.0 + HEATS), machine).ok()?);
        }
        let hot = solve(&study.edited(&hotter).ok()?)?;
        let width = data.sensors.len();
        let at = |(i, (v, h)): (usize, (&f64, &f64))| v + (heats[i / width] - 1.0) / HEATS * (h - v);
        Some(values.iter().zip(&hot).enumerate().map(at).collect())
    }

    /// The same conditions with water that follows late.
    fn late(&self, lag: f64) -> Data {
        let mut data = self.data.clone();
        let Some(v) = self.study.model.machine.variables.iter().position(|v| v.name == "coolant_temperature") else { return data };
        let mut shown: Option<(String, f64, f64)> = None;
        for row in &mut data.rows {
            let (time, stated) = (row.time.unwrap_or(0.0), row.condition.si()[v]);
            let value = match &shown {
                Some((test, before, last)) if *test == row.test => stated + (last - stated) * (-(time - before) / lag).exp(),
                _ => stated,
            };
            let mut si = row.condition.si().to_vec();
            si[v] = value;
            row.condition = Condition::from_si(si);
            shown = Some((row.test.clone(), time, value));
        }
        data
    }

    /// Conditions under a logger whose clock is behind by this time, s. Each test begins in its steady state, and the logger shows it for so
    /// long.
    fn behind(&self, behind: f64) -> Data {
        let mut data = self.data.clone();
        for r in 0..data.rows.len() {
            let (test, time) = (&self.data.rows[r].test, self.data.rows[r].time.unwrap_or(0.0) - behind);
            let own = self.data.rows.iter().filter(|row| row.test == *test);
            // The last condition that was there at that time.
            let at = own.clone().take_while(|row| row.time.unwrap_or(0.0) <= time).last().or_else(|| own.clone().next());
            if let Some(at) = at {
                data.rows[r].condition = at.condition.clone();
            }
        }
        data
    }

    /// Rows in which what came with the speed has stayed.
    fn stays(&self) -> Vec<bool> {
        let v = self.study.model.machine.variables.iter().position(|v| v.name == "motor_speed").unwrap_or(0);
        let speeds: Vec<f64> = self.data.rows.iter().map(|row| row.condition.si()[v]).collect();
        let (low, high) = speeds.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), s| (a.min(*s), b.max(*s)));
        let mut is_on = false;
        let next = |speed: &f64| {
            let share = (speed - low) / (high - low).max(1e-9);
            is_on = share > 0.7 || (is_on && share > 0.4);
            is_on
        };
        speeds.iter().map(next).collect()
    }

    /// A sensor that follows with a time constant, s.
    fn follow(&self, values: &mut [f64], k: usize, lag: f64) {
        let width = self.data.sensors.len();
        let mut shown: Option<(String, f64, f64, f64)> = None;
        for (r, row) in self.data.rows.iter().enumerate() {
            let (time, real) = (row.time.unwrap_or(0.0), values[r * width + k]);
            let value = match &shown {
                Some((test, before, was, last)) if *test == row.test => {
                    let middle = 0.5 * (was + real);
                    middle + (last - middle) * (-(time - before) / lag).exp()
                }
                _ => real,
            };
            shown = Some((row.test.clone(), time, real, value));
            values[r * width + k] = value;
        }
    }
}
