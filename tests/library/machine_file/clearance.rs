//! Channels that cannot be drilled are refused, with the place and what to do.

use coldplate_describe::machine::Machine;

/// A plate of 200 x 100 x 20 mm with channels, one after the other in one circuit.
fn plate(channels: &[(&str, &str)]) -> Result<Machine, coldplate::Error> {
    let names: Vec<String> = channels.iter().map(|(name, _)| format!("\"{name}\"")).collect();
    let tables: String = channels.iter().map(|(name, keys)| format!("[channel.{name}]\nin = \"plate\"\n{keys}\n")).collect();
    format!(
        "name = \"plate\"\n[part.plate]\nmaterial = \"aluminium\"\nbox = [\"200 mm\", \"100 mm\", \"20 mm\"]\n{tables}\
         [circuit.water]\nlayout = [{}]\n",
        names.join(", ")
    )
    .parse()
}

fn path(diameter: &str, corners: &[[f64; 3]]) -> String {
    let corners: Vec<String> = corners.iter().map(|c| format!("[\"{} mm\", \"{} mm\", \"{} mm\"]", c[0], c[1], c[2])).collect();
    format!("diameter = \"{diameter}\"\npath = [{}]", corners.join(", "))
}

fn refused(found: Result<Machine, coldplate::Error>, what: &[&str]) {
    let error = found.err().unwrap_or_else(|| panic!("{what:?} is accepted"));
    let text = format!("{error}");
    what.iter().for_each(|w| assert!(text.contains(w), "'{w}' is missing in: {text}"));
    assert!(error.location().line.is_some() && error.remedy().is_some(), "{text}");
}

const THROUGH: [[f64; 3]; 2] = [[0.0, 50.0, 10.0], [200.0, 50.0, 10.0]];

#[test]
fn a_bore_wider_than_its_plate() {
    plate(&[("hole", &path("8 mm", &THROUGH))]).unwrap();
    plate(&[("hole", &path("19.9 mm", &THROUGH))]).unwrap();
    for diameter in ["20 mm", "30 mm", "100 mm", "1 m"] {
        let what: &[&str] = if diameter == "1 m" { &["wider than it is long"] } else { &["breaks through", "channel.hole.path"] };
        refused(plate(&[("hole", &path(diameter, &THROUGH))]), what);
    }
    refused(plate(&[("hole", &path("30 mm", &THROUGH))]), &["5 mm outside", "below 20 mm"]);
    refused(plate(&[("hole", &path("8 mm", &[[0.0, 50.0, 3.0], [200.0, 50.0, 3.0]]))]), &["1 mm outside", "below 6 mm"]);
}

#[test]
fn a_bore_may_leave_its_part_only_where_its_path_ends_at_a_face() {
    // Straight and slanting mouths.
    plate(&[("hole", &path("8 mm", &[[0.0, 50.0, 10.0], [100.0, 50.0, 10.0], [100.0, 50.0, 20.0]]))]).unwrap();
    plate(&[("hole", &path("6 mm", &[[0.0, 20.0, 10.0], [60.0, 60.0, 10.0], [70.0, 60.0, 20.0]]))]).unwrap();
    // Along a face there is no mouth, and a bend at a face is none either.
    refused(plate(&[("hole", &path("8 mm", &[[10.0, 0.0, 10.0], [100.0, 0.0, 10.0]]))]), &["breaks through", "4 mm outside"]);
    refused(
        plate(&[("hole", &path("8 mm", &[[10.0, 50.0, 10.0], [190.0, 50.0, 10.0], [190.0, 97.0, 10.0], [10.0, 97.0, 10.0]]))]),
        &["breaks through", "corners 3 and 4"],
    );
}

#[test]
fn passes_nearer_than_the_bore_is_wide() {
    let serpentine = |pitch: &str| {
        format!(
            "diameter = \"8 mm\"\nserpentine = {{ along = \"+x\", across = \"+y\", passes = 5, pitch = \"{pitch}\", margin = \"20 mm\" }}"
        )
    };
    plate(&[("hole", &serpentine("16 mm"))]).unwrap();
    plate(&[("hole", &serpentine("8.1 mm"))]).unwrap();
    refused(plate(&[("hole", &serpentine("7 mm"))]), &["passes itself", "7 mm apart", "channel.hole.serpentine"]);
    // A path that crosses itself, and one that runs back on itself.
    let crossing = [[10.0, 50.0, 10.0], [150.0, 50.0, 10.0], [150.0, 80.0, 10.0], [80.0, 80.0, 10.0], [80.0, 10.0, 10.0]];
    refused(plate(&[("hole", &path("4 mm", &crossing))]), &["passes itself", "[80 mm, 50 mm, 10 mm]"]);
    refused(plate(&[("hole", &path("4 mm", &[[10.0, 50.0, 10.0], [150.0, 50.0, 10.0], [20.0, 50.0, 10.0]]))]), &["passes itself"]);
}

#[test]
fn a_polygon_for_a_coil_is_no_crossing() {
    let turn = |i: i32| {
        let angle = f64::from(i) * 0.1;
        [100.0 + 30.0 * angle.cos(), 50.0 + 30.0 * angle.sin(), 10.0]
    };
    let corners: Vec<[f64; 3]> = (0..50).map(turn).collect();
    plate(&[("hole", &path("8 mm", &corners))]).unwrap();
    let corners: Vec<[f64; 3]> = (0..64).map(turn).collect();
    refused(plate(&[("hole", &path("8 mm", &corners))]), &["passes itself"]);
}

#[test]
fn channels_that_meet() {
    refused(plate(&[("a", &path("8 mm", &THROUGH)), ("b", &path("8 mm", &THROUGH))]), &["'a' and 'b' run into each other"]);
    let beside = |y: f64| path("8 mm", &[[0.0, y, 10.0], [200.0, y, 10.0]]);
    plate(&[("a", &path("8 mm", &THROUGH)), ("b", &beside(58.1))]).unwrap();
    refused(plate(&[("a", &path("8 mm", &THROUGH)), ("b", &beside(57.0))]), &["7 mm apart", "need 8 mm", "channel.b.path"]);
    let across = path("4 mm", &[[60.0, 0.0, 10.0], [60.0, 100.0, 10.0]]);
    refused(plate(&[("a", &path("8 mm", &THROUGH)), ("b", &across)]), &["run into each other", "[60 mm, 50 mm, 10 mm]"]);
    // One after the other they may meet at their ends, not run back through each other.
    let half = |from: f64, to: f64| path("8 mm", &[[from, 50.0, 10.0], [to, 50.0, 10.0]]);
    plate(&[("a", &half(0.0, 100.0)), ("b", &half(100.0, 200.0))]).unwrap();
    refused(plate(&[("a", &half(0.0, 100.0)), ("b", &half(100.0, 5.0))]), &["run into each other"]);
}

#[test]
fn bores_in_cylinders() {
    let rod = |inner: &str, at: f64, diameter: &str| -> Result<Machine, coldplate::Error> {
        format!(
            "name = \"rod\"\n[part.rod]\nmaterial = \"steel\"\ncylinder = {{ axis = \"z\", inner = \"{inner}\", outer = \"20 mm\", length = \"100 mm\" }}\n\
             [channel.hole]\nin = \"rod\"\n{}\n[circuit.water]\nlayout = [\"hole\"]\n",
            path(diameter, &[[at, 0.0, 0.0], [at, 0.0, 100.0]])
        )
        .parse()
    };
    rod("0 mm", 0.0, "39 mm").unwrap();
    refused(rod("0 mm", 0.0, "41 mm"), &["breaks through", "0.5 mm outside"]);
    rod("0 mm", 12.0, "15 mm").unwrap();
    refused(rod("0 mm", 12.0, "17 mm"), &["breaks through", "below 16 mm"]);
    rod("8 mm", 14.0, "11 mm").unwrap();
    refused(rod("8 mm", 12.0, "9 mm"), &["breaks through", "below 8 mm"]);
    // Across the axis, in by one side and out by the other.
    let across = "name = \"rod\"\n[part.rod]\nmaterial = \"steel\"\ncylinder = { axis = \"z\", outer = \"20 mm\", length = \"100 mm\" }\n\
                  [channel.hole]\nin = \"rod\"\ndiameter = \"10 mm\"\npath = [[\"-20 mm\", \"0 mm\", \"50 mm\"], [\"20 mm\", \"0 mm\", \"50 mm\"]]\n\
                  [circuit.water]\nlayout = [\"hole\"]\n";
    across.parse::<Machine>().unwrap();
}
