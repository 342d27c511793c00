//! Figures from surrogates and tables.

use statrs::distribution::{ContinuousCDF, Normal};

use super::charts::limits::worded;
use coldplate_base::error::{Error, Result};
use coldplate_explore::sweep::MACHINE_HASH;
use coldplate_figures::chart::acceptability::{AcceptabilityMap, MarkedCondition};
use coldplate_figures::chart::error_overview::{ErrorOverview, PointErrors};
use coldplate_figures::chart::one_factor::{OneFactorFigure, SampledCurve};
use coldplate_figures::chart::parity::{ParityFigure, ParityPoint};
use coldplate_figures::chart::residuals::ResidualFigure;
use coldplate_figures::chart::style::Quantity;
use coldplate_figures::chart::title_and_footer::fixed_conditions;
use coldplate_surrogate::fit::one_factor::OneFactorFit;
use coldplate_surrogate::verdict::{self, Acceptability, ChanceAnswer, LimitAnswer, Surrogate};
use coldplate_tables::Table;

/// Number of nodes along each side of an acceptability map. Chosen: smooth borders against time.
const MAP_NODES: usize = 81;
/// Most curves in one figure, a count. Chosen: more cannot be told apart.
const MOST_CURVES: usize = 8;

fn quantity(surrogate: &Surrogate<'_>, variable: usize) -> Quantity {
    surrogate.variable(variable).map_or_else(Quantity::default, |v| Quantity::new(v.name, v.unit))
}

/// Variables other than `shown`, with their values in `x`, and variables that were held when the surrogate was made.
fn held(surrogate: &Surrogate<'_>, x: &[f64], shown: &[usize]) -> Vec<(Quantity, f64)> {
    let x = x.iter().take(surrogate.variable_count()).enumerate();
    let fixed = x.filter(|(i, _)| !shown.contains(i)).map(|(i, x)| (quantity(surrogate, i), *x));
    fixed.chain(always(surrogate)).collect()
}

/// The variables that were held when the surrogate was made: a figure is valid for these values only.
pub fn always(surrogate: &Surrogate<'_>) -> Vec<(Quantity, f64)> {
    surrogate.held().map(|held| (Quantity::new(held.name, held.unit), held.value)).collect()
}

/// A line below a figure with the held variables; none if nothing was held.
fn held_note(surrogate: &Surrogate<'_>) -> Vec<String> {
    let held = always(surrogate);
    if held.is_empty() { Vec::new() } else { vec![fixed_conditions(&held)] }
}

/// `n` values from `low` to `high`, evenly spaced.
pub fn steps(low: f64, high: f64, n: usize) -> Vec<f64> {
    (0..n).map(|i| low + (high - low) * i as f64 / (n - 1) as f64).collect()
}

/// Middle of the fitted range of every variable.
pub fn centre(surrogate: &Surrogate<'_>) -> Vec<f64> {
    surrogate.variables().map(|v| f64::midpoint(v.low, v.high)).collect()
}

/// Quantity of a map's contour lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ContourQuantity {
    /// The margin of the binding limit.
    Margin,
    /// The probability that all limits are kept.
    Probability,
}

/// Acceptability over two variables, the others held at `x`.
///
/// # Errors
/// A variable that does not exist, or is given twice; a surrogate without limits; lines of a probability that the surrogate does
/// not have.
pub fn map(
    surrogate: &Surrogate<'_>,
    across: usize,
    up: usize,
    x: &[f64],
    here: Option<MarkedCondition>,
    lines: ContourQuantity,
) -> Result<AcceptabilityMap> {
    if lines == ContourQuantity::Probability && surrogate.uncertainty().is_none() {
        return Err(Error::input("this surrogate states no uncertainty of the machine, so no probability is known")
            .help("draw lines = \"margin\", or sweep and fit anew"));
    }
    let (Some(vx), Some(vy)) = (surrogate.variable(across), surrogate.variable(up)) else {
        return Err(Error::input("a map needs two variables of the surrogate"));
    };
    if across == up {
        return Err(Error::input("a map needs two different variables").read(vx.name));
    }
    if surrogate.limit_count() == 0 {
        return Err(Error::input("this surrogate has no limits, so nothing is acceptable or not")
            .help("give the machine file limits, or name it with --machine when fitting a table"));
    }
    let (x_values, y_values) = (steps(vx.low, vx.high, MAP_NODES), steps(vy.low, vy.high, MAP_NODES));
    let (mut margin, mut half_width, mut state, mut binding) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut probability = Vec::new();
    let mut at = x.to_vec();
    let mut unit = String::from("K");
    for y in &y_values {
        for x in &x_values {
            (at[across], at[up]) = (*x, *y);
            let answer = verdict::query(surrogate, &at)?;
            let limit = answer.binding.and_then(|i| answer.limits.get(i));
            margin.push(limit.map_or(f64::NAN, |l| l.margin));
            half_width.push(limit.map_or(0.0, |l| half_width_of(l, answer.chance.as_ref())));
            binding.push(answer.binding.unwrap_or(usize::MAX));
            if let Some(limit) = limit {
                unit.clone_from(&limit.margin_unit);
            }
            state.push(shown(answer.verdict));
            if lines == ContourQuantity::Probability {
                probability.push(answer.chance.as_ref().map_or(f64::NAN, |chance| chance.probability));
            }
        }
    }
    Ok(AcceptabilityMap {
        title: "Which conditions are acceptable".into(),
        x: quantity(surrogate, across),
        y: quantity(surrogate, up),
        x_values,
        y_values,
        margin,
        margin_unit: unit,
        half_width,
        probability,
        state,
        binding,
        limits: worded(surrogate).into_iter().map(|(name, words)| format!("{name}: {words}")).collect(),
        fixed: held(surrogate, x, &[across, up]),
        here,
        notes: Vec::new(),
    })
}

/// Half width of the band that places the borders of the uncertain area. If the probability of all limits together is known,
/// margin less half width is zero where that probability is the one asked for.
fn half_width_of(limit: &LimitAnswer, chance: Option<&ChanceAnswer>) -> f64 {
    let own = (limit.high - limit.low) / 2.0;
    let deviations = |p: f64| Normal::standard().inverse_cdf(p.clamp(1e-12, 1.0 - 1e-12));
    match chance.filter(|chance| chance.probability.is_finite()) {
        Some(chance) => {
            let apart = deviations(chance.probability).abs().max(1e-6);
            deviations(chance.confidence) * limit.margin.abs() / apart
        }
        None => own,
    }
}

fn shown(state: Acceptability) -> coldplate_figures::chart::acceptability::CellState {
    match state {
        Acceptability::Acceptable => coldplate_figures::chart::acceptability::CellState::Acceptable,
        Acceptability::NotAcceptable => coldplate_figures::chart::acceptability::CellState::NotAcceptable,
        Acceptability::Uncertain => coldplate_figures::chart::acceptability::CellState::Uncertain,
    }
}

/// The surrogate along one variable, the others held at `x`: one figure per `MOST_CURVES` of the given points.
///
/// # Errors
/// A variable that the surrogate does not have.
pub fn slices(surrogate: &Surrogate<'_>, variable: usize, x: &[f64], points: &[usize]) -> Result<Vec<OneFactorFigure>> {
    let Some(v) = surrogate.variable(variable) else {
        return Err(Error::input("no such variable in the surrogate"));
    };
    let along = steps(v.low, v.high, 121);
    let mut curves: Vec<SampledCurve> = (points.iter().filter_map(|p| surrogate.point(*p)))
        .map(|p| SampledCurve { name: p.name.into(), ..SampledCurve::default() })
        .collect();
    let mut at = x.to_vec();
    for value in along {
        at[variable] = value;
        let temperatures = verdict::query(surrogate, &at)?.temperatures;
        for (curve, point) in curves.iter_mut().zip(points) {
            let at = &temperatures[*point];
            curve.line.push((value, at.value));
            curve.half_widths.push((at.high - at.low) / 2.0);
        }
    }
    let unit = surrogate.points().next().map_or("degC", |p| p.unit).to_string();
    let title = format!("Temperatures against {}", quantity(surrogate, variable).name.replace('_', " "));
    let (band_of, band) = match (surrogate.uncertainty(), surrogate.mesh_half_width(0)) {
        (Some(_), Some(_)) => {
            ("machine", "band that holds the machine's temperature with 95 %: fit, mesh, parameters, what the model misses")
        }
        (Some(_), None) => ("machine", "band that holds the machine's temperature with 95 %: fit, parameters, what the model misses"),
        (None, Some(_)) => ("fit and mesh", "band that covers 95 % of new conditions: fit and mesh"),
        (None, None) => ("fit", "band that covers 95 % of new conditions"),
    };
    let notes = vec![format!("Lines: surrogate; shaded, or as bars if they overlap: {band}.")];
    let whole = OneFactorFigure {
        title,
        x: quantity(surrogate, variable),
        y: Quantity::new("temperature", &unit),
        curves,
        band_of: band_of.into(),
        fixed: held(surrogate, x, &[variable]),
        notes,
    };
    Ok(parted(&whole))
}

/// A figure of many curves as several figures of at most `MOST_CURVES`, numbered in their titles.
fn parted(whole: &OneFactorFigure) -> Vec<OneFactorFigure> {
    let count = whole.curves.len().div_ceil(MOST_CURVES).max(1);
    let per_figure = whole.curves.len().div_ceil(count).max(1);
    let parts = whole.curves.chunks(per_figure).enumerate().map(|(i, part)| {
        let title = if count > 1 { format!("{} ({} of {count})", whole.title, i + 1) } else { whole.title.clone() };
        OneFactorFigure { title, curves: part.to_vec(), ..whole.clone() }
    });
    parts.collect()
}

/// The paper's one-variable fits on a one-factor sweep: a polynomial of `degree` in `variable` per output.
///
/// # Errors
/// The variable is not in the table, or takes too few values.
pub fn one_factor(table: &Table, variable: &str, degree: usize, title: &str) -> Result<Vec<OneFactorFigure>> {
    let x = table.column(variable)?;
    let (low, high) =
        x.values.iter().filter(|v| v.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    let outputs = &table.columns[table.inputs..];
    let mut curves = Vec::new();
    for output in outputs {
        let fitted = OneFactorFit::fit(&x.values, &output.values, degree)?;
        curves.push(SampledCurve {
            name: output.name.clone(),
            samples: x.values.iter().copied().zip(output.values.iter().copied()).collect(),
            line: steps(low, high, 121).into_iter().map(|v| (v, fitted.value(v))).collect(),
            half_width: fitted.half_width(0.95),
            half_widths: Vec::new(),
            formula: fitted.honest_formula("y", "x", low, high),
        });
    }
    let fixed: Vec<(Quantity, f64)> = (table.columns[..table.inputs].iter())
        .filter(|c| c.name != x.name)
        .filter_map(|c| c.values.first().map(|v| (Quantity::new(&c.name, &c.unit), *v)))
        .collect();
    let unit = outputs.first().map_or("degC", |c| c.unit.as_str());
    Ok(parted(&OneFactorFigure {
        title: title.into(),
        x: Quantity::new(&x.name, &x.unit),
        y: Quantity::new("temperature", unit),
        curves,
        band_of: "fit".into(),
        fixed,
        notes: vec![format!("Markers: simulated; lines: polynomial of degree {degree}; shaded: its 95 % prediction band.")],
    }))
}

/// Conditions of a table with the found and the predicted values.
#[derive(Debug, Clone, Default)]
pub struct TableComparison {
    /// Conditions, one row of one value per variable each.
    pub conditions: Vec<Vec<f64>>,
    /// Whether the fit has not seen the condition.
    pub held_out: Vec<bool>,
    /// Per point: (found, predicted) per condition; NaN where missing.
    pub values: Vec<Vec<(f64, f64)>>,
}

impl TableComparison {
    /// Adds the conditions of `table` with the predictions of `surrogate`; columns are matched by name.
    ///
    /// # Errors
    /// A variable or point of the surrogate is not in the table.
    pub fn add(&mut self, surrogate: &Surrogate<'_>, table: &Table, held_out: bool) -> Result<()> {
        let inputs = surrogate.variables().map(|v| table.column(v.name)).collect::<Result<Vec<_>>>()?;
        let outputs = surrogate.points().map(|p| table.column(p.name)).collect::<Result<Vec<_>>>()?;
        self.values.resize(outputs.len(), Vec::new());
        for row in 0..table.rows() {
            let x: Vec<f64> = inputs.iter().map(|c| c.values[row]).collect();
            let answer = verdict::query(surrogate, &x)?;
            for ((list, output), t) in self.values.iter_mut().zip(&outputs).zip(answer.temperatures) {
                list.push((output.values[row], t.value));
            }
            self.conditions.push(x);
            self.held_out.push(held_out);
        }
        Ok(())
    }

    /// Largest error and root mean square error of a point on conditions the fit has not seen, and the
    /// share of them inside its band; `None` where there are none.
    pub fn held_out_errors(&self, point: usize, half_width: f64) -> Option<(f64, f64, f64)> {
        let errors: Vec<f64> = (self.values.get(point)?.iter().zip(&self.held_out))
            .filter(|((found, _), held)| **held && found.is_finite())
            .map(|((found, predicted), _)| (predicted - found).abs())
            .collect();
        if errors.is_empty() {
            return None;
        }
        let n = errors.len() as f64;
        let largest = errors.iter().fold(0.0, |m: f64, e| m.max(*e));
        let rms = (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
        Some((largest, rms, errors.iter().filter(|e| **e <= half_width).count() as f64 / n))
    }
}

/// The point with the largest error on conditions the fit has not seen; the first where nothing was compared.
pub(crate) fn worst_point(surrogate: &Surrogate<'_>, comparison: &TableComparison) -> Option<usize> {
    let error = |p: usize| comparison.held_out_errors(p, 0.0).map_or(0.0, |e| e.0);
    (0..surrogate.point_count()).rev().max_by(|a, b| error(*a).total_cmp(&error(*b)))
}

/// Provenance of a surrogate in a line: program, and the beginning of the hash of the machine file.
pub fn provenance(surrogate: &Surrogate<'_>) -> String {
    let shown = surrogate.provenance().filter(|(k, _)| ["program", MACHINE_HASH].contains(k));
    shown.map(|(k, v)| format!("{k} {}", if k == MACHINE_HASH { short_hash(v) } else { v })).collect::<Vec<_>>().join("; ")
}

/// Beginning of a hash, enough to tell files apart on a page.
pub(crate) fn short_hash(hash: &str) -> &str {
    hash.get(..12).unwrap_or(hash)
}

/// Predicted against found for one point; `None` without a condition to compare at.
pub fn parity(surrogate: &Surrogate<'_>, comparison: &TableComparison, point: usize) -> Option<ParityFigure> {
    let p = surrogate.point(point)?;
    if comparison.conditions.is_empty() {
        return None;
    }
    let samples = comparison.values[point].iter().zip(&comparison.held_out);
    Some(ParityFigure {
        title: format!("{}: surrogate against full solver", p.name),
        quantity: Quantity::new(p.name, p.unit),
        samples: samples
            .map(|((reference, predicted), held_out)| ParityPoint { reference: *reference, predicted: *predicted, held_out: *held_out })
            .collect(),
        half_width: surrogate.fit_half_width(point),
        notes: held_note(surrogate),
        ..ParityFigure::default()
    })
}

/// Residuals of one point against everything; `None` without a condition to compare at.
pub fn residuals(surrogate: &Surrogate<'_>, comparison: &TableComparison, point: usize) -> Option<ResidualFigure> {
    let p = surrogate.point(point)?;
    if comparison.conditions.is_empty() {
        return None;
    }
    Some(ResidualFigure {
        title: format!("{}: what the surrogate misses", p.name),
        quantity: Quantity::new(p.name, p.unit),
        variables: (0..surrogate.variable_count()).map(|i| quantity(surrogate, i)).collect(),
        conditions: comparison.conditions.clone(),
        predicted: comparison.values[point].iter().map(|(_, predicted)| *predicted).collect(),
        residuals: comparison.values[point].iter().map(|(found, predicted)| found - predicted).collect(),
        held_out: comparison.held_out.clone(),
        half_width: surrogate.fit_half_width(point),
        notes: held_note(surrogate),
    })
}

/// Errors of every point on one axis. `fits` are the reports of the fit, if available.
pub fn errors(
    surrogate: &Surrogate<'_>,
    comparison: &TableComparison,
    fits: &[coldplate_surrogate::fit::PointReport],
    target: Option<f64>,
) -> ErrorOverview {
    let point = |(i, p): (usize, coldplate_runtime::Point<'_>)| {
        let report = fits.iter().find(|f| f.name == p.name);
        PointErrors {
            name: p.name.into(),
            leave_one_out: report.map(|f| f.chosen.leave_one_out.rms),
            k_fold: report.and_then(|f| f.chosen.k_fold).map(|k| k.rms),
            held_out_max: comparison.held_out_errors(i, 0.0).map(|e| e.0),
            half_width: Some(surrogate.fit_half_width(i)),
        }
    };
    ErrorOverview {
        title: "How far the surrogate can be trusted".into(),
        unit: "K".into(),
        points: surrogate.points().enumerate().map(point).collect(),
        target,
        notes: held_note(surrogate),
    }
}
