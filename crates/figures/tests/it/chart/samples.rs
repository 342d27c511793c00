//! Figures with data like those of a real run, and with data as nasty as they come.

use coldplate_figures::chart::acceptability::{AcceptabilityMap, CellState, MarkedCondition};
use coldplate_figures::chart::balance::{BalanceFigure, HeatPair};
use coldplate_figures::chart::before_after::BeforeAfter;
use coldplate_figures::chart::error_overview::{ErrorOverview, PointErrors};
use coldplate_figures::chart::gains::{GainsFigure, LadderStep};
use coldplate_figures::chart::heat::HeatFigure;
use coldplate_figures::chart::machine::{MachineFigure, Pipe, Probe, SurfacePiece};
use coldplate_figures::chart::measured::{MeasuredFigure, SensorRow};
use coldplate_figures::chart::missing_heat::{IntervalFigure, PlaceInterval};
use coldplate_figures::chart::one_factor::{OneFactorFigure, SampledCurve};
use coldplate_figures::chart::operator_sheet::{FlowCell, FlowTable, OperatorSheet};
use coldplate_figures::chart::panels::{Panel, PanelsFigure};
use coldplate_figures::chart::parity::{ParityFigure, ParityPoint};
use coldplate_figures::chart::ranking::{Ranked, RankingFigure, Standing};
use coldplate_figures::chart::residual_panels::ResidualPanels;
use coldplate_figures::chart::residual_sheet::ResidualSheet;
use coldplate_figures::chart::residuals::ResidualFigure;
use coldplate_figures::chart::sankey::{HeatBand, HeatStation, HeatTotal, SankeyFigure, Stage};
use coldplate_figures::chart::style::Quantity;

/// A deterministic scatter in [-1, 1].
pub fn scatter(k: usize) -> f64 {
    // The mixing step of splitmix64.
    let mut z = (k as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    2.0 * ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64 - 1.0
}

pub fn flow() -> Quantity {
    Quantity::new("coolant_flow", "L/min")
}

pub fn temperature() -> Quantity {
    Quantity::new("temperature", "degC")
}

pub fn fixed() -> Vec<(Quantity, f64)> {
    vec![
        (Quantity::new("coolant_temperature", "degC"), 20.0),
        (Quantity::new("motor_speed", "rpm"), 2500.0),
        (Quantity::new("ambient_temperature", "degC"), 23.5),
    ]
}

pub const POINTS: [&str; 7] =
    ["bearing", "coupling", "motor base", "reducer water-cooling plate", "motor water-cooling plate", "reducer", "motor"];

/// The paper's table 7, flow in 1e-5 m3/s there.
const TABLE_7: [[f64; 4]; 7] = [
    [-3.17843e-5, 0.00117, -0.02727, 25.76486],
    [-2.45494e-5, 0.00177, -0.05388, 23.24022],
    [-4.12138e-5, 0.00382, -0.11774, 24.4957],
    [-5.82275e-5, 0.00486, -0.13735, 21.4901],
    [-2.76009e-5, 0.00259, -0.08168, 20.93482],
    [-5.74011e-5, 0.00498, -0.14447, 25.27424],
    [5.78025e-6, 0.00106, -0.0694, 25.95404],
];

pub fn one_factor() -> OneFactorFigure {
    let curves = TABLE_7.iter().zip(POINTS).enumerate().map(|(p, (c, name))| {
        let f = |q: f64| {
            let x = q / 0.6;
            ((c[0] * x + c[1]) * x + c[2]) * x + c[3]
        };
        let low = 2.355;
        let step = (18.84 - low) / 100.0;
        SampledCurve {
            name: name.into(),
            samples: (0..8).map(|k| low + step * 100.0 / 7.0 * k as f64).map(|q| (q, f(q) + 0.03 * scatter(p * 31 + q as usize))).collect(),
            line: (0..=100).map(|k| low + step * f64::from(k)).map(|q| (q, f(q))).collect(),
            half_width: 0.06,
            half_widths: Vec::new(),
            formula: format!("T = {:+.5e} q³ {:+.5} q² {:+.5} q {:+.5}", c[0] / 0.216, c[1] / 0.36, c[2] / 0.6, c[3]).replace('-', "−"),
        }
    });
    OneFactorFigure {
        title: "Coolant flow and the temperatures of the Y axis".into(),
        x: flow(),
        y: temperature(),
        curves: curves.collect(),
        band_of: "fit".into(),
        fixed: fixed(),
        notes: vec!["q is the coolant flow in L/min. Shaded: the band that covers 95 % of new conditions.".into()],
    }
}

pub const LIMITS: [&str; 4] = [
    "motor shell at most 45 °C",
    "bearing seat, rise over ambient at most 4 K",
    "spread of the lead screw supports at most 2.5 K",
    "coolant outlet at most 30 °C",
];

pub fn map() -> AcceptabilityMap {
    let x_values: Vec<f64> = (0..81).map(|i| 2.4 + 0.2 * f64::from(i)).collect();
    let y_values: Vec<f64> = (0..61).map(|j| 18.0 + 0.2 * f64::from(j)).collect();
    let (mut margin, mut half_width, mut state, mut binding) = (vec![], vec![], vec![], vec![]);
    for y in &y_values {
        for x in &x_values {
            let margins = [
                45.0 - (y + 5.0 + 60.0 / x),
                4.0 - (0.35 * (y - 18.0) + 6.0 / x),
                2.5 - (0.02 * (y - 22.0).powi(2) + 2.2 * (x / 18.0).powi(4) + 0.4),
            ];
            let (b, m) = margins.iter().copied().enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
            let h = 0.15 + 0.02 * (x - 10.0).abs();
            margin.push(m);
            half_width.push(h);
            binding.push(b);
            state.push(if m > h {
                CellState::Acceptable
            } else if m < -h {
                CellState::NotAcceptable
            } else {
                CellState::Uncertain
            });
        }
    }
    AcceptabilityMap {
        title: "Is a condition acceptable? Coolant flow and coolant temperature".into(),
        x: flow(),
        y: Quantity::new("coolant_temperature", "degC"),
        x_values,
        y_values,
        margin,
        margin_unit: "K".into(),
        half_width,
        probability: Vec::new(),
        state,
        binding,
        limits: LIMITS.iter().map(|l| (*l).to_string()).collect(),
        fixed: fixed()[1..].to_vec(),
        here: Some(MarkedCondition { x: 9.42, y: 20.5, label: "working condition 1".into() }),
        notes: vec!["Uncertain: closer to a limit than the surrogate's 95 % band.".into()],
    }
}

pub fn parity() -> ParityFigure {
    let samples = (0..260).map(|k| {
        let reference = 26.0 + 7.0 * scatter(k);
        let held_out = k >= 160;
        ParityPoint { reference, predicted: reference + if held_out { 0.012 } else { 0.006 } * scatter(k + 999), held_out }
    });
    ParityFigure {
        title: "Surrogate over simulation: bearing seat of the motor side".into(),
        quantity: temperature(),
        reference: String::new(),
        samples: samples.collect(),
        half_width: 0.011,
        notes: vec!["MeshedMachine: radial basis functions (thin plate), 160 training runs.".into()],
    }
}

pub fn residuals() -> ResidualFigure {
    let n = 200;
    ResidualFigure {
        title: "Residuals of the fit: bearing seat of the motor side".into(),
        quantity: temperature(),
        variables: vec![
            flow(),
            Quantity::new("coolant_temperature", "degC"),
            Quantity::new("motor_speed", "rpm"),
            Quantity::new("ambient_temperature", "degC"),
        ],
        conditions: (0..n)
            .map(|k| {
                vec![
                    10.0 + 8.0 * scatter(k),
                    21.0 + 3.0 * scatter(k + 1000),
                    1375.0 + 1125.0 * scatter(k + 2000),
                    21.0 + 3.0 * scatter(k + 3000),
                ]
            })
            .collect(),
        predicted: (0..n).map(|k| 26.0 + 6.0 * scatter(k + 5000)).collect(),
        residuals: (0..n).map(|k| 0.008 * scatter(k + 7000) + 0.004 * scatter(k).powi(2)).collect(),
        held_out: (0..n).map(|k| k % 4 == 0).collect(),
        half_width: 0.011,
        notes: vec!["Residual: simulated minus predicted, leave-one-out for the training conditions.".into()],
    }
}

pub fn errors() -> ErrorOverview {
    ErrorOverview {
        title: "How good the surrogate is, point by point".into(),
        unit: "K".into(),
        points: POINTS
            .iter()
            .enumerate()
            .map(|(k, name)| PointErrors {
                name: (*name).into(),
                leave_one_out: Some(0.002 * (1.5 + scatter(k))),
                k_fold: Some(0.0025 * (1.6 + scatter(k))),
                held_out_max: Some(0.008 * (1.6 + scatter(k + 3))),
                half_width: Some(0.005 * (1.5 + scatter(k + 8))),
            })
            .collect(),
        target: Some(0.02),
        notes: vec!["200 training runs, 200 held-out conditions.".into()],
    }
}

pub fn heat() -> HeatFigure {
    HeatFigure {
        title: "Where the heat goes: Y axis at 2500 rpm".into(),
        sources: vec![
            ("motor Y".into(), 113.7),
            ("reducer Y".into(), 51.2),
            ("rails of the Y axis".into(), 4.17),
            ("lead screw and nut".into(), 1.74),
            ("bearings".into(), 0.518),
            ("warming by the chamber wall".into(), 2.9),
        ],
        sinks: vec![
            ("coolant of the motor plate".into(), 111.0),
            ("coolant of the reducer plate".into(), 48.3),
            ("radiation to the chamber wall".into(), 11.4),
            ("residual gas".into(), 3.528),
        ],
        fixed: fixed(),
        notes: vec![],
    }
}

/// Heat of two sources through two parts into water and wall.
pub fn sankey() -> SankeyFigure {
    let station = |name: &str, stage| HeatStation { name: name.into(), stage };
    let band = |from, to, watts| HeatBand { from, to, watts };
    SankeyFigure {
        title: "The ways of the heat".into(),
        stations: vec![
            station("motor", Stage::Source),
            station("reducer", Stage::Source),
            station("motor housing", Stage::Part),
            station("water-cooling plate", Stage::Part),
            station("coolant", Stage::Sink),
            station("chamber wall", Stage::Sink),
        ],
        bands: vec![band(0, 2, 113.7), band(1, 3, 51.2), band(2, 3, 110.0), band(2, 5, 3.7), band(3, 4, 160.5), band(3, 5, 0.7)],
        total: HeatTotal { made: 164.9, entering: 0.0, leaving: 164.9 },
        fixed: vec![(Quantity::new("motor_speed", "rpm"), 2500.0)],
        notes: Vec::new(),
    }
}

/// A cube with a channel and a sensor.
pub fn machine() -> MachineFigure {
    let face = |d: usize, high: bool| {
        let corner = |a: f64, b: f64| {
            let mut at = [if high { 0.1 } else { 0.0 }; 3];
            (at[(d + 1) % 3], at[(d + 2) % 3]) = (a, b);
            at
        };
        let mut outward = [0.0; 3];
        outward[d] = if high { 1.0 } else { -1.0 };
        SurfacePiece {
            body: 0,
            corners: vec![corner(0.0, 0.0), corner(0.1, 0.0), corner(0.1, 0.1), corner(0.0, 0.1)],
            edges: vec![true; 4],
            outward,
            temperature: 20.0 + 5.0 * d as f64,
        }
    };
    MachineFigure {
        title: "Motor: temperatures".into(),
        quantity: Quantity::new("temperature", "degC"),
        pieces: (0..3).flat_map(|d| [face(d, false), face(d, true)]).collect(),
        pipes: vec![Pipe { name: "plate".into(), path: vec![[0.0, 0.02, 0.02], [0.1, 0.02, 0.02]], bodies: vec![0] }],
        probes: vec![
            Probe { name: "motor shell".into(), at: [0.05, 0.05, 0.1], reading: Some(42.2) },
            Probe { name: "seat of the bearing".into(), at: [0.1, 0.05, 0.05], reading: None },
        ],
        place_name: "proposed".into(),
        ..MachineFigure::default()
    }
}

pub fn measured() -> MeasuredFigure {
    let rows = [
        ("X1 motor water-cooling plate", 20.9, Some(20.7), None),
        ("X1 bearing seat", 22.3, Some(22.9), None),
        ("Y motor water-cooling plate", 20.9, Some(20.6), Some(20.5)),
        ("Y reducer water-cooling plate", 20.9, Some(20.6), Some(20.5)),
        ("Y bearing seat", 26.6, Some(25.4), Some(26.5)),
        ("Z motor water-cooling plate (second entry)", 21.1, None, None),
        ("A bearing connecting plate", 22.4, Some(22.1), None),
    ];
    MeasuredFigure {
        title: "Whole-machine test: predicted beside measured".into(),
        quantity: temperature(),
        sensors: rows
            .iter()
            .map(|(name, measured, predicted, other)| SensorRow {
                name: (*name).into(),
                measured: Some(*measured),
                uncertainty: Some(0.5),
                predicted: *predicted,
                band: Some(0.12),
                other: *other,
            })
            .collect(),
        other_name: "simulation of the paper".into(),
        fixed: vec![
            (flow(), 9.42),
            (Quantity::new("coolant_temperature", "degC"), 20.5),
            (Quantity::new("ambient_temperature", "degC"), 23.5),
        ],
        notes: vec![],
    }
}

pub fn sheet() -> OperatorSheet {
    let speeds = vec![250.0, 750.0, 1250.0, 1750.0, 2500.0];
    let temperatures = vec![18.0, 19.0, 20.0, 21.0, 22.0, 23.0];
    let cells = speeds
        .iter()
        .flat_map(|s| temperatures.iter().map(move |t| (*s, *t)))
        .map(|(s, t)| {
            let need: f64 = 2.0 + s / 400.0 + (t - 17.0f64).powi(2) * s / 5000.0;
            if need < 3.0 {
                FlowCell { text: "any".into(), state: CellState::Acceptable }
            } else if need < 15.0 {
                FlowCell { text: format!("{need:.1}"), state: CellState::Acceptable }
            } else if need < 18.8 {
                FlowCell { text: format!("{need:.1} ?"), state: CellState::Uncertain }
            } else {
                FlowCell { text: "none".into(), state: CellState::NotAcceptable }
            }
        })
        .collect();
    OperatorSheet {
        machine: "Five-axis machine in vacuum".into(),
        subtitle: "Cooling of the Y axis: which conditions are acceptable".into(),
        maps: vec![AcceptabilityMap { title: "Coolant flow and temperature at 2500 rpm".into(), ..map() }],
        table: Some(FlowTable {
            title: "Smallest coolant flow [L/min] whatever the ambient temperature from 18 to 30 °C and torque from 0 to 12 N m".into(),
            row: Quantity::new("motor_speed", "rpm"),
            rows: speeds,
            column: Quantity::new("coolant_temperature", "degC"),
            columns: temperatures,
            cells,
        }),
        limits: vec![
            ("motor shell".into(), "at most 45 °C".into()),
            ("bearing seat".into(), "at most 4 K over ambient".into()),
            ("lead screw supports".into(), "spread at most 2.5 K".into()),
            ("coolant outlet".into(), "at most 30 °C".into()),
        ],
        how_to_read: vec![
            "Green: run. Yellow, thin lines: closer to a limit than the prediction is sure; measure. Red, dense lines: do not run.".into(),
            "The letter in an area names the limit that is reached first there. The table holds for an ambient of 23.5 °C; set at least the flow given.".into(),
        ],
        provenance: "coldplate 0.1.0 · machine five_axis.toml sha256 3f1a90c2… · sweep y_axis_4d.toml, 200 runs at 120,000 cells · 2026-11-21".into(),
    }
}

/// Values that break naive code.
pub const NASTY: [f64; 8] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -0.0, 1e308, -1e308, 5e-324];

pub fn panels() -> PanelsFigure {
    let curve = |c: &[f64; 4], shift: f64| {
        (0..=30).map(|i| 3.925 + 0.9158 * f64::from(i)).map(|x| (x, ((c[0] * x + c[1]) * x + c[2]) * x + c[3] + shift)).collect::<Vec<_>>()
    };
    let panel = |(c, name): (&[f64; 4], &str)| Panel {
        title: name.into(),
        samples: Vec::new(),
        curves: vec![curve(c, 0.0), curve(c, 0.3), Vec::new()],
    };
    PanelsFigure {
        title: "Temperatures over the coolant flow".into(),
        x: flow(),
        y: temperature(),
        names: ["ours", "published", "published, corrected"].map(String::from).to_vec(),
        panels: TABLE_7.iter().zip(POINTS).map(panel).collect(),
        notes: vec!["2500 rpm, 20 °C".into()],
    }
}

/// Sensors down, `columns` conditions across, before and after.
pub fn residual_sheet(columns: usize) -> ResidualSheet {
    let sheet = |size: f64| -> Vec<Vec<f64>> {
        (0..POINTS.len())
            .map(|i| (0..columns).map(|j| if (i + j) % 9 == 4 { f64::NAN } else { size * scatter(100 * i + j) }).collect())
            .collect()
    };
    ResidualSheet {
        title: "What the model gets wrong".into(),
        sensors: POINTS.map(String::from).to_vec(),
        conditions: (0..columns).map(|j| format!("test {}", j + 1)).collect(),
        sheets: vec![("The machine as it is".into(), sheet(12.0)), ("With the best explanation".into(), sheet(1.5))],
        unit: "standard deviations".into(),
        full: (3.0, 10.0),
        decimals: 1,
        notes: vec!["Measured less predicted.".into()],
    }
}

pub fn residual_panels() -> ResidualPanels {
    let row = |k: usize| {
        vec![5.0 + 3.0 * scatter(k), 22.0 + 4.0 * scatter(k + 50), 1400.0 + 1100.0 * scatter(k + 90), 24.0 + 4.0 * scatter(k + 130)]
    };
    ResidualPanels {
        title: "Does it follow a condition?".into(),
        quantity: Quantity::new("measured − predicted", "K"),
        variables: vec![
            flow(),
            Quantity::new("coolant_temperature", "degC"),
            Quantity::new("motor_speed", "rpm"),
            Quantity::new("ambient_temperature", "degC"),
        ],
        conditions: (0..20).map(row).collect(),
        sensors: POINTS.iter().enumerate().map(|(i, n)| (n.to_string(), (0..20).map(|k| scatter(31 * i + k)).collect())).collect(),
        half_width: 0.4,
        notes: vec!["The machine as it is.".into()],
    }
}

pub fn ranking() -> RankingFigure {
    let ranked = |(name, probability, standing): (&str, f64, Standing)| Ranked { name: name.into(), probability, standing };
    let all = [
        (
            "heat enters at the bearing seat that the model lacks: 2.1 W (1.8 to 2.4), with the square of the motor speed",
            0.94,
            Standing::Open,
        ),
        ("the contact between bearing and seat conducts 0.42 (0.31 to 0.57) times what the model has", 0.05, Standing::Open),
        ("the sensor 'bearing' reads too high by 0.8 K (0.7 to 0.9)", 0.0001, Standing::Refuted),
        ("something else", 0.009, Standing::Other),
        ("nothing is wrong", 0.0, Standing::Other),
    ];
    RankingFigure { title: "What could explain it".into(), ranked: all.into_iter().map(ranked).collect(), notes: Vec::new() }
}

pub fn gains() -> GainsFigure {
    let step =
        |(name, kept_out, all, remark): (&str, f64, f64, &str)| LadderStep { name: name.into(), kept_out, all, remark: remark.into() };
    let all = [
        ("The machine as it is", 7.75, 7.4, ""),
        ("Something conducts heat between heater 1 and heater 2: 0.0148 W/K (0.0119 to 0.0177)", 2.07, 1.65, "95 % explained"),
        (
            "The sensor 'heater 1' lags by 19 s (17 to 21); and heat enters at heater 2 that the model lacks: 0.07 W",
            0.9,
            0.8,
            "97 % explained",
        ),
    ];
    GainsFigure {
        title: "What every cause gains".into(),
        steps: all.into_iter().map(step).collect(),
        noise_floor: 0.25,
        notes: vec!["Each step has the causes of those above it.".into()],
    }
}

pub fn missing() -> IntervalFigure {
    let row = |(i, name): (usize, &&str)| {
        let value = 6.0 * scatter(i);
        let half = 0.5 + 2.0 * scatter(i + 9).abs();
        PlaceInterval {
            name: name.to_string(),
            value,
            ends: (value - half, value + half),
            remark: format!("−{}.4 of 98.0", 60 - 8 * i),
            is_strong: i < 3,
        }
    };
    IntervalFigure {
        title: "Where heat is missing or in excess".into(),
        quantity: Quantity::new("heat that would have to be added there", "W"),
        rows: POINTS.iter().enumerate().map(row).collect(),
        remarks: "misfit it takes away".into(),
        meaning: ["not by chance".into(), "may be chance".into()],
        notes: vec!["One part at a time.".into()],
    }
}

pub fn balance() -> BalanceFigure {
    let pair = |name: &str, before: Option<f64>, after: Option<f64>| HeatPair { name: name.into(), before, after };
    BalanceFigure {
        title: "Where the heat goes: condition 1".into(),
        sources: vec![
            pair("motor", Some(113.7), Some(113.7)),
            pair("reducer", Some(51.2), Some(51.2)),
            pair("diagnosed heat", None, Some(2.1)),
        ],
        sinks: vec![
            pair("coolant water", Some(150.1), Some(151.9)),
            pair("chamber wall", Some(16.8), Some(17.1)),
            pair("hose", Some(-2.0), Some(-2.0)),
        ],
        names: ["the machine as it is".into(), "with the best explanation".into()],
        fixed: fixed(),
        notes: Vec::new(),
    }
}

pub fn before_after() -> BeforeAfter {
    let reading = |k: usize| {
        let t = 26.0 + 8.0 * scatter(k);
        [t, t - 0.8 + 0.5 * scatter(k + 300), t + 0.1 * scatter(k + 600)]
    };
    BeforeAfter {
        title: "What is gained on conditions kept out".into(),
        quantity: temperature(),
        readings: (0..70).map(reading).collect(),
        conditions: (0..10).map(|k| (0.9 + 0.3 * scatter(k), 0.08 + 0.03 * scatter(k + 20))).collect(),
        noise_floor: 0.1,
        names: ["the machine as it is".into(), "with the cause that the other conditions point to".into()],
        notes: vec!["Each condition is predicted with what was found without it.".into()],
    }
}
