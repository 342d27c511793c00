//! A schema as JSON Schema (draft 2020-12), for completion and checks in editors.

use serde_json::{Map, Value, json};

use super::check::FORMULA;
use super::{Key, KeyTable, Unit, Unstated, ValueForm};
use coldplate_base::units::{self, Dimension};

/// Regular expression of a number in the program's notation, without anchors.
const NUMBER: &str = r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?";

impl KeyTable {
    /// The JSON Schema of a file with this table as the outermost one.
    pub fn to_json_schema(&self) -> Value {
        let mut schema = table(self);
        if let Value::Object(entries) = &mut schema {
            entries.insert("$schema".into(), json!("https://json-schema.org/draft/2020-12/schema"));
            entries.insert("title".into(), json!("coldplate machine file"));
            entries.insert("$defs".into(), json!({ "assumed": assumed() }));
        }
        schema
    }
}

/// Schema of `assumed`: any table may mark its numbers as assumed.
fn assumed() -> Value {
    json!({
        "description": "why numbers here are assumed: for the whole table, or key by key",
        "anyOf": [{ "type": "string", "pattern": r"\S" }, { "type": "object" }],
    })
}

fn object(table: &KeyTable) -> Map<String, Value> {
    let mut properties: Map<String, Value> = table.keys().map(|key| (key.name.to_string(), property(key))).collect();
    properties.insert("assumed".into(), json!({ "$ref": "#/$defs/assumed" }));
    let mut schema = Map::new();
    schema.insert("type".into(), json!("object"));
    schema.insert("description".into(), json!(table.doc));
    schema.insert("properties".into(), Value::Object(properties));
    schema.insert("additionalProperties".into(), json!(false));
    schema
}

fn table(table: &KeyTable) -> Value {
    let mut schema = object(table);
    let required: Vec<&str> = table.keys().filter(|key| key.is_required).map(|key| key.name).collect();
    if !required.is_empty() {
        schema.insert("required".into(), json!(required));
    }
    if !table.one_of.is_empty() {
        let choices: Vec<Value> = table.one_of.iter().map(|name| json!({ "required": [name] })).collect();
        schema.insert("oneOf".into(), json!(choices));
    }
    Value::Object(schema)
}

fn property(key: &Key) -> Value {
    let mut schema = match form(&key.form) {
        Value::Object(schema) => schema,
        other => return other,
    };
    schema.insert("description".into(), json!(description(key)));
    let default = match key.default {
        Unstated::Whole(number) => Some(json!(number)),
        Unstated::Flag(flag) => Some(json!(flag)),
        Unstated::Text(text) => Some(json!(text)),
        Unstated::Si(si) => Some(match key.form.unit().filter(|unit| unit.dimension != Dimension::NUMBER) {
            Some(unit) => json!(quantity_text(si, unit)),
            None => json!(si),
        }),
        Unstated::Nothing | Unstated::Follows(_) => None,
    };
    schema.extend(default.map(|value| ("default".to_string(), value)));
    Value::Object(schema)
}

/// The line about a key, with its default.
fn description(key: &Key) -> String {
    match key.default {
        Unstated::Follows(what) => format!("{} (default: {what})", key.doc),
        _ => key.doc.to_string(),
    }
}

/// A quantity in its unit, with the fewest digits that read back to the same value.
pub(super) fn quantity_text(si: f64, unit: Unit) -> String {
    format!("{} {}", units::express(si, unit.name, unit.dimension).unwrap_or(si), unit.name)
}

fn form(form: &ValueForm) -> Value {
    match form {
        ValueForm::Text => json!({ "type": "string" }),
        ValueForm::Name(what) => json!({ "type": "string", "minLength": 1, "title": format!("name of a {what}") }),
        ValueForm::Flag => json!({ "type": "boolean" }),
        ValueForm::True => json!({ "const": true }),
        ValueForm::Whole(least) => json!({ "type": "integer", "minimum": least }),
        ValueForm::Number => number(),
        ValueForm::Quantity(unit) if unit.dimension == Dimension::NUMBER => {
            json!({ "anyOf": [{ "type": "number" }, { "type": "string", "pattern": format!("^\\s*{NUMBER}") }] })
        }
        ValueForm::Quantity(unit) => quantity(*unit),
        ValueForm::AnyQuantity => json!({ "anyOf": [{ "type": "number" }, { "type": "string", "pattern": format!("^\\s*{NUMBER}") }] }),
        ValueForm::Formula(_) => json!({ "anyOf": [{ "type": "number" }, { "type": "string", "minLength": 1 }, table(&FORMULA)] }),
        ValueForm::Word(words) => json!({ "enum": words }),
        ValueForm::List(inner, count) => {
            let mut schema = json!({ "type": "array", "items": self::form(inner) });
            if let (Value::Object(entries), Some(count)) = (&mut schema, count) {
                entries.insert("minItems".into(), json!(count));
                entries.insert("maxItems".into(), json!(count));
            }
            schema
        }
        ValueForm::Curve(x, y) => json!({
            "type": "array",
            "minItems": 1,
            "items": { "type": "array", "prefixItems": [quantity(*x), quantity(*y)], "minItems": 2, "maxItems": 2 },
        }),
        ValueForm::Nested(what) => {
            json!({ "type": ["string", "array"], "minItems": 1, "title": format!("names of {what}s, in nested lists") })
        }
        ValueForm::Either(forms) => json!({ "anyOf": forms.iter().map(self::form).collect::<Vec<_>>() }),
        ValueForm::Table(inner) => table(inner),
        ValueForm::Tables(inner) => json!({ "type": "array", "items": table(inner), "minItems": 1 }),
        ValueForm::Named(inner) => named(table(inner)),
        ValueForm::Free(inner) => named(self::form(inner)),
    }
}

/// A table whose entries have names of the user's choice.
fn named(entry: Value) -> Value {
    json!({ "type": "object", "properties": { "assumed": { "$ref": "#/$defs/assumed" } }, "additionalProperties": entry })
}

fn number() -> Value {
    json!({ "anyOf": [{ "type": "number" }, { "type": "string", "pattern": format!("^\\s*{NUMBER}\\s*%?\\s*$") }] })
}

/// A number with a unit behind it.
fn quantity(unit: Unit) -> Value {
    json!({
        "type": "string",
        "pattern": format!("^\\s*{NUMBER}\\s*[^\\s0-9.+-].*$"),
        "examples": [format!("1 {}", unit.name)],
        "title": format!("a quantity, for example in {}", unit.name),
    })
}
