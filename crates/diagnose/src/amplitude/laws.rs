//! The laws that a cause may follow over the rows of a table: functions of the rows, by family.
//!
//! A family is one form over one variable; its members differ in a number, such as a threshold or an exponent, all alike before the data are
//! seen. Laws of one function come first. Laws of two are rarer: what is constant and one of these, a sum of two, a product of two.

use crate::effects::{Axis, Course, FoundLaw, Law, LawForm, Scales, Sequence};
use coldplate_describe::machine::{Condition, Machine};
use coldplate_evidence::measurement::Data;

/// Thresholds that are tried over one variable at most; others lie between these.
const THRESHOLDS: usize = 12;
/// Thresholds whose pairs are tried as relays, at most.
const OF_RELAYS: usize = 6;
/// Rows on either side of a threshold, at least: what acts in one row alone may as well be that row.
const LEAST_ROWS: usize = 2;
/// Play to either side that is tried, as shares of the range of a variable.
const PLAYS: [f64; 4] = [0.05, 0.1, 0.2, 0.4];
/// Exponents that are tried, in hundredths, and the steps between those that are tried first.
const EXPONENTS: std::ops::RangeInclusive<u16> = 25..=400;
const EXPONENTS_APART: usize = 5;
/// Functions that differ by less than this share are one.
const ALIKE: f64 = 1e-9;

/// What a law says.
#[derive(Debug, Clone, PartialEq)]
pub enum Rule {
    /// A law of the catalogue.
    Listed(Law),
    /// One that is found.
    Found(FoundLaw),
}

/// One function of the rows.
#[derive(Debug, Clone)]
pub struct Single {
    /// What it says.
    pub rule: Rule,
    /// The same in a form that can be part of another law.
    pub part: FoundLaw,
    /// Factor in each row with readings.
    pub factors: Vec<f64>,
}

/// A form over one variable.
#[derive(Debug, Clone)]
pub struct Family {
    /// Its members: places among all functions.
    pub members: Vec<usize>,
    /// Where it is a law.
    pub form: Form,
}

/// Where a family is a law.
#[derive(Debug, Clone, Copy)]
pub struct Form {
    /// Without a constant beside it.
    pub is_alone: bool,
    /// Beside a constant: not what is one with it anyway.
    pub is_beside: bool,
    /// In sums and products with others: what is smooth and has no number.
    pub is_plain: bool,
}

impl Form {
    const ALONE: Self = Self { is_alone: true, is_beside: false, is_plain: false };
    const BOTH: Self = Self { is_beside: true, ..Self::ALONE };
}

/// All laws that a table can show.
pub struct Laws<'a> {
    table: Table<'a>,
    list: List,
    /// Families from this place on are products.
    products: usize,
}

/// Functions of the rows, by family.
#[derive(Default)]
struct List {
    singles: Vec<Single>,
    families: Vec<Family>,
}

/// Where laws are looked for: a table with its machine.
struct Table<'a> {
    scales: &'a Scales,
    conditions: Vec<&'a Condition>,
    has_readings: Vec<bool>,
}

impl Table<'_> {
    fn seen(&self, factors: Vec<f64>) -> Vec<f64> {
        factors.into_iter().zip(&self.has_readings).filter(|(_, seen)| **seen).map(|(factor, _)| factor).collect()
    }

    fn in_order(&self, sequence: Sequence) -> Single {
        self.single(Rule::Found(FoundLaw::Rows(sequence)), None)
    }

    fn single(&self, rule: Rule, part: Option<FoundLaw>) -> Single {
        let factors = match &rule {
            Rule::Listed(law) => self.scales.factors(*law, &self.conditions),
            Rule::Found(found) => found.factors(&self.conditions),
        };
        let part = part.unwrap_or_else(|| if let Rule::Found(found) = &rule { found.clone() } else { FoundLaw::One });
        Single { part, factors: self.seen(factors), rule }
    }
}

impl<'a> Laws<'a> {
    /// Laws over some variables of the machine.
    pub fn new(scales: &'a Scales, machine: &Machine, data: &'a Data, variables: &[usize]) -> Self {
        let conditions = data.rows.iter().map(|row| &row.condition).collect();
        let table = Table { scales, conditions, has_readings: data.rows.iter().map(|row| row.has_readings()).collect() };
        let mut list = List::default();
        for v in variables.iter().copied().filter(|v| !scales.says_when(*v)) {
            list.over(&table, v, machine.variables[v].dimension.is_absolute());
        }
        list.of_counts(&table);
        list.of_order(&table);
        let products = list.families.len();
        list.of_two(&table);
        Self { table, list, products }
    }

    /// A function by its place.
    pub fn single(&self, place: usize) -> &Single {
        &self.list.singles[place]
    }

    /// Families of one function.
    pub fn families(&self) -> &[Family] {
        &self.list.families[..self.products]
    }

    /// Products of two.
    pub fn products(&self) -> impl Iterator<Item = usize> + '_ {
        self.list.families[self.products..].iter().flat_map(|family| family.members.iter().copied())
    }

    /// Pairs whose sums are laws.
    pub fn sums(&self) -> Vec<(usize, usize)> {
        let plain: Vec<usize> = self.families().iter().filter(|f| f.form.is_plain).map(|f| f.members[0]).collect();
        plain.iter().enumerate().flat_map(|(i, a)| plain[i + 1..].iter().map(move |b| (*a, *b))).collect()
    }

    /// Number of laws of one function, and of two.
    pub fn counts(&self) -> [usize; 2] {
        let alone = self.families().iter().filter(|family| family.form.is_alone).count();
        let beside = self.families().iter().filter(|family| family.form.is_beside).count();
        [alone, beside + self.products().count() + self.sums().len()]
    }

    /// Numbers of rows with readings, spread over all rows.
    pub fn over_all_rows(&self, own: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut own = own;
        self.table.has_readings.iter().map(|seen| if *seen { own.next().unwrap_or(0.0) } else { 0.0 }).collect()
    }

    /// Factors of a law in the rows with readings.
    pub fn factors(&self, law: &FoundLaw) -> Vec<f64> {
        self.table.seen(law.factors(&self.table.conditions))
    }

    /// Places of all functions.
    pub fn len(&self) -> usize {
        self.list.singles.len()
    }

    /// Powers of a variable between the one that is given and its neighbours among those tried first; none of what is no power.
    pub fn exponents_near(&self, place: usize) -> Vec<Single> {
        let Rule::Listed(Law::Of(v, LawForm::Power(n))) = self.single(place).rule else { return Vec::new() };
        let (axis, _) = self.table.scales.axis(v);
        let apart = EXPONENTS_APART as u16;
        let near = (n - apart).max(*EXPONENTS.start())..=(n + apart).min(*EXPONENTS.end());
        near.map(|n| power(&self.table, &axis, n)).collect()
    }
}

impl Single {
    /// The exponent of a power that is looked for, in hundredths.
    pub fn exponent(&self) -> Option<u16> {
        if let Rule::Listed(Law::Of(_, LawForm::Power(n))) = self.rule { Some(n) } else { None }
    }
}

/// Exponents in hundredths that are alike before the data are seen, and how many of them stand for one another among those tried first.
pub const EXPONENT_COUNT: (usize, usize) = ((*EXPONENTS.end() - *EXPONENTS.start()) as usize + 1, EXPONENTS_APART);

impl List {
    /// Adds a family; members that are nothing, the same in all rows, or like one before over the same variable are none.
    fn add(&mut self, members: impl IntoIterator<Item = Single>, from: usize, form: Form) {
        let mut own = Vec::new();
        for single in members {
            let largest = single.factors.iter().fold(0.0f64, |most, f| most.max(f.abs()));
            let varies = single.factors.iter().any(|f| (f - single.factors[0]).abs() > ALIKE * largest);
            let is_like = |other: &Single| other.factors.iter().zip(&single.factors).all(|(a, b)| (a - b).abs() < ALIKE * largest);
            if varies && largest.is_finite() && !self.singles[from..].iter().any(is_like) {
                own.push(self.singles.len());
                self.singles.push(single);
            }
        }
        if !own.is_empty() {
            self.families.push(Family { members: own, form });
        }
    }

    /// Laws of one variable.
    fn over(&mut self, table: &Table<'_>, v: usize, is_absolute: bool) {
        let (axis, levels) = table.scales.axis(v);
        let from = self.singles.len();
        let found = |course: Course| table.single(Rule::Found(FoundLaw::over(&axis, course)), None);
        let listed = |law: Law, course: Course| table.single(Rule::Listed(law), Some(FoundLaw::over(&axis, course)));
        let is_positive = !is_absolute && axis.least >= 0.0 && axis.most > 0.0;
        // Between two levels everything is straight.
        let is_bent = levels.len() > 2;
        if is_positive {
            for law in table.scales.named_laws(v) {
                let exponent = match law {
                    Law::SpeedSquared | Law::Of(_, LawForm::Squared) => 2.0,
                    Law::InverseFlow | Law::Of(_, LawForm::Inverse) => -1.0,
                    _ => 1.0,
                };
                let is_beside = is_bent || exponent == 1.0;
                self.add([listed(law, Course::Power(exponent))], from, Form { is_alone: true, is_beside, is_plain: true });
            }
        } else {
            self.add([found(Course::Straight)], from, Form { is_alone: false, is_beside: true, is_plain: false });
        }
        let steps = steps(table, &axis, levels);
        let middle = |i: usize| 0.5 * (levels[i] + levels[i + 1]);
        let above = |i: &usize| listed(Law::Of(v, LawForm::Above(*i)), Course::Above(middle(*i)));
        self.add(steps.iter().map(above), from, Form { is_beside: is_bent, ..Form::ALONE });
        self.add(steps.iter().map(|i| found(Course::Below(middle(*i)))), from, Form::ALONE);
        let inner: Vec<usize> = steps.iter().copied().filter(|i| *i > 0 && i + 2 < levels.len()).collect();
        self.add(inner.iter().map(|i| found(Course::Beyond(levels[*i]))), from, Form::BOTH);
        if is_positive && is_bent {
            self.add(inner.iter().map(|i| found(Course::UpTo(levels[*i]))), from, Form::BOTH);
            self.add(EXPONENTS.step_by(EXPONENTS_APART).map(|n| power(table, &axis, n)), from, Form::BOTH);
        }
        self.add([table.in_order(Sequence::Fallen(axis.clone()))], from, Form::BOTH);
        if is_bent {
            let play = |share: f64| table.in_order(Sequence::Play(axis.clone(), share * (axis.most - axis.least)));
            self.add(PLAYS.map(play), from, Form::BOTH);
            let ends = thinned(&steps, OF_RELAYS);
            let pairs = ends.iter().enumerate().flat_map(|(i, low)| ends[i + 1..].iter().map(move |high| (*low, *high)));
            self.add(pairs.map(|(low, high)| table.in_order(Sequence::Relay(axis.clone(), middle(low), middle(high)))), from, Form::BOTH);
        }
    }

    /// Laws of the number of the test, and of what is declared to have fallen.
    fn of_counts(&mut self, table: &Table<'_>) {
        let laws = table.scales.laws_of_counts();
        let mut names: Vec<&str> = laws.iter().map(|(_, number)| number.name).collect();
        names.dedup();
        for name in names {
            let own = laws.iter().filter(|(_, number)| number.name == name);
            let from = self.singles.len();
            let singles: Vec<Single> = own.map(|(law, _)| table.single(Rule::Listed(*law), None)).collect();
            self.add(singles, from, Form::ALONE);
        }
    }

    /// Laws of the order of the rows.
    fn of_order(&mut self, table: &Table<'_>) {
        let (from, rows) = (self.singles.len(), table.conditions.len());
        self.add([table.in_order(Sequence::Drift)], from, Form::BOTH);
        let steps: Vec<usize> = (LEAST_ROWS..rows.saturating_sub(LEAST_ROWS - 1)).collect();
        self.add(thinned(&steps, 2 * THRESHOLDS).into_iter().map(|row| table.in_order(Sequence::From(row))), from, Form::BOTH);
    }

    /// Products of plain laws of two variables.
    fn of_two(&mut self, table: &Table<'_>) {
        let from = self.singles.len();
        let plain: Vec<FoundLaw> =
            self.families.iter().filter(|f| f.form.is_plain).map(|f| self.singles[f.members[0]].part.clone()).collect();
        for (i, a) in plain.iter().enumerate() {
            for b in &plain[i + 1..] {
                let (FoundLaw::Over(first, _), FoundLaw::Over(second, _)) = (a, b) else { continue };
                if first.variable != second.variable {
                    let product = FoundLaw::Product(Box::new([a.clone(), b.clone()]));
                    self.add([table.single(Rule::Found(product), None)], from, Form::ALONE);
                }
            }
        }
    }
}

/// Levels after which a threshold may lie, with enough rows on either side.
fn steps(table: &Table<'_>, axis: &Axis, levels: &[f64]) -> Vec<usize> {
    let below = |i: usize| table.conditions.iter().filter(|c| axis.at(c) < 0.5 * (levels[i] + levels[i + 1])).count();
    let is_shown = |i: &usize| (LEAST_ROWS..=table.conditions.len().saturating_sub(LEAST_ROWS)).contains(&below(*i));
    let all: Vec<usize> = (0..levels.len().saturating_sub(1)).filter(is_shown).collect();
    thinned(&all, THRESHOLDS)
}

/// A power of a variable, by its exponent in hundredths.
fn power(table: &Table<'_>, axis: &Axis, n: u16) -> Single {
    let part = FoundLaw::over(axis, Course::Power(f64::from(n) / 100.0));
    table.single(Rule::Listed(Law::Of(axis.variable, LawForm::Power(n))), Some(part))
}

/// At most so many of some places, spread evenly over them.
fn thinned(places: &[usize], most: usize) -> Vec<usize> {
    let n = places.len();
    if n <= most { places.to_vec() } else { (0..most).map(|k| places[k * (n - 1) / (most - 1)]).collect() }
}
