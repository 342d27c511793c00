//! Figures of cost and convergence, on logarithmic axes.

use std::ops::Range;
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

/// A named line through points.
pub type Series = (String, Vec<(f64, f64)>);

/// Draws `series` and a thin line of the given slope below them.
pub fn draw(path: &Path, title: &str, axes: [&str; 2], series: &[Series], (slope, meaning): (f64, &str)) {
    register().unwrap_or_else(|e| panic!("{e}"));
    let all = || series.iter().flat_map(|(_, points)| points.iter().copied());
    let (span, values) = (range(all().map(|p| p.0)), range(all().map(|p| p.1)));
    let least = values.start;
    let (xs, ys) = (widened(&span), widened(&values));
    let root = SVGBackend::new(path, SIZE).into_drawing_area();
    root.fill(&WHITE).expect("a white page");
    let mut chart = ChartBuilder::on(&root)
        .caption(title, (FAMILY, 20))
        .margin(14)
        .x_label_area_size(46)
        .y_label_area_size(76)
        .build_cartesian_2d(xs.log_scale(), ys.log_scale())
        .expect("axes");
    let font = (FAMILY, 14);
    let number = |v: &f64| if (0.01..1e4).contains(v) { format!("{}", (v * 1e3).round() / 1e3) } else { format!("{v:.0e}") };
    chart
        .configure_mesh()
        .x_desc(axes[0])
        .y_desc(axes[1])
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .x_labels(5)
        .label_style(font)
        .light_line_style(RGBColor(240, 240, 240))
        .draw()
        .expect("a grid");
    for ((name, points), colour) in series.iter().zip(COLOURS.iter().cycle()) {
        chart
            .draw_series([PathElement::new(points.clone(), colour.stroke_width(2))])
            .expect("a line")
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
        chart.draw_series(points.iter().map(|p| Circle::new(*p, 4, colour.filled()))).expect("its points");
    }
    // Where it falls it is lowest at its end.
    let lowest = if slope < 0.0 { span.end } else { span.start };
    let under = |x: f64| 0.8 * least * (x / lowest).powf(slope);
    chart
        .draw_series([PathElement::new([span.start, span.end].map(|x| (x, under(x))), BLACK.stroke_width(1))])
        .expect("a slope")
        .label(meaning)
        .legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], BLACK));
    chart
        .configure_series_labels()
        .position(if slope < 0.0 { SeriesLabelPosition::UpperRight } else { SeriesLabelPosition::UpperLeft })
        .label_font(font)
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(200, 200, 200))
        .draw()
        .expect("a legend");
    root.present().unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    println!("drew {}", path.display());
}

/// From the least to the largest.
fn range(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
    low..high
}

fn widened(range: &Range<f64>) -> Range<f64> {
    0.7 * range.start..1.4 * range.end
}
