//! Surrogate files: written from and read into [`SurrogateSpec`]. `docs/reference/surrogate-format.md` states the
//! byte layout; `coldplate-runtime` is its reader, and every file written here is opened by it first.

use std::collections::BTreeMap;
use std::path::Path;

use coldplate_runtime as runtime;
use runtime::format;

use super::corners;
use super::followed::section as section_of_followed;
use super::in_time::section as section_of_time;
use super::model::{
    HeldSpec, LimitKind, LimitSpec, PointModel, PointSpec, PolynomialSpec, RbfBasis, SurrogateSpec, Transform, UncertaintySpec,
    VariableSpec,
};
use coldplate_base::atomic_file;
use coldplate_base::error::{Error, Result};

/// Number of self-test conditions between the ends of the ranges, beside the centre and both ends. Chosen: more find
/// more faults of a reader, each lengthens the file.
const INNER_SELF_TESTS: usize = 5;

/// The bytes of a surrogate file.
///
/// # Errors
/// Content beyond the format (too many variables, points, terms or centres; numbers that are not
/// finite; names that are empty or there twice; a limit that mixes units), as bad input. A model
/// so ill-conditioned that the runtime does not reproduce it, as failed numerics.
pub fn encode(surrogate: &SurrogateSpec) -> Result<Vec<u8>> {
    check(surrogate)?;
    let layout = Layout::of(surrogate)?;
    let mut bytes = layout.bytes(surrogate, &[])?;
    if surrogate.in_time.is_some() {
        bytes = layout.bytes(surrogate, &section_of_time::tests(&bytes, surrogate)?)?;
    }
    match runtime::Surrogate::open(&bytes) {
        Ok(_) => Ok(bytes),
        Err(runtime::OpenError::SelfTest { point, .. }) => Err(Error::numerics(format!(
            "the model of '{}' cannot be evaluated to {:e} of its value in double precision",
            surrogate.points[point].name,
            format::SELF_TEST_TOLERANCE
        ))
        .help("its coefficients cancel each other; fit with fewer terms or more smoothing")),
        Err(reason) => Err(Error::input(format!("this surrogate cannot be written to a file: {reason}"))),
    }
}

/// Writes a surrogate file, under a temporary name first, so that no reader meets half a file.
///
/// # Errors
/// Errors of [`encode`]; a file that cannot be written.
pub fn write(surrogate: &SurrogateSpec, path: &Path) -> Result<()> {
    let bytes = encode(surrogate).map_err(|e| e.in_file(path))?;
    atomic_file::write(path, &bytes)
}

/// Reads a surrogate file back into its data. Terms with the coefficient zero are left out.
///
/// # Errors
/// Bytes that are not an intact surrogate file.
pub fn decode(bytes: &[u8]) -> Result<SurrogateSpec> {
    let file = open(bytes)?;
    let variables = file.variable_count();
    let mut tails: Vec<Option<PolynomialSpec>> = vec![None; file.point_count()];
    for block in file.polynomials() {
        let transforms: Vec<Transform> = (0..variables).map(|v| block.transform(v)).collect();
        for (column, point) in block.points.iter().enumerate() {
            let exponents = |term| (0..variables).map(|v| block.exponent(term, v)).collect::<Vec<u8>>();
            let used = (0..block.terms).map(|term| (term, block.coefficient(term, column))).filter(|(_, c)| *c != 0.0);
            let (terms, coefficients) = used.map(|(term, c)| (exponents(term), c)).unzip();
            tails[point] = Some(PolynomialSpec { transforms: transforms.clone(), terms, coefficients });
        }
    }
    let mut radial: Vec<Option<(usize, Vec<f64>)>> = vec![None; file.point_count()];
    let mut bases = Vec::new();
    for (index, basis) in file.bases().enumerate() {
        let centre = |c: usize| (0..variables).map(|v| basis.coordinate(c, v)).collect();
        for (column, point) in basis.points.iter().enumerate() {
            radial[point] = Some((index, (0..basis.count).map(|centre| basis.weight(centre, column)).collect()));
        }
        bases.push(RbfBasis {
            kernel: basis.kernel,
            transforms: (0..variables).map(|v| basis.transform(v)).collect(),
            scales: basis.scales.iter().collect(),
            centres: (0..basis.count).map(centre).collect(),
        });
    }
    let points = file.points().zip(tails.into_iter().flatten().zip(radial)).map(|(point, (tail, radial))| PointSpec {
        name: point.name.to_owned(),
        unit: point.unit.to_owned(),
        model: match radial {
            Some((basis, weights)) => PointModel::Rbf { basis, weights, tail },
            None => PointModel::Polynomial(tail),
        },
        half_width: point.half_width,
    });
    let limits = file.limits().filter_map(|limit| {
        let kind = limit.kind.renumbered(Some, Some)?;
        Some(LimitSpec { name: limit.name.to_owned(), kind, maximum: limit.maximum })
    });
    let variables = file.variables().map(|v| VariableSpec { name: v.name.to_owned(), unit: v.unit.to_owned(), low: v.low, high: v.high });
    let counts = [file.variable_count(), file.point_count(), file.held().count(), file.limits().count()];
    Ok(SurrogateSpec {
        variables: variables.collect(),
        held: file.held().map(|h| HeldSpec { name: h.name.to_owned(), unit: h.unit.to_owned(), value: h.value }).collect(),
        bases,
        points: points.collect(),
        mesh: (0..file.point_count()).map_while(|point| file.mesh_half_width(point)).collect(),
        limits: limits.collect(),
        uncertainty: file.uncertainty().map(|own| UncertaintySpec::of(&own)),
        followed: section_of_followed::read(file.followed(), counts)?,
        in_time: section_of_time::read(&file),
        empty_corners: file.empty_corners().collect(),
        readings: file.readings().to_vec(),
        provenance: file.provenance().map(|(key, value)| (key.to_owned(), value.to_owned())).collect(),
    })
}

/// Opens a surrogate file that lies in memory, with this crate's error.
///
/// # Errors
/// Bytes that are not an intact surrogate file.
pub fn open(bytes: &[u8]) -> Result<runtime::Surrogate<'_>> {
    runtime::Surrogate::open(bytes).map_err(|reason| {
        Error::input(format!("no usable surrogate file: {reason}")).help("write it anew with `coldplate fit` or `coldplate run`")
    })
}

/// The polynomial part of a model.
fn polynomial(model: &PointModel) -> &PolynomialSpec {
    match model {
        PointModel::Polynomial(polynomial) | PointModel::Rbf { tail: polynomial, .. } => polynomial,
    }
}

/// Checks the assumptions of the layout: bounds, and tables whose sizes agree.
fn check(surrogate: &SurrogateSpec) -> Result<()> {
    let variables = surrogate.variables.len();
    let bounds = [
        ("variables", variables, format::MAX_VARIABLES),
        ("points", surrogate.points.len(), format::MAX_POINTS),
        ("limits", surrogate.limits.len(), format::MAX_LIMITS),
        ("provenance entries", surrogate.provenance.len(), format::MAX_PROVENANCE),
        ("held variables", surrogate.held.len(), format::MAX_HELD),
    ];
    for (what, count, most) in bounds {
        if count > most {
            return Err(Error::input(format!("a surrogate file holds at most {most} {what}")).read(count));
        }
    }
    for variable in &surrogate.variables {
        if !(variable.low.is_finite() && variable.high.is_finite() && variable.low <= variable.high) {
            let range = format!("{} to {}", variable.low, variable.high);
            return Err(Error::input("the fitted range of a variable is not a range").at_key(&variable.name).read(range));
        }
    }
    for basis in &surrogate.bases {
        let sound = basis.transforms.len() == variables
            && basis.scales.len() == variables
            && basis.centres.iter().all(|c| c.len() == variables)
            && (1..=format::MAX_CENTRES).contains(&basis.centres.len());
        if !sound {
            return Err(Error::input(format!("a radial basis has no centres, more than {}, or rows of wrong length", format::MAX_CENTRES)));
        }
    }
    let transforms = surrogate.bases.iter().map(|b| &b.transforms).chain(surrogate.points.iter().map(|p| &polynomial(&p.model).transforms));
    for (variable, transform) in transforms.flat_map(|t| surrogate.variables.iter().zip(t)) {
        if !transform.is_allowed(variable.low, variable.high) && variable.low < variable.high {
            let range = format!("{} to {}", variable.low, variable.high);
            return Err(Error::input(format!("the transform {transform:?} is illegal on this range")).at_key(&variable.name).read(range));
        }
    }
    for point in &surrogate.points {
        if !(point.half_width.is_finite() && point.half_width >= 0.0) {
            return Err(Error::input("the half width of a band is not a size").at_key(&point.name).read(point.half_width));
        }
        let wrong = |what: String| Err(Error::input(what).at_key(&point.name));
        let polynomial = polynomial(&point.model);
        if polynomial.transforms.len() != variables || polynomial.terms.iter().any(|t| t.len() != variables) {
            return wrong("a polynomial has terms or transforms for another number of variables".into());
        }
        if polynomial.terms.len() != polynomial.coefficients.len() {
            return wrong("a polynomial has not one coefficient per term".into());
        }
        if polynomial.terms.len() > format::MAX_TERMS {
            return wrong(format!("a polynomial of a surrogate file has at most {} terms", format::MAX_TERMS));
        }
        if polynomial.terms.iter().any(|t| t.iter().map(|e| usize::from(*e)).sum::<usize>() > format::MAX_DEGREE) {
            return wrong(format!("a term of a surrogate file has at most the total degree {}", format::MAX_DEGREE));
        }
        if let PointModel::Rbf { basis, weights, .. } = &point.model
            && surrogate.bases.get(*basis).is_none_or(|b| b.centres.len() != weights.len())
        {
            return wrong("a radial model has not one weight per centre of its basis".into());
        }
    }
    for limit in &surrogate.limits {
        let (count, variable) = (surrogate.points.len(), limit.kind.variable().unwrap_or(0));
        if limit.kind.points().any(|p| p >= count) || variable >= variables {
            return Err(Error::input("a limit names a point or variable that does not exist").at_key(&limit.name));
        }
    }
    Ok(())
}

/// Points whose polynomials share their transforms, over the union of their terms.
struct Block {
    transforms: Vec<u8>,
    terms: Vec<Vec<u8>>,
    place: BTreeMap<Vec<u8>, usize>,
    points: Vec<usize>,
}

/// The surrogate in the order of the file.
struct Layout {
    blocks: Vec<Block>,
    /// Transforms and centres, shared by bases that differ in kernel or scales only.
    sets: Vec<(Vec<u8>, Vec<Vec<f64>>)>,
    /// Model basis, its set, and its points; bases that no point uses are left out.
    bases: Vec<(usize, usize, Vec<usize>)>,
}

impl Layout {
    fn of(surrogate: &SurrogateSpec) -> Result<Self> {
        // The transform of a fixed variable makes no difference; the file wants it plain.
        let codes = |transforms: &[Transform]| -> Vec<u8> {
            surrogate.variables.iter().zip(transforms).map(|(v, t)| if v.low == v.high { 0 } else { *t as u8 }).collect()
        };
        let (mut blocks, mut sets, mut bases) = (Vec::<Block>::new(), Vec::new(), Vec::<(usize, usize, Vec<usize>)>::new());
        for (index, point) in surrogate.points.iter().enumerate() {
            let polynomial = polynomial(&point.model);
            let transforms = codes(&polynomial.transforms);
            let fits = |block: &Block| {
                let fresh = polynomial.terms.iter().filter(|t| !block.place.contains_key(*t)).count();
                block.transforms == transforms && block.terms.len() + fresh <= format::MAX_TERMS
            };
            let at = blocks.iter().position(fits).unwrap_or_else(|| {
                let (terms, place, points) = (Vec::new(), BTreeMap::new(), Vec::new());
                blocks.push(Block { transforms, terms, place, points });
                blocks.len() - 1
            });
            let block = &mut blocks[at];
            block.points.push(index);
            let mut own = std::collections::BTreeSet::new();
            for term in &polynomial.terms {
                if !own.insert(term) {
                    return Err(Error::input("a polynomial has the same term twice").at_key(&point.name).read(format!("{term:?}")));
                }
                let Block { terms, place, .. } = block;
                place.entry(term.clone()).or_insert_with(|| {
                    terms.push(term.clone());
                    terms.len() - 1
                });
            }
            let PointModel::Rbf { basis, .. } = &point.model else { continue };
            if let Some((.., points)) = bases.iter_mut().find(|(model, ..)| model == basis) {
                points.push(index);
                continue;
            }
            let RbfBasis { transforms, centres, .. } = &surrogate.bases[*basis];
            let set = (codes(transforms), centres.clone());
            let at = sets.iter().position(|s| *s == set).unwrap_or_else(|| {
                sets.push(set);
                sets.len() - 1
            });
            bases.push((*basis, at, vec![index]));
        }
        // Bases in the order of the model, so that reading a file back gives the indices that were written.
        bases.sort_by_key(|(model, ..)| *model);
        Ok(Self { blocks, sets, bases })
    }

    /// Bytes of the file; `steps` are steps over time that readers must reproduce.
    fn bytes(&self, surrogate: &SurrogateSpec, steps: &[Vec<f64>]) -> Result<Vec<u8>> {
        let (mut body, variables) = (Body::default(), &surrogate.variables);
        body.numbers.extend(variables.iter().flat_map(|v| [v.low, v.high]));
        body.numbers.extend(surrogate.points.iter().map(|p| p.half_width));
        body.numbers.extend(surrogate.limits.iter().map(|l| l.maximum));
        for (name, unit) in variables.iter().map(|v| (&v.name, &v.unit)).chain(surrogate.points.iter().map(|p| (&p.name, &p.unit))) {
            body.texts(name, unit)?;
        }
        let limits_at = body.records.len();
        body.limits(&surrogate.limits)?;
        self.polynomials(surrogate, &mut body)?;
        self.radial(surrogate, &mut body)?;
        body.indices_of_limits(&surrogate.limits, limits_at)?;
        for (key, value) in &surrogate.provenance {
            body.texts(key, value)?;
        }
        let tests = self_tests(variables);
        for x in &tests {
            body.numbers.extend(x);
            for point in 0..surrogate.points.len() {
                body.numbers.push(super::evaluate(surrogate, point, x)?);
            }
        }

        let Body { mut records, numbers, indices, exponents, text } = body;
        let before_numbers = (format::HEADER + records.len()).next_multiple_of(8);
        records.resize(before_numbers - format::HEADER, 0);
        let before_sections = before_numbers + 8 * numbers.len() + indices.len() + exponents.len() + text.len();
        let (sections, count) = sections(surrogate, &tests, steps, before_sections)?;
        let length = before_sections + sections.len() + format::TRAILER;
        let mut bytes = Vec::with_capacity(length);
        bytes.extend(format::MAGIC);
        u16s(&mut bytes, &[usize::from(format::VERSION), variables.len()])?;
        u32s(&mut bytes, &[length])?;
        let (points, limits, provenance) = (surrogate.points.len(), surrogate.limits.len(), surrogate.provenance.len());
        u16s(&mut bytes, &[points, self.blocks.len(), self.sets.len(), self.bases.len(), limits, provenance, tests.len(), count])?;
        u32s(&mut bytes, &[numbers.len(), indices.len() / 2, exponents.len(), text.len()])?;
        bytes.extend(records);
        bytes.extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
        bytes.extend(indices);
        bytes.extend(exponents);
        bytes.extend(text.as_bytes());
        bytes.extend(sections);
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        Ok(bytes)
    }

    /// Records and tables of the polynomials, block by block.
    fn polynomials(&self, surrogate: &SurrogateSpec, body: &mut Body) -> Result<()> {
        for block in &self.blocks {
            let (terms, rows) = (block.terms.len(), block.points.len());
            let degree = block.terms.iter().map(|t| t.iter().map(|e| usize::from(*e)).sum()).max().unwrap_or(0);
            body.transforms(&block.transforms);
            u16s(&mut body.records, &[terms, rows, degree, 0])?;
            u32s(&mut body.records, &[body.exponents.len(), body.indices.len() / 2, body.numbers.len()])?;
            let pairs = block.terms.iter().flat_map(|t| t.chunks(2));
            body.exponents.extend(pairs.map(|pair| pair[0] | pair.get(1).map_or(0, |odd| odd << 4)));
            u16s(&mut body.indices, &block.points)?;
            let mut table = vec![0.0; terms * rows];
            for (column, point) in block.points.iter().enumerate() {
                let PolynomialSpec { terms, coefficients, .. } = polynomial(&surrogate.points[*point].model);
                for (term, coefficient) in terms.iter().zip(coefficients) {
                    table[block.place[term] * rows + column] = *coefficient;
                }
            }
            body.numbers.extend(table);
        }
        Ok(())
    }

    /// Records and tables of the sets of centres, then those of the radial bases.
    fn radial(&self, surrogate: &SurrogateSpec, body: &mut Body) -> Result<()> {
        for (transforms, centres) in &self.sets {
            body.transforms(transforms);
            u16s(&mut body.records, &[centres.len(), 0])?;
            u32s(&mut body.records, &[body.numbers.len()])?;
            for v in 0..surrogate.variables.len() {
                body.numbers.extend(centres.iter().map(|c| c[v]));
            }
        }
        for (model, set, points) in &self.bases {
            let basis = &surrogate.bases[*model];
            body.records.extend([basis.kernel as u8, 0]);
            u16s(&mut body.records, &[*set, points.len(), 0])?;
            u32s(&mut body.records, &[body.indices.len() / 2, body.numbers.len()])?;
            u16s(&mut body.indices, points)?;
            body.numbers.extend(&basis.scales);
            for centre in 0..basis.centres.len() {
                body.numbers.extend(points.iter().filter_map(|p| match &surrogate.points[*p].model {
                    PointModel::Rbf { weights, .. } => weights.get(centre),
                    PointModel::Polynomial(_) => None,
                }));
            }
        }
        Ok(())
    }
}

/// Further sections of a file, to lie behind `before` bytes of it, and their number; `tests` are the conditions of the self-test.
fn sections(surrogate: &SurrogateSpec, tests: &[Vec<f64>], steps: &[Vec<f64>], before: usize) -> Result<(Vec<u8>, usize)> {
    let (mut sections, mut count) = (Vec::new(), 0);
    let mut add = |tag, content: Vec<u8>| {
        count += 1;
        section(&mut sections, before, tag, &content)
    };
    if !surrogate.empty_corners.is_empty() {
        add(format::CORNERS, corners::section(&surrogate.empty_corners))?;
    }
    if !surrogate.held.is_empty() {
        add(format::HELD, held(&surrogate.held)?)?;
    }
    if let Some(uncertainty) = &surrogate.uncertainty {
        add(format::UNCERTAIN, uncertainty.section(surrogate, tests)?)?;
    }
    if let Some(followed) = &surrogate.followed {
        add(format::FOLLOWED, section_of_followed::content(followed, surrogate)?)?;
    }
    if !surrogate.mesh.is_empty() {
        add(format::MESH, surrogate.mesh.iter().flat_map(|half| half.to_le_bytes()).collect())?;
    }
    if !surrogate.readings.is_empty() {
        add(format::READINGS, surrogate.readings.concat())?;
    }
    if let Some(in_time) = &surrogate.in_time {
        add(format::IN_TIME, section_of_time::content(in_time, surrogate, steps)?)?;
    }
    Ok((sections, count))
}

/// Appends a further section, to lie behind `before` bytes of the file.
fn section(sections: &mut Vec<u8>, before: usize, tag: [u8; 4], content: &[u8]) -> Result<()> {
    sections.resize((before + sections.len()).next_multiple_of(8) - before, 0);
    sections.extend(tag);
    u32s(sections, &[content.len()])?;
    sections.extend(content);
    Ok(())
}

/// The content of the section of held variables.
fn held(held: &[HeldSpec]) -> Result<Vec<u8>> {
    let mut content = Vec::new();
    u32s(&mut content, &[held.len(), 0])?;
    let mut text = String::new();
    for HeldSpec { name, unit, value } in held {
        content.extend(value.to_le_bytes());
        u32s(&mut content, &[text.len()])?;
        u16s(&mut content, &[name.len(), unit.len()]).map_err(|e| e.at_key(name.chars().take(40).collect::<String>()))?;
        text.push_str(name);
        text.push_str(unit);
    }
    content.extend(text.as_bytes());
    Ok(content)
}

/// Conditions that the runtime must reproduce before it trusts itself: centre, ends, and points between of a sequence
/// of irrational steps.
fn self_tests(variables: &[VariableSpec]) -> Vec<Vec<f64>> {
    let at = |fraction: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let inside = |(i, v): (usize, &VariableSpec)| (v.low + fraction(i) * (v.high - v.low)).clamp(v.low, v.high);
        variables.iter().enumerate().map(inside).collect()
    };
    let mut tests = vec![at(&|_| 0.5), at(&|_| 0.0), at(&|_| 1.0)];
    for n in 1..=INNER_SELF_TESTS {
        tests.push(at(&|i| (n as f64 * ((i + 2) as f64).sqrt()).fract()));
    }
    tests
}

/// Records of a file, and the pools that they point into.
#[derive(Default)]
struct Body {
    records: Vec<u8>,
    numbers: Vec<f64>,
    indices: Vec<u8>,
    exponents: Vec<u8>,
    text: String,
}

impl Body {
    /// A record of two texts that follow each other.
    fn texts(&mut self, first: &str, second: &str) -> Result<()> {
        u32s(&mut self.records, &[self.text.len()])?;
        u16s(&mut self.records, &[first.len(), second.len()]).map_err(|e| e.at_key(first.chars().take(40).collect::<String>()))?;
        self.text.push_str(first);
        self.text.push_str(second);
        Ok(())
    }

    fn transforms(&mut self, transforms: &[u8]) {
        self.records.extend(transforms.iter().copied().chain(std::iter::repeat(0)).take(format::MAX_VARIABLES));
    }

    /// Records of the limits, without the place of their indices.
    fn limits(&mut self, limits: &[LimitSpec]) -> Result<()> {
        for limit in limits {
            u32s(&mut self.records, &[self.text.len()])?;
            u16s(&mut self.records, &[limit.name.len()])?;
            self.text.push_str(&limit.name);
            let (kind, count) = match &limit.kind {
                LimitKind::Maximum { .. } => (0, 1),
                LimitKind::Rise { .. } => (1, 2),
                LimitKind::Difference { .. } => (2, 2),
                LimitKind::Spread(points) => (3, points.len()),
            };
            self.records.extend([kind, 0]);
            u32s(&mut self.records, &[0])?;
            u16s(&mut self.records, &[count, 0])?;
        }
        Ok(())
    }

    /// Indices of the limits, which lie behind those of the models, and their place in the records, the first of which is at `at`.
    fn indices_of_limits(&mut self, limits: &[LimitSpec], at: usize) -> Result<()> {
        for (i, limit) in limits.iter().enumerate() {
            let mut place = Vec::new();
            u32s(&mut place, &[self.indices.len() / 2])?;
            let at = at + i * format::MEDIUM_RECORD + 8;
            self.records[at..at + 4].copy_from_slice(&place);
            u16s(&mut self.indices, &limit.kind.points().collect::<Vec<_>>())?;
            if let Some(variable) = limit.kind.variable() {
                u16s(&mut self.indices, &[variable])?;
            }
        }
        Ok(())
    }
}

fn u16s(bytes: &mut Vec<u8>, values: &[usize]) -> Result<()> {
    for value in values {
        bytes.extend(u16::try_from(*value).map_err(|_| too_much(*value))?.to_le_bytes());
    }
    Ok(())
}

fn u32s(bytes: &mut Vec<u8>, values: &[usize]) -> Result<()> {
    for value in values {
        bytes.extend(u32::try_from(*value).map_err(|_| too_much(*value))?.to_le_bytes());
    }
    Ok(())
}

fn too_much(value: usize) -> Error {
    Error::input("a text or table is too long for a surrogate file").read(value)
}
