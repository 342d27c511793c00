//! Writing and reading: nothing is lost, old files stay readable, what cannot be held is refused.

use std::path::PathBuf;

use coldplate_base::error::Kind;
use coldplate_surrogate::fit::file::{decode, encode, open, write};
use coldplate_surrogate::fit::model::*;

use crate::surrogate::examples::*;

fn fixtures() -> Vec<(&'static str, SurrogateSpec)> {
    vec![
        ("polynomial.cps", small()),
        ("bench-polynomial.cps", ten_polynomials()),
        ("bench-thin-plate.cps", ten_radial(Kernel::ThinPlate, true)),
        ("bench-cubic.cps", ten_radial(Kernel::Cubic, true)),
        ("bench-multiquadric.cps", ten_radial(Kernel::Multiquadric, true)),
        ("bench-gaussian.cps", ten_radial(Kernel::Gaussian, true)),
        ("bench-ten-bases.cps", ten_radial(Kernel::ThinPlate, false)),
        ("held.cps", at_one_speed()),
        ("uncertain.cps", uncertain()),
        ("bench-uncertain.cps", ten_uncertain()),
        ("moving.cps", moving(3, 4)),
        ("bench-moving.cps", moving(23, 24)),
    ]
}

fn fixture(name: &str) -> PathBuf {
    coldplate_testing::root().join("crates/runtime/fixtures").join(name)
}

#[test]
#[ignore = "writes the files of the runtime's example and benchmark; run by hand when the layout's version changes"]
fn write_fixtures() {
    for (name, surrogate) in fixtures() {
        write(&surrogate, &fixture(name)).unwrap();
    }
}

/// Files that were written once, by version 1 of the layout but for the last, must stay readable and mean the same.
#[test]
fn files_written_earlier_read_as_they_were_meant() {
    for (name, surrogate) in fixtures() {
        let bytes = std::fs::read(fixture(name)).unwrap();
        assert_eq!(decode(&bytes).unwrap(), surrogate, "{name}");
    }
}

#[test]
fn reading_gives_back_what_was_written() {
    for surrogate in
        [small(), mixed(), ten_polynomials(), ten_radial(Kernel::Gaussian, false), uncertain(), uncertain_together(), moving(3, 4)]
    {
        let bytes = encode(&surrogate).unwrap();
        assert_eq!(decode(&bytes).unwrap(), surrogate);
        assert_eq!(encode(&surrogate).unwrap(), bytes, "writing must be reproducible");
    }
}

#[test]
fn a_file_of_ten_polynomials_has_a_few_kilobytes() {
    let length = encode(&ten_polynomials()).unwrap().len();
    assert!(length < 10_000, "{length}");
}

#[test]
fn points_with_different_terms_share_a_block() {
    let mut surrogate = small();
    let more = [point(
        "third",
        PointModel::Polynomial(polynomial(&[Transform::Log, Transform::Identity, Transform::Identity], &[&[1, 0, 0]], &[3.0])),
        0.0,
    )];
    surrogate.points.extend(more);
    let bytes = encode(&surrogate).unwrap();
    let file = open(&bytes).unwrap();
    let shapes: Vec<_> = file.polynomials().map(|p| (p.terms, p.points.iter().collect::<Vec<_>>())).collect();
    // Five terms of the motor and one more of the screw; the third point transforms differently.
    assert_eq!(shapes, [(6, vec![0, 1]), (1, vec![2])]);
}

#[test]
fn the_runtime_shows_names_units_and_provenance() {
    let bytes = encode(&small()).unwrap();
    let file = open(&bytes).unwrap();
    assert_eq!(file.variables().map(|v| (v.name, v.unit, v.low, v.high)).next(), Some(("coolant_flow", "L/min", 2.0, 12.0)));
    assert_eq!(file.points().map(|p| (p.name, p.half_width)).last(), Some(("screw nut", 0.03125)));
    assert_eq!(file.limits().map(|l| (l.name, l.maximum)).nth(1), Some(("motor over ambient", 6.0)));
    assert_eq!(file.provenance().last(), Some(("noté", "")));
}

#[test]
fn what_the_format_cannot_hold_is_refused_with_its_reason() {
    let refuse = |change: &dyn Fn(&mut SurrogateSpec), needle: &str| {
        let mut surrogate = mixed();
        change(&mut surrogate);
        let error = encode(&surrogate).unwrap_err();
        assert!(error.to_string().contains(needle), "{needle}: {error}");
        error.kind()
    };
    let input = [
        refuse(&|s| s.variables[0].high = 1.0, "not a range"),
        refuse(&|s| s.variables[0].low = f64::NAN, "not a range"),
        refuse(&|s| s.variables[0].low = 0.0, "illegal on this range"),
        refuse(&|s| s.variables[0].name = String::new(), "name of a variable"),
        refuse(&|s| s.variables[1].name = "coolant_flow".into(), "name of a variable"),
        refuse(&|s| s.points[1].name = "a".into(), "name of a point"),
        refuse(&|s| s.points[1].name = "two\nlines".into(), "name of a point"),
        refuse(&|s| s.points[1].half_width = -0.1, "half width"),
        refuse(&|s| s.points[1].half_width = f64::INFINITY, "half width"),
        refuse(&|s| s.points[1].unit = "K".into(), "different units"),
        refuse(&|s| *s = SurrogateSpec { variables: s.variables.clone(), ..Default::default() }, "number of points"),
        refuse(&|s| *s = SurrogateSpec::default(), "number of variables"),
        refuse(&|s| s.variables.extend(vec![variable("x", "1", 0.0, 1.0); 6]), "at most 8 variables"),
        refuse(&|s| s.bases[0].scales.clear(), "radial basis"),
        refuse(&|s| s.bases[2].centres.clear(), "radial basis"),
        refuse(&|s| s.bases[2].centres = vec![vec![0.0; 3]; 4097], "4096"),
        refuse(&|s| s.bases[1].scales[0] = -1.0, "length scale"),
        refuse(
            &|s| s.points[1].model = PointModel::Rbf { basis: 7, weights: vec![], tail: polynomial(&[Transform::Identity; 3], &[], &[]) },
            "one weight per",
        ),
        refuse(&|s| s.points[0].model = PointModel::Polynomial(polynomial(&[Transform::Identity; 3], &[&[13, 0, 0]], &[1.0])), "degree 12"),
        refuse(
            &|s| s.points[0].model = PointModel::Polynomial(polynomial(&[Transform::Identity; 3], &[&[1, 0, 0], &[1, 0, 0]], &[1.0, 2.0])),
            "twice",
        ),
        refuse(
            &|s| s.points[0].model = PointModel::Polynomial(polynomial(&[Transform::Identity; 3], &[&[1, 0, 0]], &[])),
            "one coefficient",
        ),
        refuse(
            &|s| s.points[0].model = PointModel::Polynomial(polynomial(&[Transform::Identity; 3], &[&[1, 0, 0]], &[f64::NAN])),
            "not finite",
        ),
        refuse(&|s| s.limits[0].kind = LimitKind::Maximum { point: 4 }, "does not exist"),
        refuse(&|s| s.limits[1].kind = LimitKind::Rise { point: 0, variable: 3 }, "does not exist"),
        refuse(&|s| s.limits[1].kind = LimitKind::Rise { point: 0, variable: 1 }, "different units"),
        refuse(&|s| s.limits[2].kind = LimitKind::Difference { first: 1, second: 1 }, "twice"),
        refuse(&|s| s.limits[3].kind = LimitKind::Spread(vec![1]), "points of a limit"),
        refuse(&|s| s.limits[3].maximum = f64::NAN, "not finite"),
        refuse(&|s| s.provenance[0].1 = "x".repeat(70_000), "too long"),
    ];
    assert!(input.iter().all(|kind| *kind == Kind::Input));
    // Two weights that cancel to nine digits more than a double holds.
    let cancelling = refuse(
        &|s| {
            s.bases[0].centres[1] = s.bases[0].centres[0].iter().map(|c| c + 1e-9).collect();
            let PointModel::Rbf { weights, .. } = &mut s.points[1].model else { unreachable!() };
            (weights[0], weights[1]) = (1e12, -1e12);
        },
        "cancel",
    );
    assert_eq!(cancelling, Kind::Numerics);
}

#[test]
fn writing_leaves_the_file_and_nothing_else() {
    let folder = std::env::temp_dir().join(format!("coldplate-surrogate-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("machine.cps");
    write(&small(), &path).unwrap();
    write(&mixed(), &path).unwrap();
    assert_eq!(decode(&std::fs::read(&path).unwrap()).unwrap(), mixed());
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
    let error = write(&small(), &path.join("x.cps")).unwrap_err(); // a file is no folder
    assert!(error.to_string().contains("x.cps"), "{error}");
    std::fs::remove_dir_all(&folder).unwrap();
}
