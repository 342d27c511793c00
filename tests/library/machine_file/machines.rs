//! Whole machine files: what is read, what is refused, and that nothing panics.

use std::f64::consts::PI;

use coldplate_base::error::Kind;
use coldplate_describe::machine::{
    BlockShape, BoundaryLaw, Condition, Conductance, ContactLaw, FilmSource, Layout, LimitKind, Machine, OfPressure, Place, Property,
    SensorReading, Side, Total,
};

const FULL: &str = include_str!("full.toml");

fn full() -> Machine {
    FULL.parse().unwrap()
}

fn with(key: &str, value: &str) -> coldplate_base::error::Result<Machine> {
    Machine::from_text(FULL, "full.toml", &[(key.to_string(), value.to_string())])
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * b.abs().max(1e-3)
}

#[test]
fn every_table_is_read_into_si() {
    let m = full();
    assert_eq!(m.default_cells, 5000);
    assert_eq!(m.variables.iter().map(|v| v.name.as_str()).collect::<Vec<_>>()[4..], ["lamp", "shade", "duty"]);
    assert!(close(m.variables[0].default.unwrap(), 1.57e-4) && close(m.variables[2].range.unwrap().1, 2500.0 * PI / 30.0));
    assert_eq!(m.chamber.enclosure, Some((0.2, 40.0)));
    assert_eq!((m.chamber.pressure, m.chamber.accommodation, m.chamber.gap), (1e-3, 0.9, 0.5));

    let names: Vec<&str> = m.parts.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["motor plate", "motor", "shaft", "sleeve", "bed"]);
    let material = |part: usize| &m.materials[m.parts[part].material];
    assert_eq!(material(0).conductivity[0], Property::Constant(167.0));
    assert_eq!(material(1).conductivity[2], Property::Constant(60.0));
    assert!(close(material(2).conductivity[0].at(313.15), 49.0) && material(2).density == 7854.0);
    assert!(material(2).source.contains("steel") && material(4).name == "cast iron");
    assert_eq!(m.materials.len(), 5);

    // The plate is 1..1.24, 1..1.22, 0..0.02; the motor is centred on it and moved by 5 mm.
    let BlockShape::Box { min, max } = m.parts[1].blocks[0].shape else { panic!("no box") };
    assert!(close(min[0], 1.06) && close(min[1], 1.055) && close(min[2], 0.02) && close(max[2], 0.186), "{min:?} {max:?}");
    let BlockShape::Cylinder { base, outer, turn, inner, .. } = m.parts[2].blocks[0].shape else { panic!("no cylinder") };
    assert!(close(base[0], 1.125) && close(base[1], 1.11) && close(base[2], 0.186) && outer == 0.01 && inner == 0.0);
    assert_eq!(turn, (0.0, 2.0 * PI));
    let BlockShape::Cylinder { turn, .. } = m.parts[3].blocks[0].shape else { panic!("no cylinder") };
    assert!(close(turn.1, PI));
    assert_eq!((m.parts[4].blocks.len(), m.parts[4].blocks[0].cells), (2, [Some(4), None, Some(2)]));
    assert_eq!(m.parts[0].surface.excluded[0].side, Side::Low2);
    assert_eq!((m.parts[0].surface.area, m.parts[1].surface.emissivity, m.parts[4].surface.emissivity), (Some(0.055), 0.0, 0.55));
    assert!(close(m.parts[1].stated_flux_area.unwrap(), 0.04299));

    assert_eq!(m.default_contact, Some(ContactLaw::Conductance(Conductance(500.0))));
    assert_eq!(m.contacts[0].law, ContactLaw::Conductance(Conductance(560.0)));
    assert_eq!(FULL.lines().nth(m.contacts[0].line - 1), Some("[contact.motor]"));
    let ContactLaw::Rough(rough) = &m.contacts[1].law else { panic!("not rough") };
    assert!(close(rough.roughness, 2.26e-6) && rough.gas.unwrap().pressure == 1.0 && rough.emissivity == Some([0.2, 0.3]));
    assert!(matches!(&m.contacts[2].law, ContactLaw::OfPressure(OfPressure { table, pressure }) if table.len() == 2 && *pressure == 4e5));
    assert_eq!((m.contacts[3].between, &m.contacts[3].law), ([Place::Node(0), Place::Part(1)], &ContactLaw::Total(Total(2.0))));

    assert_eq!(
        m.circuits[0].layout,
        Layout::Series(vec![Layout::Channel(0), Layout::Parallel(vec![Layout::Channel(1), Layout::Channel(2)])])
    );
    let plate = &m.channels[0];
    assert_eq!(plate.path.len(), 18);
    // Nine passes 20 mm apart, centred in 0.22 m, 10 mm short of the ends, at half height.
    let corner = |i: usize, p: [f64; 3]| plate.path[i].iter().zip(p).all(|(a, b)| close(*a, b));
    assert!(
        corner(0, [1.01, 1.03, 0.01]) && corner(1, [1.23, 1.03, 0.01]) && corner(2, [1.23, 1.05, 0.01]) && corner(17, [1.23, 1.19, 0.01])
    );
    assert!(
        matches!(plate.film, FilmSource::Correlation { bend_factor, .. } if bend_factor > 1.0 && bend_factor <= 1.4),
        "{:?}",
        plate.film
    );
    assert_eq!((m.channels[1].length, &m.channels[2].film), (Some(0.7), &FilmSource::Given(2251.0)));
    assert!(matches!(m.boundaries[1].law, BoundaryLaw::Flux(_)) && m.boundaries[0].faces[0].block == Some(0));
    assert!(matches!(&m.sensors[2].reads, SensorReading::Point(0, p) if close(p[0], 1.0) && close(p[1], 1.11) && close(p[2], 0.02)));
    assert_eq!((&m.sensors[4].reads, &m.sensors[5].reads), (&SensorReading::Inlet(0), &SensorReading::Outlet(2)));
    assert!(close(m.limits[0].maximum, 318.15) && m.limits[3].kind == LimitKind::Spread(vec![1, 2, 0]));
    assert_eq!(m.measurements[0].readings.len(), 2);
    assert!(close(m.measurements[0].condition[0].1, 3.33e-5) && close(m.measurements[0].others[0].1, 314.95));
    let assumed: Vec<&str> = m.assumptions.iter().map(|a| a.key.as_str()).collect();
    assert_eq!(assumed, ["drive.y.bearing_load", "material.winding"]);
}

#[test]
fn the_example_of_the_reference_is_a_machine() {
    let reference = include_str!("../../../docs/reference/machine-file.md");
    let example = reference.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let m: Machine = example.parse().unwrap();
    assert_eq!((m.parts.len(), m.channels.len(), m.sensors.len(), m.assumptions.len()), (2, 1, 3, 1));
    let library = include_str!("../../../crates/describe/data/materials.toml");
    for line in library.lines().filter_map(|line| line.strip_prefix("[material.")) {
        let name = line.trim_end_matches(']').trim_matches('"');
        assert!(reference.contains(&format!("`{name}`")), "{name} is not in the reference");
        with("part.motor.material", name).unwrap();
    }
}

#[test]
fn formulas_see_variables_drives_and_definitions() {
    let m = full();
    let at = |pairs: &[(&str, &str)]| m.values(&m.condition(pairs).unwrap()).unwrap();
    let rated = at(&[]);
    // 3.91 N m at 2500 r/min, motor efficiency 0.9, a quarter of it: 3.91 * 261.799 / 9 / 4.
    assert!((m.sources[0].power.evaluate(&rated).unwrap() - 3.91 * 2500.0 * PI / 30.0 / 9.0 * 0.25).abs() < 1e-9);
    assert!(close(m.supplies(&rated).unwrap()[0].flow, 0.9 * 1.57e-4));
    assert!(close(m.chamber.temperature.evaluate(&rated).unwrap(), 296.65));
    let warm = at(&[("ambient_temperature", "30 degC"), ("duty", "1"), ("lamp", "10 W")]);
    let BoundaryLaw::Film(_, fluid) = &m.boundaries[0].law else { panic!("no film") };
    assert!(close(fluid.evaluate(&warm).unwrap(), 302.15));
    let BoundaryLaw::Flux(flux) = &m.boundaries[1].law else { panic!("no flux") };
    assert!(close(flux.evaluate(&warm).unwrap(), 250.0));
    assert!(close(m.nodes[1].fixed.as_ref().unwrap().evaluate(&warm).unwrap(), 295.15));
}

#[test]
fn tangents_agree_with_differences() {
    let m = full();
    let base = m.condition(&[("motor_speed", "1000 rpm")]).unwrap();
    let values = m.values(&base).unwrap();
    for variable in 0..m.variables.len() {
        let tangent = m.tangent(&base, variable).unwrap();
        let h = 1e-6 * base.si()[variable].abs();
        let moved = |sign: f64| {
            let mut si = base.si().to_vec();
            si[variable] += sign * h;
            m.sources[0].power.evaluate(&m.values(&Condition::from_si(si)).unwrap()).unwrap()
        };
        let exact = m.sources[0].power.derivative(&values, &tangent).unwrap();
        let difference = (moved(1.0) - moved(-1.0)) / (2.0 * h);
        assert!((exact - difference).abs() < 1e-6 * exact.abs().max(1e-3), "{}: {exact} {difference}", m.variables[variable].name);
    }
    assert!(m.tangent(&base, 99).is_err());
}

#[test]
fn conditions_take_defaults_and_refuse_the_rest() {
    let m = full();
    assert!(close(m.condition(&[("coolant_flow", "6 L/min")]).unwrap().si()[0], 1e-4));
    for (name, value, needle) in [
        ("coolant_flo", "6 L/min", "did you mean 'coolant_flow'"),
        ("coolant_flow", "6", "L/min"),
        ("coolant_flow", "-6 L/min", "negative"),
        ("coolant_temperature", "20 L/min", "degC"),
    ] {
        let error = m.condition(&[(name, value)]).unwrap_err().to_string();
        assert!(error.contains(needle), "{error}");
    }
    assert!(m.condition(&[("lamp", "1 W"), ("lamp", "2 W")]).is_err());
    assert!(m.values(&Condition::from_si(vec![1.0])).is_err() && m.values(&Condition::from_si(vec![f64::NAN; 7])).is_err());
    let bare: Machine = FULL.replace("coolant_temperature = \"20 degC\"\n", "").replace("bend_factor = \"auto\"", "").parse().unwrap();
    let error = bare.condition(&[]).unwrap_err().to_string();
    assert!(error.contains("coolant_temperature") && error.contains("[variables.coolant_temperature]"), "{error}");
}

#[test]
fn mistakes_name_their_place_and_a_remedy() {
    let mut wrong = Vec::new();
    // key to set, value, what the message must contain
    for (key, value, needle) in [
        ("part.motor.material", "aluminum 6061", "did you mean 'aluminium 6061'"),
        ("part.motor.box[1]", "-1 m", "larger than zero"),
        ("part.motor.box[1]", "130", "bare number"),
        ("part.motor.on", "motor plate", "face of a part"),
        ("part.motor.on", "motor plate.z", "its sides: -x +x -y +y -z +z"),
        ("part.motor.on", "shaft.+z", "in a circle"),
        ("part.shaft.on", "motor.end", "its sides: -x +x"),
        ("part.motor.on", "bed[3].+z", "no block number 3"),
        ("part.motor.on", "mtor plate.+z", "did you mean 'motor plate'"),
        ("part.motor.at", "['0 m', '0 m', '0 m']", "exclude each other"),
        ("part.bed.at", "['0.9 m', '0.9 m', '-50 mm']", "overlap"),
        ("part.bed.blocks[2].at", "['0 m', '0 m', '0.05 m']", "block 1 of 'bed' and block 2 of 'bed' overlap"),
        ("part.sleeve.cylinder.inner", "9 mm", "'shaft' and 'sleeve' overlap"),
        ("part.sleeve.cylinder.inner", "30 mm", "between zero and the outer"),
        ("part.sleeve.cylinder.turn", "['0 deg', '400 deg']", "at most 360 deg"),
        ("part.motor.elemnt_scale", "2", "did you mean 'element_scale'"),
        ("part.motor plate.surface.excluded", "['-w']", "its sides"),
        ("part.motor plate.surface.effective_emissivity", "1.2", "above 0 and at most at 1"),
        ("part.motor plate.surface.effective_emissivity", "0", "above 0 and at most at 1"),
        ("material.winding.density", "5 g", "kg/m3"),
        ("material.winding.conductivity", "['1 W/(m K)', '2 W/(m K)']", "three conductivities"),
        ("material.winding.conductivity", "-1 W/(m K)", "larger than zero"),
        ("contact.motor.between", "['motor', 'motr plate.+z']", "did you mean 'motor plate'"),
        ("contact.motor.between", "['motor.+x', 'motor.-x']", "same body"),
        ("contact.motor.between", "['motor']", "two places"),
        ("contact.motor.bonded", "true", "exclude each other"),
        ("contact.motor.conductanse", "1 W/(m2 K)", "did you mean 'conductance'"),
        ("contact.coil.area", "1 m2", "true area"),
        ("contact.feet.between", "['bed.-z', 'floor[1]']", "neither blocks nor faces"),
        ("contact.sleeve.pressure", "2 MPa", "outside the table"),
        ("contact.shaft.rough.slop", "0.1", "did you mean 'slope'"),
        ("contacts.default", "glued", "bonded"),
        ("contacts.default.conductance", "-5 W/(m2 K)", "larger than zero"),
        ("channel.left.path[2]", "['0.6 m', '0.1 m', '50 mm']", "leaves the part 'bed'"),
        ("channel.left.path[2]", "['0 m', '0.1 m', '50 mm']", "coincide"),
        ("channel.left.in", "bedd", "did you mean 'bed'"),
        ("channel.left.film", "laminar", "correlation"),
        ("channel.plate.serpentine.passes", "12", "do not fit"),
        ("channel.plate.serpentine.across", "+x", "same axis"),
        ("channel.plate.serpentine.margin", "0.2 m", "no length left"),
        ("circuit.main.layout", "['plate', 'left']", "no circuit feeds the channel 'right'"),
        ("circuit.main.layout", "['plate', ['left', 'right', 'left']]", "fed already"),
        ("circuit.main.layout", "['plate', []]", "empty"),
        ("circuit.main.liquid", "watr", "did you mean 'water'"),
        ("radiation_link.bed.view_factor", "1.5", "view factor"),
        ("radiation_link.bed.emissivity", "[0.2]", "two emissivities"),
        ("source.motor.in", "moter", "did you mean 'motor'"),
        ("source.motor.in", "['motor', 'motor']", "twice"),
        ("source.motor.power", "y_moter_W", "did you mean 'y_motor_W'"),
        ("source.motor.power", "5 degC", "113.7 W"),
        ("source.motor.power", "motor_speed", "not of this kind"),
        ("source.motor.power", "0.1 * motor_speed", "write motor_speed_rpm"),
        ("define.half", "share * 2", "one another"),
        ("define.motor_speed_rpm", "1", "there already"),
        ("drive.y.motor_efficiency", "1.5", "above 0 and at most 1"),
        ("drive.y.leed", "12 mm", "did you mean 'lead'"),
        ("variables.lamp.unit", "Wat", "not known"),
        ("variables.lamp.default", "60 W", "outside the range"),
        ("variables.coolant_flow.range", "['9 L/min', '1 L/min']", "below the second"),
        ("sensor.inlet_side.point", "['0 m', '0.3 m', '0 m']", "outside the part 'motor plate'"),
        ("sensor.coil.node", "coill", "did you mean 'coil'"),
        ("sensor.motor.face", "motor.+z", "exclude each other"),
        ("limit.motor.sensor", "mtor", "did you mean 'motor'"),
        ("limit.motor.maximum", "45 K/W", "degC"),
        ("limit.pair.between", "['motor', 'motor']", "itself"),
        ("measurement.working condition 1.readings.moto", "3 degC", "did you mean 'motor'"),
        ("chamber.wall_area", "-1 m2", "larger than zero"),
        ("chamber.preasure", "1 Pa", "did you mean 'pressure'"),
        ("mesh.cells", "many", "whole number"),
        ("mesh.accuracy", "0 K", "larger than zero"),
        ("mesh.accuracy", "0.1", "unit"),
        ("descripton", "x", "did you mean 'description'"),
        ("node.motor.capacity", "1 J/K", "no 'motor'"),
    ] {
        let error = with(key, value).map(|_| ()).err().unwrap_or_else(|| panic!("{key} = {value} was accepted"));
        let message = error.to_string();
        let placed = error.location().file.is_some() && error.location().key.is_some() && error.remedy().is_some();
        if !(message.contains(needle) && placed && error.kind() == Kind::Input) {
            wrong.push(format!("{key} = {value}, expected {needle}:\n{message}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

#[test]
fn mistakes_in_the_text_name_the_line() {
    for (from, to, needle) in [
        ("conductance = \"560 W/(m2 K)\"", "conductance = \"560 W/K\"", "conductance = \"560 W/K\""),
        ("[part.shaft]", "[parts.shaft]", "[parts.shaft]"),
        ("[node.coil]", "[node.motor]\n[node.coil]", "[node.motor]"),
        ("density = \"5000 kg/m3\"", "", "[material.winding]"),
    ] {
        let text = FULL.replacen(from, to, 1);
        let error = Machine::from_text(&text, "m.toml", &[]).map(|_| ()).unwrap_err();
        let line = error.location().line.unwrap();
        assert_eq!(text.lines().nth(line - 1), Some(needle), "{error}");
    }
    assert!(Machine::read("/nowhere/at all.toml", &[]).is_err());
    assert!("".parse::<Machine>().is_err() && "name = 'x'".parse::<Machine>().is_err());
}

/// A small generator, so that a failure can be repeated (the constants are Knuth's MMIX ones).
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % n.max(1)
    }
}

#[test]
fn mutated_files_never_panic() {
    let mut random = Random(7);
    let pieces = [
        "nan",
        "inf",
        "-1",
        "0",
        "1e308 m",
        "1e-320 m",
        "[]",
        "{}",
        "[[]]",
        "\"\"",
        "true",
        "2020-01-01",
        "\"motor\"",
        "\"motor plate.+z\"",
        "\"[1].+z\"",
        "\"bed[0].+z\"",
        "\"bed[99999999999999999999].+z\"",
        "99999999999999999999",
        "9223372036854775807",
        "\"1e300 rpm\"",
        "\"1 / 0\"",
        "'\u{e9}'",
        "[[[[[[[[1]]]]]]]]",
        "{ formula = \"1\", unit = \"\" }",
        "\"(((((\"",
        "\"0 degC\"",
        "\"-400 degC\"",
        "\"5 m^999\"",
        "\"é.é\"",
        "\".\"",
        "\"[\"",
    ];
    let (mut accepted, mut refused) = (0, 0);
    for _ in 0..3000 {
        let mut text = FULL.to_string();
        for _ in 0..=random.below(3) {
            let lines: Vec<&str> = text.lines().collect();
            let at = random.below(lines.len());
            let mut changed: Vec<String> = lines.iter().map(|line| line.to_string()).collect();
            match random.below(6) {
                0 => drop(changed.remove(at)),
                1 => changed.insert(at, lines[random.below(lines.len())].to_string()),
                2 => changed.swap(at, random.below(lines.len())),
                3 | 4 => {
                    if let Some((key, _)) = lines[at].split_once('=') {
                        changed[at] = format!("{key}= {}", pieces[random.below(pieces.len())]);
                    }
                }
                _ => {
                    let mut chars: Vec<char> = lines[at].chars().collect();
                    let place = random.below(chars.len() + 1);
                    chars.insert(place, ['"', '[', '=', '9', '-', 'e', '.', '\u{0}', '\u{e9}', ' '][random.below(10)]);
                    changed[at] = chars.into_iter().collect();
                }
            }
            text = changed.join("\n");
        }
        match text.parse::<Machine>() {
            Ok(machine) => {
                accepted += 1;
                if let Ok(condition) = machine.condition(&[]) {
                    let _ = machine.values(&condition);
                    let _ = machine.tangent(&condition, random.below(8));
                }
            }
            Err(error) => {
                refused += 1;
                assert!(!error.what().is_empty());
            }
        }
    }
    assert!(accepted > 100 && refused > 500, "{accepted} accepted, {refused} refused");
}

#[test]
fn noise_and_hostile_sets_never_panic() {
    let mut random = Random(11);
    for _ in 0..2000 {
        let bytes: Vec<u8> = (0..random.below(200)).map(|_| random.below(256) as u8).collect();
        let _ = String::from_utf8_lossy(&bytes).parse::<Machine>();
    }
    for deep in
        ["[".repeat(100_000), format!("a = {}", "[".repeat(100_000)), format!("a{} = 1", ".a".repeat(100_000)), "a = {b = ".repeat(5_000)]
    {
        assert!(deep.parse::<Machine>().is_err());
    }
    let keys = [
        "part.motor",
        "part",
        "variables",
        "variables.lamp",
        "define",
        "circuit.main.layout",
        "name",
        "part.bed.blocks",
        "part.bed.blocks[1]",
        "x.y",
        "[1]",
    ];
    let values = ["1", "[]", "{}", "{ a = 1 }", "[[1]]", "true", "text", "1e999", "[['plate']]", "{ unit = '1' }", "\"", "[{}]"];
    for key in keys {
        for value in values {
            let _ = with(key, value);
        }
    }
}

/// Two films on one face are refused; on a lumped node each has its own area, and `check` says so.
#[test]
fn two_boundaries_of_one_kind_on_one_node_are_said() {
    let boundary = |name: &str, law: &str| format!("[boundary.{name}]\nnode = \"body\"\narea = \"10 cm2\"\n{law}\n");
    let film = "film = \"5 W/(m2 K)\"\nfluid_temperature = \"20 degC\"";
    let warnings = |other: &str| {
        let text =
            format!("name = \"node\"\n[node.body]\n{}{}[sensor.body]\nnode = \"body\"\n", boundary("front", film), boundary("back", other));
        let model = coldplate::MeshedMachine::new(text.parse().unwrap(), None).unwrap();
        coldplate_solve::meshed::inventory(&model, None).unwrap().warnings
    };
    assert!(warnings("heat_flux = \"10 W/m2\"").iter().all(|w| !w.contains("boundaries")));
    for other in [film, "free_convection = \"sphere\"\nlength = \"5 cm\"\nfluid_temperature = \"20 degC\""] {
        let found = warnings(other);
        assert!(found.iter().any(|w| w.contains("'front' and 'back'") && w.contains("two films")), "{found:?}");
    }
}
