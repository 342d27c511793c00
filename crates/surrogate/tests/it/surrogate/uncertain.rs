//! What answers leave open: bands, probabilities, and readings that are learnt.

use coldplate_base::random::Random;
use coldplate_runtime::{Band, Belief, LearnError, OpenError, Reading, format};
use coldplate_surrogate::fit::evaluate;
use coldplate_surrogate::fit::file::{decode, encode, open};
use coldplate_surrogate::fit::model::{StateDistribution, SurrogateSpec};
use coldplate_surrogate::verdict::instruments::Instruments;
use coldplate_surrogate::verdict::{Acceptability, Inverse, free, query, query_at, stated, update};
use coldplate_tables::{Column, Table};
use nalgebra::{DMatrix, DVector};

use crate::surrogate::examples::*;

const AT: [f64; 3] = [5.0, 17.0, 24.0];

/// Weights of a point's value in the states, by the definition.
fn weights(surrogate: &SurrogateSpec, point: usize, x: &[f64]) -> Vec<f64> {
    let own = surrogate.uncertainty.as_ref().unwrap();
    let mut all = own.slopes_at(surrogate, point, x);
    all.extend((0..surrogate.points.len()).map(|p| if p == point { own.misses[p].own } else { 0.0 }));
    all.push(own.misses[point].common);
    all
}

/// Mean and covariance of the states.
fn states(surrogate: &SurrogateSpec) -> (DVector<f64>, DMatrix<f64>) {
    let own = surrogate.uncertainty.as_ref().unwrap();
    let n = own.parameters.len() + surrogate.points.len() + 1;
    match &own.states {
        None => (DVector::zeros(n), DMatrix::identity(n, n)),
        Some(states) => {
            let of = |i: usize, j: usize| states.covariance[i.max(j) * (i.max(j) + 1) / 2 + i.min(j)];
            (DVector::from_vec(states.mean.clone()), DMatrix::from_fn(n, n, of))
        }
    }
}

#[test]
fn bands_are_those_of_the_definition() {
    for surrogate in [uncertain(), uncertain_together()] {
        let bytes = encode(&surrogate).unwrap();
        let file = open(&bytes).unwrap();
        let own = surrogate.uncertainty.as_ref().unwrap();
        for x in [AT, [8.0, 20.0, 21.0], [2.0, 25.0, 26.0]] {
            let (mut values, mut bands) = ([0.0; 2], [Band::default(); 2]);
            file.bands(&x, None, &mut values, &mut bands).unwrap();
            for (p, band) in bands.iter().enumerate() {
                let expected = own.deviation(&surrogate, p, &x);
                assert!((band.total - expected).abs() < 1e-12, "{} {expected}", band.total);
                let value = evaluate(&surrogate, p, &x).unwrap();
                assert!((values[p] - value).abs() < 1e-12);
                assert!((file.evaluate_point(&x, p).unwrap() - value).abs() < 1e-12);
            }
        }
        // What is new away from the measured conditions is nothing at their mean.
        let (mut values, mut bands) = ([0.0; 2], [Band::default(); 2]);
        file.bands(&[6.0, 19.0, 21.0], None, &mut values, &mut bands).unwrap();
        let (near, mut far) = (bands[1].misses, [Band::default(); 2]);
        file.bands(&[12.0, 25.0, 26.0], None, &mut values, &mut far).unwrap();
        assert!(far[1].misses > 1.2 * near, "{} {near}", far[1].misses);
    }
}

/// The derivative of a value is that of the value as it is answered, what was learnt included.
#[test]
fn gradients_know_what_was_learnt() {
    let bytes = encode(&uncertain_together()).unwrap();
    let file = open(&bytes).unwrap();
    let mut gradient = [0.0; 3];
    file.gradient(&AT, 0, &mut gradient).unwrap();
    for v in 0..3 {
        let at = |step: f64| {
            let mut x = AT;
            x[v] += step;
            file.evaluate_point(&x, 0).unwrap()
        };
        let difference = (at(1e-5) - at(-1e-5)) / 2e-5;
        assert!((gradient[v] - difference).abs() < 1e-8, "{v}: {} {difference}", gradient[v]);
    }
}

/// Draws of the states: the band of each limit and the probability that all are kept are those of the draws.
#[test]
fn probabilities_are_those_of_draws() {
    for surrogate in [uncertain(), uncertain_together()] {
        let bytes = encode(&surrogate).unwrap();
        let file = open(&bytes).unwrap();
        let own = surrogate.uncertainty.as_ref().unwrap();
        let (mean, covariance) = states(&surrogate);
        let root = covariance.cholesky().unwrap().l();
        let fits: Vec<f64> = surrogate.points.iter().map(|p| p.half_width / coldplate_runtime::NINETY_FIVE).collect();
        let mut random = Random::new(3);
        for x in [[5.0, 17.0, 21.0], [3.0, 20.5, 20.0], [2.5, 19.5, 21.5]] {
            let answer = query(&file, &x).unwrap();
            let bare: Vec<f64> = (0..2).map(|p| evaluate(&surrogate, p, &x).unwrap() - own.shift(&surrogate, p, &x)).collect();
            let slopes: Vec<Vec<f64>> = (0..2).map(|p| weights(&surrogate, p, &x)).collect();
            // The mean of the measured conditions is 6, 19, 21; halves of the ranges are 5, 5 and 4.
            let away = own.growth * (((x[0] - 6.0) / 5.0).powi(2) + ((x[1] - 19.0) / 5.0).powi(2) + ((x[2] - 21.0) / 4.0).powi(2)).sqrt();
            let draws = 200_000;
            let (mut kept, mut sum, mut squares) = (0, 0.0, 0.0);
            for _ in 0..draws {
                let z = &mean + &root * DVector::from_fn(mean.len(), |_, _| random.normal());
                let common = away * random.normal();
                let value = |p: usize, random: &mut Random| {
                    let by_states: f64 = slopes[p].iter().zip(z.iter()).map(|(w, z)| w * z).sum();
                    let miss = own.misses[p];
                    bare[p] + by_states + fits[p] * random.normal() + away * miss.own * random.normal() + common * miss.common
                };
                let t = [value(0, &mut random), value(1, &mut random)];
                kept += usize::from(t[0] <= 28.0 && t[0] - x[2] <= 6.0 && t[0] - t[1] <= 5.0 && (t[0] - t[1]).abs() <= 5.5);
                sum += t[0] - t[1];
                squares += (t[0] - t[1]).powi(2);
            }
            let share = kept as f64 / draws as f64;
            let found = answer.chance.as_ref().unwrap().probability;
            // Sampling alone leaves 0.001, the approximation of the joint probability 0.01.
            assert!((found - share).abs() < 0.015, "{x:?}: {found} {share}");
            let (m, n) = (sum / draws as f64, draws as f64);
            let deviation = (squares / n - m * m).sqrt();
            let difference = &answer.limits[2];
            let half = (difference.high - difference.low) / 2.0;
            assert!((half / (1.959_964 * deviation) - 1.0).abs() < 0.01, "{half} {deviation}");
            assert!((difference.value - m).abs() < 0.01);
        }
    }
}

#[test]
fn verdicts_follow_the_confidence() {
    let bytes = encode(&uncertain()).unwrap();
    let file = open(&bytes).unwrap();
    let probability = |flow: f64| query(&file, &[flow, 19.5, 21.0]).unwrap().chance.unwrap().probability;
    let flow = (4..24).map(|i| 0.5 * f64::from(i)).find(|flow| probability(*flow) > 0.7).unwrap();
    let (x, probability) = ([flow, 19.5, 21.0], probability(flow));
    assert!((0.7..0.95).contains(&probability), "{probability}");
    assert_eq!(query(&file, &x).unwrap().verdict, Acceptability::Uncertain);
    assert_eq!(query_at(&file, &x, probability - 1e-6).unwrap().verdict, Acceptability::Acceptable);
    assert_eq!(query(&file, &[2.0, 25.0, 19.0]).unwrap().verdict, Acceptability::NotAcceptable);
    assert_eq!(query(&file, &[12.0, 15.0, 24.0]).unwrap().verdict, Acceptability::Acceptable);
    // Outside the fitted range nothing is sure.
    assert_eq!(query(&file, &[13.0, 15.0, 24.0]).unwrap().verdict, Acceptability::Uncertain);
    // The least flow that is acceptable is where the probability is the one asked for, and more is needed to be surer.
    let least = |confidence: f64| match coldplate_surrogate::verdict::free_within(&file, &[0.0, 19.5, 21.0], 0, None, confidence).unwrap() {
        Inverse::Found { smallest, answer, .. } => {
            let found = answer.chance.unwrap().probability;
            assert!((found - confidence).abs() < 1e-5, "{found} {confidence}");
            smallest
        }
        other => panic!("{other:?}"),
    };
    assert!(least(0.8) < least(0.9), "{} {}", least(0.8), least(0.9));
    assert!(matches!(free(&file, &[0.0, 25.0, 18.0], 0).unwrap(), Inverse::Nowhere { .. }));
}

#[test]
fn shares_say_what_decides() {
    let bytes = encode(&uncertain()).unwrap();
    let file = open(&bytes).unwrap();
    let chance = query(&file, &AT).unwrap().chance.unwrap();
    assert!((chance.deciding.iter().map(|s| s.share).sum::<f64>() - 1.0).abs() < 1e-9);
    assert_eq!(chance.deciding[0].name, "contact.foot.conductance");
    assert!(chance.deciding.iter().find(|s| s.name == "all heats").unwrap().is_assumed);
    assert_eq!(chance.would_settle.unwrap().point, "motor");
}

/// Readings one after the other teach what conditioning on all at once does, and repeating them does not make the model right.
#[test]
fn readings_are_learnt_as_by_conditioning() {
    let mut surrogate = uncertain();
    surrogate.uncertainty.as_mut().unwrap().growth = 0.0;
    let bytes = encode(&surrogate).unwrap();
    let file = open(&bytes).unwrap();
    let own = file.uncertainty().unwrap();
    let (mut mean, mut covariance, mut work) = (vec![0.0; own.states()], vec![0.0; own.covariances()], vec![0.0; own.states()]);
    let mut belief = Belief::begin(&own, &mut mean, &mut covariance).unwrap();
    // Nothing is added for the distance.
    let conditions = [[8.0, 20.0, 21.0], [4.0, 18.0, 21.0]];
    let (prior, spread) = states(&surrogate);
    let (mut rows, mut gaps, mut noises) = (Vec::new(), Vec::new(), Vec::new());
    let mut chi_square = 0.0;
    for (i, x) in conditions.iter().enumerate() {
        let mut readings = Vec::new();
        for p in 0..2 {
            let value = evaluate(&surrogate, p, x).unwrap();
            let gap = [0.9, -0.3, 1.2, 0.1][2 * i + p];
            readings.push(Reading { point: p, value: value + gap, deviation: 0.1 });
            rows.push(weights(&surrogate, p, x));
            gaps.push(gap);
            noises.push(0.01 + (surrogate.points[p].half_width / coldplate_runtime::NINETY_FIVE).powi(2));
        }
        chi_square += file.learn(x, &readings, &mut belief, &mut work).unwrap().chi_square;
    }
    let h = DMatrix::from_fn(4, prior.len(), |i, j| rows[i][j]);
    let whole = &h * &spread * h.transpose() + DMatrix::from_diagonal(&DVector::from_vec(noises));
    let gap = DVector::from_vec(gaps);
    let inverse = whole.try_inverse().unwrap();
    let gain = &spread * h.transpose() * &inverse;
    let (expected, left) = (&prior + &gain * &gap, &spread - &gain * &h * &spread);
    let expected_chi = (gap.transpose() * inverse * &gap)[0];
    assert!((chi_square - expected_chi).abs() < 1e-9, "{chi_square} {expected_chi}");
    for i in 0..expected.len() {
        assert!((belief.mean()[i] - expected[i]).abs() < 1e-10);
        for j in 0..=i {
            assert!((belief.covariance()[i * (i + 1) / 2 + j] - left[(i, j)]).abs() < 1e-10);
        }
    }
    // A thousand readings at one condition: the parameter stays as open as what the model misses leaves it.
    let x = conditions[0];
    let value = evaluate(&surrogate, 0, &x).unwrap();
    for _ in 0..1000 {
        file.learn(&x, &[Reading { point: 0, value, deviation: 0.1 }], &mut belief, &mut work).unwrap();
    }
    assert!(belief.covariance()[0].sqrt() > 0.2, "{}", belief.covariance()[0].sqrt());
}

#[test]
fn nothing_is_learnt_from_what_is_no_reading() {
    let bytes = encode(&uncertain()).unwrap();
    let file = open(&bytes).unwrap();
    let own = file.uncertainty().unwrap();
    let (mut mean, mut covariance, mut work) = (vec![0.0; own.states()], vec![0.0; own.covariances()], vec![0.0; own.states()]);
    let mut belief = Belief::begin(&own, &mut mean, &mut covariance).unwrap();
    let reading = Reading { point: 0, value: 26.0, deviation: 0.1 };
    let mut learn = |x: &[f64], reading: Reading| file.learn(x, &[reading], &mut belief, &mut work).unwrap_err();
    assert_eq!(learn(&[1.0, 20.0, 21.0], reading), LearnError::OutsideRange);
    for value in [f64::NAN, f64::INFINITY] {
        assert_eq!(learn(&AT, Reading { value, ..reading }), LearnError::Reading);
    }
    for deviation in [0.0, -1.0, f64::NAN] {
        assert_eq!(learn(&AT, Reading { deviation, ..reading }), LearnError::Reading);
    }
    assert!(matches!(learn(&AT, Reading { point: 2, ..reading }), LearnError::Shape(_)));
    assert!(matches!(learn(&AT[..2], reading), LearnError::Shape(_)));
    assert!(belief.mean().iter().all(|m| *m == 0.0));
    let plain = encode(&small()).unwrap();
    let plain = open(&plain).unwrap();
    let (mut mean, mut covariance) = (vec![0.0; own.states()], vec![0.0; own.covariances()]);
    let mut belief = Belief::begin(&own, &mut mean, &mut covariance).unwrap();
    assert_eq!(plain.learn(&AT, &[reading], &mut belief, &mut work).unwrap_err(), LearnError::NoUncertainty);
}

/// One file answers for the machine as it is, and for the same machine with a worse contact.
#[test]
fn parameters_may_be_stated() {
    let surrogate = uncertain();
    let bytes = encode(&surrogate).unwrap();
    let state = |name: &str, value: &str| stated::with_stated(&bytes, &[(name.to_string(), value.to_string())]);
    let worse = state("contact.foot.conductance", "400 W/(m2 K)").unwrap();
    let (before, after) = (query(&open(&bytes).unwrap(), &AT).unwrap(), query(&open(&worse).unwrap(), &AT).unwrap());
    let slope = surrogate.uncertainty.as_ref().unwrap().slopes_at(&surrogate, 0, &AT)[0];
    // 1/400 against 1/500 is a quarter more resistance, and a standard deviation a tenth.
    let expected = slope * (1.0 - 500.0 / 400.0) / 0.1;
    let found = after.temperatures[0].value - before.temperatures[0].value;
    assert!(expected > 1.0 && (found - expected).abs() < 1e-9, "{found} {expected}");
    let parts = |answer: &coldplate_surrogate::verdict::SurrogateAnswer| answer.temperatures[0].parts.unwrap().parameters;
    assert!(parts(&after) < 0.7 * parts(&before));
    for (name, value, says) in [
        ("contact.foot.conductance", "200 W/(m2 K)", "may be stated from 350.0 to 650.0 W/(m2 K)"),
        ("contact.foot.conductance", "400", "unit"),
        ("contact.fot.conductance", "400 W/(m2 K)", "no parameter"),
        ("all heats", "nan", "all heats"),
    ] {
        let error = state(name, value).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
    let plain = encode(&small()).unwrap();
    assert!(stated::with_stated(&plain, &[("all heats".into(), "1".into())]).unwrap_err().to_string().contains("no parameters"));
}

fn table(rows: &[[f64; 5]]) -> Table {
    let column =
        |k: usize, name: &str, unit: &str| Column { name: name.into(), unit: unit.into(), values: rows.iter().map(|r| r[k]).collect() };
    let columns = vec![
        column(0, "coolant_flow", "L/min"),
        column(1, "coolant_temperature", "degC"),
        column(2, "ambient_temperature", "degC"),
        column(3, "motor", "degC"),
        column(4, "screw nut", "degC"),
    ];
    Table { texts: vec![], columns, inputs: 3, provenance: vec![] }
}

/// Readings of a machine whose contact is worse: the file follows it, its band shrinks, and readings that no parameter explains
/// raise the alarm.
#[test]
fn a_file_follows_its_machine() {
    let surrogate = uncertain();
    let bytes = encode(&surrogate).unwrap();
    let conditions = [[8.0, 20.0, 21.0], [4.0, 18.0, 22.0], [10.0, 22.0, 24.0], [3.0, 16.0, 20.0]];
    let own = surrogate.uncertainty.as_ref().unwrap();
    let truth = |x: &[f64; 3], p: usize| evaluate(&surrogate, p, x).unwrap() - 1.5 * own.slopes_at(&surrogate, p, x)[0];
    let rows: Vec<[f64; 5]> = conditions.iter().map(|x| [x[0], x[1], x[2], truth(x, 0), truth(x, 1)]).collect();
    let instruments = Instruments::with_noise(&open(&bytes).unwrap(), 0.1);
    let found = update::update(&bytes, &table(&rows), &[2, 3, 4, 5], &instruments).unwrap();
    assert!(!found.record.alarm && found.record.readings == 8, "{:?}", found.record);
    let contact = &found.record.parameters[0];
    // Minus 1.5 standard deviations is 500 / 1.15; the model's own errors leave some of it open.
    assert!(
        (contact.value - 500.0 / 1.15).abs() < 2.0 * contact.deviation && contact.deviation < 0.6 * contact.deviation_before,
        "{contact:?}"
    );
    let x = [6.0, 19.0, 22.0];
    let answer = |bytes: &[u8]| query(&open(bytes).unwrap(), &x).unwrap().temperatures[0].clone();
    let (before, after) = (answer(&bytes), answer(&found.bytes));
    assert!((after.value - truth(&x, 0)).abs() < 0.5 * (before.value - truth(&x, 0)).abs());
    assert!(after.high - after.low < 0.7 * (before.high - before.low));
    assert!(after.low < truth(&x, 0) && truth(&x, 0) < after.high);
    assert_eq!(decode(&found.bytes).unwrap().uncertainty.unwrap().measured.len(), 2 + 3);
    // One sensor far above, the other far below: no contact and no heat does that.
    let wrong: Vec<[f64; 5]> = conditions.iter().map(|x| [x[0], x[1], x[2], truth(x, 0) + 4.0, truth(x, 1) - 4.0]).collect();
    let alarm = update::update(&bytes, &table(&wrong), &[2, 3, 4, 5], &instruments).unwrap().record;
    assert!(alarm.alarm && alarm.worst[0].probability < update::ALARM, "{alarm:?}");
    // A log is no table of steady states.
    let mut log = table(&rows);
    log.columns.push(Column { name: "time".into(), unit: "s".into(), values: vec![0.0; 4] });
    assert!(update::update(&bytes, &log, &[2, 3, 4, 5], &instruments).unwrap_err().to_string().contains("steady states alone"));
    // Readings may have another unit than the file.
    let mut warm = table(&rows);
    warm.columns[3].unit = "K".into();
    warm.columns[3].values.iter_mut().for_each(|t| *t += 273.15);
    warm.columns[0].unit = "m3/s".into();
    warm.columns[0].values.iter_mut().for_each(|flow| *flow /= 6e4);
    let other = update::update(&bytes, &warm, &[2, 3, 4, 5], &instruments).unwrap();
    assert!((other.record.chi_square - found.record.chi_square).abs() < 1e-6);
    // Rows outside the range teach nothing, and are counted.
    let outside = [[20.0, 20.0, 21.0, 25.0, 22.0]];
    assert!(update::update(&bytes, &table(&outside), &[2], &instruments).unwrap_err().to_string().contains("no reading inside"));
}

/// What `DATA.toml` says of the instruments and of the condition counts in every reading.
#[test]
fn readings_are_as_sure_as_their_instruments() {
    let surrogate = small();
    let bytes = encode(&surrogate).unwrap();
    let file = open(&bytes).unwrap();
    let path = std::env::temp_dir().join(format!("coldplate-instruments-{}.toml", std::process::id()));
    let read = |text: &str| {
        std::fs::write(&path, text).unwrap();
        Instruments::read(&path, &file)
    };
    let found = read(
        "kind = \"standard deviations\"\nnoise = \"0.03 K\"\nbias = \"0.04 K\"\ntiming = \"1 s\"\n[condition]\n\
         coolant_temperature = \"0.2 K\"\ncoolant_flow = \"2 %\"\n[sensor.'screw nut']\nbias = \"0.4 K\"\n[sensor.elsewhere]\nbias = \"1 K\"\n",
    )
    .unwrap();
    let mut slopes = [0.0; 3];
    for (point, own) in [(0, 0.05_f64), (1, 0.03_f64.hypot(0.4))] {
        file.gradient(&AT, point, &mut slopes).unwrap();
        let expected = own.hypot(0.2 * slopes[1]).hypot(0.02 * AT[0] * slopes[0]);
        assert!((found.deviation(&file, &AT, point) - expected).abs() < 1e-12);
    }
    // Limits are those of an even distribution.
    let limits = read("kind = \"limits\"\nnoise = \"0.3 K\"\nbias = \"0 K\"\n").unwrap();
    assert!((limits.deviation(&file, &AT, 0) - 0.3 / 3f64.sqrt()).abs() < 1e-12);
    for (text, needles) in [
        ("noise = \"0.1 K\"\n", ["kind", "limits"]),
        ("kind = \"limits\"\nnoise = \"-0.1 K\"\n", ["toml:2", "not negative"]),
        ("kind = \"limits\"\nnoise = \"0 K\"\nbias = \"0 K\"\n", ["weighed", "display"]),
        ("kind = \"limits\"\n[condition]\ncoolant_flw = \"1 %\"\n", ["toml:3", "coolant_flow"]),
    ] {
        let message = read(text).unwrap_err().to_string();
        assert!(needles.iter().all(|n| message.contains(n)), "{message}");
    }
    std::fs::remove_file(path).unwrap();
}

/// What overflows is neither kept nor broken, however large the slopes or the values of a file are.
#[test]
fn what_overflows_is_never_acceptable() {
    let mut surrogate = uncertain();
    let own = surrogate.uncertainty.as_mut().unwrap();
    let states = own.parameters.len() + surrogate.points.len() + 1;
    let packed = |i: usize| i * (i + 1) / 2 + i;
    let mut covariance = vec![0.0; packed(states - 1) + 1];
    (0..states).for_each(|i| covariance[packed(i)] = 1e300);
    own.states = Some(StateDistribution { mean: vec![0.0; states], covariance });
    own.slopes.iter_mut().flatten().flatten().for_each(|s| *s *= 1e10);
    match encode(&surrogate) {
        // A band that is no number in a self-test cannot be written at all.
        Err(error) => assert!(error.to_string().contains("cannot be"), "{error}"),
        Ok(bytes) => assert_ne!(query(&open(&bytes).unwrap(), &AT).unwrap().verdict, Acceptability::Acceptable),
    }
    // A belief of the caller's may hold anything.
    let bytes = encode(&uncertain()).unwrap();
    let file = open(&bytes).unwrap();
    let own = file.uncertainty().unwrap();
    for wild in [f64::NAN, f64::INFINITY, -1e308, 1e308] {
        let (mut mean, mut covariance) = (vec![0.0; own.states()], vec![0.0; own.covariances()]);
        let mut belief = Belief::begin(&own, &mut mean, &mut covariance).unwrap();
        let mut work = vec![0.0; own.states()];
        belief.know(0, wild * 1e10, &mut work).unwrap();
        let (mut values, mut bands) = ([0.0; 2], [Band::default(); 2]);
        let chance = file.assess(&[12.0, 15.0, 24.0], Some(&belief), 0.95, &mut values, &mut bands).unwrap();
        assert_eq!(chance.state, Acceptability::Uncertain, "{wild}: {chance:?}");
    }
}

/// Every byte of the section counts, and none makes the reader panic.
#[test]
fn damage_of_the_section_is_refused() {
    let bytes = encode(&uncertain_together()).unwrap();
    let plain = encode(&small()).unwrap().len();
    let fix = |bytes: &mut Vec<u8>| {
        let end = bytes.len() - format::TRAILER;
        let crc = format::crc32(&bytes[..end]);
        bytes[end..].copy_from_slice(&crc.to_le_bytes());
    };
    let mut refused = 0;
    for at in plain - format::TRAILER..bytes.len() - format::TRAILER {
        for value in [0, 1, 0x7f, 0xff] {
            let mut damaged = bytes.clone();
            if damaged[at] == value {
                continue;
            }
            damaged[at] = value;
            fix(&mut damaged);
            match open(&damaged) {
                Err(_) => refused += 1,
                Ok(file) => drop(query(&file, &AT).unwrap()),
            }
        }
    }
    assert!(refused > 400, "{refused}");
    let place = bytes.windows(4).position(|w| w == format::UNCERTAIN).unwrap();
    for (at, value, what) in
        [(place + 8, 33, "more parameters than there may be"), (place + 8 + 10, 3, "a transform"), (place + 8 + 24 + 8, 3, "a scale")]
    {
        let mut damaged = bytes.clone();
        damaged[at] = value;
        fix(&mut damaged);
        assert!(coldplate_runtime::Surrogate::open(&damaged).is_err(), "{what}");
    }
    // A reader that does not know the section must not answer.
    let mut unknown = bytes.clone();
    unknown[place..place + 4].copy_from_slice(b"UNCX");
    fix(&mut unknown);
    assert_eq!(coldplate_runtime::Surrogate::open(&unknown).unwrap_err(), OpenError::Section(*b"UNCX"));
}
