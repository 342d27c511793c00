//! A small reader of the SVG that the charts write: is it well formed, and where do its texts stand.

use coldplate_figures::chart::fonts::{FontWeight, width};

/// One tag: its name, its attributes, and the text up to the next tag.
#[derive(Debug, Clone)]
pub struct Tag {
    pub name: String,
    pub attributes: Vec<(String, String)>,
    pub text: String,
}

impl Tag {
    pub fn get(&self, key: &str) -> Option<&str> {
        self.attributes.iter().find(|a| a.0 == key).map(|a| a.1.as_str())
    }
    pub fn number(&self, key: &str) -> f64 {
        self.get(key).and_then(|v| v.parse().ok()).unwrap_or_else(|| panic!("no number {key} in {self:?}"))
    }
}

fn unescape(text: &str) -> String {
    let out = text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"").replace("&apos;", "'").replace("&#39;", "'");
    assert!(!out.replace("&amp;", "").contains('&'), "a stray ampersand in {text}");
    out.replace("&amp;", "&")
}

/// Reads all tags; panics where tags do not match, an attribute is not quoted or a name is odd.
pub fn read(svg: &str) -> Vec<Tag> {
    let mut tags = Vec::new();
    let mut open: Vec<String> = Vec::new();
    let mut rest = svg.trim();
    assert!(rest.starts_with("<svg "));
    while let Some(start) = rest.find('<') {
        assert!(open.is_empty() || !rest[..start].contains('>'), "a stray > before {}", &rest[..start + 20]);
        let end = rest.find('>').expect("a tag that does not end");
        let inside = &rest[start + 1..end];
        let after = &rest[end + 1..];
        let text = unescape(after.split('<').next().unwrap_or("").trim());
        rest = after;
        if let Some(name) = inside.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name), "a closing tag that does not match");
            continue;
        }
        let (inside, single) = inside.strip_suffix('/').map_or((inside, false), |i| (i, true));
        let (name, mut list) = inside.split_once(' ').unwrap_or((inside, ""));
        assert!(name.chars().all(|c| c.is_ascii_alphabetic()), "odd tag {name}");
        let mut attributes: Vec<(String, String)> = Vec::new();
        while let Some((key, value)) = list.trim_start().split_once("=\"") {
            let (value, more) = value.split_once('"').expect("an attribute that does not end");
            assert!(attributes.iter().all(|a| a.0 != key), "{key} twice in <{name}>");
            attributes.push((key.to_string(), unescape(value)));
            list = more;
        }
        assert!(list.trim().is_empty(), "unreadable attributes: {list}");
        tags.push(Tag { name: name.into(), attributes, text });
        if !single {
            open.push(name.into());
        }
    }
    assert!(open.is_empty(), "not closed: {open:?}");
    tags
}

/// Left, top, right, bottom of a text, in the units of the view box, from the metrics of the font.
pub fn text_box(tag: &Tag) -> (f64, f64, f64, f64) {
    let size = tag.number("font-size");
    let weight = if tag.get("font-weight") == Some("bold") { FontWeight::Bold } else { FontWeight::Regular };
    let length = width(&tag.text, size, weight);
    let dy: f64 = tag.get("dy").unwrap().strip_suffix("em").unwrap().parse().unwrap();
    let start = match tag.get("text-anchor") {
        Some("middle") => -length / 2.0,
        Some("end") => -length,
        _ => 0.0,
    };
    // Capitals of this font are 0.69 em high, descenders reach 0.21 em down.
    let (x, y) = (tag.number("x"), tag.number("y"));
    let (top, bottom) = (dy * size - 0.72 * size, dy * size + 0.21 * size);
    match tag.get("transform") {
        None => (x + start, y + top, x + start + length, y + bottom),
        Some(turn) => {
            assert!(turn.starts_with("rotate(270"), "{turn}");
            (x + top, y - start - length, x + bottom, y - start)
        }
    }
}
