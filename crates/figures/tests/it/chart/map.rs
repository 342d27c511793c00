//! Contour lines of a map where margins jump or are steep: no line that means nothing, no label that cannot be told whose it is.

use coldplate_figures::chart::acceptability::{AcceptabilityMap, CellState};
use coldplate_figures::chart::style::Quantity;
use coldplate_figures::chart::to_svg_string;

use super::svg;

/// A margin of 45 K at low speed that falls to 24 K at 300 r/min, within one cell or within a few, and slowly from there on.
fn map(fall: f64, binding: impl Fn(f64) -> usize) -> AcceptabilityMap {
    let x_values: Vec<f64> = (0..81).map(|i| 75.0 * f64::from(i)).collect();
    let y_values: Vec<f64> = (0..81).map(|j| 2.0 + 0.1 * f64::from(j)).collect();
    let margin = |x: f64| 24.0 - 0.0025 * (x - 340.0).max(0.0) + 21.0 * ((340.0 - x) / fall).clamp(0.0, 1.0);
    let nodes = || y_values.iter().flat_map(|_| x_values.iter().copied());
    AcceptabilityMap {
        title: "Which conditions are acceptable".into(),
        x: Quantity::new("motor_speed", "rpm"),
        y: Quantity::new("coolant_flow", "L/min"),
        margin: nodes().map(margin).collect(),
        margin_unit: "K".into(),
        state: nodes().map(|_| CellState::Acceptable).collect(),
        binding: nodes().map(binding).collect(),
        limits: vec!["motor: at most 70 °C".into(), "front bearing: at most 25 K above ambient temperature".into()],
        x_values: x_values.clone(),
        y_values: y_values.clone(),
        ..AcceptabilityMap::default()
    }
}

fn labels(map: &AcceptabilityMap) -> Vec<String> {
    let tags = svg::read(&to_svg_string(map).unwrap());
    tags.into_iter().filter(|t| t.name == "text" && t.text.starts_with('+')).map(|t| t.text).collect()
}

#[test]
fn no_line_runs_through_a_jump_between_two_limits() {
    let jump = map(1.0, |x| usize::from(x > 340.0));
    let margins = labels(&jump);
    assert!(margins.iter().any(|l| l == "+15 K") && margins.iter().any(|l| l == "+20 K"), "{margins:?}");
    assert!(["+25 K", "+30 K", "+35 K", "+40 K"].iter().all(|wall| !margins.iter().any(|l| l == wall)), "{margins:?}");
}

#[test]
fn a_label_stands_on_no_other_line() {
    let steep = map(120.0, |_| 0);
    let margins = labels(&steep);
    assert!(margins.iter().any(|l| l == "+15 K"), "{margins:?}");
    assert!(["+30 K", "+35 K"].iter().all(|close| !margins.iter().any(|l| l == close)), "{margins:?}");
}
