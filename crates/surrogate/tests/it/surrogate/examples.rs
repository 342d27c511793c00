//! The surrogates that the tests and the runtime's benchmark use.

use coldplate_surrogate::fit::model::*;

/// SplitMix64: a small generator with a fixed sequence.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound.max(1) as u64) as usize
    }

    /// Uniform in [-1, 1).
    pub fn signed(&mut self) -> f64 {
        (self.next() >> 11) as f64 / 2.0_f64.powi(52) - 1.0
    }
}

pub fn variable(name: &str, unit: &str, low: f64, high: f64) -> VariableSpec {
    VariableSpec { name: name.into(), unit: unit.into(), low, high }
}

pub fn held(name: &str, unit: &str, value: f64) -> HeldSpec {
    HeldSpec { name: name.into(), unit: unit.into(), value }
}

pub fn point(name: &str, model: PointModel, half_width: f64) -> PointSpec {
    PointSpec { name: name.into(), unit: "degC".into(), model, half_width }
}

pub fn limit(name: &str, kind: LimitKind<Vec<usize>>, maximum: f64) -> LimitSpec {
    LimitSpec { name: name.into(), kind, maximum }
}

pub fn polynomial(transforms: &[Transform], terms: &[&[u8]], coefficients: &[f64]) -> PolynomialSpec {
    PolynomialSpec {
        transforms: transforms.to_vec(),
        terms: terms.iter().map(|t| t.to_vec()).collect(),
        coefficients: coefficients.to_vec(),
    }
}

/// The file of the runtime's example: motor and screw over flow, coolant and ambient temperature.
pub fn small() -> SurrogateSpec {
    use Transform::{Identity, Reciprocal};
    let transforms = [Reciprocal, Identity, Identity];
    let motor = polynomial(&transforms, &[&[0, 0, 0], &[1, 0, 0], &[0, 1, 0], &[0, 0, 1], &[1, 1, 0]], &[26.0, -2.5, 4.5, 0.5, 0.125]);
    let screw = polynomial(&transforms, &[&[0, 0, 0], &[1, 0, 0], &[0, 1, 0], &[0, 0, 2]], &[22.5, -0.75, 3.5, 0.25]);
    SurrogateSpec {
        mesh: Vec::new(),
        variables: vec![
            variable("coolant_flow", "L/min", 2.0, 12.0),
            variable("coolant_temperature", "degC", 15.0, 25.0),
            variable("ambient_temperature", "degC", 18.0, 26.0),
        ],
        held: vec![],
        bases: vec![],
        points: vec![point("motor", PointModel::Polynomial(motor), 0.0625), point("screw nut", PointModel::Polynomial(screw), 0.03125)],
        limits: vec![
            limit("motor maximum", LimitKind::Maximum { point: 0 }, 28.0),
            limit("motor over ambient", LimitKind::Rise { point: 0, variable: 2 }, 6.0),
            limit("motor over screw", LimitKind::Difference { first: 0, second: 1 }, 5.0),
            limit("spread", LimitKind::Spread(vec![0, 1]), 5.5),
        ],
        uncertainty: None,
        followed: None,
        in_time: None,
        empty_corners: vec![],
        readings: vec![],
        provenance: vec![("made by".into(), "tests/surrogate/examples.rs".into()), ("noté".into(), String::new())],
    }
}

/// The same with two parameters of the machine that are uncertain, and a model that misses something.
pub fn uncertain() -> SurrogateSpec {
    let parameter = |name: &str, unit: &str, nominal: f64, deviation: f64, scale: Scale, origin: Origin| ParameterSpec {
        name: name.into(),
        unit: unit.into(),
        nominal,
        deviation,
        low: nominal - 3.0 * deviation,
        high: nominal + 3.0 * deviation,
        scale,
        origin,
    };
    let uncertainty = UncertaintySpec {
        parameters: vec![
            parameter("contact.foot.conductance", "W/(m2 K)", 500.0, 50.0, Scale::Reciprocal, Origin::Stated),
            parameter("all heats", "1", 1.0, 0.05, Scale::Linear, Origin::Assumed),
        ],
        transforms: vec![Transform::Reciprocal, Transform::Identity, Transform::Identity],
        terms: vec![vec![0, 0, 0], vec![1, 0, 0], vec![0, 1, 1]],
        slopes: vec![
            vec![vec![-0.75, 0.5], vec![0.125, -0.125], vec![0.0, 0.0625]],
            vec![vec![0.25, 0.375], vec![0.0, -0.0625], vec![0.03125, 0.0]],
        ],
        misses: vec![Miss { own: 0.25, common: 0.125 }, Miss { own: 0.1875, common: 0.125 }],
        growth: 0.5,
        measured: vec![vec![8.0, 20.0, 21.0], vec![4.0, 18.0, 21.0]],
        states: None,
    };
    SurrogateSpec { uncertainty: Some(uncertainty), ..small() }
}

/// The same of which more is known: what is left of two parameters goes together.
pub fn uncertain_together() -> SurrogateSpec {
    let mut surrogate = uncertain();
    if let Some(own) = &mut surrogate.uncertainty {
        let covariance = vec![0.5, -0.25, 0.75, 0.0, 0.125, 1.0, 0.0, 0.0, 0.25, 0.875, 0.0, 0.0, 0.0, 0.0, 1.0];
        own.states = Some(StateDistribution { mean: vec![0.5, -0.25, 0.125, 0.0, 0.25], covariance });
    }
    surrogate
}

/// The same, made at one speed of the motor.
pub fn at_one_speed() -> SurrogateSpec {
    SurrogateSpec { held: vec![held("motor_speed", "rpm", 2500.0)], ..small() }
}

/// All terms up to a total degree.
fn all_terms(variables: usize, degree: u8) -> Vec<Vec<u8>> {
    let mut terms = vec![vec![]];
    for _ in 0..variables {
        let extended = terms.iter().flat_map(|t: &Vec<u8>| {
            let left = degree - t.iter().sum::<u8>();
            (0..=left).map(move |e| t.iter().copied().chain([e]).collect())
        });
        terms = extended.collect();
    }
    terms
}

fn four_variables() -> Vec<VariableSpec> {
    vec![
        variable("coolant_flow", "L/min", 2.0, 12.0),
        variable("coolant_temperature", "degC", 15.0, 25.0),
        variable("motor_speed", "rpm", 100.0, 3000.0),
        variable("ambient_temperature", "degC", 18.0, 26.0),
    ]
}

const FLOW_RECIPROCAL: [Transform; 4] = [Transform::Reciprocal, Transform::Identity, Transform::Identity, Transform::Identity];

fn limits_of_ten() -> Vec<LimitSpec> {
    let mut limits: Vec<LimitSpec> = (0..10).map(|p| limit(&format!("maximum {p}"), LimitKind::Maximum { point: p }, 40.0)).collect();
    limits.push(limit("rise", LimitKind::Rise { point: 0, variable: 3 }, 15.0));
    limits.push(limit("spread", LimitKind::Spread((0..10).collect()), 12.0));
    limits
}

/// Ten points, four variables, every term to degree four: 70 terms.
pub fn ten_polynomials() -> SurrogateSpec {
    let mut random = Random(70);
    let terms = all_terms(4, 4);
    let points = (0..10).map(|p| {
        let coefficients = terms.iter().map(|t| if t.iter().all(|e| *e == 0) { 25.0 } else { random.signed() / 4.0 }).collect();
        let polynomial = PolynomialSpec { transforms: FLOW_RECIPROCAL.to_vec(), terms: terms.clone(), coefficients };
        point(&format!("point {p}"), PointModel::Polynomial(polynomial), 0.01)
    });
    SurrogateSpec {
        mesh: Vec::new(),
        variables: four_variables(),
        held: vec![],
        bases: vec![],
        points: points.collect(),
        limits: limits_of_ten(),
        uncertainty: None,
        followed: None,
        in_time: None,
        empty_corners: vec![],
        readings: vec![],
        provenance: vec![("machine".into(), "none".into())],
    }
}

/// The same with twelve uncertain parameters, whose slopes are quadratic.
pub fn ten_uncertain() -> SurrogateSpec {
    let mut random = Random(12);
    let terms = all_terms(4, 2);
    let parameter = |k: usize| ParameterSpec {
        name: format!("parameter {k}"),
        unit: "1".into(),
        nominal: 1.0,
        deviation: 0.1,
        low: 0.7,
        high: 1.3,
        scale: Scale::Linear,
        origin: Origin::Stated,
    };
    let mut row = || -> Vec<f64> { (0..12).map(|_| random.signed() / 8.0).collect() };
    let uncertainty = UncertaintySpec {
        parameters: (0..12).map(parameter).collect(),
        transforms: FLOW_RECIPROCAL.to_vec(),
        slopes: (0..10).map(|_| terms.iter().map(|_| row()).collect()).collect(),
        terms,
        misses: vec![Miss { own: 0.25, common: 0.125 }; 10],
        growth: 0.5,
        measured: vec![vec![8.0, 20.0, 1500.0, 21.0]],
        states: None,
    };
    SurrogateSpec { uncertainty: Some(uncertainty), ..ten_polynomials() }
}

/// Ten points, four variables, 200 centres, a linear tail; one basis for all points, or one each.
pub fn ten_radial(kernel: Kernel, shared: bool) -> SurrogateSpec {
    let mut random = Random(200);
    let centres: Vec<Vec<f64>> = (0..200).map(|_| (0..4).map(|_| random.signed()).collect()).collect();
    let bases = (0..if shared { 1 } else { 10 }).map(|b| RbfBasis {
        kernel,
        transforms: FLOW_RECIPROCAL.to_vec(),
        scales: vec![1.0, 0.75, 0.5, 0.25 + 0.125 * f64::from(b)],
        centres: centres.clone(),
    });
    let bases = bases.collect();
    let points = (0..10).map(|p| {
        let tail = polynomial(
            &FLOW_RECIPROCAL,
            &[&[0; 4], &[1, 0, 0, 0], &[0, 1, 0, 0], &[0, 0, 1, 0], &[0, 0, 0, 1]],
            &[25.0, 2.0, 4.0, 1.5, 0.5],
        );
        let weights = (0..200).map(|_| random.signed() / 8.0).collect();
        point(&format!("point {p}"), PointModel::Rbf { basis: if shared { 0 } else { p }, weights, tail }, 0.01)
    });
    SurrogateSpec {
        mesh: Vec::new(),
        variables: four_variables(),
        held: vec![],
        bases,
        points: points.collect(),
        limits: limits_of_ten(),
        uncertainty: None,
        followed: None,
        in_time: None,
        empty_corners: vec![],
        readings: vec![],
        provenance: vec![("machine".into(), "none".into())],
    }
}

/// Everything the format knows in a few hundred bytes: two polynomials, two centre sets, three
/// bases of different kernels, every kind of limit, a fixed variable, two held ones.
pub fn mixed() -> SurrogateSpec {
    use Transform::{Identity, Log, Reciprocal};
    let mut random = Random(3);
    let centres = |random: &mut Random, n: usize| -> Vec<Vec<f64>> { (0..n).map(|_| (0..3).map(|_| random.signed()).collect()).collect() };
    let (five, four) = (centres(&mut random, 5), centres(&mut random, 4));
    let basis = |kernel, transforms: [Transform; 3], centres: &Vec<Vec<f64>>| RbfBasis {
        kernel,
        transforms: transforms.to_vec(),
        scales: vec![1.0, 0.5, 0.0],
        centres: centres.clone(),
    };
    let tail = |c: f64| polynomial(&[Identity; 3], &[&[0, 0, 0], &[0, 1, 0]], &[c, 1.5]);
    let mut weights = |n: usize| -> Vec<f64> { (0..n).map(|_| random.signed()).collect() };
    SurrogateSpec {
        mesh: Vec::new(),
        variables: vec![
            variable("coolant_flow", "L/min", 2.0, 12.0),
            variable("feed", "mm/s", 0.0, 100.0),
            variable("ambient_temperature", "degC", 20.0, 20.0),
        ],
        held: vec![held("motor_speed", "rpm", 2500.0), held("läge", "", 3.0)],
        bases: vec![
            basis(Kernel::ThinPlate, [Log, Identity, Identity], &five),
            basis(Kernel::Gaussian, [Log, Identity, Identity], &five),
            basis(Kernel::Cubic, [Reciprocal, Identity, Identity], &four),
        ],
        points: vec![
            point(
                "a",
                PointModel::Polynomial(polynomial(&[Reciprocal, Identity, Identity], &[&[0, 0, 0], &[3, 9, 0]], &[30.0, 0.5])),
                0.05,
            ),
            point("b", PointModel::Rbf { basis: 0, weights: weights(5), tail: tail(25.0) }, 0.1),
            point("c", PointModel::Rbf { basis: 1, weights: weights(5), tail: tail(24.0) }, 0.0),
            point("d", PointModel::Rbf { basis: 2, weights: weights(4), tail: tail(23.0) }, 0.2),
        ],
        limits: vec![
            limit("a", LimitKind::Maximum { point: 0 }, 35.0),
            limit("b over ambient", LimitKind::Rise { point: 1, variable: 2 }, 10.0),
            limit("c minus d", LimitKind::Difference { first: 2, second: 3 }, 4.0),
            limit("spread", LimitKind::Spread(vec![3, 0, 1]), 9.0),
        ],
        uncertainty: None,
        followed: None,
        in_time: None,
        empty_corners: vec![],
        readings: vec![],
        provenance: vec![("program".into(), "coldplate".into())],
    }
}

/// A surrogate of so many points that moves in so many states: rates that a flow makes quicker, between a second and hours.
pub fn moving(points: usize, states: usize) -> SurrogateSpec {
    use Transform::{Identity, Log};
    let mut random = Random(24);
    let mut all = ten_polynomials();
    let models: Vec<PointSpec> = all.points.clone();
    all.points = (0..points).map(|p| PointSpec { name: format!("point {p}"), ..models[p % models.len()].clone() }).collect();
    all.limits = vec![limit("point 0", LimitKind::Maximum { point: 0 }, 60.0)];
    let steady = vec![vec![0, 0, 0, 0], vec![1, 0, 0, 0], vec![0, 0, 1, 0], vec![1, 0, 1, 0], vec![0, 1, 0, 1]];
    let terms = vec![vec![0, 0, 0, 0], vec![1, 0, 0, 0], vec![2, 0, 0, 0], vec![0, 1, 0, 0], vec![3, 0, 0, 0], vec![1, 1, 0, 0]];
    let slow = |k: usize| 10.0_f64.powf(-4.5 + 4.0 * k as f64 / states.max(2) as f64);
    let mut rates: Vec<Vec<f64>> = Vec::new();
    for (t, share) in [1.0, 0.4, 0.1, 0.02, 0.01, 0.01].into_iter().enumerate() {
        let entry = |place: usize, random: &mut Random| {
            let (i, j) = (place / states, place % states);
            let size = slow(i).min(slow(j));
            let coupled = if t == 0 { 0.2 } else { 0.02 };
            if i == j { share * slow(i) } else { coupled * share * size * random.signed() / states as f64 }
        };
        rates.push((0..states * states).map(|place| entry(place, &mut random)).collect());
    }
    let packed = (0..states).flat_map(|i| (0..=i).map(move |j| if i == j { 2.0 } else { 0.1 }));
    all.in_time = Some(InTimeSpec {
        states,
        steady: steady.iter().map(|_| (0..states).map(|_| random.signed()).collect()).collect(),
        steady_terms: SharedTerms { transforms: vec![Log, Identity, Identity, Identity], terms: steady },
        outputs: (0..points).map(|_| (0..terms.len() * states).map(|c| random.signed() / (1 + c / states) as f64).collect()).collect(),
        moving_terms: SharedTerms { transforms: vec![Log, Identity, Identity, Identity], terms },
        rates,
        uniform: [vec![-3.0; states], vec![0.15; states]],
        reach: vec![3.0; states],
        spread: packed.collect(),
        errors: (0..points).map(|p| 0.1 + 0.01 * p as f64).collect(),
    });
    all
}
