//! The further sections of a file: their content, and every check of it.

use crate::bytes::{Numbers, part, u16_at, u32_at};
use crate::check::{Checked, OpenError, check_name, ensure, records, within};
use crate::direction::Band;
use crate::format::*;
use crate::in_time::InTime;
use crate::model::Polynomial;
use crate::surrogate::{Held, Surrogate};
use crate::uncertain::{Scale, Uncertainty, packed};

/// Content of the further sections.
#[derive(Default)]
pub(crate) struct Further<'a> {
    pub(crate) held: &'a [[u8; MEDIUM_RECORD]],
    /// Names and units of the held variables.
    pub(crate) held_text: &'a str,
    pub(crate) uncertainty: Option<Uncertainty<'a>>,
    pub(crate) corners: &'a [[u8; CORNER_RECORD]],
    /// Marks of the readings that were learnt.
    pub(crate) readings: &'a [[u8; 8]],
    /// Bytes of the section on the dependence of answers on held variables, not decoded.
    pub(crate) followed: &'a [u8],
    pub(crate) mesh: Numbers<'a>,
    pub(crate) in_time: Option<InTime<'a>>,
}

impl<'a> Further<'a> {
    /// The `count` sections in `rest`, which ends at byte `end` of the file: tags ascend, contents begin at multiples
    /// of eight. A tag with a capital first letter marks a section that answers depend on; an unknown one is refused. A
    /// section with a small first letter may be skipped.
    pub(crate) fn cut(mut rest: &'a [u8], end: usize, count: usize, variables: usize, points: usize) -> Result<Self, OpenError> {
        let mut further = Self::default();
        let mut last = [0; 4];
        for _ in 0..count {
            let gap = (end - rest.len()).wrapping_neg() % 8;
            let padding: &[[u8; 1]] = records(&mut rest, gap)?;
            ensure(padding.iter().all(|b| b[0] == 0), OpenError::Reserved)?;
            let (head, behind) = rest.split_first_chunk::<SECTION_HEADER>().ok_or(OpenError::Length)?;
            let [a, b, c, d, ..] = *head;
            let tag = [a, b, c, d];
            ensure(tag > last && tag.iter().all(u8::is_ascii_alphabetic), OpenError::Section(tag))?;
            last = tag;
            let (content, behind) = behind.split_at_checked(u32_at(head, 4)).ok_or(OpenError::Length)?;
            rest = behind;
            match tag {
                CORNERS => further.corners = corners(content, variables)?,
                READINGS => further.readings = whole(content)?,
                HELD => (further.held, further.held_text) = held(content)?,
                UNCERTAIN => further.uncertainty = Some(uncertain(content, variables, points)?),
                FOLLOWED => further.followed = content,
                MESH => further.mesh = mesh(content, points)?,
                IN_TIME => further.in_time = Some(in_time(content, variables, points)?),
                _ if tag[0].is_ascii_uppercase() => return Err(OpenError::Section(tag)),
                _ => {}
            }
        }
        ensure(rest.is_empty(), OpenError::Length)?;
        Ok(further)
    }
}

/// Error of the mesh, a half width per point.
fn mesh(content: &[u8], points: usize) -> Result<Numbers<'_>, OpenError> {
    let widths = Numbers(whole(content)?);
    ensure(widths.len() == points, OpenError::Length)?;
    Ok(widths)
}

/// The content as records alone.
fn whole<const N: usize>(mut content: &[u8]) -> Result<&[[u8; N]], OpenError> {
    let count = content.len() / N;
    let list = records(&mut content, count)?;
    ensure(content.is_empty(), OpenError::Length)?;
    Ok(list)
}

/// The records of corners without a row, checked.
fn corners(content: &[u8], variables: usize) -> Result<&[[u8; CORNER_RECORD]], OpenError> {
    let list: &[[u8; CORNER_RECORD]] = whole(content)?;
    within(list.len(), 1, MAX_CORNERS, "corners without a row")?;
    for [number @ .., first, second, signs, a, b, c, d, e] in list {
        ensure(f64::from_le_bytes(*number).is_finite(), OpenError::Number("reach of a corner"))?;
        ensure(first < second && usize::from(*second) < variables, OpenError::Index("variable of a corner"))?;
        ensure(*signs < 4 && [a, b, c, d, e] == [&0; 5], OpenError::Reserved)?;
    }
    Ok(list)
}

/// The records of the held variables, and their text.
fn held(mut content: &[u8]) -> Result<(&[[u8; MEDIUM_RECORD]], &str), OpenError> {
    let count: &[[u8; 8]] = records(&mut content, 1)?;
    let count = count.first().ok_or(OpenError::Length)?;
    within(u32_at(count, 0), 1, MAX_HELD, "held variables")?;
    ensure(u32_at(count, 4) == 0, OpenError::Reserved)?;
    let list = records(&mut content, u32_at(count, 0))?;
    Ok((list, core::str::from_utf8(content).map_err(|_| OpenError::Text("text of the held variables"))?))
}

/// The section on the uncertainty of the answers, divided into its parts; all its numbers are finite afterwards.
fn uncertain(mut content: &[u8], variables: usize, points: usize) -> Result<Uncertainty<'_>, OpenError> {
    let head: &[[u8; UNCERTAIN_HEADER]] = records(&mut content, 1)?;
    let head: &[u8; UNCERTAIN_HEADER] = head.first().ok_or(OpenError::Length)?;
    let [parameters, terms, degree, measured] = [0, 2, 4, 6].map(|at| u16_at(head, at));
    within(parameters, 0, MAX_PARAMETERS, "uncertain parameters")?;
    within(terms, usize::from(parameters > 0), if parameters > 0 { MAX_SLOPE_TERMS } else { 0 }, "terms of the slopes")?;
    within(degree, 0, MAX_DEGREE, "degree of the slopes")?;
    within(measured, 0, MAX_MEASURED, "measured conditions")?;
    let tests = u16_at(head, 22);
    within(tests, 1, MAX_SELF_TESTS, "self-tests")?;
    let is_known = match u16_at(head, 20) {
        0 => false,
        1 => true,
        _ => return Err(OpenError::Reserved),
    };
    let transforms = part(head, 8, MAX_VARIABLES);
    let list = records(&mut content, parameters)?;
    let mut numbers = |count: usize| -> Result<Numbers<'_>, OpenError> {
        let taken = Numbers(records(&mut content, count)?);
        ensure(taken.iter().all(f64::is_finite), OpenError::Number("number of the uncertainty"))?;
        Ok(taken)
    };
    let states = if is_known { parameters + points + 1 } else { 0 };
    let values = numbers(4 * parameters)?;
    let misses = numbers(2 * points)?;
    let growth = numbers(1)?.at(0);
    let measured = numbers(measured * variables)?;
    let (mean, covariance) = (numbers(states)?, numbers(packed(states, 0))?);
    let slopes = numbers(points * terms * parameters)?;
    let tests = numbers(tests * points)?;
    let exponents: &[[u8; 1]] = records(&mut content, terms * variables.div_ceil(2))?;
    let text = core::str::from_utf8(content).map_err(|_| OpenError::Text("text of the uncertainty"))?;
    ensure(text.len() == u32_at(head, 16), OpenError::Length)?;
    Ok(Uncertainty {
        records: list,
        text,
        values,
        misses,
        growth,
        measured,
        mean,
        covariance,
        slope_terms: Polynomial::of_terms(transforms, exponents.as_flattened(), terms, degree),
        slopes,
        tests,
        points,
        variables,
    })
}

/// The section on the machine over time, divided into its parts; all its numbers are finite afterwards.
fn in_time(mut content: &[u8], variables: usize, points: usize) -> Result<InTime<'_>, OpenError> {
    let head: &[[u8; IN_TIME_HEADER]] = records(&mut content, 1)?;
    let head: &[u8; IN_TIME_HEADER] = head.first().ok_or(OpenError::Length)?;
    let [states, steady_terms, moving_terms, test_count] = [0, 2, 4, 6].map(|at| u16_at(head, at));
    let [steady_degree, moving_degree] = [24, 26].map(|at| u16_at(head, at));
    within(states, 1, MAX_STATES, "states")?;
    within(steady_terms, 1, MAX_SLOPE_TERMS, "terms of the steady states")?;
    within(moving_terms, 1, MAX_SLOPE_TERMS, "terms of the dynamics")?;
    within(test_count, 0, MAX_SELF_TESTS, "self-tests over time")?;
    within(steady_degree, 0, MAX_DEGREE, "degree of the steady states")?;
    within(moving_degree, 0, MAX_DEGREE, "degree of the dynamics")?;
    ensure(u32_at(head, 28) == 0, OpenError::Reserved)?;
    let counts = [
        points,
        states,
        2 * states,
        packed(states, 0),
        steady_terms * states,
        moving_terms * states * states,
        points * moving_terms * states,
        test_count * (2 * variables + 1 + points),
    ];
    let numbers = Numbers(records(&mut content, counts.iter().sum())?);
    ensure(numbers.iter().all(f64::is_finite), OpenError::Number("number of the dynamics"))?;
    let mut from = 0;
    let [errors, reach, uniform, spread, steady_coefficients, rates, outputs, tests] = counts.map(|count| {
        from += count;
        numbers.part(from - count, count)
    });
    let pair = variables.div_ceil(2);
    let [steady, moving]: [&[[u8; 1]]; 2] = [records(&mut content, steady_terms * pair)?, records(&mut content, moving_terms * pair)?];
    ensure(content.is_empty(), OpenError::Length)?;
    Ok(InTime {
        states,
        steady: Polynomial::of_terms(part(head, 8, MAX_VARIABLES), steady.as_flattened(), steady_terms, steady_degree),
        moving: Polynomial::of_terms(part(head, 16, MAX_VARIABLES), moving.as_flattened(), moving_terms, moving_degree),
        errors,
        reach,
        uniform,
        spread,
        steady_coefficients,
        rates,
        outputs,
        tests,
        test_count,
        numbers,
    })
}

impl<'a> Surrogate<'a> {
    /// Checks the section on the machine over time, and prepares the scaling of its variables.
    pub(crate) fn check_in_time(mut self) -> Result<Self, OpenError> {
        let Some(own) = self.in_time else { return Ok(self) };
        for terms in [own.steady, own.moving] {
            check_exponents(&terms, self.variables.len())?;
            self.use_transforms(terms.transforms)?;
        }
        ensure(own.errors.iter().chain(own.reach.iter()).all(|e| e >= 0.0), OpenError::Number("error over time"))?;
        check_covariance(own.states, own.spread)?;
        let (variables, points) = (self.variables.len(), self.points.len());
        let (mut x, mut values) = ([0.0; MAX_VARIABLES], [0.0; MAX_POINTS]);
        let (x, values) = (&mut x[..variables.min(MAX_VARIABLES)], &mut values[..points.min(MAX_POINTS)]);
        for vector in 0..own.test_count {
            let test = own.tests.part(vector * (2 * variables + 1 + points), 2 * variables + 1 + points);
            let set = |x: &mut [f64], from: usize| x.iter_mut().zip(test.part(from, variables).iter()).for_each(|(x, v)| *x = v);
            let broken = |_| OpenError::Number("self-test over time");
            set(x, 0);
            let mut state = self.at_rest(x).map_err(broken)?;
            set(x, variables);
            self.step(&mut state, test.at(2 * variables), x).map_err(broken)?;
            self.read(&state, x, values).map_err(broken)?;
            for (point, value) in values.iter().enumerate() {
                let stated = test.at(2 * variables + 1 + point);
                let is_same = (value - stated).abs() <= SELF_TEST_TOLERANCE * stated.abs().max(1.0);
                ensure(is_same, OpenError::SelfTest { vector, point })?;
            }
        }
        Ok(self)
    }

    /// Checks that the error of the mesh is a part of each point's half width.
    pub(crate) fn check_mesh(&self) -> Checked {
        let is_part = |(mesh, whole): (f64, f64)| (0.0..=whole).contains(&mesh);
        ensure(self.mesh.iter().zip(self.half_widths().iter()).all(is_part), OpenError::Number("error of the mesh"))
    }

    pub(crate) fn check_held(&self) -> Checked {
        let mut end = 0;
        for (i, record) in self.held.iter().enumerate() {
            end = check_texts(
                self.held_text,
                end,
                [u32_at(record, 8), u16_at(record, 12), u16_at(record, 14)],
                ["name of a held variable", "unit of a held variable"],
            )?;
            let Held { name, value, .. } = self.held_variable(record);
            ensure(value.is_finite(), OpenError::Number("value of a held variable"))?;
            let earlier = self.held().take(i).any(|other| other.name == name) || self.variables().any(|v| v.name == name);
            ensure(!earlier, OpenError::Text("name of a held variable"))?;
        }
        ensure(end == self.held_text.len(), OpenError::Length)
    }

    /// Checks the section on the uncertainty of the answers, and prepares the scaling of its variables.
    pub(crate) fn check_uncertainty(mut self) -> Result<Self, OpenError> {
        let Some(uncertainty) = self.uncertainty else { return Ok(self) };
        let mut end = 0;
        for (i, record) in uncertainty.records.iter().enumerate() {
            end = check_texts(
                uncertainty.text,
                end,
                [u32_at(record, 0), u16_at(record, 4), u16_at(record, 6)],
                ["name of a parameter", "unit of a parameter"],
            )?;
            ensure(record[9] <= 1 && record[10..].iter().all(|b| *b == 0), OpenError::Reserved)?;
            let scale = Scale::from_code(record[8]).ok_or(OpenError::Transform)?;
            let Some(parameter) = uncertainty.parameter(i) else { return Err(OpenError::Length) };
            let earlier = uncertainty.parameters().take(i).any(|other| other.name == parameter.name)
                || self.variables().any(|v| v.name == parameter.name)
                || self.held().any(|held| held.name == parameter.name);
            ensure(!earlier, OpenError::Text("name of a parameter"))?;
            let is_ordered = parameter.low <= parameter.nominal && parameter.nominal <= parameter.high;
            ensure(parameter.deviation > 0.0 && is_ordered, OpenError::Number("value of a parameter"))?;
            let is_positive = parameter.low > 0.0;
            ensure(scale == Scale::Linear || is_positive, OpenError::Number("value of a parameter"))?;
            let ends = [parameter.standardised(parameter.low), parameter.standardised(parameter.high)];
            ensure(ends.iter().all(|z| z.is_finite()), OpenError::Number("value of a parameter"))?;
        }
        ensure(end == uncertainty.text.len(), OpenError::Length)?;
        ensure((0..self.points.len()).all(|p| uncertainty.missed(p).0 >= 0.0), OpenError::Number("error of the model"))?;
        ensure(uncertainty.growth >= 0.0, OpenError::Number("growth of the model's error"))?;
        check_exponents(&uncertainty.slope_terms, uncertainty.variables)?;
        check_covariance(uncertainty.mean.len(), uncertainty.covariance)?;
        ensure(uncertainty.tests.len() == self.self_tests * self.points.len(), OpenError::Length)?;
        self.use_transforms(uncertainty.slope_terms.transforms)?;
        Ok(self)
    }

    /// Checks the bands at the conditions of the self-tests.
    pub(crate) fn check_bands(&self, vector: usize, x: &[f64], values: &mut [f64]) -> Checked {
        let Some(uncertainty) = self.uncertainty else { return Ok(()) };
        let mut bands = [Band::default(); MAX_POINTS];
        let bands = &mut bands[..self.points.len().min(MAX_POINTS)];
        self.bands(x, None, values, bands).map_err(|_| OpenError::Length)?;
        for (point, band) in bands.iter().enumerate() {
            let stated = uncertainty.tests.at(vector * bands.len() + point);
            let tolerance = SELF_TEST_TOLERANCE * stated.abs().max(1.0);
            ensure((band.total - stated).abs() <= tolerance, OpenError::SelfTest { vector, point })?;
        }
        Ok(())
    }
}

/// Checks name and unit of a record, which follow those of the record before; returns their end.
fn check_texts(text: &str, end: usize, [start, name, unit]: [usize; 3], what: [&'static str; 2]) -> Result<usize, OpenError> {
    ensure(start == end, OpenError::Place("texts of a section"))?;
    let whole = text.get(start..start + name + unit).filter(|whole| whole.is_char_boundary(name));
    let (name, unit) = whole.ok_or(OpenError::Place("texts of a section"))?.split_at(name);
    check_name(name, false).map_err(|()| OpenError::Text(what[0]))?;
    check_name(unit, true).map_err(|()| OpenError::Text(what[1]))?;
    Ok(start + name.len() + unit.len())
}

fn check_exponents(terms: &Polynomial<'_>, variables: usize) -> Checked {
    let mut degree = 0;
    for term in terms.exponents.chunks_exact(variables.div_ceil(2).max(1)) {
        let total = term.iter().map(|pair| usize::from(pair & 15) + usize::from(pair >> 4)).sum();
        ensure(total <= MAX_DEGREE, OpenError::Degree)?;
        let unpaired = variables % 2 == 1 && term.last().is_some_and(|pair| pair >> 4 != 0);
        ensure(!unpaired, OpenError::Reserved)?;
        degree = degree.max(total);
    }
    ensure(degree == terms.degree, OpenError::Degree)
}

/// Checks that no variance is negative, and that no covariance exceeds its bound by two variances.
fn check_covariance(count: usize, covariance: Numbers<'_>) -> Checked {
    let of = |i: usize, j: usize| covariance.at(packed(i, j));
    for i in 0..count {
        ensure(of(i, i) >= 0.0, OpenError::Number("variance"))?;
        for j in 0..i {
            let most = of(i, i) * of(j, j);
            ensure(of(i, j) * of(i, j) <= most * (1.0 + 1e-9) + 1e-18, OpenError::Number("covariance"))?;
        }
    }
    Ok(())
}
