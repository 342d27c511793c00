//! Heat that is stored: a capacity that depends on temperature, contacts between bodies that store, and the account of it.

use coldplate_network::{HeatSource, Load};
use coldplate_solve::transient::{StepSettings, Transient};

use super::{close, reading, run};
use crate::bench::{CONDITION, model};

/// V44: T = T0 + A cos(pi x / L) exp(-t / tau) in a bar of capacity c0 + c1 (T - T0), its source put in cell by cell.
#[test]
fn v44_capacity_of_temperature() {
    const LENGTH: f64 = 0.1;
    const AREA: f64 = 1e-4;
    let (k, rho, c0, c1, t0, a, tau) = (16.3, 7900.0, 480.0, 0.4, 300.0, 30.0, 600.0);
    let wave = std::f64::consts::PI / LENGTH;
    let exact = |x: f64, t: f64| t0 + a * (wave * x).cos() * (-t / tau).exp();
    let density = |x: f64, t: f64| {
        let over = exact(x, t) - t0;
        rho * (c0 + c1 * over) * (-over / tau) + k * wave * wave * over
    };
    // The reference gives two values of each: the formula above is the case's own.
    assert!((exact(0.02, 300.0) - 314.72080834).abs() < 1e-7, "{}", exact(0.02, 300.0));
    assert!((density(0.02, 300.0) / 142643.537334 - 1.0).abs() < 1e-9, "{}", density(0.02, 300.0));
    let error = |cells: usize, steps: f64| -> (Vec<f64>, f64) {
        let mut model = model(
            &format!(
                r#"
                [ material.steel ]
                density = "7900 kg/m3"
                conductivity = "16.3 W/(m K)"
                specific_heat = [["263.15 K", "465.26 J/(kg K)"], ["343.15 K", "497.26 J/(kg K)"]]
                [part.bar]
                material = "steel"
                box = ["0.1 m", "0.01 m", "0.01 m"]
                cells = [{cells}, 1, 1]
                [sensor.inside]
                point = ["0.02 m", "0.005 m", "0.005 m"]
                in = "bar"
                "#
            ),
            1.0,
        );
        let width = LENGTH / cells as f64;
        let centre = |i: usize| (i as f64 + 0.5) * width;
        model.network.sources = (0..cells).map(|i| HeatSource::constant(vec![(i as u32, 1.0)])).collect();
        let condition = model.machine.condition(&CONDITION).unwrap();
        let load = |t: f64| {
            let mut load = Load::at(&model.machine, &condition)?;
            load.powers = (0..cells).map(|i| density(centre(i), t) * AREA * width).collect();
            Ok(load)
        };
        // Even steps: the tolerance never binds.
        let mut transient =
            Transient::new(&model.network, StepSettings { tolerance: 10.0, longest: 300.0 / steps, ..StepSettings::default() }).unwrap();
        let mut state = transient.uniform(&load(0.0).unwrap(), t0);
        (0..cells).for_each(|i| state.temperatures[i] = exact(centre(i), 0.0));
        transient.advance(&mut state, 300.0, &load, &mut |_, _| Ok(())).unwrap_or_else(|e| panic!("{e}"));
        assert!(state.energy.relative() < 1e-8, "{:?}", state.energy);
        let worst = (0..cells).map(|i| (state.temperatures[i] - exact(centre(i), 300.0)).abs()).fold(0.0, f64::max);
        assert_eq!(state.steps, steps as usize);
        (state.temperatures[..cells].to_vec(), worst)
    };
    // Space: every halving of the cells takes three quarters of the error.
    let in_space: Vec<f64> = [20, 40, 80].iter().map(|n| error(*n, 800.0).1).collect();
    println!("V44: largest error with 20, 40, 80 cells, K: {in_space:?}");
    assert!(in_space.windows(2).all(|e| ((e[0] / e[1]).log2() - 2.0).abs() < 0.1), "{in_space:?}");
    // Time: against the same cells with many more steps.
    let (settled, _) = error(40, 3200.0);
    let in_time: Vec<f64> = [12.0, 24.0, 48.0]
        .iter()
        .map(|steps| error(40, *steps).0.iter().zip(&settled).map(|(f, s)| (f - s).abs()).fold(0.0, f64::max))
        .collect();
    println!("V44: largest error of 12, 24, 48 steps, K: {in_time:?}");
    assert!(in_time.windows(2).all(|e| ((e[0] / e[1]).log2() - 2.0).abs() < 0.1), "{in_time:?}");
}

/// Two half-spaces, 100 and 20 degC, brought together with a contact conductance h: the drop over the contact is
/// 80 K exp(H² t) erfc(H sqrt t) with H = h (1/e1 + 1/e2) and e² = k rho c (Carslaw and Jaeger 1959, 2.7 and 2.8,
/// by superposition of both sides' response to the same flux). It tends to Schneider's two bodies in perfect contact.
#[test]
fn two_bodies_meet() {
    let text = |fine: usize| {
        format!(
            r#"
            [material.steel]
            conductivity = "16.3 W/(m K)"
            [ material.aluminium ]
            density = "2700 kg/m3"
            specific_heat = "900 J/(kg K)"
            conductivity = "200 W/(m K)"
            [part.warm]
            material = "steel"
            box = ["0.2 m", "0.01 m", "0.01 m"]
            cells = [{fine}, 1, 1]
            [part.cool]
            material = "aluminium"
            box = ["0.8 m", "0.01 m", "0.01 m"]
            at = ["0.2 m", "0 m", "0 m"]
            cells = [{fine}, 1, 1]
            [contact.meeting]
            between = ["warm.+x", "cool.-x"]
            conductance = "1000 W/(m2 K)"
            [sensor.warm]
            face = "warm.+x"
            [sensor.cool]
            face = "cool.-x"
            "#
        )
    };
    let drop = |fine: usize| {
        let model = model(&text(fine), 1.0);
        let condition = model.machine.condition(&CONDITION).unwrap();
        let load = |_: f64| Load::at(&model.machine, &condition);
        let mut transient = Transient::new(&model.network, StepSettings { tolerance: 1e-4, ..StepSettings::default() }).unwrap();
        let mut state = transient.uniform(&load(0.0).unwrap(), 293.15);
        let warm = model.machine.parts.iter().position(|p| p.name == "warm").unwrap() as u32;
        for (t, group) in state.temperatures.iter_mut().zip(&model.network.group) {
            *t = if *group == warm { 373.15 } else { 293.15 };
        }
        transient.advance(&mut state, 100.0, &load, &mut |_, _| Ok(())).unwrap_or_else(|e| panic!("{e}"));
        reading(&model, &state, "warm") - reading(&model, &state, "cool")
    };
    let (coarse, fine) = (drop(400), drop(800));
    close("drop over the contact after 100 s", fine + (fine - coarse) / 3.0, 23.33452598309268, 80.0, 1e-5);
}

/// Surfaces that store nothing are brought into balance whenever an output interrupts the integration; the account of
/// heat must not notice. It once lost the heat that flowed while they were.
#[test]
fn interruptions_cost_no_heat() {
    let model = model(
        r#"
        [material.steel]
        conductivity = "16.3 W/(m K)"
        [chamber]
        temperature = "20 degC"
        [part.block]
        material = "steel"
        box = ["0.1 m", "0.1 m", "0.1 m"]
        cells = [4, 4, 4]
        surface = { effective_emissivity = 0.9 }
        [sensor.corner]
        face = "block.+x"
        "#,
        1.0,
    );
    let condition = model.machine.condition(&CONDITION).unwrap();
    let load = |_: f64| Load::at(&model.machine, &condition);
    let mut transient = Transient::new(&model.network, StepSettings::default()).unwrap();
    let mut state = transient.uniform(&load(0.0).unwrap(), 353.15);
    for minute in 1..=200 {
        state.before = None;
        transient.advance(&mut state, 60.0 * f64::from(minute), &load, &mut |_, _| Ok(())).unwrap();
    }
    println!("200 interruptions: {:?}, open {:e}", state.energy, state.energy.relative());
    assert!(state.energy.relative() < 1e-11, "{:?}", state.energy);
    let whole = run(&model, 80.0, 12000.0, 0.01);
    close("interrupted against not", reading(&model, &state, "corner"), reading(&model, &whole, "corner"), 60.0, 5e-4);
}
