//! View factors from the geometry: rays against closed forms, what stands in the way, and the file they are kept in.

use crate::bench::{check, model};
use coldplate_describe::machine::Machine;
use coldplate_network::mesh::Mesh;
use coldplate_network::{EnclosureViews, Network};
use coldplate_physics::view_factors;
use std::f64::consts::PI;

/// The view factors of the one enclosure of some parts; `surfaces` are faces.
#[track_caller]
fn views(parts: &str, surfaces: &[&str], how: &str) -> EnclosureViews {
    let list: Vec<String> = surfaces.iter().map(|f| format!("{{ face = '{f}', emissivity = 0.5 }}")).collect();
    let text = format!("{parts}\n[contacts]\ndefault = 'insulated'\n[enclosure.e]\nsurfaces = [{}]\n{how}\n", list.join(", "));
    model(&text, 0.05).network.enclosures[0].clone()
}

fn block(name: &str, size: [f64; 3], at: [f64; 3]) -> String {
    let length = |v: [f64; 3]| format!("['{} m', '{} m', '{} m']", v[0], v[1], v[2]);
    format!("[part.{name}]\nmaterial = 'steel'\nbox = {}\nat = {}\n", length(size), length(at))
}

fn tube(name: &str, radii: [f64; 2], length: f64, rest: &str) -> String {
    let shape = format!("axis = 'z', inner = '{} m', outer = '{} m', length = '{length} m'", radii[0], radii[1]);
    format!(
        "[part.{name}]\nmaterial = 'steel'\ncylinder = {{ {shape}{} }}\n",
        if rest.is_empty() { String::new() } else { format!(", {rest}") }
    )
}

/// By rays to 1e-3 and within five standard errors; where `closed`, in closed form to 1e-9.
#[track_caller]
fn compare(what: &str, parts: &str, surfaces: &[&str], exact: &[(usize, usize, f64)], closed: bool) {
    let rays = views(parts, surfaces, "view_factors = 'rays'\nrays = 400000");
    assert!(rays.by_rays > 0 && rays.error < 6e-4, "{rays:?}");
    for (i, j, f) in exact {
        let found = rays.view_factors[*i][*j];
        check("own", &format!("{what}, by rays: F{}{}", i + 1, j + 1), found, *f, 1.0, 1e-3);
        assert!((found - f).abs() < 5.0 * rays.error + 1e-6, "{what}: {found} {f}, error {}", rays.error);
    }
    for (i, a) in rays.areas.iter().enumerate() {
        assert!((rays.view_factors[i].iter().sum::<f64>() + rays.chamber[i] - 1.0).abs() < 1e-12);
        for (j, b) in rays.areas.iter().enumerate() {
            assert!((a * rays.view_factors[i][j] - b * rays.view_factors[j][i]).abs() < 1e-14 * a.max(*b));
        }
    }
    if closed {
        let forms = views(parts, surfaces, "view_factors = 'computed'");
        assert_eq!(forms.by_rays, 0, "{what}");
        for (i, j, f) in exact {
            check("own", &format!("{what}: F{}{}", i + 1, j + 1), forms.view_factors[*i][*j], *f, 1.0, 1e-9);
        }
    }
}

#[test]
fn rectangles() {
    let pair = |a: [f64; 2], gap: f64| block("low", [a[0], a[1], 0.1], [0.0; 3]) + &block("high", [a[0], a[1], 0.1], [0.0, 0.0, 0.1 + gap]);
    let faces = ["low.+z", "high.-z"];
    compare("cube, opposite", &pair([1.0, 1.0], 1.0), &faces, &[(0, 1, 0.199824895698), (1, 0, 0.199824895698), (0, 0, 0.0)], true);
    compare("close plates", &pair([0.5, 0.5], 0.05), &faces, &[(0, 1, 0.826994522397)], true);
    let corner = block("floor", [1.0, 1.0, 0.1], [0.0, 0.0, -0.1]) + &block("wall", [0.1, 1.0, 1.0], [-0.1, 0.0, 0.0]);
    compare("cube, adjacent", &corner, &["floor.+z", "wall.+x"], &[(0, 1, 0.200043776075)], true);
    let apart = block("a", [0.3, 0.2, 0.1], [0.1, 0.0, -0.1]) + &block("b", [0.4, 0.35, 0.1], [0.25, 0.15, 0.25]);
    let f = 0.144047077811;
    compare("parallel, apart", &apart, &["a.+z", "b.-z"], &[(0, 1, f), (1, 0, f * 0.06 / 0.14)], true);
    let apart = block("a", [0.3, 0.2, 0.1], [0.05, 0.1, -0.1]) + &block("b", [0.1, 0.4, 0.15], [-0.1, 0.2, 0.1]);
    compare("perpendicular, apart", &apart, &["b.+x", "a.+z"], &[(1, 0, 0.05889715726), (0, 1, 0.05889715726)], true);
    // Back to back, and beside each other: nothing.
    let none = views(&pair([1.0, 1.0], 1.0), &["low.-z", "high.-z", "low.+x", "high.+x"], "view_factors = 'computed'");
    assert!(none.view_factors.iter().flatten().all(|f| *f == 0.0) && none.chamber.iter().all(|f| *f == 1.0), "{none:?}");
}

#[test]
fn cylinders_discs_and_spheres() {
    let gap = tube("core", [0.05, 0.1], 0.3, "") + &tube("shell", [0.25, 0.3], 0.3, "");
    let [_, f12, f21, f22] = view_factors::coaxial_cylinders(0.1, 0.25, 0.3);
    compare("coaxial cylinders", &gap, &["core.outer", "shell.inner"], &[(0, 0, 0.0), (0, 1, f12), (1, 0, f21), (1, 1, f22)], false);
    let forms = views(&gap, &["core.outer", "shell.inner"], "view_factors = 'computed'");
    check("own", "coaxial cylinders: F12", forms.view_factors[0][1], f12, 1.0, 1e-9);
    // The shell in two halves.
    let halves = tube("core", [0.05, 0.1], 0.3, "")
        + &tube("east", [0.25, 0.3], 0.3, "turn = ['-90 deg', '90 deg']")
        + &tube("west", [0.25, 0.3], 0.3, "turn = ['90 deg', '270 deg']");
    compare("shell in halves", &halves, &["core.outer", "east.inner", "west.inner"], &[(0, 1, f12 / 2.0), (0, 2, f12 / 2.0)], false);
    // A can: two discs and the inside of a tube between them.
    let can = tube("side", [0.1, 0.11], 0.25, "")
        + &tube("bottom", [0.0, 0.1], 0.02, "")
        + "at = ['0 m', '0 m', '-20 mm']\n"
        + &tube("top", [0.0, 0.1], 0.02, "")
        + "at = ['0 m', '0 m', '0.25 m']\n";
    let (across, end) = (view_factors::coaxial_discs(0.1, 0.1, 0.25), view_factors::end_to_cylinder(0.1, 0.25));
    let exact = [(0, 1, across), (0, 2, end), (1, 2, end), (2, 2, view_factors::cylinder_to_itself(0.1, 0.25))];
    compare("can", &can, &["bottom.end", "top.start", "side.inner"], &exact, false);
    let discs = tube("a", [0.0, 0.075], 0.02, "") + &tube("b", [0.0, 0.05], 0.02, "") + "at = ['0 m', '0 m', '95 mm']\n";
    compare("V19's discs", &discs, &["a.end", "b.start"], &[(0, 1, 0.197828393634)], true);
    let sphere =
        |name: &str, r: [f64; 2]| format!("[part.{name}]\nmaterial = 'steel'\nsphere = {{ inner = '{} m', outer = '{} m' }}\n", r[0], r[1]);
    let shells = sphere("core", [0.0, 0.1]) + &sphere("shell", [0.25, 0.3]);
    compare("spheres", &shells, &["core.outer", "shell.inner"], &[(0, 1, 1.0), (1, 0, 0.16), (1, 1, 0.84)], false);
    let over = sphere("ball", [0.0, 0.1]) + &tube("disc", [0.0, 0.2], 0.01, "") + "at = ['0 m', '0 m', '0.15 m']\n";
    compare("sphere over a disc", &over, &["ball.outer", "disc.start"], &[(0, 1, view_factors::sphere_to_disc(0.2, 0.15))], false);
}

/// The view from one plate to another is blocked by a plate between, and halved by a wall between.
#[test]
fn what_stands_in_the_way() {
    let plates = block("low", [1.0, 1.0, 0.1], [0.0, 0.0, -0.1]) + &block("high", [1.0, 1.0, 0.1], [0.0, 0.0, 1.0]);
    let screen = block("screen", [3.0, 3.0, 0.01], [-1.0, -1.0, 0.5]);
    let faces = ["low.+z", "high.-z", "screen.-z", "screen.+z"];
    let found = views(&(plates.clone() + &screen), &faces, "view_factors = 'computed'\nrays = 100000");
    assert!(found.view_factors[0][1] == 0.0 && found.view_factors[0][3] == 0.0 && found.view_factors[2][1] == 0.0);
    check(
        "own",
        "plate to a wide screen: F",
        found.view_factors[0][2],
        view_factors::parallel_plane([(0.0, 1.0); 2], [(-1.0, 2.0); 2], 0.5),
        1.0,
        1e-9,
    );
    // A screen that is no surface of the enclosure counts as chamber, and the report says so.
    let found = views(&(plates.clone() + &screen), &["low.+z", "high.-z"], "view_factors = 'computed'");
    assert!(
        found.view_factors[0][1] == 0.0 && (found.chamber[0] - 1.0).abs() < 1e-15 && found.notes[0].contains("outside the enclosure"),
        "{found:?}"
    );
    // A thin wall along the middle, 1 mm thick: each half sees its own half alone.
    let wall = block("wall", [1e-3, 1.0, 1.0], [0.4995, 0.0, 0.0]);
    let found = views(&(plates + &wall), &["low.+z", "high.-z"], "view_factors = 'computed'\nrays = 400000");
    let half = [(0.0, 0.4995), (0.0, 1.0)];
    let exact = view_factors::parallel_plane(half, half, 1.0);
    check("own", "plates with a wall between: F", found.view_factors[0][1], exact, 1.0, 5e-4);
    assert!((found.areas[0] - 0.999).abs() < 1e-9, "the wall covers 1 mm of the plates");
}

/// A closed box whose plates cover each other at the edges: only the open part of a face takes part.
#[test]
fn covered_parts_of_faces_take_no_part() {
    let box_of = [
        block("left", [0.1, 1.0, 1.0], [-0.1, 0.0, 0.0]),
        block("right", [0.1, 1.0, 1.0], [1.0, 0.0, 0.0]),
        block("front", [1.2, 0.1, 1.2], [-0.1, -0.1, -0.1]),
        block("back", [1.2, 0.1, 1.2], [-0.1, 1.0, -0.1]),
        block("floor", [1.2, 1.0, 0.1], [-0.1, 0.0, -0.1]),
        block("roof", [1.2, 1.0, 0.1], [-0.1, 0.0, 1.0]),
    ];
    let faces = ["left.+x", "right.-x", "front.+y", "back.-y", "floor.+z", "roof.-z"];
    let found = views(&box_of.concat(), &faces, "view_factors = 'computed'\nrays = 200000\nclosed = true");
    for i in 0..6 {
        assert!((found.areas[i] - 1.0).abs() < 1e-9, "{found:?}");
        for j in 0..6 {
            let exact = if i == j {
                0.0
            } else if i / 2 == j / 2 {
                0.199824895698
            } else {
                0.200043776075
            };
            check("own", &format!("covered edges: F{}{}", i + 1, j + 1), found.view_factors[i][j], exact, 1.0, 5e-4);
        }
    }
}

/// Bit for bit the same with one thread and with four.
#[test]
fn rays_do_not_depend_on_threads() {
    let parts = tube("core", [0.05, 0.1], 0.3, "") + &tube("shell", [0.25, 0.3], 0.3, "");
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("no threads");
        pool.install(|| views(&parts, &["core.outer", "shell.inner"], "view_factors = 'rays'\nrays = 50000"))
    };
    assert_eq!(with(1), with(4));
}

/// The file next to the machine file: written, read again, replaced when the geometry changes or it is damaged.
#[test]
fn rays_are_kept_in_a_file() {
    let folder = std::env::temp_dir().join(format!("coldplate-views-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("no folder");
    let file = folder.join("gap.toml");
    let text = |radius: f64, extra: &str| {
        let parts = tube("core", [0.05, 0.1], 0.3, "") + &tube("shell", [radius, 0.3], 0.3, "");
        let surfaces = "[{ face = 'core.outer', emissivity = 0.5 }, { face = 'shell.inner', emissivity = 0.5 }]";
        format!("name = 'gap'\n{parts}[enclosure.'the gap']\nsurfaces = {surfaces}\nview_factors = 'computed'\nrays = 20000\n{extra}\n")
    };
    let build = |text: String| {
        std::fs::write(&file, text).expect("cannot write");
        let machine = Machine::read(&file, &[]).unwrap_or_else(|e| panic!("{e}"));
        let mesh = Mesh::with_size(&machine, 0.05).unwrap_or_else(|e| panic!("{e}"));
        Network::build(&machine, &mesh).unwrap_or_else(|e| panic!("{e}")).enclosures[0].clone()
    };
    let kept = folder.join("gap.the_gap.views");
    let none = build(text(0.25, "cache = false"));
    assert!(!kept.exists());
    let first = build(text(0.25, ""));
    assert!(kept.exists() && first == none);
    assert_eq!(build(text(0.25, "")), first);
    // What is read is what stands in the file: another number in it shows, with its checksum.
    let body = std::fs::read_to_string(&kept).expect("cannot read");
    let (lines, _) = body.trim_end().rsplit_once("\nchecksum ").expect("no checksum");
    let (rest, last) = lines.rsplit_once('\n').expect("no line");
    let mut numbers: Vec<f64> = last.split(' ').map(|n| n.parse().expect("no number")).collect();
    // Of the shell: escaped, strayed, open, then shares of core and shell.
    (numbers[0], numbers[4]) = (numbers[0] - 0.1, numbers[4] + 0.1);
    let line: Vec<String> = numbers.iter().map(|n| format!("{n:?}")).collect();
    let changed = format!("{rest}\n{}", line.join(" "));
    std::fs::write(&kept, format!("{changed}\nchecksum {:08x}\n", crc32fast::hash(changed.as_bytes()))).expect("cannot write");
    let other = build(text(0.25, ""));
    assert!((other.view_factors[1][1] - first.view_factors[1][1] - 0.1).abs() < 1e-3, "{other:?}");
    // Damage: cut off, one byte changed, another kind of file. The result is that without a file; a note says so.
    for damaged in [&body[..body.len() / 2], &body.replace("0.", "1."), "", "\u{0}\u{1}"] {
        std::fs::write(&kept, damaged).expect("cannot write");
        let again = build(text(0.25, ""));
        assert!(again.notes.iter().any(|n| n.contains("damaged")), "{again:?}");
        assert_eq!(again.view_factors, first.view_factors);
        assert_eq!(std::fs::read_to_string(&kept).expect("cannot read"), body);
    }
    // Another geometry: made anew, without a note.
    let wider = build(text(0.28, ""));
    assert!(wider.notes.is_empty() && wider.view_factors != first.view_factors);
    assert_eq!(std::fs::read_dir(&folder).expect("no folder").count(), 2, "nothing else is left behind");
    std::fs::remove_dir_all(&folder).expect("cannot remove");
}

/// Areas by hand.
#[test]
fn areas_of_surfaces() {
    let can = tube("core", [0.05, 0.1], 0.3, "") + &tube("shell", [0.25, 0.3], 0.3, "");
    let found = views(&can, &["core.outer", "shell.inner"], "view_factors = 'computed'\nrays = 1000");
    assert!((found.areas[0] - 2.0 * PI * 0.1 * 0.3).abs() < 1e-12 && (found.areas[1] - 2.0 * PI * 0.25 * 0.3).abs() < 1e-12);
}
