//! Under which laws the members of a set act: each law is the free amplitude held to few functions of the rows.
//!
//! Evidence of a law comes from the engine that found the set, with the same errors and looseness. About the set as it was found, with the
//! other members at their free best, every law of a member is a small matrix. The best laws are then fitted to the end, for sets of several
//! members in combination. The curve or the freedom with which the set was found stays among them as "no known law".

use nalgebra::{DMatrix, DVector};

use super::evidence::{Freedom, Functions};
use super::kept_out::KeptOut;
use super::laws::{EXPONENT_COUNT, Family, Laws, Rule, Single};
use super::profiles::Curve;
use super::rows::Looseness;
use super::search::{Candidate, Fit, Search, Sought};
use crate::effects::{Axis, Course, FoundLaw, LawNumber, Sequence};
use crate::open_numbers::OpenNumber;
use coldplate_base::numbers::TWO_SIDED_90;

/// Laws of one member that are fitted to the end, at most.
const MOST_LAWS: usize = 10;
/// Combinations of the laws of several members that are fitted to the end, and ways that are told, at most.
const MOST_WAYS: usize = 12;
/// Ways that are less probable than this are not told, but for the best by no known law.
const LEAST: f64 = 1e-3;
/// Points of a curve between the levels of its variable, at most.
const MOST_POINTS: usize = 24;

/// What is told of one member.
#[derive(Debug, Clone)]
pub struct FoundCause {
    /// Its law; none where it is alike in all rows.
    pub rule: Option<Rule>,
    /// The number of that law, where it was found from the data.
    pub number: Option<LawNumber>,
    /// Amplitude and its standard deviation, in units of the scale.
    pub amplitude: (f64, f64),
}

/// One way in which a set acts.
#[derive(Debug, Clone)]
pub struct FoundWay {
    /// One for each member.
    pub causes: Vec<FoundCause>,
    /// Probability among all ways of the set.
    pub probability: f64,
    /// The set under it, whose members are counted from the first.
    fit: Fit,
    /// Functions of its laws, each with the curve that stands for it.
    functions: Vec<(Curve, Vec<f64>)>,
}

/// Functions that an amplitude follows.
#[derive(Debug, Clone)]
enum Means {
    /// None: alike in all rows.
    Constant,
    /// Few functions with a coefficient each, the constant among them or not.
    Law { singles: Vec<Single>, with_constant: bool, deviation: f64 },
    /// Any: no known law.
    Unknown,
}

/// A law of a member.
#[derive(Debug, Clone)]
struct Choice {
    means: Means,
    /// How free the amplitude is; of a law of functions without its curve.
    freedom: Freedom,
    /// Log evidence over that of the others alone, about the set as it was found, all prices included.
    gain: f64,
    /// What is paid beside the prices of the engine.
    price: f64,
    number: Option<LawNumber>,
}

/// A set, and where its laws are looked for.
#[derive(Clone, Copy)]
pub struct Ways<'a> {
    /// The search in which the set was found.
    pub search: &'a Search<'a>,
    /// The set.
    pub fit: &'a Fit,
    /// Laws of the table.
    pub laws: &'a Laws<'a>,
    /// The machine's variable of each variable of the search; none of the order of the rows.
    pub axes: &'a [Option<Axis>],
    /// Values of each variable of the search in the rows.
    pub variables: &'a [Vec<f64>],
}

impl Ways<'_> {
    /// The ways, most probable first, and the logarithm of the evidence of all of them: that of the set.
    pub fn found(&self) -> (f64, Vec<FoundWay>) {
        if self.fit.members.is_empty() {
            let way = FoundWay { causes: Vec::new(), probability: 1.0, fit: self.fit.clone(), functions: Vec::new() };
            return (self.fit.log_evidence, vec![way]);
        }
        let candidates = self.candidates();
        let count = candidates.len();
        let about = Search { candidates: &candidates, ..self.search.with_errors_of(self.fit) };
        let fit = Fit { members: (0..count).collect(), ..self.fit.clone() };
        let choices: Vec<Vec<Choice>> = (0..count).map(|m| self.choices(&about, &fit, m)).collect();
        let combined = combined(&choices);
        let profiles = about.profiles.with_laws(combined.iter().enumerate().flat_map(|(way, of)| self.functions(way, of)));
        let search = Search { profiles: &profiles, ..about };
        let fitted = |(way, of): (usize, &Vec<&Choice>)| self.fitted(&search, &fit, way, of);
        let mut all: Vec<(f64, bool, FoundWay)> = combined.iter().enumerate().filter_map(fitted).collect();
        if all.iter().any(|(log, ..)| log.is_finite()) {
            all.retain(|(log, ..)| log.is_finite());
        } else {
            // None comes to rest: the one that promised most.
            all.truncate(1);
            all.iter_mut().for_each(|(log, ..)| *log = self.fit.log_evidence);
        }
        (log_sum(&all.iter().map(|(log, ..)| *log).collect::<Vec<_>>()), told(all))
    }

    /// Predictions of each row from all others by a way, beside numbers of the file that may be off.
    pub fn kept_out(&self, way: &FoundWay, numbers: &[OpenNumber]) -> Option<KeptOut> {
        let candidates = self.candidates();
        let about = Search { candidates: &candidates, ..self.search.with_errors_of(self.fit) };
        let profiles = about.profiles.with_laws(way.functions.iter().map(|(curve, factors)| (*curve, factors.as_slice())));
        Search { profiles: &profiles, ..about }.kept_out(&way.fit, numbers)
    }

    /// Candidates of the set alone.
    fn candidates(&self) -> Vec<Candidate> {
        self.fit.members.iter().map(|m| self.search.candidates[*m].clone()).collect()
    }

    /// Functions of the laws of a way, each with the curve that stands for it.
    fn functions<'c>(&self, way: usize, of: &'c [&Choice]) -> Vec<(Curve, &'c [f64])> {
        let named = |(m, choice): (usize, &&'c Choice)| {
            let own: &[Single] = if let Means::Law { singles, .. } = &choice.means { singles } else { &[] };
            let curve = self.curve(way, m, of.len());
            own.iter().map(move |single| (curve, single.factors.as_slice()))
        };
        of.iter().enumerate().flat_map(named).collect()
    }

    fn row_count(&self) -> usize {
        self.fit.amplitudes.first().map_or(0, Vec::len)
    }

    /// The curve that stands for the law of a member in a way: of a variable beyond those of the search.
    fn curve(&self, way: usize, m: usize, count: usize) -> Curve {
        (self.axes.len() + way * count + m, 0)
    }

    /// Laws of a member, and no known law, best first.
    fn choices(&self, search: &Search<'_>, fit: &Fit, m: usize) -> Vec<Choice> {
        let explained = search.explained(&search.linear_about(fit), fit.looseness, &search.followed(&fit.freedoms));
        let Some(explained) = explained else { return vec![self.as_found(fit, m, 0.0)] };
        let Some(others) = explained.one_cause(m, &fit.freedoms, fit.looseness) else { return vec![self.as_found(fit, m, 0.0)] };
        let mut gain = others.gains();
        let price = |own: Freedom| search.price(&[own], Looseness::default());
        let own = fit.freedoms[m];
        let mut unknown = Vec::new();
        let is_constant = own.freedom == 0.0 && own.curve.is_none();
        if !is_constant {
            unknown.push(self.as_found(fit, m, gain(&own).unwrap_or(f64::NEG_INFINITY) - price(own)));
        }
        let sizes = search.sizes(&search.candidates[fit.members[m]], &fit.amplitudes[m], fit.freedoms[m].size);
        // The constant and some functions behind it.
        let functions = |count: usize, of: &dyn Fn(usize, usize) -> f64| {
            let columns = DMatrix::from_fn(self.row_count(), count + 1, |row, f| if f == 0 { 1.0 } else { of(row, f - 1) });
            others.functions(&columns, 0.0)
        };
        let singles = functions(self.laws.len(), &|row, f| self.laws.single(f).factors[row]);
        let Some(singles) = singles else { return vec![self.as_found(fit, m, 0.0)] };
        let screen = Screen {
            functions: singles,
            sizes: sizes.iter().map(|size| (*size, search.price_of_size(*size))).collect(),
            choice_price: search.settings.choice_price,
        };
        let mut free = |freedom: Freedom| {
            let gain = gain(&freedom).map_or(f64::NEG_INFINITY, |gain| gain - price(freedom));
            unknown.push(Choice { means: Means::Unknown, freedom, gain, price: 0.0, number: None });
        };
        let candidate = &search.candidates[fit.members[m]];
        for size in sizes.iter().filter(|_| candidate.may_vary && self.row_count() > 1) {
            for deviation in search.settings.freedoms.iter().filter(|d| **d > 0.0) {
                if search.may_scatter(candidate) {
                    free(Freedom { freedom: *deviation, ..Freedom::constant(*size) });
                }
                for curve in search.profiles.curves() {
                    free(Freedom { curve: Some((curve, *deviation)), ..Freedom::constant(*size) });
                }
            }
        }
        let near = |place: usize| {
            let near = self.laws.exponents_near(place);
            Some((functions(near.len(), &|row, f| near[f].factors[row])?, near))
        };
        // With the temperature of its place is a law by itself.
        if !search.candidates[fit.members[m]].may_run {
            let constants = screen.constants();
            return if constants.is_empty() { vec![self.as_found(fit, m, 0.0)] } else { constants };
        }
        let mut all = self.of_laws(&screen, &near);
        // One curve over each variable at most: the others are the same with another length.
        unknown.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let over = |choice: &Choice| choice.freedom.curve.map(|((variable, _), _)| variable);
        let firsts: Vec<usize> = (0..unknown.len()).filter(|i| unknown[..*i].iter().all(|o| over(o) != over(&unknown[*i]))).collect();
        all.extend(firsts.into_iter().take(3).map(|i| unknown[i].clone()));
        best(all)
    }

    /// No known law: the curve or freedom with which the member was found.
    fn as_found(&self, fit: &Fit, m: usize, gain: f64) -> Choice {
        Choice { means: Means::Unknown, freedom: fit.freedoms[m], gain, price: 0.0, number: None }
    }

    /// The constant and the laws of functions of a member.
    fn of_laws(&self, screen: &Screen, near: &dyn Fn(usize) -> Option<(Functions, Vec<Single>)>) -> Vec<Choice> {
        let [one, two] = self.laws.counts();
        let (one, two) = (screen.choice_price + (one as f64).ln(), 2.0 * screen.choice_price + (two as f64).ln());
        let mut all: Vec<Choice> = screen.constants();
        for family in self.laws.families() {
            if family.form.is_alone {
                all.extend(screen.of_family(self.laws, family, false, one, near));
            }
            if family.form.is_beside {
                all.extend(screen.of_family(self.laws, family, true, two, near));
            }
        }
        all.extend(self.laws.products().filter_map(|p| screen.of_functions(self.laws, &[p], two)));
        all.extend(self.laws.sums().into_iter().filter_map(|(a, b)| screen.of_functions(self.laws, &[a, b], two)));
        all
    }

    /// A way, fitted to the end, with the logarithm of its evidence: minus infinity where it does not come to rest.
    fn fitted(&self, search: &Search<'_>, fit: &Fit, way: usize, of: &[&Choice]) -> Option<(f64, bool, FoundWay)> {
        let count = fit.members.len();
        let mut begun = fit.clone();
        for (m, choice) in of.iter().enumerate() {
            begun.freedoms[m] = choice.freedom;
            match &choice.means {
                Means::Law { deviation, .. } => begun.freedoms[m].curve = Some((self.curve(way, m, count), *deviation)),
                Means::Constant | Means::Unknown => {}
            }
        }
        let fitted = search.fit_from(begun, Sought::All, true);
        let log = fitted.log_evidence - of.iter().map(|choice| choice.price).sum::<f64>();
        let explained = search.explained(&search.linear_about(&fitted), fitted.looseness, &search.followed(&fitted.freedoms))?;
        let posterior = explained.posterior(&fitted.freedoms, fitted.looseness)?;
        let cause = |(m, choice): (usize, &&Choice)| {
            let deviations: Vec<f64> = posterior.variances(m).into_iter().map(f64::sqrt).collect();
            self.cause(search, choice, &fitted.amplitudes[m], &deviations)
        };
        let is_unknown = of.iter().all(|choice| matches!(choice.means, Means::Unknown));
        let causes = of.iter().enumerate().map(cause).collect();
        let functions = self.functions(way, of).into_iter().map(|(curve, factors)| (curve, factors.to_vec())).collect();
        Some((log, is_unknown, FoundWay { causes, probability: 0.0, fit: fitted, functions }))
    }

    /// A member under its law, from its amplitudes in the rows and their deviations.
    fn cause(&self, search: &Search<'_>, choice: &Choice, amplitudes: &[f64], deviations: &[f64]) -> FoundCause {
        let most = largest(amplitudes);
        let found = |rule, amplitude| FoundCause { rule, number: choice.number.clone(), amplitude };
        match &choice.means {
            Means::Constant => found(None, (amplitudes[most], deviations[most])),
            Means::Law { singles, with_constant: false, .. } if singles.len() == 1 => {
                let own = &singles[0];
                let at = largest(&own.factors);
                let coefficient = coefficients(&[&own.factors], amplitudes)[0];
                found(Some(own.rule.clone()), (coefficient, deviations[at] / own.factors[at].abs()))
            }
            Means::Law { singles, with_constant, .. } => {
                let mut parts: Vec<FoundLaw> = with_constant.then_some(FoundLaw::One).into_iter().collect();
                parts.extend(singles.iter().map(|single| single.part.clone()));
                let factors: Vec<Vec<f64>> = parts.iter().map(|part| self.laws.factors(part)).collect();
                let own = coefficients(&factors.iter().map(Vec::as_slice).collect::<Vec<_>>(), amplitudes);
                let whole = not_nothing(amplitudes[most]);
                let [first, second] = [0, 1].map(|i| (own[i] / whole, parts[i].clone()));
                found(Some(Rule::Found(FoundLaw::Sum(vec![first, second]))), (whole, deviations[most]))
            }
            Means::Unknown => {
                let whole = not_nothing(amplitudes[most]);
                let in_rows = || self.laws.over_all_rows(amplitudes.iter().map(|a| a / whole));
                let law = match choice.freedom.curve {
                    None => FoundLaw::Rows(Sequence::Free(in_rows(), mean(amplitudes) / whole)),
                    Some((curve, _)) => match &self.axes[curve.0] {
                        None => FoundLaw::Rows(Sequence::Curve(in_rows())),
                        Some(axis) => {
                            let points = points(search, curve, amplitudes, &self.variables[curve.0]);
                            let own = points.into_iter().map(|(si, a)| (si / axis.per_unit, a / whole)).collect();
                            FoundLaw::over(axis, Course::Curve(own))
                        }
                    },
                };
                found(Some(Rule::Found(law)), (whole, deviations[most]))
            }
        }
    }
}

/// Laws of one member about the set as it was found.
struct Screen {
    /// The constant, then those of the laws.
    functions: Functions,
    /// Sizes of an amplitude, each with its price.
    sizes: Vec<(f64, f64)>,
    choice_price: f64,
}

impl Screen {
    fn constants(&self) -> Vec<Choice> {
        let of = |(size, price): &(f64, f64)| {
            let gain = self.functions.gain(&[(0, *size)])? - price;
            Some(Choice { means: Means::Constant, freedom: Freedom::constant(*size), gain, price: 0.0, number: None })
        };
        let best = self.sizes.iter().filter_map(of).max_by(|a, b| a.gain.total_cmp(&b.gain));
        best.into_iter().collect()
    }

    /// The size with the most evidence, that, and the price of the size that it has in it.
    fn sized(&self, functions: &Functions, terms: &[usize]) -> Option<(f64, f64, f64)> {
        let of = |(size, price): &(f64, f64)| {
            let terms: Vec<(usize, f64)> = terms.iter().map(|f| (*f, *size)).collect();
            Some((*size, functions.gain(&terms)? - price, *price))
        };
        self.sizes.iter().filter_map(of).max_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn choice(&self, singles: Vec<Single>, with_constant: bool, (size, gain, of_size): (f64, f64, f64), price: f64) -> Choice {
        let freedom = Freedom::constant(if with_constant { size } else { 0.0 });
        // The engine counts the size of the constant itself.
        let of_size = if with_constant { 0.0 } else { of_size };
        let means = Means::Law { singles, with_constant, deviation: size };
        Choice { means, freedom, gain: gain - price, price: price + of_size, number: None }
    }

    /// A law of given functions.
    fn of_functions(&self, laws: &Laws<'_>, places: &[usize], price: f64) -> Option<Choice> {
        let terms: Vec<usize> = places.iter().map(|p| p + 1).collect();
        let best = self.sized(&self.functions, &terms)?;
        Some(self.choice(places.iter().map(|p| laws.single(*p).clone()).collect(), false, best, price))
    }

    /// The best law of a family: all its members together are one law, whose number is shared out evenly before the data are seen.
    fn of_family(
        &self,
        laws: &Laws<'_>,
        family: &Family,
        with_constant: bool,
        price: f64,
        near: &dyn Fn(usize) -> Option<(Functions, Vec<Single>)>,
    ) -> Option<Choice> {
        let constant = with_constant.then_some(0);
        let of = |p: &usize| {
            let terms: Vec<usize> = constant.into_iter().chain([p + 1]).collect();
            Some((*p, self.sized(&self.functions, &terms)?))
        };
        let tried: Vec<(usize, (f64, f64, f64))> = family.members.iter().filter_map(of).collect();
        let (best, found) = *tried.iter().max_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
        let gains: Vec<f64> = tried.iter().map(|(_, (_, gain, _))| *gain).collect();
        let mean = log_sum(&gains) - (family.members.len() as f64).ln();
        let single = laws.single(best).clone();
        if single.exponent().is_none() {
            return Some(self.choice(vec![single], with_constant, found, price + found.1 - mean));
        }
        // Between two exponents of the grid there may be a better one.
        let all: Vec<(f64, f64)> = tried.iter().map(|(p, (_, gain, _))| (exponent(laws.single(*p)), *gain)).collect();
        let (functions, between) = near(best)?;
        let own = |(f, single): (usize, Single)| {
            let terms: Vec<usize> = constant.into_iter().chain([f + 1]).collect();
            Some((single, self.sized(&functions, &terms)?))
        };
        let fine: Vec<(Single, (f64, f64, f64))> = between.into_iter().enumerate().filter_map(own).collect();
        let (single, sized) = match fine.iter().max_by(|a, b| a.1.1.total_cmp(&b.1.1)) {
            Some(finest) => finest.clone(),
            None => (single, found),
        };
        let fine: Vec<(f64, f64)> = fine.iter().map(|(single, (_, gain, _))| (exponent(single), *gain)).collect();
        let of_fine = log_sum(&fine.iter().map(|(_, gain)| *gain).collect::<Vec<_>>()) - (EXPONENT_COUNT.0 as f64).ln();
        let (mean, spread) = if of_fine > mean { (of_fine, deviation(&fine)) } else { (mean, deviation(&all)) };
        let number = (!with_constant).then(|| number(exponent(&single), spread, (mean - sized.1).exp()));
        Some(Choice { number, ..self.choice(vec![single], with_constant, sized, price + sized.1 - mean) })
    }
}

fn exponent(single: &Single) -> f64 {
    single.exponent().map_or(1.0, f64::from) / 100.0
}

/// The number of a power.
fn number(value: f64, spread: f64, share: f64) -> LawNumber {
    let half = TWO_SIDED_90 * spread.max(0.005);
    LawNumber {
        name: "exponent",
        value,
        low: value - half,
        high: value + half,
        unit: "1",
        share: share.min(1.0),
        deviation: 100.0 * spread,
    }
}

/// Standard deviation of numbers whose log evidence is given.
fn deviation(numbers: &[(f64, f64)]) -> f64 {
    let all = log_sum(&numbers.iter().map(|(_, log)| *log).collect::<Vec<_>>());
    let mean = |of: &dyn Fn(f64) -> f64| numbers.iter().map(|(x, log)| of(*x) * (log - all).exp()).sum::<f64>();
    let middle = mean(&|x| x);
    mean(&|x| (x - middle).powi(2)).sqrt()
}

fn log_sum(logs: &[f64]) -> f64 {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if most.is_finite() { most + logs.iter().map(|log| (log - most).exp()).sum::<f64>().ln() } else { most }
}

/// The best choices, best first, the best by no known law among them.
fn best(mut all: Vec<Choice>) -> Vec<Choice> {
    all.retain(|choice| !choice.gain.is_nan() && choice.gain > f64::NEG_INFINITY);
    all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let is_unknown = |choice: &Choice| matches!(choice.means, Means::Unknown);
    let unknown = all.iter().find(|choice| is_unknown(choice)).cloned();
    all.truncate(MOST_LAWS);
    if !all.iter().any(is_unknown) {
        all.extend(unknown);
    }
    all
}

/// Combinations of one choice for each member: those with the most evidence, and no known law for all.
fn combined<'a>(choices: &'a [Vec<Choice>]) -> Vec<Vec<&'a Choice>> {
    let gain = |of: &[&Choice]| of.iter().map(|choice| choice.gain).sum::<f64>();
    let mut all: Vec<Vec<&'a Choice>> = vec![Vec::new()];
    for own in choices {
        let mut more = Vec::with_capacity(all.len() * own.len());
        for before in &all {
            more.extend(own.iter().map(|choice| before.iter().copied().chain([choice]).collect::<Vec<&'a Choice>>()));
        }
        all = more;
        all.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
        all.truncate(MOST_WAYS);
    }
    let is_unknown = |choice: &&Choice| matches!(choice.means, Means::Unknown);
    if !all.iter().any(|of| of.iter().all(is_unknown)) {
        let unknown: Option<Vec<&Choice>> = choices.iter().map(|own| own.iter().find(|choice| is_unknown(choice))).collect();
        all.extend(unknown);
    }
    all
}

/// Ways with their probabilities, most probable first, from the logarithms of their evidence.
fn told(mut ways: Vec<(f64, bool, FoundWay)>) -> Vec<FoundWay> {
    ways.sort_by(|a, b| b.0.total_cmp(&a.0));
    let all = log_sum(&ways.iter().map(|(log, ..)| *log).collect::<Vec<_>>());
    let unknown = ways.iter().position(|(_, is_unknown, _)| *is_unknown);
    let kept = ways.into_iter().enumerate().filter(|(i, (log, ..))| *i == 0 || Some(*i) == unknown || (log - all).exp() > LEAST);
    let mut kept: Vec<FoundWay> =
        kept.take(MOST_WAYS).map(|(_, (log, _, way))| FoundWay { probability: (log - all).exp(), ..way }).collect();
    let sum: f64 = kept.iter().map(|way| way.probability).sum();
    kept.iter_mut().for_each(|way| way.probability /= sum);
    kept
}

/// Where some numbers are largest in size.
pub fn largest(numbers: &[f64]) -> usize {
    (0..numbers.len()).max_by(|a, b| numbers[*a].abs().total_cmp(&numbers[*b].abs())).unwrap_or(0)
}

pub fn not_nothing(number: f64) -> f64 {
    if number == 0.0 { f64::MIN_POSITIVE.sqrt() } else { number }
}

/// Mean of some numbers.
pub fn mean(numbers: &[f64]) -> f64 {
    numbers.iter().sum::<f64>() / numbers.len().max(1) as f64
}

/// Coefficients of functions of the rows by which they make amplitudes, which are a sum of them.
pub fn coefficients(functions: &[&[f64]], amplitudes: &[f64]) -> Vec<f64> {
    let columns: Vec<DVector<f64>> = functions.iter().map(|own| DVector::from_column_slice(own)).collect();
    let matrix = DMatrix::from_columns(&columns);
    let solved = matrix.svd(true, true).solve(&DVector::from_column_slice(amplitudes), 1e-12);
    solved.map_or_else(|_| vec![0.0; functions.len()], |found| found.iter().copied().collect())
}

/// Points of a curve at the levels of its variable and half way between them, in the variable's SI unit, with the amplitude there.
fn points(search: &Search<'_>, curve: Curve, amplitudes: &[f64], values: &[f64]) -> Vec<(f64, f64)> {
    let mut levels = values.to_vec();
    levels.sort_by(f64::total_cmp);
    let apart = 1e-3 * (levels[levels.len() - 1] - levels[0]);
    levels.dedup_by(|next, last| *next - *last <= apart);
    let n = levels.len();
    let kept = n.min(MOST_POINTS);
    let levels: Vec<f64> = (0..kept).map(|k| levels[k * (n - 1) / (kept - 1).max(1)]).collect();
    let mut at: Vec<f64> = levels.windows(2).flat_map(|pair| [pair[0], 0.5 * (pair[0] + pair[1])]).collect();
    at.extend(levels.last());
    at.iter().copied().zip(search.profiles.continued(curve, values, amplitudes, &at)).collect()
}
