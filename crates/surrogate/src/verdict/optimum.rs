//! The best acceptable condition: which values of some variables make a formula smallest, or largest, while all limits are kept?
//!
//! The free variables are tried at random places of their ranges and at the corners. The best of these places start searches by
//! linear approximations (M. J. D. Powell's COBYLA), which need no derivatives. Formulas with kinks (`abs`, `min`, `max`, the
//! smallest margin) can have sharp bent valleys, which such searches do not follow to their end. The condition returned has
//! itself been checked to be acceptable.

use std::cell::RefCell;

use cobyla::{RhoBeg, StopTols, minimize};
use coldplate_runtime::{Surrogate, Variable};

use super::slack::{Distance, Slack};
use super::{OutOfRange, SurrogateAnswer, condition, outside_besides, query_at};
use coldplate_base::error::{Error, Location, Result};
use coldplate_base::formula::{Formula, FormulaNames, FormulaValues, suffix};
use coldplate_base::random::Random;
use coldplate_base::units::Dimension;

/// Number of random places that are tried before the searches. Chosen: more find narrower optima, each costs a query.
const PLACES: usize = 4096;
/// Number of searches, from the best places. Chosen: more find more local optima, each costs up to [`EVALUATIONS`]
/// queries.
const SEARCHES: usize = 8;
/// Most evaluations of one search, a count. Chosen: a search along a valley needs hundreds.
const EVALUATIONS: usize = 2000;
/// Most repetitions of the search from the best place found, a count. Chosen: a repetition starts with fresh
/// approximations, and mostly one or two still gain.
const ROUNDS: usize = 6;
/// Least gain that is worth another repetition, as a share of the range of values at the places tried. Chosen: less is no
/// difference to a user.
const GAIN: f64 = 1e-7;
/// First step of a search, as a fraction of the ranges. Chosen: small enough to stay in the valley that the start was
/// chosen for.
const STEP: f64 = 0.1;
/// Step at which a search stops, as a fraction of the ranges. Chosen: far below the digits that are shown.
const RESOLUTION: f64 = 1e-9;
/// Number of halvings of the way from the best acceptable place to the end of a search. Chosen: nearly the digits of
/// double precision.
const HALVINGS: usize = 50;
/// Fraction of a range within which a value counts as its end, if the cost stays the same to within this share.
/// Chosen: above the accuracy of a search.
const NEAR_END: f64 = 1e-6;
/// Largest number that is passed to a search, in multiples of the range of values at the places tried. Chosen: larger
/// ones would only spoil its linear approximations.
const FAR: f64 = 1e3;
/// Name of the smallest margin of any limit in formulas.
const SMALLEST_MARGIN: &str = "smallest_margin";

/// Sense of a search: smallest or largest value of a formula.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sense {
    /// The smallest.
    Minimise,
    /// The largest.
    Maximise,
}

/// A variable that may be chosen, between two values in its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeVariable {
    /// Index among the surrogate's variables.
    pub index: usize,
    /// Smallest value that may be chosen.
    pub low: f64,
    /// Largest value that may be chosen.
    pub high: f64,
}

/// The formula to be made smallest or largest, of the variables, the points and the smallest margin.
#[derive(Debug, Clone)]
pub struct Objective {
    sense: Sense,
    formula: Formula,
}

/// The answer to the question for the best condition.
#[derive(Debug, Clone, PartialEq)]
pub enum Optimum {
    /// The best acceptable condition.
    Found {
        /// Value of the formula there.
        value: f64,
        /// Temperatures and verdict there, with the chosen condition.
        answer: SurrogateAnswer,
    },
    /// No condition in the ranges is acceptable.
    Nowhere {
        /// The answer at the condition that comes closest.
        answer: SurrogateAnswer,
    },
    /// The other variables lie outside the fitted range, where nothing is acceptable for sure.
    OutsideRange(Vec<OutOfRange>),
}

/// A name of the surrogate as formulas know it: `coolant_flow_L_min`, `Y_motor_degC`.
fn name_of(name: &str, unit: &str) -> String {
    let plain: String = name.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
    match suffix(unit) {
        unit if unit.is_empty() || unit == "1" => plain,
        unit => format!("{plain}_{unit}"),
    }
}

/// The names that formulas over a surrogate may use, in the order of `Objective::value`: the variables, varied and held, and
/// the points, each with its unit, and the smallest margin of any limit.
pub fn names(surrogate: &Surrogate<'_>) -> Vec<String> {
    let variables = condition::variables(surrogate).into_iter().map(|v| name_of(v.name, v.unit));
    let points = surrogate.points().map(|p| name_of(p.name, p.unit));
    variables.chain(points).chain([SMALLEST_MARGIN.to_owned()]).collect()
}

impl Objective {
    /// Reads a formula of [`names`].
    ///
    /// # Errors
    /// The text is no formula, or has other names.
    pub fn parse(surrogate: &Surrogate<'_>, sense: Sense, text: &str) -> Result<Self> {
        let mut known = FormulaNames::default();
        for (place, name) in names(surrogate).iter().enumerate() {
            // Names that no formula can contain, and the second of two equal ones, keep their place under a name that nobody
            // writes.
            if known.add(name).is_err() {
                known.add(&format!("_{place}_"))?;
            }
        }
        let formula = Formula::parse(text, Dimension::NUMBER, Some("1"), &known, Location::default())?;
        if formula.slots().next().is_none() {
            return Err(Error::input("this formula is the same everywhere")
                .read(text)
                .help(format!("use {}", names(surrogate).join(", "))));
        }
        Ok(Self { sense, formula })
    }

    /// The text of the formula.
    pub fn text(&self) -> &str {
        self.formula.text()
    }

    /// Whether the smallest or the largest value is wanted.
    pub fn sense(&self) -> Sense {
        self.sense
    }

    /// The value at a condition `x` of all variables, where the points have `values`; `None` where it is no number.
    fn value(&self, surrogate: &Surrogate<'_>, x: &[f64], values: &[f64]) -> Option<f64> {
        let varied = x.get(..surrogate.variable_count()).unwrap_or(x);
        let margins = (0..surrogate.limit_count()).filter_map(|i| surrogate.limit_value(i, varied, values)).map(|l| l.margin);
        let margin = margins.fold(f64::INFINITY, f64::min);
        self.formula.evaluate(&FormulaValues(x.iter().chain(values).copied().chain([margin]).collect())).ok()
    }
}

/// The condition that makes `objective` smallest or largest among those that are acceptable with the probability `confidence`.
/// `x` holds all variables; those of `free` are chosen.
///
/// # Errors
/// A free variable that does not exist, was held fixed or is named twice, bounds outside its fitted range, a surrogate without
/// limits, a condition of wrong length, a formula that is a number nowhere.
pub fn best(surrogate: &Surrogate<'_>, x: &[f64], free: &[FreeVariable], objective: &Objective, confidence: f64) -> Result<Optimum> {
    let variables = condition::variables(surrogate);
    if surrogate.limit_count() == 0 {
        return Err(Error::input("this surrogate holds no limits, so nothing says what is acceptable"));
    }
    if x.len() != variables.len() {
        return Err(Error::input("a condition of this surrogate has another number of values").read(x.len()));
    }
    for (place, own) in free.iter().enumerate() {
        check(own, surrogate, &variables)?;
        if free[..place].iter().any(|other| other.index == own.index) {
            return Err(Error::input("this variable is free twice").at_key(variables[own.index].name));
        }
    }
    let mut start = x.to_vec();
    free.iter().for_each(|own| start[own.index] = own.low);
    let indices: Vec<usize> = free.iter().map(|own| own.index).collect();
    let missing = outside_besides(surrogate, query_at(surrogate, &start, confidence)?.outside, &indices);
    if !missing.is_empty() {
        return Ok(Optimum::OutsideRange(missing));
    }
    let search = Search { surrogate, x: start, free, objective, judge: RefCell::new(Slack::new(surrogate, confidence)) };
    let tried = search.places();
    let best = match search.improve(&tried)? {
        Some(place) => place,
        None => {
            let closest = tried.iter().max_by(|a, b| a.distance.slack.total_cmp(&b.distance.slack));
            let closest = closest.map_or_else(|| search.x.clone(), |place| search.condition(&place.at));
            return Ok(Optimum::Nowhere { answer: query_at(surrogate, &closest, confidence)? });
        }
    };
    let answer = query_at(surrogate, &search.condition(&best.at), confidence)?;
    Ok(Optimum::Found { value: best.objective, answer })
}

/// Whether a variable may be free between these values.
pub(super) fn check(free: &FreeVariable, surrogate: &Surrogate<'_>, variables: &[Variable<'_>]) -> Result<()> {
    let Some(variable) = variables.get(free.index) else {
        return Err(Error::input("this surrogate has no such variable").read(free.index));
    };
    let Variable { name, unit, low, high } = *variable;
    if free.index >= surrogate.variable_count() || low == high {
        return Err(Error::input(format!("'{name}' was held at {low} {unit} when the surrogate was fitted"))
            .at_key(name)
            .help("free a variable that was varied"));
    }
    if !(low <= free.low && free.low < free.high && free.high <= high) {
        return Err(Error::input("these bounds are not in the fitted range, or not in order")
            .at_key(name)
            .read(format!("{} to {} {unit}", free.low, free.high))
            .help(format!("it is fitted from {low} to {high} {unit}")));
    }
    Ok(())
}

/// A place in the ranges of the free variables, each from zero to one.
#[derive(Debug, Clone)]
struct Place {
    at: Vec<f64>,
    objective: f64,
    distance: Distance,
}

struct Search<'a, 'b> {
    surrogate: &'a Surrogate<'b>,
    x: Vec<f64>,
    free: &'a [FreeVariable],
    objective: &'a Objective,
    judge: RefCell<Slack<'a, 'b>>,
}

impl Search<'_, '_> {
    fn condition(&self, at: &[f64]) -> Vec<f64> {
        let mut x = self.x.clone();
        for (own, share) in self.free.iter().zip(at) {
            // The ends are hit exactly.
            x[own.index] = if *share >= 1.0 { own.high } else { own.low + (own.high - own.low) * share.max(0.0) };
        }
        x
    }

    fn look(&self, at: &[f64]) -> Place {
        let x = self.condition(at);
        let mut judge = self.judge.borrow_mut();
        let distance = judge.at(&x[..self.surrogate.variable_count()]);
        let objective = self.objective.value(self.surrogate, &x, judge.values()).unwrap_or(f64::NAN);
        Place { at: at.to_vec(), objective, distance }
    }

    /// The corners, the middle, and random places; the same in every run.
    fn places(&self) -> Vec<Place> {
        let count = self.free.len();
        let corners = (0..1_usize << count).map(|bits| (0..count).map(|i| f64::from(u8::from(bits >> i & 1 == 1))).collect());
        let mut random = Random::new(1);
        let inside: Vec<Vec<f64>> = (0..PLACES).map(|_| (0..count).map(|_| random.unit()).collect()).collect();
        corners.chain([vec![0.5; count]]).chain(inside).map(|at: Vec<f64>| self.look(&at)).collect()
    }

    /// Cost of a place: the value to be made smallest.
    fn cost(&self, place: &Place) -> f64 {
        match self.objective.sense {
            Sense::Minimise => place.objective,
            Sense::Maximise => -place.objective,
        }
    }

    fn is_good(&self, place: &Place) -> bool {
        place.distance.slack >= 0.0 && place.objective.is_finite()
    }

    /// The best acceptable place of searches from the places tried; `None` if no acceptable place was met.
    fn improve(&self, tried: &[Place]) -> Result<Option<Place>> {
        let costs = tried.iter().map(|place| self.cost(place)).filter(|cost| cost.is_finite());
        let (low, high) = costs.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), cost| (low.min(cost), high.max(cost)));
        if low > high {
            return Err(Error::input("this formula is a number nowhere in the ranges").read(self.objective.text()));
        }
        let span = if high > low { high - low } else { 1.0 };
        let mut starts: Vec<&Place> = tried.iter().filter(|place| place.objective.is_finite()).collect();
        // Acceptable places by their cost; without any, places by their distance from being acceptable.
        let rank = |place: &Place| if self.is_good(place) { (0, self.cost(place)) } else { (1, -place.distance.steer) };
        starts.sort_by(|a, b| (rank(a).0, rank(a).1).partial_cmp(&(rank(b).0, rank(b).1)).unwrap_or(std::cmp::Ordering::Equal));
        let mut best: Option<Place> = starts.first().filter(|place| self.is_good(place)).map(|place| (*place).clone());
        for start in starts.into_iter().take(SEARCHES) {
            let found = self.search(start, low, span);
            best = self.better(best, found);
        }
        for _ in 0..ROUNDS {
            let Some(start) = best.clone() else { break };
            let found = self.search(&start, low, span);
            best = self.better(best, found);
            if best.as_ref().is_none_or(|now| self.cost(&start) - self.cost(now) <= GAIN * span) {
                break;
            }
        }
        Ok(best)
    }

    fn better(&self, now: Option<Place>, found: Option<Place>) -> Option<Place> {
        match (now, found) {
            (Some(now), Some(found)) => Some(if self.cost(&found) < self.cost(&now) { found } else { now }),
            (now, found) => now.or(found),
        }
    }

    /// The best acceptable place of a search from `start`.
    fn search(&self, start: &Place, low: f64, span: f64) -> Option<Place> {
        let best: RefCell<Option<Place>> = RefCell::new(Some(start.clone()).filter(|place| self.is_good(place)));
        let keep = |place: Place| {
            let mut best = best.borrow_mut();
            if self.is_good(&place) && best.as_ref().is_none_or(|now| self.cost(&place) < self.cost(now)) {
                *best = Some(place);
            }
        };
        let bounded = |value: f64| if value.is_nan() { FAR } else { value.clamp(-FAR, FAR) };
        let cost = |at: &[f64], _: &mut ()| {
            let place = self.look(at);
            let cost = bounded((self.cost(&place) - low) / span);
            keep(place);
            cost
        };
        let margin = |at: &[f64], _: &mut ()| -bounded(-self.look(at).distance.steer);
        let bounds = vec![(0.0, 1.0); self.free.len()];
        let stop = StopTols { xtol_abs: vec![RESOLUTION; self.free.len()], ..StopTols::default() };
        let ended = minimize(cost, &start.at, &bounds, &[margin], (), EVALUATIONS, RhoBeg::All(STEP), Some(stop));
        let (Ok((_, end, _)) | Err((_, end, _))) = ended;
        // A search may end beyond the border of the acceptable conditions: halve the way back to it.
        let from = best.borrow().clone()?;
        let end = self.look(&end);
        let (mut good, mut bad) = (0.0, 1.0);
        if !self.is_good(&end) && self.cost(&end) < self.cost(&from) {
            for _ in 0..HALVINGS {
                let share = 0.5 * (good + bad);
                let between: Vec<f64> = from.at.iter().zip(&end.at).map(|(a, b)| a + share * (b - a)).collect();
                let place = self.look(&between);
                if self.is_good(&place) {
                    good = share
                } else {
                    bad = share
                }
                keep(place);
            }
        }
        // Snap to the end of the range if the value is there but for rounding and the cost stays the same.
        let found = best.into_inner()?;
        let ends = found.at.iter().map(|share| if share.min(1.0 - share) < NEAR_END { share.round() } else { *share }).collect::<Vec<_>>();
        let at_ends = self.look(&ends);
        let is_as_good = self.is_good(&at_ends) && self.cost(&at_ends) <= self.cost(&found) + NEAR_END * span;
        Some(if is_as_good { at_ends } else { found })
    }
}
