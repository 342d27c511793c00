//! How an answer stands beside what was hidden.

use coldplate_describe::machine::{HeatedPlace, Machine, Place};
use coldplate_diagnose::{Cause, Certainty, Diagnosis, Explanation, Law, PlaceSet, Scales, Verdict, hypotheses};
use coldplate_evidence::measurement::Whitener;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::{Case, Hidden};

/// How an answer stands beside what was hidden.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Score {
    /// Whether anything was found wrong.
    pub detected: bool,
    /// Whether the first explanation touches the right places.
    pub group: bool,
    /// Whether kinds and places of the first explanation are right.
    pub exact: bool,
    /// Whether they are right where two names of the same data count as one.
    pub right: bool,
    /// How many of the hidden effects are named, on any rung of the ladder.
    pub named: usize,
    /// Whether the set that is not refuted holds the truth, or the ladder names all of it.
    pub in_set: bool,
    /// Whether a cause was named with probability 0.9 or more.
    pub confident: bool,
    /// Whether one was so named that was not hidden.
    pub misnamed: bool,
    /// Whether one was so named where nothing that was hidden is at the place of the one so named.
    pub misplaced: bool,
    /// Whether the law of a single effect is named with probability 0.9 or more, and another one was hidden. A curve through the points is no law.
    pub wrong_law: bool,
    /// Whether the catalogue has all that was hidden, by kind and place.
    pub is_known: bool,
    /// Stated probability that the causes of the first explanation act, by kind and place, alone or with others; nothing where none is named.
    pub stated: f64,
    /// Whether they do: each of them is among what was hidden.
    pub is_so: bool,
    /// Whether the 90 % interval holds the true amplitude, where the cause is right.
    pub covered: Option<bool>,
    /// Detectability of the effect; of several, of the one that shows least beside the others.
    pub d: f64,
    /// The true amplitude beside the interval, in standard deviations of it, where the cause is right.
    pub off: Option<f64>,
    /// The sets that were weighed, most probable first.
    pub sets: Vec<WeighedSet>,
}

/// A set of causes as it was weighed, beside what was hidden.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WeighedSet {
    /// How many causes it has.
    pub count: usize,
    /// Logarithm of its evidence over that of the machine as it is.
    pub lead: f64,
    /// Posterior probability of the set.
    pub probability: f64,
    /// Whether its kinds and places are what was hidden, and nothing else; that of no cause where nothing was hidden.
    pub is_right: bool,
    /// Whether the causes of the first explanation are in it, by kind and place.
    pub has_first: bool,
}

/// Detectability of the one of some effects that shows least, beside the others.
pub fn least(shifts: &[Vec<f64>], whitener: &Whitener) -> f64 {
    let white: Vec<Vec<f64>> = shifts.iter().map(|shift| whitener.apply(shift)).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let n = white.len();
    let gram = DMatrix::from_fn(n, n, |i, j| dot(&white[i], &white[j]));
    let inverse = gram.try_inverse();
    let own = |i: usize| inverse.as_ref().map_or(0.0, |m| 1.0 / m[(i, i)].max(1e-300));
    (0..n).map(own).fold(f64::INFINITY, f64::min).max(0.0).sqrt()
}

/// Holds an answer beside the truth.
pub fn score(case: &Case, found: &Diagnosis) -> Score {
    let machine = &case.problem.study.model.machine;
    let d = if case.shifts.is_empty() { 0.0 } else { least(&case.shifts, &found.whitener) };
    let detected = found.verdict != Verdict::Consistent;
    let is_same = |h: &Hidden, p: &Cause| is_same(machine, h, p);
    let is_hidden = |p: &Cause| case.hidden.iter().any(|h| is_same(h, p));
    let holds = |causes: &[Cause], is: &dyn Fn(&Hidden, &Cause) -> bool| -> bool {
        case.hidden.iter().all(|h| causes.iter().any(|p| is(h, p))) && causes.iter().all(|p| case.hidden.iter().any(|h| is(h, p)))
    };
    let truth = |e: &Explanation| holds(&e.causes, &is_same);
    let touches = |p: &Cause, h: &Hidden| {
        let own = parts_of(machine, h);
        p.hypothesis.place == h.place || p.hypothesis.parts.iter().any(|q| own.contains(q))
    };
    let first = found.explanations.first().filter(|_| detected);
    let stated = found.certainties.iter().find(|level| level.certainty == Certainty::Kind).map_or(0.0, |level| level.probability);
    let exact = first.is_some_and(|e| holds(&e.causes, &|h, p| p.hypothesis.kind() == h.kind && p.hypothesis.place == h.place));
    let scales = Scales::of(&case.problem.data, machine);
    // Another law has another amplitude.
    let single = first.filter(|f| exact && f.causes.len() == 1).map(|f| &f.causes[0]);
    let hidden = case.hidden.first();
    let comparable = single.zip(hidden).filter(|(part, hidden)| {
        let is_amplitude = hidden.outside.is_none() && hidden.kind != "swapped sensors";
        is_amplitude && part.hypothesis.law == hidden.law && part.hypothesis.kind() == hidden.kind
    });
    let ladder: Vec<&Cause> = match found.rungs.as_slice() {
        [] => first.iter().flat_map(|e| &e.causes).collect(),
        rungs => rungs.iter().flat_map(|rung| &rung.causes).collect(),
    };
    let law = |part: &Cause, hidden: &Hidden| match &hidden.outside {
        Some(_) => part.hypothesis.law_words().contains(NO_LAW),
        None => is_same_law(case, (&scales, hidden.law), (&found.places.scales, part.hypothesis.law)),
    };
    let is_certain_of_law = found.level.certainty == Certainty::Law;
    let catalogue = hypotheses(&case.problem.study, &case.problem.data, &[]);
    let named = case.hidden.iter().filter(|h| ladder.iter().any(|p| is_same(h, p))).count();
    let confident = found.verdict == Verdict::Explained;
    let has = |set: &PlaceSet, cause: &Cause| {
        set.members.iter().any(|member| member.hypothesis.kind_and_place() == cause.hypothesis.kind_and_place())
    };
    let weighed = |set: &PlaceSet| WeighedSet {
        has_first: first.is_some_and(|e| e.causes.iter().all(|cause| has(set, cause))),
        count: set.members.len(),
        lead: set.lead,
        probability: set.probability,
        is_right: match set.members.len() {
            0 => case.hidden.is_empty(),
            _ => set.ways.iter().any(|way| holds(&way.causes, &is_same)),
        },
    };
    Score {
        misnamed: confident && !ladder.iter().all(|p| is_hidden(p)),
        misplaced: confident && !ladder.iter().all(|p| case.hidden.iter().any(|h| touches(p, h) || is_near(machine, h, p))),
        wrong_law: confident && is_certain_of_law && single.zip(hidden).is_some_and(|(part, hidden)| !law(part, hidden)),
        is_known: case.hidden.iter().all(|h| catalogue.iter().any(|own| own.kind() == h.kind && own.place == h.place)),
        detected,
        group: first.is_some_and(|e| case.hidden.iter().all(|h| e.causes.iter().any(|p| touches(p, h)))),
        exact,
        right: first.is_some_and(truth),
        named,
        in_set: detected && (found.set.iter().any(|i| truth(&found.explanations[*i])) || named == case.hidden.len()),
        confident,
        stated,
        is_so: first.is_some_and(|e| e.causes.iter().all(is_hidden)),
        covered: comparable.map(|(part, hidden)| {
            let (low, high) = part.interval();
            (low..=high).contains(&hidden.amplitude_in(&scales))
        }),
        d,
        off: comparable.map(|(part, hidden)| (hidden.amplitude_in(&scales) - part.amplitude) / part.deviation),
        sets: found.places.sets.iter().filter(|set| set.lead.is_finite()).map(weighed).collect(),
    }
}

/// Whether a cause is what was hidden: by kind and place, or where two names are the same data. More heat of a source in proportion
/// to the speed is heat at its place; a node that has a contact with the room loses more by it or by a leak.
fn is_same(machine: &Machine, h: &Hidden, p: &Cause) -> bool {
    let (kind, place) = (p.hypothesis.kind(), &p.hypothesis.place);
    if kind == h.kind && *place == h.place {
        return true;
    }
    let heats = |source: &str, group: &str| {
        let of_group = |heated: &HeatedPlace| heated.block.is_none() && name(machine, &heated.place) == group;
        machine.sources.iter().any(|s| s.name == source && s.places.iter().all(of_group))
    };
    let to_room = |contact: &str, group: &str| {
        let found = machine.contacts.iter().find(|c| c.name == contact);
        found.is_some_and(|c| {
            let fixed = |p: &Place| matches!(p, Place::Node(n) if machine.nodes[*n].fixed.is_some());
            c.between.iter().any(fixed) && c.between.iter().any(|p| name(machine, p) == group)
        })
    };
    let in_proportion = |law: Law| law != Law::Constant;
    match (h.kind.as_str(), kind) {
        ("source factor", "heat source") => heats(&h.place, place) && in_proportion(p.hypothesis.law),
        // By a law outside the list, the factor may be a curve as well as the heat.
        ("heat source", "source factor") => heats(place, &h.place) && (in_proportion(h.law) || h.outside.is_some()),
        ("leak to the surroundings", "contact conductance") => to_room(place, &h.place),
        ("contact conductance", "leak to the surroundings") => to_room(&h.place, place),
        _ => false,
    }
}

/// How a curve through the points is told.
const NO_LAW: &str = "no known law";

/// Cosine of two laws over the conditions of the data from which on they are one law: a speed and its square have 0.97.
const ALIKE: f64 = 0.99;

/// Whether two laws are one in the conditions of the data. What a sensor's gain does is in proportion to its temperature by itself.
fn is_same_law(case: &Case, hidden: (&Scales, Law), named: (&Scales, Law)) -> bool {
    if hidden.1 == named.1 || hidden.1 == Law::Temperature {
        return true;
    }
    let conditions: Vec<_> = case.problem.data.rows.iter().map(|row| &row.condition).collect();
    let [a, b] = [hidden, named].map(|(scales, law)| scales.factors(law, &conditions));
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    dot(&a, &b) >= ALIKE * (dot(&a, &a) * dot(&b, &b)).sqrt()
}

fn name<'a>(machine: &'a Machine, place: &Place) -> &'a str {
    match place {
        Place::Part(p) => &machine.parts[*p].name,
        Place::Face(f) => &machine.parts[f.part].name,
        Place::Node(n) => &machine.nodes[*n].name,
    }
}

/// Parts that what is hidden touches.
fn parts_of(machine: &Machine, h: &Hidden) -> Vec<String> {
    let mut parts: Vec<String> = h.place.split(" - ").map(String::from).collect();
    if let Some(contact) = machine.contacts.iter().find(|c| h.kind.contains("contact") && c.name == h.place) {
        parts.extend(contact.between.iter().map(|place| name(machine, place).to_string()));
    }
    parts
}

/// Whether a cause is at the part that what is hidden is about: that a source heats, that a channel runs through, any of what is
/// everywhere.
fn is_near(machine: &Machine, h: &Hidden, p: &Cause) -> bool {
    let mut parts: Vec<&str> = Vec::new();
    if let Some(source) = machine.sources.iter().find(|s| h.kind == "source factor" && s.name == h.place) {
        parts.extend(source.places.iter().map(|heated| name(machine, &heated.place)));
    }
    if let Some(channel) = machine.channels.iter().find(|c| c.name == h.place) {
        parts.push(&machine.parts[channel.part].name);
    }
    let is_everywhere = h.kind.starts_with("all ") || machine.circuits.iter().any(|c| c.name == h.place);
    is_everywhere || p.hypothesis.parts.iter().any(|part| parts.contains(&part.as_str()))
}
