//! Enclosures: what is refused, where, and with which remedy.

use coldplate_describe::machine::{Machine, Views};
use coldplate_network::Network;
use coldplate_network::mesh::Mesh;

const PLATES: &str = "name = 'plates'
[part.low]
material = 'steel'
box = ['1 m', '1 m', '0.1 m']
[part.high]
material = 'steel'
box = ['1 m', '1 m', '0.1 m']
at = ['0 m', '0 m', '0.3 m']
[node.lump]
";

fn enclosure(rest: &str) -> String {
    format!("{PLATES}[enclosure.gap]\n{rest}\n")
}

const PAIR: &str = "surfaces = [{ face = 'low.+z', emissivity = 0.5 }, { face = 'high.-z', emissivity = 0.4 }]";

#[track_caller]
fn error(text: &str) -> String {
    let found = match text.parse::<Machine>() {
        Err(error) => error,
        Ok(machine) => {
            let mesh = Mesh::with_size(&machine, 0.1).unwrap_or_else(|e| panic!("{e}"));
            Network::build(&machine, &mesh).err().unwrap_or_else(|| panic!("not refused:\n{text}"))
        }
    };
    assert!(found.remedy().is_some() && found.location().line.is_some(), "{found}");
    found.to_string()
}

#[test]
fn bad_tables_are_refused() {
    for (table, words) in [
        ("[[0, 0.6], [0.6, 0.5]]", &["'high.-z'", "1.1"][..]),
        ("[[0, -0.1], [0.5, 0]]", &["between 0 and 1"]),
        ("[[0, 1.5], [0.5, 0]]", &["between 0 and 1"]),
        ("[[0, 0.5]]", &["1 rows for 2"]),
        ("[[0, 0.5], [0.5]]", &["1 entries for 2"]),
        ("[[0, 0.5], [0.3, 0]]", &["0.5", "0.3", "must be 0.5"]),
        ("[[0, '?'], ['?', 0]]", &["does not follow", "closed = true"]),
        ("[[0, 'x'], [0.5, 0]]", &["view_factors[1][2]"]),
        ("'guess'", &["computed"]),
        ("0.5", &["list"]),
    ] {
        let text = error(&enclosure(&format!("{PAIR}\nview_factors = {table}")));
        for word in words {
            assert!(text.contains(word), "{table}: {text}");
        }
        assert!(text.contains("enclosure.gap"), "{text}");
    }
    let closed = |table: &str| error(&enclosure(&format!("{PAIR}\nclosed = true\nview_factors = {table}")));
    assert!(closed("[[0, 0.9], [0.9, 0]]").contains("sum to 0.9"));
    assert!(closed("'computed'").contains("leaves the enclosure"));
    assert!(closed("[[0, 0.4], ['?', 0]]").contains("sum to 0.4"));
}

#[test]
fn bad_surfaces_are_refused() {
    let table = "view_factors = [[0]]";
    for (surfaces, word) in [
        ("[]", "no surface"),
        ("[{ face = 'low.top', emissivity = 0.5 }]", "no side 'top'"),
        ("[{ face = 'lid.+z', emissivity = 0.5 }]", "no part or node 'lid'"),
        ("[{ face = 'low.+z', emissivity = 0 }]", "above 0"),
        ("[{ face = 'low.+z', emissivity = 1.2 }]", "at most at 1"),
        ("[{ face = 'low.+z' }]", "'emissivity' is missing"),
        ("[{ emissivity = 0.5 }]", "nowhere"),
        ("[{ face = 'low.+z', node = 'lump', emissivity = 0.5 }]", "exclude"),
        ("[{ node = 'lump', emissivity = 0.5 }]", "area"),
        ("[{ face = 'low.+z', area = '1 m2', emissivity = 0.5 }]", "open area"),
        ("[{ node = 'lump', area = '1 m2', patches = [2, 2], emissivity = 0.5 }]", "cut"),
        ("[{ face = 'low.+z', patches = [2, 2], emissivity = 0.5 }]", "patches"),
        ("[{ face = 'low.+z', patches = [2], emissivity = 0.5 }]", "two whole numbers"),
        ("[{ face = 'low.+z', emissivity = 0.5 }, { part = 'low', emissivity = 0.5 }]", "already"),
        ("[{ face = 'low.+z', emissivity = 0.5 }, { face = 'low[1].+z', emissivity = 0.5 }]", "already"),
        ("[{ chamber = true, area = '9 m2', emissivity = 0.5 }, { face = 'low.+z', emissivity = 0.5 }]", "last"),
        ("[{ face = 'low.+z', emissivity = 0.5, colour = 'black' }]", "colour"),
    ] {
        let text = error(&enclosure(&format!("surfaces = {surfaces}\n{table}")));
        assert!(text.contains(word), "{surfaces}: {text}");
    }
    let lump = "surfaces = [{ node = 'lump', area = '1 m2', emissivity = 0.5 }]\nview_factors = 'computed'";
    assert!(error(&enclosure(lump)).contains("no shape"));
    assert!(error(&enclosure(&format!("{PAIR}\nview_factors = [[0, 0.5], [0.5, 0]]\nrays = 1000"))).contains("no rays"));
    assert!(error(&enclosure(&format!("{PAIR}\nview_factors = 'computed'\nrays = 3"))).contains("at least 16"));
    // A wall smaller than what looks at it.
    let small = "surfaces = [{ face = 'low.+z', emissivity = 0.5 }, { chamber = true, area = '0.1 m2', emissivity = 0.5 }]\nview_factors = 'computed'";
    assert!(error(&enclosure(small)).contains("smaller than what looks at it"));
    // In two enclosures.
    let twice = format!("{PAIR}\nview_factors = 'computed'\n[enclosure.other]\n{PAIR}\nview_factors = 'computed'");
    assert!(error(&enclosure(&twice)).contains("already"));
}

#[test]
fn enclosures_are_read() {
    let text = enclosure(
        "surfaces = [{ face = 'low.+z', emissivity = 0.5, patches = [3, 2] }, { part = 'high', emissivity = 0.4 }, { chamber = true, area = '9 m2', emissivity = 0.3 }]
view_factors = 'rays'\nrays = 5000",
    );
    let machine: Machine = text.parse().unwrap();
    let read = &machine.enclosures[0];
    assert!(read.closed && read.cache.is_none() && read.surfaces[0].patches == [3, 2] && read.surfaces[2].place.is_none());
    assert!(matches!(read.views, Views::Computed { rays: 5000, closed_forms: false }));
    let network = Network::build(&machine, &Mesh::with_size(&machine, 0.1).unwrap()).unwrap();
    let views = &network.enclosures[0];
    assert_eq!((views.surfaces.len(), views.patches), (2, 7));
    // The upper plate: six faces, 2.4 m2.
    assert!((views.areas[1] - 2.4).abs() < 1e-9);
}
