//! Figures of a diagnosis, from its numbers.

use super::{Findings, capital, ladder, words};
use coldplate_base::numbers::{TWO_SIDED_90, TWO_SIDED_95};
use coldplate_base::units::express;
use coldplate_describe::machine::Condition;
use coldplate_diagnose::{HeldOutReading, Problem, Verdict};
use coldplate_evidence::measurement::{Data, whiten};
use coldplate_figures::chart::balance::{BalanceFigure, HeatPair};
use coldplate_figures::chart::before_after::BeforeAfter;
use coldplate_figures::chart::gains::{GainsFigure, LadderStep};
use coldplate_figures::chart::missing_heat::{IntervalFigure, PlaceInterval};
use coldplate_figures::chart::ranking::{Ranked, RankingFigure, Standing};
use coldplate_figures::chart::residual_panels::ResidualPanels;
use coldplate_figures::chart::residual_sheet::ResidualSheet;
use coldplate_figures::chart::style::Quantity;
use coldplate_solve::meshed::Flows;

/// Most columns of a sheet, a count. Chosen: narrower cells cannot be read.
const COLUMNS: usize = 60;
/// Most rows of data drawn as markers, a count. Chosen: more markers cover each other.
const MARKERS: usize = 240;
/// Most rows of bars, a count. Chosen: a figure that fits on a page.
const BARS: usize = 12;
/// Least heat flow that is drawn, as a share of the largest. Chosen: smaller bars cannot be seen.
const LEAST_HEAT: f64 = 5e-4;
/// Decrease of the misfit by one number that chance exceeds in one case of a hundred, dimensionless: the 99 %
/// quantile of the chi-square distribution with one degree of freedom.
const NOT_BY_CHANCE: f64 = 6.635;

/// Values at which the colours of a sheet are full: least in kelvin, least in standard deviations, and largest in
/// standard deviations. Chosen: noise stays pale.
const FULL: (f64, f64, f64) = (0.3, 3.0, 10.0);

/// The residual sheet in kelvin, before and, if anything was explained, after.
pub(super) fn sheet(found: &Findings<'_>) -> ResidualSheet {
    let (data, diagnosis) = (&found.problem.data, &found.diagnosis);
    let left = diagnosis.explained.as_ref().map(|explained| difference(&whiten::readings(data), explained));
    ResidualSheet {
        title: "What the model gets wrong, reading by reading".into(),
        unit: "K".into(),
        full: (FULL.0, f64::INFINITY),
        decimals: 2,
        notes: vec!["Measured less predicted. Struck through: nothing was read.".into()],
        ..sheets(data, &diagnosis.residuals.residual, left.as_deref(), |within| within.iter().sum::<f64>() / within.len() as f64)
    }
}

/// The residual sheet with each residual over the standard deviation of its reading.
pub(super) fn relative_sheet(found: &Findings<'_>) -> ResidualSheet {
    let (data, sheet) = (&found.problem.data, &found.diagnosis.residuals);
    let over = |values: &[f64]| values.iter().zip(&sheet.deviation).map(|(v, d)| v / d).collect::<Vec<_>>();
    let left = found.diagnosis.explained.as_ref().map(|explained| over(&difference(&whiten::readings(data), explained)));
    ResidualSheet {
        title: "Residuals in standard deviations, reading by reading".into(),
        unit: "standard deviations".into(),
        full: (FULL.1, FULL.2),
        decimals: 1,
        notes: vec![
            "Standard deviations from all errors together: of the reading, the sensor, the condition, and the model itself. Within ±2 is noise."
                .into(),
        ],
        ..sheets(data, &over(&sheet.residual), left.as_deref(), |within| within.iter().sum::<f64>() / within.len() as f64)
    }
}

/// The residual sheet with whitened residuals, whose squares add up to the misfit.
pub(super) fn whitened_sheet(found: &Findings<'_>) -> ResidualSheet {
    let (data, diagnosis) = (&found.problem.data, &found.diagnosis);
    let left = diagnosis.explained.as_ref().map(|explained| diagnosis.whitener.apply(&difference(&whiten::readings(data), explained)));
    // Several readings together: their sum over the root of their number keeps unit variance.
    let together = |within: &[f64]| within.iter().sum::<f64>() / (within.len() as f64).sqrt();
    ResidualSheet {
        title: "Whitened residuals, whose squares add up to the misfit".into(),
        unit: "standard deviations".into(),
        full: (FULL.1, FULL.2),
        decimals: 1,
        notes: vec![
            "Errors that readings share (of a sensor, the water, the flow, the chamber, films, heats) are taken out, which mixes readings: a sign \
             may differ from that above. The squares of all cells add up to the misfit; pure noise stays within ±2."
                .into(),
        ],
        ..sheets(data, &diagnosis.residuals.whitened, left.as_deref(), together)
    }
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Cells of a sheet; `together` makes one number of several readings.
fn sheets(data: &Data, before: &[f64], after: Option<&[f64]>, together: impl Fn(&[f64]) -> f64) -> ResidualSheet {
    let places = whiten::places(data);
    let columns = columns(data);
    let cells = |values: &[f64]| -> Vec<Vec<f64>> {
        let cell = |k: usize, rows: &[usize]| {
            let own = places.iter().zip(values).filter(|((r, own), _)| *own == k && rows.contains(r));
            let within: Vec<f64> = own.map(|(_, v)| *v).collect();
            if within.is_empty() { f64::NAN } else { together(&within) }
        };
        (0..data.names.len()).map(|k| columns.iter().map(|(_, rows)| cell(k, rows)).collect()).collect()
    };
    let mut sheets = vec![("The machine as it is".to_string(), cells(before))];
    sheets.extend(after.map(|values| ("With the best explanation".to_string(), cells(values))));
    ResidualSheet {
        sensors: data.names.clone(),
        conditions: columns.into_iter().map(|(name, _)| name).collect(),
        sheets,
        ..ResidualSheet::default()
    }
}

/// Rows of the data by column of the sheet, with a name each.
fn columns(data: &Data) -> Vec<(String, Vec<usize>)> {
    let name = |r: usize| {
        let row = &data.rows[r];
        match row.time {
            Some(t) if data.tests().len() == 1 => format!("{t:.0} s"),
            Some(t) => format!("{}, {t:.0} s", row.test),
            None => row.test.clone(),
        }
    };
    let each = data.rows.len().div_ceil(COLUMNS).max(1);
    let mut found: Vec<(String, Vec<usize>)> = Vec::new();
    for test in data.tests() {
        let rows: Vec<usize> = (0..data.rows.len()).filter(|r| data.rows[*r].test == test).collect();
        found.extend(rows.chunks(each).map(|chunk| (name(chunk[0]), chunk.to_vec())));
    }
    found
}

/// Residuals over every condition that varies; `None` where none does.
pub(super) fn panels(found: &Findings<'_>) -> Option<ResidualPanels> {
    let (data, diagnosis) = (&found.problem.data, &found.diagnosis);
    let machine = &found.problem.study.model.machine;
    let rows: Vec<usize> = (0..data.rows.len()).step_by(data.rows.len().div_ceil(MARKERS).max(1)).collect();
    let mut variables: Vec<(Quantity, Vec<f64>)> = Vec::new();
    for (v, variable) in machine.variables.iter().enumerate().filter(|(_, v)| found.problem.states(&v.name)) {
        let shown = |r: &usize| {
            let si = data.rows[*r].condition.si()[v];
            express(si, &variable.unit, variable.dimension).unwrap_or(si)
        };
        variables.push((Quantity::new(&variable.name, &variable.unit), rows.iter().map(shown).collect()));
    }
    if data.is_transient() {
        let time = rows.iter().map(|r| data.rows[*r].time.unwrap_or(f64::NAN)).collect();
        variables.push((Quantity::new("time", "s"), time));
    }
    variables.retain(|(_, values)| {
        let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        high - low > 1e-9 * high.abs().max(low.abs())
    });
    if variables.is_empty() {
        return None;
    }
    let places = whiten::places(data);
    let residual = |k: usize, r: usize| {
        places.iter().position(|p| *p == (r, k)).and_then(|i| diagnosis.residuals.residual.get(i)).copied().unwrap_or(f64::NAN)
    };
    let mut sensors: Vec<(String, Vec<f64>)> =
        data.names.iter().enumerate().map(|(k, name)| (name.clone(), rows.iter().map(|r| residual(k, *r)).collect())).collect();
    let square = |values: &[f64]| values.iter().filter(|v| v.is_finite()).map(|v| v * v).sum::<f64>();
    sensors.sort_by(|a, b| square(&b.1).total_cmp(&square(&a.1)));
    let (quantities, values): (Vec<Quantity>, Vec<Vec<f64>>) = variables.into_iter().unzip();
    Some(ResidualPanels {
        title: "Does it follow a condition?".into(),
        quantity: Quantity::new("measured − predicted", "K"),
        variables: quantities,
        conditions: (0..rows.len()).map(|i| values.iter().map(|column| column[i]).collect()).collect(),
        sensors,
        half_width: diagnosis.gain.as_ref().map_or(f64::NAN, |g| TWO_SIDED_95 * g.noise_floor),
        notes: vec!["The machine as it is. Sensors with the largest residuals stand out.".into()],
    })
}

/// Explanations by probability.
pub(super) fn ranking(found: &Findings<'_>) -> RankingFigure {
    let diagnosis = &found.diagnosis;
    let mut ranked: Vec<Ranked> = found
        .ranked(BARS)
        .filter(|(i, e)| *i < 3 || e.probability > 5e-3)
        .map(|(i, e)| Ranked {
            name: words(e),
            probability: e.probability,
            standing: if diagnosis.set.contains(&i) { Standing::Open } else { Standing::Refuted },
        })
        .collect();
    let shown: f64 = ranked.iter().map(|r| r.probability).sum();
    let rest: f64 = diagnosis.explanations.iter().map(|e| e.probability).sum::<f64>() - shown;
    if rest > 5e-4 {
        ranked.push(Ranked { name: "all other causes and pairs together".into(), probability: rest, standing: Standing::Refuted });
    }
    ranked.push(Ranked { name: "something else".into(), probability: diagnosis.others.something_else, standing: Standing::Other });
    ranked.push(Ranked { name: "nothing is wrong".into(), probability: diagnosis.others.nothing, standing: Standing::Other });
    RankingFigure { title: "What could explain it".into(), ranked, notes: Vec::new() }
}

/// Heat that each part alone would have to give; `None` if no part could show.
pub(super) fn missing(found: &Findings<'_>) -> Option<IntervalFigure> {
    let diagnosis = &found.diagnosis;
    let row = |m: &coldplate_diagnose::MissingHeat| PlaceInterval {
        name: m.part.clone(),
        value: m.watts,
        ends: (m.watts - TWO_SIDED_90 * m.deviation, m.watts + TWO_SIDED_90 * m.deviation),
        remark: { format!("−{:.1} of {:.1}", m.explained, diagnosis.misfit.chi2) },
        is_strong: m.explained > NOT_BY_CHANCE,
    };
    let rows: Vec<PlaceInterval> = diagnosis.missing.iter().take(BARS).map(row).collect();
    (!rows.is_empty()).then(|| IntervalFigure {
        title: "Where heat is missing or in excess".into(),
        quantity: Quantity::new("heat that would have to be added there", "W"),
        rows,
        remarks: "misfit it takes away".into(),
        meaning: ["not by chance at this place".into(), "may be chance".into()],
        notes: vec![
            "Heat into one part at a time, alike at all conditions, with its 90 % interval; negative: the model has too much there. \
             Only one of these can be the cause: what takes away most misfit points to the place."
                .into(),
        ],
    })
}

/// The heat balance of the condition with most heat.
pub(super) fn balance(found: &Findings<'_>) -> Option<BalanceFigure> {
    let balance = found.energy.largest()?;
    let pairs = |of: fn(&Flows) -> &Vec<(String, f64)>| -> Vec<HeatPair> {
        let mut pairs: Vec<HeatPair> =
            of(&balance.before).iter().map(|(name, q)| HeatPair { name: name.clone(), before: Some(*q), after: None }).collect();
        for (name, q) in balance.after.iter().flat_map(of) {
            match pairs.iter_mut().find(|p| p.name == *name) {
                Some(pair) => pair.after = Some(*q),
                None => pairs.push(HeatPair { name: name.clone(), before: None, after: Some(*q) }),
            }
        }
        pairs
    };
    let (mut sources, sinks) = (pairs(|f| &f.sources), pairs(|f| &f.sinks));
    // A wall or water that warms the machine is a source.
    let turned = |v: Option<f64>| v.map(|q| -q);
    let (sinks, warming): (Vec<_>, Vec<_>) = sinks.into_iter().partition(|p| [p.before, p.after].iter().flatten().any(|q| *q > 0.0));
    sources.extend(warming.into_iter().map(|p| HeatPair { before: turned(p.before), after: turned(p.after), ..p }));
    let largest = sources.iter().chain(&sinks).flat_map(|p| [p.before, p.after]).flatten().fold(0.0, |m: f64, q| m.max(q.abs()));
    let shows = |p: &HeatPair| [p.before, p.after].iter().flatten().any(|q| q.abs() > LEAST_HEAT * largest);
    let sources: Vec<_> = sources.into_iter().filter(shows).collect();
    let sinks: Vec<_> = sinks.into_iter().filter(shows).collect();
    (!(sources.is_empty() && sinks.is_empty())).then(|| BalanceFigure {
        title: format!("Where the heat goes: {}", balance.test),
        sources,
        sinks,
        names: ["the machine as it is".into(), "with the best explanation".into()],
        fixed: fixed(found.problem, &balance.condition),
        notes: vec!["Steady; the condition with most heat.".into()],
    })
}

fn fixed(problem: &Problem, condition: &Condition) -> Vec<(Quantity, f64)> {
    let of = |(v, si): (&coldplate_describe::machine::DescribedVariable, &f64)| {
        let shown = express(*si, &v.unit, v.dimension).unwrap_or(*si);
        // Five digits: the conversion to SI and back must not show.
        (Quantity::new(&v.name, &v.unit), format!("{shown:.4e}").parse().unwrap_or(shown))
    };
    problem.study.model.machine.variables.iter().zip(condition.si()).filter(|(v, _)| problem.states(&v.name)).map(of).collect()
}

/// The ladder: errors from the machine as it is to the machine with the last cause; `None` if nothing was added to the
/// machine.
pub(super) fn gains(found: &Findings<'_>) -> Option<GainsFigure> {
    let diagnosis = &found.diagnosis;
    let first = diagnosis.rungs.first()?;
    let readings = whiten::readings(&found.problem.data);
    let square: f64 = difference(&readings, &diagnosis.residuals.predicted).iter().map(|v| v * v).sum();
    let mut steps = vec![LadderStep {
        name: "The machine as it is".into(),
        kept_out: first.gain.as_ref().map_or(f64::NAN, |gain| gain.before),
        all: (square / readings.len().max(1) as f64).sqrt(),
        remark: String::new(),
    }];
    steps.extend(diagnosis.rungs.iter().map(|rung| LadderStep {
        name: capital(&ladder::causes(rung)),
        kept_out: rung.gain.as_ref().map_or(f64::NAN, |gain| gain.after),
        all: rung.rms,
        remark: format!("{:.0} % explained", 100.0 * rung.share),
    }));
    Some(GainsFigure {
        title: if diagnosis.is_calibrated() { "What is gained".into() } else { "What every cause gains".into() },
        steps,
        noise_floor: first.gain.as_ref().map_or(f64::NAN, |gain| gain.noise_floor),
        notes: vec![
            "Conditions kept out took no part in fitting what predicts them. Explained: of the squared residual of the machine as it is."
                .into(),
        ],
    })
}

/// Predictions of kept-out conditions before and after; `None` with too few conditions.
pub(super) fn gain(found: &Findings<'_>) -> Option<BeforeAfter> {
    let diagnosis = &found.diagnosis;
    let gain = diagnosis.gain.as_ref()?;
    let readings = whiten::readings(&found.problem.data);
    let mut squares = vec![(0.0, 0.0, 0.0f64); gain.conditions.len()];
    for (HeldOutReading { condition, change }, residual) in gain.readings.iter().zip(&diagnosis.residuals.residual) {
        let sum = &mut squares[*condition];
        *sum = (sum.0 + residual * residual, sum.1 + (residual - change).powi(2), sum.2 + 1.0);
    }
    let (data, machine) = (&found.problem.data, &found.problem.study.model.machine);
    let columns = whiten::places(data).into_iter().map(|(_, k)| k);
    let all = readings.iter().zip(&diagnosis.residuals.predicted).zip(&gain.readings).zip(columns);
    Some(BeforeAfter {
        title: if diagnosis.verdict == Verdict::Consistent {
            "Predictions of conditions kept out".into()
        } else {
            "What is gained on conditions kept out of the fit".into()
        },
        quantity: Quantity::new("temperature", "degC"),
        readings: all.map(|(((r, p), held), k)| [*r, *p, p + held.change].map(|reading| data.shown(machine, k, reading))).collect(),
        conditions: squares.into_iter().map(|(a, b, n)| ((a / n.max(1.0)).sqrt(), (b / n.max(1.0)).sqrt())).collect(),
        noise_floor: gain.noise_floor,
        names: [
            "the machine as it is".into(),
            if diagnosis.is_calibrated() {
                "with the numbers that the other conditions draw".into()
            } else {
                "with the causes as the other conditions have them".into()
            },
        ],
        notes: vec![
            "Each condition is predicted by amplitudes that were fitted without it; the causes were chosen with all of them.".into(),
        ],
    })
}
