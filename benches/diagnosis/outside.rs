//! What no kind of the catalogue is: other laws of heats and contacts, a conductivity, what remembers.

use coldplate_base::random::Random;
use coldplate_describe::machine::{Machine, Place};
use coldplate_solve::study::Study;

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
}

/// One of them.
pub fn outside(study: &Study, is_log: bool, random: &mut Random) -> Outside {
    loop {
        if let Some(made) = one(study, is_log, random) {
            return made;
        }
    }
}

fn one(study: &Study, is_log: bool, random: &mut Random) -> Option<Outside> {
    let machine = &study.model.machine;
    let group = choose(random, &groups(machine)).clone();
    let contact = choose(random, &machine.contacts).name.clone();
    let most = machine.variables.iter().find(|v| v.name == "motor_speed")?.range?.1 * 60.0 / std::f64::consts::TAU;
    let plain = |kind: &str, place: String, words: String, lines: Vec<(String, String)>| Outside {
        hidden: Hidden { outside: Some(words), ..Hidden::new(kind, place, 0.0, lines) },
        memory: None,
    };
    Some(match random.below(8) {
        0 | 1 => {
            let exponent = if random.unit() < 0.5 { 0.6 } else { 1.5 };
            let watts = between(random, 3.0, 30.0);
            let value = format!("{{ in = \"{group}\", power = \"{watts:?} * (motor_speed_rpm / {most:?})^{exponent}\" }}");
            plain("heat source", group, format!("heat with the power {exponent} of the speed"), vec![("source.hidden".into(), value)])
        }
        2 => {
            let more = between(random, 0.5, 4.0);
            let line = (format!("contact.{contact}.factor"), format!("\"1 / (1 + {more:?} * motor_speed_rpm / {most:?})\""));
            plain("contact conductance", contact, "a contact that opens with the heat".into(), vec![line])
        }
        3 => {
            let (warmer, area) = (between(random, 8.0, 20.0), between(random, 0.01, 0.05));
            let to = format!("emissivity = 0.9, surroundings_temperature = \"ambient_temperature_degC + {warmer:?}\"");
            let value = match machine.parts.iter().any(|part| part.name == group) {
                true => format!("{{ faces = [\"{group}.+z\"], {to} }}"),
                false => format!("{{ node = \"{group}\", area = \"{area:?} m2\", {to} }}"),
            };
            plain("radiation to the surroundings", group, "a second, warmer enclosure".into(), vec![("boundary.hidden".into(), value)])
        }
        4 => {
            let material = machine.materials.get(random.below(machine.materials.len().max(1)))?;
            let p = study.parameter(&format!("material.{}.conductivity", material.name)).ok()?;
            let lines = p.to_set(p.value * [0.15, 0.3, 3.0][random.below(3)], machine).ok()?.into_iter().collect();
            plain("thermal conductivity", material.name.clone(), "another conductivity of a material".into(), lines)
        }
        5 => {
            let watts = between(random, 5.0, 30.0);
            let value = format!("{{ in = \"{group}\", power = \"{watts:?} * sin(1.7 * ambient_temperature_degC)\" }}");
            plain("heat source", group, "heat that swings with the room".into(), vec![("source.hidden".into(), value)])
        }
        6 if !is_log => {
            let factor = between(random, 0.3, 0.6);
            let line = (format!("contact.{contact}.factor"), format!("{factor:?}"));
            let made = plain("contact conductance", contact, "a contact with hysteresis".into(), vec![line]);
            Outside { memory: Some(Memory::Hysteresis), ..made }
        }
        7 if is_log => {
            let place = cooled(machine)?;
            let lag = between(random, 150.0, 900.0);
            let made = plain("coolant inlet offset", place, "water that follows its stated temperature late".into(), Vec::new());
            Outside { memory: Some(Memory::Lag(lag)), ..made }
        }
        _ => return None,
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
