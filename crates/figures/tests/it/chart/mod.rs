//! Charts: structure of the SVG, texts inside the page and clear of each other, nasty data, grey prints,
//! files.

mod long;
mod map;
mod page;
mod samples;
mod seen;
mod svg;

use coldplate_base::error::{Kind, Result};
use coldplate_figures::chart::acceptability::{AcceptabilityMap, CellState, MarkedCondition};
use coldplate_figures::chart::canvas::Canvas;
use coldplate_figures::chart::fonts::{self, FontWeight};
use coldplate_figures::chart::output::to_pixels;
use coldplate_figures::chart::style::{self, Quantity, Rgb, number, series, unit_symbol};
use coldplate_figures::chart::ticks::{Range, linear, logarithmic};
use coldplate_figures::chart::{Figure, draw, to_svg_string};
use long::LONG;
use samples::NASTY;

/// Runs the same check on every figure with realistic data.
macro_rules! every_figure {
    ($check:expr) => {
        $check("one_factor", &samples::one_factor());
        $check("map", &samples::map());
        $check("parity", &samples::parity());
        $check("residuals", &samples::residuals());
        $check("errors", &samples::errors());
        $check("heat", &samples::heat());
        $check("sankey", &samples::sankey());
        $check("machine", &samples::machine());
        $check("measured", &samples::measured());
        $check("panels", &samples::panels());
        $check("sheet", &samples::sheet());
        $check("residual sheet", &samples::residual_sheet(12));
        $check("residual panels", &samples::residual_panels());
        $check("ranking", &samples::ranking());
        $check("gains", &samples::gains());
        $check("missing", &samples::missing());
        $check("balance", &samples::balance());
        $check("before and after", &samples::before_after());
    };
}

/// The figure is well formed, every text stands inside the page, and no two texts overlap.
fn check_layout<F: Figure>(name: &str, figure: &F) {
    let text = to_svg_string(figure).unwrap_or_else(|e| panic!("{name}: {e}"));
    let tags = svg::read(&text);
    let root = &tags[0];
    let view: Vec<f64> = root.get("viewBox").unwrap().split(' ').map(|v| v.parse().unwrap()).collect();
    assert_eq!((view[2], view[3]), (10.0 * root.number("width"), 10.0 * root.number("height")));
    let texts: Vec<_> = tags.iter().filter(|t| t.name == "text").collect();
    assert!(texts.len() > 3, "{name}: {} texts", texts.len());
    let mut boxes: Vec<(f64, f64, f64, f64)> = Vec::new();
    for tag in texts {
        let b = svg::text_box(tag);
        assert!(b.0 >= 0.0 && b.1 >= 0.0 && b.2 <= view[2] && b.3 <= view[3], "{name}: '{}' leaves the page: {b:?}", tag.text);
        let length = tag.number("textLength");
        let expected = (b.2 - b.0).max(b.3 - b.1);
        assert!((length - expected).abs() <= 1.0 || tag.text.chars().count() < 3, "{name}: '{}' {length} {expected}", tag.text);
        for (other, o) in boxes.iter().enumerate() {
            let apart = b.0 >= o.2 || o.0 >= b.2 || b.1 >= o.3 || o.1 >= b.3;
            assert!(apart, "{name}: '{}' {b:?} overlaps text {other} {o:?}", tag.text);
        }
        boxes.push(b);
    }
    for tag in tags.iter().filter(|t| t.name == "polyline" || t.name == "polygon") {
        for pair in tag.get("points").unwrap().split_whitespace() {
            let (x, y) = pair.split_once(',').unwrap();
            let (x, y): (f64, f64) = (x.parse().unwrap(), y.parse().unwrap());
            let reach = 20.0;
            assert!(x >= -reach && y >= -reach && x <= view[2] + reach && y <= view[3] + reach, "{name}: drawn outside the page: {x} {y}");
        }
    }
}

#[test]
fn realistic_figures_are_well_laid_out() {
    every_figure!(check_layout);
}

#[test]
fn long_names_and_many_points_are_well_laid_out() {
    check_layout("one_factor", &long::one_factor());
    check_layout("map", &long::map());
    for (name, sheet) in ["two maps", "large table", "no map"].iter().zip(long::sheets()) {
        check_layout(name, &sheet);
    }
    check_layout("errors", &long::errors());
    check_layout("heat", &long::heat());
    check_layout("measured", &long::measured());
    check_layout("residuals", &long::residuals());
    for columns in [1, 2, 17, 24, 40, 60] {
        check_layout(&format!("{columns} columns"), &samples::residual_sheet(columns));
        let mut sheet = samples::residual_sheet(columns);
        sheet.sensors.iter_mut().chain(&mut sheet.conditions).for_each(|name| *name = format!("{name} {LONG}"));
        (sheet.title, sheet.unit) = (LONG.repeat(2), LONG.into());
        check_layout(&format!("{columns} long columns"), &sheet);
    }
    let mut panels = samples::residual_panels();
    panels.sensors.iter_mut().for_each(|(name, _)| *name = format!("{name} {LONG}"));
    panels.variables.iter_mut().for_each(|v| v.name = LONG.into());
    check_layout("residual panels", &panels);
    let mut ranking = samples::ranking();
    ranking.ranked.iter_mut().for_each(|r| r.name = LONG.repeat(2));
    check_layout("ranking", &ranking);
    let mut missing = samples::missing();
    missing.rows.iter_mut().for_each(|r| (r.name, r.remark) = (LONG.into(), LONG.into()));
    (missing.remarks, missing.meaning) = (LONG.into(), [LONG.into(), LONG.into()]);
    check_layout("missing", &missing);
    let mut balance = samples::balance();
    balance.sources.iter_mut().chain(&mut balance.sinks).for_each(|p| p.name = LONG.into());
    balance.names = [LONG.into(), LONG.into()];
    check_layout("balance", &balance);
    let mut pair = samples::before_after();
    pair.names = [LONG.into(), LONG.into()];
    pair.conditions = (0..300).map(|k| (1.0 + samples::scatter(k), 0.1)).collect();
    check_layout("before and after", &pair);
}

#[test]
fn huge_tiny_and_equal_values_are_well_laid_out() {
    for (offset, spread) in
        [(20.0, 0.0), (0.0, 0.0), (20.0, 1e-7), (20.0, 1e-12), (1e9, 1.0), (0.0, 1e12), (-1e-9, 1e-10), (293.15, 1e-4), (1e250, 1e249)]
    {
        let name = format!("{offset} and {spread}");
        let mut figure = samples::one_factor();
        for curve in &mut figure.curves {
            for (_, y) in curve.samples.iter_mut().chain(&mut curve.line) {
                *y = offset + spread * (*y - 23.0);
            }
            curve.half_width = 0.1 * spread;
        }
        check_layout(&name, &figure);
        for curve in &mut figure.curves {
            for (x, _) in curve.samples.iter_mut().chain(&mut curve.line) {
                *x = offset + spread * *x;
            }
        }
        check_layout(&name, &figure);
        let mut parity = samples::parity();
        for sample in &mut parity.samples {
            sample.reference = offset + spread * sample.reference;
            sample.predicted = offset + spread * sample.predicted;
        }
        check_layout(&name, &parity);
        let mut measured = samples::measured();
        for sensor in &mut measured.sensors {
            sensor.measured = sensor.measured.map(|m| offset + spread * m);
            sensor.predicted = sensor.predicted.map(|m| offset + spread * m);
            sensor.other = None;
            (sensor.uncertainty, sensor.band) = (None, Some(spread));
        }
        check_layout(&name, &measured);
        let mut heat = samples::heat();
        for (_, watts) in heat.sources.iter_mut().chain(&mut heat.sinks) {
            *watts = offset + spread * *watts;
        }
        check_layout(&name, &heat);
    }
}

/// Drawn or refused as bad input, never a panic; drawn means well formed.
fn survives<F: Figure>(name: &str, painted: bool, figure: &F) {
    match to_svg_string(figure) {
        Ok(text) => {
            svg::read(&text);
            assert!(!text.contains("NaN") && !text.contains("inf"), "{name}");
            // Painting is the slow part, and sees the same coordinates.
            if painted {
                to_pixels(figure).unwrap();
            }
        }
        Err(e) => assert_eq!(e.kind(), Kind::Input, "{name}: {e}"),
    }
}

#[test]
fn nasty_values_never_panic() {
    for (n, bad) in NASTY.into_iter().enumerate() {
        for every in [1, 3] {
            let at = |k: usize, v: &mut f64| {
                if k.is_multiple_of(every) {
                    *v = bad;
                }
            };
            let name = format!("{bad} every {every}");
            let mut figure = samples::one_factor();
            for curve in &mut figure.curves {
                curve.samples.iter_mut().enumerate().for_each(|(k, s)| at(k, if n % 2 == 0 { &mut s.0 } else { &mut s.1 }));
                curve.line.iter_mut().enumerate().for_each(|(k, s)| at(k, &mut s.1));
                at(0, &mut curve.half_width);
            }
            figure.fixed[0].1 = bad;
            survives(&name, every == 1, &figure);

            let mut map = samples::map();
            map.margin.iter_mut().enumerate().for_each(|(k, m)| at(k, m));
            map.half_width.iter_mut().enumerate().for_each(|(k, m)| at(k / 7, m));
            map.here = Some(MarkedCondition { x: bad, y: bad, label: "here".into() });
            survives(&name, every == 1, &map);
            let mut sheet = samples::sheet();
            sheet.maps = vec![map.clone()];
            if let Some(t) = &mut sheet.table {
                t.rows.iter_mut().enumerate().for_each(|(k, v)| at(k, v));
            }
            survives(&name, every == 1, &sheet);
            map.x_values.iter_mut().enumerate().for_each(|(k, m)| at(k, m));
            survives(&name, every == 1, &map);

            let mut parity = samples::parity();
            parity.samples.iter_mut().enumerate().for_each(|(k, s)| at(k, if k % 2 == 0 { &mut s.reference } else { &mut s.predicted }));
            parity.half_width = bad;
            survives(&name, every == 1, &parity);

            let mut residuals = samples::residuals();
            residuals.residuals.iter_mut().enumerate().for_each(|(k, r)| at(k, r));
            residuals.conditions.iter_mut().enumerate().for_each(|(k, c)| at(k, &mut c[k % 4]));
            survives(&name, every == 1, &residuals);

            let mut errors = samples::errors();
            errors.points.iter_mut().enumerate().for_each(|(k, p)| {
                if k.is_multiple_of(every) {
                    (p.leave_one_out, p.held_out_max) = (Some(bad), Some(bad))
                }
            });
            errors.target = Some(bad);
            survives(&name, every == 1, &errors);

            let mut heat = samples::heat();
            heat.sources.iter_mut().enumerate().for_each(|(k, s)| at(k, &mut s.1));
            survives(&name, every == 1, &heat);

            let mut sheet = samples::residual_sheet(7);
            sheet.sheets[0].1.iter_mut().flatten().enumerate().for_each(|(k, v)| at(k, v));
            sheet.full = (if every == 1 { bad } else { 3.0 }, bad);
            survives(&name, every == 1, &sheet);

            let mut panels = samples::residual_panels();
            panels.sensors.iter_mut().flat_map(|s| &mut s.1).enumerate().for_each(|(k, v)| at(k, v));
            panels.conditions.iter_mut().enumerate().for_each(|(k, c)| at(k, &mut c[k % 4]));
            panels.half_width = bad;
            survives(&name, every == 1, &panels);

            let mut ranking = samples::ranking();
            ranking.ranked.iter_mut().enumerate().for_each(|(k, r)| at(k, &mut r.probability));
            survives(&name, every == 1, &ranking);

            let mut gains = samples::gains();
            gains.steps.iter_mut().enumerate().for_each(|(k, s)| at(k, &mut s.kept_out));
            gains.noise_floor = bad;
            survives(&name, every == 1, &gains);

            let mut missing = samples::missing();
            missing.rows.iter_mut().enumerate().for_each(|(k, r)| {
                at(k, &mut r.value);
                at(k, if n % 2 == 0 { &mut r.ends.0 } else { &mut r.ends.1 });
            });
            survives(&name, every == 1, &missing);

            let mut balance = samples::balance();
            balance.sources.iter_mut().chain(&mut balance.sinks).enumerate().for_each(|(k, p)| {
                if k.is_multiple_of(every) {
                    p.before = Some(bad);
                }
            });
            survives(&name, every == 1, &balance);

            let mut pair = samples::before_after();
            pair.readings.iter_mut().enumerate().for_each(|(k, r)| at(k, &mut r[k % 3]));
            pair.conditions.iter_mut().enumerate().for_each(|(k, c)| at(k, &mut c.1));
            pair.noise_floor = bad;
            survives(&name, every == 1, &pair);

            let mut measured = samples::measured();
            measured.sensors.iter_mut().enumerate().for_each(|(k, s)| {
                if k.is_multiple_of(every) {
                    (s.measured, s.uncertainty) = (Some(bad), Some(bad))
                }
            });
            survives(&name, every == 1, &measured);
        }
    }
}

#[test]
fn one_sample_is_enough_and_none_is_refused() {
    let mut figure = samples::one_factor();
    figure.curves.truncate(1);
    figure.curves[0].samples.truncate(1);
    figure.curves[0].line.clear();
    check_layout("one sample", &figure);
    figure.curves.clear();
    let mut parity = samples::parity();
    parity.samples.truncate(1);
    check_layout("one sample", &parity);
    parity.samples.clear();
    let mut residuals = samples::residuals();
    residuals.conditions.clear();
    let mut sheet = samples::sheet();
    (sheet.maps, sheet.table) = (vec![], None);
    for error in [
        to_svg_string(&figure).unwrap_err(),
        to_svg_string(&parity).unwrap_err(),
        to_svg_string(&residuals).unwrap_err(),
        to_svg_string(&sheet).unwrap_err(),
        to_svg_string(&AcceptabilityMap::default()).unwrap_err(),
        to_svg_string(&AcceptabilityMap { state: vec![], ..samples::map() }).unwrap_err(),
        to_svg_string(&coldplate_figures::chart::heat::HeatFigure::default()).unwrap_err(),
        to_svg_string(&coldplate_figures::chart::measured::MeasuredFigure::default()).unwrap_err(),
        to_svg_string(&coldplate_figures::chart::error_overview::ErrorOverview::default()).unwrap_err(),
    ] {
        assert_eq!(error.exit_status(), 2);
    }
}

#[test]
fn what_is_in_a_name_cannot_break_the_markup() {
    let mut heat = samples::heat();
    heat.title = "</svg><script>alert('x')</script> & \u{0}\u{8}\n\t\"quoted\"".into();
    heat.sources[0].0 = "a <b> & 'c' \"d\" ]]> textLength=\"1\" </text>".into();
    heat.sources[1].0 = "\u{0}\u{1b}[31m".into();
    check_layout("markup", &heat);
    let text = to_svg_string(&heat).unwrap();
    assert!(!text.contains("<script") && text.matches("<svg").count() == 1);
    assert!(text.chars().all(|c| c == '\n' || !c.is_control()));
}

#[test]
fn a_grey_print_keeps_apart_what_colours_tell() {
    let states = [CellState::Acceptable, CellState::Uncertain, CellState::NotAcceptable].map(CellState::look);
    for (i, (a, hatch_a)) in states.iter().enumerate() {
        for (b, hatch_b) in &states[..i] {
            assert!((a.luminance() - b.luminance()).abs() > 0.2, "{a:?} {b:?}");
            assert!(a.contrast(*b) > 1.5 && hatch_a != hatch_b);
        }
        // WCAG 2.1 AA for text.
        assert!(a.contrast(style::INK) > 4.5, "ink on {a:?}");
    }
    for i in 0..40 {
        assert!(series(i).colour.contrast(style::WHITE) > 2.0, "curve {i} on white");
        for j in 0..i {
            assert!(series(i).marker != series(j).marker || series(i).dash != series(j).dash, "curves {i} and {j}");
        }
    }
    // The ends of the scale by definition, and sRGB mid grey by IEC 61966-2-1.
    assert_eq!(style::WHITE.contrast(Rgb(0, 0, 0)), 21.0);
    assert!((Rgb(188, 188, 188).luminance() - 0.5).abs() < 0.005);
}

#[test]
fn pixels_show_what_the_data_say() {
    let heat = samples::heat();
    let (pixels, (width, height)) = to_pixels(&heat).unwrap();
    let (w, h) = heat.size().unwrap();
    assert_eq!((width, height), (2 * w.ceil() as u32, 2 * h.ceil() as u32));
    assert_eq!(pixels.len(), 3 * (width * height) as usize);
    let count = |c: Rgb| pixels.chunks_exact(3).filter(|p| **p == [c.0, c.1, c.2]).count();
    // Bars of equal height: the orange area is the heat in times that of one watt, and 113.7 W are widest.
    let widest = pixels
        .chunks_exact(3 * width as usize)
        .map(|row| row.chunks_exact(3).filter(|p| **p == [style::ORANGE.0, style::ORANGE.1, style::ORANGE.2]).count())
        .max()
        .unwrap();
    let rows = count(style::ORANGE) as f64 / widest as f64;
    let one = rows * 113.7 / (113.7 + 51.2 + 4.17 + 1.74 + 0.518 + 2.9);
    assert!((one - 31.0).abs() < 3.0, "bars are 15.6 CSS pixels high: {one}");
    // The band is painted at 20 %: blue over white.
    let mut figure = samples::one_factor();
    figure.curves.truncate(1);
    figure.curves[0].half_width = 2.0;
    let (pixels, _) = to_pixels(&figure).unwrap();
    let blend = |c: u8| 255.0 * 0.8 + f64::from(c) * 0.2;
    let near = |p: &[u8]| {
        [(p[0], style::BLUE.0), (p[1], style::BLUE.1), (p[2], style::BLUE.2)].iter().all(|(a, c)| (f64::from(*a) - blend(*c)).abs() < 3.0)
    };
    assert!(pixels.chunks_exact(3).filter(|p| near(p)).count() > 100_000);
}

#[test]
fn files_are_written_whole() {
    let folder = std::env::temp_dir().join(format!("coldplate-charts-{}", std::process::id()));
    let written = draw(folder.join("deep").join("map v1.5"), &samples::map()).unwrap();
    assert!(written.svg.ends_with("deep/map v1.5.svg") && written.png.ends_with("deep/map v1.5.png"));
    assert_eq!(std::fs::read_to_string(&written.svg).unwrap(), to_svg_string(&samples::map()).unwrap());
    let png = std::fs::read(&written.png).unwrap();
    assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
    let size = |at: usize| u32::from_be_bytes(png[at..at + 4].try_into().unwrap());
    assert_eq!((size(16), size(20)), to_pixels(&samples::map()).unwrap().1);
    assert_eq!(std::fs::read_dir(folder.join("deep")).unwrap().count(), 2, "a temporary file was left");
    let blocked = draw(folder.join("deep").join("map v1.5.svg").join("x"), &samples::heat()).unwrap_err();
    assert_eq!(blocked.exit_status(), 2);
    assert!(blocked.location().file.is_some());
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn the_same_figure_is_the_same_file() {
    every_figure!(|name: &str, figure| same(name, figure));
    fn same<F: Figure>(name: &str, figure: &F) {
        assert_eq!(to_svg_string(figure).unwrap(), to_svg_string(figure).unwrap(), "{name}");
    }
}

#[test]
fn the_font_has_the_widths_of_helvetica_and_the_signs_we_need() {
    // Adobe's Helvetica and Helvetica-Bold metrics (AFM), in thousandths of an em.
    let cases =
        [("0", 556, 556), ("A", 667, 722), (" ", 278, 278), ("m", 833, 889), ("i", 222, 278), ("W", 944, 944), ("degree", 3113, 3279)];
    for (text, regular, bold) in cases {
        assert!((fonts::width(text, 1000.0, FontWeight::Regular) - f64::from(regular)).abs() < 1.0 * text.len() as f64, "{text}");
        assert!((fonts::width(text, 1000.0, FontWeight::Bold) - f64::from(bold)).abs() < 1.0 * text.len() as f64, "{text} bold");
    }
    for c in "°²³⁴±≤≥·×−–…ΔλµηαμüéÅ⁻⁰¹√≈●▲■".chars() {
        assert!(fonts::has(c), "no {c}");
    }
}

#[test]
fn texts_are_shortened_and_broken_within_their_room() {
    for limit in [5.0, 20.0, 80.0, 300.0] {
        for text in [LONG, "a", "", "supercalifragilisticexpialidocious_without_a_space", "°C µ ≤"] {
            let short = fonts::fit(text, 13.0, FontWeight::Regular, limit);
            assert!(fonts::width(&short, 13.0, FontWeight::Regular) <= limit);
            for most in [1, 2, 5] {
                let lines = fonts::wrap(text, 13.0, FontWeight::Bold, limit, most);
                assert!(lines.len() <= most);
                for line in &lines {
                    // One letter is the least a line holds.
                    assert!(fonts::width(line, 13.0, FontWeight::Bold) <= limit.max(13.0), "{line}");
                }
            }
        }
    }
    assert_eq!(fonts::wrap("one two three", 13.0, FontWeight::Regular, 60.0, 5), ["one two", "three"]);
    // A number and its unit stay together, wherever the line ends.
    for limit in 60..200 {
        let lines =
            fonts::wrap("Fixed: preload 3000 N \u{b7} flow 9.42 L/min \u{b7} table 4 = 0", 13.0, FontWeight::Regular, f64::from(limit), 9);
        assert!(lines.join(" ").contains("3000 N") && lines.iter().all(|l| !l.ends_with("3000") && !l.ends_with("9.42")), "{lines:?}");
    }
    assert_eq!(fonts::fit("motor", 13.0, FontWeight::Regular, 100.0), "motor");
}

#[test]
fn ticks_stand_at_round_values() {
    let of = |low, high, most| linear(Range { low, high }, most);
    assert_eq!(of(0.0, 10.0, 5).labels, ["0", "2", "4", "6", "8", "10"]);
    assert_eq!(of(-0.013, 0.013, 6).labels, ["−0.010", "−0.005", "0.000", "0.005", "0.010"]);
    assert_eq!(of(17.9, 24.1, 6).labels, ["18", "20", "22", "24"]);
    assert_eq!(of(0.0, 2.4e6, 4).remark.as_deref(), Some("×10⁶"));
    assert_eq!(logarithmic(Range { low: 0.0009, high: 12.0 }, 10).labels, ["0.001", "0.01", "0.1", "1", "10"]);
    for (low, high) in [(20.0, 20.0 + 1e-7), (-5e7, 5e7), (1e-9, 3e-9), (1e12, 1e12 + 3.0), (-293.15001, -293.15), (0.1, 0.100001)] {
        let ticks = of(low, high, 6);
        assert!((2..=8).contains(&ticks.values.len()), "{low} {high}: {ticks:?}");
        let mut labels = ticks.labels.clone();
        labels.dedup();
        assert_eq!(labels.len(), ticks.labels.len(), "labels repeat: {ticks:?}");
        assert!(ticks.labels.iter().all(|l| l.chars().count() <= 9), "{ticks:?}");
        let step = high - low;
        assert!(ticks.values.iter().all(|v| *v >= low - 0.01 * step && *v <= high + 0.01 * step));
    }
}

#[test]
fn units_and_numbers_are_written_for_readers() {
    assert_eq!(Quantity::new("coolant_flow", "L/min").label(), "coolant flow [L/min]");
    assert_eq!(Quantity::new("shell", "degC").label(), "shell [°C]");
    assert_eq!(unit_symbol("m3/s"), "m³/s");
    assert_eq!(unit_symbol("W/(m2 K)"), "W/(m² K)");
    assert_eq!(unit_symbol("W/m^2/K"), "W/m²/K");
    assert_eq!(number(9.42), "9.42");
    assert_eq!(number(-0.000157), "−0.000157");
    assert_eq!(number(2500.0), "2500");
    assert_eq!(number(3.14e-5), "3.14e−5");
    assert_eq!(number(0.0), "0");
    assert_eq!(number(1e7), "1e7");
    assert_eq!(number(f64::NAN), "–");
}

/// A figure that draws nothing but what it is told, to test the canvas itself.
struct Lines(Vec<(f64, f64)>);

impl Figure for Lines {
    fn title(&self) -> &str {
        "lines"
    }
    fn size(&self) -> Result<(f64, f64)> {
        Ok((100.0, 50.0))
    }
    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let dashed = coldplate_figures::chart::canvas::Stroke { colour: style::INK, width: 2.0, dash: style::DASHED };
        canvas.line(&self.0, dashed)?;
        canvas.polygon(&self.0, style::SKY, 0.5)
    }
}

#[test]
fn the_canvas_takes_any_coordinates() {
    for a in NASTY {
        for b in NASTY {
            survives("canvas", true, &Lines(vec![(a, b), (10.0, 20.0), (b, a), (50.0, 40.0)]));
        }
    }
    survives("canvas", true, &Lines(vec![]));
    // Dashes 9 on, 5 off along 84 pixels: six dashes.
    let text = to_svg_string(&Lines(vec![(0.0, 25.0), (84.0, 25.0)])).unwrap();
    assert_eq!(text.matches("<polyline").count(), 6);
}

#[test]
fn names_in_any_script_are_seen_in_a_png() {
    let ink = |name: &str| {
        let figure =
            coldplate_figures::chart::heat::HeatFigure { title: String::new(), sources: vec![(name.into(), 100.0)], ..Default::default() };
        let (pixels, _) = to_pixels(&figure).unwrap();
        pixels.chunks(3).filter(|p| p.iter().all(|b| *b < 60)).count()
    };
    let nothing = ink("");
    for name in ["двигатель", "κινητήρας", "电动机", "電動機モーター"] {
        assert!(ink(name) > nothing + 150, "{name} vanishes");
        let figure = coldplate_figures::chart::heat::HeatFigure { sources: vec![(name.into(), 1.0)], ..Default::default() };
        assert!(to_svg_string(&figure).unwrap().contains(name));
    }
}
