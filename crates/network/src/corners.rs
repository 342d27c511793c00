//! Corners of a load in time: instants at which a formula has a kink, and stretches so short that no pulse hides in them.
//!
//! Every formula of the machine that depends on the condition is bounded over a stretch of time by interval arithmetic. A stretch in
//! which a kink may lie, or in which a formula may turn away from a straight line by more than is allowed, is halved.

use super::Network;
use coldplate_base::formula::{Enclosure, Formula};
use coldplate_describe::machine::{BoundaryLaw, BranchFlow, Condition, Intake, Machine};

/// Halvings of a stretch around a kink, a count. Chosen: 1e-12 of the stretch is close to the rounding of its times.
const HALVINGS: u32 = 40;
/// Most stretches that are looked at between two corners of the condition, a count. Chosen: time against formulas of very many kinks.
const MOST_LOOKS: usize = 200_000;
/// Relative distance of a flow, a film, a flux or a factor from a straight line in one stretch, dimensionless. Chosen: a step then sees
/// enough of it for the estimate of its error.
const BEND: f64 = 0.01;

/// An instant at which a step must end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Time, s.
    pub time: f64,
    /// Whether a formula has a kink here: slopes from before tell nothing of the time behind it.
    pub is_kink: bool,
}

/// The corners of a load between two times.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Corners {
    /// Corners, ascending, without the two times.
    pub corners: Vec<Corner>,
    /// Whether some stretches were left as they are because there were too many.
    pub is_cut_off: bool,
}

/// Deviation from a straight line that a formula may have in a stretch.
enum Allowed {
    /// Temperature: the error of a step, K.
    Kelvin,
    /// Power, with the warming of a node by a joule of it that does not pass on, K/J: the error of a step.
    Power(f64),
    /// A share of the largest value, which is this (SI).
    Share(f64),
}

/// The course of a formula in a stretch of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Course {
    /// Close to a straight line.
    Even,
    /// Without a kink, but not close to a straight line.
    Bent,
    /// A kink may lie in it.
    Kinked,
}

impl Allowed {
    /// The course of a formula in a stretch of a duration (s), for an error of a step (K).
    fn judge(&self, found: &Enclosure, duration: f64, tolerance: f64) -> Course {
        let bend = found.bend(duration);
        let is_even = match self {
            Self::Kelvin => bend <= tolerance,
            Self::Power(warming) => bend * duration * warming <= tolerance,
            Self::Share(largest) => bend <= BEND * largest,
        };
        match (found.is_smooth, is_even) {
            (false, _) => Course::Kinked,
            (true, false) => Course::Bent,
            (true, true) => Course::Even,
        }
    }
}

impl Corners {
    /// Corners of the load of a machine between two times (s), for steps with an allowed error (K). The variables run straight in
    /// between. `warming` is the largest warming of a node by a joule of each source that does not pass on, K/J.
    pub fn of(machine: &Machine, warming: &[f64], condition: &dyn Fn(f64) -> Condition, ends: [f64; 2], tolerance: f64) -> Self {
        let [from, until] = ends;
        if until <= from || condition(from) == condition(until) {
            return Self::default();
        }
        let bounds = |from: f64, until: f64| machine.enclosures(&condition(from), &condition(until), until - from);
        let mut driving = driving(machine, warming, &bounds(from, until));
        driving.retain(|(_, found, _)| found.slope.width() > 0.0);
        let worst = |courses: &mut dyn Iterator<Item = Course>| courses.fold(Course::Even, Course::max);
        let whole = worst(&mut driving.iter().map(|(_, found, allowed)| allowed.judge(found, until - from, tolerance)));
        if whole == Course::Even {
            return Self::default();
        }
        let look = |from: f64, until: f64| {
            if [from, until] == ends {
                return whole;
            }
            let names = bounds(from, until);
            worst(&mut driving.iter().map(|(formula, _, allowed)| allowed.judge(&formula.enclosure(&names), until - from, tolerance)))
        };
        let (stretches, is_cut_off) = halved(ends, &look);
        Self { corners: joined(ends, &stretches, &look), is_cut_off }
    }
}

impl Network {
    /// Largest warming of a node by a joule of each source that does not pass on, K/J; zero if the source heats no capacity.
    pub fn warming(&self) -> Vec<f64> {
        let of_node = |(node, share): &(u32, f64)| {
            let capacity = self.capacity.get(*node as usize).copied().unwrap_or(0.0);
            if capacity > 0.0 { share / capacity } else { 0.0 }
        };
        self.sources.iter().map(|source| source.shares.iter().map(of_node).fold(0.0, f64::max)).collect()
    }
}

/// Formulas that drive a machine, with their bounds and the deviation that each may have.
fn driving<'m>(machine: &'m Machine, warming: &[f64], all: &[Enclosure]) -> Vec<(&'m Formula, Enclosure, Allowed)> {
    let share = |formula: &'m Formula| {
        let found = formula.enclosure(all);
        (formula, found, Allowed::Share(found.value.low.abs().max(found.value.high.abs())))
    };
    let kelvin = |formula: &'m Formula| (formula, formula.enclosure(all), Allowed::Kelvin);
    let mut found = vec![kelvin(&machine.chamber.temperature)];
    found.extend(machine.nodes.iter().filter_map(|node| node.fixed.as_ref()).map(kelvin));
    found.extend(machine.contacts.iter().map(|contact| share(&contact.factor)));
    for boundary in &machine.boundaries {
        match &boundary.law {
            BoundaryLaw::Temperature(t) | BoundaryLaw::Radiation(_, t) | BoundaryLaw::FreeConvection(_, t) => found.push(kelvin(t)),
            BoundaryLaw::Film(h, t) => found.extend([share(h), kelvin(t)]),
            BoundaryLaw::Flux(q) => found.push(share(q)),
        }
    }
    for circuit in &machine.circuits {
        match &circuit.intake {
            Intake::Stated { flow, temperature } => found.extend([share(flow), kelvin(temperature)]),
            Intake::Fed { flow, .. } => found.extend(flow.as_ref().map(share)),
        }
        found.extend(circuit.branches.iter().map(|branch| match &branch.flow {
            BranchFlow::Share(number) | BranchFlow::Flow(number) => share(number),
        }));
    }
    found.extend(machine.controllers.iter().map(|controller| kelvin(&controller.set_point)));
    for (source, warming) in machine.sources.iter().zip(warming) {
        let warming = source.volume.unwrap_or(1.0) * warming;
        // Nodes without capacity follow their heat at once, whatever its course.
        found.push(if warming > 0.0 {
            (&source.power, source.power.enclosure(all), Allowed::Power(warming))
        } else {
            share(&source.power)
        });
    }
    found
}

/// Halves the time between two ends (s) until every stretch is even, or too short to be halved: the ends of all stretches, and
/// whether each was halved to the last. The second result says whether there were too many.
fn halved([from, until]: [f64; 2], look: &dyn Fn(f64, f64) -> Course) -> (Vec<(f64, bool)>, bool) {
    let mut found = Vec::new();
    // Stretches yet to be looked at, the earliest last, with their halvings.
    let mut open = vec![(from, until, 0)];
    let mut looks = 0;
    while let Some((from, until, halvings)) = open.pop() {
        looks += 1;
        let middle = f64::midpoint(from, until);
        if look(from, until) == Course::Even {
            found.push((until, false));
        } else if halvings >= HALVINGS || looks >= MOST_LOOKS || middle <= from || middle >= until {
            found.push((until, true));
        } else {
            open.extend([(middle, until, halvings + 1), (from, middle, halvings + 1)]);
        }
    }
    (found, looks >= MOST_LOOKS)
}

/// Joins stretches that are even together: halvings towards a kink leave ever shorter ones beside it. A stretch that was halved to
/// the last has its kink within rounding of its end.
fn joined([from, until]: [f64; 2], stretches: &[(f64, bool)], look: &dyn Fn(f64, f64) -> Course) -> Vec<Corner> {
    let near = 2.0 * (until - from) * 0.5f64.powi(HALVINGS as i32);
    let mut found: Vec<Corner> = Vec::new();
    let (mut start, mut end) = (from, from);
    for (next, is_spent) in stretches {
        let together = if *is_spent || end == start { Course::Even } else { look(start, *next) };
        if together != Course::Even {
            found.push(Corner { time: end, is_kink: together == Course::Kinked });
            start = end;
        }
        end = *next;
        if *is_spent {
            match found.last_mut() {
                Some(last) if last.is_kink && end - last.time <= near => last.time = end,
                _ => found.push(Corner { time: end, is_kink: true }),
            }
            start = end;
        }
    }
    found.retain(|corner| until - corner.time > near);
    found
}
