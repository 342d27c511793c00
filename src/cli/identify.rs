//! `coldplate identify`: parameters of a machine file from measured data.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::{Map, Value, json};

use super::condition::{pair_of, start_of};
use super::output::Output;
use super::text::{significant, table};
use crate::chart::draw_as;
use crate::chart::style::Quantity;
use crate::chart::valley::{Trace, ValleyFigure};
use crate::error::{Error, Result, did_you_mean};
use crate::files;
use crate::identify::{self, Advice, Estimate, Free, Options, Problem, Profile, Scan};
use crate::machine::Machine;
use crate::measure::{Data, Uncertainty, whiten};
use crate::sensitivity::{Parameter, Study};
use crate::units::{Celsius, Kelvin, express, parse};

/// Parameters of a machine file from measured data
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Machine file
    machine: PathBuf,
    /// Measured data: CSV with test, conditions and sensors (default: the measurements in the machine file)
    data: Option<PathBuf>,
    /// A number to find, by its dotted key; bounds and prior may follow: KEY=LOW..HIGH, VALUE +- DEVIATION; may be repeated
    #[arg(long = "free", value_name = "KEY")]
    free: Vec<String>,
    /// Find them from this test only and predict the others untouched; may be repeated (default: all tests)
    #[arg(long = "use", value_name = "TEST")]
    use_tests: Vec<String>,
    /// Leave out a sensor; may be repeated
    #[arg(long = "without", value_name = "SENSOR")]
    without: Vec<String>,
    /// Instead of a search, try every pair over a grid: KEY=LOW..HIGH/STEP, twice
    #[arg(long = "scan", value_name = "KEY=LOW..HIGH/STEP")]
    scan: Vec<String>,
    /// Draw the scan: .svg or .png
    #[arg(long, value_name = "FILE")]
    chart: Option<PathBuf>,
    /// Starting points of the search
    #[arg(long, value_name = "N", default_value_t = 3)]
    starts: usize,
    /// Leave out profile likelihoods and advice on further tests
    #[arg(long)]
    brief: bool,
    /// The state logs begin with: "steady", "readings" (each test at the mean of its first readings), or a temperature
    #[arg(long, value_name = "STATE", default_value = "steady")]
    from: String,
    /// Write the identified machine here (default: beside the machine file, as NAME.identified.toml); never over a file
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Change a value of the machine file first
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// About how many cells (default: the machine file's own)
    #[arg(long, value_name = "N")]
    cells: Option<usize>,
}

/// Runs the command.
///
/// # Errors
/// Bad input, or numerics that failed.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let clock = Instant::now();
    let sets = args.set.iter().map(|s| pair_of(s, "--set")).collect::<Result<Vec<_>>>()?;
    let study = Study::read(&args.machine, &sets, args.cells)?;
    let machine = &study.model.machine;
    let mut all = match &args.data {
        Some(path) => Data::read(path, machine)?,
        None => Data::of_machine(machine)?,
    };
    drop_sensors(&mut all, &args.without)?;
    // A table called like the machine file, beside it, has no file of its own to say how uncertain it is.
    let is_machine = |path: &Path| matches!((path.canonicalize(), args.machine.canonicalize()), (Ok(a), Ok(b)) if a == b);
    let uncertainty = match &args.data {
        Some(path) if !is_machine(&path.with_extension("toml")) => Uncertainty::beside(path, &all, machine)?,
        _ => Uncertainty::usual(&all, machine),
    };
    if uncertainty.file.is_none() {
        out.note("note: no file says how uncertain the readings are; taking limits of 0.1 K for readings, sensors and water, 0.05 L/min");
    }
    all.notes.iter().for_each(|note| out.note(&format!("note: {note}")));
    let (data, others) = if args.use_tests.is_empty() {
        (all.clone(), None)
    } else {
        let (chosen, others) = all.split(&args.use_tests)?;
        (chosen, (!others.rows.is_empty()).then_some(others))
    };
    let start = start_of(&args.from)?;
    if args.free.is_empty() && args.scan.is_empty() {
        let usual: Vec<String> = study.usual_parameters().iter().filter(|p| p.variable().is_none()).map(|p| p.name.clone()).collect();
        return Err(Error::input("it is not said what to find").at_key("--free").help(format!(
            "name numbers of the machine file, for example --free \"{}\"; often: {}",
            usual.first().map_or("contact.NAME.conductance", String::as_str),
            usual.join(", ")
        )));
    }
    let free = args.free.iter().map(|text| Free::parse(text, &study)).collect::<Result<Vec<_>>>()?;
    let path = goal(args, machine)?;
    let problem = Problem { study, data, uncertainty, free, start };
    if !args.scan.is_empty() {
        return scan(args, &problem, out);
    }
    let estimate = identify::identify(&problem, &Options { starts: args.starts, ..Options::default() }, &mut |what| out.note(what))?;
    let (profiles, advice) = if args.brief {
        (Vec::new(), Vec::new())
    } else {
        out.note("profile likelihoods, further tests");
        let profiles = (0..problem.free.len()).map(|k| identify::profile(&problem, &estimate, k)).collect::<Result<Vec<_>>>()?;
        (profiles, identify::next_tests(&problem, &estimate, &(0..problem.study.model.machine.sensors.len()).collect::<Vec<_>>())?)
    };
    let held_out = match &others {
        Some(others) => {
            let study = problem.machine_at(&estimate.values)?;
            let before = identify::values(&problem.study, others, start)?;
            Some((others, before, identify::values(&study, others, start)?))
        }
        None => None,
    };
    let text = identify::write_machine(&problem, &estimate, &problem.data.tests())?;
    files::write(&path, text.as_bytes())?;
    let found = Found {
        problem: &problem,
        estimate: &estimate,
        profiles: &profiles,
        advice: &advice,
        held_out,
        path: &path,
        seconds: clock.elapsed().as_secs_f64(),
    };
    out.report(&found.text(), &found.json());
    Ok(0)
}

fn drop_sensors(data: &mut Data, names: &[String]) -> Result<()> {
    for name in names {
        let Some(k) = data.names.iter().position(|n| n == name) else {
            let error = Error::input(format!("no column is of a sensor '{name}'")).at_key("--without");
            return Err(match did_you_mean(name, data.names.iter().map(String::as_str)) {
                Some(near) => error.help(format!("did you mean '{near}'?")),
                None => error.help(format!("sensors here: {}", data.names.join(", "))),
            });
        };
        data.names.remove(k);
        data.sensors.remove(k);
        data.rows.iter_mut().for_each(|row| {
            row.readings.remove(k);
        });
    }
    // Rows of a log also say what the conditions were.
    if !data.is_transient() {
        data.rows.retain(|row| row.readings.iter().any(Option::is_some));
    }
    if data.count() == 0 { Err(Error::input("no reading is left").at_key("--without")) } else { Ok(()) }
}

/// Where the identified machine goes: said before the search, not after it.
fn goal(args: &Args, machine: &Machine) -> Result<PathBuf> {
    let Some(path) = &args.out else { return Ok(unused(&args.machine)) };
    if path.exists() {
        return Err(Error::input("this file is there already")
            .in_file(path)
            .at_key("--out")
            .help("give another name: nothing is written over"));
    }
    let folder = |p: &Path| p.parent().map(|f| if f.as_os_str().is_empty() { Path::new(".") } else { f }.canonicalize().ok());
    if machine.parts.iter().any(|p| p.import.is_some()) && folder(path) != folder(&args.machine) {
        return Err(Error::input("this machine imports meshes that lie beside its file")
            .in_file(path)
            .at_key("--out")
            .help("write the identified machine into the same folder"));
    }
    Ok(path.clone())
}

/// A name beside the machine file that no file has.
fn unused(machine: &Path) -> PathBuf {
    let stem = machine.file_stem().map_or_else(|| "machine".into(), |s| s.to_string_lossy().into_owned());
    let named =
        |n: usize| machine.with_file_name(if n == 1 { format!("{stem}.identified.toml") } else { format!("{stem}.identified-{n}.toml") });
    (1..).map(named).find(|p| !p.exists()).unwrap_or_else(|| named(1))
}

fn celsius(kelvin: f64) -> f64 {
    Celsius::from(Kelvin(kelvin)).0
}

struct Found<'a> {
    problem: &'a Problem,
    estimate: &'a Estimate,
    profiles: &'a [Profile],
    advice: &'a [Advice],
    held_out: Option<(&'a Data, Vec<f64>, Vec<f64>)>,
    path: &'a Path,
    seconds: f64,
}

impl Found<'_> {
    fn shown(&self, k: usize, value: f64) -> String {
        significant(self.problem.free[k].parameter.shown(value), 5)
    }

    fn text(&self) -> String {
        let (problem, estimate) = (self.problem, self.estimate);
        let mut text = format!(
            "{}\n{} readings of {} sensors in {}\n\n",
            problem.study.model.machine.name,
            problem.data.count(),
            problem.data.sensors.len(),
            plural(problem.data.tests().len(), "test")
        );
        let rows: Vec<Vec<String>> = (0..problem.free.len())
            .map(|k| {
                let p = &problem.free[k].parameter;
                let profile = self.profiles.iter().find(|f| f.parameter == k).map_or(String::new(), |f| {
                    let end = |v: Option<f64>| v.map_or("open".to_string(), |v| self.shown(k, v));
                    format!("{} to {}", end(f.interval.0), end(f.interval.1))
                });
                vec![
                    p.name.clone(),
                    self.shown(k, p.value),
                    self.shown(k, estimate.values[k]),
                    if p.unit == "1" { String::new() } else { p.unit.clone() },
                    format!("{} to {}", self.shown(k, estimate.intervals[k].0), self.shown(k, estimate.intervals[k].1)),
                    profile,
                    if estimate.at_bound[k] { "at its bound".into() } else { String::new() },
                ]
            })
            .collect();
        text += &table(&["parameter", "before", "found", "unit", "95 % interval", "profile", ""], &rows);
        text += &format!("\n  misfit {:.1} before, {:.1} after", estimate.misfit.0, estimate.misfit.1);
        text += &match estimate.freedom {
            0 => "; as many readings as parameters: nothing is left to judge the fit by\n".to_string(),
            n => format!(", {n} degrees of freedom; a misfit this large or larger has probability {:.3}\n", estimate.probability),
        };
        if problem.free.len() > 1 {
            text += "\n  correlation\n";
            for i in 0..problem.free.len() {
                let row: Vec<String> = (0..=i).map(|j| format!("{:6.2}", estimate.correlation[(i, j)])).collect();
                text += &format!("    {}  {}\n", row.join(" "), problem.free[i].parameter.name);
            }
        }
        for open in &estimate.undetermined {
            let reach = if open.deviation.is_finite() {
                format!("standard deviation {} %", significant(100.0 * open.deviation, 2))
            } else {
                "no limit at all".into()
            };
            text += &format!("\n  these readings cannot determine {} ({reach})\n", open.text);
        }
        text += "\n";
        let rows = reading_rows(&problem.data, &estimate.predictions.0, &estimate.predictions.1);
        text += &table(&["test", "sensor", "measured degC", "before", "after", "difference K"], &rows);
        if let Some((others, before, after)) = &self.held_out {
            text += &format!(
                "\nnot used, predicted untouched (root mean square difference {:.3} K, {:.3} K before)\n\n",
                rms(others, after),
                rms(others, before)
            );
            text += &table(&["test", "sensor", "measured degC", "before", "after", "difference K"], &reading_rows(others, before, after));
        }
        if let Some(best) = self.advice.first() {
            text += &format!("\nwhat would tell more: a steady test at {}, all {} sensors\n", self.condition(best), best.sensors.len());
            for (k, free) in problem.free.iter().enumerate() {
                text += &format!("  the interval of {} would shrink to {:.0} %\n", free.parameter.name, 100.0 * best.shrink[k]);
            }
        }
        text += &format!("\nwrote {}\n{:.2} s, {} predictions\n", self.path.display(), self.seconds, estimate.evaluations);
        text
    }

    fn condition(&self, advice: &Advice) -> String {
        let of = |(v, si): (&crate::machine::Variable, &f64)| {
            let value = express(*si, &v.unit, v.dimension).unwrap_or(*si);
            format!("{} {} {}", v.name, significant(value, 4), v.unit)
        };
        self.problem.study.model.machine.variables.iter().zip(advice.condition.si()).map(of).collect::<Vec<_>>().join(", ")
    }

    fn json(&self) -> Value {
        let (problem, estimate) = (self.problem, self.estimate);
        let finite = |v: f64| if v.is_finite() { json!(v) } else { Value::Null };
        let parameters: Map<String, Value> = (0..problem.free.len())
            .map(|k| {
                let p = &problem.free[k].parameter;
                let profile = self.profiles.iter().find(|f| f.parameter == k);
                let value = json!({
                    "unit": p.unit, "before": p.shown(p.value), "value": p.shown(estimate.values[k]),
                    "low": p.shown(estimate.intervals[k].0), "high": p.shown(estimate.intervals[k].1),
                    "at_bound": estimate.at_bound[k],
                    "profile": profile.map(|f| json!({
                        "low": f.interval.0.map(|v| p.shown(v)), "high": f.interval.1.map(|v| p.shown(v)),
                        "points": f.points.iter().map(|(v, rise)| json!([p.shown(*v), rise])).collect::<Vec<_>>(),
                    })),
                });
                (p.name.clone(), value)
            })
            .collect();
        let names: Vec<&str> = problem.free.iter().map(|f| f.parameter.name.as_str()).collect();
        let n = names.len();
        json!({
            "parameters": parameters,
            "correlation": {"names": names, "matrix": (0..n).map(|i| (0..n).map(|j| estimate.correlation[(i, j)]).collect::<Vec<_>>()).collect::<Vec<_>>()},
            "misfit": {"before": estimate.misfit.0, "after": estimate.misfit.1, "dof": estimate.freedom, "p": estimate.probability},
            "undetermined": estimate.undetermined.iter().map(|u| json!({"text": u.text, "weights": u.weights, "deviation": finite(u.deviation)})).collect::<Vec<_>>(),
            "readings": reading_json(&problem.data, &estimate.predictions.0, &estimate.predictions.1),
            "held_out": self.held_out.as_ref().map(|(data, before, after)| json!({
                "rmse_before_K": rms(data, before), "rmse_after_K": rms(data, after), "readings": reading_json(data, before, after),
            })),
            "next_tests": self.advice.iter().take(5).map(|a| {
                let condition: Map<String, Value> = problem.study.model.machine.variables.iter().zip(a.condition.si())
                    .map(|(v, si)| (v.name.clone(), json!(format!("{} {}", significant(express(*si, &v.unit, v.dimension).unwrap_or(*si), 6), v.unit)))).collect();
                json!({"condition": condition, "gain_nats": a.gain, "shrink": a.shrink})
            }).collect::<Vec<_>>(),
            "starts": estimate.ends,
            "machine": self.path.display().to_string(),
            "evaluations": estimate.evaluations,
            "seconds": self.seconds,
        })
    }
}

fn plural(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

fn rms(data: &Data, predicted: &[f64]) -> f64 {
    let readings = whiten::readings(data);
    (readings.iter().zip(predicted).map(|(r, p)| (r - p).powi(2)).sum::<f64>() / readings.len().max(1) as f64).sqrt()
}

/// Rows for a reader: of logs only the last of each test.
fn reading_rows(data: &Data, before: &[f64], after: &[f64]) -> Vec<Vec<String>> {
    let readings = whiten::readings(data);
    let is_last = |r: usize| !data.is_transient() || data.rows.iter().rposition(|row| row.test == data.rows[r].test) == Some(r);
    let places = whiten::places(data);
    let of = |(i, (r, k)): (usize, &(usize, usize))| {
        is_last(*r).then(|| {
            vec![
                data.rows[*r].test.clone(),
                data.names[*k].clone(),
                format!("{:.2}", celsius(readings[i])),
                format!("{:.2}", celsius(before[i])),
                format!("{:.2}", celsius(after[i])),
                format!("{:+.2}", after[i] - readings[i]),
            ]
        })
    };
    places.iter().enumerate().filter_map(of).collect()
}

fn reading_json(data: &Data, before: &[f64], after: &[f64]) -> Vec<Value> {
    let readings = whiten::readings(data);
    let of = |(i, (r, k)): (usize, &(usize, usize))| {
        json!({"test": data.rows[*r].test, "time_s": data.rows[*r].time, "sensor": data.names[*k], "measured_degC": celsius(readings[i]),
            "before_degC": celsius(before[i]), "after_degC": celsius(after[i])})
    };
    whiten::places(data).iter().enumerate().map(of).collect()
}

/// The grid of two parameters.
fn scan(args: &Args, problem: &Problem, out: Output) -> Result<u8> {
    let clock = Instant::now();
    let [first, second] = args.scan.as_slice() else {
        return Err(Error::input("a scan goes over two parameters")
            .at_key("--scan")
            .read(args.scan.len())
            .help("give --scan twice: KEY=LOW..HIGH/STEP"));
    };
    let axes = [axis(first, &problem.study)?, axis(second, &problem.study)?];
    let target = if out.quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
    let total = (axes[0].1.len() * axes[1].1.len()) as u64;
    let bar = ProgressBar::with_draw_target(Some(total), target);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos} of {len} pairs, {elapsed} passed, {eta} left") {
        bar.set_style(style);
    }
    let done = AtomicU64::new(0);
    let found = identify::scan(problem, [(&axes[0].0, axes[0].1.clone()), (&axes[1].0, axes[1].1.clone())], &|| {
        bar.set_position(done.fetch_add(1, Ordering::Relaxed) + 1);
    })?;
    bar.finish_and_clear();
    let (i, j) = Scan::least(&found.misfit);
    let (m, n) = Scan::least(&found.mean);
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
    let clean = |t: &Vec<Vec<f64>>| {
        t.iter().map(|row| row.iter().map(|v| if v.is_finite() { json!(v) } else { Value::Null }).collect::<Vec<_>>()).collect::<Vec<_>>()
    };
    let json = json!({
        "names": found.names, "units": [unit(0), unit(1)], "axes": [values(0), values(1)],
        "misfit": clean(&found.misfit), "mean_difference_K": clean(&found.mean),
        "least_misfit": [shown(0, i), shown(1, j)], "least_mean_difference": [shown(0, m), shown(1, n)],
    });
    out.report(&text, &json);
    Ok(0)
}

/// `KEY=LOW..HIGH/STEP`
fn axis(text: &str, study: &Study) -> Result<(Parameter, Vec<f64>)> {
    let malformed = || {
        Error::input("this is no axis of a scan").at_key("--scan").read(text).help("write for example \"contact.motor.conductance=0 W/(m2 K)..1000 W/(m2 K)/10 W/(m2 K)\", or the bare numbers 0..1000/10 in the file's unit")
    };
    let (key, range) = text.split_once('=').ok_or_else(malformed)?;
    let (low, rest) = range.split_once("..").ok_or_else(malformed)?;
    let parameter = study.parameter(key)?;
    // The last slash that is followed by a number: units hold slashes too.
    let cut = rest
        .match_indices('/')
        .map(|(i, _)| i)
        .rfind(|i| rest[i + 1..].trim_start().starts_with(|c: char| c.is_ascii_digit() || c == '.'))
        .ok_or_else(malformed)?;
    let (high, step) = (&rest[..cut], &rest[cut + 1..]);
    let read = |text: &str| -> Result<f64> {
        match text.trim().parse::<f64>() {
            Ok(number) => crate::units::convert(number, &parameter.unit, parameter.dimension),
            Err(_) => parse(text, parameter.dimension).map_err(|e| e.at_key("--scan")),
        }
    };
    let (low, high, step) = (read(low)?, read(high)?, read(step)?);
    if !(step > 0.0 && high > low && ((high - low) / step) < 1e5) {
        return Err(malformed());
    }
    let count = ((high - low) / step + 1e-9).floor() as usize;
    Ok((parameter, (0..=count).map(|i| low + i as f64 * step).collect()))
}

fn figure(problem: &Problem, found: &Scan, axes: &[(Parameter, Vec<f64>); 2]) -> ValleyFigure {
    let (i, j) = Scan::least(&found.misfit);
    let readings = whiten::readings(&problem.data);
    let places = whiten::places(&problem.data);
    let name = |r: usize, k: usize| {
        let sensor = &problem.data.names[k];
        if problem.data.tests().len() > 1 { format!("{sensor}, {}", problem.data.rows[r].test) } else { sensor.clone() }
    };
    let trace = |along: usize, n: usize| {
        let (r, k) = places[n];
        let predicted = (0..found.axes[along].len())
            .map(|at| celsius(if along == 0 { found.predictions[at][j][n] } else { found.predictions[i][at][n] }));
        Trace { name: name(r, k), predicted: predicted.collect(), measured: celsius(readings[n]) }
    };
    // What moves by less than a twentieth of a kelvin over the whole axis says nothing there.
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
