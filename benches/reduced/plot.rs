//! The histogram of bounds over errors, on a logarithmic axis.

use std::path::Path;

use coldplate_figures::chart::fonts::{FAMILY, register};
use plotters::prelude::*;

const SIZE: (u32, u32) = (900, 560);
/// Colours that stay apart for any eye (Okabe and Ito 2008).
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
    RGBColor(120, 120, 120),
];
/// The axis, and classes in each tenfold.
const AXIS: (f64, f64) = (0.5, 1000.0);
const CLASSES: f64 = 8.0;

/// Draws the share of conditions in each class of a ratio, a line per name, and lines at the two ends of what is `good`.
pub fn histogram(path: &Path, title: &str, series: &[(String, Vec<f64>)], good: (f64, f64)) {
    register().unwrap_or_else(|e| panic!("{e}"));
    let first = AXIS.0.log10();
    let count = ((AXIS.1.log10() - first) * CLASSES).ceil() as usize;
    let class = |ratio: f64| (((ratio.log10() - first) * CLASSES).max(0.0) as usize).min(count - 1);
    let shares: Vec<Vec<f64>> = (series.iter())
        .map(|(_, ratios)| {
            let mut shares = vec![0.0; count];
            ratios.iter().for_each(|r| shares[class(*r)] += 100.0 / ratios.len() as f64);
            shares
        })
        .collect();
    let highest = shares.iter().flatten().fold(0.0, |m: f64, s| m.max(*s));
    let root = SVGBackend::new(path, SIZE).into_drawing_area();
    root.fill(&WHITE).expect("a white page");
    let mut chart = ChartBuilder::on(&root)
        .caption(title, (FAMILY, 20))
        .margin(14)
        .x_label_area_size(46)
        .y_label_area_size(66)
        .build_cartesian_2d((AXIS.0..AXIS.1).log_scale(), 0.0..1.1 * highest)
        .expect("axes");
    chart
        .configure_mesh()
        .x_desc("largest bound over largest error of a condition")
        .y_desc("conditions, %")
        .x_label_formatter(&|v| format!("{v}"))
        .y_label_formatter(&|v| format!("{v:.0}"))
        .label_style((FAMILY, 14))
        .light_line_style(RGBColor(240, 240, 240))
        .draw()
        .expect("a grid");
    for end in [good.0, good.1] {
        let line = [(end, 0.0), (end, 1.1 * highest)];
        chart.draw_series([PathElement::new(line, RGBColor(150, 150, 150).stroke_width(1))]).expect("a line");
    }
    let edge = |k: usize| 10f64.powf(first + k as f64 / CLASSES);
    for (((name, _), shares), colour) in series.iter().zip(&shares).zip(COLOURS.iter().cycle()) {
        let steps: Vec<(f64, f64)> = shares.iter().enumerate().flat_map(|(k, s)| [(edge(k), *s), (edge(k + 1), *s)]).collect();
        chart
            .draw_series([PathElement::new(steps, colour.stroke_width(2))])
            .expect("a line")
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .label_font((FAMILY, 14))
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(200, 200, 200))
        .draw()
        .expect("a legend");
    root.present().unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    println!("\ndrew {}", path.display());
}
