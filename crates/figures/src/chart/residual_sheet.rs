//! Residuals reading by reading: sensors down, conditions across, one sheet before and one after.

use super::Figure;
use super::canvas::{Canvas, CanvasText, PixelPoint, PixelSize, Stroke};
use super::fonts::{self, FontWeight};
use super::rows::NamedRows;
use super::style::{AXIS, BLUE, GRID, INK, MUTED, Rgb, STRIPE, VERMILLION, WHITE, fixed, number, size};
use super::title_and_footer::{MARGIN, Page};
use coldplate_base::error::{Error, Result};

/// Sheets of the same sensors and conditions, side by side where there is room.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ResidualSheet {
    /// Title.
    pub title: String,
    /// Names of the sensors.
    pub sensors: Vec<String>,
    /// Names of the conditions.
    pub conditions: Vec<String>,
    /// Heading of each sheet, and its values, sensor by sensor; not finite where nothing was read.
    pub sheets: Vec<(String, Vec<Vec<f64>>)>,
    /// Unit of the values: `K`, `standard deviations`.
    pub unit: String,
    /// Bounds of the value at which colours are full, which otherwise is the largest value.
    pub full: (f64, f64),
    /// Decimals of the numbers in the cells.
    pub decimals: usize,
    /// Lines for the footer.
    pub notes: Vec<String>,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 1000.0;
/// Space between sheets, CSS pixels. Chosen by eye.
const GAP: f64 = 22.0;
/// Height of a heading, CSS pixels. Chosen by eye.
const HEADING: f64 = 24.0;
/// Least height of a row, CSS pixels. Chosen by eye.
const ROW: f64 = 26.0;
/// Least width of a cell for sheets side by side, CSS pixels. Chosen by eye.
const NARROW: f64 = 20.0;
/// Largest width of a cell, CSS pixels. Chosen by eye.
const WIDEST: f64 = 130.0;
/// Least room for the heading of a sheet, CSS pixels. Chosen by eye.
const HEADING_WIDTH: f64 = 190.0;
/// Longest label under a column, CSS pixels. Chosen by eye.
const LABEL: f64 = 104.0;
/// Height of the scale of colours, CSS pixels. Chosen by eye.
const BAR: f64 = 44.0;

/// Blue below zero, vermillion above, white at zero; `t` from -1 to 1.
pub(crate) fn diverging(t: f64) -> Rgb {
    let end = if t < 0.0 { BLUE } else { VERMILLION };
    // Pale tones are told apart less easily than full ones: they get more of the range.
    let share = t.abs().clamp(0.0, 1.0).powf(0.8);
    let mix = |a: u8, b: u8| (f64::from(a) + share * (f64::from(b) - f64::from(a))).round() as u8;
    Rgb(mix(WHITE.0, end.0), mix(WHITE.1, end.1), mix(WHITE.2, end.2))
}

/// Layout of the figure.
struct Plan {
    rows: NamedRows,
    cell: f64,
    beside: bool,
    /// Height of the labels under a sheet, and the number of columns per label.
    labels: (f64, usize),
    upright: bool,
    /// Font size of the numbers, if they fit into all cells.
    text: Option<f64>,
}

impl ResidualSheet {
    fn page(&self) -> Page {
        Page::new(WIDTH, &self.title, "", &self.notes)
    }

    fn check(&self) -> Result<()> {
        let fits = |sheet: &Vec<Vec<f64>>| sheet.len() == self.sensors.len() && sheet.iter().all(|row| row.len() == self.conditions.len());
        if let Some((name, _)) = self.sheets.iter().find(|(_, sheet)| !fits(sheet)) {
            return Err(Error::input(format!("the sheet '{name}' has other rows or columns than there are sensors and conditions"))
                .at_key(self.title.clone()));
        }
        if !self.values().any(f64::is_finite) {
            return Err(Error::input("no reading has a residual to draw").at_key(self.title.clone()));
        }
        Ok(())
    }

    fn values(&self) -> impl Iterator<Item = f64> {
        self.sheets.iter().flat_map(|(_, sheet)| sheet.iter().flatten().copied())
    }

    fn limit(&self) -> f64 {
        let (least, most) = self.full;
        let least = if least.is_finite() && least > 0.0 { least } else { 1e-9 };
        let largest = self.values().filter(|v| v.abs() < 1e290).fold(least, |m, v| m.max(v.abs()));
        if most.is_finite() && most > least { largest.min(most) } else { largest }
    }

    fn plan(&self) -> Plan {
        let rows = NamedRows::new(self.sensors.iter().map(String::as_str), 210.0, ROW);
        let room = WIDTH - 2.0 * MARGIN - rows.names_width - 12.0;
        let (sheets, columns) = (self.sheets.len().max(1) as f64, self.conditions.len().max(1) as f64);
        let beside = (room - GAP * (sheets - 1.0)) / (sheets * columns);
        let is_beside = beside >= NARROW || sheets < 2.0;
        let cell = if is_beside { beside } else { room / columns }.min(WIDEST);
        let width = |l: &String| fonts::width(l, size::TICK, FontWeight::Regular);
        let widest = self.conditions.iter().map(width).fold(0.0, f64::max);
        let upright = widest > cell - 4.0;
        let every = if upright { (15.0 / cell).ceil().max(1.0) as usize } else { 1 };
        let height = if upright { widest.min(LABEL) + 12.0 } else { 22.0 };
        let numbers = self.values().filter(|v| v.is_finite()).map(|v| label(v, self.decimals));
        let widest = numbers.map(|l| fonts::width(&l, 12.0, FontWeight::Regular)).fold(0.0, f64::max);
        let text = [12.0, 11.0, 10.0, 9.0].into_iter().find(|text| widest * text / 12.0 + 3.0 <= cell);
        Plan { rows, cell, beside: is_beside, labels: (height, every), upright, text }
    }

    fn sheets_height(&self, plan: &Plan) -> f64 {
        let one = HEADING + plan.rows.height() + plan.labels.0;
        if plan.beside { one } else { one * self.sheets.len() as f64 + GAP * (self.sheets.len() as f64 - 1.0) }
    }

    fn paint_sheet(&self, canvas: &mut Canvas, plan: &Plan, which: usize, (left, top): PixelPoint) -> Result<()> {
        let (name, sheet) = &self.sheets[which];
        let limit = self.limit();
        let width = plan.cell * self.conditions.len() as f64;
        let title = fonts::fit(name, size::TICK, FontWeight::Bold, width.max(HEADING_WIDTH));
        canvas.text((left, top + HEADING - 9.0), &CanvasText::new(&title).size(size::TICK).bold())?;
        let top = top + HEADING;
        for (i, row) in sheet.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                let (x, y) = (left + plan.cell * j as f64, top + plan.rows.row * i as f64);
                let size = (plan.cell, plan.rows.row);
                if value.is_finite() {
                    paint_cell(canvas, (x, y), size, *value, CellLook { limit, text: plan.text, decimals: self.decimals })?
                } else {
                    paint_missing(canvas, (x, y), size)?
                }
            }
        }
        for i in 1..sheet.len() {
            let y = top + plan.rows.row * i as f64;
            canvas.line(&[(left, y), (left + width, y)], Stroke::solid(GRID, 1.0))?;
        }
        for j in 1..self.conditions.len() {
            let x = left + plan.cell * j as f64;
            canvas.line(&[(x, top), (x, top + plan.rows.height())], Stroke::solid(GRID, 1.0))?;
        }
        canvas.frame(left, top, width, plan.rows.height(), Stroke::solid(AXIS, 1.2))?;
        let bottom = top + plan.rows.height();
        for (j, label) in self.conditions.iter().enumerate().step_by(plan.labels.1) {
            let x = left + plan.cell * (j as f64 + 0.5);
            if plan.upright {
                let label = fonts::fit(label, size::TICK, FontWeight::Regular, LABEL);
                canvas.text((x + 0.36 * size::TICK, bottom + 6.0), &CanvasText::new(&label).size(size::TICK).end().upwards())?;
            } else {
                canvas.text((x, bottom + 17.0), &CanvasText::new(label).size(size::TICK).middle())?;
            }
        }
        Ok(())
    }

    fn paint_names(&self, canvas: &mut Canvas, plan: &Plan, top: f64) -> Result<()> {
        for (i, name) in self.sensors.iter().enumerate() {
            let lines = fonts::wrap(name, size::TICK, FontWeight::Regular, 210.0, 2);
            let first = top + plan.rows.row * (i as f64 + 0.5) + 0.36 * size::TICK - 8.0 * (lines.len().max(1) - 1) as f64;
            for (k, line) in lines.iter().enumerate() {
                let at = (MARGIN + plan.rows.names_width, first + 16.0 * k as f64);
                canvas.text(at, &CanvasText::new(line).size(size::TICK).end())?;
            }
        }
        Ok(())
    }

    /// The scale of colours.
    fn paint_scale(&self, canvas: &mut Canvas, (left, top): PixelPoint) -> Result<()> {
        /// Length of the scale of colours, CSS pixels. Chosen by eye.
        const LENGTH: f64 = 260.0;
        /// Number of colours in the scale. Chosen: enough to look smooth.
        const STEPS: usize = 52;
        let limit = self.limit();
        let (below, above) = ("reading below the model", "reading above the model");
        let text = |t: &'static str| CanvasText::new(t).size(size::FOOTER).colour(MUTED);
        let start = left + text(below).width() + 12.0;
        canvas.text((left, top + 15.0), &text(below))?;
        canvas.text((start + LENGTH + 12.0, top + 15.0), &text(above))?;
        for k in 0..STEPS {
            let t = 2.0 * (k as f64 + 0.5) / STEPS as f64 - 1.0;
            let step = LENGTH / STEPS as f64;
            canvas.rectangle(start + step * k as f64, top + 3.0, step + 0.6, 15.0, diverging(t), 1.0)?;
        }
        canvas.frame(start, top + 3.0, LENGTH, 15.0, Stroke::solid(AXIS, 1.0))?;
        let more = self.values().any(|v| v.is_finite() && v.abs() > limit * (1.0 + 1e-9));
        let beyond = if more { " and beyond" } else { "" };
        for (share, value) in [(0.0, -limit), (0.5, 0.0), (1.0, limit)] {
            let x = start + share * LENGTH;
            canvas.line(&[(x, top + 18.0), (x, top + 22.0)], Stroke::solid(AXIS, 1.0))?;
            let label =
                if value == 0.0 { "0".to_string() } else { format!("{}{beyond}", number(format!("{value:.1e}").parse().unwrap_or(value))) };
            canvas.text((x, top + 35.0), &CanvasText::new(&label).size(size::FOOTER).colour(MUTED).middle())?;
        }
        let at = start + LENGTH + 12.0 + text(above).width() + 16.0;
        let unit = fonts::fit(&format!("in {}", self.unit), size::FOOTER, FontWeight::Regular, (WIDTH - MARGIN - at).max(20.0));
        canvas.text((at, top + 15.0), &CanvasText::new(&unit).size(size::FOOTER).colour(MUTED))
    }
}

/// Text of a number in its cell.
fn label(value: f64, decimals: usize) -> String {
    if value.abs() >= 1e4 {
        return "…".into();
    }
    let digits = fixed(value, if value.abs() < 9.95 { decimals } else { decimals.saturating_sub(1) });
    if value > 0.0 && digits.chars().any(|c| matches!(c, '1'..='9')) { format!("+{digits}") } else { digits }
}

/// Look of the cells with values.
#[derive(Clone, Copy)]
struct CellLook {
    /// Absolute value at which colours are full.
    limit: f64,
    /// Font size of the numbers, CSS pixels; `None` in cells too small for a number.
    text: Option<f64>,
    decimals: usize,
}

fn paint_cell(canvas: &mut Canvas, (x, y): PixelPoint, (width, height): PixelSize, value: f64, look: CellLook) -> Result<()> {
    let CellLook { limit, text, decimals } = look;
    let colour = diverging(value / limit);
    canvas.rectangle(x, y, width, height, colour, 1.0)?;
    let ink = if colour.contrast(WHITE) > colour.contrast(INK) { WHITE } else { INK };
    if let Some(text) = text {
        let number = label(value, decimals);
        return canvas.text((x + width / 2.0, y + height / 2.0 + 0.36 * text), &CanvasText::new(&number).size(text).colour(ink).middle());
    }
    // Cells too small for a number have a sign, so that the two colours are told apart in a grey print as well.
    if value.abs() >= 0.3 * limit && width >= 6.0 {
        let (cx, cy, reach) = (x + width / 2.0, y + height / 2.0, (0.28 * width).min(4.0));
        let stroke = Stroke::solid(ink, 1.2);
        canvas.line(&[(cx - reach, cy), (cx + reach, cy)], stroke)?;
        if value > 0.0 {
            canvas.line(&[(cx, cy - reach), (cx, cy + reach)], stroke)?;
        }
    }
    Ok(())
}

fn paint_missing(canvas: &mut Canvas, (x, y): PixelPoint, (width, height): PixelSize) -> Result<()> {
    canvas.rectangle(x, y, width, height, STRIPE, 1.0)?;
    canvas.line(&[(x, y + height), (x + width, y)], Stroke::solid(GRID, 1.0))
}

impl Figure for ResidualSheet {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        self.check()?;
        let page = self.page();
        Ok((WIDTH, page.top() + self.sheets_height(&self.plan()) + 12.0 + BAR + page.bottom()))
    }

    fn is_on_white(&self) -> bool {
        true
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        self.check()?;
        let (page, plan) = (self.page(), self.plan());
        let start = MARGIN + plan.rows.names_width + 12.0;
        let one = HEADING + plan.rows.height() + plan.labels.0;
        for which in 0..self.sheets.len() {
            let at = if plan.beside {
                (start + which as f64 * ((plan.cell * self.conditions.len() as f64).max(HEADING_WIDTH) + GAP), page.top())
            } else {
                (start, page.top() + which as f64 * (one + GAP))
            };
            if which == 0 || !plan.beside {
                self.paint_names(canvas, &plan, at.1 + HEADING)?;
            }
            self.paint_sheet(canvas, &plan, which, at)?;
        }
        self.paint_scale(canvas, (MARGIN, page.top() + self.sheets_height(&plan) + 12.0))?;
        page.paint(canvas, self.size()?.1)
    }
}
