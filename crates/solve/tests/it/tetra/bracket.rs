//! A bracket with a hole, solved by an independent program: scikit-fem 12 with quadratic tetrahedra on the same domain
//! (scripts/bracket-reference.py, whose header has the problem). Film on the foot, flux on the pad, radiation elsewhere.

use crate::tetra::bench::{Tets, order, solve};

/// scikit-fem, quadratic elements, the edges of the coarse mesh halved 0, 1 and 2 times: mean over volume, bore, pad and
/// back (degC), heat through the foot (W).
const QUADRATIC: [[f64; 5]; 3] = [
    [60.96658, 56.0493, 66.78957, 56.44353, 54.11535],
    [60.92139, 55.93012, 66.81232, 56.33607, 54.12059],
    [60.90335, 55.88263, 66.82144, 56.29295, 54.12269],
];
/// Linear elements on the coarse mesh itself.
const LINEAR: [f64; 5] = [61.26588, 56.82131, 66.64714, 57.09654, 54.08263];

#[test]
fn the_bracket_agrees_with_an_independent_program() {
    // The re-entrant corner of 270 degrees (r^(2/3)) leaves h^(4/3) of the means: Aitken's extrapolation, and the rate it
    // sees is that one.
    let reference: [f64; 5] = std::array::from_fn(|i| {
        let [a, b, c] = [0, 1, 2].map(|level| QUADRATIC[level][i]);
        assert!((order(b - a, c - b) - 4.0 / 3.0).abs() < 0.1);
        c + (c - b) * (c - b) / ((b - a) - (c - b))
    });
    println!("scikit-fem, extrapolated: {reference:.5?}");
    let mut mesh = Tets::read("bracket_coarse.msh");
    let mut errors: Vec<[f64; 5]> = Vec::new();
    for level in 0..4 {
        let file = mesh.write(&format!("bracket_{level}.msh"));
        let text = format!(
            "[material.m]
            conductivity = \"50 W/(m K)\"
            [part.bracket]
            material = \"m\"
            mesh = \"{}\"
            unit = \"mm\"
            surface = {{ effective_emissivity = 0.8, excluded = [\"foot\", \"pad\"] }}
            [boundary.foot]
            faces = [\"bracket.foot\"]
            film = \"400 W/(m2 K)\"
            fluid_temperature = \"20 degC\"
            [boundary.pad]
            faces = [\"bracket.pad\"]
            heat_flux = \"20 kW/m2\"
            [sensor.volume]
            part = \"bracket\"
            [sensor.bore]
            face = \"bracket.bore\"
            [sensor.pad]
            face = \"bracket.pad\"
            [sensor.back]
            face = \"bracket.back\"
            ",
            file.display()
        );
        let run = solve(&text, 1);
        let found = ["volume", "bore", "pad", "back"].map(|s| run.celsius(s));
        let found = [found[0], found[1], found[2], found[3], -run.heat_in("foot")];
        println!("level {level}: {found:.5?}");
        if level == 0 {
            // The same elements: what is left is that film and radiation act at the vertices here, at Gauss points there.
            let worst = (0..5).map(|i| (found[i] - LINEAR[i]).abs()).fold(0.0, f64::max);
            println!("at most {worst:.4} from scikit-fem's linear elements");
            assert!(worst < 0.1, "{worst}");
        }
        errors.push(std::array::from_fn(|i| found[i] - reference[i]));
        mesh = mesh.refined(|_, p| p);
    }
    for (i, what) in ["volume", "bore", "pad", "back", "foot"].into_iter().enumerate() {
        let slopes: Vec<f64> = errors.windows(2).map(|w| order(w[0][i], w[1][i])).collect();
        println!("{what}: errors {:?}, orders {slopes:.2?}", errors.iter().map(|e| e[i]).collect::<Vec<_>>());
        assert!((slopes[2] - 4.0 / 3.0).abs() < 0.05, "{what}: {slopes:?}");
        let scale = if i < 4 { reference[i] - 20.0 } else { reference[i] };
        assert!(errors[3][i].abs() < 5e-3 * scale, "{what}: {errors:?}");
    }
}
