//! Time of a full query of ten points over four variables at one condition: values, bands, limits
//! (ten maxima, a rise, a spread) and verdict. Each figure is the least of many batches, because
//! whatever else runs on the machine can only add to it.
//!
//! The files are those of `fixtures/`, written by `tests/it/surrogate/examples.rs` of coldplate-surrogate.

use std::hint::black_box;
use std::time::Instant;

use coldplate_runtime::{SingleState, Surrogate};

const BATCHES: usize = 400;
const CONDITIONS: usize = 256;

fn main() {
    let files: [(&str, &[u8], f64); 7] = [
        ("polynomial, 70 terms", include_bytes!("../fixtures/bench-polynomial.cps"), 0.5),
        ("the same, 12 parameters", include_bytes!("../fixtures/bench-uncertain.cps"), 2.0),
        ("thin plate, 200 centres", include_bytes!("../fixtures/bench-thin-plate.cps"), 5.0),
        ("cubic, 200 centres", include_bytes!("../fixtures/bench-cubic.cps"), 5.0),
        ("multiquadric, 200 centres", include_bytes!("../fixtures/bench-multiquadric.cps"), 5.0),
        ("gaussian, 200 centres", include_bytes!("../fixtures/bench-gaussian.cps"), 5.0),
        ("thin plate, ten bases", include_bytes!("../fixtures/bench-ten-bases.cps"), f64::INFINITY),
    ];
    println!("{:<28}{:>12}{:>12}{:>16}{:>12}{:>12}", "ten points, one condition", "query", "target", "one gradient", "open", "file");
    for (name, bytes, target) in files {
        let surrogate = Surrogate::open(bytes).expect("the fixtures are intact");
        let conditions = conditions(&surrogate);
        let mut values = vec![0.0; surrogate.point_count()];
        let query = least(|| {
            for x in &conditions {
                black_box(surrogate.query(black_box(x), &mut values)).expect("the shapes fit");
                black_box(&values);
            }
        });
        let mut slopes = [0.0; 4];
        let gradient = least(|| {
            for x in &conditions {
                black_box(surrogate.gradient(black_box(x), 3, &mut slopes)).expect("the shapes fit");
                black_box(&slopes);
            }
        });
        let open = least(|| {
            for _ in 0..4 {
                black_box(Surrogate::open(black_box(bytes))).expect("the fixtures are intact");
            }
        });
        let (query, gradient, open) = (query / CONDITIONS as f64, gradient / CONDITIONS as f64, open / 4.0);
        let target = if target.is_finite() { format!("{target} us") } else { String::new() };
        let size = format!("{} B", bytes.len());
        println!("{name:<28}{query:>9.3} us{target:>12}{gradient:>13.3} us{open:>9.1} us{size:>12}");
    }
    steps();
}

/// A second of 23 points and 24 states at a condition that has moved by up to a hundredth of its range, as a controller steps, and
/// what the points read after it.
fn steps() {
    let bytes = include_bytes!("../fixtures/bench-moving.cps");
    let surrogate = Surrogate::open(bytes).expect("the fixtures are intact");
    let middle: Vec<f64> = surrogate.variables().map(|v| 0.5 * (v.low + v.high)).collect();
    let near = |x: Vec<f64>| x.iter().zip(&middle).map(|(x, m)| m + 0.01 * (x - m)).collect::<Vec<f64>>();
    let conditions: Vec<Vec<f64>> = conditions(&surrogate).into_iter().map(near).collect();
    let mut state = surrogate.at_rest(&conditions[0]).expect("it moves");
    let mut values = [0.0; 23];
    let step = least(|| {
        for x in &conditions {
            surrogate.step(&mut state, black_box(1.0), black_box(x)).expect("a step");
        }
    });
    let read = least(|| {
        for x in &conditions {
            surrogate.read(black_box(&state), black_box(x), &mut values).expect("the shapes fit");
            black_box(&values);
        }
    });
    let section = surrogate.in_time().map_or(0, |own| 8 * own.numbers().len());
    let (step, read) = (step / CONDITIONS as f64, read / CONDITIONS as f64);
    println!("23 points in time, 24 states: step {step:.2} us, read {read:.2} us, target 5 us together; {section} B of numbers");
    let mut numbers = vec![0.0; surrogate.in_time().map_or(0, |own| own.single_len())];
    let single = surrogate.single(&mut numbers).expect("it moves");
    let mut state = SingleState::from(&surrogate.at_rest(&conditions[0]).expect("it moves"));
    let mut values = [0.0; 23];
    let step = least(|| {
        for x in &conditions {
            single.step(&mut state, black_box(1.0), black_box(x)).expect("a step");
        }
    });
    let read = least(|| {
        for x in &conditions {
            single.read(black_box(&state), black_box(x), &mut values).expect("the shapes fit");
            black_box(&values);
        }
    });
    let (step, read) = (step / CONDITIONS as f64, read / CONDITIONS as f64);
    let room = size_of::<f32>() * surrogate.in_time().map_or(0, |own| own.single_len());
    println!("the same in single precision: step {step:.2} us, read {read:.2} us; {room} B of numbers");
}

/// Conditions spread over the fitted range by irrational steps.
fn conditions(surrogate: &Surrogate<'_>) -> Vec<Vec<f64>> {
    let at = |n: usize| {
        let inside = |(i, low, high): (usize, f64, f64)| low + (n as f64 * ((i + 2) as f64).sqrt()).fract() * (high - low);
        surrogate.variables().enumerate().map(|(i, v)| inside((i, v.low, v.high))).collect()
    };
    (0..CONDITIONS).map(at).collect()
}

/// Least time of a batch in microseconds.
fn least(mut batch: impl FnMut()) -> f64 {
    let time = |_| {
        let start = Instant::now();
        batch();
        start.elapsed().as_secs_f64() * 1e6
    };
    (0..BATCHES).map(time).fold(f64::INFINITY, f64::min)
}
