//! Coolant: films of channels and boundaries, flows, how they split, and the temperature the water enters with.

use super::file::text;
use super::law::nine_digits;
use super::words::Quantity;
use super::{CommonFactor, Family, Hypothesis, Law, Linearised, Lines, MachineEdit, Prepared, Site, Told, UserKind, along};
use coldplate_base::condition::{COOLANT_FLOW, COOLANT_TEMPERATURE};
use coldplate_describe::machine::{BoundaryLaw, Condition, Machine};
use coldplate_network::stream::members;
use coldplate_network::{Load, Network};
use coldplate_base::error::Result;
use coldplate_base::document::{Leaf, quoted};
use coldplate_solve::sensitivity::Disturbance;
use coldplate_solve::study::Study;
use coldplate_base::units;

/// Coolant and films.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Flow {
    /// Film of a channel, logarithm.
    Film(usize),
    /// Scale on the wall of a channel, m² K/W in series with its film.
    Scale(usize),
    /// Loss coefficient of one of parallel channels, more than the model has.
    Split(usize),
    /// Flow of a circuit, logarithm.
    Rate(usize),
    /// Inlet temperature of a circuit, K.
    Inlet(usize),
    /// Heat that the line to a circuit takes up, as inlet temperature at the middle flow, K.
    Line(usize),
    /// Film of a boundary of the file, logarithm.
    BoundaryFilm(usize),
}

impl Family for Flow {
    fn candidates(site: &Site<'_>) -> Vec<Hypothesis> {
        let (prior, mut found) = (&site.machine.priors, Vec::new());
        for (c, channel) in site.machine.channels.iter().enumerate() {
            let parts = vec![site.machine.parts[channel.part].name.clone()];
            found.push(Hypothesis::signed(Self::Film(c), &channel.name, parts.clone(), prior.film, "ln"));
            found.push(Hypothesis::positive(Self::Scale(c), &channel.name, parts.clone(), prior.scale, "m2 K/W"));
            // Less flow in one of parallel channels is more in the others.
            if let Some(loss) = site.data.rows.iter().find_map(|row| branch_loss(site.machine, site.network, c, &row.condition)) {
                found.push(Hypothesis::positive(Self::Split(c), &channel.name, parts, prior.split * loss, "1"));
            }
        }
        // Flow and temperature of what other circuits feed are not stated.
        for (c, circuit) in site.machine.circuits.iter().enumerate().filter(|(_, c)| c.intake.feeders().is_empty()) {
            let through = circuit_parts(site.network, site.machine, c);
            found.push(Hypothesis::signed(Self::Rate(c), &circuit.name, through.clone(), prior.flow, "ln"));
            found.push(Hypothesis::signed(Self::Inlet(c), &circuit.name, through.clone(), prior.inlet, "K"));
            if site.flow_varies {
                found.push(Hypothesis::signed(Self::Line(c), &circuit.name, through, prior.inlet, "K").under(Law::InverseFlow));
            }
        }
        for (b, boundary) in site.machine.boundaries.iter().enumerate() {
            if matches!(boundary.law, BoundaryLaw::Film(..)) && site.study.known_parameter(&film_key(&boundary.name)).is_some() {
                let mut parts: Vec<String> = boundary.faces.iter().map(|f| site.machine.parts[f.part].name.clone()).collect();
                parts.dedup();
                found.push(Hypothesis::signed(Self::BoundaryFilm(b), &boundary.name, parts, prior.film, "ln"));
            }
        }
        found
    }

    fn kind(&self) -> &'static str {
        match self {
            Self::Film(_) => "film coefficient",
            Self::Scale(_) => "scale",
            Self::Split(_) => "uneven split",
            Self::Rate(_) => "coolant flow",
            Self::Inlet(_) => "coolant inlet offset",
            Self::Line(_) => "coolant line heat gain",
            Self::BoundaryFilm(_) => "boundary film",
        }
    }

    fn lines(&self, edit: &MachineEdit<'_>) -> Result<Lines> {
        let machine = edit.machine();
        let channel = |c: usize, key: &str| format!("channel.{}.{key}", quoted(&machine.channels[c].name));
        let circuit = |c: usize, key: &str| format!("circuit.{}.{key}", quoted(&machine.circuits[c].name));
        match *self {
            Self::Film(c) => edit.scaled(&channel(c, "film_factor"), edit.amplitude.exp()),
            Self::Scale(c) => {
                let resistance = machine.channels[c].fouling_resistance + edit.amplitude.max(0.0);
                Ok(Some(vec![(channel(c, "fouling_resistance"), text(format!("{resistance:?} m2 K/W")))]))
            }
            Self::Split(c) => {
                let loss = machine.channels[c].minor_loss + edit.amplitude.max(0.0);
                Ok(Some(vec![(channel(c, "minor_loss"), format!("{loss:?}"))]))
            }
            Self::Rate(c) if edit.when().is_some() => {
                let key = circuit(c, "flow");
                let now = edit.study.document().leaf(&key)?.unwrap_or_else(|| Leaf::Text(COOLANT_FLOW.into()));
                Ok(multiplied(&now, machine, &format!("exp(({:?}) * ({}))", edit.amplitude, edit.law()))?.map(|value| vec![(key, value)]))
            }
            Self::Rate(c) => edit.scaled(&circuit(c, "flow"), edit.amplitude.exp()),
            Self::Inlet(c) | Self::Line(c) => {
                let key = circuit(c, "inlet_temperature");
                let now = edit.study.document().leaf(&key)?.unwrap_or_else(|| Leaf::Text(COOLANT_TEMPERATURE.into()));
                Ok(warmer(&now, machine, &format!("({:?}) * ({})", edit.amplitude, edit.law()))?.map(|value| vec![(key, value)]))
            }
            Self::BoundaryFilm(b) if edit.when().is_some() => {
                let key = film_key(&machine.boundaries[b].name);
                let film = edit.study.parameter(&key)?.value;
                Ok(Some(vec![(key, text(format!("{film:?} * exp(({:?}) * ({}))", edit.amplitude, edit.law())))]))
            }
            Self::BoundaryFilm(b) => edit.scaled(&film_key(&machine.boundaries[b].name), edit.amplitude.exp()),
        }
    }

    fn prepared(&self, study: &Study, _user: &[UserKind]) -> Option<Prepared> {
        let Self::Split(c) = *self else { return None };
        along(study, &format!("channel.{}.minor_loss", quoted(&study.model.machine.channels[c].name)))
    }

    fn disturbance(&self, at: &Linearised<'_, '_>) -> Option<Disturbance> {
        match *self {
            Self::Film(c) | Self::Scale(c) => {
                let name = &at.machine().channels[c].name;
                let stream = at.network().streams.iter().position(|s| s.name == *name)?;
                Some(if matches!(self, Self::Film(_)) { at.screen.stream_film(stream) } else { at.screen.stream_scale(stream) })
            }
            Self::Split(_) => at.along(),
            Self::Rate(c) => at.screen.flow(c).ok(),
            Self::Inlet(c) | Self::Line(c) => at.screen.inlet(c).ok(),
            Self::BoundaryFilm(b) => Some(at.screen.boundary(b as u32)),
        }
    }

    fn says_when(&self) -> bool {
        matches!(self, Self::Inlet(_) | Self::Rate(_) | Self::BoundaryFilm(_))
    }

    /// The line to a circuit has a law of its own.
    fn has_formula_of(&self, law: Law) -> bool {
        self.says_when() || matches!(self, Self::Line(_)) && law == Law::InverseFlow
    }

    /// A flow that changes at once sends fronts through the water, which the screen of logs follows to a twentieth only.
    fn follows_time(&self) -> bool {
        self.says_when() && !matches!(self, Self::Rate(_))
    }

    fn quantity(&self, _law: Law) -> Quantity {
        match self {
            Self::Film(_) | Self::Rate(_) | Self::BoundaryFilm(_) => Quantity::factor("factor"),
            Self::Scale(_) => Quantity::plain("resistance", "m2 K/W"),
            Self::Split(_) => Quantity::plain("loss_coefficient", "1"),
            Self::Inlet(_) | Self::Line(_) => Quantity::plain("offset", "K"),
        }
    }

    fn sentence(&self, told: &Told<'_>) -> String {
        let (place, number, kelvin) = (told.place(), told.range(""), told.range(" K"));
        let when = told.when();
        match self {
            Self::Film(_) => format!("the film of channel {place} is {number} times the model's (below 1: fouling)"),
            Self::Scale(_) => format!("scale covers the wall of channel {place}: {} in series with the film", told.range(" m2 K/W")),
            Self::Split(_) => format!("channel {place} is narrowed and gets less of the flow: a loss coefficient of {number} more"),
            Self::Rate(_) => format!("the flow through {place} is {number} times what is stated{when}"),
            Self::Inlet(_) => format!("the water enters {place} {}{when}", told.warmer()),
            Self::Line(_) => format!("the line to {place} warms the water by {kelvin} at the middle flow, less at more flow"),
            Self::BoundaryFilm(_) => format!("the film of the boundary {place} is {number} times the model's{when}"),
        }
    }

    fn common_factor(&self) -> Option<CommonFactor> {
        matches!(self, Self::Film(_)).then_some(CommonFactor::Films)
    }
}

/// L/min in a m³/s.
const LITRES_PER_MINUTE: f64 = 60_000.0;

fn film_key(boundary: &str) -> String {
    format!("boundary.{}.film", quoted(boundary))
}

/// A temperature of the file with a formula of kelvin added, as TOML; `None` where it counts in another unit.
fn warmer(now: &Leaf, machine: &Machine, kelvin: &str) -> Result<Option<String>> {
    Ok(match now {
        Leaf::Text(now) => {
            let celsius = match units::quantity(now) {
                Some((number, unit, dimension)) => format!("{:?}", units::convert(number, unit, dimension)? - units::ZERO_CELSIUS),
                None if machine.variables.iter().any(|v| v.name == now.trim()) => format!("{}_degC", now.trim()),
                None => now.clone(),
            };
            Some(text(format!("({celsius}) + {kelvin}")))
        }
        Leaf::Table(entries) => {
            let is_kelvin = |unit: &Leaf| matches!(unit, Leaf::Text(unit) if unit == "K" || unit == "degC");
            let changed = entries.iter().map(|(key, value)| match (key.as_str(), value) {
                ("formula", Leaf::Text(formula)) => Some((key.clone(), Leaf::Text(format!("({formula}) + {kelvin}")))),
                ("unit", unit) if !is_kelvin(unit) => None,
                _ => Some((key.clone(), value.clone())),
            });
            changed.collect::<Option<Vec<_>>>().map(|entries| Leaf::Table(entries).to_toml())
        }
        _ => None,
    })
}

/// A flow of the file times a formula, as TOML.
fn multiplied(now: &Leaf, machine: &Machine, factor: &str) -> Result<Option<String>> {
    Ok(match now {
        Leaf::Text(now) => {
            let of = |own: String, unit: String| {
                let entry = |key: &str, value: String| (key.to_string(), Leaf::Text(value));
                Leaf::Table(vec![entry("formula", format!("({own}) * {factor}")), entry("unit", unit)]).to_toml()
            };
            match (units::quantity(now), machine.variables.iter().find(|v| v.name == now.trim())) {
                (Some((number, unit, dimension)), _) => {
                    let litres = nine_digits(units::convert(number, unit, dimension)? * LITRES_PER_MINUTE);
                    Some(of(format!("{litres:?}"), "L/min".into()))
                }
                (None, Some(variable)) => {
                    let (name, unit) = variable.in_expressions();
                    Some(of(name, unit))
                }
                (None, None) => Some(text(format!("({now}) * {factor}"))),
            }
        }
        Leaf::Table(entries) => {
            let changed = entries.iter().map(|(key, value)| match (key.as_str(), value) {
                ("formula", Leaf::Text(formula)) => (key.clone(), Leaf::Text(format!("({formula}) * {factor}"))),
                _ => (key.clone(), value.clone()),
            });
            Some(Leaf::Table(changed.collect()).to_toml())
        }
        _ => None,
    })
}

/// Loss coefficients of a channel that shares its flow with others, all together; none of others, or without flow.
fn branch_loss(machine: &Machine, network: &Network, s: usize, condition: &Condition) -> Option<f64> {
    let stream = network.streams.get(s)?;
    let tree = network.circuits.get(stream.circuit)?;
    let shares_flow = members(&tree.layout).into_iter().any(|m| m != s && network.streams[m].upstream == stream.upstream);
    if !shares_flow {
        return None;
    }
    let load = Load::at(machine, condition).ok()?;
    let inlet = load.inlets[stream.circuit];
    let states = network.stream_states(&load, &vec![inlet; network.nodes]).ok()?;
    let liquid = tree.circuit.liquid.at(inlet).ok()?;
    let area = 0.25 * std::f64::consts::PI * stream.diameter * stream.diameter;
    let pressure = 0.5 * liquid.density * (states[s].flow / area).powi(2);
    (pressure > 0.0).then(|| states[s].pressure_drop / pressure)
}

fn circuit_parts(network: &Network, machine: &Machine, c: usize) -> Vec<String> {
    let streams = network.streams.iter().filter(|s| s.circuit == c);
    let channel = |name: &str| machine.channels.iter().find(|channel| channel.name == name);
    let mut found: Vec<String> = streams.filter_map(|s| channel(&s.name).map(|ch| machine.parts[ch.part].name.clone())).collect();
    found.sort();
    found.dedup();
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use coldplate_describe::machine::Machine;
    use coldplate_base::document::Document;

    const MACHINE: &str = r#"
name = "One plate"
[variables]
coolant_flow = { unit = "L/min", default = "6 L/min" }
return_flow = { unit = "m3/h", default = "0.3 m3/h" }
[material.steel]
conductivity = "45 W/(m K)"
density = "7800 kg/m3"
specific_heat = "470 J/(kg K)"
[part.plate]
material = "steel"
box = ["100 mm", "100 mm", "20 mm"]
[channel.plate]
in = "plate"
diameter = "8 mm"
serpentine = { passes = 5, along = "+y", across = "+x", pitch = "15 mm" }
[circuit.water]
layout = ["plate"]
inlet_temperature = "20 degC"
flow = "6 L/min"
"#;

    /// Volume flow into the only circuit at the default condition, m³/s.
    fn flow(document: &Document) -> f64 {
        let machine = Machine::from_document(document).unwrap();
        Load::at(&machine, &machine.condition(&[]).unwrap()).unwrap().flows[0]
    }

    #[test]
    fn a_flow_is_multiplied_in_every_form_that_a_file_may_state_it_in() {
        let forms = [
            "\"6 L/min\"",
            "\"1.1e-4 m3/s\"",
            "\"0.02 m3/h\"",
            "\"coolant_flow\"",
            "\"return_flow\"",
            "\"0.9 * coolant_flow_m3_s\"",
            "\"coolant_flow_m3_s + 1e-5\"",
            "{ formula = \"2 + coolant_flow_L_min\", unit = \"L/min\" }",
            "{ formula = \"return_flow_m3_h\", unit = \"m3/h\" }",
        ];
        for form in forms {
            let mut document = Document::parse(MACHINE, "plate.toml").unwrap();
            document.apply_set("circuit.water.flow", form).unwrap();
            let before = flow(&document);
            let machine = Machine::from_document(&document).unwrap();
            let now = document.leaf("circuit.water.flow").unwrap().unwrap();
            let written = multiplied(&now, &machine, "(1 + 0.25)").unwrap().expect(form);
            document.apply_set("circuit.water.flow", &written).unwrap();
            let after = flow(&document);
            assert!((after / before - 1.25).abs() < 1e-8, "{form} -> {written}: {before} -> {after}");
        }
    }
}
