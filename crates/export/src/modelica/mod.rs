//! A Modelica package: a function, and a block around it.

use std::fmt::Write as _;

use coldplate_runtime::{Kernel, LimitKind, Transform};

use crate::File;
use crate::content::Content;
use crate::flat::{self, Entries, Table, Tables};
use crate::template::{Filling, wrapped};

/// The package.
const SOURCE: &str = include_str!("surrogate.mo");

pub(crate) fn write(content: &Content, name: &str) -> Vec<File> {
    let mut filling = Filling::of(content);
    filling.block("head", head(content, name));
    filling.block("constants", constants(content));
    filling.block("scalings", scalings(content));
    filling.block("polynomials", polynomials(content));
    filling.block("bases", bases(content));
    filling.block("limits", limits(content));
    filling.block("interface", interface(content));
    filling
        .block("block", format!("{}    output Boolean inside \"Whether every variable lies in its fitted range\";\n", interface(content)));
    filling.block("equations", equations(content));
    filling.block("outputs", outputs(content));
    filling.block("tail", format!("end {name};\n"));
    vec![File::new(format!("{name}.mo"), filling.fill(SOURCE, name).into_bytes())]
}

fn head(content: &Content, name: &str) -> String {
    let mut about = format!("A surrogate of {} points over {} variables", content.points.len(), content.variables.len());
    for held in &content.held {
        let _ = write!(about, "; for {} = {:?} {} alone", held.name, held.value, held.unit);
    }
    format!("package {name} {}\n", quoted(&about))
}

/// Inputs and outputs, of the function and of the block.
fn interface(content: &Content) -> String {
    let mut text = String::from("    input Real x[variables] \"A value per variable, in its unit\";\n");
    text.push_str("    output Real values[points] \"A value per point, in its unit\";\n");
    text.push_str("    output Real bands[points] \"Half width of the interval that holds each value with a probability of 95 %\";\n");
    if !content.limits.is_empty() {
        text.push_str("    output Real margins[limits] \"What is left to each limit, negative where it is broken\";\n");
    }
    text
}

/// Adds row `i` of a table that begins at `start`, times the product, to the values of the points of the table.
fn sums(points: &[usize], table: &str, start: usize) -> String {
    let columns = points.len();
    let line = |(column, point): (usize, &usize)| {
        let place = point + 1;
        format!("      values[{place}] := values[{place}] + product * {table}[{} + (i - 1) * {columns}];\n", start + column + 1)
    };
    points.iter().enumerate().map(line).collect()
}

/// u = (g - low) * factor + offset. A variable without reciprocal or logarithm, outside its range, enters at its low
/// end.
fn scalings(content: &Content) -> String {
    let mut text = String::new();
    for (place, own) in content.scalings.iter().enumerate() {
        let (x, place) = (format!("x[{}]", own.variable + 1), place + 1);
        let g = match own.transform {
            Transform::Identity => x,
            Transform::Reciprocal => format!("(if abs({x}) > 0.0 then 1.0 / {x} else scaling_low[{place}])"),
            Transform::Log => format!("(if {x} > 0.0 then log({x}) else scaling_low[{place}])"),
        };
        let _ = writeln!(text, "    scaled[{place}] := ({g} - scaling_low[{place}]) * scaling_factor[{place}] + scaling_offset[{place}];");
    }
    text
}

/// A loop for each polynomial, with bounds of its own: compilers do not support bounds that depend on another loop.
fn polynomials(content: &Content) -> String {
    let (mut text, variables) = (String::new(), content.variables.len());
    let (mut terms, mut coefficients) = (0, 0);
    for (m, own) in content.polynomials.iter().enumerate() {
        let scalings = m * variables;
        let _ = write!(
            text,
            "    for i in 1:{} loop
      product := 1.0;
      for v in 1:variables loop
        place := polynomial_scalings[{scalings} + v] * 13 + exponents[({terms} + i - 1) * variables + v] + 1;
        product := product * powers[place];
      end for;
{}    end for;
",
            own.terms,
            sums(&own.points, "coefficients", coefficients)
        );
        (terms, coefficients) = (terms + own.terms, coefficients + own.coefficients.len());
    }
    text
}

/// A loop for each radial basis, with bounds of its own.
fn bases(content: &Content) -> String {
    let (mut text, variables) = (String::new(), content.variables.len());
    let (mut centres, mut weights) = (0, 0);
    for (m, own) in content.bases.iter().enumerate() {
        let scalings = m * variables;
        let kernel = match own.kernel {
            Kernel::ThinPlate => "if square > 2.3e-308 then 0.5 * square * log(square) else 0.0",
            Kernel::Cubic => "square * sqrt(square)",
            Kernel::Multiquadric => "sqrt(1.0 + square)",
            Kernel::Gaussian => "exp(-square)",
        };
        let _ = write!(
            text,
            "    for i in 1:{} loop
      square := 0.0;
      for v in 1:variables loop
        place := {scalings} + v;
        apart := (scaled[basis_scalings[place] + 1] - centres[({centres} + i - 1) * variables + v]) * basis_scales[place];
        square := square + apart * apart;
      end for;
      product := {kernel};
{}    end for;
",
            own.count,
            sums(&own.points, "weights", weights)
        );
        (centres, weights) = (centres + own.count, weights + own.weights.len());
    }
    text
}

fn limits(content: &Content) -> String {
    let mut text = String::new();
    for (place, own) in content.limits.iter().enumerate() {
        let value = |point: &usize| format!("values[{}]", point + 1);
        let limited = match &own.kind {
            LimitKind::Maximum { point } => value(point),
            LimitKind::Rise { point, variable } => format!("{} - x[{}]", value(point), variable + 1),
            LimitKind::Difference { first, second } => format!("{} - {}", value(first), value(second)),
            LimitKind::Spread(points) => {
                let of = points.iter().map(value).collect::<Vec<_>>().join(", ");
                format!("max({{{of}}}) - min({{{of}}})")
            }
        };
        let _ = writeln!(text, "    margins[{}] := {:?} - ({limited});", place + 1, own.maximum);
    }
    text
}

fn equations(content: &Content) -> String {
    let outputs = if content.limits.is_empty() { "values, bands" } else { "values, bands, margins" };
    let inside: Vec<String> = (1..=content.variables.len()).map(|v| format!("x[{v}] >= low[{v}] and x[{v}] <= high[{v}]")).collect();
    format!("    ({outputs}) = evaluate(x);\n    inside = {};\n", inside.join("\n      and "))
}

/// The outputs of `evaluate` for callers that need its values alone.
fn outputs(content: &Content) -> String {
    let list = if content.limits.is_empty() { "values, bands" } else { "values, bands, margins" };
    let margins = if content.limits.is_empty() { "" } else { "    Real margins[limits];\n" };
    format!(
        "    Real bands[points];\n{margins}  initial equation\n    states = if at_rest then at_rest_in(x) else at_temperature(initial_temperature);\n  equation\n    ({list}) = evaluate(x);\n"
    )
}

fn constants(content: &Content) -> String {
    let mut tables = flat::tables(content);
    if let Some(own) = &content.uncertainty {
        let spread = own.spread();
        tables.numbers("missed_variance", spread.missed.into_iter());
        if let Some(known) = &own.known {
            tables.numbers("missed_cross", spread.cross.into_iter());
            tables.numbers("parameter_covariance", spread.covariance.unwrap_or_default().into_iter());
            tables.numbers("parameter_mean", known.mean.iter().copied().take(own.parameters));
            tables.numbers("missed_mean", own.missed_means(known).into_iter());
        }
    }
    if let Some(own) = &content.in_time {
        flat::time_tables(own, &mut tables);
    }
    let mut text = lists(content);
    write_tables(&tables, &mut text);
    text
}

/// Names and units, in the order of inputs and outputs.
fn lists(content: &Content) -> String {
    let mut text = String::new();
    let mut list = |name: &str, what: &str, entries: Vec<String>| {
        let entries: Vec<String> = entries.iter().map(|entry| quoted(entry)).collect();
        if !entries.is_empty() {
            let _ = write!(text, "  constant String {name}[{}] = {{\n{}  }} \"{what}\";\n", entries.len(), wrapped(&entries, "   "));
        }
    };
    list("variable_names", "Of x", content.variables.iter().map(|v| v.name.clone()).collect());
    list("variable_units", "Of x", content.variables.iter().map(|v| v.unit.clone()).collect());
    list("point_names", "Of values and bands", content.points.iter().map(|p| p.name.clone()).collect());
    list("point_units", "Of values and bands", content.points.iter().map(|p| p.unit.clone()).collect());
    list("limit_names", "Of margins", content.limits.iter().map(|l| l.name.clone()).collect());
    text
}

/// Tables whose entries count from 0; the function adds one. An empty table gets one zero that is not read.
fn write_tables(tables: &Tables, text: &mut String) {
    for Table { name, entries } in &tables.0 {
        let (kind, mut entries) = match entries {
            Entries::Count(count) => {
                let _ = writeln!(text, "  constant Integer {name} = {count};");
                continue;
            }
            Entries::Number(value) => {
                let _ = writeln!(text, "  constant Real {name} = {value:?};");
                continue;
            }
            Entries::Places(places) => ("Integer", places.iter().map(usize::to_string).collect::<Vec<_>>()),
            Entries::Numbers(numbers) => ("Real", numbers.iter().map(|value| format!("{value:?}")).collect()),
        };
        if entries.is_empty() {
            entries.push("0".into());
        }
        let _ = write!(text, "  constant {kind} {name}[{}] = {{\n{}  }};\n", entries.len(), wrapped(&entries, "   "));
    }
}

/// A string of Modelica.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_name_ends_no_string() {
        assert_eq!(super::quoted(r#"a "b" \ c"#), r#""a \"b\" \\ c""#);
    }
}
