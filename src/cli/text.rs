//! Plain-text tables for readers.

/// A table with a heading row; columns are as wide as their widest cell, numbers stand to the right.
pub fn table(heading: &[&str], rows: &[Vec<String>]) -> String {
    let columns = heading.len();
    let width =
        |i: usize| rows.iter().filter_map(|r| r.get(i)).map(|c| c.chars().count()).chain([heading[i].chars().count()]).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let is_number = |i: usize| {
        rows.iter()
            .filter_map(|r| r.get(i))
            .all(|c| c.is_empty() || c.starts_with(['-', '+', '0', '1', '2', '3', '4', '5', '6', '7', '8', '9', '<']))
    };
    let right: Vec<bool> = (0..columns).map(is_number).collect();
    let line = |cells: &mut dyn Iterator<Item = &str>| {
        let mut text = String::from(" ");
        for (i, cell) in cells.enumerate() {
            let pad = " ".repeat(widths[i].saturating_sub(cell.chars().count()));
            text.push(' ');
            if right[i] {
                text.push_str(&pad);
            }
            text.push_str(cell);
            if !right[i] {
                text.push_str(&pad);
            }
            text.push(' ');
        }
        text.trim_end().to_string() + "\n"
    };
    let mut text = line(&mut heading.iter().copied());
    text += &format!("  {}\n", "-".repeat(widths.iter().sum::<usize>() + 2 * (columns - 1)));
    for row in rows {
        text += &line(&mut row.iter().map(String::as_str));
    }
    text
}

/// A time as a reader says it: `12.5 s`, `4 min 30 s`, `3 h 12 min`, `2 d 5 h`.
pub fn duration(seconds: f64) -> String {
    if !seconds.is_finite() || seconds.abs() < 59.95 {
        return format!("{} s", (seconds * 10.0).round() / 10.0);
    }
    let sign = if seconds < 0.0 { "-" } else { "" };
    let two = |large: f64, small: f64, names: [&str; 2]| {
        let parts = (seconds.abs() / small).round();
        let (whole, rest) = ((parts * small / large).floor(), parts % (large / small));
        if rest == 0.0 { format!("{sign}{whole} {}", names[0]) } else { format!("{sign}{whole} {} {rest} {}", names[0], names[1]) }
    };
    match seconds.abs() {
        s if s < 3599.5 => two(60.0, 1.0, ["min", "s"]),
        s if s < 172_770.0 => two(3600.0, 60.0, ["h", "min"]),
        _ => two(86400.0, 3600.0, ["d", "h"]),
    }
}

#[cfg(test)]
mod tests {
    use super::duration;

    #[test]
    fn times_read_well() {
        for (seconds, text) in [
            (0.0, "0 s"),
            (12.34, "12.3 s"),
            (59.99, "1 min"),
            (270.0, "4 min 30 s"),
            (3599.7, "1 h"),
            (61_200.0, "17 h"),
            (11_530.0, "3 h 12 min"),
            (190_800.0, "2 d 5 h"),
            (-90.0, "-1 min 30 s"),
        ] {
            assert_eq!(duration(seconds), text, "{seconds}");
        }
    }
}
