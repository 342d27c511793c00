//! Identifiers made from names that people gave.

use std::collections::BTreeSet;

/// Longest identifier made from a name, in characters. Chosen: leaves room for prefixes within the 63 characters that
/// C99 distinguishes.
const LONGEST: usize = 48;

/// Letters, digits and single underscores, beginning with a letter; `None` if nothing is left.
pub(crate) fn identifier(name: &str) -> Option<String> {
    let mut made = String::new();
    for c in name.chars() {
        if c.is_ascii_alphanumeric() {
            made.push(c);
        } else if !made.is_empty() && !made.ends_with('_') {
            made.push('_');
        }
    }
    made.truncate(LONGEST);
    let made = made.trim_end_matches('_');
    let first = made.chars().next()?;
    Some(if first.is_ascii_digit() { format!("s{made}") } else { made.to_owned() })
}

/// One identifier per name, all different also without regard to case; a number if nothing else is left.
pub(crate) fn distinct<'n>(names: impl Iterator<Item = &'n str>) -> Vec<String> {
    let mut taken = BTreeSet::new();
    let mut made = Vec::new();
    for (index, name) in names.enumerate() {
        let base = identifier(name).unwrap_or_else(|| format!("number_{index}"));
        let mut own = base.clone();
        let mut next = 2;
        while !taken.insert(own.to_uppercase()) {
            own = format!("{base}_{next}");
            next += 1;
        }
        made.push(own);
    }
    made
}

/// Text in a form allowed in a comment: no marks that begin or end one, and ASCII alone.
pub(crate) fn comment(text: &str) -> String {
    text.chars().map(|c| if c.is_ascii_graphic() && !"*?\\".contains(c) || c == ' ' { c } else { '_' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identifiers_are_of_letters_digits_and_single_underscores() {
        assert_eq!(identifier("cold plate-2.cps").as_deref(), Some("cold_plate_2_cps"));
        assert_eq!(identifier("__2 Motor °C__").as_deref(), Some("s2_Motor_C"));
        assert_eq!(identifier("冷"), None);
        assert_eq!(distinct(["a b", "A-b", "冷"].into_iter()), ["a_b", "A_b_2", "number_2"]);
    }
}
