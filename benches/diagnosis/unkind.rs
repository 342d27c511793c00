//! What reality does beside the effect that is looked for, and no file states.

use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_evidence::measurement::Data;
use serde::{Deserialize, Serialize};

use crate::machines::Setting;
use coldplate_testing::twin::{Hidden, between};

/// What makes a case unkind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Unkindness {
    /// The truth is made on a mesh twice as fine.
    Mesh,
    /// Every size is off by up to 5 %.
    Geometry,
    /// From test to test heats differ by 2 to 5 %, the room by 0.3 K, the supply by 0.2 K.
    Scatter,
    /// Noise and sensors' own errors are twice as large as stated.
    StatedHalf,
    /// They are half as large as stated.
    StatedDouble,
    /// One or two readings are off by 5 to 30 K.
    Outliers,
    /// A sensor shows 0, 85 or 999 degC throughout.
    DeadSensor,
    /// A sensor stays where it was.
    StuckSensor,
    /// One row states another value of one condition than it had.
    WrongValue,
    /// One row states the conditions of another.
    WrongRow,
}

impl Unkindness {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::Mesh,
        Self::Geometry,
        Self::Scatter,
        Self::StatedHalf,
        Self::StatedDouble,
        Self::Outliers,
        Self::DeadSensor,
        Self::StuckSensor,
        Self::WrongValue,
        Self::WrongRow,
    ];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Mesh => "a mesh twice as fine",
            Self::Geometry => "geometry off by up to 5 %",
            Self::Scatter => "scatter from test to test",
            Self::StatedHalf => "noise stated half",
            Self::StatedDouble => "noise stated double",
            Self::Outliers => "one or two outliers",
            Self::DeadSensor => "a dead sensor",
            Self::StuckSensor => "a stuck sensor",
            Self::WrongValue => "a wrong condition in a row",
            Self::WrongRow => "the conditions of another row",
        }
    }

    /// Whether readings or rows are wrong.
    pub fn is_faulty(self) -> bool {
        matches!(self, Self::Outliers | Self::DeadSensor | Self::StuckSensor | Self::WrongValue | Self::WrongRow)
    }

    fn suits(self, setting: &Setting) -> bool {
        match self {
            Self::Mesh => setting.cells.is_some(),
            Self::WrongValue | Self::WrongRow => setting.log.is_none(),
            _ => true,
        }
    }

    /// None to three of them.
    pub fn some(setting: &Setting, random: &mut Random) -> Vec<Self> {
        let count = match random.unit() {
            p if p < 0.15 => 0,
            p if p < 0.55 => 1,
            p if p < 0.85 => 2,
            _ => 3,
        };
        let mut found: Vec<Self> = Vec::new();
        while found.len() < count {
            let one = Self::ALL[random.below(Self::ALL.len())];
            let contradicts = |other: &Self| {
                let pairs = [[Self::StatedHalf, Self::StatedDouble], [Self::WrongValue, Self::WrongRow]];
                *other == one || pairs.iter().any(|pair| pair.contains(other) && pair.contains(&one))
            };
            if one.suits(setting) && !found.iter().any(contradicts) {
                found.push(one);
            }
        }
        found.sort();
        found
    }

    /// Noise that is stated over noise that is.
    pub fn stated(all: &[Self]) -> f64 {
        match () {
            () if all.contains(&Self::StatedHalf) => 0.5,
            () if all.contains(&Self::StatedDouble) => 2.0,
            () => 1.0,
        }
    }

    /// What is wrong with readings and rows; sensors that something is hidden in stay as they are.
    pub fn spoil(self, data: &mut Data, hidden: &[Hidden], random: &mut Random) {
        let used: Vec<usize> = hidden.iter().filter_map(|h| h.sensor).flat_map(|(k, _, j)| [k, j]).collect();
        let free: Vec<usize> = (0..data.sensors.len()).filter(|k| !used.contains(k)).collect();
        let (rows, Some(k)) = (data.rows.len(), free.get(random.below(free.len().max(1)))) else { return };
        match self {
            Self::Outliers => {
                for _ in 0..1 + random.below(2) {
                    let sign = if random.unit() < 0.5 { -1.0 } else { 1.0 };
                    let off = sign * between(random, 5.0, 30.0);
                    data.rows[random.below(rows)].readings[*k].iter_mut().for_each(|t| *t += off);
                }
            }
            Self::DeadSensor => {
                let shown = 273.15 + [0.0, 85.0, 999.0][random.below(3)];
                data.rows.iter_mut().for_each(|row| row.readings[*k] = Some(shown));
            }
            Self::StuckSensor => {
                let from = if data.is_transient() { random.below(rows / 2) } else { 0 };
                let shown = data.rows[from].readings[*k];
                data.rows[from..].iter_mut().for_each(|row| row.readings[*k] = shown);
            }
            Self::WrongValue | Self::WrongRow => {
                let row = random.below(rows);
                let other = data.rows[(row + 1 + random.below(rows - 1)) % rows].condition.si().to_vec();
                let mut own = data.rows[row].condition.si().to_vec();
                let v = random.below(own.len());
                if self == Self::WrongRow {
                    own = other;
                } else {
                    own[v] = other[v];
                }
                data.rows[row].condition = Condition::from_si(own);
            }
            _ => {}
        }
    }
}
