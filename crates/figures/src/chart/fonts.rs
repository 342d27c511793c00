//! The embedded font: its registration with plotters, and the width of a text set in it.
//!
//! The font is a subset of Arimo, whose widths are those of Arial, Helvetica and Liberation Sans: a
//! viewer of the SVG that has none of them still keeps every text in its place, because each text
//! carries its length.

use std::collections::VecDeque;
use std::sync::OnceLock;

use ab_glyph::{Font, FontRef};

use coldplate_base::error::{Error, Result};

/// The `font-family` written into an SVG, and the name the font is registered under.
pub const FAMILY: &str = "Arimo, Arial, Liberation Sans, Helvetica, sans-serif";

/// The regular weight of the embedded font.
static REGULAR: &[u8] = include_bytes!("../../assets/fonts/Arimo-Regular-subset.ttf");
/// The bold weight of the embedded font.
static BOLD: &[u8] = include_bytes!("../../assets/fonts/Arimo-Bold-subset.ttf");

/// Stroke weight of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FontWeight {
    /// Regular.
    #[default]
    Regular,
    /// Bold.
    Bold,
}

/// The font of this weight.
///
/// # Errors
/// If the embedded file cannot be read as a font.
pub fn face(weight: FontWeight) -> Result<&'static FontRef<'static>> {
    static FACES: OnceLock<Option<[FontRef<'static>; 2]>> = OnceLock::new();
    let faces = FACES.get_or_init(|| Some([FontRef::try_from_slice(REGULAR).ok()?, FontRef::try_from_slice(BOLD).ok()?]));
    match (faces, weight) {
        (Some([regular, _]), FontWeight::Regular) => Ok(regular),
        (Some([_, bold]), FontWeight::Bold) => Ok(bold),
        (None, _) => Err(Error::numerics("the embedded font cannot be read")),
    }
}

/// Makes the font known to plotters, once.
///
/// # Errors
/// If the embedded file cannot be read as a font.
pub fn register() -> Result<()> {
    use plotters::style::{FontStyle, register_font};
    static DONE: OnceLock<bool> = OnceLock::new();
    let done = DONE
        .get_or_init(|| register_font(FAMILY, FontStyle::Normal, REGULAR).is_ok() && register_font(FAMILY, FontStyle::Bold, BOLD).is_ok());
    if *done { Ok(()) } else { Err(Error::numerics("the embedded font cannot be read")) }
}

/// Width of a text in the unit of `size`, the font size (the em).
pub fn width(text: &str, size: f64, weight: FontWeight) -> f64 {
    let Ok(face) = face(weight) else { return 0.6 * size * text.chars().count() as f64 };
    let per_em = face.units_per_em().map_or(2048.0, f64::from);
    text.chars().map(|c| advance(face, c, per_em)).sum::<f64>() * size
}

/// Width of one sign, in em. A sign that the font lacks is as wide as an ideograph: in an SVG the viewer's font has it,
/// in a PNG its code point stands there.
fn advance(face: &FontRef<'_>, c: char, per_em: f64) -> f64 {
    let id = face.glyph_id(c);
    if id.0 == 0 { 1.0 } else { f64::from(face.h_advance_unscaled(id)) / per_em }
}

/// Whether the font has this sign in both weights. A sign that it lacks is drawn in a PNG as a box with its code
/// point.
pub fn has(sign: char) -> bool {
    [FontWeight::Regular, FontWeight::Bold].into_iter().all(|weight| face(weight).is_ok_and(|face| face.glyph_id(sign).0 != 0))
}

/// A text as it can be drawn on one line: control characters and line ends become spaces, and several
/// spaces one, as an SVG viewer shows them.
pub fn one_line(text: &str) -> String {
    let spaced: String = text.chars().map(|c| if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') { ' ' } else { c }).collect();
    spaced.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The text, shortened with an ellipsis in its middle where it is wider than `limit`: the ends of
/// long sensor names tell them apart.
pub fn fit(text: &str, size: f64, weight: FontWeight, limit: f64) -> String {
    let text = one_line(text);
    if width(&text, size, weight) <= limit {
        return text;
    }
    let chars: Vec<char> = text.chars().collect();
    let mut keep = chars.len().saturating_sub(1);
    while keep > 0 {
        let head: String = chars[..keep.div_ceil(2)].iter().collect();
        let tail: String = chars[chars.len() - keep / 2..].iter().collect();
        let short = format!("{}…{}", head.trim_end(), tail.trim_start());
        if width(&short, size, weight) <= limit {
            return short;
        }
        keep -= 1;
    }
    if width("…", size, weight) <= limit { "…".into() } else { String::new() }
}

/// The text broken at spaces into at most `most` lines no wider than `limit`. A number stays with the word after it,
/// mostly its unit. A word too wide for a line is broken, and the rest that does not fit on the last line is
/// shortened.
pub fn wrap(text: &str, size: f64, weight: FontWeight, limit: f64, most: usize) -> Vec<String> {
    let text = one_line(text);
    if text.is_empty() || most == 0 {
        return Vec::new();
    }
    let mut lines: Vec<String> = Vec::new();
    let mut line = String::new();
    let mut words = unbroken(&text);
    while let Some(word) = words.pop_front() {
        let longer = if line.is_empty() { word.clone() } else { format!("{line} {word}") };
        if width(&longer, size, weight) <= limit {
            line = longer;
            continue;
        }
        if lines.len() + 1 == most {
            // The last line takes the whole rest and is shortened as one.
            let rest = words.iter().fold(longer, |rest, w| rest + " " + w);
            lines.push(fit(&rest, size, weight, limit));
            return lines;
        }
        if line.is_empty() {
            let chars: Vec<char> = word.chars().collect();
            let fits = |n: usize| width(&chars[..n].iter().collect::<String>(), size, weight) <= limit;
            let cut = (1..chars.len()).rev().find(|n| fits(*n)).unwrap_or(1);
            lines.push(chars[..cut].iter().collect());
            let rest: String = chars[cut..].iter().collect();
            if !rest.is_empty() {
                words.push_front(rest);
            }
        } else {
            lines.push(std::mem::take(&mut line));
            words.push_front(word);
        }
    }
    if !line.is_empty() {
        lines.push(line);
    }
    lines
}

/// The pieces of a text between which a line may end.
fn unbroken(text: &str) -> VecDeque<String> {
    let mut words: VecDeque<String> = VecDeque::new();
    let mut after_number = false;
    for word in text.split_whitespace() {
        match words.back_mut().filter(|_| after_number) {
            Some(number) => *number += &format!(" {word}"),
            None => words.push_back(word.to_string()),
        }
        after_number = word.trim_start_matches(['(', '±']).parse::<f64>().is_ok();
    }
    words
}
