//! Temperatures over time against closed forms.

mod storage;
mod water;

use crate::bench::{CONDITION, model};
use coldplate_base::units::ZERO_CELSIUS;
use coldplate_network::Load;
use coldplate_solve::meshed::MeshedMachine;
use coldplate_solve::transient::{StepSettings, Transient, TransientState};

/// A machine run from one temperature (degC) at [`CONDITION`].
fn run(model: &MeshedMachine, from: f64, until: f64, tolerance: f64) -> TransientState {
    let condition = model.machine.condition(&CONDITION).unwrap_or_else(|e| panic!("{e}"));
    run_with(model, from, until, tolerance, &|_| Load::at(&model.machine, &condition))
}

/// The same under a condition of one's own.
fn run_with(
    model: &MeshedMachine,
    from: f64,
    until: f64,
    tolerance: f64,
    load: &dyn Fn(f64) -> coldplate_base::error::Result<Load>,
) -> TransientState {
    let mut transient = Transient::new(&model.network, StepSettings { tolerance, ..StepSettings::default() }).unwrap();
    let mut state = transient.uniform(&load(0.0).unwrap(), from + ZERO_CELSIUS);
    transient.advance(&mut state, until, load, &mut |_, _| Ok(())).unwrap_or_else(|e| panic!("{e}"));
    assert!(state.energy.relative() < 1e-8, "energy is open by {:e}: {:?}", state.energy.relative(), state.energy);
    state
}

/// Reading of a sensor, degC.
fn reading(model: &MeshedMachine, state: &TransientState, sensor: &str) -> f64 {
    let i = model.network.sensor_names.iter().position(|n| n == sensor).unwrap();
    let condition = model.machine.condition(&CONDITION).unwrap();
    let load = Load::at(&model.machine, &condition).unwrap();
    model.network.sensors[i].read(&state.temperatures, &load) - ZERO_CELSIUS
}

/// Asserts that readings at ever smaller tolerances approach a value, the last to within `tolerance` of `span`.
#[track_caller]
fn close(what: &str, found: f64, expected: f64, span: f64, tolerance: f64) {
    let error = (found - expected).abs() / span;
    println!("{what}: {found:.9}, exact {expected:.9}, {error:.1e} of the span");
    assert!(error < tolerance, "{what}: {found} against {expected}, {error:.1e} of {span}");
}

/// V46: a lumped motor of 6000 J/K on a plate of given temperature, 8 W/K, 113.73 W.
const MOTOR: &str = r#"
    [node.motor]
    capacity = "6000 J/K"
    [node.plate]
    temperature = "26.5 degC"
    [contact.joint]
    between = ["motor", "plate"]
    total_conductance = "8 W/K"
    [source.heat]
    in = ["motor"]
    power = "113.73 W"
    [sensor.motor]
    node = "motor"
"#;

#[test]
fn v46_lumped_motor_warms_up() {
    let model = model(MOTOR, 1.0);
    let errors: Vec<(usize, f64)> = [1e-3, 1e-4, 1e-5, 1e-8]
        .iter()
        .map(|tolerance| {
            let state = run(&model, 28.5, 2400.0, *tolerance);
            (state.steps, (reading(&model, &state, "motor") - 40.2182887256).abs())
        })
        .collect();
    println!("V46: steps and errors, K: {errors:?}");
    assert!(errors[3].1 < 1e-6 * 12.2, "{errors:?}");
    // Second order in the mean step, whatever the control makes of its sizes.
    let slope = (errors[0].1 / errors[3].1).ln() / (errors[3].0 as f64 / errors[0].0 as f64).ln();
    assert!((1.8..2.3).contains(&slope), "order {slope}");
}

/// V21: a steel block of 0.2 m that radiates to the chamber for 17 h; a conductivity high enough to make it one temperature.
#[test]
fn v21_block_cools_for_17_hours() {
    let text = r#"
        [chamber]
        temperature = "23.5 degC"
        [material.steel]
        conductivity = "1e6 W/(m K)"
        [part.block]
        material = "steel"
        box = ["0.2 m", "0.2 m", "0.2 m"]
        surface = { effective_emissivity = 0.55 }
        [sensor.block]
        part = "block"
    "#;
    let model = model(text, 0.1);
    let hour = run(&model, 60.0, 3600.0, 1e-5);
    close("V21 after an hour", reading(&model, &hour, "block"), 56.3328461184, 36.5, 1e-5);
    let end = run(&model, 60.0, 61200.0, 1e-5);
    close("V21 after 17 h", reading(&model, &end, "block"), 30.4801474921, 36.5, 1e-5);
}

/// V27: a bar that is semi-infinite for 100 s: step of surface temperature, of flux, and of a film.
#[test]
fn v27_semi_infinite_solid() {
    let bar = |law: &str| {
        format!(
            r#"
            [material.steel]
            conductivity = "16.3 W/(m K)"
            [part.bar]
            material = "steel"
            box = ["0.2 m", "0.01 m", "0.01 m"]
            cells = [800, 1, 1]
            [boundary.end]
            faces = ["bar.-x"]
            {law}
            [sensor.inside]
            point = ["0.01 m", "0.005 m", "0.005 m"]
            in = "bar"
            [sensor.surface]
            face = "bar.-x"
            "#
        )
    };
    let step = model(&bar("temperature = \"100 degC\""), 1.0);
    let state = run(&step, 20.0, 100.0, 1e-3);
    close("V27 step", reading(&step, &state, "inside"), 78.2218941669, 80.0, 1e-4);
    let flux = model(&bar("heat_flux = \"50000 W/m2\""), 1.0);
    let state = run(&flux, 20.0, 100.0, 1e-3);
    close("V27 flux", reading(&flux, &state, "inside"), 63.8549173731, 80.0, 1e-4);
    close("V27 flux, surface", reading(&flux, &state, "surface"), 90.3125281458, 80.0, 1e-4);
    let film = model(&bar("film = \"500 W/(m2 K)\"\nfluid_temperature = \"100 degC\""), 1.0);
    let state = run(&film, 20.0, 100.0, 1e-3);
    close("V27 Robin", reading(&film, &state, "inside"), 43.123632541, 80.0, 1e-4);
    close("V27 Robin, surface", reading(&film, &state, "surface"), 55.3900778837, 80.0, 1e-4);
}

/// V32: a slab that generates heat, its surface dropped to 32 (Ansys VM115, units as they are, degrees read as degC).
#[test]
fn v32_heat_generating_slab() {
    let text = |cells: usize| {
        format!(
            r#"
            [ material.one ]
            conductivity = "20 W/(m K)"
            density = "500 kg/m3"
            specific_heat = "0.2 J/(kg K)"
            [part.slab]
            material = "one"
            box = ["0.5 m", "0.1 m", "0.1 m"]
            cells = [{cells}, 1, 1]
            [boundary.surface]
            faces = ["slab.-x"]
            temperature = "32 degC"
            [source.heat]
            in = ["slab"]
            power = "200 W"
            {}
            "#,
            (1..=5)
                .map(|i| format!("[sensor.t{i}]\npoint = [\"{:.1} m\", \"0.05 m\", \"0.05 m\"]\nin = \"slab\"\n", 0.1 * f64::from(i)))
                .collect::<String>()
        )
    };
    let expected = [75.7532789243, 103.993832328, 120.802985744, 129.461280948, 132.1007238];
    let at = |cells: usize| -> Vec<f64> {
        let model = model(&text(cells), 1.0);
        let state = run(&model, 60.0, 0.2, 1e-3);
        (1..=5).map(|i| reading(&model, &state, &format!("t{i}"))).collect()
    };
    let (coarse, fine) = (at(100), at(200));
    for (i, expected) in expected.iter().enumerate() {
        // Second order in space: extrapolated.
        close(&format!("V32 T{}", i + 1), fine[i] + (fine[i] - coarse[i]) / 3.0, *expected, 100.0, 2e-4);
    }
}

/// V29: a sphere cooled by convection (Ansys VM111, units as they are).
#[test]
fn v29_sphere_cools() {
    let text = |cells: usize| {
        format!(
            r#"
            [ material.one ]
            conductivity = "0.333333333333 W/(m K)"
            density = "62 kg/m3"
            specific_heat = "1.0752677 J/(kg K)"
            [part.ball]
            material = "one"
            sphere = {{ outer = "0.166666666667 m" }}
            cells = [{cells}, 1, 1]
            at = ["0 m", "0 m", "0 m"]
            [boundary.film]
            faces = ["ball.outer"]
            film = "2 W/(m2 K)"
            fluid_temperature = "25 degC"
            [sensor.centre]
            point = ["0 m", "0 m", "0 m"]
            in = "ball"
            [sensor.surface]
            face = "ball.outer"
            "#
        )
    };
    let at = |cells: usize| {
        let model = model(&text(cells), 1.0);
        let state = run(&model, 65.0, 6.0, 1e-3);
        [reading(&model, &state, "centre"), reading(&model, &state, "surface")]
    };
    let (coarse, fine) = (at(40), at(80));
    close("V29 centre", fine[0] + (fine[0] - coarse[0]) / 3.0, 28.5453893056, 40.0, 1e-4);
    close("V29 surface", fine[1] + (fine[1] - coarse[1]) / 3.0, 27.2570649333, 40.0, 1e-4);
}

/// V26: NAFEMS T3, a surface at 100 sin(pi t/40): the boundary's temperature follows a variable of the machine's own.
#[test]
fn v26_surface_temperature_over_time() {
    let text = |cells: usize| {
        format!(
            r#"
            [ material.one ]
            conductivity = "35 W/(m K)"
            density = "7200 kg/m3"
            specific_heat = "440.5 J/(kg K)"
            [variables.surface_temperature]
            unit = "degC"
            default = "0 degC"
            [part.bar]
            material = "one"
            box = ["0.1 m", "0.01 m", "0.01 m"]
            cells = [{cells}, 1, 1]
            [boundary.cold]
            faces = ["bar.-x"]
            temperature = "0 degC"
            [boundary.warm]
            faces = ["bar.+x"]
            temperature = "surface_temperature"
            [sensor.deep]
            point = ["0.08 m", "0.005 m", "0.005 m"]
            in = "bar"
            [sensor.middle]
            point = ["0.05 m", "0.005 m", "0.005 m"]
            in = "bar"
            "#
        )
    };
    let at = |cells: usize, until: f64| {
        let model = model(&text(cells), 1.0);
        let load = |t: f64| {
            let surface = format!("{:.17} degC", 100.0 * (std::f64::consts::PI * t / 40.0).sin());
            let mut given = CONDITION.to_vec();
            given.push(("surface_temperature", &surface));
            Load::at(&model.machine, &model.machine.condition(&given)?)
        };
        let state = run_with(&model, 0.0, until, 3e-3, &load);
        [reading(&model, &state, "deep"), reading(&model, &state, "middle")]
    };
    let (coarse, fine) = (at(100, 32.0), at(200, 32.0));
    close("V26 x = 0.08, 32 s", fine[0] + (fine[0] - coarse[0]) / 3.0, 36.6031159591, 100.0, 5e-4);
    close("V26 x = 0.05, 32 s", fine[1] + (fine[1] - coarse[1]) / 3.0, 3.37423933358, 100.0, 5e-4);
    let (coarse, fine) = (at(100, 20.0), at(200, 20.0));
    close("V26 x = 0.08, 20 s", fine[0] + (fine[0] - coarse[0]) / 3.0, 22.1472595483, 100.0, 5e-4);
}
