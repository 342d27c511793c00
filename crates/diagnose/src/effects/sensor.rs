//! Sensors' own errors: what they make of the readings, with the machine as it is.

use std::collections::{BTreeMap, HashMap};

use super::file::text;
use super::law::{Form, nine_digits};
use super::words::Quantity;
use super::{Family, Hypothesis, Law, Linearised, Lines, MachineEdit, Scales, Site, Told};
use coldplate_describe::machine::{Machine, SensorResponse, ShownTemperature};
use coldplate_base::error::Result;
use coldplate_evidence::measurement::{Data, whiten};
use coldplate_base::document::{Document, Leaf, quoted};
use coldplate_solve::sensitivity::Disturbance;
use coldplate_solve::study::Study;
use coldplate_base::units::Measurand;

/// Errors of sensors, by their columns in the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Sensor {
    /// Offset, K.
    Offset(usize),
    /// Gain, relative, counted from 20 degC.
    Gain(usize),
    /// Share of the temperature of the surroundings in what it shows: a sensor that is badly attached.
    Surroundings(usize),
    /// Time constant, s; logs only.
    Lag(usize),
    /// Offset of all of them, K: the scanner.
    All,
    /// Two sensors swapped. A swap has no amplitude: it counts as 1.
    Swap(usize, usize),
}

impl Family for Sensor {
    fn candidates(site: &Site<'_>) -> Vec<Hypothesis> {
        let (names, none, prior) = (&site.data.names, Vec::new, &site.machine.priors);
        let mut found = Vec::new();
        // Of displacements the machine is asked, not their probes: what these are off by is stated with the data.
        let is_temperature = |k: usize| site.machine.sensors[site.data.sensors[k]].measurand() == Measurand::Temperature;
        let thermometers: Vec<(usize, &String)> = names.iter().enumerate().filter(|(k, _)| is_temperature(*k)).collect();
        if names.len() > 1 && thermometers.len() == names.len() {
            found.push(Hypothesis::signed(Self::All, "all sensors", none(), prior.sensor_offset, "K"));
        }
        for (at, (k, name)) in thermometers.iter().copied().enumerate() {
            found.push(Hypothesis::signed(Self::Offset(k), name, none(), prior.sensor_offset, "K"));
            if site.data.rows.len() > 1 {
                found.push(Hypothesis::signed(Self::Gain(k), name, none(), prior.sensor_gain, "relative").under(Law::Temperature));
                found.push(Hypothesis::positive(Self::Surroundings(k), name, none(), prior.sensor_surroundings, "share"));
            }
            if site.data.is_transient() {
                found.push(Hypothesis::positive(Self::Lag(k), name, none(), prior.sensor_lag, "s"));
            }
            for (j, other) in thermometers.iter().copied().skip(at + 1) {
                found.push(Hypothesis::signed(Self::Swap(k, j), format!("{name} - {other}"), none(), 1.0, ""));
            }
        }
        found
    }

    fn kind(&self) -> &'static str {
        match self {
            Self::Offset(_) => "sensor offset",
            Self::Gain(_) => "sensor gain",
            Self::Surroundings(_) => "badly attached sensor",
            Self::Lag(_) => "sensor lag",
            Self::All => "all sensors",
            Self::Swap(..) => "swapped sensors",
        }
    }

    /// Nothing changes in the machine: what its sensors show of it is read after it is solved. [`Sensor::written`] has the lines
    /// for a machine file of its own.
    fn lines(&self, _edit: &MachineEdit<'_>) -> Result<Lines> {
        Ok(Some(Vec::new()))
    }

    fn disturbance(&self, _at: &Linearised<'_, '_>) -> Option<Disturbance> {
        None
    }

    fn says_when(&self) -> bool {
        matches!(self, Self::Offset(_) | Self::Gain(_) | Self::Surroundings(_) | Self::All)
    }

    fn quantity(&self, _law: Law) -> Quantity {
        match self {
            Self::Offset(_) | Self::All => Quantity::plain("offset", "K"),
            Self::Gain(_) => Quantity::grown("factor"),
            Self::Lag(_) => Quantity::plain("time_constant", "s"),
            Self::Surroundings(_) | Self::Swap(..) => Quantity::plain("share", "1"),
        }
    }

    fn sentence(&self, told: &Told<'_>) -> String {
        let (place, law) = (told.place(), told.when());
        match self {
            Self::Offset(_) => format!("the sensor {place} reads too high by {}{law}", told.range(" K")),
            Self::Gain(_) => format!("the sensor {place} has a gain of {}{law}", told.range("")),
            Self::Surroundings(_) => {
                format!("the sensor {place} is badly attached: {} of what it shows is the temperature of the surroundings{law}", told.range(""))
            }
            Self::Lag(_) => format!("the sensor {place} lags by {}", told.range(" s")),
            Self::All => format!("all sensors read too high by {}: the scanner{law}", told.range(" K")),
            Self::Swap(..) => format!("the sensors {} are exchanged", told.both_places()),
        }
    }
}

impl Sensor {
    /// The same error where columns are numbered otherwise.
    pub fn renumbered(self, to: impl Fn(usize) -> usize) -> Self {
        match self {
            Self::Offset(k) => Self::Offset(to(k)),
            Self::Gain(k) => Self::Gain(to(k)),
            Self::Surroundings(k) => Self::Surroundings(to(k)),
            Self::Lag(k) => Self::Lag(to(k)),
            Self::All => Self::All,
            Self::Swap(a, b) => Self::Swap(to(a), to(b)),
        }
    }

    /// For swapped sensors: at each of some readings, given by row and sensor, the one that belongs there.
    pub(crate) fn relabelled(self, places: &[(usize, usize)]) -> Option<Vec<usize>> {
        let Self::Swap(a, b) = self else { return None };
        let position: HashMap<&(usize, usize), usize> = places.iter().enumerate().map(|(i, place)| (place, i)).collect();
        let of = |(i, (r, k)): (usize, &(usize, usize))| {
            let other = match *k {
                k if k == a => b,
                k if k == b => a,
                _ => return i,
            };
            position.get(&(*r, other)).copied().unwrap_or(i)
        };
        Some(places.iter().enumerate().map(of).collect())
    }

    /// The lines of a machine file whose sensor has this error beside its own, (key, TOML value); `None` where exchanged sensors have no
    /// entries that could change places.
    ///
    /// # Errors
    /// An entry cannot be read.
    pub fn written(self, study: &Study, data: &Data, amplitude: f64) -> Result<Lines> {
        let name = |k: usize| data.names[k].as_str();
        match self {
            Self::Swap(a, b) => exchanged(study.document(), [name(a), name(b)]),
            own => Ok(Some(own.response(&study.model.machine, data, amplitude))),
        }
    }

    /// The lines of the response of a sensor with this error beside its own.
    fn response(self, machine: &Machine, data: &Data, amplitude: f64) -> Vec<(String, String)> {
        let (column, changed): (usize, fn(SensorResponse, f64) -> SensorResponse) = match self {
            Self::Offset(k) => (k, SensorResponse::with_offset),
            Self::Gain(k) => (k, SensorResponse::with_gain),
            Self::Surroundings(k) => (k, SensorResponse::with_surroundings),
            Self::Lag(k) => (k, SensorResponse::with_lag),
            Self::All => return (0..data.names.len()).flat_map(|k| Self::Offset(k).response(machine, data, amplitude)).collect(),
            Self::Swap(..) => return Vec::new(),
        };
        let before = machine.sensors[data.sensors[column]].shows;
        let after = changed(before, amplitude);
        let numbers = [
            ("surroundings_share", before.surroundings, after.surroundings, ""),
            ("lag", before.lag, after.lag, " s"),
            ("offset", before.offset, after.offset, " K"),
            ("gain", before.gain, after.gain, ""),
        ];
        let line = |(key, _, now, unit): (&str, f64, f64, &str)| {
            let number = format!("{:?}", nine_digits(now));
            let value = if unit.is_empty() { number } else { text(format!("{number}{unit}")) };
            (format!("sensor.{}.{key}", quoted(&data.names[column])), value)
        };
        numbers.into_iter().filter(|(_, before, now, _)| before != now).map(line).collect()
    }

    /// What it makes of predicted readings (rows, then sensors), K, under a law.
    pub fn read(self, (law, machine): ((Law, &Scales), &Machine), data: &Data, predicted: &[f64], amplitude: f64) -> Vec<f64> {
        let places = whiten::places(data);
        let now = at_rows(law, data, amplitude);
        let mut found = predicted.to_vec();
        let own = |k: usize| places.iter().enumerate().filter(move |(_, (_, sensor))| *sensor == k);
        match self {
            Self::Offset(k) => own(k).for_each(|(i, (r, _))| found[i] += now[*r]),
            Self::All => found.iter_mut().zip(&places).for_each(|(value, (r, _))| *value += now[*r]),
            Self::Gain(k) => own(k).for_each(|(i, (r, _))| found[i] = SensorResponse::default().with_gain(now[*r]).settled(found[i], 0.0)),
            // Every condition of the data has been solved: its surroundings have a temperature.
            Self::Surroundings(k) => own(k).for_each(|(i, (r, _))| {
                let around = machine.surroundings(&data.rows[*r].condition).unwrap_or(found[i]);
                found[i] += now[*r] * (around - found[i]);
            }),
            Self::Swap(..) => {
                let others = self.relabelled(&places).unwrap_or_default();
                let moved = others.iter().zip(&places).enumerate();
                moved.for_each(|(i, (other, (r, _)))| found[i] += now[*r] * (predicted[*other] - predicted[i]));
            }
            Self::Lag(k) => {
                // First-order lag behind the predicted course, which runs straight between the rows of each test.
                let mut last: BTreeMap<&str, ShownTemperature> = BTreeMap::new();
                for (i, (r, _)) in own(k) {
                    let row = &data.rows[*r];
                    let (time, told) = (row.time.unwrap_or(0.0), predicted[i]);
                    let before = last.get(row.test.as_str());
                    let now = before.map_or(ShownTemperature::settled(time, told), |before| before.followed(time, told, amplitude));
                    last.insert(&row.test, now);
                    found[i] = now.shown;
                }
            }
        }
        found
    }
}

/// Lines by which the entries of two sensors change places, and their names in the limits, which are about places and not about wires.
fn exchanged(document: &Document, names: [&str; 2]) -> Result<Lines> {
    let keys = names.map(|name| format!("sensor.{}", quoted(name)));
    let (Some(first), Some(second)) = (document.leaf(&keys[0])?, document.leaf(&keys[1])?) else { return Ok(None) };
    let [to_second, to_first] = keys;
    let mut lines = vec![(to_second, second.to_toml()), (to_first, first.to_toml())];
    for key in document.keys().into_iter().filter(|key| key.starts_with("limit.")) {
        let Some(now) = document.leaf(&key)? else { continue };
        let renamed = renamed(&now, names);
        if renamed != now {
            lines.push((key, renamed.to_toml()));
        }
    }
    Ok(Some(lines))
}

/// A value with two names exchanged.
fn renamed(leaf: &Leaf, [a, b]: [&str; 2]) -> Leaf {
    match leaf {
        Leaf::Text(text) if text == a => Leaf::Text(b.into()),
        Leaf::Text(text) if text == b => Leaf::Text(a.into()),
        Leaf::List(items) => Leaf::List(items.iter().map(|item| renamed(item, [a, b])).collect()),
        other => other.clone(),
    }
}

/// An amplitude at every row.
fn at_rows((law, scales): (Law, &Scales), data: &Data, amplitude: f64) -> Vec<f64> {
    let factors = if let Law::Of(v, Form::Course) = law {
        data.rows.iter().map(|row| row.condition.si()[v]).collect()
    } else if let Law::Of(_, Form::Passed | Form::After(_)) = law {
        let times = || data.rows.iter().map(|row| row.time.unwrap_or(0.0));
        let (first, last) = times().fold((f64::INFINITY, f64::NEG_INFINITY), |(first, last), t| (first.min(t), last.max(t)));
        times().map(|time| law.at_share_of_time((time - first) / (last - first).max(f64::MIN_POSITIVE))).collect()
    } else {
        scales.factors(law, &data.rows.iter().map(|row| &row.condition).collect::<Vec<_>>())
    };
    factors.into_iter().map(|factor| amplitude * factor).collect()
}
