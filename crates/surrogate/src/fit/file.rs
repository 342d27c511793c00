//! Surrogate files: written from and read into [`Surrogate`]. `docs/surrogate-format.md` states the
//! byte layout; `coldplate-runtime` is its reader, and every file written here is opened by it first.

use std::collections::BTreeMap;
use std::path::Path;

use coldplate_runtime as runtime;
use runtime::format;

use super::followed::section as section_of_followed;
use super::in_time::section as section_of_time;
use super::model::{Held, Limit, LimitKind, Point, PointModel, Polynomial, RbfBasis, Surrogate, Transform, Uncertainty, Variable};
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
pub fn encode(surrogate: &Surrogate) -> Result<Vec<u8>> {
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
pub fn write(surrogate: &Surrogate, path: &Path) -> Result<()> {
    let bytes = encode(surrogate).map_err(|e| e.in_file(path))?;
    atomic_file::write(path, &bytes)
}

/// Reads a surrogate file back into its data. Terms with the coefficient zero are left out.
///
/// # Errors
/// Bytes that are not an intact surrogate file.
pub fn decode(bytes: &[u8]) -> Result<Surrogate> {
    let file = open(bytes)?;
    let variables = file.variable_count();
    let mut tails: Vec<Option<Polynomial>> = vec![None; file.point_count()];
    for block in file.polynomials() {
        let transforms: Vec<Transform> = (0..variables).map(|v| block.transform(v)).collect();
        for (column, point) in block.points.iter().enumerate() {
            let exponents = |term| (0..variables).map(|v| block.exponent(term, v)).collect::<Vec<u8>>();
            let used = (0..block.terms).map(|term| (term, block.coefficient(term, column))).filter(|(_, c)| *c != 0.0);
            let (terms, coefficients) = used.map(|(term, c)| (exponents(term), c)).unzip();
            tails[point] = Some(Polynomial { transforms: transforms.clone(), terms, coefficients });
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
    let points = file.points().zip(tails.into_iter().flatten().zip(radial)).map(|(point, (tail, radial))| Point {
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
        Some(Limit { name: limit.name.to_owned(), kind, maximum: limit.maximum })
    });
    let variables = file.variables().map(|v| Variable { name: v.name.to_owned(), unit: v.unit.to_owned(), low: v.low, high: v.high });
    let counts = [file.variable_count(), file.point_count(), file.held().count(), file.limits().count()];
    Ok(Surrogate {
        variables: variables.collect(),
        held: file.held().map(|h| Held { name: h.name.to_owned(), unit: h.unit.to_owned(), value: h.value }).collect(),
        bases,
        points: points.collect(),
        limits: limits.collect(),
        uncertainty: file.uncertainty().map(|own| Uncertainty::of(&own)),
        followed: section_of_followed::read(file.followed(), counts)?,
        in_time: section_of_time::read(&file),
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
fn polynomial(model: &PointModel) -> &Polynomial {
    match model {
        PointModel::Polynomial(polynomial) | PointModel::Rbf { tail: polynomial, .. } => polynomial,
    }
}

/// Checks the assumptions of the layout: bounds, and tables whose sizes agree.
fn check(surrogate: &Surrogate) -> Result<()> {
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
    fn of(surrogate: &Surrogate) -> Result<Self> {
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
    fn bytes(&self, surrogate: &Surrogate, steps: &[Vec<f64>]) -> Result<Vec<u8>> {
        let mut pools = Pools::default();
        let mut records = Vec::new();
        let variables = &surrogate.variables;
        pools.numbers.extend(variables.iter().flat_map(|v| [v.low, v.high]));
        pools.numbers.extend(surrogate.points.iter().map(|p| p.half_width));
        pools.numbers.extend(surrogate.limits.iter().map(|l| l.maximum));
        for (name, unit) in variables.iter().map(|v| (&v.name, &v.unit)).chain(surrogate.points.iter().map(|p| (&p.name, &p.unit))) {
            pools.texts(&mut records, name, unit)?;
        }
        let limits_at = records.len();
        for limit in &surrogate.limits {
            u32s(&mut records, &[pools.text.len()])?;
            u16s(&mut records, &[limit.name.len()])?;
            pools.text.push_str(&limit.name);
            let (kind, count) = match &limit.kind {
                LimitKind::Maximum { .. } => (0, 1),
                LimitKind::Rise { .. } => (1, 2),
                LimitKind::Difference { .. } => (2, 2),
                LimitKind::Spread(points) => (3, points.len()),
            };
            records.extend([kind, 0]);
            u32s(&mut records, &[0])?; // place of the indices, which lie behind those of the models
            u16s(&mut records, &[count, 0])?;
        }
        for block in &self.blocks {
            let (terms, rows) = (block.terms.len(), block.points.len());
            let degree = block.terms.iter().map(|t| t.iter().map(|e| usize::from(*e)).sum()).max().unwrap_or(0);
            pools.transforms(&mut records, &block.transforms);
            u16s(&mut records, &[terms, rows, degree, 0])?;
            u32s(&mut records, &[pools.exponents.len(), pools.indices.len() / 2, pools.numbers.len()])?;
            let pairs = block.terms.iter().flat_map(|t| t.chunks(2));
            pools.exponents.extend(pairs.map(|pair| pair[0] | pair.get(1).map_or(0, |odd| odd << 4)));
            u16s(&mut pools.indices, &block.points)?;
            let mut table = vec![0.0; terms * rows];
            for (column, point) in block.points.iter().enumerate() {
                let Polynomial { terms, coefficients, .. } = polynomial(&surrogate.points[*point].model);
                for (term, coefficient) in terms.iter().zip(coefficients) {
                    table[block.place[term] * rows + column] = *coefficient;
                }
            }
            pools.numbers.extend(table);
        }
        for (transforms, centres) in &self.sets {
            pools.transforms(&mut records, transforms);
            u16s(&mut records, &[centres.len(), 0])?;
            u32s(&mut records, &[pools.numbers.len()])?;
            for v in 0..variables.len() {
                pools.numbers.extend(centres.iter().map(|c| c[v]));
            }
        }
        for (model, set, points) in &self.bases {
            let basis = &surrogate.bases[*model];
            records.extend([basis.kernel as u8, 0]);
            u16s(&mut records, &[*set, points.len(), 0])?;
            u32s(&mut records, &[pools.indices.len() / 2, pools.numbers.len()])?;
            u16s(&mut pools.indices, points)?;
            pools.numbers.extend(&basis.scales);
            for centre in 0..basis.centres.len() {
                pools.numbers.extend(points.iter().filter_map(|p| match &surrogate.points[*p].model {
                    PointModel::Rbf { weights, .. } => weights.get(centre),
                    PointModel::Polynomial(_) => None,
                }));
            }
        }
        for (i, limit) in surrogate.limits.iter().enumerate() {
            let mut place = Vec::new();
            u32s(&mut place, &[pools.indices.len() / 2])?;
            let at = limits_at + i * format::MEDIUM_RECORD + 8;
            records[at..at + 4].copy_from_slice(&place);
            u16s(&mut pools.indices, &limit.kind.points().collect::<Vec<_>>())?;
            if let Some(variable) = limit.kind.variable() {
                u16s(&mut pools.indices, &[variable])?;
            }
        }
        for (key, value) in &surrogate.provenance {
            pools.texts(&mut records, key, value)?;
        }
        let tests = self_tests(variables);
        for x in &tests {
            pools.numbers.extend(x);
            for point in 0..surrogate.points.len() {
                pools.numbers.push(super::evaluate(surrogate, point, x)?);
            }
        }

        let before_numbers = (format::HEADER + records.len()).next_multiple_of(8);
        records.resize(before_numbers - format::HEADER, 0);
        let Pools { numbers, indices, exponents, text } = pools;
        let before_sections = before_numbers + 8 * numbers.len() + indices.len() + exponents.len() + text.len();
        let mut sections = Vec::new();
        let mut count = 0;
        if !surrogate.held.is_empty() {
            section(&mut sections, before_sections, format::HELD, &held(&surrogate.held)?)?;
            count += 1;
        }
        if let Some(uncertainty) = &surrogate.uncertainty {
            section(&mut sections, before_sections, format::UNCERTAIN, &uncertainty.section(surrogate, &tests)?)?;
            count += 1;
        }
        if let Some(followed) = &surrogate.followed {
            section(&mut sections, before_sections, format::FOLLOWED, &section_of_followed::content(followed, surrogate)?)?;
            count += 1;
        }
        if let Some(in_time) = &surrogate.in_time {
            section(&mut sections, before_sections, format::IN_TIME, &section_of_time::content(in_time, surrogate, steps)?)?;
            count += 1;
        }
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
fn held(held: &[Held]) -> Result<Vec<u8>> {
    let mut content = Vec::new();
    u32s(&mut content, &[held.len(), 0])?;
    let mut text = String::new();
    for Held { name, unit, value } in held {
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
fn self_tests(variables: &[Variable]) -> Vec<Vec<f64>> {
    let at = |fraction: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let inside = |(i, v): (usize, &Variable)| (v.low + fraction(i) * (v.high - v.low)).clamp(v.low, v.high);
        variables.iter().enumerate().map(inside).collect()
    };
    let mut tests = vec![at(&|_| 0.5), at(&|_| 0.0), at(&|_| 1.0)];
    for n in 1..=INNER_SELF_TESTS {
        tests.push(at(&|i| (n as f64 * ((i + 2) as f64).sqrt()).fract()));
    }
    tests
}

#[derive(Default)]
struct Pools {
    numbers: Vec<f64>,
    indices: Vec<u8>,
    exponents: Vec<u8>,
    text: String,
}

impl Pools {
    /// A record of two texts that follow each other.
    fn texts(&mut self, records: &mut Vec<u8>, first: &str, second: &str) -> Result<()> {
        u32s(records, &[self.text.len()])?;
        u16s(records, &[first.len(), second.len()]).map_err(|e| e.at_key(first.chars().take(40).collect::<String>()))?;
        self.text.push_str(first);
        self.text.push_str(second);
        Ok(())
    }

    fn transforms(&self, records: &mut Vec<u8>, transforms: &[u8]) {
        records.extend(transforms.iter().copied().chain(std::iter::repeat(0)).take(format::MAX_VARIABLES));
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
