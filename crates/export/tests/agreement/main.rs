//! Every target beside the runtime: the same files, the same conditions, the same answers.

mod accessible;
mod browser;
mod c99;
mod c99_single;
mod cancelling;
mod ecos;
mod examples;
mod fmu;
mod html;
mod in_time;
mod json;
mod linked;
mod misra;
mod modelica;
mod octave;
mod onnx;
mod over_time;
mod st;
mod st_compiled;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use coldplate_export::{Target, export};
use coldplate_runtime::{Band, Surrogate};

/// The surrogates that are exported: those of the runtime, and two that it has no example of: with knowledge from readings, and
/// without limits, with a logarithm and two kinds of model.
pub fn fixtures() -> Vec<(String, Vec<u8>)> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    for folder in [own.join("../runtime/fixtures"), own.join("tests/fixtures")] {
        for entry in std::fs::read_dir(&folder).expect("the folder of the fixtures is there") {
            let path = entry.expect("the folder can be read").path();
            let name = path.file_stem().expect("a file has a name").to_string_lossy().into_owned();
            files.push((name, std::fs::read(&path).expect("the fixtures can be read")));
        }
    }
    files.push(("hostile".into(), hostile(&own.join("../runtime/fixtures/uncertain.cps"))));
    files.sort();
    assert!(files.len() >= 13, "{}", files.len());
    files
}

/// A file whose names end comments, texts and tags in one language or another, and begin things.
fn hostile(path: &Path) -> Vec<u8> {
    let names = "motordegCscrew nutdegCmotor maximummotor over ambientmotor over screw".as_bytes();
    let others = r##"*/"\'degC<b>%(*s${degC'); x["] = 1\</script><img x=1>??/ ' || "" #{x}"##.replace("\\\\", "\\");
    let mut bytes = std::fs::read(path).expect("the fixtures can be read");
    let place = bytes.windows(names.len()).position(|window| window == names).expect("the names are there");
    bytes[place..place + names.len()].copy_from_slice(others.as_bytes());
    let end = bytes.len() - 4;
    let sum = coldplate_runtime::format::crc32(&bytes[..end]);
    bytes[end..].copy_from_slice(&sum.to_le_bytes());
    bytes
}

/// SplitMix64.
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / 2.0_f64.powi(53)
    }
}

/// Conditions: every corner, then inside and, one in four, up to half a range outside (where a range is positive, no lower than
/// half its low end, so that reciprocals and logarithms stay numbers).
pub fn conditions(surrogate: &Surrogate<'_>, count: usize) -> Vec<Vec<f64>> {
    let variables: Vec<_> = surrogate.variables().collect();
    let corners = (0..1_usize << variables.len())
        .map(|corner| variables.iter().enumerate().map(|(v, own)| if corner >> v & 1 == 0 { own.low } else { own.high }).collect());
    let mut random = Random(7);
    let mut all: Vec<Vec<f64>> = corners.collect();
    while all.len() < count {
        let is_outside = all.len().is_multiple_of(4);
        let at = |own: &coldplate_runtime::Variable<'_>, random: &mut Random| {
            let share = if is_outside { 2.0 * random.unit() - 0.5 } else { random.unit() };
            let value = own.low + share * (own.high - own.low);
            if own.low > 0.0 { value.max(0.5 * own.low) } else { value }
        };
        all.push(variables.iter().map(|own| at(own, &mut random)).collect());
    }
    all
}

/// Everything the runtime says at a condition, in the order in which the programs under test print it.
pub fn answers(surrogate: &Surrogate<'_>, x: &[f64]) -> Vec<f64> {
    let points = surrogate.point_count();
    let mut values = vec![0.0; points];
    let mut bands = vec![Band::default(); points];
    let mut all = vec![f64::from(u8::from(surrogate.in_domain(x)))];
    surrogate.evaluate(x, &mut values).expect("the shapes fit");
    all.extend(&values);
    let mut gradient = vec![0.0; x.len()];
    for point in 0..points {
        surrogate.gradient(x, point, &mut gradient).expect("the shapes fit");
        all.extend(&gradient);
    }
    let number = |binding: Option<usize>| binding.map_or(-1.0, |index| index as f64);
    for confidence in [0.95, 0.8] {
        let chance = surrogate.assess(x, None, confidence, &mut values, &mut bands).expect("the shapes fit");
        all.extend([f64::from(chance.state as u8), f64::from(u8::from(chance.in_domain)), number(chance.binding), chance.probability]);
    }
    all.extend(&values);
    all.extend(bands.iter().flat_map(|band| [band.fit, band.parameters, band.misses, band.total]));
    let verdict = surrogate.query(x, &mut values).expect("the shapes fit");
    all.extend([
        f64::from(verdict.state as u8),
        f64::from(u8::from(verdict.in_domain)),
        number(verdict.binding),
        verdict.value,
        verdict.margin,
    ]);
    for limit in 0..surrogate.limit_count() {
        let own = surrogate.limit_value(limit, x, &values).expect("the limit exists");
        all.extend([own.value, own.low, own.high, own.maximum, own.margin, f64::from(own.state as u8)]);
        let own = surrogate.limit_chance(limit, x, None, &values).expect("the limit exists");
        all.extend([own.value, own.band.fit, own.band.parameters, own.band.misses, own.band.total, own.probability]);
    }
    all
}

/// Largest difference, relative to the larger of one and the size of the answer; both no number count as equal.
pub fn worst(found: &[f64], expected: &[f64]) -> (f64, usize) {
    assert_eq!(found.len(), expected.len());
    let apart = |(a, b): (&f64, &f64)| {
        if a == b || (a.is_nan() && b.is_nan()) {
            return 0.0;
        }
        let apart = (a - b).abs() / b.abs().max(1.0);
        if apart.is_nan() { f64::INFINITY } else { apart }
    };
    let each = found.iter().zip(expected).map(apart).enumerate();
    each.fold((0.0, 0), |(most, place), (index, apart)| if apart > most { (apart, index) } else { (most, place) })
}

/// A folder of its own for a test, empty.
pub fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("coldplate-export-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder can be made");
    folder
}

/// Says on standard error what was skipped, also where the harness keeps the output of tests to itself.
pub fn skipped(what: &str) {
    // A closed standard error is no reason to fail.
    let _ = writeln!(std::io::stderr(), "skipped: {what}");
}

/// Whether a program can be started.
pub fn is_there(program: impl AsRef<std::ffi::OsStr>) -> bool {
    Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success())
}

/// What the functions of languages without pointers return at a condition: values, four bands per point, four numbers per limit, and the verdict as its
/// number, whether the condition is inside, the binding limit counted from one, and the probability.
pub fn assessment(surrogate: &Surrogate<'_>, x: &[f64]) -> Vec<f64> {
    let points = surrogate.point_count();
    let (mut values, mut bands) = (vec![0.0; points], vec![Band::default(); points]);
    let chance = surrogate.assess(x, None, 0.95, &mut values, &mut bands).expect("the shapes fit");
    let mut all = values.clone();
    all.extend(bands.iter().flat_map(|band| [band.fit, band.parameters, band.misses, band.total]));
    for limit in 0..surrogate.limit_count() {
        let own = surrogate.limit_chance(limit, x, None, &values).expect("the limit exists");
        all.extend([own.value, own.maximum, own.maximum - own.value, own.probability]);
    }
    let binding = chance.binding.map_or(0.0, |index| index as f64 + 1.0);
    all.extend([f64::from(chance.state as u8), f64::from(u8::from(chance.in_domain)), binding, chance.probability]);
    all
}

/// Writes, for every surrogate, the files of a target, NAME.in with conditions and NAME.shape with the number of variables, and
/// `names` with the names; returns these.
pub fn lay_out(folder: &Path, target: Target, count: impl Fn(&str) -> usize) -> Vec<String> {
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).expect("the folder can be written to");
    let mut names = Vec::new();
    for (name, bytes) in fixtures() {
        let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
        let files = export(&surrogate, target, &name).expect("the name is one");
        let name = files[0].name.split('.').next().unwrap_or_default().to_owned();
        for file in files {
            write(&file.name, &file.content);
        }
        let conditions = conditions(&surrogate, count(&name));
        write(&format!("{name}.shape"), surrogate.variable_count().to_string().as_bytes());
        write(&format!("{name}.in"), &conditions.iter().flatten().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>());
        names.push(name);
    }
    write("names", names.join("\n").as_bytes());
    names
}

/// Difference of an answer from the runtime's that docs/how-to/embed.md allows, relative to the larger of one and the answer.
const AGREEMENT: f64 = 1e-12;

/// How answers are compared.
pub struct Terms {
    /// What the runtime says at a condition, in the order of what the program wrote.
    pub answers: fn(&Surrogate<'_>, &[f64]) -> Vec<f64>,
    /// Whether the program adds up in an order of its own, or has a logarithm or exponential of its own: a value may then differ by
    /// the last place of the sum of the sizes of the terms of its bases, which are far larger than it if their weights cancel.
    pub order_is_own: bool,
}

/// What a program wrote to NAME.out for the conditions in NAME.in beside the runtime, for the surrogates of these names.
pub fn compare(folder: &Path, names: &[String], terms: &Terms) {
    let fixtures = fixtures();
    for name in names {
        let (_, bytes) = fixtures.iter().find(|(own, _)| own.replace('-', "_") == *name).expect("it is one of the fixtures");
        let surrogate = Surrogate::open(bytes).expect("the fixtures are intact");
        let numbers = |what: &str| -> Vec<f64> {
            let written = std::fs::read(folder.join(format!("{name}.{what}"))).expect("it was written");
            written.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect()
        };
        let (found, conditions) = (numbers("out"), numbers("in"));
        let conditions: Vec<&[f64]> = conditions.chunks_exact(surrogate.variable_count()).collect();
        let expected: Vec<f64> = conditions.iter().flat_map(|x| (terms.answers)(&surrogate, x)).collect();
        assert_eq!(found.len(), expected.len(), "{name}");
        let (apart, place) = worst(&found, &expected);
        let width = expected.len() / conditions.len();
        println!("{name}: {apart:.1e} at answer {}", place % width);
        for ((x, found), expected) in conditions.iter().zip(found.chunks_exact(width)).zip(expected.chunks_exact(width)) {
            let allowed = AGREEMENT + if terms.order_is_own { f64::EPSILON * cancelling::size(&surrogate, x) } else { 0.0 };
            let (apart, place) = worst(found, expected);
            assert!(apart < allowed, "{name}: {apart:e} at answer {place}, {allowed:e} allowed");
        }
    }
}

/// What targets without probabilities give at a condition: values, half widths of the bands, whether it is inside, and the margin of
/// every limit.
pub fn margins(surrogate: &Surrogate<'_>, x: &[f64]) -> Vec<f64> {
    let points = surrogate.point_count();
    let (mut values, mut bands) = (vec![0.0; points], vec![Band::default(); points]);
    surrogate.assess(x, None, 0.95, &mut values, &mut bands).expect("the shapes fit");
    let mut all = values.clone();
    all.extend(bands.iter().map(|band| band.half_width()));
    all.push(f64::from(u8::from(surrogate.in_domain(x))));
    all.extend((0..surrogate.limit_count()).map(|limit| surrogate.limit_value(limit, x, &values).expect("the limit exists").margin));
    all
}

/// Where programs keep what they can make or fetch again.
pub fn cache() -> Option<PathBuf> {
    let cache = std::env::var_os("XDG_CACHE_HOME").map(PathBuf::from);
    cache.or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cache")))
}

/// A program that `scripts/clients` installs in a folder of its own.
pub fn client(program: &str) -> Option<PathBuf> {
    Some(cache()?.join("coldplate/clients/bin").join(program)).filter(|path| path.exists())
}

/// Whether the Python of `scripts/clients` is there and has this package; says so where it has not.
pub fn python_with(package: &str) -> Option<PathBuf> {
    let python = client("python3").filter(|python| {
        Command::new(python).args(["-c", &format!("import {package}")]).output().is_ok_and(|output| output.status.success())
    });
    if python.is_none() {
        skipped(&format!("{package} is not there: scripts/clients installs it"));
    }
    python
}

/// What the points read after each step of a run: `seconds(k)` at the condition of place k, for all but the first, at which it begins:
/// in the steady state, then at 18 degC everywhere.
pub fn course(surrogate: &Surrogate<'_>, conditions: &[&[f64]], seconds: impl Fn(usize) -> f64) -> Vec<Vec<f64>> {
    let mut all = Vec::new();
    for begin in [surrogate.at_rest(conditions[0]), surrogate.at_temperature(18.0)] {
        let mut state = begin.expect("the file moves");
        for (k, x) in conditions.iter().enumerate().skip(1) {
            let mut values = vec![0.0; surrogate.point_count()];
            surrogate.step(&mut state, seconds(k), x).expect("the numbers are finite");
            surrogate.read(&state, x, &mut values).expect("the shapes fit");
            all.push(values);
        }
    }
    all
}

/// What a program wrote to NAME.course for the conditions in NAME.in beside [`course`], for every surrogate that moves.
pub fn compare_courses(folder: &Path, seconds: impl Fn(usize) -> f64, allowed: f64) {
    let moving: Vec<_> = fixtures().into_iter().filter(|(name, _)| name.ends_with("moving")).collect();
    assert_eq!(moving.len(), 2);
    for (name, bytes) in moving {
        let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
        let numbers = |what: &str| -> Vec<f64> {
            let written = std::fs::read(folder.join(format!("{}.{what}", name.replace('-', "_")))).expect("it was written");
            written.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect()
        };
        let conditions = numbers("in");
        let conditions: Vec<&[f64]> = conditions.chunks_exact(surrogate.variable_count()).collect();
        let found = numbers("course");
        let rows = found.len() / (2 * surrogate.point_count());
        assert!(rows > 20, "{name}: {rows}");
        let expected = course(&surrogate, &conditions[..=rows], &seconds).concat();
        let (apart, place) = worst(&found, &expected);
        println!("{name} over time: {apart:.1e} at answer {place}");
        assert!(apart < allowed, "{name}: {apart:e}");
    }
}

/// Seconds of the steps in which targets other than units are tried: from a cycle of a controller to an hour.
pub fn seconds(k: usize) -> f64 {
    [0.5, 60.0, 900.0, 3600.0, 5.0][k % 5]
}
