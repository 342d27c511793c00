//! `figure = "sankey"`: the paths of heat through a machine, as bands.

use std::collections::BTreeMap;
use std::path::Path;

use super::super::gallery::Gallery;
use super::Head;
use super::results::Results;
use super::state::StateKeys;
use coldplate_base::document::Section;
use coldplate_base::error::Result;
use coldplate_figures::chart::sankey::{HeatBand, HeatStation, HeatTotal, SankeyFigure, Stage};
use coldplate_figures::chart::style::number;
use coldplate_solve::heat_paths::RouteEnd;
use coldplate_solve::meshed::{MeshedMachine, NamedRoute, SteadyState};

/// Share of all heat below which stations are put together, if the definition does not say. Chosen: thinner bands
/// cannot be told apart.
const LEAST: f64 = 0.02;

/// Keys: those of its state; optional `least`, the share of all heat below which stations are put together (2 %).
#[derive(Debug, Clone)]
pub(super) struct SankeyChart {
    state: StateKeys,
    least: f64,
}

impl SankeyChart {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        let least = root.opt_number("least")?.unwrap_or(LEAST);
        if !(0.0..0.5).contains(&least) {
            return Err(root.error_at("least", "this is the smallest share of the heat that stands for itself").help("from 0 to 0.5"));
        }
        Ok(Self { state: StateKeys::read(root, folder)?, least })
    }

    pub(super) fn draw(&self, head: &Head, results: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
        let solved = self.state.open(head, results)?;
        let model = &solved.study.model;
        let figure = figure(model, &solved.state, self.least);
        let figure = SankeyFigure {
            title: head.title(format!("{}: the ways of the heat", model.machine.name)),
            fixed: solved.fixed,
            notes: head.notes(figure.notes),
            ..figure
        };
        head.add(gallery, &figure)
    }
}

/// The ways of all heat of a machine in a state.
pub(crate) fn whole(model: &MeshedMachine, state: &SteadyState) -> SankeyFigure {
    figure(model, state, LEAST)
}

fn figure(model: &MeshedMachine, state: &SteadyState, least: f64) -> SankeyFigure {
    let routes = model.routes(state);
    let ends = Ends::of(model, state);
    let (stations, bands) = gathered(&routes, &ends, least);
    let together = format!("Stations with less than {} % of the heat are put together.", number(100.0 * least));
    SankeyFigure { stations, bands, total: total(&routes, &ends), notes: vec![together], ..SankeyFigure::default() }
}

/// Ends of the paths of heat: everything but parts, and lumped nodes that are held at a temperature.
struct Ends {
    held: Vec<usize>,
}

impl Ends {
    fn of(model: &MeshedMachine, state: &SteadyState) -> Self {
        let network = &model.network;
        let held = network.fixed.iter().filter(|(_, index)| state.load.boundary_of(*index).is_none());
        Self { held: held.map(|(node, _)| network.group[*node as usize] as usize).collect() }
    }

    fn has(&self, stop: RouteEnd) -> bool {
        match stop {
            RouteEnd::Group(g) => self.held.contains(&g),
            _ => true,
        }
    }
}

/// All heat, bands included that are too thin to be drawn.
fn total(routes: &[NamedRoute], ends: &Ends) -> HeatTotal {
    let sum = |of: &dyn Fn(&NamedRoute) -> bool| routes.iter().filter(|r| of(r)).map(|r| r.watts).sum::<f64>();
    let is_source = |r: &NamedRoute| matches!(r.from.stop, RouteEnd::Source(_));
    HeatTotal { made: sum(&is_source), entering: sum(&|r| ends.has(r.from.stop) && !is_source(r)), leaving: sum(&|r| ends.has(r.to.stop)) }
}

/// Stations and bands; small stations of one stage are put together, and far smaller ones left out.
fn gathered(routes: &[NamedRoute], ends: &Ends, least: f64) -> (Vec<HeatStation>, Vec<HeatBand>) {
    let made: f64 = routes.iter().filter(|r| ends.has(r.from.stop)).map(|r| r.watts).sum();
    // Heat through each end of the routes; water that warms one part and cools another is two stations.
    let key = |stop: RouteEnd, enters: bool| (stop, enters && ends.has(stop));
    let mut through: BTreeMap<(RouteEnd, bool), [f64; 2]> = BTreeMap::new();
    for route in routes {
        through.entry(key(route.from.stop, false)).or_default()[0] += route.watts;
        through.entry(key(route.to.stop, true)).or_default()[1] += route.watts;
    }
    let stage = |(stop, enters): (RouteEnd, bool)| match (ends.has(stop), enters) {
        (false, _) => Stage::Part,
        (true, true) => Stage::Sink,
        (true, false) => Stage::Source,
    };
    let is_large = |k: &(RouteEnd, bool)| through.get(k).is_some_and(|[a, b]| a.max(*b) >= least * made);
    // A small station that is alone in its stage keeps its name.
    let is_seen = |watts: f64| watts > 0.1 * least * made;
    let others =
        |stage_of: Stage| through.iter().filter(|(k, [a, b])| !is_large(k) && is_seen(a.max(*b)) && stage(**k) == stage_of).count();
    let alone = [Stage::Source, Stage::Part, Stage::Sink].map(|own| others(own) < 2);
    let mut stations: Vec<HeatStation> = Vec::new();
    let mut index = |k: (RouteEnd, bool), name: &str| {
        let stage = stage(k);
        let name = match (is_large(&k) || alone[stage as usize], stage) {
            (true, _) => name.replace('_', " "),
            (false, Stage::Source) => "other sources".to_string(),
            (false, Stage::Part) => "other parts".to_string(),
            (false, Stage::Sink) => "elsewhere".to_string(),
        };
        let station = HeatStation { name, stage };
        stations.iter().position(|s| *s == station).unwrap_or_else(|| {
            stations.push(station);
            stations.len() - 1
        })
    };
    let mut net: BTreeMap<(usize, usize), f64> = BTreeMap::new();
    for route in routes {
        let from = index(key(route.from.stop, false), &route.from.name);
        let to = index(key(route.to.stop, true), &route.to.name);
        if from < to {
            *net.entry((from, to)).or_default() += route.watts;
        } else if from > to {
            *net.entry((to, from)).or_default() -= route.watts;
        }
    }
    let band = |((a, b), watts): ((usize, usize), f64)| {
        let (from, to) = if watts < 0.0 { (b, a) } else { (a, b) };
        HeatBand { from, to, watts: watts.abs() }
    };
    // A band thinner than a tenth of the smallest station would not be seen.
    let bands: Vec<HeatBand> = net.into_iter().map(band).filter(|b| is_seen(b.watts)).collect();
    let used: Vec<usize> = (0..stations.len()).filter(|s| bands.iter().any(|b| b.from == *s || b.to == *s)).collect();
    let place = |s: usize| used.iter().position(|u| *u == s).unwrap_or(0);
    let bands = bands.iter().map(|b| HeatBand { from: place(b.from), to: place(b.to), watts: b.watts }).collect();
    (used.iter().map(|s| stations[*s].clone()).collect(), bands)
}

#[cfg(test)]
mod tests {
    use super::*;
    use coldplate_base::document::Document;
    use coldplate_solve::heat_flow::{Holder, exchanged};
    use coldplate_solve::meshed::HeatPlace;
    use coldplate_solve::study::Study;

    /// Solves a machine twice: with water a little colder than the chamber, and with water so warm that it heats the
    /// machine.
    fn solved(machine: &str, cells: usize) -> (Study, [SteadyState; 2]) {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../machines").join(machine);
        let study = Study::new(Document::read(&file).unwrap(), Some(cells)).unwrap();
        let states = ["20 degC", "35 degC"].map(|water| {
            let all = [("coolant_flow", "4 L/min"), ("motor_speed", "1000 rpm"), ("ambient_temperature", "22 degC")];
            let given: Vec<(&str, &str)> = all.into_iter().chain([("coolant_temperature", water)]).collect();
            study.model.steady(&study.model.machine.condition(&given).unwrap()).unwrap()
        });
        (study, states)
    }

    /// Heat that enters less heat that leaves, for every stop.
    fn left_over(routes: &[NamedRoute]) -> BTreeMap<RouteEnd, f64> {
        let mut left = BTreeMap::new();
        for route in routes {
            *left.entry(route.from.stop).or_insert(0.0) -= route.watts;
            *left.entry(route.to.stop).or_insert(0.0) += route.watts;
        }
        left
    }

    #[test]
    fn all_that_is_made_leaves_and_parts_keep_nothing() {
        let machines = [
            "bracket",
            "column",
            "enclosure",
            "five_axis",
            "hot_water_pipe",
            "hot_water_pipe_bare",
            "rig",
            "slab",
            "spindle",
            "two_heaters_bare",
        ];
        for name in machines {
            let (study, states) = solved(&format!("{name}.toml"), 2000);
            states.iter().for_each(|state| closes(name, &study.model, state));
        }
    }

    fn closes(name: &str, model: &MeshedMachine, state: &SteadyState) {
        let balance = &state.solution.balance;
        let (routes, ends) = (model.routes(state), Ends::of(model, state));
        let HeatTotal { made, entering, leaving } = total(&routes, &ends);
        // A pipe as warm as its surroundings has next to no heat; there it is rounding that is left.
        let small = 1e-6 * (made + entering).max(1.0);
        assert!((made + entering - leaving).abs() <= small, "{name}: {made} W made, {entering} W entering, {leaving} W leaving");
        let sources: f64 = balance.sources.iter().filter(|q| **q > 0.0).sum();
        assert!((made - sources).abs() <= small, "{name}: {made} W made by sources of {sources} W");
        let left = left_over(&routes);
        for (stop, left) in &left {
            assert!(ends.has(*stop) || left.abs() <= small, "{name}: {left} W stay in {stop:?}");
        }
        let wall = left.get(&RouteEnd::Wall).copied().unwrap_or(0.0);
        assert!((wall + balance.radiation).abs() <= small, "{name}: {wall} W to the wall, {} W by the balance", balance.radiation);
    }

    /// The heat that surfaces emit into the hood equals the heat that the parts exchange by it and send to the
    /// chamber.
    #[test]
    fn parts_under_a_hood_exchange_what_their_surfaces_give_off() {
        let (study, [state, _]) = solved("enclosure.toml", 8000);
        let (model, temperatures) = (&study.model, &state.solution.temperatures);
        let group = |name: &str| Holder::Group(model.network.groups.iter().position(|g| g == name).unwrap());
        let leaves = |name: &str| {
            let own = group(name);
            let of = |(a, b, heat): (Holder, Holder, f64)| {
                if a == own {
                    heat
                } else if b == own {
                    -heat
                } else {
                    0.0
                }
            };
            exchanged(&model.network, &state.load, temperatures).into_iter().map(of).sum::<f64>()
        };
        let heats = coldplate_solve::balance::enclosure_heats(&model.network, temperatures).remove(0);
        let contact = |name: &str| {
            let flows = coldplate_solve::balance::contact_flows(&model.network, &state.load.contacts, temperatures);
            flows.into_iter().find(|c| c.name == name).unwrap().heat
        };
        let (feet, flange) = (contact("feet"), contact("flange"));
        let expected = [("motor", heats[0] + feet), ("plate", heats[1] - feet - flange), ("hood", heats[2] + heats[3] + heats[4] + flange)];
        for (name, expected) in expected {
            assert!((leaves(name) - expected).abs() < 1e-6, "{name}: {} W, {expected} W", leaves(name));
        }
    }

    fn route(from: (RouteEnd, &str), to: (RouteEnd, &str), watts: f64) -> NamedRoute {
        let named = |(stop, name): (RouteEnd, &str)| HeatPlace { stop, name: name.into() };
        NamedRoute { from: named(from), to: named(to), watts }
    }

    #[test]
    fn a_small_station_alone_keeps_its_name() {
        let (motor, fan, case) = ((RouteEnd::Source(0), "motor"), (RouteEnd::Source(1), "fan"), (RouteEnd::Group(0), "case"));
        let (water, wall, gas) =
            ((RouteEnd::Circuit(0), "coolant water"), (RouteEnd::Wall, "chamber wall"), (RouteEnd::Gas, "residual gas"));
        let mut routes = vec![route(motor, case, 99.0), route(fan, case, 1.0), route(case, water, 99.0), route(case, wall, 1.0)];
        let names = |routes: &[NamedRoute]| {
            let (stations, _) = gathered(routes, &Ends { held: Vec::new() }, 0.02);
            stations.into_iter().map(|s| s.name).collect::<Vec<_>>()
        };
        assert_eq!(names(&routes), ["motor", "case", "fan", "coolant water", "chamber wall"]);
        routes.push(route(case, gas, 0.01));
        assert_eq!(names(&routes), ["motor", "case", "fan", "coolant water", "chamber wall"], "what is not seen is no company");
        routes.push(route(case, gas, 1.0));
        assert_eq!(names(&routes), ["motor", "case", "fan", "coolant water", "elsewhere"]);
    }
}
