//! Surrogates over time: steps against matrix exponentials, states from readings, what is refused.

use coldplate_runtime::StepError;
use coldplate_surrogate::fit::evaluate::scale_row;
use coldplate_surrogate::fit::file::{encode, open};
use coldplate_surrogate::fit::model::*;
use nalgebra::{DMatrix, DVector};

use crate::surrogate::examples::*;

/// Two conditions apart from each other.
fn conditions(surrogate: &SurrogateSpec) -> [Vec<f64>; 2] {
    [0.2, 0.9].map(|share| surrogate.variables.iter().map(|v| v.low + share * (v.high - v.low)).collect())
}

/// The values of shared polynomials at a condition, by their definition.
fn at(surrogate: &SurrogateSpec, shared: &SharedTerms, coefficients: &[Vec<f64>], x: &[f64]) -> Vec<f64> {
    let u = scale_row(&surrogate.variables, &shared.transforms, x);
    let power = |term: &Vec<u8>| term.iter().zip(&u).map(|(e, u)| u.powi(i32::from(*e))).product::<f64>();
    let mut sums = vec![0.0; coefficients[0].len()];
    for (term, row) in shared.terms.iter().zip(coefficients) {
        sums.iter_mut().zip(row).for_each(|(sum, c)| *sum += c * power(term));
    }
    sums
}

/// Values after a step from the steady state of one condition to another, by the matrix exponential.
fn exact(surrogate: &SurrogateSpec, from: &[f64], to: &[f64], duration: f64) -> Vec<f64> {
    let own = surrogate.in_time.as_ref().unwrap();
    let n = own.states;
    let [begin, end] = [from, to].map(|x| DVector::from_vec(at(surrogate, &own.steady_terms, &own.steady, x)));
    let rates = DMatrix::from_column_slice(n, n, &at(surrogate, &own.moving_terms, &own.rates, to));
    let away = (-rates * duration).exp() * (begin - end);
    let bytes = encode(&SurrogateSpec { in_time: None, ..surrogate.clone() }).unwrap();
    let mut values = vec![0.0; surrogate.points.len()];
    open(&bytes).unwrap().evaluate(to, &mut values).unwrap();
    for (value, outputs) in values.iter_mut().zip(&own.outputs) {
        let by_term: Vec<Vec<f64>> = outputs.chunks(n).map(<[f64]>::to_vec).collect();
        *value += DVector::from_vec(at(surrogate, &own.moving_terms, &by_term, to)).dot(&away);
    }
    values
}

#[test]
fn a_step_of_any_length_follows_the_exponential() {
    for (points, states) in [(3, 4), (23, 24), (2, 1)] {
        let surrogate = moving(points, states);
        let bytes = encode(&surrogate).unwrap();
        let file = open(&bytes).unwrap();
        let [from, to] = conditions(&surrogate);
        let rest = file.at_rest(&from).unwrap();
        for duration in [1e-3, 0.3, 7.0, 60.0, 600.0, 7200.0, 1e5, 1e8] {
            let (mut state, mut values) = (rest, vec![0.0; points]);
            file.step(&mut state, duration, &to).unwrap();
            file.read(&state, &to, &mut values).unwrap();
            for (value, truth) in values.iter().zip(exact(&surrogate, &from, &to, duration)) {
                assert!((value - truth).abs() < 0.01, "{states} states after {duration} s: {value}, exactly {truth}");
            }
        }
        // Many short steps, as a controller takes them, come to the same.
        let (mut state, mut values) = (rest, vec![0.0; points]);
        for _ in 0..3000 {
            file.step(&mut state, 0.1, &to).unwrap();
        }
        file.read(&state, &to, &mut values).unwrap();
        for (value, truth) in values.iter().zip(exact(&surrogate, &from, &to, 300.0)) {
            assert!((value - truth).abs() < 0.01, "{states} states: {value}, exactly {truth}");
        }
    }
}

#[test]
fn short_steps_are_of_third_order() {
    let surrogate = moving(3, 4);
    let bytes = encode(&surrogate).unwrap();
    let file = open(&bytes).unwrap();
    let [from, to] = conditions(&surrogate);
    let error = |pieces: usize| {
        let (mut state, mut values) = (file.at_rest(&from).unwrap(), vec![0.0; 3]);
        let duration = 0.8;
        (0..pieces).for_each(|_| file.step(&mut state, duration / pieces as f64, &to).unwrap());
        file.read(&state, &to, &mut values).unwrap();
        values.iter().zip(exact(&surrogate, &from, &to, duration)).map(|(v, t)| (v - t).abs()).fold(0.0, f64::max)
    };
    let slope = (error(2) / error(4)).log2();
    assert!((2.7..3.3).contains(&slope), "{slope}: errors {} and {}", error(2), error(4));
}

#[test]
fn a_steady_state_stays_and_is_that_of_a_query() {
    let surrogate = moving(23, 24);
    let bytes = encode(&surrogate).unwrap();
    let file = open(&bytes).unwrap();
    let [x, _] = conditions(&surrogate);
    let (mut values, mut steady) = (vec![0.0; 23], vec![0.0; 23]);
    file.evaluate(&x, &mut steady).unwrap();
    let mut state = file.at_rest(&x).unwrap();
    for duration in [0.0, 1.0, 1e6] {
        file.step(&mut state, duration, &x).unwrap();
        file.read(&state, &x, &mut values).unwrap();
        assert!(values.iter().zip(&steady).all(|(v, s)| (v - s).abs() < 1e-9));
    }
    // From one temperature everywhere it is reached again.
    let mut state = file.at_temperature(20.0).unwrap();
    file.step(&mut state, 1e9, &x).unwrap();
    file.read(&state, &x, &mut values).unwrap();
    assert!(values.iter().zip(&steady).all(|(v, s)| (v - s).abs() < 1e-6));
}

#[test]
fn readings_give_the_state_that_they_were_read_in() {
    let surrogate = moving(23, 8);
    let bytes = encode(&surrogate).unwrap();
    let file = open(&bytes).unwrap();
    let [from, to] = conditions(&surrogate);
    let mut state = file.at_rest(&from).unwrap();
    file.step(&mut state, 900.0, &to).unwrap();
    let (mut readings, mut found) = (vec![0.0; 23], vec![0.0; 23]);
    file.read(&state, &to, &mut readings).unwrap();
    let error = |readings: &[f64], truth: &[f64], found: &mut [f64]| {
        let state = file.at_readings(&to, readings, 1e-3).unwrap();
        file.read(&state, &to, found).unwrap();
        found.iter().zip(truth).map(|(f, t)| (f - t).abs()).fold(0.0, f64::max)
    };
    let all = error(&readings, &readings, &mut found);
    let mut fewer = readings.clone();
    fewer[15..].fill(f64::NAN);
    let some = error(&fewer, &readings, &mut found);
    let mut steady = vec![0.0; 23];
    file.evaluate(&to, &mut steady).unwrap();
    let away = steady.iter().zip(&readings).map(|(f, t)| (f - t).abs()).fold(0.0, f64::max);
    assert!(all < 0.05 * away && some < 0.2 * away, "all {all}, fifteen of 23 {some}, none {away}");
    let none = file.at_readings(&to, &[f64::NAN; 23], 1e-3).unwrap();
    file.read(&none, &to, &mut found).unwrap();
    assert!(found.iter().zip(&steady).all(|(f, s)| (f - s).abs() < 1e-12));
}

#[test]
fn what_cannot_be_stepped_is_refused_and_changes_nothing() {
    let surrogate = moving(3, 4);
    let bytes = encode(&surrogate).unwrap();
    let file = open(&bytes).unwrap();
    let [x, _] = conditions(&surrogate);
    let mut state = file.at_rest(&x).unwrap();
    let before = state;
    assert_eq!(file.step(&mut state, -1.0, &x), Err(StepError::Number));
    assert_eq!(file.step(&mut state, f64::NAN, &x), Err(StepError::Number));
    assert_eq!(file.step(&mut state, f64::INFINITY, &x), Err(StepError::Number));
    assert_eq!(file.step(&mut state, 1.0, &[f64::NAN, 1.0, 1.0, 1.0]), Err(StepError::Number));
    assert!(matches!(file.step(&mut state, 1.0, &x[1..]), Err(StepError::Shape(_))));
    assert!(matches!(file.read(&state, &x, &mut [0.0; 2]), Err(StepError::Shape(_))));
    assert_eq!(file.at_readings(&x, &[20.0; 3], 0.0), Err(StepError::Number));
    assert!(matches!(file.at_readings(&x, &[20.0; 2], 0.1), Err(StepError::Shape(_))));
    assert_eq!(file.at_temperature(f64::INFINITY), Err(StepError::Number));
    assert_eq!(state, before);
    let still = encode(&small()).unwrap();
    let still = open(&still).unwrap();
    assert!(still.in_time().is_none());
    assert_eq!(still.at_temperature(20.0), Err(StepError::NotInTime));
    // A state that was taken apart and put together goes on alike.
    let again = coldplate_runtime::State::from_numbers(&state.numbers());
    assert_eq!(again, state);
}
