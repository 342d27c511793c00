//! V07: spheres, an eighth of each between planes of symmetry. Reference: integration in r.

use crate::tetra::bench::{Solved, Tets, check, extrapolate, order, solve};

/// New points of the named spherical surface go onto its sphere.
fn onto_sphere(name: &str, p: [f64; 3]) -> [f64; 3] {
    let radius = match name {
        "outside" => 0.05,
        "inside" => 0.02,
        _ => return p,
    };
    let r = p.iter().map(|x| x * x).sum::<f64>().sqrt();
    p.map(|x| x * radius / r)
}

fn runs(file: &str, levels: usize, rest: &str) -> Vec<Solved> {
    let mut mesh = Tets::read(file);
    let mut found = Vec::new();
    for level in 0..levels {
        let path = mesh.write(&format!("{level}_{file}"));
        let text = format!(
            "[material.m]
            conductivity = \"16.3 W/(m K)\"
            [part.sphere]
            material = \"m\"
            mesh = \"{}\"
            surface = \"none\"
            [boundary.air]
            faces = [\"sphere.outside\"]
            film = \"25 W/(m2 K)\"
            fluid_temperature = \"20 degC\"
            [sensor.surface]
            face = \"sphere.outside\"
            {rest}",
            path.display()
        );
        found.push(solve(&text, 1));
        mesh = mesh.refined(onto_sphere);
    }
    found
}

#[track_caller]
fn converges(what: &str, values: &[f64], wanted: f64, scale: f64, tolerance: f64) {
    let n = values.len();
    let errors: Vec<f64> = values.iter().map(|v| v - wanted).collect();
    let slope = order(errors[n - 2], errors[n - 1]);
    println!("{what}: errors {errors:?}, order {slope:.2}");
    assert!((1.8..2.3).contains(&slope), "{what} converges with order {slope}: {errors:?}");
    check(what, extrapolate([values[n - 3], values[n - 2], values[n - 1]]), wanted, scale, tolerance);
}

/// T(r) = Tinf + q R/(3h) + q (R² - r²)/(6k).
#[test]
fn v07a_solid_sphere_with_source() {
    // The source acts per volume; the volume of the facets converges with the rest.
    let power = 1e5 * 4.0 / 3.0 * std::f64::consts::PI * 0.05f64.powi(3) / 8.0;
    let rest = format!(
        "[source.heat]\nin = [\"sphere\"]\npower = \"{power:.17} W\"
        [sensor.centre]\nin = \"sphere\"\npoint = [\"0 mm\", \"0 mm\", \"0 mm\"]"
    );
    let runs = runs("sphere.msh", 4, &rest);
    let of = |sensor: &str| runs.iter().map(|r| r.celsius(sensor)).collect::<Vec<_>>();
    converges("V07a T surface", &of("surface"), 86.6666666667, 66.67, 1e-5);
    converges("V07a T centre", &of("centre"), 89.2229038855, 66.67, 1e-5);
}

/// Hollow sphere, inside at 100 degC.
#[test]
fn v07b_hollow_sphere() {
    let rest = "[boundary.inside]\nfaces = [\"sphere.inside\"]\ntemperature = \"100 degC\"";
    let runs = runs("hollow.msh", 4, rest);
    converges("V07b T surface", &runs.iter().map(|r| r.celsius("surface")).collect::<Vec<_>>(), 91.7469050894, 71.75, 1e-5);
    let heats: Vec<f64> = runs.iter().map(|r| 8.0 * r.heat_in("inside")).collect();
    // The heat converges faster while facets and elements err in opposite directions: nothing to extrapolate.
    println!("V07b heat: {heats:?}");
    assert!(heats.windows(2).all(|w| (w[1] - 56.3498874867).abs() < 0.3 * (w[0] - 56.3498874867).abs()), "{heats:?}");
    check("V07b heat", heats[3], 56.3498874867, 56.35, 1e-5);
}
