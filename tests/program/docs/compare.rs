//! Texts and pictures that say the same.

/// Holds a block against what was printed.
pub fn texts(shown: &str, printed: &str, is_part: bool) -> Result<(), String> {
    let lines = |text: &str| text.lines().map(str::trim).filter(|l| !l.is_empty()).map(String::from).collect::<Vec<_>>();
    let (shown, printed) = (lines(shown), lines(printed));
    let mut at = 0;
    let mut may_skip = is_part;
    for line in &shown {
        if line == "..." || line == "…" {
            may_skip = true;
            continue;
        }
        let found = (at..printed.len()).find(|k| same_line(line, &printed[*k]));
        match found {
            Some(k) if k == at || may_skip => at = k + 1,
            _ => {
                let now = printed.get(at).map_or("nothing more", String::as_str);
                return Err(format!("  shown:   {line}\n  printed: {now}"));
            }
        }
        may_skip = is_part;
    }
    let files = printed[at.min(printed.len())..].iter().all(|l| l.starts_with("wrote "));
    if may_skip || files { Ok(()) } else { Err(format!("  not shown: {}", printed[at])) }
}

fn same_line(shown: &str, printed: &str) -> bool {
    let (a, b): (Vec<&str>, Vec<&str>) = (shown.split_whitespace().collect(), printed.split_whitespace().collect());
    // Rules under a heading are as wide as their table.
    let is_rule = |w: &str| w.len() > 3 && w.chars().all(|c| c == '-');
    a.len() == b.len()
        && (0..a.len()).all(|i| {
            let unit = a.get(i + 1).map_or("", |u| u.trim_matches(|c: char| !c.is_alphabetic()));
            let is_time = unit == "s" && number(a[i]).is_some() && number(b[i]).is_some();
            is_time || is_rule(a[i]) && is_rule(b[i]) || same_word(a[i], b[i])
        })
}

/// Equal, or numbers that agree to the digits shown, give or take one in the last.
fn same_word(shown: &str, printed: &str) -> bool {
    if shown == printed {
        return true;
    }
    let core = |w: &str| w.trim_matches(|c: char| matches!(c, ',' | ';' | '(' | ')' | ':')).to_string();
    match (number(&core(shown)), number(&core(printed))) {
        // What is as small as rounding is noise on another machine.
        (Some(a), Some(b)) => (a - b).abs() <= 1.01 * last_digit(&core(shown)) || a.abs().max(b.abs()) < 1e-9,
        _ => false,
    }
}

fn number(word: &str) -> Option<f64> {
    word.replace('−', "-").parse().ok()
}

/// What one more in the last digit shown is worth.
fn last_digit(word: &str) -> f64 {
    let (mantissa, exponent) = word.split_once(['e', 'E']).unwrap_or((word, "0"));
    let decimals = mantissa.split_once('.').map_or(0, |(_, d)| d.len());
    10f64.powi(exponent.parse::<i32>().unwrap_or(0) - decimals as i32)
}

/// Holds a drawing against another: the same signs, numbers that differ by a fraction of a pixel at most.
pub fn pictures(old: &str, new: &str) -> Result<(), String> {
    if old == new {
        return Ok(());
    }
    let split = |text: &str| {
        let mut parts: Vec<String> = Vec::new();
        let is_number = |c: char| c.is_ascii_digit() || c == '.' || c == '-';
        for c in text.chars() {
            match parts.last_mut() {
                Some(last) if last.chars().next().is_some_and(is_number) == is_number(c) => last.push(c),
                _ => parts.push(c.to_string()),
            }
        }
        parts
    };
    let (a, b) = (split(old), split(new));
    let same = |a: &str, b: &str| {
        let (Ok(x), Ok(y)) = (a.parse::<f64>(), b.parse::<f64>()) else { return a == b };
        // Ten units of the drawing are a pixel; labels have decimals.
        (x - y).abs() <= if a.contains('.') { 1.01 * last_digit(a) } else { 3.0 }
    };
    if a.len() != b.len() {
        return Err(format!("{} pieces are drawn where there were {}", b.len(), a.len()));
    }
    match a.iter().zip(&b).find(|(x, y)| !same(x, y)) {
        Some((x, y)) => Err(format!("'{}' is now '{}'", x.chars().take(60).collect::<String>(), y.chars().take(60).collect::<String>())),
        None => Ok(()),
    }
}

#[test]
fn lines_agree_to_the_digits_shown() {
    assert!(texts("motor 42.1 degC\n...\nsolved in 0.09 s", "motor  42.135 degC\nplate 26 degC\nsolved in 0.21 s\n", false).is_ok());
    assert!(texts("motor 42.5 degC", "motor 42.135 degC", false).is_err());
    assert!(texts("a", "a\nb", false).is_err());
    assert!(texts("b", "a\nb\nc", true).is_ok());
}

#[test]
fn pictures_may_differ_by_a_fraction_of_a_pixel() {
    assert!(pictures("<line x=\"100\"/>12.3", "<line x=\"102\"/>12.3").is_ok());
    assert!(pictures("<line x=\"100\"/>", "<line x=\"140\"/>").is_err());
}
