//! Effects outside the catalogue: curves of heats and contacts, sizes, a part of another material, wires that were exchanged in the middle of
//! the tests, a logger's clock, memory.

use coldplate_base::random::Random;
use coldplate_describe::machine::{Machine, Place};
use coldplate_solve::study::Study;

use crate::machines::Setting;
use coldplate_testing::twin::effects::groups;
use coldplate_testing::twin::{Hidden, between, choose};

/// An effect that is not in the catalogue, and what it does that a machine file has no words for.
pub struct Outside {
    /// What is hidden; its kind is the nearest of the catalogue.
    pub hidden: Hidden,
    /// What remembers.
    pub memory: Option<Memory>,
}

/// What depends on what was before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Memory {
    /// Once the motor ran at above seven tenths of the range, the effect stays until it runs below four tenths.
    Hysteresis,
    /// The water's temperature follows the stated one with this time constant, s.
    Lag(f64),
    /// The logger's clock is behind that of the conditions by this time, s.
    Clock(f64),
    /// From this share of the rows on, the effect is there.
    From(f64),
}

/// One of them.
pub fn outside(study: &Study, setting: &Setting, sensors: &[usize], random: &mut Random) -> Outside {
    loop {
        if let Some(made) = one(study, setting, sensors, random) {
            return made;
        }
    }
}

fn one(study: &Study, setting: &Setting, sensors: &[usize], random: &mut Random) -> Option<Outside> {
    let machine = &study.model.machine;
    let is_log = setting.log.is_some();
    let group = choose(random, &groups(machine)).clone();
    let contact = choose(random, &machine.contacts).name.clone();
    let most = machine.variables.iter().find(|v| v.name == "motor_speed")?.range?.1 * 60.0 / std::f64::consts::TAU;
    let share = format!("(motor_speed_rpm / {most:?})");
    let told = |hidden: Hidden, words: &str| Outside { hidden: Hidden { outside: Some(words.into()), ..hidden }, memory: None };
    let plain = |kind: &str, place: String, words: &str, lines: Vec<(String, String)>| told(Hidden::new(kind, place, 0.0, lines), words);
    let heat = |power: String| vec![("source.hidden".to_string(), format!("{{ in = \"{group}\", power = \"{power}\" }}"))];
    Some(match random.below(9) {
        0 => {
            let watts = between(random, 5.0, 40.0);
            let lines = heat(format!("{watts:?} * (0.2 + 0.8 * exp(-{share} / 0.15) + 0.5 * {share}^2)"));
            plain("heat source", group, "heat by Stribeck's curve", lines)
        }
        1 => {
            let (watts, at) = (between(random, 8.0, 40.0), between(random, 0.3, 0.8));
            let lines = heat(format!("{watts:?} * exp(-(({share} - {at:?}) / 0.15)^2)"));
            plain("heat source", group, "heat about one speed", lines)
        }
        2 => {
            let more = between(random, 0.5, 4.0);
            let line = (format!("contact.{contact}.factor"), format!("\"1 / (1 + {more:?} * {share})\""));
            plain("contact conductance", contact, "a contact that opens with the heat", vec![line])
        }
        3 => {
            let (warmer, area) = (between(random, 8.0, 20.0), between(random, 0.01, 0.05));
            let to = format!("emissivity = 0.9, surroundings_temperature = \"ambient_temperature_degC + {warmer:?}\"");
            let value = match machine.parts.iter().any(|part| part.name == group) {
                true => format!("{{ faces = [\"{group}.+z\"], {to} }}"),
                false => format!("{{ node = \"{group}\", area = \"{area:?} m2\", {to} }}"),
            };
            plain("radiation to the surroundings", group, "a second, warmer enclosure", vec![("boundary.hidden".into(), value)])
        }
        4 => {
            let (place, line) = setting.one_size(0.15, 0.3, random)?;
            plain("size", place, "a size that is off by 15 to 30 %", vec![line])
        }
        5 => {
            let part = machine.parts.iter().find(|part| part.name == group)?;
            let shared = machine.parts.iter().filter(|other| other.material == part.material).count() > 1;
            let base = &machine.materials[part.material].name;
            let conductivity = [0.4, 16.0, 120.0, 390.0][random.below(4)];
            let made = format!("{{ base = \"{base}\", conductivity = \"{conductivity:?} W/(m K)\" }}");
            let lines = vec![("material.hidden".into(), made), (format!("part.{group}.material"), "hidden".into())];
            let place = if shared { group } else { base.clone() };
            plain("thermal conductivity", place, "a part of another material", lines)
        }
        6 => {
            let watts = between(random, 5.0, 30.0);
            let lines = heat(format!("{watts:?} * sin(1.7 * ambient_temperature_degC)"));
            plain("heat source", group, "heat that swings with the room", lines)
        }
        7 if is_log => {
            let late = between(random, 60.0, 400.0);
            let made = plain("clock", "all sensors".into(), "a logger whose clock is behind", Vec::new());
            Outside { memory: Some(Memory::Clock(late)), ..made }
        }
        7 => {
            let (a, b) = (random.below(sensors.len()), random.below(sensors.len()));
            let (a, b) = (a.min(b), a.max(b));
            let name = |k: usize| machine.sensors[sensors[k]].name.clone();
            let place = format!("{} - {}", name(a), name(b));
            let exchanged = || Hidden::of_sensor("swapped sensors", place, coldplate_diagnose::Law::Constant, (a, 1.0, b));
            let from = between(random, 0.3, 0.7);
            let made = (a != b).then(|| told(exchanged(), "sensors that are exchanged from a row on"))?;
            Outside { memory: Some(Memory::From(from)), ..made }
        }
        8 if is_log => {
            let place = cooled(machine)?;
            let lag = between(random, 150.0, 900.0);
            let made = plain("coolant inlet offset", place, "water that follows its stated temperature late", Vec::new());
            Outside { memory: Some(Memory::Lag(lag)), ..made }
        }
        _ if is_log => return None,
        _ => {
            let factor = between(random, 0.3, 0.6);
            let line = (format!("contact.{contact}.factor"), format!("{factor:?}"));
            let made = plain("contact conductance", contact, "a contact with hysteresis", vec![line]);
            Outside { memory: Some(Memory::Hysteresis), ..made }
        }
    })
}

/// The circuit that is fed from without, or the node that the coolant holds.
fn cooled(machine: &Machine) -> Option<String> {
    let circuit = machine.circuits.iter().find(|c| c.intake.feeders().is_empty()).map(|c| c.name.clone());
    circuit.or_else(|| {
        let is_cooler = |p: &Place| matches!(p, Place::Node(n) if machine.nodes[*n].name == "cooler");
        machine.contacts.iter().find(|c| c.between.iter().any(is_cooler)).map(|c| c.name.clone())
    })
}
