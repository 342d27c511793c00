//! Radiation and residual gas.

use coldplate_physics::{gas, radiation, view_factors};

use crate::closure::close;

/// V24: Howell's catalogue, cube faces as in Siegel and Howell; then direct numerical integration of
/// the definition (scipy 1.17.1) for unequal sides.
#[test]
fn view_factors_of_rectangles_v24() {
    close(view_factors::parallel_rectangles(1.0, 1.0, 1.0), 0.199824895698, 1e-10);
    close(view_factors::perpendicular_rectangles(1.0, 1.0, 1.0), 0.200043776075, 1e-10);
    close(view_factors::parallel_rectangles(0.5, 0.5, 0.05), 0.826994522397, 1e-10);
    close(view_factors::parallel_rectangles(0.3, 0.2, 0.1), 0.4755764365329529, 1e-11);
    close(view_factors::perpendicular_rectangles(0.3, 0.2, 0.1), 0.15949835073952512, 1e-7);
    close(view_factors::perpendicular_rectangles(0.1, 0.4, 0.3), 0.09495054996658198, 1e-7);
}

/// V24: a cube's faces see one another and nothing else.
#[test]
fn view_factors_of_a_cube_close() {
    let seen = view_factors::parallel_rectangles(1.0, 1.0, 1.0) + 4.0 * view_factors::perpendicular_rectangles(1.0, 1.0, 1.0);
    close(seen, 1.0, 1e-13);
}

#[test]
fn view_factors_are_reciprocal() {
    let there = view_factors::perpendicular_rectangles(0.7, 0.2, 0.5) * 0.2;
    close(view_factors::perpendicular_rectangles(0.7, 0.5, 0.2) * 0.5, there, 1e-12);
    let there = view_factors::coaxial_discs(0.1, 0.3, 0.2) * 0.01;
    close(view_factors::coaxial_discs(0.3, 0.1, 0.2) * 0.09, there, 1e-12);
}

/// V19 (Ansys VM147, Siegel and Howell), and numerical integration with scipy 1.17.1.
#[test]
fn view_factor_of_discs_v19() {
    close(view_factors::coaxial_discs(0.075, 0.05, 0.075), 0.197828393634, 1e-11);
    close(view_factors::coaxial_discs(0.1, 0.3, 0.05), 0.9698074653513346, 1e-9);
    close(view_factors::coaxial_discs(1e-9, 1.0, 1.0), 0.5, 1e-12); // a point sees r²/(r² + h²)
}

/// V25, V23, V18 (Ansys VM125).
#[test]
fn effective_emissivities_v25_v23_v18() {
    let body = radiation::effective_emissivity(0.55, 0.1525, 0.3, 96.0);
    close(body, 0.548881035493, 1e-11);
    let (hot, cold) = (42.2_f64 + 273.15, 23.5_f64 + 273.15);
    let difference = radiation::SIGMA * (hot.powi(4) - cold.powi(4));
    close(body * 0.1525 * difference, 10.1819502253, 1e-10);
    let plates = radiation::two_surface(0.55, 1.0, 0.3, 1.0, 1.0);
    close(plates, 0.240875912409, 1e-11);
    close(plates * difference, 29.3005837661, 1e-10);
    close(radiation::effective_emissivity(0.55, 0.05, 0.3, 24.0), 0.548533434914, 1e-11);
    close(radiation::effective_emissivity(0.55, 0.8, 0.3, 24.0), 0.527437400107, 1e-11);
    close(radiation::effective_emissivity(0.7, 1.0, 0.5, 2.0), 0.518518518519, 1e-11);
    close(radiation::two_surface(0.7, 1.0, 0.5, 2.0, 1.0), 0.518518518519, 1e-11);
    assert_eq!(radiation::two_surface(0.7, 1.0, 0.5, 2.0, 0.0), 0.0);
}

/// V25: the exact coefficient between 42.2 and 23.5 degC; the linearised one is its limit.
#[test]
fn linearised_coefficient_v25() {
    let (hot, cold) = (42.2_f64 + 273.15, 23.5_f64 + 273.15);
    let exact = 0.548881035493 * radiation::SIGMA * (hot * hot + cold * cold) * (hot + cold);
    close(exact, 3.57042174989, 1e-10);
    // (T1² + T2²)(T1 + T2) = 4 Tm³ + Tm (T1 - T2)²
    let mean = 0.5 * (hot + cold);
    let remainder = 0.548881035493 * radiation::SIGMA * mean * (hot - cold).powi(2);
    close(radiation::linearised(0.548881035493, mean), 3.57042174989 - remainder, 1e-10);
    close(radiation::linearised(0.55, 23.5 + 273.15), 3.26, 1.5e-3); // the rule of thumb, 3 digits
}

/// V48: free-molecular air at 1 Pa and 300 K.
#[test]
fn residual_gas_v48() {
    close(gas::free_molecular(1.0, 300.0, 1.0), 1.17071455905, 1e-6);
    close(gas::free_molecular(0.01, 300.0, 0.8), 0.8 * 0.0117071455905, 1e-6);
}

/// Conductivity of air, W/(m K), from `CoolProp` 8.0.0 at 1 atm.
#[test]
fn air_conductivity_agrees_with_coolprop() {
    for (temperature, expected) in
        [(250.0, 0.022564402698571285), (300.0, 0.026384465709828872), (350.0, 0.030003280154256667), (500.0, 0.03994462517270878)]
    {
        close(gas::air_conductivity(temperature), expected, 2e-2);
    }
}

#[test]
fn residual_gas_runs_from_free_molecules_to_continuum() {
    let (temperature, gap) = (300.0, 0.1);
    close(gas::film(1e-4, temperature, 0.9, gap), gas::free_molecular(1e-4, temperature, 0.9), 1e-3);
    close(gas::film(1e5, temperature, 0.9, gap), gas::air_conductivity(temperature) / gap, 1e-4);
    assert_eq!(gas::film(0.0, temperature, 0.9, gap), 0.0);
    let mut last = 0.0;
    for step in 0..40 {
        let film = gas::film(1e-4 * 10f64.powf(0.2 * f64::from(step)), temperature, 0.9, gap);
        assert!(film > last);
        last = film;
    }
    assert!(gas::note(1.0).is_none() && gas::note(1e5).is_some());
}
