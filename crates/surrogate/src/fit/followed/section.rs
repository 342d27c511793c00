//! The section of a surrogate file on how its answers follow held variables; `docs/reference/surrogate-sections.md` states the layout.

use coldplate_runtime::format;

use super::super::model::{FollowedSpec, FollowedVariable, Interaction, SurrogateSpec, Transform};
use coldplate_base::error::{Error, Result};

/// Length of the header before the numbers, bytes; from `docs/reference/surrogate-sections.md`.
const HEADER: usize = 16;

/// The content of the section.
///
/// # Errors
/// Tables whose sizes do not agree with those of the surrogate.
pub fn content(followed: &FollowedSpec, surrogate: &SurrogateSpec) -> Result<Vec<u8>> {
    let (points, variables) = (surrogate.points.len(), surrogate.variables.len());
    let is_whole = |v: &FollowedVariable| {
        v.held < surrogate.held.len()
            && v.coefficients.len() == points
            && v.errors.len() == points
            && v.coefficients.iter().all(|c| c.len() == followed.terms.len())
    };
    let sizes_agree = followed.variables.iter().all(is_whole)
        && followed.errors.len() == points
        && followed.interactions.iter().all(|i| i.point < points && i.of.max(i.by) < followed.variables.len())
        && followed.transforms.len() == variables
        && followed.terms.iter().all(|t| t.len() == variables)
        && followed.limits.iter().all(|(limit, held)| *limit < surrogate.limits.len() && *held < surrogate.held.len());
    if !sizes_agree {
        return Err(Error::input("the followed variables of this surrogate are those of other points or variables"));
    }
    let small = |value: usize| (value as u16).to_le_bytes();
    let mut bytes: Vec<u8> = [followed.variables.len(), followed.terms.len(), followed.limits.len(), followed.interactions.len()]
        .into_iter()
        .flat_map(small)
        .collect();
    bytes.extend(followed.transforms.iter().map(|t| *t as u8).chain(std::iter::repeat(0)).take(format::MAX_VARIABLES));
    let ranges = followed.variables.iter().flat_map(|v| [v.low, v.high]);
    let coefficients = followed.variables.iter().flat_map(|v| v.coefficients.iter().flatten().flatten().copied());
    let errors = followed.errors.iter().chain(followed.variables.iter().flat_map(|v| &v.errors)).copied();
    let numbers = ranges.chain(errors).chain(coefficients).chain(followed.interactions.iter().map(|i| i.factor));
    bytes.extend(numbers.flat_map(f64::to_le_bytes));
    bytes.extend(followed.variables.iter().flat_map(|v| small(v.held)));
    bytes.extend(followed.limits.iter().flat_map(|(limit, held)| [small(*limit), small(*held)].concat()));
    bytes.extend(followed.interactions.iter().flat_map(|i| [small(i.point), small(i.of), small(i.by)].concat()));
    bytes.extend(followed.terms.iter().flat_map(|t| t.chunks(2)).map(|pair| pair[0] | pair.get(1).map_or(0, |odd| odd << 4)));
    Ok(bytes)
}

/// Content of the section of a file with these numbers of variables, points, held variables and limits; `None` if there is
/// no section.
///
/// # Errors
/// Content of another length than stated, with numbers that are not finite, or about something the file does not have.
pub fn read(bytes: &[u8], [variables, points, held, limits]: [usize; 4]) -> Result<Option<FollowedSpec>> {
    if bytes.is_empty() {
        return Ok(None);
    }
    let broken = || Error::input("the section on followed variables is damaged").help("write the surrogate anew with `coldplate run`");
    let mut rest = bytes;
    let mut take = |count: usize| -> Result<&[u8]> {
        let (taken, behind) = rest.split_at_checked(count).ok_or_else(broken)?;
        rest = behind;
        Ok(taken)
    };
    let head = take(HEADER)?;
    let [followed, terms, moving, interactions] = [0, 2, 4, 6].map(|at| usize::from(head[at]) | usize::from(head[at + 1]) << 8);
    let transform = |code: &u8| match code {
        0 => Ok(Transform::Identity),
        1 => Ok(Transform::Reciprocal),
        2 => Ok(Transform::Log),
        _ => Err(broken()),
    };
    let transforms = head[8..].iter().take(variables).map(transform).collect::<Result<Vec<_>>>()?;
    let pair = variables.div_ceil(2);
    if followed > format::MAX_HELD || terms > format::MAX_SLOPE_TERMS {
        return Err(broken());
    }
    let count = 2 * followed + (1 + followed) * points + 2 * followed * points * terms + interactions;
    let numbers: Vec<f64> = take(8 * count)?.as_chunks::<8>().0.iter().map(|n| f64::from_le_bytes(*n)).collect();
    let smalls: Vec<usize> = take(2 * (followed + 2 * moving + 3 * interactions))?
        .as_chunks::<2>()
        .0
        .iter()
        .map(|n| usize::from(u16::from_le_bytes(*n)))
        .collect();
    let exponents = take(terms * pair)?;
    let (own, behind) = smalls.split_at(followed);
    let (over, between) = behind.split_at(2 * moving);
    let over: Vec<(usize, usize)> = over.chunks(2).map(|pair| (pair[0], pair[1])).collect();
    let is_sound = rest.is_empty()
        && numbers.iter().all(|n| n.is_finite())
        && own.iter().all(|h| *h < held)
        && between.chunks(3).all(|i| i[0] < points && i[1].max(i[2]) < followed)
        && over.iter().all(|(limit, h)| *limit < limits && *h < held)
        && numbers[..2 * followed].chunks(2).all(|range| range[0] < range[1]);
    if !is_sound {
        return Err(broken());
    }
    let term = |bytes: &[u8]| (0..variables).map(|v| bytes[v / 2] >> (4 * (v % 2)) & 15).collect();
    let (ranges, behind) = numbers.split_at(2 * followed);
    let (errors, behind) = behind.split_at((1 + followed) * points);
    let (errors, own_errors) = errors.split_at(points);
    let (coefficients, factors) = behind.split_at(2 * followed * points * terms);
    let interaction = |(i, factor): (&[usize], &f64)| Interaction { point: i[0], of: i[1], by: i[2], factor: *factor };
    let all: Vec<Vec<[f64; 2]>> = coefficients.chunks(2 * terms.max(1)).map(|row| row.chunks(2).map(|c| [c[0], c[1]]).collect()).collect();
    let variable = |(k, held): (usize, &usize)| FollowedVariable {
        held: *held,
        low: ranges[2 * k],
        high: ranges[2 * k + 1],
        coefficients: all.iter().skip(k * points).take(points).cloned().collect(),
        errors: own_errors[k * points..(k + 1) * points].to_vec(),
    };
    Ok(Some(FollowedSpec {
        transforms,
        terms: exponents.chunks(pair.max(1)).map(term).collect(),
        variables: own.iter().enumerate().map(variable).collect(),
        interactions: between.chunks(3).zip(factors).map(interaction).collect(),
        errors: errors.to_vec(),
        limits: over,
    }))
}
