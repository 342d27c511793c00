//! What residual gas can do ends where its film saturates: the screen goes no further.

use coldplate_diagnose::{Scales, hypotheses, signatures};
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, ReadingRow};
use coldplate_explore::simulate::Start;

use super::logs::{CELLS, study};

/// Between walls 0.2 m apart the film of 50 Pa is hardly more than that of one: nothing that the screen takes away by residual
/// gas may be more than 50 Pa do.
#[test]
fn the_screen_ends_where_the_film_does() {
    let line = |key: &str, value: &str| (key.to_string(), value.to_string());
    let study = study(CELLS, &[line("chamber.gap", "\"0.2 m\"")]);
    let machine = &study.model.machine;
    let row = |name: &str, speed: &str| ReadingRow {
        test: name.into(),
        time: None,
        condition: machine.condition(&[("motor_speed", speed)]).unwrap(),
        readings: vec![Some(300.0); 4],
        line: None,
    };
    let names = machine.sensors.iter().map(|s| s.name.clone()).collect();
    let rows = vec![row("slow", "800 rpm"), row("fast", "2500 rpm")];
    let data = Data { source: "a twin".into(), sensors: (0..4).collect(), names, rows, ..Data::default() };
    let scales = Scales::of(&data, machine);
    let mut gas = hypotheses(&study, &data, &[]);
    gas.retain(|h| h.kind() == "residual gas");
    let [gas] = gas.as_slice() else { panic!("{gas:?}") };
    assert!(gas.most > 1.0 && gas.most < 1.2, "{} Pa", gas.most);

    let found = signatures(&study, &data, Start::Steady, &[], std::slice::from_ref(gas), &scales, &[]).unwrap();
    let with = |pascal: f64| {
        let sets = gas.sets(&study, &scales, &[], pascal).unwrap().unwrap();
        identify::values(&study.edited(&sets).unwrap(), &data, Start::Steady).unwrap()
    };
    let (before, most) = (&found.prediction.values, with(gas.largest()));
    for i in 0..before.len() {
        let (screened, real) = (gas.most * found.columns[0][i], most[i] - before[i]);
        assert!((screened - real).abs() <= 0.1 * real.abs() + 1e-3, "reading {i}: {screened} K in the screen, {real} K by 50 Pa");
    }
    // Without an end the screen would go on to what no pressure does.
    let hottest = (0..before.len()).max_by(|a, b| before[*a].total_cmp(&before[*b])).unwrap();
    assert!((gas.largest() * found.columns[0][hottest]).abs() > 20.0 * (most[hottest] - before[hottest]).abs());
}
