//! How an effect depends on the condition.

use crate::describe::machine::{Condition, Machine, Variable};
use crate::evidence::measurement::{Data, TIME};
use crate::foundation::numbers::{TWO_SIDED_90, significant};
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
    /// With a power of it that is found from the data, in hundredths.
    Power(u16),
    /// Of the time: in proportion to what has passed since the first row.
    Passed,
    /// Of the time: only after an instant that is found from the data, in ten-thousandths of what passes from the first row to the last.
    After(u16),
}

/// Exponents that are looked for, all of them alike before the data are seen.
const EXPONENTS: std::ops::RangeInclusive<u16> = 25..=400;
/// Between those that are tried first.
const EXPONENTS_APART: u16 = 25;
/// Hundredths of an exponent of one.
const HUNDREDTHS: f64 = 100.0;
/// Instants of a log that are tried first, and parts of its time that they are counted in.
const INSTANTS: u16 = 15;
const PARTS: u16 = 10_000;
/// Time over which a cause sets in, as a share of all.
const ONSET: f64 = 5e-3;
/// Where roots are cut off, as a share of the largest value.
const NOTHING: f64 = 1e-12;
/// No exponent is known better than by this many hundredths, and no instant than by this share of the time a cause sets in over.
const FINEST: f64 = 1.0;
const FINEST_ONSET: f64 = 0.25;

impl Form {
    /// The number that is found from the data, as it is counted.
    pub fn number(self) -> Option<f64> {
        match self {
            Self::Power(n) | Self::After(n) => Some(f64::from(n)),
            _ => None,
        }
    }

    /// The same form with another number.
    pub fn with_number(self, number: f64) -> Self {
        let within = |least: u16, most: u16| number.round().clamp(f64::from(least), f64::from(most)) as u16;
        match self {
            Self::Power(_) => Self::Power(within(*EXPONENTS.start(), *EXPONENTS.end())),
            Self::After(_) => Self::After(within(0, PARTS)),
            other => other,
        }
    }
}

/// The number of a law that was found from the data.
#[derive(Debug, Clone, PartialEq)]
pub struct LawNumber {
    /// What it is: `exponent` or `time`.
    pub name: &'static str,
    /// Best value.
    pub value: f64,
    /// Low end of its 90 % interval.
    pub low: f64,
    /// High end.
    pub high: f64,
    /// Unit; `1` for exponents.
    pub unit: &'static str,
    /// Share of all values it could have that the data leave open: what it costs to have chosen it.
    pub share: f64,
    /// Its standard deviation, as the law counts it.
    pub deviation: f64,
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

    /// Whether it has a number that is found from the data.
    pub fn is_free(self) -> bool {
        matches!(self, Self::Of(_, form) if form.number().is_some())
    }

    /// Whether it is one of the time.
    pub fn is_of_time(self) -> bool {
        matches!(self, Self::Of(_, Form::Passed | Form::After(_)))
    }

    /// Factor of a law of the time, at a share of all the time of the data; one for other laws.
    pub fn at_share_of_time(self, share: f64) -> f64 {
        match self {
            Self::Of(_, Form::Passed) => share,
            Self::Of(_, Form::After(n)) => (0.5 + (share - f64::from(n) / f64::from(PARTS)) / ONSET).clamp(0.0, 1.0),
            _ => 1.0,
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
    time_at: Option<usize>,
    variables: Vec<VariableScale>,
}

/// A variable in the data, in the unit that expressions have it in.
#[derive(Debug, Clone, PartialEq)]
struct VariableScale {
    /// Its name for readers.
    shown: String,
    /// Its name in the machine file.
    plain: String,
    /// Its name in expressions.
    name: String,
    unit: String,
    /// SI per unit; temperatures are in kelvin.
    per_unit: f64,
    /// Least and largest value in the data.
    least: f64,
    most: f64,
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
        let (least, most) = (values.first().copied().unwrap_or(0.0), values.last().copied().unwrap_or(0.0));
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
        Self {
            shown: variable.name.replace('_', " "),
            plain: variable.name.clone(),
            name,
            unit,
            per_unit,
            least,
            most,
            levels,
            rows,
            median,
        }
    }

    fn largest(&self) -> f64 {
        let largest = self.levels.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        if largest > 0.0 { nine_digits(largest) } else { 1.0 }
    }

    /// From the least value to the largest.
    fn span(&self) -> f64 {
        self.most - self.least
    }

    /// Of a time: the value at so many ten-thousandths of the span.
    fn instant(&self, parts: f64) -> f64 {
        self.least + self.span() * parts / f64::from(PARTS)
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
        let time_at = at(TIME).filter(|_| data.is_transient());
        let values = |v: usize| data.rows.iter().map(move |r| r.condition.si()[v]);
        let variables: Vec<VariableScale> =
            machine.variables.iter().enumerate().map(|(v, variable)| VariableScale::of(variable, values(v))).collect();
        let speed = speed_at.map_or(0.0, |v| values(v).fold(0.0f64, |m, v| m.max(v.abs())));
        let mut flows: Vec<f64> = flow_at.map_or(Vec::new(), |v| values(v).collect());
        flows.sort_by(f64::total_cmp);
        let flow = flows.get(flows.len() / 2).copied().unwrap_or(0.0);
        Self { speed, flow, speed_at, flow_at, time_at, variables }
    }

    /// Whether a variable, given by its place among the machine's, is more than one value in the data; one that is nothing throughout does not
    /// vary.
    pub fn varies(&self, variable: usize) -> bool {
        self.variables[variable].varies()
    }

    /// Laws by the machine's own variables that vary in the data, and thresholds in any but temperatures.
    pub fn laws(&self, machine: &Machine) -> Vec<Law> {
        let of = |(v, (variable, own)): (usize, (&Variable, &VariableScale))| -> Vec<Law> {
            if variable.dimension.is_absolute() || !own.varies() || self.time_at == Some(v) {
                return Vec::new();
            }
            own.forms(!FOUR.contains(&variable.name.as_str())).into_iter().map(|form| Law::Of(v, form)).collect()
        };
        machine.variables.iter().zip(&self.variables).enumerate().flat_map(of).collect()
    }

    /// Laws of the time, in logs of a machine whose file declares it; instants on a grid, which stand for those between them.
    pub fn laws_of_time(&self) -> Vec<Law> {
        let Some(time) = self.time_at.filter(|v| self.variables[*v].span() > 0.0) else { return Vec::new() };
        let after = (1..=INSTANTS).map(|n| Form::After(n * (PARTS / (INSTANTS + 1))));
        after.chain([Form::Passed]).map(|form| Law::Of(time, form)).collect()
    }

    /// Powers of the motor speed and of the machine's own variables that vary, on a grid of exponents, which stand for those between
    /// them.
    pub fn powers(&self, machine: &Machine) -> Vec<Law> {
        let has_powers = |(v, (variable, own)): &(usize, (&Variable, &VariableScale))| {
            let is_own = self.speed_at == Some(*v) || !FOUR.contains(&variable.name.as_str());
            is_own && self.time_at != Some(*v) && !variable.dimension.is_absolute() && own.varies() && own.least >= 0.0
        };
        let of = |(v, _)| EXPONENTS.step_by(EXPONENTS_APART.into()).map(move |n| Law::Of(v, Form::Power(n)));
        machine.variables.iter().zip(&self.variables).enumerate().filter(has_powers).flat_map(of).collect()
    }

    /// The number of a law that is found from the data, with its standard deviation as it is counted; `None` where the law has none,
    /// or one with a name of its own is as good.
    pub fn number(&self, law: Law, deviation: f64) -> Option<LawNumber> {
        let Law::Of(v, form) = law else { return None };
        let finest = if matches!(form, Form::Power(_)) { FINEST } else { FINEST_ONSET * ONSET * f64::from(PARTS) };
        let (number, deviation) = (form.number()?, deviation.max(finest));
        let (low, high) = (number - TWO_SIDED_90 * deviation, number + TWO_SIDED_90 * deviation);
        let of = |range: f64| ((std::f64::consts::TAU).sqrt() * deviation / range).min(1.0);
        match form {
            Form::Power(_) => {
                let is_named = [0.0, 100.0, 200.0].iter().any(|named| (low..=high).contains(named));
                let found = LawNumber {
                    name: "exponent",
                    value: number / HUNDREDTHS,
                    low: low / HUNDREDTHS,
                    high: high / HUNDREDTHS,
                    unit: "1",
                    share: of(f64::from(EXPONENTS.end() - EXPONENTS.start())),
                    deviation,
                };
                (!is_named).then_some(found)
            }
            _ => {
                let own = &self.variables[v];
                let seconds = |n: f64| own.per_unit * own.instant(n.clamp(0.0, f64::from(PARTS)));
                // From the first row on is always.
                (low > 0.0 && high < f64::from(PARTS)).then(|| LawNumber {
                    name: "time",
                    value: seconds(number),
                    low: seconds(low),
                    high: seconds(high),
                    unit: "s",
                    share: of(f64::from(PARTS)),
                    deviation,
                })
            }
        }
    }

    /// Times, s, at which the laws of some causes turn.
    pub fn turns(&self, laws: impl Iterator<Item = Law>) -> Vec<f64> {
        let of = |law| match law {
            Law::Of(v, Form::After(n)) => {
                let half = 0.5 * ONSET * f64::from(PARTS);
                let own = &self.variables[v];
                vec![own.per_unit * own.instant(f64::from(n) - half), own.per_unit * own.instant(f64::from(n) + half)]
            }
            _ => Vec::new(),
        };
        let mut all: Vec<f64> = laws.flat_map(of).collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }

    /// A law in words, its variable by name.
    pub fn words(&self, law: Law) -> String {
        let Law::Of(v, form) = law else { return law.words().into() };
        let own = &self.variables[v];
        let name = own.shown.as_str();
        let at = |n: f64| format!("{}{}", significant(own.instant(n), 4), own.unit_after());
        match form {
            Form::Power(n) => format!("in proportion to {}^{}", own.plain, f64::from(n) / HUNDREDTHS),
            Form::Passed => format!("in proportion to the time that has passed, this much at {}", at(f64::from(PARTS))),
            Form::After(n) => format!("only after {}", at(f64::from(n))),
            Form::Proportional => format!("in proportion to {name}"),
            Form::Squared => format!("with the square of {name}"),
            Form::Inverse => format!("in proportion to one over {name}"),
            Form::Above(level) => format!("only where {name} is above {}{}", significant(own.threshold(level), 4), own.unit_after()),
        }
    }

    /// The same with the interval of its number.
    pub fn words_with(&self, law: Law, number: &LawNumber) -> String {
        let Law::Of(v, _) = law else { return self.words(law) };
        let per_unit = if number.unit == "s" { self.variables[v].per_unit } else { 1.0 };
        let digits = if number.unit == "s" { 4 } else { 3 };
        let shown = |n: f64| significant(n / per_unit, digits);
        format!("{} ({} to {})", self.words(law), shown(number.low), shown(number.high))
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
                    Form::Power(n) => (value / own.largest()).max(0.0).powf(f64::from(n) / HUNDREDTHS),
                    Form::Passed | Form::After(_) => law.at_share_of_time((value - own.least) / own.span().max(f64::MIN_POSITIVE)),
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
                    Form::Power(n) => {
                        // A root has no slope at nothing.
                        let base = if f64::from(n) < HUNDREDTHS {
                            format!("max({name}, {:?})", nine_digits(NOTHING * largest))
                        } else {
                            name.clone()
                        };
                        format!("({base} / {largest:?})^{:?}", f64::from(n) / HUNDREDTHS)
                    }
                    Form::Passed => format!("({name} - {:?}) / {:?}", nine_digits(own.least), nine_digits(own.span())),
                    Form::After(n) => {
                        let width = nine_digits(ONSET * own.span());
                        format!("min(1, max(0, 0.5 + ({name} - {:?}) / {width:?}))", nine_digits(own.instant(f64::from(n))))
                    }
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
