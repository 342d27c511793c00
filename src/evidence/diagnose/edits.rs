//! A cause as lines of the machine file, and what a sensor's own error makes of its readings.

use std::collections::HashMap;

use super::catalogue::{
    ADDED, Act, DRIFT, Hypothesis, LEAST_STORE, Law, REFERENCE, Scales, UserKind, capacity, contact_key, emissivity_key, film_key,
    outer_faces,
};
use crate::describe::machine::Property;
use crate::error::Result;
use crate::evidence::measurement::Data;
use crate::foundation::document::{Leaf, quoted};
use crate::physics::radiation::SIGMA;
use crate::solve::sensitivity::Study;
use crate::units;

impl Hypothesis {
    /// The lines of the machine file that make it so, (key, TOML value); empty for what a sensor does, `None` where the
    /// machine file has no words for it.
    ///
    /// # Errors
    /// A key of the file cannot be read.
    pub fn sets(&self, study: &Study, scales: &Scales, user: &[UserKind], amplitude: f64) -> Result<Option<Vec<(String, String)>>> {
        let machine = &study.model.machine;
        let text = |t: String| Leaf::Text(t).to_toml();
        let network = &study.model.network;
        let group = |g: u32| network.groups[g as usize].clone();
        let scaled = |key: &str, factor: f64| -> Result<Option<Vec<(String, String)>>> {
            let parameter = study.parameter(key)?;
            Ok(parameter.to_set(parameter.value * factor, machine)?.map(|set| vec![set]))
        };
        let added = |what: &str| format!("{what}.\"{ADDED} {} {}\"", self.kind, self.place.replace('"', ""));
        let law = scales.expression(self.law);
        Ok(match self.act {
            Act::Heat(g) => {
                // A formula needs a name; a constant is a number with its unit.
                let power = if self.law == Law::Constant { format!("{amplitude:?} W") } else { format!("({amplitude:?}) * ({law})") };
                let value = format!("{{ in = {}, power = {} }}", text(group(g)), text(power));
                Some(vec![(added("source"), value)])
            }
            Act::UserHeat(u) => {
                let places: Vec<String> = user[u].places.iter().map(|p| text(p.clone())).collect();
                let power = text(format!("({amplitude:?}) * ({})", user[u].expression));
                Some(vec![(added("source"), format!("{{ in = [{}], power = {power} }}", places.join(", ")))])
            }
            Act::Source(s) if self.law == Law::Temperature => {
                let source = &machine.sources[s];
                let key = format!("source.{}.temperature_coefficient", quoted(&source.name));
                Some(vec![(key, text(format!("{:?} 1/K", source.temperature_coefficient + amplitude / DRIFT)))])
            }
            Act::Source(s) => {
                let key = format!("source.{}.power", quoted(&machine.sources[s].name));
                let Some(Leaf::Text(now)) = study.document().leaf(&key)? else { return Ok(None) };
                let watts = match units::quantity(&now) {
                    Some((number, unit, dimension)) => {
                        let watts = units::convert(number, unit, dimension)?;
                        if self.law == Law::Constant {
                            return Ok(Some(vec![(key, text(format!("{:?} W", watts * (1.0 + amplitude))))]));
                        }
                        format!("{watts:?}")
                    }
                    None => now,
                };
                Some(vec![(key, text(format!("({watts}) * (1 + ({amplitude:?}) * ({law}))")))])
            }
            Act::Contact(c) => {
                let Some(key) = contact_key(study, &machine.contacts[c].name) else { return Ok(None) };
                if self.law == Law::Constant {
                    return scaled(&key, amplitude.exp());
                }
                // A table takes the place of the number; the total conductance would need its area.
                if key.ends_with("total_conductance") {
                    return Ok(None);
                }
                let parameter = study.parameter(&key)?;
                let h = units::express(parameter.value, "W/(m2 K)", parameter.dimension)?;
                let row = |t: f64| format!("[\"{t} degC\", \"{:?} W/(m2 K)\"]", h * (amplitude * (t + 273.15 - REFERENCE) / DRIFT).exp());
                let rows: Vec<String> = (-2..=16).map(|i| row(5.0 * f64::from(i))).collect();
                let table = format!("contact.{}", quoted(&machine.contacts[c].name));
                let Some(Leaf::Table(entries)) = study.document().leaf(&table)? else { return Ok(None) };
                let kept = entries.iter().filter(|(k, _)| k != "conductance").map(|(k, v)| format!("{k} = {}", v.to_toml()));
                let all: Vec<String> = kept.chain([format!("temperature_table = [{}]", rows.join(", "))]).collect();
                Some(vec![(table, format!("{{ {} }}", all.join(", ")))])
            }
            Act::Film(c) => return scaled(&format!("channel.{}.film_factor", quoted(&machine.channels[c].name)), amplitude.exp()),
            Act::Flow(c) => return scaled(&format!("circuit.{}.flow", quoted(&machine.circuits[c].name)), amplitude.exp()),
            Act::Inlet(c) => {
                let key = format!("circuit.{}.inlet_temperature", quoted(&machine.circuits[c].name));
                let now = match study.document().leaf(&key)? {
                    Some(Leaf::Text(now)) => now,
                    _ => "coolant_temperature".to_string(),
                };
                let celsius = match units::quantity(&now) {
                    Some((number, unit, dimension)) => format!("{:?}", units::convert(number, unit, dimension)? - 273.15),
                    None if machine.variables.iter().any(|v| v.name == now) => format!("{now}_degC"),
                    None => now,
                };
                Some(vec![(key, text(format!("({celsius}) + ({amplitude:?}) * ({law})")))])
            }
            Act::Chamber => {
                let parameter = study.parameter("chamber.temperature")?;
                parameter.to_set(parameter.value + amplitude, machine)?.map(|set| vec![set])
            }
            Act::Emissivity(g) => {
                let Some(key) = emissivity_key(study, &group(g)) else { return Ok(None) };
                let parameter = study.parameter(&key)?;
                parameter.to_set((parameter.value * amplitude.exp()).clamp(1e-4, 1.0), machine)?.map(|set| vec![set])
            }
            // About 1 W/(m² K) per pascal while molecules fly freely, beside what the file has.
            Act::Gas => {
                let own = match study.document().leaf("chamber.pressure")? {
                    Some(_) => study.parameter("chamber.pressure")?.value,
                    None => 0.0,
                };
                Some(vec![("chamber.pressure".into(), text(format!("{:?} Pa", own + amplitude.max(0.0))))])
            }
            Act::Leak(g) => {
                let node = format!("{ADDED} surroundings of {}", group(g));
                let held = format!("{{ temperature = {} }}", text("ambient_temperature".into()));
                Some(vec![(format!("node.{}", quoted(&node)), held), (added("contact"), self.conductor(&[group(g), node], amplitude))])
            }
            Act::Loss(p) => {
                let faces: Vec<String> = outer_faces(machine, p).into_iter().map(text).collect();
                let film = text(format!("{:?} W/(m2 K)", amplitude.max(1e-9)));
                let value = format!("{{ faces = [{}], film = {film}, fluid_temperature = \"ambient_temperature\" }}", faces.join(", "));
                Some(vec![(added("boundary"), value)])
            }
            Act::Boundary(b) => return scaled(&film_key(&machine.boundaries[b].name), amplitude.exp()),
            Act::Link(a, b) => Some(vec![(added("contact"), self.conductor(&[group(a), group(b)], amplitude))]),
            // A link of the file takes the faces it joins away from the chamber: it is not what this adds. Between temperatures
            // as near as those of a machine, radiation is a conductance with the cube of their mean.
            Act::Radiate(a, b) => {
                let row = |celsius: i32| {
                    let mean = f64::from(celsius) + 273.15;
                    format!("[\"{celsius} degC\", \"{:.6} W/(m2 K)\"]", 4.0 * SIGMA * mean.powi(3))
                };
                let rows: Vec<String> = (-5..=30).map(|i| row(5 * i)).collect();
                let ends = [a, b].map(|g| text(group(g)));
                let area = amplitude.max(1e-9);
                let table = format!("temperature_table = [{}], area = \"{area:?} m2\"", rows.join(", "));
                Some(vec![(added("contact"), format!("{{ between = [{}], {table} }}", ends.join(", ")))])
            }
            Act::Capacity(g) => {
                let name = group(g);
                let own = capacity(network, g);
                let factor = if own > 0.0 { (1.0 + amplitude / own).max(LEAST_STORE) } else { 1.0 };
                let Some(part) = machine.parts.iter().find(|p| p.name == name) else {
                    let key = format!("node.{}.capacity", quoted(&name));
                    return if own > 0.0 {
                        scaled(&key, factor)
                    } else {
                        Ok(Some(vec![(key, text(format!("{:?} J/K", amplitude.max(0.0))))]))
                    };
                };
                let material = &machine.materials[part.material];
                let key = format!("material.{}.specific_heat", quoted(&material.name));
                let is_own = machine.parts.iter().filter(|p| p.material == part.material).count() == 1;
                if is_own && study.parameter(&key).is_ok() {
                    return scaled(&key, factor);
                }
                // Others are made of it too: the part gets a material of its own.
                let value = match &material.specific_heat {
                    Property::Constant(c) => text(format!("{:?} J/(kg K)", c * factor)),
                    Property::Table(rows) => {
                        let row = |(t, c): &(f64, f64)| format!("[\"{:?} degC\", \"{:?} J/(kg K)\"]", t - 273.15, c * factor);
                        format!("[{}]", rows.iter().map(row).collect::<Vec<_>>().join(", "))
                    }
                };
                let new = format!("{ADDED} {name}");
                let made = format!("{{ base = {}, specific_heat = {value} }}", text(material.name.clone()));
                Some(vec![(format!("material.{}", quoted(&new)), made), (format!("part.{}.material", quoted(&name)), text(new))])
            }
            Act::Branch(c) => {
                let channel = &machine.channels[c];
                let key = format!("channel.{}.minor_loss", quoted(&channel.name));
                Some(vec![(key, format!("{:?}", channel.minor_loss + amplitude.max(0.0)))])
            }
            Act::Bias(_) | Act::Gain(_) | Act::Lag(_) | Act::Swap(..) => Some(Vec::new()),
        })
    }

    fn conductor(&self, ends: &[String; 2], amplitude: f64) -> String {
        let [a, b] = ends.each_ref().map(|e| Leaf::Text(e.clone()).to_toml());
        // A stated area: the ends need not touch.
        format!("{{ between = [{a}, {b}], conductance = \"{:?} W/(m2 K)\", area = \"0.01 m2\" }}", 100.0 * amplitude.max(1e-9))
    }

    /// Whether it is so or not, without an amplitude to fit: that amplitude is 1.
    pub fn is_fixed(&self) -> bool {
        matches!(self.act, Act::Swap(..))
    }

    /// Whether it is about a reading and not about the machine.
    pub fn is_sensor(&self) -> bool {
        matches!(self.act, Act::Bias(_) | Act::Gain(_) | Act::Lag(_) | Act::Swap(..))
    }

    /// For exchanged sensors: at each of some readings, given by row and sensor, the one that belongs there.
    pub fn relabelled(&self, places: &[(usize, usize)]) -> Option<Vec<usize>> {
        let Act::Swap(a, b) = self.act else { return None };
        let position: HashMap<&(usize, usize), usize> = places.iter().enumerate().map(|(i, place)| (place, i)).collect();
        let of = |(i, (r, k)): (usize, &(usize, usize))| {
            let other = match *k {
                k if k == a => b,
                k if k == b => a,
                _ => return i,
            };
            position.get(&(*r, other)).copied().unwrap_or(i)
        };
        Some(places.iter().enumerate().map(of).collect())
    }

    /// What it does to predicted readings (rows, then sensors) beside the machine: sensors' own errors.
    pub fn read(&self, data: &Data, predicted: &[f64], amplitude: f64) -> Vec<f64> {
        let places = crate::evidence::measurement::whiten::places(data);
        let mut found = predicted.to_vec();
        match self.act {
            Act::Bias(k) => places.iter().zip(&mut found).filter(|((_, own), _)| *own == k).for_each(|(_, t)| *t += amplitude),
            Act::Gain(k) => {
                places.iter().zip(&mut found).filter(|((_, own), _)| *own == k).for_each(|(_, t)| *t += amplitude * (*t - REFERENCE));
            }
            Act::Swap(..) => {
                let others = self.relabelled(&places).unwrap_or_default();
                others.iter().enumerate().for_each(|(i, other)| found[i] += amplitude * (predicted[*other] - predicted[i]));
            }
            Act::Lag(k) => {
                // First-order lag behind the predicted course, which runs straight between the rows of each test.
                let mut last: std::collections::BTreeMap<&str, (f64, f64, f64)> = std::collections::BTreeMap::new();
                for (i, (r, own)) in places.iter().enumerate() {
                    if *own != k {
                        continue;
                    }
                    let row = &data.rows[*r];
                    let time = row.time.unwrap_or(0.0);
                    let shown = match last.get(row.test.as_str()) {
                        Some((before, told, shown)) if amplitude > 0.0 && time > *before => {
                            let behind = amplitude * (predicted[i] - told) / (time - before);
                            predicted[i] - behind + (shown - told + behind) * (-(time - before) / amplitude).exp()
                        }
                        _ => predicted[i],
                    };
                    last.insert(&row.test, (time, predicted[i], shown));
                    found[i] = shown;
                }
            }
            _ => {}
        }
        found
    }
}
