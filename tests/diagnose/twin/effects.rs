//! What goes wrong in such machines, with magnitudes as they have them.

use coldplate::describe::machine::{HeatedPlace, Place};
use coldplate::evidence::diagnose::Law;
use coldplate::foundation::random::Random;
use coldplate::solve::sensitivity::Study;

use super::{Hidden, between, choose};

/// An effect of the kinds that go wrong in such machines, with a magnitude as they have it.
pub fn effect(study: &Study, sensors: &[usize], random: &mut Random) -> Hidden {
    let machine = &study.model.machine;
    let network = &study.model.network;
    let factor = |random: &mut Random, low: f64, high: f64| (low.ln() + (high / low).ln() * random.unit()).exp();
    let scaled = |key: String, factor: f64| -> Option<Vec<(String, String)>> {
        let p = study.parameter(&key).ok()?;
        Some(p.to_set(p.value * factor, machine).ok()?.into_iter().collect())
    };
    let total: f64 = coldplate::discretise::network::Load::at(machine, &machine.condition(&[]).unwrap()).unwrap().powers.iter().sum();
    loop {
        let made: Option<Hidden> = match (random.unit() * 14.0) as usize {
            0 => {
                let part = choose(random, &machine.parts).name.clone();
                let watts = total * factor(random, 0.01, 0.15) * if random.unit() < 0.3 { -1.0 } else { 1.0 };
                let law = *choose(random, &[Law::Constant, Law::Speed, Law::SpeedSquared]);
                Some(heat(part, watts, law))
            }
            1 | 2 => {
                let source = choose(random, &machine.sources).name.clone();
                let f = if random.unit() < 0.5 { factor(random, 0.4, 0.85) } else { factor(random, 1.15, 3.0) };
                scaled(format!("source.{source}.power"), f).map(|lines| Hidden {
                    kind: "source factor".into(),
                    place: source,
                    law: Law::Constant,
                    amplitude: f - 1.0,
                    lines,
                    sensor: None,
                })
            }
            3 | 4 => {
                let contact = choose(random, &machine.contacts).name.clone();
                let f = if random.unit() < 0.6 { factor(random, 0.2, 0.8) } else { factor(random, 1.25, 5.0) };
                let key = ["conductance", "total_conductance"]
                    .iter()
                    .map(|l| format!("contact.{contact}.{l}"))
                    .find(|k| study.parameter(k).is_ok());
                key.and_then(|k| scaled(k, f)).map(|lines| Hidden {
                    kind: "contact conductance".into(),
                    place: contact,
                    law: Law::Constant,
                    amplitude: f.ln(),
                    lines,
                    sensor: None,
                })
            }
            5 => {
                let channel = choose(random, &machine.channels).name.clone();
                let f = factor(random, 0.3, 0.8);
                scaled(format!("channel.{channel}.film_factor"), f).map(|lines| Hidden {
                    kind: "film coefficient".into(),
                    place: channel,
                    law: Law::Constant,
                    amplitude: f.ln(),
                    lines,
                    sensor: None,
                })
            }
            6 => {
                let circuit = choose(random, &machine.circuits).name.clone();
                let f = factor(random, 0.5, 0.9);
                scaled(format!("circuit.{circuit}.flow"), f).map(|lines| Hidden {
                    kind: "coolant flow".into(),
                    place: circuit,
                    law: Law::Constant,
                    amplitude: f.ln(),
                    lines,
                    sensor: None,
                })
            }
            7 => {
                let circuit = choose(random, &machine.circuits).name.clone();
                let kelvin = between(random, 0.15, 0.6) * if random.unit() < 0.5 { -1.0 } else { 1.0 };
                let p = study.parameter(&format!("circuit.{circuit}.inlet_temperature")).ok();
                p.and_then(|p| p.to_set(p.value + kelvin, machine).ok().flatten()).map(|set| Hidden {
                    kind: "coolant inlet offset".into(),
                    place: circuit,
                    law: Law::Constant,
                    amplitude: kelvin,
                    lines: vec![set],
                    sensor: None,
                })
            }
            8 => {
                let part = choose(random, &machine.parts).name.clone();
                let f = if random.unit() < 0.5 { factor(random, 0.3, 0.7) } else { factor(random, 1.3, 1.8) };
                let key = format!("part.{part}.surface.effective_emissivity");
                // No surface emits more than a black one.
                let is_possible = study.parameter(&key).is_ok_and(|p| p.value * f <= 1.0);
                scaled(key, f).filter(|_| is_possible).map(|lines| Hidden {
                    kind: "emissivity".into(),
                    place: part,
                    law: Law::Constant,
                    amplitude: f.ln(),
                    lines,
                    sensor: None,
                })
            }
            9 => {
                let part = choose(random, &machine.parts).name.clone();
                let g = factor(random, 0.02, 0.4);
                let lines = vec![
                    ("node.hidden".into(), "{ temperature = \"ambient_temperature\" }".into()),
                    (
                        "contact.hidden".into(),
                        format!("{{ between = [\"{part}\", \"hidden\"], conductance = \"{:?} W/(m2 K)\", area = \"0.01 m2\" }}", 100.0 * g),
                    ),
                ];
                Some(Hidden { kind: "leak to the surroundings".into(), place: part, law: Law::Constant, amplitude: g, lines, sensor: None })
            }
            10 => {
                let (a, b) = (choose(random, &machine.parts).name.clone(), choose(random, &machine.parts).name.clone());
                let group = |n: &str| network.groups.iter().position(|g| g == n).unwrap() as u32;
                let touch = |x: u32, y: u32| {
                    network.joints.iter().any(|j| {
                        let (p, q) = (network.group[j.a as usize], network.group[j.b as usize]);
                        (p, q) == (x, y) || (q, p) == (x, y)
                    })
                };
                let g = factor(random, 0.05, 1.0);
                let order = machine.parts.iter().filter(|p| p.name == a || p.name == b).map(|p| p.name.clone()).collect::<Vec<_>>();
                (order.len() == 2 && !touch(group(&a), group(&b))).then(|| Hidden {
                    kind: "conductive link".into(),
                    place: format!("{} - {}", order[0], order[1]),
                    law: Law::Constant,
                    amplitude: g,
                    lines: vec![(
                        "contact.hidden_link".into(),
                        format!("{{ between = [\"{a}\", \"{b}\"], conductance = \"{:?} W/(m2 K)\", area = \"0.01 m2\" }}", 100.0 * g),
                    )],
                    sensor: None,
                })
            }
            11 => {
                let kelvin = between(random, 0.4, 2.0) * if random.unit() < 0.5 { -1.0 } else { 1.0 };
                let p = study.parameter("chamber.temperature").unwrap();
                let set = p.to_set(p.value + kelvin, machine).unwrap();
                set.map(|set| Hidden {
                    kind: "chamber temperature".into(),
                    place: "chamber".into(),
                    law: Law::Constant,
                    amplitude: kelvin,
                    lines: vec![set],
                    sensor: None,
                })
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
                Some(Hidden { kind: kind.into(), place, law, amplitude, lines: Vec::new(), sensor: Some((k, amplitude, k)) })
            }
            _ => {
                let (i, j) = ((random.unit() * sensors.len() as f64) as usize, (random.unit() * sensors.len() as f64) as usize);
                let (i, j) = (i.min(j), i.max(j));
                let name = |k: usize| machine.sensors[sensors[k]].name.clone();
                (i != j).then(|| Hidden {
                    kind: "swapped sensors".into(),
                    place: format!("{} - {}", name(i), name(j)),
                    law: Law::Constant,
                    amplitude: 1.0,
                    lines: Vec::new(),
                    sensor: Some((i, 1.0, j)),
                })
            }
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
    Hidden { kind: "heat source".into(), place: part, law, amplitude: watts, lines, sensor: None }
}

/// A source's own heat wrong, or other heat where a source is: at one speed the same.
pub fn inseparable(study: &Study, random: &mut Random) -> Hidden {
    let machine = &study.model.machine;
    let load = coldplate::discretise::network::Load::at(machine, &machine.condition(&[]).unwrap()).unwrap();
    let total: f64 = load.powers.iter().sum();
    loop {
        let s = ((random.unit() * machine.sources.len() as f64) as usize).min(machine.sources.len() - 1);
        let source = &machine.sources[s];
        let [HeatedPlace { place: Place::Part(part), block: None }] = source.places.as_slice() else { continue };
        let watts = total * between(random, 0.02, 0.1);
        // As much as either could be.
        let share = watts / load.powers[s];
        if share > 1.0 {
            continue;
        }
        if random.unit() < 0.5 {
            return heat(machine.parts[*part].name.clone(), watts, Law::Constant);
        }
        if let Ok(p) = study.parameter(&format!("source.{}.power", source.name)) {
            let lines = p.to_set(p.value * (1.0 + share), machine).unwrap().into_iter().collect();
            return Hidden {
                kind: "source factor".into(),
                place: source.name.clone(),
                law: Law::Constant,
                amplitude: share,
                lines,
                sensor: None,
            };
        }
    }
}

/// What no kind of the catalogue is: a conductivity, a law it does not have.
pub fn outside(study: &Study, random: &mut Random) -> Hidden {
    let machine = &study.model.machine;
    let hidden = |place: String, lines| Hidden { kind: "outside".into(), place, law: Law::Constant, amplitude: 0.0, lines, sensor: None };
    loop {
        match (random.unit() * 3.0) as usize {
            0 => {
                let material = choose(random, &machine.materials).name.clone();
                let key = format!("material.{material}.conductivity");
                if let Ok(p) = study.parameter(&key) {
                    let f = [0.15, 0.3, 3.0][(random.unit() * 3.0) as usize];
                    return hidden(material, p.to_set(p.value * f, machine).unwrap().into_iter().collect());
                }
            }
            1 => {
                // Heat that comes and goes with the chamber's temperature.
                let part = choose(random, &machine.parts).name.clone();
                let watts = between(random, 5.0, 30.0);
                let value = format!("{{ in = \"{part}\", power = \"{watts:?} * sin(1.7 * ambient_temperature_degC)\" }}");
                return hidden(part, vec![("source.hidden".into(), value)]);
            }
            _ => {
                // Heat that swings with the flow.
                let part = choose(random, &machine.parts).name.clone();
                let watts = between(random, 5.0, 30.0);
                let value = format!("{{ in = \"{part}\", power = \"{watts:?} * sin(9 * coolant_flow_L_min)\" }}");
                return hidden(part, vec![("source.hidden".into(), value)]);
            }
        }
    }
}
