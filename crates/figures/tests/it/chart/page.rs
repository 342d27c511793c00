//! The HTML report: stands alone, escapes every text, is well formed.

use coldplate_base::error::{Error, Result};
use coldplate_figures::chart::Figure;
use coldplate_figures::chart::canvas::Canvas;
use coldplate_figures::report::{Align, KeyFigure, Report, ReportTable, TableCell, Tone};

use super::{long::LONG, samples};

/// A report as a run assembles it.
pub fn report() -> Report {
    let mut report = Report::new("Five-axis machine in vacuum");
    report.subtitle("Sweep over coolant flow, coolant temperature, motor speed and ambient: 200 runs at 120,000 cells");
    report.footer("coldplate 0.1.0, machine five_axis.toml (sha256 3f1a90c2), 2026-11-21");
    report
        .section("Summary")
        .key_figures([
            KeyFigure::new("0.017 K", "largest error on 200 held-out conditions").tone(Tone::Good),
            KeyFigure::new("3e-11", "heat balance, relative").tone(Tone::Good),
            KeyFigure::new("-1.2 K", "Y bearing seat, predicted minus measured").tone(Tone::Bad),
            KeyFigure::new("142 s", "two threads"),
        ])
        .paragraph("The surrogate answers a query of 22 points. It covers every condition of the sweep.")
        .note(Tone::Uncertain, "14 of the machine's parameters are assumed; see below.");
    report.section("Conditions").facts([
        ("coolant flow", "2.4 to 18.8 L/min"),
        ("coolant temperature", "18 to 24 °C"),
        ("motor speed", "250 to 2500 rpm"),
        ("ambient temperature", "18 to 24 °C"),
    ]);
    let mut heat = ReportTable::new([("source or sink", Align::Left), ("heat [W]", Align::Right), ("share", Align::Right)]);
    heat.caption("At 2500 rpm, 9.42 L/min").row(["motor Y".into(), TableCell::number(113.7, 1), "65.3 %".into()]);
    heat.row(["reducer Y".into(), TableCell::number(51.2, 1), "29.4 %".into()]).total(["all".into(), TableCell::number(174.2, 1)]);
    report.section("Heat balance").table(heat).figure(&samples::heat(), "Where the heat goes.").unwrap();
    let mut measured = ReportTable::new([
        ("sensor", Align::Left),
        ("measured [°C]", Align::Right),
        ("predicted [°C]", Align::Right),
        ("verdict", Align::Centre),
    ]);
    measured.row([
        "Y bearing seat".into(),
        TableCell::number(26.6, 1),
        TableCell::number(25.43, 2),
        TableCell::from("off").tone(Tone::Bad),
    ]);
    measured.row([
        "Y motor water-cooling plate".into(),
        TableCell::number(20.9, 1),
        TableCell::number(20.62, 2),
        TableCell::from("within").tone(Tone::Good),
    ]);
    measured.row([
        "Z motor water-cooling plate (second entry)".into(),
        TableCell::number(21.1, 1),
        TableCell::optional(None, 2),
        TableCell::from("unknown").tone(Tone::Uncertain),
    ]);
    let section = report.section("Predicted beside measured");
    section.table(measured).figure(&samples::measured(), "Whole-machine test.").unwrap();
    let mut folded = ReportTable::new([("parameter", Align::Left), ("value", Align::Right), ("reason", Align::Left)]);
    folded.folded("All assumed numbers");
    for k in 0..20 {
        folded.row([format!("contact {k}").into(), "7.3 W/K".into(), "a bolted dry joint in vacuum; no measurement known".into()]);
    }
    report.section("What was assumed").list(["Emissivity of all outer surfaces 0.3.", "No residual gas at 1e-3 Pa."]).table(folded);
    let section = report.section("Charts");
    section.heading("Acceptability").figure(&samples::map(), "Which conditions are acceptable.").unwrap();
    section.heading("One factor at a time").figure(&samples::one_factor(), "").unwrap();
    report.section("Query").code("$ coldplate query machine.cps --coolant-flow \"9.42 L/min\" | less <x>\nacceptable, margin 1.3 K");
    report
}

/// Tags that close themselves in HTML.
const VOID: [&str; 1] = ["meta"];

/// Checks that every tag is closed in order; returns the names of all.
fn tags(html: &str) -> Vec<String> {
    let (mut open, mut all) = (Vec::<String>::new(), Vec::new());
    let mut rest = html.split_once("</style>").unwrap().1;
    while let Some((_, tag)) = rest.split_once('<') {
        let (inside, after) = tag.split_once('>').expect("a tag that does not end");
        rest = after;
        if let Some(name) = inside.strip_prefix('/') {
            let expected = open.pop();
            assert!(
                expected.as_deref() == Some(name) || (expected.is_none() && matches!(name, "head" | "html")),
                "{name} closes {expected:?}"
            );
        } else {
            let name = inside.split([' ', '/']).next().unwrap().to_string();
            if !inside.ends_with('/') && !VOID.contains(&name.as_str()) {
                open.push(name.clone());
            }
            all.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?}");
    all
}

#[test]
fn the_page_stands_alone_and_is_well_formed() {
    let html = report().to_html();
    let names = tags(&html);
    let count = |name: &str| names.iter().filter(|n| *n == name).count();
    assert_eq!((count("svg"), count("figcaption"), count("table"), count("section"), count("details")), (4, 3, 3, 7, 1));
    assert_eq!(count("script") + count("link") + count("img") + count("iframe"), 0);
    let named_space = "http://www.w3.org/2000/svg";
    assert_eq!(
        html.matches("http").count(),
        html.matches(named_space).count() + html.matches("http-equiv").count(),
        "an address outside the page"
    );
    assert!(!html.contains("url(") && !html.contains("@import"));
    // Every link of the contents leads to a section.
    let links: Vec<&str> = html.split("href=\"#").skip(1).map(|l| l.split('"').next().unwrap()).collect();
    assert_eq!(links.len(), 7);
    for link in links {
        assert_eq!(html.matches(&format!("id=\"{link}\"")).count(), 1, "{link}");
    }
}

#[test]
fn every_text_is_escaped() {
    let bad = "<script>alert(1)</script> & \"x\" 'y' \u{0}\u{1b}";
    let mut report = Report::new(bad);
    report.subtitle(bad).footer(bad);
    let mut table = ReportTable::new([(bad, Align::Left)]);
    table.row([bad.into(), "beyond the last column".into()]).row([]).caption(bad).folded(bad).total([bad.into()]);
    let section = report.section(bad);
    section.paragraph(bad).heading(bad).list([bad]).facts([(bad, bad)]).table(table).note(Tone::Bad, bad).code(bad).page(bad, bad);
    section.key_figures([KeyFigure::new(bad, bad)]).svg("<svg></svg>", bad);
    report.section("");
    report.section("");
    let html = report.to_html();
    tags(&html);
    assert!(!html.contains("<script") && !html.contains('\u{0}') && !html.contains('\u{1b}') && !html.contains("beyond"));
    assert_eq!(html.matches("&lt;script&gt;alert(1)&lt;/script&gt; &amp; &quot;x&quot; &#39;y&#39;").count(), 23);
    // Scripts are for the page in its frame alone.
    assert!(html.contains("script-src") && html.matches("<iframe").count() == 1);
}

#[test]
fn nothing_to_list_adds_nothing_and_a_bad_figure_is_refused() {
    struct Bad;
    impl Figure for Bad {
        fn title(&self) -> &str {
            LONG
        }
        fn size(&self) -> Result<(f64, f64)> {
            Err(Error::input("nothing to draw"))
        }
        fn paint(&self, _: &mut Canvas) -> Result<()> {
            Ok(())
        }
    }
    let mut report = Report::new("empty");
    let none: [String; 0] = [];
    let pairs: [(String, String); 0] = [];
    let section = report.section("nothing");
    section.list(none).facts(pairs).key_figures([]);
    assert!(section.figure(&Bad, "").is_err());
    let html = report.to_html();
    assert!(!html.contains("<ul>") && !html.contains("<dl>") && !html.contains("class=\"key\"") && !html.contains("<figure>"));
}

/// Colours of all texts, and whether the figure keeps its white ground.
fn inks(figure: &dyn Figure) -> (Vec<String>, bool) {
    let drawn = super::svg::read(&coldplate_figures::chart::to_svg_string(figure).unwrap());
    let inks = drawn.iter().filter(|t| t.name == "text").map(|t| t.get("fill").unwrap().to_string()).collect();
    (inks, drawn[0].get("class") == Some("on-white"))
}

#[test]
fn texts_of_figures_have_a_tone_on_a_dark_page() {
    let page = Report::new("empty").to_html();
    let figures: [&dyn Figure; 8] = [
        &samples::map(),
        &samples::one_factor(),
        &samples::parity(),
        &samples::heat(),
        &samples::sankey(),
        &samples::machine(),
        &samples::measured(),
        &samples::panels(),
    ];
    for figure in figures {
        let (inks, is_on_white) = inks(figure);
        assert!(!is_on_white, "{}", figure.title());
        for ink in inks {
            assert!(page.contains(&format!("[fill=\"{ink}\"]")), "{}: {ink}", figure.title());
        }
    }
    for (_, is_on_white) in [inks(&samples::sheet()), inks(&samples::residual_sheet(4))] {
        assert!(is_on_white, "dark ink on shades of white would go with the page");
    }
}

#[test]
fn a_figure_tells_its_width_to_the_style_sheet() {
    let mut report = Report::new("one figure");
    report.section("figure").figure(&samples::map(), "").unwrap().svg("<svg></svg>", "");
    let html = report.to_html();
    let (width, _) = samples::map().size().unwrap();
    assert!(html.contains(&format!("<figure style=\"--width:{width}\">")) && html.contains("min-width: calc(var(--width) * 0.6px)"));
}
