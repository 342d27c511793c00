//! Laws in numbers: where they are one, which of them data can show, and how they are written.

use super::found::{Axis, FoundLaw};
use super::law::{EXPONENTS, Form, HUNDREDTHS, Law, LawNumber, ONSET, PARTS, nine_digits};
use crate::when::{FALLEN, TEST_NUMBER};
use coldplate_base::condition;
use coldplate_base::numbers::{TWO_SIDED_90, significant};
use coldplate_base::units;
use coldplate_describe::machine::{Condition, DescribedVariable, Machine};
use coldplate_evidence::measurement::{Data, ReadingRow, TIME};

/// Between exponents that are tried first, in hundredths.
const EXPONENTS_APART: u16 = 25;
/// Instants of a log that are tried first.
const INSTANTS: u16 = 15;
/// Where roots are cut off, as a share of the largest value.
const NOTHING: f64 = 1e-12;
/// No exponent is known better than by this many hundredths, and no instant than by this share of the time a cause sets in over.
const FINEST: f64 = 1.0;
const FINEST_ONSET: f64 = 0.25;

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
    counts: Vec<Count>,
    variables: Vec<VariableScale>,
    found: Vec<FoundLaw>,
}

/// A count in the data: the number of the test, or whether a variable has fallen.
#[derive(Debug, Clone, PartialEq)]
struct Count {
    /// The variable that it is.
    variable: usize,
    /// What its number is called.
    name: &'static str,
    /// Its values in the data, rising, with the words for it and how many rows are at each.
    values: Vec<(u16, String, usize)>,
}

impl Count {
    /// The number of the test.
    fn of_tests(variable: usize, data: &Data) -> Option<Self> {
        let of = |name: String| -> Option<(u16, String, usize)> {
            let own = || data.rows.iter().filter(|row| row.test == name);
            let number = own().next()?.condition.si()[variable];
            let is_its = own().all(|row| row.condition.si()[variable] == number);
            let words = format!("'{name}'");
            (is_its && number >= 1.0 && number.fract() == 0.0).then(|| (number as u16, words, own().count()))
        };
        let values = data.tests().into_iter().map(of).collect::<Option<Vec<_>>>()?;
        let is_rising = values.windows(2).all(|pair| pair[0].0 < pair[1].0);
        is_rising.then_some(Self { variable, name: "test", values })
    }

    /// Whether another variable has fallen.
    fn of_falling(variable: usize, of: &str, data: &Data) -> Option<Self> {
        let fallen = |row: &&ReadingRow| row.condition.si()[variable] > 0.5;
        let (falling, all) = (data.rows.iter().filter(fallen).count(), data.rows.len());
        let shown = of.replace('_', " ");
        let values = vec![(0, format!("{shown} has risen"), all - falling), (1, format!("{shown} has fallen"), falling)];
        Some(Self { variable, name: "fallen", values })
    }

    fn words(&self, form: Form) -> String {
        let (Form::At(n) | Form::From(n)) = form else { return String::new() };
        let words = self.values.iter().find(|(number, ..)| *number == n).map_or("", |(_, words, _)| words);
        match (self.name, form) {
            ("test", Form::From(_)) => format!("from the test {words} on"),
            ("test", _) => format!("only in the test {words}"),
            _ => format!("only where {words}"),
        }
    }

    /// Laws that the data can show.
    fn forms(&self) -> Vec<Form> {
        let all: usize = self.values.iter().map(|(.., rows)| rows).sum();
        let is_shown = |rows: usize| rows >= LEAST_ROWS && all >= rows + LEAST_ROWS;
        let at = self.values.iter().filter(|(.., rows)| is_shown(*rows)).map(|(n, ..)| Form::At(*n));
        // From the second on to the last but one: the others are one test alone, or all.
        let before = |i: usize| self.values[..i].iter().map(|(.., rows)| rows).sum::<usize>();
        let from = (1..self.values.len().max(1) - 1).filter(|i| self.name == "test" && is_shown(before(*i)));
        at.chain(from.map(|i| Form::From(self.values[i].0))).collect()
    }
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
    is_temperature: bool,
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
    fn of(variable: &DescribedVariable, si: impl Iterator<Item = f64>) -> Self {
        let (name, unit) = variable.in_expressions();
        let is_temperature = variable.dimension.is_absolute();
        let per_unit = if is_temperature { 1.0 } else { units::convert(1.0, &unit, variable.dimension).unwrap_or(1.0) };
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
            is_temperature,
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

impl Scales {
    /// Of a data set.
    pub fn of(data: &Data, machine: &Machine) -> Self {
        let at = |name: &str| machine.variables.iter().position(|v| v.name == name);
        let (speed_at, flow_at) = (at(condition::MOTOR_SPEED), at(condition::COOLANT_FLOW));
        let time_at = at(TIME).filter(|_| data.is_transient());
        let tests = at(TEST_NUMBER).and_then(|v| Count::of_tests(v, data));
        let fallen = |(v, own): (usize, &DescribedVariable)| Count::of_falling(v, own.name.strip_suffix(FALLEN)?, data);
        let counts = tests.into_iter().chain(machine.variables.iter().enumerate().filter_map(fallen)).collect();
        let values = |v: usize| data.rows.iter().map(move |r| r.condition.si()[v]);
        let variables: Vec<VariableScale> =
            machine.variables.iter().enumerate().map(|(v, variable)| VariableScale::of(variable, values(v))).collect();
        let speed = speed_at.map_or(0.0, |v| values(v).fold(0.0f64, |m, v| m.max(v.abs())));
        let mut flows: Vec<f64> = flow_at.map_or(Vec::new(), |v| values(v).collect());
        flows.sort_by(f64::total_cmp);
        let flow = flows.get(flows.len() / 2).copied().unwrap_or(0.0);
        Self { speed, flow, speed_at, flow_at, time_at, counts, variables, found: Vec::new() }
    }

    /// Whether a variable, given by its place among the machine's, is more than one value in the data; one that is nothing throughout does not
    /// vary.
    pub fn varies(&self, variable: usize) -> bool {
        self.variables[variable].varies()
    }

    /// Laws by the machine's own variables that vary in the data, and thresholds in any but temperatures.
    pub fn laws(&self, machine: &Machine) -> Vec<Law> {
        let of = |(v, (variable, own)): (usize, (&DescribedVariable, &VariableScale))| -> Vec<Law> {
            if variable.dimension.is_absolute() || !own.varies() || self.says_when(v) {
                return Vec::new();
            }
            own.forms(!condition::NAMES.contains(&variable.name.as_str())).into_iter().map(|form| Law::Of(v, form)).collect()
        };
        machine.variables.iter().zip(&self.variables).enumerate().flat_map(of).collect()
    }

    /// Laws of the time, in logs of a machine whose file declares it; instants on a grid, which stand for those between them.
    pub(crate) fn laws_of_time(&self) -> Vec<Law> {
        let Some(time) = self.time_at.filter(|v| self.variables[*v].span() > 0.0) else { return Vec::new() };
        let after = (1..=INSTANTS).map(|n| Form::After(n * (PARTS / (INSTANTS + 1))));
        after.chain([Form::Passed]).map(|form| Law::Of(time, form)).collect()
    }

    /// Laws of the number of the test and of what has fallen, each with its share of all of them.
    pub(crate) fn laws_of_counts(&self) -> Vec<(Law, LawNumber)> {
        let of = |count: &Count| -> Vec<(Law, LawNumber)> {
            let forms = count.forms();
            let share = 1.0 / forms.len().max(1) as f64;
            let law = |form: &Form| {
                let (Form::At(n) | Form::From(n)) = *form else { return None };
                let value = f64::from(n);
                let number = LawNumber { name: count.name, value, low: value, high: value, unit: "1", share, deviation: 0.0 };
                Some((Law::Of(count.variable, *form), number))
            };
            forms.iter().filter_map(law).collect()
        };
        self.counts.iter().flat_map(of).collect()
    }

    /// Whether a variable is the time or a count.
    pub(crate) fn says_when(&self, variable: usize) -> bool {
        self.time_at == Some(variable) || self.counts.iter().any(|count| count.variable == variable)
    }

    /// Powers of the motor speed and of the machine's own variables that vary, on a grid of exponents, which stand for those between
    /// them.
    pub fn powers(&self, machine: &Machine) -> Vec<Law> {
        let has_powers = |(v, (variable, own)): &(usize, (&DescribedVariable, &VariableScale))| {
            let is_own = self.speed_at == Some(*v) || !condition::NAMES.contains(&variable.name.as_str());
            is_own && !self.says_when(*v) && !variable.dimension.is_absolute() && own.varies() && own.least >= 0.0
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
        if let Some(found) = self.found(law) {
            return found.words();
        }
        let Law::Of(v, form) = law else { return law.words().into() };
        let own = &self.variables[v];
        let name = own.shown.as_str();
        let at = |n: f64| format!("{}{}", significant(own.instant(n), 4), own.unit_after());
        match form {
            Form::Power(n) => format!("in proportion to {}^{}", own.plain, f64::from(n) / HUNDREDTHS),
            Form::Passed => format!("in proportion to the time that has passed, this much at {}", at(f64::from(PARTS))),
            Form::After(n) => format!("only after {}", at(f64::from(n))),
            Form::At(_) | Form::From(_) => self.counts.iter().find(|count| count.variable == v).map_or(String::new(), |c| c.words(form)),
            Form::Proportional | Form::Course => format!("in proportion to {name}"),
            Form::Squared => format!("with the square of {name}"),
            Form::Inverse => format!("in proportion to one over {name}"),
            Form::Above(level) => format!("only where {name} is above {}{}", significant(own.threshold(level), 4), own.unit_after()),
        }
    }

    /// The same with the interval of its number.
    pub(crate) fn words_with(&self, law: Law, number: &LawNumber) -> String {
        let Law::Of(v, _) = law else { return self.words(law) };
        if number.low == number.high {
            return self.words(law);
        }
        let per_unit = if number.unit == "s" { self.variables[v].per_unit } else { 1.0 };
        let digits = if number.unit == "s" { 4 } else { 3 };
        let shown = |n: f64| significant(n / per_unit, digits);
        format!("{} ({} to {})", self.words(law), shown(number.low), shown(number.high))
    }

    /// A law that was found; none where it is one of a list.
    pub fn found(&self, law: Law) -> Option<&FoundLaw> {
        if let Law::Found(k) = law { self.found.get(k) } else { None }
    }

    /// The name of a law that was found, from now on known here.
    pub(crate) fn named(&mut self, found: FoundLaw) -> Law {
        let known = self.found.iter().position(|own| *own == found);
        Law::Found(known.unwrap_or_else(|| {
            self.found.push(found);
            self.found.len() - 1
        }))
    }

    /// A variable as laws have it, with its levels in the data, rising.
    pub(crate) fn axis(&self, variable: usize) -> (Axis, &[f64]) {
        let own = &self.variables[variable];
        let (shown, name, unit) = (own.shown.clone(), own.name.clone(), own.unit.clone());
        let VariableScale { per_unit, is_temperature, least, most, .. } = *own;
        (Axis { variable, shown, name, unit, per_unit, is_temperature, least, most }, &own.levels)
    }

    /// Laws of one variable that is not negative: in proportion, by the square and by one over it where that is.
    pub(crate) fn named_laws(&self, variable: usize) -> Vec<Law> {
        let of = |form: Form| match form {
            Form::Proportional if self.speed_at == Some(variable) => Law::Speed,
            Form::Squared if self.speed_at == Some(variable) => Law::SpeedSquared,
            Form::Inverse if self.flow_at == Some(variable) => Law::InverseFlow,
            form => Law::Of(variable, form),
        };
        let own = &self.variables[variable];
        let inverse = (own.least > VARIES * own.largest()).then_some(Form::Inverse);
        [Form::Proportional, Form::Squared].into_iter().chain(inverse).map(of).collect()
    }

    /// Whether formulas of a machine file can say a law: not what depends on the order of the rows.
    pub fn has_formula(&self, law: Law) -> bool {
        self.found(law).is_none_or(|found| found.expression().is_some())
    }

    /// Factors of a law at conditions that follow each other.
    pub fn factors(&self, law: Law, conditions: &[&Condition]) -> Vec<f64> {
        match self.found(law) {
            Some(found) => found.factors(conditions),
            None => conditions.iter().map(|condition| self.factor(law, condition)).collect(),
        }
    }

    /// Factor of a law at a condition; one of laws in a temperature, and of what depends on the order of the rows.
    pub fn factor(&self, law: Law, condition: &Condition) -> f64 {
        let speed = self.speed_at.map_or(0.0, |v| condition.si()[v]) / if self.speed > 0.0 { self.speed } else { 1.0 };
        match law {
            Law::Constant | Law::Temperature => 1.0,
            Law::Found(_) => self.found(law).and_then(|found| found.factor(condition)).unwrap_or(1.0),
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
                    Form::Course => value,
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
                    Form::At(_) | Form::From(_) => form.at_count(value).unwrap_or(1.0),
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
            Law::Found(_) => self.found(law).and_then(FoundLaw::expression).unwrap_or_else(|| "1".into()),
            Law::Speed => format!("motor_speed_rpm / {rpm:?}"),
            Law::SpeedSquared => format!("(motor_speed_rpm / {rpm:?})^2"),
            Law::InverseFlow => format!("{:?} / coolant_flow_L_min", nine_digits(self.flow * 60_000.0)),
            Law::Of(v, form) => {
                let own = &self.variables[v];
                let (name, largest) = (&own.name, own.largest());
                match form {
                    Form::Proportional => format!("{name} / {largest:?}"),
                    Form::Course => name.clone(),
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
                    Form::At(n) => format!("max(0, 1 - abs({name} - {n}))"),
                    Form::From(n) => format!("min(1, max(0, {name} - {n} + 1))"),
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
