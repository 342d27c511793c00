//! The section of a surrogate file on the machine over time; `docs/reference/surrogate-sections.md` states the layout.

use coldplate_runtime::{Polynomial, Surrogate as Opened, format};

use super::super::model::{InTimeSpec, SharedTerms, SurrogateSpec};
use coldplate_base::error::{Error, Result};

/// Durations of the steps that every reader must reproduce, s. Chosen: one short and one long beside the time
/// constants of machines.
const TESTS: [f64; 2] = [30.0, 1800.0];

/// The content of the section; each of `tests` holds two conditions, a duration and the values at its end.
///
/// # Errors
/// Tables whose sizes do not agree with those of the surrogate.
pub fn content(own: &InTimeSpec, surrogate: &SurrogateSpec, tests: &[Vec<f64>]) -> Result<Vec<u8>> {
    let (points, n) = (surrogate.points.len(), own.states);
    let variables = surrogate.variables.len();
    let is_of = |shared: &SharedTerms| shared.transforms.len() == variables && shared.terms.iter().all(|t| t.len() == variables);
    let moving = own.moving_terms.terms.len();
    let sizes_agree = is_of(&own.steady_terms)
        && is_of(&own.moving_terms)
        && own.steady.len() == own.steady_terms.terms.len()
        && own.rates.len() == moving
        && own.steady.iter().all(|row| row.len() == n)
        && own.rates.iter().all(|row| row.len() == n * n)
        && own.outputs.len() == points
        && own.outputs.iter().all(|row| row.len() == moving * n)
        && own.uniform.iter().all(|row| row.len() == n)
        && own.reach.len() == n
        && own.spread.len() == n * (n + 1) / 2
        && own.errors.len() == points;
    if !sizes_agree {
        return Err(Error::input("the dynamics of this surrogate are those of other points or variables"));
    }
    let degree = |shared: &SharedTerms| shared.terms.iter().map(|t| t.iter().map(|e| usize::from(*e)).sum()).max().unwrap_or(0);
    let small = |values: &[usize]| values.iter().flat_map(|v| (*v as u16).to_le_bytes()).collect::<Vec<u8>>();
    let mut bytes = small(&[n, own.steady_terms.terms.len(), moving, tests.len()]);
    for shared in [&own.steady_terms, &own.moving_terms] {
        bytes.extend(shared.transforms.iter().map(|t| *t as u8).chain(std::iter::repeat(0)).take(format::MAX_VARIABLES));
    }
    bytes.extend(small(&[degree(&own.steady_terms), degree(&own.moving_terms), 0, 0]));
    let numbers = (own.errors.iter().chain(&own.reach).chain(own.uniform.iter().flatten()).chain(&own.spread))
        .chain(own.steady.iter().flatten())
        .chain(own.rates.iter().flatten())
        .chain(own.outputs.iter().flatten())
        .chain(tests.iter().flatten());
    bytes.extend(numbers.flat_map(|n| n.to_le_bytes()));
    let terms = own.steady_terms.terms.iter().chain(&own.moving_terms.terms);
    bytes.extend(terms.flat_map(|t| t.chunks(2)).map(|pair| pair[0] | pair.get(1).map_or(0, |odd| odd << 4)));
    Ok(bytes)
}

/// The steps that readers must reproduce, computed from a file without any.
///
/// # Errors
/// A file that cannot be opened or moved.
pub fn tests(bytes: &[u8], surrogate: &SurrogateSpec) -> Result<Vec<Vec<f64>>> {
    let broken = |e: &dyn std::fmt::Display| Error::numerics(format!("the dynamics of this surrogate cannot be used: {e}"));
    let file = Opened::open(bytes).map_err(|e| broken(&e))?;
    let at = |share: f64| -> Vec<f64> { surrogate.variables.iter().map(|v| v.low + share * (v.high - v.low)).collect() };
    let test = |duration: f64| {
        let (from, to) = (at(0.25), at(0.75));
        let mut values = vec![0.0; surrogate.points.len()];
        let mut state = file.at_rest(&from).map_err(|e| broken(&e))?;
        file.step(&mut state, duration, &to).map_err(|e| broken(&e))?;
        file.read(&state, &to, &mut values).map_err(|e| broken(&e))?;
        Ok([from, to, vec![duration], values].concat())
    };
    TESTS.into_iter().map(test).collect()
}

/// Content of the section of an opened file, if it has one; the runtime has checked it.
pub fn read(file: &Opened<'_>) -> Option<InTimeSpec> {
    let own = file.in_time()?;
    let (n, points, variables) = (own.states(), file.point_count(), file.variable_count());
    let shared = |all: Polynomial<'_>| SharedTerms {
        transforms: (0..variables).map(|v| all.transform(v)).collect(),
        terms: (0..all.terms).map(|term| (0..variables).map(|v| all.exponent(term, v)).collect()).collect(),
    };
    let (steady_terms, moving_terms) = (shared(own.steady_terms()), shared(own.moving_terms()));
    let moving = moving_terms.terms.len();
    let all = own.numbers();
    let mut numbers = all.iter();
    let mut take = |count: usize| -> Vec<f64> { numbers.by_ref().take(count).collect() };
    let rows = |all: &[f64], length: usize| all.chunks(length.max(1)).map(<[f64]>::to_vec).collect::<Vec<_>>();
    let (errors, reach) = (take(points), take(n));
    let uniform = [take(n), take(n)];
    let spread = take(n * (n + 1) / 2);
    let steady = rows(&take(steady_terms.terms.len() * n), n);
    let rates = rows(&take(moving * n * n), n * n);
    let outputs = rows(&take(points * moving * n), moving * n);
    Some(InTimeSpec { states: n, steady_terms, moving_terms, steady, rates, outputs, uniform, reach, spread, errors })
}
