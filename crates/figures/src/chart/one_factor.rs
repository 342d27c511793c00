//! Temperatures of several points over one variable: samples, fitted curves, 95 % bands and the printed formulas (the
//! counterpart of figures 18 to 21 of the paper).

use super::axis::{PlotAxis, PlotFrame};
use super::canvas::{Canvas, CanvasText, Stroke};
use super::fonts::{self, FontWeight};
use super::legend::{Swatch, paint_swatch};
use super::style::{AXIS, GRID, MUTED, Quantity, STRIPE, series, size};
use super::ticks::Range;
use super::title_and_footer::{MARGIN, Page, fixed_conditions};
use super::{Figure, style};
use coldplate_base::error::{Error, Result};

/// One point's samples and fit.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SampledCurve {
    /// Name of the measurement point.
    pub name: String,
    /// Samples `(x, y)`.
    pub samples: Vec<(f64, f64)>,
    /// The fitted function at rising `x`, close enough together to look smooth; may be empty.
    pub line: Vec<(f64, f64)>,
    /// Half width of the 95 % band, in the unit of `y`; 0 or not finite draws none.
    pub half_width: f64,
    /// Half width of the band at each place of `line` if it varies; else empty.
    pub half_widths: Vec<f64>,
    /// The formula as printed; may be empty.
    pub formula: String,
}

/// Several points over one variable.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OneFactorFigure {
    /// Title.
    pub title: String,
    /// The variable that runs.
    pub x: Quantity,
    /// Quantity that is plotted.
    pub y: Quantity,
    /// The points, in the order of the legend.
    pub curves: Vec<SampledCurve>,
    /// Subject of the bands, as `fit` or `machine`; may be empty. A band of the one says nothing of the other.
    pub band_of: String,
    /// The variables held, with their values.
    pub fixed: Vec<(Quantity, f64)>,
    /// More lines for the footer.
    pub notes: Vec<String>,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 960.0;
/// Height of the plot, CSS pixels. Chosen by eye.
const PLOT: f64 = 460.0;
/// Height of a line of the table, CSS pixels. Chosen by eye.
const LINE: f64 = 18.0;
/// Width of a sample, CSS pixels. Chosen by eye.
const SWATCH: f64 = 44.0;

/// Half width below which a surrogate or fit counts as exact, K. Chosen: no reading resolves it.
const EXACT: f64 = 1e-3;

impl SampledCurve {
    fn has_band(&self) -> bool {
        self.largest().is_finite() && self.largest() > 0.0
    }

    /// The largest half width of the curve's band.
    fn largest(&self) -> f64 {
        self.half_widths.iter().copied().fold(self.half_width, f64::max)
    }

    /// Half width of the curve's band at a place of the line.
    fn half_width_at(&self, place: usize) -> f64 {
        self.half_widths.get(place).copied().unwrap_or(self.half_width)
    }

    /// Sample of the curve in the table: a line, a marker or both, as it is drawn.
    fn swatch(&self, index: usize) -> Swatch {
        let style = series(index);
        match (self.line.is_empty(), self.samples.is_empty()) {
            (false, true) => Swatch::Line(style.colour, 2.2, style.dash),
            (true, false) => Swatch::Marker(style.marker, style.colour),
            _ => Swatch::Curve(style),
        }
    }
}

/// One row of the table under the plot.
struct Row {
    name: Vec<String>,
    formula: Vec<String>,
    band: String,
}

impl Row {
    fn height(&self) -> f64 {
        LINE * self.name.len().max(self.formula.len()).max(1) as f64 + 5.0
    }
}

impl OneFactorFigure {
    fn page(&self) -> Page {
        let mut footer = vec![fixed_conditions(&self.fixed), self.coinciding()];
        footer.retain(|line| !line.is_empty());
        footer.extend(self.notes.iter().cloned());
        Page::new(WIDTH, &self.title, "", &footer)
    }

    /// A note that names curves on top of each other, since only the last of them is seen.
    fn coinciding(&self) -> String {
        let range = |f: fn(f64, f64) -> f64, start: f64| {
            self.curves.iter().flat_map(|c| c.line.iter().chain(&c.samples)).map(|p| p.1).filter(|y| y.is_finite()).fold(start, f)
        };
        let same = 0.5 / PLOT * (range(f64::max, f64::NEG_INFINITY) - range(f64::min, f64::INFINITY));
        let near = |a: &[(f64, f64)], b: &[(f64, f64)]| {
            a.len() == b.len() && a.iter().zip(b).all(|(p, q)| p.0 == q.0 && (p.1 - q.1).abs() <= same)
        };
        let mut told = vec![false; self.curves.len()];
        let mut sets = Vec::new();
        for (i, curve) in self.curves.iter().enumerate() {
            let alike = |c: &SampledCurve| near(&c.line, &curve.line) && near(&c.samples, &curve.samples);
            let members: Vec<usize> = (i..self.curves.len()).filter(|k| !told[*k] && alike(&self.curves[*k])).collect();
            if members.len() > 1 {
                members.iter().for_each(|k| told[*k] = true);
                sets.push(members.iter().map(|k| self.curves[*k].name.as_str()).collect::<Vec<_>>().join(" = "));
            }
        }
        if sets.is_empty() { String::new() } else { format!("Curves that coincide: {}", sets.join("; ")) }
    }

    fn has_formulas(&self) -> bool {
        self.curves.iter().any(|c| !c.formula.is_empty())
    }

    fn has_bands(&self) -> bool {
        self.curves.iter().any(SampledCurve::has_band)
    }

    /// Left edges of the columns: name, formula, band.
    fn columns(&self) -> (f64, f64, f64) {
        let widest = self.curves.iter().map(|c| fonts::width(&c.name, size::TICK, FontWeight::Regular)).fold(60.0, f64::max);
        let name = MARGIN + SWATCH + 12.0;
        (name, name + widest.min(270.0) + 22.0, WIDTH - MARGIN - 92.0)
    }

    fn rows(&self) -> Vec<Row> {
        let (name, mut formula, band) = self.columns();
        if !self.has_formulas() {
            // Names have the room of the column that is left out.
            formula = band;
        }
        let unit = style::unit_symbol(&self.y.unit).replace("°C", "K");
        self.curves
            .iter()
            .map(|c| Row {
                name: fonts::wrap(&c.name, size::TICK, FontWeight::Regular, formula - name - 20.0, 2),
                formula: fonts::wrap(&c.formula, size::TICK, FontWeight::Regular, band - formula - 16.0, 4),
                band: if !c.has_band() {
                    "–".into()
                } else if c.largest() < EXACT {
                    fonts::fit(&format!("< {} {unit}", style::number(EXACT)), size::TICK, FontWeight::Regular, 92.0)
                } else {
                    fonts::fit(&band_text(c, &unit), size::TICK, FontWeight::Regular, 92.0)
                },
            })
            .collect()
    }

    fn table_height(&self) -> f64 {
        26.0 + self.rows().iter().map(Row::height).sum::<f64>() + 8.0
    }

    fn frame(&self, page: &Page) -> Result<PlotFrame> {
        let (mut xs, mut ys) = (Vec::new(), Vec::new());
        for curve in &self.curves {
            let half = |place: usize| Some(curve.half_width_at(place)).filter(|half| half.is_finite()).map_or(0.0, |half| half.max(0.0));
            let finite = |p: &&(f64, f64)| p.0.is_finite() && p.1.is_finite();
            for (x, y) in curve.samples.iter().filter(finite) {
                xs.push(*x);
                ys.push(*y);
            }
            for (place, (x, y)) in curve.line.iter().enumerate().filter(|(_, p)| finite(p)) {
                xs.push(*x);
                ys.extend([*y - half(place), *y + half(place)]);
            }
        }
        let (Some(x), Some(y)) = (Range::of(xs), Range::of(ys)) else {
            return Err(Error::input("no curve has a sample or a fitted value to draw")
                .at_key(self.title.clone())
                .help("give at least one curve with a finite value"));
        };
        let (x, y) = (PlotAxis::linear(self.x.label(), x.padded(0.025)), PlotAxis::linear(self.y.label(), y.padded(0.05)));
        Ok(PlotFrame::inside((MARGIN, page.top()), (page.room(), PLOT), x, y))
    }

    fn paint_data(&self, canvas: &mut Canvas, frame: &PlotFrame) -> Result<()> {
        let is_crowded = self.is_crowded();
        for (index, curve) in self.curves.iter().enumerate() {
            if !curve.has_band() {
                continue;
            }
            if is_crowded {
                self.paint_bar(canvas, frame, index)?;
                continue;
            }
            let places: Vec<(f64, f64, f64)> =
                curve.line.iter().enumerate().map(|(place, (x, y))| (*x, *y, curve.half_width_at(place))).collect();
            for part in places.split(|p| !(p.0.is_finite() && p.1.is_finite() && p.2.is_finite())) {
                let above = part.iter().map(|(x, y, half)| frame.at(*x, y + half));
                let below = part.iter().rev().map(|(x, y, half)| frame.at(*x, y - half));
                canvas.polygon(&above.chain(below).collect::<Vec<_>>(), series(index).colour, 0.2)?;
            }
        }
        for (index, curve) in self.curves.iter().enumerate() {
            let style = series(index);
            let places: Vec<_> = curve.line.iter().map(|(x, y)| frame.at(*x, *y)).collect();
            canvas.line(&places, Stroke { colour: style.colour, width: 2.0, dash: style.dash })?;
        }
        for (index, curve) in self.curves.iter().enumerate() {
            let style = series(index);
            for (x, y) in &curve.samples {
                canvas.marker(frame.at(*x, *y), style.marker, 4.2, style.colour)?;
            }
        }
        Ok(())
    }

    /// Whether three bands or more lie over each other somewhere: their colours would mix to one grey.
    fn is_crowded(&self) -> bool {
        let banded: Vec<&SampledCurve> = self.curves.iter().filter(|c| c.has_band()).collect();
        let longest = banded.iter().map(|c| c.line.len()).max().unwrap_or(0);
        let ends = |place: usize| {
            let end = |c: &&SampledCurve| c.line.get(place).map(|(_, y)| (y - c.half_width_at(place), y + c.half_width_at(place)));
            banded.iter().filter_map(end).collect::<Vec<_>>()
        };
        (0..longest).map(ends).any(|ends| ends.iter().any(|(low, _)| ends.iter().filter(|(from, to)| from <= low && low < to).count() > 2))
    }

    /// The band of a curve as a bar at one place of its line; the bars of a figure stand side by side.
    fn paint_bar(&self, canvas: &mut Canvas, frame: &PlotFrame, index: usize) -> Result<()> {
        let curve = &self.curves[index];
        let place = (index + 1) * curve.line.len() / (self.curves.len() + 1);
        let Some((x, y)) = curve.line.get(place).copied() else { return Ok(()) };
        let half = curve.half_width_at(place);
        let ((across, high), (_, low)) = (frame.at(x, y + half), frame.at(x, y - half));
        let stroke = Stroke::solid(series(index).colour, 1.6);
        canvas.line(&[(across, high), (across, low)], stroke)?;
        for end in [high, low] {
            canvas.line(&[(across - 6.0, end), (across + 6.0, end)], stroke)?;
        }
        canvas.marker((across, frame.at(x, y).1), series(index).marker, 4.2, series(index).colour)
    }

    fn paint_table(&self, canvas: &mut Canvas, top: f64) -> Result<()> {
        let (name, formula, _) = self.columns();
        let right = WIDTH - MARGIN;
        let heading = |text| CanvasText::new(text).size(size::TICK).bold().colour(MUTED);
        canvas.text((name, top + 15.0), &heading("point"))?;
        if self.has_formulas() {
            canvas.text((formula, top + 15.0), &heading("fitted function"))?;
        }
        if self.has_bands() {
            let of = if self.band_of.is_empty() { String::new() } else { format!(" of the {}", self.band_of) };
            canvas.text((right, top + 15.0), &heading(&format!("95 % band{of}")).end())?;
        }
        canvas.line(&[(MARGIN, top + 22.0), (right, top + 22.0)], Stroke::solid(AXIS, 1.0))?;
        let mut y = top + 24.0;
        for (index, row) in self.rows().iter().enumerate() {
            if index % 2 == 1 {
                canvas.rectangle(MARGIN, y, right - MARGIN, row.height(), STRIPE, 1.0)?;
            }
            let base = |lines: usize, k: usize| y + 0.5 * row.height() + 0.36 * size::TICK + LINE * (k as f64 - 0.5 * (lines as f64 - 1.0));
            paint_swatch(canvas, &self.curves[index].swatch(index), (MARGIN + 4.0, y + 0.5 * row.height()), SWATCH, size::TICK)?;
            for (k, line) in row.name.iter().enumerate() {
                canvas.text((name, base(row.name.len(), k)), &CanvasText::new(line).size(size::TICK))?;
            }
            for (k, line) in row.formula.iter().enumerate() {
                canvas.text((formula, base(row.formula.len(), k)), &CanvasText::new(line).size(size::TICK))?;
            }
            if self.has_bands() {
                canvas.text((right, base(1, 0)), &CanvasText::new(&row.band).size(size::TICK).end())?;
            }
            y += row.height();
        }
        canvas.line(&[(MARGIN, y + 1.0), (right, y + 1.0)], Stroke::solid(GRID, 1.0))
    }
}

/// The band in words: from the smallest half width to the largest if they differ.
fn band_text(curve: &SampledCurve, unit: &str) -> String {
    let least = curve.half_widths.iter().copied().fold(curve.largest(), f64::min);
    let (least, most) = (significant(least), significant(curve.largest()));
    if least == most { format!("±{most} {unit}") } else { format!("±{least}–{most} {unit}") }
}

/// Two significant digits, as half widths are written.
fn significant(value: f64) -> String {
    let decimals = (1.0 - value.log10().floor()).clamp(0.0, 8.0) as usize;
    if value > 1e-7 { style::fixed(value, decimals) } else { style::number(value) }
}

impl Figure for OneFactorFigure {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        let page = self.page();
        self.frame(&page)?;
        Ok((WIDTH, page.top() + PLOT + 10.0 + self.table_height() + page.bottom()))
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let page = self.page();
        let frame = self.frame(&page)?;
        frame.paint_grid(canvas)?;
        self.paint_data(canvas, &frame)?;
        frame.paint_axes(canvas)?;
        self.paint_table(canvas, page.top() + PLOT + 10.0)?;
        page.paint(canvas, self.size()?.1)
    }
}
