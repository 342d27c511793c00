//! Ranges and tick marks: round steps, labels as short as they can be.

use super::style::number;

/// A closed range of finite values with a positive length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Low end.
    pub low: f64,
    /// High end.
    pub high: f64,
}

/// Largest magnitude of a value. Chosen: beyond, a difference of two values could overflow.
const HUGE: f64 = 1e300;

impl Range {
    /// The range of the finite ones among these values; `None` if there is none. Equal values are given room on both
    /// sides.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for v in values.into_iter().filter(|v| v.abs() < HUGE) {
            low = low.min(v);
            high = high.max(v);
        }
        if low > high {
            return None;
        }
        let size = low.abs().max(high.abs());
        if high - low <= 1e-12 * size || high == low {
            let room = if size > 0.0 { 0.05 * size } else { 1.0 };
            return Some(Self { low: low - room, high: high + room });
        }
        Some(Self { low, high })
    }

    /// Widened by a fraction of its length on both sides.
    #[must_use]
    pub fn padded(self, fraction: f64) -> Self {
        let room = fraction * self.length();
        Self { low: self.low - room, high: self.high + room }
    }

    /// Stretched to take in this value.
    #[must_use]
    pub fn with(self, value: f64) -> Self {
        if value.abs() < HUGE { Self { low: self.low.min(value), high: self.high.max(value) } } else { self }
    }

    /// High minus low.
    pub fn length(self) -> f64 {
        self.high - self.low
    }
}

/// Places and labels of ticks.
#[derive(Debug, Clone, PartialEq)]
pub struct Ticks {
    /// Values, rising.
    pub values: Vec<f64>,
    /// One label per value.
    pub labels: Vec<String>,
    /// Text to be added to the axis title if the labels are shortened: `×10⁵`, `+20.125`.
    pub remark: Option<String>,
}

/// At most `most` + 1 ticks at multiples of 1, 2 or 5 times a power of ten.
pub fn linear(range: Range, most: usize) -> Ticks {
    let rough = range.length() / most.max(1) as f64;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= rough * (1.0 - 1e-9)).unwrap_or(10.0 * power);
    let (first, last) = ((range.low / step - 1e-6).ceil(), (range.high / step + 1e-6).floor());
    if !(step > 0.0 && first.is_finite() && last - first <= 1000.0) {
        return Ticks { values: Vec::new(), labels: Vec::new(), remark: None };
    }
    let count = (last - first).max(0.0) as usize;
    let values: Vec<f64> = (0..=count).map(|i| (first + i as f64) * step).collect();
    let size = range.low.abs().max(range.high.abs());
    // Digits before and after the decimal point that a plain label would need.
    let behind = (-(step.log10() + 1e-9).floor()).max(0.0);
    let before = size.log10().floor().max(0.0) + 1.0;
    if before + behind <= 6.0 {
        let labels = values.iter().map(|v| plain(*v, behind as usize)).collect();
        return Ticks { values, labels, remark: None };
    }
    if size / step > 1e5 && first.abs() < 9e15 {
        // A small range far from zero: labels count from a round offset, given in full.
        let offset = values.first().copied().unwrap_or(range.low);
        let scale = exponent_of(range.length());
        let labels = values.iter().map(|v| plain(((v - offset) / step).round() * step / 10f64.powi(scale), 2)).collect();
        let plus = format!("{}{}", if offset < 0.0 { '−' } else { '+' }, full(offset.abs(), behind.min(15.0) as usize));
        let remark = if scale == 0 { plus } else { format!("×{} {plus}", power_of_ten(scale)) };
        return Ticks { values, labels: trimmed(labels), remark: Some(remark) };
    }
    let scale = exponent_of(size);
    let decimals = (f64::from(scale) - (step.log10() + 1e-9).floor()).clamp(0.0, 6.0) as usize;
    let labels = values.iter().map(|v| plain(v / 10f64.powi(scale), decimals)).collect();
    Ticks { values, labels, remark: Some(format!("×{}", power_of_ten(scale))) }
}

/// Ticks at powers of ten, and at 2 and 5 times powers of ten if there is room; both ends positive.
pub fn logarithmic(range: Range, most: usize) -> Ticks {
    let decades = (range.high / range.low).log10().max(0.0);
    let mut values = Vec::new();
    let every = (decades / most.max(1) as f64).ceil().max(1.0) as i32;
    let between: &[f64] = if decades * 3.0 <= most as f64 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let (first, last) = (range.low.log10().floor() as i32, range.high.log10().ceil() as i32);
    for exponent in (first..=last).filter(|e| e.rem_euclid(every) == 0) {
        for m in between {
            let value = m * 10f64.powi(exponent);
            if value >= range.low * (1.0 - 1e-9) && value <= range.high * (1.0 + 1e-9) {
                values.push(value);
            }
        }
    }
    let labels = values.iter().map(|v| number(*v)).collect();
    Ticks { values, labels, remark: None }
}

fn exponent_of(size: f64) -> i32 {
    if size > 0.0 { size.log10().floor() as i32 } else { 0 }
}

fn full(value: f64, decimals: usize) -> String {
    if value < 1e15 { format!("{value:.decimals$}") } else { number(value) }
}

fn plain(value: f64, decimals: usize) -> String {
    super::style::fixed(value, decimals)
}

/// The labels without the zeros after the decimal point that all of them end in.
fn trimmed(mut labels: Vec<String>) -> Vec<String> {
    while labels.iter().all(|l| l.contains('.') && (l.ends_with('0') || l.ends_with('.'))) && !labels.is_empty() {
        for label in &mut labels {
            label.pop();
        }
    }
    for label in &mut labels {
        if label.ends_with('.') {
            label.pop();
        }
    }
    labels
}

fn power_of_ten(exponent: i32) -> String {
    let plain = exponent.to_string();
    let digits = plain.chars().map(|c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        '9' => '⁹',
        _ => '⁰',
    });
    std::iter::once("10".to_string()).chain(digits.map(String::from)).collect()
}
