//! Laws that are found from the data and stand in no list: thresholds, saturation, curves, and what depends on the order of the rows.
//!
//! Each is a function of the rows whose largest value is about one, so that the amplitude of a cause under it has the unit of its kind.

use super::law::nine_digits;
use crate::when::TEST_NUMBER;
use coldplate_base::numbers::significant;
use coldplate_base::units::ZERO_CELSIUS;
use coldplate_describe::machine::Condition;
use coldplate_evidence::measurement::TIME;

/// Width of a step as written, as a share of the range of its variable.
const SHARP: f64 = 1e-4;

/// A variable of the machine as laws have it.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Which of the machine's variables.
    pub variable: usize,
    /// Name for readers.
    pub shown: String,
    /// Name in formulas.
    pub name: String,
    /// Unit there.
    pub unit: String,
    /// SI per unit.
    pub per_unit: f64,
    /// Whether it is a temperature, in kelvin here, which readers are told in degC.
    pub is_temperature: bool,
    /// Least value in the data.
    pub least: f64,
    /// Largest value in the data.
    pub most: f64,
}

impl Axis {
    /// Value at a condition.
    pub fn at(&self, condition: &Condition) -> f64 {
        condition.si()[self.variable] / self.per_unit
    }

    /// Whether it is the time of a log.
    pub fn is_time(&self) -> bool {
        self.name == format!("{TIME}_s")
    }

    /// Whether it is the number of the test.
    pub fn is_count(&self) -> bool {
        self.name == TEST_NUMBER
    }

    fn span(&self) -> f64 {
        self.most - self.least
    }

    fn number(&self, value: f64) -> String {
        match self.unit.as_str() {
            _ if self.is_temperature => format!("{} degC", significant(value - ZERO_CELSIUS, 4)),
            "1" => significant(value, 4),
            unit => format!("{} {unit}", significant(value, 4)),
        }
    }
}

/// How a cause follows one variable, at one condition.
#[derive(Debug, Clone, PartialEq)]
pub enum Course {
    /// A power of its share of the largest value.
    Power(f64),
    /// Only above a threshold.
    Above(f64),
    /// Only below one.
    Below(f64),
    /// Of a count: only where it is this one.
    Only(f64),
    /// Nothing up to a threshold, then in proportion to what is beyond it.
    Beyond(f64),
    /// In proportion to it up to a value, and no more.
    UpTo(f64),
    /// Straight from nothing at its least value to one at its largest.
    Straight,
    /// Points of a curve that no known law describes, straight between them.
    Curve(Vec<(f64, f64)>),
}

/// How a cause follows the rows in their order, which no formula of a machine file can say.
#[derive(Debug, Clone, PartialEq)]
pub enum Sequence {
    /// Grows evenly from nothing in the first row to one in the last.
    Drift,
    /// From one row on, counted from zero.
    From(usize),
    /// On once a variable was above the second number, off once it was below the first.
    Relay(Axis, f64, f64),
    /// Minus one where a variable has risen since the row before, one where it has fallen.
    Fallen(Axis),
    /// What a variable with play of this much to either side lags behind, as a share of that play.
    Play(Axis, f64),
    /// A curve over the order of the rows, one number for each.
    Curve(Vec<f64>),
    /// Another number in every row, and the mean of those with readings.
    Free(Vec<f64>, f64),
}

/// A law that was found.
#[derive(Debug, Clone, PartialEq)]
pub enum FoundLaw {
    /// Alike everywhere.
    One,
    /// Over one variable.
    Over(Axis, Course),
    /// Over the order of the rows.
    Rows(Sequence),
    /// Two laws at once, one times the other.
    Product(Box<[FoundLaw; 2]>),
    /// Laws beside each other, each with its share.
    Sum(Vec<(f64, FoundLaw)>),
}

impl Course {
    fn factor(&self, axis: &Axis, x: f64) -> f64 {
        match self {
            Self::Power(exponent) if x > 0.0 => (x / axis.most).powf(*exponent) / largest_power(axis, *exponent),
            Self::Power(_) => 0.0,
            Self::Above(at) => f64::from(u8::from(x > *at)),
            Self::Below(at) => f64::from(u8::from(x < *at)),
            Self::Only(one) => (1.0 - (x - one).abs()).max(0.0),
            Self::Beyond(from) => (x - from).max(0.0) / (axis.most - from),
            Self::UpTo(at) => x.min(*at) / at,
            Self::Straight => (x - axis.least) / axis.span(),
            Self::Curve(points) => between(points, x),
        }
    }

    fn expression(&self, axis: &Axis) -> String {
        let (name, number) = (&axis.name, |value: f64| format!("{:?}", nine_digits(value)));
        match self {
            Self::Power(exponent) => {
                format!("({name} / {})^{exponent:?} / {}", number(axis.most), number(largest_power(axis, *exponent)))
            }
            Self::Above(at) | Self::Below(at) => {
                let half = 0.5 * SHARP * axis.span();
                let (first, last) = if matches!(self, Self::Above(_)) { (0, 1) } else { (1, 0) };
                format!("interpolate({name}, {}, {first}, {}, {last})", number(at - half), number(at + half))
            }
            Self::Only(one) => format!("max(0, 1 - abs({name} - {}))", number(*one)),
            Self::Beyond(from) => format!("max(0, {name} - {}) / {}", number(*from), number(axis.most - from)),
            Self::UpTo(at) => format!("min({name}, {at}) / {at}", at = number(*at)),
            Self::Straight => format!("({name} - {}) / {}", number(axis.least), number(axis.span())),
            Self::Curve(points) => {
                let points: Vec<String> = points.iter().map(|(x, y)| format!("{}, {}", number(*x), number(*y))).collect();
                format!("interpolate({name}, {})", points.join(", "))
            }
        }
    }

    fn words(&self, axis: &Axis) -> String {
        let (name, at) = (&axis.shown, |value: f64| axis.number(value));
        match self {
            Self::Power(1.0) => format!("in proportion to {name}"),
            Self::Power(2.0) => format!("with the square of {name}"),
            Self::Power(-1.0) => format!("in proportion to one over {name}, this much at {}", at(axis.least)),
            Self::Power(exponent) => format!("in proportion to {name}^{exponent}"),
            Self::Above(instant) if axis.is_time() => format!("only after {}", at(*instant)),
            Self::Below(instant) if axis.is_time() => format!("only before {}", at(*instant)),
            Self::Above(count) if axis.is_count() => format!("only from {name} {} on", (count + 0.5).round()),
            Self::Only(one) => format!("only in {name} {one}"),
            Self::Above(threshold) => format!("only where {name} is above {}", at(*threshold)),
            Self::Below(threshold) => format!("only where {name} is below {}", at(*threshold)),
            Self::Beyond(from) => {
                format!("only where {name} is above {}, in proportion to what is beyond, this much at {}", at(*from), at(axis.most))
            }
            Self::UpTo(most) => format!("in proportion to {name} up to {}, then no more", at(*most)),
            Self::Straight if axis.is_time() && axis.least == 0.0 => format!("in proportion to the {name}, this much at {}", at(axis.most)),
            Self::Straight => format!("straight with {name}, nothing at {} and this much at {}", at(axis.least), at(axis.most)),
            Self::Curve(points) => {
                let ends = points.first().zip(points.last()).map_or((axis.least, axis.most), |(first, last)| (first.0, last.0));
                format!("by no known law: over {name} as found between {} and {}, constant beyond", at(ends.0), at(ends.1))
            }
        }
    }
}

/// Largest value of a power over the data, as a share of that at the largest value of the variable.
fn largest_power(axis: &Axis, exponent: f64) -> f64 {
    if exponent < 0.0 && axis.least > 0.0 { (axis.least / axis.most).powf(exponent) } else { 1.0 }
}

/// Straight between points, constant beyond them.
fn between(points: &[(f64, f64)], x: f64) -> f64 {
    let after = points.partition_point(|(at, _)| *at <= x);
    match (after.checked_sub(1).and_then(|i| points.get(i)), points.get(after)) {
        (Some((x0, y0)), Some((x1, y1))) => y0 + (y1 - y0) * (x - x0) / (x1 - x0),
        (Some((_, y)), None) | (None, Some((_, y))) => *y,
        (None, None) => 0.0,
    }
}

impl Sequence {
    fn factors(&self, conditions: &[&Condition]) -> Vec<f64> {
        let along = |axis: &Axis| conditions.iter().map(|c| axis.at(c)).collect::<Vec<f64>>();
        let n = conditions.len();
        match self {
            Self::Drift => (0..n).map(|row| row as f64 / (n.max(2) - 1) as f64).collect(),
            Self::From(first) => (0..n).map(|row| f64::from(u8::from(row >= *first))).collect(),
            Self::Relay(axis, low, high) => {
                let mut is_on = false;
                let mut next = |x: f64| {
                    is_on = x > *high || is_on && x >= *low;
                    f64::from(u8::from(is_on))
                };
                along(axis).into_iter().map(&mut next).collect()
            }
            Self::Fallen(axis) => {
                let (mut last, mut factor) = (f64::NEG_INFINITY, 0.0);
                let mut next = |x: f64| {
                    if x != last {
                        factor = if x > last { -1.0 } else { 1.0 };
                    }
                    last = x;
                    factor
                };
                along(axis).into_iter().map(&mut next).collect()
            }
            Self::Play(axis, play) => {
                let mut behind = axis.least;
                let mut next = |x: f64| {
                    behind = behind.clamp(x - play, x + play);
                    (behind - x) / play
                };
                along(axis).into_iter().map(&mut next).collect()
            }
            Self::Curve(factors) | Self::Free(factors, _) => (0..n).map(|row| factors.get(row).copied().unwrap_or(0.0)).collect(),
        }
    }

    fn words(&self) -> String {
        match self {
            Self::Drift => "grows evenly in the order of the rows, this much in the last".into(),
            Self::From(row) => format!("only from row {} on", row + 1),
            Self::Relay(axis, low, high) => {
                let (low, high) = (axis.number(*low), axis.number(*high));
                format!("with hysteresis: on once {} was above {high}, off once it was below {low}, in the order of the rows", axis.shown)
            }
            Self::Fallen(axis) => {
                format!(
                    "with hysteresis: this much more where {0} has fallen since the row before, as much less where {0} has risen",
                    axis.shown
                )
            }
            Self::Play(axis, play) => {
                format!("with hysteresis: as {} with a play of {} to either side lags behind it", axis.shown, axis.number(*play))
            }
            Self::Curve(_) => "by no known law: over the order of the rows as found".into(),
            Self::Free(..) => "by no known law: another number in every row".into(),
        }
    }
}

impl FoundLaw {
    /// Over one variable.
    pub fn over(axis: &Axis, course: Course) -> Self {
        Self::Over(axis.clone(), course)
    }

    /// Factor at a condition; `None` of what depends on the order of the rows.
    pub fn factor(&self, condition: &Condition) -> Option<f64> {
        Some(match self {
            Self::One => 1.0,
            Self::Over(axis, course) => course.factor(axis, axis.at(condition)),
            Self::Rows(_) => return None,
            Self::Product(both) => both[0].factor(condition)? * both[1].factor(condition)?,
            Self::Sum(all) => all.iter().map(|(share, law)| Some(share * law.factor(condition)?)).sum::<Option<f64>>()?,
        })
    }

    /// Factors at conditions that follow each other.
    pub fn factors(&self, conditions: &[&Condition]) -> Vec<f64> {
        match self {
            Self::Rows(sequence) => sequence.factors(conditions),
            Self::Product(both) => both[0].factors(conditions).into_iter().zip(both[1].factors(conditions)).map(|(a, b)| a * b).collect(),
            Self::Sum(all) => {
                let mut sum = vec![0.0; conditions.len()];
                for (share, law) in all {
                    sum.iter_mut().zip(law.factors(conditions)).for_each(|(sum, factor)| *sum += share * factor);
                }
                sum
            }
            Self::One | Self::Over(..) => conditions.iter().map(|c| self.factor(c).unwrap_or(0.0)).collect(),
        }
    }

    /// The law as an expression of a machine file's formulas; `None` of what depends on the order of the rows.
    pub fn expression(&self) -> Option<String> {
        Some(match self {
            Self::One => "1".into(),
            Self::Over(axis, course) => course.expression(axis),
            Self::Rows(_) => return None,
            Self::Product(both) => format!("({}) * ({})", both[0].expression()?, both[1].expression()?),
            Self::Sum(all) => {
                let term = |(share, law): &(f64, Self)| Some(format!("({:?}) * ({})", nine_digits(*share), law.expression()?));
                all.iter().map(term).collect::<Option<Vec<String>>>()?.join(" + ")
            }
        })
    }

    /// Factor of the law after the last row of the data; `None` where nothing is known of later rows. What set in at a row stays, and another
    /// number in every row is their mean.
    pub fn factor_afterwards(&self) -> Option<f64> {
        match self {
            Self::One | Self::Rows(Sequence::From(_)) => Some(1.0),
            Self::Rows(Sequence::Free(_, mean)) => Some(*mean),
            Self::Over(..) | Self::Rows(_) => None,
            Self::Product(both) => Some(both[0].factor_afterwards()? * both[1].factor_afterwards()?),
            Self::Sum(all) => all.iter().map(|(share, law)| Some(share * law.factor_afterwards()?)).sum(),
        }
    }

    /// How it depends on the condition, in words.
    pub fn words(&self) -> String {
        match self {
            Self::One => "alike everywhere".into(),
            Self::Over(axis, course) => course.words(axis),
            Self::Rows(sequence) => sequence.words(),
            Self::Product(both) => format!("{}, times a factor {}", both[0].words(), both[1].words()),
            Self::Sum(all) => {
                let of = |(share, law): &(f64, Self)| format!("{} of it {}", significant(*share, 3), law.words());
                all.iter().map(of).collect::<Vec<String>>().join(", and ")
            }
        }
    }

    /// Whether no known law describes it, or a part of it.
    pub fn is_unknown(&self) -> bool {
        match self {
            Self::Sum(all) => all.iter().any(|(_, law)| law.is_unknown()),
            _ => matches!(self, Self::Over(_, Course::Curve(_)) | Self::Rows(Sequence::Curve(_) | Sequence::Free(..))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use coldplate_base::error::Location;
    use coldplate_base::formula::{Formula, FormulaNames, FormulaValues};
    use coldplate_base::units::Dimension;

    fn axis() -> Axis {
        let shown = "speed".to_string();
        Axis {
            variable: 0,
            name: "speed_rpm".into(),
            unit: "rpm".into(),
            shown,
            per_unit: 0.5,
            is_temperature: false,
            least: 100.0,
            most: 1000.0,
        }
    }

    #[test]
    fn temperatures_are_told_in_degrees_celsius() {
        let axis = Axis { shown: "room".into(), unit: "K".into(), is_temperature: true, least: 288.15, most: 303.15, ..axis() };
        assert_eq!(Course::Above(294.65).words(&axis), "only where room is above 21.50 degC");
    }

    /// What a machine file says is the law, at and between its points and beyond them.
    #[test]
    fn expressions_are_the_laws() {
        let courses = [
            Course::Power(1.4),
            Course::Power(-1.0),
            Course::Above(300.0),
            Course::Below(300.0),
            Course::Only(300.0),
            Course::Beyond(250.0),
            Course::UpTo(600.0),
            Course::Straight,
            Course::Curve(vec![(100.0, 1.0), (400.0, 0.2), (900.0, -0.1)]),
        ];
        let mut names = FormulaNames::default();
        names.add("speed_rpm").unwrap();
        let mut laws: Vec<FoundLaw> = courses.into_iter().map(|course| FoundLaw::over(&axis(), course)).collect();
        laws.push(FoundLaw::Product(Box::new([laws[0].clone(), laws[3].clone()])));
        laws.push(FoundLaw::Sum(vec![(0.3, FoundLaw::One), (0.9, laws[4].clone()), (-0.2, laws[6].clone())]));
        for law in laws {
            let formula = Formula::parse(&law.expression().unwrap(), Dimension::POWER, None, &names, Location::default()).unwrap();
            for rpm in [50.0, 100.0, 299.9, 300.1, 700.0, 1000.0, 1200.0] {
                let told = formula.evaluate(&FormulaValues(vec![rpm])).unwrap();
                let own = law.factor(&Condition::from_si(vec![0.5 * rpm])).unwrap();
                assert!((told - own).abs() < 1e-8, "{} at {rpm}: {told} {own}", law.words());
            }
        }
    }

    #[test]
    fn hysteresis_follows_the_order_of_the_rows() {
        let conditions: Vec<Condition> = [100.0, 500.0, 900.0, 500.0, 200.0, 500.0].map(|rpm| Condition::from_si(vec![0.5 * rpm])).into();
        let conditions: Vec<&Condition> = conditions.iter().collect();
        let of = |sequence: Sequence| FoundLaw::Rows(sequence).factors(&conditions);
        assert_eq!(of(Sequence::Relay(axis(), 300.0, 700.0)), [0.0, 0.0, 1.0, 1.0, 0.0, 0.0]);
        assert_eq!(of(Sequence::Fallen(axis())), [-1.0, -1.0, -1.0, 1.0, 1.0, -1.0]);
        assert_eq!(of(Sequence::Play(axis(), 200.0)), [0.0, -1.0, -1.0, 1.0, 1.0, -0.5]);
        assert_eq!(of(Sequence::From(4)), [0.0, 0.0, 0.0, 0.0, 1.0, 1.0]);
        assert!(FoundLaw::Rows(Sequence::Drift).expression().is_none());
    }

    #[test]
    fn what_set_in_stays_after_the_last_row() {
        let from = FoundLaw::Rows(Sequence::From(4));
        assert_eq!(from.factor_afterwards(), Some(1.0));
        let half_of_it = FoundLaw::Sum(vec![(0.25, FoundLaw::One), (0.5, from.clone())]);
        assert_eq!(half_of_it.factor_afterwards(), Some(0.75));
        assert_eq!(FoundLaw::Rows(Sequence::Free(vec![1.0, 0.0, 0.5, 0.3], 0.6)).factor_afterwards(), Some(0.6));
        let beyond = [Sequence::Drift, Sequence::Fallen(axis()), Sequence::Curve(vec![1.0])].map(FoundLaw::Rows);
        assert!(beyond.iter().all(|law| law.factor_afterwards().is_none()));
        assert!(FoundLaw::Product(Box::new([from, FoundLaw::over(&axis(), Course::Straight)])).factor_afterwards().is_none());
    }
}
