//! The look all figures share: palette, markers, dashes, text sizes, and how units are written.

/// A colour in sRGB.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rgb(pub u8, pub u8, pub u8);

impl Rgb {
    /// Red, green and blue as shares of light, 0 to 1 (IEC 61966-2-1).
    pub fn linear(self) -> [f64; 3] {
        [self.0, self.1, self.2].map(|byte| {
            let c = f64::from(byte) / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        })
    }

    /// Relative luminance, 0 (black) to 1 (white), by WCAG 2.1: how light it is in a grey print.
    pub fn luminance(self) -> f64 {
        let [red, green, blue] = self.linear();
        0.2126 * red + 0.7152 * green + 0.0722 * blue
    }

    /// A darker colour of this hue: for lines over an area of this colour.
    #[must_use]
    pub(crate) fn darker(self) -> Self {
        let less = |byte: u8| (u16::from(byte) * 11 / 20) as u8;
        Self(less(self.0), less(self.1), less(self.2))
    }

    /// Contrast ratio to another colour, 1 to 21, by WCAG 2.1.
    pub fn contrast(self, other: Self) -> f64 {
        let (a, b) = (self.luminance() + 0.05, other.luminance() + 0.05);
        if a > b { a / b } else { b / a }
    }
}

/// Page background, sRGB.
pub const WHITE: Rgb = Rgb(255, 255, 255);
/// Text and the heaviest lines, sRGB. Chosen by eye, nearly black.
pub const INK: Rgb = Rgb(26, 26, 26);
/// Secondary text, sRGB. Chosen by eye.
pub(crate) const MUTED: Rgb = Rgb(84, 84, 84);
/// Axis lines and ticks, sRGB. Chosen by eye.
pub const AXIS: Rgb = Rgb(90, 90, 90);
/// Grid lines, sRGB. Chosen by eye.
pub(crate) const GRID: Rgb = Rgb(225, 225, 225);
/// Every second row of a table, sRGB. Chosen by eye.
pub(crate) const STRIPE: Rgb = Rgb(244, 244, 242);

// The palette of Okabe and Ito, "Color Universal Design" (2008), which stays apart for the common
// kinds of colour blindness. Its yellow is kept for areas: a yellow line on white cannot be seen.
/// Okabe-Ito orange.
pub const ORANGE: Rgb = Rgb(230, 159, 0);
/// Okabe-Ito sky blue.
pub const SKY: Rgb = Rgb(86, 180, 233);
/// Okabe-Ito bluish green.
pub(crate) const GREEN: Rgb = Rgb(0, 158, 115);
/// Okabe-Ito blue.
pub const BLUE: Rgb = Rgb(0, 114, 178);
/// Okabe-Ito vermillion.
pub(crate) const VERMILLION: Rgb = Rgb(213, 94, 0);
/// Okabe-Ito reddish purple.
pub(crate) const PURPLE: Rgb = Rgb(204, 121, 167);

/// Area of acceptable conditions: bluish green, lightened so that text can be read on it.
pub(crate) const ACCEPTABLE: Rgb = Rgb(134, 205, 180);
/// Area of uncertain conditions: pale yellow, chosen as the lightest of the three.
pub const UNCERTAIN: Rgb = Rgb(255, 244, 190);
/// Area of conditions that are not acceptable: vermillion, lightened a little, chosen as the darkest of the three.
pub(crate) const NOT_ACCEPTABLE: Rgb = Rgb(214, 112, 48);

/// Font sizes in CSS pixels. Chosen by eye.
pub mod size {
    /// Title of a figure.
    pub(crate) const TITLE: f64 = 19.0;
    /// Axis titles and legends.
    pub(crate) const BODY: f64 = 14.0;
    /// Tick labels and table cells.
    pub(crate) const TICK: f64 = 13.0;
    /// Footer: fixed conditions, notes.
    pub(crate) const FOOTER: f64 = 12.5;
}

/// How a line is broken, as lengths on, off, on, off in CSS pixels; empty is unbroken.
pub(crate) type Dash = &'static [f64];

/// Unbroken.
pub const SOLID: Dash = &[];
/// Long dashes, CSS pixels. Chosen by eye.
pub const DASHED: Dash = &[9.0, 5.0];
/// Dots, CSS pixels. Chosen by eye.
pub(crate) const DOTTED: Dash = &[2.0, 4.0];

/// Dashes of curves in turn, CSS pixels. Chosen by eye.
const DASHES: [Dash; 5] = [SOLID, DASHED, &[10.0, 4.0, 2.0, 4.0], DOTTED, &[5.0, 3.0]];
/// Colours of curves in turn. Chosen from the palette: those that can be seen as lines.
const LINE_COLOURS: [Rgb; 7] = [BLUE, ORANGE, GREEN, INK, VERMILLION, SKY, PURPLE];

/// Shape of a marker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marker {
    /// ●
    Disc,
    /// ▲
    Triangle,
    /// ■
    Square,
    /// ◆
    Diamond,
    /// ▼
    TriangleDown,
    /// ○
    Ring,
    /// ×
    Cross,
    /// □
    Frame,
}

/// Markers of curves in turn. Chosen: shapes that differ in a grey print.
const MARKERS: [Marker; 8] =
    [Marker::Disc, Marker::Triangle, Marker::Square, Marker::Diamond, Marker::TriangleDown, Marker::Ring, Marker::Cross, Marker::Frame];

/// Colour, marker and dash of one curve among several.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeriesStyle {
    /// Colour of line and marker.
    pub colour: Rgb,
    /// Marker of its samples.
    pub marker: Marker,
    /// Dash of its line.
    pub dash: Dash,
}

/// The style of the curve with this index: the pair of marker and dash, which is all a grey print
/// leaves, repeats only after 40 curves.
pub fn series(index: usize) -> SeriesStyle {
    SeriesStyle {
        colour: LINE_COLOURS[index % LINE_COLOURS.len()],
        marker: MARKERS[index % MARKERS.len()],
        dash: DASHES[index % DASHES.len()],
    }
}

/// A quantity on an axis or in a table: its name and its unit.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Quantity {
    /// Name; underscores are shown as spaces.
    pub name: String,
    /// Unit as the files write it (`degC`, `L/min`, `m3/s`); empty for a pure number.
    pub unit: String,
}

impl Quantity {
    /// A quantity with its unit.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into() }
    }

    /// Whether it is a pure number: no unit, or the unit `1` of tables.
    pub fn is_number(&self) -> bool {
        matches!(self.unit.trim(), "" | "1")
    }

    /// `coolant flow [L/min]`
    pub fn label(&self) -> String {
        let name = readable(&self.name);
        if self.is_number() { name } else { format!("{name} [{}]", unit_symbol(&self.unit)) }
    }

    /// `coolant flow 9.42 L/min`; a pure number behind `=`, since a name may end in a digit.
    pub fn named(&self, value: f64) -> String {
        let equals = if self.is_number() { "= " } else { "" };
        format!("{} {equals}{}", readable(&self.name), self.with_value(value))
    }

    /// `9.42 L/min`, the number as given.
    pub fn with_value(&self, value: f64) -> String {
        let number = number(value);
        if self.is_number() { number } else { format!("{number} {}", unit_symbol(&self.unit)) }
    }
}

/// A name as a reader sees it: underscores become spaces.
pub fn readable(name: &str) -> String {
    name.replace('_', " ")
}

/// A unit as a reader sees it: `degC` becomes °C, `m3/s` becomes m³/s, `W/(m2 K)` becomes W/(m² K).
pub fn unit_symbol(unit: &str) -> String {
    let unit = unit.trim().replace("degC", "°C").replace("um", "µm");
    let mut out = String::with_capacity(unit.len());
    let mut in_symbol = false;
    for c in unit.chars() {
        match c {
            '^' => continue,
            '2' if in_symbol => out.push('²'),
            '3' if in_symbol => out.push('³'),
            '4' if in_symbol => out.push('⁴'),
            _ => out.push(c),
        }
        in_symbol = c.is_alphabetic();
    }
    out
}

/// A number in a text: up to six significant digits, no trailing zeros, a true minus sign.
pub fn number(value: f64) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    if value == 0.0 {
        return "0".into();
    }
    let exponent = value.abs().log10().floor();
    let text = if (-4.0..6.0).contains(&exponent) {
        let decimals = (5.0 - exponent).clamp(0.0, 9.0) as usize;
        let text = format!("{value:.decimals$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
    } else {
        let text = format!("{value:.4e}");
        match text.split_once('e') {
            Some((mantissa, power)) => {
                let mantissa = if mantissa.contains('.') { mantissa.trim_end_matches('0').trim_end_matches('.') } else { mantissa };
                format!("{mantissa}e{power}")
            }
            None => text,
        }
    };
    text.replace('-', "−")
}

/// A number with a fixed count of decimals and a true minus sign; a dash where it is not finite.
pub fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    if value.abs() >= 1e9 {
        return number(value);
    }
    let text = format!("{value:.decimals$}");
    let is_zero = text.chars().all(|c| matches!(c, '-' | '0' | '.'));
    if is_zero { text.trim_start_matches('-').to_string() } else { text.replace('-', "−") }
}

/// Colours of rising values, from dark to light so that a grey print keeps their order: those of the map "plasma" of
/// Smith and van der Walt (2015), which stay apart for the common kinds of colour blindness.
const SEQUENCE: [Rgb; 7] =
    [Rgb(13, 8, 135), Rgb(92, 1, 166), Rgb(156, 23, 158), Rgb(204, 71, 120), Rgb(237, 121, 83), Rgb(253, 180, 47), Rgb(240, 249, 33)];

/// Colours of rising values on bodies, those of the page of a surrogate too: like the above from dark to light, but from a blue on which
/// shade and edges are still seen.
const ON_BODIES: [Rgb; 7] =
    [Rgb(66, 62, 172), Rgb(122, 58, 184), Rgb(172, 58, 166), Rgb(214, 84, 128), Rgb(242, 131, 84), Rgb(253, 185, 58), Rgb(242, 245, 82)];

/// The colour of a value at share `t` of its range, 0 to 1.
pub fn sequential(t: f64) -> Rgb {
    between(&SEQUENCE, t)
}

/// The colour of a value on a body at share `t` of its range, 0 to 1.
pub fn on_bodies(t: f64) -> Rgb {
    between(&ON_BODIES, t)
}

fn between(colours: &[Rgb; 7], t: f64) -> Rgb {
    let t = if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.0 } * (colours.len() - 1) as f64;
    let i = (t as usize).min(colours.len() - 2);
    let (a, b, share) = (colours[i], colours[i + 1], t - i as f64);
    let mix = |a: u8, b: u8| (f64::from(a) + share * (f64::from(b) - f64::from(a))).round() as u8;
    Rgb(mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}
