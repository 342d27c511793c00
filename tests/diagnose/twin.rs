//! Twins: data with a hidden effect, made by other means than the model that is to find it.
//!
//! The truth has another mesh, perturbed films, heats and emissivities, and an effect written as lines of a machine file;
//! readings get noise of every kind in the covariance, and some sensors are lost. What was hidden stays here.

use coldplate::diagnose::random::Normal;
use coldplate::diagnose::{Diagnosis, Openness, Problem, Verdict};
use coldplate::identify;
use coldplate::machine::Condition;
use coldplate::measure::{Data, Row, Uncertainty, VariableUncertainty};
use coldplate::reader::Document;
use coldplate::sensitivity::Study;
use coldplate::simulate::Start;

/// What was hidden.
#[derive(Debug, Clone, PartialEq)]
pub struct Hidden {
    /// Kind, in the words of the catalogue, or `outside`.
    pub kind: String,
    /// Place.
    pub place: String,
    /// Amplitude in the catalogue's unit, where there is one.
    pub amplitude: f64,
    lines: Vec<(String, String)>,
    sensor: Option<(usize, f64, usize)>,
}

/// Families of cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// Nothing is hidden.
    Clean,
    /// One effect.
    One,
    /// Two effects at different places.
    Two,
    /// One effect of a kind that the catalogue does not have.
    Outside,
}

/// A case: what the program sees, and what was hidden.
pub struct Case {
    /// What the program sees.
    pub problem: Problem,
    /// What was hidden.
    pub hidden: Vec<Hidden>,
    /// The effect alone, K, reading by reading.
    pub shift: Vec<f64>,
    /// Name of the machine.
    pub machine: &'static str,
}

/// A motor and a gear on two cold plates in series, a bracket with a bearing that only radiates and conducts.
pub const SMALL: &str = r#"
name = "Small machine"
[variables.coolant_flow]
unit = "L/min"
default = "4 L/min"
range = ["2 L/min", "8 L/min"]
[variables.coolant_temperature]
unit = "degC"
default = "20 degC"
range = ["18 degC", "26 degC"]
[variables.motor_speed]
unit = "rpm"
default = "2500 rpm"
range = ["250 rpm", "2500 rpm"]
[variables.ambient_temperature]
unit = "degC"
default = "23 degC"
range = ["20 degC", "28 degC"]
[chamber]
temperature = "ambient_temperature"
[material.aluminium]
conductivity = "167 W/(m K)"
density = "2700 kg/m3"
specific_heat = "896 J/(kg K)"
[material.steel]
conductivity = "45 W/(m K)"
density = "7800 kg/m3"
specific_heat = "470 J/(kg K)"
[surfaces]
effective_emissivity = 0.5
[part.plate]
material = "aluminium"
box = ["200 mm", "160 mm", "20 mm"]
surface = { effective_emissivity = 0.2 }
[part.motor]
material = "steel"
box = ["120 mm", "120 mm", "140 mm"]
at = ["40 mm", "20 mm", "20 mm"]
surface = { effective_emissivity = 0.55 }
[part.second_plate]
material = "aluminium"
box = ["160 mm", "160 mm", "20 mm"]
at = ["260 mm", "0 mm", "0 mm"]
surface = { effective_emissivity = 0.2 }
[part.gear]
material = "steel"
box = ["100 mm", "100 mm", "110 mm"]
at = ["290 mm", "30 mm", "20 mm"]
surface = { effective_emissivity = 0.5 }
[part.bracket]
material = "steel"
box = ["40 mm", "60 mm", "200 mm"]
at = ["420 mm", "40 mm", "0 mm"]
surface = { effective_emissivity = 0.3 }
[part.bearing]
material = "steel"
box = ["80 mm", "80 mm", "60 mm"]
at = ["420 mm", "40 mm", "200 mm"]
surface = { effective_emissivity = 0.4 }
[contact.motor]
between = ["motor", "plate"]
conductance = "500 W/(m2 K)"
[contact.gear]
between = ["gear", "second_plate"]
conductance = "600 W/(m2 K)"
[contact.foot]
between = ["bracket", "second_plate"]
conductance = "300 W/(m2 K)"
[contact.seat]
between = ["bearing", "bracket"]
conductance = "800 W/(m2 K)"
[source.motor]
in = ["motor"]
power = "0.036 * motor_speed_rpm"
[source.gear]
in = ["gear"]
power = "0.016 * motor_speed_rpm"
[source.bearing]
in = ["bearing"]
power = "0.0016 * motor_speed_rpm"
[channel.first]
in = "plate"
diameter = "8 mm"
serpentine = { passes = 5, along = "+y", across = "+x", pitch = "35 mm" }
bend_factor = 1.0
[channel.second]
in = "second_plate"
diameter = "8 mm"
serpentine = { passes = 5, along = "+y", across = "+x", pitch = "30 mm" }
bend_factor = 1.0
[circuit.water]
layout = ["first", "second"]
[sensor.motor]
part = "motor"
[sensor.gear]
part = "gear"
[sensor.plate]
point = ["20 mm", "80 mm", "10 mm"]
in = "plate"
[sensor."second plate"]
point = ["10 mm", "80 mm", "10 mm"]
in = "second_plate"
[sensor.bearing]
part = "bearing"
[sensor.bracket]
part = "bracket"
[sensor.outlet]
outlet = "second"
"#;

/// Machines of the benchmark: name, cells of the model and least and most cells of the truth.
const MACHINES: [(&str, usize, f64, f64); 3] =
    [("small", 600, 900.0, 1600.0), ("rig", 1500, 2200.0, 3500.0), ("five_axis", 6000, 7500.0, 10000.0)];

fn document(machine: &str) -> Document {
    match machine {
        "small" => Document::parse(SMALL, "small.toml").unwrap(),
        name => Document::read(format!("{}/machines/{name}.toml", env!("CARGO_MANIFEST_DIR"))).unwrap(),
    }
}

fn between(random: &mut Normal, low: f64, high: f64) -> f64 {
    low + (high - low) * random.uniform()
}

fn choose<'a, T>(random: &mut Normal, list: &'a [T]) -> &'a T {
    &list[((random.uniform() * list.len() as f64) as usize).min(list.len() - 1)]
}

/// Makes a case; the same seed makes the same case.
pub fn case(seed: u64, family: Family, machine: Option<usize>) -> Case {
    let mut random = Normal::new(seed.wrapping_mul(7919).wrapping_add(13));
    let which = machine.unwrap_or_else(|| [0, 0, 0, 1, 1, 2][(random.uniform() * 6.0) as usize]);
    let (name, cells, low, high) = MACHINES[which];
    let study = Study::new(document(name), Some(cells)).unwrap();
    // Conditions: 4 to 40, anywhere in the ranges.
    let count = (4.0 * 10f64.powf(random.uniform())).round() as usize;
    let count = if name == "five_axis" { count.min(16) } else { count };
    let variables = &study.model.machine.variables;
    let stated: Vec<Condition> = (0..count)
        .map(|_| {
            let values = variables.iter().map(|v| match v.range {
                Some((low, high)) => between(&mut random, low, high),
                None => v.default.unwrap_or(0.0),
            });
            Condition::from_si(values.collect())
        })
        .collect();
    // Sensors: some are lost.
    let all = study.model.machine.sensors.len();
    let mut sensors: Vec<usize> = (0..all).filter(|_| random.uniform() > 0.12).collect();
    if sensors.len() < 3 {
        sensors = (0..all).collect();
    }
    let noise = between(&mut random, 0.03, 0.1);
    let bias = between(&mut random, 0.03, 0.1);
    let spread = |v: &coldplate::machine::Variable| match v.name.as_str() {
        "coolant_temperature" => VariableUncertainty { absolute: 0.06, relative: 0.0 },
        "coolant_flow" => VariableUncertainty { absolute: 0.0, relative: 0.015 },
        "ambient_temperature" => VariableUncertainty { absolute: 0.15, relative: 0.0 },
        "motor_speed" => VariableUncertainty { absolute: 0.0, relative: 0.001 },
        _ => VariableUncertainty::default(),
    };
    let uncertainty = Uncertainty {
        noise: vec![noise; sensors.len()],
        bias: vec![bias; sensors.len()],
        variables: variables.iter().map(spread).collect(),
        model: 0.0,
        timing: 0.0,
        file: None,
    };
    // The truth: another mesh, other films, heats, emissivities.
    let perturbed = perturbed(&study, &mut random);
    let mut truth = document(name);
    for (key, value) in &perturbed {
        truth.apply_set(key, value).unwrap();
    }
    let truth = Study::new(truth, Some(between(&mut random, low, high) as usize)).unwrap();
    let mut hidden: Vec<Hidden> = Vec::new();
    let wanted = match family {
        Family::Clean => 0,
        Family::One | Family::Outside => 1,
        Family::Two => 2,
    };
    while hidden.len() < wanted {
        let one = if family == Family::Outside { outside(&truth, &mut random) } else { effect(&truth, &sensors, &mut random) };
        if hidden.iter().all(|h| h.place != one.place && h.kind != one.kind) {
            hidden.push(one);
        }
    }
    let lines: Vec<(String, String)> = hidden.iter().flat_map(|h| h.lines.clone()).collect();
    let affected = truth.edited(&lines).unwrap_or_else(|e| panic!("{hidden:?}: {e}"));
    let names: Vec<String> = sensors.iter().map(|s| study.model.machine.sensors[*s].name.clone()).collect();
    let rows = |conditions: &[Condition]| -> Vec<Row> {
        let row = |(i, c): (usize, &Condition)| Row {
            test: format!("test {}", i + 1),
            time: None,
            condition: c.clone(),
            readings: vec![Some(300.0); sensors.len()],
            line: None,
        };
        conditions.iter().enumerate().map(row).collect()
    };
    let real: Vec<Condition> = stated
        .iter()
        .map(|c| {
            let deviations = uncertainty.at(c);
            Condition::from_si(c.si().iter().zip(deviations).map(|(v, d)| v + d * random.draw()).collect())
        })
        .collect();
    let mut data = Data { source: "a twin".into(), sensors: sensors.clone(), names, rows: rows(&real), notes: Vec::new() };
    let clean = identify::values(&truth, &data, Start::Steady).unwrap();
    let mut values = identify::values(&affected, &data, Start::Steady).unwrap_or_else(|e| panic!("{hidden:?}: {e}"));
    for h in &hidden {
        let Some((k, amplitude, other)) = h.sensor else { continue };
        let now = values.clone();
        for (i, value) in
            values.iter_mut().enumerate().filter(|(i, _)| i % sensors.len() == k || (other != k && i % sensors.len() == other))
        {
            let row = i / sensors.len() * sensors.len();
            *value = match h.kind.as_str() {
                "sensor offset" => *value + amplitude,
                "sensor gain" => *value + amplitude * (*value - 293.15),
                _ if i % sensors.len() == k => now[row + other],
                _ => now[row + k],
            };
        }
    }
    let shift = values.iter().zip(&clean).map(|(a, b)| a - b).collect();
    let errors: Vec<f64> = sensors.iter().map(|_| bias * random.draw()).collect();
    for (r, row) in data.rows.iter_mut().enumerate() {
        row.condition = stated[r].clone();
        for k in 0..sensors.len() {
            row.readings[k] = Some(values[r * sensors.len() + k] + errors[k] + noise * random.draw());
        }
    }
    let problem = Problem {
        study,
        data,
        uncertainty,
        uncertain: Vec::new(),
        openness: Openness::default(),
        user: Vec::new(),
        start: Start::Steady,
        seed,
        without: Vec::new(),
    };
    Case { problem, hidden, shift, machine: name }
}

/// Films, heats and emissivities a little off, each by a common factor.
fn perturbed(study: &Study, random: &mut Normal) -> Vec<(String, String)> {
    let mut lines = Vec::new();
    let machine = &study.model.machine;
    let films = 1.0 + 0.05 * random.draw();
    for channel in &machine.channels {
        if let Ok(p) = study.parameter(&format!("channel.{}.film_factor", channel.name)) {
            lines.extend(p.to_set(p.value * films, machine).unwrap());
        }
    }
    let heats = 1.0 + 0.01 * random.draw();
    for source in &machine.sources {
        if let Ok(p) = study.parameter(&format!("source.{}.power", source.name)) {
            lines.extend(p.to_set(p.value * heats, machine).unwrap());
        }
    }
    let emissivities = (1.0 + 0.07 * random.draw()).clamp(0.8, 1.2);
    for part in &machine.parts {
        for key in ["effective_emissivity", "emissivity"] {
            if let Ok(p) = study.parameter(&format!("part.{}.surface.{key}", part.name)) {
                lines.extend(p.to_set((p.value * emissivities).min(1.0), machine).unwrap());
                break;
            }
        }
    }
    lines
}

/// An effect of the kinds that go wrong in such machines, with a magnitude as they have it.
fn effect(study: &Study, sensors: &[usize], random: &mut Normal) -> Hidden {
    let machine = &study.model.machine;
    let network = &study.model.network;
    let factor = |random: &mut Normal, low: f64, high: f64| (low.ln() + (high / low).ln() * random.uniform()).exp();
    let scaled = |key: String, factor: f64| -> Option<Vec<(String, String)>> {
        let p = study.parameter(&key).ok()?;
        Some(p.to_set(p.value * factor, machine).ok()?.into_iter().collect())
    };
    let total: f64 = coldplate::network::Load::at(machine, &machine.condition(&[]).unwrap()).unwrap().powers.iter().sum();
    loop {
        let made: Option<Hidden> = match (random.uniform() * 14.0) as usize {
            0 => {
                let part = choose(random, &machine.parts).name.clone();
                let watts = total * factor(random, 0.01, 0.15) * if random.uniform() < 0.3 { -1.0 } else { 1.0 };
                let law = choose(random, &["1", "motor_speed_rpm / 2500", "(motor_speed_rpm / 2500)^2"]);
                let power = if *law == "1" { format!("{watts:?} W") } else { format!("({watts:?}) * ({law})") };
                let value = format!("{{ in = \"{part}\", power = \"{power}\" }}");
                Some(Hidden {
                    kind: "heat source".into(),
                    place: part,
                    amplitude: watts,
                    lines: vec![("source.hidden".into(), value)],
                    sensor: None,
                })
            }
            1 | 2 => {
                let source = choose(random, &machine.sources).name.clone();
                let f = if random.uniform() < 0.5 { factor(random, 0.4, 0.85) } else { factor(random, 1.15, 3.0) };
                scaled(format!("source.{source}.power"), f).map(|lines| Hidden {
                    kind: "source factor".into(),
                    place: source,
                    amplitude: f - 1.0,
                    lines,
                    sensor: None,
                })
            }
            3 | 4 => {
                let contact = choose(random, &machine.contacts).name.clone();
                let f = if random.uniform() < 0.6 { factor(random, 0.2, 0.8) } else { factor(random, 1.25, 5.0) };
                let key = ["conductance", "total_conductance"]
                    .iter()
                    .map(|l| format!("contact.{contact}.{l}"))
                    .find(|k| study.parameter(k).is_ok());
                key.and_then(|k| scaled(k, f)).map(|lines| Hidden {
                    kind: "contact conductance".into(),
                    place: contact,
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
                    amplitude: f.ln(),
                    lines,
                    sensor: None,
                })
            }
            7 => {
                let circuit = choose(random, &machine.circuits).name.clone();
                let kelvin = between(random, 0.15, 0.6) * if random.uniform() < 0.5 { -1.0 } else { 1.0 };
                let p = study.parameter(&format!("circuit.{circuit}.inlet_temperature")).ok();
                p.and_then(|p| p.to_set(p.value + kelvin, machine).ok().flatten()).map(|set| Hidden {
                    kind: "coolant inlet offset".into(),
                    place: circuit,
                    amplitude: kelvin,
                    lines: vec![set],
                    sensor: None,
                })
            }
            8 => {
                let part = choose(random, &machine.parts).name.clone();
                let f = if random.uniform() < 0.5 { factor(random, 0.3, 0.7) } else { factor(random, 1.3, 1.8) };
                scaled(format!("part.{part}.surface.effective_emissivity"), f).map(|lines| Hidden {
                    kind: "emissivity".into(),
                    place: part,
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
                Some(Hidden { kind: "leak to the surroundings".into(), place: part, amplitude: g, lines, sensor: None })
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
                    amplitude: g,
                    lines: vec![(
                        "contact.hidden_link".into(),
                        format!("{{ between = [\"{a}\", \"{b}\"], conductance = \"{:?} W/(m2 K)\", area = \"0.01 m2\" }}", 100.0 * g),
                    )],
                    sensor: None,
                })
            }
            11 => {
                let kelvin = between(random, 0.4, 2.0) * if random.uniform() < 0.5 { -1.0 } else { 1.0 };
                let p = study.parameter("chamber.temperature").unwrap();
                let set = p.to_set(p.value + kelvin, machine).unwrap();
                set.map(|set| Hidden {
                    kind: "chamber temperature".into(),
                    place: "chamber".into(),
                    amplitude: kelvin,
                    lines: vec![set],
                    sensor: None,
                })
            }
            12 => {
                let k = (random.uniform() * sensors.len() as f64) as usize;
                let place = machine.sensors[sensors[k]].name.clone();
                let (kind, amplitude) = if random.uniform() < 0.6 {
                    ("sensor offset", between(random, 0.25, 1.2) * if random.uniform() < 0.5 { -1.0 } else { 1.0 })
                } else {
                    ("sensor gain", between(random, 0.03, 0.12) * if random.uniform() < 0.5 { -1.0 } else { 1.0 })
                };
                Some(Hidden { kind: kind.into(), place, amplitude, lines: Vec::new(), sensor: Some((k, amplitude, k)) })
            }
            _ => {
                let (i, j) = ((random.uniform() * sensors.len() as f64) as usize, (random.uniform() * sensors.len() as f64) as usize);
                let (i, j) = (i.min(j), i.max(j));
                let name = |k: usize| machine.sensors[sensors[k]].name.clone();
                (i != j).then(|| Hidden {
                    kind: "swapped sensors".into(),
                    place: format!("{} - {}", name(i), name(j)),
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

/// What no kind of the catalogue is: a conductivity, a law it does not have.
fn outside(study: &Study, random: &mut Normal) -> Hidden {
    let machine = &study.model.machine;
    let hidden = |place: String, lines| Hidden { kind: "outside".into(), place, amplitude: 0.0, lines, sensor: None };
    loop {
        match (random.uniform() * 3.0) as usize {
            0 => {
                let material = choose(random, &machine.materials).name.clone();
                let key = format!("material.{material}.conductivity");
                if let Ok(p) = study.parameter(&key) {
                    let f = [0.15, 0.3, 3.0][(random.uniform() * 3.0) as usize];
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

/// How an answer stands beside what was hidden.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Score {
    /// Whether anything was found wrong.
    pub detected: bool,
    /// Whether the first explanation touches the right place.
    pub group: bool,
    /// Whether kind and place of the first explanation are right.
    pub exact: bool,
    /// Whether the set that is not refuted holds the truth.
    pub in_set: bool,
    /// Whether a cause was named with probability 0.9 or more.
    pub confident: bool,
    /// Stated probability of the first explanation's kind and place.
    pub stated: f64,
    /// Whether the 90 % interval holds the true amplitude, where the cause is right.
    pub covered: Option<bool>,
    /// Detectability of the effect.
    pub d: f64,
}

/// Holds an answer beside the truth.
pub fn score(case: &Case, found: &Diagnosis) -> Score {
    let d = found.whitener.apply(&case.shift).iter().map(|v| v * v).sum::<f64>().sqrt();
    let detected = found.verdict != Verdict::Consistent;
    let truth = |e: &coldplate::diagnose::Explanation| {
        e.parts.len() == case.hidden.len()
            && case.hidden.iter().all(|h| e.parts.iter().any(|p| p.hypothesis.kind == h.kind && p.hypothesis.place == h.place))
    };
    let machine = &case.problem.study.model.machine;
    let parts_of = |h: &Hidden| -> Vec<String> {
        let of_contact = machine.contacts.iter().find(|c| h.kind.contains("contact") && c.name == h.place);
        let mut parts: Vec<String> = h.place.split(" - ").map(String::from).collect();
        if let Some(contact) = of_contact {
            for place in &contact.between {
                parts.push(match place {
                    coldplate::machine::Place::Part(p) => machine.parts[*p].name.clone(),
                    coldplate::machine::Place::Face(f) => machine.parts[f.part].name.clone(),
                    coldplate::machine::Place::Node(n) => machine.nodes[*n].name.clone(),
                });
            }
        }
        parts
    };
    let touches = |e: &coldplate::diagnose::Explanation| {
        case.hidden.iter().all(|h| {
            let own = parts_of(h);
            e.parts.iter().any(|p| p.hypothesis.place == h.place || p.hypothesis.parts.iter().any(|q| own.contains(q)))
        })
    };
    let first = found.explanations.first().filter(|_| detected);
    let stated = first.map_or(0.0, |f| {
        let name = |e: &coldplate::diagnose::Explanation| {
            let mut names: Vec<String> = e.parts.iter().map(|p| format!("{}@{}", p.hypothesis.kind, p.hypothesis.place)).collect();
            names.sort();
            names
        };
        found.explanations.iter().filter(|e| name(e) == name(f)).map(|e| e.probability).sum()
    });
    let exact = first.is_some_and(truth);
    let covered = first.filter(|f| exact && f.parts.len() == 1 && case.hidden.len() == 1).map(|f| {
        let (low, high) = f.parts[0].interval();
        (low..=high).contains(&case.hidden[0].amplitude)
    });
    Score {
        detected,
        group: first.is_some_and(touches),
        exact,
        in_set: detected && found.explanations.iter().take(found.set.max(1)).any(truth),
        confident: found.verdict == Verdict::Explained,
        stated,
        covered,
        d,
    }
}
