//! Opening a file: all checks, in time proportional to its size.

use crate::bytes::{Numbers, part, u16_at, u32_at};
use crate::check::{Checked, OpenError, check_name, ensure, records, within};
use crate::format::*;
use crate::further_sections::Further;
use crate::model::{Indices, Kernel};
use crate::surrogate::Surrogate;

impl<'a> Surrogate<'a> {
    /// Opens a surrogate file in memory, at any alignment.
    ///
    /// # Errors
    /// The file is malformed; see [`OpenError`]. Never panics, whatever the bytes.
    pub fn open(bytes: &'a [u8]) -> Result<Self, OpenError> {
        let surrogate = sections(bytes)?;
        let mut cursor = Cursor { numbers: 0, indices: 0, exponents: 0, text: 0 };
        surrogate.check_variables(&mut cursor)?;
        surrogate.check_points(&mut cursor)?;
        surrogate.check_limits(&mut cursor)?;
        let surrogate = surrogate.check_models(&mut cursor)?;
        surrogate.check_provenance(&mut cursor)?;
        cursor.numbers += surrogate.self_tests * (surrogate.variables.len() + surrogate.points.len());
        let Surrogate { numbers, indices, exponents, text, .. } = &surrogate;
        let all_used = cursor.numbers == numbers.len()
            && cursor.indices == indices.len()
            && cursor.exponents == exponents.len()
            && cursor.text == text.len();
        ensure(all_used, OpenError::Length)?;
        surrogate.check_held()?;
        surrogate.check_mesh()?;
        let surrogate = surrogate.check_uncertainty()?;
        let surrogate = surrogate.check_in_time()?;
        surrogate.check_self_tests()?;
        Ok(surrogate)
    }

    fn check_variables(&self, cursor: &mut Cursor) -> Checked {
        for (i, record) in self.variables.iter().enumerate() {
            self.check_texts(record, cursor, ["name of a variable", "unit of a variable"])?;
            let name = self.two_texts(record).0;
            let earlier = self.variables.iter().take(i).any(|other| self.two_texts(other).0 == name);
            ensure(!earlier, OpenError::Text("name of a variable"))?;
            ensure(self.low(i) <= self.high(i), OpenError::Range)?;
            cursor.numbers += 2;
        }
        Ok(())
    }

    fn check_points(&self, cursor: &mut Cursor) -> Checked {
        for (i, record) in self.points.iter().enumerate() {
            self.check_texts(record, cursor, ["name of a point", "unit of a point"])?;
            let name = self.two_texts(record).0;
            let earlier = self.points.iter().take(i).any(|other| self.two_texts(other).0 == name);
            ensure(!earlier, OpenError::Text("name of a point"))?;
            ensure(self.half_width(i) >= 0.0, OpenError::Number("half width of a point"))?;
            cursor.numbers += 1;
        }
        Ok(())
    }

    fn check_limits(&self, cursor: &mut Cursor) -> Checked {
        // The points of a limit are read here; the place of the list is checked together with the others.
        for record in self.limits {
            let (start, length) = (u32_at(record, 0), u16_at(record, 4));
            cursor.text(start, length)?;
            check_name(self.slice_of_text(start, length)?, false).map_err(|()| OpenError::Text("name of a limit"))?;
            ensure(record[7] == 0 && u16_at(record, 14) == 0, OpenError::Reserved)?;
            cursor.numbers += 1;
        }
        Ok(())
    }

    fn check_limit_indices(&self, cursor: &mut Cursor) -> Checked {
        for record in self.limits {
            let count = u16_at(record, 12);
            cursor.indices(u32_at(record, 8), count)?;
            let list = Indices(part(self.indices, u32_at(record, 8), count));
            let unit = |point: usize| self.point(point).map(|p| p.unit);
            let (counts, points) = match record[6] {
                0 => (1..=1, list.iter().take(1)),
                1 => (2..=2, list.iter().take(1)),
                2 => (2..=2, list.iter().take(2)),
                3 => (2..=MAX_POINTS, list.iter().take(MAX_POINTS)),
                _ => return Err(OpenError::Index("kind of limit")),
            };
            ensure(counts.contains(&count), OpenError::Count("points of a limit"))?;
            self.distinct_points(points.clone())?;
            let first = unit(list.at(0));
            let mut same = points.map(unit).all(|unit| unit == first);
            if record[6] == 1 {
                let variable = self.variable(list.at(1)).ok_or(OpenError::Index("variable"))?;
                same &= Some(variable.unit) == first;
            }
            ensure(same, OpenError::Inconsistent("a limit compares values in different units"))?;
        }
        Ok(())
    }

    /// Polynomials, centre sets and bases; returns the surrogate with its scaling.
    fn check_models(mut self, cursor: &mut Cursor) -> Result<Self, OpenError> {
        let variables = self.variables.len();
        let mut seen = PointSet::default();
        for record in self.polynomials {
            let (terms, rows) = (u16_at(record, 8), u16_at(record, 10));
            within(terms, 0, MAX_TERMS, "terms")?;
            within(rows, 1, self.points.len(), "points of a polynomial")?;
            ensure(u16_at(record, 14) == 0, OpenError::Reserved)?;
            let bytes = variables.div_ceil(2);
            cursor.exponents(u32_at(record, 16), terms * bytes)?;
            cursor.indices(u32_at(record, 20), rows)?;
            cursor.numbers(u32_at(record, 24), rows * terms)?;
            self.use_transforms(part(record, 0, MAX_VARIABLES))?;
            let polynomial = self.polynomial(record);
            ensure(polynomial.exponents.len() == terms * bytes, OpenError::Length)?;
            ensure(polynomial.coefficients.len() == rows * terms, OpenError::Length)?;
            let mut degree = 0;
            for term in polynomial.exponents.chunks_exact(bytes) {
                let total = term.iter().map(|pair| usize::from(pair & 15) + usize::from(pair >> 4)).sum();
                ensure(total <= MAX_DEGREE, OpenError::Degree)?;
                let unpaired = variables % 2 == 1 && term.last().is_some_and(|pair| pair >> 4 != 0);
                ensure(!unpaired, OpenError::Reserved)?;
                degree = degree.max(total);
            }
            ensure(polynomial.degree == degree, OpenError::Degree)?;
            self.check_members(polynomial.points, rows, &mut seen)?;
        }
        ensure((0..self.points.len()).all(|p| seen.holds(p)), OpenError::Inconsistent("a point is in no polynomial"))?;
        for record in self.sets {
            let count = u16_at(record, 8);
            within(count, 1, MAX_CENTRES, "centres")?;
            ensure(u16_at(record, 10) == 0, OpenError::Reserved)?;
            cursor.numbers(u32_at(record, 12), variables * count)?;
            self.use_transforms(part(record, 0, MAX_VARIABLES))?;
        }
        let mut seen = PointSet::default();
        for record in self.bases {
            let (set, rows) = (u16_at(record, 2), u16_at(record, 4));
            ensure(Kernel::from_code(record[0]).is_some(), OpenError::Kernel)?;
            ensure(record[1] == 0 && u16_at(record, 6) == 0, OpenError::Reserved)?;
            ensure(set < self.sets.len(), OpenError::Index("centre set"))?;
            within(rows, 1, self.points.len(), "points of a basis")?;
            let basis = self.basis(record);
            cursor.indices(u32_at(record, 8), rows)?;
            cursor.numbers(u32_at(record, 12), variables + rows * basis.count)?;
            ensure(basis.centres.len() == variables * basis.count, OpenError::Length)?;
            ensure(basis.scales.len() == variables && basis.weights.len() == rows * basis.count, OpenError::Length)?;
            ensure(basis.scales.iter().all(|s| s >= 0.0), OpenError::Number("length scale"))?;
            self.check_members(basis.points, rows, &mut seen)?;
        }
        self.check_limit_indices(cursor)?;
        Ok(self)
    }

    fn check_provenance(&self, cursor: &mut Cursor) -> Checked {
        for record in self.provenance {
            let (start, key, value) = (u32_at(record, 0), u16_at(record, 4), u16_at(record, 6));
            cursor.text(start, key + value)?;
            check_name(self.slice_of_text(start, key)?, false).map_err(|()| OpenError::Text("key of the provenance"))?;
            self.slice_of_text(start + key, value)?;
        }
        Ok(())
    }

    fn check_self_tests(&self) -> Checked {
        let (variables, points) = (self.variables.len(), self.points.len());
        let start = self.numbers.len() - self.self_tests * (variables + points);
        let (mut x, mut values) = ([0.0; MAX_VARIABLES], [0.0; MAX_POINTS]);
        let (Some(x), Some(values)) = (x.get_mut(..variables), values.get_mut(..points)) else { return Err(OpenError::Length) };
        for vector in 0..self.self_tests {
            let at = start + vector * (variables + points);
            x.iter_mut().zip(self.numbers.part(at, variables).iter()).for_each(|(x, n)| *x = n);
            ensure(self.in_ranges(x), OpenError::Number("condition of a self-test"))?;
            self.evaluate(x, values).map_err(|_| OpenError::Length)?;
            for (point, (value, expected)) in values.iter().zip(self.numbers.part(at + variables, points).iter()).enumerate() {
                let close = (value - expected).abs() <= SELF_TEST_TOLERANCE * expected.abs().max(1.0);
                ensure(close, OpenError::SelfTest { vector, point })?;
            }
            self.check_bands(vector, x, values)?;
        }
        Ok(())
    }

    /// Checks a name and a unit, which follow each other and the text before.
    fn check_texts(&self, record: &[u8; SMALL_RECORD], cursor: &mut Cursor, [name, unit]: [&'static str; 2]) -> Checked {
        let (start, first, second) = (u32_at(record, 0), u16_at(record, 4), u16_at(record, 6));
        cursor.text(start, first + second)?;
        check_name(self.slice_of_text(start, first)?, false).map_err(|()| OpenError::Text(name))?;
        check_name(self.slice_of_text(start + first, second)?, true).map_err(|()| OpenError::Text(unit))
    }

    fn slice_of_text(&self, start: usize, length: usize) -> Result<&'a str, OpenError> {
        start.checked_add(length).and_then(|end| self.text.get(start..end)).ok_or(OpenError::Place("texts"))
    }

    fn check_members(&self, members: Indices<'_>, rows: usize, seen: &mut PointSet) -> Checked {
        ensure(members.iter().len() == rows, OpenError::Length)?;
        for point in members.iter() {
            ensure(point < self.points.len() && seen.insert(point), OpenError::Index("point"))?;
        }
        Ok(())
    }

    fn distinct_points(&self, points: impl Iterator<Item = usize>) -> Checked {
        let mut seen = PointSet::default();
        for point in points {
            ensure(point < self.points.len() && seen.insert(point), OpenError::Index("point"))?;
        }
        Ok(())
    }
}

/// Cuts the file into its sections by the counts in its header; all numbers are finite afterwards.
fn sections(bytes: &[u8]) -> Result<Surrogate<'_>, OpenError> {
    ensure(bytes.starts_with(&MAGIC), OpenError::NotASurrogate)?;
    ensure(bytes.len() >= HEADER + TRAILER, OpenError::Length)?;
    let version = u16_at(bytes, 8);
    ensure((usize::from(OLDEST_VERSION)..=usize::from(VERSION)).contains(&version), OpenError::Version(version as u16))?;
    ensure(u32_at(bytes, 12) == bytes.len(), OpenError::Length)?;
    let body = part(bytes, 0, bytes.len() - TRAILER);
    ensure(u32_at(bytes, body.len()) == crc32(body) as usize, OpenError::Checksum)?;

    let [variables, points, polynomials, sets, bases, limits, provenance, self_tests] =
        [10, 16, 18, 20, 22, 24, 26, 28].map(|at| u16_at(bytes, at));
    within(variables, 1, MAX_VARIABLES, "variables")?;
    within(points, 1, MAX_POINTS, "points")?;
    within(polynomials, 1, points, "polynomials")?;
    within(bases, 0, points, "bases")?;
    within(sets, 0, bases, "centre sets")?;
    within(limits, 0, MAX_LIMITS, "limits")?;
    within(provenance, 0, MAX_PROVENANCE, "provenance entries")?;
    within(self_tests, 1, MAX_SELF_TESTS, "self-tests")?;
    let further = u16_at(bytes, 30);
    ensure(further == 0 || version > 1, OpenError::Reserved)?;
    within(further, 0, MAX_SECTIONS, "further sections")?;

    let mut rest = part(body, HEADER, body.len() - HEADER);
    let variables = records(&mut rest, variables)?;
    let points = records(&mut rest, points)?;
    let limits = records(&mut rest, limits)?;
    let polynomials = records(&mut rest, polynomials)?;
    let sets = records(&mut rest, sets)?;
    let bases = records(&mut rest, bases)?;
    let provenance = records(&mut rest, provenance)?;
    // Numbers start at a multiple of eight, for readers that map the file.
    let gap = (body.len() - rest.len()).wrapping_neg() % 8;
    let padding: &[[u8; 1]] = records(&mut rest, gap)?;
    ensure(padding.iter().all(|b| b[0] == 0), OpenError::Reserved)?;
    let numbers = Numbers(records(&mut rest, u32_at(bytes, 32))?);
    let indices = records(&mut rest, u32_at(bytes, 36))?;
    let (exponents, rest) = rest.split_at_checked(u32_at(bytes, 40)).ok_or(OpenError::Length)?;
    let (text, rest) = rest.split_at_checked(u32_at(bytes, 44)).ok_or(OpenError::Length)?;
    let text = core::str::from_utf8(text).map_err(|_| OpenError::Text("text"))?;
    let further = Further::cut(rest, body.len(), further, variables.len(), points.len())?;
    ensure(numbers.iter().all(f64::is_finite), OpenError::Number("number"))?;
    let scaling = [[None; MAX_VARIABLES]; 3];
    Ok(Surrogate {
        variables,
        points,
        limits,
        polynomials,
        sets,
        bases,
        provenance,
        numbers,
        indices,
        exponents,
        text,
        version,
        self_tests,
        held: further.held,
        held_text: further.held_text,
        uncertainty: further.uncertainty,
        corners: further.corners,
        readings: further.readings,
        followed: further.followed,
        mesh: further.mesh,
        in_time: further.in_time,
        scaling,
    })
}

/// Required places of the next data of each kind. Everything is stored in one order, without gaps or overlaps: a file
/// has exactly one meaning and every byte of it is used.
struct Cursor {
    numbers: usize,
    indices: usize,
    exponents: usize,
    text: usize,
}

impl Cursor {
    fn numbers(&mut self, at: usize, count: usize) -> Checked {
        ensure(at == self.numbers, OpenError::Place("numbers"))?;
        self.numbers += count;
        Ok(())
    }

    fn indices(&mut self, at: usize, count: usize) -> Checked {
        ensure(at == self.indices, OpenError::Place("indices"))?;
        self.indices += count;
        Ok(())
    }

    fn exponents(&mut self, at: usize, count: usize) -> Checked {
        ensure(at == self.exponents, OpenError::Place("exponents"))?;
        self.exponents += count;
        Ok(())
    }

    fn text(&mut self, at: usize, length: usize) -> Checked {
        ensure(at == self.text, OpenError::Place("texts"))?;
        self.text += length;
        Ok(())
    }
}

/// A set of point indices.
#[derive(Default)]
struct PointSet([u64; MAX_POINTS / 64]);

impl PointSet {
    /// Adds a point; false if the set contains it already, or cannot hold it.
    fn insert(&mut self, point: usize) -> bool {
        let Some(word) = self.0.get_mut(point / 64) else { return false };
        let fresh = *word & (1 << (point % 64)) == 0;
        *word |= 1 << (point % 64);
        fresh
    }

    fn holds(&self, point: usize) -> bool {
        self.0.get(point / 64).is_some_and(|word| word & (1 << (point % 64)) != 0)
    }
}
