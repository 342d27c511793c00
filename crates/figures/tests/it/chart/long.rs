//! The sample figures with long names and many points.

use coldplate_figures::chart::acceptability::{AcceptabilityMap, MarkedCondition};
use coldplate_figures::chart::error_overview::ErrorOverview;
use coldplate_figures::chart::heat::HeatFigure;
use coldplate_figures::chart::measured::MeasuredFigure;
use coldplate_figures::chart::one_factor::OneFactorFigure;
use coldplate_figures::chart::operator_sheet::OperatorSheet;
use coldplate_figures::chart::residuals::ResidualFigure;
use coldplate_figures::chart::style::Quantity;

use super::samples;

pub const LONG: &str = "temperature of the motor-side angular contact bearing set of the second X carriage, outer ring, left of the <lubrication> & \"seal\" groove";

pub fn one_factor() -> OneFactorFigure {
    let mut figure = samples::one_factor();
    let curves = figure.curves.clone();
    figure.title = LONG.repeat(3);
    figure.x.name = LONG.into();
    figure.y.name = LONG.repeat(2);
    figure.curves = (0..15).map(|k| curves[k % 7].clone()).collect();
    for (k, curve) in figure.curves.iter_mut().enumerate() {
        curve.name = format!("{k} {LONG}");
        curve.formula = format!("T = {}", "1.2345e−6 q³ + 0.0117 q² ".repeat(1 + k % 5));
        for (_, y) in curve.samples.iter_mut().chain(&mut curve.line) {
            *y += 0.4 * (k / 7) as f64;
        }
    }
    figure.fixed = (0..9).map(|k| (Quantity::new(format!("{LONG} {k}"), "degC"), 1.0 / 3.0)).collect();
    figure
}

pub fn map() -> AcceptabilityMap {
    let mut map = samples::map();
    map.title = LONG.repeat(2);
    (map.x.name, map.y.name) = (LONG.into(), LONG.into());
    map.limits = (0..30).map(|k| format!("limit {k} {LONG}")).collect();
    map.binding = (0..map.margin.len()).map(|k| (k % 81) / 3).collect();
    map.here = Some(MarkedCondition { x: 9.0, y: 20.0, label: LONG.into() });
    map
}

/// With two maps, with a large table too, and without a map.
pub fn sheets() -> [OperatorSheet; 3] {
    let mut two = samples::sheet();
    two.machine = LONG.into();
    two.subtitle = LONG.into();
    two.limits = (0..14).map(|k| (format!("{k} {LONG}"), LONG.into())).collect();
    two.how_to_read = vec![LONG.into(); 6];
    two.provenance = LONG.repeat(4);
    two.maps = vec![map(), samples::map()];
    let mut large = two.clone();
    if let Some(table) = &mut large.table {
        (table.title, table.row.name, table.column.name) = (LONG.repeat(3), LONG.into(), LONG.into());
        table.rows = (0..10).map(|k| 1e5 / 3.0 * f64::from(k)).collect();
        table.columns = (0..9).map(|k| 1e-5 / 3.0 * f64::from(k)).collect();
        table.cells = table.cells.iter().cycle().take(90).cloned().collect();
        table.cells[5].text = LONG.into();
    }
    let mut none = large.clone();
    none.maps.clear();
    [two, large, none]
}

pub fn errors() -> ErrorOverview {
    let mut errors = samples::errors();
    let points = errors.points.clone();
    errors.points = (0..15).map(|k| points[k % 7].clone()).collect();
    errors.points.iter_mut().enumerate().for_each(|(k, p)| p.name = format!("{k} {LONG}"));
    errors
}

pub fn heat() -> HeatFigure {
    let mut heat = samples::heat();
    heat.sources = (0..40).map(|k| (format!("{k} {LONG}"), 1e-4 * f64::from(k).powi(4))).collect();
    heat.sinks = (0..15).map(|k| (format!("{k} {LONG}"), -4.0 * f64::from(k))).collect();
    heat
}

pub fn measured() -> MeasuredFigure {
    let mut measured = samples::measured();
    let sensors = measured.sensors.clone();
    measured.sensors = (0..15).map(|k| sensors[k % 7].clone()).collect();
    measured.sensors.iter_mut().enumerate().for_each(|(k, s)| s.name = format!("{k}{}", LONG.replace(' ', "_")));
    measured.other_name = LONG.into();
    measured
}

pub fn residuals() -> ResidualFigure {
    let mut residuals = samples::residuals();
    for variable in &mut residuals.variables {
        variable.name = LONG.into();
    }
    residuals.title = LONG.into();
    residuals
}
