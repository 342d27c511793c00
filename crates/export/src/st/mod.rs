//! A function block in the structured text of IEC 61131-3, for the controller beside the machine.

use std::fmt::Write as _;

use crate::File;
use crate::content::Content;
use crate::name::comment;
use crate::template::{Filling, wrapped};

const SOURCE: &str = include_str!("surrogate.st");

pub(crate) fn write(content: &Content, name: &str) -> Vec<File> {
    let mut filling = Filling::of(content);
    filling.block("head", head(content, name));
    filling.block("interface", interface(content));
    filling.block("tables", tables(content));
    filling.block("scratch", scratch(content));
    filling.block("condition", array("x", content.variables.len()));
    filling.block("tests", vectors(content));
    // The block itself has the name alone.
    let text = filling.fill(SOURCE, name).replace("FUNCTION_BLOCK surrogate\n", &format!("FUNCTION_BLOCK {name}\n"));
    let text = text.replace("    block : surrogate;\n", &format!("    block : {name};\n"));
    vec![File::new(format!("{name}.st"), text.into_bytes())]
}

fn head(content: &Content, name: &str) -> String {
    let mut text = format!("   {name}: a surrogate of {} points over {} variables.\n", content.points.len(), content.variables.len());
    for held in &content.held {
        let _ = writeln!(text, "   For {} = {:?} {} alone.", comment(&held.name), held.value, comment(&held.unit));
    }
    text
}

/// Inputs and outputs, with what every place of an array is.
fn interface(content: &Content) -> String {
    let mut text = String::from("VAR_INPUT\n");
    for (place, own) in content.variables.iter().enumerate() {
        let (name, unit) = (comment(&own.name), comment(&own.unit));
        let _ = writeln!(text, "    (* x[{place}]: {name}, {:?} to {:?} {unit} *)", own.low, own.high);
    }
    text.push_str(&array("x", content.variables.len()));
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

/// Variables that the block works with.
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
        text += &whole("worst", 8);
        text += &whole("follows", 8).replace("DINT", "BOOL");
    }
    text
}

/// The constants, as arrays for all models together and where each begins in them.
fn tables(content: &Content) -> String {
    let mut tables = Tables::begin();
    for (name, count) in [
        ("variables", content.variables.len()),
        ("points", content.points.len()),
        ("scalings", content.scalings.len()),
        ("polynomials", content.polynomials.len()),
        ("quantities", content.points.len() + content.limits.len()),
    ] {
        tables.count(name, count);
    }
    tables.numbers("low", content.variables.iter().map(|v| v.low));
    tables.numbers("high", content.variables.iter().map(|v| v.high));
    tables.numbers("half_widths", content.points.iter().map(|p| p.half_width));
    tables.places("scaling_variable", content.scalings.iter().map(|s| s.variable));
    tables.places("scaling_transform", content.scalings.iter().map(|s| s.transform as usize));
    tables.numbers("scaling_low", content.scalings.iter().map(|s| s.low));
    tables.numbers("scaling_factor", content.scalings.iter().map(|s| s.factor));
    tables.numbers("scaling_offset", content.scalings.iter().map(|s| s.offset));
    let models = &content.polynomials;
    tables.places("polynomial_terms", models.iter().map(|own| own.terms));
    tables.places("polynomial_columns", models.iter().map(|own| own.points.len()));
    tables.places("polynomial_scalings", models.iter().flat_map(|own| own.scalings.iter().copied()));
    tables.places("polynomial_exponents_at", starts(models.iter().map(|own| own.exponents.len())));
    tables.places("polynomial_points_at", starts(models.iter().map(|own| own.points.len())));
    tables.places("polynomial_coefficients_at", starts(models.iter().map(|own| own.coefficients.len())));
    tables.places("polynomial_points", models.iter().flat_map(|own| own.points.iter().copied()));
    tables.places("exponents", models.iter().flat_map(|own| own.exponents.iter().map(|e| usize::from(*e))));
    tables.numbers("coefficients", models.iter().flat_map(|own| own.coefficients.iter().copied()));
    let models = &content.bases;
    if !models.is_empty() {
        tables.count("bases", models.len());
        tables.places("basis_kernel", models.iter().map(|own| own.kernel as usize));
        tables.places("basis_centres", models.iter().map(|own| own.count));
        tables.places("basis_columns", models.iter().map(|own| own.points.len()));
        tables.places("basis_scalings", models.iter().flat_map(|own| own.scalings.iter().copied()));
        tables.numbers("basis_scales", models.iter().flat_map(|own| own.scales.iter().copied()));
        tables.places("basis_centres_at", starts(models.iter().map(|own| own.centres.len())));
        tables.places("basis_points_at", starts(models.iter().map(|own| own.points.len())));
        tables.places("basis_weights_at", starts(models.iter().map(|own| own.weights.len())));
        tables.places("basis_points", models.iter().flat_map(|own| own.points.iter().copied()));
        tables.numbers("centres", models.iter().flat_map(|own| own.centres.iter().copied()));
        tables.numbers("weights", models.iter().flat_map(|own| own.weights.iter().copied()));
    }
    if !content.limits.is_empty() {
        let points: Vec<Vec<usize>> = content.limits.iter().map(|own| own.kind.points().collect()).collect();
        tables.count("limits", content.limits.len());
        tables.places("limit_kind", content.limits.iter().map(|own| own.code()));
        tables.places("limit_count", points.iter().map(Vec::len));
        tables.places("limit_points_at", starts(points.iter().map(Vec::len)));
        tables.places("limit_points", points.iter().flatten().copied());
        tables.places("limit_variable", content.limits.iter().map(|own| own.kind.variable().unwrap_or(0)));
        tables.numbers("limit_maximum", content.limits.iter().map(|own| own.maximum));
    }
    if let Some(own) = &content.uncertainty {
        let states = own.parameters + content.points.len() + 1;
        tables.count("parameters", own.parameters);
        tables.count("states", states);
        tables.count("slope_terms", own.terms);
        tables.places("slope_scalings", own.scalings.iter().copied());
        tables.places("slope_exponents", own.exponents.iter().map(|e| usize::from(*e)));
        tables.numbers("slope_table", own.slopes.iter().copied());
        tables.numbers("missed_own", own.own.iter().copied());
        tables.numbers("missed_common", own.common.iter().copied());
        tables.numbers("measured_centre", own.centre.iter().copied());
        tables.numbers("measured_halves", own.halves.iter().copied());
        let _ = writeln!(tables.text, "    growth : LREAL := {};", number(own.growth));
        if let Some(known) = &own.known {
            tables.numbers("mean", known.mean.iter().copied());
            tables.numbers("covariance", (0..states).flat_map(|i| (0..states).map(move |j| known.covariance(i, j))));
        }
    }
    tables.end()
}

fn vectors(content: &Content) -> String {
    let mut tables = Tables::begin();
    tables.count("variables", content.variables.len());
    tables.count("points", content.points.len());
    tables.count("tests", content.self_tests.len());
    tables.numbers("conditions", content.self_tests.iter().flat_map(|own| own.condition.iter().copied()));
    tables.numbers("expected_values", content.self_tests.iter().flat_map(|own| own.values.iter().copied()));
    if content.uncertainty.is_some() {
        tables.numbers("expected_deviations", content.self_tests.iter().flat_map(|own| own.deviations.iter().copied()));
    }
    tables.end()
}

/// Where each of some runs begins when they follow each other.
fn starts(lengths: impl Iterator<Item = usize>) -> impl Iterator<Item = usize> {
    lengths.scan(0, |at, length| {
        let start = *at;
        *at += length;
        Some(start)
    })
}

/// A literal of type LREAL: the standard wants a point, also before an exponent.
fn number(value: f64) -> String {
    let text = format!("{value:?}");
    match text.split_once('e') {
        Some((mantissa, exponent)) if mantissa.contains('.') => format!("{mantissa}E{exponent}"),
        Some((mantissa, exponent)) => format!("{mantissa}.0E{exponent}"),
        None => text,
    }
}

/// A part of constants.
struct Tables {
    text: String,
}

impl Tables {
    fn begin() -> Self {
        Self { text: "VAR CONSTANT\n".into() }
    }

    fn end(mut self) -> String {
        self.text.push_str("END_VAR\n");
        self.text
    }

    fn count(&mut self, name: &str, count: usize) {
        let _ = writeln!(self.text, "    {name} : DINT := {count};");
    }

    fn places(&mut self, name: &str, values: impl Iterator<Item = usize>) {
        self.table(name, "DINT", values.map(|value| value.to_string()).collect());
    }

    fn numbers(&mut self, name: &str, values: impl Iterator<Item = f64>) {
        self.table(name, "LREAL", values.map(number).collect());
    }

    /// An array; one without entries gets a zero that nobody reads.
    fn table(&mut self, name: &str, kind: &str, mut entries: Vec<String>) {
        if entries.is_empty() {
            entries.push(if kind == "DINT" { "0".into() } else { number(0.0) });
        }
        let _ = writeln!(self.text, "    {name} : ARRAY [0..{}] OF {kind} := [", entries.len() - 1);
        self.text.push_str(&wrapped(&entries, "       "));
        self.text.push_str("    ];\n");
    }
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn literals_have_a_point() {
        assert_eq!([1e-7, -2.5e300, 0.1, 3.0].map(number), ["1.0E-7", "-2.5E300", "0.1", "3.0"]);
    }
}
