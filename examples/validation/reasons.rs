//! Why a published curve and ours differ: which other printed number it contradicts, or what is not published.

/// For one row of Tables 7 to 10.
pub fn reason(table: usize, part: &str) -> &'static str {
    let _ = (table, part);
    ""
}
