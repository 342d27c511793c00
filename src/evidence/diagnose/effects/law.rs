//! How an effect depends on the condition.

use crate::describe::machine::{Condition, Machine, Variable};
use crate::evidence::measurement::Data;
use crate::foundation::numbers::significant;
use crate::units;

/// How an effect depends on the condition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Law {
    /// Not at all.
    Constant,
    /// In proportion to the motor speed.
    Speed,
    /// With the square of the motor speed.
    SpeedSquared,
    /// In proportion to one over the coolant flow.
    InverseFlow,
    /// In proportion to the temperature above 20 degC.
    Temperature,
    /// By a variable of the machine (an index into its variables).
    Of(usize, Form),
}

/// How an effect depends on one variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Form {
    /// In proportion to it.
    Proportional,
    /// With its square.
    Squared,
    /// In proportion to one over it.
    Inverse,
    /// Only above a threshold, which lies between this one of its levels in the data and the next.
    Above(usize),
}

impl Law {
    /// In words; what a variable of the machine does is told by [`Scales::words`].
    pub fn words(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Speed => "in proportion to the motor speed",
            Self::SpeedSquared => "with the square of the motor speed",
            Self::InverseFlow => "in proportion to one over the coolant flow",
            Self::Temperature => "in proportion to the temperature",
            Self::Of(..) => "with a variable of the machine",
        }
    }
}

/// Where laws are one: largest motor speed and median coolant flow of the data, SI; and every variable's own scales.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scales {
    /// rad/s
    pub speed: f64,
    /// m³/s
    pub flow: f64,
    speed_at: Option<usize>,
    flow_at: Option<usize>,
    variables: Vec<VariableScale>,
}

/// A variable in the data, in the unit that expressions have it in.
#[derive(Debug, Clone, PartialEq)]
struct VariableScale {
    /// Its name for readers.
    shown: String,
    /// Its name in expressions.
    name: String,
    unit: String,
    /// SI per unit; temperatures are in kelvin.
    per_unit: f64,
    /// Distinct values in the data, rising.
    levels: Vec<f64>,
    /// How many rows are at each of them.
    rows: Vec<usize>,
    /// The middle one of all values.
    median: f64,
}

impl VariableScale {
    fn of(variable: &Variable, si: impl Iterator<Item = f64>) -> Self {
        let (name, unit) = variable.in_expressions();
        let per_unit = if variable.dimension.is_absolute() { 1.0 } else { units::convert(1.0, &unit, variable.dimension).unwrap_or(1.0) };
        let mut values: Vec<f64> = si.map(|si| si / per_unit).collect();
        values.sort_by(f64::total_cmp);
        let median = values.get(values.len() / 2).copied().unwrap_or(0.0);
        let alike = LEVEL * values.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        let (mut levels, mut rows): (Vec<f64>, Vec<usize>) = (Vec::new(), Vec::new());
        for value in values {
            match (levels.last(), rows.last_mut()) {
                (Some(level), Some(count)) if value - level <= alike => *count += 1,
                _ => {
                    levels.push(value);
                    rows.push(1);
                }
            }
        }
        Self { shown: variable.name.replace('_', " "), name, unit, per_unit, levels, rows, median }
    }

    fn largest(&self) -> f64 {
        let largest = self.levels.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        if largest > 0.0 { nine_digits(largest) } else { 1.0 }
    }

    fn unit_after(&self) -> String {
        if self.unit == "1" { String::new() } else { format!(" {}", self.unit) }
    }

    fn varies(&self) -> bool {
        self.levels.last().zip(self.levels.first()).is_some_and(|(last, first)| last - first > VARIES * self.largest())
    }

    /// Half way between a level and the next.
    fn threshold(&self, level: usize) -> f64 {
        nine_digits(0.5 * (self.levels[level] + self.levels[level + 1]))
    }

    /// Laws that the data can show.
    fn forms(&self, is_own: bool) -> Vec<Form> {
        let n = self.levels.len();
        let mut forms = Vec::new();
        if is_own {
            forms.extend([Form::Proportional, Form::Squared]);
            if self.levels[0] > VARIES * self.largest() {
                forms.push(Form::Inverse);
            }
        }
        // Of nothing and one level, what is above the threshold is in proportion too.
        if (3..=MOST_LEVELS).contains(&n) {
            // What acts in one row alone, or in all but one, may as well be that row.
            let is_shown = |level: &usize| {
                let below: usize = self.rows[..=*level].iter().sum();
                below >= LEAST_ROWS && self.rows.iter().sum::<usize>() >= below + LEAST_ROWS
            };
            forms.extend((0..n - 1).filter(is_shown).map(Form::Above));
        }
        forms
    }
}

/// Values this near, as a share of the largest, are one level.
const LEVEL: f64 = 5e-3;
/// A variable varies that changes by more than this share of its largest value.
const VARIES: f64 = 0.02;
/// Thresholds are looked for between no more levels than these.
const MOST_LEVELS: usize = 6;
/// Rows on either side of a threshold, at least.
const LEAST_ROWS: usize = 2;
/// Width of a threshold as written, as a share of the step between two levels.
const SHARP: f64 = 1e-3;
/// Variables of every machine.
const FOUR: [&str; 4] = ["coolant_flow", "coolant_temperature", "motor_speed", "ambient_temperature"];

impl Scales {
    /// Of a data set.
    pub fn of(data: &Data, machine: &Machine) -> Self {
        let at = |name: &str| machine.variables.iter().position(|v| v.name == name);
        let (speed_at, flow_at) = (at("motor_speed"), at("coolant_flow"));
        let values = |v: usize| data.rows.iter().map(move |r| r.condition.si()[v]);
        let variables: Vec<VariableScale> =
            machine.variables.iter().enumerate().map(|(v, variable)| VariableScale::of(variable, values(v))).collect();
        let speed = speed_at.map_or(0.0, |v| values(v).fold(0.0f64, |m, v| m.max(v.abs())));
        let mut flows: Vec<f64> = flow_at.map_or(Vec::new(), |v| values(v).collect());
        flows.sort_by(f64::total_cmp);
        let flow = flows.get(flows.len() / 2).copied().unwrap_or(0.0);
        Self { speed, flow, speed_at, flow_at, variables }
    }

    /// Laws by the machine's own variables that vary in the data, and thresholds in any but temperatures.
    pub fn laws(&self, machine: &Machine) -> Vec<Law> {
        let of = |(v, (variable, own)): (usize, (&Variable, &VariableScale))| -> Vec<Law> {
            if variable.dimension.is_absolute() || !own.varies() {
                return Vec::new();
            }
            own.forms(!FOUR.contains(&variable.name.as_str())).into_iter().map(|form| Law::Of(v, form)).collect()
        };
        machine.variables.iter().zip(&self.variables).enumerate().flat_map(of).collect()
    }

    /// A law in words, its variable by name.
    pub fn words(&self, law: Law) -> String {
        let Law::Of(v, form) = law else { return law.words().into() };
        let own = &self.variables[v];
        let name = own.shown.as_str();
        match form {
            Form::Proportional => format!("in proportion to {name}"),
            Form::Squared => format!("with the square of {name}"),
            Form::Inverse => format!("in proportion to one over {name}"),
            Form::Above(level) => format!("only where {name} is above {}{}", significant(own.threshold(level), 4), own.unit_after()),
        }
    }

    /// Factor of a law at a condition; `None` where the law needs a temperature.
    pub fn factor(&self, law: Law, condition: &Condition) -> f64 {
        let speed = self.speed_at.map_or(0.0, |v| condition.si()[v]) / if self.speed > 0.0 { self.speed } else { 1.0 };
        match law {
            Law::Constant | Law::Temperature => 1.0,
            Law::Speed => speed,
            Law::SpeedSquared => speed * speed,
            Law::InverseFlow => {
                let flow = self.flow_at.map_or(0.0, |v| condition.si()[v]);
                if flow > 0.0 { self.flow / flow } else { 0.0 }
            }
            Law::Of(v, form) => {
                let own = &self.variables[v];
                let value = condition.si()[v] / own.per_unit;
                match form {
                    Form::Proportional => value / own.largest(),
                    Form::Squared => (value / own.largest()).powi(2),
                    Form::Inverse => {
                        if value > 0.0 {
                            nine_digits(own.median) / value
                        } else {
                            0.0
                        }
                    }
                    Form::Above(level) => f64::from(u8::from(value > own.threshold(level))),
                }
            }
        }
    }

    /// The law as an expression of a machine file's formulas.
    pub fn expression(&self, law: Law) -> String {
        let rpm = nine_digits(self.speed * 60.0 / std::f64::consts::TAU);
        match law {
            Law::Constant | Law::Temperature => "1".into(),
            Law::Speed => format!("motor_speed_rpm / {rpm:?}"),
            Law::SpeedSquared => format!("(motor_speed_rpm / {rpm:?})^2"),
            Law::InverseFlow => format!("{:?} / coolant_flow_L_min", nine_digits(self.flow * 60_000.0)),
            Law::Of(v, form) => {
                let own = &self.variables[v];
                let (name, largest) = (&own.name, own.largest());
                match form {
                    Form::Proportional => format!("{name} / {largest:?}"),
                    Form::Squared => format!("({name} / {largest:?})^2"),
                    Form::Inverse => format!("{:?} / {name}", nine_digits(own.median)),
                    Form::Above(level) => {
                        let width = nine_digits(SHARP * (own.levels[level + 1] - own.levels[level]));
                        format!("min(1, max(0, 0.5 + ({name} - {:?}) / {width:?}))", own.threshold(level))
                    }
                }
            }
        }
    }
}

/// A number as a person would write it.
pub fn nine_digits(v: f64) -> f64 {
    format!("{v:.8e}").parse().unwrap_or(v)
}
