//! Flaws that readers of figures have seen: contradicting sums, mixed colours, seams, channels drawn through what hides them.

use coldplate_figures::chart::heat::HeatFigure;
use coldplate_figures::chart::machine::{Pipe, SurfacePiece};
use coldplate_figures::chart::sankey::{HeatTotal, SankeyFigure};
use coldplate_figures::chart::{Figure, to_svg_string};

use super::{samples, svg};

fn texts(figure: &dyn Figure) -> Vec<String> {
    svg::read(&to_svg_string(figure).unwrap()).into_iter().filter(|t| t.name == "text").map(|t| t.text).collect()
}

#[test]
fn a_wall_that_warms_the_machine_stands_among_the_heat_in() {
    let named = |name: &str, watts: f64| (name.to_string(), watts);
    let figure = HeatFigure {
        title: "heat".into(),
        sources: vec![named("motor", 20.0)],
        sinks: vec![named("water", 25.0), named("chamber wall", -5.0)],
        ..HeatFigure::default()
    };
    let texts = texts(&figure);
    for expected in ["20.0 W (80.0 %)", "5.00 W (20.0 %)", "25.0 W (100.0 %)", "In 25.0 W, out 25.0 W, difference 0.00 W"] {
        assert!(texts.iter().any(|text| text == expected), "{expected}: {texts:?}");
    }
    let place = |name: &str| texts.iter().position(|text| text == name).unwrap();
    assert!(place("chamber wall") < place("Heat out") && place("Heat out") < place("water"));
}

#[test]
fn heat_made_and_entering_adds_up_to_heat_leaving_as_it_is_shown() {
    let footer = |total: HeatTotal| {
        let figure = SankeyFigure { total, ..samples::sankey() };
        texts(&figure).into_iter().find(|text| text.starts_with("Made")).unwrap()
    };
    let words = footer(HeatTotal { made: 232.34, entering: 0.23, leaving: 232.57 });
    assert!(words.starts_with("Made 232.3 W, entering besides 0.3 W, leaving 232.6 W."), "{words}");
    let words = footer(HeatTotal { made: 232.34, entering: 0.01, leaving: 232.35 });
    assert!(words.starts_with("Made 232.3 W, leaving 232.3 W."), "{words}");
}

#[test]
fn bands_that_would_mix_to_grey_are_bars() {
    let mut figure = samples::one_factor();
    let areas = |figure: &dyn Figure| {
        let drawn = svg::read(&to_svg_string(figure).unwrap());
        drawn.iter().filter(|t| t.name == "polygon" && t.get("opacity") == Some("0.2")).count()
    };
    let curve = figure.curves[0].clone();
    figure.curves = vec![curve; 2];
    assert_eq!(areas(&figure), 2);
    figure.curves.push(figure.curves[0].clone());
    assert_eq!(areas(&figure), 0);
}

#[test]
fn areas_of_a_map_have_no_seams() {
    let drawn = svg::read(&to_svg_string(&samples::map()).unwrap());
    let is_tile = |t: &&svg::Tag| t.name == "polygon" && t.get("shape-rendering") == Some("crispEdges");
    let tiles: Vec<_> = drawn.iter().filter(is_tile).collect();
    assert!(tiles.len() > 100 && tiles.iter().all(|t| t.get("opacity").is_none()));
    // The ground of the page and the swatches of the legend adjoin nothing.
    assert!(drawn.iter().any(|t| t.name == "polygon" && t.get("shape-rendering").is_none()));
}

#[test]
fn a_body_in_front_hides_the_channel_of_another() {
    let mut figure = samples::machine();
    let front: Vec<SurfacePiece> = figure
        .pieces
        .iter()
        .cloned()
        .map(|piece| SurfacePiece { body: 1, corners: piece.corners.iter().map(|c| [c[0], c[1] - 0.3, c[2]]).collect(), ..piece })
        .collect();
    figure.pieces.extend(front);
    figure.pipes = vec![Pipe { bodies: vec![0], ..figure.pipes[0].clone() }];
    let drawn = svg::read(&to_svg_string(&figure).unwrap());
    let pipe = drawn.iter().position(|t| t.name == "polyline" && t.get("stroke") == Some("#56B4E9")).unwrap();
    let tiles: Vec<usize> = (0..drawn.len()).filter(|k| drawn[*k].get("shape-rendering").is_some()).collect();
    // Three faces of each body are seen; those of the front follow the channel. The scale of colours is tiled too.
    let bodies = &tiles[..6];
    assert!(bodies[2] < pipe && pipe < bodies[3], "{pipe}: {bodies:?}");
}
