//! What goes wrong in such machines, with magnitudes as they have them.

use coldplate_base::random::Random;
use coldplate_describe::machine::{Circuit, Contact, Machine, Part, Property};
use coldplate_diagnose::Law;
use coldplate_solve::study::Study;

use super::{Hidden, between, choose};

/// Kinds that the quick cases draw from, those of steady tables, and those of logs.
pub const STEADY: usize = 14;
/// Scale and common factors too.
pub const TABLES: usize = 18;
/// Stores and slow sensors too.
pub const LOGS: usize = 20;

/// An effect of the kinds that go wrong in such machines, with a magnitude as they have it.
pub fn effect(study: &Study, sensors: &[usize], kinds: usize, random: &mut Random) -> Hidden {
    let machine = &study.model.machine;
    let network = &study.model.network;
    let groups = groups(machine);
    let circuits: Vec<&Circuit> = machine.circuits.iter().filter(|c| c.intake.feeders().is_empty()).collect();
    let factor = |random: &mut Random, low: f64, high: f64| (low.ln() + (high / low).ln() * random.unit()).exp();
    let scaled = |key: String, factor: f64| -> Option<Vec<(String, String)>> {
        let p = study.parameter(&key).ok()?;
        Some(p.to_set(p.value * factor, machine).ok()?.into_iter().collect())
    };
    let total: f64 = coldplate_network::Load::at(machine, &machine.condition(&[]).unwrap()).unwrap().powers.iter().sum();
    loop {
        let made: Option<Hidden> = match (random.unit() * kinds as f64) as usize {
            0 => {
                let part = choose(random, &groups).clone();
                let watts = total * factor(random, 0.01, 0.15) * if random.unit() < 0.3 { -1.0 } else { 1.0 };
                let law = *choose(random, &[Law::Constant, Law::Speed, Law::SpeedSquared]);
                Some(heat(part, watts, law))
            }
            1 | 2 => {
                let source = choose(random, &machine.sources).name.clone();
                let f = if random.unit() < 0.5 { factor(random, 0.4, 0.85) } else { factor(random, 1.15, 3.0) };
                scaled(format!("source.{source}.power"), f).map(|lines| Hidden::new("source factor", source, f - 1.0, lines))
            }
            3 | 4 => {
                let contact = choose(random, &machine.contacts).name.clone();
                let f = if random.unit() < 0.6 { factor(random, 0.2, 0.8) } else { factor(random, 1.25, 5.0) };
                let key = ["conductance", "total_conductance"]
                    .iter()
                    .map(|l| format!("contact.{contact}.{l}"))
                    .find(|k| study.parameter(k).is_ok());
                key.and_then(|k| scaled(k, f)).map(|lines| Hidden::new("contact conductance", contact, f.ln(), lines))
            }
            5 if !machine.channels.is_empty() => {
                let channel = choose(random, &machine.channels).name.clone();
                let f = factor(random, 0.3, 0.8);
                scaled(format!("channel.{channel}.film_factor"), f).map(|lines| Hidden::new("film coefficient", channel, f.ln(), lines))
            }
            6 if !circuits.is_empty() => {
                let circuit = choose(random, &circuits).name.clone();
                let f = factor(random, 0.5, 0.9);
                scaled(format!("circuit.{circuit}.flow"), f).map(|lines| Hidden::new("coolant flow", circuit, f.ln(), lines))
            }
            7 if !circuits.is_empty() => {
                let circuit = choose(random, &circuits).name.clone();
                let kelvin = between(random, 0.15, 0.6) * if random.unit() < 0.5 { -1.0 } else { 1.0 };
                let p = study.parameter(&format!("circuit.{circuit}.inlet_temperature")).ok();
                p.and_then(|p| p.to_set(p.value + kelvin, machine).ok().flatten())
                    .map(|set| Hidden::new("coolant inlet offset", circuit, kelvin, vec![set]))
            }
            8 => {
                let part = choose(random, &groups).clone();
                let f = if random.unit() < 0.5 { factor(random, 0.3, 0.7) } else { factor(random, 1.3, 1.8) };
                let key = format!("part.{part}.surface.effective_emissivity");
                // No surface emits more than a black one.
                let is_possible = study.parameter(&key).is_ok_and(|p| p.value * f <= 1.0);
                scaled(key, f).filter(|_| is_possible).map(|lines| Hidden::new("emissivity", part, f.ln(), lines))
            }
            9 => {
                let part = choose(random, &groups).clone();
                let g = factor(random, 0.02, 0.4);
                let lines = vec![
                    ("node.hidden".into(), "{ temperature = \"ambient_temperature\" }".into()),
                    (
                        "contact.hidden".into(),
                        format!("{{ between = [\"{part}\", \"hidden\"], conductance = \"{:?} W/(m2 K)\", area = \"0.01 m2\" }}", 100.0 * g),
                    ),
                ];
                Some(Hidden::new("leak to the surroundings", part, g, lines))
            }
            10 => {
                let (a, b) = (choose(random, &groups).clone(), choose(random, &groups).clone());
                let group = |n: &str| network.groups.iter().position(|g| g == n).unwrap() as u32;
                let touch = |x: u32, y: u32| {
                    network.joints.iter().any(|j| {
                        let (p, q) = (network.group[j.a as usize], network.group[j.b as usize]);
                        (p, q) == (x, y) || (q, p) == (x, y)
                    })
                };
                let g = factor(random, 0.05, 1.0);
                let order: Vec<&str> = network.groups.iter().map(String::as_str).filter(|name| *name == a || *name == b).collect();
                (order.len() == 2 && !touch(group(&a), group(&b))).then(|| {
                    let value =
                        format!("{{ between = [\"{a}\", \"{b}\"], conductance = \"{:?} W/(m2 K)\", area = \"0.01 m2\" }}", 100.0 * g);
                    Hidden::new("conductive link", order.join(" - "), g, vec![("contact.hidden_link".into(), value)])
                })
            }
            11 => {
                let kelvin = between(random, 0.4, 2.0) * if random.unit() < 0.5 { -1.0 } else { 1.0 };
                let p = study.parameter("chamber.temperature").ok().filter(|_| !machine.parts.is_empty());
                p.and_then(|p| p.to_set(p.value + kelvin, machine).ok().flatten())
                    .map(|set| Hidden::new("chamber temperature", "chamber", kelvin, vec![set]))
            }
            12 => {
                let k = (random.unit() * sensors.len() as f64) as usize;
                let place = machine.sensors[sensors[k]].name.clone();
                let (kind, amplitude) = if random.unit() < 0.6 {
                    ("sensor offset", between(random, 0.25, 1.2) * if random.unit() < 0.5 { -1.0 } else { 1.0 })
                } else {
                    ("sensor gain", between(random, 0.03, 0.12) * if random.unit() < 0.5 { -1.0 } else { 1.0 })
                };
                let law = if kind == "sensor gain" { Law::Temperature } else { Law::Constant };
                Some(Hidden::of_sensor(kind, place, law, (k, amplitude, k)))
            }
            13 => {
                let (i, j) = ((random.unit() * sensors.len() as f64) as usize, (random.unit() * sensors.len() as f64) as usize);
                let (i, j) = (i.min(j), i.max(j));
                let name = |k: usize| machine.sensors[sensors[k]].name.clone();
                (i != j).then(|| Hidden::of_sensor("swapped sensors", format!("{} - {}", name(i), name(j)), Law::Constant, (i, 1.0, j)))
            }
            14 | 15 if !machine.channels.is_empty() => {
                let channel = choose(random, &machine.channels).name.clone();
                let resistance = factor(random, 5e-5, 8e-4);
                let line = (format!("channel.{channel}.fouling_resistance"), format!("\"{resistance:?} m2 K/W\""));
                Some(Hidden::new("scale", channel, resistance, vec![line]))
            }
            16 | 17 => common(study, random),
            18 => {
                let group = choose(random, &groups).clone();
                let f = if random.unit() < 0.5 { factor(random, 0.5, 0.8) } else { factor(random, 1.25, 2.0) };
                stores(study, &group, f)
            }
            19 => {
                let k = (random.unit() * sensors.len() as f64) as usize;
                let lag = factor(random, 40.0, 300.0);
                Some(Hidden::of_sensor("sensor lag", machine.sensors[sensors[k]].name.clone(), Law::Constant, (k, lag, k)))
            }
            _ => None,
        };
        if let Some(made) = made {
            return made;
        }
    }
}

/// Heat into a part, W at 2500 rpm.
fn heat(part: String, watts: f64, law: Law) -> Hidden {
    let power = match law {
        Law::Speed => format!("({watts:?}) * motor_speed_rpm / 2500"),
        Law::SpeedSquared => format!("({watts:?}) * (motor_speed_rpm / 2500)^2"),
        _ => format!("{watts:?} W"),
    };
    let lines = vec![("source.hidden".into(), format!("{{ in = \"{part}\", power = \"{power}\" }}"))];
    Hidden { law, ..Hidden::new("heat source", part, watts, lines) }
}

/// Parts, then lumped nodes that are free.
pub fn groups(machine: &Machine) -> Vec<String> {
    let free = machine.nodes.iter().filter(|node| node.fixed.is_none()).map(|node| node.name.clone());
    machine.parts.iter().map(|part| part.name.clone()).chain(free).collect()
}

/// An effect that all members of a kind share: a correlation, a supply, a paint, a torque, the chiller, the scanner.
pub fn common(study: &Study, random: &mut Random) -> Option<Hidden> {
    let machine = &study.model.machine;
    let all = |keys: Vec<String>, value: &dyn Fn(f64) -> f64| -> Option<Vec<(String, String)>> {
        let set = |key: &String| {
            let p = study.parameter(key).ok()?;
            p.to_set(value(p.value), machine).ok()?
        };
        (keys.len() > 1).then(|| keys.iter().map(set).collect())?
    };
    let sign = if random.unit() < 0.5 { -1.0 } else { 1.0 };
    let named =
        |name: &str, amplitude: f64, lines: Option<Vec<(String, String)>>| lines.map(|lines| Hidden::new(name, name, amplitude, lines));
    match (random.unit() * 6.0) as usize {
        0 => {
            let f = (sign * between(random, 0.25, 0.6)).exp();
            let keys = machine.channels.iter().map(|c| format!("channel.{}.film_factor", c.name)).collect();
            named("all films", f.ln(), all(keys, &|v| v * f))
        }
        1 => {
            let f = 1.0 + sign * between(random, 0.06, 0.25);
            let keys = machine.sources.iter().map(|s| format!("source.{}.power", s.name)).collect();
            named("all heats", f - 1.0, all(keys, &|v| v * f))
        }
        2 => {
            let f = (sign * between(random, 0.25, 0.55)).exp();
            let own = |p: &Part| {
                let key = format!("part.{}.surface.effective_emissivity", p.name);
                matches!(study.document().leaf(&key), Ok(Some(_))).then_some(key)
            };
            // Only where every part has a number of its own.
            let keys: Option<Vec<String>> = machine.parts.iter().map(own).collect();
            named("all emissivities", f.ln(), all(keys?, &|v| (v * f).min(1.0)))
        }
        3 => {
            let f = (sign * between(random, 0.2, 0.6)).exp();
            let scalable = |c: &Contact| {
                ["conductance", "total_conductance"].iter().map(|k| format!("contact.{}.{k}", c.name)).find(|k| study.parameter(k).is_ok())
            };
            let keys: Option<Vec<String>> = machine.contacts.iter().map(scalable).collect();
            named("all contacts", f.ln(), all(keys?, &|v| v * f))
        }
        4 => {
            let kelvin = sign * between(random, 0.3, 1.0);
            let fed = machine.circuits.iter().filter(|c| c.intake.feeders().is_empty());
            let keys = fed.map(|c| format!("circuit.{}.inlet_temperature", c.name)).collect();
            named("all inlets", kelvin, all(keys, &|v| v + kelvin))
        }
        _ => Some(Hidden::of_sensor("all sensors", "all sensors", Law::Constant, (0, sign * between(random, 0.3, 1.0), 0))),
    }
}

/// A part or lumped node that stores another amount of heat.
fn stores(study: &Study, group: &str, factor: f64) -> Option<Hidden> {
    let (machine, network) = (&study.model.machine, &study.model.network);
    let g = network.groups.iter().position(|name| name == group)? as u32;
    let own: f64 = (0..network.solids).filter(|n| network.group[*n] == g).map(|n| network.capacity[n]).sum();
    let lines = match machine.parts.iter().find(|part| part.name == group) {
        Some(part) => {
            let material = &machine.materials[part.material];
            let Property::Constant(specific) = material.specific_heat else { return None };
            vec![
                (
                    "material.hidden".into(),
                    format!("{{ base = \"{}\", specific_heat = \"{:?} J/(kg K)\" }}", material.name, specific * factor),
                ),
                (format!("part.{group}.material"), "\"hidden\"".into()),
            ]
        }
        None => vec![(format!("node.{group}.capacity"), format!("\"{:?} J/K\"", own * factor))],
    };
    Some(Hidden::new("heat capacity", group, own * (factor - 1.0), lines))
}
