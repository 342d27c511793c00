//! Files of reduced models read by what docs/reference/reduced-format.md says of their bytes, and nothing else.

use std::collections::BTreeMap;

use coldplate_base::progress::Silent;
use coldplate_reduce::{ReduceSettings, ReducedModel, ReducedNetwork, reduce};
use nalgebra::DMatrix;

use super::{settings, study};

/// What stands in a file.
#[derive(Debug)]
enum Value {
    Number(f64),
    Text(String),
    List(Vec<Value>),
    Record(BTreeMap<String, Value>),
    Choice(u64, Option<Box<Value>>),
    Nothing,
}

impl Value {
    fn at(&self, path: &str) -> &Value {
        path.split('.').fold(self, |value, key| match value {
            Value::Record(fields) => fields.get(key).unwrap_or_else(|| panic!("there is no field '{key}'")),
            Value::List(items) => &items[key.parse::<usize>().expect("a place in a list")],
            other => panic!("'{key}' of {other:?}"),
        })
    }

    fn number(&self) -> f64 {
        if let Value::Number(x) = self { *x } else { panic!("{self:?} is no number") }
    }

    fn text(&self) -> &str {
        if let Value::Text(text) = self { text } else { panic!("{self:?} is no text") }
    }

    fn list(&self) -> &[Value] {
        if let Value::List(items) = self { items } else { panic!("{self:?} is no list") }
    }

    fn numbers(&self) -> Vec<f64> {
        self.list().iter().map(Value::number).collect()
    }

    fn matrix(&self) -> DMatrix<f64> {
        let [rows, columns] = ["rows", "columns"].map(|key| self.at(key).number() as usize);
        DMatrix::from_vec(rows, columns, self.at("values").numbers())
    }
}

/// The layout of the page: what each name is made of.
struct Layout(BTreeMap<String, String>);

impl Layout {
    fn of_the_page() -> Self {
        let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/reference/reduced-format.md")).expect("the page");
        let block = page.split("```layout\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a block of the layout");
        let mut rules: Vec<(String, String)> = Vec::new();
        for line in block.lines() {
            match line.split_once('=') {
                Some((name, rule)) => rules.push((name.trim().into(), rule.trim().into())),
                None => rules.last_mut().expect("a rule").1 += &format!(" {}", line.trim()),
            }
        }
        Self(rules.into_iter().collect())
    }

    fn read(&self, what: &str, bytes: &mut &[u8]) -> Value {
        if let Some(inner) = what.strip_prefix('?') {
            return if take(bytes, 1)[0] == 1 { self.read(inner, bytes) } else { Value::Nothing };
        }
        if let Some((inner, count)) = what.rsplit_once('*') {
            return Value::List((0..count.parse().expect("a count")).map(|_| self.read(inner, bytes)).collect());
        }
        if let Some(inner) = what.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            return Value::List((0..whole(bytes)).map(|_| self.read(inner, bytes)).collect());
        }
        match what {
            "f" => Value::Number(f64::from_le_bytes(take(bytes, 8).try_into().expect("eight bytes"))),
            "g" => Value::Number(f64::from(f32::from_le_bytes(take(bytes, 4).try_into().expect("four bytes")))),
            "u" => Value::Number(whole(bytes) as f64),
            "b" => Value::Number(f64::from(take(bytes, 1)[0])),
            "s" => {
                let length = whole(bytes) as usize;
                Value::Text(String::from_utf8(take(bytes, length).to_vec()).expect("UTF-8"))
            }
            name => self.rule(self.0.get(name).unwrap_or_else(|| panic!("the page does not say what '{name}' is")), bytes),
        }
    }

    fn rule(&self, rule: &str, bytes: &mut &[u8]) -> Value {
        if rule.starts_with(|c: char| c.is_ascii_digit()) {
            let number = whole(bytes);
            let choices = rule.split('/').map(str::trim);
            let chosen = choices.map(|c| c.split_once(' ').unwrap_or((c, ""))).find(|(n, _)| *n == number.to_string());
            let (_, inner) = chosen.unwrap_or_else(|| panic!("choice {number} of '{rule}'"));
            return Value::Choice(number, (!inner.is_empty()).then(|| Box::new(self.read(inner, bytes))));
        }
        // A list of one kind of thing has no names.
        if !rule.contains(':') {
            return self.read(rule, bytes);
        }
        let fields = rule.split_whitespace().map(|field| field.split_once(':').expect("a name and what it is"));
        Value::Record(fields.map(|(name, what)| (name.to_string(), self.read(what, bytes))).collect())
    }
}

fn take<'a>(bytes: &mut &'a [u8], count: usize) -> &'a [u8] {
    let (taken, rest) = bytes.split_at_checked(count).expect("the file goes on");
    *bytes = rest;
    taken
}

fn whole(bytes: &mut &[u8]) -> u64 {
    let mut number = 0;
    for shift in (0..).step_by(7) {
        let byte = take(bytes, 1)[0];
        number |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            break;
        }
    }
    number
}

fn is_that(level: &ReducedNetwork, found: &Value) {
    let pairs = [
        ("conduction", &level.conduction),
        ("capacity", &level.capacity),
        ("stored", &level.stored),
        ("held", &level.held),
        ("sources", &level.sources),
        ("rows", &level.rows),
        ("patterns", &level.patterns),
        ("walls", &level.walls),
        ("readings", &level.readings),
        ("ends.0", &level.ends[0]),
        ("ends.1", &level.ends[1]),
    ];
    for (name, own) in pairs {
        assert_eq!(found.at(name).matrix(), *own, "{name}");
    }
    assert_eq!(found.at("center.values").numbers(), level.center.as_slice());
    assert_eq!((found.at("base").numbers(), found.at("center_held").numbers()), (level.base.clone(), level.center_held.clone()));
    let network = &level.network;
    assert_eq!(found.at("network.nodes").number() as usize, network.nodes);
    let names: Vec<&str> = found.at("network.sensor_names").list().iter().map(Value::text).collect();
    assert_eq!(names, network.sensor_names);
    let faces = found.at("network.surfaces").list();
    assert_eq!(faces.len(), network.surfaces.len());
    for (face, own) in faces.iter().zip(&network.surfaces) {
        let read = ["length", "area", "emissive", "gas_area"].map(|key| face.at(key).number());
        assert_eq!(read, [own.length, own.area, own.emissive, own.gas_area]);
    }
    let streams = found.at("network.streams").list();
    assert_eq!(streams.len(), network.streams.len());
    for (stream, own) in streams.iter().zip(&network.streams) {
        let lengths: Vec<f64> = stream.at("stations").list().iter().map(|station| station.at("length").number()).collect();
        assert_eq!(lengths, own.stations.iter().map(|s| s.length).collect::<Vec<_>>());
    }
    for (joint, own) in found.at("network.joints").list().iter().zip(&network.joints) {
        assert_eq!((joint.at("a").number(), joint.at("area").number()), (f64::from(own.a), own.area));
    }
}

/// A machine with parameters, histories and its field, and one with enclosures, contacts and sources that follow the temperature.
#[test]
fn the_page_says_what_every_byte_is() {
    let layout = Layout::of_the_page();
    for (machine, with_everything) in [("rig", true), ("enclosure", false), ("five_axis", false)] {
        let study = study(machine, 600);
        let own = settings(&study, with_everything);
        let settings = ReduceSettings { most: 40, with_field: with_everything, histories: usize::from(with_everything), ..own };
        let model = reduce(&study, &settings, &Silent).expect("a reduced model");
        let file = model.to_bytes(study.document()).expect("bytes");
        let mut bytes = file.as_slice();
        assert_eq!(take(&mut bytes, 20), b"COLDPLATE-REDUCED 7\n");
        take(&mut bytes, 32);
        let found = layout.read("model", &mut bytes);
        assert!(bytes.is_empty(), "{machine}: the page says nothing of the last {} bytes", bytes.len());
        is_that(&model.coarse, found.at("coarse"));
        is_that(&model.fine, found.at("fine"));
        assert_eq!([found.at("margin").number(), found.at("floor").number()], [model.margin, model.floor]);
        assert_eq!(found.at("hash").text(), study.model.machine.hash);
        assert_eq!(found.at("made.solved").number() as usize, model.made.solved);
        let names: Vec<&str> = found.at("parameters").list().iter().map(|p| p.at("name").text()).collect();
        assert_eq!(names, model.parameters.iter().map(|p| p.name.as_str()).collect::<Vec<_>>());
        for parameter in found.at("parameters").list() {
            let Value::Choice(way, Some(_)) = parameter.at("acts.0.way") else { panic!("{parameter:?}") };
            assert!(*way < 3);
        }
        assert_eq!(matches!(found.at("in_time"), Value::Record(_)), with_everything);
        let Some(field) = &model.field else {
            assert!(matches!(found.at("field"), Value::Nothing));
            continue;
        };
        assert_eq!(found.at("field.center").numbers(), field.center);
        let mode = field.modes.len() - 1;
        let stored: Vec<f64> = field.modes[mode].iter().map(|x| f64::from(*x)).collect();
        assert_eq!(found.at(&format!("field.modes.{mode}")).numbers(), stored);
        assert!(ReducedModel::from_bytes(&file).is_ok());
    }
}
