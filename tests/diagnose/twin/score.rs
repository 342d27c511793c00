//! How an answer stands beside what was hidden.

use coldplate::describe::machine::{HeatedPlace, Place};
use coldplate::evidence::diagnose::{Cause, Diagnosis, Explanation, Scales, Verdict};
use coldplate::evidence::measurement::Whitener;

use super::{Case, Hidden};

/// How an answer stands beside what was hidden.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Score {
    /// Whether anything was found wrong.
    pub detected: bool,
    /// Whether the first explanation touches the right place.
    pub group: bool,
    /// Whether kind and place of the first explanation are right.
    pub exact: bool,
    /// The same where a source's own heat and other heat at its place count as one: in proportion to the speed they are the same data.
    pub same_heat: bool,
    /// Whether the set that is not refuted holds the truth.
    pub in_set: bool,
    /// Whether a cause was named with probability 0.9 or more.
    pub confident: bool,
    /// Whether one was so named that was not hidden.
    pub misnamed: bool,
    /// Stated probability of the first explanation's kind and place.
    pub stated: f64,
    /// Whether the 90 % interval holds the true amplitude, where the cause is right.
    pub covered: Option<bool>,
    /// Detectability of the effect; of two, of the one that shows less beside the other.
    pub d: f64,
    /// The true amplitude beside the interval, in standard deviations of it, where the cause is right.
    pub off: Option<f64>,
}

/// Detectability of the one of two effects that shows less, beside the other.
pub fn least_of_two(shifts: &[Vec<f64>], whitener: &Whitener) -> f64 {
    let (a, b) = (whitener.apply(&shifts[0]), whitener.apply(&shifts[1]));
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (aa, ab, bb) = (dot(&a, &a), dot(&a, &b), dot(&b, &b));
    (aa.min(bb) * (1.0 - ab * ab / (aa * bb).max(1e-300)).max(0.0)).sqrt()
}

/// Holds an answer beside the truth.
pub fn score(case: &Case, found: &Diagnosis) -> Score {
    let d = match case.shifts.as_slice() {
        [] => 0.0,
        [one] => found.whitener.apply(one).iter().map(|v| v * v).sum::<f64>().sqrt(),
        both => least_of_two(both, &found.whitener),
    };
    let detected = found.verdict != Verdict::Consistent;
    let machine = &case.problem.study.model.machine;
    let is_named = |h: &Hidden, p: &Cause| p.hypothesis.kind() == h.kind && p.hypothesis.place == h.place;
    let is_same_heat = |h: &Hidden, p: &Cause| {
        let heats = |source: &str, part: &str| {
            let of_part = |heated: &HeatedPlace| matches!(heated.place, Place::Part(p) if machine.parts[p].name == part);
            machine.sources.iter().any(|s| s.name == source && s.places.iter().any(of_part))
        };
        match (h.kind.as_str(), p.hypothesis.kind()) {
            ("source factor", "heat source") => heats(&h.place, &p.hypothesis.place),
            ("heat source", "source factor") => heats(&p.hypothesis.place, &h.place),
            _ => is_named(h, p),
        }
    };
    let holds = |e: &Explanation, is: &dyn Fn(&Hidden, &Cause) -> bool| {
        e.causes.len() == case.hidden.len() && case.hidden.iter().all(|h| e.causes.iter().any(|p| is(h, p)))
    };
    let truth = |e: &Explanation| holds(e, &is_named);
    let parts_of = |h: &Hidden| -> Vec<String> {
        let of_contact = machine.contacts.iter().find(|c| h.kind.contains("contact") && c.name == h.place);
        let mut parts: Vec<String> = h.place.split(" - ").map(String::from).collect();
        if let Some(contact) = of_contact {
            for place in &contact.between {
                parts.push(match place {
                    Place::Part(p) => machine.parts[*p].name.clone(),
                    Place::Face(f) => machine.parts[f.part].name.clone(),
                    Place::Node(n) => machine.nodes[*n].name.clone(),
                });
            }
        }
        parts
    };
    let touches = |e: &Explanation| {
        case.hidden.iter().all(|h| {
            let own = parts_of(h);
            e.causes.iter().any(|p| p.hypothesis.place == h.place || p.hypothesis.parts.iter().any(|q| own.contains(q)))
        })
    };
    let first = found.explanations.first().filter(|_| detected);
    let stated = first.map_or(0.0, |f| {
        let name = |e: &Explanation| {
            let mut names: Vec<String> = e.causes.iter().map(|p| format!("{}@{}", p.hypothesis.kind(), p.hypothesis.place)).collect();
            names.sort();
            names
        };
        found.explanations.iter().filter(|e| name(e) == name(f)).map(|e| e.probability).sum()
    });
    let exact = first.is_some_and(truth);
    let scales = Scales::of(&case.problem.data, machine);
    // Another law has another amplitude.
    let off = first.filter(|f| exact && f.causes.len() == 1).and_then(|f| {
        let (part, hidden) = (&f.causes[0], &case.hidden[0]);
        (part.hypothesis.law == hidden.law && hidden.kind != "swapped sensors")
            .then(|| (hidden.amplitude_in(&scales) - part.amplitude) / part.deviation)
    });
    let covered = first.filter(|_| off.is_some()).map(|f| {
        let (low, high) = f.causes[0].interval();
        (low..=high).contains(&case.hidden[0].amplitude_in(&scales))
    });
    let is_hidden = |p: &Cause| case.hidden.iter().any(|h| is_named(h, p));
    let confident = found.verdict == Verdict::Explained;
    Score {
        misnamed: confident && first.is_some_and(|f| !f.causes.iter().all(is_hidden)),
        detected,
        group: first.is_some_and(touches),
        exact,
        same_heat: first.is_some_and(|e| holds(e, &is_same_heat)),
        in_set: detected && found.set.iter().any(|i| truth(&found.explanations[*i])),
        confident,
        stated,
        covered,
        d,
        off,
    }
}
