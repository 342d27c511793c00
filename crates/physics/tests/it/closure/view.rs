//! View factors in closed form, and what makes a table of them consistent.

use coldplate_physics::exchange::{RadiationNode, complete, conductors, enforce};
use coldplate_physics::view_factors;
use nalgebra::DMatrix;

use crate::closure::close;

/// V24 by the general formulas, and direct integration of the definition by Gauss's rule (16 points an axis) for
/// rectangles that lie anywhere.
#[test]
fn rectangles_anywhere() {
    let unit = (0.0, 1.0);
    close(view_factors::parallel_plane([unit, unit], [unit, unit], 1.0), 0.199824895698, 1e-11);
    close(view_factors::perpendicular_plane([unit, unit], [unit, unit]), 0.200043776075, 1e-11);
    let half = (0.0, 0.5);
    close(view_factors::parallel_plane([half, half], [half, half], 0.05), 0.826994522397, 1e-11);
    close(view_factors::parallel_plane([(0.1, 0.4), (0.0, 0.2)], [(0.25, 0.65), (0.15, 0.5)], 0.25), 0.144047077811, 1e-10);
    close(view_factors::perpendicular_plane([(0.1, 0.3), (0.05, 0.35)], [(0.2, 0.6), (0.1, 0.25)]), 0.05889715726, 1e-8);
    // The special forms are the general ones.
    close(
        view_factors::parallel_plane([(0.2, 0.5), (1.0, 1.2)], [(0.2, 0.5), (1.0, 1.2)], 0.1),
        view_factors::parallel_rectangles(0.3, 0.2, 0.1),
        1e-11,
    );
    close(
        view_factors::perpendicular_plane([(1.0, 1.3), (0.0, 0.2)], [(1.0, 1.3), (0.0, 0.1)]),
        view_factors::perpendicular_rectangles(0.3, 0.2, 0.1),
        1e-11,
    );
}

/// Additivity: what a rectangle sees of two halves is what it sees of the whole; reciprocity.
#[test]
fn rectangles_add_up() {
    let (a, low, high, whole) = ([(0.0, 0.3), (0.1, 0.5)], (-0.4, 0.2), (0.2, 0.9), (-0.4, 0.9));
    let y = (0.3, 0.7);
    let sum = view_factors::parallel_plane(a, [low, y], 0.2) + view_factors::parallel_plane(a, [high, y], 0.2);
    close(sum, view_factors::parallel_plane(a, [whole, y], 0.2), 1e-12);
    let sum = view_factors::perpendicular_plane(a, [low, y]) + view_factors::perpendicular_plane(a, [high, y]);
    close(sum, view_factors::perpendicular_plane(a, [whole, y]), 1e-12);
    close(
        view_factors::parallel_plane([whole, y], a, 0.2) * 1.3 * 0.4,
        view_factors::parallel_plane(a, [whole, y], 0.2) * 0.3 * 0.4,
        1e-12,
    );
    close(
        view_factors::perpendicular_plane([whole, y], a) * 1.3 * 0.4,
        view_factors::perpendicular_plane(a, [whole, y]) * 0.3 * 0.4,
        1e-12,
    );
}

/// Direct integration over the parts that see each other (40 and 120 points an axis, the latter extrapolated).
#[test]
fn finite_coaxial_cylinders() {
    let wide = view_factors::coaxial_cylinders(1.0, 2.5, 3.0);
    close(wide[1], 0.681099179694757, 1e-12);
    close(wide[3], 0.293004, 2e-6);
    let short = view_factors::coaxial_cylinders(0.02, 0.03, 0.014);
    close(short[1], 0.556230069517500, 1e-12);
    close(short[3], 0.100391, 2e-6);
    close(wide[2] * 2.5, wide[1], 1e-14);
    // Very long ones are endless, very short ones see little.
    for (found, endless) in view_factors::coaxial_cylinders(1.0, 2.0, 1e5).into_iter().zip(view_factors::long_cylinders(1.0, 2.0)) {
        assert!((found - endless).abs() < 2e-5, "{found} {endless}");
    }
    assert!(view_factors::coaxial_cylinders(1.0, 2.0, 1e-3)[1] < 1e-3);
}

#[test]
fn ends_spheres_and_rooms() {
    // A cylinder as long as wide: F between the ends 3 - 2 sqrt 2 for r = h (C-41 with S = 3).
    let across = 3.0 - 2.0 * 2f64.sqrt() + 0.0;
    close(view_factors::coaxial_discs(1.0, 1.0, 2.0), across, 1e-12);
    close(view_factors::end_to_cylinder(1.0, 2.0), 1.0 - across, 1e-12);
    close(view_factors::cylinder_to_itself(1.0, 2.0), 1.0 - 0.5 * (1.0 - across), 1e-12);
    // Half of a sphere's radiation goes to a disc without end; a disc at 45 degrees covers (1 - cos 45)/2.
    close(view_factors::sphere_to_disc(1e9, 1.0), 0.5, 1e-8);
    close(view_factors::sphere_to_disc(1.0, 1.0), 0.5 * (1.0 - 0.5f64.sqrt()), 1e-14);
    close(view_factors::element_to_disc(1.0, 1.0), 0.5, 1e-15);
    assert_eq!(view_factors::concentric_spheres(1.0, 2.0), [0.0, 1.0, 0.25, 0.75]);
    assert_eq!(view_factors::body_in_room(1.0, 4.0), [0.0, 1.0, 0.25, 0.75]);
}

/// V19: three entries of nine give the others.
#[test]
fn gaps_in_a_table_are_filled() {
    let pi = std::f64::consts::PI;
    let areas = [pi * 0.075 * 0.075, pi * 0.125 * 0.075f64.hypot(0.025), pi * 0.0025];
    let f13 = view_factors::coaxial_discs(0.075, 0.05, 0.075);
    let mut table = vec![vec![Some(0.0), None, Some(f13)], vec![None; 3], vec![None, None, Some(0.0)]];
    complete(&mut table, &areas, true);
    let full: Vec<Vec<f64>> = table.iter().map(|row| row.iter().map(|f| f.expect("a gap is left")).collect()).collect();
    for i in 0..3 {
        close(full[i].iter().sum::<f64>(), 1.0, 1e-15);
        for j in 0..3 {
            close(areas[i] * full[i][j], areas[j] * full[j][i], 1e-14);
        }
    }
    // Without closure the rows say nothing.
    let mut open = vec![vec![Some(0.0), None], vec![None, Some(0.0)]];
    complete(&mut open, &[1.0, 1.0], false);
    assert!(open[0][1].is_none());
}

/// Noise of one per cent on a cube's exchange areas: sums and symmetry hold afterwards, and the error has not grown.
#[test]
fn consistency_is_enforced() {
    let exact = DMatrix::from_fn(6, 6, |i, j| match (i, j) {
        (i, j) if i == j => 0.0,
        (i, j) if i / 2 == j / 2 => 0.199824895698,
        _ => 0.200043776075,
    });
    let mut noisy = exact.clone();
    for i in 0..6 {
        for j in i + 1..6 {
            noisy[(i, j)] *= 1.0 + 0.01 * (7.0 * i as f64 + 3.0 * j as f64).sin();
            noisy[(j, i)] = noisy[(i, j)];
        }
    }
    let before = (&noisy - &exact).norm();
    let variance = noisy.clone();
    enforce(&mut noisy, &variance, &mut [(0.0, 0.0); 6], &[1.0; 6]);
    for i in 0..6 {
        close(noisy.row(i).sum(), 1.0, 1e-13);
    }
    assert!((&noisy - noisy.transpose()).amax() < 1e-15 && (&noisy - &exact).norm() < before);
    // What is known exactly stays.
    let mut two = DMatrix::from_row_slice(2, 2, &[0.0, 0.3, 0.3, 0.1]);
    let mut rest = [(0.6, 1.0), (0.5, 1.0)];
    enforce(&mut two, &DMatrix::from_row_slice(2, 2, &[0.0, 0.0, 0.0, 1.0]), &mut rest, &[1.0, 1.0]);
    assert!(two[(0, 1)] == 0.3 && (rest[0].0 - 0.7).abs() < 1e-14 && (two[(1, 1)] + rest[1].0 - 0.7).abs() < 1e-14);
}

/// Two surfaces that see nothing else, at any emissivities: 1/[(1-e1)/(e1 A1) + 1/(A1 F) + (1-e2)/(e2 A2)].
#[test]
fn two_surfaces_make_the_known_conductor() {
    let (areas, f) = ([0.5, 2.0], DMatrix::from_row_slice(2, 2, &[0.0, 0.5, 0.5, 1.5]));
    for e in [[0.1, 0.2], [0.1, 0.9], [0.7, 0.9], [1.0, 0.3], [1.0, 0.8], [1.0, 1.0]] {
        let mut resistance = 0.0;
        let list = conductors(&f, &areas, &e);
        assert_eq!(list.len(), 1);
        for t in [list[0].0, list[0].1] {
            if let RadiationNode::Radiosity(i) = t {
                resistance += (1.0 - e[i]) / (e[i] * areas[i]);
            }
        }
        let exact = coldplate_physics::radiation::two_surface(e[0], areas[0], e[1], areas[1], 1.0);
        close(1.0 / (resistance + 1.0 / list[0].2), exact, 1e-13);
    }
}
