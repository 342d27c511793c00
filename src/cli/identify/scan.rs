//! The misfit over a grid of two parameters.

use std::time::Instant;

use serde::Serialize;

use super::super::output::Output;
use super::Args;
use coldplate_base::error::{Error, Result};
use coldplate_evidence::identify::{self, IdentifyProblem, MisfitScan};
use coldplate_evidence::measurement::whiten;
use coldplate_figures::chart::draw_as;
use coldplate_figures::chart::style::Quantity;
use coldplate_figures::chart::valley::{Trace, ValleyFigure};
use coldplate_solve::study::MachineParameter;

/// The grid as outside programs read it, in the parameters' units; pairs without a steady state are `null`.
#[derive(Debug, Serialize)]
#[allow(non_snake_case)]
struct ScanRecord<'a> {
    names: &'a [String; 2],
    units: [String; 2],
    axes: [Vec<f64>; 2],
    misfit: &'a [Vec<f64>],
    mean_difference_K: &'a [Vec<f64>],
    least_misfit: [f64; 2],
    least_mean_difference: [f64; 2],
}

/// The grid of two parameters.
pub(super) fn run(args: &Args, problem: &IdentifyProblem, out: Output) -> Result<u8> {
    let clock = Instant::now();
    let [first, second] = args.scan.as_slice() else {
        return Err(Error::input("a scan goes over two parameters")
            .at_key("--scan")
            .read(args.scan.len())
            .help("give --scan twice: KEY=LOW..HIGH/STEP"));
    };
    let axes = [identify::axis(first, &problem.study)?, identify::axis(second, &problem.study)?];
    let total = axes[0].1.len() * axes[1].1.len();
    let found = identify::scan(problem, [(&axes[0].0, axes[0].1.clone()), (&axes[1].0, axes[1].1.clone())], &out.progress())?;
    let (i, j) = MisfitScan::least(&found.misfit);
    let (m, n) = MisfitScan::least(&found.mean);
    let shown = |k: usize, at: usize| axes[k].0.shown(found.axes[k][at]);
    if let Some(path) = &args.chart {
        draw_as(path, &figure(problem, &found, &axes))?;
        out.note(&format!("wrote {}", path.display()));
    }
    let unit = |k: usize| axes[k].0.unit.clone();
    let text = format!(
        "{} pairs in {:.1} s\nleast misfit {:.2} at {} = {} {}, {} = {} {}\nleast mean difference {:.3} K at {} {}, {} {}\n",
        total,
        clock.elapsed().as_secs_f64(),
        found.misfit[i][j],
        found.names[0],
        shown(0, i),
        unit(0),
        found.names[1],
        shown(1, j),
        unit(1),
        found.mean[m][n],
        shown(0, m),
        unit(0),
        shown(1, n),
        unit(1)
    );
    let values = |k: usize| found.axes[k].iter().map(|v| axes[k].0.shown(*v)).collect::<Vec<_>>();
    let record = ScanRecord {
        names: &found.names,
        units: [unit(0), unit(1)],
        axes: [values(0), values(1)],
        misfit: &found.misfit,
        mean_difference_K: &found.mean,
        least_misfit: [shown(0, i), shown(1, j)],
        least_mean_difference: [shown(0, m), shown(1, n)],
    };
    out.report(&text, &record);
    Ok(0)
}

fn figure(problem: &IdentifyProblem, found: &MisfitScan, axes: &[(MachineParameter, Vec<f64>); 2]) -> ValleyFigure {
    let (i, j) = MisfitScan::least(&found.misfit);
    let readings = whiten::readings(&problem.data);
    let places = whiten::places(&problem.data);
    let name = |r: usize, k: usize| {
        let sensor = &problem.data.names[k];
        if problem.data.tests().len() > 1 { format!("{sensor}, {}", problem.data.rows[r].test) } else { sensor.clone() }
    };
    let trace = |along: usize, n: usize| {
        let (r, k) = places[n];
        let shown = |reading: f64| problem.data.shown(&problem.study.model.machine, k, reading);
        let predicted = (0..found.axes[along].len())
            .map(|at| shown(if along == 0 { found.predictions[at][j][n] } else { found.predictions[i][at][n] }));
        Trace { name: name(r, k), predicted: predicted.collect(), measured: shown(readings[n]) }
    };
    // A reading that moves by less than a twentieth of a kelvin over the whole axis says nothing there.
    let moves = |t: &Trace| {
        let finite = || t.predicted.iter().copied().filter(|v| v.is_finite());
        finite().fold(f64::MIN, f64::max) - finite().fold(f64::MAX, f64::min) > 0.05
    };
    let traces = [0, 1].map(|along| (0..places.len()).map(|n| trace(along, n)).filter(moves).collect());
    let shown = |k: usize, v: f64| axes[k].0.shown(v);
    let least = found.misfit[i][j];
    let table = found.misfit.iter().map(|row| row.iter().map(|v| (v - least).max(0.0)).collect()).collect();
    ValleyFigure {
        title: problem.study.model.machine.name.clone(),
        parameters: [0, 1].map(|k| Quantity::new(axes[k].0.name.clone(), axes[k].0.unit.clone())),
        axes: [0, 1].map(|k| found.axes[k].iter().map(|v| shown(k, *v)).collect()),
        misfit: table,
        meaning: "misfit above the least one; 5.99 encloses 95 % of what the readings allow".into(),
        levels: vec![1.0, 5.99, 20.0, 100.0, 400.0, 1600.0, 6400.0],
        marks: vec![
            ("least misfit".into(), [shown(0, found.axes[0][i]), shown(1, found.axes[1][j])]),
            ("machine file".into(), [shown(0, axes[0].0.value), shown(1, axes[1].0.value)]),
        ],
        traces,
        notes: vec![
            format!(
                "Below: readings along each parameter, the other at its best value ({} and {}); dashed: measured.",
                shown(0, found.axes[0][i]),
                shown(1, found.axes[1][j])
            ),
            format!("Data: {}, {}.", problem.data.source, problem.data.tests().join(", ")),
        ],
    }
}
