//! Map of acceptable conditions over any two variables: the three verdicts as areas told apart by colour, lightness
//! and hatching, the margin to the binding limit as contour lines, and the limit that binds named in each area.

use statrs::distribution::{ContinuousCDF, Normal};

use super::Figure;
use super::axis::{PlotAxis, PlotFrame};
use super::canvas::{Canvas, PixelPoint, Stroke};
use super::contour::{ValueGrid, around};
use super::legend::{Legend, Swatch, paint_badge, paint_here};
use super::levels::{self, ContourLevel};
use super::regions::{Hatch, Zone, fill_positive, hatch, zones};
use super::style::{ACCEPTABLE, Dash, INK, NOT_ACCEPTABLE, Quantity, Rgb, UNCERTAIN, fixed, unit_symbol};
use super::ticks::{Range, linear};
use super::title_and_footer::{MARGIN, Page, fixed_conditions};
use coldplate_base::error::{Error, Result};

/// Verdict on a condition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CellState {
    /// Every limit is kept, the band included.
    Acceptable,
    /// Too close to call, or outside the fitted range.
    #[default]
    Uncertain,
    /// A limit is broken, the band included.
    NotAcceptable,
}

impl CellState {
    /// Colour and pattern of its area.
    pub fn look(self) -> (Rgb, Hatch) {
        match self {
            Self::Acceptable => (ACCEPTABLE, Hatch::Plain),
            Self::Uncertain => (UNCERTAIN, Hatch::Rising),
            Self::NotAcceptable => (NOT_ACCEPTABLE, Hatch::Falling),
        }
    }

    /// Name of the verdict.
    pub fn name(self) -> &'static str {
        match self {
            Self::Acceptable => "acceptable",
            Self::Uncertain => "uncertain",
            Self::NotAcceptable => "not acceptable",
        }
    }
}

/// One condition to be marked.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MarkedCondition {
    /// Horizontal value.
    pub x: f64,
    /// Vertical value.
    pub y: f64,
    /// Label of the condition.
    pub label: String,
}

/// Verdicts over two variables. Values per node lie at `[j * x_values.len() + i]`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AcceptabilityMap {
    /// Title.
    pub title: String,
    /// Horizontal variable.
    pub x: Quantity,
    /// Vertical variable.
    pub y: Quantity,
    /// Rising values of the horizontal variable; about 80 give smooth borders.
    pub x_values: Vec<f64>,
    /// Rising values of the vertical variable.
    pub y_values: Vec<f64>,
    /// Margin of the binding limit per node, positive where the limit is kept; NaN where unknown.
    pub margin: Vec<f64>,
    /// Unit of the margin.
    pub margin_unit: String,
    /// Half width of the margin's band per node, which places the borders of the uncertain area
    /// between nodes; may be empty, the borders then run half-way between nodes.
    pub half_width: Vec<f64>,
    /// Probability per node that all limits are kept; if given, its contour lines are drawn instead of the margin's.
    pub probability: Vec<f64>,
    /// Verdict per node.
    pub state: Vec<CellState>,
    /// Binding limit per node, an index into `limits`; larger indices mean none.
    pub binding: Vec<usize>,
    /// The limits as they are to be read, `motor shell at most 40 °C`.
    pub limits: Vec<String>,
    /// The variables held, with their values.
    pub fixed: Vec<(Quantity, f64)>,
    /// A condition to be marked.
    pub here: Option<MarkedCondition>,
    /// More lines for the footer.
    pub notes: Vec<String>,
}

/// Sizes of labels and badges inside a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Look {
    /// Font size of contour labels, CSS pixels.
    pub label: f64,
    /// Radius of the letters' circles, CSS pixels.
    pub badge: f64,
    /// Whether the map is one of a sheet, without contours other than zero and with the letters of the sheet.
    pub is_on_sheet: bool,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 980.0;
/// Width of the plot, CSS pixels. Chosen by eye.
const PLOT_WIDTH: f64 = 668.0;
/// Height of the plot, CSS pixels. Chosen by eye.
const PLOT: f64 = 500.0;
/// Dash of the border between areas with different binding limits, CSS pixels. Chosen by eye.
const BINDING_BORDER: Dash = &[3.0, 3.5];

/// Probabilities whose contour lines are drawn, dimensionless. Chosen: the verdicts' 0.05 and 0.95, and steps around
/// them.
const PROBABILITIES: [f64; 7] = [0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99];

/// The letter of a limit: A to Z, then A1, B1, ...
pub fn letter(index: usize) -> String {
    let first = char::from(b'A' + (index % 26) as u8);
    if index < 26 { first.to_string() } else { format!("{first}{}", index / 26) }
}

impl AcceptabilityMap {
    fn margins(&self) -> Result<ValueGrid> {
        let grid =
            ValueGrid::new(self.x_values.clone(), self.y_values.clone(), self.margin.clone()).map_err(|e| e.at_key(self.title.clone()))?;
        let nodes = grid.z.len();
        for (name, length) in [("state", self.state.len()), ("binding", self.binding.len())] {
            if length != nodes {
                return Err(Error::input(format!("a map needs one {name} per node")).at_key(self.title.clone()).read(length));
            }
        }
        if !(self.probability.is_empty() || self.probability.len() == nodes) {
            return Err(Error::input("a map needs one probability per node, or none at all").at_key(self.title.clone()));
        }
        if !(self.half_width.is_empty() || self.half_width.len() == nodes) {
            return Err(Error::input("a map needs one half width per node, or none at all").at_key(self.title.clone()));
        }
        if !grid.z.iter().any(|m| m.is_finite()) {
            return Err(Error::input("no node of the map has a known margin").at_key(self.title.clone()));
        }
        Ok(grid)
    }

    /// A function per node that is positive where the verdict is `wanted`. Its sign at the nodes is the verdict there; margin and
    /// band place the border between nodes.
    pub fn signed(&self, wanted: CellState) -> Vec<f64> {
        let direction = if wanted == CellState::NotAcceptable { -1.0 } else { 1.0 };
        let node = |(k, margin): (usize, &f64)| {
            let is = self.state.get(k) == Some(&wanted);
            let size = match self.half_width.get(k) {
                Some(half) if half.is_finite() => (direction * margin - half).abs().max(1e-9),
                _ => 1.0,
            };
            if margin.is_finite() { if is { size } else { -size } } else { f64::NAN }
        };
        self.margin.iter().enumerate().map(node).collect()
    }

    /// Two functions: positive where acceptable, positive where not acceptable.
    fn borders(&self, margins: &ValueGrid) -> (ValueGrid, ValueGrid) {
        let of = |wanted: CellState| ValueGrid { z: self.signed(wanted), ..margins.clone() };
        (of(CellState::Acceptable), of(CellState::NotAcceptable))
    }

    /// The axes of the map, from end to end of its values.
    ///
    /// # Errors
    /// Input: the map's data contradict each other or are empty.
    pub fn axes(&self) -> Result<(PlotAxis, PlotAxis)> {
        let grid = self.margins()?;
        let ends = |axis: &[f64]| Range { low: axis[0], high: axis[axis.len() - 1] };
        Ok((PlotAxis::linear(self.x.label(), ends(&grid.x)), PlotAxis::linear(self.y.label(), ends(&grid.y))))
    }

    /// Areas, contours and letters inside a frame made with [`AcceptabilityMap::axes`].
    ///
    /// # Errors
    /// Errors of [`AcceptabilityMap::axes`]; the surface refuses.
    pub(crate) fn paint_inside(&self, canvas: &mut Canvas, frame: &PlotFrame, look: Look) -> Result<()> {
        let margins = self.margins()?;
        let (accept, reject) = self.borders(&margins);
        let known = ValueGrid { z: margins.z.iter().map(|m| if m.is_finite() { 1.0 } else { f64::NAN }).collect(), ..margins.clone() };
        let place = |x: f64, y: f64| frame.at(x, y);
        // The rest is uncertain, so that colour goes under the others.
        fill_positive(canvas, &known, UNCERTAIN, place)?;
        fill_positive(canvas, &accept, ACCEPTABLE, place)?;
        fill_positive(canvas, &reject, NOT_ACCEPTABLE, place)?;
        let (corner, size) = ((frame.left, frame.top), (frame.width, frame.height));
        let back = |px: f64, py: f64| {
            let s = (px - frame.left) / frame.width;
            let t = (frame.bottom() - py) / frame.height;
            (frame.x.range.low + s * frame.x.range.length(), frame.y.range.low + t * frame.y.range.length())
        };
        hatch(canvas, corner, size, Hatch::Falling, NOT_ACCEPTABLE, |px, py| {
            let (x, y) = back(px, py);
            reject.value(x, y) > 0.0
        })?;
        hatch(canvas, corner, size, Hatch::Rising, UNCERTAIN, |px, py| {
            let (x, y) = back(px, py);
            accept.value(x, y) <= 0.0 && reject.value(x, y) <= 0.0
        })?;
        for border in [&accept, &reject] {
            for line in border.contour(0.0) {
                let places: Vec<PixelPoint> = line.points.iter().map(|p| frame.at(p.0, p.1)).collect();
                canvas.line(&places, Stroke::solid(INK, 1.0))?;
            }
        }
        self.paint_binding_borders(canvas, frame, &margins)?;
        let mut taken = Vec::new();
        let badges = self.badges(frame, look);
        for (at, _) in &badges {
            taken.push(around(*at, (2.0 * look.badge, 2.0 * look.badge)));
        }
        if let Some(here) = &self.here {
            taken.push(around(frame.at(here.x, here.y), (3.0 * look.badge, 3.0 * look.badge)));
        }
        let lines =
            if self.probability.is_empty() { self.margin_lines(frame, &margins, look) } else { self.probability_lines(frame, &margins) };
        levels::paint(canvas, frame, &lines, look.label, taken)?;
        for (at, index) in &badges {
            paint_badge(canvas, *at, &self.letter(*index, look), look.badge)?;
        }
        match &self.here {
            Some(here) if frame.x.range.with(here.x) == frame.x.range && frame.y.range.with(here.y) == frame.y.range => {
                paint_here(canvas, frame.at(here.x, here.y), look.badge * 0.62)
            }
            _ => Ok(()),
        }
    }

    /// Contour lines of the probability, found on its normal quantile, which is nearly linear.
    fn probability_lines(&self, frame: &PlotFrame, margins: &ValueGrid) -> Vec<ContourLevel> {
        let deviations = |p: f64| Normal::standard().inverse_cdf(p.clamp(1e-9, 1.0 - 1e-9));
        let z = self.probability.iter().map(|p| if p.is_finite() { deviations(*p) } else { f64::NAN }).collect();
        let grid = ValueGrid { z, ..margins.clone() };
        let level = |p: &f64| {
            let label = Some(format!("{} %", fixed(100.0 * p, 0)));
            ContourLevel::new(frame, &grid.contour(deviations(*p)), label, if *p == 0.5 { 2.6 } else { 1.1 })
        };
        PROBABILITIES.iter().map(level).collect()
    }

    fn levels(&self, margins: &ValueGrid) -> Vec<f64> {
        let mut known: Vec<f64> = margins.z.iter().copied().filter(|m| m.is_finite()).collect();
        known.sort_by(f64::total_cmp);
        // The step suits the bulk of the map: a margin often falls steeply in one corner.
        let (few, most) = (known.len() / 20, known.len() - known.len() / 20);
        let Some(range) = Range::of(known[few..most].iter().copied()) else { return Vec::new() };
        let mut levels = linear(range, 8).values;
        if range.low < 0.0 && range.high > 0.0 && !levels.iter().any(|l| l.abs() < 1e-9 * range.length()) {
            levels.push(0.0);
        }
        levels
    }

    /// Contour lines of the margin: the zero line, and the others if the map stands alone.
    fn margin_lines(&self, frame: &PlotFrame, margins: &ValueGrid, look: Look) -> Vec<ContourLevel> {
        let levels = self.levels(margins);
        let step = levels.windows(2).map(|p| (p[1] - p[0]).abs()).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
        let decimals = if step.is_finite() { (-(step.log10() + 1e-9).floor()).clamp(0.0, 6.0) as usize } else { 1 };
        let is_zero = |level: f64| level.abs() < 1e-9 * step.min(1e300);
        let line = |level: f64| {
            let zero = is_zero(level);
            let sign = if level > 0.0 && !zero { "+" } else { "" };
            let text = format!("{sign}{} {}", fixed(if zero { 0.0 } else { level }, decimals), unit_symbol(&self.margin_unit));
            let lines = margins.contour_in(level, |i, j| zero || !self.jumps(margins, i, j, step));
            ContourLevel::new(frame, &lines, (!look.is_on_sheet).then_some(text), if zero { 2.6 } else { 1.1 })
        };
        levels.into_iter().filter(|level| is_zero(*level) || !look.is_on_sheet).map(line).collect()
    }

    /// Whether the margin jumps within a cell because another limit begins to bind there. The margins between belong to no
    /// limit, so their contour lines would be a wall along the border.
    fn jumps(&self, margins: &ValueGrid, i: usize, j: usize, step: f64) -> bool {
        let nodes = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
        let binding = nodes.map(|(i, j)| self.binding.get(j * self.x_values.len() + i));
        let (low, high) = nodes
            .iter()
            .map(|(i, j)| margins.at(*i, *j))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), m| (low.min(m), high.max(m)));
        binding.iter().any(|b| *b != binding[0]) && high - low > step
    }

    /// The binding limit per node where there is one and the margin is known.
    fn binding_numbers(&self) -> Vec<Option<usize>> {
        let known = |k: usize| self.margin.get(k).is_some_and(|m| m.is_finite());
        self.binding.iter().enumerate().map(|(k, b)| (known(k) && *b < self.limits.len()).then_some(*b)).collect()
    }

    /// Dashed lines where another limit begins to bind.
    fn paint_binding_borders(&self, canvas: &mut Canvas, frame: &PlotFrame, margins: &ValueGrid) -> Result<()> {
        let numbers = self.binding_numbers();
        let mut present: Vec<(usize, usize)> = Vec::new();
        for n in numbers.iter().flatten() {
            match present.iter_mut().find(|p| p.1 == *n) {
                Some(p) => p.0 += 1,
                None => present.push((1, *n)),
            }
        }
        present.sort_unstable();
        // The border of the largest area is made of the borders of the others.
        present.pop();
        for (done, (_, number)) in present.iter().enumerate() {
            // Borders with areas already drawn are left out, so that no border is drawn twice.
            let drawn = &present[..done];
            let z = numbers.iter().map(|n| match n {
                Some(n) if n == number => 1.0,
                Some(n) if drawn.iter().all(|d| d.1 != *n) => 0.0,
                _ => f64::NAN,
            });
            let z = z.collect();
            let indicator = ValueGrid { z, ..margins.clone() };
            for line in indicator.contour(0.5) {
                let places: Vec<PixelPoint> = smoothed(&line.points).iter().map(|p| frame.at(p.0, p.1)).collect();
                canvas.line(&places, Stroke { colour: INK, width: 1.3, dash: BINDING_BORDER })?;
            }
        }
        Ok(())
    }

    /// Places of the letters of the binding limits: in every zone large enough to hold one.
    fn badges(&self, frame: &PlotFrame, look: Look) -> Vec<(PixelPoint, usize)> {
        let (nx, ny) = (self.x_values.len(), self.y_values.len());
        let spacing = (frame.width / (nx.max(2) - 1) as f64, frame.height / (ny.max(2) - 1) as f64);
        let found = zones(&self.binding_numbers(), nx, ny, spacing);
        let largest = |zone: &Zone| found.iter().filter(|z| z.number == zone.number).all(|z| z.nodes <= zone.nodes);
        let mut badges: Vec<(PixelPoint, usize)> = Vec::new();
        for zone in &found {
            let share = zone.nodes as f64 / (nx * ny) as f64;
            if !(largest(zone) || share > 0.04 && zone.room > look.badge) {
                continue;
            }
            let (x, y) = frame.at(self.x_values[zone.node.0], self.y_values[zone.node.1]);
            let inset = look.badge + 4.0;
            let at = (x.clamp(frame.left + inset, frame.right() - inset), y.clamp(frame.top + inset, frame.bottom() - inset));
            let clear = badges.iter().all(|(b, _)| (b.0 - at.0).hypot(b.1 - at.1) > 2.2 * look.badge);
            if clear {
                badges.push((at, zone.number));
            }
        }
        badges
    }

    /// The letter of a limit: on a sheet that of its list of limits, on a map alone one after the other.
    fn letter(&self, index: usize, look: Look) -> String {
        let own = if look.is_on_sheet { None } else { self.binding_limits().iter().position(|own| *own == index) };
        letter(own.unwrap_or(index))
    }

    /// The limits that bind somewhere on the map, as indices.
    pub(crate) fn binding_limits(&self) -> Vec<usize> {
        let mut present: Vec<usize> = self.binding_numbers().into_iter().flatten().collect();
        present.sort_unstable();
        present.dedup();
        present
    }

    fn legend(&self) -> Legend {
        let mut legend = Legend::default();
        legend.add(Swatch::Heading, "Verdict");
        for state in [CellState::Acceptable, CellState::Uncertain, CellState::NotAcceptable] {
            let (colour, hatch) = state.look();
            legend.add(Swatch::Area(colour, 1.0, hatch), state.name());
        }
        let binding = self.binding_limits();
        if !binding.is_empty() {
            legend.add(Swatch::Heading, "Limit that binds");
            for (place, index) in binding.into_iter().enumerate() {
                legend.add(Swatch::Badge(letter(place)), &*self.limits[index]);
            }
            if self.binding_limits().len() > 1 {
                legend.add(Swatch::Line(INK, 1.3, BINDING_BORDER), "another limit binds");
            }
        }
        if self.probability.is_empty() {
            legend.add(Swatch::Heading, "Margin of that limit");
            legend.add(Swatch::Line(INK, 2.6, &[]), "limit just reached");
            legend.add(Swatch::Line(INK, 1.1, &[]), "equal margin");
        } else {
            legend.add(Swatch::Heading, "All limits are kept");
            legend.add(Swatch::Line(INK, 2.6, &[]), "as likely as not");
            legend.add(Swatch::Line(INK, 1.1, &[]), "equal probability");
        }
        if let Some(here) = &self.here {
            legend.add(Swatch::Heading, "Marked");
            legend.add(Swatch::Here, &*here.label);
        }
        legend
    }

    fn page(&self) -> Page {
        let mut footer = vec![fixed_conditions(&self.fixed)];
        footer.extend(self.notes.iter().cloned());
        Page::new(WIDTH, &self.title, "", &footer)
    }

    fn legend_width(&self) -> f64 {
        WIDTH - 2.0 * MARGIN - PLOT_WIDTH - 14.0
    }
}

/// Smooths a staircase between nodes by repeated averaging with both neighbours; the ends are kept.
fn smoothed(points: &[PixelPoint]) -> Vec<PixelPoint> {
    let mut line = points.to_vec();
    for _ in 0..60 {
        let before = line.clone();
        for (k, three) in before.windows(3).enumerate() {
            let mean = |of: fn(&PixelPoint) -> f64| 0.25 * of(&three[0]) + 0.5 * of(&three[1]) + 0.25 * of(&three[2]);
            line[k + 1] = (mean(|p| p.0), mean(|p| p.1));
        }
    }
    line
}

impl Figure for AcceptabilityMap {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        self.margins()?;
        let page = self.page();
        let body = PLOT.max(self.legend().stacked_height(self.legend_width()) + 10.0);
        Ok((WIDTH, page.top() + body + page.bottom()))
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let page = self.page();
        let (x, y) = self.axes()?;
        let frame = PlotFrame::inside((MARGIN, page.top()), (PLOT_WIDTH, PLOT), x, y);
        self.paint_inside(canvas, &frame, Look { label: 13.0, badge: 11.0, is_on_sheet: false })?;
        frame.paint_axes(canvas)?;
        self.legend().paint_stacked(canvas, (MARGIN + PLOT_WIDTH + 14.0, frame.top), self.legend_width())?;
        page.paint(canvas, self.size()?.1)
    }
}
