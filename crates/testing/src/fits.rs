//! Functions to fit, designs to fit them on, and a generator with a fixed sequence.

use std::f64::consts::PI;

use coldplate_surrogate::fit::{self, FitOutput, FitSamples};

/// Ranges of the variables of the functions.
pub const CUBE: [(f64, f64); 4] = [(-1.0, 1.0); 4];

/// xorshift64* (Vigna 2016).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    /// Uniform on [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Standard normal (Box-Muller).
    pub fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (2.0 * PI * self.uniform()).cos()
    }

    fn shuffled(&mut self, n: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..n).collect();
        for i in (1..n).rev() {
            order.swap(i, (self.uniform() * (i + 1) as f64) as usize);
        }
        order
    }
}

/// Rows uniform in the unit cube.
pub fn uniform(n: usize, d: usize, random: &mut Random) -> Vec<Vec<f64>> {
    (0..n).map(|_| (0..d).map(|_| random.uniform()).collect()).collect()
}

/// The Latin hypercube, of thirty random ones, whose nearest two points are farthest apart.
pub fn latin(n: usize, d: usize, random: &mut Random) -> Vec<Vec<f64>> {
    let mut best = (0.0, Vec::new());
    for _ in 0..30 {
        let columns: Vec<Vec<usize>> = (0..d).map(|_| random.shuffled(n)).collect();
        let rows: Vec<Vec<f64>> = (0..n).map(|i| columns.iter().map(|c| (c[i] as f64 + random.uniform()) / n as f64).collect()).collect();
        let distance = |i: usize, j: usize| rows[i].iter().zip(&rows[j]).map(|(a, b): (&f64, &f64)| (a - b).powi(2)).sum::<f64>();
        let nearest = (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| distance(i, j)).fold(f64::INFINITY, f64::min);
        if nearest > best.0 {
            best = (nearest, rows);
        }
    }
    best.1
}

/// From the unit cube to ranges.
pub fn stretched(rows: Vec<Vec<f64>>, ranges: &[(f64, f64)]) -> Vec<Vec<f64>> {
    rows.into_iter().map(|row| row.iter().zip(ranges).map(|(x, (low, high))| low + x * (high - low)).collect()).collect()
}

/// A function of a condition.
pub type Function<'a> = &'a dyn Fn(&[f64]) -> f64;

/// Samples of `functions` on `rows`, with the given variable ranges.
pub fn samples(rows: Vec<Vec<f64>>, ranges: &[(f64, f64)], functions: &[Function<'_>]) -> FitSamples {
    let outputs = functions
        .iter()
        .enumerate()
        .map(|(k, f)| FitOutput { name: format!("y{k}"), unit: "degC".into(), values: rows.iter().map(|x| f(x)).collect() })
        .collect();
    let names: Vec<String> = (0..ranges.len()).map(|k| format!("x{k}")).collect();
    let named: Vec<(&str, &str)> = names.iter().map(|n| (n.as_str(), "1")).collect();
    let mut samples = FitSamples::with_measured_ranges(&named, rows, outputs);
    for (variable, (low, high)) in samples.variables.iter_mut().zip(ranges) {
        (variable.low, variable.high) = (*low, *high);
    }
    samples
}

/// Flow in m3/s, coolant temperature in degC, speed in r/min, ambient temperature in degC: the ranges of the 4-D design.
pub const MACHINE_RANGES: [(f64, f64); 4] = [(3.925e-5, 3.14e-4), (18.0, 24.0), (250.0, 2500.0), (18.0, 24.0)];

/// Kinematic viscosity of water in m2/s, 10 to 40 degC: Vogel's form of the dynamic viscosity over 998 kg/m3.
fn viscosity(celsius: f64) -> f64 {
    2.414e-5 * 10f64.powf(247.8 / (celsius + 133.15)) / 998.0
}

/// Film coefficient in W/m2K of turbulent flow in a round pipe of 9.4 mm, Gnielinski (1976) with Petukhov's friction factor.
fn film(flow: f64, celsius: f64) -> f64 {
    let d = 9.4e-3;
    let reynolds = 4.0 * flow / (PI * d * viscosity(celsius));
    let prandtl = viscosity(celsius) / 1.43e-7;
    let f = (0.79 * reynolds.ln() - 1.64).powi(-2);
    let nusselt = f / 8.0 * (reynolds - 1000.0) * prandtl / (1.0 + 12.7 * (f / 8.0).sqrt() * (prandtl.powf(2.0 / 3.0) - 1.0));
    nusselt * 0.6 / d
}

/// Temperature in degC of a part that turns `loss` watts per r/min into heat, which leaves through a resistance
/// `resistance` K/W and a film of `area` m2 into the coolant (at its mean temperature), and by radiation of `emitting` m2
/// of black surface into the surroundings.
pub fn machine(x: &[f64], loss: f64, resistance: f64, area: f64, emitting: f64) -> f64 {
    let (flow, coolant, speed, ambient) = (x[0], x[1], x[2], x[3]);
    let heat = loss * speed * (1.0 + 4e-5 * speed);
    let path = 1.0 / (2.0 * 998.0 * 4182.0 * flow) + resistance + 1.0 / (film(flow, coolant) * area);
    let radiated = |t: f64| 5.670374419e-8 * emitting * ((t + 273.15).powi(4) - (ambient + 273.15).powi(4));
    let mut t = coolant;
    for _ in 0..50 {
        let slope = 1.0 + path * 4.0 * 5.670374419e-8 * emitting * (t + 273.15).powi(3);
        t -= (t - coolant - path * (heat - radiated(t))) / slope;
    }
    t
}

/// On [-1, 1]^4: wavy in the first two variables, mild in the others. Rough for 200 points in four dimensions.
pub fn rough(u: &[f64]) -> f64 {
    (3.0 * u[0]).sin() * (2.0 * u[1]).cos()
        + 0.5 * (2.5 * u[0] * u[1] + 0.8 * u[2]).sin()
        + 0.4 * (u[2] - 0.5 * u[3]).tanh()
        + (-2.0 * (u[0] - 0.3).powi(2) - 2.0 * (u[1] + 0.2).powi(2)).exp()
}

/// On [-1, 1]^4: with a ridge, not smooth.
pub fn ridge(u: &[f64]) -> f64 {
    (u[0] + 0.5 * u[1]).abs() + 0.3 * u[2] * u[3]
}

/// Ranges of the variables of [`borehole`].
pub const BOREHOLE_RANGES: [(f64, f64); 8] = [
    (0.05, 0.15),
    (100.0, 50_000.0),
    (63_070.0, 115_600.0),
    (990.0, 1110.0),
    (63.1, 116.0),
    (700.0, 820.0),
    (1120.0, 1680.0),
    (9855.0, 12_045.0),
];

/// Flow through a borehole (Harper and Gupta 1983): smooth, so that Gaussians want long scales and large weights.
pub fn borehole(x: &[f64]) -> f64 {
    let (radius, influence, upper, upper_head, lower, lower_head, length, conductivity) = (x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7]);
    let log = (influence / radius).ln();
    2.0 * PI * upper * (upper_head - lower_head)
        / (log * (1.0 + 2.0 * length * upper / (log * radius * radius * conductivity) + upper / lower))
}

/// Ranges of the variables of [`ishigami`].
pub const ISHIGAMI_RANGES: [(f64, f64); 3] = [(-PI, PI); 3];

/// Function of Ishigami and Homma (1990): smooth, but no polynomial of degree 6.
pub fn ishigami(x: &[f64]) -> f64 {
    x[0].sin() + 7.0 * x[1].sin().powi(2) + 0.1 * x[2].powi(4) * x[0].sin()
}

/// Ranges of the variables of [`piston`].
pub const PISTON_RANGES: [(f64, f64); 7] =
    [(30.0, 60.0), (0.005, 0.02), (0.002, 0.01), (1000.0, 5000.0), (90_000.0, 110_000.0), (290.0, 296.0), (340.0, 360.0)];

/// Time of a piston's cycle in s (Kenett and Zacks 1998).
pub fn piston(x: &[f64]) -> f64 {
    let (mass, area, volume, spring, pressure, ambient, filling) = (x[0], x[1], x[2], x[3], x[4], x[5], x[6]);
    let force = pressure * area + 19.62 * mass - spring * volume / area;
    let gas = pressure * volume / filling * ambient;
    let settled = area / (2.0 * spring) * ((force * force + 4.0 * spring * gas).sqrt() - force);
    2.0 * PI * (mass / (spring + area * area * gas / (settled * settled))).sqrt()
}

/// Predicted minus true values of a point.
pub fn errors(fit: &fit::SurrogateFit, point: usize, rows: &[Vec<f64>], f: &dyn Fn(&[f64]) -> f64) -> Vec<f64> {
    rows.iter().map(|x| fit::evaluate(&fit.surrogate, point, x).unwrap() - f(x)).collect()
}
