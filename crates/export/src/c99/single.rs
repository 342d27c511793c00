//! C source in single precision, for processors without double precision: its error, and the changes of the text.

use coldplate_runtime::{Band, Kernel, Surrogate, Transform};

use super::pair::PairedBasis;
use crate::ExportError;
use crate::content::{Content, Point, Scaling, SelfTest};

/// Number of conditions at which values are compared, beside the corners of the ranges (count). Chosen: time of the
/// export against the chance to miss the largest error; that error is doubled.
const CONDITIONS: usize = 4000;
/// Number of terms or centres summed in one block (count): equal to the block of the runtime and of the C source, for
/// equal rounding.
const BLOCK: usize = 128;
/// Error of a value, in its unit, above which the bases are computed in pairs of numbers. Chosen: far below the
/// accuracy of sensors; pairs cost time.
const PLAIN: f64 = 1e-4;
/// Largest allowed error of a value as a share of the half width of its band (dimensionless). Chosen: small beside the
/// band.
const SHARE: f64 = 0.1;
/// Error of a value that is always allowed, in its unit. Chosen: small beside the accuracy of sensors.
const LEAST: f64 = 0.01;
/// Number of conditions added to the self-test (count), at which arithmetic that loses digits is furthest off. Chosen:
/// size of the source against the chance to notice such arithmetic.
const TESTS: usize = 16;

/// Error of a surrogate in single precision, and the measures that keep it small.
pub(super) struct Single {
    /// Largest error of each point's value inside the fitted range, in its unit: twice the largest difference found.
    pub(super) errors: Vec<f64>,
    /// Whether the bases are computed in pairs of numbers, because their terms cancel.
    pub(super) is_paired: bool,
    /// Self-tests in addition to those of the file.
    pub(super) tests: Vec<SelfTest>,
}

/// A condition, and the values of all points there in double precision.
type Case = (Vec<f64>, Vec<f64>);

impl Single {
    /// # Errors
    /// A number is too large for single precision, or a value would be off by more than is allowed.
    pub(super) fn of(surrogate: &Surrogate<'_>, content: &Content) -> Result<Self, ExportError> {
        let too_large = || ExportError::Single("numbers of this surrogate are too large for it".into());
        let cases = conditions(content).map(|x| {
            let mut exact = vec![0.0; content.points.len()];
            surrogate.evaluate(&x, &mut exact).ok()?;
            Some((x, exact))
        });
        let cases: Vec<Case> = cases.collect::<Option<_>>().ok_or_else(too_large)?;
        let plain = apart(content, &[], &cases).ok_or_else(too_large)?;
        let mut found = None;
        if !content.bases.is_empty() && largest(&plain) > PLAIN {
            let bases: Vec<_> = content.bases.iter().map(|own| PairedBasis::new(own, &content.scalings)).collect();
            // Pairs do not help if the digits are lost in the polynomials or by the size of the values.
            found = apart(content, &bases, &cases).filter(|paired| largest(paired) < 0.5 * largest(&plain));
        }
        let is_paired = found.is_some();
        let errors = twice_the_largest(content, found.as_ref().unwrap_or(&plain));
        refuse_if_too_far(content, &errors)?;
        let tests = furthest(&plain).into_iter().map(|case| self_test(surrogate, &cases[case])).collect();
        Ok(Self { errors, is_paired, tests })
    }
}

/// Error of each point, case by case; `None` if one is no finite number.
fn apart(content: &Content, paired: &[PairedBasis<'_>], cases: &[Case]) -> Option<Vec<Vec<f64>>> {
    let case = |(x, exact): &Case| {
        let found = values(content, paired, x);
        let apart: Vec<f64> = exact.iter().zip(found).map(|(exact, found)| (exact - f64::from(found)).abs()).collect();
        apart.iter().all(|apart| apart.is_finite()).then_some(apart)
    };
    cases.iter().map(case).collect()
}

/// Largest error as stated to the user: twice the largest difference.
fn largest(apart: &[Vec<f64>]) -> f64 {
    2.0 * apart.iter().flatten().copied().fold(0.0, f64::max)
}

fn twice_the_largest(content: &Content, apart: &[Vec<f64>]) -> Vec<f64> {
    (0..content.points.len()).map(|point| 2.0 * apart.iter().map(|case| case[point]).fold(0.0, f64::max)).collect()
}

fn refuse_if_too_far(content: &Content, errors: &[f64]) -> Result<(), ExportError> {
    let allowed = |point: &Point| LEAST.max(SHARE * point.half_width);
    let all = content.points.iter().zip(errors).map(|(point, error)| (point, *error, allowed(point)));
    let Some((point, error, allowed)) = all.max_by(|a, b| (a.1 / a.2).total_cmp(&(b.1 / b.2))).filter(|own| own.1 > own.2) else {
        return Ok(());
    };
    let (name, unit) = (&point.name, unit_of_errors(&point.unit));
    Err(ExportError::Single(format!("the value of '{name}' would be off by up to {error:.2} {unit}, and {allowed:.2} {unit} are allowed")))
}

/// Unit of an error: differences of temperatures are in kelvins.
pub(super) fn unit_of_errors(unit: &str) -> &str {
    if unit == "degC" { "K" } else { unit }
}

/// The cases with the largest error of any point.
fn furthest(apart: &[Vec<f64>]) -> Vec<usize> {
    let most: Vec<f64> = apart.iter().map(|case| case.iter().copied().fold(0.0, f64::max)).collect();
    let mut places: Vec<usize> = (0..most.len()).collect();
    places.sort_by(|a, b| most[*b].total_cmp(&most[*a]));
    places.truncate(TESTS);
    places
}

fn self_test(surrogate: &Surrogate<'_>, (x, exact): &Case) -> SelfTest {
    let (mut values, mut bands) = (exact.clone(), vec![Band::default(); exact.len()]);
    let deviations = match surrogate.bands(x, None, &mut values, &mut bands) {
        Ok(()) => bands.iter().map(|band| band.total).collect(),
        Err(_) => Vec::new(),
    };
    SelfTest { condition: x.clone(), values, deviations }
}

/// The corners of the ranges, and conditions that fill the ranges evenly.
fn conditions(content: &Content) -> impl Iterator<Item = Vec<f64>> + '_ {
    let variables = &content.variables;
    let corners = (0..1_usize << variables.len())
        .map(move |corner| variables.iter().enumerate().map(|(v, own)| if corner >> v & 1 == 0 { own.low } else { own.high }).collect());
    // Low-discrepancy sequence: multiples of the powers of the root of x^(n+1) = x + 1 fill n directions evenly.
    let root = (0..60).fold(2.0_f64, |root, _| (1.0 + root).powf(1.0 / (variables.len() + 1) as f64));
    let inside = (1..=CONDITIONS).map(move |k| {
        let share = |v: usize| (k as f64 * root.powi(-(v as i32 + 1))).fract();
        variables.iter().enumerate().map(|(v, own)| own.low + share(v) * (own.high - own.low)).collect()
    });
    corners.chain(inside)
}

/// The values of all points in the arithmetic of the C source; `paired` holds the bases in pairs, if there are any.
fn values(content: &Content, paired: &[PairedBasis<'_>], x: &[f64]) -> Vec<f32> {
    let u: Vec<f32> = content.scalings.iter().map(|own| scaled(own, x)).collect();
    let picked = |places: &[usize]| places.iter().map(|place| u[*place]).collect::<Vec<f32>>();
    let mut values = vec![0.0; content.points.len()];
    let mut add = |factors: &[f32], table: &[f64], points: &[usize]| {
        for (factors, table) in factors.chunks(BLOCK).zip(table.chunks(BLOCK * points.len().max(1))) {
            for (column, point) in points.iter().enumerate() {
                let entries = table.iter().skip(column).step_by(points.len());
                values[*point] += factors.iter().zip(entries).fold(0.0, |sum, (factor, entry)| sum + factor * *entry as f32);
            }
        }
    };
    for own in &content.polynomials {
        add(&monomials(&picked(&own.scalings), &own.exponents), &own.coefficients, &own.points);
    }
    for own in content.bases.iter().filter(|_| paired.is_empty()) {
        let u = picked(&own.scalings);
        let kernels: Vec<f32> = own.centres.chunks(u.len()).map(|centre| kernel(own.kernel, square(&u, centre, &own.scales))).collect();
        add(&kernels, &own.weights, &own.points);
    }
    for own in paired {
        own.add(x, &mut values);
    }
    if let Some((own, known)) = content.uncertainty.as_ref().and_then(|own| Some((own, own.known.as_ref()?))) {
        let monomials = monomials(&picked(&own.scalings), &own.exponents);
        let (shifts, means) = (own.shifts(known), own.missed_means(known));
        for (point, value) in values.iter_mut().enumerate() {
            let row = shifts.iter().skip(point * own.terms);
            *value += monomials.iter().zip(row).fold(0.0, |sum, (term, shift)| sum + term * *shift as f32) + means[point] as f32;
        }
    }
    values
}

fn scaled(own: &Scaling, x: &[f64]) -> f32 {
    let x = x[own.variable] as f32;
    let g = match own.transform {
        Transform::Identity => x,
        Transform::Reciprocal => 1.0 / x,
        Transform::Log => x.ln(),
    };
    (g - own.low as f32) * own.factor as f32 + own.offset as f32
}

/// Values of the monomials; the variables enter in pairs.
fn monomials(u: &[f32], exponents: &[u8]) -> Vec<f32> {
    let power = |u: f32, exponent: u8| (0..exponent).fold(1.0, |power, _| power * u);
    let pair = |(u, e): (&[f32], &[u8])| u.iter().zip(e).fold(1.0, |product, (u, e)| product * power(*u, *e));
    exponents.chunks(u.len()).map(|term| u.chunks(2).zip(term.chunks(2)).map(pair).product()).collect()
}

fn square(u: &[f32], centre: &[f64], scales: &[f64]) -> f32 {
    let distances = u.iter().zip(centre.iter().zip(scales)).map(|(u, (centre, scale))| (u - *centre as f32) * *scale as f32);
    distances.fold(0.0, |sum, d| sum + d * d)
}

fn kernel(kernel: Kernel, square: f32) -> f32 {
    match kernel {
        Kernel::ThinPlate => {
            let normal = square.max(f32::MIN_POSITIVE);
            0.5 * square * normal.ln()
        }
        Kernel::Cubic => square * square.sqrt(),
        Kernel::Multiquadric => (1.0 + square).sqrt(),
        Kernel::Gaussian => (-square).exp(),
    }
}

/// Converts C in double precision to single precision: types, numbers and functions. Comments and texts stay.
pub(super) fn narrowed(text: &str) -> String {
    let mut narrow = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if first == '"' {
            rest[1..].find('"').map_or(rest.len(), |end| end + 2)
        } else if first.is_ascii_alphanumeric() || first == '_' {
            token(rest)
        } else {
            first.len_utf8()
        };
        let (piece, after) = rest.split_at(length);
        match piece {
            "double" => narrow.push_str("float"),
            "HUGE_VAL" => narrow.push_str("HUGE_VALF"),
            "fabs" | "fma" | "frexp" | "ldexp" | "log" | "nearbyint" | "sqrt" => {
                narrow.push_str(piece);
                narrow.push('f');
            }
            _ if first.is_ascii_digit() && piece.contains(['.', 'e']) => {
                narrow.push_str(&piece.parse::<f32>().map_or_else(|_| piece.to_owned(), |value| format!("{value:?}F")));
            }
            _ => narrow.push_str(piece),
        }
        rest = after;
    }
    narrow
}

/// Length in bytes of the identifier or number at the beginning of a text; a number includes the sign behind its `e`.
fn token(text: &str) -> usize {
    let is_number = text.starts_with(|c: char| c.is_ascii_digit());
    let mut before = ' ';
    for (place, c) in text.char_indices() {
        let is_sign = is_number && matches!(before, 'e' | 'E') && matches!(c, '+' | '-');
        if !(c.is_ascii_alphanumeric() || c == '_' || is_number && c == '.' || is_sign) {
            return place;
        }
        before = c;
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::narrowed;

    #[test]
    fn types_numbers_and_functions_become_narrow_and_nothing_else() {
        let wide = "/* a double of 0.1 */\nextern \"C\" static double x[2] = {0.1, -2.5e-7}; y2_double = sqrt(12 + 3U) - HUGE_VAL;\n";
        let narrow = "/* a double of 0.1 */\nextern \"C\" static float x[2] = {0.1F, -2.5e-7F}; y2_double = sqrtf(12 + 3U) - HUGE_VALF;\n";
        assert_eq!(narrowed(wide), narrow);
    }
}
