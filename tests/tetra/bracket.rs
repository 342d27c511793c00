//! A bracket with a hole, solved by an independent program: scikit-fem 12 with quadratic tetrahedra on the same domain
//! (scripts/bracket-reference.py, whose header has the problem). Film on the foot, flux on the pad, radiation elsewhere.

use crate::bench::{Tets, order, solve};

/// scikit-fem, quadratic elements, edges of the coarse mesh halved LEVELS times: mean over volume, bore, pad and back
/// (degC), heat through the foot (W).
const REFERENCE: [f64; 5] = [REF];

#[test]
fn the_bracket_agrees_with_an_independent_program() {
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
        errors.push(std::array::from_fn(|i| found[i] - REFERENCE[i]));
        mesh = mesh.refined(|_, p| p);
    }
    for (i, what) in ["volume", "bore", "pad", "back", "foot"].into_iter().enumerate() {
        let slopes: Vec<f64> = errors.windows(2).map(|w| order(w[0][i], w[1][i])).collect();
        println!("{what}: errors {:?}, orders {slopes:.2?}", errors.iter().map(|e| e[i]).collect::<Vec<_>>());
        // Re-entrant corners cost a second order: r^(2/3) there, so 4/3 in means.
        assert!(slopes.iter().all(|s| *s > 1.2), "{what}: {slopes:?}");
        assert!(errors[3][i].abs() < 5e-3 * (REFERENCE[i] - if i < 4 { 20.0 } else { 0.0 }), "{what}: {errors:?}");
    }
}
