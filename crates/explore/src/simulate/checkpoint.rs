//! The state of a run in a file, to go on from.
//!
//! The file has one line that names the format, then little-endian binary (so that every bit comes back), then a CRC-32 of it
//! all. The binary part holds strings that identify the run, the solver's state, the readings so far, and the state of
//! settling.

use std::path::Path;

use super::passing::{Extent, FirstPassings, Passed, Passing, Watch};
use super::recorder::Observations;
use super::settle::Settling;
use super::stretch::Fronts;
use super::{SimulateOptions, Start};
use crate::numerics;
use crate::schedule::Schedule;
use coldplate_base::error::{Error, Result};
use coldplate_base::{atomic_file, input};
use coldplate_network::Network;
use coldplate_solve::meshed::MeshedMachine;
use coldplate_solve::transient::parcels::Parcel;
use coldplate_solve::transient::{Before, ControlState, Energy, HeatPassing, TransientState};

/// First line of a checkpoint: name and version of the format.
const MAGIC: &[u8] = b"coldplate checkpoint 6\n";

/// Identity of a run: name and value of everything that decides its numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Identity(Vec<(String, String)>);

impl Identity {
    pub(super) fn new(model: &MeshedMachine, schedule: &Schedule, options: &SimulateOptions) -> Self {
        let start = match options.start {
            Start::Steady => "steady".to_string(),
            Start::Uniform(temperature) => format!("{temperature} K"),
            Start::Readings => "readings".to_string(),
            Start::Parts => "parts".to_string(),
        };
        let entries = [
            ("version of the program", env!("CARGO_PKG_VERSION").to_string()),
            ("numerics of the program", numerics()),
            ("machine file or its --set", model.machine.hash.clone()),
            ("number of cells", format!("{} in {} nodes", model.mesh.cells, model.network.nodes)),
            ("schedule or its conditions", schedule.hash()),
            ("--from", if options.places.is_empty() { start } else { format!("{start}, {:?}", options.places) }),
            ("--every", options.every.map_or("not given".into(), |s| format!("{s} s"))),
            ("--tolerance", format!("{} K", options.tolerance)),
            ("--within", format!("{} K", options.within)),
            ("--passes", options.watched.iter().map(|w| format!("{} {} K; ", w.sensor, w.value)).collect()),
        ];
        Self(entries.map(|(name, value)| (name.to_string(), value)).to_vec())
    }
}

/// Writes the state of a run.
///
/// # Errors
/// Errors of [`atomic_file::write`].
pub(super) fn write(path: &Path, identity: &Identity, state: &TransientState, fronts: Fronts, seen: &Observations) -> Result<()> {
    let mut to = Encoder(MAGIC.to_vec());
    to.count(identity.0.len());
    for (name, value) in &identity.0 {
        to.text(name);
        to.text(value);
    }
    to.number(state.time);
    to.numbers(&state.temperatures);
    to.count(state.water.len());
    for parcels in &state.water {
        to.numbers(&parcels.iter().flat_map(|p| [p.volume, p.upstream, p.downstream]).collect::<Vec<_>>());
    }
    to.number(state.step);
    to.count(state.steps);
    to.count(state.rejected);
    let Energy { entered, left, stored, moved, rounding } = state.energy;
    to.numbers(&[entered, left, stored, moved, rounding]);
    to.count(usize::from(state.before.is_some()));
    if let Some(Before { temperatures, between, length, time, variables, flow, passing }) = &state.before {
        [temperatures, between, variables, flow].into_iter().for_each(|values| to.numbers(values));
        to.numbers(&[*length, *time, passing.entering, passing.leaving]);
    }
    to.numbers(&state.controls.iter().flat_map(|own| [own.share, own.integral, own.given, own.switches as f64]).collect::<Vec<_>>());
    to.number(fronts.until);
    to.count(usize::from(fronts.are_near));
    to.count(seen.readings.len());
    seen.readings.iter().for_each(|readings| to.numbers(readings));
    to.count(seen.heat_flows.len());
    seen.heat_flows.iter().for_each(|heats| to.numbers(heats));
    match &seen.steady {
        Ok(steady) => {
            to.text("");
            to.numbers(steady);
        }
        Err(reason) => to.text(reason),
    }
    to.number(seen.settling.within);
    to.number(seen.settling.time);
    to.numbers(&seen.settling.distances);
    to.numbers(&seen.settling.since);
    to.count(seen.passing.found.len());
    for crossing in &seen.passing.found {
        to.count(crossing.watch.sensor);
        to.number(crossing.watch.value);
        for passed in [crossing.rising, crossing.falling] {
            to.number(passed.map_or(f64::NAN, |passed| passed.at));
            to.number(passed.map_or(f64::NAN, |passed| passed.rate));
        }
    }
    to.numbers(&seen.passing.extents.iter().flat_map(|e| [e.start, e.first, e.largest, e.at]).collect::<Vec<_>>());
    to.numbers(&seen.passing.times);
    to.numbers(&seen.passing.values.concat());
    to.numbers(&seen.passing.last);
    let sum = crc32fast::hash(&to.0);
    to.0.extend(sum.to_le_bytes());
    atomic_file::write(path, &to.0)
}

/// Reads the state of the run `identity` back; `stops` is the number of readings at the end of the run.
///
/// # Errors
/// No checkpoint, a damaged one, or one of another run; the message names the difference.
pub(super) fn read(path: &Path, identity: &Identity, network: &Network, stops: usize) -> Result<(TransientState, Fronts, Observations)> {
    let bytes = input::read_back(path)?;
    let begin_anew = "to begin anew, leave out --resume or remove the file";
    if !bytes.starts_with(MAGIC) {
        let what = if bytes.starts_with(b"coldplate checkpoint ") {
            "this checkpoint is in the format of another version"
        } else {
            "this is no checkpoint of a simulation"
        };
        return Err(Error::input(what).in_file(path).help(begin_anew));
    }
    let damaged = || Error::input("this checkpoint is damaged").in_file(path).help(begin_anew);
    let (content, sum) = bytes.split_at(bytes.len() - 4);
    if content.len() < MAGIC.len() || crc32fast::hash(content).to_le_bytes() != sum {
        return Err(damaged());
    }
    let mut from = Decoder(&content[MAGIC.len()..]);
    let found = from.identity().ok_or_else(damaged)?;
    for (name, value) in &identity.0 {
        match found.0.iter().find(|(known, _)| known == name) {
            Some((_, known)) if known == value => {}
            known => {
                let known = known.map_or("nothing", |(_, value)| value);
                return Err(Error::input(format!("this checkpoint is of another run: the {name} differs"))
                    .in_file(path)
                    .read(format!("{known}, now {value}"))
                    .help(format!("give the inputs and options that it was made with; {begin_anew}")));
            }
        }
    }
    let (state, fronts, seen) = from.content().ok_or_else(damaged)?;
    let sensors = network.sensors.len();
    let fits = state.temperatures.len() == network.nodes
        && state.before.iter().flat_map(|before| [&before.temperatures, &before.between]).all(|t| t.len() == network.nodes)
        && state.before.iter().all(|before| before.flow.len() == network.solids)
        && state.water.len() == network.streams.len()
        && [0, network.loops.len()].contains(&state.controls.len())
        && (1..=stops).contains(&seen.readings.len())
        && seen.readings.iter().chain(&seen.steady).all(|r| r.len() == sensors)
        && seen.heat_flows.len() == seen.readings.len()
        && seen.heat_flows.iter().all(|heats| heats.len() == network.meters.len())
        && seen.settling.distances.len() == sensors
        && seen.settling.since.len() == sensors;
    if fits { Ok((state, fronts, seen)) } else { Err(damaged()) }
}

struct Encoder(Vec<u8>);

impl Encoder {
    fn number(&mut self, value: f64) {
        self.0.extend(value.to_le_bytes());
    }

    fn count(&mut self, value: usize) {
        self.0.extend((value as u64).to_le_bytes());
    }

    fn numbers(&mut self, values: &[f64]) {
        self.count(values.len());
        values.iter().for_each(|v| self.number(*v));
    }

    fn text(&mut self, text: &str) {
        self.count(text.len());
        self.0.extend(text.as_bytes());
    }
}

/// Decodes the bytes of an [`Encoder`]; `None` if they do not suffice.
struct Decoder<'a>(&'a [u8]);

impl Decoder<'_> {
    fn word(&mut self) -> Option<[u8; 8]> {
        let (word, rest) = self.0.split_first_chunk::<8>()?;
        self.0 = rest;
        Some(*word)
    }

    fn number(&mut self) -> Option<f64> {
        self.word().map(f64::from_le_bytes)
    }

    /// A count of items that take at least `size` bytes each.
    fn count(&mut self, size: usize) -> Option<usize> {
        let count = usize::try_from(u64::from_le_bytes(self.word()?)).ok()?;
        (count.checked_mul(size)? <= self.0.len()).then_some(count)
    }

    fn numbers(&mut self) -> Option<Vec<f64>> {
        (0..self.count(8)?).map(|_| self.number()).collect()
    }

    fn text(&mut self) -> Option<String> {
        let length = self.count(1)?;
        let (text, rest) = self.0.split_at(length);
        self.0 = rest;
        String::from_utf8(text.to_vec()).ok()
    }

    fn identity(&mut self) -> Option<Identity> {
        let entries = (0..self.count(16)?).map(|_| Some((self.text()?, self.text()?)));
        entries.collect::<Option<Vec<_>>>().map(Identity)
    }

    fn passing(&mut self) -> Option<Passing> {
        let crossing = |from: &mut Self| {
            let watch = Watch { sensor: from.count(0)?, value: from.number()? };
            let [rising, falling] = [[from.number()?, from.number()?], [from.number()?, from.number()?]]
                .map(|[at, rate]| Some(Passed { at, rate, within: None }).filter(|_| !at.is_nan()));
            Some(FirstPassings { watch, rising, falling })
        };
        let found: Vec<FirstPassings> = (0..self.count(48)?).map(|_| crossing(self)).collect::<Option<_>>()?;
        let extents = self.numbers()?;
        let extents: Vec<Extent> = extents.chunks_exact(4).map(|e| Extent { start: e[0], first: e[1], largest: e[2], at: e[3] }).collect();
        let (times, values, last) = (self.numbers()?, self.numbers()?, self.numbers()?);
        let fits = values.len() == times.len() * found.len()
            && (last.is_empty() || last.len() == found.len())
            && (extents.is_empty() || extents.len() == found.len());
        let values = values.chunks_exact(found.len().max(1)).map(<[f64]>::to_vec).collect();
        fits.then_some(Passing { found, extents, times, values, last })
    }

    fn before(&mut self) -> Option<Before> {
        let (temperatures, between, variables, flow) = (self.numbers()?, self.numbers()?, self.numbers()?, self.numbers()?);
        let [length, time, entering, leaving] = self.numbers()?.try_into().ok()?;
        Some(Before { temperatures, between, length, time, variables, flow, passing: HeatPassing { entering, leaving } })
    }

    fn content(&mut self) -> Option<(TransientState, Fronts, Observations)> {
        let (time, temperatures) = (self.number()?, self.numbers()?);
        let water = (0..self.count(8)?).map(|_| {
            let parcels = self.numbers()?;
            Some(parcels.chunks_exact(3).map(|p| Parcel { volume: p[0], upstream: p[1], downstream: p[2] }).collect())
        });
        let water = water.collect::<Option<_>>()?;
        let (step, steps, rejected) = (self.number()?, self.count(0)?, self.count(0)?);
        let [entered, left, stored, moved, rounding] = self.numbers()?.try_into().ok()?;
        let before = if self.count(0)? > 0 { Some(self.before()?) } else { None };
        let controls = self.numbers()?;
        let control = |own: &[f64]| ControlState { share: own[0], integral: own[1], given: own[2], switches: own[3] as usize };
        let controls = controls.chunks_exact(4).map(control).collect();
        let fronts = Fronts { until: self.number()?, are_near: self.count(0)? > 0 };
        let readings = (0..self.count(8)?).map(|_| self.numbers()).collect::<Option<_>>()?;
        let heat_flows = (0..self.count(8)?).map(|_| self.numbers()).collect::<Option<_>>()?;
        let reason = self.text()?;
        let steady = if reason.is_empty() { Ok(self.numbers()?) } else { Err(reason) };
        let (within, at) = (self.number()?, self.number()?);
        let settling = Settling { within, time: at, distances: self.numbers()?, since: self.numbers()? };
        let passing = self.passing()?;
        let energy = Energy { entered, left, stored, moved, rounding };
        let state = TransientState { time, temperatures, controls, water, step, steps, rejected, energy, before };
        Some((state, fronts, Observations { readings, heat_flows, steady, settling, passing }))
    }
}
