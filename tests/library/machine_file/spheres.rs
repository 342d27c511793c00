//! Spheres: what is read and what is refused.

use coldplate_describe::machine::{BlockShape, Machine, Side};
use coldplate_network::Network;
use coldplate_network::mesh::Mesh;

fn with(rest: &str) -> String {
    format!("name = 'ball'\n[part.ball]\nmaterial = 'steel'\n{rest}\n")
}

#[test]
fn spheres_are_read() {
    let text = with(
        "sphere = { outer_diameter = '50 mm', inner = '5 mm' }\nat = ['0.1 m', '0 m', '0 m']\nsurface = { emissivity = 0.3, excluded = ['inner'] }",
    );
    let machine: Machine = text.parse().unwrap();
    assert_eq!(machine.parts[0].blocks[0].shape, BlockShape::Sphere { centre: [0.1, 0.0, 0.0], inner: 0.005, outer: 0.025 });
    assert_eq!(machine.parts[0].surface.excluded[0].side, Side::Low0);
    // Standing on a plate, it touches it from above, in the middle.
    let text = with("sphere = { outer = '20 mm' }\non = 'plate.+z'\n[part.plate]\nmaterial = 'steel'\nbox = ['0.1 m', '0.2 m', '10 mm']");
    let machine: Machine = text.parse().unwrap();
    let BlockShape::Sphere { centre, .. } = machine.parts[0].blocks[0].shape else { panic!("no sphere") };
    assert!((centre[0] - 0.05).abs() + (centre[1] - 0.1).abs() + (centre[2] - 0.03).abs() < 1e-15, "{centre:?}");
}

#[test]
fn bad_spheres_are_refused_with_a_remedy() {
    let radius = "sphere = { outer = '20 mm' }";
    for (rest, word) in [
        ("sphere = { inner = '5 mm' }".to_string(), "outer"),
        ("sphere = { outer = '20 mm', inner = '20 mm' }".into(), "inner"),
        ("sphere = { outer = '-20 mm' }".into(), "larger than zero"),
        ("sphere = { outer = '20 mm', axis = 'z' }".into(), "axis"),
        (format!("{radius}\ncells = [4, 4, 2]"), "radius"),
        (format!("{radius}\nbox = ['1 mm', '1 mm', '1 mm']"), "exclude"),
        (format!("{radius}\nsurface = {{ emissivity = 0.3, excluded = ['inner'] }}"), "side"),
        (format!("{radius}\n[boundary.b]\nfaces = ['ball.start']\ntemperature = '20 degC'"), "side"),
        (format!("{radius}\n[sensor.s]\nin = 'ball'\npoint = ['21 mm', '0 mm', '0 mm']"), "outside"),
        (format!("{radius}\n[part.top]\nmaterial = 'steel'\non = 'ball.outer'\nbox = ['1 mm', '1 mm', '1 mm']"), "plane"),
        (
            format!(
                "{radius}\n[channel.c]\nin = 'ball'\ndiameter = '2 mm'\npath = [['-10 mm', '0 mm', '0 mm'], ['10 mm', '0 mm', '0 mm']]"
            ),
            "radius alone",
        ),
    ] {
        let error = with(&rest).parse::<Machine>().expect_err(&rest).to_string();
        assert!(error.contains(word) && error.contains("machine.toml"), "{rest}\n{error}");
    }
}

/// A ball touches a plate in a point: a contact between them needs an area.
#[test]
fn a_contact_in_a_point_needs_an_area() {
    let text = |area: &str| {
        with(&format!(
            "sphere = {{ outer = '20 mm' }}\non = 'plate.+z'\n[part.plate]\nmaterial = 'steel'\nbox = ['0.1 m', '0.2 m', '10 mm']\n\
             [contact.seat]\nbetween = ['ball.outer', 'plate.+z']\nconductance = '500 W/(m2 K)'\n{area}"
        ))
    };
    let build = |area: &str| {
        let machine: Machine = text(area).parse().unwrap();
        Network::build(&machine, &Mesh::with_size(&machine, 5e-3).unwrap())
    };
    let error = build("").unwrap_err().to_string();
    assert!(error.contains("do not touch") && error.contains("area") && error.contains("contact.seat"), "{error}");
    assert!(build("area = '3 mm2'").is_ok());
}
