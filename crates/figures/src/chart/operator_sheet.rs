//! One A4 page for the wall beside the machine: the map, the smallest coolant flow as a table, the limits, and how to
//! read them. Map and table are set large enough to be read from two metres.

use super::Figure;
use super::acceptability::{AcceptabilityMap, CellState, Look, letter};
use super::axis::PlotFrame;
use super::canvas::{Canvas, CanvasText, PixelPoint, Stroke};
use super::fonts::{self, FontWeight};
use super::legend::{Swatch, paint_badge, paint_here, paint_swatch};
use super::regions::hatch_rectangle;
use super::style::{AXIS, GRID, INK, MUTED, Quantity, Rgb, STRIPE, WHITE, number};
use super::title_and_footer::fixed_conditions;
use coldplate_base::error::{Error, Result};

/// One cell of the table of smallest flows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FlowCell {
    /// Text of the cell: the flow, `any`, `none`.
    pub text: String,
    /// Verdict, which gives colour and pattern of the cell.
    pub state: CellState,
}

/// The smallest coolant flow for every pair of speed and coolant temperature.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FlowTable {
    /// Heading: the quantity, and the values of the variables that the table does not show, for example
    /// `Smallest coolant flow [L/min] whatever the ambient temperature from 18 to 28 °C`.
    pub title: String,
    /// The variable down the side.
    pub row: Quantity,
    /// Values of the row variable.
    pub rows: Vec<f64>,
    /// The variable along the top.
    pub column: Quantity,
    /// Values of the column variable.
    pub columns: Vec<f64>,
    /// Cells, row by row, `cells[r * columns.len() + c]`.
    pub cells: Vec<FlowCell>,
}

/// The sheet.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OperatorSheet {
    /// Name of the machine, in the largest letters.
    pub machine: String,
    /// A line under it.
    pub subtitle: String,
    /// One map, or two side by side. Their `limits` must be the sheet's, so that the letters agree.
    pub maps: Vec<AcceptabilityMap>,
    /// The table, if any.
    pub table: Option<FlowTable>,
    /// The limits: name and allowed value; lettered A, B, ... in this order.
    pub limits: Vec<(String, String)>,
    /// How to read the sheet, one sentence each.
    pub how_to_read: Vec<String>,
    /// Provenance of the sheet: program, machine file, date; small print.
    pub provenance: String,
}

/// Width of A4 upright at 96 pixels per inch, CSS pixels.
const WIDTH: f64 = 794.0;
/// Height of A4 upright at 96 pixels per inch, CSS pixels.
const HEIGHT: f64 = 1123.0;
/// Space at the edges, CSS pixels. Chosen by eye.
const EDGE: f64 = 30.0;
/// Height of the heading with the name of the machine, and of the space below it, CSS pixels. Chosen by eye.
const BAND: f64 = 96.0;
/// Font size of headings, CSS pixels. Chosen by eye.
const HEADING: f64 = 22.0;
/// Height of a line of a heading, CSS pixels. Chosen by eye.
const HEADING_LINE: f64 = 26.0;
/// Font size of the table's numbers, CSS pixels: capitals 4.8 mm high are 8 minutes of arc from two metres.
const LARGE: f64 = 25.0;
/// Font size of the key to the colours, CSS pixels. Chosen by eye.
const KEY: f64 = 23.0;
/// Font size of limits and subtitle, CSS pixels. Chosen by eye.
const MEDIUM: f64 = 17.0;
/// Font size of the explanation, CSS pixels. Chosen by eye.
const SMALL: f64 = 15.0;

/// Number of lines of the explanation that stay as long as limits can make room. Chosen: the held variables, and how to
/// take an uncertain verdict.
const EXPLAINED: usize = 4;

/// Heights of the parts from top to bottom.
struct Plan {
    map: f64,
    cell: f64,
    heading: Vec<String>,
    limits: Vec<Vec<String>>,
    more_limits: usize,
    reading: Vec<String>,
    provenance: Vec<String>,
}

impl OperatorSheet {
    fn room(&self) -> f64 {
        WIDTH - 2.0 * EDGE
    }

    fn check(&self) -> Result<()> {
        if self.maps.is_empty() && self.table.is_none() {
            return Err(Error::input("an operator sheet needs a map or a table").at_key(self.machine.clone()));
        }
        if self.maps.len() > 2 {
            return Err(Error::input("an operator sheet has room for two maps").at_key(self.machine.clone()).read(self.maps.len()));
        }
        for map in &self.maps {
            map.axes()?;
        }
        if let Some(table) = &self.table {
            let (rows, columns) = (table.rows.len(), table.columns.len());
            if rows == 0 || columns == 0 || table.cells.len() != rows * columns {
                return Err(Error::input("the table needs one cell per pair of values")
                    .at_key(table.title.clone())
                    .read(format!("{} cells, {rows} rows, {columns} columns", table.cells.len())));
            }
            if rows > 10 || columns > 9 {
                return Err(Error::input("the table is too large to be read from two metres")
                    .at_key(table.title.clone())
                    .read(format!("{rows} rows, {columns} columns"))
                    .help("give at most 10 rows and 9 columns"));
            }
        }
        Ok(())
    }

    fn plan(&self) -> Result<Plan> {
        self.check()?;
        let mut explained: Vec<Vec<String>> =
            self.how_to_read.iter().map(|t| fonts::wrap(t, SMALL, FontWeight::Regular, self.room(), 3)).collect();
        let provenance = fonts::wrap(&self.provenance, 11.0, FontWeight::Regular, self.room(), 2);
        let heading = self.table.as_ref().map_or(Vec::new(), |t| fonts::wrap(&t.title, HEADING, FontWeight::Bold, self.room(), 3));
        let column = self.room() / 2.0 - 44.0;
        let mut limits: Vec<Vec<String>> = self
            .limits
            .iter()
            .map(|(name, value)| fonts::wrap(&format!("{name}: {value}"), MEDIUM, FontWeight::Regular, column, 4))
            .collect();
        let mut more_limits = 0;
        loop {
            let reading = explained.concat();
            let above = 18.0 + HEADING_LINE * heading.len() as f64;
            let table = |cell: f64| self.table.as_ref().map_or(0.0, |t| above + (t.rows.len() as f64 + 2.0) * cell);
            let cell = if self.table.as_ref().is_some_and(|t| t.rows.len() > 6) { 29.0 } else { 34.0 };
            let rest = BAND
                + table(cell)
                + limits_height(&limits, more_limits)
                + if reading.is_empty() { 0.0 } else { 14.0 + 20.0 * reading.len() as f64 }
                + 14.0 * provenance.len() as f64
                + 34.0;
            let map = HEIGHT - rest;
            let least = if self.maps.is_empty() { 0.0 } else { 330.0 };
            if map >= least || (limits.len() <= 2 && explained.len() <= 1) {
                return Ok(Plan { map: map.clamp(least, 560.0), cell, heading, limits, more_limits, reading, provenance });
            }
            // If not all fits, the end of the explanation gives way first, a sentence at a time, then limits, then the rest of it.
            if limits.len() > 2 && reading.len() <= EXPLAINED {
                limits.pop();
                more_limits += 1;
            } else {
                explained.pop();
            }
        }
    }

    fn paint_band(&self, canvas: &mut Canvas) -> Result<()> {
        canvas.rectangle(0.0, 0.0, WIDTH, BAND - 8.0, INK, 1.0)?;
        let largest = (24..=46).rev().map(f64::from).find(|s| fonts::width(&self.machine, *s, FontWeight::Bold) <= self.room());
        let text = largest.unwrap_or(24.0);
        let name = fonts::fit(&self.machine, text, FontWeight::Bold, self.room());
        canvas.text((EDGE, 50.0), &CanvasText::new(&name).size(text).bold().colour(WHITE))?;
        let subtitle = fonts::fit(&self.subtitle, MEDIUM, FontWeight::Regular, self.room());
        canvas.text((EDGE, 76.0), &CanvasText::new(&subtitle).size(MEDIUM).colour(Rgb(225, 225, 225)))
    }

    /// The maps with their titles and the key to the colours; returns where the next part begins.
    fn paint_maps(&self, canvas: &mut Canvas, top: f64, height: f64) -> Result<f64> {
        if self.maps.is_empty() {
            return Ok(top);
        }
        let gap = 16.0;
        let width = (self.room() - gap * (self.maps.len() - 1) as f64) / self.maps.len() as f64;
        let (title, text) = if self.maps.len() == 1 { (HEADING, MEDIUM) } else { (MEDIUM, 15.0) };
        let line = title * 1.2;
        let fixed = |map: &AcceptabilityMap| fonts::wrap(&fixed_conditions(&map.fixed), text, FontWeight::Regular, width, 2);
        let titles = self.maps.iter().map(|m| fonts::wrap(&m.title, title, FontWeight::Bold, width, 2)).collect::<Vec<_>>();
        let above = line * titles.iter().map(Vec::len).max().unwrap_or(0) as f64 + 4.0;
        let below = 1.25 * text * self.maps.iter().map(|m| fixed(m).len()).max().unwrap_or(0) as f64;
        let here = self.maps.iter().any(|m| m.here.is_some());
        let key = if here { 62.0 } else { 40.0 };
        for (index, map) in self.maps.iter().enumerate() {
            let left = EDGE + (width + gap) * index as f64;
            for (k, words) in titles[index].iter().enumerate() {
                canvas.text((left, top + line * (k as f64 + 0.85)), &CanvasText::new(words).size(title).bold())?;
            }
            let (x, y) = map.axes()?;
            let frame = PlotFrame::with_text((left, top + above), (width, height - above - below - key), x, y, text);
            map.paint_inside(canvas, &frame, Look { label: text, badge: text * 0.85, is_on_sheet: true })?;
            frame.paint_axes(canvas)?;
            for (k, words) in fixed(map).iter().enumerate() {
                let base = top + height - key - below + 1.25 * text * (k as f64 + 0.9);
                canvas.text((left, base), &CanvasText::new(words).size(text).colour(MUTED))?;
            }
        }
        self.paint_key(canvas, top + height - key + 6.0)?;
        Ok(top + height)
    }

    fn paint_key(&self, canvas: &mut Canvas, top: f64) -> Result<()> {
        let here = self.maps.iter().find_map(|m| m.here.as_ref());
        if let Some(here) = here {
            let label = fonts::fit(&here.label, MEDIUM, FontWeight::Regular, self.room() - 30.0);
            paint_here(canvas, (EDGE + 10.0, top + 40.0), 7.0)?;
            canvas.text((EDGE + 26.0, top + 46.0), &CanvasText::new(&label).size(MEDIUM))?;
        }
        let mut x = EDGE;
        for state in [CellState::Acceptable, CellState::Uncertain, CellState::NotAcceptable] {
            let (colour, pattern) = state.look();
            paint_swatch(canvas, &Swatch::Area(colour, 1.0, pattern), (x, top + 12.0), 44.0, KEY)?;
            let text = CanvasText::new(state.name()).size(KEY).bold();
            canvas.text((x + 52.0, top + 20.0), &text)?;
            x += 52.0 + text.width() + 30.0;
        }
        Ok(())
    }

    fn paint_table(&self, canvas: &mut Canvas, table: &FlowTable, top: f64, plan: &Plan) -> Result<f64> {
        let cell = plan.cell;
        for (k, words) in plan.heading.iter().enumerate() {
            canvas.text((EDGE, top + 28.0 + HEADING_LINE * k as f64), &CanvasText::new(words).size(HEADING).bold())?;
        }
        let top = top + 12.0 + HEADING_LINE * plan.heading.len() as f64;
        let side = (0.26 * self.room()).min(190.0);
        let width = (self.room() - side) / table.columns.len() as f64;
        let across = fonts::fit(&table.column.label(), MEDIUM, FontWeight::Regular, self.room() - side);
        let middle = EDGE + side + 0.5 * (self.room() - side);
        canvas.text((middle, top + 0.5 * cell + 6.0), &CanvasText::new(&across).size(MEDIUM).middle())?;
        let down = fonts::wrap(&table.row.label(), MEDIUM, FontWeight::Regular, side - 10.0, 2);
        for (k, words) in down.iter().enumerate() {
            let base = top + 1.5 * cell + 7.0 + 20.0 * (k as f64 - (down.len() as f64 - 1.0));
            canvas.text((EDGE, base), &CanvasText::new(words).size(MEDIUM))?;
        }
        let head = top + cell;
        for (c, value) in table.columns.iter().enumerate() {
            self.paint_fitted(canvas, (EDGE + side + width * (c as f64 + 0.5), head + 0.5 * cell), &number(*value), width - 8.0)?;
        }
        for (r, value) in table.rows.iter().enumerate() {
            let y = head + cell * (r as f64 + 1.0);
            self.paint_fitted(canvas, (EDGE + side - 46.0, y + 0.5 * cell), &number(*value), 82.0)?;
            for c in 0..table.columns.len() {
                let Some(content) = table.cells.get(r * table.columns.len() + c) else { continue };
                let x = EDGE + side + width * c as f64;
                let (colour, pattern) = content.state.look();
                canvas.rectangle(x, y, width, cell, colour, 1.0)?;
                hatch_rectangle(canvas, (x, y), (width, cell), pattern, colour)?;
                canvas.frame(x, y, width, cell, Stroke::solid(WHITE, 2.0))?;
                let size = shrunk(&content.text, width - 12.0);
                let words = fonts::fit(&content.text, size, FontWeight::Bold, width - 10.0);
                let text = CanvasText::new(&words).size(size).bold();
                if content.state != CellState::Acceptable && !words.is_empty() {
                    let plate = text.width() + 10.0;
                    canvas.rectangle(x + 0.5 * (width - plate), y + 0.14 * cell, plate, 0.72 * cell, colour, 1.0)?;
                }
                canvas.text((x + 0.5 * width, y + 0.5 * cell + 0.36 * size), &text.middle())?;
            }
        }
        Ok(head + cell * (table.rows.len() as f64 + 1.0) + 6.0)
    }

    fn paint_fitted(&self, canvas: &mut Canvas, (x, y): PixelPoint, words: &str, limit: f64) -> Result<()> {
        let size = shrunk(words, limit);
        let words = fonts::fit(words, size, FontWeight::Bold, limit);
        canvas.text((x, y + 0.36 * size), &CanvasText::new(&words).size(size).bold().middle())
    }

    fn paint_limits(&self, canvas: &mut Canvas, plan: &Plan, top: f64) -> Result<f64> {
        if plan.limits.is_empty() {
            return Ok(top);
        }
        canvas.text((EDGE, top + 26.0), &CanvasText::new("Limits").size(HEADING).bold())?;
        let column = self.room() / 2.0;
        let half = plan.limits.len().div_ceil(2);
        let mut bottom = top + 36.0;
        for (side, part) in plan.limits.chunks(half.max(1)).enumerate() {
            let x = EDGE + column * side as f64;
            let mut y = top + 36.0;
            for (k, lines) in part.iter().enumerate() {
                paint_badge(canvas, (x + 13.0, y + 11.0), &letter(side * half + k), 11.0)?;
                for (row, words) in lines.iter().enumerate() {
                    canvas.text((x + 34.0, y + 17.0 + 21.0 * row as f64), &CanvasText::new(words).size(MEDIUM))?;
                }
                y += 21.0 * lines.len().max(1) as f64 + 5.0;
            }
            bottom = bottom.max(y);
        }
        if plan.more_limits > 0 {
            let more = format!("and {} more, see the report", plan.more_limits);
            canvas.text((EDGE + 34.0, bottom + 14.0), &CanvasText::new(&more).size(SMALL).colour(MUTED))?;
            bottom += 20.0;
        }
        Ok(bottom)
    }
}

/// The largest font size up to that of the table at which the words fit.
fn shrunk(words: &str, limit: f64) -> f64 {
    let width = fonts::width(&fonts::one_line(words), LARGE, FontWeight::Bold).max(1.0);
    (LARGE * limit / width).clamp(14.0, LARGE)
}

fn limits_height(limits: &[Vec<String>], more: usize) -> f64 {
    if limits.is_empty() {
        return 0.0;
    }
    let half = limits.len().div_ceil(2);
    let column = |part: &[Vec<String>]| part.iter().map(|l| 21.0 * l.len().max(1) as f64 + 5.0).sum::<f64>();
    36.0 + limits.chunks(half).map(column).fold(0.0, f64::max) + if more > 0 { 20.0 } else { 0.0 }
}

impl Figure for OperatorSheet {
    fn title(&self) -> &str {
        &self.machine
    }

    fn size(&self) -> Result<(f64, f64)> {
        self.check()?;
        Ok((WIDTH, HEIGHT))
    }

    fn is_on_white(&self) -> bool {
        true
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let plan = self.plan()?;
        self.paint_band(canvas)?;
        let mut y = self.paint_maps(canvas, BAND, plan.map)?;
        if let Some(table) = &self.table {
            y = self.paint_table(canvas, table, y, &plan)?;
        }
        y = self.paint_limits(canvas, &plan, y)?;
        if !plan.reading.is_empty() {
            let height = 20.0 * plan.reading.len() as f64 + 8.0;
            canvas.rectangle(EDGE - 8.0, y + 4.0, self.room() + 16.0, height, STRIPE, 1.0)?;
            for (k, line) in plan.reading.iter().enumerate() {
                canvas.text((EDGE, y + 22.0 + 20.0 * k as f64), &CanvasText::new(line).size(SMALL))?;
            }
        }
        let foot = HEIGHT - 14.0 * plan.provenance.len() as f64 - 12.0;
        canvas.line(&[(EDGE, foot), (WIDTH - EDGE, foot)], Stroke::solid(if plan.provenance.is_empty() { WHITE } else { GRID }, 1.0))?;
        for (k, line) in plan.provenance.iter().enumerate() {
            canvas.text((EDGE, foot + 13.0 + 13.0 * k as f64), &CanvasText::new(line).size(11.0).colour(AXIS))?;
        }
        Ok(())
    }
}
