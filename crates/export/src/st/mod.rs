//! A function block in the structured text of IEC 61131-3, for the controller beside the machine.

use std::fmt::Write as _;

use coldplate_runtime::format::{POLE, WEIGHTS};

use crate::File;
use crate::content::{Content, InTime};
use crate::flat::{self, Entries, Table, Tables};
use crate::name::comment;
use crate::template::{Filling, wrapped};

/// The function block.
const SOURCE: &str = include_str!("surrogate.st");
/// The part of the function block for the machine over time.
const IN_TIME: &str = include_str!("in_time.st");

pub(crate) fn write(content: &Content, name: &str) -> Vec<File> {
    let mut filling = Filling::of(content);
    filling.block("head", head(content, name));
    filling.block("interface", interface(content, name));
    filling.block("tables", tables(content));
    filling.block("scratch", scratch(content));
    filling.block("condition", array(&format!("{name}_condition"), content.variables.len()));
    filling.block("tests", vectors(content));
    let mut text = filling.fill(SOURCE, name);
    if let Some(own) = &content.in_time {
        filling.block("now", array("now", content.points.len()));
        filling.block("time_tables", time_tables(content, own));
        filling.block("states", array("states", own.states));
        filling.block("time_scratch", time_scratch(content, own));
        filling.block("time_tests", time_vectors(content, own));
        text += &filling.fill(IN_TIME, name);
    }
    // The plain name belongs to the block itself.
    let text = text.replace("FUNCTION_BLOCK surrogate\n", &format!("FUNCTION_BLOCK {name}\n"));
    let text = text.replace(" : surrogate;\n", &format!(" : {name};\n"));
    vec![File::new(format!("{name}.st"), text.into_bytes())]
}

fn head(content: &Content, name: &str) -> String {
    let mut text = format!("   {name}: a surrogate of {} points over {} variables.\n", content.points.len(), content.variables.len());
    for held in &content.held {
        let _ = writeln!(text, "   For {} = {:?} {} alone.", comment(&held.name), held.value, comment(&held.unit));
    }
    text
}

/// Inputs and outputs, with a comment on every place of an array.
fn interface(content: &Content, name: &str) -> String {
    let mut text = String::from("VAR_INPUT\n");
    for (place, own) in content.variables.iter().enumerate() {
        let (name, unit) = (comment(&own.name), comment(&own.unit));
        let _ = writeln!(text, "    (* x[{place}]: {name}, {:?} to {:?} {unit} *)", own.low, own.high);
    }
    let _ = writeln!(text, "    x : {name}_condition;");
    text.push_str("    (* Probability with which a verdict is said, between one half and one. *)\n    confidence : LREAL := 0.95;\n");
    text.push_str("END_VAR\nVAR_OUTPUT\n");
    for (place, own) in content.points.iter().enumerate() {
        let _ = writeln!(text, "    (* values[{place}]: {}, {} *)", comment(&own.name), comment(&own.unit));
    }
    text.push_str(&array("values", content.points.len()));
    text.push_str("    (* Half width of the interval that holds each value with a probability of 95 %. *)\n");
    text.push_str(&array("bands", content.points.len()));
    text.push_str("    (* Whether every variable lies in its fitted range. *)\n    inside : BOOL;\n");
    if !content.limits.is_empty() {
        for (place, own) in content.limits.iter().enumerate() {
            let _ = writeln!(text, "    (* Limit {place}: {}, at most {:?} *)", comment(&own.name), own.maximum);
        }
        text.push_str("    (* The limited quantities, what is left to the largest allowed, and the probability that each is kept. *)\n");
        for what in ["limited", "margins", "probabilities"] {
            text.push_str(&array(what, content.limits.len()));
        }
    }
    text.push_str(
        "    (* 0 acceptable, 1 uncertain, 2 not acceptable; the limit that decides, -1 without one; the probability that all\n       limits together are kept, 0 without limits. *)\n    state : DINT;\n    binding : DINT;\n    probability : LREAL;\nEND_VAR\n",
    );
    text
}

fn array(name: &str, length: usize) -> String {
    format!("    {name} : ARRAY [0..{}] OF LREAL;\n", length.max(1) - 1)
}

/// Working variables of the block.
fn scratch(content: &Content) -> String {
    let (points, limits) = (content.points.len(), content.limits.len());
    let whole = |name: &str, length: usize| array(name, length).replace("LREAL", "DINT");
    let mut text = array("scaled", content.scalings.len());
    text += &array("powers", 13 * content.scalings.len());
    text += &array("variances", points + limits);
    text += &whole("ends", 2 * (points + limits));
    if !content.bases.is_empty() {
        text += &array("radial", points);
    }
    if let Some(own) = &content.uncertainty {
        text += &array("slopes", points * own.parameters);
        text += &array("directions", (points + limits) * (own.parameters + points + 1));
    }
    if limits > 0 {
        text += &array("slacks", limits);
        text += &array("slack", 8);
        text += &array("correlation", 64);
        text += &array("both", 64);
        text += &array("bounds", 8);
        text += &array("broken", 8);
        text += &whole("worst", 8);
        text += &whole("beside_first", 8);
        text += &whole("beside_second", 8);
        text += &whole("follows", 8).replace("DINT", "BOOL");
        text += &whole("is_left", 8).replace("DINT", "BOOL");
    }
    text
}

/// The constants.
fn tables(content: &Content) -> String {
    let mut tables = flat::tables(content);
    if let Some(own) = &content.uncertainty {
        let states = own.parameters + content.points.len() + 1;
        tables.count("states", states);
        if let Some(known) = &own.known {
            tables.numbers("mean", known.mean.iter().copied());
            tables.numbers("covariance", (0..states).flat_map(|i| (0..states).map(move |j| known.covariance(i, j))));
        }
    }
    constants(&tables)
}

fn vectors(content: &Content) -> String {
    let mut tables = Tables::default();
    tables.count("variables", content.variables.len());
    tables.count("points", content.points.len());
    tables.count("tests", content.self_tests.len());
    tables.numbers("conditions", content.self_tests.iter().flat_map(|own| own.condition.iter().copied()));
    tables.numbers("expected_values", content.self_tests.iter().flat_map(|own| own.values.iter().copied()));
    if content.uncertainty.is_some() {
        tables.numbers("expected_deviations", content.self_tests.iter().flat_map(|own| own.deviations.iter().copied()));
    }
    constants(&tables)
}

/// The constants of the machine over time. The weights of one, two and three solves match the exponential to third
/// order.
fn time_tables(content: &Content, own: &InTime) -> String {
    let mut tables = Tables::default();
    tables.count("variables", content.variables.len());
    tables.count("points", content.points.len());
    flat::scalings(content, &mut tables);
    flat::time_tables(own, &mut tables);
    tables.number("pole", POLE);
    tables.numbers("weights", WEIGHTS.into_iter());
    constants(&tables)
}

fn time_scratch(content: &Content, own: &InTime) -> String {
    let n = own.states;
    let sizes = [
        ("powers", 13 * content.scalings.len()),
        ("terms", own.moving.count),
        ("steady", n),
        ("away", n),
        ("rates", n * n),
        ("columns", n * n),
        ("inverse", n),
        ("solves", 4 * n),
    ];
    let text: String = sizes.into_iter().map(|(name, length)| array(name, length)).collect();
    text + &array("order", n).replace("LREAL", "DINT")
}

fn time_vectors(content: &Content, own: &InTime) -> String {
    let mut tables = Tables::default();
    tables.count("variables", content.variables.len());
    tables.count("points", content.points.len());
    tables.count("tests", own.tests.len());
    tables.numbers("starts", own.tests.iter().flat_map(|own| own.start.iter().copied()));
    tables.numbers("conditions", own.tests.iter().flat_map(|own| own.condition.iter().copied()));
    tables.numbers("durations", own.tests.iter().map(|own| own.duration));
    tables.numbers("expected_values", own.tests.iter().flat_map(|own| own.values.iter().copied()));
    constants(&tables)
}

/// Size (dimensionless) below which numbers are written as zero: matiec accepts no literal smaller than the range of
/// REAL.
const SMALLEST: f64 = 1e-37;

/// A literal of type LREAL: the standard requires a point, also before an exponent.
fn number(value: f64) -> String {
    let text = format!("{:?}", if value.abs() < SMALLEST { 0.0 } else { value });
    match text.split_once('e') {
        Some((mantissa, exponent)) if mantissa.contains('.') => format!("{mantissa}E{exponent}"),
        Some((mantissa, exponent)) => format!("{mantissa}.0E{exponent}"),
        None => text,
    }
}

/// A block of constants. An array without entries gets one zero that is not read.
fn constants(tables: &Tables) -> String {
    let mut text = String::from("VAR CONSTANT\n");
    for Table { name, entries } in &tables.0 {
        let (kind, mut entries) = match entries {
            Entries::Count(count) => {
                let _ = writeln!(text, "    {name} : DINT := {count};");
                continue;
            }
            Entries::Number(value) => {
                let _ = writeln!(text, "    {name} : LREAL := {};", number(*value));
                continue;
            }
            Entries::Places(places) => ("DINT", places.iter().map(usize::to_string).collect::<Vec<_>>()),
            Entries::Numbers(numbers) => ("LREAL", numbers.iter().map(|value| number(*value)).collect()),
        };
        if entries.is_empty() {
            entries.push(if kind == "DINT" { "0".into() } else { number(0.0) });
        }
        let _ = writeln!(text, "    {name} : ARRAY [0..{}] OF {kind} := [", entries.len() - 1);
        text.push_str(&wrapped(&entries, "       "));
        text.push_str("    ];\n");
    }
    text + "END_VAR\n"
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn literals_have_a_point() {
        assert_eq!([1e-7, -2.5e300, 0.1, 3.0, -1e-40].map(number), ["1.0E-7", "-2.5E300", "0.1", "3.0", "0.0"]);
    }
}
