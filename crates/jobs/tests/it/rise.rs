//! A rise is taken over `ambient_temperature`, in a solve, in its derivative and in a query, where the chamber has another
//! temperature.

use coldplate_base::document::Document;
use coldplate_describe::machine::LimitKind;
use coldplate_jobs::fitting::fit_table;
use coldplate_solve::sensitivity::DerivativeTarget;
use coldplate_solve::study::Study;
use coldplate_surrogate::fit::FitOptions;
use coldplate_surrogate::fit::file::{encode, open};
use coldplate_tables::Table;

const MACHINE: &str = r#"
name = "a block in a chamber that is warmer than the room"
[variables]
coolant_flow = "1 L/min"
coolant_temperature = "20 degC"
motor_speed = "0 rpm"
ambient_temperature = "20 degC"
[chamber]
temperature = { formula = "ambient_temperature_degC + 3", unit = "degC" }
[surfaces]
emissivity = 0.8
[part.block]
material = "steel"
box = ["0.1 m", "0.1 m", "20 mm"]
[source.heater]
in = "block"
power = "2 W"
[sensor.top]
face = "block.+z"
[limit.rise]
sensor = "top"
rise = "5 K"
"#;

#[test]
fn a_rise_is_over_the_ambient_temperature_and_not_over_the_chamber() {
    let study = Study::new(Document::parse(MACHINE, "machine.toml").unwrap(), Some(100)).unwrap();
    let machine = &study.model.machine;
    let at = |ambient: f64| machine.condition(&[("ambient_temperature", &format!("{ambient} degC"))]).unwrap();
    let solved = |ambient: f64| {
        let state = study.model.steady(&at(ambient)).unwrap();
        let reading = study.model.readings(&state)[0];
        (reading, study.model.limits(&state)[0].value)
    };
    assert!(
        matches!(machine.limits[0].kind, LimitKind::Rise { point: 0, variable } if machine.variables[variable].name == "ambient_temperature")
    );
    let (reading, rise) = solved(25.0);
    assert!((rise - (reading - 25.0)).abs() < 1e-9 && rise > 3.0, "{reading} degC, {rise} K");

    let here = study.at(&at(25.0)).unwrap();
    let parameters = [study.parameter("ambient_temperature").unwrap()];
    let found = here.jacobian(&[DerivativeTarget::Limit(0), DerivativeTarget::Sensor(0)], &parameters).unwrap();
    assert!((found.slopes[0][0] - (found.slopes[1][0] - 1.0)).abs() < 1e-12 && !found.idle[0], "{:?}", found.slopes);
    let difference = (solved(25.5).1 - solved(24.5).1) / 1.0;
    assert!((found.slopes[0][0] - difference).abs() < 1e-4 * difference.abs(), "{:?} and {difference}", found.slopes);

    let rows: String = (0..9).map(|i| 15.0 + 2.5 * f64::from(i)).map(|t| format!("{t},{}\n", solved(t).0)).collect();
    let table = Table::from_csv(&format!("ambient_temperature [degC],top [degC]\n{rows}"), "sweep.csv").unwrap();
    let fit = fit_table(&table, Some(&machine.scope()), &FitOptions::default()).unwrap();
    let bytes = encode(&fit.surrogate).unwrap();
    let verdict = open(&bytes).unwrap().verdict(&[25.0]);
    assert!((verdict.value - rise).abs() < 1e-3, "{} and {rise}", verdict.value);
}
