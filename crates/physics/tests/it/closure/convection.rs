//! Free convection: Nusselt numbers beside their sources, gases beside reference equations, derivatives.

use coldplate_physics::convection::{BodyShape, FreeConvection, Gas};

use crate::closure::close;

/// PyPI `ht` 1.2.0: `Nu_vertical_plate_Churchill(0.69, 2.63e9)` and its cylinder (Incropera, example 9.2), `Nu_sphere_Churchill(.7, 1e7)`.
#[test]
fn nusselt_numbers_of_the_literature() {
    close(BodyShape::VerticalPlate.nusselt(0.69 * 2.63e9, 0.69, true), 147.161_852_237_706, 1e-9);
    close(BodyShape::HorizontalCylinder.nusselt(0.69 * 2.63e9, 0.69, true), 139.134_939_700_736, 1e-9);
    close(BodyShape::Sphere.nusselt(0.7 * 1e7, 0.7, true), 25.670_869_440_317, 1e-9);
    // By hand: 0.54 x 10 at 1e5 to the fourth root, 0.15 x 1000 at 1e9 to the third, 0.52 x 10 at 1e5 to the fifth.
    close(BodyShape::FacingUp.nusselt(1e4, 0.7, true), 5.4, 1e-12);
    close(BodyShape::FacingUp.nusselt(1e9, 0.7, true), 150.0, 1e-12);
    close(BodyShape::FacingDown.nusselt(1e5, 0.7, true), 5.2, 1e-12);
    // A cold plate that looks up is a warm one that looks down.
    assert_eq!(BodyShape::FacingUp.nusselt(1e5, 0.7, false), BodyShape::FacingDown.nusselt(1e5, 0.7, true));
    assert_eq!(BodyShape::FacingDown.nusselt(1e5, 0.7, false), BodyShape::FacingUp.nusselt(1e5, 0.7, true));
}

/// K, W/(m K), Pa s, J/(kg K) at 101325 Pa: CoolProp 8.0.0.
#[test]
fn gases_agree_with_reference_equations() {
    let table = [
        (Gas::Air, 220.0, 2.015934e-02, 1.444276e-05, 1006.008),
        (Gas::Air, 300.0, 2.638447e-02, 1.853734e-05, 1006.374),
        (Gas::Air, 350.0, 3.000328e-02, 2.086715e-05, 1009.211),
        (Gas::Air, 550.0, 4.302374e-02, 2.896791e-05, 1040.038),
        (Gas::Nitrogen, 220.0, 1.990209e-02, 1.397281e-05, 1042.589),
        (Gas::Nitrogen, 300.0, 2.596868e-02, 1.789009e-05, 1041.356),
        (Gas::Nitrogen, 350.0, 2.947569e-02, 2.011737e-05, 1042.294),
        (Gas::Nitrogen, 550.0, 4.198936e-02, 2.785668e-05, 1065.041),
        (Gas::Argon, 220.0, 1.365780e-02, 1.742055e-05, 522.948),
        (Gas::Argon, 300.0, 1.783742e-02, 2.274096e-05, 521.538),
        (Gas::Argon, 350.0, 2.024362e-02, 2.580634e-05, 521.165),
        (Gas::Argon, 550.0, 2.868973e-02, 3.658728e-05, 520.623),
        (Gas::Helium, 220.0, 1.259580e-01, 1.614482e-05, 5193.361),
        (Gas::Helium, 300.0, 1.559743e-01, 1.992972e-05, 5193.196),
        (Gas::Helium, 350.0, 1.735314e-01, 2.215375e-05, 5193.153),
        (Gas::Helium, 550.0, 2.375518e-01, 3.031319e-05, 5193.103),
    ];
    for (gas, kelvin, conductivity, viscosity, heat) in table {
        let [k, mu, cp] = gas.at(kelvin);
        close(k, conductivity, 6e-4);
        close(mu, viscosity, 6e-4);
        close(cp, heat, 5e-4);
    }
}

#[test]
fn fluxes_have_exact_derivatives_and_are_continuous() {
    for (shape, length) in BodyShape::ALL.into_iter().zip([0.3, 0.05, 0.05, 0.02, 0.1]) {
        for gas in Gas::ALL {
            let law = FreeConvection { shape, length, gas, pressure: 101_325.0 };
            for (surface, around) in [(340.0, 293.0), (280.0, 310.0), (293.4, 293.0)] {
                let flux = law.flux(surface, around);
                let h = 1e-3;
                let four = |f: &dyn Fn(f64) -> f64| (f(-2.0 * h) - 8.0 * f(-h) + 8.0 * f(h) - f(2.0 * h)) / (12.0 * h);
                close(flux.per_surface, four(&|d| law.flux(surface + d, around).value), 1e-8);
                close(flux.per_gas, four(&|d| law.flux(surface, around + d).value), 1e-8);
                assert!(flux.value * (surface - around) > 0.0 && flux.per_surface > 0.0);
            }
            // Without a difference nothing flows, and what a small one brings is small and finite.
            assert!(law.flux(293.0, 293.0).value == 0.0 && law.flux(293.0, 293.0).per_surface > 0.0);
        }
    }
    let plate = FreeConvection { shape: BodyShape::FacingUp, length: 0.05, gas: Gas::Air, pressure: 101_325.0 };
    assert!(plate.note(340.0, 293.0).is_none() && plate.note(293.1, 293.0).is_none());
    assert!(plate.note(800.0, 700.0).unwrap().contains("600 K"));
    let small = FreeConvection { length: 1e-3, ..plate };
    assert!(small.note(340.0, 293.0).unwrap().contains("Rayleigh"));
}
