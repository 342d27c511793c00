//! Which pairs of blocks share volume: cases that can be decided by hand.

use coldplate_describe::machine::Machine;

fn overlap(a: &str, b: &str) -> bool {
    let part = |name: &str, block: &str| format!("[part.{name}]\nmaterial = 'steel'\nblocks = [{{ {block} }}]\n");
    let text = format!("name = 'pair'\n{}{}", part("a", a), part("b", b));
    match text.parse::<Machine>() {
        Ok(_) => false,
        Err(error) => {
            assert!(error.what().contains("overlap"), "{error}");
            true
        }
    }
}

/// A cylinder about z through the origin, radii and length in mm, angles in degrees.
fn cylinder(inner: i32, outer: i32, turn: (i32, i32)) -> String {
    format!(
        "cylinder = {{ axis = 'z', inner = '{inner} mm', outer = '{outer} mm', length = '50 mm', turn = ['{} deg', '{} deg'] }}",
        turn.0, turn.1
    )
}

fn cube(size: i32, at: [i32; 3]) -> String {
    format!("box = ['{size} mm', '{size} mm', '{size} mm'], at = ['{} mm', '{} mm', '{} mm']", at[0], at[1], at[2])
}

const FULL: (i32, i32) = (0, 360);

#[test]
fn boxes() {
    assert!(!overlap(&cube(10, [0, 0, 0]), &cube(10, [10, 0, 0])));
    assert!(overlap(&cube(10, [0, 0, 0]), &cube(10, [9, 9, 9])));
    assert!(overlap(&cube(10, [0, 0, 0]), &cube(2, [4, 4, 4])));
}

#[test]
fn cylinders_about_one_axis() {
    assert!(!overlap(&cylinder(0, 20, FULL), &cylinder(20, 30, FULL)));
    assert!(overlap(&cylinder(0, 20, FULL), &cylinder(19, 30, FULL)));
    assert!(!overlap(&cylinder(0, 20, (0, 180)), &cylinder(0, 20, (180, 360))));
    assert!(overlap(&cylinder(0, 20, (0, 181)), &cylinder(0, 20, (180, 360))));
    assert!(!overlap(&cylinder(0, 20, (-90, 90)), &cylinder(0, 20, (90, 270))));
    assert!(overlap(&cylinder(0, 20, (-90, 90)), &cylinder(0, 20, (300, 330))));
}

#[test]
fn cylinders_side_by_side_inside_and_crossed() {
    let beside = |x: i32| format!("{}, at = ['{x} mm', '0 mm', '0 mm']", cylinder(0, 10, FULL));
    assert!(!overlap(&cylinder(0, 20, FULL), &beside(30)));
    assert!(overlap(&cylinder(0, 20, FULL), &beside(29)));
    assert!(!overlap(&cylinder(15, 20, FULL), &beside(5)));
    assert!(overlap(&cylinder(15, 20, FULL), &beside(6)));
    let crossed = |y: i32| format!("cylinder = {{ axis = 'x', outer = '10 mm', length = '50 mm' }}, at = ['-25 mm', '{y} mm', '25 mm']");
    assert!(overlap(&cylinder(0, 20, FULL), &crossed(0)));
    assert!(!overlap(&cylinder(0, 20, FULL), &crossed(30)));
}

#[test]
fn boxes_and_cylinders() {
    let ring = cylinder(20, 30, FULL);
    assert!(!overlap(&ring, &cube(20, [-10, -10, 10])), "the cube's corners lie at a radius of 14.1 mm");
    assert!(overlap(&ring, &cube(30, [-15, -15, 10])), "the cube's corners lie at a radius of 21.2 mm");
    // The corner of the bounding boxes is shared, the cylinder's round is not: 22 sqrt(2) = 31.1 mm.
    assert!(!overlap(&ring, &cube(10, [22, 22, 10])));
    assert!(overlap(&ring, &cube(10, [21, 21, 10])));
    assert!(!overlap(&cylinder(20, 30, (0, 90)), &cube(20, [-30, -30, 10])));
    assert!(overlap(&cylinder(20, 30, (180, 270)), &cube(20, [-30, -30, 10])));
}

/// A shell about the origin moved along x, mm.
fn sphere(inner: i32, outer: i32, x: i32) -> String {
    format!("sphere = {{ inner = '{inner} mm', outer = '{outer} mm' }}, at = ['{x} mm', '0 mm', '0 mm']")
}

#[test]
fn spheres() {
    assert!(!overlap(&sphere(0, 10, 0), &sphere(0, 10, 20)) && overlap(&sphere(0, 10, 0), &sphere(0, 10, 19)));
    // Within the hole of another, and through its wall.
    assert!(!overlap(&sphere(20, 30, 0), &sphere(0, 10, 10)) && overlap(&sphere(20, 30, 0), &sphere(0, 10, 11)));
    assert!(!overlap(&sphere(20, 30, 0), &sphere(10, 20, 0)) && overlap(&sphere(20, 30, 0), &sphere(10, 21, 0)));
    // A cube of 10 mm whose nearest edge lies at 7, 7: sqrt(98) = 9.9 mm.
    assert!(overlap(&sphere(0, 10, 0), &cube(10, [7, 7, -5])) && !overlap(&sphere(0, 9, 0), &cube(10, [7, 7, -5])));
    // One that fits into the hole: its corners lie at sqrt(75) = 8.7 mm.
    assert!(!overlap(&sphere(9, 12, 0), &cube(10, [-5, -5, -5])) && overlap(&sphere(8, 12, 0), &cube(10, [-5, -5, -5])));
    // In the bore of a tube, and through its wall; the tube runs from 0 to 50 mm.
    assert!(!overlap(&cylinder(20, 30, FULL), &sphere(0, 20, 0)) && overlap(&cylinder(20, 30, FULL), &sphere(0, 20, 1)));
    assert!(!overlap(&cylinder(0, 20, FULL), &sphere(0, 10, 30)) && overlap(&cylinder(0, 20, FULL), &sphere(0, 10, 29)));
    // A rod within the hole: its far corners lie at 53.9 mm.
    assert!(!overlap(&cylinder(0, 20, FULL), &sphere(54, 60, 0)) && overlap(&cylinder(0, 20, FULL), &sphere(53, 60, 0)));
    assert!(overlap(&cylinder(0, 20, (-90, 90)), &sphere(0, 10, 25)) && !overlap(&cylinder(0, 20, (90, 270)), &sphere(0, 10, 25)));
}
