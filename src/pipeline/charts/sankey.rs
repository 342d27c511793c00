//! `figure = "sankey"`: the ways heat takes through a machine, as bands.

use std::collections::BTreeMap;
use std::path::Path;

use super::super::gallery::Gallery;
use super::Head;
use super::results::Results;
use super::state::State;
use crate::error::Result;
use crate::figures::chart::sankey::{Band, SankeyFigure, Stage, Station};
use crate::figures::chart::style::number;
use crate::foundation::document::Section;
use crate::solve::meshed::NamedRoute;
use crate::solve::routes::Stop;

/// Share of all heat below which a station is put together with others like it.
const LEAST: f64 = 0.02;

/// Keys: those of its state; optional `least`, the share of all heat below which stations are put together (2 %).
#[derive(Debug, Clone)]
pub(super) struct Sankey {
    state: State,
    least: f64,
}

impl Sankey {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        let least = root.opt_number("least")?.unwrap_or(LEAST);
        if !(0.0..0.5).contains(&least) {
            return Err(root.error_at("least", "this is the smallest share of the heat that stands for itself").help("from 0 to 0.5"));
        }
        Ok(Self { state: State::read(root, folder)?, least })
    }

    pub(super) fn draw(&self, head: &Head, results: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
        let solved = self.state.open(head, results)?;
        let routes = solved.study.model.routes(&solved.state);
        let (stations, bands) = gathered(&routes, self.least);
        let together = format!("Stations with less than {} % of the heat are put together.", number(100.0 * self.least));
        let figure = SankeyFigure {
            title: head.title(format!("{}: the ways of the heat", solved.study.model.machine.name)),
            stations,
            bands,
            fixed: solved.fixed,
            notes: head.notes([together]),
        };
        head.add(gallery, &figure)
    }
}

fn stage(stop: Stop, enters: bool) -> Stage {
    match stop {
        Stop::Group(_) => Stage::Part,
        _ if enters => Stage::Sink,
        _ => Stage::Source,
    }
}

/// Stations and bands, small stations of one stage put together and what is far below that left out.
fn gathered(routes: &[NamedRoute], least: f64) -> (Vec<Station>, Vec<Band>) {
    let made: f64 = routes.iter().filter(|r| !matches!(r.from.stop, Stop::Group(_))).map(|r| r.watts).sum();
    // Heat through each end of the routes; water that warms one part and cools another is two stations.
    let mut through: BTreeMap<(Stop, bool), [f64; 2]> = BTreeMap::new();
    let key = |stop: Stop, enters: bool| (stop, enters && !matches!(stop, Stop::Group(_)));
    for route in routes {
        through.entry(key(route.from.stop, false)).or_default()[0] += route.watts;
        through.entry(key(route.to.stop, true)).or_default()[1] += route.watts;
    }
    let large = |k: &(Stop, bool)| through.get(k).is_some_and(|[a, b]| a.max(*b) >= least * made);
    let mut stations: Vec<Station> = Vec::new();
    let mut index = |k: (Stop, bool), name: &str| {
        let stage = stage(k.0, k.1);
        let name = match (large(&k), stage) {
            (true, _) => name.replace('_', " "),
            (false, Stage::Source) => "other sources".to_string(),
            (false, Stage::Part) => "other parts".to_string(),
            (false, Stage::Sink) => "elsewhere".to_string(),
        };
        let station = Station { name, stage };
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
        Band { from, to, watts: watts.abs() }
    };
    // A band thinner than a tenth of the smallest station would not be seen.
    let bands: Vec<Band> = net.into_iter().map(band).filter(|b| b.watts > 0.1 * least * made).collect();
    let used: Vec<usize> = (0..stations.len()).filter(|s| bands.iter().any(|b| b.from == *s || b.to == *s)).collect();
    let place = |s: usize| used.iter().position(|u| *u == s).unwrap_or(0);
    let bands = bands.iter().map(|b| Band { from: place(b.from), to: place(b.to), watts: b.watts }).collect();
    (used.iter().map(|s| stations[*s].clone()).collect(), bands)
}
