//! Rough contacts and bearings.

use std::f64::consts::PI;

use coldplate_physics::bearing::{self, Palmgren, Skf};
use coldplate_physics::contact::{self, Asperities, GapGas, Rough};
use coldplate_physics::{gas, radiation};

use crate::closure::close;

const ATMOSPHERE: f64 = 101_325.0;

/// The surfaces of V48: aluminium 167 and stainless 16.3 W/(m K).
fn rough() -> Rough {
    Rough {
        roughness: 2.2627e-6,
        slope: 0.15,
        asperities: Asperities::Plastic { hardness: 1.3e9 },
        pressure: 3e5,
        gas: None,
        emissivity: None,
    }
}

#[test]
fn solid_spots_v48() {
    close(contact::harmonic_mean(167.0, 16.3), 29.7010365521, 1e-11);
    close(contact::conductance(&rough(), 167.0, 16.3, 300.0), 863.306297134, 1e-11);
    assert_eq!(contact::conductance(&Rough { pressure: 0.0, ..rough() }, 167.0, 16.3, 300.0), 0.0);
}

/// The pressures at which these surfaces give the paper's 560 and 510 W/(m² K): 0.19 and 0.17 MPa.
#[test]
fn paper_conductances_need_plausible_pressures() {
    for (pressure, expected) in [(0.19e6, 560.0), (0.17e6, 510.0)] {
        close(contact::conductance(&Rough { pressure, ..rough() }, 167.0, 16.3, 300.0), expected, 2e-2);
    }
}

/// V48: gap gas at 1 atm, 100 Pa and 1 Pa, gap 5 um.
#[test]
fn gap_gas_v48() {
    for (pressure, expected) in [(ATMOSPHERE, 4876.36538231), (100.0, 76.1934055897), (1.0, 0.773149401487)] {
        close(contact::gap_gas(0.026, 5e-6, 3.3184e-7, pressure, contact::GAS_REFERENCE_TEMPERATURE), expected, 1e-11);
    }
    assert_eq!(contact::gap_gas(0.026, 5e-6, 3.3184e-7, 0.0, 300.0), 0.0);
}

/// Rarefied enough, the gap must conduct as free molecules do between two surfaces of accommodation
/// a each, whose joint coefficient is a/(2 - a). Two theories, one number: 3 % for air's data.
#[test]
fn rarefied_gap_meets_the_free_molecular_law() {
    for accommodation in [0.8, 0.9, 1.0] {
        let rarefaction = contact::rarefaction_length([accommodation; 2], 1.4, 0.71, contact::AIR_MEAN_FREE_PATH);
        let gap = contact::gap_gas(0.026, 5e-6, rarefaction, 0.01, contact::GAS_REFERENCE_TEMPERATURE);
        let free = gas::free_molecular(0.01, contact::GAS_REFERENCE_TEMPERATURE, accommodation / (2.0 - accommodation));
        close(gap, free, 3e-2);
    }
}

#[test]
fn contact_paths_add_up() {
    let air = GapGas { conductivity: 0.026, pressure: ATMOSPHERE, gap: Some(5e-6), rarefaction: 3.3184e-7 };
    let all = Rough { gas: Some(air), emissivity: Some([0.55, 0.3]), ..rough() };
    let temperature = contact::GAS_REFERENCE_TEMPERATURE;
    // V48 for spots and gas, V25 for the emissivity of facing plates.
    let expected = 863.306297134 + 4876.36538231 + radiation::linearised(0.240875912409, temperature);
    close(contact::conductance(&all, 167.0, 16.3, temperature), expected, 1e-10);
    close(contact::gap_radiation(0.55, 0.3, 42.2 + 273.15, 23.5 + 273.15) * 18.7, 29.3005837661, 1e-10); // V25
    // Without a gap of its own the gas takes Yovanovich's: 1.53 x 2.2627 um x (2.3077e-4)^-0.097 = 7.80 um.
    let open = Rough { gas: Some(GapGas { gap: None, ..air }), ..rough() };
    let gap = 0.026 / (contact::conductance(&open, 167.0, 16.3, temperature) - 863.306297134) - 3.3184e-7;
    close(gap, 7.80e-6, 2e-3);
}

/// Elastic law by hand: k_s 29.701, m 0.15, sigma 2.2627 um, p 3e5 Pa, E' 60 GPa:
/// 2^(1/2) p/(E' m) = 4.71405e-5, to the 0.94 = 8.5761e-5, times 1.55 x 1.96896e6 = 261.7.
#[test]
fn elastic_spots_by_hand() {
    let elastic = Rough { asperities: Asperities::Elastic { modulus: 60e9 }, ..rough() };
    close(contact::conductance(&elastic, 167.0, 16.3, 300.0), 261.7, 1e-3);
}

#[test]
fn contact_says_when_it_is_out_of_range() {
    assert!(contact::note(&rough()).is_none());
    assert!(contact::note(&Rough { pressure: 0.0, ..rough() }).is_some());
    assert!(contact::note(&Rough { pressure: 1e8, ..rough() }).is_some());
    let gas = Some(GapGas { conductivity: 0.026, pressure: 1.0, gap: None, rarefaction: 3.3e-7 });
    assert!(contact::note(&Rough { pressure: 5e3, gas, ..rough() }).is_some());
}

/// V48: dm 72 mm, preload 3 kN, 50 r/min, 150 mm²/s.
#[test]
fn palmgren_v48() {
    let bearing = Palmgren { f0: 2.0, f1: 7e-4, mean_diameter: 0.072, viscosity: 150e-6, load: 3000.0 };
    let speed = 50.0 * PI / 30.0;
    let (viscous, load) = bearing::palmgren(&bearing, speed);
    close(viscous * 1e3, 28.6023463022, 1e-11);
    close(load * 1e3, 151.2, 1e-12);
    close((viscous + load) * speed, 0.941442883735, 1e-11);
    // Slow: 160e-7 x 2 x 72³ N mm, whatever the speed.
    close(bearing::palmgren(&bearing, 1.0).0 * 1e3, 11.943936, 1e-12);
    close(bearing::palmgren(&bearing, 0.0).0 * 1e3, 11.943936, 1e-12);
}

/// Each factor of SKF's form where it stands alone: sliding at standstill; inlet shear 1/(1 + 1.84)
/// where (n dm)^1.28 nu^0.64 = 1e9; replenishment 1/e where its exponent is 1.
#[test]
fn skf_factors_one_by_one() {
    let bearing = Skf {
        rolling: 10.0,
        sliding: 100.0,
        boundary_friction: 0.15,
        film_friction: 0.05,
        bore: 0.03,
        outside: 0.062,
        replenishment: 0.0,
        geometry: 3.1,
        viscosity: 1e-6,
        seals: 0.01,
        drag: 0.002,
    };
    close(bearing::skf(&bearing, 0.0), 0.1 * 0.15 + 0.012, 1e-12);
    let rolling_only = Skf { sliding: 0.0, seals: 0.0, drag: 0.0, ..bearing };
    let rpm = 1e9_f64.powf(1.0 / 1.28) / 46.0;
    close(bearing::skf(&rolling_only, rpm * PI / 30.0), 0.01 * rpm.powf(0.6) / 2.84, 1e-12);
    let starved = Skf { replenishment: 1.0 / (rpm * 92.0 * (3.1_f64 / 64.0).sqrt()), ..rolling_only };
    close(bearing::skf(&starved, rpm * PI / 30.0), 0.01 * rpm.powf(0.6) / 2.84 * (-1.0_f64).exp(), 1e-12);
    // Fast and viscous: the film carries the sliding contacts.
    let sliding_only = Skf { rolling: 0.0, seals: 0.0, drag: 0.0, viscosity: 1e-3, ..bearing };
    close(bearing::skf(&sliding_only, 500.0), 0.1 * 0.05, 1e-9);
}
