//! The numbers of all models as flat tables, for languages without records or pointers. All places count from 0.

use crate::content::{Content, InTime};

/// A named constant.
pub(crate) struct Table {
    pub(crate) name: &'static str,
    pub(crate) entries: Entries,
}

pub(crate) enum Entries {
    Count(usize),
    Number(f64),
    /// Indices and small counts; an empty list if there is nothing to list.
    Places(Vec<usize>),
    Numbers(Vec<f64>),
}

/// Tables in the order in which they are added.
#[derive(Default)]
pub(crate) struct Tables(pub(crate) Vec<Table>);

impl Tables {
    pub(crate) fn count(&mut self, name: &'static str, count: usize) {
        self.0.push(Table { name, entries: Entries::Count(count) });
    }

    pub(crate) fn number(&mut self, name: &'static str, value: f64) {
        self.0.push(Table { name, entries: Entries::Number(value) });
    }

    pub(crate) fn places(&mut self, name: &'static str, values: impl Iterator<Item = usize>) {
        self.0.push(Table { name, entries: Entries::Places(values.collect()) });
    }

    pub(crate) fn numbers(&mut self, name: &'static str, values: impl Iterator<Item = f64>) {
        self.0.push(Table { name, entries: Entries::Numbers(values.collect()) });
    }
}

/// Tables of the machine over time, in the order of the file: rates term by term and column by column, outputs point by
/// point and term by term.
pub(crate) fn time_tables(own: &InTime, tables: &mut Tables) {
    for (name, count) in [("states_count", own.states), ("steady_terms", own.steady.count), ("moving_terms", own.moving.count)] {
        tables.count(name, count);
    }
    tables.places("steady_scalings", own.steady.scalings.iter().copied());
    tables.places("steady_exponents", own.steady.exponents.iter().map(|e| usize::from(*e)));
    tables.places("moving_scalings", own.moving.scalings.iter().copied());
    tables.places("moving_exponents", own.moving.exponents.iter().map(|e| usize::from(*e)));
    tables.numbers("reach", own.reach.iter().copied());
    tables.numbers("uniform", own.uniform.iter().copied());
    tables.numbers("steady_coefficients", own.steady_coefficients.iter().copied());
    tables.numbers("rate_table", own.rates.iter().copied());
    tables.numbers("outputs", own.outputs.iter().copied());
}

/// u = (g - low) factor + offset, with g = x (0), 1/x (1) or ln x (2).
pub(crate) fn scalings(content: &Content, tables: &mut Tables) {
    tables.count("scalings", content.scalings.len());
    tables.places("scaling_variable", content.scalings.iter().map(|s| s.variable));
    tables.places("scaling_transform", content.scalings.iter().map(|s| s.transform as usize));
    tables.numbers("scaling_low", content.scalings.iter().map(|s| s.low));
    tables.numbers("scaling_factor", content.scalings.iter().map(|s| s.factor));
    tables.numbers("scaling_offset", content.scalings.iter().map(|s| s.offset));
}

/// The constants, as arrays for all models together, with the place at which each model begins.
pub(crate) fn tables(content: &Content) -> Tables {
    let mut tables = Tables::default();
    for (name, count) in [
        ("variables", content.variables.len()),
        ("points", content.points.len()),
        ("polynomials", content.polynomials.len()),
        ("quantities", content.points.len() + content.limits.len()),
    ] {
        tables.count(name, count);
    }
    tables.numbers("low", content.variables.iter().map(|v| v.low));
    tables.numbers("high", content.variables.iter().map(|v| v.high));
    tables.numbers("half_widths", content.points.iter().map(|p| p.half_width));
    scalings(content, &mut tables);
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
        tables.count("parameters", own.parameters);
        tables.count("slope_terms", own.terms);
        tables.places("slope_scalings", own.scalings.iter().copied());
        tables.places("slope_exponents", own.exponents.iter().map(|e| usize::from(*e)));
        tables.numbers("slope_table", own.slopes.iter().copied());
        tables.numbers("missed_own", own.own.iter().copied());
        tables.numbers("missed_common", own.common.iter().copied());
        tables.numbers("measured_centre", own.centre.iter().copied());
        tables.numbers("measured_halves", own.halves.iter().copied());
        tables.number("growth", own.growth);
    }
    tables
}

/// Start of each of several runs that follow each other.
fn starts(lengths: impl Iterator<Item = usize>) -> impl Iterator<Item = usize> {
    lengths.scan(0, |at, length| {
        let start = *at;
        *at += length;
        Some(start)
    })
}
