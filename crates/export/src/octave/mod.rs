//! A function file for Octave and MATLAB, and a second one for the machine over time.

use std::fmt::Write as _;

use crate::File;
use crate::content::{Content, InTime};
use crate::template::Filling;

/// The function file of a surrogate.
const SOURCE: &str = include_str!("surrogate.m");
/// The function file of the machine over time.
const IN_TIME: &str = include_str!("in_time.m");

pub(crate) fn write(content: &Content, name: &str) -> Vec<File> {
    let mut filling = Filling::of(content);
    filling.block("signature", format!("function [values, bands, limits, verdict] = {name}(x, confidence)\n"));
    filling.block("help", help(content, name));
    filling.block("numbers", indented(&numbers(content)));
    let mut files = vec![File::new(format!("{name}.m"), filling.fill(SOURCE, name).into_bytes())];
    files.extend(content.in_time.as_ref().map(|own| in_time(content, own, name)));
    files
}

/// The second function file: a file has only one function visible from outside.
fn in_time(content: &Content, own: &InTime, name: &str) -> File {
    let mut filling = Filling::of(content);
    filling.block("signature", format!("function [first, values] = {name}_in_time(what, varargin)\n"));
    filling.block("help", help_line(name, content));
    filling.block("errors", errors(content, own));
    filling.block("evaluate", format!("    values = {name}(x);\n"));
    filling.block("numbers", indented(&time_numbers(content, own)));
    File::new(format!("{name}_in_time.m"), filling.fill(IN_TIME, name).into_bytes())
}

fn help_line(name: &str, content: &Content) -> String {
    format!("% {}_IN_TIME  {} points over time, between conditions of {name}\n", name.to_uppercase(), content.points.len())
}

fn errors(content: &Content, own: &InTime) -> String {
    let mut text = String::from("%\n% Beyond the bands of the steady state, over time:\n");
    for (point, error) in content.points.iter().zip(&own.errors) {
        let _ = writeln!(text, "%   {}: {error:.2} {}", point.name, point.unit);
    }
    text
}

fn time_numbers(content: &Content, own: &InTime) -> String {
    let (count, states) = (content.variables.len(), own.states);
    let mut text = String::from("s = struct();\n");
    let mut set = |what: &str, value: String| {
        let _ = writeln!(text, "s.{what} = {value};");
    };
    set("variables", count.to_string());
    set("scalings", scalings(content));
    for (what, terms) in [("steady", &own.steady), ("moving", &own.moving)] {
        set(&format!("{what}_scalings"), places(&terms.scalings));
        set(&format!("{what}_exponents"), matrix(terms.exponents.iter().map(|e| f64::from(*e)), count));
    }
    set("reach", matrix(own.reach.iter().copied(), 1));
    set("at_zero", matrix(own.uniform.iter().copied().take(states), 1));
    set("per_unit", matrix(own.uniform.iter().copied().skip(states), 1));
    set("steady_coefficients", matrix(own.steady_coefficients.iter().copied(), states));
    // Rows: terms. The rates of a term follow column by column in its row.
    set("rates", matrix(own.rates.iter().copied(), states * states));
    let per_point = own.moving.count * states;
    for point in 0..content.points.len() {
        let table = own.outputs.iter().skip(point * per_point).take(per_point).copied();
        set(&format!("outputs{{{}}}", point + 1), matrix(table, states));
    }
    text
}

fn indented(text: &str) -> String {
    text.lines().map(|line| format!("        {line}\n")).collect()
}

/// Low end, factor, offset, and the transform: 0 x, 1 1/x, 2 ln x.
fn scalings(content: &Content) -> String {
    matrix(content.scalings.iter().flat_map(|s| [s.low, s.factor, s.offset, f64::from(s.transform as u8)]), 4)
}

fn help(content: &Content, name: &str) -> String {
    let mut text = format!(
        "% {}  a surrogate of {} points over {} variables\n%\n",
        name.to_uppercase(),
        content.points.len(),
        content.variables.len()
    );
    for (index, v) in content.variables.iter().enumerate() {
        let _ = writeln!(text, "%   x({})  {} [{}], {:?} to {:?}", index + 1, v.name, v.unit, v.low, v.high);
    }
    for held in &content.held {
        let _ = writeln!(text, "%   for {} = {:?} {} alone", held.name, held.value, held.unit);
    }
    for (index, p) in content.points.iter().enumerate() {
        let _ = writeln!(text, "%   values({})  {} [{}]", index + 1, p.name, p.unit);
    }
    for (index, l) in content.limits.iter().enumerate() {
        let _ = writeln!(text, "%   limits({}, :)  {}", index + 1, l.name);
    }
    text
}

fn numbers(content: &Content) -> String {
    let count = content.variables.len();
    let mut text = String::from("s = struct();\n");
    let mut set = |what: &str, value: String| {
        let _ = writeln!(text, "s.{what} = {value};");
    };
    set("low", matrix(content.variables.iter().map(|v| v.low), count));
    set("high", matrix(content.variables.iter().map(|v| v.high), count));
    set("half_widths", matrix(content.points.iter().map(|p| p.half_width), 1));
    set("scalings", scalings(content));
    for (index, own) in content.polynomials.iter().enumerate() {
        let at = format!("polynomials{{{}}}", index + 1);
        set(&format!("{at}.scalings"), places(&own.scalings));
        set(&format!("{at}.points"), places(&own.points));
        set(&format!("{at}.exponents"), matrix(own.exponents.iter().map(|e| f64::from(*e)), count));
        set(&format!("{at}.coefficients"), matrix(own.coefficients.iter().copied(), own.points.len()));
    }
    for (index, own) in content.bases.iter().enumerate() {
        let at = format!("bases{{{}}}", index + 1);
        set(&format!("{at}.scalings"), places(&own.scalings));
        set(&format!("{at}.points"), places(&own.points));
        set(&format!("{at}.kernel"), (own.kernel as u8).to_string());
        set(&format!("{at}.scales"), matrix(own.scales.iter().copied(), count));
        set(&format!("{at}.centres"), matrix(own.centres.iter().copied(), count));
        set(&format!("{at}.weights"), matrix(own.weights.iter().copied(), own.points.len()));
    }
    set("limits", "{}".into());
    for (index, own) in content.limits.iter().enumerate() {
        let at = format!("limits{{{}}}", index + 1);
        set(&format!("{at}.kind"), own.code().to_string());
        set(&format!("{at}.points"), places(&own.kind.points().collect::<Vec<_>>()));
        set(&format!("{at}.variable"), own.kind.variable().map_or(0, |v| v + 1).to_string());
        set(&format!("{at}.maximum"), format!("{:?}", own.maximum));
    }
    if let Some(own) = &content.uncertainty {
        set("parameters", own.parameters.to_string());
        set("slope_scalings", places(&own.scalings));
        set("slope_exponents", matrix(own.exponents.iter().map(|e| f64::from(*e)), count));
        let per_point = own.terms * own.parameters;
        for point in 0..content.points.len() {
            let table = own.slopes.iter().skip(point * per_point).take(per_point).copied();
            set(&format!("slopes{{{}}}", point + 1), matrix(table, own.parameters));
        }
        set("missed_own", matrix(own.own.iter().copied(), 1));
        set("missed_common", matrix(own.common.iter().copied(), 1));
        set("growth", format!("{:?}", own.growth));
        set("measured_centre", matrix(own.centre.iter().copied(), count));
        set("measured_halves", matrix(own.halves.iter().copied(), count));
        if let Some(known) = &own.known {
            let states = known.mean.len();
            set("mean", matrix(known.mean.iter().copied(), 1));
            set("covariance", matrix((0..states).flat_map(|i| (0..states).map(move |j| known.covariance(i, j))), states));
        }
    }
    set("test_conditions", matrix(content.self_tests.iter().flat_map(|t| t.condition.iter().copied()), count));
    set("test_values", matrix(content.self_tests.iter().flat_map(|t| t.values.iter().copied()), content.points.len()));
    if content.uncertainty.is_some() {
        set("test_deviations", matrix(content.self_tests.iter().flat_map(|t| t.deviations.iter().copied()), content.points.len()));
    }
    text
}

/// Indices counted from 1.
fn places(places: &[usize]) -> String {
    format!("[{}]", places.iter().map(|place| (place + 1).to_string()).collect::<Vec<_>>().join(" "))
}

/// A matrix with `columns` columns, a few rows to a line.
fn matrix(values: impl Iterator<Item = f64>, columns: usize) -> String {
    let values: Vec<String> = values.map(|value| format!("{value:?}")).collect();
    if values.is_empty() {
        return format!("zeros(0, {columns})");
    }
    let rows: Vec<String> = values.chunks(columns.max(1)).map(|row| row.join(" ")).collect();
    let mut text = String::from("[");
    let mut length = 1;
    for (index, row) in rows.iter().enumerate() {
        if index > 0 {
            text.push_str(if length > 100 { "\n" } else { "; " });
            length = if length > 100 { 0 } else { length + 2 };
        }
        text.push_str(row);
        length += row.len();
    }
    text.push(']');
    text
}
