//! The page as HTML.

use std::fmt::Write as _;

use super::{Align, Block, KeyFigure, Report, ReportSection, ReportTable, TableCell, Tone};
use crate::chart::escape;

/// Style sheet of the page.
const STYLE: &str = include_str!("style.css");

/// The whole page.
pub fn page(report: &Report) -> String {
    let mut out = String::new();
    let title = text(&report.title);
    // Forbid scripts and requests, even if a text were not escaped; a frame has the policy of the whole.
    let has_page = report.sections.iter().any(|section| holds_page(&section.blocks));
    let scripts = if has_page { " script-src 'unsafe-inline';" } else { "" };
    let policy = format!("default-src 'none';{scripts} style-src 'unsafe-inline'; img-src data:");
    let _ = write!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<header>\n<h1>{title}</h1>\n"
    );
    if !report.subtitle.is_empty() {
        let _ = writeln!(out, "<p>{}</p>", text(&report.subtitle));
    }
    out.push_str("</header>\n");
    if report.sections.len() > 2 {
        out.push_str("<nav aria-label=\"Contents\">\n");
        for (index, section) in report.sections.iter().enumerate() {
            let _ = writeln!(out, "<a href=\"#{}\">{}</a>", anchor(index, section), text(&section.title));
        }
        out.push_str("</nav>\n");
    }
    out.push_str("<main>\n");
    for (index, section) in report.sections.iter().enumerate() {
        let _ = write!(out, "<section id=\"{}\">\n<h2>{}</h2>\n", anchor(index, section), text(&section.title));
        pieces(&mut out, &section.blocks);
        out.push_str("</section>\n");
    }
    out.push_str("</main>\n");
    if !report.footer.is_empty() {
        let _ = writeln!(out, "<footer>{}</footer>", text(&report.footer));
    }
    out.push_str("</body>\n</html>\n");
    out
}

/// Whether there is a page in a frame.
fn holds_page(blocks: &[Block]) -> bool {
    blocks.iter().any(|block| match block {
        Block::Page { .. } => true,
        Block::Folded(_, inner) => holds_page(inner),
        _ => false,
    })
}

/// A text ready for the page; control characters other than line ends are dropped.
fn text(raw: &str) -> String {
    let kept: String = raw.chars().filter(|c| !c.is_control() || matches!(c, '\n' | '\t')).collect();
    escape(&kept)
}

/// A name for the section that can stand in a link, the same in every run.
fn anchor(index: usize, section: &ReportSection) -> String {
    let words: String = section.title.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect();
    let words: Vec<&str> = words.split('-').filter(|w| !w.is_empty()).collect();
    format!("s{}-{}", index + 1, words.join("-"))
}

/// The pieces in their order; figures that follow each other stand side by side where there is room.
fn pieces(out: &mut String, blocks: &[Block]) {
    let is_figure = |b: &Block| matches!(b, Block::Svg { .. });
    for run in blocks.chunk_by(|a, b| is_figure(a) && is_figure(b)) {
        if run.len() > 1 {
            out.push_str("<div class=\"figures\">\n");
        }
        run.iter().for_each(|piece| block(out, piece));
        if run.len() > 1 {
            out.push_str("</div>\n");
        }
    }
}

fn block(out: &mut String, block: &Block) {
    match block {
        Block::Heading(words) => {
            let _ = writeln!(out, "<h3>{}</h3>", text(words));
        }
        Block::Paragraph(words) => {
            let _ = writeln!(out, "<p>{}</p>", text(words));
        }
        Block::List(points) => {
            out.push_str("<ul>\n");
            for point in points {
                let _ = writeln!(out, "<li>{}</li>", text(point));
            }
            out.push_str("</ul>\n");
        }
        Block::Facts(facts) => {
            out.push_str("<dl>\n");
            for (name, value) in facts {
                let _ = writeln!(out, "<dt>{}</dt><dd>{}</dd>", text(name), text(value));
            }
            out.push_str("</dl>\n");
        }
        Block::Table(table) => folded_table(out, table),
        Block::Lead(tone, words) => {
            let _ = writeln!(out, "<p class=\"lead {}\">{}</p>", class(*tone), text(words));
        }
        Block::Svg { markup, caption } => {
            // The style sheet scales a figure by its own width, so that its texts stay legible.
            let _ = writeln!(out, "<figure style=\"--width:{}\">\n{}", own_width(markup), markup.trim());
            if !caption.is_empty() {
                let _ = writeln!(out, "<figcaption>{}</figcaption>", text(caption));
            }
            out.push_str("</figure>\n");
        }
        Block::KeyFigures(figures) => key_figures(out, figures),
        Block::Note(tone, words) => {
            let _ = writeln!(out, "<p class=\"note {}\">{}</p>", class(*tone), text(words));
        }
        Block::Folded(summary, blocks) => {
            let _ = writeln!(out, "<details>\n<summary>{}</summary>", text(summary));
            pieces(out, blocks);
            out.push_str("</details>\n");
        }
        Block::Page { html, title } => {
            let _ = writeln!(out, "<iframe class=\"page\" title=\"{}\" srcdoc=\"{}\"></iframe>", text(title), text(html));
        }
        Block::Code(words) => {
            let _ = writeln!(out, "<pre tabindex=\"0\"><code>{}</code></pre>", text(words));
        }
    }
}

/// Width of a figure as its markup states it, CSS pixels; that of a page where it states none.
fn own_width(markup: &str) -> u32 {
    let stated = markup.split_once("width=\"").and_then(|(_, rest)| rest.split_once('"'));
    stated.and_then(|(width, _)| width.parse::<f64>().ok()).map_or(960, |width| width.round() as u32)
}

fn key_figures(out: &mut String, figures: &[KeyFigure]) {
    out.push_str("<div class=\"key\">\n");
    for KeyFigure { value, meaning, tone } in figures {
        let _ = writeln!(out, "<div class=\"{}\"><b>{}</b><span>{}</span></div>", class(*tone), text(value), text(meaning));
    }
    out.push_str("</div>\n");
}

fn folded_table(out: &mut String, table: &ReportTable) {
    match &table.folded {
        Some(summary) => {
            let _ = writeln!(out, "<details>\n<summary>{}</summary>", text(summary));
            plain_table(out, table);
            out.push_str("</details>\n");
        }
        None => plain_table(out, table),
    }
}

fn plain_table(out: &mut String, table: &ReportTable) {
    // Wide tables scroll by themselves instead of widening the page, by keyboard too.
    out.push_str("<div class=\"wide\" tabindex=\"0\"><table>\n");
    if !table.caption.is_empty() {
        let _ = writeln!(out, "<caption>{}</caption>", text(&table.caption));
    }
    out.push_str("<thead><tr>");
    for (title, align) in &table.columns {
        let _ = write!(out, "<th scope=\"col\" class=\"{}\">{}</th>", side(*align), text(title));
    }
    out.push_str("</tr></thead>\n<tbody>\n");
    for row in &table.rows {
        cells(out, table, row);
    }
    out.push_str("</tbody>\n");
    if let Some(total) = &table.total {
        out.push_str("<tfoot>\n");
        cells(out, table, total);
        out.push_str("</tfoot>\n");
    }
    out.push_str("</table></div>\n");
}

fn cells(out: &mut String, table: &ReportTable, row: &[TableCell]) {
    out.push_str("<tr>");
    let empty = TableCell::default();
    for (index, (_, align)) in table.columns.iter().enumerate() {
        let cell = row.get(index).unwrap_or(&empty);
        let tone = if cell.tone == Tone::Plain { String::new() } else { format!(" {}", class(cell.tone)) };
        let _ = write!(out, "<td class=\"{}{tone}\">{}</td>", side(*align), text(&cell.text));
    }
    out.push_str("</tr>\n");
}

fn class(tone: Tone) -> &'static str {
    match tone {
        Tone::Plain => "plain",
        Tone::Good => "good",
        Tone::Uncertain => "uncertain",
        Tone::Bad => "bad",
    }
}

fn side(align: Align) -> &'static str {
    match align {
        Align::Left => "left",
        Align::Right => "right",
        Align::Centre => "centre",
    }
}
