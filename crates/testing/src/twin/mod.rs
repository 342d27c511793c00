//! Twins: data with a hidden effect, made by other means than the model that is to find it.
//!
//! The truth has another mesh, perturbed films, heats and emissivities, and an effect written as lines of a machine file;
//! readings get noise of every kind in the covariance, and some sensors are lost. What was hidden stays here.

pub mod effects;
pub mod score;

use coldplate_base::document::Document;
use coldplate_base::random::Random;
use coldplate_describe::machine::{Condition, DescribedVariable};
use coldplate_diagnose::{Law, Problem, Scales};
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, ReadingRow, VariableUncertainty};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;

use crate::machines::SMALL;

/// An effect that was hidden.
#[derive(Debug, Clone, PartialEq)]
pub struct Hidden {
    /// Kind, in the words of the catalogue; of what the catalogue does not have, the nearest.
    pub kind: String,
    /// Place.
    pub place: String,
    /// How it depends on the condition.
    pub law: Law,
    /// Amplitude in the catalogue's unit, where there is one; with a law, at 2500 rpm.
    pub amplitude: f64,
    /// Lines of the machine file that make it so.
    pub lines: Vec<(String, String)>,
    /// A sensor's own error: which (a column of the data), how much, and with which other it is exchanged.
    pub sensor: Option<(usize, f64, usize)>,
    /// In words, where it is none of the catalogue.
    pub outside: Option<String>,
}

impl Hidden {
    /// A constant effect that lines of the machine file make.
    pub fn new(kind: &str, place: impl Into<String>, amplitude: f64, lines: Vec<(String, String)>) -> Self {
        Self { kind: kind.into(), place: place.into(), law: Law::Constant, amplitude, lines, sensor: None, outside: None }
    }

    /// An error of a sensor; the machine stays as it is.
    pub fn of_sensor(kind: &str, place: impl Into<String>, law: Law, sensor: (usize, f64, usize)) -> Self {
        Self { law, sensor: Some(sensor), ..Self::new(kind, place, sensor.1, Vec::new()) }
    }

    /// The amplitude as the catalogue counts it, whose laws are one at the largest speed of the data.
    pub fn amplitude_in(&self, scales: &Scales) -> f64 {
        let share = scales.speed * 60.0 / std::f64::consts::TAU / 2500.0;
        match self.law {
            Law::Speed => self.amplitude * share,
            Law::SpeedSquared => self.amplitude * share * share,
            _ => self.amplitude,
        }
    }

    /// Adds a sensor's own error to readings, row by row of `width` sensors.
    pub fn read(&self, values: &mut [f64], width: usize) {
        let Some((k, amplitude, other)) = self.sensor else { return };
        for row in values.chunks_mut(width) {
            match self.kind.as_str() {
                "sensor offset" => row[k] += amplitude,
                "sensor gain" => row[k] += amplitude * (row[k] - 293.15),
                "all sensors" => row.iter_mut().for_each(|t| *t += amplitude),
                "swapped sensors" => row.swap(k, other),
                _ => {}
            }
        }
    }
}

/// Families of the quick cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// Nothing is hidden.
    Clean,
    /// One effect.
    One,
}

/// A case: what the program sees, and what was hidden.
pub struct Case {
    /// Machine and data as the program sees them.
    pub problem: Problem,
    /// All that was hidden.
    pub hidden: Vec<Hidden>,
    /// Each effect alone, K, reading by reading of the problem's data.
    pub shifts: Vec<Vec<f64>>,
}

/// Evenly between two numbers.
pub fn between(random: &mut Random, low: f64, high: f64) -> f64 {
    low + (high - low) * random.unit()
}

/// One of a list that is not empty.
pub fn choose<'a, T>(random: &mut Random, list: &'a [T]) -> &'a T {
    &list[((random.unit() * list.len() as f64) as usize).min(list.len() - 1)]
}

/// Uncertainty that makers state of the conditions of tests in such a laboratory.
pub fn stated(variable: &DescribedVariable) -> VariableUncertainty {
    match variable.name.as_str() {
        "coolant_temperature" => VariableUncertainty { absolute: 0.06, relative: 0.0 },
        "coolant_flow" => VariableUncertainty { absolute: 0.0, relative: 0.015 },
        "ambient_temperature" => VariableUncertainty { absolute: 0.15, relative: 0.0 },
        "motor_speed" => VariableUncertainty { absolute: 0.0, relative: 0.001 },
        _ => VariableUncertainty::default(),
    }
}

/// Makes a case on the small machine; the same seed makes the same case.
pub fn case(seed: u64, family: Family) -> Case {
    let mut random = Random::new(seed.wrapping_mul(7919).wrapping_add(13));
    let document = || Document::parse(SMALL, "small.toml").unwrap();
    let study = Study::new(document(), Some(600)).unwrap();
    // Conditions: 4 to 40, anywhere in the ranges.
    let count = (4.0 * 10f64.powf(random.unit())).round() as usize;
    let variables = &study.model.machine.variables;
    let anywhere = |random: &mut Random, v: &DescribedVariable| match v.range {
        Some((low, high)) => between(random, low, high),
        None => v.default.unwrap_or(0.0),
    };
    let conditions: Vec<Condition> =
        (0..count).map(|_| Condition::from_si(variables.iter().map(|v| anywhere(&mut random, v)).collect())).collect();
    // Sensors: some are lost.
    let all = study.model.machine.sensors.len();
    let mut sensors: Vec<usize> = (0..all).filter(|_| random.unit() > 0.12).collect();
    if sensors.len() < 3 {
        sensors = (0..all).collect();
    }
    let noise = between(&mut random, 0.03, 0.1);
    let bias = between(&mut random, 0.03, 0.1);
    let uncertainty = MeasurementUncertainty {
        noise: vec![noise; sensors.len()],
        bias: vec![bias; sensors.len()],
        variables: variables.iter().map(stated).collect(),
        model: 0.0,
        timing: 0.0,
        file: None,
    };
    // The truth: another mesh, other films, heats, emissivities.
    let mut truth = document();
    for (key, value) in perturbed(&study, &mut random) {
        truth.apply_set(&key, &value).unwrap();
    }
    let truth = Study::new(truth, Some(between(&mut random, 900.0, 1600.0) as usize)).unwrap();
    let row = |(i, condition): (usize, &Condition)| {
        let real = condition.si().iter().zip(uncertainty.at(condition)).map(|(v, d)| v + d * random.normal()).collect();
        ReadingRow {
            test: format!("test {}", i + 1),
            time: None,
            condition: Condition::from_si(real),
            readings: vec![Some(300.0); sensors.len()],
            line: None,
        }
    };
    let rows = conditions.iter().enumerate().map(row).collect();
    let names: Vec<String> = sensors.iter().map(|s| study.model.machine.sensors[*s].name.clone()).collect();
    let mut data = Data { source: "a twin".into(), sensors: sensors.clone(), names, rows, ..Data::default() };
    let with = |hidden: &[Hidden]| -> Option<Vec<f64>> {
        let lines: Vec<(String, String)> = hidden.iter().flat_map(|h| h.lines.clone()).collect();
        let affected = truth.edited(&lines).unwrap_or_else(|e| panic!("{hidden:?}: {e}"));
        let mut values = identify::values(&affected, &data, Start::Steady).ok()?;
        hidden.iter().for_each(|h| h.read(&mut values, sensors.len()));
        Some(values)
    };
    let clean = with(&[]).expect("the machine as it is");
    let (hidden, values) = loop {
        let hidden = match family {
            Family::Clean => Vec::new(),
            Family::One => vec![effects::effect(&truth, &sensors, effects::STEADY, &mut random)],
        };
        // Drawn again where the machine cannot be solved with it.
        if let Some(values) = with(&hidden) {
            break (hidden, values);
        }
    };
    let shifts = hidden.iter().map(|_| values.iter().zip(&clean).map(|(a, b)| a - b).collect()).collect();
    let errors: Vec<f64> = sensors.iter().map(|_| bias * random.normal()).collect();
    for (r, row) in data.rows.iter_mut().enumerate() {
        row.condition = conditions[r].clone();
        for k in 0..sensors.len() {
            row.readings[k] = Some(values[r * sensors.len() + k] + errors[k] + noise * random.normal());
        }
    }
    let mut problem = Problem::new(study, data);
    (problem.uncertainty, problem.seed) = (uncertainty, seed);
    Case { problem, hidden, shifts }
}

/// Films, heats and emissivities a little off, each by a common factor.
pub fn perturbed(study: &Study, random: &mut Random) -> Vec<(String, String)> {
    let mut lines = Vec::new();
    let machine = &study.model.machine;
    let films = 1.0 + 0.05 * random.normal();
    for channel in &machine.channels {
        if let Ok(p) = study.parameter(&format!("channel.{}.film_factor", channel.name)) {
            lines.extend(p.to_set(p.value * films, machine).unwrap());
        }
    }
    let heats = 1.0 + 0.01 * random.normal();
    for source in &machine.sources {
        if let Ok(p) = study.parameter(&format!("source.{}.power", source.name)) {
            lines.extend(p.to_set(p.value * heats, machine).unwrap());
        }
    }
    let emissivities = (1.0 + 0.07 * random.normal()).clamp(0.8, 1.2);
    let own = machine.parts.iter().flat_map(|p| ["effective_emissivity", "emissivity"].map(|key| format!("part.{}.surface.{key}", p.name)));
    for key in own.chain(["surfaces.effective_emissivity".to_string()]) {
        // Only where the file has the number itself: some parts name a surface, most have the common one.
        if matches!(study.document().leaf(&key), Ok(Some(_)))
            && let Ok(p) = study.parameter(&key)
        {
            lines.extend(p.to_set((p.value * emissivities).min(1.0), machine).unwrap());
        }
    }
    lines
}
