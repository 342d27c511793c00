//! Header and footer of every figure: title, subtitle, fixed conditions, notes.

use super::canvas::{Canvas, CanvasText};
use super::fonts::{self, FontWeight};
use super::style::{MUTED, Quantity, size};
use coldplate_base::error::Result;

/// Space between the edge of a figure and its content, CSS pixels. Chosen by eye.
pub const MARGIN: f64 = 16.0;

/// Title and footer of a figure, broken into lines.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Page {
    width: f64,
    title: Vec<String>,
    subtitle: Vec<String>,
    footer: Vec<String>,
}

/// Height of a line of the title, CSS pixels. Chosen by eye.
const TITLE_LINE: f64 = 24.0;
/// Height of a line of the subtitle, CSS pixels. Chosen by eye.
const SUBTITLE_LINE: f64 = 18.0;
/// Height of a line of the footer, CSS pixels. Chosen by eye.
const FOOTER_LINE: f64 = 17.0;

impl Page {
    /// Breaks the texts into lines for a figure of this width; empty texts take no room.
    pub fn new(width: f64, title: &str, subtitle: &str, footer: &[String]) -> Self {
        let room = width - 2.0 * MARGIN;
        Self {
            width,
            title: fonts::wrap(title, size::TITLE, FontWeight::Bold, room, 2),
            subtitle: fonts::wrap(subtitle, size::BODY, FontWeight::Regular, room, 2),
            footer: footer.iter().flat_map(|line| fonts::wrap(line, size::FOOTER, FontWeight::Regular, room, 4)).collect(),
        }
    }

    /// Height at which the data may begin.
    pub fn top(&self) -> f64 {
        MARGIN + TITLE_LINE * self.title.len() as f64 + SUBTITLE_LINE * self.subtitle.len() as f64 + 6.0
    }

    /// Height taken at the bottom.
    pub fn bottom(&self) -> f64 {
        if self.footer.is_empty() { MARGIN } else { FOOTER_LINE * self.footer.len() as f64 + 6.0 + MARGIN * 0.75 }
    }

    /// Width the data may take.
    pub fn room(&self) -> f64 {
        self.width - 2.0 * MARGIN
    }

    /// Sets the texts on a figure of this height.
    ///
    /// # Errors
    /// If the surface refuses.
    pub fn paint(&self, canvas: &mut Canvas, height: f64) -> Result<()> {
        let mut y = MARGIN;
        for line in &self.title {
            canvas.text((MARGIN, y + 16.0), &CanvasText::new(line).size(size::TITLE).bold())?;
            y += TITLE_LINE;
        }
        for line in &self.subtitle {
            canvas.text((MARGIN, y + 12.0), &CanvasText::new(line).colour(MUTED))?;
            y += SUBTITLE_LINE;
        }
        let mut y = height - MARGIN * 0.75 - FOOTER_LINE * self.footer.len() as f64;
        for line in &self.footer {
            y += FOOTER_LINE;
            canvas.text((MARGIN, y - 4.0), &CanvasText::new(line).size(size::FOOTER).colour(MUTED))?;
        }
        Ok(())
    }
}

/// `Fixed: coolant temperature 20 °C · motor speed 2500 rpm`, or nothing where nothing is fixed.
pub fn fixed_conditions(fixed: &[(Quantity, f64)]) -> String {
    if fixed.is_empty() {
        return String::new();
    }
    let parts: Vec<String> = fixed.iter().map(|(quantity, value)| quantity.named(*value)).collect();
    format!("Fixed: {}", parts.join(" · "))
}
